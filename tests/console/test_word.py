"""Words: their fields keep their values, and do not touch each other."""

import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console.word import Word

FIGURE = Word(kind=3, x=8, y=9, rest=12)


def test_fields_come_back():
    values = {
        "kind": np.array([7, 0, 3]),
        "x": np.array([255, 1, 0]),
        "y": np.array([0, 511, 8]),
        "rest": np.array([4095, 0, 9]),
    }
    for convert in (lambda v: jnp.asarray(v, jnp.int32), np.int32):
        words = FIGURE.pack(**{name: convert(v) for name, v in values.items()})
        assert words.dtype == np.int32
        found = FIGURE.unpack(words)
        assert all(np.array_equal(getattr(found, name), v) for name, v in values.items())


def test_higher_bits_are_dropped():
    found = FIGURE.unpack(FIGURE.pack(kind=jnp.int32(9), x=-1, y=512, rest=0))
    assert [int(v) for v in (found.kind, found.x, found.y, found.rest)] == [1, 255, 0, 0]


def test_wrong_words():
    with pytest.raises(ValueError, match="32 in all"):
        Word(x=20, y=13)
    with pytest.raises(ValueError, match="1 bit or more"):
        Word(x=0)
    with pytest.raises(TypeError, match="the fields are kind, x, y, rest, got kind"):
        FIGURE.pack(kind=1)
