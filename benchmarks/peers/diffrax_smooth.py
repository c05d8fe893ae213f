"""diffrax by itself: one solve of a smoothed brake, as is done where events are to be
avoided.

Friction carries tanh of the slip speed over a small share `ε` of the scene's speed, so
that what sticks creeps. The times of events are read from the dense output, where
speeds pass a threshold of that size. The answer tends to that of the smoothed brake:
its distance from the brake itself is a floor that no tolerance passes. Where slip sets
in slowly the time of its onset is late by a multiple of `√ε`.
"""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.diffrax_scenes import staged, stop
from benchmarks.peers.diffrax_scenes.smooth import compiled
from benchmarks.scenes import CASES, Answer, Case, Staged, Stop

NAME = "diffrax"
PACKAGES = ("diffrax",)
PIP = "diffrax"
AGREES = 0.3
_SCENES = {Stop: stop, Staged: staged}
_SHARES = {Stop: (1e-2, 1e-4), Staged: (1e-2, 1e-4, 1e-6)}
#: step attempts to make room for
_ROOM = 16384


def _methods(case: Case) -> dict[str, tuple[str, float]]:
    """Solvers and `ε` by name: the explicit one with the coarsest only."""
    shares = _SHARES[type(case.plain)]
    pairs = [("Tsit5", shares[0]), *(("Kvaerno5", share) for share in shares)]
    return {
        f"diffrax {kind}, tanh ε={share:.0e}".replace("e-0", "e-"): (kind, share)
        for kind, share in pairs
    }


def methods(case: Case) -> dict[str, str | None]:
    if type(case.plain) not in _SCENES:
        return {}
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {
        name: stability if case.stiff and m == "Tsit5" else None
        for name, (m, _) in _methods(case).items()
    }


@functools.cache
def _compiled(name: str, method: str) -> Callable[[Any], Any]:
    case = CASES[name]
    kind, share = _methods(case)[method]
    return compiled(_SCENES[type(case.plain)].smooth(case.plain, share), kind, _ROOM)


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    call = _compiled(case.name, method)
    rtol = np.float64(tolerance)
    events = len(case.events)
    stages = {"Tsit5": 6, "Kvaerno5": 6}[_methods(case)[method][0]]

    def run() -> Answer:
        out = np.asarray(call(rtol))
        accepted, attempts, failed = (int(n) for n in out[-3:])
        if failed:
            raise RuntimeError(f"no solution within {_ROOM} steps")
        # explicit stages; of the implicit one, its stages without their iterations
        return Answer(out[:events], out[events:-3], stages * attempts, accepted)

    return run
