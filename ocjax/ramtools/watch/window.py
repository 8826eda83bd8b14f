"""`ocjax ram watch --window`: watch in a window."""

from typing import Any

import numpy as np

from ocjax.ramtools.watch.session import GLOW, RATE, Session
from ocjax.transforms.drawing import overlay

KEYS = {"Up": "w", "Left": "a", "Down": "s", "Right": "d", "Return": "\r", "BackSpace": "\x08", "Escape": "\x1b"}
BYTES_PER_ROW = 8


def sidebar(session: Session) -> str:
    """The text beside the picture: state of play, RAM, bytes that changed last, and the message."""
    rows = [" ".join(f"{v:>3}" for v in row) for row in session.ram.reshape(-1, BYTES_PER_ROW)]
    changed = " ".join(str(address) for address in np.flatnonzero(session.changed == GLOW))
    return "\n".join([session.title(), "", *rows, "", f"changed: {changed}", "", *session.line().split(", ")])


def watch(session: Session, scale: int = 2) -> None:
    """Watch in a window until it is closed or the session is done.

    Args:
        session: what is watched.
        scale: window pixels per screen pixel; twice as many across.

    Raises:
        RuntimeError: there is no display, or Python has no tkinter.
    """
    try:
        import tkinter

        from PIL import ImageTk

        root = tkinter.Tk()
    except Exception as error:
        raise RuntimeError(f"no window can be opened ({error}); without --window the terminal is used") from error
    root.title(f"ocjax: {session.game.name}")
    picture, text = tkinter.Label(root), tkinter.Label(root, font="TkFixedFont", justify="left", anchor="nw")
    picture.pack(side="left")
    text.pack(side="left", fill="both")

    def press(event: Any) -> None:
        if key := KEYS.get(event.keysym, event.char):
            session.key(key)

    def show() -> None:
        session.step()
        image = ImageTk.PhotoImage(overlay(session.game, session.screen, session.objects, scale=scale))
        picture.configure(image=image)
        picture.image = image  # pyright: ignore[reportAttributeAccessIssue]  # tkinter keeps no reference
        text.configure(text=sidebar(session))
        if session.done:
            root.destroy()
        else:
            root.after(1000 // RATE, show)

    root.bind("<Key>", press)
    show()
    root.mainloop()
