"""Reports of an evaluation: tables on screen, as Markdown, CSV and LaTeX, and an HTML page with the worst frames drawn."""

import base64
import csv
import dataclasses
import functools
import html
import io
import math
from collections.abc import Sequence

import jax
import numpy as np
from PIL import Image, ImageDraw
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as RichTable

from ocjax import evaluation, tracking
from ocjax.evaluation import Agreement, Detections
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.peer import PeerMethod
from ocjax.recordings import Recording
from ocjax.vision.palette import NTSC

FRAMES = 6  # worst frames drawn
MISSED, INVENTED, AGREED = (255, 40, 40), (255, 220, 0), (150, 150, 150)
SCALE = 2  # picture pixels a console pixel, twice as wide
CHUNK = 1024  # frames extracted at a time

Cell = str | int | float | None  # floats are percentages


@dataclasses.dataclass(frozen=True)
class Table:
    """A table for every format."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def tight(self) -> "Table":
        """Without the columns that hold nothing."""
        kept = [k for k in range(len(self.header)) if any(row[k] is not None for row in self.rows)]
        return Table(self.title, [self.header[k] for k in kept], [[row[k] for k in kept] for row in self.rows])


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluation:
    """What was measured on a recording of one game. Arrays over categories are in the order of `aware`'s columns."""

    game: Game
    source: str  # where the frames come from
    episode: np.ndarray  # int [frames]
    aware: Agreement  # REM against VEM, flicker-aware where the frames before are known; [frames, categories]
    plain: Agreement  # on the frame alone
    values: dict[str, float]  # shares of right scores and lives, by category
    switches: tuple[np.ndarray, np.ndarray] | None  # identity switches, objects going on; [categories]
    unfit: np.ndarray  # objects that VEM saw but had no slot for; [categories]
    cover: tuple[float, float] | None  # sprite pixels inside REM's boxes, boxes that hold drawn pixels
    peer: dict[str, PeerMethod]
    peer_plain: Agreement | None
    worst: tuple[tuple[str, bytes], ...]  # captions and PNG files


def _by_parts(f: object, x: np.ndarray) -> object:
    """`f` of a long batch in parts of equal size, the last one filled up: one compilation."""
    out = []
    for start in range(0, len(x), CHUNK):
        part = x[start : start + CHUNK]
        if len(x) > CHUNK and len(part) < CHUNK:
            part = np.concatenate([part, np.repeat(part[-1:], CHUNK - len(part), axis=0)])
        n = min(CHUNK, len(x) - start)
        out.append(jax.tree.map(lambda a, n=n: np.asarray(a)[:n], f(part)))  # pyright: ignore[reportCallIssue]
    return jax.tree.map(lambda *a: np.concatenate(a), *out)


def evaluate(recording: Recording, source: str, peer: dict[str, PeerMethod] | None = None) -> Evaluation:
    """Compare REM and VEM on a recording with frames.

    Args:
        recording: what it lacks (frames before, rewards, lives, what the video chip drew) is left out of the result.
        source: where it comes from, for people.
        peer: what OCAtari found on it (`peer.run`).

    Raises:
        ValueError: there are no frames.
    """
    game, screens = recording.game, recording.screens
    if screens is None or not len(recording):
        raise ValueError("the recording has no frames: there is nothing to compare REM with")
    see = game.vem_overflow if screens.ndim == 3 else lambda x: (game.vem(x), np.zeros((len(x), len(game.categories)), int))
    rem: Objects = _by_parts(game.rem, recording.rams)  # pyright: ignore[reportAssignmentType]
    now, unfit = _by_parts(see, screens)  # pyright: ignore[reportGeneralTypeIssues]
    left, right = evaluation.detections(rem), evaluation.detections(now)
    pairs = evaluation.match(left, right)
    plain = evaluation.agreement(left, right, pairs=pairs)
    aware, before, merged = plain, None, None
    if recording.previous is not None:
        earlier = _by_parts(see, recording.previous)[0]  # pyright: ignore[reportIndexIssue]
        before, merged = evaluation.detections(earlier), tracking.merge_frames(earlier, now)
        aware = evaluation.agreement(left, right, before, pairs=pairs)
    values = {}
    if recording.rewards is not None and recording.lives is not None:
        values = evaluation.value_shares(rem, recording.rewards, recording.lives)
    switches = cover = None
    if recording.frame_skip is not None and recording.resets is not None:
        seen = now if merged is None else merged
        switches = evaluation.identity_switches(rem, seen, recording.resets)
    if recording.shown is not None:
        drawn = recording.shown != 0
        if recording.previous_shown is not None:
            drawn = drawn | (recording.previous_shown != 0)
        cover = evaluation.coverage(left, (recording.shown & 31) > 0, drawn)
    theirs = peer or {}
    both = [theirs[m].objects for m in ("rem", "vem") if m in theirs]
    peer_plain = evaluation.agreement(both[0], both[1]) if len(both) == 2 and both[0] is not None and both[1] is not None else None
    return Evaluation(
        game, source, recording.episode, aware, plain, values, switches, unfit.sum(axis=0), cover, theirs, peer_plain,
        _worst(recording, aware, left, right, before),
    )  # fmt: skip


