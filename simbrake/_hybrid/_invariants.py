"""Loop invariants: what a loop's body computes from nothing that changes is computed once, before the loop.

XLA leaves them where they stand on a CPU. The equations of a body are also taken once each here, however often the
code that traced them asked for the same, which leaves less to compile.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import jax
import jax.extend.core as jex
import numpy as np
from jax.core import Tracer
from jax.extend.core.primitives import cond_p, custom_jvp_call_p, jit_p, scan_p

#: operations that cost less than reading their result from memory: done where they are needed
_CHEAP = {"broadcast_in_dim", "reshape", "squeeze", "expand_dims", "convert_element_type", "iota", "copy", "transpose"}


class _Constant:
    """A number or an array that is known while tracing."""

    def __init__(self, value: Any):
        self.value = value
        array = np.asarray(value)
        weak = getattr(value, "weak_type", isinstance(value, (bool, int, float)))
        # by its bytes: 0.0 and -0.0 are equal and yet not the same
        self.key = (str(array.dtype), weak, array.shape, array.tobytes()) if array.size <= 64 else id(value)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Constant) and self.key == other.key


_Atom = int | _Constant  # a value that is computed, by number, or a constant


class _Operation(NamedTuple):
    perform: Callable[..., Any]
    inputs: tuple[_Atom, ...]
    outputs: tuple[int, ...]
    cheap: bool
    kept: bool  # has effects: neither moved nor dropped


class _Split(NamedTuple):
    before: list[_Operation]
    inside: list[_Operation]
    handed: list[int]  # values from before that are needed inside


class _Equations:
    """The equations of a program in one list, calls inlined, none of them twice; values are numbered.

    Values are `fixed` if they depend on given fixed values (and constants) alone, `moving` if on any other given one,
    and neither if they depend on constants alone: these are folded wherever they stand.
    """

    def __init__(self, given: Sequence[Any], fixed: Iterable[int]):
        self.avals: list[Any] = list(given)  # of all values; the given ones come first
        self.fixed = set(fixed)
        self.moving = set(range(len(self.avals))) - self.fixed
        self.operations: list[_Operation] = []
        self._known: dict[Any, tuple[int, ...]] = {}

    def inline(self, closed: Any, arguments: Iterable[_Atom]) -> list[_Atom]:
        """Adds a program's equations; its results."""
        return self.add(closed.jaxpr, [*map(_Constant, closed.consts), *arguments])

    def add(self, program: Any, atoms: list[_Atom]) -> list[_Atom]:
        env: dict[Any, _Atom] = dict(zip([*program.constvars, *program.invars], atoms, strict=True))

        def read(x: Any) -> _Atom:
            return _Constant(x.val) if isinstance(x, jex.Literal) else env[x]

        for equation in program.eqns:
            outputs = self._equation(equation, tuple(read(x) for x in equation.invars))
            env.update(zip(equation.outvars, outputs, strict=True))
        return [read(x) for x in program.outvars]

    def _equation(self, equation: Any, inputs: tuple[_Atom, ...]) -> Iterable[_Atom]:
        primitive, params = equation.primitive, equation.params
        # a loop is not differentiated through, so that a rule for derivatives may go
        if primitive is jit_p:
            return self.inline(params["jaxpr"], inputs)
        if primitive is custom_jvp_call_p:
            return self.inline(params["call_jaxpr"], inputs)
        if primitive is scan_p and not equation.effects:
            return self._scan(params, inputs)
        avals = [x.aval for x in equation.outvars]
        if primitive is cond_p and not equation.effects:
            return self._branches(params["branches"], inputs, avals)
        key = None if equation.effects else _key(primitive, params, inputs)
        if key is not None and key in self._known:
            return self._known[key]

        def perform(*values: Any) -> Any:
            with equation.ctx.manager:
                found = primitive.bind(*values, **params)
            return found if primitive.multiple_results else [found]

        outputs = self._append(perform, inputs, avals, cheap=primitive.name in _CHEAP, kept=bool(equation.effects))
        if key is not None:
            self._known[key] = outputs
        return outputs

    def _append(self, perform, inputs, avals, *, cheap: bool = False, kept: bool = False) -> tuple[int, ...]:
        outputs = tuple(range(len(self.avals), len(self.avals) + len(avals)))
        self.avals.extend(avals)
        self.operations.append(_Operation(perform, inputs, outputs, cheap, kept))
        taken = _numbers(inputs)
        if kept or taken & self.moving:
            self.moving.update(outputs)
        elif taken & self.fixed:
            self.fixed.update(outputs)
        return outputs

    def _outside(self, inner: "_Equations", split: _Split, inputs: Sequence[_Atom]) -> dict[int, _Atom]:
        """Adds what is fixed within an inner program here; its values by their numbers there."""
        atoms: dict[int, _Atom] = dict(enumerate(inputs))
        for op in split.before:
            taken = tuple(x if isinstance(x, _Constant) else atoms[x] for x in op.inputs)
            found = self._append(op.perform, taken, [inner.avals[x] for x in op.outputs], cheap=op.cheap)
            atoms.update(zip(op.outputs, found, strict=True))
        return atoms

    def _scan(self, params: dict[str, Any], inputs: tuple[_Atom, ...]) -> tuple[int, ...]:
        """A loop within the loop, its own invariants moved out of it."""
        closed, n, k = params["jaxpr"], params["num_consts"], params["num_carry"]
        inner = _Equations(closed.in_avals, range(n))
        results = inner.inline(closed, range(len(closed.in_avals)))
        split = inner.split(results)
        atoms, m = self._outside(inner, split, inputs), len(split.handed)

        def perform(*values: Any) -> list[Any]:
            fixed = dict(zip(split.handed, values[:m], strict=True))

            def body(carry: list[Any], x: list[Any]) -> tuple[list[Any], list[Any]]:
                moving = enumerate([*carry, *x], n)
                found = _results(split.inside, fixed | dict(moving), results)
                return found[:k], found[k:]

            start, xs = list(values[m : m + k]), list(values[m + k :])
            rest = {name: params[name] for name in ("length", "reverse", "unroll")}
            carry, ys = jax.lax.scan(body, start, xs, **rest)
            return [*carry, *ys]

        avals = [x if i < k else x.update(shape=(params["length"], *x.shape)) for i, x in enumerate(closed.out_avals)]
        return self._append(perform, (*(atoms[x] for x in split.handed), *inputs[n:]), avals)

    def _branches(self, branches: Sequence[Any], inputs: tuple[_Atom, ...], avals: list[Any]) -> tuple[int, ...]:
        """One of several programs; what is fixed in any of them is moved out."""
        index, *operands = inputs
        fixed = [i for i, x in enumerate(operands) if isinstance(x, int) and x in self.fixed]
        ways: list[Callable[..., list[Any]]] = []
        handed: list[_Atom] = []
        for closed in branches:
            inner = _Equations(closed.in_avals, fixed)
            given = [x if isinstance(x, _Constant) else i for i, x in enumerate(operands)]
            results = inner.inline(closed, given)
            split = inner.split(results)
            atoms = self._outside(inner, split, operands)
            made = {x for op in split.inside for x in op.outputs}
            needed = _numbers([*results, *(x for op in split.inside for x in op.inputs)]) - made
            places = {x: len(handed) + i for i, x in enumerate(sorted(needed))}
            handed += [atoms[x] for x in places]

            def way(*values: Any, split: _Split = split, places=places, results=results) -> list[Any]:
                return _results(split.inside, {x: values[i] for x, i in places.items()}, results)

            ways.append(way)

        def perform(index: Any, *values: Any) -> list[Any]:
            return jax.lax.switch(index, ways, *values)

        return self._append(perform, (index, *handed), avals)

    def split(self, results: list[_Atom]) -> _Split:
        """What can be done before anything moves, and what cannot."""
        before = [op for op in self.operations if not op.kept and not _numbers(op.outputs) & self.moving]
        inside = [op for op in self.operations if op.cheap or op.kept or not _numbers(op.outputs) & self.fixed]
        inside, taken = _needed(inside, results)
        handed = sorted((taken & self.fixed) - {x for op in inside for x in op.outputs})
        return _Split(_needed(before, handed)[0], inside, handed)


