"""RAM Extraction Method: compiles a game's decoder of one state to a function of a batch.

A batch goes through four stages, each a separate function:

1. `read` selects the bytes that the game uses and puts the batch last.
2. `decode` maps the game's decoder over the batch and packs each box into one number.
3. `pack` joins the slots of all categories.
4. `unpack` puts the batch first again and makes `Objects`.

`B` is the batch size and `N` the number of slots. With the batch last, an operation on a few
numbers per state vectorises over thousands of states.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import batches, kernels
from ocjax._xla.batch_last import batch_last
from ocjax.console import palette
from ocjax.console.boxes import Box
from ocjax.console.ops import lookup
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction import words
from ocjax.extraction.categories import Category
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects
from ocjax.extraction.saver import saved

# States per chunk, whose results stay in the cache. Rows `chunks` of benchmarks/tricks.py.
CHUNK = 4096
# States. Smaller batches do not materialize the stages: the calls cost more than they save. Row
# `small batches` of benchmarks/tricks.py.
MIN_MATERIALIZED_STATES = 32
# Bytes. If a game reads more, transposing all of the RAM is cheaper than selecting them. Rows
# `selected bytes` and `transposed RAM` of benchmarks/tricks.py.
MAX_SELECTED_BYTES = 44
# Bytes. One slice reads two addresses with at most this many unused bytes in between.
# Row `joined slices` of benchmarks/tricks.py.
MAX_SKIPPED_BYTES = 3
BLOCK = 16  # bytes: the bounds of the transposed RAM are multiples of it


class Slots(NamedTuple):
    """The slots of one category; attributes only if the category has them."""

    boxes: jax.Array  # int32, as in `words`
    value: jax.Array | None  # int32
    orientation: jax.Array | None  # int32
    rgb: jax.Array | None  # int32, as in `words`


class Rows(NamedTuple):
    """The slots of a game, batch last; values and orientations by `spans` of slots."""

    boxes: jax.Array  # int32 [N, B]
    value: list[jax.Array]  # int32 [span, B]
    orientation: list[jax.Array]  # int32 [span, B]
    rgb: dict[str, jax.Array]  # int32 [count, B], or [1, B] if all slots have one colour
    saver: jax.Array | None  # int32 [B]: the screen saver's key; None: the game has no saver


def stretches(addresses: Sequence[int]) -> list[range]:
    """Return ranges of RAM that contain the addresses.

    Close addresses share a range; many addresses share one range of complete blocks of 16.
    """
    out: list[range] = []
    for a in sorted(addresses):
        if out and a - out[-1].stop <= MAX_SKIPPED_BYTES:
            out[-1] = range(out[-1].start, a + 1)
        else:
            out.append(range(a, a + 1))
    if sum(map(len, out)) <= MAX_SELECTED_BYTES:
        return out
    return [range(out[0].start // BLOCK * BLOCK, -(-out[-1].stop // BLOCK) * BLOCK)]


def read(rams: jax.Array, ranges: Sequence[range]) -> jax.Array:
    """Read the bytes of the ranges: uint8 `[B, 128]` -> uint8 `[addresses, padded(B)]`."""

    def rows(rams: jax.Array) -> jax.Array:
        out = jnp.zeros((kernels.padded(rams.shape[0]), sum(map(len, ranges))), jnp.uint8)
        at = 0
        for r in ranges:
            out = lax.dynamic_update_slice(out, rams[:, r.start : r.stop], (0, at))
            at += len(r)
        return out

    selected = kernels.materialize(rows, rams, small=MIN_MATERIALIZED_STATES * RAM_SIZE)
    return kernels.materialize(
        jnp.transpose, selected, small=MIN_MATERIALIZED_STATES * selected.shape[1]
    )


def decode(
    game: Declaration, columns: jax.Array, addresses: Sequence[int]
) -> tuple[dict[str, Slots], jax.Array | None]:
    """Decode every category's slots: uint8 `[addresses, B]` -> fields `[count, B]`.

    Fields that all slots share are `[B]`. The second result is the saver's key `[B]`.
    """
    height, width = game.screen

    def one(ram: jax.Array) -> tuple[dict[str, Slots], jax.Array | None]:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            m = game.ram(ram, addresses)
            boxes = game.decode(m)
            key = None if game.saver is None else game.saver.key(m)
        return {
            c.name: slots(c, boxes[c.name].clip(0, 0, width, height), game.palette)
            for c in game.categories
        }, key

    return batch_last(one, jax.ShapeDtypeStruct((len(addresses),), jnp.uint8))(columns)


def slots(category: Category, b: Box, table: np.ndarray) -> Slots:
    """Pack a category's slots in one state, one number per slot."""
    mask = -b.valid.astype(jnp.int32)
    packed = (b.x | (b.y << 8) | (b.w << 16) | (b.h << 24)) & mask  # a clipped box fits four bytes
    value = b.value & mask if "value" in category.attributes else None
    orientation = b.orientation & 15 & mask if "orientation" in category.attributes else None
    rgb = None if b.color is None else lookup(palette.packed(table), b.color & 255).reshape(-1)
    return Slots(packed, value, orientation, rgb)


