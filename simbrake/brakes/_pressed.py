"""Brakes whose linings a force presses on a turning face: the disc brake and the
double-shoe brake."""

import abc
import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, Faults, Issues
from .._base._part import Part, part, positive_quantity, quantity, whole
from .._base._quantity import Scalar, Values, meant_within
from ..friction import AbstractFriction, reads
from ..hybrid.arrays import Floats, Mark, ScalarArray, Vector
from ..hybrid.struct import struct_field
from .design import AbstractBrake, AbstractLinings, BrakeWords


class AbstractPressedBrake(AbstractBrake):
    """A brake of rigid linings, each pressed by the force `F` of its actuator; friction
    acts at one radius `r`.

        M = r Σ f_i N_i,   N_i = n_i(F, f_i)

    Another kind of brake is a subclass with `inertia`, `linings` (`AbstractLinings`),
    `words`, `radius` and `normal`. Where friction presses a lining on, so that `N_i`
    depends on `f_i`, it also has `can_lock`, `normal_under`, `self_locking` and
    `locking_words`.

    - `couples_loads`: whether `N_i` depends on the friction of other linings too, as
      where one shoe presses another on
    """

    couples_loads: ClassVar[bool] = True

    @property
    def track_radius(self) -> Scalar:
        return self.radius

    @abc.abstractmethod
    def normal(self, force: Values, f: Floats, back: Mark | bool) -> Vector:
        """Normal forces `N_i` (N) on linings that slide with the coefficients `f`, the
        other way where `back`."""

    def normal_under(self, force: Values, friction: Vector) -> Vector:
        """Normal forces (N) on linings that carry the `friction` (N), > 0 against a
        motion ahead."""
        return self.normal(force, jnp.zeros(self.linings.count), False)

    @property
    def can_lock(self) -> bool:
        """Whether friction presses a lining on, so that it can be self-locking."""
        return False

    def self_locking(self, f: Floats) -> Vector:
        return jnp.zeros(self.linings.count)

    def locking_words(self, i: int, share: float) -> str:
        return f"{self.words.lining} {i} is not self-locking"

    def torque(self, force: Values, f: Floats) -> ScalarArray:
        return jnp.asarray(self.radius) * jnp.sum(f * self.normal(force, f, False))


# --- disc brake ---------------------------------------------------------------------


class AbstractPadPressure(Part):
    """Distribution of the pressure of a pad over its radius, between `r_i` and
    `r_o`."""

    @abc.abstractmethod
    def radius(self, inner: Values, outer: Values) -> ScalarArray:
        """Effective radius `r_e` (m), `M = f N r_e`."""

    @abc.abstractmethod
    def peak(self, inner: Values, outer: Values) -> ScalarArray:
        """Maximum pressure over the mean `N/A`; it is that at `r_i`."""

    @abc.abstractmethod
    def share(self, radius: Values, inner: Values) -> Floats:
        """Pressure at a radius over that at `r_i`."""


class UniformWear(AbstractPadPressure):
    """A pad that has run in and wears evenly, so that `p r` is constant:
    `r_e = (r_o + r_i)/2`.

    Its maximum pressure is `(r_o + r_i)/(2 r_i)` times the mean one.

    Reference: R. G. Budynas, J. K. Nisbett, *Shigley's Mechanical Engineering Design*,
    calliper brakes.

    Example:
        >>> law = sb.brakes.UniformWear()
        >>> round(float(law.radius(0.3, 0.5)), 4), round(float(law.peak(0.3, 0.5)), 4)
        (0.4, 1.3333)
    """

    def radius(self, inner: Values, outer: Values) -> ScalarArray:
        return 0.5 * (outer + inner)

    def peak(self, inner: Values, outer: Values) -> ScalarArray:
        return (outer + inner) / (2 * inner)

    def share(self, radius: Values, inner: Values) -> Floats:
        return jnp.asarray(inner) / jnp.asarray(radius)


