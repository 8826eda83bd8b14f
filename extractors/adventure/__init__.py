"""Adventure: a square in a land of castles and mazes looks for a chalice and brings it home.

Picture: docs/games/Adventure.png

Screen: a room with walls of one colour on grey. Player is a square in the walls' colour. Dragons, a
bat, keys and the other things are sprites before the walls. Each castle has a Gate. Dark rooms have
walls as grey as the ground. A sprite lights them round the player; it is scenery, and walls hide
things there. BridgeEdge is a rail of the bridge. Dot is grey and visible only before walls or
light. Level is the number on the menu, Author the name in the secret room.

Slots: a bridge's left rail is first.

Terrain: the walls of the room, from the ROM's table of rooms. Four rooms have a thin wall at one
side, which is a kind of its own. So are the walls of dark rooms; the pixels show only the part in
the light. The pixels do not show a thin wall in the ground's colour.

RAM: the disassembly in milnak/atari-vcs-disassembly names the bytes, and the ROM's code shows when
they change. The game draws two things for three frames (a turn); if a room has more, they
alternate. Things of other turns have the current positions of their records. A return address on
the stack gives the frame of the turn, and therefore the player's motion since then (F32B-F362).

Covered: all rooms with all things put into them, three games, all difficulties, lost games.

Not exact: the box of a partly hidden thing does not become smaller. In a corner, the player's
position on the third frame of a turn is a guess. Bridges hide nothing, and in dark rooms their
rails are complete.

VEM: it finds few of the things that the edge or walls cut, and no black things that touch each
other.
"""

import functools
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Saver,
    Shape,
    Variants,
    among,
    box,
    choose,
    modulo_screen,
    when,
)
from ocjax.extractors.adventure.drawn import THING_LINE, Drawn, as_drawn
from ocjax.extractors.adventure.pictures import ROW_LINES
from ocjax.extractors.adventure.player import player_box
from ocjax.extractors.adventure.ram import GATES, ROM, Ram, Thing, Wait
from ocjax.extractors.adventure.rooms import COLORS, VIEW, row_of, walls_at
from ocjax.extractors.adventure.terrain import TERRAIN
from ocjax.extractors.adventure.things import cut_things, place_of, thing_box
from ocjax.extractors.adventure.vision import (
    BLACK,
    FLASHES,
    GRAY,
    GREEN,
    IS_DOT,
    IS_FLASH,
    IS_PLAYER,
    LAMP,
    NOT_SQUARE,
    NOT_WALLS,
    PURPLE,
    RED,
    WHITE,
    YELLOW,
)

SAVES = 128  # least `saver` while it changes the colours
RAILS = (0, 24)  # columns of the bridge's rails
RAIL_WIDTH = 8
BRIDGE_HEIGHT = 48
YELLOW_CASTLE = 0x11  # room
WHITE_CASTLE = 0x0F  # room
FIRST_COLUMN = 128  # mask of the first of the eight columns of `walls_at`
LIGHT_WIDTH = 32  # of the sprite that lights a dark room round the player
LIGHT_HEIGHT = 64


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    boxes = functools.partial(thing_box, m, drawn, cut_things(drawn))
    flash = _flash_color(m)
    return {
        "Player": _of_color(player_box(drawn), drawn.color),
        "RedDragon": boxes(Thing.RED_DRAGON),
        "YellowDragon": boxes(Thing.YELLOW_DRAGON),
        "GreenDragon": boxes(Thing.GREEN_DRAGON),
        "DragonSword": boxes(Thing.SWORD),
        "BridgeEdge": _bridge_box(m, drawn),
        "YellowKey": boxes(Thing.YELLOW_KEY),
        "WhiteKey": boxes(Thing.WHITE_KEY),
        "BlackKey": boxes(Thing.BLACK_KEY),
        "BlackBat": boxes(Thing.BAT),
        "Magnet": boxes(Thing.MAGNET),
        "Chalice": _of_color(boxes(Thing.CHALICE), flash),
        "Gate": _choose_gate(drawn, [boxes(number) for number in GATES]),
        "Dot": _dot(m, drawn, boxes(Thing.DOT)),
        "Level": boxes(Thing.LEVEL),
        "Author": _of_color(boxes(Thing.AUTHOR), flash),
    }


def _of_color(of: Box, color: jax.Array) -> Box:
    return replace(of, color=color)


def _flash_color(m: Ram) -> jax.Array:
    """The flashing colour: it changes before the first frame of a turn."""
    return 2 * (m.flash - when(m.wait == Wait.THIRD, 1)) & 255


def _bridge_box(m: Ram, drawn: Drawn) -> Box:
    at = place_of(m, drawn, Thing.BRIDGE)
    left = modulo_screen(at.x + 1 + np.array(RAILS))
    return box(left, at.y, RAIL_WIDTH, BRIDGE_HEIGHT, at.there).clip(*VIEW)


def _choose_gate(drawn: Drawn, boxes: list[Box]) -> Box:
    """The gate of the castle on the screen."""
    of_yellow, of_white, of_black = boxes
    not_yellow = choose(drawn.room == WHITE_CASTLE, of_white, of_black)
    return choose(drawn.room == YELLOW_CASTLE, of_yellow, not_yellow)


def _dot(m: Ram, drawn: Drawn, of: Box) -> Box:
    """It has the background's colour, so only walls show it, or the light in a dark room."""
    on_wall = (walls_at(drawn.room, row_of(of.y), of.x) & FIRST_COLUMN) > 0
    x = of.x - m.light_x
    y = of.y - (THING_LINE - ROW_LINES * m.light_y)
    is_lit = among(x, range(LIGHT_WIDTH)) & among(y, range(LIGHT_HEIGHT))
    return of.where(jnp.where(drawn.dark, is_lit & ~on_wall, on_wall))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver >= SAVES, 2 * m.saver & 255, -1)


