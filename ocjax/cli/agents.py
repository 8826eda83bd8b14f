"""The commands `ocjax train` and `ocjax play`."""

import dataclasses
import json as json_format
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ocjax._extras import extras
from ocjax.agents.config import EXPERIMENTS, PRESET, Config, Hyperparameters
from ocjax.cli.messages import console
from ocjax.cli.options import START_HELP, Terrain, count_option, fields_as_options
from ocjax.cli.outputs import write_csv, write_markdown, write_text
from ocjax.cli.render import extract, pictures, save
from ocjax.emulators import ram_starts
from ocjax.emulators.settings import PRESETS
from ocjax.evaluation import tables
from ocjax.evaluation.tables import Table
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.play import human as human_play
from ocjax.play import policies, varied
from ocjax.play.games import PICTURE_STEPS, Played
from ocjax.play.games import play as play_games
from ocjax.play.policies import TRAINED

EVALUATION_EPISODES = 10
ENVIRONMENTS = "Environments"  # heading of options
# presets for training
FIXED_SKIP = [name for name, settings in PRESETS.items() if isinstance(settings.frame_skip, int)]
FRAME_TIME = 66  # milliseconds per agent step of an animation: four emulated frames


@fields_as_options(Hyperparameters, "Hyperparameters of PPO")
def train(
    game: Annotated[str, typer.Argument(help="Name of the game.")],
    frames: Annotated[
        int,
        count_option(
            "Emulated frames to train for, counted from the start of the training.", "20M"
        ),
    ] = 20_000_000,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the environments, the network and the actions.")
    ] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the training. Default: ocjax-<Game>-<seed>.")
    ] = None,
    inputs: Annotated[
        str,
        typer.Option(
            metavar="objects|pixels",
            help="Objects from RAM, or four grey frames of 84 x 84 pixels.",
        ),
    ] = "objects",
    experiment: Annotated[
        str,
        typer.Option(
            metavar="|".join(EXPERIMENTS),
            help="Inputs and hyperparameters: ocjax's, or the OCAtari paper's.",
        ),
    ] = "default",
    preset: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help=f"Settings: {', '.join(FIXED_SKIP)}. Default: {PRESET}.",
            rich_help_panel=ENVIRONMENTS,
        ),
    ] = None,
    variation: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help=(
                "Variation of the game, such as lazy_enemy in Pong. May be repeated: all apply "
                "together."
            ),
            rich_help_panel=ENVIRONMENTS,
        ),
    ] = None,
    game_mode: Annotated[
        int | None,
        typer.Option(min=0, help="Game mode as ale-py numbers it.", rich_help_panel=ENVIRONMENTS),
    ] = None,
    game_difficulty: Annotated[
        int | None,
        typer.Option(
            min=0, help="Game difficulty as ale-py numbers it.", rich_help_panel=ENVIRONMENTS
        ),
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE[,...]",
            help=START_HELP,
            rich_help_panel=ENVIRONMENTS,
        ),
    ] = None,
    **hyperparameters: float | None,
) -> None:
    """Train an agent with PPO, and show how it plays.

    To resume from the latest checkpoint, run the command again with the same
    folder. The folder gets the metrics (metrics.csv and tensorboard/),
    checkpoints, the policy (policy.npz) and an animation of a game (agent.gif).
    """
    if inputs not in ("objects", "pixels"):
        raise typer.BadParameter(f"inputs must be objects or pixels, got {inputs!r}")
    variant = {
        "variations": variation or (),
        "game_mode": game_mode,
        "game_difficulty": game_difficulty,
    }
    changes = variant | {
        "seed": seed,
        "inputs": inputs,
        "starts": [ram_starts.parse(text) for text in start or ()],
    }
    changes |= {} if preset is None else {"preset": preset}
    given = {name: value for name, value in hyperparameters.items() if value is not None}
    config = Config.of(experiment, game, given, **changes)
    folder = out or writing.unnamed(Path(f"ocjax-{config.game}-{seed}"))
    _train(config, folder, frames)
    _show(config, folder)


def _train(config: Config, folder: Path, frames: int) -> None:
    with extras():
        from ocjax.agents.training import Trainer
    trainer = Trainer(config, folder)
    try:
        if trainer.frames >= frames:
            console.print(
                f"{folder} has been trained for {trainer.frames:,} frames already: request more "
                "with --frames.",
                soft_wrap=True,
            )
        trainer.run(frames, console)
    finally:
        trainer.close()
    mean = trainer.metrics.mean_return
    writing.announce(
        console,
        f"{trainer.frames:,} frames of {config.game}, mean return of the last games {mean:,.1f}",
        folder,
    )


