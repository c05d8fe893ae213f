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
from jaxtyping import Float, Int

from .._base._faults import input_error, near
from .._base._packing import is_traced
from .._base._table import JsonObject, Table
from ..hybrid import Record
from ..hybrid.arrays import Array
from ..outputs.energies import energies, stored_heat
from ..outputs.log import Events, status_of_run
from ..outputs.metrics import METRICS, ByName, metric_names, worn_thickness
from ..outputs.probe import Probe, probe_at, probe_many
from ..outputs.programs import is_traced_run
from ..outputs.quantities import (
    SERIES_COLUMNS,
    Series,
    array_of_times,
    outside,
    series_of,
    times_within,
)
from ..outputs.stages import Stage
from ..outputs.torques import end_capacity
from ..parts.scene import Scene
from ..physics._brake import BrakeSystem, Capacity
from ..physics.heated import thermal_of
from ..thermal.heat import node_names
from .differentiable import metric_of_result
from .findings import message, summary_of
from .one_sided import one_sided
from .report import Report

_last_report: Report | None = None

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
        return _of_each(lambda result: metric_of_result(result, name))(self)

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
        `InputError` without wear.
        """
        if self.record.y_end.worn is None:
            raise input_error("scene.wear", "is missing", "give the scene a `Wear`")
        return worn_thickness(self.record)

    @property
    def nodes(self) -> list[str]:
        """Names of the thermal nodes, in the order of `Series.temperature`."""
        return node_names(self.scene.network)

    @property
    def end_temperatures(self) -> Array:
        """Temperatures (K) at the end of the nodes with capacity. Raises `InputError`
        without heat."""
        thermal = thermal_of(self._system)
        if thermal is None:
            hint = "give it heat, as simbrake.lumped_heat does"
            raise input_error("scene.heat", "is missing", hint)
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
        return int(require_one(self).code) == 0

    @property
    def status(self) -> str:
        """`stopped`, `held`, `not_stopped`, `not_followed`, `runaway`, `lowering`,
        `driven`, `released`, or the name of a failure code."""
        return status_of_run(require_one(self).record, self.scene)

    @property
    def message(self) -> str:
        """The status in words, with what to do next where it failed."""
        return message(require_one(self))

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
            report = _last_report = Report(require_one(self))
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
        lever and load. Raises `InputError` for any other brake."""
        if not self.scene.brake.in_series:
            what = "is missing, and only a staged brake has stages"
            hint = "`events` has what happens to any brake"
            raise input_error("scene.brake.bandage", what, hint)
        return self.report().stages

    @property
    def metrics(self) -> dict[str, float | None]:
        """Main numbers of the run in SI units, `None` where something did not
        happen."""
        return ByName(self.report().metrics)

    def summary(self) -> JsonObject:
        """Everything that `simbrake run --json` prints."""
        return copy.deepcopy(summary_of(self.report()))

    def verdict(self, limits: Mapping[str, float | str] | Any = None) -> Any:
        """Whether limits are exceeded or near: colour, one line, and every limit with
        its margin.

        - `limits`: permissible values by metric, as
          `{"max_tension": "120 kN"}`, beside those of the scene

        `simbrake.results.verdict` describes what it says.
        """
        return _above("runs.verdict").verdict(require_one(self), limits)

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
        known = require_one(self).metrics
        never = [
            name for name in metric_names(self.scene) if known.get(name, 0.0) is None
        ]
        notes = (
            [f"no derivative (NaN) of what did not happen: {', '.join(never)}"]
            if never
            else []
        )
        return (*one_sided(self.scene, self.record), *notes)

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
        return _above("plot").stop(require_one(self))

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


def require_one(result: Result) -> Result:
    """The result. Raises `InputError` unless it is concrete."""
    if result.concrete:
        return result
    what = (
        "is traced"
        if is_traced_run(result.record)
        else f"is a batch of {np.shape(result.record.count)}"
    )
    works = (
        "numbers work there: `result.stopping_time`, "
        '`result["stopping_time"]`, `result.code == 0`'
    )
    raise input_error(
        "result",
        what,
        f"{works}; take all else of one result, outside of jit, vmap and grad",
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
