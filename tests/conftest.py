import hashlib
import os
from pathlib import Path

import jax
import pytest
from hypothesis import Phase, settings

import ocjax
from ocjax._xla import process
from tests.support.concerned import add_categories
from tests.support.states import excerpt

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")
# The setting also applies to processes that tests start.
os.environ["JAX_COMPILATION_CACHE_DIR"] = str(process.use_compilation_cache())
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", str(process.MIN_CACHED_SECONDS))

# Shrinking a failing batch of frames takes minutes and adds no information to the failure.
settings.register_profile(
    "ocjax", deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate]
)
settings.load_profile("ocjax")

FEW_GAMES = 4  # tested in full if no others are chosen, as by `-k Pong`


def pytest_addoption(parser):
    parser.addoption(
        "--all", action="store_true", help="also the tests that take long, and more random states"
    )
    parser.addoption(
        "--fuzz",
        type=int,
        help="random RAM states and random frames a game; 64 by default, 1,000 with --all",
    )
    parser.addoption(
        "--soak",
        type=int,
        default=100_000,
        help="agent steps in which memory must not grow; CI takes a million",
    )
    parser.addoption("--cleanrl", type=Path, help="a checkout of CleanRL, whose ppo.py is to run")
    parser.addoption("--atari-ari", type=Path, help="a checkout of AtariARI's repository")
    parser.addoption("--jaxatari", type=Path, help="a checkout of JAXAtari")
    parser.addoption("--ocatari", type=Path, help="an interpreter that has OCAtari")
    for project in ("OC_Atari", "HackAtari", "NUDGE", "blendrl"):
        parser.addoption(
            f"--{project.lower().replace('_', '-')}",
            type=Path,
            help=f"a checkout of {project}, whose scripts are to run",
        )
    parser.addoption(
        "--game", action="append", help="only these games (may be given several times)"
    )


def pytest_generate_tests(metafunc):
    """Every test with the argument `game` runs on every game, or on every game with terrain."""
    if "game" in metafunc.fixturenames:
        names = metafunc.config.getoption("--game") or ocjax.games()
        games = [load(name) for name in names]
        if metafunc.definition.get_closest_marker("terrain"):
            games = [game for game in games if game.terrain]
        # One process compiles a game for all of its tests.
        params = [
            pytest.param(game, id=game.name, marks=pytest.mark.xdist_group(game.name))
            for game in games
        ]
        metafunc.parametrize("game", params, scope="session")


def load(name):
    """Load a game; an error names the categories that it concerns."""
    try:
        return ocjax.load(name)
    except Exception as error:
        add_categories(error)
        raise


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Errors in a game's files name the categories that they concern."""
    if call.excinfo is not None:
        add_categories(call.excinfo.value)
    return (yield)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """One process runs a module's tests without a game, so that it sets up fixtures and compiles
    programs once."""
    if not config.getoption("--all"):
        slow = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if not item.get_closest_marker("slow")]
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))


def game_of(item):
    """The game of a test, or None."""
    callspec = getattr(item, "callspec", None)
    return callspec.params.get("game") if callspec else None


_of_few_games = False  # whether the selected tests concern few games, or no game
_compiled_for = None


def pytest_collection_finish(session):
    global _of_few_games
    _of_few_games = (
        len({game.name for item in session.items if (game := game_of(item)) is not None})
        <= FEW_GAMES
    )


def pytest_runtest_setup(item):
    """Free the compiled programs of the previous game: a game takes thousands of memory mappings,
    and the system limits their number per process."""
    global _compiled_for
    game = game_of(item)
    if game is not _compiled_for:
        if _compiled_for is not None:
            jax.clear_caches()
        jax.config.update(
            "jax_disable_most_optimizations",
            game is not None and not is_thorough(game.name, item.config),
        )
        _compiled_for = game


def is_thorough(name, config):
    """Test a game in full: all games with `--all` or if few games are chosen, else one in eight,
    drawn by a hash.

    The programs of the other games are compiled without optimization of the machine code, in a
    third of the time; they compute the same integers. Tests do not compare their objects in
    arbitrary states and frames.
    """
    drawn = hashlib.sha256(name.encode()).digest()[0] % 8 == 0
    return (
        drawn
        or _of_few_games
        or config.getoption("--all")
        or config.getoption("--game") is not None
    )


@pytest.fixture(scope="module")
def quick_compilation():
    """Compile without optimization of the machine code, in two thirds of the time. Use this for
    tests with results that do not depend on it."""
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)
    jax.clear_caches()


@pytest.fixture
def thorough(game, request):
    return is_thorough(game.name, request.config)


@pytest.fixture(scope="session")
def truth(game):
    return excerpt(game.name)


@pytest.fixture(scope="session")
def fuzz(request):
    return request.config.getoption("--fuzz") or (
        1_000 if request.config.getoption("--all") else 64
    )
