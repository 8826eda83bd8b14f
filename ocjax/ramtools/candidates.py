"""Candidates for `ocjax ram control`, suggested by REM and by the screen."""

import contextlib
import functools
import itertools
from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.ram import RAM_SIZE
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.ramtools.causes import after_steps, frames_after_writes, play_alike

__all__ = ["ByRem", "Control", "OnScreen", "candidates"]

NEAR = 4  # pixels; overlapping objects change each other's boxes by a few pixels
MOST_BYTES = 12  # bytes written to remove a category, at most
CHOICES = 3  # tried values that remove a category equally well
POSITIONS = 32  # a position byte moves an object with at least this number of values
PLACES = 2  # states to freeze a category in

STEPS = (480, 1000)  # frames of random play before each written state
VALUES = np.arange(8, 256, 16, dtype=np.uint8)  # written values; a colour is added
FRAMES = 2  # frames, each after a write; many games draw objects computed a frame ago
LEAST = 4  # values that must change a category if the byte belongs to it
INSTANCES = 32  # emulators that share the work
FOREIGN = 0.1  # fraction of the values of such a byte that may change another category


class Control(NamedTuple):
    """Bytes that control a category, or may control it before they are confirmed.

    Args:
        kind: "remove", "freeze" or "recolor".
        writes: the values to write before every emulated frame, by address; for "recolor" a palette
            index.
        also: other categories that are recoloured.
        moving: the fraction of a frozen category's objects that still move.
    """

    kind: str
    category: str
    writes: dict[int, int]
    also: tuple[str, ...] = ()
    moving: float = 0.0


def candidates(
    category: str, by_rem: "ByRem", on_screen: "OnScreen", color: int
) -> Iterator[Control]:
    """Candidates for a category, the more likely ones of each kind first."""
    for choice in range(CHOICES):
        if writes := by_rem.removal(category, choice):
            yield Control("remove", category, writes)
    for writes in itertools.islice(on_screen.removals(category), CHOICES):
        yield Control("remove", category, writes)
    read, seen = by_rem.own(category), on_screen.own(category)
    for own in dict.fromkeys(sorted((seen, read, read | seen), key=len)):
        for ram in by_rem.fullest(category) if own else ():
            yield Control("freeze", category, {a: int(ram[a]) for a in sorted(own)})
    for own in dict.fromkeys((by_rem.colors(category, color), on_screen.colors(category))):
        if own:
            yield Control("recolor", category, dict.fromkeys(sorted(own), color))


# -----------------------------------------------------------------------------------------------
# REM


class _Read(NamedTuple):
    """The fields that REM reads, zeros for empty slots."""

    boxes: jax.Array  # int32 [..., N, 4]
    others: jax.Array  # int32 [..., N, 3]: orientation, value, valid
    colors: jax.Array  # int32 [..., N, 3]

    @property
    def valid(self) -> jax.Array:
        return self.others[..., 2]


class _Effects(NamedTuple):
    """The effects of the 256 values of a byte on a category in some states, `[256]` each."""

    left: jax.Array  # int32: number of remaining objects
    added: jax.Array  # bool: an empty slot gets an object
    moved: jax.Array  # bool: x or y of an object changes
    changed: jax.Array  # bool: anything except colours changes
    colored: jax.Array  # bool: a colour changes
    foreign: jax.Array  # bool: another category changes, except for colours and a few pixels


@functools.partial(jax.jit, static_argnames="game")
def _read(game: Game, rams: jax.Array) -> _Read:
    objects = game.rem(rams)
    valid = objects.valid[..., None]
    others = jnp.stack(
        [f.astype(jnp.int32) for f in (objects.orientation, objects.value, objects.valid)], axis=-1
    )
    return jax.tree.map(
        lambda field: jnp.where(valid, field.astype(jnp.int32), 0),
        _Read(objects.xywh, others, objects.rgb),
    )


