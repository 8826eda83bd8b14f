"""Masks of objects as run lengths, as COCO's annotations store them."""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ocjax._files import npz
from ocjax._xla.batches import by_chunks
from ocjax.extraction.objects import Objects
from ocjax.files import writing
from ocjax.transforms.segmentation import NOBODY, segment

CHUNK = 64  # frames whose owners are computed at a time
_NO_SLOT = NOBODY - 1
_DTYPES = {"counts": np.dtype(np.int32), "ends": np.dtype(np.int64)}


@dataclasses.dataclass(frozen=True)
class RunLengths:
    """The masks of m objects.

    Args:
        counts: int32 `[k]`, the run lengths of one mask after the other. Those of a mask alternate
            between pixels outside and inside of it, column by column, from a run outside, which may
            be empty.
        ends: int64 `[m]`, the end of each mask's run lengths in `counts`.
    """

    counts: np.ndarray
    ends: np.ndarray

    def __iter__(self) -> Iterator[list[int]]:
        """The run lengths of each mask."""
        for counts in np.split(self.counts, self.ends[:-1]) if len(self.ends) else []:
            yield counts.tolist()

    def write(self, path: Path) -> None:
        """Write an .npz file, completely or not at all."""
        writing.write(path, lambda file: np.savez(file, **vars(self)), follow=False)

    @classmethod
    def read(cls, path: Path, count: int, pixels: int) -> "RunLengths":
        """Read a file of `count` masks of `pixels` pixels each."""
        try:
            _check_headers(npz.headers(path, _DTYPES.__contains__), count, pixels)
            found = cls(**npz.read(path, _DTYPES.__contains__))
            _check_sums(found, pixels)
        except ValueError as error:
            raise ValueError(
                f"{path} is damaged: {error}. Delete the folder {path.parent}, and extract again"
            ) from error
        return found


def annotation(counts: list[int], size: tuple[int, int]) -> dict[str, Any]:
    """The fields "area" and "segmentation" of a mask in COCO's format.

    Args:
        counts: the run lengths of the mask.
        size: height and width of the frame.
    """
    return {"area": sum(counts[1::2]), "segmentation": {"size": [*size], "counts": counts}}


def of_objects(objects: Objects, frames: np.ndarray) -> RunLengths:
    """The masks of a batch's valid objects, in the order of rows and slots.

    Args:
        objects: of batch shape `[n]`, NumPy arrays.
        frames: the frames that show them, uint8 `[n, H, 160]` or `[n, H, 160, 3]`.
    """

    def owners(index: np.ndarray) -> jax.Array:
        chosen = jax.tree.map(lambda field: field[index], objects)
        return segment(chosen, frames[index])

    parts = []
    for start in range(0, len(frames), CHUNK):
        rows = np.arange(start, min(start + CHUNK, len(frames)))
        parts.append(_of_owners(by_chunks(owners, rows, CHUNK), np.asarray(objects.valid[rows])))
    starts = np.cumsum([0, *(len(part.counts) for part in parts)])
    ends = [start + part.ends for start, part in zip(starts[:-1], parts, strict=True)]
    return RunLengths(np.concatenate([part.counts for part in parts]), np.concatenate(ends))


def _of_owners(owners: np.ndarray, valid: np.ndarray) -> RunLengths:
    """The masks of slots `valid`, bool `[n, N]`, from owners int16 `[n, H, W]`."""
    n, height, width = owners.shape
    pixels, count = height * width, int(valid.sum())
    by_column = owners.swapaxes(1, 2).reshape(n, pixels)
    starts = np.flatnonzero(np.diff(by_column, axis=1, prepend=np.int16(_NO_SLOT)))
    ends = np.append(starts[1:], by_column.size)
    slots = by_column.ravel()[starts]
    starts, ends, slots = (a[slots != NOBODY] for a in (starts, ends, slots))
    row = starts // pixels
    numbers = np.cumsum(valid.ravel()).reshape(valid.shape) - 1  # of the valid objects
    mask = numbers[row, slots]
    # A mask's run lengths lie between the boundaries of its runs, and the end of the frame.
    last = (np.arange(count) + 1) * (pixels + 1) - 1
    moved = mask * (pixels + 1) - row * pixels
    boundaries = np.unique(np.concatenate([starts + moved, ends + moved, last]))
    mask, boundary = np.divmod(boundaries, pixels + 1)
    is_first = np.diff(mask, prepend=-1) > 0
    counts = boundary - np.where(is_first, 0, np.roll(boundary, 1))
    return RunLengths(counts.astype(np.int32), np.cumsum(np.bincount(mask, minlength=count)))


def _check_headers(found: Mapping[str, npz.Header], count: int, pixels: int) -> None:
    """Check the arrays of a file before they are read."""
    forms = {name: (header.dtype, len(header.shape)) for name, header in found.items()}
    if forms != {name: (dtype, 1) for name, dtype in _DTYPES.items()}:
        raise ValueError(f"expected the arrays {', '.join(_DTYPES)}, got {', '.join(found)[:200]}")
    if found["ends"].shape != (count,) or found["counts"].shape > (count * (pixels + 1),):
        raise ValueError(f"it does not have {count:,} masks of {pixels:,} pixels")


def _check_sums(found: RunLengths, pixels: int) -> None:
    """Check that each mask has all pixels."""
    lengths = np.diff(found.ends, prepend=0)
    ends = np.concatenate([[0], np.cumsum(found.counts, dtype=np.int64)])
    total = found.ends[-1] if len(found.ends) else 0
    if (lengths <= 0).any() or total != len(found.counts) or (found.counts < 0).any():
        raise ValueError("its run lengths are not those of masks")
    if (np.diff(ends[found.ends], prepend=0) != pixels).any():
        raise ValueError(f"a mask does not have {pixels:,} pixels")
