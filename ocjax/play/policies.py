"""Policies by name: random actions, held random actions, and saved policies (data files).

`N` is the number of instances.
"""

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ocjax.envs import Settings
from ocjax.extraction.game import Game
from ocjax.play import policy_files, sb3_models
from ocjax.play.saved import MAX_INPUT, Policy, PolicyError, SavedPolicy, Seen

__all__ = [
    "BUILT_IN", "HOLD", "MAX_INPUT", "SHIPPED", "TRAINED", "Needs", "Policy", "PolicyError",
    "RandomPolicy", "SavedPolicy", "Seen", "file_of", "find", "make_policy", "needs", "read",
]  # fmt: skip

HOLD = 8  # largest number of steps that an action is held
BUILT_IN = {
    "random": {},
    "repeat": {"hold": HOLD},
    "idle": {"idle": 1.0},
    "seldom": {"hold": HOLD, "idle": 0.95},
}
TRAINED = "trained"  # name of the policy that ships with the package
SHIPPED = Path(__file__).parent / "trained"


class Needs(NamedTuple):
    """A policy's requirements for the emulators."""

    settings: Settings | None = None  # of the training environments, or None if unknown
    screens: tuple[str, ...] = ()  # pixel arrays


@dataclasses.dataclass
class RandomPolicy:
    """Random actions, each held for 1 to `hold` steps.

    Args:
        num_actions: size of the action set.
        num_envs: number of instances.
        rng: the source of randomness.
        hold: the largest number of steps.
        idle: the fraction of choices with the first action of the set, NOOP.
    """

    num_actions: int
    num_envs: int
    rng: np.random.Generator
    hold: int = 1
    idle: float = 0.0

    def __post_init__(self) -> None:
        self.action = np.zeros(self.num_envs, int)
        self.left = np.zeros(self.num_envs, int)

    def __call__(self, seen: Seen) -> np.ndarray:
        """Return actions, int `[N]`."""
        new = self.left == 0
        chosen = self.rng.integers(self.num_actions, size=self.num_envs)
        if self.idle:
            chosen = np.where(self.rng.random(self.num_envs) < self.idle, 0, chosen)
        self.action = np.where(new, chosen, self.action)
        self.left = (
            np.where(new, self.rng.integers(1, self.hold + 1, size=self.num_envs), self.left) - 1
        )
        return self.action


def read(path: str | Path, game: Game) -> SavedPolicy:
    """Read a policy of a game from an .npz file or a .zip file of Stable-Baselines3.

    Raises:
        PolicyError: the file is missing, damaged, or does not fit the game.
        MissingExtraError: the file is a .zip file, and PyTorch is not installed.
    """
    return (sb3_models if Path(path).suffix == ".zip" else policy_files).read(path, game)


def find(name: str, game: Game) -> Path:
    """The file of a saved policy, by its path or by the name "trained"; raises PolicyError."""
    if name == TRAINED:
        path = SHIPPED / f"{game.name}.npz"
        if not path.exists():
            games = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.npz")))
            raise PolicyError(
                f"no trained policy of {game.name} ships with this version; there are those of "
                f"{games or 'no game'}"
            )
        return path
    if not Path(name).exists():
        raise PolicyError(
            f"no policy {name!r}: it must be {', '.join(BUILT_IN)}, {TRAINED}, or the path of an "
            ".npz file or a model (.zip)"
        )
    return Path(name)


def needs(name: str, game: Game) -> Needs:
    """The requirements of a policy, by its name; raises PolicyError."""
    if name in BUILT_IN:
        return Needs()
    policy = read(find(name, game), game)
    return Needs(policy.settings, policy.screens)


def file_of(name: str) -> Path | None:
    """The file that a policy's name refers to, or None for built-in and shipped policies."""
    return None if name == TRAINED or name in BUILT_IN else Path(name)


def make_policy(name: str, game: Game, num_actions: int, num_envs: int, seed: int) -> Policy:
    """A policy by name.

    Args:
        name: "random" (a new action in every step), "repeat" (each action is held for 1 to 8
            steps), "idle" (NOOP), "seldom" (like "repeat", but 95 % of the choices are NOOP),
            "trained" (the policy that ships with the package), or the path of a saved policy.
        num_actions: size of the action set.
        num_envs: number of instances.
        seed: seed of the random choices.

    Raises:
        PolicyError: the policy does not exist or does not fit the game.
    """
    if name in BUILT_IN:
        return RandomPolicy(num_actions, num_envs, np.random.default_rng(seed), **BUILT_IN[name])
    path = find(name, game)
    policy = read(path, game)
    if policy.num_actions != num_actions:
        raise PolicyError(
            f"{path}: the last layer must have {num_actions} outputs, one for each action of "
            f"{game.name}, got {policy.num_actions}"
        )
    return policy.playing(num_envs, seed)
