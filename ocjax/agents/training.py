"""The training loop: rollouts and updates at the same time, checkpoints, and the saved policy."""

import contextlib
import dataclasses
import json
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console

from ocjax.agents import networks, ppo
from ocjax.agents.checkpoints import Checkpoints
from ocjax.agents.collector import Collector
from ocjax.agents.metrics import Bar, Metrics
from ocjax.agents.moments import Moments, deviation
from ocjax.agents.ppo import Hyperparameters, Learner, Losses, Rollout
from ocjax.emulators.checks import integer
from ocjax.emulators.settings import settings
from ocjax.envs import Dqn, ObjectVectorEnv, Vector, make_vec
from ocjax.extraction.registry import load
from ocjax.files import jobs
from ocjax.play.policies import SavedPolicy

FEATURES = ("x", "y", "dx", "dy", "nx", "ny", "mx", "my", "orientation", "valid")
# Positions on a fixed grid say nothing, and those relative to the player change all at once: in Breakout, 108 bricks hide the ball.
GRID_FEATURES = ("valid",)
PRESET = "dqn"
CHECKPOINT_SECONDS = 120.0
STACK = 4  # grey frames of an observation of pixels
ACTION_SEED = 2**31 - 1  # distinguishes the random numbers of actions from those of updates

Inputs = Literal["objects", "pixels"]


class TrainingError(ValueError):
    """A training cannot be started or continued; the message says why."""


