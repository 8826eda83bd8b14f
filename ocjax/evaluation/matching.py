"""Detections as padded arrays, and the one-to-one matching of two sets of detections.

The functions use NumPy and process whole batches.
"""

import dataclasses
import math
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ocjax.extraction.categories import names_by_alias
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects, whose

RADIUS = 5.0  # pixels between centres, as in the OCAtari paper
PAIRS_AT_ONCE = 1 << 23  # bounds the memory of a comparison of all pairs


@dataclasses.dataclass(frozen=True, repr=False)
class Detections:
    """Labelled boxes of a batch of frames, from any detector: the input of the metrics.

    Unlike `Objects`, detections have no game, the order of boxes within a frame has no meaning, and
    boxes may have confidences. `B` is the number of frames and `N` the largest number of boxes in a
    frame.

    Args:
        xywh: `[B, N, 4]`, left, top, width and height in pixels.
        label: int `[B, N]`, index into `categories`, or -1 without a box.
        categories: names of the labels.
        score: `[B, N]`, confidences for `average_precision`. None: all boxes are equally confident.

    Raises:
        ValueError: shapes disagree, or a label is out of range.
        TypeError: labels are not integers.
    """

    xywh: np.ndarray
    label: np.ndarray
    categories: tuple[str, ...]
    score: np.ndarray | None = None

    def __repr__(self) -> str:
        boxes = int(np.sum(self.label >= 0))
        return f"Detections of {boxes:,} boxes in {len(self.xywh):,} frames"

    def __post_init__(self) -> None:
        if self.xywh.ndim != 3 or self.xywh.shape[2] != 4:
            raise ValueError(
                f"xywh must have shape [frames, boxes, 4], got {list(self.xywh.shape)}"
            )
        for name, array in (("label", self.label), ("score", self.score)):
            if array is not None and array.shape != self.xywh.shape[:2]:
                raise ValueError(
                    f"{name} must have shape {list(self.xywh.shape[:2])} to go with xywh, got "
                    f"{list(array.shape)}"
                )
        if not np.issubdtype(self.label.dtype, np.integer):
            raise TypeError(f"label must be integers, got {self.label.dtype}")
        if self.label.size and not -1 <= self.label.min() <= self.label.max() < len(
            self.categories
        ):
            raise ValueError(
                f"label must be -1 to {len(self.categories) - 1}, got {self.label.min()} to "
                f"{self.label.max()}"
            )

    def __len__(self) -> int:
        return len(self.label)

    @property
    def centers(self) -> np.ndarray:
        """Centres in pixels, float32 `[B, N, 2]`."""
        return self.xywh[..., :2].astype(np.float32) + self.xywh[..., 2:].astype(np.float32) / 2

    def without(self, mask: np.ndarray) -> "Detections":
        """Drop the detections that are set in `mask`, bool `[B, N]`."""
        return dataclasses.replace(self, label=np.where(mask, -1, self.label))


def detections(objects: Objects) -> Detections:
    """Convert the valid objects of a batch to detections.

    Args:
        objects: from `game.rem` or `game.vem`, batch shape `[B]`.

    Returns:
        Detections with slot `i` in column `i`; the labels index `game.categories`.

    Raises:
        ValueError: the objects have no reference to their game.
    """
    game = whose(objects)
    valid = np.asarray(objects.valid)
    return Detections(
        np.asarray(objects.xywh),
        np.where(valid, game.slot_category, -1),
        tuple(c.name for c in game.categories),
    )


