"""Progress bars."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ocjax.emulators.pool import StartReport


@contextmanager
def progress_bar(
    action: str, unit: str, console: Console | None = None, *, transient: bool = False
) -> Iterator[Callable[..., None]]:
    """A progress bar that appears with the first report.

    Args:
        action: the activity, such as "extracting".
        unit: the unit of the count, such as "rows". It may contain further numbers of the reports,
            in rich's format: "games, {task.fields[frames]:,} frames".
        console: shows the bar; by default the standard output.
        transient: whether the bar disappears at its end.

    Yields:
        A function to call with the numbers of finished and of all units, and with further numbers
        by name.
    """
    columns = (
        TextColumn(action),
        BarColumn(),
        TextColumn(f"{{task.completed:,}} of {{task.total:,}} {unit}"),
        TimeRemainingColumn(),
    )
    with ExitStack() as shown:
        progress = Progress(*columns, console=console, transient=transient)
        task = progress.add_task("", total=0)

        def report(done: int, total: int, **numbers: Any) -> None:
            progress.update(task, completed=done, total=total, **numbers)
            if not progress.live.is_started:
                shown.enter_context(progress)

        yield report


@contextmanager
def start_bar(num_envs: int) -> Iterator[StartReport | None]:
    """A callback for `EmulatorPool.reset` that shows the number of started emulators.

    It is None if stderr is not a terminal.
    """
    if sys.stderr is None or sys.stderr.closed or not sys.stderr.isatty():
        yield None
        return
    with progress_bar("starting", "emulators", Console(stderr=True), transient=True) as report:
        yield lambda started: report(started, num_envs)
