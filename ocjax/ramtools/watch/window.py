"""`ocjax ram watch --window`: watch in a window."""

import numpy as np
from PIL import Image

from ocjax.play import window
from ocjax.ramtools.watch.session import GLOW, Session
from ocjax.transforms.drawing import overlay

# Tk's names
KEYS = {
    "Up": "w",
    "Left": "a",
    "Down": "s",
    "Right": "d",
    "Return": "\r",
    "BackSpace": "\x08",
    "Escape": "\x1b",
}
BYTES_PER_ROW = 8


def sidebar(session: Session) -> str:
    """The text beside the picture: state of play, RAM, changed bytes, and the message."""
    rows = [" ".join(f"{v:>3}" for v in row) for row in session.ram.reshape(-1, BYTES_PER_ROW)]
    changed = " ".join(str(address) for address in np.flatnonzero(session.changed == GLOW))
    return "\n".join(
        [session.title(), "", *rows, "", f"changed: {changed}", "", *session.line().split(", ")]
    )


def watch(session: Session, scale: int = 2) -> None:
    """Watch in a window until it is closed or the session is done.

    Args:
        session: the session to watch.
        scale: window pixels per screen pixel; twice this number horizontally.

    Raises:
        RuntimeError: the display or tkinter is missing.
    """

    def step() -> tuple[Image.Image, str] | None:
        session.step()
        if session.done:
            return None
        return overlay(session.game, session.screen, session.objects, scale=scale), sidebar(session)

    def on_key(key: str, pressed: bool) -> None:
        if pressed:
            session.key(KEYS.get(key, key))

    window.show(f"ocjax: {session.game.name}", step, on_key)
