"""Bowling: a bowler, the ball, ten pins; score, round and player's number above.

The two lines of the alley and the score sheet's marks (one for each round, below the score) are scenery.

RAM: ALE's source (score, round), OCAtari 2.2 and AtariARI (positions), and the ROM's code for the order of a frame: the throw's stage
is changed before a frame is drawn and its picture and places after it; after drawing, too, four of the pins move (each
in two frames of five) and the ball is pushed aside by a pin that it hits. `decode` takes all that back.

Covered: modes 0, 2 and 4 (ALE offers none for two players), both difficulties, whole games, strikes (the bowler jumps, he and the score
flash), game over. Not in the RAM, each for a single frame: that a throw has just begun (the bowler moves 4 pixels), the end of a throw
(drawn while all is already set up for the next one), where a pin was that has just left the alley.
"""

import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import DIGITS_3X5, Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category

BROWN, BLUE = 38, 132
FIELD, LINE = (8, 72, 160, 172), (0, 102, 160, 104)
NUMBERS = (DIGITS_3X5[0], "11111", *DIGITS_3X5[2:6], "74757", *DIGITS_3X5[7:9], "75717")
STANDING = 0xB8  # picture of the bowler, low byte of its address


class Ram(RamMap):
    frame = bits(0, count=4)
    stage = byte(13)  # 0 aiming, 1-4 swinging, 5 the ball rolls, 6 it comes back
    player_number = byte(15)
    player_x = byte(29)  # x - 8
    ball_x = byte(30)  # x - 7
    score = byte(33)
    hundreds = byte(38)
    round = bcd(36)
    sound = byte(37)  # 8 when a pin has just been hit
    player_y = byte(40)  # (141 - y) / 2
    ball_y = byte(41)  # (163 - y) / 2
    picture = byte(42)
    pin_clock = byte(46)  # the pin that moves next, counting down
    pin_y = byte(*range(47, 57))  # (169 - y) / 2
    pin_x = byte(*range(57, 67))  # (135 - x) / 2; 128 or more: gone
    pin_speed = byte(
        *range(67, 77)
    )  # to the right in the high nibble, upwards in the low one (signed)


def decode(m: Ram) -> dict[str, Box]:
    changed = (m.stage >= 2) & (m.stage <= 4) & (m.frame == 0)  # the stage before is still drawn
    stage = m.stage - 1
    x = jnp.where(changed, 8 + 4 * stage, m.player_x)
    standing = (m.picture == STANDING) & ~changed
    ball_x = jnp.where(changed, x + jnp.where(stage == 1, 8, -2), m.ball_x)
    ball_y = jnp.where(changed, m.player_y + jnp.where(stage == 1, 7, 2), m.ball_y)

    moves = (m.pin_speed > 0) & (m.pin_speed < 128)
    ahead = jnp.arange(10) - m.pin_clock
    moved = moves & (((ahead > 0) & (ahead < 5)) | (ahead < -5))  # the last four
    pin_x = m.pin_x + jnp.where(moved, m.pin_speed >> 4, 0)
    pin_y = m.pin_y - jnp.where(moved, ((m.pin_speed & 15) ^ 8) - 8, 0)

    column, above = (m.ball_x - 112) >> 1 ^ 7, pin_y - m.ball_y
    near = moves & ((pin_x == column) | (pin_x == column - 1)) & (m.sound == 8) & (m.stage == 5)
    ball_y = ball_y - jnp.where(jnp.any(near & (above >= -2) & (above <= 0)), 1, 0)
    ball_y = ball_y + jnp.where(jnp.any(near & (above >= 3) & (above <= 5)), 1, 0)

    tens, ones = m.score >> 4, m.score & 15
    top = jnp.where(m.hundreds > 0, m.hundreds, tens)  # the first digit
    left = jnp.where(m.hundreds > 0, 16, 32) + jnp.where(top == 1, 8, 0)
    ten = m.round >= 10
    round_x = jnp.where(ten, 24, jnp.where(m.round == 1, 40, 32))
    number_x = jnp.where(m.player_number == 0, 120, 112)
    return {
        "Player": box(
            x + jnp.where(standing, 10, 8), 141 - 2 * m.player_y, jnp.where(standing, 6, 8), 32
        ),
        "Ball": box(ball_x + 7, 163 - 2 * ball_y, 4, 10),
        "Pin": box(135 - 2 * pin_x, 169 - 2 * pin_y, 2, 4, m.pin_x < 128),
        "PlayerScore": box(left, 19, 60 - left, 15, value=100 * m.hundreds + 10 * tens + ones),
        "PlayerRound": box(round_x, 7, 44 - round_x, 10, value=jnp.minimum(m.round, 10)),
        "Player2Round": box(number_x, 7, 124 - number_x, 10, value=m.player_number + 1),
    }


def digits(top: int, height: int, *lefts: int) -> Digits:
    return Digits(hex_font(NUMBERS, 3, (4, height)), lefts, top)


GAME = Game(
    name="Bowling",
    rom="bowling",
    md5="c9b7afad3bfd922e006a6bfc1d4f3fe7",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Bounds((BROWN, BLUE), (8, 72, 48, 172), inverse=True),
            rgb=(84, 92, 214),
            doc="the bowler",
        ),
        Category(
            "Ball",
            Bounds(BLUE, FIELD, min_size=(4, 4), ignore=(LINE,), exclude=("Pin",)),
            doc="the ball",
        ),
        Category(
            "Pin",
            Blobs(BLUE, (100, 104, 160, 172), max_size=(2, 4)),
            count=10,
            doc="pins that stand or fall",
        ),
        Category(
            "PlayerScore",
            Bounds(BROWN, (16, 19, 60, 34), inverse=True, value=digits(19, 3, 16, 32, 48)),
            attributes=("value",),
            hud=True,
            rgb=(84, 92, 214),
            doc="points",
        ),
        Category(
            "PlayerRound",
            Bounds(BLUE, (16, 7, 44, 17), value=digits(7, 2, 16, 32)),
            attributes=("value",),
            hud=True,
            doc="the round, 1-10",
        ),
        Category(
            "Player2Round",
            Bounds(BLUE, (112, 7, 124, 17), value=digits(7, 2, 112)),
            attributes=("value",),
            hud=True,
            doc="whose turn it is",
        ),
    ),
)
