"""Reverse-engineer the RAM of a game."""

import importlib
import json
from pathlib import Path
from typing import Annotated

import typer

from ocjax import recordings
from ocjax.cli.messages import console
from ocjax.cli.outputs import write_picture, write_text
from ocjax.evaluation import tables
from ocjax.extraction import names, registry
from ocjax.files import jobs, writing
from ocjax.play import policies
from ocjax.play.rollouts import rollout
from ocjax.ramtools import causes as causal
from ocjax.ramtools import control as controls
from ocjax.ramtools import correlate as correlation
from ocjax.ramtools import disassembly, new, proposal, ram_map, roms, watch
from ocjax.ramtools import residual as residuals
from ocjax.ramtools import twins as pairs
from ocjax.ramtools.disassembly import listing
from ocjax.recordings import Recording

ram = typer.Typer(add_completion=False, no_args_is_help=True, help=__doc__)
GAME = typer.Argument(metavar="GAME", help="Name of the game.")
WHAT = typer.Argument(
    metavar="GAME|RECORDING", help="A game to play, or a recording (.npz) with frames."
)
SAMPLES = typer.Option(min=100, help="Samples to play.")
POLICY = typer.Option(
    help=(
        "random, repeat (random actions held for 1 to 8 steps), trained, or an .npz file of a "
        "saved policy."
    )
)
SEED = typer.Option(min=0, help="Seed of actions and emulators.")
MODE = typer.Option("--mode", help="Game mode as ale-py numbers it. Default: the game's.")
VALUES_CONFIRMED = 32  # values of a byte that `map --confirm` writes
PRINTED = Path("-")  # as an output: print instead


def _tape(what: str, samples: int, policy: str, seed: int, game_mode: int | None) -> Recording:
    if what.endswith(".npz"):
        return recordings.read(what)
    return rollout(registry.load(what), samples, policy=policy, seed=seed, game_mode=game_mode)


def _write(out: Path, text: str, what: str) -> None:
    if out == PRINTED:
        typer.echo(text, nl=False)
        return
    write_text(out, text, what)


@ram.command()
def correlate(
    what: Annotated[str, WHAT],
    target: Annotated[
        str,
        typer.Option(help="vem: the vision rules' detections; sprites: the video chip's sprites."),
    ] = "vem",
    samples: Annotated[int, SAMPLES] = 2000,
    policy: Annotated[str, POLICY] = "repeat",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            help="Write a Ram class with the best formulas, to paste into the game's file. "
            "With -, print it."
        ),
    ] = None,
) -> None:
    """Find the RAM bits that explain the position, size, value and look of each visible object.

    The search covers bytes, nibbles and bits. Formulas are fitted on half of
    the episodes and scored on the others.

    The game needs vision rules, but no decoder: its decode function may return
    empty boxes.
    """
    if target not in ("vem", "sprites"):
        raise ValueError(f"target must be vem or sprites, got {target!r}")
    reads = [Path(what)] if what.endswith(".npz") else [policies.file_of(policy)]
    writing.check(None if write == PRINTED else write, reads=reads)
    tape = _tape(what, samples, policy, seed, game_mode)
    if tape.screens is None or (target == "sprites" and tape.shown is None):
        raise recordings.RecordingError(
            f"{what} has no array {'screens' if tape.screens is None else 'shown'}, so it has "
            "nothing to explain"
        )
    with console.status("searching"):
        found = list(correlation.correlate(tape, target))
    title = f"{tape.game.name}: RAM that explains objects, percent of {len(tape):,} samples"
    tables.show(correlation.to_table(found, title), console)
    if write is not None:
        _write(write, proposal.ram_class(found), "Ram class")


@ram.command()
def causes(
    name: Annotated[str, GAME],
    steps: Annotated[
        int, typer.Option(min=0, help="Agent steps of random play that lead to the state.")
    ] = 200,
    frames: Annotated[int, typer.Option(min=2, help="Emulated frames after each change.")] = 2,
    values: Annotated[int, typer.Option(min=2, max=256, help="Values to try for each byte.")] = 256,
    seed: Annotated[int, SEED] = 0,
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances.")] = 64,
    game_mode: Annotated[int | None, MODE] = None,
    out: Annotated[
        Path | None, typer.Option(help="Picture to write. Default: ocjax-causes-<Game>.png.")
    ] = None,
) -> None:
    """Set each byte to each value in one state, and show which pixels and objects change."""
    game = registry.load(name)
    out = out or writing.unnamed(Path(f"ocjax-causes-{game.name}.png"))
    writing.check(out, suffixes=(".png",))
    found = causal.causes(
        game,
        steps=steps,
        frames=frames,
        seed=seed,
        values=values,
        num_envs=num_envs,
        game_mode=game_mode,
    )
    tables.show(causal.to_table(found), console)
    for note in causal.notes(found):
        console.print(note, markup=False, soft_wrap=True)
    write_picture(out, causal.picture(found), "Map of all bytes, changed pixels in red")


@ram.command()
def residual(
    what: Annotated[str, WHAT],
    category: Annotated[str, typer.Argument(help="Category of the game.")],
    field: Annotated[str, typer.Argument(help="x, y, w or h.")],
    samples: Annotated[int, SAMPLES] = 4000,
    policy: Annotated[str, POLICY] = "repeat",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
) -> None:
    """Search the whole RAM for bits that explain the remaining errors of a decoder in one field."""
    tape = _tape(what, samples, policy, seed, game_mode)
    with console.status("searching"):
        found = residuals.residual(tape, category, field)
    for table in residuals.to_tables(found, f"{tape.game.name} {category} {field}"):
        tables.show(table, console)


