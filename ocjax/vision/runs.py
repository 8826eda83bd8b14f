"""`Runs` rules: walls and floors, found by horizontal runs of pixels in one row each."""

import functools
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.console.boxes import WIDTH
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, words
from ocjax.vision.rules import Run, Runs
from ocjax.vision.shapes import limits


def detect_runs(rules: Sequence[Runs], masks: Sequence[Sequence[Bitmap]]) -> list[Detected]:
    """Find the objects of several rules, searching all rows together.

    Args:
        masks: for each rule the pixels of its rows' colours, one bitmap `[5, H, B]` per row.
    """
    if not rules:
        return []
    rows = jnp.concatenate(
        [_rows(rule, own) for rule, own in zip(rules, masks, strict=True)], axis=1
    )
    runs = lax.scan(_next_run, rows, length=max(rule.most for rule in rules))[1]
    x, end = (jnp.moveaxis(v, 0, 1) for v in runs)  # [rows, most, B]
    boxes = materialize(functools.partial(_boxes, _regions(rules)), x, end, small=0)
    ends = np.cumsum([0, *(len(rule.rows) for rule in rules)]).tolist()
    return [
        Detected(boxes[start:stop, : rule.most].reshape(rule.slots, -1))
        for rule, (start, stop) in zip(rules, itertools.pairwise(ends), strict=True)
    ]


def _rows(rule: Runs, masks: Sequence[Bitmap]) -> Bitmap:
    parts = []
    for _, neighbours in itertools.groupby(
        zip(rule.rows, masks, strict=True), key=lambda row: id(row[1])
    ):
        rows, (mask, *_) = zip(*neighbours, strict=True)
        parts.append(mask[:, np.array([top for top, _ in rows])])
    left, right = rule.columns
    rows = jnp.concatenate(parts, axis=1) & jnp.asarray(bm.areas(1, [(left, 0, right, 1)]))
    return bm.bridged(rows, rule.gap) if rule.gap else rows


def _next_run(words: jax.Array, _: None) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
    """Remove the first run of each row `[words, n, B]`; also return its start and end, int32."""
    first = bm.columns(words)[0]
    end = bm.columns(bm.from_column(~words, first))[0]
    return bm.from_column(words, end), (first, end)


class _Region(NamedTuple):
    """A region of each row, int32 `[rows, 1, 1]` each.

    `NO_REGION`, in a row without further regions, accepts no width.
    """

    left: np.ndarray  # minimum first column of a run
    right: np.ndarray  # exclusive maximum
    least: np.ndarray  # minimum and maximum width of a run
    most: np.ndarray
    before: np.ndarray  # columns of the box before the run
    after: np.ndarray  # columns of the box after the run
    top: np.ndarray  # rows of the box
    bottom: np.ndarray


NO_REGION = _Region(*np.array([0, 0, 1, 0, 0, 0, 0, 0]))


def _regions(rules: Sequence[Runs]) -> list[_Region]:
    """Transpose the rules' regions: the first region of every row, the second, and so on."""
    of_rows = []
    for rule in rules:
        own: dict[tuple[int, tuple[int, ...]], list[_Region]] = {key: [] for key in rule.rows}
        for run in rule.runs:
            own[run.row, run.palette].append(_region(run))
        of_rows += own.values()
    by_rank = itertools.zip_longest(*of_rows, fillvalue=NO_REGION)
    return [_Region(*np.array(regions, np.int32).T[..., None, None]) for regions in by_rank]


def _region(run: Run) -> _Region:
    (left, last), (least, most) = limits(run.left), limits(run.width)
    return _Region(
        *np.array(
            [left, last + 1, least, most, run.before, run.after, run.row - run.above, run.bottom]
        )
    )


def _boxes(regions: Sequence[_Region], x: jax.Array, end: jax.Array) -> jax.Array:
    """Box each run by the first region that accepts it: words `[rows, most, B]`, 0 if none does."""
    boxes = jnp.zeros(x.shape, U)
    for r in reversed(regions):
        fits = (x >= r.left) & (x < r.right) & (end - x >= r.least) & (end - x <= r.most)
        left, right = jnp.maximum(x - r.before, 0), jnp.minimum(end + r.after, WIDTH)
        boxes = jnp.where(fits, words(left, r.top, right - left, r.bottom - r.top), boxes)
    return boxes
