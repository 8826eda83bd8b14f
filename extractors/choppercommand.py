"""Chopper Command: a helicopter that guards convoys of trucks, enemies in three lanes, a radar.

Slots of EnemyHelicopter and EnemyPlane: the game's three lanes from the bottom, which hold one or
the other. Of Truck: the places of a convoy. Of Bomb: the whole one or its upper half, the lower
half. Of MiniTruck and MiniEnemy: block of the landscape from the left (all move on together,
uncounted) * 3 + place or lane, with boxes of what the radar shows. The shot is the line that is
left of it. Life has a box around the helicopters in reserve, one less than its `value`. What
explodes is no object, but a truck that was hit blinks. Scenery: sky, mountains, the maker's name.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code. The game moves the enemies before
a frame is drawn, and the player, the bombs and the landscape after it, when it also counts hits.
`decode` takes that back. How far the landscape moved follows from the chip's codes for the places
of the two lower lanes, which are kept from the drawing, or else from the player's speed.

Covered: both modes and difficulties, later waves, deaths, the end of the game. Not in the RAM: the
player's place and direction on the frame on which he turns, his place (by a column or a line) on
some on which he comes to rest; the enemies on the frame on which the blocks move on, and a hit
one's picture on that of the hit; bombs on that on which they leave the screen. VEM does not see the
part of a shot or an enemy that something covers.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among
from ocjax.console.ram import RamMap, bcd, bits, byte, high, low, signed
from ocjax.console.registers import position, signed_nibble
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.filters import LoneRuns
from ocjax.vision.rules import Blobs, Bounds, Gauge
from ocjax.vision.shades import Saver
from ocjax.vision.shapes import Shape

ROM = Rom("chopper_command", "c1cb228470a87beb5f36e90ac745da26")
FONT = ROM.font(0xE00, rows=7, stride=8)

GOLD = 0x2C
WHITE = 0x0E
BLUE = 0x80
BLACK = 0
YELLOW = 0x2E
BROWN = 0x20
LASER = (*range(0x70, 0x90, 2), 0x9E)
# columns 0-7 of the screen are black
FIELD = (8, 52, 160, 168)
ROAD = (8, 161, 160, 168)
WINDOW = (56, 179, 104, 187)  # of the radar, below the mountains

# Pictures of each kind: whole, without 1-7 columns on the left, without 1-7 on the right.
ROWS = 10
PARTS = 15
MASKS = [*(255 >> cut for cut in range(8)), *(255 << cut & 255 for cut in range(1, 8))]
TURNED = np.array([int(f"{dots:08b}"[::-1], 2) for dots in range(256)])
WHOLE = [ROM.rows(0xE00 + at, ROWS) for at in ROM.bytes(0xF0E, 12).tolist()]
WHOLE[7:10] = [TURNED[picture] for picture in WHOLE[7:10]]
KINDS = Pictures.of(picture & mask for picture in WHOLE for mask in MASKS)
CHOPPERS = ROM.pictures((0xEC0, 0xEB6), ROWS)

# first kinds; those that face left
PLANE = 6
HELICOPTER = 8
WESTWARD = (6, 8, 9)
HIT_HELICOPTER = 1  # its kind then
JUST_EXPLODES = 15  # `timer`
WEST = 12
EAST = 4
PLACES = ((3, 5, 6, 7), (2, 4, 6, 7), (1, 4, 5, 7))  # convoys with a truck at each place
SPLIT = 128  # least `bomb_time` of a whole bomb
BLINKING = 8  # `wreck` of a truck that blinks
# `pause` and `phase`
JUST_HIT = 31
DEAD = 0x7F
EXPLODES = 0x5E  # least `phase`: the chopper explodes
BETWEEN = 0x80  # a wave is over
LOWEST = 4  # `player_y`
HIGHEST = 0x5F  # and least row of no bomb
OFF = 0x6F  # no player

# Byte of `shot` and bit in it for each dot of a line, of four columns.
SHOT_BYTE = np.repeat([0, 1, 2, 3, 4, 5], [4, 8, 8, 4, 8, 8])
SHOT_BIT = np.tile([4, 5, 6, 7, *range(7, -1, -1), *range(8)], 2)

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    saver_key = byte(117)  # what colours are XORed with
    saver_mask = byte(116)  # what they are masked with: 0xFF in play
    frame = byte(0)
    # A value for each of the blocks; the column of an enemy counts from 1.
    convoys = bits(8, 7, 6, 5, first=3, count=3)
    middle_lane = bits(8, 7, 6, 5, count=3)
    top_lane = bits(12, 11, 10, 9, count=3)
    low_lane = bits(12, 11, 10, 9, first=3, count=3)
    coarse, fine = byte(14, 15), high(30, 31)  # where the lower lanes were drawn
    x = byte(18, 19, 20)  # of the lanes, in the landscape
    y = byte(22, 23, 24)  # 158 - y
    clock = byte(26)  # of the enemies and bombs, counts down
    pause = byte(27)
    lane_state = byte(30, 31, 32)
    timer = low(30, 31, 32)  # of explosions
    truck_kind = byte(33)
    kind = byte(34, 35, 36)
    bomb_time = byte(37)  # frames
    bomb_speed = signed(38, 39)  # columns, rows
    wreck = byte(40)
    wreck_convoy = bits(40, count=3)
    speed = signed(42)  # of the player, in 1/32
    part = signed(43)  # of a column
    shot_color = byte(45)  # its brightness counts down
    shot = byte(49, 52, 55, 58, 61, 64)
    shot_y = byte(65)  # 167 - y
    faces_right = bits(66)
    odd = bits(67)  # half of a block
    scroll = byte(68)
    bomb_x = byte(70)  # x + 1
    player_x = byte(71)  # x - 1
    player_y = byte(72)  # 159 - y
    stick = bits(84, first=4, count=4)  # up, down, left, right
    bomb_y = byte(94, 95)  # 167 - y
    phase = byte(97)
    lives = byte(100)
    wave = byte(104)
    score = bcd((108, 110))  # hundreds
    radar = high(122)


def decode(m: Ram) -> dict[str, Box]:
    ticked = jnp.where((m.phase == 0) & (m.clock == ((3 - m.wave) & 255)), 1, 0)
    step, shift, moved = _motion(m, ticked)
    x, y = m.player_x - step, _player_row(m)
    lanes, helicopter = _lanes(m, shift)
    mini_enemies, mini_trucks = _radar(m)
    mini_x = 74 - signed_nibble(((x >> 1) + 0xF2) >> 4 & 15 ^ 15)
    points = jnp.sum(jnp.where(m.timer == JUST_EXPLODES, m.kind, 0))  # not yet on the screen
    shown = 100 * jnp.maximum(m.score - points, 0)
    return {
        "Player": _player(m, x, y),
        "EnemyHelicopter": lanes.where(helicopter),
        "EnemyPlane": lanes.where(~helicopter),
        "Truck": _trucks(m, shift, ticked),
        "Bomb": _bombs(m, shift, moved - ticked),
        "Shot": _shot(m),
        "MiniPlayer": box(mini_x, 184 - (y >> 4 & 7), 2, 2),
        "MiniEnemy": mini_enemies,
        "MiniTruck": mini_trucks,
        "Score": score_box(FONT, shown, right=81, top=16, digits=6, value=100 * m.score),
        "Life": box(33, 24, 8 * m.lives - 8, 9, m.lives > 1, value=m.lives),
    }


def _step_from(m: Ram, x: jax.Array) -> jax.Array:
    """Columns that the game moves the player from x, to the place that goes with his speed."""
    aim = (x - (m.speed >> 1)) & 255
    aim = jnp.where(aim >= 200, 0, aim) & 0xFE
    goal = jnp.where(m.faces_right == 1, 0x10, 0x86)
    near = jnp.where(x == 0x86, 0, jnp.where(x > 0x86, -1, 1))
    far = jnp.where(x == 0x11, 0, jnp.where(x < 0x11, near, -1))
    return jnp.where(aim < goal, near, jnp.where(aim == goal, 0, far))


def _usual_step(m: Ram, gains: jax.Array, stays: jax.Array, loses: jax.Array) -> jax.Array:
    """The player's step, where several are possible: he follows his speed when that changes."""
    right, left, slows = (m.stick & 8) != 0, (m.stick & 12) == 4, (m.stick & 12) == 0
    rises = (right & (m.speed < 64)) | (slows & (m.speed < 0))
    falls = (left & (m.speed > -65)) | (slows & (m.speed > 0))
    edge = jnp.where(m.faces_right == 1, 0x10, 0x86) + (m.speed >> 1)
    follows = gains & rises & ((m.speed & 1) == 0) & (m.player_x == edge)
    yields = loses & falls & ((m.speed & 1) == 1) & (m.player_x == edge + 1)
    return jnp.where(stays & ~follows & ~yields, 0, jnp.where(gains, 1, jnp.where(loses, -1, 0)))


