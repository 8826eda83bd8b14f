"""The command `ocjax evaluate`."""

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ocjax import recordings
from ocjax.cli.messages import console
from ocjax.cli.options import OCATARI_ENV
from ocjax.cli.outputs import write_markdown, write_text
from ocjax.emulators.start import load_playable
from ocjax.evaluation import formats, ocatari_peer, report, tables
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.play import policies
from ocjax.play.rollouts import rollout
from ocjax.recordings import Recording

SEED = 12345


def evaluate(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="GAME|RECORDING...", help="Games to play, or recordings (.npz) with frames."
        ),
    ],
    samples: Annotated[
        int, typer.Option(min=8, help="Samples of each game, seed, mode and difficulty.")
    ] = 2000,
    policy: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="random, repeat (random actions held for 1 to 8 steps), idle (no action), seldom "
            "(mostly none), trained, or an .npz file of a saved policy.",
        ),
    ] = "repeat",
    after: Annotated[
        int,
        typer.Option(
            min=0, help="Emulated frames that each instance plays before its first sample."
        ),
    ] = 0,
    seed: Annotated[
        list[int] | None, typer.Option(min=0, help=f"Seed; may be repeated. Default: {SEED}.")
    ] = None,
    game_mode: Annotated[
        list[int] | None,
        typer.Option(
            "--mode", help="Game mode as ale-py numbers it; may be repeated. Default: the game's."
        ),
    ] = None,
    game_difficulty: Annotated[
        list[int] | None,
        typer.Option(
            "--difficulty",
            help="Difficulty as ale-py numbers it; may be repeated. Default: the game's.",
        ),
    ] = None,
    frame_skip: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=(
                "Emulated frames per step; an odd number covers both phases of flicker. Default: "
                "3, or the number of the policy's training."
            ),
        ),
    ] = None,
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances.")] = 8,
    ocatari: Annotated[
        bool, typer.Option("--ocatari", help="Run OCAtari 2.2.1 on the same frames.")
    ] = False,
    ocatari_env: OCATARI_ENV = None,
    markdown: Annotated[Path | None, typer.Option(help="Write the tables as Markdown.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write all numbers as CSV.")] = None,
    latex: Annotated[
        Path | None, typer.Option(help="Write LaTeX tables in the OCAtari paper's layout.")
    ] = None,
    html: Annotated[
        Path | None, typer.Option(help="Write a page with pictures of the worst frames.")
    ] = None,
) -> None:
    """Measure how well REM and VEM agree, and how often scores and lives are right."""
    recorded = _read_with_frames(w for w in what if w.endswith(".npz"))
    games = {w: load_playable(w) for w in what if w not in recorded}
    writing.check(markdown, csv, latex, html, reads=[*recorded, policies.file_of(policy)])
    with console.status("looking for OCAtari"):
        python = ocatari_peer.interpreter(ocatari_env) if ocatari else None
    choices = {
        "seed": seed or [SEED],
        "game_mode": game_mode or [None],
        "game_difficulty": game_difficulty or [None],
    }
    options = {"policy": policy, "num_envs": num_envs, "frame_skip": frame_skip, "after": after}
    done = []
    for w in dict.fromkeys(what):
        if w in recorded:
            tape = recorded[w]
            source = f"{len(tape):,} samples of {w}"
        else:
            tape = _play_all(games[w], choices, samples, **options)
            source = _describe(tape, policy, choices, after)
        done.append(_evaluate(tape, source, python))
    tables.show(report.overview(done), console)
    if not (markdown or csv):
        console.print("--markdown and --csv write more columns.")
    _write_reports(done, markdown, csv, latex, html)


def _read_with_frames(paths: Iterator[str]) -> dict[str, Recording]:
    tapes = {path: recordings.read(path) for path in paths}
    for path, tape in tapes.items():
        if tape.screens is None:
            raise recordings.RecordingError(
                f"{path} has no frames (an array 'screens') to compare with REM"
            )
    return tapes


def _play_all(game: Game, choices: dict[str, list], samples: int, **options: Any) -> Recording:
    """Play every combination of seeds, modes and difficulties."""
    runs = [
        dict(zip(choices, values, strict=True)) for values in itertools.product(*choices.values())
    ]
    return recordings.join([rollout(game, samples, **options, **run) for run in runs])


def _evaluate(tape: Recording, source: str, python: Path | None) -> report.Evaluation:
    """Evaluate a recording, with OCAtari if there is an interpreter for it, and show the result."""
    with console.status(f"evaluating {tape.game.name}"):
        ocatari = None if python is None else ocatari_peer.run(tape, python)
        evaluation = report.evaluate(tape, source, ocatari)
    for table in report.tables_of(evaluation):
        tables.show(table, console)
    for note in report.notes(evaluation):
        console.print(note, markup=False, soft_wrap=True)
    return evaluation


def _describe(tape: Recording, policy: str, choices: dict[str, list], after: int) -> str:
    late = f" after {after:,} frames" * (after > 0)
    skip = (tape.settings or {})["frame_skip"]
    text = (
        f"{len(tape):,} samples of {policy} play{late}, {skip} emulated frames per step, seeds "
        f"{choices['seed']}"
    )
    named = {"modes": choices["game_mode"], "difficulties": choices["game_difficulty"]}
    for name, values in named.items():
        text += f", {name} {values}" * (values != [None])
    return text


def _write_reports(
    done: Sequence[report.Evaluation],
    markdown: Path | None,
    csv: Path | None,
    latex: Path | None,
    html: Path | None,
) -> None:
    if markdown is not None:
        of_games = (table for e in done for table in report.tables_of(e))
        write_markdown(markdown, [report.overview(done), *of_games])
    others = {formats.to_csv: csv, formats.to_latex: latex, formats.to_html: html}
    for to_text, path in others.items():
        if path is not None:
            write_text(path, to_text(done))
