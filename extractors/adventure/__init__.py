"""Adventure: a square in a land of castles and mazes, who is to bring home a chalice.

Screen: a room, whose walls have one colour on grey; Player is a square of their colour. Dragons, a
bat, keys and what else there is are sprites before the walls. Each castle has a Gate. Dark rooms
have walls as grey as the ground: what lights them round the player is a sprite, too, and scenery,
and walls hide things. BridgeEdge is a rail of the bridge. Dot is grey and shows only before walls
or light. Level is the number on the menu, and Author the name in the secret room. Thin walls at
the sides are scenery.

Slots: a Gate is the yellow, the white and the black castle's. A bridge has its left rail first.

RAM: the disassembly in milnak/atari-vcs-disassembly names the bytes, and the ROM's code tells when
they change. Two things are drawn, for three frames (a turn); if a room has more, they take turns.
Things that this turn does not show are where their records are now. A return address on the stack
tells the frame of the turn, and so how far the player has moved since (F32B-F362).

Covered: all rooms with all things put into them, three games, all difficulties, both endings.

Not exact: into a corner, the third frame of a turn may have shown the player four columns aside.
Neither a thing that hides a part of another, or of the player, nor a wall of its own colour behind
it makes its box smaller. Bridges in dark rooms have whole rails.

VEM: it does not see the player where less than four lines of him show, things before a wall of
their own colour, and few parts of things, where the edge or a dark room's walls cut them.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.ops import match
from ocjax.console.registers import modulo_screen
from ocjax.extraction.game import Category, Game
from ocjax.extractors.adventure import ram as thing
from ocjax.extractors.adventure.drawn import (
    Drawn,
    as_drawn,
    cut_things,
    place_of,
    player_box,
    thing_box,
)
from ocjax.extractors.adventure.ram import ROM, Ram, Wait
from ocjax.extractors.adventure.rooms import COLORS, VIEW, row_of, walls_at
from ocjax.extractors.adventure.vision import (
    COLORED,
    IS_DOT,
    IS_PLAYER,
    LAMP,
    NOT_SQUARE,
    NOT_WALLS,
)
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shades import Saver
from ocjax.vision.shapes import Shape

SAVES = 128  # from here on, `saver` changes the colours
RAILS = (0, 24)  # columns of the bridge's rails
RAIL_WIDTH = 8
BRIDGE_HEIGHT = 48


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    boxes = functools.partial(thing_box, m, drawn, cut_things(drawn))
    flash = _flash_color(m)
    return {
        "Player": _of_color(player_box(drawn), drawn.color),
        "RedDragon": boxes(thing.RED_DRAGON),
        "YellowDragon": boxes(thing.YELLOW_DRAGON),
        "GreenDragon": boxes(thing.GREEN_DRAGON),
        "DragonSword": boxes(thing.SWORD),
        "BridgeEdge": _bridge_box(m, drawn),
        "YellowKey": boxes(thing.YELLOW_KEY),
        "WhiteKey": boxes(thing.WHITE_KEY),
        "BlackKey": boxes(thing.BLACK_KEY),
        "BlackBat": boxes(thing.BAT),
        "Magnet": boxes(thing.MAGNET),
        "Chalice": _of_color(boxes(thing.CHALICE), flash),
        "Gate": _stacked([boxes(gate) for gate in thing.GATES]),
        "Dot": _dot(m, drawn, boxes(thing.DOT)),
        "Level": boxes(thing.LEVEL),
        "Author": _of_color(boxes(thing.AUTHOR), flash),
    }


def _of_color(of: Box, color: jax.Array) -> Box:
    return replace(of, color=color)


def _flash_color(m: Ram) -> jax.Array:
    """The colour of what flashes: it changes before the first frame of a turn."""
    ahead = match((m.wait == Wait.THIRD, 1), (m.wait == Wait.WON, 2), otherwise=0)
    return 2 * (m.flash - ahead) & 255


def _bridge_box(m: Ram, drawn: Drawn) -> Box:
    at = place_of(m, drawn, thing.BRIDGE)
    left = modulo_screen(at.x + 1 + np.array(RAILS))
    return box(left, at.y, RAIL_WIDTH, BRIDGE_HEIGHT, at.there).clip(*VIEW)


def _stacked(boxes: list[Box]) -> Box:
    return jax.tree.map(lambda *sides: jnp.stack(sides), *boxes)


def _dot(m: Ram, drawn: Drawn, of: Box) -> Box:
    """It has the background's colour and shows on walls alone, or in a dark room on the light."""
    on_wall = walls_at(drawn.room, row_of(of.y), of.x) >= 128
    x, y = of.x - m.light_x, of.y - (238 - 2 * m.light_y)
    lit = (x >= 0) & (x < 32) & (y >= 0) & (y < 64)
    return of.where(jnp.where(drawn.dark, lit & ~on_wall, on_wall))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver >= SAVES, 2 * m.saver & 255, -1)


