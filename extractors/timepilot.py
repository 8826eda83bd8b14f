"""Time Pilot: a jet in the middle of the sky, and enemies that fly around it, in five eras.

The colour of the enemies tells the era, and so does their category: green biplanes (1910), black
ones (1940), yellow helicopters (1970), blue jets (1983), orange saucers (2001). The mother ship,
which comes when no enemies are left, is an enemy of its era. Slots of enemies: the game's four
records, and then the parts of the same four that a plane at the upper edge has at the lower edge.
A plane that explodes stays an object until it is gone. Clouds, the purple bars beside the lives,
and the texts before a flight are scenery, but Score has the box of the text in its place. The icons
of Enemies_Left stand for four enemies each, and so its value is a multiple of four: the most that
can be left.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code. The sync at F051 is followed by
the steps at F346 and the drawing at F8E6, after which only F0AB changes the states and the pictures
of a hit. Every lane of 16 rows has a place for a plane. Shots are drawn on even rows: the enemies'
two by turns, the jet's shot by turns at its place and at the place before.

Covered: all eras and mother ships (written to RAM), all difficulties, the flight through time, lost
lives, the end of the game. Not exact: clouds in the lower half hide shots and parts of planes,
black lines what is at the left edge; a plane hides its new shot; none is drawn where `y` is a
multiple of 16. VEM sees no shot at the jet's nose or within 2 columns of a plane, whose tips look
like shots; it reads no score where a text is in its place, and takes the era from a pixel of sky
that clouds may hide.
"""

import functools
import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import lookup, pick
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import wrap
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Gauge
from ocjax.vision.shades import Shades
from ocjax.vision.shapes import Shape

ROM = Rom("time_pilot", "fc2104dd2dadf9a6176c1c1c8f87ced9")
FONT = ROM.font(0xD00, rows=10)
BANK = 0x1000  # offset of the pictures, which are at $D000

ERAS = "Green", "Black", "Yellow", "Blue", "Orange"
HEAVEN, CLOUDS, JET, ENEMY = (
    ROM.bytes(at, 5).tolist() for at in (0xD88, 0xD8D, 0xD92, 0xD97)
)  # colours by era
WARP_WHITE = 0x0E
GOLD = 0x2A
TEXT = 0x28
VIOLET = 0x8A
RED = 0x42
UNUSED = (ENEMY[0], 3, 5, 7, 9)  # stand for the enemies of other eras; no frame has the odd ones
PAGES = [int(page) for page in ROM.bytes(0xE3E, 5)]  # of the enemies' pictures by era
# eras with two pages
FIRST_PAGE = 0xD8
N_PAGES = 7
ANIMATED = (2, 4)
EAST_PICTURE = 0x4C
BOSS_PICTURE = 0xC6
EXPLOSION = 0xA6
LOOKS = (*(int(p) for p in ROM.bytes(0xDD8, 8)), BOSS_PICTURE, EXPLOSION)  # eight ways first
# of LOOKS
BOSS = 8
EXPLODES = 9
JET_LOOKS = tuple(int(p) for p in ROM.bytes(0xECD, 8))  # by way
# `look`
JET_EXPLODES = 0x7C
JET_GONE = 0x8C

SKY = (0, 33, 160, 177)
LANE = 16
LATE = 20  # least `x` at which the picture is set before the first row is over
NOSE = (76, 97, 84, 113)  # around the jet
# `state`
READY = 1
FLIES = 2
BLANKED = 0x80  # least `idle` of a blank screen
# of `flags`
HIT = 0x80
MOTHER = 0x40
DONE = 0x40  # of `player`: the era is over
SHOWN = 0x80  # the texts were shown
STEP_X = np.array([0, 4, 4, 4, 0, -4, -4, -4]).tolist()  # of shots, by way
STEP_Y = np.array([4, 4, 0, -4, -4, -4, 0, 4]).tolist()  # upwards
# of the clock, modulo 8: enemies shoot, shots move
SPAWN = 5
MOVES = (2, 7)
HIGHEST_SHOT = 0x8E
# of the clouds across and of their rows in a lane
CLOUD_PLACES = 21
CLOUD_ROWS = range(0, 28, 4)

REVERSED = np.array([int(f"{byte_:08b}"[::-1], 2) for byte_ in range(256)])
ENEMY_ROWS = [
    ROM.rows(BANK | (page & 0xF) << 8 | look, LANE)
    for page in range(FIRST_PAGE, FIRST_PAGE + N_PAGES)
    for look in LOOKS
]


