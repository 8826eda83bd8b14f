"""Blocks of extracted objects: the valid objects of consecutive rows."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ocjax._files import npz
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import no_objects
from ocjax.files import writing


@dataclasses.dataclass(frozen=True)
class Block:
    """The objects of some rows, in the order of rows and slots.

    Args:
        row: int64 `[m]`, the row of each object, relative to the block's first row.
        slot: int32 `[m]`, its slot in the game.
        xywh, orientation, value, rgb: see `Objects`, `[m, ...]`.
    """

    row: np.ndarray
    slot: np.ndarray
    xywh: np.ndarray
    orientation: np.ndarray
    value: np.ndarray
    rgb: np.ndarray

    def write(self, path: Path) -> None:
        """Write an .npz file, completely or not at all."""
        writing.write(path, lambda file: np.savez(file, **dataclasses.asdict(self)), follow=False)

    @classmethod
    def read(cls, path: Path, rows: int, game: Game) -> "Block":
        """Read a file that `write` wrote."""
        try:
            _check_headers(npz.headers(path, _FORMS.__contains__), rows * game.num_slots)
            block = cls(**npz.read(path, _FORMS.__contains__))
            for name, limit in (("row", rows), ("slot", game.num_slots)):
                numbers = getattr(block, name)
                if not ((numbers >= 0) & (numbers < limit)).all():
                    raise ValueError(f"a {name} is not in 0 to {limit - 1:,}")
        except ValueError as error:
            raise ValueError(
                f"{path} is damaged: {error}. Delete the folder {path.parent}, and extract again"
            ) from error
        return block

    def padded(self, rows: int, game: Game) -> dict[str, np.ndarray]:
        """The fields of `Objects` with all slots, `[rows, N, ...]`."""
        out = no_objects((rows,), game.num_slots)
        for name, array in out.items():
            array[self.row, self.slot] = True if name == "valid" else getattr(self, name)
        return out


# The dtype and the shape after the first axis of each array.
_FORMS: dict[str, tuple[type[np.generic], tuple[int, ...]]] = {
    "row": (np.int64, ()),
    "slot": (np.int32, ()),
    "xywh": (np.int16, (4,)),
    "orientation": (np.int8, ()),
    "value": (np.int32, ()),
    "rgb": (np.uint8, (3,)),
}


def _check_headers(found: Mapping[str, npz.Header], most: int) -> None:
    """Check the arrays of a block's file before they are read."""
    if found.keys() != _FORMS.keys():
        raise ValueError(f"expected the arrays {', '.join(_FORMS)}, got {', '.join(found)[:200]}")
    count = found["row"].shape[:1]
    if sum(count) > most:
        raise ValueError(f"it has {sum(count):,} objects, at most {most:,} are possible")
    for name, (dtype, tail) in _FORMS.items():
        own = found[name]
        if own.dtype != dtype or own.shape != (*count, *tail):
            raise ValueError(
                f"{name} must be {np.dtype(dtype)} {[*count, *tail]}, got {own.dtype} "
                f"{list(own.shape)}"
            )


def compact(objects: Objects) -> Block:
    """The block of a batch of objects. Its rows are numbered from 0."""
    row, slot = np.nonzero(np.asarray(objects.valid))
    fields = (
        np.asarray(a)[row, slot]
        for a in (objects.xywh, objects.orientation, objects.value, objects.rgb)
    )
    return Block(row, slot.astype(np.int32), *fields)
