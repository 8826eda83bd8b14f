"""The plan of the runs that `benchmarks/zoo.py` makes."""

import pytest

import ocjax
from tests.support.benchmarks import program


@pytest.fixture(scope="module")
def plan():
    return program("zoo_plan")


def row(plan, game, seed=0, frames=10_000_000, rise=0.0):
    return plan.Row(game, seed, frames, 0.5, 100.0, 10.0, 5.0, 1.0, rise)


def test_all_games_are_planned_once(plan):
    assert sorted(plan.order()) == sorted(ocjax.games())
    assert set(plan.PAPER_PPO) < set(plan.order())


def test_the_first_pass_begins_with_games_without_a_policy(plan):
    games = ["Alien", "Amidar", "Pong", "Qbert", "Venture"]
    runs = plan.first_pass(games, [row(plan, "Qbert")], {"Alien", "Pong"})
    assert [run.game for run in runs] == ["Amidar", "Venture", "Alien"]
    assert {(run.seed, run.frames) for run in runs} == {(0, 10_000_000)}
    assert runs[0].name == "Amidar-0-10M"


def test_rows_of_other_seeds_do_not_end_the_first_pass(plan):
    assert plan.first_pass(["Alien"], [row(plan, "Alien", seed=1)], {}) != []


def test_the_second_pass_takes_rising_games_and_three_seeds_of_the_papers(plan):
    rows = [
        row(plan, "Alien", rise=0.06),
        row(plan, "Amidar", rise=0.05),
        row(plan, "Pong", 1, 20_000_000),
    ]
    runs = plan.second_pass(["Alien", "Amidar", "Pong"], rows)
    assert [(run.game, run.seed) for run in runs] == [("Alien", 0), ("Pong", 0), ("Pong", 2)]
    assert {run.frames for run in runs} == {20_000_000}
    assert plan.second_pass(["Alien"], [row(plan, "Alien", frames=20_000_000, rise=0.5)]) == []


def test_the_next_run(plan, monkeypatch, tmp_path):
    path = tmp_path / "zoo.csv"
    monkeypatch.setattr(plan, "read_rows", lambda: [row(plan, "Alien")] if path.exists() else [])
    assert plan.next_run(["Alien"]) == plan.Run("Alien", 0, 10_000_000)
    path.touch()
    assert plan.next_run(["Alien"]) is None


def test_rows_are_kept_in_order_and_replaced(plan, tmp_path):
    path = tmp_path / "zoo.csv"
    assert plan.read_rows(path) == []
    for one in (row(plan, "Pong"), row(plan, "Alien"), row(plan, "Alien", seed=1)):
        plan.add_row(one, path)
    longer = row(plan, "Pong", frames=20_000_000, rise=-0.25)
    plan.add_row(longer, path)
    assert plan.read_rows(path) == [row(plan, "Alien"), row(plan, "Alien", seed=1), longer]


@pytest.mark.parametrize(
    ("returns", "expected"),
    [
        ([0, 0, 100, 110], 0.0),
        ([0, 0, 0, 100, 100, 100, 100, 150], 0.5),
        ([-20, -20, -20, -20, -20, -20, -20, -10], 0.5),
    ],
)
def test_the_rise_over_the_last_quarter(plan, tmp_path, returns, expected):
    path = tmp_path / "metrics.csv"
    path.write_text(
        "frames,return\n" + "".join(f"{i},{value}\n" for i, value in enumerate(returns))
    )
    assert plan.rise(path) == pytest.approx(expected)
