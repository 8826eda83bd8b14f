"""Cut the excerpts in tests/data from full recordings (folders with <Game>.npz as described in conftest.excerpt).

python tests/make_data.py SAMPLES FOLDER [FOLDER ...]
"""

import sys
from pathlib import Path

import numpy as np

import ocjax


def main(samples, folders):
    out = Path(__file__).parent / "data"
    out.mkdir(exist_ok=True)
    for name in ocjax.games():
        parts = []
        for folder in folders:
            with np.load(folder / f"{name}.npz") as file:
                pick = np.linspace(0, len(file["rams"]) - 1, samples // len(folders)).astype(int)
                drawn = (file["shown"] != 0) | ((file["shown"] ^ file["previous_shown"]) != 0)
                part = {k: file[k][pick] for k in ("rams", "screens", "previous", "rewards", "lives")}
                parts.append(part | {"drawn": np.packbits(drawn[pick], axis=-1)})
        np.savez_compressed(out / f"{name}.npz", **{k: np.concatenate([p[k] for p in parts]) for k in parts[0]})


if __name__ == "__main__":
    main(int(sys.argv[1]), [Path(f) for f in sys.argv[2:]])
