"""Estimates as rows of data: quantity, formula, source, and the simulated value.

A line of `rows.csv` names its data by paths of attributes: from a brake application (or a part that it
heats, a synthesis, a pair of materials) to the value and to the simulated one; `symbols.csv` has the paths to the
numbers put into formulas. A row whose path does not exist is omitted.
"""

import csv
import dataclasses
import inspect
import math
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Column, Table, Tabular, plain
from .._parts._scene import Scene, band_brake, check
from .._run._result import Result
from ._braking import Braking
from ._heated import Absent, run_values, there
from ._inputs import EstimateData, Input, settle
from .statics import classical_staged_stop, classical_stop

# --- contents of a row ----------------------------------------------------------------------------------------------


class Number(NamedTuple):
    """A number put into a formula: its symbol, value and unit.

    Example:
        >>> str(sb.formulas.Number("R", 0.59, "m"))
        'R = 0.59 m'
    """

    symbol: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.symbol} = {self.value:.5g} {_unit(self.unit)}".rstrip()


@dataclasses.dataclass(frozen=True)
class EstimateRow:
    """One estimate: its `name`, `formula`, `value` and `unit`, the `source` of the formula, the `simulated` value

    (`None` without a run, or where the run has no such number) and `why` the two differ. Temperatures are in K.

    Example:
        >>> row = sb.estimates(scene)["friction work"]
        >>> row.formula, round(row.value / 1e3, 2)
        ('W = M_b φ', 508.01)
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

    Example:
        >>> row = sb.synthesize(scene).step(1)[0]
        >>> row.step, row.name, row.formula
        (1, 'thermal penetration depth, rim', 'b = 1.73 √(a τ)')
    """

    step: int = 0
    numbers: tuple[Number, ...] = ()
    verdict: str = ""

    def as_dict(self) -> dict[str, Any]:
        """`{step, name, formula, value, unit, simulated, difference, source, why, numbers, verdict}`."""
        return {"step": self.step, **super().as_dict(), "numbers": plain(self.numbers), "verdict": self.verdict}


# --- rows as data -----------------------------------------------------------------------------------------------------


def look(context: Any, path: str) -> Any:
    """Value at the end of a path of attributes, entries and methods. Raises `Absent` where there is none."""
    for name in path.split("."):
        if isinstance(context, Mapping):
            context = context.get(name)
        elif name.lstrip("-").isdigit():
            context = context[int(name)]
        else:
            context = getattr(context, name)
        context = there(context() if inspect.isroutine(context) else context)
    return context


def number(context: Any, cell: str) -> float | None:
    """The number in a cell, or at the end of the path in it; `None` where there is none."""
    try:
        return float(cell if cell[0].isdigit() else look(context, cell)) if cell else None
    except Absent:
        return None


def words(context: Any, cell: str) -> str:
    """Text of a cell, or after an @ the path to it."""
    return look(context, cell[1:]) if cell.startswith("@") else cell


@dataclasses.dataclass(frozen=True)
class Row:
    """A line of `rows.csv`: paths to `value` and `simulated` (empty: none), or a number; all else in words.

    - `name`: with attributes in braces, as `thermal penetration depth, {.name}`; `table`: its group of rows
    - `formula`, `why`: or `@` and a path to the text; `why`: or `= ` and the name of the row that has the same reason
    - `numbers` put into the formula: symbols, as `symbol|which` where several have it, or `@` and a path to them
    """

    table: str
    name: str
    formula: str
    value: str
    simulated: str
    unit: str
    source: str
    numbers: str
    why: str

    def at(self, context: Any) -> Iterator[EstimateRow]:
        """The row, if it has a value."""
        value = number(context, self.value)
        if value is not None:
            name, formula, why = self.name.format(context), words(context, self.formula), words(context, self.why)
            simulated = number(context, self.simulated)
            yield EstimateRow(name, formula, value, self.unit, self.source, simulated, why)

    def put_in(self, context: Any) -> Iterator[Number]:
        """The numbers put into the formula."""
        if self.numbers.startswith("@"):
            yield from (Number(symbol, float(value), unit) for symbol, value, unit in look(context, self.numbers[1:]))
        else:
            for symbol in filter(None, self.numbers.split("; ")):
                unit, cell = SYMBOLS[type(context).__name__, symbol]
                yield Number(symbol.partition("|")[0], there(number(context, cell)), unit)


