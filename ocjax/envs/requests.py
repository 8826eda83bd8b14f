"""Parse the requested observations and extraction mode."""

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

from ocjax.envs.features import Vector
from ocjax.envs.observations import (
    Computed,
    Copied,
    Dqn,
    Masks,
    ObjectFields,
    Pixels,
    Ram,
    TerrainCells,
)

Kind = Computed | Copied
NAMES: Mapping[str, Kind] = {
    "objects": ObjectFields(),
    "vector": Vector(),
    "dqn": Dqn(),
    "pixels": Pixels(),
    "ram": Ram(),
    "object_masks": Masks("object"),
    "binary_masks": Masks("binary"),
    "class_masks": Masks("class"),
    "planes": Masks("planes"),
    "terrain": TerrainCells(),
}

# One kind by name or as an instance, several by name, or a dict of either.
Request = str | Kind | Sequence[str] | Mapping[str, str | Kind]


def parse(request: Request) -> Kind | dict[str, Kind]:
    """Parse a request to one kind of observation, or to a dict of kinds by name."""
    if isinstance(request, Kind):
        return request
    if isinstance(request, str):
        if request not in NAMES:
            raise ValueError(
                f"no observation {request!r}: there are {', '.join(NAMES)}, and the classes in "
                "ocjax.envs with options"
            )
        return NAMES[request]
    named = request if isinstance(request, Mapping) else {name: name for name in request}
    if not named:
        raise ValueError(f"obs must name at least one observation, got {request!r}")
    out: dict[str, Kind] = {}
    for name, one in named.items():
        kind = parse(one)
        if isinstance(kind, dict):
            raise ValueError(f"obs must map names to single observations, got {request!r}")
        out[name] = kind
    return out


Mode = Literal["rem", "vem", "both", "raw"]
MODES = get_args(Mode)


def requested_kinds(mode: str, obs: Request | None) -> tuple[dict[str, Kind], bool]:
    """The kinds of observations that an environment must compute, by name.

    Also returns whether the request is for a single kind, which has the name "". The default is the
    objects, or in mode "raw" the RAM.
    """
    if mode not in MODES:
        raise ValueError(
            f"mode must be one of {MODES}, got {mode!r}; the mode of the game is game_mode"
        )
    parsed = parse(obs if obs is not None else "ram" if mode == "raw" else "objects")
    kinds = parsed if isinstance(parsed, dict) else {"": parsed}
    for kind in kinds.values():
        if kind.needs_objects and mode == "raw":
            raise ValueError(
                f"{kind} shows objects, which mode 'raw' does not extract: use mode 'rem' or 'vem'"
            )
    return kinds, not isinstance(parsed, dict)


def required_screens(mode: str, kinds: Mapping[str, Kind]) -> set[str]:
    """The pixel arrays that the mode and the observations need."""
    needed = {name for kind in kinds.values() for name in kind.screens}
    return needed | {"screen"} if mode in ("vem", "both") else needed
