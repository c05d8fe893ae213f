"""Measured data: columns over time and single values such as event times, from arrays
and from CSV files."""

import dataclasses
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base._csv_file import CsvFile
from .._base._faults import Fault, InputError, Issues, input_error, nearest
from .._base._nulls import NULLS
from .._base._quantity import unit_suffix
from .._base._table import Tabular, frozen, plain
from ..hybrid.arrays import Array
from ..outputs.metrics import METRICS
from ..outputs.quantities import (
    SERIES_COLUMNS,
    Series,
    about_column,
    flat,
    outside,
    pair_column,
)
from ..parts.scene import Scene
from ..runs.measure import Metric, check_metrics, name_of, unit_of
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

    metric: Metric
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
        events: Mapping[Metric, float | tuple[float, float]] | None = None,
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
            issues.attempt(_points, name, t, values, sigma.get(name))
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


def _points(name: str, t: np.ndarray, values: object, sigma: object) -> Points:
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


def _single(metric: Metric, value: float, sigma: float | None) -> Single:
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
    start = float(np.asarray(scene.initial.time))
    end = float(np.asarray(scene.end_time))
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
    known = flat(series, pairs=True)
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


_SIGMA = "_sigma"
#: columns of words
_WORDS = ("event", "unit", "name", "file", "events")


def read_measured(
    *paths: str | Path,
    sigma: Mapping[str, float] | None = None,
    columns: Sequence[str] | None = None,
    null: Sequence[float] = NULLS,
) -> Measured:
    """Measured data from CSV files.

    A file of **series** has a column `t` (or `time`) and columns named as in `Series`
    (`omega`, `rim_temperature`, `lining_temperature[3]`, linings from 1) or of one of
    its friction pairs (`internal_torque`), standard deviations in columns such as
    `omega_sigma`. A file of **events** has the columns `event, time, sigma` (or
    `event, value, unit, sigma`), an event being the name of a metric (`stopping_time`,
    `max_tension`, `energy.friction_heat`). Units are in the header, `omega [rpm]`,
    `rim_temperature (degC)`, `t [ms]`; without one they are SI, and a standard
    deviation has its column's. Cells that are empty, `NaN`, `n/a` or the like were not
    measured, nor were null values of loggers such as -999.25, which is told. Lines that
    begin with `#` are comments, columns are separated by commas, semicolons (then
    numbers may have decimal commas) or tabs. Files are in UTF-8, UTF-16 or Latin-1,
    perhaps packed (`.gz`, `.xz`).

    - `sigma`: standard deviations (SI) of columns and events that have none in the
      files
    - `columns`: columns of series to read; the others are ignored
    - `null`: numbers as they are written that mean no value, `()` for none

    Raises `InputError` with every error of every file: file, line, column, value and
    hint.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     np.savetxt(f"{folder}/stop.csv", [[0, 24], [500, 15]], "%g", ",", header="t [ms],omega", comments="")
        ...     sb.read_measured(f"{folder}/stop.csv", sigma={"omega": 0.1}).points[0].t
        array([0. , 0.5])
    """
    reading = _Reading(sigma, columns, null)
    data = reading.read(*paths)
    if not paths:
        reading.issues.add("data", "no file was given", "give one or more CSV files")
    reading.report([data])
    return data


class _Reading:
    """Files of one or more runs while they are read: standard deviations for what has
    none, columns, errors."""

    def __init__(
        self,
        sigma: Mapping[str, float] | None,
        columns: Sequence[str] | None,
        null: Sequence[float],
    ) -> None:
        self.null = null
        self.selected = None if columns is None else {_normal(name) for name in columns}
        self.issues = Issues(
            Fault(
                f"sigma of {name}",
                f"{value} is not a standard deviation",
                "it must be > 0",
            )
            for name, value in (sigma or {}).items()
            if not (isinstance(value, int | float | np.number) and 0 < value < np.inf)
        )
        self.sigma = {_normal(name): value for name, value in (sigma or {}).items()}

    def read(self, *paths: str | Path) -> Measured:
        data = Measured()
        for path in paths:
            file = _MeasuredFile(Path(path), self.null, _WORDS)
            data += file.read(self.sigma, self.selected)
            data += Measured(notes=tuple(file.notes))
            self.issues += file.faults
        return data

    def report(self, runs: Iterable[Measured]) -> None:
        """Raise `InputError` with all errors, also of what no file has."""
        names = {part.name for data in runs for part in data.all}
        if not self.issues:
            for name in sorted(self.sigma.keys() - names):
                self.issues.add(name, "has a standard deviation but was not measured")
            for name in sorted((self.selected or set()) - names):
                self.issues.add(name, "is in no file")
        self.issues.report()