def read(name: str) -> list[dict[str, str]]:
    """Lines of a table of data beside this module."""
    return list(csv.DictReader((resources.files("simbrake") / "formulas" / name).read_text("utf-8").splitlines()))


def _rows() -> tuple[Row, ...]:
    lines = read("rows.csv")
    reasons = {f"= {line['name']}": line["why"] for line in lines}
    return tuple(Row(**(line | {"why": reasons.get(line["why"], line["why"])})) for line in lines)


ROWS = _rows()
#: class and symbol → unit, and the cell with the path to its value
SYMBOLS = {(line["of"], line["symbol"]): (line["unit"], line["value"]) for line in read("symbols.csv")}


def rows_of(table: str, context: Any) -> list[EstimateRow]:
    """The rows of a table that have a value."""
    return [found for row in ROWS if row.table == table for found in row.at(context)]


# --- tables of rows ---------------------------------------------------------------------------------------------------

R = TypeVar("R", bound=EstimateRow)


@dataclasses.dataclass(frozen=True)
class RowTable(Tabular, Generic[R]):
    """Named rows, their inputs, and a description of the brake application (`about`)."""

    about: str
    inputs: tuple[Input, ...]
    rows: tuple[R, ...]
    kind: ClassVar[str] = "row"

    def __getitem__(self, name: str) -> R:
        """The row of that name. Raises `KeyError` with the known names."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"no {self.kind} {name!r}; there are: {', '.join(row.name for row in self.rows)}")

    def __iter__(self) -> Iterator[R]:
        return iter(self.rows)

    def head(self) -> list[str | Table]:
        """Description of the brake application, and the inputs."""
        columns = (Column("name", left=True), Column("value", show=_of_input), Column("unit", left=True, show=_unit))
        inputs = Table([*columns, "source"], self.inputs, "inputs and assumptions")
        return [self.about, "", inputs]


def table_of(rows: Sequence[EstimateRow]) -> list[str | Table]:
    """Rows as a table, those of a synthesis with their numbers, and below it why estimate and run differ."""
    columns = [
        Column("name", heading="", left=True),
        *(Column(name, show=_shown) for name in ("estimate", "simulated", "difference")),
        *(Column(name, left=True, show=_unit) for name in ("unit", "formula")),
    ]
    if any(isinstance(row, SynthesisRow) for row in rows):
        columns += [Column("verdict", heading="", left=True), Column("numbers", heading="with", left=True)]
    lines = []
    for row in rows:
        formula = f"{row.formula} ({row.source})" if row.source else row.formula
        line = [row.name, row.value, row.simulated, row.difference, row.unit, formula]
        lines.append([*line, row.verdict, ", ".join(map(str, row.numbers))] if isinstance(row, SynthesisRow) else line)
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row.why and row.difference:
            reasons.setdefault(row.why, []).append(row.name)
    return [Table(columns, lines), *(f"reason: {why} ({'; '.join(names)})" for why, names in reasons.items())]


def _shown(value: float) -> str:
    return f"{value:.5g}" if math.isfinite(value) else "none"


def _unit(unit: str) -> str:
    """A unit as written after a number: nothing for a pure number."""
    return "" if unit == "1" else unit


def _of_input(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float | int) else ""


# --- the estimates ---------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class EngineeringEstimates(RowTable[EstimateRow]):
    """Classical estimates of a brake from its scene, beside its simulation where there is one.

    - `rows`: the estimates in order; `inputs`: their inputs and the source of each number; `about`: the
      brake application that they are of
    - `estimates["stopping time"]` is one row; `str` gives the table, `as_dict` the same as numbers and words

    Example:
        >>> table = sb.estimates(scene)
        >>> round(table["stopping time"].value, 3)
        1.258
    """

    kind: ClassVar[str] = "estimate"

    def parts(self) -> list[str | Table]:
        return [*self.head(), "", *table_of(self.rows)]

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are `None`."""
        return {"about": self.about, "inputs": plain(self.inputs), "estimates": [row.as_dict() for row in self.rows]}


