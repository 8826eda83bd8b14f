"""Print, as JSON, the objects that OCAtari detects on recorded RAM and frames.

    python ocatari_peer_program.py SAMPLES GAME

This program runs in an environment with OCAtari 2.2.1 and without ocjax. SAMPLES is an .npz file
with `rams` (uint8 `[n, 128]`), `screens` (uint8 `[n, H, W, 3]`) and `resets` (bool `[n]`).

The last line of the output maps "rem" and "vem" to `objects` (for each frame a list of `[category,
x, y, w, h]`) and `us` (microseconds of each detection), or to the `error` that stopped the method.
"""

import json
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np


def detect(method: str, game: str, data: Any, resets: np.ndarray) -> dict[str, Any]:
    """The objects and times of one method.

    OCAtari's objects carry state, so resets create new ones.
    """
    import ocatari.core  # noqa: F401  # loads all games  # pyright: ignore[reportMissingImports]
    from ocatari.ram.extract_ram_info import detect_objects_ram  # pyright: ignore
    from ocatari.vision.extract_vision_info import detect_objects_vision  # pyright: ignore

    step: Callable[..., None] = detect_objects_ram if method == "rem" else detect_objects_vision
    slots, objects, us = [], [], []
    for sample, reset in zip(data["rams" if method == "rem" else "screens"], resets, strict=True):
        if reset or not slots:
            slots = initial_slots(method, game)
        start = time.perf_counter()
        step(slots, sample, game, True)
        us.append(1e6 * (time.perf_counter() - start))
        objects.append([[o.category, *map(float, o.xywh)] for o in slots if o])
    return {"objects": objects, "us": us}


def initial_slots(method: str, game: str) -> list[Any]:
    """Return OCAtari's list of objects at the start of an episode."""
    from ocatari.ram.extract_ram_info import init_objects  # pyright: ignore[reportMissingImports]

    try:
        return init_objects(game, True, vision=method == "vem")
    except Exception:
        if method == "rem":
            raise
        # The vision of some games works only with the objects of the other method.
        return init_objects(game, True)


def main() -> None:
    """Run both methods and print their results."""
    warnings.simplefilter("ignore")
    with np.load(sys.argv[1]) as file:
        arrays = dict(file)
    answer = {}
    for method in ("rem", "vem"):
        try:
            answer[method] = detect(method, sys.argv[2], arrays, arrays["resets"])
        except Exception as error:
            answer[method] = {"error": f"{type(error).__name__}: {error}"}
    sys.stdout.write("\n" + json.dumps(answer))


if __name__ == "__main__":
    main()
