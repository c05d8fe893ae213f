"""Rows of estimates as data: what is computed, how, from which source, and what the run beside it says."""

import csv
import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import resources
from typing import Any, ClassVar, Generic, NamedTuple, SupportsFloat, TypeVar

import numpy as np

from .._base._table import Column, Table, Tabular, plain
from ._inputs import Input

C = TypeVar("C")


class Number(NamedTuple):
    """A number put into a formula: its symbol, value and unit."""

    symbol: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.symbol} = {self.value:.5g} {_unit(self.unit)}".rstrip()


@dataclasses.dataclass(frozen=True)
class EstimateRow:
    """One estimate: its `name`, `formula`, `value` and `unit`, the `source` of the formula, the `simulated` value

    (`None` without a run, or where the run has no such number) and `why` the two differ. Temperatures are in K.
    """

    name: str
    formula: str
    value: float
    unit: str
    source: str
    simulated: float | None = None
    why: str = ""

    @property
    def difference(self) -> float | None:
        """Estimate less simulated value, `None` without one or where the estimate is not finite."""
        if self.simulated is None or not np.isfinite(self.value):
            return None
        apart = self.value - self.simulated
        return 0.0 if abs(apart) <= 1e-14 * abs(self.value) else apart  # rounding

    @property
    def words(self) -> str:
        """Name, value and unit."""
        return f"{self.name} {_shown(self.value)} {_unit(self.unit)}".rstrip()

    def as_dict(self) -> dict[str, Any]:
        """`{name, formula, value, unit, simulated, difference, source, why}`."""
        keys = ("name", "formula", "value", "unit", "simulated", "difference", "source", "why")
        return {key: plain(getattr(self, key)) for key in keys}


@dataclasses.dataclass(frozen=True)
class SynthesisRow(EstimateRow):
    """A row of one step: an `EstimateRow` with its `step` (1…12) and the `numbers` put into the formula.

    `verdict`, of a permissible limit: `within limit` or `exceeded` by the estimate, and by the run where that differs.
    """

    step: int = 0
    numbers: tuple[Number, ...] = ()
    verdict: str = ""

    def as_dict(self) -> dict[str, Any]:
        """`{step, name, formula, value, unit, simulated, difference, source, why, numbers, verdict}`."""
        return {"step": self.step, **super().as_dict(), "numbers": plain(self.numbers), "verdict": self.verdict}


T = TypeVar("T")


class Absent(LookupError):
    """What a row asks for does not exist, as a run beside the estimates: it has no value, or no simulated one."""


def there(value: T | None) -> T:
    """The value, which a row needs. Raises `Absent` where there is none."""
    if value is None:
        raise Absent
    return value


#: symbols of numbers put into formulas: symbol (`symbol|which` where several have it) → unit and value in a context
Symbols = Mapping[str, tuple[str, Callable[[C], SupportsFloat]]]
Given = Sequence[tuple[str, SupportsFloat, str]]


def _absent(context: Any) -> float:
    raise Absent


@dataclasses.dataclass(frozen=True)
class Of(Generic[C]):
    """The functions of a row: its `value` in a context and the `simulated` one, raising `Absent` where there is none.

    `formula`, `why` (`None`: as in the table of words) and `numbers` where these depend on the context.
    """

    value: Callable[[C], SupportsFloat]
    simulated: Callable[[C], SupportsFloat] = _absent
    formula: Callable[[C], str] | None = None
    why: Callable[[C], str | None] = lambda _: None
    numbers: Callable[[C], Given] | None = None


@dataclasses.dataclass(frozen=True)
class Row(Generic[C]):
    """A row as data: name (`{part}`: that of the context), formula in words, unit, source, why estimate and run differ,

    the functions that fill it, and the numbers put into the formula; `table`: which one of `rows.csv` it is in.
    """

    table: str
    name: str
    formula: str
    unit: str
    source: str
    why: str
    of: Of[C]
    numbers: Callable[[C], Given]

    def found(self, context: C) -> tuple[float | None, float | None]:
        """Its value and the simulated one, `None` where there is none."""
        found: list[float | None] = []
        for function in (self.of.value, self.of.simulated):
            try:
                found.append(float(function(context)))
            except Absent:
                found.append(None)
        return found[0], found[1]

    def at(self, context: C, part: str = "") -> EstimateRow | None:
        """The row of a context, `None` where it has no value."""
        value, simulated = self.found(context)
        if value is None:
            return None
        formula, why = self.formula if self.of.formula is None else self.of.formula(context), self.of.why(context)
        name, why = self.name.replace("{part}", part), self.why if why is None else why
        return EstimateRow(name, formula, value, self.unit, self.source, simulated, why)

    def of_step(self, step: int, context: C, part: str = "", *, ending: str = "") -> SynthesisRow | None:
        """The row of a context in a step of the synthesis, with the numbers put in."""
        row = self.at(context, part)
        if row is None:
            return None
        numbers = tuple(Number(symbol, float(value), unit) for symbol, value, unit in self.numbers(context))
        return SynthesisRow(**{**vars(row), "name": row.name + ending}, step=step, numbers=numbers)


