"""Tennis: two players who change ends, a ball and its shadow, and two scores.

Picture: docs/games/Tennis.png

Screen: Player is pink, Enemy is blue. The boxes of the players include their rackets. A score is
the text on the display: points (0, 15, 30, 40), games, or its half of DEUCE or of an advantage. The
court, the net and the maker's name are scenery. The net and the edges hide the ball, which is valid
while it is on the screen.

RAM: ALE's source (points, games), OCAtari 2.2 (meaning of the bytes) and the ROM's code. Everything
moves before the frame is drawn, so the RAM matches the screen.

Covered: all modes and difficulties, both ends, the end of the game.

Not exact: the value of a score counts the points won in the current game, and four for each game
won. The difference of the values is the sum of the rewards if the losers of all games had no
points; the RAM does not keep the points of lost games.

VEM: it misses the part of the ball or its shadow that a player covers, and the ball beside the
white lines. It takes the short end of a side line at a player's head or racket for a part of him.
It reads the scores while the display shows the games. While the display shows the points of a game,
it does not show the games won.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    NoLines,
    RamMap,
    Rom,
    Saver,
    Shape,
    Variants,
    among,
    box,
    byte,
    display,
    lookup,
    match,
    when,
)

ROM = Rom("tennis", "42cdd6a9e42a3639e190722b8ea3fc51")
FIELD = (8, 14, 160, 192)  # columns 0-7 are blank
PINK = 76
BLUE = 140
WHITE = 14
SHADE = 2  # of the ball's shadow

HEIGHT = 23  # rows of a player
USUAL_WIDTH = 13  # of a player with the racket
SWING_WIDTHS = {0x5B: 16, 0x6C: 15, 0x84: 12}  # by the racket's picture in a swing
ENDS = (166, 167)  # row of the top plus y: far, near
NEAR_YS = range(2, 78)  # `ball_y` at the near end
FAR_YS = range(91, 172)  # and at the far end; between them the net hides the ball
NET_TOP = 99

GAME_POINTS = 4  # value of a game
SCORE_TOP = 5
SCORE_ROWS = 7
HALF_X = 40  # left edge of the display's left half
HALVES_APART = 64  # columns from its left half to its right half
SHARED_APART = 16  # the same for one text across both halves

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours
LETTER = 8  # the first text that is no number of games; the ROM has these from 0 to 7
NUMBERS = ROM.bytes(0x73F, LETTER + 1)[[*range(LETTER), LETTER, LETTER]]
FONT = ROM.font([0x700 + low for low in NUMBERS.tolist()], SCORE_ROWS)


def _texts() -> np.ndarray:
    """Left edge and width of each text in a half of the display; 0: nothing."""
    out = []
    for low, high in zip(ROM.bytes(0x73F, 18), ROM.bytes(0x72D, 18), strict=True):
        rows = ROM.rows(0x700 + int(high), SCORE_ROWS) << 8 | ROM.rows(0x700 + int(low), SCORE_ROWS)
        ink = int(np.bitwise_or.reduce(rows))
        left = 16 - ink.bit_length()
        right = 16 - ((ink & -ink).bit_length() - 1)
        out.append((left, right - left) if ink else (0, 0))
    return np.array(out)


TEXT_LEFTS, TEXT_WIDTHS = _texts().T


class Ram(RamMap):
    saver_key = byte(2)  # XORed with colours
    saver_mask = byte(3)  # mask of colours: 0xFF in play
    text = byte(7, 6)  # on the display: player, enemy
    ball_x = byte(16)  # x + 2
    y = byte(24, 25)  # of the players: far, near
    x = byte(26, 27)  # left edge of the picture + 2
    right_part = byte(28, 29)  # low byte of the picture's address
    left_part = byte(30, 31)  # low byte of the picture's address
    ball_y = byte(54, 55)  # of the ball, of its shadow
    turned = byte(56, 57)  # 0: the racket is on the right
    points = byte(69, 70)  # player, enemy
    games = byte(71, 72)
    swapped = byte(80)  # 0: the player is at the far end
    advantage = byte(81)  # nonzero: the display shows one text


def decode(m: Ram) -> dict[str, Box]:
    players = _player_boxes(m)
    ball = _ball_boxes(m)
    scores = _score_boxes(m)
    return {
        "Player": players[0],
        "Enemy": players[1],
        "Ball": ball[0],
        "BallShadow": ball[1],
        "PlayerScore": scores[0],
        "EnemyScore": scores[1],
    }


def _player_boxes(m: Ram) -> Box:
    """Both players; the body is left of the racket, or right of it if they are turned."""
    turned = m.turned != 0
    racket = jnp.where(turned, m.left_part, m.right_part)
    swings = ((racket == swing, columns) for swing, columns in SWING_WIDTHS.items())
    width = match(*swings, otherwise=USUAL_WIDTH)
    x = m.x - 2 + when(turned, 16 - width)
    facing = jnp.where(turned, WEST, EAST)
    left = _player_first(m, x)
    top = _player_first(m, np.array(ENDS) - m.y)
    orientation = _player_first(m, facing)
    boxes = box(left, top, _player_first(m, width), HEIGHT, orientation=orientation)
    return boxes.clip(*FIELD)


def _player_first(m: Ram, by_end: jax.Array | np.ndarray) -> jax.Array:
    """Reorder values by end (far, near) to the player's and the enemy's value."""
    return jnp.where(m.swapped == 0, by_end, by_end[::-1])


def _ball_boxes(m: Ram) -> Box:
    """The ball and its shadow; a ball on the ground has no separate shadow."""
    near = among(m.ball_y, NEAR_YS)
    y = jnp.where(near, ENDS[1], ENDS[0]) + HEIGHT - m.ball_y
    h = jnp.where(near, 2, jnp.minimum(NET_TOP - y, 2))
    in_court = (near | among(m.ball_y, FAR_YS)) & (m.ball_x >= FIELD[0] + 2)
    there = in_court & (np.array((True, False)) | (m.ball_y[0] != m.ball_y[1]))
    return box(jnp.repeat(m.ball_x, 2) - 2, y, 2, h, there).clip(*FIELD)


def _score_boxes(m: Ram) -> Box:
    """The two halves of the display; they are closer together for one text."""
    apart = jnp.where(m.advantage != 0, SHARED_APART, HALVES_APART)
    x = HALF_X + apart * np.arange(2) + lookup(TEXT_LEFTS, m.text)
    w = lookup(TEXT_WIDTHS, m.text)
    return box(x, SCORE_TOP, w, SCORE_ROWS, w > 0, value=GAME_POINTS * m.games + m.points)


sportsman = functools.partial(
    Blobs, region=FIELD, shapes=Shape(w=(8, 18), h=(16, 36)), filters=(NoLines(7),)
)
facing_category = functools.partial(Category, attributes=("orientation",))

TENS_X = (HALF_X, HALF_X + HALVES_APART)  # free while the display shows numbers of games
number = functools.partial(Digits, FONT, top=SCORE_TOP, weights=(GAME_POINTS,), free=TENS_X)
PLAYER_SCORE = Bounds((PINK, BLUE), (40, 5, 56, 12), value=number(lefts=(48,)))
ENEMY_SCORE = Bounds((BLUE, PINK), (56, 5, 120, 12), value=number(lefts=(112,)))


def _saver_key(m: Ram) -> jax.Array:
    """The number XORed with colours, or -1 in play."""
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="Tennis",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (70, 198), 76, mask=SAVER_MASK),
    checks=Checks(
        known={"PlayerScore": 0.3, "EnemyScore": 0.3},  # points, without the games won
    ),
    variants=Variants(
        modes={
            0: "full speed",
            2: "half the speed",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        facing_category("Player", sportsman(PINK), role="player", doc="the pink player"),
        facing_category("Enemy", sportsman(BLUE), doc="the blue player"),
        Category("Ball", Blobs(WHITE, FIELD, Shape(w=(1, 2), h=(1, 2))), doc="the ball"),
        Category("BallShadow", Bounds(SHADE, FIELD), doc="its shadow"),
        display("PlayerScore", PLAYER_SCORE, role="score", doc="of the pink player"),
        display("EnemyScore", ENEMY_SCORE, role="opponent_score", doc="of the blue player"),
    ),
)
