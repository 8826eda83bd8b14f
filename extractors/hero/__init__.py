"""H.E.R.O.: a man with a rotor and a laser flies down mines to miners trapped at the bottom.

Picture: docs/games/Hero.png

Screen: a room has three parts, one below the other. Wall and LavaWall have the rocks of the parts,
without the dark lines between them, and the wall that can be destroyed. Boxes exclude columns and
rows that rocks cover. Score has Level's box while Level replaces it. Seams and edges, rivers,
points for beings and the maker's name are scenery.

Slots: Enemy has the tentacle in a river, then the beings of the middle and the lower part. Bomb and
Explosion have the middle part, then the top.

Terrain: the rocks with their seams and edges, lava, the wall, and the river below the rocks, as
the playfield's registers in RAM draw them. In the dark, black rocks are on no mask.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (meaning of the bytes), and the ROM's
code; the second bank has tables of the rooms. Everything moves before a frame is drawn, except the
laser and the player's legs and rotor; `decode` undoes their moves.

Covered: all levels and most rooms (by writing RAM), all modes, the dark (walls are not valid in
it), deaths, the end. A beam of one column is not valid.

Not exact: the RAM does not record whether a beam that begins has just hit something; near a wall,
REM assumes that it has. The RAM also lacks the beam's position when the button was released or the
player turned, and at times whether he has just stepped, which moves the beam by a column.

VEM: it misses snakes in green rooms and in the dark, enemies that touch rock of their colour, and
objects behind dynamite. It cannot read a full PowerBar (78 or more), or Score while Level replaces
it.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    EDGE_CUTS,
    WEST,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    IconRow,
    NumberDisplay,
    Pictures,
    Run,
    Runs,
    Shape,
    Variants,
    among,
    box,
    choose,
    display,
    div,
    extremes,
    lookup,
    match,
    pick,
    shift_left,
    shift_right,
    when,
)
from ocjax.extractors.hero.ram import ROM, Contact, Mode, Over, Ram, Walks
from ocjax.extractors.hero.rocks import (
    HALF_WALL,
    LASTS,
    MOST,
    PART,
    SLOT,
    TOPS,
    UPPER_SLOT,
    WALL_SLOT,
    free,
    is_lava,
    rock_boxes,
    rock_colors,
)
from ocjax.extractors.hero.terrain import TERRAIN

FONT = ROM.font(0xF00, rows=8)
SCORE = NumberDisplay(FONT, right=104, top=179, digits=6)
LEVEL = NumberDisplay(FONT, right=104, top=179, digits=2)
MEN = IconRow(left=97, top=152, width=5, height=13, pitch=-8)  # in reserve
STICKS = IconRow(left=99, top=166, width=3, height=11, pitch=-8)  # of dynamite
TEXT_LEFT = 59  # of the word before the level

VISIBLE = (8, 20, 160, 137)  # area that shows figures
FIRST_ROWS = np.array((20, 60, 99))  # the same area, by part
END_ROWS = np.array((60, 99, 137))
WHOLE_WALL = 78  # rows of the first room's wall, not below rock
NOWHERE = 147  # least `x` of no object
GONE = 50  # `being_y` of no object
HURT_UNTIL = 150  # least `dying` after a hit
MIRRORED_X = 24  # x of the miner in a mirrored room
BLANK = 170  # `score_start` while the score is not shown
LOWEST = ROM.bytes(0x9E9, 3)  # `y` in the parts
HIGHEST = ROM.bytes(0x9EC, 3)
NEITHER = 3  # `stick`
BEAM_REACH = 16  # columns that a beam flies
BEAM_STEP = 3  # columns per frame; it hits a rock after a whole number of steps


class Look(NamedTuple):
    """Low bytes of the addresses of the pictures of one kind, and of their colours."""

    pictures: tuple[int, ...]
    colors: int


# In the upper halves of the parts.
SPIDERS = Look((0x1A, 0x27), 0x4D)
BATS = Look((0x02, 0x0E), 0x5A)
MOTHS = Look((0x34, 0x40, 0x4C, 0x58), 0x33)
SNAKES = Look((0x7F, 0x92), 0x17)
LAMPS = Look((0x64,), 0x8E)
UPPER_THINGS = (SPIDERS, BATS, MOTHS, SNAKES, LAMPS)
# In the lower halves.
BOMBS = Look((0x26, 0x33, 0x40), 0x68)
FIRES = Look((0x4D, 0x58, 0x65), 0x40)
MINERS = Look((0x71, 0x7E), 0x26)
TENTACLES = Look((0xA6, 0xB2, 0xBE, 0xCA, 0xD6), 0xC4)
RAFTS = Look((0x97,), 0x05)
LOWER_THINGS = (BOMBS, FIRES, MINERS, TENTACLES, RAFTS)
SPRITE_ROWS = 13
NOTHING = np.zeros(SPRITE_ROWS, np.int32)


def _rows_by_picture(page: int, looks: tuple[Look, ...]) -> dict[int, np.ndarray]:
    """The visible rows of pictures by their low bytes; black rows are not visible."""
    return {
        picture: ROM.rows(page + picture, SPRITE_ROWS)
        * (ROM.rows(0xD00 + look.colors, SPRITE_ROWS) > 1)
        for look in looks
        for picture in look.pictures
    }


ROWS_OF_BEINGS = _rows_by_picture(0xB00, UPPER_THINGS)
BEING_INDEX = {picture: i for i, picture in enumerate(ROWS_OF_BEINGS)}
KINDS = [BEING_INDEX.get(low, len(ROWS_OF_BEINGS)) for low in range(256)]  # by low byte
BEING_ROWS = [*ROWS_OF_BEINGS.values(), NOTHING]
# By columns that rocks cover, -8 to 8: negative on the right, positive on the left.
BEING_PICTURES = Pictures.of([rows & cut for cut in EDGE_CUTS[::-1] for rows in BEING_ROWS])
LOW_ROWS = _rows_by_picture(0xA00, LOWER_THINGS)
LOW_PICTURES = Pictures.of(LOW_ROWS.get(low, NOTHING) for low in range(256))


class Pose:  # of the player, in `POSES`
    HURT = 0
    FLASHED = 1
    FLIES = 2  # the first of three
    FALLS = 5
    WALKS = 6  # the first of five


FLIGHTS = 3
STEPS = 5
POSES = (0xAE3, 0xEE7, 0xE82, 0xE9B, 0xEB4, 0xECD, 0xCE6, 0xCCD, 0xCB4, 0xC9B, 0xC82)
TALL = 24
SHOWN_ROWS = [(np.arange(TALL) - cut) // TALL == 0 for cut in range(-TALL, TALL + 1)]
PLAYERS = Pictures.of([pose * rows for pose in ROM.rows(POSES, TALL) for rows in SHOWN_ROWS])


def decode(m: Ram) -> dict[str, Box]:
    room = rock_boxes(m)
    beings = _being_boxes(m, room)
    low = _low_boxes(m)
    is_snake = among(m.being, SNAKES.pictures)
    has_lava = is_lava(m)
    tentacle = low.where(among(m.low, TENTACLES.pictures))
    return {
        "Player": _player_box(m, room),
        "Enemy": choose(SLOT[:3] == 0, tentacle, beings.where(~is_snake)),
        "Snake": beings.where(is_snake)[1:],
        "Lamp": beings.where(among(m.being, LAMPS.pictures))[:1],
        "Bomb": low.where(among(m.low, BOMBS.pictures))[1:],
        "Explosion": low.where(among(m.low, FIRES.pictures))[1:],
        "LaserBeam": _laser(m, room),
        "EndNPC": low.where(among(m.low, MINERS.pictures))[1:2],
        "Platform": low.where(among(m.low, RAFTS.pictures))[:1],
        "Wall": _walls(m, room),
        "LavaWall": room.where(has_lava)[MOST : 2 * MOST],
        "PowerBar": _power_box(m),
        "Life": MEN.box(m.lives - 1, value=m.lives),
        "BombStock": STICKS.box(m.bombs, value=m.bombs),
        "Score": _score_box(m),
        "Level": _level_box(m),
    }


def _is_mirrored(m: Ram) -> jax.Array:
    return (m.room == pick(m.level, LASTS.tolist())) & (m.low_x[1] == MIRRORED_X)


def _walls(m: Ram, room: Box) -> Box:
    whole = (m.room == 0) & (SLOT == WALL_SLOT)
    top = jnp.where(whole, TOPS[0], room.y)
    height = jnp.where(whole, WHOLE_WALL, room.h)
    color = jnp.where(whole, m.color[0], rock_colors(m)) & ~1
    stone = ((PART != 1) | ~is_lava(m) | whole) & ((SLOT != UPPER_SLOT) | (m.room != 0))
    return box(room.x, top, room.w, height, room.valid & stone, color=color)


def _power_box(m: Ram) -> Box:
    color = jnp.where(m.power == 0, RED, YELLOW)
    return box(49, 145, jnp.where(m.power < 79, 79, 78), 5, value=m.power, color=color)


def _shows_level(m: Ram) -> jax.Array:
    """True if the level replaces the score."""
    scores = (m.over & 31) >= Over.SCORES
    after = (m.lives == 0) & (m.score_start != BLANK) & scores
    return (m.mode != Mode.NO_LEVELS) & jnp.where(m.waits == 0, m.ready == 0, after)


def _level_box(m: Ram) -> Box:
    number = LEVEL.box(m.level + 1)
    width = number.x + number.w - TEXT_LEFT
    return box(TEXT_LEFT, 179, width, 8, _shows_level(m), value=m.level + 1)


def _score_box(m: Ram) -> Box:
    hidden = _shows_level(m)
    in_place = box(TEXT_LEFT, 179, _level_box(m).w, 8, value=m.score)
    number = choose(hidden, in_place, SCORE.box(m.score))
    return replace(number, color=jnp.where(hidden, YELLOW, WHITE))


def _being_boxes(m: Ram, room: Box) -> Box:
    """The beings in the upper halves of the parts, without the columns that rocks cover."""
    mirrored = _is_mirrored(m)
    left, right = free(room, m.being_x, m.being_x + 8)
    hidden = jnp.where(left > m.being_x, left - m.being_x, right - m.being_x - 8)
    cut = jnp.where(mirrored, -hidden, hidden)
    picture = len(BEING_ROWS) * (8 + jnp.clip(cut, -8, 8)) + lookup(KINDS, m.being)
    there = (m.being_x < NOWHERE) & (m.being_y != GONE) & (m.points == 0)
    y = np.array([31, 70, 109]) - m.being_y
    beings = BEING_PICTURES.box(picture, m.being_x, y, valid=there, mirrored=mirrored)
    return beings.clip(*VISIBLE)


def _low_boxes(m: Ram) -> Box:
    """The objects in the lower halves of the parts."""
    y = np.array([125, 86, 47])
    there = m.low_x < NOWHERE
    return LOW_PICTURES.box(m.low, m.low_x, y, valid=there, mirrored=_is_mirrored(m))


def _drawn_pose(m: Ram) -> jax.Array:
    """The player's picture before the next step of his legs or rotor."""
    flight = m.flight + when((m.clock >= 2) & (m.saved == 0), 1)
    step = m.step + when((m.clock == 0) & (m.saved == 0), 1)
    return match(
        (m.dying >= HURT_UNTIL, Pose.HURT),
        (m.flash > 0, Pose.FLASHED),
        (m.walks == Walks.FLIES, Pose.FLIES + jnp.where(flight == FLIGHTS, 0, flight)),
        (m.walks >= Walks.GROUND, Pose.WALKS + jnp.where(step == STEPS, 0, step)),
        otherwise=Pose.FALLS,
    )


