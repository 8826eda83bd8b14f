"""Defender: a ship above a city saves humans from aliens, in a world wider than the screen.

Screen: a frame shows one alien and one human; the aliens and humans on the screen alternate. The
scanner at the top shows one alien and one human of the whole world per frame, and the ship on every
sixteenth frame. Alternating objects of the last two frames are valid. While the game draws a human,
it does not draw an alien's shot, which waits. The ship's shot and the flame of its engine replace
the ship on the screen, which stays valid. The flame, explosions and the scanner's frame are
scenery.

Slots: aliens and their dots have the game's records. Any record may become a Lander, Mutant or
Baiter, and a Pod's record may become a Swarm. Humans and their dots have the game's numbers.

RAM: OCAtari's current version (names, some bytes), ALE's source (score, lives), a disassembly by
Nick Bensema and Manuel Polik (names), and the ROM's code. After the drawing, the game selects the
next objects, moves shots, and detects hits.

Covered: ALE's modes and difficulties, first waves, the planet lost, deaths, pauses.

Not exact: the RAM lacks the ship's shot on its last frame (one in ten of the frames with a shot).
On the frame on which the last life is lost, the game has already made the records of the next game:
only the display and the city are known. When another life is lost, the RAM loses a capture. Dots of
aliens that follow the ship or come down to a human are a column off in 3 % of the frames. The first
frame of a pause still shows some objects, but none are valid; the same holds for some frames before
the ship moves.

VEM: it misses one of two touching objects in one colour. It reads one digit of Wave per frame.
After the first wave, it may take a human's dot beside the scanner's wall for an alien's.
"""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Pictures,
    Shape,
    ShortRuns,
    bitmaps,
    box,
    display,
    edges,
    when,
)
from ocjax.extractors.defender.drawn import (
    FLAME_COLOR,
    SHIP_COLOR,
    Drawn,
    as_drawn,
    explodes,
    missile,
    own_shot,
    sprite_color,
    visible,
)
from ocjax.extractors.defender.ram import ROM, Kind, Pause, Planet, Ram
from ocjax.extractors.defender.world import (
    CITY_BOTTOM,
    CITY_TOP,
    COLORS,
    FRAME_COLORS,
    LAST_ROW,
    SCANNER,
    alien_dots,
    aliens,
    human_dots,
    humans,
    landers,
    missile_rows,
    of_kind,
    ship_dot,
    ship_row,
)

FONT = ROM.font(0xF5F, rows=7)
SCORE = NumberDisplay(FONT, right=103, top=177, digits=6)
WAVE = NumberDisplay(FONT, right=86, top=72, digits=2)
SHIPS = IconRow(left=4, top=187, width=7, height=5, pitch=16)
BOMBS = IconRow(left=115, top=187, width=6, height=3, pitch=16)

CITY_COLOR = 136
DIGIT_COLOR = 28
FIELD_TOP = 39

SHIP_PICTURE = ROM.rows(0xE21, 5)
SHIPS_ROWS = Pictures.of([SHIP_PICTURE[:rows] for rows in range(6)])  # its upper rows
FIRST_DARK = 97  # least column at which the ship's row just above the city is invisible
SHOT_DARK = 79  # the same for its shot
FULL_WIDTH = 32  # of the shot
ROW_WIDTH = 28  # of a row of it; the lower row starts to the left of the upper one


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    records = aliens(m, d)
    return {
        "Player": _ship(m, d),
        "Player_Shot": _shot(m, d),
        "Enemy_Shot": _alien_shot(m, d),
        "Bomber": of_kind(m, records, Kind.BOMBER, 5, 4)[:1],
        "Baiter": of_kind(m, records, Kind.BAITER, 8, 3),
        "Pod": of_kind(m, records, Kind.POD, 7, 7)[1:3],
        "Swarm": of_kind(m, records, Kind.SWARM, 8, 7)[:3],
        "Lander": landers(m, records),
        "Mutant": of_kind(m, records, Kind.MUTANT, 8, 7),
        "Human": humans(m, d),
        "City_Scape": box(0, CITY_TOP, 160, CITY_BOTTOM - CITY_TOP, m.lost != Planet.GONE),
        "Radar_Enemy": alien_dots(m, d),
        "Radar_Human": human_dots(m, d),
        "Radar_Player": ship_dot(m, d),
        "Wave": _wave_number(m),
        "Score": _points(m),
        "Lives": SHIPS.box(jnp.minimum(m.icons, 3), value=m.lives),
        "Smart_Bomb_Count": BOMBS.box(jnp.minimum(m.bombs, 3), value=m.bombs),
    }


