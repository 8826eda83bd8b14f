"""Metrics of the agreement of two methods.

Most take `Detections`, so the same functions score your own detector against REM or VEM:

    truth = evaluation.detections(game.rem(rams))
    mine = evaluation.from_records(records, game)  # [[("Ball", x, y, w, h), ...], ...]
    evaluation.agreement(mine, truth).sum(axis=0).f1  # by category
    numpy.nanmean(evaluation.average_precision(mine, truth))  # mAP

The records are a list for each frame. Two objects match if they have the same category and their
centres are within 5 pixels. Matches are one to one, nearest first, as in the OCAtari paper
(Delfosse et al., 2024).
"""

import dataclasses
from collections.abc import Callable, Sequence

import jax
import numpy as np

from ocjax.evaluation import matching
from ocjax.evaluation.matching import RADIUS, Detections, detections, iou, match
from ocjax.extraction.categories import with_role
from ocjax.extraction.objects import Objects, whose
from ocjax.transforms import tracking

THRESHOLDS = tuple(np.linspace(0.5, 0.95, 10).tolist())  # IoU thresholds of COCO
_RECALLS = np.linspace(0, 1, 101)  # recall levels of COCO
_ROUNDING = 1e-12  # a recall this far below a level still reaches it


# --------------------------------------------------------------------------------------------------
# agreement


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    part, whole = np.asarray(part, float), np.asarray(whole, float)
    return np.divide(part, whole, out=np.full(whole.shape, np.nan), where=whole > 0)


@dataclasses.dataclass(frozen=True, repr=False)
class Agreement:
    """Counts of objects and matches, with the scores computed from them.

    `agreement` returns counts of shape `[frames, categories]`, and `sum` adds them up. Scores have
    the same shape, and are nan if there is nothing to score.

    Args:
        left: objects of the first method (REM).
        right: objects of the second method (VEM) on the frame itself.
        confirmed: objects of the first method that are matched on the frame or on the frame before,
            if given.
        found: objects of the second method that are matched.
        exact: matches on the frame with identical boxes.
        overlap: sum of the IoU over matches on the frame.
    """

    left: np.ndarray
    right: np.ndarray
    confirmed: np.ndarray
    found: np.ndarray
    exact: np.ndarray
    overlap: np.ndarray

    def __repr__(self) -> str:
        total = self.sum()
        return (
            f"Agreement of {int(total.left):,} and {int(total.right):,} objects, "
            f"shape {list(np.shape(self.left))}: F1 {float(total.f1):.3f}"
        )

    def map(self, f: Callable[[np.ndarray], np.ndarray]) -> "Agreement":
        """Apply a function to each count."""
        return Agreement(*(f(getattr(self, field.name)) for field in dataclasses.fields(self)))

    def sum(self, axis: int | tuple[int, ...] | None = None) -> "Agreement":
        """Sum the counts over frames (axis 0), categories (axis 1) or everything (None)."""
        return self.map(lambda a: np.sum(a, axis=axis))

    @property
    def precision(self) -> np.ndarray:
        """Fraction of the first method's objects that the second confirms."""
        return _ratio(self.confirmed, self.left)

    @property
    def recall(self) -> np.ndarray:
        """Fraction of the second method's objects that the first finds."""
        return _ratio(self.found, self.right)

    @property
    def f1(self) -> np.ndarray:
        """Harmonic mean of precision and recall.

        It is 0 if exactly one method has objects, and nan only if both have none.
        """
        p, r = self.precision, self.recall
        mean = np.where(p + r > 0, _ratio(2 * p * r, p + r), 0.0)  # 0 also if p or r is nan
        return np.where((np.asarray(self.left) > 0) | (np.asarray(self.right) > 0), mean, np.nan)

    @property
    def mean_iou(self) -> np.ndarray:
        """Mean IoU of matches on the frame."""
        return _ratio(self.overlap, self.found)

    @property
    def exact_rate(self) -> np.ndarray:
        """Fraction of matches on the frame with identical boxes."""
        return _ratio(self.exact, self.found)


