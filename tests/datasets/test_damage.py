"""Untrusted datasets: wrong content of any kind in any field of any file raises an error that names
the file."""

import io
import json
import os
import resource
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import datasets
from ocjax.datasets import DatasetError, columns, generation, shards
from tests.support.command import run
from tests.support.marks import slow_but

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

SHARD = "data/train-00000-of-00001.parquet"
WRONG = {
    "missing": ...,
    "zero": 0,
    "negative": -3,
    "huge": 10**12,
    "enormous": 10**40,
    "text": "ten",
    "number as text": "10",
    "fraction": 9.5,
    "nan": float("nan"),
    "infinite": float("inf"),
    "null": None,
    "true": True,
    "list": [[]],
    "object": {"a": []},
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("dataset") / "pong"
    datasets.generate(datasets.plan("Pong", 20, [0], {"repeat": 100}), path)
    return path


@pytest.fixture
def dataset(made, tmp_path):
    """A copy of a dataset."""
    (tmp_path / "pong" / "data").mkdir(parents=True)
    for name in ("README.md", "dataset.json", SHARD):
        (tmp_path / "pong" / name).write_bytes((made / name).read_bytes())
    return tmp_path / "pong"


def changed(known, name, value):
    return {key: v for key, v in known.items() if key != name} | (
        {} if value is ... else {name: value}
    )


NUMBERS = ("states", "shard_states", "sequence_states")
RIGHT_KINDS = {
    "md5": ("text", "number as text"),
    "code": ("text", "number as text"),
    "least_f1": ("zero",),
    "starts": ("missing",),
    "policy_settings": ("missing",),
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("name", [f.name for f in datasets.plans.dataclasses.fields(datasets.Plan)])
def test_fields_of_the_plan(made, tmp_path, name, kind):
    if kind in RIGHT_KINDS.get(name, ()):
        return
    plan = json.loads((made / "dataset.json").read_text())
    (tmp_path / "data").mkdir()
    (tmp_path / "dataset.json").write_text(json.dumps(changed(plan, name, WRONG[kind])))
    with pytest.raises(
        DatasetError, match=r"dataset\.json is damaged|is not complete: it lacks data/train-0"
    ) as caught:
        generation.open_dataset(tmp_path)
    assert "\n" not in str(caught.value)
    if name not in NUMBERS:
        assert "is not complete" not in str(caught.value)


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize(
    "path", ["seeds", "policies", "policies 0", "starts", "settings", "policy_settings"]
)
def test_entries_of_the_plan(made, tmp_path, path, kind):
    plan = json.loads((made / "dataset.json").read_text())
    value = None if WRONG[kind] is ... else WRONG[kind]
    name, _, place = path.partition(" ")
    if (name, kind) in {("seeds", "zero"), ("starts", "object")} or (
        name == "settings" and kind == "zero"
    ):
        return
    if name == "settings":
        plan["settings"]["frame_skip"] = value
    elif name == "policy_settings":
        plan["policy_settings"] = {"repeat": value}
    elif place:
        plan["policies"][0][1] = value
    else:
        plan[name] = [value]
    (tmp_path / "dataset.json").write_text(json.dumps(plan))
    with pytest.raises(DatasetError, match=r"dataset\.json is damaged"):
        generation.open_dataset(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"[]",
        b"5",
        b"null",
        b"{",
        b'{"states": ' + b"9" * 5000 + b"}",
        b"[" * 100_000,
        b"\xff\xfe",
        b" " * (2**24 + 1),
    ],
    ids=["empty", "list", "number", "null", "brace", "digits", "deep", "bytes", "long"],
)
@pytest.mark.parametrize("way", ["open", "again"])
def test_texts_of_the_plan(dataset, text, way):
    plan = datasets.plan("Pong", 20, [0], {"repeat": 100})
    (dataset / "dataset.json").write_bytes(text)
    with pytest.raises(DatasetError, match=r"dataset\.json is damaged"):
        generation.open_dataset(dataset) if way == "open" else datasets.generate(plan, dataset)


@pytest.mark.parametrize("name", ["dataset.json", SHARD])
def test_pipes_do_not_hang(dataset, name):
    (dataset / name).unlink()
    os.mkfifo(dataset / name)
    with pytest.raises(DatasetError, match=r"dataset\.json is not a regular file|is not complete"):
        datasets.relabel(dataset)


def rewritten(dataset, change_table=lambda table: table, facts=None, metadata=None):
    """Write the shard again with a change."""
    table = parquet.read_table(dataset / SHARD)
    known = dict(table.schema.metadata)
    if facts is not None:
        known[columns.FACTS] = json.dumps(facts(json.loads(known[columns.FACTS]))).encode()
    known = known if metadata is None else metadata
    parquet.write_table(change_table(table).replace_schema_metadata(known), dataset / SHARD)


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize(
    "name",
    [
        "code",
        "states",
        "sequences",
        "sequences_left_out",
        "states_left_out",
        "counts",
        "Player",
        "Ball 3",
    ],
)
def test_metadata_of_shards(dataset, name, kind):
    category, _, place = name.partition(" ")

    def change(facts):
        if place:
            facts["counts"][category][int(place)] = None if WRONG[kind] is ... else WRONG[kind]
            return facts
        if category in facts["counts"]:
            return facts | {"counts": changed(facts["counts"], category, WRONG[kind])}
        return changed(facts, name, WRONG[kind])

    if (name, kind) in {
        (n, "zero") for n in ("sequences", "sequences_left_out", "states_left_out", "Ball 3")
    }:
        return
    if (name, kind) in {
        ("code", "text"),
        ("code", "number as text"),
        ("sequences", "huge"),
        ("Ball 3", "huge"),
        ("Ball 3", "fraction"),
    }:
        return
    rewritten(dataset, facts=change)
    with pytest.raises(
        DatasetError, match=r"train-00000-of-00001\.parquet cannot be read: "
    ) as caught:
        datasets.relabel(dataset)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "metadata",
    [
        {},
        {"ocjax": "{"},
        {"ocjax": "[" * 100_000},
        {"ocjax": b"\xff"},
        {"ocjax": "[]"},
        {"other": "x"},
    ],
)
def test_shards_without_metadata(dataset, metadata):
    rewritten(dataset, metadata=metadata)
    with pytest.raises(DatasetError, match=r"train-00000-of-00001\.parquet cannot be read: "):
        datasets.relabel(dataset)


