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

    Args:
        game: the objects' game.
        frame: uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
        objects: of one state.
    """
    rgb = game.palette[frame] if frame.ndim == 2 else frame
    out = np.zeros(len(objects.valid), bool)
    for slot in np.flatnonzero(objects.valid):
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
        scale: vertical picture pixels per screen pixel. The horizontal scale is twice as large,
            because the console's pixels are wide.
        labels: whether to label the first object of each category, and every object with a value or
            a known orientation.
        numbers: label every object with its number in `objects.to_list()` instead, counted from 1.
        terrain: of the state, to be painted over the frame; see `tinted`. With `labels` each kind
            gets one.
    """
    rgb = game.palette[frame] if frame.ndim == 2 else frame
    sx, sy = 2 * scale, scale
    shown_rgb = rgb if terrain is None else tinted(game, rgb, terrain)
    image = Image.fromarray(shown_rgb).resize(
        (rgb.shape[1] * sx, rgb.shape[0] * sy), Image.Resampling.NEAREST
    )
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size=4 * scale + 2)
    colors, named = category_colors(game), set()
    records = objects.to_list()
    shown = drawn(game, frame, objects)[np.asarray(objects.valid)]
    for r, is_shown in zip(records, shown, strict=True):
        corners = (r["x"] * sx - 1, r["y"] * sy - 1, (r["x"] + r["w"]) * sx, (r["y"] + r["h"]) * sy)
        _frame(draw, corners, colors[r["category"]], _line_width(scale), dashed=not is_shown)
    if terrain is not None and labels:
        _label_terrain(draw, font, terrain, image.size, scale)
    if numbers:
        for k, r in enumerate(records, 1):
            _label(
                draw,
                font,
                str(k),
                (r["x"] * sx, r["y"] * sy, (r["y"] + r["h"]) * sy),
                image.size,
                colors[r["category"]],
            )
    for r in records if labels and not numbers else ():
        attributes = _attributes(r)
        if r["category"] not in named or attributes:
            named.add(r["category"])
            place = r["x"] * sx, r["y"] * sy, (r["y"] + r["h"]) * sy
            _label(draw, font, r["category"] + attributes, place, image.size, colors[r["category"]])
    return image


def terrain_colors(game: Declaration) -> dict[str, tuple[int, int, int]]:
    """A bright RGB colour for each kind of the game's terrain, with hues evenly spaced."""
    return _bright_colors([kind.name for kind in game.terrain or ()])


def tinted(game: Declaration, frame: np.ndarray, terrain: Terrain) -> np.ndarray:
    """Paint each kind of terrain over a dark frame in a colour of its own, uint8 `[H, 160, 3]`.

    Args:
        game: the game.
        frame: uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
        terrain: of one state.
    """
    rgb = game.palette[frame] if frame.ndim == 2 else frame
    out = rgb // 2
    for mask, color in zip(np.asarray(terrain.masks), terrain_colors(game).values(), strict=True):
        out[mask] = np.array(color, np.uint8)
    return out


