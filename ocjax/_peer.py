"""OCAtari's objects on recorded RAM and frames; prints JSON.

Runs in an environment that has OCAtari 2.2.1 (which needs numpy < 2), not in ours: a file with `rams` and RGB `screens`, the game's name.

The answer has for each of `rem` and `vem` the `objects` (a list a frame of [category, x, y, w, h]) and the microseconds of each
detection (`us`), or the `error` that it ended with. Objects that it marks as absent are left out.
"""

import json
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np


def detect(method: str, game: str, data: Any, resets: np.ndarray) -> dict[str, Any]:
    """Objects and times of one method over all samples."""
    import ocatari.core  # noqa: F401  # loads all games  # pyright: ignore[reportMissingImports]
    from ocatari.ram.extract_ram_info import detect_objects_ram, init_objects  # pyright: ignore[reportMissingImports]
    from ocatari.vision.extract_vision_info import detect_objects_vision  # pyright: ignore[reportMissingImports]

    rem = method == "rem"
    step: Callable[..., None] = detect_objects_ram if rem else detect_objects_vision
    kept, out, spent = [], [], []
    for sample, reset in zip(data["rams" if rem else "screens"], resets, strict=True):
        if reset or not kept:
            try:
                kept = init_objects(game, True, vision=not rem)
            except Exception:
                if rem:
                    raise
                kept = init_objects(game, True)  # some games' vision works with the other method's objects only
        start = time.perf_counter()
        step(kept, sample, game, True)
        spent.append(1e6 * (time.perf_counter() - start))
        out.append([[o.category, *map(float, o.xywh)] for o in kept if o])
    return {"objects": out, "us": spent}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    with np.load(sys.argv[1]) as file:
        arrays = dict(file)
    answer = {}
    for name in ("rem", "vem"):
        try:
            answer[name] = detect(name, sys.argv[2], arrays, arrays["resets"])
        except Exception as error:
            answer[name] = {"error": f"{type(error).__name__}: {error}"}
    sys.stdout.write("\n" + json.dumps(answer))
