"""Inputs: rows of RAM or frames in files, folders and datasets.

All inputs are read in blocks of rows, so files may be larger than the memory. The library for a
format is imported when a file of that format is opened (extra `data`).
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._extras import MissingExtraError, require
from ocjax.files import arrays, folders, jobs, pictures, tables
from ocjax.files.rows import Input, InputError, check_claim, choose, facts_in

MINARI = "minari:"  # prefix of a Minari dataset's name


def minari_id(name: str) -> str:
    """The ID of a Minari dataset, from a name with or without "minari:"."""
    identifier = name.removeprefix(MINARI)
    parse = require("minari.dataset.minari_dataset").parse_dataset_id
    try:
        parse(identifier)
    except (TypeError, ValueError) as error:  # TypeError: the version is missing
        rule = "letters, digits, - and _; a namespace has at least two characters"
        raise InputError(
            f"a Minari ID has the form namespace/name-v0, got {identifier!r} ({rule})"
        ) from error
    return identifier


def load_minari(identifier: str) -> tuple[Any, Path, list[Path]]:
    """Load a Minari dataset without importing or executing anything that its metadata names.

    Returns:
        The dataset, its folder, and the files in it.
    """
    minari, path = require("minari"), Path(require("minari.storage").get_dataset_path(identifier))
    if not (path / "data").is_dir():
        raise InputError(
            f"there is no Minari dataset {identifier} on this machine: `minari download "
            f"{identifier}` gets it"
        )
    contents = folders.contents(path)
    metadata = jobs.read(folders.inside(path / "data", "metadata.json"), error=InputError)
    lacking = [
        name
        for name in ("observation_space", "action_space")
        if not isinstance(metadata.get(name), str)
    ]
    if lacking:
        raise InputError(
            f"the metadata of {path} lack {' and '.join(lacking)}: add them with minari"
        )
    check_claim(str(path), metadata["total_episodes"], sum(contents.values()))
    for file in contents:
        if file.suffix == ".hdf5":
            arrays.check_hdf5(file)
        if file.suffix == ".arrow":
            tables.check_arrow(file)
    return minari.load_dataset(identifier), path, [*contents]


def _open_minari(name: str, wanted: str | None) -> Input:
    dataset, path, contents = load_minari(minari_id(name))
    is_image = require("minari.dataset.minari_storage").is_image_space
    if dataset.storage.jpeg_encoding and is_image(dataset.observation_space):
        raise InputError(
            f"{name} stores frames as JPEG, which changes colours: record RAM, or frames with "
            "jpeg_encoding=False"
        )
    if dataset.storage.FORMAT == "hdf5":
        opened = arrays.open_hdf5(path / "data" / "main_data.hdf5", wanted, "observations")
    else:
        opened = _episodes(name, path, dataset, wanted)
    spec = dataset.env_spec
    opened.facts = facts_in(
        dataset.storage.metadata.get("ocjax", {} if spec is None else {"game": spec.id})
    )
    opened.name, opened.reads = name, [path, *contents]
    return opened


def _episodes(name: str, path: Path, dataset: Any, wanted: str | None) -> Input:
    """The observations of a Minari dataset in Arrow or Parquet files, one episode in memory."""
    metadata = dataset.storage.get_episode_metadata(dataset.episode_indices)
    lengths = [int(episode["total_steps"]) + 1 for episode in metadata]
    if min(lengths, default=0) < 1:
        raise InputError(f"{name} has no episodes, or one with a negative number of steps")

    def load(key: str) -> arrays.Array:
        observations: Any = dataset[int(key)].observations
        if isinstance(observations, Mapping):
            shapes = {key: np.shape(v) for key, v in observations.items()}
            observations = observations[choose(name, shapes, wanted)[0]]
        array = np.asarray(observations)
        return arrays.Array(name, array, array.nbytes)

    first = load("0")
    tail = (*first.batch[1:], *first.row_shape)
    shapes = {str(k): (length, *tail) for k, length in enumerate(lengths)}
    return arrays.Episodes(path, list(shapes), shapes, load, {})


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
        path: an .npy, .npz, .h5, .hdf5, .parquet, .arrow or .feather file, a .zarr folder, a folder
            of pictures, of .parquet files or of `datasets.save_to_disk`, or the ID of a Minari
            dataset after "minari:".
        array: name of the array, dataset or column. By default, the first of rams, ram, screens,
            frames, observations and obs that holds RAM or frames.

    Raises:
        FileNotFoundError: the file does not exist.
        InputError: a ValueError; the format is not supported, the file is damaged, or it holds no
            RAM or frames.
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
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path} is a special file: give a regular file or a folder")
    try:
        if name.startswith(MINARI):
            return _open_minari(name, array)
        if path.suffix.lower() in _OPENERS and path.is_dir() == (path.suffix.lower() == ".zarr"):
            return _OPENERS[path.suffix.lower()](path, array)
        if any((path / name).exists() for name in tables.HUGGING_FACE):
            return tables.open_hugging_face(path, array)
        if (
            path.is_dir()
            and not folders.holds(path, pictures.FORMATS)
            and tables.parquet_files(path)
        ):
            return tables.open_parquet_folder(path, array)
        if path.is_dir():
            return pictures.PictureFolder(path)
    except (InputError, MissingExtraError):
        raise
    except Exception as error:  # a damaged file can fail anywhere in the libraries
        raise InputError(f"{name} cannot be read: {type(error).__name__}: {error}") from error
    raise InputError(
        f"{name} has no known format: give {', '.join(_OPENERS)}, "
        f"a folder of pictures, of .parquet files or of datasets.save_to_disk, or {MINARI}ID"
    )
