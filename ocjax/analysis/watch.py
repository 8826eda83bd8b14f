"""`ocjax ram watch`: play a game with its objects and changing bytes shown live, poke addresses, save and load states.

`Session` is the game and what is shown of it; `terminal` and `window` are two views of it. Keys are single characters in both.
"""

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Iterator
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

from ocjax.envs.pool import check_rom
from ocjax.render import category_colors, overlay
from ocjax.rollout import make_policy
from ocjax.spec import Game
from ocjax.vision.palette import NTSC

HELP = "wasd/arrows move, space fire, p pause, n one frame, v vision, k save, l load, :ADDRESS VALUE poke, r random, m by hand, q quit"
MOVES = {"w": "UP", "a": "LEFT", "s": "DOWN", "d": "RIGHT", " ": "FIRE"}
ARROWS = {"\x1b[A": "w", "\x1b[D": "a", "\x1b[B": "s", "\x1b[C": "d"}
HELD = 6  # emulated frames that a key press lasts: terminals do not tell releases
GLOW = 15  # frames that a changed byte stays marked
RATE = 30  # frames shown a second


class Session:
    """One emulator that is watched: its objects, its RAM with what changed lately, and a message.

    Args:
        game: what to play.
        policy: "keyboard", or what `ocjax.rollout.make_policy` takes.
        seed: of the emulator and the policy.
        game_mode: as ale-py numbers it.

    Raises:
        RomError, PolicyError, ValueError: a wrong ROM, policy or mode.
    """

    def __init__(self, game: Game, policy: str = "keyboard", seed: int = 0, game_mode: int | None = None) -> None:
        ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
        self.game, self.ale = game, ale_py.ALEInterface()
        self.ale.setInt("random_seed", seed)
        self.ale.setFloat("repeat_action_probability", 0.0)
        self.ale.loadROM(check_rom(game))
        if game_mode is not None:
            if game_mode not in self.ale.getAvailableModes():
                raise ValueError(f"{game.name} has no mode {game_mode}; it has {list(self.ale.getAvailableModes())}")
            self.ale.setMode(game_mode)
        self.ale.reset_game()
        self.actions = list(self.ale.getMinimalActionSet())
        self._random = make_policy("repeat", game, len(self.actions), 1, seed)
        self.policy = None if policy == "keyboard" else make_policy(policy, game, len(self.actions), 1, seed)
        self.paused = self.vision = self.done = False
        self.message, self.typed = HELP, None  # the line after ":" while it is typed
        self.saved: Any = None
        self.held: dict[str, int] = {}
        self.changed = np.zeros(128, int)  # frames that each byte still glows
        self.reward = 0
        self._look()

    def _look(self) -> None:
        before = getattr(self, "ram", None)
        self.ram, self.screen = self.ale.getRAM(), self.ale.getScreen()
        self.changed = np.maximum(self.changed - 1, 0)
        if before is not None:
            self.changed[before != self.ram] = GLOW
        found = self.game.vem(self.screen) if self.vision else self.game.rem(self.ram)
        self.objects = jax.tree.map(np.asarray, found)

    def action(self) -> ale_py.Action:
        """What is done next: by the policy, or by the keys that are held."""
        if self.policy is not None:
            return self.actions[int(self.policy(self.ram[None])[0])]
        # ALE names its actions by what is held: UPRIGHTFIRE, LEFT, FIRE, ...
        name = "".join(MOVES[k] for k in "wsda " if k in self.held)
        return getattr(ale_py.Action, name, ale_py.Action.NOOP)

    def step(self) -> None:
        """One emulated frame, unless paused; a game that is over starts again."""
        if not self.paused:
            self.frame()

    def frame(self) -> None:
        """One emulated frame."""
        if self.ale.game_over():
            self.ale.reset_game()
            self.reward = 0
        self.reward += self.ale.act(self.action())
        self.held = {k: n - 1 for k, n in self.held.items() if n > 1}
        self._look()

    def poke(self, address: int, value: int) -> None:
        """Write a byte; the frames show it from the next one on."""
        if not (0 <= address < 128 and 0 <= value < 256):
            self.message = f"an address is 0-127 and a value 0-255, got {address} and {value}"
            return
        self.ale.setRAM(address, value)
        self.message = f"byte {address} is {value} now"
        self._look()

    def key(self, key: str) -> None:
        """A key press: a character, or a terminal's sequence for an arrow."""
        key = ARROWS.get(key, key)
        if self.typed is not None:
            self._type(key)
        elif key == ":":
            self.typed = ""
        elif key in MOVES:
            self.held[key] = HELD
        elif key == "p":
            self.paused = not self.paused
            self.message = "paused; n: one frame" if self.paused else HELP
        elif key == "n":
            self.paused = True
            self.frame()
        elif key == "v":
            self.vision = not self.vision
            self._look()
            self.message = "boxes from pixels (VEM)" if self.vision else "boxes from RAM (REM)"
        elif key == "k":
            self.saved = (self.ale.cloneState(include_rng=True), self.reward)
            self.message = "state saved"
        elif key == "l" and self.saved is None:
            self.message = "no state has been saved: k saves one"
        elif key == "l":
            state, self.reward = self.saved
            self.ale.restoreState(state)
            self._look()
            self.message = "state loaded; the picture follows with the next frame"
        elif key == "r":
            self.policy, self.message = self._random, "random actions; m: by hand"
        elif key == "m":
            self.policy, self.message = None, HELP
        elif key in ("q", "\x03", "\x1b"):
            self.done = True

    def _type(self, key: str) -> None:
        assert self.typed is not None
        if key in ("\r", "\n"):
            words, self.typed = self.typed.replace("=", " ").split(), None
            try:
                address, value = (int(w, 0) for w in words)
            except ValueError:
                self.message = "to poke type :ADDRESS VALUE, e.g. :51 120 or :0x33 0x78"
            else:
                self.poke(address, value)
        elif key == "\x1b":
            self.typed = None
        elif key in ("\x7f", "\x08"):
            self.typed = self.typed[:-1]
        elif key.isprintable() and len(key) == 1:
            self.typed += key

    def line(self) -> str:
        """What is typed, or the message."""
        return self.message if self.typed is None else f":{self.typed}"

    def title(self) -> str:
        """State of play in a line."""
        method, way = "VEM" if self.vision else "REM", "paused" if self.paused else "by hand" if self.policy is None else "policy"
        return (
            f"{self.game.name}  frame {self.ale.getEpisodeFrameNumber()}  reward {self.reward}  lives {self.ale.lives()}  {method}  {way}"
        )


