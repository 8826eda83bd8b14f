"""Complete games played by a policy."""

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from ocjax.emulators.hooks import Hooks
from ocjax.emulators.progress import progress, progress_bar
from ocjax.emulators.settings import settings
from ocjax.envs import AlePool, Settings
from ocjax.evaluation.tables import Table
from ocjax.extraction.game import Game
from ocjax.play import policies
from ocjax.play.stepping import steps
from ocjax.transforms.drawing import overlay

MOST_ENVS = 32
DEFAULT_PRESET = "dqn"  # for policies without training settings
PROGRESS = "games, {task.fields[frames]:,} emulated frames"
PICTURE_STEPS = 600  # steps of the first game to draw
EPISODES = 10  # games that show how well a policy plays


class _Moment(NamedTuple):
    screen: np.ndarray  # uint8 [H, W]
    ram: np.ndarray  # uint8 [128]


@dataclasses.dataclass(frozen=True)
class Played:
    """The games that a policy has played, by instance and then in order of time.

    Args:
        returns: float64 `[n]`, the sums of the emulator's rewards.
        frames: int64 `[n]`, emulated frames.
        settings: the settings of the emulators.
        pictures: the first steps of the first game with the objects drawn; empty unless requested.
    """

    returns: np.ndarray
    frames: np.ndarray
    settings: Settings
    pictures: list[Image.Image]


def play(
    game: Game,
    policy: str,
    episodes: int,
    *,
    seed: int = 0,
    pictures: bool = False,
    with_terrain: bool = False,
    hook: Hooks = None,
    preset: str | None = None,
    frame_skip: int | None = None,
    repeat_action_probability: float | None = None,
) -> Played:
    """Play complete games, by default under the settings of a policy's training.

    A game counts from its start to its end, even if the policy was trained with episodes of one
    life. Instances play equally many games (plus or minus one), so that short games do not count
    more often.

    Args:
        policy: a name or path; see `ocjax.play.policies.make_policy`.
        pictures: whether to draw the first game.
        with_terrain: whether to paint the terrain into the pictures.
        hook: a hook, such as the name of a variation; see `ocjax.make_vec`. The next three replace
            the settings of the training.
    """
    n = min(episodes, MOST_ENVS)
    quota = episodes // n + (np.arange(n) < episodes % n)
    needed = policies.needs(policy, game)
    trained = needed.settings if preset is None else None
    changes: dict[str, Any] = {
        "frame_skip": frame_skip,
        "repeat_action_probability": repeat_action_probability,
        "clip_rewards": False,
    }
    changes = {name: value for name, value in changes.items() if value is not None}
    chosen = dataclasses.replace(trained or settings(preset or DEFAULT_PRESET), **changes)
    screens = (*needed.screens, *["screen"] * pictures)
    with contextlib.closing(AlePool(game, n, chosen, screens=screens, hook=hook)) as pool:
        act = policies.make_policy(policy, game, len(pool.actions), n, seed)
        pool.reset([seed + i for i in range(n)])
        seen: list[_Moment] = []
        played: list[list[tuple[float, int]]] = [[] for _ in range(n)]
        with progress_bar(f"playing {game.name}", PROGRESS, transient=True) as report:
            for i, total, frames in _games(
                pool,
                act,
                seen if pictures else None,
                lambda n: report(sum(map(len, played)), episodes, frames=n),
            ):
                if len(played[i]) < quota[i]:
                    played[i].append((total, frames))
                if all(len(own) == most for own, most in zip(played, quota, strict=True)):
                    break
    returns, frames = zip(*(one for own in played for one in own), strict=True)
    drawn = [
        _picture(game, moment, with_terrain) for moment in progress(seen, f"drawing {game.name}")
    ]
    return Played(np.array(returns), np.array(frames), chosen, drawn)


def _games(
    pool: AlePool, act: policies.Policy, seen: list[_Moment] | None, report: Callable[[int], None]
) -> Iterator[tuple[int, float, int]]:
    """Play without end, and report the frames of all instances.

    Yields the instance, return and emulated frames of each game that ends.
    """
    first, ended = True, 0
    for _ in steps(pool, act):
        if seen is not None and first and len(seen) < PICTURE_STEPS:
            seen.append(_Moment(np.array(pool.screen[0, -1]), np.array(pool.ram[0])))
        first = first and not pool.game_over[0]
        report(ended + int(pool.frame_number.sum()))
        ended += int(pool.frame_number[pool.game_over].sum())
        for i in np.flatnonzero(pool.game_over).tolist():
            yield i, float(pool.episode_return[i]), int(pool.frame_number[i])


def _picture(game: Game, moment: _Moment, with_terrain: bool) -> Image.Image:
    terrain = game.terrain_of(moment.ram) if with_terrain else None
    return overlay(game, moment.screen, game.rem(moment.ram), scale=2, terrain=terrain)


def returns_table(game: Game, played: Played) -> Table:
    """The returns of complete games as a table of one row."""
    r = played.returns
    numbers = {
        "Mean return": r.mean(),
        "Standard deviation": r.std(ddof=1) if len(r) > 1 else 0.0,
        "Least": r.min(),
        "Greatest": r.max(),
        "Mean emulated frames": played.frames.mean(),
    }
    cells = [f"{len(r):,}", *(f"{n:,.1f}" for n in numbers.values())]
    return Table(f"{game.name}: returns of complete games", ("Games", *numbers), [cells])
