"""Friction pairs lining by lining: forces and contact at any time, and sums over a
run."""

import enum
import itertools
import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree
from numpy.polynomial import legendre

from .._base._arguments import explained
from .._base._faults import Fault, InputError, Issues, input_error
from .._base._part import Whole, quantity, takes_values
from .._base._quantity import Scalar, as_number
from ..brakes.design import AbstractBrake, under_a_band
from ..hybrid import SKIPPED, Record
from ..hybrid.arrays import Array, NumberOrArray, Vector
from ..hybrid.struct import Struct, structural
from ..outputs.extremes import peak_of_each
from ..outputs.probe import POINTS, Probe, as_tree, integral, probe_many
from ..outputs.programs import record_of
from ..outputs.quantities import LINING_QUANTITIES, PairInProbe, Rubbing, SeriesColumn
from ..physics._brake import BrakeSystem
from ..physics.heated import thermal_of
from .result import Result, look, require_one

#: wear rate `I` (m³/(N·m)): a number, one per lining, or a function `I(p, v, T)` of
#: pressure, slip speed, temperature
WearRate = NumberOrArray | Callable[..., Any]
#: a result, or its record
Run = Result | Record
#: a quantity of linings that only maps have, as it is summed over their cells
FRICTION_HEAT = "friction_heat"
ABOUT_HEAT = SeriesColumn("J", "", lambda _: None, "friction heat since the start")


def fault_of_pair(pair: str, pairs: Iterable[str]) -> Fault | None:
    """Error of the name of a friction pair in a brake with these `pairs`."""
    names = list(pairs)
    if pair in names:
        return None
    return Fault(
        "pair", f"the brake has no {pair!r} pair", f"it has: {', '.join(names)}"
    )


def rubbing(record: Record, p: Probe, *, pair: str = "external") -> Rubbing:
    """Forces, slip speeds, pressures and temperatures of the linings in a probe.

    - `pair`: its name; the lever acts on `external`, in a staged brake band on linings;
      a staged brake also has `internal`, linings on rim

    Raises `InputError` for a pair that the brake does not have.

    Example:
        >>> way = sb.results.integral(result, lambda p: sb.results.rubbing(result.record, p).speed)
        >>> round(float(way[0]) / float(result["stopping_angle"]), 4)
        0.623
    """
    system = _system(record)
    if fault := fault_of_pair(pair, system.pair_names):
        raise InputError([fault])
    seen = _seen(system, p, pair)
    return seen.rubbing._replace(temperature=seen.sensed)


#: weights of means
WEIGHTS: dict[str, Callable[[Rubbing], Any]] = {
    "time": lambda r: jnp.ones_like(r.speed),
    "slip": lambda r: r.speed,
    "work": lambda r: r.power,
}

#: quantities that linings have only under a band, and those of the band as a whole,
#: which only its own pair has
_OF_EDGES = ("slack_edge_pressure", "tight_edge_pressure", "edge_pressure_ratio")
_OF_BAND = ("tension", "displacement", *_OF_EDGES)


def wearing(
    rate: WearRate, r: Rubbing, place: NumberOrArray | Array | None = None
) -> Array:
    """Rate of wear `ḣ = I p v` (m/s) of linings; `rate` and `place` as in
    `lining_wear`."""
    pressure = r.pressure if place is None else r.pressure_at(place)
    value: Any = (
        rate(pressure, r.speed, r.temperature) if callable(rate) else jnp.asarray(rate)
    )
    return value * pressure * r.speed


class _Weighted(Struct):
    """Integrand of `integral`: a quantity of linings times a weight, and the weight.

    A PyTree, as `_WearRate`, so that it compiles once for each structure.
    """

    record: Record
    pair: str = structural()
    quantity: str = structural()
    over: str = structural()

    def __call__(self, p: Probe) -> PyTree:
        seen = _seen(_system(self.record), p, self.pair)
        weight = WEIGHTS[self.over](seen.rubbing)
        return weight * _each(seen, self.quantity), weight


class _WearRate(Struct):
    """Integrand of `integral`: the rate of wear."""

    record: Record
    rate: Any
    place: Any
    pair: str = structural()

    def __call__(self, p: Probe) -> PyTree:
        return wearing(self.rate, rubbing(self.record, p, pair=self.pair), self.place)


