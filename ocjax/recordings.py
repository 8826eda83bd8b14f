"""Recordings of play in `.npz` files."""

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._files import npz
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.game import Game
from ocjax.extraction.registry import UnknownGameError, load
from ocjax.files import writing

__all__ = ["ARRAYS", "Recording", "RecordingError", "join", "read"]

ARRAYS = (
    "rams",
    "screens",
    "previous",
    "shown",
    "previous_shown",
    "drawn",
    "rewards",
    "lives",
    "resets",
    "ends",
)
_NUMBERS = {"rewards": "if", "lives": "iu"}  # kinds of dtype; the other arrays are uint8 or bool
_BOOLS = ("resets", "ends")
# Arrays that are stored as exclusive or with another one: nearly all zero, a tenth of the size.
_XOR = {
    "previous": "screens",
    "previous_shown": "shown",
}
_FACTS = ("game", "md5", "frame_skip", "settings")


class RecordingError(ValueError):
    """A file is not a readable recording, or belongs to another game."""


@dataclasses.dataclass(frozen=True)
class Recording:
    """The RAM of `n` samples of one game, and optional arrays, None if they were not recorded.

    Args:
        game: the game.
        rams: uint8 `[n, 128]`.
        screens: uint8 `[n, H, 160]` of palette indices or `[n, H, 160, 3]` of RGB, the last
            emulated frame.
        previous: the previous emulated frame, like `screens`.
        shown: uint8 `[n, H, 160]`, the TIA's visible graphics object at each pixel (1 and 4
            players, 2 and 8 missiles, 16 ball, 32 playfield, 0 none).
        previous_shown: the same on the previous frame.
        drawn: bool `[n, H, 160]`, the pixels with a visible graphics object on the frame or the
            previous one; excerpts have it instead of `shown`.
        rewards: `[n]`, sum of rewards since the start of the episode.
        lives: int `[n]`, the emulator's lives.
        resets: bool `[n]`, first sample of an episode.
        ends: bool `[n]`, last sample of an episode that was terminated or truncated.
        frame_skip: emulated frames between successive samples of an episode, or None if the samples
            are not successive.
        settings: the fields of the environments' `ocjax.envs.Settings`.
    """

    game: Game
    rams: np.ndarray
    screens: np.ndarray | None = None
    previous: np.ndarray | None = None
    shown: np.ndarray | None = None
    previous_shown: np.ndarray | None = None
    drawn: np.ndarray | None = None
    rewards: np.ndarray | None = None
    lives: np.ndarray | None = None
    resets: np.ndarray | None = None
    ends: np.ndarray | None = None
    frame_skip: int | None = None
    settings: Mapping[str, Any] | None = None

    def __len__(self) -> int:
        return len(self.rams)

    @property
    def episode(self) -> np.ndarray:
        """Number of each sample's episode, int `[n]`."""
        return np.zeros(len(self), int) if self.resets is None else np.cumsum(self.resets)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """The recorded arrays, by name."""
        return {name: array for name in ARRAYS if (array := getattr(self, name)) is not None}

    def write(self, path: str | Path) -> None:
        """Write an .npz file for `read`. If writing fails, an existing file stays unchanged.

        Raises:
            OSError: the file cannot be written.
        """
        arrays = self.arrays
        for name, other in _XOR.items():
            if name in arrays:
                arrays[name] = arrays[other] ^ arrays[name]
        if "drawn" in arrays:
            arrays["drawn"] = np.packbits(arrays["drawn"], axis=-1)
        facts: dict[str, Any] = {"game": self.game.name, "md5": self.game.md5}
        if self.frame_skip is not None:
            facts["frame_skip"] = self.frame_skip
        if self.settings is not None:
            facts["settings"] = json.dumps(dict(self.settings))
        writing.write(Path(path), lambda file: np.savez_compressed(file, **arrays, **facts))


def join(parts: Sequence[Recording]) -> Recording:
    """Concatenate recordings of one game; the result has the arrays that all of them have."""
    if len(parts) == 1:
        return parts[0]
    joined: dict[str, Any] = {
        name: np.concatenate([p.arrays[name] for p in parts])
        for name in ARRAYS
        if all(name in p.arrays for p in parts)
    }
    if "resets" in joined:
        joined["resets"][np.cumsum([0, *map(len, parts[:-1])])] = True
    skips = {p.frame_skip for p in parts}
    same_settings = all(p.settings == parts[0].settings for p in parts)
    return Recording(
        parts[0].game,
        **joined,
        frame_skip=skips.pop() if len(skips) == 1 else None,
        settings=parts[0].settings if same_settings else None,
    )


