"""Frames at the limits of vision rules: objects that a rule just allows, and objects that it just
rejects.

Play rarely reaches the limits: a picture has fewer pixels than its shape allows, nothing crosses
the edge of a region, or a number does not fill its cells. The frames are kept as text, so they stay
the same when a rule changes. A line is a frame:

    7 | 0 142,144 | 142,50,60,16,7,88 142,80,60,16,7,87

The line gives the number of a played frame, the colours to replace by the background's, and the
components to draw: colour, left, top, width, height, and number of pixels.
"""

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ocjax import recordings
from ocjax.console.boxes import WIDTH, Area
from ocjax.console.fonts import Digits, Font
from ocjax.extraction.game import Game
from ocjax.extractors.krull.lines import Lines
from ocjax.vision import bitmap as bm
from ocjax.vision.filters import Filter, LoneRuns, ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Cells, Rule, Run, Runs
from ocjax.vision.shapes import Shape, limits
from tests.support.record.deciding import in_batches

BEYOND = 2  # an object crosses an edge by this number of pixels
LARGE = 48  # the tests skip limits above this side
TOGETHER = 12  # objects on a frame at most
REGIONS = 12  # largest number of a rule's regions with separate frames
AREAS = 60  # largest number of ignored areas, which share frames
NO_GAP = (0, 0)


class Component(NamedTuple):
    """A component to draw."""

    color: int
    left: int
    top: int
    width: int
    height: int
    pixels: int

    def draw(self, frame: np.ndarray) -> None:
        """Set its pixels on the frame."""
        rows, columns = np.nonzero(_mask(self.width, self.height, self.pixels))
        rows, columns = rows + self.top, columns + self.left
        inside = (rows >= 0) & (rows < frame.shape[0]) & (columns >= 0) & (columns < frame.shape[1])
        frame[rows[inside], columns[inside]] = self.color

    def __str__(self) -> str:
        return ",".join(map(str, self))


