"""Files of objects, for n rows and the N slots of a game.

- `.npz`, `.h5` and `.hdf5`: the fields of `Objects` with all slots, `[n, N, ...]`, the category of
  each slot, `categories` `[N]`, and `hud` bool `[N]`.
- `.parquet`: a line per object with the columns row, category, index (within the category), x, y,
  w, h, orientation, value, r, g, b, hud.
- `.json`: COCO's detection format, with a picture `000000.png` per row, without the values. If the
  input has frames, annotations have the objects' pixels (`ocjax.segment`) as run lengths.
- `.txt`: MOT's format: frame and slot, counted from 1, left, top, width, height, confidence 1,
  category, counted from 1, visibility 1.
- `yolo:FOLDER`: YOLO's format: `data.yaml` with the names of the categories, and
  `labels/000000.txt` per row, or with the name of the row's picture. A line per object has the
  category, counted from 0, and the centre, width and height relative to the screen's size.

All formats except MOT's also name the game, the md5 of its ROM, the method and the version of
ocjax. Equal objects give equal bytes.

If rows have several dimensions, such as steps and environments, fields have them, too, and
`.parquet` has columns row_0, row_1, ... instead of row. The other formats count rows in C order. If
the episodes are known, `.npz`, HDF5 and `.parquet` files also have `episode` int32, the episode
number of each row.
"""

import dataclasses
import importlib.metadata
import io
import itertools
import json
import math
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np

from ocjax._extras import require
from ocjax.extraction import records
from ocjax.extraction.game import Game
from ocjax.extraction.records import FIELDS
from ocjax.files import run_lengths, writing
from ocjax.files.blocks import Block
from ocjax.files.inputs import MINARI
from ocjax.files.run_lengths import RunLengths

HDF5_CHUNK = 1024  # rows
YOLO = "yolo:"  # prefix of the name of a folder of labels


@dataclasses.dataclass(frozen=True)
class Blocks:
    """The files of all blocks of an extraction.

    Args:
        method: "rem" or "vem".
        batch: the dimensions of all rows.
        block_rows: rows of each block except the last.
        stem: the name of a row's picture, without its suffix.
        episodes: the number of rows of each episode, if known.
        has_masks: whether files of the objects' pixels are beside those of the blocks.
    """

    game: Game
    method: str
    batch: tuple[int, ...]
    block_rows: int
    paths: Sequence[Path]
    stem: Callable[[int], str]
    episodes: Sequence[int] = ()
    has_masks: bool = False

    @property
    def rows(self) -> int:
        """Number of rows in all blocks."""
        return math.prod(self.batch)

    @property
    def inner(self) -> int:
        """Number of rows per entry of the first dimension; blocks hold complete entries."""
        return math.prod(self.batch[1:])

    def __iter__(self) -> Iterator[tuple[int, int, Block]]:
        """Each block with its first row and its number of rows."""
        for k, path in enumerate(self.paths):
            first = k * self.block_rows
            count = min(self.block_rows, self.rows - first)
            yield first, count, Block.read(path, count, self.game)

    def masks(self) -> Iterator[list[int]]:
        """The run lengths of each object's mask in all blocks."""
        for path, (_, _, block) in zip(self.paths, self, strict=True):
            count, pixels = len(block.row), math.prod(self.game.screen)
            yield from RunLengths.read(masks_path(path), count, pixels)

    @property
    def episode(self) -> dict[str, np.ndarray]:
        """The episode of each row from 0, int32 `[*batch]`, by the key "episode".

        Empty if unknown.
        """
        numbers = np.repeat(np.arange(len(self.episodes), dtype=np.int32), self.episodes)
        return {"episode": numbers.reshape(self.batch)} if self.episodes else {}

    @property
    def facts(self) -> dict[str, str]:
        """The metadata in the files."""
        return {
            "game": self.game.name,
            "md5": self.game.md5,
            "method": self.method,
            "ocjax": importlib.metadata.version("ocjax"),
        }

    @property
    def slot_names(self) -> list[str]:
        """The category of each slot."""
        return [c.name for c in self.game.categories for _ in range(c.count)]


