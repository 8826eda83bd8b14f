"""Boxing: a white and a black boxer in a ring, seen from above; both scores and the clock above it.

A boxer is one object with both arms, as far as they are stretched; what the other boxer hides still belongs to the box. The chip draws
him in three pieces of 16 rows (arm, head, arm), so the box is the union of theirs. Scenery: the ring, the maker's name, the black edge.

RAM: ALE's source (scores, clock), OCAtari 2.2, AtariARI and a public disassembly by Dennis Debro (names of the bytes); the ROM's
display program for the pieces: their rows and pictures (bytes 65-80) are those of the frame on the screen, also while a boxer who was
hit is pushed back. The clock is the only thing that runs on after the frame is drawn.

Covered: all four difficulties, both sides of each other, hits, knock-out (100 points, shown as KO, which VEM reads as 0), the end
of the time. There is one mode.
"""

import jax
import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, byte, high
from ocjax.rules import Bounds, Category

WHITE, BLACK, GREEN = 12, 0, 208
RING = (8, 24, 160, 186)
GLYPHS = ("3c66666666663c", "3878181818187e", "7c46063c60607e", "3c46060c06463c", "0c1c2c4c7e0c0c",
          "7e60607c06467c", "3c62607c66663c", "7e42060c181818", "3c66663c66663c", "3c66663e06463c")  # fmt: skip
KNOCK_OUT = 0xC0


class Ram(RamMap):
    minutes = high(16)
    seconds = bcd(17)
    score = byte(18, 19)  # BCD, or 0xC0: knock-out
    frames = byte(20)  # of the second that are left, minus 1
    x = byte(32, 33)
    top = byte(65, 69)  # of the first arm's piece, from the ring's
    bottom = byte(67, 71)  # of the second arm's piece
    first_arm = byte(73, 77)  # picture: 95 + 16 * stretch, 0-3
    head = byte(74, 78)  # 159, or 175 just hit
    second_arm = byte(75, 79)  # 191 + 16 * stretch
    white_is_right = byte(84)


def decode(m: Ram) -> dict[str, Box]:
    ko = m.score == KNOCK_OUT
    points = jnp.where(ko, 100, (m.score >> 4) * 10 + (m.score & 15))
    two = m.score >= 16
    x, w = jnp.array([47, 111]) - jnp.where(two, 8, 0), jnp.where(two, 14, 6)
    return {
        "Player": _boxer(m, 0, m.white_is_right == 1),
        "Enemy": _boxer(m, 1, m.white_is_right == 0),
        "PlayerScore": box(x[0], 5, w[0], 7, value=points[0]),
        "EnemyScore": box(x[1], 5, w[1], 7, value=points[1]),
        "Clock": box(
            63, 17, 30, 7, value=60 * m.minutes + m.seconds + jnp.where(m.frames == 59, 1, 0)
        ),
    }


def _boxer(m: Ram, i: int, faces_left: jax.Array) -> Box:
    one, two, hit = m.first_arm[i] - 95, m.second_arm[i] - 191, m.head[i] == 175
    most = jnp.maximum(one, two)
    back = jnp.where(
        hit, 0, jnp.where((one > 16) & (two > 16), 3, 1)
    )  # the side away from the other boxer
    bent = jnp.where((one == 16) & (two == 16), 2, 0)
    reach = jnp.where(most == 48, 34, jnp.where(most == 32, 25, 18 - bent))
    rest = jnp.where(most < 32, 1, 0)
    left, right = (
        jnp.where(faces_left, 20 + rest - reach, 4 + back),
        jnp.where(faces_left, 18 - back, reach + 1),
    )
    top = m.top[i] + jnp.where(faces_left, 37, 38) + jnp.where(one >= 32, 1, 0)
    bottom = m.bottom[i] + jnp.where(faces_left, 50, 51) - jnp.where(two >= 32, 1, 0)
    return box(m.x[i] + left, top, right - left, bottom - top)


def digits(*lefts: int) -> Digits:
    return Digits(
        hex_font(GLYPHS),
        lefts,
        5 if len(lefts) == 2 else 17,
        (10, 1) if len(lefts) == 2 else (60, 10, 1),
    )


GAME = Game(
    name="Boxing",
    rom="boxing",
    md5="c3ef5c4653212088eda54dc91d787870",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Bounds(WHITE, RING), doc="the white boxer, both arms included"),
        Category("Enemy", Bounds(BLACK, RING), doc="the black boxer, both arms included"),
        Category(
            "PlayerScore",
            Bounds(WHITE, (38, 5, 54, 12), value=digits(38, 46)),
            attributes=("value",),
            hud=True,
            doc="white's points",
        ),
        Category(
            "EnemyScore",
            Bounds(BLACK, (102, 5, 118, 12), value=digits(102, 110)),
            attributes=("value",),
            hud=True,
            doc="black's points",
        ),
        Category(
            "Clock",
            Bounds(GREEN, (62, 17, 94, 24), value=digits(62, 78, 86)),
            attributes=("value",),
            hud=True,
            doc="seconds left",
        ),
    ),
)
