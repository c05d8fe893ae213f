"""Wear of the linings: its rate, and its effects on a brake before a run."""

import abc
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from ._base._corners import greater
from ._base._faults import Fault, InputError
from ._base._part import Part, faults_of_sizes, leaves, part, quantity, short_for
from ._base._quantity import Over, Scalar
from ._phases import Phases
from .brakes._design import Brake
from .friction import GAS_CONSTANT, FrictionChange, TabulatedFade, TabulatedFriction, remembers
from .hybrid._arrays import Array
from .profiles import AbstractProfile, Piece, Real
from .thermal._heat import Heat, TransmissionPartition
from .thermal._material import ROOM
from .thermal._network import Conductance, Lump, Wall, place_of

__all__ = [
    "AbstractWearRate",
    "ArrheniusWear",
    "ConstantWear",
    "Delayed",
    "ExponentialWear",
    "LinearWear",
    "ThresholdWear",
    "Wear",
    "turned_scene",
    "worn_scene",
]

#: of the friction face (K), `None` where a scene has none
Temperature: TypeAlias = Float[Array, "..."] | float | None


class AbstractWearRate(Part):
    """Wear rate `I(T)` in m³/(N·m) = 1/Pa: volume worn off per newton of load and metre of slip (Archard).

    Called as `rate(p, v, T)` like the functions that `lining_wear` takes: pressure (Pa), slip speed (m/s), and the
    temperature (K) of the friction face, `None` where the scene has none: then the law is at its reference temperature.
    """

    def __call__(self, p: Scalar, v: Scalar, T: Temperature) -> Float[Array, "..."]:
        return self.at(T)

    @abc.abstractmethod
    def at(self, T: Temperature) -> Float[Array, "..."]:
        """The rate at the temperature `T` (K), or at the reference temperature for `None`."""


def _rate_at(words: str) -> Any:
    return quantity("m^3/(N*m)", f"wear rate {words}".rstrip(), low=0.0, many=True, typical=1e-14)


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

    def at(self, T: Temperature) -> Float[Array, "..."]:
        return jnp.asarray(self.coefficient)


class LinearWear(AbstractWearRate):
    """`I = k max(0, 1 + s (T − T_r))`: the first term of any dependence on the temperature.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `slope` `s` (1/K)

    Example:
        >>> sb.wear.LinearWear(5e-14, 0.01).slope
        array(0.01)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    slope: Scalar = quantity("1/K", "relative rise of the wear rate per kelvin", many=True)
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T: Temperature) -> Float[Array, "..."]:
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * greater(1 + self.slope * (T - self.reference), 0.0)


class ExponentialWear(AbstractWearRate):
    """`I = k exp((T − T_r)/ΔT)`: the rate grows by the factor e over every `ΔT`.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `rise` `ΔT` (K)

    Reference: S. K. Rhee, *Wear* 29 (1974) 391: above some 230 °C the wear of organic linings grows exponentially.

    Example:
        >>> sb.wear.ExponentialWear(3e-14, rise=120.0).rise
        array(120.)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    rise: Scalar = quantity(
        "K",
        "difference of temperature over which the wear rate grows e-fold",
        positive=True,
        difference=True,
        many=True,
    )
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T: Temperature) -> Float[Array, "..."]:
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.exp((T - self.reference) / self.rise)


