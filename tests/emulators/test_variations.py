"""Variations make the described change on the screen and break nothing else."""

import dataclasses
import functools
import pickle
from pathlib import Path

import numpy as np
import pytest

import ocjax
from ocjax.emulators import variations
from ocjax.emulators.variations.mechanism import Moment
from ocjax.envs import make
from ocjax.ocatari import OCAtari
from tests.support.marks import some

STEPS = 150
BLUE, WHITE, RED, DARK_RED = (45, 50, 184), (214, 214, 214), (167, 26, 26), (144, 28, 0)
ORANGE, GREEN = (213, 130, 74), (92, 186, 92)  # Pong's enemy and player


@functools.cache
def play(game, name=None):
    """The frames of a game, uint8 [STEPS, H, 160, 3], with a variation or without, by the same
    random actions."""
    env = make(
        game, mode="raw", obs="pixels", preset="deterministic-v4", full_action_space=True, hook=name
    )
    env.reset(seed=0)
    rng, frames = np.random.default_rng(1), []
    for _ in range(STEPS):
        frame, _, terminated, truncated, _ = env.step(int(rng.integers(18)))
        frames.append(frame)
        assert not terminated
        assert not truncated
    env.close()
    return np.stack(frames)


def count(game, name, color, region):
    """How many pixels of a colour are in a region of each frame, after some steps."""
    return (play(game, name)[20:, *region] == color).all(-1).sum(axis=(1, 2))


def ends(mask, axis):
    """The first and the last row (axis 2) or column (axis 1) of a mask in each frame."""
    lines = mask.any(axis=axis)
    return np.stack([lines.argmax(1), lines.shape[1] - 1 - lines[:, ::-1].argmax(1)], 1)


@pytest.mark.parametrize(
    ("game_name", "name", "color", "region"),
    [
        ("Alien", "no_alien", (236, 140, 224), np.s_[:170, :]),
        ("Boxing", "color_player_black", WHITE, np.s_[40:170, 34:124]),
        ("ChopperCommand", "invisible_player", (223, 183, 85), np.s_[85:150, :]),
        ("DonkeyKong", "no_barrel", (236, 200, 96), np.s_[80:205, 50:]),
        ("Kangaroo", "disable_monkeys", (227, 151, 89), np.s_[:170, 16:]),
        ("SpaceInvaders", "no_shields", (181, 83, 40), np.s_[150:175, :]),
    ],
)
def test_objects_vanish(game_name, name, color, region):
    """Each object has a unique colour in its region; shots of the invisible player have its colour,
    too, and are small."""
    assert (count(game_name, None, color, region) > 12).sum() > 20
    assert (count(game_name, name, color, region) <= 12).all()


def test_colors():
    rows = np.s_[20:, 57:93, 8:152]
    assert len(np.unique(play("Breakout")[rows].reshape(-1, 3), axis=0)) == 7
    assert np.unique(
        play("Breakout", "color_all_blocks_red")[rows].reshape(-1, 3), axis=0
    ).tolist() == [[0, 0, 0], [*DARK_RED]]
    river = np.s_[60:62, 60:62]
    assert count("Riverraid", None, BLUE, river).sum() > 50
    assert (
        count("Riverraid", None, RED, river).sum()
        == count("Riverraid", "red_river", BLUE, river).sum()
        == 0
    )
    assert count("Riverraid", "red_river", RED, river).sum() > 50


def paddles(name):
    """The last row of the enemy and of the player in frames that show both completely."""
    frames = play("Pong", name)[20:, 34:194]
    enemy, player = (ends((frames == color).all(-1), 2) for color in (ORANGE, GREEN))
    whole = (enemy[:, 1] - enemy[:, 0] == 15) & (player[:, 1] - player[:, 0] == 15)
    return enemy[whole, 1], player[whole, 1]


def test_enemy_of_pong():
    enemy, player = paddles(None)
    assert np.ptp(enemy) > 30
    assert np.abs(enemy - player).max() > 30
    assert np.ptp(paddles("lazy_enemy")[0]) <= 8
    enemy, player = paddles("parallel_enemy")
    assert np.ptp(enemy) > 30
    assert (
        np.abs(enemy - player).max() <= 10
    )  # the variation writes the enemy before the player's move in the frame


