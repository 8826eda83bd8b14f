"""Datasets as pictures with boxes in COCO's and YOLO's formats."""

import dataclasses
import json

import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import datasets
from ocjax.datasets import detection
from ocjax.files.jobs import silent
from ocjax.transforms.segmentation import masks
from tests.support.command import run

pytest.importorskip("pyarrow")
pytestmark = pytest.mark.usefixtures("quick_compilation")
GAMES = "Pong", "Boxing"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    top = tmp_path_factory.mktemp("datasets")
    for name in GAMES:
        plan = datasets.plan(name, 24, policies={"repeat": 100})
        plan = dataclasses.replace(plan, shard_states=12, sequence_states=2)
        datasets.generate(plan, top / name)
    return [top / name for name in GAMES]


def objects_of(picture, game):
    """VEM's objects as lists of category, left, top, width and height."""
    with Image.open(picture) as image:
        rgb = np.asarray(image.convert("RGB"))
    records = ocjax.load(game).vem(rgb).to_list()
    return [(r["category"], r["x"], r["y"], r["w"], r["h"]) for r in records]


def pictures(folder, split):
    return sorted((folder / "images" / split).iterdir())


def test_coco(folders, tmp_path):
    done = run("export", *folders, "--out", f"coco:{tmp_path / 'all'}")
    assert done.exit_code == 0, done.output
    number = 0
    for split in ("train", "val"):
        content = json.loads((tmp_path / "all" / "annotations" / f"{split}.json").read_text())
        names = {c["id"]: c["name"] for c in content["categories"]}
        assert sorted(names) == list(range(1, len(names) + 1))
        assert set(names.values()) == {
            c.name for name in GAMES for c in ocjax.load(name).categories
        }
        files = [image["file_name"] for image in content["images"]]
        assert sorted(files) == [path.name for path in pictures(tmp_path / "all", split)]
        ids = [a["id"] for a in content["annotations"]]
        assert sorted(ids) == list(range(1, len(ids) + 1))
        for image in content["images"]:
            found = [
                (names[a["category_id"]], *a["bbox"])
                for a in content["annotations"]
                if a["image_id"] == image["id"]
            ]
            path = tmp_path / "all" / "images" / split / image["file_name"]
            assert found == objects_of(path, path.name.partition("-")[0])
            assert (image["width"], image["height"]) == (160, 210)
        number += len(files)
    assert number == 48


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools
def test_coco_in_pycocotools(folders, tmp_path):
    coco = pytest.importorskip("pycocotools.coco")
    datasets.export_boxes(folders, f"coco:{tmp_path / 'all'}")
    read = coco.COCO(tmp_path / "all" / "annotations" / "train.json")
    assert len(read.getImgIds()) == len(pictures(tmp_path / "all", "train"))
    for image in read.loadImgs(read.getImgIds()):
        path, name = tmp_path / "all" / "images" / "train" / image["file_name"], image["file_name"]
        game = ocjax.load(name.partition("-")[0])
        frame = np.asarray(Image.open(path).convert("RGB"))
        objects = game.vem(frame)
        wanted = np.asarray(masks(objects, frame))[np.asarray(objects.valid)]
        found = read.loadAnns(read.getAnnIds(image["id"]))
        np.testing.assert_array_equal([read.annToMask(a) for a in found], wanted)
        assert [a["area"] for a in found] == wanted.sum(axis=(1, 2)).tolist()


def test_yolo(folders, tmp_path):
    done = run("export", *folders, "--out", f"yolo:{tmp_path / 'all'}")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "all" / "data.yaml").read_text()
    names = dict(line.strip().split(": ") for line in text.split("names:\n")[1].splitlines())
    for split in ("train", "val"):
        assert f"{split}: images/{split}\n" in text
        for path in pictures(tmp_path / "all", split):
            label = tmp_path / "all" / "labels" / split / f"{path.stem}.txt"
            found = []
            for line in label.read_text().splitlines():
                number, *fractions = line.split()
                x, y, w, h = np.array(fractions, float) * (160, 210, 160, 210)
                box = np.rint([x - w / 2, y - h / 2, w, h]).astype(int).tolist()
                found.append((json.loads(names[number]), *box))
            assert found == objects_of(path, path.name.partition("-")[0])


def test_episodes_are_not_divided(folders):
    plans = [(folder, datasets.open_dataset(folder)) for folder in folders]
    splits = {}
    for folder, plan in plans:
        examples = detection._examples([(folder, plan)], silent, masks=False)
        for example, row in zip(examples, detection._rows(folder, plan, masks=False), strict=True):
            key = (plan.game, *(row[k] for k in ("seed", "policy", "instance", "episode")))
            assert splits.setdefault(key, example.split) == example.split
    assert set(splits.values()) == {"train", "val"}


@pytest.mark.parametrize(
    ("out", "message"),
    [
        ("csv:all", "the output must be coco:FOLDER or yolo:FOLDER, got csv:all"),
        ("coco:", "exists already"),
    ],
)
def test_wrong_outputs(folders, out, message):
    with pytest.raises((ValueError, OSError), match=message):
        datasets.export_boxes(folders, out)


def test_an_existing_folder_stays(folders, tmp_path):
    (tmp_path / "all").mkdir()
    (tmp_path / "all" / "mine").write_text("text")
    with pytest.raises(FileExistsError, match="all exists already: delete it, or name a new"):
        datasets.export_boxes(folders, f"yolo:{tmp_path / 'all'}")
    assert [p.name for p in tmp_path.rglob("*")] == ["all", "mine"]


def test_two_datasets_of_a_game(folders, tmp_path):
    with pytest.raises(ValueError, match="must have another game, got Pong, Boxing, Pong"):
        datasets.export_boxes([*folders, folders[0]], f"coco:{tmp_path / 'all'}")


def test_other_formats_take_one_dataset(folders, tmp_path):
    done = run("export", *folders, "--out", tmp_path / "all.csv")
    assert done.exit_code == 2
    assert "only coco:FOLDER and yolo:FOLDER take several datasets" in " ".join(done.output.split())


def test_an_interruption_leaves_nothing(folders, tmp_path, monkeypatch):
    monkeypatch.setattr(detection, "_write_picture", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        datasets.export_boxes(folders, f"coco:{tmp_path / 'all'}")
    assert list(tmp_path.iterdir()) == []
