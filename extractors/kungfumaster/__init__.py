"""Kung Fu Master: five floors of a temple, with henchmen, knife throwers, beasts and masters.

Picture: docs/games/KungFuMaster.png

Screen: the eight columns at the left edge are blank. Walls, pillars, lamps, stairs and the names of
the bars are scenery. Rows 88 to 94 hide objects that fall from the ceiling. The mark of the current
floor blinks.

Slots: one sprite draws all enemies, up to three equal ones side by side; their slots are the
positions in the group. After a hit, the enemies behind the victim move up a slot.

RAM: ALE's source (score, lives), OCAtari (meaning of some bytes), and the ROM's code. The rules of
the game (f04d, second bank) run after the vertical sync, and the first bank draws at f1b0, so the
RAM matches the screen. Three loops draw the lower part of figures: f556 with thrown objects, f5bc
with enemies that stretch arms and legs, f611 with figures at any height. A dragon and snakes come
out of balls. A bursting Red_Ball keeps this category, and the ball of a snake is a Snake.

Covered: the first floor in play, the others by writing RAM, with their beasts and masters, lost
lives, the end of the game. The game has one mode. The value of Lives is ALE's, one more than the
number on the screen; without a number it is not valid.

Not exact: the boxes of enemies behind the player are complete, even if he hides a part of them.

VEM: where figures overlap, it may miss an edge of one of them, and beside a master, a complete
figure. It misses the last columns of figures at the edges of the screen, heads of small enemies
that somersault, and parts of balls in the ceiling.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Blobs,
    Bounds,
    Box,
    ByColor,
    Category,
    Cells,
    Checks,
    Game,
    Gauge,
    NumberDisplay,
    Shape,
    among,
    box,
    display,
    match,
    palette,
    signed_nibble,
    when,
)
from ocjax.extractors.kungfumaster.extents import (
    AIRBALL,
    DRAGON,
    DRAGON_BALL,
    ENEMY_EXTENTS,
    FIRST_SHIFTS,
    POSE_ADDRESSES,
    POSE_EXTENTS,
    ROM,
    Pose,
    extent_box,
)
from ocjax.extractors.kungfumaster.ram import Kind, Loop, Ram, Thrower
from ocjax.extractors.kungfumaster.vision import (
    BRIM_ROWS,
    JACKET_ROWS,
    ROOM,
    SMOKE_COLOR,
    SMOKE_ROWS,
    WHITE,
    Body,
    Grown,
    Upright,
    Whites,
)

VIEW = (8, 72, 160, 162)
SCREEN_X = 49  # offset of positions from columns
GROUND = 161  # lowest row of a standing figure
CEILING = 175  # lowest row of a floating figure, plus `enemy_y`
HIDDEN = (88, 95)  # rows that hide floating figures
COPY = 16  # columns from one copy of an enemy to the next

FONT = ROM.font(0xF00, rows=7, stride=8)
TIME = NumberDisplay(FONT, right=62, top=10, digits=4)
SCORE = NumberDisplay(FONT, right=70, top=20, digits=6)
LIVES = NumberDisplay(FONT, right=106, top=31, digits=1)
BAR_LEFT = 49
BAR_ROWS = (41, 49)  # of the player's energy, of the enemy's
FULL = 39  # columns
FLOORS = 28 + 8 * np.arange(5)  # columns of the marks of the floors

THROWN_X = 50
THROWN_ROW = 157  # row of a thrown object's first line, plus `thrown_y`
THROWN_VIEW = (126, 158)
BEAM = 100  # column of the beam when the program sets a line's move and visibility

GREEN = 204
RED = 66
BLUE = 134
YELLOW = 28
PINK = 68
GRAY = 2
FIRE = 64  # dragon's, with four shades
SPELL = 24  # of the master who casts spells, with four shades


def decode(m: Ram) -> dict[str, Box]:
    group = _group_boxes(m)
    thrown = _thrown_boxes(m)
    return {
        "Player": _player_box(m),
        "Henchmen": group.where(m.kind == Kind.HENCHMEN),
        "Killer_Moth": group.where(m.kind == Kind.MOTH),
        **_single_enemies(m),
        "Knifes": thrown.where(m.thrower == Thrower.KNIFE_THROWER),
        "Boomerang": thrown.where(m.thrower == Thrower.BOOMERANGS),
        "Spell": thrown.where(m.thrower == Thrower.SPELLS),
        "Dragon_Fire": thrown.where(m.thrower >= Thrower.DRAGON),
        "Time": TIME.box(m.time),
        "Score": SCORE.box(m.score),
        "Lives": LIVES.box(
            m.spare_lives, valid=among(m.spare_lives, range(1, 10)), value=m.spare_lives + 1
        ),
        "Player_Health_Bar": _bar_box(m.energy, BAR_ROWS[0]),
        "Enemy_Health_Bar": _bar_box(m.enemy_energy, BAR_ROWS[1]),
        "Floor": _floor_boxes(m),
    }


def _single_enemies(m: Ram) -> dict[str, Box]:
    """The enemies that appear alone."""
    enemy = _enemy_box(m)
    is_dragon = m.kind == Kind.DRAGON
    bursting = m.kind == Kind.RED_BALL
    return {
        "Knife_Throwers": enemy.where(m.kind == Kind.KNIFE_THROWER),
        "Small_Enemy": enemy.where(m.kind == Kind.SMALL),
        "Enemy_Final_Fighter": enemy.where(among(m.kind, Kind.MASTERS)),
        "Dragon_Balls": enemy.where(is_dragon & (m.enemy_picture == DRAGON_BALL)),
        "Dragon_Smoke": enemy.where(is_dragon & ~among(m.enemy_picture, (DRAGON, DRAGON_BALL))),
        "Dragon": enemy.where(is_dragon & (m.enemy_picture == DRAGON)),
        "Red_Ball": enemy.where(bursting & (m.enemy_picture != AIRBALL)),
        "Airball": enemy.where(bursting & (m.enemy_picture == AIRBALL)),
        "Snake": enemy.where(m.kind == Kind.SNAKE),
    }


def _compass(right: jax.Array) -> jax.Array:
    """The compass point; 1 is right."""
    return jnp.where(right == 1, EAST, WEST)


def _player_box(m: Ram) -> Box:
    """The player; a jump moves his picture's address down by his height."""
    jump = POSE_ADDRESSES[Pose.JUMP]
    rise = jnp.where(m.picture_page == jump >> 8, (jump & 255) - m.picture_low, 0)
    pictures = [(p >> 8, p & 255) for p in POSE_ADDRESSES]
    poses = (
        ((m.picture_page == page) & (m.picture_low == low), pose)
        for pose, (page, low) in enumerate(pictures)
    )
    pose = match(*poses, otherwise=Pose.IN_AIR)
    shifted_right = among(m.shifts, [address & 255 for address in FIRST_SHIFTS[1::2]])
    index = 4 * pose + 2 * m.looks_right + when(shifted_right, 1)
    x = m.x - SCREEN_X
    y = GROUND - rise
    orientation = _compass(m.looks_right)
    return extent_box(POSE_EXTENTS, index, x, y, orientation=orientation).clip(*VIEW)


