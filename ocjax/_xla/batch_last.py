"""A `vmap` over the last axis that keeps the batch in the last axis.

`jax.vmap(f, in_axes=-1, out_axes=-1)` moves the batch to the front in `concatenate`, `reshape`,
`gather` and other operations, which then run along axes of a few elements, with transposes in
between. Here every operation runs along thousands of states. The plain `vmap` takes 1.15 times as
long in the geometric mean over 19 games, and 1.7 times in Asteroids.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

from ocjax._xla.dataflow import ELEMENTWISE, Constant, Operand, Program, flatten, worth_storing
from ocjax._xla.kernels import materialize, varying

# Operations that are batched in place: their axes count from the front, or they have none.
_IN_PLACE = frozenset(
    "argmax argmin cummax cummin cumsum optimization_barrier reduce_and reduce_max reduce_min "
    "reduce_or reduce_prod reduce_sum "
    "reduce_xor rev squeeze".split()
)

# Operations that need the batch axis in their parameters: functions of parameters, batch size and
# operands.
_EXTENDED: dict[str, Callable[..., jax.Array]] = {
    "broadcast_in_dim": lambda p, n, x: lax.broadcast_in_dim(
        x, (*p["shape"], n), (*p["broadcast_dimensions"], len(p["shape"]))
    ),
    "concatenate": lambda p, n, *x: lax.concatenate(x, p["dimension"]),
    "reshape": lambda p, n, x: lax.reshape(x, (*p["new_sizes"], n)),
    "slice": lambda p, n, x: lax.slice(
        x, (*p["start_indices"], 0), (*p["limit_indices"], n), p["strides"] and (*p["strides"], 1)
    ),
    "stack": lambda p, n, *x: lax.concatenate(
        [lax.expand_dims(v, [p["axis"]]) for v in x], p["axis"]
    ),
    "tile": lambda p, n, x: lax.tile(x, (*p["reps"], 1)),
    "transpose": lambda p, n, x: lax.transpose(x, (*p["permutation"], len(p["permutation"]))),
}
# Elements. Smaller results are not stored. Row `small results` of benchmarks/tricks.py.
MIN_STORED_ELEMENTS = 64
Value = tuple[Any, bool]  # an array, and whether its last axis is the batch


def batch_last(
    f: Callable[[jax.Array], Any], example: jax.ShapeDtypeStruct
) -> Callable[[jax.Array], Any]:
    """Apply a function of one array, without effects, to a batch in the last axis, `[*shape, B]`.

    Each result of shape `s` becomes `[*s, B]`.
    """
    closed, out = jax.make_jaxpr(f, return_shape=True)(example)
    tree, program = jax.tree.structure(out), flatten(closed)
    stored = worth_storing(program)

    def run(x: jax.Array) -> Any:
        results = _evaluate(program, x, stored)
        return jax.tree.unflatten(tree, [_batched(value, x) for value in results])

    return run


def _batched(value: Value, like: jax.Array) -> jax.Array:
    array, has_batch = value
    if has_batch:
        return array
    array = jnp.asarray(array)
    return varying(
        lax.broadcast_in_dim(array, (*array.shape, like.shape[-1]), tuple(range(array.ndim))), like
    )


def _evaluate(program: Program, x: jax.Array, stored: set[int]) -> list[Value]:
    known: list[Value] = [(x, True)] * program.num_values

    def value_of(v: Operand) -> Value:
        return (v.value, False) if isinstance(v, Constant) else known[v]

    for eqn, inputs, outputs in program.steps:
        values = [value_of(v) for v in inputs]
        batched = any(has_batch for _, has_batch in values)
        out = (
            _apply(eqn, values, x)
            if batched
            else eqn.primitive.bind(*(v for v, _ in values), **eqn.params)
        )
        for i, array in zip(outputs, out if eqn.primitive.multiple_results else [out], strict=True):
            known[i] = (
                materialize(lambda v: v, array, small=MIN_STORED_ELEMENTS)
                if batched and i in stored
                else array,
                batched,
            )
    return [value_of(v) for v in program.outputs]


def _apply(eqn: Any, values: list[Value], like: jax.Array) -> Any:
    name, params = eqn.primitive.name, dict(eqn.params)
    if name == "gather" and _is_look_up(eqn, values):
        return _look_up(eqn, values[0][0], values[1][0], like)
    if name in ELEMENTWISE:
        return eqn.primitive.bind(*_aligned(values, eqn.outvars[0].aval.shape, like), **params)
    whole = [_batched(v, like) for v in values]
    if name in _IN_PLACE:
        return eqn.primitive.bind(*whole, **params)
    if name in _EXTENDED:
        return _EXTENDED[name](params, like.shape[-1], *whole)
    if name == "pad" and not values[1][1]:
        return lax.pad(whole[0], values[1][0], (*params["padding_config"], (0, 0, 0)))
    if name == "gather" and not values[1][1]:
        return _rows(eqn, whole[0], values[1][0], like)
    axes = [-1 if has_batch else None for _, has_batch in values]
    return jax.vmap(lambda *v: eqn.primitive.bind(*v, **params), in_axes=axes, out_axes=-1)(
        *(varying(v, like) for v, _ in values)
    )


def _aligned(values: list[Value], shape: tuple[int, ...], like: jax.Array) -> list[jax.Array]:
    """Give the operands of an elementwise operation one shape: some may be scalars."""
    whole = [_batched(v, like) for v in values]
    return [
        v
        if v.ndim == len(shape) + 1
        else lax.broadcast_in_dim(v, (*shape, like.shape[-1]), (len(shape),))
        for v in whole
    ]


def _is_look_up(eqn: Any, values: list[Value]) -> bool:
    """Return whether a gather takes single entries along one axis of an unbatched table."""
    (_, table_has_batch), (indices, indices_have_batch) = values
    numbers = eqn.params["dimension_numbers"]
    return (
        indices_have_batch
        and not table_has_batch
        and indices.shape[-2] == 1
        and not numbers.offset_dims
    )


def _look_up(eqn: Any, table: jax.Array, indices: jax.Array, like: jax.Array) -> jax.Array:
    """Look up entries of an unbatched table, without the two transposes of `jax.vmap`."""
    index = lax.reshape(indices, (*indices.shape[:-2], like.shape[-1], 1))
    return eqn.primitive.bind(varying(jnp.asarray(table), like), index, **eqn.params)


def _rows(eqn: Any, array: jax.Array, indices: jax.Array, like: jax.Array) -> jax.Array:
    numbers, axis = eqn.params["dimension_numbers"], len(eqn.outvars[0].aval.shape)
    params = eqn.params | {
        "dimension_numbers": numbers._replace(offset_dims=(*numbers.offset_dims, axis)),
        "slice_sizes": (*eqn.params["slice_sizes"], like.shape[-1]),
    }
    return eqn.primitive.bind(array, varying(jnp.asarray(indices), like), **params)
