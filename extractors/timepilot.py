"""Time Pilot: a jet in the middle of the sky, and enemies that fly around it, in five eras.

Picture: docs/games/TimePilot.png

Screen: the era sets the enemies' colour and category: green biplanes (1910), black ones (1940),
yellow helicopters (1970), blue jets (1983), orange saucers (2001). The mother ship, which comes
when no enemies are left, is an enemy of its era. Clouds, the purple bars beside the lives, and the
texts before a flight are scenery, but Score takes the box of the text in its position. An icon of
Enemies_Left counts for four enemies, so the value is a multiple of four: the most that can be left.

Slots: Enemies have the game's four records, and then the lower parts of the same four: a plane at
the upper edge also shows at the lower edge. An exploding plane stays an object until it is gone.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code.

Timeline of a frame:
    F051         the sync
    F346         the game makes its steps
    F8E6         it draws the frame
    F0AB         it changes the states and the pictures of a hit; `decode` reverts this
Timeline of the drawing, in lanes of 16 rows:
    each lane    has room for one plane; its picture is set during the first row, too late for that
                 row of planes with `x` below 20
    even rows    show shots: the jet's shot alternates between its position and the one before, and
                 the enemies' two shots alternate

Covered: all eras and mother ships (written to RAM), all difficulties, the flight through time, lost
lives, the end of the game.

Not exact: clouds in the lower half hide shots and parts of planes. Black lines hide objects at the
left edge. A plane hides its new shot. The game draws no shot if its `y` is a multiple of 16.

VEM: it misses shots at the jet's nose and within 2 columns of a plane, whose tips look like shots.
It reads no score where a text replaces it, and takes the era from a pixel of sky that clouds may
hide.
"""

import functools
import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    BoxTable,
    Category,
    Checks,
    Game,
    Gauge,
    KindEntry,
    Kinds,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shades,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    div,
    match,
    mirrored,
    pick,
    when,
    wrap,
)

ROM = Rom("time_pilot", "fc2104dd2dadf9a6176c1c1c8f87ced9")
FONT = ROM.font(0xD00, rows=10)
BANK = 0x1000  # offset of the pictures, which are at $D000

SCORE = NumberDisplay(FONT, right=104, top=7, digits=6, leading_zeros=True)

WARP_WHITE = 14
TEXT_COLOR = 40
GOLD = 42
RED = 66
VIOLET = 138


class Era(NamedTuple):
    """Facts about an era, and the aircraft that are the enemies in it."""

    name: str
    page: int  # of the enemies' pictures
    sky: int  # colours
    clouds: int
    jet: int
    enemy: int
    absent: int  # an index that no frame has: VEM's colour of these enemies in other eras


ERAS = tuple(
    Era(*facts)
    for facts in zip(
        ("Green", "Black", "Yellow", "Blue", "Orange"),
        ROM.bytes(0xE3E, 5).tolist(),
        ROM.bytes(0xD88, 5).tolist(),
        ROM.bytes(0xD8D, 5).tolist(),
        ROM.bytes(0xD92, 5).tolist(),
        ROM.bytes(0xD97, 5).tolist(),
        (1, 3, 5, 7, 9),
        strict=True,
    )
)
JET_COLORS = [era.jet for era in ERAS]
ENEMY_COLORS = [era.enemy for era in ERAS]
PAGES = [era.page for era in ERAS]
FIRST_PAGE = 0xD8
PAGE_COUNT = 7
ANIMATED = (2, 4)  # eras with two pages
BOSS_PICTURE = 0xC6
EXPLOSION_PICTURE = 0xA6
LOOKS = (*ROM.bytes(0xDD8, 8).tolist(), BOSS_PICTURE, EXPLOSION_PICTURE)  # first eight directions
BOSS_LOOK = 8  # index in `LOOKS`
EXPLOSION_LOOK = 9  # index in `LOOKS`
WESTWARD = 4  # least direction to the west; these pictures are mirrored
JET_LOOKS = tuple(ROM.bytes(0xECD, 8).tolist())  # by direction
FIRST_JET_EXPLOSION = 8  # index of the two pictures after those, the second one is mirrored


class Look:  # of `Ram.look`
    EXPLODES = 0x7C
    GONE = 0x8C


class State:  # of `Ram.state`
    READY = 1
    FLIES = 2


class Flag:  # bits of `Ram.flags`
    MOTHER = 64
    HIT = 128


class Player:  # bits of `Ram.player`
    DONE = 64  # the era is over
    SHOWN = 128  # the texts were shown


