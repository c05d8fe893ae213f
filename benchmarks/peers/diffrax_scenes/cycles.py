"""Repeated stops with cooling: states (ω, φ, temperatures of rim, linings, band); torque with `tanh(ω/(ε 20 rad/s))`.

What is held creeps for as long as it is held. The solver restarts at the corners of the lever.
"""

from typing import Any

import numpy as np

from benchmarks.peers.diffrax_scenes.smooth import Smooth
from benchmarks.scenes import Cycles


def smooth(p: Cycles, share: float) -> Smooth:
    """Restart and stop are read where `ω` passes three times the speed that makes the argument of tanh 1."""
    import jax.numpy as jnp

    small = share * 20.0
    (C_r, C_l, C_b), (out_r, out_b) = p.capacities, p.cooling
    corners = np.array([i * p.period + t for i in range(p.count) for t in p.times])
    points = jnp.asarray([p.times[-1] - p.period, *p.times, p.times[0] + p.period])
    tensions = jnp.asarray([p.tensions[-1], *p.tensions, p.tensions[0]])
    # up in the holding half of a cycle, down in the braking one
    kinds = np.array([1.0, -1.0] * p.count)

    def rhs(t: Any, y: Any) -> Any:
        w, T_r, T_l, T_b = y[0], y[2], y[3], y[4]
        fz = p.f * p.z * (1 - p.fade * T_l)
        T_0 = jnp.interp(jnp.mod(t, p.period), points, tensions)
        M = p.R * T_0 * (((1 + fz) / (1 - fz)) ** p.n - 1) * jnp.tanh(w / small)
        P, flow = M * w, p.between * (T_l - T_b)
        rim, linings = p.share * P - out_r * T_r, (1 - p.share) * P - flow
        return jnp.stack([(p.load - p.drag * w - M) / p.J, w, rim / C_r, linings / C_l, (flow - out_b * T_b) / C_b])

    def readings(t: Any, y: Any) -> Any:
        return jnp.asarray(kinds) * (y[0] - 3 * small)

    starts = p.period * np.arange(p.count)
    low = np.stack([starts + p.times[0], starts + p.times[2]], axis=1).ravel()
    high = np.stack([starts + p.times[2], starts + p.period], axis=1).ravel()
    sizes = np.array([20.0, 1e3, 50.0, 50.0, 50.0])
    end = p.period * p.count
    return Smooth(rhs, np.zeros(5), sizes, end, readings, (low, high), lambda times, evaluate, y: y[1:], corners)