def read(path: str | Path, game: str | None = None) -> Recording:
    """Read a recording.

    Args:
        path: an .npz file with `rams` and any of the other arrays of `Recording`. `previous` and
            `previous_shown` are stored as their exclusive or with `screens` and `shown`, `drawn` as
            bits packed along rows, and `settings` as JSON. The file may also contain the name of
            the `game` and the `md5` of the ROM.
        game: the game's name; only needed if the file's contents and its name (`Pong.npz`) do not
            give it.

    Raises:
        FileNotFoundError: the file does not exist.
        RecordingError: the file is unreadable, lacks an array, has an array of the wrong dtype or
            shape, or was made with another ROM; a ValueError.
        UnknownGameError: the game is unknown; a ValueError.
    """
    path = Path(path)
    facts = _facts(path)
    found = _game_of(path, facts, game)
    arrays = _arrays(path, found)
    for name, other in _XOR.items():
        if name in arrays:
            if other not in arrays or arrays[other].shape != arrays[name].shape:
                raise RecordingError(
                    f"{path}: {name} is stored as exclusive or with {other}, which must exist "
                    "and have the same shape"
                )
            arrays[name] = arrays[other] ^ arrays[name]
    if "drawn" in arrays:
        arrays["drawn"] = np.unpackbits(arrays["drawn"], axis=-1, count=found.screen[1]).astype(
            bool
        )
    return Recording(
        found, **arrays, frame_skip=_frame_skip(path, facts), settings=_settings(path, facts)
    )


def _facts(path: Path) -> dict[str, np.ndarray]:
    if not path.exists():
        raise FileNotFoundError(f"no recording {path}")
    with _damage_named(path):
        for name, header in npz.headers(path, _FACTS.__contains__).items():
            if header.shape != ():
                raise RecordingError(
                    f"{path}: {name} must be a single value, got {header.dtype} "
                    f"{list(header.shape)}"
                )
        return npz.read(path, _FACTS.__contains__)


def _arrays(path: Path, game: Game) -> dict[str, np.ndarray]:
    """The stored arrays of a file, whose dtypes and shapes are checked before reading."""
    with _damage_named(path):
        headers = npz.headers(path, ARRAYS.__contains__)
        if "rams" not in headers:
            raise RecordingError(f"{path} has no array 'rams' (uint8 [n, {RAM_SIZE}])")
        for name, header in headers.items():
            _check_array(path, name, header, _shapes(name, (*headers["rams"].shape, 0)[0], game))
        stored = npz.read(path, ARRAYS.__contains__)
    return {name: stored[name] for name in ARRAYS if name in stored}


@contextlib.contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except npz.NpzError as error:
        raise RecordingError(f"{path} is not a readable .npz recording: {error}") from error


def _frame_skip(path: Path, facts: Mapping[str, np.ndarray]) -> int | None:
    skip = facts.get("frame_skip")
    if skip is not None and not (skip.dtype.kind in "iu" and skip >= 1):
        raise RecordingError(
            f"{path}: frame_skip must be a number of at least 1, got {skip.dtype} {skip}"
        )
    return None if skip is None else int(skip)


def _settings(path: Path, facts: Mapping[str, np.ndarray]) -> dict[str, Any] | None:
    if "settings" not in facts:
        return None
    settings = npz.json_object(facts["settings"])
    if settings is None:
        raise RecordingError(
            f"{path}: settings must be a JSON object, got {str(facts['settings'])[:200]!r}"
        )
    return settings


def _game_of(path: Path, facts: Mapping[str, np.ndarray], name: str | None) -> Game:
    try:
        game = load(str(facts["game"]) if "game" in facts else name or path.stem)
    except UnknownGameError as error:
        if "game" not in facts:
            raise
        raise RecordingError(f"{path} is a recording of another program: {error}") from error
    if name is not None and load(name) is not game:
        raise RecordingError(f"{path} is a recording of {game.name}, not of {load(name).name}")
    if "md5" in facts and str(facts["md5"]) != game.md5:
        raise RecordingError(
            f"{path} was made with the ROM of md5 {facts['md5']}, but the decoder of {game.name} "
            f"is for {game.md5}"
        )
    return game


def _shapes(name: str, n: int, game: Game) -> list[tuple[int, ...]]:
    height, width = game.screen
    if name in ("screens", "previous"):
        return [(n, height, width), (n, height, width, 3)]
    shapes = {"rams": (n, RAM_SIZE), "drawn": (n, height, -(-width // 8))} | dict.fromkeys(
        ("shown", "previous_shown"), (n, height, width)
    )
    return [shapes.get(name, (n,))]


def _check_array(
    path: Path, name: str, array: npz.Header, shapes: Sequence[tuple[int, ...]]
) -> None:
    if name in _NUMBERS:
        fits, expected = array.dtype.kind in _NUMBERS[name], "numbers"
    elif name in _BOOLS:
        fits, expected = array.dtype == np.bool_, "bool"
    else:
        fits, expected = array.dtype == np.uint8, "uint8"
    if not fits or array.shape not in shapes:
        allowed = " or ".join(str(list(shape)) for shape in shapes)
        raise RecordingError(
            f"{path}: {name} must be {expected} {allowed}, got {array.dtype} {list(array.shape)}"
        )
