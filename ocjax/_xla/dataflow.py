"""Flat list of the operations of a traced function, and the choice of results to store.

XLA computes a result again in every kernel that reads it, and for each repetition by a broadcast.
`worth_storing` finds the results that are cheaper to write to memory once. The README beside this
file has an example.
"""

import functools
import operator
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

# Operations with operands and results of one shape.
ELEMENTWISE = frozenset(
    "abs add and clamp clz convert_element_type copy div eq ge gt integer_pow le lt max min mul "
    "ne neg not or population_count "
    "rem select_n shift_left shift_right_arithmetic shift_right_logical sign square sub xor".split()
)
_MOVES = frozenset(
    "broadcast_in_dim gather iota pad reshape rev slice squeeze tile transpose".split()
)
# Operations that read one part of an operand. The operand is stored instead of its parts.
_PARTS = frozenset("slice squeeze".split())
_JOINS = frozenset("concatenate stack".split())
# Operations that XLA fuses into the kernels that read their results.
_FUSED = ELEMENTWISE | _MOVES | _JOINS
# XLA fuses reductions, too, each as a loop that repeats the code of its operands: one kernel of
# Krull would have 6,000 lines of machine-independent code instead of 400. They are always stored.
_REDUCTIONS = frozenset(
    "argmax argmin reduce_and reduce_max reduce_min reduce_or reduce_sum".split()
)
_CALLS = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
}
# Elements. Constants with more elements are compared by identity, which limits the keys' length.
MAX_COMPARED_ELEMENTS = 64
# Operations in the code that storing a result must save. With 14 or 20 no game is faster. Rows
# `stored values` of benchmarks/tricks.py.
MIN_SAVED_OPERATIONS = 30


class Constant(NamedTuple):
    """An operand that does not depend on the arguments."""

    value: Any


Operand = int | Constant  # an int is the number of a value of the program
Site = tuple[int, int]  # number of an operation, and of its operand or of a result


class Step(NamedTuple):
    """An operation on numbered values."""

    eqn: Any  # equation of a jaxpr
    inputs: list[Operand]
    outputs: list[int]

    @property
    def name(self) -> str:
        """The name of the operation."""
        return self.eqn.primitive.name

    @property
    def values(self) -> Iterator[tuple[int, int]]:
        """The position and the number of every operand that is not a constant."""
        return ((k, v) for k, v in enumerate(self.inputs) if not isinstance(v, Constant))


class Program(NamedTuple):
    """Operations in order."""

    steps: list[Step]
    inputs: list[int]
    outputs: list[Operand]
    num_values: int


