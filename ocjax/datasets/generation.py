"""Generate or relabel a dataset in a folder. Both resume after an interruption."""

import functools
from collections.abc import Callable
from pathlib import Path

from ocjax._extras import require
from ocjax.console.rom_files import read_rom
from ocjax.datasets import datasheet, shards
from ocjax.datasets.plans import DATA, DatasetError, Plan, code, versions
from ocjax.emulators import ram_starts
from ocjax.extraction import registry
from ocjax.files import cluster, jobs, writing
from ocjax.files.jobs import Report, silent

PLAN, SHEET = "dataset.json", "README.md"


def generate(
    plan: Plan, folder: str | Path, *, ray: str | None = None, report: Report = silent
) -> None:
    """Generate a dataset. Equal plans give equal bytes.

    The folder gets `dataset.json` (the plan), `data/*.parquet` (the shards) and finally `README.md`
    (the datasheet). After an interruption, a second call makes the missing files.

    Args:
        plan: see `ocjax.datasets.plan`.
        folder: created if necessary.
        ray: the address of a Ray cluster whose machines share the folder; see
            `ocjax.files.cluster`.
        report: called after each shard with the numbers of finished and of all states.

    Raises:
        DatasetError: a ValueError; the folder holds another dataset or other files.
        RomError: a ValueError; the ROM is missing, or the game's decoder needs another ROM.
        ValueError: the cluster cannot be reached.
        MissingExtraError: pyarrow is not installed.
        OSError: a file cannot be written.
    """
    game, folder = registry.load(plan.game), Path(folder).resolve()
    read_rom(game.rom, game.md5)
    require("pyarrow")
    jobs.claim(folder, PLAN, plan.to_json(), "dataset", error=DatasetError)
    _check_data(folder)
    (folder / DATA).mkdir(exist_ok=True)
    _run(functools.partial(shards.make, folder, plan), missing(plan, folder), plan, ray, report)
    _finish(folder, plan)


def relabel(folder: str | Path, *, ray: str | None = None, report: Report = silent) -> None:
    """Replace the objects and terrain of a dataset with the results of the present decoders.

    The datasheet is also replaced. Frames, RAM and the choice of sequences stay unchanged. After an
    interruption, a second call relabels the remaining shards.

    Args:
        folder: folder of a complete dataset.
        ray: the address of a Ray cluster; see `generate`.
        report: called after each shard with the numbers of finished and of all states.

    Raises:
        DatasetError: a ValueError; the folder holds no complete dataset, or the dataset was made
            with another ROM.
        ValueError: the cluster cannot be reached.
        OSError: a file cannot be written.
    """
    folder = Path(folder).resolve()
    _check_data(folder)
    plan = open_dataset(folder)
    game = registry.load(plan.game)
    if plan.md5 != game.md5:
        raise DatasetError(
            f"{folder} was made with the ROM of md5 {plan.md5}, but the decoder of {game.name} "
            f"is for {game.md5}"
        )
    old = [s.number for s in plan.shards if shards.facts(folder / plan.file(s))["code"] != code()]
    task = functools.partial(shards.relabel, folder, plan)
    _run(task, old, plan, ray, report)
    _finish(folder, plan)


def open_dataset(folder: str | Path) -> Plan:
    """Read the plan of a complete dataset.

    Raises:
        DatasetError: a ValueError; the folder holds no dataset, or shards are missing.
    """
    folder = Path(folder)
    if not (folder / PLAN).exists():
        raise DatasetError(f"{folder} holds no dataset: it has no {PLAN}")
    fields = jobs.read(folder / PLAN, error=DatasetError)
    try:
        plan = Plan.from_fields(fields)
        ram_starts.checked(registry.load(plan.game), plan.starts)
    except ValueError as error:
        raise DatasetError(
            f"{folder / PLAN} is damaged, or of another version of ocjax: {error}"
        ) from error
    absent = [str(plan.file(plan.shards[k])) for k in missing(plan, folder)]
    if absent:
        listed = f"{absent[0]} and {len(absent) - 1} more" if len(absent) > 1 else absent[0]
        raise DatasetError(f"{folder} is not complete: it lacks {listed}; generate it again")
    return plan


def missing(plan: Plan, folder: Path) -> list[int]:
    """The numbers of the missing shards."""
    return [s.number for s in plan.shards if not (folder / plan.file(s)).is_file()]


def _check_data(folder: Path) -> None:
    """Check that the folder of the shards is not a link.

    The shards themselves may be links, which are replaced when they are written.
    """
    if (folder / DATA).is_symlink():
        raise DatasetError(
            f"{folder / DATA} is a link, and shards are written to the dataset's own folder "
            "only: copy the shards into it"
        )


def _run(
    task: Callable[[int], object],
    numbers: list[int],
    plan: Plan,
    ray: str | None,
    report: Report,
) -> None:
    states = [shard.states for shard in plan.shards]
    done = plan.states - sum(states[k] for k in numbers)
    report(done, plan.states)
    for k in cluster.completed(task, numbers, ray):
        done += states[k]
        report(done, plan.states)


def _finish(folder: Path, plan: Plan) -> None:
    """Write the datasheet, and delete temporary files of killed processes."""
    for unfinished in (folder / DATA).glob(".*.tmp"):
        if unfinished.is_symlink() or not unfinished.is_dir():
            unfinished.unlink()
    game = registry.load(plan.game)
    found = [shards.facts(folder / plan.file(shard), game) for shard in plan.shards]
    writing.write_text(
        folder / SHEET, datasheet.text(plan, found, versions(), code()), follow=False
    )
