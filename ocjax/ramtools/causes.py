"""`ocjax ram causes`: the pixels and objects that each byte changes."""

import contextlib
import dataclasses
from collections.abc import Iterator

import jax
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ocjax.console.ram import RAM_SIZE
from ocjax.emulators.progress import progress
from ocjax.envs import AlePool, Settings, States
from ocjax.evaluation.tables import Cell, Table
from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.ramtools import fits
from ocjax.vision.unknown import UNKNOWN_VALUE

FIELDS = ("x", "y", "w", "h", "value")  # in the order of `_numbers`
BOX, VALUE = slice(0, 4), 4  # indices of `FIELDS`
FRAME_SKIP = 4  # emulated frames per agent step of the play that leads to the state
BEFORE_END = 240  # emulated frames from a state to the end of its game, if play reaches the end
LEAST_CHANGES = 2  # values that must change a category's objects for an effect to be reported
LEAST_SAMPLES, LEAST_VALUES = 8, 4  # values of the byte and of the field that a fit needs
SHARE_SHOWN = 0.2  # formulas that are right for fewer values are not printed

ACROSS, TILE_WIDTH, TITLE_HEIGHT, GAP, FONT_SIZE = 6, 288, 18, 4, 13  # of the picture, in pixels
HEAT, LEAST_HEAT = (255, 60, 40), 0.4


@dataclasses.dataclass(frozen=True)
class Formula:
    """A field as `scale * byte + offset` (mod 256), and the fraction of values that fit."""

    scale: int
    offset: int
    share: float


@dataclasses.dataclass(frozen=True)
class Effect:
    """The effect of a byte on the objects of a category.

    Args:
        changed: number of values that change them.
        gone: number of values that remove all of them.
        formulas: by field, how the byte determines it.
    """

    category: str
    changed: int
    gone: int
    formulas: dict[str, Formula]


@dataclasses.dataclass(frozen=True)
class Causes:
    """The causal map of one state.

    Args:
        screen: uint8 `[H, 160]`, the frame without a change.
        ram: uint8 `[128]` of the state.
        played: emulated frames from the reset to the state.
        shortened: whether the game ended before the wanted state.
        pixels: float `[128, H, 160]`, fraction of each byte's values that change a pixel.
        tried: number of values of each byte.
        effective: int `[128]`, number of each byte's values that change any pixel.
        effects: by address.
    """

    game: Game
    screen: np.ndarray
    ram: np.ndarray
    played: int
    shortened: bool
    pixels: np.ndarray
    tried: int
    effective: np.ndarray
    effects: dict[int, tuple[Effect, ...]]


# -----------------------------------------------------------------------------------------------
# experiments


def causes(
    game: Game,
    *,
    steps: int = 200,
    frames: int = 2,
    seed: int = 0,
    values: int = 256,
    num_envs: int = 64,
    game_mode: int | None = None,
) -> Causes:
    """The causal map of a state that random play reaches.

    If the game ends earlier, the state is shortly before its end.

    Args:
        steps: agent steps (of 4 emulated frames) before the state.
        frames: emulated frames after each change, at least 2: many games draw objects computed one
            frame ago.
        values: number of values of each byte, 2 to 256, evenly spaced.
        num_envs: number of instances that share the changes.
        game_mode: see `ocjax.make_vec`.
    """
    if frames < 2 or not 2 <= values <= 256:
        raise ValueError(
            f"frames must be at least 2 and values 2 to 256, got {frames} and {values}"
        )
    tried = np.round(np.linspace(0, 255, values)).astype(np.uint8)
    settings = Settings(frame_skip=frames, repeat_action_probability=0)
    with contextlib.closing(
        AlePool(game, num_envs, settings, screens=("screen",), game_mode=game_mode)
    ) as pool:
        wanted = steps * FRAME_SKIP // frames
        played = play_alike(pool, seed, wanted)
        state, saved = pool.ram[0].copy(), pool.clone_state()
        screen, before = after_steps(pool, saved)
        changed, found = _change_every_byte(pool, saved, tried, screen)
    effects = {}
    for address in range(128):
        after = jax.tree.map(lambda a, address=address: a[address], found)
        effects[address] = tuple(
            e for c in game.categories if (e := _effect(game, c, tried.astype(int), after, before))
        )
    return Causes(
        game,
        screen,
        state,
        played * frames,
        played < wanted,
        changed.mean(axis=1),
        len(tried),
        changed.any(axis=(2, 3)).sum(axis=1),
        effects,
    )


