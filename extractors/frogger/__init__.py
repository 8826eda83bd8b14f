"""Frogger: a frog crosses a road and a river, and jumps into one of five bays.

Picture: docs/games/Frogger.png

Screen: green strips of eight columns at both edges hide cars and swimmers under them. The marks at
the left edge are scenery. On odd frames, the frog's lane shows only the frog. The same holds for a
lane with the lady frog, and for a lane with a snake on a log. Bays show a guest on odd frames and
frogs on even ones.

Slots: a lane has two sprites of one to three copies. Car has lane * 6 + sprite * 3 + copy for the
four lanes of cars, lowest lane first, then the two trucks. Turtle has the lower lane's six, then
the upper lane's four. Log has three short logs, the long one, the last lane's two, then the pieces
of the last three at the left edge while the rest is at the right one. Alligator has the alligator
and its piece at the left edge. Snake has the snake between road and river, then the snake on a log.

RAM: ALE's source (score, lives), OCAtari 2.2 (frog, cars), and the ROM's code. Lanes, turtles and
the frog move after the frame is drawn. `decode` reads positions from the codes for the video chip:
two lanes of cars restart when a frog comes home, but their codes change only with the next step. A
turtle that has dived is not valid, because the frog cannot sit on it.

Covered: ten levels, with alligators, snakes, the lady frog and the guests of bays (from edited
RAM); all modes and difficulties, lost lives, the end of the game.

Not exact: on the frame on which the frog jumps, the RAM already has its new picture. When it comes
home, the RAM has lost the fly that it took, and the positions of the two restarted lanes if they
also took a step.

Terrain: banks, bays, water, verges, road and the strips at the edges, the same in all levels. Logs
and turtles are objects on the water.

VEM: it reads the old score on the frame on which the frog jumps forward. The frog hides a part of
the snake on the verge.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    EDGE_CUTS,
    NORTH,
    NUSIZ_COPIES,
    NUSIZ_SPACING,
    SOUTH,
    WEST,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    IconRow,
    Number,
    NumberDisplay,
    Pictures,
    Shape,
    Variants,
    among,
    areas,
    box,
    display,
    lookup,
    match,
    over,
    pick,
    shift_down,
    shift_up,
    when,
    wrap,
)
from ocjax.extractors.frogger.drawn import Drawn, as_drawn, column
from ocjax.extractors.frogger.ram import ROM, FrogColor, Guest, Lane, Picture, Ram, River, Verge
from ocjax.extractors.frogger.terrain import TERRAIN

FONT = ROM.font(0xF01, rows=7, stride=8, top_first=True)
SCORE = NumberDisplay(FONT, right=72, top=1, digits=4)
LIVES = IconRow(left=18, top=183, width=2, height=4, pitch=4)

VIEW = (8, 31, 152, 182)
ROWS = 7  # of a picture
VERGE_TOP = 95
START_TOP = 171
BAY_LEFTS = 12 + 32 * np.arange(5)  # columns of the objects in the bays
BAY_TOP = 14
HURRY = 6  # greatest time in units at which the bar is red

BLACK = 0
WHITE = 14  # trucks, the lady frog, lives
WOOD = 18
PINK = 22
RED = 34
YELLOW = 40
WATER = 144
DIVING = 150
GREEN = 212
LIGHT_GREEN = 214
CAR_COLORS = np.array((40, 104, 212, 88, WHITE))  # lowest lane first
LOWER_STAGES = (RED, DIVING, WATER, DIVING)  # colours of diving turtles
UPPER_STAGES = (DIVING, WATER, DIVING, RED)

# Lanes with varying copies, by low byte of a table's address. Five bits per lane: copies less 1,
# and the distance between copies in units of 16 columns.
NUSIZ = ROM.data[0xE00 + np.arange(256)[:, None] + (0, 1, 2, 3, Lane.SHORT_LOGS)] & 7
PACKED = np.array(NUSIZ_COPIES)[NUSIZ] - 1 | np.array(NUSIZ_SPACING)[NUSIZ] // 16 << 2
LAYOUTS = (PACKED << 5 * np.arange(5)).sum(1)

# Looks of figures; an edge of the screen may cut each of them.
SNAKE = 0
FROG = 4
GATOR = 9  # with open mouth, then closed
SNAKE_HEADINGS = (EAST, WEST, EAST, WEST)
FROG_HEADINGS = (NORTH, SOUTH, EAST, WEST, NORTH)  # the last one is dead
LOOKS = (*Picture.SNAKES, *Picture.FROGS, 0xA3, 0xAA)  # low bytes of addresses of pictures
FIGURES = Pictures.of(
    [ROM.rows(0xF01 + low, ROWS) & cut for low in LOOKS for cut in EDGE_CUTS],
    look=len(LOOKS),
    cut=len(EDGE_CUTS),
)

CAR_LANE = np.repeat(np.arange(5), (6, 6, 6, 6, 2))
CAR_COPY = np.tile(np.arange(3), 8)
CAR_DOT = np.where(CAR_LANE == Lane.TRUCKS, 2, 1)  # columns per dot
CAR_ROWS = ROM.rows((0xFC7, 0xFD5, 0xFCE, 0xFC0, 0xFDC), ROWS)[CAR_LANE]
CAR_FRONT = (CAR_ROWS >> 7).argmax(1)  # first row of the leftmost column of dots
CAR_REAR = (CAR_ROWS & 1).argmax(1)
TURTLE_COPY = np.array((0, 1, 2, 0, 1, 2, 0, 1, 0, 1))
TURTLE_LANE = np.repeat((Lane.LOWER_TURTLES, Lane.UPPER_TURTLES), (6, 4))
TURTLE_DIVES = np.array((0, 0, 0, 1, 1, 1, 0, 0, 1, 1)) == 1
LOG_LANE = np.array((7, 7, 7, 8, 10, 10, 8, 10, 10))
LOG_WIDTH = np.array((16, 16, 16, 64, 32, 32, 64, 32, 32))


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    alligators = m.river != River.LOGS
    head = jnp.where(m.guest < Guest.HEAD, 3, 8)  # columns
    return {
        "Frog": _frog_box(m, d),
        "Car": _car_boxes(m, d),
        "Log": _log_boxes(m, d, alligators),
        "Turtle": _turtle_boxes(d),
        "Alligator": _alligator_boxes(m, d).where(alligators),
        "AlligatorHead": _guest_box(m, head, 10).where(m.guest >= Guest.RISING_HEAD),
        "Fly": _guest_box(m, 8, 11).where(m.guest == Guest.FLY),
        "HappyFrog": box(BAY_LEFTS, BAY_TOP, 8, 11, (d.homes >> np.arange(5) & 1) == 1),
        "LadyFrog": _lady_box(m),
        "Snake": _snake_boxes(m, d),
        "Score": SCORE.box(m.score),
        "Lives": LIVES.box(m.lives, m.lives <= 4, value=m.lives),
        "Time": _time_box(m),
    }


def _copies(x: jax.Array, kind: jax.Array, copy: np.ndarray) -> tuple[jax.Array, jax.Array]:
    """Columns of sprites' copies, -8 to 151, and True for existing copies."""
    return wrap(x + 8 + 16 * (kind >> 2 & 7) * copy) - 8, (kind & 3) >= copy


