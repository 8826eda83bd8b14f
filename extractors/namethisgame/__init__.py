"""Name This Game: a diver guards a treasure from an octopus and a shark.

Picture: docs/games/NameThisGame.png

Screen: the playfield draws the octopus, its tentacles, the bars and the ink. When a tentacle has
reached the ground, the octopus spreads the ink, which hides the diver and the treasure. The black
marks at the left edge and the maker's name are scenery. The shark swims behind the octopus to the
left and in front of it to the right, and so do the shot and the pipe. The shark's box excludes the
parts behind the body, or has the complete shark if all of it is hidden.

Slots: Tentacle has tentacle * 10 + row, the lowest row first: a tentacle has one piece per row.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the bytes), and the ROM's code. `drawn.py`
undoes the changes since the frame was drawn. The counter that the drawing loop leaves gives the
shot's position, and the pointers to its digits give the score. The value of Treasure is ALE's
lives, a bar's value its steps of 8 pixels.

Covered: all modes, both difficulties, lanes and pictures of the shark, all ways to lose a life, the
end of the game, the title, the dark screen after nine minutes without the joystick.

Not exact, because the RAM does not have it: whether the diver has just moved by a column or turned
(a third of his boxes are a column off), and the column of a shark that has just been shot. On the
first frame after a lost life, the boat and the shark are not valid, and the bars are full.

VEM: it misses shots behind the octopus.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Area,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Context,
    Detected,
    Game,
    Gauge,
    LivesAsNumber,
    NumberDisplay,
    Rom,
    Run,
    Runs,
    Shape,
    ShortRuns,
    Step,
    Word,
    among,
    box,
    boxes,
    choose,
    display,
    div,
    lookup,
    match,
    pick,
    when,
)
from ocjax.extractors.namethisgame.drawn import (
    LAUNCHED,
    SHIFTS,
    SHOT_ROWS,
    TO_LEFT,
    Drawn,
    as_drawn,
)
from ocjax.extractors.namethisgame.ram import (
    ROW_OF,
    TENTACLE_COUNT,
    TENTACLE_OF,
    TENTACLE_ROWS,
    Ram,
    State,
)

ROM = Rom("name_this_game", "36306070f0c90a72461551a7a4f3a209")
FONT = ROM.font(0xC00, rows=8)

BLACK = 0
GRAY = 8
WHITE = 14
GOLD = 40
ORANGE = 54
MAUVE = 86
VIOLET = 106
DARK_GREEN = 196
GREEN = 200
MAUVE_RGB = (184, 70, 162)
GRAY_RGB = (170, 170, 170)

PIECE_LEFTS = 16 + 16 * TENTACLE_OF  # of the four columns of a tentacle
PIECE_TOPS = 126 - 7 * ROW_OF

OCTOPUS = (20, 29, 140, 62)
LANE_TOPS = (119, 105, 91, 77, 63, 49, 35)  # of the shark, the lowest lane first
POINTS = (100, 80, 60, 40, 30, 20)  # of sharks in these lanes; the highest lane gives 10
BEHIND_LANE = 5  # the octopus hides parts of the shark from this lane up
NARROW_LOOKS = (8, 16)  # values of `lane` for pictures without the last column
SHOT_TURNS = (19, 32)  # last turns of the drawing loop in its upper parts
PIPE_TOP = 23
PIPE_HEIGHT = 122  # one row more left of the column at which the beam switches it off
PIPE_SWITCHED = 82
DIVER_TOP = 139
ZONE = (0, 139, 160, 160)  # the diver's
LANES = (0, 35, 160, 133)
WATER = (0, 24, 160, 133)
SEA = (0, 28, 160, 160)
BOAT_TOP = 9
BOAT_HEIGHTS = (14, 13)
TREASURE_PLACE = (72, 163)
TREASURE_END = 169
HEAPS = ROM.pictures((0xD26, 0xD24, 0xD22, 0xD20), 6)  # by lives

Extent = tuple[int, int, int, int]  # first column and row of a figure of 16 columns, width, height


def _caught_extent(phase: int, color: int) -> Extent:
    """Extent of the diver, or of the shark that carries him away, by its colour."""
    table = ROM.bytes(0xD00 + 8 * phase, 8)
    pointers = (table[::2] + 256 * table[1::2]) & 0xFFF
    left_half, right_half, *colors = ROM.rows(pointers.tolist(), 20)
    left_rows = np.where(colors[0] == color, left_half, 0)
    rows = left_rows << 8 | np.where(colors[1] == color, right_half, 0)
    used = np.flatnonzero(rows)
    ink = int(np.bitwise_or.reduce(rows))
    left = 16 - ink.bit_length()
    right = 17 - (ink & -ink).bit_length()
    return left, int(used[0]), right - left, int(np.ptp(used)) + 1


CAUGHT = tuple(_caught_extent(phase, GREEN) for phase in range(4))
BITING = tuple(_caught_extent(phase, GRAY) for phase in range(4))


def _body_columns(upper: int, lower: int) -> np.ndarray:
    """Columns of a lane behind the octopus, bool `[12, 176]`, from the two registers' values."""
    left = np.unpackbits(ROM.rows(upper, 13).astype(np.uint8)[:, None], axis=1)
    right = np.unpackbits(ROM.rows(lower, 13).astype(np.uint8)[:, None], axis=1, bitorder="little")
    half = np.repeat(np.concatenate([np.zeros((13, 4), int), left, right], 1), 4, 1)
    return np.pad(np.concatenate([half, half[:, ::-1]], 1) > 0, ((0, 0), (0, 16)))[:12]


