"""Draw objects as masks, the observations of OCCAM (Blüml et al., "Deep Reinforcement Learning via Object-Centric Attention", 2025)."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.game import Game
from ocjax.objects import Objects, whose

Kind = Literal["object", "binary", "class", "planes"]
KINDS = ("object", "binary", "class", "planes")
DIRECT = 8  # rows of a resizing pattern up to which sums of slices are faster than a matrix product


def num_planes(game: Game, kind: Kind, pixels: bool = False) -> int:
    """Number of planes of a game's masks: one, or one per category for "planes", plus one with `pixels`."""
    return (len(game.categories) if kind == "planes" else 1) + pixels


def masks(
    objects: Objects,
    kind: Kind,
    *,
    gray: jax.Array | None = None,
    size: tuple[int, int] | None = (84, 84),
    draw: Literal["output", "screen"] = "output",
    pixels: bool = False,
) -> jax.Array:
    """Draw objects as masks; a pure function that works under `jit`.

    Args:
        objects: of batch shape `[B]`, with all slots of their game.
        kind: "object" (the grey screen inside boxes, black outside), "binary" (white inside boxes), "class" (one shade of grey per
            category, from dark to bright; the brighter one where boxes overlap) or "planes" (one binary mask per category).
        gray: the grey screen, uint8 `[B, H, 160]`; required for "object" and for `pixels`.
        size: (height, width) of the masks; None for the screen's size.
        draw: "output" scales boxes to the output, rounds them outwards to whole pixels and fills those; "screen" fills them at the screen's
            size and resizes by averaging over areas.
        pixels: whether to add the grey screen as the last plane.

    Returns:
        uint8 `[B, P, height, width]`, with P from `num_planes`.

    Raises:
        ValueError: `kind` or `draw` is unknown, or `gray` is missing.
    """
    game = whose(objects)
    if kind not in KINDS or draw not in ("output", "screen"):
        raise ValueError(f"kind must be one of {KINDS} and draw 'output' or 'screen', got {kind!r} and {draw!r}")
    if gray is None and (kind == "object" or pixels):
        raise ValueError("kind 'object' and pixels need the grey screen: give gray")
    screen, out = game.screen, size or game.screen
    grid = screen if draw == "screen" else out
    rows, columns = (_inside(objects.xywh[..., k], objects.xywh[..., k + 2], screen[1 - k], grid[1 - k]) for k in (1, 0))
    rows = rows * objects.valid[..., None].astype(jnp.float32)
    white, shades = jnp.uint8(255), _shades(game)
    planes = []
    for s in game.slices.values() if kind in ("class", "planes") else [slice(None)]:
        hits = jnp.einsum("bkr,bkc->brc", rows[:, s], columns[:, s])
        planes.append(hits > 0.5)
    if kind == "object":
        assert gray is not None  # checked above
        shown = gray if draw == "screen" else resize(gray, out)
        drawn = [jnp.where(planes[0], shown, jnp.uint8(0))]
    elif kind == "class":
        drawn = [functools.reduce(jnp.maximum, (jnp.where(p, jnp.uint8(v), jnp.uint8(0)) for p, v in zip(planes, shades, strict=True)))]
    else:
        drawn = [jnp.where(p, white, jnp.uint8(0)) for p in planes]
    if draw == "screen":
        drawn = [resize(p, out) for p in drawn]
    if pixels:
        assert gray is not None  # checked above
        drawn.append(resize(gray, out))
    return jnp.stack(drawn, axis=1)


def _shades(game: Game) -> list[int]:
    """One shade of grey per category, evenly spaced up to white."""
    n = len(game.categories)
    return [255 * (i + 1) // n for i in range(n)]


def _inside(start: jax.Array, length: jax.Array, screen: int, out: int) -> jax.Array:
    """Which rows or columns of the output each box touches.

    Args:
        start, length: `[..., N]`, extent of the boxes in pixels of the screen.
        screen, out: size of the screen and of the output.

    Returns:
        float32 `[..., N, out]`, 0 or 1.
    """
    start, length = start.astype(jnp.int32), length.astype(jnp.int32)
    first, end = start * out // screen, -(-(start + length) * out // screen)
    at = jnp.arange(out, dtype=jnp.int32).reshape(*[1] * start.ndim, out)
    return ((at >= first[..., None]) & (at < end[..., None])).astype(jnp.float32)


@functools.cache
def area_weights(n_in: int, n_out: int) -> np.ndarray:
    """Weight of each input pixel in each output pixel when resizing by averaging over areas, float32 `[n_out, n_in]`."""
    edges = np.arange(n_out + 1) * n_in / n_out
    overlap = np.minimum(edges[1:, None], np.arange(1, n_in + 1)) - np.maximum(edges[:-1, None], np.arange(n_in))
    return (np.maximum(overlap, 0) * n_out / n_in).astype(np.float32)


def resize(images: jax.Array, size: tuple[int, int]) -> jax.Array:
    """Resize by averaging over areas, like OpenCV's INTER_AREA: uint8 `[..., h, w]` -> uint8 `[..., *size]`.

    Rows are summed as slices, because a product with a matrix of mostly zeros takes three times as long for 210 to 84 rows.
    """
    height, width = images.shape[-2:]
    if (height, width) == size:
        return images
    x = images.astype(jnp.float32)
    common = np.gcd(height, size[0])
    weights = area_weights(height // common, size[0] // common)
    if len(weights) <= DIRECT:
        groups = x.reshape(*x.shape[:-2], common, height // common, width)
        rows = [sum(groups[..., i, :] * w[i] for i in np.flatnonzero(w)) for w in weights]
        x = jnp.stack(rows, axis=-2).reshape(*x.shape[:-2], size[0], width)
    else:
        x = jnp.einsum("oh,...hw->...ow", area_weights(height, size[0]), x)
    x = jnp.einsum("...hw,ow->...ho", x, area_weights(width, size[1]))
    return jnp.round(x).astype(jnp.uint8)