def _player_box(m: Ram, room: Box) -> Box:
    """The player, without the columns and rows that rocks cover."""
    picture = len(SHOWN_ROWS) * _drawn_pose(m) + TALL
    y = 135 - m.y
    left = m.facing != 0
    facing = jnp.where(left, WEST, EAST)
    whole = PLAYERS.box(picture, m.x, y, mirrored=left)
    upper = jnp.maximum(y, VISIBLE[1])
    lower = jnp.minimum(y + TALL, VISIBLE[3])
    free_begin, free_end = free(room, jnp.repeat(whole.x, 3), jnp.repeat(whole.x + whole.w, 3))
    seen = (upper < END_ROWS) & (lower > FIRST_ROWS) & (free_begin < free_end)
    first, last = extremes(seen, FIRST_ROWS, END_ROWS)
    top = jnp.maximum(upper, first)
    bottom = jnp.minimum(lower, last)
    cut = jnp.where(top > y, top - y, bottom - y - TALL)
    cut_picture = picture + jnp.clip(cut, -TALL, TALL)
    cut_player = PLAYERS.box(cut_picture, m.x, y, mirrored=left, orientation=facing)
    begin, end = extremes(seen, free_begin, free_end)
    shown = cut_player.clip(begin, VISIBLE[1], end, VISIBLE[3]).clip(*VISIBLE)
    return shown.where((m.over == 0) & (bottom > top))


