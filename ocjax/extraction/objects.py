"""`Objects`: the objects on the screen as padded tensors with a validity mask."""

import dataclasses
import reprlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ocjax.extraction import display, records, storage
from ocjax.extraction.categories import Category
from ocjax.extraction.declaration import Declaration

__all__ = ["Objects", "check_objects", "velocity", "whose"]


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, repr=False)
class Objects:
    """The objects of one state or of a batch of states.

    `N` is the number of slots of the game, and `...` is any batch shape. An invalid slot is zero in
    every field. `game.slices` maps each category to its slots. Length, iteration and indices apply
    to the batch.

    Args:
        xywh: int16 `[..., N, 4]`, left, top, width, height in pixels of the ALE screen.
        valid: bool `[..., N]`, whether the slot holds an object now.
        orientation: int8 `[..., N]`, compass point 0-15, clockwise from north; -1 in VEM.
        value: int32 `[..., N]`, score, lives, time, ...; the smallest int32 if VEM cannot read it.
        rgb: uint8 `[..., N, 3]`, colour.
        game: the game of the objects, or None.
    """

    xywh: jax.Array
    valid: jax.Array
    orientation: jax.Array
    value: jax.Array
    rgb: jax.Array
    game: Declaration | None = dataclasses.field(default=None, metadata={"static": True})

    @property
    def x(self) -> jax.Array:
        """int16 `[..., N]`: the left edge in pixels."""
        return self.xywh[..., 0]

    @property
    def y(self) -> jax.Array:
        """int16 `[..., N]`: the top edge in pixels."""
        return self.xywh[..., 1]

    @property
    def w(self) -> jax.Array:
        """int16 `[..., N]`: the width in pixels."""
        return self.xywh[..., 2]

    @property
    def h(self) -> jax.Array:
        """int16 `[..., N]`: the height in pixels."""
        return self.xywh[..., 3]

    @property
    def center(self) -> jax.Array:
        """float32 `[..., N, 2]`: the centre (x + w / 2, y + h / 2) in pixels."""
        box = jnp.asarray(self.xywh).astype(jnp.float32)
        return box[..., :2] + box[..., 2:] * 0.5

    def _host(self) -> records.Fields:
        return records.Fields(*(np.asarray(getattr(self, name)) for name in records.Fields._fields))

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """The batch dimensions, `...` in the shapes of the fields."""
        return self.valid.shape[:-1]

    def __len__(self) -> int:
        """The length of the first batch dimension.

        Raises:
            TypeError: these are the objects of one state.
        """
        return self._batch()[0]

    def __iter__(self) -> Iterator["Objects"]:
        """Iterate over the first batch dimension.

        Raises:
            TypeError: these are the objects of one state.
        """
        return (self[i] for i in range(len(self)))

    def __bool__(self) -> bool:
        """Always True, so that objects of one state can be tested against None."""
        return True

    def __getitem__(self, index: Any) -> "Objects":
        """Index the batch dimensions, as NumPy does; a JAX array as index is not checked.

        Raises:
            TypeError: these are the objects of one state, or the index is the name of a category.
            IndexError: the index is out of range, or has more dimensions than the batch.
        """
        if isinstance(index, str):
            raise TypeError(
                f"an index selects states of the batch, got {index!r}; objects.of({index!r}) "
                "selects a category"
            )
        if index is not Ellipsis:
            self._batch()
            if not any(
                isinstance(part, jax.Array)
                for part in (index if isinstance(index, tuple) else (index,))
            ):
                np.broadcast_to(np.False_, self.batch_shape)[index]
        return jax.tree.map(lambda a: a[index], self)

    def _batch(self) -> tuple[int, ...]:
        if not self.batch_shape:
            raise TypeError(
                "these are the objects of one state, without a batch dimension; `of` selects a "
                "category, `to_list` lists them"
            )
        return self.batch_shape

    def __getattr__(self, name: str) -> Any:
        game = vars(self).get("game")
        hint = f"; objects.of({name!r}) selects a category" if game and name in game.slices else ""
        raise AttributeError(f"'Objects' object has no attribute {name!r}{hint}")

    def __repr__(self) -> str:
        leaves = [getattr(self, name) for name in records.FIELDS]
        if not all(
            isinstance(leaf, np.ndarray | jax.Array) and not isinstance(leaf, Tracer)
            for leaf in leaves
        ):
            return (
                "Objects("
                f"{', '.join(f'{n}={v}' for n, v in zip(records.FIELDS, leaves, strict=True))})"
            )
        about = display.summary(self.game, self.batch_shape, self.valid.shape[-1])
        if self.game is None or 0 in self.batch_shape:
            return f"{about}, {int(np.sum(self.valid))} valid"
        return (
            f"{about}{'. The first state' if self.batch_shape else ''}:\n"
            f"{display.text(self.game, self._first())}"
        )

    def _repr_html_(self) -> str:
        about = display.summary(self.game, self.batch_shape, self.valid.shape[-1])
        if self.game is None or 0 in self.batch_shape:
            return f"<p>{about}</p>"
        return (
            f"<p>{about}{'. The first state' if self.batch_shape else ''}:</p>"
            f"{display.state_html(self.game, self._first())}"
        )

    def _first(self) -> records.Fields:
        return records.Fields(
            *(
                np.asarray(getattr(self, name)[(0,) * len(self.batch_shape)])
                for name in records.Fields._fields
            )
        )

    def of(self, category: str | Category, game: Declaration | None = None) -> "Objects":
        """Select the slots of a category: `objects.of("Ball")`.

        The result keeps the game and the category, so all functions of objects work on it.

        Args:
            category: its name or an alias, or an entry of `game.categories`.
            game: only for objects without a reference to their game.

        Raises:
            ValueError: the objects belong to another game or to none, or have no such category.
        """
        if isinstance(category, Declaration):
            category, game = _reordered(category, game)
        own = self.game or game
        if own is None:
            raise ValueError(
                "these objects have no reference to their game: give it, as in "
                "objects.of(category, game)"
            )
        if game is not None and own.name != game.name:
            raise ValueError(f"these are objects of {own.name}, not of {game.name}")
        name = category if isinstance(category, str) else category.name
        if name not in own.slices:
            raise ValueError(
                f"these objects of {own.name} have no category {name!r}; they have "
                f"{own.suggestion(name)}"
            )
        s = own.slices[name]
        return Objects(
            self.xywh[..., s, :],
            self.valid[..., s],
            self.orientation[..., s],
            self.value[..., s],
            self.rgb[..., s, :],
            own.part(name),
        )

    def take(self, slots: jax.Array) -> "Objects":
        """Gather objects, without a reference to the game.

        Args:
            slots: int32 `[..., K]`, of the batch shape; a slot out of range gives an empty slot.
        """

        def one(field: jax.Array) -> jax.Array:
            index = slots.reshape(*slots.shape, *[1] * (field.ndim - slots.ndim))
            return jnp.take_along_axis(field, index, axis=slots.ndim - 1, mode="fill", fill_value=0)

        return jax.tree.map(one, dataclasses.replace(self, game=None))

    def save(self, path: str | Path) -> None:
        """Write an .npz file, which `Objects.load` reads, completely or not at all.

        It holds the fields, the game's name and the md5 of its ROM.

        Raises:
            ValueError: see `to_list`.
            OSError: the file cannot be written.
        """
        storage.save(Path(path), self._host(), whose(self))

    @classmethod
    def load(cls, path: str | Path) -> "Objects":
        """Read a file that `save` wrote, to objects with NumPy arrays as fields.

        Raises:
            FileNotFoundError: the file does not exist.
            ValueError: the file is damaged, or was made with another ROM or other slots.
        """
        fields, game = storage.load(Path(path))
        return cls(**fields._asdict(), game=game)

    def to_list(self) -> list[Any]:
        """Convert the valid objects to plain dicts, for printing, JSON or a data frame.

        A dict has the keys `category`, `slot` (within its category), `x`, `y`, `w`, `h`, `rgb` and
        `hud`, and also `value` and `orientation` if they are known.

        Returns:
            A list of dicts for one state; nested lists for a batch.

        Raises:
            ValueError: the objects have no reference to their game, because `take` or the caller
                made them.
        """
        return records.per_state(list, self._host(), whose(self))

    def to_dict(self) -> Any:
        """Convert the valid objects to a dict of lists by category.

        The lists hold the dicts of `to_list` without `category`. Categories without a valid object
        are omitted.

        Returns:
            A dict for one state; nested lists of dicts for a batch.

        Raises:
            ValueError: see `to_list`.
        """
        return records.per_state(records.by_category, self._host(), whose(self))

    def to_text(self) -> Any:
        """Describe the valid objects in plain text, for people and language models.

        Each object is a line such as `Player 0: 4 x 16 at (140, 100)`: category, slot, width x
        height, and left and top in pixels, then `, value 12` and `, facing NNE` if the object has
        them.

        Returns:
            A string for one state, empty without valid objects; nested lists of strings for a
            batch.

        Raises:
            ValueError: see `to_list`.
        """
        return records.per_state(records.text, self._host(), whose(self))

    def to_logic(self) -> Any:
        """Convert the valid objects to ground atoms of Prolog and Datalog, without final periods.

        An object is a constant: its category in lower case with underscores, an underscore and its
        slot, such as `player_score_0`. The atoms are `type(object,category)`,
        `at(object,left,top)`, `size(object,width,height)`, `rgb(object,red,green,blue)`,
        `value(object,number)` and `orientation(object,point)` if the object has them, and
        `hud(object)` for display objects. All numbers are integers.

        Returns:
            A list of strings for one state; nested lists for a batch.

        Raises:
            ValueError: see `to_list`.
        """
        return records.per_state(records.atoms, self._host(), whose(self))

    def to_frame(self) -> Any:
        """Convert the valid objects to a pandas data frame, one row per object, by state and slot.

        Its columns are `category` (categorical), `slot` (within the category), `x`, `y`, `w`, `h`,
        `r`, `g`, `b`, `hud`, and the nullable integers `value` and `orientation`. For a batch,
        `row` is the index of the state, or `row_0`, `row_1`, ... with several dimensions.

        Raises:
            ValueError: see `to_list`.
            MissingExtraError: a ModuleNotFoundError; pandas is not installed.
        """
        return records.frame(self._host(), whose(self))

    def to_arrow(self) -> Any:
        """Convert the valid objects to a `pyarrow.Table` with the columns of `to_frame`.

        Raises:
            ValueError: see `to_list`.
            MissingExtraError: a ModuleNotFoundError; pyarrow is not installed.
        """
        return records.arrow(self._host(), whose(self))