class UniformPressure(AbstractPadPressure):
    """A new pad, pressed evenly: `r_e = ⅔ (r_o³ − r_i³)/(r_o² − r_i²)`.

    Reference: Budynas & Nisbett, calliper brakes.

    Example:
        >>> sb.Pads(0.4, 0.3, 0.5, 0.7, pressure=sb.brakes.UniformPressure()).count
        2
    """

    def radius(self, inner: Values, outer: Values) -> ScalarArray:
        # without the difference of squares, which a narrow pad would make small
        outer = jnp.asarray(outer)
        return 2 / 3 * (outer**2 + outer * inner + inner**2) / (outer + inner)

    def peak(self, inner: Values, outer: Values) -> ScalarArray:
        return jnp.ones(())

    def share(self, radius: Values, inner: Values) -> Floats:
        return jnp.ones_like(jnp.asarray(radius))


class Pads(AbstractLinings):
    """Pads of a disc brake, all alike: sectors of a ring, pressed on the faces of the
    disc.

    - `inner_radius` `r_i`, `outer_radius` `r_o` (m) and `angle` (rad) of a pad
    - `count` of pads: two of each calliper
    - `friction`: its law, with numbers for all or per pad
    - `pressure`: its distribution over the radius
    - `permissible_pressure` (Pa): limit of the mean pressure on a pad for the verdict
      on a run

    Example:
        >>> sb.Pads(0.4, "300 mm", "500 mm", "40 deg", faces=4).count
        4
    """

    friction: AbstractFriction = part(AbstractFriction)
    inner_radius: Scalar = positive_quantity("m", "inner radius of a pad")
    outer_radius: Scalar = positive_quantity("m", "outer radius of a pad")
    angle: Scalar = positive_quantity(
        "rad", "angle of a pad about the shaft", high=2 * math.pi
    )
    faces: int = whole("pads on the disc, two of each calliper", high=1000, default=2)
    pressure: AbstractPadPressure = struct_field(default=UniformWear())
    permissible_pressure: Scalar | None = positive_quantity(
        "Pa", "permissible mean pressure", default=None
    )

    @property
    def count(self) -> int:
        return self.faces

    @property
    def area(self) -> ScalarArray:
        """Area of a pad (m²): `A = θ (r_o² − r_i²)/2`."""
        return 0.5 * self.angle * (self.outer_radius**2 - self.inner_radius**2)

    @property
    def radius(self) -> ScalarArray:
        """Effective radius `r_e` (m)."""
        return self.pressure.radius(self.inner_radius, self.outer_radius)

    def greatest_pressure(self, force: Values) -> Floats:
        """Maximum pressure (Pa) on a pad under the `force` (N)."""
        return (
            jnp.asarray(force)
            / self.area
            * self.pressure.peak(self.inner_radius, self.outer_radius)
        )


class DiscBrake(AbstractPressedBrake):
    """A disc brake: pads that callipers clamp on both faces of a disc.

        M = n f F r_e,   N_i = F

    - `inertia` `J` (kg·m²) of the disc and all that turns with its shaft, hook load not
    - `linings`: its `n` pads

    `F` is the clamping force on each pad (`ForceDuty.force`). Slip speed and friction
    force are those at `r_e`.

    Example:
        >>> brake = sb.DiscBrake(400.0, sb.Pads(0.4, 0.3, 0.5, 0.7))
        >>> brake.words.body, brake.kind
        ('disc', 'disc brake')
    """

    inertia: Scalar = positive_quantity("kg*m^2", "inertia about the shaft")
    linings: Pads
    words: ClassVar[BrakeWords] = BrakeWords("disc brake", "pad", "disc")
    couples_loads: ClassVar[bool] = False

    @property
    def radius(self) -> ScalarArray:
        return self.linings.radius

    def normal(self, force: Values, f: Floats, back: Mark | bool) -> Vector:
        return jnp.broadcast_to(force, (self.linings.count,))

    def faults_of_shape(self, path: str) -> Faults:
        pads = self.linings
        where = f"{path}.linings"
        if np.asarray(pads.outer_radius) <= np.asarray(pads.inner_radius):
            inner, outer = float(pads.inner_radius), float(pads.outer_radius)
            what = f"{outer:g} m is not outside of the inner radius {inner:g} m"
            hint = "a pad reaches from inner_radius to outer_radius"
            if inner <= 2 * outer:
                hint += ": are they exchanged, or is one a diameter?"
            elif meant := meant_within(inner, 0.1 * outer, outer):
                hint += f": did you mean {where}.inner_radius = {meant}?"
            return [Fault(f"{where}.outer_radius", what, hint)]
        return []


