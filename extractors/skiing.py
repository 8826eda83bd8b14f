"""Skiing: a skier, gates of two flags, moguls and trees that scroll up, the gates to go and the clock.

Slots are the game's records: eight of them go round while the list in RAM moves up by one at every shift, counted by byte 16. Two are
gates (Flag: left and right flag of each), two moguls, four trees. After the last gate one gate's record is a mogul (the third slot); in
downhill games the gates' records are trees (the last two slots).
`orientation` of the player: where the skis point, compass point 12 (west) over 8 (straight down) to 4 (east), from the game's 16
headings. `value`: of Score the sum of the emulator's rewards, minus the hundredths of a second so far (the emulator ends a run with five
seconds for every missed gate, as the game's clock does); of Clock the hundredths themselves; of Player the gates to go, the number that
Score's digits show.

RAM facts: facts/ram, and the game's display program. The frame shows the state before the latest step of the scroll and the clock,
which RAM holds already; bytes 115 and 116 are that step. A crash shows one frame late. Not in RAM: which way the latest turn went, so the
skier's picture is one frame early when it changes.
Boxes are tight around what the borders leave: a tree cut by the left border or the playfield's top is as narrow as the rows that remain.

Covered: the slalom that ALE starts (there is one mode), downhill by editing RAM, crashes, both borders, the end of the run.
Scenery that no box covers: the black frame, the maker's name.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.spec import Blobs, Bounds, Box, Category, Game, box

PINK, BLUE, RED, BLACK = 72, 134, 68, 0
GRAYS, GREENS = (10, 12), (198, 212, 214, 218)
FIELD = (8, 32, 152, 178)


class Picture(NamedTuple):
    width: int
    rows: tuple[tuple[int, int, int], ...]  # from the top: how many, first and last column


FLAG = Picture(8, ((1, 3, 4), (1, 2, 4), (1, 1, 4), (1, 0, 4), (1, 1, 4), (1, 2, 4), (1, 3, 4), (7, 4, 4)))
MOGUL = Picture(16, ((1, 8, 11), (1, 6, 13), (1, 2, 13), (2, 0, 15), (1, 2, 11)))
THIN = ((2, 7, 7), (1, 6, 7), (2, 6, 8), (2, 5, 8), (3, 5, 9), (2, 4, 9), (1, 4, 10), (1, 4, 8), (1, 4, 11))
THICK = ((1, 6, 11), (2, 4, 11), (2, 2, 11), (1, 2, 9), (1, 2, 13), (2, 0, 13), (2, 0, 15), (1, 2, 15), (1, 6, 15), (1, 2, 13), (1, 4, 11))
TREE = Picture(16, THIN + THICK)


class Ram(RamMap):
    heading = bits(15, count=4)  # 0: west ... 15: east
    crashed = bits(15, first=6)
    speed = byte(14)
    turn = byte(16)  # the record at the end of the list, modulo 8
    state = byte(17)  # 0: skiing, 255: the run has ended
    x = byte(25)  # already moved
    y = byte(26)  # 120; 124 in a jump
    heights = byte(*range(54, 62))  # last row of the picture that shows; 255: none
    object_x = byte(*range(62, 70))
    kinds = byte(*range(78, 86))
    object_y = byte(*range(86, 94))  # row above the playfield's end
    scroll_x = byte(95)  # what the skier could not move at a border
    event = byte(97)  # 224 on the frame of a crash or a passed gate
    patience = byte(98)  # frames till the next turn
    step = signed(115, 116)  # latest movement: skier or hill, right; hill, up
    time = bcd((104, 105, 106))  # minutes, seconds, hundredths
    gates = bcd(107)


def decode(m: Ram) -> dict[str, Box]:
    skiing = m.state == 0
    # the list in the order of the records: record k is at (turn + 7 - k) modulo 8
    turn = jnp.where(m.state == 255, m.turn + 1, m.turn)  # the run ended before the list moved
    h, x, y, kind = (_records(v, turn) for v in (m.heights, m.object_x, m.object_y - jnp.where(skiing, m.step[1], 0), m.kinds))
    exists = h < 32
    top = 180 - y + h
    gate, mogul, tree = (kind & 3) == 0, (kind & 3) == 1, (kind & 2) == 2
    mirrored = (kind & 4) > 0

    ends = jnp.array([0, 0, 4, 4])
    flag_x = _wrap((x[ends] + 1 + 32 * (jnp.arange(4) & 1)) % 160)
    woods = jnp.array([2, 3, 6, 7, 0, 4])
    tree_x = _wrap(jnp.where(h > 15, x + 157, x + 2) % 160)
    hills = jnp.array([1, 5, 0])
    colors = jnp.where((kind[ends] == 4)[:, None], jnp.array([184, 50, 50], jnp.uint8), jnp.array([66, 72, 200], jnp.uint8))
    minutes = m.time // 10000
    hundredths = m.time - 4000 * minutes
    return {
        "Player": _player(m, skiing),
        "Flag": _tight(FLAG, flag_x, top[ends], mirrored[ends], exists[ends] & gate[ends], colors),
        "Mogul": _tight(MOGUL, _wrap((x + 2) % 160)[hills], top[hills], mirrored[hills], exists[hills] & mogul[hills]),
        "Tree": _tight(TREE, tree_x[woods], top[woods], mirrored[woods], exists[woods] & tree[woods]),
        "Score": _score(m, -hundredths),
        "Clock": box(59, 16, 38, 7, value=hundredths),
    }


def _records(v: jax.Array, turn: jax.Array) -> jax.Array:
    """Record 7 first in the list at turn 7, 6 at turn 6, ...: turned round until record 0 is first."""
    v = v[::-1]
    for step in (1, 2, 4):
        v = jnp.where((turn & step) > 0, jnp.roll(v, step), v)
    return v


def _wrap(x: jax.Array) -> jax.Array:
    """The screen is a ring of 160 columns; what begins at the right border shows at the left one."""
    return jnp.where(x >= FIELD[2], x - 160, x)


def _tight(picture: Picture, x: jax.Array, end: jax.Array, mirrored: jax.Array, valid: jax.Array, rgb: jax.Array | None = None) -> Box:
    """Tight boxes of what the playfield leaves of a picture at x that ends above screen line `end`."""
    left, above, right, below = FIELD  # the same distance from both sides of the screen
    x = jnp.where(mirrored, 160 - picture.width - x, x)
    row = end - sum(n for n, _, _ in picture.rows)
    x0, x1, y0, y1 = (jnp.full_like(x, v) for v in (999, -999, 999, -999))
    for n, first, last in picture.rows:
        shows = (row + n > above) & (row < below) & (x + first < right) & (x + last >= left)
        x0 = jnp.where(shows, jnp.minimum(x0, x + first), x0)
        x1 = jnp.where(shows, jnp.maximum(x1, x + last + 1), x1)
        y0 = jnp.where(shows, jnp.minimum(y0, row), y0)
        y1 = jnp.where(shows, row + n, y1)
        row = row + n
    x0, x1 = jnp.maximum(x0, left), jnp.minimum(x1, right)
    return box(jnp.where(mirrored, 160 - x1, x0), y0, x1 - x0, y1 - y0, valid, rgb=rgb).clip(*FIELD)


def _player(m: Ram, skiing: jax.Array) -> Box:
    slope = jnp.minimum(m.heading, 15 - m.heading)  # 7: straight down
    fell = m.crashed == 1
    rose = ~fell & (m.speed == 1) & (slope > 0) & (m.patience != slope + 1)  # the crash shows once more
    lying = (fell & (m.event != 224)) | rose
    pose = jnp.where(lying, 4, slope >> 1)
    top = jnp.where(pose == 0, 0, jnp.where(pose < 3, 1, jnp.where(pose == 3, 2, 5)))
    height = jnp.where(pose == 0, 16, jnp.where((pose == 1) | (pose == 4), 15, 18))
    width = jnp.where((pose == 2) | (pose == 3), 7, 8)
    mirrored = m.heading < 8
    start = jnp.where((pose == 3) ^ (mirrored & (width == 7)), 1, 0)
    ahead = m.x + m.step[0]  # whoever would leave the hill with the next step stands still
    moved = jnp.where(skiing & (m.scroll_x == 0) & (ahead >= 8) & (ahead < 144), m.step[0], 0)
    compass = 12 - ((m.heading + 1) >> 1)
    return box(m.x - moved + 1 + start, 159 - m.y + top, width, height, value=m.gates, orientation=compass)


def _score(m: Ram, value: jax.Array) -> Box:
    gates = jnp.where((m.event == 224) & (m.crashed == 0), m.gates + 1, m.gates)  # shown one frame late
    two = gates > 9
    return box(jnp.where(two, 67, 75), 6, jnp.where(two, 14, 6), 7, value=value)


GAME = Game(
    name="Skiing",
    rom="skiing",
    md5="b76fbadc8ffb1f83e2ca08b6fb4d6c9f",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Bounds(PINK, FIELD), attributes=("orientation", "value")),
        Category("Flag", Blobs((BLUE, RED), FIELD, join=(4, 8), max_size=(5, 14)), count=4),
        Category("Mogul", Blobs(GRAYS, FIELD, join=(8, 4), max_size=(16, 6)), count=3),
        Category("Tree", Blobs(GREENS, FIELD, join=(8, 4), max_size=(16, 30)), count=6),
        Category("Score", Bounds(BLACK, (20, 4, 140, 14)), hud=True, attributes=("value",)),
        Category("Clock", Bounds(BLACK, (20, 14, 140, 26)), hud=True, attributes=("value",)),
    ),
)