def _system(run: Run) -> BrakeSystem:
    return getattr(run, "record", run).system  # pyright: ignore


def _seen(system: BrakeSystem, p: Probe, pair: str) -> PairInProbe:
    return PairInProbe(system, p, system.pair_names.index(pair))


def _value(seen: PairInProbe, quantity: str) -> Any:
    """A quantity of the linings. Raises `InputError` where the run does not have
    it."""
    value = LINING_QUANTITIES[quantity].of(seen)
    if value is None:
        raise InputError([_absent(seen.system, quantity)])
    return value


def _each(seen: PairInProbe, quantity: str) -> Array:
    """A quantity of every lining, also where all of them share it."""
    return jnp.broadcast_to(_value(seen, quantity), seen.pair.normal.shape)


def _check(
    run: Run,
    pair: str,
    quantity: str = "slip_speed",
    *,
    over: str = "time",
    quantities: Iterable[str] = LINING_QUANTITIES,
) -> None:
    """Raises `InputError` for a pair, a quantity or a weight that the run does not
    have."""
    system = _system(run)
    missing = fault_of_pair(pair, system.pair_names)
    faults = Issues() if missing is None else Issues([missing])
    if over not in WEIGHTS:
        faults.add("over", f"{over!r} is no weight", f"there are: {', '.join(WEIGHTS)}")
    if quantity not in quantities:
        faults.add(
            "quantity", f"{quantity!r} is none", f"there are: {', '.join(quantities)}"
        )
    if missing is None and quantity in _OF_BAND and pair != system.pair_names[0]:
        what = f"{quantity} is of the band, not of the {pair} pair"
        faults.add("pair", what, "leave it out")
    if quantity in _OF_EDGES and not system.mechanism.banded:
        what = f"{quantity} is of linings under a band"
        faults.add("quantity", what, "look at their pressure")
    if quantity.endswith("pressure") and not faults:
        friction_pair = system.mechanism.pairs[system.pair_names.index(pair)]
        if friction_pair.area is None:
            path = f"brake.{friction_pair.field}.area"
            faults.add(path, "is missing", "a pressure is looked at")
    faults.report()


# --- over a run ---------------------------------------------------------------------


@explained
def friction_work(run: Run, *, pair: str = "external", points: int = POINTS) -> Vector:
    """Friction work of every lining over a run, in J.

        W_i = ∫ |T_i − T_{i−1}| |v_i| dt,   |T_i − T_{i−1}| = f_i N_i/cos(β_i/2)                       (model §1, §6.1)

    Its sum, over all alike rims, is the friction heat of the pair in the ledger, less
    the heat of jumps (restart, break-away, release of an elastic band), which is booked
    at an instant for the band as a whole and belongs to no lining.

    - `run`: a `Result` or its record, concrete or traced
    - `pair`: as in `rubbing`
    - `points`: as in `integral`

    Raises `InputError` for a pair that the brake does not have.

    Example:
        >>> len(sb.results.friction_work(result))
        8
    """
    _check(run, pair)
    record = record_of(run)
    integrand = _Weighted(record, pair, "friction_power", "time")
    return integral(record, integrand, points=points)[0]


@explained
def lining_wear(
    run: Run,
    rate: WearRate,
    *,
    pair: str = "external",
    place: NumberOrArray | None = None,
    points: int = POINTS,
) -> Vector:
    """Depth worn off every lining over a run, in m (model §7; Archard).

        h_i = ∫ I(p_i, v_i, T_i) p_i v_i dt,   p_i = N_i/A_i

    - `rate` `I` (m³/(N·m) = m²/N): a number, one per lining, or a function of pressure
      (Pa), slip speed (m/s) and the temperature (K) that the pair's friction law sees
      (`None` without heat), each (m, n); use one function again, as each compiles anew,
      or a `jax.tree_util.Partial` or an `equinox.Module` with its numbers as leaves
    - `place` within every lining, with the pressure there (`brakes.pressure_within`): 0
      its edge towards the slack end of the band, 1 that towards the tight end; `None`:
      with its mean pressure

    The wear does not act back on the run. Raises `InputError` where the areas are
    missing.

    Reference: J. F. Archard, *J. Appl. Phys.* 24 (1953) 981.

    Example:
        >>> linings = sb.uniform_linings(8, "270 deg", 0.35, area=0.05)
        >>> brake = sb.Brake(scene.brake.pulley, scene.brake.band, linings)
        >>> run = sb.simulate(sb.Scene(brake, scene.duty, scene.initial, 4.0))
        >>> [round(1e6 * float(h), 4) for h in sb.results.lining_wear(run, 5e-14)[[0, -1]]]
        [0.0733, 0.3258]
    """
    _check(run, pair, "pressure" if place is None else "tight_edge_pressure")
    record = record_of(run)
    rate = as_tree(rate) if callable(rate) else jnp.asarray(as_number(rate))
    place = None if place is None else jnp.asarray(place)
    return integral(record, _WearRate(record, rate, place, pair), points=points)


