"""`ocjax ram watch`: play a game in a terminal, and watch and edit its RAM."""

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Collection, Iterator
from typing import Any

import ale_py
import jax
import numpy as np
from PIL import Image
from rich.console import Console, Group
from rich.layout import Layout
from rich.live import Live
from rich.table import Table
from rich.text import Text

from ocjax.emulators.start import start_emulator
from ocjax.extraction.game import Game
from ocjax.play.human import FRAMES_PER_SHOWN, MOVES, RATE
from ocjax.play.policies import Seen, make_policy
from ocjax.transforms.drawing import category_colors

HELP = (
    "wasd/arrows move, space fires, p pauses, n steps one frame, v toggles vision, k saves, l "
    "loads, :ADDRESS VALUE pokes, "
    "r acts at random, m by hand, q quits"
)
ARROWS = {"\x1b[A": "w", "\x1b[D": "a", "\x1b[B": "s", "\x1b[C": "d"}
ENTER, ESCAPE, BACKSPACE = ("\r", "\n"), "\x1b", ("\x7f", "\x08")
HELD = 6  # emulated frames that a key press lasts: terminals do not report releases
GLOW = 15  # emulated frames that a changed byte stays marked
RAM_WIDTH = 72  # characters of the right column
RAM_HEIGHT = 11  # lines of the RAM and the heading of the objects
# characters: two pixels each, one above the other
SCREEN_COLUMNS, SCREEN_ROWS, LEAST_COLUMNS, LEAST_ROWS = 160, 105, 20, 8


def held_action(held: Collection[str]) -> ale_py.Action:
    """The action of the held keys. ALE names actions by their moves: UPRIGHTFIRE, LEFT, ..."""
    actions = ale_py.Action.__members__
    return actions.get("".join(move for key, move in MOVES.items() if key in held), actions["NOOP"])


class Session:
    """A watched emulator: its screen, objects, RAM, recently changed bytes, and a message.

    Args:
        policy: "keyboard", or a name for `make_policy`.
        game_mode: see `ocjax.make_vec`.
    """

    def __init__(
        self, game: Game, policy: str = "keyboard", seed: int = 0, game_mode: int | None = None
    ) -> None:
        self.game, self.ale = game, start_emulator(game, seed, game_mode)
        self.actions = list(self.ale.getMinimalActionSet())
        self._random = make_policy("repeat", game, len(self.actions), 1, seed)
        self.policy = (
            None if policy == "keyboard" else make_policy(policy, game, len(self.actions), 1, seed)
        )
        self.paused = self.vision = self.done = False
        self.started = True  # the game has just begun
        self.message = HELP
        self.typed: str | None = None  # the line after ":" while it is typed
        self.saved: Any = None
        self.held: dict[str, int] = {}  # held keys and their remaining frames
        self.changed = np.zeros(128, int)  # remaining frames of each byte's mark
        self.reward = 0
        self.ram = self.ale.getRAM()
        self._observe()

    def _observe(self) -> None:
        before, self.ram, self.screen = self.ram, self.ale.getRAM(), self.ale.getScreen()
        self.changed = np.where(before != self.ram, GLOW, np.maximum(self.changed - 1, 0))
        found = self.game.vem(self.screen) if self.vision else self.game.rem(self.ram)
        self.objects = jax.tree.map(np.asarray, found)

    def action(self) -> ale_py.Action:
        """The next action, from the policy or from the held keys."""
        if self.policy is not None:
            return self.actions[int(self.policy(self._seen())[0])]
        return held_action(self.held)

    def _seen(self) -> Seen:
        """The inputs of policies. A step is one frame, without pooling."""
        gray = np.zeros((1, *self.game.screen), np.uint8)
        self.ale.getScreenGrayscale(gray[0])
        return Seen(self.ram[None], np.array([self.started]), gray)

    def step(self) -> None:
        """Emulate the frames of one displayed frame, unless paused."""
        for _ in range(FRAMES_PER_SHOWN):
            if not self.paused:
                self.frame()

    def frame(self) -> None:
        """Emulate one frame. A finished game restarts."""
        if self.ale.game_over():
            self.ale.reset_game()
            self.reward, self.started = 0, True
        self.reward += self.ale.act(self.action())
        self.started = False
        self.held = {k: n - 1 for k, n in self.held.items() if n > 1}
        self._observe()

    def poke(self, address: int, value: int) -> None:
        """Write a byte. The next frame shows its effect."""
        if not (0 <= address < 128 and 0 <= value < 256):
            self.message = f"an address is 0-127 and a value 0-255, got {address} and {value}"
            return
        self.ale.setRAM(address, value)
        self.message = f"byte {address} is {value} now"
        self._observe()

    def key(self, key: str) -> None:
        """Handle a key press: a character, or a terminal's sequence for an arrow."""
        key = ARROWS.get(key, key)
        if self.typed is not None:
            self._type(key)
        elif key in MOVES:
            self.held[key] = HELD
        else:
            self._command(key)

    def _command(self, key: str) -> None:
        match key:
            case ":":
                self.typed = ""
            case "p":
                self.paused = not self.paused
                self.message = "paused; n steps one frame" if self.paused else HELP
            case "n":
                self.paused = True
                self.frame()
            case "v":
                self.vision = not self.vision
                self._observe()
                self.message = "boxes from pixels (VEM)" if self.vision else "boxes from RAM (REM)"
            case "k":
                self.saved = (self.ale.cloneState(include_rng=True), self.reward)
                self.message = "state saved"
            case "l" if self.saved is None:
                self.message = "no state has been saved: k saves one"
            case "l":
                state, self.reward = self.saved
                self.ale.restoreState(state)
                self._observe()
                self.message = "state loaded; the picture follows with the next frame"
            case "r":
                self.policy, self.message = (
                    self._random,
                    "random actions; m returns to the keyboard",
                )
            case "m":
                self.policy, self.message = None, HELP
            case "q" | "\x03" | "\x1b":  # Ctrl-C and Escape
                self.done = True

    def _type(self, key: str) -> None:
        assert self.typed is not None
        if key in ENTER:
            words, self.typed = self.typed.replace("=", " ").split(), None
            try:
                address, value = (int(w, 0) for w in words)
            except ValueError:
                self.message = "to poke type :ADDRESS VALUE, for example :51 120 or :0x33 0x78"
            else:
                self.poke(address, value)
        elif key == ESCAPE:
            self.typed = None
        elif key in BACKSPACE:
            self.typed = self.typed[:-1]
        elif key.isprintable() and len(key) == 1:
            self.typed += key

    def line(self) -> str:
        """The typed line, or else the message."""
        return self.message if self.typed is None else f":{self.typed}"

    def title(self) -> str:
        """The state of play in one line."""
        method, control = (
            "VEM" if self.vision else "REM",
            "paused" if self.paused else "by hand" if self.policy is None else "policy",
        )
        play = (
            f"frame {self.ale.getEpisodeFrameNumber()}  reward {self.reward}  lives "
            f"{self.ale.lives()}"
        )
        return f"{self.game.name}  {play}  {method}  {control}"


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
    """A function that returns the keys pressed since its last call; none without a terminal."""
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
    """Watch in a terminal until the session is done or `frames` frames are shown."""
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
