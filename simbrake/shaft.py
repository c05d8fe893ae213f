"""Torques on the shaft beside the brake: auxiliary brakes, drag, and dry friction of
bearings and tackle."""

import abc
import re
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from ._base._faults import Fault, Faults, Issues, input_error
from ._base._part import Part, part, positive_quantity, quantity, structural
from ._base._quantity import IndexedBy, Scalar
from .friction import interpolated, is_table
from .hybrid.arrays import Array, TwoArrays
from .hybrid.struct import AbstractVar, with_fields
from .profiles import AbstractProfile, Constant, Piece, Real, faults_of_sign

__all__ = [
    "AbstractAuxiliaryBrake",
    "AbstractDryTorque",
    "AbstractShaftTorque",
    "BearingFriction",
    "EddyCurrentBrake",
    "HydrodynamicBrake",
    "TabulatedDrag",
    "TackleLoss",
    "ViscousDrag",
]


class AbstractShaftTorque(Part):
    """A torque on the shaft against its rotation; its work is heat.

    - `place`: body of the thermal network, or face of a wall, that the heat enters;
      `None`: it enters no body (lost)
    """

    place: AbstractVar[str | None]

    @property
    def profile(self) -> AbstractProfile:
        """The given function of time in it, whose time breakpoints it has."""
        return Constant(0.0)

    @abc.abstractmethod
    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        """`M(t, ω)` in N·m, of the sign of `ω` and 0 at `ω = 0`.

        - `piece` of its `profile`;  `load` (N·m): torque of the load on a shaft at rest
        """

    def turning(
        self, t: Real, omega: Real, piece: Piece, load: Real, way: Real
    ) -> Real:
        """The torque (N·m) on a shaft that turns in the sense `way`, ±1, also as it
        begins to."""
        return self.torque(t, omega, piece, load)

    def strung(self, lines: Scalar | None) -> "AbstractShaftTorque":
        """The law of a hook on so many lines, `None`: the load hangs on no hook."""
        return self


class AbstractAuxiliaryBrake(AbstractShaftTorque):
    """A brake beside the friction brake that the driller engages, by phases too
    (`Phase.auxiliary`)."""

    @abc.abstractmethod
    def engaged(self, share: Scalar) -> "AbstractAuxiliaryBrake":
        """The brake under a share, 0…1, of its excitation or filling."""


class AbstractDryTorque(AbstractShaftTorque):
    """Dry friction: `torque` is its limit (N·m, ≥ 0), against the rotation; at rest it
    is any torque up to that."""

    def limit_against(
        self, t: Real, omega: Real, piece: Piece, load: Real, way: Real
    ) -> Real:
        """The limit (N·m, ≥ 0) against a rotation in the sense `way`, ±1, also of a
        shaft at rest."""
        return self.torque(t, omega, piece, load)

    def turning(
        self, t: Real, omega: Real, piece: Piece, load: Real, way: Real
    ) -> Real:
        return way * self.limit_against(t, omega, piece, load, way)


def _faults_of_share(profile: AbstractProfile, path: str) -> Faults:
    """Errors of a profile that is a share, 0…1."""
    hint = "a share is between 0 and 1"
    faults = faults_of_sign(profile, path, "1", hint)
    if not faults and float(profile.scale()) > 1.0:
        faults.append(Fault(path, f"{float(profile.scale()):g} is above 1", hint))
    return faults


