"""Asteroids: a ship among large, medium and small asteroids that drift up and down, and a saucer.

Picture: docs/games/Asteroids.png

Screen: odd frames show the asteroids, even frames the ship, the saucer and the shots. If an edge
cuts the ship or the saucer in two, the box covers the larger part. Player is not valid without a
ship (OCAtari's placeholder NoObjectPlayer is omitted).

Slots: the game keeps two lists of asteroids, one that goes up and one that goes down. Each list is
sorted from the top of the screen down, and its entries shift when an asteroid crosses an edge,
breaks or disappears. A list moves one step every two frames, 89 steps around the screen, and the
game counts frames. This gives the order of arrival of a list's asteroids at the top or bottom, and
the order gives the slot: ten per direction, filled cyclically. Asteroids, also fragments, are at
least 10 steps apart. The first fragment keeps the slot, the second gets the adjacent one. The
incoming part of an asteroid that leaves gets the next slot in the cycle. If the right edge cuts an
asteroid, its left part is 20 slots further. The complete asteroid returns to the slot of its right
part (0.2 % of steps of four frames), because no byte counts how often an asteroid has gone around
sideways. Between waves no slot is valid for a frame. Asteroids change slots when the counter
restarts after 65,536 frames.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (lists), a public disassembly by Dennis
Debro (names), and the ROM's code. Columns are in the chip's coding: the low nibble is the step of
15 pixels (odd and even steps start at different columns), the high nibble is subtracted.

Timeline of two frames:
    odd frame    the asteroids step by two rows, and the frame shows them; after its drawing, the
                 first asteroid of the lists has already made its step aside
    even frame   shows the ship, the saucer and the shots
A list makes a lap of 89 steps. An asteroid's number of steps since it came in is therefore the
number of all steps plus its row, in the direction of the list.

Covered: modes with slow and fast asteroids and with each of the stick's features (hyperspace,
shields, turning about), both difficulties (the saucer appears at A), explosions, later waves,
resets. While the reset switch is held, a new game begins on every frame, and its asteroids follow
from the previous game's last random number. The first frame after a reset therefore shows the
previous game's asteroids, the second frame the asteroids in the RAM, the third one also the ship.

Not exact: the digits on the frame on which a point is made; on odd frames, whether a new ship has
already been drawn. The RAM contains no trace of them. A ship cut by the right edge has a box with
all its rows.

VEM: touching asteroids of one colour that exceed the largest asteroid are split by the picture at
their first pixel, otherwise evenly; smaller groups count as one. VEM sees the visible pieces of an
asteroid behind another one, but no part at the edge of one column and two rows.
"""

import functools
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    WIDTH as SCREEN_WIDTH,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Context,
    Detected,
    Digits,
    Game,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Step,
    Variants,
    Word,
    among,
    bcd,
    bits,
    box,
    boxes,
    byte,
    display,
    div,
    flag,
    high,
    larger_part,
    low,
    match,
    mod,
    pick,
    picture,
    signed,
    signed_nibble,
    when,
    wrap,
)

ROM = Rom("asteroids", "ccbd36746ed4525821a8083b0d6d2c2c")
FONT = ROM.font(0xD96, rows=5, dots=3, dot=(4, 2), pitch=16)  # all digits are equally wide
# Headings of the ship to the left (the others are mirrored), its explosion, its shield. A row of
# these pictures and of the asteroids' pictures covers two rows of the screen.
SHIP_ROWS = 5
SHIP_LOOKS = ROM.rows(range(0xF74, 0xF74 + 13 * 6, 6), SHIP_ROWS, top_first=True)


class Part:  # of a ship's picture
    LAST_ROWS = 0
    FIRST_ROWS = 1
    BOTH = (0, 1)


def _ship_part(look: np.ndarray, part: int, rows: int) -> np.ndarray:
    number = np.arange(SHIP_ROWS)
    seen = number < rows if part == Part.FIRST_ROWS else number >= SHIP_ROWS - rows
    return np.where(seen, look, 0)


