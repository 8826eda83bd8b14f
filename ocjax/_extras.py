"""Optional packages.

The error for a missing package says how to install it.
"""

import contextlib
import importlib
from collections.abc import Iterator
from typing import Any

INSTALL = {  # argument of `pip install` for each package
    "cv2": "opencv-python-headless",
    "envpool": "'ocjax[envpool]'",
    "gymnax": "gymnax",
    "h5py": "'ocjax[data]'",
    "jaxtari": "jaxtari",
    "matplotlib": "matplotlib",
    "minari": "'ocjax[data]'",
    "optax": "'ocjax[rl]'",
    "orbax": "'ocjax[rl]'",
    "pandas": "'ocjax[data]'",
    "pyarrow": "'ocjax[data]'",
    "pygame": "'ocjax[play]'",
    "ray": "'ocjax[ray]'",
    "stable_baselines3": "'ocjax[sb3]'",
    "tensorboardX": "'ocjax[rl]'",
    "torch": "'ocjax[sb3]'",
    "zarr": "'ocjax[data]'",
}


class MissingExtraError(ModuleNotFoundError):
    """A package is not installed; the message says how to install it."""


@contextlib.contextmanager
def extras() -> Iterator[None]:
    """A block that imports packages of extras."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in INSTALL:
            raise
        raise MissingExtraError(
            f"{package} is not installed: pip install {INSTALL[package]}", name=error.name
        ) from error


def require(module: str) -> Any:
    """Import a module of an optional package."""
    with extras():
        return importlib.import_module(module)
