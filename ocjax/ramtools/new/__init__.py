"""`ocjax ram new`: a game file that runs, for a game without a decoder."""

import hashlib
from pathlib import Path
from typing import NamedTuple

import ale_py
import numpy as np

from ocjax.console.palette import NTSC, PAL
from ocjax.ramtools import roms
from ocjax.ramtools.new import fonts
from ocjax.ramtools.new.colors import Color, Mixed, mixed, survey

__all__ = ["NewGame", "describe", "source"]

APART = 20  # frames of play from one frame of the survey to the next
HEIGHT = 210  # rows of a game's screen, unless its declaration says otherwise
MOST_FONTS = 4
MIRRORED = """\
# Mirror images, for parts of the playfield that the chip draws backwards (PF0 and PF2). Use a font
# that is not mirrored, or write the pictures with `hex_font`.
"""
TOUCHING = """\
# Colours that touch each other. If they are stripes or parts of one object, replace their
# categories by one, with all colours in its rule: Blobs((30, 40), shapes=Shape(...)).
"""
IMPORTED = ("Blobs", "Box", "Category", "Game", "RamMap", "Rom", "Shape", "box")
TEMPLATE = '''\
"""{name}: say in one sentence what is on the screen.

Screen: describe the picture. {height} rows; modes {modes}, difficulties {difficulties}.

Not exact: everything. This file was made from {frames} frames of random play. The next steps are:

1. Play the game (`ocjax play {name} --human`). Rename the categories to OCAtari's names, merge
   colours that belong to one object, and delete scenery. `ocjax demo {name}` draws VEM's boxes.
2. Give displays a rule of their own: `display(...)` with `NumberDisplay(FONT, ...)`.
3. Find the bytes: `ocjax ram correlate {name} --write -` proposes the class `Ram`, and
   `ocjax ram disassemble {name}` lists the program. Then write `decode`.
4. Follow .github/CONTRIBUTING.md from its step 4 on. Replace this list by what you found out.
"""

from ocjax.authoring import {imports}

ROM = Rom("{rom}", "{md5}")
{fonts}
# Palette indices. The comments count connected components of at most 64 x 64 pixels.
{colors}
{mixed}

class Ram(RamMap):
    pass  # a line for each byte, such as: player_x = byte(49)  # x + 5


def decode(m: Ram) -> dict[str, Box]:
    return {{c.name: box(0, 0, 0, 0, valid=False) for c in CATEGORIES}}


# One category for each colour of small components. The docs say where they were.
CATEGORIES = (
{categories}
)

GAME = Game(
    name="{name}",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=CATEGORIES,{options}
)
'''


class NewGame(NamedTuple):
    """Facts about a game without a decoder.

    Args:
        name: as in Gymnasium's "ALE/<Name>-v5".
        rom: ale-py's name of the ROM.
        height: rows of the screen.
        pal: whether it has the palette of PAL consoles.
        frames: number of frames of the survey.
        fonts: pictures in the ROM that look like digits.
        mixed: colours that touch each other.
    """

    name: str
    rom: str
    md5: str
    height: int
    pal: bool
    modes: tuple[int, ...]
    difficulties: tuple[int, ...]
    frames: int
    fonts: tuple[fonts.FoundFont, ...]
    colors: tuple[Color, ...]
    mixed: tuple[Mixed, ...]


def describe(name: str, *, frames: int = 60, seed: int = 0) -> NewGame:
    """Collect the facts about a game; see `roms.find` for its name."""
    found = roms.find(name)
    data = Path(found.path).read_bytes()
    screens, ale = [], None
    for ale in roms.moments(found, frames, APART, seed):
        screens.append(ale.getScreen())
    assert ale is not None
    colors = survey(np.stack(screens))
    return NewGame(
        name=found.name,
        rom=found.rom,
        md5=hashlib.md5(data, usedforsecurity=False).hexdigest(),
        height=screens[0].shape[0],
        pal=_is_pal(ale),
        modes=tuple(ale.getAvailableModes()),
        difficulties=tuple(ale.getAvailableDifficulties()),
        frames=frames,
        fonts=tuple(fonts.find(np.frombuffer(data, np.uint8))[:MOST_FONTS]),
        colors=tuple(colors),
        mixed=tuple(mixed(np.stack(screens), colors)),
    )


