"""One run: a brake, what acts on it, how it starts and when it ends; and what is unusual in it."""

import math
from typing import TYPE_CHECKING, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._base._quantity import Part, Scalar, as_arrays, faults_of_values, leaves, part, quantity
from ..brakes._band import ParallelBands
from ..brakes._design import AbstractBrake, AbstractLinings, Brake, tension_shares, under_a_band, unloaded
from ..friction import AbstractFriction, Reads, needs, reads, remembers
from ..hybrid._arrays import Array
from ..loads import AbstractLoad, AbstractSpeedLever
from ..profiles import AbstractProfile
from ..thermal._heat import FrictionHeat, Heat, PowerShares
from ..thermal._network import nodes_at, place_of
from ..wear import Wear, faults_of_wear


class AbstractDuty(Part):
    """What acts on a brake: the load, and what its lever gives.

    - `load`: `M_load(t, ω)`;  `lever_field`: name of the field that holds the profile of the lever
    """

    lever_field: eqx.AbstractClassVar[str]
    if TYPE_CHECKING:  # (as in `AbstractBrake`)

        @property
        def load(self) -> AbstractLoad: ...
    else:
        load: eqx.AbstractVar[AbstractLoad]

    @property
    def lever(self) -> AbstractProfile:
        """What the lever gives over time (N)."""
        return getattr(self, self.lever_field)


class Duty(AbstractDuty):
    """What acts on a band brake.

    - `slack_tension`: `T_0(t) ≥ 0` in N, set by the lever at the slack end;  `load`: `M_load(t, ω)`
    """

    slack_tension: AbstractProfile = part(AbstractProfile, "N")
    load: AbstractLoad = part(AbstractLoad)  # pyright: ignore
    lever_field: ClassVar[str] = "slack_tension"


class ForceDuty(AbstractDuty):
    """What acts on a disc brake or a double-shoe brake.

    - `force`: `F(t) ≥ 0` in N, with which the actuator presses each pad, or each shoe at its arm
    - `load`: `M_load(t, ω)`
    """

    force: AbstractProfile = part(AbstractProfile, "N")
    load: AbstractLoad = part(AbstractLoad)  # pyright: ignore
    lever_field: ClassVar[str] = "force"


class Initial(Part):
    """How the run starts.

    - `omega` `ω_0` (rad/s), positive in the braking direction;  `elongation` `x_0` (m) of an elastic band
    - `time` `t_0` (s)
    """

    omega: Scalar = quantity("rad/s", "initial speed")
    elongation: Scalar = quantity("m", "initial elongation of the band", low=0.0, default=0.0)
    time: Scalar = quantity("s", "time at the start", default=0.0)


class Scene(Part):
    """One run of a brake: a band brake under a `Duty`, a disc or double-shoe brake under a `ForceDuty`.

    Every number is an array leaf in SI units; `None` means that a piece of physics is absent.

    - `end_time` (s): the run goes on to here, also after the stop
    - `heat`: the thermal network, `None` where temperatures do not matter
    - `wear`: how the linings wear, `None` where that does not matter
    - `power_shares`: how the friction power splits into heat, electrical and mechanical power; `None`: all is heat
    """

    brake: AbstractBrake
    duty: AbstractDuty
    initial: Initial
    end_time: Scalar = quantity("s", "end of the run")
    heat: Heat | None = None
    wear: Wear | None = None
    power_shares: PowerShares | None = None

    @property
    def network(self) -> Heat:
        """The thermal network, one without bodies where the scene has none."""
        return Heat(()) if self.heat is None else self.heat

    @property
    def heated(self) -> bool:
        """Whether temperatures are followed."""
        return self.heat is not None


def paths_without_meaning(scene: Scene) -> tuple[str, ...]:
    """Paths of numbers that the scene's kind of brake does not have; they are neither shown nor written."""
    return () if scene.brake.banded else ("initial.elongation",)


def band_brake(scene: Scene) -> Brake:
    """The brake of a scene where only a band brake will do. Raises `InputError` for another kind."""
    return under_a_band(scene.brake)


