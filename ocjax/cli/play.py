"""The command `ocjax play`."""

import dataclasses
import json as json_format
from pathlib import Path
from typing import Annotated, Any

import typer

from ocjax.cli.animations import STEP_TIME, extract, pictures, save
from ocjax.cli.messages import console
from ocjax.cli.options import Terrain
from ocjax.cli.outputs import write_csv, write_markdown, write_text
from ocjax.emulators.settings import PRESETS
from ocjax.evaluation import tables
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.play import human as human_play
from ocjax.play import policies, varied
from ocjax.play.games import EPISODES, PICTURE_STEPS, Played, returns_table
from ocjax.play.games import play as play_games
from ocjax.play.policies import TRAINED


def play(
    game: Annotated[str, typer.Argument(help="Name of the game.")],
    policy: Annotated[
        str | None,
        typer.Option(
            show_default=TRAINED,
            metavar="trained|random|repeat|FILE",
            help=(
                "trained (ships with ocjax), random, repeat, or a file of a saved "
                "policy: .npz, or .zip of Stable-Baselines3."
            ),
        ),
    ] = None,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Games to play.", show_default=str(EPISODES))
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the emulators and the actions.")] = 0,
    preset: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help=f"Settings: {', '.join(PRESETS)}. Default: from the policy's training, or dqn.",
        ),
    ] = None,
    frame_skip: Annotated[
        int | None,
        typer.Option(min=1, help="Emulated frames per step. Default: from the settings."),
    ] = None,
    repeat_action_probability: Annotated[
        float | None,
        typer.Option(
            min=0,
            help="Probability of repeating an action on a frame. Default: from the settings.",
        ),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(help="Write the return and the emulated frames of each game as CSV."),
    ] = None,
    gif: Annotated[
        Path | None, typer.Option(help="Write an animation of the first game, with its objects.")
    ] = None,
    variations: Annotated[
        str | None,
        typer.Option(
            help=(
                "Compare the original with variations: all, objects (categories are removed and "
                "frozen), or names with commas."
            )
        ),
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Write the comparison of variations as Markdown.")
    ] = None,
    json: Annotated[
        Path | None, typer.Option(help="Write the comparison of variations as JSON.")
    ] = None,
    human: Annotated[
        bool, typer.Option("--human", help="Play yourself, in a window that shows the objects.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Recording of what you play. Default with --human: ocjax-<Game>.npz."),
    ] = None,
    terrain: Terrain = False,
) -> None:
    """Let a policy play complete games, under the settings of its training.

    With --variations, the policy plays the original game and each variation
    with the same seeds, and a table compares the returns.

    With --human, you play in a window: arrows or wasd move, space fires, and
    Escape ends. Your play is saved as an animation and as a recording for
    `ocjax evaluate`, `ocjax render` and `ocjax extract`.
    """
    spec = registry.load(game)
    settings = {
        "preset": preset,
        "frame_skip": frame_skip,
        "repeat_action_probability": repeat_action_probability,
    }
    writing.check_suffix(gif, (".gif",))
    if terrain:
        _check_terrain(spec, drawn=human or gif is not None)
    if human:
        _reject(
            "--policy, --episodes, --variations, --csv and the settings are for a policy that "
            "plays: they do not apply with --human",
            *(policy, episodes, variations, csv, *settings.values()),
        )
        _play_by_hand(spec, seed, out, gif, terrain)
        return
    _reject(
        "--out needs --human, and names its recording; `ocjax dataset` records the play of "
        "policies",
        out,
    )
    agent = _Agent(spec, policy or TRAINED, episodes or EPISODES, seed, settings)
    if variations is not None:
        _reject(
            "--csv and --gif apply only to the original game: with --variations, use --markdown "
            "and --json",
            *(csv, gif),
        )
        _compare(agent, variations, markdown, json)
        return
    _reject("--markdown and --json need --variations, and write its comparison", markdown, json)
    _play(agent, csv, gif, terrain)


@dataclasses.dataclass(frozen=True)
class _Agent:
    """A policy and its games; `settings` that are not None replace those of its training."""

    game: Game
    policy: str
    episodes: int
    seed: int
    settings: dict[str, Any]


def _reject(message: str, *options: Any) -> None:
    """Raise ValueError if an option is given, so that it differs from None and False."""
    if any(option is not None and option is not False for option in options):
        raise ValueError(message)


def _check_terrain(game: Game, *, drawn: bool) -> None:
    game.require_terrain()
    if not drawn:
        raise ValueError("--terrain paints into a picture: it needs --gif or --human")


def _play(agent: _Agent, csv: Path | None, gif: Path | None, with_terrain: bool) -> None:
    """Let a policy play the original game."""
    writing.check(csv, gif, reads=[policies.file_of(agent.policy)])
    played = play_games(
        agent.game,
        agent.policy,
        agent.episodes,
        seed=agent.seed,
        pictures=gif is not None,
        with_terrain=with_terrain,
        **agent.settings,
    )
    tables.show(returns_table(agent.game, played), console)
    write_csv(csv, ("episode", "return", "frames"), _csv_rows(played))
    if gif is not None:
        save(played.pictures, gif, frame_time=STEP_TIME)
        writing.announce(console, "The first game", gif)


def _compare(agent: _Agent, variations: str, markdown: Path | None, json: Path | None) -> None:
    """Let a policy play the original game and variations."""
    game = agent.game
    writing.check(markdown, json, reads=[policies.file_of(agent.policy)])
    names = varied.chosen(game, variations)
    rows = varied.compare(
        game, agent.policy, names, agent.episodes, seed=agent.seed, **agent.settings
    )
    table = varied.table(game, agent.policy, rows)
    tables.show(table, console)
    write_markdown(markdown, [table])
    about = {
        "game": game.name,
        "policy": agent.policy,
        "variations": [dataclasses.asdict(row) for row in rows],
    }
    write_text(json, json_format.dumps(about, indent=2) + "\n")


def _play_by_hand(
    game: Game, seed: int, out: Path | None, gif: Path | None, with_terrain: bool
) -> None:
    """Let a person play, and write the recording and an animation of its first steps."""
    out = out or writing.unnamed(Path(f"ocjax-{game.name}.npz"))
    gif = gif or writing.unnamed(Path(f"ocjax-{game.name}.gif"))
    writing.check(out, suffixes=(".npz",))
    writing.check(gif)
    playing = human_play.HumanGame(game, seed, with_terrain=with_terrain)
    try:
        human_play.play(playing)
    except RuntimeError as error:
        raise ValueError(f"no window can be opened ({error})") from error
    tape = playing.recording()
    tape.write(out)
    writing.announce(console, f"{len(tape):,} samples of {game.name}", out)
    samples = slice(0, min(len(tape), PICTURE_STEPS))
    with console.status("drawing"):
        objects = extract(tape, ("REM",), samples)
        drawn = pictures(tape, objects, samples, scale=2, with_terrain=with_terrain)
        save([*drawn], gif, frame_time=STEP_TIME)
    writing.announce(console, "The first steps", gif)


def _csv_rows(played: Played) -> list[tuple[int, str, int]]:
    games = zip(played.returns.tolist(), played.frames.tolist(), strict=True)
    return [(i, f"{total:g}", frames) for i, (total, frames) in enumerate(games)]