BLANKED = 128  # least `idle` of a blank screen
SKY = (0, 33, 160, 177)
LANE = 16
LATE_X = 20  # least `x` at which the picture is set before the first row is over
BOTTOM = 176  # row of `y` 0
UPPER_EDGE = 143  # `y` of a plane with its last row in the first row of the sky
SKY_ROWS = 144  # from a plane at the upper edge to its part at the lower edge
WRAPS = range(131, 144)  # `y` of a plane with a part at the lower edge
AT_JET = range(48, 80)  # `y` of a plane that may have hit the jet
NOSE = (76, 97, 84, 113)  # around the jet
STEP_X = [0, 4, 4, 4, 0, -4, -4, -4]  # of shots, by direction
STEP_Y = [4, 4, 0, -4, -4, -4, 0, 4]  # upwards
# Values of the clock modulo 8.
SPAWN = 5  # enemies shoot
MOVES = (2, 7)  # shots move
HIGHEST_SHOT = 142  # greatest `enemy_shot_y` of a new shot
CLOUD_PLACES = 21  # across
CLOUD_ROWS = range(0, 28, 4)  # of a cloud, in a lane

ENEMY_ROWS = [
    ROM.rows(BANK | (page & 0xF) << 8 | look, LANE)
    for page in range(FIRST_PAGE, FIRST_PAGE + PAGE_COUNT)
    for look in LOOKS
]


COLUMN_CUTS = (0x3F, 0x7F, 0xFF, 0xFE, 0xFC)  # dots without 2 and 1 on the left, all, without ...
COMPLETE = 2  # index in that table


def _cut_pictures() -> Pictures:
    """The pictures as edges cut them.

    A cut of rows has the lowest 1 to 16 rows (part 0), or the remaining rows above them (part 1).
    """
    row = np.arange(LANE)[::-1]
    lowest = [row <= last for last in range(LANE)]
    above = [row > last for last in range(LANE)]
    return Pictures.of(
        (
            np.where(kept, rows & columns, 0)
            for rows in ENEMY_ROWS
            for columns in COLUMN_CUTS
            for kept in (*lowest, *above)
        ),
        page=PAGE_COUNT,
        look=len(LOOKS),
        columns=len(COLUMN_CUTS),
        part=2,
        last=LANE,
    )


class CloudHalf(NamedTuple):
    """Tables of a cloud's half by its place across."""

    starts: int  # offset of low bytes
    pages: int  # offset of pages
    bit: int  # the dot in front of the jet
    uncovered: int  # dots of the jet beside it


RIGHT_HALF = CloudHalf(starts=0xF15, pages=0xED5, bit=0x10, uncovered=0xF0)
LEFT_HALF = CloudHalf(starts=0xF3F, pages=0xF00, bit=0x80, uncovered=0x0F)


def _uncovered_dots(half: CloudHalf, place: int, below: int) -> np.ndarray:
    """The dots of the jet's lane that a cloud's half leaves visible, by row."""
    start = ROM.bytes(half.starts + place, 1).item()
    page = ROM.bytes(half.pages + place, 1).item() & 0xF
    rows = ROM.bytes((BANK | page << 8 | start) + below, LANE)[::-1]
    doubled = rows[::2].repeat(2)
    return np.where(doubled & half.bit > 0, half.uncovered, 0xFF)


def _behind_clouds(rows: np.ndarray) -> list[np.ndarray]:
    """The jet's picture, complete and then behind each cloud at each position in its lane."""
    positions = itertools.product(range(CLOUD_PLACES), CLOUD_ROWS)
    return [
        rows,
        *(
            rows & _uncovered_dots(RIGHT_HALF, *cloud) & _uncovered_dots(LEFT_HALF, *cloud)
            for cloud in positions
        ),
    ]


CUTS = _cut_pictures()
JET_ROWS = [ROM.rows(BANK | 0x500 | look, LANE) for look in (*JET_LOOKS, *[Look.EXPLODES] * 2)]
MIRRORED_LOOKS = np.array([0, 0, 0, 0, 1, 1, 1, 1, 0, 1])
CLOUDS = CLOUD_PLACES * len(CLOUD_ROWS)  # positions; 0 in `JETS` is no cloud
JETS = Pictures.of(
    [
        shown
        for rows, flip in zip(JET_ROWS, MIRRORED_LOOKS, strict=True)
        for shown in _behind_clouds(mirrored(rows) if flip else rows)
    ],
    look=len(JET_ROWS),
    cloud=CLOUDS + 1,
)


