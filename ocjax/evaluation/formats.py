"""Evaluations as CSV, LaTeX and a self-contained HTML page."""

import base64
import csv
import html
import io
from collections.abc import Sequence

from ocjax.evaluation.report import (
    COLUMNS,
    FLICKER,
    Evaluation,
    by_category,
    by_situation,
    notes,
    of_category,
    overview,
    rows_of,
    scores,
    tables_of,
)
from ocjax.evaluation.tables import Cell, Table, is_number, text

LOW, MIDDLE, HIGH = (215, 48, 39), (255, 255, 191), (26, 152, 80)  # red, yellow, green
STYLE = (
    "body{font:14px system-ui,sans-serif;margin:24px;max-width:1400px}"
    "table{border-collapse:collapse;margin:8px 0 24px}\n"
    "td,th{padding:3px 8px;border-bottom:1px solid #ddd;text-align:right}"
    "td:first-child,th:first-child{text-align:left}\n"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 16px}"
    "dt{font-weight:600}dd{margin:0}\n"
    "figure{display:inline-block;margin:8px}figcaption{max-width:640px}"
    "img{image-rendering:pixelated;border:1px solid #444}"
)


def shade(percent: float) -> str:
    """Return a colour from red (0) over yellow (50) to green (100), as six hexadecimal digits."""
    x = min(max(percent, 0), 100) / 50
    a, b, share = (LOW, MIDDLE, x) if x < 1 else (MIDDLE, HIGH, x - 1)
    return "".join(f"{round(p + (q - p) * share):02X}" for p, q in zip(a, b, strict=True))


def to_csv(evaluations: Sequence[Evaluation]) -> str:
    """Format evaluations as CSV, with a row per category and per situation of each game.

    Percentages have full precision; missing ones are empty.
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    tables = [by_category(e) for e in evaluations]
    # OCAtari's columns are last and may be missing.
    header = max((t.header for t in tables), key=len)
    writer.writerow(["Game", *header])
    for e, t in zip(evaluations, tables, strict=True):
        for row in (*t.rows, *map(_like_category, by_situation(e).rows)):
            cells = [
                "" if c is None or (isinstance(c, float) and not is_number(c)) else c for c in row
            ]
            writer.writerow([e.game.name, *cells, *[""] * (len(header) - len(cells))])
    return file.getvalue()


def _like_category(situation: Sequence[Cell]) -> list[Cell]:
    """Put a situation's row under the columns of categories."""
    name, _, *rest = situation
    return [name, *rest]


def to_latex(evaluations: Sequence[Evaluation]) -> str:
    r"""Format shaded tables in the OCAtari paper's layout.

    They need the packages booktabs and xcolor with the option `table`.
    """
    return "\n\n".join(_latex_table(e) for e in evaluations) + "\n"


def _latex_table(e: Evaluation) -> str:
    sides = {"ocjax": e.flicker_aware} | (
        {} if e.ocatari_agreement is None else {"OCAtari": e.ocatari_agreement}
    )
    lines = [
        "\\begin{table}",
        "\\centering",
        f"\\caption{{Per class scores on {e.game.name}}}",
        f"\\begin{{tabular}}{{l{'|rrrr' * len(sides)}}}",
        "\\toprule",
        _latex_row(["", *(f"\\multicolumn{{4}}{{c}}{{{side}}}" for side in sides)]),
        _latex_row(["", *["Precision", "Recall", "F-score", "IOU"] * len(sides)]),
        "\\midrule",
    ]
    for i, name in rows_of(e.game):
        cells = [cell for counts in sides.values() for cell in scores(of_category(counts, i))]
        lines.append(_latex_row([name.replace("_", "\\_"), *map(_latex_cell, cells)]))
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}", "\\end{table}"])


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + " \\\\"


def _latex_cell(percent: Cell) -> str:
    if not isinstance(percent, float) or not is_number(percent):
        return "--"
    return f"\\cellcolor[HTML]{{{shade(percent)}}} {'100' if percent > 99.95 else f'{percent:.1f}'}"


def to_html(evaluations: Sequence[Evaluation]) -> str:
    """Format a single page with the tables, and pictures of the frames that disagree most."""
    parts = [
        "<!doctype html><meta charset=utf-8><title>ocjax evaluation</title><style>",
        STYLE,
        "</style><h1>ocjax evaluation</h1>",
    ]
    parts.append(_html_explanation(evaluations))
    parts.append(_html_table(overview(evaluations)))
    for e in evaluations:
        parts += map(_html_table, tables_of(e))
        parts += [f"<p>{html.escape(note)}</p>" for note in notes(e)]
        parts.append(_html_pictures(e))
    return "".join(parts) + "\n"


def _html_explanation(evaluations: Sequence[Evaluation]) -> str:
    tables = [overview(evaluations), *(table for e in evaluations for table in tables_of(e))]
    occurring = {heading for table in tables for heading in table.without_empty_columns().header}
    rows = "".join(
        f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>"
        for name, text in COLUMNS.items()
        if name in occurring
    )
    return f"<h2>How to read the tables</h2><p>{html.escape(FLICKER)}</p><dl>{rows}</dl>"


def _html_table(table: Table) -> str:
    table = table.without_empty_columns()
    head = "".join(
        f'<th title="{html.escape(COLUMNS.get(heading, ""))}">{html.escape(heading)}</th>'
        for heading in table.header
    )
    rows = "".join("<tr>" + "".join(map(_html_cell, row)) + "</tr>" for row in table.rows)
    return f"<h2>{html.escape(table.title)}</h2><table><tr>{head}</tr>{rows}</table>"


def _html_cell(cell: Cell) -> str:
    color = (
        f' style="background:#{shade(cell)}"' if isinstance(cell, float) and is_number(cell) else ""
    )
    return f"<td{color}>{html.escape(text(cell))}</td>"


def _html_pictures(e: Evaluation) -> str:
    if not e.worst_frames:
        return "<p>REM and VEM agree on every frame.</p>"
    parts = [
        "<p>Frames with the most disagreements: misses in red, false detections in yellow, "
        "agreed boxes in grey.</p>"
    ]
    for picture in e.worst_frames:
        data = base64.b64encode(picture.png).decode()
        parts.append(
            f'<figure><img src="data:image/png;base64,{data}">'
            f"<figcaption>{html.escape(picture.caption)}</figcaption></figure>"
        )
    return "".join(parts)
