"""Pictures of objects, with which VEM separates touching objects."""

from collections.abc import Sequence

import numpy as np

__all__ = ["PICTURE_WIDTH", "Picture", "check_pictures", "largest", "picture"]

# Maximum number of columns. `components.splitting` tests a picture in a word of 32 bits around the
# first pixel, which needs 2 * width - 1 columns.
PICTURE_WIDTH = 16

# Rows from the top, `PICTURE_WIDTH` bits each; the leftmost column is the highest bit.
Picture = tuple[int, ...]


def picture(ink: np.ndarray) -> Picture:
    """Make a picture from its pixels, 0 or 1 `[rows, width]`; ValueError beyond 16 columns."""
    if ink.ndim != 2 or ink.shape[1] > PICTURE_WIDTH:
        raise ValueError(
            f"a picture is [rows, width] of at most {PICTURE_WIDTH} columns, got shape {ink.shape}"
        )
    return tuple(
        int("".join(map(str, row)).ljust(PICTURE_WIDTH, "0"), 2) for row in ink.astype(int).tolist()
    )


def largest(pictures: Sequence[Picture]) -> tuple[int, int]:
    """Maximum size of a component that may be a single picture, `PICTURE_WIDTH` wide."""
    return PICTURE_WIDTH, max(map(len, pictures))


def check_pictures(
    pictures: Sequence[Picture], sizes: Sequence[tuple[int, int]], gap: tuple[int, int]
) -> None:
    """Check the pictures of a rule, given the largest sizes of its shapes and its `gap`."""
    for rows in pictures:
        if (
            not rows
            or not (rows[0] and rows[-1])
            or not all(0 <= row < 1 << PICTURE_WIDTH for row in rows)
        ):
            raise ValueError(
                f"pictures must be rows of {PICTURE_WIDTH} bits, with pixels in the first and "
                f"the last one, got {rows}"
            )
    if pictures and (
        gap != (0, 0) or not any(np.all(np.less_equal(largest(pictures), size)) for size in sizes)
    ):
        raise ValueError(
            f"pictures need no gap, and a shape of up to {largest(pictures)} or more, "
            f"got {gap} and {list(sizes)}"
        )
