"""Donkey Kong: Mario, four barrels or fireballs, a hammer, Donkey Kong, Pauline, two boards.

Picture: docs/games/DonkeyKong.png

Screen: the first board has slanted girders and barrels. The second one (blue) has fireballs and
eight rivets, which Mario takes out by walking over them. Ladder includes broken ladders, each from
its first rung to its last. A held hammer is drawn in the rows where it hung, on any floor. During a
game the display shows the bonus (Timer), between lives and games the Score, which stays valid and
keeps its value. Lives are ALE's; at 0 the screen shows none, and Life is not valid.

Slots: Ladder and Platform have the first board's parts, then the second board's.

Terrain: the girders (the objects of Platform) and the rungs of the ladders, by `board`, as the
ROM's tables draw them. The rivets and the stack at the lower left are objects.

RAM: ALE's source (score, lives), D. Debro's disassembly (meaning of the records) and the ROM's
code. Obstacles move before the frame is drawn. Mario, the hammer and the bonus change after it;
`decode` reverts this.

Covered: both boards, the only mode and difficulty, jumps, ladders, the hammer, rivets, lost lives,
the end of the game, frame skips 3 and 4.

Not exact: Mario may walk or climb on every third frame. Unless he jumps, the step sounds, or there
is no input, the RAM does not show a step, and `decode` assumes one. The RAM also lacks his turn,
the end of a jump, and the hammer's position before he took it on this frame. When a life ends, the
RAM is set up again before the last frame, which shows the barrels but not Mario. The column of each
floor's last obstacle gives their rows, except on ladders. Without a barrel on the lowest floor or a
new game, the RAM does not distinguish that frame from the next one.

VEM: it misses a hammer that touches a ladder, covered parts of ladders and barrels, fireballs
without rivets, and the colours of an idle game.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    NORTH,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Game,
    Gauge,
    NumberDisplay,
    Shades,
    Shape,
    among,
    box,
    display,
    edges,
    lookup,
    match,
    pick,
    position,
    reached,
    when,
)
from ocjax.extractors.donkeykong.ram import ROM, Ram
from ocjax.extractors.donkeykong.terrain import (
    BLUE_LADDERS,
    BLUE_PLATFORMS,
    BOARD,
    DRUM,
    GIRDERS_AT,
    LADDERS,
    LADDERS_AT,
    PLATFORMS,
    RIVET_X,
    RIVET_Y,
    TERRAIN,
)

FONT = ROM.font(0xC00, rows=7, stride=8)


class Pose:  # of Mario; below: four poses of walking
    JUMPS = 4
    CLIMBS = 5
    STANDS = 6


HEADS = (0, 0, 0, 1, 2, 2, 0)  # first row of Mario's picture, by pose
FEET = (17, 17, 17, 17, 16, 17, 17)  # the row below it

GIRDERS = 106  # colour of the first board
BLUE = 138  # of the second board and the score
RED = 70
WHITE = 14
BOOTS = 166
OBSTACLE = 46
KONG = 52
GREEN = 218
PAULINE = (30, 70, 168)

KONG_AT = (34, 15, 50, 34)
PAULINE_AT = (63, 18, 71, 34)
LIFE_AREA = ((112, 23, 128, 31),)
SCORE = NumberDisplay(FONT, right=103, top=7, digits=6, leading_zeros=True)
TIMER = NumberDisplay(FONT, right=103, top=7, digits=4, leading_zeros=True)

BENDS = ROM.bytes(0xDF8, 7)  # `x` where the girders of the first board step
UPPER_ENDS = ROM.bytes(0xACD, 34)  # `y` of Mario at the upper ends of the ladders
LOWER_ENDS = ROM.bytes(0xB00, 34)  # `y` of Mario at the lower ends
FLOORS = tuple(range(22, 160, 28))  # least `y` of the floors below the uppermost one
BARREL_FLOORS = (12, 33, 61, 89, 117, 145)  # least `y` of barrels
EMPTY = 93  # `lowest_row` without an obstacle
PLAYING = 128  # least `state` during a game
MOVED_WAIT = 2  # `wait` on a frame on which Mario may have moved
WHOLE_LADDER = 13  # a barrel rolls down ladders below this number
JUST_JUMPED = 31  # `air` at the start of a jump
RISE = 7  # rows of a jump
NO_HAMMER = 112  # `hammer` after use


class Sound:  # of `Ram.sound`
    NONE = 0
    STEP = 2
    POINTS = 3


class Heading:  # of `Ram.heading`
    LEFT = 0
    RIGHT = 8
    LADDER = 128  # least `heading` on a ladder
    DOWN = 254
    UP = 255


class Stick:  # bits of `Ram.control`; 0: pushed
    LEFT = 64
    RIGHT = 128


def decode(m: Ram) -> dict[str, Box]:
    dx, dy = _step(m)
    second = m.board == 1
    obstacles = _obstacle_boxes(m)
    return {
        "Player": _mario(m, dx, dy),
        "Barrel": obstacles.where(~second),
        "Fireball": obstacles.where(second),
        "Hammer": _hammer(m, dx),
        "Rivet": _rivets(m),
        "DonkeyKong": _fixed(KONG_AT),
        "Girlfriend": _fixed(PAULINE_AT),
        "OilDrum": _fixed(DRUM, m.girders).where(~second),
        "Ladder": _fixed(LADDERS_AT.T, m.girders).where(second == (np.arange(34) >= len(LADDERS))),
        "Platform": _fixed(GIRDERS_AT.T, m.girders).where(
            second == (np.arange(13) >= len(PLATFORMS))
        ),
        "Life": _lives(m),
        "Score": _score_box(m),
        "Timer": _timer_box(m),
    }


def _fixed(area: tuple[int, int, int, int] | np.ndarray, color: jax.Array | None = None) -> Box:
    """Boxes that never move, from their left, top, right and bottom."""
    return edges(*area, color=color)


def _in_play(m: Ram) -> jax.Array:
    """True during a game that had started before the frame was drawn."""
    return (m.state >= PLAYING) & ~((m.clock == 0) & (m.bonus == 50))


def _life_over(m: Ram) -> jax.Array:
    """True on the last frame of a life, without Mario, though the RAM is set up again."""
    game_over = (m.state == 0) & (m.sound == Sound.POINTS) & (m.sound_left == 31)
    shown = (m.obstacle_y == 0).all() & (m.lowest_row != EMPTY)
    return game_over | shown | ((m.state >= PLAYING) & ~_in_play(m))


def _step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that Mario has moved since the frame was drawn."""
    in_air = m.air > 0
    left = jnp.where(in_air, (m.control & Stick.LEFT) == 0, m.heading == Heading.LEFT)
    right = ~left & jnp.where(in_air, (m.control & Stick.RIGHT) == 0, m.heading == Heading.RIGHT)
    climbs = ~in_air & (m.heading >= Heading.LADDER)
    at = jnp.where(climbs, m.y, m.x)
    quiet = among(m.sound, (Sound.NONE, Sound.STEP))
    sounds = (m.sound == Sound.STEP) & (m.sound_left == 1)
    on_beat = jnp.where(quiet & ((at & 3) == 0), sounds, ~_at_ladder_end(m))
    unhindered = (on_beat | in_air) & ~_at_side(m, left, right)
    moved = unhindered & (m.wait == MOVED_WAIT) & (m.idle == 0) & ~m.dying & _in_play(m)
    dx = when(right, 1) - when(left, 1)
    climbed = jnp.where(m.heading == Heading.UP, -1, 1)
    dy = jnp.where(climbs, climbed, _slope_rows(m, dx))
    return when(moved, dx), when(moved, dy)


