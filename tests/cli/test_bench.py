"""The command `ocjax bench`."""

import importlib.util
import json
import os

import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax._extras import MissingExtraError
from ocjax.cli.gallery import states
from ocjax.evaluation import time_plots, timing
from ocjax.evaluation.timing import Measurement
from tests.support.command import run


def measurement(game, what, batch=64, median=1.0):
    return Measurement(game, what, batch, 0.5, median, median / 2, 2 * median)


def test_bench(tmp_path):
    before = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    out = tmp_path / "times.jsonl"
    result = run("bench", "Pong", "--envs", 2, "--seconds", 0.01, "--json", out)
    assert result.exit_code == 0, result.output
    found = [json.loads(line) for line in out.read_text().splitlines()]
    environments = {
        f"environment {objects}" for objects in ("without objects", "with REM", "with VEM")
    }
    assert {m["what"] for m in found} >= {
        "REM",
        "VEM",
        "ale-py's vector environment",
    } | environments
    assert all(0 < m["low"] <= m["median"] <= m["high"] for m in found)
    assert all(m["processor"] and m["jax"] for m in found)
    if hasattr(os, "sched_getaffinity"):
        assert {m["cores"] for m in found} == {1}
        assert os.sched_getaffinity(0) == before
    assert "first, s" in result.output
    table = [line for line in result.output.splitlines() if line[:1] in "┃│"]
    assert max(map(len, table)) <= 80


def test_wrong_game():
    assert run("bench", "Pongg").exit_code == 2


def test_opencv_is_timed_where_it_is_installed():
    game = ocjax.load("Pong")
    _, frames = states(game, 10, seed=0)
    found = list(timing.opencv(game, frames, 0.01))
    assert [m.what for m in found] == (
        ["OpenCV's contours"] if importlib.util.find_spec("cv2") else []
    )
    assert all(m.batch == len(frames) for m in found)


def test_figures(tmp_path):
    if not importlib.util.find_spec("matplotlib"):
        with pytest.raises(MissingExtraError, match="pip install matplotlib"):
            time_plots.steps_figure([measurement("Pong", "REM")])
        return
    found = [
        measurement(game, what, batch)
        for game in ("Pong", "Skiing")
        for what in ("REM", "VEM")
        for batch in (1, 64)
    ]
    for figure in (time_plots.steps_figure, time_plots.batches_figure):
        path = tmp_path / "figure.png"
        path.write_bytes(figure([*found, measurement("Pong", timing.WITHOUT_OBJECTS)]))
        with Image.open(path) as picture:
            assert picture.size[0] >= 600
            assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 2
