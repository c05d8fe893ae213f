"""Repeated stops with cooling under CyRK and numba."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.cyrk_scenes.until import searcher
from benchmarks.scenes import CASES, Answer, Case, Cycles

_SIZES = np.array([20.0, 1e3, 50.0, 50.0, 50.0])


@functools.cache
def _compiled(name: str) -> tuple[Any, Any, Any]:
    """Right-hand sides of rest and motion as compiled callbacks, and the guards.

    The lever's line goes with their arguments: its tension at a time, that time, its slope. The guard is `ω` if the
    numbers' first one is 0, else `M − M_load`.
    """
    import numba
    from CyRK import nb_diffeq_addr

    p: Cycles = CASES[name].plain
    fz_0, q, n, R, J = p.f * p.z, p.f * p.z * p.fade, p.n, p.R, p.J
    (C_r, C_l, C_b), (out_r, out_b), G = p.capacities, p.cooling, p.between
    to_rim, to_linings, load, drag = p.share / C_r, (1 - p.share) / C_l, p.load, p.drag

    @numba.njit
    def torque(t, T, line):
        fz = fz_0 - q * T
        return R * (line[0] + line[2] * (t - line[1])) * (((1 + fz) / (1 - fz)) ** n - 1)

    @numba.njit
    def value(t, y, numbers):
        return y[0] if numbers[0] == 0.0 else torque(t, y[3], numbers[1]) - load

    def resting(dy, t, y, args):
        flow = G * (y[3] - y[4])
        dy[0], dy[1], dy[2] = 0.0, 0.0, -out_r * y[2] / C_r
        dy[3], dy[4] = -flow / C_l, (flow - out_b * y[4]) / C_b

    def moving(dy, t, y, args):
        M, flow = torque(t, y[3], args), G * (y[3] - y[4])
        P = M * y[0]
        dy[0], dy[1], dy[2] = (load - drag * y[0] - M) / J, y[0], to_rim * P - out_r * y[2] / C_r
        dy[3], dy[4] = to_linings * P - flow / C_l, (flow - out_b * y[4]) / C_b

    return nb_diffeq_addr(resting), nb_diffeq_addr(moving), value


@functools.cache
def _run(name: str) -> Any:
    """Compiled: all cycles."""
    import numba

    resting, moving, value = _compiled(name)
    until = searcher(value)

    @numba.njit
    def run(corners, tensions, period, count, soon, method, rtol):
        y, steps, times, atols = np.zeros(5), 0, np.full(2 * count, np.nan), rtol * _SIZES
        t, line = 0.0, np.zeros(3)
        for i in range(count):
            # held under the full lever, then until it holds no longer
            start = i * period
            line[:] = tensions[0], start, 0.0
            t, y, more = until(resting, line, t, y, period, start + corners[0], (1.0, line), method, rtol, atols)
            steps += more
            for j in range(3):
                line[:] = (
                    tensions[j],
                    start + corners[j],
                    (tensions[j + 1] - tensions[j]) / (corners[j + 1] - corners[j]),
                )
                end = start + corners[j + 1]
                if j == 0:
                    t, y, more = until(resting, line, t, y, period, end, (1.0, line), method, rtol, atols)
                    times[2 * i], steps = t, steps + more
                t, y, more = until(moving, line, t, y, period, end, (0.0, line), method, rtol, atols)
                steps += more
            line[:] = tensions[3], t, 0.0
            t, y, more = until(moving, line, t, y, soon, start + period, (0.0, line), method, rtol, atols)
            times[2 * i + 1], steps, y[0] = t, steps + more, 0.0
        t, y, more = until(resting, line, t, y, period, period * count, (1.0, line), method, rtol, atols)
        return times, y[1:].copy(), steps + more

    return run


def prepare(case: Case, name: str, tolerance: float) -> Callable[[], Answer]:
    p: Cycles = case.plain
    whole, Pi = _run(case.name), ((1 + p.f * p.z) / (1 - p.f * p.z)) ** p.n
    # by hand: from the speed at which drag holds the load to rest, with the torque of the cold brake, a little later
    soon = 1.3 * p.J * p.load / p.drag / (p.R * p.tensions[-1] * (Pi - 1) - p.load)
    corners, tensions = np.array(p.times), np.array(p.tensions)

    def run() -> Answer:
        times, state, steps = whole(corners, tensions, p.period, p.count, soon, name, tolerance)
        return Answer(times, state, -1, int(steps))

    return run
