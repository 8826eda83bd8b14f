"""Skiing: a skier, and gates of two flags, moguls and trees that scroll up.

Screen: the gates to go and the clock are above the hill. The upper number is two objects, Gates and
Score (OCAtari's name). The `value` of Gates is the number itself. The `value` of Score is the sum
of the emulator's rewards: minus the hundredths of a second so far (the emulator ends a run with
five seconds for every missed gate, as the game's clock does). The `value` of Clock is the displayed
time in hundredths; Score is a step ahead, as the reward is. The black frame and the maker's name
are scenery.

Slots: the game's eight records: two gates (Flag: the left and the right flag of each), two moguls,
four trees. After the last gate one gate's record is a mogul (the third slot). In downhill games the
gates' records are trees (the last two slots). The `orientation` of the player is the direction of
the skis, compass point 12 (west) over 8 (straight down) to 4 (east), from the game's 16 headings.

RAM: ALE's source, OCAtari 2.2, AtariARI, and the game's display program. The records rotate: with
every shift the list in RAM moves up by one, and byte 16 counts the shifts. The RAM already has the
latest step of scroll and clock, which the frame does not show; bytes 115 and 116 are that step. A
crash shows one frame late. Boxes are tight around the parts inside the borders: a tree that is cut
by the left border or the playfield's top is as narrow as its remaining rows.

Covered: the slalom that ALE starts (the only mode), downhill by editing RAM, crashes, both borders,
the end of the run.

Not exact: the RAM does not record the direction of the latest turn, so the skier's picture is one
frame early when it changes.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Font,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    lookup,
    pick,
    signed,
    when,
    wrap,
)

ROM = Rom("skiing", "b76fbadc8ffb1f83e2ca08b6fb4d6c9f")
DIGIT_ROWS = ROM.bytes(0x700, 7 * 16).reshape(7, 16)[::-1, :10]  # of all digits, the top ones first
DIGIT_FONT = Font(tuple(map(tuple, DIGIT_ROWS.T.tolist())), dots=6)
GATES = NumberDisplay(DIGIT_FONT, right=81, top=6, digits=2)


class Thing:  # object of a record
    GATE = 0
    MOGUL = 1
    TREE = 2


EVENT = 224  # `event` on the frame of a crash or of a passed gate
LAST_GATE = 4  # kind of a record


class State:  # of `Ram.state`
    SKIING = 0
    ENDED = 255


FRAME_TIME = 170  # of a frame's 1 2/3 hundredths: the fraction, in 1/256
MIRRORED = 4  # least kind of a record with x counted from the right border
NO_OBJECT = 32  # least `last_row` without an object
WIDE_TREE = 16  # rows at the foot of a tree, twice as wide as the rows above
STRAIGHT = 7  # slope: straight down
DOWN = 3  # pose of a skier straight down; smaller poses are for lesser slopes
LYING = 4  # pose

FIELD = (8, 32, 152, 178)
PINK = 72
BLUE = 134
RED = 68
BLACK = 0
GRAYS = (10, 12)
GREENS = (198, 212, 214, 218)

# By slot of Flag, Mogul and Tree: the object, its record, the distance from its x, and its colour
# unless it belongs to the last gate.
THINGS = np.repeat([Thing.GATE, Thing.MOGUL, Thing.TREE], [4, 3, 6])
SLOT_RECORDS = (0, 0, 4, 4, *(1, 5, 0), *(2, 3, 6, 7, 0, 4))
SHIFTS = np.array((1, 33, 1, 33, *[2] * 9))
COLORS = (*[BLUE] * 4, *(12, 10, 10), *(214, 212, 218, 198, 198, 198))


def _dots(offset: int, rows: int, zoom: int) -> np.ndarray:
    """A picture in pixels, bool `[rows, 8 * zoom]`."""
    return np.unpackbits(ROM.rows(offset, rows).astype(np.uint8)[:, None], axis=1).repeat(zoom, 1)


def _cuts(ink: np.ndarray) -> np.ndarray:
    """The visible rest of a cut picture, by rows cut (above < 0 < below) and columns cut.

    Args:
        ink: its pixels, `[height, width]`.

    Returns:
        Left, top, width and height of the rest, five bits each, `[2 * height + 1, 2 * width + 1]`.
    """
    height, width = ink.shape
    rows = range(-height, height + 1)
    columns = range(-width, width + 1)
    return np.array([[_cut(ink, up, aside) for aside in columns] for up in rows], np.int32)


def _cut(ink: np.ndarray, up: int, aside: int) -> int:
    """The rest of a picture after one cut, packed as in the table."""
    y = max(-up, 0)
    x = max(-aside, 0)
    height, width = ink.shape
    ys, xs = np.nonzero(ink[y : height - up, x : width - aside])
    if not len(ys):
        return 0
    left = x + xs.min()
    top = y + ys.min()
    return left | top << 5 | (np.ptp(xs) + 1) << 10 | (np.ptp(ys) + 1) << 15


# Pictures of a flag, a mogul and a tree; the tree's lower part has dots of double width.
TREE_TOP = np.pad(_dots(0x78F, 14, 1), ((0, 0), (4, 4)))
PICTURES = (
    _dots(0x770, 14, 1),
    _dots(0x79E, 6, 2),
    np.concatenate([TREE_TOP, _dots(0x77F, WIDE_TREE, 2)]),
)
TABLES = [_cuts(picture) for picture in PICTURES]
HEIGHTS = np.array([len(picture) for picture in PICTURES])[THINGS]
WIDTHS = np.array([picture.shape[1] for picture in PICTURES])[THINGS]
CUT_TABLE = np.concatenate([table.ravel() for table in TABLES])
MIDDLES = [table.size // 2 for table in TABLES]  # of the tables: nothing is cut
BEGINS = np.cumsum([0, *(table.size for table in TABLES[:-1])])  # of the tables in `CUT_TABLE`
UNCUT = (BEGINS + MIDDLES)[THINGS]  # index in `CUT_TABLE`


class Ram(RamMap):
    speed = byte(14)
    heading = bits(15, count=4)  # 0: west ... 15: east
    crashed = bits(15, first=6)
    turn = byte(16)  # the record at the end of the list, modulo 8
    state = byte(17)
    x = byte(25)  # x - 1; already moved
    y = byte(26)  # 120; 124 in a jump
    fraction = byte(29)  # of the clock's hundredths, in 1/256
    last_row = byte(*range(54, 62))  # of the visible picture; 255: none
    object_x = byte(*range(62, 70))
    kind = byte(*range(78, 86))
    object_y = byte(*range(86, 94))  # row above the playfield's end
    scroll_x = byte(95)  # columns that the skier could not move at a border
    event = byte(97)
    patience = byte(98)  # frames until the next turn
    step = signed(115, 116)  # latest movement: skier or hill, right; hill, up
    time = bcd((104, 105, 106))  # minutes, seconds, hundredths
    gates = bcd(107)  # to go


def decode(m: Ram) -> dict[str, Box]:
    objects = _object_boxes(m)
    hundredths = m.time - 4000 * div(m.time, 10000)
    gates_left = _shown_gates(m)
    return {
        "Player": _player(m),
        "Flag": objects[:4],
        "Mogul": objects[4:7],
        "Tree": objects[7:],
        "Score": GATES.box(gates_left, value=-hundredths),
        "Gates": GATES.box(gates_left),
        "Clock": box(59, 16, 38, 7, value=_shown_time(m, hundredths)),
    }


def _shown_gates(m: Ram) -> jax.Array:
    """The gates to go; a gate that was just passed still counts."""
    just_passed = (m.event == EVENT) & (m.crashed == 0)
    return m.gates + when(just_passed, 1)


def _shown_time(m: Ram, hundredths: jax.Array) -> jax.Array:
    """The clock before the time added since the frame was drawn."""
    latest = jnp.where(m.fraction < FRAME_TIME, 2, 1)
    runs = m.state == State.SKIING
    return jnp.where(runs, jnp.maximum(hundredths - latest, 0), hundredths)


def _last_step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns right of the skier, and rows up of the hill, since the frame was drawn."""
    runs = m.state == State.SKIING
    # A skier who would leave the hill with the next step stands still.
    ahead = m.x + m.step[0]
    moved = runs & (m.scroll_x == 0) & (ahead >= 8) & (ahead < 144)
    return when(moved, m.step[0]), when(runs, m.step[1])


