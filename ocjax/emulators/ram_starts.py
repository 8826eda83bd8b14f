"""Game starts: values that are written to the RAM after the console's reset."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ocjax.console.ram import RAM_SIZE, Field, byte
from ocjax.emulators.variations import Variation
from ocjax.extraction.game import Game
from ocjax.extraction.names import did_you_mean

# Values by the name of a field in the game's `Ram`, or by the number of a byte.
Start = Mapping[str, int]

NONE = "none"  # the start that writes nothing


def parse(text: str) -> dict[str, int]:
    """Parse a start such as "level=2,86=0x10"; "none" is the ordinary start."""
    if text == NONE:
        return {}
    pairs = [part.partition("=") for part in text.split(",")]
    try:
        start = {name.strip(): int(value, 0) for name, _, value in pairs}
    except ValueError as error:
        raise ValueError(
            f"a start must have the form NAME=VALUE,NAME=VALUE or be {NONE}, got {text!r}"
        ) from error
    if len(start) < len(pairs):
        raise ValueError(f"the start {text!r} has a name twice")
    return start


def describe(start: Start) -> str:
    """The inverse of `parse`."""
    return ",".join(f"{name}={value}" for name, value in start.items()) or NONE


def checked(game: Game, starts: Any) -> tuple[dict[str, int], ...]:
    """Starts with names as strings; raises ValueError unless the game has them."""
    if not isinstance(starts, Sequence) or not all(isinstance(start, Mapping) for start in starts):
        raise ValueError(
            "starts must be a sequence of mappings from names to values, such as [{'level': 2}], "
            f"got {starts!r}"
        )
    named = tuple({str(name): value for name, value in start.items()} for start in starts)
    for start in named:
        variation(game, start)
    return named


def variation(game: Game, start: Start) -> Variation:
    """A start as a variation; it writes only a field's bits, at each of its addresses."""
    writes: dict[int, int] = {}
    masks: dict[int, int] = {}
    for name, value in start.items():
        if not isinstance(value, int):
            raise ValueError(f"{name} must be set to an integer, got {value!r}")
        field = _field(game, name)
        mask, byte = _encoded(field, f"{name} of {game.name}", value)
        for address in dict.fromkeys(field.addresses):
            if masks.get(address, 0) & mask:
                raise ValueError(f"the start {describe(start)} writes bits of byte {address} twice")
            masks[address], writes[address] = (
                masks.get(address, 0) | mask,
                writes.get(address, 0) | byte,
            )
    return Variation(game.name, f"Games start with {describe(start)}.", writes, masks=masks)


def _field(game: Game, name: str) -> Field:
    """The field with a name, or a single byte."""
    fields = game.ram.fields()
    if name in fields:
        return fields[name]
    if name.isdecimal() and int(name) < RAM_SIZE:
        return byte(int(name))
    raise ValueError(
        f"the RAM of {game.name} has no field {name!r} (`ocjax ram map {game.name}` lists the "
        f"fields; a byte is a number up to {RAM_SIZE - 1}){did_you_mean(name, fields)}"
    )


def _encoded(field: Field, name: str, value: int) -> tuple[int, int]:
    """The mask of a field's bits, and these bits for a value."""
    if len(field.addresses) > len(field.places):
        raise ValueError(
            f"{name} is a number of several bytes: write the bytes "
            f"{', '.join(map(str, field.addresses))} by their numbers"
        )
    bytes_ = np.arange(256)
    read = np.asarray(field.read((jnp.asarray(bytes_, jnp.int32),)))
    mask = sum(1 << bit for bit in range(8) if (read != read[bytes_ ^ (1 << bit)]).any())
    known = (bytes_ & ~mask) == 0
    if field.meaning == "BCD":
        known &= (bytes_ >> 4 <= 9) & (bytes_ & 15 <= 9)
    found = bytes_[known & (read == value)]
    if not found.size:
        raise ValueError(
            f"{name} must be from {read[known].min()} to {read[known].max()}, got {value}"
        )
    return mask, int(found[0])