def test_positions():
    shields = [
        ends((play("SpaceInvaders", n)[20:, 157:160] == (181, 83, 40)).all(-1), 1)
        for n in (None, "relocate_shields_right")
    ]
    assert (shields[1] == [53, 122]).all()
    assert (shields[0][:, 1] == 112).all()
    parts = np.s_[
        :, 26:182, [*range(40), *range(56, 100), *range(120, 150)]
    ]  # without the chickens
    assert np.ptp(play("Freeway")[parts][60:], axis=0).any()
    assert not np.ptp(play("Freeway", "stopped_cars")[parts][60:], axis=0).any()
    for rows in (slice(100, 107), slice(126, 133), slice(151, 158), slice(177, 183)):
        floes = [
            ends((play("Frostbite", n)[20:, rows] == WHITE).all(-1), 1)[:, 0]
            for n in (None, "reposition_floes_easy")
        ]
        assert (floes[1] == 72).all()
        assert len(set(floes[0].tolist())) > 3


def test_players():
    halves = [
        ends((play("Tennis", n)[20:, 20:190] == (240, 128, 128)).all(-1), 2)[:, 0]
        for n in (None, "always_lower_player")
    ]
    assert (halves[0] < 40).all()
    assert (halves[1] > 75).all()
    asterix, obelix = (play("Asterix", n)[3, 20:150] for n in (None, "obelix"))
    yellow, shield, pink = (
        (187, 187, 53),
        (184, 50, 50),
        (198, 89, 179),
    )  # the player, and the first objects that Asterix and Obelix collect
    counts = [
        [int((frame == color).all(-1).sum()) for color in (yellow, shield, pink)]
        for frame in (asterix, obelix)
    ]
    assert counts == [[34, 216, 0], [38, 0, 224]]


def test_declarations():
    assert len(variations.ALL) >= 100
    for key, v in variations.ALL.items():
        assert v.game in ocjax.games()
        assert key.startswith(f"{v.game}:")
        assert variations.of(v.game)[key.split(":")[1]] is v
        assert v.doc.endswith(".")
        assert v.writes or v.copies or v.replaces or v.keeps or v.draws or v.choices or v.parts
    assert not variations.of("Pitfall")


def test_the_documentation_lists_them():
    page = (Path(__file__).parents[2] / "docs" / "neighbours.md").read_text()
    for game in dict.fromkeys(v.game for v in variations.ALL.values()):
        assert (
            f"| {game} | {', '.join(f'`{name}`' for name in sorted(variations.of(game)))} |" in page
        )
    assert f"{len(variations.ALL)} variations of" in page


def written(v):
    """The addresses that a variation may write."""
    own = {*v.writes, *v.copies, *v.replaces, *v.keeps, *v.draws}
    return own.union(*(written(part) for part in (*v.parts, *v.choices)))


@pytest.mark.parametrize("v", variations.ALL.values(), ids=variations.ALL)
def test_bytes(v):
    """A variation writes only the declared bytes, also as a copy in another process."""
    for seed in range(8):
        before = np.random.default_rng(seed).integers(256, size=128).astype(np.uint8)
        ram = before.copy()
        pickle.loads(pickle.dumps(v))(ram)
        assert set(np.flatnonzero(ram != before).tolist()) <= written(v)
        if v.choices or any(
            part.keeps or part.draws or part.parts or part.frames or part.before
            for part in (v, *v.parts)
        ):
            continue
        parts = [
            part
            for part in (v, *v.parts)
            if all(before[a] in values for a, values in part.when.items())
        ]
        for part in parts:
            assert all(ram[a] == value for a, value in part.writes.items() if a not in part.masks)
            assert all(ram[a] == before[source] for a, source in part.copies.items())
            assert all(
                ram[a] == new.get(int(before[a]), before[a]) for a, new in part.replaces.items()
            )


def test_conditions_and_bits():
    v = variations.Variation(
        "Pong",
        "An example.",
        {3: 255},
        masks={3: 15},
        replaces={4: {7: 8}},
        when={5: range(0, 256, 8)},
    )
    ram = np.zeros(128, np.uint8)
    ram[4:6] = 7, 1
    v(ram)
    assert ram[3:6].tolist() == [0, 7, 1]
    ram[5] = 16
    v(ram)
    assert ram[3:6].tolist() == [15, 8, 16]


def drawn(v, seed, frames=40):
    """The RAM that a variation makes of the same RAM in some frames."""
    out = []
    for frame in range(frames):
        ram = np.arange(128, dtype=np.uint8)
        v(ram, Moment(ram.copy(), seed, frame, frame))
        out.append(ram)
    return np.stack(out)


