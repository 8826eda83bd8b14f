"""Draw objects over frames."""

import colorsys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ocjax.console.compass import POINTS
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects
from ocjax.extraction.scene import Terrain
from ocjax.transforms.segmentation import NOBODY, segment

__all__ = [
    "HIDDEN",
    "Box",
    "Color",
    "boxes_over",
    "category_colors",
    "drawn",
    "overlay",
    "pixels",
    "sheet",
    "terrain_colors",
    "tinted",
]

HIDDEN = "dashed: not on this frame"  # the legend of boxes

_DASH = 4  # pixels of a dash and of the gap after it
Color = tuple[int, int, int]
Box = tuple[int, int, int, int]  # left, top, width and height in screen pixels
_MARGIN = 4  # pixels between the pictures of a sheet
_BACKGROUND, _TEXT = (40, 40, 40), (255, 255, 255)  # of a sheet
_TITLE_SIZE, _TITLE_HEIGHT = 22, 34  # pixels


def category_colors(game: Declaration) -> dict[str, tuple[int, int, int]]:
    """A bright RGB colour for each category, with hues evenly spaced."""
    return _bright_colors([c.name for c in game.categories])


def _bright_colors(names: Sequence[str]) -> dict[str, tuple[int, int, int]]:
    hues = {name: colorsys.hsv_to_rgb(i / len(names), 0.75, 1.0) for i, name in enumerate(names)}
    return {
        name: (round(255 * r), round(255 * g), round(255 * b)) for name, (r, g, b) in hues.items()
    }


def drawn(game: Declaration, frame: np.ndarray, objects: Objects) -> np.ndarray:
    """Mark the valid objects of one state with a pixel of their colour in their box, bool `[N]`.

    Objects count as drawn if the RAM lacks their colour.

    `frame` is uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
    """
    rgb = _rgb(game, frame)
    without_color = np.array([not c.ram_color for c in game.categories])
    of_slots = without_color[game.slot_category[: len(objects.valid)]]
    out = np.asarray(objects.valid) & of_slots
    for slot in np.flatnonzero(np.asarray(objects.valid) & ~of_slots):
        x, y, w, h = np.asarray(objects.xywh[slot]).tolist()
        out[slot] = (rgb[y : y + h, x : x + w] == np.asarray(objects.rgb[slot])).all(axis=-1).any()
    return out


def overlay(
    game: Declaration,
    frame: np.ndarray,
    objects: Objects,
    *,
    scale: int = 3,
    labels: bool = True,
    numbers: bool = False,
    terrain: Terrain | None = None,
) -> Image.Image:
    """Draw the boxes of the valid objects of one state over its frame.

    Boxes of objects that the frame does not show are dashed.

    Args:
        game: the objects' game.
        frame: uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
        objects: of one state.
        scale: vertical picture pixels per screen pixel; the horizontal scale is twice as large.
        labels: whether to label the first object of each category, and every object with a value or
            a known orientation.
        numbers: label every object with its number in `objects.to_list()` instead, counted from 1.
        terrain: of the state, to be painted over the frame; see `tinted`. With `labels` each kind
            gets one.
    """
    canvas = _Canvas(_rgb(game, frame) if terrain is None else tinted(game, frame, terrain), scale)
    colors, named = category_colors(game), set()
    records = objects.to_list()
    boxes = [(r["x"], r["y"], r["w"], r["h"]) for r in records]
    shown = drawn(game, frame, objects)[np.asarray(objects.valid)]
    for r, box, is_shown in zip(records, boxes, shown, strict=True):
        canvas.outline(box, colors[r["category"]], dashed=not is_shown)
    if terrain is not None and labels:
        _label_terrain(canvas, terrain)
    for k, (r, box) in enumerate(zip(records, boxes, strict=True), 1):
        attributes = _attributes(r)
        text = str(k) if numbers else r["category"] + attributes
        if numbers or (labels and (r["category"] not in named or attributes)):
            named.add(r["category"])
            canvas.label(text, box, colors[r["category"]])
    return canvas.image