class Ram(RamMap):
    state = byte(0)
    clock = byte(1)  # of the next frame
    idle = byte(3)
    timer = byte(4)  # frames of a state
    player = byte(9)
    lives = bits(11, count=3)  # in reserve
    score = bcd((15, 13))  # hundreds
    era = byte(21)
    left = byte(22)  # enemies that are left
    bars = byte(33)  # beside the lives; 0 before the first frame of a flight
    way = bits(35, count=3)  # of the jet, eighths of a turn clockwise from north
    look = byte(36)
    x = byte(37, 38, 39, 40)  # x + 4; 0: no plane
    y = byte(41, 42, 43, 44)  # 176 - y of the picture's bottom; 0: no plane
    flags = byte(45, 46, 47, 48)
    enemy_way = bits(45, 46, 47, 48, count=3)
    explosion = bits(45, 46, 47, 48, first=4, count=2)
    shot_x = byte(73, 74)  # x + 5: now, before
    shot_y = byte(75, 76)  # 176 - y
    enemy_shot_way = bits(86, 87, count=3)
    enemy_shot_x = byte(88, 89)
    enemy_shot_y = byte(90, 91)
    cloud_place = byte(101)
    cloud_row = byte(109)  # of the jet's lane


def decode(m: Ram) -> dict[str, Box]:
    there = (m.idle < BLANKED) & ~_warps(m)
    jet_color = pick(m.era, JET_COLORS)
    enemy_color = pick(m.era, ENEMY_COLORS)
    enemies = replace(_enemy_boxes(m).where(there), color=enemy_color)
    shot_boxes = replace(_enemy_shots(m).where(there), color=enemy_color)
    return {
        **PLANES.split(enemies, m.era),
        **PLANE_SHOTS.split(shot_boxes, m.era),
        "Player": replace(_jet_box(m), color=jnp.where(_warps(m), WARP_WHITE, jet_color)),
        "Player_Shot": replace(_shot(m).where(there), color=jet_color),
        "Life": _icon_boxes(m).where(_flight(m)),
        "Enemies_Left": _enemies_left(m),
        "Score": _score_box(m),
    }


def _flight(m: Ram) -> jax.Array:
    """True if the screen shows a flight instead of a text."""
    return ((m.state == State.FLIES) & (m.bars > 0)) | _just_gone(m)


def _warps(m: Ram) -> jax.Array:
    """True if the jet flies to the next era."""
    return ((m.state == State.READY) | (m.bars == 0)) & ((m.player & Player.DONE) != 0)


def _just_gone(m: Ram) -> jax.Array:
    """True if the jet's explosion has just ended and is still on the screen."""
    ready = (m.state == State.READY) & (m.timer == 1)
    return ready & ((m.player & (Player.DONE | Player.SHOWN)) == Player.SHOWN)


def _just_hit(m: Ram) -> jax.Array:
    """True if the jet was hit on this frame, which still shows it intact."""
    return (m.look == Look.EXPLODES) & (m.timer == 0) & (m.bars > 0)


def _jet_box(m: Ram) -> Box:
    """The jet; clouds may hide a part of it."""
    explodes = ((m.look == Look.EXPLODES) & ~_just_hit(m)) | _just_gone(m)
    look = jnp.where(explodes, FIRST_JET_EXPLOSION + (m.way >> 2), m.way)
    place = len(CLOUD_ROWS) * m.cloud_place + div(m.cloud_row, CLOUD_ROWS.step)
    cloud = when(~_warps(m), jnp.clip(place + 1, 1, CLOUDS))
    not_drawn_yet = (m.state == State.READY) & (m.timer == 1) & ((m.player & Player.SHOWN) == 0)
    exists = (m.look != Look.GONE) | _just_gone(m)
    fields: dict[str, Any] = {
        "valid": exists & ~not_drawn_yet & (m.idle < BLANKED),
        "orientation": 2 * m.way,
    }
    whole = JETS.box(JETS.index(look=look, cloud=0), *NOSE[:2], **fields)
    seen = JETS.box(JETS.index(look=look, cloud=cloud), *NOSE[:2], **fields)
    return choose(seen.w > 0, seen, whole)


def _shot(m: Ram) -> Box:
    """The last drawn position of the jet's shot."""
    before = ((m.clock & 1) == 0) & (m.shot_y[1] > 0)
    x = jnp.where(before, m.shot_x[1], m.shot_x[0])
    y = jnp.where(before, m.shot_y[1], m.shot_y[0])
    return _shot_box(x, y, m.shot_y[0] > 0)


