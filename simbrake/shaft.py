"""Torques on the shaft beside the brake: auxiliary brakes, drag, and dry friction of bearings and tackle."""

import abc
import re

import jax.numpy as jnp

from ._base._faults import Fault
from ._base._part import Part, former_names, part, quantity
from ._base._quantity import Scalar
from .hybrid._struct import AbstractVar, struct_field, with_fields
from .profiles import AbstractProfile, Constant, Piece, Real, faults_of_sign

__all__ = [
    "AbstractDryTorque",
    "AbstractShaftTorque",
    "BearingFriction",
    "EddyCurrentBrake",
    "HydrodynamicBrake",
    "TackleLoss",
    "ViscousDrag",
]


class AbstractShaftTorque(Part):
    """A torque on the shaft against its rotation; its work is heat.

    - `place`: body of the thermal network, or face of a wall, that the heat enters; `None`: it enters no body (lost)
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


class AbstractAuxiliaryBrake(AbstractShaftTorque):
    """A brake beside the friction brake that the driller engages, by phases too (`Phase.auxiliary`)."""

    @abc.abstractmethod
    def engaged(self, share: Scalar) -> "AbstractAuxiliaryBrake":
        """The brake under a share, 0…1, of its excitation or filling."""


class AbstractDryTorque(AbstractShaftTorque):
    """Dry friction: `torque` is its limit (N·m, ≥ 0), against the rotation; at rest it is any torque up to that."""


def _faults_of_share(profile: AbstractProfile, path: str) -> list[Fault]:
    """Errors of a profile that is a share, 0…1."""
    hint = "a share is between 0 and 1"
    faults = faults_of_sign(profile, path, "1", hint)
    if not faults and float(profile.scale()) > 1.0:
        faults.append(Fault(path, f"{float(profile.scale()):g} is above 1", hint))
    return faults


class EddyCurrentBrake(AbstractAuxiliaryBrake):
    """Eddy-current brake, after Kloss: `M = 2 e² M_m ω ω_m/(ω² + ω_m²)`.

    - `max_torque` `M_m` (N·m) at the speed `critical_speed` `ω_m` (rad/s) under full excitation
    - `excitation` `e(t)`: current over its rated value, 0…1, a number or a profile;  `place`: body that takes its heat

    The torque vanishes with the speed: it holds no load. Up to `ω_m` it rises with the speed, and a load is lowered at
    a steady speed; past `ω_m` it falls, and a load above it runs away.

    Example:
        >>> sb.loads.EddyCurrentBrake("40 kN*m", "12 rad/s").critical_speed
        array(12.)
    """

    max_torque: Scalar = quantity("N*m", "maximum torque under full excitation", low=0.0)
    critical_speed: Scalar = quantity("rad/s", "speed of the maximum torque", positive=True)
    excitation: AbstractProfile = part(AbstractProfile, "1", default_factory=lambda: Constant(1.0))
    place: str | None = struct_field(static=True, default=None)

    @property
    def profile(self) -> AbstractProfile:
        return self.excitation

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        e, most = self.excitation.value(t, piece), self.critical_speed
        return 2 * e * e * self.max_torque * omega * most / (omega**2 + most**2)

    def engaged(self, share: Scalar) -> "EddyCurrentBrake":
        return with_fields(self, max_torque=share * share * self.max_torque)

    def faults(self, path: str) -> list[Fault]:
        return _faults_of_share(self.excitation, f"{path}.excitation")


class HydrodynamicBrake(AbstractAuxiliaryBrake):
    """Hydrodynamic brake: `M = κ k ω |ω|`.

    - `coefficient` `k` (N·m·s²) of the full brake;  `fill` `κ(t)`: 0…1, a number or a profile;  `place`: body that
      takes its heat

    Example:
        >>> sb.loads.HydrodynamicBrake(12.0).coefficient
        array(12.)
    """

    coefficient: Scalar = quantity("N*m*s^2", "torque per square of the speed, full brake", low=0.0)
    fill: AbstractProfile = part(AbstractProfile, "1", default_factory=lambda: Constant(1.0))
    place: str | None = struct_field(static=True, default=None)

    @property
    def profile(self) -> AbstractProfile:
        return self.fill

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.fill.value(t, piece) * self.coefficient * omega * jnp.abs(omega)

    def engaged(self, share: Scalar) -> "HydrodynamicBrake":
        return with_fields(self, coefficient=share * self.coefficient)

    def faults(self, path: str) -> list[Fault]:
        return _faults_of_share(self.fill, f"{path}.fill")


class ViscousDrag(AbstractShaftTorque):
    """Viscous drag: `M = c ω`, with `coefficient` `c` (N·m·s); `place`: body that takes its heat.

    Example:
        >>> sb.loads.ViscousDrag(600.0)
        ViscousDrag(coefficient=600 N·m·s)
    """

    coefficient: Scalar = quantity("N*m*s", "drag torque per unit of speed", low=0.0)
    place: str | None = struct_field(static=True, default=None)

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return self.coefficient * omega


@former_names(limit="friction_torque")
class BearingFriction(AbstractDryTorque):
    """Dry friction of bearings: `|M| = M_c` in motion, `|M| ≤ M_c` at rest. The shaft can stick on it alone.

    - `friction_torque` `M_c` (N·m);  `place`: body that takes its heat

    Example:
        >>> sb.loads.BearingFriction("150 N*m")
        BearingFriction(friction_torque=150 N·m)
    """

    friction_torque: Scalar = quantity("N*m", "friction torque of the bearings", low=0.0)
    place: str | None = struct_field(static=True, default=None)

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return jnp.asarray(self.friction_torque)


class TackleLoss(AbstractDryTorque):
    """Loss of the tackle as dry friction in proportion to the load: `M_c = (1 − η) |M_load|`.

    Lowering, the drum sees `η M_load`: the loss helps to brake.

    - `efficiency` `η` of the tackle in lowering;  `place`: body that takes its heat

    Example:
        >>> sb.loads.TackleLoss(0.85)
        TackleLoss(efficiency=0.85)
    """

    efficiency: Scalar = quantity("1", "efficiency of the tackle", positive=True, high=1.0)
    place: str | None = struct_field(static=True, default=None)

    def torque(self, t: Real, omega: Real, piece: Piece, load: Real) -> Real:
        return (1 - self.efficiency) * jnp.abs(load)


def names_of(torques: tuple[AbstractShaftTorque, ...]) -> list[str]:
    """Names of torques in results, after their classes: `eddy_current_brake`; of several of one class with a number."""
    kinds = [re.sub(r"(?<=.)(?=[A-Z])", "_", type(law).__name__).lower() for law in torques]
    counts = [kinds[: i + 1].count(kind) for i, kind in enumerate(kinds)]
    return [kind if kinds.count(kind) == 1 else f"{kind}_{number}" for kind, number in zip(kinds, counts, strict=True)]
