"""The names of the games. Every file and folder in `ocjax/extractors` is a game.

This module imports no game, JAX or ale-py, so `import ocjax` and `ocjax --help` stay fast.
"""

import difflib
import functools
import importlib
import pkgutil
from collections.abc import Iterable

from ocjax.console.rom_files import game_name, rom_names
from ocjax.extraction.suites import SUITES, Suite

__all__ = [
    "ENDINGS",
    "TITLES",
    "did_you_mean",
    "env_id",
    "games",
    "modules",
    "register",
    "suite_of",
]

TITLES = {  # modules of games by their other titles
    "jamesbond007": "jamesbond",
    "montezumasrevenge": "montezumarevenge",
    "pitfallii": "pitfall2",
}


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of an error about a name, ": did you mean Ball?"; empty without a similar name."""
    spelled = {own.lower(): own for own in known}
    close = difflib.get_close_matches(name.lower(), spelled, cutoff=0.5)
    return f": did you mean {' or '.join(spelled[key] for key in close)}?" if close else ""


@functools.cache
def modules() -> tuple[str, ...]:
    """Return the sorted names of the games' modules in `ocjax.extractors`."""
    extractors = importlib.import_module("ocjax.extractors")
    return tuple(
        sorted(
            m.name for m in pkgutil.iter_modules(extractors.__path__) if not m.name.startswith("_")
        )
    )


@functools.cache
def games(suite: str | None = None) -> tuple[str, ...]:
    """Return the sorted names of the supported games, as in Gymnasium's "ALE/<Name>-v5".

    Args:
        suite: return only the games of a suite: "atari100k", "atari5", "atari10", "atari57" or
            "ocatari". `ocjax.extraction.suites` has the complete lists.

    Raises:
        ValueError: the suite does not exist.
    """
    # Modules have the names of games in lower case.
    by_module = {name.lower(): name for name in map(game_name, rom_names())}
    supported = tuple(by_module.get(module, module) for module in modules())
    known = supported if suite is None else suite_of(suite).games
    return tuple(name for name in supported if name in known)


def suite_of(name: str) -> Suite:
    """Return a suite by its name."""
    if name not in SUITES:
        raise ValueError(f"no suite {name!r}: there are {', '.join(SUITES)}")
    return SUITES[name]


ENDINGS = {  # the preset for each ending of an environment's id
    "-v5": "v5",
    "-v4": "v4",
    "-v0": "v0",
    "Deterministic-v4": "deterministic-v4",
    "Deterministic-v0": "deterministic-v0",
    "NoFrameskip-v4": "noframeskip",
    "NoFrameskip-v0": "noframeskip-v0",
}


def env_id(name: str) -> str:
    """Return the Gymnasium id of a game's environments."""
    return f"ocjax/{name}-v5"


def register() -> None:
    """Register every game's environments with Gymnasium, with the same endings as ale-py.

    Gymnasium 1.0 has no plugins, so importing ocjax registers ids such as "ocjax/Pong-v5".
    `gymnasium.make("ocjax:ocjax/Pong-v5")` imports ocjax first.
    """
    import gymnasium

    for name in games():
        for end, preset in ENDINGS.items():
            if f"ocjax/{name}{end}" not in gymnasium.registry:
                gymnasium.register(
                    f"ocjax/{name}{end}",
                    "ocjax.envs.make:make",
                    vector_entry_point="ocjax.envs.make:make_vec",
                    kwargs={"game": name, "preset": preset},
                )
