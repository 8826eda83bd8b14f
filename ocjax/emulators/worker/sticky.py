"""The action that each frame executes with sticky actions.

This module draws ALE's random numbers: two in [0, 1) for each emulated frame. If the first is below
the probability, the frame repeats the previous action. The second is for the other player.
"""

import re

import numpy as np

WORDS = 624  # size of the Mersenne Twister's state
_TEXT = re.compile(rb"[0-9]{1,10}(?: [0-9]{1,10}){%d,%d}" % (WORDS - 1, WORDS))
_FRAMES = 1024  # frames to draw at once


class ExecutedAction:
    """The action that the last emulated frame executed. ALE's own state lacks it.

    Args:
        probability: that a frame repeats the previous action.

    Attributes:
        action: ale-py's number of the action.
        strength: the action's fraction of a paddle's full speed.
    """

    def __init__(self, probability: float) -> None:
        self._probability = float(np.float32(probability))  # ALE's precision
        self._generator = np.random.MT19937()
        # 1 for each frame that takes a new action, and the index of the next frame.
        self._taken, self._next = (b"", 0)
        self.release()

    def release(self) -> None:
        """Handle a reset of the console, which releases all buttons."""
        self.action, self.strength = 0, 1.0

    def synchronize(self, text: bytes) -> None:
        """Continue with the random numbers in the text of one of ALE's states."""
        if not self._probability:
            return
        key, position = generator_state(text)
        self._generator.state = {"bit_generator": "MT19937", "state": {"key": key, "pos": position}}
        self._taken, self._next = b"", 0

    def send(self, action: int, strength: float, frames: int) -> bool:
        """Draw the random numbers of `frames` frames that get an action from ALE.

        Returns:
            True if one of the frames takes the action.
        """
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
    """The state of a Mersenne Twister from a C++ library's text.

    Words, uint32 `[624]`, and used words.
    """
    numbers = np.fromstring(text, np.uint64, sep=" ") if _TEXT.fullmatch(text) else np.zeros(0)
    # libstdc++ appends the number of used words; libc++ writes the words in the order of their use.
    position = int(numbers[WORDS]) if len(numbers) > WORDS else WORDS
    if not len(numbers) or numbers.max() >= 2**32 or position > WORDS:
        raise ValueError("the state of the random numbers is damaged")
    return numbers[:WORDS].astype(np.uint32), position
