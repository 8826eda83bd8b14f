"""Agent steps per second of Stable-Baselines3's PPO over OCAtari; `training.py` runs it with an interpreter that has both.

python _sb3_ocatari.py GAME NUM_ENVS SECONDS
"""

import sys
import time

import gymnasium
import numpy as np
from ocatari.core import OCAtari  # pyright: ignore[reportMissingImports]
from stable_baselines3 import PPO  # pyright: ignore[reportMissingImports]
from stable_baselines3.common.callbacks import BaseCallback  # pyright: ignore[reportMissingImports]
from stable_baselines3.common.vec_env import SubprocVecEnv  # pyright: ignore[reportMissingImports]


class Objects(gymnasium.Wrapper):
    """OCAtari's positions of the objects in the last two frames, as one flat vector."""

    def __init__(self, game: str) -> None:
        env = OCAtari(f"ALE/{game}-v5", mode="ram", hud=False, obs_mode="obj")
        super().__init__(env)
        shape = np.shape(env.reset(seed=0)[0])
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (int(np.prod(shape)),), np.float32)

    def reset(self, **options: object) -> tuple[np.ndarray, dict]:
        """Reset."""
        obs, info = self.env.reset(**options)  # pyright: ignore[reportArgumentType]
        return np.asarray(obs, np.float32).ravel(), info

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Step."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return np.asarray(obs, np.float32).ravel(), float(reward), terminated, truncated, info


class Clock(BaseCallback):
    """Stops after some seconds, and notes the rate from the second rollout on."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.seconds, self.begin, self.steps, self.rate = seconds, 0.0, 0, 0.0

    def _on_rollout_start(self) -> None:
        now = time.perf_counter()
        if self.num_timesteps and not self.begin:
            self.begin, self.steps = now, self.num_timesteps
        elif self.begin:
            self.rate = (self.num_timesteps - self.steps) / (now - self.begin)

    def _on_step(self) -> bool:
        return not (self.rate and time.perf_counter() - self.begin > self.seconds)


def main() -> None:
    """Print the rate."""
    game, n, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    envs = SubprocVecEnv([lambda: Objects(game)] * n)
    model = PPO("MlpPolicy", envs, n_steps=128, batch_size=256, n_epochs=3, device="cpu")
    clock = Clock(seconds)
    model.learn(10**9, callback=clock)
    print(clock.rate)
    envs.close()


if __name__ == "__main__":
    main()
