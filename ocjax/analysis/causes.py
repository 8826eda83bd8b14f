"""`ocjax ram causes`: set every byte to every value in one state, step, and see which pixels and objects change."""

import dataclasses

import jax
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from rich.progress import track

from ocjax.analysis import fits
from ocjax.envs import AlePool, Settings
from ocjax.objects import Objects
from ocjax.report import Cell, Table
from ocjax.spec import Game
from ocjax.vision.palette import NTSC

FIELDS = ("x", "y", "w", "h", "value")


@dataclasses.dataclass(frozen=True)
class Effect:
    """What a byte does to the objects of a category."""

    category: str
    changed: int  # number of values that change the category's objects
    gone: int  # number of values with which all of them are gone
    formulas: dict[str, tuple[int, int, float]]  # field -> scale, offset, share of values with which it is scale * byte + offset


@dataclasses.dataclass(frozen=True)
class Causes:
    """The causal map of one state."""

    game: Game
    screen: np.ndarray  # uint8 [H, 160]: the frame without any change
    ram: np.ndarray  # uint8 [128]: of the state
    pixels: np.ndarray  # float [128, H, 160]: share of the values that change a pixel
    tried: int  # values of each byte
    effective: np.ndarray  # int [128]: number of values that change any pixel
    effects: dict[int, tuple[Effect, ...]]  # address -> what it does