@dataclasses.dataclass(frozen=True)
class Config:
    """What a training is.

    Args:
        game: the game's name.
        seed: of the environments, the network and the actions.
        inputs: "objects" (from RAM, without the display) or "pixels" (the last four grey frames).
        preset: the settings of the environments. Rewards are not clipped, whatever it says, but scaled by the spread of the returns.
        hyperparameters: of PPO.
        features: of each slot, as `ocjax.envs.Vector` names them, in pixels; for "objects".
        grid_features: likewise, for the slots of fixed grids.
    """

    game: str
    seed: int = 0
    inputs: Inputs = "objects"
    preset: str = PRESET
    hyperparameters: Hyperparameters = dataclasses.field(default_factory=Hyperparameters)
    features: tuple[str, ...] = FEATURES
    grid_features: tuple[str, ...] = GRID_FEATURES

    @property
    def vector(self) -> Vector:
        """The observation of "objects"."""
        return Vector(self.features, grid_features=self.grid_features, normalize=False)

    def to_json(self) -> str:
        """The configuration as JSON."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"


class _Acting(NamedTuple):
    """What the policy needs to act."""

    params: Any
    inputs: Moments


class _Updated(NamedTuple):
    """The result of an update."""

    learner: Learner
    losses: Losses
    seconds: float


class Trainer:
    """A training in a folder, which gets `config.json`, `metrics.csv`, `tensorboard/`, `checkpoints/` and `policy.npz`.

    While the emulators play a rollout, another thread computes the update from the rollout before. So the policy that acts is behind by
    one update, always: what is computed does not depend on how fast either is.

    Args:
        config: of the training. If the folder holds a training, it must be the same one, which goes on from its latest checkpoint.
        folder: is created if necessary.

    Raises:
        TrainingError: the folder holds another training, or its checkpoint is damaged.
    """

    def __init__(self, config: Config, folder: Path) -> None:
        self.config, self.folder = config, folder.resolve()
        jobs.check_contents(self.folder, "training", error=TrainingError)
        jobs.claim(self.folder, "config.json", config.to_json(), "training", error=TrainingError)
        h, self._objects = config.hyperparameters, config.inputs == "objects"
        game = load(config.game)
        self.game = game.without_hud() if self._objects else game
        self._settings = dataclasses.replace(settings(config.preset), clip_rewards=False)
        self.frames_per_update = h.num_envs * h.horizon * _frames_per_step(self._settings.frame_skip)
        first, second = (self._make_envs() for _ in range(2))
        self._collector = Collector(first, second, h.horizon, config.seed)
        (inputs, *_), self.num_actions = first.single_observation_space.shape, first.single_action_space.n  # pyright: ignore
        network = networks.mlp(inputs, self.num_actions) if self._objects else networks.nature_cnn(STACK, self.num_actions)
        self._act = ppo.make_act(network, standardize=self._objects)
        self._update = ppo.make_update(network, h, standardize=self._objects)
        learner = ppo.init(network, h, inputs if self._objects else 1, config.seed)
        self._acting = _Acting(learner.params, learner.inputs)
        self._pending = _completed(_Updated(learner, ppo.NO_LOSSES, 0.0))
        self._key = jax.random.key_data(jax.random.fold_in(jax.random.key(config.seed), ACTION_SEED))
        self.updates, self.metrics = 0, Metrics(self.folder)
        self._checkpoints: Checkpoints | None = None
        self._restore()

    @property
    def frames(self) -> int:
        """Emulated frames of the updates so far."""
        return self.updates * self.frames_per_update

    def _make_envs(self) -> ObjectVectorEnv:
        mode, obs = ("rem", self.config.vector) if self._objects else ("raw", "dqn")
        num_envs = self.config.hyperparameters.num_envs // 2
        return make_vec(self.game, num_envs, mode=mode, obs=obs, hud=self.game.hud, preset=self.config.preset, clip_rewards=False)

    def run(self, frames: int, console: Console) -> None:
        """Train until so many emulated frames have been played, counted from the start of the training.

        Learning rate, clipping range and entropy coefficient reach 0 at that number.

        Args:
            frames: emulated frames.
            console: where progress is shown.
        """
        total, saved = -(-frames // self.frames_per_update), time.monotonic()
        with ThreadPoolExecutor(1) as executor, Bar(console, self.game.name, frames) as bar:
            while self.updates < total:
                start, acting = time.monotonic(), self._acting
                rollout = self._collector.collect(lambda obs, t, own=acting: self._act(*own, obs, self._key, jnp.int32(t)))
                previous = self._pending.result()
                self._acting = _Acting(previous.learner.params, previous.learner.inputs)
                left = jnp.float32(1 - self.updates / total)
                self._pending = executor.submit(self._compute, previous.learner, acting.inputs, rollout, left)
                self.updates += 1
                self._note(previous, time.monotonic() - start)
                bar.update(self.frames, self.metrics.frames_per_second, self.metrics.mean_return)
                if time.monotonic() - saved > CHECKPOINT_SECONDS or self.updates == total:
                    self._save()
                    saved = time.monotonic()

    def _compute(self, learner: Learner, inputs: Moments, rollout: Rollout, left: jax.Array) -> _Updated:
        start = time.monotonic()
        learner, losses = jax.block_until_ready(self._update(learner, inputs, rollout, left))
        return _Updated(learner, losses, time.monotonic() - start)

    def _note(self, previous: _Updated, seconds: float) -> None:
        """Add a row of metrics: games of the last rollout, and losses of the update that was computed meanwhile."""
        shares = {f"{name}_share": value / seconds for name, value in self._collector.seconds.items()}
        shares["update_share"] = previous.seconds / seconds  # at the same time as the others
        losses = {name: float(value) for name, value in previous.losses._asdict().items()}
        self.metrics.add(self.frames, seconds, self._collector.games, **losses, **shares)

    def policy(self) -> SavedPolicy:
        """The current policy."""
        learner = self._pending.result().learner
        parts = ("actor",) if self._objects else ("torso", "dense", "actor")
        layers = [(np.asarray(layer["w"]), np.asarray(layer["b"])) for part in parts for layer in learner.params[part]]
        known = {"sampled": True, "settings": self._settings, "preset": self.config.preset, "frames": self.frames}
        if not self._objects:
            return SavedPolicy(self.game, layers, Dqn(), network="nature_cnn", **known)
        mean, spread = np.asarray(learner.inputs.mean), np.asarray(deviation(learner.inputs))
        return SavedPolicy(self.game, layers, self.config.vector, mean, spread, **known)

    def _save(self) -> None:
        """Write the metrics, the policy and a checkpoint.

        Raises:
            TrainingError: a file cannot be written. The previous checkpoint is still there.
        """
        assert self._checkpoints is not None
        state = {"pending": self._pending.result(), "acting": self._acting}
        progress = {"updates": self.updates, "metrics": self.metrics.save()}
        kept = self._checkpoints.latest
        try:
            self.metrics.write()  # rows beyond the latest checkpoint are dropped when it is restored
            self.policy().write(self.folder / "policy.npz")
            self._checkpoints.save(self.updates, state, self._collector.save(), progress)
        except OSError as error:
            raise TrainingError(
                f"{self.folder}: the training cannot be saved after {self.frames:,} frames: {error}. Make space, and run the same command "
                f"again: it continues {'from the start' if kept is None else f'after {kept * self.frames_per_update:,} frames'}"
            ) from error

    def _restore(self) -> None:
        """Continue from the latest checkpoint, if there is one."""
        faulty = "the folder checkpoints"
        try:
            self._checkpoints = Checkpoints(self.folder / "checkpoints")
            step = self._checkpoints.latest
            if step is not None:
                faulty = f"the checkpoint checkpoints/{step} or metrics.csv"
                self._restore_from(self._checkpoints, step)
        except Exception as error:  # a damaged file can fail anywhere in Orbax, TensorStore, JSON, and the states of the emulators
            self.close()
            raise TrainingError(
                f"{self.folder}: {faulty} is damaged, or another version of ocjax wrote it: {_in_one_line(error)}. Restore the folder from "
                "a copy, or train in another one"
            ) from error

    def _restore_from(self, checkpoints: Checkpoints, step: int) -> None:
        """Continue from a checkpoint."""
        state = {"pending": self._pending.result(), "acting": self._acting}
        saved = checkpoints.restore(step, state)
        if jax.tree.map(_form, saved["state"]) != jax.tree.map(_form, state):
            raise ValueError("its arrays have other shapes or types than those of this training")
        updates = integer("the number of updates", saved["progress"]["updates"], step, step)
        self._pending, self._acting = _completed(saved["state"]["pending"]), saved["state"]["acting"]
        self._collector.restore(saved["environments"], updates)
        self.metrics.restore(saved["progress"]["metrics"], updates)
        self.updates = updates

    def close(self) -> None:
        """Close the environments, the checkpoints and the files, each also if another cannot be closed."""
        with contextlib.ExitStack() as stack:
            stack.callback(self._collector.close)
            stack.callback(self.metrics.close)
            if self._checkpoints is not None:
                stack.callback(self._checkpoints.close)


def _in_one_line(error: Exception) -> str:
    """The type of an error and the beginning of its message."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:500]


def _form(leaf: Any) -> str:
    """The shape and the kind of numbers of an array or a number."""
    array = np.asarray(leaf)
    return f"{array.dtype.kind} {list(array.shape)}"


def _completed(result: _Updated) -> Future[_Updated]:
    future: Future[_Updated] = Future()
    future.set_result(result)
    return future


def _frames_per_step(skip: int | tuple[int, int]) -> int:
    if not isinstance(skip, int):
        raise TrainingError(f"training needs a preset with a fixed frame skip, got one of {skip}")
    return skip
