"""Tutankham: a man explores four maps of a tomb, shoots creatures and looks for treasures.

Picture: docs/games/Tutankham.png

Screen: the map scrolls up and down. The remains of creatures and of the man when they die are
scenery. After a lost life, figures replace Score for a second; Score then has their box.

Slots: Creature has the game's records; Treasure has the order in the map. The orientation is the
side that a picture faces; figures that walk up or down have the picture for right or left.

Terrain: corridors, and the rock round them, from the map's rows in the ROM. Gates at the sides lead
to the other side of the map. The chip's movement of sprites makes eight columns of single lines
black, which the pixels count as the line above.

RAM: ALE's source (score, lives) and the ROM's code; `maps` has its tables. After the drawing, the
game has counted its clock, and at times taken a life or turned a figure; positions are as drawn.
The display program draws bands of four rows, and each object has to begin in a different band. If
two would begin in one band, the program moves one of them; see `_drawn_y`.

Covered: the first map in play, the others by writing RAM; all modes, deaths, flashes, the end.

Not exact, because the RAM does not have it: the direction of a figure before it turned, so its box
is a column off; the creatures of a game's last frame; frames of the last map that the game begins a
row late. A box that the lower edge cuts can be wider than its remaining rows. A shot may have the
colour of a creature instead of the man's, or white.

VEM: it includes a shot that touches the man in his box, and misses treasures in the walls' colours.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Colors,
    Digits,
    Game,
    Gauge,
    IconRow,
    NumberDisplay,
    Shape,
    among,
    box,
    choose,
    display,
    lookup,
    match,
    shift_up,
    spread,
    when,
)
from ocjax.extractors.tutankham.maps import (
    FIGURE_EXTENTS,
    FIGURE_PICTURES,
    INKS,
    LOOKS,
    MAP_ROW,
    ORDER,
    PLACES,
    ROM,
    THING_COLORS,
    THING_EXTENTS,
    THING_LEFTS,
    THING_PICTURES,
    THING_ROWS,
    shapes_of,
)
from ocjax.extractors.tutankham.ram import Event, Ram, Scene
from ocjax.extractors.tutankham.terrain import TERRAIN

FONT = ROM.font(0x800, rows=7, stride=8, top_first=True)
POINTS = NumberDisplay(FONT, right=71, top=186, digits=4)
LIFE_ICONS = IconRow(left=12, top=24, width=2, height=6, pitch=16)
FLASH_ICONS = IconRow(left=108, top=24, width=2, height=6, pitch=16)
MEN = IconRow(left=40, top=186, width=5, height=7, pitch=8)  # in place of the score

VIEW = (0, 35, 160, 175)  # of the map
STANDS = 4  # least look of a standing player
WITH_KEY = 16  # added to the player's look
FAR = 4 * 256  # behind all figures
NONE = 255  # y of no object
RECORDS = np.array((0x86, 0x89, 0x8C, 0x8F))  # addresses of the figures' records
TAIL = 144  # right edge of the timer
THING_WORDS = (THING_ROWS | THING_LEFTS << 8 | THING_COLORS << 16 | ORDER << 24).ravel()
SHOT_COLOR = 4  # number of the colour of a shot above all figures


class Things(NamedTuple):
    """Treasures, the key and the door of a map, `[8]` each."""

    y: jax.Array  # rows below the first one of the screen
    listed_y: jax.Array  # when the game listed them, before it scrolled the map
    left: jax.Array
    color: jax.Array
    there: jax.Array  # not taken, and in the listed part of the map


TREASURES = slice(0, 6)
KEYS = slice(6, 7)
DOORS = slice(7, 8)


def decode(m: Ram) -> dict[str, Box]:
    in_play = m.scene != Scene.TITLE
    things = _things_listed(m)
    y = _drawn_y(m, things)
    thing = _thing_boxes(m, things, y).where(in_play)
    figure = _figure_boxes(m, y).where(in_play)
    return {
        "Player": figure[0:1].where((m.scene != Scene.OVER) & (m.event != Event.DIES)),
        "Creature": figure[1:],
        "PlayerShot": _shot_box(m, y).where(in_play),
        "Treasure": thing[TREASURES],
        "Key": thing[KEYS],
        "Door": thing[DOORS],
        "Score": _score_box(m),
        "Lives": LIFE_ICONS.box(m.lives + _just_lost(m), value=m.lives),
        "Flashes": FLASH_ICONS.box(m.flashes, value=m.flashes),
        "Timer": _timer_box(m),
    }


def _things_listed(m: Ram) -> Things:
    word = lookup(THING_WORDS, PLACES * m.map + np.arange(PLACES))
    y = MAP_ROW * ((word & 255) - m.first_row)
    left = word >> 8 & 255
    color = word >> 16 & 255
    entry = word >> 24 & 255
    listed_y = y + MAP_ROW * _rows_scrolled(m)
    shown = (listed_y > 0) & (listed_y < MAP_ROW * (m.last_row - m.first_row))
    return Things(y, listed_y, left, color, shown & ((m.things << entry & 128) != 0))


def _rows_scrolled(m: Ram) -> jax.Array:
    """Rows of the map scrolled down since the game listed the shown objects."""
    walks = (m.clock - 1 & 3 == 0) & (m.look[0] < STANDS) & (m.scene == Scene.PLAY)
    return when(walks, match((m.direction[0] == 1, -1), (m.direction[0] == 2, 1), otherwise=0))


def _drawn_y(m: Ram, things: Things) -> jax.Array:
    """Drawn rows of the player and the creatures, below the first row of the screen.

    Objects begin in different bands. If the next object would begin in the same band, a figure in
    the band's upper half moves up into the band before. Otherwise the next figure moves down into
    the band after. A figure level with a thing moves up, or down if it walks down.
    """
    drawn = _is_drawn(m)
    key = jnp.where(drawn, 4 * m.y + np.arange(4), FAR)
    later = key[None] > key[:, None]
    next_key = jnp.min(jnp.where(later, key[None], FAR), axis=1)
    same_band = drawn & (next_key >> 4 == key >> 4)
    band = m.y & ~3
    upper = (m.y & 3) < 2
    pushed = jnp.any((same_band & ~upper)[:, None] & (next_key[:, None] == key[None]), axis=0)
    level = (things.listed_y[None] == m.y[:, None]) & things.there[None]
    blocked = drawn & ~same_band & jnp.any(level, axis=1)
    return match(
        (blocked & (m.direction == 2), band + MAP_ROW),
        (blocked | (same_band & upper), band - 1),
        (pushed, band + MAP_ROW),
        otherwise=m.y,
    )


def _is_drawn(m: Ram) -> jax.Array:
    """True for figures that were drawn on the frame."""
    even = (m.clock - 1 & 1) == 0
    flickers = jnp.where(even, m.hidden & 1, m.hidden >> 1) == 1
    return (m.y != NONE) & ~flickers & (m.comes != RECORDS)


def _thing_boxes(m: Ram, things: Things, figure_y: jax.Array) -> Box:
    """Things; a thing is drawn a row higher if a figure follows in the same band."""
    figure = jnp.where(_is_drawn(m), figure_y, -MAP_ROW)[None]
    listed = things.listed_y[:, None]
    higher = jnp.any((figure >= listed) & (figure < listed + MAP_ROW), axis=1)
    index = THING_EXTENTS.index(map=m.map, place=np.arange(PLACES))
    y = things.y - when(higher, 1) + VIEW[1]
    boxes = THING_EXTENTS.box(index, things.left, y, color=things.color)
    return boxes.where(things.there).clip(*VIEW)


def _figure_boxes(m: Ram, y: jax.Array) -> Box:
    step = m.clock - 1 >> 3 & 1
    look = 2 * m.look + step + when(m.has_key & (np.arange(4) == 0), WITH_KEY)
    index = FIGURE_EXTENTS.index(map=m.map, look=look)
    alive = (m.y != NONE) & (m.comes != RECORDS) & ((np.arange(4) == 0) | ~m.dying)
    color = _of_inks(m, m.kind)
    turned = m.mirrored
    boxes = FIGURE_EXTENTS.box(
        index,
        m.x - 1,
        y + VIEW[1],
        mirrored=turned,
        valid=alive,
        orientation=jnp.where(turned, WEST, EAST),
        color=color,
    )
    return boxes.clip(*VIEW)


def _of_inks(m: Ram, number: jax.Array) -> jax.Array:
    """One of the map's colours."""
    return lookup(INKS.ravel(), INKS.shape[1] * m.map + number)


