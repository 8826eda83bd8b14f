"""Air Raid: a ship that defends two buildings against enemies and their bombs.

Picture: docs/games/AirRaid.png

Screen: exploding enemies and ships are not objects. The flashing ground is scenery. After a frame
with an odd number of lines, the emulator shows the next one in grey, as a PAL television does. An
object keeps its colour from other frames.

Slots: each kind of enemy has the game's three records, from left to right. Building has the two
buildings, then the part of a building that the right edge cuts off and that continues at the left
edge. Missile has the ship's shot and the enemies' bomb. Lives has an icon per slot; ALE counts no
lives.

RAM: the ROM is made for PAL consoles. ALE's source (score), OCAtari 2.2, and the ROM's code:
f3b7-f556 draws after the frame's other work, and then moves the buildings. Each missile that waits
beyond the right edge lowers the screen by a line, because its positioning takes a line longer. The
game draws two of the three enemies, alternately: the first one on odd steps of the line counter,
the other one on even steps. It draws a missile only if the missile is at a step that the program
checks.

Covered: all modes, deaths, destroyed buildings, the end of the game.

Not exact: a missile that the game skips on a frame keeps its last position.

VEM: it misses the ship after 65,536 frames without a shot, when the game changes its colours, and a
shot that touches an enemy of its colour. In RGB, it takes bits of explosions for missiles.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    COARSE,
    EDGE_CUTS,
    Blobs,
    Bounds,
    Box,
    Category,
    Game,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    lookup,
    match,
    mod,
    only,
    pick,
    when,
)

ROM = Rom("air_raid", "35be55426c1fec32dfb503b4f0651572")
FONT = ROM.font(0x6A0, rows=8)
SCORE = NumberDisplay(FONT, right=103, top=11, digits=6)
PLACES = np.arange(6)  # of icons

BLUE = 184  # of the score and of most of the ship
SHIP_COLORS = (BLUE, 54, 62, 180, 188)
WHITE = 254
BROWN = 34
LILAC = 204
KHAKI = 24
GRAY = 8  # of a plane; in RGB also of lilac or khaki objects
AZURE = 182
TURQUOISE = 202
PINK = 136
INDIGO = 214
ORANGE = 72
GREEN = 86
PLANE_COLORS = (AZURE, GRAY, 68, ORANGE, GREEN, 92, TURQUOISE)
JEWEL_COLORS = (ORANGE, 6, 68, 76, GREEN)

FAR = 165  # least x of a missile that takes a line longer
# The display program counts steps down: one line per step, two lines in the ship's part.
ENEMY_LINE = 194  # line + step
LAST_ABOVE = 45  # the last step for bombs above the ship's part
ENEMIES_END = 151  # line
SHIP_STEP = 42  # the first one in the ship's part
SHIP_LINE = 155  # of that step
SHIP_LAST = 36  # the last step for bombs in the ship's part
CITY_STEP = 34  # the first one in the buildings' part
CITY_LINE = 177  # of that step
CITY_LAST = 6  # the last step but one for bombs in the buildings' part
CITY_END = 210  # line
SCREEN_END = 250
HIGHEST = 159  # step
LOWEST = 4  # step of a bomb's last place on the screen
UNDRAWN = (43, 35, 5)  # steps at which the program does not check for bombs
SPEED = 3  # steps of a missile in a frame
# Column of the beam when the program switches a missile. Left of it, the change is a line later.
SHOT_BEAM = 82
BOMB_BEAM = 46
BOMB_BEAM_ABOVE = 25  # before the second enemy
BOMB_BEAM_BESIDE = 79  # beside the second enemy
SHIP_BEAM = 40
CITY_BEAM = 93

SHORT_MOVES = (2, 1, 0)  # by fine part: the program requests the enemies' large moves too late

RANK = np.arange(3)  # of the enemies
STARTS = (0x33, 0x87, 0x64, 0x6D, 0x3F)  # offsets in the ROM's page, by kind; then a second plane
SECOND_PLANE = 4  # index
ENEMY_ROWS = (9, 8, 8, 7, 9)  # by picture
MOST_ROWS = 9
ROW_COLORS = ROM.bytes(0x700, 256)
# The visible part of each picture: nothing, its first row, its first two rows, ...
ENEMY_PICTURES = Pictures.of(
    (
        np.where(np.arange(height) < rows, ROM.rows(0x700 + start, height, top_first=True), 0)
        for start, height in zip(STARTS, ENEMY_ROWS, strict=True)
        for rows in range(MOST_ROWS + 1)
    ),
    picture=len(STARTS),
    rows=MOST_ROWS + 1,
)

BUILDINGS = np.arange(2)
BUILDING_ROWS = 16
BUILDING_WIDTH = 32
BUILDING_DOT = 4  # columns
STAGES = 14  # of damage
POINTERS = ROM.bytes(0x900, 4 * STAGES).reshape(2 * STAGES, 2) @ (1, 256)
# Visible columns of a picture, or the columns that continue at the left edge.
BUILDING_PICTURES = Pictures.of(
    (
        ROM.rows(pointer - 0xF000 + 1, BUILDING_ROWS) & mask
        for mask in EDGE_CUTS
        for pointer in POINTERS.tolist()
    ),
    cut=len(EDGE_CUTS),
    stage=STAGES,
    building=2,
)
NO_CUT = EDGE_CUTS.index(0xFF)  # cut


class Kind:  # of `Ram.kind`
    PLANE = 0
    BUG = 1
    BEETLE = 2
    JEWEL = 3


class Picture:  # of `Ram.picture`
    NONE = 0x3E
    SECOND_PLANE = STARTS[SECOND_PLANE]


class ShipPicture:  # of `Ram.ship_picture`
    WHOLE = 0x10


class Colors:  # of `Ram.colors`
    EXPLOSION = 0xEC


class Ram(RamMap):
    ship_color = byte(1)  # of its second and fourth row
    ship_picture = byte(11)  # its first row
    ship_x = byte(19)  # x + 3
    building_x = byte(20, 21)  # x + 3, already moved on
    stage = byte(27, 28)  # of each building's damage
    y = byte(29, 30, 31)  # of enemies, as a step
    picture = byte(32, 33, 34)  # of enemies; place of its first row
    collapse = bits(37, count=2)  # a building collapses
    lives = byte(39)  # ships in reserve; 255: the game is over
    score = bcd((40, 41, 42))
    active = flag(43, 44, 45, bit=0)  # there is an enemy
    kind = bits(63, 64, 65, first=1, count=2)  # of enemies: 25, 50, 75 or 100 points
    x = byte(66, 67, 68)  # of enemies; offset of its first row
    colors = byte(78, 79, 80)  # of enemies; offset before the first row's colour
    bomb_step = byte(83)
    bomb_x = byte(84)  # x + 5
    shot_step = byte(85)
    shot_x = byte(86)  # x + 5
    hidden = byte(87)  # the enemy that the game skipped
    frame = byte(94)  # already counted
    flies = flag(104, bit=7)  # the shot flies
    playing = flag(105, bit=7)


def decode(m: Ram) -> dict[str, Box]:
    enemies = _enemy_boxes(m)
    icons = box(55 + 8 * PLACES, 219 + _lower(m), 7, 5, (m.lives > PLACES) & m.playing)
    return {
        "Player": _ship_box(m),
        "Building": _building_boxes(m),
        "Enemy25": enemies.where(m.kind == Kind.PLANE),
        "Enemy50": enemies.where(m.kind == Kind.BUG),
        "Enemy75": enemies.where(m.kind == Kind.BEETLE),
        "Enemy100": enemies.where(m.kind == Kind.JEWEL),
        "Missile": _missile_boxes(m),
        "PlayerScore": SCORE.box(m.score),
        "Lives": icons,
    }


def _lower(m: Ram) -> jax.Array:
    """Downward shift of the screen below the score, in lines."""
    return when(m.bomb_x >= FAR, 1) + when(m.shot_x >= FAR, 1)


def _ship_box(m: Ram) -> Box:
    there = m.ship_picture == ShipPicture.WHOLE
    return box(m.ship_x - 3, SHIP_LINE + 1 + _lower(m), 14, 12, there, color=m.ship_color)


def _is_second(m: Ram) -> jax.Array:
    """True for the enemy that the game draws on even steps."""
    return mod(m.hidden + 2, 3) == RANK


def _first_step(m: Ram) -> jax.Array:
    """The step of each enemy's first row."""
    return jnp.where(_is_second(m), m.y & ~1, (m.y - 1) | 1)