def _motion(m: Ram, ticked: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The player's step after he was drawn; where the landscape was, and its step to the left.

    The landscape moves by the player's speed, less his own step, and by one when the clock ends.
    """
    x = m.player_x
    gains, stays, loses = (_step_from(m, x - step) == step for step in (1, 0, -1))
    part = m.part - m.speed  # the game keeps it from 0 to 31 or from -33 to -2
    part = jnp.where((m.speed > 0) & (m.part >= 0), part & 31, part)
    part = jnp.where((m.speed < 0) & (m.part < 0), ((part + 33) & 31) - 33, part)
    moves = m.phase < BETWEEN
    flown = jnp.where(moves, (part + m.speed - m.part) >> 5, 0) + ticked
    now = m.scroll - jnp.where(m.odd == 1, 0, 160)
    coarse = jnp.where(m.coarse < 128, m.coarse, m.coarse - 122)
    drawn = position(coarse, m.fine) - 1  # the lower lanes
    seen = (drawn > 0) & (m.timer[:2] != JUST_EXPLODES) & ~_moved_on(m)
    shift = jnp.where(seen[0], drawn[0] - m.x[0], drawn[1] - m.x[1])
    step = flown + now - shift
    possible = (gains & (step == 1)) | (stays & (step == 0)) | (loses & (step == -1))
    possible = jnp.any(seen) & possible & (x > 0x15) & (x < 0x82)
    step = jnp.where(possible, step, _usual_step(m, gains, stays, loses))
    step = jnp.where(moves, step, 0)
    moved = flown - jnp.where(jnp.where(step < 0, x < 0x82, x > 0x15), step, 0)
    moved = jnp.where(jnp.any(seen), shift - now, moved)
    block = jnp.where(_moved_on(m), jnp.where(m.odd == 1, -320, 320), 0)
    return step, now + moved + block, moved


def _moved_on(m: Ram) -> jax.Array:
    """Whether the blocks of the landscape have moved on by one on this frame."""
    near = jnp.where(m.odd == 1, m.scroll >= 150, m.scroll < 10)
    return jnp.all(m.lane_state == 0) & near


def _blocks(m: Ram, values: jax.Array) -> jax.Array:
    """A value of each of the four blocks as the frame shows them."""
    back = jnp.where(m.odd == 1, jnp.roll(values, 1), jnp.roll(values, -1))
    return jnp.where(_moved_on(m), back, values)


def _player_row(m: Ram) -> jax.Array:
    up = ((m.stick & 1) != 0) & (m.player_y < HIGHEST)
    down = ((m.stick & 3) == 2) & (m.player_y > LOWEST)
    moved = jnp.where(up, 1, jnp.where(down, -1, 0))
    return m.player_y - jnp.where(m.phase == 0, moved, 0)


def _player(m: Ram, x: jax.Array, y: jax.Array) -> Box:
    right = m.faces_right == 1
    just_hit = (m.phase == DEAD) & (m.pause == JUST_HIT)
    turns = ((m.phase == 0) | just_hit) & (((m.frame - 2) & 2) == 0)  # the rotor
    left, top, width, height = CHOPPERS.extent(jnp.where(turns, 0, 1))
    left = jnp.where(right, left, 8 - left - width)
    there = (m.phase < EXPLODES) | (m.phase >= BETWEEN) | just_hit
    there, facing = there & (m.player_y < OFF), jnp.where(right, EAST, WEST)
    chopper = box(x + 1 + 2 * left, 159 - y + top, 2 * width, height, there, orientation=facing)
    return chopper.clip(*FIELD)


def _lanes(m: Ram, shift: jax.Array) -> tuple[Box, jax.Array]:
    """What flies in the lanes, and where that is a helicopter."""
    hit = m.timer == JUST_EXPLODES  # after the frame, which shows it whole
    helicopter = jnp.where(hit, m.kind == HIT_HELICOPTER, m.kind >= HELICOPTER)
    second = (m.frame - 1) >> 1 & 1
    kind = jnp.where(hit, jnp.where(helicopter, HELICOPTER + second, PLANE), m.kind)
    there = ((m.kind >= PLANE) | hit) & ~_moved_on(m)
    facing = jnp.where(among(kind, WESTWARD), WEST, EAST)
    return _cut(kind, m.x + shift, 158 - m.y, there, facing), helicopter


def _cut(kind: jax.Array, x: jax.Array, y: jax.Array, there: jax.Array, facing: jax.Array) -> Box:
    """Tight boxes of what the edges of the screen cut."""
    left, right = jnp.clip(FIELD[0] - x, 0, 7), jnp.clip(x - 152, 0, 7)
    part = jnp.where(right > 0, 7 + right, left)
    there = there & (x > 0) & (x < 160)
    return KINDS.box(PARTS * kind + part, x, y, valid=there, orientation=facing)


def _trucks(m: Ram, shift: jax.Array, ticked: jax.Array) -> Box:
    convoy = jnp.where(m.wreck >= BLINKING, m.wreck_convoy, _blocks(m, m.convoys)[1])
    there = jnp.stack([among(convoy, convoys) for convoys in PLACES])
    x = jnp.array([64, 96, 128]) + shift
    trucks = _cut(m.truck_kind ^ ticked, x, jnp.full(3, ROAD[1]), there, jnp.full(3, 0))
    return trucks.clip(*ROAD)


def _bombs(m: Ram, shift: jax.Array, scrolled: jax.Array) -> Box:
    """A bomb flies to the side or, on other frames, up or down, and its halves fall apart."""
    sideways, whole = (m.clock == 0) | (m.clock > 128), m.bomb_time >= SPLIT - 1
    x = m.bomb_x - jnp.where(sideways, m.bomb_speed[0], 0) + scrolled
    dy = jnp.where(sideways, 0, m.bomb_speed[1])
    y = m.bomb_y - jnp.where(m.bomb_time >= SPLIT, dy, jnp.array([2, -2]))
    lane = m.x + shift  # a bomb is shown from the second frame on
    fresh = (x == lane + jnp.where(lane < 156, 3, 0)) & (y[0] == m.y + 4)
    there = (m.bomb_time > 0) & (m.bomb_y < OFF) & ~jnp.any(fresh)
    there = there & (np.array([True, False]) | ~whole)
    return box(x - 1, 167 - y, 2, jnp.where(whole, 2, 1), there).clip(*FIELD)


def _shot(m: Ram) -> Box:
    lit = (m.shot[SHOT_BYTE] >> SHOT_BIT & 1) == 1
    column = np.arange(0, 160, 4)
    left, right = jnp.min(jnp.where(lit, column, 160)), jnp.max(jnp.where(lit, column + 4, 0))
    color = m.shot_color + 0x6F ^ 0x0F ^ jnp.maximum(_saver_key(m), 0)  # the saver leaves it
    return box(left, 167 - m.shot_y, right - left, 1, right > left, color=color).clip(*FIELD)


def _radar(m: Ram) -> tuple[Box, Box]:
    """Enemies and trucks on the radar."""
    left = 56 - signed_nibble(m.radar) + 16 * np.arange(4)  # of the blocks
    lanes = [_blocks(m, lane) for lane in (m.low_lane, m.middle_lane, m.top_lane)]
    x = jnp.stack([left + lane - 1 for lane in lanes], 1).reshape(12)
    there = jnp.stack([lane > 0 for lane in lanes], 1).reshape(12)
    enemies = box(x, np.tile([183, 181, 179], 4), 2, 2, there)
    x = jnp.stack([left + column for column in (3, 5, 7)], 1).reshape(12)
    there = jnp.stack([among(_blocks(m, m.convoys), place) for place in PLACES], 1).reshape(12)
    return enemies.clip(*WINDOW), box(x, 185, 1, 2, there).clip(*WINDOW)


enemies = functools.partial(Category, count=3, attributes=("orientation",))
CHOPPER = Blobs(GOLD, FIELD, Shape(w=(3, 16), h=(6, 10)))
vehicles = functools.partial(Blobs, gap=(1, 2), shapes=Shape(w=(1, 8), h=(1, 10)))
BOMBS = Blobs(GOLD, FIELD, (Shape(w=2, h=2, pixels=4), Shape(w=2, h=1)))  # whole, or halves
LIFE = Bounds(GOLD, (30, 24, 110, 33), value=Gauge(8, 8, 2))
LINE = Bounds(LASER, FIELD, (4, 1), max_size=(152, 1), filters=(LoneRuns(2),))
row = functools.partial(Blobs, YELLOW, shapes=Shape(w=(1, 2), h=(1, 2)))
LANES = row((56, 179, 104, 181), also=(row((56, 181, 104, 183)), row((56, 183, 104, 185))))
SCORE = Bounds(GOLD, (33, 16, 81, 23), value=Digits(FONT, tuple(range(33, 81, 8)), 16))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="ChopperCommand",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (8, 15), 136, mask=SAVER_MASK, taken=(136, 38)),
    categories=(
        Category("Player", CHOPPER, attributes=("orientation",), doc="the chopper"),
        enemies("EnemyHelicopter", vehicles(WHITE, FIELD), doc="lanes from the bottom"),
        enemies("EnemyPlane", vehicles(BLUE, FIELD), doc="lanes from the bottom"),
        Category("Truck", vehicles(BLACK, ROAD), count=3, doc="places of the convoy"),
        Category("Bomb", BOMBS, count=2, needs=("Player",), doc="whole or upper half, lower half"),
        Category("Shot", LINE, doc="the line that is left of it"),
        Category("MiniPlayer", Bounds(BROWN, WINDOW), doc="on the radar"),
        Category("MiniEnemy", LANES, count=12, doc="block * 3 + lane"),
        Category("MiniTruck", row((56, 185, 104, 187)), count=12, doc="block * 3 + place"),
        display("Score", SCORE, doc="points"),
        display("Life", LIFE, doc="helicopters in reserve; value: one more"),
    ),
)