def _lane_top(lane: Number) -> Number:
    """The first row of a lane."""
    return 161 - 13 * lane


def _figure_boxes(look: Number, x: jax.Array, y: Number, zoom: int = 1, **fields: Number) -> Box:
    """The parts of figures on the screen; wide figures begin a column further right."""
    begin = x + min(zoom - 1, 1)
    right = jnp.clip(begin + 8 * zoom - VIEW[2], 0, 8 * zoom) >> zoom // 2
    left = jnp.clip(VIEW[0] - begin, 0, 8 * zoom) >> zoom // 2
    index = FIGURES.index(look=look, cut=8 + right - left)
    return FIGURES.box(index, begin, y, zoom=zoom, **fields).clip(*VIEW)


def _frog_box(m: Ram, d: Drawn) -> Box:
    heading = _place(d.frog_picture, Picture.FROGS)
    y = match(
        (d.lane == Lane.START, START_TOP),
        (d.lane == Lane.VERGE, VERGE_TOP),
        otherwise=_lane_top(d.lane),
    )
    return _figure_boxes(
        FROG + heading,
        column(m.frog_at),
        y,
        valid=among(d.lane, range(Lane.START, Lane.LAST + 1)),
        orientation=pick(heading, FROG_HEADINGS),
        color=jnp.where(m.frog_color == FrogColor.WITH_LADY, PINK, LIGHT_GREEN),
    )


