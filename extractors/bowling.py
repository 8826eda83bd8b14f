"""Bowling: a bowler, the ball and ten pins on an alley.

Picture: docs/games/Bowling.png

Screen: the score, the round and the current player's number are at the top. The two lines of the
alley and the marks of the score sheet (one per round, below the score) are scenery.

RAM: ALE's source (score, round), OCAtari 2.2 and AtariARI (positions), and the ROM's code for the
order of a frame. The stage of a throw changes before a frame is drawn. After the drawing, the
bowler's picture changes, bowler and ball move, four of the pins move (each in two frames of five),
and a pin that the ball hits pushes the ball up or down. `decode` reverts all of this.

Covered: modes 0, 2 and 4 (ALE has no mode for two players), both difficulties, whole games, strikes
(the bowler jumps, he and the score flash), the end of the game. In mode 2, the console crashes at
the end of a third of the games and leaves no game state in the RAM.

Not exact: the RAM lacks these facts, each for a single frame: the start of a throw (the bowler
moves 4 pixels), the end of a throw (the RAM is already set up for the next one), the position of a
pin that has just left the alley. The last frame of a game is such an end of a throw. The ROM has
put all ten pins back (at address F334), so fallen pins are reported too, unless the last round's
mark shows that all ten fell.
"""

import jax
import jax.numpy as jnp
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
    Saver,
    Shape,
    Variants,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    high,
    low,
    pick,
    signed_nibble,
    when,
)

ROM = Rom("bowling", "c9b7afad3bfd922e006a6bfc1d4f3fe7")


def _font_of(dot_height: int) -> Font:
    dot = (4, dot_height)
    return ROM.font(0x734, rows=5, dots=3, shift=1, dot=dot, pitch=16, top_first=True)


SCORE_FONT = _font_of(3)  # screen rows per row of the picture
ROUND_FONT = _font_of(2)  # the same digits, lower
SCORE = NumberDisplay(SCORE_FONT, right=60, top=19, digits=3)
ROUND = NumberDisplay(ROUND_FONT, right=44, top=7, digits=2)
TURN = NumberDisplay(ROUND_FONT, right=124, top=7, digits=1)


class Stage:  # of `Ram.stage`
    SWINGS = range(2, 5)  # after the first swing
    ROLLING = 5


STANDING = 0xB8  # `picture` of a standing bowler, 6 columns wide; the others have 8
PIN_HIT = 8  # `sound`
GONE = 128  # least `pin_x` of a pin that has left the alley
MOVING = range(1, 128)  # `pin_speed`
# A pin this far above the ball, in pairs of rows, pushes it up or down.
PUSHES_UP = range(-2, 1)
PUSHES_DOWN = range(3, 6)
LAST_ROUND = 10
SPARE = 64  # least `mark` of a spare or a strike
# As drawn at the end of the last throw.
LAST_BOWLER_X = 32
LAST_BALL_X = 12
LAST_BALL_Y = 161

BROWN = 38
BLUE = 132
BOWLER_RGB = (84, 92, 214)
ALLEY = (8, 72, 160, 172)
UPPER_LINE = (0, 102, 160, 104)
SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    frame = bits(0, count=4)  # a stage of a throw begins at 0
    stage = byte(13)  # 0 aiming, 1-4 swinging, 5 the ball rolls, 6 it comes back
    player_number = byte(15)  # the current player, from 0
    mark = byte(27)  # of the last round: a spare or a strike
    player_x = byte(29)  # x - 8
    ball_x = byte(30)  # x - 7
    saver_clock = byte(31)  # the screen saver's key while it is visible
    tens = high(33)  # of the score
    ones = low(33)  # of the score
    round = bcd(36)
    sound = byte(37)
    hundreds = byte(38)  # of the score
    player_y = byte(40)  # (141 - y) / 2
    ball_y = byte(41)  # (163 - y) / 2
    picture = byte(42)  # of the bowler, low byte of its address
    pin_clock = byte(46)  # the pin that moves next, counting down
    pin_y = byte(*range(47, 57))  # (169 - y) / 2
    pin_x = byte(*range(57, 67))  # (135 - x) / 2
    pin_speed = byte(*range(67, 77))  # high nibble: to the right; low nibble: upwards, signed
    saver_mask = byte(87)  # the game masks colours with it: 0xFF in play
    saver_key = byte(88)


def decode(m: Ram) -> dict[str, Box]:
    pin_x, pin_y = _pin_places(m)
    stands = (m.pin_x < GONE) & ~(_is_over(m) & (m.mark >= SPARE))
    return {
        "Player": _bowler(m),
        "Ball": _ball(m, pin_x, pin_y),
        "Pin": box(135 - 2 * pin_x, 169 - 2 * pin_y, 2, 4, stands),
        "PlayerScore": _score_box(m),
        "PlayerRound": _round_box(m),
        "Player2Round": TURN.box(m.player_number + 1),
    }


def _is_over(m: Ram) -> jax.Array:
    """True if the game has ended: the frame shows the end of the last throw."""
    return m.round > LAST_ROUND


def _stage_began(m: Ram) -> jax.Array:
    """True if a stage has just begun: bowler and ball are still drawn in the previous one."""
    return among(m.stage, Stage.SWINGS) & (m.frame == 0)


