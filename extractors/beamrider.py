"""Beam Rider: a ship below on five beams, saucers and other enemies that come down them, shots of both sides, the sentinel above.

The eight records (seven enemies, the player's shot) have a slot each of their categories. What the ship has hit is an Explosion.

RAM: ALE's source (score, lives), OCAtari 2.2 (records), and the ROM's code: the list that is drawn is made every second frame from the
records, which move after it is made, so what is drawn is one step of the records back; the step follows from what the record is, from
its speed or the script that it follows, and from the frame counter. A line of the screen is a table of the record's depth, the column
a product of line and lane; the picture follows from kind and depth.

Covered: sectors 1 to 20, all kinds of enemies, deaths, game over, the sentinel. Not exact: the step back where a record has just
changed what it does; the few lines by which one of two objects near each other is shifted, and which is left out on a frame; an enemy other
than a saucer when it is hit (it is in no category then); the torpedoes when a life begins. Scenery without a box: the beams' lines and
dots, the maker's name. REM takes 170 ns, of which 70 are for the 76 slots, 30 for their 18 groups, 23 for lookups; OCAtari 36 us.
"""

import functools
import pathlib

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ops import shared
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Cells

SCORE, AMOUNT, TORPEDO, YELLOW = 42, 212, 98, 26
FIELD, SHIP = (0, 44, 160, 164), tuple(range(64, 112, 2))
GLYPHS = tuple("3c6666666666663c 183818181818183c 3c4606063c60607e 3c46060c0c06463c 0c1c2c4c7e0c0c0c "
               "7e60607c0606467c 3c62607c6666663c 7e42060c18181818 3c66663c3c66663c 3c6666663e06463c".split())  # fmt: skip
NARROW = tuple("1e3333333333331e 0c1c0c0c0c0c0c1e 1e2303031e30303f 1e2303060603231e 060e16263f060606 "
               "3f30303e0303233e 1e31303e3333331e 3f2103060c0c0c0c 1e33331e1e33331e 1e3333331f03231e".split())  # fmt: skip
with np.load(pathlib.Path(__file__).parent / "_data" / "beamrider.npz") as data:
    LINES = data["lines"]  # line of the list for each depth; 0: none
    PICTURES = data["pictures"]  # left | width << 4 | top << 8 | height << 12
    SCRIPT = data["script"]  # of the saucers: what to do << 8 | speed


class Ram(RamMap):
    sector, last = bcd(0), bits(0, count=4)
    clock = bits(1, count=4)  # steps
    drift, speed = byte(4), byte(7)  # of the saucers; of the others
    icons = byte(5)
    score = bcd((11, 10, 9))
    ones, first = bits(9, count=4), bits(11, first=4, count=4)
    ship = bits(14, first=3, count=5)  # picture
    steps = byte(17, 18, 19)  # place in the script
    y, shot_y = byte(*range(25, 32)), byte(32)  # depth; 0 horizon, 255 none
    x, shot_x = byte(*range(33, 40)), byte(40)  # 128 is the middle
    ship_x, sentinel_x = byte(41), byte(52)
    kind, shot = byte(*range(42, 49)), byte(49)
    rate = byte(*range(50, 57))  # time, or speed to the side
    torpedoes = byte(83)
    enemies = byte(84)  # left; 255 while the sentinel passes
    colors, lines = byte(*range(85, 92)), byte(*range(93, 100))  # of the list
    half = byte(101)  # 0 or 255: the list is new, and not drawn yet


