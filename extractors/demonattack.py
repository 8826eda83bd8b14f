"""Demon Attack: a ship that shoots at up to three demons, which drop bombs or fire rays.

Picture: docs/games/DemonAttack.png

Screen: the ground is scenery. Appearing demons (OCAtari's EnemyPart) and exploding demons or ships
are clouds of particles and not objects. A ray fills its rows. Each row of a demon has a colour of
the level; the demon's colour is the fourth row's from below.

Slots: Enemy has first the game's three rows of demons from the top, each with an intact demon or
the left half of a split one. Next come the right halves of the rows, then the small demon that
dives at the ship. When a demon begins to dive, the game moves the demons above it down a row.
EnemyMissile has two slots, left and right, for each of the game's ten rows of missiles. The slots
rotate as the missiles fall, so a missile keeps its slot. The shot waits for its launch in the ship.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code. Demons, the score and the ship's
state change after a frame is drawn; `decode` reverts this. A demon hides the next demon's pixels
less than four lines under it.

Timeline of the display program, which counts rows down to 0, a line each:
    row 162 to the lowest demon   demons and the shot
    three lines                   are not counted
    from there to row 12          the diver or missiles, and the shot
    rows 11 to 0                  the same, and the ship
If the program writes a register in the middle of a line, the change appears one line later to the
left of that column. Therefore missiles and shots are longer or shorter in some columns. `ShotBeam`
and `MissileBeam` hold the columns of the beam.

Covered: all modes and difficulties, levels 1-14, splitting and diving demons, rays, deaths, the end
of the game.

Not exact: the RAM lacks these facts: the shot on the frame on which it hits; the picture of the hit
demon; missiles on the frame on which one hits the ship; a row of a demon's height on a frame on
which it turns round. When the game ends, it clears demons that the screen still shows. They get the
most frequent picture, and the score gives the number of demons left in the wave. If one of the
upper two rows remains, its row is a guess (75 % are right). From level 5 on, these demons are not
valid.

VEM: it misses demons while the sky flashes in one of their colours, and halves that cover each
other. It cannot assign the pieces of bent rays.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Game,
    IconRow,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    lookup,
    match,
    mod,
    packed_position,
    when,
)

ROM = Rom("demon_attack", "f0e0addc07971561ab80d9abe1b8d333")
FONT = ROM.font(0xF00, rows=9, stride=10)
SCORE = NumberDisplay(FONT, right=103, top=7, digits=6)
SHIPS = IconRow(left=17, top=188, width=3, height=5, pitch=8)
MOST_SHIPS = 6  # shown at most
SHIPS_AREA = (16, 188, 18 + SHIPS.pitch * MOST_SHIPS, 193)
PURPLE = 86
PINK = 110
SHOT = 110
MISSILE = 78
YELLOW = 44
DEMON_COLORS = tuple(sorted({YELLOW, *ROM.bytes(0xFAE, 56).tolist()}))
GROUND_COLORS = tuple(range(128, 142, 2))

# The display program counts rows down to 0. Three lines separate the lowest demon from the rest.
UPPER = 182  # line + row: from the top to the lowest demon
LOWER = 185  # line + row: under it
GROUND = LOWER + 1
TOP_ROW = 162  # all demons are below it
CEILING = 151  # substitute for the row of a neighbour above the highest demon

ROWS = 8  # of a demon
HALF = 8  # columns of each half
COLOR_ROW = -4  # from the bottom of a demon's box; most demons have the most pixels there
COLORS = ROM.bytes(0xF00, 256)  # of a demon's rows, the lowest one first
# Column of the beam when a row gets its colour. Left of it, the row above keeps its own.
COLORED_AT = np.array((43, 43, 43, 52, 52, 52, 34))  # by slot
# The visible part of 32 pictures: of each nothing, its last row, its last two rows, ...
DEMON_PICTURES = Pictures.of(
    (
        np.where(np.arange(ROWS) >= ROWS - rows, ROM.rows(0xE00 + ROWS * picture, ROWS), 0)
        for picture in range(32)
        for rows in range(ROWS + 1)
    ),
    picture=32,
    rows=ROWS + 1,
)
FIRST_PICTURES = ROM.bytes(0xB9F, 12)  # of the demons of half a level
LAST_EXPLOSION = 3  # explosions have this picture or a lower one
SPLITTING = 24  # the picture that begins a split
SMALL_PICTURE = 26  # a picture of halves and of the diving demon
RANK = np.arange(3)  # of the demons, from the top
LOWEST = 2
SLOT = np.arange(7)
DIVER = 6  # slot
MIRRORED = SLOT // 3 == 1  # the right halves are
LAST_LINE = np.where(SLOT == DIVER, LOWER, UPPER)  # line + row, by slot


class State:  # of `Ram.state` and `Ram.diver_state`
    ALIVE = 2
    EXPLODES = 3


# Values of `code` at which demons turn round.
RIGHTMOST = 0x49
LEFTMOST = 0x71
NO_ROW = 255  # `appearing` without such a demon
BLANK = 100  # `digits`
# By phase: a demon moves if its part of a row or column is less.
Y_STEPS = ROM.bytes(0xEF0, 8)
X_STEPS = ROM.bytes(0xEF8, 8)
WAVE = 8  # demons
DEMON_POINTS = (10, 10, 15, 15)  # per demon, by level; in later levels they split
WAVE_ENDS = WAVE * np.cumsum(DEMON_POINTS)  # scores
HIT_SOUND = 2  # `sound`
HIT_NOTES = (8 * FIRST_PICTURES + 1) & 255  # `note` of a hit, by level
SHIP_EXPLODED = 29  # `page`: the frame shows the exploding ship
JUST_HIT = 63  # `explosion` on the last frame that shows the ship
GAME_OVER = 189  # `game`
LOADED = 3  # greatest `shot_y` of a shot that waits in the ship
SHIP_ROWS = 12  # the lowest rows, which also show the ship
MISSILE_ROWS = 10
SHOT_ROWS = 8
PERIODS = ROM.bytes(0xDA2, 12)  # frames between two steps of the missiles
LAST_EVEN_LEVELS = len(DEMON_POINTS)  # from this level on, demons split


class ShotBeam:
    """Columns of the beam when the display program starts the shot."""

    BETWEEN_DEMONS = 31
    AT_DEMON = 106
    WITH_MISSILES = 1  # below the demons; the next two are for a diver instead of missiles
    AT_DIVER = 88
    BESIDE_DIVER = 43
    SHIP_LATER = 18  # more in the rows of the ship
    SHIP_EXPLODED = 4  # below the demons
    END_SOONER = 3  # fewer when the program ends the shot


class MissileBeam:
    """Columns of the beam when the display program changes the missiles."""

    ABOVE_SHIP = 101
    BESIDE_SHIP = 119
    SHOT_LATER = 3  # more in the rows of the shot


class BombRows:
    """Rows of a bomb in its row of missiles; its halves alternate."""

    TOP = 7
    MIDDLE = 4
    PER_MISSILE = 8


class Ram(RamMap):
    level = byte(0)  # modulo 12
    score = bcd((1, 3, 5))
    x_part = byte(7, 8, 9)  # of a column
    code = byte(13, 14, 15, 17, 18, 19, 20)  # x - 5 in the chip's coding, by slot; 20: or missiles
    player_code = byte(16)  # x - 5 in the chip's coding
    shot_y = byte(21)  # row of its lower end
    shot_code = byte(22)  # x - 7 in the chip's coding
    appearing = byte(23)  # row of a demon that the game draws stretched
    explosion = byte(25)  # frames left of the ship's
    missile_clock = byte(26)  # frames since the missiles' last step
    appeared = byte(27)  # demons of this wave
    fired = flag(28, bit=6)
    picture = byte(29, 30, 31, 33, 34, 35, 51)  # by slot; an intact demon has both halves'
    missiles = byte(*range(37, 47))  # lowest row first
    phase = bits(47, 48, 49, count=3)  # of the demons' motion
    rises = flag(47, 48, 49, bit=3)
    goes_right = flag(47, 48, 49, bit=4)
    state = bits(47, 48, 49, first=6, count=2)
    diver_state = bits(50, first=6, count=2)
    volley = byte(52)  # rows of missiles still to come
    sound = bits(53, first=4, count=4)
    right_alive = flag(54, 55, 56, bit=5)
    left_alive = flag(54, 55, 56, bit=6)
    is_split = flag(54, 55, 56, bit=7)
    extra_life = byte(58)  # 1: just given
    frame = byte((57, 61))
    second_half = flag(61, bit=2)  # shows the second half of a row of bombs
    page = byte(65)  # of the last picture that was drawn
    drawn_picture = bits(66, first=3, count=5)  # of the lowest row's right half
    drawn_y = byte(68)  # of the lowest row
    y = byte(69, 70, 71)  # row of the demons' lower ends
    diver_y = byte(72)
    y_part = byte(73, 74, 75)  # of a row
    score_shown = flag(76, bit=6)
    colors = byte(77)  # place of this level's in `COLORS`
    note = byte(80)
    lives_color = byte(84)
    digits = byte(93, 95, 97, 99, 101)  # 10 * digit, 100: blank; the last digit is not kept
    bombs_or_rays = flag(107, bit=7)  # 0: a demon dives
    bombs = flag(108, bit=2)  # 0: rays
    cycle = byte(112)  # of the levels' difficulty
    game = byte(113)
    lives = byte(114)


def decode(m: Ram) -> dict[str, Box]:
    y = _drawn_rows(m)
    return {
        "Player": _player(m),
        "Enemy": _demon_boxes(m, y),
        "PlayerMissile": _shot_box(m, y),
        "EnemyMissile": _missile_boxes(m),
        "Score": _score_box(m),
        "Lives": _lives_box(m),
    }


def _player(m: Ram) -> Box:
    """On the frame on which the ship is hit, the game has already moved it."""
    x = packed_position(m.player_code) + jnp.where(m.explosion == JUST_HIT, 9, 5)
    return box(x, LOWER - 11, 7, 12, m.page != SHIP_EXPLODED)


def _drawn_rows(m: Ram) -> jax.Array:
    """Rows of the demons before they moved."""
    moved = (m.state == State.ALIVE) & (m.y_part < lookup(Y_STEPS, m.phase))
    risen = when(moved, jnp.where(m.rises, 1, -1))
    return jnp.where(RANK == LOWEST, m.drawn_y, m.y - risen)


def _step(m: Ram) -> jax.Array:
    """Columns to the right that intact demons and left halves moved after they were drawn."""
    code = m.code[: len(RANK)]
    turned = jnp.where(m.goes_right, code == LEFTMOST, code == RIGHTMOST)
    intact = (m.state == State.ALIVE) & (~m.is_split | m.left_alive) & ~turned
    moves = intact & ((RANK != LOWEST) | (m.volley == 0))  # it does not move while it fires
    moved = moves & (m.x_part < lookup(X_STEPS, m.phase))
    return when(moved, jnp.where(m.goes_right, 1, -1))


def _demon_boxes(m: Ram, y: jax.Array) -> Box:
    alive, hit = _demons_alive(m)
    small = _by_slot(m.is_split, jnp.ones(len(RANK), bool), jnp.asarray(True))
    shows_usual = hit | (m.game == GAME_OVER)
    picture = jnp.where(shows_usual, _usual_pictures(m, small), m.picture)
    index = DEMON_PICTURES.index(picture=picture, rows=_visible_rows(y))
    left, top, half_width, height = DEMON_PICTURES.extent(index, mirrored=MIRRORED)
    moved = _by_slot(_step(m), jnp.zeros(len(RANK), jnp.int32), jnp.int32(0))
    x = packed_position(m.code) + 5 - moved + left
    first_line = LAST_LINE + 1 - ROWS - _by_slot(y, y, m.diver_y)
    width = jnp.where(small, half_width, 2 * HALF - 2 * left)
    lowest_row = ROWS - 1 - top
    from_top = jnp.minimum(-height - COLOR_ROW, 0)  # of the row with the color
    late = when(x + 1 < COLORED_AT, 1)
    color = lookup(COLORS, m.colors + lowest_row + from_top + late)
    there = (alive | hit) & (height > 0)
    return box(x, first_line + top, width, height, there, color=color)


def _usual_pictures(m: Ram, small: jax.Array) -> jax.Array:
    """The most frequent picture for each slot."""
    of_level = lookup(FIRST_PICTURES, m.level >> 1) + 1
    usual = jnp.where(RANK == LOWEST, m.drawn_picture, of_level)
    return jnp.where(small, SMALL_PICTURE, _by_slot(usual, usual, m.level))


def _visible_rows(y: jax.Array) -> jax.Array:
    """Number of rows of each picture that are not too close under the demon above."""
    above = jnp.concatenate([jnp.full(1, TOP_ROW + 4), y[:-1]])
    rows_left = jnp.clip(above - 3 - y, 0, ROWS)
    return _by_slot(rows_left, rows_left, jnp.asarray(ROWS))


def _by_slot(left: jax.Array, right: jax.Array, diving: jax.Array) -> jax.Array:
    """Values by slot: of the intact demons or left halves, the right halves and the diver."""
    return jnp.concatenate([left, right, diving[None]])


def _flags_by_slot(left: jax.Array, right: jax.Array, diving: jax.Array) -> jax.Array:
    """`_by_slot` of conditions as bits of a number, computed once instead of again for each slot.

    Otherwise the game takes 1.3 times as long.
    """
    lefts = when(left, 1 << RANK)
    rights = when(right, 1 << RANK + len(RANK))
    word = jnp.sum(lefts + rights) + when(diving, 1 << DIVER)
    return word >> SLOT & 1 == 1


def _demons_alive(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Masks of living demons, and of the demon hit on this frame, which shows it alive."""
    over = m.game == GAME_OVER
    intact_alive = (m.state == State.ALIVE) & (m.appearing != RANK)
    in_play = jnp.where(m.is_split, m.left_alive, intact_alive)
    left = jnp.where(over, _remain(m), in_play)
    right = ~over & m.is_split & m.right_alive
    diving = ~over & (m.diver_state == State.ALIVE)
    is_whole = over | (m.picture > LAST_EXPLOSION)
    return _flags_by_slot(left, right, diving) & is_whole, _hit_now(m)


