"""Links in untrusted folders: ocjax writes, deletes and reads nothing through them."""

import json
import os

import numpy as np
import pytest

from ocjax import datasets, files
from ocjax.cli import play
from ocjax.files import writing
from ocjax.files.jobs import check_contents
from tests.support.command import run
from tests.support.states import excerpt

OLD = "the user's own text\n"


@pytest.fixture
def outside(tmp_path):
    """A folder of the user with files that links point to."""
    folder = tmp_path / "outside"
    folder.mkdir()
    for name in ("profile", "plan.json", ".old.tmp", "000000.npz"):
        (folder / name).write_text(OLD)
    yield folder
    left = {path.name: path.read_text() for path in folder.iterdir()}
    assert left == dict.fromkeys(("profile", "plan.json", ".old.tmp", "000000.npz"), OLD)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("dataset") / "pong"
    datasets.generate(datasets.plan("Pong", 10, [0], {"repeat": 100}), path)
    return path


@pytest.fixture
def dataset(made, tmp_path):
    """A copy of a dataset."""
    copy = tmp_path / "dataset"
    (copy / "data").mkdir(parents=True)
    for name in ("README.md", "dataset.json", "data/train-00000-of-00001.parquet"):
        (copy / name).write_bytes((made / name).read_bytes())
    return copy


def again(dataset):
    datasets.generate(datasets.Plan.from_json((dataset / "dataset.json").read_text()), dataset)


WAYS = pytest.mark.parametrize("way", [datasets.relabel, again])


@WAYS
def test_a_datasheet_that_is_a_link(dataset, made, outside, way):
    (dataset / "README.md").unlink()
    (dataset / "README.md").symlink_to(outside / "profile")
    way(dataset)
    assert not (dataset / "README.md").is_symlink()
    assert (dataset / "README.md").read_bytes() == (made / "README.md").read_bytes()


@WAYS
def test_a_datasheet_that_is_a_pipe(dataset, made, way):
    (dataset / "README.md").unlink()
    os.mkfifo(dataset / "README.md")
    way(dataset)
    assert (dataset / "README.md").read_bytes() == (made / "README.md").read_bytes()


def test_a_shard_that_is_a_link(dataset, made, tmp_path, monkeypatch):
    """The cache of the Hugging Face hub has such links.

    ocjax reads the link's file, but a new version does not change it.
    """
    shard, blob = dataset / "data" / "train-00000-of-00001.parquet", tmp_path / "blob"
    shard.rename(blob)
    shard.symlink_to(blob)
    content = blob.read_bytes()
    monkeypatch.setattr("ocjax.datasets.shards.code", lambda: "of another version")
    monkeypatch.setattr("ocjax.datasets.generation.code", lambda: "of another version")
    datasets.relabel(dataset)
    assert blob.read_bytes() == content
    assert not shard.is_symlink()
    assert shard.read_bytes() != content


@WAYS
def test_shards_in_a_folder_that_is_a_link(dataset, outside, way):
    (dataset / "data").rename(dataset.parent / "data")
    (dataset / "data").symlink_to(dataset.parent / "data")
    (dataset.parent / "data" / ".old.tmp").write_text(OLD)
    with pytest.raises(datasets.DatasetError, match=r"data is a link"):
        way(dataset)
    assert (dataset.parent / "data" / ".old.tmp").read_text() == OLD


def test_temporary_files_of_a_dataset(dataset, outside):
    """ocjax deletes links among the temporary files, and keeps folders."""
    (dataset / "data" / ".link.tmp").symlink_to(outside)
    (dataset / "data" / ".folder.tmp").mkdir()
    datasets.relabel(dataset)
    assert {path.name for path in (dataset / "data").iterdir()} == {
        "train-00000-of-00001.parquet",
        ".folder.tmp",
    }


@pytest.fixture
def ram(tmp_path):
    np.save(tmp_path / "Pong.npy", excerpt("Pong")["rams"][:3])
    return tmp_path / "Pong.npy"