def decode(m: Ram) -> dict[str, Box]:
    i3, i13 = jnp.arange(3), jnp.arange(13)
    state = m.kind & 63
    tick = jnp.sum((m.clock >> jnp.arange(4) & 1) << (3 - jnp.arange(4))) + 1
    new = (m.half == 255) | (m.half == 0)
    saucer, hit = jnp.arange(7) < 3, (state == 6) & (m.rate == 8)
    script = jnp.asarray(SCRIPT, jnp.int32).at[m.steps].get(mode="promise_in_bounds")
    op, pace = script >> 8, script & 255
    s_state, s_hit = state[:3], hit[:3]
    follows = (s_state == 4) | (s_state == 5) | s_hit
    drift = _step(m.drift, tick)
    s_dy = jnp.where(op == 3, _step(pace, tick), jnp.where(op == 2, _step(-pace, tick), drift))
    s_dy = jnp.where(follows, s_dy, jnp.where(s_state == 1, _step(0xB3, tick), 0))
    right = (op & 1) ^ (s_state & 1) == 1
    s_dx = jnp.where(op < 2, jnp.where(right, _step(pace, tick), _step(-pace, tick)), 0)
    s_dx = jnp.where(follows, s_dx, jnp.where(s_state == 2, -1, jnp.where(s_state == 3, 1, 0)))
    k, v, rate, flag = (
        state[3:],
        m.speed,
        m.rate[3:],
        m.kind[3:] >> 6,
    )  # 1: goes with the saucers; 2: back
    pace = jnp.where(k <= 3, v + jnp.where(k == 1, 0x2D, 0), v + jnp.where(k == 5, 0x0E, 0x13))
    pace = jnp.where((k == 15) & (rate < 128), jnp.where(rate > 0, 0, 8), pace)
    pace = jnp.where((k >= 12) & (k < 16) & (flag > 1), 0x8D, pace)
    pace = jnp.where((k >= 16) & (k < 20), (v >> 1) + 0x13, pace)
    pace = jnp.where((k >= 24) & (k < 28), v + 0x0C, pace)
    pace = jnp.where(k == 33, v + 0xFB, jnp.where(k == 34, 0xE0 - v, pace))
    sideways = (k == 4) | (k >= 28) & (k <= 32) | (k >= 20) & (k < 24) & (flag > 1)
    o_dy = jnp.where(
        new & ~sideways, jnp.where((k >= 6) & (k < 12), -2, _step(pace, tick)), 0
    ) + jnp.where(flag & 1 == 1, drift, 0)
    o_dx = jnp.where(new & sideways, _step(rate, tick), 0)
    bursts = (state >= 6) & (state < 12) & ~hit
    odd = jnp.where(saucer | new, m.clock & 1, 0)
    dy = jnp.concatenate((jnp.where(bursts[:3], -2, s_dy), o_dy))
    dx = jnp.concatenate((jnp.where(bursts[:3], 0, s_dx), o_dx))
    y, x = jnp.where(m.y == 0, 0, m.y - dy), m.x - dx

    def near(*limits: int) -> jax.Array:
        return jnp.sum(jnp.where(y[:, None] >= jnp.array(limits)[None], 1, 0), axis=1)

    disk = 0x27 + near(0x30, 0x50, 0x70, 0x90, 0xB8)
    back = m.kind >= 128
    spin = jnp.where(
        back,
        jnp.where(state == 30, 31, jnp.where(state == 31, 30, state + 1)),
        jnp.where(state == 28, 29, state - 1),
    )
    other = jnp.where(new & (state >= 28) & (state < 32), spin, state)
    other = jnp.where((state >= 12) & (state < 28), (state & 60) + near(0x68, 0x90, 0xB0), other)
    other = jnp.where(
        (state == 2) | (state == 3),
        state ^ odd,
        jnp.where(bursts, jnp.maximum(state - odd, 6), other),
    )
    is_saucer = saucer & ((state > 0) & (state < 6) | hit)
    at = jnp.where(is_saucer, disk, other)
    far = is_saucer & (y < 32)
    struck = m.shot == 192
    target = jnp.max(jnp.where(hit, m.y + 1, 0))
    gone = (
        new & (m.shot & 63 == 0) & jnp.any(((m.lines == 104) | (m.lines == 101)) & (m.colors == 54))
    )
    shot_y = jnp.where(
        struck, (target & ~7) + 14, jnp.where(gone, 102, m.shot_y + jnp.where(new, 8, 0))
    )
    laser = (m.shot == 35) | struck & (target > 0) | gone
    picture = jnp.where(
        laser, 35, 36 + jnp.where(shot_y >= 0x4E, 1, 0) + jnp.where(shot_y >= 0x80, 1, 0)
    )
    flies = (m.shot >= 36) & (m.shot < 39)
    all_y, all_x = jnp.append(y, shot_y), jnp.append(x, m.shot_x)
    *area, seen = shared(_place(all_x, all_y, jnp.append(at, picture)))

    def top(slots: slice | int, valid: jax.Array) -> Box:
        return box(*(side[slots] for side in area), valid=valid & seen[slots])

    three, four, all7 = slice(0, 3), slice(3, 7), slice(0, 7)
    saucers = top(three, is_saucer[:3])
    before = (y[:3][None] < y[:3][:, None]) | (y[:3][None] == y[:3][:, None]) & (
        i3[None] > i3[:, None]
    )
    third = jnp.sum(jnp.where(before & far[:3][None], 1, 0), axis=1) == 2  # drawn in another way
    side = x[:3] - jnp.where(third, 128, 123)
    dot_x = jnp.where(third, 84, 80) + jnp.where(side >= 0, side * 84 >> 7, -(-side * 84 >> 7))
    dot, near_by = (
        (dot_x, jnp.int32(43), jnp.int32(1), jnp.int32(1)),
        (saucers.x, saucers.y, saucers.w, saucers.h),
    )
    saucers = box(
        *(jnp.where(far[:3], a, b) for a, b in zip(dot, near_by, strict=True)),
        valid=far[:3] | saucers.valid,
    )
    explodes, one, drive = m.ship == 0x98 >> 3, m.first == 1, m.sentinel_x - 7
    units = jnp.where(m.enemies >= 10, m.enemies - 10, m.enemies)
    slim = jnp.where(units == 1, 1, 0)
    left = jnp.where(m.enemies >= 10, 20, 25 + slim)
    return {
        "Player": box(
            77 + (3 * (m.ship_x - 128) >> 1),
            jnp.where(explodes, 168, 164),
            15,
            jnp.where(explodes, 12, 16),
        ),
        "Saucer": saucers,
        **{name: top(four, (k >= first) & (k <= last)) for name, first, last, *_ in FOUR},
        "Explosion": top(all7, bursts & (at < 10)),
        "Sparks": top(all7, bursts & (at >= 10)),
        "Player_Projectile": top(7, laser & (shot_y <= 206)),
        "Torpedos": top(7, flies & (shot_y <= 206)),
        "Sentinel": box(
            9 + (drive + (drive >> 2) + (drive >> 1 & 1) >> 1), 37, 16, 7, m.enemies > 127
        ),
        "Torpedos_Available": box(128 + 8 * i3, 32, 4, 8, i3 + m.torpedoes >= 3),
        "Enemy_Amount": box(left, 32, 31 - slim - left, 8, m.enemies < 128, m.enemies),
        "HUD": box(
            61 + jnp.where(one, 1, 0),
            10,
            46 - jnp.where(one, 1, 0) - jnp.where(m.ones == 1, 1, 0),
            8,
            value=m.score,
        ),
        "Sector": box(60, 21, 47 - jnp.where(m.last == 1, 1, 0), 8, value=m.sector),
        "Life": box(32 + 9 * i13, 183, 5, 7, i13 < jnp.where(m.icons < 128, m.icons, 0)),
    }