def _hit_now(m: Ram) -> jax.Array:
    """Mask of the demon hit on this frame, by slot."""
    sounds = (m.sound == HIT_SOUND) & (m.note == lookup(HIT_NOTES, m.level))
    changes = (m.picture == LAST_EXPLOSION) | (m.picture == SPLITTING)
    exploding = m.state == State.EXPLODES
    hit = _by_slot(m.is_split | exploding, m.is_split, m.diver_state == State.EXPLODES)
    return changes & sounds & hit


def _remain(m: Ram) -> jax.Array:
    """True for rows that the last frame of a game shows: all, unless it is the end of a wave.

    At the end of a wave the score gives the number of remaining demons, if it fits. If one of the
    upper two remains, choose the one farther from the middle between its neighbours: the row of a
    dead demon moves to that middle.
    """
    has_lowest = m.drawn_picture > LAST_EXPLOSION
    upper_count = _remaining_count(m) - when(has_lowest, 1) - when(m.appearing != NO_ROW, 1)
    off_middle = jnp.abs(2 * m.y[0] - CEILING - m.y[1])
    second_off_middle = jnp.abs(2 * m.y[1] - m.y[0] - m.y[2])
    is_first = off_middle > second_off_middle  # of the upper two, if one remains
    needed = jnp.where((RANK == 0) == is_first, 1, 2)
    is_there = ((m.appeared < WAVE) | (upper_count >= needed)) & (m.appearing != RANK)
    return jnp.where(RANK == LOWEST, has_lowest, is_there) & m.score_shown


