"""Result of a run: states at any time, event log, metrics, energies and a result
code."""

import copy
import functools
import html
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float, Int

from .._base._compiling import DeviceJit, is_traced, run_device, with_stored_slopes
from .._base._faults import Fault, InputError, near
from .._base._no_slope import without_slope
from .._base._part import leaves
from .._base._table import Table
from ..hybrid import LANDED, STOPPED, Code, Record
from ..hybrid.arrays import Array
from ..loads import Driller
from ..outputs.extremes import peaks
from ..outputs.log import (
    FAILURES,
    Events,
    Stage,
    Status,
    status_of,
)
from ..outputs.metrics import (
    METRICS,
    ByName,
    Metric,
    Peak,
    energies,
    identity_of,
    metric_names,
    stored_heat,
    worn_thickness,
)
from ..outputs.probe import (
    Entry,
    Probe,
    end_capacity,
    ends_driven,
    is_traced_run,
    lowers_steadily,
    probe_at,
    probe_many,
    runs_away,
)
from ..outputs.quantities import (
    SERIES_COLUMNS,
    Series,
    array_of_times,
    outside,
    series_of,
    times_within,
)
from ..parts.scene import Scene
from ..physics._brake import BrakeSystem, Capacity
from ..physics.heated import thermal_of
from ..thermal.heat import node_names
from .findings import message, summary_of
from .report import Report, labels_of

# --- derivatives that exist on one side only -----------------------------------------


#: two events within this share of a run are nearly simultaneous
NEAR = 1e-6
#: a guard is grazed if it passes 0 so slowly that its size of order one would take this
#: many runs
GRAZE = 1e4


def jumps_at_start(scene: Scene) -> list[str]:
    """Profiles of the scene that jump exactly at its start: an earlier jump changes
    nothing, a later one does."""
    start = float(scene.initial.time)
    parts = {leaf.path: np.asarray(leaf.value, float) for leaf in leaves(scene)}
    notes = []
    for path, times in parts.items():
        values = parts.get(f"{path.removesuffix('times')}values")
        if (
            path.endswith(".times")
            and values is not None
            and times.ndim == 1
            and times.shape == values.shape
        ):
            at_start = np.flatnonzero(times == start)
            if len(at_start) > 1 and np.any(values[at_start] != values[at_start[0]]):
                notes.append(
                    f"{path}: a jump at the start: derivatives by its time are those "
                    "of an earlier one, 0"
                )
    return notes


def near_ties(record: Record) -> list[str]:
    """Events so close that a small change may exchange them."""
    n = int(record.count)
    t = np.asarray(record.rows.t)[: n + 1]
    kind = np.asarray(record.rows.kind)[:n]
    at = np.flatnonzero((kind == LANDED) | (kind == STOPPED))
    times = t[at + 1]
    landed = kind[at] == LANDED
    whole = t[-1] - t[0]
    notes = []
    for i in np.flatnonzero((np.diff(times) > 0) & (np.diff(times) < NEAR * whole)):
        if landed[i] or landed[i + 1]:
            what = (
                "events"
                if landed[i] and landed[i + 1]
                else "an event and a corner of a given function"
            )
            words = (
                f"{what} at {times[i]:.9g} s and {times[i + 1] - times[i]:.2g} s "
                "later nearly coincide"
            )
            notes.append(
                f"{words}: derivatives are one-sided, valid until the two change their order"
            )
    return notes


def _approach(record: Record, index: Array) -> tuple[Array, Array, Array]:
    """Times, rates (1/s) at which the guards that fired reached 0, and whether others
    reached 0 at the same instant.

    Guards that move alike, as those of speed and slip under a steady lever, are one.
    """
    t, y = record.ends(index)
    flat = record.flat
    span = record.t_end - record.rows.t[0]

    def at_event(t: Array, y: Any, i: Array) -> tuple[Array, Array]:
        mode = record.rows.mode[i]
        fired = record.rows.guard[i]
        packed = ravel_pytree(y)[0]
        f = flat.rhs(t, packed, mode)
        g, rate = jax.jvp(
            lambda t, y: flat.guards(t, y, mode), (t, packed), (jnp.ones_like(t), f)
        )
        normals = jnp.column_stack(
            jax.jacfwd(lambda t, y: flat.guards(t, y, mode), (0, 1))(t, packed)
        )
        size = jnp.linalg.norm(normals, axis=1)
        alike = jnp.abs(normals @ normals[fired]) >= (1 - 1e-9) * size * size[fired]
        together = ~alike & (rate < 0) & (jnp.abs(g) <= 1e-12 * jnp.abs(rate) * span)
        return rate[fired], jnp.any(together)

    return t, *jax.vmap(at_event)(t, y, index)


