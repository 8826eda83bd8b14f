"""Export datasets as pictures with boxes, for training object detectors."""

import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ocjax.datasets import columns, shards
from ocjax.datasets.generation import open_dataset
from ocjax.datasets.plans import Plan
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files import outputs, run_lengths, writing
from ocjax.files.jobs import Report, silent
from ocjax.files.outputs import YOLO

COCO = "coco:"  # before the folder of an export
TRAINING, VALIDATION = "train", "val"
EPISODES = 10  # every tenth episode of a game is for validation
COLUMNS = ("index", "seed", "policy", "instance", "episode", "image", "vem")


class Example(NamedTuple):
    """A picture and the objects that it shows."""

    split: str
    name: str  # of the picture
    png: bytes
    size: tuple[int, int]  # width and height in pixels
    objects: Sequence[dict[str, Any]]
    masks: Sequence[list[int]] | None  # the run lengths of each object's mask


def export_boxes(folders: Sequence[str | Path], out: str, *, report: Report = silent) -> None:
    """Export datasets of any games to one new folder in COCO's or YOLO's format.

    The boxes are those of VEM, the objects on the picture. Categories with the same name are one
    category. Every tenth episode of a dataset is for validation, beginning with the second. COCO's
    folder has `images/train`, `images/val` and `annotations/train.json`, `annotations/val.json`,
    with the mask of each object as run lengths; YOLO's has `labels/` instead, and `data.yaml`.

    Args:
        folders: folders of complete datasets.
        out: a new folder after "coco:" or "yolo:".
        report: called regularly with the numbers of finished and of all states.

    Raises:
        DatasetError: a ValueError; a folder holds no complete dataset.
        FileExistsError: the output exists.
        ValueError: the format is not supported, or two datasets have the same game.
        OSError: a file cannot be written.
    """
    plans = [(Path(folder), open_dataset(folder)) for folder in folders]
    games = [plan.game for _, plan in plans]
    if len(set(games)) < len(games):
        raise ValueError(f"each dataset must have another game, got {', '.join(games)}")
    if not out.startswith((COCO, YOLO)):
        raise ValueError(f"the output must be {COCO}FOLDER or {YOLO}FOLDER, got {out}")
    path = outputs.new_folder(out)
    known = dict.fromkeys(c.name for game in games for c in registry.load(game).categories)
    names = {name: number for number, name in enumerate(known)}
    masks = out.startswith(COCO)
    write = _write_coco if masks else _write_yolo
    with writing.complete_folder(path) as unfinished:
        write(unfinished, names, _examples(plans, report, masks=masks))


def _examples(
    plans: Sequence[tuple[Path, Plan]], report: Report, *, masks: bool
) -> Iterator[Example]:
    total, done = sum(plan.states for _, plan in plans), 0
    for folder, plan in plans:
        height, width = registry.load(plan.game).screen
        episodes: dict[tuple[Any, ...], int] = {}
        for row in _rows(folder, plan, masks=masks):
            episode = tuple(row[name] for name in ("seed", "policy", "instance", "episode"))
            number = episodes.setdefault(episode, len(episodes))
            split = VALIDATION if number % EPISODES == 1 else TRAINING
            name = f"{plan.game}-{row['index']:07}.png"
            picture = row["image"]["bytes"]
            yield Example(split, name, picture, (width, height), row["vem"], row["masks"])
            done += 1
            report(done, total)


def _rows(folder: Path, plan: Plan, *, masks: bool) -> Iterator[dict[str, Any]]:
    game = registry.load(plan.game)
    for shard in plan.shards:
        path = folder / plan.file(shard)
        for table in shards.rows(path, COLUMNS):
            with shards.reading(path):
                frames = columns.frames(table["image"], game)
                found = _masks(table["vem"], frames, game) if masks else [None] * len(frames)
            for row, own in zip(table.to_pylist(), found, strict=True):
                yield row | {"masks": own}


def _masks(lists: Any, frames: np.ndarray, game: Game) -> list[list[list[int]]]:
    """The run lengths of each object's mask, in the order of the lists."""
    fields: dict[str, Any] = columns.padded([lists], game)
    masks = iter(run_lengths.of_objects(Objects(**fields, game=game), frames))
    out = []
    for listed in lists.to_pylist():
        slots = [game.slices[o["category"]].start + o["index"] for o in listed]
        by_slot = {slot: next(masks) for slot in sorted(set(slots))}
        out.append([by_slot[slot] for slot in slots])
    return out


def _write_picture(folder: Path, example: Example) -> None:
    (folder / "images" / example.split / example.name).write_bytes(example.png)


def _make_folders(folder: Path, *kinds: str) -> None:
    for kind, split in itertools.product(kinds, (TRAINING, VALIDATION)):
        (folder / kind / split).mkdir(parents=True)


def _write_coco(folder: Path, names: dict[str, int], examples: Iterator[Example]) -> None:
    _make_folders(folder, "images")
    pictures: dict[str, list[dict[str, Any]]] = {TRAINING: [], VALIDATION: []}
    boxes: dict[str, list[dict[str, Any]]] = {TRAINING: [], VALIDATION: []}
    for example in examples:
        _write_picture(folder, example)
        number = len(pictures[example.split]) + 1
        width, height = example.size
        pictures[example.split].append(
            {"id": number, "file_name": example.name, "width": width, "height": height}
        )
        assert example.masks is not None
        for o, counts in zip(example.objects, example.masks, strict=True):
            boxes[example.split].append(
                {
                    "id": len(boxes[example.split]) + 1,
                    "image_id": number,
                    "category_id": names[o["category"]] + 1,
                    "bbox": [o["x"], o["y"], o["w"], o["h"]],
                    **run_lengths.annotation(counts, (height, width)),
                    "iscrowd": 0,
                }
            )
    categories = [{"id": number + 1, "name": name} for name, number in names.items()]
    (folder / "annotations").mkdir()
    for split, images in pictures.items():
        content = {"categories": categories, "images": images, "annotations": boxes[split]}
        (folder / "annotations" / f"{split}.json").write_text(json.dumps(content), "utf-8")


def _write_yolo(folder: Path, names: dict[str, int], examples: Iterator[Example]) -> None:
    _make_folders(folder, "images", "labels")
    sets = f"train: images/{TRAINING}\nval: images/{VALIDATION}\n"
    (folder / "data.yaml").write_text(sets + outputs.yolo_names(names), "utf-8")
    for example in examples:
        _write_picture(folder, example)
        lines = (
            outputs.yolo_line(names[o["category"]], [o[side] for side in "xywh"], example.size)
            for o in example.objects
        )
        label = folder / "labels" / example.split / Path(example.name).with_suffix(".txt")
        label.write_text("".join(lines), "utf-8")