def _enemy_box(m: Ram, place: int | np.ndarray = 0) -> Box:
    """The enemy, or its copies at some positions, without the rows that the ceiling hides."""
    floats = m.loop == Loop.FLOATING
    index = 2 * (m.enemy_picture & 0x7FF) + m.enemy_looks_right
    x = m.enemy_x - SCREEN_X + COPY * place
    figure_y = jnp.where(floats, CEILING - m.enemy_y, GROUND)
    right = _compass(m.enemy_looks_right)
    whole = extent_box(ENEMY_EXTENTS, index, x, figure_y, orientation=right).clip(*VIEW)
    first, end = HIDDEN
    whole_bottom = whole.y + whole.h
    top = jnp.where(whole.y >= first, jnp.maximum(whole.y, end), whole.y)
    bottom = jnp.where(whole_bottom <= end, jnp.minimum(whole_bottom, first), whole_bottom)
    seen = top < bottom
    y = jnp.where(seen, top, whole.y)
    height = jnp.where(seen, bottom - top, whole.h)
    return replace(whole, y=y, h=height)


def _group_boxes(m: Ram) -> Box:
    """Up to three equal enemies: the first, and its copies at the next two positions."""
    place = np.arange(3)
    return _enemy_box(m, place).where((place == 0) | ((m.copies & place) != 0))