def play_alike(pool: AlePool, seed: int, steps: int) -> int:
    """Play the same random actions in all instances; return the number of steps to the state.

    If the game ends during `steps`, the state is `BEFORE_END` frames before its end, or in its
    middle.
    """
    played = _play(pool, seed, steps)
    if not pool.terminated.any():
        return played
    assert isinstance(pool.settings.frame_skip, int)
    return _play(pool, seed, max(played - BEFORE_END // pool.settings.frame_skip, played // 2))


def _play(pool: AlePool, seed: int, steps: int) -> int:
    """Play until the game or `steps` end. Returns the number of steps."""
    rng = np.random.default_rng(seed)
    pool.reset([seed] * pool.num_envs)
    for played in range(1, steps + 1):
        pool.step(np.full(pool.num_envs, rng.integers(len(pool.actions))))
        if pool.terminated.any():
            return played
    return steps


def after_steps(pool: AlePool, saved: States, times: int = 1) -> tuple[np.ndarray, Objects]:
    """The frame and VEM's objects after a restored state and steps without a change."""
    pool.restore_state(saved)
    for _ in range(times):
        pool.step(np.zeros(pool.num_envs, int))
    screen = pool.screen[0, 1].copy()
    return screen, jax.tree.map(np.asarray, pool.game.vem(screen))


def _change_every_byte(
    pool: AlePool, saved: States, tried: np.ndarray, screen: np.ndarray
) -> tuple[np.ndarray, Objects]:
    """Try all values of all bytes.

    Returns:
        The changed pixels, bool `[128, values, H, 160]`, and VEM's objects, batch shape `[128,
        values]`.
    """
    game, changed, found = pool.game, [], []
    for frames in frames_after_writes(pool, saved, tried):
        changed.append(frames != screen)
        found.append(jax.tree.map(np.asarray, game.vem(frames)))
    return np.stack(changed), jax.tree.map(lambda *a: np.stack(a), *found)


def frames_after_writes(
    pool: AlePool, saved: States, tried: np.ndarray, *, times: int = 1
) -> Iterator[np.ndarray]:
    """Set each byte of a state to each value, and step the emulators.

    Args:
        tried: uint8 `[values]`.
        times: number of steps; the byte is set before each.

    Yields:
        For each address the frames, uint8 `[values, H, 160]`.
    """
    experiments = [(address, value) for address in range(RAM_SIZE) for value in tried]
    frames: list[np.ndarray] = []
    batches = range(0, len(experiments), pool.num_envs)
    for start in progress(batches, f"changing {pool.game.name}'s RAM"):
        part = experiments[start : start + pool.num_envs]
        pool.restore_state(saved)
        for _ in range(times):
            rams = pool.ram.copy()
            rams[np.arange(len(part)), [a for a, _ in part]] = [v for _, v in part]
            pool.set_ram(rams)
            pool.step(np.zeros(pool.num_envs, int))
        frames.extend(pool.screen[: len(part), 1].copy())
        while len(frames) >= len(tried):
            yield np.stack(frames[: len(tried)])
            del frames[: len(tried)]


# -----------------------------------------------------------------------------------------------
# effects


def _effect(
    game: Game, category: Category, tried: np.ndarray, after: Objects, before: Objects
) -> Effect | None:
    """The effect of one byte's values on one category.

    Args:
        tried: int `[values]`.
        after: the objects with each value, batch shape `[values]`.
        before: the objects without a change.
    """
    s = game.slices[category.name]
    # [slots, fields] and [values, slots, fields]
    old, new = (_numbers(objects)[..., s, :] for objects in (before, after))
    old_valid, valid = np.asarray(before.valid)[s], np.asarray(after.valid)[:, s]
    differs = (valid != old_valid) | (valid & (new != old).any(axis=-1))
    changed = differs.any(axis=1)
    if changed.sum() < LEAST_CHANGES:
        return None
    was = {tuple(box) for box in old[old_valid, BOX].tolist()}
    moved = valid & np.array([[tuple(b) not in was for b in row] for row in new[..., BOX].tolist()])
    known = valid & (new[..., VALUE] != UNKNOWN_VALUE)
    formulas = {}
    for i, field in enumerate(FIELDS):
        # The object at a new position, or the only object.
        of_box = moved if category.count > 1 else valid
        candidates = known if i == VALUE else of_box
        formula = _formula(new[..., i], candidates, tried)
        if formula is not None:
            formulas[field] = formula
    gone = int((old_valid.any() & ~valid.any(axis=1)).sum())
    return Effect(category.name, int(changed.sum()), gone, formulas)


def _numbers(objects: Objects) -> np.ndarray:
    """The numbers of `FIELDS`, int `[..., slots, 5]`."""
    value = np.asarray(objects.value)[..., None]
    return np.concatenate([np.asarray(objects.xywh), value], axis=-1).astype(int)


def _formula(numbers: np.ndarray, candidates: np.ndarray, tried: np.ndarray) -> Formula | None:
    """The best formula for a field, over the values with exactly one candidate.

    Args:
        numbers, candidates: int and bool `[values, slots]`.
        tried: int `[values]`.
    """
    one = candidates.sum(axis=1) == 1
    if one.sum() < LEAST_SAMPLES:
        return None
    target = numbers[one, candidates[one].argmax(axis=1)] % 256
    if len(np.unique(target)) < LEAST_VALUES:
        return None
    options = []
    for scale in fits.SCALES:
        counts = np.bincount((target - scale * tried[one]) % 256, minlength=256)
        offset = (int(counts.argmax()) + 128) % 256 - 128
        options.append((counts.max() / len(target), -abs(scale), scale, offset))
    share, _, scale, offset = max(options)
    return Formula(scale, offset, float(share))


# -----------------------------------------------------------------------------------------------
# output


def _words(e: Effect) -> str:
    parts = []
    for field, f in e.formulas.items():
        if f.share > SHARE_SHOWN:
            parts.append(
                f"{field} = {fits.affine_text('byte', f.scale, f.offset)} ({100 * f.share:.0f} %)"
            )
        else:
            parts.append(f"{field} changes")
    if e.gone:
        parts.append(f"gone with {e.gone} values")
    return f"{e.category}: " + (", ".join(parts) or f"changes with {e.changed} values")


def notes(c: Causes) -> list[str]:
    """Sentences about the choice of the state, and the reason of an empty result."""
    out = []
    if c.shortened:
        out.append(
            f"Random play ends the game early, so the state is {c.played:,} frames after the reset."
        )
    if not c.effective.any():
        out.append(
            f"No byte changes the picture, {c.tried} values tried. The game may wait between two "
            "screens, or draw changes later. Try other --steps, another --seed, or more --frames."
        )
    return out


def to_table(c: Causes) -> Table:
    """A table of the bytes that change anything on the screen."""
    rows: list[list[Cell]] = []
    for address in np.flatnonzero(c.effective).tolist():
        objects = "; ".join(map(_words, c.effects[address])) or "pixels of no object"
        pixels = int((c.pixels[address] > 0).sum())
        rows.append([address, int(c.ram[address]), int(c.effective[address]), pixels, objects])
    title = (
        f"{c.game.name}, {c.played:,} frames after the reset: effects of each byte on the screen, "
        f"{c.tried} values tried"
    )
    return Table(title, ["Byte", "Value", "Values with an effect", "Pixels", "Objects"], rows)


def picture(c: Causes) -> Image.Image:
    """The dimmed screen for each byte, with the pixels that many values change in bright red."""
    addresses = np.flatnonzero(c.effective).tolist() or [0]
    across, height = min(ACROSS, len(addresses)), c.screen.shape[0] * 9 // 10
    font = ImageFont.load_default(size=FONT_SIZE)
    size = across * (TILE_WIDTH + GAP), -(-len(addresses) // across) * (height + TITLE_HEIGHT + GAP)
    out = Image.new("RGB", size, (24, 24, 24))
    draw = ImageDraw.Draw(out)
    dim = c.game.palette[c.screen].astype(float) * 0.4
    for i, address in enumerate(addresses):
        x = i % across * (TILE_WIDTH + GAP) + GAP // 2
        y = i // across * (height + TITLE_HEIGHT + GAP)
        share = c.pixels[address][..., None]
        heat = np.where(share > 0, LEAST_HEAT + (1 - LEAST_HEAT) * np.sqrt(share), 0)
        tile = (dim * (1 - heat) + heat * np.array(HEAT)).astype(np.uint8)
        title = f"byte {address}: {c.effective[address]} of {c.tried} values"
        draw.text((x, y), title, font=font, fill=(255, 255, 255))
        small = Image.fromarray(tile).resize((TILE_WIDTH, height), Image.Resampling.BOX)
        out.paste(small, (x, y + TITLE_HEIGHT))
    return out
