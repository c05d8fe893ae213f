"""Main numbers of a run as functions of its record: traceable, so that they can be differentiated and batched."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import DeviceJit
from .._hybrid import ADVANCED, LANDED, SKIPPED, Record, largest, smallest
from .._hybrid._arrays import Array
from .._physics._brake import BrakeSystem, Capacity
from .._physics._modes import BandMode, slips
from ._probe import LANES, SAMPLES, Probe, probe

_POINTS = 33  # of a finer grid around a peak


class Peak(NamedTuple):
    """A greatest value over a run, when it occurs (s) and at which lining (from 1)."""

    value: Any
    time: Any
    lining: Any


class _Changes(NamedTuple):
    """For every row: whether an event ended it, and the mode before and after it."""

    event: Any
    before: Any
    after: Any

    @property
    def stops(self) -> Any:
        return self.event & _rests(self.after) & ~_rests(self.before) & (self.before.band != BandMode.OPEN)


def _rests(mode: Any) -> Any:
    return (mode.band == BandMode.HELD) & (mode.slides == 0)


def _changes(record: Record) -> _Changes:
    rows, n = record.rows, record.rows.t.shape[0]
    before = record.modes
    xp = _numpy_of(before.band)
    after = jax.tree.map(lambda column: xp.concatenate([column[1:], column[-1:]]), before)
    used = xp.arange(n, dtype=np.int32) < record.count
    return _Changes(used & (rows.kind >= LANDED), before, after)


def _numpy_of(values: Any) -> Any:
    """NumPy for concrete values: outside of jit every operation of JAX would compile by itself."""
    return np if isinstance(values, np.ndarray | np.bool_) else jnp


def _first(mask: Any, values: Any) -> Any:
    """Value just after the first row marked, `inf` if there is none."""
    xp = _numpy_of(mask)
    i = xp.minimum(xp.argmax(mask) + 1, mask.shape[0] - 1)
    return xp.where(xp.any(mask), xp.asarray(values)[i], np.inf)


def _slip_onset_time(record: Record, travel: Any) -> Any:
    c = _changes(record)
    slack = (c.before.band == BandMode.OPEN) | (c.before.band == BandMode.TAKE_UP)
    return _first(c.event & slack & ((c.after.band == BandMode.ELASTIC) | slips(c.after.band)), record.rows.t)


def _full_slip_time(record: Record, travel: Any) -> Any:
    c = _changes(record)
    return _first(c.event & slips(c.after.band) & (c.before.band != c.after.band), record.rows.t)


def _internal_slip_time(record: Record, travel: Any) -> Any:
    c = _changes(record)
    return _first(c.event & (c.before.slides == 0) & (c.after.slides != 0), record.rows.t)


def _external_lock_time(record: Record, travel: Any) -> Any:
    c = _changes(record)
    locks = (c.after.band == BandMode.HELD) & (c.before.band != BandMode.HELD) & (c.before.band != BandMode.OPEN)
    return _first(c.event & locks & (c.after.slides != 0), record.rows.t)


def _first_lining_slip_time(record: Record, travel: Any) -> Any:
    c = _changes(record)
    slides = (c.before.own.linings == 0) & (c.after.own.linings != 0)
    return _first(c.event & slides.any(axis=1), record.rows.t)


def _stopping_time(record: Record, travel: Any) -> Any:
    return _first(_changes(record).stops, record.rows.t)


def _stopping_angle(record: Record, travel: Any) -> Any:
    return _first(_changes(record).stops, record.states.phi)


def _hook_travel(record: Record, travel: Any) -> Any:
    return np.asarray(np.inf) if travel is None else _stopping_angle(record, travel) * travel


#: metrics of a record and the travel of the hook per radian; times that never come are `inf`
METRICS: dict[str, Callable[[Record, Any], Any]] = {
    "slip_onset_time": _slip_onset_time,
    "full_slip_time": _full_slip_time,
    "stopping_time": _stopping_time,
    "stopping_angle": _stopping_angle,
    "hook_travel": _hook_travel,
}

#: metrics that only a brake with two friction pairs has: first slip of the internal one, first rest of the bandage on
#: a turning pulley
STAGED_METRICS: dict[str, Callable[[Record, Any], Any]] = {
    "internal_slip_time": _internal_slip_time,
    "external_lock_time": _external_lock_time,
}


#: metrics of a chain of linings: its linings let go one by one
CHAIN_METRICS: dict[str, Callable[[Record, Any], Any]] = {"first_lining_slip_time": _first_lining_slip_time}


def thickness(worn: Any) -> Any:
    """Thickness that linings have lost at all their faces (m)."""
    first, *more = (one for one in worn if one is not None)
    return sum(more, start=first)


def worn_thickness(record: Record) -> Any:
    """Thickness that every lining lost in a run (m)."""
    return thickness(record.y_end.worn)


def _over(h: Any, below: Any) -> Array:
    """Greatest wear over another one, `inf` where there is none."""
    return jnp.where(below > 0, largest(h) / jnp.where(below > 0, below, 1.0), jnp.inf)


def _greatest_wear(record: Record, travel: Any) -> Array:
    return largest(worn_thickness(record))


def _wear_over_mean(record: Record, travel: Any) -> Array:
    h = worn_thickness(record)
    return _over(h, jnp.mean(h))


def _wear_over_least(record: Record, travel: Any) -> Array:
    h = worn_thickness(record)
    return _over(h, smallest(h))


#: metrics of a scene with wear: thickness lost in the run by the lining that lost most, and over mean and least
WEAR_METRICS: dict[str, Callable[[Record, Any], Array]] = {
    "greatest_wear": _greatest_wear,
    "wear_over_mean": _wear_over_mean,
    "wear_over_least": _wear_over_least,
}


def special_metrics(pairs: int, *, resolved: bool, wears: bool) -> dict[str, Callable[[Record, Any], Any]]:
    """Metrics that not every brake has: by the number of its friction pairs, whether single linings move by themselves,
    and whether the scene has wear."""
    of_pairs = STAGED_METRICS if pairs > 1 else CHAIN_METRICS if resolved else {}
    return of_pairs | WEAR_METRICS if wears else of_pairs


def metrics_of(system: Any) -> dict[str, Callable[[Record, Any], Any]]:
    """Metrics that a system has, besides its greatest values."""
    mechanism = system.mechanism
    wears = system.wearing is not None
    return METRICS | special_metrics(len(mechanism.pairs), resolved=mechanism.resolved, wears=wears)


def friction_work(ledger: Any) -> Any:
    """Work of all friction pairs in a ledger (J)."""
    return sum(ledger.friction[1:], start=ledger.friction[0])


def energies(record: Record) -> dict[str, Array]:
    """Energies over the run in J, and the closure of their balance as a share of the largest exchanged.

    `kinetic_change + elastic_change = load_work + lever_work − friction_heat − damper_heat` (model §1); without a band
    there is no `elastic_change`; where the
    scene has `power_shares`, `electrical_work` and `mechanical_work` of the friction go off as well (S-8…11)
    """
    system: BrakeSystem = record.system  # pyright: ignore
    ledger = record.y_end.ledger
    ends = [(record.rows.t[i], *_row_of(record, i)) for i in (jnp.zeros_like(record.count), record.count)]
    (kinetic_0, elastic_0), (kinetic_1, elastic_1) = (system.stored(*end) for end in ends)
    kinetic, elastic = kinetic_1 - kinetic_0, elastic_1 - elastic_0
    shares = system.shares
    work, hot, more = friction_work(ledger), 1.0 if shares is None else shares.heat, {}
    if len(ledger.friction) > 1:
        pairs = zip(system.pair_names, ledger.friction, strict=True)
        more = {f"heat_{pair}": hot * friction for pair, friction in pairs}
    if shares is not None:
        split = shares.split(work)
        more |= {"electrical_work": split.electrical, "mechanical_work": split.mechanical}
    damped = jnp.zeros_like(kinetic)
    if ledger.damper_heat is not None:
        damped = more["damper_heat"] = ledger.damper_heat
    residual = kinetic + elastic - (ledger.load_work + ledger.lever_work - work - damped)
    terms = [kinetic, elastic, ledger.load_work, ledger.lever_work, work, damped]
    found = {
        "load_work": ledger.load_work,
        "lever_work": ledger.lever_work,
        "friction_heat": hot * work,
        **more,
        "kinetic_change": kinetic,
        **({"elastic_change": elastic} if system.mechanism.banded else {}),
        "closure": _closure(residual, terms),
    }
    return found if system.thermal is None else found | _heats(record)


def _row_of(record: Record, i: Array) -> tuple[Any, Any]:
    """State and mode at the start of row `i`."""
    return record.flat.unpack_state(record.rows.y[i]), record.flat.unpack_mode(record.rows.mode[i])


def _closure(residual: Any, terms: list[Any]) -> Array:
    largest = jnp.max(jnp.abs(jnp.stack(terms)))
    return jnp.where(largest > 0, jnp.abs(residual) / jnp.where(largest > 0, largest, 1.0), 0.0)


def stored_heat(record: Record) -> dict[str, Array]:
    """Heat stored in every body of the network since the start (J)."""
    system: BrakeSystem = record.system  # pyright: ignore
    thermal = system.thermal
    if thermal is None:
        return {}
    start = record.flat.unpack_state(record.rows.y[0])
    change = thermal.capacity * (record.y_end.heat - start.heat)
    return {name: jnp.sum(change[here]) for name, here in thermal.spans.stores.items()}


def _heats(record: Record) -> dict[str, Array]:
    """What became of the friction heat (J): `friction_heat + heat_supplied = heat_stored + heat_lost`.

    `heat_to_metal`, `heat_to_linings`, `heat_to_band`: where the friction heat entered (on a standard brake nothing
    rubs on the band); `heat_lost`: to the air and other reservoirs, and what goes to parts that are not modelled.
    """
    system: BrakeSystem = record.system  # pyright: ignore
    ledger = record.y_end.ledger
    booked = ledger.heat
    stored = sum(stored_heat(record).values(), start=jnp.zeros(()))
    shares = system.shares
    heat = friction_work(ledger) if shares is None else shares.heat * friction_work(ledger)
    residual = heat + booked.supplied - stored - booked.lost
    terms = [heat, booked.supplied, stored, booked.lost]
    return {
        "heat_to_metal": booked.to_metal,
        "heat_to_linings": booked.to_linings,
        "heat_to_band": jnp.zeros_like(booked.to_metal) if booked.to_band is None else booked.to_band,
        "heat_supplied": booked.supplied,
        "heat_stored": stored,
        "heat_lost": booked.lost,
        "heat_closure": _closure(residual, terms),
    }


_energies_compiled = DeviceJit(energies)


def energies_of(record: Record) -> dict[str, Array]:
    """`energies` of a concrete record."""
    return _energies_compiled(record)


def end_capacity(record: Record) -> Capacity:
    """Load torque and capacity of the brake at the end of a run; of meaning where the pulley still turns."""
    return _capacity(record.system, record.t_end, record.y_end, record.mode_end, record.rows.t[0])


def _capacity(system: Any, t: Any, y: Any, mode: Any, start: Any) -> Capacity:
    return system.capacity(t, y, mode, start)


_capacity_compiled = DeviceJit(_capacity)


def end_capacity_of(record: Record) -> Capacity:
    """`end_capacity` of a concrete record."""
    start = np.asarray(record.rows.t)[0]
    found = _capacity_compiled(record.system, record.t_end, record.y_end, record.mode_end, start)
    return jax.tree.map(np.asarray, found)


_capacities_compiled = DeviceJit(jax.vmap(_capacity, in_axes=(None, 0, 0, 0, None)))


def capacities_at(record: Record, p: Probe, index: np.ndarray) -> Capacity:
    """Load torque and capacity of the brake of a concrete record at the samples named of a probe."""
    start, parts = np.asarray(record.rows.t)[0], []
    for at in np.split(index, range(LANES, len(index), LANES)):
        padded = np.pad(at, (0, LANES - len(at)), mode="edge")  # calls of one size compile once
        t, y, mode = jax.tree.map(lambda column, here=padded: np.asarray(column)[here], (p.t, p.y, p.mode))
        found, used = _capacities_compiled(record.system, t, y, mode, start), len(at)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], found))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


def numbers(record: Record, travel: Any) -> tuple[dict[str, Any], dict[str, Array]]:
    """All metrics and energies of a concrete record without unused rows (`Record.compact`)."""
    return {name: metric(record, travel) for name, metric in metrics_of(record.system).items()}, energies_of(record)


#: quantities per lining, (m, n), of which the greatest value over the run is a metric
PEAKS: dict[str, Callable[[Probe], Array]] = {"max_normal_load": lambda p: p.shown.pairs[0].normal}

#: those that only a band has
BAND_PEAKS: dict[str, Callable[[Probe], Array]] = {"max_tension": lambda p: p.greater_tension}


#: places whose greatest temperature (K) is a metric, where the scene names them
HOT_PLACES = {
    "peak_rim_temperature": "rim",
    "peak_lining_temperature": "linings",
    "peak_band_temperature": "band",
    "peak_lining_outer_temperature": "outer",
}


def peaks_of(system: Any) -> dict[str, Callable[[Probe], Array]]:
    """Everything of which a scene has a greatest value: tensions, loads, and temperatures where it has them."""
    peaks = BAND_PEAKS | PEAKS if system.mechanism.banded else PEAKS
    if system.thermal is None:
        return peaks
    places = system.thermal.heat.hot_places
    hot = {name: kind for name, kind in HOT_PLACES.items() if kind in places}
    return peaks | {name: (lambda p, kind=kind: p.surfaces[kind]) for name, kind in hot.items()}


def polish(look: Callable[[Any, Any], Any], xp: Any, row: Any, share: Any, after: Any) -> tuple[Any, Any]:
    """Row and share of a greatest value near a sample of it: two finer grids, each with a parabola through its best.

    `look(rows, shares)` gives values (m, n); `after` is the row that continues `row` without a jump, else `row` itself.
    At an interior maximum the rate is 0, so that its derivative does not depend on where exactly it was found.
    """
    width = 1.0 / (SAMPLES - 1)
    for _ in range(2):
        s = share + xp.linspace(-width, width, _POINTS)
        over = (s > 1) & (after != row)
        rows, shares = xp.where(over, after, row), xp.clip(xp.where(over, s - 1, s), 0.0, 1.0)
        top = xp.max(look(rows, shares), axis=1)
        best = xp.argmax(top)
        mid = xp.clip(best, 1, _POINTS - 2)
        left, right = shares[mid] - shares[mid - 1], shares[mid + 1] - shares[mid]
        curve = top[mid - 1] - 2 * top[mid] + top[mid + 1]
        smooth = (best == mid) & (rows[mid - 1] == rows[mid + 1]) & (curve < 0) & (abs(left - right) < 1e-9)
        bend = 0.5 * left * (top[mid - 1] - top[mid + 1]) / xp.where(smooth, curve, 1.0)
        row, share = rows[best], xp.clip(shares[best] + xp.where(smooth, bend, 0.0), 0.0, 1.0)
        after = xp.where(row == after, row, after)
        width = 3.0 * width / (_POINTS - 1)
    return row, share


def peak(record: Record, pick: Callable[[Probe], Array]) -> Peak:
    """Greatest of `pick(probe)` (m, n) over the run."""
    n = record.rows.t.shape[0]
    rows = jnp.arange(n, dtype=jnp.int32)
    used = (rows < record.count) & (record.rows.kind != SKIPPED)
    frozen = jax.lax.stop_gradient(record)

    def look(index: Array, share: Array) -> Array:
        return pick(probe(frozen, index, share))

    share = jnp.tile(jnp.linspace(0.0, 1.0, SAMPLES), n)
    values = jnp.where(jnp.repeat(used, SAMPLES)[:, None], look(jnp.repeat(rows, SAMPLES), share), -jnp.inf)
    best = jnp.argmax(jnp.max(values, axis=1))
    row = (best // SAMPLES).astype(jnp.int32)
    following = used & (rows > row)
    after = jnp.where(jnp.any(following), jnp.argmax(following).astype(jnp.int32), row)
    after = jnp.where(record.rows.kind[row] == ADVANCED, after, row)
    row, where = polish(look, jnp, row, share[best], after)
    p = probe(record, row[None], jax.lax.stop_gradient(where)[None])
    value = pick(p)[0]
    lining = jnp.argmax(value)
    return Peak(value[lining], p.t[0], lining + 1)
