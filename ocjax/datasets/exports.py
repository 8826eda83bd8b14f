"""Export a dataset to the CSV layout of the OCAtari paper's dataset, or to Minari."""

import csv
import functools
import io
import itertools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from gymnasium import spaces

from ocjax._extras import require
from ocjax.console.ram import RAM_SIZE
from ocjax.datasets import columns, shards
from ocjax.datasets.generation import PLAN, open_dataset
from ocjax.datasets.plans import DatasetError, Plan
from ocjax.emulators.start import action_set, load_emulator
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.files.inputs import MINARI
from ocjax.files.jobs import Report, silent
from ocjax.files.minari import new_dataset

CSV_COLUMNS = ("INDEX", "OBS", "HUD", "RAM", "VIS")


def export(folder: str | Path, out: str | Path, *, report: Report = silent) -> None:
    """Export a dataset, completely or not at all.

    A `.csv` file has the columns of the OCAtari paper's dataset: `INDEX` (`episode_step`, five
    digits each), `OBS` (a list of the `210 * 160 * 3` numbers of the RGB frame), and the objects
    `HUD` and `RAM` (from REM) and `VIS` (from VEM) as sorted lists of the form `Player at (140,
    100), (4, 16)`.

    A Minari dataset has the observations `ram` uint8 `[128]` and `screen` uint8 `[H, 160]` (palette
    indices), and the fields of `Objects` of both methods as infos. An episode with omitted
    sequences becomes several episodes.

    Args:
        folder: folder of a complete dataset.
        out: a path that ends in .csv, or the ID of a new Minari dataset after "minari:". An
            existing .csv file is replaced.
        report: called regularly with the numbers of finished and of all states.

    Raises:
        DatasetError: a ValueError; the folder holds no complete dataset.
        ValueError: the format is not supported.
        InputError: a ValueError; the Minari ID is malformed or exists.
        MissingExtraError: minari is not installed.
        OSError: a file cannot be written.
    """
    plan, folder = open_dataset(folder), Path(folder)
    if str(out).startswith(MINARI):
        _to_minari(folder, plan, str(out), report)
    elif Path(out).suffix == ".csv":
        writing.check(
            Path(out), reads=[folder / PLAN, *(folder / plan.file(shard) for shard in plan.shards)]
        )
        writing.write(Path(out), functools.partial(_write_csv, folder, plan, report))
    else:
        raise ValueError(f"the output must end in .csv or be {MINARI}ID, got {out}")


def _write_csv(folder: Path, plan: Plan, report: Report, file: BinaryIO) -> None:
    out = io.TextIOWrapper(file, "utf-8", newline="", write_through=True)
    writer, game = csv.writer(out, lineterminator="\n"), registry.load(plan.game)
    colors = np.array([f"{r}, {g}, {b}" for r, g, b in np.asarray(game.palette)], object)
    writer.writerow(CSV_COLUMNS)
    number, before, done = -1, None, 0
    for shard in plan.shards:
        for rows in shards.rows(
            folder / plan.file(shard), ["instance", "episode", "step", "image", *columns.OBJECTS]
        ):
            with shards.reading(folder / plan.file(shard)):
                screens = columns.frames(rows["image"], game)
            records = rows.drop_columns("image").to_pylist()
            for screen, row in zip(screens, records, strict=True):
                episode = (shard.number, row["instance"], row["episode"])
                number, before = number + (episode != before), episode
                pixels = ", ".join(colors[screen].ravel().tolist())
                listed = (_listed(row[name]) for name in ("hud", "rem", "vem"))
                writer.writerow((f"{number:05}_{row['step']:05}", f"[{pixels}]", *listed))
        done += shard.states
        report(done, plan.states)
    out.detach()


def _listed(objects: list[dict[str, Any]]) -> str:
    texts = sorted(
        f"{o['category']} at ({o['x']}, {o['y']}), ({o['w']}, {o['h']})" for o in objects
    )
    return f"[{', '.join(texts)}]"


def _to_minari(folder: Path, plan: Plan, name: str, report: Report) -> None:
    game = registry.load(plan.game)
    height, width = game.screen
    boxes: dict[str, spaces.Space] = {
        "ram": spaces.Box(0, 255, (RAM_SIZE,), np.uint8),
        "screen": spaces.Box(0, 255, (height, width), np.uint8),
    }
    actions = action_set(load_emulator(game), plan.settings_of(plan.policies[0][0]))
    kinds = {"observation_space": spaces.Dict(boxes), "action_space": spaces.Discrete(len(actions))}
    facts = {"game": game.name, "md5": game.md5, "plan": json.loads(plan.to_json())}
    description = (
        f"States of {game.name} with the objects that REM and VEM find. Screens are indices of "
        "the emulator's palette."
    )
    policies, done = ", ".join(name for name, _ in plan.policies), 0
    with new_dataset(
        name, kinds, {"description": description, "ocjax": facts, "algorithm_name": policies}
    ) as add:
        for shard in plan.shards:
            path = folder / plan.file(shard)
            for episode in _episodes(path):
                with shards.reading(path):
                    fields = _to_episode(episode, game, len(actions))
                add(**fields)
            done += shard.states
            report(done, plan.states)


def _episodes(path: Path) -> Iterator[Any]:
    pa = require("pyarrow")
    # pictures stay compressed in memory
    rows = pa.concat_tables(
        [columns.schema({}).empty_table().replace_schema_metadata(None), *shards.rows(path)]
    )
    place = np.stack([rows[name].to_numpy() for name in ("instance", "episode", "index")], axis=1)
    breaks = np.flatnonzero((np.diff(place, axis=0) != (0, 0, 1)).any(axis=1)) + 1
    for start, stop in itertools.pairwise([0, *breaks.tolist(), len(rows)]):
        if stop - start > 1:
            yield rows.slice(start, stop - start)


def _to_episode(rows: Any, game: Game, num_actions: int) -> dict[str, Any]:
    """The fields of Minari's `EpisodeBuffer`. An interrupted stretch ends as truncated."""
    step = {
        name: rows[name].to_numpy()[1:].copy()
        for name in ("action", "reward", "terminated", "truncated")
    }
    if (
        not ((step["action"] >= 0) & (step["action"] < num_actions)).all()
        or not np.isfinite(step["reward"]).all()
    ):
        raise DatasetError(
            f"actions must be from 0 to {num_actions - 1}, and rewards finite numbers"
        )
    step["truncated"][-1] |= not step["terminated"][-1]
    return {
        "observations": {
            "ram": columns.rams(rows["ram"]),
            "screen": columns.frames(rows["image"], game),
        },
        "actions": step["action"].astype(np.int64),
        "rewards": step["reward"],
        "terminations": step["terminated"],
        "truncations": step["truncated"],
        "infos": {
            "rem": columns.padded([rows["rem"], rows["hud"]], game),
            "vem": columns.padded([rows["vem"]], game),
            "lives": rows["lives"].to_numpy(),
            "index": rows["index"].to_numpy(),
        },
    }
