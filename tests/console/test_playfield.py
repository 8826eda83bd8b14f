"""Pixels of the playfield registers and of areas, against the console's order of bits."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocjax.console.playfield import area_mask, playfield

ORDER = [f"0{bit}" for bit in (4, 5, 6, 7)]
ORDER += [f"1{bit}" for bit in (7, 6, 5, 4, 3, 2, 1, 0)]
ORDER += [f"2{bit}" for bit in range(8)]
REGISTERS = st.tuples(*[st.integers(0, 255)] * 3)


def blocks(registers):
    """The 20 blocks of a half, bit by bit."""
    return [registers[int(place[0])] >> int(place[1]) & 1 for place in ORDER]


@given(left=REGISTERS, right=st.none() | REGISTERS, mirrored=st.booleans())
def test_playfield(left, right, mirrored):
    second = blocks(right or left)
    expected = blocks(left) + (second[::-1] if mirrored else second)
    pixels = playfield(
        *map(np.array, left), right and tuple(map(np.array, right)), mirrored=mirrored
    )
    assert pixels.dtype == bool
    np.testing.assert_array_equal(pixels.reshape(40, 4).all(axis=1), expected)
    np.testing.assert_array_equal(pixels.reshape(40, 4).any(axis=1), expected)


def test_playfield_of_many_lines():
    """NumPy's and JAX's arrays of any shape give the same."""
    registers = np.random.default_rng(0).integers(0, 256, (3, 5, 7), np.uint8)
    pixels = playfield(*registers, mirrored=True)
    assert pixels.shape == (5, 7, 160)
    np.testing.assert_array_equal(pixels, playfield(*map(jnp.asarray, registers), mirrored=True))
    np.testing.assert_array_equal(pixels[2, 3], playfield(*registers[:, 2, 3], mirrored=True))


@pytest.mark.parametrize("height", [210, 250])
def test_area_mask(height):
    mask = area_mask((8, 20, 30, 40), height)
    expected = np.zeros((height, 160), bool)
    expected[20:40, 8:30] = True
    np.testing.assert_array_equal(mask, expected)
