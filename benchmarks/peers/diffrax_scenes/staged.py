"""The stop of a staged brake: states (ω, ω_b, φ, heat of the band's pair, heat of the
rim's pair).

Both pairs carry tanh of their slip speed over `ε ω_0`: the tight tension of the band
follows that of the bandage, and the mobilisation rule gives from it what the linings
press on the rim.
"""

import math
from typing import Any

import numpy as np

from benchmarks.peers.diffrax_scenes.smooth import Smooth
from benchmarks.scenes import Staged
from benchmarks.staged import Tensions


def smooth(p: Staged, share: float) -> Smooth:
    """Slip and lock are read where slip speeds pass `5 ε ω_0`, the stop where `ω` falls
    through `ε ω_0`."""
    import jax.numpy as jnp

    known = Tensions(p)
    sine = math.sin(math.atan(p.z))
    small = share * p.w_0
    Pi = jnp.asarray(known.Pi)
    first = math.exp(-p.ahead / p.tau)

    def torques(t: Any, w: Any, w_b: Any) -> tuple[Any, Any]:
        T_0 = p.level * (1 - first * jnp.exp(-t / p.tau))
        T_n = T_0 * (1 + (known.top - 1) * jnp.tanh(w_b / small))
        T = jnp.minimum(T_0 * Pi, T_n)
        pressed = jnp.sum(T[1:] + T[:-1]) * sine + p.n * p.preload
        return p.R_b * (T_n - T_0), p.R * p.f_int * pressed * jnp.tanh(
            (w - w_b) / small
        )

    def rhs(t: Any, y: Any) -> Any:
        w = y[0]
        w_b = y[1]
        M_ext, M_int = torques(t, w, w_b)
        return jnp.stack(
            [
                (p.load - M_int) / p.J,
                (M_int - M_ext) / p.J_b,
                w,
                M_ext * w_b,
                M_int * (w - w_b),
            ]
        )

    def readings(t: Any, y: Any) -> Any:
        return jnp.stack([y[0] - y[1] - 5 * small, 5 * small - y[1], small - y[0]])

    start = np.array([p.w_0, p.w_0, 0.0, 0.0, 0.0])
    sizes = np.array([20.0, 20.0, 10.0, 1e5, 1e5])
    # the bandage slips before its band holds it; at rest nothing slides any more
    windows = np.zeros(3), np.array([0.5, p.end, p.end])
    return Smooth(
        rhs, start, sizes, p.end, readings, windows, lambda times, evaluate, y: y[2:]
    )
