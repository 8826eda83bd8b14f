"""Forms of objects, which the methods of `Objects` return."""

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ocjax._extras import require
from ocjax.console.compass import POINTS
from ocjax.extraction.declaration import Declaration
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

__all__ = [
    "FIELDS",
    "Fields",
    "arrow",
    "atoms",
    "by_category",
    "columns",
    "constant",
    "frame",
    "has",
    "no_objects",
    "of_slots",
    "of_state",
    "per_state",
    "row_names",
    "text",
]


# Fields of `Objects`: dtype, and shape after [..., N].
FIELDS: Mapping[str, tuple[type[np.generic], tuple[int, ...]]] = {
    "xywh": (np.int16, (4,)),
    "valid": (np.bool_, ()),
    "orientation": (np.int8, ()),
    "value": (np.int32, ()),
    "rgb": (np.uint8, (3,)),
}


class Fields(NamedTuple):
    """The fields of `Objects` as NumPy arrays."""

    xywh: np.ndarray
    valid: np.ndarray
    orientation: np.ndarray
    value: np.ndarray
    rgb: np.ndarray


def no_objects(batch: tuple[int, ...], num_slots: int) -> dict[str, np.ndarray]:
    """Return the fields of a batch of states without valid slots, `[*batch, num_slots, ...]`."""
    return {
        name: np.zeros((*batch, num_slots, *tail), dtype) for name, (dtype, tail) in FIELDS.items()
    }


def of_state(fields: Fields, game: Declaration) -> list[dict[str, Any]]:
    """Return the records of one state, in the order of the slots; see `Objects.to_list`."""
    out, unknown = [], {"orientation": UNKNOWN, "value": UNKNOWN_VALUE}
    for slot in np.flatnonzero(fields.valid):
        category = game.categories[game.slot_category[slot]]
        x, y, w, h = fields.xywh[slot].tolist()
        record = {
            "category": category.name,
            "slot": int(slot) - game.slices[category.name].start,
            "x": x,
            "y": y,
            "w": w,
            "h": h,
            "rgb": tuple(fields.rgb[slot].tolist()),
            "hud": category.hud,
        }
        record |= {
            k: v for k in category.attributes if (v := int(getattr(fields, k)[slot])) != unknown[k]
        }
        out.append(record)
    return out


def per_state(
    convert: Callable[[list[dict[str, Any]]], Any], fields: Fields, game: Declaration
) -> Any:
    """Convert the records of each state; nested lists for a batch."""
    if fields.valid.ndim == 1:
        return convert(of_state(fields, game))
    return [per_state(convert, Fields(*state), game) for state in zip(*fields, strict=True)]


def by_category(records: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Group the records of one state by category."""
    out: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        out.setdefault(record["category"], []).append(
            {k: v for k, v in record.items() if k != "category"}
        )
    return out


def text(records: list[dict[str, Any]]) -> str:
    """Describe each object of a state in one line."""
    lines = []
    for r in records:
        line = f"{r['category']} {r['slot']}: {r['w']} x {r['h']} at ({r['x']}, {r['y']})"
        line += f", value {r['value']}" if "value" in r else ""
        lines.append(line + (f", facing {POINTS[r['orientation']]}" if "orientation" in r else ""))
    return "\n".join(lines)


def constant(name: str) -> str:
    """Convert `PlayerScore` to `player_score`, a constant of logic programs."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def atoms(records: list[dict[str, Any]]) -> list[str]:
    """Return ground atoms of the objects of one state; see `Objects.to_logic`."""
    out = []
    for r in records:
        category = constant(r["category"])
        name = f"{category}_{r['slot']}"
        out += [
            f"type({name},{category})",
            f"at({name},{r['x']},{r['y']})",
            f"size({name},{r['w']},{r['h']})",
            f"rgb({name},{','.join(map(str, r['rgb']))})",
        ]
        out += [f"{p}({name},{r[p]})" for p in ("value", "orientation") if p in r]
        out += [f"hud({name})"] if r["hud"] else []
    return out


def columns(
    fields: Fields, game: Declaration
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the valid objects as columns of a table, in the order of the states and slots.

    Returns:
        The columns by name, with `category` as an index into `game.categories`, and by column a
        bool mask of its missing values.
    """
    *batch, slot = np.nonzero(fields.valid)
    out = dict(zip(row_names(len(batch)), batch, strict=True))
    out |= of_slots(slot, Fields(*(array[fields.valid] for array in fields)), game)
    unknown = {"value": UNKNOWN_VALUE, "orientation": UNKNOWN}
    return out, {
        name: ~has(name, slot, game) | (out[name] == constant) for name, constant in unknown.items()
    }


def row_names(dimensions: int) -> list[str]:
    """Return the names of the columns that identify the state, one per batch dimension."""
    return ["row"] if dimensions == 1 else [f"row_{i}" for i in range(dimensions)]


def of_slots(slot: np.ndarray, objects: Any, game: Declaration) -> dict[str, np.ndarray]:
    """Return objects as columns of a table.

    Args:
        slot: of each object in the game, int `[m]`.
        objects: with the attributes xywh `[m, 4]`, orientation `[m]`, value `[m]` and rgb `[m, 3]`.

    Returns:
        The columns by name; `category`, an index into `game.categories`, and `slot` within it are
        int16.
    """
    category, first = game.slot_category[slot], np.array([s.start for s in game.slices.values()])
    out = {"category": category.astype(np.int16), "slot": (slot - first[category]).astype(np.int16)}
    out |= dict(zip("xywh", objects.xywh.T, strict=True)) | dict(
        zip("rgb", objects.rgb.T, strict=True)
    )
    return out | {
        "hud": game.slot_hud[slot],
        "value": objects.value,
        "orientation": objects.orientation,
    }


def has(attribute: str, slot: np.ndarray, game: Declaration) -> np.ndarray:
    """Return whether the categories of slots declare an attribute, bool `[m]`."""
    return np.array([attribute in c.attributes for c in game.categories])[game.slot_category[slot]]


def frame(fields: Fields, game: Declaration) -> Any:
    """Return a pandas data frame of the valid objects; see `Objects.to_frame`."""
    pd = require("pandas")
    table, missing = columns(fields, game)
    names = pd.CategoricalDtype([c.name for c in game.categories])
    out = {
        name: pd.arrays.IntegerArray(a, missing[name]) if name in missing else a
        for name, a in table.items()
    }
    return pd.DataFrame(
        out | {"category": pd.Categorical.from_codes(table["category"], dtype=names)}, copy=False
    )


def arrow(fields: Fields, game: Declaration) -> Any:
    """Return a pyarrow table of the valid objects; see `Objects.to_arrow`."""
    pa = require("pyarrow")
    table, missing = columns(fields, game)
    names = pa.array([c.name for c in game.categories])
    out = {name: pa.array(a, mask=missing.get(name)) for name, a in table.items()}
    return pa.table(
        out | {"category": pa.DictionaryArray.from_arrays(pa.array(table["category"]), names)}
    )
