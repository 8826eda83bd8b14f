"""Compare another implementation of a game with the real ROM.

Both play the same actions, and their objects are matched frame by frame.

    from ocjax.evaluation import parity
    from ocjax.evaluation.jaxtari import Jaxtari

    found = parity.compare(ocjax.load("Pong"), Jaxtari(ocjax.load("Pong")), seed=0, frames=300)

Another simulator needs an adapter with the attributes and methods of `Simulator`.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import ale_py
import jax
import numpy as np
from PIL import Image

from ocjax.emulators.start import start_emulator
from ocjax.evaluation import matching
from ocjax.evaluation.matching import Detections
from ocjax.evaluation.metrics import agreement
from ocjax.evaluation.tables import Cell, Table
from ocjax.extraction.edits import edit
from ocjax.extraction.game import Game
from ocjax.transforms.drawing import boxes_over, sheet

__all__ = [
    "Frame",
    "Parity",
    "Simulator",
    "compare",
    "errors",
    "pictures",
    "to_summary",
    "to_table",
]

MOST_HELD = 16  # maximum number of frames for which an action is held
TOLERANCE = 2.0  # pixels of difference above which the two sides have diverged
_ANYWHERE = 1_000.0  # pixels, more than the distance of any two objects


class Frame(NamedTuple):
    """The output of a simulator for one frame."""

    # Boxes of the present objects by field: float [n, 4], left, top, width and height in pixels.
    boxes: Mapping[str, np.ndarray]
    reward: float
    over: bool


class Simulator(Protocol):
    """Another implementation of a game.

    Attributes:
        name: for tables and pictures.
        fields: for each field of its observation, by name, the categories of ocjax with the same
            objects.
        actions: names of its actions, as ALE has them, such as "UPFIRE".
    """

    name: str
    fields: Mapping[str, tuple[str, ...]]
    actions: Sequence[str]

    def reset(self, seed: int) -> Frame:
        """Begin a game."""
        ...

    def step(self, action: str) -> Frame:
        """Emulate one frame with the action of that name."""
        ...


@dataclasses.dataclass(frozen=True)
class Parity:
    """Two runs with the same actions, on the real ROM and in a simulator.

    A run has B frames; the first one follows the reset.

    Args:
        seed: of the actions and of the simulator.
        aligned: fields with an object that was moved in the real game to its place in the
            simulator.
        real, simulated: the objects, with the simulator's fields as categories.
        rewards: float `[2, B]`, of the real game and of the simulator.
        screens: uint8 `[B, H, 160]`, the frames of the real game.
    """

    game: Game
    simulator: str
    seed: int
    aligned: tuple[str, ...]
    real: Detections
    simulated: Detections
    rewards: np.ndarray
    screens: np.ndarray


def compare(
    game: Game, simulator: Simulator, *, seed: int = 0, frames: int = 300, align: bool = True
) -> Parity:
    """Play the same random actions on the real ROM and in a simulator, until a game ends.

    Args:
        seed: of the actions and of the simulator.
        frames: largest number of emulated frames.
        align: whether to move objects in the real game, after its reset, to their places in the
            simulator (see `ocjax.edit`). This applies to fields with one object on both sides that
            has separate bytes for its position.

    Raises:
        ValueError: the two have no action in common, or `frames` is not positive.
    """
    if frames < 1:
        raise ValueError(f"frames must be at least 1, got {frames}")
    ale = start_emulator(game, seed)
    real_actions = {a.name: a for a in ale.getMinimalActionSet()}
    actions = [name for name in simulator.actions if name in real_actions]
    if not actions:
        raise ValueError(f"{simulator.name} and the real {game.name} have no action in common")
    first = simulator.reset(seed)
    aligned = _aligned(game, ale, simulator, first) if align else ()
    rng, shown, rams, screens, rewards = (
        np.random.default_rng(seed),
        [first],
        [ale.getRAM()],
        [ale.getScreen()],
        [0.0],
    )
    while len(shown) <= frames and not (shown[-1].over or ale.game_over()):
        action = str(rng.choice(actions))
        for _ in range(int(rng.integers(1, MOST_HELD + 1))):
            rewards.append(ale.act(real_actions[action]))
            shown.append(simulator.step(action))
            rams.append(ale.getRAM())
            screens.append(ale.getScreen())
            if len(shown) > frames or shown[-1].over or ale.game_over():
                break
    real = _by_field(
        matching.detections(jax.tree.map(np.asarray, game.rem(np.array(rams)))), simulator.fields
    )
    both = np.array([rewards, [frame.reward for frame in shown]])
    return Parity(
        game,
        simulator.name,
        seed,
        aligned,
        real,
        _detections(shown, tuple(simulator.fields)),
        both,
        np.array(screens),
    )


def _aligned(
    game: Game, ale: ale_py.ALEInterface, simulator: Simulator, first: Frame
) -> tuple[str, ...]:
    """Move single objects of the real game to their places in the simulator.

    Return their fields.
    """
    moved = []
    for field, categories in simulator.fields.items():
        if len(categories) != 1 or len(first.boxes[field]) != 1:
            continue
        x, y = first.boxes[field][0, :2].astype(int).tolist()
        try:
            ram = edit(game, ale.getRAM(), categories[0], x=x, y=y)
        except ValueError:  # the object is absent, or moves with others
            continue
        for address in np.flatnonzero(ram != ale.getRAM()).tolist():
            ale.setRAM(address, int(ram[address]))
        moved.append(field)
    return tuple(moved)


def _by_field(found: Detections, fields: Mapping[str, tuple[str, ...]]) -> Detections:
    """Use the simulator's fields as categories of detections; drop objects of no field."""
    of = {
        category: k for k, (_, categories) in enumerate(fields.items()) for category in categories
    }
    table = np.array([*(of.get(name, -1) for name in found.categories), -1])
    return dataclasses.replace(found, label=table[found.label], categories=tuple(fields))


