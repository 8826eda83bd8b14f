"""Variations by object: remove, freeze or recolour a category.

They write the bytes that `ocjax ram control` has confirmed.
"""

import functools
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

from ocjax.emulators.variations.mechanism import Variation
from ocjax.extraction.registry import load

__all__ = ["COLORS", "by_name", "freeze", "names", "recolor", "remove"]

COLORS: Mapping[str, int] = {"black": 0x00, "white": 0x0C, "red": 0x30, "blue": 0x70, "green": 0xC8}
"""Colours by name, as palette indices of NTSC consoles."""

_DOCS = {
    "remove": "The screen shows no {0}.",
    "freeze": "Each {0} stays where it is written to.",
    "recolor": "Each {0} has another colour{1}.",
}


@functools.cache
def _controls() -> dict[str, dict[str, dict[str, Any]]]:
    """The confirmed bytes, by game, kind and category.

    `bytes` has the values by address, and `also` the other categories that are recoloured.
    """
    return json.loads(
        resources.files("ocjax.emulators.variations").joinpath("objects.json").read_text()
    )


def names(game: str) -> tuple[str, ...]:
    """The names of a game's variations by object, such as "remove Enemy" and "recolor Player".

    Raises:
        UnknownGameError: the game is unknown; a ValueError.
    """
    return tuple(
        f"{kind} {category}"
        for kind, some in _controls().get(load(game).name, {}).items()
        for category in some
    )


def remove(game: str, category: str) -> Variation:
    """The variation without a category's objects on the screen.

    Only the screen is certain to lack them. In some games, removed objects still exist, move and
    collide, and REM still reports them; the page "Other projects" lists these.

    Raises:
        ValueError: no bytes are known for it, or the game or category is unknown.
    """
    return _variation("remove", game, category)


def freeze(game: str, category: str) -> Variation:
    """The variation with a category's objects at fixed positions; see `remove`."""
    return _variation("freeze", game, category)


def recolor(game: str, category: str, color: int | str) -> Variation:
    """The variation with another colour of a category's objects; see `remove`.

    Args:
        color: a palette index from 0 to 255, or one of `COLORS`.

    Raises:
        ValueError: no bytes are known for it, or the game, category or colour is unknown.
    """
    index = COLORS.get(color, -1) if isinstance(color, str) else color
    if not 0 <= index < 256:
        raise ValueError(
            f"the colour must be a palette index from 0 to 255, or one of {', '.join(COLORS)}, "
            f"got {color!r}"
        )
    return _variation("recolor", game, category, index)


def _variation(kind: str, game: str, category: str, color: int | None = None) -> Variation:
    declared = load(game)
    if category not in declared.slices:
        raise ValueError(
            f"{declared.name} has no category {category!r}; it has {declared.suggestion(category)}"
        )
    known = _controls().get(declared.name, {}).get(kind, {})
    if category not in known:
        others = ", ".join(names(declared.name)) or "nothing"
        raise ValueError(
            f"{declared.name}: no bytes are known that {kind} {category}; known: {others}"
        )
    control = known[category]
    writes = {
        int(address): value if color is None else color
        for address, value in control["bytes"].items()
    }
    also = f", as well as {' and '.join(control['also'])}" if control["also"] else ""
    return Variation(declared.name, _DOCS[kind].format(category, also), writes)


def by_name(game: str, name: str) -> Variation | None:
    """The variation with a name such as "remove Enemy"; None for other names."""
    kind, _, rest = name.partition(" ")
    if kind == "recolor" and rest:
        category, _, color = rest.rpartition(" ")
        return recolor(game, category, int(color) if color.isdecimal() else color)
    return (
        {"remove": remove, "freeze": freeze}[kind](game, rest)
        if kind in ("remove", "freeze") and rest
        else None
    )
