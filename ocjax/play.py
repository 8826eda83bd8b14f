"""Play that makes recordings: random actions, held random actions, or a saved policy."""

import dataclasses
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.progress import track

from ocjax.envs import AlePool, Protocol
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.recordings import Recording

HOLD = 8  # steps that "repeat" holds an action at most

Policy = Callable[[np.ndarray], np.ndarray]  # RAM of N instances, uint8 [N, 128] -> int [N], indices into the game's actions


class PolicyError(ValueError):
    """A policy that does not exist, cannot be read, or is for another game; the message says which."""


@dataclasses.dataclass
class RandomPolicy:
    """Random actions, each held for 1 to `hold` steps."""

    num_actions: int
    num_envs: int
    rng: np.random.Generator
    hold: int = 1

    def __post_init__(self) -> None:
        self.action = np.zeros(self.num_envs, int)
        self.left = np.zeros(self.num_envs, int)

    def __call__(self, ram: np.ndarray) -> np.ndarray:
        """The next actions."""
        new = self.left == 0
        self.action = np.where(new, self.rng.integers(self.num_actions, size=self.num_envs), self.action)
        self.left = np.where(new, self.rng.integers(1, self.hold + 1, size=self.num_envs), self.left) - 1
        return self.action


def features(objects: Objects) -> np.ndarray:
    """What a saved policy sees: x, y, w, h in screen widths and validity of each slot, float32 `[N, 5 * slots]`."""
    xywh = np.asarray(objects.xywh, np.float32) / 160
    seen = np.concatenate([xywh, np.asarray(objects.valid, np.float32)[..., None]], axis=-1)
    return seen.reshape(len(seen), -1)


def saved_policy(path: str | Path, game: Game, num_actions: int) -> Policy:
    """A network from a file: layers `w0`, `b0`, `w1`, `b1`, ... of an .npz file, tanh between them, the largest output is the action.

    Its input is `features` of the objects from RAM, its output one number for each of the game's actions.

    Raises:
        PolicyError: the file is missing, unreadable, or does not fit the game.
    """
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
    if not layers or width != num_actions:
        raise PolicyError(f"{path}: the last layer must have {num_actions} outputs, one for each action of {game.name}, got {width}")

    def act(ram: np.ndarray) -> np.ndarray:
        x = features(game.rem(ram))
        for i, (w, b) in enumerate(layers):
            x = x @ w + b
            x = np.tanh(x) if i + 1 < len(layers) else x
        return x.argmax(axis=-1)

    return act


def make_policy(name: str, game: Game, num_actions: int, num_envs: int, seed: int) -> Policy:
    """A policy by name: `random` (a new action every step), `repeat` (each held for 1 to 8 steps), or the path of a saved one.

    Raises:
        PolicyError: there is no such policy, or it does not fit the game.
    """
    if name in ("random", "repeat"):
        return RandomPolicy(num_actions, num_envs, np.random.default_rng(seed), HOLD if name == "repeat" else 1)
    if not Path(name).exists():
        raise PolicyError(f"no policy {name!r}: it is random, repeat, or the path of an .npz file")
    return saved_policy(name, game, num_actions)


def play(
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
    """Play several instances side by side and keep every step of each.

    Args:
        game: what to play.
        samples: steps of all instances together, at least `num_envs`.
        policy: see `make_policy`.
        seed: of the policy; the instances get seeds from here on.
        num_envs: instances.
        frame_skip: emulated frames a step; odd, so that both phases of what flickers are seen.
        repeat_action_probability: sticky actions, per emulated frame.
        game_mode, game_difficulty: as ale-py numbers them; None for the game's default.

    Returns:
        A recording with frames, the frames before them, rewards, lives and resets: the samples of the first instance, then those of the
        second, and so on.

    Raises:
        PolicyError, RomError, ValueError: a wrong policy, ROM or argument.
    """
    if samples < num_envs:
        raise ValueError(f"samples must be at least the number of instances {num_envs}, got {samples}")
    protocol = Protocol(frame_skip=frame_skip, repeat_action_probability=repeat_action_probability)
    pool = AlePool(game, num_envs, protocol, screens=("screen",), game_mode=game_mode, game_difficulty=game_difficulty)
    try:
        act = make_policy(policy, game, len(pool.actions), num_envs, seed)
        pool.reset([seed + i for i in range(num_envs)])
        steps = samples // num_envs
        height, width = game.screen
        kept = {
            "rams": np.empty((num_envs, steps, 128), np.uint8),
            "screens": np.empty((num_envs, steps, height, width), np.uint8),
            "previous": np.empty((num_envs, steps, height, width), np.uint8),
            "rewards": np.empty((num_envs, steps)),
            "lives": np.empty((num_envs, steps), np.int32),
            "resets": np.zeros((num_envs, steps), bool),
        }
        total, over = np.zeros(num_envs), np.ones(num_envs, bool)
        for t in track(range(steps), description=f"playing {game.name}", transient=True):
            pool.send(act(pool.ram))
            pool.wait()
            total = np.where(over, 0, total) + pool.reward
            now = (pool.ram, pool.screen[:, 1], pool.screen[:, 0], total, pool.lives, over)
            for array, value in zip(kept.values(), now, strict=True):
                array[:, t] = value
            over = pool.terminated | pool.truncated
    finally:
        pool.close()
    return Recording(game, **{k: a.reshape(-1, *a.shape[2:]) for k, a in kept.items()}, frame_skip=frame_skip, settings=protocol.to_dict())
