"""Results of a policy on variations of its game."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ocjax.emulators import variations
from ocjax.evaluation.tables import Table
from ocjax.extraction.game import Game
from ocjax.play.games import MOST_ENVS, Played, play

ORIGINAL = "original"  # the game without a variation


@dataclasses.dataclass(frozen=True)
class Row:
    """A policy's result on one variation, or on the original game.

    Args:
        name: name of the variation, or "original".
        games: number of complete games.
        mean, deviation: mean and sample standard deviation of the returns; 0 for one game.
        drop: the decrease from the original's mean in percent, negative for an increase, or None.
        seed: seed of the first instance; the others have the following seeds.
    """

    name: str
    games: int
    mean: float
    deviation: float
    drop: float | None
    seed: int


def compare(
    game: Game, policy: str, names: Sequence[str], episodes: int, *, seed: int = 0, **protocol: Any
) -> list[Row]:
    """Play complete games of the original and of variations, all with the same seeds.

    `protocol` and the policy are as in `ocjax.play.games.play`.
    """
    found = {name: variations.find(name, game.name) for name in names}
    played = {ORIGINAL: play(game, policy, episodes, seed=seed, **protocol)}
    for name, variation in found.items():
        played[name.rpartition(":")[2]] = play(
            game, policy, episodes, seed=seed, hook=variation, **protocol
        )
    return _rows(played, seed)


def chosen(game: Game, text: str) -> list[str]:
    """Parse a list of variations.

    The text is "all", "objects" (variations that remove or freeze categories), or names such as
    "lazy_enemy,freeze Ball".
    """
    if text == "objects":
        names = [name for name in variations.names(game.name) if not name.startswith("recolor")]
        if not names:
            raise ValueError(
                f"{game.name} has no variations by object: no bytes are known that remove or "
                "freeze a category"
            )
        return names
    known = [*variations.of(game.name)]
    if text == "all" and not known:
        raise ValueError(
            f"{game.name} has no variations; there are those of "
            f"{', '.join({v.game: 0 for v in variations.ALL.values()})}"
        )
    names = known if text == "all" else [name.strip() for name in text.split(",")]
    for name in names:
        variations.find(name, game.name)
    return names


def table(game: Game, policy: str, rows: Sequence[Row]) -> Table:
    """The rows as a table."""
    header = ("Variation", "Mean return", "Standard deviation", "Drop in %", "Games", "Seeds")
    cells = [
        [
            r.name,
            f"{r.mean:,.1f}",
            f"{r.deviation:,.1f}",
            None if r.drop is None else f"{r.drop:.1f}",
            r.games,
            _seeds(r),
        ]
        for r in rows
    ]
    return Table(f"{game.name}: returns of complete games, policy {policy}", header, cells)


def _seeds(row: Row) -> str:
    last = row.seed + min(row.games, MOST_ENVS) - 1
    return f"{row.seed}" if last == row.seed else f"{row.seed} to {last}"


def _rows(played: Mapping[str, Played], seed: int) -> list[Row]:
    base = float(played[ORIGINAL].returns.mean())
    rows = []
    for name, p in played.items():
        mean = float(p.returns.mean())
        drop = None if name == ORIGINAL or base == 0 else 100 * (base - mean) / abs(base)
        rows.append(
            Row(
                name,
                len(p.returns),
                mean,
                float(p.returns.std(ddof=1)) if len(p.returns) > 1 else 0.0,
                drop,
                seed,
            )
        )
    return rows
