"""The public names of the modules that users and game files import from: `__all__` is complete,
documented and typed."""

import ast
import importlib.util
import inspect
from pathlib import Path

import pytest

import ocjax
from ocjax import authoring
from tests.support.states import ROOT

MODULES = (
    "ocjax",
    "ocjax.atariari",
    "ocjax.authoring",
    "ocjax.console.boxes",
    "ocjax.console.compass",
    "ocjax.console.fonts",
    "ocjax.console.ops",
    "ocjax.console.palette",
    "ocjax.console.ram",
    "ocjax.console.registers",
    "ocjax.console.rom",
    "ocjax.datasets",
    "ocjax.emulators.variations",
    "ocjax.envs",
    "ocjax.errors",
    "ocjax.evaluation",
    "ocjax.extraction.categories",
    "ocjax.extraction.declaration",
    "ocjax.extraction.game",
    "ocjax.extraction.suites",
    "ocjax.extraction.names",
    "ocjax.extraction.objects",
    "ocjax.extraction.records",
    "ocjax.extraction.registry",
    "ocjax.files",
    "ocjax.jaxatari",
    "ocjax.layouts",
    "ocjax.ocatari",
    "ocjax.recordings",
    "ocjax.sb3",
    "ocjax.transforms.drawing",
    "ocjax.transforms.game_objects",
    "ocjax.transforms.masks",
    "ocjax.transforms.perturbation",
    "ocjax.transforms.relations",
    "ocjax.transforms.segmentation",
    "ocjax.transforms.tracking",
    "ocjax.vision.colors",
    "ocjax.vision.displays",
    "ocjax.vision.filters",
    "ocjax.vision.pictures",
    "ocjax.vision.rules",
    "ocjax.vision.shades",
    "ocjax.vision.shapes",
    "ocjax.vision.steps",
    "ocjax.vision.unknown",
)


@pytest.fixture(params=MODULES)
def module(request):
    if request.param == "ocjax.sb3":
        pytest.importorskip("stable_baselines3", reason="the extra `sb3` is not installed")
    return importlib.import_module(request.param)


def _defined(module):
    """The public names that the module's own statements bind."""
    for node in ast.parse(Path(module.__file__).read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        for target in [
            *getattr(node, "targets", ()),
            *([node.target] if isinstance(node, ast.AnnAssign) else ()),
        ]:
            yield from (n.id for n in ast.walk(target) if isinstance(n, ast.Name))


def test_all_names_the_public_definitions(module):
    assert module.__doc__
    assert len(set(module.__all__)) == len(module.__all__)
    assert not [name for name in module.__all__ if not hasattr(module, name)]
    assert not {name for name in _defined(module) if not name.startswith("_")} - set(module.__all__)


def test_the_package_exports_these_names():
    names = "games load make make_vec Game Objects Relations velocity track merge_frames relations"
    others = "perturb segment edit use_compilation_cache retain_freed_memory"
    assert set(ocjax.__all__) == {*names.split(), *others.split()}
    exported = [name for name in dir(ocjax) if importlib.util.find_spec(f"ocjax.{name}") is None]
    assert set(exported) == {*ocjax.__all__, "__version__"}


@pytest.mark.parametrize(
    ("old", "module"),
    [
        ("Box", "authoring"),
        ("Category", "authoring"),
        ("GameError", "errors"),
        ("UnknownGameError", "errors"),
    ],
)
def test_old_names_warn(old, module):
    with pytest.warns(DeprecationWarning, match=f"is now ocjax.{module}.{old}"):
        found = getattr(ocjax, old)
    assert found is getattr(getattr(ocjax, module), old)


def _imported(path):
    """The names that a game file imports from `ocjax.authoring`."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module == "ocjax.authoring":
            yield from (alias.name for alias in node.names)


def test_authoring_exports_the_names_that_games_import():
    names = {name for path in (ROOT / "extractors").glob("**/*.py") for name in _imported(path)}
    assert names == set(authoring.__all__)


def _functions(module):
    """The public functions and classes of a module, and the methods and properties of the
    classes."""
    for name in module.__all__:
        found = getattr(module, name)
        if not (
            inspect.isclass(found) or inspect.isfunction(found)
        ) or not found.__module__.startswith("ocjax"):
            continue
        yield name, found
        for key, member in vars(found).items() if inspect.isclass(found) else ():
            member = (
                getattr(member, "fget", None)
                or getattr(member, "func", None)
                or getattr(member, "__func__", None)
                or member
            )
            if (
                not key.startswith("_")
                and inspect.isfunction(member)
                and member.__module__.startswith("ocjax")
            ):
                yield f"{name}.{key}", member


def test_public_names_are_documented_and_typed(module):
    for name, found in _functions(module):
        assert found.__doc__, name
        if inspect.isfunction(found):
            signature = inspect.signature(found)
            untyped = [
                p
                for p in signature.parameters.values()
                if p.annotation is p.empty and p.name not in ("self", "cls")
            ]
            assert not untyped, (name, untyped)
            assert signature.return_annotation is not signature.empty, name
