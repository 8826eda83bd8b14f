"""Pitfall II: Harry looks for Rhonda, Quickclaw, a rat, a ring and gold in a cavern.

Picture: docs/games/Pitfall2.png

Screen: the cavern has eight columns and 31 floors of 45 lines. The screen shows one column, and
three to four of its floors, which scroll by lines. Sprite 1 is the creature or treasure of each
floor, sprite 0 Harry. A second chip in the cartridge feeds the drawing loop with pictures and
colours (`pictures`). A balloon that carries Harry is a part of his picture, and also an object. The
ground, walls, ledges, holes, water and waterfall, and the maker's name are scenery. The game has no
lives: a bitten Harry goes back to the last cross.

Slots: the slot of a ladder, gold or beast is its floor's number modulo five.

RAM: no map of it was known; all was read from the ROM's code. The drawing loop is at $F128-$F60D of
bank 1. Harry and the scroll move before the frame is drawn. The beasts of every second floor move
afterwards ($D9D2 of bank 0); `drawn` undoes this.

Covered: random play, and 3,300 frames of all columns and floors, with Harry put there by writing
RAM. They show all kinds of objects, also eels (130 frames), and balloons (500) alone and with Harry
below. The treasures were seen in their positions and, except for gold, not taken.

Not exact: on two frames after Harry enters a column or goes back to a cross, some floors are still
empty, and the RAM has only one of them. A frog or gold that the view's edge cuts keeps blank rows.
Harry's rows behind the ground count, unless he is on a ladder. An eel has the next frame's colour.

VEM: it misses rows of hair and claws on ground of their colour, parts behind Harry, and condors and
scorpions with few rows left at the view's edge.
"""

import functools
from dataclasses import replace
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Game,
    NumberDisplay,
    Raised,
    Shape,
    among,
    choose,
    display,
    edges,
    match,
    mod,
    only,
    pick,
)
from ocjax.extractors.pitfall2.drawn import SLOT, Drawn, as_drawn, floor_line
from ocjax.extractors.pitfall2.pictures import CREATURES, CUTS, HARRYS
from ocjax.extractors.pitfall2.ram import ROM, Balloon, Dead, Kind, Pose, Rail, Ram
from ocjax.extractors.pitfall2.vision import Above, Between, Completed, Rungs

FONT = ROM.font([0x20F8 - 8 * digit for digit in range(10)], rows=8, top_first=True)
SCORE = NumberDisplay(FONT, right=70, top=10, digits=6)
VIEW_TOP = 32
VIEW_BOTTOM = 184
VIEW = (8, VIEW_TOP, 160, VIEW_BOTTOM)

EVERYWHERE = {  # kinds that may live on several floors in view
    "Scorpion": (Kind.SCORPION,),
    "Bat": (Kind.BAT,),
    "Condor": (Kind.CONDOR,),
    "Frog": (Kind.FROG,),
    "GoldBar": (Kind.GOLD_BAR, Kind.RIGHT_GOLD_BAR),
}
SINGLE = {  # kinds that appear at most once in view
    "Cross": Kind.CROSS,
    "ElectricEel": Kind.EEL,
    "Rat": Kind.RAT,
    "Rhonda": Kind.RHONDA,
    "Quickclaw": Kind.QUICKCLAW,
    "DiamondRing": Kind.RING,
    "Balloon": Kind.BALLOON,
}
START = 4000  # points of a new game
HARRY_TOP = 11  # line of Harry's first row, minus `harry_y`
BALLOON_TOP = -16  # line of the balloon above him, minus `harry_y`
BLINKS = 8  # a bit of the clock: hides Harry while he goes back
ROOF = 34  # first line of the next floor's roof
ROOF_LINES = 7
NEAR_LADDER = range(72, 82)  # columns of Harry below a hole
LADDER_TOP = 33  # the first line that may show a ladder
LADDER_LEFT = 78
LADDER_WIDTH = 4
LADDER_RISE = 1  # lines of a ladder above its floor's first line
LADDER_ROWS = 26
RUNG_PITCH = 4  # two rows of a rung and two between them
TO_RUNG = (0, 0, 2, 1)  # rows down to a rung, by the cut rows of a pitch
BELOW_RUNG = (2, 0, 0, 1)  # rows below a rung, by the visible rows of a pitch


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _harry_box(m),
        "Ladder": _in_slots(m, _ladder_boxes(m)),
        **_creature_boxes(m),
        "PlayerScore": SCORE.box(m.score, value=m.score - START),
    }


def _harry_box(m: Ram) -> Box:
    """Harry, who blinks while he goes back to a cross."""
    hidden = (m.dead > Dead.NO) & ((m.clock ^ m.dead) & BLINKS == 0)
    y = m.harry_y + HARRY_TOP
    is_mirrored = m.harry_mirrored
    whole = HARRYS.box(m.pose, m.harry_x, y, mirrored=is_mirrored, valid=~hidden)
    return _below_roofs(m, whole).clip(*VIEW)


