"""Pitfall II: Harry looks for treasure in a cavern of eight columns and 27 floors."""

import functools
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from ocjax.console.boxes import Box, box, choose, edges
from ocjax.console.ops import among, mod, only, pick
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.pitfall2.drawn import SLOT, as_drawn, floor_line
from ocjax.extractors.pitfall2.pictures import BALLOON, HARRYS, PICTURES
from ocjax.extractors.pitfall2.ram import ROM, Balloon, Kind, Pose, Rail, Ram
from ocjax.extractors.pitfall2.vision import Above, Between, Completed, Rungs
from ocjax.vision.displays import NumberDisplay
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised

FONT = ROM.font([0x20F8 - 8 * digit for digit in range(10)], rows=8, top_first=True)
SCORE = NumberDisplay(FONT, right=70, top=10, digits=6)
VIEW = (8, 32, 160, 184)
LEFT, TOP, RIGHT, BOTTOM = VIEW

EVERYWHERE = {  # what may live on several floors in view
    "Scorpion": (Kind.SCORPION,),
    "Bat": (Kind.BAT,),
    "Condor": (Kind.CONDOR,),
    "Frog": (Kind.FROG,),
    "GoldBar": (Kind.GOLD_BAR, Kind.RIGHT_GOLD_BAR),
}
SINGLE = {
    "Cross": Kind.CROSS,
    "ElectricEel": Kind.EEL,
    "Rat": Kind.RAT,
    "Rhonda": Kind.RHONDA,
    "Quickclaw": Kind.QUICKCLAW,
    "Ring": Kind.RING,
    "Balloon": Kind.BALLOON,
}
START = 4000  # points of a new game
HARRY_TOP = 11  # line of Harry's first row, less `harry_y`
BALLOON_TOP = -16  # likewise, of a balloon above him
BLINKS = 8  # a bit of the clock
ROOF = 34  # line of a floor where the roof of the next one begins
ROOF_LINES = 7
NEAR_LADDER = range(72, 82)  # columns of Harry below a hole
LADDER_TOP = 33  # the first line that may show a ladder
LADDER_LEFT = 78
LADDER_RISE = 1  # lines of a ladder above its floor's first line
LADDER_ROWS = 26
RUNG_PITCH = 4  # two rows of a rung and two between them
TO_RUNG = (0, 0, 2, 1)  # rows down to a rung, by the rows of a pitch that are cut off
BELOW_RUNG = (2, 0, 0, 1)  # rows below a rung, by the rows of a pitch that are in view


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _harry_box(m),
        "Ladder": _in_slots(m, _ladder_boxes(m)),
        **_creature_boxes(m),
        "PlayerScore": SCORE.box(m.score, value=m.score - START),
    }


def _harry_box(m: Ram) -> Box:
    """Harry, who blinks while he goes back to a cross."""
    hidden = (m.dead > 0) & ((m.clock ^ m.dead) & BLINKS == 0)
    whole = HARRYS.box(
        m.pose, m.harry_x, m.harry_y + HARRY_TOP, mirrored=m.harry_mirrored == 1, valid=~hidden
    )
    beside = among(m.harry_x, NEAR_LADDER)
    roofs = floor_line(m)[:-1] + ROOF  # the first lines of what hides who climbs through it
    there = beside & (m.rail[1:] == Rail.LADDER)
    top, bottom = whole.y, whole.y + whole.h
    hides_top = there & (top >= roofs) & (top < roofs + ROOF_LINES)
    hides_bottom = there & (bottom > roofs) & (bottom <= roofs + ROOF_LINES)
    first = jnp.where(hides_top.any(), only(hides_top, roofs + ROOF_LINES), top)
    last = jnp.where(hides_bottom.any(), only(hides_bottom, roofs), bottom)
    seen = edges(whole.x, first, whole.x + whole.w, last, whole.valid & (last > first))
    return seen.clip(*VIEW)


def _ladder_boxes(m: Ram) -> Box:
    """Ladders, from the first rung in view to the last one."""
    first = floor_line(m) - LADDER_RISE
    cut = jnp.maximum(LADDER_TOP - first, 0)
    top = first + cut + pick(cut & RUNG_PITCH - 1, TO_RUNG)
    rows = jnp.minimum(BOTTOM - first, LADDER_ROWS)
    bottom = first + rows - pick(rows & RUNG_PITCH - 1, BELOW_RUNG)
    return edges(
        LADDER_LEFT, top, LADDER_LEFT + 4, bottom, (m.rail == Rail.LADDER) & (bottom > top)
    )


def _creature_boxes(m: Ram) -> dict[str, Box]:
    """What lives on the floors, by kind."""
    drawn = as_drawn(m)
    index = PICTURES.index(kind=drawn.kind, picture=drawn.picture)
    whole = PICTURES.box(index, drawn.x, drawn.y, mirrored=drawn.mirrored, valid=drawn.valid)
    boxes = _in_slots(m, whole.clip(*VIEW))
    kind = _in_slots(m, drawn.kind)
    out = {name: boxes.where(among(kind, kinds)) for name, kinds in EVERYWHERE.items()}
    out |= {name: _single(boxes, kind == only_kind) for name, only_kind in SINGLE.items()}
    ridden = (m.balloon == Balloon.RIDDEN) & (m.pose == Pose.FLIES)
    out["Balloon"] = choose(ridden, _ridden_box(m), out["Balloon"])
    return out


