"""The objects of one state as Python objects with OCAtari's attributes and methods."""

import dataclasses
import enum
import functools
from collections.abc import Sequence
from typing import Any, ClassVar

import jax
import numpy as np

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

__all__ = [
    "NS_MEANING",
    "ORIENTATION",
    "POSITION",
    "WIDTH",
    "GameObject",
    "NoObject",
    "Orientation",
    "ValueObject",
    "object_class",
    "slots",
    "views",
]

POSITION, ORIENTATION, WIDTH = "POSITION", "ORIENTATION", "WIDTH"
_SAME = 0.8  # two objects with a larger IoU are equivalent
_PROPERTIES = (
    "hud",
    "category",
    "x",
    "y",
    "w",
    "h",
    "prev_x",
    "prev_y",
    "dx",
    "dy",
    "visible",
    "rgb",
    "orientation",
    "center",
    "value",
)

# Entries of categories in OCAtari 2.2.1's ns_state, except categories with only a position.
NS_MEANING: dict[tuple[str, str], tuple[str, ...]] = {
    ("Asteroids", "Player"): (POSITION, ORIENTATION),
    ("Seaquest", "OxygenBar"): (WIDTH,),
    ("Skiing", "Player"): (POSITION, ORIENTATION),
}
_NS_TYPES: dict[str, Any] = {POSITION: tuple[int, int], ORIENTATION: tuple[int], WIDTH: tuple[int]}


class Orientation(enum.IntEnum):
    """Compass points, clockwise from north."""

    N, NNE, NE, ENE, E, ESE, SE, SSE, S, SSW, SW, WSW, W, WNW, NW, NNW = range(16)


@dataclasses.dataclass
class GameObject:
    """One object of one state, with its position one step before, for code written for OCAtari.

    The class of an object is a subclass with the name of its category. Its attributes are those of
    OCAtari 2.2.1's objects, and the keys of the dicts of `Objects.to_list`. Assigning to them
    changes only this object.

    Args:
        slot: number of the slot within the category.
        x, y, w, h: left, top, width and height in pixels.
        rgb: colour.
        hud: whether it belongs to the HUD (score, lives, ...).
        prev_xy: top left corner one step before; the current one if the slot was empty then.
        value: score, lives, time, ... or None if the category has none or VEM cannot read it.
        prev_value: the value one step before; the current one if the slot was empty then.
        orientation: compass point, or None as for values.
        visible: False only for the `NoObject` of an empty slot.
    """

    ns_meaning: ClassVar[tuple[str, ...]] = (POSITION,)

    slot: int = 0
    x: int = 0
    y: int = 0
    w: int = 0
    h: int = 0
    rgb: tuple[int, int, int] = (0, 0, 0)
    hud: bool = False
    prev_xy: tuple[int, int] = (0, 0)
    value: int | None = None
    prev_value: int | None = None
    orientation: Orientation | None = None
    visible: bool = True

    def __repr__(self) -> str:
        return f"{self.category} at {self.xy}, {self.wh}"

    def __bool__(self) -> bool:
        return self.visible

    def __reduce__(self) -> Any:
        return _restore, (type(self).__bases__[0], self.category, self.ns_meaning, vars(self))

    @property
    def category(self) -> str:
        """Name of the category."""
        return type(self).__name__

    @property
    def xy(self) -> tuple[int, int]:
        """Top left corner."""
        return self.x, self.y

    @xy.setter
    def xy(self, xy: Sequence[int]) -> None:
        self.x, self.y = xy

    @property
    def wh(self) -> tuple[int, int]:
        """Width and height."""
        return self.w, self.h

    @wh.setter
    def wh(self, wh: Sequence[int]) -> None:
        self.w, self.h = wh

    @property
    def xywh(self) -> tuple[int, int, int, int]:
        """Left, top, width and height."""
        return self.x, self.y, self.w, self.h

    @xywh.setter
    def xywh(self, xywh: Sequence[int]) -> None:
        self.x, self.y, self.w, self.h = xywh

    @property
    def center(self) -> tuple[float, float]:
        """Centre."""
        return self.x + self.w / 2, self.y + self.h / 2

    @property
    def prev_x(self) -> int:
        """Left edge one step before."""
        return self.prev_xy[0]

    @property
    def prev_y(self) -> int:
        """Top edge one step before."""
        return self.prev_xy[1]

    @property
    def dx(self) -> int:
        """Movement to the right since the step before, in pixels."""
        return self.x - self.prev_xy[0]

    @property
    def dy(self) -> int:
        """Downward movement since the step before, in pixels."""
        return self.y - self.prev_xy[1]

    @property
    def h_coords(self) -> list[tuple[int, int]]:
        """Top left corners now and one step before."""
        return [self.xy, self.prev_xy]

    @property
    def value_diff(self) -> int:
        """Change of the value since the step before; 0 if the category has no value."""
        return 0 if self.value is None or self.prev_value is None else self.value - self.prev_value

    @property
    def nsrepr(self) -> list[int]:
        """The object's entries of `OCAtari.ns_state`; zeros if not visible.

        `ns_meaning` selects position, orientation or width.
        """
        if self.visible and self.ns_meaning == (POSITION,):  # nearly always
            return [self.x, self.y]
        parts = {POSITION: [self.x, self.y], ORIENTATION: [self.orientation or 0], WIDTH: [self.w]}
        return [
            int(number) * self.visible for meaning in self.ns_meaning for number in parts[meaning]
        ]

    @property
    def ns_types(self) -> list[Any]:
        """The types of the entries of `nsrepr`, by meaning."""
        return [_NS_TYPES[meaning] for meaning in self.ns_meaning]

    @property
    def _nsrepr(self) -> list[int]:
        return self.nsrepr

    @property
    def _ns_meaning(self) -> list[str]:
        return list(self.ns_meaning)

    @property
    def _ns_types(self) -> list[Any]:
        return self.ns_types

    @property
    def _nslen(self) -> int:
        return len(self.nsrepr)

    @property
    def properties(self) -> list[str]:
        """The names of the attributes that describe the object."""
        return [*_PROPERTIES]

    def is_on_top(self, other: "GameObject") -> bool:
        """True if the top left corner lies in the other object's box, including its edges."""
        return other.x <= self.x <= other.x + other.w and other.y <= self.y <= other.y + other.h

    def manhattan_distance(self, other: "GameObject") -> float:
        """Manhattan distance of the centres, in pixels."""
        (x, y), (other_x, other_y) = self.center, other.center
        return abs(x - other_x) + abs(y - other_y)

    manathan_distance = manhattan_distance  # OCAtari's spelling

    def closest_object(self, others: Sequence["GameObject"]) -> tuple[int, "GameObject"] | None:
        """The index and the object with the closest centre by Manhattan distance, or None."""
        return min(
            enumerate(others), key=lambda item: self.manhattan_distance(item[1]), default=None
        )

    def iou(self, other: "GameObject") -> float:
        """Intersection over union of the boxes; 1 for two empty slots."""
        if not self.visible and not other.visible:
            return 1.0
        width = max(0, min(self.x + self.w, other.x + other.w) - max(self.x, other.x))
        height = max(0, min(self.y + self.h, other.y + other.h) - max(self.y, other.y))
        union = self.w * self.h + other.w * other.h - width * height
        return width * height / union if union else 0.0

    def _is_equivalent(self, other: "GameObject") -> bool:
        return self.category == other.category and self.iou(other) > _SAME


