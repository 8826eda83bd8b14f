"""King Kong: a climber goes up eight floors to free a captive, past the bombs that Kong throws.

Picture: docs/games/KingKong.png

Screen: girders and walls are scenery. The captive walks above the building. Before a life begins,
the remaining climbers stand on the ground: the first one is the Player, the others are Life.

Slots: Bomb has the game's records, the last thrown one first. A new bomb moves the others to the
next slot.

RAM: ALE's source (score, lives), and the ROM's code: f002-f351 draws, two lines per row. Bombs move
before the frame is drawn. Other figures move afterwards: Kong on even frames, the captive on every
fourth frame and the climber on the next one. Two frames later, the digits change.

Covered: all modes, both halves of a level and a rescue (by writing the RAM), jumps, ladders, falls,
lost lives, the end of the game, odd and even frame skips.

Not exact: the climber's look before a jump or a fall that begins on this frame. The RAM has the
joystick of the next step, and does not record whether a jump has just ended while the button is
held. When a life ends, the RAM is set up for the next one before the last frame is drawn, which
shows the fallen climber and the bombs.

VEM: it misses bombs that Kong or the climber mostly covers, and figures while a hit flashes in one
of their colours.
"""

import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    LivesAsIcons,
    NumberDisplay,
    Pictures,
    Rom,
    Shape,
    box,
    choose,
    copies,
    display,
    edges,
    pick,
    spacing,
    when,
)
from ocjax.extractors.kingkong.drawn import POSES, Drawn, Pose, as_drawn, column, of_climber, there
from ocjax.extractors.kingkong.ram import BombPicture, Ram, State

ROM = Rom("king_kong", "0dd4c69b5f9a7ae96a7a08329496779a")
FONT = ROM.font(0xBDB, rows=7, stride=8, dots=3, shift=5, dot=(4, 2), pitch=16, top_first=True)
SCORE = NumberDisplay(FONT, right=76, top=21, digits=4, leading_zeros=True)
BONUS_POINTS = NumberDisplay(FONT, right=156, top=21, digits=3, leading_zeros=True)

LIME = 56  # of the digits
BROWN = 34  # Kong
PINK = 104  # the building
BLUE = 212  # trousers, and the captive's dress
PALE = 40  # hair, and a part of a fuse
SKIN = 72
SHIRT = 88
SHOES = 8
CLIMBER_COLORS = (SHIRT, SKIN, BLUE, SHOES, PALE)
SHIRT_RGB = (92, 197, 135)
DRESS_RGB = (50, 50, 176)
FUSE = 42
VIOLET = 130  # the widest row of an ordinary bomb
GREEN = 82  # the widest row of a bomb with a bonus
BOMB_COLORS = (VIOLET, GREEN, FUSE, PALE, 38, 54, 68, 116, 120, 148, 196, 216)
WIDEST_ROW = -6  # of a bomb, from its end; its start may be covered

FIRST_LINE = 40  # line of the field's first row; a row has two lines
ROWS = 96
FIELD = (0, FIRST_LINE, 160, FIRST_LINE + 2 * ROWS)
CAPTIVE_TOP = 20
RESCUED_X = 93  # of the captive, on the screen
RESCUER_X = 84
MOST_WAITING = 2
GONE = 128  # least `bomb_y` without a bomb

GRAPHICS = 0xD8D  # in the ROM; pictures begin a row above their pointers
POSE_ROWS = (8, 8, 8, 8, 8, 8, 4)
CLIMBERS = Pictures.of(
    ROM.rows(GRAPHICS + 1 + pose, rows) for pose, rows in zip(POSES, POSE_ROWS, strict=True)
)
BOMB_ROWS = 7
BOMBS = Pictures.of(ROM.rows(GRAPHICS + 1 + pointer, BOMB_ROWS) for pointer in (0x3C, 0x44))
KONG_ROWS = 18
KONG_PICTURE = ROM.rows(GRAPHICS + 1 + 0x5E, KONG_ROWS)
CUT_ROWS = tuple(range(-KONG_ROWS, KONG_ROWS + 1))  # rows below the field; negative: above it
KONG = Pictures.of(
    np.where(np.isin(np.arange(KONG_ROWS) + hidden, range(KONG_ROWS)), KONG_PICTURE, 0)
    for hidden in CUT_ROWS
)
CAPTIVES = Pictures.of(ROM.rows(GRAPHICS + last, 8) for last in (0x4D, 0x56))

FLOORS = (39, 59, 83, 107, 131, 155, 179, 203)  # lines of the girders above each floor
MIDDLE = (76,)  # columns of a floor's ladders
SIDES = (12, 140)
UPPER_SIDES = (20, 132)
LADDER_COLUMNS = (MIDDLE, UPPER_SIDES, MIDDLE, SIDES, MIDDLE, SIDES, MIDDLE, SIDES)
LADDERS = tuple(
    (x, line + 4, x + 8, line + (18 if line == FLOORS[0] else 22))  # the first floor is lower
    for line, columns in zip(FLOORS, LADDER_COLUMNS, strict=True)
    for x in columns
)


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    displayed = m.state >= State.CHOSEN
    return {
        "Player": _climber_box(m, drawn),
        "Girlfriend": _captive_box(m, drawn),
        "Enemy": _kong_box(m, drawn),
        "Bomb": _bomb_boxes(m),
        "Ladder": edges(*np.array(LADDERS).T),
        "Life": _waiting_boxes(m),
        "Score": SCORE.box(m.score, valid=displayed),
        "BonusPoints": BONUS_POINTS.box(10 * drawn.bonus, valid=displayed),
    }


