"""`Runs` rules: walls and floors, by the horizontal runs of pixels in one of their rows."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.boxes import WIDTH
from ocjax.rules import Runs
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components import Detected


def _from(words: jax.Array, column: jax.Array) -> jax.Array:
    """Rows `[words, n, B]` without the pixels left of a column of each, int32 `[n, B]`."""
    start = jnp.clip(column[None] - 32 * jnp.arange(len(words), dtype=jnp.int32)[:, None, None], 0, 32)
    return words & jnp.where(start < 32, bm.ALL >> jnp.minimum(start, 31).astype(U), U(0))


def detect_runs(rule: Runs, masks: Sequence[Bitmap]) -> Detected:
    """The objects of a rule in the masks `[5, H, B]` of its rows' colours."""
    words = jnp.concatenate([mask[:, top : top + 1] for (top, _), mask in zip(rule.rows, masks, strict=True)], axis=1)

    def next_run(words: jax.Array, _: None) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        first = bm.columns(words)[0]
        end = bm.columns(_from(~words, first))[0]
        return _from(words, end), (first, end)

    runs = lax.scan(next_run, words, length=rule.most)[1]
    x, end = (jnp.moveaxis(v, 0, 1) for v in runs)  # [rows, most, B]
    y = jnp.broadcast_to(jnp.array([top for top, _ in rule.rows], jnp.int32)[:, None, None], x.shape)
    boxes = tuple(jnp.zeros_like(x) for _ in range(4))  # left, top, right and bottom
    margins = rule.margins or ((0, 0, 0),) * len(rule.regions)
    for (left, top, right, low), colors, (least, most), (before, above, after) in reversed(
        list(zip(rule.regions, rule.colors, rule.widths, margins, strict=True))
    ):
        row = np.array([key == (top, colors) for key in rule.rows])[:, None, None]
        fits = row & (x >= left) & (x < right) & (end - x >= least) & (end - x <= most)
        edges = jnp.maximum(x - before, 0), y - above, jnp.minimum(end + after, WIDTH), jnp.full_like(x, low)
        boxes = tuple(jnp.where(fits, new, old) for new, old in zip(edges, boxes, strict=True))
    left, top, right, bottom = (v.reshape(rule.slots, -1) for v in boxes)
    return Detected(left, top, right - left, bottom - top, bottom > 0)
