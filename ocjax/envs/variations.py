"""Example hooks that vary games by writing their RAM, similar to HackAtari.

A hook is called before every emulated frame with the RAM of one environment, uint8 `[128]`, and writes to it:

    ocjax.make_vec("Pong", 64, hook=variations.lazy_enemy)
"""

import numpy as np


def lazy_enemy(ram: np.ndarray) -> None:
    """Pong: the enemy stays in the middle of the court."""
    ram[21] = 127  # the position that it moves to


def stopped_cars(ram: np.ndarray) -> None:
    """Freeway: the cars stand still on a diagonal, each further to the right than the car in the lane above."""
    ram[108:118] = np.arange(150, 10, -14)  # positions; 108 is the bottom lane
    ram[33:43] = 2  # frames until the next move


def no_shields(ram: np.ndarray) -> None:
    """Space Invaders: the cannon has no shields."""
    ram[43:70] = 0