def pixels(
    game: Declaration, frame: np.ndarray, objects: Objects, *, scale: int = 3
) -> Image.Image:
    """Draw the own pixels of the valid objects of one state (`ocjax.segment`) over its dark frame.

    Args:
        game: the objects' game.
        frame: uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
        objects: of one state.
        scale: see `overlay`.
    """
    rgb = game.palette[frame] if frame.ndim == 2 else frame
    colors = np.array(list(category_colors(game).values()), np.uint8)
    owners = np.asarray(segment(objects, frame))
    painted = np.where((owners == NOBODY)[..., None], rgb // 3, colors[game.slot_category][owners])
    image = Image.fromarray(painted)
    return image.resize((2 * scale * image.width, scale * image.height), Image.Resampling.NEAREST)


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
        scale: vertical picture pixels per screen pixel. The horizontal scale is twice as large,
            because the console's pixels are wide.
    """
    sx, sy = 2 * scale, scale
    image = Image.fromarray(rgb).resize(
        (rgb.shape[1] * sx, rgb.shape[0] * sy), Image.Resampling.NEAREST
    )
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size=4 * scale + 2)
    colors = _bright_colors(categories)
    boxes = [
        (categories[int(k)], box)
        for k, box in zip(label, np.rint(xywh).astype(int).tolist(), strict=True)
        if k >= 0
    ]
    for name, (x, y, w, h) in boxes:
        _frame(
            draw,
            (x * sx - 1, y * sy - 1, (x + max(w, 0)) * sx, (y + max(h, 0)) * sy),
            colors[name],
            _line_width(scale),
            dashed=False,
        )
    for name, (x, y, _, h) in dict(reversed(boxes)).items():
        _label(draw, font, name, (x * sx, y * sy, (y + h) * sy), image.size, colors[name])
    return image


def _line_width(scale: int) -> int:
    """The width of a box's lines in picture pixels."""
    return max(1, (scale + 2) // 2)


def _frame(
    draw: ImageDraw.ImageDraw,
    corners: tuple[int, ...],
    color: tuple[int, int, int],
    width: int,
    *,
    dashed: bool,
) -> None:
    left, top, right, bottom = corners
    if not dashed:
        draw.rectangle((left, top, right, bottom), outline=color, width=width)
        return
    for x in range(left, right + 1, 2 * _DASH):
        end = min(x + _DASH, right)
        draw.line(((x, top), (end, top)), color, width)
        draw.line(((x, bottom), (end, bottom)), color, width)
    for y in range(top, bottom + 1, 2 * _DASH):
        end = min(y + _DASH, bottom)
        draw.line(((left, y), (left, end)), color, width)
        draw.line(((right, y), (right, end)), color, width)


def _label_terrain(
    draw: ImageDraw.ImageDraw,
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
    terrain: Terrain,
    size: tuple[int, int],
    scale: int,
) -> None:
    """Write the name of each kind at the one of its pixels that is nearest to its middle."""
    colors = terrain_colors(terrain.game)
    for mask, (name, color) in zip(np.asarray(terrain.masks), colors.items(), strict=True):
        y, x = np.nonzero(mask)
        if not len(x):
            continue
        nearest = int(np.argmin((x - x.mean()) ** 2 + (y - y.mean()) ** 2))
        place = int(x[nearest]) * 2 * scale, int(y[nearest]) * scale, int(y[nearest] + 1) * scale
        _label(draw, font, name, place, size, color)


def _attributes(record: Mapping[str, Any]) -> str:
    """The attributes in a label: " 12" for display objects, " value 3, facing NE" for others."""
    parts = []
    if "value" in record:
        parts.append(f"{record['value']}" if record["hud"] else f"value {record['value']}")
    if "orientation" in record:
        parts.append(f"facing {POINTS[record['orientation']]}")
    return " " * bool(parts) + ", ".join(parts)


def _label(
    draw: ImageDraw.ImageDraw,
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
    text: str,
    place: tuple[int, int, int],
    size: tuple[int, int],
    color: tuple[int, int, int],
) -> None:
    """Write text on black above a box, or below it if the space above is too small.

    `place` is left, top and bottom of the box, and `size` the width and height of the picture.
    """
    box_left, box_top, box_bottom = place
    left, top, right, bottom = (round(v) for v in draw.textbbox((0, 0), text, font=font))
    x = max(0, min(box_left, size[0] - right - 2))
    y = (
        box_top - bottom - 3
        if box_top - bottom - 3 >= 0
        else min(box_bottom + 1, size[1] - bottom - 2)
    )
    draw.rectangle((x + left - 1, y + top - 1, x + right + 1, y + bottom + 1), fill=(0, 0, 0))
    draw.text((x, y), text, font=font, fill=color)


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
