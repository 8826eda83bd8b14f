"""Validation of the arguments of environments and pools, before any change."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np

NOT_RESET = (
    "the environments have not been reset: call reset() before the first step, and after a call "
    "that was interrupted"
)
_LARGEST_SEED = 2**63 - 1  # workers receive seeds as int64


class Uncopied:
    """Base of classes with emulators, which cannot be pickled or copied."""

    SAVED = (
        "clone_state() for restore_state(), States.to_bytes() for a file, and the arguments, "
        "which the `spec` of an environment has"
    )

    def __reduce__(self) -> Any:
        """Raise a TypeError that names the alternatives."""
        raise TypeError(
            f"{type(self).__name__} cannot be pickled or copied, because its emulators cannot. "
            f"Save instead: {self.SAVED}"
        )


def is_integer(value: Any) -> TypeGuard[int]:
    """True for Python and NumPy integers, but not for bools."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def integer(name: str, value: Any, least: int, most: int) -> int:
    """A numeric argument as an int."""
    if not is_integer(value) or not least <= value <= most:
        raise ValueError(
            f"{name} must be an integer of at least {least:,} and at most {most:,}, got {value!r}"
        )
    return int(value)


def action_array(actions: Any, count: int, num_actions: int) -> np.ndarray:
    """Actions as an array, integers `[count]`."""
    actions = np.asarray(actions)
    if actions.shape != (count,) or not np.issubdtype(actions.dtype, np.integer):
        raise ValueError(
            f"actions must be {count} integers, got {actions.dtype} of shape {actions.shape}"
        )
    if actions.min() < 0 or actions.max() >= num_actions:
        raise ValueError(
            f"actions must be from 0 to {num_actions - 1}, got {actions.min()} to {actions.max()}"
        )
    return actions


def index_array(ids: Any, num_envs: int) -> np.ndarray:
    """Indices of environments as an array, integers `[n]`."""
    ids = np.asarray(ids)
    integers = ids.ndim == 1 and len(ids) and np.issubdtype(ids.dtype, np.integer)
    if not integers or ids.min() < 0 or ids.max() >= num_envs or len(np.unique(ids)) < len(ids):
        raise ValueError(f"env_id must be distinct integers from 0 to {num_envs - 1}, got {ids!r}")
    return ids


def mask_array(name: str, mask: Any, num_envs: int) -> np.ndarray:
    """A mask as an array, bool `[num_envs]`, with None for all environments."""
    if mask is None:
        return np.ones(num_envs, bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (num_envs,):
        raise ValueError(f"{name} must be a bool array of shape ({num_envs},), got {mask!r}")
    return mask


def reset_mask(options: Mapping[str, Any] | None, num_envs: int) -> np.ndarray | None:
    """The environments to reset, bool `[num_envs]`; None for all."""
    options = dict(options or {})
    mask = options.pop("reset_mask", None)
    if options:
        raise ValueError(f"unknown options {sorted(options)}: the only option is reset_mask")
    if mask is None:
        return None
    mask = mask_array("reset_mask", mask, num_envs)
    if not mask.any():
        raise ValueError("reset_mask must select an environment, got an array that is all False")
    return mask


def seeds_of(seed: Any, num_envs: int) -> list[int | None] | None:
    """The seed of environment i: `seed + i`, or entry i of a sequence; None without a seed."""
    if seed is None:
        return None
    return seed_list(range(seed, seed + num_envs) if is_integer(seed) else seed, num_envs)


def seed_list(seeds: Any, num_envs: int) -> list[int | None]:
    """Seeds as a list of `num_envs` entries, which are numbers or None."""
    values = list(seeds) if isinstance(seeds, Sequence | np.ndarray) else []
    wrong = [s for s in values if s is not None and not (is_integer(s) and 0 <= s <= _LARGEST_SEED)]
    if len(values) != num_envs or wrong:
        raise ValueError(
            f"seed must be an integer from 0 to 2**63 - 1, or {num_envs} of them with one for "
            f"each environment, got {seeds!r}"
        )
    return [None if s is None else int(s) for s in values]
