"""SUNDIALS CVODE through scikit-sundae, with its root finding, mode by mode."""

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.scenes import Answer, Case

NAME = "scikit-sundae"
PACKAGES = ("sksundae",)
PIP = "scikit-sundae"
AGREES = 1e-9


def methods(case: Case) -> dict[str, str | None]:
    adams = "Adams on a stiff scene: stability asks for millions of steps"
    return {
        "sundae CVODE BDF": None,
        "sundae CVODE Adams": adams if case.stiff else None,
    }


def _solver(mode, method: str, tolerance: float):
    from sksundae.cvode import CVODE

    rhs = mode.rhs
    jacobian = mode.jacobian
    guards = mode.guards

    def rhsfn(t, y, yp):
        yp[:] = rhs(t, y)

    def jacfn(t, y, yp, J):
        J[:, :] = jacobian(t, y)

    more = {}
    if guards:

        def eventsfn(t, y, events):
            for i, guard in enumerate(guards):
                events[i] = guard.value(t, y)

        # pyright: ignore
        eventsfn.terminal = [True] * len(guards)
        eventsfn.direction = [-1] * len(guards)
        more = {"eventsfn": eventsfn, "num_events": len(guards)}
    return CVODE(
        rhsfn,
        method=method,
        rtol=tolerance,
        atol=tolerance * mode.scales,
        jacfn=jacfn,
        max_num_steps=1_000_000,
        **more,
    )


def prepare(case: Case, method: str, tolerance: float):
    automaton = automaton_of(case)
    kind = method.removeprefix("sundae CVODE ")
    moving = {
        name: mode for name, mode in automaton.modes.items() if mode.rhs is not None
    }
    guards = {name: mode.guards for name, mode in moving.items()}
    solvers = {name: _solver(mode, kind, tolerance) for name, mode in moving.items()}

    def run() -> Answer:
        counts = [0, 0]

        def segment(name, t, y, stop):
            found = solvers[name].solve(np.array([t, stop]), np.asarray(y, dtype=float))
            if not found.success and found.status < 0:
                raise RuntimeError(found.message)
            counts[0] += found.nfev
            counts[1] += len(found.t) - 1
            fired = None
            t = float(found.t[-1])
            y = found.y[-1].copy()
            if found.t_events is not None and len(found.t_events):
                fired = int(np.flatnonzero(found.i_events[-1])[0])
                # its steps go beyond `stop`: a root behind it is told, but is none of
                # this piece of the lever
                if t >= stop and guards[name][fired].value(t, y) > 0:
                    fired = None
            return t, y, fired

        times, state = drive(automaton, case, segment)
        return Answer(times, np.asarray(state), *counts)

    return run