def read_recordings(
    table: str | Path,
    *,
    sigma: Mapping[str, float] | None = None,
    columns: Sequence[str] | None = None,
    null: Sequence[float] = NULLS,
) -> dict[str, Measured]:
    """Measured data of several runs by their names, from a CSV table with a row for
    each of them.

    Its columns, each of which may be absent and each cell empty:

    - `name`, by default the number of the row
    - `file` and `events`: files of the run as in `read_measured`, beside the
      table
    - metrics that were measured, and their standard deviations: `stopping_time [ms]`,
      `stopping_time_sigma`
    - numbers of the scene that are known of a run, by path: `duty.load.mass [t]`,
      `initial.omega [rpm]`

    `sigma`, `columns`, `null`, units, comments and errors are as in `read_measured`.

    Example:
        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     table = pathlib.Path(folder, "stops.csv")
        ...     _ = table.write_text("name,duty.load.mass [t],stopping_time [ms]\\nlight,20,900\\nheavy,40,1300\\n")
        ...     stops = sb.studies.read_recordings(table, sigma={"stopping_time": 0.01})
        >>> print(stops["heavy"])
        stopping_time = 1.3 s, σ = 0.01
        duty.load.mass = 40.0 t, known
    """
    reading = _Reading(sigma, columns, null)
    file = _MeasuredFile(Path(table), null, _WORDS)
    index = {head.name: i for i, head in enumerate(file.heads)}
    metrics = {
        name: file.column(i, unit_of(name))
        for name, i in index.items()
        if _is_metric(name)
    }
    found = {
        name: file.spreads(index, name, unit_of(name), value)
        for name, value in metrics.items()
    }
    spreads = {name: error for name, error in found.items() if error is not None}
    others = (
        index.keys() - set(_WORDS) - set(metrics) - {name + _SIGMA for name in spreads}
    )
    numbers = {name: file.written(i) for name, i in index.items() if name in others}
    recordings = dict[str, Measured]()
    for row, line in enumerate(file.places):
        words = {name: file.texts[index[name]][row] for name in _WORDS if name in index}
        name = words.get("name") or str(row + 1)
        data = reading.read(
            *(
                file.path.parent / words[key]
                for key in ("file", "events")
                if words.get(key)
            )
        )
        known = {
            path: f"{value[row]} {file.heads[index[path]].unit}"
            if file.heads[index[path]].unit
            else float(value[row])
            for path, value in numbers.items()
            if not np.isnan(value[row])
        }
        singles = [
            Single(
                metric,
                float(value[row]),
                spreads[metric][row]
                if metric in spreads
                else reading.sigma.get(metric),
            )
            for metric, value in metrics.items()
            if np.isfinite(value[row])
        ]
        if name in recordings:
            what = f"there is another recording {name!r}"
            file.fault(f" line {line}", what, "one name for each")
        recordings[name] = data + Measured((), tuple(singles), known, tuple(file.notes))
    reading.issues += file.faults
    reading.report(recordings.values())
    return recordings


def _is_metric(name: str) -> bool:
    return name.startswith("energy.") or name in METRICS


def _normal(name: str) -> str:
    where = column_of(name)
    return (
        name
        if where is None
        else where[0]
        if where[1] is None
        else f"{where[0]}[{where[1]}]"
    )


