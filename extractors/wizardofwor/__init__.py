"""Wizard of Wor: a worrior hunts six monsters in dungeons of 66 cells; others wait below.

Picture: docs/games/WizardOfWor.png

Screen: the monsters share a sprite and alternate. The worrior is drawn on every other frame, and
not while his explosion is black. Garwors and Thorwors are invisible until they come in line with
him, but move and touch him all the time, and are valid. Exploding figures are valid. A wall is a
side of a cell, without the posts at its ends. Tunnels and the boxes of waiting worriors have walls,
too. A door is the side between the dungeon and a tunnel, valid while it is closed. Radar is the
complete radar; its dots, two per frame, repeat the monsters' cells and are no objects.

Slots: each kind of monster has the game's six records. Worluk and Wizard always have the first
record. Walls have the positions of walls in either maze, row by row, then the walls of tunnels and
boxes.

Terrain: walls, doors, and the posts at the walls' ends, from the tables that the game draws. The
level selects the maze, and the frame opens the doors. Pixels show a kind by the walls' colour and
the position in the grid of cells. Black walls, as in flashes after the Wizard's death, are there,
but the pixels do not show them.

RAM: ALE's source (score, lives), and the ROM's code. The screen shows the positions before the step
that follows the drawing (F55E-F730); `as_drawn` undoes this step. The worrior and his shot move
only after frames that do not show them.

Covered: all monsters, both mazes, tunnels, deaths, levels with double points, the end of the game.
ALE has no game for two players; the second worrior is no object.

Not exact: the RAM lacks a shot on the frame on which it hits, and a monster's shot on its first
frame. It does not record a monster's direction before a turning, its position before a jump, the
worrior's pose before he was hit, and the last score. ALE counts an extra life only when the next
worrior waits.

VEM: it takes the worrior's blue explosion for a Burwor's, and the Worluk's explosion for the
worrior's. It misses a shot beside the figure that shoots. Lives has no value: it depends on whether
a worrior is in the dungeon, which a single frame does not show. While the background flashes, it
may have the walls' colour.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    NORTH,
    SOUTH,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Context,
    Detected,
    Game,
    NumberDisplay,
    Pictures,
    Saver,
    Shape,
    Static,
    Step,
    among,
    box,
    boxes,
    display,
    match,
    mod,
    only,
    pick,
    when,
)
from ocjax.extractors.wizardofwor.drawn import DOORS_OPEN, KINDS, SLOTS, Drawn, as_drawn
from ocjax.extractors.wizardofwor.ram import ROM, Hunt, Kind, Ram, Stage, State, Way
from ocjax.extractors.wizardofwor.terrain import TERRAIN
from ocjax.extractors.wizardofwor.walls import (
    CELL_HEIGHT,
    CELL_WIDTH,
    DOOR_TOP,
    DOOR_X,
    DUNGEON,
    HORIZONTAL,
    POST,
    VERTICAL,
    Walls,
)

HIDING = (Kind.GARWOR, Kind.THORWOR)
EXPLODING = 8  # least `death` that shows the explosion
JUST_FIRED = 5  # `fire_sound` on the frame of a new shot
EXTRA_LIFE = 8000  # the mark in `score`
SIZE = 16  # rows of a figure
HEAD_RIGHT = 1  # column of the worrior's first pixel on his way to the right
HEAD_UP = 4  # and up, also of a shot above him
ICONS = 3  # most icons
LAST_ICON = 136  # column

BLUE = 140
ORANGE = 44
YELLOW = 40
RED = 68
WHITE = 14
WALL_BLUE = 136
WALL_GOLD = 42  # while points count twice
WALL_SAVED = 128  # after a game: the screen saver drops a bit of blue, and then applies its key
SAVER_MASK = 0xF6  # bits of the key that change the walls
SCORE_MASK = 8  # a bit of the key that changes only the score
FLASHING = tuple(range(2, 16, 2))  # walls and displays, once the Wizard is shot
FLASH_BITS = 14  # bits of these colours
KIND_COLORS = (0, BLUE, YELLOW, RED, ORANGE, WHITE)
DEATH_COLORS = (ORANGE, 0, BLUE, 0, ORANGE, 0, BLUE, 0, ORANGE, BLUE, 0)  # by `death`


class Sort:  # axis of `FIGURES`
    WORRIOR = 0
    OF_KINDS = (1, 1, 1, 2, 3, 4)  # Burwors and Garwors look alike
    EXPLOSION = 5


def _read_pictures() -> Pictures:
    """All figures, to the right, up and down, in two poses; a byte is two rows of the screen."""
    offsets = (
        *(0x02, 0x14, 0x26),  # of the worrior
        *(0x4A, 0x5C, 0x6E),  # of Burwors and Garwors
        *(0x80, 0x92, 0xA4),  # of Thorwors
        *(0xB6, 0xB6, 0xB6),  # of explosions
        *(0xC8, 0xDA, 0xEC),  # of the Wizard
        *(0x38, 0x38, 0x38),  # of explosions
    )
    rows = ROM.rows([0xE00 + offset + pose for offset in offsets for pose in (0, 1)], 8, step=2)
    return Pictures.of(np.repeat(rows, 2, axis=1), sort=6, way=3, pose=2)


FIGURES = _read_pictures()
POINTS = NumberDisplay(
    ROM.font(0xF0A, rows=7, stride=1, step=10), right=147, top=3, digits=5, leading_zeros=True
)


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    monsters = _monster_boxes(m, drawn)
    walls = _wall_color(m, drawn)
    shut = drawn.frame < DOORS_OPEN
    score = 100 * (m.score - when(m.score >= EXTRA_LIFE, EXTRA_LIFE))
    return {
        "Player": _worrior(m),
        "Burwor": monsters.where(m.kind == Kind.BURWOR),
        "Garwor": monsters.where(m.kind == Kind.GARWOR),
        "Thorwor": monsters.where(m.kind == Kind.THORWOR),
        "Worluk": monsters[:1].where(m.kind[:1] == Kind.WORLUK),
        "Wizard": monsters[:1].where(m.kind[:1] == Kind.WIZARD),
        "PlayerShot": _shot(m),
        "EnemyShot": _missile_box(m, drawn),
        "HorizontalWall": _wall_boxes(HORIZONTAL, CELL_WIDTH, POST, drawn, walls),
        "VerticalWall": _wall_boxes(VERTICAL, POST, CELL_HEIGHT, drawn, walls),
        "Door": box(np.array(DOOR_X), DOOR_TOP, POST, CELL_HEIGHT, shut, color=walls),
        "Radar": RADAR.box(color=walls),
        "Score": POINTS.box(mod(score, 100_000), value=score, color=_score_color(m, drawn)),
        "Lives": _icon_row(m, jnp.where(m.flash > 0, _flash_color(drawn), YELLOW)),
    }


def _flash_color(drawn: Drawn) -> jax.Array:
    """The colour of walls and displays while they flash."""
    return drawn.frame >> 1 & FLASH_BITS


def _wall_color(m: Ram, drawn: Drawn) -> jax.Array:
    return match(
        (_is_over(m), WALL_SAVED),
        (m.flash > 0, _flash_color(drawn)),
        (among(m.hunt, (Hunt.WORLUK, Hunt.WIZARD)), RED),
        (m.doubled > 0, WALL_GOLD),
        otherwise=WALL_BLUE,
    )


def _wall_boxes(walls: Walls, width: int, height: int, drawn: Drawn, color: jax.Array) -> Box:
    there = jnp.where((drawn.level & 1) == 0, walls.mazes[0], walls.mazes[1])
    return box(np.array(walls.x), np.array(walls.y), width, height, there, color=color)


def _figure_box(
    sort: jax.Array, way: jax.Array, pose: jax.Array, x: jax.Array, y: jax.Array
) -> Box:
    """A figure on its way; explosions are drawn as if to the right."""
    explodes = sort == Sort.EXPLOSION
    upright = match((explodes, 0), (way == Way.UP, 1), (way == Way.DOWN, 2), otherwise=0)
    picture = FIGURES.index(sort=sort, way=upright, pose=pose)
    faces = match(
        (way == Way.UP, NORTH), (way == Way.DOWN, SOUTH), (way == Way.LEFT, WEST), otherwise=EAST
    )
    mirrored = (way == Way.LEFT) & ~explodes
    return FIGURES.box(picture, x, y, mirrored=mirrored, orientation=faces)


def _worrior(m: Ram) -> Box:
    dies = m.state == State.DIES
    explodes = dies & (m.death >= EXPLODING)
    sort = jnp.where(explodes, Sort.EXPLOSION, Sort.WORRIOR)
    pose = jnp.where(explodes, when(m.death > EXPLODING, 1), m.stride >> 1 & 1)
    color = jnp.where(dies, pick(m.death, DEATH_COLORS), ORANGE)
    drawn = _figure_box(sort, m.facing, pose, m.x - 3, 142 - m.y)
    return replace(drawn, color=color).where(m.state != State.WAITS)


def _monster_boxes(m: Ram, drawn: Drawn) -> Box:
    """All six; an explosion advances only on frames that draw it."""
    part = m.cell - when(m.chosen == SLOTS, 1)
    explodes = (m.way == Way.EXPLODES) & (part > 0)
    sort = jnp.where(explodes, Sort.EXPLOSION, pick(m.kind, Sort.OF_KINDS))
    pose = jnp.where(explodes, when(part >= 2, 1), drawn.step >> 1 & 1)
    return _figure_box(sort, m.way, pose, drawn.x, drawn.y)


def _shot(m: Ram) -> Box:
    """The worrior's shot, valid from its first drawn frame."""
    leaves = (m.fire_sound == JUST_FIRED) & ((m.frame & 1) == 0)
    return box(m.shot_x - 4, 138 - m.shot_y, 1, 2, (m.shot_way > 0) & ~leaves)


