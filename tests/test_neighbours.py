"""The scripts in the tables of docs/neighbours.md run, or fail, as the tables say. They need checkouts of the other projects."""

import builtins
import functools
import re
import runpy
import sys
from pathlib import Path

import pytest

from ocjax.ocatari import OCAtari

PAGE = Path(__file__).parent.parent / "docs" / "neighbours.md"
ROW = re.compile(r"^\| (OC_Atari|HackAtari|NUDGE|blendrl) \| `(\S+)(?: (.*?))?` \| (works|changed|refused) \| ?(.*?) ?\|$", re.MULTILINE)
EDIT = re.compile(r"`([^`]+)` → `([^`]+)`")
IMPORT = re.compile(r"\bocatari(\.\w+)*(?= import)")  # of OCAtari's modules
STEPS = 120  # after which a script has shown that it runs
ROWS = ROW.findall(PAGE.read_text(encoding="utf-8"))


class Enough(BaseException):
    """A script has made its steps."""


@functools.cache
def copy_of(checkout, folder):
    """A copy of a project's Python files in which OCAtari's imports are changed; OCAtari itself is left out."""
    for path in checkout.rglob("*.py"):
        name = path.relative_to(checkout)
        if name.parts[0] != "ocatari":
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(IMPORT.sub("ocjax.ocatari", path.read_text(encoding="utf-8")), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("neighbours")


@pytest.fixture
def stopping(monkeypatch):
    """Every environment raises `Enough` after some steps."""
    steps, detect_objects = 0, OCAtari.detect_objects  # HackAtari replaces `step`

    def counted(self):
        nonlocal steps
        steps += 1
        if steps > STEPS:
            raise Enough
        detect_objects(self)

    monkeypatch.setattr(OCAtari, "detect_objects", counted)
    monkeypatch.setattr(builtins, "input", lambda *_: "")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.setattr(pyplot, "show", lambda *_, **__: pyplot.close("all"))  # figures pile up otherwise


def use(names):
    """Play with the environment that a file of NUDGE's kind defines."""
    env = names["NudgeEnv"](mode="ppo")
    env.reset()
    while True:
        env.step(0, is_mapped=True)


@pytest.mark.filterwarnings("default")  # warnings of other projects
@pytest.mark.parametrize(("project", "script", "arguments", "result", "notes"), ROWS, ids=[" ".join(row[:2]) for row in ROWS])
def test_script(request, monkeypatch, folder, stopping, project, script, arguments, result, notes):
    roots = []
    for name in (project, *["HackAtari"] * (project in ("NUDGE", "blendrl"))):  # whose environments may be HackAtari's
        option = f"--{name.lower().replace('_', '-')}"
        checkout = request.config.getoption(option)
        if checkout is None:
            pytest.skip(f"needs {option} with the path of a checkout")
        roots.append(copy_of(checkout.resolve(), folder / name))
    root = roots[0]
    path = root / script
    text = path.read_text(encoding="utf-8")
    for old, new in EDIT.findall(notes) if result == "changed" else ():
        assert IMPORT.sub("ocjax.ocatari", old) in text
        text = text.replace(IMPORT.sub("ocjax.ocatari", old), new)
    path.write_text(text, encoding="utf-8")
    for name, value in {"MPLBACKEND": "Agg", "SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "path", [str(path.parent), *map(str, roots), str(root / "nsfr"), *sys.path])
    monkeypatch.setattr(sys, "argv", [path.name, *arguments.split()])
    monkeypatch.chdir(root if "NudgeEnv" in text else path.parent)
    error = run(path)
    for name in [n for n, m in sys.modules.items() if str(folder) in f"{vars(m).get('__file__')} {vars(m).get('__path__')}"]:
        del sys.modules[name]
    if result != "refused":
        assert error is None, error
        return
    assert error is not None
    assert re.search(r"`(.+?)`", notes)[1] in f"{type(error).__name__}: {error}"


def run(path):
    """Run a script; the error that ends it, or None if it makes its steps or ends by itself."""
    try:
        names = runpy.run_path(str(path), run_name="__main__")
        if "NudgeEnv" in names:
            use(names)
    except Enough:
        return None
    except ModuleNotFoundError as error:
        if error.name.split(".")[0] not in ("ocatari", "core", "utils", "vision"):
            pytest.skip(f"needs {error.name}")
        return error
    except (Exception, SystemExit) as error:
        return error
    return None
