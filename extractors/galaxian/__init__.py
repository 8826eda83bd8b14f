"""Galaxian: a ship below a formation of aliens, which dive at it and drop bombs.

Picture: docs/games/Galaxian.png

Screen: the frame around the field is scenery. Explosions are not objects. An alien of the formation
has two or three colours; its `rgb` is the upper part's.

Slots: EnemyShip is row * 7 + column, rows from the top, columns as the game counts them: when the
leftmost one is empty, the others move one to the left. DivingEnemy has the game's five records,
then a flagship's three escorts, which share one record. EnemyMissile has the bombs from the top
down: a new bomb moves the bombs below it to the next slot.

RAM: ALE's source (score, lives), and the ROM's code. f000-f9a1 draws from positions on the stack.
Then d000-d943 moves the objects for the next frame, a part on each of eight frames: divers on even
frames and on 5, the formation on 1, bombs a line down on 1, 3 and 7. One player of the chip shows
the ships of a row by copies. Divers share the other one and flicker if more than two are on a line.

Covered: all modes and difficulties, launches, returns, escorts, hits, lost lives, new rounds with
one and two digits, the end of the game, odd and even frame skips.

Not exact: a diver that has just reached its place in the formation, where the game draws no ship
until it sets up the rows again; bombs on the frame on which a bomb between them is dropped or hits.

VEM: it misses bombs that touch a diver or a ship of the formation, bombs in a colour of the ship's
explosion, and parts of divers that ships of the formation cover. It takes white stars of explosions
that touch a ship of the formation for flagships, and red or white pieces of the ship's explosion
for divers.
"""

import itertools
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Game,
    IconRow,
    NumberDisplay,
    Run,
    Runs,
    Shape,
    Variants,
    among,
    box,
    display,
    lookup,
    only,
    when,
)
from ocjax.extractors.galaxian.divers import (
    DIVER_PICTURES,
    ESCORT_BITS,
    PICTURE_ROWS,
    ROW_LINES,
    Divers,
    divers_as_drawn,
)
from ocjax.extractors.galaxian.formation import (
    FORMATION_TOP,
    ROW_COLORS,
    SHIP_COLORS,
    formation_boxes,
)
from ocjax.extractors.galaxian.ram import BANK, ROM, Death, Kind, NewLife, Ram, Release, Turn

FONT = ROM.font(BANK + 0xF00, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=103, top=4, digits=6)
ROUND = NumberDisplay(replace(FONT, pitch=9), right=145, top=188, digits=2)
LIVES = IconRow(left=19, top=188, width=3, height=7, pitch=5)

FIELD = (16, 16, 144, 184)
LEFT = FIELD[0]
TOP = FIELD[1]
RIGHT = FIELD[2]
BOTTOM = FIELD[3]
WHITE = 14
YELLOW = 252  # of the score
GOLD = 42  # of the ship's shot
GRAY = 12  # of the displays at the bottom
PINK = 74  # of bombs
RED = 72
PURPLE = 106
GREEN = 216
DIVER_COLORS = (WHITE, RED, PURPLE, GREEN)  # by kind

ESCORT_LEFTS = np.array((-16, 0, 16))
PLAYER_TOP = 170
SHIP_SIZE = (8, 14)
SHOT_TOP = 16
SHOT_LOWEST = 168
BOMB_TOP = 24
BOMB_LINES = 4
BOMB_ROWS = np.arange(1, 14)  # of `Ram.bombs`, three steps each
HIGH_ROWS = 10  # rows in the first word
BITS = 30  # of a word
SLOTS = np.arange(8)  # of bombs


def decode(m: Ram) -> dict[str, Box]:
    divers = divers_as_drawn(m)
    new_life = _begins(m)
    flies = among(m.missile_y, range(1, SHOT_LOWEST)) & ~new_life
    return {
        "Player": box(m.player_x + 8, PLAYER_TOP, *SHIP_SIZE, _ship_shown(m)),
        "EnemyShip": formation_boxes(m, divers),
        "DivingEnemy": _diver_boxes(m, divers),
        "PlayerMissile": box(m.missile_x + 2, m.missile_y + SHOT_TOP, 1, 3, flies),
        "EnemyMissile": _bomb_boxes(m),
        "Score": SCORE.box(m.score),
        "Lives": LIVES.box(m.lives + when(new_life, 1), value=m.lives + 1),
        "Round": ROUND.box(m.round),
    }


def _begins(m: Ram) -> jax.Array:
    """True if the game set up a life after this frame."""
    return (m.player_x == NewLife.X) & (m.player_code != NewLife.CODE) & ~m.dead


def _ship_shown(m: Ram) -> jax.Array:
    hit_now = (m.death == Death.BEGINS) & (m.death_tune == Death.FIRST_NOTE)
    return (~m.dead & ~_begins(m)) | hit_now


