"""A stop of one band, with heat or without: states (ω, φ, T…).

Corners of the tension are rounded, full slip sets in with tanh, and the brake's torque
carries `tanh(ω/ε ω_0)`.
"""

from typing import Any

import numpy as np

from benchmarks.peers.diffrax_scenes.smooth import Smooth
from benchmarks.scenes import Stop


def smooth(p: Stop, share: float) -> Smooth:
    """Right-hand side, and what is read off: `C x − T_0`, `C x − T_0 Π`, and the stop
    at `ω = 0.01 ε ω_0`."""
    import jax
    import jax.numpy as jnp

    k = 0 if p.rates is None else len(p.rates)
    width = share * p.T_0
    first = 1 if p.x_0 else 0
    rates = None if p.rates is None else jnp.asarray(p.rates)
    into = None if p.into is None else jnp.asarray(p.into)

    def grip(T: Any) -> tuple[Any, Any]:
        if not k:
            return p.T_0 * (p.Pi - 1), 0.0
        fz = p.f * p.z * (1 - p.fade * T[0])
        T_n = p.T_0 * ((1 + fz) / (1 - fz)) ** p.n
        return T_n - p.T_0, -2 * p.n * p.f * p.z * p.fade * T_n / (1 - fz * fz)

    def winding(phi: Any) -> Any:
        return p.C * (p.x_0 + p.R * phi) - p.T_0

    def held(phi: Any, g: Any) -> Any:
        """The band's tension above T_0: rounded at both its corners."""
        taken = width * jax.nn.softplus(winding(phi) / width)
        return g - width * jax.nn.softplus((g - taken) / width)

    def rhs(t: Any, y: Any) -> Any:
        w = y[0]
        phi = y[1]
        T = y[2:]
        g, slope = grip(T)
        F = held(phi, g) * jnp.tanh(w / (share * p.w_0))
        change = jnp.zeros(0)
        if rates is not None and into is not None:
            cooling = rates @ T
            slides = 0.5 * (1 + jnp.tanh((winding(phi) - g) / width))
            v = (
                slides
                * (p.R * w - slope * cooling[0] / p.C)
                / (1 + slope * into[0] * g / p.C)
            )
            change = cooling + into * (F * v)
        return jnp.concatenate([jnp.stack([-p.R * F / p.J, w]), change])

    def readings(t: Any, y: Any) -> Any:
        found = [
            winding(y[1]),
            winding(y[1]) - grip(y[2:])[0],
            0.01 * share * p.w_0 - y[0],
        ]
        return jnp.stack(found[first:])

    def final(times: Any, evaluate: Any, y: Any) -> Any:
        stopped = evaluate(times[-1])
        elongation = (p.T_0 + held(stopped[1], grip(stopped[2:])[0])) / p.C
        return jnp.concatenate([jnp.stack([y[1], elongation]), y[2:]])

    start = np.concatenate([[p.w_0, 0.0], np.zeros(k)])
    sizes = np.concatenate([[20.0, 10.0], np.full(k, 10.0)])
    windows = np.zeros(3 - first), np.full(3 - first, p.end)
    return Smooth(rhs, start, sizes, p.end, readings, windows, final)
