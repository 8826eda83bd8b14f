"""Time Pilot: a jet in the middle of the sky, and enemies that fly around it, in five eras.

Screen: the era sets the enemies' colour and category: green biplanes (1910), black ones (1940),
yellow helicopters (1970), blue jets (1983), orange saucers (2001). The mother ship, which comes
when no enemies are left, is an enemy of its era. Clouds, the purple bars beside the lives, and the
texts before a flight are scenery, but Score takes the box of the text in its position. An icon of
Enemies_Left counts for four enemies, so the value is a multiple of four: the most that can be left.

Slots: Enemies have the game's four records, and then the lower parts of the same four: a plane at
the upper edge also shows at the lower edge. An exploding plane stays an object until it is gone.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code. After the sync at F051 the game
makes its steps at F346 and draws at F8E6. Later only F0AB changes the states and the pictures of a
hit. Every lane of 16 rows has room for one plane. Shots are drawn on even rows. The enemies' two
shots alternate; the jet's shot alternates between its position and the one before.

Covered: all eras and mother ships (written to RAM), all difficulties, the flight through time, lost
lives, the end of the game.

Not exact: clouds in the lower half hide shots and parts of planes. Black lines hide objects at the
left edge. A plane hides its new shot. The game draws no shot if its `y` is a multiple of 16.

VEM: it misses shots at the jet's nose and within 2 columns of a plane, whose tips look like shots.
It reads no score where a text replaces it, and takes the era from a pixel of sky that clouds may
hide.
"""

import functools
import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    BoxTable,
    Category,
    Checks,
    Game,
    Gauge,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shades,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    match,
    mirrored,
    pick,
    when,
    wrap,
)

ROM = Rom("time_pilot", "fc2104dd2dadf9a6176c1c1c8f87ced9")
FONT = ROM.font(0xD00, rows=10)
BANK = 0x1000  # offset of the pictures, which are at $D000

SCORE = NumberDisplay(FONT, right=104, top=7, digits=6, leading_zeros=True)

ERAS = ("Green", "Black", "Yellow", "Blue", "Orange")
# Colours by era.
HEAVEN = ROM.bytes(0xD88, 5).tolist()
CLOUDS = ROM.bytes(0xD8D, 5).tolist()
JET = ROM.bytes(0xD92, 5).tolist()
ENEMY = ROM.bytes(0xD97, 5).tolist()
WARP_WHITE = 14
TEXT_COLOR = 40
GOLD = 42
RED = 66
VIOLET = 138
UNUSED = (ENEMY[0], 3, 5, 7, 9)  # colours of other eras' enemies; no frame has the odd ones

ENEMY_PAGES = [int(page) for page in ROM.bytes(0xE3E, 5)]  # of the enemies' pictures by era
FIRST_PAGE = 0xD8
N_PAGES = 7
ANIMATED = (2, 4)  # eras with two pages
BOSS_PICTURE = 0xC6
EXPLOSION = 0xA6
LOOKS = (*(int(p) for p in ROM.bytes(0xDD8, 8)), BOSS_PICTURE, EXPLOSION)  # eight directions first
BOSS = 8  # index in `LOOKS`
EXPLOSION_LOOK = 9  # index in `LOOKS`
WESTWARD = 4  # least direction to the west; these pictures are mirrored
JET_LOOKS = tuple(int(p) for p in ROM.bytes(0xECD, 8))  # by direction


class Look:  # of `Ram.look`
    EXPLODES = 0x7C
    GONE = 0x8C


class State:  # of `Ram.state`
    READY = 1
    FLIES = 2


class Flag:  # bits of `Ram.flags`
    MOTHER = 64
    HIT = 128


class Player:  # bits of `Ram.player`
    DONE = 64  # the era is over
    SHOWN = 128  # the texts were shown