@explained
def lining_mean(
    run: Run,
    quantity: str,
    *,
    over: str = "slip",
    pair: str = "external",
    points: int = POINTS,
) -> Vector:
    """Mean of a quantity of every lining over a run, `∫ q w dt/∫ w dt`.

    - `quantity`: `tension_increment` `|T_i − T_{i−1}|` (N), `normal_load` `N_i` (N),
      `pressure` `N_i/A_i` (Pa), `slack_edge_pressure`, `tight_edge_pressure` (Pa,
      `brakes.pressure_within`) and their `edge_pressure_ratio` `T_i/T_{i−1}`,
      `slip_speed` (m/s), `friction_power` (W)
    - `over`: the weight `w`: `time` 1, `slip` `|v_i|` (the mean over the distance that
      the lining rubs), `work` the lining's own friction power

    `nan` where the weight is 0 throughout. With an elastic band the mean over time
    looks at the time before full slip as well, where linings come to their limit one by
    one inside a step: there the quadrature converges slowly.

    Example:
        >>> [round(float(x)) for x in sb.results.lining_mean(result, "normal_load")[[0, -1]]]
        [7794, 34654]
    """
    _check(run, pair, quantity, over=over)
    record = record_of(run)
    integrand = _Weighted(record, pair, quantity, over)
    above, below = integral(record, integrand, points=points)
    return above / below


class _OfEachLining(NamedTuple):
    """A quantity of every lining of a pair, at one instant."""

    pair: str
    quantity: str

    def __call__(self, system: BrakeSystem, p: Probe) -> Array:
        return _each(_seen(system, p, self.pair), self.quantity)


@explained
def lining_peak(run: Run, quantity: str, *, pair: str = "external") -> Vector:
    """Maximum value over a run of a quantity of every lining (`quantity` and `pair` as
    in `lining_mean`).

    Example:
        >>> sb.results.lining_peak(result, "normal_load").shape
        (8,)
    """
    _check(run, pair, quantity)
    return peak_of_each(record_of(run), _OfEachLining(pair, quantity))


# --- contact and load of every lining -----------------------------------------------


class Contact(enum.IntEnum):
    """Contact of a lining with its partner."""

    SLIDES_BACK = 0  # against the direction of `SLIDES`
    FREE = 1  # nothing presses it
    STICKS = 2
    AT_LIMIT = 3  # still moves with its partner, but its friction is used up
    SLIDES = 4


CONTACT_WORDS = {
    Contact.SLIDES: "slides",
    Contact.AT_LIMIT: "at its friction limit",
    Contact.STICKS: "sticks",
    Contact.SLIDES_BACK: "slides back",
    Contact.FREE: "not pressed",
}


def lining_contacts(result: Result, p: Probe) -> dict[str, np.ndarray]:
    """Contact of every lining in each friction pair, (m, n) `Contact`s by the names of
    the pairs.

    Where the linings act as one, those at their limit while the band is elastic follow
    from the mobilisation rule (model §3).
    """
    contacts = {}
    for name, now in zip(_system(result).pair_names, p.shown.pairs, strict=True):
        stays = np.where(now.at_limit, Contact.AT_LIMIT, Contact.STICKS)
        moves = np.where(now.sense > 0, Contact.SLIDES, Contact.SLIDES_BACK)
        contacts[name] = np.where(
            now.normal > 0, np.where(now.sense == 0, stays, moves), Contact.FREE
        )
    return contacts


