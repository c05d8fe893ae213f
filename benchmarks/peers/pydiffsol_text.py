"""diffsol through pydiffsol: each program of the modes as a text of its language, with
a stop where a guard is 0.

Start, numbers and time of a mode are parameters, so that a text is compiled once. It
tells neither which guard stopped it (the one nearest to 0 in its own size has) nor how
much it evaluated, and has one absolute tolerance for all states. Errors of the many
steps of tr_bdf2, of order 2, add up to 1e-6.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.peers.written import written
from benchmarks.peers.written.form import Program, Words
from benchmarks.scenes import Answer, Case

NAME = "pydiffsol"
PACKAGES = ("pydiffsol", "sympy")
PIP = "'pydiffsol>=0.6.2' sympy"
AGREES = 2e-6
_METHODS = ("tsit45", "bdf", "esdirk34", "tr_bdf2")


def text_of(program: Program, numbers: int) -> str:
    """The program in diffsol's language: inputs are the state at the start and the
    numbers."""
    import sympy

    kept = []

    def let(x: Any) -> Any:
        kept.append(x)
        return sympy.Symbol(f"k{len(kept) - 1}")

    y = sympy.symbols(f"y:{program.states}", seq=True)
    q = sympy.symbols(f"q:{numbers}", seq=True)
    words = Words(sympy.exp, let)
    rates, guards = program.equations(words, sympy.Symbol("t"), y, q)
    inputs = [f"s{i} = 1.0" for i in range(program.states)]
    inputs += [f"q{i} = 1.0" for i in range(numbers)]
    starts = [f"y{i} = s{i}" for i in range(program.states)]
    blocks = [f"in_i {{ {', '.join(inputs)} }}", f"u_i {{ {', '.join(starts)} }}"]
    blocks += [f"k{i} {{ {sympy.ccode(value)} }}" for i, value in enumerate(kept)]
    for name, values in (("F_i", rates), ("stop_i", guards)):
        if values:
            blocks.append(f"{name} {{ {', '.join(map(sympy.ccode, values))} }}")
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
