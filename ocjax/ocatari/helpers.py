"""OCAtari's helper functions that other code imports, and the reasons for absent ones."""

import argparse
import contextlib
import os
import random
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ocjax._extras import extras
from ocjax.extraction.registry import load
from ocjax.transforms.game_objects import GameObject, ValueObject

UPSCALE_FACTOR = 5  # pixels of a rendered overlay per screen pixel
_FONT_SIZE, _LABEL_GAP = 14, 2  # pixels of the overlay
_ARROW, _TEXT = (100, 200, 255), (255, 255, 255)
_FRAMES_PER_SECOND = 60

_DETECTION = (
    "it is a part of OCAtari's detection, which ocjax replaces; `ocjax.load(game).vem(frames)` "
    "detects objects in frames"
)
_AGENTS = (
    "OCAtari's agents need PyTorch and its model files; load the model with the library that "
    "trained it"
)
_TABLES = (
    "`OCAtari(game, hud=...).max_objects_per_cat` has the numbers of objects, and "
    "`ocjax.layouts.blendrl_slots(game)` BlendRL's"
)

# Names that OCAtari's scripts import but this module lacks, with the reasons.
ABSENT = {
    "test_parser": "it is the command line of OCAtari's tests; make an argparse.ArgumentParser",
    "AtariNet": _AGENTS,
    "_load_checkpoint": _AGENTS,
    "bitfield_to_number": _DETECTION,
    "objects_colors": (
        "colours are an attribute of each object, `rgb`, and of `ocjax.load(game).categories`"
    ),
    "find_objects": _DETECTION,
    "detect_objects_ram": _DETECTION,
    "detect_objects_vision": _DETECTION,
    "MAX_NB_OBJECTS": _TABLES,
    "MAX_NB_OBJECTS_HUD": _TABLES,
    "MAX_ESSENTIAL_OBJECTS": _TABLES,
    "PositionHistoryEnv": (
        "it does not run in OCAtari 2.2.1 either; `ocjax.make(game, obs='vector')` observes "
        "positions and movements"
    ),
    "DEVICE": "OCAtari 2.2.1 has none either",
    "EasyDonkey": "OCAtari 2.2.1 has none either; `OCAtari(game, hook=...)` varies games",
    "HideEnemyPong": "OCAtari 2.2.1 has none either; `OCAtari(game, hook=...)` varies games",
}


def command_line() -> argparse.ArgumentParser:
    """The `parser` that scripts import, with the path of an agent's model.

    Scripts add their options to it.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("-p", "--path", help="path of an agent's model")
    return parser


class RandomAgent:
    """An agent that draws one of `nb_actions` actions uniformly.

    It uses Python's global generator.
    """

    def __init__(self, nb_actions: int) -> None:
        self.nb_actions = nb_actions

    def draw_action(self, *args: Any, **kwargs: Any) -> int:
        """An action; the arguments have no effect."""
        return random.randrange(self.nb_actions)


def load_agent(*args: Any, **kwargs: Any) -> NoReturn:
    """Raise a ValueError: ocjax cannot load OCAtari's agents."""
    raise ValueError(f"ocjax does not load agents of OCAtari: {_AGENTS}")


def _convert_number(number: int) -> int:
    """The number in a byte of two decimal digits; HackAtari imports this function."""
    return int(f"{number:x}")


def riverraid_score(ram: np.ndarray) -> int:
    """The score in the RAM of River Raid, uint8 `[128]`; HackAtari imports this function."""
    game = load("Riverraid")
    return int(game.rem(ram).of("PlayerScore").value[0])


def make_deterministic(seed: int, env: Any, states_dict: Any = None) -> None:
    """Seed Python's and NumPy's global generators and the environment's next `reset`.

    `states_dict` has no effect.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002  # code written for OCAtari draws from the global generator
    env.unwrapped._seed = seed


def make_darker(color: Sequence[int], col_precent: float = 0.8) -> list[int]:
    """A colour times a factor, rounded down; black for an empty colour.

    The spelling of the argument is OCAtari's.
    """
    return [int(c * col_precent) for c in color] if color else [0, 0, 0]


def to_rgba(color: Sequence[int]) -> np.ndarray:
    """An RGB colour as float64 `[4]` from 0 to 1 with an opacity of 0.7, for Matplotlib."""
    return np.array([*(c / 255 for c in color), 0.7])


def mark_bb(
    image_array: np.ndarray,
    bb: Sequence[int],
    color: Sequence[int] = (255, 0, 0),
    surround: bool = True,
) -> None:
    """Draw a box into an image, uint8 `[H, W, 3]`, in place.

    Args:
        bb: left, top, width and height.
        surround: whether the line runs one pixel outside the box, instead of along its left and top
            edge.

    Raises:
        ValueError: the array is not an image.
    """
    if image_array.ndim != 3:
        raise ValueError(
            f"an image has shape [H, W, 3], got shape {list(image_array.shape)}: OCAtari returns "
            "frames with obs_mode='ori'"
        )
    height, width = image_array.shape[:2]
    x, y, w, h = bb
    left, top = (max(0, v - surround) for v in (x, y))
    right, bottom = min(width - 1, x + w), min(height - 1, y + h)
    if left <= right and top <= bottom:
        image_array[top : bottom + 1, [left, right]] = color
        image_array[[top, bottom], left : right + 1] = color


def draw_objects(frame: np.ndarray, objects: Sequence[GameObject]) -> Image.Image:
    """Draw boxes, labels, values and movements of visible objects over an enlarged frame.

    Args:
        frame: uint8 `[H, 160, 3]`.
    """
    k = UPSCALE_FACTOR
    image = Image.fromarray(frame).resize(
        (frame.shape[1] * k, frame.shape[0] * k), Image.Resampling.NEAREST
    )
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=_FONT_SIZE)
    for o in filter(None, objects):
        left, top, right, bottom = k * o.x, k * o.y, k * (o.x + o.w), k * (o.y + o.h)
        draw.rectangle(
            (left, top, max(left, right - 1), max(top, bottom - 1)), outline=tuple(o.rgb), width=2
        )
        label = f"{o.category} ({o.value})" if isinstance(o, ValueObject) else o.category
        draw.text((left, bottom + _LABEL_GAP), label, _TEXT, font)
        if o.dx or o.dy:
            x, y = (left + right) / 2, (top + bottom) / 2
            draw.line((x, y, x + 2 * k * o.dx, y + 2 * k * o.dy), _ARROW, 2)
    return image


class Window:
    """A window that shows pictures and opens with the first one."""

    def __init__(self, title: str) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        with extras():
            import pygame  # pyright: ignore[reportMissingImports]
        self._pygame, self._title, self._surface = pygame, title, None
        self._clock = pygame.time.Clock()

    def show(self, picture: Image.Image) -> None:
        """Show a picture, at most 60 a second."""
        if self._surface is None:
            self._pygame.init()
            self._pygame.display.set_caption(self._title)
            self._surface = self._pygame.display.set_mode(picture.size)
        self._surface.blit(
            self._pygame.image.frombytes(picture.tobytes(), picture.size, "RGB"), (0, 0)
        )
        self._pygame.display.flip()
        self._pygame.event.pump()
        self._clock.tick(_FRAMES_PER_SECOND)

    def close(self) -> None:
        """Close the window."""
        with contextlib.suppress(self._pygame.error):
            self._pygame.display.quit()
        self._surface = None
