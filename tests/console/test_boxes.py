"""Making boxes, changing them, and tables of them."""

import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console.boxes import Box, BoxTable, box, edges
from ocjax.console.ops import BEYOND, extremes, only
from ocjax.console.rom import Pictures


def fields(b):
    return [np.asarray(v).tolist() for v in (b.x, b.y, b.w, b.h)]


def test_edges():
    made = edges(np.array([3, 9]), 20, np.array([10, 9]), 25, value=7, color=2)
    assert fields(made) == [[3, 9], 20, [7, 0], 5]
    assert (int(made.value), int(made.color)) == (7, 2)


def test_clip():
    b = box(np.array([-3, 150, 20]), 30, 20, 8).clip(0, 32, 160, 100)
    assert fields(b) == [[0, 150, 20], 32, [17, 10, 20], 6]
    for columns in ((0, 161), (-1, 160), (8, 8)):
        with pytest.raises(ValueError, match="boxes are clipped to columns from 0 to 160"):
            b.clip(columns[0], 32, columns[1], 100)


def test_trimmed():
    b = box(10, 20, 30, 40, valid=False, value=3).trimmed(left=1, top=2, right=4, bottom=-8)
    assert fields(b) == [11, 22, 25, 46]
    assert not b.valid
    assert int(b.value) == 3


def test_the_only_box():
    three = box(
        np.array([3, 9, 5]), 20, np.array([1, 2, 3]), 8, [True, False, True], color=np.arange(3)
    )
    one = three.only(np.array([False, True, True]))
    assert fields(one) == [5, 20, 3, 8]
    assert (bool(one.valid), int(one.color)) == (True, 2)
    assert not three.only(np.array([False, True, False])).valid
    assert box(np.arange(2), 1, 1, 1, [False, True]).only().color is None


def test_stacked_boxes():
    pair = box(np.array([3, 9]), 20, 7, 8, np.array([True, False]), orientation=4)
    every = Box.stacked(box(1, 2, 3, 4, value=5), pair)
    assert fields(every) == [[1, 3, 9], [2, 20, 20], [3, 7, 7], [4, 8, 8]]
    assert every.valid.tolist() == [True, True, False]
    assert (every.value.tolist(), every.orientation.tolist()) == ([5, 0, 0], [0, 4, 4])
    assert every.color is None
    colored = Box.stacked(box(1, 2, 3, 4, color=6), box(np.array([3, 9]), 2, 3, 4, color=7))
    assert colored.color.tolist() == [6, 7, 7]
    with pytest.raises(ValueError, match="a colour each"):
        Box.stacked(box(1, 2, 3, 4), colored)


def test_table_of_boxes():
    table = BoxTable([(1, 2, 3, 4), (255, 255, 255, 255), (0, 0, 0, 0)])
    b = table.at(jnp.array([1, 0, 2, -1, 9], jnp.int32), x=10, y=np.array([0, 1, 0, 0, 0]), color=5)
    assert fields(b) == [
        [265, 11, 10, 11, 10],
        [255, 3, 0, 2, 0],
        [255, 3, 0, 3, 0],
        [255, 4, 0, 4, 0],
    ]
    assert int(b.color) == 5


@pytest.mark.parametrize("rows", [[(1, 2, 3)], [(1, 2, 3, 256)], [(-1, 2, 3, 4)], (1, 2, 3, 4)])
def test_wrong_tables_are_refused(rows):
    with pytest.raises(ValueError, match=r"rows must be \[n, 4\] numbers from 0 to 255"):
        BoxTable(rows)


def test_the_one_that_is_chosen():
    values = jnp.array([[5, 6], [7, 8]], jnp.int32)
    assert int(only(jnp.array([[False, True], [False, False]]), values)) == 6
    assert only(jnp.array([[True, False], [False, False]]), values, axis=1).tolist() == [5, 0]


def test_extremes():
    row = jnp.arange(4, dtype=jnp.int32)
    assert [int(v) for v in extremes(jnp.array([False, True, True, False]), row, row + 1)] == [1, 3]
    assert [int(v) for v in extremes(jnp.zeros(4, bool), row, row + 1)] == [BEYOND, 0]


def test_pictures_with_axes():
    pictures = Pictures.of(
        [np.array([1 << look + 3 * page, 0]) for page in range(2) for look in range(3)],
        page=2,
        look=3,
    )
    index = pictures.index(page=jnp.array([1, 0], jnp.int32), look=jnp.array([2, 1], jnp.int32))
    assert index.tolist() == [5, 1]
    with pytest.raises(TypeError, match="pictures are page, look, got page, cut"):
        pictures.index(page=0, cut=0)
    with pytest.raises(ValueError, match="6 pictures are not one for each combination"):
        Pictures(pictures.packed, {"page": 2, "look": 2})
