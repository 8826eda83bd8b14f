"""Blocks of extracted objects: the valid objects of consecutive rows, one entry each."""

import dataclasses
from pathlib import Path

import numpy as np

from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import no_objects
from ocjax.files import writing


@dataclasses.dataclass(frozen=True)
class Block:
    """The objects of some rows, in the order of rows and slots.

    Args:
        row: int64 `[m]`, the row of each object, from the first row of the block on.
        slot: int32 `[m]`, its slot in the game.
        xywh: int16 `[m, 4]`.
        orientation: int8 `[m]`.
        value: int32 `[m]`.
        rgb: uint8 `[m, 3]`.
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
    def read(cls, path: Path) -> "Block":
        """Read what `write` wrote."""
        with np.load(path) as arrays:
            return cls(**{field.name: arrays[field.name] for field in dataclasses.fields(cls)})

    def padded(self, rows: int, game: Game) -> dict[str, np.ndarray]:
        """The fields of `Objects` with all slots, `[rows, N, ...]`."""
        out = no_objects((rows,), game.num_slots)
        for name, array in out.items():
            array[self.row, self.slot] = True if name == "valid" else getattr(self, name)
        return out


def compact(objects: Objects) -> Block:
    """The block of a batch of objects, whose rows are numbered from 0 on."""
    row, slot = np.nonzero(np.asarray(objects.valid))
    fields = (np.asarray(a)[row, slot] for a in (objects.xywh, objects.orientation, objects.value, objects.rgb))
    return Block(row, slot.astype(np.int32), *fields)
