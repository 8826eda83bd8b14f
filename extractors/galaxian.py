"""Galaxian: a ship below a formation of aliens, some of which dive at it and drop bombs.
"""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.console.boxes import Box, box
from ocjax.console.ops import among, lookup, match, only, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.rules import Blobs, Bounds, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed

ROM = Rom("galaxian", "211774f4c5739042618be8ff67351177")
BANK = 0x1000  # of the display program, at $F000; the other one is at $D000
FONT = ROM.font(BANK + 0xF00, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=103, top=4, digits=6)
ROUND = NumberDisplay(replace(FONT, pitch=9), right=145, top=188, digits=2)
LIVES = IconRow(left=19, top=188, width=3, height=7, pitch=5)

FIELD = (16, 16, 144, 184)
BLACK = 0
WHITE = 0x0E
YELLOW = 0xFC
GOLD = 0x2A
ROW_COLORS = np.array((WHITE, 0x44, 0x56, 0x0A, 0x0A, 0x0A))  # of the upper parts
RED = 0x48
PURPLE = 0x6A
GREEN = 0xD8
DIVER_COLORS = (WHITE, RED, PURPLE, GREEN)
PINK = 0x4A
GRAY = 0x0C

LINES = 12  # of a row of the formation
FORMATION_TOP = 19
SHIP_ROW = np.arange(42) // 7
SHIP_COLUMN = np.arange(42) % 7
FLAP_TURN = np.array((5, 0, 3, 1, 4, 2))[SHIP_ROW]

DIVERS = np.arange(5)
ESCORT_BITS = np.array((4, 2, 1))
ESCORT_LEFTS = np.array((-16, 0, 16))
PICTURE_ROWS = 10
BASES = (0x50, 0x66, 0x7C, 0x92, 0xA8, 0xBE, 0xD4, 0xEA)
_PICTURE_ROWS = ROM.rows([BANK + 0xE00 + base for base in BASES], PICTURE_ROWS, top_first=True)
_ROW = np.arange(PICTURE_ROWS)
PICTURES = Pictures.of(
    [
        np.where((_ROW >= -cut) & (_ROW < PICTURE_ROWS - cut), rows, 0)
        for rows in _PICTURE_ROWS
        for cut in range(-PICTURE_ROWS, PICTURE_ROWS + 1)
    ],
    picture=len(BASES),
    cut=2 * PICTURE_ROWS + 1,
)


def _picture_numbers() -> np.ndarray:
    """Numbers of pictures, by state; then of those that return, by fours of lines that are left."""
    start, dive, back = ROM.bytes(0xEBA, 8), ROM.bytes(0xEB2, 8), ROM.bytes(0xEC6, 5)
    state = np.arange(128)
    turn = np.minimum((state & 63) >> 2, 7)
    low = start[np.where(state & 64, turn, 7 - turn)]
    return np.searchsorted(BASES, np.concatenate([low, dive.repeat(16), back])).astype(np.int32)


PICTURE_NUMBERS = _picture_numbers()
RETURN = 256


def _steps() -> np.ndarray:
    """Columns to the right and lines down, packed."""
    paths, turns, amounts = ROM.bytes(0xECB, 64), ROM.bytes(0xF0B, 64), ROM.bytes(0xF4B, 16)
    amounts = (amounts ^ 128) - 128
    weave = paths & 3
    columns = np.stack(
        [
            amounts[np.where(weave == 3, 7, weave)],
            amounts[paths >> 2 & 7],
            amounts[paths >> 5],
            amounts[turns >> 4],
            -np.roll(amounts[turns & 15], 1),
        ]
    )
    up = np.zeros((5, 64), int)
    up[4] = np.roll(ROM.bytes(0xF2B, 64) >> 2 & 1, 1)
    return (2 * (columns + 16) + up).ravel().astype(np.int32)


STEPS = _steps()
SWOOP = 4


class Ram(RamMap):
    hit_index = byte(8)
    hit = byte(10)
    missile_y = byte(11)
    masks = byte(*range(12, 18))
    bombs = bits(*range(20, 33), count=3)
    fire = byte(34)
    offset = byte(36)
    goes_left = bits(37, first=7)
    turned_at = byte(37)
    rows = bits(*range(38, 44), count=7)
    gone = bits(41, first=7)
    score = bcd((44, 45, 46))
    round = bcd(47)
    clock = byte(48)
    death = byte(50)
    lowest = byte(53)
    escorts = byte(55)
    lives = byte(57)
    player_code = byte(59)
    missile_x = byte(60)
    blast_x = byte(61)
    blast = byte(62)
    hit_row = bits(62, count=3)
    x = byte(*range(64, 69))
    y = byte(*range(69, 74))
    state = byte(*range(74, 79))
    kind = bits(*range(79, 84), count=3)
    column = bits(*range(79, 84), first=3, count=3)
    explodes = bits(*range(79, 84), first=6)
    dives = bits(*range(79, 84), first=7)
    escort_hit = bits(85, count=2)
    leader = bits(86, count=3)
    leader_time = bits(86, first=3, count=4)
    fast = bits(94, first=6)
    player_x = byte(100)
    death_tune = byte(101)
    bomb_x = byte(*range(102, 110))


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    return {
        "Player": box(m.player_x + 8, 170, 8, 14, _ship_shown(m)),
        "EnemyShip": _formation(d),
        "DivingEnemy": _diver_boxes(m, d),
        "PlayerMissile": box(m.missile_x + 2, m.missile_y + 16, 1, 3, among(m.missile_y, range(1, 168)) & ~_begins(m)),
        "EnemyMissile": _bomb_boxes(m, d),
        "Score": SCORE.box(m.score),
        "Lives": LIVES.box(m.lives + when(_begins(m), 1), value=m.lives + 1),
        "Round": ROUND.box(m.round),
    }


