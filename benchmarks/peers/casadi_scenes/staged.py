"""The stop of a staged brake; states (ω, ω_b, φ, heat of the band's pair, heat of the
rim's pair)."""

import math

import numpy as np

from benchmarks.peers.casadi_scenes.form import Form, choose, sequence
from benchmarks.scenes import Staged
from benchmarks.staged import Tensions


def form(p: Staged) -> Form:
    import casadi as ca

    known = Tensions(p)
    rim = p.R * p.f_int
    together = p.J + p.J_b
    # pyright: ignore
    X = ca.SX.sym("X", 5)
    mode = ca.SX.sym("mode")
    t = ca.SX.sym("t")
    w = X[0]
    w_b = X[1]
    T_0 = p.level * (1 - math.exp(-p.ahead / p.tau) * ca.exp(-t / p.tau))
    M_ext = p.R_b * (known.top - 1) * T_0
    preload = rim * p.n * p.preload
    M_int = preload + rim * float(known.slack[-1]) * T_0
    a = (p.load - M_ext) / together
    # `M_int(T_n)` is concave: of the roots on those of its pieces that are less steep
    # than R_b the least is meant
    below = p.R_b - rim * known.tight[:-1]
    pieces = [
        p.R_b * ((preload + (p.R_b + rim * float(s)) * T_0) / float(b) - T_0)
        for s, b in zip(known.slack[:-1], below, strict=True)
        if b > 0
    ]
    M = pieces[0]
    for piece in pieces[1:]:
        M = ca.fmin(M, piece)
    rest = ca.SX.zeros(5)  # pyright: ignore
    modes = [
        ca.vertcat(a, a, w, M_ext * w, 0.0),
        ca.vertcat(
            (p.load - M_int) / p.J,
            (M_int - M_ext) / p.J_b,
            w,
            M_ext * w_b,
            M_int * (w - w_b),
        ),
        ca.vertcat((p.load - M) / p.J, 0.0, w, 0.0, M * w),
        rest,
    ]
    guards = [M_int - M_ext - p.J_b * a, w_b, w]
    start = np.array([p.w_0, p.w_0, 0.0, 0.0, 0.0])
    sizes = np.array([20.0, 20.0, 10.0, 1e5, 1e5])
    return sequence(
        X,
        mode,
        choose(mode, modes),
        guards,
        start,
        sizes,
        p.end,
        lambda times, y: (times, y[2:]),
        t=t,
    )