def _step(pace: jax.Array | int, tick: jax.Array) -> jax.Array:
    """How far a speed moves now: a signed high nibble, and one more in as many of sixteen steps as the low nibble says."""
    pace = pace & 255
    return ((pace >> 4 ^ 8) - 8) + jnp.where((pace & 15) >= tick, 1, 0)


def _place(x: jax.Array, y: jax.Array, picture: jax.Array) -> tuple[jax.Array, ...]:
    """Left, top, width and height of the picture on the screen, and whether it shows."""
    line = jnp.asarray(LINES, jnp.int32).at[jnp.clip(y, 0, 255)].get(mode="promise_in_bounds")
    spread = 0xC6 - line + (line >> 4) + (line >> 3 & 1)
    left = 80 + jnp.where(x >= 128, (x - 128) * spread >> 7, -((128 - x) * spread >> 7))
    extent = jnp.asarray(PICTURES, jnp.int32).at[picture & 63].get(mode="promise_in_bounds")
    return (
        left + (extent & 15),
        164 - line + (extent >> 8 & 15),
        extent >> 4 & 15,
        extent >> 12,
        (line > 0) & (left < 158),
    )


FOUR = (  # of the records that are no saucers: first and last kind, rule, what it is
    ("Rejuvenator", 16, 19, Blobs(24, FIELD, min_size=(3, 2), max_size=(5, 7)), "yellow: a life"),
    (
        "Debris",
        1,
        1,
        Blobs(52, FIELD, gap=(1, 1), max_size=(7, 7)),
        "what a shot leaves of a rejuvenator",
    ),
    ("Rock", 24, 27, Blobs(20, FIELD, max_size=(8, 6)), "brown"),
    ("Chriper", 28, 31, Blobs(26, FIELD, min_size=(8, 7), max_size=(8, 7)), "yellow, across"),
    ("Blocker", 4, 5, Blobs(216, FIELD, gap=(1, 1), max_size=(8, 7)), "green"),
    (
        "Bouncecraft",
        32,
        34,
        Blobs(218, FIELD, max_size=(8, 7)),
        "green, cannot be hit by the laser",
    ),
    ("Charger", 12, 15, Blobs(202, FIELD, max_size=(8, 7)), "come fast"),
    ("Jumper", 20, 23, Blobs(40, FIELD, max_size=(7, 6)), "orange"),
    (
        "Enemy_Projectile",
        2,
        3,
        Blobs((104, 86), FIELD, min_size=(2, 2), max_size=(4, 6), area=(8, 12)),
        "shots",
    ),
)
BURST = Blobs((26, 24, 22, 14), FIELD, min_size=(7, 7), max_size=(8, 8), area=(17, 25))
PASSING = Blobs((140, 66, 68, 218, 58), (0, 37, 160, 44), min_size=(8, 4), max_size=(16, 7))
hud, number = (
    functools.partial(Category, hud=True),
    functools.partial(Category, hud=True, attributes=("value",)),
)