BLANKED = 128  # least `idle` of a blank screen
SKY = (0, 33, 160, 177)
LANE = 16
LATE_X = 20  # least `x` at which the picture is set before the first row is over
UPPER_EDGE = 143  # `y` of a plane with its last row in the first row of the sky
WRAPS = range(131, 144)  # `y` of a plane with a part at the lower edge
AT_JET = range(48, 80)  # `y` of a plane that may have hit the jet
NOSE = (76, 97, 84, 113)  # around the jet
STEP_X = [0, 4, 4, 4, 0, -4, -4, -4]  # of shots, by direction
STEP_Y = [4, 4, 0, -4, -4, -4, 0, 4]  # upwards
# Values of the clock modulo 8.
SPAWN = 5  # enemies shoot
MOVES = (2, 7)  # shots move
HIGHEST_SHOT = 142  # greatest `enemy_shot_y` of a new shot
CLOUD_PLACES = 21  # across
CLOUD_ROWS = range(0, 28, 4)  # of a cloud, in a lane

ENEMY_ROWS = [
    ROM.rows(BANK | (page & 0xF) << 8 | look, LANE)
    for page in range(FIRST_PAGE, FIRST_PAGE + N_PAGES)
    for look in LOOKS
]


def _cut_pictures() -> Pictures:
    """The pictures as edges cut them.

    The five cuts of columns are: without 2 and 1 on the left, complete, without 1 and 2 on the
    right. Each cut has first the lowest 1 to 16 rows, and then the remaining rows above them.
    """
    row = np.arange(LANE)[::-1]
    seen = [rows & mask for rows in ENEMY_ROWS for mask in (0x3F, 0x7F, 0xFF, 0xFE, 0xFC)]
    parts = (row <= cut for cut in range(LANE)), (row > cut for cut in range(LANE))
    kept = [rows for part in parts for rows in part]
    return Pictures.of([np.where(k, rows, 0) for rows in seen for k in kept])


def _behind_clouds(rows: np.ndarray) -> list[np.ndarray]:
    """The jet's picture, complete and then behind each cloud at each position in its lane."""
    out = [rows]
    for place, below in itertools.product(range(CLOUD_PLACES), CLOUD_ROWS):
        starts = [int(ROM.bytes(at + place, 1)[0]) for at in (0xF15, 0xF3F)]
        pages = [int(ROM.bytes(at + place, 1)[0]) & 15 for at in (0xED5, 0xF00)]
        cloud = [
            ROM.bytes(BANK | page << 8 | start + below, LANE)[::-1][::2].repeat(2).astype(int)
            for page, start in zip(pages, starts, strict=True)
        ]
        right = cloud[0] & 0x10
        left = cloud[1] & 0x80
        out.append(rows & np.where(left > 0, 0x0F, 0xFF) & np.where(right > 0, 0xF0, 0xFF))
    return out


