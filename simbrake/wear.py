"""Wear of the linings: its rate, and the profile of a lever that first takes up a worn
band."""

import abc
from typing import Any, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from ._base._corners import greater
from ._base._faults import Fault, Faults, Issues
from ._base._part import (
    Part,
    faults_of_sizes,
    leaves,
    part,
    positive_quantity,
    quantity,
    short_for,
    structural,
)
from ._base._quantity import IndexedBy, Scalar
from .brakes.design import AbstractBrake, Brake
from .friction import GAS_CONSTANT, remembers
from .hybrid.arrays import Array, Floats
from .phases import Phases
from .profiles import AbstractProfile, Piece, Real
from .thermal.heat import Heat
from .thermal.materials import ROOM
from .thermal.network import Lump, Wall, place_of

__all__ = [
    "AbstractWearRate",
    "ArrheniusWear",
    "ConstantWear",
    "Delayed",
    "ExponentialWear",
    "LinearWear",
    "ThresholdWear",
    "Wear",
]

#: of the friction face (K), `None` where a scene has none
Temperature: TypeAlias = Floats | float | None


class AbstractWearRate(Part):
    """Wear rate `I(T)` in m³/(N·m) = 1/Pa: volume worn off per newton of load and metre
    of slip (Archard).

    Called as `rate(p, v, T)` like the functions that `lining_wear` takes: pressure
    (Pa), slip speed (m/s), and the temperature (K) of the friction face, `None` where
    the scene has none: then the law is at its reference temperature.
    """

    def __call__(self, p: Scalar, v: Scalar, T: Temperature) -> Floats:
        return self.at(T)

    @abc.abstractmethod
    def at(self, T: Temperature) -> Floats:
        """The rate at the temperature `T` (K), or at the reference temperature for
        `None`."""


def _rate_at(words: str) -> Any:
    return quantity(
        "m^3/(N*m)", f"wear rate {words}".rstrip(), low=0.0, many=True, typical=1e-14
    )


@short_for(AbstractWearRate)
class ConstantWear(AbstractWearRate):
    """`I = k` at every temperature.

    - `coefficient` `k` (m³/(N·m)): one number, or one per lining

    Reference: J. F. Archard, *J. Appl. Phys.* 24 (1953) 981.

    Example:
        >>> sb.wear.ConstantWear(5e-14).coefficient
        array(5.e-14)
    """

    coefficient: Scalar = _rate_at("")

    def at(self, T: Temperature) -> Floats:
        return jnp.asarray(self.coefficient)


class LinearWear(AbstractWearRate):
    """`I = k max(0, 1 + s (T − T_r))`: the first term of any dependence on the
    temperature.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `slope` `s` (1/K)

    Example:
        >>> sb.wear.LinearWear(5e-14, 0.01).slope
        array(0.01)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    slope: Scalar = quantity(
        "1/K", "relative rise of the wear rate per kelvin", many=True
    )
    reference: Scalar = positive_quantity(
        "K", "temperature at which the coefficient holds", default=ROOM
    )

    def at(self, T: Temperature) -> Floats:
        k = jnp.asarray(self.coefficient)
        return (
            k if T is None else k * greater(1 + self.slope * (T - self.reference), 0.0)
        )


class ExponentialWear(AbstractWearRate):
    """`I = k exp((T − T_r)/ΔT)`: the rate grows by the factor e over every `ΔT`.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `rise` `ΔT` (K)

    Reference: S. K. Rhee, *Wear* 29 (1974) 391: above some 230 °C the wear of organic
    linings grows exponentially.

    Example:
        >>> sb.wear.ExponentialWear(3e-14, rise=120.0).rise
        array(120.)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    rise: Scalar = positive_quantity(
        "K",
        "difference of temperature over which the wear rate grows e-fold",
        difference=True,
        many=True,
    )
    reference: Scalar = positive_quantity(
        "K", "temperature at which the coefficient holds", default=ROOM
    )

    def at(self, T: Temperature) -> Floats:
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.exp((T - self.reference) / self.rise)


