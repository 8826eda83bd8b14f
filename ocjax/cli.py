"""The `ocjax` command."""

import time
from pathlib import Path
from typing import Annotated, Any

import jax
import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ocjax import registry
from ocjax.analysis.commands import app as ram
from ocjax.objects import Objects
from ocjax.spec import Game

app = typer.Typer(
    add_completion=False, no_args_is_help=True, pretty_exceptions_show_locals=False, help="Objects on the screen of Atari 2600 games."
)
app.add_typer(ram, name="ram")
console = Console()

FRAMES = 4  # emulated frames a step of the demonstration


def _load(name: str) -> Game:
    try:
        return registry.load(name)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def _host(objects: Objects) -> Objects:
    return jax.tree.map(np.asarray, objects)


@app.command()
def games() -> None:
    """List the games: their categories, slots and what each method gives."""
    table = Table(title=f"{len(registry.games())} games", title_justify="left")
    for heading in ("Game", "Slots", "Categories (slots)", "Display", "Values of", "Orientation of"):
        table.add_column(heading, justify="right" if heading == "Slots" else "left", no_wrap=heading == "Game")
    for name in registry.games():
        game = registry.load(name)
        plain, hud = (
            [f"{c.name} {c.count}" if c.count > 1 else c.name for c in game.categories if c.hud is kind] for kind in (False, True)
        )
        values, points = ([c.name for c in game.categories if a in c.attributes] for a in ("value", "orientation"))
        table.add_row(name, str(game.num_slots), *(", ".join(v) for v in (plain, hud, values, points)))
    console.print(table)
    console.print("Every game has both methods: REM (from RAM) and VEM (from pixels).")


@app.command()
def demo(
    game: Annotated[str, typer.Argument(help="Name of the game.")] = "Pong",
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Instances stepped side by side.")] = 64,
    steps: Annotated[int, typer.Option(min=1, help="Agent steps of each instance.")] = 250,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    out: Annotated[Path | None, typer.Option(help="Where the picture goes; by default ocjax-<Game>.png.")] = None,
) -> None:
    """Play many instances with random actions, extract with both methods, measure, and draw a picture."""
    from ocjax.envs import AlePool, Settings
    from ocjax.render import overlay, sheet

    spec = _load(game)
    out = out or Path(f"ocjax-{spec.name}.png")
    pool = AlePool(spec, num_envs, Settings(frame_skip=FRAMES), screens=("screen",))
    try:
        with console.status(f"starting {num_envs} instances of {spec.name}"):
            pool.reset([seed + i for i in range(num_envs)])
        compiled = {}
        for name, extract, source in (("REM", spec.rem, pool.ram), ("VEM", spec.vem, pool.screen[:, 1])):
            with console.status(f"compiling {name}"):
                start = time.perf_counter()
                jax.block_until_ready(extract(source))
                compiled[name] = time.perf_counter() - start
        actions = np.random.default_rng(seed).integers(len(pool.actions), size=(steps, num_envs))
        spent: dict[str, list[float]] = {"step": [], "REM": [], "VEM": []}
        seen: dict[str, Any] = {}
        for action in track(actions, description=f"playing {spec.name}", console=console, transient=True):
            start = time.perf_counter()
            pool.send(action)
            pool.wait()
            spent["step"].append(time.perf_counter() - start)
            for name, extract, source in (("REM", spec.rem, pool.ram), ("VEM", spec.vem, pool.screen[:, 1])):
                start = time.perf_counter()
                seen[name] = jax.block_until_ready(extract(source))
                spent[name].append(time.perf_counter() - start)
        frames = np.array(pool.screen[:, 1])
        rem, vem = _host(seen["REM"]), _host(seen["VEM"])
    finally:
        pool.close()

    step = float(np.median(spent["step"]))
    rate = num_envs / step
    table = Table(
        title=f"{spec.name}: {num_envs} instances x {steps} agent steps of {FRAMES} emulated frames, random actions",
        title_justify="left",
    )
    for heading in ("", "median", "10-90 %", "a second", "of the step time"):
        table.add_column(heading, justify="right" if heading else "left")
    table.add_row("a step of all", f"{1e3 * step:.2f} ms", _spread(spent["step"], 1e3), f"{rate:,.0f} agent steps", "100 %")
    table.add_row("", "", "", f"{rate * FRAMES:,.0f} emulated frames")
    for name in ("REM", "VEM"):
        one = float(np.median(spent[name])) / num_envs
        share = f"{100 * one * num_envs / step:.2f} %"
        table.add_row(f"{name}, a frame", f"{1e6 * one:.2f} us", _spread(spent[name], 1e6 / num_envs), f"{1 / one:,.0f} frames", share)
    console.print(table)
    console.print(f"first call with compilation: REM {compiled['REM']:.2f} s, VEM {compiled['VEM']:.2f} s")

    shown = np.linspace(0, num_envs - 1, min(3, num_envs)).astype(int)
    rows = [[overlay(spec, frames[i], rem[i]), overlay(spec, frames[i], vem[i])] for i in shown]
    picture = sheet(rows, [f"{spec.name}: REM (from RAM)", "VEM (from pixels)"])
    picture.save(out)
    console.print(f"objects of the last frame in {len(shown)} of the instances, REM beside VEM: [bold]{out}[/bold]")


