"""Datasets of several games in one folder, with a table of contents and checksums."""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from ocjax.datasets import labels, shards
from ocjax.datasets.generation import PLAN, SHEET, generate, missing
from ocjax.datasets.plans import SEEDS, Plan, plan
from ocjax.emulators import ram_starts
from ocjax.evaluation import tables
from ocjax.evaluation.tables import Table
from ocjax.extraction import registry
from ocjax.files import writing
from ocjax.files.jobs import Report, silent

CHECKSUMS = "checksums.txt"
FEW = 20  # objects of a category
_MEGABYTE = 1e6
_HEADER = ("Game", "States", "Random", "Left out", "F1", f"Categories below {FEW} objects", "MB")


def plan_of(game: str, states: int, seeds: Sequence[int] = SEEDS) -> Plan:
    """The plan of a game in a collection: the default policies, and all starts of the game."""
    declared = [ram_starts.parse(text) for text in registry.load(game).variants.starts]
    return plan(game, states, seeds, starts=[{}, *declared] if declared else ())


def generate_all(
    plans: Sequence[Plan],
    folder: str | Path,
    *,
    ray: str | None = None,
    report: Report = silent,
) -> None:
    """Generate a dataset of each game in a subfolder. Equal plans give equal bytes.

    Then `README.md` gets a table of the datasets, and `checksums.txt` the SHA-256 of each file, for
    `sha256sum --check`. After an interruption, a second call makes the missing files.

    Args:
        plans: of different games; see `plan_of`.
        folder: created if necessary.
        ray: see `ocjax.datasets.generate`.
        report: called with the numbers of finished and of all states.

    Raises:
        DatasetError, RomError, ValueError, MissingExtraError, OSError: see
            `ocjax.datasets.generate`.
    """
    folder = Path(folder)
    total = sum(plan.states for plan in plans)
    before = 0
    for one in plans:
        own = folder / one.game
        if not is_complete(one, own):
            generate(
                one, own, ray=ray, report=lambda done, _, start=before: report(start + done, total)
            )
        before += one.states
    writing.write_text(folder / CHECKSUMS, "".join(_checksums(plans, folder)), follow=False)
    writing.write_text(folder / SHEET, _text(plans, folder), follow=False)


def is_complete(plan: Plan, folder: Path) -> bool:
    """Whether the folder holds all files of a plan."""
    own = folder / PLAN
    same = own.exists() and own.read_text("utf-8") == plan.to_json()
    return same and (folder / SHEET).exists() and not missing(plan, folder)


def _files(plan: Plan) -> list[Path]:
    return [Path(PLAN), Path(SHEET), *(plan.file(shard) for shard in plan.shards)]


def _checksums(plans: Sequence[Plan], folder: Path) -> Iterator[str]:
    for one in plans:
        for file in _files(one):
            with (folder / one.game / file).open("rb") as opened:
                digest = hashlib.file_digest(opened, "sha256").hexdigest()
            yield f"{digest}  {one.game}/{file.as_posix()}\n"


def _text(plans: Sequence[Plan], folder: Path) -> str:
    rows = [_row(one, folder / one.game) for one in plans]
    intro = (
        "# Object-centric Atari datasets\n\nEach folder is a dataset of one game, with its own "
        "datasheet. Random: the share of the states in percent that random actions reach; trained "
        "policies, or held random actions in games without one, reach the others. "
        f"`sha256sum --check {CHECKSUMS}` verifies all files.\n\n"
    )
    return intro + tables.to_markdown([Table("Datasets", _HEADER, rows)])


def _row(plan: Plan, folder: Path) -> tuple[tables.Cell, ...]:
    game = registry.load(plan.game)
    found = [shards.facts(folder / plan.file(shard), game) for shard in plan.shards]
    counts = labels.from_counts([one["counts"] for one in found], game)
    number = zip((c.name for c in game.categories), counts.left, strict=True)
    few = [name for name, objects in number if objects < FEW]
    left_out = sum(one["states_left_out"] for one in found)
    size = sum((folder / file).stat().st_size for file in _files(plan)) / _MEGABYTE
    return (
        plan.game,
        plan.states - left_out,
        100 * _random_share(plan, folder),
        left_out,
        100 * float(counts.sum().f1),
        ", ".join(few) or None,
        round(size),
    )


def _random_share(plan: Plan, folder: Path) -> float:
    """The share of random play among the rows."""
    import pyarrow.parquet as parquet

    files = [folder / plan.file(shard) for shard in plan.shards]
    columns = [parquet.read_table(file, columns=["policy"])["policy"] for file in files]
    played = [policy for column in columns for policy in column.to_pylist()]
    return played.count("random") / max(len(played), 1)
