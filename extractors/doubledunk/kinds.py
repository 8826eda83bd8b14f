"""The look of a kind of DoubleDunk's figures, and constants of its search."""

from dataclasses import dataclass

import numpy as np

WIDE = 8  # columns of a figure
HALF_STRIP = 16  # columns; a strip of the court has two halves and shares each with another strip
SKIN_ROWS = 8  # consecutive rows of skin in every kind
ROWS_A_WORD = 4  # rows of a picture in a word
PICTURE_WORDS = 7  # of a picture and the line below it
PACKED_ROWS = PICTURE_WORDS * ROWS_A_WORD


@dataclass(frozen=True)
class Figure:
    """A kind of figure.

    Args:
        name: the category.
        colors: of its rows, from the top, as indices into the colours of all figures.
        pictures: the pixels of its rows, from the top, `[pictures, rows]` bytes.
        least: least number of fitting rows minus rows in other colours.
    """

    name: str
    colors: tuple[int, ...]
    pictures: np.ndarray
    least: int

    @property
    def height(self) -> int:
        """Number of its rows."""
        return len(self.colors)

    @property
    def skin(self) -> int:
        """The first of its eight rows of one colour."""
        runs = (self.colors[row : row + SKIN_ROWS] for row in range(self.height))
        return next(row for row, run in enumerate(runs) if len(set(run)) == 1)

    @property
    def packed(self) -> np.ndarray:
        """The pictures with four rows in a word, the first one lowest, `[words, pictures]`."""
        below = PACKED_ROWS - self.height
        padded = np.pad(self.pictures, ((0, 0), (0, below))).astype(np.uint32)
        rows = padded.reshape(len(padded), PICTURE_WORDS, ROWS_A_WORD)
        shifts = WIDE * np.arange(ROWS_A_WORD, dtype=np.uint32)
        return (rows << shifts).sum(-1, dtype=np.uint32).T
