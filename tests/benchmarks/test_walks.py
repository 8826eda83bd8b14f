"""The planner of `benchmarks/walks.py`, against plain definitions, and one walk in a game."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import ocjax

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def walks():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        spec = importlib.util.spec_from_file_location("walks", FOLDER / "walks.py")
        module = importlib.util.module_from_spec(spec)
        patch.setitem(__import__("sys").modules, "walks", module)
        spec.loader.exec_module(module)
    return module


def test_walkers_have_terrain_and_a_player(walks):
    for name, walker in walks.WALKERS.items():
        game = ocjax.load(name)
        assert game.terrain
        assert walker.player in game.slices


def test_free_positions(walks):
    blocked = np.random.default_rng(0).random((30, 40)) < 0.05
    free = walks.free_positions(blocked, (5, 3))
    for y in range(30):
        for x in range(40):
            inside = y + 3 <= 30 and x + 5 <= 40
            assert free[y, x] == (inside and not blocked[y : y + 3, x : x + 5].any())


def test_a_walk_arrives(walks):
    player = walks.Player("MsPacman", 0)
    player.play(500)
    result, length = walks.walk(player)
    assert result == "arrived"
    assert length >= walks.LEAST_DISTANCE
