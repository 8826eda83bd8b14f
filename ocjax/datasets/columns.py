"""The columns of a dataset: Arrow tables whose schema tells the library `datasets` which columns are pictures.

Objects are lists of records with the fields of `OBJECT`. A record's `orientation` and `value` are null where its category has none, and
the orientation is -1 where VEM cannot tell it.
"""

import dataclasses
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image

from ocjax._extras import require
from ocjax.datasets.plans import DatasetError
from ocjax.extraction import records
from ocjax.extraction.categories import ATTRIBUTES
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files.blocks import Block, compact
from ocjax.vision.unknown import UNKNOWN_VALUE

STATE = {
    "index": "int64",
    "seed": "int64",
    "policy": "string",
    "instance": "int32",
    "episode": "int32",
    "step": "int32",
}
STEP = {"action": "int32", "reward": "float64", "terminated": "bool", "truncated": "bool", "lives": "int32"}
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
FACTS = b"ocjax"  # what a shard says about itself: a key of its metadata


def schema(facts: Mapping[str, Any]) -> Any:
    """The schema of a shard.

    Args:
        facts: ready for JSON; see `facts_of`.
    """
    pa = require("pyarrow")
    record = pa.struct([(name, pa.type_for_alias(kind)) for name, kind in OBJECT.items()])
    types = {name: pa.type_for_alias(kind) for name, kind in STATE.items()}
    types |= dict.fromkeys(PICTURES, pa.struct([("bytes", pa.binary()), ("path", pa.string())]))
    types |= {"ram": pa.list_(pa.uint8(), 128)} | {name: pa.type_for_alias(kind) for name, kind in STEP.items()}
    types |= dict.fromkeys(OBJECTS, pa.list_(record))
    metadata = {b"huggingface": json.dumps({"info": {"features": _features()}}), FACTS: json.dumps(facts)}
    return pa.schema(list(types.items()), metadata=metadata)


def _features() -> dict[str, Any]:
    """The same types in the words of the library `datasets`."""
    numbers = {name: {"dtype": kind, "_type": "Value"} for name, kind in (STATE | STEP).items()}
    record = {name: {"dtype": kind, "_type": "Value"} for name, kind in OBJECT.items()}
    ram = {"feature": {"dtype": "uint8", "_type": "Value"}, "length": 128, "_type": "List"}
    objects = {"feature": record, "_type": "List"}
    out = {name: numbers[name] for name in STATE} | {name: {"_type": "Image"} for name in PICTURES} | {"ram": ram}
    return out | {name: numbers[name] for name in STEP} | dict.fromkeys(OBJECTS, objects)


def facts_of(stored: Any) -> dict[str, Any]:
    """What a shard says about itself: its `code`, `counts`, `played`, `left_out` and `sequences`.

    Raises:
        DatasetError: it is no shard of a dataset.
    """
    metadata = stored.metadata or {}
    if FACTS not in metadata:
        raise DatasetError("it is no file of a dataset of ocjax: its metadata lacks the key ocjax")
    return json.loads(metadata[FACTS])


def pictures(frames: np.ndarray, game: Game) -> Any:
    """Frames of palette indices uint8 `[n, H, 160]` as a column of PNG pictures, which have the same indices and the game's palette."""
    pa = require("pyarrow")
    table = np.asarray(game.palette).tobytes()
    return pa.StructArray.from_arrays(
        [pa.array([_png(f, table) for f in frames], pa.binary()), pa.nulls(len(frames), pa.string())], ["bytes", "path"]
    )


def _png(frame: np.ndarray, palette: bytes) -> bytes:
    image = Image.frombytes("P", frame.shape[::-1], np.ascontiguousarray(frame).data)
    image.putpalette(palette)
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return buffer.getvalue()


def frames(column: Any) -> np.ndarray:
    """The palette indices of a column of pictures, uint8 `[n, H, 160]`."""
    return np.stack([np.asarray(Image.open(io.BytesIO(picture["bytes"]))) for picture in column.to_pylist()])


def rams(column: Any) -> np.ndarray:
    """A column of RAM, uint8 `[n, 128]`."""
    return np.asarray(column.combine_chunks().flatten()).reshape(-1, 128)


def objects(found: Objects, game: Game, slots: np.ndarray) -> Any:
    """The valid objects of the slots as a column of lists of records.

    Args:
        found: batch shape `[n]`.
        game: whose objects they are.
        slots: bool `[N]`, the slots to list.
    """
    pa = require("pyarrow")
    n, block = len(found.valid), compact(found)
    listed = slots[block.slot]
    row, slot = block.row[listed], block.slot[listed]
    columns = {name: column[listed] for name, column in records.of_slots(block.slot, block, game).items()}
    columns["index"] = columns.pop("slot")
    columns["category"] = np.array([c.name for c in game.categories], object)[columns["category"]]
    known = {name: records.has(name, slot, game) & (columns[name] != UNKNOWN_VALUE) for name in ATTRIBUTES}
    unknown = {name: ~mask for name, mask in known.items()}
    arrays = [pa.array(columns[name], pa.type_for_alias(kind), mask=unknown.get(name)) for name, kind in OBJECT.items()]
    offsets = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    return pa.ListArray.from_arrays(offsets, pa.StructArray.from_arrays(arrays, list(OBJECT)))


def object_columns(rem: Objects, vem: Objects, game: Game) -> dict[str, Any]:
    """The columns of objects: `rem` without and `hud` with the display objects of REM, and `vem` with all of VEM."""
    is_hud = np.asarray(game.slot_hud)
    return {
        "rem": objects(rem, game, ~is_hud),
        "hud": objects(rem, game, is_hud),
        "vem": objects(vem, game, np.ones_like(is_hud)),
    }


def padded(lists: Sequence[Any], game: Game) -> dict[str, np.ndarray]:
    """The fields of `Objects` `[n, N, ...]` from columns of lists of records, the inverse of `objects`."""
    starts = {name: s.start for name, s in game.slices.items()}
    valued = {c.name for c in game.categories if "value" in c.attributes}
    blocks = []
    for column in lists:
        one = column.combine_chunks()
        row = np.repeat(np.arange(len(one)), np.diff(one.offsets))
        parts = dict(zip(OBJECT, one.flatten().flatten(), strict=True))
        names = parts["category"].to_pylist()
        slot = np.array([starts[name] for name in names], np.int64) + parts["index"].to_numpy()
        numbers = {name: parts[name].fill_null(0).to_numpy() for name in ("orientation", *"xywh", *"rgb")}
        value = np.where([name in valued for name in names], parts["value"].fill_null(UNKNOWN_VALUE).to_numpy(), 0)
        xywh, rgb = (np.stack([numbers[name] for name in names], axis=1) for names in ("xywh", "rgb"))
        blocks.append(Block(row, slot, xywh, numbers["orientation"], value, rgb))
    joined = Block(*(np.concatenate([getattr(b, f.name) for b in blocks]) for f in dataclasses.fields(Block)))
    return joined.padded(len(lists[0]), game)
