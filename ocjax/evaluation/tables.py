"""Tables, and their output in the terminal and as Markdown."""

import dataclasses
import math
from collections.abc import Collection, Sequence

from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table as RichTable

WIDEST = 10_000  # columns, more than any table has

Cell = str | int | float | None  # a float is a percentage, and None an empty cell


@dataclasses.dataclass(frozen=True)
class Table:
    """A title, column headings and rows of cells, independent of the output format.

    Args:
        details: the headings of columns that the terminal does not show.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    details: Collection[str] = ()

    def without_empty_columns(self) -> "Table":
        """Drop columns if every cell is None."""
        return self._columns(
            [k for k in range(len(self.header)) if any(row[k] is not None for row in self.rows)]
        )

    def without_details(self) -> "Table":
        """Drop the columns that the terminal does not show."""
        return self._columns([k for k, name in enumerate(self.header) if name not in self.details])

    def _columns(self, kept: Sequence[int]) -> "Table":
        return dataclasses.replace(
            self,
            header=[self.header[k] for k in kept],
            rows=[[row[k] for k in kept] for row in self.rows],
        )


def is_number(cell: Cell) -> bool:
    """Return whether a cell holds a percentage other than nan."""
    return isinstance(cell, float) and not math.isnan(cell)


def text(cell: Cell) -> str:
    """Format a cell, with "-" for None and nan.

    Percentages have two decimals, and integers have thousands separators.
    """
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int):
        return f"{cell:,}"
    return f"{cell:.2f}" if is_number(cell) else "-"


def show(table: Table, console: Console) -> None:
    """Print a table without its details.

    It may be wider than the console, because cut-off numbers would mislead.
    """
    table = table.without_details().without_empty_columns()
    out = RichTable(title=escape(table.title), title_justify="left")
    cells = [[escape(text(c)) for c in row] for row in table.rows]
    for i, heading in enumerate(table.header):
        is_text = all(isinstance(row[i], str | None) for row in table.rows)
        longest = max(
            len(word)
            for cell in (heading, *(row[i] for row in cells))
            for word in cell.split() or [""]
        )
        out.add_column(escape(heading), justify="left" if is_text else "right", min_width=longest)
    for row in cells:
        out.add_row(*row)
    # In a file or a pipe, each cell stays on one line.
    size = Measurement.get(console, console.options.update(max_width=WIDEST), out)
    out.width = max(console.width, size.minimum) if console.is_terminal else size.maximum
    console.print(out, crop=False)


def to_markdown(tables: Sequence[Table]) -> str:
    """Format tables as Markdown, each with its title in bold above it."""
    parts = []
    for t in (t.without_empty_columns() for t in tables):
        lines = [t.header, ["---"] * len(t.header), *([text(c) for c in row] for row in t.rows)]
        parts.append(
            f"**{t.title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines)
        )
    return "\n\n".join(parts) + "\n"