_approaches = DeviceJit(_approach)


def passages(record: Record) -> list[str]:
    """Grazing events, and simultaneous events."""
    record = record.compact()
    t = np.asarray(record.rows.t)
    kind = np.asarray(record.rows.kind)[: int(record.count)]
    index = np.flatnonzero(kind == LANDED)
    if not len(index):
        return []
    padded = np.pad(index, (0, -len(index) % 16), mode="edge").astype(np.int32)
    times, rates, together = (
        np.asarray(x)[: len(index)] for x in _approaches(record, padded)
    )
    whole = t[int(record.count)] - t[0]
    slow = times[np.abs(rates) * whole * GRAZE < 1]
    several = times[together]
    return [
        *(
            f"the event at {time:.9g} s is only just reached: a small change may remove it"
            for time in slow
        ),
        *(
            f"several thresholds are reached at {time:.9g} s: derivatives are one-sided there"
            for time in several
        ),
    ]


def one_sided(result: "Result") -> tuple[str, ...]:
    """Where derivatives of a concrete run are one-sided or no longer valid."""
    return (
        *jumps_at_start(result.scene),
        *near_ties(result.record),
        *passages(result.record),
    )


# --- the result ---------------------------------------------------------------------


_last_report: Report | None = None
#: a speed that is missed by more than this share of the greatest one is not followed
_FOLLOWED = 1e-2


T = TypeVar("T")


