"""Datasets of several games in one folder."""

import hashlib

import pytest

from ocjax.datasets import DatasetError, collection
from tests.support.command import run

pytest.importorskip("pyarrow")

GAMES = {"Kangaroo": 30, "Pong": 20}


def plans():
    return [collection.plan_of(game, states, [0]) for game, states in GAMES.items()]


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("datasets")
    collection.generate_all(plans(), folder)
    return folder


def test_games_use_their_starts_and_default_policies():
    kangaroo, pong = plans()
    assert kangaroo.starts == ({}, {"level": 1}, {"level": 2})
    assert pong.starts == ()
    assert dict(pong.policies) == {"random": 3, "trained": 7}


def test_checksums(made):
    lines = (made / "checksums.txt").read_text().splitlines()
    files = contents(made)
    assert {line.split("  ")[1] for line in lines} == {name for name in files if "/" in name}
    for line in lines:
        digest, name = line.split("  ")
        assert hashlib.sha256(files[name]).hexdigest() == digest


def test_table(made):
    text = (made / "README.md").read_text()
    row = next(line for line in text.splitlines() if line.startswith("| Pong "))
    cells = [cell.strip() for cell in row.split("|")[1:-1]]
    assert cells[:3] == ["Pong", "20", "30.00"]
    assert "| Kangaroo | " in text


def test_second_build_is_equal_and_resumes(made, tmp_path):
    reported = []
    one, other = plans()
    collection.generate_all([one], tmp_path)
    collection.generate_all(
        [one, other], tmp_path, report=lambda done, total: reported.append((done, total))
    )
    assert contents(tmp_path) == contents(made)
    assert reported[0][0] == GAMES["Kangaroo"], "the first game is not played again"
    assert reported[-1] == (50, 50)


def test_another_dataset_in_the_folder(made, tmp_path):
    pong = plans()[1]
    collection.generate_all([pong], tmp_path)
    with pytest.raises(DatasetError, match="another"):
        collection.generate_all([collection.plan_of("Pong", 10, [0])], tmp_path)


@pytest.mark.parametrize("option", [("--policy", "random"), ("--start", "none")])
def test_options_of_single_games(tmp_path, option):
    result = run("dataset", "all", "--out", str(tmp_path / "all"), *option)
    assert result.exit_code != 0
    assert "all takes no --policy" in result.output
    assert not (tmp_path / "all").exists()
