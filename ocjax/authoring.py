"""All names that game files use.

- The declaration: `Game`, `Category`, `display`, `Kinds`, `Rom`, `Shades`, `Saver`, `Variants` with
  `meanings_of_bits` (what modes and difficulties mean), and `Checks` with `LivesAsIcons` and
  `LivesAsNumber`: differences from what the tests of all games expect.
- The terrain: `TerrainMap` with its `TerrainKind`, and `playfield` and `area_mask`, the
  pixels of the console's playfield registers and of an area.
- The RAM: `RamMap` and its fields (`byte`, `bits`, `flag`, `low`, `high`, `signed`, `bcd`).
- Boxes: `box`, `edges`, `choose`, `BoxTable`, and the compass points of orientations.
- Selection and arithmetic in decoders: `match`, `when`, `only`, `pick`, `lookup`, `div`, `mod`, ...
- Several small numbers in one: `Word`.
- The console: positions and copies of sprites (`registers`), colours (`palette`), `WIDTH`.
- Numbers, icons, objects that never move, and pictures: `Digits`, `Font`, `NumberDisplay`,
  `IconRow`, `Icons`, `Static`, `Pictures`, ...
- Rules that find objects in frames: `Bounds`, `Blobs`, `Cells`, `Runs`, with their options.
- Filters before a search and steps after it, and operations on bitmaps (`bitmaps`) for filters and
  steps of a game's own.
"""

from ocjax._xla.kernels import materialize
from ocjax.console import palette, registers
from ocjax.console.boxes import WIDTH, Area, Box, BoxTable, Number, box, choose, edges
from ocjax.console.compass import EAST, NORTH, SOUTH, WEST
from ocjax.console.fonts import DIGITS_3X5, Digits, Font, hex_font, score_box
from ocjax.console.ops import among, div, extremes, lookup, match, mod, only, pick, reached, when
from ocjax.console.palette import NTSC
from ocjax.console.playfield import area_mask, playfield
from ocjax.console.ram import RamMap, bcd, bits, byte, flag, high, low, signed
from ocjax.console.registers import (
    COARSE,
    EDGE_CUTS,
    NUSIZ_COPIES,
    NUSIZ_SPACING,
    NUSIZ_WIDTH,
    copies,
    larger_part,
    mirrored,
    modulo_screen,
    packed_position,
    position,
    signed_nibble,
    spacing,
    wrap,
)
from ocjax.console.rom import Pictures, Rom
from ocjax.console.word import Word
from ocjax.extraction.checks import Checks, LivesAsIcons, LivesAsNumber
from ocjax.extraction.game import Category, Game, display
from ocjax.extraction.kinds import KindEntry, Kinds
from ocjax.extraction.terrain import TerrainKind, TerrainMap
from ocjax.extraction.variants import Variants, meanings_of_bits
from ocjax.vision import bitmap as bitmaps
from ocjax.vision.bitmap import (
    Bitmap,
    U,
    all_within,
    any_of,
    any_within,
    areas,
    color_mask,
    or_rows,
    over,
    shift_down,
    shift_left,
    shift_right,
    shift_up,
    spread,
)
from ocjax.vision.colors import Colors
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.displays import IconRow, Icons, NumberDisplay, Static
from ocjax.vision.filters import LoneRuns, NoLines, Searched, ShortRuns
from ocjax.vision.pictures import picture
from ocjax.vision.rules import Blobs, Bounds, ByColor, Cells, Gauge, Run, Runs
from ocjax.vision.shades import Saver, Shades
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Context, Packed, Raised, SideBySide, Step, Tight
from ocjax.vision.unknown import UNKNOWN_VALUE

__all__ = [
    "COARSE",
    "DIGITS_3X5",
    "EAST",
    "EDGE_CUTS",
    "NORTH",
    "NTSC",
    "NUSIZ_COPIES",
    "NUSIZ_SPACING",
    "NUSIZ_WIDTH",
    "SOUTH",
    "UNKNOWN_VALUE",
    "WEST",
    "WIDTH",
    "Area",
    "Bitmap",
    "Blobs",
    "Bounds",
    "Box",
    "BoxTable",
    "ByColor",
    "Category",
    "Cells",
    "Checks",
    "Colors",
    "Context",
    "Detected",
    "Digits",
    "Font",
    "Game",
    "Gauge",
    "IconRow",
    "Icons",
    "KindEntry",
    "Kinds",
    "LivesAsIcons",
    "LivesAsNumber",
    "LoneRuns",
    "NoLines",
    "Number",
    "NumberDisplay",
    "Packed",
    "Pictures",
    "Raised",
    "RamMap",
    "Rom",
    "Run",
    "Runs",
    "Saver",
    "Searched",
    "Shades",
    "Shape",
    "ShortRuns",
    "SideBySide",
    "Static",
    "Step",
    "TerrainKind",
    "TerrainMap",
    "Tight",
    "U",
    "Variants",
    "Word",
    "all_within",
    "among",
    "any_of",
    "any_within",
    "area_mask",
    "areas",
    "bcd",
    "bitmaps",
    "bits",
    "box",
    "boxes",
    "byte",
    "choose",
    "color_mask",
    "copies",
    "display",
    "div",
    "edges",
    "extremes",
    "flag",
    "hex_font",
    "high",
    "larger_part",
    "lookup",
    "low",
    "match",
    "materialize",
    "meanings_of_bits",
    "mirrored",
    "mod",
    "modulo_screen",
    "only",
    "or_rows",
    "over",
    "packed_position",
    "palette",
    "pick",
    "picture",
    "playfield",
    "position",
    "reached",
    "registers",
    "score_box",
    "shift_down",
    "shift_left",
    "shift_right",
    "shift_up",
    "signed",
    "signed_nibble",
    "spacing",
    "spread",
    "when",
    "wrap",
]
