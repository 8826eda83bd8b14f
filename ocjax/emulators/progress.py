"""Progress bars."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn, track

from ocjax.emulators.pool import StartReport

SECONDS = 20.0  # from one line of progress to the next, if there is no terminal

_Item = TypeVar("_Item")


def progress(items: Sequence[_Item], action: str) -> Iterator[_Item]:
    """Yield the items, and show the progress.

    On a terminal this is a bar on the standard output. Otherwise it is a line on the standard error
    every `SECONDS`, so work that takes less shows nothing.

    Args:
        action: the activity, such as "changing Pong's RAM".
    """
    if sys.stdout is not None and not sys.stdout.closed and sys.stdout.isatty():
        yield from track(items, description=action, transient=True)
        return
    shown = time.monotonic()
    for i, item in enumerate(items):
        yield item
        if sys.stderr is not None and time.monotonic() >= shown + SECONDS:
            shown = time.monotonic()
            percent = 100 * (i + 1) // len(items)
            print(f"{action}: {percent} %", file=sys.stderr, flush=True)  # noqa: T201


@contextmanager
def progress_bar(
    action: str, unit: str, console: Console | None = None, *, transient: bool = False
) -> Iterator[Callable[..., None]]:
    """A progress bar that appears with the first report; a notebook shows none.

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
    console = console or Console()
    if console.is_jupyter:  # rich needs ipywidgets there, and warns without them
        yield lambda *_, **__: None
        return
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
