"""Comparison of policies on variations of their game."""

import dataclasses
import json

import numpy as np
import pytest

import ocjax
from ocjax.play import varied
from ocjax.play.games import Played
from tests.support.command import run


def test_colors_do_not_matter_to_random_actions():
    """Each variation has the same seeds, so games with other colours are equal."""
    rows = varied.compare(
        ocjax.load("Breakout"), "random", ["Breakout:color_all_blocks_red", "gravity"], 2, seed=3
    )
    assert [row.name for row in rows] == ["original", "color_all_blocks_red", "gravity"]
    assert dataclasses.replace(rows[1], name="original", drop=None) == rows[0]
    assert rows[0].drop is None
    assert all(row.games == 2 and row.seed == 3 for row in rows)


@pytest.mark.parametrize(
    ("returns", "drops"),
    [
        (([10, 20], [5, 10], [30]), [None, 50, -100]),
        (([-20], [-21]), [None, 5]),
        (([0], [3]), [None, None]),
    ],
)
def test_drops(monkeypatch, returns, drops):
    results = iter(returns)
    monkeypatch.setattr(
        varied,
        "play",
        lambda *_, **_options: Played(
            np.array(next(results)), np.zeros(1), ocjax.envs.Settings(), []
        ),
    )
    names = ["lazy_enemy", "up_drift"][: len(returns) - 1]
    rows = varied.compare(ocjax.load("Pong"), "random", names, 2)
    assert [row.drop for row in rows] == drops
    assert rows[0].deviation == pytest.approx(
        np.std(returns[0], ddof=1) if len(returns[0]) > 1 else 0
    )


def test_command(tmp_path, monkeypatch):
    monkeypatch.setattr(
        varied,
        "play",
        lambda *_, **_options: Played(np.array([1.0, 3]), np.zeros(2), ocjax.envs.Settings(), []),
    )
    markdown, out = tmp_path / "table.md", tmp_path / "table.json"
    result = run(
        "play",
        "Pong",
        "--policy",
        "random",
        "--variations",
        "all",
        "--episodes",
        2,
        "--markdown",
        markdown,
        "--json",
        out,
    )
    assert result.exit_code == 0, result.output
    names = ["original", *ocjax.envs.variations.of("Pong")]
    assert all(
        name in result.output and f"| {name} | 2.0 | 1.4 |" in markdown.read_text()
        for name in names
    )
    written = json.loads(out.read_text())
    assert written["game"] == "Pong"
    assert [row["name"] for row in written["variations"]] == names
    assert written["variations"][1] == {
        "name": "lazy_enemy",
        "games": 2,
        "mean": 2,
        "deviation": 2**0.5,
        "drop": 0,
        "seed": 0,
    }


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("Pong", "--variations", "lazy"), "Pong has no variation 'lazy'; it has"),
        (("Pitfall", "--variations", "all"), "Pitfall has no variations; there are those of Alien"),
        (
            ("Pong", "--variations", "all", "--csv", "x.csv"),
            "--csv and --gif apply only to the original game",
        ),
        (("Pong", "--json", "x.json"), "--json need --variations"),
        (("Pong", "--human", "--variations", "all"), "do not apply with --human"),
    ],
)
def test_wrong_options(options, message):
    result = run("play", *options)
    assert result.exit_code == 2
    assert message in result.output
