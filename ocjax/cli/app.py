"""The command `ocjax`.

A subcommand's module is imported when the subcommand runs, so `ocjax --help` is quick.
"""

import contextlib
import importlib
import importlib.metadata
import re
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from ocjax.cli.messages import Interruptible, console, warn

COMMANDS = {  # the module of each subcommand in this package
    "games": "games",
    "demo": "demo",
    "render": "render",
    "train": "train",
    "play": "play",
    "extract": "extract",
    "gaze": "gaze",
    "dataset": "datasets",
    "relabel": "datasets",
    "export": "datasets",
    "evaluate": "evaluate",
    "parity": "parity",
    "bench": "bench",
    "ram": "ram",
}
PANELS = {  # headings of the list of subcommands
    "Look": ("games", "demo", "render"),
    "Train and play agents": ("train", "play"),
    "Extract and label data": ("extract", "gaze", "dataset", "relabel", "export"),
    "Measure": ("evaluate", "parity", "bench"),
    "Write the decoder of a game": ("ram",),
}


def summary(name: str) -> str:
    """The first line of a subcommand's help, read from its file without importing it."""
    text = Path(__file__).with_name(f"{COMMANDS[name]}.py").read_text(encoding="utf-8")
    function = text.partition(f"def {name}(")[2]
    # A group of commands, such as `ram`, has no function; the module's docstring describes it.
    return re.findall('"""(.+)', function or text)[0].removesuffix('"""')


def load(name: str) -> Any:
    """Import a subcommand."""
    group = function = getattr(importlib.import_module(f"ocjax.cli.{COMMANDS[name]}"), name)
    if not isinstance(group, typer.Typer):
        group = typer.Typer(add_completion=False, pretty_exceptions_show_locals=False)
        group.command(name)(function)
    command = typer.main.get_command(group)
    _hide_types_of_flags(command)
    return command


def _without_types(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


def _hide_types_of_flags(command: Any) -> None:
    """Show flags such as `--json` without the type `<bool>` in the help."""
    _without_types(command.get_params(typer.Context(command)))
    for inner in getattr(command, "commands", {}).values():
        _hide_types_of_flags(inner)


class Commands(Interruptible):
    """The subcommands.

    Each is imported when it is called.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """The options of `ocjax` itself."""
        return _without_types(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The subcommand that the arguments call."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, None if name is None else load(name), rest


app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_show_locals=False)
for _panel, _names in PANELS.items():
    for _name in _names:
        # `Commands.resolve_command` replaces this function when the subcommand is called.
        app.command(_name, help=summary(_name), rich_help_panel=_panel)(lambda: None)


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

    warnings.showwarning = warn
    process.retain_freed_memory()
    with contextlib.suppress(OSError):  # without a home folder, programs are compiled each time
        process.use_compilation_cache()


if __name__ == "__main__":
    app()
