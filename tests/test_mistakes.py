"""Common mistakes of new users, and the helpful message for each."""

import contextlib

import gymnasium
import numpy as np
import pytest

import ocjax
from ocjax.envs import make
from ocjax.ocatari import OCAtari
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")


@pytest.fixture(scope="module")
def names():
    """The names that the mistakes use."""
    data = excerpt("Pong")
    pong, breakout = ocjax.load("Pong"), ocjax.load("Breakout")
    ram, screen = data["rams"][0], data["screens"][0]
    return {
        "np": np,
        "ocjax": ocjax,
        "gymnasium": gymnasium,
        "OCAtari": OCAtari,
        "make": make,
        "game": pong,
        "breakout": breakout,
        "ram": ram,
        "frame": pong.palette[screen],
        "objects": pong.rem(data["rams"][:2]),
        "one": pong.rem(ram),
        "others": breakout.rem(ram),
        "envs": ocjax.make_vec("Pong", 2, num_workers=0),
    }


MISTAKES = (
    # The name of a game.
    ("ocjax.load('Pongg')", ValueError, "did you mean Pong"),
    ("ocjax.load('Othello')", ValueError, "ALE has this game, but ocjax does not support it"),
    ("ocjax.load('Chess')", ValueError, "no game 'Chess': there are Adventure, AirRaid, Alien"),
    ("ocjax.load(3)", TypeError, "a game's name must be a string such as 'Pong', got 3"),
    ("gymnasium.make('ocjax/Pongg-v5')", gymnasium.error.NameNotFound, "Did you mean: `Pong`"),
    ("gymnasium.make('ocjax/Pong-v9')", gymnasium.error.VersionNotFound, "`v0`, `v4`, `v5`"),
    ("OCAtari('Pongg')", ValueError, "did you mean Pong"),
    # Recorded objects.
    (
        "ocjax.evaluation.from_records(game, [])",
        TypeError,
        "game must be a Game, got list: use from_records(records, game)",
    ),
    # RAM and frames.
    ("game.rem(ram[:100])", ValueError, "ram must have shape [..., 128], got [100]"),
    (
        "game.rem(ram.astype(np.int32))",
        TypeError,
        "ram must be a uint8 array, got int32: use x.astype(numpy.uint8)",
    ),
    (
        "game.rem(ram.tolist())",
        TypeError,
        "ram must be a uint8 array, got list: use numpy.asarray(x, numpy.uint8)",
    ),
    ("game.rem(None)", TypeError, "got NoneType"),
    (
        "game.rem(np.ma.masked_array(ram))",
        TypeError,
        "masked arrays are not supported, got one of uint8",
    ),
    ("game.rem(np.ma.masked_array(ram, ram > 3))", TypeError, "give x.data, or x.filled(value)"),
    (
        "game.vem(np.ma.masked_array(frame, frame > 3))",
        TypeError,
        "masked arrays are not supported, got one of uint8",
    ),
    ("game.rem(frame)", ValueError, "ram must have shape [..., 128], got [210, 160, 3]"),
    (
        "game.vem(ram)",
        ValueError,
        "frames must have shape [..., 210, 160] (palette indices) or [..., 210, 160, 3] (RGB), "
        "got [128]",
    ),
    ("game.vem(frame / 255)", TypeError, "frames must be a uint8 array, got float64"),
    ("game.vem(frame[:84, :84])", ValueError, "got [84, 84, 3]"),
    (
        "game.vem(frame.transpose(2, 0, 1))",
        ValueError,
        "move the channels last, with numpy.moveaxis(frames, -3, -1)",
    ),
    # Objects.
    ("objects[7]", IndexError, "index 7 is out of bounds for axis 0 with size 2"),
    ("objects['Ball']", TypeError, "objects.of('Ball') selects a category"),
    ("len(one)", TypeError, "these are the objects of one state, without a batch dimension"),
    ("list(one)", TypeError, "`to_list` lists them"),
    (
        "objects.of('Bal')",
        ValueError,
        "objects of Pong have no category 'Bal'; they have Player, Enemy, Ball, PlayerScore, Enemy",
    ),
    ("objects.of('ball')", ValueError, "PlayerScore, EnemyScore: did you mean Ball?"),
    ("objects.Ball", AttributeError, "objects.of('Ball') selects a category"),
    (
        "ocjax.evaluation.agreement(objects, objects)",
        TypeError,
        "expected Detections, got Objects: convert objects with evaluation.detections(objects)",
    ),
    (
        "ocjax.evaluation.average_precision([], [])",
        TypeError,
        "expected Detections, got list: convert objects with evaluation.detections(objects)",
    ),
    ("ocjax.envs.variations.find('remove enemy', 'Pong')", ValueError, "did you mean Enemy"),
    ("ocjax.edit(game, ram, 'ball', x=3)", ValueError, "did you mean Ball?"),
    ("objects.of('Ball', breakout)", ValueError, "these are objects of Pong, not of Breakout"),
    (
        "ocjax.velocity(one, others)",
        ValueError,
        "velocities need two states of one game, got Pong and Breakout",
    ),
    ("ocjax.track(one, others)", ValueError, "must be objects of the same game"),
    # Options of environments.
    ("make('Pong', obs_type='rgb')", TypeError, "it is called obs, with 'ram' or 'pixels'"),
    (
        "make('Pong', obs='rgb')",
        ValueError,
        "no observation 'rgb': there are objects, vector, dqn, pixels, ram",
    ),
    (
        "make('Pong', mode='pixels')",
        ValueError,
        "mode must be one of ('rem', 'vem', 'both', 'raw'), got 'pixels'",
    ),
    ("make('Pong', seed=0)", TypeError, "no option seed: it is an argument of reset"),
    ("make('Pong', frame_stack=4)", TypeError, "obs=ocjax.envs.Dqn(stack=4) stacks frames"),
    ("make('Pong', frameskips=4)", TypeError, "did you mean frame_skip?"),
    ("make('Pong', game_mode=9)", ValueError, "Pong has no mode 9; it has [0, 1]"),
    ("make('Pong', preset='v6')", ValueError, "no preset 'v6': there are v5, v0, v4"),
    ("make('Pong', hook=3)", TypeError, "hook must be a function of the RAM"),
    (
        "make('Pong', hook='no_shields')",
        ValueError,
        "Pong has no variation 'no_shields'; it has down_drift",
    ),
    ("make('Pong', num_envs=2)", TypeError, "num_envs is an option of make_vec"),
    (
        "make('Pong', render_mode='rgb')",
        ValueError,
        "render_mode must be one of ('rgb_array', 'objects')",
    ),
    ("ocjax.make_vec('Pong', 0)", ValueError, "num_envs must be an integer of at least 1"),
    ("ocjax.make_vec('Pong', 2.0)", ValueError, "num_envs must be an integer of at least 1"),
    (
        "ocjax.make_vec('Pong', 2, backend='gpu')",
        ValueError,
        "backend must be 'ale' or 'envpool', got 'gpu'",
    ),
    (
        "ocjax.make_vec('Pong', 2, render_mode='human')",
        ValueError,
        "gymnasium.make, not make_vec, adds 'human'",
    ),
    ("ocjax.make_vec('PongNoFrameskip-v4', 2, frame_skip=4)", ValueError, "PongNoFrameskip-v4"),
    (
        "OCAtari('Pong', mode='pixels')",
        ValueError,
        "mode must be one of ('ram', 'revised', 'vision', 'both'), got 'pixels'",
    ),
    (
        "OCAtari('Pong', obs_mode='objects')",
        ValueError,
        "obs_mode must be one of ('ori', 'dqn', 'obj'), got 'objects'",
    ),
    # Steps.
    ("envs.step(np.zeros(2, int))", ValueError, "call reset() before the first step"),
    (
        "envs.reset(seed=0) and envs.step(np.zeros(3, int))",
        ValueError,
        "actions must be 2 integers, got int64 of shape (3,)",
    ),
    (
        "envs.reset(seed=0) and envs.step(0)",
        ValueError,
        "actions must be 2 integers, got int64 of shape ()",
    ),
    (
        "envs.reset(seed=0) and envs.step(np.zeros(2))",
        ValueError,
        "actions must be 2 integers, got float64 of shape (2,)",
    ),
    (
        "envs.reset(seed=0) and envs.step([0, 99])",
        ValueError,
        "actions must be from 0 to 5, got 0 to 99",
    ),
    (
        "envs.reset(seed=[1])",
        ValueError,
        "seed must be an integer from 0 to 2**63 - 1, or 2 of them with one for each environment",
    ),
    ("envs.reset(seed=-1)", ValueError, "seed must be an integer from 0 to 2**63 - 1"),
    (
        "envs.reset(options={'mask': 1})",
        ValueError,
        "unknown options ['mask']: the only option is reset_mask",
    ),
    (
        "envs.close() or envs.step(np.zeros(2, int))",
        RuntimeError,
        "the environments are closed: create new ones",
    ),
    # Files.
    ("ocjax.recordings.read('nothing.npz')", FileNotFoundError, "no recording nothing.npz"),
)


@pytest.mark.parametrize(
    ("mistake", "error", "message"), MISTAKES, ids=[mistake for mistake, *_ in MISTAKES]
)
def test_message(mistake, error, message, names):
    with pytest.raises(error) as raised, contextlib.suppress(Warning):
        eval(mistake, dict(names))
    assert message in str(raised.value)
