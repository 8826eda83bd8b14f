"""Time OCAtari's extraction of one game on random play; prints JSON.

Runs in an environment of its own (it needs numpy < 2):

    python -m venv peer && peer/bin/pip install ocatari==2.2.1 ale-py "numpy<2"
    peer/bin/python benchmarks/peer.py Pong 500

Microseconds a frame (median, 10 % and 90 %) of each method's detection alone, emulation left out; null where it does not run.
"""

import json
import random
import statistics
import sys
import time
import warnings


def times(game: str, mode: str, steps: int) -> list[float] | None:
    """Microseconds of each detection."""
    from ocatari.core import OCAtari  # pyright: ignore[reportMissingImports]
    from ocatari.ram.extract_ram_info import init_objects  # pyright: ignore[reportMissingImports]
    from ocatari.vision.extract_vision_info import detect_objects_vision  # pyright: ignore[reportMissingImports]

    try:
        env = OCAtari(f"ALE/{game}-v5", mode=mode, hud=True)
        detect = env.detect_objects
    except Exception:
        if mode == "ram":
            return None
        env = OCAtari(f"ALE/{game}-v5", mode="ram", hud=True)  # some games' vision works though its constructor does not
        objects = init_objects(game, True)

        def detect() -> None:
            detect_objects_vision(objects, env.getScreenRGB(), game, True)

    env.reset(seed=0)
    actions, out = random.Random(0), []
    for _ in range(steps):
        _, _, terminated, truncated, _ = env.step(actions.randrange(env.nb_actions))
        try:
            start = time.perf_counter()
            detect()
            out.append(1e6 * (time.perf_counter() - start))
        except Exception:
            return None
        if terminated or truncated:
            env.reset()
    return out


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    name, steps = sys.argv[1], int(sys.argv[2])
    result = {}
    for key, mode in (("rem", "ram"), ("vem", "vision")):
        try:
            spent = times(name, mode, steps)
        except Exception:
            spent = None
        deciles = statistics.quantiles(spent, n=10) if spent else []
        result[key] = [statistics.median(spent), deciles[0], deciles[-1]] if spent else None
    print(json.dumps(result))
