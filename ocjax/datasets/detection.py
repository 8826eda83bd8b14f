"""Export datasets as pictures with boxes, for training object detectors."""

import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla import batches
from ocjax.datasets import columns, shards
from ocjax.datasets.generation import open_dataset
from ocjax.datasets.plans import Plan
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files import outputs, writing
from ocjax.files.jobs import Report, silent
from ocjax.files.outputs import YOLO
from ocjax.transforms.segmentation import NOBODY, segment

COCO = "coco:"  # before the folder of an export
TRAINING, VALIDATION = "train", "val"
EPISODES = 10  # every tenth episode of a game is for validation
CHUNK = 64  # frames whose owners are computed at a time
COLUMNS = ("index", "seed", "policy", "instance", "episode", "image", "vem")


class Example(NamedTuple):
    """A picture and the objects that it shows."""

    split: str
    name: str  # of the picture
    png: bytes
    size: tuple[int, int]  # width and height in pixels
    objects: Sequence[dict[str, Any]]
    # int16 [height, width], the object's number in `objects` that owns each pixel, or -1; None
    # without masks
    owners: np.ndarray | None


def export_boxes(folders: Sequence[str | Path], out: str, *, report: Report = silent) -> None:
    """Export datasets of any games to one new folder in COCO's or YOLO's format.

    The boxes are VEM's. Categories with the same name are one category. Every tenth episode of a
    dataset, from the second, is for validation. COCO's folder has `images/train`, `images/val` and
    `annotations/train.json`, `annotations/val.json`, with objects' masks as run lengths; YOLO's has
    `labels/` instead, and `data.yaml`.

    Args:
        folders: folders of complete datasets.
        out: a new folder after "coco:" or "yolo:".
        report: called with the numbers of finished and of all states.

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
            yield Example(split, name, picture, (width, height), row["vem"], row["owners"])
            done += 1
            report(done, total)


def _rows(folder: Path, plan: Plan, *, masks: bool) -> Iterator[dict[str, Any]]:
    game = registry.load(plan.game)
    for shard in plan.shards:
        path = folder / plan.file(shard)
        for table in shards.rows(path, COLUMNS):
            with shards.reading(path):
                frames = columns.frames(table["image"], game)
                owners = _owners(table["vem"], frames, game) if masks else [None] * len(frames)
            for row, own in zip(table.to_pylist(), owners, strict=True):
                yield row | {"owners": own}


def _owners(lists: Any, frames: np.ndarray, game: Game) -> list[np.ndarray]:
    fields = {name: jnp.asarray(a) for name, a in columns.padded([lists], game).items()}
    objects = Objects(**fields, game=game)

    def owners(index: np.ndarray) -> jax.Array:
        chosen = jax.tree.map(lambda field: field[index], objects)
        return segment(chosen, frames[index])

    slots = batches.by_chunks(owners, np.arange(len(frames)), CHUNK)
    return [_numbers(own, row.as_py(), game) for own, row in zip(slots, lists, strict=True)]


def _numbers(slots: np.ndarray, objects: Sequence[dict[str, Any]], game: Game) -> np.ndarray:
    number_of = np.full(game.num_slots + 1, NOBODY, np.int16)
    for number, o in enumerate(objects):
        number_of[game.slices[o["category"]].start + o["index"]] = number
    return number_of[slots]


def _run_lengths(mask: np.ndarray) -> list[int]:
    """COCO's run lengths of a mask, bool `[height, width]`, column by column from a run of 0."""
    bits = np.concatenate([[False], mask.T.ravel(), [not mask[-1, -1]]])
    ends = np.flatnonzero(bits[1:] != bits[:-1])
    return np.diff(ends, prepend=0).tolist()


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
        assert example.owners is not None
        for i, o in enumerate(example.objects):
            mask = example.owners == i
            boxes[example.split].append(
                {
                    "id": len(boxes[example.split]) + 1,
                    "image_id": number,
                    "category_id": names[o["category"]] + 1,
                    "bbox": [o["x"], o["y"], o["w"], o["h"]],
                    "area": int(mask.sum()),
                    "segmentation": {"size": [height, width], "counts": _run_lengths(mask)},
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
