"""How a variation of a game is declared: as bytes that are written before every emulated frame."""

import hashlib
import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ocjax.console.ram import RAM_SIZE

__all__ = ["Moment", "Variation"]


class Moment(NamedTuple):
    """What the emulator knows besides the RAM before a frame; saved states have it."""

    # the RAM before the last frame, as the hooks left it; at the beginning of a game, the present
    # RAM
    before: np.ndarray
    seed: int  # of the environment
    frame: int  # emulated frames since the ROM was loaded
    game_frame: int  # emulated frames of the game


def _numbers(ram: np.ndarray, moment: Moment, name: str) -> Iterator[int]:
    """Random numbers that depend on the state of the emulator alone."""
    state = b"".join([ram.tobytes(), repr(moment[1:]).encode(), name.encode()])
    for i in itertools.count():
        yield int.from_bytes(
            hashlib.blake2b(state + i.to_bytes(4, "little"), digest_size=8).digest(), "little"
        )


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
        keeps: addresses of bytes that are written as they were before the last frame.
        draws: the values of which a random one is written in every frame, by address.
        choices: further variations of the game, of which a random one is written in every frame.
            One that is given twice is twice as likely.
        when: the values of bytes with which this is written, by address. With the byte of a game's
            frame counter, `range(0, 256, 8)` is every eighth frame.
        before: the values of bytes before the last frame with which this is written, by address.
        changed: addresses of bytes that must have changed since before the last frame.
        frames: the emulated frames of a game, counted from 0, in which this is written. None stands
            for all.
        parts: further variations of the game, with conditions of their own.

    Raises:
        ValueError: an address is not in 0 to 127, or a value or a mask not in 0 to 255, or there is
            nothing to draw from.

    Random numbers are a hash of the RAM, the frame and the seed. Saved states have these and the
    RAM before the last frame, so that a restored state continues identically.
    """

    takes_moment: ClassVar[bool] = True  # tells the emulator to pass the moment
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
            if not all(isinstance(a, int) and 0 <= a < RAM_SIZE for a in self._addresses(name)):
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

    def _addresses(self, name: str) -> set[int]:
        return {*getattr(self, name), *(self.copies.values() if name == "copies" else ())}

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
            ram: the RAM.
            moment: the fields of a `Moment`; None stands for the beginning of the first game of an
                environment with seed 0.
        """
        now = Moment(ram.copy(), 0, 0, 0) if moment is None else Moment(*moment)
        self._apply(ram, now, _numbers(ram.copy(), now, self.doc))

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
        """Write what is not random."""
        for address, value in self.writes.items():
            mask = self.masks.get(address, 255)
            ram[address] = ram[address] & (255 - mask) | value & mask
        for address, source in self.copies.items():
            ram[address] = ram[source]
        for address in self.keeps:
            ram[address] = before[address]
        for address, new in self.replaces.items():
            ram[address] = new.get(int(ram[address]), ram[address])
