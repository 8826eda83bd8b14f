"""HackAtari, as PyPI has it: with the import of OCAtari changed, every modification of every game
runs; variations write its bytes."""

import contextlib
import functools
import importlib
import importlib.util
import itertools
import shutil
import sys
import warnings
from pathlib import Path

import ale_py
import numpy as np
import pytest

import ocjax
from ocjax.console.rom_files import rom_path
from ocjax.emulators import variations
from ocjax.emulators.variations.mechanism import Moment
from tests.test_neighbours import IMPORT

STEPS = 8  # agent steps with a modification
# Modifications of HackAtari 0.0.6 that read an attribute which its environment does not have.
BROKEN = (
    ("asterix", "obelix"),
    ("bankheist", "random_city"),
    ("boxing", "gravity"),
    ("choppercommand", "delay_shots"),
)
SPEC = importlib.util.find_spec("hackatari")  # without an import of it
FRAMES = 700  # for the comparison of bytes
OWN = {
    "Alien:no_alien",
    "Freeway:stopped_cars",
    "Pong:parallel_enemy",
    "Riverraid:red_river",
    "SpaceInvaders:no_shields",
}
SWITCHED_OFF = (
    "edible_ghosts",
    "shark_no_movement_easy",
    "shark_no_movement_hard",
)  # HackAtari has the functions and ignores the names
RANDOM = {
    "Atlantis:random_enemies",
    "Boxing:drunken_boxing",
    "Freeway:align_all_cars",
    "Freeway:stop_random_car",
    "Kangaroo:randomize_kangaroo_position",
    "Venture:random_enemy_colors",
}
ONE_OF_OURS = {
    "DonkeyKong:random_start",
    "MontezumaRevenge:random_position_start",
}  # HackAtari always draws the same place
OTHER_FRAMES = {  # HackAtari's own counter selects its frames
    *(f"Breakout:{name}" for name in ("gravity", "inverse_gravity", "left_drift", "right_drift")),
    *(f"Pong:{direction}_drift" for direction in ("up", "down", "left", "right")),
    "Boxing:gravity",
    "Seaquest:gravity",
}
DIFFERENT = {
    "Asterix:obelix",  # AttributeError
    "BankHeist:random_city",  # AttributeError
    # HackAtari draws once in its environment's life, also a byte without pills
    "MsPacman:end_game",
    "Pong:lazy_enemy",  # HackAtari's enemy stands only after its stroke
    "Seaquest:random_color_enemies",  # any colour
    "Seaquest:unlimited_oxygen",  # HackAtari's takes lives at the surface
    "SpaceInvaders:disable_shield_right",  # HackAtari clears one byte more
    "Tennis:wind_effect",  # HackAtari mirrors the ball's row in every frame
}
PUBLISHED = sorted(set(variations.ALL) - OWN)
FILES = [] if SPEC is None else (Path(SPEC.origin).parent / "games").glob("*.py")
NAMES = sorted({f.stem for f in FILES} & {name.lower() for name in ocjax.games()})
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::RuntimeWarning:hackatari"),
    pytest.mark.skipif(SPEC is None, reason="needs the package hackatari"),
]