class ValueObject(GameObject):
    """An object with a value, such as a score."""


class NoObject(GameObject):
    """An empty slot: false, and zero in all attributes.

    Args:
        nslen: number of its zeros in `OCAtari.ns_state`.
    """

    def __init__(self, nslen: int = 2) -> None:
        super().__init__(visible=False)
        self.nslen = nslen

    def __repr__(self) -> str:
        return "NaO"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, NoObject)

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __reduce__(self) -> Any:
        return NoObject, (self.nslen,)

    @property
    def nsrepr(self) -> list[int]:
        """Zeros."""
        return [0] * self.nslen


@functools.cache
def _subclass(
    base: type[GameObject], category: str, ns_meaning: tuple[str, ...]
) -> type[GameObject]:
    return type(category, (base,), {"ns_meaning": ns_meaning, "__doc__": f"{category}."})


def _restore(
    base: type[GameObject], category: str, ns_meaning: tuple[str, ...], attributes: dict[str, Any]
) -> GameObject:
    return _subclass(base, category, ns_meaning)(**attributes)


def object_class(game: Declaration, category: str) -> type[GameObject]:
    """The class of the objects of a category, which the game need not have, or of an alias."""
    valued = any(
        category in (c.name, *c.aliases) and "value" in c.attributes for c in game.categories
    )
    return _subclass(
        ValueObject if valued else GameObject,
        category,
        NS_MEANING.get((game.name, category), (POSITION,)),
    )


@functools.cache
def _slot_constants(game: Declaration) -> list[tuple[type[GameObject], int, bool, bool, bool, int]]:
    """Per slot: class, number, HUD, has a value, has an orientation, length of `nsrepr`."""
    out = []
    for c in game.categories:
        kind = object_class(game, c.name)
        has = "value" in c.attributes, "orientation" in c.attributes
        out += [(kind, number, c.hud, *has, len(kind().nsrepr)) for number in range(c.count)]
    return out


def slots(objects: Objects, before: Objects | None = None) -> list[GameObject]:
    """The objects of one state, one for each slot, with a `NoObject` in empty slots.

    Args:
        before: objects of the step before; None in the first state of an episode.
    """
    now, old = (
        [np.asarray(a).tolist() for a in jax.tree.leaves(o)]
        for o in (objects, objects if before is None else before)
    )
    out: list[GameObject] = []
    for slot, (kind, number, hud, valued, oriented, length) in enumerate(
        _slot_constants(whose(objects))
    ):
        (x, y, w, h), valid, orientation, value, rgb = (column[slot] for column in now)
        if not valid:
            out.append(NoObject(length))
            continue
        previous = old if old[1][slot] else now
        value, old_value = (
            v if valued and v != UNKNOWN_VALUE else None for v in (value, previous[3][slot])
        )
        compass = Orientation(orientation) if oriented and orientation != UNKNOWN else None
        out.append(
            kind(
                number,
                x,
                y,
                w,
                h,
                tuple(rgb),
                hud,
                tuple(previous[0][slot][:2]),
                value,
                old_value,
                compass,
            )
        )
    return out


def views(objects: Objects, before: Objects | None = None) -> list[GameObject]:
    """The valid objects of one state in slot order; arguments and errors as in `slots`."""
    return [o for o in slots(objects, before) if o]