def _write_npz(blocks: Blocks, file: BinaryIO) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:

        def member(
            name: str, header: np.ndarray, shape: tuple[int, ...], parts: Iterator[np.ndarray]
        ) -> None:
            info = zipfile.ZipInfo(f"{name}.npy")  # no time: equal objects give equal bytes
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w", force_zip64=True) as out:
                description = np.lib.format.header_data_from_array_1_0(header) | {"shape": shape}
                np.lib.format.write_array_header_1_0(out, description)  # pyright: ignore
                for part in parts:
                    out.write(np.ascontiguousarray(part).data)

        for name, (dtype, tail) in FIELDS.items():
            padded = (block.padded(rows, blocks.game)[name] for _, rows, block in blocks)
            member(name, np.zeros(0, dtype), (*blocks.batch, blocks.game.num_slots, *tail), padded)
        single = {"categories": np.array(blocks.slot_names), "hud": blocks.game.slot_hud}
        for name, value in (
            single | blocks.episode | {k: np.array(v) for k, v in blocks.facts.items()}
        ).items():
            member(name, value, value.shape, iter([value]))


def _write_hdf5(blocks: Blocks, file: BinaryIO) -> None:
    with require("h5py").File(file, "w") as buffer:
        n = blocks.game.num_slots
        for name, (dtype, tail) in FIELDS.items():
            shape = (*blocks.batch, n, *tail)
            storage = {}
            if blocks.rows:
                entries = min(max(1, HDF5_CHUNK // blocks.inner), blocks.batch[0])
                storage = {
                    "chunks": (entries, *shape[1:]),
                    "compression": "gzip",
                    "compression_opts": 1,
                }
            buffer.create_dataset(name, shape, dtype, **storage)
        for first, rows, block in blocks:
            entries = slice(first // blocks.inner, (first + rows) // blocks.inner)
            for name, array in block.padded(rows, blocks.game).items():
                buffer[name][entries] = array.reshape(-1, *blocks.batch[1:], *array.shape[1:])
        for name, value in {
            "categories": blocks.slot_names,
            "hud": blocks.game.slot_hud,
            **blocks.episode,
        }.items():
            buffer[name] = value
        buffer.attrs.update(blocks.facts)


def _write_parquet(blocks: Blocks, file: BinaryIO) -> None:
    pa, parquet = require("pyarrow"), require("pyarrow.parquet")
    names = list(dict.fromkeys(blocks.slot_names))
    numbers = (
        {"index": pa.int32()}
        | dict.fromkeys("xywh", pa.int16())
        | {"orientation": pa.int8(), "value": pa.int32()}
        | dict.fromkeys("rgb", pa.uint8())
    )
    rows, episode = records.row_names(len(blocks.batch)), blocks.episode
    fields = [
        *((name, pa.int64()) for name in rows),
        *((name, pa.int32()) for name in episode),
        ("category", pa.dictionary(pa.int32(), pa.string())),
        *numbers.items(),
        ("hud", pa.bool_()),
    ]
    schema = pa.schema(fields, metadata=blocks.facts)
    with parquet.ParquetWriter(
        file, schema, compression="zstd", use_dictionary=["category"]
    ) as writer:
        for first, _, block in blocks:
            columns: dict[str, Any] = dict(
                zip(rows, np.unravel_index(block.row + first, blocks.batch), strict=True)
            )
            columns |= {
                name: numbers.ravel()[block.row + first] for name, numbers in episode.items()
            }
            columns |= records.of_slots(block.slot, block, blocks.game)
            columns["index"] = columns.pop("slot")
            columns["category"] = pa.DictionaryArray.from_arrays(
                columns["category"].astype(np.int32), names
            )
            arrays = [
                pa.array(columns[f.name], f.type) if f.name != "category" else columns[f.name]
                for f in schema
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def masks_path(block: Path) -> Path:
    """The file of the objects' pixels, beside the file of their block."""
    return block.with_suffix(".masks.npz")


def write_coco(blocks: Blocks, file: BinaryIO) -> None:
    """Write a .json file in COCO's format."""
    out = io.TextIOWrapper(file, "utf-8", write_through=True)
    height, width = blocks.game.screen
    categories = [
        {"id": i, "name": c.name, "supercategory": blocks.game.name}
        for i, c in enumerate(blocks.game.categories, 1)
    ]
    images = (
        {"id": i, "file_name": f"{i:06}.png", "width": width, "height": height}
        for i in range(blocks.rows)
    )
    head = f'{{"info": {json.dumps(blocks.facts)},\n"categories": {json.dumps(categories)},\n'
    out.write(head + '"images": [')
    _write_items(out, images)
    out.write('],\n"annotations": [')
    _write_items(out, _annotations(blocks))
    out.write("]}\n")
    out.detach()


def _write_items(out: TextIO, items: Iterable[dict[str, Any]]) -> None:
    """Write the items of a JSON array one by one."""
    for i, item in enumerate(items):
        out.write(",\n"[: 2 * (i > 0)] + json.dumps(item))


def _annotations(blocks: Blocks) -> Iterator[dict[str, Any]]:
    numbers = itertools.count(1)
    masks = blocks.masks() if blocks.has_masks else None
    for first, _, block in blocks:
        columns = (block.row + first, blocks.game.slot_category[block.slot] + 1, block.xywh)
        for row, category, box in zip(*(column.tolist() for column in columns), strict=True):
            yield {
                "id": next(numbers),
                "image_id": row,
                "category_id": category,
                "bbox": box,
                **_area(box, blocks.game, None if masks is None else next(masks)),
                "iscrowd": 0,
            }


def _area(box: list[int], game: Game, counts: list[int] | None) -> dict[str, Any]:
    """The area of an object in pixels, and its mask if its run lengths are known."""
    if counts is None:
        return {"area": box[2] * box[3]}
    return run_lengths.annotation(counts, game.screen)


def _write_mot(blocks: Blocks, file: BinaryIO) -> None:
    for first, _, block in blocks:
        ones = np.ones(len(block.row), np.int64)
        category = blocks.game.slot_category[block.slot] + 1
        columns = (block.row + first + 1, block.slot + 1, *block.xywh.T, ones, category, ones)
        np.savetxt(file, np.stack(columns, axis=1), "%d", ",")


def new_folder(name: str) -> Path:
    """The folder of an output such as "yolo:FOLDER", which must not exist."""
    path = Path(name.partition(":")[2])
    if path.exists():
        raise FileExistsError(f"{path} exists already: delete it, or name a new folder")
    writing.check(path)
    return path


def write_yolo(blocks: Blocks, folder: Path) -> None:
    """Write a new folder, completely or not at all."""
    facts = ", ".join(f"{name} {value}" for name, value in blocks.facts.items())
    names = yolo_names(c.name for c in blocks.game.categories)
    height, width = blocks.game.screen
    with writing.complete_folder(folder) as unfinished:
        (unfinished / "labels").mkdir()
        (unfinished / "data.yaml").write_text(
            f"# {facts}\ntrain: images\nval: images\n{names}", encoding="utf-8"
        )
        for first, rows, block in blocks:
            ends = np.searchsorted(block.row, np.arange(rows + 1))
            categories = blocks.game.slot_category[block.slot].tolist()
            lines = [
                yolo_line(category, box, (width, height))
                for category, box in zip(categories, block.xywh.tolist(), strict=True)
            ]
            for i in range(rows):
                path = unfinished / "labels" / f"{blocks.stem(first + i)}.txt"
                # fails if two pictures differ only in their suffixes
                with path.open("x", encoding="utf-8") as file:
                    file.writelines(lines[ends[i] : ends[i + 1]])


def yolo_names(names: Iterable[str]) -> str:
    """The names of the categories in YOLO's `data.yaml`."""
    return "names:\n" + "".join(f"  {i}: {json.dumps(name)}\n" for i, name in enumerate(names))


def yolo_line(category: int, box: Sequence[int], size: tuple[int, int]) -> str:
    """An object in YOLO's format, given its box (x, y, w, h) and the size (width, height)."""
    (x, y, w, h), (width, height) = box, size
    numbers = ((x + w / 2) / width, (y + h / 2) / height, w / width, h / height)
    return f"{category} {' '.join(f'{n:.6f}' for n in numbers)}\n"


Writer = Callable[[Blocks, BinaryIO], None]
WRITERS: Mapping[str, Writer] = {
    ".npz": _write_npz,
    ".h5": _write_hdf5,
    ".hdf5": _write_hdf5,
    ".parquet": _write_parquet,
    ".json": write_coco,
    ".txt": _write_mot,
}


def writer(path: Path) -> Writer:
    """The function that writes files with this suffix."""
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(
            f"the output must end in {', '.join(WRITERS)}, or be {YOLO}FOLDER, or {MINARI}ID for "
            f"a copy of a Minari dataset, got {path}"
        )
    for suffixes, module in (((".h5", ".hdf5"), "h5py"), ((".parquet",), "pyarrow")):
        if suffix in suffixes:
            require(module)  # before the work starts
    return WRITERS[suffix]
