"""Count the equations of a traced function as a compiler sees them: calls inlined, duplicate and dead ones removed.

    count(tidy(program_of(jax.make_jaxpr(function)(*arguments))))

- **Inlined**: functions under `jax.jit`, custom derivatives, rules of `vmap` and checkpoints, which only name a part of
  the program. Of `custom_linear_solve` the solve counts, as nothing else is compiled.
- **Duplicate**: the same primitive with the same parameters on the same values.
- **Dead**: no output depends on it. A value that a loop carries lives if an output or a value that lives needs it.
- A loop and a branch count as one equation and those of their bodies, each body once, tidied in the same way.

This reads jaxprs, whose form changes between releases of JAX; the package itself never does.
"""

from collections.abc import Hashable, Iterable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

#: primitives that only call their one sub-program
_CALLS = {
    "jit",
    "pjit",
    "closed_call",
    "core_call",
    "custom_jvp_call",
    "custom_vjp_call",
    "custom_vmap_call",
    "checkpoint",
    "remat2",
}


class Input(NamedTuple):
    """Argument `index` of a program."""

    index: int


class Constant(NamedTuple):
    """A number or an array that stands in the program."""

    dtype: str
    shape: tuple[int, ...]
    content: bytes


class Output(NamedTuple):
    """Result `index` of equation `equation` of a program."""

    equation: int
    index: int


#: `None`: not needed by anybody
Value = Input | Constant | Output | None


class Equation(NamedTuple):
    """A primitive with its parameters, sub-programs and arguments."""

    primitive: str
    parameters: Hashable
    parts: tuple["Program", ...]
    inputs: tuple[Value, ...]
    effects: bool  # it does something besides giving its outputs


class Program(NamedTuple):
    """Equations in order, and which values leave it; the arguments of a sub-program are those of its equation."""

    equations: tuple[Equation, ...]
    outputs: tuple[Value, ...]

    def used_inputs(self) -> set[int]:
        """Which of its arguments it needs."""
        values = [*self.outputs, *(value for equation in self.equations for value in equation.inputs)]
        return {value.index for value in values if isinstance(value, Input)}


def count(program: Program) -> int:
    """Number of equations, those of the bodies of loops and branches included."""
    return sum(1 + sum(map(count, equation.parts)) for equation in program.equations)


def size(function: Any, *arguments: Any) -> int:
    """Number of equations of `function(*arguments)`; arrays or `jax.ShapeDtypeStruct`s, nothing is computed."""
    return count(tidy(program_of(jax.make_jaxpr(function)(*arguments))))


def program_of(closed: ClosedJaxpr) -> Program:
    """A traced function with its calls inlined."""
    equations: list[Equation] = []
    arguments = tuple(Input(i) for i in range(len(closed.jaxpr.invars)))
    outputs = _inlined(closed, arguments, equations)
    return Program(tuple(equations), outputs)


def _inlined(body: Any, arguments: Iterable[Value], equations: list[Equation]) -> tuple[Value, ...]:
    """Appends the equations of a function called with these arguments; its results."""
    jaxpr, constants = (body.jaxpr, body.consts) if isinstance(body, ClosedJaxpr) else (body, ())
    known = dict(zip(jaxpr.constvars, map(_constant, constants), strict=True))
    known |= dict(zip(jaxpr.invars, arguments, strict=True))

    def value(atom: Any) -> Value:
        return _constant(atom.val, atom.aval.dtype) if isinstance(atom, Literal) else known[atom]

    for eqn in jaxpr.eqns:
        name, inputs = eqn.primitive.name, tuple(map(value, eqn.invars))
        if name in _CALLS:
            (called,) = _bodies(eqn.params)
            results = _inlined(called, inputs, equations)
        elif name == "custom_linear_solve":
            lengths = eqn.params["const_lengths"]
            first, size_ = lengths.matvec + lengths.vecmat, sum(lengths)
            given = (*inputs[first : first + lengths.solve], *inputs[size_:])
            results = _inlined(eqn.params["jaxprs"].solve, given, equations)
        else:
            results = tuple(Output(len(equations), i) for i in range(len(eqn.outvars)))
            equations.append(_equation(eqn, inputs))
        known |= dict(zip(eqn.outvars, results, strict=True))
    return tuple(map(value, jaxpr.outvars))


def _equation(eqn: Any, inputs: tuple[Value, ...]) -> Equation:
    name, bodies = eqn.primitive.name, _bodies(eqn.params)
    if name == "while":
        bodies = [eqn.params["cond_jaxpr"], eqn.params["body_jaxpr"]]
    parts = tuple(program_of(body if isinstance(body, ClosedJaxpr) else ClosedJaxpr(body, ())) for body in bodies)
    if name == "scan":
        # what comes in and goes out along an axis of the loop has one dimension more than in its body
        consumed = sum(a.aval.ndim > b.aval.ndim for a, b in zip(eqn.invars, bodies[0].jaxpr.invars, strict=True))
        stacked = sum(a.aval.ndim > b.aval.ndim for a, b in zip(eqn.outvars, bodies[0].jaxpr.outvars, strict=True))
        carried = len(eqn.outvars) - stacked
        parameters: Hashable = (eqn.params["reverse"], eqn.params["length"], len(inputs) - consumed - carried, carried)
    elif name == "while":
        parameters = (eqn.params["cond_nconsts"], eqn.params["body_nconsts"])
    else:
        others = ((key, value) for key, value in sorted(eqn.params.items()) if not _bodies({key: value}))
        parameters = tuple((key, _hashable(value)) for key, value in others)
    return Equation(name, parameters, parts, inputs, bool(eqn.effects))


