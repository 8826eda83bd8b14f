"""The rows of the scoreboard, their summaries over games, and the page.

Human and random returns for comparison are in human.csv: Wang et al. (2016), as collected in DQN
Zoo (Quan and Ostrovski, 2020). Summaries are those of Agarwal et al. (2021): the median, and the
interquartile mean with a bootstrap interval over games.
"""

import csv
import dataclasses
import functools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from ocjax.extraction.suites import SUITES
from ocjax.files import writing

HERE = Path(__file__).parent
DATA, PAGE = HERE.parent / "docs" / "scoreboard.json", HERE.parent / "docs" / "scoreboard.md"
OWN = "ocjax"  # the agents that ship
GAMES, SEED, STICKY = 30, 1000, 0.25
PROTOCOL = {
    "games": GAMES,
    "first_seed": SEED,
    "preset": "dqn",
    "frame_skip": 4,
    "noop_max": 30,
    "max_episode_frames": 108_000,
    "repeat_action_probability": 0.0,
    "sticky": STICKY,
}
STANDARD_ERRORS = 3
SUMMARIZED = ("atari57", "atari100k")
RESAMPLES, CONFIDENCE = 10_000, 0.95
HEADER = (
    "game", "frames", "mean", "deviation", "sticky", "random", "published random", "human",
    "normalized", "level",
)  # fmt: skip
SUMMARY_HEADER = ("suite", "games", "median", "interquartile mean", "95 % interval")


class Published(NamedTuple):
    """Mean returns from the literature."""

    random: float
    human: float


@dataclasses.dataclass
class Row:
    """The results of an agent in a game.

    Args:
        agent: the agent's name.
        frames: emulated frames of its training, or None if unknown.
        seeds: training runs, each with its own seed.
        mean, deviation: of the returns of complete games.
        sticky_mean, sticky_deviation: the same with sticky actions.
        random: mean return of random play, measured by the same protocol.
        random_deviation: its standard deviation.
        level: the highest level that a game showed, counted from 1; None if unknown.
        drops: the drop of the mean return under each variation, in percent; None if it is unknown.
    """

    agent: str
    game: str
    frames: int | None
    seeds: int
    mean: float
    deviation: float
    sticky_mean: float
    sticky_deviation: float
    random: float
    random_deviation: float
    level: int | None
    drops: dict[str, float | None] = dataclasses.field(default_factory=dict)

    @property
    def normalized(self) -> float | None:
        """The human-normalised score in percent, by published returns."""
        if self.game not in published():
            return None
        other = published()[self.game]
        return 100 * (self.mean - other.random) / (other.human - other.random)

    @property
    def exceeds_random(self) -> bool:
        """Whether the mean is three standard errors above random play."""
        error = np.hypot(self.deviation, self.random_deviation) / GAMES**0.5
        return self.mean > self.random + STANDARD_ERRORS * error


@functools.cache
def published() -> dict[str, Published]:
    """Random and human returns by game."""
    with (HERE / "human.csv").open() as file:
        return {
            row["game"]: Published(float(row["random"]), float(row["human"]))
            for row in csv.DictReader(file)
        }


def read_rows(path: Path = DATA) -> list[Row]:
    """All rows of the scoreboard."""
    if not path.exists():
        return []
    fields = {field.name for field in dataclasses.fields(Row)}
    return [
        Row(**{name: value for name, value in row.items() if name in fields})
        for row in json.loads(path.read_text())["rows"]
    ]


def add(row: Row, path: Path = DATA) -> None:
    """Add a row, or replace the one of the same agent and game; keep the variations' drops."""
    rows = {(old.agent, old.game): old for old in read_rows(path)}
    old = rows.get((row.agent, row.game))
    if old is not None and not row.drops:
        row = dataclasses.replace(row, drops=old.drops)
    rows[row.agent, row.game] = row
    write(sorted(rows.values(), key=lambda row: (row.agent, row.game)), path)


def find(agent: str, game: str) -> Row:
    """The row of an agent and a game.

    Raises:
        SystemExit: it has not been measured.
    """
    for row in read_rows():
        if (row.agent, row.game) == (agent, game):
            return row
    raise SystemExit(f"{game} has no row of {agent}: run the command without --variations first")


