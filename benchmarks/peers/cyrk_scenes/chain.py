"""The chain of linings over the onset of slip under CyRK and numba."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.chain import Linear, sizes_of
from benchmarks.peers.cyrk_scenes.until import linear, searcher
from benchmarks.scenes import CASES, Answer, Case, Chain


@functools.cache
def _address(name: str) -> Any:
    """Right-hand side as a compiled callback; how many linings slide comes with its arguments."""
    import numba
    from CyRK import nb_diffeq_addr

    p: Chain = CASES[name].plain
    known = Linear(p)
    n, R, T_0, m, fz, K, D, J = p.n, p.R, p.T_0, p.m, p.f * p.z, known.K, known.D, p.J

    @numba.njit
    def rates(dy, y, slide):
        stuck = n - slide
        w, after = y[0], 0.0
        # elongations from the anchor on
        for j in range(n):
            i = n - 1 - j
            v = R * w if i < stuck else y[n + 2 + i]
            dy[2 + i] = v - after
            after = v
        before, carried = T_0, 0.0
        for i in range(n):
            T = T_0 + K[i] * y[2 + i] + D[i] * dy[2 + i]
            if i < stuck:
                carried += T - before
            else:
                G = fz * (T + before)
                carried += G
                dy[n + 2 + i] = (G + before - T) / m
            before = T
        alpha = -R * carried / (J + R * R * stuck * m)
        dy[0], dy[1] = alpha, w
        for i in range(stuck):
            dy[n + 2 + i] = R * alpha

    def rhs(dy, t, y, args):
        rates(dy, y, int(args[0]))

    return nb_diffeq_addr(rhs)


@functools.cache
def _run() -> Any:
    """Compiled: the whole scene."""
    import numba

    until = searcher(linear())

    @numba.njit
    def run(address, start, end, horizons, g, h, method, rtol, sizes):
        n = len(horizons) - 1
        t, y, steps, times, args = 0.0, start.copy(), 0, np.full(n, np.nan), np.zeros(1)
        for k in range(n):
            args[0] = k
            t, y, more = until(address, args, t, y, horizons[k], end, (h[k], g[k]), method, rtol, rtol * sizes)
            if t >= end:
                return times, y, steps + more
            times[k], steps = t, steps + more
        args[0] = n
        t, y, more = until(address, args, t, y, end, end, (1.0, 0.0 * g[0]), method, rtol, rtol * sizes)
        return times, y, steps + more

    return run


def prepare(case: Case, name: str, tolerance: float) -> Callable[[], Answer]:
    p: Chain = case.plain
    address, whole, known, sizes = _address(case.name), _run(), Linear(p), sizes_of(p)
    start = np.concatenate([[p.w_0, 0.0], np.zeros(p.n), np.full(p.n, p.R * p.w_0)])
    g, h = np.array(known.g), np.array(known.h)
    # by hand: what the anchor's spring takes up between two limits, and how long a lining takes on its segment
    mu = (1 + known.fz) / (1 - known.fz)
    horizons = p.T_0 * (mu - 1) * mu ** np.arange(p.n + 1) / (p.C * p.R * p.w_0) + np.sqrt(p.m / p.K)

    def run() -> Answer:
        times, y, steps = whole(address, start, p.end, horizons, g, h, name, tolerance, sizes)
        return Answer(times, np.concatenate([y[1::-1], y[2:]]), -1, int(steps))

    return run