def agreement(
    left: Detections,
    right: Detections,
    before: Detections | None = None,
    radius: float = RADIUS,
    pairs: np.ndarray | None = None,
) -> Agreement:
    """Count the agreement of two methods, by frame and category.

    Args:
        left: detections of the method that reports existing objects (REM).
        right: detections of the method that reports drawn objects (VEM), on the same frames.
        before: detections of the second method on the emulated frame just before each frame. They
            make the scores flicker-aware: a box of `left` without a match on the frame may have one
            on the frame before. Every box of `right` must still be found.
        radius: largest distance between matched centres in pixels.
        pairs: the result of `match(left, right, radius)`, if it is already known.

    Returns:
        Counts of shape `[B, categories]`: the categories of `left`, then further ones.

    Raises:
        TypeError: an argument is no `Detections`.
        ValueError: the numbers of frames differ.
    """
    names, (mine, theirs, *_) = matching.common_labels(left, right, before)
    pairs = match(left, right, radius) if pairs is None else pairs
    found = confirmed = pairs >= 0
    frame, i = np.nonzero(found)
    overlap = np.zeros(pairs.shape)
    overlap[frame, i] = iou(left.xywh[frame, i], right.xywh[frame, pairs[frame, i]])
    if before is not None:
        confirmed = found | (match(left.without(found), before, radius) >= 0)

    def count(label: np.ndarray, weight: np.ndarray) -> np.ndarray:
        bins = (np.arange(len(label))[:, None] * len(names) + label)[label >= 0]
        return np.bincount(bins, weight[label >= 0], minlength=len(label) * len(names)).reshape(
            len(label), len(names)
        )

    return Agreement(
        left=count(mine, np.ones(mine.shape)),
        right=count(theirs, np.ones(theirs.shape)),
        confirmed=count(mine, confirmed),
        found=count(mine, found),
        exact=count(mine, overlap == 1),
        overlap=count(mine, overlap),
    )


