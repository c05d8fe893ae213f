"""The internal pair of a staged brake: linings that ride on the rim and slide on it beyond their grip."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from .._hybrid._arrays import Array
from ._band import limit_tensions, tensions_on
from ._design import Bandage
from ._friction import SurfaceState, continued, reads

_NEWTON = 8  # iterations for a tension under a law that looks at the pressure; otherwise it is linear: one is exact


class Held(eqx.Module):
    """What the friction of the internal pair depends on at one instant: speed `v` (m/s), signed by the sense, and the
    state of the surfaces (`None`: the scene has none)."""

    v: Array
    surface: SurfaceState | None
    static: Any  # whether the pair sticks


class InternalPair(eqx.Module):
    """Friction between bandage and rim (model §4; K).

    M_int = R Σ F_i,   F_i = f_i (N_i + N_pre,i),   N_i = (T_i + T_{i−1}) sin(β_i/2)
    """

    bandage: Bandage
    radius: Array
    sine: Float[Array, " n"]  # sin(β_i/2)

    @property
    def count(self) -> int:
        return self.sine.shape[0]

    def normal(self, T_0: Array, along: Float[Array, " n"]) -> Float[Array, " n"]:
        """Loads `N_i + N_pre,i` on the rim for the tensions `T_1…T_n`."""
        before = jnp.concatenate([T_0[None], along[:-1]])
        return (along + before) * self.sine + jnp.asarray(self.bandage.preload)

    def coefficients(self, N: Float[Array, " n"], held: Held) -> Float[Array, " *n"]:
        """Coefficients of friction `f_i`, or one for all, between linings and rim under the loads `N` (N)."""
        law = self.bandage.friction
        p = None if self.bandage.area is None else N / jnp.asarray(self.bandage.area)
        still = (held.surface or SurfaceState()).contact(jnp.zeros(self.count), p)
        v = jnp.broadcast_to(held.v, (self.count,))
        kinetic = continued(lambda v: law.kinetic(still._replace(v=v)), v)
        return jnp.where(held.static, law.static(still), kinetic)

    def friction(self, T_0: Array, along: Float[Array, " n"], held: Held) -> Float[Array, " n"]:
        """Greatest forces `F_i` between linings and rim (N)."""
        N = self.normal(T_0, along)
        return self.coefficients(N, held) * N

    def capacity(self, T_0: Array, along: Float[Array, " n"], held: Held) -> Float[Array, ""]:
        """`M_int` (N·m)."""
        return self.radius * jnp.sum(self.friction(T_0, along, held))

    def _unbalance(
        self, T_0: Array, T_n: Array, mu: Array, piece: Array, sense: Array, arm: Array, held: Held
    ) -> Array:
        pull = sense.astype(jnp.float64) * self.capacity(T_0, tensions_on(T_0, T_n, mu, piece), held)
        return arm * (T_n - T_0) - pull

    def holding_tension(
        self, T_0: Array, mu: Array, piece: Int[Array, ""], sense: Int[Array, ""], arm: Array, held: Held
    ) -> Float[Array, ""]:
        """`T_n` by which the band holds a bandage on a sliding rim, `R_b (T_n − T_0) = ± M_int(T_n)`, on one piece."""

        def improve(T_n: Array, _: Any) -> tuple[Array, None]:
            def unbalance(T_n: Array) -> Array:
                return self._unbalance(T_0, T_n, mu, piece, sense, arm, held)

            value, slope = jax.jvp(unbalance, (T_n,), (jnp.ones_like(T_n),))
            return T_n - value / jnp.where(slope == 0, 1.0, slope), None

        pressed = self.bandage.area is not None
        heated = held.surface is not None and held.surface.T is not None
        if not reads(self.bandage.friction, self.count, T=heated, p=pressed).p:
            return improve(T_0, None)[0]
        # Newton from the start of the piece runs along a concave curve to its root there
        limits = limit_tensions(T_0, mu)
        here = jnp.arange(limits.shape[0], dtype=jnp.int32) == piece + self.count + 1
        return jax.lax.scan(improve, jnp.sum(jnp.where(here, limits, 0.0)), None, length=_NEWTON)[0]

    def holding_piece(self, T_0: Array, mu: Array, sense: Int[Array, ""], arm: Array, held: Held) -> Int[Array, ""]:
        """The piece on which `holding_tension` lies: a walk along all of them (their unbalance changes sign once)."""
        n = self.count
        limits = limit_tensions(T_0, mu)
        pieces = jnp.clip(jnp.arange(2 * n + 1, dtype=jnp.int32) - n, -n, n - 1)
        below = jax.vmap(lambda T_n, piece: self._unbalance(T_0, T_n, mu, piece, sense, arm, held) < 0)(limits, pieces)
        return jnp.clip(jnp.sum(below).astype(jnp.int32) - 1 - n, -n, n - 1)
