"""Inputs: rows of RAM or frames in NumPy, HDF5, Zarr, Parquet, Arrow and Minari data, and in folders of PNG pictures or Arrow files.

All of them are read in blocks of rows, so that files may be larger than the memory. The libraries that read a format are imported when a
file of that format is opened (extra `data`).
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._extras import MissingExtraError, require
from ocjax.files import arrays, tables
from ocjax.files.rows import Input, InputError, choose, facts_in

MINARI = "minari:"  # what the name of a Minari dataset begins with


def minari_id(name: str) -> str:
    """The ID of a Minari dataset.

    Args:
        name: the ID after "minari:".

    Raises:
        InputError: the ID is malformed.
        MissingExtraError: minari is not installed.
    """
    identifier = name.removeprefix(MINARI)
    parse = require("minari.dataset.minari_dataset").parse_dataset_id
    try:
        parse(identifier)
    except (TypeError, ValueError) as error:  # TypeError: there is no version
        rule = "letters, digits, - and _; a namespace has at least two characters"
        raise InputError(f"a Minari ID has the form namespace/name-v0, got {identifier!r} ({rule})") from error
    return identifier


class _Minari(tables.RowBlocks):
    """The observations of a Minari dataset, of all episodes one after the other."""

    def __init__(self, name: str, wanted: str | None) -> None:
        identifier, self._wanted = minari_id(name), wanted
        try:
            self._dataset = require("minari").load_dataset(identifier)
        except FileNotFoundError as error:
            raise InputError(f"there is no Minari dataset {identifier} on this machine: `minari download {identifier}` gets it") from error
        spec = self._dataset.env_spec
        self.facts = facts_in(self._dataset.storage.metadata.get("ocjax", {} if spec is None else {"game": spec.id}))
        episodes = self._dataset.storage.get_episode_metadata(self._dataset.episode_indices)
        super().__init__(name, [e["total_steps"] + 1 for e in episodes])

    def _load(self, k: int) -> np.ndarray:
        observations: Any = self._dataset[k].observations
        if isinstance(observations, Mapping):
            observations = observations[choose(self.name, {key: np.shape(v) for key, v in observations.items()}, self._wanted)]
        return np.asarray(observations)


_OPENERS: Mapping[str, Callable[[Path, str | None], Input]] = {
    ".npy": arrays.open_npy,
    ".npz": arrays.open_npz,
    ".h5": arrays.open_hdf5,
    ".hdf5": arrays.open_hdf5,
    ".zarr": arrays.open_zarr,
    ".parquet": tables.open_parquet,
    ".arrow": tables.open_arrow,
    ".feather": tables.open_arrow,
}


@contextlib.contextmanager
def open_input(path: str | Path, array: str | None = None) -> Iterator[Input]:
    """Open RAM or frames.

    Args:
        path: an .npy, .npz, .h5, .hdf5, .parquet, .arrow or .feather file, a .zarr folder, a folder of .png pictures or of
            `datasets.save_to_disk`, or the ID of a Minari dataset after "minari:".
        array: name of the array, dataset or column; by default the first of rams, ram, screens, frames, observations and obs that holds RAM
            or frames.

    Raises:
        FileNotFoundError: there is no such file.
        InputError: a ValueError; the format is not supported, or the file is damaged or holds neither RAM nor frames.
        MissingExtraError: a ModuleNotFoundError; the format's library is not installed.
    """
    opened = _open(str(path), array)
    try:
        yield opened
    finally:
        opened.close()


def _open(name: str, array: str | None) -> Input:
    path = Path(name)
    if not name.startswith(MINARI) and not path.exists():
        raise FileNotFoundError(f"no input {path}")
    try:
        if name.startswith(MINARI):
            return _Minari(name, array)
        if path.suffix.lower() in _OPENERS:
            return _OPENERS[path.suffix.lower()](path, array)
        if any((path / name).exists() for name in tables.HUGGING_FACE):
            return tables.open_hugging_face(path, array)
        if path.is_dir():
            return tables.PictureFolder(path, array)
    except (InputError, MissingExtraError):
        raise
    except Exception as error:  # a damaged file can fail anywhere in the libraries
        raise InputError(f"{name} cannot be read: {type(error).__name__}: {error}") from error
    raise InputError(
        f"{name} is of no known format: give {', '.join(_OPENERS)}, a folder of .png pictures or of datasets.save_to_disk, or {MINARI}ID"
    )