def read(name: str) -> list[dict[str, str]]:
    """Lines of a table of data beside this module."""
    return list(csv.DictReader((resources.files("simbrake") / "formulas" / name).read_text("utf-8").splitlines()))


def rows(symbols: Symbols[C], functions: Mapping[str, Of[C]], *tables: str) -> dict[str, Row[C]]:
    """Rows by name, each with its functions, and in words as in these tables of `rows.csv`.

    There a reason `= name` is that of another row. Raises `KeyError` where names differ.
    """
    lines = read("rows.csv")
    reasons = {line["name"]: line["why"] for line in lines if not line["why"].startswith("= ")}
    lines = {line["name"]: line for line in lines if line["table"] in tables}
    if different := lines.keys() ^ functions.keys():
        raise KeyError(f"only in rows.csv or only in its functions: {', '.join(sorted(different))}")

    def numbers(keys: list[str]) -> Callable[[C], Given]:
        known = [(key.partition("|")[0], *symbols[key]) for key in keys]
        return lambda context: [(symbol, value(context), unit) for symbol, unit, value in known]

    found = {}
    for name, of in functions.items():
        table, _, formula, unit, source, put_in, why = lines[name].values()
        why = reasons[why.removeprefix("= ")] if why.startswith("= ") else why
        given = of.numbers or numbers(put_in.split("; ") if put_in else [])
        found[name] = Row(table, name, formula, unit, source, why, of, given)
    return found


def fill(table: Mapping[str, Row[C]], context: C, *tables: str, part: str = "") -> list[EstimateRow]:
    """The rows that have a value in a context, of all or of some `tables`."""
    chosen = [row.at(context, part) for row in table.values() if not tables or row.table in tables]
    return [row for row in chosen if row is not None]


R = TypeVar("R", bound=EstimateRow)


@dataclasses.dataclass(frozen=True)
class RowTable(Tabular, Generic[R]):
    """Rows with a name each, the inputs that they are made from, and what braking they are `about`."""

    about: str
    inputs: tuple[Input, ...]
    rows: tuple[R, ...]
    kind: ClassVar[str] = "row"

    def __getitem__(self, name: str) -> R:
        """The row of that name. Raises `KeyError` with the names there are."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"no {self.kind} {name!r}; there are: {', '.join(row.name for row in self.rows)}")

    def __iter__(self) -> Iterator[R]:
        return iter(self.rows)

    def head(self) -> list[str | Table]:
        """What the rows are about, and the inputs."""
        columns = (Column("name", left=True), Column("value", show=_of_input), Column("unit", left=True, show=_unit))
        inputs = Table([*columns, "source"], self.inputs, "inputs and assumptions")
        return [self.about, "", inputs]


def table_of(rows: Iterable[EstimateRow], *, numbers: bool = False) -> list[str | Table]:
    """Rows as a table, the reasons why estimate and run differ below it."""
    rows = list(rows)
    columns = [
        Column("name", heading="", left=True),
        *(Column(name, show=_shown) for name in ("estimate", "simulated", "difference")),
        *(Column(name, left=True, show=_unit) for name in ("unit", "formula")),
    ]
    lines: list[dict[str, Any]] = [
        {"name": row.name, "estimate": row.value, "simulated": row.simulated, "difference": row.difference}
        | {"unit": row.unit, "formula": f"{row.formula} ({row.source})" if row.source else row.formula}
        for row in rows
    ]
    if numbers:
        columns += [Column("verdict", heading="", left=True), Column("numbers", heading="with", left=True)]
        for line, row in zip(lines, rows, strict=True):
            assert isinstance(row, SynthesisRow)
            line |= {"verdict": row.verdict, "numbers": ", ".join(str(number) for number in row.numbers)}
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row.why and row.difference:
            reasons.setdefault(row.why, []).append(row.name)
    return [Table(columns, lines), *(f"reason: {why} ({'; '.join(names)})" for why, names in reasons.items())]


def _shown(value: float) -> str:
    return f"{value:.5g}" if math.isfinite(value) else "none"


def _unit(unit: str) -> str:
    """A unit as it stands behind a number: nothing for a pure one."""
    return "" if unit == "1" else unit


def _of_input(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float | int) else ""
