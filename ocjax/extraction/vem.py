"""Vision Extraction Method: compiles a game's vision rules to a function of frames."""

import itertools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import batches, kernels
from ocjax.console import palette
from ocjax.extraction import words
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.detection import detect
from ocjax.extraction.objects import Objects
from ocjax.extraction.saver import key_of, restored, saved
from ocjax.vision.components import MAX_FRAMES
from ocjax.vision.detected import OWN_COLOR, Detected
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

# Frames per chunk: their planes and masks fit in a second-level cache of 2 MB. Rows `chunks of
# frames` of benchmarks/tricks.py.
CHUNK = 32


def _by_slot(
    fields: Sequence[jax.Array | None], game: Declaration, lanes: int, default: int = 0
) -> jax.Array:
    """Join a field of all categories in one array `[N, B]`, int32 (boxes: uint32).

    Categories without the field get the default, adjacent ones in one piece: each operand of a
    concatenation is a branch.
    """
    if all(field is None for field in fields):
        return jnp.full((game.num_slots, lanes), default, jnp.int32)
    pieces = []
    counts = [c.count for c in game.categories]
    for absent, group in itertools.groupby(
        zip(fields, counts, strict=True), key=lambda pair: pair[0] is None
    ):
        own, sizes = zip(*group, strict=True)
        pieces += [jnp.full((sum(sizes), lanes), default, jnp.int32)] if absent else own
    return jnp.concatenate(pieces)


def _needed(game: Declaration, found: Sequence[Detected]) -> np.ndarray | jax.Array:
    """Return whether each category's `needs` are met, bool `[categories, B]`.

    The shape is `[categories, 1]` if no category has `needs`.
    """
    needs = [c.needs for c in game.categories]
    others = sorted({names for names in needs if names})
    if not others:
        return np.ones((len(needs), 1), bool)
    index = {c.name: i for i, c in enumerate(game.categories)}
    shown = [
        jnp.any(jnp.concatenate([found[index[name]].valid for name in names]), axis=0)
        for names in others
    ]
    which = [others.index(names) if names else len(others) for names in needs]
    return jnp.stack([*shown, jnp.ones_like(shown[0])])[np.array(which)]


def _extract(game: Declaration, frames: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Extract slots from uint8 `[B, H, 160]`, and count the objects without a slot.

    The loop over chunks of a batch writes the slots as one array: int32 `[B, 2, N]` of boxes and
    values, or `[B, 3, N]` with colours (palette indices, or `OWN_COLOR`) in games that read some
    from the frame. The counts are int32 `[B, categories]`.
    """
    if game.saver is not None:
        frames = restored(frames, game.saver, game.categories)
    found, lanes = detect(game.categories, frames, game.shades), len(frames)
    needed = _needed(game, found)
    box = jnp.where(
        needed[game.slot_category], _by_slot([f.box for f in found], game, lanes), jnp.uint32(0)
    )
    fields = [_by_slot([f.value for f in found], game, lanes)]
    if any(f.color is not None for f in found):
        fields.append(_by_slot([f.color for f in found], game, lanes, OWN_COLOR))
    rows = [
        lax.bitcast_convert_type(box, jnp.int32),
        *(jnp.where(box != 0, field, 0) for field in fields),
    ]
    joined = kernels.materialize(lambda *rows: jnp.concatenate(rows), *rows, small=0)
    slots = joined.T.reshape(lanes, len(rows), -1)
    nothing = jnp.zeros(lanes, jnp.int32)
    overflow = jnp.stack([nothing if f.overflow is None else f.overflow for f in found])
    return slots, jnp.where(needed, overflow, 0).T


def _objects(game: Declaration, slots: jax.Array, frames: jax.Array) -> Objects:
    box = slots[:, 0]
    valid, xywh = words.boxes(box.ravel())
    valid, xywh = valid.reshape(box.shape), xywh.reshape(*box.shape, 4)
    unread = np.array(["value" in c.attributes and not c.reads_value for c in game.categories])[
        game.slot_category
    ]
    value = jnp.where(valid & unread[None], UNKNOWN_VALUE, slots[:, 1])
    oriented = np.array(
        ["orientation" in game.categories[i].attributes for i in game.slot_category]
    )
    orientation = jnp.where(valid & oriented[None], jnp.int8(UNKNOWN), jnp.int8(0))
    color = jnp.asarray(palette.packed(game.slot_rgb))[None]
    if slots.shape[1] > 2:
        read = slots[:, 2]
        color = jnp.where(read == OWN_COLOR, color, jnp.asarray(palette.packed(game.palette))[read])
    rgb = words.colors(color, valid)
    if game.saver is not None:
        rgb = saved(rgb, valid, key_of(frames, game.saver), game.saver, game.palette)
    return Objects(xywh, valid, orientation, value, rgb, game)


def extractor_with_overflow(game: Declaration) -> Callable[[jax.Array], tuple[Objects, jax.Array]]:
    """Compile the game's VEM with overflow: uint8 `[B, H, 160]` -> `Objects`, counts.

    The counts of objects without a slot are int32 `[B, categories]`.
    """

    def extract(frames: jax.Array) -> tuple[Objects, jax.Array]:
        slots, overflow = batches.in_chunks(
            lambda chunk: _extract(game, chunk), frames, CHUNK, elsewhere=MAX_FRAMES
        )
        return _objects(game, slots, frames), overflow

    return jax.jit(extract)


def extractor(game: Declaration) -> Callable[[jax.Array | np.ndarray], Objects]:
    """Compile the game's VEM: uint8 `[..., H, 160]` or `[..., H, 160, 3]` -> `Objects`."""

    def by_frame(frames: jax.Array) -> Objects:
        slots = batches.in_chunks(
            lambda chunk: _extract(game, chunk)[0], frames, CHUNK, elsewhere=MAX_FRAMES
        )
        return _objects(game, slots, frames)

    by_index = batches.AnyBatch(by_frame, 2, CHUNK)
    to_index = batches.AnyBatch(
        lambda rgb: palette.to_index(rgb, game.palette, game.colors), 3, CHUNK
    )

    def extract(frames: jax.Array | np.ndarray) -> Objects:
        return by_index(to_index(frames) if frames.shape[-3:] == (*game.screen, 3) else frames)

    return extract
