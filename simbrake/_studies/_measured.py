"""Measured data: columns over time and single values such as event times, each with its standard deviation."""

import dataclasses
import difflib
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._parts._scene import Scene
from .._run._measure import Metric, check_metrics, name_of, unit_of
from .._run._result import Result
from .._run._series import SERIES_COLUMNS, flat, outside, pair_column, unit_of_column

#: columns that count or name something: a fit has no derivative of them
_WHOLE = ("at_limit", "band_mode", "sense")
COLUMNS = tuple(name for name in SERIES_COLUMNS if name != "t" and name not in _WHOLE)
#: columns with an entry per lining or per place
_INDEXED = re.compile(r"^(?P<base>[a-z_]+?)\[(?P<entry>.+)\]$")


@dataclasses.dataclass(frozen=True)
class Points:
    """One measured column in SI units: `value` (m,) at the times `t` (m,) with standard deviations `sigma` (m,).

    `column` is a field of `Series`, or of one of its friction pairs as `internal_torque`, `entry` the lining or place
    (from 1), or a node's name, where it has several.
    `sigma` is `None` where nobody knows it.
    """

    column: str
    t: np.ndarray
    value: np.ndarray
    sigma: np.ndarray | None = None
    entry: str | None = None

    @property
    def name(self) -> str:
        return self.column if self.entry is None else f"{self.column}[{self.entry}]"

    @property
    def unit(self) -> str:
        return unit_of_column(self.column)


@dataclasses.dataclass(frozen=True)
class Single:
    """One measured number of the whole run, in SI units: the time of an event, or any other metric."""

    metric: Metric
    value: float
    sigma: float | None = None

    @property
    def name(self) -> str:
        return name_of(self.metric)

    @property
    def unit(self) -> str:
        return unit_of(self.metric)


@dataclasses.dataclass(frozen=True)
class Measured:
    """What was measured of one run. Two of them add up: `read_measured("speed.csv") + read_measured("events.csv")`."""

    points: tuple[Points, ...] = ()
    singles: tuple[Single, ...] = ()

    @classmethod
    def of(
        cls,
        t: Any = (),
        columns: Mapping[str, Any] | None = None,
        *,
        sigma: Mapping[str, Any] | None = None,
        events: Mapping[Any, Any] | None = None,
    ) -> "Measured":
        """Data from arrays in SI units; NaN means that nothing was measured there.

        - `columns`: `{"omega": (m,), "lining_temperature[3]": (m,)}` at the times `t` (m,), linings counted from 1
        - `sigma`: standard deviation of a column, one number or (m,)
        - `events`: `{"stopping_time": 3.21}` or `{"stopping_time": (3.21, 0.01)}` with the standard deviation; keys
          are metrics (`simbrake._run._measure.metric_names`) or functions of a `Result`

        Raises `InputError` with every fault.
        """
        t, sigma = np.atleast_1d(np.asarray(t, np.float64)), dict(sigma or {})
        points, singles, faults = [], [], []
        for name in sorted(set(sigma) - set(columns or {})):
            faults.append(Fault(name, "has a standard deviation but no values", "leave it out, or give the column"))
        for name, values in (columns or {}).items():
            found = _points(name, t, values, sigma.get(name))
            (points if isinstance(found, Points) else faults).append(found)
        for metric, value in (events or {}).items():
            number, error = value if isinstance(value, tuple) else (value, None)
            found = single(metric, float(number), None if error is None else float(error))
            (singles if isinstance(found, Single) else faults).append(found)
        if faults:
            raise InputError(faults)
        return cls(tuple(points), tuple(singles))

    def __add__(self, other: "Measured") -> "Measured":
        return Measured(self.points + other.points, self.singles + other.singles)

    @property
    def count(self) -> int:
        """How many numbers were measured."""
        return sum(part.t.size for part in self.points) + len(self.singles)

    @property
    def sigma_known(self) -> bool:
        """Whether every column and event has a standard deviation."""
        return all(part.sigma is not None for part in (*self.points, *self.singles))

    def __str__(self) -> str:
        lines = []
        for part in self.points:
            span = f"{part.t.size} values, t = {part.t.min():.6g}…{part.t.max():.6g} s"
            lines.append(f"{part.name} [{part.unit}]: {span}, {_spread(part.sigma)}")
        lines += [f"{one.name} = {one.value:.6g} {one.unit}, {_spread(one.sigma)}" for one in self.singles]
        return "\n".join(lines) if lines else "nothing measured"


def _spread(sigma: Any) -> str:
    if sigma is None:
        return "no standard deviation"
    low, high = float(np.min(sigma)), float(np.max(sigma))
    return f"σ = {low:.3g}" if low == high else f"σ = {low:.3g}…{high:.3g}"


