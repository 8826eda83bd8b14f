"""Terrain of states and frames: compiles a game's `TerrainMap` to functions of a batch."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla import batches, kernels
from ocjax.console import palette
from ocjax.console.boxes import WIDTH
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects
from ocjax.extraction.ownership import NOBODY, owners_of
from ocjax.extraction.saver import restored
from ocjax.extraction.terrain import COVERED, Masks, TerrainKind, TerrainMap
from ocjax.vision.colors import EVEN

__all__ = ["Terrain", "from_frames", "from_ram", "map_of"]

CHUNK = 16  # states whose masks fit in the cache


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, repr=False)
class Terrain:
    """The terrain of one state or of a batch of states.

    `kinds` are `game.terrain`, and `...` is any batch shape.
    """

    # int32 [...]: index into `layouts`; None for terrain that was found in pixels, or that changes
    layout: jax.Array | None
    changed: Any  # bool [..., kinds, H, 160] if `layout` is None, else None
    game: Declaration = dataclasses.field(metadata={"static": True})

    @property
    def kinds(self) -> tuple[TerrainKind, ...]:
        """The kinds of terrain."""
        return tuple(self.game.terrain or ())

    @property
    def layouts(self) -> np.ndarray:
        """The layouts that the ROM holds, bool `[layouts, kinds, H, 160]`."""
        return map_of(self.game).layouts

    @property
    def masks(self) -> jax.Array:
        """The pixels of each kind, bool `[..., kinds, H, 160]`."""
        if self.layout is None:
            return self.changed
        return jnp.asarray(self.layouts)[self.layout]

    def of(self, name: str) -> jax.Array:
        """Return the pixels of a kind, bool `[..., H, 160]`; raises KeyError."""
        names = map_of(self.game).names
        if name not in names:
            raise KeyError(f"{self.game.name} has the kinds {', '.join(names)}, got {name!r}")
        return self.masks[..., names.index(name), :, :]

    def grid(self, cell: tuple[int, int] = (8, 8)) -> jax.Array:
        """Return which cells of a grid contain each kind, bool `[..., kinds, rows, columns]`.

        Args:
            cell: height and width of a cell in pixels. Cells at the lower and right edge may be
                smaller.

        Raises:
            ValueError: a cell is smaller than one pixel.
        """
        if min(cell) < 1:
            raise ValueError(f"a cell must have at least one pixel, got {cell}")
        return _in_cells(self.masks, cell)

    def to_logic(self, cell: tuple[int, int] = (8, 8)) -> Any:
        """Convert the cells of `grid` to ground atoms of Prolog and Datalog, without final periods.

        The atoms are `terrain(kind,row,column)`, with kinds as constants such as `wall`.

        Returns:
            A list of strings for one state; nested lists for a batch.
        """
        return _atoms(np.asarray(self.grid(cell)), [kind.name for kind in self.kinds])

    def __repr__(self) -> str:
        shape = jnp.shape(self.changed)[:-3] if self.layout is None else jnp.shape(self.layout)
        names = ", ".join(kind.name for kind in self.kinds)
        return f"Terrain({self.game.name}, batch {list(shape)}, {names})"


def _atoms(cells: np.ndarray, names: Sequence[str]) -> Any:
    if cells.ndim > 3:
        return [_atoms(part, names) for part in cells]
    return [f"terrain({names[kind]},{row},{column})" for kind, row, column in np.argwhere(cells)]


def _in_cells(masks: jax.Array, cell: tuple[int, int]) -> jax.Array:
    """Whether cells contain a pixel, bool `[..., rows, columns]` from `[..., H, W]`."""
    *batch, height, width = masks.shape
    rows, columns = -(-height // cell[0]), -(-width // cell[1])
    margin = ((0, 0),) * len(batch)
    filling = ((0, rows * cell[0] - height), (0, columns * cell[1] - width))
    whole = jnp.pad(masks, (*margin, *filling))
    return whole.reshape(*batch, rows, cell[0], columns, cell[1]).any((-3, -1))


def map_of(game: Declaration) -> TerrainMap:
    """Return the game's declaration of terrain; raises ValueError without one."""
    if game.terrain_map is None:
        raise ValueError(f"{game.name} has no terrain: game.terrain is None")
    return game.terrain_map


