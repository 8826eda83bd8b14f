"""Recordings of play: files in and out."""

import dataclasses
import json
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax.ram import RAM_SIZE
from ocjax.registry import load
from ocjax.spec import Game

ARRAYS = {"rams": "u1", "screens": "u1", "previous": "u1", "shown": "u1", "previous_shown": "u1", "rewards": "if", "lives": "iu",
          "resets": "b"}  # fmt: skip
FACTS = ("game", "md5", "frame_skip", "protocol")


class RecordingError(ValueError):
    """A file that is not a recording, or is one of another game; the message says what is wrong with it."""


@dataclasses.dataclass(frozen=True)
class Recording:
    """RAM of `n` samples of one game, and what else was recorded with it."""

    game: Game
    rams: np.ndarray  # uint8 [n, 128]
    screens: np.ndarray | None = None  # uint8 [n, H, 160] of palette indices, or [n, H, 160, 3] of RGB
    previous: np.ndarray | None = None  # the emulated frame just before each, as screens
    shown: np.ndarray | None = (
        None  # uint8 [n, H, 160]: the graphics object that shows at a pixel (1, 4 players, 2, 8 missiles, 16 ball, 32 playfield)
    )
    previous_shown: np.ndarray | None = None  # the same of the frame before
    rewards: np.ndarray | None = None  # [n]: sum since the episode began
    lives: np.ndarray | None = None  # int [n]
    resets: np.ndarray | None = None  # bool [n]: first sample of an episode
    frame_skip: int | None = None  # emulated frames from a sample to the next of its episode; None: samples do not follow on each other
    protocol: Mapping[str, Any] | None = None  # how the environments were stepped, as `ocjax.envs.Settings.to_dict` gives it

    def __len__(self) -> int:
        return len(self.rams)

    @property
    def episode(self) -> np.ndarray:
        """Number of each sample's episode, int `[n]`."""
        return np.zeros(len(self), int) if self.resets is None else np.cumsum(self.resets)

    def write(self, path: str | Path) -> None:
        """Write an .npz file that `read` reads; a file of that name is replaced at once, or, if writing fails, left as it was."""
        arrays = {k: getattr(self, k) for k in ARRAYS if getattr(self, k) is not None}
        for latest, before in (("screens", "previous"), ("shown", "previous_shown")):
            if before in arrays:
                arrays[before] = arrays[latest] ^ arrays[before]  # nearly all zero: a tenth of the size
        facts: dict[str, Any] = {"game": self.game.name, "md5": self.game.md5}
        if self.frame_skip is not None:
            facts["frame_skip"] = self.frame_skip
        if self.protocol is not None:
            facts["protocol"] = json.dumps(dict(self.protocol))
        path = Path(path)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".npz", delete=False) as file:
            try:
                np.savez_compressed(file, **arrays, **facts)
            except BaseException:
                Path(file.name).unlink()
                raise
        Path(file.name).replace(path)


def join(parts: Sequence[Recording]) -> Recording:
    """Recordings of one game one after the other, with what all of them have."""
    if len(parts) == 1:
        return parts[0]

    def of(name: str) -> np.ndarray | None:
        arrays = [getattr(p, name) for p in parts]
        return None if any(a is None for a in arrays) else np.concatenate(arrays)

    joined: dict[str, Any] = {name: of(name) for name in ARRAYS}
    if joined["resets"] is not None:
        joined["resets"][np.cumsum([0, *map(len, parts[:-1])])] = True
    skips = {p.frame_skip for p in parts}
    same = all(p.protocol == parts[0].protocol for p in parts)
    return Recording(
        parts[0].game, **joined, frame_skip=skips.pop() if len(skips) == 1 else None, protocol=parts[0].protocol if same else None
    )


def read(path: str | Path, game: str | None = None) -> Recording:
    """Read a recording.

    Args:
        path: an .npz file with `rams` (uint8 `[n, 128]`) and, where they were kept, `screens` (uint8 `[n, H, 160]` of palette indices or
            `[n, H, 160, 3]` of RGB), `previous` (the frame before each, as exclusive or with `screens`), `shown` and `previous_shown` (the
            same for what the video chip drew), `rewards`, `lives`, `resets`, `frame_skip` and `protocol` (as JSON; see `Recording`). It may
            name its `game` and the `md5` of its ROM.
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
            arrays = {k: file[k] for k in (*ARRAYS, *FACTS) if k in file}
    except (OSError, ValueError, zipfile.BadZipFile, AttributeError, EOFError) as error:
        raise RecordingError(f"{path} is not a readable .npz recording: {error}") from error
    facts = {k: arrays.pop(k) for k in FACTS if k in arrays}
    found = load(str(facts["game"]) if "game" in facts else game or path.stem)
    if game is not None and load(game) is not found:
        raise RecordingError(f"{path} is a recording of {found.name}, not of {load(game).name}")
    if "md5" in facts and str(facts["md5"]) != found.md5:
        raise RecordingError(f"{path} was made with the ROM of md5 {facts['md5']}; the decoder of {found.name} is for {found.md5}")
    if "rams" not in arrays:
        raise RecordingError(f"{path} has no array 'rams' (uint8 [n, {RAM_SIZE}])")
    n = len(arrays["rams"])
    pixels = [(n, *found.screen), (n, *found.screen, 3)]
    shapes = {"rams": [(n, RAM_SIZE)], "screens": pixels, "previous": pixels, "shown": pixels[:1], "previous_shown": pixels[:1]}
    for name, array in arrays.items():
        kinds, allowed = ARRAYS[name], shapes.get(name, [(n,)])
        right = array.dtype == np.uint8 if kinds == "u1" else array.dtype.kind in kinds
        if not right or array.shape not in allowed:
            kind = {"u1": "uint8", "b": "bool"}.get(kinds, "numbers")
            wanted = " or ".join(str(list(s)) for s in allowed)
            raise RecordingError(f"{path}: {name} must be {kind} {wanted}, is {array.dtype} {list(array.shape)}")
    for latest, before in (("screens", "previous"), ("shown", "previous_shown")):
        if before in arrays:
            if latest not in arrays or arrays[latest].shape != arrays[before].shape:
                raise RecordingError(f"{path}: {before} is kept as exclusive or with {latest}, which must have the same shape")
            arrays[before] = arrays[latest] ^ arrays[before]
    skip = int(facts["frame_skip"]) if "frame_skip" in facts else None
    try:
        protocol = json.loads(str(facts["protocol"])) if "protocol" in facts else None
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: protocol must be JSON, is {facts['protocol']!r}") from error
    return Recording(found, **arrays, frame_skip=skip, protocol=protocol)
