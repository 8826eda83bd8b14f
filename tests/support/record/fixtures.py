"""Excerpts: the small recordings of each game that the tests use.

`record` plays a game and keeps a few samples. `cut` picks samples from longer recordings. Both
spread the samples over the time of play. `record_boundaries` keeps the first and last states of
episodes, and states directly after the loss of a life. `record_deciding` keeps boundary states of
the numbers in the game's file, in all modes and difficulties.
"""

import contextlib
import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.progress import track

from ocjax import recordings
from ocjax.emulators.start import variants
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play import stepping
from ocjax.play.policies import HOLD, RandomPolicy
from ocjax.play.stepping import steps
from ocjax.recordings import Recording
from tests.support.record import deciding

SAMPLES = 40
SEEDS = (0, 1)
FRAME_SKIPS = (3, 4)  # an odd one sees both phases of flicker, an even one stays in its phase
FRAMES = 3600  # emulated frames of each run: a minute of play
BOUNDARY_SAMPLES = 30
BOUNDARY_STEPS = 10_000  # of each instance, after which `record_boundaries` gives up
BOUNDARY_INSTANCES, BOUNDARY_SKIP = 8, 4
DECIDING_SAMPLES = 64
DECIDING_INSTANCES, DECIDING_SKIP = (
    24,
    3,
)  # instances at least; there is one for each mode and difficulty
DECIDING_STEPS = 48_000  # of all instances
DECIDING_EVERY = (
    40  # steps of an instance, after which a state is a candidate even if nothing in it is new
)
CANDIDATES = 4000
EXCERPT = ("rams", "screens", "previous", "drawn", "rewards", "lives")  # arrays of an excerpt


@dataclasses.dataclass(frozen=True)
class Run:
    """One instance that is played from its start, and the samples kept of it."""

    mode: int
    difficulty: int
    seed: int
    frame_skip: int
    samples: dict[int, list[int]] = dataclasses.field(
        default_factory=dict
    )  # agent step -> numbers of the samples


def record(
    game: Game,
    samples: int = SAMPLES,
    *,
    seeds: Sequence[int] = SEEDS,
    modes: Sequence[int] | None = None,
    difficulties: Sequence[int] = (0,),
) -> Recording:
    """Play a game with random actions, each held for 1 to 8 steps, and keep a few samples.

    The samples cycle through the modes, difficulties, seeds and frame skips (3 and 4), and later
    samples are from later in play. Equal arguments give equal recordings.

    Args:
        game: the game.
        samples: number of samples. There is at least one for each mode and difficulty.
        seeds: seeds of the emulators. Together they also seed the actions.
        modes: as ale-py numbers them, or None for all modes of the game.
        difficulties: as ale-py numbers them.

    Returns:
        A recording with `screens`, `previous`, `rewards` and `lives`. Its samples are not
        successive.

    Raises:
        RomError, ValueError: a wrong ROM, mode or difficulty.
    """
    settings = [
        (m, d) for m in (variants(game)[0] if modes is None else modes) for d in difficulties
    ]
    if not (settings and seeds):
        raise ValueError("at least one seed, mode and difficulty is needed")
    n = max(samples, len(settings))
    height, width = game.screen
    arrays = {
        "rams": np.empty((n, 128), np.uint8),
        "screens": np.empty((n, height, width), np.uint8),
        "previous": np.empty((n, height, width), np.uint8),
        "rewards": np.empty(n, np.int64),
        "lives": np.empty(n, np.int16),
    }
    runs = schedule(n, settings, seeds)
    for skip in FRAME_SKIPS:
        for i, sample in _play(game, [run for run in runs if run.frame_skip == skip], seeds):
            for name, value in sample.items():
                arrays[name][i] = value
    return Recording(game, **arrays)