class EddyCurrentBrake(AbstractAuxiliaryBrake):
    """Eddy-current brake, after Kloss: `M = 2 e² M_m ω ω_m/(ω² + ω_m²)`.

    - `max_torque` `M_m` (N·m) at the speed `critical_speed` `ω_m` (rad/s) under full
      excitation
    - `excitation` `e(t)`: current over its rated value, 0…1, a number or a profile
    - `place`: body that takes its heat

    The torque vanishes with the speed: it holds no load. Up to `ω_m` it rises with the
    speed, and a load is lowered at a steady speed; past `ω_m` it falls, and a load
    above it runs away.

    Example:
        >>> sb.loads.EddyCurrentBrake("40 kN*m", "12 rad/s").critical_speed
        array(12.)
    """

    max_torque: Scalar = quantity(
        "N*m", "maximum torque under full excitation", low=0.0
    )
    critical_speed: Scalar = positive_quantity("rad/s", "speed of the maximum torque")
    excitation: AbstractProfile = part(AbstractProfile, "1", default=1.0)
    place: str | None = structural(default=None)

    @property
    def profile(self) -> AbstractProfile:
        return self.excitation

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        e = self.excitation.value(t, piece)
        most = self.critical_speed
        return 2 * e * e * self.max_torque * omega * most / (omega**2 + most**2)

    def engaged(self, share: Scalar) -> "EddyCurrentBrake":
        return with_fields(self, max_torque=share * share * self.max_torque)

    def faults(self, path: str) -> Faults:
        return _faults_of_share(self.excitation, f"{path}.excitation")


class HydrodynamicBrake(AbstractAuxiliaryBrake):
    """Hydrodynamic brake: `M = κ k ω |ω|`.

    - `coefficient` `k` (N·m·s²) of the full brake
    - `fill` `κ(t)`: 0…1, a number or a profile
    - `place`: body that
      takes its heat

    Example:
        >>> sb.loads.HydrodynamicBrake(12.0).coefficient
        array(12.)
    """

    coefficient: Scalar = quantity(
        "N*m*s^2", "torque per square of the speed, full brake", low=0.0
    )
    fill: AbstractProfile = part(AbstractProfile, "1", default=1.0)
    place: str | None = structural(default=None)

    @property
    def profile(self) -> AbstractProfile:
        return self.fill

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.fill.value(t, piece) * self.coefficient * omega * jnp.abs(omega)

    def engaged(self, share: Scalar) -> "HydrodynamicBrake":
        return with_fields(self, coefficient=share * self.coefficient)

    def faults(self, path: str) -> Faults:
        return _faults_of_share(self.fill, f"{path}.fill")


class ViscousDrag(AbstractShaftTorque):
    """Viscous drag: `M = c ω`, with `coefficient` `c` (N·m·s); `place`: body that takes
    its heat.

    Example:
        >>> sb.loads.ViscousDrag(600.0)
        ViscousDrag(coefficient=600 N·m·s)
    """

    coefficient: Scalar = quantity("N*m*s", "drag torque per unit of speed", low=0.0)
    place: str | None = structural(default=None)

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.coefficient * omega


class BearingFriction(AbstractDryTorque):
    """Dry friction of bearings and guides: against the rotation, at rest any torque up
    to its limit. The shaft can stick on it alone.

        |M| = M_c + (M_s − M_c) exp(−|ω|/ω_s) + c |ω|   in motion,   |M| ≤ M_s   at rest

    - `friction_torque` `M_c` (N·m), of Coulomb
    - `static` `M_s` (N·m) at rest, default `M_c`; from it friction falls over the speed
      `stribeck_speed` `ω_s` (rad/s), or rises where it is below `M_c`
    - `viscous` `c` (N·m·s)
    - `reverse`: another such law against a rotation in the other sense, default the
      same
    - `place`: body that takes its heat

    Sources: H. Olsson et al., *European Journal of Control* 4 (1998) 176–195, eq. 3
    (Coulomb, viscous, Stribeck), with the exponent 1.

    Raises `InputError` for a static torque without its speed.

    Example:
        >>> sb.loads.BearingFriction("150 N*m").friction_torque
        array(150.)
        >>> upwards = sb.loads.BearingFriction(20.0)
        >>> law = sb.loads.BearingFriction(16.0, 30.0, 0.5, viscous=200.0, reverse=upwards)
        >>> [float(law.limit_against(0.0, 0.0, None, 0.0, way)) for way in (1, -1)]
        [30.0, 20.0]
    """

    friction_torque: Scalar = quantity(
        "N*m", "friction torque of the bearings", low=0.0
    )
    static: Scalar | None = quantity(
        "N*m", "friction torque at rest", low=0.0, default=None
    )
    stribeck_speed: Scalar | None = positive_quantity(
        "rad/s", "speed over which friction leaves its value at rest", default=None
    )
    viscous: Scalar = quantity(
        "N*m*s", "friction torque per unit of speed", low=0.0, default=0.0
    )
    reverse: "BearingFriction | None" = part(AbstractShaftTorque, default=None)
    place: str | None = structural(default=None)

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.limit_against(t, omega, piece, load, jnp.sign(omega))

    def limit_against(
        self, t: Real, omega: Real, piece: Piece, load: Real, way: Real
    ) -> Real:
        speed = jnp.abs(omega)
        limit = self.friction_torque + self.viscous * speed
        if self.static is not None:
            fallen = jnp.exp(-speed / self.stribeck_speed)  # pyright: ignore
            limit = limit + (self.static - self.friction_torque) * fallen
        if self.reverse is not None:
            other = self.reverse.limit_against(t, omega, piece, load, way)
            limit = jnp.where(jnp.asarray(way) < 0, other, limit)
        return jnp.asarray(limit)

    def faults(self, path: str) -> Faults:
        faults = Issues()
        if (self.static is None) != (self.stribeck_speed is None):
            name = "static" if self.static is None else "stribeck_speed"
            hint = "the torque at rest and the speed over which it falls go together"
            faults.add(f"{path}.{name}", "is missing", hint)
        other = self.reverse
        if other is not None and not isinstance(other, BearingFriction):
            hint = "give a BearingFriction"
            faults.add(f"{path}.reverse", "is another kind of torque", hint)
        elif other is not None and other.reverse is not None:
            what = "has a reverse of its own"
            faults.add(f"{path}.reverse", what, "there are two senses")
        return faults