@pytest.fixture(scope="module")
def hackatari(tmp_path_factory):
    """The package's core module, imported from a copy with `ocjax.ocatari` for `ocatari`."""
    folder = tmp_path_factory.mktemp("hackatari")
    shutil.copytree(Path(SPEC.origin).parent, folder / "hackatari")
    for path in (folder / "hackatari").rglob("*.py"):
        path.write_text(IMPORT.sub("ocjax.ocatari", path.read_text("utf-8")), "utf-8")
    sys.path.insert(0, str(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pygame
        yield importlib.import_module("hackatari.core")
    sys.path.remove(str(folder))


@pytest.mark.parametrize(
    "name",
    NAMES or [pytest.param("", marks=pytest.mark.skip(reason="needs the package hackatari"))],
)
def test_modifications_run(hackatari, name):
    module = importlib.import_module(f"hackatari.games.{name}")
    known = [
        m
        for m, value in vars(getattr(module, "GameModifications", object)).items()
        if not m.startswith("_") and callable(value)
    ]
    for modification in known:
        with (
            pytest.raises(AttributeError)
            if (name, modification) in BROKEN
            else contextlib.nullcontext()
        ):
            run(hackatari, name, modification)


def run(hackatari, name, modification):
    env = hackatari.HackAtari(
        ocjax.load(name).name, modifs=[modification], mode="ram", hud=True, obs_mode="ori"
    )
    env.reset(seed=0)
    for step in range(STEPS):
        observation, *_ = env.step(step % env.action_space.n)
    assert observation.shape == (*ocjax.load(name).screen, 3), modification
    assert any(o.category != "NoObject" for o in env.objects), modification
    env.close()


class Console:
    """RAM behind the methods that HackAtari calls, as Python's integers, which do not overflow."""

    timer = 0

    def __init__(self, ram):
        self.ram = ram

    def get_ram(self):
        return [int(value) for value in self.ram]

    def set_ram(self, address, value):
        self.ram[address] = value % 256


@functools.cache
def functions_of(game):
    """HackAtari's module of a game."""
    path = Path(SPEC.origin).parent / "games" / f"{game}.py"
    spec = importlib.util.spec_from_file_location(f"hackatari_{game}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def functions(key, console):
    """HackAtari's functions for a name: of every frame, and of the beginning of a game."""
    game, name = key.lower().split(":")
    module = functions_of(game)
    if game == "yarsrevenge":  # which HackAtari cannot load
        return [lambda: module.static_enemy_position(console)], []
    if name in SWITCHED_OFF:
        return [getattr(module.GameModifications(console), name)], []
    steps, resets, _ = module.modif_funcs(console, [name])
    return steps, resets


def frames(key):
    """The RAM before each frame with a variation, and the RAM after the variation's writes."""
    game, variation = ocjax.load(key.split(":")[0]), variations.ALL[key]
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    ale, rng, before = ale_py.ALEInterface(), np.random.default_rng(1), None
    ale.setFloat("repeat_action_probability", 0)
    ale.loadROM(rom_path(game.rom))
    ale.reset_game()
    for frame in range(FRAMES):
        if frame % 16 == 0:
            action = ale_py.Action(int(rng.integers(18)))
        ram = ale.getRAM()
        ours = ram.copy()
        variation(ours, Moment(ram if before is None else before, 0, frame, frame))
        yield ram, ours
        for address in np.flatnonzero(ram != ours).tolist():
            ale.setRAM(address, int(ours[address]))
        before = ours
        ale.act(action)
        if ale.game_over():
            return


def called(console, ram, some):
    """The RAM after some functions."""
    console.ram = ram.copy()
    for function in some:
        function()
    return console.ram


@pytest.mark.parametrize(
    "key", [key for key in PUBLISHED if key not in RANDOM | ONE_OF_OURS | DIFFERENT]
)
def test_variations_write_its_bytes(key):
    console = Console(None)
    steps, resets = functions(key, console)
    assert steps or resets
    for frame, (ram, ours) in enumerate(frames(key)):
        theirs = called(console, ram, steps if frame else [*resets, *steps])
        if key in OTHER_FRAMES:  # both write the same bytes
            both = (theirs != ram) & (ours != ram)
            assert (theirs[both] == ours[both]).all()
        else:
            assert (theirs == ours).all(), frame


@pytest.mark.parametrize("key", sorted(RANDOM))
def test_random_variations_write_what_it_may_write(key):
    console = Console(None)
    for ram, ours in itertools.islice(frames(key), 1 if "Kangaroo" in key else 20):
        possible = []
        for _ in range(1000):
            steps, resets = functions(key, console)
            possible.append(called(console, ram, [*resets, *steps]))
        assert (np.stack(possible) == ours).any(0).all()


@pytest.mark.parametrize("key", sorted(ONE_OF_OURS))
def test_its_place_is_one_of_the_random_places(key):
    places = {tuple(choice.writes.items()) for choice in variations.ALL[key].choices}
    console, found = Console(None), 0
    steps, resets = functions(key, console)
    for frame, (ram, ours) in enumerate(frames(key)):
        theirs = called(console, ram, steps if frame else [*resets, *steps])
        if (theirs != ram).any() and not (ours == ram).all():
            addresses = np.flatnonzero(ours != ram)
            found += 1
            assert any(all(theirs[a] == value for a, value in place) for place in places)
            assert any(all(ours[a] == value for a, value in place) for place in places)
            assert {int(a) for a in addresses} <= {a for place in places for a, _ in place}
    assert found
