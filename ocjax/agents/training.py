"""The training loop: concurrent rollouts and updates, checkpoints, and the saved policy."""

import contextlib
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console

from ocjax.agents import networks, ppo
from ocjax.agents.checkpoints import Checkpoints
from ocjax.agents.collector import Collector
from ocjax.agents.config import Config, TrainingError
from ocjax.agents.metrics import Metrics
from ocjax.agents.moments import Moments, deviation
from ocjax.agents.ppo import Learner, Losses, Rollout
from ocjax.emulators import ram_starts
from ocjax.emulators.ale import AlePool
from ocjax.emulators.checks import integer
from ocjax.emulators.progress import progress_bar
from ocjax.envs import Dqn, ObjectVectorEnv
from ocjax.envs.requests import Mode, requested_kinds, required_screens
from ocjax.extraction.registry import load
from ocjax.files import jobs
from ocjax.play.networks import NETWORKS
from ocjax.play.policies import SavedPolicy

CHECKPOINT_SECONDS = 120.0
PROGRESS = "frames, {task.fields[speed]:,.0f} a second, return {task.fields[mean]:,.1f}"
STACK = 4  # grey frames per observation
ACTION_SEED = 2**31 - 1  # separates the random numbers of actions and of updates


class _Acting(NamedTuple):
    params: Any
    inputs: Moments


class _Updated(NamedTuple):
    learner: Learner
    losses: Losses
    seconds: float