class ArrheniusWear(AbstractWearRate):
    """`I = k exp[(E/R)(1/T_r − 1/T)]`: the binder of the lining is decomposed by heat.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K)
    - `energy` `E` (J/mol): activation energy

    Reference: S. K. Rhee, *Wear* 29 (1974) 391, for resin-bonded linings.

    Example:
        >>> sb.wear.ArrheniusWear(5e-14, 4e4).energy
        array(40000.)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    energy: Scalar = quantity(
        "J/mol", "activation energy", low=0.0, many=True, typical=2e4
    )
    reference: Scalar = positive_quantity(
        "K", "temperature at which the coefficient holds", default=ROOM
    )

    def at(self, T: Temperature) -> Floats:
        k = jnp.asarray(self.coefficient)
        return (
            k
            if T is None
            else k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.reference - 1 / T))
        )


class ThresholdWear(AbstractWearRate):
    """Resin-bonded linings: constant up to a threshold, above it the decay of the resin
    after Arrhenius.

        I = k for T ≤ T_t,   I = k exp[(E/R)(1/T_t − 1/T)] above

    - `coefficient` `k` (m³/(N·m)) below the `threshold` `T_t` (K)
    - `energy` `E` (J/mol): activation energy

    Reference: T. Liu, S. K. Rhee, *Wear* 37 (1976) 291; threshold about 230 °C.

    Example:
        >>> sb.wear.ThresholdWear(5e-14).threshold
        array(503.15)
    """

    coefficient: Scalar = _rate_at("below the threshold")
    threshold: Scalar = positive_quantity(
        "K", "temperature above which wear grows", default=503.15
    )
    energy: Scalar = quantity(
        "J/mol", "activation energy", low=0.0, many=True, typical=2e4, default=40e3
    )

    def at(self, T: Temperature) -> Floats:
        k = jnp.asarray(self.coefficient)
        hot = self.threshold if T is None else greater(T, self.threshold)
        return k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.threshold - 1 / hot))


class Wear(Part):
    """Wear of the linings as a part of a scene; without it a scene has no wear states,
    equations or cost.

        ḣ_i = I(T_i) p_i |v_i|,   p_i = N_i/A_i                                                      (model §7; Archard)

    - `rate` `I`: law of the linings, or a number; `T_i` is the temperature that their
      friction law sees (the scene's heat part), else the law's reference temperature.
      On a staged brake the faces that rub on the band
    - `internal`: the same for the faces of a staged brake's linings that rub on the
      rim; `None`: they do not wear
    - `worn` (m), a number or (n,): thickness that had been worn off before the run
    - `permissible` (m): maximum wear
    - `thickness` (m): of a new lining
    - `geometry`, `heat`: whether the thickness worn before the run lowers the band
      circle, and the lining in the heat part; `take_up_speed` (m/s): speed at which the
      lever takes up the slack left by wear (`worn_scene` has the formulas)
    - `turned_at` (s), one time or a list: the band is turned end for end, so that the
      lining of the tight end comes to the slack end; for equal linings, on a brake at
      rest. Of a duty in phases `turned_after`: the numbers of phases that have ended by
      then, over all cycles

    Wear during a run does not act back on it: a brake application wears micrometres of
    some ten millimetres.

    Example:
        >>> sb.Wear(5e-14, permissible="12 mm")
        Wear(rate=ConstantWear(coefficient=5·10⁻¹⁴ m³/(N·m)), worn=0 m, permissible=12
        mm)
    """

    rate: AbstractWearRate = part(AbstractWearRate)
    internal: AbstractWearRate | None = part(AbstractWearRate, default=None)
    worn: Scalar = quantity(
        "m",
        "thickness worn off before the run",
        low=0.0,
        many=True,
        typical=1e-3,
        default=0.0,
    )
    permissible: Scalar | None = positive_quantity(
        "m", "permissible wear", many=True, default=None
    )
    thickness: Scalar | None = positive_quantity(
        "m", "thickness of a new lining", default=None
    )
    geometry: bool = structural(default=False)
    heat: bool = structural(default=False)
    take_up_speed: Scalar | None = positive_quantity(
        "m/s", "speed at which the lever takes up slack of the band", default=None
    )
    turned_at: Scalar | None = quantity(
        "s",
        "times at which the band is turned end for end",
        many=IndexedBy.ROWS,
        default=None,
    )
    turned_after: Scalar | None = quantity(
        "1",
        "numbers of phases after which the band is turned end for end",
        low=0.0,
        many=IndexedBy.ROWS,
        default=None,
    )

    def faults(self, path: str) -> Faults:
        if self.thickness is None:
            return []
        worn = np.atleast_1d(self.worn)
        whole = float(self.thickness)
        i = int(np.argmax(worn))
        what = f"{worn[i]:g} m worn off lining {i + 1} must be below its {whole:g} m"
        return [Fault(f"{path}.worn", what)] if worn[i] >= whole else []


# --- effects of wear on a brake before a run ----------------------------------------


class Delayed(AbstractProfile):
    """A profile that comes later, `p(t − delay)`; until then it is as before its
    beginning.

    - `profile`: any profile;  `delay` (s)

    Example:
        >>> lever = sb.wear.Delayed(sb.ramp(0.0, 12e3, 0.0, 1.0), 0.5)
        >>> float(lever.value(1.0, lever.first_piece(1.0)))
        6000.0
    """

    profile: AbstractProfile = part(AbstractProfile)
    delay: Scalar = quantity("s", "delay of the profile", low=0.0)

    @property
    def knot_count(self) -> int:
        return self.profile.knot_count

    def value(self, t: Real, piece: Piece) -> Real:
        return self.profile.value(t - self.delay, piece)

    def next_knot(self, piece: Piece) -> Floats | float:
        return self.profile.next_knot(piece) + self.delay

    def first_piece(self, t: Real) -> Piece:
        return self.profile.first_piece(t - self.delay)

    def is_settled(self, t: Real) -> Bool[Array, ""]:
        return self.profile.is_settled(t - self.delay)

    def scale(self) -> Float[Array, ""]:
        return self.profile.scale()

    def faults(self, path: str) -> Faults:
        why = "a lever that depends on the speed cannot be delayed"
        return [Fault(f"{path}.profile", why)] if self.profile.controls_speed else []


# --- errors between the wear and other parts of a scene -----------------------------


def lining_bodies(heat: Heat) -> set[str]:
    """Names of the bodies that are linings."""
    inner = heat.friction
    outer = heat.external
    places = (
        heat.linings,
        None if inner is None else inner.lining,
        None if outer is None else outer.lining,
    )
    return {place_of(place)[0] for place in places if place is not None}


def faults_of_wear(
    wear: Wear, brake: AbstractBrake, lever: AbstractProfile | Phases, heat: Heat
) -> Faults:
    """Errors between the wear of a scene and its other parts (concrete values only)."""
    faults = Issues(_faults_of_thickness(wear, heat) if wear.heat else ())
    has = {"internal": wear.internal is not None, "geometry": wear.geometry}
    has |= {
        "take_up_speed": wear.take_up_speed is not None,
        "turned_at": wear.turned_at is not None,
    }
    has["turned_after"] = wear.turned_after is not None
    one_band = isinstance(brake, Brake)
    if not one_band:
        idle = [field for field, is_given in has.items() if is_given]
        why = f"has no effect on a {brake.words.brake}"
        faults += [Fault(f"wear.{field}", why, "leave it out") for field in idle]
    if brake.linings.area is None:
        where = f"brake.{brake.pairs['external'].field}.area"
        faults.add(where, "is missing", "wear depends on the pressure")
    if has["internal"] and one_band:
        if brake.bandage is None:
            faults.add(
                "wear.internal",
                "has no effect",
                "only a staged brake (`brake.bandage`) has inner faces",
            )
        elif brake.bandage.area is None:
            faults.add(
                "brake.bandage.area",
                "is missing",
                "wear of the inner faces depends on the pressure",
            )
    phased = isinstance(lever, Phases)
    if has["take_up_speed"] and (phased or lever.controls_speed):
        why = "in phases" if phased else "that depends on the speed"
        faults.add(
            "wear.take_up_speed", f"has no effect on a lever {why}", "leave it out"
        )
    which = ("turned_at", "turned_after") if phased else ("turned_after", "turned_at")
    if has[which[0]] and one_band:
        what = f"has no meaning for a duty {'' if phased else 'not '}in phases"
        faults.add(f"wear.{which[0]}", what, f"give wear.{which[1]}")
    if (has["turned_at"] or has["turned_after"]) and one_band:
        faults += faults_of_turning(brake)
    return faults + faults_of_sizes(wear, "wear", brake.linings.count)


def faults_of_turning(brake: Brake) -> Faults:
    """Errors of a band that cannot be turned within a run: the brake is integrated as
    it was built."""
    where = "wear.turned_at"
    if brake.bandage is not None:
        return [
            Fault(
                where,
                "the linings of a staged brake ride on the pulley",
                "turning its band does not move them",
            )
        ]
    if remembers(brake.linings.friction):
        hint = (
            "leave out one of them, or `lining_life(turn_at=…)`, which turns the "
            "band between stops"
        )
        return [
            Fault(
                where,
                "the friction law has states, which would not turn with the band",
                hint,
            )
        ]
    parts = [*leaves(brake.linings, "brake.linings"), *leaves(brake.band, "brake.band")]
    listed = [
        leaf
        for leaf in parts
        if np.ndim(leaf.value) == 1 and leaf.about.many is not IndexedBy.ROWS
    ]
    unlike = [leaf.path for leaf in listed if np.ptp(np.asarray(leaf.value)) > 0]
    changes = brake.linings.friction.over_time
    unlike += [
        "brake.linings.friction.changes"
        for change in changes
        if change.linings is not None
    ]
    hint = "equal linings; else `lining_life(turn_at=…)`, which turns the band between stops"
    return [
        Fault(where, f"the numbers of {path} are not equal", hint) for path in unlike
    ]


def _faults_of_thickness(wear: Wear, heat: Heat) -> Faults:
    names = lining_bodies(heat)
    if not names:
        return [
            Fault(
                "wear.heat", "has no effect", "the scene has no heat part with linings"
            )
        ]
    faults = Issues()
    worn = float(np.max(np.asarray(wear.worn)))
    for i, body in enumerate(heat.bodies):
        if body.name not in names:
            continue
        if isinstance(body, Lump) and wear.thickness is None:
            faults.add(
                "wear.thickness",
                "is missing",
                f"the lump {body.name!r} has no thickness",
            )
        elif isinstance(body, Wall) and worn >= float(body.thickness):
            what = f"{worn:g} m worn off must be below the thickness of the wall {body.name!r}"
            faults.add(f"heat.bodies[{i}].thickness", what)
    return faults