SHARK_PIECE = Word(left=5, top=5, width=5, height=5)


def _shark_pieces(look: int, body: np.ndarray) -> list[int]:
    """The shark's part outside the octopus by column, as `SHARK_PIECE` words."""
    pointers = ROM.bytes(0xB1D + look, 4)
    halves = ROM.rows(((pointers[::2] + 256 * pointers[1::2]) & 0xFFF).tolist(), 13)[:, :12]
    dots = np.unpackbits(halves.T.astype(np.uint8), axis=1) > 0
    out = []
    for x in range(160):
        there = dots & ~body[:, x : x + 16]
        y, x = np.nonzero(there if there.any() else dots)
        width = np.ptp(x) + 1
        height = np.ptp(y) + 1
        out.append(SHARK_PIECE.pack(left=x.min(), top=y.min(), width=width, height=height))
    return out


# By picture, lane and column.
BODIES = (_body_columns(0xC50, 0xDF2), _body_columns(0xC5D, 0xEE7))
LEFT_OVER = np.array([[_shark_pieces(look, body) for body in BODIES] for look in range(4, 17, 4)])

SCORE = NumberDisplay(FONT, right=103, top=181, digits=6)
BARS_LEFT = 16
BARS_RIGHT = 144
BAR_STEP = 8
METER_ROWS = (179, 191)
TIMER_ROWS = (175, 179)

SHARK_LEFT = 4  # `shark_x` of a shark that enters
SHARK_RIGHT = 144


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    return {
        "Player": _diver_box(m, drawn),
        "Shark": _shark_box(m, drawn),
        "Shot": _shot_box(m, drawn),
        "Octopus": box(20, 29, 120, 33, _on(m)),
        "Tentacle": _tentacle_boxes(m),
        "Oxygen_Boat": _boat_box(m),
        "Oxygen_Pipe": _pipe(m, drawn),
        "Treasure": _treasure_box(m, drawn),
        "Oxygen_Meter": _bar(METER_ROWS, drawn.oxygen, _on(m)),
        "Timer": _bar(TIMER_ROWS, drawn.time, _on(m) & (m.text == 0)),
        "Score": SCORE.box(drawn.score, valid=_on(m) & (m.text == 0), value=m.score),
    }


def _on(m: Ram) -> jax.Array:
    """True if anything is drawn."""
    return m.idle < 128


def _compass(leftward: jax.Array) -> jax.Array:
    return jnp.where(leftward, WEST, EAST)


def _caught_box(m: Ram, drawn: Drawn, extents: tuple[Extent, ...]) -> Box:
    """The current look of the shark, or of the diver in its mouth."""
    phase = m.clock >> 3 & 3
    lefts, tops, widths, heights = zip(*extents, strict=True)
    inset = pick(phase, lefts)
    width = pick(phase, widths)
    left = jnp.where(m.faces_right, inset, 16 - inset - width)
    return box(drawn.x + left, DIVER_TOP + pick(phase, tops), width, pick(phase, heights))


def _diver_box(m: Ram, drawn: Drawn) -> Box:
    swims = box(drawn.x, DIVER_TOP, 16, 13).clip(0, DIVER_TOP + drawn.ink, 160, 160)
    shown = choose(m.eaten, _caught_box(m, drawn, CAUGHT), swims).where(_on(m))
    return replace(shown, orientation=_compass(~m.faces_right))