@ram.command()
def twins(
    name: Annotated[str, GAME],
    moment: Annotated[
        str,
        typer.Option(
            help="play: any frame; life: frames on which a life is lost; end: last frames of games."
        ),
    ] = "play",
    count: Annotated[int, typer.Option(min=1, help="Number of moments.")] = 10,
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
) -> None:
    """Find states with equal RAM and different pictures: the RAM cannot explain the difference.

    The command changes every byte before a moment of random play, and repeats
    the same actions. The game needs vision rules, but no decoder.
    """
    game = registry.load(name)
    found = pairs.twins(game, moment, count=count, seed=seed, game_mode=game_mode)
    tables.show(pairs.to_table(found), console)


@ram.command()
def control(
    name: Annotated[
        str, typer.Argument(metavar="GAME|all", help="Name of the game, or all games.")
    ],
    seed: Annotated[int, SEED] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            "--json",
            help="File to write. With all, games that it contains are skipped.",
        ),
    ] = None,
) -> None:
    """Find the bytes that remove, freeze or recolour a category, each confirmed on the screen.

    The search skips displays, and objects that rarely appear in random play. A
    game takes about a minute.
    """
    games = names.games() if name == "all" else [registry.load(name).name]
    writing.check(out)
    known = jobs.read(out) if out is not None and out.exists() else {}
    for game in map(registry.load, games):
        if name == "all" and game.name in known:
            continue
        found = controls.control(game, seed=seed)
        tables.show(controls.to_table(game, found), console)
        known[game.name] = controls.to_json(found)
        if out is not None:
            writing.write_text(out, json.dumps(dict(sorted(known.items())), indent=1) + "\n")
    if out is not None:
        writing.announce(console, "Written", out)


@ram.command("new")
def new_game(
    name: Annotated[str, typer.Argument(metavar="GAME", help="A game of ale-py.")],
    frames: Annotated[int, typer.Option(min=10, help="Frames of random play to survey.")] = 60,
    seed: Annotated[int, SEED] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; it must not exist. With -, print it. Default: <name>.py in the "
            "folder of the games."
        ),
    ] = None,
) -> None:
    """Write a game file that runs, for a game without a decoder.

    It has the digits that the ROM contains, the colours of random play with
    their components, and a vision rule for each colour. Its comments give the
    next steps.
    """
    found = roms.find(name)
    folder = Path(next(iter(importlib.import_module("ocjax.extractors").__path__)))
    out = out or writing.unnamed(folder / f"{found.name.lower()}.py")
    for taken in (out, out.with_suffix("")):
        if out != PRINTED and taken.exists():
            raise FileExistsError(f"{taken} exists: give another output")
    writing.check(None if out == PRINTED else out)
    with console.status("playing"):
        text = new.source(new.describe(name, frames=frames, seed=seed))
    _write(out, text, "Game file")


@ram.command("map")
def show_map(
    name: Annotated[str, GAME],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    confirm: Annotated[
        bool,
        typer.Option(
            help=(
                "With --json: write each byte in a state of random play, and list which "
                "categories change on the screen."
            )
        ),
    ] = False,
    seed: Annotated[int, SEED] = 0,
) -> None:
    """Print the RAM map of a finished game: bytes, reading, range, name and meaning."""
    game = registry.load(name)
    if confirm and not as_json:
        raise ValueError("--confirm needs --json")
    if as_json:
        found = causal.causes(game, seed=seed, values=VALUES_CONFIRMED) if confirm else None
        typer.echo(json.dumps(ram_map.to_json(game, found), indent=2))
        return
    tables.show(ram_map.ram_map(game), console)


@ram.command()
def disassemble(
    name: Annotated[str, GAME],
    states: Annotated[
        int, typer.Option(min=1, help="States of random play from which a frame is run.")
    ] = 120,
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    out: Annotated[
        Path | None, typer.Option(help="File for the listing. Default: print it.")
    ] = None,
) -> None:
    """List the program of a game, and when it writes each byte of RAM.

    Writes before the drawing of the picture are visible on the same frame.
    Writes after it are in the RAM that belongs to the frame, but not on the
    screen yet. The game needs no decoder.

    The program runs in an interpreter with the RAM of random play. There are no
    collisions.
    """
    writing.check(out)
    with console.status("running"):
        program = disassembly.disassemble(name, states=states, seed=seed, game_mode=game_mode)
    _write(out or PRINTED, "\n".join(listing.lines(program)) + "\n", "Listing")
    tables.show(listing.write_table(program), console)


@ram.command("watch")
def watch_game(
    name: Annotated[str, GAME],
    policy: Annotated[
        str,
        typer.Option(
            metavar="keyboard|random|repeat|FILE",
            help="Who plays; a file is an .npz file of a saved policy.",
        ),
    ] = "keyboard",
    seed: Annotated[int, SEED] = 0,
    game_mode: Annotated[int | None, MODE] = None,
    frames: Annotated[
        int | None,
        typer.Option(min=1, help="Stop after this many frames are shown."),
    ] = None,
) -> None:
    """Play a game, watch its objects and changing bytes live, and edit or save the state."""
    session = watch.Session(registry.load(name), policy, seed, game_mode)
    watch.watch(session, console, frames)
