"""Alien: a crewman in a ship's maze of eggs, three aliens, a pulsar that makes them weak.

Picture: docs/games/Alien.png

Screen: the crewman also has a flame-thrower and finds a rocket; score and lives are at the bottom.
The prize of the bonus screen is a Rocket. The game draws the eggs of both
halves alternately, as missiles, so they have the colours of the sprites on their rows (`eggs.py`).
The flame uses the pulsar's record, so the pulsar is absent while the flame-thrower fires, and the
crewman has its colour.

Slots: Alien has the game's records (cyan, yellow, pink). In the bonus screen after the last egg it
has that screen's rows, left aliens first. Egg has the rows of the left half, then the rows of the
right half, by column in each row.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, eggs), and the ROM's code. A frame moves
the aliens, computes the chip's positions, draws, and then moves the crewman and selects the
pictures. Therefore his column is read from the chip's position, his row from the collision test's
copy, and his picture from both. Other pictures follow from the frame counter's previous value.

Covered: all four modes and difficulties, deaths, weak aliens, tunnels, flame, rocket, bonus
screens, resets, the game's end.

Not exact: the frame on which a life, a level or a bonus screen ends takes so long that the emulator
cuts it off. The picture is the old one, but the RAM is already set up for the next frame, which
appears rolled up by 39 lines. The RAM keeps the eggs, the pulsar's home, and the lives on that
picture. It loses the positions of the crewman and the rows of aliens, and the rocket's presence;
these objects are not valid then. The RAM also lacks the row of an alien on the frame that removes
it, and the crewman's rest or motion in the bonus screen. When weak aliens flash, REM has the new
colour a frame early.

Terrain: the walls of the maze, and the bars above and below the bonus screen. On the first frame of
a life, which appears rolled up, so are the walls. Not exact: the first frame of the bonus screen,
which has no colours yet.

VEM: half of the aliens of the bonus screen have the crewman's colours. VEM identifies figures by
colour, so it takes such an alien for the crewman, and bits of the aliens for eggs. It misses the
smallest figures in the tunnel.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Digits,
    Game,
    IconRow,
    Shape,
    Variants,
    among,
    box,
    choose,
    display,
    match,
    packed_position,
    pick,
    position,
    when,
)
from ocjax.extractors.alien.eggs import DISPLAY_FIGURE, STAGGER, colors_of_eggs
from ocjax.extractors.alien.ram import ROM, Figure, Ram, Scene, Way, is_bonus, is_next_frame
from ocjax.extractors.alien.terrain import TERRAIN

FONT = ROM.font(0x1, rows=7, stride=8, dots=7)

CYAN = 190
YELLOW = 30
PINK = 94
ORANGE = 78
BLUE = 142
WEAK = 138
WHITE = 14
MAZE = (8, 8, 160, 172)
FIGURES = IconRow(left=21, top=187, width=5, height=5, pitch=8)  # in reserve
EGG_COLUMNS = ((26, 34, 42, 56, 64, 72), (89, 97, 105, 118, 126, 134))  # of the two halves
EGG_TOPS = 19 + 12 * np.arange(13)  # in the first column
EGG_PLACES = [
    (x, top + STAGGER * (i % 3))
    for columns in EGG_COLUMNS
    for top in EGG_TOPS.tolist()
    for i, x in enumerate(columns)
]
EGG_X, EGG_Y = zip(*EGG_PLACES, strict=True)
EGG_BITS = (2, 4, 6, 3, 5, 7)  # by column
DIGIT_VALUES = (100000, 10000, 1000, 100, 10, 1)
BLANK = 128  # a digit without ink

PAIRS_MOVED = 64  # `state` on frames on which the pairs move
# `pulsar_x` and `pulsar_y` of the pulsars' places, by `pulsars`; the first is outside the maze.
PULSAR_X = ROM.bytes(0xEE3, 4).tolist()
PULSAR_Y = ROM.bytes(0xFF6, 4).tolist()
# Low bytes of the pictures' addresses: walking figures, which have poses,
ALIEN_WALKS = (79, 87, 151)
# and the others with (empty columns on either side, height).
ALIEN_SIZES = {30: (1, 9), 8: (1, 9), 37: (2, 7), 14: (2, 7), 19: (2, 5)}  # others: (0, 11)
# The player's pictures: by step, by distance from a tunnel's end, by time left of his death.
WALK_INSETS = (0, 2, 3, 2)
TUNNEL_INSETS = (2, 2, 2, 1, 0)
TUNNEL_HEIGHTS = (5, 5, 7, 9, 11)
DEATH_INSETS = (3, 2, 1, 0)
TUNNEL = 55  # its row
TUNNEL_ENDS = (17, 136)  # columns of the player's sprite at the tunnel's ends
LOWEST_STEP = 19  # in the bonus screen he does not step below this `y`
OVERWRITTEN = 240  # `old_y` on frames without collision test


def decode(m: Ram) -> dict[str, Box]:
    x = 17 + position(m.coarse, m.fine)
    is_next = is_next_frame(m)
    in_maze = m.scene == Scene.MAZE
    bonus = is_bonus(m)
    lost = jnp.where(is_next & in_maze & (m.eaten > 0), 1, 0)
    flame = _is_flame(m) & in_maze & ~is_next
    pulsar = _pulsar_box(m, x[4], _pulsar_row(m))
    at_home = _pulsar_box(m, 17 + pick(m.pulsars, PULSAR_X), pick(m.pulsars, PULSAR_Y))
    colors = jnp.where(flame & (np.arange(7) == Figure.PLAYER), ORANGE, m.colors)
    return {
        "Player": _player(m, x[3], colors[Figure.PLAYER]).where((in_maze | bonus) & ~is_next),
        "Alien": _aliens(m, x[:3]).where(~is_next),
        "Pulsar": choose(is_next, at_home, pulsar).where(~flame & in_maze),
        "Flame": box(x[4], 197 - 2 * _pulsar_row(m), 8, 5, flame, color=m.colors[Figure.PULSAR]),
        "Rocket": _rocket_box(m, x[5]).where(~is_next),
        "Egg": _eggs(m, colors).where(in_maze),
        "Score": _score(m),
        "Life": _lives_box(m, m.lives + lost),
    }


def _last_frame(m: Ram) -> jax.Array:
    """The frame counter when the game selected the pictures on the screen."""
    return m.frame - 2


def _have_moved(m: Ram) -> jax.Array:
    """True if the pairs of aliens, and the player, have moved in the bonus screen, bool `[2]`."""
    return (m.carried >> 2 < m.speeds) & (m.scene == Scene.BONUS_MOVES) & (m.pause == 0)


def _player_y(m: Ram) -> jax.Array:
    """The player's row in the maze, as drawn."""
    return jnp.where((m.old_y > m.y) & (m.old_y < m.y + 4), m.old_y - 2, m.y)