def _is_pal(ale: ale_py.ALEInterface) -> bool:
    screen, rgb = ale.getScreen(), ale.getScreenRGB()
    wrong = [int((palette[screen] != rgb).any(axis=-1).sum()) for palette in (NTSC, PAL)]
    return wrong[1] < wrong[0]


def source(game: NewGame) -> str:
    """The source of a game file that runs."""
    objects = [color for color in game.colors if not color.is_scenery]
    lines = [f"COLOR_{c.index} = {c.index}  # {_comment(game, c)}" for c in game.colors]
    numbers = [
        f"{MIRRORED if found.mirrored else ''}{f'FONT_{i + 1}' if i else 'FONT'} = {found}"
        for i, found in enumerate(game.fonts)
    ]
    note = "# Pictures in the ROM that look like the digits 0-9. Delete the ones that are not."
    missing = "# No digits were found in the ROM."
    options = [f"screen=({game.height}, 160)"] if game.height != HEIGHT else []
    options += ["pal=True"] if game.pal else []
    return TEMPLATE.format(
        name=game.name,
        height=game.height,
        modes=_numbers(game.modes),
        difficulties=_numbers(game.difficulties),
        frames=game.frames,
        imports=", ".join(IMPORTED),
        rom=game.rom,
        md5=game.md5,
        fonts="\n".join([note, *numbers] if numbers else [missing]),
        colors="\n".join(lines),
        mixed=_touching(game.mixed),
        categories="\n".join(_category(game, c) for c in objects),
        options="".join(f"\n    {option}," for option in options),
    )


def _numbers(numbers: tuple[int, ...]) -> str:
    return ", ".join(map(str, numbers))


def _comment(game: NewGame, color: Color) -> str:
    red, green, blue = (PAL if game.pal else NTSC)[color.index].tolist()
    rgb = f"({red}, {green}, {blue}), in {100 * color.seen:.0f} % of the frames"
    if color.is_scenery:
        return f"{rgb}: scenery"
    sizes = ", ".join(f"{w} x {h}" for w, h in color.usual)
    return f"{rgb}; up to {color.most}, mostly {sizes}"


def _touching(found: tuple[Mixed, ...]) -> str:
    """Comments about colours that may belong to one object."""
    if not found:
        return ""
    lines = [TOUCHING]
    for one in found:
        colors, (w, h) = _numbers(one.colors), one.size
        lines.append(f"# {colors}: {one.count:.1f} per frame, mostly {w} x {h}\n")
    return "".join(lines)


def _hint(game: NewGame, color: Color) -> str:
    """A comment about the other colours of an object, the most frequent ones."""
    others = (set(one.colors) - {color.index} for one in game.mixed if color.index in one.colors)
    together = next(others, set())
    if not together:
        return ""
    names = _numbers(tuple(sorted(together)))
    return f"    # It touches {names}: is it a part of an object of several colours?\n"


def _category(game: NewGame, color: Color) -> str:
    left, top, right, bottom = color.area
    shape = f"Shape(w={color.w}, h={color.h})"
    doc = f"x {left}-{right - 1}, y {top}-{bottom - 1}, {color.places:,} positions"
    return (
        f"{_hint(game, color)}"
        f"    Category(\n"
        f'        "Color{color.index}",\n'
        f"        Blobs(COLOR_{color.index}, shapes={shape}),\n"
        f"        count={color.most},\n"
        f'        doc="{doc}",\n'
        f"    ),"
    )