def _shot_box(x: jax.Array, y: jax.Array, there: jax.Array) -> Box:
    """Shots as drawn: on even rows."""
    return box(wrap(x - 5), BOTTOM - y - (y & 1), 1, 2, there)


def _enemy_boxes(m: Ram) -> Box:
    """The planes, and their parts at the lower edge."""
    past_edge = UPPER_EDGE - m.y
    room = past_edge - when(m.x < LATE_X, 1)  # rows below the upper edge, less 1
    row_in_lane = m.y & LANE - 1
    next_lane = jnp.where(row_in_lane < 3, LANE - 1 - row_in_lane, LANE - 1)
    last = jnp.clip(jnp.minimum(room, next_lane), 0, LANE - 1)
    rest = jnp.clip(past_edge, 0, LANE - 1)
    on_screen = (m.x > 0) & (m.y > 0)
    top = BOTTOM - LANE + 1 - m.y
    upper = _plane_boxes(m, part=0, last=last, y=top, valid=on_screen)
    crosses = on_screen & among(m.y, WRAPS)
    lower = _plane_boxes(m, part=1, last=rest, y=top + SKY_ROWS, valid=crosses)
    return Box.stacked(upper, lower).clip(*SKY)


def _plane_boxes(m: Ram, part: int, last: jax.Array, y: jax.Array, valid: jax.Array) -> Box:
    """The visible part of each plane's rows and columns."""
    flipped = m.enemy_way >= WESTWARD
    beyond = jnp.clip(4 - m.x, 0, 2)  # columns
    columns = COMPLETE + jnp.where(flipped, beyond, -beyond)
    picture = CUTS.index(
        page=_page_index(m), look=_plane_looks(m), columns=columns, part=part, last=last
    )
    facing = 2 * m.enemy_way
    return CUTS.box(picture, m.x - 4, y, mirrored=flipped, valid=valid, orientation=facing)


def _page_index(m: Ram) -> jax.Array:
    """Index of the era's page of pictures; two eras have two pages by turns."""
    second = among(m.era, ANIMATED) & ((m.clock - 1 & 8) != 0)
    return pick(m.era, PAGES) - FIRST_PAGE + when(second, 1)


def _plane_looks(m: Ram) -> jax.Array:
    """Index in `LOOKS` of each plane."""
    spared = _just_hit(m) & (m.explosion == 0) & among(m.y, AT_JET)
    hit = (m.flags & Flag.HIT) != 0
    mother = (m.flags & Flag.MOTHER) != 0
    return match((hit & ~spared, EXPLOSION_LOOK), (mother, BOSS_LOOK), otherwise=m.enemy_way)


def _enemy_shots(m: Ram) -> Box:
    """The last drawn positions of the enemies' shots, except new shots that are not drawn yet."""
    phase = m.clock - 1 & 7
    waits = ((phase & 1) != np.arange(2)) & (m.state == State.FLIES)  # until it is drawn
    moved = among(phase, MOVES) & waits
    x = m.enemy_shot_x - when(moved, pick(m.enemy_shot_way, STEP_X))
    y = m.enemy_shot_y - when(moved, pick(m.enemy_shot_way, STEP_Y))
    source_x = m.x + 4
    source_y = jnp.minimum(m.y + 4, HIGHEST_SHOT)
    at_source = (x[:, None] == source_x[None]) & (y[:, None] == source_y[None])
    is_new = (phase == SPAWN) & waits & at_source.any(axis=1)
    return _shot_box(x, y, (m.enemy_shot_y > 0) & ~is_new).clip(*SKY)


def _icon_boxes(m: Ram) -> Box:
    left = pick(m.lives, (80, 80, 80, 72, 64))
    right = jnp.where(m.lives > 1, 96, 88)
    return box(left, 18, right - left, 10, m.lives > 0, value=m.lives + 1)


MOST_LEFT = 6  # icons of enemies
ICON_X = 56  # of the first one
ICON_ROWS = 10


def _box_of_icons(era: Era, icons: list[int]) -> tuple[int, ...]:
    """The tight box of a row of icons, given by low bytes of pictures; 0 is no icon."""
    used = [place for place, low in enumerate(icons) if low]
    if not used:
        return (0,) * 4
    at = BANK | (era.page & 0xF) << 8
    pictures = [ROM.rows(at | icons[place], ICON_ROWS) for place in used]
    ink = np.flatnonzero(np.sum(pictures, axis=0)).tolist()
    width = 8 * (used[-1] - used[0] + 1)
    return ICON_X + 8 * used[0], ink[0], width, ink[-1] - ink[0] + 1


