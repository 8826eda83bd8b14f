"""Frames at the limits of vision rules."""

import shutil

import numpy as np
import pytest

import ocjax
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Cells, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed
from tests.support.command import run_app
from tests.support.record import __main__ as command
from tests.support.record import limits
from tests.support.states import DATA, excerpt


@pytest.mark.parametrize(
    "size", [(1, 1, 1), (4, 3, 12), (4, 3, 11), (4, 3, 6), (4, 3, 4), (2, 7, 7)]
)
def test_components_have_their_size_and_pixels(size):
    frame = np.zeros((20, 20), np.uint8)
    limits.Component(6, 5, 8, *size).draw(frame)
    rows, columns = np.nonzero(frame)
    assert (columns.min(), rows.min()) == (5, 8)
    assert (np.ptp(columns) + 1, np.ptp(rows) + 1, len(rows)) == size
    steps = (
        np.abs(np.stack([rows, columns], axis=1)[:, None] - np.stack([rows, columns], axis=1)).max(
            axis=-1
        )
        <= 1
    )
    assert np.linalg.matrix_power(steps.astype(float), len(rows))[0].all(), "connected"


def test_what_is_beyond_the_frame_is_not_drawn():
    frame = np.zeros((5, 5), np.uint8)
    limits.Component(6, -2, 3, 4, 4, 16).draw(frame)
    assert frame.nonzero()[0].tolist() == [3, 3, 4, 4]


def test_sizes_are_at_a_limit_or_beyond_it():
    sizes = set(limits.sizes_at_limits(Shape(w=(3, 5), h=4, pixels=(10, 18))))
    assert {
        (3, 4, 12),
        (3, 4, 10),
        (3, 4, 9),
        (5, 4, 18),
        (5, 4, 19),
        (2, 4, 8),
        (6, 4, 18),
        (3, 5, 15),
        (3, 3, 9),
    } - sizes == {(2, 4, 8)}


def test_pixels_are_counted_with_those_that_a_gap_bridges():
    assert limits.pixels_with_gaps(2, 2, (0, 0)) == {3: 3, 4: 4}
    assert limits.pixels_with_gaps(2, 2, (1, 1)) == {8: 3, 9: 4}
    assert {(4, 3, 12), (4, 3, 11)} <= set(
        limits.sizes_at_limits(Shape(w=4, h=3, pixels=(0, 19)), (1, 1))
    )


def test_cells_may_lack_pixels_and_have_others_beside_them():
    frames = list(limits.of_cells(Cells(6, (10, 30), (20, 20), 4, 3, margin=(2, 1))))
    whole, *smaller = (drawn for _, drawn in frames[:3])
    assert [(c.width, c.height) for c in whole] == [(4, 3), (4, 3)]
    assert [drawn[0][3:5] for drawn in smaller] == [(3, 3), (4, 2)]
    beside = {(drawn[1].left, drawn[1].top) for _, drawn in frames[3:] if drawn[0].left == 10}
    assert beside == {(7, 20), (8, 20), (15, 20), (16, 20), (10, 18), (10, 19), (10, 23), (10, 24)}


def test_runs_of_a_filter_touch_an_object_or_are_apart():
    runs = [
        (drawn[1].height, drawn[1].left)
        for drawn in limits.filtered((ShortRuns(5),), 6, (0, 0, 20, 20), (4, 4))
    ]
    assert runs == [(5, 12), (5, 14), (6, 12), (6, 14)]


def test_each_run_is_alone_where_there_are_few_slots():
    rule = Runs(tuple(Run(6, row, 10, 8, 4) for row in (50, 70, 90)), most=1, then=(Packed(),))
    alone = [drawn[0].top for _, drawn in limits.of_runs(rule, 2) if len(drawn) == 1]
    assert alone == [50, 70, 90]
    assert not [drawn for _, drawn in limits.of_runs(rule, 3) if len(drawn) == 1]


def test_colors_that_follow_on_those_of_a_rule():
    assert limits.other_colors((2, 4, 8)) == [6, 10]
    assert limits.other_colors((2, 4)) == []


def test_frames_come_from_text():
    played = excerpt("Pong")["screens"]
    frame = limits.frames("1 | 144 74,92 | 74,50,60,3,2,6 92,80,60,1,1,1\n", played)[0]
    kept = ~np.isin(played[1], (74, 92))
    kept[60:62, 50:53], kept[60, 80] = False, False
    assert (frame[60:62, 50:53] == 74).all()
    assert frame[60, 80] == 92
    assert np.array_equal(frame[kept], played[1][kept])
    assert limits.frames("", played).shape == (0, 210, 160)


def test_command(tmp_path):
    (tmp_path / "limits").mkdir()
    shutil.copy(DATA / "Pong.npz", tmp_path)
    result = run_app(command.app, "Pong", "limits", "--data", tmp_path)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "limits" / "Pong.txt").read_text() == (
        DATA / "limits" / "Pong.txt"
    ).read_text()
    assert len(limits.read(ocjax.load("Pong"), tmp_path)) > 5
