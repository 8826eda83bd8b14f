"""Apply the vision rules of a game to a batch of frames."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp

from ocjax.extraction.categories import Category
from ocjax.extraction.colors import needs_color, read_colors
from ocjax.vision.blobs import detect_blobs
from ocjax.vision.bounds import detect_bounds
from ocjax.vision.cells import detect_cells
from ocjax.vision.colors import color_set
from ocjax.vision.detected import OWN_COLOR, Detected
from ocjax.vision.rules import Blobs, Bounds, Cells, Runs
from ocjax.vision.runs import detect_runs
from ocjax.vision.scene import Scene
from ocjax.vision.shades import Shades
from ocjax.vision.unknown import UNKNOWN_VALUE

Found = dict[str, Detected]
# A stage returns the objects that it finds or changes, by category.
Stage = Callable[[Scene, Sequence[Category]], Found]


def detect(
    categories: tuple[Category, ...], frames: jax.Array, shades: Shades | None = None
) -> list[Detected]:
    """Apply each category's rule, without `Category.needs`.

    Args:
        frames: uint8 `[B, H, 160]` of palette indices.
    """
    searched = (*categories, *(_substitute(c) for c in categories if c.otherwise is not None))
    scene = Scene({c.name: c.rule for c in searched}, frames, shades)
    for stage in STAGES:
        scene.found |= stage(scene, searched)
    return [_either(scene, c) for c in categories]


def _of(categories: Sequence[Category], kind: type) -> dict[str, tuple[Any, int]]:
    return {c.name: (c.rule, c.count) for c in categories if isinstance(c.rule, kind)}


def _blobs(scene: Scene, categories: Sequence[Category]) -> Found:
    """Find connected components.

    They come first, because other rules exclude the pixels of their objects.
    """
    blobs = _of(categories, Blobs)
    has_steps = any(rule.then for rule, _ in blobs.values())  # steps may read heads
    reads_color = any(needs_color(scene, c) for c in categories if c.name in blobs)
    return detect_blobs(scene, blobs, heads=has_steps or reads_color)


def _after_blobs(scene: Scene, categories: Sequence[Category]) -> Found:
    blobs = {name: own for name, own in _of(categories, Blobs).items() if own[0].then}
    return {
        name: scene.after(rule.then, scene.found[name], rule, count)
        for name, (rule, count) in blobs.items()
    }


def _bounds(scene: Scene, categories: Sequence[Category]) -> Found:
    rules = _of(categories, Bounds)
    masks = [
        [scene.counted(part, colors) for part in rule.parts for _, colors in part.slots]
        for rule, _ in rules.values()
    ]
    found = detect_bounds([rule for rule, _ in rules.values()], masks)
    return {
        name: scene.after(rule.then, own, rule, count)
        for (name, (rule, count)), own in zip(rules.items(), found, strict=True)
    }


def _cells(scene: Scene, categories: Sequence[Category]) -> Found:
    found = {}
    for name, (rule, _) in _of(categories, Cells).items():
        moving = rule.palette if rule.floats is None else color_set(rule.floats[0])
        masks = (scene.cell_mask(rule, colors) for colors in (rule.palette, moving))
        found[name] = detect_cells(rule, *masks)
    return found


def _runs(scene: Scene, categories: Sequence[Category]) -> Found:
    rules = _of(categories, Runs)
    rows = [[scene.mask(colors) for _, colors in rule.rows] for rule, _ in rules.values()]
    found = detect_runs([rule for rule, _ in rules.values()], rows)
    return {
        name: scene.after(rule.then, own, rule, count)
        for (name, (rule, count)), own in zip(rules.items(), found, strict=True)
    }


STAGES: tuple[Stage, ...] = (_blobs, _after_blobs, _bounds, _cells, _runs, read_colors)


def _substitute(c: Category) -> Category:
    assert c.otherwise is not None
    return dataclasses.replace(c, name=f"{c.name} otherwise", rule=c.otherwise, otherwise=c.rule)


def _either(scene: Scene, c: Category) -> Detected:
    """Return the objects of `rule` on frames where it found any, else of `otherwise`.

    Heads are dropped.
    """
    first = scene.found[c.name]
    if c.otherwise is None:
        return first
    second = scene.found[_substitute(c).name]
    empty = ~jnp.any(first.valid, axis=0)

    def choose(own: jax.Array | None, other: jax.Array | None, default: int) -> jax.Array | None:
        known = other if own is None else own
        if known is None:
            return None
        own, other = (jnp.full_like(known, default) if v is None else v for v in (own, other))
        return jnp.where(empty.reshape((1,) * (own.ndim - 1) + empty.shape), other, own)

    return Detected(
        jnp.where(empty[None], second.box, first.box),
        value=choose(first.value, second.value, UNKNOWN_VALUE),
        color=choose(first.color, second.color, OWN_COLOR),
        overflow=choose(first.overflow, second.overflow, 0),
    )
