"""Screen savers: convert colours on the screen to the colours of play, and back.

If no frame of a batch shows the saver, the batch is not changed.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.console import palette
from ocjax.console.ops import among
from ocjax.extraction.categories import Category
from ocjax.vision.colors import EVEN
from ocjax.vision.shades import Saver

PLAY = -1  # instead of a key: the colours are unchanged


def key_of(frames: jax.Array, saver: Saver) -> jax.Array:
    """Read the saver's key from frames uint8 `[B, H, 160]`, int32 `[B]`; `PLAY` without saver."""
    x, y = saver.pixel
    shown = frames[:, y, x].astype(jnp.int32) & EVEN
    usual = saver.colors_in_play[0]
    return jnp.where(_in_play(frames, shown, saver), PLAY, shown ^ (usual & saver.mask))


def _in_play(frames: jax.Array, shown: jax.Array, saver: Saver) -> jax.Array:
    """Return whether frames have the colours of play, bool `[B]`.

    `shown` is the saver's pixel, int32 `[B]`.
    """
    if saver.beside is None:
        return among(shown, saver.colors_in_play)
    x, y = saver.beside
    return (shown | frames[:, y, x].astype(jnp.int32)) & EVEN & ~saver.mask != 0


def restored(frames: jax.Array, saver: Saver, categories: Sequence[Category]) -> jax.Array:
    """Restore the colours of play in frames uint8 `[B, H, 160]`.

    The frames are words, as in `bitmap.planes`, in a loop of zero or one iteration: `lax.cond`
    copies them and takes 3 us per frame more.
    """
    key = key_of(frames, saver)
    table = jnp.asarray(_colors_of_play(saver, categories))

    def restore(words: jax.Array) -> jax.Array:
        shown = lax.bitcast_convert_type(words, jnp.uint8)
        in_play = shown ^ key.astype(jnp.uint8)[:, None, None, None]
        changes = (key != PLAY)[:, None, None, None]
        return lax.bitcast_convert_type(jnp.where(changes, table[in_play], shown), jnp.uint32)

    def step(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        return jnp.zeros_like(state[0]), restore(state[1])

    words = lax.bitcast_convert_type(frames.reshape(*frames.shape[:2], -1, 4), jnp.uint32)
    _, words = lax.while_loop(lambda state: state[0], step, (jnp.any(key != PLAY), words))
    return lax.bitcast_convert_type(words, jnp.uint8).reshape(frames.shape)


def _colors_of_play(saver: Saver, categories: Sequence[Category]) -> np.ndarray:
    """Map colours without the bits that the saver drops to colours of play, uint8 `[256]`."""
    table = np.arange(256, dtype=np.uint8)
    rules = [rule for c in categories for rule in (c.rule, c.otherwise) if rule is not None]
    of_rules = [color for rule in rules for color in rule.palette]
    of_pixels = [color for c in categories for colors in c.slot_colors() for color in colors]
    # Later ones take precedence: the first colours of rules before others.
    for color in (*reversed(of_pixels), *reversed(of_rules), *saver.taken):
        table[color & saver.mask] = color
    return table


def saved(
    rgb: jax.Array, valid: jax.Array, key: jax.Array, saver: Saver, table: np.ndarray
) -> jax.Array:
    """Convert objects' colours in play to the colours on the screen.

    Args:
        rgb: colours in play, uint8 `[B, N, 3]`.
        valid: bool `[B, N]`.
        key: int32 `[B]`.
        table: the palette, uint8 `[256, 3]`.
    """

    def change() -> jax.Array:
        index = palette.to_index(rgb, table).astype(jnp.int32)
        changes = (key != PLAY)[:, None] & valid
        return jnp.where(
            changes[..., None],
            palette.to_rgb((index ^ key[:, None]) & saver.mask & EVEN, table),
            rgb,
        )

    return lax.cond(jnp.any(key != PLAY), change, lambda: rgb)
