"""Code of one state runs on batches in the last axis, and shared intermediate values are stored."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax._xla.batch_last import batch_last
from ocjax._xla.dataflow import MIN_SAVED_OPERATIONS, flatten, sites, worth_storing
from tests.support.states import ROOT

pytestmark = pytest.mark.usefixtures("quick_compilation")

FUNCTIONS = {
    "arithmetic": lambda x: (x[0] + 2 * x[1:3] - x[3], jnp.where(x > 5, x, -x)),
    "constants": lambda x: (jnp.arange(3), x[0] * 0 + 7, jnp.zeros((2, 2), jnp.int32)),
    "joined": lambda x: jnp.concatenate([x[::2], jnp.array([1, 2]), x[::-1]]),
    "stacked": lambda x: jnp.stack([x[:3], x[3:6]]).T.reshape(-1),
    "repeated": lambda x: (jnp.repeat(x, 2), jnp.tile(x, 3)),
    "reduced": lambda x: (x.sum(), x.max(), jnp.argmax(x), jnp.any(x > 8), jnp.cumsum(x)),
    "broadcast": lambda x: x[:, None] * jnp.array([1, 10, 100])[None],
    "gathered": lambda x: (
        jnp.array([5, 6, 7, 8, 9, 10])[x % 6],
        jnp.arange(30).reshape(5, 6)[x % 5],
    ),
    "static gather": lambda x: (
        x.at[np.array([4, 0, 3])].get(mode="promise_in_bounds"),
        x.reshape(2, 3)[:, np.array([2, 0])],
    ),
    "rows gathered": lambda x: jnp.arange(30).reshape(5, 6)[x % 5, 1:3],
    "own gather": lambda x: x[x % 6],
    "padded": lambda x: (jnp.pad(x, (1, 2)), jnp.pad(x, 1, constant_values=x[0])),
    "sorted": lambda x: jnp.sort(x),
    "clipped": lambda x: jnp.clip(x, 2, 6),
    "looped": lambda x: jax.lax.fori_loop(0, 3, lambda i, v: v + i * x, x),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_batch_last_is_vmap(name):
    f = FUNCTIONS[name]
    x = np.random.default_rng(0).integers(0, 12, (6, 9), dtype=np.int32)
    got = jax.jit(batch_last(f, jax.ShapeDtypeStruct((6,), jnp.int32)))(x)
    want = jax.vmap(f, in_axes=-1, out_axes=-1)(jnp.asarray(x))
    for a, b in zip(jax.tree.leaves(got), jax.tree.leaves(want), strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)


def program(f, *shape):
    return flatten(jax.make_jaxpr(f)(jax.ShapeDtypeStruct(shape, jnp.int32)))


def stored(f):
    """The operations with stored results."""
    p = program(f, 4)
    values = worth_storing(p)
    return [step.name for step in p.steps if values & {*step.outputs}]


def long(x, n=MIN_SAVED_OPERATIONS):
    """`n` operations."""
    for i in range(n):
        x = x ^ (x + i) if i % 2 else x * (i + 3)
    return x


def test_equal_operations_are_listed_once():
    p = program(lambda x: (jnp.clip(x, 0, 5) + 1, jnp.clip(x, 0, 5) + 1, jnp.clip(x, 0, 6) + 1), 4)
    assert p.outputs[0] == p.outputs[1] != p.outputs[2]
    assert sum(step.name == "add" for step in p.steps) == 2


def test_what_several_results_need_is_stored():
    assert stored(lambda x: (long(x) + 1, long(x) - 1)) == ["xor"]


@pytest.mark.parametrize(
    ("f", "why"),
    [
        (lambda x: (x * 2 + 1, x * 2 - 1), "it is computed again with one operation"),
        (lambda x: long(long(x)), "one result needs it"),
        (lambda x: (long(x), x + 1), "only the argument has several readers"),
    ],
)
def test_what_is_not_stored(f, why):
    assert not stored(f), why


def test_operands_of_concatenations_count():
    assert stored(lambda x: jnp.concatenate([long(x), long(x) + 1])) == ["xor"]


def test_repetitions_by_broadcasts_count():
    def repeats(x):
        return jnp.broadcast_to(long(x, 10)[None], (8, 4)) + 1

    p = program(repeats, 4)
    (value,) = worth_storing(p)
    assert sum(sites(p)[value].values()) == 8


def test_a_value_is_stored_instead_of_its_parts():
    def selects(x):
        rows = long(x, 10)
        return sum(jnp.broadcast_to(rows[i : i + 1], (8,)) for i in range(4))

    assert stored(selects) == ["xor"]


def test_reductions_are_stored():
    assert stored(lambda x: x.max() + 1) == ["reduce_max"]


def test_stored_results_survive_the_compiler():
    f = batch_last(lambda x: (long(x) + 1, long(x) - 1), jax.ShapeDtypeStruct((4,), jnp.int32))
    x = jnp.arange(400, dtype=jnp.int32).reshape(4, 100)
    assert " call(" in jax.jit(f).lower(x).compile().as_text()
    np.testing.assert_array_equal(jax.jit(f)(x)[0], long(x) + 1)


def test_example_of_the_readme():
    readme = ROOT / "ocjax" / "_xla" / "README.md"
    names = {"jnp": jnp}
    exec(re.search(r"```python\n(.*?)```", readme.read_text(), re.DOTALL)[1], names)
    p = program(names["decode"], 2)
    (number,) = worth_storing(p)
    (at,) = (i for i, step in enumerate(p.steps) if number in step.outputs)
    assert (at + 1, len(sites(p)[number])) == (42, 2)
