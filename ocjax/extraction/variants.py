"""`Variants`: what the modes and difficulties of a game mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

__all__ = ["UNEXPLAINED", "Variants", "meanings_of_bits"]


@dataclass(frozen=True)
class Variants:
    """The meanings of modes and difficulties, by ale-py's numbers, and starts in later levels.

    Numbers without a reliable source are missing.

    Args:
        modes: the meaning of each mode.
        difficulties: the meaning of each difficulty. Bit 0 is the console's left switch and bit 1
            the right one; a bit that is set means position A.
        source: where the meanings come from.
        starts: what the first state shows after values were written to the RAM, by the option
            `--start` of `ocjax dataset`, such as "level=1".
    """

    modes: Mapping[int, str] = field(default_factory=dict)
    difficulties: Mapping[int, str] = field(default_factory=dict)
    source: str = ""
    starts: Mapping[str, str] = field(default_factory=dict)

    def problem(self) -> str:
        """Describe what is wrong, or return an empty text."""
        explains = self.modes or self.difficulties
        return "the meanings need a source" if explains and not self.source else ""


def meanings_of_bits(features: Sequence[str], otherwise: str) -> dict[int, str]:
    """List the meanings of numbers in which each bit is a feature.

    Args:
        features: the meaning of each bit, the lowest first.
        otherwise: the meaning of 0.
    """
    numbers = range(2 ** len(features))
    return {
        n: ", ".join(text for bit, text in enumerate(features) if n >> bit & 1) or otherwise
        for n in numbers
    }


UNEXPLAINED = Variants()  # of a game without explanations
