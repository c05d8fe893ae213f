"""Measured data from CSV files, with every fault of every file in one report."""

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Unit, spelled, to_si, unit
from .._run._measure import unit_of
from .._run._metrics import METRICS
from .._run._series import unit_of_column
from ._measured import COLUMNS, Measured, Points, Single, column_of, unknown_column

#: faults of values listed in full; a broken logger makes thousands
_LISTED = 50
_SIGMA = "_sigma"


def read_measured(
    *paths: str | Path, sigma: Mapping[str, float] | None = None, columns: Sequence[str] | None = None
) -> Measured:
    """Measured data from CSV files.

    A file of **series** has a column `t` and columns named as in `Series` (`omega`, `rim_temperature`,
    `lining_temperature[3]`, linings from 1) or of one of its friction pairs (`internal_torque`), standard deviations in
    columns such as `omega_sigma`. A file of **events** has the columns `event, time, sigma` (or
    `event, value, unit, sigma`), an event being the name of a metric (`stopping_time`, `max_tension`,
    `energy.friction_heat`). Units stand in the header, `omega [rpm]`, `rim_temperature [degC]`, `t [ms]`; without one
    they are SI, and a standard deviation has its column's. Empty cells were not measured, lines that begin with `#` are
    passed over, columns are separated by commas, semicolons (then numbers may have decimal commas) or tabs.

    - `sigma`: standard deviations (SI) of columns and events that have none in the files
    - `columns`: which columns of series to take; the others are not looked at

    Raises `InputError` with every fault of every file: file, line, column, value and what to do.
    """
    files = [CsvFile(Path(path)) for path in paths]
    data = Measured()
    given, wanted = dict(sigma or {}), None if columns is None else set(columns)
    faults = [
        Fault(f"sigma of {name}", f"{value} is no standard deviation", "it must be > 0")
        for name, value in given.items()
        if not 0 < value < np.inf
    ]
    for file in files:
        found = file.read(given, wanted)
        data += found
        faults += file.faults
    names = {part.name for part in (*data.points, *data.singles)}
    known = {_normal(name) for name in given}
    if not faults:
        faults += [Fault(name, "has a standard deviation but was not measured") for name in sorted(known - names)]
        faults += [Fault(name, "is in no file") for name in sorted({_normal(n) for n in wanted or ()} - names)]
    if not paths:
        faults.append(Fault("data", "no file was given", "give one or more CSV files"))
    if faults:
        raise InputError(faults)
    return data


def _normal(name: str) -> str:
    where = column_of(name)
    return name if where is None else where[0] if where[1] is None else f"{where[0]}[{where[1]}]"


class _Head(NamedTuple):
    """One column of a file: its header, the name in it and the unit in brackets."""

    text: str
    name: str
    unit: str