def lining_values(
    result: Result, quantity: str, edges: Any, *, pair: str = "external"
) -> np.ndarray:
    """A quantity of every lining in SI units in the cells between `edges` (s), (cells,
    n) or (cells, 1).

    The value in the middle of each cell; of `friction_heat` that at its end, by the
    midpoint rule. There is one column where all linings share a surface.

    Raises `InputError` for what the run does not have.
    """
    edges = np.asarray(edges, np.float64)
    _check(result, pair, quantity, quantities=[*LINING_QUANTITIES, FRICTION_HEAT])
    p = look(result, 0.5 * (edges[1:] + edges[:-1]))
    seen = _seen(_system(result), p, pair)
    if quantity != FRICTION_HEAT:
        return np.asarray(_value(seen, quantity))
    heating = float(seen.heat_share) * np.asarray(seen.rubbing.power)
    return np.cumsum(heating * np.diff(edges)[:, None], axis=0)


def _absent(system: BrakeSystem, quantity: str) -> Fault:
    """Why a run has no such quantity."""
    cold = thermal_of(system) is None
    no_band = ("the brake has no band", "look at its normal_load")
    why = {
        "temperature": (
            "the scene has no heat"
            if cold
            else "the heat of the scene names no linings",
            "there are no temperatures of linings to look at",
        ),
        "friction_coefficient": (
            "the scene has no heat"
            if cold
            else "no friction heats a body of the scene",
            "the coefficient of friction is of interest where it fades",
        ),
        "displacement": (
            "only linings of a chain have a displacement",
            "give brake.band.segments",
        ),
        "tension": no_band,
        "worn_thickness": ("the scene has no wear of that pair", "give it a `Wear`"),
    }
    return Fault("quantity", *why.get(quantity, no_band))


# --- overlap coefficients -----------------------------------------------------------


class RunningIn(Struct):
    """Contact that grows with the friction work `W` of a pair, as surfaces wear into
    one another (after K).

        c(W) = 1 − (1 − c_0) exp(−W/W_0)

    - `start` `c_0`: nominal area initially in contact, as a share; `work` `W_0` (J)
      after which 63 % of the rest is won

    Example:
        >>> round(float(sb.results.RunningIn(0.4, "2 MJ").share(2e6)), 4)
        0.7793
    """

    start: Scalar = quantity("1", "share initially in contact", low=0.0, high=1.0)
    work: Scalar = quantity("J", "friction work of running-in", positive=True)

    def share(self, W: Any) -> Any:
        return 1 - (1 - np.asarray(self.start)) * np.exp(
            -np.asarray(W) / np.asarray(self.work)
        )


class Overlap(NamedTuple):
    """Overlap coefficients at the times `t` (s); a standard brake has only those of
    linings on rim, the internal ones.

    Dynamic: share of the track area whose pair slides; static: share whose pair sticks
    (K, Fig. 5, in our reading).

    Example:
        >>> sb.results.overlap(result, [0.0, 0.5]).internal_static
        array([0., 0.])
    """

    t: Float[np.ndarray, " m"]
    external_dynamic: Float[np.ndarray, " m"] | None
    external_static: Float[np.ndarray, " m"] | None
    internal_dynamic: Float[np.ndarray, " m"]
    internal_static: Float[np.ndarray, " m"]


@explained
def geometric_overlap(brake: AbstractBrake) -> tuple[float | None, float]:
    """`Σ A_i/A_track` of the external pair (`None` on a standard brake) and of linings
    and rim; about 0.75 (S).

    Without areas or the rim's width the linings are taken to be as wide as the track:
    `Σ β_i/2π`. Raises `InputError` for a brake without a band.

    Example:
        >>> external, internal = sb.results.geometric_overlap(scene.brake)
        >>> external is None, round(internal, 4)
        (True, 0.75)
    """
    brake = under_a_band(brake)
    n = brake.linings.count
    width = brake.pulley.width
    wrap = float(brake.linings.wrap) / (2 * math.pi)

    def share(area: Any, radius: Any) -> float:
        if area is None or width is None:
            return wrap
        return float(
            np.sum(np.broadcast_to(np.asarray(area), (n,)))
            / (2 * math.pi * radius * np.asarray(width))
        )

    # the last pair rubs on the rim; of two the first rubs on the band
    *outer, inner = (brake.rubbing_part(pair).area for pair in brake.pairs)
    internal = share(inner, brake.pulley.radius)
    return share(outer[0], brake.band.radius) if outer else None, internal


