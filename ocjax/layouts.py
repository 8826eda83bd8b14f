"""Flat object tensors in the layouts of other projects, for their policies and logic rules.

Each function takes the result of `game.rem` or `game.vem`, with or without display objects, of any
batch shape. The functions are pure. Slots without an object are zero.

The layouts use OCAtari's slots: its categories, in its order, with its numbers of slots. If ocjax
has fewer slots of a category, they come first; if it has more, the valid objects move to the front.
Categories that ocjax lacks are always missing. Positions are ocjax's exact boxes, and orientations
its compass points 0-15.
"""

import functools
import json
from collections.abc import Iterable, Mapping
from importlib import resources

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose
from ocjax.extraction.registry import as_game
from ocjax.transforms.game_objects import NS_MEANING, ORIENTATION, POSITION, WIDTH

__all__ = [
    "blendrl",
    "blendrl_slots",
    "declared_slots",
    "nudge",
    "ocatari",
    "ocatari_slots",
    "places",
]

_FIELDS = {POSITION: ("x", "y"), ORIENTATION: ("orientation",), WIDTH: ("w",)}  # of `ns_state`

# BlendRL's slots for games of OCAtari 1, in the order of the rows.
_BLENDRL_SLOTS: Mapping[str, Mapping[str, int]] = {
    "Kangaroo": {"Player": 1, "Child": 1, "Fruit": 3, "Bell": 1, "Platform": 20, "Ladder": 6,
                 "Monkey": 4, "FallingCoconut": 1, "ThrownCoconut": 3, "Lives": 8, "Time": 1},
    "Seaquest": {"Player": 1, "Diver": 4, "Shark": 12, "Submarine": 12, "SurfaceSubmarine": 1,
                 "PlayerMissile": 1, "EnemyMissile": 4, "Lives": 1, "OxygenBar": 1,
                 "CollectedDiver": 6},
}  # fmt: skip
_BLENDRL_VALUES = ("OxygenBar", "Time")  # categories with the row (visible, value, 0, 0)

# NUDGE's categories of each game, in the order of its rows: (column of the category, number of
# rows).
_NUDGE_ROWS: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "Asterix": {"Player": (0, 1), "Enemy": (1, 8), "Reward": (2, 8), "Consumable": (3, 8)},
    "Freeway": {"Chicken": (0, 1), "Car": (1, 10)},
}
_NUDGE_OBJECTS, _NUDGE_KINDS = 11, 4


@functools.cache
def _tables() -> dict[str, dict[str, dict[str, int]]]:
    """The number of objects per category of each game, in OCAtari's order.

    `benchmarks/ocatari_slots.py` reads them from OCAtari.
    """
    return json.loads(
        resources.files("ocjax").joinpath("ocatari_slots.json").read_text(encoding="utf-8")
    )


def declared_slots(game: Declaration, hud: bool) -> dict[str, int] | None:
    """The number of slots of each category, in OCAtari's order, or None without a table.

    Args:
        hud: whether OCAtari's display objects are included.
    """
    table = _tables().get(game.name.lower(), {"objects": {}, "hud": {}})
    if not table["objects"].keys() & game.slices.keys():  # OCAtari's table belongs to another game
        return None
    # With the HUD, OCAtari lists the other objects first, independent of the order in its table.
    extra = {name: n for name, n in table["hud"].items() if name not in table["objects"]}
    return table["objects"] | (extra if hud else {})


def places(game: Declaration, names: Iterable[str]) -> dict[str, slice]:
    """The game's slots of each of OCAtari's categories, empty if the game lacks the category.

    If two names mean the same category of the game, the first one gets its slots.
    """
    out: dict[str, slice] = {}
    for name in names:
        place = game.slices.get(name, slice(0, 0))
        out[name] = slice(0, 0) if place in out.values() else place
    return out


def ocatari_slots(game: Declaration | str, hud: bool | None = None) -> dict[str, int]:
    """OCAtari 2.2.1's number of slots of each category, in its order.

    Args:
        game: the game, or its name.
        hud: whether OCAtari's display objects are included; by default if the game includes its
            display.

    Raises:
        ValueError: the game is unknown, or OCAtari declares no slots for it.
        TypeError: `game` is not a game or a name.
    """
    game = as_game(game)
    slots = declared_slots(game, game.hud if hud is None else hud)
    if slots is None:
        raise ValueError(f"OCAtari 2.2.1 declares no slots of {game.name}")
    return slots


def blendrl_slots(game: Declaration | str) -> dict[str, int]:
    """The number of rows of each category in `blendrl`, in order (BlendRL's `MAX_NB_OBJECTS`).

    Raises:
        ValueError: the game is unknown, or OCAtari declares no slots for it.
        TypeError: `game` is not a game or a name.
    """
    game = as_game(game)
    return dict(_BLENDRL_SLOTS.get(game.name) or ocatari_slots(game, hud=False))


def _front(valid: jax.Array) -> jax.Array:
    """Indices that sort valid slots to the front, in stable order, int32 `[..., n]`."""
    return jnp.argsort(~valid, axis=-1, stable=True).astype(jnp.int32)