class TabulatedDrag(AbstractShaftTorque):
    """A torque over speed as a table, against the rotation, such as that of a fan: `M =
    κ(t) M(|ω|)`, a monotone cubic (Fritsch–Carlson) through the points.

    - `speed` (k,) in rad/s, increasing from 0; `torque` (k,) in N·m, from 0
    - `share` `κ(t)`: 0…1, a number or a profile
    - `place`: body that takes its heat

    Beyond the last speed the last torque holds. Friction that remains at rest is
    `BearingFriction`; a torque that drives is a load, `TabulatedLoad`.

    Raises `InputError` for a table that is no function of the speed.

    Example:
        >>> fan = sb.loads.TabulatedDrag([0.0, 10.0, 20.0], [0.0, 300.0, 1200.0])
        >>> float(fan.torque(0.0, -10.0, None, 0.0))
        -300.0
    """

    speed: Scalar = quantity(
        "rad/s", "speeds of the table", low=0.0, many=IndexedBy.ROWS
    )
    torque_at: Scalar = quantity(
        "N*m", "torques of the table", 0.0, many=IndexedBy.ROWS
    )
    share: AbstractProfile = part(AbstractProfile, "1", default=1.0)
    place: str | None = structural(default=None)

    @property
    def profile(self) -> AbstractProfile:
        return self.share

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        at = interpolated(jnp.abs(omega), self.speed, self.torque_at)
        return self.share.value(t, piece) * jnp.sign(omega) * at

    def faults(self, path: str) -> Faults:
        faults = faults_of_table(path, self.speed, self.torque_at)
        if not faults and (self.speed[0] != 0 or self.torque_at[0] != 0):
            hint = "friction at rest is BearingFriction"
            faults.append(Fault(path, "does not begin with 0 rad/s and 0 N·m", hint))
        return faults + _faults_of_share(self.share, f"{path}.share")


def faults_of_table(path: str, speeds: Scalar, torques: Scalar) -> Faults:
    """Errors of a torque over speed as a table."""
    if not is_table(speeds, torques):
        what = "the table needs speeds and torques of one length, at least 2"
        return [Fault(path, what)]
    if np.any(np.diff(np.asarray(speeds)) <= 0):  # pyright: ignore
        hint = "a torque is a function of the speed"
        return [Fault(f"{path}.speed", "the speeds must increase", hint)]
    return []