def _pulsar_row(m: Ram) -> jax.Array:
    """The row of pulsar or flame, also on the frame on which the end of a pause clears it."""
    at_home = m.pulsar_x == pick(m.pulsars, PULSAR_X)
    cleared = jnp.where(at_home, pick(m.pulsars, PULSAR_Y), m.y - 2)
    return jnp.where(m.pulsar_y == 0, cleared, m.pulsar_y)


def _is_flame(m: Ram) -> jax.Array:
    """True if the pulsar's record has a position that pulsars never have."""
    y = _pulsar_row(m)
    homes = zip(PULSAR_X, PULSAR_Y, strict=True)
    at_home = ((m.pulsar_x == home_x) & (y == home_y) for home_x, home_y in homes)
    return ~functools.reduce(jnp.logical_or, at_home)


def _player(m: Ram, x: jax.Array, color: jax.Array) -> Box:
    way = m.ways[1]
    step = match((way == Way.UP, 1), ((way == Way.DOWN) & (m.y > LOWEST_STEP), -1), otherwise=0)
    bonus_y = m.y - when(_have_moved(m)[1], step)
    top = jnp.where(is_bonus(m), 196 - 2 * bonus_y, 197 - 2 * _player_y(m))
    dies = (m.dying == Figure.PLAYER) & (m.pause > 0) & (m.old_y == OVERWRITTEN)
    depth = jnp.minimum(x - TUNNEL_ENDS[0], TUNNEL_ENDS[1] - x)
    in_tunnel = (_player_y(m) == TUNNEL) & (depth < len(TUNNEL_INSETS))
    inset = match(
        (dies, pick(m.pause + 1 >> 3, DEATH_INSETS)),
        (in_tunnel, pick(depth, TUNNEL_INSETS)),
        otherwise=pick(_last_frame(m) >> 2 & 3, WALK_INSETS),
    )
    height = match((dies, 11), (in_tunnel, pick(depth, TUNNEL_HEIGHTS)), otherwise=13)
    return box(x + inset, top, 8 - 2 * inset, height, color=color)