def write(rows: Sequence[Row], path: Path = DATA) -> None:
    """Write the data."""
    agents = {row.agent: None for row in rows}
    data = {
        "protocol": PROTOCOL,
        "summaries": {
            agent: {suite: summary(_own(rows, agent), suite) for suite in SUMMARIZED}
            for agent in agents
        },
        "rows": [dataclasses.asdict(row) | {"normalized": row.normalized} for row in rows],
    }
    writing.write_text(path, json.dumps(data, indent=1) + "\n")


def _own(rows: Sequence[Row], agent: str) -> list[Row]:
    return [row for row in rows if row.agent == agent]


def interquartile_mean(scores: np.ndarray, axis: int = -1) -> Any:
    """The mean of the middle half of the scores."""
    return stats.trim_mean(scores, proportiontocut=0.25, axis=axis)


def summary(rows: Sequence[Row], suite: str) -> dict[str, Any] | None:
    """Summaries of the human-normalised scores over the games of a suite; None below two games."""
    scores = [row.normalized for row in rows if row.game in SUITES[suite].games]
    values = np.array([score for score in scores if score is not None])
    if len(values) < 2:
        return None
    interval = stats.bootstrap(
        (values,),
        interquartile_mean,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return {
        "games": len(values),
        "median": float(np.median(values)),
        "interquartile_mean": float(interquartile_mean(values)),
        "interval": [float(interval.low), float(interval.high)],
        "above_human": int((values > 100).sum()),
    }


def number(value: float | None) -> str:
    """A return for people."""
    if value is None:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:,.1f}"


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cells(row: Row) -> list[str]:
    other = published().get(row.game)
    percent = row.normalized
    return [
        row.game,
        "-" if row.frames is None else f"{row.frames / 1e6:.0f} M",
        number(row.mean),
        number(row.deviation),
        number(row.sticky_mean),
        number(row.random),
        number(other and other.random),
        number(other and other.human),
        "-" if percent is None else f"{percent:,.0f} %",
        "-" if row.level is None else str(row.level),
    ]


def _summary_cells(suite: str, found: dict[str, Any]) -> list[str]:
    low, high = found["interval"]
    return [
        suite,
        f"{found['games']} of {len(SUITES[suite].games)}",
        f"{found['median']:.0f} %",
        f"{found['interquartile_mean']:.0f} %",
        f"{low:.0f} to {high:.0f} %",
    ]


def _drop(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"


def _beside_random(rows: Sequence[Row]) -> str:
    """A sentence that names the agents that are no better than random play."""
    others = [row.game for row in rows if not row.exceeds_random]
    but = f" (not {', '.join(others)})" if others else ""
    better = len(rows) - len(others)
    return f"{better} of {len(rows)} agents{but} exceed random play by three standard errors."


def sections(rows: Sequence[Row], agent: str) -> str:
    """The tables of an agent as Markdown."""
    own = _own(rows, agent)
    found = {suite: summary(own, suite) for suite in SUMMARIZED}
    summaries = [_summary_cells(suite, one) for suite, one in found.items() if one is not None]
    above = sum(row.normalized is not None and row.normalized > 100 for row in own)
    varied = [
        [row.game, ", ".join(f"{name} {_drop(drop)}" for name, drop in row.drops.items())]
        for row in own
        if row.drops
    ]
    parts = [
        _table(SUMMARY_HEADER, summaries),
        f"{_beside_random(own)} {above} exceed human play.",
        _table(HEADER, [_cells(row) for row in own]),
    ]
    if varied:
        parts += [
            "Drop of the mean return under variations, in percent of the original game's return "
            "(10 games each; a negative number is an increase):",
            _table(("game", "drop in %"), varied),
        ]
    return "\n\n".join(parts)


def write_page(rows: Sequence[Row], path: Path = PAGE) -> None:
    """Replace the tables of each agent on the page, between two comments."""
    text = path.read_text()
    begin, end = "<!-- python benchmarks/scoreboard.py -->", "<!-- end of the scoreboard -->"
    before, rest = text.split(begin)
    agents = sorted({row.agent for row in rows}, key=lambda agent: (agent != OWN, agent))
    tables = [f"## {agent}\n\n{sections(rows, agent)}" for agent in agents]
    writing.write_text(path, "\n\n".join([before + begin, *tables, end + rest.split(end)[1]]))