def _laser(m: Ram, room: Box) -> Box:
    """The beam before it flew on, from the player's drawn position; after a hit it restarts."""
    left = m.facing != 0
    row = 139 - m.y
    begin, end = _corridor(m, room, row)
    is_half = m.hits >= HALF_WALL
    width = jnp.where(is_half, 4, 8)
    x = m.x - when(_player_moves(m), jnp.where(left, -1, 1))
    start = jnp.where(left, x - 6 + when(is_half, 4), x + 6)
    space = jnp.where(left, start - begin, end - start - width)
    # If a beam begins near a rock, the frame presumably shows the last beam at that rock.
    to_rock = BEAM_STEP * div(jnp.maximum(space + BEAM_STEP, 0), BEAM_STEP)
    has_begun = (m.laser == 0) & (m.touched == 0)
    before_step = (m.laser - BEAM_STEP) & (BEAM_REACH - 1)
    flown = jnp.where(has_begun, to_rock, before_step)
    flies = (m.laser < BEAM_REACH) & (~has_begun | (to_rock < BEAM_REACH))
    whole_beam = box(start + jnp.where(left, -flown, flown), row, width, 1, flies)
    shown = whole_beam.clip(begin, VISIBLE[1], end, VISIBLE[3])
    return shown.where(shown.w > 1)


