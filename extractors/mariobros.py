"""Mario Bros.: Mario knocks pests over from below and kicks them off four floors.

Picture: docs/games/MarioBros.png

Screen: player 0 is Mario. Player 1 draws one pest after the other: below each of three platforms,
the program moves it to the next floor's pest. On some frames it draws the fireball instead of a
pest, so the fireball and the pest of its floor flicker. The missiles are two coins that roll and
turn. In a bonus phase, player 1 alternates between four coins at the left and four at the right.
The top shows the score, or for a while the lives. Pipes are scenery.

Slots: Pest has one per floor, from the top down. BonusCoin has those at the left, then those at the
right, each from the top down. Platform has the lines from the top, each from the left. Level is the
number at the bottom: in a bonus phase, the remaining seconds.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code: f24d-fb58 of its second half, and
b00b-b7e9 of its first. Pests and coins move after the frame is drawn. The pointers and the codes
for the video chip give the drawn positions of pests; `decode` undoes a coin's step. A flickering
object is valid if this frame or the one before shows it.

Covered: all modes, 24 levels up to level 39 and two bonus phases by writing RAM, all pests, lost
lives, the end of the game.

Not exact: a pest that the fireball hides is up to two columns ahead. A coin that has just landed
may be a column off. On the frame on which Mario dies, the lives are already one less.

VEM: the colours of coins are random; it misses a coin with a row in a colour of the scenery. It
misses Mario while he falls off the screen, and figures of one colour that touch. At an edge, it
finds both parts of a coin, and of Mario the higher one, while REM gives the larger part.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    EDGE_CUTS,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Context,
    Detected,
    Game,
    IconRow,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Step,
    Variants,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    edges,
    flag,
    lookup,
    packed_position,
    pick,
    reached,
    when,
)

ROM = Rom("mario_bros", "e908611d99890733be31733a979c62d8")
FONT = ROM.font(0x1F00, rows=7, stride=7)
SCORE = NumberDisplay(FONT, right=103, top=13, digits=6, leading_zeros=True)
COUNTER = NumberDisplay(FONT, right=87, top=180, digits=2, leading_zeros=True)
CAPS = IconRow(left=96, top=13, width=7, height=7, pitch=-8)

BLACK = 0
BLUE = 116  # displays, icy floors
MARIO_BLUE = 118  # and coins of bonus phases
SKIN = 62
BROWN = 52  # shirts, the ground
BOOTS = 244
ORANGE = 58  # the fireball
GREEN = 196  # pipes
RED = 74  # floors
YELLOW = 236  # the level
PEST_COLORS = tuple(ROM.bytes(0x1C1F, 4).tolist())  # turtles, crabs, flies, slipices
POW_COLORS = tuple(range(10, 44, 2))

PICTURE_ROWS = 23  # of a picture
FIRST_LINE = 14  # first line of a picture with `y` 0
PLACE_OFFSET = 6  # columns from a picture's left edge to its `x`
SCREEN_WIDTH = 160
FIELD = (0, 26, SCREEN_WIDTH, 175)
EVERY_FLOOR = np.arange(4)
FLOOR_AREAS = (
    (0, 57, 64, 60),
    (96, 57, 160, 60),
    (0, 95, 16, 98),
    (32, 95, 128, 98),
    (144, 95, 160, 98),
    (0, 135, 48, 138),
    (112, 135, 160, 138),
)
POW_AREA = (72, 141, 88, 148)
# The last row of a pest of this floor that ends at this line is repeated left of the beam.
LATE_FLOOR = 2
LATE_LINE = 135
LATE_COLUMNS = 2  # column of the beam
PAGE_COLUMNS = 3  # further columns if reading the picture crosses a page

COIN_TOP = FIRST_LINE + 12
COIN_ROWS = 12
COIN_WIDTHS = (1, 2, 4, 8)
COIN_OFFSETS = (0, -1, -2, -4)
COIN_RATE = 0x64  # in 256 frames
FLOOR_YS = (2, 20, 58, 98, 138)  # `y` on a floor
FALL_LINES = 2  # lines per frame
BONUS_SIZE = (7, 11)
LEFT_HIDDEN = 3  # low bits of `frame`
RIGHT_HIDDEN = 7


Extent = tuple[jax.Array, jax.Array, jax.Array, jax.Array]  # left, top, width and height


class Phase:  # of `Ram.phase`
    PESTS = 2
    BONUS = 3


class PestState:  # of `Ram.pest`, the two high bits
    FALLS = 3


class Ram(RamMap):
    frame = byte(1)
    phase = byte(3)
    turn = bits(4, count=2)  # the number of the falling pest that is drawn
    fire_turn = flag(4, bit=2)  # the fireball replaces its floor's pest
    counter = bcd(5)  # the level, or in a bonus phase the remaining seconds
    lives = byte(7)
    score = bcd((9, 10))
    faces_left = flag(27, bit=5)
    caps_shown = byte(29)  # remaining frames of the lives in place of the score
    plays = flag(38, bit=7)
    y = byte(42)
    x = byte(44)
    picture_low = byte(48)  # address of Mario's picture, as if it began on line 0
    picture_high = byte(49)
    pest_code = byte(*range(65, 69))  # HMP1 and the turns of the loop before RESP1; 0: not drawn
    pest_low = byte(*range(69, 77, 2))  # address of the picture, as if it began on line 0
    pest_high = byte(*range(70, 77, 2))
    pest_y = byte(*range(89, 93))
    coin_y = byte(93, 94)
    pest_x = byte(*range(95, 99))
    coin_x = byte(99, 100)
    right_coin = byte(*range(101, 105))  # of a bonus phase
    coin_part = byte(105, 106)  # of a step
    pest = byte(*range(107, 111))
    coin = byte(111, 112)
    fire_on = flag(113, bit=7)
    fire_left = flag(113, bit=4)
    fire_pose = bits(113, count=4)
    fire_part = byte(114)  # of a step
    fire_x = byte(115)
    fire_y = byte(116)
    fire_floor = byte(117)
    floor_color = byte(118, 119, 120)
    pow_color = byte(121)


def _addresses(low: int, high: int, count: int) -> list[int]:
    """ROM offsets of pictures with addresses in two tables."""
    pages = ROM.bytes(high, count).astype(int)
    return ((pages << 8 | ROM.bytes(low, count)) & 0xFFF).tolist()


def _at_edges(places: list[int]) -> Pictures:
    """Pictures with columns hidden by an edge, as in `EDGE_CUTS`."""
    rows = [ROM.rows(place, PICTURE_ROWS, top_first=True) for place in places]
    return Pictures.of(
        (r & cut for r in rows for cut in EDGE_CUTS), picture=len(rows), beyond=len(EDGE_CUTS)
    )


POSES = sorted(set(_addresses(0x1C53, 0x1C63, 16)))
MARIO_PICTURES = _at_edges(POSES)
FIRE_PICTURES = _at_edges(_addresses(0x6B3, 0x6BF, 12))


def _last_row_left(place: int) -> int:
    """The first column of a picture's last row."""
    rows = ROM.rows(place, PICTURE_ROWS, top_first=True)
    return 8 - int(rows[np.flatnonzero(rows)[-1]]).bit_length()


