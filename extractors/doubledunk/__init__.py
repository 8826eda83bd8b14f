"""Double Dunk: two teams of two players, a ball, a basket, the scores, and the limits of the game.

Picture: docs/games/DoubleDunk.png

Screen: the court, the poles and the texts at the bottom (offence and defence, fouls, calls) are
scenery. The menu of options is a screen that does not appear in the emulator's modes.

Slots: Player is the green team, Opponent the white one; Big and Small are its two players.

Files: `ram` has the RAM map and the meaning of its values, `pictures` the figures' pictures,
`lines` their visible lines, `drawn` the players as drawn, and `ball` the ball's steps. For VEM,
`figures` finds players in frames (`kinds` has their looks, `strips` and `fitting` the two steps of
the search), and `vision` selects the pixels of a player and of the ball.

RAM: ALE's source (scores), OCAtari 2.2 (positions, pictures), and the ROM's code. Each of the two
sprites draws two figures, one below the other. Bytes 41, 48-51, 53-56 and 58-81 hold the figures as
drawn, from the top, and change only when the game makes the next frame. If the figures of a sprite
overlap, the sprite skips a part of the upper or the lower one, alternately. A box therefore has
only the drawn lines. The players themselves (bytes 29-40) have moved since; they assign figures of
one size to players. A player who is not drawn has a box at his current position. The game places
the ball's sprite, moves the ball, and then draws it, so its column is one step older than its
lines.

Covered: all modes, possession, fouls, free throws, the end of the game.

Not exact: the ball's column, on one of twenty frames. The RAM holds the current push of the player
with the ball, but not the push before, and not the frame on which he begins to dribble, jump or
pass. A line of a player or of the ball may be wrong if the ends of both sprites are close together,
or where the upper part of the court begins.

VEM: it identifies a figure by the colours of its rows, and by the picture that covers most of its
pixels. It misses a figure with few drawn lines, or takes a few lines of another figure for it. It
misses the ball among pixels of players in the ball's colours.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    NumberDisplay,
    Searched,
    Variants,
    Word,
    box,
    display,
    meanings_of_bits,
    only,
    when,
)
from ocjax.extractors.doubledunk.ball import ball_step, looks_at_ball
from ocjax.extractors.doubledunk.drawn import FIRST_COLUMN, Drawn, as_drawn
from ocjax.extractors.doubledunk.figures import Figures
from ocjax.extractors.doubledunk.kinds import Figure
from ocjax.extractors.doubledunk.lines import top_seen
from ocjax.extractors.doubledunk.pictures import (
    BIG_PICTURES,
    EXTENTS,
    NO_PICTURE,
    PICTURE_LINES,
    SMALL_PICTURES,
    extent_index,
    is_big,
)
from ocjax.extractors.doubledunk.ram import ROM, Ram, Who
from ocjax.extractors.doubledunk.vision import BallPixels, InBox

FONT = ROM.font(0x801, rows=7, stride=8)
SMALL_FONT = ROM.font(0x859, rows=7, stride=8, dots=3, shift=5, pitch=4)

COURT = (8, 28, 152, 180)
WHITE = 14
GREEN = 180
ORANGE = 34
BOARD = 12
SQUARE = 50  # on the board
NET = 22
YELLOW = 30
CLOCK_COLORS = (12, 4)  # with a shot clock, without

LINE_0 = 181  # screen row of line 0; the game counts lines upwards
UNEQUAL = 2 * np.arange(4) + 1  # added to eightfold distances to make them all different
FULL_WIDTH = 8  # of players who are not drawn
HEIGHTS = np.array((23, 23, 19, 19))  # of players who are not drawn, by `Who`
BASKET_BOX = (76, 42, 8, 9)
BOARD_BOX = (68, 28, 24, 16)
BOX_WORD = Word(x=8, y=8, w=8, h=8)  # selecting one number is faster than selecting four
LIMIT = NumberDisplay(SMALL_FONT, right=43, top=18, digits=2)
SHOT_CLOCK = NumberDisplay(SMALL_FONT, right=115, top=18, digits=2)
PLAYER_SCORE = NumberDisplay(FONT, right=52, top=9, digits=2)
OPPONENT_SCORE = NumberDisplay(FONT, right=116, top=9, digits=2)


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    players = _player_boxes(m, drawn)
    return {
        "Player_Big": players[Who.GREEN_BIG],
        "Opponent_Big": players[Who.WHITE_BIG],
        "Player_Small": players[Who.GREEN_SMALL],
        "Opponent_Small": players[Who.WHITE_SMALL],
        "Ball": _ball_box(m, drawn),
        "Basket": box(*BASKET_BOX),
        "Backboard": box(*BOARD_BOX),
        "Limit": LIMIT.box(m.limit),
        "Shot_Clock": SHOT_CLOCK.box(m.shot_clock, color=_clock_color(m)),
        "Player_Score": PLAYER_SCORE.box(m.score[0]),
        "Opponent_Score": OPPONENT_SCORE.box(m.score[1]),
    }


def _clock_color(m: Ram) -> jax.Array:
    return jnp.where(m.clock_runs, *CLOCK_COLORS)


def _player_boxes(m: Ram, drawn: Drawn) -> Box:
    """Each player as drawn; a player who is not drawn is complete, at his current position."""
    is_his = _whose(m, drawn)
    of_figure = only(is_his, _packed(_figure_boxes(m, drawn))[None], axis=1)
    whole = box(m.x + FIRST_COLUMN, LINE_0 - m.y - HEIGHTS, FULL_WIDTH, HEIGHTS)
    word = jnp.where(jnp.any(is_his, axis=1), of_figure, _packed(whole))
    sides = BOX_WORD.unpack(word)
    return box(sides.x, sides.y, sides.w, sides.h)


def _figure_boxes(m: Ram, drawn: Drawn) -> Box:
    """The figures in the order of drawing, with their drawn lines."""
    lines = drawn.lines
    top = LINE_0 - PICTURE_LINES + 1 - drawn.feet
    highest = lines.first - drawn.feet
    index = extent_index(drawn.figure, drawn.mirrored, lines.lowest, highest)
    extent = EXTENTS.at(index, x=drawn.x, y=top)
    lost = LINE_0 - extent.y - top_seen(m, lines, LINE_0 - extent.y)
    return extent.trimmed(top=lost, bottom=when(lines.repeats, -1))


def _packed(of: Box) -> jax.Array:
    return BOX_WORD.pack(x=of.x, y=of.y, w=of.w, h=jnp.maximum(of.h, 0))


def _whose(m: Ram, drawn: Drawn) -> jax.Array:
    """True for a figure that is the player, bool `[player, slot]`.

    Each of two figures of one size belongs to the team with the nearer player, compared with the
    other figure.
    """
    across = jnp.abs(drawn.x[None] - m.x[:, None] - FIRST_COLUMN)
    along = jnp.abs(drawn.feet[None] - m.y[:, None])
    to_green = (across + along)[::2]  # of the big and the small player
    to_white = (across + along)[1::2]
    nearer = 8 * (to_green - to_white) + UNEQUAL[None]  # smaller if nearer to green
    of_size = is_big(drawn.figure)[None] == np.array(((True,), (False,)))
    fits = (drawn.figure != NO_PICTURE)[None] & of_size
    the_other = jnp.sum(when(fits, nearer), axis=1)[:, None] - nearer
    players = jnp.stack([fits & (nearer < the_other), fits & (nearer > the_other)], axis=1)
    return players.reshape(4, 4)


def _ball_box(m: Ram, drawn: Drawn) -> Box:
    """The ball, alternately 2 x 6 and 4 x 4 pixels."""
    wide = (m.frame & 1) == 0
    x = m.ball_x - ball_step(m) + jnp.where(wide, 12, 13)
    line, beam = looks_at_ball(m, drawn.lines, jnp.stack([m.ball_top, m.ball_bottom]) - 1)
    y = LINE_0 - line + when(x[None] < beam, 1)
    return box(x, y[0], jnp.where(wide, 4, 2), y[1] - y[0]).clip(*COURT)


def _row_colors(*runs: tuple[int, int]) -> tuple[int, ...]:
    """The colours of a figure's rows from the top, given as runs of rows."""
    return tuple(COLORS.index(color) for count, color in runs for _ in range(count))