def _climber_box(m: Ram, drawn: Drawn) -> Box:
    """The climber; in the end he stands beside the captive."""
    looks_left = of_climber(m, m.faces_left) == 1
    left, top, width, height = CLIMBERS.extent(drawn.pose, mirrored=looks_left)
    y = FIRST_LINE + 2 * (drawn.y - pick(drawn.pose, POSE_ROWS) + top)
    climbing = box(drawn.x + left, y, width, 2 * height).clip(*FIELD)
    stand_left, _, stand_width, stand_height = CLIMBERS.extent(jnp.int32(Pose.STANDS))
    beside = box(RESCUER_X + stand_left, CAPTIVE_TOP + 1, stand_width, 2 * stand_height)
    return choose(m.state == State.RESCUED, beside, climbing).where(there(m))


def _waiting_boxes(m: Ram) -> Box:
    """The climbers that wait beside the first one, all in the same pose."""
    place = np.arange(1, 1 + MOST_WAITING)
    waits = there(m) & (m.state == State.WAITS) & (place < copies(m.icons))
    left, top, width, height = CLIMBERS.extent(jnp.int32(Pose.STEP))
    x = column(of_climber(m, m.x)) + left + spacing(m.icons) * place
    y = FIRST_LINE + 2 * (of_climber(m, m.y) - POSE_ROWS[Pose.STEP] + top)
    return box(x, y, width, 2 * height, waits)


def _captive_box(m: Ram, drawn: Drawn) -> Box:
    rescued = m.state == State.RESCUED
    left, top, width, height = CAPTIVES.extent(when(~rescued, drawn.captive_look))
    x = jnp.where(rescued, RESCUED_X, drawn.captive_x) + left
    return box(x, CAPTIVE_TOP + 2 * top, width, 2 * height + 1, m.state >= State.WAITS)


def _kong_box(m: Ram, drawn: Drawn) -> Box:
    """Kong, unless the climber has reached the top: the program then draws another figure."""
    first = drawn.kong_y - KONG_ROWS
    hidden = jnp.maximum(drawn.kong_y - ROWS, 0) + jnp.minimum(first, 0)
    left, top, width, height = KONG.extent(hidden - CUT_ROWS[0])
    x = drawn.kong_x + 1 + 2 * left
    y = FIRST_LINE + 2 * (first + top)
    return box(x, y, 2 * width, 2 * height, (height > 0) & (m.state < State.RESCUED))


def _bomb_boxes(m: Ram) -> Box:
    with_bonus = m.bomb_picture == BombPicture.BONUS
    left, top, width, height = BOMBS.extent(when(with_bonus, 1))
    x = column(m.bomb_x) + left
    y = FIRST_LINE + 2 * (m.bomb_y - BOMB_ROWS + top)
    color = jnp.where(with_bonus, GREEN, VIOLET)
    return box(x, y, width, 2 * height, m.bomb_y < GONE, color=color).clip(*FIELD)


ABOVE = (56, CAPTIVE_TOP, 112, 37)  # the building
RESCUER = Blobs(CLIMBER_COLORS, ABOVE, Shape(w=(4, 8), h=16))
CLIMBER = Blobs(CLIMBER_COLORS, FIELD, Shape(w=(1, 8), h=(7, 16)), also=(RESCUER,))
WAITING_AT = ((45, 212, 55, 228), (61, 212, 71, 228))
WAITING = Bounds(CLIMBER_COLORS, WAITING_AT, (6, 16), (8, 16), exclude=("Player",))
BOMB = Blobs(BOMB_COLORS, FIELD, Shape(w=(4, 8), h=(8, 14)))
CAPTIVE = Blobs((PALE, SKIN, SHIRT, BLUE), ABOVE, Shape(w=(6, 8), h=17))
RUNGS = Bounds(PINK, LADDERS)

GAME = Game(
    name="KingKong",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    checks=Checks(
        agreement={"lost": 0.82},  # the climber's and the bombs' records belong to the next life
        lives=(LivesAsIcons(("Life",), hidden=1, between_lives=True),),
    ),
    backdrop=(158,),
    categories=(
        Category("Player", CLIMBER, rgb=SHIRT_RGB, role="player", doc="the climber"),
        Category("Girlfriend", CAPTIVE, rgb=DRESS_RGB, doc="the captive"),
        Category("Enemy", Bounds(BROWN, FIELD), doc="Kong"),
        Category("Bomb", BOMB, count=8, color_row=WIDEST_ROW, doc="what Kong throws"),
        Category("Ladder", RUNGS, count=len(LADDERS), doc="upper first, left before right"),
        display(
            "Life",
            WAITING,
            count=MOST_WAITING,
            rgb=SHIRT_RGB,
            attributes=(),
            role="lives",
            doc="climbers in reserve",
        ),
        display("Score", SCORE.rule(LIME), role="score", doc="points"),
        display("BonusPoints", BONUS_POINTS.rule(LIME), doc="points for a rescue, counted down"),
    ),
)
