"""The terrain of every game that has one: from RAM, from pixels, and as the chip drew it."""

import jax
import numpy as np
import pytest

import ocjax
from ocjax import recordings
from ocjax.extraction.terrain import DRAWN, EFFECTS
from tests.support.record.deciding import in_batches
from tests.support.states import DATA

STATES = slice(0, 48)  # of an excerpt; masks take 34 kB per kind and state
WHOLE = 0.99  # Dice coefficient, mean over kinds
KIND = 0.97  # Dice coefficient of each kind
FEW = 400  # pixels: fewer do not give a coefficient
FEW_STATES = 8  # one number, so that the tests share a program
SAME = 8  # pixels that may differ between RAM and pixels


@pytest.fixture
def excerpt(truth):
    """RAM and screens of the first states."""
    return truth["rams"][STATES], truth["screens"][STATES]


def objects_in_front(game, rams):
    """Pixels around objects that are no terrain, bool `[B, H, 160]`."""
    same = {kind.category for kind in game.terrain}
    rem = in_batches(game.rem, rams)
    out = np.zeros((len(rams), *game.screen), bool)
    for state, slot in np.argwhere(rem.valid):
        if game.categories[game.slot_category[slot]].name not in same:
            x, y, w, h = rem.xywh[state, slot].astype(int)
            out[state, max(y - 1, 0) : y + h + 1, max(x - 1, 0) : x + w + 1] = True
    return out


def rows_of_play(game, rams):
    """The rows that objects outside the display reach, and the states with such objects."""
    rem = in_batches(game.rem, rams)
    moves = rem.valid & ~game.slot_hud
    tops = rem.xywh[..., 1][moves]
    bottoms = tops + rem.xywh[..., 3][moves]
    return slice(max(int(tops.min()), 0), int(bottoms.max())), moves.any(axis=1)


def dice(a, b):
    return 2 * np.count_nonzero(a & b) / max(np.count_nonzero(a) + np.count_nonzero(b), 1)


@pytest.mark.terrain
def test_ram_and_pixels_agree(game, excerpt):
    rams, screens = excerpt
    by_ram = in_batches(game.terrain_of, rams).masks
    by_frame = in_batches(game.terrain_in, screens).masks
    rows, in_play = rows_of_play(game, rams)
    free = ~objects_in_front(game, rams)[in_play, rows]
    each = {}
    for i, kind in enumerate(game.terrain):
        ours = by_ram[in_play, i, rows] & free
        theirs = by_frame[in_play, i, rows] & free
        if np.count_nonzero(ours) + np.count_nonzero(theirs) >= FEW:
            each[kind.name] = dice(ours, theirs)
    assert each, "no kind is on the screen"
    assert min(each.values()) >= KIND, each
    assert np.mean(list(each.values())) >= WHOLE, each


@pytest.mark.terrain
def test_every_room(game):
    """The terrain from RAM equals the terrain in the pixels, also in rare states."""
    paths = [DATA / f"{game.name}.npz", DATA / "rare" / f"{game.name}.npz"]
    tapes = [recordings.read(path, game.name) for path in paths if path.exists()]
    rams = np.concatenate([tape.rams for tape in tapes])
    screens = np.concatenate([tape.screens for tape in tapes])
    rows, in_play = rows_of_play(game, rams)
    by_ram = in_batches(game.terrain_of, rams).masks[:, :, rows]
    by_frame = in_batches(game.terrain_in, screens).masks[:, :, rows]
    free = ~objects_in_front(game, rams)[:, None, rows]
    differing = np.count_nonzero((by_ram != by_frame) & free, axis=(1, 2, 3))[in_play]
    assert np.count_nonzero(differing > SAME) == game.checks.terrain_differs, differing.tolist()


@pytest.mark.terrain
def test_declaration(game):
    for kind in game.terrain:
        assert kind.name == kind.name.lower()
        assert kind.doc
        assert kind.effect in (None, *EFFECTS)
        assert kind.drawn in DRAWN
        assert kind.category is None or kind.category in game.slices


@pytest.mark.terrain
def test_shapes_and_transformations(game, excerpt):
    rams, screens = excerpt
    kinds = len(game.terrain)
    expected = np.asarray(game.terrain_of(rams[:FEW_STATES]).masks)
    assert expected.shape == (FEW_STATES, kinds, *game.screen)
    mapped = jax.jit(jax.vmap(lambda ram: game.terrain_of(ram).masks))(rams[:FEW_STATES])
    np.testing.assert_array_equal(mapped, expected)
    folded = game.terrain_of(rams[:FEW_STATES].reshape(2, -1, 128)).masks
    np.testing.assert_array_equal(np.reshape(folded, expected.shape), expected)
    one = game.terrain_in(game.palette[screens[0]])
    np.testing.assert_array_equal(one.masks, game.terrain_in(screens[0]).masks)
    assert game.terrain_of(rams[0]).of(game.terrain[0].name).shape == game.screen


@pytest.mark.terrain
def test_grid(game, excerpt):
    terrain = game.terrain_of(excerpt[0][:FEW_STATES])
    masks, cells = np.asarray(terrain.masks), np.asarray(terrain.grid((8, 10)))
    assert cells.shape[-2:] == (-(-game.screen[0] // 8), 16)
    for row, column in ((0, 0), (5, 7), (cells.shape[-2] - 1, 15)):
        inside = masks[..., 8 * row : 8 * row + 8, 10 * column : 10 * column + 10]
        np.testing.assert_array_equal(cells[..., row, column], inside.any((-2, -1)))


@pytest.mark.terrain
def test_logic(game, excerpt):
    terrain = game.terrain_of(excerpt[0][:FEW_STATES])
    names = [kind.name for kind in game.terrain]
    cells = np.asarray(terrain.grid((16, 16)))
    for state, atoms in zip(cells, terrain.to_logic((16, 16)), strict=True):
        expected = {f"terrain({names[k]},{y},{x})" for k, y, x in np.argwhere(state)}
        assert set(atoms) == expected
    assert game.terrain_of(excerpt[0][0]).to_logic((16, 16)) == terrain.to_logic((16, 16))[0]


@pytest.mark.terrain
def test_random_states(game):
    """Arbitrary bytes give masks, and the same ones in any batch."""
    rams = np.random.default_rng(0).integers(0, 256, (FEW_STATES, 128), np.uint8)
    masks = np.asarray(game.terrain_of(rams).masks)
    np.testing.assert_array_equal(masks[3], game.terrain_of(rams[3]).masks)


def test_games_without_terrain():
    game = ocjax.load("Pong")
    assert game.terrain is None
    with pytest.raises(ValueError, match="Pong has no terrain"):
        game.terrain_of(np.zeros(128, np.uint8))
