"""How well two sets of objects agree: matching, precision, recall, F1, IoU, mean average precision, identity switches, values.

Works on `Detections`: whoever has a detector of their own scores it against REM or VEM with the same functions.

    truth = evaluation.detections(game.rem(rams))
    mine = evaluation.from_records(records, game)  # [[("Ball", x, y, w, h), ...], ...], one list a frame
    evaluation.agreement(mine, truth).sum(axis=0).f1  # by category
    evaluation.average_precision(mine, truth).mean()  # mAP

Two objects match when they are of the same category and their centres are within 5 pixels; matches are one to one, nearest first: the
rule of the OCAtari paper (Delfosse et al., 2024). Everything is in numpy, on whole batches.
"""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from ocjax import tracking
from ocjax.game import Game
from ocjax.objects import Objects

RADIUS = 5.0
THRESHOLDS = tuple(np.linspace(0.5, 0.95, 10).tolist())  # of the IoU, as COCO has them
SCORE_NAMES, LIVES_NAMES = ("Score", "PlayerScore", "P1Score"), ("Lives", "Life", "Live")
PAIRS_AT_ONCE = 1 << 23  # bounds the memory of matching


@dataclasses.dataclass(frozen=True)
class Detections:
    """Boxes of a batch of frames, padded: `B` frames, at most `N` boxes each."""

    xywh: np.ndarray  # [B, N, 4]: left, top, width, height in pixels
    label: np.ndarray  # int [B, N]: index of the category, -1 where there is no box
    categories: tuple[str, ...]  # names of the labels
    score: np.ndarray | None = None  # [B, N]: confidence, for average_precision; None: all the same

    def __post_init__(self) -> None:
        if self.xywh.ndim != 3 or self.xywh.shape[2] != 4:
            raise ValueError(f"xywh must have shape [frames, boxes, 4], got {list(self.xywh.shape)}")
        for name, array in (("label", self.label), ("score", self.score)):
            if array is not None and array.shape != self.xywh.shape[:2]:
                raise ValueError(f"{name} must have shape {list(self.xywh.shape[:2])}, as xywh's boxes, got {list(array.shape)}")
        if not np.issubdtype(self.label.dtype, np.integer):
            raise TypeError(f"label must be integers, got {self.label.dtype}")
        if self.label.size and not -1 <= self.label.min() <= self.label.max() < len(self.categories):
            raise ValueError(f"label must be -1 to {len(self.categories) - 1}, got {self.label.min()} to {self.label.max()}")

    def __len__(self) -> int:
        return len(self.label)


def detections(objects: Objects) -> Detections:
    """The valid objects of a game, batch shape `[B]`, with the game's categories as labels and its slots as places."""
    game = _game_of(objects)
    valid = np.asarray(objects.valid)
    return Detections(np.asarray(objects.xywh), np.where(valid, game.slot_category, -1), tuple(c.name for c in game.categories))


def _game_of(objects: Objects) -> Game:
    if objects.game is None:
        raise ValueError("these objects do not know their game; take them as game.rem or game.vem returns them")
    return objects.game


def from_records(records: Iterable[Iterable[Sequence[Any]]], game: Game) -> Detections:
    """Detections from one list a frame of `(category, x, y, w, h)` or `(category, x, y, w, h, confidence)`.

    Categories that the game does not have get labels after its own: they count, and match nothing of the game's.
    """
    frames = [[tuple(r) for r in frame] for frame in records]
    names = list(dict.fromkeys([c.name for c in game.categories] + [str(r[0]) for frame in frames for r in frame]))
    most = max((len(frame) for frame in frames), default=0)
    xywh, label = np.zeros((len(frames), most, 4)), np.full((len(frames), most), -1)
    score = np.ones((len(frames), most)) if any(len(r) == 6 for frame in frames for r in frame) else None
    for b, frame in enumerate(frames):
        for i, record in enumerate(frame):
            xywh[b, i], label[b, i] = record[1:5], names.index(str(record[0]))
            if score is not None and len(record) == 6:
                score[b, i] = record[5]
    return Detections(xywh, label, tuple(names), score)