BY_STATE = _addresses(0x1BCF, 0x1BF7, 40)  # of pests' pictures
PEST_PLACES = sorted(set(BY_STATE))
PEST_PICTURES = _at_edges(PEST_PLACES)
LAST_ROW_LEFTS = [_last_row_left(place) for place in PEST_PLACES]
# Index of pictures: by state, and by address (the last picture that begins at or before it).
PICTURE_OF = [PEST_PLACES.index(place) for place in BY_STATE]
PEST_PAGES = range(0xB00, 0xE00)
PICTURE_BEFORE = [
    max([i for i, p in enumerate(PEST_PLACES) if p <= at], default=0) for at in PEST_PAGES
]
BANK = 0xB000
# Schedules of eight frames: the high nibble with a fireball, the low nibble without one.
TURN_TABLE = ROM.bytes(0x1BB7, 24).tolist()
ROWS_OF_TURNS = ROM.bytes(0x1FE3, 4).tolist()  # their first entries, by the number of falling pests
FIRE_RATES = ROM.bytes(0x69B, 12).tolist()  # added to `fire_part`, by pose: an overflow is a step
FAST_LEVEL = 10  # first level with a step of the fireball on each of its turns ($F5CB, bank 0)


def _bonus_places() -> tuple[list[int], list[int]]:
    """Columns and lines of the coins of a bonus phase: at the left, then at the right."""
    codes = ROM.bytes(0x779, 8).astype(int)
    fine = (codes >> 4 ^ 8) - 8
    x = np.where(codes & 15 == 0, 9 - fine, 15 * (codes & 15) - fine) - PLACE_OFFSET
    masks = (ROM.bytes(0x789, 4).astype(int) << 8) + ROM.bytes(0x785, 4)
    y = 0xB9EF - masks + FIRST_LINE + 1
    return x.tolist(), np.tile(y, 2).tolist()