def _detections(shown: Sequence[Frame], fields: tuple[str, ...]) -> Detections:
    most = max(sum(map(len, frame.boxes.values())) for frame in shown)
    xywh, label = np.zeros((len(shown), most, 4)), np.full((len(shown), most), -1)
    for b, frame in enumerate(shown):
        boxes = np.concatenate([frame.boxes[name] for name in fields])
        xywh[b, : len(boxes)] = boxes
        label[b, : len(boxes)] = np.repeat(
            np.arange(len(fields)), [len(frame.boxes[name]) for name in fields]
        )
    return Detections(xywh, label, fields)


class Errors(NamedTuple):
    """Differences of the two sides, by field (F fields)."""

    f1: np.ndarray  # float [F], F1 of objects within 5 pixels of each other
    # float [F, 4], mean absolute difference of left, top, width and height of partners, in pixels
    off: np.ndarray
    # int [F], the first frame with an object missing on one side or more than `TOLERANCE` off, or
    # -1
    first: np.ndarray


def errors(p: Parity) -> Errors:
    """Measure the differences of the two sides."""
    pairs = matching.match(p.real, p.simulated, _ANYWHERE)
    frame, i = np.nonzero(pairs >= 0)
    a, b = p.real.xywh[frame, i], p.simulated.xywh[frame, pairs[frame, i]]
    off, field = np.abs(a - b), p.real.label[frame, i]
    fields = range(len(p.real.categories))
    # Shape [2, F, B].
    counts = np.array([[(d.label == k).sum(axis=1) for k in fields] for d in (p.real, p.simulated)])
    apart = counts[0] != counts[1]
    np.logical_or.at(apart, (field, frame), off[:, :2].max(axis=1) > TOLERANCE)
    first = np.where(apart.any(axis=1), apart.argmax(axis=1), -1)
    mean = np.array(
        [off[field == k].mean(axis=0) if (field == k).any() else np.full(4, np.nan) for k in fields]
    )
    return Errors(agreement(p.real, p.simulated).sum(axis=0).f1, mean, first)