WALL_COLORS = tuple(dict.fromkeys(COLORS.tolist()))


def field(color: int, shapes: Shape | tuple[Shape, ...], **more: Any) -> Blobs:
    """A rule for things of one colour."""
    return Blobs(color, VIEW, shapes, filters=(NOT_WALLS[color],), **more)


def small(color: int, shapes: Shape | tuple[Shape, ...]) -> Blobs:
    """A rule for things in a colour that walls and the player may share."""
    return Blobs(color, VIEW, shapes, filters=(NOT_SQUARE[color],))


SQUARE_SHAPES = (Shape((2, 4), (2, 8)), Shape(1, (4, 8)))
SQUARES = Blobs(WALL_COLORS, VIEW, SQUARE_SHAPES, gap=(1, 2), filters=(IS_PLAYER,))
RED_SHAPES = (Shape((5, 8), (2, 44)), Shape((1, 8), (9, 44)))
YELLOW_SHAPES = (
    Shape(8, 8, pixels=(24, 38)),  # first rows above the lower edge
    Shape(8, 10, pixels=(26, 44)),
    Shape(8, 12, pixels=(32, 46)),
    Shape(8, 14, pixels=(40, 48)),
    Shape((2, 8), (15, 44)),
)
GREEN_SHAPES = (Shape((6, 8), (6, 44)), Shape((2, 8), (15, 44)))
SWORD = small(YELLOW, shapes=Shape(8, 10, pixels=24))
RAIL_SHAPE = Shape((4, 8), (10, 48))
KEY_SHAPE = Shape(8, 6, pixels=30)
YELLOW_KEY = small(YELLOW, shapes=(KEY_SHAPE, Shape((5, 7), 6, pixels=(14, 26))))
WHITE_KEY = field(WHITE, shapes=Shape((1, 8), (2, 6)))
BLACK_KEY = small(BLACK, shapes=KEY_SHAPE)
BATS = field(BLACK, shapes=(Shape(8, 14), Shape(8, 22), Shape(8, (8, 12))), gap=(1, 2))
MAGNET = field(BLACK, shapes=Shape(8, 16, pixels=72))
CHALICE = Blobs(FLASHES, VIEW, Shape(8, 18, pixels=68), filters=(IS_FLASH,))
GATE = Bounds(BLACK, (76, 140, 83, 172), (7, 8), (7, 32), filters=(NOT_WALLS[BLACK],))
DOT_ALONE = Bounds(GRAY, VIEW, (1, 2), (1, 2), filters=(IS_DOT,))
LEVEL_NUMBER = Bounds(GREEN, (79, 110, 87, 124), (3, 14), (5, 14))
NAME = Bounds(FLASHES, (79, 28, 87, 220), (8, 180), filters=(IS_FLASH,))

# The game alternates things that share a room with two others.
taking_turns = functools.partial(Category, blinks=True)


GAME = Game(
    name="Adventure",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    screen=(250, 160),
    pal=True,
    saver=Saver(_saver_key, (20, 120), GRAY, mask=0xF6, taken=(LAMP,), beside=(106, 190)),
    checks=Checks(
        # Objects take turns of three frames, and many rooms have three.
        # In unusual states, three things take turns, and walls of dark rooms are before them.
        agreement={"samples": 0.97, "modes": 0.8},
        terrain_differs=24,  # pictures of edited states show the room before, in other colours
        # The rewards for the chalice in the castle and for being eaten depend on rooms and on a
        # dragon's state, which the objects do not show.
        returns="unknown",
        rare=("Author", "Chalice", "Gate", "Level", "WhiteKey"),
        saver_hides=("BlackBat", "BlackKey", "Gate", "Magnet"),
    ),
    variants=Variants(
        modes={
            0: "a smaller kingdom without the white castle, the bat and the red dragon",
            1: "the full kingdom, with objects at fixed places",
            2: "the full kingdom, with objects at random places",
        },
        source="ALE's source code",
    ),
    categories=(
        Category("Player", SQUARES, role="player", doc="the square, in the colour of the walls"),
        taking_turns("RedDragon", field(RED, shapes=RED_SHAPES), doc="Rhindle"),
        taking_turns("YellowDragon", field(YELLOW, shapes=YELLOW_SHAPES), doc="Yorgle"),
        taking_turns("GreenDragon", field(GREEN, shapes=GREEN_SHAPES), doc="Grundle"),
        taking_turns("DragonSword", SWORD, doc="it kills dragons"),
        taking_turns("BridgeEdge", field(PURPLE, shapes=RAIL_SHAPE), count=2, doc="the rails"),
        taking_turns("YellowKey", YELLOW_KEY, doc="of the yellow castle"),
        taking_turns("WhiteKey", WHITE_KEY, doc="of the white castle"),
        taking_turns("BlackKey", BLACK_KEY, doc="of the black castle"),
        taking_turns("BlackBat", BATS, doc="it steals"),
        taking_turns("Magnet", MAGNET, doc="it draws things near"),
        taking_turns("Chalice", CHALICE, doc="it flashes"),
        taking_turns("Gate", GATE, doc="of a castle"),
        taking_turns("Dot", DOT_ALONE, doc="the secret key"),
        Category("Level", LEVEL_NUMBER, doc="the number on the menu"),
        Category("Author", NAME, doc="the name in the secret room"),
    ),
)
