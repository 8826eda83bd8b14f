"""Measure games and keep the README's table of them: agreement, values, coverage and speed, OCAtari's beside ours in the same run.

    python benchmarks/table.py [GAME ...] [--peer PYTHON] [--truth FOLDER ...] [--samples 2000] [--seed 20261121] [--core 0]

Rows of the games named (default: all) are measured anew and replaced in README.md, the others stay. F1 and IoU are `ocjax evaluate`'s
on fresh play. PYTHON is an interpreter that has OCAtari. With --truth, recordings with what the video chip drew (FOLDER/<Game>.npz),
`drawn` is the F1 on them, `sprites` the share of sprite pixels inside REM's boxes, and `boxes` the share of its boxes that hold drawn
pixels. Times are microseconds a frame on one core, median, at batches of 4,096 (REM) and 1,024 (VEM), with the ratio to OCAtari's in
brackets. The paper's F1 (paper.csv) is that of the OCAtari paper's appendix for its DQN agent.
"""

import argparse
import csv
import re
import sys
from pathlib import Path

from extraction import HERE, bind, recorded, repeated, timed

README = HERE.parent / "README.md"
BEGIN, END = "<!-- games: python benchmarks/table.py -->", "<!-- end of games -->"
HEADER = ["game", "F1", "IoU", "exact", "score", "lives", "OCAtari's F1", "paper's F1", "drawn: F1", "sprites", "boxes", "REM us", "VEM us"]
BATCHES = {"rem": 4096, "vem": 1024}


def measure(name: str, arguments: argparse.Namespace) -> list[str]:
    """One row."""
    import jax
    import jax.numpy as jnp
    import numpy as np

    import ocjax
    from ocjax import evaluation, peer, recordings, report, rollout

    def number(x: object) -> str:
        return report.text(None if x is None else 100 * float(x))  # pyright: ignore[reportArgumentType]

    game = ocjax.load(name)
    tape = rollout.rollout(game, arguments.samples, seed=arguments.seed)
    e = report.evaluate(tape, "", peer.run(tape, Path(arguments.peer)) if arguments.peer else None)
    a = e.aware.sum()
    row = [game.name, number(a.f1), number(a.mean_iou), number(a.exact_rate)]
    for names in (evaluation.SCORE_NAMES, evaluation.LIVES_NAMES):
        row.append(next((number(v) for k, v in e.values.items() if k in names), "-"))
    row.append("-" if e.peer_plain is None else number(e.peer_plain.sum().f1))
    with (HERE / "paper.csv").open() as file:
        row.append(next((r["f1"] for r in csv.DictReader(file) if r["game"] == game.name), "-"))
    paths = [Path(folder) / f"{game.name}.npz" for folder in arguments.truth]
    truth = recordings.join([recordings.read(p) for p in paths if p.exists()]) if any(p.exists() for p in paths) else None
    drawn = report.evaluate(truth, "") if truth else None
    row += ["-"] * 3 if drawn is None else [number(drawn.aware.sum().f1), *map(number, drawn.cover or (None, None))]
    samples = recorded(game.name)
    for method, key in (("rem", "rams"), ("vem", "screens")):
        x = jnp.asarray(repeated(samples[key], BATCHES[method]))
        us = 1e6 * timed(jax.jit(getattr(game, method)), x)[0] / len(x)
        theirs = e.peer.get(method)
        ratio = f" ({np.median(theirs.us) / us:,.0f})" if theirs is not None and len(theirs.us) else ""
        row.append((f"{us:.3f}" if method == "rem" else f"{us:.1f}") + ratio)
    return row


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*")
    parser.add_argument("--peer", help="Python interpreter that has OCAtari")
    parser.add_argument("--truth", nargs="*", default=[], help="folders of recordings with what the video chip drew")
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--core", type=int, default=0)
    arguments = parser.parse_args()
    bind(arguments.core)

    import ocjax

    text = README.read_text()
    before, rest = text.split(BEGIN)
    old, after = rest.split(END)
    rows = {
        cells[0]: cells for line in old.splitlines()[4:] if (cells := re.findall(r"[^|]+", line)) and (cells := [c.strip() for c in cells])
    }
    for name in arguments.games or ocjax.games():
        row = measure(name, arguments)
        rows[row[0]] = row
        print(" | ".join(row), file=sys.stderr, flush=True)
        lines = [HEADER, ["---"] * len(HEADER), *(rows[n] for n in sorted(rows))]
        table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        README.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{after}")


if __name__ == "__main__":
    main()
