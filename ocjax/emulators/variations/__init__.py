"""Variations of games as writes to RAM, after HackAtari (Delfosse et al., 2024).

    ocjax.make_vec("Pong", 64, hook="lazy_enemy")
    ocjax.make_vec("Pong", 64, hook=["Pong:lazy_enemy", my_function])

A variation is a hook: it writes its bytes before every emulated frame. `hook=[...]` combines
several. Addresses and values come from HackAtari 0.0.6 and from the games' decoders; the tests
check every effect on the screen. Variations with HackAtari's effect have its name. HackAtari's
changes in every fifth, sixth or tenth frame happen here in every fourth or eighth frame of the
game's own counter.

Names also remove, freeze and recolour categories of objects: `hook="Pong:remove Enemy"`,
`hook="Boxing:recolor Player red"`, or `hook=variations.freeze("Freeway", "Car")`.
`variations.names(game)` lists them.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from ocjax.emulators.variations.games import GAMES
from ocjax.emulators.variations.mechanism import Variation
from ocjax.emulators.variations.objects import by_name, freeze, names, recolor, remove
from ocjax.extraction.names import did_you_mean
from ocjax.extraction.registry import load

__all__ = [
    "ALL",
    "Variation",
    "find",
    "freeze",
    "names",
    "of",
    "recolor",
    "remove",
]

_GAMES = {
    game: {name: replace(v, name=name) for name, v in some.items()} for game, some in GAMES.items()
}

ALL: Mapping[str, Variation] = MappingProxyType(
    {f"{game}:{name}": v for game, some in _GAMES.items() for name, v in some.items()}
)
"""All variations by game and name, such as "Freeway:stop_all_cars"."""


def of(game: str) -> Mapping[str, Variation]:
    """The variations of a game by name; empty if it has none.

    Raises:
        UnknownGameError: the game is unknown; a ValueError.
    """
    return MappingProxyType(_GAMES.get(load(game).name, {}))


def find(name: str, game: str | None = None) -> Variation:
    """A variation by name.

    Args:
        name: the game and the name, "Freeway:stop_all_cars", or the name alone. Names can also
            change a category: "Freeway:freeze Car", "Pong:remove Enemy", "Boxing:recolor Player
            red".
        game: the game, if it is not in the name.

    Raises:
        ValueError: the variation is unknown; the message lists the game's variations.
    """
    before, colon, own = name.rpartition(":")
    if not colon and game is None:
        raise ValueError(
            "the name of a variation must have a game, such as 'Freeway:stop_all_cars', got "
            f"{name!r}"
        )
    title = load(before if colon else str(game)).name
    if (variation := by_name(title, own)) is not None:
        return variation
    known = of(title)
    if own in known:
        return known[own]
    names = ", ".join(sorted(known)) or "none"
    raise ValueError(f"{title} has no variation {own!r}; it has {names}{did_you_mean(own, known)}")
