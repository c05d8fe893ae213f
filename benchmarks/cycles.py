"""Repeated stops mode by mode: held, letting go, moving; states (ω, φ, temperatures of
rim, linings, band above room).

A rigid band brakes with `R T_0 (Π − 1)` as long as the lever pulls. While the lever
lets go no stop is looked for.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.automaton import Automaton, Guard, Mode
from benchmarks.scenes import Cycles

_SIZES = np.array([20.0, 1e3, 50.0, 50.0, 50.0])


def cycles(p: Cycles) -> Automaton:
    """Its modes; the corners of the lever are its knots."""
    torque = _torque(p)
    rhs, jacobian = _moving(p, torque)
    (C_r, C_l, C_b) = p.capacities
    (out_r, out_b) = p.cooling
    G = p.between
    load = p.load

    def resting(t: float, y: Any) -> tuple[float, ...]:
        _, _, T_r, T_l, T_b = y
        flow = G * (T_l - T_b)
        return 0.0, 0.0, -out_r * T_r / C_r, -flow / C_l, (flow - out_b * T_b) / C_b

    still = _cooling(p)

    def at_rest(t: float, y: Any) -> np.ndarray:
        found = np.array(y, dtype=float)
        found[0] = 0.0
        return found

    grips = Guard(
        "restart", lambda t, y: torque(t, y[3])[0] - load, "letting go", lambda t, y: y
    )
    stop = Guard("stop", lambda t, y: y[0], "held", at_rest)
    modes = {
        "held": Mode(resting, lambda t, y: still, (grips,), _SIZES),
        "letting go": Mode(rhs, jacobian, (), _SIZES, then="moving"),
        "moving": Mode(rhs, jacobian, (stop,), _SIZES),
    }

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != "held":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        return np.asarray(y)[1:]

    knots = tuple(i * p.period + t for i in range(p.count) for t in p.times)
    return Automaton(
        modes, "held", np.zeros(5), p.count * p.period, final, knots, fastest=0.05
    )


def _cooling(p: Cycles) -> np.ndarray:
    """Rates of the temperatures without friction, as a matrix of all states."""
    (C_r, C_l, C_b) = p.capacities
    (out_r, out_b) = p.cooling
    G = p.between
    rates = np.zeros((5, 5))
    rates[2, 2] = -out_r / C_r
    rates[3, 3] = -G / C_l
    rates[3, 4] = G / C_l
    rates[4, 3] = G / C_b
    rates[4, 4] = -(G + out_b) / C_b
    return rates


Torque = Callable[[float, Any], tuple[float, float]]


def _torque(p: Cycles) -> Torque:
    """What the brake can hold, and its derivative by the linings' temperature."""
    times = p.times
    tensions = p.tensions
    period = p.period
    pieces = list(zip(times[:-1], times[1:], tensions[:-1], tensions[1:], strict=True))
    fz_0 = p.f * p.z
    q = p.f * p.z * p.fade
    n = p.n
    R = p.R

    def lever(t: float) -> float:
        u = t % period
        for a, b, low, high in pieces:
            if a <= u < b:
                return low + (high - low) * (u - a) / (b - a)
        return tensions[-1]

    def torque(t: float, T: Any) -> tuple[float, float]:
        fz = fz_0 - q * T
        pull = R * lever(t)
        Pi = ((1 + fz) / (1 - fz)) ** n
        return pull * (Pi - 1), -2 * n * q * pull * Pi / (1 - fz * fz)

    return torque


def _moving(
    p: Cycles, torque: Torque
) -> tuple[Callable[[float, Any], Any], Callable[[float, Any], np.ndarray]]:
    """Right-hand side and Jacobian of the pulley that turns."""
    (C_r, C_l, C_b) = p.capacities
    (out_r, out_b) = p.cooling
    G = p.between
    to_rim = p.share / C_r
    to_linings = (1 - p.share) / C_l
    load = p.load
    drag = p.drag
    J = p.J
    rates = _cooling(p)
    rates[0, 0] = -drag / J
    rates[1, 0] = 1.0

    def rhs(t: float, y: Any) -> tuple[float, ...]:
        w, _, T_r, T_l, T_b = y
        M = torque(t, T_l)[0]
        P = M * w
        flow = G * (T_l - T_b)
        return (
            (load - drag * w - M) / J,
            w,
            to_rim * P - out_r * T_r / C_r,
            to_linings * P - flow / C_l,
            (flow - out_b * T_b) / C_b,
        )

    def jacobian(t: float, y: Any) -> np.ndarray:
        M, slope = torque(t, float(y[3]))
        found = rates.copy()
        found[0, 3] = -slope / J
        found[2, 0] = to_rim * M
        found[2, 3] = to_rim * slope * y[0]
        found[3, 0] = to_linings * M
        found[3, 3] += to_linings * slope * y[0]
        return found

    return rhs, jacobian