def from_records(records: Iterable[Iterable[Sequence[Any]]], game: Game) -> Detections:
    """Convert Python tuples to detections.

    Args:
        records: for each frame an iterable of `(category, x, y, w, h)` or `(category, x, y, w, h,
            confidence)`.
        game: its categories are the first labels; `records` may use their aliases. Other categories
            follow, and their boxes match nothing in the game.

    Raises:
        ValueError: a frame is no iterable of records, or a record is malformed.
        TypeError: `game` is no `Game`.
    """
    if not isinstance(game, Declaration):
        raise TypeError(
            f"game must be a Game, got {type(game).__name__}: use from_records(records, game)"
        )
    alias = names_by_alias(game.categories)
    frames = [_checked(frame, b, alias) for b, frame in enumerate(records)]
    names = list(
        dict.fromkeys([c.name for c in game.categories] + [r[0] for frame in frames for r in frame])
    )
    most = max((len(frame) for frame in frames), default=0)
    xywh, label = np.zeros((len(frames), most, 4)), np.full((len(frames), most), -1)
    score = (
        np.ones((len(frames), most))
        if any(len(r) == 6 for frame in frames for r in frame)
        else None
    )
    for b, frame in enumerate(frames):
        for i, record in enumerate(frame):
            xywh[b, i], label[b, i] = record[1:5], names.index(record[0])
            if score is not None and len(record) == 6:
                score[b, i] = record[5]
    return Detections(xywh, label, tuple(names), score)


def _checked(
    frame: Iterable[Sequence[Any]], number: int, alias: Mapping[str, str]
) -> list[tuple[Any, ...]]:
    """Check the records of a frame, and replace aliases by the categories' names."""
    if isinstance(frame, str | bytes) or not isinstance(frame, Iterable):
        raise ValueError(f"frame {number} must be a list of records, got {reprlib.repr(frame)}")
    out = []
    for i, record in enumerate(frame):
        if not _is_record(record):
            raise ValueError(
                f"frame {number}, record {i} must be (category, x, y, w, h) or (category, x, y, "
                "w, h, confidence) with finite numbers and "
                f"without negative sizes, got {reprlib.repr(record)}"
            )
        out.append((alias.get(str(record[0]), str(record[0])), *record[1:]))
    return out


def _is_record(record: Any) -> bool:
    if (
        not isinstance(record, Sequence | np.ndarray)
        or isinstance(record, str | bytes)
        or len(record) not in (5, 6)
    ):
        return False
    try:
        numbers = [float(n) for n in record[1:] if not isinstance(n, str | bytes)]
    except (TypeError, ValueError, OverflowError):
        return False
    return (
        isinstance(record[0], str)
        and len(numbers) == len(record) - 1
        and all(map(math.isfinite, numbers))
        and min(numbers[2:4]) >= 0
    )


def require_same_frames(left: Detections, right: Detections) -> None:
    """Raise an error unless both are detections of the same number of frames."""
    _require_detections(left, right)
    if len(left) != len(right):
        raise ValueError(
            f"both sides must describe the same frames, got {len(left)} and {len(right)} frames"
        )


def _require_detections(*sides: object) -> None:
    for side in sides:
        if not isinstance(side, Detections):
            raise TypeError(
                f"expected Detections, got {type(side).__name__}: convert objects with "
                "evaluation.detections(objects), and lists with evaluation.from_records(records, "
                "game)"
            )


def common_labels(*sides: Detections | None) -> tuple[tuple[str, ...], list[np.ndarray]]:
    """Translate labels into one list of categories.

    Returns:
        The names of all categories in order of first appearance, and the labels of each side that
        is not None as indices into them.
    """
    given = [side for side in sides if side is not None]
    _require_detections(*given)
    names = tuple(dict.fromkeys(name for side in given for name in side.categories))
    tables = (np.array([*(names.index(name) for name in side.categories), -1]) for side in given)
    return names, [table[side.label] for table, side in zip(tables, given, strict=True)]


@dataclasses.dataclass(frozen=True)
class Columns:
    """The columns of one category's boxes in each frame, packed to the left."""

    index: np.ndarray  # int [B, K]
    present: np.ndarray  # bool [B, K]

    def __getitem__(self, frames: slice) -> "Columns":
        return Columns(self.index[frames], self.present[frames])

    @property
    def width(self) -> int:
        """The largest number of boxes in a frame."""
        return self.index.shape[1]

    def take(self, values: np.ndarray) -> np.ndarray:
        """Gather the entries of `values` `[B, N, ...]` in these columns, `[B, K, ...]`."""
        return np.take_along_axis(
            values, self.index.reshape(*self.index.shape, *[1] * (values.ndim - 2)), axis=1
        )


