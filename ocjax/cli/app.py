"""The `ocjax` command."""

import importlib.metadata
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ocjax import recordings
from ocjax._xla import process
from ocjax.cli import agents, datasets, render
from ocjax.cli import demo as demonstration
from ocjax.cli import extract as files
from ocjax.cli.messages import Interruptible, errors_in_one_line
from ocjax.cli.ram import app as ram
from ocjax.console import rom
from ocjax.evaluation import formats as report_formats
from ocjax.evaluation import ocatari_peer, report, tables
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.play import fixtures
from ocjax.play.rollouts import rollout
from ocjax.recordings import Recording

app = typer.Typer(cls=Interruptible, add_completion=False, no_args_is_help=True, pretty_exceptions_show_locals=False)
app.add_typer(ram, name="ram")
app.command()(agents.train)
app.command()(agents.play)
app.command()(files.extract)
for command in (datasets.dataset, datasets.relabel, datasets.export):
    app.command()(command)
console = Console()

SEED = 12345  # of `ocjax evaluate`


def _print_version(wanted: bool) -> None:
    if wanted:
        console.print(f"ocjax {importlib.metadata.version('ocjax')}", highlight=False)
        raise typer.Exit


@app.callback()
def prepare(
    version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")] = False,
) -> None:
    """Extract objects from Atari 2600 games."""
    process.retain_freed_memory()
    process.use_compilation_cache()


def _load(name: str) -> Game:
    """Load a game whose ROM is installed, so that it can be played."""
    with errors_in_one_line():
        game = registry.load(name)
        rom.read_rom(game.rom, game.md5)
        return game


@app.command()
def games() -> None:
    """List the supported games and their objects."""
    with errors_in_one_line():
        specs = [registry.load(name) for name in registry.games()]
    table = Table(title=f"{len(specs)} games", title_justify="left")
    for heading in ("Game", "Slots", "Categories (slots)", "HUD categories", "With value", "With orientation"):
        table.add_column(heading, justify="right" if heading == "Slots" else "left", no_wrap=heading == "Game")
    for game in specs:
        cells = [[f"{c.name} {c.count}" if c.count > 1 else c.name for c in game.categories if c.hud is hud] for hud in (False, True)]
        cells += [[c.name for c in game.categories if attribute in c.attributes] for attribute in ("value", "orientation")]
        table.add_row(game.name, str(game.num_slots), *(", ".join(cell) for cell in cells))
    tables.print_whole(table, console)
    console.print("Every game supports REM (from RAM) and VEM (from pixels).")


@app.command()
def demo(
    game: Annotated[str, typer.Argument(help="Name of the game.")] = "Pong",
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances.")] = 64,
    steps: Annotated[int, typer.Option(min=1, help="Agent steps of each instance.")] = 250,
    seed: Annotated[int, typer.Option(min=0, help="Seed of actions and emulators.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Picture to write. Default: ocjax-<Game>.png.")] = None,
) -> None:
    """Play a game with random actions, time both extraction methods, and draw the objects that they find."""
    spec = _load(game)
    out = out or Path(f"ocjax-{spec.name}.png")
    with errors_in_one_line():
        writing.check_suffix(out, (".png",))
        writing.check(out)
    result = demonstration.run(spec, num_envs, steps, seed, console)
    tables.print_whole(demonstration.to_table(result), console)
    console.print("First call, compilation included: " + ", ".join(f"{name} {s:.2f} s" for name, s in result.first_call.items()))
    with errors_in_one_line():
        writing.write_picture(out, demonstration.picture(result))
    writing.announce(console, "Objects on the last frames, REM beside VEM", out)


