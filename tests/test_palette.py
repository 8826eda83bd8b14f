import numpy as np
import pytest

from ocjax.vision import palette


def test_there_and_back():
    index = np.arange(0, 256, 2, dtype=np.uint8).reshape(16, 8)
    assert np.array_equal(palette.to_index(palette.NTSC[index]), index)
    assert np.array_equal(palette.to_rgb(index), palette.NTSC[index])
    assert palette.to_index(palette.NTSC[index]).dtype == np.uint8


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
