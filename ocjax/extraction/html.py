"""HTML tables for notebooks."""

from collections.abc import Iterable, Sequence
from html import escape

STYLE = "text-align: left; vertical-align: top"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table."""
    lines = [_row("th", header), *(_row("td", row) for row in rows)]
    return f"<table>{''.join(lines)}</table>"


def _row(tag: str, cells: Sequence[object]) -> str:
    return (
        "<tr>"
        + "".join(f'<{tag} style="{STYLE}">{escape(str(cell))}</{tag}>' for cell in cells)
        + "</tr>"
    )