def faults(scene: Scene) -> list[Fault]:
    """Everything wrong with a scene, at once. Traced numbers cannot be looked at and pass."""
    found = faults_of_values(scene) + _faults_of_kinds(scene)
    if found or any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return found
    brake, duty, lever = scene.brake, scene.duty, f"duty.{scene.duty.lever_field}"
    found += brake.faults("brake")
    found += _faults_of_heat(scene)
    found += [] if scene.power_shares is None else scene.power_shares.faults("power_shares")
    found += faults_of_wear(scene)
    if isinstance(duty.lever, AbstractSpeedLever):
        if isinstance(brake, Brake) and brake.band.stiffness is not None:
            found.append(
                Fault("brake.band.stiffness", "a lever that holds the speed needs a rigid band", "leave it out")
            )
        if read_by_linings(scene).p or scene.network.flash is not None:
            found.append(Fault(lever, "cannot hold the speed with an implicit coefficient of friction"))
    found += duty.lever.faults(lever, 0.0)
    found += duty.load.profile.faults("duty.load.profile", None)
    if not np.asarray(scene.end_time) > np.asarray(scene.initial.time):
        found.append(Fault("end_time", f"{float(scene.end_time):g} s is not after the start", "it must be later"))
    if found:
        return found
    if isinstance(brake, Brake):
        return _faults_of_band(scene, brake)
    if float(scene.initial.elongation) != 0.0:
        found.append(Fault("initial.elongation", f"a {brake.words.brake} has no band", "leave it out"))
    return found


def _faults_of_kinds(scene: Scene) -> list[Fault]:
    """Whether brake and duty belong to each other."""
    name, pressed = scene.brake.words.brake, not scene.brake.banded
    if pressed and isinstance(scene.duty, Duty):
        what = f"a {name} has no band"
        return [Fault("duty.slack_tension", what, "give the force of its actuator: `ForceDuty`, key `force`")]
    if not pressed and isinstance(scene.duty, ForceDuty):
        what = f"a {name} is pressed by its band"
        return [Fault("duty.force", what, "give the tension of its slack end: `Duty`, key `slack_tension`")]
    return []


def _faults_of_band(scene: Scene, brake: Brake) -> list[Fault]:
    found, rigid = [], brake.band.stiffness is None
    if brake.in_series or rigid:
        hint = (
            "a rigid band cannot hold such a lining: make it shorter, lower its friction, or give the band a stiffness"
        )
        if brake.in_series:
            hint = "a staged brake cannot have it: make the lining shorter, or lower its friction"
        found += [Fault(f"brake.linings.angle[{i - 1}]", why, hint) for i, why in locked(scene).items()]
    if brake.in_series and isinstance(scene.duty.lever, AbstractSpeedLever):
        found.append(Fault("duty.slack_tension", "cannot hold the speed of a staged brake", "give the slack tension"))
    if brake.in_series and scene.network.flash is not None:
        found.append(Fault("heat.flash", "is not available for a staged brake", "leave it out"))
    if rigid and float(scene.initial.elongation) != 0.0:
        found.append(Fault("initial.elongation", "a rigid band has no elongation", "give brake.band.stiffness"))
    return found


def check(scene: Scene) -> None:
    """Raises `InputError` with all faults of a scene; returns silently if there are none."""
    found = faults(scene)
    if found:
        raise InputError(found)


def checked(scene: Scene) -> Scene:
    """The scene without faults, its numbers as arrays. Raises `InputError` with all faults."""
    check(scene)
    return as_arrays(scene)


def warnings(scene: Scene) -> list[str]:
    """What a user should know of a scene that is no fault."""
    if any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return []
    then = "it never slips as long as that lasts" if scene.brake.banded else "a run ends as soon as its force acts"
    found = [f"self_locking: {why}; {then}" for why in locked(scene).values()]
    brake = scene.brake
    if not (isinstance(brake, Brake) and isinstance(brake.band.stiffness, ParallelBands)):
        return found
    read = read_by_linings(scene)
    if not (read.T or read.p or remembers(brake.linings.friction)):
        return found
    shares = np.asarray(tension_shares(brake, sensed_at_start(scene)))
    if np.ptp(shares) > 1e-9:
        text = ", ".join(f"{share:.4g}" for share in shares)
        found.append(
            f"unequal_bands: the bands carry {text} of the tension; their heat and pressure are taken as the mean"
        )
    return found