WHITE_BIG_SKIN = 226
SKIN = 232  # of the three others
COLORS = (ORANGE, WHITE, 82, GREEN, 252, 52, WHITE_BIG_SKIN, SKIN)
STRIPES = ((1, 52), (1, 252), (1, GREEN), (1, 82))  # rows and colour of each, from the top
# fmt: off
WHITE_BIG = _row_colors(
    (8, WHITE_BIG_SKIN), (2, WHITE), *STRIPES, (5, WHITE), (5, WHITE_BIG_SKIN), (1, 82), (2, WHITE)
)
WHITE_SMALL = _row_colors(
    (1, ORANGE), (8, SKIN), (1, WHITE), *STRIPES, (3, WHITE), (4, SKIN), (1, 82), (2, WHITE)
)
GREEN_BIG = _row_colors(
    (8, SKIN), (7, GREEN), (1, WHITE), (3, GREEN), (5, SKIN), (1, WHITE), (2, GREEN)
)
GREEN_SMALL = _row_colors(
    (1, ORANGE), (8, SKIN), (5, GREEN), (1, WHITE), (2, GREEN), (4, SKIN), (1, WHITE), (2, GREEN)
)
# fmt: on
FIGURE_SEARCH = Figures(
    kinds=(
        Figure("Opponent_Big", WHITE_BIG, BIG_PICTURES, 1),
        Figure("Player_Big", GREEN_BIG, BIG_PICTURES, 13),
        Figure("Opponent_Small", WHITE_SMALL, SMALL_PICTURES, 6),
        Figure("Player_Small", GREEN_SMALL, SMALL_PICTURES, 5),
    ),
    colors=COLORS,
    rows=(28, 182),
)


