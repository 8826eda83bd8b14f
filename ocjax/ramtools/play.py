"""Random play of any game of ale-py, also without a decoder."""

from collections.abc import Iterator

import ale_py
import numpy as np

from ocjax.emulators.start import log_errors_only

HOLD = 8  # frames that play repeats an action


def moments(
    path: str, count: int, apart: int, seed: int, game_mode: int | None = None
) -> Iterator[ale_py.ALEInterface]:
    """Yield the emulator at moments of random play. Finished games restart.

    Args:
        game_mode: ale-py's number of the mode; None for the game's own.
    """
    log_errors_only()
    ale, rng = ale_py.ALEInterface(), np.random.default_rng(seed)
    ale.setInt("random_seed", seed)
    ale.setFloat("repeat_action_probability", 0.0)
    ale.loadROM(path)
    if game_mode is not None:
        if game_mode not in ale.getAvailableModes():
            raise ValueError(f"no mode {game_mode}; there are {list(ale.getAvailableModes())}")
        ale.setMode(game_mode)
    ale.reset_game()
    actions = ale.getMinimalActionSet()
    action = actions[0]
    for i in range(count * apart):
        if i % HOLD == 0:
            action = actions[rng.integers(len(actions))]
        if ale.game_over():
            ale.reset_game()
        ale.act(action)
        if i % apart == apart - 1:
            yield ale