def _together(*parts: Detections | None) -> tuple[tuple[str, ...], list[np.ndarray]]:
    """Names of all labels that occur, and each part's labels as indices into them."""
    names = tuple(dict.fromkeys(n for p in parts if p is not None for n in p.categories))
    out = []
    for p in parts:
        if p is not None:
            table = np.array([*(names.index(n) for n in p.categories), -1])
            out.append(table[p.label])
    return names, out


def _of_label(label: np.ndarray, category: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns of each frame's boxes of a category, packed to the left: int `[B, K]`, and bool `[B, K]`, which there are."""
    mask = label == category
    most = int(mask.sum(axis=1).max(initial=0))
    columns = np.argsort(~mask, axis=1, kind="stable")[:, :most]
    return columns, np.take_along_axis(mask, columns, axis=1)


def _pairs(a: Detections, b: Detections, labels: list[np.ndarray], n: int) -> Iterator[tuple[int, slice, list[np.ndarray]]]:
    """For each category and part of the frames: columns and masks of both sides' boxes of that category."""
    for category in range(n):
        (i, has_i), (j, has_j) = (_of_label(label, category) for label in labels)
        if i.shape[1] and j.shape[1]:
            step = max(1, PAIRS_AT_ONCE // (i.shape[1] * j.shape[1]))
            for start in range(0, len(a), step):
                s = slice(start, start + step)
                yield category, s, [i[s], has_i[s], j[s], has_j[s]]


def match(left: Detections, right: Detections, radius: float = RADIUS) -> np.ndarray:
    """Pair the boxes of two batches, frame by frame: greedily, nearest centres first, within a category.

    Args:
        left, right: detections of the same frames.
        radius: largest distance of the centres in pixels.

    Returns:
        int `[B, N]`: for each box of `left` the index of the box of `right` that it matches, or -1.

    Raises:
        ValueError: the numbers of frames differ.
    """
    if len(left) != len(right):
        raise ValueError(f"both must be of the same frames, got {len(left)} and {len(right)}")
    names, labels = _together(left, right)
    centers = [d.xywh[..., :2].astype(np.float32) + d.xywh[..., 2:].astype(np.float32) / 2 for d in (left, right)]
    out = np.full(left.label.shape, -1)
    for _, s, (i, has_i, j, has_j) in _pairs(left, right, labels, len(names)):
        a = np.take_along_axis(centers[0][s], i[..., None], axis=1)[:, :, None]
        b = np.take_along_axis(centers[1][s], j[..., None], axis=1)[:, None]
        distance = np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])
        frame, p, q = np.nonzero((distance <= radius) & has_i[:, :, None] & has_j[:, None])
        order = np.lexsort((q, p, distance[frame, p, q], frame))
        frame, p, q = frame[order], p[order], q[order]
        while len(frame):  # pairs that are the nearest left for both of their ends are what the greedy choice takes first
            first_of_p = np.unique(frame * i.shape[1] + p, return_index=True)[1]
            first_of_q = np.unique(frame * j.shape[1] + q, return_index=True)[1]
            taken = np.intersect1d(first_of_p, first_of_q, assume_unique=True)
            out[s.start + frame[taken], i[frame[taken], p[taken]]] = j[frame[taken], q[taken]]
            used_p, used_q = np.zeros(i.shape, bool), np.zeros(j.shape, bool)
            used_p[frame[taken], p[taken]] = True
            used_q[frame[taken], q[taken]] = True
            left_over = ~used_p[frame, p] & ~used_q[frame, q]
            frame, p, q = frame[left_over], p[left_over], q[left_over]
    return out


def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of boxes `[..., 4]` (left, top, width, height); 0 where both are empty."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    corner = np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:]) - np.maximum(a[..., :2], b[..., :2])
    common = np.prod(np.maximum(corner, 0), axis=-1)
    union = np.prod(a[..., 2:], axis=-1) + np.prod(b[..., 2:], axis=-1) - common
    return np.divide(common, union, out=np.zeros_like(common), where=union > 0)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    part, whole = np.asarray(part, float), np.asarray(whole, float)
    return np.divide(part, whole, out=np.full(whole.shape, np.nan), where=whole > 0)