def _remaining_count(m: Ram) -> jax.Array:
    """The number of demons that a wave still has according to the score; 0 if unknown."""
    missing = lookup(WAVE_ENDS, m.level) - m.score
    count = np.arange(1, 4)
    fits = missing == count * lookup(DEMON_POINTS, m.level)
    return jnp.max(when((m.level < LAST_EVEN_LEVELS) & fits, count))


def _shot_box(m: Ram, y: jax.Array) -> Box:
    x = packed_position(m.shot_code) + 7
    top = _shot_line(m, y, m.shot_y + SHOT_ROWS - 1, x, 0)
    end = _shot_line(m, y, m.shot_y - 1, x, ShotBeam.END_SOONER)
    is_launched = m.fired & (m.shot_y > LOADED)
    return box(x, top, 1, end - top, is_launched).clip(0, UPPER - TOP_ROW, 160, GROUND)


def _shot_line(m: Ram, y: jax.Array, row: jax.Array, x: jax.Array, sooner: int) -> jax.Array:
    """The first line that shows, at column x, the shot's start at a row or its end.

    The end takes the display program less time: the beam is less far by `sooner` columns.
    """
    noticed = _after_demon(y[1], _after_demon(y[0], row))
    above = noticed >= y[LOWEST]
    at_demon = jnp.any((noticed >= y) & (noticed < y + ROWS))
    beam = match(
        (above & at_demon, ShotBeam.AT_DEMON),
        (above, ShotBeam.BETWEEN_DEMONS),
        (m.page == SHIP_EXPLODED, ShotBeam.SHIP_EXPLODED),
        otherwise=_shot_beam_below(m, noticed),
    )
    return jnp.where(above, UPPER, LOWER) - noticed + when(x < beam - sooner, 1)


