"""The owners of pixels, against plain numpy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ocjax
from ocjax import Objects
from ocjax.transforms.segmentation import NOBODY, masks
from tests.support.record.deciding import in_batches
from tests.support.states import excerpt

EVEN = 0xFE
# Levels with other colours, a screen of 250 rows, many small boxes, a screen saver, a backdrop.
GAMES = ("Centipede", "AirRaid", "MsPacman", "Breakout", "Assault")


def colors_of(game, slot, frame):
    """A function of pixels: True in a colour of the slot's category."""
    category = game.categories[game.slot_category[slot]]
    colors = category.slot_colors()[slot - game.slices[category.name].start]
    if game.shades is not None:
        x, y = game.shades.pixel
        level = [i for i, key in enumerate(game.shades.keys) if key == frame[y, x] & EVEN] or [0]
        now = dict(zip(game.shades.levels[0], game.shades.levels[level[0]], strict=True))
        colors = [now.get(color, color) for color in colors]
    return lambda pixels: np.isin(pixels & EVEN, colors) ^ category.has_background


def owners_of(game, xywh, valid, frame):
    """`ocjax.segment` of one state without a screen saver."""
    owners = np.full(frame.shape, NOBODY, np.int16)
    height, width = frame.shape
    boxes = {}
    for slot in np.flatnonzero(valid):
        x, y, w, h = xywh[slot].astype(int)
        rows = slice(min(max(y, 0), height), min(max(y + h, 0), height))
        boxes[slot] = rows, slice(min(max(x, 0), width), min(max(x + w, 0), width))
    sizes = {slot: owners[box].size for slot, box in boxes.items()}
    for slot in sorted(boxes, key=lambda slot: (-sizes[slot], -slot)):
        own = colors_of(game, slot, frame)(frame[boxes[slot]])
        owners[boxes[slot]][own] = slot
    for row, pixels in zip(owners, frame & EVEN, strict=True):
        backdrop = {pixels[x] for x in game.backdrop}
        if len(backdrop) == 1:
            row[pixels == backdrop.pop()] = NOBODY
    return owners


def boxed(game, xywh, valid):
    """Objects with given boxes."""
    like = game.rem(np.zeros((len(valid), 128), np.uint8))
    return Objects(
        jnp.asarray(xywh, jnp.int16), jnp.asarray(valid), *jax.tree.leaves(like)[2:], game=game
    )


@pytest.mark.parametrize("name", GAMES)
def test_play(name):
    game, play = ocjax.load(name), excerpt(name)
    frames = play["screens"][::7]
    for objects in (game.rem(play["rams"][::7]), game.vem(frames)):
        owners = np.asarray(ocjax.segment(objects, frames))
        assert owners.dtype == np.int16
        for i, frame in enumerate(frames):
            wanted = owners_of(
                game, np.asarray(objects.xywh)[i], np.asarray(objects.valid)[i], frame
            )
            np.testing.assert_array_equal(owners[i], wanted)
        np.testing.assert_array_equal(owners, ocjax.segment(objects, game.palette[frames]))
        assert (owners >= 0).any()


@pytest.mark.parametrize("name", ["MsPacman", "AirRaid", "Assault"])
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), largest=st.sampled_from([0, 3, 30, 200]))
def test_any_boxes(name, seed, largest):
    """Boxes of any size and place, partly outside of the screen, overlap in many ways."""
    game, rng = ocjax.load(name), np.random.default_rng(seed)
    assert game.saver is None  # random pixels could show it
    shape = (4, game.num_slots)
    xywh = np.concatenate(
        [rng.integers(-20, 255, (*shape, 2)), rng.integers(0, largest + 1, (*shape, 2))], axis=-1
    )
    valid = rng.random(shape) < rng.random()
    frames = rng.choice(np.array(game.pixel_colors, np.uint8), (4, *game.screen))
    owners = ocjax.segment(boxed(game, xywh, valid), frames | rng.integers(0, 2, dtype=np.uint8))
    for i, frame in enumerate(frames):
        np.testing.assert_array_equal(owners[i], owners_of(game, xywh[i], valid[i], frame))


