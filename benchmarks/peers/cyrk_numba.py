"""CyRK's C++ solvers under numba (`nbsolve2_ivp`), right-hand sides and the sequence of modes compiled by numba.

They have no events there. As a careful user would: integrate a little beyond the event, whose time an estimate by hand
gives; look for the step in which the guard turns; and solve for the length of that step.
"""

import functools
import math

import numpy as np

from benchmarks.scenes import CASES, Answer, Case, Cycles, Staged, Stop
from benchmarks.staged import Tensions

NAME, PACKAGES, PIP, AGREES = "CyRK", ("CyRK", "numba"), "CyRK numba", 1e-9
_METHODS = ("RK45", "DOP853", "Vern8", "LSODA", "RADAU", "BDF")


def methods(case: Case) -> dict[str, str | None]:
    if isinstance(case.plain, Cycles):
        missing = "compiled right-hand sides of this scene are not written"
        return {f"CyRK {m}": missing for m in _METHODS}
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {f"CyRK {m}": stability if case.stiff and m in ("RK45", "DOP853", "Vern8") else None for m in _METHODS}


@functools.cache
def _until():
    """Compiled: integrates until the guard falls through 0; counts steps.

    The guard is `c_0 + c·y + c_e exp(−t/τ)`, less `ẋ_0` where `more` says how the band follows the friction.
    """
    import numba
    from CyRK import nbsolve2_ivp

    @numba.njit
    def value(t, y, c_0, c, more):
        fz_0, q, T_0, n, per_C, mid, up, c_e, decay = more
        found = c_0 + c_e * math.exp(-t * decay)
        for j in range(len(c)):
            found += c[j] * y[j]
        if per_C:
            fz = fz_0 - q * y[2]
            slope = -2 * n * q * T_0 * ((1 + fz) / (1 - fz)) ** n / (1 - fz * fz)
            found -= slope * per_C * (mid * y[2] + up * y[3])
        return found

    @numba.njit
    def short(address, t, y, h, method, rtol, atols, none):
        found = nbsolve2_ivp(address, (t, t + h), y, method, None, False, none, rtol, 1e-6, None, atols)
        if not found.success:
            raise RuntimeError("CyRK failed")
        end = found.y[:, -1].copy()
        found.free()
        return end

    @numba.njit
    def until(address, t, y, horizon, stop, c_0, c, more, method, rtol, atols):
        none, steps = np.zeros(1), 0
        while True:
            end = min(t + horizon, stop)
            found = nbsolve2_ivp(address, (t, end), y, method, None, False, none, rtol, 1e-6, None, atols)
            if not found.success:
                raise RuntimeError("CyRK failed")
            ts, ys = found.t.copy(), found.y.copy()
            found.free()
            high = value(ts[0], ys[:, 0].copy(), c_0, c, more)
            for i in range(len(ts) - 1):
                low, high = high, value(ts[i + 1], ys[:, i + 1].copy(), c_0, c, more)
                if low >= 0.0 and high < 0.0:
                    row = ys[:, i].copy()
                    # secant kept within its bracket (Illinois)
                    a, b, g_a, g_b, side, best = 0.0, ts[i + 1] - ts[i], low, high, 0, ys[:, i].copy()
                    h = b
                    for _ in range(60):
                        before = h
                        h = (a * g_b - b * g_a) / (g_b - g_a)
                        best = short(address, ts[i], row, h, method, rtol, atols, none)
                        g = value(ts[i] + h, best, c_0, c, more)
                        if g == 0.0 or abs(h - before) <= 4e-16 * max(ts[i], h):
                            break
                        if g > 0:
                            a, g_a = h, g
                            if side == 1:
                                g_b *= 0.5
                            side = 1
                        else:
                            b, g_b = h, g
                            if side == -1:
                                g_a *= 0.5
                            side = -1
                    return ts[i] + h, best, steps + i + 1
            steps += len(ts) - 1
            t, y = ts[-1], ys[:, -1].copy()
            if t >= stop:
                return t, y, steps

    return until