def _cuts() -> Pictures:
    """The pictures as they are cut by edges.

    Without 2 and 1 columns on the left, whole, and without 1 and 2 on the right; of each of these,
    first the lowest 1 to 16 rows, and then what is left above them.
    """
    row = np.arange(LANE)[::-1]
    columns = (0x3F, 0x7F, 0xFF, 0xFE, 0xFC)
    seen = [rows & columns_ for rows in ENEMY_ROWS for columns_ in columns]
    parts = (row <= cut for cut in range(LANE)), (row > cut for cut in range(LANE))
    kept = [rows for part in parts for rows in part]
    return Pictures.of([np.where(k, rows, 0) for rows in seen for k in kept])


def _behind_clouds(rows: np.ndarray) -> list[np.ndarray]:
    """A picture of the jet whole, and then as it is behind each cloud at each place in its lane."""
    out = [rows]
    for place, below in itertools.product(range(CLOUD_PLACES), CLOUD_ROWS):
        starts = [int(ROM.bytes(at + place, 1)[0]) for at in (0xF15, 0xF3F)]
        pages = [int(ROM.bytes(at + place, 1)[0]) & 15 for at in (0xED5, 0xF00)]
        cloud = [
            ROM.bytes(BANK | page << 8 | start + below, LANE)[::-1][::2].repeat(2).astype(int)
            for page, start in zip(pages, starts, strict=True)
        ]
        right, left = cloud[0] & 0x10, cloud[1] & 0x80
        out.append(rows & np.where(left > 0, 0x0F, 0xFF) & np.where(right > 0, 0xF0, 0xFF))
    return out


CUTS = _cuts()
WHOLE = 2  # of the five cuts of columns
JET_ROWS = [ROM.rows(BANK | 0x500 | look, LANE) for look in (*JET_LOOKS, *[JET_EXPLODES] * 2)]
MIRRORED = np.array([0, 0, 0, 0, 1, 1, 1, 1, 0, 1])
JETS = Pictures.of(
    [
        shown
        for rows, flip in zip(JET_ROWS, MIRRORED, strict=True)
        for shown in _behind_clouds(REVERSED[rows] if flip else rows)
    ]
)


class Ram(RamMap):
    state = byte(0)
    clock = byte(1)  # of the next frame
    idle = byte(3)
    timer = byte(4)  # frames of a state
    player = byte(9)
    lives = bits(11, count=3)  # in reserve
    score = bcd((15, 13))  # hundreds
    era = byte(21)
    left = byte(22)  # enemies that are left
    bars = byte(33)  # beside the lives; 0 before the first frame of a flight
    way = bits(35, count=3)  # of the jet, eighths of a turn clockwise from north
    look = byte(36)
    x = byte(37, 38, 39, 40)  # x + 4; 0: none
    y = byte(41, 42, 43, 44)  # 176 - y of the picture's bottom; 0: none
    flags = byte(45, 46, 47, 48)
    enemy_way = bits(45, 46, 47, 48, count=3)
    explosion = bits(45, 46, 47, 48, first=4, count=2)
    shot_x = byte(73, 74)  # x + 5: now, before
    shot_y = byte(75, 76)  # 176 - y
    enemy_shot_way = bits(86, 87, count=3)
    enemy_shot_x = byte(88, 89)
    enemy_shot_y = byte(90, 91)
    cloud_place = byte(101)
    cloud_row = byte(109)  # of the jet's lane


def decode(m: Ram) -> dict[str, Box]:
    flight = ((m.state == FLIES) & (m.bars > 0)) | _just_gone(m)
    there = (m.idle < BLANKED) & ~_warps(m)
    enemies, shots = _enemies(m).where(there), _enemy_shots(m).where(there)
    jet, enemy = pick(m.era, JET), pick(m.era, ENEMY)
    enemies, shots = replace(enemies, color=enemy), replace(shots, color=enemy)
    boxes = {f"Enemy_{name}": enemies.where(m.era == era) for era, name in enumerate(ERAS)}
    boxes |= {f"Enemy_{name}_Shot": shots.where(m.era == era) for era, name in enumerate(ERAS)}
    value = 100 * m.score
    score = score_box(FONT, value, right=104, top=7, digits=6, leading_zeros=True, value=value)
    score = choose(flight, score, box(56, 7, 48, 9, m.state >= READY, value=value))
    return boxes | {
        "Player": replace(_jet(m), color=jnp.where(_warps(m), WARP_WHITE, jet)),
        "Player_Shot": replace(_shot(m).where(there), color=jet),
        "Life": _icons(m).where(flight),
        "Enemies_Left": replace(_left(m), color=jnp.where(flight, 0, RED)),
        "Score": replace(score, color=jnp.where(flight, GOLD, TEXT)),
    }


