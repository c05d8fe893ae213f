"""The numbers of a run: name, unit, meaning, which scenes have them, and how they are
found.

They are functions of a run's record, traceable, so that they can be differentiated and
batched.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._arguments import explained
from .._base._faults import near
from ..brakes.design import Brake, Strength
from ..hybrid import LANDED, Record, largest, smallest
from ..hybrid.arrays import Array, numpy_of
from ..loads import Lever, cylinders
from ..parts.scene import Scene, has_load
from ..physics._brake import BrakeSystem
from ..physics._rope import ElasticRope
from ..physics.mechanism import BandMode, Ledger, Mode, comes_to_rest, holds, slips
from ..shaft import TackleLoss, names_of
from ..thermal.heat import PowerSplit
from .probe import Probe
from .programs import RunJit
from .quantities import coolant_outlet, deceleration, sum_of
from .torques import can_lose_grip, terminal_speed

# --- strength of the band and travel of the lever ------------------------------------


def strength_of(scene: Scene) -> Strength | None:
    """Cross-sections of the band and its anchor, where the scene has them."""
    return scene.brake.band.strength if isinstance(scene.brake, Brake) else None


def lever_of(scene: Scene) -> Lever | None:
    """The lever of the driller, where the scene has its arms."""
    return scene.duty.lever if isinstance(scene.duty.lever, Lever) else None


def permissible_actuator_pressure(scene: Scene) -> Any:
    """Least permissible gauge pressure (Pa) of the cylinders behind the lever; `None`:
    none is given."""
    each = [
        getattr(cylinder, "permissible_pressure", None)
        for cylinder in cylinders(scene.duty.lever)
    ]
    return min((pressure for pressure in each if pressure is not None), default=None)


def stress(tension: Array, scene: Scene, *, anchor: bool = False) -> Array:
    """Stress (Pa) of the band, or of its anchor, under a tension (N)."""
    parts: Any = strength_of(scene)
    return tension / (parts.anchor_area if anchor else parts.band_area)


def lever_travel(shortened: Array, scene: Scene) -> Array:
    """Travel of the lever's end (m) from that of the released band of new linings:

        s = (l/a) (x + Σ β_i (h_i + δ))

    `x` (m): elongation of the band, `h_i`: all that the linings have lost, `δ`:
    clearance of the released band

    - `shortened` (m): the part that changes in the run, `x` and `Σ β_i` times what the
      linings have lost since its start
    """
    lever: Any = lever_of(scene)
    gap = lever.clearance
    if scene.wear is not None:
        gap = gap + scene.wear.worn
    linings: Any = scene.brake.linings
    before = (linings.angle * gap).sum()
    return lever.arm / lever.slack_arm * (shortened + before)


def allowable_values(scene: Scene) -> dict[str, float]:
    """Allowable values of metrics (SI), from the parts of a scene; its `limits` replace
    them."""
    values = {
        name: metric.limit(scene)
        for name, metric in METRICS.items()
        if metric.limit and not metric.needs.lacks(scene)
    }
    values |= {} if scene.limits is None else scene.limits.given
    return {name: float(most) for name, most in values.items() if most is not None}


def values_of_marks(scene: Scene) -> dict[str, float]:
    """Values (SI) at which metrics have their events: the limit of the mark, or else
    the allowable value."""
    limits = allowable_values(scene)
    return {
        name: float(metric.mark.limit(scene)) if metric.mark.limit else limits[name]
        for name, metric in METRICS.items()
        if metric.mark and name in limits
    }


# --- metrics ------------------------------------------------------------------------


#: whether something happens at events, from the modes before and after them
Happens = Callable[[Mode, Mode], Array]


#: name of the metric that is evaluated only while the brake is to hold (`to_hold`)
HOLDING = "min_holding_reserve"
#: differences of the friction heat below this share of it are rounding
_NOTHING_LEFT = 1e-12
#: in place of a capacity of 0 (N·m), so that the share held is large, but finite
_NO_CAPACITY = 1e-100


class Requirement(NamedTuple):
    """What a scene needs for its runs to have a number: such `scenes` in words, what is
    `missing` in others, and whether a scene has `met` it.

    Example:
        >>> sb.results.METRICS["peak_rim_temperature"].needs.lacks(scene)
        'its heat part names no such place'
    """

    scenes: str
    missing: str
    met: Callable[[Scene], bool]

    def lacks(self, scene: Scene) -> str:
        """What a scene lacks, "" where it has the number."""
        return "" if self.met(scene) else self.missing


NOTHING = Requirement("every scene", "", lambda scene: True)


class Mark(NamedTuple):
    """An event of the log that does not change the motion: a quantity passes its limit.

    - `event`: its name
    - `meaning`, and which `brakes` can have it
    - `plain`: the meaning as a sentence in plain words
    - `words`: noun for the event where events are counted
    - `limit(scene)`: where the event is, if not at the allowable value of the metric;
      without an allowable value there is no event either

    Example:
        >>> sb.results.METRICS["max_drum_speed"].mark.event
        'overspeed'
    """

    event: str
    meaning: str
    brakes: str
    plain: str
    words: str
    limit: Callable[[Scene], Any] | None = None


class Metric(NamedTuple):
    """A number of a run.

    - `unit` (SI), `meaning` in words, `title` above it in pages
    - `find(record, scene)`: the number, `inf` for the time of what did not happen
    - `greatest`: the metric is the maximum of `find(probe)`, (m, n), over the run
    - `of_size`: a motion in either sense, below 0 upwards: its limit is that of its size
    - `energy`: the metric is `find(account)` of an `Account`
    - `needs`: what a scene needs for its runs to have the metric
    - `shown_anyway`: a scene that lacks this shows the metric as `inf`
    - `if_asked`: a run has it only if it is asked for, by name or as a limit
    - `of_linings`: whether a maximum value tells the lining
    - `number(maximum, scene)`: the metric as a function of the maximum, by default the
      maximum itself
    - `limit(scene)`: its allowable value from the parts of the scene (`None`: not
      given)
    - `mark`: the event at which the quantity of a `greatest` metric passes its limit
    - `place`: name of the place whose temperature the metric is, in the heat part

    Example:
        >>> metric = sb.results.METRICS["max_tension"]
        >>> metric.unit, metric.meaning
        ('N', 'maximum tension of the band at either side of any lining')
    """

    unit: str
    meaning: str
    title: str
    find: Callable[..., Any]
    needs: Requirement = NOTHING
    greatest: bool = False
    of_size: bool = False
    of_linings: bool = False
    shown_anyway: bool = False
    if_asked: bool = False
    number: Callable[[Any, Scene], Any] | None = None
    limit: Callable[[Scene], Any] | None = None
    mark: Mark | None = None
    place: str = ""
    energy: bool = False

    def of_peak(self, peak: "Peak", scene: Scene) -> "Peak":
        """A maximum over the run, with the metric in place of its value."""
        if self.number is None:
            return peak
        return peak._replace(value=self.number(peak.value, scene))


class Peak(NamedTuple):
    """A maximum value over a run, when it occurs (s) and at which lining (from 1)."""

    value: Any
    time: Any
    lining: Any


# --- events and wear ----------------------------------------------------------------


def _first(record: Record, happens: Happens, values: Array) -> Array:
    """Value just after the first event at which `happens(before, after)` of the modes,
    `inf` if there is none."""
    before = record.modes
    xp = numpy_of(before.band)
    n = record.rows.t.shape[0]
    after = jax.tree.map(
        lambda column: xp.concatenate([column[1:], column[-1:]]), before
    )
    events = (xp.arange(n, dtype=np.int32) < record.count) & (
        record.rows.kind >= LANDED
    )
    marked = events & happens(before, after)
    xp = numpy_of(values)  # in a derivative outside of jit the modes alone are known
    i = xp.min(xp.where(marked, xp.arange(n, dtype=np.int32), np.int32(n)))
    return xp.where(i < n, xp.asarray(values)[xp.minimum(i + 1, n - 1)], np.inf)


def _time_of(happens: Happens) -> Callable[[Record, Scene], Array]:
    """The time of the first event at which `happens`."""
    return lambda record, scene: _first(record, happens, record.rows.t)


def _slip_begins(before: Mode, after: Mode) -> Array:
    slack = (before.band == BandMode.OPEN) | (before.band == BandMode.TAKE_UP)
    return slack & ((after.band == BandMode.ELASTIC) | slips(after.band))


def _bandage_rests(before: Mode, after: Mode) -> Array:
    locks = (
        (after.band == BandMode.HELD)
        & (before.band != BandMode.HELD)
        & (before.band != BandMode.OPEN)
    )
    return locks & (after.slides != 0)


def _inverse(maximum: Array, scene: Scene) -> Array:
    xp = numpy_of(maximum)
    return xp.where(maximum > 0, 1 / xp.where(maximum > 0, maximum, 1.0), xp.inf)


def _at_least_0(maximum: Array, scene: Scene) -> Array:
    return numpy_of(maximum).maximum(maximum, 0.0)


def held_share(load: Array, capacity: Array, held: Array) -> Array:
    """Load over the static capacity of a brake that is to hold the pulley at rest, else
    0."""
    xp = numpy_of(load)
    return xp.where(held, load / xp.where(capacity > 0, capacity, _NO_CAPACITY), 0.0)


def _held_share(p: Probe) -> Float[Array, "m 1"]:
    """`held_share` while the pulley is at rest, or only begins to move."""
    return held_share(*p.holding, holds(p.mode) | (p.y.omega == 0.0))[:, None]


def at_first_stop(record: Record, values: Array) -> Array:
    """Value at the first stop. Where the pulley may rest with the band open, it stops
    only where it has turned since it rested last."""
    if not record.system.rests_open or record.modes.turn is not None:  # pyright: ignore
        return _first(record, comes_to_rest, values)
    phi = record.states.phi
    rests = holds(record.modes)
    xp = numpy_of(phi)
    last = (
        np.maximum.accumulate if xp is np and numpy_of(rests) is np else jax.lax.cummax
    )
    row = last(xp.where(rests, xp.arange(phi.shape[0], dtype=np.int32), np.int32(0)))
    turned = xp.concatenate([phi[1:], phi[-1:]]) != phi[row]
    return _first(record, functools.partial(comes_to_rest, turned=turned), values)


def _hook_travel(record: Record, scene: Scene) -> Any:
    travel = _travel(record, scene, functools.partial(at_first_stop, record))
    return np.asarray(np.inf) if travel is None else travel


def hook_travel_at_end(record: Record, scene: Scene) -> Any:
    """Travel of the hook (m) over the run, with the stretch of an elastic rope; `None`
    for a load on no hook."""
    return _travel(record, scene, lambda values: values[record.count])


def _travel(record: Record, scene: Scene, at: Callable[[Array], Array]) -> Any:
    """Travel of the hook (m) at an instant; `at` takes the value there of a column."""
    travel = scene.duty.load.travelled(at(record.states.phi))
    system: BrakeSystem = record.system  # pyright: ignore
    if travel is None or system.feature(ElasticRope) is None:
        return travel
    return travel + at(stretched(system, record.states, record.modes))


@functools.partial(RunJit, quick=True)
def stretched(system: Any, states: Any, modes: Mode) -> Any:
    """Stretch of the rope (m) since the start, at many instants."""
    return jax.vmap(
        lambda y, mode: system.feature(ElasticRope).stretched(system, y, mode)
    )(states, modes)


def worn_thickness(record: Record) -> Float[Array, " n"]:
    """Thickness that every lining lost in a run (m)."""
    return sum_of(record.y_end.worn)


def _greatest_wear_over(
    base_of: Callable[[Array], Array],
) -> Callable[[Record, Scene], Array]:
    """Maximum wear over a base, such as the mean of all linings; `inf` where the base
    is 0."""

    def find(record: Record, scene: Scene) -> Array:
        h = worn_thickness(record)
        base = base_of(h)
        xp = numpy_of(h)
        return xp.where(base > 0, largest(h) / xp.where(base > 0, base, 1.0), np.inf)

    return find


# --- what a scene needs for a metric ------------------------------------------------

_HOOK = Requirement(
    "load on a hook",
    "its load hangs on no hook",
    lambda scene: scene.duty.load.travel() is not None,
)
_ROPE = Requirement(
    "elastic rope",
    "its load hangs on no elastic rope",
    lambda scene: scene.duty.load.elastic is not None,
)
RIGID_HOOK = Requirement(
    "load on a hook, rigid rope",
    "its load hangs on no hook, or on an elastic rope (whose hook load over weight is "
    "1 + a/g)",
    lambda scene: _HOOK.met(scene) and scene.duty.load.elastic is None,
)
_BANDAGE = Requirement(
    "staged brake", "its brake has no bandage", lambda scene: scene.brake.in_series
)
_CHAIN = Requirement(
    "resolved chain",
    "its brake has no band in segments",
    lambda scene: scene.brake.resolved and not scene.brake.in_series,
)
_WEAR = Requirement(
    "wear", "the scene has no wear part", lambda scene: scene.wear is not None
)
_BAND = Requirement(
    "band brake", "its brake has no band", lambda scene: scene.brake.banded
)
_LOAD = Requirement("load", "it has no load", has_load)
_STRENGTH = Requirement(
    "`Strength` of the band",
    "its band has no `strength`",
    lambda scene: strength_of(scene) is not None,
)
_ANCHOR = Requirement(
    "section of the anchor",
    "its band has no section of the anchor",
    lambda scene: getattr(strength_of(scene), "anchor_area", None) is not None,
)
_LEVER = Requirement(
    "`Lever`",
    "its tension is not that of a `Lever`",
    lambda scene: lever_of(scene) is not None,
)
_CYLINDER = Requirement(
    "`Cylinder`",
    "no cylinder pulls its lever",
    lambda scene: any(cylinders(scene.duty.lever)),
)
_TRAVEL = Requirement(
    "`Lever` of a band as a whole",
    "its tension is not that of a `Lever`, or its linings move by themselves, or it "
    "has several bands",
    lambda scene: (
        lever_of(scene) is not None
        and isinstance(scene.brake, Brake)
        and not scene.brake.resolved
    ),
)
_DAMPERS = Requirement(
    "resolved linings, elastic rope",
    "its linings do not move by themselves, nor its hook",
    lambda scene: scene.brake.resolved or _ROPE.met(scene),
)
_ELASTIC = Requirement(
    "band brake, elastic rope",
    "nothing in it stretches",
    lambda scene: _BAND.met(scene) or _ROPE.met(scene),
)
_SHARES = Requirement(
    "`power_shares`",
    "the scene has no `power_shares`",
    lambda scene: scene.power_shares is not None,
)
_SHAFT = Requirement(
    "torques on the shaft",
    "it has no torques on the shaft",
    lambda scene: bool(scene.shaft),
)
_TERMINAL = Requirement(
    "torques on the shaft, or a `WindlassLoad`",
    "it has no torques on the shaft, and no `WindlassLoad`",
    lambda scene: bool(scene.shaft) or _GROUND.met(scene),
)
_TACKLE = Requirement(
    "`TackleLoss` on the shaft",
    "its shaft has no `TackleLoss`",
    lambda scene: any(isinstance(law, TackleLoss) for law in scene.shaft),
)
_ROPES = Requirement(
    "ropes with a mass",
    "its load has no ropes with a mass",
    lambda scene: scene.duty.load.ropes(np.zeros(()), 0) is not None,
)
_GROUND = Requirement(
    "`WindlassLoad`",
    "its load does not come to the ground",
    lambda scene: scene.duty.load.above_ground(np.zeros(())) is not None,
)
_MOTOR = Requirement("motor", "it has no motor", lambda scene: scene.motor is not None)
HEAT = Requirement("heat", "the scene has no heat", lambda scene: scene.heated)
_JACKET = Requirement(
    "`WaterJacket`",
    "its heat part has no water jacket",
    lambda scene: bool(scene.network.jackets),
)


def _surface(
    place: str,
    title: str,
    meaning: str,
    *,
    of_linings: bool = False,
    mark: Mark | None = None,
) -> Metric:
    """The maximum temperature of a place that the heat part of a scene names."""
    named = Requirement(
        "heat that names the place",
        "its heat part names no such place",
        lambda scene: place in scene.network.hot_places,
    )
    return Metric(
        "K",
        meaning,
        title,
        lambda p: p.surfaces[place],
        named,
        greatest=True,
        of_linings=of_linings,
        limit=lambda scene: scene.network.permissible_at.get(place),
        mark=mark,
        place=place,
    )


# --- terms of energies --------------------------------------------------------------


class Account(NamedTuple):
    """Terms of the energies of a run, in J."""

    ledger: Ledger  # at the end
    friction: PowerSplit  # what became of the work of all friction pairs
    kinetic: Array  # change since the start
    elastic: Array | None  # change since the start, None where nothing is elastic
    stored: Mapping[str, Array]  # heat in every body of the network since the start

    @property
    def shaft_work(self) -> Array | None:
        """Work of the torques on the shaft other than load and brake; all of it becomes
        heat."""
        each = self.ledger.shaft
        return None if each is None else sum(each, start=jnp.zeros(()))

    @property
    def heat_to_band(self) -> Array:
        into = self.ledger.heat.to_band
        return jnp.zeros(()) if into is None else into

    @property
    def heat_to_coolant(self) -> Array | None:
        return self.ledger.heat and self.ledger.heat.coolant

    @property
    def heat_stored(self) -> Array:
        return sum(self.stored.values(), start=jnp.zeros(()))


def closure_of(*terms: Array | None) -> Array:
    """Sum of terms that should balance, over the largest of them."""
    each = jnp.stack([term for term in terms if term is not None])
    size = jnp.max(jnp.abs(each))
    return jnp.where(
        size > 0, jnp.abs(jnp.sum(each)) / jnp.where(size > 0, size, 1.0), 0.0
    )


def _taken(given: Array | None) -> Array | None:
    """A term of `closure_of` for the other side of the balance."""
    return None if given is None else -given


def _elsewhere(a: Account) -> Array:
    heat = a.ledger.heat
    away = a.friction.heat - (heat.to_metal + heat.to_linings + a.heat_to_band)
    return jnp.where(
        jnp.abs(away) > _NOTHING_LEFT * jnp.abs(a.friction.heat), away, 0.0
    )


def _energy_closure(a: Account) -> Array:
    given = (a.ledger.load_work, a.ledger.ropes, a.ledger.lever_work, a.ledger.motor)
    spent = (*a.friction, a.ledger.damper_heat, a.shaft_work, a.ledger.pick_up)
    return closure_of(a.kinetic, a.elastic, *map(_taken, given), *spent)


def _energy(
    name: str,
    meaning: str,
    find: Callable[[Account], Any],
    needs: Requirement = NOTHING,
    unit: str = "J",
) -> dict[str, Metric]:
    """An energy over the run, or the residual of a balance of energies."""
    title = f"Energy: {name.replace('_', ' ')}"
    return {f"energy.{name}": Metric(unit, meaning, title, find, needs, energy=True)}


# --- the registry -------------------------------------------------------------------

#: every number of a run by its name: results, files, tables, reports, studies and docs
#: read it from here
METRICS: dict[str, Metric] = {
    "slip_onset_time": Metric(
        "s",
        "first onset of slip t0: the band is taut",
        "Onset of slip t₀",
        _time_of(_slip_begins),
    ),
    "full_slip_time": Metric(
        "s",
        "first time at which every lining slides, t1",
        "Full slip t₁",
        _time_of(lambda before, after: slips(after.band) & (before.band != after.band)),
    ),
    "stopping_time": Metric(
        "s",
        "first time at which the brake brings the pulley to rest",
        "Stopping time",
        lambda record, scene: at_first_stop(record, record.rows.t),
    ),
    "terminal_speed": Metric(
        "rad/s",
        "steady speed at which the torques of the end balance the load",
        "Terminal speed",
        lambda record, scene: terminal_speed(record),
        _TERMINAL,
        of_size=True,
    ),
    "stopping_angle": Metric(
        "rad",
        "angle from the start to the first stop",
        "Angle to the first stop",
        lambda record, scene: at_first_stop(record, record.states.phi),
        of_size=True,
    ),
    "hook_travel": Metric(
        "m",
        "travel of the hook from the start to the first stop; no value without a stop",
        "Hook travel to the first stop",
        _hook_travel,
        _HOOK,
        shown_anyway=True,
        of_size=True,
    ),
    "total_hook_travel": Metric(
        "m",
        "travel of the hook from the start to the end of the run",
        "Hook travel of the run",
        hook_travel_at_end,
        _HOOK,
        of_size=True,
    ),
    "max_hook_load": Metric(
        "N",
        "maximum force on the hook",
        "Maximum hook load",
        lambda p: p.hook.force[:, None],
        _ROPE,
        greatest=True,
    ),
    "max_hook_load_over_weight": Metric(
        "1",
        "maximum force on the hook over the weight that hangs on it",
        "Maximum hook load over weight",
        lambda p: (p.hook.force / p.hook.weight)[:, None],
        _ROPE,
        greatest=True,
    ),
    "max_tension": Metric(
        "N",
        "maximum tension of the band at either side of any lining",
        "Maximum tension of the band",
        lambda p: p.greater_tension,
        _BAND,
        greatest=True,
        of_linings=True,
    ),
    "max_normal_load": Metric(
        "N",
        "maximum normal load on any lining",
        "Maximum load on a lining",
        lambda p: p.shown.pairs[0].normal,
        greatest=True,
        of_linings=True,
    ),
    "internal_slip_time": Metric(
        "s",
        "first time at which the internal pair slides",
        "First internal slip",
        _time_of(lambda before, after: (before.slides == 0) & (after.slides != 0)),
        _BANDAGE,
    ),
    "external_lock_time": Metric(
        "s",
        "first time at which the bandage is at rest on a turning pulley",
        "First rest of the bandage",
        _time_of(_bandage_rests),
        _BANDAGE,
    ),
    "first_lining_slip_time": Metric(
        "s",
        "first time at which a lining slides by itself",
        "First slip of a lining",
        _time_of(
            lambda before, after: (
                (before.own.linings == 0) & (after.own.linings != 0)
            ).any(axis=1)
        ),
        _CHAIN,
    ),
    "greatest_wear": Metric(
        "m",
        "maximum thickness that a lining lost in the run",
        "Maximum wear of a lining",
        lambda record, scene: largest(worn_thickness(record)),
        _WEAR,
    ),
    "wear_over_mean": Metric(
        "1",
        "maximum wear over the mean of all linings",
        "Maximum over mean wear",
        _greatest_wear_over(lambda h: numpy_of(h).mean(h)),
        _WEAR,
    ),
    "wear_over_least": Metric(
        "1",
        "maximum wear over the minimum: how uneven the linings wear",
        "Maximum over minimum wear",
        _greatest_wear_over(smallest),
        _WEAR,
    ),
    HOLDING: Metric(
        "1",
        "minimum of the static capacity of the brake over the load, while it is to "
        "hold the pulley at rest",
        "Minimum holding reserve",
        _held_share,
        _LOAD,
        greatest=True,
        number=_inverse,  # the maximum is that of load over capacity
    ),
    "max_band_stress": Metric(
        "Pa",
        "maximum stress of the band, at either side of any lining",
        "Maximum stress of the band",
        lambda p: p.greater_tension,
        _STRENGTH,
        greatest=True,
        of_linings=True,
        number=stress,
        limit=lambda scene: getattr(strength_of(scene), "band_stress", None),
    ),
    "max_anchor_stress": Metric(
        "Pa",
        "maximum stress of the anchor of the band",
        "Maximum stress of the anchor",
        lambda p: p.flows.contact.tight_tension[:, None],
        _ANCHOR,
        greatest=True,
        number=functools.partial(stress, anchor=True),
        limit=lambda scene: getattr(strength_of(scene), "anchor_stress", None),
    ),
    "max_lever_force": Metric(
        "N",
        "maximum force on the lever",
        "Maximum force on the lever",
        lambda p: p.lever_force[:, None],
        _LEVER,
        greatest=True,
        limit=lambda scene: getattr(lever_of(scene), "greatest_force", None),
    ),
    "max_actuator_pressure": Metric(
        "Pa",
        "maximum gauge pressure of the cylinder of the actuator",
        "Maximum pressure of the actuator",
        lambda p: p.actuator_pressure[:, None],
        _CYLINDER,
        greatest=True,
        limit=permissible_actuator_pressure,
    ),
    "lever_travel": Metric(
        "m",
        "maximum travel of the lever, from the released band of new linings",
        "Maximum travel of the lever",
        lambda p: p.slack_end_travel[:, None],
        _TRAVEL,
        greatest=True,
        number=lever_travel,
        limit=lambda scene: getattr(lever_of(scene), "greatest_travel", None),
    ),
    "max_drum_speed": Metric(
        "rad/s",
        "maximum speed of the drum, in either sense",
        "Maximum speed of the drum",
        lambda p: abs(p.y.omega)[:, None],
        greatest=True,
        mark=Mark(
            "overspeed",
            "the drum turns faster than its limit `max_drum_speed`",
            "every brake",
            "the shaft turns faster than permitted",
            "overspeed",
        ),
    ),
    "max_hook_speed": Metric(
        "m/s",
        "maximum speed of the hook, up or down",
        "Maximum speed of the hook",
        lambda p: abs(p.hook.speed)[:, None],
        _HOOK,
        greatest=True,
        mark=Mark(
            "hook_overspeed",
            "the hook is faster than its limit `max_hook_speed`",
            "every brake under a load on a hook",
            "the load moves faster than permitted",
            "overspeed of the load",
        ),
    ),
    "max_deceleration": Metric(
        "rad/s^2",
        "maximum deceleration of the pulley while it turns, 0 if it never slows",
        "Maximum deceleration of the pulley",
        lambda p: deceleration(p)[:, None],
        greatest=True,
        number=_at_least_0,
        mark=Mark(
            "hard_braking",
            "the pulley slows faster than its limit `max_deceleration`",
            "every brake",
            "the shaft slows faster than permitted",
            "too high a deceleration",
        ),
    ),
    "max_hook_deceleration": Metric(
        "m/s^2",
        "maximum deceleration of the load on a rigid rope while it moves, 0 if it "
        "never slows",
        "Maximum deceleration of the load",
        lambda p: p.hook.deceleration[:, None],
        RIGID_HOOK,
        greatest=True,
        number=_at_least_0,
        mark=Mark(
            "hard_braking_of_load",
            "the load slows faster than its limit `max_hook_deceleration`",
            "every brake under a load on a rigid rope",
            "the load slows faster than permitted",
            "too high a deceleration of the load",
        ),
    ),
    "max_rope_tension": Metric(
        "N",
        "maximum tension of the tightest line of the rope: hook load over lines "
        "strung, with a `TackleLoss` of the "
        "fast line in hoisting, of the dead line in lowering, at rest the larger one of both",
        "Maximum tension of the rope",
        lambda p: p.hook.rope[:, None],
        _HOOK,
        greatest=True,
        mark=Mark(
            "rope_overload",
            "a line of the rope bears more than its limit `max_rope_tension`",
            "every brake under a load on a hook",
            "the rope bears more than permitted",
            "overload of the rope",
        ),
    ),
    "max_fast_line_tension": Metric(
        "N",
        "maximum tension of the fast line, on the drum; at rest the largest that it can be",
        "Maximum tension of the fast line",
        lambda p: p.hook.fast[:, None],
        _TACKLE,
        greatest=True,
    ),
    "max_dead_line_tension": Metric(
        "N",
        "maximum tension of the dead line, at its anchor; at rest the largest that it can be",
        "Maximum tension of the dead line",
        lambda p: p.hook.dead[:, None],
        _TACKLE,
        greatest=True,
    ),
    "max_motor_power": Metric(
        "W",
        "maximum power of the motor, given or taken back",
        "Maximum power of the motor",
        lambda p: abs(p.flows.motor * p.y.omega)[:, None],
        _MOTOR,
        greatest=True,
    ),
    "peak_rim_temperature": _surface(
        "rim",
        "Hottest rim surface",
        "maximum surface temperature of the rim",
        mark=Mark(
            "permissible_rim_temperature",
            "the surface of the rim exceeded `Heat.permissible_rim`",
            "any brake with heat",
            "the rim exceeded its permissible temperature",
            "permissible temperature of the rim exceeded",
        ),
    ),
    "peak_lining_temperature": _surface(
        "linings",
        "Hottest lining surface",
        "maximum surface temperature of any lining",
        of_linings=True,
        mark=Mark(
            "permissible_temperature",
            "the surface of the linings (of lining `i`, where each has its own) "
            "exceeded `Heat.permissible`",
            "any brake with heat",
            "the linings exceeded their permissible temperature",
            "permissible temperature exceeded",
        ),
    ),
    "peak_band_temperature": _surface(
        "band",
        "Hottest band",
        "maximum temperature of the band",
        mark=Mark(
            "permissible_band_temperature",
            "the band exceeded `Heat.permissible_band`",
            "any brake with heat",
            "the band exceeded its permissible temperature",
            "permissible temperature of the band exceeded",
        ),
    ),
    "peak_lining_outer_temperature": _surface(
        "outer",
        "Hottest outer lining face",
        "maximum temperature of the outer faces of the linings",
        of_linings=True,
    ),
    "peak_wetted_temperature": Metric(
        "K",
        "maximum temperature of a wall that coolant wets",
        "Hottest wetted wall",
        lambda p: p.surfaces["wetted"],
        _JACKET,
        greatest=True,
        limit=lambda scene: scene.network.boiling,
        mark=Mark(
            "coolant_boils",
            "a wetted wall is as hot as its coolant boils, `Liquid.boiling`; from then "
            "on the run is no longer valid, as its coefficient is that of a liquid",
            "any brake with a `WaterJacket`",
            "the coolant boils at the wall",
            "coolant boils",
            limit=lambda scene: scene.network.boiling,
        ),
    ),
    "peak_coolant_temperature": Metric(
        "K",
        "maximum temperature of the coolant at the outlet of a jacket",
        "Hottest coolant at an outlet",
        coolant_outlet,
        _JACKET,
        greatest=True,
    ),
    **_energy("load_work", "work of the load", lambda a: a.ledger.load_work),
    **_energy(
        "rope_work",
        "work of the weight of ropes or chain",
        lambda a: a.ledger.ropes,
        _ROPES,
    ),
    **_energy("lever_work", "work of the lever", lambda a: a.ledger.lever_work),
    **_energy(
        "motor_work",
        "work of the motor, negative where it holds the load back",
        lambda a: a.ledger.motor,
        _MOTOR,
    ),
    **_energy("friction_heat", "friction heat", lambda a: a.friction.heat),
    **_energy("kinetic_change", "change of the kinetic energy", lambda a: a.kinetic),
    **_energy(
        "elastic_change", "change of the elastic energy", lambda a: a.elastic, _ELASTIC
    ),
    **_energy(
        "damper_heat", "heat of dampers", lambda a: a.ledger.damper_heat, _DAMPERS
    ),
    **_energy(
        "shaft_work",
        "heat of the other torques on the shaft",
        lambda a: a.shaft_work,
        _SHAFT,
    ),
    **_energy(
        "pick_up_heat",
        "energy lost as chain and anchor begin or end their motion",
        lambda a: a.ledger.pick_up,
        _GROUND,
    ),
    **_energy(
        "electrical_work",
        "electrical part of the friction work",
        lambda a: a.friction.electrical,
        _SHARES,
    ),
    **_energy(
        "mechanical_work",
        "mechanical part of the friction work",
        lambda a: a.friction.mechanical,
        _SHARES,
    ),
    **_energy(
        "heat_to_metal",
        "friction heat that entered the metal",
        lambda a: a.ledger.heat.to_metal,
        HEAT,
    ),
    **_energy(
        "heat_to_linings",
        "friction heat that entered the linings",
        lambda a: a.ledger.heat.to_linings,
        HEAT,
    ),
    **_energy(
        "heat_to_band",
        "friction heat that entered the band",
        lambda a: a.heat_to_band,
        HEAT,
    ),
    **_energy(
        "heat_elsewhere",
        "friction heat that enters no body: counted as lost",
        _elsewhere,
        HEAT,
    ),
    **_energy(
        "heat_supplied", "heat from sources", lambda a: a.ledger.heat.supplied, HEAT
    ),
    **_energy(
        "heat_stored", "heat stored in the network", lambda a: a.heat_stored, HEAT
    ),
    **_energy(
        "heat_lost",
        "heat lost to the surroundings",
        lambda a: a.ledger.heat.lost,
        HEAT,
    ),
    **_energy(
        "heat_to_coolant",
        "heat that the coolant of jackets carried away",
        lambda a: a.heat_to_coolant,
        _JACKET,
    ),
}
#: what the residual of a balance shows, and what it cannot show
RESIDUAL_SEES = (
    "it shows energy that is lost, not the errors in time, of the mesh, or of the model"
)
#: residuals of the balances of energies, which are no numbers of a run
RESIDUALS = {
    **_energy(
        "closure",
        "residual of the energy balance as a share of the largest energy exchanged; "
        f"{RESIDUAL_SEES}",
        _energy_closure,
        unit="1",
    ),
    **_energy(
        "heat_closure",
        f"residual of the heat balance as a share of the largest heat exchanged; {RESIDUAL_SEES}",
        lambda a: closure_of(
            a.friction.heat,
            a.shaft_work,
            a.ledger.heat.supplied,
            -a.heat_stored,
            -a.ledger.heat.lost,
            _taken(a.heat_to_coolant),
        ),
        HEAT,
        "1",
    ),
}
#: metric → place whose temperature it is
HOT = {name: metric.place for name, metric in METRICS.items() if metric.place}


# --- marks --------------------------------------------------------------------------

GRIP_LOST = Mark(
    "grip_lost",
    "sliding, while the lever is not being released, the brake no longer outweighs the load",
    "standard brake whose friction depends on temperature",
    "the sliding brake no longer outweighs the load",
    "grip lost",
)
#: grip is lost where the brake lacks more of the load's torque than this share of a
#: typical torque: a lever that holds the speed balances the load only to rounding
_ROUNDING = 1e-9


def _missing_torque(p: Probe) -> Array:
    """Torque (N·m) that a brake which slides ahead lacks to balance its load; below 0
    while the lever is released, as that is intended."""
    slides = (
        (p.mode.band == BandMode.SLIP) & (p.mode.sense > 0) & (p.flows.lever_rate >= 0)
    )
    return numpy_of(p.t).where(
        slides, p.flows.net_load - p.flows.contact.brake_torque, -1.0
    )[:, None]


def marks() -> list[Mark]:
    """All marks that a run can pass."""
    return [
        GRIP_LOST,
        *(metric.mark for metric in METRICS.values() if metric.mark is not None),
    ]


def marks_of(system: BrakeSystem, scene: Scene) -> dict[str, float]:
    """Marks that a run can pass, each with the limit of its quantity: by the name of
    its metric, or `grip_lost`."""
    limits = values_of_marks(scene)
    if not can_lose_grip(system):
        return limits
    return {GRIP_LOST.event: _ROUNDING * float(system.sizes.torque)} | limits


def marked_quantity(name: str, p: Probe) -> Float[Array, "m k"]:
    """The quantity of a mark of `marks_of`: of every lining where the event names the
    lining, else the maximum."""
    if name == GRIP_LOST.event:
        return _missing_torque(p)
    value = METRICS[name].find(p)
    if METRICS[name].of_linings:
        return value
    return numpy_of(value).max(value, axis=1, keepdims=True)


def event_of(name: str) -> str:
    """Name of the event of a mark of `marks_of`."""
    mark = METRICS[name].mark if name in METRICS else GRIP_LOST
    return mark.event  # pyright: ignore


# --- metrics by name ----------------------------------------------------------------


@jax.tree_util.register_pytree_with_keys_class
class ByName(dict[str, Any]):
    """A dictionary, also as a PyTree, that raises `KeyError` with the nearest names
    where one is missing.

    Example:
        >>> try:
        ...     result.energy["friction_heet"]
        ... except KeyError as error:
        ...     print(error.args[0])
        there is no 'friction_heet'; nearest: friction_heat
    """

    def __missing__(self, name: object) -> Any:
        hint = near(str(name), self) or f"; there are: {', '.join(self) or 'none'}"
        raise KeyError(f"there is no {name!r}{hint}")

    def tree_flatten_with_keys(self) -> tuple[list[tuple[Any, Any]], tuple[str, ...]]:
        names = tuple(sorted(self))
        return [(jax.tree_util.DictKey(name), self[name]) for name in names], names

    @classmethod
    def tree_unflatten(cls, names: tuple[str, ...], values: Sequence[Any]) -> "ByName":
        return cls(zip(names, values, strict=True))


def metrics_of(scene: Scene, *, greatest: bool) -> dict[str, Metric]:
    """Metrics of the runs of a scene, without energies: the maximum values, or all
    others."""
    return {
        name: metric
        for name, metric in METRICS.items()
        if metric.greatest == greatest
        and not (metric.energy or metric.if_asked)
        and (metric.shown_anyway or not metric.needs.lacks(scene))
    }


def identity_of(metric: str | Callable[..., Any]) -> object:
    """What a compiled program depends on: the name of one of simbrake's own metrics, or
    else the function."""
    entry = METRICS.get(metric) if isinstance(metric, str) else None
    if entry is None or entry.find.__module__.startswith("simbrake."):
        return metric
    return entry.find


@explained
def metric_names(scene: Scene) -> tuple[str, ...]:
    """Names of everything that a run of the scene has as one number, energies as
    `energy.…`.

    Example:
        >>> sb.results.metric_names(scene)[:3]
        ('slip_onset_time', 'full_slip_time', 'stopping_time')
    """
    # (of a scene whose numbers are yet to be checked as well)
    with np.errstate(all="ignore"):
        names = [
            name for name, metric in METRICS.items() if not metric.needs.lacks(scene)
        ]
    names += [
        f"energy.heat_{pair}" for pair in scene.brake.pairs if scene.brake.in_series
    ]
    return (*names, *(f"energy.shaft_{name}" for name in names_of(scene.shaft)))


def metric_of(name: str) -> Metric | None:
    """The metric of a name, also the friction heat of a pair (`energy.heat_…`) or the
    work of a torque on the shaft (`energy.shaft_…`), which `METRICS` does not list."""
    entry = METRICS.get(name) or RESIDUALS.get(name)
    if entry is not None or not name.startswith("energy."):
        return entry
    kind, _, whose = (energy := name.removeprefix("energy.")).partition("_")
    words = (
        f"work of the torque on the shaft {whose}"
        if kind == "shaft"
        else f"friction heat of the {whose} pair"
    )
    return _energy(energy, words, lambda a: None)[name]


def is_least(metric: str) -> bool:
    """Whether a limit of a metric is its least permissible value, not the greatest."""
    return metric.startswith("min_")


def is_of_size(metric: str) -> bool:
    """Whether a limit of a metric is that of its size, whatever its sign."""
    entry = METRICS.get(metric)
    return entry is not None and entry.of_size


def margin_to(limit: Any, metric: str, value: Any) -> Any:
    """How far a value is within its limit: `limit − value`, or `value − limit` of a
    least value, `limit − |value|` of a motion in either sense."""
    if is_least(metric):
        return value - limit
    return limit - (abs(value) if is_of_size(metric) else value)


def keeps(limit: Any, metric: str, value: Any) -> Any:
    """Whether a value is within its limit; what did not happen is not."""
    return np.isfinite(value) & (margin_to(limit, metric, value) >= 0)


def about_output(name: str) -> dict[str, str]:
    """Unit and meaning of a metric, or of the time (`…_time`) or lining (`…_lining`) of
    a maximum value."""
    if (entry := metric_of(name)) is not None:
        return {"units": entry.unit, "meaning": entry.meaning}
    value, _, what = name.rpartition("_")
    unit, words = {"time": ("s", "time"), "lining": ("1", "lining (from 1)")}[what]
    return {"units": unit, "meaning": f"{words} of the {METRICS[value].meaning}"}