def causes(
    game: Game, *, steps: int = 200, frames: int = 2, seed: int = 0, values: int = 256, num_envs: int = 64, game_mode: int | None = None
) -> Causes:
    """The causal map of the state that random play reaches.

    Args:
        game: whose RAM.
        steps: of random play (4 emulated frames each) before the state is saved.
        frames: emulated frames after each change; at least 2, many games draw what they computed a frame ago.
        seed: of the emulator and the play.
        values: of each byte, 2 to 256, evenly spaced.
        num_envs: instances, all in the same state, that the changes are spread over.
        game_mode: as ale-py numbers it.

    Raises:
        ValueError: an argument out of range.
    """
    if frames < 2 or not 2 <= values <= 256:
        raise ValueError(f"frames must be at least 2 and values 2 to 256, got {frames} and {values}")
    rng = np.random.default_rng(seed)
    tries = np.round(np.linspace(0, 255, values)).astype(np.uint8)
    todo = np.stack(np.meshgrid(np.arange(128), tries, indexing="ij"), axis=-1).reshape(-1, 2)  # (address, value)
    settings = Settings(frame_skip=frames, repeat_action_probability=0)
    pool = AlePool(game, num_envs, settings, screens=("screen",), game_mode=game_mode)
    try:
        pool.reset([seed] * num_envs)
        for _ in range(steps * 4 // frames):
            pool.send(np.full(num_envs, rng.integers(len(pool.actions))))
            pool.wait()
            if pool.terminated.any():
                break
        saved = pool.clone_state()
        state, nothing = pool.ram[0].copy(), np.zeros(num_envs, int)
        pool.restore_state(saved)  # the change to compare with is none, after the same restoring
        pool.send(nothing)
        pool.wait()
        screen = pool.screen[0, 1].copy()
        plain = jax.tree.map(np.asarray, game.vem(screen))
        out: list[np.ndarray] = []
        boxes, valid, value = [], [], []
        for start in track(range(0, len(todo), num_envs), description=f"changing {game.name}'s RAM", transient=True):
            part = todo[start : start + num_envs]
            rams = np.repeat(state[None], num_envs, axis=0)
            rams[np.arange(len(part)), part[:, 0]] = part[:, 1]
            pool.restore_state(saved)
            pool.set_ram(rams)
            pool.send(nothing)
            pool.wait()
            shown = pool.screen[:, 1].copy()
            seen = jax.tree.map(np.asarray, game.vem(shown))
            n = len(part)
            out.append(shown[:n] != screen)
            boxes.append(seen.xywh[:n].astype(int))
            valid.append(seen.valid[:n])
            value.append(seen.value[:n])
    finally:
        pool.close()
    differs = np.concatenate(out).reshape(128, len(tries), *game.screen)
    xywh, there, worth = (np.concatenate(a).reshape(128, len(tries), *a[0].shape[1:]) for a in (boxes, valid, value))
    effects = {}
    for address in range(128):
        seen = xywh[address], there[address], worth[address]
        found = [_effect(game, i, tries.astype(int), *seen, plain) for i in range(len(game.categories))]
        effects[address] = tuple(e for e in found if e is not None)
    return Causes(game, screen, state, differs.mean(axis=1), len(tries), differs.any(axis=(2, 3)).sum(axis=1), effects)


def _effect(
    game: Game, index: int, tries: np.ndarray, xywh: np.ndarray, valid: np.ndarray, value: np.ndarray, plain: Objects
) -> Effect | None:
    """What the values of one byte do to one category."""
    c = game.categories[index]
    s = game.slices[c.name]
    there_before, value_before, old = np.asarray(plain.valid)[s], np.asarray(plain.value)[s], np.asarray(plain.xywh)[s].astype(int)
    xywh, valid, value = xywh[:, s], valid[:, s], value[:, s]
    changed = (valid != there_before).any(axis=1)
    changed |= (valid[..., None] & (xywh != old)).any(axis=(1, 2)) | (valid & (value != value_before)).any(axis=1)
    if changed.sum() < 2:
        return None
    formulas = {}
    numbers = np.concatenate([xywh, value[..., None]], axis=-1)  # [tries, slots, 5]
    was = {tuple(b) for b, v in zip(old.tolist(), there_before, strict=True) if v}
    for i, field in enumerate(FIELDS):
        # the one object that is not where any was, or the only one that there is
        moved = np.array([[tuple(b[:4]) not in was for b in row] for row in numbers.tolist()]) & valid
        pick = moved if i < 4 and c.count > 1 else valid
        one = pick.sum(axis=1) == 1
        if one.sum() < 8:
            continue
        t = numbers[one, pick[one].argmax(axis=1), i] % 256
        if len(np.unique(t)) < 4:
            continue
        options = []
        for scale in fits.SCALES:
            rest = (t - scale * tries[one]) % 256
            counts = np.bincount(rest, minlength=256)
            options.append((counts.max() / len(t), -abs(scale), scale, (int(counts.argmax()) + 128) % 256 - 128))
        share, _, scale, offset = max(options)
        formulas[field] = (scale, offset, float(share))
    gone = int((there_before.any() & ~valid.any(axis=1)).sum())
    return Effect(c.name, int(changed.sum()), gone, formulas)


def _words(e: Effect) -> str:
    parts = []
    for field, (scale, offset, share) in e.formulas.items():
        if share > 0.2:
            times = {1: "", -1: "-"}.get(scale, f"{scale} * ")
            parts.append(f"{field} = {times}byte {'-' if offset < 0 else '+'} {abs(offset)} ({100 * share:.0f} %)")
        else:
            parts.append(f"{field} changes")
    if e.gone:
        parts.append(f"gone with {e.gone} values")
    return f"{e.category}: " + (", ".join(parts) or f"changes with {e.changed} values")


def to_table(c: Causes) -> Table:
    """The bytes that change anything on the screen."""
    rows: list[list[Cell]] = []
    for address in np.flatnonzero(c.effective):
        what = "; ".join(map(_words, c.effects[int(address)])) or "pixels of no object"
        rows.append([int(address), int(c.ram[address]), int(c.effective[address]), int((c.pixels[address] > 0).sum()), what])
    return Table(
        f"{c.game.name}: what each byte changes on the screen, of {c.tried} values",
        ["Byte", "Value", "Values with an effect", "Pixels", "Objects"],
        rows,
    )


def picture(c: Causes) -> Image.Image:
    """A map of the bytes that change anything: the screen, dim, and in red the pixels that a byte changes, brighter with more values."""
    addresses = np.flatnonzero(c.effective).tolist() or [0]
    across, width, height, margin = min(6, len(addresses)), 288, c.screen.shape[0] * 9 // 10, 18
    font = ImageFont.load_default(size=13)
    out = Image.new("RGB", (across * (width + 4), -(-len(addresses) // across) * (height + margin + 4)), (24, 24, 24))
    draw = ImageDraw.Draw(out)
    dim = NTSC[c.screen].astype(float) * 0.4
    for i, address in enumerate(addresses):
        x, y = i % across * (width + 4) + 2, i // across * (height + margin + 4)
        share = c.pixels[address][..., None]
        heat = np.where(share > 0, 0.4 + 0.6 * np.sqrt(share), 0)
        tile = (dim * (1 - heat) + heat * np.array((255, 60, 40))).astype(np.uint8)
        draw.text((x, y), f"byte {address}: {c.effective[address]} of {c.tried} values", font=font, fill=(255, 255, 255))
        out.paste(Image.fromarray(tile).resize((width, height), Image.Resampling.BOX), (x, y + margin))
    return out