def _slope_rows(m: Ram, dx: jax.Array) -> jax.Array:
    """Rows that a step along a floor goes down at the steps of its girders."""
    bend = (dx != 0) & among(m.x + when(dx < 0, 1), BENDS.tolist()) & (m.board == 0)
    floor = _mario_floor(m)
    slanted = (floor > 0) & (floor < 5)
    return when(bend & slanted, jnp.where((floor & 1) == 0, dx, -dx))


def _mario_floor(m: Ram) -> jax.Array:
    """Mario's floor; 0 is Donkey Kong's."""
    return reached(m.y, FLOORS)


def _at_side(m: Ram, left: jax.Array, right: jax.Array) -> jax.Array:
    """True if Mario is at the end of a girder and cannot go on to the left or right."""
    even = (_mario_floor(m) & 1) == 0
    first = jnp.where(even | (m.board == 1), 36, 41)
    last = jnp.where(even & (m.board == 0), 117, 124)
    return ((m.x == first) & left) | ((m.x == last) & right)


def _at_ladder_end(m: Ram) -> jax.Array:
    end = jnp.where(
        m.heading == Heading.UP, *(lookup(e, m.at_ladder) for e in (UPPER_ENDS, LOWER_ENDS))
    )
    return (m.y == end) & (m.heading >= Heading.DOWN)