def _bowler_x(m: Ram) -> jax.Array:
    """The bowler's position as drawn; each stage adds 4 pixels."""
    return jnp.where(_stage_began(m), 8 + 4 * (m.stage - 1), m.player_x)


def _bowler(m: Ram) -> Box:
    stands = (m.picture == STANDING) & ~_stage_began(m) & ~_is_over(m)
    x = jnp.where(_is_over(m), LAST_BOWLER_X, _bowler_x(m) + jnp.where(stands, 10, 8))
    return box(x, 141 - 2 * m.player_y, jnp.where(stands, 6, 8), 32)


def _ball(m: Ram, pin_x: jax.Array, pin_y: jax.Array) -> Box:
    began = _stage_began(m)  # the bowler still holds it in front, or later behind him
    in_front = m.stage == Stage.SWINGS.start
    ball_x = jnp.where(began, _bowler_x(m) + jnp.where(in_front, 8, -2), m.ball_x)
    ball_y = jnp.where(began, m.player_y + jnp.where(in_front, 7, 2), m.ball_y)
    pushed_y = ball_y - _pushed_up(m, pin_x, pin_y)
    over = _is_over(m)
    x = jnp.where(over, LAST_BALL_X, ball_x + 7)
    y = jnp.where(over, LAST_BALL_Y, 163 - 2 * pushed_y)
    return box(x, y, 4, 10)


def _pushed_up(m: Ram, pin_x: jax.Array, pin_y: jax.Array) -> jax.Array:
    """Pairs of rows that pins have pushed the ball up after the drawing: 1, 0 or -1."""
    column = (m.ball_x - 112) >> 1 ^ 7  # of the ball, counted as `pin_x`
    hit = (m.stage == Stage.ROLLING) & (m.sound == PIN_HIT)
    touch = hit & _moves(m) & ((pin_x == column) | (pin_x == column - 1))
    above = pin_y - m.ball_y
    up = jnp.any(touch & among(above, PUSHES_UP))
    down = jnp.any(touch & among(above, PUSHES_DOWN))
    return when(up, 1) - when(down, 1)


def _moves(m: Ram) -> jax.Array:
    return among(m.pin_speed, MOVING)


def _pin_places(m: Ram) -> tuple[jax.Array, jax.Array]:
    """`pin_x` and `pin_y` as drawn: before the last move of the four pins that moved last."""
    ahead = jnp.arange(10) - m.pin_clock
    moved = _moves(m) & (among(ahead, range(1, 5)) | (ahead < -5))  # the clock wraps
    right = m.pin_speed >> 4
    up = signed_nibble(m.pin_speed & 15)
    return m.pin_x + when(moved, right), m.pin_y - when(moved, up)


def _score_box(m: Ram) -> Box:
    """The score, with at least two digits."""
    three = m.hundreds > 0
    first = jnp.where(three, m.hundreds, m.tens)
    cell = jnp.where(three, SCORE.lefts[0], SCORE.lefts[1])
    left = cell + pick(first, SCORE_FONT.left.tolist())
    value = 100 * m.hundreds + 10 * m.tens + m.ones
    return box(left, SCORE.top, SCORE.right - left, SCORE_FONT.height, value=value)


def _round_box(m: Ram) -> Box:
    """The round; after the game it stays at the last one."""
    return ROUND.box(jnp.minimum(m.round, LAST_ROUND))


LAST_MARK = (16, 72, 28, 76)  # of the score sheet
BOWLER_RULE = Bounds((BROWN, BLUE), (8, 72, 48, 172), inverse=True, ignore=(LAST_MARK,))
BALL_RULE = Bounds(BLUE, ALLEY, min_size=(4, 4), ignore=(UPPER_LINE,), exclude=("Pin",))
PINS = Blobs(BLUE, (100, 104, 160, 172), Shape(w=(1, 2), h=(1, 4)))
POINTS = Bounds(BROWN, SCORE.area, inverse=True, value=Digits(SCORE_FONT, SCORE.lefts, SCORE.top))


def _saver_key(m: Ram) -> jax.Array:
    """The key that colours are XORed with, or -1 in play."""
    shown = (m.saver_mask == SAVER_MASK) & (m.saver_clock == m.saver_key)
    return jnp.where(shown, m.saver_key, -1)


GAME = Game(
    name="Bowling",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (158, 208), 38, mask=SAVER_MASK),
    checks=Checks(
        # When a throw ends, the RAM has put back the pins and the ball.
        agreement={"last": 0.9, "modes": 0.89},
        miscounted={"PlayerScore": 1},  # the console crashes at the end of some games
    ),
    variants=Variants(
        modes={
            0: "the joystick bends the ball's path once",
            2: "the joystick steers the ball all the way",
            4: "the ball rolls straight",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        Category("Player", BOWLER_RULE, rgb=BOWLER_RGB, role="player", doc="the bowler"),
        Category("Ball", BALL_RULE, doc="the ball"),
        Category("Pin", PINS, count=10, doc="pins that stand or fall"),
        display("PlayerScore", POINTS, rgb=BOWLER_RGB, role="score", doc="points"),
        display("PlayerRound", ROUND.rule(BLUE), doc="the round, 1-10"),
        display("Player2Round", TURN.rule(BLUE), doc="whose turn it is"),
    ),
)
