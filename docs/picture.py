"""Draw docs/games.png: the objects that REM finds, over recorded frames of several games.

python docs/picture.py
"""

from pathlib import Path

import numpy as np

import ocjax
from ocjax import recordings
from ocjax.render import overlay, sheet

ROOT = Path(__file__).parent.parent
SAMPLES = {"SpaceInvaders": 12, "MsPacman": 3, "Freeway": 8, "Boxing": 6, "Skiing": 4, "Asterix": 7}
COLUMNS = 3


def main() -> None:
    """Write the picture."""
    tiles = []
    for name, sample in SAMPLES.items():
        tape = recordings.read(ROOT / "tests" / "data" / f"{name}.npz", name)
        assert tape.screens is not None
        tiles.append(overlay(tape.game, np.asarray(tape.screens[sample]), ocjax.load(name).rem(tape.rams[sample]), scale=2))
    rows = [tiles[i : i + COLUMNS] for i in range(0, len(tiles), COLUMNS)]
    sheet(rows, ["Objects from 128 bytes of RAM"] + [""] * (COLUMNS - 1)).save(ROOT / "docs" / "games.png", optimize=True)


if __name__ == "__main__":
    main()