#: how a loss of the tackle is given, in place of an efficiency without its direction
_TACKLE = (
    "give `sheave_factor = 1.04` (roller bearings), or an efficiency with its "
    "direction: `hoisting_efficiency` (that of a data sheet) or `lowering_efficiency`"
)
#: error of a loss of the tackle under a load on no hook
NO_TACKLE = (
    "needs a load on a hook, whose lines it has",
    "give such a load (`HookLoad`), or the loss as `BearingFriction`",
)
#: below it a function of `x²` is taken by its series
_SMALL = 0.1
#: Newton steps that find a sheave factor: six at most for 1 to 100 lines and
#: efficiencies down to 1e-8, two for the derivatives of the last
_STEPS = 8


class TackleLoss(AbstractDryTorque):
    """Loss of the tackle, whose `n` lines turn `n` sheaves: dry friction in proportion
    to the load.

        T_{i+1} = K T_i,   Σ T_i = W,   T_fast = W/(n η_h) in hoisting,   η_l W/n in
        lowering 1/η_l = (K + K² + … + K^n)/n,   η_h = 1/(η_l K^(n+1)) hoisting: M =
        (1/η_h − 1) M_load,   lowering: M = (1 − η_l) M_load,   at rest anything between

    - `sheave_factor` `K`: tension of a line over that of its neighbour as both move,
      1.04 with roller bearings, 1.09 with plain ones; the fast line turns a sheave of
      the crown, the dead-line sheave stands
    - or `hoisting_efficiency` `η_h`, that of data sheets and of API RP 9B; or
      `lowering_efficiency` `η_l`. The other one follows from it by the `K` of the lines
      strung
    - `place`: body that takes its heat

    The load must hang on a hook, whose `line_count` is `n`. The torque is that of the
    weight, of an elastic rope that of its pull. Tensions of the lines are those of the
    pull on the hook: columns `fast_line_tension` and `dead_line_tension`. `strung(n)`
    has all three numbers.

    Raises `InputError` unless one of the three is given.

    Example:
        >>> strung = sb.loads.TackleLoss(sheave_factor=1.04).strung(10)
        >>> round(float(strung.hoisting_efficiency), 4), round(float(strung.lowering_efficiency), 4)
        (0.8111, 0.8009)
        >>> known = sb.loads.TackleLoss(hoisting_efficiency=0.8111).strung(10)
        >>> round(float(known.sheave_factor), 4)
        1.04
    """

    sheave_factor: Scalar | None = quantity(
        "1",
        "tension of a line over that of its neighbour",
        1.0,
        2.0,
        default=None,
        instead=_TACKLE,
    )
    hoisting_efficiency: Scalar | None = positive_quantity(
        "1",
        "efficiency of the tackle in hoisting",
        high=1.0,
        default=None,
        kw_only=True,
    )
    lowering_efficiency: Scalar | None = positive_quantity(
        "1",
        "efficiency of the tackle in lowering",
        high=1.0,
        default=None,
        kw_only=True,
    )
    place: str | None = structural(default=None, kw_only=True)
    instead: ClassVar[dict[str, str]] = {"efficiency": _TACKLE}

    def faults_of_presence(self, path: str) -> Faults:
        given = [self.sheave_factor, self.hoisting_efficiency, self.lowering_efficiency]
        count = sum(number is not None for number in given)
        if count == 1:
            return []
        what = (
            "is missing"
            if count == 0
            else "is given beside an efficiency, or both efficiencies are"
        )
        return [Fault(f"{path}.sheave_factor", what, _TACKLE)]

    def strung(self, lines: Scalar | None) -> "TackleLoss":
        """The loss with all of its three numbers, as so many lines have them. Raises
        `InputError` without a hook."""
        if lines is None:
            raise input_error("TackleLoss", *NO_TACKLE)
        n = jnp.asarray(lines)
        factor: Any = self.sheave_factor
        hoisting: Any = self.hoisting_efficiency
        lowering: Any = self.lowering_efficiency
        if factor is not None:
            losses = _logs_of_loss(n, jnp.log(factor))
            hoisting, lowering = (jnp.exp(-loss) for loss in losses)
        elif lowering is not None:
            k = _log_of_factor(n, lowering, hoisting=False)
            factor = jnp.exp(k)
            hoisting = jnp.exp(-(n + 1) * k) / lowering
        else:
            k = _log_of_factor(n, hoisting, hoisting=True)
            factor = jnp.exp(k)
            lowering = jnp.exp(-(n + 1) * k) / hoisting
        return with_fields(
            self,
            sheave_factor=factor,
            hoisting_efficiency=hoisting,
            lowering_efficiency=lowering,
        )

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.limit_against(t, omega, piece, load, jnp.sign(omega))

    def limit_against(
        self, t: Real, omega: Real, piece: Piece, load: Real, way: Real
    ) -> Real:
        hoisting: Any = self.hoisting_efficiency
        lowering: Any = self.lowering_efficiency
        share = jnp.where(way < 0, 1 / hoisting - 1, 1 - lowering)
        return share * jnp.abs(load)

    def tensions(self, pull: Array, lines: Scalar, way: Array) -> TwoArrays:
        """Tensions (N) of the fast and of the dead line under a pull (N) on the hook.

        - `way`: above 0 in lowering, below 0 in hoisting, 0 at rest, where each is the
          largest that it can be
        """
        each = pull / lines
        last_over_first = jnp.asarray(self.sheave_factor) ** lines
        hoisting = each / self.hoisting_efficiency
        lowering = each * self.lowering_efficiency
        fast = jnp.where(way > 0, lowering, hoisting)
        dead = jnp.where(
            way < 0, hoisting / last_over_first, lowering * last_over_first
        )
        return fast, dead


