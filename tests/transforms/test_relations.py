"""Pairwise relations against plain numpy."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ocjax
from ocjax import Objects
from tests.support.states import excerpt


def made(boxes, valid):
    n = len(valid)
    boxes = np.where(np.array(valid)[:, None], np.array(boxes, np.int16).reshape(n, 4), np.int16(0))
    zeros = np.zeros(n, np.int8)
    return Objects(
        *map(
            jnp.asarray,
            (
                boxes,
                np.array(valid, bool),
                zeros,
                zeros.astype(np.int32),
                np.zeros((n, 3), np.uint8),
            ),
        )
    )


box = st.tuples(st.integers(0, 159), st.integers(0, 209), st.integers(0, 40), st.integers(0, 40))
group = st.lists(st.tuples(box, st.booleans()), min_size=4, max_size=4)


def touch(a, b):
    """True if the boxes, enlarged by one pixel on the right and at the bottom, have a common
    pixel."""
    mine, other = (
        {(i, j) for i in range(x, x + w + 1) for j in range(y, y + h + 1)} for x, y, w, h in (a, b)
    )
    return bool(mine & other)


@settings(max_examples=40)
@given(group, group)
def test_against_numpy(first, second):
    got = ocjax.relations(made(*zip(*first, strict=True)), made(*zip(*second, strict=True)))
    for i, (a, is_a) in enumerate(first):
        for j, (b, is_b) in enumerate(second):
            entry = jax.tree.map(lambda f, i=i, j=j: np.asarray(f)[i, j], got)
            assert entry.valid == (is_a and is_b)
            if not entry.valid:
                assert not any(np.any(leaf) for leaf in jax.tree.leaves(entry))
                continue
            dx, dy = b[0] + b[2] / 2 - a[0] - a[2] / 2, b[1] + b[3] / 2 - a[1] - a[3] / 2
            assert (entry.offset == [dx, dy]).all()
            assert entry.distance == pytest.approx(math.hypot(dx, dy), rel=1e-6)
            degrees = math.degrees(math.atan2(dx, -dy))
            assert entry.direction == (round(degrees / 22.5) % 16 if (dx, dy) != (0, 0) else -1)
            assert entry.contact == touch(a, b)


@pytest.mark.parametrize(
    ("offset", "point"),
    [
        ((0, -9), 0),
        ((9, -9), 2),
        ((9, 0), 4),
        ((0, 9), 8),
        ((-9, 0), 12),
        ((-9, -9), 14),
        ((-3, -40), 0),
        ((0, 0), -1),
    ],
)
def test_directions(offset, point):
    a, b = made([(50, 50, 4, 4)], [True]), made([(50 + offset[0], 50 + offset[1], 4, 4)], [True])
    assert ocjax.relations(a, b).direction.tolist() == [[point]]


def test_batches_under_transformations():
    game, rams = ocjax.load("Pong"), excerpt("Pong")["rams"][:6].reshape(2, 3, 128)
    objects = game.rem(rams)
    all_pairs = ocjax.relations(objects)
    assert all_pairs.offset.shape == (2, 3, 5, 5, 2)
    assert all_pairs.direction.dtype == jnp.int8
    mapped = jax.vmap(jax.vmap(ocjax.relations))(objects)
    for a, b in zip(jax.tree.leaves(all_pairs), jax.tree.leaves(mapped), strict=True):
        assert np.array_equal(a, b)
    paddle = ocjax.relations(objects.of("Player"), objects)
    assert np.array_equal(paddle.contact, all_pairs.contact[..., :1, :])
    assert np.array_equal(np.asarray(all_pairs.offset), -np.swapaxes(all_pairs.offset, -2, -3))


def test_batch_shapes_must_agree():
    objects = ocjax.load("Pong").rem(excerpt("Pong")["rams"][:6])
    with pytest.raises(ValueError, match=r"same batch shape, got \[6\] and \[2\]"):
        ocjax.relations(objects, objects[:2])


def test_what_is_no_objects_is_refused():
    rams = excerpt("Pong")["rams"][:6]
    with pytest.raises(TypeError, match=r"objects must be ocjax\.Objects, .* got uint8 \[6, 128\]"):
        ocjax.relations(rams)
    with pytest.raises(TypeError, match=r"others must be ocjax\.Objects, .* got 'Player'"):
        ocjax.relations(ocjax.load("Pong").rem(rams), "Player")


def test_repr_is_short():
    game = ocjax.load("Pong")
    shown = repr(ocjax.relations(game.rem(np.zeros((3, 128), np.uint8))))
    assert shown == "Relations of 5 slots to 5 slots, batch shape [3]"