# --- double-shoe brake --------------------------------------------------------------


class Shoes(AbstractLinings):
    """Linings of the two shoes inside a drum, alike: the leading one ahead (1), the
    trailing one (2).

    - `radius` `r` (m) of their faces, which is that of the drum;  `width` `b` (m)
    - `start` `θ_1`, `end` `θ_2` (rad) of a lining, from the line of the shaft to the
      pin of its shoe
    - `friction`: its law, with numbers for both or for each
    - `permissible_pressure` (Pa): limit of the mean pressure on a lining for the
      verdict on a run

    Example:
        >>> sb.Shoes(0.32, 0.15, "32 mm", 0.0, "126 deg")
        Shoes(
          friction=ConstantFriction(coefficient=0.32, static_ratio=1),
          radius=0.15 m,
          width=32 mm,
          start=0 rad,
          end=126°,
        )
    """

    friction: AbstractFriction = part(AbstractFriction)
    radius: Scalar = positive_quantity("m", "inner radius of the drum")
    width: Scalar = positive_quantity("m", "width of a lining")
    start: Scalar = quantity(
        "rad", "angle at which a lining begins, from its pin", 0.0, math.pi
    )
    end: Scalar = positive_quantity(
        "rad", "angle at which a lining ends, from its pin", high=math.pi
    )
    permissible_pressure: Scalar | None = positive_quantity(
        "Pa", "permissible mean pressure", default=None
    )

    @property
    def count(self) -> int:
        return 2

    @property
    def area(self) -> ScalarArray:
        """Area of a lining (m²): `A = b r (θ_2 − θ_1)`."""
        return self.width * self.radius * (self.end - self.start)

    @property
    def normal_share(self) -> ScalarArray:
        """`∫ sin θ dθ = cos θ_1 − cos θ_2`: normal force over `p̂ b r`."""
        return jnp.cos(jnp.asarray(self.start)) - jnp.cos(jnp.asarray(self.end))

    @property
    def peak(self) -> ScalarArray:
        """Maximum pressure over the mean `N/A`:
        `sin θ_a (θ_2 − θ_1)/(cos θ_1 − cos θ_2)`.

        `θ_a` is the angle of the lining nearest to 90°.
        """
        start = jnp.asarray(self.start)
        end = jnp.asarray(self.end)
        highest = jnp.sin(jnp.clip(0.5 * jnp.pi, start, end))
        return highest * (end - start) / self.normal_share


