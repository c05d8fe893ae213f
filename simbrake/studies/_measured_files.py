"""Measured data from CSV files: columns over time, events, and tables of recordings."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from .._base._csv_file import CsvFile
from .._base._faults import Fault, Issues
from .._base._nulls import NULLS
from ..outputs.metrics import METRICS
from ..outputs.quantities import about_column
from ..runs.measure import unit_of
from .measured import COLUMNS, Measured, Points, Single, column_of, points_of

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
    metrics = {}
    for name, i in index.items():
        if _is_metric(name):
            value = file.column(i, unit_of(name))
            spread = file.spreads(index, name, unit_of(name), value)
            if spread is None:
                spread = np.full(value.shape, reading.sigma.get(name))
            metrics[name] = value, spread
    others = index.keys() - {*_WORDS, *metrics, *(name + _SIGMA for name in metrics)}
    numbers = {name: file.written(i) for name, i in index.items() if name in others}
    recordings = dict[str, Measured]()
    for row, line in enumerate(file.places):
        words = {name: file.texts[index[name]][row] for name in _WORDS if name in index}
        name = words.get("name") or str(row + 1)
        files = [words[key] for key in ("file", "events") if words.get(key)]
        data = reading.read(*(file.path.parent / each for each in files))
        known = {}
        for path, value in numbers.items():
            unit = file.heads[index[path]].unit
            if not np.isnan(value[row]):
                known[path] = f"{value[row]} {unit}" if unit else float(value[row])
        singles = [
            Single(metric, float(value[row]), spread[row])
            for metric, (value, spread) in metrics.items()
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
            part = wrong.attempt(points_of, name, t, value, error)
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
