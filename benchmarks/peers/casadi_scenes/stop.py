"""A stop of one band, with heat or without; states (ω, φ, x, T…)."""

import numpy as np

from benchmarks.peers.casadi_scenes.form import Form, choose, sequence
from benchmarks.scenes import Stop


def form(p: Stop) -> Form:
    import casadi as ca

    k = 0 if p.rates is None else len(p.rates)
    # pyright: ignore
    X = ca.SX.sym("X", 3 + k)
    mode = ca.SX.sym("mode")
    w = X[0]
    x = X[2]
    T = X[3:]
    grip = p.T_0 * (p.Pi - 1)
    heating = ca.SX(k, 1)
    v = p.R * w
    cooling = ca.SX(k, 1)
    if p.rates is not None and p.into is not None:
        fz = p.f * p.z * (1 - p.fade * T[0])
        T_n = p.T_0 * ((1 + fz) / (1 - fz)) ** p.n
        grip = T_n - p.T_0
        slope = -2 * p.n * p.f * p.z * p.fade * T_n / (1 - fz * fz)
        cooling = ca.mtimes(ca.SX(ca.sparsify(ca.DM(p.rates))), T)
        v = (p.R * w - slope * cooling[0] / p.C) / (
            1 + slope * float(p.into[0]) * grip / p.C
        )
        heating = ca.DM(p.into) * (grip * v)
        slip = ca.vertcat(-p.R * grip / p.J, w, p.R * w - v, cooling + heating)
    else:
        slip = ca.vertcat(-p.R * grip / p.J, w, 0.0)
    elastic = ca.vertcat(-p.R * (p.C * x - p.T_0) / p.J, w, p.R * w, cooling)
    modes = [
        (ca.vertcat(0.0, w, p.R * w, cooling), p.T_0 - p.C * x),
        (elastic, grip + p.T_0 - p.C * x),
        (slip, v),
        (elastic, w),
        (ca.vertcat(0.0, 0.0, 0.0, cooling), None),
    ]
    if p.rates is None:
        del modes[3]  # without heat the band stops sliding as the pulley stops
    start = np.concatenate([[p.w_0, 0.0, p.x_0], np.zeros(k)])
    sizes = np.array([20.0, 10.0, 0.3] + [10.0] * k)
    first = 1 if p.x_0 else 0
    last = len(modes) - 2
    logged = [i for i in (0, 1, last) if i >= first]
    rhs = choose(mode, [m[0] for m in modes])
    guards = [m[1] for m in modes[:-1]]
    # that of the stop falls through 0 only once anyway
    return sequence(
        X,
        mode,
        rhs,
        guards,
        start,
        sizes,
        p.end,
        lambda times, y: (times[logged], y[1:]),
        first,
    )
