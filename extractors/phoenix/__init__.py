"""Phoenix: two waves of birds, two of bats that hatch from eggs, and a mother ship, block by block.

Picture: docs/games/Phoenix.png

Screen: explosions and the ground are scenery. The game draws the shield, and bats that shake
because they are low, on every other frame. On the other frames, the rows below them are empty too.

Slots: Phoenix has the four rows from the lowest one, first their left birds, then their right ones.
Bat has the seven rows from the lowest one. A shot keeps its slot of Enemy_Projectile as it falls.
Blocks have their positions in the complete ship. The blue belt turns: its blocks move from slot to
slot.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of bytes), and the ROM's code. The display
program at D2A1-D538 draws the rows, highest first; D53B draws the ship. Between the drawing and the
RAM that the emulator returns, bats move and flap (D943-DB7B, F1DF-F285), and the player and its
shield move (F099-F1DF). `as_drawn` undoes these moves. Birds, shots and the ship move before the
drawing. The program switches shots in the middle of a line, so a shot is a line longer or shorter
left of the beam. It begins two lines late if no bird or bat is in its row, and is black in lines
164-165. Enemies' shots have the colour that the program last used; `rgb` is that of the first line.

Covered: all waves, later rounds, half bats, the shield, holes in the ship, deaths, the extra life,
the end of the game.

Not exact: the RAM does not record whether the player has moved by a column since it was drawn,
unless its picture changed. If a shot in flight shows that the player moved steadily, REM assumes
that it still does (80 to 90 % of boxes are right). The RAM also lacks the frame on which bats near
their turning points, where they become slower, moved last (1 % of boxes), and the shield's first
frame.

VEM: a shot that touches a bird or a bat takes the same colours and becomes a part of it. In the
second wave, it mistakes enemies' shots in the colour of the player's shot for the player's shot.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Raised,
    Shape,
    U,
    among,
    any_of,
    box,
    color_mask,
    display,
    div,
    lookup,
    match,
    materialize,
    mod,
    or_rows,
    packed_position,
    when,
)
from ocjax.extractors.phoenix.ram import ROM, Boss, Look, Ram, Shot, Stage, Wing
from ocjax.extractors.phoenix.ship import (
    BAT_PICTURES,
    BELT,
    BELT_ROWS,
    BIRD_PICTURES,
    BOSSES,
    DOMES_BOTTOM,
    HULL,
    HULL_ROWS,
    LINE_PLUS_ROW,
    NARROW,
    NO_ROW,
    OFF_BEAM,
    ON_BEAM,
    ROW_LINES,
    SHOT_BEAM,
    START_Y,
    UPRIGHT,
    ZONE,
    Sky,
    line_of,
    place,
)

FONT = ROM.font(0xE00, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=103, top=5, digits=6)
CANNONS = IconRow(left=99, top=13, width=3, height=5, pitch=-4)  # in reserve

ORANGE = 56
PURPLE = 100
LIME = 220
WHITE = 14
GREEN = 216
BLUE = 148
RED = 66
NAVY = 146
BAT_BLUE = 132
BALL = 218  # the player's shot, except beside the ship
BIRD_COLORS = (PURPLE, ORANGE, 58, BALL)
BAT_COLORS = (BAT_BLUE, RED, 130, 136, 138, 142, 68, 70, 72, 82, 58)

TOP_LINE = 20
GROUND = 184  # line
AIR = (0, TOP_LINE, 160, GROUND)
BLACK_LINES = (164, 166)  # enemies' shots are black there

ROW = np.arange(7)
FLOCK = 4  # rows of birds
SHAKING = 0x33  # bats below this row shake
CEILINGS = (0x99, 0xAD)  # row of the highest bat
LAST_BAT_FLOOR = 0x23
DEPTH = 0x76  # rows from the ceiling to the floor of the other bats
APART = 24  # least distance in rows between enemies' shots


def _beside_birds(wing: int) -> tuple[int, ...]:
    """Colours of enemies' shots beside birds, by row below the first one."""
    return (wing,) * 2 + (WHITE,) * 5 + (wing,) * 4 + (PURPLE,) * 4 + (wing,) * 3


