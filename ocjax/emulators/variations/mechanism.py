"""The declaration of a variation: bytes that are written before every emulated frame."""

import hashlib
import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ocjax.console.ram import RAM_SIZE

__all__ = ["Moment", "Variation"]


class Moment(NamedTuple):
    """The emulator's state besides the RAM before a frame; saved states contain it."""

    # The RAM before the last frame, after the hooks' edits; the current RAM at the start of a game.
    before: np.ndarray
    seed: int  # the environment's seed
    frame: int  # emulated frames since the ROM was loaded
    game_frame: int  # emulated frames of the game


def _numbers(ram: np.ndarray, moment: Moment, name: str) -> Iterator[int]:
    """Random numbers that depend only on the emulator's state."""
    state = b"".join([ram.tobytes(), repr(moment[1:]).encode(), name.encode()])
    for i in itertools.count():
        yield int.from_bytes(
            hashlib.blake2b(state + i.to_bytes(4, "little"), digest_size=8).digest(), "little"
        )


@dataclass(frozen=True)
class Variation:
    """A variation of a game, which is a hook.

    All mappings have addresses as keys. Random numbers are a hash of the RAM, the frame, the seed
    and the variation's name, so a restored state continues identically.

    Args:
        game: the game's name.
        doc: a description of the difference.
        writes: the byte to write.
        masks: the bits to write, if not all bits of the byte.
        copies: the address to copy a byte from.
        replaces: the new values of a byte by its old values. Other values stay.
        keeps: addresses of bytes that keep their value from before the last frame.
        draws: the values to choose from, at random in every frame.
        choices: further variations of the game. A random one is written in every frame; a variation
            that is given twice is twice as likely.
        when: the values of bytes that enable this variation. With the byte of a game's frame
            counter, `range(0, 256, 8)` enables it in every eighth frame.
        before: the values of bytes before the last frame that enable this variation.
        changed: addresses of bytes that must have changed since before the last frame.
        frames: the emulated frames of a game, from 0, that enable this variation; all by default.
        parts: further variations of the game with separate conditions.
        name: the name in `ALL` without the game; it seeds the random numbers.

    Raises:
        ValueError: an address is not from 0 to 127, a value or a mask is not from 0 to 255, or an
            address of `draws` has no values.
    """

    takes_moment: ClassVar[bool] = True  # requests the moment from the emulator
    game: str
    doc: str
    writes: Mapping[int, int] = field(default_factory=dict)
    copies: Mapping[int, int] = field(default_factory=dict)
    masks: Mapping[int, int] = field(default_factory=dict)
    replaces: Mapping[int, Mapping[int, int]] = field(default_factory=dict)
    keeps: Collection[int] = ()
    draws: Mapping[int, Sequence[int]] = field(default_factory=dict)
    choices: "tuple[Variation, ...]" = ()
    when: Mapping[int, Collection[int]] = field(default_factory=dict)
    before: Mapping[int, Collection[int]] = field(default_factory=dict)
    changed: Collection[int] = ()
    frames: range | None = None
    parts: "tuple[Variation, ...]" = ()
    name: str = ""

    def __post_init__(self) -> None:
        for name in (
            "writes",
            "copies",
            "masks",
            "replaces",
            "keeps",
            "draws",
            "when",
            "before",
            "changed",
        ):
            addresses = {*getattr(self, name), *(self.copies.values() if name == "copies" else ())}
            if not all(isinstance(a, int) and 0 <= a < RAM_SIZE for a in addresses):
                raise ValueError(
                    f"{name} must have addresses from 0 to {RAM_SIZE - 1}, got "
                    f"{getattr(self, name)}"
                )
        for name in ("writes", "masks", "replaces", "draws", "when", "before"):
            if not all(isinstance(value, int) and 0 <= value < 256 for value in self._values(name)):
                raise ValueError(
                    f"{name} must have values from 0 to 255, got {getattr(self, name)}"
                )
        if not all(self.draws.values()):
            raise ValueError(f"draws must have values for each address, got {self.draws}")

    def _values(self, name: str) -> set[int]:
        values = getattr(self, name).values()
        if name == "replaces":
            return {value for new in values for value in (*new, *new.values())}
        return (
            {value for some in values for value in some}
            if name in ("draws", "when", "before")
            else set(values)
        )

    def __call__(self, ram: np.ndarray, moment: Sequence[Any] | None = None) -> None:
        """Write to the RAM of one environment, uint8 `[128]`.

        Args:
            moment: the fields of a `Moment`; by default the first game's start with seed 0.
        """
        now = Moment(ram.copy(), 0, 0, 0) if moment is None else Moment(*moment)
        self._apply(ram, now, _numbers(ram.copy(), now, self.name))

    def _apply(self, ram: np.ndarray, moment: Moment, numbers: Iterator[int]) -> None:
        if self._is_due(ram, moment):
            self._write(ram, moment.before)
            for address, values in self.draws.items():
                ram[address] = values[next(numbers) % len(values)]
            if self.choices:
                self.choices[next(numbers) % len(self.choices)]._apply(ram, moment, numbers)
        for part in self.parts:
            part._apply(ram, moment, numbers)

    def _is_due(self, ram: np.ndarray, moment: Moment) -> bool:
        return (
            (self.frames is None or moment.game_frame in self.frames)
            and all(int(ram[address]) in values for address, values in self.when.items())
            and all(
                int(moment.before[address]) in values for address, values in self.before.items()
            )
            and all(ram[address] != moment.before[address] for address in self.changed)
        )

    def _write(self, ram: np.ndarray, before: np.ndarray) -> None:
        """Apply the changes that are not random."""
        for address, value in self.writes.items():
            mask = self.masks.get(address, 255)
            ram[address] = ram[address] & (255 - mask) | value & mask
        for address, source in self.copies.items():
            ram[address] = ram[source]
        for address in self.keeps:
            ram[address] = before[address]
        for address, new in self.replaces.items():
            ram[address] = new.get(int(ram[address]), ram[address])
