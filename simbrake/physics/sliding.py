"""Friction of all linings at one instant, also where it depends on their own heat and
load; and under a band."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from ..brakes.band import (
    LiningForces,
    band_torque,
    gripped,
    lining_ratio,
    mobilised,
    pressed,
    product,
    running_product,
    sliding_ratio,
    tension_ratio,
)
from ..brakes.design import AbstractLinings, Lining
from ..friction import (
    AbstractFriction,
    Contact,
    Reads,
    SurfaceState,
    continued,
    reads,
    remembers,
)
from ..hybrid import largest
from ..hybrid.arrays import Array, ScalarArray, Vector
from ..hybrid.struct import AbstractVar, Struct, structural
from ..thermal.heat import FlashTemperature, PowerShares
from ._implicit import ImplicitFriction, solved

#: a number or truth value that may be known while tracing
Known = Array | bool | float


def where_static(condition: Known, yes: Known, no: Known) -> Array:
    """`jnp.where`, decided while tracing where the condition is known: a label of a
    band that is asked about."""
    if isinstance(condition, bool | np.bool_):
        value = yes if condition else no
        return np.float64(value) if isinstance(value, float) else value  # pyright: ignore  # an array like all others
    return jnp.where(condition, yes, no)


def coefficients_of(
    law: AbstractFriction, contact: Contact, static: Array | bool, *, by_speed: bool
) -> Array:
    """Coefficients of friction: of linings that stick (`static`), else of those that
    slide.

    The slip speeds of the contact are signed by the sense of the slide; `by_speed`:
    whether the law reads them.
    """

    if static is True:
        return law.static(contact._replace(v=jnp.zeros_like(contact.v)))

    def at(v: Array) -> Array:
        here = contact._replace(v=v)
        return law.kinetic(here) if static is False else law.governing(here, static)

    return continued(at, contact.v) if by_speed else at(contact.v)


class Coefficients(NamedTuple):
    """Coefficients of the linings, and by how much their implicit equations have a
    solution (1 where explicit): the least slope up to it, or `1 − f z` where that is
    less."""

    f: Vector
    slope: Array


class AbstractLiningFriction(Struct):
    """Friction of the linings of a brake.

    - `linings`
    - `shares` of the friction power
    - `heated`: whether the scene has the linings' temperatures
    - `cosine`: friction of a lining over the force that it makes at the radius of the
      slip
    """

    linings: AbstractLinings
    shares: PowerShares | None
    heated: bool = structural()
    cosine: AbstractVar[Array | float]

    @property
    def reads(self) -> Reads:
        """Inputs that the law reads."""
        return reads(
            self.linings.friction,
            self.linings.count,
            T=self.heated,
            p=self.linings.area is not None,
        )

    @property
    def remembers(self) -> bool:
        """Whether the law has internal states."""
        return remembers(self.linings.friction)

    @property
    def varies(self) -> bool:
        """Whether the coefficients of sticking linings can change in a run."""
        read = self.reads
        return (
            read.T or read.p or self.remembers or bool(self.linings.friction.over_time)
        )


class PadFriction(AbstractLiningFriction):
    """Friction of linings that are pressed on a turning face: their normal forces do
    not depend on those of others."""

    @property
    def cosine(self) -> float:
        return 1.0

    def coefficients(
        self,
        v: Array,
        surface: SurfaceState | None,
        N: Array | None,
        static: Array | bool,
    ) -> Vector:
        """`f_i` at slip speeds `v` (n,) signed by the sense, under the normal forces
        `N` (n,).

        `N` is `None` for a law that does not depend on the pressure;  `surface`: state
        of the surfaces;  `static`: the linings stick.
        """
        law = self.linings.friction
        surface = surface or SurfaceState()
        p = None
        if self.linings.area is not None:
            p = jnp.zeros_like(v) if N is None else N / jnp.asarray(self.linings.area)

        return jnp.broadcast_to(
            coefficients_of(law, surface.contact(v, p), static, by_speed=self.reads.v),
            v.shape,
        )


class LiningFriction(AbstractLiningFriction):
    """Friction of the linings: `f_i(v, T_i, p_i)`.

    Where the law depends on the pressure `p_i = N_i/A_i`, or there is a flash
    temperature, `f_i` is implicit (an index-1 algebraic equation), since
    `N_i = (T_{i−1} + T_i) sin(β_i/2)` and `T_i = T_{i−1} μ_i(f_i)^{±1}`
    (`ImplicitFriction`).
    """

    linings: AbstractLinings
    tangent: Vector  # z_i = tan(β_i/2), of a continuous lining β_i/2
    sine: Vector  # sin(β_i/2), of a continuous lining β_i/2
    flash: FlashTemperature | None

    @property
    def cosine(self) -> Vector:
        return self.linings.cosine  # pyright: ignore

    @property
    def continuous(self) -> bool:
        """Whether the linings are pieces of a continuous one."""
        return isinstance(self.linings, Lining) and self.linings.continuous

    def gripped(self, f: Array) -> Vector:
        """`f_i z_i` (see `brakes.grip`)."""
        return gripped(f, self.tangent, continuous=self.continuous)

    def pressed(self, before: Array, ratio: Array) -> Vector:
        """Normal loads (N) under the tensions `before` and their `ratio`."""
        return pressed(before, ratio, self.sine, continuous=self.continuous)

    @classmethod
    def of(
        cls,
        linings: AbstractLinings,
        flash: FlashTemperature | None = None,
        shares: PowerShares | None = None,
        *,
        heated: bool = False,
    ) -> "LiningFriction":
        """The friction of given linings, with what depends on their angles alone formed
        once for the whole run."""
        half = jnp.asarray(linings.angle) / 2  # pyright: ignore
        along, across = (
            (half, half)
            if getattr(linings, "continuous", False)
            else (jnp.tan(half), jnp.sin(half))
        )
        return cls(linings, shares, heated, along, across, flash)

    @property
    def implicit(self) -> bool:
        return self.flash is not None or self.reads.p

    def coefficients(
        self,
        T_0: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        *,
        static: Array | bool,
    ) -> Coefficients:
        """Coefficients `f_i`; `v` (n,) slip speeds signed by the sense, `surface` state
        of the surfaces, `back`: tensions fall.

        `static`: whether the linings stick, known while tracing or not; theirs are then
        the static coefficients.
        """
        law = self.linings.friction
        n = self.linings.count
        surface = surface or SurfaceState()
        static = bool(static) if isinstance(static, np.bool_) else static
        by_speed = self.reads.v or self.flash is not None
        if not self.implicit or (static is True and not self.reads.p):
            f = coefficients_of(law, surface.contact(v), static, by_speed=by_speed)
            return Coefficients(jnp.broadcast_to(f, (n,)), jnp.ones(()))

        implicit = self.implicitly(T_0, v, surface, back, static)
        f, before = solved(implicit)
        return Coefficients(f, implicit.solvability(f, before))

    def implicitly(
        self,
        T_0: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array | bool,
    ) -> ImplicitFriction:
        """The equations of implicit coefficients, for arguments of `coefficients`."""
        slack = jnp.asarray(T_0, jnp.float64)
        marks = jnp.asarray(back), jnp.asarray(static)
        return ImplicitFriction(self, slack, v, surface or SurfaceState(), *marks)

    def ratios(self, f: Array) -> tuple[Vector, Array]:
        """Tension ratios `μ_i`, and by how much the lining nearest to locking is away
        from it, `1 − max f_i z_i`."""
        fz = self.gripped(f)
        return tension_ratio(fz)[0], 1 - largest(fz)

    def torque(
        self,
        radius: Array,
        T_0: Array,
        omega: Array,
        surface: SurfaceState | None,
        *,
        static: bool = False,
    ) -> ScalarArray:
        """`R_b T_0 (Π − 1)`, in reverse `R_b T_0 (1 − 1/Π)`, of linings that slide on a
        band at rest.

        A lining that is self-locking makes it infinite; in reverse the tight end can
        only become slack: `R_b T_0`. `static`: of linings that stick.
        """
        back = omega < 0
        v = jnp.broadcast_to(jnp.abs(omega) * radius, (self.linings.count,))
        mu, margin = self.ratios(
            self.coefficients(T_0, v, surface, back, static=static).f
        )
        ratio = where_static(back, 1 / product(mu), product(mu))
        ratio = jnp.where(margin > 0, ratio, jnp.where(back, 0.0, jnp.inf))
        torque = band_torque(radius, T_0, T_0 * ratio)
        return jnp.where(T_0 > 0, jnp.where(back, -torque, torque), 0.0)


# --- linings under a band that slide together ---------------------------------------


class ConstantLimit(NamedTuple):
    """`f_i z_i` and `Π` of linings whose friction cannot change in a run."""

    static: Vector
    kinetic: Vector
    ratio_static: ScalarArray
    ratio_kinetic: ScalarArray


def _unlocked(fz: Vector) -> Vector:
    """`f_i z_i`, 0 of a lining that is self-locking: its limit is infinite, and the
    caller handles it."""
    return jnp.where(fz < 1, fz, 0.0)


class Limit(NamedTuple):
    """Linings that slide, or are about to, one way.

    - `fz` (n,): `f_i z_i` of each, 0 of one that is self-locking
    - `ratio`: `T_n/T_0`, `Π = ∏ (1 + f_i z_i)/(1 − f_i z_i)` while the anchor end is
      the tight one, else `1/Π`
    - `other`: `Π` the other way, which differs where the law depends on the pressure
    - `slope`: the least slope of implicit coefficients (1 where explicit)
    - `margin`: by how much the lining nearest to locking is away from it,
      `1 − max f_s z`; `None`: it cannot change
    """

    fz: Vector
    ratio: ScalarArray
    other: ScalarArray
    slope: Array
    margin: Any


class BandFriction(Struct):
    """The grip of a band on linings: `T_i = T_{i−1} μ_i^{±1}` where they slide,
    `T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i` else.

    - `radius` `R_b` (m) of the band circle
    - `locked`: whether a lining is self-locking at the start
    - `fixed`: `f_i z_i` (n,) and `Π` of sticking and of sliding linings, formed once
      where they cannot change in a run
    """

    radius: ScalarArray
    grip: LiningFriction
    locked: Bool[Array, ""]
    fixed: ConstantLimit | None

    @classmethod
    def of(
        cls, radius: Array, grip: LiningFriction, static: Array, kinetic: Array
    ) -> "BandFriction":
        """The grip of linings whose coefficients are `static` and `kinetic` (n,) at the
        start."""
        read = grip.reads
        fz = grip.gripped(static)
        fixed = None
        if not (read.v or grip.varies or grip.implicit):
            both = _unlocked(fz), _unlocked(grip.gripped(kinetic))
            fixed = ConstantLimit(*both, *(sliding_ratio(kappa) for kappa in both))
        return cls(radius, grip, jnp.any(fz >= 1), fixed)

    @property
    def count(self) -> int:
        return self.grip.linings.count

    def limit(
        self,
        T_0: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array,
    ) -> Limit:
        """The limit at the slack tension `T_0`.

        - `v`: slip speed (m/s) signed by the sense;  `surface`: state of the surfaces
        - `back`: the lever end is the tight one
        - `static`: the static coefficients count
        """
        if self.fixed is not None:
            fixed = self.fixed
            ratio = where_static(static, fixed.ratio_static, fixed.ratio_kinetic)
            signed = where_static(back, 1 / fixed.ratio_kinetic, ratio)
            return Limit(
                where_static(static, fixed.static, fixed.kinetic),
                signed,
                ratio,
                jnp.ones(()),
                None,
            )
        grip = self.grip
        margin = None
        v = jnp.broadcast_to(v, (self.count,))
        if grip.reads.p:
            f, opposite, still, slope = grip.implicitly(
                T_0, v, surface, back, static
            ).each_way()
        else:
            f, slope = grip.coefficients(T_0, v, surface, back, static=static)
            opposite = f
            if grip.varies:
                still = grip.coefficients(T_0, v, surface, back, static=True).f
        fz = _unlocked(grip.gripped(f))
        ratio = other = sliding_ratio(where_static(back, -fz, fz))
        if grip.reads.p:
            other = sliding_ratio(_unlocked(grip.gripped(opposite)))
        if grip.varies:
            margin = 1 - largest(grip.gripped(still))
        return Limit(fz, ratio, other, slope, margin)

    def linings(self, T_0: Array, T_n: Array, fz: Array) -> LiningForces:
        """Forces at every lining by the mobilisation rule (model §3)."""
        angle = jnp.asarray(self.grip.linings.angle)  # pyright: ignore
        return mobilised(
            T_0, T_n, lining_ratio(fz), angle, continuous=self.grip.continuous
        )

    def sliding(self, T_0: Array, fz: Array, back: Array) -> tuple[Vector, Vector]:
        """Friction `T_i − T_{i−1}` and normal load `(T_i + T_{i−1}) s_i` of the linings
        (N) while every one slides."""
        signed = where_static(back, -fz, fz)
        mu = lining_ratio(signed)
        along = T_0 * running_product(mu)
        before = jnp.concatenate([T_0[None], along[:-1]])
        normal = (
            self.grip.pressed(before, mu)
            if self.grip.continuous
            else (along + before) * self.grip.sine
        )
        return along - before, normal

    def margins(self, T_0: Array, T_n: Array, fz: Array) -> Float[Array, " twice_n"]:
        """Excess (N) of each lining over its limit, from either end (see
        `AbstractMechanism.lining_margins`)."""
        mu = lining_ratio(fz)
        ahead = T_n - T_0 * jnp.cumprod(mu)
        back = T_0 - T_n * jnp.cumprod(mu[::-1])[::-1]
        return jnp.concatenate([ahead, back])