@dataclasses.dataclass(frozen=True)
class Agreement:
    """Counts from which the scores follow, of one shape: `[frames, categories]`, or what `sum` leaves of it.

    Scores are nan where there is nothing to score.
    """

    left: np.ndarray  # objects of the first method (REM)
    right: np.ndarray  # objects of the second method (VEM) on the frame itself
    confirmed: np.ndarray  # of the first, those matched on the frame or, where it is given, the one before
    found: np.ndarray  # of the second, those matched
    exact: np.ndarray  # matches on the frame with identical boxes
    overlap: np.ndarray  # sum of the IoU over matches on the frame

    def each(self, f: Callable[[np.ndarray], np.ndarray]) -> "Agreement":
        """The counts after a function of each."""
        return Agreement(*(f(getattr(self, field.name)) for field in dataclasses.fields(self)))

    def sum(self, axis: int | tuple[int, ...] | None = None) -> "Agreement":
        """Counts together: over frames (axis 0), over categories (axis 1), or over all."""
        return self.each(lambda a: np.sum(a, axis=axis))

    @property
    def precision(self) -> np.ndarray:
        """Share of the first method's objects that the second confirms."""
        return _ratio(self.confirmed, self.left)

    @property
    def recall(self) -> np.ndarray:
        """Share of the second method's objects that the first finds."""
        return _ratio(self.found, self.right)

    @property
    def f1(self) -> np.ndarray:
        """Harmonic mean of precision and recall."""
        p, r = self.precision, self.recall
        return np.where(p + r > 0, _ratio(2 * p * r, p + r), p + r)  # 0 where both are, nan where one is

    @property
    def mean_iou(self) -> np.ndarray:
        """Mean IoU over matches on the frame."""
        return _ratio(self.overlap, self.found)

    @property
    def exact_rate(self) -> np.ndarray:
        """Share of matches on the frame whose boxes are identical."""
        return _ratio(self.exact, self.found)


def agreement(
    left: Detections, right: Detections, before: Detections | None = None, radius: float = RADIUS, pairs: np.ndarray | None = None
) -> Agreement:
    """Agreement of two methods on a batch of frames, by frame and category.

    Args:
        left: of the method that reports what exists (REM).
        right: of the method that reports what is drawn (VEM), on the same frames.
        before: of the latter on the emulated frame just before each. With it the scores are flicker-aware: a box of `left` that is not
            matched on the frame may be matched there; everything in `right` must still be found.
        radius: largest distance of the centres in pixels.
        pairs: what `match(left, right, radius)` gives, where it is known already.

    Returns:
        Counts of shape `[B, categories]`, in the order of `left`'s categories, then those that only the others have.
    """
    names, labels = _together(left, right, before)
    pairs = match(left, right, radius) if pairs is None else pairs
    frame, i = np.nonzero(pairs >= 0)
    overlap = np.zeros(pairs.shape)
    overlap[frame, i] = iou(left.xywh[frame, i], right.xywh[frame, pairs[frame, i]])
    confirmed = pairs >= 0
    if before is not None:
        rest = dataclasses.replace(left, label=np.where(confirmed, -1, left.label))
        confirmed = confirmed | (match(rest, before, radius) >= 0)

    def count(label: np.ndarray, weight: np.ndarray) -> np.ndarray:
        flat = (np.arange(len(label))[:, None] * len(names) + label)[label >= 0]
        return np.bincount(flat, weight[label >= 0], minlength=len(label) * len(names)).reshape(len(label), len(names))

    mine, theirs = labels[:2]
    return Agreement(
        left=count(mine, np.ones(mine.shape)),
        right=count(theirs, np.ones(theirs.shape)),
        confirmed=count(mine, confirmed),
        found=count(mine, pairs >= 0),
        exact=count(mine, overlap == 1),
        overlap=count(mine, overlap),
    )