@app.command("render")
def render_recording(
    recording: Annotated[Path, typer.Argument(help="Recording (.npz) with rams and screens.")],
    out: Annotated[Path, typer.Option(help="A .png of one sample, or a .gif of several.")],
    game: Annotated[str | None, typer.Option(help="Name of the game, if neither the file's name nor its contents give it.")] = None,
    method: Annotated[str, typer.Option(help="rem, vem, or both side by side.")] = "both",
    first: Annotated[int, typer.Option(min=0, help="First sample to draw.")] = 0,
    count: Annotated[int, typer.Option(min=1, help="Number of samples in a .gif.")] = 50,
    scale: Annotated[int, typer.Option(min=1, max=8, help="Picture pixels per screen pixel.")] = 2,
) -> None:
    """Draw objects over the frames of a recording."""
    if method not in render.METHODS:
        raise typer.BadParameter(f"method must be rem, vem or both, got {method!r}")
    with errors_in_one_line():
        writing.check_suffix(out, (".png", ".gif"))
        writing.check(out)
        tape = recordings.read(recording, game)
    if tape.screens is None:
        raise typer.BadParameter(f"{recording} has no frames (an array 'screens') to draw on")
    if first >= len(tape):
        raise typer.BadParameter(f"{recording} has {len(tape)} samples, so the first to draw cannot be {first}")
    samples = slice(first, min(len(tape), first + (count if out.suffix == ".gif" else 1)))
    with console.status("extracting"):
        objects = render.extract(tape, render.METHODS[method], samples)
    pictures = render.pictures(tape, objects, samples, scale)
    total = samples.stop - samples.start
    images = list(track(pictures, description="drawing", total=total, console=console, transient=True))
    with errors_in_one_line():
        render.save(images, out)
    writing.announce(console, f"{len(images)} samples of {recording}", out)


@app.command()
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
) -> None:
    """Create the small recordings that the tests of a game use.

    Plays the game with random actions, each held for 1 to 8 steps, and keeps samples from all modes, seeds and phases of play.

    With --boundaries, keeps the first and last states of episodes, and states in which a life has just been lost.

    With --from, takes evenly spaced samples of existing recordings. If these all contain what the video chip drew, so does the result.

    A mode that never draws some objects, such as Breakout's invisible bricks, cannot be checked against pixels: name the other modes.
    """
    spec = _load(game)
    if source and (seed or mode or difficulty):
        raise typer.BadParameter("--seed, --mode and --difficulty choose what is played; with --from nothing is")
    if boundaries and (source or mode or difficulty or len(seed or []) > 1):
        raise typer.BadParameter(
            "--boundaries plays the default mode with one seed: --from, --mode, --difficulty and more seeds do not apply"
        )
    out = out or _default_excerpt(spec, "ends" if boundaries else "")
    with errors_in_one_line():
        writing.check(out)
        if source:
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


def _default_excerpt(game: Game, subfolder: str) -> Path:
    folder = Path("tests", "data", subfolder)
    in_checkout = Path("extractors", "__init__.py").exists() and folder.is_dir()
    return (folder if in_checkout else Path()) / f"{game.name}.npz"


def _refuse_to_lose_drawn(out: Path, tape: Recording) -> None:
    """Raise a ValueError if the file to be replaced contains what the video chip drew and the new recording does not."""
    if tape.drawn is None and out.exists() and recordings.read(out, tape.game.name).drawn is not None:
        raise ValueError(
            f"{out} says what the video chip drew, which a new recording cannot: give another --out, use --from with recordings "
            "that contain `shown` and `previous_shown`, or delete the file first"
        )