GREEN_COLORS = (GREEN, SKIN, WHITE)
STRIPED = (WHITE, *(color for _, color in STRIPES))


def _player(name: str, color: int) -> Bounds:
    return Bounds(color, COURT, filters=(Searched(FIGURE_SEARCH, InBox(name)),))


BALL_RULE = Bounds(
    ORANGE,
    COURT,
    max_size=(6, 8),
    filters=(
        Searched(
            FIGURE_SEARCH,
            BallPixels(
                FIGURE_SEARCH.rows, part=(1, 3), whole=(2, 3), near=(3, 5), low=4, widths=(4, 2)
            ),
        ),
    ),
)
GAME = Game(
    name="DoubleDunk",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        agreement={"modes": 0.96},  # figures that cover each other
    ),
    variants=Variants(
        modes=meanings_of_bits(
            ("3-point shots", "10-second rule", "3-second rule", "fouls"),
            otherwise="none of these options",
        ),
        source="ALE's source code",
    ),
    categories=(
        Category(
            "Player_Big",
            _player("Player_Big", GREEN),
            colors=GREEN_COLORS,
            role="player",
            doc="green, tall",
        ),
        Category(
            "Opponent_Big",
            _player("Opponent_Big", WHITE),
            colors=(*STRIPED, WHITE_BIG_SKIN),
            doc="white, tall",
        ),
        Category(
            "Player_Small",
            _player("Player_Small", GREEN),
            colors=(*GREEN_COLORS, ORANGE),
            role="player",
            doc="green, short",
        ),
        Category(
            "Opponent_Small",
            _player("Opponent_Small", WHITE),
            colors=(*STRIPED, SKIN, ORANGE),
            doc="white, short",
        ),
        # The ball's rows have the colour of a player on these rows.
        Category("Ball", BALL_RULE, colors=COLORS, doc="the ball"),
        Category("Basket", Bounds(NET, (68, 40, 92, 56)), doc="the net"),
        Category(
            "Backboard", Bounds(BOARD, (60, 24, 100, 45)), colors=(BOARD, SQUARE), doc="the board"
        ),
        display("Limit", LIMIT.rule(YELLOW), doc="points that win the game"),
        display(
            "Shot_Clock", SHOT_CLOCK.rule(CLOCK_COLORS), role="time", doc="seconds left for a shot"
        ),
        display("Player_Score", PLAYER_SCORE.rule(GREEN), role="score", doc="points of green"),
        display(
            "Opponent_Score",
            OPPONENT_SCORE.rule(WHITE),
            role="opponent_score",
            doc="points of white",
        ),
    ),
)