class _MeasuredFile(CsvFile):
    """A CSV file of measured columns over time, or of single values."""

    def read(self, sigma: Mapping[str, float], selected: set[str] | None) -> Measured:
        if not self.heads:
            return Measured()
        names = {head.name: i for i, head in enumerate(self.heads)}
        if "event" in names:
            return self._events(names, sigma)
        clock = next(
            (
                name
                for name in ("t", *names)
                if name in names and name.lower() in ("t", "time")
            ),
            None,
        )
        if clock is None:
            self.fault(
                " header",
                f"has neither a column t nor event: {', '.join(names)}",
                "series need t, events event",
            )
            return Measured()
        return self._series(names, clock, sigma, selected)

    # --- columns over time -----------------------------------------------------------

    def _series(
        self,
        names: dict[str, int],
        clock: str,
        sigma: Mapping[str, float],
        selected: set[str] | None,
    ) -> Measured:
        t = self.column(names[clock], "s", needed=True)
        points = list[Points]()
        for name, i in names.items():
            header = f" header, column {self.heads[i].text}"
            of = name.removesuffix(_SIGMA)
            if of != name and of not in names and selected is None:
                what = f"there is no column {of}"
                self.fault(header, what, "a standard deviation needs its column")
            if (
                name == clock
                or of != name
                or not (selected is None or _normal(name) in selected)
            ):
                continue
            where = column_of(name)
            value = error = np.empty(0)
            if where is not None:
                si = about_column(where[0]).unit
                value = self.column(i, si)
                error = self.spreads(names, name, si, value)
                if error is None:
                    error = sigma.get(_normal(name))
                if self.faults:
                    continue
            wrong = Issues()
            part = wrong.attempt(_points, name, t, value, error)
            for fault in wrong:
                self.fault(header, fault.problem, fault.hint)
            if part is not None:
                points.append(part)
        if not points and not self.faults:
            hint = f"columns of a run are: {', '.join(COLUMNS)}"
            self.fault("", "has no column to fit", hint)
        return Measured(tuple(points))

    def spreads(
        self, names: Mapping[str, int], name: str, si: str, value: np.ndarray
    ) -> np.ndarray | None:
        """The standard deviations of a column with these values; `None` where the file
        has none."""
        i = names.get(name + _SIGMA)
        return (
            None
            if i is None
            else self.column(i, si, needed=np.isfinite(value), spread_of=names[name])
        )

    # --- single values ---------------------------------------------------------------

    def _events(self, names: dict[str, int], sigma: Mapping[str, float]) -> Measured:
        allowed = ("event", "time", "value", "unit", "sigma")
        for name, i in names.items():
            if name not in allowed:
                self.fault(
                    f" header, column {self.heads[i].text}",
                    "unknown column of events",
                    ", ".join(allowed),
                )
        column = next((name for name in ("time", "value") if name in names), None)
        if column is None or {"time", "value"} <= set(names):
            self.fault(" header", "needs one column of values", "time or value")
            return Measured()
        at = names[column]
        head = self.heads[at]
        for i in {at, names.get("sigma", at)}:
            self.written(i)
        singles: list[Single] = []
        for k, metric in enumerate(self.texts[names["event"]]):
            line = f" line {self.places[k]}"
            if np.isnan(self.values[at][k]):
                continue
            if not metric:
                what = "is empty beside a value"
                self.fault(f"{line}, column event", what, "name the event")
                continue
            where = f"{line}, event {metric}"
            if not _is_metric(metric):
                self.fault(where, "unknown metric", f"there are: {', '.join(METRICS)}")
                continue
            si = unit_of(metric)
            if column == "time" and si != "s":
                what = f"is not a time but a quantity in {si}"
                self.fault(where, what, "call the column value")
                continue
            text = self.texts[names["unit"]][k] if "unit" in names else ""
            of = self.unit(where, text or head.unit, si)
            error = sigma.get(metric)
            row = np.array([k])
            i = names.get("sigma")
            if i is not None and not np.isnan(self.values[i][k]):
                spread = self.heads[i]
                header = f" header, column {spread.text}"
                own = self.unit(header, spread.unit, si) if spread.unit else of
                error = float(self.in_si(i, row, own, si, True)[0])
            value = float(self.in_si(at, row, of, si, False)[0])
            if np.isfinite([value, error or 1.0]).all():  # else it has a separate error
                singles.append(Single(metric, value, error))
        if not singles and not self.faults:
            self.fault("", "has no event with a value", "event,time,sigma")
        return Measured(singles=tuple(singles))