SHIPS = Pictures.of(
    [
        _ship_part(look, part, n)
        for look in SHIP_LOOKS
        for part in Part.BOTH
        for n in range(SHIP_ROWS + 1)
    ],
    look=len(SHIP_LOOKS),
    part=len(Part.BOTH),
    rows=SHIP_ROWS + 1,
)
EXPLOSION = 9
SHIELD = 12

ROCK_COLORS = tuple(ROM.bytes(0xE75, 8).tolist())
SHIP_COLORS = (76, 220)  # first player, second player
SAUCER_COLORS = (156, 236)  # large, small
TEXT = 68
SCORE = NumberDisplay(FONT, right=80, top=5, digits=5)
FIELD = (0, 18, 160, 195)
LIST = 9  # entries per list
ENTRY_NUMBERS = np.arange(2 * LIST)
GOES_UP = ENTRY_NUMBERS < LIST
LAP = 89  # steps of two rows around the screen
PLACE_SIZE = 10  # steps; the least distance of asteroids, so a lap has 9 places
SLOTS = 10  # per list: one more, for the incoming part of an asteroid that leaves
SLOT_GOES_UP = np.arange(2 * SLOTS) < SLOTS
ROCK_TOP = np.where(SLOT_GOES_UP, 24, 25)  # the row of a large asteroid at step 0, by slot
RAISED_ROWS = 2  # rows that smaller asteroids are higher
FIRST_ROWS = np.where(SLOT_GOES_UP, 18, 19)  # first row with asteroids, by slot
BOTTOM = 195  # the row below the last one

NONE = -32  # `rock_y` or `ship_y` of an absent object
NO_SAUCER = 224  # `saucer_y`
NO_SHOT = 128  # least `shot_y` of an absent shot
# An asteroid in one number. `row` is 128 more than the step.
ROCK_WORD = Word(color=3, x=8, row=8, kind=2, there=1)
STEP_0 = 128


class Kind:  # of `Ram.rock_kind`
    LARGE = (0, 1)
    MEDIUM = 2  # the last kind is small


ROCK_WIDTHS = (16, 16, 8, 4)  # by kind
# A game begins with two asteroids in each list. The asteroids of the game before were placed in
# pairs, this many random numbers ago. The lowest three bits of a number select a column's low
# nibble.
NUMBERS_AGO = np.array([9, 8, 7, 6])
FIRST_ENTRIES = np.array([0, 1, LIST, LIST + 1])  # of these asteroids
COARSE_NIBBLES = ROM.bytes(0x1F04, 8).tolist()
SHIP_EXPLODES = 128  # least `timer`
LAST_PUFF = 6  # `bang_step` of a narrow picture in the saucer's explosion
# Speeds that step on all frames, and speeds that step when the clock's low nibble is 3. The others
# step when its high nibble is 7.
ALWAYS = (11, 15)
ON_LOW_NIBBLE = (7, 10, 14)

# Cuts of an asteroid's picture: the rows or columns that are left, in one byte.
CUT_WORD = Word(last=4, first=4)
PER_WORD = 4  # of them in a number

ROCK_PICTURES = ((0xF01, 14), (0xF11, 14), (0xF20, 7), (0xF30, 4))  # offset and rows, by kind
ROCK_ROWS = [rows for _, rows in ROCK_PICTURES]
LEANING = ([1, 2, 3, 4, 5, 7, 9], [8, 9, 10], [], [])  # rows drawn a column to the left
MOST_CUT = 10  # columns or rows that show an asteroid's full extent on the other axis


