"""Messages of all commands: errors that the user can correct, and interruptions."""

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from typer.core import TyperGroup

from ocjax._extras import MissingExtraError

console = Console()

WRONG_USE, INTERRUPTED = 2, 130  # exit statuses


def say(text: str) -> None:
    """Print one line to the standard error."""
    Console(stderr=True).print(text, style="red", markup=False, highlight=False, soft_wrap=True)


@contextlib.contextmanager
def errors_in_one_line() -> Iterator[None]:
    """Report errors that the user can correct in one line, with exit status 2."""
    try:
        yield
    except (OSError, ValueError, MissingExtraError) as error:
        say(f"Error: {error}")
        raise typer.Exit(WRONG_USE) from error


@contextlib.contextmanager
def progress_bar(action: str, unit: str, console: Console) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that appears with the first report.

    Args:
        action: the activity, such as "extracting".
        unit: the unit of the count, such as "rows".
        console: shows the bar.

    Yields:
        A function to call with the numbers of finished and of all units.
    """
    columns = (
        TextColumn(action),
        BarColumn(),
        TextColumn(f"{{task.completed:,}} of {{task.total:,}} {unit}"),
        TimeRemainingColumn(),
    )
    with contextlib.ExitStack() as shown:
        progress = Progress(*columns, console=console)
        task = progress.add_task("", total=0)

        def report(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)
            if not progress.live.is_started:
                shown.enter_context(progress)

        yield report


class Interruptible(TyperGroup):
    """Commands that print one line and exit with status 130 after Ctrl-C."""

    def invoke(self, ctx: Any) -> Any:
        """Invoke the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            say("Interrupted.")
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(
                INTERRUPTED
                # XLA's threads crash an interpreter that shuts down while they compile or compute
            )
