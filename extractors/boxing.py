"""Boxing: a white and a black boxer in a ring from above; the scores and the clock are at the top.

Picture: docs/games/Boxing.png

Screen: a boxer is one object with both arms, at their current stretch. The box includes parts that
the other boxer hides. The chip draws a boxer in three pieces of 16 rows (arm, head, arm), and the
box is their union. The ring, the maker's name and the black edge are scenery.

RAM: ALE's source (scores, clock), OCAtari 2.2, AtariARI and a public disassembly by Dennis Debro
(names of the bytes), and the ROM's display program for the pieces. Their rows and pictures (bytes
65-80) agree with the screen, also while a hit pushes a boxer back. Only the clock changes after the
frame is drawn.

Covered: all four difficulties, both boxers on both sides, hits, the end of the time, and the
knock-out (100 points, displayed as KO, which VEM reads as 0). The game has one mode.

Not exact: nothing known.
"""

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    UNKNOWN_VALUE,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    RamMap,
    Rom,
    Variants,
    bcd,
    box,
    byte,
    choose,
    display,
    edges,
    high,
    score_box,
)

ROM = Rom("boxing", "c3ef5c4653212088eda54dc91d787870")
FONT = ROM.font(0x400, rows=7, stride=1, step=17)  # all digits are equally wide

# Records in the RAM.
WHITE_BOXER = 0
BLACK_BOXER = 1
FIRST_ARM = 95  # pictures of the resting arms
SECOND_ARM = 191  # stretched arms follow
# Offsets of a stretching arm's picture from these.
BENT = 16
HALF = 32
FULL = 48
HEAD_HIT = 175  # picture of a boxer's head just after a hit
KNOCK_OUT = 0xC0  # `score`
KNOCK_OUT_POINTS = 100
TICK = 59  # `frames` on which the clock has just moved, but is drawn as before

WHITE = 12
BLACK = 0
GREEN = 208
RING = (8, 24, 160, 186)
# left columns
WHITE_DIGITS = (38, 46)
BLACK_DIGITS = (102, 110)
CLOCK_DIGITS = (62, 78, 86)
SCORE_TOP = 5
CLOCK_TOP = 17


class Ram(RamMap):
    minutes = high(16)
    seconds = bcd(17)
    score = byte(18, 19)  # BCD, or KNOCK_OUT
    points = bcd(18, 19)
    tens = high(18, 19)  # of the points
    frames = byte(20)  # remaining frames of the second, minus 1
    x = byte(32, 33)
    top = byte(65, 69)  # row of the first arm's piece in the ring
    bottom = byte(67, 71)  # row of the second arm's piece in the ring
    first_arm = byte(73, 77)  # picture of the arm drawn above the head
    head = byte(74, 78)  # its picture, 159 or HEAD_HIT
    second_arm = byte(75, 79)  # picture of the arm drawn below the head
    white_is_right = byte(84)  # 1: the white boxer is on the right, facing left


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _boxer(m, WHITE_BOXER, m.white_is_right == 1),
        "Enemy": _boxer(m, BLACK_BOXER, m.white_is_right == 0),
        "PlayerScore": _score(m, WHITE_BOXER, WHITE_DIGITS),
        "EnemyScore": _score(m, BLACK_BOXER, BLACK_DIGITS),
        "Clock": _clock_box(m),
    }


def _boxer(m: Ram, who: int, faces_left: jax.Array) -> Box:
    """The union of head and arms, which stretch towards the other boxer."""
    first = m.first_arm[who] - FIRST_ARM
    second = m.second_arm[who] - SECOND_ARM
    reach = _arm_reach(first, second)
    back = _empty_columns(first, second, m.head[who] == HEAD_HIT)
    near = jnp.where(jnp.maximum(first, second) < HALF, 1, 0)  # mirrored, a column less
    left = jnp.where(faces_left, 20 + near - reach, 4 + back)
    right = jnp.where(faces_left, 18 - back, reach + 1)
    top = m.top[who] + jnp.where(faces_left, 37, 38) + jnp.where(first >= HALF, 1, 0)
    bottom = m.bottom[who] + jnp.where(faces_left, 50, 51) - jnp.where(second >= HALF, 1, 0)
    return edges(m.x[who] + left, top, m.x[who] + right, bottom)


def _arm_reach(first: jax.Array, second: jax.Array) -> jax.Array:
    """Columns that the longer arm reaches."""
    both_bent = (first == BENT) & (second == BENT)
    longest = jnp.maximum(first, second)
    resting = jnp.where(both_bent, 16, 18)
    return jnp.where(longest == FULL, 34, jnp.where(longest == HALF, 25, resting))


def _empty_columns(first: jax.Array, second: jax.Array, hit: jax.Array) -> jax.Array:
    """Empty columns on the side away from the other boxer."""
    both_stretched = (first > BENT) & (second > BENT)
    return jnp.where(hit, 0, jnp.where(both_stretched, 3, 1))


def _score(m: Ram, who: int, lefts: tuple[int, int]) -> Box:
    """The score; two cells for at least 10 points, or the letters KO a column further left."""
    right = lefts[-1] + FONT.width
    digits = score_box(
        FONT, 10 * m.tens[who], right=right, top=SCORE_TOP, digits=2, value=m.points[who]
    )
    letters = box(lefts[0], SCORE_TOP, 15, FONT.height, value=KNOCK_OUT_POINTS)
    return choose(m.score[who] == KNOCK_OUT, letters, digits)


def _clock_box(m: Ram) -> Box:
    shown = 60 * m.minutes + m.seconds + jnp.where(m.frames == TICK, 1, 0)
    return box(63, CLOCK_TOP, 30, FONT.height, value=shown)


WHITE_SCORE = Bounds(WHITE, (38, 5, 54, 12), value=Digits(FONT, WHITE_DIGITS, SCORE_TOP))
BLACK_SCORE = Bounds(BLACK, (102, 5, 118, 12), value=Digits(FONT, BLACK_DIGITS, SCORE_TOP))
CLOCK = Bounds(
    GREEN, (62, 17, 94, 24), value=Digits(FONT, CLOCK_DIGITS, CLOCK_TOP, weights=(60, 10, 1))
)

GAME = Game(
    name="Boxing",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        at_limits={"PlayerScore": ((100, UNKNOWN_VALUE),)},  # shown as KO
    ),
    variants=Variants(
        difficulties={
            0: "both boxers at full speed",
            1: "the player is slower",
            2: "the opponent is slower",
            3: "both are slower",
        },
        source="play of all difficulties in the emulator",
    ),
    categories=(
        Category(
            "Player", Bounds(WHITE, RING), role="player", doc="the white boxer, both arms included"
        ),
        Category("Enemy", Bounds(BLACK, RING), doc="the black boxer, both arms included"),
        display("PlayerScore", WHITE_SCORE, role="score", doc="white's points"),
        display("EnemyScore", BLACK_SCORE, role="opponent_score", doc="black's points"),
        display("Clock", CLOCK, role="time", doc="seconds left"),
    ),
)
