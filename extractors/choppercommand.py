"""Chopper Command: a helicopter that guards convoys of trucks, enemies in three lanes, a radar.

Picture: docs/games/ChopperCommand.png

Screen: the shot is the remaining part of a line. MiniTruck, MiniEnemy and MiniPlayer are the dots
on the radar. Life has a box around the helicopters in reserve, one less than its `value`. An
exploding object is not valid, but a hit truck blinks and stays valid. Sky, mountains and the
maker's name are scenery.

Slots: EnemyHelicopter and EnemyPlane have the game's three lanes from the bottom; a lane holds one
or the other. Truck has the places of a convoy. Bomb has the intact bomb or its upper half, then the
lower half. MiniTruck and MiniEnemy have block * 3 + place or lane, with the blocks of the landscape
from the left. All blocks move on together, and no byte counts this.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code. `_as_drawn` reverts the changes
after a frame is drawn.

Timeline of a frame:
    1. the enemies move; the clock of the enemies and bombs counts down
    2. the frame is drawn; the RAM keeps the chip's codes for the columns of the two lower lanes
    3. the player's speed moves him through the landscape: a part of the columns is a step of his
       own on the screen, and the landscape moves by the rest
    4. bombs move, and hits are counted
The landscape's motion in step 3 follows from the codes of step 2, or else from the player's speed.
His own step leads him to a column for his speed, from 16 (to the right) or 134 (to the left). Near
an edge of the screen, his steps away from it do not reduce the landscape's motion.

Covered: both modes and difficulties, later waves, deaths, the end of the game.

Not exact: the RAM lacks these facts: the player's position and direction on the frame on which he
turns; his position (by a column or a line) on some frames on which he comes to rest; the enemies on
the frame on which the blocks move on; a hit enemy's picture on the frame of the hit; bombs on the
frame on which they leave the screen.

VEM: it misses the covered part of a shot or an enemy.
"""

import functools
from typing import NamedTuple

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
    Game,
    IconRow,
    LoneRuns,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Saver,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    extremes,
    flag,
    high,
    low,
    match,
    mirrored,
    position,
    signed,
    signed_nibble,
    when,
)

ROM = Rom("chopper_command", "c1cb228470a87beb5f36e90ac745da26")
FONT = ROM.font(0xE00, rows=7, stride=8)

SCORE = NumberDisplay(FONT, right=81, top=16, digits=6)
RESERVE = IconRow(left=33, top=24, width=8, height=9, pitch=8)

GOLD = 44
WHITE = 14
BLUE = 128
BLACK = 0
YELLOW = 46
BROWN = 32
LASER = (*range(112, 144, 2), 158)

FIELD = (8, 52, 160, 168)  # columns 0-7 of the screen are black
ROAD = (8, 161, 160, 168)  # with the rows of the trucks
WINDOW = (56, 179, 104, 187)  # of the radar, below the mountains

# Pictures of each kind: complete, without 1-7 columns on the left, without 1-7 on the right.
ROWS = 10
MASKS = [*(255 >> cut for cut in range(8)), *(255 << cut & 255 for cut in range(1, 8))]
STORED = [ROM.rows(0xE00 + at, ROWS) for at in ROM.bytes(0xF0E, 12).tolist()]
WHOLE = [mirrored(rows) if kind in (7, 8, 9) else rows for kind, rows in enumerate(STORED)]
KINDS = Pictures.of(
    (rows & mask for rows in WHOLE for mask in MASKS), kind=len(WHOLE), part=len(MASKS)
)
CHOPPERS = ROM.pictures((0xEC0, 0xEB6), ROWS)

