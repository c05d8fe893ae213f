"""The quantities that a run has at every instant: unit, meaning, how each is found, and
how figures draw it.

Series, files and tables take their columns from here; figures, means and maxima over a
run their quantities of linings.
"""

import functools
import operator
import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_args, get_origin

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Bool, Float, Int

from .._base._faults import Fault, InputError, input_error, near
from .._base._numbers import number, value_text
from .._base._table import Table, rows_table
from ..brakes.band import pressure_within
from ..hybrid.arrays import Array, NumberOrArray, VectorM, numpy_of
from ..physics._brake import BrakeSystem
from ..physics.heated import sensed, thermal_of
from ..physics.mechanism import PairNow
from ..thermal.heat import PowerShares
from .hook import slowing
from .probe import Probe, tension_before

#: a value of each lining at each time
EachLining = Float[Array, "m n"]
if TYPE_CHECKING:
    OfBand = Any  # code that knows that there is a band need not test for `None`
else:
    OfBand = VectorM | None


class Rubbing(NamedTuple):
    """One friction pair of every lining at one or many instants, (m, n) or (n,).

    `increment` is the friction at the radius of the slip: its power is
    `increment · v_i`. Under a band it is the difference of tensions,
    `|T_i − T_{i−1}| = f_i N_i/cos(β_i/2)`: the friction `f_i N_i` acts where the band's
    ends meet, at `R_b/cos(β_i/2)` (model §1).
    """

    increment: Array
    normal: Array
    speed: Array  # |v| ≥ 0, 0 while the lining sticks
    pressure: Array | None  # N/A, `None` without areas
    # seen by the pair's friction law, `None` without heat
    temperature: Array | None
    # T_i/T_{i−1} > 0, 1 without tension; `None` for a pair that is not under a band
    tension_ratio: Array | None = None

    @property
    def power(self) -> Array:
        """Friction power of each lining (W)."""
        return self.increment * self.speed

    def pressure_at(self, place: NumberOrArray | Array) -> Array | None:
        """Pressure (Pa) at a place within the linings, 0 at the edge towards the slack
        end of the band, 1 at the other; the mean where they are not under a band."""
        if self.pressure is None or self.tension_ratio is None:
            return self.pressure
        return pressure_within(self.pressure, self.tension_ratio, place)

    def edge_pressure(self, place: float) -> Array | None:
        """As `pressure_at`, but `None` for linings that are not under a band."""
        return None if self.tension_ratio is None else self.pressure_at(place)


class PairInProbe:
    """The friction pair numbered `i` of a brake in a probe: what its quantities are
    found from."""

    def __init__(self, system: BrakeSystem, p: Probe, i: int) -> None:
        self.system = system
        self.p = p
        self.i = i
        self.pair: PairNow = p.shown.pairs[i]

    @property
    def band(self) -> Any:
        """Forces of the brake, `None` where it has no band."""
        return None if self.p.shown.tension is None else self.p.flows.contact

    @property
    def shares(self) -> PowerShares | None:
        return self.system.grip.shares

    @property
    def heat_share(self) -> NumberOrArray:
        """Share of the friction work that is heat."""
        return 1.0 if self.shares is None else self.shares.heat

    @property
    def work(self) -> VectorM:
        """Friction work of the pair (J)."""
        return self.p.y.ledger.friction[self.i]

    @property
    def all_work(self) -> VectorM:
        """Friction work of all pairs (J)."""
        return sum_of(self.p.y.ledger.friction)

    @property
    def memory(self) -> Array | None:
        """States of the pair's friction law."""
        states = jax.tree.leaves(self.p.y.memory and self.p.y.memory[self.i])
        if len(states) > 1:
            return numpy_of(states[0]).stack(states, axis=1)
        return states[0] if states else None

    @property
    def surface(self) -> Array | None:
        """Surface temperatures of the linings where the pair rubs (K)."""
        outside = (
            self.system.mechanism.pairs[self.i].on_band and "outer" in self.p.surfaces
        )
        return self.p.surfaces.get("outer" if outside else "linings")

    @property
    def sensed(self) -> Array | None:
        """Temperatures that the friction law sees (K)."""
        if thermal_of(self.system) is None:
            return None
        T: Any = jax.vmap(lambda u: sensed(self.system, u)[self.i])(self.p.y.heat)
        return jnp.broadcast_to(T, self.pair.normal.shape)

    @functools.cached_property
    def rubbing(self) -> Rubbing:
        """Forces, slip speeds and pressures of the linings."""
        now = self.pair
        area = self.system.mechanism.pairs[self.i].area
        xp = numpy_of(self.pair.normal)
        pressure = None if area is None else now.normal / xp.asarray(area)
        ratio = None
        if self.i == 0 and self.p.shown.tension is not None:
            after = self.p.shown.tension
            before = tension_before(self.p.shown, self.p.flows.contact.slack_tension)
            tight = (after > 0) & (before > 0)
            ratio = xp.where(tight, after, 1.0) / xp.where(tight, before, 1.0)
        return Rubbing(abs(now.force), now.normal, abs(now.slip), pressure, None, ratio)