class CsvFile:
    """One CSV file while it is read: its table and the faults found."""

    def __init__(self, path: Path):
        self.path, self.faults, self.left_out = path, [], 0
        self.heads: list[_Head] = []
        self.rows: list[tuple[int, list[str]]] = []
        self.decimal_comma = False
        try:
            self._split(path.read_text("utf-8-sig"))
        except FileNotFoundError:
            self.fault("", "there is no such file", "give the path of a CSV file")
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            self.fault("", f"cannot be read as CSV: {error}", "give a text file in UTF-8")

    def fault(self, where: str, problem: str, hint: str = "") -> None:
        if len(self.faults) < _LISTED:
            self.faults.append(Fault(f"{self.path}{where}", problem, hint))
        else:
            self.left_out += 1
            rest = Fault(str(self.path), f"{self.left_out} more faults", "mend these first")
            self.faults = [*self.faults[:_LISTED], rest]

    def _split(self, text: str) -> None:
        lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
        if len(lines) < 2:
            self.fault("", "has no header with values below it", "the first line names the columns")
            return
        header = lines[0][1]
        delimiter = max(",;\t", key=header.count)
        self.decimal_comma = delimiter != ","
        table = [(i, next(csv.reader([line], delimiter=delimiter))) for i, line in lines]
        self.heads = [_head(cell) for cell in table[0][1]]
        for line, cells in table[1:]:
            if len(cells) != len(self.heads):
                what = f"has {len(cells)} cells under {len(self.heads)} columns"
                self.fault(f" line {line}", what, "leave cells empty that were not measured")
            else:
                self.rows.append((line, cells))
        names = [head.name for head in self.heads]
        for name in sorted({name for name in names if names.count(name) > 1}):
            self.fault(" header", f"names {name} twice", "one column each")

    def read(self, sigma: Mapping[str, float], wanted: set[str] | None) -> Measured:
        if not self.heads:
            return Measured()
        names = {head.name: i for i, head in enumerate(self.heads)}
        if "event" in names:
            return self._events(names, sigma)
        if "t" not in names:
            self.fault(
                " header", f"has neither a column t nor event: {', '.join(names)}", "series need t, events event"
            )
            return Measured()
        return self._series(names, sigma, wanted)

    # --- columns over time ------------------------------------------------------------------------------------

    def _series(self, names: dict[str, int], sigma: Mapping[str, float], wanted: set[str] | None) -> Measured:
        t = self.column(names["t"], "s", needed=True)
        points = []
        wanted = None if wanted is None else {_normal(name) for name in wanted}
        errors = {_normal(name): value for name, value in sigma.items()}
        for name, i in names.items():
            if name == "t" or name.endswith(_SIGMA) or not (wanted is None or _normal(name) in wanted):
                continue
            where = column_of(name)
            if where is None:
                found = unknown_column(f"{self.path} header, column {self.heads[i].text}", name)
                self.fault(" header, column " + self.heads[i].text, found.problem, found.hint)
                continue
            si = unit_of_column(where[0])
            value, error = self.column(i, si), None
            if name + _SIGMA in names:
                error = self.column(names[name + _SIGMA], si, of_column=i)
                self._missing_sigma(value, error, names[name + _SIGMA])
            elif _normal(name) in errors:
                error = np.full(value.shape, errors[_normal(name)])
            kept = np.isfinite(value) & np.isfinite(t)
            if kept.any():
                points.append(Points(where[0], t[kept], value[kept], None if error is None else error[kept], where[1]))
            elif not self.faults:
                self.fault(f" column {self.heads[i].text}", "has no value", "leave the column out")
        self._orphans(names, wanted)
        if not points and not self.faults:
            known = f"columns of a run are: {', '.join(COLUMNS)}"
            self.fault("", "has no column to fit", known)
        return Measured(tuple(points))

    def _orphans(self, names: dict[str, int], wanted: set[str] | None) -> None:
        for name, i in names.items():
            if name.endswith(_SIGMA) and name.removesuffix(_SIGMA) not in names and wanted is None:
                what = f"there is no column {name.removesuffix(_SIGMA)}"
                self.fault(f" header, column {self.heads[i].text}", what, "a standard deviation belongs to a column")

    def _missing_sigma(self, value: np.ndarray, error: np.ndarray, i: int) -> None:
        for k in np.flatnonzero(np.isfinite(value) & np.isnan(error)):
            line, cells = self.rows[k]
            if not cells[i].strip():  # what is no number has its own fault
                where = f" line {line}, column {self.heads[i].text}"
                self.fault(where, "is empty beside a measured value", "give its standard deviation")

    def column(self, i: int, si: str, *, of_column: int | None = None, needed: bool = False) -> np.ndarray:
        """A column in SI, NaN where a cell is empty or faulty; a standard deviation takes the unit `of_column`."""
        head, spread = self.heads[i], of_column is not None
        text = head.unit if head.unit or of_column is None else self.heads[of_column].unit
        of = self._unit(head.text, text, si)
        found = np.full(len(self.rows), np.nan)
        for k, (line, cells) in enumerate(self.rows):
            where = f" line {line}, column {head.text}"
            number = self._number(cells[i], where)
            if number is None:
                if needed and not cells[i].strip():
                    self.fault(where, "is empty", "every line needs its time")
                continue
            found[k] = self._admitted(number, of, si, spread, where)
        return found

    def _unit(self, where: str, text: str, si: str) -> Unit:
        try:
            return unit(text, si)
        except ValueError as error:
            self.fault(f" header, column {where}", f"{text!r} is no unit of a quantity in {si or '1'}", str(error))
            return Unit(1.0)

    def _number(self, cell: str, where: str) -> float | None:
        text = cell.strip()
        if not text:
            return None
        try:
            number = float(text.replace(",", ".") if self.decimal_comma else text)
        except ValueError:
            self.fault(where, f"{text!r} is not a number", "numbers as in 12.5 or 1.25e1; an empty cell: not measured")
            return None
        if not np.isfinite(number):
            self.fault(where, f"{text!r} is not finite", "leave the cell empty: not measured")
            return None
        return number

    def _admitted(self, number: float, of: Unit, si: str, spread: bool, where: str) -> float:
        if spread:
            if number <= 0:
                self.fault(where, f"{number:g} is no standard deviation", "it must be > 0")
                return np.nan
            return number * float(of.factor)
        value = to_si(number, of)
        if si == "K" and value < 0:
            self.fault(where, f"{number:g} is below absolute zero", "is the unit in the header right?")
            return np.nan
        return value

    # --- single values ----------------------------------------------------------------------------------------

    def _events(self, names: dict[str, int], sigma: Mapping[str, float]) -> Measured:
        allowed = ("event", "time", "value", "unit", "sigma")
        for name, i in names.items():
            if name not in allowed:
                self.fault(f" header, column {self.heads[i].text}", "is no column of events", ", ".join(allowed))
        column = next((name for name in ("time", "value") if name in names), None)
        if column is None or {"time", "value"} <= set(names):
            self.fault(" header", "needs one column of values", "time or value")
            return Measured()
        at, head = names[column], self.heads[names[column]]
        singles: list[Single] = []
        for line, cells in self.rows:
            metric = cells[names["event"]].strip()
            where = f" line {line}, event {metric}"
            number = self._number(cells[at], f" line {line}, column {head.text}")
            if not metric or number is None:
                if not metric and number is not None:
                    self.fault(f" line {line}, column event", "is empty beside a value", "name the event")
                continue
            si = unit_of(metric)
            if not (metric.startswith("energy.") or metric in METRICS):
                self.fault(where, "is no metric of a run", f"there are: {', '.join(METRICS)}, energy.…")
                continue
            text = cells[names["unit"]] if "unit" in names and cells[names["unit"]].strip() else head.unit
            of = self._unit_of_event(where, text, si, head)
            error = sigma.get(metric)
            if "sigma" in names and cells[names["sigma"]].strip():
                error = self._sigma_of_event(cells[names["sigma"]], line, self.heads[names["sigma"]], of, si)
            value = self._admitted(number, of, si, False, where)
            if not (np.isnan(value) or (error is not None and np.isnan(error))):  # these have their own faults
                singles.append(Single(metric, value, error))
        if not singles and not self.faults:
            self.fault("", "has no event with a value", "event,time,sigma")
        return Measured(singles=tuple(singles))

    def _sigma_of_event(self, cell: str, line: int, head: _Head, of: Unit, si: str) -> float:
        where = f" line {line}, column {head.text}"
        number = self._number(cell, where)
        of = self._unit(head.text, head.unit, si) if head.unit else of
        return np.nan if number is None else self._admitted(number, of, si, True, where)

    def _unit_of_event(self, where: str, text: str, si: str, head: _Head) -> Unit:
        if head.name == "time" and si != "s":
            self.fault(where, f"is no time but a quantity in {si}", "call the column value")
            return Unit(1.0)
        try:
            return unit(text, si)
        except ValueError as error:
            self.fault(where, f"{text!r} is no unit of a quantity in {si}", str(error))
            return Unit(1.0)


_HEAD = re.compile(r"^(?P<name>.*?)(?P<space>\s*)\[(?P<unit>[^\[\]]*)\]$")


def _head(cell: str) -> _Head:
    """Name and unit of a header; brackets without a space before them may also hold an entry, `tension[3]`."""
    text = cell.strip()
    match = _HEAD.match(text)
    if match is None or not (match["space"] or spelled(match["unit"])):
        return _Head(text, text, "")
    return _Head(text, match["name"], match["unit"].strip())
