"""Datasets: contents, equal bytes, interruptions, relabelling, exports, and clusters."""

import csv
import dataclasses
import io
import itertools
import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import ocjax
from ocjax import datasets, files
from ocjax.cli.app import app
from ocjax.datasets import DatasetError, columns, exports, labels, playing, shards
from ocjax.emulators import ram_starts
from ocjax.files import pipeline
from ocjax.play import policies
from tests.support.marks import slow_but

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


def small_plan(game, *args, **options):
    """A plan with files and sequences of a few states."""
    return dataclasses.replace(
        datasets.plan(game, *args, **options), shard_states=20, sequence_states=2
    )


@pytest.fixture(scope="module")
def pong():
    return ocjax.load("Pong")


@pytest.fixture(scope="module")
def plan(pong):
    return small_plan(pong, 30)


@pytest.fixture(scope="module")
def folder(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("dataset") / "pong"
    datasets.generate(plan, path)
    return path


@pytest.fixture
def copy(folder, tmp_path):
    return copied(folder, tmp_path / "copy")


def copied(folder, path):
    for name, content in contents(folder).items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)
    return path


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def rows_of(folder):
    return parquet.read_table(folder / "data").to_pylist()


def test_states_and_objects(folder, pong):
    rows = rows_of(folder)
    assert [row["index"] for row in rows] == list(range(30))
    assert [row["seed"] for row in rows] == [0] * 15 + [42] * 15
    # The first five of the 10 instances play two states of each seed, the others one.
    assert [row["policy"] for row in rows] == (["random"] * 6 + ["trained"] * 9) * 2
    assert [row["step"] for row in rows] == ([0, 1] * 5 + [0] * 5) * 2
    for row in rows:
        assert (row["action"] == -1) == (row["step"] == 0)
    rams = np.array([row["ram"] for row in rows], np.uint8)
    frames = np.stack([np.asarray(Image.open(io.BytesIO(row["image"]["bytes"]))) for row in rows])
    rem, vem = pong.rem(rams).to_list(), pong.vem(frames).to_list()
    for row, by_ram, by_pixels in zip(rows, rem, vem, strict=True):
        for name, records in (("rem", by_ram), ("hud", by_ram), ("vem", by_pixels)):
            expected = [r for r in records if name == "vem" or r["hud"] == (name == "hud")]
            assert [plain(o) for o in row[name]] == expected


def plain(stored):
    """A stored object as `Objects.to_list` has it."""
    record = {
        "category": stored["category"],
        "slot": stored["index"],
        **{k: stored[k] for k in "xywh"},
    }
    record |= {"rgb": tuple(stored[k] for k in "rgb"), "hud": stored["hud"]}
    return record | {k: stored[k] for k in ("value", "orientation") if stored[k] is not None}


def test_actions_led_to_the_states(plan, folder, pong):
    """Playing the recorded actions again gives the recorded RAM."""
    settings = ocjax.envs.Settings(**plan.settings)
    seed = int(np.random.SeedSequence([0, 0]).generate_state(1)[0] & 0x7FFFFFFF)
    pool = ocjax.envs.AlePool(pong, 1, settings, num_workers=0)
    pool.reset([seed])
    first, second = rows_of(folder)[:2]
    assert pool.ram[0].tolist() == first["ram"]
    pool.send(np.array([second["action"]]))
    pool.wait()
    assert pool.ram[0].tolist() == second["ram"]
    pool.close()