def _shot_beam_below(m: Ram, row: jax.Array) -> jax.Array:
    """The beam's column below the demons, in play."""
    at_diver = (row >= m.diver_y) & (row < m.diver_y + ROWS)
    column = match(
        (m.bombs_or_rays, ShotBeam.WITH_MISSILES),
        (at_diver, ShotBeam.AT_DIVER),
        otherwise=ShotBeam.BESIDE_DIVER,
    )
    return column + when(row < SHIP_ROWS, ShotBeam.SHIP_LATER)


def _after_demon(y: jax.Array, row: jax.Array) -> jax.Array:
    """The row at which the program notices a row: under a demon it positions the next one."""
    return jnp.where((row < y) & (row >= y - 3), y - 4, row)


def _missile_boxes(m: Ram) -> Box:
    """A row has up to two missiles."""
    row = _rows_of_pairs(m)
    dots = sum(when(row == i, m.missiles[i]) for i in range(MISSILE_ROWS))
    last = dots & -dots
    pairs = jnp.stack([dots, jnp.where(dots == last, 0, last)], axis=1)
    first_dot = jax.lax.clz(pairs) - 24  # from the left
    x = packed_position(m.code[DIVER]) + 5 + first_dot
    lower_half = m.bombs & m.second_half
    upper_half = m.bombs & ~m.second_half
    last_row = BombRows.PER_MISSILE * row
    usual_top = last_row + jnp.where(lower_half, BombRows.MIDDLE - 1, BombRows.TOP)
    bottom = last_row + when(upper_half, BombRows.MIDDLE)
    top = jnp.minimum(usual_top, m.drawn_y - 1)  # below the lowest demon
    line = _missile_line(m, top[:, None], x)
    end = _missile_line(m, bottom[:, None] - 1, x)
    falls = m.bombs_or_rays & (m.page != SHIP_EXPLODED) & (m.explosion != JUST_HIT)
    there = falls & (pairs > 0) & (top >= bottom)[:, None]
    boxes = box(x.ravel(), line.ravel(), 1, (end - line).ravel(), there.ravel())
    return boxes.clip(0, 0, 160, GROUND)


