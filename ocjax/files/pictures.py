"""Rows in pictures: the formats without loss, and folders of pictures."""

import io
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from ocjax.files import folders
from ocjax.files.rows import LEAST_HEIGHT, MOST_HEIGHT, WIDTH, Input, InputError, check_rows

# Pillow's formats by suffix
FORMATS = {
    ".png": "PNG",
    ".gif": "GIF",
    ".webp": "WEBP",
    ".bmp": "BMP",
    ".tif": "TIFF",
    ".tiff": "TIFF",
}
MOST_BYTES = 2**20  # largest size of a picture's file; four times the size without compression
MOST_TILE = 2**16  # largest number of pixels in a tile of a TIFF picture
_TILE_WIDTH, _TILE_HEIGHT = 322, 323  # TIFF tags
SIGNATURES = (b"\x89PNG", b"GIF8", b"RIFF", b"BM", b"II*\0", b"MM\0*")


def read_picture(source: bytes | Path) -> np.ndarray:
    """Read a picture: RGB, uint8 `[H, W, 3]`, or palette indices (mode L), uint8 `[H, W]`.

    The size is checked before the pixels are decoded.
    """
    length = len(source) if isinstance(source, bytes) else source.stat().st_size
    if length > MOST_BYTES:
        raise ValueError(f"a picture must have at most {MOST_BYTES:,} bytes, got {length:,}")
    content = source if isinstance(source, bytes) else source.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        image = Image.open(io.BytesIO(content), formats=[*dict.fromkeys(FORMATS.values())])
    with image:
        _check_picture(image)
        return np.asarray(image if image.mode in ("L", "RGB") else image.convert("RGB"))


def _check_picture(image: Image.Image) -> None:
    width, height = image.size
    if width != WIDTH or not LEAST_HEIGHT <= height <= MOST_HEIGHT:
        raise ValueError(
            f"pictures must be {WIDTH} pixels wide and {LEAST_HEIGHT} to {MOST_HEIGHT} high, got "
            f"{width} x {height}"
        )
    if image.mode not in ("RGB", "P", "RGBA", "L"):
        raise ValueError(
            f"pictures must be RGB, or palette indices of 8 bits, got mode {image.mode}"
        )
    if getattr(image, "is_animated", False):
        raise ValueError("it holds several frames: save each frame as a separate picture")
    tags = getattr(image, "tag_v2", {})
    if tags.get(_TILE_WIDTH, 0) * tags.get(_TILE_HEIGHT, 0) > MOST_TILE:
        raise ValueError(
            f"tiles must have at most {MOST_TILE:,} pixels, got {tags[_TILE_WIDTH]} x "
            f"{tags[_TILE_HEIGHT]}"
        )


def stacked(
    rows: Iterable[np.ndarray], name: str, first: int, shape: tuple[int, ...] | None
) -> np.ndarray:
    """Stack rows of one shape; None for the shape of the first row."""
    found: list[np.ndarray] = []
    for row in rows:
        expected = row.shape if shape is None and not found else shape or found[0].shape
        if row.shape != expected:
            raise InputError(
                f"{name}, row {first + len(found)}, has the shape {list(row.shape)}, others have "
                f"{list(expected)}"
            )
        found.append(row)
    return np.stack(found)


class PictureFolder(Input):
    """A folder of pictures, in the natural order of their names; other files are ignored."""

    pictures = True

    def __init__(self, path: Path) -> None:
        self.name, self.facts = str(path), {}
        self.reads = folders.files(path, FORMATS)
        if not self.reads:
            raise InputError(f"{path} holds no pictures ({', '.join(FORMATS)})")
        self.rows, first = len(self.reads), self._picture(0)
        check_rows(str(self.reads[0]), first.dtype, (1, *first.shape))
        self.batch, self.row_shape = (self.rows,), first.shape

    def stem(self, i: int) -> str:
        """The name of a picture, without its suffix."""
        return self.reads[i].stem

    def _picture(self, i: int) -> np.ndarray:
        try:
            return read_picture(self.reads[i])
        except Exception as error:
            raise InputError(
                f"row {i}, {self.reads[i]}, is not a readable picture: {error}"
            ) from error

    def _read(self, start: int, stop: int) -> np.ndarray:
        return stacked(map(self._picture, range(start, stop)), self.name, start, self.row_shape)
