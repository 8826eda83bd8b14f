"""`Objects`: the objects on the screen as padded tensors with a validity mask."""

import dataclasses
import reprlib
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction import records
from ocjax.extraction.categories import Category
from ocjax.extraction.declaration import Declaration


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Objects:
    """The objects of one state or of a batch of states. `N` is the number of slots of the game, and `...` is any batch shape.

    A slot that is not valid is zero in every field. `game.slices` maps each category to its slots.
    """

    xywh: jax.Array  # int16 [..., N, 4]: left, top, width, height in pixels of the ALE screen
    valid: jax.Array  # bool [..., N]: the slot holds an object now
    orientation: jax.Array  # int8 [..., N]: compass point 0-15, clockwise from north; -1 (UNKNOWN) in VEM
    value: jax.Array  # int32 [..., N]: score, lives, time, ...; the least int32 (UNKNOWN_VALUE) where VEM cannot read it
    rgb: jax.Array  # uint8 [..., N, 3]
    game: Declaration | None = dataclasses.field(default=None, repr=False, metadata={"static": True})  # whose objects they are

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

    def __getitem__(self, index: Any) -> "Objects":
        """Index the batch dimensions."""
        return jax.tree.map(lambda a: a[index], self)

    def of(self, game: Declaration, category: str | Category) -> "Objects":
        """Select the slots of a category, given by its name or as an entry of `game.categories`.

        The result has no reference to the game, so functions that need all slots, such as `to_list`, refuse it.

        Raises:
            ValueError: the game has no such category.
        """
        name = category if isinstance(category, str) else category.name
        if name not in game.slices:
            raise ValueError(f"{game.name} has no category {name!r}; it has {', '.join(game.slices)}")
        s = game.slices[name]
        return Objects(self.xywh[..., s, :], self.valid[..., s], self.orientation[..., s], self.value[..., s], self.rgb[..., s, :])

    def take(self, slots: jax.Array) -> "Objects":
        """Gather objects.

        Args:
            slots: int32 `[..., K]`, of the batch shape; a slot out of range gives an empty one.

        Returns:
            Objects of K slots. They have no reference to the game, as those of `of`.
        """

        def one(field: jax.Array) -> jax.Array:
            index = slots.reshape(*slots.shape, *[1] * (field.ndim - slots.ndim))
            return jnp.take_along_axis(field, index, axis=slots.ndim - 1, mode="fill", fill_value=0)

        return jax.tree.map(one, dataclasses.replace(self, game=None))

    def to_list(self) -> list[Any]:
        """Convert the valid objects to plain dicts, for printing, JSON or a data frame.

        A dict has the keys `category`, `slot` (within its category), `x`, `y`, `w`, `h`, `rgb` and `hud`, and also `value` and
        `orientation` if the category has them. What is not known is left out, as orientations are in VEM.

        Returns:
            A list of dicts for one state; nested lists for a batch.

        Raises:
            ValueError: the objects have no reference to their game, because they are only some of the slots that `game.rem` or `game.vem`
                returned.
        """
        return records.per_state(list, self._host(), whose(self))

    def to_dict(self) -> Any:
        """Convert the valid objects to a dict of lists by category, of the records of `to_list` without their category.

        Categories without a valid object are left out.

        Returns:
            A dict for one state; nested lists of dicts for a batch.

        Raises:
            ValueError: as `to_list`.
        """
        return records.per_state(records.by_category, self._host(), whose(self))

    def to_text(self) -> Any:
        """Describe the valid objects in plain text, for people and language models.

        Each object is a line such as `Player 0: 4 x 16 at (140, 100)`: category, slot, width x height, and left and top in pixels, then
        `, value 12` and `, facing NNE` where the object has them.

        Returns:
            A string for one state, empty if nothing is valid; nested lists of strings for a batch.

        Raises:
            ValueError: as `to_list`.
        """
        return records.per_state(records.text, self._host(), whose(self))

    def to_logic(self) -> Any:
        """Convert the valid objects to ground atoms in the syntax of Prolog and Datalog, without the final period.

        An object is a constant: its category in lower case with underscores, an underscore and its slot, such as `player_score_0`. All
        numbers are integers. The atoms are `type(object,category)`, `at(object,left,top)`, `size(object,width,height)`,
        `rgb(object,red,green,blue)`, `value(object,number)` and `orientation(object,point)` where the object has them, and `hud(object)`
        for display objects.

        Returns:
            A list of strings for one state; nested lists for a batch.

        Raises:
            ValueError: as `to_list`.
        """
        return records.per_state(records.atoms, self._host(), whose(self))

    def to_frame(self) -> Any:
        """Convert the valid objects to a pandas data frame with one row per object, ordered by state and slot.

        Its columns are `category` (categorical), `slot` (within the category), `x`, `y`, `w`, `h`, `r`, `g`, `b`, `hud`, and the nullable
        integers `value` and `orientation`. For a batch, `row` is the index of the state; if the batch has several dimensions, these are
        `row_0`, `row_1`, ...

        Raises:
            ValueError: as `to_list`.
            MissingExtraError: a ModuleNotFoundError; pandas is not installed.
        """
        return records.frame(self._host(), whose(self))

    def to_arrow(self) -> Any:
        """Convert the valid objects to a `pyarrow.Table` with the columns of `to_frame`.

        Raises:
            ValueError: as `to_list`.
            MissingExtraError: a ModuleNotFoundError; pyarrow is not installed.
        """
        return records.arrow(self._host(), whose(self))


def check_objects(name: str, objects: Any) -> None:
    """Check that an argument holds objects.

    Raises:
        TypeError: it is no `Objects`.
    """
    if not isinstance(objects, Objects):
        is_array = hasattr(objects, "dtype") and hasattr(objects, "shape")
        got = f"{objects.dtype} {list(objects.shape)}" if is_array else reprlib.repr(objects)
        raise TypeError(f"{name} must be ocjax.Objects, as game.rem and game.vem return them, got {got}")


def whose(objects: Objects) -> Declaration:
    """The game that objects belong to.

    Raises:
        TypeError: they are no `Objects`.
        ValueError: the objects have no reference to their game, because `of` or the caller made them.
    """
    check_objects("objects", objects)
    if objects.game is None:
        raise ValueError(
            "these objects have no reference to their game: pass all slots that game.rem or game.vem returned, not those of `of`"
        )
    return objects.game


def velocity(previous: Objects, current: Objects) -> jax.Array:
    """Movement of each slot's centre from one state to the next, float32 `[..., N, 2]` in pixels.

    The velocity is zero unless the slot is valid in both states. It is meaningful only if objects keep their slots, as they do in REM, and
    in VEM after `track`.
    """
    both = jnp.asarray(previous.valid & current.valid)
    return jnp.where(both[..., None], current.center - previous.center, jnp.float32(0))
