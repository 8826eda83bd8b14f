"""Figures of measured times."""

import io
import math
from collections.abc import Sequence

from ocjax import _extras
from ocjax.evaluation.timing import Measurement

STEPS = 10_000  # of the figure in the OCAtari paper
METHODS = ("REM", "VEM", "OpenCV's contours", "OCAtari's REM", "OCAtari's VEM")
LEAST_WIDTH, WIDTH_OF_GAME, HEIGHT = 6.0, 1.6, 5.0  # inches


def steps_figure(found: Sequence[Measurement]) -> bytes:
    """Plot the seconds of 10,000 steps or extractions by game, as PNG, as in OCAtari's paper.

    Methods have their largest batch. The means over games are geometric.
    """
    plt = _pyplot()
    games = list(dict.fromkeys(m.game for m in found))
    whats = list(dict.fromkeys(m.what for m in found))
    largest = {(m.game, m.what): m for m in sorted(found, key=lambda m: m.batch)}
    figure, axes = plt.subplots(
        figsize=(max(LEAST_WIDTH, WIDTH_OF_GAME * len(games)), HEIGHT), layout="constrained"
    )
    width = 0.8 / len(whats)
    colors = plt.get_cmap("tab20").colors
    for i, what in enumerate(whats):
        places = [
            g + (i - (len(whats) - 1) / 2) * width
            for g, name in enumerate(games)
            if (name, what) in largest
        ]
        seconds = [
            largest[name, what].median * STEPS / 1e6 for name in games if (name, what) in largest
        ]
        axes.bar(
            places,
            seconds,
            width,
            color=colors[i],
            label=f"{what} (mean {_geometric_mean(seconds):.3g} s)",
        )
    axes.set(
        yscale="log",
        ylabel=f"seconds per {STEPS:,} steps",
        xticks=range(len(games)),
        xticklabels=games,
    )
    figure.legend(fontsize="small", loc="outside lower center", ncols=2)
    return _png(plt, figure)


def batches_figure(found: Sequence[Measurement]) -> bytes:
    """Plot a method's microseconds per state or frame by batch size, as PNG: geometric means."""
    plt = _pyplot()
    figure, axes = plt.subplots(figsize=(LEAST_WIDTH, HEIGHT), layout="constrained")
    for what in METHODS:
        sizes = sorted({m.batch for m in found if m.what == what})
        means = [
            _geometric_mean([m.median for m in found if (m.what, m.batch) == (what, size)])
            for size in sizes
        ]
        if sizes:
            axes.plot(sizes, means, marker="o", label=what)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="states or frames per call",
        ylabel="microseconds per state or frame",
    )
    axes.legend(fontsize="small")
    return _png(plt, figure)


def _geometric_mean(values: Sequence[float]) -> float:
    return math.exp(sum(map(math.log, values)) / len(values))


def _pyplot():  # noqa: ANN202  # matplotlib is optional
    _extras.require("matplotlib").use("Agg")
    return _extras.require("matplotlib.pyplot")


def _png(plt, figure) -> bytes:  # noqa: ANN001
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=120)
    plt.close(figure)
    return out.getvalue()