RED = 0x66
YELLOW = 0x2A
GREEN = 0x58
PURPLE = 0x86
WHITE = 0x0E
BLACK = 0x00
GREY = 0x08
OTHERS = (RED, YELLOW, GREEN, GREY)  # dragons that the lower edge cut_things off may have its shape
FLASHES = tuple(color for color in range(0, 256, 2) if color not in OTHERS)
WALL_COLORS = tuple(dict.fromkeys(COLORS.tolist()))

field = functools.partial(Blobs, region=VIEW, filters=(NOT_WALLS,))
SQUARE_SHAPES = (Shape((2, 4), (2, 8)), Shape(1, (4, 8)))
small = functools.partial(Blobs, region=VIEW, filters=(NOT_SQUARE,))
DRAGON_SHAPES = (
    Shape(8, 8, pixels=(24, 38)),  # first rows above the lower edge
    Shape(8, 10, pixels=(26, 44)),
    Shape(8, 12, pixels=(32, 46)),
    Shape(8, 14, pixels=(40, 48)),
    Shape((2, 8), (15, 44)),
)
RED_SHAPES = (Shape((5, 8), (2, 44)), Shape((1, 8), (9, 44)))
GREEN_SHAPES = (Shape((6, 8), (6, 44)), Shape((2, 8), (15, 44)))
KEY_SHAPE = Shape(8, 6, pixels=30)
KEY_SHAPES = (KEY_SHAPE, Shape((5, 7), 6, pixels=(14, 26)))
WHITE_SHAPE = Shape((1, 8), (2, 6))
SWORD_SHAPE = Shape(8, 10, pixels=24)
MAGNET_SHAPE = Shape(8, 16, pixels=72)
GATE_VIEW = (76, 140, 83, 172)
GATE_SHAPE = Shape(7, (8, 32))
CHALICE_SHAPE = Shape(8, 18, pixels=68)
LEVEL_SHAPE = Shape((3, 5), 14)
BAT_SHAPES = (Shape(8, 14), Shape(8, 22), Shape(8, (8, 12)))


GAME = Game(
    name="Adventure",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    saver=Saver(_saver_key, (20, 120), GREY, mask=0xF6, taken=(LAMP,), beside=(106, 190)),
    categories=(
        Category(
            "Player",
            Blobs(WALL_COLORS, VIEW, SQUARE_SHAPES, gap=(1, 2), filters=(IS_PLAYER,)),
            doc="the square, in the colour of the walls",
        ),
        Category("RedDragon", field(RED, shapes=RED_SHAPES), blinks=True, doc="Rhindle"),
        Category("YellowDragon", field(YELLOW, shapes=DRAGON_SHAPES), blinks=True, doc="Yorgle"),
        Category("GreenDragon", field(GREEN, shapes=GREEN_SHAPES), blinks=True, doc="Grundle"),
        Category(
            "DragonSword", small(YELLOW, shapes=SWORD_SHAPE), blinks=True, doc="it kills dragons"
        ),
        Category(
            "BridgeEdge",
            field(PURPLE, shapes=Shape((4, 8), (10, 48))),
            count=2,
            blinks=True,
            doc="the rails of the bridge",
        ),
        Category(
            "YellowKey", small(YELLOW, shapes=KEY_SHAPES), blinks=True, doc="of the yellow castle"
        ),
        Category(
            "WhiteKey", field(WHITE, shapes=WHITE_SHAPE), blinks=True, doc="of the white castle"
        ),
        Category(
            "BlackKey", small(BLACK, shapes=KEY_SHAPE), blinks=True, doc="of the black castle"
        ),
        Category(
            "BlackBat", field(BLACK, shapes=BAT_SHAPES, gap=(1, 2)), blinks=True, doc="it steals"
        ),
        Category(
            "Magnet", field(BLACK, shapes=MAGNET_SHAPE), blinks=True, doc="it draws things near"
        ),
        Category(
            "Chalice",
            Blobs(FLASHES, VIEW, CHALICE_SHAPE, filters=(COLORED,)),
            blinks=True,
            doc="it flashes",
        ),
        Category(
            "Gate",
            replace(field(BLACK, shapes=GATE_SHAPE), region=GATE_VIEW),
            count=3,
            blinks=True,
            doc="of the castles",
        ),
        Category(
            "Dot",
            Blobs(GREY, VIEW, Shape(1, 2), filters=(IS_DOT,)),
            blinks=True,
            doc="the secret key",
        ),
        Category("Level", field(GREEN, shapes=LEVEL_SHAPE), doc="the number on the menu"),
        Category(
            "Author",
            Bounds(FLASHES, (79, 28, 87, 220), (8, 180), filters=(COLORED,)),
            doc="the name in the secret room",
        ),
    ),
)
