"""`Declaration`: the declarations in a game file.

The decoder is validated before its first use, everything else on construction.
"""

import functools
import inspect
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console import palette
from ocjax.console.boxes import WIDTH, Box
from ocjax.console.ram import RAM_SIZE, RamMap
from ocjax.console.rom import Rom
from ocjax.extraction.categories import ATTRIBUTES, ROLES, Category, names_by_alias
from ocjax.extraction.checks import EXCERPTS, USUAL, Checks
from ocjax.extraction.names import did_you_mean
from ocjax.extraction.terrain import TerrainKind, TerrainMap
from ocjax.extraction.variants import UNEXPLAINED, Variants
from ocjax.vision.colors import EVEN
from ocjax.vision.rules import Blobs, Rule
from ocjax.vision.shades import Saver, Shades

__all__ = ["Declaration", "Decode", "GameError", "Slices", "check_decode"]

Decode = Callable[[Any], Mapping[str, Box]]


class GameError(ValueError):
    """An invalid declaration in a game file; the message names the game and the field."""


class Slices(Mapping[str, slice]):
    """The slots of each category by its name, in the order of the categories.

    Aliases are also keys, but are not listed.
    """

    def __init__(self, categories: tuple[Category, ...]) -> None:
        ends = np.cumsum([c.count for c in categories]).tolist()
        self._slots = {c.name: slice(e - c.count, e) for c, e in zip(categories, ends, strict=True)}
        self._names = names_by_alias(categories)

    def __getitem__(self, name: str) -> slice:
        return self._slots[self._names.get(name, name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._slots)

    def __len__(self) -> int:
        return len(self._slots)

    def __repr__(self) -> str:
        return repr(self._slots)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Declaration:
    """The ROM, address map, decoder and categories of a game.

    Args:
        name: as in Gymnasium's id `ALE/<name>-v5`.
        rom: the ROM for which the decoder was written. The attribute `rom` is ALE's name of it, and
            `md5` its MD5 checksum.
        ram: the address map.
        decode: function that maps the RAM of one state, wrapped in the address map, to a `Box` for
            every category.
        categories: the categories, display (`hud`) categories last.
        screen: (height, width) in pixels.
        shades: colours that change from level to level.
        saver: the game's screen saver, if it changes the colours.
        backdrop: columns that objects rarely reach, for games whose background may have the
            objects' colours. If all of these columns show one colour in a row, no object owns the
            pixels of this colour in the row (`ocjax.segment`).
        pal: whether the ROM is made for PAL consoles, which have another palette.
        checks: how the game differs from what the tests of all games expect.
        variants: what the game's modes and difficulties mean.
        terrain: walls, ladders, water and scenery, or None. The attribute `terrain` is the tuple of
            its kinds, and `terrain_map` the declaration.
        hud: whether to include the display categories.

    Raises:
        GameError: a ValueError; the declaration is invalid.
    """

    name: str
    rom: str
    md5: str
    ram: type[RamMap]
    decode: Decode
    categories: tuple[Category, ...]
    screen: tuple[int, int]
    shades: Shades | None
    saver: Saver | None
    backdrop: tuple[int, ...]
    pal: bool
    checks: Checks
    variants: Variants
    terrain_map: TerrainMap | None
    hud: bool

    def __init__(
        self,
        name: str,
        rom: Rom,
        ram: type[RamMap],
        decode: Decode,
        categories: tuple[Category, ...],
        *,
        screen: tuple[int, int] = (210, WIDTH),
        shades: Shades | None = None,
        saver: Saver | None = None,
        backdrop: tuple[int, ...] = (),
        pal: bool = False,
        checks: Checks = USUAL,
        variants: Variants = UNEXPLAINED,
        terrain: TerrainMap | None = None,
        hud: bool = True,
    ) -> None:
        if not isinstance(rom, Rom):
            raise GameError(f"{name}: rom: must be a Rom(name, md5), got {rom!r}")
        vars(self).update(
            name=name, rom=rom.name, md5=rom.md5, ram=ram, decode=decode, categories=categories
        )
        vars(self).update(screen=screen, shades=shades, saver=saver, pal=pal, hud=hud)
        vars(self).update(backdrop=backdrop, checks=checks, variants=variants, terrain_map=terrain)
        if hud:
            _validate_fields(self)
        else:
            vars(self).update(categories=tuple(c for c in categories if not c.hud))

    @functools.cached_property
    def slices(self) -> Mapping[str, slice]:
        """The slots of each category, by its name or an alias."""
        return Slices(self.categories)

    @functools.cached_property
    def slot_category(self) -> np.ndarray:
        """Index into `categories` of each slot, int `[N]`."""
        return np.repeat(np.arange(len(self.categories)), [c.count for c in self.categories])

    @functools.cached_property
    def slot_hud(self) -> np.ndarray:
        """True for slots of the display, bool `[N]`."""
        return np.array([c.hud for c in self.categories], bool)[self.slot_category]

    @property
    def terrain(self) -> tuple[TerrainKind, ...] | None:
        """The kinds of terrain, or None."""
        return None if self.terrain_map is None else tuple(self.terrain_map.kinds)

    @property
    def palette(self) -> np.ndarray:
        """RGB of each palette index on the game's screen, uint8 `[256, 3]`."""
        return palette.PAL if self.pal else palette.NTSC

    @functools.cached_property
    def colors(self) -> tuple[int, ...]:
        """The palette indices of all rules, in ascending order."""
        rules = [
            rule for c in self.categories for rule in (c.rule, c.otherwise) if rule is not None
        ]
        return tuple(sorted({color for rule in rules for color in rule.palette}))

    @functools.cached_property
    def pixel_colors(self) -> tuple[int, ...]:
        """The palette indices of all rules and of all objects' pixels, in ascending order."""
        own = (color for c in self.categories for colors in c.slot_colors() for color in colors)
        return tuple(sorted({*self.colors, *own}))

    @functools.cached_property
    def slot_rgb(self) -> np.ndarray:
        """The default colour of each slot, uint8 `[N, 3]`."""
        return np.concatenate([c.slot_rgb(self.palette) for c in self.categories])

    @property
    def num_slots(self) -> int:
        """N, the number of slots."""
        return sum(c.count for c in self.categories)

    @functools.cached_property
    def _parts(self) -> "dict[str, _Part]":
        return {}

    def spans(self, key: Callable[[Category], Any]) -> list[tuple[slice, Any]]:
        """The slots of adjacent categories with equal keys, and these keys."""
        groups = [(value, list(group)) for value, group in itertools.groupby(self.categories, key)]
        ends = np.cumsum([0, *(sum(c.count for c in group) for _, group in groups)]).tolist()
        spans = itertools.starmap(slice, itertools.pairwise(ends))
        return list(zip(spans, (value for value, _ in groups), strict=True))

    def part(self, name: str) -> "Declaration":
        """Return the declaration of one category: its slots alone, in the same game.

        The same category gives the same object, so that objects of `Objects.of` are one pytree.
        """
        if len(self.categories) == 1:
            return self
        category = self.categories[self.slot_category[self.slices[name].start]]
        return self._parts.setdefault(category.name, _Part(self, category))

    def suggestion(self, name: str) -> str:
        """The names of the categories, with the most similar one, for an error about `name`."""
        return ", ".join(self.slices) + did_you_mean(name, self.slices)

    def replaced(self, **changes: Any) -> Self:
        """Return the same game with other arguments."""
        same = {
            field.name: getattr(self, field.name)
            for field in fields(self)
            if field.name not in ("rom", "md5", "terrain_map")
        }
        rom = Rom(self.rom, self.md5)
        return type(self)(**{**same, "rom": rom, "terrain": self.terrain_map, **changes})

    def without_hud(self) -> Self:
        """Return the game without its display categories; its slots are a prefix of this game's."""
        return self.replaced(hud=False)


class _Part(Declaration):
    def __init__(self, game: Declaration, category: Category) -> None:
        same = {field.name: getattr(game, field.name) for field in fields(game)}
        vars(self).update(same, categories=(category,), _game=game)

    def __reduce__(self) -> Any:
        return Declaration.part, (vars(self)["_game"], self.categories[0].name)


# --------------------------------------------------------------------------------------------------
# validation


def _need(condition: bool, game: Declaration, where: str, text: str) -> None:
    if not condition:
        source = inspect.getsourcefile(game.decode) if callable(game.decode) else None
        raise GameError(f"{game.name} ({source}): {where}: {text}")


def _validate_fields(game: Declaration) -> None:
    need = functools.partial(_need, game=game)
    need(
        isinstance(game.name, str) and game.name.isidentifier(),
        where="name",
        text=f"must be an identifier, got {game.name!r}",
    )
    is_md5 = len(game.md5) == 32 and set(game.md5) <= set("0123456789abcdef")
    need(is_md5, where="md5", text=f"must be 32 hex digits, got {game.md5!r}")
    is_map = isinstance(game.ram, type) and issubclass(game.ram, RamMap)
    need(is_map, where="ram", text=f"must be a subclass of RamMap, got {game.ram!r}")
    is_screen = len(game.screen) == 2 and game.screen[1] == WIDTH and 0 < game.screen[0] < 256
    need(
        is_screen,
        where="screen",
        text=f"must be (height, {WIDTH}) with a height below 256, got {game.screen}",
    )
    need(
        isinstance(game.backdrop, tuple) and set(game.backdrop) <= set(range(WIDTH)),
        where="backdrop",
        text=f"must be a tuple of columns, got {game.backdrop!r}",
    )
    need(len(game.categories) > 0, where="categories", text="at least one is needed")
    names = [name for c in game.categories for name in (c.name, *c.aliases)]
    huds = [c.hud for c in game.categories]
    need(len(set(names)) == len(names), where="categories", text=f"names repeat: {names}")
    order = f"display (hud) categories come last, got {[(c.name, c.hud) for c in game.categories]}"
    need(huds == sorted(huds), where="categories", text=order)
    need(not game.variants.problem(), where="variants", text=game.variants.problem())
    if game.terrain_map is not None:
        problem = game.terrain_map.problem(game.screen[0], {c.name for c in game.categories})
        need(not problem, where="terrain", text=problem)
    _validate_checks(game)
    for category in game.categories:
        _validate_category(game, category)


def _validate_checks(game: Declaration) -> None:
    unknown = game.checks.names - {c.name for c in game.categories}
    _need(not unknown, game, "checks", f"no categories are named {sorted(unknown)}")
    keys = sorted(game.checks.agreement)
    _need(
        set(keys) <= set(EXCERPTS), game, "checks", f"agreement must be of {EXCERPTS}, got {keys}"
    )


def _validate_category(game: Declaration, c: Category) -> None:
    need = functools.partial(_need, game=game, where=f"category {c.name}")
    need(
        all(name.isidentifier() for name in (c.name, *c.aliases)),
        text=f"its names must be identifiers, got {(c.name, *c.aliases)}",
    )
    need(c.role in ("", *ROLES), text=f"role must be of {ROLES}, got {c.role!r}")
    need(
        set(c.attributes) <= set(ATTRIBUTES),
        text=f"attributes must be of {ATTRIBUTES}, got {c.attributes}",
    )
    need(
        not c.reads_value or "value" in c.attributes,
        text="VEM reads its value, but it has no attribute 'value'",
    )
    need(isinstance(c.needs, tuple), text=f"needs must be a tuple of names, got {c.needs!r}")
    # A game without its display lacks the display's categories.
    may_need = {o.name for o in game.categories if c.hud or not o.hud}
    for name in c.needs:
        need(
            name in may_need,
            text=f"needs: {name!r} is not a category" + ("" if c.hud else " outside the display"),
        )
    for rule in (c.rule, c.otherwise):
        if rule is not None:
            _validate_rule(game, c, rule)
    try:
        c.slot_rgb()
    except ValueError as error:
        need(False, text=f"rgb must be (r, g, b) or one per slot: {error}")


def _validate_rule(game: Declaration, c: Category, rule: Rule) -> None:
    need = functools.partial(_need, game=game, where=f"category {c.name}")
    need(
        isinstance(rule, Rule), text=f"rule must be one of Bounds, Blobs, Cells, Runs, got {rule!r}"
    )
    need(
        rule.slot_count in (None, c.count),
        text=f"its rule has {rule.slot_count} slots, its count is {c.count}",
    )
    need(
        rule.bottom <= game.screen[0],
        text=f"its rule reaches down to row {rule.bottom}, the screen has {game.screen[0]} rows",
    )
    stand_ins = game.shades.levels[0] if game.shades is not None else ()
    odd = sorted({color for color in rule.palette if color & ~EVEN} - set(stand_ins))
    need(
        not odd,
        text=f"colors must be even, because an odd index shows the even one below it, got {odd}",
    )
    firsts = isinstance(rule, Blobs) and rule.first_colors
    need(
        not firsts or c.color_row == 0,
        text="its rule asks for the first pixel's colour, so color_row must be 0",
    )
    try:
        rule.check({other.name: other.rule for other in game.categories})
    except ValueError as error:
        need(False, text=str(error))


def check_decode(game: Declaration) -> None:
    """Check that the decoder returns a box of the declared shape for every category."""
    boxes = _trace(game)
    names = [c.name for c in game.categories]
    is_whole = set(boxes) == set(names) or (not game.hud and set(names) <= set(boxes))
    _need(
        is_whole,
        game,
        "decode",
        f"must give a box for each of {sorted(names)}, gives {sorted(boxes)}",
    )
    for c in game.categories:
        _check_box(game, c, boxes[c.name])


def _trace(game: Declaration) -> dict[str, Any]:
    try:
        with (
            jax.enable_x64(False),
            jax.numpy_dtype_promotion("strict"),
            jax.numpy_rank_promotion("raise"),
        ):
            return jax.eval_shape(
                lambda ram: dict(game.decode(game.ram(ram))),
                jax.ShapeDtypeStruct((RAM_SIZE,), jnp.uint8),
            )
    except Exception as error:
        raise GameError(
            f"{game.name} ({inspect.getsourcefile(game.decode)}): decode: "
            f"{type(error).__name__}: {error}"
        ) from error


def _check_box(game: Declaration, c: Category, found: Any) -> None:
    _need(
        isinstance(found, Box),
        game,
        f"decode, {c.name}",
        f"must be a box(...), got {type(found).__name__}",
    )
    for f in fields(Box):
        leaf = getattr(found, f.name)
        if leaf is None:
            continue
        dtype = jnp.bool_ if f.name == "valid" else jnp.int32
        where = f"decode, {c.name}.{f.name}"
        _need(
            leaf.shape in ((), (c.count,)),
            game,
            where,
            f"must have shape () or {(c.count,)}, has {leaf.shape}",
        )
        _need(leaf.dtype == dtype, game, where, f"must be {jnp.dtype(dtype)}, is {leaf.dtype}")
