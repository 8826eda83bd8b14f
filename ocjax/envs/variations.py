"""Games changed by writing their RAM: examples of hooks, in the manner of HackAtari.

A hook gets the RAM of one environment, uint8 `[128]`, before every emulated frame, and writes into it:

    ocjax.make_vec("Pong", 64, hook=variations.lazy_enemy)
"""

import numpy as np


def lazy_enemy(ram: np.ndarray) -> None:
    """Pong: the enemy stays in the middle of the court."""
    ram[21] = 127  # where it wants to be


def stopped_cars(ram: np.ndarray) -> None:
    """Freeway: the cars stand still, each lane's further to the right than the one above."""
    ram[108:118] = np.arange(150, 10, -14)  # places; 108 is the bottom lane's
    ram[33:43] = 2  # frames until the next move


def no_shields(ram: np.ndarray) -> None:
    """Space Invaders: the cannon stands without shields."""
    ram[43:70] = 0
