"""The rate of a training by Stable-Baselines3 in any environments."""

import time

from stable_baselines3 import PPO  # pyright: ignore[reportMissingImports]
from stable_baselines3.common.callbacks import BaseCallback  # pyright: ignore[reportMissingImports]
from stable_baselines3.common.vec_env import VecEnv  # pyright: ignore[reportMissingImports]


class Clock(BaseCallback):
    """Stops after some seconds, and records the rate, starting with the second rollout."""

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


def training_rate(envs: VecEnv, seconds: float) -> float:
    """Agent steps per second of PPO, including updates."""
    model = PPO("MlpPolicy", envs, n_steps=128, batch_size=256, n_epochs=3, device="cpu")
    clock = Clock(seconds)
    model.learn(10**9, callback=clock)
    envs.close()
    return clock.rate
