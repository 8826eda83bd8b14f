"""`Blobs` rules: the connected components of all categories, in one search."""

import functools
from collections.abc import Mapping, Sequence

import jax.numpy as jnp
from jax import lax

from ocjax.console.boxes import WIDTH, Area
from ocjax.vision.components import components
from ocjax.vision.components.search import Search, window_words
from ocjax.vision.detected import Detected
from ocjax.vision.rules import Blobs
from ocjax.vision.scene import Scene

# Ratio. Two boards are used if one board fills at least this many times as many words, with equally
# many candidates in each search. Row `two boards` of benchmarks/tricks.py.
MIN_RATIO_OF_ONE_BOARD = 1.9


def detect_blobs(
    scene: Scene, rules: Mapping[str, tuple[Blobs, int]], *, heads: bool
) -> dict[str, Detected]:
    """Find the objects of some categories.

    Args:
        heads: whether to compute the column of each object's first pixel, too.
    """
    if not rules:
        return {}
    searched = [(name, rule) for name, (first, _) in rules.items() for rule in first.rules]
    masks = [scene.cut(rule) for _, rule in searched]
    searches = [_search(rule, rules[name][1], scene.region(rule)) for name, rule in searched]
    found: dict[int, Detected] = {}
    for board in _boards(searches):
        objects = components([masks[i] for i in board], [searches[i] for i in board], heads=heads)
        found |= dict(zip(board, objects, strict=True))
    of_categories: dict[str, list[Detected]] = {name: [] for name in rules}
    for i, (name, rule) in enumerate(searched):
        of_categories[name].append(
            found[i] if rule.frames is None else found[i].where(scene.search(rule.frames)[None])
        )
    return {
        name: of_categories[name][0] if len(rule.rules) == 1 else _merge(of_categories[name], count)
        for name, (rule, count) in rules.items()
    }


def _boards(searches: Sequence[Search]) -> list[list[int]]:
    """Group the searches by board: all on one board, or small and large ones on two.

    All windows of a board have the size of the largest. A second board takes 0.6 s more to compile,
    but Private Eye takes 27 us per frame instead of 41.
    """
    reaches = [search.reach for search in searches]
    widths, heights = (sorted(set(side)) for side in zip(*reaches, strict=True))

    def split(width: int, height: int) -> list[list[int]]:
        small = [w <= width and h <= height for w, h in reaches]
        return [
            [i for i, is_small in enumerate(small) if is_small == which] for which in (True, False)
        ]

    def words(board: Sequence[int]) -> int:
        return len(board) * window_words([reaches[i] for i in board])

    together = list(range(len(searches)))
    apart = min(
        (split(w, h) for w in widths for h in heights), key=lambda boards: sum(map(words, boards))
    )
    ratio = words(together) / sum(map(words, apart))
    return apart if ratio >= MIN_RATIO_OF_ONE_BOARD else [together]


def _search(rule: Blobs, count: int, region: Area) -> Search:
    left, top, right, _ = region
    return Search(
        count, rule.all_shapes, rule.connectivity, rule.gap, rule.pictures, top, (left, right)
    )


def _merge(lists: Sequence[Detected], count: int) -> Detected:
    """Keep the first `count` boxes of several lists, in raster order of their corners."""
    box = jnp.concatenate([found.box for found in lists])
    both, index = Detected(box), jnp.arange(len(box), dtype=jnp.int32)[:, None]
    # One number per box, because sorting two arrays takes longer.
    order = jnp.where(both.valid, both.y * WIDTH + both.x, 2**16 - 1) * 2**15 + index
    index = lax.sort(order, dimension=0)[:count] % 2**15
    heads = [found.head for found in lists if found.head is not None]
    head = (
        jnp.take_along_axis(jnp.concatenate(heads), index, axis=0)
        if len(heads) == len(lists)
        else None
    )
    merged = Detected(jnp.take_along_axis(box, index, axis=0), head=head)
    more = functools.reduce(
        jnp.add, (found.overflow for found in lists if found.overflow is not None)
    )
    without_slot = jnp.sum(both.valid, axis=0, dtype=jnp.int32) - jnp.sum(
        merged.valid, axis=0, dtype=jnp.int32
    )
    return merged._replace(overflow=more + without_slot)