def _motor_power(s: PairInProbe) -> VectorM | None:
    motor = s.p.flows.motor
    return None if motor is None else -motor * s.p.y.omega


def _lever_force(s: PairInProbe) -> VectorM | None:
    """On the lever of a band, or on each pad or shoe."""
    return s.p.flows.contact.slack_tension if s.band is None else s.p.lever_force


def _reserve(s: PairInProbe) -> VectorM | None:
    """Static capacity over the load: not a number where there is no load, `None` where
    there never is."""
    load, capacity = s.p.holding
    xp = numpy_of(load)
    if xp is np and not np.any(load):
        return None
    return xp.where(load > 0, capacity / xp.where(load > 0, load, 1.0), np.nan)


def _coolant_heat(s: PairInProbe) -> Any:
    """Heat flow into the coolant at each wetted node (W)."""
    stream = s.p.flows.thermal and s.p.flows.thermal.coolant
    return stream and stream.heat


def coolant_outlet(p: Probe) -> Float[Array, "m jackets"] | None:
    """Temperature of the coolant where it leaves; where nothing flows, of the wall."""
    stream = p.flows.thermal and p.flows.thermal.coolant
    if stream is None:
        return None
    xp = numpy_of(stream.rate)
    flows = stream.rate > 0
    return xp.where(
        flows,
        stream.inlet + stream.heat / xp.where(flows, stream.rate, 1.0),
        p.surfaces["wetted"],
    )


def _nodes(s: PairInProbe) -> Float[Array, "m k"] | None:
    """Temperatures of all nodes."""
    now = s.p.flows.thermal
    if now is None:
        return None
    return numpy_of(now.T).concatenate([now.T, now.T_junctions], axis=1)


def sum_of(values: Iterable[Array | None]) -> Array:
    """Sum of those that are not `None`: of the friction work of all pairs, or of the
    wear of linings at all their faces."""
    return functools.reduce(operator.add, (x for x in values if x is not None))


def deceleration(p: Probe) -> VectorM:
    """Deceleration `−d|ω|/dt` (rad/s²) of the pulley, 0 at rest."""
    return slowing(p.mode, p.y.omega, p.flows.contact.alpha)


class SeriesColumn(NamedTuple):
    """A quantity over time: its unit (SI, "" for a number), its meaning, and how it is
    found.

    - `find`: gives it of a friction pair in a probe (`PairInProbe`), (m,) or (m, n);
      `None` where the run does not have it
    - `words`: of a quantity of linings, its name in figures; `like`: a value (SI) in
      whose unit they show it, by default that of brakes
    - `unsigned`: means, maxima and figures take its absolute value
    """

    unit: str
    meaning: str
    find: Callable[[Any], Any]
    words: str = ""
    like: float | None = None
    unsigned: bool = False

    def of(self, seen: PairInProbe) -> Any:
        """The quantity as means, maxima and figures take it."""
        value = self.find(seen)
        return abs(value) if self.unsigned and value is not None else value


