"""The columns of a dataset as Arrow tables.

Objects are lists of records with the fields of `OBJECT`. `orientation` and `value` are null if the
category lacks them, and the orientation is -1 if VEM cannot determine it. `terrain` is a picture of
the numbers of kinds. The schema marks the columns of pictures for the library `datasets`.
"""

import dataclasses
import io
import json
import reprlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image

from ocjax._extras import require
from ocjax._xla import batches
from ocjax.datasets.plans import MOST_STATES, DatasetError
from ocjax.emulators.checks import integer
from ocjax.extraction import records
from ocjax.extraction.categories import ATTRIBUTES
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files.blocks import Block, compact
from ocjax.transforms.drawing import terrain_colors
from ocjax.vision.unknown import UNKNOWN_VALUE

STATE = {
    "index": "int64",
    "seed": "int64",
    "policy": "string",
    "instance": "int32",
    "episode": "int32",
    "step": "int32",
}
STEP = {
    "action": "int32",
    "reward": "float64",
    "terminated": "bool",
    "truncated": "bool",
    "lives": "int32",
}
OBJECT = {
    "category": "string",
    "index": "int32",
    **dict.fromkeys("xywh", "int16"),
    "orientation": "int8",
    "value": "int32",
    **dict.fromkeys("rgb", "uint8"),
    "hud": "bool",
}
PICTURES, OBJECTS = ("image", "previous"), ("rem", "hud", "vem")
TERRAIN = "terrain"  # null in games without terrain
LABELS = (*OBJECTS, TERRAIN)  # columns that `relabel` replaces
PICTURE_FIELDS = ("bytes", "path")
TERRAIN_CHUNK = 64  # states whose masks are made at a time
FACTS = b"ocjax"  # the metadata key of a shard's facts


def schema(facts: Mapping[str, Any]) -> Any:
    """The schema of a shard with facts, ready for JSON; see `facts_of`."""
    pa = require("pyarrow")
    record = pa.struct([(name, pa.type_for_alias(kind)) for name, kind in OBJECT.items()])
    types = {name: pa.type_for_alias(kind) for name, kind in STATE.items()}
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    types |= dict.fromkeys(PICTURES, picture)
    types |= {"ram": pa.list_(pa.uint8(), 128)} | {
        name: pa.type_for_alias(kind) for name, kind in STEP.items()
    }
    types |= dict.fromkeys(OBJECTS, pa.list_(record)) | {TERRAIN: picture}
    metadata = {
        b"huggingface": json.dumps({"info": {"features": _features()}}),
        FACTS: json.dumps(facts),
    }
    return pa.schema(list(types.items()), metadata=metadata)


def _features() -> dict[str, Any]:
    """The same types in the format of the library `datasets`."""
    numbers = {name: {"dtype": kind, "_type": "Value"} for name, kind in (STATE | STEP).items()}
    record = {name: {"dtype": kind, "_type": "Value"} for name, kind in OBJECT.items()}
    ram = {"feature": {"dtype": "uint8", "_type": "Value"}, "length": 128, "_type": "List"}
    objects = {"feature": record, "_type": "List"}
    picture = {"_type": "Image"}
    return {
        **{name: numbers[name] for name in STATE},
        **dict.fromkeys(PICTURES, picture),
        "ram": ram,
        **{name: numbers[name] for name in STEP},
        **dict.fromkeys(OBJECTS, objects),
        TERRAIN: picture,
    }


def facts_of(stored: Any) -> dict[str, Any]:
    """Read the facts of a shard from its `pyarrow.parquet.FileMetaData`.

    The facts are `code`, `counts`, `states`, `sequences`, `states_left_out` and
    `sequences_left_out`.
    """
    metadata = stored.metadata or {}
    if FACTS not in metadata:
        raise DatasetError("it is no file of a dataset of ocjax: its metadata lacks the key ocjax")
    try:
        facts = json.loads(metadata[FACTS])
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"its metadata are damaged: {error}") from error
    if (
        not isinstance(facts, dict)
        or not isinstance(facts.get("code"), str)
        or not isinstance(facts.get("counts"), dict)
    ):
        raise DatasetError(
            f"its metadata must have a text code and an object counts, got {reprlib.repr(facts)}"
        )
    for name in ("states", "sequences"):
        total = integer(f"{name} in its metadata", facts.get(name), 0, MOST_STATES)
        integer(f"{name}_left_out in its metadata", facts.get(f"{name}_left_out"), 0, total)
    if stored.num_rows != facts["states"] - facts["states_left_out"]:
        raise DatasetError(
            f"it has {stored.num_rows:,} rows, but its metadata claim "
            f"{facts['states'] - facts['states_left_out']:,}"
        )
    return facts