def schedule(n: int, settings: Sequence[tuple[int, int]], seeds: Sequence[int]) -> list[Run]:
    """Distribute samples over runs.

    They cycle through modes and difficulties, then through seeds and frame skips, and advance in
    time.
    """
    plays = [(seed, skip) for seed in seeds for skip in FRAME_SKIPS]
    runs: dict[tuple[int, ...], Run] = {}
    for i in range(n):
        turn, setting = divmod(i, len(settings))
        key = *settings[setting], *plays[(turn + setting) % len(plays)]
        run = runs.setdefault(key, Run(*key))
        step = i * (FRAMES // run.frame_skip - 1) // max(1, n - 1)
        run.samples.setdefault(step, []).append(i)
    return list(runs.values())


def _play(
    game: Game, runs: Sequence[Run], seeds: Sequence[int]
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Play runs of one frame skip side by side; yields the number and the arrays of each sample."""
    if not runs:
        return
    skip = runs[0].frame_skip
    settings = Settings(frame_skip=skip, repeat_action_probability=0.0)
    modes, difficulties = [run.mode for run in runs], [run.difficulty for run in runs]
    options = {"screens": ("screen",), "game_mode": modes, "game_difficulty": difficulties}
    with contextlib.closing(AlePool(game, len(runs), settings, **options)) as pool:
        act = RandomPolicy(
            len(pool.actions), len(runs), np.random.default_rng([*seeds, skip]), HOLD
        )
        pool.reset([run.seed for run in runs])
        last = max(step for run in runs for step in run.samples)
        turns = track(
            range(-1, last + 1),
            description=f"playing {game.name}, {skip} frames a step",
            transient=True,
        )
        for step, _ in zip(
            turns, steps(pool, act), strict=False
        ):  # step -1 is the state after the reset
            for k, run in enumerate(runs):
                for i in run.samples.get(step, ()):
                    yield i, _sample(pool, k)


def _sample(pool: AlePool, k: int) -> dict[str, Any]:
    """The present state of an instance as arrays of a recording."""
    earlier, latest = np.array(pool.screen[k])
    frames = {"rams": np.array(pool.ram[k]), "screens": latest, "previous": earlier}
    return frames | {"rewards": int(pool.episode_return[k]), "lives": np.int16(pool.lives[k])}


def record_boundaries(
    game: Game, samples: int = BOUNDARY_SAMPLES, *, seed: int = SEEDS[0]
) -> Recording:
    """Play a game with random actions, and keep first and last states of episodes and states
    directly after the loss of a life.

    Args:
        game: the game.
        samples: number of samples; a third of them of each type, fewer if a type is too rare.
        seed: of the first emulator and of the actions.

    Returns:
        A recording with `screens`, `previous`, `rewards`, `lives`, `resets` and `ends`. Its
        samples are not successive.

    Raises:
        RomError: a wrong ROM.
    """
    kept: dict[str, list[dict[str, Any]]] = {"resets": [], "ends": [], "lost": []}
    for sample in _boundaries(game, seed):
        kind = "resets" if sample["resets"] else "ends" if sample["ends"] else "lost"
        if len(kept[kind]) < -(-samples // 3):
            kept[kind].append(sample)
        if sum(map(len, kept.values())) >= samples:
            break
    every = [sample for of_kind in kept.values() for sample in of_kind][:samples]
    arrays: dict[str, Any] = {
        name: np.array([sample[name] for sample in every]) for name in every[0]
    }
    return Recording(game, **arrays)


def _boundaries(game: Game, seed: int) -> Iterator[dict[str, Any]]:
    """Samples of first and last states and of lost lives, in temporal order."""
    n, settings = (
        BOUNDARY_INSTANCES,
        Settings(frame_skip=BOUNDARY_SKIP, repeat_action_probability=0.0),
    )
    with contextlib.closing(AlePool(game, n, settings, screens=("screen",))) as pool:
        act = RandomPolicy(len(pool.actions), n, np.random.default_rng(seed), HOLD)
        pool.reset([seed + i for i in range(n)])
        lives = np.array(pool.lives)
        turns = track(range(BOUNDARY_STEPS), description=f"playing {game.name}", transient=True)
        for _ in zip(turns, steps(pool, act), strict=False):
            ends = pool.terminated | pool.truncated
            for k in np.flatnonzero(pool.started | ends | (pool.lives < lives)).tolist():
                yield _sample(pool, k) | {"resets": pool.started[k], "ends": ends[k]}
            lives = np.array(pool.lives)


def record_deciding(
    game: Game,
    known: Sequence[Recording],
    more: Sequence[Recording] = (),
    samples: int = DECIDING_SAMPLES,
    *,
    seed: int = SEEDS[0],
) -> Recording:
    """Play all modes and difficulties, and keep the states with most features that other excerpts
    lack.

    The features of a state are the integers of the decoder that change its objects if they change
    by one, and the sizes, places and values of objects that VEM finds in its frame.

    Args:
        game: the game.
        known: the other excerpts, with frames.
        more: further recordings to choose from.
        samples: number of samples at most.
        seed: of the first emulator and of the actions.

    Returns:
        A recording with `screens`, `previous`, `rewards` and `lives`. Its samples are not
        successive.

    Raises:
        RomError: a wrong ROM.
        ValueError: a recording has no frames, rewards or lives, or no state shows anything new.
    """
    candidates = recordings.join([*more, _played(game, seed)])
    every = recordings.join([*known, candidates])
    if every.screens is None:
        raise ValueError("every recording needs frames")
    if candidates.rewards is None or candidates.lives is None:
        raise ValueError("every recording of play needs rewards and lives")
    shown, weights = deciding.shown(game, every.rams, every.screens)
    old, new = np.split(shown, [len(every) - len(candidates)], axis=1)
    unknown = ~old.any(axis=1)
    chosen = sorted(deciding.cover(new[unknown], samples, weights[unknown]))
    if not chosen:
        raise ValueError(f"no state of {game.name} shows what the other recordings do not")
    arrays: dict[str, Any] = {
        name: array[chosen] for name, array in candidates.arrays.items() if name in EXCERPT
    }
    return Recording(game, **arrays)


def _played(game: Game, seed: int) -> Recording:
    """States of all modes and difficulties: at regular times, around the ends of lives and
    episodes, and with a new value of a byte."""
    settings = list(itertools.product(*variants(game)))
    n = max(DECIDING_INSTANCES, len(settings))
    modes, difficulties = zip(*(settings[i % len(settings)] for i in range(n)), strict=True)
    play = Settings(frame_skip=DECIDING_SKIP, repeat_action_probability=0.0)
    pool = AlePool(
        game,
        n,
        play,
        screens=("screen",),
        game_mode=list(modes),
        game_difficulty=list(difficulties),
    )
    kept: list[dict[str, Any]] = []
    try:
        act = RandomPolicy(len(pool.actions), n, np.random.default_rng(seed), HOLD)
        pool.reset([seed + i for i in range(n)])
        for k, total in _notable(game, pool, act):
            earlier, latest = np.array(pool.screen[k])
            frames = {"rams": np.array(pool.ram[k]), "screens": latest, "previous": earlier}
            kept.append(frames | {"rewards": total, "lives": np.int16(pool.lives[k])})
            if len(kept) == CANDIDATES:
                break
    finally:
        pool.close()
    arrays: dict[str, Any] = {name: np.array([sample[name] for sample in kept]) for name in kept[0]}
    return Recording(game, **arrays)


def _notable(game: Game, pool: AlePool, act: RandomPolicy) -> Iterator[tuple[int, int]]:
    """Play, and yield the instance and the sum of rewards of each state to keep."""
    n, addresses = pool.num_envs, np.array(sorted(game.ram.addresses()))
    seen = np.zeros((len(addresses), 256), bool)
    total, lives, resets, ends = (
        np.zeros(n),
        np.array(pool.lives),
        np.ones(n, bool),
        np.zeros(n, bool),
    )
    for step in track(
        range(DECIDING_STEPS // n), description=f"playing {game.name}", transient=True
    ):
        notable = resets | ends | (pool.lives < lives) | (np.arange(n) == step % DECIDING_EVERY)
        for k in range(n):
            used = np.arange(len(addresses)), pool.ram[k][addresses]
            if notable[k] or not seen[used].all():
                seen[used] = True
                yield k, int(total[k])
        lives, resets = np.array(pool.lives), np.array(ends)
        pool.send(act(stepping.seen(pool)))
        pool.wait()
        total = np.where(resets, 0, total + pool.reward)
        ends = pool.terminated | pool.truncated


def cut(recording: Recording, samples: int = SAMPLES) -> Recording:
    """Pick evenly spaced samples of a recording.

    Args:
        recording: with frames. If it contains the drawn pixels, the excerpt has `drawn`.
        samples: number of samples.

    Raises:
        ValueError: the recording has fewer samples.
    """
    if not 1 <= samples <= len(recording):
        raise ValueError(f"cannot cut {samples} samples from {len(recording)}")
    pick = np.linspace(0, len(recording) - 1, samples).astype(int)
    arrays: dict[str, Any] = {name: array[pick] for name, array in recording.arrays.items()}
    if "shown" in arrays and "previous_shown" in arrays:
        arrays["drawn"] = (arrays["shown"] != 0) | (arrays["previous_shown"] != 0)
    return Recording(recording.game, **{name: arrays[name] for name in EXCERPT if name in arrays})


def cut_files(paths: Sequence[str], game: Game, samples: int = SAMPLES) -> Recording:
    """Cut an excerpt with equal shares from several files.

    Raises:
        OSError, ValueError: a file is missing, no recording of the game, or too short.
    """
    tapes = [recordings.read(path, game.name) for path in paths]
    return recordings.join([cut(tape, samples // len(tapes)) for tape in tapes])