def test_policies_play_with_their_own_settings(tmp_path, pong):
    trained = policies.read(policies.find("trained", pong), pong)
    file, settings = (
        str(tmp_path / "other.npz"),
        ocjax.envs.Settings(frame_skip=2, repeat_action_probability=0.5, clip_rewards=True),
    )
    dataclasses.replace(trained, settings=settings).write(Path(file))
    plan = datasets.plan(pong, 60, seeds=[3], policies={"random": 30, file: 70})
    own = dataclasses.replace(settings, clip_rewards=False)
    assert plan.settings_of(file) == own
    assert plan.settings_of("random").frame_skip == 4
    assert datasets.Plan.from_json(plan.to_json()) == plan
    datasets.generate(plan, tmp_path / "data")
    rows = rows_of(tmp_path / "data")
    seeds = np.random.SeedSequence([3, 0]).generate_state(10) & 0x7FFFFFFF
    for instance, played in ((0, plan.settings_of("random")), (9, own)):
        states = [row for row in rows if row["instance"] == instance]
        pool = ocjax.envs.AlePool(pong, 1, played, num_workers=0)
        pool.reset([int(seeds[instance])])
        for row, after in itertools.zip_longest(states, states[1:]):
            assert pool.ram[0].tolist() == row["ram"]
            if after is not None:
                pool.step(np.array([after["action"]]))
        pool.close()
    sheet = (tmp_path / "data" / "README.md").read_text()
    assert "Settings of the emulators that `random` play: frame_skip 4" in sheet
    assert f"Settings of the emulators that `{file}` play: frame_skip 2" in sheet


def test_policies_with_other_actions_are_refused(tmp_path, pong):
    trained = policies.read(policies.find("trained", pong), pong)
    other = dataclasses.replace(trained, settings=ocjax.envs.Settings(full_action_space=True))
    other.write(tmp_path / "other.npz")
    with pytest.raises(
        ValueError, match="must have the same actions, but full_action_space differs"
    ):
        datasets.plan(pong, 60, policies={"random": 30, str(tmp_path / "other.npz"): 70})


# The games of the OCAtari paper's object-centric agents.
PAPER_AGENTS = (
    "Asterix",
    "Boxing",
    "Breakout",
    "Freeway",
    "Pong",
    "Skiing",
    "SpaceInvaders",
    "Tennis",
)
# Steps of four emulated frames within which the ball must have been seen. Tennis hides it for 33
# steps after each point.
BALLS = {"Breakout": 15, "Pong": 15, "Tennis": 33}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAPER_AGENTS)
def test_states_are_in_play(name):
    """No policy waits for FIRE: 95 % of the states show the player (the first category), and the
    ball now or within the last second."""
    game = ocjax.load(name)
    plan = datasets.plan(game, 10_000, seeds=[0])
    played: dict[int, list[np.ndarray]] = {}
    for stretches in playing.play(game, plan, plan.shards[0]):
        for i, stretch in enumerate(stretches):
            played.setdefault(i, []).append(stretch["ram"])
    objects = [game.rem(np.concatenate(rams)) for rams in played.values()]
    assert share_seen(objects, game.categories[0].name, 1) >= 0.95
    if name in BALLS:
        assert share_seen(objects, "Ball", BALLS[name]) >= 0.95


def share_seen(episodes, category, steps):
    """The share of states with a valid object of a category, now or within the last `steps`
    steps."""
    seen = []
    for objects in episodes:
        valid = np.asarray(objects.of(category).valid).any(axis=-1)
        seen += [valid[max(t - steps + 1, 0) : t + 1].any() for t in range(len(valid))]
    return np.mean(seen)


def test_previous_frames_show_the_state_before(folder, pong):
    row = rows_of(folder)[1]
    image, previous = (
        np.asarray(Image.open(io.BytesIO(row[name]["bytes"]))) for name in columns.PICTURES
    )
    assert image.shape == previous.shape == pong.screen
    assert np.array_equal(
        np.asarray(Image.open(io.BytesIO(row["image"]["bytes"])).convert("RGB")),
        pong.palette[image],
    )