def _mario(m: Ram, dx: jax.Array, dy: jax.Array) -> Box:
    jumps = (m.air > 0) & (m.air < JUST_JUMPED)
    y = m.y - dy + when(m.air == JUST_JUMPED, RISE)
    at_end = (y == lookup(UPPER_ENDS, m.at_ladder)) | (y == lookup(LOWER_ENDS, m.at_ladder))
    on_ladder = m.heading >= Heading.LADDER
    pose = match(
        (on_ladder & at_end, Pose.STANDS),
        (on_ladder, Pose.CLIMBS),
        (jumps, Pose.JUMPS),
        otherwise=(m.walk - dx & 6) >> 1,
    )
    compass = match((on_ladder, NORTH), (m.heading == Heading.LEFT, WEST), otherwise=EAST)
    top = pick(pose, HEADS)
    bottom = pick(pose, FEET)
    there = ~_life_over(m)
    whole = box(m.x - dx - 4, y + 22 + top, 8, bottom - top, there, orientation=compass)
    return whole.clip(*BOARD)


def _obstacle_boxes(m: Ram) -> Box:
    """Barrels or fireballs. The side view of a barrel on a ladder is a row lower."""
    side = m.on_ladder & (m.ladder < WHOLE_LADDER) & (m.board == 0)
    low = jnp.where(side, 1, 0)
    y = jnp.where(_life_over(m), _last_rows(m), m.obstacle_y)
    return box(m.obstacle_x - 4, y + 40 + low, 8, 8 - low, y > 0)


def _last_rows(m: Ram) -> jax.Array:
    """The barrels' `y` on the last frame of a life, from the floors that drew them."""
    drawn_x = position(m.coarse_x + 2, m.fine_x)
    steps = reached(m.obstacle_x, BENDS.tolist())
    slope = jnp.where(m.goes_right == 1, steps, len(BENDS) - steps)
    by_floor = [
        (
            (m.obstacle_x == drawn_x[floor]) & (m.goes_right == 1 - floor % 2),
            start + (slope if 0 < floor < 5 else 0),
        )
        for floor, start in enumerate(BARREL_FLOORS)
    ]
    y = match(*reversed(by_floor), otherwise=0)
    return when(~m.on_ladder & (m.board == 0), y)


def _hammer(m: Ram, dx: jax.Array) -> Box:
    """The hammer; it swings while Mario holds it."""
    held = m.hammer_time > 0
    forward = held & ((m.clock - 1 & 8) != 0)
    aside = match((~forward, 6), (m.heading == Heading.LEFT, 7), otherwise=5)
    x = m.hammer_x - when(held, dx) - aside
    size = jnp.where(forward, 6, 4)
    there = m.hammer != NO_HAMMER
    return box(x, jnp.where(forward, 75, 68), size, jnp.where(forward, 6, 7), there)


