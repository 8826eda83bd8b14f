"""The layout of Atari-HEAD, and the objects that people look at."""

import csv
import os

import jax
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax.files import atari_head
from ocjax.files.rows import InputError
from tests.support.command import run

HEADER = "frame_id,episode_id,score,duration(ms),unclipped_reward,action,gaze_positions"
GAME = ocjax.load("Pong")


@pytest.fixture
def trial(tmp_path):
    """Four frames of Pong. The person looks at the ball, near it, at nothing, and away."""
    envs = ocjax.make_vec(
        "Pong", 1, num_workers=0, mode="vem", obs="pixels", repeat_action_probability=0
    )
    envs.reset(seed=0)
    for _ in range(20):
        envs.step(np.ones(1, int))
    folder, lines = tmp_path / "7_RZ_1_Aug-1", [HEADER]
    folder.mkdir()
    for k in range(4):
        envs.step(np.zeros(1, int))
        x, y = np.asarray(envs.objects.of("Ball").xywh)[0, 0, :2].tolist()
        gaze = (
            f"{x + 0.5},{y + 1.5},{x + 1},{y + 2},150.0,200.0",
            f"{x - 4},{y}",
            "5.0,120.0",
            "null",
        )[k]
        Image.fromarray(envs.pool.rgb[0, -1]).save(folder / f"RZ_1_{k}.png")
        lines.append(f"RZ_1_{k},{'null' if k == 3 else 0},0,50,0,{k},{gaze}")
    envs.close()
    file = folder.with_suffix(".txt")
    file.write_text(
        "\n".join([*lines, "RZ_1_9,0,0,50,0,0,1.0,2.0"]) + "\n"
    )  # the last picture is missing
    return file


def test_trial(trial):
    lines = atari_head.read_trial(trial)
    assert [f.frame_id for f in lines] == ["RZ_1_0", "RZ_1_1", "RZ_1_2", "RZ_1_3", "RZ_1_9"]
    assert [f.action for f in lines] == [0, 1, 2, 3, 0]
    assert [f.episode for f in lines] == [0, 0, 0, None, 0]
    assert [f.gaze.shape for f in lines] == [(3, 2), (1, 2), (1, 2), (0, 2), (1, 2)]


def test_looks(trial):
    found = list(atari_head.looks(GAME, trial, trial.with_suffix("")))
    assert [(look.category, look.index) for look in found] == [
        ("Ball", 0),
        ("Ball", 0),
        (None, None),
        (None, None),
    ]
    assert [round(look.share, 2) for look in found] == [0.67, 1.0, 1.0, 0.0]


def test_object_at():
    ram = np.zeros(128, np.uint8)
    objects = jax.tree.map(np.asarray, GAME.rem(ram))
    valid = np.array([True, True, False, False, False])
    xywh = np.array(
        [(10, 10, 40, 40), (20, 20, 5, 5), (0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0)], np.int16
    )
    objects = type(objects)(xywh, valid, objects.orientation, objects.value, objects.rgb, GAME)
    assert [
        atari_head.object_at(objects, *point)
        for point in ((22, 22), (12, 12), (55, 20), (58, 20), (0, 0))
    ] == [1, 0, 0, -1, -1]


def test_command(trial, tmp_path):
    out, picture = tmp_path / "looks.csv", tmp_path / "look.png"
    result = run("gaze", trial, "--game", "Pong", "--out", out, "--picture", picture)
    assert result.exit_code == 0, result.output
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["category"] for row in rows] == ["Ball", "Ball", "", ""]
    assert rows[0]["w"] == "2"
    assert "objects at the gaze on 3 frames" in " ".join(result.output.split())
    with Image.open(picture) as image:
        assert image.size == (960, 630)


def test_pictures_of_another_game_give_a_warning(trial, tmp_path):
    result = run("gaze", trial, "--game", "Skiing", "--out", tmp_path / "looks.csv")
    assert result.exit_code == 0, result.output
    assert "Warning: no object of Skiing is in " in " ".join(result.output.split())


def test_missing_inputs(trial, tmp_path):
    options = ("--game", "Pong", "--out", tmp_path / "looks.csv")
    result = run("gaze", tmp_path / "none.txt", *options)
    assert result.exit_code == 2
    assert f"no trial {tmp_path / 'none.txt'}" in result.output.replace("\n", "")
    result = run("gaze", trial, *options, "--frames", tmp_path / "none")
    assert result.exit_code == 2
    assert "of the trial's pictures: give it (--frames)" in " ".join(result.output.split())


def test_files_that_are_no_texts(tmp_path):
    (tmp_path / "trial.txt").write_bytes(b"\xff")
    with pytest.raises(InputError, match="not a text file in UTF-8"):
        atari_head.read_trial(tmp_path / "trial.txt")
    os.mkfifo(tmp_path / "pipe.txt")
    for other in ("pipe.txt", "."):
        with pytest.raises(InputError, match="not a regular file"):
            atari_head.read_trial(tmp_path / other)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n", "the first line of a trial of Atari-HEAD is"),
        (
            f"{HEADER}\nRZ_1_0,0,0,50,0,0,1.0\n",
            "line 2: expected six columns and pairs of gaze positions, got 7 columns",
        ),
        (
            f"{HEADER}\nRZ_1_0,zero,0,50,0,0,null\n",
            "line 2: could not convert string to float: 'zero'",
        ),
        (
            f"{HEADER}\nRZ_1_0,1e999,0,50,0,0,null\n",
            "line 2: cannot convert float infinity to integer",
        ),
    ],
)
def test_other_layouts(tmp_path, text, message):
    file = tmp_path / "trial.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        atari_head.read_trial(file)