def test_starts(tmp_path, pong):
    plan = small_plan(pong, 12, seeds=[5], starts=[{}, {"player_score": 7, 13: 2}])
    assert datasets.Plan.from_json(plan.to_json()) == plan
    for name in ("one", "two"):
        datasets.generate(plan, tmp_path / name)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    for row in rows_of(tmp_path / "one"):
        values = [o["value"] for o in row["hud"]]
        assert values == ([7, 2] if row["instance"] % 2 else [0, 0])
        assert values == [o["value"] for o in row["vem"] if o["hud"]]
    assert (
        "its RAM, in turn for the instances: `none`; `player_score=7,13=2`."
        in (tmp_path / "one" / "README.md").read_text()
    )
    old = json.loads(plan.to_json())
    del old["starts"]
    assert datasets.Plan.from_json(json.dumps(old)) == dataclasses.replace(plan, starts=())


@pytest.mark.parametrize(
    ("name", "text", "writes", "masks"),
    [
        ("Kangaroo", "level=2", {36: 2}, {36: 255}),
        ("Amidar", "level=5,86=0", None, "writes bits of byte 86 twice"),
        ("Amidar", "level=5", {86: 5 << 2}, {86: 7 << 2}),
        ("Amidar", "level=8", None, "level of Amidar must be from 0 to 7, got 8"),
        ("Amidar", "gained=42", {115: 0x42}, {115: 255}),
        ("Asteroids", "ship_x=-2", {73: 254}, {73: 255}),
        (
            "SpaceInvaders",
            "rows=0x3F",
            dict.fromkeys(range(18, 24), 63),
            dict.fromkeys(range(18, 24), 255),
        ),
        (
            "Qbert",
            "score=100",
            None,
            "a number of several bytes: write the bytes 89, 90, 91 by their numbers",
        ),
        ("Qbert", "rund=1", None, r"the RAM of Qbert has no field 'rund' .*: did you mean round"),
        ("Qbert", "128=1", None, "has no field '128'.*a byte is a number up to 127"),
        ("Qbert", "99=256", None, "99 of Qbert must be from 0 to 255, got 256"),
        (
            "Qbert",
            "round",
            None,
            "must have the form NAME=VALUE,NAME=VALUE or be none, got 'round'",
        ),
        ("Qbert", "round=1,round=2", None, "has a name twice"),
        ("Qbert", "none", {}, {}),
    ],
)
def test_starts_write_what_they_say(name, text, writes, masks):
    if writes is None:
        with pytest.raises(ValueError, match=masks):
            datasets.plan(name, 10, starts=[ram_starts.parse(text)])
        return
    variation = ram_starts.variation(ocjax.load(name), ram_starts.parse(text))
    assert (variation.writes, variation.masks) == (writes, masks)
    ram = np.full(128, 0xAA, np.uint8)
    variation(ram)
    assert all(ram[a] == (0xAA & ~masks[a] & 255 | value) for a, value in writes.items())
    assert (np.delete(ram, list(writes)) == 0xAA).all()


INTERRUPTED = """
import os, signal, sys
from ocjax import datasets
def report(done, total):
    if done >= 15:
        os.kill(os.getpid(), signal.SIGKILL)
datasets.generate(datasets.Plan.from_json(sys.argv[1]), sys.argv[2], report=report)
"""


def test_killed_and_resumed_equals_uninterrupted(tmp_path, folder, plan):
    out = tmp_path / "out"
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, plan.to_json(), out])
    assert done.returncode == -signal.SIGKILL
    (out / "data" / ".train-00001-of-00002.parquet.1.tmp").write_bytes(b"unfinished")
    kept = {p: p.stat().st_mtime_ns for p in out.glob("data/*.parquet")}
    assert len(kept) == 1
    assert not (out / "README.md").exists()
    with pytest.raises(DatasetError, match=r"is not complete: .*00001-of-00002"):
        datasets.relabel(out)
    datasets.generate(plan, out)
    assert {p: p.stat().st_mtime_ns for p in kept} == kept, (
        "shards that were complete are not made again"
    )
    assert contents(out) == contents(folder)