class Trainer:
    """A training in a folder.

    It writes `config.json`, `metrics.csv`, `tensorboard/`, `checkpoints/` and `policy.npz`. While
    the emulators play a rollout, another thread computes the update from the previous rollout. The
    acting policy is therefore always one update behind, and results do not depend on the speed of
    either.

    Args:
        config: the configuration. If the folder contains a training, it must be the same one, and
            continues from its latest checkpoint.
        folder: created if necessary.
    """

    def __init__(self, config: Config, folder: Path) -> None:
        self.config, self.folder = config, folder.resolve()
        jobs.check_contents(self.folder, "training", error=TrainingError)
        jobs.claim(self.folder, "config.json", config.to_json(), "training", error=TrainingError)
        h, self._objects = config.hyperparameters, config.inputs == "objects"
        game = load(config.game)
        self.game = game.without_hud() if self._objects else game
        skip = config.settings.frame_skip
        assert isinstance(skip, int)
        self.frames_per_update = h.num_envs * h.horizon * skip
        first, second = (self._make_envs(start) for start in (0, h.num_envs // 2))
        self._collector = Collector(first, second, h.horizon, config.seed)
        observations, actions = first.single_observation_space, first.single_action_space
        (inputs, *_), self.num_actions = observations.shape, actions.n  # pyright: ignore
        self._network = config.network if self._objects else "nature_cnn"
        network = self._make_network(inputs)
        standardize = NETWORKS[self._network].standardized
        self._act = ppo.make_act(network, standardize=standardize)
        self._update = ppo.make_update(network, h, standardize=standardize)
        learner = ppo.init(network, h, inputs if standardize else 1, config.seed)
        self._acting = _Acting(learner.params, learner.inputs)
        self._pending = _completed(_Updated(learner, ppo.NO_LOSSES, 0.0))
        self._key = jax.random.key_data(
            jax.random.fold_in(jax.random.key(config.seed), ACTION_SEED)
        )
        self.updates, self.metrics = 0, Metrics(self.folder)
        self._checkpoints: Checkpoints | None = None
        self._kept = 0  # number of updates before the latest checkpoint
        self._restore()

    @property
    def frames(self) -> int:
        """Emulated frames of the updates so far."""
        return self.updates * self.frames_per_update

    def _make_envs(self, start: int) -> ObjectVectorEnv:
        c, num_envs = self.config, self.config.hyperparameters.num_envs // 2
        mode: Mode = "rem" if self._objects else "raw"
        obs = c.vector if self._objects else "dqn"
        screens = tuple(required_screens(mode, requested_kinds(mode, obs)[0]))
        begin = [
            ram_starts.variation(self.game, c.starts[i % len(c.starts)])
            for i in range(start, start + num_envs)
            if c.starts
        ]
        variant: dict[str, Any] = {
            "hook": c.variations,
            "game_mode": c.game_mode,
            "game_difficulty": c.game_difficulty,
            "starts": begin,
        }
        return ObjectVectorEnv(
            AlePool(self.game, num_envs, c.settings, screens=screens, **variant), mode, obs
        )

    def _make_network(self, inputs: int) -> networks.Network:
        if not self._objects:
            return networks.nature_cnn(STACK, self.num_actions)
        if self.config.network == "deep_sets":
            return networks.deep_sets(self.config.groups, self.num_actions)
        return networks.mlp(inputs, self.num_actions)

    def run(self, frames: int, console: Console) -> None:
        """Train up to a total number of emulated frames, counted from the start of the training.

        Learning rate, clipping range and entropy coefficient reach 0 at that number.
        """
        total, saved = -(-frames // self.frames_per_update), time.monotonic()
        bar = progress_bar(f"training {self.game.name}", PROGRESS, console)
        with ThreadPoolExecutor(1) as executor, bar as report:
            while self.updates < total:
                start, acting = time.monotonic(), self._acting
                rollout = self._collector.collect(
                    lambda obs, t, own=acting: self._act(*own, obs, self._key, np.int32(t))
                )
                previous = self._pending.result()
                self._acting = _Acting(previous.learner.params, previous.learner.inputs)
                left = jnp.float32(1 - self.updates / total)
                self._pending = executor.submit(
                    self._compute, previous.learner, acting.inputs, rollout, left
                )
                self.updates += 1
                self._note(previous, time.monotonic() - start)
                report(
                    self.frames,
                    frames,
                    speed=self.metrics.frames_per_second,
                    mean=self.metrics.mean_return,
                )
                if time.monotonic() - saved > CHECKPOINT_SECONDS or self.updates == total:
                    self._save()
                    saved = time.monotonic()

    def _compute(
        self, learner: Learner, inputs: Moments, rollout: Rollout, left: jax.Array
    ) -> _Updated:
        start = time.monotonic()
        learner, losses = jax.block_until_ready(self._update(learner, inputs, rollout, left))
        return _Updated(learner, losses, time.monotonic() - start)

    def _note(self, previous: _Updated, seconds: float) -> None:
        shares = {
            f"{name}_share": value / seconds for name, value in self._collector.seconds.items()
        }
        shares["update_share"] = previous.seconds / seconds  # concurrent with the others
        losses = {name: float(value) for name, value in previous.losses._asdict().items()}
        with self._writing():
            self.metrics.add(self.frames, seconds, self._collector.games, **losses, **shares)

    def policy(self) -> SavedPolicy:
        """The current policy."""
        learner = self._pending.result().learner
        parts = ("torso", "dense", "encoders", "actor")
        layers = [
            (np.asarray(layer["w"]), np.asarray(layer["b"]))
            for part in parts
            for layer in learner.params.get(part, [])
        ]
        standardized = NETWORKS[self._network].standardized
        return SavedPolicy(
            self.game,
            layers,
            self.config.vector if self._objects else Dqn(),
            mean=np.asarray(learner.inputs.mean) if standardized else None,
            deviation=np.asarray(deviation(learner.inputs)) if standardized else None,
            sampled=True,
            settings=self.config.settings,
            preset=self.config.preset,
            frames=self.frames,
            network=self._network,
        )

    def _save(self) -> None:
        assert self._checkpoints is not None
        state = {"pending": self._pending.result(), "acting": self._acting}
        progress = {"updates": self.updates, "metrics": self.metrics.save()}
        with self._writing():
            self.policy().write(self.folder / "policy.npz")
            self._checkpoints.save(self.updates, state, self._collector.save(), progress)
        self._kept = self.updates

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            after = (
                f"after {self._kept * self.frames_per_update:,} frames"
                if self._kept
                else "from the start"
            )
            raise TrainingError(
                f"{self.folder}: the training cannot be saved after {self.frames:,} frames: "
                f"{error}. Make space, and run the same command "
                f"again: it continues {after}"
            ) from error

    def _restore(self) -> None:
        faulty = "the folder checkpoints"
        try:
            self._checkpoints = Checkpoints(self.folder / "checkpoints")
            step = self._checkpoints.latest
            if step is not None:
                faulty = f"the checkpoint checkpoints/{step} or metrics.csv"
                self._restore_from(self._checkpoints, step)
        # For damaged files, Orbax, TensorStore, JSON and the emulators' states raise many types.
        except Exception as error:
            self.close()
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:500]
            raise TrainingError(
                f"{self.folder}: {faulty} is damaged, or another version of ocjax wrote it: "
                f"{reason}. Restore the folder from a copy, or train in another one"
            ) from error

    def _restore_from(self, checkpoints: Checkpoints, step: int) -> None:
        state = {"pending": self._pending.result(), "acting": self._acting}
        saved = checkpoints.restore(step, state)
        if jax.tree.map(_form, saved["state"]) != jax.tree.map(_form, state):
            raise ValueError("its arrays have the wrong shapes or types for this training")
        updates = integer("the number of updates", saved["progress"]["updates"], step, step)
        self._pending = _completed(saved["state"]["pending"])
        self._acting = saved["state"]["acting"]
        self._collector.restore(saved["environments"], updates)
        self.metrics.restore(saved["progress"]["metrics"], updates)
        self.updates = self._kept = updates

    def close(self) -> None:
        """Close the environments, the checkpoints and the files, even after an error in one."""
        with contextlib.ExitStack() as stack:
            stack.callback(self._collector.close)
            stack.callback(self.metrics.close)
            if self._checkpoints is not None:
                stack.callback(self._checkpoints.close)


def _form(leaf: Any) -> str:
    array = np.asarray(leaf)
    return f"{array.dtype.kind} {list(array.shape)}"


def _completed(result: _Updated) -> Future[_Updated]:
    future: Future[_Updated] = Future()
    future.set_result(result)
    return future