def _thrown_boxes(m: Ram) -> Box:
    """The thrown object: up to four lines, each with its own move.

    The program sets a line's move and visibility while the beam is at one column. Right of that
    column, the line shows a row earlier and without its move.
    """
    moves = signed_nibble(m.lines)
    right_of_beam = np.arange(8) >= 4
    moved = m.thrown_x - THROWN_X - jnp.cumsum(moves)
    columns = jnp.concatenate([moved, moved + moves])
    row = THROWN_ROW - m.thrown_y + np.arange(8) - 5 * right_of_beam
    left = jnp.maximum(columns, np.where(right_of_beam, BEAM, VIEW[0]))
    right = jnp.minimum(columns + (1 << m.thrown_width), np.where(right_of_beam, VIEW[2], BEAM))
    flies = (
        (m.thrown_x > SCREEN_X) & (m.thrown_x < SCREEN_X + VIEW[2]) & (m.loop == Loop.WITH_THROWN)
    )
    shown = jnp.concatenate([m.lines_shown, m.lines_shown])
    on = shown & (left < right) & (row >= THROWN_VIEW[0]) & (row < THROWN_VIEW[1])
    x = jnp.min(jnp.where(on, left, 255))
    y = jnp.min(jnp.where(on, row, 255))
    width = jnp.max(jnp.where(on, right, 0)) - x
    height = jnp.max(jnp.where(on, row + 1, 0)) - y
    return box(x, y, width, height, flies & (width > 0), color=_thrown_color(m))


def _thrown_color(m: Ram) -> jax.Array:
    shade = m.clock >> 1 & 6
    return match(
        (m.thrower >= Thrower.DRAGON, FIRE | shade),
        (m.thrower == Thrower.SPELLS, SPELL | shade),
        otherwise=GRAY,
    )


def _bar_box(energy: jax.Array, row: int) -> Box:
    return box(BAR_LEFT, row, jnp.minimum(energy, FULL), 5, value=energy)


def _floor_boxes(m: Ram) -> Box:
    """The marks of the floors; the current one blinks."""
    lit = ((m.clock & 32) != 0) | m.climbs
    reached = m.floor - when(m.ends | m.walks | ~lit, 1)
    is_red = np.arange(5) < reached
    return box(FLOORS, 32, 4, 5, value=is_red, color=jnp.where(is_red, RED, BLUE))


BURST_VIEW = (8, 95, 160, 120)
FIGURES = (8, 126, 160, 160)  # of standing figures
FALL = (8, 72, 160, 162)  # of objects from the ceiling
HENCHMAN = (98, 170, 100)
ALL_ROWS = tuple(range(160))
THROWER_ROWS = (128, 129, 131, 132, 133, 143, 145, 146, 147)

PLAYER = Blobs(
    (WHITE, 0),
    ROOM,
    Shape(w=(5, 30), h=(12, 40)),
    gap=(2, 3),
    filters=(Whites(),),
    then=(Grown(8, 4),),
)
ENTERING = Bounds(WHITE, (152, 126, 160, 157), min_size=(1, 3), then=(Upright(),))
HENCHMEN = Blobs(
    (*HENCHMAN, 0),
    FIGURES,
    Shape(w=(1, 10), h=(18, 40)),
    gap=(0, 5),
    filters=(Body(HENCHMAN, BRIM_ROWS),),
    then=(Upright(),),
)
KNIFE_THROWER = Bounds(
    (10, WHITE, 42, 0),
    FIGURES,
    min_size=(2, 24),
    max_size=(12, 34),
    filters=(Body((10,), THROWER_ROWS, reach=1),),
    then=(Upright(),),
)
SMALL = Blobs((62, 50, 200), ROOM, Shape(w=(4, 8), h=(8, 20)), gap=(1, 1), then=(Grown(3, 2),))
MASTER = Bounds(
    (GRAY, 14, 56, 0),
    (8, 95, 160, 160),
    min_size=(4, 24),
    filters=(Body((GRAY,), ALL_ROWS, JACKET_ROWS),),
)
BALLS = Bounds((54, 58, 60), FALL, (4, 2), (8, 12))
SMOKES = Bounds(
    (SMOKE_COLOR, WHITE),
    ROOM,
    min_size=(4, 16),
    max_size=(8, 39),
    filters=(Body((SMOKE_COLOR,), ALL_ROWS, SMOKE_ROWS),),
)
DRAGONS = Bounds((200, 202, 204, 214, 216, 218), ROOM, (5, 24), (8, 38))
RED_BALLS = Bounds((64, 66), FALL, (4, 5), (8, 12), ignore=((8, 88, 160, 95),))
BURSTS = Blobs((10, WHITE, 14), BURST_VIEW, Shape(w=(7, 8), h=(9, 12)), gap=(3, 3), first=10)
AIRBALLS = Blobs((10, WHITE, 14), ROOM, Shape(w=(2, 4), h=(3, 6), pixels=(8, 20)), first=14)
SNAKES = Bounds((192, 194, 196), FALL, (2, 4), (8, 13))
MOTH_SHAPES = Shape(w=(1, 8), h=(4, 5)), Shape(w=3, h=2)  # the second one is a hit moth
MOTHS = Blobs(64, ROOM, MOTH_SHAPES, gap=(1, 0), then=(Grown(1, 1),))
KNIVES = Bounds(GRAY, ROOM, (4, 2), (5, 3))
BOOMERANGS = Blobs(GRAY, ROOM, Shape(w=3, h=(4, 5), pixels=(8, 9)))
SPELLS = Bounds((24, 26, 28, 30), ROOM, (6, 2), (20, 5))
FLAMES = Bounds((64, 66, 68, 70), ROOM, (10, 2), (20, 5))
bar_rule = functools.partial(Bounds, value=Gauge(1, full=FULL + 1))
FLOOR_MARKS = Cells((BLUE, RED), tuple(FLOORS.tolist()), (32,) * 5, 4, 5)


