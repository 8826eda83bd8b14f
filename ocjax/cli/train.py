"""The command `ocjax train`."""

from pathlib import Path
from typing import Annotated

import typer

from ocjax._extras import extras
from ocjax.agents.config import EXPERIMENTS, PRESET, Config, Hyperparameters
from ocjax.cli.animations import STEP_TIME, save
from ocjax.cli.messages import console
from ocjax.cli.options import START_HELP, count_option, fields_as_options
from ocjax.emulators import ram_starts
from ocjax.emulators.settings import PRESETS
from ocjax.evaluation import tables
from ocjax.extraction import registry
from ocjax.files import writing
from ocjax.play.games import EPISODES, play, returns_table

ENVIRONMENTS = "Environments"  # heading of options
# presets for training
FIXED_SKIP = [name for name, settings in PRESETS.items() if isinstance(settings.frame_skip, int)]


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
    changes = {
        "seed": seed,
        "inputs": inputs,
        "preset": PRESET if preset is None else preset,
        "variations": variation or (),
        "game_mode": game_mode,
        "game_difficulty": game_difficulty,
        "starts": [ram_starts.parse(text) for text in start or ()],
    }
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
        f"Playing {EPISODES} games of {config.game}{varied}, of at most {most:,} "
        f"emulated frames each{default}."
    )
    spec = registry.load(config.game)
    policy = str(folder / "policy.npz")
    picture = folder / "agent.gif"
    played = play(spec, policy, EPISODES, seed=config.seed, pictures=True, hook=config.variations)
    with console.status("writing the animation"):
        save(played.pictures, picture, frame_time=STEP_TIME)
    tables.show(returns_table(spec, played), console)
    writing.announce(console, f"The first {len(played.pictures):,} steps of a game", picture)
