"""The stages of REM, one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic import GAME
from test_contract import host

from ocjax import _xla, rem
from ocjax.ram import RAM_SIZE

pytestmark = pytest.mark.usefixtures("quick_compilation")

LANES = 512
RAMS = np.random.default_rng(3).integers(0, 256, (LANES, RAM_SIZE), dtype=np.uint8)


@pytest.mark.parametrize(
    ("addresses", "ranges"),
    [
        ((5,), [range(5, 6)]),
        ((9, 5, 7), [range(5, 10)]),
        ((5, 40), [range(5, 6), range(40, 41)]),
        (range(3, 90), [range(0, 96)]),
    ],
)
def test_stretches(addresses, ranges):
    assert rem.stretches(addresses) == ranges


def test_read_puts_the_batch_last():
    ranges = rem.stretches(GAME.ram.addresses())
    columns = np.asarray(rem.read(jnp.asarray(RAMS), ranges))
    addresses = [a for r in ranges for a in r]
    assert columns.shape == (len(addresses), _xla.padded(LANES))
    assert np.array_equal(columns[:, :LANES], RAMS[:, addresses].T)


@pytest.fixture(scope="module")
def boxes():
    return jax.jit(lambda columns: rem.decode(GAME, columns, range(RAM_SIZE)))(RAMS.T)


def test_decode_is_one_state_at_a_time(boxes):
    decode = jax.jit(lambda ram: GAME.decode(GAME.ram(ram)))
    for i in (0, 7, LANES - 1):
        one = decode(RAMS[i])
        for name, box in one.items():
            box = box.clip(0, 0, GAME.screen[1], GAME.screen[0])
            for a, b in zip(jax.tree.leaves(box), jax.tree.leaves(boxes[name]), strict=True):
                np.testing.assert_array_equal(a, b[..., i])


def test_pack_and_unpack(boxes):
    rows = rem.pack(GAME, boxes, LANES)
    assert rows.boxes.shape == (GAME.num_slots, LANES)
    assert set(rows.value) == {"Score", "Fuel", "Tank"}
    assert set(rows.orientation) == {"Turner"}
    assert set(rows.rgb) == {"Walker"}
    objects = host(rem.unpack(GAME, rows, LANES))
    for c in GAME.categories:
        s, box = GAME.slices[c.name], boxes[c.name]
        valid = np.broadcast_to(box.valid, (c.count, LANES)).T
        assert np.array_equal(objects.valid[:, s], valid)
        for k, field in enumerate((box.x, box.y, box.w, box.h)):
            assert np.array_equal(objects.xywh[:, s, k], np.where(valid, np.broadcast_to(field, (c.count, LANES)).T, 0))
    walkers = GAME.slices["Walker"]
    rgb = np.moveaxis(np.asarray(boxes["Walker"].rgb), -1, 0)
    assert np.array_equal(objects.rgb[:, walkers], np.where(objects.valid[:, walkers, None], rgb, 0))


def test_unpack_drops_the_padding(boxes):
    rows = rem.pack(GAME, boxes, LANES)
    assert rem.unpack(GAME, rows, LANES - 5).valid.shape == (LANES - 5, GAME.num_slots)
