"""The state labels of AtariARI for batches of RAM.

Source: Anand et al., "Unsupervised State Representation Learning in Atari", 2019. A label is a
named byte of the RAM in the game's own coding: `player_x` of Pong is not a position in pixels
(`Game.rem` gives those). Names and bytes come from AtariARI's `ram_annotations.py`.
"""

import functools
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.arrays import require_uint8
from ocjax.extraction.game import Game
from ocjax.extraction.registry import as_game

__all__ = ["addresses", "games", "labels"]

# AtariARI's code labels two more games than its paper.
_NOT_IN_PAPER = ("BattleZone", "Skiing")


@functools.cache
def addresses() -> Mapping[str, Mapping[str, int]]:
    """The byte of each label, by game, for all 24 games in AtariARI's code."""
    return json.loads(resources.files("ocjax").joinpath("atariari.json").read_text())


@functools.cache
def games() -> tuple[str, ...]:
    """The 22 games of AtariARI's paper, by the names of `ocjax.games`."""
    return tuple(name for name in addresses() if name not in _NOT_IN_PAPER)


def labels(game: Game | str, ram: Any) -> dict[str, Any]:
    """AtariARI's labels of RAM.

    Args:
        game: the game, or its name: one of `games`, "BattleZone" or "Skiing".
        ram: uint8 `[..., 128]`, a NumPy or JAX array.

    Returns:
        The value of each label by its name in AtariARI, uint8 `[...]`, of the type of `ram`.

    Raises:
        ValueError: AtariARI has no labels for the game, or the last dimension of `ram` is not 128.
        TypeError: `ram` is not uint8.
    """
    name = as_game(game).name
    if name not in addresses():
        raise ValueError(f"AtariARI has no labels for {name}; it labels {', '.join(addresses())}")
    require_uint8("ram", ram)
    if ram.ndim == 0 or ram.shape[-1] != RAM_SIZE:
        raise ValueError(f"ram must have shape [..., {RAM_SIZE}], got {list(ram.shape)}")
    return {label: ram[..., address] for label, address in addresses()[name].items()}