@explained
def overlap(result: Result, ts: Any, running_in: RunningIn | None = None) -> Overlap:
    """Overlap coefficients of a concrete result at the times `ts` (m,), optionally with
    contact that grows by wear.

    Raises `InputError` for times outside the run, and for a brake without a band.

    Example:
        >>> sb.results.overlap(result, [0.0, 0.5]).internal_dynamic.round(4)
        array([0.75, 0.75])
    """
    s = result.series(ts)
    nominal: Any = geometric_overlap(result.scene.brake)[-len(s.pairs) :]
    coefficients: list[tuple[Any, ...]] = [(None, None)]
    for pair, share in zip(s.pairs.values(), nominal, strict=True):
        grown = 1.0 if running_in is None else running_in.share(pair.friction_work)
        # linings of a bandage touch the rim while band and interference outweigh the
        # centrifugal force
        touches = np.asarray(pair.normal_load) > 0
        slides = np.asarray(pair.sense) != 0
        coefficients.append(
            tuple(
                share * grown * np.mean(touches & each, axis=1)
                for each in (slides, ~slides)
            )
        )
    *_, external, internal = coefficients
    return Overlap(np.asarray(s.t), *external, *internal)


# --- wear of the ring ---------------------------------------------------------------


#: Gauss–Legendre points in every step, through which speed and wear rates are
#: polynomials
_GAUSS = 12
_NODES, _GAUSS_WEIGHTS = (np.asarray(x) for x in legendre.leggauss(_GAUSS))
_TO_SERIES = np.linalg.inv(legendre.legvander(_NODES, _GAUSS - 1))
#: bisections of a step, after which a place in it is known to rounding
_HALVINGS = 55


class RingWear(NamedTuple):
    """Depth worn off the linings of a ring that travels under the band.

    - `travel` `ψ` (rad) in the run
    - `depth` (m,) of each lining of the ring (m), mean over its face
    - `stations` (n,): depth worn off at each station of the band (m), as linings that do
      not travel lose it

    Example:
        >>> sb.results.RingWear(0.3, np.array([2e-6, 3e-6]), np.array([1e-6, 4e-6])).over_least
        (1.5, 4.0)
    """

    travel: float
    depth: Float[np.ndarray, " m"]
    stations: Float[np.ndarray, " n"]

    @property
    def over_least(self) -> tuple[float, float]:
        """Maximum over minimum wear, with and without travel; infinite where a lining
        has none."""
        ends = ((np.max(h), np.min(h)) for h in (self.depth, self.stations))
        with_travel, without = (
            float(most / least) if least > 0 else math.inf for most, least in ends
        )
        return with_travel, without


def overlaps(
    angle: Float[np.ndarray, " n"], count: int, psi: Float[np.ndarray, " k"]
) -> Float[np.ndarray, "k n m"]:
    """Angles (rad) by which `count` linings of a ring overlap stations of the central
    angles `angle` at the travel `ψ`.

    Stations begin at the slack end; lining `j = 0…m − 1` of the ring covers
    `[j, j + 1] 2π/m − ψ`.
    """
    width = 2 * math.pi / count
    begin = np.cumsum(angle) - angle
    ahead = np.mod(
        width * np.arange(count) - psi[:, None, None] - begin[:, None], 2 * math.pi
    )
    return np.clip(angle[:, None] - ahead, 0, width) + np.clip(
        ahead + width - 2 * math.pi, 0, angle[:, None]
    )


