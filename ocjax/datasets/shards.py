"""The shards of a dataset: Parquet files that are made or relabelled separately."""

import contextlib
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._extras import require
from ocjax.datasets import columns, labels, playing
from ocjax.datasets.labels import Labels
from ocjax.datasets.plans import DatasetError, Plan, Shard, code
from ocjax.evaluation.metrics import Agreement
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing

ROW_GROUP = 500  # rows
ROW_BYTES = 2**18  # limit per row; two pictures have less than a quarter of it
BATCH = 1000  # rows labelled at a time


def make(folder: Path, plan: Plan, number: int) -> None:
    """Play and label a shard and write its file, unless it exists."""
    game, shard = registry.load(plan.game), plan.shards[number]
    path = folder / plan.file(shard)
    if path.is_file():
        return
    pa = require("pyarrow")
    # tables by instance
    kept: list[list[Any]] = [
        [columns.schema({}).empty_table()],
        *([] for _ in shard.shares),
    ]
    counts: list[Agreement] = []  # of the kept sequences
    totals = dict.fromkeys(("sequences", "sequences_left_out", "states_left_out"), 0)
    for sequences in playing.play(game, plan, shard):
        joined = {name: np.concatenate([s[name] for s in sequences]) for name in sequences[0]}
        found = labels.label(game, joined["ram"], joined["screen"], joined["previous"])
        table = _table(game, plan, shard, joined, found)
        ends = np.cumsum([0, *(len(s["index"]) for s in sequences)]).tolist()
        for tables, (start, stop) in zip(kept[1:], itertools.pairwise(ends), strict=True):
            own = found.counts.map(lambda a, rows=slice(start, stop): a[rows])
            # F1 is nan without objects; such sequences stay
            is_left_out = bool(own.sum().f1 < plan.least_f1)
            if not is_left_out:
                tables.append(table.slice(start, stop - start))
                counts.append(own)
            totals["sequences"] += stop > start
            totals["sequences_left_out"] += is_left_out
            totals["states_left_out"] += is_left_out * (stop - start)
    facts = {
        "code": plan.code,
        "states": shard.states,
        **totals,
        "counts": labels.to_counts(counts, game),
    }
    _write(path, pa.concat_tables(itertools.chain.from_iterable(kept)), game, facts)


def _table(game: Game, plan: Plan, shard: Shard, states: playing.Stretch, found: Labels) -> Any:
    pa = require("pyarrow")
    names = np.repeat(
        np.array([name for name, _ in plan.policies], object), [n for _, n in plan.policies]
    )
    n = len(states["index"])
    arrays = {
        **{name: states[name] for name in ("index", "instance", "episode", "step", *columns.STEP)},
        "seed": np.full(n, shard.seed, np.int64),
        "policy": names[states["instance"]],
        "image": columns.pictures(states["screen"], game),
        "previous": columns.pictures(states["previous"], game),
        "ram": pa.FixedSizeListArray.from_arrays(pa.array(states["ram"].ravel()), 128),
        **columns.object_columns(found.rem, found.vem, game),
        columns.TERRAIN: columns.terrain(states["ram"], game),
    }
    schema = columns.schema({})
    return pa.table(
        [
            arrays[name]
            if isinstance(arrays[name], pa.Array)
            else pa.array(arrays[name], schema.field(name).type)
            for name in schema.names
        ],
        schema,
    )


def _write(path: Path, table: Any, game: Game, facts: dict[str, Any]) -> None:
    """Write a shard. Equal tables and facts give equal bytes.

    The metadata name the game, in the format of `ocjax.files.open_input`.
    """
    parquet = require("pyarrow.parquet")
    metadata = {
        b"game": game.name.encode(),
        b"md5": game.md5.encode(),
        **columns.schema(facts).metadata,
    }
    table = table.combine_chunks().replace_schema_metadata(metadata)
    writing.write(
        path,
        lambda file: parquet.write_table(table, file, row_group_size=ROW_GROUP, compression="zstd"),
        follow=False,
    )


@contextlib.contextmanager
def reading(path: Path, damage: type[Exception] = DatasetError) -> Iterator[None]:
    """Name the shard in errors of the type `damage`, which mean that it is damaged."""
    try:
        yield
    except damage as error:
        raise DatasetError(f"{path} cannot be read: {error}") from error


def facts(path: Path, game: Game | None = None) -> dict[str, Any]:
    """Read the facts of a shard; its counts must fit the categories of `game`, if given."""
    parquet = require("pyarrow.parquet")
    with reading(path, Exception):  # a damaged file can fail anywhere in Arrow
        known = columns.facts_of(parquet.read_metadata(path))
        if game is not None:
            labels.check_counts(known["counts"], game)
        return known


def rows(path: Path, names: Sequence[str] | None = None) -> Iterator[Any]:
    """Read and check columns of a shard, by default all, in tables of at most `ROW_GROUP` rows."""
    pa, parquet = require("pyarrow"), require("pyarrow.parquet")
    with reading(path, Exception), parquet.ParquetFile(path) as file:
        for k in range(file.num_row_groups):
            group = file.metadata.row_group(k)
            if group.total_byte_size > ROW_BYTES * (group.num_rows + ROW_GROUP):
                raise DatasetError(
                    f"row group {k} has {group.total_byte_size:,} bytes, too many for "
                    f"{group.num_rows:,} rows"
                )
        for batch in file.iter_batches(ROW_GROUP, columns=names):
            yield columns.checked(pa.Table.from_batches([batch]), names)


def relabel(folder: Path, plan: Plan, number: int) -> None:
    """Replace the labels of a shard, unless the present decoders made them."""
    game, path = registry.load(plan.game), folder / plan.file(plan.shards[number])
    known = facts(path)
    if known["code"] == code():
        return
    pa, schema = require("pyarrow"), columns.schema({})
    # other decoders may have other categories
    kept = [name for name in schema.names if name not in columns.LABELS]
    states = pa.concat_tables(
        [pa.schema([schema.field(name) for name in kept]).empty_table(), *rows(path, kept)]
    )
    parts: list[Any] = [schema.empty_table()]
    counts: list[Agreement] = []
    for start in range(0, len(states), BATCH):
        part = states.slice(start, BATCH)
        with reading(path):
            pictures = [columns.frames(part[name], game) for name in columns.PICTURES]
        rams = columns.rams(part["ram"])
        found = labels.label(game, rams, *pictures)
        objects = columns.object_columns(found.rem, found.vem, game)
        for name, column in {**objects, columns.TERRAIN: columns.terrain(rams, game)}.items():
            part = part.append_column(schema.field(name), column)
        parts.append(part.select(schema.names).cast(schema))
        counts.append(found.counts)
    latest = known | {"code": code(), "counts": labels.to_counts(counts, game)}
    _write(path, pa.concat_tables(parts), game, latest)
