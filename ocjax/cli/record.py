"""The command `ocjax record`."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from ocjax import recordings
from ocjax.cli.loading import load_playable
from ocjax.cli.messages import console, errors_in_one_line
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.play import expected, fixtures, limits
from ocjax.recordings import Recording

DATA = Path("tests", "data")  # the recordings of a checkout


def record(
    game: Annotated[str, typer.Argument(help="Name of the game.")],
    out: Annotated[
        Path | None, typer.Option(help="Recording to write. Default: tests/data/<Game>.npz in a checkout, else <Game>.npz.")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(min=1, help="Samples to keep; at least one for each mode and difficulty. Default: 40, of boundaries 30.")
    ] = None,
    seed: Annotated[list[int] | None, typer.Option(min=0, help="Seed; may be repeated. Default: 0 and 1.")] = None,
    mode: Annotated[list[int] | None, typer.Option(help="Game mode as ale-py numbers it; may be repeated. Default: all.")] = None,
    difficulty: Annotated[list[int] | None, typer.Option(help="Difficulty as ale-py numbers it; may be repeated. Default: 0.")] = None,
    source: Annotated[
        list[Path] | None, typer.Option("--from", metavar="RECORDING", help="Take samples from this recording instead; may be repeated.")
    ] = None,
    boundaries: Annotated[
        bool, typer.Option("--boundaries", help="Keep first and last states and lost lives. Default --out: tests/data/ends/<Game>.npz.")
    ] = False,
    deciding: Annotated[
        bool,
        typer.Option(
            "--deciding",
            help="Keep states of all modes that show what other recordings do not. Default --out: tests/data/modes/<Game>.npz.",
        ),
    ] = False,
    rule_limits: Annotated[
        bool, typer.Option("--limits", help="Write frames with objects at the limits of the vision rules: tests/data/limits/<Game>.txt.")
    ] = False,
    objects: Annotated[
        bool,
        typer.Option("--expected", help="Write what REM and VEM report on all of the game's recordings: tests/data/expected/<Game>.txt."),
    ] = False,
) -> None:
    """Create the small recordings that the tests of a game use.

    Plays the game with random actions, each held for 1 to 8 steps, and keeps samples from all modes, seeds and phases of play.

    With --boundaries, keeps the first and last states of episodes, and states in which a life has just been lost.

    With --from, takes evenly spaced samples of existing recordings. If these all contain what the video chip drew, so does the result.

    With --deciding, plays all modes and difficulties, and keeps states on which numbers in the game's file decide. With --from, it chooses
    from these recordings, too.

    With --limits, writes which frames to make of the game's first recording so that its vision rules' limits decide.

    With --expected, writes the objects of all recordings of the game as text. Look at what changed before you commit it.

    A mode that never draws some objects, such as Breakout's invisible bricks, cannot be checked against pixels: name the other modes.
    """
    spec = load_playable(game)
    if deciding and (boundaries or mode or difficulty or len(seed or []) > 1):
        raise typer.BadParameter(
            "--deciding plays all modes and difficulties with one seed: --boundaries, --mode, --difficulty do not apply"
        )
    if source and not deciding and (seed or mode or difficulty):
        raise typer.BadParameter("--seed, --mode and --difficulty choose what is played; with --from nothing is")
    if boundaries and (source or mode or difficulty or len(seed or []) > 1):
        raise typer.BadParameter(
            "--boundaries plays the default mode with one seed: --from, --mode, --difficulty and more seeds do not apply"
        )
    if objects or rule_limits:
        return _record_text(spec, expected.describe if objects else limits.describe, DATA / ("expected" if objects else "limits"))
    with errors_in_one_line():
        out = out or writing.unnamed(_default_excerpt(spec, "ends" if boundaries else "modes" if deciding else ""))
        writing.check(out, reads=source or [])
        if deciding:
            paths = expected.paths(DATA, spec, other_than=out)
            writing.check(out, reads=paths)
            known = [recordings.read(path) for path in paths]
            more = [recordings.read(path, spec.name) for path in source or []]
            tape = fixtures.record_deciding(spec, known, more, samples or fixtures.DECIDING_SAMPLES, seed=(seed or fixtures.SEEDS)[0])
        elif source:
            tape = fixtures.cut_files([str(path) for path in source], spec, samples or fixtures.SAMPLES)
        elif boundaries:
            tape = fixtures.record_boundaries(spec, samples or fixtures.BOUNDARY_SAMPLES, seed=(seed or fixtures.SEEDS)[0])
        else:
            chosen = {"seeds": seed or fixtures.SEEDS, "modes": mode, "difficulties": difficulty or (0,)}
            tape = fixtures.record(spec, samples or fixtures.SAMPLES, **chosen)
        _refuse_to_lose_drawn(out, tape)
        tape.write(out)
    drawn = "with" if tape.drawn is not None else "without"
    writing.announce(console, f"{len(tape)} samples of {spec.name}, {drawn} drawn pixels, {out.stat().st_size / 1000:,.0f} kB", out)


def _record_text(game: Game, describe: Callable[[Game, Path], str], folder: Path) -> None:
    with errors_in_one_line():
        out = writing.unnamed(folder / f"{game.name}.txt")
        writing.check(out, reads=expected.paths(DATA, game))
        writing.write_text(out, describe(game, DATA))
    writing.announce(console, f"{folder.name.capitalize()} of {game.name}", out)


def _default_excerpt(game: Game, subfolder: str) -> Path:
    folder = DATA / subfolder
    in_checkout = Path("extractors", "__init__.py").exists() and folder.is_dir()
    return (folder if in_checkout else Path()) / f"{game.name}.npz"


def _refuse_to_lose_drawn(out: Path, tape: Recording) -> None:
    """Raise a ValueError if the file to be replaced contains what the video chip drew and the new recording does not."""
    if tape.drawn is None and out.exists() and recordings.read(out, tape.game.name).drawn is not None:
        raise ValueError(
            f"{out} says what the video chip drew, which a new recording cannot: give another --out, use --from with recordings "
            "that contain `shown` and `previous_shown`, or delete the file first"
        )