def column_of(name: str) -> tuple[str, str | None] | None:
    """Column and entry that a header names: `omega`, `internal_torque`, `tension[3]`, or `tension_3` as `--out` writes
    it."""
    if _is_column(name):
        return name, None
    match = _INDEXED.match(name)
    if match is not None and _is_column(match["base"]):
        return match["base"], match["entry"]
    base, _, entry = name.rpartition("_")
    if entry.isdigit() and _is_column(base):
        return base, entry
    for base in sorted(COLUMNS, key=len, reverse=True):
        if name.startswith(f"{base}_") and (base == "temperature" or name[len(base) + 1 :].isdigit()):
            return base, name[len(base) + 1 :]
    return None


def _is_column(name: str) -> bool:
    """Whether a run can have such a column of real numbers."""
    of_pair = pair_column(name)
    return name in COLUMNS if of_pair is None else of_pair[1] not in _WHOLE


def unknown_column(where: str, name: str) -> Fault:
    """The fault of a header that names no column, with the nearest names."""
    of_pair = pair_column(name)
    if name in _WHOLE or of_pair is not None:
        return Fault(where, f"{name} cannot be fitted", "it is a whole number without a derivative")
    near = difflib.get_close_matches(re.sub(r"\[.*", "", name), COLUMNS, n=3, cutoff=0.5)
    hint = f"nearest: {', '.join(near)}" if near else f"there are: t, {', '.join(COLUMNS)}"
    return Fault(where, f"{name!r} is no column of a run", hint)


def _points(name: str, t: np.ndarray, values: Any, sigma: Any) -> Points | Fault:
    where, value = column_of(name), np.atleast_1d(np.asarray(values, np.float64))
    if where is None:
        return unknown_column(name, name)
    if value.shape != t.shape or t.ndim != 1:
        return Fault(name, f"has the shape {value.shape} at times of the shape {t.shape}", "both are (m,)")
    error = None if sigma is None else np.asarray(sigma, np.float64)
    if error is not None and error.shape not in ((), t.shape):
        return Fault(name, f"has standard deviations of the shape {error.shape}", "one number, or one for each value")
    kept = ~np.isnan(value)
    error = None if error is None else np.broadcast_to(error, t.shape)[kept]
    if not (np.all(np.isfinite(t[kept])) and np.all(np.isfinite(value[kept]))):
        return Fault(name, "has infinite values, or values at no time", "leave them out, or give NaN")
    if error is not None and not np.all((error > 0) & np.isfinite(error)):
        return Fault(name, "has a standard deviation that is not positive", "give its measuring error, > 0")
    if not kept.any():
        return Fault(name, "has no value", "leave the column out")
    return Points(where[0], t[kept], value[kept], error, where[1])


def single(metric: Metric, value: float, sigma: float | None, where: str | None = None) -> Single | Fault:
    """A measured metric, or the fault that it has."""
    where = name_of(metric) if where is None else where
    if not np.isfinite(value):
        return Fault(where, f"{value} is no measured value", "leave out what did not happen")
    if sigma is not None and not 0 < sigma < np.inf:
        return Fault(where, f"{sigma} is no standard deviation", "it must be > 0")
    return Single(metric, value, sigma)


def check_measured(data: Measured, scene: Scene) -> None:
    """Raises `InputError` with everything that a run of the scene cannot be compared with."""
    faults = []
    try:
        check_metrics(scene, [one.metric for one in data.singles])
    except InputError as error:
        faults += error.faults
    start, end = float(np.asarray(scene.initial.time)), float(np.asarray(scene.end_time))
    for part in data.points:
        beyond = part.t[outside(part.t, start, end)]
        if beyond.size:
            what = f"was measured at {beyond[0]:.6g} s, but the run goes from {start:g} to {end:g} s"
            faults.append(Fault(part.name, what, "set end_time (and initial.time) of the scene to the measurement"))
    if not data.count:
        faults.append(Fault("data", "nothing was measured", "give columns over time, or events"))
    if faults:
        raise InputError(faults)


def pick(result: Result, series: Any, column: str, entry: str | None) -> Any | Fault:
    """The values (m,) of a measured column in a series of a run, or what is wrong with the column."""
    known = flat(series, pairs=True)
    name, values = column if entry is None else f"{column}[{entry}]", known.get(column)
    if values is None:
        near = difflib.get_close_matches(column, known, n=3, cutoff=0.7)
        hint = f"nearest: {', '.join(near)}" if near else "its brake or heat part has no such thing"
        return Fault(name, "is not in a run of this scene", hint)
    if values.ndim == 1:
        return values if entry is None else Fault(name, f"{column} has no entries", f"call it {column}")
    labels = result.nodes if column == "temperature" else [str(i + 1) for i in range(values.shape[1])]
    if entry is None and len(labels) > 1:
        which = ", ".join(f"{column}[{label}]" for label in labels[:4])
        return Fault(name, f"has {len(labels)} entries", f"say which one was measured: {which}, …")
    if entry is not None and entry not in labels:
        return Fault(name, f"there is no entry {entry}", f"there are: {', '.join(labels)}")
    return values[:, 0 if entry is None else labels.index(entry)]
