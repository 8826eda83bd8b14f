"""The assignment of objects to slots."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocjax.vision import bitmap
from ocjax.vision.components.layout import Layout
from ocjax.vision.components.search import Search
from ocjax.vision.components.slots import NewObjects, Slots, _Order, fill_slots
from ocjax.vision.shapes import Shape

SHAPE = Shape(w=(1, 4), h=(1, 4))
LANES = 2


@pytest.mark.parametrize("most", [1, 4])
@given(data=st.data())
def test_objects_are_numbered_by_candidate_and_part(most, data):
    counts = data.draw(st.lists(st.integers(0, most), min_size=64, max_size=64))
    order = _Order(jnp.asarray(counts, jnp.int32), most)
    candidate, part = (np.asarray(v) for v in order.places())
    want = [(c, p) for c, n in enumerate(counts) for p in range(n)]
    assert (
        list(zip(candidate[: len(want)].tolist(), part[: len(want)].tolist(), strict=True)) == want
    )
    assert np.asarray(order.number_before(jnp.arange(65, dtype=jnp.int32))).tolist() == [
        0,
        *np.cumsum(counts).tolist(),
    ]
    assert ((candidate >= 0) & (candidate < 64) & (part >= 0) & (part < most)).all()


def test_slots_take_what_earlier_rounds_have_left():
    """Two masks of two frames, with two slots and one; the first round has filled one slot of the
    first mask in the first frame."""
    masks = [jnp.zeros((5, 8, LANES), bitmap.U) for _ in range(2)]
    layout = Layout.of(masks, [Search(2, (SHAPE,)), Search(1, (SHAPE,))])
    n = layout.n_candidates
    counts = np.zeros(n, np.int32)
    counts[[0, 1, 2, 4]] = 1  # two of the first segment, one of the second and one of the last
    found = NewObjects(
        begins=jnp.array([0, 2, 3, 4, n], jnp.int32),
        counts=jnp.asarray(counts),
        boxes=jnp.arange(100, 100 + n, dtype=jnp.uint32)[None],
        heads=jnp.arange(n, dtype=jnp.int32),
    )
    totals = jnp.array([[1, 0], [0, 0]], jnp.int32)
    before = Slots(
        jnp.array([[50, 0], [0, 0], [0, 0]], jnp.uint32),
        jnp.array([[7, 0], [0, 0], [0, 0]], jnp.uint32),
    )
    totals, (box, head) = fill_slots(layout.counts, found, totals, before)
    assert totals.tolist() == [[3, 1], [0, 1]]
    assert box.tolist() == [[50, 102], [100, 0], [0, 104]]
    assert head.tolist() == [[7, 2], [0, 0], [0, 4]]