def _ship(m: Ram, d: Drawn) -> Box:
    """The ship, also while another picture replaces it. The city hides its lower rows."""
    top = LAST_ROW + 6 - ship_row(m)
    bottom = jnp.where(m.lost != Planet.GONE, CITY_TOP, LAST_ROW)
    rows = jnp.clip(bottom - top, 0, 5)
    dark = (top + rows == bottom) & (m.x + 4 >= FIRST_DARK)
    reset = (m.pause == Pause.RESET) & (m.wave_over == 0)
    return SHIPS_ROWS.box(
        rows - when(dark, 1),
        m.x,
        top,
        mirrored=~d.forward,
        valid=(d.runs & ~explodes(m, d)) | reset,
        orientation=jnp.where(d.forward, EAST, WEST),
        color=jnp.where(d.dies, sprite_color(m, d), SHIP_COLOR),
    )


def _shot(m: Ram, d: Drawn) -> Box:
    """The ship's shot. The city hides its lower row, and the row above the city ends early."""
    x, shown = own_shot(m, d)
    top = LAST_ROW + 8 - ship_row(m)
    aside = FULL_WIDTH - ROW_WIDTH
    dark = (top + 2 == CITY_TOP) & (x + jnp.where(d.forward, 1, 1 + aside) >= SHOT_DARK)
    single = (m.lost != Planet.GONE) & ((top + 1 >= CITY_TOP) | dark)
    left = x + 1 + when(single & d.forward, aside)
    width = jnp.where(single, ROW_WIDTH, FULL_WIDTH)
    height = jnp.where(single, 1, 2)
    whole = box(left, top, width, height, shown, color=sprite_color(m, d))
    return whole.clip(0, 0, 160, CITY_TOP)


def _alien_shot(m: Ram, d: Drawn) -> Box:
    """A shot of an alien; not valid if humans were drawn in the last two frames."""
    x, row, there = missile(m, d)
    top, bottom = missile_rows(m, d, x, row, 2)
    number = jnp.arange(5)
    now = jnp.any(visible(m, d) & (number == d.human))
    before = jnp.any(visible(m, d) & (number == d.human_before))
    shown = there & ~(now & before)
    whole = edges(x, top, x + 2, bottom, shown, color=sprite_color(m, d))
    return whole.clip(0, FIELD_TOP, 160, CITY_BOTTOM)


def _wave_number(m: Ram) -> Box:
    """The number of the last wave, one digit per frame."""
    shown = (m.wave_over > 0) & (m.pause > 0) & (m.pause < Pause.NEXT_WAVE)
    return WAVE.box(10 * (m.wave >> 4) + (m.wave & 15), valid=shown)


def _points(m: Ram) -> Box:
    digits = jnp.where(m.digits > 9, 0, m.digits)
    total = jnp.sum(digits * np.array((1, 10, 100, 1000, 10_000, 100_000)), dtype=jnp.int32)
    # The last two zeros are always visible; without other digits, they are as wide as a 20.
    return SCORE.box(jnp.maximum(total, 20), value=total)


SHOT_PARTS = 20  # least pixels of a row of the ship's shot