def test_random_numbers():
    """Random numbers depend on the RAM, the frame and the seed, are independent of each other, and
    have the declared probabilities."""
    part = variations.Variation("Pong", "One byte.", draws={4: range(8)})
    v = variations.Variation("Pong", "An example.", draws={3: (10, 20)}, parts=(part,))
    first = drawn(v, 5, 4000)
    assert (drawn(v, 5, 4000) == first).all()
    assert (drawn(v, 6, 4000) != first).any()
    assert set(np.unique(first[:, 3])) == {10, 20}
    assert set(np.unique(first[:, 4])) == set(range(8))
    table = np.histogram2d(first[:, 3], first[:, 4], (2, 8))[0]
    assert abs(table - 250).max() < 5 * 250**0.5
    often, seldom = (variations.Variation("Pong", "One.", {3: value}) for value in (1, 2))
    choices = drawn(
        variations.Variation("Pong", "An example.", choices=(often, often, often, seldom)), 5, 4000
    )
    assert abs((choices[:, 3] == 1).mean() - 0.75) < 0.05


def test_names_seed_random_numbers():
    """A variation with another description draws the same numbers."""
    v = variations.find("BankHeist:random_city")
    assert v.name == "random_city"
    numbers = [
        drawn(other, 5)[:, 0].tolist()
        for other in (
            dataclasses.replace(v, changed=()),
            dataclasses.replace(v, changed=(), doc="Other words."),
            dataclasses.replace(v, changed=(), name="other"),
        )
    ]
    assert numbers[0] == numbers[1]
    assert numbers[0] != numbers[2]


def test_conditions_on_time_and_the_last_frame():
    v = variations.Variation(
        "Pong",
        "An example.",
        {3: 9},
        keeps=(4,),
        before={5: (1,)},
        changed=(6,),
        frames=range(2, 4),
    )
    before = np.arange(128, dtype=np.uint8)
    before[5] = 1
    for frame, changes, written in (
        (2, {5: 1, 6: 7, 4: 0}, True),
        (4, {6: 7}, False),
        (3, {}, False),
        (3, {6: 8}, True),
    ):
        ram = before.copy()
        for address, value in changes.items():
            ram[address] = value
        v(ram, Moment(before, 0, 0, frame))
        assert (ram[3], ram[4]) == ((9, 4) if written else (3, changes.get(4, 4)))
    other = before.copy()
    other[5:7] = 2, 9
    ram = before.copy()
    v(ram, Moment(other, 0, 0, 2))
    assert (ram == before).all()


def is_timed(v):
    """True if a variation needs more than the present RAM."""
    return (
        v.draws
        or v.choices
        or v.keeps
        or v.before
        or v.changed
        or v.frames
        or any(map(is_timed, v.parts))
    )


def test_wind():
    """The ball and its shadow move by a pixel in half of the frames, while the ball is over the
    court."""
    wind = variations.find("Tennis:wind_effect")
    for shadow, moves in ((60, True), (150, False)):
        before = np.zeros(128, np.uint8)
        before[[15, 16, 54, 55]] = shadow, 80, 100, 90
        moved = []
        for frame in range(400):
            ram = before.copy()
            wind(ram, Moment(before, 0, frame, frame))
            moved.append((ram.astype(int) - before)[[15, 16, 54, 55]].tolist())
        assert {tuple(m) for m in moved} == (
            {(0, 0, 0, 0), (0, 1, 1, 1)} if moves else {(0, 0, 0, 0)}
        )
        assert not moves or 150 < sum(m[1] for m in moved) < 250


TIMED = [key for key, v in variations.ALL.items() if is_timed(v)]


def trajectory(envs, seed, steps):
    """The RAM after each step with random actions."""
    rng, out = np.random.default_rng(seed), []
    for _ in range(steps):
        envs.step(rng.integers(18, size=envs.num_envs))
        out.append(envs.get_ram())
    return np.stack(out)