def _shark_box(m: Ram, drawn: Drawn) -> Box:
    look = jnp.max(m.lane)
    leftward = m.shark_leftward
    begins = m.shark_x == jnp.where(leftward, SHARK_RIGHT, SHARK_LEFT)
    gained = m.score - drawn.score
    shot = (m.state == State.PLAYS) & begins & (m.shark_lane == len(POINTS)) & (gained > 0)
    lane = match(*((shot & (gained >= p), i) for i, p in enumerate(POINTS)), otherwise=m.shark_lane)
    x = jnp.where(shot, m.shot_x - 10, m.shark_x - 1)
    left, top, width, height = _swimming(look, lane, x, leftward)
    there = (look > 0) & ~(shot & (m.shot_y == LAUNCHED)) & (m.state != State.LOST)
    swims = box(x + left, pick(lane, LANE_TOPS) + top, width, height, there)
    shark = choose(m.eaten, _caught_box(m, drawn, BITING), swims).where(_on(m))
    carries = jnp.where(m.eaten, ~m.faces_right, leftward)
    return replace(shark, orientation=_compass(carries))


def _swimming(
    look: jax.Array, lane: jax.Array, x: jax.Array, leftward: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array, jax.Array]:
    """First column and row, width and height of the shark's visible part."""
    index = (2 * ((look >> 2) - 1) + lane - BEHIND_LANE) * 160 + jnp.clip(x, 0, 159)
    seen = SHARK_PIECE.unpack(lookup(LEFT_OVER.reshape(-1), index))
    narrow = among(look, NARROW_LOOKS)
    behind = leftward & (lane >= BEHIND_LANE)
    return (
        match((behind, seen.left), (narrow & ~leftward, 1), otherwise=0),
        when(behind, seen.top),
        match((behind, seen.width), (narrow, 15), otherwise=16),
        jnp.where(behind, seen.height, 12),
    )


def _shot_box(m: Ram, drawn: Drawn) -> Box:
    x = m.shot_x - 2
    y = drawn.shot_y
    top = _switched(y, x)
    bottom = _switched(y + 1, x + 3)
    return box(x, top, 1, bottom - top, drawn.shot_there & _on(m))


def _switched(turn: jax.Array, x: jax.Array) -> jax.Array:
    """Row of column x that first shows an object switched on in a turn of the drawing loop.

    The beam is further right in the loop's later parts. Single rows separate these parts.
    """
    low = turn > SHOT_TURNS[1]
    row = turn + match(
        (turn <= SHOT_TURNS[0], 28),
        (~low, 29),
        otherwise=30 + div(jnp.maximum(turn - SHOT_TURNS[1] - 1, 0), 6),
    )
    beam = match((turn <= 6, 16), (~low, 64), (turn <= SHOT_ROWS, 142), otherwise=0)
    return row + when(x < beam, 1)


def _tentacle_boxes(m: Ram) -> Box:
    bits = m.playfield >> SHIFTS & 15
    column = (bits >> 1) - (bits >> 3)
    x = PIECE_LEFTS + 4 * jnp.where(TO_LEFT, 3 - column, column)
    return box(x, PIECE_TOPS, 4, 6, (bits > 0) & _on(m))


def _boat_box(m: Ram) -> Box:
    height = jnp.where((m.clock & 2) == 0, *BOAT_HEIGHTS)
    facing = _compass(m.boat_leftward)
    there = _on(m) & (m.state != State.LOST)
    return box(m.boat_x - 1, BOAT_TOP, 16, height, there, orientation=facing)


def _pipe(m: Ram, drawn: Drawn) -> Box:
    height = PIPE_HEIGHT + when(drawn.pipe_x < PIPE_SWITCHED, 1)
    return box(drawn.pipe_x, PIPE_TOP, 1, height, drawn.pipe & _on(m))


def _treasure_box(m: Ram, drawn: Drawn) -> Box:
    left, top = TREASURE_PLACE
    whole_heap = HEAPS.box(drawn.lives & 3, left, top, zoom=2, value=m.lives, valid=_on(m))
    return whole_heap.clip(0, top + drawn.treasure_ink, 160, TREASURE_END)