PLACES = ((3, 5, 6, 7), (2, 4, 6, 7), (1, 4, 5, 7))  # convoys with a truck at each place
BLOCK_COLUMNS = 320  # columns of the landscape
NO_COARSE = 128  # least coarse code of a lane left of the screen
COARSE_AGAIN = 122  # less than such a code
GOES_RIGHT = 16  # the player's column when he flies to the right
GOES_LEFT = 134
# From these columns outwards, his steps away from the edge leave the landscape's motion as it is.
STEP_FREE_LEFT = 21
STEP_FREE_RIGHT = 130
NEGATIVE = 200  # least distance modulo 256 that is a negative one
FASTEST = 64  # speeds are from -65 to 64
PART_BITS = 5
COLUMN_PARTS = 1 << PART_BITS  # units of `speed` and `part` in a column
LOWEST = 4  # `player_y`
HIGHEST = 95
OFF = 111  # `player_y` and `bomb_y` of absent objects, at least
SPLIT = 128  # least `bomb_time` of an intact bomb in the frame; it then counts down
JUST_EXPLODES = 15  # `timer`
JUST_HIT = 31  # `pause`
BLINKING = 8  # least `wreck` of a blinking truck
LANE_ROWS = (183, 181, 179)  # of the radar's lanes, the low one first
BLOCK_COUNT = 4  # of the landscape
PER_BLOCK = 3  # lanes, or places of a convoy
MINI_TRUCK_X = (3, 5, 7)  # columns of the places on the radar, from the block's
TRUCK_X = (64, 96, 128)  # of the places in the landscape
SAVER_MASK = 247  # `saver_mask` of the screen saver, which drops a bit of colours


class Kind:  # of `Ram.kind`
    HIT_HELICOPTER = 1
    PLANE = 6  # the first picture
    HELICOPTER = 8  # the first picture
    WESTWARD = (6, 8, 9)


class Phase:  # of `Ram.phase`
    PLAYS = 0
    EXPLODES = 94  # or more
    DEAD = 127
    BETWEEN_WAVES = 128  # or more


class Stick:  # bits of `Ram.stick`
    UP = 1
    DOWN = 2
    LEFT = 4
    RIGHT = 8


# Byte of `shot`, and bit in that byte, for each four-column dot of a line.
SHOT_BYTE = np.repeat([0, 1, 2, 3, 4, 5], [4, 8, 8, 4, 8, 8])
SHOT_BIT = np.tile([4, 5, 6, 7, *range(7, -1, -1), *range(8)], 2)


class Ram(RamMap):
    saver_key = byte(117)  # the game XORs colours with it
    saver_mask = byte(116)  # the game masks colours with it: 255 in play
    frame = byte(0)
    # A value per block; the column of an enemy counts from 1.
    convoys = bits(8, 7, 6, 5, first=3, count=3)
    middle_lane = bits(8, 7, 6, 5, count=3)
    top_lane = bits(12, 11, 10, 9, count=3)
    low_lane = bits(12, 11, 10, 9, first=3, count=3)
    coarse = byte(14, 15)  # with `fine`: drawn position of the lower lanes
    fine = high(30, 31)
    x = byte(18, 19, 20)  # of the lanes, in the landscape
    y = byte(22, 23, 24)  # 158 - y
    clock = byte(26)  # of the enemies and bombs, counts down
    pause = byte(27)
    lane_state = byte(30, 31, 32)
    timer = low(30, 31, 32)  # of explosions
    truck_kind = byte(33)
    kind = byte(34, 35, 36)
    bomb_time = byte(37)  # frames left; counted down after the drawing
    bomb_speed = signed(38, 39)  # columns, rows
    wreck = byte(40)
    wreck_convoy = bits(40, count=3)
    speed = signed(42)  # of the player, in 1/32
    part = signed(43)  # of a column
    shot_color = byte(45)  # its brightness counts down
    shot = byte(49, 52, 55, 58, 61, 64)
    shot_y = byte(65)  # 167 - y
    faces_right = flag(66, bit=0)
    odd = flag(67, bit=0)  # half of a block
    scroll = byte(68)
    bomb_x = byte(70)  # x + 1
    player_x = byte(71)  # x - 1
    player_y = byte(72)  # 159 - y
    stick = bits(84, first=4, count=4)
    bomb_y = byte(94, 95)  # 167 - y
    phase = byte(97)
    lives = byte(100)
    wave = byte(104)
    score = bcd((108, 110))  # hundreds
    radar = high(122)


