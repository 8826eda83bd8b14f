"""Boxes and labels that are drawn over frames."""

import jax
import numpy as np
import pytest

import ocjax
from ocjax import recordings
from ocjax.transforms import drawing
from tests.support.states import DATA, excerpt


@pytest.mark.parametrize(
    ("record", "text"),
    [
        ({"hud": True, "value": 12}, " 12"),
        ({"hud": False, "value": 3, "orientation": 2}, " value 3, facing NE"),
        ({"hud": False, "orientation": 12}, " facing W"),
        ({"hud": True}, ""),
    ],
)
def test_labels_say_what_their_numbers_are(record, text):
    assert drawing._attributes(record) == text


def test_objects_that_the_frame_does_not_show_are_dashed():
    game, data = ocjax.load("Pong"), excerpt("Pong")
    i = next(i for i, o in enumerate(game.rem(data["rams"])) if bool(o.of("Ball").valid[0]))
    frame, objects = data["screens"][i], jax.tree.map(np.asarray, game.rem(data["rams"][i]))
    assert drawing.drawn(game, frame, objects).tolist() == objects.valid.tolist()
    assert drawing.drawn(game, game.palette[frame], objects).tolist() == objects.valid.tolist()
    x, y, w, h = objects.xywh[2].tolist()
    hidden = frame.copy()
    hidden[y : y + h, x : x + w] = frame[y, x - 4]
    assert drawing.drawn(game, hidden, objects).tolist() == [True, True, False, True, True]

    def edge(frame):
        """The distinct colours along the upper edge of the ball's box."""
        image = np.asarray(drawing.overlay(game, frame, objects, scale=8, labels=False))
        return len(np.unique(image[8 * y - 1, 16 * x : 16 * (x + w)], axis=0))

    assert edge(frame) == 1
    assert edge(hidden) > 1


def test_pixels_have_the_color_of_their_category():
    game, data = ocjax.load("MsPacman"), excerpt("MsPacman")
    frame, objects = data["screens"][7], game.rem(data["rams"][7])
    owners = np.asarray(ocjax.segment(objects, frame))
    image = np.asarray(drawing.pixels(game, frame, objects, scale=1))
    assert image.shape == (210, 320, 3)
    np.testing.assert_array_equal(image[:, ::2], image[:, 1::2])
    np.testing.assert_array_equal(image[:, ::2][owners < 0], game.palette[frame][owners < 0] // 3)
    colors = drawing.category_colors(game)
    for name, slots in game.slices.items():
        own = (owners >= slots.start) & (owners < slots.stop)
        assert (image[:, ::2][own] == colors[name]).all()
    assert (owners >= 0).any()


def test_terrain_is_painted_and_named():
    game, data = ocjax.load("MsPacman"), excerpt("MsPacman")
    frame, terrain = data["screens"][7], game.terrain_of(data["rams"][7])
    wall = np.asarray(terrain.of("wall"))
    painted = drawing.tinted(game, frame, terrain)
    assert (painted[wall] == drawing.terrain_colors(game)["wall"]).all()
    np.testing.assert_array_equal(painted[~wall], game.palette[frame][~wall] // 2)
    objects = game.rem(data["rams"][7])
    shown = np.asarray(drawing.overlay(game, frame, objects, scale=1, terrain=terrain))
    colors = drawing.terrain_colors(game)
    assert (shown[:, ::2][wall] == colors["wall"]).all(axis=-1).mean() > 0.9  # beside boxes
    assert (shown == 0).all(axis=-1).any()  # behind labels


def test_objects_whose_color_the_ram_lacks_are_drawn():
    game = ocjax.load("Klax")
    tape = recordings.read(DATA / "Klax.npz", "Klax")
    rem = game.rem(tape.rams)
    tiles = np.asarray(rem.valid[:, game.slices["BeltTile"]])
    state = int(tiles.any(axis=1).argmax())
    shown = drawing.drawn(game, tape.screens[state], rem[state])
    assert tiles[state].any()
    assert np.array_equal(shown[game.slices["BeltTile"]], tiles[state])