def intervals(
    counts: Agreement,
    episode: np.ndarray,
    score: Callable[[Agreement], np.ndarray],
    *,
    draws: int = 1000,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Bootstrap the 95 % confidence interval of a score over episodes.

    Frames of one episode are not independent.

    Args:
        counts: of shape `[frames, ...]`.
        episode: int `[frames]`, number of each frame's episode.
        score: a score of summed counts, for example `lambda a: a.f1`.
        draws: number of bootstrap samples.
        seed: seed of the bootstrap.

    Returns:
        Lower and upper bounds of shape `[...]`, nan with fewer than two episodes.
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
    drawn = score(counts.map(lambda a: np.tensordot(weights, by_episode(a), axes=1)))
    missing = np.isnan(drawn).all(axis=0)  # nothing to score in any draw
    low, high = np.nanpercentile(np.where(missing, 0, drawn), [2.5, 97.5], axis=0)
    return np.where(missing, np.nan, low), np.where(missing, np.nan, high)


# --------------------------------------------------------------------------------------------------
# average precision


def average_precision(
    detected: Detections, truth: Detections, thresholds: Sequence[float] = THRESHOLDS
) -> np.ndarray:
    """Average precision as COCO defines it, with 101 levels of recall.

    The mAP is `numpy.nanmean` of the result: as in COCO, categories that do not occur are ignored.
    Boxes are assigned in descending order of confidence, each to the unassigned true box of its
    category with the largest IoU. Boxes of equal confidence enter the precision-recall curve
    together; without confidences, all boxes do.

    Args:
        detected: detections to score.
        truth: the ground truth, on the same frames.
        thresholds: minimum IoU of a hit.

    Returns:
        float `[categories, thresholds]` in the order of `truth.categories`; nan for categories
        without a box in `truth`.

    Raises:
        TypeError: an argument is no `Detections`.
        ValueError: the numbers of frames differ.
    """
    matching.require_same_frames(detected, truth)
    _, (theirs, mine) = matching.common_labels(truth, detected)
    confidence = np.ones(detected.label.shape) if detected.score is None else detected.score
    limits = np.asarray(thresholds, float)
    out = np.full((len(truth.categories), len(limits)), np.nan)
    for c in range(len(truth.categories)):
        if not (theirs == c).any():
            continue
        scores, hits = [np.zeros(0)], [np.zeros((0, len(limits)), bool)]
        for b in np.flatnonzero((mine == c).any(axis=1)):
            own, true = np.flatnonzero(mine[b] == c), np.flatnonzero(theirs[b] == c)
            own = own[np.argsort(-confidence[b, own], kind="stable")]
            scores.append(confidence[b, own])
            overlap = iou(detected.xywh[b, own][:, None], truth.xywh[b, true][None])
            hits.append(_hits(overlap, limits))
        count = int((theirs == c).sum())
        out[c] = _interpolated_precision(np.concatenate(scores), np.concatenate(hits), count)
    return out


def _hits(overlap: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Assign boxes in order to the free true box with the largest IoU.

    Args:
        overlap: float `[boxes, true boxes]`, the IoU.
        limits: least IoU of a hit, float `[thresholds]`.

    Returns:
        bool `[boxes, thresholds]`, whether a box hits.
    """
    hits = np.zeros((len(overlap), len(limits)), bool)
    if not overlap.size:
        return hits
    free, thresholds = np.ones((len(limits), overlap.shape[1]), bool), np.arange(len(limits))
    for k, row in enumerate(overlap):
        candidates = np.where(free, row, -1)
        best = candidates.argmax(axis=1)
        hits[k] = candidates[thresholds, best] >= limits
        free[thresholds, best] &= ~hits[k]
    return hits


def _interpolated_precision(scores: np.ndarray, hits: np.ndarray, count: int) -> np.ndarray:
    """Average the best precision at each level of recall or above, float `[thresholds]`.

    `count` is the number of true boxes.
    """
    order = np.argsort(-scores, kind="stable")
    # Last box of each run of equal confidences.
    ends = np.append(np.flatnonzero(np.diff(scores[order])), len(order) - 1)[: len(order)]
    good = np.cumsum(hits[order], axis=0)[ends]
    precision, recall = good / (ends[:, None] + 1), good / count
    out = np.zeros(hits.shape[1])
    for t in range(len(out)):
        best = np.maximum.accumulate(precision[::-1, t])[::-1]
        out[t] = np.append(best, 0)[np.searchsorted(recall[:, t], _RECALLS - _ROUNDING)].mean()
    return out


# --------------------------------------------------------------------------------------------------
# identities, values, pixels


def identity_switches(
    rem: Objects, vem: Objects, resets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Count how often a persistent object changes its slot in REM, by category.

    `ocjax.track` on VEM's objects decides which objects persist. Its mistakes count as switches
    too, so the result is an upper bound.

    Args:
        rem, vem: objects of successive samples, batch shape `[B]`.
        resets: bool `[B]`, first sample of an episode.

    Returns:
        int `[categories]` switches and int `[categories]` transitions with a persistent object.
    """
    game = whose(vem)

    def step(
        before: Objects, current: tuple[Objects, jax.Array]
    ) -> tuple[Objects, tuple[jax.Array, jax.Array]]:
        tracked = tracking.track(before, current[0], is_first=current[1])
        return tracked, (tracked.xywh, tracked.valid)

    vem, rem = (jax.tree.map(jax.numpy.asarray, o) for o in (vem, rem))
    first = jax.tree.map(jax.numpy.zeros_like, vem[0])
    _, (xywh, valid) = jax.jit(lambda v, r: jax.lax.scan(step, first, (v, r)))(
        vem, np.asarray(resets)
    )
    tracked = dataclasses.replace(vem, xywh=xywh, valid=valid)
    slot = match(detections(tracked), detections(rem))
    persists = (slot[1:] >= 0) & (slot[:-1] >= 0) & ~np.asarray(resets)[1:, None]
    switched = persists & (slot[1:] != slot[:-1])
    category = np.broadcast_to(game.slot_category, persists.shape)
    switches, transitions = (
        np.bincount(category[mask], minlength=len(game.categories)) for mask in (switched, persists)
    )
    return switches, transitions


def value_shares(rem: Objects, rewards: np.ndarray, lives: np.ndarray) -> dict[str, float]:
    """Fractions of samples with the right score and lives in REM, by category with a value.

    The score, minus an opponent's score, is right if it equals the sum of rewards. Lives are right
    if they equal the emulator's; samples without displayed lives are ignored. Of several scores,
    the first slot counts. Icons of lives are ignored.

    Args:
        rem: REM's objects, batch shape `[B]`.
        rewards: `[B]`, sum of rewards since the episode began.
        lives: `[B]`, the emulator's lives.

    Returns:
        Fractions; nan if all samples are ignored.
    """
    game, out = whose(rem), {}

    def first_value(category: str) -> np.ndarray:
        return np.asarray(rem.value)[:, game.slices[category].start]

    opponents = sum(
        (first_value(name) for name in with_role(game.categories, "opponent_score")), start=0
    )
    for c in game.categories:
        if "value" not in c.attributes:
            continue
        if c.role == "score":
            right = first_value(c.name) - opponents == rewards
            out[c.name] = float(_ratio(right.sum(), right.size))
        elif c.role == "lives" and c.count == 1:
            shown = np.asarray(rem.valid)[:, game.slices[c.name].start]
            right = shown & (first_value(c.name) == lives)
            out[c.name] = float(_ratio(right.sum(), shown.sum()))
    return out


def coverage(boxes: Detections, sprites: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """Compare boxes with the pixels that the video chip drew.

    Args:
        boxes: detections on `B` frames.
        sprites: bool `[B, H, W]`, pixels of moving graphics objects on the frame.
        drawn: bool `[B, H, W]`, pixels of any graphics object on the frame or the frame before.

    Returns:
        Fraction of sprite pixels inside boxes, and fraction of boxes with drawn pixels; nan without
        sprite pixels or boxes.
    """
    inside, with_pixels = np.zeros(sprites.shape, bool), []
    for frame, i in np.argwhere(boxes.label >= 0).tolist():
        x, y, w, h = boxes.xywh[frame, i].astype(int).tolist()
        area = frame, slice(max(y, 0), max(y + h, 0)), slice(max(x, 0), max(x + w, 0))
        inside[area] = True
        with_pixels.append(drawn[area].any())
    covered = _ratio((inside & sprites).sum(), sprites.sum())
    return float(covered), float(_ratio(np.sum(with_pixels), np.array(len(with_pixels))))
