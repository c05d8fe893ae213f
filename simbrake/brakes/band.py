"""A band on linings: its statics, and its compliance."""

import abc
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._corners import lesser
from .._base._faults import Fault, Faults
from .._base._part import (
    Part,
    as_part,
    positive_quantity,
    quantity,
    short_for,
    structural,
)
from .._base._quantity import IndexedBy, Scalar, Values
from ..hybrid.arrays import (
    Array,
    Floats,
    IntScalar,
    Marks,
    ScalarArray,
    TwoArrays,
    Vector,
    VectorK,
)
from ..hybrid.struct import AbstractVar, struct_field


def grip(f: Floats, angle: Vector, *, continuous: bool = False) -> Vector:
    """`f_i z_i = f_i tan(β_i/2)` of each lining; at 1 or above the lining is
    self-locking.

    - `continuous`: pieces of a continuous lining, `tanh(f_i β_i/2)`: their ratio of
      tensions is then Euler's `e^{f_i β_i}`, and nothing locks

    Example:
        >>> sb.brakes.grip(np.float64(0.35), np.radians([13.5, 27.0])).round(4).tolist()
        [0.0414, 0.084]
    """
    return gripped(
        f, angle / 2 if continuous else jnp.tan(angle / 2), continuous=continuous
    )


def gripped(f: Floats, z: Vector, *, continuous: bool) -> Vector:
    """The same with `z_i = tan(β_i/2)`, or of a continuous lining `β_i/2`."""
    return jnp.tanh(f * z) if continuous else f * z


def pressed(before: Array, ratio: Array, s: Vector, *, continuous: bool) -> Vector:
    """Normal loads (N) under the tensions `T_{i−1}` (`before`) and
    `T_i = ratio T_{i−1}` (N) of a band:

        N_i = (T_i + T_{i−1}) sin(β_i/2)  (Z-13),   of a continuous lining  ∫ T dθ = β_i (T_i − T_{i−1})/ln(T_i/T_{i−1})

    - `s`: `sin(β_i/2)`, or of a continuous lining `β_i/2`
    """
    return (
        before * 2 * s * _mean_rise(jnp.log(ratio))
        if continuous
        else before * (1 + ratio) * s
    )


def lining_ratio(fz: Floats) -> Floats:
    """`μ_i = T_i/T_{i−1} = (1 + f_i z_i)/(1 − f_i z_i)` of linings that slide,
    `|f_i z_i| < 1` (Z-12…Z-14)."""
    return (1 + fz) / (1 - fz)


def band_torque(radius: Array, slack: Array, tight: Array) -> Floats:
    """`M = R_b (T_n − T_0)` (N·m) of a band; sliding, with `T_n = Π T_0`, it is
    `R_b T_0 (Π − 1)` (Z-15…Z-18)."""
    return radius * (tight - slack)


def tension_ratio(fz: Vector) -> tuple[Vector, Marks]:
    """Tension ratio of each lining at its limit, and which linings are self-locking.

        μ_i = T_i/T_{i−1} = (1 + f_i z_i)/(1 − f_i z_i),   z_i = tan(β_i/2)                                (Z-12…Z-14)

    Where `f_i z_i ≥ 1` the limit is infinite: that lining is marked and its ratio given
    as 1, for the caller to handle.

    Example:
        >>> ratio, locked = sb.brakes.tension_ratio(np.array([0.5, 1.2]))
        >>> ratio.tolist(), locked.tolist()
        ([3.0, 1.0], [False, True])
    """
    locked = fz >= 1.0
    safe = jnp.where(locked, 0.0, fz)
    return lining_ratio(safe), locked


_Vectors: TypeAlias = tuple[Vector]


@jax.custom_jvp
def product(mu: Vector) -> ScalarArray:
    """`∏ μ_i` of ratios that are never 0."""
    return jnp.prod(mu)


@product.defjvp
def _(primals: _Vectors, tangents: _Vectors) -> TwoArrays:
    # the general rule of jnp.prod costs n products; here no factor is 0
    (mu,) = primals
    (d_mu,) = tangents
    whole = jnp.prod(mu)
    return whole, whole * jnp.sum(d_mu / mu)


