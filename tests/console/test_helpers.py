"""The small operations of decoders, compared with plain Python and numpy."""

import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console import ops, registers
from ocjax.console.boxes import box


def test_operations_on_integers():
    x = np.arange(-3, 400, dtype=np.int32)
    assert np.array_equal(
        ops.among(jnp.asarray(x), range(5, 9)), [v in range(5, 9) for v in x.tolist()]
    )
    assert np.array_equal(
        ops.among(jnp.asarray(x), (300, 0, 7)), [v in (300, 0, 7) for v in x.tolist()]
    )
    assert np.array_equal(
        ops.reached(jnp.asarray(x), (0, 7, 300)),
        [sum(v >= limit for limit in (0, 7, 300)) for v in x.tolist()],
    )
    table = np.arange(50) ** 2
    assert np.array_equal(ops.lookup(table, jnp.asarray(x)), table[np.clip(x, 0, 49)])
    assert ops.lookup(table, jnp.int32(7)) == 49
    positive = x[x >= 0]
    assert np.array_equal(ops.mod(jnp.asarray(positive), 30), positive % 30)
    assert np.array_equal(ops.div(jnp.asarray(positive), 30), positive // 30)
    assert np.array_equal(registers.modulo_screen(jnp.asarray(positive)), positive % 160)


def test_the_first_condition_that_holds():
    x = jnp.arange(5)
    assert ops.match((x > 3, 30), (x > 1, x), otherwise=-1).tolist() == [-1, -1, 2, 3, 30]
    assert ops.match((x > 3, 30), otherwise=x).tolist() == [0, 1, 2, 3, 30]
    assert ops.when(x > 3, x).tolist() == [0, 0, 0, 0, 4]


@pytest.mark.parametrize(
    ("x", "width", "left"),
    [(10, 8, 10), (156, 8, 156), (157, 8, -3), (-4, 8, -4), (-5, 8, 155), (158, 5, -2)],
)
def test_the_larger_part_of_what_an_edge_cuts(x, width, left):
    assert int(registers.larger_part(jnp.int32(x), width)) == left


def test_some_of_the_slots_of_boxes():
    whole = box(
        np.arange(5),
        7,
        np.arange(5) + 10,
        2,
        np.arange(5) > 1,
        color=np.array([30, 32, 34, 36, 38]),
    )
    part = whole[1:3]
    assert np.array_equal(part.x, [1, 2])
    assert np.array_equal(part.w, [11, 12])
    assert np.array_equal(part.valid, [False, True])
    assert int(part.y) == 7
    assert part.color is not None
    assert np.array_equal(part.color, [32, 34])
    assert int(whole[4].x) == 4
    assert box(np.arange(2), 0, 1, 1)[0].color is None
