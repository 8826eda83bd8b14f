"""HackAtari, as PyPI has it, with the import of OCAtari changed: every modification of every game runs."""

import contextlib
import importlib
import importlib.util
import shutil
import sys
import warnings
from pathlib import Path

import pytest

import ocjax
from tests.test_neighbours import IMPORT

STEPS = 8  # agent steps with a modification
# Modifications of HackAtari 0.0.6 that read an attribute which its environment does not have.
BROKEN = ("asterix", "obelix"), ("bankheist", "random_city"), ("boxing", "gravity"), ("choppercommand", "delay_shots")
SPEC = importlib.util.find_spec("hackatari")  # which does not import it
FILES = [] if SPEC is None else (Path(SPEC.origin).parent / "games").glob("*.py")
NAMES = sorted({f.stem for f in FILES} & {name.lower() for name in ocjax.games()})
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::RuntimeWarning:hackatari"),
    pytest.mark.skipif(SPEC is None, reason="needs the package hackatari"),
]


@pytest.fixture(scope="module")
def hackatari(tmp_path_factory):
    """The package's core module, imported from a copy in which `ocatari` is `ocjax.ocatari`."""
    folder = tmp_path_factory.mktemp("hackatari")
    shutil.copytree(Path(SPEC.origin).parent, folder / "hackatari")
    for path in (folder / "hackatari").rglob("*.py"):
        path.write_text(IMPORT.sub("ocjax.ocatari", path.read_text("utf-8")), "utf-8")
    sys.path.insert(0, str(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pygame
        yield importlib.import_module("hackatari.core")
    sys.path.remove(str(folder))


@pytest.mark.parametrize("name", NAMES or [pytest.param("", marks=pytest.mark.skip(reason="needs the package hackatari"))])
def test_modifications_run(hackatari, name):
    module = importlib.import_module(f"hackatari.games.{name}")
    known = [m for m in vars(getattr(module, "GameModifications", object)) if not m.startswith("_")]
    for modification in known:
        with pytest.raises(AttributeError) if (name, modification) in BROKEN else contextlib.nullcontext():
            run(hackatari, name, modification)


def run(hackatari, name, modification):
    env = hackatari.HackAtari(ocjax.load(name).name, modifs=[modification], mode="ram", hud=True, obs_mode="ori")
    env.reset(seed=0)
    for step in range(STEPS):
        observation, *_ = env.step(step % env.action_space.n)
    assert observation.shape == (*ocjax.load(name).screen, 3), modification
    assert any(o.category != "NoObject" for o in env.objects), modification
    env.close()