def columns_of(label: np.ndarray, category: int) -> Columns:
    """Return the columns of the boxes of a category."""
    mask = label == category
    most = int(mask.sum(axis=1).max(initial=0))
    index = np.argsort(~mask, axis=1, kind="stable")[:, :most]
    return Columns(index, np.take_along_axis(mask, index, axis=1))


def chunks(num_frames: int, pairs_per_frame: int) -> Iterator[slice]:
    """Slice the frames, so that a comparison of all pairs in a slice fits in memory."""
    step = max(1, PAIRS_AT_ONCE // pairs_per_frame)
    return (slice(start, start + step) for start in range(0, num_frames, step))


def match(left: Detections, right: Detections, radius: float = RADIUS) -> np.ndarray:
    """Match the boxes of two batches one to one within frame and category, nearest first.

    This is the rule of the OCAtari paper (Delfosse et al., 2024).

    Args:
        left, right: detections of the same frames.
        radius: largest distance between matched centres in pixels.

    Returns:
        int `[B, N]`: for each box of `left` the column of its match in `right`, or -1.

    Raises:
        TypeError: an argument is no `Detections`.
        ValueError: the numbers of frames differ.
    """
    require_same_frames(left, right)
    names, (mine, theirs) = common_labels(left, right)
    centers_a, centers_b = left.centers, right.centers
    out = np.full(left.label.shape, -1)
    for category in range(len(names)):
        a, b = columns_of(mine, category), columns_of(theirs, category)
        if not (a.width and b.width):
            continue
        for s in chunks(len(left), a.width * b.width):
            candidates = _within_reach(a[s], b[s], centers_a[s], centers_b[s], radius)
            frame, i, j = _greedy(*candidates)
            out[s.start + frame, a.index[s.start + frame, i]] = b.index[s.start + frame, j]
    return out


# Frame, position in the left columns, position in the right columns; each int [pairs].
Pairs = tuple[np.ndarray, np.ndarray, np.ndarray]


def _within_reach(
    a: Columns, b: Columns, centers_a: np.ndarray, centers_b: np.ndarray, radius: float
) -> Pairs:
    """Find all pairs at most `radius` apart, sorted by frame, then distance, then position."""
    p, q = a.take(centers_a)[:, :, None], b.take(centers_b)[:, None]
    distance = p[..., 0] - q[..., 0]
    np.hypot(distance, p[..., 1] - q[..., 1], out=distance)
    frame, i, j = np.nonzero(distance <= radius)
    present = a.present[frame, i] & b.present[frame, j]
    frame, i, j = frame[present], i[present], j[present]
    order = np.lexsort((j, i, distance[frame, i, j], frame))
    return frame[order], i[order], j[order]


def _greedy(frame: np.ndarray, i: np.ndarray, j: np.ndarray) -> Pairs:
    """Choose pairs greedily from sorted candidates."""
    left, right, chosen = set(), set(), []
    for k, (f, a, b) in enumerate(zip(frame.tolist(), i.tolist(), j.tolist(), strict=True)):
        if (f, a) not in left and (f, b) not in right:
            left.add((f, a))
            right.add((f, b))
            chosen.append(k)
    return frame[chosen], i[chosen], j[chosen]


def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of boxes.

    Args:
        a, b: `[..., 4]`, left, top, width and height; they broadcast.

    Returns:
        float64 `[...]`, 0 if both boxes are empty.
    """
    a, b = a.astype(np.float64), b.astype(np.float64)
    size = np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:]) - np.maximum(
        a[..., :2], b[..., :2]
    )
    intersection = np.prod(np.maximum(size, 0), axis=-1)
    union = np.prod(a[..., 2:], axis=-1) + np.prod(b[..., 2:], axis=-1) - intersection
    return np.divide(intersection, union, out=np.zeros_like(intersection), where=union > 0)
