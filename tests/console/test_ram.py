import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console.ram import Field, RamMap, bcd, bits, byte, flag, high, low, signed


class Ram(RamMap):
    one = byte(5)
    several = byte(14, 15, 3)
    backwards = byte(*range(117, 107, -1))
    word = byte((85, 86))
    score = bcd((85, 86, 87))
    scores = bcd(10, 11)
    delta = signed(7, 8)
    wide_delta = signed((7, 8))
    middle = bits(9, first=2, count=3)
    nibbles = low(9, 10)
    tops = high(9, 10)
    plays = flag(9, bit=7)
    visible = flag(12, 10, 11, bit=2)


@pytest.fixture
def ram():
    return np.random.default_rng(0).integers(0, 256, 128, dtype=np.uint8)


def test_bytes(ram):
    m, r = Ram(jnp.asarray(ram)), ram.astype(int)
    assert m.one.dtype == jnp.int32
    assert m.one.shape == ()
    assert int(m.one) == r[5]
    assert m.several.tolist() == [r[14], r[15], r[3]]
    assert m.backwards.tolist() == r[117:107:-1].tolist()
    assert int(m.word) == 256 * r[85] + r[86]
    assert m.delta.tolist() == [int(np.int8(ram[7])), int(np.int8(ram[8]))]
    assert int(m.wide_delta) == int(np.int16(256 * r[7] + r[8] - (65536 if r[7] > 127 else 0)))
    assert int(m.middle) == (r[9] >> 2) & 7
    assert m.nibbles.tolist() == [r[9] & 15, r[10] & 15]
    assert m.tops.tolist() == [r[9] >> 4, r[10] >> 4]


def test_bcd(ram):
    ram[[85, 86, 87, 10, 11]] = [0x12, 0x34, 0x56, 0x09, 0x90]
    m = Ram(jnp.asarray(ram))
    assert int(m.score) == 123456
    assert m.scores.tolist() == [9, 90]


def test_flags(ram):
    ram[9:13] = [0x80, 0x04, 0xFB, 0xFF]
    m = Ram(jnp.asarray(ram))
    assert m.plays.dtype == m.visible.dtype == jnp.bool_
    assert m.plays.shape == ()
    assert bool(m.plays)
    assert m.visible.tolist() == [True, True, False]
    assert Ram.visible.addresses == (12, 10, 11)


def test_no_wrap_around():
    m = Ram(jnp.full(128, 30, jnp.uint8))
    assert int(m.one - 49) == -19


def test_declaration():
    assert list(Ram.fields())[:3] == ["one", "several", "backwards"]
    assert isinstance(Ram.one, Field)
    assert Ram.word.addresses == (85, 86)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: byte(128),
        lambda: byte(-1),
        lambda: byte(),
        lambda: byte((1, 2), 3),
        lambda: bits(3, count=0),
        lambda: bits(3, first=5, count=4),
        lambda: flag(3, bit=8),
        lambda: flag(128, bit=0),
    ],
)
def test_wrong_declarations(wrong):
    with pytest.raises(ValueError, match=r"RAM|bit field|flag's bit"):
        wrong()
