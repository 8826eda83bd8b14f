"""Option names of other projects."""

import functools
from collections.abc import Callable, Iterable
from typing import Any, ParamSpec, TypeVar

from ocjax.emulators.checks import is_integer
from ocjax.extraction.names import did_you_mean

P = ParamSpec("P")
T = TypeVar("T")

# ale-py's names of options that ocjax has under another name.
SAME = {
    "frameskip": "frame_skip",
    "difficulty": "game_difficulty",
    "max_num_frames_per_episode": "max_episode_frames",
}
MODES = {"ram": "rem", "vision": "vem"}  # OCAtari's names of the two methods
# Options that only other projects have, and what to use instead.
_INSTEAD = {
    "obs_type": "it is called obs, with 'ram' or 'pixels'",
    "obs_mode": "it is called obs, with 'objects', 'vector', 'dqn' or 'pixels'",
    "seed": "it is an argument of reset",
    "sticky_actions": "it is called repeat_action_probability",
    **dict.fromkeys(
        ("stack_num", "frame_stack", "stack_size"),
        "obs=ocjax.envs.Dqn(stack=4) stacks frames, obs=ocjax.envs.Vector(history=4) vectors",
    ),
    "vectorization_mode": "it is an option of gymnasium.make_vec",
}


def accepts_other_names(make: Callable[P, T]) -> Callable[P, T]:
    """Let a function that makes environments accept the option names of other projects."""

    @functools.wraps(make)
    def wrapped(*args: P.args, **options: P.kwargs) -> T:
        return make(*args, **in_our_names(options))  # pyright: ignore[reportCallIssue]

    return wrapped


def in_our_names(options: dict[str, Any]) -> dict[str, Any]:
    """Replace the option names of other projects by ocjax's."""
    out = dict(options)
    for theirs, ours in SAME.items():
        if theirs in out:
            _move(out, theirs, ours)
    if is_integer(out.get("mode")):  # ale-py's name of the game mode
        _move(out, "mode", "game_mode")
    elif isinstance(out.get("mode"), str):
        out["mode"] = MODES.get(out["mode"], out["mode"])
    return out


def _move(options: dict[str, Any], theirs: str, ours: str) -> None:
    if ours in options:
        raise TypeError(f"{theirs} and {ours} are names of one option: give one of them")
    options[ours] = options.pop(theirs)


def no_option(name: str, options: Iterable[str]) -> TypeError:
    """The error for an unknown option, with a hint at the right one."""
    hint = f": {_INSTEAD[name]}" if name in _INSTEAD else did_you_mean(name, options)
    hint = hint or ": help(ocjax.make_vec) explains all options"
    return TypeError(f"environments of ocjax have no option {name}{hint}")
