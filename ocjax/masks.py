"""Objects as pictures: the mask observations of OCCAM (Blüml et al., "Deep Reinforcement Learning via Object-Centric Attention", 2025)."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.game import Game
from ocjax.objects import Objects, whose

Kind = Literal["object", "binary", "class", "planes"]
KINDS = ("object", "binary", "class", "planes")
DIRECT = 8  # outputs of a pattern up to which sums of slices beat a product of matrices


def num_planes(game: Game, kind: Kind, pixels: bool = False) -> int:
    """Planes of a game's masks: one, or one a category; and the screen where it is wanted."""
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
        kind: "object" (the screen in shades of grey where objects are, else black), "binary" (white where objects are), "class" (a shade
            for each category, the last one brightest; where they overlap the brighter shows) or "planes" (a binary mask for each category).
        gray: the screen, uint8 `[B, H, 160]`; needed for "object" and for `pixels`.
        size: (height, width) of the masks; None for the screen's own.
        draw: "output" scales the boxes outwards to whole pixels of the output and fills those; "screen" fills them at the screen's size and
            averages over areas.
        pixels: the screen in shades of grey as one more plane, the last one.

    Returns:
        uint8 `[B, P, height, width]`, P by `num_planes`.

    Raises:
        ValueError: an unknown kind or way to draw, or no `gray` where it is needed.
    """
    game = whose(objects)
    if kind not in KINDS or draw not in ("output", "screen"):
        raise ValueError(f"kind must be one of {KINDS}, draw 'output' or 'screen', got {kind!r} and {draw!r}")
    if gray is None and (kind == "object" or pixels):
        raise ValueError("the screen in shades of grey is needed: give gray")
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
    """A shade of grey for each category, evenly from dark to white."""
    n = len(game.categories)
    return [255 * (i + 1) // n for i in range(n)]


def _inside(start: jax.Array, length: jax.Array, screen: int, out: int) -> jax.Array:
    """Which rows (or columns) of the output each box touches, float32 `[..., N, out]`, 0 or 1."""
    start, length = start.astype(jnp.int32), length.astype(jnp.int32)
    first, end = start * out // screen, -(-(start + length) * out // screen)
    at = jnp.arange(out, dtype=jnp.int32).reshape(*[1] * start.ndim, out)
    return ((at >= first[..., None]) & (at < end[..., None])).astype(jnp.float32)


@functools.cache
def area_weights(n_in: int, n_out: int) -> np.ndarray:
    """Share of each input pixel in each output pixel when resized by averaging over areas, float32 `[n_out, n_in]`."""
    edges = np.arange(n_out + 1) * n_in / n_out
    overlap = np.minimum(edges[1:, None], np.arange(1, n_in + 1)) - np.maximum(edges[:-1, None], np.arange(n_in))
    return (np.maximum(overlap, 0) * n_out / n_in).astype(np.float32)


def resize(images: jax.Array, size: tuple[int, int]) -> jax.Array:
    """Resize by averaging over areas, as OpenCV's INTER_AREA: uint8 `[..., h, w]` -> uint8 `[..., *size]`.

    Rows are summed as slices: a product of matrices that is mostly zero takes three times as long for 210 to 84 rows.
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