# By stage, and row below the first one of an enemy: the program draws shots in its colours.
ROW_COLORS = np.array(
    [
        _beside_birds(58),
        _beside_birds(BALL),
        (142,) * 6 + (130,) * 3 + (132, 132, 136, 136, 138, 138) + (142,) * 3,
        (58,) * 6 + (82,) * 3 + (RED, RED, 68, 68, 70, 70, 72, 72, 58),
        (WHITE,) * ROW_LINES,
    ]
).ravel()


class Drawn(NamedTuple):
    """The state when the frame was drawn."""

    stage: jax.Array
    x: jax.Array  # of the player
    bat_x: jax.Array
    row_y: jax.Array
    left: jax.Array
    right: jax.Array
    sky: Sky


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    ship = d.sky.ship
    return {
        "Player": _player_box(m, d),
        "Shield": _shield_box(m, d),
        "Player_Projectile": _shot_box(m, d),
        "Phoenix": _bird_boxes(m).where(d.sky.birds),
        "Bat": _bat_boxes(m, d).where((d.stage >= Stage.BATS) & ~ship),
        "Enemy_Projectile": _missile_boxes(m, d),
        "Boss": BOSSES.box(m.boss, 76, 196 - m.ship_y, valid=ship & (m.boss < Boss.EXPLODES)),
        "Boss_Block_Green": box(np.array((56, 84)), 199 - m.ship_y, 20, 15, ship),
        "Boss_Block_Blue": _block_boxes(m, BELT, BELT_ROWS).where(ship),
        "Boss_Block_Red": _block_boxes(m, HULL, HULL_ROWS).where(ship),
        "Score": SCORE.box(m.score),
        "Life": _lives(m),
    }


def as_drawn(m: Ram) -> Drawn:
    """Undo the moves since the frame was drawn."""
    over = m.begins & (m.look != Look.GONE) & ((m.stage > 0) | (m.rounds > 0))
    stage = jnp.where(over, jnp.where(m.stage == 0, Stage.SHIP, m.stage - 1), m.stage)
    row_y = _heights(m)
    left, right = _wings(m)
    bats = jnp.where(stage == Stage.SHIP, 0, row_y)
    rows = jnp.where(stage >= Stage.BATS, bats, when(ROW < FLOCK, m.row_y))
    sky = Sky(rows, stage < Stage.BATS, stage == Stage.SHIP)
    return Drawn(stage, m.x - _player_step(m), m.bat_x - _bat_steps(m), row_y, left, right, sky)


def _player_step(m: Ram) -> jax.Array:
    """Columns that the player has moved to the right, as far as the RAM shows them."""
    turned = (m.drawn_look > 0) & ((m.drawn_look == UPRIGHT) != (m.look == 0))
    crossed = jnp.where((m.x & 3) == 0, 1, -1)
    frames = div(jnp.maximum(m.shot_y - Shot.LAUNCH, 0), 6)
    since = m.x - m.shot_x + 4  # columns since the launch
    steady = (m.shot_y < Shot.NONE) & (jnp.abs(since) == frames) & (m.idle == 0)
    return match((m.shield, 0), (turned, crossed), (steady, jnp.sign(since)), otherwise=0)


def _bat_steps(m: Ram) -> jax.Array:
    """Columns that bats have flown to the right; ambiguous cases count as no move."""
    step = jnp.where(m.heading >> ROW & 1 == 1, 1, -1)
    flew = _flies_aside(m, m.bat_x - step) & (_flies_aside(m, m.bat_x) | ((m.clock & 2) != 0))
    return when(flew & (m.alive >> ROW & 1 == 1), step)


def _flies_aside(m: Ram, x: jax.Array) -> jax.Array:
    """True if bats at these columns fly sideways on this frame, which is rarer near the edges."""
    beyond = (x < m.most_left) | (x >= m.most_right)
    edge = (x - 3 < m.most_left) | (x + 3 >= m.most_right)
    near = (x - 9 < m.most_left) | (x + 9 >= m.most_right)
    often = (m.rounds >= 3) | ((m.clock & 1) == 1)
    return beyond | jnp.where(edge, (m.clock & 3) == 2, ~near | often)


