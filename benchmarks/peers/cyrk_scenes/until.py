"""Where a guard falls through 0 under CyRK's solvers in numba, which have no events there."""

import functools
from typing import Any


@functools.cache
def searcher(value: Any) -> Any:
    """Compiled: `until(address, args, t, y, horizon, stop, numbers, method, rtol, atols)` → time, state, steps taken.

    Integrates pieces of `horizon`, at most to `stop`, until `value(t, y, numbers)` falls through 0; then solves for the
    length of the step in which it did. `args` (float64) goes to the right-hand side at `address`.
    """
    import numba
    from CyRK import nbsolve2_ivp

    located = _locator(value)

    @numba.njit
    def until(address, args, t, y, horizon, stop, numbers, method, rtol, atols):
        steps = 0
        while True:
            end = min(t + horizon, stop)
            found = nbsolve2_ivp(address, (t, end), y, method, None, False, args, rtol, 1e-6, None, atols)
            if not found.success:
                raise RuntimeError("CyRK failed")
            ts, ys = found.t.copy(), found.y.copy()
            found.free()
            high = value(ts[0], ys[:, 0].copy(), numbers)
            for i in range(len(ts) - 1):
                low, high = high, value(ts[i + 1], ys[:, i + 1].copy(), numbers)
                if low >= 0.0 and high < 0.0:
                    row, h = ys[:, i].copy(), ts[i + 1] - ts[i]
                    h, y = located(address, args, ts[i], row, h, low, high, numbers, method, rtol, atols)
                    return ts[i] + h, y, steps + i + 1
            steps += len(ts) - 1
            t, y = ts[-1], ys[:, -1].copy()
            if t >= stop:
                return t, y, steps

    return until


@functools.cache
def _locator(value: Any) -> Any:
    """Compiled: length of the step at whose end the guard is 0, and the state there."""
    import numba
    from CyRK import nbsolve2_ivp

    @numba.njit
    def short(address, args, t, y, h, method, rtol, atols):
        found = nbsolve2_ivp(address, (t, t + h), y, method, None, False, args, rtol, 1e-6, None, atols)
        if not found.success:
            raise RuntimeError("CyRK failed")
        end = found.y[:, -1].copy()
        found.free()
        return end

    @numba.njit
    def located(address, args, t, row, h, low, high, numbers, method, rtol, atols):
        """Length of the step from `row` at whose end the guard is 0: secant kept within its bracket (Illinois)."""
        a, b, g_a, g_b, side, best = 0.0, h, low, high, 0, row
        for _ in range(60):
            before = h
            h = (a * g_b - b * g_a) / (g_b - g_a)
            best = short(address, args, t, row, h, method, rtol, atols)
            g = value(t + h, best, numbers)
            if g == 0.0 or abs(h - before) <= 4e-16 * max(t, h):
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
        return h, best

    return located


@functools.cache
def linear() -> Any:
    """The guard `c_0 + c·y` of `numbers = (c_0, c)`, compiled."""
    import numba

    @numba.njit
    def value(t, y, numbers):
        found, c = numbers
        for j in range(len(c)):
            found += c[j] * y[j]
        return found

    return value