def _worst(recording: Recording, counts: Agreement, left: Detections, right: Detections, before: Detections | None) -> tuple:
    """Pictures of the frames with the most disagreements, at most one of each stretch of 20 samples."""
    wrong = (counts.left - counts.confirmed + counts.right - counts.found).sum(axis=1)
    out, taken = [], []
    for i in np.argsort(-wrong, kind="stable"):
        if wrong[i] == 0 or len(out) == FRAMES:
            break
        if all(abs(i - t) >= 20 for t in taken):
            taken.append(i)
            out.append(_picture(recording, int(i), left, right, before))
    return tuple(out)


def _picture(recording: Recording, i: int, left: Detections, right: Detections, before: Detections | None) -> tuple[str, bytes]:
    def one(d: Detections) -> Detections:
        return dataclasses.replace(d, xywh=d.xywh[i : i + 1], label=d.label[i : i + 1], score=None)

    mine, theirs = one(left), one(right)
    pairs = evaluation.match(mine, theirs)[0]
    confirmed = pairs >= 0
    if before is not None:
        rest = dataclasses.replace(mine, label=np.where(confirmed[None], -1, mine.label))
        confirmed = confirmed | (evaluation.match(rest, one(before))[0] >= 0)
    assert recording.screens is not None
    frame = recording.screens[i]
    rgb = NTSC[frame] if frame.ndim == 2 else frame
    image = Image.fromarray(rgb).resize((rgb.shape[1] * 2 * SCALE, rgb.shape[0] * SCALE), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(image)
    missed = np.setdiff1d(np.flatnonzero(theirs.label[0] >= 0), pairs)
    shown = mine.label[0] >= 0
    groups = (
        (AGREED, mine, np.flatnonzero(shown & confirmed)),
        (INVENTED, mine, np.flatnonzero(shown & ~confirmed)),
        (MISSED, theirs, missed),
    )
    for color, boxes, which in groups:
        for x, y, w, h in boxes.xywh[0, which].astype(int).tolist():
            draw.rectangle((2 * SCALE * x - 1, SCALE * y - 1, 2 * SCALE * (x + w), SCALE * (y + h)), outline=color)
    names = [", ".join(sorted({d.categories[d.label[0, k]] for k in which})) or "none" for _, d, which in groups[1:]]
    file = io.BytesIO()
    image.quantize(64).save(file, "PNG", optimize=True)
    return f"sample {i}: invented {names[0]}; missed {names[1]}", file.getvalue()


def _percent(x: np.ndarray | float) -> float:
    return 100 * float(x)


def _range(e: Evaluation, category: int | None) -> Cell:
    """95 % confidence interval of F1 over episodes."""

    def score(counts: Agreement) -> np.ndarray:
        return (counts.sum(axis=-1) if category is None else counts.each(lambda a: a[..., category])).f1

    counts = e.aware
    low, high = evaluation.intervals(counts, e.episode, score)
    return None if np.isnan(low).any() else f"{100 * float(np.ravel(low)[0]):.1f}-{100 * float(np.ravel(high)[0]):.1f}"


@functools.cache
def by_category(e: Evaluation) -> Table:
    """Each category of a game, and all together."""
    header = ["Category", "Objects", "Precision", "Recall", "F1", "95 %", "IoU", "Exact", "F1, one frame", "Switches", "Unfit", "Value"]
    if e.peer:
        header += [f"OCAtari {name}" for name in ("precision", "recall", "F1", "IoU")]
    columns = [(i, c.name) for i, c in enumerate(e.game.categories)]
    rows: list[list[Cell]] = []
    for i, name in [*columns, (None, "all")]:
        a, plain = (c.sum(axis=(0, 1)) if i is None else c.sum(axis=0).each(lambda v, i=i: v[i]) for c in (e.aware, e.plain))
        row: list[Cell] = [name, int(a.left), *map(_percent, (a.precision, a.recall, a.f1)), _range(e, i)]
        row += [_percent(a.mean_iou), _percent(a.exact_rate), _percent(plain.f1)]
        row.append(None if e.switches is None else int(e.switches[0].sum() if i is None else e.switches[0][i]))
        row += [int(e.unfit.sum() if i is None else e.unfit[i]), _percent(e.values[name]) if name in e.values else None]
        if e.peer:
            row += [None] * 4 if e.peer_plain is None else _four(e.peer_plain, i)
        rows.append(row)
    return Table(f"{e.game.name}: REM against VEM, percent; {e.source}", header, rows)


def _four(counts: Agreement, category: int | None) -> list[Cell]:
    a = counts.sum(axis=(0, 1)) if category is None else counts.sum(axis=0).each(lambda v: v[category])
    return [_percent(v) for v in (a.precision, a.recall, a.f1, a.mean_iou)]


def overview(evaluations: Sequence[Evaluation]) -> Table:
    """One row a game."""
    header = [
        "Game",
        "Samples",
        "Episodes",
        "Objects",
        "Precision",
        "Recall",
        "F1",
        "95 %",
        "IoU",
        "Exact",
        "Score",
        "Lives",
        "Sprites",
        "Boxes",
    ]
    header += ["OCAtari F1", "IoU of it"]
    rows: list[list[Cell]] = []
    for e in evaluations:
        a = e.aware.sum()
        row: list[Cell] = [e.game.name, len(e.episode), len(np.unique(e.episode)), int(a.left)]
        row += [_percent(a.precision), _percent(a.recall), _percent(a.f1), _range(e, None), _percent(a.mean_iou), _percent(a.exact_rate)]
        for names in (evaluation.SCORE_NAMES, evaluation.LIVES_NAMES):
            row.append(next((_percent(v) for k, v in e.values.items() if k in names), None))
        row += [None, None] if e.cover is None else [_percent(v) for v in e.cover]
        row += [None, None] if e.peer_plain is None else _four(e.peer_plain, None)[2:]
        rows.append(row)
    if len(rows) > 1:
        means: list[Cell] = [None if k in (7, *range(1, 4)) else _mean([row[k] for row in rows]) for k in range(1, len(header))]
        rows.append(["mean", *means])
    return Table("REM against VEM, percent", header, rows)


def _mean(cells: Sequence[Cell]) -> Cell:
    numbers = [c for c in cells if isinstance(c, float) and not math.isnan(c)]
    return sum(numbers) / len(numbers) if numbers else None


def text(cell: Cell) -> str:
    """A cell as people read it."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "-"
    return f"{cell:,}" if isinstance(cell, int) else f"{cell:.2f}" if isinstance(cell, float) else cell


def show(table: Table, console: Console) -> None:
    """A table on the screen."""
    table = table.tight()
    out = RichTable(title=table.title, title_justify="left")
    cells = [[text(c) for c in row] for row in table.rows]
    for i, heading in enumerate(table.header):
        words = all(isinstance(row[i], str | None) for row in table.rows)
        longest = max(len(word) for cell in (heading, *(row[i] for row in cells)) for word in cell.split() or [""])
        out.add_column(heading, justify="left" if words else "right", min_width=longest)
    for row in cells:
        out.add_row(*row)
    console.print(out, crop=False, width=max(console.width, Measurement.get(console, console.options, out).minimum))


def notes(e: Evaluation) -> list[str]:
    """What the tables cannot say."""
    out = []
    if e.peer:
        for method, m in e.peer.items():
            if m.objects is None:
                out.append(f"{e.game.name}: OCAtari's {method.upper()} does not run here ({m.error})")
            else:
                out.append(f"{e.game.name}: OCAtari's {method.upper()} takes {np.median(m.us):.1f} us a frame")
    return out


def to_markdown(tables: Sequence[Table]) -> str:
    """Tables as Markdown."""
    parts = []
    for t in (t.tight() for t in tables):
        lines = [t.header, ["---"] * len(t.header), *([text(c) for c in row] for row in t.rows)]
        parts.append(f"**{t.title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines))
    return "\n\n".join(parts) + "\n"


def to_csv(evaluations: Sequence[Evaluation]) -> str:
    """One row a game and category, numbers in full; percentages as such, empty where there is no number."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    tables = [by_category(e) for e in evaluations]
    widest = max(tables, key=lambda t: len(t.header)).header
    writer.writerow(["Game", *widest])
    for e, t in zip(evaluations, tables, strict=True):
        for row in t.rows:
            cells = ["" if c is None or (isinstance(c, float) and math.isnan(c)) else c for c in row]
            writer.writerow([e.game.name, *cells, *[""] * (len(widest) - len(cells))])
    return out.getvalue()


def _shade(percent: float) -> str:
    """Red over yellow to green, as hexadecimal digits."""
    stops = ((215, 48, 39), (255, 255, 191), (26, 152, 80))
    x = min(max(percent, 0), 100) / 50
    a, b = (stops[0], stops[1]) if x < 1 else (stops[1], stops[2])
    return "".join(f"{round(p + (q - p) * (x - int(x) if x < 2 else 1)):02X}" for p, q in zip(a, b, strict=True))


def to_latex(evaluations: Sequence[Evaluation]) -> str:
    """The OCAtari paper's tables: precision, recall, F-score and IoU by category, shaded; needs booktabs and xcolor with [table]."""

    def shaded(percent: Cell) -> str:
        if not isinstance(percent, float) or math.isnan(percent):
            return "--"
        return f"\\cellcolor[HTML]{{{_shade(percent)}}} {'100' if percent > 99.95 else f'{percent:.1f}'}"

    parts = []
    for e in evaluations:
        sides = ["ocjax"] + (["OCAtari"] if e.peer_plain is not None else [])
        spec = "l" + "|rrrr" * len(sides)
        head = " & ".join(["", *(f"\\multicolumn{{4}}{{c}}{{{s}}}" for s in sides)])
        lines = ["\\begin{table}", "\\centering", f"\\caption{{Per class scores on {e.game.name}}}", f"\\begin{{tabular}}{{{spec}}}"]
        lines += [
            "\\toprule",
            head + " \\\\",
            " & ".join(["", *["Precision", "Recall", "F-score", "IOU"] * len(sides)]) + " \\\\",
            "\\midrule",
        ]
        for i, name in [*((i, c.name) for i, c in enumerate(e.game.categories)), (None, "all")]:
            cells = _four(e.aware, i) + (_four(e.peer_plain, i) if e.peer_plain is not None else [])
            label = name.replace("_", "\\_")
            lines.append(" & ".join([label, *map(shaded, cells)]) + " \\\\")
        parts.append("\n".join([*lines, "\\bottomrule", "\\end{tabular}", "\\end{table}"]))
    return "\n\n".join(parts) + "\n"


STYLE = """body{font:14px system-ui,sans-serif;margin:24px;max-width:1400px}table{border-collapse:collapse;margin:8px 0 24px}
td,th{padding:3px 8px;border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child{text-align:left}
figure{display:inline-block;margin:8px}figcaption{max-width:640px}img{image-rendering:pixelated;border:1px solid #444}"""


def to_html(evaluations: Sequence[Evaluation]) -> str:
    """One page without other files: the tables, and the frames with the most disagreements."""

    def cell(c: Cell) -> str:
        color = f' style="background:#{_shade(c)}"' if isinstance(c, float) and not math.isnan(c) else ""
        return f"<td{color}>{html.escape(text(c))}</td>"

    def table(t: Table) -> str:
        t = t.tight()
        head = "".join(f"<th>{html.escape(h)}</th>" for h in t.header)
        rows = "".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in t.rows)
        return f"<h2>{html.escape(t.title)}</h2><table><tr>{head}</tr>{rows}</table>"

    parts = ["<!doctype html><meta charset=utf-8><title>ocjax evaluation</title><style>", STYLE, "</style><h1>ocjax evaluation</h1>"]
    parts.append(table(overview(evaluations)))
    for e in evaluations:
        parts.append(table(by_category(e)))
        parts += [f"<p>{html.escape(n)}</p>" for n in notes(e)]
        if not e.worst:
            parts.append("<p>No frame with a disagreement.</p>")
        else:
            parts.append(
                "<p>Frames with the most disagreements: red what VEM saw and REM missed, yellow what REM invented, grey the rest.</p>"
            )
        for caption, png in e.worst:
            data = base64.b64encode(png).decode()
            parts.append(f'<figure><img src="data:image/png;base64,{data}"><figcaption>{html.escape(caption)}</figcaption></figure>')
    return "".join(parts) + "\n"
