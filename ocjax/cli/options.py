"""Options of several commands, and options for the fields of a dataclass."""

import dataclasses
import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

_UNITS = {"": 1, "k": 1_000, "M": 1_000_000}


def count_option(help_text: str, default: str) -> Any:
    """An option for a number that `count` reads, with the text of its default."""
    return typer.Option(parser=count, metavar="NUMBER", help=help_text, show_default=default)


def count(text: str) -> int:
    """Read a number of frames, states or steps, such as 20000000, 20_000_000, 2e7 or 20M."""
    digits = str(text).rstrip("kM")
    unit = _UNITS.get(str(text)[len(digits) :], math.nan)
    try:
        number = float(digits) * unit
    except ValueError:
        number = math.nan
    if not number.is_integer():
        raise typer.BadParameter(f"{text!r} is not a whole number such as 20000000, 2e7 or 20M")
    if number < 1:
        raise typer.BadParameter(f"{text} is not at least 1")
    return int(number)


RAY = Annotated[
    str | None,
    typer.Option(
        "--ray",
        metavar="ADDRESS",
        help="Spread the work over a Ray cluster whose machines share the files: its address, auto "
        "for the cluster of this machine, or local for this machine alone.",
    ),
]

OCATARI_ENV = Annotated[
    Path | None,
    typer.Option(
        help="Virtual environment with OCAtari, created if needed. Default: one in the user's "
        "cache."
    ),
]
START_HELP = (
    "Values to write to the RAM when a game begins, such as level=2: fields of `ocjax ram map`, or "
    "numbers of bytes; none for the ordinary start. May be repeated: the instances use them in "
    "rotation."
)


def fields_as_options(
    kind: type, panel: str
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """A decorator that gives commands with `**given` an option, None by default, for each field.

    Args:
        kind: the dataclass. The metadata of its fields have their `help`.
    """
    options = [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[
                field.type | None,  # pyright: ignore[reportOperatorIssue]
                typer.Option(
                    help=f"{field.metadata['help']} Default: {field.default:g}.",
                    rich_help_panel=panel,
                ),
            ],
        )
        for field in dataclasses.fields(kind)
    ]

    def decorate(command: Any) -> Any:
        signature = inspect.signature(command)
        own = [
            p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        command.__signature__ = signature.replace(parameters=[*own, *options])
        return command

    return decorate


Terrain = Annotated[
    bool, typer.Option("--terrain", help="Also paint the walls, ladders and the like.")
]
