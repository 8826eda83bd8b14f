"""The record of a training: a CSV file and TensorBoard."""

import contextlib
import csv
import io
import os
import time
from collections import deque
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tensorboardX import summary
from tensorboardX.event_file_writer import EventsWriter
from tensorboardX.proto.event_pb2 import Event, SessionLog  # pyright: ignore

from ocjax.emulators.checks import integer

LARGEST = 1e15  # limit of numbers in a checkpoint
MOST_LINE = 10_000  # bytes; lines of `metrics.csv` have about 200
RECENT_GAMES = 100  # number of games in the reported mean return


class Metrics:
    """Metrics with one row per update; `add` writes it to the files at once.

    This thread writes the events: tensorboardX's own writer uses a thread, and after an error in it
    `add_scalar` waits forever.

    Args:
        folder: the folder of the training, for `metrics.csv` and `tensorboard/`.

    Attributes:
        rows: the number of rows.
        recent: the returns of the last games.
        seconds: the duration of the training so far.
        frames_per_second: the speed of the last update.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: EventsWriter | None = None
        self._names: list[str] = []  # of the columns
        self._frames = 0.0  # of the last row
        self.rows = 0
        self.recent: deque[float] = deque(maxlen=RECENT_GAMES)
        self.seconds = self.frames_per_second = 0.0

    @property
    def mean_return(self) -> float:
        """The mean return of the last games; nan before the end of the first game."""
        return float(np.mean(self.recent)) if self.recent else float("nan")

    def add(self, frames: int, seconds: float, games: list[float], **numbers: float) -> None:
        """Add the row of an update."""
        self.frames_per_second = (frames - self._frames) / seconds
        self.recent.extend(games)
        self.seconds += seconds
        self._frames = float(frames)
        row = {
            "frames": frames,
            "seconds": round(self.seconds, 3),
            "games": len(games),
            "return": round(self.mean_return, 3),
        }
        row |= {name: float(f"{value:.5g}") for name, value in numbers.items()}
        self._write_row(row)
        self._write_events(row)

    def _write_row(self, row: dict[str, Any]) -> None:
        """Append a row.

        The first row replaces the file: a run without a checkpoint may have left one.
        """
        first = self.rows == 0
        self._names = list(row) if first else self._names
        if list(row) != self._names:
            raise ValueError(
                f"{self._folder / 'metrics.csv'} must have the columns {', '.join(row)}, got "
                f"{', '.join(self._names)[:200]}"
            )
        text = io.StringIO()
        out = csv.writer(text, lineterminator="\n")
        out.writerows([row.keys()] * first + [row.values()])
        with (self._folder / "metrics.csv").open("wb" if first else "ab") as file:
            file.write(text.getvalue().encode())
        self.rows += 1

    def _write_events(self, row: dict[str, Any]) -> None:
        frames, now = row["frames"], time.time()
        if self._writer is None:
            (self._folder / "tensorboard").mkdir(exist_ok=True)
            self._writer = EventsWriter(str(self._folder / "tensorboard" / "events"))
            # TensorBoard then drops later events, which an earlier run wrote after its last
            # checkpoint.
            self._writer.write_event(
                Event(step=frames, session_log=SessionLog(status=SessionLog.START))
            )
        for name, value in row.items():
            if value == value:  # not nan
                self._writer.write_event(
                    Event(wall_time=now, step=frames, summary=summary.scalar(name, value))
                )
        self._writer.flush()

    def close(self) -> None:
        """Close TensorBoard's file. Events that `add` could not write are lost."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()

    def save(self) -> dict[str, Any]:
        """The values that `restore` needs besides the file, ready for JSON."""
        return {"seconds": self.seconds, "recent": list(self.recent), "rows": self.rows}

    def restore(self, saved: dict[str, Any], updates: int) -> None:
        """Continue after a checkpoint, and delete the later rows of the file.

        Args:
            saved: the result of `save`.
            updates: the number of updates, which equals the number of rows.
        """
        integer("the number of rows", saved["rows"], updates, updates)
        seconds, recent = saved["seconds"], saved["recent"]
        if not _are_numbers([seconds]) or seconds < 0:
            raise ValueError(
                f"the seconds of the training must be a number of at least 0, got {seconds!r}"
            )
        if not isinstance(recent, list) or len(recent) > RECENT_GAMES or not _are_numbers(recent):
            raise ValueError(
                f"the recent returns must be at most {RECENT_GAMES} finite numbers, got "
                f"{str(recent)[:200]}"
            )
        path = self._folder / "metrics.csv"
        kept = _read(path, updates)
        if kept.size < path.stat().st_size:
            os.truncate(path, kept.size)  # atomic, and works on a full disk
        self._names, self._frames, self.rows = kept.names, kept.frames, updates
        self.seconds = float(seconds)
        self.recent.extend(map(float, recent))


def _are_numbers(values: list[Any]) -> bool:
    return all(
        isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < LARGEST for v in values
    )


class _Kept(NamedTuple):
    names: list[str]  # of the columns
    frames: float  # of the last row
    size: int  # bytes


def _read(path: Path, count: int) -> _Kept:
    """Check the heading and the first rows of `metrics.csv`.

    A row only counts if its line ends with a newline.
    """
    with path.open("rb") as file:
        names, frames = _cells(file.readline(MOST_LINE)) or [], 0.0
        for i in range(count):
            row = _cells(file.readline(MOST_LINE))
            if row is None:
                raise ValueError(f"metrics.csv has {i:,} rows, but the checkpoint needs {count:,}")
            if len(set(names)) < len(names) or not {"frames", "return"} <= set(names):
                raise ValueError(f"metrics.csv has the columns {', '.join(names)[:200]}")
            if len(row) != len(names):
                raise ValueError(
                    f"row {i + 1} of metrics.csv and its heading differ in the number of columns"
                )
            frames = dict(zip(names, map(float, row), strict=True))["frames"]
        return _Kept(names, frames, file.tell())


def _cells(line: bytes) -> list[str] | None:
    return line.decode("utf-8").removesuffix("\n").split(",") if line.endswith(b"\n") else None