def _running(
    combine: Callable[[Array, Array], Array], x: Vector, neutral: float
) -> Vector:
    """`x_1 ∘ … ∘ x_i` by doubling: log₂ n short vector operations, where a sum over a
    mask costs n² serial ones."""
    reach = 1
    while reach < x.shape[0]:
        x = combine(x, jnp.concatenate([jnp.full(reach, neutral), x[:-reach]]))
        reach *= 2
    return x


@jax.custom_jvp
def running_product(mu: Vector) -> Vector:
    """`Π_i = ∏_{j≤i} μ_j` of ratios that are never 0."""
    return _running(jnp.multiply, mu, 1.0)


@running_product.defjvp
def _(primals: _Vectors, tangents: _Vectors) -> TwoArrays:
    (mu,) = primals
    (d_mu,) = tangents
    running = running_product(mu)
    return running, running * _running(jnp.add, d_mu / mu, 0.0)


@jax.custom_jvp
def sliding_ratio(fz: Vector) -> ScalarArray:
    """`Π = ∏ (1 + f_i z_i)/(1 − f_i z_i)` for `|f_i z_i| < 1`; of negative ones it is
    `1/Π`."""
    return jnp.prod(lining_ratio(fz))


@sliding_ratio.defjvp
def _(primals: _Vectors, tangents: _Vectors) -> TwoArrays:
    # d ln Π = Σ 2 d(f_i z_i)/(1 − (f_i z_i)²)
    (fz,) = primals
    (d_fz,) = tangents
    ratio = sliding_ratio(fz)
    return ratio, ratio * jnp.sum(2 / (1 - fz * fz) * d_fz)


def affine_tensions(T_0: ScalarArray, a: Vector, b: Vector) -> Vector:
    """`T_i = a_i T_{i−1} + b_i` without a loop: `T_i = A_i (T_0 + Σ_{j≤i} b_j/A_j)`,
    `A_i = ∏_{j≤i} a_j ≠ 0`."""
    A = running_product(a)
    return A * (T_0 + _running(jnp.add, b / A, 0.0))


def capstan_ratio(f: ScalarArray, wrap: ScalarArray) -> ScalarArray:
    """Euler's limit for many small linings, `T_n/T_0 → exp(f α)`.

    Example:
        >>> round(float(sb.brakes.capstan_ratio(np.float64(0.35), np.radians(270.0))), 4)
        5.2035
    """
    return jnp.exp(f * wrap)


class LiningForces(NamedTuple):
    """Forces at every lining: tension behind it `T_i`, circumferential and normal force
    `F_i`, `N_i` (N).

    `tension` is `None` where no band presses the linings.

    Example:
        >>> forces = sb.brakes.sliding_tensions(10e3, 0.35, np.radians([13.5, 13.5]))
        >>> forces.normal.round().tolist()
        [2452.0, 2664.0]
    """

    tension: Values
    friction: Vector
    normal: Vector
    at_limit: Marks


