"""Every variation changes the screen as described."""

import functools
import itertools

import numpy as np
import pytest

from ocjax.console.palette import to_rgb
from ocjax.emulators import variations
from ocjax.envs import make

STEPS, LONG, HOLD = 150, 1200, 8
LATE = {  # rare in random play, or (Donkey Kong) as usual in the first life
    "Atlantis:no_last_line",
    "DonkeyKong:random_start",
    "Frostbite:few_enemies",
    "Frostbite:many_enemies",
    "Frostbite:no_birds",
    "Kangaroo:disable_thrown_coconut",
    "KungFuMaster:infinite_lives",
    "NameThisGame:double_wave_length",
    "NameThisGame:endless_oxygen",
    "Tennis:always_upper_pitches",
    "Tennis:always_upper_player",
}
AS_AT_FIRST = {  # already the case until another level begins
    "Boxing:color_enemy_black",
    "Boxing:color_player_white",
    "DoubleDunk:enemy_color_white",
    "DoubleDunk:player_color_green",
    "Kangaroo:change_level_0",
    "MontezumaRevenge:set_level_0",
    "MsPacman:set_level_0",
}
OUT_OF_TOWN = {"BankHeist:random_city", "BankHeist:revisit_city"}
SHIRTS = {
    "white": 0x0E,
    "green": 0xB4,
    "red": 0x32,
    "yellow": 0x1C,
    "purple": 0x82,
    "blue": 0x9E,
}  # of Double Dunk
COLORED = [
    key
    for key in variations.ALL
    if ("color_" in key or (key.endswith("_cars") and ":all_" in key))
    and key not in AS_AT_FIRST | {"Seaquest:random_color_enemies"}
]
CENTERS = {"orange": (93, 80), "cyan": (83, 80), "pink": (93, 67), "red": (83, 67)}


def play(game, hook, steps, mode="raw", obs="pixels", hold=1, seed=1):
    """The environment and its observation after each step with random actions; a new game follows
    an ended one."""
    env = make(
        game, mode=mode, obs=obs, preset="deterministic-v4", full_action_space=True, hook=hook
    )
    env.reset(seed=0)
    actions = (
        np.random.default_rng(seed)
        .integers(int(env.action_space.n), size=steps)
        .repeat(hold)[:steps]
    )
    for action in actions.tolist():
        observation, _, terminated, truncated, _ = env.step(action)
        yield env, observation
        if terminated or truncated:
            env.reset()
    env.close()


@functools.cache
def frames(game, hook=None):
    return np.stack([frame for _, frame in play(game, hook, STEPS)])


def objects(game, hook, *categories, steps=400):
    """The objects of some categories that VEM finds in each frame."""
    return [
        [o for o in env.views() if o.category in categories]
        for env, _ in play(game, hook, steps, "vem", "objects", HOLD)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "key",
    [
        key
        for key in variations.ALL
        if key not in LATE | AS_AT_FIRST | OUT_OF_TOWN | {"BankHeist:no_police"}
    ],
)
def test_frames_differ(key):
    game = variations.ALL[key].game
    assert (frames(game, key) != frames(game)).any()


@pytest.mark.slow
@pytest.mark.parametrize("key", sorted(AS_AT_FIRST))
def test_what_the_game_has_anyway(key):
    game = variations.ALL[key].game
    assert (frames(game, key) == frames(game)).all()


@pytest.mark.slow
@pytest.mark.parametrize("key", sorted(LATE))
def test_frames_differ_after_long_play(key):
    pairs = zip(
        *(play(variations.ALL[key].game, hook, LONG, hold=HOLD, seed=0) for hook in (None, key)),
        strict=True,
    )
    assert any((a[1] != b[1]).any() for a, b in pairs)


def test_some_differ_quickly():
    for key in ("Freeway:stop_all_cars", "Skiing:invert_flags", "Pong:up_drift"):
        assert (frames(variations.ALL[key].game, key) != frames(variations.ALL[key].game)).any()


@pytest.mark.slow
@pytest.mark.parametrize("key", COLORED)
def test_colors(key):
    """The written colour covers more of the screen than without the variation."""
    v = variations.ALL[key]
    value, name = next(iter(v.writes.values())), key.rsplit("_", 1)[1]
    if (
        v.game == "ChopperCommand"
    ):  # the byte is an index into a table of colours, and a frame has many pixels of land
        value = {"black": 0, "white": 0x0E, "red": 0x30, "blue": 0x70, "green": 0x16}[name]
    elif v.game in ("DoubleDunk", "Frostbite"):  # the byte is a number, or changes a colour
        value = SHIRTS[name] if v.game == "DoubleDunk" else {"black": 0, "red": 0x3E}[name]
    color = np.asarray(to_rgb(np.uint8(value)))
    counts = [(frames(v.game, hook)[20:] == color).all(-1).sum() for hook in (None, key)]
    assert counts[1] > counts[0] + (
        10 if v.game in ("DoubleDunk", "Frostbite", "Venture") else 100
    ) * (STEPS - 20)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "categories"),
    [
        ("ChopperCommand:no_enemies", ("EnemyHelicopter", "EnemyPlane")),
        ("Frostbite:no_birds", ("Bird", "GreenFish", "Crab", "Clam")),
        ("Kangaroo:disable_coconut", ("FallingCoconut",)),
        ("Kangaroo:disable_thrown_coconut", ("ThrownCoconut",)),
        ("Riverraid:no_fuel", ("FuelDepot",)),
        ("Seaquest:disable_enemies", ("Shark", "Submarine", "SurfaceSubmarine")),
    ],
)
def test_categories_are_absent(key, categories):
    game = variations.ALL[key].game
    assert any(objects(game, None, *categories, steps=1000)[20:])
    assert not any(objects(game, key, *categories, steps=1000)[20:])


