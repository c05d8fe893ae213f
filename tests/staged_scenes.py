"""Staged brakes that several tests share, and one integrated independently with SciPy."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import simbrake as sb

R, R_B, J, J_B, N, BETA, F_EXT, F_INT, PRELOAD = 0.59, 0.64, 900.0, 45.0, 8, math.radians(33.0), 0.40, 0.22, 900.0


def brake(stiffness=None, f_ext=F_EXT, f_int=F_INT, preload=PRELOAD, J_b=J_B, J=J, n=N, law=None, inner=None):
    return sb.Brake(
        sb.Pulley(R, J),
        sb.Band(R_B, stiffness),
        sb.Lining(law or sb.ConstantFriction(f_ext), np.full(n, BETA)),
        sb.Bandage(J_b, inner or sb.ConstantFriction(f_int), preload),
    )


def stop(rate=4e3, start=200.0, load=300.0, w0=20.0, end=12.0, lever=None, heat=None, **parts):
    """A stop under a lever ramp of `rate` (N/s) that ends at 30 kN."""
    lever = lever or sb.PiecewiseLinear([0.0, 3e4 / rate], [start, start + 3e4])
    return sb.Scene(brake(**parts), sb.Duty(lever, sb.TorqueLoad(sb.Constant(load))), sb.Initial(w0), end, heat)


def tensions(T_0, T_n, mu):
    """Mobilisation rule, written as a walk along the linings."""
    T = [T_0]
    if T_n >= T_0:
        for m in mu:
            T.append(min(T[-1] * m, T_n))
        return np.array(T)
    T = [T_n]
    for m in mu[::-1]:
        T.append(min(T[-1] * m, T_0))
    return np.array(T[::-1])


def by_hand(stiffness, rate=4e3, start=200.0, load=300.0, w0=20.0, rtol=1e-12):
    """Event times of `stop` (elastic band, constant friction, one stage after the other) from SciPy's DOP853."""
    z = math.tan(BETA / 2)
    mu = np.full(N, (1 + F_EXT * z) / (1 - F_EXT * z))
    Pi, s = float(np.prod(mu)), math.sin(BETA / 2)
    found = {}

    def lever(t):
        return start + rate * t

    def grip(T_0, T_n):
        T = tensions(T_0, T_n, mu)
        return R * F_INT * float(np.sum((T[1:] + T[:-1]) * s + PRELOAD))

    def run(rhs, y, t, event):
        event.terminal = True
        sol = solve_ivp(rhs, (t, 60.0), y, "DOP853", events=event, rtol=rtol, atol=1e-13, max_step=0.01)
        return float(sol.t_events[0][0]), sol.y_events[0][0]

    def ride(t, y):  # elastic band, bandage stuck to the pulley: ω, x
        return [(load - R_B * (stiffness * y[1] - lever(t))) / (J + J_B), R_B * y[0]]

    t, y = 0.0, np.array([w0, 0.0])
    take_up = lambda t, y: stiffness * y[1] - lever(t)  # noqa: E731
    t, y = run(lambda t, y: [load / (J + J_B), R_B * y[0]], y, t, take_up)
    found["slip_onset"] = t
    t, y = run(ride, y, t, lambda t, y: stiffness * y[1] - Pi * lever(t))
    found["full_slip"] = t

    def transmitted(t, w):
        M = R_B * lever(t) * (Pi - 1)
        return M + J_B * (load - M) / (J + J_B)

    t, y = run(
        lambda t, y: [(load - R_B * lever(t) * (Pi - 1)) / (J + J_B)],
        y[:1],
        t,
        lambda t, y: grip(lever(t), Pi * lever(t)) - transmitted(t, y[0]),
    )
    found["internal_slip"] = t

    def both(t, y):
        M_int = grip(lever(t), Pi * lever(t))
        return [(load - M_int) / J, (M_int - R_B * lever(t) * (Pi - 1)) / J_B]

    # the band stretches with the lever: its slip ends before the bandage rests
    creep = rate * Pi / stiffness / R_B
    t, y = run(both, np.array([y[0], y[0]]), t, lambda t, y: y[1] - creep)
    found["restick"] = t

    def swing(t, y):  # ω, ω_b, x
        M_int = grip(lever(t), stiffness * y[2])
        return [(load - M_int) / J, (M_int - R_B * (stiffness * y[2] - lever(t))) / J_B, R_B * y[1]]

    t, y = run(swing, np.array([*y, Pi * lever(t) / stiffness]), t, lambda t, y: y[1])
    found["external_lock"] = t

    def held(t, y):
        T_0 = lever(t)
        T_n = brentq(lambda T_n: R_B * (T_n - T_0) - grip(T_0, T_n), T_0, T_0 * Pi, xtol=1e-10, rtol=1e-14)
        return [(load - grip(T_0, T_n)) / J]

    t, y = run(held, y[:1], t, lambda t, y: y[0])
    found["stop"] = t
    return found
