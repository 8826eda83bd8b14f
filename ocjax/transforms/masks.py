"""Draw objects as masks, the observations of OCCAM.

Source: Blüml et al., "Deep Reinforcement Learning via Object-Centric Attention", 2025.
"""

import functools
import math
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose
from ocjax.transforms.segmentation import segment

__all__ = ["DRAWS", "KINDS", "Draw", "MaskKind", "area_weights", "masks", "num_planes", "resize"]

MaskKind = Literal["object", "binary", "class", "planes"]
KINDS = ("object", "binary", "class", "planes")
Draw = Literal["output", "screen", "pixels"]
DRAWS = ("output", "screen", "pixels")
_DIRECT = 8  # largest row count of a pattern for which sums of slices beat a matrix product
_WORD = 32  # bits, one per column of the output


def num_planes(game: Declaration, kind: MaskKind, pixels: bool = False) -> int:
    """Number of planes of a game's masks: one, or one per category, plus one with `pixels`."""
    return (len(game.categories) if kind == "planes" else 1) + pixels


def masks(
    objects: Objects,
    kind: MaskKind,
    *,
    gray: jax.Array | None = None,
    frames: jax.Array | None = None,
    size: tuple[int, int] | None = (84, 84),
    draw: Draw = "output",
    pixels: bool = False,
) -> jax.Array:
    """Draw objects as masks; a pure function that works under `jit`.

    Args:
        objects: of batch shape `[B]`; all slots, or the slots of a category.
        kind: "object" (the grey screen inside boxes, black outside), "binary" (white inside boxes),
            "class" (one shade of grey per category, from dark to bright; in overlaps, the brighter
            one wins) or "planes" (one binary mask per category).
        gray: the grey screen, uint8 `[B, H, 160]`; required for "object" and for `pixels`.
        frames: palette indices, uint8 `[B, H, 160]`, or RGB; required to draw "pixels".
        size: (height, width) of the masks; None for the screen's size.
        draw: "output" scales boxes to the output, rounds them outwards to integer pixels and fills
            them. "screen" fills them at the screen's size and resizes by averaging over areas.
            "pixels" draws the objects' own pixels (`ocjax.segment`) instead of boxes, and resizes
            in the same way.
        pixels: whether to add the grey screen as the last plane.

    Returns:
        uint8 `[B, P, height, width]`, with P from `num_planes`.

    Raises:
        ValueError: `kind` or `draw` is unknown, or `gray` or `frames` is missing.
    """
    game = whose(objects)
    _check(kind, draw, gray, frames, pixels=pixels)
    out = size or game.screen
    at_once = draw == "output"  # otherwise the masks have the screen's size first
    slices = [*game.slices.values()] if kind in ("class", "planes") else [slice(0, game.num_slots)]
    if draw == "pixels":
        assert frames is not None  # checked above
        owners = segment(objects, frames)
        planes = [(owners >= s.start) & (owners < s.stop) for s in slices]
    else:
        grid = out if at_once else game.screen
        planes = [
            _covered(objects.xywh[:, s], objects.valid[:, s], game.screen, grid) for s in slices
        ]
    if kind == "object":
        assert gray is not None  # checked above
        shown = resize(gray, out) if at_once else gray
        drawn = [jnp.where(planes[0], shown, jnp.uint8(0))]
    elif kind == "class":
        shades = (jnp.uint8(255 * (i + 1) // len(planes)) for i in range(len(planes)))
        drawn = [functools.reduce(jnp.maximum, map(_shaded, planes, shades))]
    else:
        drawn = [_shaded(p, jnp.uint8(255)) for p in planes]
    if not at_once:
        drawn = [resize(p, out) for p in drawn]
    if pixels:
        assert gray is not None  # checked above
        drawn.append(resize(gray, out))
    return jnp.stack(drawn, axis=1)


def _check(
    kind: str, draw: str, gray: jax.Array | None, frames: jax.Array | None, *, pixels: bool
) -> None:
    if kind not in KINDS or draw not in DRAWS:
        raise ValueError(
            f"kind must be one of {KINDS} and draw one of {DRAWS}, got {kind!r} and {draw!r}"
        )
    if gray is None and (kind == "object" or pixels):
        raise ValueError("kind 'object' and pixels need the grey screen: give gray")
    if frames is None and draw == "pixels":
        raise ValueError("draw 'pixels' needs the frames that show the objects: give frames")


def _shaded(plane: jax.Array, shade: jax.Array) -> jax.Array:
    return jnp.where(plane, shade, jnp.uint8(0))


def _covered(
    xywh: jax.Array, valid: jax.Array, screen: tuple[int, int], size: tuple[int, int]
) -> jax.Array:
    """Mark the output pixels that boxes of `[B, N]` slots touch, bool `[B, *size]`.

    Boxes are added to words of bits, with the batch last. A matrix product of the rows and columns
    inside each box takes 2 to 11 times as long.
    """
    x, y, w, h = xywh.T  # [N, B]
    top, bottom = _touched(y, h, screen[0], size[0])
    left, right = _touched(x, w, screen[1], size[1])
    bottom = jnp.where(valid.T, bottom, 0)
    columns = ~_columns_below(left, size[1]) & _columns_below(right, size[1])
    row = jnp.arange(size[0], dtype=jnp.int32)[:, None, None]

    def add(bits: jax.Array, box: tuple[jax.Array, ...]) -> tuple[jax.Array, None]:
        first, end, own = (a[None] for a in box)
        inside = (row >= first[None]) & (row < end[None])
        return bits | jnp.where(inside, own, jnp.uint32(0)), None

    bits, _ = lax.scan(
        add, jnp.zeros((size[0], *columns.shape[1:]), jnp.uint32), (top, bottom, columns)
    )
    shift = jnp.arange(_WORD, dtype=jnp.uint32).reshape(1, 1, 1, _WORD)
    single = bits.transpose(2, 0, 1)[..., None] >> shift & jnp.uint32(1)
    return single.reshape(*single.shape[:2], -1)[..., : size[1]] > 0


def _touched(
    start: jax.Array, length: jax.Array, screen: int, out: int
) -> tuple[jax.Array, jax.Array]:
    """The first output row or column that each box touches, and one past the last, int32."""
    start, length = start.astype(jnp.int32), length.astype(jnp.int32)
    return start * out // screen, -(-(start + length) * out // screen)


def _columns_below(n: jax.Array, width: int) -> jax.Array:
    """Columns 0 to n - 1 as bits, uint32 `[N, words, B]`, from n, `[N, B]`."""
    first = jnp.arange(0, width, _WORD, dtype=jnp.int32)[None, :, None]
    inside = jnp.clip(n[:, None] - first, 0, _WORD)
    partly = (jnp.uint32(1) << (inside % _WORD).astype(jnp.uint32)) - jnp.uint32(1)
    return jnp.where(inside == _WORD, jnp.uint32(2**_WORD - 1), partly)


def area_weights(n_in: int, n_out: int) -> np.ndarray:
    """Weights of resizing by area: the fraction of each input pixel in each output pixel.

    Returns:
        int64 `[n_out / g, n_in / g]`, the pattern that repeats g times, for the greatest common
        divisor g. The unit is g / n_out of an input pixel. The weights of an output pixel add up to
        n_in / g.
    """
    common = math.gcd(n_in, n_out)
    n_in, n_out = n_in // common, n_out // common
    edges, inputs = np.arange(n_out + 1) * n_in, np.arange(n_in) * n_out
    return np.maximum(
        np.minimum(edges[1:, None], inputs + n_out) - np.maximum(edges[:-1, None], inputs), 0
    )


def resize(images: jax.Array, size: tuple[int, int]) -> jax.Array:
    """Resize uint8 `[..., h, w]` to `[..., *size]` by averaging areas, like OpenCV's INTER_AREA.

    Means are exact and rounded to the nearest integer, halves to the even one. Few rows are summed
    as slices of 16 bits: for 210 to 84 rows, a matrix product takes three times as long.
    """
    if images.shape[-2:] == size:
        return images
    batch, (height, width) = images.shape[:-2], images.shape[-2:]
    of_rows, of_columns = area_weights(height, size[0]), area_weights(width, size[1])
    groups = images.reshape(*batch, -1, of_rows.shape[1], width)
    if len(of_rows) <= _DIRECT and 255 * of_rows.shape[1] < 2**16:
        x = jnp.stack(
            [
                sum(
                    groups[..., i, :].astype(jnp.uint16) * jnp.uint16(w[i])
                    for i in np.flatnonzero(w)
                )
                for w in of_rows
            ],
            axis=-2,
        )
    else:
        x = jnp.einsum(
            "oh,...hw->...ow", jnp.asarray(of_rows, jnp.float32), groups.astype(jnp.float32)
        )
    sums = x.astype(jnp.float32).reshape(-1, of_columns.shape[1]) @ jnp.asarray(
        of_columns.T, jnp.float32
    )
    means = jnp.round(sums / jnp.float32(of_rows.shape[1] * of_columns.shape[1]))
    return means.astype(jnp.uint8).reshape(*batch, *size)