@dataclass(frozen=True)
class Drawn:
    offset: jax.Array
    rows: jax.Array
    x: jax.Array
    y: jax.Array
    picture: jax.Array
    there: jax.Array
    escorts: jax.Array
    leads: jax.Array


def as_drawn(m: Ram) -> Drawn:
    turn = m.clock & 7
    moved = ((turn & 1) == 0) | (turn == 5)
    leads = m.leader == DIVERS
    just = when(moved, 1)
    # formation
    end = 34 + 32 * 0
    offset = m.offset - when(turn == 1, 1 - 2 * m.goes_left)
    launched = moved & ((m.state & 0xBF) == 0) & (m.explodes == 0) & (m.y > 0)
    hit_diver = m.hit == 64
    # divers
    swoops, returns = m.state < 128, (m.dives == 0) & (m.state >= 128)
    variant = match((swoops, SWOOP), (m.kind > 2, 0), (m.kind == 2, 2), otherwise=1)
    variant = variant + when(~swoops, m.fast)
    step = lookup(STEPS, 64 * variant + (m.state & 63))
    dx = ((step >> 1) - 16) * jnp.where((m.state & 64) > 0, -1, 1)
    dx = jnp.where(returns, when((m.clock & 15) == 0, 1 - 2 * m.goes_left), dx)
    dy = jnp.where(swoops & ((step & 1) == 1), -1, 1)
    bursts = (m.explodes == 1) & ~leads
    struck = hit_diver & (m.explodes == 1) & jnp.where(leads, m.leader_time == just, m.state == just)
    still = ~moved | bursts
    x = m.x - when(~still, dx)
    y = LINES * (m.y >> 4) + (m.y & 15) - 9 - when(~still, dy)
    state = jnp.where(still | returns, m.state, (m.state - 1 & 127) | (m.state & 128))
    left = (m.state & 63) - y
    left = jnp.where(among(left, range(16)), left >> 2, 4)
    picture = lookup(PICTURE_NUMBERS, jnp.where(returns, RETURN + left, state))
    arrives = returns & moved & (m.y == 1)
    there = (m.y > 0) & (m.y < 0xF0) & ~launched & ~arrives & (~bursts | struck)
    escorts = m.escorts | when(jnp.any(struck & leads), 4 >> m.escort_hit)
    # ships
    bit = jnp.where(leads, m.escorts << 5, 64) >> m.column
    back = jnp.sum(jnp.where((m.kind[None] == np.arange(6)[:, None]) & launched[None], bit[None], 0), axis=1)
    apart = jnp.maximum(offset - 3, 0) >> 5
    left = jnp.clip((m.blast_x - 11 - (offset >> 1)) * 2 // 33, 0, 7)
    shot = when((m.blast < 64) & (m.hit_row == np.arange(6)), 64 >> left)
    rows = jnp.where(turn == 1, m.rows | shot, (_shown_bits(m.masks) << apart) & 127) | back
    rows = when((np.arange(6) <= m.lowest), rows)
    fresh = (m.turned_at == m.clock) & ((m.offset == 16) | (m.offset == 18)) & (m.missile_y > 0)
    rows = when(~fresh, rows)
    return Drawn(offset, rows, x, y, picture, there, escorts, leads)


def _shown_bits(mask: jax.Array) -> jax.Array:
    return (
        (mask & 4) << 4 | (mask & 8) << 2 | (mask & 1) << 4 | (mask & 2) << 2
        | (mask & 32) >> 3 | (mask & 64) >> 5 | (mask & 16) >> 4
    )


def _ship_shown(m: Ram) -> jax.Array:
    return ((m.gone == 0) & ~_begins(m)) | ((m.death == 129) & (m.death_tune == 62))


def _begins(m: Ram) -> jax.Array:
    return (m.player_x == 69) & (m.player_code != 187) & (m.gone == 0)


def _formation(d: Drawn) -> Box:
    apart = jnp.maximum(d.offset - 3, 0) >> 5
    x = 19 + (33 * (SHIP_COLUMN + apart) + 1 >> 1) + (d.offset - 32 * apart >> 1)
    short = when((d.offset + 2 * FLAP_TURN - 3 & 15) < 4, 1)
    y = FORMATION_TOP + LINES * SHIP_ROW + short
    there = jnp.repeat(d.rows, 7) >> 6 - SHIP_COLUMN & 1 == 1
    return box(x, y, 6, 9 - short, there, color=ROW_COLORS[SHIP_ROW])


def _diver_boxes(m: Ram, d: Drawn) -> Box:
    x = jnp.concatenate([d.x, only(d.leads, d.x) + ESCORT_LEFTS]) + 8
    y = jnp.concatenate([d.y, jnp.repeat(only(d.leads, d.y), 3)]) + 16
    picture = jnp.concatenate([d.picture, jnp.repeat(only(d.leads, d.picture), 3)])
    led = jnp.any(d.leads & d.there) & ((d.escorts & ESCORT_BITS) > 0)
    there = jnp.concatenate([d.there & ~d.leads, led])
    cut = jnp.clip(y + PICTURE_ROWS - FIELD[3], 0, PICTURE_ROWS)
    cut = cut - jnp.clip(FIELD[1] - y, 0, PICTURE_ROWS)
    index = PICTURES.index(picture=picture, cut=cut + PICTURE_ROWS)
    kind = jnp.concatenate([m.kind, jnp.ones(3, jnp.int32)])
    color = lookup(DIVER_COLORS, kind)
    return PICTURES.box(index, x, y, valid=there, color=color).clip(*FIELD)


def _bomb_boxes(m: Ram, d: Drawn) -> Box:
    turn = m.clock & 7
    shifted = among(turn, (1, 3, 7))
    bombs = when(np.arange(1, 14) > m.lowest, m.bombs)
    high = jnp.sum(bombs[:10] << 27 - 3 * np.arange(10))
    low = jnp.sum(bombs[10:] << 27 - 3 * np.arange(3))
    steps = []
    for _ in range(8):
        first = jnp.where(high > 0, lax.clz(high), 30 + lax.clz(low))
        steps.append(first)
        high, low = high & ~_bit(high), jnp.where(high > 0, low, low & ~_bit(low))
    step = jnp.stack(steps) + 1
    there = step < 62
    new = (turn == 3) & (np.arange(8) == m.hit_index + 1) & ~among(m.fire, (5, 8, 10, 12))
    step = step - when(shifted, 1)
    return box(m.bomb_x + 11, 24 + 4 * step, 1, 4, there & ~new & (step < 40), color=PINK)


def _bit(word: jax.Array) -> jax.Array:
    """The highest bit of a word."""
    return jnp.int32(1) << 31 - lax.clz(word)


def _ship_runs() -> tuple[Run, ...]:
    runs = []
    for row, color in enumerate(ROW_COLORS.tolist()):
        line = FORMATION_TOP + LINES * row + 1
        runs += [
            Run(color, line, left=(16, 142), width=2, height=8, before=2, above=1, after=2),
            Run(color, line, left=(16, 142), width=4, height=8, before=1, after=1),
        ]
    return tuple(runs)


SHIPS = Runs(_ship_runs(), most=7, gap=2, columns=(16, 144))
COLORED = (GREEN, PURPLE, RED)
DIVER_SHAPES = (
    Shape(w=(2, 8), h=(1, 10), pixels=(1, 86)),
    Shape(w=(2, 13), h=(11, 20), split=(8, 10)),
    Shape(w=(9, 13), h=(1, 10), split=(8, 10)),
)
WHITE_SHAPE = Shape(w=(6, 8), h=(9, 10), pixels=(74, 86))
FLAGSHIPS = Blobs(WHITE, (16, 91, 144, 168), WHITE_SHAPE, gap=(2, 1))
DIVING = Blobs(COLORED, FIELD, DIVER_SHAPES, gap=(2, 1), also=(FLAGSHIPS,))
BELOW = (16, 32, 144, 184)
BOMBS = Blobs((PINK, WHITE, *COLORED), BELOW, Shape(w=1, h=4))
MISSILE = Bounds(GOLD, FIELD, max_size=(1, 3))
SHIP = Bounds(WHITE, (16, 170, 144, 184), min_size=(8, 14), max_size=(8, 14), exclude=("EnemyMissile",))

GAME = Game(
    name="Galaxian",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", SHIP, doc="the ship"),
        Category("EnemyShip", SHIPS, count=42, doc="in the formation: row * 7 + column"),
        Category("DivingEnemy", DIVING, count=8, doc="five records, three escorts"),
        Category("PlayerMissile", MISSILE, doc="the ship's shot"),
        Category("EnemyMissile", BOMBS, count=8, doc="bombs"),
        display("Score", SCORE.rule(YELLOW), doc="points"),
        display("Lives", LIVES.rule(GRAY, (16, 188, 40, 195), single=2), doc="lives"),
        display("Round", ROUND.rule(GRAY), doc="the round"),
    ),
)
