"""The commands `ocjax ram ...`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ocjax import recordings, registry, report
from ocjax.recordings import Recording
from ocjax.rollout import PolicyError, rollout
from ocjax.spec import Game

app = typer.Typer(no_args_is_help=True, help="Reverse-engineer a game's RAM.")
console = Console()

GAME = typer.Argument(metavar="GAME", help="Name of the game.")
WHAT = typer.Argument(metavar="GAME|RECORDING", help="A game to play, or an .npz recording with frames.")
SAMPLES = typer.Option(min=100, help="Samples of the play.")
POLICY = typer.Option(help="random, repeat, or an .npz file of a saved policy.")
SEED = typer.Option(min=0)
MODE = typer.Option("--mode", help="Game mode as ale-py numbers it.")
MARKDOWN = typer.Option(help="Write the table as Markdown.")


def _game(name: str) -> Game:
    try:
        return registry.load(name)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def _tape(what: str, samples: int, policy: str, seed: int, game_mode: int | None) -> Recording:
    try:
        if what.endswith(".npz"):
            return recordings.read(what)
        return rollout(registry.load(what), samples, policy=policy, seed=seed, game_mode=game_mode)
    except (OSError, ValueError, PolicyError) as error:
        raise typer.BadParameter(str(error)) from error


def _give(tables: list[report.Table], markdown: Path | None) -> None:
    for table in tables:
        report.show(table, console)
    if markdown is not None:
        markdown.write_text(report.to_markdown(tables))
        console.print(f"written: [bold]{markdown}[/bold]")


@app.command()
def correlate(
    what: Annotated[str, WHAT],
    target: Annotated[str, typer.Option(help="vem: what the vision rules see; sprites: what the video chip drew.")] = "vem",
    samples: Annotated[int, SAMPLES] = 2000,
    policy: Annotated[str, POLICY] = "repeat",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    markdown: Annotated[Path | None, MARKDOWN] = None,
) -> None:
    """Which bytes, nibbles or bits explain each number of each object that is seen; fitted on half the episodes, scored on the others.

    For a game whose decoder is not written yet, its vision rules are enough: let decode return empty boxes.
    """
    from ocjax.analysis import correlate as c

    if target not in ("vem", "sprites"):
        raise typer.BadParameter(f"target must be vem or sprites, got {target!r}")
    tape = _tape(what, samples, policy, seed, game_mode)
    if tape.screens is None or (target == "sprites" and tape.shown is None):
        raise typer.BadParameter(f"{what} has no array {'screens' if tape.screens is None else 'shown'}: there is nothing to explain")
    with console.status("searching"):
        found = list(c.correlate(tape, target))
    _give([c.to_table(found, f"{tape.game.name}: what explains what is seen, percent of {len(tape):,} samples")], markdown)


@app.command()
def causes(
    name: Annotated[str, GAME],
    steps: Annotated[int, typer.Option(min=0, help="Agent steps of random play before the state.")] = 200,
    frames: Annotated[int, typer.Option(min=2, help="Emulated frames after each change.")] = 2,
    values: Annotated[int, typer.Option(min=2, max=256, help="Values tried of each byte.")] = 256,
    seed: Annotated[int, SEED] = 0,
    num_envs: Annotated[int, typer.Option("--envs", min=1)] = 64,
    game_mode: Annotated[int | None, MODE] = None,
    out: Annotated[Path | None, typer.Option(help="Where the picture goes; by default ocjax-causes-<Game>.png.")] = None,
    markdown: Annotated[Path | None, MARKDOWN] = None,
) -> None:
    """Set each byte to each value in one state, step, and show which pixels and objects change: a table and a picture."""
    from ocjax.analysis import causes as c

    game = _game(name)
    try:
        found = c.causes(game, steps=steps, frames=frames, seed=seed, values=values, num_envs=num_envs, game_mode=game_mode)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    _give([c.to_table(found)], markdown)
    out = out or Path(f"ocjax-causes-{game.name}.png")
    c.picture(found).save(out)
    console.print(f"map of all bytes, changed pixels in red: [bold]{out}[/bold]")


@app.command()
def residual(
    what: Annotated[str, WHAT],
    category: Annotated[str, typer.Argument(help="Category of the game.")],
    field: Annotated[str, typer.Argument(help="x, y, w or h.")],
    samples: Annotated[int, SAMPLES] = 4000,
    policy: Annotated[str, POLICY] = "repeat",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    markdown: Annotated[Path | None, MARKDOWN] = None,
) -> None:
    """Search all RAM for what explains the remaining error of an existing decoder in one field."""
    from ocjax.analysis import correlate as c

    tape = _tape(what, samples, policy, seed, game_mode)
    try:
        with console.status("searching"):
            found = c.residual(tape, category, field)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    _give(c.residual_tables(found, f"{tape.game.name} {category} {field}"), markdown)


@app.command("map")
def show_map(name: Annotated[str, GAME], markdown: Annotated[Path | None, MARKDOWN] = None) -> None:
    """The RAM map of a finished game: byte, how it is read, range, name and formula, as its file has them."""
    from ocjax.analysis.ram_map import ram_map

    _give([ram_map(_game(name))], markdown)


@app.command()
def watch(
    name: Annotated[str, GAME],
    policy: Annotated[str, typer.Option(help="keyboard, random, repeat, or an .npz file of a saved policy.")] = "keyboard",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    in_window: Annotated[bool, typer.Option("--window", help="In a window instead of the terminal.")] = False,
    frames: Annotated[int | None, typer.Option(min=1, help="End after so many frames shown.")] = None,
) -> None:
    """Play with objects, boxes and changing bytes shown live; poke addresses, save and load states."""
    from ocjax.analysis import watch as w

    try:
        session = w.Session(_game(name), policy, seed, game_mode)
    except (PolicyError, ValueError) as error:
        raise typer.BadParameter(str(error)) from error
    if in_window:
        try:
            w.window(session)
        except RuntimeError as error:
            raise typer.BadParameter(str(error)) from error
    else:
        w.terminal(session, console, frames)
