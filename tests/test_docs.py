"""Python code in the README and the documentation runs unchanged."""

import ast
import json
import re
import subprocess
import sys

import jax
import numpy as np
import pytest

import ocjax
from ocjax.extraction.suites import SUITES
from tests.support.states import ROOT, excerpt

BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
README = ROOT / "README.md"
PAGES = [page for page in sorted((ROOT / "docs").glob("*.md")) if BLOCK.search(page.read_text())]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_code_of_pages(page):
    data = excerpt("Pong")
    names = {
        "ram": data["rams"][:2],
        "rams": data["rams"][:2],
        "frames": data["screens"][:2],
        "game": ocjax.load("Pong"),
    }
    names["records"] = [[("Player", 140, 100, 4, 16)], []]
    for block in BLOCK.findall(page.read_text()):
        made = []  # environments of the block, which are closed at its end
        for statement in ast.parse(
            block.replace("num_envs=64", "num_envs=2")
        ).body:  # fewer of them, to save time
            exec(ast.unparse(statement), names)
            made += [
                names[name] for name in ("env", "envs") if name in names and names[name] not in made
            ]
        for env in made:
            env.close()
        for name in {"env", "envs"} & names.keys():
            del names[name]


@pytest.mark.slow
def test_blocks_of_the_readme_run_as_they_stand(tmp_path):
    """The blocks run in order, in one fresh process."""
    code = "\n".join(BLOCK.findall(README.read_text(encoding="utf-8")))
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "PlayerScore 0: 12 x 20 at (116, 1)" in done.stdout


@pytest.mark.slow
def test_several_cores():
    """The block of the documentation, in a process that has not used JAX; each core has its own
    part of the results."""
    (block,) = re.findall(
        r"^```py\n(import os\n.*?)^```$",
        (ROOT / "docs" / "loops.md").read_text(),
        re.DOTALL | re.MULTILINE,
    )
    check = """
assert len(objects.xywh.sharding.device_set) == cores == 3
assert objects.valid.shape[0] == 64 * cores
"""
    code = block.replace("os.cpu_count()", "3", 1) + check
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_readme_counts_the_games():
    """If this fails, correct the README."""
    text = " ".join(README.read_text(encoding="utf-8").split())
    assert re.findall(r"supports (\d+) games", text) == [str(len(ocjax.games()))]
    listed = SUITES["ocatari"].games
    assert re.findall(r"all (\d+) games that OCAtari 2.2 lists", text) == [str(len(listed))]
    for suite in ("atari100k", "atari5", "atari10", "atari57", "ocatari"):
        assert set(SUITES[suite].games) <= set(ocjax.games())


def test_readable_records_of_the_readme():
    game, data = ocjax.load("Pong"), excerpt("Pong")
    state = jax.tree.map(np.asarray, game.rem(data["rams"]))[0]
    records = state.to_list()
    assert [game.slices[r["category"]].start + r["slot"] for r in records] == np.flatnonzero(
        state.valid
    ).tolist()
    for record in records:
        own, slot = state.of(record["category"]), record["slot"]
        assert [record[field] for field in "xywh"] == own.xywh[slot].tolist()
        assert list(record["rgb"]) == own.rgb[slot].tolist()
        assert record.get("value", 0) == own.value[slot]


@pytest.mark.slow
@pytest.mark.parametrize(
    "notebook", sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem
)
def test_notebooks_run(notebook, tmp_path):
    """The code of a notebook runs in a fresh process."""
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert notebook.stat().st_size < 400_000
