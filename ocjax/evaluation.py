"""How well two sets of objects agree: matching, precision, recall, F1 and IoU, as the OCAtari paper measures them.

Two objects match when they are of the same category and their centres are within 5 pixels; matches are one to one, nearest first.
Everything is in numpy on whole batches.
"""

import dataclasses

import numpy as np

from ocjax.objects import Objects
from ocjax.spec import Game

RADIUS = 5.0


def match(left: Objects, right: Objects, slot_category: np.ndarray, radius: float = RADIUS) -> np.ndarray:
    """Pair the objects of two batches, frame by frame: greedily, nearest centres first, within a category.

    Args:
        left, right: objects of batch shape `[B]`, with the same slots.
        slot_category: int `[N]`, category of each slot (`game.slot_category`).
        radius: largest distance of the centres in pixels.

    Returns:
        int `[B, N]`: for each slot of `left` the slot of `right` that it matches, or -1.
    """
    boxes = [np.asarray(o.xywh).astype(np.float32) for o in (left, right)]
    centers = [b[..., :2] + b[..., 2:] / 2 for b in boxes]
    valid = [np.asarray(o.valid) for o in (left, right)]
    out = np.full(valid[0].shape, -1)
    for category in np.unique(slot_category):
        slots = np.flatnonzero(slot_category == category)
        a, b = (c[:, slots] for c in centers)
        both = valid[0][:, slots, None] & valid[1][:, None, slots]
        distance = np.hypot(a[:, :, None, 0] - b[:, None, :, 0], a[:, :, None, 1] - b[:, None, :, 1])
        frame, i, j = np.nonzero(both & (distance <= radius))
        order = np.lexsort((j, i, distance[frame, i, j], frame))
        frame, i, j = frame[order], i[order], j[order]
        while len(frame):  # pairs that are the nearest left for both of their ends are what the greedy choice takes first
            n = len(slots)
            first_of_i = np.unique(frame * n + i, return_index=True)[1]
            first_of_j = np.unique(frame * n + j, return_index=True)[1]
            taken = np.intersect1d(first_of_i, first_of_j, assume_unique=True)
            out[frame[taken], slots[i[taken]]] = slots[j[taken]]
            used_i, used_j = np.zeros((2, len(out), n), bool)
            used_i[frame[taken], i[taken]] = True
            used_j[frame[taken], j[taken]] = True
            left_over = ~used_i[frame, i] & ~used_j[frame, j]
            frame, i, j = frame[left_over], i[left_over], j[left_over]
    return out


def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of boxes `[..., 4]` (left, top, width, height); 0 where both are empty."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    corner = np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:]) - np.maximum(a[..., :2], b[..., :2])
    common = np.prod(np.maximum(corner, 0), axis=-1)
    union = np.prod(a[..., 2:], axis=-1) + np.prod(b[..., 2:], axis=-1) - common
    return np.divide(common, union, out=np.zeros_like(common), where=union > 0)


@dataclasses.dataclass(frozen=True)
class Agreement:
    """Counts from which the scores follow; sums of two are the counts of both together."""

    left: int = 0  # objects of the first method (REM)
    right: int = 0  # objects of the second method (VEM) on the frame itself
    confirmed: int = 0  # of the first, those matched on the frame or, where it is given, the one before
    found: int = 0  # of the second, those matched
    exact: int = 0  # matches on the frame with identical boxes
    overlap: float = 0.0  # sum of the IoU over matches on the frame

    def __add__(self, other: "Agreement") -> "Agreement":
        return Agreement(*(a + b for a, b in zip(dataclasses.astuple(self), dataclasses.astuple(other), strict=True)))

    @property
    def precision(self) -> float:
        """Share of the first method's objects that the second confirms; nan where there are none."""
        return self.confirmed / self.left if self.left else float("nan")

    @property
    def recall(self) -> float:
        """Share of the second method's objects that the first finds; nan where there are none."""
        return self.found / self.right if self.right else float("nan")

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; nan where there are no objects."""
        p, r = self.precision, self.recall
        return 2 * p * r / (p + r) if p + r > 0 else float("nan") if p != p or r != r else 0.0

    @property
    def mean_iou(self) -> float:
        """Mean IoU over matches on the frame; nan where there are none."""
        return self.overlap / self.found if self.found else float("nan")

    @property
    def exact_rate(self) -> float:
        """Share of matches on the frame whose boxes are identical; nan where there are none."""
        return self.exact / self.found if self.found else float("nan")


def agreement(game: Game, left: Objects, right: Objects, before: Objects | None = None, radius: float = RADIUS) -> dict[str, Agreement]:
    """Agreement of two methods on a batch, by category.

    Args:
        game: whose objects they are.
        left: of the method that reports what exists (REM), batch shape `[B]`.
        right: of the method that reports what is drawn (VEM), on the same frames.
        before: of the latter on the emulated frame just before each. With it the scores are flicker-aware: an object of `left` that is
            not matched on the frame may be matched there; everything in `right` must still be found.
        radius: largest distance of the centres in pixels.
    """
    pairs = match(left, right, game.slot_category, radius)
    frame, slot = np.nonzero(pairs >= 0)
    boxes_left, boxes_right = np.asarray(left.xywh), np.asarray(right.xywh)
    overlap = np.zeros(pairs.shape)
    overlap[frame, slot] = iou(boxes_left[frame, slot], boxes_right[frame, pairs[frame, slot]])
    confirmed = pairs >= 0
    if before is not None:
        rest = dataclasses.replace(left, valid=np.asarray(left.valid) & ~confirmed)  # pyright: ignore[reportArgumentType]
        confirmed = confirmed | (match(rest, before, game.slot_category, radius) >= 0)
    out = {}
    for name, s in game.slices.items():
        out[name] = Agreement(
            left=int(np.asarray(left.valid)[:, s].sum()),
            right=int(np.asarray(right.valid)[:, s].sum()),
            confirmed=int(confirmed[:, s].sum()),
            found=int((pairs[:, s] >= 0).sum()),
            exact=int((overlap[:, s] == 1).sum()),
            overlap=float(overlap[:, s].sum()),
        )
    return out


def total(by_category: dict[str, Agreement]) -> Agreement:
    """All categories together, each object counting the same."""
    return sum(by_category.values(), Agreement())