def _rows_of_pairs(m: Ram) -> jax.Array:
    """The game's row of missiles of each pair of slots: they rotate with each step."""
    frames = jnp.maximum(m.frame - m.missile_clock, 0)
    steps = jax.lax.div(frames, lookup(PERIODS, m.cycle))
    from_last = np.arange(MISSILE_ROWS) - mod(steps, MISSILE_ROWS)
    return jnp.where(from_last < 0, from_last + MISSILE_ROWS, from_last)


def _missile_line(m: Ram, row: jax.Array, x: jax.Array) -> jax.Array:
    """The first line that shows, at x, a change of the missiles at a row."""
    beside_shot = (row >= m.shot_y) & (row < m.shot_y + SHOT_ROWS)
    beam = jnp.where(row < SHIP_ROWS, MissileBeam.BESIDE_SHIP, MissileBeam.ABOVE_SHIP)
    late = x < beam + when(beside_shot, MissileBeam.SHOT_LATER)
    return LOWER - row + when(late, 1)


def _score_box(m: Ram) -> Box:
    digits = jnp.where(m.digits >= BLANK, 0, div(m.digits, 10))
    shown = jnp.sum(digits * np.array([100_000, 10_000, 1_000, 100, 10]))
    return SCORE.box(shown, value=m.score).where(m.score_shown)


