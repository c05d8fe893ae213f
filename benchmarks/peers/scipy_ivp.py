"""SciPy's `solve_ivp` with terminal events, mode by mode."""

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.scenes import Answer, Case

NAME = "SciPy"
PACKAGES = ("scipy",)
PIP = "scipy"
AGREES = 1e-9
_METHODS = ("RK45", "DOP853", "LSODA", "Radau", "BDF")


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {
        f"SciPy {m}": stability if case.stiff and m in ("RK45", "DOP853") else None
        for m in _METHODS
    }


def prepare(case: Case, method: str, tolerance: float):
    from scipy.integrate import solve_ivp

    automaton = automaton_of(case)
    method = method.removeprefix("SciPy ")
    implicit = method in ("LSODA", "Radau", "BDF")
    events = {}
    options = {}
    for name, mode in automaton.modes.items():
        events[name] = []
        for guard in mode.guards:

            def event(t, y, value=guard.value):
                return value(t, y)

            event.terminal = True
            event.direction = -1
            events[name].append(event)
        options[name] = {"rtol": tolerance, "atol": tolerance * mode.scales}
        if implicit:
            options[name]["jac"] = mode.jacobian

    def run() -> Answer:
        counts = [0, 0]

        def segment(name, t, y, stop):
            mode = automaton.modes[name]
            found = solve_ivp(
                mode.rhs,
                (t, stop),
                y,
                method,
                events=events[name] or None,
                **options[name],
            )
            if found.status < 0:
                raise RuntimeError(found.message)
            counts[0] += found.nfev
            counts[1] += len(found.t) - 1
            fired = None
            if found.status == 1:
                fired = next(i for i, times in enumerate(found.t_events) if len(times))
            return found.t[-1], found.y[:, -1], fired

        times, state = drive(automaton, case, segment)
        return Answer(times, np.asarray(state), *counts)

    return run
