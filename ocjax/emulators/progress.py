"""Progress bars."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import ExitStack, contextmanager
from typing import Any, TextIO, TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn, track

from ocjax.emulators.pool import StartReport

SECONDS = 20.0  # from one line of progress to the next, if there is no terminal

_Item = TypeVar("_Item")


def _takes_bars(stream: TextIO | None) -> bool:
    """True on a terminal, except in notebooks, where rich needs ipywidgets for bars."""
    is_terminal = stream is not None and not stream.closed and stream.isatty()
    return is_terminal and not Console().is_jupyter


def progress(items: Iterable[_Item], action: str, total: int | None = None) -> Iterator[_Item]:
    """Yield the items, and show the progress.

    This is a bar on a terminal; otherwise, and in notebooks, a line on the standard error every
    `SECONDS`.

    Args:
        action: the activity, such as "changing Pong's RAM".
        total: the number of items, for iterables without a length.
    """
    total = len(items) if isinstance(items, Sized) else total
    assert total is not None
    if _takes_bars(sys.stdout):
        yield from track(items, description=action, total=total, transient=True)
        return
    shown = time.monotonic()
    for i, item in enumerate(items):
        yield item
        if sys.stderr is not None and time.monotonic() >= shown + SECONDS:
            shown = time.monotonic()
            percent = 100 * (i + 1) // total
            print(f"{action}: {percent} %", file=sys.stderr, flush=True)  # noqa: T201


@contextmanager
def progress_bar(
    action: str, unit: str, console: Console | None = None, *, transient: bool = False
) -> Iterator[Callable[..., None]]:
    """A progress bar that appears with the first report; a notebook shows none.

    Args:
        action: the activity, such as "extracting".
        unit: the unit of the count, such as "rows". It may contain further numbers: "games,
            {task.fields[frames]:,} frames".
        console: shows the bar; by default the standard output.
        transient: whether the bar disappears at its end.

    Yields:
        A function of the numbers of finished and of all units, and others by name.
    """
    console = console or Console()
    if console.is_jupyter:
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
    """A callback for `EmulatorPool.reset` with a bar on stderr; None without a terminal."""
    if not _takes_bars(sys.stderr):
        yield None
        return
    with progress_bar("starting", "emulators", Console(stderr=True), transient=True) as report:
        yield lambda started: report(started, num_envs)