def intervals(
    counts: Agreement, episode: np.ndarray, score: Callable[[Agreement], np.ndarray], *, draws: int = 1000, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """95 % confidence interval of a score, by bootstrap over episodes (frames of one episode are not independent).

    Args:
        counts: of shape `[frames, ...]`.
        episode: int `[frames]`, which episode each frame belongs to.
        score: of summed counts, e.g. `lambda a: a.f1`.
        draws: resamplings.
        seed: of the resampling.

    Returns:
        Lower and upper bound, shape `[...]`; nan with fewer than two episodes.
    """
    index = np.unique(episode, return_inverse=True)[1]
    n = int(index.max(initial=-1)) + 1

    def by_episode(a: np.ndarray) -> np.ndarray:
        out = np.zeros((n, *a.shape[1:]))
        np.add.at(out, index, a)
        return out

    if n < 2:
        empty = np.full(counts.left.shape[1:], np.nan)
        return empty, empty
    weights = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), draws).astype(float)
    drawn = score(counts.each(lambda a: np.tensordot(weights, by_episode(a), axes=1)))
    missing = np.isnan(drawn).all(axis=0)  # nothing to score in any draw
    low, high = np.nanpercentile(np.where(missing, 0, drawn), [2.5, 97.5], axis=0)
    return np.where(missing, np.nan, low), np.where(missing, np.nan, high)


