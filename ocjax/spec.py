"""What a game declares: boxes, categories, vision rules, and the game itself. Everything is validated when it is declared."""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.objects import Objects
from ocjax.ram import RAM_SIZE, RamMap
from ocjax.vision import palette

WIDTH = 160
ATTRIBUTES = ("orientation", "value")

Region = tuple[int, int, int, int]  # left, top, right, bottom in pixels; right and bottom exclusive
Number = jax.Array | np.ndarray | int | bool


class GameError(ValueError):
    """A game file declares something that cannot be; the message names the game and the field."""


# ---------------------------------------------------------------------------------------------------------------- boxes


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Box:
    """The objects of one category in one state, each field a scalar or `[count]`; made by `box`."""

    x: jax.Array
    y: jax.Array
    w: jax.Array
    h: jax.Array
    valid: jax.Array
    value: jax.Array
    orientation: jax.Array
    rgb: jax.Array | None  # uint8 [..., 3]; None: the category's

    def clip(self, left: Number, top: Number, right: Number, bottom: Number) -> Box:
        """The part within an area, `right` and `bottom` exclusive; a box outside it is not valid."""
        x0, y0 = jnp.maximum(self.x, left), jnp.maximum(self.y, top)
        w = jnp.minimum(self.x + self.w, right) - x0
        h = jnp.minimum(self.y + self.h, bottom) - y0
        return replace(self, x=x0, y=y0, w=w, h=h, valid=self.valid & (w > 0) & (h > 0))

    def where(self, condition: Number) -> Box:
        """The same boxes, valid only where the condition holds too."""
        return replace(self, valid=self.valid & condition)


def box(
    x: Number,
    y: Number,
    w: Number,
    h: Number,
    valid: Number = True,
    value: Number = 0,
    orientation: Number = 0,
    rgb: jax.Array | None = None,
) -> Box:
    """Boxes by left, top, width, height in pixels of the ALE screen: scalars, or vectors with one entry a slot of the category.

    Parts outside the screen are cut off and boxes that are empty then are not valid; nothing needs to be zeroed where
    `valid` is false. `rgb` (uint8 `[3]` or `[count, 3]`) is for colours that change; the category's is used without it.
    """
    x, y, w, h, value, orientation = (jnp.asarray(v, jnp.int32) for v in (x, y, w, h, value, orientation))
    return Box(x, y, w, h, jnp.asarray(valid, jnp.bool_), value, orientation, rgb)


# --------------------------------------------------------------------------------------------------------- vision rules
#
# Colours are ALE palette indices (0-255), one or several. Where a rule has several regions, colours may be given per region.

Colors = int | tuple[int, ...]


def _color_set(colors: Colors) -> tuple[int, ...]:
    out = (colors,) if isinstance(colors, int) else colors
    if not out or not all(isinstance(c, int) and 0 <= c < 256 for c in out):
        raise ValueError(f"colors must be palette indices 0-255, one or several, got {colors!r}")
    return out


def _check_region(region: Region) -> Region:
    left, top, right, bottom = region
    if not (0 <= left < right <= WIDTH and 0 <= top < bottom):
        raise ValueError(f"a region is (left, top, right, bottom) with 0 <= left < right <= {WIDTH} and 0 <= top < bottom, got {region}")
    return region


