"""The record of a training: a CSV file, TensorBoard and a progress bar."""

import contextlib
import csv
import io
import itertools
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from tensorboardX import summary
from tensorboardX.event_file_writer import EventsWriter
from tensorboardX.proto.event_pb2 import Event, SessionLog  # pyright: ignore[reportAttributeAccessIssue]

from ocjax.emulators.checks import integer
from ocjax.files import writing

LARGEST = 1e15  # of numbers in a checkpoint
RECENT_GAMES = 100  # of which the mean return is reported


class Metrics:
    """One row per update. The files are written before every checkpoint; `restore` drops rows that are later than the checkpoint.

    Events are written in this thread. tensorboardX's own writer has a thread: after an error in it, `add_scalar` waits for ever.

    Args:
        folder: of the training; gets `metrics.csv` and `tensorboard/`.

    Attributes:
        recent: the returns of the last games.
        seconds: of training so far.
        frames_per_second: of the last update.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: EventsWriter | None = None
        self._events: list[Event] = []  # not yet written
        self.rows: list[dict[str, Any]] = []
        self.recent: deque[float] = deque(maxlen=RECENT_GAMES)
        self.seconds = self.frames_per_second = 0.0

    @property
    def mean_return(self) -> float:
        """Of the last games; nan before the first game has ended."""
        return float(np.mean(self.recent)) if self.recent else float("nan")

    def add(self, frames: int, seconds: float, games: list[float], **numbers: float) -> None:
        """Add the row of an update.

        Args:
            frames: emulated frames so far.
            seconds: that the update and its rollout took.
            games: returns of the games that ended in its rollout.
            numbers: the other columns.
        """
        before = float(self.rows[-1]["frames"]) if self.rows else 0.0
        self.frames_per_second = (frames - before) / seconds
        self.recent.extend(games)
        self.seconds += seconds
        row = {"frames": frames, "seconds": round(self.seconds, 3), "games": len(games), "return": round(self.mean_return, 3)}
        self.rows.append(row | {name: float(f"{value:.5g}") for name, value in numbers.items()})
        known = {name: value for name, value in self.rows[-1].items() if value == value}  # not nan
        now = time.time()
        self._events += [Event(wall_time=now, step=frames, summary=summary.scalar(name, value)) for name, value in known.items()]

    def write(self) -> None:
        """Write `metrics.csv` and the latest events.

        Raises:
            OSError: a file cannot be written.
        """
        if not self.rows:
            return
        text = io.StringIO()
        out = csv.DictWriter(text, list(self.rows[0]), lineterminator="\n")
        out.writeheader()
        out.writerows(self.rows)
        writing.write_text(self._folder / "metrics.csv", text.getvalue())
        self._write_events()

    def _write_events(self) -> None:
        if not self._events:
            return
        if self._writer is None:
            (self._folder / "tensorboard").mkdir(exist_ok=True)
            self._writer = EventsWriter(str(self._folder / "tensorboard" / "events"))
            # TensorBoard drops events from this step on that an earlier run wrote after its latest checkpoint.
            session = SessionLog(status=SessionLog.START)
            self._writer.write_event(Event(step=self._events[0].step, session_log=session))
        for event in self._events:
            self._writer.write_event(event)
        self._writer.flush()
        self._events = []

    def close(self) -> None:
        """Close TensorBoard's file. Events that `write` could not write are lost."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()

    def save(self) -> dict[str, Any]:
        """What `restore` needs besides the file, ready for JSON."""
        return {"seconds": self.seconds, "recent": list(self.recent), "rows": len(self.rows)}

    def restore(self, saved: dict[str, Any], updates: int) -> None:
        """Continue after a checkpoint.

        Args:
            saved: by `save`.
            updates: the number of updates, and so of rows.

        Raises:
            ValueError: a number is out of range, or the file is damaged or lacks rows.
        """
        integer("the number of rows", saved["rows"], updates, updates)
        seconds, recent = saved["seconds"], saved["recent"]
        if not _are_numbers([seconds]) or seconds < 0:
            raise ValueError(f"the seconds of the training must be a number of at least 0, got {seconds!r}")
        if not isinstance(recent, list) or len(recent) > RECENT_GAMES or not _are_numbers(recent):
            raise ValueError(f"the recent returns must be at most {RECENT_GAMES} finite numbers, got {str(recent)[:200]}")
        self.rows = _read_rows(self._folder / "metrics.csv", updates)
        self.seconds = float(seconds)
        self.recent.extend(map(float, recent))


def _are_numbers(values: list[Any]) -> bool:
    return all(isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < LARGEST for v in values)


def _read_rows(path: Path, count: int) -> list[dict[str, Any]]:
    """The first rows of `metrics.csv`.

    Raises:
        ValueError: the file is damaged or lacks rows.
    """
    with path.open(encoding="utf-8") as file:
        reader = csv.DictReader(file)
        rows = [dict(row) for row in itertools.islice(reader, count)]
    if len(rows) < count:
        raise ValueError(f"metrics.csv has {len(rows):,} rows, the checkpoint is of row {count:,}")
    names = reader.fieldnames or []
    if len(set(names)) < len(names) or not {"frames", "return"} <= set(names):
        raise ValueError(f"metrics.csv has the columns {', '.join(names)[:200]}")
    for i, row in enumerate(rows):
        if set(row) != set(names) or None in row.values():
            raise ValueError(f"row {i + 1} of metrics.csv has another number of columns than its heading")
        for value in row.values():
            float(value)
    return rows


class Bar:
    """A progress bar with speed and mean return; use it in a `with` statement.

    Args:
        console: where it is shown.
        name: of the game.
        total: emulated frames.
    """

    def __init__(self, console: Console, name: str, total: int) -> None:
        columns = (
            TextColumn(f"training {name}"),
            BarColumn(),
            TextColumn(
                "{task.completed:,.0f} of {task.total:,.0f} frames, {task.fields[speed]:,.0f} a second, return {task.fields[mean]:,.1f}"
            ),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=console)
        self._task = self._progress.add_task("", total=total, speed=0.0, mean=float("nan"))

    def __enter__(self) -> "Bar":
        self._progress.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._progress.stop()

    def update(self, frames: int, speed: float, mean: float) -> None:
        """Show frames so far, frames per second, and the mean return of the last games."""
        self._progress.update(self._task, completed=frames, speed=speed, mean=mean)