def _player(m: Ram) -> Box:
    pose = _shown_pose(m)
    width = pick(pose, (8, 8, 7, 7, 8))
    is_mirrored = m.heading <= STRAIGHT
    start = jnp.where((pose == DOWN) ^ (is_mirrored & (width == 7)), 1, 0)
    x = m.x - _last_step(m)[0] + 1 + start
    y = 159 - m.y + pick(pose, (0, 1, 1, 2, 5))
    compass = 12 - ((m.heading + 1) >> 1)
    height = pick(pose, (16, 15, 18, 18, 15))
    return box(x, y, width, height, orientation=compass)


def _shown_pose(m: Ram) -> jax.Array:
    slope = jnp.minimum(m.heading, 15 - m.heading)
    fell = m.crashed == 1
    # The crash shows once more after the skier has risen.
    rose = ~fell & (m.speed == 1) & (slope > 0) & (m.patience != slope + 1)
    lies = (fell & (m.event != EVENT)) | rose
    return jnp.where(lies, LYING, slope >> 1)


def _records_in_order(m: Ram) -> jax.Array:
    """The eight records in their original order, a byte each of last row, x, y and kind.

    Record k is at (turn + 7 - k) modulo 8 of the list.
    """
    # The run ended before the list moved.
    turn = jnp.where(m.state == State.ENDED, m.turn + 1, m.turn)
    records = (m.last_row | m.object_x << 8 | m.object_y << 16 | m.kind << 24)[::-1]

    def rolled(listed: jax.Array, shift: int) -> jax.Array:
        return jnp.where((turn & shift) != 0, jnp.roll(listed, shift), listed)

    return functools.reduce(rolled, (1, 2, 4), records)