def test_backdrop():
    """No object owns pixels of the background while it flashes in the objects' colours."""
    game = ocjax.load("Assault")
    slot = game.slices["MotherShip"].start
    sky, hull, *_ = game.categories[game.slot_category[slot]].slot_colors()[0]
    frame = np.full(game.screen, sky, np.uint8)
    frame[20:24, 70:90] = hull
    xywh = np.zeros((1, game.num_slots, 4), np.int16)
    xywh[0, slot] = 60, 16, 40, 12
    objects = boxed(game, xywh, np.arange(game.num_slots)[None] == slot)
    owners = np.full((1, *game.screen), NOBODY)
    owners[0, 20:24, 70:90] = slot
    np.testing.assert_array_equal(ocjax.segment(objects, frame[None]), owners)
    # Where one column of the backdrop shows something else, the row has no backdrop.
    frame[21, game.backdrop[0]] = 0
    owners[0, 21, 60:100] = slot
    np.testing.assert_array_equal(ocjax.segment(objects, frame[None]), owners)


def test_any_batch_and_transformations():
    game, play = ocjax.load("Pong"), excerpt("Pong")
    rams, frames = play["rams"][:6], play["screens"][:6]
    objects = game.rem(rams)
    owners = np.asarray(ocjax.segment(objects, frames))
    np.testing.assert_array_equal(ocjax.segment(objects[2], frames[2]), owners[2])
    shaped = jax.tree.map(lambda a: a.reshape(2, 3, *a.shape[1:]), objects)
    by_two = ocjax.segment(shaped, frames.reshape(2, 3, *frames.shape[1:]))
    np.testing.assert_array_equal(by_two, owners.reshape(by_two.shape))
    assert ocjax.segment(objects[:0], frames[:0]).shape == (0, *game.screen)
    mapped = jax.vmap(lambda ram, frame: ocjax.segment(game.rem(ram), frame))
    np.testing.assert_array_equal(jax.jit(mapped)(rams, frames), owners)


def test_settings_of_jax_and_overwritten_frames():
    game, play = ocjax.load("Pong"), excerpt("Pong")
    objects, frames = game.rem(play["rams"][:6]), play["screens"][:6].copy()
    owners = ocjax.segment(objects, frames)
    frames[:] = 0
    wanted = np.asarray(owners)
    np.testing.assert_array_equal(ocjax.segment(objects, play["screens"][:6]), wanted)
    for settings_of_jax in (jax.enable_x64(True), jax.debug_nans(True), jax.disable_jit()):
        with settings_of_jax:
            found = ocjax.segment(objects, play["screens"][:6])
        assert found.dtype == np.int16
        np.testing.assert_array_equal(found, wanted)


def test_masks():
    game, play = ocjax.load("Pong"), excerpt("Pong")
    objects, frames = game.rem(play["rams"][:4]), play["screens"][:4]
    owners, of_slots = ocjax.segment(objects, frames), masks(objects, frames)
    assert (of_slots.dtype, of_slots.shape) == (bool, (4, game.num_slots, *game.screen))
    for slot in range(game.num_slots):
        np.testing.assert_array_equal(of_slots[:, slot], owners == slot)
    ball = masks(objects.of("Ball"), frames)
    np.testing.assert_array_equal(ball[:, 0], owners == game.slices["Ball"].start)


def test_errors():
    game, play = ocjax.load("Pong"), excerpt("Pong")
    objects, frames = game.rem(play["rams"][:4]), play["screens"][:4]
    with pytest.raises(TypeError, match="uint8"):
        ocjax.segment(objects, frames.astype(np.int32))
    with pytest.raises(ValueError, match=r"\[4, 210, 160\].*got \[3, 210, 160\]"):
        ocjax.segment(objects, frames[:3])
    with pytest.raises(ValueError, match=r"got \[4, 160, 210\]"):
        ocjax.segment(objects, frames.transpose(0, 2, 1))
    few = jax.tree.map(lambda a: a[:, :2], objects)
    with pytest.raises(ValueError, match="must have 5 slots, got 2"):
        ocjax.segment(few, frames)


def test_every_category(game):
    """Each object that VEM finds has a pixel in a colour of its category."""
    frames = excerpt(game.name)["screens"][::5]
    objects = in_batches(game.vem, frames)
    xywh, valid = objects.xywh, objects.valid
    for i, frame in enumerate(frames):
        for slot in np.flatnonzero(valid[i]):
            x, y, w, h = xywh[i, slot]
            own = colors_of(game, slot, frame)(frame[y : y + h, x : x + w])
            name = game.categories[game.slot_category[slot]].name
            assert own.any(), f"sample {i}: no pixel of {name} in its box {xywh[i, slot].tolist()}"
