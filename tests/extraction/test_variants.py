"""What modes and difficulties mean, checked in the emulator where a few frames show it."""

import numpy as np
import pytest

import ocjax
from ocjax.authoring import Variants, meanings_of_bits
from ocjax.emulators.start import variants
from tests.support.marks import some
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")

STARTS = (  # game, mode, difficulty, category, value, meaning
    ("BeamRider", 0, 0, "Sector", 1, "starts in sector 1"),
    ("BeamRider", 0, 1, "Sector", 8, "starts in sector 8"),
    ("Galaxian", 7, 0, "Round", 7, "starts at round 7"),
    ("Hero", 0, 0, "Level", 1, "starts at level 1"),
    ("Hero", 3, 0, "Level", 13, "starts at level 13"),
    ("Alien", 1, 0, "Life", 2, "2 lives"),
    ("Alien", 3, 0, "Life", 6, "6 lives"),
    ("MarioBros", 2, 0, "Life", 5, "5 lives"),
    ("MarioBros", 4, 0, "Life", 3, "3 lives"),
    ("Gravitar", 3, 0, "Lives", 100, "100 lives"),
    ("CrazyClimber", 2, 0, "Bonus", 30_000, "bonus of 30,000"),
)
EXPLAINED = [name for name in ocjax.games() if ocjax.load(name).variants.source]


def played(game, mode, difficulty, steps, actions=("NOOP",)):
    """The objects after each emulated frame, with the actions in rotation."""
    env = ocjax.make(
        game,
        obs="ram",
        game_mode=mode,
        game_difficulty=difficulty,
        frame_skip=1,
        repeat_action_probability=0,
    )
    meanings = env.unwrapped.get_action_meanings()
    env.reset(seed=0)
    rams = [np.ravel(env.step(meanings.index(actions[t % len(actions)]))[0]) for t in range(steps)]
    env.close()
    return ocjax.load(game).rem(np.stack(rams))


def values(objects, category):
    found = objects.of(category)
    return set(np.asarray(found.value)[np.asarray(found.valid)].tolist())


@pytest.mark.parametrize("name", some(6, EXPLAINED))  # each starts an emulator
def test_the_emulator_has_the_numbers(name):
    game = ocjax.load(name)
    for meanings, numbers in zip(
        (game.variants.modes, game.variants.difficulties), variants(game), strict=True
    ):
        assert set(meanings) <= set(numbers)
        assert not meanings or len(meanings) == len(numbers)


def test_many_games_are_explained():
    assert len(EXPLAINED) >= 29


@pytest.mark.parametrize(
    ("title", "mode", "difficulty", "category", "value", "meaning"),
    some(3, STARTS),
)
def test_a_game_starts_as_its_variant_says(title, mode, difficulty, category, value, meaning):
    known = ocjax.load(title).variants
    assert meaning in known.modes.get(mode, "") + known.difficulties.get(difficulty, "")
    assert values(played(title, mode, difficulty, 100), category) == {value}


@pytest.mark.parametrize(("difficulty", "enemy", "player"), [(1, 8, 16), (2, 16, 8)])
def test_paddles_of_pong(difficulty, enemy, player):
    objects = played("Pong", 0, difficulty, 200)
    assert np.asarray(objects.of("Enemy").h).max() == enemy
    assert np.asarray(objects.of("Player").h).max() == player


@pytest.mark.parametrize("mode", some(3, range(16)))
def test_modes_of_space_invaders(mode):
    objects = played("SpaceInvaders", mode, 0, 300)
    meaning = ocjax.load("SpaceInvaders").variants.modes[mode]
    lefts = np.asarray(objects.of("Shield").x)[:, 1]
    assert (len(set(lefts.tolist())) > 1) == ("moving shields" in meaning)
    shown = np.asarray(objects.of("Alien").valid).mean()
    assert (shown < 0.5) == ("invisible invaders" in meaning)


@pytest.mark.parametrize(("mode", "cars", "width"), [(0, 10, 8), (3, 10, 16)])
def test_modes_of_freeway(mode, cars, width):
    found = played("Freeway", mode, 0, 100).of("Car")
    widths = np.asarray(found.w)[np.asarray(found.valid)]
    assert np.median(widths) == width
    assert round(np.median(np.asarray(found.valid).sum(1))) == cars


def test_the_missile_of_river_raid():
    def moved(difficulty):
        shot = ("NOOP",) * 80 + ("FIRE",) * 4 + ("RIGHT",) * 10
        missile = played("Riverraid", 0, difficulty, len(shot), shot).of("PlayerMissile")
        return np.ptp(np.asarray(missile.x)[np.asarray(missile.valid)])

    assert moved(0) > 0
    assert moved(1) == 0


def test_the_special_move_of_asteroids():
    def shown(mode):
        down = ("NOOP",) * 60 + ("DOWN",) * 4 + ("NOOP",) * 16
        return played("Asteroids", mode, 0, 80, down).of("Player")[-1]

    assert not np.asarray(shown(0).valid).any()  # hyperspace
    assert np.asarray(shown(16).orientation).item() == 8  # turned about
    assert np.asarray(shown(24).orientation).item() == 0


def test_wrong_variants():
    game = ocjax.load("Pong")
    with pytest.raises(ValueError, match=r"Pong .*variants: .*need a source"):
        game.replaced(variants=Variants({0: "usual"}))


def test_bits():
    assert meanings_of_bits(("a", "b"), "none") == {0: "none", 1: "a", 2: "b", 3: "a, b"}


def test_parts_and_games_without_display_keep_the_meanings():
    game = ocjax.load("Pong")
    assert game.without_hud().variants == game.part("Ball").variants == game.variants
    assert game.rem(excerpt("Pong")["rams"][:2]).of("Ball").game.variants == game.variants