def _spread(times: list[float], unit: float) -> str:
    low, high = np.percentile(times, [10, 90]) * unit
    return f"{low:.2f}-{high:.2f}"


@app.command()
def render(
    recording: Annotated[Path, typer.Argument(help="An .npz file with rams and screens.")],
    out: Annotated[Path, typer.Option(help="A .png of one sample, or a .gif of several.")],
    game: Annotated[str | None, typer.Option(help="The game, where the file's name or contents do not tell.")] = None,
    method: Annotated[str, typer.Option(help="rem, vem, or both side by side.")] = "both",
    first: Annotated[int, typer.Option(min=0, help="First sample drawn.")] = 0,
    count: Annotated[int, typer.Option(min=1, help="Number of samples in a .gif.")] = 50,
    scale: Annotated[int, typer.Option(min=1, max=8)] = 2,
) -> None:
    """Draw objects over the frames of a recording."""
    from ocjax import recordings
    from ocjax.render import overlay, sheet

    if method not in ("rem", "vem", "both"):
        raise typer.BadParameter(f"method must be rem, vem or both, got {method!r}")
    if out.suffix not in (".png", ".gif"):
        raise typer.BadParameter(f"the output must end in .png or .gif, got {out}")
    try:
        tape = recordings.read(recording, game)
    except (OSError, ValueError) as error:
        raise typer.BadParameter(str(error)) from error
    if tape.screens is None:
        raise typer.BadParameter(f"{recording} has no frames (an array 'screens'): nothing to draw on")
    if first >= len(tape.rams):
        raise typer.BadParameter(f"{recording} has {len(tape.rams)} samples, the first drawn would be {first}")
    part = slice(first, first + (count if out.suffix == ".gif" else 1))
    with console.status("extracting"):
        seen = {}
        if method != "vem":
            seen["REM"] = _host(tape.game.rem(tape.rams[part]))
        if method != "rem":
            seen["VEM"] = _host(tape.game.vem(tape.screens[part]))
    pictures = []
    for i, frame in enumerate(track(tape.screens[part], description="drawing", console=console, transient=True)):
        pictures.append(
            sheet(
                [[overlay(tape.game, frame, o[i], scale=scale) for o in seen.values()]],
                [f"{tape.game.name} {first + i}: {m}" for m in seen],
            )
        )
    pictures[0].save(out, **({"save_all": True, "append_images": pictures[1:], "duration": 120, "loop": 0} if out.suffix == ".gif" else {}))
    console.print(f"{len(pictures)} samples of {recording}: [bold]{out}[/bold]")