def _bodies(parameters: dict[str, Any]) -> list[Any]:
    """Sub-programs among the parameters of an equation."""
    found = []
    for _, value in sorted(parameters.items()):
        items = value if isinstance(value, tuple | list) else (value,)
        found += [item for item in items if isinstance(item, Jaxpr | ClosedJaxpr)]
    return found


def _constant(value: Any, dtype: Any = None) -> Constant:
    array = np.asarray(value, dtype)
    return Constant(str(array.dtype), array.shape, array.tobytes())


def _hashable(value: Any) -> Hashable:
    if isinstance(value, np.ndarray):
        return _constant(value)
    try:
        hash(value)
    except TypeError:
        return repr(value)
    return value


def tidy(program: Program) -> Program:
    """The program without duplicate and dead equations."""
    return _needed_for(program, [True] * len(program.outputs))


def _needed_for(program: Program, used: Iterable[bool]) -> Program:
    """The program for some of its outputs; the others become `None`."""
    outputs = tuple(value if use else None for value, use in zip(program.outputs, used, strict=True))
    before, after = program, _tidied(program._replace(outputs=outputs))
    while after != before:  # what is removed from one body may make it equal to another
        before, after = after, _tidied(after)
    return after


def _tidied(program: Program) -> Program:
    """One pass backwards that leaves out dead equations, and one forwards that merges duplicates."""
    needed: list[set[int]] = [set() for _ in program.equations]
    kept: dict[int, Equation] = {}

    def need(values: Iterable[Value]) -> None:
        for value in values:
            if isinstance(value, Output):
                needed[value.equation].add(value.index)

    need(program.outputs)
    for i, equation in reversed(list(enumerate(program.equations))):
        if needed[i] or equation.effects:
            kept[i] = _restricted(equation, needed[i])
            need(kept[i].inputs)

    equations: list[Equation] = []
    places: dict[int, int] = {}
    first: dict[Equation, int] = {}

    def moved(value: Value) -> Value:
        return Output(places[value.equation], value.index) if isinstance(value, Output) else value

    for i, equation in sorted(kept.items()):
        equation = _shared(equation._replace(inputs=tuple(map(moved, equation.inputs))))
        places[i] = len(equations) if equation.effects else first.setdefault(equation, len(equations))
        if places[i] == len(equations):
            equations.append(equation)
    return Program(tuple(equations), tuple(map(moved, program.outputs)))


def _restricted(equation: Equation, used: set[int]) -> Equation:
    """A loop or a branch of which only some outputs are used: what they do not need becomes `None`."""
    parts, inputs, live = equation.parts, equation.inputs, set(used)
    if equation.primitive == "cond":
        parts = tuple(_needed_for(part, _flags(live, part)) for part in parts)
        operands = {0}.union(*({i + 1 for i in part.used_inputs()} for part in parts))
    elif equation.primitive == "while":
        n, m = equation.parameters
        condition, body = tidy(parts[0]), parts[1]
        live |= {i - n for i in condition.used_inputs() if i >= n}
        body = _closed_over(body, live, m, len(body.outputs))
        operands = {i for i in condition.used_inputs() if i < n} | {i + n for i in body.used_inputs() if i < m}
        operands |= {i + n + m for i in live}
        parts = condition, body
    elif equation.primitive == "scan":
        *_, constants, carried = equation.parameters
        body = _closed_over(parts[0], live, constants, carried)
        operands = {i for i in body.used_inputs() if not 0 <= i - constants < carried}
        operands |= {i + constants for i in live if i < carried}
        parts = (body,)
    else:
        return equation._replace(parts=tuple(map(tidy, parts)))
    return equation._replace(parts=parts, inputs=tuple(x if i in operands else None for i, x in enumerate(inputs)))


def _closed_over(body: Program, live: set[int], constants: int, carried: int) -> Program:
    """The body of a loop for the outputs `live`, to which the carried values that they need are added."""
    while True:
        found = _needed_for(body, _flags(live, body))
        more = {i - constants for i in found.used_inputs() if 0 <= i - constants < carried} - live
        if not more:
            return found
        live |= more


def _flags(live: set[int], program: Program) -> list[bool]:
    return [i in live for i in range(len(program.outputs))]


def _shared(equation: Equation) -> Equation:
    """A loop or a branch that is given one value twice takes it once."""
    inputs, parts = list(equation.inputs), list(equation.parts)
    if equation.primitive == "cond":
        groups = [(range(1, len(inputs)), 1, range(len(parts)))]
    elif equation.primitive == "while":
        n, m = equation.parameters
        groups = [(range(n), 0, (0,)), (range(n, n + m), n, (1,))]
    elif equation.primitive == "scan":
        *_, constants, carried = equation.parameters
        groups = [(range(constants), 0, (0,)), (range(constants + carried, len(inputs)), 0, (0,))]
    else:
        return equation
    for places, offset, users in groups:
        first: dict[Value, int] = {}
        again = {i: first.setdefault(inputs[i], i) for i in places if inputs[i] is not None}
        again = {i: j for i, j in again.items() if i != j}
        if again:
            inputs = [None if i in again else value for i, value in enumerate(inputs)]
            names = {Input(i - offset): Input(j - offset) for i, j in again.items()}
            for k in users:
                parts[k] = _renamed(parts[k], names)
    return equation._replace(inputs=tuple(inputs), parts=tuple(parts))


def _renamed(program: Program, names: dict[Input, Input]) -> Program:
    def name(value: Value) -> Value:
        return names.get(value, value) if isinstance(value, Input) else value

    equations = tuple(e._replace(inputs=tuple(map(name, e.inputs))) for e in program.equations)
    return Program(equations, tuple(map(name, program.outputs)))