def digits(top: int, glyphs: tuple[str, ...], width: int, *lefts: int) -> Digits:
    return Digits(hex_font(glyphs, width, (1, 1)), lefts, top)


GAME = Game(
    name="BeamRider",
    rom="beam_rider",
    md5="79ab4123a83dc11d468fb2108ea09e2e",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(
                (*SHIP, YELLOW, 86),
                (0, 164, 160, 180),
                gap=(4, 2),
                min_size=(9, 9),
                max_size=(15, 16),
            ),
            doc="the ship",
        ),
        Category(
            "Saucer",
            Blobs((8, 14), (0, 43, 160, 164), max_size=(8, 6)),
            count=3,
            doc="white saucers; dots at the horizon",
        ),
        *(Category(name, rule, count=4, doc=doc) for name, _, _, rule, doc in FOUR),
        Category("Explosion", BURST, count=7, doc="what was hit"),
        Category(
            "Sparks",
            Blobs((38, 86), FIELD, gap=(2, 1), min_size=(7, 5), max_size=(8, 5)),
            count=7,
            doc="its end",
        ),
        Category("Player_Projectile", Blobs(54, FIELD, max_size=(8, 5)), doc="the laser"),
        Category(
            "Torpedos",
            Blobs(104, FIELD, min_size=(3, 3), max_size=(5, 5)),
            doc="a torpedo on its way",
        ),
        Category("Sentinel", PASSING, doc="passes above when no enemies are left"),
        hud(
            "Torpedos_Available",
            Cells(TORPEDO, (128, 136, 144), (32,) * 3, 4, 8),
            count=3,
            doc="left in this sector",
        ),
        number(
            "Enemy_Amount",
            Bounds(AMOUNT, (15, 30, 40, 43), value=digits(32, NARROW, 6, 19, 25)),
            doc="enemies left in this sector",
        ),
        number(
            "HUD",
            Bounds(SCORE, (56, 8, 110, 19), value=digits(10, GLYPHS, 8, *range(60, 101, 8))),
            doc="the score",
        ),
        number(
            "Sector",
            Bounds(SCORE, (56, 20, 110, 30), value=digits(21, GLYPHS, 8, 92, 100)),
            doc="the sector's number",
        ),
        hud(
            "Life", Blobs(YELLOW, (0, 182, 160, 194), max_size=(5, 7)), count=13, doc="spare ships"
        ),
    ),
)