def checked(table: Any, names: Sequence[str] | None = None) -> Any:
    """Check columns of a table, by default all, and cast them to the types of `schema`."""
    pa, known = require("pyarrow"), schema({})
    fields = [known.field(name) for name in names or known.names]
    columns = []
    for field in fields:
        places = table.schema.get_all_field_indices(field.name)
        if len(places) != 1:
            remedy = ": relabel the dataset" if field.name in LABELS else ""
            raise DatasetError(
                f"it must have one column {field.name}, and has {len(places)}{remedy}"
            )
        try:
            column = table.column(places[0]).cast(field.type)
            column.validate(full=True)
        except Exception as error:  # Arrow's errors have many types
            raise DatasetError(f"its column {field.name} must be {field.type}: {error}") from error
        if any(part.null_count for part in _parts(column.combine_chunks(), field.name)):
            raise DatasetError(f"its column {field.name} has missing values")
        columns.append(column)
    return pa.table(columns, pa.schema(fields))


def _parts(column: Any, name: str) -> list[Any]:
    if name in PICTURES:
        return [column, column.field("bytes")]
    if name == TERRAIN:  # null in games without terrain
        return [column, column.field("bytes")] if column.null_count < len(column) else []
    if name == "ram":
        return [column, column.flatten()]
    if name in OBJECTS:
        records = column.flatten()
        return [
            column,
            records,
            *(
                part
                for part, field in zip(records.flatten(), OBJECT, strict=True)
                if field not in ATTRIBUTES
            ),
        ]
    return [column]


def pictures(frames: np.ndarray, game: Game) -> Any:
    """Encode frames of palette indices, uint8 `[n, H, 160]`, as a column of PNG pictures.

    The pictures have the same indices and the game's palette.
    """
    return _pictures(frames, np.asarray(game.palette))


def terrain(rams: np.ndarray, game: Game) -> Any:
    """Draw the terrain of states, uint8 `[n, 128]`, as a column of PNG pictures.

    A pixel has the number of its kind in `game.terrain`, counted from 1, or 0. The last of
    overlapping kinds counts. All entries are null if the game has no terrain.
    """
    pa = require("pyarrow")
    if game.terrain is None:
        return pa.nulls(len(rams), schema({}).field(TERRAIN).type)
    kind = np.arange(1, len(game.terrain) + 1, dtype=np.uint8)[:, None, None]
    maps = batches.by_chunks(
        lambda part: (np.asarray(game.terrain_of(part).masks) * kind).max(axis=1),
        rams,
        TERRAIN_CHUNK,
    )
    colors = np.zeros((256, 3), np.uint8)
    colors[1 : len(game.terrain) + 1] = list(terrain_colors(game).values())
    return _pictures(maps, colors)


def _pictures(frames: np.ndarray, palette: np.ndarray) -> Any:
    pa = require("pyarrow")
    table = palette.tobytes()
    pictures = pa.array([_png(f, table) for f in frames], pa.binary())
    return pa.StructArray.from_arrays(
        [pictures, pa.nulls(len(frames), pa.string())], list(PICTURE_FIELDS)
    )


def _png(frame: np.ndarray, palette: bytes) -> bytes:
    image = Image.frombytes("P", frame.shape[::-1], np.ascontiguousarray(frame).data)
    image.putpalette(palette)
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return buffer.getvalue()


def frames(column: Any, game: Game) -> np.ndarray:
    """Decode a column of pictures to palette indices, uint8 `[n, H, 160]`."""
    return np.stack(
        [_indices(picture["bytes"], game, i) for i, picture in enumerate(column.to_pylist())]
    )