def _diver_boxes(m: Ram, d: Divers) -> Box:
    """The records, then the escorts, which fly side by side and share a record."""
    escort_x = only(d.escorting, d.x)
    escort_y = only(d.escorting, d.y)
    escort_picture = only(d.escorting, d.picture)
    x = jnp.concatenate([d.x, escort_x + ESCORT_LEFTS]) + 8
    y = jnp.concatenate([d.y, jnp.repeat(escort_y, 3)]) + TOP
    picture = jnp.concatenate([d.picture, jnp.repeat(escort_picture, 3)])
    escorted = jnp.any(d.escorting & d.there) & ((d.escorts & ESCORT_BITS) > 0)
    there = jnp.concatenate([d.there & ~d.escorting, escorted])
    below = jnp.clip(y + PICTURE_ROWS - BOTTOM, 0, PICTURE_ROWS)
    above = jnp.clip(TOP - y, 0, PICTURE_ROWS)
    index = DIVER_PICTURES.index(picture=picture, cut=PICTURE_ROWS + below - above)
    color = lookup(DIVER_COLORS, jnp.append(m.kind, np.full(3, Kind.ESCORT)))
    return DIVER_PICTURES.box(index, x, y, valid=there, color=color).clip(*FIELD)


def _bomb_boxes(m: Ram) -> Box:
    step = _bomb_steps(m) - when(among(m.turn, Turn.BOMBS), 1)
    dropped = (m.turn == Turn.RELEASE) & ~among(m.release, Release.NONE)
    there = ~(dropped & (m.above_new + 1 == SLOTS))
    y = BOMB_TOP + BOMB_LINES * step
    return box(m.bomb_x + 11, y, 1, BOMB_LINES, there, color=PINK).clip(*FIELD)


def _bomb_steps(m: Ram) -> jax.Array:
    """The step of each bomb, from the top: the positions of set bits in two words.

    Without a bomb, the step is below the field.
    """
    in_rows = when(m.lowest < BOMB_ROWS, m.bombs)
    shift = BITS - 3 - 3 * np.arange(HIGH_ROWS)
    high = jnp.sum(in_rows[:HIGH_ROWS] << shift)
    low = jnp.sum(in_rows[HIGH_ROWS:] << shift[: len(BOMB_ROWS) - HIGH_ROWS])
    words = itertools.accumulate(SLOTS[1:], _after_bomb, initial=(high, low))
    return jnp.stack([jnp.where(h > 0, lax.clz(h), BITS + lax.clz(w)) + 1 for h, w in words])


def _after_bomb(words: tuple[jax.Array, jax.Array], _: int) -> tuple[jax.Array, jax.Array]:
    """The two words without the first set bit."""
    high, low = words
    return _without_first(high), jnp.where(high > 0, low, _without_first(low))


def _without_first(word: jax.Array) -> jax.Array:
    """The word without its highest bit."""
    return word & ~(jnp.int32(1) << 31 - lax.clz(word))


def _ship_runs() -> tuple[Run, ...]:
    """The second line of ships: two pixels, or four with lowered wings."""
    runs = []
    for row, color in enumerate(ROW_COLORS.tolist()):
        line = FORMATION_TOP + ROW_LINES * row + 1
        run = partial(Run, color, line, left=(LEFT, RIGHT - 2), height=8)
        runs.append(run(width=2, before=2, above=1, after=2))
        runs.append(run(width=4, before=1, after=1))
    return tuple(runs)


SHIPS = Runs(_ship_runs(), most=7, gap=2, columns=(LEFT, RIGHT))
DIVER_SHAPES = (
    Shape(w=(2, 8), h=(1, 10), pixels=(1, 86)),
    Shape(w=(2, 20), h=(11, 22), split=(8, 10)),
    Shape(w=(9, 20), h=(1, 10), split=(8, 10)),
)
COLORED = (GREEN, PURPLE, RED)
# A flagship has more pixels than the ships of its row in the formation, gaps included.
FLAGSHIP = Shape(w=(6, 8), h=(9, 10), pixels=(74, 86))
FLAGSHIPS = Blobs(WHITE, (LEFT, TOP, RIGHT, 168), FLAGSHIP, gap=(2, 1))
DIVING = Blobs(COLORED, FIELD, DIVER_SHAPES, gap=(2, 1), also=(FLAGSHIPS,))
BOMB_COLORS = (PINK, WHITE, *COLORED)  # a bomb has the colour of a diver on its lines
BOMBS = Blobs(BOMB_COLORS, (LEFT, 32, RIGHT, BOTTOM), Shape(w=1, h=4))
MISSILE = Bounds(GOLD, FIELD, max_size=(1, 3))
SHIP_AREA = (LEFT, PLAYER_TOP, RIGHT, BOTTOM)
SHIP = Bounds(WHITE, SHIP_AREA, SHIP_SIZE, SHIP_SIZE, exclude=("EnemyMissile",))

GAME = Game(
    name="Galaxian",
    rom=ROM,
    ram=Ram,
    decode=decode,
    variants=Variants(
        modes={
            1: "starts at round 1",
            2: "starts at round 2",
            3: "starts at round 3",
            4: "starts at round 4",
            5: "starts at round 5",
            6: "starts at round 6",
            7: "starts at round 7",
            8: "starts at round 8",
            9: "starts at round 9",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        Category("Player", SHIP, role="player", doc="the ship"),
        Category(
            "EnemyShip",
            SHIPS,
            count=42,
            colors=SHIP_COLORS,
            doc="in the formation: row * 7 + column",
        ),
        Category("DivingEnemy", DIVING, count=8, doc="five records, three escorts"),
        Category("PlayerMissile", MISSILE, doc="the ship's shot"),
        Category("EnemyMissile", BOMBS, count=8, doc="bombs"),
        display("Score", SCORE.rule(YELLOW), role="score", doc="points"),
        display("Lives", LIVES.rule(GRAY, (16, 188, 40, 195), single=2), role="lives", doc="ships"),
        display("Round", ROUND.rule(GRAY), doc="the round"),
    ),
)
