"""Recordings of play: files in."""

import dataclasses
import zipfile
from pathlib import Path

import numpy as np

from ocjax.ram import RAM_SIZE
from ocjax.registry import load
from ocjax.spec import Game


class RecordingError(ValueError):
    """A file that is not a recording, or is one of another game; the message says what is wrong with it."""


@dataclasses.dataclass(frozen=True)
class Recording:
    """RAM and frames of successive samples of one game."""

    game: Game
    rams: np.ndarray  # uint8 [n, 128]
    screens: np.ndarray | None  # uint8 [n, H, 160] of palette indices, or [n, H, 160, 3] of RGB


def read(path: str | Path, game: str | None = None) -> Recording:
    """Read a recording.

    Args:
        path: an .npz file with `rams` (uint8 `[n, 128]`) and, where frames were kept, `screens` (uint8 `[n, H, 160]` of palette indices or
            `[n, H, 160, 3]` of RGB). It may name its `game` and the `md5` of its ROM.
        game: its game, where neither its contents nor its name (`Pong.npz`) tell.

    Raises:
        FileNotFoundError: no such file.
        RecordingError: a ValueError; it cannot be read, lacks an array, has one of the wrong kind, or was made with another ROM.
        UnknownGameError: a ValueError; no such game.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"no recording {path}")
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {k: file[k] for k in ("rams", "screens", "game", "md5") if k in file}
    except (OSError, ValueError, zipfile.BadZipFile, AttributeError) as error:
        raise RecordingError(f"{path} is not a readable .npz recording: {error}") from error
    found = load(str(arrays["game"]) if "game" in arrays else game or path.stem)
    if game is not None and load(game) is not found:
        raise RecordingError(f"{path} is a recording of {found.name}, not of {load(game).name}")
    if "md5" in arrays and str(arrays["md5"]) != found.md5:
        raise RecordingError(f"{path} was made with the ROM of md5 {arrays['md5']}; the decoder of {found.name} is for {found.md5}")
    if "rams" not in arrays:
        raise RecordingError(f"{path} has no array 'rams' (uint8 [n, {RAM_SIZE}])")
    rams, screens = arrays["rams"], arrays.get("screens")
    if rams.dtype != np.uint8 or rams.ndim != 2 or rams.shape[1] != RAM_SIZE:
        raise RecordingError(f"{path}: rams must be uint8 [n, {RAM_SIZE}], is {rams.dtype} {list(rams.shape)}")
    sizes = [(len(rams), *found.screen), (len(rams), *found.screen, 3)]
    if screens is not None and (screens.dtype != np.uint8 or screens.shape not in sizes):
        raise RecordingError(f"{path}: screens must be uint8 {sizes[0]} or {sizes[1]}, is {screens.dtype} {screens.shape}")
    return Recording(found, rams, screens)
