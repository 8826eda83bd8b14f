"""Agent steps per second of Stable-Baselines3's PPO over OCAtari.

`training.py` and `sb3.py` run this script with an interpreter that has both:

    python _sb3_ocatari.py GAME NUM_ENVS SECONDS
"""

import sys

import gymnasium
import numpy as np
from _sb3_clock import training_rate
from ocatari.core import OCAtari  # pyright: ignore[reportMissingImports]
from stable_baselines3.common.vec_env import SubprocVecEnv  # pyright: ignore[reportMissingImports]


class Objects(gymnasium.Wrapper):
    """OCAtari's positions of the objects in the last two frames, as one flat vector."""

    def __init__(self, game: str) -> None:
        env = OCAtari(f"ALE/{game}-v5", mode="ram", hud=False, obs_mode="obj")
        super().__init__(env)
        shape = np.shape(env.reset(seed=0)[0])
        self.observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, (int(np.prod(shape)),), np.float32
        )

    def reset(self, **options: object) -> tuple[np.ndarray, dict]:
        """Reset."""
        obs, info = self.env.reset(**options)  # pyright: ignore[reportArgumentType]
        return np.asarray(obs, np.float32).ravel(), info

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Step."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return np.asarray(obs, np.float32).ravel(), float(reward), terminated, truncated, info


def main() -> None:
    """Print the rate."""
    game, n, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    print(training_rate(SubprocVecEnv([lambda: Objects(game)] * n), seconds))


if __name__ == "__main__":
    main()