def _indices(data: bytes, game: Game, row: int) -> np.ndarray:
    height, width = game.screen
    try:
        image = Image.open(io.BytesIO(data), formats=("PNG",))
        if image.size != (width, height) or image.mode != "P":  # before it is decoded
            raise ValueError(
                f"it must have palette indices, {width} x {height}, got {image.mode}, "
                f"{image.width} x {image.height}"
            )
        return np.asarray(image)
    except Exception as error:  # a damaged picture can fail anywhere in Pillow
        raise DatasetError(f"the picture of row {row} cannot be read: {error}") from error


def rams(column: Any) -> np.ndarray:
    """Convert a column of RAM to uint8 `[n, 128]`."""
    return np.asarray(column.combine_chunks().flatten()).reshape(-1, 128)


def objects(found: Objects, game: Game, slots: np.ndarray) -> Any:
    """List the valid objects of some slots in a column of lists of records.

    Args:
        found: the objects, batch shape `[n]`.
        slots: bool `[N]`, the slots to list.
    """
    pa = require("pyarrow")
    n, block = len(found.valid), compact(found)
    listed = slots[block.slot]
    row, slot = block.row[listed], block.slot[listed]
    columns = {
        name: column[listed] for name, column in records.of_slots(block.slot, block, game).items()
    }
    columns["index"] = columns.pop("slot")
    columns["category"] = np.array([c.name for c in game.categories], object)[columns["category"]]
    known = {
        name: records.has(name, slot, game) & (columns[name] != UNKNOWN_VALUE)
        for name in ATTRIBUTES
    }
    unknown = {name: ~mask for name, mask in known.items()}
    arrays = [
        pa.array(columns[name], pa.type_for_alias(kind), mask=unknown.get(name))
        for name, kind in OBJECT.items()
    ]
    offsets = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    return pa.ListArray.from_arrays(offsets, pa.StructArray.from_arrays(arrays, list(OBJECT)))


def object_columns(rem: Objects, vem: Objects, game: Game) -> dict[str, Any]:
    """The columns of objects: REM's in play and in the display, and all of VEM's."""
    is_hud = np.asarray(game.slot_hud)
    return {
        "rem": objects(rem, game, ~is_hud),
        "hud": objects(rem, game, is_hud),
        "vem": objects(vem, game, np.ones_like(is_hud)),
    }


def padded(lists: Sequence[Any], game: Game) -> dict[str, np.ndarray]:
    """Convert columns of lists of records to fields of `Objects`, `[n, N, ...]`; see `objects`."""
    slices = dict(game.slices)
    valued = {c.name for c in game.categories if "value" in c.attributes}
    blocks = []
    for column in lists:
        one = column.combine_chunks()
        row = np.repeat(np.arange(len(one)), np.diff(one.offsets))
        parts = dict(zip(OBJECT, one.flatten().flatten(), strict=True))
        names = parts["category"].to_pylist()
        index = parts["index"].to_numpy()
        for name, i in set(zip(names, index.tolist(), strict=True)):
            if name not in slices or not 0 <= i < slices[name].stop - slices[name].start:
                raise DatasetError(
                    f"{game.name} has no object {reprlib.repr(name)} {i}: `ocjax relabel` writes "
                    "the objects of its decoder"
                )
        slot = np.array([slices[name].start for name in names], np.int64) + index
        numbers = {
            name: parts[name].fill_null(0).to_numpy() for name in ("orientation", *"xywh", *"rgb")
        }
        value = np.where(
            [name in valued for name in names],
            parts["value"].fill_null(UNKNOWN_VALUE).to_numpy(),
            0,
        )
        xywh, rgb = (
            np.stack([numbers[name] for name in names], axis=1) for names in ("xywh", "rgb")
        )
        blocks.append(Block(row, slot, xywh, numbers["orientation"], value, rgb))
    joined = Block(
        *(np.concatenate([getattr(b, f.name) for b in blocks]) for f in dataclasses.fields(Block))
    )
    return joined.padded(len(lists[0]), game)
