"""`vmap` with the batch as the last axis of everything.

`jax.vmap` moves the batch to the front for many operations, so that a computation of a few numbers for each of thousands of states runs
along axes of a few numbers. With the batch last every operation runs along the batch and vectorises; the axes that the
function itself names keep their numbers.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
from jax import lax
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

# Operations whose operands and result have one shape.
_ELEMENTWISE = frozenset(
    "abs add and clamp clz convert_element_type copy div eq ge gt integer_pow le lt max min mul ne neg not or population_count "
    "rem select_n shift_left shift_right_arithmetic shift_right_logical sign square sub xor".split()
)
# Operations that name axes only from the front.
_FRONT_AXES = frozenset(
    "argmax argmin cummax cummin cumsum reduce_and reduce_max reduce_min reduce_or reduce_prod reduce_sum reduce_xor rev squeeze".split()
)
_CALLS = {"jit": "jaxpr", "pjit": "jaxpr", "closed_call": "call_jaxpr", "custom_jvp_call": "call_jaxpr"}


Keep = Callable[[Callable[[Any], Any], Any], Any]


def batch_last(f: Callable[[jax.Array], Any], example: jax.ShapeDtypeStruct) -> Callable[[jax.Array, Keep], Any]:
    """The function on a batch in the last axis: `[*shape, B]` -> each result of shape `s` becomes `[*s, B]`.

    The result's second argument says how to call a function so that what it returns is computed once and kept in memory: that is done
    with what goes through `lax.optimization_barrier` in the function. (The compiler itself forgets barriers before it decides what to
    compute again for each use.)

    Args:
        f: of one array; no effects.
        example: its argument's shape and dtype.
    """
    closed, out = jax.make_jaxpr(f, return_shape=True)(example)
    tree = jax.tree.structure(out)

    def run(x: jax.Array, keep: Keep) -> Any:
        results = _evaluate(closed, [x], [True], x.shape[-1], keep)
        return jax.tree.unflatten(tree, [v if batched else _spread(v, x.shape[-1]) for v, batched in results])

    return run


def _spread(v: Any, size: int) -> jax.Array:
    """The same for all of the batch."""
    v = jax.numpy.asarray(v)
    return lax.broadcast_in_dim(v, (*v.shape, size), tuple(range(v.ndim)))


def _evaluate(closed: ClosedJaxpr, args: list[Any], batched: list[bool], size: int, keep: Keep) -> list[tuple[Any, bool]]:
    jaxpr: Jaxpr = closed.jaxpr
    known: dict[Any, tuple[Any, bool]] = {}
    known.update(zip(jaxpr.constvars, ((c, False) for c in closed.consts), strict=True))
    known.update(zip(jaxpr.invars, zip(args, batched, strict=True), strict=True))

    def read(v: Any) -> tuple[Any, bool]:
        return (v.val, False) if isinstance(v, Literal) else known[v]

    for eqn in jaxpr.eqns:
        values = [read(v) for v in eqn.invars]
        name, params = eqn.primitive.name, dict(eqn.params)
        if name in _CALLS:
            inner = params[_CALLS[name]]
            outs = _evaluate(inner, [v for v, _ in values], [b for _, b in values], size, keep)
        elif not any(b for _, b in values):
            found = eqn.primitive.bind(*(v for v, _ in values), **params)
            outs = [(o, False) for o in (found if eqn.primitive.multiple_results else [found])]
        elif name == "optimization_barrier":
            found = iter(keep(lambda v: v, [v for v, b in values if b]))
            outs = [(next(found) if b else v, b) for v, b in values]
        else:
            if name == "gather":  # fused with it, its indices would be computed one at a time: twice to four times as long
                values = [(keep(lambda v: v, v) if b else v, b) for v, b in values]
            if name == "rev":  # what is fused with it would not vectorise
                found = keep(functools.partial(lax.rev, dimensions=params["dimensions"]), values[0][0])
            else:
                found = _apply(eqn, name, params, values, size)
            outs = [(o, True) for o in (found if eqn.primitive.multiple_results else [found])]
        known.update(zip(eqn.outvars, outs, strict=True))
    return [read(v) for v in jaxpr.outvars]


def _apply(eqn: Any, name: str, params: dict[str, Any], values: list[tuple[Any, bool]], size: int) -> Any:
    """One operation, at least one of whose operands has the batch."""
    if name in _ELEMENTWISE:
        shape = eqn.outvars[0].aval.shape
        same = [v if b else _spread(v, size) for v, b in values]
        # A condition or a bound may be a scalar beside arrays.
        full = [v if v.ndim == len(shape) + 1 else lax.broadcast_in_dim(v, (*shape, size), (len(shape),)) for v in same]
        return eqn.primitive.bind(*full, **params)
    whole = [v if b else _spread(v, size) for v, b in values]
    if name in _FRONT_AXES:
        return eqn.primitive.bind(*whole, **params)
    if name == "concatenate":
        return lax.concatenate(whole, params["dimension"])
    if name == "broadcast_in_dim" and len(whole) == 1:
        shape = params["shape"]
        return lax.broadcast_in_dim(whole[0], (*shape, size), (*params["broadcast_dimensions"], len(shape)))
    if name == "reshape" and len(whole) == 1 and params["dimensions"] is None:
        return lax.reshape(whole[0], (*params["new_sizes"], size))
    if name == "slice":
        strides = params["strides"] and (*params["strides"], 1)
        return lax.slice(whole[0], (*params["start_indices"], 0), (*params["limit_indices"], size), strides)
    if name == "transpose":
        return lax.transpose(whole[0], (*params["permutation"], len(params["permutation"])))
    axes = [-1 if b else None for _, b in values]
    return jax.vmap(lambda *v: eqn.primitive.bind(*v, **params), in_axes=axes, out_axes=-1)(*(v for v, _ in values))