def _boxes_of_icons() -> BoxTable:
    """The boxes of up to six icons, by their number and the era."""
    by_number = ROM.bytes(BANK | 0x32B, 7 * MOST_LEFT).reshape(MOST_LEFT, 7).T.tolist()
    return BoxTable([_box_of_icons(era, icons) for icons in by_number for era in ERAS])


LEFT_BOXES = _boxes_of_icons()
PER_ICON = 4  # enemies that an icon stands for, at most


def _enemies_left(m: Ram) -> Box:
    """The icons at the bottom, each for up to `PER_ICON` enemies."""
    icons = div(m.left + PER_ICON - 1, PER_ICON)
    there = (m.left > 0) & (m.idle < BLANKED)
    color = jnp.where(_flight(m), 0, RED)
    index = len(ERAS) * icons + m.era
    value = PER_ICON * icons
    return LEFT_BOXES.at(index, y=180, valid=there, value=value, color=color)


def _score_box(m: Ram) -> Box:
    """The score, or the text that replaces it."""
    value = 100 * m.score
    text = box(56, 7, 48, 9, m.state >= State.READY, value=value)
    shown = choose(_flight(m), SCORE.box(value), text)
    return replace(shown, color=jnp.where(_flight(m), GOLD, TEXT_COLOR))


plane_category = functools.partial(Category, attributes=("orientation",), count=8, doc="enemies")
shot_category = functools.partial(Category, count=2, blinks=True, doc="their shots")
plane_blobs = functools.partial(Blobs, region=SKY, shapes=Shape(w=(3, 8), h=(2, 15)), gap=(3, 2))
shot_blobs = functools.partial(Blobs, region=SKY, shapes=Shape(w=1, h=2), gap=(2, 0))
FIRST_COLORS = (ERAS[0].enemy, *(era.absent for era in ERAS[1:]))  # in the first era, by category
PLANES = Kinds(
    *(
        KindEntry(plane_category(f"Enemy_{era.name}", plane_blobs(color)), (number,))
        for number, (era, color) in enumerate(zip(ERAS, FIRST_COLORS, strict=True))
    )
)
PLANE_SHOTS = Kinds(
    *(
        KindEntry(shot_category(f"Enemy_{era.name}_Shot", shot_blobs(color)), (number,))
        for number, (era, color) in enumerate(zip(ERAS, FIRST_COLORS, strict=True))
    )
)
JET_SHOT = Blobs(ERAS[0].jet, SKY, Shape(w=1, h=2), ignore=(NOSE,))
WHOLE_JET = Bounds((ERAS[0].jet, WARP_WHITE), NOSE, (3, 3))


def _colors_in(era: Era) -> tuple[int, ...]:
    """The colours of the jet and of each category of enemies in an era."""
    return era.jet, *(each.enemy if each is era else each.absent for each in ERAS)


ERAS_WITH_CLOUDS = (ERAS[1], ERAS[2], ERAS[4])  # their colour identifies the era
BY_ERA = Shades(
    (156, 33),
    (*(era.sky for era in ERAS), *(era.clouds for era in ERAS_WITH_CLOUDS)),
    tuple(_colors_in(era) for era in (*ERAS, *ERAS_WITH_CLOUDS)),
)

LAST_ICONS = Bounds((0, RED), (56, 180, 104, 188), value=Gauge(8, worth=PER_ICON))

GAME = Game(
    name="TimePilot",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=BY_ERA,
    checks=Checks(
        rare=("Enemy_Black", "Enemy_Yellow", "Enemy_Blue", "Enemy_Orange"),
        known={"Score": 0.8},  # a text
        # All directions of flight share pictures of Enemy_Orange.
        mirrored={"Enemy_Yellow": None, "Enemy_Blue": None, "Enemy_Orange": 0.34},
    ),
    categories=(
        Category("Player", WHOLE_JET, attributes=("orientation",), role="player", doc="the jet"),
        Category("Player_Shot", JET_SHOT, blinks=True, doc="its shot"),
        *PLANES.categories,
        *PLANE_SHOTS.categories,
        display(
            "Life",
            Bounds(VIOLET, (64, 18, 96, 28), value=Gauge(8, 0, 1)),
            role="lives",
            doc="lives",
        ),
        display("Enemies_Left", LAST_ICONS, doc="before the mother ship comes, at most"),
        display("Score", SCORE.rule((GOLD, TEXT_COLOR)), role="score", doc="points"),
    ),
)