def _aliens(m: Ram, x: jax.Array) -> Box:
    extents = [jnp.tile(field, 4) for field in _alien_extents(m, x)]
    three = *extents[:4], jnp.where(np.arange(12) < 3, extents[4], 0)
    sides = (jnp.where(is_bonus(m), b, a) for a, b in zip(three, _pairs(m), strict=True))
    color = jnp.where(is_bonus(m), jnp.tile(m.colors[1:], 2), jnp.tile(m.colors[:3], 4))
    return box(*sides, color=color).clip(8, 0, 160, 210)


def _alien_extents(m: Ram, x: jax.Array) -> tuple[jax.Array, ...]:
    """The aliens in the maze: left, top, width, height, presence."""
    sizes = [(m.pictures == picture, *size) for picture, size in ALIEN_SIZES.items()]
    inset = match(*((shown, columns) for shown, columns, _ in sizes), otherwise=0)
    usual_height = match(*((shown, rows) for shown, _, rows in sizes), otherwise=11)
    walks = among(m.pictures, ALIEN_WALKS)
    in_narrow_pose = walks & _narrow(m)
    left = jnp.where(in_narrow_pose, 1 - m.turned[:3], inset)
    width = jnp.where(in_narrow_pose, 7, 8 - 2 * inset)
    height = jnp.where(walks, 13, usual_height)
    there = (m.alien_y > 0) & (m.scene == Scene.MAZE)
    return x + left, 196 - 2 * m.alien_y, width, height, jnp.where(there, 1, 0)


def _narrow(m: Ram) -> jax.Array:
    """True if walking aliens are in the pose that is a column narrower."""
    return (_last_frame(m) >> 3 & 3) == 2


def _pairs(m: Ram) -> tuple[jax.Array, ...]:
    """The aliens of the bonus screen: left, top, width, height, presence.

    Six rows of two move right and left alternately and come back at the other side.
    """
    row = np.arange(6)
    to_right = row % 2 == 0
    x = 2 + packed_position(m.rows)
    was_left = jnp.where(x == 129, 13, x + 1)
    was_right = jnp.where(x == 12, 128, x - 1)
    moved = _have_moved(m)[0] & (m.state == PAIRS_MOVED)
    before = jnp.where(moved, jnp.where(to_right, was_left, was_right), x)
    inset = jnp.where(_narrow(m), 1, 0)
    first = before + inset * (row % 2)
    second = jnp.where(first < 128, first + 32, first - 128)
    width = jnp.broadcast_to(8 - inset, 12)
    y = jnp.asarray(37 + 20 * np.tile(row, 2))
    return jnp.concatenate([first, second]), y, width, jnp.full(12, 13), jnp.full(12, 1)


def _pulsar_box(m: Ram, x: jax.Array, y: jax.Array) -> Box:
    large = (m.frame - 1 & 8) == 0
    turned = m.turned[4] == 1
    inset = 2 - when(turned, 1) - when(large, 1)
    color = m.colors[Figure.PULSAR]
    return box(x + inset, 197 - 2 * y, jnp.where(large, 7, 5), 5, y > 0, color=color)


