"""Environments with the observation errors of a detector."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector import VectorWrapper

from ocjax.envs.observations import object_space
from ocjax.envs.vector import ObjectVectorEnv
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import FIELDS
from ocjax.transforms.perturbation import perturb


class PerturbObjects(VectorWrapper):
    """Perturb the observed objects of a vector environment; see `ocjax.perturb`.

        envs = PerturbObjects(
            ocjax.make_vec("Pong", num_envs=64), jax.random.key(0), jitter=2, drop=0.1
        )
        envs.unwrapped.objects  # the true objects

    Every observation gets new errors, including the terminal ones in `final_obs`. `info` and
    rewards are unchanged.

    Args:
        env: a vector environment with the observation "objects" and one extraction method.
        key: a key of `jax.random`.
        errors: `jitter`, `drop`, `swap` and `invent` of `ocjax.perturb`.

    Raises:
        TypeError: the environment is not one of ocjax's vector environments.
        ValueError: the environment has another observation, or an error is out of range.
    """

    def __init__(self, env: Any, key: jax.Array, **errors: Any) -> None:
        if not isinstance(env.unwrapped, ObjectVectorEnv):
            raise TypeError(f"env must be a vector environment of ocjax, got {env!r}")
        if env.single_observation_space != object_space(env.unwrapped.game):
            raise ValueError(
                "the observation must be 'objects' of one method, got the space "
                f"{env.single_observation_space}"
            )
        super().__init__(env)
        self._game, self._key, self._errors = env.unwrapped.game, key, errors
        self._perturbed(
            jax.tree.map(np.zeros_like, env.observation_space.sample())
        )  # checks the errors

    def reset(self, **options: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Reset the environments; see `ObjectVectorEnv.reset`."""
        observation, info = self.env.reset(**options)
        return self._perturbed(observation), info

    def step(
        self, actions: Any
    ) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take a step; see `ObjectVectorEnv.step`."""
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if "final_obs" in info:
            for i in np.flatnonzero(info["_final_obs"]):
                info["final_obs"][i] = self._perturbed(info["final_obs"][i])
        return self._perturbed(observation), reward, terminated, truncated, info

    def _perturbed(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        self._key, key = jax.random.split(self._key)
        fields = {name: jnp.asarray(observation[name]) for name in FIELDS}
        noisy = perturb(
            key,
            Objects(**fields | {"valid": fields["valid"] != 0}, game=self._game),
            **self._errors,
        )
        return {name: np.array(getattr(noisy, name), observation[name].dtype) for name in FIELDS}
