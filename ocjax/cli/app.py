"""The command `ocjax`.

A subcommand's module is imported when the subcommand runs, so `ocjax --help` is quick.
"""

import contextlib
import importlib
import importlib.metadata
from typing import Annotated, Any

import typer

from ocjax.cli.messages import Interruptible, console

COMMANDS = {  # the module of each subcommand in this package
    "games": "games",
    "demo": "demo",
    "render": "render",
    "evaluate": "evaluate",
    "parity": "parity",
    "bench": "bench",
    "extract": "extract",
    "gaze": "gaze",
    "dataset": "datasets",
    "relabel": "datasets",
    "export": "datasets",
    "train": "agents",
    "play": "agents",
    "ram": "ram",
}
SUMMARIES = {  # the first line of each subcommand's help
    "games": "List the supported games, or show everything that is known about one.",
    "demo": (
        "Play a game with random actions, time both extraction methods, and draw their objects."
    ),
    "render": "Draw objects over the frames of a recording.",
    "evaluate": "Measure how well REM and VEM agree, and how often scores and lives are right.",
    "parity": "Compare another implementation of a game with the real ROM, frame by frame.",
    "bench": "Time REM, VEM, the environments and other programs on one core of this machine.",
    "extract": "Extract objects from RAM or frames in files.",
    "gaze": "Find the objects that the players of the dataset Atari-HEAD look at.",
    "dataset": "Make a dataset of frames and RAM with the objects of both methods.",
    "relabel": "Replace the objects and the datasheet of a dataset with the present decoders.",
    "export": "Export a dataset to CSV or Minari.",
    "train": "Train an agent with PPO, and show how it plays.",
    "play": "Let a policy play complete games, under the settings of its training.",
    "ram": "Reverse-engineer the RAM of a game.",
}


def load(name: str) -> Any:
    """Import a subcommand."""
    found = getattr(importlib.import_module(f"ocjax.cli.{COMMANDS[name]}"), name)
    if not isinstance(found, typer.Typer):
        alone = typer.Typer(pretty_exceptions_show_locals=False)
        alone.command(name)(found)
        found = alone
    return typer.main.get_command(found)


class Commands(Interruptible):
    """The subcommands.

    A subcommand is imported when it is called. Until then, only its line of help is known.
    """

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The subcommand that the arguments call."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, None if name is None else load(name), rest


app = typer.Typer(
    cls=Commands, add_completion=False, no_args_is_help=True, pretty_exceptions_show_locals=False
)
for _name, _summary in SUMMARIES.items():
    app.command(_name, help=_summary)(lambda: None)


def _print_version(wanted: bool) -> None:
    if wanted:
        console.print(f"ocjax {importlib.metadata.version('ocjax')}", highlight=False)
        raise typer.Exit


@app.callback()
def prepare(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Extract objects from Atari 2600 games."""
    from ocjax._xla import process

    process.retain_freed_memory()
    with contextlib.suppress(OSError):  # without a home folder, programs are compiled each time
        process.use_compilation_cache()


if __name__ == "__main__":
    app()
