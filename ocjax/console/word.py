"""`Word`: several small numbers in one, such as the fields of a record that are moved together."""

from types import SimpleNamespace
from typing import Any

import jax
import numpy as np

__all__ = ["Word"]

_Values = jax.Array | np.ndarray | int
_BITS = 32


class Word:
    """The layout of a word of at most 32 bits.

    Look-ups, selections and reductions of one word cost less than those of several numbers.

    Args:
        bits: the number of bits of each field, from the lowest bit of the word up.

    Raises:
        ValueError: the fields need more than 32 bits, or one has none.
    """

    def __init__(self, **bits: int) -> None:
        if sum(bits.values()) > _BITS or min(bits.values(), default=0) < 1:
            raise ValueError(f"a word has fields of 1 bit or more, {_BITS} in all, got {bits}")
        shifts = np.cumsum([0, *bits.values()]).tolist()
        self._fields = {
            name: (shift, (1 << count) - 1)
            for (name, count), shift in zip(bits.items(), shifts, strict=False)
        }

    def pack(self, **values: Any) -> Any:
        """The words with the values of all fields, integers or arrays; higher bits are dropped.

        Raises:
            TypeError: the names differ from the names of the fields.
        """
        if values.keys() != self._fields.keys():
            raise TypeError(f"the fields are {', '.join(self._fields)}, got {', '.join(values)}")
        total = 0
        for name, (shift, mask) in self._fields.items():
            total = total | (values[name] & mask) << shift
        return total

    def unpack(self, words: _Values) -> SimpleNamespace:
        """Return the values of all fields, none negative, as attributes."""
        return SimpleNamespace(
            **{name: words >> shift & mask for name, (shift, mask) in self._fields.items()}
        )
