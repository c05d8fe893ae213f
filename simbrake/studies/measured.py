"""Measured data: columns over time and single values such as event times."""

import dataclasses
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError, Issues, input_error, nearest
from .._base._quantity import unit_suffix
from .._base._table import Tabular, frozen, plain
from ..hybrid.arrays import Array
from ..outputs.quantities import (
    SERIES_COLUMNS,
    Series,
    about_column,
    columns_by_name,
    outside,
    pair_column,
)
from ..parts.scene import Scene
from ..runs.measure import MetricLike, check_metrics, name_of, unit_of
from ..runs.result import Result

#: columns of counts or names, which have no derivative
_WHOLE = ("at_limit", "band_mode", "sense")
COLUMNS = tuple(name for name in SERIES_COLUMNS if name != "t" and name not in _WHOLE)
#: columns with an entry per lining or per place
_INDEXED = re.compile(r"^(?P<base>[a-z_]+?)\[(?P<entry>.+)\]$")


@frozen
class Points:
    """One measured column in SI units: `value` (m,) at the times `t` (m,) with standard
    deviations `sigma` (m,).

    `column` is a field of `Series`, or of one of its friction pairs as
    `internal_torque`, `entry` the lining or place (from 1), or a node's name, where it
    has several. `sigma` is `None` where it is unknown.
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
        return about_column(self.column).unit


@frozen
class Single:
    """One measured number of the whole run, in SI units: the time of an event, or any
    other metric."""

    metric: MetricLike
    value: float
    sigma: float | None = None
    t: None = None

    @property
    def name(self) -> str:
        return name_of(self.metric)

    @property
    def unit(self) -> str:
        return unit_of(self.metric)


@frozen
class Measured(Tabular):
    """Measured data of one run, which can be added: `read_measured("speed.csv") +
    read_measured("events.csv")`.

    `known`: numbers of the scene that are known of this run, by path as in
    `with_values`: `{"duty.load.mass": "60 t"}`. `notes`: what was assumed while
    reading, to be read.

    Example:
        >>> data = sb.studies.Measured.of([0.0, 0.5], {"omega": [24.0, 14.6]}, sigma={"omega": 0.1})
        >>> data.count
        2
    """

    points: tuple[Points, ...] = ()
    singles: tuple[Single, ...] = ()
    known: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        t: object = (),
        columns: Mapping[str, object] | None = None,
        *,
        sigma: Mapping[str, object] | None = None,
        events: Mapping[MetricLike, float | tuple[float, float]] | None = None,
        known: Mapping[str, Any] | None = None,
    ) -> "Measured":
        """Data from arrays in SI units; NaN means not measured.

        - `columns`: `{"omega": (m,), "lining_temperature[3]": (m,)}` at the times `t`
          (m,), linings counted from 1
        - `sigma`: standard deviation of a column, one number or (m,)
        - `events`: `{"stopping_time": 3.21}` or `{"stopping_time": (3.21, 0.01)}` with
          the standard deviation; keys are metrics
          (`simbrake.runs.measure.metric_names`) or functions of a `Result`
        - `known`: numbers of the scene that are known of this run

        Raises `InputError` with every error.
        """
        t = np.atleast_1d(np.asarray(t, np.float64))
        columns = dict(columns or {})
        sigma = dict(sigma or {})
        issues = Issues()
        for name in sorted(sigma.keys() - columns.keys()):
            what = "has a standard deviation but no values"
            issues.add(name, what, "leave it out, or give the column")
        points = [
            issues.attempt(points_of, name, t, values, sigma.get(name))
            for name, values in columns.items()
        ]
        singles = []
        for metric, value in (events or {}).items():
            number, error = value if isinstance(value, tuple) else (value, None)
            error = None if error is None else float(error)
            singles.append(issues.attempt(_single, metric, float(number), error))
        issues.report()
        return cls(tuple(points), tuple(singles), dict(known or {}))  # pyright: ignore

    def __add__(self, other: "Measured") -> "Measured":
        known = {**self.known, **other.known}
        notes = tuple(dict.fromkeys((*self.notes, *other.notes)))
        return Measured(
            self.points + other.points, self.singles + other.singles, known, notes
        )

    @property
    def all(self) -> tuple[Points | Single, ...]:
        """Columns and single values, in the order in which a fit takes them."""
        return (*self.points, *self.singles)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return sum(np.size(part.value) for part in self.all)

    @property
    def sigma_known(self) -> bool:
        """Whether every column and event has a standard deviation."""
        return all(part.sigma is not None for part in self.all)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """All measured values (m,) and their standard deviations, 1 where unknown."""
        sigma = [
            np.broadcast_to(
                1.0 if part.sigma is None else part.sigma, np.shape(part.value)
            )
            for part in self.all
        ]
        return np.hstack([part.value for part in self.all]), np.hstack(sigma)

    def parts(self) -> Iterator[str]:
        for part in self.points:
            mark = f" [{part.unit}]" if unit_suffix(part.unit) else ""
            span = f"{part.t.size} values, t = {part.t.min():.6g}…{part.t.max():.6g} s"
            yield f"{part.name}{mark}: {span}, {_spread(part.sigma)}"
        yield from (
            f"{single.name} = {single.value:.6g}{unit_suffix(single.unit)}, {_spread(single.sigma)}"
            for single in self.singles
        )
        yield from (f"{path} = {value}, known" for path, value in self.known.items())
        if not self.count:
            yield "nothing measured"
        yield from (f"- {note}" for note in self.notes)

    def as_dict(self) -> dict[str, Any]:
        """Columns over time and single values by their names, in SI units."""
        points = {
            p.name: {"unit": p.unit, "t": p.t, "value": p.value, "sigma": p.sigma}
            for p in self.points
        }
        singles = {
            s.name: {"unit": s.unit, "value": s.value, "sigma": s.sigma}
            for s in self.singles
        }
        return plain(
            {
                "points": points,
                "singles": singles,
                "known": dict(self.known),
                "notes": self.notes,
            }
        )


def _spread(sigma: float | np.ndarray | None) -> str:
    if sigma is None:
        return "no standard deviation"
    low = float(np.min(sigma))
    high = float(np.max(sigma))
    return f"σ = {low:.3g}" if low == high else f"σ = {low:.3g}…{high:.3g}"


def column_of(name: str) -> tuple[str, str | None] | None:
    """Column and entry that a header names: `omega`, `internal_torque`, `tension[3]`,
    or `tension_3` as `--out` writes it."""
    if _is_column(name):
        return name, None
    match = _INDEXED.match(name)
    if match is not None and _is_column(match["base"]):
        return match["base"], match["entry"]
    base, _, entry = name.rpartition("_")
    if entry.isdigit() and _is_column(base):
        return base, entry
    base, _, node = name.partition("_")
    return (base, node) if base == "temperature" and node else None


def _is_column(name: str) -> bool:
    """Whether a run can have this column of real numbers."""
    of_pair = pair_column(name)
    return name in COLUMNS if of_pair is None else of_pair[1] not in _WHOLE


def unknown_column(where: str, name: str) -> Fault:
    """Error of a header that names no column, with the nearest names."""
    of_pair = pair_column(name)
    if name in _WHOLE or of_pair is not None:
        return Fault(
            where,
            f"{name} cannot be fitted",
            "it is a whole number without a derivative",
        )
    return Fault(
        where,
        f"unknown column {name!r}",
        nearest(re.sub(r"\[.*", "", name), ("t", *COLUMNS)),
    )


def points_of(name: str, t: np.ndarray, values: object, sigma: object) -> Points:
    """A measured column. Raises `InputError` with what is wrong with it."""
    where = column_of(name)
    if where is None:
        raise InputError([unknown_column(name, name)])
    value = np.atleast_1d(np.asarray(values, np.float64))
    if value.shape != t.shape or t.ndim != 1:
        what = f"has the shape {value.shape} at times of the shape {t.shape}"
        raise input_error(name, what, "both are (m,)")
    kept = ~np.isnan(value)
    error = None
    if sigma is not None:
        error = np.asarray(sigma, np.float64)
        if error.shape not in ((), t.shape):
            what = f"has standard deviations of the shape {error.shape}"
            raise input_error(name, what, "one number, or one for each value")
        error = np.broadcast_to(error, t.shape)[kept]
        if not np.all((error > 0) & np.isfinite(error)):
            what = "has a standard deviation that is not positive"
            raise input_error(name, what, "give its measuring error, > 0")
    t = t[kept]
    value = value[kept]
    if not np.all(np.isfinite([t, value])):
        what = "has infinite values, or values at no time"
        raise input_error(name, what, "leave them out, or give NaN")
    if not value.size:
        raise input_error(name, "has no value", "leave the column out")
    return Points(where[0], t, value, error, where[1])


def _single(metric: MetricLike, value: float, sigma: float | None) -> Single:
    """A measured number. Raises `InputError` with what is wrong with it."""
    if not np.isfinite(value):
        what = f"{value} is not a measured value"
        hint = "leave out events that did not occur"
        raise input_error(name_of(metric), what, hint)
    if sigma is not None and not 0 < sigma < np.inf:
        what = f"{sigma} is not a standard deviation"
        raise input_error(name_of(metric), what, "it must be > 0")
    return Single(metric, value, sigma)


def check_measured(data: Measured, scene: Scene) -> None:
    """Raise `InputError` with all data that cannot be compared with a run of the
    scene."""
    issues = Issues()
    issues.attempt(check_metrics, scene, [single.metric for single in data.singles])
    start = float(scene.initial.time)
    end = float(scene.end_time)
    for part in data.points:
        beyond = part.t[outside(part.t, start, end)]
        if beyond.size:
            what = (
                f"was measured at {beyond[0]:.6g} s, but the run goes from "
                f"{start:g} to {end:g} s"
            )
            issues.add(
                part.name,
                what,
                "set end_time (and initial.time) of the scene to the measurement",
            )
    if not data.count:
        issues.add("data", "nothing was measured", "give columns over time, or events")
    issues.report()


def pick(
    result: Result, series: Series, column: str, entry: str | None
) -> Array | Fault:
    """The values (m,) of a measured column in a series of a run, or the error of the
    column."""
    known = columns_by_name(series, pairs=True)
    name = column if entry is None else f"{column}[{entry}]"
    values = known.get(column)
    if values is None:
        hint = nearest(
            column, known, "its brake or heat part has no such quantity", cutoff=0.7
        )
        return Fault(name, "is not in a run of this scene", hint)
    if values.ndim == 1:
        if entry is None:
            return values
        return Fault(name, f"{column} has no entries", f"call it {column}")
    labels = (
        result.nodes
        if column == "temperature"
        else [str(i + 1) for i in range(values.shape[1])]
    )
    if entry is None and len(labels) > 1:
        which = ", ".join(f"{column}[{label}]" for label in labels[:4])
        return Fault(
            name, f"has {len(labels)} entries", f"name the measured one: {which}, …"
        )
    if entry is not None and entry not in labels:
        return Fault(
            name, f"there is no entry {entry}", f"there are: {', '.join(labels)}"
        )
    return values[:, 0 if entry is None else labels.index(entry)]