def _screen_text(session: Session, columns: int, rows: int) -> Text:
    """The screen with boxes in half blocks: two pixels a character."""
    frame = NTSC[session.screen].copy()
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


def _ram_text(session: Session) -> Text:
    """The RAM, sixteen bytes a row, what changed lately marked."""
    out = Text("     " + " ".join(f"{i:>3}" for i in range(16)) + "\n", no_wrap=True)
    for row in range(8):
        out.append(f"{16 * row:>4} ", "dim")
        for address in range(16 * row, 16 * row + 16):
            glow = session.changed[address]
            out.append(f"{session.ram[address]:>3} ", "bold black on yellow" if glow == GLOW else "yellow" if glow else "")
        out.append("\n")
    return out


def _objects_table(session: Session, rows: int) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("object", "x", "y", "w", "h", "value", "way"):
        table.add_column(heading, justify="left" if heading == "object" else "right")
    colors, records = category_colors(session.game), session.objects.to_list()
    for r in records[:rows]:
        numbers = (str(r.get(k, "")) for k in ("x", "y", "w", "h", "value", "orientation"))
        table.add_row(Text(f"{r['category']} {r['slot']}", "rgb({},{},{})".format(*colors[r["category"]])), *numbers)
    if len(records) > rows:
        table.add_row(f"and {len(records) - rows} more")
    return table