@dataclass(frozen=True)
class LongRuns:
    """The pixels of horizontal runs of at least `least` pixels."""

    least: int

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that the filter keeps."""
        starts = bitmaps.over(mask, self.least, bitmaps.shift_left, jnp.bitwise_and)
        return bitmaps.over(starts, self.least, bitmaps.shift_right, jnp.bitwise_or)


CYCLE = (26, 28, FLAME_COLOR, 94, CITY_COLOR, SHIP_COLOR, 254)  # of the ship's sprite
NOT_CITY = tuple(c for c in CYCLE if c != CITY_COLOR)
FIELD = (0, FIELD_TOP, 160, LAST_ROW)
ABOVE_CITY = (0, FIELD_TOP, 160, CITY_TOP + 1)
CITY = (0, CITY_TOP + 1, 160, CITY_BOTTOM)
MARKS = ((72, 12, 88, 15), (72, 35, 88, 37))  # of the scanner
in_field = functools.partial(Blobs, region=FIELD)
dots = functools.partial(Blobs, region=(*SCANNER[:3], 37), ignore=MARKS)

WHOLE_SHIP = Shape(w=7, h=5, pixels=19)
LOW_SHIP = (  # the city hides some rows
    Shape(w=7, h=4, pixels=16),
    Shape(w=5, h=3, pixels=9),
    Shape(w=3, h=2, pixels=4),
    Shape(w=1, h=1),
)
LOW_RULE = Blobs(SHIP_COLOR, (0, CITY_TOP - 4, 160, CITY_TOP), LOW_SHIP)
PLAYER_RULE = in_field(NOT_CITY, shapes=WHOLE_SHIP, also=(LOW_RULE,))
SHOT_RULE = Bounds(
    CYCLE,
    (0, FIELD_TOP, 160, CITY_TOP),
    min_size=(SHOT_PARTS, 1),
    max_size=(40, 2),
    filters=(LongRuns(SHOT_PARTS),),
)
MISSILE_RULE = Blobs(CYCLE, ABOVE_CITY, Shape(w=2, h=(1, 3)))
IN_CITY_RULE = Blobs(NOT_CITY, CITY, Shape(w=2, h=(3, 16)))
HUMAN_RULE = Blobs(CYCLE, ABOVE_CITY, Shape(w=2, h=4), also=(IN_CITY_RULE,))
CITY_RULE = Bounds(CITY_COLOR, (0, CITY_TOP, 160, CITY_BOTTOM), min_size=(160, 17))

taking_turns = functools.partial(Category, blinks=True)
on_scanner = functools.partial(Category, hud=True, blinks=True)


def _alien_rule(kind: int, *shapes: Shape, gap: tuple[int, int] = (0, 0)) -> Blobs:
    bottom = CITY_TOP if kind == Kind.BOMBER else CITY_BOTTOM  # it has the city's colour
    return Blobs(COLORS[kind], (0, FIELD_TOP, 160, bottom), shapes, gap=gap)


BOMBER_RULE = _alien_rule(Kind.BOMBER, Shape(w=5, h=4, pixels=18))
BAITER_RULE = _alien_rule(Kind.BAITER, Shape(w=8, h=3))
POD_RULE = _alien_rule(Kind.POD, Shape(w=7, h=7))
SWARM_RULE = _alien_rule(Kind.SWARM, Shape(w=8, h=7), gap=(2, 1))
LANDER_RULE = _alien_rule(Kind.LANDER, Shape(w=8, h=7), Shape(w=(6, 8), h=(23, 24)))
MUTANT_RULE = _alien_rule(Kind.MUTANT, Shape(w=8, h=7))
# The scanner's wall hides half of an alien's dot beside it. VEM takes such a dot for an alien's if
# its colour differs from the scanner's in the first wave.
OTHERS = tuple(c for c in COLORS if c != DIGIT_COLOR)
lone_dots = functools.partial(Blobs, shapes=Shape(w=1, h=2), filters=(ShortRuns(1, across=True),))
HALF_DOT = lone_dots(OTHERS, (SCANNER[0], SCANNER[1], SCANNER[0] + 1, SCANNER[3]))
OTHER_HUMAN = lone_dots(OTHERS, (SCANNER[0] + 1, *SCANNER[1:]))
ENEMY_DOT = dots(COLORS, shapes=Shape(w=2, h=(1, 2)), also=(HALF_DOT,))
HUMAN_DOT = dots(DIGIT_COLOR, shapes=Shape(w=1, h=2), also=(OTHER_HUMAN,))
PLAYER_DOT = dots(FRAME_COLORS, shapes=Shape(w=4, h=2))
SHIPS_RULE = SHIPS.rule(SHIP_COLOR, (4, 187, 43, 192))
BOMBS_RULE = BOMBS.rule(SHIP_COLOR, (115, 187, 153, 190))

GAME = Game(
    name="Defender",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # On the last frame, all records belong to the next game. In unusual states, VEM misses
        # objects that touch or blink.
        agreement={"last": 0.68, "modes": 0.95},
    ),
    categories=(
        taking_turns(
            "Player", PLAYER_RULE, attributes=("orientation",), role="player", doc="the ship"
        ),
        Category("Player_Shot", SHOT_RULE, doc="its shot"),
        taking_turns("Enemy_Shot", MISSILE_RULE, doc="a shot of an alien, or a mine"),
        taking_turns("Bomber", BOMBER_RULE, doc="drops mines"),
        taking_turns("Baiter", BAITER_RULE, 8, doc="comes when a wave lasts long"),
        taking_turns("Pod", POD_RULE, 2, doc="holds a swarm"),
        taking_turns("Swarm", SWARM_RULE, 3, doc="three swarmers, which fly together"),
        taking_turns("Lander", LANDER_RULE, 8, doc="carries humans off"),
        taking_turns(
            "Mutant",
            MUTANT_RULE,
            8,
            aliases=("Humanoide_Lander",),
            doc="a lander that has carried a human off",
        ),
        taking_turns("Human", HUMAN_RULE, 5, doc="in the city, carried off, falling or saved"),
        Category("City_Scape", CITY_RULE, doc="gone with the last human"),
        on_scanner("Radar_Enemy", ENEMY_DOT, 8, doc="the scanner's dots of aliens"),
        on_scanner("Radar_Human", HUMAN_DOT, 5, doc="its dots of humans"),
        on_scanner("Radar_Player", PLAYER_DOT, doc="its dot of the ship"),
        display("Wave", WAVE.rule(DIGIT_COLOR, required=True), blinks=True, doc="that is over"),
        display("Score", SCORE.rule(DIGIT_COLOR), role="score", doc="points"),
        display("Lives", SHIPS_RULE, role="lives", doc="icons, at most three; value: lives"),
        display("Smart_Bomb_Count", BOMBS_RULE, doc="icons, at most three; value: bombs"),
    ),
)