class _Canvas:
    """An enlarged frame, uint8 `[H, 160, 3]`, to draw on."""

    def __init__(self, rgb: np.ndarray, scale: int) -> None:
        self.image, self._scale = _enlarged(rgb, scale), scale
        self._draw = ImageDraw.Draw(self.image)
        self._font = ImageFont.load_default(size=4 * scale + 2)

    def outline(self, box: Box, color: Color, *, dashed: bool) -> None:
        """Draw a box around its pixels."""
        x, y, w, h = box
        width = max(1, (self._scale + 2) // 2)
        left, top = 2 * self._scale * x - 1, self._scale * y - 1
        right, bottom = 2 * self._scale * (x + w), self._scale * (y + h)
        if not dashed:
            self._draw.rectangle((left, top, right, bottom), outline=color, width=width)
            return
        across = [((x, y), (x2, y)) for x, x2 in _dashes(left, right) for y in (top, bottom)]
        down = [((x, y), (x, y2)) for y, y2 in _dashes(top, bottom) for x in (left, right)]
        for line in (*across, *down):
            self._draw.line(line, color, width)

    def label(self, text: str, box: Box, color: Color) -> None:
        """Write text on black above a box, or below it if the space above is too small."""
        box_left, box_top, _, height = box
        left, top, right, bottom = map(round, self._draw.textbbox((0, 0), text, font=self._font))
        x = max(0, min(2 * self._scale * box_left, self.image.width - right - 2))
        y = self._scale * box_top - bottom - 3
        if y < 0:
            below = self._scale * (box_top + height) + 1
            y = min(below, self.image.height - bottom - 2)
        self._draw.rectangle(
            (x + left - 1, y + top - 1, x + right + 1, y + bottom + 1), fill=(0, 0, 0)
        )
        self._draw.text((x, y), text, font=self._font, fill=color)


def _dashes(start: int, stop: int) -> list[tuple[int, int]]:
    return [(i, min(i + _DASH, stop)) for i in range(start, stop + 1, 2 * _DASH)]


def _rgb(game: Declaration, frame: np.ndarray) -> np.ndarray:
    return game.palette[frame] if frame.ndim == 2 else frame


def _enlarged(rgb: np.ndarray, scale: int) -> Image.Image:
    """Enlarge a frame; the console's pixels are twice as wide as high."""
    image = Image.fromarray(rgb)
    return image.resize((2 * scale * image.width, scale * image.height), Image.Resampling.NEAREST)


def terrain_colors(game: Declaration) -> dict[str, tuple[int, int, int]]:
    """A bright RGB colour for each kind of the game's terrain, with hues evenly spaced."""
    return _bright_colors([kind.name for kind in game.terrain or ()])


def tinted(game: Declaration, frame: np.ndarray, terrain: Terrain) -> np.ndarray:
    """Paint each kind of one state's terrain over its darkened frame, uint8 `[H, 160, 3]`."""
    out = _rgb(game, frame) // 2
    for mask, color in zip(np.asarray(terrain.masks), terrain_colors(game).values(), strict=True):
        out[mask] = np.array(color, np.uint8)
    return out


def pixels(
    game: Declaration, frame: np.ndarray, objects: Objects, *, scale: int = 3
) -> Image.Image:
    """Draw the own pixels of the valid objects of one state (`ocjax.segment`) over its dark frame.

    The arguments are those of `overlay`.
    """
    colors = np.array(list(category_colors(game).values()), np.uint8)
    owners = np.asarray(segment(objects, frame))
    dark = _rgb(game, frame) // 3
    own = colors[game.slot_category][owners]
    return _enlarged(np.where((owners == NOBODY)[..., None], dark, own), scale)


def boxes_over(
    rgb: np.ndarray,
    xywh: np.ndarray,
    label: np.ndarray,
    categories: Sequence[str],
    *,
    scale: int = 2,
) -> Image.Image:
    """Draw labelled boxes of any detector over a frame.

    Args:
        rgb: uint8 `[H, 160, 3]`.
        xywh: `[N, 4]`, left, top, width and height in screen pixels.
        label: int `[N]`, index into `categories`, or -1 for no box.
        categories: names of the labels, each written above its first box.
        scale: see `overlay`.
    """
    canvas, colors = _Canvas(rgb, scale), _bright_colors(categories)
    boxes = [
        (categories[int(k)], (x, y, max(w, 0), max(h, 0)))
        for k, (x, y, w, h) in zip(label, np.rint(xywh).astype(int).tolist(), strict=True)
        if k >= 0
    ]
    for name, box in boxes:
        canvas.outline(box, colors[name], dashed=False)
    for name, box in dict(reversed(boxes)).items():
        canvas.label(name, box, colors[name])
    return canvas.image


def _label_terrain(canvas: _Canvas, terrain: Terrain) -> None:
    """Write the name of each kind at the one of its pixels that is nearest to its middle."""
    colors = terrain_colors(terrain.game)
    for mask, (name, color) in zip(np.asarray(terrain.masks), colors.items(), strict=True):
        y, x = np.nonzero(mask)
        if len(x):
            nearest = int(np.argmin((x - x.mean()) ** 2 + (y - y.mean()) ** 2))
            canvas.label(name, (int(x[nearest]), int(y[nearest]), 1, 1), color)


def _attributes(record: Mapping[str, Any]) -> str:
    parts = []
    if "value" in record:
        parts.append(f"{record['value']}" if record["hud"] else f"value {record['value']}")
    if "orientation" in record:
        parts.append(f"facing {POINTS[record['orientation']]}")
    return " " * bool(parts) + ", ".join(parts)


def sheet(rows: Sequence[Sequence[Image.Image]], titles: Sequence[str]) -> Image.Image:
    """Arrange pictures of equal size in rows, with an optional title above each column."""
    width, height = rows[0][0].size
    font = ImageFont.load_default(size=_TITLE_SIZE)
    top = _TITLE_HEIGHT if titles else _MARGIN
    size = len(rows[0]) * (width + _MARGIN) + _MARGIN, top + len(rows) * (height + _MARGIN)
    out = Image.new("RGB", size, _BACKGROUND)
    draw = ImageDraw.Draw(out)
    for j, title in enumerate(titles):
        draw.text((_MARGIN + j * (width + _MARGIN) + 4, 4), title, font=font, fill=_TEXT)
    for i, row in enumerate(rows):
        for j, image in enumerate(row):
            out.paste(image, (_MARGIN + j * (width + _MARGIN), top + i * (height + _MARGIN)))
    return out
