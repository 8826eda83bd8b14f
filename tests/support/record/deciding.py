"""Boundary states: a change of one of the decoder's numbers changes their objects.

A decoder is traced once, and every integer in it, in an expression or a table, becomes an input. A
change of an integer by one changes the objects of some states. An excerpt with such a state for
every integer notices every slip in the game's file.
"""

import itertools
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

from ocjax._xla.batches import by_chunks
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction import rem
from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects

STEPS = (1, -1)
LITTLE = 0.01
LARGEST = 512  # entries of a table; larger ones are pictures of the ROM
BATCH = 64  # states at a time, so that one program serves all recordings

Numbers = Iterator[jax.Array]


def decoder(game: Game) -> Callable[[jax.Array], Any]:
    """REM of one state, uint8 `[128]`, as integers that differ if the objects do."""
    height, width = game.screen

    def one(ram: jax.Array) -> Any:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            m = game.ram(ram)
            boxes = game.decode(m)
            saver = None if game.saver is None else game.saver.key(m)
        return [
            rem.slots(c, boxes[c.name].clip(0, 0, width, height), game.palette)
            for c in game.categories
        ], saver

    return one


def decisions(game: Game, rams: np.ndarray, known: np.ndarray | None = None) -> np.ndarray:
    """Find the states with other objects after a change of one integer of the decoder by one, or of
    one address by one.

    Args:
        game: the game.
        rams: uint8 `[B, 128]`.
        known: bool `[changes]`, the changes to skip; their rows are False.

    Returns:
        bool `[changes, B]`: for each integer of the decoder, one row for a larger and one for a
        smaller one; and one for each address.
    """
    traced = jax.make_jaxpr(decoder(game))(np.zeros(RAM_SIZE, np.uint8))
    numbers = np.concatenate([np.ravel(n) for n in _integers(traced)]).astype(np.int32)

    @jax.jit
    def outcomes(numbers: jax.Array, rams: jax.Array) -> list[jax.Array]:
        def one(ram: jax.Array) -> list[jax.Array]:
            return _evaluate(traced.jaxpr, traced.consts, [ram], _handed_out(numbers))

        return jax.vmap(one)(rams)

    @jax.jit
    def differs(numbers: jax.Array, rams: jax.Array, usual: list[jax.Array]) -> jax.Array:
        pairs = zip(outcomes(numbers, rams), usual, strict=True)
        return jnp.stack([(a != b).reshape(len(rams), -1).any(axis=1) for a, b in pairs]).any(
            axis=0
        )

    usual = outcomes(jnp.asarray(numbers), jnp.asarray(rams))
    addresses = tuple(game.ram.addresses())
    changes = len(STEPS) * len(numbers) + len(addresses)
    out = np.zeros((changes, len(rams)), bool)
    changed = _changed(numbers, addresses, jnp.asarray(rams))
    for i, (other_numbers, other_rams) in enumerate(changed):
        if known is None or not known[i]:
            out[i] = differs(other_numbers, other_rams, usual)
    return out


def _changed(
    numbers: np.ndarray, addresses: Iterable[int], rams: jax.Array
) -> Iterator[tuple[np.ndarray, jax.Array]]:
    """The numbers and states of each change."""
    yield from ((other, rams) for other in _larger_and_smaller(numbers))
    for address in addresses:
        yield numbers, rams.at[:, address].set(rams[:, (address + 1) % RAM_SIZE])


def _larger_and_smaller(numbers: np.ndarray) -> Iterator[np.ndarray]:
    """The numbers with one of them changed by one."""
    for i, step in itertools.product(range(len(numbers)), STEPS):
        other = numbers.copy()
        other[i] += step
        yield other


def _is_written(value: Any) -> bool:
    """True if a constant of a traced function may come from an integer in the game's file."""
    return np.issubdtype(np.asarray(value).dtype, np.integer) and np.size(value) <= LARGEST


def _integers(traced: ClosedJaxpr) -> Iterator[np.ndarray]:
    """The integers of a traced function, in `_evaluate`'s order."""
    yield from (np.asarray(c) for c in traced.consts if _is_written(c))
    for eqn in traced.jaxpr.eqns:
        inner = eqn.params.get("jaxpr")
        yield from (
            np.asarray(v.val) for v in eqn.invars if isinstance(v, Literal) and _is_written(v.val)
        )
        if inner is not None:
            yield from _integers(inner)