def _warps(m: Ram) -> jax.Array:
    """Whether the jet flies to the next era."""
    return ((m.state == READY) | (m.bars == 0)) & ((m.player & DONE) > 0)


def _just_gone(m: Ram) -> jax.Array:
    """Whether the jet's explosion has just ended, and is still on the screen."""
    ready = (m.state == READY) & (m.timer == 1)
    return ready & ((m.player & (DONE | SHOWN)) == SHOWN)


def _just_hit(m: Ram) -> jax.Array:
    """Whether the jet was hit on this frame, which still shows it whole."""
    return (m.look == JET_EXPLODES) & (m.timer == 0) & (m.bars > 0)


def _jet(m: Ram) -> Box:
    """The jet, of which clouds may hide a part."""
    explodes = ((m.look == JET_EXPLODES) & ~_just_hit(m)) | _just_gone(m)
    look = jnp.where(explodes, 8 + (m.way >> 2), m.way)
    fresh = (m.state == READY) & (m.timer == 1) & ((m.player & SHOWN) == 0)
    there = ((m.look != JET_GONE) | _just_gone(m)) & ~fresh & (m.idle < BLANKED)
    cloud = len(CLOUD_ROWS) * m.cloud_place + (m.cloud_row >> 2)
    cloud = jnp.where(_warps(m), 0, jnp.clip(cloud + 1, 1, CLOUD_PLACES * len(CLOUD_ROWS)))
    whole = (CLOUD_PLACES * len(CLOUD_ROWS) + 1) * look
    seen = JETS.box(whole + cloud, 76, 97, valid=there, orientation=2 * m.way)
    return choose(seen.w > 0, seen, JETS.box(whole, 76, 97, valid=there, orientation=2 * m.way))


def _shot(m: Ram) -> Box:
    """The jet's shot where it was drawn last."""
    before = ((m.clock & 1) == 0) & (m.shot_y[1] > 0)
    x = jnp.where(before, m.shot_x[1], m.shot_x[0])
    y = jnp.where(before, m.shot_y[1], m.shot_y[0])
    return box(wrap(x - 5), 176 - y - (y & 1), 1, 2, m.shot_y[0] > 0)


def _enemies(m: Ram) -> Box:
    """The planes, and what they have at the lower edge."""
    spared = _just_hit(m) & (m.explosion == 0) & (m.y >= 0x30) & (m.y < 0x50)
    hit = ((m.flags & HIT) > 0) & ~spared
    look = jnp.where(hit, EXPLODES, jnp.where((m.flags & MOTHER) > 0, BOSS, m.enemy_way))
    clock = m.clock - 1
    second = ((m.era == ANIMATED[0]) | (m.era == ANIMATED[1])) & ((clock & 8) > 0)
    page = pick(m.era, PAGES) - FIRST_PAGE + jnp.where(second, 1, 0)
    beyond = jnp.clip(4 - m.x, 0, 2)  # columns
    cut = WHOLE + jnp.where(m.enemy_way >= 4, beyond, -beyond)
    picture = 2 * LANE * (5 * (len(LOOKS) * page + look) + cut)
    room = 143 - m.y - jnp.where(m.x < LATE, 1, 0)  # rows below the upper edge, less 1
    most = jnp.minimum(room, jnp.where((m.y & 15) < 3, 15 - (m.y & 15), LANE - 1))
    low = picture + jnp.clip(most, 0, LANE - 1)
    high = picture + LANE + jnp.clip(143 - m.y, 0, LANE - 1)
    wraps = (m.y > 0x82) & (m.y < 0x90)
    there = (m.x > 0) & (m.y > 0)
    there = jnp.concatenate([there, there & wraps])
    index, y = jnp.concatenate([low, high]), jnp.concatenate([161 - m.y, 305 - m.y])
    x, way, mirrored = (jnp.tile(v, 2) for v in (m.x, m.enemy_way, m.enemy_way >= 4))
    planes = CUTS.box(index, x - 4, y, mirrored=mirrored, valid=there, orientation=2 * way)
    return planes.clip(*SKY)