@takes_values
def ring_wear(
    result: Result,
    count: Annotated[int, Whole("number of linings of the ring", 1, 10_000)],
    rate: WearRate | None = None,
    *,
    pair: str = "external",
    start: float = 0.0,
) -> RingWear:
    """Wear of a staged brake whose linings are a full ring that travels under the band
    (K: change of position).

        ψ = ∫ ω_b dt,   h_j = (m/2π) ∫ Σ_i ḣ_i o_ij(ψ) dt,   ḣ_i = I p_i v_i

    Loads, speeds, temperatures and wear rates `ḣ_i` are those of the `n` fixed stations
    under the band, the scene's linings; lining `j` of the ring, at `θ_j − ψ` (the
    pulley runs on at the tight end, linings are counted from the slack end), takes from
    each as much as their arcs overlap (`o_ij`, rad). Overlaps of a station sum to
    `β_i`.

    - `count` `m`: linings of the ring; inertia and preload of the scene's bandage are
      then those of the whole ring, its masses those of the arcs `β_i`
    - `rate` `I`: as in `lining_wear`, by default that of the scene's wear
    - `pair`: `external` or `internal`, whose faces wear
    - `start` (rad): travel before the run, as of earlier stops

    Integrals are exact between the corners of `o_ij`: `ψ` and `ḣ_i` are polynomials
    through 12 points of each step. Raises `InputError` for a brake without a bandage
    that is one body, a traced result, and missing areas or rate.
    """
    scene = require_one(result).scene
    brake = scene.brake
    if not brake.in_series or brake.resolved:
        raise input_error(
            "brake",
            "has no ring of linings",
            "take a staged brake whose bandage is one body",
        )
    if brake.rubbing_part(pair).area is None:
        raise input_error(
            f"brake.{brake.pairs[pair].field}.area",
            "is missing",
            "wear depends on the pressure",
        )
    if rate is None and scene.wear is not None:
        rate = scene.wear.rate if pair == "external" else scene.wear.internal
    if rate is None:
        raise input_error(
            "rate", "is missing", "give a wear rate, or the scene a `Wear`"
        )
    record = record_of(result)
    angle = np.asarray(brake.linings.weights)
    steps = np.flatnonzero(np.asarray(record.rows.kind)[: int(record.count)] != SKIPPED)
    t = np.asarray(record.rows.t)
    span = t[steps + 1] - t[steps]
    h = (0.5 * (_NODES + 1) * span[:, None]).ravel()
    p = probe_many(record, np.repeat(steps, _GAUSS).astype(np.int32), h)
    speed = np.asarray(p.shown.bandage_speed)
    worn = np.asarray(wearing(rate, rubbing(result.record, p, pair=pair)))
    # Legendre series over −1…1 of the travel and of the wear rates in every step
    speeds = (
        np.tensordot(speed.reshape(-1, _GAUSS), _TO_SERIES, axes=(1, 1))
        * 0.5
        * span[:, None]
    )
    turning = legendre.legint(speeds, lbnd=-1, axis=1)
    rates = (
        np.einsum("kp,spn->skn", _TO_SERIES, worn.reshape(len(steps), _GAUSS, -1))
        * 0.5
        * span[:, None, None]
    )
    gained = legendre.legval(1.0, turning.T)
    begins = start + np.cumsum(gained) - gained
    depth = np.zeros(count)
    for psi, travel, wear in zip(begins, turning, rates, strict=True):
        if np.any(wear):
            depth += _worn_in(angle, count, psi, travel, wear)
    return RingWear(
        float(np.sum(gained)),
        depth * count / (2 * math.pi),
        2 * np.sum(rates[:, 0], axis=0),
    )


def _worn_in(
    angle: np.ndarray, count: int, psi: float, turning: np.ndarray, rates: np.ndarray
) -> np.ndarray:
    """`∫ Σ_i ḣ_i o_ij dt` (m·rad) over a step, from the series of its travel and of its
    wear rates."""
    width = 2 * math.pi / count
    edges = np.append(0.0, np.cumsum(angle))
    low, high = sorted((psi, psi + legendre.legval(1.0, turning)))
    # travels at which an edge of the ring passes an edge of a station
    turns = np.arange(math.floor(low / width), math.ceil(high / width) + 2)
    corners = np.sort(np.ravel(np.mod(-edges, width) + width * turns[:, None]))
    corners = corners[(corners > low) & (corners < high)]
    sense = 1.0 if turning[0] >= 0 or legendre.legval(1.0, turning) >= 0 else -1.0
    below = np.full(corners.shape, -1.0)
    above = np.ones(corners.shape)
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        before = sense * (psi + legendre.legval(middle, turning) - corners) < 0
        below = np.where(before, middle, below)
        above = np.where(before, above, middle)
    ends = np.concatenate([[-1.0], np.sort(below), [1.0]])
    worn = np.zeros(count)
    for a, b in itertools.pairwise(ends):
        x = 0.5 * (a + b) + 0.5 * (b - a) * _NODES
        share = overlaps(angle, count, psi + legendre.legval(x, turning))
        worn += np.einsum(
            "k,kn,knm->m",
            0.5 * (b - a) * _GAUSS_WEIGHTS,
            legendre.legval(x, rates).T,
            share,
        )
    return worn