class Drawn(NamedTuple):
    """The frame as drawn, and the changes since then."""

    x: jax.Array  # the player's column on the frame
    y: jax.Array  # his row
    shift: jax.Array  # the landscape's column on the frame
    moved: jax.Array  # columns to the left that the landscape has moved since
    ticked: jax.Array  # 1 if the clock of the enemies has ended, which moves everything by a column


def decode(m: Ram) -> dict[str, Box]:
    drawn = _as_drawn(m)
    lanes, helicopter = _lane_boxes(m, drawn)
    return {
        "Player": _player(m, drawn),
        "EnemyHelicopter": lanes.where(helicopter),
        "EnemyPlane": lanes.where(~helicopter),
        "Truck": _truck_boxes(m, drawn),
        "Bomb": _bomb_boxes(m, drawn),
        "Shot": _shot(m),
        "MiniPlayer": _mini_player(drawn),
        "MiniEnemy": _mini_enemies(m),
        "MiniTruck": _mini_trucks(m),
        "Score": _score_box(m),
        "Life": RESERVE.box(m.lives - 1, value=m.lives),
    }


def _as_drawn(m: Ram) -> Drawn:
    """Infer the player's step from the landscape's motion if it is known and possible."""
    clock_ended = m.clock == ((3 - m.wave) & 0xFF)
    ticked = when((m.phase == Phase.PLAYS) & clock_ended, 1)
    now = m.scroll - jnp.where(m.odd, 0, BLOCK_COLUMNS // 2)
    flown = _columns_flown(m) + ticked
    seen = _seen_shift(m)
    step = _player_step(m, flown + now - seen.shift, seen.known)
    reduces = jnp.where(step < 0, m.player_x < STEP_FREE_RIGHT, m.player_x > STEP_FREE_LEFT)
    moved = jnp.where(seen.known, seen.shift - now, flown - when(reduces, step))
    block = when(_moved_on(m), jnp.where(m.odd, -BLOCK_COLUMNS, BLOCK_COLUMNS))
    return Drawn(
        x=m.player_x - step,
        y=m.player_y - _player_rise(m),
        shift=now + moved + block,
        moved=moved,
        ticked=ticked,
    )


def _columns_flown(m: Ram) -> jax.Array:
    """Columns that the player's speed has moved him in the landscape."""
    before = m.part - m.speed
    to_right = (m.speed > 0) & (m.part >= 0)  # the game keeps the part from 0 to 31
    to_left = (m.speed < 0) & (m.part < 0)  # from `least` to -2
    least = -COLUMN_PARTS - 1
    part = match(
        (to_right, before & COLUMN_PARTS - 1),
        (to_left, (before - least & COLUMN_PARTS - 1) + least),
        otherwise=before,
    )
    return when(m.phase < Phase.BETWEEN_WAVES, (part + m.speed - m.part) >> PART_BITS)


class Seen(NamedTuple):
    """The landscape according to the lower lanes."""

    shift: jax.Array  # its column on the frame
    known: jax.Array  # True if one of the lanes shows it


def _seen_shift(m: Ram) -> Seen:
    coarse = jnp.where(m.coarse < NO_COARSE, m.coarse, m.coarse - COARSE_AGAIN)
    x = position(coarse, m.fine) - 1
    shows = (x > 0) & (m.timer[:2] != JUST_EXPLODES) & ~_moved_on(m)
    shifts = x - m.x[:2]
    return Seen(jnp.where(shows[0], shifts[0], shifts[1]), jnp.any(shows))


class Steps(NamedTuple):
    """Steps with which the player can have come to his column, bool each."""

    gains: jax.Array
    stays: jax.Array
    loses: jax.Array


def _player_step(m: Ram, inferred: jax.Array, known: jax.Array) -> jax.Array:
    """The player's step after he was drawn: the inferred step, if he can make it."""
    x = m.player_x
    can = Steps(
        gains=_step_from(m, x - 1) == 1,
        stays=_step_from(m, x) == 0,
        loses=_step_from(m, x + 1) == -1,
    )
    gained = can.gains & (inferred == 1)
    stayed = can.stays & (inferred == 0)
    lost = can.loses & (inferred == -1)
    reduces = (x > STEP_FREE_LEFT) & (x < STEP_FREE_RIGHT)
    possible = known & (gained | stayed | lost) & reduces
    made = jnp.where(possible, inferred, _usual_step(m, can))
    return when(m.phase < Phase.BETWEEN_WAVES, made)


def _resting_column(m: Ram) -> jax.Array:
    return jnp.where(m.faces_right, GOES_RIGHT, GOES_LEFT)


def _step_from(m: Ram, x: jax.Array) -> jax.Array:
    """Columns that the game moves the player from x to the column for his speed."""
    distance = (x - (m.speed >> 1)) & 0xFF
    aim = jnp.where(distance >= NEGATIVE, 0, distance) & ~1
    goal = _resting_column(m)
    towards_left_goal = jnp.sign(GOES_LEFT - x)
    beyond = match((x == GOES_RIGHT + 1, 0), (x <= GOES_RIGHT, towards_left_goal), otherwise=-1)
    return match((aim < goal, towards_left_goal), (aim == goal, 0), otherwise=beyond)


def _usual_step(m: Ram, can: Steps) -> jax.Array:
    """The player's step if several are possible: he follows a change of his speed."""
    aside = m.stick & (Stick.LEFT | Stick.RIGHT)
    pulls_right = (aside & Stick.RIGHT) != 0
    pulls_left = aside == Stick.LEFT
    slows = aside == 0
    rises = (pulls_right & (m.speed < FASTEST)) | (slows & (m.speed < 0))
    falls = (pulls_left & (m.speed > -FASTEST - 1)) | (slows & (m.speed > 0))
    is_even = (m.speed & 1) == 0
    edge = _resting_column(m) + (m.speed >> 1)
    follows = can.gains & rises & is_even & (m.player_x == edge)
    yields = can.loses & falls & ~is_even & (m.player_x == edge + 1)
    stays = can.stays & ~follows & ~yields
    return match((stays, 0), (can.gains, 1), (can.loses, -1), otherwise=0)


def _player_rise(m: Ram) -> jax.Array:
    """Lines that the player has risen."""
    up = ((m.stick & Stick.UP) != 0) & (m.player_y < HIGHEST)
    only_down = (m.stick & (Stick.UP | Stick.DOWN)) == Stick.DOWN
    down = only_down & (m.player_y > LOWEST)
    return when(m.phase == Phase.PLAYS, match((up, 1), (down, -1), otherwise=0))


def _moved_on(m: Ram) -> jax.Array:
    """True if the blocks of the landscape have moved on by one on this frame."""
    near = jnp.where(m.odd, m.scroll >= 150, m.scroll < 10)
    return jnp.all(m.lane_state == 0) & near


def _blocks(m: Ram, values: jax.Array) -> jax.Array:
    """A value of each of the four blocks as in the frame."""
    back = jnp.where(m.odd, jnp.roll(values, 1), jnp.roll(values, -1))
    return jnp.where(_moved_on(m), back, values)


def _player(m: Ram, drawn: Drawn) -> Box:
    is_just_hit = (m.phase == Phase.DEAD) & (m.pause == JUST_HIT)
    rotor_turns = (m.phase == Phase.PLAYS) | is_just_hit
    first = rotor_turns & (((m.frame - 2) & 2) == 0)
    picture = jnp.where(first, 0, 1)
    left, top, width, height = CHOPPERS.extent(picture, mirrored=~m.faces_right)
    is_intact = (m.phase < Phase.EXPLODES) | (m.phase >= Phase.BETWEEN_WAVES) | is_just_hit
    there = is_intact & (m.player_y < OFF)
    facing = jnp.where(m.faces_right, EAST, WEST)
    x = drawn.x + 1 + 2 * left
    y = 159 - drawn.y + top
    return box(x, y, 2 * width, height, there, orientation=facing).clip(*FIELD)


def _lane_boxes(m: Ram, drawn: Drawn) -> tuple[Box, jax.Array]:
    """The flying objects in the lanes, and True for helicopters."""
    hit = m.timer == JUST_EXPLODES  # the frame still shows it intact
    helicopter = jnp.where(hit, m.kind == Kind.HIT_HELICOPTER, m.kind >= Kind.HELICOPTER)
    second = (m.frame - 1) >> 1 & 1
    intact = jnp.where(helicopter, Kind.HELICOPTER + second, Kind.PLANE)
    kind = jnp.where(hit, intact, m.kind)
    there = ((m.kind >= Kind.PLANE) | hit) & ~_moved_on(m)
    facing = jnp.where(among(kind, Kind.WESTWARD), WEST, EAST)
    return _cut(kind, m.x + drawn.shift, 158 - m.y, there, facing), helicopter


def _cut(kind: jax.Array, x: jax.Array, y: jax.Array, there: jax.Array, facing: jax.Array) -> Box:
    """Tight boxes of objects that the screen's edges cut."""
    left = jnp.clip(FIELD[0] - x, 0, 7)
    right = jnp.clip(x - 152, 0, 7)
    part = jnp.where(right > 0, 7 + right, left)
    picture = KINDS.index(kind=kind, part=part)
    return KINDS.box(picture, x, y, valid=there & (x > 0), orientation=facing)


def _truck_boxes(m: Ram, drawn: Drawn) -> Box:
    convoy = jnp.where(m.wreck >= BLINKING, m.wreck_convoy, _blocks(m, m.convoys)[1])
    there = jnp.stack([among(convoy, convoys) for convoys in PLACES])
    x = jnp.array(TRUCK_X) + drawn.shift
    kind = m.truck_kind ^ drawn.ticked
    y = jnp.full(PER_BLOCK, ROAD[1])
    return _cut(kind, x, y, there, jnp.full(PER_BLOCK, 0)).clip(*ROAD)


def _bomb_boxes(m: Ram, drawn: Drawn) -> Box:
    """A bomb flies sideways or, on alternate frames, vertically, and its halves fall apart."""
    flew_sideways = (m.clock == 0) | (m.clock > 128)
    scrolled = drawn.moved - drawn.ticked
    x = m.bomb_x - when(flew_sideways, m.bomb_speed[0]) + scrolled
    fell = when(~flew_sideways, m.bomb_speed[1])
    apart = jnp.array([2, -2])
    y = m.bomb_y - jnp.where(m.bomb_time >= SPLIT, fell, apart)
    flies = (m.bomb_time > 0) & (m.bomb_y < OFF) & ~_bomb_is_new(m, drawn, x, y[0])
    is_whole = m.bomb_time >= SPLIT - 1
    there = flies & (np.array([True, False]) | ~is_whole)
    return box(x - 1, 167 - y, 2, jnp.where(is_whole, 2, 1), there).clip(*FIELD)


def _bomb_is_new(m: Ram, drawn: Drawn, x: jax.Array, y: jax.Array) -> jax.Array:
    """True if a bomb is at an enemy that drops it: it appears on its second frame."""
    lane_x = m.x + drawn.shift
    at_enemy = (x == lane_x + when(lane_x < 156, 3)) & (y == m.y + 4)
    return jnp.any(at_enemy)


def _shot(m: Ram) -> Box:
    lit = (m.shot[SHOT_BYTE] >> SHOT_BIT & 1) == 1
    column = np.arange(0, 160, 4)
    left, right = extremes(lit, column, column + 4)
    color = (m.shot_color + 111) ^ 15 ^ jnp.maximum(_saver_key(m), 0)  # the saver keeps it
    return box(left, 167 - m.shot_y, right - left, 1, right > left, color=color).clip(*FIELD)


def _mini_player(drawn: Drawn) -> Box:
    x = 74 - signed_nibble(((drawn.x >> 1) + 242) >> 4 & 15 ^ 15)
    return box(x, 184 - (drawn.y >> 4 & 7), 2, 2)


def _mini_lefts(m: Ram) -> jax.Array:
    """Radar column of each block."""
    return 56 - signed_nibble(m.radar) + 16 * np.arange(BLOCK_COUNT)


def _by_block(of_places: list[jax.Array]) -> jax.Array:
    """Values of each lane or place, by block, in the order of the slots: block * 3 + place."""
    return jnp.stack(of_places, axis=1).reshape(BLOCK_COUNT * PER_BLOCK)


def _mini_enemies(m: Ram) -> Box:
    lanes = [_blocks(m, lane) for lane in (m.low_lane, m.middle_lane, m.top_lane)]
    x = _by_block([_mini_lefts(m) + lane - 1 for lane in lanes])
    there = _by_block([lane > 0 for lane in lanes])
    return box(x, np.tile(LANE_ROWS, BLOCK_COUNT), 2, 2, there).clip(*WINDOW)


def _mini_trucks(m: Ram) -> Box:
    convoys = _blocks(m, m.convoys)
    x = _by_block([_mini_lefts(m) + column for column in MINI_TRUCK_X])
    there = _by_block([among(convoys, place) for place in PLACES])
    return box(x, 185, 1, 2, there).clip(*WINDOW)


def _score_box(m: Ram) -> Box:
    """The points on the screen, without this frame's points."""
    points = jnp.sum(when(m.timer == JUST_EXPLODES, m.kind))
    return SCORE.box(100 * jnp.maximum(m.score - points, 0), value=100 * m.score)


enemies = functools.partial(Category, count=3, attributes=("orientation",))
CHOPPER = Blobs(GOLD, FIELD, Shape(w=(3, 16), h=(6, 10)))
vehicles = functools.partial(Blobs, gap=(1, 2), shapes=Shape(w=(1, 8), h=(1, 10)))
BOMBS = Blobs(GOLD, FIELD, (Shape(w=2, h=2, pixels=4), Shape(w=2, h=1)))  # intact, or halves
LIFE = RESERVE.rule(GOLD, (30, 24, 110, 33), single=2)
LINE = Bounds(LASER, FIELD, (4, 1), max_size=(152, 1), filters=(LoneRuns(2),))
row = functools.partial(Blobs, YELLOW, shapes=Shape(w=(1, 2), h=(1, 2)))
RADAR_LANES = row((56, 179, 104, 181), also=(row((56, 181, 104, 183)), row((56, 183, 104, 185))))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="ChopperCommand",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (8, 15), 136, mask=SAVER_MASK, taken=(136, 38)),
    checks=Checks(
        saver_hides=("EnemyPlane", "MiniEnemy", "MiniTruck"),
    ),
    categories=(
        Category("Player", CHOPPER, attributes=("orientation",), role="player", doc="the chopper"),
        enemies("EnemyHelicopter", vehicles(WHITE, FIELD), doc="lanes from the bottom"),
        enemies("EnemyPlane", vehicles(BLUE, FIELD), doc="lanes from the bottom"),
        Category("Truck", vehicles(BLACK, ROAD), count=3, doc="places of the convoy"),
        Category("Bomb", BOMBS, count=2, needs=("Player",), doc="whole or upper half, lower half"),
        Category("Shot", LINE, doc="the line that is left of it"),
        Category("MiniPlayer", Bounds(BROWN, WINDOW), doc="on the radar"),
        Category("MiniEnemy", RADAR_LANES, count=12, doc="block * 3 + lane"),
        Category("MiniTruck", row((56, 185, 104, 187)), count=12, doc="block * 3 + place"),
        display("Score", SCORE.rule(GOLD), role="score", doc="points"),
        display("Life", LIFE, role="lives", doc="helicopters in reserve; value: one more"),
    ),
)
