"""Write the output files of commands, and print their paths."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from ocjax.cli.messages import console
from ocjax.evaluation import tables
from ocjax.files import writing


def write_text(path: Path | None, text: str, what: str = "Written") -> None:
    """Write a text, unless the path is None."""
    if path is not None:
        writing.write_text(path, text)
        writing.announce(console, what, path)


def write_markdown(path: Path | None, found: Sequence[tables.Table]) -> None:
    """Write tables as Markdown, unless the path is None."""
    write_text(path, tables.to_markdown(found))


def write_csv(path: Path | None, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write rows as CSV, unless the path is None; cells that are None stay empty."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    write_text(path, text.getvalue())


def write_picture(path: Path, image: Image.Image, what: str = "Written") -> None:
    """Write a .png picture."""
    writing.write_picture(path, image)
    writing.announce(console, what, path)