def _lady_box(m: Ram) -> Box:
    y = _lane_top(Lane.SHORT_LOGS)
    return _figure_boxes(FROG, column(m.lady_at), y, valid=m.lady_lane == Lane.SHORT_LOGS)


def _place(picture: jax.Array, pictures: tuple[int, ...]) -> jax.Array:
    """The index of a picture in `pictures`; 0 for other pictures."""
    return match(*((picture == low, i) for i, low in enumerate(pictures)), otherwise=0)


def _car_boxes(m: Ram, d: Drawn) -> Box:
    """The copies of both sprites of each lane, at most three, then the trucks."""
    kind = lookup(LAYOUTS, m.layout) >> 5 * CAR_LANE[:24]
    cars, there = _copies(jnp.repeat(d.car_x, 3), kind, CAR_COPY)
    x = jnp.concatenate([cars, d.truck_x + 1])
    valid = jnp.concatenate([there, jnp.array([True, True])])
    y = _lane_top(CAR_LANE)
    color = CAR_COLORS[CAR_LANE]
    cut = box(x, y, 8 * CAR_DOT, ROWS, valid, color=color).clip(*VIEW)
    inset = when(cut.w <= CAR_DOT, jnp.where(cut.x == VIEW[0], CAR_REAR, CAR_FRONT))
    return cut.trimmed(top=inset, bottom=inset)


def _log_boxes(m: Ram, d: Drawn, alligators: jax.Array) -> Box:
    """Short logs, wide logs, and the wide ones' pieces at the left edge."""
    kind = lookup(LAYOUTS, m.layout) >> 5 * 4
    short, there = _copies(d.log_x[0], kind, np.arange(3))
    wide = d.log_x[1:] + 1
    x = jnp.concatenate([short, wide, wide - 160])
    floats = jnp.stack([jnp.array(True), ~alligators, jnp.array(True)])
    valid = jnp.concatenate([there, floats, floats])
    return box(x, _lane_top(LOG_LANE), LOG_WIDTH, ROWS, valid).clip(*VIEW)


def _turtle_boxes(d: Drawn) -> Box:
    """Two groups per lane; the second group dives."""
    first = jnp.concatenate([jnp.repeat(d.turtle_x[:2], 3), jnp.repeat(d.turtle_x[2:], 2)])
    x = wrap(first + 8 + 16 * TURTLE_COPY) - 8
    is_lower = TURTLE_LANE == Lane.LOWER_TURTLES
    stage = jnp.where(is_lower, pick(d.dive, LOWER_STAGES), pick(d.dive, UPPER_STAGES))
    color = jnp.where(TURTLE_DIVES, stage, RED)
    cut = box(x, _lane_top(TURTLE_LANE), 8, ROWS, color != WATER, color=color).clip(*VIEW)
    inset = jnp.maximum(3 - cut.w, 0)  # of the two columns at each side
    return cut.trimmed(top=inset, bottom=inset)


def _alligator_boxes(m: Ram, d: Drawn) -> Box:
    """The alligator, and its piece at the left edge."""
    look = jnp.where(m.river == River.MOUTH_OPEN, GATOR, GATOR + 1)
    return _figure_boxes(look, d.log_x[2] - np.array((0, 160)), _lane_top(Lane.LAST), zoom=4)


def _guest_box(m: Ram, width: Number, height: int) -> Box:
    """The guest of a bay."""
    return box(BAY_LEFTS[0] + 32 * (m.guest_bay - 1), BAY_TOP, width, height, m.guest_bay > 0)


def _snake_boxes(m: Ram, d: Drawn) -> Box:
    """The snake on the verge, and the snake on the log."""
    on_verge = jnp.where(m.verge == Verge.SNAKE, 0, 2)
    look = jnp.stack([on_verge, _place(m.log_snake_picture, Picture.SNAKES)])
    x = jnp.stack([d.verge_snake_x, column(m.log_snake_at)])
    there = among(m.verge, (Verge.SNAKE, Verge.SNAKE_RISES)), m.log_snake_lane == Lane.LONG_LOG
    y = np.array((VERGE_TOP, _lane_top(Lane.LONG_LOG)))
    heading = pick(look, SNAKE_HEADINGS)
    return _figure_boxes(SNAKE + look, x, y, zoom=2, valid=jnp.stack(there), orientation=heading)


