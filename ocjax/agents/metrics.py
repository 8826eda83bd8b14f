"""The record of a training: a CSV file, TensorBoard and a progress bar."""

import csv
import io
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from tensorboardX import SummaryWriter

from ocjax.files import writing

RECENT_GAMES = 100  # of which the mean return is reported


class Metrics:
    """One row per update. The file is written before every checkpoint; `restore` drops rows that are later than the checkpoint.

    Args:
        folder: of the training; gets `metrics.csv` and `tensorboard/`.

    Attributes:
        recent: the returns of the last games.
        seconds: of training so far.
        frames_per_second: of the last update.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._writer = folder, None
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
        if self._writer is None:
            self._writer = SummaryWriter(str(self._folder / "tensorboard"), purge_step=frames)
        for name, value in self.rows[-1].items():
            if value == value:  # not nan
                self._writer.add_scalar(name, value, frames)

    def write(self) -> None:
        """Write `metrics.csv`."""
        if not self.rows:
            return
        text = io.StringIO()
        out = csv.DictWriter(text, list(self.rows[0]), lineterminator="\n")
        out.writeheader()
        out.writerows(self.rows)
        writing.write_text(self._folder / "metrics.csv", text.getvalue())
        if self._writer is not None:
            self._writer.flush()

    def close(self) -> None:
        """Close TensorBoard's file."""
        if self._writer is not None:
            self._writer.close()

    def save(self) -> dict[str, Any]:
        """What `restore` needs besides the file, ready for JSON."""
        return {"seconds": self.seconds, "recent": list(self.recent), "rows": len(self.rows)}

    def restore(self, saved: dict[str, Any]) -> None:
        """Continue after a checkpoint.

        Raises:
            ValueError: the file lacks rows.
        """
        self.seconds = float(saved["seconds"])
        self.recent.extend(saved["recent"])
        with (self._folder / "metrics.csv").open() as file:
            self.rows = [dict(row) for row in csv.DictReader(file)][: int(saved["rows"])]
        if len(self.rows) < saved["rows"]:
            raise ValueError(f"metrics.csv has {len(self.rows):,} rows, the checkpoint is of row {saved['rows']:,}")


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
