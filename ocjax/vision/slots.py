"""How the objects that a round of the component search finds come to their slots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla.kernels import materialize, running_sum
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import U
from ocjax.vision.layout import Layout

COUNT_BITS = 12
MAX_COUNT = 2**COUNT_BITS  # more slots than any search has


class _Order:
    """The objects of a round, numbered in the order of their candidates."""

    def __init__(self, counts: jax.Array, most: int) -> None:
        """Number the objects of candidates with so many each, int32 `[n]`, at most `most`."""
        self.most = most
        is_object = np.arange(most, dtype=np.int32)[None] < counts[:, None]
        bits = np.array(1 << 31 >> np.arange(32), np.uint32)
        self._words = jnp.sum(jnp.where(is_object.reshape(-1, 32), bits, U(0)), axis=1, dtype=U)  # the first object in the top bit
        self._ends = running_sum(bm.popcount(self._words))

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
    layout: Layout, rank: int, found: Found, totals: jax.Array, slots: Sequence[jax.Array]
) -> tuple[jax.Array, tuple[jax.Array, ...]]:
    """Put objects into the slots of each mask's search of that rank: totals and slots of the search, given those before the round.

    Args:
        layout: where masks lie.
        rank: which search of each mask.
        found: the objects.
        totals: objects so far of each mask and frame, int32 `[masks, lanes]`.
        slots: boxes as words, 0 where there is none, and their heads if they are asked for: uint32 `[slots, lanes]` each.

    The objects are put in order, and each slot takes its own. To write each of them to its slot takes XLA 45 ns for every place where one
    may be: 43 us a frame instead of 31 for Berzerk, whose components have up to four parts.
    """
    order = _Order(found.counts, len(found.parts))
    before = order.before(found.begins)
    ends = totals + jnp.diff(before).reshape(totals.shape)
    candidate, part = order.places()
    fields = [bm.at(found.parts.ravel(), part * len(found.counts) + candidate)]
    if len(slots) > 1:
        fields.append(bm.at(found.column, candidate).astype(U))
    mask, number = layout.slots_of_rank(rank)
    # Of each segment, in one word so that there is one look-up: how many objects it has, and where on the list the one of slot 0 would be.
    known = (before[:-1].reshape(totals.shape) - totals) * MAX_COUNT + jnp.minimum(ends, MAX_COUNT - 1)
    known = materialize(lambda known: known[mask], known, small=0)
    place = (known >> COUNT_BITS) + number[:, None]
    place = jnp.clip(place, 0, len(fields[0]) - 1)
    is_new = (slots[0] == 0) & (number[:, None] < known % MAX_COUNT)
    return ends, tuple(jnp.where(is_new, bm.at(field, place), old) for field, old in zip(fields, slots, strict=True))