class ArrheniusWear(AbstractWearRate):
    """`I = k exp[(E/R)(1/T_r − 1/T)]`: the binder of the lining is decomposed by heat.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `energy` `E` (J/mol): activation energy

    Reference: S. K. Rhee, *Wear* 29 (1974) 391, for resin-bonded linings.

    Example:
        >>> sb.wear.ArrheniusWear(5e-14, 4e4).energy
        array(40000.)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    energy: Scalar = quantity("J/mol", "activation energy", low=0.0, many=True, typical=2e4)
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T: Temperature) -> Float[Array, "..."]:
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.reference - 1 / T))


class ThresholdWear(AbstractWearRate):
    """Resin-bonded linings: constant up to a threshold, above it the decay of the resin after Arrhenius.

        I = k for T ≤ T_t,   I = k exp[(E/R)(1/T_t − 1/T)] above

    - `coefficient` `k` (m³/(N·m)) below the `threshold` `T_t` (K);  `energy` `E` (J/mol): activation energy

    Reference: T. Liu, S. K. Rhee, *Wear* 37 (1976) 291; threshold about 230 °C.

    Example:
        >>> sb.wear.ThresholdWear(5e-14).threshold
        array(503.15)
    """

    coefficient: Scalar = _rate_at("below the threshold")
    threshold: Scalar = quantity("K", "temperature above which wear grows", positive=True, default=503.15)
    energy: Scalar = quantity("J/mol", "activation energy", low=0.0, many=True, typical=2e4, default=40e3)

    def at(self, T: Temperature) -> Float[Array, "..."]:
        k = jnp.asarray(self.coefficient)
        hot = self.threshold if T is None else greater(T, self.threshold)
        return k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.threshold - 1 / hot))


class Wear(Part):
    """Wear of the linings as a part of a scene; without it a scene has no wear states, equations or cost.

        ḣ_i = I(T_i) p_i |v_i|,   p_i = N_i/A_i                                                      (model §7; Archard)

    - `rate` `I`: law of the linings, or a number; `T_i` is the temperature that their friction law sees (the scene's
      heat part), else the law's reference temperature. On a staged brake the faces that rub on the band
    - `internal`: the same for the faces of a staged brake's linings that rub on the rim; `None`: they do not wear
    - `worn` (m), a number or (n,): thickness that had been worn off before the run;  `permissible` (m): maximum wear
    - `thickness` (m): of a new lining
    - `geometry`, `heat`: whether the thickness worn before the run lowers the band circle, and the lining in the heat
      part; `take_up_speed` (m/s): speed at which the lever takes up the slack left by wear (`worn_scene`
      has the formulas)
    - `turned_at` (s), one time or a list: the band is turned end for end, so that the lining of the tight end comes to
      the slack end; for equal linings, on a brake at rest. Of a duty in phases `turned_after`: the numbers of phases
      that have ended by then, over all cycles

    Wear during a run does not act back on it: a brake application wears micrometres of some ten millimetres.

    Example:
        >>> sb.Wear(5e-14, permissible="12 mm")
        Wear(rate=ConstantWear(coefficient=5·10⁻¹⁴ m³/(N·m)), worn=0 m, permissible=12 mm)
    """

    rate: AbstractWearRate = part(AbstractWearRate)
    internal: AbstractWearRate | None = part(AbstractWearRate, default=None)
    worn: Scalar = quantity("m", "thickness worn off before the run", low=0.0, many=True, typical=1e-3, default=0.0)
    permissible: Scalar | None = quantity("m", "permissible wear", positive=True, many=True, default=None)
    thickness: Scalar | None = quantity("m", "thickness of a new lining", positive=True, default=None)
    geometry: bool = eqx.field(static=True, default=False)
    heat: bool = eqx.field(static=True, default=False)
    take_up_speed: Scalar | None = quantity(
        "m/s", "speed at which the lever takes up slack of the band", positive=True, default=None
    )
    turned_at: Scalar | None = quantity(
        "s", "times at which the band is turned end for end", many=Over.ROWS, default=None
    )
    turned_after: Scalar | None = quantity(
        "1", "numbers of phases after which the band is turned end for end", low=0.0, many=Over.ROWS, default=None
    )

    def faults(self, path: str, n: int) -> list[Fault]:
        """Errors of sizes that do not fit `n` linings (concrete values only)."""
        found = faults_of_sizes(self, path, n)
        if not found and self.thickness is not None:
            worn, whole = np.broadcast_to(np.asarray(self.worn), (n,)), float(self.thickness)
            i = int(np.argmax(worn))
            if worn[i] >= whole:
                what = f"{worn[i]:g} m worn off lining {i + 1} must be below its {whole:g} m"
                found.append(Fault(f"{path}.worn", what))
        return found


# --- effects of wear on a brake before a run --------------------------------------------------------------------------


class Delayed(AbstractProfile):
    """A profile that comes later, `p(t − delay)`; until then it is as before its beginning.

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

    def next_knot(self, piece: Piece) -> Float[Array, "..."] | float:
        return self.profile.next_knot(piece) + self.delay

    def first_piece(self, t: Real) -> Piece:
        return self.profile.first_piece(t - self.delay)

    def no_more_turns(self, t: Real) -> Bool[Array, ""]:
        return self.profile.no_more_turns(t - self.delay)

    def scale(self) -> Float[Array, ""]:
        return self.profile.scale()

    def faults(self, path: str, low: float | None) -> list[Fault]:
        if self.profile.controls_speed:
            return [Fault(f"{path}.profile", "a lever that depends on the speed cannot be delayed")]
        return self.profile.faults(f"{path}.profile", low)