def _object_boxes(m: Ram) -> Box:
    """Tight boxes of the visible parts of four flags, three moguls and six trees."""
    records = _records_in_order(m)
    record = jnp.stack([records[k] for k in SLOT_RECORDS])
    last_row = record & 255
    record_y = record >> 16 & 255
    kind = record >> 24 & 7
    shows = jnp.where((kind & 2) == 2, Thing.TREE, kind & 1)
    is_mirrored = kind >= MIRRORED
    left, above, right, below = FIELD  # left and right are at the same distance from the middle
    place = _object_x(record >> 8 & 255, last_row)
    whole_x = jnp.where(is_mirrored, 160 - WIDTHS - place, place)
    end = 180 + last_row - record_y + _last_step(m)[1]
    y = end - HEIGHTS
    rows_beyond = jnp.minimum(y - above, 0) + jnp.maximum(end - below, 0)
    columns_beyond = jnp.minimum(whole_x - left, 0) + jnp.maximum(whole_x + WIDTHS - right, 0)
    rows = jnp.clip(rows_beyond, -HEIGHTS, HEIGHTS)
    columns = jnp.clip(columns_beyond, -WIDTHS, WIDTHS)
    rest = lookup(CUT_TABLE, rows * (2 * WIDTHS + 1) + columns + UNCUT)
    width = rest >> 10 & 31
    cut_x = whole_x + (rest & 31)
    x = jnp.where(is_mirrored, 160 - width - cut_x, cut_x)
    exists = (last_row < NO_OBJECT) & (shows == THINGS)
    color = jnp.where(kind == LAST_GATE, RED, np.array(COLORS))
    return box(x, y + (rest >> 5 & 31), width, rest >> 15, exists, color=color)


def _object_x(x: jax.Array, last_row: jax.Array) -> jax.Array:
    """Left edges of the slots' pictures, counted from the same border as x."""
    # Without its narrow part a tree is five columns to the left.
    wrapped = wrap(x + jnp.where((THINGS == Thing.TREE) & (last_row >= WIDE_TREE), -3, SHIFTS))
    # An object that begins in the right border may be visible at the left one.
    return jnp.where(wrapped >= FIELD[2], wrapped - 160, wrapped)


FLAG = Blobs((BLUE, RED), FIELD, Shape(w=(1, 5), h=(1, 14)), gap=(4, 8))
BUMP = Blobs(GRAYS, FIELD, Shape(w=(1, 16), h=(1, 6)), gap=(8, 4))
TREES = Blobs(GREENS, FIELD, Shape(w=(1, 16), h=(1, 30)), gap=(8, 4))
UNITS = (6000, 1000, 100, 10, 1)  # hundredths of a 1 in each of the clock's digits
read_clock = functools.partial(Digits, DIGIT_FONT, (59, 68, 75, 84, 91), 16)
UPPER = (20, 4, 140, 14)  # around the gates to go
REWARDS = Bounds(BLACK, UPPER, value=read_clock(weights=tuple(-unit for unit in UNITS)))
CLOCK = Bounds(BLACK, (20, 14, 140, 26), value=read_clock(weights=UNITS))

GAME = Game(
    name="Skiing",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        value_error={"Score": 2},  # hundredths of a second: a frame
    ),
    categories=(
        Category(
            "Player",
            Bounds(PINK, FIELD),
            attributes=("orientation",),
            role="player",
            doc="12 west, 8 down, 4 east",
        ),
        Category("Flag", FLAG, count=4, doc="left and right one of two gates"),
        Category("Mogul", BUMP, count=3, doc="bump in the snow"),
        Category("Tree", TREES, count=6, doc="two more in downhill games"),
        display(
            "Score",
            REWARDS,
            role="score",
            doc="gates to go; value: the rewards, minus the hundredths",
        ),
        display("Gates", GATES.rule(BLACK, UPPER), doc="gates to go"),
        display("Clock", CLOCK, role="time", doc="hundredths of a second"),
    ),
)
