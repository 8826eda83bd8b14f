"""What several programs share: tables in benchmarks/README.md, and the state of freed memory."""

import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ocjax.evaluation.report import Evaluation

HERE = Path(__file__).parent
PAGE = HERE / "README.md"


def freed_memory() -> str:
    """Retain freed memory in this process, and say in a table's title whether this took effect."""
    import ocjax

    retained = ocjax.retain_freed_memory()
    return f"freed memory {'retained' if retained else 'returned to the system'}"


def evaluated(
    name: str, samples: int, seed: int, ocatari: str | None, **options: Any
) -> "Evaluation":
    """Compare REM with VEM on play of a game, and with OCAtari if its interpreter is given.

    All methods get the same frames. Actions are random, held for 1 to 8 steps, unless `options` of
    `rollout` change this.
    """
    import ocjax
    from ocjax.evaluation import ocatari_peer, report
    from ocjax.play.rollouts import rollout

    tape = rollout(ocjax.load(name), samples, seed=seed, **options)
    return report.evaluate(tape, "", ocatari_peer.run(tape, Path(ocatari)) if ocatari else None)


class PageTable:
    """A table of games between two comments on the page.

    The first cell of a row is the game, and rows are sorted by it.

    Args:
        begin: the comment before the table.
        end: the comment after it.
        header: headings of the columns.
    """

    def __init__(self, begin: str, end: str, header: Sequence[str]) -> None:
        self._begin, self._end, self._header = begin, end, list(header)
        table = PAGE.read_text().split(begin)[1].split(end)[0]
        lines = [
            [cell.strip() for cell in re.findall(r"[^|]+", line)] for line in table.split("\n")[4:]
        ]
        self._rows = {cells[0]: cells for cells in lines if cells}

    @property
    def rows(self) -> list[list[str]]:
        """The rows in the order of their games."""
        return [self._rows[name] for name in sorted(self._rows)]

    def measure(self, games: Iterable[str], row_of: Callable[[str], list[str]]) -> None:
        """Measure a row for each game, print it, and write it to the page."""
        for name in games:
            row = row_of(name)
            print(" | ".join(row), file=sys.stderr, flush=True)
            self._replace(row)

    def _replace(self, row: Sequence[str]) -> None:
        """Replace or add a row, and write the page."""
        self._rows[row[0]] = list(row)
        lines = [self._header, ["---"] * len(self._header), *self.rows]
        table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        before, rest = PAGE.read_text().split(self._begin)
        PAGE.write_text(
            f"{before}{self._begin}\n\n{table}\n\n{self._end}{rest.split(self._end)[1]}"
        )
