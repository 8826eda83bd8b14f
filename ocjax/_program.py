"""A traced function as a flat list of operations, and which of their results to store.

XLA computes an operation again in every kernel that reads its result and, within a kernel, in every operand of a concatenation and at every
index that it is read at. The categories of a game share most of their computation, so this multiplies the work of a decoder and the machine
code that has to be compiled. `worth_storing` finds the results for which it is cheaper to be written to memory once.

Measured over the 46 games (one core, batches of 4,096, jax 0.10.2) against nothing stored: TABLE.
"""

import functools
import operator
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from jax.extend.core import ClosedJaxpr, JaxprEqn, Literal

# Operations whose operands and results have one shape.
ELEMENTWISE = frozenset(
    "abs add and clamp clz convert_element_type copy div eq ge gt integer_pow le lt max min mul ne neg not or population_count "
    "rem select_n shift_left shift_right_arithmetic shift_right_logical sign square sub xor".split()
)
# Operations that read their operand at other indices than they write their result.
_MOVES = frozenset("broadcast_in_dim pad reshape rev slice squeeze tile transpose".split())
_JOINS = frozenset("concatenate stack".split())
_FUSED = ELEMENTWISE | _MOVES | _JOINS | frozenset("gather iota".split())  # into the kernels that read the result
# Operations that are fused, too, but with the code of their operands once more for each of their readers, in a loop of its own.
_REDUCTIONS = frozenset("argmax argmin reduce_and reduce_max reduce_min reduce_or reduce_sum".split())
_CALLS = {"jit": "jaxpr", "pjit": "jaxpr", "closed_call": "call_jaxpr", "custom_jvp_call": "call_jaxpr"}
SMALL_CONSTANT = 64  # elements up to which constants are compared by value
WORTH = 30  # operations that storing a result has to save
PASSES = 2  # a stored result makes others cheaper to compute again: in the second pass, those are no longer stored


class Constant(NamedTuple):
    """An operand that is known."""

    value: Any


Operand = int | Constant  # an int numbers a value of the program


class Step(NamedTuple):
    """An operation on numbered values."""

    eqn: JaxprEqn
    inputs: list[Operand]
    outputs: list[int]

    @property
    def name(self) -> str:
        """Of the operation."""
        return self.eqn.primitive.name

    @property
    def values(self) -> Iterator[tuple[int, int]]:
        """The operands that are values: which operand, and which value."""
        return ((k, v) for k, v in enumerate(self.inputs) if not isinstance(v, Constant))


class Program(NamedTuple):
    """Operations in order."""

    steps: list[Step]
    inputs: list[int]
    outputs: list[Operand]
    size: int  # number of values


class _Flattening:
    """The operations that have been listed so far; equal ones are listed once."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.size = 0
        self._known: dict[Any, list[int]] = {}

    def new(self, count: int) -> list[int]:
        """Numbers of new values."""
        self.size += count
        return list(range(self.size - count, self.size))

    def run(self, closed: ClosedJaxpr, args: list[Operand]) -> list[Operand]:
        """List the operations of a function and of those that it calls; its results."""
        jaxpr = closed.jaxpr
        values: dict[Any, Operand] = dict(zip(jaxpr.constvars, map(Constant, closed.consts), strict=True))
        values.update(zip(jaxpr.invars, args, strict=True))
        for eqn in jaxpr.eqns:
            inputs = [Constant(v.val) if isinstance(v, Literal) else values[v] for v in eqn.invars]
            if eqn.primitive.name in _CALLS:
                outputs = self.run(eqn.params[_CALLS[eqn.primitive.name]], inputs)
            else:
                outputs = self._add(eqn, inputs)
            values.update(zip(eqn.outvars, outputs, strict=True))
        return [Constant(v.val) if isinstance(v, Literal) else values[v] for v in jaxpr.outvars]

    def _add(self, eqn: JaxprEqn, inputs: list[Operand]) -> list[int]:
        name = eqn.primitive.name
        key = (name, *map(_key, inputs), str(sorted(eqn.params.items()))) if name in _FUSED else object()
        if key not in self._known:
            self._known[key] = self.new(len(eqn.outvars))
            self.steps.append(Step(eqn, inputs, self._known[key]))
        return self._known[key]


def _key(operand: Operand) -> Any:
    if not isinstance(operand, Constant):
        return operand
    a = np.asarray(operand.value)
    return (a.dtype.str, a.shape, a.tobytes()) if a.size <= SMALL_CONSTANT else id(operand.value)


def flatten(closed: ClosedJaxpr) -> Program:
    """The operations of a function and of those that it calls, one after another, without repetitions."""
    flat = _Flattening()
    inputs = flat.new(len(closed.jaxpr.invars))
    outputs = flat.run(closed, list(inputs))
    return Program(flat.steps, inputs, outputs, flat.size)


def worth_storing(program: Program) -> set[int]:
    """The values that are better stored than computed again in each place that reads them."""
    stored: set[int] = set()
    for _ in range(PASSES):
        places, most = _places(program, stored)
        stored = _stored(program, places, most)
    return stored


def _places(program: Program, stored: set[int]) -> tuple[list[int], list[int]]:
    """For each value, in how many places it is computed if only some values are stored, and the largest number of any of its readers.

    A place is a kernel, or an operand of a concatenation in a kernel, together with the index there at which the value is read.
    """
    places: list[set[Any]] = [set() for _ in range(program.size)]
    most = [0] * program.size
    for i, v in enumerate(program.outputs):
        if not isinstance(v, Constant):
            places[v].add((("output", i), ()))
    for i, step in reversed(list(enumerate(program.steps))):
        fused = step.name in _FUSED
        own = places[step.outputs[0]] if fused and step.outputs[0] not in stored else {(i, ())}
        for k, v in step.values:
            places[v] |= _read(step, i, k, own)
            if fused:
                most[v] = max(most[v], len(own))
    return [len(p) for p in places], most


def _read(step: Step, i: int, k: int, own: set[Any]) -> set[Any]:
    """The places in which the k-th operand of the i-th operation is computed, by those of its result."""
    if step.name in _JOINS:
        return {((kernel, i, k), ()) for kernel, _ in own}
    if step.eqn.invars[k].aval.shape == ():
        return {(kernel, ()) for kernel, _ in own}
    if step.name in _MOVES:
        move = str(step.eqn.params)
        return {(kernel, (index, move)) for kernel, index in own}
    return own


def _stored(program: Program, places: list[int], most: list[int]) -> set[int]:
    """The values whose computation in more places than their readers need them would be too much."""
    stored: set[int] = set()
    needed = [0] * program.size  # one bit for each operation that computing the value again takes
    for i, step in enumerate(program.steps):
        out = step.outputs[0]
        if step.name in _REDUCTIONS:
            stored.add(out)
        if step.name not in _FUSED:
            continue
        needed[out] = functools.reduce(operator.or_, (needed[v] for _, v in step.values), 1 << i)
        saved = needed[out].bit_count() * (places[out] - 1)
        if places[out] > max(1, most[out]) and saved >= WORTH:
            stored.add(out)
            needed[out] = 0
    return stored
