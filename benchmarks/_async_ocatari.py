"""Agent steps per second of Gymnasium's AsyncVectorEnv over OCAtari.

`envs.py` runs this script with an interpreter that has OCAtari:

    python _async_ocatari.py GAME ram|vision NUM_ENVS SECONDS
"""

import sys
import time

import gymnasium
import numpy as np
from ocatari.core import OCAtari  # pyright: ignore[reportMissingImports]


def main() -> None:
    """Print the rate."""
    name, mode, n, seconds = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    envs = gymnasium.vector.AsyncVectorEnv(
        [lambda: OCAtari(f"ALE/{name}-v5", mode=mode, hud=True)] * n
    )
    envs.reset(seed=0)
    rng, actions = np.random.default_rng(0), gymnasium.spaces.flatdim(envs.single_action_space)
    for _ in range(5):
        envs.step(rng.integers(actions, size=n))
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        envs.step(rng.integers(actions, size=n))
        steps += n
    print(steps / (time.perf_counter() - start))
    envs.close()


if __name__ == "__main__":
    main()