# columns of `PairSeries` that `Series` has too, of the first pair
FrictionForce = Annotated[
    EachLining,
    "N",
    "friction force on each lining",
    lambda s: s.pair.friction,
    "friction force F",
]
FrictionCoefficient = Annotated[
    EachLining | None,
    "",
    "coefficient of friction of each lining, sliding",
    lambda s: s.pair.coefficient,
    "coefficient of friction f",
]
FrictionMemory = Annotated[
    Any,
    "",
    "state of the friction law of each lining (several: in the order of its PyTree)",
    lambda s: s.memory,
]
FrictionPower = Annotated[
    EachLining,
    "W",
    "friction power of each lining",
    lambda s: s.rubbing.power,
    "friction power",
]
MeanPressure = Annotated[
    EachLining | None,
    "Pa",
    "mean pressure on each lining",
    lambda s: s.rubbing.pressure,
    "pressure N/A",
]


class PairSeries(NamedTuple):
    """One friction pair at the times of a `Series`, SI units; arrays over its linings
    are (m, n).

    `None`: `capacity` where the mechanism does not tell, `friction_coefficient` where
    it cannot change, `worn_thickness` without wear of the pair, `friction_memory` of a
    law without states ((m, s, n) where it has several), pressures without areas, edge
    pressures and their ratio where no band presses, `temperature` without heat.

    Example:
        >>> float(result.series([0.5]).pairs["external"].torque[0].round(1))
        33659.3
    """

    normal_load: Annotated[
        EachLining,
        "N",
        "normal load on each lining, with preload and centrifugal force of a bandage",
        lambda s: s.pair.normal,
        "normal load N",
    ]
    friction_force: FrictionForce
    slip_speed: Annotated[
        EachLining,
        "m/s",
        "slip speed of each lining",
        lambda s: s.pair.slip,
        "slip speed |v|",
        None,
        True,
    ]
    sense: Annotated[
        Int[Array, "m n"],
        "",
        "0 the lining sticks, +1 and -1 it slides",
        lambda s: s.pair.sense,
    ]
    torque: Annotated[
        VectorM, "N*m", "torque that the pair passes on", lambda s: s.pair.torque
    ]
    friction_work: Annotated[
        VectorM, "J", "friction work since the start", lambda s: s.work
    ]
    heat: Annotated[
        VectorM,
        "J",
        "friction heat since the start",
        lambda s: s.heat_share * s.work,
    ]
    capacity: Annotated[
        VectorM | None,
        "N*m",
        "torque up to which the pair sticks, or with which it slides",
        lambda s: s.pair.capacity,
    ]
    friction_coefficient: FrictionCoefficient
    worn_thickness: Annotated[
        EachLining | None,
        "m",
        "thickness that each lining lost since the start",
        lambda s: s.p.y.worn and s.p.y.worn[s.i],
        "thickness worn off since the start",
        5e-6,
    ]
    friction_memory: FrictionMemory
    friction_power: FrictionPower
    tension_increment: Annotated[
        EachLining,
        "N",
        "friction of each lining at the radius of its slip, under a band |T_i - T_(i-1)|",
        lambda s: s.rubbing.increment,
        "tension increment |Tᵢ − Tᵢ₋₁|",
    ]
    pressure: MeanPressure
    slack_edge_pressure: Annotated[
        EachLining | None,
        "Pa",
        "pressure at the edge of each lining towards the slack end",
        lambda s: s.rubbing.edge_pressure(0.0),
        "pressure at the edge towards the slack end",
    ]
    tight_edge_pressure: Annotated[
        EachLining | None,
        "Pa",
        "pressure at the edge of each lining towards the tight end",
        lambda s: s.rubbing.edge_pressure(1.0),
        "pressure at the edge towards the tight end",
    ]
    edge_pressure_ratio: Annotated[
        EachLining | None,
        "",
        "pressure at the tight edge of each lining over that at the slack edge",
        lambda s: s.rubbing.tension_ratio,
        "tight over slack edge pressure",
    ]
    temperature: Annotated[
        Float[Array, "m l"] | None,
        "K",
        "surface temperature of the linings where the pair rubs",
        lambda s: s.surface,
        "surface temperature",
    ]