def _missile_box(m: Ram, drawn: Drawn) -> Box:
    """A monster's shot, in the colour of the monster that the frame shows."""
    visible = among(m.kind, KINDS) & (~among(m.kind, HIDING) | (m.seen > 0))
    before = mod(m.chosen + 5 - SLOTS, 6)  # turns since the monster was drawn
    last = visible & (before == jnp.min(jnp.where(visible, before, 6)))
    color = pick(only(last, m.kind), KIND_COLORS)
    return box(drawn.missile_x, drawn.missile_y, 1, 2, drawn.missile, color=color)


def _icon_row(m: Ram, color: jax.Array) -> Box:
    """The worriors below, one of them in the box. Before a level, one too many is counted."""
    playing = (m.state == State.PLAYS) & (m.stage != Stage.MUSIC)
    left = LAST_ICON + 16 - 16 * jnp.minimum(m.lives, ICONS)
    lives = m.lives + when(playing, 1)
    return box(left, 145, 144 - left, 16, m.lives > 0, value=lives, color=color)


def _is_over(m: Ram) -> jax.Array:
    """True if the frame shows the screen saver, which starts on the second frame after a game."""
    return (m.over > 0) & (m.pace == 0)


def _score_color(m: Ram, drawn: Drawn) -> jax.Array:
    """Colour of the score, before the screen saver's key changes it."""
    saved = ORANGE ^ (_full_key(m) & SCORE_MASK)
    return match((_is_over(m), saved), (m.flash > 0, _flash_color(drawn)), otherwise=ORANGE)


