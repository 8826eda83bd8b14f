"""The recordings in `tests/data`, and damaged archives."""

import functools
from pathlib import Path

import numpy as np
import pytest

from ocjax import recordings

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"


@functools.cache
def excerpt(name):
    """The arrays of a game's recording in `tests/data`.

    `rams` uint8 `[n, 128]`, `screens` and `previous` uint8 `[n, H, 160]` (the last two emulated
    frames), `rewards` `[n]` (since the episode began) and `lives` `[n]`. Recordings cut from an
    instrumented emulator's have `drawn` bool `[n, H, 160]` too: a graphics object shows there on
    one of the two frames.
    """
    path = DATA / f"{name}.npz"
    if not path.exists():
        pytest.fail(f"{path} is missing: `python -m tests.support.record {name}` makes it")
    return recordings.read(path, name).arrays


def damaged_archive(good, number):
    """The bytes of a zip archive, damaged in one of four ways, chosen by a number."""
    rng = np.random.default_rng(number)
    data = bytearray(good)
    at = int(rng.integers(len(data)))
    if number % 2:  # in the headers, which are a small part of the file
        at = int(rng.choice([i for i in range(len(data)) if data[i : i + 2] == b"PK"])) + int(
            rng.integers(60)
        )
    at = min(at, len(data) - 1)
    match number % 8 // 2:
        case 0:
            data[at] ^= 1 << int(rng.integers(8))
        case 1:
            data[at] = int(rng.integers(256))
        case 2:
            data[at : at + 4] = rng.bytes(4)
        case 3:
            del data[at : at + int(rng.integers(1, 200))]
    return bytes(data)