class Series(NamedTuple):
    """States and forces at the times `t` (m,), SI units; arrays over linings are (m,
    n).

    `pairs` has each friction pair by its name: the lever acts on `external`, whose
    normal loads, friction forces and coefficients are columns here as well; a staged
    brake also has `internal`. A column that the scene does not have is `None`: tensions
    without a band, temperatures without heat or where it names no such place,
    coefficients of friction that cannot change, the elongation of a rigid band, …

    On several alike rims (`Brake.rims`) tensions, forces, pressures, wear and the power
    of each lining are those of one rim; torques, works and heat are those of the brake.

    Example:
        >>> result.series([0.0, 0.5]).omega.shape
        (2,)
    """

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            meant = [
                column
                for column, about in SERIES_COLUMNS.items()
                if about.meaning.startswith(name)
            ]
            hint = (
                f"; nearest: {', '.join(meant)}"
                if meant
                else near(name, SERIES_COLUMNS)
            )
            raise AttributeError(f"'Series' object has no attribute {name!r}{hint}")

    t: Annotated[VectorM, "s", "time", lambda s: s.p.t]
    phi: Annotated[
        VectorM, "rad", "angle of the pulley since the start", lambda s: s.p.y.phi
    ]
    omega: Annotated[
        VectorM,
        "rad/s",
        "speed of the pulley, positive in the braking direction",
        lambda s: s.p.y.omega,
    ]
    elongation: Annotated[
        VectorM | None, "m", "elongation x of the band", lambda s: s.p.shown.elongation
    ]
    slack_tension: Annotated[
        OfBand,
        "N",
        "tension T_0 of the band at the slack (lever) end; of alike rims that of one, "
        "of unlike bands the sum",
        lambda s: s.band and s.band.slack_tension,
    ]
    tight_tension: Annotated[
        OfBand,
        "N",
        "tension T_n of the band at the tight (anchor) end; of alike rims that of one, "
        "of unlike bands the sum",
        lambda s: s.band and s.band.tight_tension,
    ]
    load_torque: Annotated[
        VectorM,
        "N*m",
        "torque of the load on the pulley",
        lambda s: s.p.flows.load_torque,
    ]
    shaft_torque: Annotated[
        VectorM | None,
        "N*m",
        "torque on the shaft beside load and brake, against the rotation",
        lambda s: s.p.flows.shaft and s.p.flows.shaft.total,
    ]
    shaft_work: Annotated[
        VectorM | None,
        "J",
        "heat of the torques on the shaft beside load and brake since the start",
        lambda s: s.p.y.ledger.shaft and sum_of(s.p.y.ledger.shaft),
    ]
    motor_torque: Annotated[
        VectorM | None,
        "N*m",
        "torque of the motor, against the braking direction",
        lambda s: s.p.flows.motor,
    ]
    motor_power: Annotated[
        VectorM | None,
        "W",
        "power of the motor, negative where it holds the load back",
        _motor_power,
    ]
    motor_work: Annotated[
        VectorM | None,
        "J",
        "work of the motor since the start",
        lambda s: s.p.y.ledger.motor,
    ]
    brake_torque: Annotated[
        VectorM,
        "N*m",
        "torque of the brake against the pulley",
        lambda s: s.p.flows.contact.brake_torque,
    ]
    slip_speed: Annotated[
        VectorM,
        "m/s",
        "speed of the track past the linings of the band",
        lambda s: s.p.flows.contact.slip_speed,
    ]
    at_limit: Annotated[
        Int[Array, " m"],
        "",
        "number of linings at their limit of friction",
        lambda s: s.pair.at_limit.sum(axis=1),
    ]
    band_mode: Annotated[
        Int[Array, " m"],
        "",
        "0 open, 1 take-up, 2 elastic, 3 full slip, 4 full slip the other way, 5 held",
        lambda s: s.p.mode.band,
    ]
    rope_layer: Annotated[
        Int[Array, " m"] | None,
        "",
        "layer of the rope on the drum that pays out, from 1",
        lambda s: s.p.mode.layer,
    ]
    load_work: Annotated[
        VectorM,
        "J",
        "work of the load since the start",
        lambda s: s.p.y.ledger.load_work,
    ]
    rope_work: Annotated[
        VectorM | None,
        "J",
        "work of the weight of ropes or chain since the start",
        lambda s: s.p.y.ledger.ropes,
    ]
    pick_up_heat: Annotated[
        VectorM | None,
        "J",
        "energy lost since the start as chain and anchor begin or end their motion",
        lambda s: s.p.y.ledger.pick_up,
    ]
    lever_work: Annotated[
        VectorM,
        "J",
        "work of the lever since the start",
        lambda s: s.p.y.ledger.lever_work,
    ]
    friction_heat: Annotated[
        VectorM,
        "J",
        "friction heat since the start",
        lambda s: s.heat_share * s.all_work,
    ]
    tension: Annotated[
        EachLining | None,
        "N",
        "tension of the band behind each lining, counted from the slack end",
        lambda s: s.p.shown.tension,
        "tension T behind the lining",
    ]
    lever_force: Annotated[
        VectorM | None,
        "N",
        "force of the actuator on each pad or shoe, or on the lever of a band",
        _lever_force,
    ]
    actuator_pressure: Annotated[
        VectorM | None,
        "Pa",
        "gauge pressure of the cylinder of the actuator",
        lambda s: s.p.actuator_pressure,
    ]
    normal_load: Annotated[
        EachLining, "N", "normal load on each lining", lambda s: s.pair.normal
    ]
    friction_force: FrictionForce
    temperature: Annotated[
        Float[Array, "m k"] | None,
        "K",
        "temperature of every thermal node",
        _nodes,
    ]
    rim_temperature: Annotated[
        Float[Array, "m r"] | None,
        "K",
        "surface temperature of the rim",
        lambda s: s.p.surfaces.get("rim"),
    ]
    lining_temperature: Annotated[
        Float[Array, "m l"] | None,
        "K",
        "surface temperature of the linings",
        lambda s: s.p.surfaces.get("linings"),
    ]
    band_temperature: Annotated[
        Float[Array, "m b"] | None,
        "K",
        "temperature of the band",
        lambda s: s.p.surfaces.get("band"),
    ]
    heat_lost: Annotated[
        VectorM | None,
        "J",
        "heat lost to the surroundings since the start",
        lambda s: s.p.y.ledger.heat and s.p.y.ledger.heat.lost,
    ]
    heat_to_coolant: Annotated[
        VectorM | None,
        "J",
        "heat that the coolant of all jackets carried away since the start",
        lambda s: s.p.y.ledger.heat and s.p.y.ledger.heat.coolant,
    ]
    coolant_heat_flow: Annotated[
        Float[Array, "m jackets"] | None,
        "W",
        "heat flow into the coolant of each jacket",
        _coolant_heat,
    ]
    coolant_temperature: Annotated[
        Float[Array, "m jackets"] | None,
        "K",
        "temperature of the coolant at the outlet",
        lambda s: coolant_outlet(s.p),
    ]
    wetted_temperature: Annotated[
        Float[Array, "m jackets"] | None,
        "K",
        "temperature of the wall that the coolant wets",
        lambda s: s.p.surfaces.get("wetted"),
    ]
    friction_coefficient: FrictionCoefficient
    lining_outer_temperature: Annotated[
        Float[Array, "m o"] | None,
        "K",
        "temperature of the outer faces of the linings",
        lambda s: s.p.surfaces.get("outer"),
    ]
    bandage_speed: Annotated[
        VectorM | None,
        "rad/s",
        "speed of the bandage (the mean of the linings where each has its own)",
        lambda s: s.p.shown.bandage_speed,
    ]
    lining_speed: Annotated[
        EachLining | None,
        "rad/s",
        "speed of each lining",
        lambda s: s.p.shown.lining_speed,
    ]
    displacement: Annotated[
        EachLining | None,
        "m",
        "displacement of each lining along the band circle",
        lambda s: s.p.shown.displacement,
        "displacement u along the band",
        5e-3,
    ]
    damper_heat: Annotated[
        VectorM | None,
        "J",
        "heat of dampers since the start",
        lambda s: s.p.y.ledger.damper_heat,
    ]
    electrical_work: Annotated[
        VectorM | None,
        "J",
        "electrical part of the friction work since the start",
        lambda s: s.shares and s.shares.electrical * s.all_work,
    ]
    mechanical_work: Annotated[
        VectorM | None,
        "J",
        "mechanical part of the friction work since the start",
        lambda s: s.shares and s.shares.mechanical * s.all_work,
    ]
    worn_thickness: Annotated[
        EachLining | None,
        "m",
        "thickness that each lining lost since the start",
        lambda s: s.p.y.worn and sum_of(s.p.y.worn),
    ]
    friction_memory: FrictionMemory
    hook_position: Annotated[
        VectorM | None,
        "m",
        "travel of the hook downwards since the start",
        lambda s: s.p.hook and s.p.hook.travel,
    ]
    hook_speed: Annotated[
        VectorM | None,
        "m/s",
        "speed of the hook, positive downwards",
        lambda s: s.p.hook and s.p.hook.speed,
    ]
    deceleration: Annotated[
        VectorM,
        "rad/s^2",
        "deceleration −d|ω|/dt of the pulley, positive while it slows, 0 at rest",
        lambda s: deceleration(s.p),
    ]
    hook_deceleration: Annotated[
        VectorM | None,
        "m/s^2",
        "deceleration −d|v|/dt of the hook, positive while it slows",
        lambda s: s.p.hook and s.p.hook.deceleration,
    ]
    hook_load: Annotated[
        VectorM | None,
        "N",
        "force on the hook, weight less inertia",
        lambda s: s.p.hook and s.p.hook.force,
    ]
    rope_tension: Annotated[
        VectorM | None,
        "N",
        "tension of the tightest line of the rope: hook load over lines strung; with a "
        "`TackleLoss` of the fast line "
        "in hoisting, of the dead line in lowering, at rest the larger one of both",
        lambda s: s.p.hook and s.p.hook.rope,
    ]
    fast_line_tension: Annotated[
        VectorM | None,
        "N",
        "tension of the line on the drum, with a `TackleLoss`; at rest the largest that it can be",
        lambda s: s.p.hook and s.p.hook.fast,
    ]
    dead_line_tension: Annotated[
        VectorM | None,
        "N",
        "tension of the line at the dead-line anchor, with a `TackleLoss`; at rest the "
        "largest that it can be",
        lambda s: s.p.hook and s.p.hook.dead,
    ]
    rope_stretch: Annotated[
        VectorM | None,
        "m",
        "stretch of the elastic rope at the hook, below 0: slack by that",
        lambda s: s.p.hook and s.p.hook.stretch,
    ]
    holding_reserve: Annotated[
        VectorM | None,
        "",
        "static capacity of the brake over the load on a pulley at rest, under the "
        "tension of that instant, of a lever that follows the speed under its limit",
        _reserve,
    ]
    friction_power: FrictionPower
    pressure: MeanPressure
    pairs: dict[str, PairSeries]

    @property
    def friction_work(self) -> VectorM:
        """Friction work (J): heat, and the electrical and mechanical parts where the
        scene has them."""
        if self.electrical_work is None or self.mechanical_work is None:
            return self.friction_heat
        return self.friction_heat + self.electrical_work + self.mechanical_work

    def _table(self) -> Table:
        columns = [
            (name, getattr(self, name), about.unit, about.meaning)
            for name, about in SERIES_COLUMNS.items()
        ]
        pairs = ""
        if len(self.pairs) > 1:
            first = next(iter(self.pairs))
            pairs = f"; pairs {', '.join(self.pairs)}, as pairs[{first!r}]"
        return ranges(columns, f"Series at {np.shape(self.t)[0]} times{pairs}")

    def __repr__(self) -> str:
        return str(self._table())

    def _repr_html_(self) -> str:
        return self._table()._repr_html_()