@pytest.mark.parametrize("key", some(5, TIMED))
def test_restored_states_continue_identically(key):
    """Restored states also continue in environments with another seed and another past. A seed
    repeats its episodes."""
    options = {
        "num_workers": 0,
        "mode": "raw",
        "obs": "ram",
        "full_action_space": True,
        "hook": key,
    }
    game = variations.ALL[key].game
    envs, others = (ocjax.make_vec(game, 2, **options) for _ in range(2))
    envs.reset(seed=3)
    past = trajectory(envs, 0, 30)
    states = ocjax.envs.States.from_bytes(envs.clone_state().to_bytes())
    future = trajectory(envs, 1, 60)
    others.reset(seed=11)
    trajectory(others, 2, 7)
    others.restore_state(states)
    assert (trajectory(others, 1, 60) == future).all()
    others.reset(seed=3)
    assert (trajectory(others, 0, 30) == past).all()
    envs.close()
    others.close()


def test_ocatari_restores_what_hooks_know():
    env = OCAtari("Seaquest-v4", hook="random_color_enemies", frameskip=4)
    env.reset(seed=0)

    def play(steps):
        rng, out = np.random.default_rng(0), []
        for _ in range(steps):
            env.step(int(rng.integers(18)))
            out.append(env.get_ram())
        return np.stack(out)

    play(40)
    for save, restore in (
        (env._clone_state, env._restore_state),
        (env.unwrapped.clone_state, env.unwrapped.restore_state),
    ):
        state = pickle.loads(pickle.dumps(save())) if save == env._clone_state else save()
        future = play(50)
        play(13)
        restore(state)
        assert (play(50) == future).all()
    env.close()


def test_seeds_give_other_random_numbers():
    envs = ocjax.make_vec("MsPacman", 8, num_workers=1, mode="raw", obs="ram", hook="end_game")
    envs.reset(seed=0)
    envs.step(np.zeros(8, int))
    assert len({tuple(np.flatnonzero(ram[59:101])) for ram in envs.get_ram()}) > 4
    envs.close()


def city(hook, action, place):
    """The cities of a player who leaves each one at the side of `place`."""
    env = make(
        "BankHeist",
        mode="raw",
        obs="ram",
        preset="noframeskip",
        repeat_action_probability=0,
        full_action_space=True,
        hook=hook,
    )
    env.reset(seed=0)
    found = [0]
    for step in range(600):
        ram = env.step(action)[0]
        if step % 100 == 60:
            env.unwrapped.set_ram(28, place)
        if ram[0] != found[-1]:
            found.append(int(ram[0]))
    env.close()
    return found


def test_cities():
    right, left = (3, 140), (4, 12)
    assert city(None, *right)[:5] == [0, 1, 2, 3, 4]
    assert city(None, *left) == [0]
    assert city("revisit_city", *left)[:4] == [0, 255, 254, 253]
    found = city("random_city", *right)
    arrived, drawn = found[1::2], found[2::2]  # the next city appears for one frame
    assert len(set(drawn)) > 4
    assert arrived == [(last + 1) % 256 for last in (0, *drawn[: len(arrived) - 1])]


def test_several_hooks_in_workers():
    envs = ocjax.make_vec(
        "SpaceInvaders",
        2,
        num_workers=1,
        ram_info=True,
        hook=[
            variations.find("SpaceInvaders:no_shields"),
            variations.find("SpaceInvaders:relocate_shields_right"),
        ],
    )
    envs.reset(seed=0)
    for _ in range(5):
        info = envs.step(np.zeros(2, int))[-1]
    assert (info["ram"][:, 27] == 53).all()
    assert not info["ram"][:, 43:70].any()
    envs.close()


def test_rewards_of_objects():
    game = ocjax.load("Pong")

    def reward(previous, current, action):
        return (current.x[0] - previous.x[0]) * 10 + current.y[1] + action.astype(np.int16)

    for mode in ("NextStep", "SameStep"):
        envs = ocjax.make_vec(
            "Pong",
            2,
            num_workers=0,
            autoreset_mode=mode,
            max_episode_frames=100,
            reward_fn=reward,
            clip_rewards=True,
        )
        envs.reset(seed=0)
        ends_seen = 0
        for _ in range(60):
            before = envs.objects
            _, got, _, truncated, info = envs.step(np.array([2, 3]))
            now, began = envs.objects, envs.pool.started
            y = np.asarray(now.y[:, game.slices["Enemy"].start])
            expected = 10 * np.asarray(now.x[:, 0] - before.x[:, 0]) + y + [2, 3]
            if mode == "SameStep":
                for i in np.flatnonzero(truncated):
                    final = {o.category: o for o in info["final_info"]["objects"][i]}
                    expected[i] = (
                        10 * final["Player"].dx
                        + (final["Enemy"].y if "Enemy" in final else 0)
                        + [2, 3][i]
                    )
            else:
                expected = np.where(began, 0, expected)
            assert got.tolist() == expected.tolist()
            assert info["reward"].dtype == np.float64
            ends_seen += truncated.sum()
        assert ends_seen >= 2
        envs.close()