def _rgb(color: int) -> tuple[int, ...]:
    return tuple(palette.NTSC[color].tolist())


facing = functools.partial(Category, attributes=("orientation",))
GAME = Game(
    name="KungFuMaster",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=(
            "Boomerang",
            "Dragon",
            "Dragon_Balls",
            "Dragon_Fire",
            "Killer_Moth",
            "Small_Enemy",
            "Snake",
            "Spell",
        ),
    ),
    categories=(
        facing(
            "Player",
            PLAYER,
            rgb=_rgb(WHITE),
            otherwise=ENTERING,
            colors=(WHITE, 42, 0),
            role="player",
            doc="the kung fu master",
        ),
        facing(
            "Henchmen",
            HENCHMEN,
            count=3,
            rgb=_rgb(170),
            colors=(*HENCHMAN, 56, 0),
            doc="place in the group",
        ),
        facing("Knife_Throwers", KNIFE_THROWER, rgb=_rgb(10), doc="throws knives, high or low"),
        facing("Small_Enemy", SMALL, rgb=_rgb(50), doc="jumps over the player"),
        facing("Enemy_Final_Fighter", MASTER, rgb=_rgb(GRAY), doc="at the end of a floor"),
        Category("Dragon_Balls", BALLS, rgb=_rgb(58), doc="falls, becomes smoke"),
        Category("Dragon_Smoke", SMOKES, rgb=_rgb(14), doc="becomes a dragon, or vanishes"),
        facing("Dragon", DRAGONS, rgb=_rgb(202), doc="breathes fire"),
        Category("Red_Ball", RED_BALLS, otherwise=BURSTS, rgb=_rgb(64), doc="falls and bursts"),
        Category("Airball", AIRBALLS, rgb=_rgb(WHITE), doc="of a red ball"),
        facing("Snake", SNAKES, rgb=_rgb(196), doc="and the ball out of which it comes"),
        facing("Killer_Moth", MOTHS, count=3, rgb=_rgb(64), doc="place in the group"),
        Category("Knifes", KNIVES, doc="of a knife thrower"),
        Category("Boomerang", BOOMERANGS, doc="of the second floor's master"),
        Category("Spell", SPELLS, doc="of the fourth floor's master"),
        Category("Dragon_Fire", FLAMES, doc="of a dragon"),
        display("Time", TIME.rule(WHITE), role="time", doc="that is left"),
        display("Score", SCORE.rule(GREEN), role="score", doc="points"),
        display("Lives", LIVES.rule(WHITE, base=1), role="lives", doc="one more than the number"),
        display("Player_Health_Bar", bar_rule(YELLOW, (49, 41, 88, 46)), doc="energy, 0-39"),
        display("Enemy_Health_Bar", bar_rule(PINK, (49, 49, 88, 54)), doc="of the master, 0-39"),
        display(
            "Floor",
            FLOOR_MARKS,
            count=5,
            value=ByColor(((RED, 1), (BLUE, 0))),
            doc="1 where it is reached; that of the present floor blinks",
        ),
    ),
)