def _of_each(find: Callable[["Result"], T]) -> Callable[["Result"], T]:
    """Values of a result; of a batch of results (not of one with values alone) those of
    each."""

    @functools.wraps(find)
    def find_each(result: "Result") -> T:
        return (
            jax.vmap(find)(result) if np.ndim(result.record.count) > 0 else find(result)
        )

    return find_each


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class RunLimits:
    """Options of `simulate` beside solver and tolerance, as they were given."""

    max_step: Any
    max_events: Any
    max_steps: int | None = field(metadata={"static": True})


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """The outcome of `simulate`: a PyTree, through which jit, vmap and grad pass.

    Every metric of the scene is an attribute, as `result.stopping_time` (s): a number,
    `inf` for the time of what did not happen (`null` in the summary), whose derivatives
    are NaN; a maximum value is a `Peak` with its time and its lining. A metric that the
    scene does not have raises `ValueError`. First derivatives of everything continuous
    are available, forward and reverse.

    Example:
        >>> result.status, round(result["stopping_time"], 4)
        ('stopped', 1.2577)
        >>> result.events["stop"].times == [result["stopping_time"]]
        True
    """

    scene: Scene
    record: Record
    rtol: Any
    method_name: str = field(metadata={"static": True})
    limits: RunLimits

    # --- metrics that pass through jit, vmap and grad --------------------------------

    def __getattr__(self, name: str) -> Any:
        if name not in METRICS:
            if hasattr(
                type(self), name
            ):  # a property of this name failed on an attribute of something else
                return object.__getattribute__(self, name)
            over_time = f"; over time it is result.series(times).{name}"
            hint = over_time if name in SERIES_COLUMNS else near(name, dir(self))
            raise AttributeError(
                f"{type(self).__name__!r} object has no attribute {name!r}{hint}"
            )
        return _of_each(lambda result: _metric(result, name))(self)

    @property
    def _system(self) -> BrakeSystem:
        return self.record.system  # pyright: ignore

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in METRICS if name.isidentifier())]

    @property
    def code(self) -> Int[Array, "..."]:
        """0 if the run reached its end time, else a failure code
        (`simbrake.results.FAILURES`)."""
        return self.record.code

    @property
    @_of_each
    def worn_thickness(self) -> Float[Array, "*batch n"]:
        """Thickness that every lining lost in the run (n,), in m; on a staged brake at
        both its faces.

        Differentiable. What had been worn off before is `scene.wear.worn`. Raises
        `ValueError` without wear.
        """
        if self.record.y_end.worn is None:
            raise ValueError("the scene has no wear: give it a `Wear`")
        return worn_thickness(self.record)

    @property
    def nodes(self) -> list[str]:
        """Names of the thermal nodes, in the order of `Series.temperature`."""
        return node_names(self.scene.network)

    @property
    def end_temperatures(self) -> Array:
        """Temperatures (K) at the end of the nodes with capacity."""
        thermal = thermal_of(self._system)
        if thermal is None:
            raise ValueError("the scene has no heat")
        return thermal.temperatures(self.record.y_end.heat)

    @property
    def stored_heat(self) -> dict[str, Array]:
        """Heat stored in every body since the start (J)."""
        return stored_heat(self.record)

    @property
    @_of_each
    def energy(self) -> dict[str, Array]:
        """Energies over the run in J, and the residuals of their balances over the
        largest energy exchanged.

        `kinetic_change + elastic_change = load_work + lever_work + motor_work −
        friction_heat` (model §1); less `electrical_work` and `mechanical_work` where
        the scene splits the friction power, less `damper_heat` of dampers, less
        `shaft_work` of other torques on the shaft. Of the heat: `friction_heat +
        shaft_work + heat_supplied = heat_stored + heat_lost`, less `heat_to_coolant`
        of water jackets; the friction heat entered `heat_to_metal`,
        `heat_to_linings`, `heat_to_band`, and no body with `heat_elsewhere`;
        `heat_lost` goes to the air and other reservoirs, and to parts that are not
        modelled.

        The residuals `closure` and `heat_closure` are no error estimates: they show
        energy that is lost, and see neither the error of the integration in time nor
        those of the mesh in depth and of the model.
        """
        return energies(self.record)

    @property
    @_of_each
    def end_capacity(self) -> Capacity:
        """Load torque and maximum torque of the sliding brake (N·m) at the end of the
        run, in the sense of rotation.

        With kinetic friction at the speed and the temperatures of the end; meaningful
        while the pulley turns. A run whose load exceeds that torque, with the lever at
        its last value, ends as `runaway`; one whose load equals it turns at constant
        speed.
        """
        return end_capacity(self.record)

    def series(self, ts: Any, *, left: bool = False, fill: bool = False) -> Series:
        """States and forces at the times `ts` (m,) in s: inside a step by a shorter
        step of the method itself.

        `accuracy()` estimates the largest error of each kind of states at any time,
        inside steps as well. Forces and torques have no estimate.

        At an event the values after it, or with `left` those before.

        Raises `InputError` for times outside the run (rounding at its ends is allowed
        for). With `fill` their values are NaN instead, and all columns are float64.
        Under jit, vmap and grad nothing can be raised: there real numbers are NaN
        outside the run, and whole numbers the least of their type (−2147483648 for
        int32).
        """
        concrete = self.concrete and not is_traced(ts)
        if concrete and not fill:
            p = look(self, ts, left=left, path="ts", hint="; fill=True gives NaN there")
            return series_of(p, self._system)
        xp, record = (
            (np, self.record.compact())
            if concrete
            else (jnp, jax.tree.map(jnp.asarray, self.record))
        )
        ts = (
            array_of_times(ts, "ts")
            if concrete
            else jnp.atleast_1d(jnp.asarray(ts, np.float64))
        )
        t = record.rows.t
        start = t[0]
        end = t[record.count]
        away = outside(ts, start, end)
        inside = xp.where(away, start, xp.clip(ts, start, end))
        index = record.find(inside, left=left)
        probe = probe_many if concrete else probe_at
        series = series_of(probe(record, index, inside - t[index]), self._system)

        def blank(column: Array) -> Array:
            gone = away.reshape(-1, *(1,) * (column.ndim - 1))
            if xp.issubdtype(column.dtype, np.integer) and not fill:
                return xp.where(gone, np.iinfo(column.dtype).min, column)
            return xp.where(gone, np.nan, xp.asarray(column, np.float64))

        return jax.tree.map(blank, series)._replace(t=xp.where(away, ts, series.t))

    @property
    def tells_pairs_apart(self) -> bool:
        """Whether files and tables have the columns of each friction pair: of a brake
        with several pairs, or whose linings move by themselves."""
        return self._system.mechanism.tells_pairs_apart

    # --- for people: concrete results only -------------------------------------------

    @property
    def concrete(self) -> bool:
        """Whether this is one result with values: neither traced nor a batch."""
        return not is_traced_run(self.record) and np.ndim(self.record.count) == 0

    @property
    def ok(self) -> bool:
        """Whether the run reached its end time."""
        return int(self._of_one().code) == 0

    def _of_one(self) -> "Result":
        """This result. Raises `InputError` unless it is concrete."""
        if self.concrete:
            return self
        what = (
            "is traced"
            if is_traced_run(self.record)
            else f"is a batch of {np.shape(self.record.count)}"
        )
        works = (
            "numbers work there: `result.stopping_time`, "
            '`result["stopping_time"]`, `result.code == 0`'
        )
        raise InputError(
            [
                Fault(
                    "result",
                    what,
                    f"{works}; take all else of one result, outside of jit, vmap and grad",
                )
            ]
        )

    @property
    def status(self) -> str:
        """`stopped`, `held`, `not_stopped`, `not_followed`, `runaway`, `lowering`,
        `driven`, `released`, or the name of a failure code."""
        if not self.ok:
            return FAILURES[int(self.code)][0]  # pyright: ignore
        if self._never_follows():
            return str(Status.NOT_FOLLOWED)
        moved = bool(
            np.any(
                np.asarray(self.record.rows.y)[: int(self.record.count) + 1, 1] != 0.0
            )
        )
        (end,) = labels_of(self.record, np.asarray([int(self.record.count)]))
        record = self.record
        driven = bool(ends_driven(record))
        return str(
            status_of(
                end,
                moved,
                driven,
                lambda: bool(runs_away(record)),
                lambda: bool(lowers_steadily(record)),
            )
        )

    def _never_follows(self) -> bool:
        """Whether a lever or a motor that is to keep a speed throughout never brings
        the pulley near it."""
        lever = self.scene.duty.lever
        motor = self.scene.motor
        course = (
            lever.speed
            if isinstance(lever, Driller)
            else None
            if motor is None
            else motor.speed
        )
        if course is None:
            return False
        rows = self.record.rows
        n = int(self.record.count) + 1
        speeds = np.asarray(course.values)
        wanted = np.interp(np.asarray(rows.t)[:n], np.asarray(course.times), speeds)
        most = np.max(np.abs(speeds))
        asked = np.abs(wanted) > 0.5 * np.max(np.abs(speeds))
        away = np.abs(np.asarray(rows.y)[:n, 1] - wanted)[asked]
        return bool(away.size and np.all(away > _FOLLOWED * most))

    @property
    def message(self) -> str:
        """The status in words, with what to do next where it failed."""
        return message(self._of_one())

    def report(self) -> Report:
        """Event log, metrics and summary of a concrete result; the last one made is
        kept, as it scans the whole run."""
        global _last_report
        # (read once: another thread may put its own in the same place)
        report = _last_report
        other = report is None or report.result.record.rows.t is not self.record.rows.t
        if (
            report is None
            or other
            or report.result.scene.limits is not self.scene.limits
        ):
            report = _last_report = Report(self._of_one())
        return report

    @property
    def events(self) -> Events:
        """The event log: mode changes and lining limits in order of time;
        `events["stop"]` are those of one name."""
        return Events(self.report().events)

    @property
    def stops(self) -> Table:
        """The stops in order, one row each: time, times in motion and under the band,
        angle, travel of the hook where there is one, friction heat since the stop
        before, and until the next restart the highest temperatures of rim, linings and
        band where the scene names them. In SI units; the printed table is in readable
        ones."""
        return self.report().stops

    @property
    def stages(self) -> list[Stage]:
        """Stages of a staged brake in order: name, times, heat of both pairs, work of
        lever and load."""
        if not self.scene.brake.in_series:
            raise ValueError("only a staged brake (with a bandage) has stages")
        return self.report().stages

    @property
    def metrics(self) -> dict[str, float | None]:
        """Main numbers of the run in SI units, `None` where something did not
        happen."""
        return ByName(self.report().metrics)

    def summary(self) -> Entry:
        """Everything that `simbrake run --json` prints."""
        return copy.deepcopy(summary_of(self.report()))

    def verdict(self, limits: Mapping[str, float | str] | Any = None) -> Any:
        """Whether limits are exceeded or near: colour, one line, and every limit with
        its margin.

        - `limits`: maximum permissible values by metric, as
          `{"max_tension": "120 kN"}`, beside those of the scene

        `simbrake.results.verdict` describes what it says.
        """
        return _above("runs.verdict").verdict(self._of_one(), limits)

    def derivative_notes(self) -> tuple[str, ...]:
        """Where derivatives of this run are one-sided or no longer valid, as far as the
        run itself shows it.

        Jumps of a profile at the start, events that nearly coincide, several at one
        instant, events that are only just reached, and what did not happen, whose
        derivatives are NaN. `simbrake.sensitivity` compares with differences on both
        sides as well, parameter by parameter.

        Example:
            >>> result.derivative_notes()
            ()
        """
        known = self._of_one().metrics
        never = [
            name for name in metric_names(self.scene) if known.get(name, 0.0) is None
        ]
        notes = (
            [f"no derivative (NaN) of what did not happen: {', '.join(never)}"]
            if never
            else []
        )
        return (*one_sided(self), *notes)

    def accuracy(self) -> Any:
        """Estimated errors of metrics, event times and states, from more runs:
        `simbrake.results.Accuracy`.

        `simbrake.results.accuracy` describes how. The second run takes two to four
        times the first, and no compiling. Walls in layers take a third one, with finer
        layers and its own compiled program.
        """
        return _above("runs.accuracy").accuracy(self)

    def plot(self) -> Any:
        """The run over time: `simbrake.plot.stop`."""
        return _above("plot").stop(self._of_one())

    def to_xarray(self, times: Any = None) -> Any:
        """The run as a labelled data set: `simbrake.dataset`."""
        return _above("results").dataset(self, times)

    def __getitem__(self, name: str) -> Any:
        """A number of the run by its name: `result["stopping_time"]`,
        `result["energy.friction_heat"]`; of a maximum value the value. Raises
        `KeyError` with the nearest names."""
        return _above("runs.measure").named(self, name)

    __iter__ = None  # (names are looked up, not counted)

    def __str__(self) -> str:
        if not self.concrete:
            return repr(self)
        checks = _above("runs.measure").limit_checks(self, {})
        return _above("runs.verdict").text_with_limits(self, checks)

    def __repr__(self) -> str:
        if self.concrete:
            return str(self)
        kind = (
            "traced"
            if is_traced_run(self.record)
            else f"batch of {np.shape(self.record.count)}"
        )
        return f"Result({kind}, {self.scene.brake.kind}, {self.method_name})"

    def _repr_html_(self) -> str:
        return (
            _above("runs.verdict").page_of(self)
            if self.concrete
            else f"<pre>{html.escape(repr(self))}</pre>"
        )