def _enemy_boxes(m: Ram) -> Box:
    top = ENEMY_LINE - _first_step(m)
    rows = jnp.clip((ENEMIES_END + 1 - top) >> 1, 0, MOST_ROWS)
    kind = jnp.where(m.picture == Picture.SECOND_PLANE, SECOND_PLANE, m.kind)
    index = ENEMY_PICTURES.index(picture=kind, rows=rows)
    left, first, width, height = ENEMY_PICTURES.extent(index)
    there = m.active & (m.colors != Colors.EXPLOSION)
    x = m.x - 3 + pick(mod(m.x, COARSE), SHORT_MOVES) + 2 * left
    y = top + 2 * first
    down = _lower(m)
    return box(x, y + down, 2 * width, 2 * height, there).clip(0, 0, 160, ENEMIES_END + down)


def _building_boxes(m: Ram) -> Box:
    """Both buildings up to the right edge, and the rest of a building that the edge cuts."""
    moved = (m.collapse == 0) & m.playing & ((m.frame & 1) == 0)
    place = m.building_x - 3 - when(moved, 1)
    x = jnp.where(place < 0, place + 160, place)
    beyond = jnp.maximum(x + BUILDING_WIDTH - 160, 0)
    inside = jnp.minimum(160 - x, BUILDING_WIDTH)
    which = when(beyond[0] == 0, 1)  # the building that may be cut
    rest = jnp.where(which == 0, inside[0], inside[1])
    building = jnp.append(BUILDINGS, which)
    index = BUILDING_PICTURES.index(
        cut=NO_CUT + jnp.append(div(beyond, BUILDING_DOT), -div(rest, BUILDING_DOT)),
        stage=jnp.append(m.stage, jnp.where(which == 0, m.stage[0], m.stage[1])),
        building=building,
    )
    left, first, width, height = BUILDING_PICTURES.extent(index)
    all_x = jnp.append(x, -rest)
    y = CITY_LINE + 1 + building + 2 * first
    down = _lower(m)
    boxes = box(all_x + BUILDING_DOT * left, y + down, BUILDING_DOT * width, 2 * height)
    return boxes.clip(0, 0, 160, CITY_END + down)


