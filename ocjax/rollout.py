"""Rollouts of random actions, held random actions or a saved policy, kept as recordings."""

import dataclasses
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.progress import track

from ocjax.envs import AlePool, Settings
from ocjax.envs.progress import start_bar
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.recordings import Recording

HOLD = 8  # steps for which the policy "repeat" holds an action at most

Policy = Callable[[np.ndarray], np.ndarray]  # RAM of N instances, uint8 [N, 128] -> int [N], indices into the action set


class PolicyError(ValueError):
    """A policy does not exist, cannot be read, or was made for another game; the message says which."""


@dataclasses.dataclass
class RandomPolicy:
    """Random actions, each held for 1 to `hold` steps.

    Args:
        num_actions: size of the action set.
        num_envs: number of instances.
        rng: the source of randomness.
        hold: the largest number of steps.
    """

    num_actions: int
    num_envs: int
    rng: np.random.Generator
    hold: int = 1

    def __post_init__(self) -> None:
        self.action = np.zeros(self.num_envs, int)
        self.left = np.zeros(self.num_envs, int)

    def __call__(self, ram: np.ndarray) -> np.ndarray:
        """The next actions, int `[N]`."""
        new = self.left == 0
        self.action = np.where(new, self.rng.integers(self.num_actions, size=self.num_envs), self.action)
        self.left = np.where(new, self.rng.integers(1, self.hold + 1, size=self.num_envs), self.left) - 1
        return self.action


def features(objects: Objects) -> np.ndarray:
    """The input of a saved policy: x, y, w, h in screen widths and validity of each slot, float32 `[N, 5 * slots]`."""
    xywh = np.asarray(objects.xywh, np.float32) / 160
    out = np.concatenate([xywh, np.asarray(objects.valid, np.float32)[..., None]], axis=-1)
    return out.reshape(len(out), -1)


def saved_policy(path: str | Path, game: Game, num_actions: int) -> Policy:
    """A multilayer perceptron from a file, with tanh between its layers; the action is the index of the largest output.

    The input is `features` of the objects from RAM.

    Args:
        path: an .npz file with weights `w0` `[5 * slots, n]`, biases `b0` `[n]`, and so on for each layer.
        game: the game.
        num_actions: size of the action set, and of the last layer.

    Raises:
        PolicyError: the file is missing, unreadable, or does not fit the game.
    """
    layers = _read_layers(path, game)
    if not layers or layers[-1][0].shape[1] != num_actions:
        outputs = layers[-1][0].shape[1] if layers else 5 * game.num_slots
        raise PolicyError(f"{path}: the last layer must have {num_actions} outputs, one for each action of {game.name}, got {outputs}")

    def act(ram: np.ndarray) -> np.ndarray:
        x = features(game.rem(ram))
        for i, (w, b) in enumerate(layers):
            x = x @ w + b
            x = np.tanh(x) if i + 1 < len(layers) else x
        return x.argmax(axis=-1)

    return act