def mobilised(
    T_0: ScalarArray,
    T_n: ScalarArray,
    mu: Vector,
    angle: Vector,
    *,
    continuous: bool = False,
) -> LiningForces:
    """Distribution of a given pair of end tensions by the mobilisation rule (model §3).

        T_i = min(T_0 Π_i, T_n)                 from the slack end while T_n ≥ T_0
        T_i = min(T_n ∏_{j>i} μ_j, T_0)         from the anchor while T_n < T_0
        F_i = (T_i − T_{i−1}) cos(β_i/2),  N_i = (T_i + T_{i−1}) sin(β_i/2)                                (Z-12)

    The first linings of that order are at their limit, the next carries the rest, the
    others nothing: the rule used wherever rigid bodies leave the load sharing
    undetermined. Of a `continuous` lining, of which these are pieces, that is the arc
    that slips on an elastic band, `ln(T_n/T_0)/f`, to a piece; `F_i = T_i − T_{i−1}`,
    and `N_i = ∫ T dθ`.

    Example:
        >>> forces = sb.brakes.mobilised(10e3, 13e3, np.full(4, 1.1), np.full(4, 0.3))
        >>> forces.tension.round().tolist(), forces.at_limit.tolist()
        ([11000.0, 12100.0, 13000.0, 13000.0], [True, True, False, False])
    """
    forward = T_n >= T_0
    ahead = jnp.cumprod(mu)
    behind = jnp.append(jnp.cumprod(mu[::-1])[::-1][1:], 1.0)
    tension = jnp.where(forward, lesser(T_0 * ahead, T_n), lesser(T_n * behind, T_0))
    before = jnp.append(T_0, tension[:-1])
    slack = 1e-12 * jnp.maximum(T_0, T_n)
    limit_ahead = T_0 * ahead <= T_n + slack
    limit_behind = T_n * jnp.cumprod(mu[::-1])[::-1] <= T_0 + slack
    at_limit = jnp.where(forward, limit_ahead, limit_behind) & (
        jnp.maximum(T_0, T_n) > 0
    )
    if continuous:
        taut = (tension > 0) & (before > 0)
        ratio = jnp.where(taut, tension, 1.0) / jnp.where(taut, before, 1.0)
        normal = pressed(before, ratio, angle / 2, continuous=True)
        return LiningForces(tension, tension - before, normal, at_limit)
    return LiningForces(
        tension=tension,
        friction=(tension - before) * jnp.cos(angle / 2),
        normal=(tension + before) * jnp.sin(angle / 2),
        at_limit=at_limit,
    )


def limit_tensions(T_0: ScalarArray, mu: Vector) -> Float[Array, " pieces"]:
    """Tensions `T_n` (2 n + 1,), rising, at which one lining more or less is at its
    limit.

        T_0/∏_{all} μ, …, T_0/μ_n, T_0, T_0 μ_1, …, T_0 Π_n

    Between two of them all tensions along the band are linear in `T_n`.
    """
    down = running_product(mu[::-1])
    return jnp.concatenate([T_0 / down[::-1], T_0[None], T_0 * running_product(mu)])


def piece_of(T_0: ScalarArray, T_n: ScalarArray, mu: Vector) -> IntScalar:
    """Number of linings at their limit: `k = 0…n − 1` from the slack end; with
    `T_n < T_0` `−1 − k` from the anchor."""
    n = mu.shape[0]
    passed = jnp.sum(limit_tensions(T_0, mu) <= T_n).astype(jnp.int32)
    return jnp.clip(passed - 1 - n, -n, n - 1)


def tensions_on(
    T_0: ScalarArray, T_n: ScalarArray, mu: Vector, piece: IntScalar
) -> Vector:
    """Tensions `T_1…T_n` by the mobilisation rule for a given number of linings at
    their limit (see `piece_of`).

    Linear in `T_0` and `T_n`. `n` and `−1 − n` mean full slip ahead and back, for any
    `T_n`.
    """
    n = mu.shape[0]
    i = jnp.arange(1, n + 1, dtype=jnp.int32)
    behind = jnp.append(running_product(mu[::-1])[::-1][1:], 1.0)
    ahead = jnp.where(i <= piece, T_0 * running_product(mu), T_n)
    back = jnp.where(i >= n + 1 + piece, T_n * behind, T_0)
    return jnp.where(piece >= 0, ahead, back)