def _below_roofs(m: Ram, whole: Box) -> Box:
    """Harry's visible part while he climbs a ladder through the roof of a floor."""
    roofs = floor_line(m)[:-1] + ROOF
    ends = roofs + ROOF_LINES
    there = among(m.harry_x, NEAR_LADDER) & (m.rail[1:] == Rail.LADDER)
    top = whole.y
    right = whole.x + whole.w
    bottom = whole.y + whole.h
    hides_top = there & (top >= roofs) & (top < ends)
    hides_bottom = there & (bottom > roofs) & (bottom <= ends)
    first = jnp.where(hides_top.any(), only(hides_top, ends), top)
    last = jnp.where(hides_bottom.any(), only(hides_bottom, roofs), bottom)
    return edges(whole.x, first, right, last, whole.valid & (last > first))


def _ladder_boxes(m: Ram) -> Box:
    """Ladders, from the first rung in view to the last one."""
    first = floor_line(m) - LADDER_RISE
    cut = jnp.maximum(LADDER_TOP - first, 0)
    top = first + cut + pick(cut & RUNG_PITCH - 1, TO_RUNG)
    rows = jnp.minimum(VIEW_BOTTOM - first, LADDER_ROWS)
    bottom = first + rows - pick(rows & RUNG_PITCH - 1, BELOW_RUNG)
    there = (m.rail == Rail.LADDER) & (bottom > top)
    return edges(LADDER_LEFT, top, LADDER_LEFT + LADDER_WIDTH, bottom, there)


def _creature_boxes(m: Ram) -> dict[str, Box]:
    """The creatures and treasures of the floors, by kind."""
    drawn = as_drawn(m)
    boxes = _in_slots(m, _shown(drawn))
    kind = _in_slots(m, drawn.kind)
    many = {name: boxes.where(among(kind, kinds)) for name, kinds in EVERYWHERE.items()}
    those_alone = {name: boxes.only(kind == its_kind) for name, its_kind in SINGLE.items()}
    by_kind = many | those_alone
    is_bright = ((drawn.kind == Kind.EEL) & drawn.bright).any()
    is_ridden = (m.balloon == Balloon.RIDDEN) & (m.pose == Pose.FLIES)
    eel_color = jnp.where(is_bright, WHITE, BLACK)
    return by_kind | {
        "ElectricEel": replace(by_kind["ElectricEel"], color=eel_color),
        "Balloon": choose(is_ridden, _ridden_box(m), by_kind["Balloon"]),
    }


def _shown(drawn: Drawn) -> Box:
    """The visible part of each creature in the view."""
    y = drawn.y
    above = jnp.clip(VIEW_TOP - y, 0, len(CUTS))
    rows = jnp.clip(VIEW_BOTTOM - y, 1, len(CUTS) + 1)
    cut = match((above > 0, above), (rows <= len(CUTS), len(CUTS) + rows), otherwise=0)
    index = CREATURES.index(kind=drawn.kind, picture=drawn.picture, cut=cut)
    boxes = CREATURES.box(index, drawn.x, y, mirrored=drawn.mirrored, valid=drawn.valid)
    return boxes.clip(*VIEW)


def _ridden_box(m: Ram) -> Box:
    """The balloon above Harry, drawn with his sprite: the picture of a free one, mirrored."""
    top = m.harry_y + BALLOON_TOP
    zero = jnp.zeros_like(top)
    there = jnp.ones_like(top, bool)
    balloon = Drawn(
        kind=zero + Kind.BALLOON,
        x=m.harry_x,
        y=top,
        picture=zero,
        mirrored=~m.harry_mirrored,
        bright=~there,
        valid=there,
    )
    return _shown(balloon)


_Slots = TypeVar("_Slots", Box, jax.Array)


def _in_slots(m: Ram, parts: _Slots) -> _Slots:
    """Reorder values by floor on the screen to values by the floor's number."""
    numbered = mod(m.floor + SLOT, len(SLOT))
    here = numbered[None] == SLOT[:, None]

    def moved(part: jax.Array) -> jax.Array:
        by_slot = jnp.sum(jnp.where(here, part[None].astype(jnp.int32), 0), axis=1)
        return by_slot.astype(part.dtype) if part.ndim else part

    return jax.tree.map(moved, parts)


