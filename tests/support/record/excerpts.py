"""The excerpts of a game in `tests/data`."""

from pathlib import Path

from ocjax.extraction.game import Game

FOLDERS = ("", "ends", "modes", "rare", "edges", "savers")  # of `tests/data`


def paths(data: Path, game: Game, other_than: Path | None = None) -> list[Path]:
    """The excerpts of a game under `tests/data`, without one of them."""
    every = [data / folder / f"{game.name}.npz" for folder in FOLDERS]
    return [path for path in every if path.exists() and path != other_than]