def _bar(rows: tuple[int, int], steps: jax.Array, valid: jax.Array) -> Box:
    """A bar that shrinks to the middle of the screen."""
    half = BAR_STEP // 2 * steps
    return box(80 - half, rows[0], 2 * half, rows[1] - rows[0], valid, value=steps)


class InLane(Step):
    """Extend the shark below the octopus to all rows; a tentacle may hide some."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        top = LANES[1] + 14 * div(jnp.maximum(found.y - LANES[1], 0), 14)
        swims = (found.y > OCTOPUS[3]) & (found.y < LANES[3])
        y = jnp.where(swims, top, found.y)
        h = jnp.where(swims, 12, found.h)
        return found._replace(box=boxes(found.x, y, found.w, h, found.valid))


class FirstRow(Step):
    """Add the diver's first row, which does not have his colour yet at the left."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        missing = jnp.where(found.y == DIVER_TOP + 1, 1, 0)
        whole = boxes(found.x, found.y - missing, found.w, found.h + missing, found.valid)
        return found._replace(box=whole)


def _meter(color: int, rows: tuple[int, int]) -> Bounds:
    return Bounds(color, (BARS_LEFT, rows[0], BARS_RIGHT, rows[1]), value=Gauge(BAR_STEP))


def _piece(tentacle: int, row: int) -> Area:
    """Area of a piece of a tentacle."""
    left = 16 + 16 * tentacle
    top = 126 - 7 * row
    return left, top, left + 16, top + 6


PIECES = tuple(_piece(i, j) for i in range(TENTACLE_COUNT) for j in range(TENTACLE_ROWS))
HANGS = functools.partial(Run, VIOLET, PIPE_TOP + 1, above=1)
PIPES = (
    HANGS(left=(0, PIPE_SWITCHED - 1), width=1, height=PIPE_HEIGHT),
    HANGS(left=(PIPE_SWITCHED, 159), width=1, height=PIPE_HEIGHT - 1),
)
FISH = Blobs(
    GRAY, SEA, Shape(w=(3, 18), h=(2, 13)), gap=(8, 2), filters=(ShortRuns(13),), then=(InLane(),)
)
BULLET = Bounds((GRAY, VIOLET), WATER, max_size=(1, 3), exclude=("Shark",), filters=(ShortRuns(3),))
# The end of the pipe has the same colour.
DIVER = Bounds(GREEN, ZONE, ignore=((0, 144, 160, 146),), then=(FirstRow(),))
HEAP = Bounds(GOLD, (72, 163, 88, TREASURE_END), value=Gauge(2, side="h"))
BOAT = Bounds((MAUVE, VIOLET, DARK_GREEN), (0, BOAT_TOP, 160, PIPE_TOP))

# Letters that replace it begin further left and are wider.
POINTS_SHOWN = replace(SCORE.rule(WHITE, required=True), max_size=(46, 8))

GAME = Game(
    name="NameThisGame",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(lives=(LivesAsNumber("Treasure"),)),
    categories=(
        Category(
            "Player",
            DIVER,
            attributes=("orientation",),
            role="player",
            colors=(GREEN, WHITE),  # also air bubbles
            doc="the diver",
        ),
        Category("Shark", FISH, attributes=("orientation",), doc="in a lane, or with the diver"),
        Category("Shot", BULLET, doc="the diver's"),
        Category("Octopus", Bounds(BLACK, OCTOPUS), needs=("Oxygen_Boat",), doc="its body"),
        Category(
            "Tentacle",
            Bounds(BLACK, PIECES),
            count=80,
            needs=("Oxygen_Boat",),
            doc="pieces: tentacle * 10 + row",
        ),
        Category(
            "Oxygen_Boat", BOAT, rgb=MAUVE_RGB, attributes=("orientation",), doc="on the surface"
        ),
        Category(
            "Oxygen_Pipe",
            Runs(PIPES, most=1),
            rgb=GRAY_RGB,
            colors=(VIOLET, GRAY, WHITE, GREEN),
            doc="hangs from the boat",
        ),
        Category("Treasure", HEAP, attributes=("value",), doc="a heap; value: lives"),
        display(
            "Oxygen_Meter",
            _meter(ORANGE, METER_ROWS),
            colors=(ORANGE, WHITE),  # also the title
            doc="oxygen, 0-16",
        ),
        display("Timer", _meter(DARK_GREEN, TIMER_ROWS), role="time", doc="rest of the wave, 0-16"),
        display("Score", POINTS_SHOWN, role="score", doc="points"),
    ),
)