@functools.cache
def _addresses(name: str) -> tuple[int, ...]:
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

    until = _until()

    @numba.njit
    def run(addresses, numbers, fading, horizons, k, method, rtol):
        R, C, T_0, Pi, w_0, x_0, end = numbers
        fz_0, q, _, n, _, _, _, _, _ = fading
        never = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        sizes = np.full(3 + k, 10.0)
        sizes[0], sizes[2] = 20.0, 0.3
        t, y, steps, times = 0.0, np.array([w_0, 0.0, x_0]), 0, np.zeros(3)
        c = np.array([0.0, 0.0, -C])
        atols = rtol * sizes[:3]
        if x_0 == 0.0:
            t, y, more = until(addresses[0], t, y, horizons[0], end, T_0, c, never, method, rtol, atols)
            steps += more
        times[0] = t
        t, y, more = until(addresses[1], t, y, horizons[1], end, T_0 * Pi, c, never, method, rtol, atols)
        times[1], steps = t, steps + more
        hot = np.zeros(2 + k)
        hot[:2] = y[:2]
        scales = np.full(2 + k, 10.0)
        scales[0], c = 20.0, np.zeros(2 + k)
        c[0] = R
        t, hot, more = until(addresses[2], t, hot, horizons[2], end, 0.0, c, fading, method, rtol, rtol * scales)
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
        t, full, more = until(addresses[3], t, full, soon, end, 0.0, c, never, method, rtol, rtol * sizes)
        times[2], steps = t, steps + more
        rest, c = full[3:].copy(), np.zeros(k)
        t, T, more = until(addresses[4], t, rest, end, end, 1.0, c, never, method, rtol, rtol * sizes[3:])
        return times, full[1], full[2], T, steps + more

    return run


@functools.cache
def _staged(name: str):
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
def _run_staged():
    """Compiled: the whole stop of the staged brake."""
    import numba

    until = _until()

    @numba.njit
    def run(addresses, margin, w_0, end, method, rtol):
        atols = rtol * np.array([20.0, 20.0, 10.0, 1e5, 1e5])
        never = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        lever = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, margin[1], margin[2])
        y, c, times = np.array([w_0, w_0, 0.0, 0.0, 0.0]), np.zeros(5), np.zeros(3)
        # a quarter of a second to look ahead, about the time in which the lever fills
        t, y, steps = until(addresses[0], 0.0, y, 0.25, end, margin[0], c, lever, method, rtol, atols)
        times[0], c[1] = t, 1.0
        t, y, more = until(addresses[1], t, y, 0.25, end, 0.0, c, never, method, rtol, atols)
        times[1], steps = t, steps + more
        y[1], c[1], c[0] = 0.0, 0.0, 1.0
        t, y, more = until(addresses[2], t, y, 0.25, end, 0.0, c, never, method, rtol, atols)
        times[2] = t
        return times, y[2:].copy(), steps + more

    return run


def prepare(case: Case, method: str, tolerance: float):
    name = method.removeprefix("CyRK ")
    if isinstance(case.plain, Stop):
        return _prepare_stop(case, name, tolerance)
    p: Staged = case.plain
    (addresses, margin), run_ = _staged(case.name), _run_staged()

    def run() -> Answer:
        times, state, steps = run_(addresses, margin, p.w_0, p.end, name, tolerance)
        return Answer(times, state, -1, int(steps))

    return run


def _prepare_stop(case: Case, name: str, tolerance: float):
    p: Stop = case.plain
    addresses, run_ = _addresses(case.name), _run()
    fz_0, k = p.f * p.z, 0
    fading = (fz_0, 0.0, p.T_0, float(p.n), 0.0, 0.0, 0.0, 0.0, 0.0)
    if p.rates is not None:
        k = len(p.rates)
        fading = (fz_0, fz_0 * p.fade, p.T_0, float(p.n), 1 / p.C, float(p.rates[0, 0]), float(p.rates[0, 1]), 0.0, 0.0)
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