BONUS_X, BONUS_Y = _bonus_places()


def decode(m: Ram) -> dict[str, Box]:
    earlier = _turn_before(m)
    return {
        "Player": _player(m),
        "Pest": _pests(m, earlier).where(m.phase == Phase.PESTS),
        "Fireball": _fireball(m, earlier).where(m.phase == Phase.PESTS),
        "BonusBlock": _coins(m).where(m.phase == Phase.PESTS),
        "BonusCoin": _bonus_boxes(m).where(m.phase == Phase.BONUS),
        "PowBlock": edges(*POW_AREA, valid=m.pow_color > 0, color=m.pow_color & 0xFE),
        "Platform": _platforms(m),
        "Level": COUNTER.box(m.counter),
        "Score": SCORE.box(m.score * 100, valid=m.caps_shown == 0),
        "Life": CAPS.box(m.lives - 1, m.caps_shown > 0, value=m.lives),
    }


def _begin(x: jax.Array) -> jax.Array:
    """The column at which a sprite begins; in the first turn of its loop, it is a column late."""
    column = x - PLACE_OFFSET + when(x < 8, 1)
    return column + when(column < -4, SCREEN_WIDTH)


def _figure(
    pictures: Pictures,
    picture: jax.Array,
    x: jax.Array,
    y: jax.Array,
    mirrored: jax.Array | bool = False,
) -> Extent:
    """The larger part of a picture that an edge may cut in two."""
    column = _begin(x)
    beyond = jnp.clip(column + 8 - SCREEN_WIDTH, 0, 8) - jnp.clip(-column, 0, 8)
    cut = beyond if mirrored is False else jnp.where(mirrored, -beyond, beyond)
    index = pictures.index(picture=picture, beyond=cut + len(EDGE_CUTS) // 2)
    left, top, width, height = pictures.extent(index, mirrored=mirrored)
    return column + left, y + FIRST_LINE + top, width, height


def _player(m: Ram) -> Box:
    is_left = m.faces_left
    compass = jnp.where(is_left, WEST, EAST)
    at = (m.picture_high << 8 | m.picture_low) + m.y - BANK
    pose = reached(at, POSES[1:])
    place = _figure(MARIO_PICTURES, pose, m.x, m.y, is_left)
    return box(*place, m.plays, orientation=compass).clip(*FIELD)


def _turn_before(m: Ram) -> jax.Array:
    """The content of the frame before: `turn` in the two low bits, `fire_turn` in the next one."""
    falling = jnp.sum(m.pest >> 6 == PestState.FALLS, axis=0, dtype=jnp.int32)
    turns = lookup(TURN_TABLE, pick(falling, ROWS_OF_TURNS) + (m.frame - 2 & 7))
    return jnp.where(m.fire_on, turns >> 4, turns & 15)


def _pests(m: Ram, earlier: jax.Array) -> Box:
    """The pests that this frame or the one before shows."""
    under_fire = m.fire_turn & m.fire_on & (m.fire_floor == EVERY_FLOOR)
    drawn = (m.pest_code != 0) & ~under_fire
    falls = m.pest >> 6 == PestState.FALLS
    rank = jnp.cumsum(when(falls, 1), axis=0)
    waits = jnp.where(falls, earlier & 3 == rank, under_fire & (earlier & 4 == 0))
    picture, x, y = _as_drawn(m, drawn)
    left, top, width, height = _figure(PEST_PICTURES, picture, x, y)
    at_line = drawn & (EVERY_FLOOR == LATE_FLOOR) & (top + height == LATE_LINE)
    crosses = m.pest_low + LATE_LINE - FIRST_LINE > 0xFF
    late = at_line & (
        _begin(x) + pick(picture, LAST_ROW_LEFTS) < LATE_COLUMNS + when(crosses, PAGE_COLUMNS)
    )
    color = pick(m.pest >> 4 & 3, PEST_COLORS)
    there = drawn | (waits & (m.pest != 0))
    return box(left, top, width, height + when(late, 1), there, color=color).clip(*FIELD)


def _as_drawn(m: Ram, drawn: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Picture, x and y of pests: drawn ones by the pointers, others by their records."""
    state = m.pest & 0x3F
    turned = (state & 0x31 == 0) & (m.pest & 1 == 0)
    own = lookup(PICTURE_OF, (state >> 1) + when(turned, 32))
    record_y = jnp.where(m.pest != 0, m.pest_y, jnp.roll(m.pest_y, -1, axis=0))
    pointer = (m.pest_high << 8 | m.pest_low) - BANK
    picture = jnp.where(drawn, lookup(PICTURE_BEFORE, pointer + record_y - PEST_PAGES.start), own)
    y = jnp.where(drawn, lookup(PEST_PLACES, picture) - pointer, m.pest_y)
    first_turn = m.pest_code & 15 == 0
    x = packed_position(m.pest_code) - jnp.where(first_turn, -1, 7)
    return picture, jnp.where(drawn, x, m.pest_x), y


def _fireball(m: Ram, earlier: jax.Array) -> Box:
    """The fireball, if this frame or the one before shows it."""
    moved = (m.counter >= FAST_LEVEL) | (m.fire_part < lookup(FIRE_RATES, m.fire_pose))
    since = moved & ~m.fire_turn
    x = m.fire_x + when(since, jnp.where(m.fire_left, 1, -1))
    before = jnp.where(m.fire_pose == 0, 3, m.fire_pose - 1)
    place = _figure(FIRE_PICTURES, jnp.where(since, before, m.fire_pose), x, m.fire_y)
    shown = m.fire_turn | (earlier & 4 != 0)
    return box(*place, shown & m.fire_on).clip(*FIELD)


def _coins(m: Ram) -> Box:
    """Coins that roll along the floors and spin."""
    size = (m.frame - 1 & 15) >> 2
    stands = among(m.coin_y, FLOOR_YS)
    rolled = stands & (m.coin_part < COIN_RATE)
    x = m.coin_x - when(rolled, jnp.where(m.coin & 1 == 1, -1, 1))
    y = m.coin_y - when(~stands, FALL_LINES) + COIN_TOP
    there = among(m.coin >> 6, (1, 2))
    return box(x + pick(size, COIN_OFFSETS), y, pick(size, COIN_WIDTHS), COIN_ROWS, there).clip(
        *FIELD
    )


def _bonus_boxes(m: Ram) -> Box:
    """The coins of the two sides alternate; every 8 frames, each side is hidden twice in a row."""
    left = (m.pest != 0) & (m.frame & 7 != LEFT_HIDDEN)
    right = (m.right_coin != 0) & (m.frame & 7 != RIGHT_HIDDEN)
    return box(np.array(BONUS_X), np.array(BONUS_Y), *BONUS_SIZE, jnp.concatenate([left, right]))


def _platforms(m: Ram) -> Box:
    floor = np.array([0, 0, 1, 1, 1, 2, 2])
    left, top, right, bottom = np.array(FLOOR_AREAS).T
    return edges(left, top, right, bottom, color=m.floor_color[floor])


PLAYER_RULE = Blobs(
    (MARIO_BLUE, BLUE, SKIN, BROWN, BOOTS), FIELD, Shape(w=(4, 8), h=(12, 23)), gap=(1, 1)
)
PEST_SHAPES = (
    Shape(w=(4, 8), h=(5, 11)),
    Shape(w=(4, 8), h=12, pixels=(1, 95)),  # a coin has more
    Shape(w=(4, 8), h=(13, 18)),
)


class LeftHalves(Step):
    """Drop the right one of a pest's two halves at the edges. Other parts are too narrow."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        end = found.y + found.h
        in_rows = (found.y[:, None] < end[None]) & (found.y[None] < end[:, None])
        at_left = found.valid & (found.x == 0)
        at_right = found.x + found.w == SCREEN_WIDTH
        return found.where(~(at_right & jnp.any(in_rows & at_left[None], axis=1)))


PEST_RULE = Blobs(PEST_COLORS, FIELD, PEST_SHAPES, gap=(1, 1), then=(LeftHalves(),))
FIRE_RULE = Blobs(ORANGE, FIELD, Shape(w=(4, 8), h=(5, 16)), gap=(2, 2))
SCENERY = (BLACK, GREEN, RED, *POW_COLORS)
COIN_COLORS = tuple(c for c in range(0, 256, 2) if c not in SCENERY)
COIN_SHAPES = tuple(Shape(w=w, h=(10, 12), pixels=(10 * w, 12 * w)) for w in COIN_WIDTHS)
COIN_RULE = Blobs(COIN_COLORS, FIELD, COIN_SHAPES)
BONUS_RULE = Blobs(MARIO_BLUE, FIELD, Shape(w=BONUS_SIZE[0], h=BONUS_SIZE[1]))

GAME = Game(
    name="MarioBros",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(210, 160),
    checks=Checks(
        miscounted={"Score": 9},  # two players
    ),
    variants=Variants(
        modes={
            0: "fireballs, 5 lives",
            2: "no fireballs, 5 lives",
            4: "fireballs, 3 lives",
            6: "no fireballs, 3 lives",
        },
        source="ALE's source code, and play of all modes in the emulator",
    ),
    categories=(
        Category(
            "Player",
            PLAYER_RULE,
            attributes=("orientation",),
            rgb=(104, 72, 198),
            role="player",
            doc="Mario",
        ),
        Category("Pest", PEST_RULE, count=4, doc="turtles, crabs, flies, slipices"),
        Category("Fireball", FIRE_RULE, doc="fireball"),
        Category("BonusBlock", COIN_RULE, count=2, doc="rolling coins"),
        Category("BonusCoin", BONUS_RULE, count=8, doc="coins of a bonus phase"),
        Category("PowBlock", Bounds(POW_COLORS, POW_AREA), doc="POW block"),
        Category(
            "Platform", Bounds((RED, BLUE), FLOOR_AREAS, min_size=(8, 3)), count=7, doc="floors"
        ),
        display(
            "Level",
            COUNTER.rule(YELLOW),
            doc="level, or in a bonus phase the seconds left",
            aliases=("Time",),
        ),
        display(
            "Score",
            Bounds(BLUE, SCORE.area, (46, 7), value=SCORE.rule(BLUE).value),
            role="score",
            doc="points",
        ),
        display(
            "Life",
            CAPS.rule(BLUE, (56, 13, 104, 20), single=2, max_size=(45, 7)),
            role="lives",
            doc="lives; one has no cap",
        ),
    ),
)