def _rivets(m: Ram) -> Box:
    """The rivets. The last rivet of a girder leaves a number of at least 18."""
    gone = reached(jnp.repeat(m.rivets, 2), (6, 12, 18))
    left = np.arange(len(RIVET_X)) % 2 == 0
    there = (gone == 0) | (gone == jnp.where(left, 2, 1))
    return box(RIVET_X, RIVET_Y, 4, 1, there & (m.board == 1))


def _lives(m: Ram) -> Box:
    width = jnp.where(m.lives == 1, 4, 12)
    x = jnp.where(m.board == 1, 112, 128 - width)
    return box(x, 23, width, 8, m.lives > 0, value=m.lives, color=m.girders)


def _score_box(m: Ram) -> Box:
    points = 100 * m.score
    return SCORE.box(points)


def _timer_box(m: Ram) -> Box:
    """The bonus, which counts down after the frame is drawn."""
    shown = 100 * (m.bonus + jnp.where((m.clock & 127) == 0, 1, 0))
    return TIMER.box(shown, valid=_in_play(m))


BOTH = (GIRDERS, BLUE)
SMALL = Blobs(OBSTACLE, BOARD, Shape(w=(6, 8), h=(5, 8)))
HUNG = (20, 66, 140, 82)
HAMMER_RULE = Blobs((OBSTACLE, *BOTH), HUNG, Shape(w=(4, 6), h=(6, 7), pixels=(14, 24)))
MARIO_RULE = Bounds((RED, WHITE, BOOTS), BOARD)
RIVET_RULE = Cells(BLUE, tuple(RIVET_X.tolist()), tuple(RIVET_Y.tolist()), 4, 1)
FIRST_BOARD = ((GIRDERS,),)  # colours of a region
SECOND_BOARD = ((BLUE,),)
LADDER_COLORS = FIRST_BOARD * len(LADDERS) + SECOND_BOARD * len(BLUE_LADDERS)
PLATFORM_COLORS = FIRST_BOARD * len(PLATFORMS) + SECOND_BOARD * len(BLUE_PLATFORMS)
RUNGS = Bounds(LADDER_COLORS, tuple(map(tuple, LADDERS_AT.tolist())))
BEAMS = Bounds(PLATFORM_COLORS, PLATFORMS + BLUE_PLATFORMS)

# The screen saver changes the colours of the girders and the background.
OTHERS = tuple(color for color in range(0, 256, 2) if color not in BOTH)
SAVER = Shades((32, 35), (GIRDERS, *OTHERS), ((GIRDERS,), *((color,) for color in OTHERS)))

GAME = Game(
    name="DonkeyKong",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=SAVER,
    terrain=TERRAIN,
    checks=Checks(
        mirrored={"Player": 0.06},  # the RAM does not record Mario's turn on this frame
    ),
    categories=(
        Category(
            "Player",
            MARIO_RULE,
            attributes=("orientation",),
            role="player",
            doc="Mario; north on a ladder",
        ),
        Category("Barrel", SMALL, count=4, needs=("OilDrum",), doc="on the first board"),
        Category("Fireball", SMALL, count=4, needs=("Rivet",), doc="on the second board"),
        Category("Hammer", HAMMER_RULE, doc="on its place, or held"),
        Category("Rivet", RIVET_RULE, count=8, doc="lowest girder first, left before right"),
        Category("DonkeyKong", Bounds(KONG, KONG_AT), doc="the ape"),
        Category("Girlfriend", Bounds(PAULINE, PAULINE_AT), doc="Pauline"),
        Category("OilDrum", Bounds(GIRDERS, DRUM), doc="stack at the lower left"),
        Category("Ladder", RUNGS, count=34, doc="whole or broken; upper first, board by board"),
        Category("Platform", BEAMS, count=13, doc="girders, upper first, board by board"),
        display(
            "Life",
            Bounds(BOTH, LIFE_AREA, value=Gauge(8, 4, 1)),
            role="lives",
            doc="lives that are left",
        ),
        display("Score", SCORE.rule(BLUE), blinks=True, role="score", doc="points"),
        display("Timer", TIMER.rule(GREEN), role="time", doc="bonus that is left"),
    ),
)