def _rock_dots(kind: int) -> np.ndarray:
    """Picture of an asteroid, 0 or 1, int32 `[rows, width]`."""
    dots = ROM.rows(*ROCK_PICTURES[kind], top_first=True)[:, None] >> np.arange(7, -1, -1) & 1
    ink = dots.repeat(2 if kind in Kind.LARGE else 1, axis=1)
    leans = np.isin(np.arange(len(ink)), LEANING[kind])[:, None]
    return np.where(leans, np.roll(ink, -1, axis=1), ink)[:, : ROCK_WIDTHS[kind]]


def _cuts(kind: int, side: int) -> list[int]:
    """Extents across an asteroid that is cut to its first 1 to 10 columns or rows at a side.

    Each number has four `CUT_WORD`s, the first one in its lowest byte.
    """
    ink = _rock_dots(kind)
    across = (ink, ink[:, ::-1], ink.T, ink[::-1].T)[side]
    shown = [np.flatnonzero(across[:, : n + 1].any(axis=1)) for n in range(MOST_CUT)]
    extents = [CUT_WORD.pack(last=int(rows[-1]), first=int(rows[0])) for rows in shown]
    unused = [0] * (-MOST_CUT % PER_WORD)
    return np.array(extents + unused, np.uint8).view("<i4").tolist()


# By kind.
LEFT_CUTS = [_cuts(kind, 0) for kind in range(4)]
RIGHT_CUTS = [_cuts(kind, 1) for kind in range(4)]
TOP_CUTS = [_cuts(kind, 2) for kind in range(4)]
BOTTOM_CUTS = [_cuts(kind, 3) for kind in range(4)]


class Ram(RamMap):
    mode = byte(0)
    random = byte((1, 2))  # the last number; a step shifts in the XOR of bits 13 and 14
    rock_y = signed(*range(3, 21))  # in steps of two rows
    rock_x = signed(*range(21, 39))  # in the chip's coding
    rock_color = bits(*range(39, 57), first=0, count=3)
    rock_kind = bits(*range(39, 57), first=4, count=2)
    first_left = flag(39, bit=3)  # the first asteroid goes to the left
    first_speed = bits(39, first=4, count=4)
    odd_frame = flag(57, bit=0)
    frames = byte((58, 57))  # frames of the game; asteroids step on odd ones
    clock = byte(59)  # two nibbles count down, 7 to 1 and 3 to 1
    heading = low(60)
    lives = high(60)
    score = bcd((61, 62))  # tens
    bang_step = byte(70)
    second_player = flag(71, bit=7)
    bang = flag(71, bit=3)  # the saucer explodes
    small = flag(71, bit=5)  # the saucer is the small one
    shield = flag(72, bit=6)
    ship_x = signed(73)  # in the chip's coding
    ship_y = signed(74)  # in steps of two rows
    ship_half = bits(76, first=7)  # half a step of the ship
    saucer_x = signed(81)  # in the chip's coding
    saucer_y = byte(82)  # in steps of two rows
    shot_x = signed(83, 84, 85)  # two of the ship, the saucer's; in the chip's coding
    shot_y = byte(86, 87, 88)  # in steps of two rows
    last = signed(92, 93)  # entries of the lists
    timer = byte(94)
    drawn_y = signed(111)  # of the ship on even frames


def decode(m: Ram) -> dict[str, Box]:
    begins = (m.score == 0) & (m.frames < 2)  # the ship is not on the screen yet
    return {
        "Player": _ship_box(m).clip(*FIELD).where(~begins),
        "Asteroid": _rock_boxes(m, begins & ~m.odd_frame),
        "PlayerMissile": _shot_boxes(m).clip(*FIELD),
        "Saucer": _saucer_box(m).clip(*FIELD),
        "PlayerScore": SCORE.box(10 * m.score),
        "Lives": box(132, 5, 12, 10, value=m.lives),
    }


def _ship_color(m: Ram) -> jax.Array:
    return jnp.where(m.second_player, SHIP_COLORS[1], SHIP_COLORS[0])


def _saucer_color(m: Ram) -> jax.Array:
    return jnp.where(m.small, SAUCER_COLORS[1], SAUCER_COLORS[0])


