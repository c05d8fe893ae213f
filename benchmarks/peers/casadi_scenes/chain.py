"""The chain of linings over the onset of slip; states (ω, φ, e_i, v_i); the mode counts
the linings that slide."""

import numpy as np

from benchmarks.chain import Linear, sizes_of
from benchmarks.peers.casadi_scenes.form import Form, sequence
from benchmarks.scenes import Chain


def form(p: Chain) -> Form:
    import casadi as ca

    n = p.n
    known = Linear(p)
    # pyright: ignore
    X = ca.SX.sym("X", 2 * n + 2)
    mode = ca.SX.sym("mode")
    w = X[0]
    e = X[2 : n + 2]
    sticks = [mode < n - i - 0.5 for i in range(n)]
    v = [ca.if_else(sticks[i], p.R * w, X[n + 2 + i]) for i in range(n)]
    stretching = [v[i] - (v[i + 1] if i + 1 < n else 0.0) for i in range(n)]
    T = [
        p.T_0 + float(known.K[i]) * e[i] + float(known.D[i]) * stretching[i]
        for i in range(n)
    ]
    before = [p.T_0, *T[:-1]]
    G = [known.fz * (T[i] + before[i]) for i in range(n)]
    carried = sum(ca.if_else(sticks[i], T[i] - before[i], G[i]) for i in range(n))
    alpha = -p.R * carried / (p.J + p.R**2 * p.m * (n - mode))
    a = [
        ca.if_else(sticks[i], p.R * alpha, (G[i] + before[i] - T[i]) / p.m)
        for i in range(n)
    ]
    spare = [
        G[i] - (p.m * p.R * alpha + T[i] - before[i]) for i in range(n - 1, -1, -1)
    ]
    start = np.concatenate([[p.w_0, 0.0], np.zeros(n), np.full(n, p.R * p.w_0)])
    rhs = ca.vertcat(alpha, w, *stretching, *a)

    def read(times: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return times, np.concatenate([y[1::-1], y[2:]])

    return sequence(X, mode, rhs, spare, start, sizes_of(p), p.end, read)