@functools.partial(jax.jit, static_argnames="game")
def _effects(
    game: Game, rams: jax.Array, before: _Read, slots: jax.Array, address: jax.Array
) -> _Effects:
    """Compare the slots `[N]` of states `[S, 128]` before and after writes to a byte."""
    tried = (
        jnp.broadcast_to(rams[:, None], (len(rams), 256, RAM_SIZE))
        .at[:, :, address]
        .set(jnp.arange(256, dtype=jnp.uint8))
    )
    after, before = _read(game, tried), jax.tree.map(lambda field: field[:, None], before)
    slots = slots[None, None]
    stays = ((after.valid > 0) & (before.valid > 0))[..., None]
    shift = jnp.abs(after.boxes - before.boxes)
    changed = jnp.any(after.others != before.others, axis=-1)

    def seen(where: jax.Array) -> jax.Array:
        return jnp.any(where & slots, axis=(0, 2))

    far = jnp.any(stays & (shift > NEAR), axis=-1)
    return _Effects(
        left=jnp.sum(jnp.where(slots, after.valid, 0), axis=(0, 2), dtype=jnp.int32),
        added=seen(after.valid > before.valid),
        moved=seen(jnp.any(shift[..., :2] > 0, axis=-1)),
        changed=seen(changed | jnp.any(shift > 0, axis=-1)),
        colored=seen(jnp.any(stays & (after.colors != before.colors), axis=-1)),
        foreign=jnp.any((changed | far) & ~slots, axis=(0, 2)),
    )


