"""Messages of all commands: errors that the user can correct, and interruptions."""

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Any

import typer
from rich.console import Console
from typer.core import TyperGroup

from ocjax._extras import MissingExtraError

console = Console()

WRONG_USE, INTERRUPTED = 2, 130  # exit statuses


def say(text: str) -> None:
    """Print one line to the standard error."""
    Console(stderr=True).print(text, style="red", markup=False, highlight=False, soft_wrap=True)


def warn(text: object, *_: object, **__: object) -> None:
    """Print a warning in one line; it can replace `warnings.showwarning`."""
    Console(stderr=True).print(
        f"Warning: {text}", style="yellow", markup=False, highlight=False, soft_wrap=True
    )


@contextlib.contextmanager
def errors_in_one_line() -> Iterator[None]:
    """Report errors that the user can correct in one line, with exit status 2.

    Commands raise ValueError for wrong options. Only parsers of single options, such as
    `options.count`, raise `typer.BadParameter`, to which Typer adds the option's name.
    """
    try:
        yield
    except (OSError, ValueError, MissingExtraError) as error:
        say(f"Error: {error}")
        raise typer.Exit(WRONG_USE) from error


class Interruptible(TyperGroup):
    """Commands that report errors in one line, and exit with status 130 after Ctrl-C."""

    def invoke(self, ctx: Any) -> Any:
        """Invoke the command."""
        try:
            with errors_in_one_line():
                return super().invoke(ctx)
        except KeyboardInterrupt:
            say("Interrupted.")
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(
                INTERRUPTED
                # XLA's threads crash an interpreter that shuts down while they compile or compute
            )
