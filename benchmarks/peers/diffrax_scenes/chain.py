"""The chain of linings over the onset of slip: states (ω, φ, e_i, v_i), each lining with `tanh` of its own slip."""

from typing import Any

import numpy as np

from benchmarks.chain import Linear, sizes_of
from benchmarks.peers.diffrax_scenes.smooth import Smooth
from benchmarks.scenes import Chain


def smooth(p: Chain, share: float) -> Smooth:
    """A lining is taken to let go where its slip speed passes `3 ε R ω_0`."""
    import jax.numpy as jnp

    known, n, small = Linear(p), p.n, share * p.R * p.w_0
    K, D = jnp.asarray(known.K), jnp.asarray(known.D)

    def rhs(t: Any, y: Any) -> Any:
        w, e, v = y[0], y[2 : n + 2], y[n + 2 :]
        stretching = v - jnp.append(v[1:], 0.0)
        T = p.T_0 + K * e + D * stretching
        before = jnp.append(p.T_0, T[:-1])
        G = known.fz * (T + before) * jnp.tanh((p.R * w - v) / small)
        return jnp.concatenate([jnp.stack([-p.R * jnp.sum(G) / p.J, w]), stretching, (G + before - T) / p.m])

    def readings(t: Any, y: Any) -> Any:
        return (p.R * y[0] - y[n + 2 :] - 3 * small)[::-1]

    def final(times: Any, evaluate: Any, y: Any) -> Any:
        return jnp.concatenate([y[1::-1], y[2:]])

    start = np.concatenate([[p.w_0, 0.0], np.zeros(n), np.full(n, p.R * p.w_0)])
    return Smooth(rhs, start, sizes_of(p), p.end, readings, (np.zeros(n), np.full(n, p.end)), final)