class ShoeBrake(AbstractPressedBrake):
    """A double-shoe brake: two rigid shoes inside a drum, each on a pin, pressed apart
    by equal forces `F`.

        p = p̂ sin θ,   N = p̂ b r (cos θ_1 − cos θ_2),   M = r (f_1 N_1 + f_2 N_2)
        F c = M_N − M_F  (leading),   F c = M_N + M_F  (trailing)
        M_N = p̂ b r a ∫ sin² θ dθ,   M_F = f p̂ b r ∫ sin θ (r − a cos θ) dθ

    - `inertia` `J` (kg·m²) of the drum and all that turns with its shaft, hook load not
    - `linings`: of both shoes
    - `pin` `a` (m): distance of the pins from the shaft
    - `arm` `c` (m) of the force `F`
      (`ForceDuty.force`) about the pin

    Shoe 1 leads in the braking direction, shoe 2 in the other one. With `M_F ≥ M_N` a
    leading shoe is self-locking. Normal force `N` means the integral of the pressure
    over the lining, pressure its mean `N/A`.

    Reference: Budynas & Nisbett, internal expanding rim brakes.

    Example:
        >>> brake = sb.ShoeBrake(12.0, sb.Shoes(0.32, 0.15, 0.032, 0.0, 2.2), pin=0.1227, arm=0.212)
        >>> brake.linings.count
        2
    """

    inertia: Scalar = positive_quantity("kg*m^2", "inertia about the shaft")
    linings: Shoes
    pin: Scalar = positive_quantity("m", "distance of the pins from the shaft")
    arm: Scalar = positive_quantity("m", "arm of the force about the pin of its shoe")
    couples_loads: ClassVar[bool] = False
    words: ClassVar[BrakeWords] = BrakeWords(
        "double-shoe brake",
        "shoe",
        "drum",
        "M_F ≥ M_N: the friction of a leading shoe presses it on by itself, it is self-locking",
        "lower its friction, shorten its lining, or move the pins away from the shaft",
    )

    @property
    def radius(self) -> Scalar:
        return self.linings.radius

    @property
    def can_lock(self) -> bool:
        return True

    @property
    def normal_moment(self) -> ScalarArray:
        """`M_N/N` (m): arm of the normal force about the pin,
        `a ∫ sin² θ dθ/(cos θ_1 − cos θ_2)`."""
        start = jnp.asarray(self.linings.start)
        end = jnp.asarray(self.linings.end)
        squares = 0.5 * (end - start) - 0.25 * (jnp.sin(2 * end) - jnp.sin(2 * start))
        return jnp.asarray(self.pin) * squares / self.linings.normal_share

    @property
    def friction_moment(self) -> ScalarArray:
        """`M_F/(f N)` (m): arm of the friction about the pin,
        `r − (a/2)(sin² θ_2 − sin² θ_1)/(cos θ_1 − cos θ_2)`."""
        start = jnp.asarray(self.linings.start)
        end = jnp.asarray(self.linings.end)
        # sin² θ_2 − sin² θ_1 = (cos θ_1 − cos θ_2)(cos θ_1 + cos θ_2)
        return jnp.asarray(self.radius) - 0.5 * jnp.asarray(self.pin) * (
            jnp.cos(start) + jnp.cos(end)
        )

    def normal(self, force: Values, f: Floats, back: Mark | bool) -> Vector:
        leads = jnp.where(back, -1.0, 1.0) * jnp.asarray([1.0, -1.0])
        arm = self.normal_moment - leads * f * self.friction_moment
        # a shoe that is self-locking has no such force: the caller handles it
        return (
            jnp.asarray(force) * self.arm / jnp.where(arm > 0, arm, self.normal_moment)
        )

    def normal_under(self, force: Values, friction: Vector) -> Vector:
        own = friction * jnp.asarray([1.0, -1.0]) * self.friction_moment
        return (jnp.asarray(force) * self.arm + own) / self.normal_moment

    def self_locking(self, f: Floats) -> Vector:
        return self.friction_moment * f / self.normal_moment

    def locking_words(self, i: int, share: float) -> str:
        leads = "braking" if i == 1 else "other"
        return (
            f"shoe {i}: M_F/M_N = {share:.4g} ≥ 1, leading in the {leads} direction "
            "it is self-locking"
        )

    def greatest_pressure(self, normal: Values) -> Floats:
        """Maximum pressure (Pa) on a lining under the normal force (N)."""
        return jnp.asarray(normal) / self.linings.area * self.linings.peak

    def faults_of_shape(self, path: str) -> Faults:
        shoes = self.linings
        where = f"{path}.linings"
        faults = Issues()
        if np.asarray(shoes.end) <= np.asarray(shoes.start):
            what = f"{float(shoes.end):g} rad is not beyond the start {float(shoes.start):g} rad"
            faults.add(
                f"{where}.end",
                what,
                "a lining reaches from start to end, counted from its pin",
            )
        if np.asarray(self.pin) >= np.asarray(shoes.radius):
            what = f"{float(self.pin):g} m is not inside the drum of {float(shoes.radius):g} m"
            hint = "the pins of internal shoes are inside the drum"
            if meant := meant_within(
                float(self.pin), 0.1 * float(shoes.radius), float(shoes.radius)
            ):
                hint += f": did you mean {meant}?"
            faults.add(f"{path}.pin", what, hint)
        if reads(shoes.friction, 2, T=True, p=True).p:
            hint = (
                "the pressure of a shoe depends on its friction: take a law of "
                "speed and temperature"
            )
            faults.add(
                f"{where}.friction",
                "cannot depend on the pressure of a double-shoe brake",
                hint,
            )
        return faults