def feeds_back(scene: Any) -> bool:
    """Whether wear before a run changes the scene."""
    wear = scene.wear
    return wear is not None and (wear.geometry or wear.heat or wear.take_up_speed is not None)


def _worn(scene: Any) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Thickness worn off before the run, and the sizes of the linings: under a band their angles."""
    weights = scene.brake.linings.weights
    return jnp.broadcast_to(jnp.asarray(scene.wear.worn), weights.shape), weights


def worn_scene(scene: Any) -> Any:
    """The scene with the effects of the wear `h_i` before it (`Wear.worn`); unchanged without feedback.

        geometry        R_b' = R_b − h̄,  h̄ = Σ β_i h_i/Σ β_i        the band follows the linings inwards
        take_up_speed   T_0'(t) = T_0(t − Δ/u),  Δ = Σ β_i h_i = h̄ Σ β_i    the lever first takes up the slack Δ of the
                        band's length, with its end at the speed u
        heat            lumps of linings: C' = C s_i, conductances from them G' = G/s_i, s_i = 1 − h_i/δ;
                        `TransmissionPartition`: δ_l' = δ_l − h̄.  Walls of linings: all layers by s_i (`walls_left`)

    The band circle is one, so that its radius falls by the mean; the linkage is not readjusted in between. Faces do not
    grow or shrink: the inner one stays on the rim.

    Example:
        >>> wear = sb.Wear(5e-14, worn="5 mm", geometry=True)
        >>> worn = sb.wear.worn_scene(sb.Scene(scene.brake, scene.duty, scene.initial, 4.0, wear=wear))
        >>> round(float(worn.brake.band.radius), 4)
        0.618
    """
    if not feeds_back(scene):
        return scene
    (h, angle), wear = _worn(scene), scene.wear
    slack = jnp.sum(angle * h)
    if wear.geometry:
        radius = jnp.asarray(scene.brake.band.radius) - slack / jnp.sum(angle)
        scene = eqx.tree_at(lambda s: s.brake.band.radius, scene, radius)
    if wear.take_up_speed is not None:
        lever = Delayed(scene.duty.slack_tension, slack / wear.take_up_speed)
        scene = eqx.tree_at(lambda s: s.duty.slack_tension, scene, lever)
    if wear.heat and scene.heated:
        scene = eqx.tree_at(lambda s: s.heat, scene, _thinner(scene.heat, h, angle, wear.thickness))
    return scene


def _linings(heat: Heat) -> set[str]:
    """Names of the bodies that are linings."""
    inner, outer = heat.friction, heat.external
    places = (heat.linings, None if inner is None else inner.lining, None if outer is None else outer.lining)
    return {place_of(place)[0] for place in places if place is not None}


def _left(h: Array, angle: Array, thickness: Scalar | None, count: int) -> Array:
    """Remaining share of the thickness of each of `count` bodies (all linings in one: their mean)."""
    share = 1 - h / jnp.asarray(thickness)
    return share if count > 1 else jnp.sum(share * angle, keepdims=True) / jnp.sum(angle)


def walls_left(scene: Any) -> dict[str, Array]:
    """Remaining share `s_i = 1 − h_i/δ` of the thickness of every wall of linings, for each of its copies.

    Layers are thinner by it: `C' = C s_i`, resistance `s_i δ/λ`.
    """
    if scene.wear is None or not scene.wear.heat or not scene.heated:
        return {}
    h, angle = _worn(scene)
    walls = [wall for wall in scene.heat.walls if wall.name in _linings(scene.heat)]
    return {wall.name: _left(h, angle, wall.thickness, wall.copies) for wall in walls}


def _thinner(heat: Heat, h: Array, angle: Array, thickness: Scalar | None) -> Heat:
    bodies, links = list(heat.bodies), list(heat.links)
    for i, body in enumerate(bodies):
        if not isinstance(body, Lump) or body.name not in _linings(heat):
            continue
        share = _left(h, angle, thickness, body.count)
        share = share if body.count > 1 else share[0]
        bodies[i] = eqx.tree_at(lambda b: b.capacity, body, jnp.asarray(body.capacity) * share)
        for k, link in enumerate(links):
            if isinstance(link, Conductance) and body.name in (link.a, link.b):
                links[k] = eqx.tree_at(lambda one: one.value, link, jnp.asarray(link.value) / share)
    heat = eqx.tree_at(lambda x: (x.bodies, x.links), heat, (tuple(bodies), tuple(links)))

    def thin(part: PyTree) -> PyTree:
        if not isinstance(part, TransmissionPartition):
            return part
        mean = jnp.sum(h * angle) / jnp.sum(angle)
        return eqx.tree_at(lambda p: p.lining_thickness, part, jnp.asarray(part.lining_thickness) - mean)

    return jax.tree.map(thin, heat, is_leaf=lambda x: isinstance(x, TransmissionPartition))


# --- errors -----------------------------------------------------------------------------------------------------------


def faults_of_wear(scene: Any) -> list[Fault]:
    """Errors between the wear of a scene and its other parts (concrete values only)."""
    wear, brake = scene.wear, scene.brake
    if wear is None:
        return []
    found = wear.faults("wear", brake.linings.count)
    given = {"internal": wear.internal is not None, "geometry": wear.geometry}
    given |= {"take_up_speed": wear.take_up_speed is not None, "turned_at": wear.turned_at is not None}
    given["turned_after"] = wear.turned_after is not None
    one_band = isinstance(brake, Brake)
    if not one_band:
        idle, why = [field for field, is_given in given.items() if is_given], f"has no effect on a {brake.words.brake}"
        found += [Fault(f"wear.{field}", why, "leave it out") for field in idle]
    if brake.linings.area is None:
        where = f"brake.{brake.pairs['external'].field}.area"
        found.append(Fault(where, "is missing", "wear depends on the pressure"))
    if given["internal"] and one_band:
        if brake.bandage is None:
            found.append(
                Fault("wear.internal", "has no effect", "only a staged brake (`brake.bandage`) has inner faces")
            )
        elif brake.bandage.area is None:
            found.append(Fault("brake.bandage.area", "is missing", "wear of the inner faces depends on the pressure"))
    if (given["turned_at"] or given["turned_after"]) and one_band:
        found += _faults_of_turning(brake)
    phased = isinstance(scene.duty.lever, Phases)
    if given["take_up_speed"] and (phased or scene.duty.lever.controls_speed):
        why = "in phases" if phased else "that depends on the speed"
        found.append(Fault("wear.take_up_speed", f"has no effect on a lever {why}", "leave it out"))
    which = ("turned_at", "turned_after") if phased else ("turned_after", "turned_at")
    if given[which[0]] and one_band:
        what = f"has no meaning for a duty {'' if phased else 'not '}in phases"
        found.append(Fault(f"wear.{which[0]}", what, f"give wear.{which[1]}"))
    return found + (_faults_of_thickness(scene) if wear.heat and not found else [])


def _faults_of_turning(brake: Any) -> list[Fault]:
    """Errors of a band that cannot be turned within a run: the brake is integrated as it was built."""
    where = "wear.turned_at"
    if brake.bandage is not None:
        return [Fault(where, "the linings of a staged brake ride on the pulley", "turning its band does not move them")]
    parts = [*leaves(brake.linings, "brake.linings"), *leaves(brake.band, "brake.band")]
    listed = [leaf for leaf in parts if np.ndim(leaf.value) == 1 and leaf.about.many is not Over.ROWS]
    unlike = [leaf.path for leaf in listed if np.ptp(np.asarray(leaf.value)) > 0]
    if remembers(brake.linings.friction):
        hint = "leave out one of them, or `lining_life(turn_at=…)`, which turns the band between stops"
        return [Fault(where, "the friction law has states, which would not turn with the band", hint)]
    changes = brake.linings.friction.over_time
    unlike += ["brake.linings.friction.changes" for change in changes if change.linings is not None]
    hint = "equal linings; else `lining_life(turn_at=…)`, which turns the band between stops"
    return [Fault(where, f"the numbers of {path} are not equal", hint) for path in unlike]


def _faults_of_thickness(scene: Any) -> list[Fault]:
    wear, heat, n = scene.wear, scene.network, scene.brake.linings.count
    names = _linings(heat)
    if not names:
        return [Fault("wear.heat", "has no effect", "the scene has no heat part with linings")]
    found, worn = [], float(np.max(np.broadcast_to(np.asarray(wear.worn), (n,))))
    for i, body in enumerate(heat.bodies):
        if body.name not in names:
            continue
        if isinstance(body, Lump) and wear.thickness is None:
            found.append(Fault("wear.thickness", "is missing", f"the lump {body.name!r} has no thickness"))
        elif isinstance(body, Wall) and worn >= float(body.thickness):
            what = f"{worn:g} m worn off must be below the thickness of the wall {body.name!r}"
            found.append(Fault(f"heat.bodies[{i}].thickness", what))
    return found


# --- a band turned end for end ----------------------------------------------------------------------------------------


def turned_scene(scene: Any) -> Any:
    """The scene with its band turned end for end: its quantities are counted from the other end.

    That is every number of `brake.linings`, of segments and gaps of the band, of the wear, and the heat capacity of the
    linings, where it has one entry per lining. Numbers of the places stay: temperatures at the start, free ends of the
    band. Raises `InputError` for a staged brake, whose linings ride on the pulley.

    Example:
        >>> linings = sb.Lining(0.35, [1.5, 1.5, 1.6])
        >>> brake = sb.Brake(scene.brake.pulley, scene.brake.band, linings)
        >>> turned = sb.wear.turned_scene(sb.Scene(brake, scene.duty, scene.initial, 4.0))
        >>> turned.brake.linings.angle.tolist()
        [1.6, 1.5, 1.5]
    """
    brake, n = scene.brake, scene.brake.linings.count
    if not isinstance(brake, Brake):
        raise InputError([Fault("brake", f"is a {brake.words.brake}: only one band is turned end for end")])
    if brake.in_series:
        raise InputError(_faults_of_turning(brake))

    def reverse(part: PyTree) -> PyTree:
        tables = TabulatedFade | TabulatedFriction | FrictionChange  # their entries are not linings

        def one(x: PyTree) -> PyTree:
            if isinstance(x, FrictionChange):
                return x.turned(n)
            return x[::-1] if not isinstance(x, tables) and np.ndim(x) == 1 and np.shape(x)[0] in (n, n - 1) else x

        return jax.tree.map(one, part, is_leaf=lambda x: isinstance(x, tables))

    scene = eqx.tree_at(lambda s: (s.brake.linings, s.brake.band), scene, (reverse(brake.linings), reverse(brake.band)))
    if scene.wear is not None:
        numbers = [scene.wear.rate, scene.wear.worn, scene.wear.permissible]
        scene = eqx.tree_at(
            lambda s: [s.wear.rate, s.wear.worn, s.wear.permissible],
            scene,
            [reverse(x) for x in numbers],
            is_leaf=lambda x: x is None,
        )
    if scene.heated:
        linings = _linings(scene.heat)
        bodies = tuple(
            eqx.tree_at(lambda b: b.capacity, body, reverse(body.capacity))
            if isinstance(body, Lump) and body.name in linings
            else body
            for body in scene.heat.bodies
        )
        scene = eqx.tree_at(lambda s: s.heat.bodies, scene, bodies)
    return scene