def sliding_tensions(
    T_0: ScalarArray,
    f: Vector,
    angle: Vector,
    *,
    inertia_force: Vector | float = 0.0,
    centrifugal_force: Vector | float = 0.0,
) -> LiningForces:
    """All linings at their limit, with the optional mass terms of the lining model
    (model §2.2).

        F_i = (T_i − T_{i−1}) c_i + m_i a_i,  N_i = (T_i + T_{i−1}) s_i − m_i R ω_i² ≥ 0,  F_i = f_i N_i    (Z-12…Z-14)
        T_i = [T_{i−1} (c_i + f_i s_i) − m_i a_i − f_i m_i R ω_i²] / (c_i − f_i s_i)

    - `inertia_force`: `m_i a_i` (N), the lining's own acceleration along the rim
    - `centrifugal_force`: `m_i R ω_i²` (N), the lining's own speed; where it exceeds
      the band's push the lining lifts off: `N_i = F_i = 0` and
      `T_i = T_{i−1} − m_i a_i/c_i`.

    A lining on an anchored band rests: both are zero and `T_i = μ_i T_{i−1}`. Needs
    `f_i tan(β_i/2) < 1`.

    Example:
        >>> sb.brakes.sliding_tensions(10e3, 0.35, np.radians([13.5, 13.5])).tension.round().tolist()
        [10864.0, 11803.0]
    """
    c = jnp.cos(angle / 2)
    s = jnp.sin(angle / 2)
    ma = jnp.broadcast_to(jnp.asarray(inertia_force, c.dtype), c.shape)
    mrw = jnp.broadcast_to(jnp.asarray(centrifugal_force, c.dtype), c.shape)
    f = jnp.broadcast_to(f, c.shape)

    def lining(
        before: Array, inputs: tuple[Array, ...]
    ) -> tuple[Array, tuple[Array, ...]]:
        f, c, s, ma, mrw = inputs
        after = (before * (c + f * s) - ma - f * mrw) / (c - f * s)
        lifted = (after + before) * s < mrw
        after = jnp.where(lifted, before - ma / c, after)
        normal = jnp.where(lifted, 0.0, (after + before) * s - mrw)
        return after, (after, f * normal, normal)

    _, (tension, friction, normal) = jax.lax.scan(
        lining, jnp.asarray(T_0, c.dtype), (f, c, s, ma, mrw)
    )
    return LiningForces(tension, friction, normal, jnp.ones(c.shape, bool))


class ChordForces(NamedTuple):
    """Tensions `T_1…T_k` of the chords behind the linings and normal loads `N_1…N_k`
    (N).

    Example:
        >>> sb.brakes.chord_tensions(10e3, 0.35, np.radians([8.0, 16.0, 8.0])).normal.round().tolist()
        [2208.0, 2319.0]
    """

    tension: VectorK
    normal: VectorK


def chord_tensions(
    T_0: ScalarArray, f: Floats, beta: Float[Array, " k_plus_1"]
) -> ChordForces:
    """Tensions along a band on point linings joined by chords (model §2.1).

        T_i = T_{i−1} (c_{i−1} + f s_{i−1}) / (c_i − f s_i),   N_i = T_i s_i + T_{i−1} s_{i−1}              (Z-1…Z-4)

    `beta` (k + 1,) holds `β_0…β_k` (rad): chord `i` between lining `i` and `i + 1`
    subtends `β_i`, `β_0` and `β_k` belong to the end chords. Needs `1 − f z_i > 0` for
    every `i ≥ 1`.

    Example:
        >>> sb.brakes.chord_tensions(10e3, 0.35, np.radians([8.0, 16.0, 8.0])).tension.round().tolist()
        [10854.0, 11588.0]
    """
    c = jnp.cos(beta / 2)
    s = jnp.sin(beta / 2)
    ratio = (c[:-1] + f * s[:-1]) / (c[1:] - f * s[1:])
    tension = T_0 * jnp.cumprod(ratio)
    before = jnp.append(jnp.asarray(T_0, tension.dtype), tension[:-1])
    return ChordForces(tension, tension * s[1:] + before * s[:-1])


# --- pressure within a lining -------------------------------------------------------


def pressure_within(mean: Values, ratio: Values, place: Values) -> Floats:
    """Pressure (Pa) at a place within a lining under a band whose tension rises along
    it (Z, fig. 2):

        p(θ) = (N_i/(R b)) κ e^{κθ}/(e^{κα_i} − 1),   κ = ln(T_i/T_{i−1})/α_i

    - `mean` `N_i/(R b α_i) = N_i/A_i` (Pa)
    - `ratio` `T_i/T_{i−1} > 0` of the tensions at its two sides
    - `place` `θ/α_i`: 0 at the edge towards the slack end of the band, 1 at that
      towards the tight end

    `α_i` is the arc of its face. The mean over the face is `mean` for every ratio, also
    below the limit of friction, and the pressures at the two edges have that ratio: by
    Euler's formula `e^{f α_i}`, where the lining slides.

    Example:
        >>> pressure = sb.brakes.pressure_within(0.8e6, 1.1, np.array([0.0, 0.5, 1.0]))
        >>> [round(p / 1e6, 3) for p in pressure.tolist()]
        [0.762, 0.8, 0.839]
    """
    x = jnp.log(jnp.asarray(ratio))
    return mean * jnp.exp(x * place) / _mean_rise(x)