@pytest.mark.slow
def test_police_cars():
    assert any(objects("BankHeist", "only_police", "Police")[20:])
    assert not any(objects("BankHeist", "only_police", "Bank")[20:])
    assert not any(objects("BankHeist", ["only_police", "no_police"], "Police", "Bank")[20:])


@pytest.mark.slow
def test_ghosts():
    for found in objects("MsPacman", "caged_ghosts", "Ghost", steps=150)[20:]:
        assert all(70 <= o.x <= 90 and 60 <= o.y <= 90 for o in found)
    assert any(
        o.y < 50 for found in objects("MsPacman", None, "Ghost", steps=150)[20:] for o in found
    )


@pytest.mark.slow
def test_fish():
    assert any(o.x > 100 for found in objects("FishingDerby", None, "Fish")[40:] for o in found)
    assert all(
        o.x <= 92
        for found in objects("FishingDerby", "fish_on_player_side", "Fish")[40:]
        for o in found
    )
    assert all(
        60 <= o.x <= 92
        for found in objects("FishingDerby", "fish_in_middle", "Fish")[40:]
        for o in found
    )


@pytest.mark.slow
@pytest.mark.parametrize(("name", "x"), [("left", 42), ("middle", 74), ("right", 106)])
def test_shields(name, x):
    shields = [
        {o.x for found in objects("SpaceInvaders", hook, "Shield", steps=30) for o in found}
        for hook in (None, f"disable_shield_{name}")
    ]
    assert any(abs(left - x) < 5 for left in shields[0])
    assert not any(abs(left - x) < 5 for left in shields[1])
    assert shields[1]


@pytest.mark.slow
def test_cars_stand_still():
    parts = np.s_[
        60:, 26:182, [*range(40), *range(56, 100), *range(120, 150)]
    ]  # without the chickens
    assert not np.ptp(frames("Freeway", "stop_all_cars")[parts], axis=0).any()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["medium", "hard"])
def test_floes_stand_still(name):
    hooks = None, f"reposition_floes_{name}"
    columns = [
        {o.x for found in objects("Frostbite", hook, "FloatingBlock", steps=60)[20:] for o in found}
        for hook in hooks
    ]
    assert len(columns[0]) > 40
    assert len(columns[1]) < 20


@pytest.mark.slow
def test_oxygen_stays():
    assert (
        min(o.w for found in objects("Seaquest", None, "OxygenBar", steps=400)[100:] for o in found)
        < 40
    )
    long = objects("Seaquest", "unlimited_oxygen", "OxygenBar", "Player", steps=400)
    under = [
        o.w
        for found in long
        for o in found
        if o.category == "OxygenBar"
        if any(p.category == "Player" and p.y > 60 for p in found)
    ]
    assert under
    assert min(under) > 55


def columns(game, hook, category, steps=400):
    """The columns of the objects of a category in each frame."""
    return [[o.x for o in found] for found in objects(game, hook, category, steps=steps)]


@pytest.mark.slow
def test_demons_stay_in_their_columns():
    """Pictures of a demon begin in one of two columns."""
    moves = []
    for hook in (None, "static_enemies"):
        pairs = [
            (a, b)
            for a, b in itertools.pairwise(columns("DemonAttack", hook, "Enemy"))
            if len(a) == len(b)
        ]
        moves.append(
            np.mean([any(abs(x - y) > 1 for x, y in zip(a, b, strict=True)) for a, b in pairs])
        )
    assert moves[0] > 0.5
    assert moves[1] < 0.2


@pytest.mark.slow
def test_one_missile():
    mean = [
        np.mean([len(found) for found in objects("DemonAttack", hook, "EnemyMissile")])
        for hook in (None, "one_missile")
    ]
    assert mean[1] < mean[0] / 2


@pytest.mark.slow
def test_jets():
    """New ships have other types for one frame."""
    for hook in (None, "jets_only"):
        ships = [
            o.category
            for found in objects("Atlantis", hook, "GorgonShip", "BanditBomber")
            for o in found
        ]
        assert (
            ships.count("BanditBomber") > 0.9 * len(ships) if hook else "BanditBomber" not in ships
        )


@pytest.mark.slow
def test_the_enemy_of_yars_revenge_stays():
    rows = [
        {o.y for found in objects("YarsRevenge", hook, "Enemy", steps=60) for o in found}
        for hook in (None, "static")
    ]
    assert len(rows[0]) > 10
    assert len(rows[1]) <= 2


@pytest.mark.slow
def test_blue_ghosts_take_no_life():
    for hook in (None, "edible_ghosts"):
        lives = min(
            env.unwrapped.envs.pool.lives[0] for env, _ in play("MsPacman", hook, 700, hold=HOLD)
        )
        assert lives == 3 if hook else lives < 3


@pytest.mark.slow
def test_few_pills():
    assert min(len(found) for found in objects("MsPacman", None, "Pill", steps=60)[20:]) > 100
    assert all(
        0 < len(found) <= 8 for found in objects("MsPacman", "end_game", "Pill", steps=60)[20:]
    )


@pytest.mark.slow
@pytest.mark.parametrize(("level", "places"), [("easy", range(90, 120)), ("hard", range(10, 40))])
def test_the_shark_stays(level, places):
    assert all(
        o.x in places
        for found in objects("FishingDerby", f"shark_no_movement_{level}", "Shark")
        for o in found
    )
