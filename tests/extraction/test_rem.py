"""Each stage of REM."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax._xla import kernels
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction import rem
from tests.support.checks import host
from tests.support.synthetic import GAME

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
    assert columns.shape == (len(addresses), kernels.padded(LANES))
    assert np.array_equal(columns[:, :LANES], RAMS[:, addresses].T)


def boxes_of(ram):
    """Every category's box in one state, in full: fields `[count]`."""
    boxes = {
        name: box.clip(0, 0, GAME.screen[1], GAME.screen[0])
        for name, box in GAME.decode(GAME.ram(ram)).items()
    }
    return {
        c.name: jax.tree.map(
            lambda v, c=c: jnp.broadcast_to(v, (c.count, *v.shape[1:])), boxes[c.name]
        )
        for c in GAME.categories
    }


@pytest.fixture(scope="module")
def boxes():
    return host(jax.jit(jax.vmap(boxes_of))(RAMS))


@pytest.fixture(scope="module")
def slots():
    return jax.jit(lambda columns: rem.decode(GAME, columns, range(RAM_SIZE))[0])(RAMS.T)


def test_decode_packs_boxes(boxes, slots):
    for c in GAME.categories:
        box, packed = boxes[c.name], np.broadcast_to(slots[c.name].boxes, (c.count, LANES)).T
        for k, field in enumerate((box.x, box.y, box.w, box.h)):
            assert np.array_equal(packed >> 8 * k & 255, np.where(box.valid, field, 0))


def test_pack_and_unpack(boxes, slots):
    rows = rem.pack(GAME, slots, None, LANES)
    assert rows.boxes.shape == (GAME.num_slots, LANES)
    assert [v.shape for v in rows.value] == [(3, LANES)]  # Score, Fuel, Tank
    assert set(rows.rgb) == {"Walker"}
    objects = host(rem.unpack(GAME, rows, LANES))
    for c in GAME.categories:
        s, box = GAME.slices[c.name], boxes[c.name]
        assert np.array_equal(objects.valid[:, s], box.valid)
        assert np.array_equal(
            objects.value[:, s], np.where(box.valid & ("value" in c.attributes), box.value, 0)
        )
        assert np.array_equal(
            objects.orientation[:, s],
            np.where(box.valid & ("orientation" in c.attributes), box.orientation & 15, 0),
        )
        for k, field in enumerate((box.x, box.y, box.w, box.h)):
            assert np.array_equal(objects.xywh[:, s, k], np.where(box.valid, field, 0))
    walkers = GAME.slices["Walker"]
    assert np.array_equal(
        objects.rgb[:, walkers],
        np.where(objects.valid[:, walkers, None], GAME.palette[boxes["Walker"].color], 0),
    )


def test_unpack_drops_the_padding(slots):
    rows = rem.pack(GAME, slots, None, LANES)
    assert rem.unpack(GAME, rows, LANES - 5).valid.shape == (LANES - 5, GAME.num_slots)
