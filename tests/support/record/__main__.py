"""Write the recordings that the tests of a game use, in a checkout.

python -m tests.support.record Pong            # all parts
python -m tests.support.record Pong expected   # one of them
"""

from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from ocjax import recordings
from ocjax.cli.messages import console, errors_in_one_line
from ocjax.emulators.start import load_playable
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.recordings import Recording
from tests.support.record import edits, excerpts, expected, fixtures, limits

DATA = Path("tests", "data")
# The folder of each part in `tests/data`, in the order of writing: a part may depend on earlier
# ones.
RECORDINGS = {"samples": "", "ends": "ends", "modes": "modes"}
TEXTS = {"limits": limits.describe, "edits": edits.describe, "expected": expected.describe}


class Options(NamedTuple):
    """Options for the choice of a game's samples."""

    sources: list[Path]
    modes: list[int] | None
    difficulties: list[int]


def record(
    game: Annotated[str, typer.Argument(help="Name of the game.")],
    parts: Annotated[
        list[str] | None,
        typer.Argument(
            help="samples, ends, modes, limits, edits or expected. Default: all.",
            show_default=False,
        ),
    ] = None,
    source: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="RECORDING",
            help="Take the samples from this recording, and states of modes; may be repeated.",
        ),
    ] = None,
    mode: Annotated[
        list[int] | None, typer.Option(help="Mode of the samples; may be repeated. Default: all.")
    ] = None,
    difficulty: Annotated[
        list[int] | None,
        typer.Option(help="Difficulty of the samples; may be repeated. Default: 0."),
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder of the recordings of all games.")] = DATA,
) -> None:
    """Write the recordings and texts that the tests of a game use.

    samples: a few states from all modes, seeds and phases of play, under random actions that are
    held for 1 to 8 steps. With --from, evenly spaced states of the recordings. If all of these
    contain the drawn pixels, the result contains them, too.

    ends: the first and last states of episodes, and states directly after the loss of a life.

    modes: boundary states of the numbers in the game's file, in all modes and difficulties.

    limits: changes of the samples' frames that reach the limits of the vision rules.

    edits: boundary states that play does not reach: played states with one or two changed bytes.

    expected: the objects of all recordings as text. Look at the changes before you commit it.

    A mode that never draws some objects, such as Breakout's invisible bricks, cannot be checked
    against pixels: name the other modes.
    """
    with errors_in_one_line():
        spec = load_playable(game)
    known = (*RECORDINGS, *TEXTS)
    for part in parts or ():
        if part not in known:
            raise typer.BadParameter(f"a part must be {', '.join(known)}, got {part!r}")
    if source and (mode or difficulty):
        raise typer.BadParameter(
            "--mode and --difficulty choose what is played; with --from nothing is"
        )
    options = Options(source or [], mode, difficulty or [0])
    with errors_in_one_line():
        for part in parts or known:
            _write(part, spec, options, data)


def _write(part: str, game: Game, options: Options, data: Path) -> None:
    """Write one part."""
    if part in TEXTS:
        out = data / part / f"{game.name}.txt"
        writing.check(out)
        writing.write_text(out, TEXTS[part](game, data))
        writing.announce(console, f"{part.capitalize()} of {game.name}", out)
        return
    out = data / RECORDINGS[part] / f"{game.name}.npz"
    writing.check(out, reads=options.sources)
    tape = _recording(part, game, options, data, out)
    _refuse_to_lose_drawn(out, tape)
    tape.write(out)
    drawn = "with" if tape.drawn is not None else "without"
    writing.announce(
        console,
        f"{len(tape)} samples of {game.name}, {drawn} drawn pixels, "
        f"{out.stat().st_size / 1000:,.0f} kB",
        out,
    )


def _recording(part: str, game: Game, options: Options, data: Path, out: Path) -> Recording:
    """The recording of one part."""
    if part == "ends":
        return fixtures.record_boundaries(game)
    if part == "modes":
        known = [recordings.read(path) for path in excerpts.paths(data, game, other_than=out)]
        more = [recordings.read(path, game.name) for path in options.sources]
        return fixtures.record_deciding(game, known, more, fixtures.DECIDING_SAMPLES)
    if options.sources:
        return fixtures.cut_files([str(path) for path in options.sources], game, fixtures.SAMPLES)
    return fixtures.record(
        game, fixtures.SAMPLES, modes=options.modes, difficulties=options.difficulties
    )


def _refuse_to_lose_drawn(out: Path, tape: Recording) -> None:
    """Raise a ValueError if only the old file, not the new recording, contains the drawn pixels."""
    if (
        tape.drawn is None
        and out.exists()
        and recordings.read(out, tape.game.name).drawn is not None
    ):
        raise ValueError(
            f"{out} says what the video chip drew, which a new recording cannot: name other "
            "parts, use --from with recordings "
            "that contain `shown` and `previous_shown`, or delete the file first"
        )


app = typer.Typer(add_completion=False)
app.command()(record)

if __name__ == "__main__":
    app()