def _enemy_shots(m: Ram) -> Box:
    """The enemies' shots where they were drawn last, without one that is not drawn yet."""
    phase = m.clock - 1 & 7
    turn = (phase & 1) == np.arange(2)
    late = ((phase == MOVES[0]) | (phase == MOVES[1])) & ~turn & (m.state == FLIES)
    x = m.enemy_shot_x - jnp.where(late, pick(m.enemy_shot_way, STEP_X), 0)
    y = m.enemy_shot_y - jnp.where(late, pick(m.enemy_shot_way, STEP_Y), 0)
    source_x, source_y = m.x + 4, jnp.minimum(m.y + 4, HIGHEST_SHOT)
    at = (x[:, None] == source_x[None]) & (y[:, None] == source_y[None])
    fresh = (phase == SPAWN) & ~turn & at.any(axis=1) & (m.state == FLIES)
    there = (m.enemy_shot_y > 0) & ~fresh
    return box(wrap(x - 5), 176 - y - (y & 1), 1, 2, there).clip(*SKY)


def _icons(m: Ram) -> Box:
    left = pick(m.lives, (80, 80, 80, 72, 64))
    right = jnp.where(m.lives > 1, 96, 88)
    return box(left, 18, right - left, 10, m.lives > 0, value=m.lives + 1)


def _left_boxes() -> np.ndarray:
    """Left, top, width and height of up to six icons, for each number of them and era, packed."""
    columns = ROM.bytes(BANK | 0x32B, 42).reshape(6, 7).T
    out = []
    for shown in columns:
        for page in PAGES:
            rows = [ROM.rows(BANK | (page & 15) << 8 | int(p), 10) if p else None for p in shown]
            used = [56 + 8 * i for i, r in enumerate(rows) if r is not None]
            ink = np.flatnonzero(sum(np.zeros(10, int) if r is None else r for r in rows))
            box_ = (used[0], ink[0], used[-1] + 8 - used[0], np.ptp(ink) + 1) if used else (0,) * 4
            out.append(sum(int(v) << 8 * i for i, v in enumerate(box_)))
    return np.array(out)


LEFT_BOXES = _left_boxes()
PER_ICON = 4  # enemies


def _left(m: Ram) -> Box:
    """The icons at the bottom, one for each four enemies."""
    icons = m.left + PER_ICON - 1 >> 2
    packed = lookup(LEFT_BOXES, 5 * icons + m.era)
    x, y, w, h = (packed >> shift & 0xFF for shift in (0, 8, 16, 24))
    return box(x, 180 + y, w, h, (m.left > 0) & (m.idle < BLANKED), value=PER_ICON * icons)


plane = functools.partial(Category, attributes=("orientation",), count=8)
shot = functools.partial(Category, count=2, blinks=True, doc="their shots")
PLANES = [Blobs(c, SKY, Shape(w=(3, 8), h=(2, 15)), gap=(3, 2)) for c in UNUSED]
SHOTS = [Blobs(c, SKY, Shape(w=1, h=2), gap=(2, 0)) for c in UNUSED]
JET_SHOT = Blobs(JET[0], SKY, Shape(w=1, h=2), ignore=(NOSE,))
WHOLE_JET = Bounds((JET[0], WARP_WHITE), NOSE, (3, 3))
COLORS_BY_ERA = tuple(
    (JET[era], *(ENEMY[k] if era == k else (1, *UNUSED[1:])[k] for k in range(5)))
    for era in range(5)
)
BY_ERA = Shades(
    (156, 33),
    (*HEAVEN, *(CLOUDS[era] for era in (1, 2, 4))),
    (*COLORS_BY_ERA, *(COLORS_BY_ERA[era] for era in (1, 2, 4))),
)

LAST_ICONS = Bounds((0, RED), (56, 180, 104, 188), value=Gauge(8, worth=PER_ICON))
POINTS = Bounds((GOLD, TEXT), (56, 7, 104, 17), value=Digits(FONT, range(56, 104, 8), 7))

GAME = Game(
    name="TimePilot",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=BY_ERA,
    categories=(
        Category("Player", WHOLE_JET, attributes=("orientation",), doc="the jet"),
        Category("Player_Shot", JET_SHOT, blinks=True, doc="its shot"),
        *(plane(f"Enemy_{n}", r, doc="enemies") for n, r in zip(ERAS, PLANES, strict=True)),
        *(shot(f"Enemy_{n}_Shot", r) for n, r in zip(ERAS, SHOTS, strict=True)),
        display("Life", Bounds(VIOLET, (64, 18, 96, 28), value=Gauge(8, 0, 1)), doc="lives"),
        display("Enemies_Left", LAST_ICONS, doc="before the mother ship comes, at most"),
        display("Score", POINTS, doc="points"),
    ),
)