def test_sequences_that_disagree_are_left_out(tmp_path, pong, monkeypatch):
    def disagree(*args):
        found = labels.label(*args)
        found.counts.found[:3] = found.counts.confirmed[:3] = (
            0  # the first sequence, and half of the second
        )
        return found

    monkeypatch.setattr(
        shards, "labels", type("Labels", (), {**vars(labels), "label": staticmethod(disagree)})
    )
    datasets.generate(small_plan(pong, 20, seeds=[7], policies={"random": 100}), tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    assert [row["index"] for row in rows] == list(range(4, 20))
    facts = shards.facts(tmp_path / "out" / "data" / "train-00000-of-00001.parquet")
    assert (facts["sequences"], facts["sequences_left_out"], facts["states_left_out"]) == (10, 2, 4)
    assert facts["counts"]["Player"][0] == 16
    sheet = (tmp_path / "out" / "README.md").read_text()
    assert "| left out | 2 | 4 |" in sheet


def test_relabel(copy, folder):
    path = copy / "data" / "train-00001-of-00002.parquet"
    table, facts = parquet.read_table(path), shards.facts(path)
    empty = pa.array([[]] * len(table), table["rem"].type)
    table = table.set_column(table.schema.get_field_index("rem"), "rem", empty)
    shards._write(path, table, ocjax.load("Pong"), facts | {"code": "old", "counts": {}})
    (copy / "README.md").write_text("old")
    before = {p: p.stat().st_mtime_ns for p in copy.glob("data/*")}
    datasets.relabel(copy)
    after = {p: p.stat().st_mtime_ns for p in copy.glob("data/*")}
    assert [p for p in after if after[p] != before[p]] == [path]
    assert contents(copy) == contents(folder)


def test_csv(folder, tmp_path, pong, monkeypatch):
    monkeypatch.setattr(csv, "field_size_limit", csv.field_size_limit)
    csv.field_size_limit(10**7)
    datasets.export(folder, tmp_path / "pong.csv")
    with (tmp_path / "pong.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    rows = rows_of(folder)
    assert list(lines[0]) == ["INDEX", "OBS", "HUD", "RAM", "VIS"]
    assert [line["INDEX"] for line in lines[:4]] == [
        "00000_00000",
        "00000_00001",
        "00001_00000",
        "00001_00001",
    ]
    pixels = np.array([int(x) for x in lines[1]["OBS"][1:-1].split(",")], np.uint8).reshape(
        210, 160, 3
    )
    assert np.array_equal(
        pixels, np.asarray(Image.open(io.BytesIO(rows[1]["image"]["bytes"])).convert("RGB"))
    )
    player = next(o for o in rows[1]["rem"] if o["category"] == "Player")
    assert f"Player at (140, {player['y']}), (4, 16)" in lines[1]["RAM"]
    assert "Score" not in lines[1]["RAM"]
    assert lines[1]["HUD"].startswith("[EnemyScore at (")


def test_csv_replaces_a_file_only_when_it_is_complete(folder, tmp_path, monkeypatch):
    (tmp_path / "pong.csv").write_text("old")
    with monkeypatch.context() as patch, pytest.raises(ZeroDivisionError):
        patch.setattr(exports, "_listed", lambda objects: 1 / 0)
        datasets.export(folder, tmp_path / "pong.csv")
    assert (tmp_path / "pong.csv").read_text() == "old"
    datasets.export(folder, tmp_path / "pong.csv")
    assert (tmp_path / "pong.csv").read_text().startswith("INDEX,OBS,")
    assert [p.name for p in tmp_path.iterdir()] == ["pong.csv"]


@pytest.fixture
def minari(tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    module = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    return module


@pytest.mark.parametrize("block_rows", [7, 65536])
def test_minari(folder, pong, minari, monkeypatch, block_rows):
    monkeypatch.setitem(pipeline.BLOCK_ROWS, "rem", block_rows)
    datasets.export(folder, "minari:pong/oda-v0")
    rows = rows_of(folder)
    dataset = minari.load_dataset("pong/oda-v0")
    assert (dataset.total_episodes, dataset.total_steps) == (
        10,
        10,
    )  # pieces of one state have no step
    episode = dataset[1]
    assert episode.observations["ram"].tolist() == [row["ram"] for row in rows[2:4]]
    frame = np.asarray(Image.open(io.BytesIO(rows[3]["image"]["bytes"])))
    assert np.array_equal(episode.observations["screen"][1], frame)
    assert episode.actions.tolist() == [rows[3]["action"]]
    assert episode.truncations.tolist() == [True]
    files.extract("minari:pong/oda-v0", "minari:pong/more-v0")
    for copied_episode, original in zip(minari.load_dataset("pong/more-v0"), dataset, strict=True):
        rem = pong.rem(original.observations["ram"])
        for name in ("xywh", "valid", "orientation", "value", "rgb"):
            assert np.array_equal(copied_episode.infos["objects"][name], getattr(rem, name))
            assert np.array_equal(original.infos["rem"][name], getattr(rem, name))
        vem = pong.vem(original.observations["screen"])
        assert np.array_equal(original.infos["vem"]["xywh"], vem.xywh)
        assert np.array_equal(
            copied_episode.observations["screen"], original.observations["screen"]
        )
        assert np.array_equal(copied_episode.actions, original.actions)
        assert np.array_equal(copied_episode.infos["rem"]["value"], original.infos["rem"]["value"])


KILLED = """
import os, signal, sys
from ocjax import files
from ocjax.files import minari, pipeline
pipeline.BLOCK_ROWS = {"rem": 4, "vem": 4}
def kill(*args):
    os.kill(os.getpid(), signal.SIGKILL)
if sys.argv[2] == "extracting":
    report = lambda done, total: done >= 12 and kill()
    files.extract("minari:pong/oda-v0", sys.argv[1], report=report)
else:
    take, taken = minari._Objects.take, []
    def counted(*args):
        return kill() if len(taken) == 5 else taken.append(args) or take(*args)
    minari._Objects.take = counted
    files.extract("minari:pong/oda-v0", sys.argv[1])
"""


@pytest.mark.parametrize("stage", slow_but(["extracting"], ["extracting", "copying"]))
def test_minari_killed_and_resumed_equals_uninterrupted(
    folder, minari, monkeypatch, tmp_path, stage
):
    monkeypatch.setitem(pipeline.BLOCK_ROWS, "rem", 4)
    datasets.export(folder, "minari:pong/oda-v0")
    files.extract("minari:pong/oda-v0", "minari:pong/whole-v0")
    done = subprocess.run([sys.executable, "-c", KILLED, "minari:pong/parts-v0", stage])
    assert done.returncode == -signal.SIGKILL
    assert set(minari.list_local_datasets()) == {"pong/oda-v0", "pong/whole-v0"}
    work = tmp_path / "minari" / "pong" / ".parts-v0.parts"
    kept = {p: p.stat().st_mtime_ns for p in work.glob("0*.npz")}
    assert len(kept) >= 2
    last = {}

    def report(done, total):
        last.update({p: p.stat().st_mtime_ns for p in work.glob("0*.npz")})

    files.extract("minari:pong/oda-v0", "minari:pong/parts-v0", report=report)
    assert kept.items() <= last.items(), "finished blocks are not extracted again"
    assert sorted(p.name for p in work.parent.iterdir() if p.is_dir()) == [
        "oda-v0",
        "parts-v0",
        "whole-v0",
    ]
    assert stored(work.with_name("parts-v0")) == stored(work.with_name("whole-v0"))


def stored(folder):
    """The arrays of a Minari HDF5 file."""
    h5py = pytest.importorskip("h5py")
    found = {}
    with h5py.File(folder / "data" / "main_data.hdf5") as file:
        file.visititems(
            lambda name, item: found.update(
                {name: (dict(item.attrs), item[()].tolist() if hasattr(item, "dtype") else None)}
            )
        )
    return found


def test_minari_errors(folder, minari, tmp_path, monkeypatch):
    np.save(tmp_path / "Pong.npy", np.zeros((2, 128), np.uint8))
    with pytest.raises(ValueError, match="only a Minari dataset can be copied"):
        files.extract(tmp_path / "Pong.npy", "minari:pong/x-v0")
    with pytest.raises(ValueError, match=r"namespace/name-v0, got '\?'"):
        datasets.export(folder, "minari:?")
    for name in ("minari:Pong", "minari:pong/x"):
        with pytest.raises(ValueError, match="a Minari ID has the form namespace/name-v0, got "):
            datasets.export(folder, name)
    with pytest.raises(ValueError, match="a Minari ID has the form namespace/name-v0, got 'A'"):
        files.extract("minari:A", tmp_path / "x.npz")
    with pytest.raises(ValueError, match="`minari download pong/none-v0` gets it"):
        files.extract("minari:pong/none-v0", tmp_path / "x.npz")
    with monkeypatch.context() as patch, pytest.raises(ZeroDivisionError):
        patch.setattr(columns, "padded", lambda *a: 1 / 0)
        datasets.export(folder, "minari:pong/x-v0")
    assert minari.list_local_datasets() == {}
    assert not list((tmp_path / "minari" / "pong").glob("*-v0*"))
    datasets.export(folder, "minari:pong/x-v0")
    with pytest.raises(ValueError, match="there is a Minari dataset pong/x-v0 already"):
        datasets.export(folder, "minari:pong/x-v0")


def test_loadable_with_datasets(folder, tmp_path):
    loaded = pytest.importorskip("datasets").load_dataset(
        str(folder), cache_dir=str(tmp_path), split="train"
    )
    assert len(loaded) == 30
    assert loaded[3]["image"].mode == "P"
    assert loaded[3]["rem"] == rows_of(folder)[3]["rem"]


def test_shards_are_inputs(folder, tmp_path, pong):
    path = folder / "data" / "train-00000-of-00002.parquet"
    files.extract(path, tmp_path / "rem.npz")
    files.extract(path, tmp_path / "vem.npz", array="image")
    assert (
        np.load(tmp_path / "rem.npz")["valid"].shape
        == np.load(tmp_path / "vem.npz")["valid"].shape
        == (15, pong.num_slots)
    )


def test_shards_of_older_versions(copy, folder, tmp_path, pong):
    """Their metadata lack the game: the error asks for it, and relabelling adds it."""
    path = copy / "data" / "train-00000-of-00002.parquet"
    table = parquet.read_table(path)
    facts = {
        columns.FACTS: json.dumps(shards.facts(path) | {"code": "old"}),
        b"huggingface": table.schema.metadata[b"huggingface"],
    }
    parquet.write_table(table.replace_schema_metadata(facts), path)
    with pytest.raises(
        ocjax.errors.UnknownGameError,
        match=r"train-00000-of-00002\.parquet, ram names no game.*\(--game\)",
    ):
        files.extract(path, tmp_path / "rem.npz")
    files.extract(path, tmp_path / "rem.npz", "Pong")
    datasets.relabel(copy)
    assert contents(copy) == contents(folder)


def test_plan_takes_a_name(pong):
    assert datasets.plan("pong", 10) == datasets.plan(pong, 10)


def test_wrong_plans_and_folders_are_refused(copy, folder, pong, tmp_path):
    for shares in ({"random": 25, "repeat": 75}, {"random": 50}, {"random": 110, "repeat": -10}):
        with pytest.raises(DatasetError, match="multiples of 10 that add up to 100"):
            datasets.plan(pong, 10, policies=shares)
    with pytest.raises(ocjax.play.policies.PolicyError, match="no policy 'chess'"):
        datasets.plan(pong, 10, policies={"chess": 100})
    with pytest.raises(DatasetError, match="seeds must be distinct"):
        datasets.plan(pong, 10, [1, 1])
    with pytest.raises(ValueError, match="states must be"):
        datasets.plan(pong, 0)
    with pytest.raises(
        DatasetError,
        match=r"holds another dataset.*differs in states, shard_states, sequence_states\.",
    ):
        datasets.generate(datasets.plan(pong, 57), copy)
    (tmp_path / "file.csv").touch()
    with pytest.raises(DatasetError, match=r"file\.csv is a file, and a dataset is a folder"):
        datasets.generate(datasets.plan(pong, 57), tmp_path / "file.csv")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "x").touch()
    with pytest.raises(DatasetError, match="is not empty"):
        datasets.generate(datasets.plan(pong, 57), tmp_path / "other")
    with pytest.raises(DatasetError, match=r"has no dataset\.json"):
        datasets.relabel(tmp_path)
    with pytest.raises(ValueError, match=r"must end in \.csv"):
        datasets.export(folder, tmp_path / "x.json")
    (copy / "data" / "train-00001-of-00002.parquet").write_bytes(b"PAR1")
    with pytest.raises(DatasetError, match=r"00001-of-00002\.parquet cannot be read"):
        datasets.relabel(copy)
    (copy / "data" / "train-00001-of-00002.parquet").unlink()
    with pytest.raises(DatasetError, match=r"lacks data/train-00001-of-00002\.parquet; generate"):
        datasets.relabel(copy)
    (copy / "dataset.json").write_text("{}")
    with pytest.raises(DatasetError, match=r"dataset\.json is damaged"):
        datasets.relabel(copy)


def test_commands(tmp_path):
    run, out = CliRunner().invoke, str(tmp_path / "out")
    arguments = [
        "dataset",
        "Pong",
        "--states",
        "10",
        "--seed",
        "3",
        "--policy",
        "repeat",
        "--out",
        out,
    ]
    done = run(app, arguments)
    assert done.exit_code == 0, done.output
    again = run(app, arguments)
    assert again.exit_code == 0, again.output
    assert f"Complete already: {out}\n" in again.output
    assert {row["policy"] for row in rows_of(tmp_path / "out")} == {"repeat"}
    assert {row["seed"] for row in rows_of(tmp_path / "out")} == {3}
    assert (
        run(app, [*arguments[:-1], f"{out}2", "--start", "none", "--start", "ball_x=80"]).exit_code
        == 0
    )
    assert '"starts": [{}, {"ball_x": 80}]' in (tmp_path / "out2" / "README.md").read_text()
    assert run(app, ["relabel", out]).exit_code == 0
    assert run(app, ["export", out, "--out", str(tmp_path / "pong.csv")]).exit_code == 0
    assert len((tmp_path / "pong.csv").read_text().splitlines()) == 11
    wrong = run(app, ["dataset", "Pong", "--policy", "random=30", "--out", out])
    assert wrong.exit_code == 2
    assert "add up to 100" in wrong.output


def test_terrain(tmp_path):
    """The pictures have the numbers of kinds, and relabelling adds them to an old dataset."""
    game, folder = ocjax.load("MontezumaRevenge"), tmp_path / "dataset"
    datasets.generate(small_plan(game, 40), folder)
    made = contents(folder)
    for row in rows_of(folder):
        numbers = np.asarray(Image.open(io.BytesIO(row["terrain"]["bytes"])))
        masks = np.asarray(game.terrain_of(np.array(row["ram"], np.uint8)).masks)
        for k in range(len(game.terrain)):
            last = masks[k] & ~masks[k + 1 :].any(axis=0)
            np.testing.assert_array_equal(numbers == k + 1, last)
    path = next((folder / "data").iterdir())
    table, facts = parquet.read_table(path), shards.facts(path)
    old = table.drop_columns(["terrain"])
    shards._write(path, old, game, facts | {"code": "old"})
    with pytest.raises(DatasetError, match="one column terrain, and has 0: relabel the dataset"):
        list(shards.rows(path))
    datasets.relabel(folder)
    assert contents(folder) == made


def test_games_without_terrain(folder):
    assert all(row["terrain"] is None for row in rows_of(folder))