def to_table(runs: Sequence[Parity]) -> Table:
    """A table of runs with different seeds, by field: objects, F1, mean and first differences."""
    found = [errors(p) for p in runs]
    rows: list[list[Cell]] = []
    for k, name in enumerate(runs[0].real.categories):
        shares, off = [e.f1[k] for e in found], np.array([e.off[k] for e in found])
        firsts = ", ".join("-" if e.first[k] < 0 else str(e.first[k]) for e in found)
        rows.append([name, *_counts(runs, k), 100 * _mean(shares), *map(_pixels, off.T), firsts])
    title = (
        f"{runs[0].game.name}: the real ROM and {runs[0].simulator}; "
        f"{_by_seed(runs, lambda p: f'{len(p.real)} frames')}; return "
    )
    title += _by_seed(runs, lambda p: " and ".join(f"{total:g}" for total in p.rewards.sum(axis=1)))
    header = [
        "Field",
        "Real",
        runs[0].simulator,
        "F1",
        "x off",
        "y off",
        "w off",
        "h off",
        "Differs from frame",
    ]
    return Table(title, header, rows)


def to_summary(games: Sequence[Sequence[Parity]]) -> Table:
    """A table of several games: F1 and differences as means over fields, returns over seeds."""
    rows: list[list[Cell]] = []
    for runs in games:
        found = [errors(p) for p in runs]
        off = np.array([e.off[:, :2] for e in found]).reshape(-1, 2)
        firsts = [e.first[e.first >= 0] for e in found]
        known = [int(first.min()) for first in firsts if len(first)]
        returns = np.mean([p.rewards.sum(axis=1) for p in runs], axis=0)
        f1 = 100 * _mean(np.array([e.f1 for e in found]).ravel())
        differs = str(min(known)) if known else "-"
        rows.append(
            [
                runs[0].game.name,
                f1,
                *map(_pixels, off.T),
                differs,
                *(f"{total:.4g}" for total in returns),
            ]
        )
    simulator = games[0][0].simulator
    header = [
        "Game",
        "F1",
        "x off",
        "y off",
        "Differs from frame",
        "Return",
        f"Return in {simulator}",
    ]
    return Table(f"The real ROMs and {simulator}", header, rows)


def _by_seed(runs: Sequence[Parity], told: Callable[[Parity], str]) -> str:
    """Describe each run; if all descriptions are equal, give one."""
    parts = [told(p) for p in runs]
    return (
        parts[0]
        if len(set(parts)) == 1
        else ", ".join(f"{part} (seed {p.seed})" for part, p in zip(parts, runs, strict=True))
    )


def _mean(values: Sequence[float] | np.ndarray) -> float:
    """Return the mean of the values that are not nan; nan without such values."""
    known = np.asarray(values)[~np.isnan(values)]
    return float(known.mean()) if len(known) else math.nan


def _pixels(values: np.ndarray) -> Cell:
    """Format the mean of the values that are not nan, with one decimal."""
    mean = _mean(values)
    return None if math.isnan(mean) else f"{mean:.1f}"


def _counts(runs: Sequence[Parity], field: int) -> list[Cell]:
    """Return the mean number of objects of a field, on both sides."""
    return [
        f"{_mean([(d.label == field).sum() / len(d) for d in side]):.1f}"
        for side in zip(*((p.real, p.simulated) for p in runs), strict=True)
    ]


def pictures(p: Parity, frames: Sequence[int], scale: int = 2) -> list[Image.Image]:
    """Draw frames side by side, the simulator's boxes over the darkened frame."""
    out = []
    for b in frames:
        rgb = p.game.palette[p.screens[b]]
        sides = [
            boxes_over(frame, d.xywh[b], d.label[b], d.categories, scale=scale)
            for frame, d in ((rgb, p.real), (rgb // 3, p.simulated))
        ]
        out.append(sheet([sides], [f"{p.game.name}, frame {b}: real", p.simulator]))
    return out
