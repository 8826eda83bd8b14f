"""Ice Hockey: two teams of two players, a puck, both scores and the clock.

Picture: docs/games/IceHockey.png

Screen: the ice, the two goals (black, so they hide a puck) and the maker's name are scenery. A
player's box includes his stick. Only the player nearer to the puck holds his stick out. If a blue
player covers a part of a yellow one, the yellow box still includes that part. The puck's box
excludes the row that the blade of a stick covers.

Slots: Player is the blue team, which defends the upper goal, Enemy the yellow one. Slot 0 of a team
is its upper player, slot 1 its lower one.

RAM: ALE's source (scores, clock), OCAtari 2.2 (positions), and the ROM's code. The players move
before a frame is drawn, so the RAM has their drawn positions. The puck, the scores and the clock
move afterwards, and `decode` undoes that: a free puck's last step with its velocity. After a
bounce, or while a player carries the puck, the RAM leaves a few possible positions. The game stores
the distances from the drawn puck to the lower players, and these select one of them.

Covered: modes 0 and 2, all four difficulties, goals of both sides, fights, the end of the game.

Not exact, because the RAM does not have it: all positions in the one frame after the pause for a
goal (the game draws it before the next face-off, but then stores the positions of the face-off);
the puck's position in the one frame when a player takes it, and at times when it bounces or its
carrier turns round.

VEM: it joins the head of a blue player to a yellow player that he touches, because all heads have
one colour.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Digits,
    Game,
    NumberDisplay,
    Raised,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    mod,
    score_box,
    signed,
    when,
)

ROM = Rom("ice_hockey", "a4c08c4994eb9d24fb78be1793e82e26")
FONT = ROM.font(0xF5E, rows=7)
SCORE_FONT = ROM.font(0xF5E, rows=7, pitch=9)

RINK = (32, 22, 128, 188)  # the players' heads extend beyond the ice
ICE = (32, 42, 128, 187)
GOALS = ((64, 42, 96, 46), (64, 184, 96, 187))
HEAD_ROWS = 4  # with the gap below it
BLACK = 0
RED = 68
HEAD = 70
BLUE = 132
GREEN = 212
CREAM = 250
YELLOW = 252
BLUE_DIGITS = 136
YELLOW_DIGITS = 46
BLUE_RGB = (45, 50, 184)
YELLOW_RGB = (232, 204, 99)
CLOCK_TOP = 5
CLOCK_LEFTS = (64, 80, 88)  # a colon between the first two
PLAYER_SCORE = NumberDisplay(SCORE_FONT, right=53, top=14, digits=2)
ENEMY_SCORE = NumberDisplay(SCORE_FONT, right=117, top=14, digits=2)

PAGES = {0xA6: 0x100, 0xB9: 0x100, 0x4A: 0xF00}  # pages of the pictures that are not at 0xE00
PICTURES = ROM.pictures([PAGES.get(low, 0xE00) + low + 1 for low in range(256)], 19)

# Teams.
BLUES = 0
YELLOWS = 1


class Pause:  # of `Ram.pause`
    OVER = 0  # the game is over
    BEGINS = 64
    PLAYING = 128  # at least


NO_PLAYER = 128  # least `holder` of a free puck
JUST_SHOT = 48  # `hold_off`
GOAL_Y = 144  # least `puck_y` in the upper goal
NOT_SHOWN = 100  # least number that is not shown
STICK_COLUMNS = np.array((16, 15, 16, 15))  # columns of an outstretched stick, by player
BLADE_WIDTH = 4  # columns of a stick's last row
LONGER_STICK = 17  # rows from yellow's upper player down to `upper_end` when his stick is longer

# Offsets of the puck's position before the frame, likely ones first. For a carried puck: columns
# against the carrier's direction, rows, and whether he has turned. For a free puck: columns and
# rows from the position that its velocity gives.
PLACES = np.arange(12)
HELD_DX = np.array([0, 1, 0, 1, 0, 1, -1, -1, -1, 1, 1, 1])
HELD_UP = np.array([0, 0, -2, -2, 2, 2, 0, -2, 2, 0, -2, 2])
TURNED = PLACES >= 9
FREE_DX = np.array([0, 0, 0, 1, -1, 1, 1, -1, -1, 2, -2, 2])
FREE_UP = np.array([0, 2, -2, 0, 0, 2, -2, 2, -2, 0, 0, 2])
# Penalties of a position. A wrong distance outweighs the order of the positions; an impossible move
# outweighs both.
WRONG_WEIGHT = 16
IMPOSSIBLE = 64


class Ram(RamMap):
    frame = byte(4)
    pause = byte(5)  # frames until the next play; 0: the game is over; 128 and above: play
    seconds = bcd(6)
    minutes = bcd(7)
    score = bcd(10, 11)  # player's, enemy's
    distance = byte(15, 16)  # of the drawn puck from each lower player: columns plus rows
    holder_last = bits(45, count=2)  # the player who shot
    hold_off = byte(46)  # frames until that player may take the puck again
    second_part = byte(47)  # elapsed frames of the second
    goal = byte(48)  # nonzero after a goal
    puck_y = byte(51)  # 188 - y
    puck_x = byte(52)  # x + 10
    puck_fixed = byte((51, 49), (52, 50))  # y, x in 1/256
    # Players in the order blue upper, yellow upper, blue lower, yellow lower:
    y = byte(53, 54, 55, 56)  # 169 (blue) or 168 - y
    x = byte(57, 58, 59, 60)  # x + 9
    faces_left = bits(61, 62, 63, 64, first=3)
    picture = byte(66, 68, 70, 72)  # low byte of its address
    stick = flag(82, 83, 84, 85, bit=1)  # held out
    holder = byte(90)  # the player with the puck
    puck_row = byte(91)  # 188 - y, even; follows `puck_y` every other frame
    upper_end = byte(94)  # row count at the end of the drawing of blue's upper player
    puck_speed = signed((96, 98), (97, 99))  # y, x in 1/256
    dribble = byte(110)  # 63-0: the puck goes along the stick and back


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _team_boxes(m, BLUES),
        "Enemy": _team_boxes(m, YELLOWS),
        "Ball": _puck(m),
        "PlayerScore": _score(m, BLUES, PLAYER_SCORE),
        "EnemyScore": _score(m, YELLOWS, ENEMY_SCORE),
        "Timer": _clock_box(m),
    }


def _team_boxes(m: Ram, team: int) -> Box:
    """A team's players. The chip draws a blue player's picture a row later than his stick."""
    x = m.x[team::2] - 9
    faces_left = m.faces_left[team::2] == 1
    first, _, width, _ = PICTURES.extent(m.picture[team::2])
    body = jnp.where(faces_left, 8 - first - width, first)
    stick = m.stick[team::2]
    reach = _stick_reach(m)[team::2]
    left = jnp.where(stick & faces_left, 9 - reach, body)
    right = jnp.where(stick & ~faces_left, reach, body + width)
    top = 169 - team - m.y[team::2]
    bottom = 189 - m.y[team::2]
    return box(x + left, top, right - left, jnp.where(stick, bottom - top, 19))


def _stick_reach(m: Ram) -> jax.Array:
    """Columns from a player's left side to the end of a stick that he holds out to the right."""
    longer = (m.upper_end - m.y[1] == LONGER_STICK) & (np.arange(4) == 1)
    return when(longer, 1) + STICK_COLUMNS


