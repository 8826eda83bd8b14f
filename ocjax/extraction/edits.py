"""Edit RAM by objects: find bytes with which REM reads the wanted position, size or value."""

import functools
import numbers
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla.batches import by_chunks
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects

__all__ = ["EDITABLE", "edit"]

EDITABLE = ("x", "y", "w", "h", "orientation", "value")
"""The fields that `edit` accepts."""

_BOX = 4  # the first fields are the box
_MOST_BYTES = 4  # maximum number of bytes that an edit writes
# Number of edits that are kept, nearest first, to try another byte in each.
_KEPT = 8
_CHUNK = 4_096  # states per call of REM; a single shape compiles once
_FAR = np.iinfo(np.int32).max  # the distance of an edit that changes anything else


def edit(
    game: Game, ram: np.ndarray, category: str, slot: int | None = None, **wanted: int
) -> np.ndarray:
    """Return RAM with another number for an object, and with everything else unchanged for REM.

        ram = ocjax.edit(game, envs.get_ram(), "Ball", x=80, y=100)

    The search tries every value of every byte, then of pairs of bytes and so on, up to four bytes,
    until REM reads the wanted numbers. This takes from 0.01 to 2 seconds per state. An edit works
    only for numbers that have separate bytes. The box of a display may change with its value. The
    game itself may draw from other bytes, so check the objects after a step.

    Args:
        game: the game.
        ram: uint8 `[..., 128]`; every state is edited.
        category: name of the object's category.
        slot: the slot of the object within its category; by default the first valid one of each
            state.
        **wanted: the new numbers: `x`, `y`, `w` and `h` in pixels, `orientation`, `value`.

    Returns:
        The edited RAM, uint8 `[..., 128]`.

    Raises:
        TypeError: a number is not an integer, its name is not in the list above, or none is given.
        ValueError: the category, slot or object does not exist, or no bytes change the numbers as
            wanted and nothing else.
    """
    _check(game, category, slot, wanted)
    ram = np.asarray(ram)
    found = jax.tree.map(np.asarray, game.rem(ram))
    flat = np.reshape(ram, (-1, RAM_SIZE))
    valid = np.reshape(found.of(category).valid, (len(flat), -1))
    edited = [
        _edited(game, row, _place(game, category, slot, on), wanted)
        for row, on in zip(flat, valid, strict=True)
    ]
    return np.reshape(np.array(edited, np.uint8), ram.shape)


def _check(game: Game, category: str, slot: int | None, wanted: Mapping[str, int]) -> None:
    if category not in game.slices:
        raise ValueError(
            f"{game.name} has no category {category!r}; it has {game.suggestion(category)}"
        )
    if not wanted or not set(wanted) <= set(EDITABLE):
        raise TypeError(
            f"set one or more of {', '.join(EDITABLE)}, got {', '.join(wanted) or 'none'}"
        )
    for name, number in wanted.items():
        if not isinstance(number, numbers.Integral):
            raise TypeError(f"{name} must be an integer, got {number!r}")
    count = game.slices[category].stop - game.slices[category].start
    if slot is not None and not 0 <= slot < count:
        raise ValueError(f"slot must be from 0 to {count - 1} for {category}, got {slot}")


def _place(game: Game, category: str, slot: int | None, valid: np.ndarray) -> int:
    if not valid.any() if slot is None else not valid[slot]:
        where = f"no {category}" if slot is None else f"no {category} in slot {slot}"
        raise ValueError(f"{game.name}: there is {where} to edit in this state")
    return game.slices[category].start + (int(np.argmax(valid)) if slot is None else slot)


class _Goal(NamedTuple):
    """The numbers that REM must read."""

    numbers: np.ndarray  # int32 [N, 10]: every number of every slot, see `_numbers`
    wanted: np.ndarray  # bool [N, 10]: numbers to set
    kept: np.ndarray  # bool [N, 10]: numbers that must not change


def _numbers(objects: Objects) -> jax.Array:
    """Join all fields of all slots, int32 `[..., N, 10]`, the fields of `EDITABLE` first."""
    single = (objects.orientation, objects.value, objects.valid)
    parts = (objects.xywh, *(field[..., None] for field in single), objects.rgb)
    return jnp.concatenate([part.astype(jnp.int32) for part in parts], axis=-1)