def replaced(table, name, column):
    return table.set_column(table.schema.get_field_index(name), name, column)


def without_first(column):
    """The column with a null in its first row."""
    return pa.chunked_array([pa.array([None, *column.to_pylist()[1:]], column.type)])


TABLES = {
    "missing": lambda table, name: table.drop_columns([name]),
    "doubled": lambda table, name: table.append_column(name, table[name]),
    "null": lambda table, name: replaced(table, name, without_first(table[name])),
    "all null": lambda table, name: replaced(table, name, pa.nulls(len(table))),
    "of structures": lambda table, name: replaced(table, name, pa.array([{"a": 1}] * len(table))),
    "of lists": lambda table, name: replaced(table, name, pa.array([[1]] * len(table))),
    "of words": lambda table, name: replaced(table, name, pa.array(["a"] * len(table))),
    "of nan": lambda table, name: replaced(table, name, pa.array([float("nan")] * len(table))),
    "of large numbers": lambda table, name: replaced(
        table, name, pa.array([2**63 - 1] * len(table))
    ),
}
RIGHT = {
    ("policy", "of words"),
    ("policy", "of nan"),
    ("policy", "of large numbers"),
    ("reward", "of nan"),
    ("reward", "of large numbers"),
}
RIGHT |= {(name, "of large numbers") for name in ("index", "seed", "terminated", "truncated")}
RIGHT |= {("terrain", "null"), ("terrain", "all null")}  # Pong has no terrain
RIGHT |= {(name, "of nan") for name in ("terminated", "truncated")}


@pytest.mark.parametrize("kind", TABLES)
@pytest.mark.parametrize("name", columns.schema({}).names)
def test_columns_of_shards(dataset, name, kind):
    """An export checks the columns that it reads; relabelling checks the others."""
    if (name, kind) in RIGHT:
        return
    rewritten(dataset, lambda table: TABLES[kind](table, name))
    with pytest.raises(
        DatasetError, match=r"train-00000-of-00001\.parquet cannot be read: .*"
    ) as caught:
        list(shards.rows(dataset / SHARD))
    assert name in str(caught.value)
    if kind in ("missing", "doubled") and name in ("image", "rem"):
        assert run("export", dataset, "--out", dataset / "x.csv").exit_code == 2


def png(size, mode="P"):
    buffer = io.BytesIO()
    Image.new(mode, size).save(buffer, "PNG")
    return buffer.getvalue()