# --- compliance ---------------------------------------------------------------------


def tension_rise(f: Values, angle: Values) -> ScalarArray:
    """`S_H/S_C = exp(Σ f_i α_i)` of sliding linings; `f` a number or (n,), `angle` (n,)
    in rad.

    Example:
        >>> round(float(sb.brakes.tension_rise(0.35, np.radians(13.5))), 5)
        1.08596
    """
    return jnp.exp(jnp.sum(jnp.asarray(f) * jnp.asarray(angle)))


def _mean_rise(x: Array) -> Array:
    """`(e^x − 1)/x`, 1 at `x = 0`, with exact derivatives there."""
    small = jnp.abs(x) < 0.02
    away = jnp.where(small, 1.0, x)
    near = 1 + x / 2 * (
        1 + x / 3 * (1 + x / 4 * (1 + x / 5 * (1 + x / 6 * (1 + x / 7))))
    )
    return jnp.where(small, near, jnp.expm1(away) / away)


class AbstractStiffness(Part):
    """A model of the stiffness `C` of a band (N/m): tension of the tight end per unit
    elongation.

    Its methods take the friction `f` (a number or (n,)) and central angles `angle` (n,)
    in rad of the linings and the radius `R_0` (m) of the band circle, which the scene
    has already.
    """

    @abc.abstractmethod
    def stiffness(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        """`C = S_H/Δl` in N/m, linkage included."""

    def faults_with(self, path: str, n: int) -> Faults:
        """Errors of sizes that do not fit `n` linings (concrete values only)."""
        return []

    def compliance(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        """`c = Δl/S_C = e^{Σfα}/C` in m/N, the `C_i` of K-8 for Euler's law along the
        band, linkage included."""
        return tension_rise(f, angle) / self.stiffness(f, angle, radius)

    def elongation(
        self, slack_tension: Values, f: Values, angle: Values, radius: Values
    ) -> ScalarArray:
        """`Δl = c S_C` in m for the slack tension `S_C` (N)."""
        return jnp.asarray(slack_tension) * self.compliance(f, angle, radius)

    def bare_angle(self, n: int) -> Scalar | float:
        """Angle (rad) on the pulley that no lining covers: `Σ β_i` of the gaps."""
        return 0.0

    @property
    def longest_wrap(self) -> float:
        """Largest wrap angle in rad: once around, unless the band can pass itself."""
        return 2 * math.pi


@short_for(AbstractStiffness)
class GivenStiffness(AbstractStiffness):
    """A band whose stiffness `value` (N/m) is known: for bands in parallel, where a
    bare number may be written too.

    Example:
        >>> sb.brakes.GivenStiffness("100 kN/m").value
        array(100000.)
    """

    value: Scalar = positive_quantity("N/m", "stiffness at the tight end")

    def stiffness(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        return jnp.asarray(self.value)


def _in_series(own: ScalarArray, linkage: Scalar | None) -> ScalarArray:
    """`1/C = 1/C_own + 1/C_linkage`."""
    return own if linkage is None else 1 / (1 / own + 1 / jnp.asarray(linkage))


class AbstractGeometry(AbstractStiffness):
    """A band whose stiffness follows from its dimensions, in series with anchor and
    linkage.

        1/C = Δl/S_H + 1/C_linkage,   S_H = S_C e^{Σfα}

    The tensions are those of full slip; before it they are more even along the band,
    and `C` is kept.
    """

    linkage: AbstractVar[Any]

    @abc.abstractmethod
    def stretch(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        """`Δl/S_C` in m/N of the band alone."""

    def stiffness(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        return _in_series(
            tension_rise(f, angle) / self.stretch(f, angle, radius), self.linkage
        )


class LiningsOnPlates(AbstractGeometry):
    """Linings on elastic plates: not bonded, the band stretches alone (K-2).

        Δl/S_C = R_0/(E_1A_1) [Σ_i e_{i−1} (e^{f_i α_i} − 1)/f_i + Σ_{i<n} e_i β_i] +
        (l_C + e_n l_H)/(E_1A_1) e_i = exp(Σ_{j≤i} f_j α_j)

    - `modulus` `E_1` (Pa), `area` `A_1` (m²) of the band
    - `R_0` is `Band.radius`, `α_i` are `Lining.angle`
    - `slack_end` `l_C`, `tight_end` `l_H` (m): free ends beyond the first and the last
      lining
    - `gap` `β` (rad) between neighbouring linings, beyond their own angles: a number or
      (n − 1,); no friction there
    - `linkage` (N/m): stiffness of anchor and linkage in series
    - `halved_ends`: half of the end terms, as K prints

    An end under a constant tension stretches by `S l/(EA)`, so that the half is an
    option only. Source: K-2, model §2.3; consistent as printed but for the halved ends.

    Example:
        >>> plates = sb.brakes.LiningsOnPlates("210 GPa", "13 cm^2", slack_end="0.3 m", tight_end="0.5 m")
        >>> round(float(plates.stiffness(0.35, np.radians([13.5] * 20), 0.623)) / 1e6, 2)
        136.8
    """

    modulus: Scalar = positive_quantity("Pa", "modulus of the band")
    area: Scalar = positive_quantity("m^2", "cross-section of the band")
    slack_end: Scalar = quantity(
        "m", "free length at the slack end", low=0.0, default=0.0
    )
    tight_end: Scalar = quantity(
        "m", "free length at the tight end", low=0.0, default=0.0
    )
    gap: Scalar = quantity(
        "rad",
        "angle between neighbouring linings",
        low=0.0,
        many=IndexedBy.ROWS,
        may_be_empty=True,
        default=0.0,
    )
    linkage: Scalar | None = positive_quantity(
        "N/m", "stiffness of anchor and linkage", default=None
    )
    halved_ends: bool = structural(default=False)

    def stretch(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        angle = jnp.asarray(angle)
        steps = jnp.broadcast_to(jnp.asarray(f), angle.shape) * angle
        after = jnp.exp(jnp.cumsum(steps))
        before = jnp.exp(jnp.cumsum(steps) - steps)
        arcs = jnp.sum(before * angle * _mean_rise(steps)) / self.per_angle(radius)
        gaps = jnp.sum(after[:-1] * jnp.asarray(self.gap)) * radius
        ends = (0.5 if self.halved_ends else 1.0) * (
            self.slack_end + self.tight_end * after[-1]
        )
        return arcs + (gaps + ends) / (jnp.asarray(self.modulus) * self.area)

    def per_angle(self, radius: Values) -> ScalarArray:
        """`k`: tension (N) per unit of elongation and angle of an arc under a
        lining."""
        return jnp.asarray(self.modulus) * self.area / radius

    def bare_angle(self, n: int) -> Scalar | float:
        return np.sum(np.broadcast_to(np.asarray(self.gap), (n - 1,)))

    def faults_with(self, path: str, n: int) -> Faults:
        shape = np.shape(self.gap)
        if shape in ((), (n - 1,)):
            return []
        return [
            Fault(
                f"{path}.gap",
                f"has the shape {shape}",
                f"give one number, or {n - 1} for the gaps",
            )
        ]


class BondedLinings(LiningsOnPlates):
    """Linings that stretch with the band: dovetail, bolts or rivets (K-1).

        Δl/S_C = Σ_i e_{i−1} (e^{f_i α_i} − 1)/(f_i k) + R_0/(E_1A_1) Σ_{i<n} e_i β_i +
        (l_C + e_n l_H)/(E_1A_1) k = E_1A_1/R_0 + E_2A_2/R_0'

    - `lining_modulus` `E_2` (Pa), `lining_area` `A_2` (m²): cross-section
    - `lining_radius` `R_0'` (m) of their middle
    - everything else as in `LiningsOnPlates`, which is the limit `E_2 A_2 → 0`

    K-1 as printed begins the sum over the arcs at `e^{fα}` instead of 1 (the first
    lining starts at `S_C`), and its gaps and ends lack the factor `R_0/(E_1A_1)` that
    K-4 has: this is the consistent form. Source: K-1, model §2.3.

    Example:
        >>> lining = {"lining_modulus": "1 GPa", "lining_area": "60 cm^2", "lining_radius": "0.61 m"}
        >>> bonded = sb.brakes.BondedLinings("210 GPa", "13 cm^2", "0.3 m", "0.5 m", **lining)
        >>> round(float(bonded.stiffness(0.35, np.radians([13.5] * 20), 0.623)) / 1e6, 2)
        139.0
    """

    lining_modulus: Scalar = quantity(
        "Pa", "modulus of the linings", low=0.0, kw_only=True
    )
    lining_area: Scalar = quantity(
        "m^2", "cross-section of the linings", low=0.0, kw_only=True
    )
    lining_radius: Scalar = positive_quantity(
        "m", "radius of the linings' middle", kw_only=True
    )

    def per_angle(self, radius: Values) -> ScalarArray:
        return (
            super().per_angle(radius)
            + self.lining_modulus * self.lining_area / self.lining_radius
        )


class ContinuousLining(AbstractGeometry):
    """One continuous bonded lining on a slotted band, which passes through itself: the
    wrap may exceed 2π (K-3).

        Δl/S_C = ∫_0^α e^{fθ} dθ/k(θ) + l_C/(E_1A_1') + l_H e^{fα}/(E_1A_1'')
        k = E_1A_1'/R_0 + E_2A_2'/R_0'  for θ < split (the tongue),   E_1A_1''/R_0 + E_2A_2''/R_0'  beyond (the slot)

    - `slack_area` `A_1'`, `slack_lining_area` `A_2'` (m²): band and lining from the
      slack end to the angle `split`
    - `tight_area` `A_1''`, `tight_lining_area` `A_2''`: from there to the tight end
    - `modulus` `E_1`, `lining_modulus` `E_2` (Pa), `lining_radius` `R_0'`, free ends,
      `linkage` as in `BondedLinings`

    `α` is the sum of the scene's `Lining.angle`, there the elements of the one lining
    (take many), with friction each. The arc term printed in K-3 has the dimension of a
    length and mixes both sections without a reason given (it lacks `1/(EA)`); this is
    the arc of K-1 with the sections where they are. Ends are in full, as printed.
    Source: K-3, model §2.3.

    Example:
        >>> areas = {"slack_area": 6e-4, "tight_area": 1e-3, "slack_lining_area": 3e-3, "tight_lining_area": 5e-3}
        >>> band = sb.brakes.ContinuousLining(2.1e11, split="180 deg", lining_modulus=1e9, lining_radius=0.61, **areas)
        >>> round(float(band.stiffness(0.35, np.radians([13.5] * 30), 0.623)) / 1e6, 2)
        117.53
    """

    modulus: Scalar = positive_quantity("Pa", "modulus of the band")
    slack_area: Scalar = positive_quantity("m^2", "cross-section of the band's tongue")
    tight_area: Scalar = positive_quantity("m^2", "cross-section of the slotted band")
    split: Scalar = quantity(
        "rad", "angle from the slack end at which the section changes", low=0.0
    )
    lining_modulus: Scalar = quantity("Pa", "modulus of the lining", low=0.0)
    slack_lining_area: Scalar = quantity(
        "m^2", "cross-section of the lining on the tongue", low=0.0
    )
    tight_lining_area: Scalar = quantity(
        "m^2", "cross-section of the slotted lining", low=0.0
    )
    lining_radius: Scalar = positive_quantity("m", "radius of the lining's middle")
    slack_end: Scalar = quantity(
        "m", "free length at the slack end", low=0.0, default=0.0
    )
    tight_end: Scalar = quantity(
        "m", "free length at the tight end", low=0.0, default=0.0
    )
    linkage: Scalar | None = positive_quantity(
        "N/m", "stiffness of anchor and linkage", default=None
    )

    def stretch(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        f = jnp.asarray(f)
        angle = jnp.asarray(angle)
        E_1 = jnp.asarray(self.modulus)
        E_2 = jnp.asarray(self.lining_modulus)
        slack = (
            E_1 * self.slack_area / radius
            + E_2 * self.slack_lining_area / self.lining_radius
        )
        tight = (
            E_1 * self.tight_area / radius
            + E_2 * self.tight_lining_area / self.lining_radius
        )
        # each element up to the split, and from there on
        ahead = self.split - (jnp.cumsum(angle) - angle)
        first = jnp.where(ahead > 0, lesser(ahead, angle), 0.0)
        rest = angle - first
        before = jnp.exp(jnp.cumsum(f * angle) - f * angle)
        of_slack = before * first * _mean_rise(f * first)
        of_tight = before * jnp.exp(f * first) * rest * _mean_rise(f * rest)
        ends = self.slack_end / (E_1 * self.slack_area)
        ends += self.tight_end * tension_rise(f, angle) / (E_1 * self.tight_area)
        return jnp.sum(of_slack) / slack + jnp.sum(of_tight) / tight + ends

    @property
    def longest_wrap(self) -> float:
        return 4 * math.pi  # the tongue passes the slot once


def _as_bands(
    bands: Iterable[AbstractStiffness | float],
) -> tuple[AbstractStiffness, ...]:
    if not isinstance(bands, Iterable):
        return bands  # which the part refuses
    return tuple(as_part(band, AbstractStiffness) for band in bands)


class ParallelBands(AbstractStiffness):
    """Several bands side by side under one lever, each with its own stiffness or
    geometry, and with equal linings (K-8).

        C = Σ C_j,   T_0,j = T_0 C_j/Σ C_j   (K-8 with c_j = Π/C_j),   1/C → 1/C + 1/C_linkage

    - `bands`: geometries or numbers (N/m)
    - `linkage` (N/m): stiffness common to all bands, in series

    They act exactly as one band: lever and anchor give all the same elongation `x`, so
    that `T_n,j = C_j x` and `T_n,j/T_0,j` is the same for every band at every time;
    angles and friction being equal, all reach every limit together, at the same `Π`.
    They differ in the tension that each carries: `shares`. With a law that depends on
    temperature or pressure, and unequal shares, the scene has the mean band (a warning
    says so). Bands whose linings differ are a `MultiBandBrake`. Source: K-5…K-8, model
    §2.3; K names the compliance `C_i` a stiffness.

    Example:
        >>> sb.brakes.ParallelBands([1e5, 2e5]).bands
        (GivenStiffness(value=100 kN/m), GivenStiffness(value=200 kN/m))
    """

    bands: tuple[AbstractStiffness, ...] = struct_field(converter=_as_bands)
    linkage: Scalar | None = positive_quantity(
        "N/m", "stiffness that the bands have in common", default=None
    )

    def stiffness(self, f: Values, angle: Values, radius: Values) -> ScalarArray:
        own = [band.stiffness(f, angle, radius) for band in self.bands]
        return _in_series(jnp.asarray(sum(own)), self.linkage)

    def shares(self, f: Values, angle: Values, radius: Values) -> VectorK:
        """Share of every tension that each band has; they sum to 1."""
        return lever_split(
            jnp.stack([band.compliance(f, angle, radius) for band in self.bands]), 1.0
        )

    def bare_angle(self, n: int) -> Scalar | float:
        return max(band.bare_angle(n) for band in self.bands)

    @property
    def longest_wrap(self) -> float:
        return min(band.longest_wrap for band in self.bands)

    def faults_with(self, path: str, n: int) -> Faults:
        if not self.bands:
            return [
                Fault(
                    f"{path}.bands",
                    "there is no band",
                    "give a stiffness or a geometry for each",
                )
            ]
        return [
            fault
            for i, band in enumerate(self.bands)
            for fault in band.faults_with(f"{path}.bands[{i}]", n)
        ]


def lever_split(compliances: Values, tension: Values) -> VectorK:
    """Slack tensions (N) of bands in parallel under one lever that gives the sum `S`,
    with equal elongation.

        S_i = S/(c_i Σ_j 1/c_j)                                                                                   (K-8)

    - `compliances` (k,): `c_i = Δl_i/S_i` (m/N);  `tension`: `S` (N)

    Example:
        >>> sb.brakes.lever_split([1e-7, 3e-7], 12e3).round().tolist()
        [9000.0, 3000.0]
    """
    yielding = 1 / jnp.asarray(compliances)
    return jnp.asarray(tension) * (yielding / jnp.sum(yielding))
