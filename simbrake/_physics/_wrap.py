"""Linings under a band: what their friction makes of the tension from the slack end to the tight one."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Bool, Float

from .._hybrid import largest
from .._hybrid._arrays import Array
from .._parts._band import LiningForces, mobilised, product, running_product, sliding_ratio
from ._mechanism import Mode
from ._modes import BandMode, pick
from ._sliding import Grip


class Fixed(NamedTuple):
    """`f_i z_i` and `Π` of linings whose friction cannot change in a run."""

    static: Float[Array, " n"]
    kinetic: Float[Array, " n"]
    ratio_static: Float[Array, ""]
    ratio_kinetic: Float[Array, ""]


def _unlocked(fz: Float[Array, " n"]) -> Float[Array, " n"]:
    """`f_i z_i`, 0 of a lining that locks itself: its limit is infinite, and for the caller to treat."""
    return jnp.where(fz < 1, fz, 0.0)


class Limit(NamedTuple):
    """Linings that slide, or are about to, one way.

    - `fz` (n,): `f_i z_i` of each, 0 of one that locks itself
    - `ratio`: `T_n/T_0`, `Π = ∏ (1 + f_i z_i)/(1 − f_i z_i)` while the anchor end is the tight one, else `1/Π`
    - `other`: `Π` the other way, which is another where the law looks at the pressure
    - `slope`: the least slope of implicit coefficients (1 where explicit)
    - `margin`: by how much the lining nearest to locking is away from it, `1 − max f_s z`; `None`: it cannot change
    """

    fz: Float[Array, " n"]
    ratio: Float[Array, ""]
    other: Float[Array, ""]
    slope: Array
    margin: Any


#: how the linings of a band as a whole share its tension
MOBILISATION = (
    "mobilisation rule: one lining after the other at its limit, from the slack end (reversed: from the anchor)"
)


class Wrap(eqx.Module):
    """The grip of a band on linings: `T_i = T_{i−1} μ_i^{±1}` where they slide, `T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i` else.

    - `radius` `R_b` (m) of the band circle;  `locked`: whether a lining locks itself at the start
    - `fixed`: `f_i z_i` (n,) and `Π` of sticking and of sliding linings, formed once where they cannot change in a run
    """

    radius: Float[Array, ""]
    grip: Grip
    locked: Bool[Array, ""]
    fixed: Fixed | None

    @classmethod
    def of(cls, radius: Array, grip: Grip, static: Array, kinetic: Array) -> "Wrap":
        """The grip of linings whose coefficients are `static` and `kinetic` (n,) at the start."""
        read, fz = grip.reads, static * grip.tangent
        fixed = None
        if not (read.v or grip.varies or grip.implicit):
            both = _unlocked(fz), _unlocked(kinetic * grip.tangent)
            fixed = Fixed(*both, *(sliding_ratio(one) for one in both))
        return cls(radius, grip, jnp.any(fz >= 1), fixed)

    @property
    def count(self) -> int:
        return self.grip.linings.count

    def limit(self, T_0: Array, v: Array, surface: Any, back: Array, static: Array) -> Limit:
        """The limit at the slack tension `T_0`.

        - `v`: slip speed (m/s) signed by the sense;  `surface`: state of the surfaces
        - `back`: the lever end is the tight one;  `static`: the static coefficients count
        """
        if self.fixed is not None:
            one = self.fixed
            ratio = pick(static, one.ratio_static, one.ratio_kinetic)
            signed = pick(back, 1 / one.ratio_kinetic, ratio)
            return Limit(pick(static, one.static, one.kinetic), signed, ratio, jnp.ones(()), None)
        grip, margin = self.grip, None
        v = jnp.broadcast_to(v, (self.count,))
        found = grip.coefficients(T_0, v, surface, back, static=static)
        fz = _unlocked(found.f * grip.tangent)
        ratio = other = sliding_ratio(pick(back, -fz, fz))
        if grip.reads.p:
            falling = grip.coefficients(T_0, v, surface, ~back, static=static).f
            other = sliding_ratio(_unlocked(falling * grip.tangent))
        if grip.varies:
            still = grip.coefficients(T_0, v, surface, back & False, static=True).f
            margin = 1 - largest(still * grip.tangent)
        return Limit(fz, ratio, other, found.slope, margin)

    def kinetic(self, T_0: Array, omega: Array, surface: Any, mode: Mode) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""
        v = jnp.broadcast_to(jnp.where(mode.sense > 0, omega, -omega) * self.radius, (self.count,))
        return self.grip.coefficients(T_0, v, surface, mode.band == BandMode.SLIP_BACK, static=False).f

    def linings(self, T_0: Array, T_n: Array, fz: Array) -> LiningForces:
        """Forces at every lining by the mobilisation rule (model §3)."""
        return mobilised(T_0, T_n, (1 + fz) / (1 - fz), jnp.asarray(self.grip.linings.angle))

    def sliding(self, T_0: Array, fz: Array, back: Array) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Friction `T_i − T_{i−1}` and normal load `(T_i + T_{i−1}) s_i` of the linings (N) while every one slides."""
        signed = pick(back, -fz, fz)
        along = T_0 * running_product((1 + signed) / (1 - signed))
        before = jnp.concatenate([T_0[None], along[:-1]])
        return along - before, (along + before) * self.grip.sine

    def margins(self, T_0: Array, T_n: Array, fz: Array) -> Float[Array, " twice_n"]:
        """By how much (N) each lining is past its limit, from either end (see `AbstractMechanism.lining_margins`)."""
        mu = (1 + fz) / (1 - fz)
        ahead = T_n - T_0 * jnp.cumprod(mu)
        back = T_0 - T_n * jnp.cumprod(mu[::-1])[::-1]
        return jnp.concatenate([ahead, back])


def band_torque(grip: Grip, radius: Array, T_0: Array, omega: Array, surface: Any) -> Float[Array, ""]:
    """`R_b T_0 (Π − 1)`, in reverse `R_b T_0 (1 − 1/Π)`, of linings that slide on a band at rest.

    A lining that locks itself makes it infinite; in reverse the tight end can only become slack: `R_b T_0`.
    """
    back = omega < 0
    v = jnp.broadcast_to(jnp.abs(omega) * radius, (grip.linings.count,))
    mu, margin = grip.ratios(grip.coefficients(T_0, v, surface, back, static=False).f)
    growth = jnp.where(back, 1 - 1 / product(mu), product(mu) - 1)
    growth = jnp.where(margin > 0, growth, jnp.where(back, 1.0, jnp.inf))
    return jnp.where(T_0 > 0, radius * T_0 * growth, 0.0)