def _key(primitive: Any, params: dict[str, Any], inputs: tuple[_Atom, ...]) -> Any:
    """What is the same for equations that give the same."""
    try:
        key = (primitive, tuple(sorted(params.items(), key=lambda item: item[0])), inputs)
        hash(key)
    except TypeError:
        return None
    return key


def _numbers(atoms: Iterable[_Atom]) -> set[int]:
    return {x for x in atoms if isinstance(x, int)}


def _needed(operations: list[_Operation], wanted: Iterable[_Atom]) -> tuple[list[_Operation], set[int]]:
    """The operations without which `wanted` cannot be had, and all values that are taken."""
    taken, found = _numbers(wanted), []
    for op in reversed(operations):
        if op.kept or taken.intersection(op.outputs):
            found.append(op)
            taken |= _numbers(op.inputs)
    return found[::-1], taken


def _results(operations: list[_Operation], values: dict[int, Any], wanted: Iterable[_Atom]) -> list[Any]:
    """Performs operations on given values."""
    values = dict(values)

    def read(x: _Atom) -> Any:
        return x.value if isinstance(x, _Constant) else values[x]

    for op in operations:
        values.update(zip(op.outputs, op.perform(*map(read, op.inputs)), strict=True))
    return [read(x) for x in wanted]


def hoisted(body: Callable[[Any], Any], carry: Any) -> Callable[[Any], Any]:
    """`body`, a function from and to values like `carry`, without its invariants: they are computed here and now.

    Not to be differentiated: custom rules for derivatives are lost.
    """
    closed, shape = jax.make_jaxpr(body, return_shape=True)(carry)
    outside = [x for x in closed.consts if isinstance(x, Tracer)]
    n = len(outside)
    equations = _Equations([jax.typeof(x) for x in outside] + list(closed.in_avals), range(n))
    numbers = {id(x): i for i, x in enumerate(outside)}
    given: list[_Atom] = [numbers[id(x)] if id(x) in numbers else _Constant(x) for x in closed.consts]
    places = range(n, n + len(closed.in_avals))
    results = equations.add(closed.jaxpr, [*given, *places])
    split = equations.split(results)
    kept = dict(zip(split.handed, _results(split.before, dict(enumerate(outside)), split.handed), strict=True))

    def without(carry: Any) -> Any:
        moving = dict(zip(places, jax.tree.leaves(carry), strict=True))
        return jax.tree.unflatten(jax.tree.structure(shape), _results(split.inside, kept | moving, results))

    return without
