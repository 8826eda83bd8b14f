"""How a variation of a game is declared: as bytes that are written before every emulated frame."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from ocjax.console.ram import RAM_SIZE

__all__ = ["Variation"]


@dataclass(frozen=True)
class Variation:
    """A variation of a game, which is a hook.

    Args:
        game: the game's name.
        doc: what is different.
        writes: the bytes that are written, by address.
        masks: the bits that are written, by address, if not all bits of the byte are.
        copies: addresses whose bytes are written, by the address that each is written to.
        replaces: the new value of a byte by its old value, by address. Other values stay.
        when: the values of bytes with which this is written, by address. With the byte of a game's frame counter, `range(0, 256, 8)` is
            every eighth frame.
        parts: further variations of the game, with conditions of their own.

    Raises:
        ValueError: an address is not in 0 to 127, or a value or a mask not in 0 to 255.
    """

    game: str
    doc: str
    writes: Mapping[int, int] = field(default_factory=dict)
    copies: Mapping[int, int] = field(default_factory=dict)
    masks: Mapping[int, int] = field(default_factory=dict)
    replaces: Mapping[int, Mapping[int, int]] = field(default_factory=dict)
    when: Mapping[int, Collection[int]] = field(default_factory=dict)
    parts: "tuple[Variation, ...]" = ()

    def __post_init__(self) -> None:
        for name in ("writes", "copies", "masks", "replaces", "when"):
            if not all(isinstance(a, int) and 0 <= a < RAM_SIZE for a in self._addresses(name)):
                raise ValueError(f"{name} must have addresses from 0 to {RAM_SIZE - 1}, got {getattr(self, name)}")
        for name in ("writes", "masks", "replaces", "when"):
            if not all(isinstance(value, int) and 0 <= value < 256 for value in self._values(name)):
                raise ValueError(f"{name} must have values from 0 to 255, got {getattr(self, name)}")

    def _addresses(self, name: str) -> set[int]:
        return {*getattr(self, name), *(self.copies.values() if name == "copies" else ())}

    def _values(self, name: str) -> set[int]:
        values = getattr(self, name).values()
        if name == "replaces":
            return {value for new in values for value in (*new, *new.values())}
        return {value for some in values for value in some} if name == "when" else set(values)

    def __call__(self, ram: np.ndarray) -> None:
        """Write to the RAM of one environment, uint8 `[128]`."""
        if all(int(ram[address]) in values for address, values in self.when.items()):
            for address, value in self.writes.items():
                mask = self.masks.get(address, 255)
                ram[address] = ram[address] & (255 - mask) | value & mask
            for address, source in self.copies.items():
                ram[address] = ram[source]
            for address, new in self.replaces.items():
                ram[address] = new.get(int(ram[address]), ram[address])
        for part in self.parts:
            part(ram)