@app.command()
def evaluate(
    what: Annotated[list[str], typer.Argument(metavar="GAME|RECORDING...", help="Games to play, or .npz recordings with frames.")],
    samples: Annotated[int, typer.Option(min=8, help="Samples of each play.")] = 2000,
    policy: Annotated[str, typer.Option(help="random, repeat (actions held for 1-8 steps), or an .npz file of a saved policy.")] = "repeat",
    seed: Annotated[list[int] | None, typer.Option(min=0, help="May be given several times.")] = None,
    game_mode: Annotated[
        list[int] | None, typer.Option("--mode", help="Game mode as ale-py numbers them; several times for several.")
    ] = None,
    game_difficulty: Annotated[list[int] | None, typer.Option("--difficulty", help="As --mode.")] = None,
    frame_skip: Annotated[int, typer.Option(min=1, help="Emulated frames a step; odd, so that both phases of flicker are seen.")] = 3,
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Instances played side by side.")] = 8,
    peer: Annotated[bool, typer.Option("--peer", help="Run OCAtari 2.2.1 on the same frames.")] = False,
    peer_env: Annotated[
        Path | None, typer.Option(help="Its virtual environment, made where there is none; by default in the cache.")
    ] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write the tables as Markdown.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write all numbers as CSV.")] = None,
    latex: Annotated[Path | None, typer.Option(help="Write LaTeX tables in the OCAtari paper's layout.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with the worst frames drawn.")] = None,
) -> None:
    """Measure how well REM and VEM agree, and REM's values: by category, with confidence intervals over episodes."""
    import itertools

    from ocjax import peer as ocatari
    from ocjax import recordings, report
    from ocjax.rollout import rollout

    try:
        tapes = {w: recordings.read(w) for w in what if w.endswith(".npz")}
        specs = {w: _load(w) for w in what if w not in tapes}
        for w, tape in tapes.items():
            if tape.screens is None:
                raise recordings.RecordingError(f"{w} has no frames (an array 'screens'): nothing to compare REM with")
        for path in (markdown, csv, latex, html):
            if path is not None and not path.absolute().parent.is_dir():
                raise ValueError(f"no folder {path.absolute().parent} for {path.name}")
        with console.status("looking for OCAtari"):
            python = ocatari.interpreter(peer_env) if peer else None
        done = []
        for w in dict.fromkeys(what):
            if w in tapes:
                tape, source = tapes[w], f"{len(tapes[w]):,} samples of {w}"
            else:
                plays = list(itertools.product(seed or [12345], game_mode or [None], game_difficulty or [None]))
                tape = recordings.join(
                    [
                        rollout(
                            specs[w], samples, policy=policy, seed=s, num_envs=num_envs, frame_skip=frame_skip, game_mode=m,
                            game_difficulty=d,
                        )
                        for s, m, d in plays
                    ]
                )  # fmt: skip
                source = f"{len(tape):,} samples of {policy} play, {frame_skip} emulated frames a step, seeds {seed or [12345]}"
                source += f", modes {game_mode}" * bool(game_mode) + f", difficulties {game_difficulty}" * bool(game_difficulty)
            with console.status(f"evaluating {tape.game.name}"):
                done.append(report.evaluate(tape, source, ocatari.run(tape, python) if python else None))
            report.show(report.by_category(done[-1]), console)
            for note in report.notes(done[-1]):
                console.print(note)
    except (OSError, ValueError, ocatari.PeerError) as error:
        raise typer.BadParameter(str(error)) from error
    table = report.overview(done)
    report.show(table, console)
    tables = [table, *map(report.by_category, done)]
    for path, content in (
        (markdown, report.to_markdown(tables)),
        (csv, report.to_csv(done)),
        (latex, report.to_latex(done)),
        (html, report.to_html(done)),
    ):
        if path is not None:
            path.write_text(content)
            console.print(f"written: [bold]{path}[/bold]")


if __name__ == "__main__":
    app()
