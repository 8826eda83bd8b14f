"""Pictures of a game's objects, in the states with most kinds of objects on the screen."""

import contextlib

import jax
import numpy as np
from PIL import Image

from ocjax.emulators.ale import AlePool
from ocjax.emulators.settings import Settings
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.transforms.drawing import HIDDEN, drawn, overlay, sheet

INSTANCES = 8
EVERY = 10  # agent steps between the states to compare


def richest(game: Game, objects: Objects, frames: np.ndarray, count: int) -> np.ndarray:
    """The indices of `count` states with objects of most categories on the frame, best first.

    Fewer hidden objects, then later states, break ties.

    Args:
        objects: of batch shape `[B]`.
        frames: uint8 `[B, H, 160]` of palette indices.
    """
    on_host = jax.tree.map(np.asarray, objects)
    shown = np.stack(
        [drawn(game, frame, state) for frame, state in zip(frames, on_host, strict=True)]
    )
    kinds = np.stack([shown[:, slots].any(axis=1) for slots in game.slices.values()]).sum(axis=0)
    hidden = np.count_nonzero(on_host.valid & ~shown, axis=1)
    return np.lexsort((np.arange(len(frames)), -hidden, kinds))[::-1][:count]


def picture(game: Game, steps: int, *, seed: int = 0) -> Image.Image:
    """REM's objects beside VEM's in the richest state of some random play."""
    rams, frames = states(game, steps, seed)
    at = richest(game, game.rem(rams), frames, 1)[0]
    seen = game.rem(rams[at]), game.vem(frames[at])
    columns = [
        overlay(game, frames[at], jax.tree.map(np.asarray, objects), scale=2) for objects in seen
    ]
    return sheet([columns], [f"REM ({HIDDEN})", "VEM"])


def states(game: Game, steps: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """RAM uint8 `[B, 128]` and frames uint8 `[B, H, 160]` of states of random play."""
    rng = np.random.default_rng(seed)
    rams, frames = [], []
    with contextlib.closing(AlePool(game, INSTANCES, Settings(), screens=("screen",))) as pool:
        pool.reset([seed + i for i in range(INSTANCES)])
        for step in range(1, steps + 1):
            pool.step(rng.integers(len(pool.actions), size=INSTANCES))
            if step % EVERY == 0:
                rams.append(np.array(pool.ram))
                frames.append(np.array(pool.screen[:, 1]))
    return np.concatenate(rams), np.concatenate(frames)
