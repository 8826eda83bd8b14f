"""`ocjax ram control`: find bytes that remove, freeze or recolour the objects of a category.

Each candidate is tried in the emulator: VEM's objects in play with the writes are compared with
those in plain play.
"""

import contextlib
import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from ocjax.emulators.progress import progress
from ocjax.emulators.variations import Variation
from ocjax.envs import AlePool, Settings
from ocjax.evaluation.tables import Table
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.play import stepping
from ocjax.play.policies import make_policy
from ocjax.ramtools.candidates import ByRem, Control, OnScreen, candidates

__all__ = ["Control", "control", "to_json", "to_table"]

ENVS, STEPS, FRAME_SKIP = 4, 120, 3  # of play; an odd skip covers both phases of flickering objects
MORE_STEPS = 400  # steps of other play that confirms the results
STATES = 32  # states with changed bytes for REM
COLORS = np.arange(0x12, 0x100, 2)  # the possible new colours

# Thresholds of the test on the screen, as fractions of the plain play.
RARE = 0.05  # objects per frame; rarer categories are not tried
GONE = 0.02  # objects that may remain
KEPT = 0.5  # remaining objects of other categories, and of a frozen one
COMMON = 0.2  # objects per frame; rarer categories may come and go
STANDS = 0.2  # an object rests at a position that it has in this fraction of the category's frames
MOVES = 0.5  # moving objects; a category with fewer need not be frozen
FROZEN = 0.05  # moving objects of a frozen category; boxes differ if objects overlap
STILL = 0.01  # moving objects at which the search for a better candidate ends
RECOLORED = 0.95  # of a category's boxes that have a pixel of the colour
ALSO = 0.5  # of another category's boxes: it is also recoloured


class _Play(NamedTuple):
    """Random play, the steps of some instances joined, `[B, ...]`."""

    rams: np.ndarray  # uint8 [B, 128]
    screens: np.ndarray  # uint8 [B, H, 160]
    seen: Objects  # by VEM
    ends: int  # finished games
    seed: int
    steps: int


def control(game: Game, *, seed: int = 0) -> list[Control]:
    """Find the bytes that remove, freeze or recolour a category, each confirmed on the screen.

    Displays, and objects that rarely appear in random play, are not searched.
    """
    plain, other = _play(game, seed), _play(game, seed + ENVS, steps=MORE_STEPS)
    chosen = np.random.default_rng(seed).choice(len(plain.rams), STATES, replace=False)
    color = _rarest_color(plain.screens)
    by_rem, on_screen = ByRem(game, plain.rams[np.sort(chosen)]), OnScreen(game, color, seed=seed)
    tried = [
        c.name
        for c in game.categories
        if not c.hud and _per_frame(game, plain.seen, c.name) >= RARE
    ]
    confirmed: list[Control] = []
    for category in progress(tried, f"{game.name}: trying"):
        for _, same_kind in itertools.groupby(
            candidates(category, by_rem, on_screen, color), key=lambda c: c.kind
        ):
            if found := _best(game, same_kind, plain):
                found = _pruned(game, found, plain)
                if _confirmed(game, found, other):
                    confirmed.append(found)
    return confirmed


def _best(game: Game, tried: Iterable[Control], plain: _Play) -> Control | None:
    """The first confirmed candidate; for freezing, the best one."""
    best: Control | None = None
    for candidate in tried:
        found = _confirmed(game, candidate, plain)
        if found and found.moving <= STILL:
            return found
        if found and (best is None or found.moving < best.moving):
            best = found
    return best


def _rarest_color(screens: np.ndarray) -> int:
    """The palette index, without greys, with the fewest pixels."""
    pixels = np.bincount(np.ravel(screens & 254), minlength=256)
    return int(COLORS[np.argmin(pixels[COLORS])])


def _play(game: Game, seed: int, hook: Variation | None = None, *, steps: int = STEPS) -> _Play:
    settings = Settings(frame_skip=FRAME_SKIP, repeat_action_probability=0)
    with contextlib.closing(
        AlePool(game, ENVS, settings, screens=("screen",), hook=hook, num_workers=0)
    ) as pool:
        act = make_policy("repeat", game, len(pool.actions), ENVS, seed)
        pool.reset([seed + i for i in range(ENVS)])
        rams, screens, ends = [], [], 0
        for _ in zip(range(steps), stepping.steps(pool, act), strict=False):
            rams.append(pool.ram.copy())
            screens.append(pool.screen[:, -1].copy())
            ends += int(pool.terminated.sum())
    frames = np.concatenate(screens)
    return _Play(
        np.concatenate(rams), frames, jax.tree.map(np.asarray, game.vem(frames)), ends, seed, steps
    )