@functools.partial(jax.jit, static_argnames="game")
def _distances(game: Game, rams: jax.Array, goal: _Goal) -> jax.Array:
    """Distances of REM's numbers of states `[B, 128]` from the wanted numbers, int32 `[B]`."""
    off = jnp.abs(_numbers(game.rem(rams)) - goal.numbers[None])
    near = jnp.sum(jnp.where(goal.wanted[None], off, 0), axis=(1, 2), dtype=jnp.int32)
    return jnp.where(jnp.any((off > 0) & goal.kept[None], axis=(1, 2)), jnp.int32(_FAR), near)


def _goal(game: Game, before: np.ndarray, place: int, wanted: Mapping[str, int]) -> _Goal:
    """Make the goal of an edit. The box of a display may change with its value."""
    goal = _Goal(before.copy(), np.zeros(before.shape, bool), np.ones(before.shape, bool))
    for name, number in wanted.items():
        field = EDITABLE.index(name)
        goal.numbers[place, field] = number
        goal.wanted[place, field] = True
        goal.kept[place, field] = False
    if game.slot_hud[place] and "value" in wanted:
        goal.kept[place, :_BOX] = False
    return goal


def _edited(game: Game, ram: np.ndarray, place: int, wanted: Mapping[str, int]) -> np.ndarray:
    before = np.array(_numbers(game.rem(ram)))
    goal = _goal(game, before, place, wanted)
    fields = game.ram.fields().values()
    addresses = np.unique([a for field in fields for a in field.addresses])
    decimal = np.unique(
        [a for field in fields if field.meaning == "BCD" for a in field.addresses]
    ).astype(int)
    kept = ram[None]
    for _ in range(_MOST_BYTES):
        tried = _one_byte_changed(kept, addresses)
        distance = by_chunks(lambda chunk: _distances(game, chunk, goal), tried, _CHUNK)
        distance[_has_wrong_digits(tried[:, decimal], ram[decimal])] = _FAR
        if not distance.min():
            exact = tried[distance == 0]
            # If a position wraps around, the game itself would have the nearest value.
            return exact[np.argmin(np.abs(exact.astype(int) - ram).sum(axis=1))]
        # Go on with the bytes that matter: a value gives another distance than the value 0.
        by_byte = distance.reshape(len(kept), len(addresses), -1)
        addresses = addresses[((by_byte != by_byte[:, :, :1]) & (by_byte < _FAR)).any(axis=(0, 2))]
        kept = tried[np.argsort(distance, kind="stable")[:_KEPT]]
        if not len(addresses):
            break
    raise ValueError(_refusal(game, before, place, goal, kept[0]))


def _has_wrong_digits(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Mark states, bool `[B]`, with a changed byte, of `[B, n]`, that is no two decimal digits."""
    return (((new & 15 > 9) | (new >> 4 > 9)) & (new != old)).any(axis=1)


def _one_byte_changed(rams: np.ndarray, addresses: np.ndarray) -> np.ndarray:
    """Set each of A bytes to each value: states `[K, 128]` -> `[K * A * 256, 128]`."""
    tried = np.broadcast_to(rams[:, None, None], (len(rams), len(addresses), 256, RAM_SIZE)).copy()
    for i, address in enumerate(addresses):
        tried[:, i, :, address] = np.arange(256)
    return tried.reshape(-1, RAM_SIZE)


def _refusal(game: Game, before: np.ndarray, place: int, goal: _Goal, nearest: np.ndarray) -> str:
    category = game.categories[game.slot_category[place]].name
    at = [k for k in range(len(EDITABLE)) if goal.wanted[place, k]]
    got = np.asarray(_numbers(game.rem(nearest)))[place]

    def text(numbers: np.ndarray) -> str:
        return ", ".join(f"{EDITABLE[k]}={numbers[k]}" for k in at)

    return (
        f"{game.name}: no bytes that REM reads give {category} {text(goal.numbers[place])} and "
        "leave everything else as it is; "
        f"it has {text(before[place])}, and the nearest that was found is {text(got)}"
    )