GOOD = png((160, 210))
PICTURES = {
    "empty": b"",
    "no picture": b"\x89PNG\r\n\x1a\nxxxx",
    "cut off": GOOD[: len(GOOD) // 2],
    "small": png((159, 210)),
    "large": png((9000, 9000)),
    "grey": png((160, 210), "L"),
    "colours": png((160, 210), "RGB"),
    "another format": b"GIF89a" + b"\0" * 50,
}


@pytest.mark.parametrize("kind", PICTURES)
@pytest.mark.parametrize("name", columns.PICTURES)
def test_pictures_of_shards(dataset, name, kind):
    pictures = pa.array(
        [{"bytes": PICTURES[kind], "path": "/etc/passwd"}] * 20, columns.schema({}).field(name).type
    )
    rewritten(
        dataset,
        lambda table: replaced(table, name, pictures),
        facts=lambda facts: facts | {"code": "old"},
    )
    with pytest.raises(
        DatasetError, match=r"train-00000-of-00001\.parquet cannot be read: the picture of row 0 "
    ):
        datasets.relabel(dataset)
    if name == "image":
        with pytest.raises(DatasetError, match=r"the picture of row 0 "):
            datasets.export(dataset, dataset.parent / "x.csv")


@pytest.mark.parametrize(
    ("category", "index"),
    [
        ("Ghost", 0),
        ("", 0),
        ("Ball", 1),
        ("Ball", -1),
        ("Ball", 2**31 - 1),
        (None, 0),
        ("Ball", None),
    ],
)
def test_objects_of_shards(dataset, category, index, monkeypatch, tmp_path):
    pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))

    def change(table):
        rows = table["rem"].to_pylist()
        for row in rows:
            for record in row:
                record |= {"category": category, "index": index}
        return replaced(table, "rem", pa.array(rows, table["rem"].type))

    rewritten(dataset, change)
    with pytest.raises(DatasetError, match=r"train-00000-of-00001\.parquet cannot be read: "):
        datasets.export(dataset, "minari:pong/x-v0")
    assert not (tmp_path / "minari" / "pong" / "x-v0").exists()


@pytest.mark.parametrize(
    ("name", "value"),
    [("action", 6), ("action", -2), ("reward", float("nan")), ("reward", float("inf"))],
)
def test_steps_of_shards(dataset, name, value, monkeypatch, tmp_path):
    pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    rewritten(
        dataset,
        lambda table: replaced(table, name, pa.array([value] * len(table), table[name].type)),
    )
    with pytest.raises(
        DatasetError,
        match=r"parquet cannot be read: actions must be from 0 to 5, and rewards finite",
    ):
        datasets.export(dataset, "minari:pong/x-v0")


def test_objects_of_other_decoders_are_written_again(dataset, made):
    """The categories of another decoder may have other names."""

    def change(table):
        rows = [
            [record | {"category": "Old"} for record in row] for row in table["rem"].to_pylist()
        ]
        return replaced(table, "rem", pa.array(rows, table["rem"].type))

    rewritten(dataset, change, facts=lambda facts: facts | {"code": "old", "counts": {"Old": [1]}})
    datasets.relabel(dataset)
    assert (dataset / SHARD).read_bytes() == (made / SHARD).read_bytes()


@pytest.mark.parametrize("kind", slow_but(["cut off"], ["cut off", "empty", "zeros", "flipped"]))
def test_damaged_parquet_files(dataset, kind):
    data = (dataset / SHARD).read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(1 if kind in ("empty", "zeros") else 20):
        flipped = np.frombuffer(data, np.uint8).copy()
        flipped[rng.integers(len(flipped), size=20)] ^= 0xFF
        cut = data[: rng.integers(len(data))]
        (dataset / SHARD).write_bytes(
            {"cut off": cut, "empty": b"", "zeros": bytes(len(data)), "flipped": flipped.tobytes()}[
                kind
            ]
        )
        try:
            for part in shards.rows(dataset / SHARD):
                columns.frames(part["image"], ocjax.load("Pong"))
        except DatasetError:
            continue
        assert kind == "flipped"


BOMB = """
import resource, sys
from ocjax.datasets import shards
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, resource.RLIM_INFINITY))
try:
    list(shards.rows(sys.argv[1]))
except shards.DatasetError as error:
    print(error)
"""


@pytest.mark.skipif(
    not hasattr(resource, "RLIMIT_AS") or sys.platform == "darwin",
    reason="memory cannot be limited",
)
def test_large_pictures_take_no_memory(dataset):
    """Eight rows with a picture of 150 MB each, in a small file."""
    picture = pa.array(
        [{"bytes": bytes(150_000_000), "path": None}], columns.schema({}).field("image").type
    )
    table = parquet.read_table(dataset / SHARD).slice(0, 8)
    table = replaced(table, "image", picture.take(pa.array([0] * 8)))
    parquet.write_table(table, dataset / SHARD, compression="zstd")
    assert (dataset / SHARD).stat().st_size < 1_000_000
    done = subprocess.run(
        [sys.executable, "-c", BOMB, dataset / SHARD],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert "too many for 8 rows" in done.stdout
