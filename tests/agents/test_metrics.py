"""The record of a training run after each update; skipped unless the extra `rl` is installed."""

import csv
import os

import pytest

pytest.importorskip("tensorboardX", reason="the extra `rl` is not installed")

from tensorboardX.proto.event_pb2 import Event

from ocjax.agents.metrics import Metrics


def rows(folder):
    """The rows of `metrics.csv`."""
    with (folder / "metrics.csv").open() as file:
        return list(csv.DictReader(file))


def events(folder):
    """The events of all files of TensorBoard, in the order of writing."""
    out = []
    for path in sorted(
        (folder / "tensorboard").iterdir(), key=lambda path: path.stat().st_mtime_ns
    ):
        data = path.read_bytes()
        while data:
            size = int.from_bytes(data[:8], "little")
            out.append(Event.FromString(data[12 : 12 + size]))
            data = data[16 + size :]
    return out


def add(metrics, *updates):
    for i in updates:
        metrics.add(100 * i, 0.5, [float(i)], loss=i / 10)


def test_each_update_is_in_the_files_at_once(tmp_path):
    metrics = Metrics(tmp_path)
    for i in range(1, 4):
        add(metrics, i)
        assert [row["frames"] for row in rows(tmp_path)] == [str(100 * j) for j in range(1, i + 1)]
        steps = [event.step for event in events(tmp_path) if event.HasField("summary")]
        assert max(steps) == 100 * i
    assert rows(tmp_path)[-1] == {
        "frames": "300",
        "seconds": "1.5",
        "games": "1",
        "return": "2.0",
        "loss": "0.3",
    }
    metrics.close()


ROW = "300,1.5,1,2.0,0.3"
ENDS = {
    "none": "",
    "half": ROW[:9],
    "no end": ROW,
    "row": f"{ROW}\n",
    "two": f"{ROW}\n400,",
    "empty": "\n\n",
    "zeros": "\0" * 20_000,
}


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
def test_rows_after_the_checkpoint_are_dropped(tmp_path, end):
    """The file continues after the checkpoint's row, although a killed run has written further
    rows."""
    first = Metrics(tmp_path)
    add(first, 1, 2)
    saved, kept = first.save(), (tmp_path / "metrics.csv").read_text()
    first.close()
    for path in (tmp_path / "tensorboard").iterdir():
        path.rename(path.with_name("first"))  # files of one second have the same name
    (tmp_path / "metrics.csv").write_text(kept + end)
    second = Metrics(tmp_path)
    second.restore(saved, 2)
    assert (tmp_path / "metrics.csv").read_text() == kept
    add(second, 3)
    assert second.frames_per_second == 200
    second.close()
    whole = tmp_path / "whole"
    whole.mkdir()
    without = Metrics(whole)
    add(without, 1, 2, 3)
    without.close()
    assert (tmp_path / "metrics.csv").read_text() == (whole / "metrics.csv").read_text()
    starts = [event.step for event in events(tmp_path) if event.HasField("session_log")]
    assert starts == [100, 300]


def test_a_run_without_a_checkpoint_begins_again(tmp_path):
    (tmp_path / "metrics.csv").write_text("frames,return\n100,1.0\n200,")
    metrics = Metrics(tmp_path)
    add(metrics, 1)
    assert [row["frames"] for row in rows(tmp_path)] == ["100"]
    metrics.close()


@pytest.mark.parametrize("cut", range(1, 8))
def test_a_row_of_the_checkpoint_that_is_cut_off(tmp_path, cut):
    """A cut row raises an error, also if the remaining digits of its last number are a number."""
    metrics = Metrics(tmp_path)
    add(metrics, 1, 2)
    metrics.close()
    path = tmp_path / "metrics.csv"
    os.truncate(path, path.stat().st_size - cut)
    text = path.read_text()
    with pytest.raises(ValueError, match=r"metrics.csv has 1 rows, but the checkpoint needs 2"):
        Metrics(tmp_path).restore(metrics.save(), 2)
    assert path.read_text() == text


def test_a_file_with_other_columns(tmp_path):
    (tmp_path / "metrics.csv").write_text("frames,return\n100,1.0\n")
    metrics = Metrics(tmp_path)
    metrics.restore({"rows": 1, "seconds": 0.5, "recent": []}, 1)
    with pytest.raises(
        ValueError,
        match=r"metrics.csv must have the columns frames, seconds, .* got frames, return",
    ):
        add(metrics, 2)
    assert (tmp_path / "metrics.csv").read_text() == "frames,return\n100,1.0\n"
