"""A stop of one band under CyRK and numba, with heat or without."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.cyrk_scenes.until import searcher
from benchmarks.scenes import CASES, Answer, Case, Stop


@functools.cache
def _value() -> Any:
    """The guard `c_0 + c·y` of `numbers = (c_0, c, more)`, less `ẋ_0` where `more` says how the band follows fade."""
    import numba

    @numba.njit
    def value(t, y, numbers):
        found, c, (fz_0, q, T_0, n, per_C, mid, up) = numbers
        for j in range(len(c)):
            found += c[j] * y[j]
        if per_C:
            fz = fz_0 - q * y[2]
            slope = -2 * n * q * T_0 * ((1 + fz) / (1 - fz)) ** n / (1 - fz * fz)
            found -= slope * per_C * (mid * y[2] + up * y[3])
        return found

    return value


@functools.cache
def _addresses(name: str) -> tuple[Any, ...]:
    """Right-hand sides of take-up, elastic, full slip, stick and rest as compiled callbacks."""
    from CyRK import nb_diffeq_addr

    p: Stop = CASES[name].plain
    R, arm, C, T_0, n, fz_0 = p.R, p.R / p.J, p.C, p.T_0, p.n, p.f * p.z

    def take_up(dy, t, y, args):
        dy[0], dy[1], dy[2] = 0.0, y[0], R * y[0]

    def elastic(dy, t, y, args):
        dy[0], dy[1], dy[2] = -arm * (C * y[2] - T_0), y[0], R * y[0]

    if p.rates is None:
        slowing = -arm * T_0 * (p.Pi - 1)

        def dry(dy, t, y, args):
            dy[0], dy[1] = slowing, y[0]

        return (*(nb_diffeq_addr(f) for f in (take_up, elastic, dry)), 0, 0)
    assert p.into is not None
    k, into = len(p.rates), p.into
    low, mid, up = (np.concatenate([[0.0], np.diag(p.rates, -1)]), np.diag(p.rates).copy(), np.diag(p.rates, 1).copy())
    q, per_C, a, up = fz_0 * p.fade, 1 / C, float(into[0]), np.concatenate([up, [0.0]])

    def cooling(dy, t, y, args):
        dy[0] = mid[0] * y[0] + up[0] * y[1]
        for i in range(1, k - 1):
            dy[i] = low[i] * y[i - 1] + mid[i] * y[i] + up[i] * y[i + 1]
        dy[k - 1] = low[k - 1] * y[k - 2] + mid[k - 1] * y[k - 1]

    def slip(dy, t, y, args):
        fz = fz_0 - q * y[2]
        T_n = T_0 * ((1 + fz) / (1 - fz)) ** n
        g, fall = T_n - T_0, -2 * n * q * T_n / (1 - fz * fz) * per_C
        Q = mid[0] * y[2] + up[0] * y[3]
        P = g * (R * y[0] - fall * Q) / (1 + fall * a * g)
        dy[0], dy[1], dy[2] = -arm * g, y[0], Q + a * P
        for i in range(1, k - 1):
            dy[i + 2] = low[i] * y[i + 1] + mid[i] * y[i + 2] + up[i] * y[i + 3] + into[i] * P
        dy[k + 1] = low[k - 1] * y[k] + mid[k - 1] * y[k + 1] + into[k - 1] * P

    def stick(dy, t, y, args):
        dy[0], dy[1], dy[2] = -arm * (C * y[2] - T_0), y[0], R * y[0]
        dy[3] = mid[0] * y[3] + up[0] * y[4]
        for i in range(1, k - 1):
            dy[i + 3] = low[i] * y[i + 2] + mid[i] * y[i + 3] + up[i] * y[i + 4]
        dy[k + 2] = low[k - 1] * y[k + 1] + mid[k - 1] * y[k + 2]

    return tuple(nb_diffeq_addr(f) for f in (take_up, elastic, slip, stick, cooling))


@functools.cache
def _run():
    """Compiled: the whole stop."""
    import numba

    until = searcher(_value())

    @numba.njit
    def run(addresses, numbers, fading, horizons, k, method, rtol):
        R, C, T_0, Pi, w_0, x_0, end = numbers
        fz_0, q, _, n, _, _, _ = fading
        never, none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), np.zeros(1)
        sizes = np.full(3 + k, 10.0)
        sizes[0], sizes[2] = 20.0, 0.3
        t, y, steps, times = 0.0, np.array([w_0, 0.0, x_0]), 0, np.zeros(3)
        c = np.array([0.0, 0.0, -C])
        atols = rtol * sizes[:3]
        if x_0 == 0.0:
            t, y, more = until(addresses[0], none, t, y, horizons[0], end, (T_0, c, never), method, rtol, atols)
            steps += more
        times[0] = t
        t, y, more = until(addresses[1], none, t, y, horizons[1], end, (T_0 * Pi, c, never), method, rtol, atols)
        times[1], steps = t, steps + more
        hot = np.zeros(2 + k)
        hot[:2] = y[:2]
        scales = np.full(2 + k, 10.0)
        scales[0], c = 20.0, np.zeros(2 + k)
        c[0] = R
        t, hot, more = until(
            addresses[2], none, t, hot, horizons[2], end, (0.0, c, fading), method, rtol, rtol * scales
        )
        times[2], steps = t, steps + more
        if k == 0:
            return times, hot[1], T_0 * Pi / C, np.zeros(0), steps
        fz = fz_0 - q * hot[2]
        full = np.zeros(3 + k)
        full[:2], full[3:] = hot[:2], hot[2:]
        full[2], c = T_0 * ((1 + fz) / (1 - fz)) ** n / C, np.zeros(3 + k)
        c[0] = 1.0
        # the rest of the speed goes at the rate at which it went
        soon = 1.1 * full[0] * horizons[2] / w_0 + 1e-12
        t, full, more = until(addresses[3], none, t, full, soon, end, (0.0, c, never), method, rtol, rtol * sizes)
        times[2], steps = t, steps + more
        rest, c = full[3:].copy(), np.zeros(k)
        t, T, more = until(addresses[4], none, t, rest, end, end, (1.0, c, never), method, rtol, rtol * sizes[3:])
        return times, full[1], full[2], T, steps + more

    return run


def prepare(case: Case, name: str, tolerance: float) -> Callable[[], Answer]:
    p: Stop = case.plain
    addresses, run_ = _addresses(case.name), _run()
    fz_0, k = p.f * p.z, 0
    fading = (fz_0, 0.0, p.T_0, float(p.n), 0.0, 0.0, 0.0)
    if p.rates is not None:
        k = len(p.rates)
        fading = (fz_0, fz_0 * p.fade, p.T_0, float(p.n), 1 / p.C, float(p.rates[0, 0]), float(p.rates[0, 1]))
    numbers = (p.R, p.C, p.T_0, p.Pi, p.w_0, p.x_0, p.end)
    grip = p.T_0 * (p.Pi - 1)
    # by hand, from constant speed and constant torque
    horizons = (
        1.1 * p.T_0 / (p.C * p.R * p.w_0),
        1.1 * grip / (p.C * p.R * p.w_0),
        1.1 * p.w_0 * p.J / (p.R * grip),
    )

    def run() -> Answer:
        times, angle, x, T, steps = run_(addresses, numbers, fading, horizons, k, name, tolerance)
        return Answer(times[1 if p.x_0 else 0 :], np.concatenate([[angle, x], T]), -1, int(steps))

    return run
