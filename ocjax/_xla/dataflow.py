"""The operations of a traced function as a flat list, and the choice of results to store.

XLA repeats an operation in every kernel that reads its result. Within a kernel, it repeats the operation for every operand of a
concatenation, for every index at which the result is read, and for every element of a broadcast. The categories of a game share most of
their computation, so without countermeasures a decoder computes the same numbers many times, and all of this code has to be compiled.
`worth_storing` finds the results that are cheaper to write to memory once. The README beside this file has an example.
"""

import functools
import math
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

# Operations whose operands and results have one shape.
ELEMENTWISE = frozenset(
    "abs add and clamp clz convert_element_type copy div eq ge gt integer_pow le lt max min mul ne neg not or population_count "
    "rem select_n shift_left shift_right_arithmetic shift_right_logical sign square sub xor".split()
)
# Operations whose operand is read at other indices than the result is written.
_MOVES = frozenset("broadcast_in_dim pad reshape rev slice squeeze tile transpose".split())
_RESHAPES = frozenset("broadcast_in_dim reshape squeeze".split())  # if they keep the number of elements
_JOINS = frozenset("concatenate stack".split())
# Operations that XLA fuses into the kernels that read their results.
_FUSED = ELEMENTWISE | _MOVES | _JOINS | frozenset("gather iota".split())
# Reductions are fused as well, each as a loop that repeats the code of its operands. They are always stored: otherwise, one kernel of Krull
# has 6,000 lines of machine-independent code instead of 400.
_REDUCTIONS = frozenset("argmax argmin reduce_and reduce_max reduce_min reduce_or reduce_sum".split())
_CALLS = {"jit": "jaxpr", "pjit": "jaxpr", "closed_call": "call_jaxpr", "custom_jvp_call": "call_jaxpr"}
SMALL_CONSTANT = 64  # elements up to which constants are compared by value
WORTH = 30  # operations that storing a result has to save in the code
WORTH_EVALUATIONS = 250  # or evaluations of operations for each state, in a loop that computes an element again for many results
MANY = 4  # operations below which computing a result again costs no more than loading it
MORE = 1.01  # how much more often a value must be computed than the operations that read it; the hundredth is for rounding errors
PASSES = 2  # the second pass drops results that have become cheap because the first one stores what they are computed from


class Constant(NamedTuple):
    """An operand that does not depend on the arguments."""

    value: Any


Operand = int | Constant  # an int numbers a value of the program


class Step(NamedTuple):
    """An operation on numbered values."""

    eqn: Any  # of a jaxpr
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
    sizes: list[int]  # elements of each value


class _Flattening:
    """The operations that have been listed so far. Equal operations are listed once."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.sizes: list[int] = []
        self._known: dict[Any, list[int]] = {}

    def new(self, variables: Sequence[Any]) -> list[int]:
        """Number new values, given a jaxpr's variables for them."""
        first = len(self.sizes)
        self.sizes += [max(1, math.prod(v.aval.shape)) for v in variables]
        return list(range(first, len(self.sizes)))

    def run(self, closed: ClosedJaxpr, args: list[Operand]) -> list[Operand]:
        """List the operations of a function and of the functions that it calls, and return its results."""
        jaxpr = closed.jaxpr
        values: dict[Any, Operand] = dict(zip(jaxpr.constvars, map(Constant, closed.consts), strict=True))
        values.update(zip(jaxpr.invars, args, strict=True))
        for eqn in jaxpr.eqns:
            inputs = [Constant(v.val) if isinstance(v, Literal) else values[v] for v in eqn.invars]
            called = _CALLS.get(eqn.primitive.name)
            outputs = self.run(eqn.params[called], inputs) if called else self._add(eqn, inputs)
            values.update(zip(eqn.outvars, outputs, strict=True))
        return [Constant(v.val) if isinstance(v, Literal) else values[v] for v in jaxpr.outvars]

    def _add(self, eqn: Any, inputs: list[Operand]) -> list[int]:
        name = eqn.primitive.name
        key = (name, *map(_key, inputs), str(sorted(eqn.params.items()))) if name in _FUSED else object()
        if key not in self._known:
            self._known[key] = self.new(eqn.outvars)
            self.steps.append(Step(eqn, inputs, self._known[key]))
        return self._known[key]


def _key(operand: Operand) -> Any:
    if not isinstance(operand, Constant):
        return operand
    a = np.asarray(operand.value)
    return (a.dtype.str, a.shape, a.tobytes()) if a.size <= SMALL_CONSTANT else ("constant", id(operand.value))


def flatten(closed: ClosedJaxpr) -> Program:
    """The operations of a function and of the functions that it calls, one after another, without repetitions."""
    flat = _Flattening()
    inputs = flat.new(closed.jaxpr.invars)
    outputs = flat.run(closed, list(inputs))
    return Program(flat.steps, inputs, outputs, flat.sizes)


