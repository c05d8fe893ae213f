"""CasADi's integrators with zero-crossing events: a whole scene is one call, written
out as C and compiled by gcc.

The mode is a state that the transition function changes, so are the times of events.
The one-step methods `erk` (Dormand and Prince's pair of order 5) and `rosenbrock`
(order 5) locate events on their dense output of order 4. With CVODES it looks for
events at outputs only, and goes back within the last step: where the guess from the
output before is off by more, the search ends with CV_ILL_INPUT. The other scenes need
outputs as close as below; events come to about 1e-9 s whatever the tolerance of their
search.
"""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.casadi_scenes import chain, cycles, staged, stop
from benchmarks.peers.casadi_scenes.form import integrator
from benchmarks.scenes import Answer, Case, Chain, Cycles, Staged, Stop

NAME = "CasADi"
PACKAGES = ("casadi",)
PIP = "'casadi>=3.8.2'"
AGREES = 3e-6
_SCENES = {Stop: stop, Staged: staged, Chain: chain, Cycles: cycles}
#: of expressions and, with the one-step methods, of the whole integrator; in CasADi's
#: own machine without
_COMPILED = ", C"
_METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "CasADi erk": ("erk", {}),
    "CasADi Rosenbrock": ("rosenbrock", {}),
    "CasADi CVODES BDF": (
        "cvodes",
        {"linear_multistep_method": "bdf", "nonlinear_solver_iteration": "newton"},
    ),
    "CasADi CVODES Adams": (
        "cvodes",
        {"linear_multistep_method": "adams", "nonlinear_solver_iteration": "newton"},
    ),
}
#: outputs from start to end at which CVODES looks for events; fewer of them, and some
#: tolerance fails
_OUTPUTS = {Stop: 20, Staged: 100, Chain: 1000}


def methods(case: Case) -> dict[str, str | None]:
    stability = (
        "explicit (or Adams) on a stiff scene: stability asks for millions of steps"
    )
    gcc = shutil.which("gcc")
    found = {}
    for method in _METHODS:
        unstable = (
            stability
            if case.stiff and method in ("CasADi erk", "CasADi CVODES Adams")
            else None
        )
        found[method + _COMPILED] = unstable if gcc else "gcc was not found"
        found[method] = "runs compiled instead, many times faster" if gcc else unstable
    return found


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    plugin, options = _METHODS[method.removesuffix(_COMPILED)]
    if method.endswith(_COMPILED):
        jit = {"flags": ["-O3", "-march=native"], "verbose": False}
        options = options | {"jit": True, "compiler": "shell", "jit_options": jit}
    options = options | {
        "max_num_steps": 1_000_000,
        "event_tol": 1e-15,
        "max_events": 100,
        "max_event_iter": 30,
    }
    form = _SCENES[type(case.plain)].form(case.plain)
    if plugin == "cvodes" and type(case.plain) in _OUTPUTS:
        outputs = np.linspace(0.0, case.plain.end, _OUTPUTS[type(case.plain)] + 1)
        form = form._replace(grid=tuple(outputs.tolist()))
    # what is compiled is written where one stands
    with _quiet(), contextlib.chdir(tempfile.gettempdir()):
        call, found = integrator(form, plugin, tolerance, options)
    call()
    stats = found.stats()
    # CVODES' count of steps begins anew with every event, and in C the one-step methods
    # do not count: not told
    calls = int(stats.get("n_rhs", stats["n_call_daeF"])) or -1
    steps = int(stats.get("n_steps", 0)) or -1

    def run() -> Answer:
        return Answer(*call(), calls, steps)

    return run


@contextlib.contextmanager
def _quiet():
    """Its warning that events are experimental is said in the text above."""
    kept = os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