def _heights(m: Ram) -> jax.Array:
    """Rows of the bats before they moved; low bats shake by one row."""
    y = m.row_y - when((m.row_y <= SHAKING) & ((m.row_y & 1) == 0), 1)
    return y - when(_climbs(m, y), jnp.where(m.rises, 2, -2))


def _climbs(m: Ram, y: jax.Array) -> jax.Array:
    """True if the bats rise or sink on this frame, all of them by two rows."""
    last = m.enemies == 1
    several = ((6 - m.gone_rows) & 255) >= 5
    ceiling = jnp.where(last | several | (m.rounds == 0), CEILINGS[1], CEILINGS[0])
    floor = jnp.where(last, LAST_BAT_FLOOR, ceiling - DEPTH)
    lowest = jnp.min(jnp.where(m.row_y > 0, y, NO_ROW)) - floor
    upper = among(ceiling - y[6], range(10))
    lower = among(lowest, range(5)) & m.rises
    mask = match((upper & (m.rounds < 2), 15), (upper | lower, 7), (m.enemies >= 5, 3), otherwise=1)
    phase = jnp.where(mask == 15, 12, 0)
    return ((m.clock & mask) == phase) & (m.alive != 0)


def _wings(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Pictures of the wings before they changed, as they do every eight frames."""
    changed = (m.clock & 7) == 7
    left = jnp.where(changed, _wing_before(m, m.left), m.left)
    right = jnp.where(changed, _wing_before(m, m.right), m.right)
    return left, right


def _wing_before(m: Ram, wing: jax.Array) -> jax.Array:
    """The previous picture of a wing; eggs grow every other time."""
    opens = m.closes >> ROW & 1 == 0
    egg = jnp.where((m.clock & 15) == 7, jnp.where(wing == 0, Wing.LOST, wing - 1), wing)
    wider = match((wing == Wing.OPEN - 1, Wing.OPEN), otherwise=jnp.minimum(wing + 1, Wing.OPEN))
    flaps = jnp.where(opens, jnp.maximum(wing - 1, Wing.CLOSED), wider)
    return match((wing >= Wing.LOST, wing), (wing < Wing.CLOSED, egg), otherwise=flaps)


def _player_box(m: Ram, d: Drawn) -> Box:
    first = m.drawn_look == 0
    wide = (m.drawn_look == UPRIGHT) | (first & (m.look == 0))
    there = wide | (m.drawn_look == NARROW) | first
    return box(d.x - jnp.where(wide, 70, 69), 173, jnp.where(wide, 7, 5), 10, there)


def _shield_box(m: Ram, d: Drawn) -> Box:
    """The shield; near the left edge its lower rows start a line later."""
    just_gone = (m.pause == 4) & ((m.clock & 63) == 1)
    x = d.x - 74
    return box(x, 169, 16, jnp.where(x < 25, 20, 19), m.shield | just_gone)


def _shot_box(m: Ram, d: Drawn) -> Box:
    y = 198 - m.drawn_shot
    x = m.shot_x - 71
    top = line_of(d.sky, y, x, SHOT_BEAM)
    end = line_of(d.sky, y - 6, x, SHOT_BEAM)
    return box(x, top, 1, end - top, m.drawn_shot != 0).clip(*AIR)


def _bird_boxes(m: Ram) -> Box:
    slot = np.arange(2 * FLOCK)
    look = jnp.concatenate([m.left[:FLOCK], m.right[:FLOCK]])
    y = 203 - jnp.tile(m.row_y[:FLOCK], 2)
    alive = m.alive >> slot & 1 == 1
    return BIRD_PICTURES.box(look, m.bird_x - 70, y, mirrored=slot >= FLOCK, valid=alive)


def _bat_boxes(m: Ram, d: Drawn) -> Box:
    """Two wings; the right one is mirrored."""
    left, upper, _, height = BAT_PICTURES.extent(d.left)
    right, other, _, other_height = BAT_PICTURES.extent(d.right)
    top = jnp.minimum(upper, other)
    end = jnp.maximum(upper + height, other + other_height)
    there = (m.left <= Wing.LOST) & (m.row_y > 0)
    color = jnp.where(d.stage == Stage.RED_BATS, RED, BAT_BLUE)
    x = d.bat_x - 70 + left
    y = 201 - d.row_y + top
    return box(x, y, 16 - left - right, end - top, there, color=color)


def _missile_boxes(m: Ram, d: Drawn) -> Box:
    x = packed_position(m.missile_code) - 47
    below = m.ship_y - m.missile_top
    crosses = d.sky.ship & (np.arange(4) == 3) & (below < 44)
    first = jnp.where(crosses, _ship_line(m, below), _appears(m, d, x))
    last = jnp.where(crosses, _ship_line(m, below + 6), line_of(d.sky, m.missile_end, x, OFF_BEAM))
    black, end = BLACK_LINES
    top = jnp.where(among(first, range(black, end)), end, first)
    bottom = jnp.where(among(last - 1, range(black, end)), black, last)
    own = _own_slots(m)
    flies = m.missiles >> np.arange(4) & 1 == 1
    here = [(own[i] == np.arange(8)) & flies[i] for i in range(4)]

    def in_slots(v: jax.Array) -> jax.Array:
        return sum((when(h, v[i]) for i, h in enumerate(here)), jnp.zeros(8, jnp.int32))

    color = in_slots(_colors_of_shots(d, top))
    boxes = box(in_slots(x), in_slots(top), 1, in_slots(bottom - top), color=color)
    return boxes.where(functools.reduce(jnp.logical_or, here)).clip(*AIR)


def _colors_of_shots(d: Drawn, top: jax.Array) -> jax.Array:
    """Colours of enemies' shots in their first lines."""
    y = LINE_PLUS_ROW - top
    offset = place(d.sky, y)
    beside = d.stage * ROW_LINES + jnp.minimum(offset, ROW_LINES - 1)
    lowest = jnp.min(jnp.where(d.sky.rows > 0, d.sky.rows, NO_ROW))
    between = d.sky.birds & (offset != NO_ROW) & (y > lowest)
    return jnp.where((offset < ROW_LINES) | between, lookup(ROW_COLORS, beside), WHITE)


def _own_slots(m: Ram) -> jax.Array:
    """The slot that each shot keeps as it falls: its position as if it had started on frame 0.

    Shots fall by two rows a frame except on one frame in 128, and stay more than 24 rows apart.
    """
    frame = ((m.time - 1) & 255) * 64 + (m.clock & 63)
    start = m.missile_top + 2 * (frame - (frame + 127 >> 7))
    return div(mod(start, 8 * APART), APART)


def _appears(m: Ram, d: Drawn, x: jax.Array) -> jax.Array:
    """The first line of enemies' shots outside the ship."""
    offset = place(d.sky, m.missile_top)
    line = LINE_PLUS_ROW - m.missile_top
    beside_player = among(m.missile_top, range(0x18, 0x1D))
    beam = match((m.missile_top >= 0x1E, 76), (beside_player, 31), otherwise=49)  # in the zone
    return match(
        (m.missile_top < ZONE, line + when(x < beam, 1)),
        (offset >= ROW_LINES, line + 2),
        ((offset == 0) & d.sky.birds, line + jnp.where(x < 58, 3, 2)),  # the first line is black
        otherwise=line_of(d.sky, m.missile_top, x, ON_BEAM),
    )


def _ship_line(m: Ram, line: jax.Array) -> jax.Array:
    """The next line of the ship at which the program changes the shot."""
    change = line + when(among(line, (20, 22, 25)), 1)
    return 196 - m.ship_y + match((line < 19, 19), (line >= 43, 44), otherwise=change)


def _block_boxes(m: Ram, blocks: np.ndarray, height: int) -> Box:
    there = m.blocks[blocks[:, 0]] >> blocks[:, 1] & 1 == 1
    return box(blocks[:, 2], blocks[:, 3] + START_Y - m.ship_y, 4, height, there)


def _lives(m: Ram) -> Box:
    """The icons, growing to the right; a lost life still shows on the frame of its loss."""
    lost = m.begins & (m.look == Look.GONE)
    icon_count = m.lives - 1 + when(lost, 1)
    return CANNONS.box(icon_count, value=m.lives)


PLAYER = Bounds(ORANGE, (0, 172, 160, GROUND), min_size=(5, 10))
# Its last rows are below all shots.
SHIELD = Bounds(WHITE, (0, GROUND, 160, 189), min_size=(8, 3), then=(Raised(15),))
SHOTS = Blobs((BALL, GREEN, RED), AIR, Shape(w=1, h=(5, 7)))
FLYING = Blobs(BIRD_COLORS, (0, TOP_LINE, 160, 165), Shape(w=(5, 8), h=(8, 13)))


def _bat_pixels(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """Clear the mask on frames with birds: some of their rows have a colour of bats."""
    birds = materialize(lambda p: color_mask(p[:, :, TOP_LINE:GROUND], (PURPLE,)), planes)
    return jnp.where(any_of(or_rows(birds)) != 0, U(0), mask)


BOTH_WINGS = Blobs(BAT_COLORS, AIR, Shape(w=(4, 16), h=(8, 15)), filters=(_bat_pixels,))
MISSILE_COLORS = tuple(sorted({WHITE, *BIRD_COLORS, *BAT_COLORS} - {BALL, RED}))
HIGH = (0, TOP_LINE, 160, BLACK_LINES[0])
LOW = Blobs(WHITE, (0, BLACK_LINES[1], 160, GROUND), Shape(w=1, h=(2, 6)))
GREENISH = Blobs(BALL, HIGH, Shape(w=1, h=4))  # the player's shot is higher
MISSILES = Blobs(MISSILE_COLORS, HIGH, Shape(w=1, h=(3, 7)), also=(LOW, GREENISH))
BOSS_FIGURE = Blobs((NAVY, RED), (72, 58, 88, 130), Shape(w=(6, 8), h=(9, 11)), first=NAVY)
DOMES = Bounds(
    GREEN,
    ((56, 58, 76, 130), (84, 58, 104, 130)),
    min_size=(20, 15),
    exclude=("Player_Projectile",),
)
ICONS = CANNONS.rule(ORANGE, (78, 13, 103, 18), single=2)


def _block_cells(color: int, blocks: np.ndarray, height: int) -> Cells:
    """Blocks below the domes, also behind shots."""
    x = tuple(blocks[:, 2].tolist())
    y = tuple(blocks[:, 3].tolist())
    return Cells((color, WHITE), x, y, 4, height, floats=(GREEN, DOMES_BOTTOM))


block = functools.partial(Category, needs=("Boss_Block_Green",))

GAME = Game(
    name="Phoenix",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(rare=("Bat", "Enemy_Projectile", "Phoenix")),  # shots beside enemies
    categories=(
        Category("Player", PLAYER, role="player", doc="the cannon"),
        Category("Shield", SHIELD, doc="around it"),
        Category("Player_Projectile", SHOTS, doc="its shot"),
        Category("Phoenix", FLYING, count=8, rgb=(125, 48, 173), doc="birds: side * 4 + row"),
        Category("Bat", BOTH_WINGS, count=7, color_row=3, doc="bats, eggs and half bats: row"),
        Category("Enemy_Projectile", MISSILES, count=8, doc="enemies' shots"),
        Category("Boss", BOSS_FIGURE, rgb=(28, 32, 156), doc="the alien in the ship"),
        Category("Boss_Block_Green", DOMES, count=2, doc="domes of the mother ship"),
        block("Boss_Block_Blue", _block_cells(BLUE, BELT, BELT_ROWS), count=40, doc="its belt"),
        block("Boss_Block_Red", _block_cells(RED, HULL, HULL_ROWS), count=92, doc="its hull"),
        display("Score", SCORE.rule(LIME), role="score", doc="points"),
        display("Life", ICONS, role="lives", doc="cannons in reserve; value: one more"),
    ),
)