def _time_box(m: Ram) -> Box:
    """The bar: a column per unit."""
    color = jnp.where(m.time > HURRY, BLACK, RED)
    return box(VIEW[2] - m.time, 183, m.time, 4, m.time < 128, value=m.time, color=color)


def _log_columns(mask: Bitmap) -> Bitmap:
    """The columns of the last lane with enough rows of wood for a log, as one row."""
    row = [mask[:, y : y + 1] for y in range(VIEW[1], VIEW[1] + ROWS)]
    return row[0] & row[2] & (row[6] | (row[1] & row[5]))


def _without_alligator(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The pixels of logs."""
    lane = jnp.asarray(areas(mask.shape[1], [LAST_LANE]))
    return mask & (_log_columns(mask) | ~lane)


def _without_logs(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The pixels of the alligator and between its jaws."""
    own = mask & ~_log_columns(mask)
    return over(own, 5, shift_down, jnp.bitwise_or) & over(own, 5, shift_up, jnp.bitwise_or)


LAST_LANE = (8, 31, 152, 38)
LOG_LANES = (8, 31, 152, 77)
TURTLE_SHAPE = Shape(w=(1, 8), h=(1, 7))
CAR_SHAPE = Shape(w=(1, 16), h=(1, 7))
GATOR_SHAPE = Shape(w=(1, 32), h=(1, 7))
LOG_SHAPE = Shape(w=(1, 64), h=(1, 7))
BAYS = (8, 13, 152, 25)
EACH_BAY = tuple((x, 13, x + 16, 25) for x in range(8, 152, 32))
STATUS_LEFT = (8, 183, 64, 187)
STATUS_RIGHT = (64, 183, 152, 187)

facing = functools.partial(Category, attributes=("orientation",))
GAME = Game(
    name="Frogger",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Alligator", "AlligatorHead", "Fly", "HappyFrog", "LadyFrog", "Snake"),
    ),
    variants=Variants(
        modes={
            0: "starts at the first stage",
            1: "starts at a later stage, with faster cars and an alligator",
            2: "as 0, and a held joystick repeats the hop",
        },
        source="ALE's source code, and play of all modes in the emulator",
    ),
    terrain=TERRAIN,
    categories=(
        facing(
            "Frog",
            Bounds((LIGHT_GREEN, PINK), VIEW),
            role="player",
            doc="pink while the lady frog is on it",
        ),
        Category(
            "Car",
            Blobs(tuple(CAR_COLORS.tolist()), (8, 109, 152, 168), CAR_SHAPE, gap=(0, 1)),
            count=26,
            doc="lane * 6 + sprite * 3 + copy, then two trucks",
        ),
        Category(
            "Log",
            Blobs(WOOD, LOG_LANES, LOG_SHAPE, gap=(0, 1), filters=(_without_alligator,)),
            count=9,
            doc="three short ones, the long one, two others, pieces at the left edge",
        ),
        Category(
            "Turtle",
            Blobs((RED, DIVING), (8, 44, 152, 90), TURTLE_SHAPE),
            count=10,
            doc="six and four; those that have dived are gone",
        ),
        Category(
            "Alligator",
            Blobs(WOOD, LAST_LANE, GATOR_SHAPE, filters=(_without_logs,)),
            count=2,
            doc="in place of a log, its piece at the left edge",
        ),
        Category("AlligatorHead", Bounds(LIGHT_GREEN, BAYS, max_size=(8, 10)), doc="in a bay"),
        Category("Fly", Bounds(LIGHT_GREEN, BAYS, min_size=(8, 11)), doc="in a bay"),
        Category("HappyFrog", Bounds(GREEN, EACH_BAY), count=5, doc="by bay, from the left"),
        Category("LadyFrog", Bounds(WHITE, (8, 70, 152, 77)), doc="on a short log"),
        facing(
            "Snake",
            Bounds(GREEN, ((8, 95, 152, 102), (8, 57, 152, 64))),
            count=2,
            doc="on the verge, on the long log",
        ),
        display("Score", SCORE.rule(YELLOW), role="score", doc="points"),
        display("Lives", LIVES.rule(WHITE, STATUS_LEFT), role="lives", doc="spare frogs"),
        display(
            "Time",
            Bounds((BLACK, RED), STATUS_RIGHT, value=Gauge(1)),
            role="time",
            doc="that is left",
        ),
    ),
)
