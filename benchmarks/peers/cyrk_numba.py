"""CyRK's C++ solvers under numba (`nbsolve2_ivp`), right-hand sides and the sequence of modes compiled by numba.

They have no events there. As a careful user would: integrate a little beyond the event, whose time an estimate by hand
gives; look for the step in which the guard turns; and solve for the length of that step.
"""

from collections.abc import Callable

from benchmarks.peers.cyrk_scenes import chain, cycles, staged, stop
from benchmarks.scenes import Answer, Case, Chain, Cycles, Staged, Stop

NAME, PACKAGES, PIP, AGREES = "CyRK", ("CyRK", "numba"), "CyRK numba", 1e-9
_METHODS = ("RK45", "DOP853", "Vern8", "LSODA", "RADAU", "BDF")
_SCENES = {Stop: stop, Staged: staged, Chain: chain, Cycles: cycles}


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {f"CyRK {m}": stability if case.stiff and m in ("RK45", "DOP853", "Vern8") else None for m in _METHODS}


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    return _SCENES[type(case.plain)].prepare(case, method.removeprefix("CyRK "), tolerance)