CUTS = _cut_pictures()
N_CUTS = 5  # cuts of columns
WHOLE = 2  # index of the complete picture
JET_ROWS = [ROM.rows(BANK | 0x500 | look, LANE) for look in (*JET_LOOKS, *[Look.EXPLODES] * 2)]
MIRRORED_LOOKS = np.array([0, 0, 0, 0, 1, 1, 1, 1, 0, 1])
JETS = Pictures.of(
    [
        shown
        for rows, flip in zip(JET_ROWS, MIRRORED_LOOKS, strict=True)
        for shown in _behind_clouds(mirrored(rows) if flip else rows)
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
    x = byte(37, 38, 39, 40)  # x + 4; 0: no plane
    y = byte(41, 42, 43, 44)  # 176 - y of the picture's bottom; 0: no plane
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
    there = (m.idle < BLANKED) & ~_warps(m)
    jet_color = pick(m.era, JET)
    enemy_color = pick(m.era, ENEMY)
    enemies = replace(_enemy_boxes(m).where(there), color=enemy_color)
    shot_boxes = replace(_enemy_shots(m).where(there), color=enemy_color)
    return {
        **{f"Enemy_{name}": enemies.where(m.era == era) for era, name in enumerate(ERAS)},
        **{f"Enemy_{name}_Shot": shot_boxes.where(m.era == era) for era, name in enumerate(ERAS)},
        "Player": replace(_jet_box(m), color=jnp.where(_warps(m), WARP_WHITE, jet_color)),
        "Player_Shot": replace(_shot(m).where(there), color=jet_color),
        "Life": _icon_boxes(m).where(_flight(m)),
        "Enemies_Left": _enemies_left(m),
        "Score": _score_box(m),
    }


def _flight(m: Ram) -> jax.Array:
    """True if the screen shows a flight instead of a text."""
    return ((m.state == State.FLIES) & (m.bars > 0)) | _just_gone(m)


def _warps(m: Ram) -> jax.Array:
    """True if the jet flies to the next era."""
    return ((m.state == State.READY) | (m.bars == 0)) & ((m.player & Player.DONE) != 0)


def _just_gone(m: Ram) -> jax.Array:
    """True if the jet's explosion has just ended and is still on the screen."""
    ready = (m.state == State.READY) & (m.timer == 1)
    return ready & ((m.player & (Player.DONE | Player.SHOWN)) == Player.SHOWN)


def _just_hit(m: Ram) -> jax.Array:
    """True if the jet was hit on this frame, which still shows it intact."""
    return (m.look == Look.EXPLODES) & (m.timer == 0) & (m.bars > 0)


def _jet_box(m: Ram) -> Box:
    """The jet; clouds may hide a part of it."""
    explodes = ((m.look == Look.EXPLODES) & ~_just_hit(m)) | _just_gone(m)
    look = jnp.where(explodes, 8 + (m.way >> 2), m.way)
    fresh = (m.state == State.READY) & (m.timer == 1) & ((m.player & Player.SHOWN) == 0)
    there = ((m.look != Look.GONE) | _just_gone(m)) & ~fresh & (m.idle < BLANKED)
    place = len(CLOUD_ROWS) * m.cloud_place + (m.cloud_row >> 2)
    cloud = when(~_warps(m), jnp.clip(place + 1, 1, CLOUD_PLACES * len(CLOUD_ROWS)))
    intact = (CLOUD_PLACES * len(CLOUD_ROWS) + 1) * look
    seen = JETS.box(intact + cloud, 76, 97, valid=there, orientation=2 * m.way)
    return choose(seen.w > 0, seen, JETS.box(intact, 76, 97, valid=there, orientation=2 * m.way))


def _shot(m: Ram) -> Box:
    """The last drawn position of the jet's shot."""
    before = ((m.clock & 1) == 0) & (m.shot_y[1] > 0)
    x = jnp.where(before, m.shot_x[1], m.shot_x[0])
    y = jnp.where(before, m.shot_y[1], m.shot_y[0])
    return box(wrap(x - 5), 176 - y - (y & 1), 1, 2, m.shot_y[0] > 0)


def _enemy_boxes(m: Ram) -> Box:
    """The planes, and their parts at the lower edge."""
    picture = _enemy_pictures(m)
    past_edge = UPPER_EDGE - m.y
    room = past_edge - when(m.x < LATE_X, 1)  # rows below the upper edge, less 1
    most = jnp.minimum(room, jnp.where((m.y & 15) < 3, 15 - (m.y & 15), LANE - 1))
    low = picture + jnp.clip(most, 0, LANE - 1)
    high = picture + LANE + jnp.clip(past_edge, 0, LANE - 1)
    on_screen = (m.x > 0) & (m.y > 0)
    there = jnp.concatenate([on_screen, on_screen & among(m.y, WRAPS)])
    index = jnp.concatenate([low, high])
    y = jnp.concatenate([161 - m.y, 305 - m.y])
    x = jnp.tile(m.x, 2)
    way = jnp.tile(m.enemy_way, 2)
    boxes = CUTS.box(index, x - 4, y, mirrored=way >= WESTWARD, valid=there, orientation=2 * way)
    return boxes.clip(*SKY)


def _enemy_pictures(m: Ram) -> jax.Array:
    """Index in `CUTS` of the first picture with each plane's look and visible columns."""
    spared = _just_hit(m) & (m.explosion == 0) & among(m.y, AT_JET)
    hit = (m.flags & Flag.HIT) != 0
    mother = (m.flags & Flag.MOTHER) != 0
    look = match((hit & ~spared, EXPLOSION_LOOK), (mother, BOSS), otherwise=m.enemy_way)
    second = among(m.era, ANIMATED) & ((m.clock - 1 & 8) != 0)
    page = pick(m.era, ENEMY_PAGES) - FIRST_PAGE + when(second, 1)
    beyond = jnp.clip(4 - m.x, 0, 2)  # columns
    cut = WHOLE + jnp.where(m.enemy_way >= WESTWARD, beyond, -beyond)
    return 2 * LANE * (N_CUTS * (len(LOOKS) * page + look) + cut)


def _enemy_shots(m: Ram) -> Box:
    """The last drawn positions of the enemies' shots, except new shots that are not drawn yet."""
    phase = m.clock - 1 & 7
    waits = ((phase & 1) != np.arange(2)) & (m.state == State.FLIES)  # until it is drawn
    late = among(phase, MOVES) & waits
    x = m.enemy_shot_x - when(late, pick(m.enemy_shot_way, STEP_X))
    y = m.enemy_shot_y - when(late, pick(m.enemy_shot_way, STEP_Y))
    source_x = m.x + 4
    source_y = jnp.minimum(m.y + 4, HIGHEST_SHOT)
    at = (x[:, None] == source_x[None]) & (y[:, None] == source_y[None])
    fresh = (phase == SPAWN) & waits & at.any(axis=1)
    there = (m.enemy_shot_y > 0) & ~fresh
    return box(wrap(x - 5), 176 - y - (y & 1), 1, 2, there).clip(*SKY)


def _icon_boxes(m: Ram) -> Box:
    left = pick(m.lives, (80, 80, 80, 72, 64))
    right = jnp.where(m.lives > 1, 96, 88)
    return box(left, 18, right - left, 10, m.lives > 0, value=m.lives + 1)


def _boxes_of_icons() -> BoxTable:
    """The boxes of up to six icons, by their number and the era."""
    columns = ROM.bytes(BANK | 0x32B, 42).reshape(6, 7).T
    out = []
    for shown in columns:
        for page in ENEMY_PAGES:
            rows = [ROM.rows(BANK | (page & 15) << 8 | int(p), 10) if p else None for p in shown]
            used = [56 + 8 * i for i, r in enumerate(rows) if r is not None]
            ink = np.flatnonzero(sum(np.zeros(10, int) if r is None else r for r in rows))
            place = (used[0], ink[0], used[-1] + 8 - used[0], np.ptp(ink) + 1) if used else (0,) * 4
            out.append(place)
    return BoxTable(out)


LEFT_BOXES = _boxes_of_icons()
PER_ICON = 4  # enemies


def _enemies_left(m: Ram) -> Box:
    """The icons at the bottom, one for every four enemies."""
    icons = m.left + PER_ICON - 1 >> 2
    there = (m.left > 0) & (m.idle < BLANKED)
    color = jnp.where(_flight(m), 0, RED)
    index = len(ENEMY_PAGES) * icons + m.era
    value = PER_ICON * icons
    return LEFT_BOXES.at(index, y=180, valid=there, value=value, color=color)


def _score_box(m: Ram) -> Box:
    """The score, or the text that replaces it."""
    value = 100 * m.score
    text = box(56, 7, 48, 9, m.state >= State.READY, value=value)
    shown = choose(_flight(m), SCORE.box(value), text)
    return replace(shown, color=jnp.where(_flight(m), GOLD, TEXT_COLOR))


plane_category = functools.partial(Category, attributes=("orientation",), count=8)
shot_category = functools.partial(Category, count=2, blinks=True, doc="their shots")
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

GAME = Game(
    name="TimePilot",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=BY_ERA,
    checks=Checks(
        rare=("Enemy_Black", "Enemy_Yellow", "Enemy_Blue", "Enemy_Orange"),
        known={"Score": 0.8},  # a text
        # All directions of flight share pictures of Enemy_Orange.
        mirrored={"Enemy_Yellow": None, "Enemy_Blue": None, "Enemy_Orange": 0.34},
    ),
    categories=(
        Category("Player", WHOLE_JET, attributes=("orientation",), role="player", doc="the jet"),
        Category("Player_Shot", JET_SHOT, blinks=True, doc="its shot"),
        *(
            plane_category(f"Enemy_{n}", r, doc="enemies")
            for n, r in zip(ERAS, PLANES, strict=True)
        ),
        *(shot_category(f"Enemy_{n}_Shot", r) for n, r in zip(ERAS, SHOTS, strict=True)),
        display(
            "Life",
            Bounds(VIOLET, (64, 18, 96, 28), value=Gauge(8, 0, 1)),
            role="lives",
            doc="lives",
        ),
        display("Enemies_Left", LAST_ICONS, doc="before the mother ship comes, at most"),
        display("Score", SCORE.rule((GOLD, TEXT_COLOR)), role="score", doc="points"),
    ),
)