def from_ram(game: Declaration) -> Callable[[jax.Array | np.ndarray], Terrain]:
    """Compile the game's terrain from RAM: uint8 `[..., 128]` -> `Terrain`.

    Raises:
        ValueError: the game has no terrain.
    """
    terrain = map_of(game)
    index, change = terrain.layout or (lambda _: jnp.int32(0)), terrain.changes

    def changed(ram: jax.Array) -> jax.Array:
        assert change is not None
        own = jnp.asarray(terrain.layouts)[index(game.ram(ram))]
        masks = change(game.ram(ram), dict(zip(terrain.names, own, strict=True)))
        return _stacked(masks, terrain.names)

    def extract(rams: jax.Array) -> Terrain:
        if change is None:
            return Terrain(_strict(lambda ram: index(game.ram(ram)))(rams), None, game)
        return Terrain(None, batches.in_chunks(_strict(changed), rams, CHUNK), game)

    return batches.AnyBatch(extract, 1, CHUNK)


def from_frames(
    game: Declaration, vem: Callable[[Any], Objects]
) -> Callable[[jax.Array | np.ndarray], Terrain]:
    """Compile the game's terrain from pixels, in either form of `Game.vem`.

    Raises:
        ValueError: the game has no terrain.
    """
    terrain = map_of(game)
    same_thing = {kind.category for kind in terrain.kinds}
    covers = np.array([c.name not in same_thing for c in game.categories])[game.slot_category]

    def seen(frame: jax.Array, *boxes: jax.Array) -> jax.Array:
        return _stacked(terrain.seen(frame, *boxes), terrain.names)

    def of_chunk(chunk: tuple[jax.Array, jax.Array, Objects]) -> jax.Array:
        frames, owners, objects = chunk
        shown = frames if game.saver is None else restored(frames, game.saver, game.categories)
        terrain_only = jnp.where(owners == NOBODY, shown & EVEN, jnp.uint8(COVERED))
        return _strict(seen)(_stored(terrain_only), *_in_boxes(objects, terrain.boxes, game))

    def extract(frames: jax.Array) -> Terrain:
        objects = _stored(vem(frames))
        owners = _stored(owners_of(game, objects.xywh, objects.valid & covers[None], frames))
        return Terrain(None, batches.in_chunks(of_chunk, (frames, owners, objects), CHUNK), game)

    # With the older emitters, `owners_of` takes 26 times as long in Adventure, 5 in Ms. Pac-Man.
    by_index = batches.AnyBatch(extract, 2, CHUNK, jax.jit)
    to_index = batches.AnyBatch(
        lambda rgb: palette.to_index(rgb, game.palette, game.pixel_colors), 3, CHUNK
    )

    def of_any(frames: jax.Array | np.ndarray) -> Terrain:
        return by_index(to_index(frames) if frames.shape[-3:] == (*game.screen, 3) else frames)

    return of_any


def _stored(tree: Any) -> Any:
    """Store arrays, because XLA would compute them again for each pixel that uses them."""
    return jax.tree.map(lambda a: kernels.materialize(lambda x: x, a, small=0), tree)


def _in_boxes(objects: Objects, names: Sequence[str], game: Declaration) -> Iterator[jax.Array]:
    """The pixels in the boxes of each category, bool `[B, H, 160]`.

    A product of matrices counts the boxes around each pixel.
    """
    rows, columns = (np.arange(size, dtype=np.int16)[None, None] for size in game.screen)
    for name in names:
        left, top, width, height = jnp.moveaxis(objects.xywh[:, game.slices[name], :, None], 2, 0)
        in_rows = (rows >= top) & (rows < top + height)
        in_columns = (columns >= left) & (columns < left + width)
        factors = in_rows.astype(jnp.float32), in_columns.astype(jnp.float32)
        yield jnp.einsum("bsh,bsw->bhw", *factors) > 0


def _strict(one: Callable[..., jax.Array]) -> Callable[..., jax.Array]:

    def checked(*state: jax.Array) -> jax.Array:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            return one(*state)

    return jax.vmap(checked)


def _stacked(masks: Masks, names: tuple[str, ...]) -> jax.Array:
    """Stack the masks of all kinds in their order, bool `[kinds, H, 160]`.

    Raises:
        ValueError: a kind is missing, or a mask has the wrong shape or dtype.
    """
    if set(masks) != set(names):
        raise ValueError(f"the masks must be those of {', '.join(names)}, got {', '.join(masks)}")
    for name in names:
        if masks[name].dtype != jnp.bool_ or masks[name].ndim != 2 or masks[name].shape[1] != WIDTH:
            raise ValueError(f"the mask of {name} must be bool [H, {WIDTH}], got {masks[name]}")
    return jnp.stack([masks[name] for name in names])