def _per_frame(game: Game, objects: Objects, category: str) -> float:
    return float(objects.valid[:, game.slices[category]].sum(axis=1).mean())


def _confirmed(game: Game, candidate: Control, plain: _Play) -> Control | None:
    """The candidate, if it has the desired effect and the game continues as usual."""
    changed = _play(
        game, plain.seed, Variation(game.name, candidate.kind, candidate.writes), steps=plain.steps
    )
    continues = changed.ends <= 2 * plain.ends + ENVS
    if candidate.kind == "recolor":
        return _recoloring(game, candidate, changed) if continues else None
    if not continues or not all(
        _is_kept(game, c.name, plain, changed)
        for c in game.categories
        if c.name != candidate.category
    ):
        return None
    if candidate.kind == "remove":
        left = _per_frame(game, changed.seen, candidate.category)
        return (
            candidate if left <= GONE * _per_frame(game, plain.seen, candidate.category) else None
        )
    moving = _share_moving(changed, candidate.category)
    frozen = moving <= FROZEN and _share_moving(plain, candidate.category) >= MOVES
    return (
        candidate._replace(moving=moving)
        if frozen and _is_kept(game, candidate.category, plain, changed)
        else None
    )


def _pruned(game: Game, found: Control, plain: _Play) -> Control:
    """Remove bytes that are not needed: first halves of them, then quarters and so on."""
    size = len(found.writes) // 2
    while size:
        addresses = sorted(found.writes)
        for start in range(0, len(addresses), size):
            less = {
                a: v for a, v in found.writes.items() if a not in addresses[start : start + size]
            }
            smaller = _confirmed(game, found._replace(writes=less), plain) if less else None
            if smaller and smaller.moving <= max(found.moving, STILL):
                found = smaller
        size //= 2
    return found


def _is_kept(game: Game, category: str, plain: _Play, changed: _Play) -> bool:
    usual = _per_frame(game, plain.seen, category)
    return usual < COMMON or _per_frame(game, changed.seen, category) >= KEPT * usual


def _share_moving(play: _Play, category: str) -> float:
    """The fraction of a category's detections at rarely occupied positions."""
    objects = play.seen.of(category)
    frames = objects.valid.any(axis=1).sum()
    _, times = np.unique(objects.xywh[objects.valid][:, :2], axis=0, return_counts=True)
    return float(times[times < STANDS * frames].sum() / max(times.sum(), 1))


def _recoloring(game: Game, candidate: Control, changed: _Play) -> Control | None:
    """The candidate, if it recolours its category and only a minority of the others."""
    (color,) = set(candidate.writes.values())
    shares = _shares_of_color(game, changed, color)
    also = tuple(
        name for name, share in shares.items() if share >= ALSO and name != candidate.category
    )
    works = shares.get(candidate.category, 0) >= RECOLORED and len(also) < len(shares) / 2
    return candidate._replace(also=also) if works else None


def _shares_of_color(game: Game, play: _Play, color: int) -> dict[str, float]:
    """The fraction of REM's boxes with a pixel of a colour, by category with any box."""
    objects = jax.tree.map(np.asarray, game.rem(play.rams))
    shares = {}
    for name, slots in game.slices.items():
        frame, slot = np.nonzero(objects.valid[:, slots])
        boxes = zip(play.screens[frame], objects.xywh[:, slots][frame, slot], strict=True)
        has = [
            (screen[y : y + h, x : x + w] & 254 == color).any() for screen, (x, y, w, h) in boxes
        ]
        if has:
            shares[name] = float(np.mean(has))
    return shares


def to_json(found: Iterable[Control]) -> dict[str, dict[str, Any]]:
    """The bytes and the other recoloured categories, by kind and category."""
    records: dict[str, dict[str, Any]] = {}
    for c in found:
        records.setdefault(c.kind, {})[c.category] = {"bytes": c.writes, "also": list(c.also)}
    return records


def to_table(game: Game, found: Sequence[Control]) -> Table:
    """A table of the controls and their bytes."""
    rows: list[list[Any]] = [
        [c.kind, c.category, ", ".join(f"{a}: {v}" for a, v in c.writes.items()), ", ".join(c.also)]
        for c in found
    ]
    return Table(
        f"{game.name}: bytes that control objects",
        ["Change", "Category", "Writes", "Also recolours"],
        rows,
    )