def look(
    result: Result,
    times: Any,
    *,
    left: bool = False,
    path: str = "times",
    hint: str = "",
) -> Probe:
    """States and forces of one concrete run at the times (s), at an event after it, or
    with `left` before it.

    Raises `InputError` for times outside the run.
    """
    record = result.record.compact()
    t = record.rows.t
    times = times_within(times, float(t[0]), float(t[record.count]), path, hint)
    index = record.find(times, left=left)
    return probe_many(record, index, times - t[index])


def _above(module: str) -> Any:
    """A module that builds on this one, for shortcuts of a result; loaded when it is
    used."""
    return importlib.import_module(f"simbrake.{module}")


def _metric(result: Result, name: str) -> Array | Peak:
    metric = METRICS[name]
    scene = result.scene
    if (missing := metric.needs.lacks(scene)) and not metric.shown_anyway:
        raise ValueError(f"the scene has no {name}: {missing}")
    if not result.concrete:
        if metric.greatest:
            return greatest_values(result, (name,))[name]
        return _differentiable(name, metric)(scene.as_run, result.record)
    if metric.energy:
        return result.energy[name.removeprefix("energy.")]
    if metric.greatest:
        return result.report().peaks[name]
    return jax.device_put(np.asarray(metric.find(result.record, scene)), run_device())


