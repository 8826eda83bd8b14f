"""Options that several commands have."""

from typing import Annotated

import typer

RAY = Annotated[
    str | None,
    typer.Option(
        "--ray",
        metavar="ADDRESS",
        help="Spread the work over a Ray cluster whose machines share the files: its address, auto for the one that this machine is "
        "part of, or local for this machine alone.",
    ),
]