def _handed_out(numbers: jax.Array) -> Callable[[Any], jax.Array]:
    """A function that gives the next of the numbers, in the shape and dtype of a constant."""
    at = 0

    def take(like: Any) -> jax.Array:
        nonlocal at
        like = np.asarray(like)
        part = lax.slice(numbers, (at,), (at + like.size,)).reshape(like.shape)
        at += like.size
        return part.astype(jax.dtypes.canonicalize_dtype(like.dtype))

    return take


def _evaluate(
    jaxpr: Jaxpr, consts: Iterable[Any], args: list[Any], take: Callable[[Any], jax.Array]
) -> list[Any]:
    """Evaluate a traced function with other integers in it."""
    values = dict(
        zip(jaxpr.constvars, [take(c) if _is_written(c) else c for c in consts], strict=True)
    )
    values |= dict(zip(jaxpr.invars, args, strict=True))

    def read(v: Any) -> Any:
        if not isinstance(v, Literal):
            return values[v]
        return take(v.val) if _is_written(v.val) else v.val

    for eqn in jaxpr.eqns:
        inputs, inner = [read(v) for v in eqn.invars], eqn.params.get("jaxpr")
        if inner is None:
            out = eqn.primitive.bind(*inputs, **eqn.params)
            outputs = out if eqn.primitive.multiple_results else [out]
        else:
            outputs = _evaluate(inner.jaxpr, inner.consts, inputs, take)
        values |= dict(zip(eqn.outvars, outputs, strict=True))
    return [v.val if isinstance(v, Literal) else values[v] for v in jaxpr.outvars]


def shown(game: Game, rams: np.ndarray, screens: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The features of each state: `decisions` of REM, the sizes, places and values that VEM finds,
    and the colours on the frame.

    Args:
        game: the game.
        rams: uint8 `[B, 128]`.
        screens: uint8 `[B, H, 160]`, their frames.

    Returns:
        bool `[features, B]`, and the weight of each feature, float32 `[features]`: small for all
        features except decisions, because they are many.
    """
    objects = in_batches(game.vem, screens)
    found = [_occurrences(game, objects, c) for c in game.categories]
    colors = np.zeros((256, len(screens)), bool)
    for i, screen in enumerate(screens):
        colors[np.unique(screen), i] = True
    decided = decisions(game, rams)
    rows = np.concatenate([decided, *found, colors])
    return rows, np.where(np.arange(len(rows)) < len(decided), 1, LITTLE).astype(np.float32)


def _occurrences(game: Game, objects: Objects, category: Category) -> np.ndarray:
    """The states with an object of each occurring width, height, value and slot, and at the
    outermost edges: bool `[features, B]`."""
    s = game.slices[category.name]
    x, y, w, h = np.moveaxis(np.asarray(objects.xywh)[:, s].astype(int), -1, 0)
    valid, value = np.asarray(objects.valid)[:, s], np.asarray(objects.value)[:, s]
    slots = np.broadcast_to(np.arange(category.count), x.shape)
    rows = [
        (valid & (field == number)).any(axis=1)
        for field in (w, h, value, slots)
        for number in np.unique(field[valid])
    ]
    for edge in (x, y, -x - w, -y - h):
        rows += [(valid & (edge == number)).any(axis=1) for number in np.unique(edge[valid])[:1]]
    return np.array(rows, bool).reshape(-1, len(x))


def in_batches(method: Callable[[np.ndarray], Objects], inputs: np.ndarray) -> Objects:
    """Objects of any number of states as numpy arrays, in batches of one size."""
    return by_chunks(method, inputs, BATCH)


def cover(rows: np.ndarray, most: int, weights: np.ndarray) -> list[int]:
    """Choose columns greedily, so that few of them together have a True in most rows.

    Args:
        rows: bool `[rows, columns]`.
        most: number of columns at most.
        weights: how much each row counts, float32 `[rows]`.
    """
    left = weights.copy()
    chosen: list[int] = []
    while len(chosen) < most:
        gain = left @ rows
        best = int(gain.argmax())
        if gain[best] <= 0:
            break
        chosen.append(best)
        left = left * ~rows[:, best]
    return chosen