def test_a_work_folder_that_is_a_link(ram, outside, tmp_path):
    (tmp_path / "x.npz.parts").symlink_to(outside)
    with pytest.raises(ValueError, match=r"x\.npz\.parts is a link"):
        files.extract(ram, tmp_path / "x.npz")


@pytest.mark.parametrize("name", ["plan.json", "000000.npz", ".old.tmp"])
def test_a_work_folder_with_links(ram, outside, tmp_path, name):
    (tmp_path / "x.npz.parts").mkdir()
    (tmp_path / "x.npz.parts" / name).symlink_to(outside / name)
    with pytest.raises(
        ValueError, match=r"a work folder must consist of files and folders, but .* is a link"
    ):
        files.extract(ram, tmp_path / "x.npz")


def test_an_unfinished_folder_that_is_a_link(ram, outside, tmp_path):
    (tmp_path / ".labels.tmp").symlink_to(outside)
    files.extract(ram, f"yolo:{tmp_path / 'labels'}")
    assert len(list((tmp_path / "labels" / "labels").iterdir())) == 3
    assert not (tmp_path / ".labels.tmp").is_symlink()


def test_an_unfinished_minari_dataset_that_is_a_link(dataset, outside, tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    states = datasets.plan("Pong", 20, [0], {"repeat": 100})
    datasets.generate(states, tmp_path / "more")
    (tmp_path / "minari" / "pong").mkdir(parents=True)
    (tmp_path / "minari" / "pong" / ".x-v0.tmp").symlink_to(outside)
    datasets.export(tmp_path / "more", "minari:pong/x-v0")
    assert list(minari.list_local_datasets()) == ["pong/x-v0"]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("ocjax-Pong.png", ["demo", "Pong"]),
        ("ocjax-causes-Pong.png", ["ram", "causes", "Pong"]),
        ("ocjax-Pong.npz", ["play", "Pong", "--human"]),
        ("ocjax-Pong.gif", ["play", "Pong", "--human", "--out", "own.npz"]),
        ("ocjax-Pong-0", ["train", "Pong"]),
    ],
)
def test_outputs_that_the_user_did_not_name(name, arguments, outside, tmp_path, monkeypatch):
    if arguments[0] == "train":
        pytest.importorskip("orbax.checkpoint", reason="the extra `rl` is not installed")
    monkeypatch.setattr(play.human_play, "play", lambda game: None)  # no window
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).symlink_to(outside if arguments[0] == "train" else outside / "profile")
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert f"{name} is a link: delete it, or name the output" in result.output


def test_links_that_the_user_names_are_followed(ram, tmp_path):
    (tmp_path / "link.npz").symlink_to(tmp_path / "target.npz")
    files.extract(ram, tmp_path / "link.npz")
    assert (tmp_path / "link.npz").is_symlink()
    assert (tmp_path / "target.npz").is_file()


def test_files_are_replaced_at_their_own_path(outside, tmp_path):
    (tmp_path / "x.json").symlink_to(outside / "profile")
    writing.write_text(tmp_path / "x.json", json.dumps({}), follow=False)
    assert (tmp_path / "x.json").read_text() == "{}"
    writing.new_folder(tmp_path / "folder" / "inner")
    (tmp_path / "folder" / "inner" / "left").touch()
    writing.new_folder(tmp_path / "folder" / "inner")
    assert not list((tmp_path / "folder" / "inner").iterdir())


@pytest.mark.parametrize(
    "make",
    [lambda path: path.symlink_to("/dev/null"), os.mkfifo, lambda path: path.symlink_to(path)],
)
def test_contents_of_work_folders(make, tmp_path):
    (tmp_path / "deep" / "deeper").mkdir(parents=True)
    check_contents(tmp_path, "work folder")
    make(tmp_path / "deep" / "deeper" / "entry")
    with pytest.raises(
        ValueError,
        match=r"a work folder must consist of .*deeper/entry is a (link|special file)",
    ):
        check_contents(tmp_path, "work folder")
    check_contents(tmp_path / "missing", "work folder")
