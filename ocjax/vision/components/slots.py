"""Fifth stage: the objects of a round come to their slots."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla.kernels import materialize
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import U

COUNT_BITS = 12
MAX_COUNT = 2**COUNT_BITS  # more slots than any search has


class _Order:
    """The objects of a round, numbered in the order of their candidates."""

    def __init__(self, counts: jax.Array, most: int) -> None:
        """Number the objects of candidates with so many each, int32 `[n]`, at most `most`."""
        self.most = most
        is_object = np.arange(most, dtype=np.int32)[None] < counts[:, None]
        bits = np.array(1 << 31 >> np.arange(32), np.uint32)
        self._words = jnp.sum(
            jnp.where(is_object.reshape(-1, 32), bits, U(0)), axis=1, dtype=U
        )  # the first object in the top bit
        self._ends = jnp.cumsum(bm.popcount(self._words))

    def before(self, candidate: jax.Array) -> jax.Array:
        """How many objects the candidates before this one are; candidate 0 to n."""
        place = candidate * self.most
        words, begins = jnp.pad(self._words, (0, 1)), jnp.pad(self._ends, (1, 0))
        earlier = ~(U(bm.ALL) >> (place & 31).astype(U))
        return bm.at(begins, place >> 5) + bm.popcount(bm.at(words, place >> 5) & earlier)

    def places(self) -> tuple[jax.Array, jax.Array]:
        """Candidate and part of each object, int32 `[n * most]`; in range even beyond the last object."""
        k = jnp.arange(32 * len(self._words), dtype=jnp.int32)
        word = jnp.sum(self._ends[:, None] <= k[None], axis=0, dtype=jnp.int32)
        word = jnp.minimum(word, len(self._words) - 1)
        rest = k - bm.at(jnp.pad(self._ends, (1, 0)), word)
        place = 32 * word + bm.nth_bit(bm.at(self._words, word), rest)
        return place // self.most, place % self.most


class Found(NamedTuple):
    """The objects of a round before they have slots."""

    begins: jax.Array  # int32 [segments + 1]: the first candidate of each segment, and the end
    counts: jax.Array  # int32 [n]: objects of each candidate
    parts: jax.Array  # uint32 [parts, n]: their boxes as words
    column: jax.Array  # int32 [n]: the candidate's, which is the head of its objects


def fill_slots(
    counts: np.ndarray, found: Found, totals: jax.Array, slots: Sequence[jax.Array]
) -> tuple[jax.Array, tuple[jax.Array, ...]]:
    """Put objects into slots: the totals and the slots after a round, given those before it.

    Args:
        counts: slots of each mask, int32 `[masks]`.
        found: the objects.
        totals: objects so far of each mask and frame, int32 `[masks, lanes]`.
        slots: boxes as words, 0 where there is none, and their heads if they are asked for: uint32
            `[slots, lanes]` each.

    The objects are put in order and stored, and each slot takes its own. Computed again for each
    slot, they take Crazy Climber 23 us a frame instead of 18, and Frogger 25 instead of 21. To
    write each of them to its slot takes XLA 45 ns for every place where one may be: 43 us a frame
    instead of 31 for Berzerk, whose components have up to four parts.
    """
    order = _Order(found.counts, len(found.parts))
    before = order.before(found.begins)
    new = jnp.diff(before).reshape(totals.shape)
    candidate, part = order.places()
    heads = (found.column,) if len(slots) > 1 else ()
    fields = materialize(_in_order, candidate, part, found.parts, *heads, small=0)
    # Of each segment, in one word: which slots its objects end before, and where on the list of
    # objects the one of slot 0 would be.
    known = (before[:-1].reshape(totals.shape) - totals) * MAX_COUNT + jnp.minimum(
        totals + new, MAX_COUNT - 1
    )
    place = materialize(functools.partial(_places, counts), known, small=0)
    is_new = (place >= 0) & (slots[0] == 0)
    place = jnp.clip(place, 0, len(fields[0]) - 1)
    return totals + new, tuple(
        jnp.where(is_new, bm.at(field, place), old)
        for field, old in zip(fields, slots, strict=True)
    )


def _in_order(
    candidate: jax.Array, part: jax.Array, parts: jax.Array, *heads: jax.Array
) -> tuple[jax.Array, ...]:
    """The boxes of objects as words, and their heads if they are asked for, uint32 `[n]` each, given each one's candidate and part."""
    return bm.at(parts.ravel(), part * parts.shape[1] + candidate), *(
        bm.at(head, candidate).astype(U) for head in heads
    )


def _places(counts: np.ndarray, known: jax.Array) -> jax.Array:
    """Where the object of each slot is among those of a round, int32 `[slots, lanes]`; negative
    where there is none.

    Args:
        counts: slots of each mask.
        known: see `fill_slots`, int32 `[masks, lanes]`.
    """
    number = np.arange(counts.max(), dtype=np.int32)[None, :, None]
    known = known[:, None]
    place = jnp.where(number < known % MAX_COUNT, (known >> COUNT_BITS) + number, -1)
    # All masks have as many slots up to here, so that no slot looks up its mask.
    return place.reshape(-1, known.shape[2])[np.flatnonzero(number[..., 0] < counts[:, None])]
