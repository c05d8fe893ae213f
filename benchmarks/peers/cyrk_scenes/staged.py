"""The stop of a staged brake under CyRK and numba."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.cyrk_scenes.until import searcher
from benchmarks.scenes import CASES, Answer, Case, Staged
from benchmarks.staged import Tensions


@functools.cache
def _value() -> Any:
    """The guard `c_0 + c·y + c_e exp(−t/τ)`, compiled."""
    import numba

    @numba.njit
    def value(t, y, numbers):
        found, c, c_e, decay = numbers
        found += c_e * math.exp(-t * decay)
        for j in range(len(c)):
            found += c[j] * y[j]
        return found

    return value


@functools.cache
def _addresses(name: str):
    """Right-hand sides of the staged brake as compiled callbacks, and the guard of internal slip."""
    from CyRK import nb_diffeq_addr

    p: Staged = CASES[name].plain
    known, rim, together = Tensions(p), p.R * p.f_int, p.J + p.J_b
    grip, full, preload = p.R_b * (known.top - 1), rim * float(known.slack[-1]), rim * p.n * p.preload
    level, load, J, J_b, decay, n = p.level, p.load, p.J, p.J_b, 1 / p.tau, p.n
    first = math.exp(-p.ahead * decay)
    # `M_int(T_n)` is concave: of the roots on those of its pieces that are less steep than R_b the least is meant
    below = p.R_b - rim * known.tight[:n]
    flat = below > 0
    below, slack = below[flat], known.slack[:n][flat]
    c_0, c_1, n = p.R_b * preload / below, p.R_b * ((p.R_b + rim * slack) / below - 1), len(below)

    def ride(dy, t, y, args):
        M = grip * level * (1 - first * math.exp(-t * decay))
        a = (load - M) / together
        dy[0], dy[1], dy[2], dy[3], dy[4] = a, a, y[0], M * y[0], 0.0

    def both(dy, t, y, args):
        T_0 = level * (1 - first * math.exp(-t * decay))
        M_int, M_ext = preload + full * T_0, grip * T_0
        dy[0], dy[1], dy[2] = (load - M_int) / J, (M_int - M_ext) / J_b, y[0]
        dy[3], dy[4] = M_ext * y[1], M_int * (y[0] - y[1])

    def locked(dy, t, y, args):
        T_0 = level * (1 - first * math.exp(-t * decay))
        M = c_0[0] + c_1[0] * T_0
        for k in range(1, n):
            M = min(M, c_0[k] + c_1[k] * T_0)
        dy[0], dy[1], dy[2], dy[3], dy[4] = (load - M) / J, 0.0, y[0], 0.0, M * y[0]

    rise = full - grip + J_b * grip / together
    margin = (preload - J_b * load / together + rise * level, -rise * level * first, decay)
    return tuple(nb_diffeq_addr(f) for f in (ride, both, locked)), margin


@functools.cache
def _run():
    """Compiled: the whole stop of the staged brake."""
    import numba

    until = searcher(_value())

    @numba.njit
    def run(addresses, margin, w_0, end, method, rtol):
        atols = rtol * np.array([20.0, 20.0, 10.0, 1e5, 1e5])
        y, c, none, times = np.array([w_0, w_0, 0.0, 0.0, 0.0]), np.zeros(5), np.zeros(1), np.zeros(3)
        # a quarter of a second to look ahead, about the time in which the lever fills
        t, y, steps = until(addresses[0], none, 0.0, y, 0.25, end, (margin[0], c, *margin[1:]), method, rtol, atols)
        times[0], c[1] = t, 1.0
        t, y, more = until(addresses[1], none, t, y, 0.25, end, (0.0, c, 0.0, 0.0), method, rtol, atols)
        times[1], steps = t, steps + more
        y[1], c[1], c[0] = 0.0, 0.0, 1.0
        t, y, more = until(addresses[2], none, t, y, 0.25, end, (0.0, c, 0.0, 0.0), method, rtol, atols)
        times[2] = t
        return times, y[2:].copy(), steps + more

    return run


def prepare(case: Case, name: str, tolerance: float) -> Callable[[], Answer]:
    p: Staged = case.plain
    (addresses, margin), whole = _addresses(case.name), _run()

    def run() -> Answer:
        times, state, steps = whole(addresses, margin, p.w_0, p.end, name, tolerance)
        return Answer(times, state, -1, int(steps))

    return run
