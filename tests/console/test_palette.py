import ale_py
import jax
import numpy as np
import pytest

import ocjax
from ocjax.console import palette
from ocjax.console.rom_files import rom_path


@pytest.mark.parametrize("table", [palette.NTSC, palette.PAL], ids=["NTSC", "PAL"])
def test_there_and_back(table):
    index = np.arange(0, 256, 2, dtype=np.uint8).reshape(16, 8)
    back = palette.to_index(table[index], table)
    assert back.dtype == np.uint8
    assert np.array_equal(table[back], table[index])
    assert np.array_equal(palette.to_rgb(index, table), table[index])
    hues = (
        slice(2, 14) if table is palette.PAL else slice(None)
    )  # PAL consoles have four hues of grey; the first one counts
    assert np.array_equal(back[hues], index[hues])
    assert palette.is_color(table[index], table).all()


@pytest.mark.parametrize("name", ["Pong", "Pacman"])
def test_the_emulator_shows_these_colours(name):
    """The emulator shows these colours, and NTSC and PAL games find the same objects in RGB frames
    and in indices."""
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    game, ale = ocjax.load(name), ale_py.ALEInterface()
    ale.loadROM(rom_path(game.rom))
    for _ in range(300):
        ale.act(ale.getMinimalActionSet()[-1])
    screen, rgb = ale.getScreen(), ale.getScreenRGB()
    assert np.array_equal(game.palette[screen], rgb)
    palette.check_rgb(rgb, game.palette)
    for a, b in zip(jax.tree.leaves(game.vem(screen)), jax.tree.leaves(game.vem(rgb)), strict=True):
        assert np.array_equal(a, b)


def test_grey_frames_of_a_pal_console():
    """The emulator shows the same in grey after a frame with an odd number of lines."""
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    game, ale = ocjax.load("AirRaid"), ale_py.ALEInterface()
    ale.loadROM(rom_path(game.rom))
    while not (ale.getScreen() & 1).any():
        ale.act(ale.getMinimalActionSet()[-1])
    screen, rgb = ale.getScreen(), ale.getScreenRGB()
    odd = screen % 2 == 1
    assert np.array_equal(game.palette[screen][~odd], rgb[~odd])
    assert np.array_equal(
        rgb[odd],
        np.rint(game.palette[screen][odd] @ (0.2989, 0.587, 0.114))
        .astype(np.uint8)[:, None]
        .repeat(3, axis=1),
    )
    palette.check_rgb(rgb, game.palette)
    for a, b in zip(jax.tree.leaves(game.vem(screen)), jax.tree.leaves(game.vem(rgb)), strict=True):
        assert np.array_equal(a, b)


def test_foreign_colours_are_reported():
    frame = palette.NTSC[np.zeros((5, 6), np.uint8)]
    palette.check_rgb(frame)
    frame[2, 3] = 1, 2, 3
    with pytest.raises(palette.PaletteError, match=r"1 of 30 pixels.*\[1, 2, 3\]"):
        palette.check_rgb(frame)
    with pytest.raises(TypeError, match="uint8"):
        palette.check_rgb(frame.astype(float))
    with pytest.raises(ValueError, match="shape"):
        palette.check_rgb(frame[..., :2])