def _show(config: Config, folder: Path) -> None:
    """Play complete games with a trained policy, its settings and its variations."""
    most = config.settings.max_episode_frames
    varied = f" with {', '.join(config.variations)}" if config.variations else ""
    ordinary = config.game_mode is None and config.game_difficulty is None and not config.starts
    default = "" if ordinary else ", in the default mode and difficulty and from the ordinary start"
    console.print(
        f"Playing {EVALUATION_EPISODES} games of {config.game}{varied}, of at most {most:,} "
        f"emulated frames each{default}."
    )
    spec, policy, picture = (
        registry.load(config.game),
        str(folder / "policy.npz"),
        folder / "agent.gif",
    )
    played = play_games(
        spec, policy, EVALUATION_EPISODES, seed=config.seed, pictures=True, hook=config.variations
    )
    with console.status("writing the animation"):
        save(played.pictures, picture, frame_time=FRAME_TIME)
    tables.show(_table(spec, played), console)
    writing.announce(console, f"The first {len(played.pictures):,} steps of a game", picture)


def play(
    game: Annotated[str, typer.Argument(help="Name of the game.")],
    policy: Annotated[
        str,
        typer.Option(
            metavar="trained|random|repeat|FILE",
            help=(
                "trained (ships with ocjax), random, repeat, or a file of a saved "
                "policy: .npz, or .zip of Stable-Baselines3."
            ),
        ),
    ] = TRAINED,
    episodes: Annotated[int, typer.Option(min=1, help="Games to play.")] = EVALUATION_EPISODES,
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
    protocol = {
        "preset": preset,
        "frame_skip": frame_skip,
        "repeat_action_probability": repeat_action_probability,
    }
    writing.check_suffix(gif, (".gif",))
    if terrain:
        spec.require_terrain()
        if gif is None and not human:
            raise ValueError("--terrain paints into a picture: it needs --gif or --human")
    if human:
        plays = (
            csv is not None
            or variations is not None
            or policy != TRAINED
            or episodes != EVALUATION_EPISODES
        )
        if plays or any(value is not None for value in protocol.values()):
            raise ValueError(
                "--policy, --episodes, --variations, --csv and the settings are for a policy "
                "that plays: they do not apply with --human"
            )
        recording = out or writing.unnamed(Path(f"ocjax-{spec.name}.npz"))
        animation = gif or writing.unnamed(Path(f"ocjax-{spec.name}.gif"))
        _play_by_hand(spec, seed, recording, animation, terrain)
        return
    if out is not None:
        raise ValueError(
            "--out needs --human, and names its recording; `ocjax dataset` records the play "
            "of policies"
        )
    if variations is not None:
        if csv is not None or gif is not None:
            raise ValueError(
                "--csv and --gif apply only to the original game: with --variations, use "
                "--markdown and --json"
            )
        writing.check(markdown, json, reads=[policies.file_of(policy)])
        rows = varied.compare(
            spec, policy, varied.chosen(spec, variations), episodes, seed=seed, **protocol
        )
        _show_rows(spec, policy, rows, markdown, json)
        return
    if markdown is not None or json is not None:
        raise ValueError("--markdown and --json need --variations, and write its comparison")
    writing.check(csv, gif, reads=[policies.file_of(policy)])
    drawing = {"pictures": gif is not None, "with_terrain": terrain}
    played = play_games(spec, policy, episodes, seed=seed, **drawing, **protocol)
    tables.show(_table(spec, played), console)
    write_csv(csv, ("episode", "return", "frames"), _csv_rows(played))
    if gif is not None:
        save(played.pictures, gif, frame_time=FRAME_TIME)
        writing.announce(console, "The first game", gif)


def _show_rows(
    game: Game, policy: str, rows: Sequence[varied.Row], markdown: Path | None, json: Path | None
) -> None:
    table = varied.table(game, policy, rows)
    tables.show(table, console)
    write_markdown(markdown, [table])
    about = {
        "game": game.name,
        "policy": policy,
        "variations": [dataclasses.asdict(row) for row in rows],
    }
    write_text(json, json_format.dumps(about, indent=2) + "\n")


def _play_by_hand(game: Game, seed: int, out: Path, gif: Path, with_terrain: bool) -> None:
    """Let a person play, and write the recording and an animation of its first steps."""
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
        save([*drawn], gif, frame_time=FRAME_TIME)
    writing.announce(console, "The first steps", gif)


def _table(game: Game, played: Played) -> Table:
    r = played.returns
    numbers = (
        r.mean(),
        r.std(ddof=1) if len(r) > 1 else 0.0,
        r.min(),
        r.max(),
        played.frames.mean(),
    )
    header = (
        "Games",
        "Mean return",
        "Standard deviation",
        "Least",
        "Greatest",
        "Mean emulated frames",
    )
    return Table(
        f"{game.name}: returns of complete games",
        header,
        [[f"{len(r):,}", *(f"{n:,.1f}" for n in numbers)]],
    )


def _csv_rows(played: Played) -> list[tuple[int, str, int]]:
    games = zip(played.returns.tolist(), played.frames.tolist(), strict=True)
    return [(i, f"{total:g}", frames) for i, (total, frames) in enumerate(games)]