def _just_scored(m: Ram) -> jax.Array:
    return (m.pause == Pause.BEGINS) & (m.goal != 0)


def _puck(m: Ram) -> Box:
    x, y = _puck_drawn(m)
    left = x - 10
    reach = _stick_reach(m)  # the blade of a stick covers the puck's lower row
    blade = m.x - 9 + jnp.where(m.faces_left == 1, 9 - reach, reach - BLADE_WIDTH)
    under = m.stick & (y - 1 == m.y) & (blade <= left) & (left + 2 <= blade + BLADE_WIDTH)
    return box(left, 188 - y, 2, jnp.where(jnp.any(under), 1, 2)).clip(*ICE)


def _puck_drawn(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The puck's drawn position, x + 10 and 188 - y.

    It is the first possible position with the distances that the game stored.
    """
    held = (m.holder < NO_PLAYER) | (m.hold_off == JUST_SHOT)
    odd = (m.frame & 1) == 1  # a free puck moves in these frames
    x, y = _candidates(m, held, odd)
    wrong = sum(when(_distance(m, i, x, y) != m.distance[i], WRONG_WEIGHT) for i in range(2))
    possible = odd & (~held | ((m.frame & 3) == 1)) | (PLACES == 0)
    order = PLACES + wrong + jnp.where(possible, 0, IMPOSSIBLE)
    best = order == jnp.min(order)
    best_x = jnp.sum(when(best, x))
    best_y = jnp.sum(when(best, y))
    moved = (m.pause >= Pause.PLAYING) | _just_scored(m)
    return jnp.where(moved, best_x, m.puck_x), jnp.where(moved, best_y, m.puck_row)


def _candidates(m: Ram, held: jax.Array, odd: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Candidates for the puck's drawn position, x + 10 and 188 - y."""
    held_x, held_y = _held_places(m, odd)
    y_before, x_before = (m.puck_fixed - m.puck_speed) >> 8
    free_x = jnp.where(odd, x_before, m.puck_x) + FREE_DX
    free_y = jnp.where(odd, (y_before & 254) + FREE_UP, m.puck_row)
    return jnp.where(held, held_x, free_x) & 255, jnp.where(held, held_y, free_y) & 255


def _held_places(m: Ram, odd: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Candidates for a puck that a player carries or has just shot."""
    holder = jnp.where(m.holder < NO_PLAYER, m.holder & 3, m.holder_last)
    chosen = np.arange(4) == holder
    holder_x = jnp.sum(when(chosen, m.x))
    holder_y = jnp.sum(when(chosen, m.y))
    left = jnp.sum(when(chosen, m.faces_left)) == 1
    phase = ((m.dribble + 1) & 63) >> 2
    step = jnp.where(phase >= 8, phase ^ 15, phase)
    ahead = jnp.where(left, -2 - step, 11 + step)
    x = holder_x + jnp.where(TURNED, 9 - ahead, ahead) + jnp.where(left, HELD_DX, -HELD_DX)
    row = holder_y + 2 * (holder & 1)
    return x, jnp.where(odd, (row & 254) + HELD_UP, m.puck_row)


def _distance(m: Ram, i: int, x: jax.Array, y: jax.Array) -> jax.Array:
    """The game's distance from a position to a lower player; it takes ~n as the amount of -n."""
    dx = x - m.x[2 + i]
    dy = y - m.y[2 + i]
    return (jnp.where(dx < 0, ~dx, dx) + jnp.where(dy < 0, ~dy, dy)) & 255


def _score(m: Ram, team: int, display_of: NumberDisplay) -> Box:
    """The score; its digits lag behind a goal by a frame."""
    value = m.score[team]
    mine = (m.puck_y >= GOAL_Y) == (team == YELLOWS)
    shown = jnp.where(_just_scored(m) & mine, jnp.maximum(value - 1, 0), value)
    return display_of.box(shown, value=value, valid=value < NOT_SHOWN)


def _clock_box(m: Ram) -> Box:
    """The clock as drawn; it runs on after the frame is drawn."""
    counted = 60 * m.minutes + m.seconds
    runs = (m.pause >= Pause.PLAYING) | ((m.pause == Pause.OVER) & (counted == 0))
    left = counted + when((m.second_part == 0) & runs, 1)
    return score_box(
        FONT,
        1000 * div(left, 60) + mod(left, 60),
        right=CLOCK_LEFTS[-1] + FONT.width,
        top=CLOCK_TOP,
        digits=4,
        leading_zeros=True,
        value=left,
        valid=m.minutes < NOT_SHOWN,
    )


HEADED = Raised(HEAD_ROWS)
BLUE_TEAM = Blobs((BLUE, RED), RINK, Shape(w=(5, 31), h=(8, 32)), gap=(0, 1), then=(HEADED,))
YELLOW_TEAM = Blobs((YELLOW, CREAM, GREEN, HEAD), RINK, Shape(w=(5, 31), h=(12, 32)), gap=(1, 2))
SECONDS = Digits(FONT, CLOCK_LEFTS, CLOCK_TOP, (60, 10, 1))
CLOCK = Bounds(BLUE_DIGITS, (64, CLOCK_TOP, 96, CLOCK_TOP + FONT.height), value=SECONDS)

GAME = Game(
    name="IceHockey",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            BLUE_TEAM,
            count=2,
            rgb=BLUE_RGB,
            colors=(BLUE, RED, HEAD),
            role="player",
            doc="upper player, lower one",
        ),
        Category("Enemy", YELLOW_TEAM, count=2, rgb=YELLOW_RGB, doc="upper player, lower one"),
        Category("Ball", Bounds(BLACK, ICE, ignore=GOALS), doc="the puck"),
        display("PlayerScore", PLAYER_SCORE.rule(BLUE_DIGITS), role="score", doc="goals of blue"),
        display(
            "EnemyScore",
            ENEMY_SCORE.rule(YELLOW_DIGITS),
            role="opponent_score",
            doc="goals of yellow",
        ),
        display("Timer", CLOCK, role="time", doc="seconds left"),
    ),
)
