"""Pictures that a person can look at: objects drawn over frames."""

import colorsys
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.vision.palette import NTSC

MARGIN = 4


def category_colors(game: Game) -> dict[str, tuple[int, int, int]]:
    """A bright colour for each category, as far apart from each other as their number allows."""
    n = len(game.categories)
    hues = {c.name: colorsys.hsv_to_rgb(i / n, 0.75, 1.0) for i, c in enumerate(game.categories)}
    return {name: (round(255 * r), round(255 * g), round(255 * b)) for name, (r, g, b) in hues.items()}


def overlay(game: Game, frame: np.ndarray, objects: Objects, *, scale: int = 3, labels: bool = True) -> Image.Image:
    """A frame with the boxes of its valid objects, and at the first of each category its name and value.

    Args:
        game: whose objects they are.
        frame: uint8 `[H, 160]` of palette indices or `[H, 160, 3]` of RGB.
        objects: of one state.
        scale: screen pixels a console pixel (twice as wide: the console's pixels are).
        labels: names and values.
    """
    rgb = NTSC[frame] if frame.ndim == 2 else frame
    sx, sy = 2 * scale, scale
    image = Image.fromarray(rgb).resize((rgb.shape[1] * sx, rgb.shape[0] * sy), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size=4 * scale + 2)
    colors, named = category_colors(game), set()
    records = objects.to_list()
    for r in records:
        corners = (r["x"] * sx - 1, r["y"] * sy - 1, (r["x"] + r["w"]) * sx, (r["y"] + r["h"]) * sy)
        draw.rectangle(corners, outline=colors[r["category"]], width=max(1, scale // 2))
    for r in records:
        extra = "".join(f" {r[k]}" for k in ("value", "orientation") if k in r)
        if labels and (r["category"] not in named or extra):
            named.add(r["category"])
            _label(draw, font, r["category"] + extra, (r["x"] * sx, r["y"] * sy, (r["y"] + r["h"]) * sy), image.size, colors[r["category"]])
    return image


def _label(draw: ImageDraw.ImageDraw, font: ImageFont.ImageFont | ImageFont.FreeTypeFont, text: str, at: tuple[int, int, int],
           size: tuple[int, int], color: tuple[int, int, int]) -> None:  # fmt: skip
    """Text on a dark ground above a box, or below it where there is no room above."""
    left, top, right, bottom = (round(v) for v in draw.textbbox((0, 0), text, font=font))
    x = max(0, min(at[0], size[0] - right - 2))
    y = at[1] - bottom - 3 if at[1] - bottom - 3 >= 0 else min(at[2] + 1, size[1] - bottom - 2)
    draw.rectangle((x + left - 1, y + top - 1, x + right + 1, y + bottom + 1), fill=(0, 0, 0))
    draw.text((x, y), text, font=font, fill=color)


def sheet(rows: Sequence[Sequence[Image.Image]], titles: Sequence[str]) -> Image.Image:
    """Pictures of equal size in rows, with a title above each column."""
    width, height = rows[0][0].size
    font = ImageFont.load_default(size=22)
    head = 34
    out = Image.new("RGB", (len(rows[0]) * (width + MARGIN) + MARGIN, head + len(rows) * (height + MARGIN)), (40, 40, 40))
    draw = ImageDraw.Draw(out)
    for j, title in enumerate(titles):
        draw.text((MARGIN + j * (width + MARGIN) + 4, 4), title, font=font, fill=(255, 255, 255))
    for i, row in enumerate(rows):
        for j, image in enumerate(row):
            out.paste(image, (MARGIN + j * (width + MARGIN), head + i * (height + MARGIN)))
    return out