def spans(game: Declaration, attribute: str) -> list[slice]:
    """Return the slots of adjacent categories that have an attribute."""
    found = game.spans(lambda c: attribute in c.attributes)
    return [s for s, has_it in found if has_it]


def pack(
    game: Declaration, by_category: dict[str, Slots], saver: jax.Array | None, lanes: int
) -> Rows:
    """Join the slots of all categories in one array, and their attributes."""

    def joined(attribute: str, where: slice) -> jax.Array:
        # Updating slices takes 3-15 % less than `concatenate`.
        out = jnp.zeros((where.stop - where.start, lanes), jnp.int32)
        for c in game.categories:
            s, part = game.slices[c.name], getattr(by_category[c.name], attribute)
            if where.start <= s.start < where.stop:
                out = lax.dynamic_update_slice(
                    out, jnp.broadcast_to(part, (c.count, lanes)), (s.start - where.start, 0)
                )
        return out

    value, orientation = (
        [joined(name, s) for s in spans(game, name)] for name in ("value", "orientation")
    )
    rgb = {name: s.rgb for name, s in by_category.items() if s.rgb is not None}
    return Rows(joined("boxes", slice(0, game.num_slots)), value, orientation, rgb, saver)


def unpack(game: Declaration, rows: Rows, lanes: int) -> Objects:
    """Unpack the first `lanes` columns to `Objects` of batch shape `[lanes]`."""
    small = MIN_MATERIALIZED_STATES * game.num_slots
    slots = kernels.materialize(lambda b: b.T[:lanes], rows.boxes, small=small)
    valid, xywh = _boxes(slots, small)
    orientation = _attribute(
        rows.orientation, spans(game, "orientation"), (lanes, game.num_slots), jnp.int8
    )
    value = _attribute(rows.value, spans(game, "value"), (lanes, game.num_slots), jnp.int32)
    rgb = _colors(game, rows, slots != 0)
    if game.saver is not None and rows.saver is not None:
        rgb = saved(rgb, valid, rows.saver[:lanes], game.saver, game.palette)
    return Objects(xywh, valid, orientation, value, rgb, game)


def _boxes(slots: jax.Array, small: int) -> tuple[jax.Array, jax.Array]:
    """Unpack the validity and the boxes of slots `[lanes, N]`, as one row (see `words.boxes`)."""
    valid, xywh = kernels.materialize(words.boxes, slots.ravel(), small=small)
    return valid.reshape(slots.shape), xywh.reshape(*slots.shape, 4)


def _attribute(
    parts: Sequence[jax.Array], where: Sequence[slice], shape: tuple[int, int], dtype: Any
) -> jax.Array:
    """Spread an attribute of the `spans` over all slots; 0 for the other slots."""
    out = jnp.zeros(shape, dtype)
    for s, part in zip(where, parts, strict=True):
        out = lax.dynamic_update_slice(out, part[:, : shape[0]].T.astype(dtype), (0, s.start))
    return out


def _colors(game: Declaration, rows: Rows, valid: jax.Array) -> jax.Array:
    rgb = words.colors(jnp.asarray(palette.packed(game.slot_rgb).astype(np.int32))[None], valid)
    for name, part in rows.rgb.items():
        s = game.slices[name]
        rgb = lax.dynamic_update_slice(
            rgb, words.colors(part[:, : len(valid)].T, valid[:, s]), (0, s.start, 0)
        )
    return rgb


def extractor(game: Declaration) -> Callable[[jax.Array | np.ndarray], Objects]:
    """Compile the game's REM: uint8 `[..., 128]` -> `Objects`."""
    ranges = stretches(game.ram.addresses())
    addresses = [a for r in ranges for a in r]

    def chunk(rams: jax.Array) -> Objects:
        def rows(columns: jax.Array) -> Rows:
            return pack(game, *decode(game, columns, addresses), columns.shape[1])

        return unpack(
            game,
            kernels.materialize(
                rows, read(rams, ranges), small=MIN_MATERIALIZED_STATES * len(addresses)
            ),
            len(rams),
        )

    return batches.AnyBatch(lambda rams: batches.in_chunks(chunk, rams, CHUNK), 1, CHUNK)
