"""Which action each frame executes: under sticky actions, ALE's random numbers decide, and this
module draws the same ones.

Before each emulated frame ALE draws two numbers in [0, 1). If the first one is below the
probability, the frame repeats the action of the frame before. The second one is of the other
player, who does nothing.
"""

import re

import numpy as np

WORDS = 624  # of the state of the Mersenne Twister
_TEXT = re.compile(rb"[0-9]{1,10}(?: [0-9]{1,10}){%d,%d}" % (WORDS - 1, WORDS))
_FRAMES = 1024  # that are drawn at once


class ExecutedAction:
    """The action that the last emulated frame executed. ALE's own state lacks it.

    Args:
        probability: the probability that a frame repeats the action of the frame before.

    Attributes:
        action: the action, as ale-py numbers it.
        strength: the part of a paddle's full speed that it was sent with.
    """

    def __init__(self, probability: float) -> None:
        self._probability = float(np.float32(probability))  # as ALE stores it
        self._generator = np.random.MT19937()
        self._taken, self._next = (
            b"",
            0,
        )  # 1 for each frame that takes a new action, and the next frame's index
        self.release()

    def release(self) -> None:
        """Note that the console was reset, which releases all buttons."""
        self.action, self.strength = 0, 1.0

    def synchronize(self, text: bytes) -> None:
        """Continue with the random numbers of one of ALE's states, from the text in it."""
        if not self._probability:
            return
        key, position = generator_state(text)
        self._generator.state = {"bit_generator": "MT19937", "state": {"key": key, "pos": position}}
        self._taken, self._next = b"", 0

    def send(self, action: int, strength: float, frames: int) -> bool:
        """Draw the numbers of frames for which ALE gets an action; return whether one of them takes it."""
        if not self._probability:
            taken = True
        else:
            while self._next + frames > len(self._taken):
                self._draw()
            taken = self._taken.find(1, self._next, self._next + frames) >= 0
            self._next += frames
        if taken:
            self.action, self.strength = action, strength
        return taken

    def _draw(self) -> None:
        first = self._generator.random_raw(2 * _FRAMES)[::2]
        more = (first / 2**32 >= self._probability).tobytes()
        self._taken, self._next = self._taken[self._next :] + more, 0


def generator_state(text: bytes) -> tuple[np.ndarray, int]:
    """The Mersenne Twister whose state a C++ library has written: its words, uint32 `[624]`, and
    how many of these are used.

    Raises:
        ValueError: the text is not such a state.
    """
    numbers = np.fromstring(text, np.uint64, sep=" ") if _TEXT.fullmatch(text) else np.zeros(0)
    # libstdc++ writes the number of used words after them; libc++ writes the words in the order of
    # their use.
    position = int(numbers[WORDS]) if len(numbers) > WORDS else WORDS
    if not len(numbers) or numbers.max() >= 2**32 or position > WORDS:
        raise ValueError("the state of the random numbers is damaged")
    return numbers[:WORDS].astype(np.uint32), position