def _rocket_box(m: Ram, x: jax.Array) -> Box:
    """The rocket in the maze, or the prize of the bonus screen."""
    found = (m.rocket_y > 0) & (m.scene == Scene.MAZE)
    rocket = box(x, 197 - 2 * m.rocket_y, 8, 5, found, color=m.colors[Figure.ROCKET])
    prize = box(77, 19, 8, 5, m.prize > 0, color=m.colors[0])
    return choose(is_bonus(m), prize, rocket)


def _eggs(m: Ram, colors: jax.Array) -> Box:
    there = (m.eggs[:, None] >> np.array(EGG_BITS)[None] & 1).ravel() == 1
    y = *(m.alien_y[i] for i in range(3)), _player_y(m), _pulsar_row(m), m.rocket_y
    color = colors_of_eggs(y, colors, m.frame - 1, EGG_TOPS)
    return box(np.array(EGG_X), np.array(EGG_Y), 1, 2, there, color=color)


def _score(m: Ram) -> Box:
    """A tight box around the visible digits; all are equally wide."""
    shown = m.digits != BLANK
    count = jnp.sum(jnp.where(shown, 1, 0))
    value = jnp.sum(jnp.where(shown, m.digits >> 3, 0) * np.array(DIGIT_VALUES))
    return box(71 - 8 * count, 176, 8 * count - 2, 7, value=value, color=m.colors[DISPLAY_FIGURE])


def _lives_box(m: Ram, lives: jax.Array) -> Box:
    return FIGURES.box(lives - 1, value=m.lives, color=m.colors[DISPLAY_FIGURE])


PLAYER_RULE = Blobs((BLUE, ORANGE), MAZE, Shape(w=(2, 10), h=(7, 15)), exclude=("Egg",), gap=(2, 2))
ALIENS_RULE = Blobs(
    (CYAN, YELLOW, PINK, WEAK, WHITE),
    MAZE,
    Shape(w=(4, 12), h=(7, 16)),
    exclude=("Egg",),
    gap=(1, 1),
)
PULSAR_RULE = Blobs(ORANGE, MAZE, Shape(w=(5, 7), h=(4, 5)), exclude=("Egg",), gap=(2, 2))
FLAME_RULE = Blobs(ORANGE, MAZE, Shape(w=8, h=(4, 5)), exclude=("Egg",), gap=(2, 2))
ROCKET_RULE = Blobs((YELLOW, CYAN), MAZE, Shape(w=8, h=(4, 5)), exclude=("Egg",), gap=(2, 2))
EGG_COLORS = (CYAN, YELLOW, PINK, ORANGE, BLUE, WEAK, WHITE)
EGGS_RULE = Cells(EGG_COLORS, EGG_X, EGG_Y, 1, 2, margin=(0, 1))
POINTS = Bounds((BLUE, WEAK), (22, 176, 70, 183), value=Digits(FONT, range(22, 63, 8), 176))
ICONS = FIGURES.rule((BLUE, WEAK), (20, 187, 76, 192), single=2)

GAME = Game(
    name="Alien",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # The last frame of a life is older than the RAM.
        agreement={"last": 0.95, "lost": 0.95},
    ),
    variants=Variants(
        modes={
            0: "3 lives",
            1: "2 lives",
            2: "3 lives",
            3: "6 lives",
        },
        source="play of all modes in the emulator",
    ),
    terrain=TERRAIN,
    categories=(
        Category("Player", PLAYER_RULE, role="player", doc="crewman"),
        Category("Alien", ALIENS_RULE, count=12, doc="cyan, yellow, pink; all are blue while weak"),
        Category("Pulsar", PULSAR_RULE, doc="makes aliens weak"),
        Category("Flame", FLAME_RULE, doc="of the flame-thrower"),
        Category("Rocket", ROCKET_RULE, doc="bonus"),
        Category("Egg", EGGS_RULE, count=len(EGG_X), doc="what is left of them"),
        display("Score", POINTS, role="score", doc="points"),
        display("Life", ICONS, role="lives", doc="lives"),
    ),
)
