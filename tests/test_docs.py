"""Python code in the README and the documentation runs unchanged."""

import ast
import importlib.util
import json
import os
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


def run(code, folder):
    """The output of a block in a fresh process."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("number", range(4))
def test_a_block_of_the_readme_runs_alone(number, tmp_path):
    run(BLOCK.findall(README.read_text(encoding="utf-8"))[number], tmp_path)


def test_number_of_blocks():
    assert len(BLOCK.findall(README.read_text(encoding="utf-8"))) == 4


@pytest.mark.slow
def test_output_in_the_readme(tmp_path):
    text = README.read_text(encoding="utf-8")
    block, output = re.findall(
        r"^```python\n(.*?)^```\n\n<!-- output -->\n```\n(.*?)^```$", text, re.DOTALL | re.MULTILINE
    )[0]
    assert run(block, tmp_path) == output


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
    places = (r"\) for (\d+) games\.", r"agreement in all (\d+) games", r"The (\d+) games are all")
    for place in places:
        assert re.findall(place, text) == [str(len(ocjax.games()))], place
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


NOTEBOOKS = pytest.mark.parametrize(
    "notebook", sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem
)


@NOTEBOOKS
def test_stored_outputs_have_no_warnings(notebook):
    """Nor paths of the machine that ran the notebook."""
    text = notebook.read_text("utf-8")
    assert not re.search(r"Warning|Traceback|site-packages|\.py:\d", text)
    assert '"name": "stderr"' not in text


@pytest.mark.slow
@NOTEBOOKS
def test_notebooks_run(notebook, tmp_path):
    """The code of a notebook runs in a fresh process."""
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    packages = re.findall(r"^(?:from|import) (\w+)", code, flags=re.MULTILINE)
    missing = [package for package in packages if importlib.util.find_spec(package) is None]
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert notebook.stat().st_size < 400_000


def test_terrain_page_lists_all_games_and_kinds():
    rows = [
        f"| {game.name} | {', '.join(kind.name for kind in game.terrain)} |"
        for game in map(ocjax.load, ocjax.games())
        if game.terrain
    ]
    page = (ROOT / "docs" / "terrain.md").read_text()
    assert "\n".join(rows) in page
    assert f"In {len(rows)} games" in page