def _shot_boxes(m: Ram) -> Box:
    x = _in_one_part(_column(m.shot_x) + 1, 1)
    has_saucer_color = np.arange(3) == 1  # the second shot, although it is the ship's
    color = jnp.where(has_saucer_color, _saucer_color(m), _ship_color(m))
    return box(x, 17 + 2 * m.shot_y, 1, 2, _flies(m), color=color)


def _flies(m: Ram) -> jax.Array:
    """True if a shot exists; after a reset, its record is zero until the game begins."""
    return (m.shot_y < NO_SHOT) & ((m.shot_x != 0) | (m.shot_y != 0))


def _column(code: jax.Array) -> jax.Array:
    """Column of a position in the chip's coding."""
    coarse = 15 * (code >> 1 & 7)
    is_odd = (code & 1) == 1
    return wrap(jnp.where(is_odd, coarse - 5, coarse + 82) - (code >> 4))


def _in_one_part(x: jax.Array, width: jax.Array | int) -> jax.Array:
    """Left edge of the larger part of an object that the right edge may cut in two."""
    return jnp.where(x < 0, x + SCREEN_WIDTH, larger_part(x, width))


def _ship_box(m: Ram) -> Box:
    is_mirrored = m.heading >= 8
    explodes = m.timer >= SHIP_EXPLODES
    look = match(
        (explodes, EXPLOSION + jnp.minimum(m.timer >> 1 & 3, 2)),
        (m.shield, SHIELD),
        (is_mirrored, 16 - m.heading),
        otherwise=m.heading,
    )
    turned = is_mirrored & ~explodes & ~m.shield
    part, is_low = _seen_part(m, look)
    left, first_row, width, rows = SHIPS.extent(part, mirrored=turned)
    top = 18 + 2 * (m.ship_y + when(is_low, LAP)) + m.ship_half
    on_screen = (m.ship_y != NONE) & (m.odd_frame | (m.drawn_y != NONE))
    return box(
        _in_one_part(_column(m.ship_x) - 1 + left, width),
        top + 2 * first_row,
        width,
        2 * rows,
        on_screen,
        orientation=(16 - m.heading) & 15,
        color=_ship_color(m),
    )


