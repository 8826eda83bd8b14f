"""Trials of Atari-HEAD (Zhang et al., 2020), and the objects that the players look at.

A trial is a folder of PNG frames and a text file. After a header, the file has one line per frame:
`frame_id` (the picture's name), `episode_id`, `score`, `duration(ms)`, `unclipped_reward`,
`action`, and the gaze positions `x0, y0, x1, y1, ...` in pixels of the frame. Unknown values are
"null". The dataset is at https://zenodo.org/records/3451402.
"""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console import palette
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files.jobs import Report, silent
from ocjax.files.pictures import PictureFolder
from ocjax.files.rows import InputError

__all__ = ["Look", "TrialFrame", "looks", "object_at", "read_trial"]

# Gaze within this many pixels of a box is on the object: eye trackers err by half a degree.
RADIUS = 6.0
_BATCH = 256  # frames per call of VEM
_COLUMNS = (
    "frame_id",
    "episode_id",
    "score",
    "duration(ms)",
    "unclipped_reward",
    "action",
    "gaze_positions",
)
_UNKNOWN = "null"


@dataclasses.dataclass(frozen=True)
class TrialFrame:
    """A line of a trial's file.

    Args:
        frame_id: the name of the picture.
        episode, score, duration, reward, action: numbers, or None for "null". The duration is in
            milliseconds, and the action is ALE's number.
        gaze: float `[K, 2]`, the successive positions x and y in pixels.
    """

    frame_id: str
    episode: int | None
    score: int | None
    duration: int | None
    reward: int | None
    action: int | None
    gaze: np.ndarray


@dataclasses.dataclass(frozen=True)
class Look:
    """The object that a person looks at on a frame.

    Args:
        objects: VEM's objects of the frame.
        slot: the object with most gaze positions, among all slots of the game. None if most
            positions are on no object.
        category, index: the object's category, and its slot in the category.
        share: the fraction of the gaze positions on the object.
    """

    frame: TrialFrame
    objects: Objects
    slot: int | None
    category: str | None
    index: int | None
    share: float


def read_trial(path: str | Path) -> list[TrialFrame]:
    """Read the text file of a trial.

    Raises:
        InputError: a ValueError; the file has another layout.
    """
    if Path(path).exists() and not Path(path).is_file():
        raise InputError(f"{path} is not a regular file")
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file in UTF-8: {error}") from error
    header = tuple(name.strip() for name in lines[0].split(",")) if lines else ()
    if header != _COLUMNS:
        raise InputError(
            f"{path}: the first line of a trial of Atari-HEAD is {','.join(_COLUMNS)!r}, got "
            f"{','.join(header)!r}"
        )
    return [
        _frame(f"{path}, line {k}", line.split(","))
        for k, line in enumerate(lines[1:], 2)
        if line.strip()
    ]


def _frame(where: str, cells: list[str]) -> TrialFrame:
    cells = [cell.strip() for cell in cells]
    gaze = [] if cells[6:] in ([], [""], [_UNKNOWN]) else cells[6:]
    if len(cells) < 6 or len(gaze) % 2:
        raise InputError(
            f"{where}: expected six columns and pairs of gaze positions, got {len(cells)} columns"
        )
    try:
        episode, score, duration, reward, action = (
            None if cell == _UNKNOWN else int(float(cell)) for cell in cells[1:6]
        )
        positions = np.array(gaze, float).reshape(-1, 2)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{where}: {error}") from error
    return TrialFrame(cells[0], episode, score, duration, reward, action, positions)


def looks(
    game: Game,
    trial: str | Path,
    frames: str | Path,
    report: Report = silent,
) -> Iterator[Look]:
    """Yield the object that a person looks at on each frame.

    Args:
        trial: the text file.
        frames: the folder of the pictures.
        report: called with the numbers of finished and of all frames.

    Yields:
        A `Look` for each line of the file whose picture is in the folder.

    Raises:
        InputError: the file has another layout, or no picture has the name of a line.
        ValueError: a picture has colours that the emulator never draws.
    """
    folder = PictureFolder(Path(frames))
    row_of = {folder.stem(i): i for i in range(folder.rows)}
    chosen = [frame for frame in read_trial(trial) if frame.frame_id in row_of]
    if not chosen:
        raise InputError(f"no picture in {frames} is named by a frame_id of {trial}")
    for start in range(0, len(chosen), _BATCH):
        part = chosen[start : start + _BATCH]
        rgb = np.stack([folder.read(row_of[f.frame_id], row_of[f.frame_id] + 1)[0] for f in part])
        palette.check_rgb(rgb)
        objects = jax.tree.map(np.asarray, game.vem(jnp.asarray(rgb)))
        yield from (_look(game, frame, objects[k]) for k, frame in enumerate(part))
        report(start + len(part), len(chosen))


def _look(game: Game, frame: TrialFrame, objects: Objects) -> Look:
    slots = np.array([object_at(objects, x, y) for x, y in frame.gaze], int)
    if not len(slots):
        return Look(frame, objects, None, None, None, 0.0)
    values, counts = np.unique(slots, return_counts=True)
    slot, share = int(values[counts.argmax()]), float(counts.max() / len(slots))
    if slot < 0:
        return Look(frame, objects, None, None, None, share)
    category = game.categories[game.slot_category[slot]].name
    return Look(frame, objects, slot, category, slot - game.slices[category].start, share)


def object_at(objects: Objects, x: float, y: float, radius: float = RADIUS) -> int:
    """The slot of the object at a point; -1 if no box is within the radius.

    The smallest box that contains the point wins, or else the nearest box.

    Args:
        objects: of one state.
        x, y, radius: in pixels.
    """
    left, top, w, h = np.asarray(objects.xywh, float).T
    across = np.maximum(np.maximum(left - x, x - (left + w)), 0)
    down = np.maximum(np.maximum(top - y, y - (top + h)), 0)
    distance = np.where(np.asarray(objects.valid), np.hypot(across, down), np.inf)
    if not len(distance) or distance.min() > radius:
        return -1
    return int(np.lexsort((w * h, distance))[0])
