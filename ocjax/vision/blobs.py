"""`Blobs` rules: the connected components of all categories, in one search."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import jax.numpy as jnp
from jax import lax

from ocjax.console.boxes import WIDTH, Area
from ocjax.vision.components import components
from ocjax.vision.detected import Detected
from ocjax.vision.rules import Blobs
from ocjax.vision.scene import Scene
from ocjax.vision.search import Search, window_words

MANY_SLOTS = 64  # of all rules of a category
SPARE = 4  # slots that several rules of a category share beyond its own: of too many objects, those at the top of the screen are kept
LESS = 1.9  # a second board is worth it where so many times fewer words are filled, if each search has as many candidates


def detect_blobs(scene: Scene, rules: Mapping[str, tuple[Blobs, int]], *, heads: bool) -> dict[str, Detected]:
    """The objects of some categories.

    Args:
        scene: the frames.
        rules: each category's rule and number of slots.
        heads: whether the column of each object's first pixel is needed, too.
    """
    if not rules:
        return {}
    searched = [(name, rule) for name, (first, _) in rules.items() for rule in first.rules]
    masks = [scene.cut(rule) for _, rule in searched]
    lists = _lists(searched, rules)
    counts = [rules[searched[i][0]][1] + SPARE * (lists.count(own) > 1) for i, own in enumerate(lists)]
    searches = [_search(rule, count, scene.region(rule)) for (_, rule), count in zip(searched, counts, strict=True)]
    found: dict[int, Detected] = {}  # by the first rule of each list on each board
    for board in _boards(searches):
        first = {lists[i]: i for i in reversed(board)}
        own = [first[lists[i]] for i in board]
        objects = components([masks[i] for i in board], [searches[i] for i in board], own, heads=heads)
        found |= dict(zip(dict.fromkeys(own), objects, strict=True))
    of_categories: dict[str, list[Detected]] = {name: [] for name in rules}
    for i, of_list in sorted(found.items()):
        name, frames = searched[i][0], searched[i][1].frames
        of_categories[name].append(of_list if frames is None else of_list.where(scene.search(frames)[None]))
    return {
        name: of_categories[name][0] if len(rule.rules) == 1 else _merge(of_categories[name], count)
        for name, (rule, count) in rules.items()
    }


def _lists(searched: Sequence[tuple[str, Blobs]], rules: Mapping[str, tuple[Blobs, int]]) -> list[int]:
    """The list of objects, as a number, that each category's rule adds to.

    Where a category has many slots, its rules share them if they are searched one after the other, and if what they find is valid on the
    same frames. With 40 slots for each of the eight colours of asteroids, Asteroids takes 38 us a frame instead of 32.
    """
    keys = []
    for i, (name, rule) in enumerate(searched):
        first, count = rules[name]
        keys.append((name, rule.frames, rule.gap) if count * len(first.rules) >= MANY_SLOTS else i)
    return [keys.index(key) for key in keys]


def _boards(searches: Sequence[Search]) -> list[list[int]]:
    """The searches that share a board: all of them, or small and large ones apart.

    On a board, all windows are as wide as the widest and as high as the highest one. A second board takes 0.6 s more to compile, but
    Private Eye takes 27 us a frame instead of 41, James Bond 21 instead of 42, and Demon Attack 31 instead of 40. Where windows differ
    less, nothing is gained.
    """
    reaches = [search.reach for search in searches]
    widths, heights = (sorted(set(side)) for side in zip(*reaches, strict=True))

    def split(width: int, height: int) -> list[list[int]]:
        small = [w <= width and h <= height for w, h in reaches]
        return [[i for i, is_small in enumerate(small) if is_small == which] for which in (True, False)]

    def words(board: Sequence[int]) -> int:
        return len(board) * window_words([reaches[i] for i in board])

    together = list(range(len(searches)))
    apart = min((split(w, h) for w in widths for h in heights), key=lambda boards: sum(map(words, boards)))
    return apart if words(together) >= LESS * sum(map(words, apart)) else [together]


def _search(rule: Blobs, count: int, region: Area) -> Search:
    left, top, right, _ = region
    return Search(count, rule.all_shapes, rule.connectivity, rule.gap, rule.pictures, top, (left, right))


def _merge(lists: Sequence[Detected], count: int) -> Detected:
    """The first `count` boxes of several lists, in raster order of their corners."""
    box = jnp.concatenate([found.box for found in lists])
    both, index = Detected(box), jnp.arange(len(box), dtype=jnp.int32)[:, None]
    order = jnp.where(both.valid, both.y * WIDTH + both.x, 2**16 - 1) * 2**15 + index  # one number each: sorting two arrays takes longer
    index = lax.sort(order, dimension=0)[:count] % 2**15
    heads = [found.head for found in lists if found.head is not None]
    head = jnp.take_along_axis(jnp.concatenate(heads), index, axis=0) if len(heads) == len(lists) else None
    merged = Detected(jnp.take_along_axis(box, index, axis=0), head=head)
    more = functools.reduce(jnp.add, (found.overflow for found in lists if found.overflow is not None))
    without_slot = jnp.sum(both.valid, axis=0, dtype=jnp.int32) - jnp.sum(merged.valid, axis=0, dtype=jnp.int32)
    return merged._replace(overflow=more + without_slot)