#: of a staged brake with heat: what is wrong where a pair has no place for its heat, and what builds one
_MISSING_PAIR = {
    "friction": (
        "is missing: the friction heat of linings and rim (internal pair) would enter no body",
        "name its places: `FrictionHeat(metal, lining, partition)`, or build the network with `lumped_heat` or "
        "`layered_heat`, linings included",
    ),
    "external": (
        "is missing: the friction heat of band and linings (external pair) would enter no body",
        "build the network, linings and band included, and give it to `with_external_pair(heat, partition)`",
    ),
}


def _faults_of_heat(scene: Scene) -> list[Fault]:
    heat, n = scene.network, scene.brake.linings.count
    found = heat.faults("heat", n) if scene.heated else []
    if found:
        return found
    if heat.external is not None and not scene.brake.in_series:
        found.append(
            Fault("heat.external", "has no effect", "only a staged brake (`brake.bandage`) has an external pair")
        )
    for i, (law, pair, where, field) in enumerate(pairs_of(scene)):
        if pair is None:
            if scene.heated and scene.brake.in_series:
                # its heat would leave the network, counted as lost, and warm nothing
                found.append(Fault(f"heat.{field}", *_MISSING_PAIR[field]))
            elif needs(law, n).T:
                hint = f"give the scene a heat part whose `{field}` names the places that the heat enters"
                found.append(Fault("heat", f"is missing, but the friction law {where} looks at the temperature", hint))
            continue
        bounds, T = law.temperature_range(), sensed_at_start(scene, i)
        if bounds is not None and T is not None and not (float(bounds[0]) <= T.min() and T.max() <= float(bounds[1])):
            table = f"{float(bounds[0]):g}…{float(bounds[1]):g} K"
            what = f"the table of {table} does not cover the start at {T.min():g}…{T.max():g} K"
            found.append(Fault(where, what, "extend the table; it is not extrapolated"))
    if heat.flash is not None:
        if not isinstance(scene.brake, Brake):
            what = f"is not available for a {scene.brake.words.brake}"
            return [*found, Fault("heat.flash", what, "leave it out")]
        if scene.brake.band.segments is not None:
            found.append(Fault("heat.flash", "is not modelled for a band in segments", "leave out one of the two"))
        if not read_by_linings(scene).T:
            found.append(Fault("heat.flash", "has no effect", "the friction law does not look at the temperature"))
        if heat.flash.hardness is None and scene.brake.linings.area is None:
            found.append(Fault("brake.linings.area", "is missing", "the flash temperature looks at the pressure"))
    return found


def pairs_of(scene: Scene) -> list[tuple[AbstractFriction, FrictionHeat | None, str, str]]:
    """Friction laws with the places of their heat, their paths, and the field of the heat part that names these."""
    brake, law = scene.brake, scene.brake.linings.friction
    friction, external = scene.network.friction, scene.network.external
    if not (isinstance(brake, Brake) and brake.bandage is not None):
        return [(law, friction, "brake.linings.friction", "friction")]
    return [
        (law, external, "brake.linings.friction", "external"),
        (brake.bandage.friction, friction, "brake.bandage.friction", "friction"),
    ]


def read_by_linings(scene: Scene) -> Reads:
    """What the linings' friction law reads on the band (staged), else on the rim, of what the scene has."""
    (law, pair, *_), *_ = pairs_of(scene)
    linings = scene.brake.linings
    return reads(law, linings.count, T=pair is not None, p=linings.area is not None)


def sensed_at_start(scene: Scene, number: int = 0) -> np.ndarray | None:
    """Temperatures (K) that the friction law of a pair sees at the start, `None` where the scene has none.

    - `number` of the pair: the first is that on which the lever acts, the last (−1) that on the rim
    """
    _, pair, *_ = pairs_of(scene)[number]
    if pair is None or pair.sensor is None:
        return None
    name, face = place_of(pair.sensor)
    body = next(body for body in scene.network.bodies if body.name == name)
    T = np.broadcast_to(np.asarray(getattr(body, "temperature", np.nan), float), (body.count,))
    return np.broadcast_to(T[nodes_at(body, face)], (scene.brake.linings.count,))


@DeviceJit
def _static_friction(linings: AbstractLinings, T: Array | None) -> Array:
    f = linings.friction.static(unloaded(linings, jnp.zeros(linings.count), T))
    return jnp.broadcast_to(f, (linings.count,))


