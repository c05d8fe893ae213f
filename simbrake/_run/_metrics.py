"""The numbers of a run: name, unit, meaning, which scenes have them, and how they are found.

They are functions of a run's record, traceable, so that they can be differentiated and batched.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._parts._scene import Scene
from .._physics._mechanism import BandMode, slips
from ..hybrid import ADVANCED, LANDED, SKIPPED, Record, largest, smallest
from ..hybrid._arrays import Array
from ._probe import SAMPLES, Probe, probe

_POINTS = 33  # of a finer grid around a greatest value


class Need(NamedTuple):
    """What a number of a run needs: the `scenes` that have it, what is `missing` in others, in words, and a check."""

    scenes: str
    missing: str
    met: Callable[[Scene], bool]

    def lacks(self, scene: Scene) -> str:
        """What a scene lacks, "" where it has the number."""
        return "" if self.met(scene) else self.missing


_NOTHING = Need("every scene", "", lambda scene: True)


class Metric(NamedTuple):
    """A number of a run.

    - `unit` (SI), `meaning` in words, `title` above it in pages
    - `find(record, scene)`: the number, `inf` for the time of what did not happen; of a `greatest` value `find(probe)`:
      that of which it is the greatest over the run, (m, n)
    - `needs`: what a scene has whose runs have it;  `shown_anyway`: as `inf` where it lacks that
    - `of_linings`: whether a greatest value tells the lining
    """

    unit: str
    meaning: str
    title: str
    find: Callable[..., Any]
    needs: Need = _NOTHING
    greatest: bool = False
    of_linings: bool = False
    shown_anyway: bool = False


class Peak(NamedTuple):
    """A greatest value over a run, when it occurs (s) and at which lining (from 1)."""

    value: Any
    time: Any
    lining: Any


# --- events and wear --------------------------------------------------------------------------------------------------


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


def _slip_onset_time(record: Record, scene: Scene) -> Any:
    c = _changes(record)
    slack = (c.before.band == BandMode.OPEN) | (c.before.band == BandMode.TAKE_UP)
    return _first(c.event & slack & ((c.after.band == BandMode.ELASTIC) | slips(c.after.band)), record.rows.t)


def _full_slip_time(record: Record, scene: Scene) -> Any:
    c = _changes(record)
    return _first(c.event & slips(c.after.band) & (c.before.band != c.after.band), record.rows.t)


def _internal_slip_time(record: Record, scene: Scene) -> Any:
    c = _changes(record)
    return _first(c.event & (c.before.slides == 0) & (c.after.slides != 0), record.rows.t)


def _external_lock_time(record: Record, scene: Scene) -> Any:
    c = _changes(record)
    locks = (c.after.band == BandMode.HELD) & (c.before.band != BandMode.HELD) & (c.before.band != BandMode.OPEN)
    return _first(c.event & locks & (c.after.slides != 0), record.rows.t)


def _first_lining_slip_time(record: Record, scene: Scene) -> Any:
    c = _changes(record)
    slides = (c.before.own.linings == 0) & (c.after.own.linings != 0)
    return _first(c.event & slides.any(axis=1), record.rows.t)


def _stopping_time(record: Record, scene: Scene) -> Any:
    return _first(_changes(record).stops, record.rows.t)


def _stopping_angle(record: Record, scene: Scene) -> Any:
    return _first(_changes(record).stops, record.states.phi)


def _hook_travel(record: Record, scene: Scene) -> Any:
    travel = scene.duty.load.travel()
    return np.asarray(np.inf) if travel is None else _stopping_angle(record, scene) * travel


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


def _greatest_wear(record: Record, scene: Scene) -> Array:
    return largest(worn_thickness(record))


def _wear_over_mean(record: Record, scene: Scene) -> Array:
    h = worn_thickness(record)
    return _over(h, jnp.mean(h))


def _wear_over_least(record: Record, scene: Scene) -> Array:
    h = worn_thickness(record)
    return _over(h, smallest(h))


# --- what they need ---------------------------------------------------------------------------------------------------

_HOOK = Need("load on a hook", "its load hangs on no hook", lambda scene: scene.duty.load.travel() is not None)
_BANDAGE = Need("staged brake", "its brake has no bandage", lambda scene: scene.brake.in_series)
_CHAIN = Need(
    "resolved chain",
    "its brake has no band in segments",
    lambda scene: scene.brake.resolved and not scene.brake.in_series,
)
_WEAR = Need("wear", "the scene has no wear part", lambda scene: scene.wear is not None)
_BAND = Need("band brake", "its brake has no band", lambda scene: scene.brake.banded)
_DAMPERS = Need("resolved linings", "its linings do not move by themselves", lambda scene: scene.brake.resolved)
_SHARES = Need("`power_shares`", "the scene has no `power_shares`", lambda scene: scene.power_shares is not None)
_HEAT = Need("heat", "the scene has no heat", lambda scene: scene.heated)


def _surface(place: str, title: str, meaning: str, *, of_linings: bool = False) -> Metric:
    """The greatest temperature of a place that the heat part of a scene names."""
    named = Need(
        "heat that names the place",
        "its heat part names no such place",
        lambda scene: place in scene.network.hot_places,
    )
    return Metric("K", meaning, title, lambda p: p.surfaces[place], named, greatest=True, of_linings=of_linings)


# --- the registry -----------------------------------------------------------------------------------------------------

#: every number of a run by its name: results, files, tables, reports, studies and docs read it from here
METRICS: dict[str, Metric] = {
    "slip_onset_time": Metric("s", "first onset of slip t0: the band is taut", "Onset of slip t₀", _slip_onset_time),
    "full_slip_time": Metric("s", "first time at which every lining slides, t1", "Full slip t₁", _full_slip_time),
    "stopping_time": Metric(
        "s", "first time at which the brake brings the pulley to rest", "Stopping time", _stopping_time
    ),
    "stopping_angle": Metric("rad", "angle from the start to the first stop", "Angle to the stop", _stopping_angle),
    "hook_travel": Metric(
        "m",
        "travel of the hook from the start to the first stop",
        "Hook travel to the stop",
        _hook_travel,
        _HOOK,
        shown_anyway=True,
    ),
    "max_tension": Metric(
        "N",
        "greatest tension of the band at either side of any lining",
        "Greatest tension of the band",
        lambda p: p.greater_tension,
        _BAND,
        greatest=True,
        of_linings=True,
    ),
    "max_normal_load": Metric(
        "N",
        "greatest normal load on any lining",
        "Greatest load on a lining",
        lambda p: p.shown.pairs[0].normal,
        greatest=True,
        of_linings=True,
    ),
    "internal_slip_time": Metric(
        "s", "first time at which the internal pair slides", "First internal slip", _internal_slip_time, _BANDAGE
    ),
    "external_lock_time": Metric(
        "s",
        "first time at which the bandage is at rest on a turning pulley",
        "First rest of the bandage",
        _external_lock_time,
        _BANDAGE,
    ),
    "first_lining_slip_time": Metric(
        "s",
        "first time at which a lining slides by itself",
        "First slip of a lining",
        _first_lining_slip_time,
        _CHAIN,
    ),
    "greatest_wear": Metric(
        "m", "greatest thickness that a lining lost in the run", "Greatest wear of a lining", _greatest_wear, _WEAR
    ),
    "wear_over_mean": Metric(
        "1", "greatest wear over the mean of all linings", "Greatest over mean wear", _wear_over_mean, _WEAR
    ),
    "wear_over_least": Metric(
        "1",
        "greatest wear over the least: how uneven the linings wear",
        "Greatest over least wear",
        _wear_over_least,
        _WEAR,
    ),
    "peak_rim_temperature": _surface("rim", "Hottest rim surface", "greatest surface temperature of the rim"),
    "peak_lining_temperature": _surface(
        "linings", "Hottest lining surface", "greatest surface temperature of any lining", of_linings=True
    ),
    "peak_band_temperature": _surface("band", "Hottest band", "greatest temperature of the band"),
    "peak_lining_outer_temperature": _surface(
        "outer",
        "Hottest outer lining face",
        "greatest temperature of the outer faces of the linings",
        of_linings=True,
    ),
}


class Energy(NamedTuple):
    """An energy over a run (J)."""

    meaning: str
    needs: Need = _NOTHING


#: energies over the run by name, beside the heat of each pair of a brake with several (`heat_external`)
ENERGIES: dict[str, Energy] = {
    "load_work": Energy("work of the load"),
    "lever_work": Energy("work of the lever"),
    "friction_heat": Energy("friction heat"),
    "kinetic_change": Energy("change of the kinetic energy"),
    "elastic_change": Energy("change of the elastic energy", _BAND),
    "damper_heat": Energy("heat of dampers", _DAMPERS),
    "electrical_work": Energy("electrical part of the friction work", _SHARES),
    "mechanical_work": Energy("mechanical part of the friction work", _SHARES),
    "heat_to_metal": Energy("friction heat that entered the metal", _HEAT),
    "heat_to_linings": Energy("friction heat that entered the linings", _HEAT),
    "heat_to_band": Energy("friction heat that entered the band", _HEAT),
    "heat_supplied": Energy("heat from sources", _HEAT),
    "heat_stored": Energy("heat stored in the network", _HEAT),
    "heat_lost": Energy("heat lost to the surroundings", _HEAT),
}
_CLOSURES = {
    "closure": "residual of the energy balance as a share of the largest energy exchanged",
    "heat_closure": "residual of the heat balance as a share of the largest heat exchanged",
}


def metrics_of(scene: Scene, *, greatest: bool) -> dict[str, Metric]:
    """Metrics of the runs of a scene: its greatest values, or all others."""
    return {
        name: metric
        for name, metric in METRICS.items()
        if metric.greatest == greatest and (metric.shown_anyway or not metric.needs.lacks(scene))
    }


def metric_names(scene: Scene) -> tuple[str, ...]:
    """Names of everything that a run of the scene has as one number, energies as `energy.…`."""
    names = [name for name, metric in METRICS.items() if not metric.needs.lacks(scene)]
    energies = [name for name, energy in ENERGIES.items() if not energy.needs.lacks(scene)]
    if scene.brake.in_series:
        energies += [f"heat_{pair}" for pair in scene.brake.pairs]
    return (*names, *(f"energy.{name}" for name in energies))


def about_metric(name: str) -> dict[str, str]:
    """Unit and meaning of a metric, or of the time (`…_time`) or lining (`…_lining`) of a greatest value."""
    if name in METRICS:
        return {"units": METRICS[name].unit, "meaning": METRICS[name].meaning}
    value, _, what = name.rpartition("_")
    unit, words = {"time": ("s", "time"), "lining": ("1", "lining (from 1)")}[what]
    return {"units": unit, "meaning": f"{words} of the {METRICS[value].meaning}"}


def about_energy(name: str) -> dict[str, str]:
    """Unit and meaning of an energy over the run; `heat_…` of a friction pair is its friction heat."""
    if name in _CLOSURES:
        return {"units": "1", "meaning": _CLOSURES[name]}
    if name in ENERGIES:
        return {"units": "J", "meaning": ENERGIES[name].meaning}
    return {"units": "J", "meaning": f"friction heat of the {name.removeprefix('heat_')} pair"}


# --- greatest values --------------------------------------------------------------------------------------------------


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