def _missile_boxes(m: Ram) -> Box:
    """The shot and the bomb; one that the game skips on a frame keeps its last position."""
    shot = _shot_drawn(m)
    bomb = _bomb_drawn(m)
    late = when(m.shot_x - 5 < SHOT_BEAM, 1)
    shot_y = ENEMY_LINE - 1 + late - shot
    bomb_y = _bomb_line(m, bomb)
    end = jnp.where(bomb > LOWEST, _bomb_line(m, _next_step(bomb)), SCREEN_END)
    flies = m.flies & (shot > LAST_ABOVE - 2) & (m.shot_step <= HIGHEST)
    falls = among(m.bomb_step, range(LOWEST, HIGHEST + 1))
    color = _shot_color(m, shot, late)
    return Box.stacked(
        box(m.shot_x - 5, shot_y + _lower(m), 2, 2, flies, color=color),
        box(m.bomb_x - 5, bomb_y + _lower(m), 2, end - bomb_y, falls, color=WHITE),
    )


def _shot_drawn(m: Ram) -> jax.Array:
    """The shot's step when it was last drawn: only even steps are drawn."""
    return m.shot_step - when((m.shot_step & 1) == 1, SPEED)


def _bomb_drawn(m: Ram) -> jax.Array:
    """The bomb's step when it was last drawn: above the ship's part only odd steps are drawn."""
    skipped = (m.bomb_step > SHIP_STEP) & ((m.bomb_step & 1) == 0)
    return m.bomb_step + when(skipped | among(m.bomb_step, UNDRAWN), SPEED)


def _next_step(step: jax.Array) -> jax.Array:
    """The step at which the program switches off a bomb that it switched on at `step`."""
    return match(
        (step > LAST_ABOVE, step - 2),
        (step > SHIP_STEP, SHIP_STEP),
        (step == SHIP_LAST, CITY_STEP),
        (step == CITY_LAST, LOWEST),
        otherwise=step - 1,
    )