def _lives_box(m: Ram) -> Box:
    """The ships on the screen lag a frame behind a lost or won life."""
    lost = (m.page == SHIP_EXPLODED) & (m.explosion == 0) & (m.game != GAME_OVER)
    shown = m.lives + when(lost, 1) - when(m.extra_life == 1, 1)
    return SHIPS.box(shown, shown <= MOST_SHIPS, value=m.lives + 1, color=m.lives_color)


FIELD = (0, 17, 160, GROUND)
HIGH = (0, 17, 160, 145)  # above the ship's explosion
# Sizes and pixel counts distinguish the demons from particles.
DEMON_SHAPES = (
    Shape(w=(12, 16), h=(5, 7), pixels=(53, 81)),
    Shape(w=16, h=(6, 7), pixels=(88, 112)),  # dense
    Shape(w=(5, 7), h=(4, 6), pixels=(30, 40)),  # halves
    Shape(w=(9, 11), h=(4, 6), pixels=(38, 72), split=(7, 6)),  # pairs of halves
    Shape(w=8, h=5, pixels=(36, 50)),  # eyes
)
SMALL_EYES = Blobs(DEMON_COLORS, HIGH, (Shape(w=6, h=3, pixels=24), Shape(w=2, h=2)), gap=(1, 1))
DEMONS = Blobs(DEMON_COLORS, FIELD, DEMON_SHAPES, gap=(1, 1), also=(SMALL_EYES,))

# The shot that waits in the ship ends three rows above the lower end of this region.
LAUNCHED = Blobs(SHOT, (0, 171, 160, 174), Shape(w=1, h=(1, 3)))
SHOTS = Blobs(SHOT, (0, 17, 160, 178), Shape(w=1, h=(4, 12)), gap=(0, 3), also=(LAUNCHED,))
MISSILES = Blobs(MISSILE, FIELD, Shape(w=1, h=(1, 40), split=(1, 8)))
LIVES = SHIPS.rule(GROUND_COLORS, SHIPS_AREA, single=2, inverse=True)

GAME = Game(
    name="DemonAttack",
    rom=ROM,
    ram=Ram,
    decode=decode,
    variants=Variants(
        modes={
            1: "the usual game",
            3: "ALE ends the episode after the first step",
            5: "ALE ends the episode after the first step",
            7: "ALE ends the episode after the first step",
        },
        source="play of all modes in the emulator",
    ),
    backdrop=(8, 158),
    categories=(
        Category(
            "Player",
            Bounds(PURPLE, (0, 174, 160, GROUND)),
            role="player",
            colors=(PURPLE, PINK),
            doc="the ship",
        ),
        Category(
            "Enemy",
            DEMONS,
            count=7,
            color_row=COLOR_ROW,
            doc="demons, halves, the diver",
            aliases=("EnemyPart",),
        ),
        Category("PlayerMissile", SHOTS, doc="the shot in flight"),
        Category("EnemyMissile", MISSILES, count=2 * MISSILE_ROWS, doc="bombs, pieces of rays"),
        display("Score", SCORE.rule(YELLOW, required=True), role="score", doc="points"),
        display("Lives", LIVES, role="lives", doc="ships in reserve; value: one more"),
    ),
)