def _reordered(game: Declaration, category: Any) -> tuple[str | Category, Declaration]:
    if category is None:
        raise ValueError('expected a category, as in objects.of("Ball"), got only a game')
    warnings.warn(
        "objects.of(game, category) is now objects.of(category)", DeprecationWarning, stacklevel=3
    )
    return category, game


def check_objects(name: str, objects: Any) -> None:
    """Check that an argument is an `Objects`; raises TypeError."""
    if not isinstance(objects, Objects):
        is_array = hasattr(objects, "dtype") and hasattr(objects, "shape")
        got = f"{objects.dtype} {list(objects.shape)}" if is_array else reprlib.repr(objects)
        raise TypeError(
            f"{name} must be ocjax.Objects, as game.rem and game.vem return them, got {got}"
        )


def whose(objects: Objects) -> Declaration:
    """Return the game of objects.

    Raises:
        TypeError: `objects` is not an `Objects`.
        ValueError: the objects have no reference to their game, because `take` or the caller made
            them.
    """
    check_objects("objects", objects)
    if objects.game is None:
        raise ValueError(
            "these objects have no reference to their game: pass objects that game.rem or game.vem "
            "returned, or their slots of one category (`of`)"
        )
    return objects.game


def velocity(previous: Objects, current: Objects) -> jax.Array:
    """Movement of each slot's centre from one state to the next, float32 `[..., N, 2]` in pixels.

    The velocity is zero unless the slot is valid in both states. It is meaningful only if objects
    keep their slots: in REM, and in VEM after `track`.

    Raises:
        ValueError: the states belong to different games, or have different slots.
    """
    game, other = previous.game, current.game
    if game is not None and other is not None:
        if game.name != other.name:
            raise ValueError(
                f"velocities need two states of one game, got {game.name} and {other.name}"
            )
        if game.slices != other.slices:
            raise ValueError(
                f"velocities need the same slots in both states, got {', '.join(game.slices)} and "
                f"{', '.join(other.slices)}"
            )
    if previous.valid.shape[-1:] != current.valid.shape[-1:]:
        raise ValueError(
            f"velocities need the same slots in both states, got {previous.valid.shape[-1]} and "
            f"{current.valid.shape[-1]}"
        )
    both = jnp.asarray(previous.valid & current.valid)
    return jnp.where(both[..., None], current.center - previous.center, jnp.float32(0))
