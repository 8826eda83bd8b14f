"""The colours of a game's screen and the connected components of each."""

import collections
import dataclasses
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ocjax.console.boxes import WIDTH

SLOTS = 40  # components of a colour on a frame
RARE = 0.1  # fraction of frames; rarer colours are not listed
WIDEST = 64  # pixels; wider components are scenery
OFTEN = 0.2  # components of several colours per frame; rarer combinations are not listed
MOST_MIXED = 8
USUAL_SIZES = 3  # of a colour, in its description
OUTLIERS = 0.02  # fraction of components that may be smaller or larger than an object's shape


@dataclasses.dataclass(frozen=True)
class Color:
    """The components of a colour.

    Args:
        seen: fraction of the frames that have the colour.
        most: the most components of an object's size on a frame.
        w, h: smallest and largest size of such a component; None without one.
        area: left, top, right and bottom of all of them.
        usual: the most frequent widths and heights.
        places: number of different positions.
        is_wide: whether a component is too large for an object.
    """

    index: int
    seen: float
    most: int
    w: tuple[int, int] | None
    h: tuple[int, int] | None
    area: tuple[int, int, int, int]
    usual: tuple[tuple[int, int], ...]
    places: int
    is_wide: bool

    @property
    def is_scenery(self) -> bool:
        """True if no component has the size of an object."""
        return self.w is None


@dataclasses.dataclass(frozen=True)
class Mixed:
    """Colours that touch each other.

    Args:
        count: such components per frame.
        size: their most frequent width and height.
    """

    colors: tuple[int, ...]
    count: float
    size: tuple[int, int]


def survey(screens: np.ndarray) -> list[Color]:
    """Describe the colours of frames, uint8 `[n, H, 160]`, the most frequent ones first."""
    indices = [int(c) for c in np.unique(screens) if _seen(screens, c) >= RARE]
    found = components(screens, [(c,) for c in indices])
    out = [
        _color(index, _seen(screens, index), *boxes)
        for index, boxes in zip(indices, found, strict=True)
    ]
    return sorted(out, key=lambda color: (-color.seen, color.index))


def mixed(screens: np.ndarray, colors: Iterable[Color]) -> list[Mixed]:
    """Find combinations of colours that touch each other, the most frequent ones first.

    Args:
        screens: uint8 `[n, H, 160]`, palette indices.
        colors: results of `survey`; the ones with wide components are ignored.
    """
    indices = tuple(color.index for color in colors if not color.is_wide)
    if not indices:
        return []
    (boxes,) = components(screens, [indices])
    sizes: dict[tuple[int, ...], list[tuple[int, int]]] = collections.defaultdict(list)
    for n, k in np.argwhere(boxes.valid):
        x, y, w, h = boxes.xywh[n, k]
        inside = np.unique(screens[n, y : y + h, x : x + w])
        own = tuple(int(c) for c in inside if c in indices)
        if len(own) > 1:
            sizes[own].append((int(w), int(h)))
    out = []
    for own, found in sizes.items():
        size, _ = collections.Counter(found).most_common(1)[0]
        out.append(Mixed(own, len(found) / len(screens), size))
    often = [one for one in out if one.count >= OFTEN]
    return sorted(often, key=lambda one: -one.count)[:MOST_MIXED]


class Boxes(NamedTuple):
    """The components of a set of colours: int `[n, slots, 4]` and bool `[n, slots]`."""

    xywh: np.ndarray
    valid: np.ndarray


def components(
    screens: np.ndarray, colors: Sequence[tuple[int, ...]], slots: int = SLOTS
) -> list[Boxes]:
    """The 8-connected components of each set of colours in frames, uint8 `[n, H, 160]`."""
    return [_boxes(np.isin(screens, own), slots) for own in colors]


def _boxes(masks: np.ndarray, slots: int) -> Boxes:
    """The first components of masks, bool `[n, H, 160]`, in raster order."""
    xywh = np.zeros((len(masks), slots, 4), int)
    for found, mask in zip(xywh, masks, strict=True):
        labels = np.zeros(mask.shape, np.int32)
        ndimage.label(mask, np.ones((3, 3)), output=labels)
        for box, (rows, columns) in zip(found, ndimage.find_objects(labels), strict=False):
            size = columns.stop - columns.start, rows.stop - rows.start
            box[:] = columns.start, rows.start, *size
    return Boxes(xywh, xywh[..., 2] > 0)


def _seen(screens: np.ndarray, color: int) -> float:
    return float((screens == color).any(axis=(1, 2)).mean())


def _color(index: int, seen: float, xywh: np.ndarray, valid: np.ndarray) -> Color:
    """A colour with boxes `[n, slots, 4]` of its components."""
    is_wide = bool((valid & (xywh[..., 2:] > WIDEST).any(axis=-1)).any())
    small = valid & (xywh[..., 2] <= WIDEST) & (xywh[..., 3] <= WIDEST)
    boxes = xywh[small]
    if not len(boxes):
        return Color(index, seen, 0, None, None, (0, 0, WIDTH, 0), (), 0, is_wide)
    x, y, w, h = boxes.T
    sizes = collections.Counter(zip(w.tolist(), h.tolist(), strict=True))
    area = int(x.min()), int(y.min()), int((x + w).max()), int((y + h).max())
    usual = tuple(size for size, _ in sizes.most_common(USUAL_SIZES))
    places = len(np.unique(boxes[:, :2], axis=0))
    most = int(small.sum(axis=1).max())
    return Color(index, seen, most, _range(w), _range(h), area, usual, places, is_wide)


def _range(sizes: Iterable[int]) -> tuple[int, int]:
    low, high = np.quantile(np.asarray(sizes), (OUTLIERS, 1 - OUTLIERS))
    return int(np.floor(low)), int(np.ceil(high))
