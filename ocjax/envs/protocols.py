"""The evaluation protocols of environment ids, as ale-py registers them with Gymnasium."""

import re
from typing import Any

from ocjax.emulators.settings import PRESETS
from ocjax.extraction.names import ENDINGS

# The settings that an id of version 0 or 4 fixes.
FIXED = (
    "frame_skip",
    "repeat_action_probability",
    "full_action_space",
)
_ID = re.compile(
    r"(?:(?:ale_py|ocjax):)?(?:(?:ALE|ocjax)/)?\w+?(?:-ram)?"
    r"(?P<kind>Deterministic|NoFrameskip)?(?:-ram)?-v(?P<version>\d+)"
)


def preset_of(name: str, preset: str | None, **explicit: Any) -> str:
    """The preset that a game's name and the caller's arguments select.

    Args:
        name: a game's name in any spelling. An id of version 0 or 4 implies its preset.
        preset: the caller's preset, or None.
        explicit: the caller's settings, with None for missing ones.
    """
    found = _ID.fullmatch(name)
    if found is None:
        return preset or "v5"
    suffix = f"{found['kind'] or ''}-v{found['version']}"
    if suffix not in ENDINGS:
        raise ValueError(f"no environment {name!r}: ids of Atari games end in {', '.join(ENDINGS)}")
    named = ENDINGS[suffix]
    if named == "v5":
        return preset or named
    wanted = {field: explicit[field] for field in FIXED if explicit.get(field) is not None}
    changed = [
        f"{field}={value!r}"
        for field, value in wanted.items()
        if value != getattr(PRESETS[named], field)
    ]
    if preset not in (None, named):
        changed.append(f"preset={preset!r}")
    if changed:
        game = re.split(r"-ram|Deterministic|NoFrameskip|-v", name)[0]
        raise ValueError(
            f"{name!r} names the protocol {named!r}, which {' and '.join(changed)} contradicts: "
            f"give the game as {game!r} instead"
        )
    return named
