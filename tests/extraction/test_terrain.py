"""Wrong declarations of terrain, and the rules of the functions that extract it."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.extraction.declaration import GameError
from ocjax.extraction.terrain import COVERED, TerrainKind, TerrainMap
from tests.support.states import excerpt

WALL = TerrainKind("wall", "walls", effect="blocks")
ONE = np.zeros((1, 1, 210, 160), bool)


def pong_with(**changes):
    """Pong with a declaration of terrain."""
    terrain = TerrainMap((WALL,), ONE, lambda frame: {"wall": frame == COVERED})
    return ocjax.load("Pong").replaced(terrain=dataclasses.replace(terrain, **changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kinds": ()}, "different names"),
        ({"kinds": (WALL, WALL), "layouts": np.zeros((1, 2, 210, 160), bool)}, "different names"),
        ({"kinds": (dataclasses.replace(WALL, effect="stops"),)}, "effect must be of"),
        ({"kinds": (dataclasses.replace(WALL, drawn="ball"),)}, "drawn of"),
        ({"kinds": (dataclasses.replace(WALL, category="Wall"),)}, "'Wall' is not a category"),
        ({"boxes": ("Wall",)}, r"no categories are named \['Wall'\]"),
        ({"layouts": ONE.astype(np.uint8)}, "layouts must be bool"),
        ({"layouts": ONE[:, :, :100]}, r"layouts must be bool \[layouts, 1, 210, 160\]"),
    ],
)
def test_wrong_declarations(changes, message):
    with pytest.raises(GameError, match=message):
        pong_with(**changes)


def test_pixels_of_objects_are_covered():
    """`seen` gets 1 instead of the pixels of objects, unless a kind names their category."""
    frames = excerpt("Pong")["screens"][-4:]
    game = pong_with()
    covered = np.asarray(game.terrain_in(frames).of("wall"))
    owners = np.asarray(ocjax.segment(game.vem(frames), frames))
    np.testing.assert_array_equal(covered, owners >= 0)
    assert covered.any()
    other = pong_with(kinds=(dataclasses.replace(WALL, category="Player"),))
    player = game.slices["Player"]
    kept = (owners >= 0) & ~((owners >= player.start) & (owners < player.stop))
    np.testing.assert_array_equal(other.terrain_in(frames).of("wall"), kept)


def test_boxes_of_categories():
    """`seen` gets the pixels in the boxes of the categories that it asks for."""
    frames = excerpt("Pong")["screens"][-4:]
    game = pong_with(boxes=("Player",), seen=lambda frame, players: {"wall": players})
    found = np.asarray(game.terrain_in(frames).of("wall"))
    objects = game.vem(frames).of("Player")
    for mask, (x, y, w, h), valid in zip(
        found, np.asarray(objects.xywh)[:, 0].tolist(), objects.valid[:, 0], strict=True
    ):
        expected = np.zeros((210, 160), bool)
        expected[y : y + h, x : x + w] = bool(valid)
        np.testing.assert_array_equal(mask, expected)


def test_layouts_and_changes():
    """The index selects a layout; changes replace the masks and hide the index."""
    layouts = np.stack([ONE[0], ~ONE[0]])
    rams = np.zeros((3, 128), np.uint8)
    rams[:, 13] = 0, 1, 1
    game = pong_with(layouts=layouts, layout=lambda m: m.enemy_score & 1)
    terrain = game.terrain_of(rams)
    assert terrain.changed is None
    np.testing.assert_array_equal(terrain.masks, layouts[np.asarray(terrain.layout)])
    inverted = pong_with(layouts=layouts, changes=lambda m, masks: {"wall": ~masks["wall"]})
    assert inverted.terrain_of(rams).layout is None
    assert np.asarray(inverted.terrain_of(rams).masks).all()


@pytest.mark.parametrize(
    ("masks", "message"),
    [
        ({}, "the masks must be those of wall"),
        ({"wall": jnp.zeros((210, 160))}, r"the mask of wall must be bool \[H, 160\]"),
        ({"wall": jnp.zeros((210, 40), bool)}, r"the mask of wall must be bool \[H, 160\]"),
    ],
)
def test_wrong_masks(masks, message):
    game = pong_with(changes=lambda m, _: masks)
    with pytest.raises(ValueError, match=message):
        game.terrain_of(np.zeros(128, np.uint8))


def test_wrong_use():
    terrain = ocjax.load("MsPacman").terrain_of(np.zeros(128, np.uint8))
    with pytest.raises(KeyError, match="MsPacman has the kinds wall, got 'door'"):
        terrain.of("door")
    with pytest.raises(ValueError, match="at least one pixel"):
        terrain.grid((0, 8))
    assert repr(terrain) == "Terrain(MsPacman, batch [], wall)"
    with pytest.raises(TypeError, match="uint8"):
        ocjax.load("MsPacman").terrain_of(np.zeros(128))