def _shot_box(m: Ram, figure_y: jax.Array) -> Box:
    """The shot, in the colour of the man if the program has drawn him above it."""
    distance = jnp.abs(m.shot_x - m.x[0])
    width = 1 << jnp.minimum(distance >> 5, 3)
    above = _is_drawn(m)[0] & (figure_y[0] >> 2 <= (m.shot_y >> 2) + 1)
    color = _of_inks(m, when(~above, SHOT_COLOR))
    y = (m.shot_y & ~3) + 2 + VIEW[1]
    return box(m.shot_x - 2, y, width, 1, m.shot_y != NONE, color=color).clip(*VIEW)


def _just_lost(m: Ram) -> jax.Array:
    """1 if a life was lost after the frame was drawn, otherwise 0."""
    return when(among(m.scene, (Scene.LOST, Scene.OVER)) & (m.clock == 0) & (m.turns == 0), 1)


def _score_box(m: Ram) -> Box:
    covered = (m.scene == Scene.LOST) & (_just_lost(m) == 0)
    return choose(covered, MEN.box(m.lives, value=m.score), POINTS.box(m.score))


def _timer_box(m: Ram) -> Box:
    """The timer; it gets shorter after the drawing when the clock wraps."""
    width = m.timer + when((m.clock == 0) & (m.turns > 0), 1 + (m.level >> 4))
    return box(TAIL - width, 197, width, 6, value=m.timer)


