"""Mario Bros."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, edges
from ocjax.console.compass import EAST, WEST
from ocjax.console.ops import lookup, pick, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import larger_part, packed_position, wrap
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

ROM = Rom("mario_bros", "e908611d99890733be31733a979c62d8")
FONT = ROM.font(0x1F00, rows=7, stride=7)
SCORE = NumberDisplay(FONT, right=103, top=13, digits=6, leading_zeros=True)
LEVEL = NumberDisplay(FONT, right=87, top=180, digits=2, leading_zeros=True)
CAPS = IconRow(left=96, top=13, width=7, height=7, pitch=-8)

PICTURE_ROWS = 23
TOP = 14  # line of the screen on which a picture with `y` 0 begins
LEFT = 6  # columns to the right of a picture at which its `x` is
FIELD = (0, 27, 160, 175)


class Ram(RamMap):
    frame = byte(1)
    phase = byte(3)
    shares = bits(4, first=2)  # the fireball is drawn instead of its floor's pest
    level = bcd(5)
    lives = byte(7)
    score = bcd((9, 10))
    shows_lives = byte(29)  # frames for which they are shown instead of the score
    faces_left = bits(27, first=5)
    pose = bits(38, count=4)
    plays = bits(38, first=7)
    y = byte(42)
    x = byte(44)
    pest_code = byte(*range(65, 69))
    pest_low = byte(69, 71, 73, 75)
    pest_high = byte(70, 72, 74, 76)
    pest_y = byte(*range(89, 93))
    coin_y = byte(93, 94)
    pest_x = byte(*range(95, 99))
    coin_x = byte(99, 100)
    bonus_low = byte(*range(101, 105))
    coin_step = byte(105, 106)
    pest = byte(*range(107, 111))
    coin = byte(111, 112)
    fire_on = bits(113, first=7)
    fire_pose = bits(113, count=4)
    fire_left = bits(113, first=4)
    fire_part = byte(114)
    fire_x = byte(115)
    fire_y = byte(116)
    fire_floor = byte(117)
    pow_color = byte(121)


def _at(low: int, high: int, count: int) -> list[int]:
    """Places in the ROM of pointers whose halves are in two tables."""
    pages = ROM.bytes(high, count).astype(int)
    return ((pages << 8 | ROM.bytes(low, count)) & 0xFFF).tolist()


PLAYER = ROM.pictures(_at(0x1C53, 0x1C63, 16), PICTURE_ROWS, top_first=True)
PESTS = sorted(set(_at(0x1BCF, 0x1BF7, 40)))
FIRE = ROM.pictures(_at(0x6B3, 0x6BF, 12), PICTURE_ROWS, top_first=True)
PEST_PICTURES = ROM.pictures(PESTS, PICTURE_ROWS, top_first=True)
PEST_AREA = range(0xB80, 0xE00)
NEAREST = np.array([max([i for i, p in enumerate(PESTS) if p <= a], default=0) for a in PEST_AREA])


def decode(m: Ram) -> dict[str, Box]:
    playing = m.phase >= 2
    pests = _pests(m)
    return {
        "Player": _player(m),
        "Pest": pests,
        "Fireball": _fireball(m),
        "Score": SCORE.box(m.score * 100, valid=m.shows_lives == 0),
        "Level": LEVEL.box(m.level, valid=m.phase != 3),
        "Life": CAPS.box(m.lives - 1, m.shows_lives > 0, value=m.lives - 1),
        "PowBlock": box(72, 141, 16, 7, m.pow_color > 0),
    }


def _player(m: Ram) -> Box:
    left, top, width, height = PLAYER.extent(m.pose, mirrored=m.faces_left == 1)
    compass = jnp.where(m.faces_left == 1, WEST, EAST)
    x = wrap(_column(m.x) + left)
    return box(x, m.y + TOP + top, width, height, m.plays == 1, orientation=compass).clip(*FIELD)


def _pests(m: Ram) -> Box:
    drawn = (m.pest_code != 0) & ~((m.shares == 1) & (m.fire_floor == np.arange(4)))
    here = jnp.where(m.pest != 0, m.pest_y, jnp.roll(m.pest_y, -1))
    pointer = m.pest_high << 8 | m.pest_low
    picture = lookup(NEAREST, pointer + here - 0xB000 - PEST_AREA.start)
    y = lookup(np.array(PESTS), picture) - pointer + 0xB000
    left, top, width, height = PEST_PICTURES.extent(picture)
    low = m.pest_code & 15
    x = _column(packed_position(m.pest_code) - jnp.where(low == 0, -1, 7))
    return box(larger_part(x + left, width), y + TOP + top, width, height, drawn).clip(*FIELD)


def _column(x: jax.Array) -> jax.Array:
    """The column at which a sprite begins: the first loop of its positioning is a column late."""
    return x - LEFT + when(x < 8, 1)


def _fireball(m: Ram) -> Box:
    hidden = m.shares == 0
    rate = lookup(ROM.bytes(0x69B, 12).tolist(), m.fire_pose)
    moved = hidden & ((m.level >= 10) | (m.fire_part < rate))
    x = m.fire_x + when(moved, jnp.where(m.fire_left == 1, 1, -1))
    back = jnp.where(m.fire_pose == 0, 3, m.fire_pose - 1)
    left, top, width, height = FIRE.extent(jnp.where(moved, back, m.fire_pose))
    return box(_column(x) + left, m.fire_y + TOP + top, width, height, m.fire_on == 1)


PEST_RULE = Blobs((0xE6, 0x36, 0x66, 0xAA), FIELD, Shape(w=(3, 8), h=(5, 16)), gap=(1, 1))
FIRE_RULE = Blobs(0x3A, FIELD, Shape(w=(3, 8), h=(5, 16)), gap=(2, 2))
PLAYER_RULE = Blobs((0x76, 0x3E, 0x34, 0xF4), FIELD, Shape(w=(4, 8), h=(14, 23)), gap=(1, 1))

GAME = Game(
    name="MarioBros",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(210, 160),
    categories=(
        Category("Player", PLAYER_RULE, attributes=("orientation",), doc="Mario"),
        Category("Pest", PEST_RULE, count=4, doc="turtles, crabs, flies"),
        Category("Fireball", FIRE_RULE, doc="fireball"),
        Category("PowBlock", Bounds((0x2A, 0x1A, 0x0A), (72, 141, 88, 148)), doc="POW"),
        display("Score", Bounds(0x74, SCORE.area, min_size=(46, 7), value=SCORE.rule(0x74).value), doc="points"),
        display("Level", LEVEL.rule(0xEC), doc="of the game"),
        display("Life", CAPS.rule(0x74, (56, 13, 104, 20), max_size=(45, 7)), doc="caps"),
    ),
)
