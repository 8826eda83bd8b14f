"""Variations of games as writes to RAM, after those of HackAtari (Delfosse et al., 2024).

    ocjax.make_vec("Pong", 64, hook=variations.lazy_enemy)

A variation is a hook: it writes its bytes before every emulated frame. Several are combined by `hook=[...]`. The addresses are those of
HackAtari and of the games' decoders in `extractors/`, and the tests check the effect of each on the screen. The names are HackAtari's where
the effect is the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ocjax.console.ram import RAM_SIZE

__all__ = [
    "ALL",
    "Variation",
    "always_lower_player",
    "color_all_blocks_red",
    "color_player_black",
    "disable_monkeys",
    "invisible_player",
    "lazy_enemy",
    "no_alien",
    "no_barrel",
    "no_shields",
    "obelix",
    "parallel_enemy",
    "red_river",
    "relocate_shields_right",
    "reposition_floes_easy",
    "stopped_cars",
]


@dataclass(frozen=True)
class Variation:
    """A variation of a game, which is a hook.

    Args:
        game: the game's name.
        doc: what is different.
        writes: the bytes that are written, by address.
        masks: the bits that are written, by address, if not all bits of the byte are.
        copies: addresses whose bytes are written, by the address that each is written to.

    Raises:
        ValueError: an address is not in 0 to 127, or a value or a mask not in 0 to 255.
    """

    game: str
    doc: str
    writes: Mapping[int, int] = field(default_factory=dict)
    copies: Mapping[int, int] = field(default_factory=dict)
    masks: Mapping[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, addresses in (("writes", self.writes), ("copies", {*self.copies, *self.copies.values()}), ("masks", self.masks)):
            if not all(isinstance(a, int) and 0 <= a < RAM_SIZE for a in addresses):
                raise ValueError(f"{name} must have addresses from 0 to {RAM_SIZE - 1}, got {getattr(self, name)}")
        for name, values in (("writes", self.writes), ("masks", self.masks)):
            if not all(isinstance(value, int) and 0 <= value < 256 for value in values.values()):
                raise ValueError(f"{name} must have values from 0 to 255, got {values}")

    def __call__(self, ram: np.ndarray) -> None:
        """Write to the RAM of one environment, uint8 `[128]`."""
        for address, value in self.writes.items():
            mask = self.masks.get(address, 255)
            ram[address] = ram[address] & (255 - mask) | value & mask
        for address, source in self.copies.items():
            ram[address] = ram[source]


def _all(addresses: range, value: int) -> dict[int, int]:
    return dict.fromkeys(addresses, value)


_BLACK, _RED = 0, 48  # colours of the console

no_alien = Variation("Alien", "There are no aliens in the maze.", _all(range(42, 45), 0) | _all(range(49, 52), 0))
obelix = Variation("Asterix", "The player is Obelix, as in a later round.", {54: 5})
color_player_black = Variation("Boxing", "The player is black, like the enemy.", {1: _BLACK})
color_all_blocks_red = Variation("Breakout", "All blocks are red.", _all(range(64, 70), _RED))
invisible_player = Variation("ChopperCommand", "The player's helicopter is not drawn, and the score is darker.", {118: 38})
no_barrel = Variation("DonkeyKong", "There are no barrels.", {25: 255})
stopped_cars = Variation(
    "Freeway",
    "The cars stand still on a diagonal, each further to the right than the car in the lane above.",
    dict(zip(range(108, 118), range(150, 10, -14), strict=True)) | _all(range(33, 43), 2),  # positions from the bottom, frames to wait
)
reposition_floes_easy = Variation("Frostbite", "The floes stand still, below each other.", {22: 0} | _all(range(31, 35), 80))
disable_monkeys = Variation("Kangaroo", "There are no monkeys.", _all(range(8, 12), 127))
lazy_enemy = Variation("Pong", "The enemy stays in the middle of the court.", {21: 127})  # the position that it moves to
parallel_enemy = Variation("Pong", "The enemy is at the player's height.", copies={21: 60})
red_river = Variation("Riverraid", "The river is red.", {13: 255})
no_shields = Variation("SpaceInvaders", "The cannon has no shields.", _all(range(43, 70), 0))
relocate_shields_right = Variation("SpaceInvaders", "The shields are further to the right.", {27: 53})
always_lower_player = Variation("Tennis", "The player plays in the lower half of the court in all games.", {80: 1})

ALL: Mapping[str, Variation] = {name: value for name, value in list(globals().items()) if isinstance(value, Variation)}
"""Every variation by its name."""