@app.command()
def evaluate(
    what: Annotated[list[str], typer.Argument(metavar="GAME|RECORDING...", help="Games to play, or recordings (.npz) with frames.")],
    samples: Annotated[int, typer.Option(min=8, help="Samples of each game, seed, mode and difficulty.")] = 2000,
    policy: Annotated[
        str,
        typer.Option(
            help="random, repeat (random actions held for 1 to 8 steps), idle (no action), seldom (mostly none), trained, "
            "or an .npz file of a saved policy."
        ),
    ] = "repeat",
    after: Annotated[int, typer.Option(min=0, help="Emulated frames that each instance plays before its first sample.")] = 0,
    seed: Annotated[list[int] | None, typer.Option(min=0, help=f"Seed; may be repeated. Default: {SEED}.")] = None,
    game_mode: Annotated[
        list[int] | None, typer.Option("--mode", help="Game mode as ale-py numbers it; may be repeated. Default: the game's.")
    ] = None,
    game_difficulty: Annotated[
        list[int] | None, typer.Option("--difficulty", help="Difficulty as ale-py numbers it; may be repeated. Default: the game's.")
    ] = None,
    frame_skip: Annotated[int, typer.Option(min=1, help="Emulated frames per step. An odd number covers both phases of flicker.")] = 3,
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances.")] = 8,
    ocatari: Annotated[bool, typer.Option("--ocatari", help="Run OCAtari 2.2.1 on the same frames.")] = False,
    ocatari_env: Annotated[
        Path | None, typer.Option(help="Virtual environment with OCAtari, created if needed. Default: one in the user's cache.")
    ] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write the tables as Markdown.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write all numbers as CSV.")] = None,
    latex: Annotated[Path | None, typer.Option(help="Write LaTeX tables in the OCAtari paper's layout.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with pictures of the worst frames.")] = None,
) -> None:
    """Measure how well REM and VEM agree in each category, and how often scores and lives are right."""
    with errors_in_one_line():
        tapes = _read_with_frames(w for w in what if w.endswith(".npz"))
        specs = {w: _load(w) for w in what if w not in tapes}
        writing.check(markdown, csv, latex, html)
        with console.status("looking for OCAtari"):
            python = ocatari_peer.interpreter(ocatari_env) if ocatari else None
        done = []
        for w in dict.fromkeys(what):
            if w in tapes:
                tape, source = tapes[w], f"{len(tapes[w]):,} samples of {w}"
            else:
                choices = {"seed": seed or [SEED], "game_mode": game_mode or [None], "game_difficulty": game_difficulty or [None]}
                tape = _play_all(specs[w], choices, samples=samples, policy=policy, num_envs=num_envs, frame_skip=frame_skip, after=after)
                source = _describe(tape, policy, choices, after)
            with console.status(f"evaluating {tape.game.name}"):
                done.append(report.evaluate(tape, source, ocatari_peer.run(tape, python) if python else None))
            for table in report.tables_of(done[-1]):
                tables.show(table, console)
            for note in report.notes(done[-1]):
                console.print(note, markup=False, soft_wrap=True)
    tables.show(report.overview(done), console)
    with errors_in_one_line():
        _write_reports(done, markdown, csv, latex, html)


def _read_with_frames(paths: Iterator[str]) -> dict[str, Recording]:
    tapes = {path: recordings.read(path) for path in paths}
    for path, tape in tapes.items():
        if tape.screens is None:
            raise recordings.RecordingError(f"{path} has no frames (an array 'screens'): there is nothing to compare REM with")
    return tapes


def _play_all(game: Game, choices: dict[str, list], *, samples: int, **options: Any) -> Recording:
    """Play every combination of seeds, modes and difficulties."""
    runs = [dict(zip(choices, values, strict=True)) for values in itertools.product(*choices.values())]
    return recordings.join([rollout(game, samples, **options, **run) for run in runs])


def _describe(tape: Recording, policy: str, choices: dict[str, list], after: int) -> str:
    late = f" after {after:,} frames" * (after > 0)
    text = f"{len(tape):,} samples of {policy} play{late}, {tape.frame_skip} emulated frames per step, seeds {choices['seed']}"
    for name, values in (("modes", choices["game_mode"]), ("difficulties", choices["game_difficulty"])):
        text += f", {name} {values}" * (values != [None])
    return text


def _write_reports(
    done: Sequence[report.Evaluation], markdown: Path | None, csv: Path | None, latex: Path | None, html: Path | None
) -> None:
    def to_markdown(evaluations: Sequence[report.Evaluation]) -> str:
        return tables.to_markdown([report.overview(evaluations), *(table for e in evaluations for table in report.tables_of(e))])

    formats = (markdown, to_markdown), (csv, report_formats.to_csv), (latex, report_formats.to_latex), (html, report_formats.to_html)
    for path, to_text in formats:
        if path is not None:
            writing.write_text(path, to_text(done))
            writing.announce(console, "Written", path)


if __name__ == "__main__":
    app()