class _Flattening:
    """The list of operations so far. Equal operations are listed once."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.num_values = 0
        self._known: dict[Any, list[int]] = {}

    def new(self, count: int) -> list[int]:
        """Number new values."""
        first = self.num_values
        self.num_values += count
        return list(range(first, self.num_values))

    def run(self, closed: ClosedJaxpr, args: list[Operand]) -> list[Operand]:
        """List the operations of a function, including inner functions, and return its results."""
        jaxpr = closed.jaxpr
        values: dict[Any, Operand] = dict(
            zip(jaxpr.constvars, map(Constant, closed.consts), strict=True)
        )
        values.update(zip(jaxpr.invars, args, strict=True))
        for eqn in jaxpr.eqns:
            inputs = [Constant(v.val) if isinstance(v, Literal) else values[v] for v in eqn.invars]
            called = _CALLS.get(eqn.primitive.name)
            outputs = self.run(eqn.params[called], inputs) if called else self._add(eqn, inputs)
            values.update(zip(eqn.outvars, outputs, strict=True))
        return [Constant(v.val) if isinstance(v, Literal) else values[v] for v in jaxpr.outvars]

    def _add(self, eqn: Any, inputs: list[Operand]) -> list[int]:
        name = eqn.primitive.name
        key = (
            (name, *map(_key, inputs), str(sorted(eqn.params.items())))
            if name in _FUSED
            else object()
        )
        if key not in self._known:
            self._known[key] = self.new(len(eqn.outvars))
            self.steps.append(Step(eqn, inputs, self._known[key]))
        return self._known[key]


def _key(operand: Operand) -> Any:
    if not isinstance(operand, Constant):
        return operand
    a = np.asarray(operand.value)
    return (
        (a.dtype.str, a.shape, a.tobytes())
        if a.size <= MAX_COMPARED_ELEMENTS
        else ("constant", id(operand.value))
    )


def flatten(closed: ClosedJaxpr) -> Program:
    """List the operations of a function, including inner functions, without repetitions."""
    flat = _Flattening()
    inputs = flat.new(len(closed.jaxpr.invars))
    outputs = flat.run(closed, list(inputs))
    return Program(flat.steps, inputs, outputs, flat.num_values)


def sites(program: Program) -> list[dict[Site, int]]:
    """Find the evaluation sites of each value if nothing is stored.

    A site is a kernel or an operand of a join, by the number of its operation. The count of a site
    is the number of times it evaluates the value: a broadcast repeats its operand.
    """
    found: list[dict[Site, int]] = [{} for _ in range(program.num_values)]
    for i, value in enumerate(program.outputs):
        if not isinstance(value, Constant):
            found[value][len(program.steps), i] = 1
    for i, step in reversed(list(enumerate(program.steps))):
        for k, value in step.values:
            for site, count in _sites_of_operand(step, i, k, found[step.outputs[0]]).items():
                found[value][site] = max(count, found[value].get(site, 0))
    return found


def _sites_of_operand(step: Step, i: int, k: int, own: dict[Site, int]) -> dict[Site, int]:
    if step.name not in _FUSED:
        return {(i, 0): 1}
    if step.name in _JOINS:
        return {(i, k): max(own.values(), default=1)}
    return {site: count * _repetitions(step) for site, count in own.items()}


def _repetitions(step: Step) -> int:
    """The number of times that a kernel evaluates the operand for each evaluation of the result.

    Scalars in element-wise operations also repeat, but counting them makes no game faster.
    """
    if step.name != "broadcast_in_dim":
        return 1
    (operand,) = step.eqn.invars
    (result,) = step.eqn.outvars
    return result.aval.size // max(1, operand.aval.size)


def worth_storing(program: Program) -> set[int]:
    """Choose the results of reductions, and the values that are cheaper to store.

    A value is not stored if an operation that reads it is evaluated at least equally often: that
    operation's result may be stored instead.
    """
    evaluations = [sum(of_value.values()) for of_value in sites(program)]
    most = _most_evaluations_of_readers(program, evaluations)
    stored: set[int] = set()
    # A bit for each operation that is needed to compute the value again.
    needed = [0] * program.num_values
    for i, step in enumerate(program.steps):
        out = step.outputs[0]
        if step.name in _FUSED:
            needed[out] = functools.reduce(
                operator.or_, (needed[value] for _, value in step.values), 1 << i
            )
        extra = evaluations[out] - 1
        saved = extra * needed[out].bit_count()
        is_cheaper = extra >= most[out] and saved >= MIN_SAVED_OPERATIONS
        if step.name in _REDUCTIONS or (is_cheaper and step.name not in _PARTS):
            stored.add(out)
            needed[out] = 0
    return stored


def _most_evaluations_of_readers(program: Program, evaluations: Sequence[int]) -> list[int]:
    """For each value, the evaluations of the operation that reads it and is evaluated most often.

    What reads a part of a value reads the value.
    """
    most = [1] * program.num_values
    for step in reversed(program.steps):
        out = step.outputs[0]
        if step.name in _PARTS:
            count = most[out]
        elif step.name in _FUSED:
            count = evaluations[out]
        else:
            count = 1
        for _, value in step.values:
            most[value] = max(most[value], count)
    return most