@dataclass(frozen=True)
class Digits:
    """How VEM reads a number: digits in cells at fixed places, each compared with ten pictures.

    A cell that is empty counts as 0 (leading zeros are often not shown), and so does one that holds none of the pictures.

    Args:
        lefts: left column of each digit's cell, the most significant first.
        top: first row of the cells.
        dots: (width, height) of the pictures in dots.
        size: (width, height) of a dot in pixels. A dot is set where its first column has a pixel in any of its rows.
        glyphs: ten pictures, 0 to 9, rows from the top, each row a hexadecimal number whose lowest bit is the rightmost dot.
        weights: what a 1 in each cell is worth; powers of ten without it.
        base: value of nothing but zeros.
        required: the object is valid only where the last cell holds one of the pictures: tells it from others at the same place.
    """

    lefts: tuple[int, ...]
    top: int
    dots: tuple[int, int]
    size: tuple[int, int]
    glyphs: tuple[str, ...]
    weights: tuple[int, ...] | None = None
    base: int = 0
    required: bool = False

    def __post_init__(self) -> None:
        if len(self.glyphs) != 10 or any(len(g) != self.dots[1] * -(-self.dots[0] // 4) for g in self.glyphs):
            raise ValueError(f"glyphs must be ten pictures of {self.dots[1]} rows of {-(-self.dots[0] // 4)} hexadecimal digits")
        if self.weights is not None and len(self.weights) != len(self.lefts):
            raise ValueError(f"weights for {len(self.weights)} digits, but {len(self.lefts)} digits")
        if not (0 < self.dots[0] * self.size[0] <= 32 and min(self.lefts) >= 0 and max(self.lefts) + self.dots[0] * self.size[0] <= WIDTH):
            raise ValueError("every cell must lie on the screen and be at most 32 pixels wide")

    @property
    def worth(self) -> tuple[int, ...]:
        """What a 1 in each cell is worth."""
        return self.weights or tuple(10**i for i in reversed(range(len(self.lefts))))

    @property
    def table(self) -> np.ndarray:
        """The pictures, int `[10, rows]`."""
        n = -(-self.dots[0] // 4)
        return np.array([[int(g[i : i + n], 16) for i in range(0, len(g), n)] for g in self.glyphs])


@dataclass(frozen=True)
class Gauge:
    """How VEM reads a length: `base + (width - start) // unit`, of a bar or a row of icons.

    Args:
        unit: pixels for each 1.
        start: width, in pixels, that stands for `base`.
        base: value at that width.
        vertical: the height is read, not the width.
    """

    unit: int
    start: int = 0
    base: int = 0
    vertical: bool = False

    def __post_init__(self) -> None:
        if self.unit < 1:
            raise ValueError(f"a gauge's unit must be at least 1 pixel, got {self.unit}")


@dataclass(frozen=True)
class Bounds:
    """One object a region: the tight box of all pixels of the colours there. Slot i is region i, so regions name the slots.

    Args:
        colors: for all regions, or a tuple of one entry a region.
        regions: a region, or several.
        min_size: least (width, height) of an object; smaller boxes are not valid.
        inverse: the colours are the background's; all others count.
        scenery: areas of the screen whose pixels do not count.
        besides: categories of `Blobs` or whole `Cells`; the pixels in their objects' boxes do not count.
        value: how the value is read off: a `Gauge`, or `Digits` (one for each region where there are several). Without it, it is 0.
    """

    colors: Colors | tuple[Colors, ...]
    regions: Region | tuple[Region, ...]
    min_size: tuple[int, int] = (1, 1)
    value: Gauge | Digits | tuple[Digits, ...] | None = None
    inverse: bool = False
    scenery: tuple[Region, ...] = ()
    besides: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for region in (*(region for region, _ in self.parts), *self.scenery):
            _check_region(region)
        if isinstance(self.value, Digits | tuple) and len(self.digits) != len(self.parts):
            raise ValueError(f"digits for {len(self.digits)} regions, but {len(self.parts)} regions")

    @property
    def digits(self) -> tuple[Digits, ...]:
        """The digits of each region, if any."""
        return self.value if isinstance(self.value, tuple) else (self.value,) if isinstance(self.value, Digits) else ()

    @property
    def parts(self) -> tuple[tuple[Region, tuple[int, ...]], ...]:
        """Region and colours of each slot."""
        regions: Any = self.regions if isinstance(self.regions[0], tuple) else (self.regions,)
        several = isinstance(self.colors, tuple) and any(isinstance(c, tuple) for c in self.colors)
        colors: Any = self.colors if several else (self.colors,) * len(regions)
        if len(colors) != len(regions):
            raise ValueError(f"colors for {len(colors)} regions, but {len(regions)} regions")
        return tuple((r, _color_set(c)) for r, c in zip(regions, colors, strict=True))

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return tuple(sorted({c for _, colors in self.parts for c in colors}))


@dataclass(frozen=True)
class Blobs:
    """Connected components of the pixels of the colours, in raster order of their first pixel.

    Args:
        colors: palette indices; pixels of different colours of the rule connect.
        region: where to look; pixels outside do not count.
        connectivity: 8 (corners touch) or 4.
        join: parts at most (dx, dy) blank pixels apart are one object; needs connectivity 8.
        min_size, max_size: (width, height) limits; components outside them are not objects.
        split: (width, height) of one object, for objects that touch: a larger component is as many of them as cover it (4 at most),
            evenly spaced from edge to edge. `max_size` is that of the whole component.
        pixels: least and most pixels of a component, those between its parts that `join` bridges from the left and from above
            included: tells pictures of the same size apart. Needs `max_size`.
        first: colours that an object's first pixel (in raster order) has; where given, components that begin in another one are not
            objects: tells those apart that share some of their colours.
        apart: components of different colours are different objects even where they touch; of each colour half of the slots at most.
        thin: where it is not 0, pixels of vertical runs longer than this do not count: finds low objects in the colour of walls.
        scenery: areas of the screen whose pixels do not count.
        besides: categories of whole `Cells`; the pixels of their objects do not count.
    """

    colors: Colors
    region: Region | None = None
    connectivity: int = 8
    join: tuple[int, int] = (0, 0)
    min_size: tuple[int, int] = (1, 1)
    max_size: tuple[int, int] | None = None
    split: tuple[int, int] | None = None
    pixels: tuple[int, int] | None = None
    first: Colors | None = None
    apart: bool = False
    thin: int = 0
    scenery: tuple[Region, ...] = ()
    besides: tuple[str, ...] = ()

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return _color_set(self.colors)

    def __post_init__(self) -> None:
        _color_set(self.colors)
        for region in (*self.scenery, *((self.region,) if self.region else ())):
            _check_region(region)
        if self.connectivity not in (4, 8):
            raise ValueError(f"connectivity must be 4 or 8, got {self.connectivity}")
        if self.join != (0, 0) and self.connectivity == 4:
            raise ValueError("join needs connectivity 8")
        if self.pixels is not None and self.max_size is None:
            raise ValueError("pixels needs max_size")
        if self.first is not None and not set(_color_set(self.first)) <= set(self.palette):
            raise ValueError(f"first must be of the colors {self.palette}, got {self.first}")
        if self.thin < 0:
            raise ValueError(f"thin must be a number of pixels, got {self.thin}")
        if self.split is not None and min(self.split) < 1:
            raise ValueError(f"split must be (width, height) of at least 1 pixel, got {self.split}")
        if not all(0 <= j < 32 for j in self.join):
            raise ValueError(f"join must be (dx, dy) of 0 to 31 pixels, got {self.join}")


@dataclass(frozen=True)
class Cells:
    """Objects on a fixed grid, one slot a cell: present where all (or any) of the cell's pixels have the colours.

    Args:
        colors: palette indices.
        x, y: left and top of each cell, one entry a slot.
        w, h: size of every cell.
        whole: all pixels of the cell must be set; otherwise any pixel, and the box is the tight box of those set in the cell.
        margin: this many (columns, rows) beside, and above and below, the cell must be free of the colours (tells a pellet from a wall).
    """

    colors: Colors
    x: tuple[int, ...]
    y: tuple[int, ...]
    w: int
    h: int
    whole: bool = True
    margin: tuple[int, int] = (0, 0)

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return _color_set(self.colors)

    def __post_init__(self) -> None:
        _color_set(self.colors)
        if len(self.x) != len(self.y) or not self.x:
            raise ValueError(f"x and y need one entry a slot each, got {len(self.x)} and {len(self.y)}")
        if not (min(self.x) >= 0 and max(self.x) + self.w <= WIDTH and min(self.y) >= 0 and self.w > 0 and self.h > 0):
            raise ValueError("every cell must lie on the screen")


Rule = Bounds | Blobs | Cells

# Digits of 3 x 5 dots as several games draw them: 0 to 9, a hexadecimal digit a row.
DIGITS_3X5 = ("75557", "22222", "71747", "71317", "55711", "74717", "44757", "71111", "75757", "75711")


# ------------------------------------------------------------------------------------------------------ category and game


@dataclass(frozen=True)
class Category:
    """A kind of object.

    Args:
        name: as OCAtari's users know it.
        rule: how VEM finds it.
        count: number of slots.
        hud: part of the display rather than of the game.
        attributes: which of "value" and "orientation" are meaningful.
        rgb: colour, (r, g, b) or one entry a slot; the rule's first colour without it.
        doc: one line for people.
        blinks: drawn only part of the time, and for longer than the one frame of the usual flicker. REM has it all the time.
    """

    name: str
    rule: Rule
    count: int = 1
    hud: bool = False
    attributes: tuple[str, ...] = ()
    rgb: tuple[Any, ...] | None = None
    doc: str = ""
    blinks: bool = False

    @property
    def mixed(self) -> bool:
        """Whether an object's colour is to be read from the frame."""
        several = [len(colors) for _, colors in self.rule.parts] if isinstance(self.rule, Bounds) else [len(self.rule.palette)]
        inverse = isinstance(self.rule, Bounds) and self.rule.inverse
        return self.rgb is None and (inverse or max(several) > 1)

    def slot_rgb(self) -> np.ndarray:
        """The colour of each slot, uint8 `[count, 3]`; where it is read from the frame, the first of the rule's."""
        if self.rgb is not None:
            colors = np.asarray(self.rgb)
        elif isinstance(self.rule, Bounds):
            colors = palette.NTSC[np.array([c[0] for _, c in self.rule.parts])]
        else:
            colors = palette.NTSC[self.rule.palette[0]]
        return np.broadcast_to(colors, (self.count, 3)).astype(np.uint8)


Decode = Callable[[Any], Mapping[str, Box]]


@dataclass(frozen=True, eq=False)
class Game:
    """A game: its ROM, its address map, its decoder and its categories. Get one from `ocjax.load`.

    Args:
        name: as in gymnasium's "ALE/<name>-v5".
        rom: ALE's name of the ROM.
        md5: of the ROM that the decoder was written for.
        ram: the address map.
        decode: from the address map of one state to a `Box` for every category.
        categories: display (`hud`) categories last.
        screen: (height, width) in pixels.
    """

    name: str
    rom: str
    md5: str
    ram: type[RamMap]
    decode: Decode
    categories: tuple[Category, ...]
    screen: tuple[int, int] = (210, WIDTH)
    hud: bool = field(default=True, kw_only=True)

    def __post_init__(self) -> None:
        if self.hud:
            _validate(self)
        else:
            object.__setattr__(self, "categories", tuple(c for c in self.categories if not c.hud))

    @functools.cached_property
    def slices(self) -> Mapping[str, slice]:
        """The slots of each category."""
        ends = np.cumsum([c.count for c in self.categories]).tolist()
        return types.MappingProxyType({c.name: slice(e - c.count, e) for c, e in zip(self.categories, ends, strict=True)})

    @functools.cached_property
    def slot_category(self) -> np.ndarray:
        """Index into `categories` of each slot, int `[N]`."""
        return np.repeat(np.arange(len(self.categories)), [c.count for c in self.categories])

    @functools.cached_property
    def slot_hud(self) -> np.ndarray:
        """Whether each slot belongs to the display, bool `[N]`."""
        return np.repeat(np.array([c.hud for c in self.categories], dtype=bool), [c.count for c in self.categories])

    @property
    def num_slots(self) -> int:
        """N, the number of slots."""
        return sum(c.count for c in self.categories)

    def without_hud(self) -> Game:
        """The same game without its display categories: its slots are a prefix of this game's."""
        return replace(self, hud=False)

    @functools.cached_property
    def _rem(self) -> Callable[[Any], Objects]:
        from ocjax import extract  # the rule book does not depend on the machinery

        return extract.rem(self)

    @functools.cached_property
    def _vem(self) -> Callable[[Any], Objects]:
        from ocjax import extract

        return extract.vem(self)

    def rem(self, ram: jax.Array | np.ndarray) -> Objects:
        """Objects from RAM, a pure function that works under `jit`, `vmap` and `scan`.

        Args:
            ram: uint8 `[..., 128]`, any batch shape.

        Raises:
            TypeError: `ram` is not uint8.
            ValueError: its last dimension is not 128.
        """
        return self._rem(ram)

    def vem(self, frames: jax.Array | np.ndarray) -> Objects:
        """Objects from pixels, a pure function that works under `jit`, `vmap` and `scan`.

        Args:
            frames: uint8 `[..., H, 160]` of ALE palette indices (`ale.getScreen()`), or uint8 `[..., H, 160, 3]` of RGB whose every
                colour is one of the palette (check with `ocjax.vision.palette.check_rgb`): not max-pooled, not resized, not JPEG.

        Raises:
            TypeError: `frames` is not uint8.
            ValueError: its shape is not that of the game's screen.
        """
        return self._vem(frames)

    def __reduce__(self) -> tuple[Any, ...]:
        from ocjax import registry

        return functools.partial(registry.load, hud=self.hud), (self.name,)

    def __repr__(self) -> str:
        return f"Game({self.name}, {self.num_slots} slots: {', '.join(f'{c.name} {c.count}' for c in self.categories)})"


def _validate(game: Game) -> None:
    where = inspect.getsourcefile(game.decode) if callable(game.decode) else None

    def need(condition: bool, name: str, text: str) -> None:
        if not condition:
            raise GameError(f"{game.name} ({where}): {name}: {text}")

    need(isinstance(game.name, str) and game.name.isidentifier(), "name", f"must be an identifier, got {game.name!r}")
    need(isinstance(game.rom, str) and game.rom.isidentifier(), "rom", f"must be ALE's name of the ROM, got {game.rom!r}")
    need(len(game.md5) == 32 and set(game.md5) <= set("0123456789abcdef"), "md5", f"must be 32 hex digits, got {game.md5!r}")
    need(isinstance(game.ram, type) and issubclass(game.ram, RamMap), "ram", f"must be a subclass of RamMap, got {game.ram!r}")
    sized = len(game.screen) == 2 and game.screen[1] == WIDTH and 0 < game.screen[0] <= 256
    need(sized, "screen", f"must be (height, {WIDTH}), got {game.screen}")
    need(len(game.categories) > 0, "categories", "at least one is needed")
    names = [c.name for c in game.categories]
    need(len(set(names)) == len(names), "categories", f"names repeat: {names}")
    huds = [c.hud for c in game.categories]
    need(huds == sorted(huds), "categories", f"display (hud) categories come last, got {[(c.name, c.hud) for c in game.categories]}")
    for c in game.categories:
        at = f"category {c.name}"
        need(c.name.isidentifier(), at, "its name must be an identifier")
        need(isinstance(c.count, int) and c.count > 0, at, f"count must be a positive int, got {c.count!r}")
        need(set(c.attributes) <= set(ATTRIBUTES), at, f"attributes must be of {ATTRIBUTES}, got {c.attributes}")
        need(isinstance(c.rule, Rule), at, f"rule must be one of Bounds, Blobs, Cells, got {c.rule!r}")
        if isinstance(c.rule, Bounds):
            slots, bottom = len(c.rule.parts), max(region[3] for region, _ in c.rule.parts)
        elif isinstance(c.rule, Cells):
            slots, bottom = len(c.rule.x), max(c.rule.y) + c.rule.h
        else:
            slots, bottom = c.count, c.rule.region[3] if c.rule.region else 0
        for name in c.rule.besides if isinstance(c.rule, Bounds | Blobs) else ():
            other = next((o.rule for o in game.categories if o.name == name), None)
            known = (isinstance(other, Cells) and other.whole) or (isinstance(other, Blobs) and isinstance(c.rule, Bounds))
            need(known, at, f"besides: {name!r} is no category of {'whole Cells' if isinstance(c.rule, Blobs) else 'Blobs or whole Cells'}")
        reads = isinstance(c.rule, Bounds) and c.rule.value is not None
        need(not reads or "value" in c.attributes, at, "its rule reads a value, but it has no attribute 'value'")
        if isinstance(c.rule, Bounds):
            bottom = max(bottom, *(d.top + d.dots[1] * d.size[1] for d in c.rule.digits), 0)
        need(slots == c.count, at, f"its rule has {slots} slots, its count is {c.count}")
        need(bottom <= game.screen[0], at, f"its rule reaches down to row {bottom}, the screen has {game.screen[0]}")
        try:
            c.slot_rgb()
        except ValueError as error:
            need(False, at, f"rgb must be (r, g, b) or one a slot: {error}")
    try:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            boxes = jax.eval_shape(lambda ram: dict(game.decode(game.ram(ram))), jax.ShapeDtypeStruct((RAM_SIZE,), jnp.uint8))
    except Exception as error:
        raise GameError(f"{game.name} ({where}): decode: {type(error).__name__}: {error}") from error
    need(set(boxes) == set(names), "decode", f"must give a box for each of {sorted(names)}, gives {sorted(boxes)}")
    for c in game.categories:
        need(isinstance(boxes[c.name], Box), f"decode, {c.name}", f"must be a box(...), got {type(boxes[c.name]).__name__}")
        for f in fields(Box):
            leaf = getattr(boxes[c.name], f.name)
            if leaf is None:
                continue
            tail, want = ((3,), jnp.uint8) if f.name == "rgb" else ((), jnp.bool_ if f.name == "valid" else jnp.int32)
            at = f"decode, {c.name}.{f.name}"
            need(leaf.shape in (tail, (c.count, *tail)), at, f"must have shape {tail} or {(c.count, *tail)}, has {leaf.shape}")
            need(leaf.dtype == want, at, f"must be {jnp.dtype(want)}, is {leaf.dtype}")