def greatest_values(result: Result, names: tuple[str, ...]) -> dict[str, Peak]:
    """Metrics that are maxima over a traced run, all from one walk over it."""
    if not names:
        return {}
    found = _differentiable_maxima(names, tuple(map(identity_of, names)))(
        result.scene.as_run, result.record
    )
    return dict(zip(names, found, strict=True))


@functools.cache
def _differentiable_maxima(
    names: tuple[str, ...], asked: tuple[object, ...]
) -> Callable[[Scene, Record], tuple[Peak, ...]]:
    """Maxima of traced runs; `asked`: what a program for them depends on."""

    def find(scene: Scene, record: Record) -> tuple[Peak, ...]:
        found = [
            METRICS[name].of_peak(peak, scene)
            for name, peak in peaks(record, names).items()
        ]
        return tuple(
            peak._replace(value=_where_it_happened(peak.value, scene, record))
            for peak in found
        )

    return with_stored_slopes(find, ("maxima", *names)) if asked == names else find


@functools.cache
def _differentiable(name: str, metric: Metric) -> Callable[[Scene, Record], Array]:
    """A metric of traced runs."""

    def find(scene: Scene, record: Record) -> Array:
        if metric.energy:
            return energies(record)[name.removeprefix("energy.")]
        return _where_it_happened(metric.find(record, scene), scene, record)

    return (
        with_stored_slopes(find, ("metric", name))
        if isinstance(identity_of(name), str)
        else find
    )


def _where_it_happened(value: Array, scene: Scene, record: Record) -> Array:
    """The same value. It has no derivative (NaN) where it is infinite, as the time of
    what did not happen, and where the record was too short for the run: a constant has
    the derivative 0, which would look like an answer."""
    return without_slope(
        value, jnp.isinf(value) | (record.code == Code.STEP_LIMIT), scene
    )
