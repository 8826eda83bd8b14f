"""Named, typed views of the console's 128 bytes of RAM.

A game declares its address map once, as a class:

    class Ram(RamMap):
        chicken_y = byte(14, 15)             # two bytes -> int32 [2]
        score = bcd((103, 104))              # one number of four digits, most significant byte
        first
        paddle_low = bits(51, count=1)       # the lowest bit of byte 51
        plays = flag(23, bit=7)              # True if the highest bit of byte 23 is set

The game's decoder then reads `m.chicken_y`. Numbers are cast to int32 because uint8 arithmetic
wraps around (`uint8(30) - 49` is 237). A place is an address from 0 to 127, or a tuple of addresses
that together hold one number, most significant byte first. A field with one place is a scalar. A
field with several places is a vector in the given order.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Self, overload

import jax
import jax.numpy as jnp
from jax import lax

__all__ = [
    "RAM_SIZE",
    "Field",
    "Place",
    "RamMap",
    "bcd",
    "bits",
    "byte",
    "flag",
    "high",
    "low",
    "signed",
]

RAM_SIZE = 128

Place = int | tuple[int, ...]
_Read = Callable[[tuple[jax.Array, ...]], jax.Array]


@dataclass(frozen=True)
class Field:
    """An entry of an address map: its addresses, and the conversion of bytes to a number.

    A place of several bytes has its most significant byte first.
    """

    places: tuple[tuple[int, ...], ...]
    meaning: str
    read: _Read = field(repr=False)
    name: str = ""

    def __post_init__(self) -> None:
        if len({len(place) for place in self.places}) != 1 or not self.places[0]:
            raise ValueError(
                "a RAM field needs one or more places of the same number of bytes each, got "
                f"{self.places}"
            )
        for address in self.addresses:
            if not (isinstance(address, int) and 0 <= address < RAM_SIZE):
                raise ValueError(
                    f"a RAM address must be an int from 0 to {RAM_SIZE - 1}, got {address!r}"
                )

    @property
    def addresses(self) -> tuple[int, ...]:
        """All addresses that the field reads."""
        return tuple(address for place in self.places for address in place)

    @property
    def columns(self) -> tuple[tuple[int, ...], ...]:
        """The addresses of all places' first bytes, of all their second bytes, ..."""
        return tuple(zip(*self.places, strict=True))

    def labelled(self) -> Iterator[tuple[str, tuple[int, ...]]]:
        """The label of each number, such as "score" or "car_x[3]", and its addresses."""
        for i, place in enumerate(self.places):
            yield f"{self.name}[{i}]" if len(self.places) > 1 else self.name, place

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: "RamMap", owner: type) -> jax.Array: ...
    def __get__(self, instance: "RamMap | None", owner: type) -> "Self | jax.Array":
        return self if instance is None else instance.value_of(self)


class RamMap:
    """Base class of a game's address map. An instance wraps the RAM of one state, uint8 `[128]`.

    Args:
        addresses: the address of each byte of `ram`; by default all in order.
    """

    def __init__(self, ram: jax.Array, addresses: Sequence[int] = range(RAM_SIZE)) -> None:
        self._ram = ram
        self._index = {address: i for i, address in enumerate(addresses)}
        self._values: dict[str, jax.Array] = {}

    def value_of(self, declared: Field) -> jax.Array:
        """Return the value or values of a declared field: a scalar or `[places]`.

        Flags are bool, all other fields int32.
        """
        if declared.name not in self._values:
            value = declared.read(tuple(self._gather(column) for column in declared.columns))
            self._values[declared.name] = value if len(declared.places) > 1 else value[0]
        return self._values[declared.name]

    def _gather(self, addresses: tuple[int, ...]) -> jax.Array:
        """Read bytes at static addresses, int32 `[len(addresses)]`.

        Slices cost far less than a gather.
        """
        at, parts, i = [self._index[a] for a in addresses], [], 0
        while i < len(at):
            step = at[i + 1] - at[i] if i + 1 < len(at) else 1
            j = i + 1
            while j < len(at) and step and at[j] - at[j - 1] == step:
                j += 1
            low, high = min(at[i], at[j - 1]), max(at[i], at[j - 1])
            run = lax.slice(self._ram, (low,), (high + 1,), (abs(step) if j - i > 1 else 1,))
            parts.append(lax.rev(run, (0,)) if j - i > 1 and step < 0 else run)
            i = j
        return (parts[0] if len(parts) == 1 else jnp.concatenate(parts)).astype(jnp.int32)

    @classmethod
    def addresses(cls) -> tuple[int, ...]:
        """All addresses that the declared fields read, each once, in the order of reading."""
        return tuple(
            dict.fromkeys(a for f in cls.fields().values() for column in f.columns for a in column)
        )

    @classmethod
    def fields(cls) -> dict[str, Field]:
        """The declared fields by name, in order of declaration."""
        return {
            k: v
            for base in reversed(cls.__mro__)
            for k, v in vars(base).items()
            if isinstance(v, Field)
        }


def _field(places: tuple[Place, ...], meaning: str, read: _Read) -> Field:
    return Field(tuple(p if isinstance(p, tuple) else (p,) for p in places), meaning, read)


def _join(parts: tuple[jax.Array, ...], base: int) -> jax.Array:
    total = parts[0]
    for part in parts[1:]:
        total = total * base + part
    return total


def byte(*places: Place) -> Field:
    """Declare unsigned bytes 0-255.

    A tuple of addresses is one unsigned number, most significant byte first.
    """
    return _field(places, "unsigned", lambda parts: _join(parts, 256))


def signed(*places: Place) -> Field:
    """Declare signed numbers in two's complement, with the number of bytes of each place."""

    def read(parts: tuple[jax.Array, ...]) -> jax.Array:
        half = 1 << (8 * len(parts) - 1)
        return (_join(parts, 256) ^ half) - half

    return _field(places, "signed", read)


def bits(*places: Place, first: int = 0, count: int = 1) -> Field:
    """Declare a field of `count` bits from bit `first` on (0 is the least significant bit)."""
    if not (first >= 0 and count > 0):
        raise ValueError(
            f"a bit field needs first >= 0 and count > 0, got first={first}, count={count}"
        )
    mask = (1 << count) - 1
    name = f"bits {first}-{first + count - 1}"
    declared = _field(places, name, lambda parts: (_join(parts, 256) >> first) & mask)
    there = 8 * len(declared.places[0])
    if first + count > there:
        raise ValueError(
            f"a bit field must end within its {there} bits, got first={first}, count={count}"
        )
    return declared


def flag(*places: int, bit: int) -> Field:
    """Declare a condition: True if a bit (0 is the least significant) of the byte is set."""
    if not 0 <= bit < 8:
        raise ValueError(f"a flag's bit must be from 0 to 7, got {bit}")
    return _field(places, f"bit {bit}", lambda parts: (parts[0] >> bit & 1) == 1)


def low(*places: Place) -> Field:
    """Declare low nibbles."""
    return bits(*places, first=0, count=4)


def high(*places: Place) -> Field:
    """Declare high nibbles."""
    return bits(*places, first=4, count=4)


def bcd(*places: Place) -> Field:
    """Declare binary-coded decimals, two digits per byte.

    A tuple of addresses is one number, highest digits first. Nibbles above 9 count as 10 to 15.
    """

    def read(parts: tuple[jax.Array, ...]) -> jax.Array:
        return _join(tuple((p >> 4) * 10 + (p & 15) for p in parts), 100)

    return _field(places, "BCD", read)
