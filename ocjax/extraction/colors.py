"""Colours of objects, read from the frames, and the values that they tell."""

import functools
import itertools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import WIDTH
from ocjax.extraction.categories import Category
from ocjax.vision import bitmap as bm
from ocjax.vision.colors import EVEN
from ocjax.vision.detected import Detected
from ocjax.vision.rules import Blobs, ByColor, Cells, Runs
from ocjax.vision.scene import Scene
from ocjax.vision.unknown import UNKNOWN_VALUE


def needs_color(scene: Scene, c: Category) -> bool:
    """Whether the colour of a category's objects is read: to show it, for their value, or because their rule asks for it."""
    return _shows_color(scene, c) or c.value is not None or bool(_first_colors(c))


def read_colors(scene: Scene, categories: Sequence[Category]) -> dict[str, Detected]:
    """The objects with colours and the values that these tell, without those that begin in another colour than their rule says."""
    wanted = [c for c in categories if needs_color(scene, c)]
    wanted.sort(
        key=lambda c: type(c.rule).__name__
    )  # slices of one array side by side: XLA joins them in one copy
    if not wanted:
        return {}
    return {
        c.name: _with_color(scene, c, color)
        for c, color in zip(wanted, _read_off(scene, wanted), strict=True)
    }


def _shows_color(scene: Scene, c: Category) -> bool:
    """Whether the colour of a category's objects is read from the frame."""
    return c.reads_color or (c.rgb is None and scene.shifts(c.rule.palette))


def _first_colors(c: Category) -> tuple[int, ...]:
    """Colours that the first pixel of a category's objects must have; empty where any will do."""
    return c.rule.first_colors if isinstance(c.rule, Blobs) else ()


def _with_color(scene: Scene, c: Category, color: jax.Array) -> Detected:
    """A category's objects, given their colours, palette indices int32 `[count, B]`."""
    found = scene.found[c.name]
    if firsts := _first_colors(c):
        found = found.where(functools.reduce(jnp.logical_or, (color == own for own in firsts)))
    if c.value is not None:
        found = found._replace(value=_told(c.value, color, scene.frames))
    return found._replace(color=color) if _shows_color(scene, c) else found


def _told(rule: ByColor, color: jax.Array, frames: jax.Array) -> jax.Array:
    """The values that colours tell, int32 `[count, B]`."""
    if rule.like is not None:
        left, top, right, bottom = rule.like
        shown = jnp.max(frames[:, top:bottom, left:right], axis=(1, 2)).astype(
            jnp.int32
        )  # black is 0
        return jnp.where(shown[None] > 0, (color == shown[None]).astype(jnp.int32), UNKNOWN_VALUE)
    out = jnp.full_like(color, UNKNOWN_VALUE)
    for own, value in rule.values:
        out = jnp.where(color == own, value, out)
    return out


def _read_off(scene: Scene, categories: Sequence[Category]) -> list[jax.Array]:
    """Palette index of the first pixel in one row of each box, `Category.color_row`; int32 `[count, B]` for each category."""
    found = [scene.found[c.name] for c in categories]
    last_row = scene.frames.shape[1] - 1
    rows = np.concatenate([np.full((c.count, 1), c.color_row, np.int32) for c in categories])
    y = jnp.minimum(_row(Detected(jnp.concatenate([f.box for f in found])), rows), last_row)
    heads = [
        _head(scene, c, f) if f.head is None or c.color_row else f.head
        for c, f in zip(categories, found, strict=True)
    ]
    column = jnp.minimum(jnp.concatenate(heads), WIDTH - 1)
    color = _pixels(scene.frames, y, column).astype(jnp.int32) & EVEN
    ends = np.cumsum([0, *(len(f.box) for f in found)]).tolist()
    return [color[start:end] for start, end in itertools.pairwise(ends)]


def _pixels(frames: jax.Array, row: jax.Array, column: jax.Array) -> jax.Array:
    """Pixels of each frame, uint8 `[n, B]`, for indices int32 `[n, B]` in range.

    By one index for each pixel: XLA writes three side by side in memory, and Ms. Pac-Man takes 21
    us a frame instead of 18.
    """
    lanes, height, width = frames.shape
    lane = jnp.arange(lanes, dtype=jnp.int32)[None]
    if frames.size >= 2**31:  # beyond 32 bits, in large batches on a GPU
        return frames[lane, row, column]
    return bm.at(frames.ravel(), (lane * height + row) * width + column)


def _head(scene: Scene, c: Category, found: Detected) -> jax.Array:
    """Column of the first pixel in a row of each of a category's boxes, `Category.color_row`; int32 `[count, B]`."""
    rule = c.rule
    if isinstance(rule, Cells) and rule.whole:
        return found.x  # all its pixels have the colours
    of_one_mask = not isinstance(rule, Cells | Runs) and not (isinstance(rule, Blobs) and rule.also)
    mask = scene.counted(rule, rule.palette) if of_one_mask else scene.mask(rule.palette)  # pyright: ignore
    words = bm.rows_at(mask, jnp.minimum(_row(found, np.int32(c.color_row)), mask.shape[1] - 1))
    return bm.columns(bm.from_column(words, found.x))[0]


def _row(found: Detected, offset: np.ndarray | np.int32) -> jax.Array:
    """A row of each box; a negative offset counts from the bottom, and one beyond the box is the last row."""
    inside = jnp.where(
        offset < 0,
        jnp.maximum(found.h + offset, 0),
        jnp.minimum(offset, jnp.maximum(found.h - 1, 0)),
    )
    return found.y + inside
