"""The scripts in the tables of docs/scripts.md run, or fail, as the tables say. They need checkouts
of the other projects.

This file is also the program that runs one script: `python tests/test_neighbours.py SCRIPT
[ARGUMENTS]`.
"""

import functools
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest

ROOT = Path(__file__).resolve().parents[1]  # as a program, this file cannot import tests.support
STEPS = 100  # a script that makes this many steps works
SECONDS = 120  # then the test ends it
ROW = re.compile(
    r"^\| `(OC_Atari|HackAtari|NUDGE|blendrl)/?(\S*)` \| (.+?) \| (works|changed|refused) \| "
    r"?(.*?) ?\|$",
    re.MULTILINE,
)
QUOTED = re.compile(r"`(.+?)`")
EDIT = re.compile(r"`([^`]+)` → `([^`]+)`")
IMPORT = re.compile(r"\bocatari(\.\w+)*(?= import)")  # of OCAtari's modules
ABSENT = re.compile(
    r"No module named '(?!ocatari|core|utils|vision)(\w+)"
)  # a package, not a part of OCAtari
SCREENLESS = {"MPLBACKEND": "Agg", "SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
SCRIPTS = [
    pytest.param(project, Path(folder), script, result, notes, id=f"{project}/{folder}/{script}")
    for project, folder, scripts, result, notes in ROW.findall(
        (ROOT / "docs" / "scripts.md").read_text("utf-8")
    )
    for script in QUOTED.findall(scripts)
]


@pytest.fixture(scope="module")
def copy_of(request, tmp_path_factory):
    """Copies a checkout's code without OCAtari itself; its imports are changed."""

    @functools.cache
    def copy(project):
        option = f"--{project.lower().replace('_', '-')}"
        checkout = request.config.getoption(option)
        if checkout is None:
            pytest.skip(f"needs {option} with the path of a checkout")
        folder = tmp_path_factory.mktemp(project)
        for path in checkout.rglob("*.py"):
            name = path.relative_to(checkout)
            if name.parts[0] != "ocatari":
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_text(
                    IMPORT.sub("ocjax.ocatari", path.read_text("utf-8")), "utf-8"
                )
        for path in checkout.glob("scripts/*.pickle"):  # states of games
            shutil.copy(path, folder / "scripts")
        return folder

    return copy


@pytest.mark.parametrize(("project", "folder", "script", "result", "notes"), SCRIPTS)
def test_script(copy_of, tmp_path, project, folder, script, result, notes):
    root = copy_of(project)
    hackatari = (
        [copy_of("HackAtari")] if project in ("NUDGE", "blendrl") else []
    )  # their environments may be HackAtari's
    roots = [root, *hackatari, root / "nsfr"]
    name, *arguments = script.split()
    path = root / folder / name
    text = path.read_text("utf-8")
    for old, new in EDIT.findall(notes) if result == "changed" else ():
        assert IMPORT.sub("ocjax.ocatari", old) in text
        text = text.replace(IMPORT.sub("ocjax.ocatari", old), new)
    path.write_text(text, "utf-8")
    environment = {
        k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")
    } | SCREENLESS
    environment["PYTHONPATH"] = os.pathsep.join([*map(str, roots), *sys.path])
    log = tmp_path / "errors"
    with log.open("wb") as errors:
        code = subprocess.run(
            [sys.executable, __file__, path, *arguments],
            cwd=root if project in ("NUDGE", "blendrl") else path.parent,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            timeout=SECONDS,
        ).returncode
    error = log.read_text("utf-8", "replace")
    if (absent := ABSENT.search(error)) and code:
        pytest.skip(f"the script imports {absent[1]}, which is not installed")
    if result == "refused":
        assert code
        assert QUOTED.search(notes)[1] in error
    else:
        assert code == 0, error


def run(path, *arguments):
    """Run a script until it ends or has made its steps, with stand-ins for the debugger, the
    keyboard and windows with figures."""
    from ale_py.env import AtariEnv
    from matplotlib import pyplot

    from ocjax._xla import process

    process.use_compilation_cache()
    steps, step = 0, AtariEnv.step  # which HackAtari and wrappers call, too

    def counted(self, action):
        nonlocal steps
        if steps == STEPS:
            os._exit(0)
        steps += 1
        return step(self, action)

    AtariEnv.step = counted
    sys.modules |= dict.fromkeys(("ipdb", "pynput"), MagicMock())
    __builtins__.input = lambda *_: ""
    pyplot.show = pyplot.pause = lambda *_, **__: pyplot.close("all")
    sys.argv, sys.path[0] = [path, *arguments], str(Path(path).parent)
    try:
        names = runpy.run_path(path, run_name="__main__")
        if "NudgeEnv" in names:
            play(names["NudgeEnv"](mode="ppo"))
    except SystemExit as end:
        if end.code:
            raise
    if not steps:
        sys.exit("it ends without a step")


def play(env):
    """Play with the environment that a file of NUDGE's kind defines."""
    env.reset()
    while True:
        env.step(0, is_mapped=True)


if __name__ == "__main__":
    run(*sys.argv[1:])
