"""A window with a moving picture and text, which reports keys."""

import time
from collections.abc import Callable
from typing import Any

from PIL import Image

RATE = 30  # pictures shown per second


def show(
    title: str,
    step: Callable[[], tuple[Image.Image, str] | None],
    on_key: Callable[[str, bool], None],
) -> None:
    """Show pictures in a window until it is closed or `step` returns None.

    Args:
        title: the window's title.
        step: called 30 times a second; returns the next picture and the text beside it, or None to
            close the window.
        on_key: called with a key and whether it was pressed (True) or released. Keys are single
            characters, or Tk's names such as "Up" and "Escape".

    Raises:
        RuntimeError: the display or Python's tkinter is missing.
    """
    try:
        import tkinter

        from PIL import ImageTk

        root = tkinter.Tk()
    except Exception as error:
        raise RuntimeError(f"no window can be opened ({error})") from error
    root.title(title)
    picture, text = (
        tkinter.Label(root),
        tkinter.Label(root, font="TkFixedFont", justify="left", anchor="nw"),
    )
    picture.pack(side="left")
    text.pack(side="left", fill="both")
    due = time.monotonic()

    def update() -> None:
        nonlocal due
        if (shown := step()) is None:
            root.destroy()
            return
        image = ImageTk.PhotoImage(shown[0])
        picture.configure(image=image)
        picture.image = image  # pyright: ignore[reportAttributeAccessIssue]  # tkinter keeps no reference
        text.configure(text=shown[1])
        due = max(due + 1 / RATE, time.monotonic())
        root.after(max(1, round(1000 * (due - time.monotonic()))), update)

    def report(pressed: bool) -> Callable[[Any], None]:
        return lambda event: on_key(
            event.char if len(event.char) == 1 and event.char.isprintable() else event.keysym,
            pressed,
        )

    root.bind("<KeyPress>", report(True))
    root.bind("<KeyRelease>", report(False))
    update()
    root.mainloop()