def ranges(columns: Iterable[tuple[str, Any, str, str]], title: str) -> Table:
    """Names, ranges and meanings of columns, of which name, values, unit and meaning
    are given; those without values are left out."""
    rows = [
        (name, _range(values, unit), meaning)
        for name, values, unit, meaning in columns
        if values is not None
    ]
    return rows_table(rows, title)


def _range(values: Any, unit: str) -> str:
    """Range of a column with its unit, and the shape of its values at each time."""
    if isinstance(values, Tracer | tuple):
        return value_text(values)
    array = np.asarray(values)
    finite = array[np.isfinite(array)]
    shape = " × ".join(map(str, array.shape[1:]))
    each = f" ({shape} each)" if shape else ""
    if not finite.size:
        return f"—{each}"
    low = float(finite.min())
    high = float(finite.max())
    if low == high:
        return f"{number(low, unit)}{each}"
    top = max(abs(low), abs(high))
    return (
        f"{number(low, unit, beside=top).text} … {number(high, unit, beside=top)}{each}"
    )


def _columns_in(series: type) -> dict[str, SeriesColumn]:
    """The columns that the annotations of `Series` or `PairSeries` describe."""
    return {
        name: SeriesColumn(*get_args(hint)[1:])
        for name, hint in series.__annotations__.items()
        if get_origin(hint) is Annotated
    }