def panel(session: Session, width: int, height: int) -> Layout:
    """Everything, for a terminal of so many characters."""
    layout = Layout()
    layout.split_column(Layout(Text(session.title(), "bold"), size=1), Layout(name="middle"), Layout(Text(session.line(), "dim"), size=1))
    columns = max(20, min(160, width - 72))
    rows = max(8, height - 3)
    layout["middle"].split_row(Layout(_screen_text(session, columns, min(rows, 105)), size=columns + 1), Layout(name="right"))
    layout["right"].update(Group(_ram_text(session), _objects_table(session, max(1, rows - 11))))
    return layout


@contextlib.contextmanager
def _raw_keys() -> Iterator[Callable[[], list[str]]]:
    """Key presses of the terminal, without waiting; none where the input is no terminal."""
    if not sys.stdin.isatty():
        yield list
        return
    import termios
    import tty

    fd = sys.stdin.fileno()
    before = termios.tcgetattr(fd)

    def read() -> list[str]:
        out: list[str] = []
        while select.select([fd], [], [], 0)[0]:
            data = os.read(fd, 64).decode(errors="ignore")
            if not data:
                break
            while data:
                arrow = next((a for a in ARROWS if data.startswith(a)), data[0])
                out.append(arrow)
                data = data[len(arrow) :]
        return out

    try:
        tty.setcbreak(fd)
        yield read
    finally:
        termios.tcsetattr(fd, termios.TCSADRAIN, before)


def terminal(session: Session, console: Console, frames: int | None = None) -> None:
    """Watch in a terminal, over ssh too, until q is pressed or so many frames have been shown."""
    shown = 0
    with _raw_keys() as keys, Live(console=console, screen=console.is_terminal, auto_refresh=False) as live:
        while not session.done and (frames is None or shown < frames):
            start = time.perf_counter()
            for key in keys():
                session.key(key)
            session.step()
            session.step()  # the console draws 60 frames a second
            live.update(panel(session, console.width, console.height), refresh=True)
            shown += 1
            if frames is None:
                time.sleep(max(0.0, 1 / RATE - (time.perf_counter() - start)))


def window(session: Session, scale: int = 2) -> None:
    """Watch in a window, until it is closed or q is pressed.

    Raises:
        RuntimeError: there is no display, or Python has no tkinter.
    """
    try:
        import tkinter

        from PIL import ImageTk

        root = tkinter.Tk()
    except Exception as error:
        raise RuntimeError(f"no window can be opened ({error}); leave out --window for the view in the terminal") from error
    root.title(f"ocjax: {session.game.name}")
    picture, text = tkinter.Label(root), tkinter.Label(root, font="TkFixedFont", justify="left", anchor="nw")
    picture.pack(side="left")
    text.pack(side="left", fill="both")
    arrows = {"Up": "w", "Left": "a", "Down": "s", "Right": "d", "Return": "\r", "BackSpace": "\x08", "Escape": "\x1b"}

    def press(event: Any) -> None:
        key = arrows.get(event.keysym, event.char)
        if key:
            session.key(key)

    def show() -> None:
        session.step()
        session.step()
        image = ImageTk.PhotoImage(overlay(session.game, session.screen, session.objects, scale=scale))
        picture.configure(image=image)
        picture.image = image  # pyright: ignore[reportAttributeAccessIssue]  # tkinter keeps no reference
        lines = [" ".join(f"{v:>3}" for v in row) for row in session.ram.reshape(16, 8)]
        changed = " ".join(str(a) for a in np.flatnonzero(session.changed == GLOW))
        text.configure(text="\n".join([session.title(), "", *lines, "", f"changed: {changed}", "", *session.line().split(", ")]))
        if session.done:
            root.destroy()
        else:
            root.after(1000 // RATE, show)

    root.bind("<Key>", press)
    show()
    root.mainloop()