def static_friction(scene: Scene) -> np.ndarray:
    """Coefficient up to which each lining sticks at the start, on the rim, or on the band of a staged brake."""
    return np.asarray(_static_friction(scene.brake.linings, sensed_at_start(scene)))


@DeviceJit
def _self_locking(brake: AbstractBrake, f: Array) -> Array:
    return brake.self_locking(f)


def locked(scene: Scene) -> dict[int, str]:
    """Linings (from 1) that lock themselves with their static friction, of a band `f tan(β/2) ≥ 1`; why, in words."""
    near = np.asarray(_self_locking(scene.brake, static_friction(scene)))
    return {int(i) + 1: scene.brake.locking_words(int(i) + 1, float(near[i])) for i in np.flatnonzero(near >= 1.0)}


# --- what is unusual for drilling drawworks: warnings, never a refusal ------------------------------------------------

_DRUMEANU = "Drumeanu & Antonescu 2003, band brakes of drawworks"
#: coefficient of friction, wrap angle (deg), rim temperature (°C): low, high
FRICTION, WRAP, RIM = (0.35, 0.65), (270.0, 325.0), (300.0, 800.0)
#: linings of a band; conductivities (W/(m·K)) of rims and linings
LININGS, RIM_CONDUCTIVITY, LINING_CONDUCTIVITY = (8.0, 26.0), (38.0, 163.0), (0.4, 1.5)
ZERO = 273.15  # K


def _unusual(what: str, low: float, high: float, usual: tuple[float, float], words: str) -> list[str]:
    """A warning of values from `low` to `high` that are not within what is usual; `words` say what that is."""
    slack = 1e-9 * usual[1]  # the angles of equal linings add up to a wrap with rounding
    within = usual[0] - slack <= low and high <= usual[1] + slack
    return [] if within else [f"unusual: {what}, {words.format(f'{usual[0]:g}…{usual[1]:g}')}"]


def plausibility(scene: Scene, peak_rim: float | None = None) -> list[str]:
    """Numbers of a scene that are unusual for a brake of drawworks: what, the usual range, its source, the reason.

    - static coefficient of friction 0.35…0.65, wrap 270…325°, rim at most 800 °C: Drumeanu & Antonescu (2003); Z has
      cases down to 0.1, and a single stop stays far below 300 °C, so that there is no warning for a cool rim
    - 8…26 linings: Z;  conductivity of rim 38…163 and linings 0.4…1.5 W/(m·K): V, tables 1 and 2, and textbooks
    - `peak_rim`: highest rim temperature (K) of a run of it, if there was one
    """
    if any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return []
    found, brake, heat = list[str](), scene.brake, scene.network
    if isinstance(brake, Brake):  # the sources are about band brakes
        f, wrap = static_friction(scene), math.degrees(float(np.sum(brake.linings.angle)))
        values = f"{f.min():.4g}" if np.ptp(f) < 1e-12 else f"{f.min():.4g}…{f.max():.4g}"
        why = "tensions depend on it exponentially (Z computes cases down to 0.1)"
        what = f"static coefficient of friction {values}"
        found += _unusual(what, f.min(), f.max(), FRICTION, f"usual are {{}} ({_DRUMEANU}); {why}")
        why = "the grip of the band depends on it exponentially"
        found += _unusual(f"wrap {wrap:.5g}°", wrap, wrap, WRAP, f"usual are {{}}° ({_DRUMEANU}); {why}")
        n = brake.linings.count
        found += _unusual(f"{n} linings", n, n, LININGS, "usual are {} (Z)")
    if peak_rim is not None:
        T, why = peak_rim - ZERO, "properties of steel and linings are not known that hot"
        words = f"usual in heavy service are {{}} °C ({_DRUMEANU}); {why}"
        found += _unusual(f"rim at {T:.0f} °C", max(T, RIM[0]), T, RIM, words)  # a single stop leaves it cooler
    walls = {wall.name: wall for wall in heat.walls}
    for name, place, usual in (("rim", heat.rim, RIM_CONDUCTIVITY), ("linings", heat.linings, LINING_CONDUCTIVITY)):
        wall = walls.get(place_of(place)[0]) if place else None
        if wall is not None:
            value, words = float(wall.material.conductivity), "usual are {} (V, tables 1 and 2); is the unit right?"
            found += _unusual(f"{name} with {value:.4g} W/(m·K)", value, value, usual, words)
    return found