@pytest.mark.parametrize(
    ("reward_fn", "options", "error", "message"),
    [
        (3, {}, TypeError, "reward_fn must be a function"),
        (lambda p, c, a: a, {"mode": "raw"}, ValueError, "mode 'raw' does not extract"),
        (
            lambda p, c, a: a,
            {"backend": "envpool"},
            ValueError,
            "backend 'envpool' has no reward_fn",
        ),
    ],
)
def test_wrong_reward_functions(reward_fn, options, error, message):
    with pytest.raises(error, match=message):
        ocjax.make_vec("Pong", 2, num_workers=0, reward_fn=reward_fn, **options)


def test_rewards_that_are_not_numbers():
    envs = ocjax.make_vec("Pong", 2, num_workers=0, reward_fn=lambda p, c, a: c.x)
    envs.reset(seed=0)
    with pytest.raises(
        ValueError, match=r"must return one number for one environment, got shape \[5\]"
    ):
        envs.step(np.zeros(2, int))
    envs.close()


def test_a_variation_of_another_game_is_refused():
    for refused in (
        variations.find("Riverraid:red_river"),
        [variations.find("Pong:lazy_enemy"), variations.find("Riverraid:red_river")],
    ):
        with pytest.raises(
            ValueError, match=r"the hook is a variation of Riverraid .*, but the game is Pong"
        ):
            make("Pong", hook=refused)
    with pytest.raises(
        ValueError, match=r"the hook is a variation of Riverraid .*, but the game is Pong"
    ):
        make("Pong", hook="Riverraid:red_river")
    with pytest.raises(TypeError, match="got 3"):
        make("Pong", hook=["lazy_enemy", 3])


def test_names():
    assert (
        variations.find("pong:lazy_enemy")
        is variations.find("lazy_enemy", "Pong")
        is variations.ALL["Pong:lazy_enemy"]
    )
    for wrong in ("lazy_enemi", "Pong:lazy_enemi"):
        with pytest.raises(
            ValueError,
            match=r"no variation 'lazy_enemi'; it has .*up_drift.*: did you mean lazy_enemy",
        ):
            make("Pong", hook=wrong)
    with pytest.raises(ValueError, match=r"Pitfall has no variation 'gravity'; it has none"):
        ocjax.make_vec("Pitfall", 1, num_workers=0, hook="gravity")
    with pytest.raises(ValueError, match="no game 'Pongg'"):
        variations.find("Pongg:lazy_enemy")
    with pytest.raises(ValueError, match="must have a game"):
        variations.find("lazy_enemy")


def test_names_beside_functions():
    """Each hook sees the bytes that earlier hooks wrote, in workers and in OCAtari's class."""

    def follow(ram):
        ram[60] = ram[21]

    envs = ocjax.make_vec("Pong", 2, num_workers=1, ram_info=True, hook=["Pong:lazy_enemy", follow])
    envs.reset(seed=0)
    assert (envs.step(np.zeros(2, int))[-1]["ram"][:, 60] == 127).all()
    envs.close()
    env = OCAtari("Pong", hook=["lazy_enemy", follow])
    env.reset(seed=0)
    assert env.get_ram()[60] != 127
    env.step(0)
    assert env.get_ram()[60] == 127
    env.close()


@pytest.mark.parametrize(
    "wrong",
    [
        {"writes": {200: 1}},
        {"writes": {20: 300}},
        {"writes": {"a": 1}},
        {"copies": {-1: 3}},
        {"copies": {3: 128}},
        {"replaces": {3: {5: 256}}},
        {"when": {128: (1,)}},
        {"before": {3: (256,)}},
        {"changed": (128,)},
        {"keeps": (-1,)},
        {"draws": {3: (1, 256)}},
    ],
)
def test_variations_of_wrong_bytes_are_refused(wrong):
    with pytest.raises(ValueError, match=r"must have (addresses|values) from 0 to"):
        variations.Variation("Pong", "It cannot be.", **wrong)
    with pytest.raises(ValueError, match="draws must have values for each address"):
        variations.Variation("Pong", "It cannot be.", draws={3: ()})
