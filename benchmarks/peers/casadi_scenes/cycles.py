"""Repeated stops; states (ω, φ, temperatures of rim, linings, band), mode, and the last
event of each kind.

The lever's lines are controls that are constant from corner to corner: its tension at a
time, that time, its slope.
"""

from typing import Any

import numpy as np

from benchmarks.peers.casadi_scenes.form import Form, choose
from benchmarks.scenes import Cycles


def form(p: Cycles) -> Form:
    import casadi as ca

    # pyright: ignore
    X = ca.SX.sym("X", 8)
    u = ca.SX.sym("u", 3)
    t = ca.SX.sym("t")
    index = ca.SX.sym("index")  # pyright: ignore
    w = X[0]
    T_r = X[2]
    T_l = X[3]
    T_b = X[4]
    mode = X[5]
    (C_r, C_l, C_b) = p.capacities
    (out_r, out_b) = p.cooling
    fz = p.f * p.z * (1 - p.fade * T_l)
    M = p.R * (u[0] + u[2] * (t - u[1])) * (((1 + fz) / (1 - fz)) ** p.n - 1)
    P = M * w
    flow = p.between * (T_l - T_b)

    def rates(speeding: Any, speed: Any, heat: Any) -> Any:
        rim = p.share * heat - out_r * T_r
        linings = (1 - p.share) * heat - flow
        return ca.vertcat(
            speeding,
            speed,
            rim / C_r,
            linings / C_l,
            (flow - out_b * T_b) / C_b,
            0.0,
            0.0,
            0.0,
        )

    held = rates(0.0, 0.0, 0.0)
    moving = rates((p.load - p.drag * w - M) / p.J, w, P)
    zero = ca.vertcat(choose(mode, [M - p.load, 1e3]), choose(mode, [1.0, w]))
    restart = ca.vertcat(X[:5], 1.0, t, X[7])
    stop = ca.vertcat(0.0, X[1:5], 0.0, X[6], t)
    grid, controls = _lever(p)

    def read(found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # at the third corner of a cycle it has restarted, at the first of the next one
        # (or at the end) it has stopped
        restarts = found[6, 2::4]
        stops = found[7, 4::4]
        times = np.stack([restarts, stops], axis=1).ravel()
        if np.any(np.diff(times) <= 0) or round(found[5, -1]):
            raise RuntimeError("an event was missed")
        return times, found[1:5, -1]

    sizes = np.array([20.0, 1e3, 50.0, 50.0, 50.0, 1.0, 1.0, 1.0])
    after = ca.if_else(index < 0.5, restart, stop)
    rhs = choose(mode, [held, moving])
    return Form(
        t, X, u, rhs, zero, index, after, np.zeros(8), sizes, grid, controls, read
    )


def _lever(p: Cycles) -> tuple[tuple[float, ...], np.ndarray]:
    """The corners from 0 to the end, and tension, time, slope of the line between each
    two."""
    corners = np.array([i * p.period + t for i in range(p.count) for t in p.times])
    tensions = np.array(p.tensions * p.count)
    grid = np.concatenate([[0.0], corners, [p.count * p.period]])
    levels = np.concatenate([[p.tensions[-1]], tensions, [p.tensions[-1]]])
    slopes = np.diff(levels) / np.diff(grid)
    return tuple(grid.tolist()), np.stack([levels[:-1], grid[:-1], slopes])