SERIES_COLUMNS = _columns_in(Series)
PAIR_COLUMNS = _columns_in(PairSeries)
#: quantities of linings, which have means, maxima and maps
LINING_QUANTITIES = {
    name: about
    for name, about in {**SERIES_COLUMNS, **PAIR_COLUMNS}.items()
    if about.words
}


def series_of(p: Probe, system: BrakeSystem) -> Series:
    """All columns of a probe."""
    pairs = [PairInProbe(system, p, i) for i in range(len(system.pair_names))]

    def find(columns: dict[str, SeriesColumn], pair: PairInProbe) -> dict[str, Any]:
        return {name: column.find(pair) for name, column in columns.items()}

    each = [PairSeries(**find(PAIR_COLUMNS, pair)) for pair in pairs]
    return Series(
        **find(SERIES_COLUMNS, pairs[0]),
        pairs=dict(zip(system.pair_names, each, strict=True)),
    )


_OF_PAIR = re.compile(rf"(?P<pair>[a-z][a-z_]*?)_(?P<column>{'|'.join(PAIR_COLUMNS)})")


def pair_column(name: str) -> tuple[str, str] | None:
    """Friction pair and column of a name as `internal_torque`, `None` for any other
    name."""
    match = None if name in SERIES_COLUMNS else _OF_PAIR.fullmatch(name)
    return None if match is None else (match["pair"], match["column"])


