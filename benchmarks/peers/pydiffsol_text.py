"""diffsol through pydiffsol: each program of the modes as a text of its language, with
a stop where a guard is 0.

Start, numbers and time of a mode are parameters, so that a text is compiled once. It
tells neither which guard stopped it (the one nearest to 0 in its own size has) nor how
much it evaluated, and has one absolute tolerance for all states. Errors of the many
steps of tr_bdf2, of order 2, add up to 1e-6.
"""

from collections.abc import Callable
from typing import Any, Self

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.peers.written import written
from benchmarks.peers.written.form import Program, Words
from benchmarks.scenes import Answer, Case

NAME = "pydiffsol"
PACKAGES = ("pydiffsol",)
PIP = "'pydiffsol>=0.6.2'"
AGREES = 2e-6
_METHODS = ("tsit45", "bdf", "esdirk34", "tr_bdf2")


class Text:
    """An expression as text."""

    def __init__(self, text: str):
        self.text = text

    def _joined(self, other: Any, sign: str, turned: bool = False) -> Self:
        a = self.text
        b = other.text if isinstance(other, Text) else repr(float(other))
        if turned:
            a, b = b, a
        return type(self)(f"({a} {sign} {b})")

    def __add__(self, other: Any) -> Self:
        return self._joined(other, "+")

    def __radd__(self, other: Any) -> Self:
        return self._joined(other, "+", True)

    def __sub__(self, other: Any) -> Self:
        return self._joined(other, "-")

    def __rsub__(self, other: Any) -> Self:
        return self._joined(other, "-", True)

    def __mul__(self, other: Any) -> Self:
        return self._joined(other, "*")

    def __rmul__(self, other: Any) -> Self:
        return self._joined(other, "*", True)

    def __truediv__(self, other: Any) -> Self:
        return self._joined(other, "/")

    def __neg__(self) -> Self:
        return type(self)(f"(0.0 - {self.text})")

    def __pow__(self, power: int) -> Self:
        return type(self)(f"pow({self.text}, {float(power)})")


def text_of(program: Program, numbers: int) -> str:
    """The program in diffsol's language: inputs are the state at the start and the
    numbers."""
    names: list[str] = []

    def let(x: Text) -> Text:
        names.append(x.text)
        return Text(f"k{len(names) - 1}")

    y, q = (
        [Text(f"{name}{i}") for i in range(n)]
        for name, n in (("y", program.states), ("q", numbers))
    )
    words = Words(lambda x: Text(f"exp({x.text})"), let)
    rates, guards = program.equations(words, Text("t"), y, q)
    inputs = [f"s{i} = 1.0" for i in range(program.states)] + [
        f"q{i} = 1.0" for i in range(numbers)
    ]
    blocks = [f"in_i {{ {', '.join(inputs)} }}"]
    blocks.append(
        "u_i { " + ", ".join(f"y{i} = s{i}" for i in range(program.states)) + " }"
    )
    blocks += [f"k{i} {{ {text} }}" for i, text in enumerate(names)]
    for name, values in (("F_i", rates), ("stop_i", guards)):
        if values:
            blocks.append(f"{name} {{ {', '.join(value.text for value in values)} }}")
    return "\n".join(blocks)


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {
        f"diffsol {m}": stability if case.stiff and m == "tsit45" else None
        for m in _METHODS
    }


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    import pydiffsol as ds

    kind = {
        "tsit45": ds.tsit45,
        "bdf": ds.bdf,
        "esdirk34": ds.esdirk34,
        "tr_bdf2": ds.tr_bdf2,
    }
    automaton = automaton_of(case)
    modes = written(case)
    known = {}
    for mode, form in modes.items():
        if form.program not in known:
            text = text_of(form.program, len(form.numbers(0.0)))
            ode = known[form.program] = ds.Ode(
                text, ode_solver=kind[method.removeprefix("diffsol ")]
            )
            ode.rtol = tolerance
            ode.atol = tolerance * float(np.min(automaton.modes[mode].scales))

    def run() -> Answer:
        steps = 0

        def segment(
            name: str, t: float, y: Any, stop: float
        ) -> tuple[float, Any, int | None]:
            nonlocal steps
            form = modes[name]
            guards = automaton.modes[name].guards
            ode = known[form.program]
            ode.t0 = t
            found = ode.solve(np.concatenate([y, form.numbers(t)]), stop)
            end = float(found.ts[-1])
            row = found.ys[:, -1]
            steps += len(found.ts) - 1
            if end >= stop or not guards:
                return stop, row, None
            if len(guards) == 1:
                return end, row, 0
            sizes = [abs(guard.value(end, row) / guard.value(t, y)) for guard in guards]
            return end, row, sizes.index(min(sizes))

        times, state = drive(automaton, case, segment)
        return Answer(times, np.asarray(state), -1, steps)

    return run