def worth_storing(program: Program) -> set[int]:
    """The values that are cheaper to store than to compute again in each place that reads them."""
    stored: set[int] = set()
    for _ in range(PASSES):
        stored = _stored(program, demands(program, stored))
    return stored


class Place(NamedTuple):
    """A piece of code that computes a value: equal places share the code and its results."""

    kernel: int  # number of the step at which the kernel ends; of a result of the program: the number of steps + its position
    operands: tuple[tuple[int, int], ...] = ()  # joins on the way from the kernel's end, each as number of the step and operand
    moves: tuple[str, ...] = ()  # since the last join, what changes the index at which the value is read

    def in_operand(self, step: int, k: int) -> Self:
        """The place of the k-th operand of a join: each operand has code of its own."""
        return type(self)(self.kernel, (*self.operands, (step, k)))

    def moved(self, move: str) -> Self:
        """The place of an operand that is read at another index than the result is written."""
        return type(self)(self.kernel, self.operands, (*self.moves, move))

    def anywhere(self) -> Self:
        """The place of a scalar, which has one index."""
        return type(self)(self.kernel, self.operands)


@dataclass
class Demand:
    """Where a value is computed if it is not stored."""

    size: int  # elements of the value
    evaluations: dict[Place, float] = field(default_factory=dict)  # elements that are computed in each place
    most_places: int = 1  # in which an operation that reads the value is computed
    most_times: float = 1.0  # that such an operation computes each element of its result, in the mean

    @property
    def places(self) -> int:
        """The number of places."""
        return len(self.evaluations)

    @property
    def times(self) -> float:
        """How often each element is computed, in the mean."""
        return sum(self.evaluations.values()) / self.size

    def add(self, evaluations: dict[Place, float]) -> None:
        """Add a reader's places; what is computed in one place for two readers is computed once."""
        for place, count in evaluations.items():
            self.evaluations[place] = max(self.evaluations.get(place, 0), count)


def demands(program: Program, stored: set[int]) -> list[Demand]:
    """The demand for each value where some values are stored, which are computed in one place, each element once."""
    found = [Demand(size) for size in program.sizes]
    for i, v in enumerate(program.outputs):
        if not isinstance(v, Constant):
            found[v].add({Place(len(program.steps) + i): program.sizes[v]})
    for i, step in reversed(list(enumerate(program.steps))):
        out = step.outputs[0]
        if step.name not in _FUSED:
            for _, v in step.values:
                found[v].add({Place(i): program.sizes[v]})
            continue
        own = Demand(program.sizes[out], {Place(i): program.sizes[out]}) if out in stored else found[out]
        places, times = own.places, own.most_times if _is_reshape(step) else own.times
        for k, v in step.values:
            found[v].add(_read(step, i, k, own))
            found[v].most_places = max(found[v].most_places, places)
            found[v].most_times = max(found[v].most_times, times)
    return found


def _is_reshape(step: Step) -> bool:
    """Whether the result is the operand in another shape; what is broadcast is stored before, as XLA may store the result transposed."""
    if step.name not in _RESHAPES or len(step.eqn.invars) > 1:
        return False
    return math.prod(step.eqn.invars[0].aval.shape) == math.prod(step.eqn.outvars[0].aval.shape)


def _read(step: Step, i: int, k: int, own: Demand) -> dict[Place, float]:
    """The evaluations of the k-th operand of the i-th operation, given those of its result."""
    places = own.evaluations
    if step.name in _JOINS:
        part = math.prod(step.eqn.invars[k].aval.shape) / own.size
        return {place.in_operand(i, k): n * part for place, n in places.items()}
    if step.eqn.invars[k].aval.shape == ():
        return {place.anywhere(): n for place, n in places.items()}
    if step.name in _MOVES:
        move = str(step.eqn.params)
        return {place.moved(move): n for place, n in places.items()}
    return places


def _stored(program: Program, found: list[Demand]) -> set[int]:
    """The values that are computed more often than any of their readers, at the cost of many operations."""
    stored: set[int] = set()
    needed = [0] * len(found)  # one bit for each operation that computing the value again takes
    for i, step in enumerate(program.steps):
        out = step.outputs[0]
        if step.name in _REDUCTIONS:
            stored.add(out)
        if step.name not in _FUSED:
            continue
        needed[out] = functools.reduce(operator.or_, (needed[v] for _, v in step.values), 1 << i)
        operations = needed[out].bit_count()
        if _has_many_places(found[out], operations) or (not _is_reshape(step) and _is_repeated(found[out], operations)):
            stored.add(out)
            needed[out] = 0
    return stored


def _has_many_places(demand: Demand, operations: int) -> bool:
    """Whether storing the value saves much code."""
    return demand.places > demand.most_places and operations * (demand.places - 1) >= WORTH


def _is_repeated(demand: Demand, operations: int) -> bool:
    """Whether storing the value saves many evaluations of operations."""
    more = demand.times > MORE * demand.most_times
    return more and operations >= MANY and operations * (demand.times - 1) * demand.size >= WORTH_EVALUATIONS