class ByRem:
    """The effects of bytes by REM, in states of play `rams`, uint8 `[S, 128]`."""

    def __init__(self, game: Game, rams: np.ndarray) -> None:
        self.game, self.rams = game, rams
        self.addresses = sorted(
            {a for field in game.ram.fields().values() for a in field.addresses}
        )
        self.before = _read(game, rams)
        self.valid = np.asarray(self.before.valid) > 0

    def _slots(self, category: str) -> np.ndarray:
        slots = np.zeros(self.valid.shape[1], bool)
        slots[self.game.slices[category]] = True
        return slots

    @functools.cache  # noqa: B019  # an instance lives as long as the search in its game
    def _all_effects(self, category: str) -> dict[int, _Effects]:
        return {a: self._effects(self.rams, category, a) for a in self.addresses}

    def _effects(self, rams: np.ndarray, category: str, address: int) -> _Effects:
        return jax.tree.map(
            np.asarray,
            _effects(self.game, rams, self.before, self._slots(category), np.int32(address)),
        )

    def removal(self, category: str, choice: int) -> dict[int, int]:
        """Search greedily for bytes that remove all objects of a category; empty on failure."""
        rams, writes, left = self.rams.copy(), {}, int(self.valid[:, self._slots(category)].sum())
        while left and len(writes) < MOST_BYTES:
            fewest, address, value = min(
                self._fewest(rams, category, a, choice) for a in self.addresses if a not in writes
            )
            if fewest >= left:
                return {}
            left, writes[address], rams[:, address] = fewest, value, value
        return {} if left else writes

    def _fewest(
        self, rams: np.ndarray, category: str, address: int, choice: int
    ) -> tuple[int, int, int]:
        """The fewest objects that a byte's values leave, the address, and the chosen value.

        Choice 0 is the best value that is most frequent in play, the others are evenly spaced best
        values.
        """
        effects = self._effects(rams, category, address)
        left = np.where(effects.added | effects.foreign, np.iinfo(np.int32).max, effects.left)
        best = np.flatnonzero(left == left.min())
        if choice == 0:
            times = np.bincount(self.rams[:, address], minlength=256)[best]
            value = best[np.argmax(times)]
        else:
            value = best[(len(best) - 1) * (choice - 1) // max(CHOICES - 2, 1)]
        return int(left.min()), address, int(value)

    def own(self, category: str) -> frozenset[int]:
        """The bytes that move only this category."""
        effects = self._all_effects(category).items()
        return frozenset(
            a
            for a, e in effects
            if (e.moved & ~e.foreign).sum() >= POSITIONS and e.foreign.mean() <= FOREIGN
        )

    def colors(self, category: str, color: int) -> frozenset[int]:
        """The bytes that hold all of the category's colours; empty if a colour is elsewhere."""
        own = [
            a
            for a, e in self._all_effects(category).items()
            if e.colored.any() and not (e.changed | e.foreign).any()
        ]
        rams = self.rams.copy()
        rams[:, own] = color
        has_color = (np.asarray(_read(self.game, rams).colors) == self.game.palette[color]).all(-1)
        objects = self.valid & self._slots(category)
        return frozenset(own if has_color[objects].all() else ())

    def fullest(self, category: str) -> np.ndarray:
        """States with many objects of a category, uint8 `[PLACES, 128]`."""
        count = self.valid[:, self._slots(category)].sum(axis=1)
        return self.rams[np.argsort(-count, kind="stable")[:PLACES]]


# -----------------------------------------------------------------------------------------------
# screen


class _State(NamedTuple):
    """A state, and the effects of writes on its screen; C categories."""

    present: np.ndarray  # bool [C]
    changed: np.ndarray  # bool [128, values, C]: a category changes
    gone: np.ndarray  # bool [128, values, C]: all of its objects disappear
    colored: np.ndarray  # float [128, C]: fraction of its objects that get the written colour


class OnScreen:
    """The effects of bytes by the screen.

    Args:
        color: a palette index that the screen does not have in play.
        seed: of the play that leads to the states.
    """

    def __init__(self, game: Game, color: int, *, seed: int = 0) -> None:
        self.names = [category.name for category in game.categories]
        # display objects do not count
        self.counts = np.array([not category.hud for category in game.categories])
        settings = Settings(frame_skip=1, repeat_action_probability=0)
        with contextlib.closing(AlePool(game, INSTANCES, settings, screens=("screen",))) as pool:
            self.states = [_state(pool, color, seed + i, steps) for i, steps in enumerate(STEPS)]

    def _foreign(self, state: _State, c: int) -> np.ndarray:
        """True if other categories change, bool `[128, values]`."""
        return (state.changed & self.counts & (np.arange(len(self.names)) != c)).any(axis=-1)

    def removals(self, category: str) -> Iterator[dict[int, int]]:
        """Single bytes that remove all objects of a category."""
        c = self.names.index(category)
        states = [state for state in self.states if state.present[c]]
        if states:
            works = np.all(
                [state.gone[..., c] & ~self._foreign(state, c) for state in states], axis=0
            )
            for address, i in np.argwhere(works):
                yield {int(address): int(VALUES[i])}

    def own(self, category: str) -> frozenset[int]:
        """The bytes that change only this category."""
        c, found = self.names.index(category), []
        for state in self.states:
            if state.present[c]:
                foreign = (self._foreign(state, c) & state.changed[..., c]).sum(axis=1)
                count = state.changed[..., c].sum(axis=1)
                found.append((count >= LEAST) & (foreign <= FOREIGN * count))
        return frozenset(np.flatnonzero(np.all(found, axis=0)).tolist() if found else ())

    def colors(self, category: str) -> frozenset[int]:
        """The bytes that colour all objects of the category."""
        c = self.names.index(category)
        shares = [state.colored[:, c] for state in self.states if state.present[c]]
        return frozenset(np.flatnonzero(np.min(shares, axis=0) == 1).tolist() if shares else ())


def _state(pool: AlePool, color: int, seed: int, steps: int) -> _State:
    """Play to a state, and write its bytes."""
    play_alike(pool, seed, steps)
    saved, game = pool.clone_state(), pool.game
    _, before = after_steps(pool, saved, FRAMES)
    by_category = functools.partial(_any_of_each, game)
    changed, gone, colored = [], [], []
    for *others, last in frames_after_writes(
        pool, saved, np.append(VALUES, np.uint8(color)), times=FRAMES
    ):
        frames = np.stack(others)
        after = jax.tree.map(np.asarray, game.vem(frames))
        changed.append(by_category(_moved(before, after)))
        gone.append(by_category(before.valid) & ~by_category(after.valid))
        colored.append(_shares(game, before, last & 254 == color))
    return _State(by_category(before.valid), np.stack(changed), np.stack(gone), np.stack(colored))


def _moved(before: Objects, after: Objects) -> np.ndarray:
    """Mark slots that differ by more than a few pixels, bool `[..., N]`."""
    far = (np.abs(after.xywh.astype(int) - before.xywh) > NEAR).any(axis=-1)
    return np.asarray((after.valid != before.valid) | (after.valid & far))


def _any_of_each(game: Game, slots: np.ndarray | jax.Array) -> np.ndarray:
    """Reduce slots `[..., N]` to categories `[..., C]` by "any"."""
    marked = np.asarray(slots)
    return np.stack([marked[..., where].any(axis=-1) for where in game.slices.values()], axis=-1)


def _shares(game: Game, objects: Objects, pixels: np.ndarray) -> np.ndarray:
    """The fraction of each category's objects with a pixel of `[H, 160]`, float `[C]`; else 0."""
    has = np.array([pixels[y : y + h, x : x + w].any() for x, y, w, h in objects.xywh])
    return np.array(
        [
            (has & objects.valid)[s].sum() / max(objects.valid[s].sum(), 1)
            for s in game.slices.values()
        ]
    )