def _logs_of_loss(lines: Array, k: Array) -> TwoArrays:
    """`−ln η` in hoisting and in lowering, `k = ln K`: `(n + 1) k/2` less and plus
    `ln S`, `S = mean(K^i)/K^((n+1)/2)` over the lines,
    `S = sinh(n k/2)/(n sinh(k/2))`."""
    middle = 0.5 * (lines + 1) * k
    spread = _log_sinhc(0.5 * lines * k) - _log_sinhc(0.5 * k)
    return middle - spread, middle + spread


def _log_of_factor(lines: Array, efficiency: Array, *, hoisting: bool) -> Array:
    """`ln K` of lines with an efficiency in one direction, by Newton's method.

    `−ln η` is concave in it in hoisting and convex in lowering, so that no step goes
    beyond the solution.
    """
    wanted = -jnp.log(efficiency)

    def loss(k: Array) -> Array:
        in_hoisting, in_lowering = _logs_of_loss(lines, k)
        return in_hoisting if hoisting else in_lowering

    def step(k: Array, _: None) -> tuple[Array, None]:
        value, slope = jax.jvp(loss, (k,), (jnp.ones_like(k),))
        return k - (value - wanted) / slope, None

    return jax.lax.scan(step, 2 * wanted / (lines + 1), None, length=_STEPS)[0]


def _log_sinhc(x: Array) -> Array:
    """`ln(sinh(x)/x)`, `x ≥ 0`; where `x` is small by its series, whose derivatives are
    exact at 0 too."""
    is_small = x < _SMALL
    y = jnp.where(is_small, x, 0.0) ** 2
    series = y * (
        1 / 6 + y * (-1 / 180 + y * (1 / 2835 + y * (-1 / 37800 + y / 467775)))
    )
    big = jnp.where(is_small, 1.0, x)
    return jnp.where(is_small, series, big + jnp.log(-jnp.expm1(-2 * big) / (2 * big)))


def names_of(torques: tuple[AbstractShaftTorque, ...]) -> list[str]:
    """Names of torques in results, after their classes: `eddy_current_brake`; of
    several of one class with a number."""
    kinds = [
        re.sub(r"(?<=.)(?=[A-Z])", "_", type(law).__name__).lower() for law in torques
    ]
    counts = [kinds[: i + 1].count(kind) for i, kind in enumerate(kinds)]
    return [
        kind if kinds.count(kind) == 1 else f"{kind}_{number}"
        for kind, number in zip(kinds, counts, strict=True)
    ]