def _mask(width: int, height: int, pixels: int) -> np.ndarray:
    """A connected component of some pixels, bool `[height, width]`: a diagonal, or its upper row
    and left column, filled from above."""
    out = np.zeros((height, width), bool)
    if pixels < width + height - 1:
        long = max(width, height)
        out[np.arange(long) * height // long, np.arange(long) * width // long] = True
        return out
    out[0], out[:, 0] = True, True
    rest = np.flatnonzero(~out)
    out.flat[rest[: pixels - (width + height - 1)]] = True
    return out


def read(game: Game, data: Path) -> np.ndarray:
    """The frames of a game's text, uint8 `[n, H, 160]`; empty without a text.

    Args:
        game: the game.
        data: the folder `tests/data`.
    """
    path = data / "limits" / f"{game.name}.txt"
    return frames(path.read_text(encoding="utf-8") if path.exists() else "", _recorded(game, data))


def _recorded(game: Game, data: Path) -> np.ndarray:
    screens = recordings.read(data / f"{game.name}.npz", game.name).screens
    if screens is None:
        raise recordings.RecordingError(f"the recording of {game.name} has no frames")
    return screens


def frames(text: str, played: np.ndarray) -> np.ndarray:
    """The frames of a text.

    Args:
        text: as `describe` returns it.
        played: uint8 `[n, H, 160]`, the frames of the game's recording.

    Returns:
        uint8 `[lines, H, 160]`.
    """
    out = []
    for line in text.splitlines():
        number, colors, drawn = line.split(" | ")
        background, cleared = colors.split(" ")
        frame = played[int(number)].copy()
        frame[np.isin(frame, [int(c) for c in cleared.split(",")])] = int(background)
        for component in drawn.split(" "):
            Component(*map(int, component.split(","))).draw(frame)
        out.append(frame)
    return np.array(out, np.uint8).reshape(-1, *played.shape[1:])


def describe(game: Game, data: Path) -> str:
    """The text of a game's frames.

    Args:
        game: the game.
        data: the folder `tests/data`.
    """
    played = _recorded(game, data)
    valid = np.asarray(in_batches(game.vem, played).valid)
    lines: dict[str, None] = {}
    for c in game.categories:
        shown = [
            np.atleast_1d(valid[:, game.slices[name]].any(axis=1)) for name in (c.name, *c.needs)
        ]
        for rule, colors in (
            (c.rule, ()),
            (c.otherwise, c.rule.palette),
        ):  # the second one counts where the first one finds nothing
            for part in (
                rule.rules if isinstance(rule, Blobs) else (rule,) if rule is not None else ()
            ):
                number = _first(shown, _where_it_holds(part, played))
                for palette, drawn in _drawn(game, part, c.count, apart=rule is c.otherwise):
                    cleared = tuple(dict.fromkeys((*palette, *colors)))
                    background = _background(played[number], cleared)
                    lines[
                        f"{number} | {background} {','.join(map(str, cleared))} | "
                        f"{' '.join(map(str, drawn))}"
                    ] = None
    return "".join(f"{line}\n" for line in lines)


def _where_it_holds(rule: Rule, played: np.ndarray) -> np.ndarray:
    """The frames on which a rule holds, bool `[frames]`."""
    if isinstance(rule, Blobs) and rule.frames is not None:
        return np.asarray(rule.frames(bm.planes(jnp.asarray(played))))
    return np.ones(len(played), bool)


def _first(shown: Sequence[np.ndarray], holds: np.ndarray) -> int:
    """The first frame on which a rule holds that shows the category or, if none does, one that it
    needs; bool `[frames]` each."""
    return next((int(np.argmax(one & holds)) for one in (*shown, holds) if (one & holds).any()), 0)


def _background(frame: np.ndarray, palette: Sequence[int]) -> int:
    """The most frequent colour of a frame outside a palette."""
    counts = np.bincount(frame[~np.isin(frame, palette)], minlength=1)
    return int(counts.argmax())


Frames = Iterator[
    tuple[tuple[int, ...], list[Component]]
]  # cleared colours, and components to draw


def _drawn(game: Game, rule: Rule, count: int, *, apart: bool) -> Frames:
    """The components to draw for a rule; `apart`: also one object at a time."""
    if isinstance(rule, Blobs):
        yield from _of_blobs(game, rule, count)
    elif isinstance(rule, Bounds):
        for part in rule.parts:
            yield from _of_bounds(game, part, apart=apart)
            if isinstance(part.value, Digits):
                yield from _of_number(game, part, part.value)
    elif isinstance(rule, Cells):
        yield from of_cells(rule)
    else:
        yield from of_runs(rule, count)


def _of_blobs(game: Game, rule: Blobs, count: int) -> Frames:
    region = rule.region or (0, 0, WIDTH, game.screen[0])
    color = (rule.first_colors or rule.own_palette)[0]
    sizes = dict.fromkeys(
        size for shape in rule.all_shapes for size in sizes_at_limits(shape, rule.gap)
    )
    together: list[Component] = []
    for size in sizes:
        place = _next_place(together, size, region, rule.gap)
        if together and (place is None or len(together) == min(count, TOGETHER)):
            yield rule.palette, together
            together, place = [], region[:2]
        together = [*together, Component(color, *(place or region[:2]), *size)]
    if together:
        yield rule.palette, together
    if rule.filters:  # some keep only objects at an edge
        for together in _at_bottom(color, region, sizes, min(count, TOGETHER)):
            yield rule.palette, together
    shape = next(
        (shape for shape in rule.all_shapes if _may_be_full(shape, rule.gap)), rule.all_shapes[0]
    )
    least = shape.min_size
    for component in _across(color, region, least, least, game.screen[0]):
        yield rule.palette, [component]
    if not _may_be_full(shape, rule.gap):
        yield from (
            (rule.palette, [component])
            for component in _across_bottom(color, region, shape, rule.gap)
        )
    for together in _across_each(
        color, rule.ignore[:AREAS], least, game.screen[0], min(count, TOGETHER)
    ):
        yield rule.palette, together
    if rule.gap != NO_GAP:
        for pair in _pairs(color, region, least, rule.gap):
            yield rule.palette, pair
    for pair in filtered(rule.filters, color, region, least):
        yield rule.palette, pair
    for other in other_colors(rule.own_palette):
        yield (*rule.palette, other), [Component(other, *region[:2], *least, least[0] * least[1])]


def _next_place(
    before: Sequence[Component], size: tuple[int, int, int], region: Area, gap: tuple[int, int]
) -> tuple[int, int] | None:
    """The place of the next component: right of the last one, below all of them, or None."""
    if not before:
        return region[:2]
    last, (right, down) = before[-1], (gap[0] + BEYOND, gap[1] + BEYOND)
    below = max(c.top + c.height for c in before) + down
    for left, top in ((last.left + last.width + right, last.top), (region[0], below)):
        if left + size[0] <= region[2] and top + size[1] <= region[3]:
            return left, top
    return None


def _at_bottom(
    color: int, area: Area, sizes: Iterable[tuple[int, int, int]], most: int
) -> Iterator[list[Component]]:
    """Components of some sizes along the lower edge of an area, at most `most` on a frame."""
    every = list(sizes)
    for i in range(0, len(every), most):
        left, together = area[0], []
        for w, h, pixels in every[i : i + most]:
            together.append(Component(color, left, area[3] - h, w, h, pixels))
            left += w + BEYOND
        yield together


def pixels_with_gaps(width: int, height: int, gap: tuple[int, int]) -> dict[int, int]:
    """Numbers of pixels of components of a size, by the number that a shape's limits count, which
    includes the pixels of bridged gaps."""
    out: dict[int, int] = {}
    for pixels in range(width + height - 1, width * height + 1):
        wide = np.pad(_mask(width, height, pixels), ((0, gap[1]), (0, gap[0])))
        for axis, most in enumerate(reversed(gap)):
            wide = np.logical_or.reduce([np.roll(wide, by, axis) for by in range(most + 1)])
        out[int(np.count_nonzero(wide))] = pixels
    return out


def _may_be_full(shape: Shape, gap: tuple[int, int]) -> bool:
    """True if a shape allows a filled rectangle of its least size."""
    least, most = (0, None) if shape.pixels is None else limits(shape.pixels)
    (w, h), (dx, dy) = shape.min_size, gap
    return least <= (w + dx) * (h + dy) and (most is None or (w + dx) * (h + dy) <= most)


def sizes_at_limits(shape: Shape, gap: tuple[int, int] = NO_GAP) -> Iterator[tuple[int, int, int]]:
    """Widths, heights and numbers of pixels at the limits of a shape and beyond them."""
    (w0, w1), (h0, h1) = limits(shape.w), limits(shape.h)
    p0, p1 = (0, None) if shape.pixels is None else limits(shape.pixels)
    widths, heights = (
        [w for w in (w0, w1) if w and w <= LARGE],
        [h for h in (h0, h1) if h and h <= LARGE],
    )
    boxes = [(w, h) for w in widths for h in heights]
    boxes += [
        (w + step, h)
        for w, step in zip((w0, w1 or 0), (-1, 1), strict=True)
        for h in heights
        if w <= LARGE
    ]
    boxes += [
        (w, h + step)
        for h, step in zip((h0, h1 or 0), (-1, 1), strict=True)
        for w in widths
        if h <= LARGE
    ]
    for w, h in dict.fromkeys(boxes):
        if w > 0 and h > 0:
            counts = [min(max(w * h, p0), w * h if p1 is None else p1)]
            counts += (
                [p for p in (p0 - 1, p0, p1, p1 + 1) if w + h - 1 <= p <= w * h]
                if p1 is not None
                else []
            )
            if p1 is not None and gap != NO_GAP:
                by_count = pixels_with_gaps(w, h, gap)
                counts += [by_count[p] for p in (p0 - 1, p0, p1, p1 + 1) if p in by_count]
            yield from ((w, h, p) for p in dict.fromkeys(counts))


def _across(
    color: int, area: Area, size: tuple[int, int], inside: tuple[int, int], height: int
) -> Iterator[Component]:
    """Components that each cross one edge of an area, with `inside` columns or rows inside."""
    (w, h), (left, top, right, bottom) = size, area
    x, y = (left + right - w) // 2, (top + bottom - h) // 2
    wide, high = w + BEYOND, h + BEYOND
    if left > 0:
        yield Component(color, left + inside[0] - wide, y, wide, h, wide * h)
    if right < WIDTH:
        yield Component(color, right - inside[0], y, wide, h, wide * h)
    if top > 0:
        yield Component(color, x, top + inside[1] - high, w, high, w * high)
    if bottom < height:
        yield Component(color, x, bottom - inside[1], w, high, w * high)


def _across_bottom(
    color: int, area: Area, shape: Shape, gap: tuple[int, int]
) -> Iterator[Component]:
    """A component that is not a full rectangle, with all except a few pixels above the lower edge
    of an area."""
    (w, h), counted = shape.min_size, pixels_with_gaps(*shape.min_size, gap)
    least, most = (0, None) if shape.pixels is None else limits(shape.pixels)
    allowed = [
        pixels
        for number, pixels in counted.items()
        if least <= number and (most is None or number <= most)
    ]
    if allowed:
        yield Component(
            color, (area[0] + area[2] - w) // 2, area[3] - h, w, h + BEYOND, allowed[0] + BEYOND
        )


def _across_each(
    color: int, areas: Sequence[Area], size: tuple[int, int], height: int, most: int
) -> Iterator[list[Component]]:
    """Components that cross an edge of an area and have the least size outside, at most `most`
    areas on a frame."""
    for of_side in itertools.zip_longest(
        *(_across(color, area, size, (BEYOND, BEYOND), height) for area in areas)
    ):
        there = [component for component in of_side if component is not None]
        yield from (there[i : i + most] for i in range(0, len(there), most))


def _pairs(
    color: int, area: Area, size: tuple[int, int], gap: tuple[int, int]
) -> Iterator[list[Component]]:
    """Two components with a bridged gap, and with a larger gap."""
    (w, h), (x, y) = size, area[:2]
    first = Component(color, x, y, w, h, w * h)
    for more in (0, 1):
        yield [first, Component(color, x + w + gap[0] + more, y, w, h, w * h)]
        yield [first, Component(color, x, y + h + gap[1] + more, w, h, w * h)]


def other_colors(palette: Sequence[int]) -> list[int]:
    """The next colours after a rule's several colours, without these."""
    return (
        [c + 2 for c in palette if c + 2 not in palette and c < 254][:TOGETHER]
        if len(palette) > 2
        else []
    )


def filtered(
    filters: Iterable[Filter], color: int, area: Area, size: tuple[int, int]
) -> Iterator[list[Component]]:
    """A component, and runs beside it at the limits of a filter, touching or apart."""
    (w, h), x, y = size, (area[0] + area[2] - size[0]) // 2, (area[1] + area[3] - size[1]) // 2
    for own in filters:
        match own:
            case ShortRuns(most=most, across=across):
                runs = [(n, 1) if across else (1, n) for n in (most, most + 1)]
            case LoneRuns(least=least):
                runs = [(least, 1), (least - 1, 1)]
            case Lines(least=least):
                runs = [(1, least), (1, least - 1)]
            case _:
                runs = []
        for (width, height), apart in itertools.product(runs, (0, BEYOND)):
            if width:
                yield [
                    Component(color, x, y, w, h, w * h),
                    Component(color, x + w + apart, y, width, height, width * height),
                ]


def _of_bounds(game: Game, rule: Bounds, *, apart: bool) -> Frames:
    """A component that overfills each region, and objects of the least and the largest size in all
    regions."""
    slots = [(region, _color(colors, rule.inverse)) for region, colors in rule.slots]
    cleared = tuple(dict.fromkeys(color for _, color in slots))
    for (left, top, right, bottom), color in slots[:REGIONS]:
        w, h = right - left + 2 * BEYOND, bottom - top + 2 * BEYOND
        yield cleared, [Component(color, left - BEYOND, top - BEYOND, w, h, w * h)]
    for area in rule.ignore[:REGIONS]:
        for component in _across(
            slots[0][1], area, (BEYOND, BEYOND), (BEYOND, BEYOND), game.screen[0]
        ):
            yield cleared, [component]
    smallest = np.broadcast_to(rule.min_size, (len(slots), 2)).tolist()
    for dw, dh in ((0, 0), (-1, 0), (0, -1)):
        sizes = [(w + dw, h + dh) for w, h in smallest]
        if min(itertools.chain(*sizes)) > 0:
            every = [
                Component(c, r[0], r[1], w, h, w * h)
                for (r, c), (w, h) in zip(slots, sizes, strict=True)
            ]
            yield cleared, every
            yield from ((cleared, [component]) for component in (every[:REGIONS] if apart else ()))
    for pair in filtered(rule.filters, slots[0][1], slots[0][0], tuple(smallest[0])):
        yield cleared, pair
    for other in () if rule.inverse else other_colors(rule.slots[0][1]):
        (w, h), (left, top, *_) = smallest[0], slots[0][0]
        yield (*cleared, other), [Component(other, left, top, w, h, w * h)]
    if rule.max_size is not None:
        for dw, dh in ((0, 0), (1, 0), (0, 1)):
            w, h = rule.max_size[0] + dw, rule.max_size[1] + dh
            yield cleared, [Component(c, r[0], r[1], w, h, w * h) for r, c in slots]


def _of_number(game: Game, rule: Bounds, number: Digits) -> Frames:
    """A number that fills its cells, and numbers with a pixel in a cell that must be free, or
    across the edges of the region."""
    area, colors = rule.slots[0]
    color = _color(colors, rule.inverse)
    picture = _plainest(number.font)
    shown = [
        Component(color, left + x, number.top + y, w, h, w * h)
        for left in number.lefts
        for x, y, w, h in picture
    ]
    yield (color,), shown
    for left in number.free:
        yield (color,), [*shown, Component(color, left, number.top, 1, 1, 1)]
    if number.required:
        yield (color,), [*shown, *_across(color, area, (BEYOND, BEYOND), (0, 0), game.screen[0])]


def _plainest(font: Font) -> list[Area]:
    """The rectangles, left, top, width and height, of the picture of a digit above 0 that has
    fewest of them."""
    digits = [glyph for glyph in font.glyphs[1:] if any(glyph) and font.glyphs.count(glyph) == 1]
    return min((_rectangles(font, glyph) for glyph in digits), key=len, default=[])


def _rectangles(font: Font, glyph: tuple[int, ...]) -> list[Area]:
    """The dots of a picture in rectangles of equal rows, in pixels."""
    (width, height), out, top = font.dot, [], 0
    for row, same in itertools.groupby(glyph):
        rows = len(list(same))
        for run in re.finditer("1+", f"{row:0{font.dots}b}"):
            out.append(
                (
                    run.start() * width,
                    top * height,
                    (run.end() - run.start()) * width,
                    rows * height,
                )
            )
        top += rows
    return out


def _color(colors: Sequence[int], inverse: bool) -> int:
    """One of the colours, or another colour if `inverse`."""
    return colors[0] if not inverse else next(c for c in range(14, 256, 2) if c not in colors)


def of_cells(rule: Cells) -> Frames:
    """Full cells, cells that lack their last row or column, and cells with a pixel in or beside the
    margin."""
    color, cells = rule.palette[0], list(zip(rule.x, rule.y, strict=True))[:REGIONS]
    (right, down), (w, h) = rule.margin, (rule.w, rule.h)
    for width, height in ((w, h), (w - 1, h), (w, h - 1)):
        if width and height:
            yield (
                rule.palette,
                [Component(color, x, y, width, height, width * height) for x, y in cells],
            )
    for x, y in cells[:2]:
        cell = Component(color, x, y, w, h, w * h)
        beside = [(x - right - 1, y), (x - right, y), (x + w + right - 1, y), (x + w + right, y)]
        above = [(x, y - down - 1), (x, y - down), (x, y + h + down - 1), (x, y + h + down)]
        for left, top in dict.fromkeys((*beside, *above)):
            yield rule.palette, [cell, Component(color, left, top, 1, 1, 1)]


def of_runs(rule: Runs, count: int) -> Frames:
    """Runs of the least and the largest width, at the outermost columns, and beyond; one in each
    row of a frame.

    If a category has fewer slots than rows, each run is also alone on a frame.
    """
    if rule.slot_count is None and count < len(rule.rows):
        for run in rule.runs:
            yield rule.palette, [next(_variants(run))]
    for runs in itertools.zip_longest(*(list(_variants(run)) for run in rule.runs)):
        rows: dict[int, Component] = {}
        for component in runs:
            if component is not None:
                rows.setdefault(component.top, component)
        yield rule.palette, list(rows.values())


def _variants(run: Run) -> Iterator[Component]:
    lefts, widths = limits(run.left), limits(run.width)
    pairs = [(left, width) for left in lefts for width in widths]
    pairs += [
        (lefts[0] - 1, widths[1]),
        (lefts[1] + 1, widths[0]),
        (lefts[0], widths[0] - 1),
        (lefts[0], widths[1] + 1),
    ]
    for left, width in dict.fromkeys(pairs):
        if left >= 0 and width > 0:
            yield Component(run.palette[0], left, run.row, width, 1, width)
