"""DoubleDunk: two teams of two players, a ball, a basket, the scores, and the limits of the game.

Screen: the court, the poles and the texts at the bottom (offence and defence, fouls, calls) are
scenery. The menu of options is a screen that does not appear in the emulator's modes.

Slots: Player is the green team, Opponent the white one; Big and Small are its two players.

RAM: ALE's source (scores), OCAtari 2.2 (positions, pictures), and the ROM's code. Each of the two
sprites draws two figures, one below the other. Bytes 41, 48-51, 53-56 and 58-81 hold them as they
are drawn, from the top, and do not change before the next frame is made. Where the figures of a
sprite overlap, it leaves out a part of one of them, the upper and the lower one by turns. So a box
has the lines that are drawn. The players themselves (bytes 29-40) have moved since; they tell which
of two figures of one size is whose. A player who is not drawn has his box where he is now.

Covered: all modes, possession, fouls, free throws, the end of the game.

Not exact: the ball's column, in 18 % of frames by one column. The game places the sprite of the
ball before it moves the ball, and the RAM keeps only the new column: the last step is known of a
ball that flies, but not of one that a player carries. The uppermost line of a figure that begins
where the other sprite changes figures.

VEM: knows a figure by the colours of its rows, and by the picture that covers most of its pixels.
It does not see a figure of which few lines are drawn, or takes a few lines of another one for it.
It does not see the ball among pixels of the players in whose colours it is drawn.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, BoxTable, box
from ocjax.console.ops import lookup, only, pick, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import mirrored, position
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors._doubledunk_vision import Ball, Figure, Figures, Only
from ocjax.vision.displays import NumberDisplay
from ocjax.vision.rules import Bounds

ROM = Rom("double_dunk", "368d88a6c071caba60b4f778615aae94")
FONT = ROM.font(0x801, rows=7, stride=8)
SMALL_FONT = ROM.font(0x859, rows=7, stride=8, dots=3, shift=5, pitch=4)

COURT = (8, 28, 152, 180)
WHITE = 14
GREEN = 180
ORANGE = 34
BOARD = 12
NET = 22
YELLOW = 30
CLOCK_COLORS = (4, 12)

BOTTOM = 181  # screen row of line 0; the game counts lines upwards
LEFT = 4  # `position` of column 0
BIG_HEAD = 27  # lines from a big player's place to above his head
SMALL_HEAD = 24
FIRST_LINES = np.array((127, 151))  # of the sprites 1 and 0; the basket has sprite 1 above that
SPRITES = np.array((1, 0, 1, 0))  # that draw the four figures
MIDDLE = (0x36, 0x6B)  # lines of the court's middle
SIDE = 11  # column of a player whose x is 0
UNEQUAL = 2 * np.arange(4) + 1  # so that no two figures are equally near
BIG = np.array((1, 1, 0, 0))  # by player
BASKET_BOX = (76, 42, 8, 9)
BOARD_BOX = (68, 28, 24, 16)
BYTES = (0, 8, 16, 24)  # of the sides of a box in a number
SWITCH = 4  # lines after which a sprite's second player can begin
# Columns of the beam, in the lower part of the court and above it, by how many sprites are drawn.
BEAM_LOW = (40, 64, 97)
BEAM_HIGH = (0, 28, 76)
LIMIT = NumberDisplay(SMALL_FONT, right=43, top=18, digits=2)
SHOT_CLOCK = NumberDisplay(SMALL_FONT, right=115, top=18, digits=2)
PLAYER_SCORE = NumberDisplay(FONT, right=52, top=9, digits=2)
OPPONENT_SCORE = NumberDisplay(FONT, right=116, top=9, digits=2)

# The pictures of a figure: small and big by turns.
FIGURES = 32
ADDRESSES = ROM.bytes(0x3E50, FIGURES) + 256 * ROM.bytes(0x3E70, FIGURES)
HEADS = np.where(np.arange(FIGURES) % 2, BIG_HEAD, SMALL_HEAD)
LINES = BIG_HEAD + 1  # of a picture at most, with the empty ones


def _figures() -> tuple[int, np.ndarray]:
    """The first address of line 27 below a head, and the figure of each from there on; -1: none."""
    below = ADDRESSES + HEADS - BIG_HEAD
    out = np.full(below.max() - below.min() + 1, -1)
    out[below - below.min()] = np.arange(FIGURES)
    return int(below.min()), out


def _extents() -> np.ndarray:
    """Left, top, width, height of what is drawn of each figure, by mirroring, first and last line.

    The top is counted in lines from the one above the head. A figure of which nothing is drawn
    has its whole extent.
    """
    offsets = ((ADDRESSES & 0xFFF) + 0x2000).tolist()
    rows = np.unpackbits(ROM.rows(offsets, LINES).astype(np.uint8)[..., None], axis=-1)
    line = np.arange(LINES)[::-1]
    inside = line < HEADS[:, None]
    rows = np.stack([rows, rows[..., ::-1]], axis=1).astype(bool) & inside[:, None, :, None]
    low, high = np.arange(LINES)[:, None, None], np.arange(LINES)[:, None]
    drawn = rows[:, :, None, None] & ((line >= low) & (line <= high))[..., None]
    whole = np.broadcast_to(rows[:, :, None, None], drawn.shape)
    drawn = np.where(drawn.any((-1, -2), keepdims=True), drawn, whole)
    ys, xs = np.any(drawn, -1), np.any(drawn, -2)
    top, left = ys.argmax(-1), xs.argmax(-1)
    bottom, right = LINES - ys[..., ::-1].argmax(-1), 8 - xs[..., ::-1].argmax(-1)
    return np.stack([left, top, right - left, bottom - top], -1).reshape(-1, 4)


FIRST_ADDRESS, FIGURE_OF = _figures()
EXTENTS = BoxTable(_extents())


# Players, in the order of their bytes.
PLAYER_BIG = 0
OPPONENT_BIG = 1
PLAYER_SMALL = 2
OPPONENT_SMALL = 3


class Ram(RamMap):
    clock_runs = bits(0, first=4)  # there is a shot clock
    frame = byte(3)
    figure = bits(29, 30, 31, 32, count=4)  # what a player does
    y = byte(33, 34, 35, 36)  # line of his feet
    x = byte(37, 38, 39, 40)  # column - 11
    mirrored = bits(41, first=3)  # of sprite 0
    mirrored_right = bits(41, first=4)  # of sprite 1
    ball_top = byte(45)  # line above it
    ball_bottom = byte(46)  # its lowest line
    ball_x = byte(47)  # column - 12
    falls = bits(2, first=4)  # the ball flies to a player or the ground
    flies_left = bits(2, first=6)
    loose = bits(11, first=7)  # no player has the ball
    caught = bits(11, first=6)  # a player is about to have it
    # Of the four drawn players, from the top; sprites 1, 0, 1, 0:
    fine = bits(48, 49, 50, 51, first=4, count=4)
    coarse = byte(53, 54, 55, 56)
    top = byte(58, 59, 60, 61)  # line above the head
    bottom = byte(62, 63, 64, 65)  # last line that is drawn
    picture = byte((75, 74), (77, 76), (79, 78), (81, 80))  # address of line 0
    limit = bcd(115)
    shot_clock = bcd(116)
    score = bcd(118, 119)  # player, opponent


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Drawn:
    """The players as they are drawn, `[4]` each."""

    figure: jax.Array  # -1: none
    mirrored: jax.Array
    x: jax.Array
    y: jax.Array  # line of the feet
    low: jax.Array  # lines above the feet from which, and to which he is drawn
    high: jax.Array
    more: jax.Array  # 1: his last line is drawn twice


def decode(m: Ram) -> dict[str, Box]:
    players = _players(m)
    return {
        "Player_Big": players[PLAYER_BIG],
        "Opponent_Big": players[OPPONENT_BIG],
        "Player_Small": players[PLAYER_SMALL],
        "Opponent_Small": players[OPPONENT_SMALL],
        "Ball": _ball(m),
        "Basket": box(*BASKET_BOX),
        "Backboard": box(*BOARD_BOX),
        "Limit": LIMIT.box(m.limit),
        "Shot_Clock": SHOT_CLOCK.box(m.shot_clock, color=jnp.where(m.clock_runs == 1, 12, 4)),
        "Player_Score": PLAYER_SCORE.box(m.score[0]),
        "Opponent_Score": OPPONENT_SCORE.box(m.score[1]),
    }


def as_drawn(m: Ram) -> Drawn:
    """The players in the order of drawing, from what the game has made of them for the frame."""
    below = m.picture + m.top - BIG_HEAD - FIRST_ADDRESS
    known = (below >= 0) & (below < len(FIGURE_OF))
    figure = jnp.where(known, lookup(FIGURE_OF, below), -1)
    y = m.top - jnp.where((figure & 1) == 1, BIG_HEAD, SMALL_HEAD)
    first, end = _lines(m)
    low, more = _disturbed(m, y, end)
    twice = (m.picture[2:] == m.picture[:2]) & (m.top[2:] == m.top[:2])
    figure = jnp.concatenate([figure[:2], jnp.where(twice, -1, figure[2:])])
    mirrored = jnp.stack([m.mirrored_right, m.mirrored] * 2)
    x = position(m.coarse, m.fine) - LEFT
    return Drawn(figure, mirrored, x, y, low, first - y, more)


def _lines(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The first line of each figure, and the one after its last line."""
    start = jnp.minimum(m.top - 1, jnp.concatenate([FIRST_LINES, m.bottom[:2] - SWITCH]))
    end = _end(m, start)
    start = jnp.minimum(m.top - 1, jnp.concatenate([FIRST_LINES, end[:2] - SWITCH + 1]))
    return start, _end(m, start)


