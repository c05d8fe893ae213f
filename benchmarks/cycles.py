"""Repeated stops mode by mode: held, letting go, moving; states (ω, φ, temperatures of rim, linings, band above room).

A rigid band brakes with `R T_0 (Π − 1)` as long as the lever pulls. While the lever lets go no stop is looked for.
"""

from typing import Any

import numpy as np

from benchmarks.equations import Automaton, Guard, Mode
from benchmarks.scenes import Cycles

_SIZES = np.array([20.0, 1e3, 50.0, 50.0, 50.0])


def cycles(p: Cycles) -> Automaton:
    """Its modes; the corners of the lever are its knots."""
    times, tensions, period = p.times, p.tensions, p.period
    pieces = list(zip(times[:-1], times[1:], tensions[:-1], tensions[1:], strict=True))
    fz_0, q, n, R, J = p.f * p.z, p.f * p.z * p.fade, p.n, p.R, p.J
    (C_r, C_l, C_b), (out_r, out_b), G = p.capacities, p.cooling, p.between
    to_rim, to_linings, load, drag = p.share / C_r, (1 - p.share) / C_l, p.load, p.drag
    rates = np.zeros((5, 5))
    rates[1, 0], rates[2, 2], rates[3, 3], rates[3, 4] = 1.0, -out_r / C_r, -G / C_l, G / C_l
    rates[4, 3], rates[4, 4] = G / C_b, -(G + out_b) / C_b

    def lever(t: float) -> float:
        u = t % period
        for a, b, low, high in pieces:
            if a <= u < b:
                return low + (high - low) * (u - a) / (b - a)
        return tensions[-1]

    def ratio(T: float) -> tuple[float, float]:
        """`Π − 1` and its derivative by the linings' temperature."""
        fz = fz_0 - q * T
        Pi = ((1 + fz) / (1 - fz)) ** n
        return Pi - 1, -2 * n * q * Pi / (1 - fz * fz)

    def moving(t: float, y: Any) -> tuple[float, ...]:
        w, _, T_r, T_l, T_b = y
        M = R * lever(t) * ratio(T_l)[0]
        P, flow = M * w, G * (T_l - T_b)
        return (
            (load - drag * w - M) / J,
            w,
            to_rim * P - out_r * T_r / C_r,
            to_linings * P - flow / C_l,
            (flow - out_b * T_b) / C_b,
        )

    def jacobian(t: float, y: Any) -> np.ndarray:
        grip, slope = ratio(float(y[3]))
        pull = R * lever(t)
        found = rates.copy()
        found[0, 0], found[0, 3] = -drag / J, -pull * slope / J
        found[2, 0], found[2, 3] = to_rim * pull * grip, to_rim * pull * slope * y[0]
        found[3, 0] = to_linings * pull * grip
        found[3, 3] += to_linings * pull * slope * y[0]
        return found

    def resting(t: float, y: Any) -> tuple[float, ...]:
        _, _, T_r, T_l, T_b = y
        flow = G * (T_l - T_b)
        return 0.0, 0.0, -out_r * T_r / C_r, -flow / C_l, (flow - out_b * T_b) / C_b

    still = rates.copy()
    still[1, 0] = 0.0

    def at_rest(t: float, y: Any) -> np.ndarray:
        found = np.array(y, dtype=float)
        found[0] = 0.0
        return found

    grips = Guard("restart", lambda t, y: R * lever(t) * ratio(y[3])[0] - load, "letting go", lambda t, y: y)
    stop = Guard("stop", lambda t, y: y[0], "held", at_rest)
    modes = {
        "held": Mode(resting, lambda t, y: still, (grips,), _SIZES),
        "letting go": Mode(moving, jacobian, (), _SIZES, then="moving"),
        "moving": Mode(moving, jacobian, (stop,), _SIZES),
    }

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != "held":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        return np.asarray(y)[1:]

    knots = tuple(i * period + t for i in range(p.count) for t in times)
    return Automaton(modes, "held", np.zeros(5), p.count * period, final, knots, fastest=0.05)