def about_column(name: str) -> SeriesColumn:
    """Unit and meaning of a column of `columns_by_name`."""
    if (of_pair := pair_column(name)) is None:
        return SERIES_COLUMNS[name]
    pair, column = of_pair
    about = PAIR_COLUMNS[column]
    return about._replace(meaning=f"{pair} pair: {about.meaning}")


def columns_by_name(series: Series, *, pairs: bool) -> dict[str, Any]:
    """The columns that a series has, by name.

    - `pairs`: also those of every friction pair, with names as `internal_torque`
    """
    by_name = {name: getattr(series, name) for name in SERIES_COLUMNS}
    if pairs:
        for pair, columns in series.pairs.items():
            by_name |= {
                f"{pair}_{name}": values for name, values in columns._asdict().items()
            }
    return {name: values for name, values in by_name.items() if values is not None}


# --- times --------------------------------------------------------------------------


def outside(ts: Array, start: NumberOrArray, end: NumberOrArray) -> Bool[Array, " m"]:
    """Whether times `ts` are outside a run from `start` to `end` by more than
    rounding."""
    rounding = 1e-9 * (end - start) + 1e-15 * (abs(start) + abs(end))
    # written so that a NaN is outside
    return ~((ts >= start - rounding) & (ts <= end + rounding))


def fault_of_times(
    ts: np.ndarray, start: float, end: float, path: str, hint: str = ""
) -> Fault | None:
    """Error of times outside a run, `None` if all are inside."""
    bad = ts[outside(ts, start, end)]
    if not bad.size:
        return None
    more = f" (and {bad.size - 1} more of {ts.size} times)" if bad.size > 1 else ""
    return Fault(
        path,
        f"{bad[0]:g} s is outside the run{more}",
        f"between {start:g} and {end:g} s{hint}",
    )


def array_of_times(ts: Any, path: str) -> np.ndarray:
    """Times (m,) of a list, an array or one number. Raises `InputError` for anything
    else, and for no times."""
    try:
        times = np.atleast_1d(np.asarray(ts, np.float64))
    except (TypeError, ValueError):
        raise input_error(path, f"{ts!r} are not numbers", "times in s") from None
    if times.ndim != 1 or not times.size:
        raise input_error(
            path, f"have the shape {times.shape}", "one time in s, or a list of times"
        )
    return times


def times_within(
    ts: Any, start: float, end: float, path: str, hint: str = ""
) -> np.ndarray:
    """Times (m,) in a run; times outside by rounding alone are moved to its ends.
    Raises `InputError` for times further outside."""
    times = array_of_times(ts, path)
    if fault := fault_of_times(times, start, end, path, hint):
        raise InputError([fault])
    return np.clip(times, start, end)