def _corridor(m: Ram, room: Box, row: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The columns between the rocks on the player's left and right."""
    ours = ((row >= FIRST_ROWS) & (row < END_ROWS))[PART] & (room.w > 0)
    ends = room.x + room.w
    begin = jnp.max(jnp.where(ours & (ends <= m.x + 4), ends, VISIBLE[0]))
    return begin, jnp.min(jnp.where(ours & (room.x >= m.x + 4), room.x, VISIBLE[2]))


def _player_moves(m: Ram) -> jax.Array:
    """True if the player has just moved sideways."""
    at_level = among(m.y - LOWEST, (0, -1)) | among(m.y - HIGHEST, (0, 1))
    by_wall = (m.contact >= Contact.WALL) & (m.wall > 0)
    pushed = jnp.any(jnp.where(m.contact >= Contact.ROCK, ~at_level, by_wall))
    free_to = ~pushed & (m.turns == 0) & (m.dying == 0) & (m.saved == 0) & (m.flash == 0)
    tries = (m.stick != NEITHER) | (m.walks == Walks.GROUND) | ((m.x & 3) != 0)
    return tries & free_to


HIGH_ROCK = (34, 146, 194, 2)
MIDDLE_ROCK = (36, 148, 196, 2, 4)
LOW_ROCK = (38, 150, 198, 2, 6)
GRAY = 4
YELLOW = 28
WHITE = 12
RED = 66
# The destructible wall of the first room, and the rocks of the three parts.
ROCKS = Runs(
    (
        Run(HIGH_ROCK, 20, left=(60, 64), width=(4, 8), height=78),
        Run(HIGH_ROCK, 20, left=8, width=8, height=39),
        Run(HIGH_ROCK, 20, left=(8, 159), width=(9, 152), height=39),
        Run(MIDDLE_ROCK, 61, left=(8, 59), width=(4, 152), height=37),
        Run(MIDDLE_ROCK, 61, left=(60, 67), width=(9, 152), height=37),
        Run(MIDDLE_ROCK, 61, left=(68, 159), width=(4, 152), height=37),
        Run(LOW_ROCK, 100, left=(8, 159), width=(8, 152), height=39),
    ),
    MOST,
)


def without_dots(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The pixels without the face's two dots, which have one blank pixel between them.

    A dot stays if it touches the beam, or if a third pixel follows at the same distance.
    """
    left = mask & ~shift_left(mask, 1) & shift_left(mask, 2)
    left_dot = left & ~shift_right(left, 2) & ~shift_left(left, 2)
    return mask & ~(left_dot | shift_right(left_dot, 2))


LAVA = Runs((Run((66, 68), 61, left=(8, 159), width=(4, 152), height=37),), MOST)
figures = functools.partial(Blobs, gap=(1, 1))
suit = functools.partial(Blobs, (152, WHITE, YELLOW), gap=(2, 5))  # except his face
FEET = suit((8, 20, 160, 31), shapes=Shape(w=(1, 3), h=(1, 10)))
PLAYER = suit(VISIBLE, shapes=Shape(w=(4, 12), h=(2, 26)), also=(FEET,))
SUIT_AND_PACK = (*PLAYER.palette, 30, 68, 70)
MINERS_AT = ((24, 85, 34, 98), (127, 85, 138, 98))
below = functools.partial(figures, region=(8, 61, 160, 139), ignore=MINERS_AT)
MONSTER = below((*range(36, 46, 2), 4, 6, 8, 170), shapes=Shape(w=(4, 8), h=(3, 13)))
SNAKE = below((196, 198, 200, 202), shapes=Shape(w=(1, 8), h=(2, 8)))
LANTERN = figures((30, 4, 6), (8, 20, 160, 59), shapes=Shape(w=(4, 7), h=(5, 9)))
STICK = figures((68, YELLOW), VISIBLE, shapes=Shape(w=3, h=(10, 12)))
BLAST = Blobs(30, VISIBLE, Shape(w=(5, 8), h=(10, 13)), gap=(3, 3))
MINER = figures((8, 200, 74, 30), (8, 85, 160, 98), shapes=Shape(w=(6, 7), h=(10, 13)))
BEAM = Blobs(70, VISIBLE, Shape(w=(2, 12), h=1), filters=(without_dots,))
LIVES = MEN.rule(GRAY, (40, 152, 104, 166), single=2, inverse=True)
STOCK = STICKS.rule(GRAY, (40, 166, 104, 178), inverse=True)
POWER = Bounds(YELLOW, (49, 145, 128, 150))  # the remaining power, left of the red part
POWER_BAR = Bounds((YELLOW, RED), (49, 145, 128, 150), value=Gauge(1, full=78, of=POWER))
GAME = Game(
    name="Hero",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    checks=Checks(
        known={"PowerBar": 0.8},  # full
        moved=0.25,  # many walls
    ),
    variants=Variants(
        modes={
            0: "starts at level 1",
            1: "starts at level 5",
            2: "starts at level 9",
            3: "starts at level 13",
            4: "starts at level 17, and does not show levels",
        },
        source="play of all modes in the emulator",
        starts={
            "level=9": "level 10, with lava",
        },
    ),
    categories=(
        Category(
            "Player",
            PLAYER,
            attributes=("orientation",),
            rgb=(84, 138, 210),
            colors=SUIT_AND_PACK,
            role="player",
            doc="the man",
        ),
        Category("Enemy", MONSTER, count=3, rgb=(180, 122, 48), doc="tentacle, middle, low"),
        Category("Snake", SNAKE, count=2, rgb=(111, 210, 111), doc="middle, low"),
        Category("Lamp", LANTERN, rgb=(252, 252, 84), doc="out when it is touched"),
        Category("Bomb", STICK, count=2, rgb=(184, 50, 50), doc="dynamite: middle, top"),
        Category("Explosion", BLAST, count=2, doc="of dynamite: middle, top"),
        Category("LaserBeam", BEAM, doc="beam"),
        Category("EndNPC", MINER, rgb=(170, 170, 170), doc="the miner to be saved"),
        Category("Platform", Bounds(YELLOW, (8, 136, 160, 137), min_size=(8, 1)), doc="a raft"),
        Category("Wall", ROCKS, count=18, colors=(*ROCKS.palette, 32, 192), doc="rock"),
        Category("LavaWall", LAVA, count=6, doc="lava"),
        display("PowerBar", POWER_BAR, doc="power left"),
        display("Life", LIVES, rgb=(45, 87, 176), role="lives", doc="one more than the men"),
        display("BombStock", STOCK, rgb=(184, 50, 50), doc="dynamite left"),
        display(
            "Score",
            SCORE.rule((WHITE, YELLOW)),
            role="score",
            doc="points, or the level in their place",
        ),
        display("Level", LEVEL.rule(YELLOW, SCORE.area), doc="shown before a life"),
    ),
)