def _seen_part(m: Ram, look: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The larger part of a ship that the upper edge cuts, and whether it is at the lower edge.

    The last step around the screen has a single line, and none if the ship is half a step lower.
    """
    above = jnp.clip(-m.ship_y, 0, SHIP_ROWS)  # rows of the picture above the edge
    at_top = SHIPS.index(look=look, part=Part.LAST_ROWS, rows=SHIP_ROWS - above)
    rows_below = jnp.clip(-m.ship_y - m.ship_half, 0, SHIP_ROWS)
    at_bottom = SHIPS.index(look=look, part=Part.FIRST_ROWS, rows=rows_below)
    is_low = _size(at_bottom) > _size(at_top)
    return jnp.where(is_low, at_bottom, at_top), is_low


def _size(part: jax.Array) -> jax.Array:
    _, _, width, height = SHIPS.extent(part)
    return width * height


def _saucer_box(m: Ram) -> Box:
    puff = when(m.bang, m.bang_step)
    is_small = (puff == 0) & m.small
    is_last_puff = puff == LAST_PUFF
    inset = match((is_last_puff, 1), (is_small, 0), otherwise=-1)
    width = jnp.where(is_last_puff | is_small, 5, 7)
    height = jnp.where(is_small, 6, 10)
    x = _in_one_part(_column(m.saucer_x) + inset, width)
    y = 20 + 2 * m.saucer_y
    return box(x, y, width, height, m.saucer_y != NO_SAUCER, color=_saucer_color(m))


class Rocks(NamedTuple):
    """The asteroids by slot."""

    x: jax.Array
    y: jax.Array
    kind: jax.Array
    width: jax.Array  # of the complete picture
    color: jax.Array
    there: jax.Array


def _rock_boxes(m: Ram, first_frame: jax.Array) -> Box:
    """All asteroids by slot, then the left parts of asteroids that the right edge cuts."""
    rocks = _rocks_as_drawn(m, first_frame)
    beyond = rocks.x + rocks.width - SCREEN_WIDTH  # columns
    columns = _columns_within(rocks.kind, rocks.y)
    left = rocks.x + columns.first
    width = columns.last - columns.first + 1
    right_part = _cut_box(rocks, left, width, _cut(LEFT_CUTS, rocks.kind, rocks.width - beyond))
    left_part = _cut_box(rocks, left - SCREEN_WIDTH, width, _cut(RIGHT_CUTS, rocks.kind, beyond))
    top = np.tile(FIRST_ROWS, 2)
    return Box.stacked(right_part, left_part).clip(0, top, SCREEN_WIDTH, BOTTOM)


def _cut_box(rocks: Rocks, left: jax.Array, width: jax.Array, rows: SimpleNamespace) -> Box:
    """The boxes of asteroids with the visible rows of their pictures."""
    top = rocks.y + 2 * rows.first
    height = 2 * (rows.last - rows.first + 1)
    return box(left, top, width, height, rocks.there, color=pick(rocks.color, ROCK_COLORS))


def _rocks_as_drawn(m: Ram, first_frame: jax.Array) -> Rocks:
    words = jnp.where(first_frame, _packed_before(m), _packed_rocks(m))
    found = ROCK_WORD.unpack(_by_slot(_slot_of_entry(m), words))
    higher = when(found.kind >= Kind.MEDIUM, RAISED_ROWS)
    y = ROCK_TOP + 2 * (found.row - STEP_0) - higher
    width = pick(found.kind, ROCK_WIDTHS)
    return Rocks(found.x, y, found.kind, width, found.color, found.there == 1)


def _columns_within(kind: jax.Array, y: jax.Array) -> SimpleNamespace:
    """First and last column of the rows between the upper and the lower edge."""
    below_top = pick(kind, ROCK_ROWS) - (FIRST_ROWS - y >> 1)
    above_bottom = BOTTOM - y + 1 >> 1
    lower_part = _packed_cut(BOTTOM_CUTS, kind, below_top)
    upper_part = _packed_cut(TOP_CUTS, kind, above_bottom)
    return CUT_WORD.unpack(jnp.where(y < FIRST_ROWS, lower_part, upper_part))


def _packed_rocks(m: Ram) -> jax.Array:
    """The entries of both lists as `ROCK_WORD`s; 0 for no asteroid."""
    listed = jnp.where(GOES_UP, m.last[0], m.last[1]) >= ENTRY_NUMBERS
    on_screen = (m.rock_y != NONE) & listed
    smaller_left = when(m.rock_kind >= Kind.MEDIUM, 1)
    left = _column(m.rock_x) - smaller_left - _stepped_aside(m)
    x = jnp.where(left < 0, left + SCREEN_WIDTH, left)
    row = m.rock_y + STEP_0
    words = ROCK_WORD.pack(color=m.rock_color, x=x, row=row, kind=m.rock_kind, there=1)
    return when(on_screen, words)


def _packed_before(m: Ram) -> jax.Array:
    """The same for the previous game, which had large asteroids only, after one step."""
    shifted_out = m.random >> 1 ^ m.random >> 15
    numbers = m.random | shifted_out << 16
    for_x = numbers >> NUMBERS_AGO
    for_y = numbers >> NUMBERS_AGO - 1
    nibble = for_x >> 4 & 15
    fine = signed_nibble(jnp.where(nibble == 7, 8, nibble))
    x = _column(fine << 4 | pick(for_x & 7, COARSE_NIBBLES))
    one_step = np.where(GOES_UP, 1, -1)[FIRST_ENTRIES]
    now = jnp.stack([m.rock_y[entry] for entry in FIRST_ENTRIES.tolist()])
    row = now - one_step + STEP_0
    words = ROCK_WORD.pack(color=for_y & 7, x=x, row=row, kind=for_y >> 4 & 1, there=1)
    places = [(entry == ENTRY_NUMBERS, words[i]) for i, entry in enumerate(FIRST_ENTRIES.tolist())]
    return match(*places, otherwise=0)


def _slot_of_entry(m: Ram) -> jax.Array:
    """Slot of each entry in its list: the order of arrival, modulo the number of slots."""
    steps_so_far = m.frames + 1 >> 1  # of all asteroids
    came_in = jnp.where(GOES_UP, m.rock_y, -m.rock_y) + LAP
    way = steps_so_far + came_in
    laps = div(way, LAP)
    place = div(way - LAP * laps, PLACE_SIZE)
    # A lap has one place fewer than slots. The added laps keep the number positive.
    return mod(place + SLOTS * LAP - laps, SLOTS)


def _by_slot(slot: jax.Array, words: jax.Array) -> jax.Array:
    """The words of both lists in the order of slots; 0 for an empty slot."""
    lists = []  # in a loop: a maximum along an axis of entries takes six times as long
    for first in (0, LIST):
        entries = range(first, first + LIST)
        found = (when(slot[i] == np.arange(SLOTS), words[i]) for i in entries)
        lists.append(functools.reduce(jnp.maximum, found))
    return jnp.concatenate(lists)


def _cut(table: list[list[int]], kind: jax.Array, columns: jax.Array) -> SimpleNamespace:
    """First and last row or column of asteroids that an edge cuts to some columns or rows."""
    return CUT_WORD.unpack(_packed_cut(table, kind, columns))


def _packed_cut(table: list[list[int]], kind: jax.Array, columns: jax.Array) -> jax.Array:
    """The same as a `CUT_WORD`, with further words above it."""
    # Selects: a gather takes five times as long here.
    words = [pick(kind, by_kind) for by_kind in zip(*table, strict=True)]
    index = jnp.clip(columns, 1, MOST_CUT) - 1
    four = match((index < PER_WORD, words[0]), (index < 2 * PER_WORD, words[1]), otherwise=words[2])
    return four >> 8 * (index & PER_WORD - 1)


def _stepped_aside(m: Ram) -> jax.Array:
    """The step to the right that the first asteroid makes after the drawing."""
    speed = jnp.where((m.mode & 1) == 1, m.first_speed, m.first_speed & 7)
    on_low = (m.clock & 15) == 3
    on_high = (m.clock >> 4) == 7
    is_due = jnp.where(among(speed, ON_LOW_NIBBLE), on_low, on_high)
    stepped = m.odd_frame & (among(speed, ALWAYS) | is_due)
    return when(stepped & (ENTRY_NUMBERS == 0), jnp.where(m.first_left, -1, 1))


# The upper two quarters of the field, then the lower two, each from the left.
QUARTERS = ((0, 18, 80, 106), (80, 18, 160, 106), (0, 106, 80, 195), (80, 106, 160, 195))
IS_UPPER = np.array((True, True, False, False))[:, None]
IS_LEFT = np.array((True, False, True, False))[:, None]
FAR = 32  # least columns or rows of parts at opposite edges; the ship and its debris have fewer
LEAST_WIDTH = 3
LEAST_HEIGHT = 2


class WithoutSmallerPart(Step):
    """Join the ship's boxes in the quarters, without the smaller part of a ship that is cut."""

    keeps_slots = False

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        upper = _joined(found, found.valid & IS_UPPER)
        lower = _joined(found, found.valid & ~IS_UPPER)
        is_apart = _joined(found, found.valid).h >= FAR
        is_low = lower.w * lower.h > upper.w * upper.h
        kept = found.valid & (~is_apart | (is_low != IS_UPPER))
        left = _joined(found, kept & IS_LEFT)
        right = _joined(found, kept & ~IS_LEFT)
        is_aside = _joined(found, kept).w >= FAR
        one = _joined(found, kept & (~is_aside | ((left.w > right.w) == IS_LEFT)))
        return one.where((one.w >= LEAST_WIDTH) & (one.h >= LEAST_HEIGHT))


def _joined(found: Detected, chosen: jax.Array) -> Detected:
    """The box around the chosen ones."""
    x = jnp.min(jnp.where(chosen, found.x, 255), axis=0, keepdims=True)
    y = jnp.min(jnp.where(chosen, found.y, 255), axis=0, keepdims=True)
    right = jnp.max(when(chosen, found.x + found.w), axis=0, keepdims=True)
    end = jnp.max(when(chosen, found.y + found.h), axis=0, keepdims=True)
    return Detected(boxes(x, y, right - x, end - y, right > 0))


SHIP_RULE = Bounds(SHIP_COLORS, QUARTERS, exclude=("PlayerMissile",), then=(WithoutSmallerPart(),))
ROCK_MASKS = tuple(picture(_rock_dots(kind).repeat(2, axis=0)) for kind in range(4))
ROCK_SHAPES = (
    Shape(w=(2, 16), h=(1, 28)),
    Shape(w=(2, 32), h=(1, 56), split=(16, 28)),  # two that touch
    Shape(w=1, h=(4, 28)),  # the last column at an edge
)


def _by_color(rule: Blobs) -> Blobs:
    """Search each colour separately, so that touching objects of other colours stay apart."""
    rules = tuple(replace(rule, colors=color) for color in rule.palette)
    return replace(rules[0], also=rules[1:])


ROCK_RULE = _by_color(Blobs(ROCK_COLORS, FIELD, ROCK_SHAPES, pictures=ROCK_MASKS))
# One of the ship's two shots has the saucer's colour, so VEM can separate it from the ship. Saucers
# have one colour at a time.
SHOT = Blobs(SHIP_COLORS[0], FIELD, Shape(w=1, h=(1, 2)), gap=(3, 4))
SHOTS = replace(SHOT, also=(replace(SHOT, colors=SAUCER_COLORS),))
SAUCERS = Blobs(SAUCER_COLORS, FIELD, Shape(w=(5, 7), h=(6, 10)))
LIVES = Bounds(TEXT, (116, 5, 144, 15), value=Digits(FONT, (132,), 5))

MOVES = ("hyperspace", "shields", "turning about", "no special move")  # of the joystick down
EXTRA_LIVES = ("every 5,000 points", "every 10,000 points", "every 20,000 points", "never")
SPEEDS = ("slow asteroids", "slow and fast asteroids")
MODES = {
    mode: f"{MOVES[mode // 8]}, {SPEEDS[mode % 2]}, extra lives {EXTRA_LIVES[mode // 2 % 4]}"
    for mode in range(32)
} | {128: "the children's game: hyperspace, extra lives every 5,000 points"}

GAME = Game(
    name="Asteroids",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # After a reset, frames are older than the RAM; VEM counts some touching asteroids as one.
        agreement={"modes": 0.95},
        rare=("Player",),  # at an edge
    ),
    variants=Variants(
        modes=MODES,
        difficulties={0: "no saucers", 3: "saucers"},
        source="the program in the ROM, and play of all modes in the emulator",
    ),
    categories=(
        Category("Player", SHIP_RULE, attributes=("orientation",), role="player", doc="the ship"),
        Category("Asteroid", ROCK_RULE, count=4 * SLOTS, doc="up, down; left parts at the edge"),
        Category("PlayerMissile", SHOTS, count=3, doc="the ship's shots, the saucer's"),
        Category("Saucer", SAUCERS, doc="at difficulty A"),
        display("PlayerScore", SCORE.rule(TEXT), role="score", doc="points, below 100,000"),
        display("Lives", LIVES, role="lives", doc="ships left"),
    ),
)