def _end(m: Ram, start: jax.Array) -> jax.Array:
    """The line after each figure's last one.

    Where both sprites show figures above or below the middle of the court, the drawing loop looks
    at each sprite's end in every other line only.
    """
    line = m.bottom - 1
    both = jnp.zeros_like(line)
    for begins, bottom in zip(_crossed(start), _crossed(m.bottom), strict=True):
        both = jnp.where((begins > line) & (bottom <= line), jnp.minimum(begins, start), both)
    middle = (line >= MIDDLE[0]) & (line < MIDDLE[1])
    from_middle = (line < MIDDLE[0]) & (both >= MIDDLE[0])
    even = jnp.where(from_middle, 1, both & 1) ^ SPRITES ^ when(line >= MIDDLE[0], 1)
    return line - when((both > 0) & ~middle & (even == 1), 1)


def _crossed(of: jax.Array) -> tuple[jax.Array, jax.Array]:
    """For each figure, the upper and the lower one of the other sprite."""
    return jnp.stack([of[1], of[0]] * 2), jnp.stack([of[3], of[2]] * 2)


def _disturbed(m: Ram, y: jax.Array, end: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Each figure's lowest line above its feet, and whether its last line is drawn twice.

    While one sprite changes from a figure to the next, two lines of the other sprite show what it
    has in the second one. At the last figure's end, it keeps what it has for one line.
    """
    upper, lower = _crossed(end)
    upper_bottom, lower_bottom = _crossed(m.bottom)
    changes = upper >= lower_bottom
    shown = upper_bottom - 2
    lost = changes & (upper > end) & ((shown < y) | (shown <= m.bottom))
    low = jnp.maximum(end + 1, when(lost & (shown <= y + 1), upper + 1)) - y
    return low, when((y == lower + 1) | (~changes & (y == upper + 1)), 1)


def _players(m: Ram) -> Box:
    """Each player as he is drawn; where he is not, whole and where he is now."""
    drawn = as_drawn(m)
    low, high = jnp.clip(drawn.low, 0, LINES - 1), jnp.clip(drawn.high, 0, LINES - 1)
    index = ((2 * drawn.figure + drawn.mirrored) * LINES + low) * LINES + high
    extent = EXTENTS.at(index, x=drawn.x, y=BOTTOM - LINES + 1 - drawn.y)
    seen = _seen(m, drawn)
    word = only(seen, _packed(extent.trimmed(bottom=-drawn.more))[None], axis=1)
    index = 2 * LINES**2 * (2 * m.figure + BIG) + LINES - 1
    whole = EXTENTS.at(index, x=m.x + SIDE, y=BOTTOM - LINES + 1 - m.y)
    word = jnp.where(jnp.any(seen, axis=1), word, _packed(whole))
    return box(*(word >> shift & 255 for shift in BYTES))


def _packed(of: Box) -> jax.Array:
    """Boxes in the court as one number each."""
    b = of.clip(*COURT)
    sides = (b.x, b.y, jnp.maximum(b.w, 0), jnp.maximum(b.h, 0))
    return sum(
        (when(b.valid, side << shift) for side, shift in zip(sides, BYTES, strict=True)),
        jnp.zeros_like(b.x),
    )


def _seen(m: Ram, drawn: Drawn) -> jax.Array:
    """Whether a drawn figure is a player, bool `[player, slot]`.

    Of two figures of a size, each belongs to the team to whose player it is nearer, compared with
    the other figure.
    """
    distance = jnp.abs(drawn.x[None] - m.x[:, None] - SIDE) + jnp.abs(drawn.y[None] - m.y[:, None])
    nearer = 8 * (distance[::2] - distance[1::2]) + UNEQUAL[None]
    fits = (drawn.figure[None] >= 0) & ((drawn.figure[None] & 1) == np.array(((1,), (0,))))
    rest = jnp.sum(when(fits, nearer), axis=1)[:, None] - nearer
    players = jnp.stack([fits & (nearer < rest), fits & (nearer > rest)], axis=1)
    return players.reshape(4, 4)


def _ball(m: Ram) -> Box:
    """The ball, 2 x 6 and 4 x 4 pixels by turns."""
    wide = (m.frame & 1) == 0
    flies = (m.loose == 1) & (m.caught == 0) & (m.falls == 1) & ((m.frame & 3) == 2)
    x = m.ball_x - when(flies, 1 - 2 * m.flies_left) + jnp.where(wide, 12, 13)
    edges_of = jnp.stack([m.ball_top, m.ball_bottom]) - 1
    y = BOTTOM - edges_of + when(x[None] < _beam(m, edges_of), 1)
    return box(x, y[0], jnp.where(wide, 4, 2), y[1] - y[0]).clip(*COURT)


def _beam(m: Ram, line: jax.Array) -> jax.Array:
    """The column at which the beam is when the drawing loop has come to the ball in some lines."""
    first, end = _lines(m)
    drawn = (first[None] >= line[:, None]) & (line[:, None] > end[None])
    players = jnp.sum(when(drawn, 1), axis=1)
    low = line < MIDDLE[0]
    return jnp.where(low, pick(players, BEAM_LOW), pick(players, BEAM_HIGH))


def _rows(*runs: tuple[int, int]) -> tuple[int, ...]:
    """The colours of a figure's rows from the top, from how many rows have each."""
    return tuple(COLORS.index(color) for count, color in runs for _ in range(count))


def _pictures(first: int, height: int) -> np.ndarray:
    """All different pictures of the big or small figures, and their mirror images."""
    offsets = ((ADDRESSES[first::2] & 0xFFF) + 0x2000).tolist()
    rows = ROM.rows(offsets, height)
    return np.unique(np.concatenate([rows, mirrored(rows)]), axis=0)


COLORS = (ORANGE, 14, 82, 180, 252, 52, 226, 232)
STRIPES = ((1, 52), (1, 252), (1, 180), (1, 82))
WHITE_BIG = _rows((8, 226), (2, 14), *STRIPES, (5, 14), (5, 226), (1, 82), (2, 14))
WHITE_SMALL = _rows((1, ORANGE), (8, 232), (1, 14), *STRIPES, (3, 14), (4, 232), (1, 82), (2, 14))
GREEN_BIG = _rows((8, 232), (7, 180), (1, 14), (3, 180), (5, 232), (1, 14), (2, 180))
GREEN_SMALL = _rows((1, ORANGE), (8, 232), (5, 180), (1, 14), (2, 180), (4, 232), (1, 14), (2, 180))
PLAYERS = Figures(
    kinds=(
        Figure("Opponent_Big", WHITE_BIG, _pictures(1, BIG_HEAD), -9),
        Figure("Player_Big", GREEN_BIG, _pictures(1, BIG_HEAD), 13),
        Figure("Opponent_Small", WHITE_SMALL, _pictures(0, SMALL_HEAD), 5),
        Figure("Player_Small", GREEN_SMALL, _pictures(0, SMALL_HEAD), -2),
    ),
    colors=COLORS,
    rows=(28, 182),
)


def _player(name: str, color: int) -> Bounds:
    return Bounds(color, COURT, filters=(Only(name, PLAYERS),))


BALL = Bounds(
    ORANGE, COURT, max_size=(6, 8), filters=(Ball(PLAYERS, part=(1, 3), whole=(2, 3), near=(4, 6)),)
)
GAME = Game(
    name="DoubleDunk",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player_Big", _player("Player_Big", GREEN), doc="green, tall"),
        Category("Opponent_Big", _player("Opponent_Big", WHITE), doc="white, tall"),
        Category("Player_Small", _player("Player_Small", GREEN), doc="green, short"),
        Category("Opponent_Small", _player("Opponent_Small", WHITE), doc="white, short"),
        Category("Ball", BALL, doc="the ball"),
        Category("Basket", Bounds(NET, (68, 40, 92, 56)), doc="the net"),
        Category("Backboard", Bounds(BOARD, (60, 24, 100, 45)), doc="the board"),
        display("Limit", LIMIT.rule(YELLOW), doc="points that win the game"),
        display("Shot_Clock", SHOT_CLOCK.rule(CLOCK_COLORS), doc="seconds left for a shot"),
        display("Player_Score", PLAYER_SCORE.rule(GREEN), doc="points of green"),
        display("Opponent_Score", OPPONENT_SCORE.rule(WHITE), doc="points of white"),
    ),
)
