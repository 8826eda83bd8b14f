"""Artificial errors of a detector, to train and test agents that must cope with them."""

import numbers

import jax
import jax.numpy as jnp

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose

__all__ = ["perturb"]

_INVENTED = (2, 16)  # smallest and largest width and height of an invented object, in pixels


def perturb(
    key: jax.Array,
    objects: Objects,
    *,
    jitter: int = 0,
    drop: float = 0.0,
    swap: float = 0.0,
    invent: float = 0.0,
) -> Objects:
    """Move, drop, swap and invent objects at random, without changing `objects`, the truth.

    Every slot of every state is drawn independently: objects swap slots, some objects are dropped,
    empty slots receive invented objects, and objects from the truth are moved. This is a pure
    function that works under `jit`, `vmap` and `scan`.

        noisy = ocjax.perturb(key, envs.objects, jitter=2, drop=0.1)

    Args:
        key: a key of `jax.random`.
        objects: all slots, of any batch shape.
        jitter: the largest movement of the left and the top edge, in pixels. The box keeps its
            size, and its top left corner remains on the screen. This and the probabilities are
            Python numbers.
        drop: probability that an object is dropped.
        swap: probability that a slot takes part in a random permutation of such slots of its
            category.
        invent: probability that an empty slot receives an object, with a random box of 2 to 16
            pixels on the screen and the slot's colour.

    Raises:
        TypeError: `objects` has another type, `jitter` is not an integer, or a probability is not a
            number.
        ValueError: a probability is not between 0 and 1, `jitter` is negative, or the objects do
            not know their game.
    """
    whose(objects)
    if not isinstance(jitter, numbers.Integral):
        raise TypeError(f"jitter must be a whole number of pixels, got {jitter!r}")
    for name, p in (("drop", drop), ("swap", swap), ("invent", invent)):
        if not isinstance(p, numbers.Real):
            raise TypeError(f"{name} must be a number from 0 to 1, got {p!r}")
        if not 0 <= p <= 1:
            raise ValueError(f"{name} must be a probability, got {p!r}")
    if jitter < 0:
        raise ValueError(f"jitter must be a number of pixels of at least 0, got {jitter!r}")
    return _perturb(
        key, objects, jnp.int16(jitter), *(jnp.float32(p) for p in (drop, swap, invent))
    )


@jax.jit
def _perturb(
    key: jax.Array,
    objects: Objects,
    jitter: jax.Array,
    drop: jax.Array,
    swap: jax.Array,
    invent: jax.Array,
) -> Objects:
    game = whose(objects)
    keys = jax.random.split(key, 4)
    objects = _swapped(keys[0], objects, game, swap)
    kept = objects.valid & (jax.random.uniform(keys[1], objects.valid.shape) >= drop)
    moved = _moved(keys[2], objects, game, jitter)
    chosen, box = _invented(keys[3], objects, game, invent)

    def masked(field: jax.Array, mask: jax.Array) -> jax.Array:
        return jnp.where(
            mask.reshape(*mask.shape, *[1] * (field.ndim - mask.ndim)), field, jnp.zeros_like(field)
        )

    rgb = jnp.broadcast_to(jnp.asarray(game.slot_rgb), objects.rgb.shape)
    return Objects(
        masked(moved, kept) + masked(box, chosen),
        kept | chosen,
        masked(objects.orientation, kept),
        masked(objects.value, kept),
        masked(objects.rgb, kept) + masked(rgb, chosen),
        game,
    )


def _swapped(key: jax.Array, objects: Objects, game: Declaration, swap: jax.Array) -> Objects:
    pick, order = jax.random.split(key)
    number = jax.random.uniform(order, objects.valid.shape)
    chosen = jax.random.uniform(pick, objects.valid.shape) < swap
    category = jnp.asarray(game.slot_category, jnp.int32)
    # Both orders list the categories in sequence, chosen slots first: by slot, and at random.
    group = jnp.broadcast_to(category, chosen.shape) * 2 + (~chosen).astype(jnp.int32)
    slots = jnp.broadcast_to(jnp.arange(game.num_slots, dtype=jnp.int32), chosen.shape)
    *_, to = jax.lax.sort((group, slots, slots), num_keys=2)
    *_, source = jax.lax.sort(
        (group, jnp.where(chosen, number, slots.astype(jnp.float32)), slots), num_keys=2
    )
    _, source = jax.lax.sort((to, source), num_keys=1)
    return objects.take(source)


def _moved(key: jax.Array, objects: Objects, game: Declaration, jitter: jax.Array) -> jax.Array:
    """Boxes moved by at most `jitter` pixels per axis, int16 `[..., N, 4]`."""
    height, width = game.screen
    by = jax.random.randint(
        key, (*objects.valid.shape, 2), -jitter, jitter + jnp.int16(1), jnp.int16
    )
    corner = jnp.clip(
        objects.xywh[..., :2] + by,
        0,
        jnp.broadcast_to(jnp.array([width - 1, height - 1], jnp.int16), by.shape),
    )
    return jnp.concatenate([corner, objects.xywh[..., 2:]], axis=-1)


def _invented(
    key: jax.Array, objects: Objects, game: Declaration, invent: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Choose empty slots, bool `[..., N]`, and a random box for each slot, int16 `[..., N, 4]`."""
    which, sizes, places = jax.random.split(key, 3)
    shape = objects.valid.shape
    size = jax.random.randint(sizes, (*shape, 2), _INVENTED[0], _INVENTED[1] + 1, jnp.int32)
    room = (
        jnp.broadcast_to(jnp.array([game.screen[1], game.screen[0]], jnp.int32), size.shape) - size
    )
    corner = jnp.floor(
        jax.random.uniform(places, size.shape) * (room + 1).astype(jnp.float32)
    ).astype(jnp.int32)
    box = jnp.concatenate([jnp.minimum(corner, room), size], axis=-1).astype(jnp.int16)
    return ~objects.valid & (jax.random.uniform(which, shape) < invent), box
