"""`ocjax ram watch` in a terminal."""

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
from PIL import Image
from rich.console import Console, Group
from rich.layout import Layout
from rich.live import Live
from rich.table import Table
from rich.text import Text

from ocjax.play.human import RATE
from ocjax.ramtools.watch.session import ARROWS, GLOW, Session
from ocjax.transforms.drawing import category_colors

RAM_WIDTH = 72  # characters of the right column
RAM_HEIGHT = 11  # lines of the RAM and the heading of the objects
# characters: two pixels each, one above the other
SCREEN_COLUMNS, SCREEN_ROWS, LEAST_COLUMNS, LEAST_ROWS = (
    160,
    105,
    20,
    8,
)


def screen_text(session: Session, columns: int, rows: int) -> Text:
    """The screen with boxes in half blocks, two pixels per character."""
    frame = session.game.palette[session.screen].copy()
    colors = category_colors(session.game)
    for r in session.objects.to_list():
        x, y, right, bottom = r["x"], r["y"], r["x"] + r["w"] - 1, r["y"] + r["h"] - 1
        frame[[y, bottom], x : right + 1] = colors[r["category"]]
        frame[y : bottom + 1, [x, right]] = colors[r["category"]]
    small = np.asarray(Image.fromarray(frame).resize((columns, 2 * rows), Image.Resampling.BOX))
    out = Text(no_wrap=True)
    for upper, lower in zip(small[::2].tolist(), small[1::2].tolist(), strict=True):
        for a, b in zip(upper, lower, strict=True):
            out.append("▀", f"rgb({a[0]},{a[1]},{a[2]}) on rgb({b[0]},{b[1]},{b[2]})")
        out.append("\n")
    return out


def ram_text(session: Session) -> Text:
    """The RAM, sixteen bytes per row, with changed bytes marked."""
    out = Text("     " + " ".join(f"{i:>3}" for i in range(16)) + "\n", no_wrap=True)
    for start in range(0, 128, 16):
        out.append(f"{start:>4} ", "dim")
        for address in range(start, start + 16):
            glow = session.changed[address]
            out.append(
                f"{session.ram[address]:>3} ",
                "bold black on yellow" if glow == GLOW else "yellow" if glow else "",
            )
        out.append("\n")
    return out


def objects_table(session: Session, rows: int) -> Table:
    """The first objects, one per row."""
    table = Table(box=None, pad_edge=False)
    for heading in ("object", "x", "y", "w", "h", "value", "orientation"):
        table.add_column(heading, justify="left" if heading == "object" else "right")
    colors, records = category_colors(session.game), session.objects.to_list()
    for r in records[:rows]:
        numbers = (str(r.get(k, "")) for k in ("x", "y", "w", "h", "value", "orientation"))
        table.add_row(
            Text(f"{r['category']} {r['slot']}", "rgb({},{},{})".format(*colors[r["category"]])),
            *numbers,
        )
    if len(records) > rows:
        table.add_row(f"and {len(records) - rows} more")
    return table


def panel(session: Session, width: int, height: int) -> Layout:
    """The complete view for a terminal of `width` by `height` characters."""
    layout = Layout()
    layout.split_column(
        Layout(Text(session.title(), "bold"), size=1),
        Layout(name="middle"),
        Layout(Text(session.line(), "dim"), size=1),
    )
    columns = max(LEAST_COLUMNS, min(SCREEN_COLUMNS, width - RAM_WIDTH))
    rows = max(LEAST_ROWS, height - 3)
    screen = screen_text(session, columns, min(rows, SCREEN_ROWS))
    layout["middle"].split_row(Layout(screen, size=columns + 1), Layout(name="right"))
    layout["right"].update(
        Group(ram_text(session), objects_table(session, max(1, rows - RAM_HEIGHT)))
    )
    return layout


def split_keys(data: str) -> list[str]:
    """Split terminal input into keys: characters, and sequences for arrows."""
    out = []
    while data:
        key = next((arrow for arrow in ARROWS if data.startswith(arrow)), data[0])
        out.append(key)
        data = data[len(key) :]
    return out


@contextlib.contextmanager
def _raw_keys() -> Iterator[Callable[[], list[str]]]:
    """A function that returns the keys pressed since its last call, without waiting.

    Without a terminal, it returns no keys.
    """
    if not sys.stdin.isatty():
        yield list
        return
    import termios
    import tty

    fd = sys.stdin.fileno()
    before = termios.tcgetattr(fd)

    def read() -> list[str]:
        data = b""
        while select.select([fd], [], [], 0)[0] and (more := os.read(fd, 64)):
            data += more
        return split_keys(data.decode(errors="ignore"))

    try:
        tty.setcbreak(fd)
        yield read
    finally:
        termios.tcsetattr(fd, termios.TCSADRAIN, before)


def watch(session: Session, console: Console, frames: int | None = None) -> None:
    """Watch in a terminal until the session is done or `frames` frames are shown.

    This also works over ssh.
    """
    shown = 0
    with (
        _raw_keys() as keys,
        Live(console=console, screen=console.is_terminal, auto_refresh=False) as live,
    ):
        while not session.done and (frames is None or shown < frames):
            start = time.perf_counter()
            for key in keys():
                session.key(key)
            session.step()
            live.update(panel(session, console.width, console.height), refresh=True)
            shown += 1
            if frames is None:
                time.sleep(max(0.0, 1 / RATE - (time.perf_counter() - start)))