def _bomb_line(m: Ram, step: jax.Array) -> jax.Array:
    """The first line that shows the bomb's start or end at a step."""
    row, rows = _row_beside(m, step + 1)
    beam = match(
        (step < SHIP_LAST, CITY_BEAM),
        (step <= SHIP_STEP, SHIP_BEAM),
        (row < 0, BOMB_BEAM_ABOVE),
        (row < rows, BOMB_BEAM_BESIDE),
        otherwise=BOMB_BEAM,
    )
    line = match(
        (step < SHIP_LAST, CITY_LINE + CITY_STEP - step),
        (step <= SHIP_STEP, SHIP_LINE + 2 * (SHIP_STEP - step)),
        otherwise=ENEMY_LINE - 1 - step,
    )
    return line + when(m.bomb_x - 5 < beam, 1)


def _row_beside(m: Ram, step: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The row of the second enemy that the program draws at a step, and its number of rows."""
    second = _is_second(m)
    row = (only(second, _first_step(m)) - step) >> 1
    rows = pick(only(second, m.kind), ENEMY_ROWS)
    return row, when(only(second, m.picture) != Picture.NONE, rows)


def _shot_color(m: Ram, step: jax.Array, late: jax.Array) -> jax.Array:
    """The colour of the second enemy's row beside the shot's first line, or white."""
    beside_shot, rows = _row_beside(m, step)
    row = beside_shot - 1 + late
    color = lookup(ROW_COLORS, only(_is_second(m), m.colors) + row + 1)
    return jnp.where((row >= 0) & (row < rows), color, WHITE)


FIELD = (0, 34, 160, 153)
PLANES = Blobs(PLANE_COLORS, FIELD, Shape(w=(4, 16), h=(1, 18)), gap=(6, 0), first=TURQUOISE)
BUGS = Blobs((LILAC, PINK, GRAY), FIELD, Shape(w=(4, 14), h=(1, 16)), gap=(2, 0), first=PINK)
BEETLES = Blobs(INDIGO, FIELD, Shape(w=(4, 14), h=(1, 16)), gap=(6, 0))
JEWEL_SHAPES = (Shape(14, (7, 14)), Shape(10, (5, 6)), Shape(6, (3, 4)))  # no last rows of planes
JEWELS = Blobs(JEWEL_COLORS, FIELD, JEWEL_SHAPES, first=GREEN)
ENEMY_COLORS = tuple(sorted({*PLANE_COLORS, LILAC, PINK, INDIGO, *JEWEL_COLORS}))
# Shots in the colour of the enemy's row beside them.
BESIDE = Blobs(ENEMY_COLORS, FIELD, Shape(w=2, h=2), gap=(2, 0))
MISSILES = Blobs(WHITE, (0, 34, 160, 250), Shape(w=(1, 2), h=(1, 43)), also=(BESIDE,))
SHIP = Bounds((*SHIP_COLORS, GRAY), (13, 156, 144, 171), min_size=(14, 12), max_size=(14, 12))
CITY = Blobs((BROWN, LILAC, GRAY), (0, 178, 160, 212), Shape(w=(1, 32), h=(1, 32)), gap=(16, 4))
LIVES = Blobs((KHAKI, GRAY), (55, 219, 103, 226), Shape(w=7, h=5))

enemy_category = functools.partial(Category, count=3)

GAME = Game(
    name="AirRaid",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    categories=(
        Category("Player", SHIP, rgb=(87, 139, 201), role="player", doc="the ship"),
        Category("Building", CITY, count=3, rgb=(150, 113, 26), doc="what the ship defends"),
        enemy_category("Enemy25", PLANES, rgb=(68, 116, 182), doc="a plane, 25 points"),
        enemy_category("Enemy50", BUGS, rgb=(162, 128, 238), doc="with antennae, 50 points"),
        enemy_category("Enemy75", BEETLES, rgb=(72, 72, 194), doc="with wings, 75 points"),
        enemy_category("Enemy100", JEWELS, rgb=(201, 154, 92), doc="a diamond, 100 points"),
        Category("Missile", MISSILES, count=2, doc="the ship's shot, the enemies' bomb"),
        display("PlayerScore", SCORE.rule(BLUE), role="score", doc="points"),
        display(
            "Lives", LIVES, count=len(PLACES), attributes=(), role="lives", doc="ships in reserve"
        ),
    ),
)
