"""CasADi's integrators with zero-crossing events: a whole scene is one compiled call.

The mode is a state that the transition function changes, so are the times of events. The one-step methods `erk`
(Dormand and Prince's pair of order 5) and `rosenbrock` (order 5) locate events on their dense output of order 4. With
CVODES it looks for events at outputs only, and goes back within the last step: where the guess from the output before
is off by more, the search ends with CV_ILL_INPUT. The other scenes need outputs as close as below; events come to about
1e-9 s whatever the tolerance of their search.
"""

import contextlib
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.casadi_scenes import chain, cycles, staged, stop
from benchmarks.peers.casadi_scenes.form import integrator
from benchmarks.scenes import Answer, Case, Chain, Cycles, Staged, Stop

NAME, PACKAGES, PIP, AGREES = "CasADi", ("casadi",), "'casadi>=3.8.2'", 3e-6
_SCENES = {Stop: stop, Staged: staged, Chain: chain, Cycles: cycles}
_METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "CasADi erk": ("erk", {}),
    "CasADi Rosenbrock": ("rosenbrock", {}),
    "CasADi CVODES BDF": ("cvodes", {"linear_multistep_method": "bdf", "nonlinear_solver_iteration": "newton"}),
    "CasADi CVODES Adams": ("cvodes", {"linear_multistep_method": "adams", "nonlinear_solver_iteration": "newton"}),
}
#: outputs from start to end at which CVODES looks for events; fewer of them, and some tolerance fails
_OUTPUTS = {Stop: 20, Staged: 100, Chain: 1000}


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit (or Adams) on a stiff scene: stability asks for millions of steps"
    return {m: stability if case.stiff and m in ("CasADi erk", "CasADi CVODES Adams") else None for m in _METHODS}


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    plugin, options = _METHODS[method]
    options = options | {"max_num_steps": 1_000_000, "event_tol": 1e-15, "max_events": 100, "max_event_iter": 30}
    form = _SCENES[type(case.plain)].form(case.plain)
    if plugin == "cvodes" and type(case.plain) in _OUTPUTS:
        outputs = np.linspace(0.0, case.plain.end, _OUTPUTS[type(case.plain)] + 1)
        form = form._replace(grid=tuple(outputs.tolist()))
    with _quiet():
        call = integrator(form, plugin, tolerance, options)

    def run() -> Answer:
        times, state, stats = call()
        # the one-step methods count all; CVODES' count of steps begins anew with every event: not told
        calls, steps = (stats["n_rhs"], stats["n_steps"]) if "n_rhs" in stats else (stats["n_call_daeF"], -1)
        return Answer(times, state, int(calls), int(steps))

    return run


@contextlib.contextmanager
def _quiet():
    """Its warning that events are experimental is said in the text above."""
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