def no_stop(hint: str) -> InputError:
    """Error of a scene without a classical stop where one is needed."""
    hint = f"it must begin in motion and the brake outweigh its load; or {hint}"
    return InputError([Fault("scene", "has no classical stop", hint)])


def braking_of(run: Scene | Result, data: EstimateData | None) -> tuple[Braking, str]:
    """The brake application of a scene or of a run, with its description. Raises `InputError` as `estimates`."""
    scene = run.scene if isinstance(run, Result) else run
    if isinstance(run, Result) and not run.concrete:
        raise InputError([Fault("run", "is traced or a batch", "give one result with values")])
    check(scene)
    band_brake(scene)
    inputs, staged = settle(scene, data), scene.brake.in_series
    stop = None if staged else classical_stop(scene)
    stages = classical_staged_stop(scene) if staged else None
    if not isinstance(run, Result):
        if stop is None and stages is None:
            raise no_stop("simulate it and give the result")
        return Braking.of(scene, inputs, stop, stages), "; time and friction work are those of a classical stop"
    values = run_values(run)
    if values is None:
        raise InputError([Fault("run", "has no friction work", "no lining slides in it")])
    which = (
        "the brake application" if values.brakings == 1 else f"the hardest of {values.brakings} stretches of sliding"
    )
    about = (
        f" beside the simulation; time and friction work are those of {which} "
        f"from {values.t[0]:.6g} s to {values.t[-1]:.6g} s"
    )
    return Braking.of(scene, inputs, stop, stages, values), about


def estimates(run: Scene | Result, data: EstimateData | None = None) -> EngineeringEstimates:
    """Classical estimates of a brake application from its scene, beside its simulation (model §6.3).

    - `run`: a `Scene`, from which a classical stop gives time and friction work (all linings slide from the first
      moment under the maximum lever tension); or a `Result`: time and work are then those of its hardest brake
      application, and every estimate is shown beside the simulated number where the run has one
    - `data`: numbers that the scene does not have, or that replace them; missing ones are taken from the papers
      or assumed, and the report states the source of each

    Rows: stop and friction power with its shares (S-7…11), thermal penetration depth, Fourier numbers and effective
    volumes (S-15, steps 1–3), partition (S-41, Charron), bulk, surface, flash and maximum temperatures (S-25…28), real
    contact and surfaces (S-34…38), heat balance over four revolutions (S-17…21), thermal stress of the rim.

    Of a staged brake: its stages and the friction work of both pairs (after K), then the rows above for each pair, band
    and linings (`…, external pair`) and linings and rim (`…, internal pair`); balance and thermal stress are of the rim
    alone.

    Raises `InputError` for a scene with input errors, for a scene alone that has no classical stop (at rest at the
    start, a lever that holds the speed, a load that outweighs the brake, a self-locking lining), for a run in which
    nothing slides, and a traced or batched one.

    Example:
        >>> type(sb.estimates(scene)).__name__
        'EngineeringEstimates'
    """
    braking, about = braking_of(run, data)
    found = rows_of("stages" if braking.scene.brake.in_series else "stop", braking) + rows_of("power", braking)
    if braking.scene.brake.in_series:
        for one in braking.of_pairs():
            found += [dataclasses.replace(row, name=f"{row.name}, {one.pair} pair") for row in _of_pair(one)]
    else:
        found += _of_pair(braking)
    return EngineeringEstimates(f"engineering estimates{about}", tuple(braking.inputs.values()), tuple(found))


def _of_pair(b: Braking) -> list[EstimateRow]:
    """Rows of one pair: heated parts, shares, temperatures, contact; of a rim also balance and stress."""
    parts = [row for part in b.parts.values() for row in rows_of("part", part)]
    tables = ["partition", "temperature", "contact", *(["balance", "stress"] if b.part == "rim" else [])]
    return parts + [row for table in tables for row in rows_of(table, b)]
