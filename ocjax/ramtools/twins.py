"""`ocjax ram twins`: pairs of states with equal RAM and different pictures.

A byte is changed one or two frames before a moment of play, and the actions are repeated. No
decoder of a single state can distinguish two pictures of the same 128 bytes. Bytes get values that
they have in play, but their combination may never occur: check the pictures.
"""

import collections
import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import ale_py
import jax
import numpy as np

from ocjax._xla.batches import by_chunks
from ocjax.emulators.progress import progress
from ocjax.emulators.start import start_emulator
from ocjax.evaluation.tables import Cell, Table
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.play.policies import RandomPolicy, Seen

MOMENTS = {
    "play": "any frame of play",
    "life": "the frame on which a life is lost",
    "end": "the last frame of a game",
}
VALUES = 6  # tried values per byte
OBSERVED = 4_000  # frames of play that provide the values
BACK = 1, 2  # frames between the change and the moment
HOLD = 32  # longest random action in frames
APART = 50  # frames between two moments of play
MOST_FRAMES = 60_000  # longest play without a moment, in frames
BATCH = 128  # pictures per call of VEM
SHOWN_BYTES = 6


@dataclasses.dataclass(frozen=True)
class Twins:
    """Pairs of states with equal RAM and different screens.

    Args:
        moment: the kind of moments; see `MOMENTS`.
        tried: number of changes per moment.
        found: number of pairs.
        bytes: for each category with different objects, the number of pairs by changed byte.
    """

    game: Game
    moment: str
    moments: int
    tried: int
    found: int
    bytes: dict[str, collections.Counter[int]]


class _Moment(NamedTuple):
    """A frame of play, with the states and actions before it."""

    ram: np.ndarray  # uint8 [128]
    screen: np.ndarray  # uint8 [H, 160]
    before: tuple[tuple[Any, ale_py.Action], ...]  # states before the last frames, and the actions


def twins(
    game: Game,
    moment: str = "play",
    *,
    count: int = 10,
    seed: int = 0,
    game_mode: int | None = None,
) -> Twins:
    """Search for pairs of states with equal RAM and different pictures.

    Args:
        moment: "play", "life" (a life is lost) or "end" (of the game).
        game_mode: see `ocjax.make_vec`.
    """
    if moment not in MOMENTS:
        raise ValueError(f"moment must be one of {', '.join(MOMENTS)}, got {moment!r}")
    ale = start_emulator(game, seed, game_mode)
    changes = _changes(game, seed, game_mode)
    screens: list[np.ndarray] = []  # of the moments
    pairs: list[tuple[int, int, np.ndarray]] = []  # moment, changed byte, other picture
    description = f"changing {game.name}'s RAM"
    for k, at in enumerate(progress(_moments(ale, moment, count, seed), description, count)):
        screens.append(at.screen)
        here = ale.cloneSystemState()
        pairs += ((k, address, screen) for address, screen in _pairs(ale, at, changes))
        ale.restoreSystemState(here)
    if not screens:
        raise ValueError(
            f"random play of {game.name} does not reach {MOMENTS[moment]} within "
            f"{MOST_FRAMES:,} frames"
        )
    every = np.stack([*screens, *(screen for _, _, screen in pairs)])
    detected = jax.tree.map(np.asarray, by_chunks(game.vem, every, BATCH))
    differing: dict[str, collections.Counter[int]] = collections.defaultdict(collections.Counter)
    for i, (k, address, _) in enumerate(pairs, len(screens)):
        for name in _differing(game, detected[i], detected[k]):
            differing[name][address] += 1
    return Twins(game, moment, len(screens), len(changes) * len(BACK), len(pairs), differing)


def _changes(game: Game, seed: int, game_mode: int | None) -> list[tuple[int, int]]:
    """Addresses and values to try: some of each byte's values in random play."""
    rng = np.random.default_rng(seed)
    ale = start_emulator(game, seed, game_mode)
    rams = np.stack([ale.getRAM() for _ in itertools.islice(_play(ale, seed), OBSERVED)])
    out = []
    for address in range(128):
        values = np.unique(rams[:, address])
        if len(values) > 1:
            out += [(address, int(value)) for value in rng.permutation(values)[:VALUES]]
    return out


def _play(ale: ale_py.ALEInterface, seed: int) -> Iterator[tuple[Any, ale_py.Action, bool]]:
    """Endless random play; finished games restart.

    Yields, after each frame, the state before it, its action, and whether it lost a life.
    """
    actions = ale.getMinimalActionSet()
    policy = RandomPolicy(len(actions), 1, np.random.default_rng(seed), HOLD)
    while True:
        if ale.game_over():
            ale.reset_game()
        lives, state = ale.lives(), ale.cloneSystemState()
        action = actions[int(policy(Seen(np.empty(0), np.empty(0)))[0])]
        ale.act(action)
        yield state, action, ale.lives() < lives


def _moments(ale: ale_py.ALEInterface, moment: str, count: int, seed: int) -> Iterator[_Moment]:
    before: collections.deque[tuple[Any, ale_py.Action]] = collections.deque(maxlen=max(BACK))
    found, since = 0, 0
    for state, action, lost in _play(ale, seed):
        before.append((state, action))
        since += 1
        over = ale.game_over()
        wanted = {"play": since >= APART and not over, "life": lost and not over, "end": over}
        if wanted[moment] and len(before) == max(BACK):
            yield _Moment(ale.getRAM(), ale.getScreen(), tuple(before))
            found, since = found + 1, 0
        if found == count or since == MOST_FRAMES:
            return
        if over:
            before.clear()


def _pairs(
    ale: ale_py.ALEInterface, at: _Moment, changes: Sequence[tuple[int, int]]
) -> Iterator[tuple[int, np.ndarray]]:
    """Changed bytes and pictures that keep the moment's RAM, but change its picture."""
    for back in BACK:
        steps = at.before[-back:]
        for address, value in changes:
            ale.restoreSystemState(steps[0][0])
            ale.setRAM(address, value)
            for _, action in steps:
                ale.act(action)
            screen = ale.getScreen()
            if np.array_equal(ale.getRAM(), at.ram) and not np.array_equal(screen, at.screen):
                yield address, screen


def _differing(game: Game, a: Objects, b: Objects) -> list[str]:
    """Categories with different boxes."""
    differs = (a.xywh != b.xywh).any(axis=-1) | (a.valid != b.valid)
    return [name for name, slots in game.slices.items() if differs[slots].any()]


def to_table(t: Twins) -> Table:
    """A table of the categories that the RAM does not determine."""
    rows: list[list[Cell]] = []
    for name, counts in sorted(t.bytes.items(), key=lambda item: -item[1].total()):
        most = ", ".join(f"{address} ({n:,})" for address, n in counts.most_common(SHOWN_BYTES))
        rows.append([name, counts.total(), most])
    title = (
        f"{t.game.name}, {t.moments} times {MOMENTS[t.moment]}, {t.tried:,} changes before each: "
        f"{t.found:,} pairs with equal RAM"
    )
    if not rows:
        rows.append(["none", 0, ""])
    return Table(
        title, ["Category", "Pairs that differ in it", "Bytes changed before, and pairs"], rows
    )