GREEN = (200, 204)
ORANGE = 38
VIOLET = (72, 76, 104, 136)
WHITE = 14
YELLOW = 44
PLAYER = Blobs(YELLOW, VIEW, Shape(w=(5, 7), h=8))


def _creature_rule(kind: int, colors: Colors) -> Blobs:
    """Creatures of a kind, which have other pictures in each map."""
    own = np.isin(np.arange(4 * LOOKS) % LOOKS, (2 * kind, 2 * kind + 1))
    shapes = shapes_of(FIGURE_EXTENTS, FIGURE_PICTURES, np.flatnonzero(own))
    return Blobs(colors, VIEW, shapes)


BEINGS = (*GREEN, ORANGE, *VIOLET)
CUT_ROWS = 6  # most rows of a creature that the lower edge of the map cuts
CUT = Shape(w=(3, 8), h=(2, CUT_ROWS))


def cut_off(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The pixels that connect down to the map's last row.

    A path moves at most one pixel sideways in each row.
    """
    first_row = VIEW[3] - CUT_ROWS
    own = mask[:, first_row : VIEW[3]]
    is_last = jnp.arange(CUT_ROWS)[None, :, None] == CUT_ROWS - 1

    def grown(found: Bitmap, _: int) -> Bitmap:
        """The pixels, and their neighbours in the row above."""
        return found | (own & spread(found | shift_up(found, 1)))

    found = functools.reduce(grown, range(CUT_ROWS - 1), jnp.where(is_last, own, 0))
    return jnp.pad(found, ((0, 0), (first_row, mask.shape[1] - VIEW[3]), (0, 0)))


CUT_ONES = Blobs(BEINGS, VIEW, CUT, gap=(1, 1), filters=(cut_off,))
KINDS = (_creature_rule(2, ORANGE), _creature_rule(3, VIOLET), CUT_ONES)
CREATURES = replace(_creature_rule(1, GREEN), also=KINDS)
TAKEN = np.flatnonzero((np.arange(PLACES) < TREASURES.stop) & (THING_ROWS < NONE))
TREASURE_SHAPES = shapes_of(THING_EXTENTS, THING_PICTURES, TAKEN)
WALLS = {ground + step for ground in INKS[:, 7].tolist() for step in (0, 2, 4, 6)}
TREASURE_COLORS = tuple(sorted({*THING_COLORS.flat[TAKEN].tolist()} - WALLS))
OWN_COLORS = tuple(sorted({*TREASURE_COLORS} - {*BEINGS}))  # colours of no creature
PARTS = Blobs(OWN_COLORS, VIEW, Shape(w=(5, 8), h=(3, 4)), gap=(5, 1))  # cut by an edge
TREASURE = Blobs(TREASURE_COLORS, VIEW, TREASURE_SHAPES, also=(PARTS,))
KEY_RULE = Blobs(YELLOW, VIEW, Shape(w=8, h=8))
DOOR_RULE = Blobs((WHITE, YELLOW), VIEW, Shape(w=7, h=12))
SHOT = Blobs((YELLOW, WHITE), VIEW, Shape(w=(1, 8), h=1))
SCORE_DIGITS = Digits(FONT, POINTS.lefts, POINTS.top)
SCORE_RULE = Bounds(WHITE, POINTS.area, value=SCORE_DIGITS)
TIMER = Bounds(WHITE, (112, 197, 144, 203), value=Gauge(1))

GAME = Game(
    name="Tutankham",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    checks=Checks(
        rare=("PlayerShot",),  # in several colours
        mirrored={"Creature": None},
        terrain_differs=1,
    ),
    categories=(
        Category("Player", PLAYER, attributes=("orientation",), role="player", doc="the man"),
        Category(
            "Creature", CREATURES, 3, attributes=("orientation",), doc="snakes, bats and others"
        ),
        Category("PlayerShot", SHOT, doc="the man's shot"),
        Category("Treasure", TREASURE, 6, doc="treasures that were not taken"),
        Category("Key", KEY_RULE, doc="the key to the door"),
        Category("Door", DOOR_RULE, doc="the way to the next map"),
        display("Score", SCORE_RULE, role="score", doc="points"),
        display(
            "Lives",
            LIFE_ICONS.rule(WHITE, (12, 24, 50, 30)),
            role="lives",
            doc="lives, also the one in play",
        ),
        display("Flashes", FLASH_ICONS.rule(WHITE, (108, 24, 146, 30)), doc="flashes left"),
        display("Timer", TIMER, role="time", doc="time left to shoot; value: columns"),
    ),
)
