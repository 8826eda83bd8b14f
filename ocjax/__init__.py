"""Extract the objects on the screen of Atari 2600 games, for thousands of states at once.

import ocjax

game = ocjax.load("Pong")
objects = game.rem(ram)     # uint8 [..., 128], the console's RAM -> Objects
objects = game.vem(frames)  # uint8 [..., 210, 160] palette indices, or [..., 210, 160, 3] RGB
"""

import importlib
import warnings
from typing import TYPE_CHECKING, Any

from ocjax.extraction import names

if TYPE_CHECKING:
    from ocjax._xla.process import retain_freed_memory, use_compilation_cache
    from ocjax.envs import make, make_vec
    from ocjax.extraction.edits import edit
    from ocjax.extraction.game import Game
    from ocjax.extraction.names import games
    from ocjax.extraction.objects import Objects, velocity
    from ocjax.extraction.registry import load
    from ocjax.transforms.perturbation import perturb
    from ocjax.transforms.relations import Relations, relations
    from ocjax.transforms.segmentation import segment
    from ocjax.transforms.tracking import merge_frames, track

__version__ = "0.2.0"

__all__ = [
    "Game",
    "Objects",
    "Relations",
    "edit",
    "games",
    "load",
    "make",
    "make_vec",
    "merge_frames",
    "perturb",
    "relations",
    "retain_freed_memory",
    "segment",
    "track",
    "use_compilation_cache",
    "velocity",
]

# Imported on first use: importing JAX takes half a second.
_MODULES = (
    "agents",
    "atariari",
    "authoring",
    "datasets",
    "envs",
    "errors",
    "evaluation",
    "files",
    "jaxatari",
    "layouts",
    "ocatari",
    "recordings",
    "sb3",
)
_MODULE_OF = {
    "Game": "extraction.game",
    "Objects": "extraction.objects",
    "Relations": "transforms.relations",
    "edit": "extraction.edits",
    "games": "extraction.names",
    "load": "extraction.registry",
    "make": "envs",
    "make_vec": "envs",
    "merge_frames": "transforms.tracking",
    "perturb": "transforms.perturbation",
    "relations": "transforms.relations",
    "retain_freed_memory": "_xla.process",
    "segment": "transforms.segmentation",
    "track": "transforms.tracking",
    "use_compilation_cache": "_xla.process",
    "velocity": "extraction.objects",
}
# Names of earlier versions, and the public modules that have them now.
_MOVED = {
    "Box": "authoring",
    "Category": "authoring",
    "GameError": "errors",
    "UnknownGameError": "errors",
}

names.register()


def __getattr__(name: str) -> Any:
    """Import public names on first use."""
    if name in _MODULES:
        return importlib.import_module(f"ocjax.{name}")
    if name in _MODULE_OF:
        globals()[name] = value = getattr(
            importlib.import_module(f"ocjax.{_MODULE_OF[name]}"), name
        )
        return value
    if name in _MOVED:
        new = f"ocjax.{_MOVED[name]}"
        warnings.warn(f"ocjax.{name} is now {new}.{name}", DeprecationWarning, stacklevel=2)
        return getattr(importlib.import_module(new), name)
    raise AttributeError(f"module 'ocjax' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_MODULES, "__version__"])