def average_precision(detected: Detections, truth: Detections, thresholds: Sequence[float] = THRESHOLDS) -> np.ndarray:
    """Average precision by category and IoU threshold, as COCO defines it (101 points of recall); its mean is the mAP.

    Boxes are taken in the order of their confidence, each takes the free box of its category with the largest IoU. Where detections
    have no confidence, or equal ones, they stand or fall together.

    Returns:
        float `[categories, thresholds]`, in the order of `truth`'s categories; nan where `truth` has none of a category.
    """
    if len(detected) != len(truth):
        raise ValueError(f"both must be of the same frames, got {len(detected)} and {len(truth)}")
    _, (theirs, mine) = _together(truth, detected)
    confidence = np.ones(detected.label.shape) if detected.score is None else detected.score
    ranked = np.argsort(-confidence, axis=1, kind="stable")
    mine, confidence = np.take_along_axis(mine, ranked, 1), np.take_along_axis(confidence, ranked, 1)
    boxes = np.take_along_axis(detected.xywh, ranked[..., None], 1)
    limits = np.asarray(thresholds, float)
    out = np.full((len(truth.categories), len(limits)), np.nan)
    for c in range(len(truth.categories)):
        n_truth = int((theirs == c).sum())
        if not n_truth:
            continue
        found: list[tuple[np.ndarray, np.ndarray]] = []  # confidences, hits by threshold
        (i, has_i), (j, has_j) = _of_label(mine, c), _of_label(theirs, c)
        step = max(1, PAIRS_AT_ONCE // max(1, i.shape[1] * max(j.shape[1], len(limits))))
        for start in range(0, len(truth), step):
            s = slice(start, start + step)
            a, b = np.take_along_axis(boxes[s], i[s, :, None], 1), np.take_along_axis(truth.xywh[s], j[s, :, None], 1)
            overlap = np.where(has_j[s, None], iou(a[:, :, None], b[:, None]), -1)
            free = np.ones((len(limits), *j[s].shape), bool)
            rows = np.arange(len(a))
            for k in range(i.shape[1]):
                hits = np.zeros((len(a), len(limits)), bool)
                if j.shape[1]:
                    for t, limit in enumerate(limits):
                        left = np.where(free[t], overlap[:, k], -1)
                        best = left.argmax(axis=1)
                        hits[:, t] = (left[rows, best] >= limit) & has_i[s][:, k]
                        free[t, rows, best] &= ~hits[:, t]
                at = np.take_along_axis(confidence[s], i[s, k : k + 1], 1)[:, 0]
                found.append((at[has_i[s][:, k]], hits[has_i[s][:, k]]))
        scores = np.concatenate([f[0] for f in found]) if found else np.zeros(0)
        hits = np.concatenate([f[1] for f in found]) if found else np.zeros((0, len(limits)), bool)
        order = np.argsort(-scores, kind="stable")
        ends = np.append(np.flatnonzero(np.diff(scores[order])), len(order) - 1)[: len(order)]
        good = np.cumsum(hits[order], axis=0)[ends]
        precision, recall = good / (ends[:, None] + 1), good / n_truth
        for t in range(len(limits)):
            best = np.maximum.accumulate(precision[::-1, t])[::-1]
            place = np.searchsorted(recall[:, t], np.linspace(0, 1, 101) - 1e-12)
            out[c, t] = np.append(best, 0)[place].mean()
    return out


def identity_switches(rem: Objects, vem: Objects, resets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How often an object that goes on changes its slot in REM, by category.

    Which objects go on is told by `ocjax.track` on what VEM sees; its own mistakes count as switches too, so this is an upper bound.

    Args:
        rem, vem: objects of successive samples, batch shape `[B]`.
        resets: bool `[B]`, first sample of an episode.

    Returns:
        int `[categories]` switches, and the number of times that an object goes on.
    """
    game = _game_of(vem)

    def step(before: Objects, now: tuple[Objects, jax.Array]) -> tuple[Objects, tuple[jax.Array, jax.Array]]:
        tracked = tracking.track(before, now[0], is_first=now[1])
        return tracked, (tracked.xywh, tracked.valid)

    vem, rem = (jax.tree.map(jax.numpy.asarray, o) for o in (vem, rem))
    first = jax.tree.map(jax.numpy.zeros_like, vem[0])
    _, (xywh, valid) = jax.jit(lambda v, r: jax.lax.scan(step, first, (v, r)))(vem, np.asarray(resets))
    tracked = dataclasses.replace(vem, xywh=xywh, valid=valid)
    slot = match(detections(tracked), detections(rem))
    on = (slot[1:] >= 0) & (slot[:-1] >= 0) & ~np.asarray(resets)[1:, None]
    moved = on & (slot[1:] != slot[:-1])
    n = len(game.categories)
    return tuple(np.bincount(np.broadcast_to(game.slot_category, on.shape)[m], minlength=n) for m in (moved, on))  # pyright: ignore


def value_shares(rem: Objects, rewards: np.ndarray, lives: np.ndarray) -> dict[str, float]:
    """Shares of samples in which REM's score is the sum of rewards, and of those that show lives, in which they are the emulator's.

    By category: of those that have a value and one slot, the score and the lives. Where the enemy has a score, the reward is the
    difference of the two.
    """
    game, out = _game_of(rem), {}
    for names, want in ((SCORE_NAMES, rewards), (LIVES_NAMES, lives)):
        for c in game.categories:
            if c.name in names and c.count == 1 and "value" in c.attributes and c.name not in out:
                at = game.slices[c.name].start
                value, valid = np.asarray(rem.value)[:, at], np.asarray(rem.valid)[:, at]
                if names is SCORE_NAMES and "EnemyScore" in game.slices:
                    value = value - np.asarray(rem.value)[:, game.slices["EnemyScore"].start]
                counts = valid | (names is SCORE_NAMES)
                out[c.name] = float(_ratio((value == want)[counts].sum(), counts.sum()))
    return out


def coverage(boxes: Detections, sprites: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """How boxes lie on what the video chip drew.

    Args:
        boxes: of `B` frames.
        sprites: bool `[B, H, W]`, pixels of moving graphics objects on the frame.
        drawn: bool `[B, H, W]`, pixels of any graphics object on the frame or the one before.

    Returns:
        Share of sprite pixels inside boxes, share of boxes that hold drawn pixels.
    """
    frame, i = np.nonzero(boxes.label >= 0)
    x, y, w, h = np.moveaxis(boxes.xywh[frame, i].astype(int), -1, 0)
    height, width = sprites.shape[1:]
    x, y, right, bottom = (np.clip(v, 0, limit) for v, limit in ((x, width), (y, height), (x + w, width), (y + h, height)))
    corners = np.zeros((len(boxes), height + 1, width + 1), np.int32)
    for row, column, sign in ((y, x, 1), (y, right, -1), (bottom, x, -1), (bottom, right, 1)):
        np.add.at(corners, (frame, row, column), sign)
    inside = np.cumsum(np.cumsum(corners, axis=1), axis=2)[:, :-1, :-1] > 0
    area = np.zeros(corners.shape, np.int32)
    area[:, 1:, 1:] = np.cumsum(np.cumsum(drawn, axis=1, dtype=np.int32), axis=2)
    held = area[frame, bottom, right] - area[frame, y, right] - area[frame, bottom, x] + area[frame, y, x] > 0
    return float(_ratio((inside & sprites).sum(), sprites.sum())), float(_ratio(held.sum(), np.array(len(held))))