def _full_key(m: Ram) -> jax.Array:
    """The screen saver's key on the frame."""
    return m.saver_key - when(m.frame == 0, 1)


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(_is_over(m), _full_key(m) & SAVER_MASK, -1)


class WithoutShot(Step):
    """The worrior without a shot at the end of his gun; his first pixel locates it."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        head = (found.x if found.head is None else found.head) - found.x
        left = jnp.where(head == HEAD_RIGHT, found.x, found.x + jnp.maximum(found.w - 8, 0))
        top = jnp.where(head == HEAD_UP, found.y + jnp.maximum(found.h - SIZE, 0), found.y)
        width = jnp.minimum(found.w, 8)
        height = jnp.minimum(found.h, SIZE)
        return found._replace(box=boxes(left, top, width, height, found.valid))


in_dungeon = functools.partial(Blobs, region=DUNGEON, gap=(2, 0))
# Numbers of pixels, with closed gaps, distinguish figures of one colour. Figures are larger where a
# shot touches them.
MONSTER_SHAPE = Shape(w=(6, 11), h=(10, 20))
SHOT_SHAPE = Shape(w=1, h=2)
WORRIOR_SHAPE = Shape(w=(8, 11), h=(16, 20), pixels=(74, 96))
WORLUK_SHAPE = Shape(w=(8, 9), h=(14, 17), pixels=(98, 106))
EXPLOSION_SHAPE = Shape(w=(7, 8), h=(10, 16), pixels=(36, 88))
BURWOR_SHAPE = Shape(w=(6, 11), h=(8, 20), pixels=(113, 140))
BURWOR_PART_SHAPE = Shape(w=(5, 8), h=(8, 16), pixels=(30, 105))  # an exploding or covered Burwor
WORLUKS = in_dungeon(ORANGE, shapes=WORLUK_SHAPE, gap=(1, 0))
GARWORS = in_dungeon(YELLOW, shapes=MONSTER_SHAPE)
THORWORS = in_dungeon(RED, shapes=MONSTER_SHAPE)
WIZARDS = in_dungeon(WHITE, shapes=MONSTER_SHAPE)
SHOTS = in_dungeon(ORANGE, shapes=SHOT_SHAPE)
MISSILES = in_dungeon((BLUE, YELLOW, RED, WHITE), shapes=SHOT_SHAPE)
WORRIOR_EXPLOSIONS = in_dungeon(ORANGE, shapes=EXPLOSION_SHAPE)
WORRIORS = in_dungeon(
    (ORANGE, BLUE),
    shapes=WORRIOR_SHAPE,
    gap=(1, 0),
    also=(WORRIOR_EXPLOSIONS,),
    then=(WithoutShot(),),
)
BURWORS = in_dungeon(BLUE, shapes=(BURWOR_SHAPE, BURWOR_PART_SHAPE))
WALL_COLORS = (WALL_BLUE, RED, WALL_GOLD, WALL_SAVED, *FLASHING)
RADAR = Static(56, 161, 52, 32, WALL_COLORS)
SCORE_COLORS = (ORANGE, ORANGE ^ SCORE_MASK, *FLASHING)
HORIZONTAL_RULE = Cells(WALL_COLORS, HORIZONTAL.x, HORIZONTAL.y, CELL_WIDTH, POST)
VERTICAL_RULE = Cells(WALL_COLORS, VERTICAL.x, VERTICAL.y, POST, CELL_HEIGHT)
DOOR_RULE = Cells(WALL_COLORS, DOOR_X, (DOOR_TOP,) * 2, POST, CELL_HEIGHT)
ICON_RULE = Bounds((YELLOW, *FLASHING), (104, 145, 144, 161), ignore=((132, 145, 136, 161),))

_mover = functools.partial(Category, attributes=("orientation",), blinks=True)

GAME = Game(
    name="WizardOfWor",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    saver=Saver(_saver_key, (14, 22), (WALL_SAVED, *WALL_COLORS, 0)),
    checks=Checks(
        rare=("Wizard", "Worluk"),
        # The display shows five of the digits.
        at_limits={"Score": (99_900, (100_000, 0), (115_000, 15_000))},
        # The figure in the dungeon counts, too, but is drawn on every other frame.
        known={"Lives": 0},
        moved=0.15,  # many walls
    ),
    categories=(
        _mover("Player", WORRIORS, role="player", doc="the worrior"),
        _mover("Burwor", BURWORS, count=6, doc="blue monsters"),
        _mover("Garwor", GARWORS, count=6, doc="yellow monsters, which hide"),
        _mover("Thorwor", THORWORS, count=6, doc="red monsters, which hide"),
        Category("Worluk", WORLUKS, blinks=True, doc="flees, at the end of a level"),
        _mover("Wizard", WIZARDS, doc="jumps around, after the Worluk"),
        Category("PlayerShot", SHOTS, doc="the worrior's"),
        Category("EnemyShot", MISSILES, doc="a monster's"),
        Category("HorizontalWall", HORIZONTAL_RULE, count=len(HORIZONTAL.x), doc="of a cell"),
        Category("VerticalWall", VERTICAL_RULE, count=len(VERTICAL.x), doc="of a cell"),
        Category("Door", DOOR_RULE, count=2, doc="to the tunnels: left, right"),
        display(
            "Radar",
            RADAR.rule(),
            attributes=(),
            colors=(*WALL_COLORS, BLUE, YELLOW),
            doc="shows the cells of two monsters",
        ),
        display("Score", POINTS.rule(SCORE_COLORS), role="score", doc="points"),
        display("Lives", ICON_RULE, role="lives", doc="all icons; value: lives"),
    ),
)