def _arranged(objects: Objects, slots: Mapping[str, int], *, packed: bool) -> Objects:
    """The objects in a layout's slots; `packed` moves the valid ones of a category to its front."""
    game, batch, parts = whose(objects), objects.valid.shape[:-1], []
    for ours, count in zip(places(game, slots).values(), slots.values(), strict=True):
        number = ours.stop - ours.start
        if number > count or (packed and number > 1):
            index = _front(objects.valid[..., ours])[..., :count] + jnp.int32(ours.start)
        else:
            index = jnp.broadcast_to(
                jnp.arange(ours.start, ours.stop, dtype=jnp.int32), (*batch, number)
            )
        parts += [index, jnp.full((*batch, count - index.shape[-1]), game.num_slots, jnp.int32)]
    return objects.take(jnp.concatenate(parts, axis=-1))


def _known(orientation: jax.Array) -> jax.Array:
    """Orientations, with 0 for VEM's unknown ones."""
    return jnp.maximum(orientation, jnp.int8(0))


def ocatari(objects: Objects, hud: bool | None = None) -> jax.Array:
    """OCAtari 2.2.1's `ns_state`: left and top of each of its slots, float32 `[..., K]`.

    `ocatari_slots` gives the slots. The player of Asteroids and of Skiing has an orientation as a
    third number, and Seaquest's OxygenBar has only its width.

    Args:
        hud: whether OCAtari's display objects are included; by default if the game includes its
            display. OCAtari counts some display objects as part of the scene, such as Seaquest's
            OxygenBar: load these games with their display even for `hud=False`.

    Raises:
        TypeError: `objects` is not of type `Objects`.
        ValueError: OCAtari declares no slots for the game, or the objects do not know their game.
    """
    whose(objects)
    return _ocatari(objects, hud)


@functools.partial(jax.jit, static_argnames="hud")
def _ocatari(objects: Objects, hud: bool | None) -> jax.Array:
    game = whose(objects)
    slots = ocatari_slots(game, hud)
    arranged = _arranged(objects, slots, packed=False)
    columns = {
        "x": arranged.x,
        "y": arranged.y,
        "w": arranged.w,
        "orientation": _known(arranged.orientation),
    }
    names = [name for name, count in slots.items() for _ in range(count)]
    meaning = [NS_MEANING.get((game.name, name), (POSITION,)) for name in names]
    numbers = [
        columns[field][..., i]
        for i, parts in enumerate(meaning)
        for part in parts
        for field in _FIELDS[part]
    ]
    return jnp.stack([n.astype(jnp.float32) for n in numbers], axis=-1)


def blendrl(objects: Objects) -> jax.Array:
    """BlendRL's logic state: visible, centre x, centre y, orientation, int32 `[..., n, 4]`.

    The rows of Kangaroo (49) and Seaquest (43) match the published agents; other games have
    OCAtari's slots without the display. The visible objects of a category come first. The rows of
    Kangaroo's Time and Seaquest's OxygenBar are (1, value, 0, 0); like Lives, they are missing if
    the game is loaded without its display. Centres are rounded down.

    Raises:
        TypeError: `objects` is not of type `Objects`.
        ValueError: OCAtari declares no slots for the game, or the objects do not know their game.
    """
    whose(objects)
    return _blendrl(objects)


@jax.jit
def _blendrl(objects: Objects) -> jax.Array:
    slots = blendrl_slots(whose(objects))
    arranged = _arranged(objects, slots, packed=True)
    values = np.array(
        [name in _BLENDRL_VALUES for name, count in slots.items() for _ in range(count)]
    )
    x, y = (arranged.center[..., i].astype(jnp.int32) for i in (0, 1))
    orientation = jnp.where(values, jnp.int32(0), _known(arranged.orientation).astype(jnp.int32))
    x, y = jnp.where(values, arranged.value, x), jnp.where(values, jnp.int32(0), y)
    return jnp.stack([arranged.valid.astype(jnp.int32), x, y, orientation], axis=-1)


def nudge(objects: Objects) -> jax.Array:
    """NUDGE's logic state of Asterix and Freeway, float32 `[..., 11, 6]`.

    Four columns are a one-hot code of the category: player, enemies or cars, rewards, and
    consumables. The last two are left and top. In Freeway, row 0 is the left chicken, and the other
    rows are the cars. In Asterix, the visible objects come first, in the order of the columns;
    objects after the eleventh are dropped.

    Raises:
        TypeError: `objects` is not of type `Objects`.
        ValueError: NUDGE does not define the layout for the game, or the objects do not know their
            game.
    """
    whose(objects)
    return _nudge(objects)


@jax.jit
def _nudge(objects: Objects) -> jax.Array:
    game = whose(objects)
    if game.name not in _NUDGE_ROWS:
        raise ValueError(
            f"NUDGE defines this layout for {' and '.join(_NUDGE_ROWS)} only, got {game.name}"
        )
    rows = _NUDGE_ROWS[game.name]
    column = jnp.asarray(
        np.repeat([c for c, _ in rows.values()], [count for _, count in rows.values()]), jnp.int32
    )
    arranged = _arranged(objects, {name: count for name, (_, count) in rows.items()}, packed=True)
    kind = jnp.where(arranged.valid, column, jnp.int32(_NUDGE_KINDS))
    if len(column) > _NUDGE_OBJECTS:
        order = _front(arranged.valid)[..., :_NUDGE_OBJECTS]
        arranged, kind = arranged.take(order), jnp.take_along_axis(kind, order, axis=-1)
    return jnp.concatenate(
        [jax.nn.one_hot(kind, _NUDGE_KINDS), arranged.xywh[..., :2].astype(jnp.float32)], axis=-1
    )