def _ridden_box(m: Ram) -> Box:
    """The balloon above Harry, which his sprite shows."""
    top = m.harry_y + BALLOON_TOP
    whole = BALLOON.box(jnp.int32(0), m.harry_x, top, mirrored=m.harry_mirrored == 1)
    return whole.clip(*VIEW)


def _single(boxes: Box, there: jax.Array) -> Box:
    """The one of the boxes that is there."""
    valid = there & boxes.valid
    x, y, w, h = (only(valid, part) for part in (boxes.x, boxes.y, boxes.w, boxes.h))
    return box(x, y, w, h, valid.any())


_Slots = TypeVar("_Slots", Box, jax.Array)


def _in_slots(m: Ram, parts: _Slots) -> _Slots:
    """What is given by floor on the screen, by the floor's number instead."""
    slot = mod(m.floor + SLOT, len(SLOT))
    here = slot[None] == SLOT[:, None]

    def moved(part: jax.Array) -> jax.Array:
        by_slot = jnp.sum(jnp.where(here, part[None].astype(jnp.int32), 0), axis=1)
        return by_slot.astype(part.dtype) if part.ndim else part

    return jax.tree.map(moved, parts)


HAIR = 0x12
FACE = 0x4A
SHIRT = 0xC8
LEGS = 0xD2
RUNG = 0x12
DULL = 0x32  # crosses
CAT = (0x16, 0x1A, 0x14)
WHITE = 0x0E
BAT = 0x04
BLACK = 0x00
BLUE = 0x84  # water
FEATHERS = (0x26, 0x28, 0x2A)
BEAK = 0x14
GOLD = 0x1E
GRAY = 0x0A  # the rat
FROG = (0xD4, 0xD6)
DRESS = 0xD8
GIRL = (DRESS, 0x32, FACE, LEGS, 0xD6, 0xD0, 0x14)
INK = 0x0C  # the score
look = functools.partial(Blobs, region=VIEW)
HARRY = look(
    (SHIRT, LEGS, FACE, HAIR),
    shapes=Shape(w=(2, 8), h=(6, 21)),
    gap=(1, 7),
    filters=(Above(HAIR, FACE),),
)
LADDER = Blobs(
    RUNG,
    (LADDER_LEFT - 4, TOP, LADDER_LEFT + 8, BOTTOM),
    shapes=Shape(w=(1, 4), h=(3, 26)),
    gap=(0, 10),
    filters=(Rungs(4, FACE),),
)
SCORPION = look(WHITE, shapes=Shape(w=(7, 8), h=(4, 11)))
EEL_SHAPE = Shape(w=8, h=(2, 3))
DARK_EEL = look(BLACK, shapes=EEL_SHAPE, filters=(Between(BLUE),))
EEL = look(WHITE, shapes=EEL_SHAPE, also=(DARK_EEL,))
BATS = look(BAT, shapes=Shape(w=(1, 7), h=(1, 9)), gap=(1, 1))
CONDOR = look(
    (*FEATHERS, BEAK, WHITE),
    shapes=Shape(w=(5, 8), h=(4, 8)),
    then=(Completed(7, above=False),),
)
BARS = look(GOLD, shapes=Shape(w=7, h=(1, 14)), gap=(2, 2))
FROGS = Blobs(
    FROG,
    (64, TOP, 96, BOTTOM),
    shapes=Shape(w=(5, 8), h=(3, 9)),
    then=(Completed(5, above=True),),
)


def _at(colors: int | tuple[int, ...], x: int, size: tuple[int, int], **options: Any) -> Bounds:
    """A rule for something that stands in its place."""
    return Bounds(colors, (x, TOP, x + 8, BOTTOM), min_size=size, max_size=(8, 27), **options)


GAME = Game(
    name="Pitfall2",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", HARRY, rgb=(92, 186, 92), doc="Harry"),
        Category("Ladder", LADDER, count=5, doc="one a floor"),
        Category("Cross", _at(DULL, 40, (4, 3)), doc="where Harry begins again"),
        Category("Scorpion", SCORPION, count=5, doc="on a floor"),
        Category("Bat", BATS, count=5, doc="flies up and down"),
        Category("Condor", CONDOR, count=5, doc="flies up and down"),
        Category("Frog", FROGS, count=5, doc="leaps across a ladder"),
        Category("ElectricEel", EEL, doc="swims"),
        Category("GoldBar", BARS, count=5, doc="5,000 points"),
        Category("Rat", Bounds(GRAY, VIEW, min_size=(6, 6)), doc="15,000 points"),
        Category(
            "Rhonda", _at(GIRL, 32, (2, 6), exclude=("Player",)), doc="Harry's niece, 10,000 points"
        ),
        Category(
            "Quickclaw", _at(CAT, 32, (4, 8), then=(Raised(2),)), doc="her cat, 10,000 points"
        ),
        Category("Ring", _at(GOLD, 72, (5, 6), then=(Raised(3),)), doc="20,000 points"),
        Category("Balloon", Bounds((0x42, 0x44, DRESS), VIEW, (5, 8)), doc="takes Harry up"),
        display("PlayerScore", SCORE.rule(INK, base=-START), doc="points"),
    ),
)