def _read_layers(path: str | Path, game: Game) -> list[tuple[np.ndarray, np.ndarray]]:
    """The weights and biases of each layer."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise PolicyError(f"{path} is not a readable policy (.npz with w0, b0, w1, b1, ...): {error}") from error
    layers, width = [], 5 * game.num_slots
    while f"w{len(layers)}" in arrays:
        i = len(layers)
        w, b = arrays[f"w{i}"], arrays.get(f"b{i}", np.zeros(0))
        if w.ndim != 2 or w.shape[0] != width or b.shape != w.shape[1:]:
            raise PolicyError(
                f"{path}: layer {i} must have w{i} [{width}, n] and b{i} [n] for {game.name}, got {list(w.shape)} and {list(b.shape)}"
            )
        layers.append((w, b))
        width = w.shape[1]
    return layers


def make_policy(name: str, game: Game, num_actions: int, num_envs: int, seed: int) -> Policy:
    """A policy by name.

    Args:
        name: "random" (a new action in every step), "repeat" (each action is held for 1 to 8 steps), or the path of a saved policy.
        game: the game.
        num_actions: size of the action set.
        num_envs: number of instances.
        seed: seed of the random policies.

    Raises:
        PolicyError: there is no such policy, or it does not fit the game.
    """
    if name in ("random", "repeat"):
        return RandomPolicy(num_actions, num_envs, np.random.default_rng(seed), HOLD if name == "repeat" else 1)
    if not Path(name).exists():
        raise PolicyError(f"no policy {name!r}: it must be random, repeat, or the path of an .npz file")
    return saved_policy(name, game, num_actions)


def rollout(
    game: Game,
    samples: int,
    *,
    policy: str = "repeat",
    seed: int = 0,
    num_envs: int = 8,
    frame_skip: int = 3,
    repeat_action_probability: float = 0.0,
    game_mode: int | None = None,
    game_difficulty: int | None = None,
) -> Recording:
    """Step several instances of a game side by side, and record every state.

    Args:
        game: the game.
        samples: states of all instances together, at least `num_envs`.
        policy: see `make_policy`.
        seed: seed of the policy and of the first instance; the following instances get the following seeds.
        num_envs: number of instances.
        frame_skip: emulated frames per step; an odd number covers both phases of flickering objects.
        repeat_action_probability: the probability that an emulated frame repeats the previous action.
        game_mode: game mode as ale-py numbers it; None for the game's default.
        game_difficulty: game difficulty, likewise.

    Returns:
        A recording with frames, previous frames, returns, lives, resets and ends: the samples of the first instance, from its first state
        on, then those of the second, and so on.

    Raises:
        PolicyError: a ValueError; there is no such policy, or it does not fit the game.
        RomError: a ValueError; the ROM is missing, or is not the one that the game's decoder was written for.
        ValueError: an argument is out of range.
    """
    if samples < num_envs:
        raise ValueError(f"samples must be at least the number of instances {num_envs}, got {samples}")
    settings = Settings(frame_skip=frame_skip, repeat_action_probability=repeat_action_probability)
    pool = AlePool(game, num_envs, settings, screens=("screen",), game_mode=game_mode, game_difficulty=game_difficulty)
    try:
        act = make_policy(policy, game, len(pool.actions), num_envs, seed)
        with start_bar(num_envs) as report:
            pool.reset([seed + i for i in range(num_envs)], report=report)
        arrays = _record(pool, act, samples // num_envs)
    finally:
        pool.close()
    flat = {name: a.reshape(-1, *a.shape[2:]) for name, a in arrays.items()}
    return Recording(game, **flat, frame_skip=frame_skip, settings=settings.to_dict())


def _record(pool: AlePool, act: Policy, steps: int) -> dict[str, np.ndarray]:
    """Record a pool that has just been reset, from that state on, and return the arrays of a recording, `[N, steps, ...]`."""
    n, (height, width) = pool.num_envs, pool.game.screen
    arrays = {
        "rams": np.empty((n, steps, 128), np.uint8),
        "screens": np.empty((n, steps, height, width), np.uint8),
        "previous": np.empty((n, steps, height, width), np.uint8),
        "rewards": np.empty((n, steps)),
        "lives": np.empty((n, steps), np.int32),
        "resets": np.zeros((n, steps), bool),
        "ends": np.zeros((n, steps), bool),
    }
    total, resets = np.zeros(n), np.ones(n, bool)
    for t in track(range(steps), description=f"playing {pool.game.name}", transient=True):
        if t > 0:
            pool.send(act(pool.ram))
            pool.wait()
        total = np.where(resets, 0, total + pool.reward)
        ends = pool.terminated | pool.truncated
        step = (pool.ram, pool.screen[:, 1], pool.screen[:, 0], total, pool.lives, resets, ends)
        for array, value in zip(arrays.values(), step, strict=True):
            array[:, t] = value
        resets = ends
    return arrays
