"""`Game`: a declared game and its two extraction methods."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

from ocjax._xla.fork import require_threads
from ocjax.console import palette
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction import rem, scene, suspicions, vem
from ocjax.extraction.arrays import as_array, require_uint8
from ocjax.extraction.categories import Category, display
from ocjax.extraction.declaration import Declaration, GameError, check_decode
from ocjax.extraction.display import game_html
from ocjax.extraction.objects import Objects

__all__ = ["Category", "Game", "GameError", "display"]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Game(Declaration):
    """A game with its extraction methods, from `ocjax.load`.

    Attributes:
        name: as in Gymnasium's id `ALE/<name>-v5`.
        categories: the categories: name, count (the number of slots), hud, role, attributes, doc.
        slices: the slots of each category by name or alias, as slices.
        slot_category: int `[N]`, the index of each slot's category.
        slot_hud: bool `[N]`, whether each slot belongs to the display.
        num_slots: N.
        screen: (height, width) in pixels.
        rom: ALE's name of the ROM.
        md5: the ROM's MD5 checksum.
        terrain: the kinds of terrain, or None.
    """

    @functools.cached_property
    def _rem(self) -> Callable[[Any], Objects]:
        check_decode(self)
        return rem.extractor(self)

    @functools.cached_property
    def _vem(self) -> Callable[[Any], Objects]:
        return vem.extractor(self)

    @functools.cached_property
    def _terrain_of(self) -> Callable[[Any], scene.Terrain]:
        return scene.from_ram(self)

    @functools.cached_property
    def _terrain_in(self) -> Callable[[Any], scene.Terrain]:
        return scene.from_frames(self, self._vem)

    def rem(self, ram: jax.Array | np.ndarray) -> Objects:
        """Extract objects from RAM; a pure function that works under `jit`, `vmap` and `scan`.

        Args:
            ram: uint8 `[..., 128]`, any batch shape; a JAX or NumPy array, or a PyTorch tensor.

        Raises:
            TypeError: `ram` is not uint8.
            ValueError: its last dimension is not 128.
            RuntimeError: this process was forked from one that had already computed with JAX.
        """
        return self._rem(self._checked_ram(ram))

    def _checked_ram(self, ram: jax.Array | np.ndarray) -> jax.Array | np.ndarray:
        require_threads()
        ram = as_array(ram)
        require_uint8(f"{self.name}: ram", ram)
        if ram.ndim == 0 or ram.shape[-1] != RAM_SIZE:
            raise ValueError(
                f"{self.name}: ram must have shape [..., {RAM_SIZE}], got {list(ram.shape)}"
            )
        return ram

    def vem(self, frames: jax.Array | np.ndarray) -> Objects:
        """Extract objects from pixels; a pure function that works under `jit`, `vmap` and `scan`.

        The first call with a NumPy array warns (UserWarning) if colours are not in the palette, or
        if no object is found.

        Args:
            frames: uint8 `[..., H, 160]` of ALE palette indices (`ale.getScreen()`), or uint8
                `[..., H, 160, 3]` of RGB; a JAX or NumPy array, or a PyTorch tensor. Frames must be
                the emulator's own, without max-pooling, resizing or lossy compression;
                `ocjax.console.palette.check_rgb` checks their colours.

        Raises:
            TypeError: `frames` is not uint8.
            ValueError: the shape differs from the game's screen, or the channels of RGB frames come
                first.
            RuntimeError: this process was forked from one that had already computed with JAX.
        """
        frames = self._checked_frames(frames)
        if isinstance(frames, np.ndarray) and "_checked" not in self.__dict__:
            self.__dict__["_checked"] = True
            return self._checked_vem(frames)
        return self._vem(frames)

    @functools.cached_property
    def vem_overflow(self) -> Callable[[Any], tuple[Objects, Any]]:
        """Apply `vem` to uint8 `[B, H, 160]`, and count the objects without a slot.

        The counts are int32 `[B, categories]`.
        """
        return vem.extractor_with_overflow(self)

    def _checked_frames(self, frames: jax.Array | np.ndarray) -> jax.Array | np.ndarray:
        require_threads()
        frames = as_array(frames)
        require_uint8(f"{self.name}: frames", frames)
        if frames.shape[-2:] != self.screen and frames.shape[-3:] != (*self.screen, 3):
            height, width = self.screen
            raise ValueError(
                f"{self.name}: frames must have shape [..., {height}, {width}] (palette indices) "
                f"or [..., {height}, {width}, 3] (RGB), "
                f"got {list(frames.shape)}"
            )
        if _is_channel_first(frames, self.screen, self.palette):
            raise ValueError(
                f"{self.name}: frames of shape {list(frames.shape)} hold RGB with the channels "
                "first, not palette indices: "
                "move the channels last, with numpy.moveaxis(frames, -3, -1)"
            )
        return frames

    def require_terrain(self) -> None:
        """Check that the game has terrain; raises ValueError."""
        scene.map_of(self)

    def terrain_of(self, ram: jax.Array | np.ndarray) -> scene.Terrain:
        """Return the terrain of states; a pure function that works under `jit` and `vmap`.

        Args:
            ram: see `rem`.

        Returns:
            The terrain, with masks bool `[..., kinds, H, 160]`; the kinds are `game.terrain`.

        Raises:
            TypeError, ValueError: see `rem`; or the game has no terrain.
        """
        return self._terrain_of(self._checked_ram(ram))

    def terrain_in(self, frames: jax.Array | np.ndarray) -> scene.Terrain:
        """Find the terrain in pixels; a pure function that works under `jit` and `vmap`.

        Pixels that objects cover belong to no kind.

        Args:
            frames: see `vem`.

        Returns:
            The terrain, with masks bool `[..., kinds, H, 160]`; the kinds are `game.terrain`.

        Raises:
            TypeError, ValueError: see `vem`; or the game has no terrain.
        """
        return self._terrain_in(self._checked_frames(frames))

    def _checked_vem(self, frames: np.ndarray) -> Objects:
        suspicions.warn_about_colors(frames, self)
        objects = self._vem(frames)
        if not isinstance(objects.valid, Tracer):
            suspicions.warn_about_nothing(np.asarray(objects.valid), self)
        return objects

    def _repr_html_(self) -> str:
        return game_html(self)

    def __repr__(self) -> str:
        return (
            f"Game({self.name}, {self.num_slots} slots: "
            f"{', '.join(f'{c.name} {c.count}' for c in self.categories)})"
        )


def _is_channel_first(
    frames: jax.Array | np.ndarray, screen: tuple[int, int], table: np.ndarray
) -> bool:
    """Test whether the last of the frames is RGB `[3, H, W]`; False inside `jit` and `vmap`.

    Three frames of palette indices, read as red, green and blue, do not give colours of the
    palette.
    """
    if frames.shape[-3:] != (3, *screen) or 0 in frames.shape or isinstance(frames, Tracer):
        return False
    last = np.moveaxis(np.asarray(frames[(-1,) * (frames.ndim - 3)]), 0, -1)
    return bool(last.any() and palette.is_color(last, table).all())