HAIR = 18
FACES = (74, 72)  # the second one below a balloon
SHIRT = 200
LEGS = 210
RUNG = 18
DULL = 50  # crosses
CAT = (22, 26, 20)
WHITE = 14
BAT = 4
BLACK = 0
BLUE = 132  # water
FEATHERS = (38, 40, 42)
BEAK = 20
GOLD = 30
GRAY = 10  # the rat
FROG = (212, 214)
DRESS = 216
GROUND = 24  # also of the cat's hat
GIRL = (DRESS, 50, 74, LEGS, 214, 208, 20)
CLOTH = (68, 66, DRESS, 64, 8)  # the balloon and its string
RING_LEFT = 72
INK = 12  # the score
look = functools.partial(Blobs, region=VIEW)
HARRY = look(
    (SHIRT, LEGS, *FACES, HAIR),
    shapes=Shape(w=(2, 8), h=(6, 21)),
    gap=(1, 7),
    filters=(Above(HAIR, FACES),),
)
LADDER = Blobs(
    RUNG,
    (LADDER_LEFT - 4, VIEW_TOP, LADDER_LEFT + 8, VIEW_BOTTOM),
    shapes=Shape(w=(2, 4), h=(1, 26)),
    gap=(0, 10),
    filters=(Rungs(4, FACES),),
)
SCORPION = look(WHITE, shapes=Shape(w=(7, 8), h=(4, 11)))
EEL_SHAPE = Shape(w=8, h=(2, 3))
DARK_EEL = look(BLACK, shapes=EEL_SHAPE, filters=(Between(BLUE),))
EEL = look(WHITE, shapes=EEL_SHAPE, also=(DARK_EEL,))
BATS = look(BAT, shapes=Shape(w=(1, 7), h=(1, 9)), gap=(1, 1))
CONDOR = look(
    (*FEATHERS, BEAK, WHITE),
    shapes=Shape(w=(5, 8), h=(4, 8)),
    then=(Completed(7, above=False, edge=VIEW_BOTTOM),),
)
BESIDE_RING = (RING_LEFT, VIEW_TOP, RING_LEFT + 8, VIEW_BOTTOM)
BARS = look(GOLD, shapes=Shape(w=(1, 7), h=(1, 14)), gap=(2, 2), ignore=(BESIDE_RING,))
FROGS = Blobs(
    FROG,
    (64, VIEW_TOP, 96, VIEW_BOTTOM),
    shapes=Shape(w=(5, 8), h=(3, 9)),
    then=(Completed(5, above=True, edge=VIEW_TOP),),
)


def _at(colors: int | tuple[int, ...], x: int, size: tuple[int, int], **options: Any) -> Bounds:
    """A rule for an object with a fixed position."""
    return Bounds(
        colors, (x, VIEW_TOP, x + 8, VIEW_BOTTOM), min_size=size, max_size=(8, 27), **options
    )


CROSS = _at(DULL, 40, (4, 3))
RHONDA = _at(GIRL, 32, (2, 6), exclude=("Player",))
QUICKCLAW = _at(CAT, 32, (4, 8), then=(Raised(2),))
RING = _at(GOLD, RING_LEFT, (5, 6), then=(Raised(3),))
RAT = Bounds(GRAY, VIEW, (6, 6))
BALLOON_RULE = Bounds(CLOTH, VIEW, (5, 8), (8, 27))

GAME = Game(
    name="Pitfall2",
    rom=ROM,
    ram=Ram,
    decode=decode,
    backdrop=(8, 158),
    categories=(
        Category("Player", HARRY, rgb=(92, 186, 92), role="player", doc="Harry"),
        Category("Ladder", LADDER, count=5, rgb=(105, 105, 15), doc="one a floor"),
        Category("Cross", CROSS, rgb=(163, 57, 21), doc="where Harry begins again"),
        Category("Scorpion", SCORPION, count=5, rgb=(236, 236, 236), doc="on the ground"),
        Category("Bat", BATS, count=5, rgb=(111, 111, 111), doc="flies up and down"),
        Category("Condor", CONDOR, count=5, rgb=(180, 122, 48), doc="flies up and down"),
        Category("Frog", FROGS, count=5, rgb=(82, 126, 45), doc="leaps across a hole"),
        Category("ElectricEel", EEL, doc="swims, black or white"),
        Category("GoldBar", BARS, count=5, rgb=(252, 252, 84), doc="5,000 points"),
        Category("Rat", RAT, rgb=(192, 192, 192), doc="15,000 points"),
        Category("Rhonda", RHONDA, rgb=(135, 183, 84), doc="Harry's niece, 10,000 points"),
        Category(
            "Quickclaw",
            QUICKCLAW,
            rgb=(162, 162, 42),
            colors=(*CAT, GROUND),
            doc="her cat, 10,000 points",
        ),
        Category("DiamondRing", RING, rgb=(252, 252, 84), doc="20,000 points"),
        Category("Balloon", BALLOON_RULE, rgb=(66, 72, 200), doc="takes Harry up"),
        display("PlayerScore", SCORE.rule(INK, base=-START), role="score", doc="points won"),
    ),
)
