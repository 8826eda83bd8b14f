"""The rows, summaries and page of the scoreboard."""

import json

import numpy as np
import pytest

from ocjax.extraction.suites import SUITES
from tests.support.benchmarks import program


@pytest.fixture(scope="module")
def scores():
    return program("_scores")


def row(scores, game="Pong", agent="ocjax", mean=10.0, **changes):
    fields = {
        "frames": 10_000_000,
        "seeds": 1,
        "deviation": 1.0,
        "sticky_mean": 9.0,
        "sticky_deviation": 1.0,
        "random": -20.0,
        "random_deviation": 1.0,
        "level": None,
    } | changes
    return scores.Row(agent=agent, game=game, mean=mean, **fields)


def test_published_returns_cover_atari57(scores):
    assert scores.published().keys() == set(SUITES["atari57"].games)


def test_normalized_score(scores):
    other = scores.published()["Pong"]
    assert row(scores, mean=other.random).normalized == pytest.approx(0)
    assert row(scores, mean=other.human).normalized == pytest.approx(100)
    assert row(scores, "Carnival").normalized is None


def test_three_standard_errors_above_random_play(scores):
    error = 2**0.5 / scores.GAMES**0.5
    assert row(scores, mean=-20 + 3.1 * error).exceeds_random
    assert not row(scores, mean=-20 + 2.9 * error).exceeds_random


@pytest.mark.parametrize("n", [4, 7, 26, 57])
def test_interquartile_mean(scores, n):
    values = np.random.default_rng(n).normal(size=n)
    cut = n // 4
    assert scores.interquartile_mean(values) == pytest.approx(np.sort(values)[cut : n - cut].mean())


def test_summary(scores):
    games = SUITES["atari100k"].games
    rows = [row(scores, game, mean=scores.published()[game].human) for game in games]
    found = scores.summary(rows, "atari100k")
    assert found["games"] == len(games)
    for value in (found["median"], found["interquartile_mean"], *found["interval"]):
        assert value == pytest.approx(100)
    assert scores.summary(rows[:1], "atari100k") is None


def test_interval_contains_the_interquartile_mean(scores):
    rows = [
        row(scores, game, mean=float(scores.published()[game].human * i / 10))
        for i, game in enumerate(SUITES["atari100k"].games)
    ]
    found = scores.summary(rows, "atari100k")
    low, high = found["interval"]
    assert low < found["interquartile_mean"] < high


def test_a_new_row_replaces_the_old_one_and_keeps_its_drops(scores, tmp_path):
    path = tmp_path / "scoreboard.json"
    scores.add(row(scores, drops={"lazy_enemy": 5.0}), path)
    scores.add(row(scores, agent="other"), path)
    scores.add(row(scores, mean=12.0), path)
    rows = scores.read_rows(path)
    assert [(r.agent, r.mean, r.drops) for r in rows] == [
        ("ocjax", 12.0, {"lazy_enemy": 5.0}),
        ("other", 10.0, {}),
    ]
    assert json.loads(path.read_text())["protocol"]["games"] == scores.GAMES


def test_page(scores, tmp_path):
    path = tmp_path / "page.md"
    path.write_text(
        "before\n\n<!-- python benchmarks/scoreboard.py -->\nold\n"
        "<!-- end of the scoreboard -->\nafter\n"
    )
    rows = [row(scores, agent="a"), row(scores), row(scores, "Boxing", drops={"gravity": None})]
    scores.write_page(rows, path)
    first = path.read_text()
    assert first.startswith("before")
    assert first.endswith("after\n")
    assert "old" not in first
    assert first.index("## ocjax") < first.index("## a\n")
    assert "| Boxing | gravity - |" in first
    scores.write_page(rows, path)
    assert path.read_text() == first
    assert "2 of 2 agents exceed random play by" in first
    scores.write_page([*rows, row(scores, "Venture", mean=-20.0)], path)
    assert "2 of 3 agents (not Venture) exceed random play by" in path.read_text()
