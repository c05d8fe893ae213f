"""The parametric synthesis as a report: twelve steps, each with formula, numbers put in, source, and the run beside."""

import dataclasses
import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from ._estimate_data import Input
from ._estimate_report import EstimateRow, input_dicts, input_lines, unit_shown

#: the steps of S in its own order
STEPS = (
    "effective depth of heat",
    "Fourier numbers",
    "effective volumes",
    "partition of the heat",
    "mean bulk temperatures",
    "properties at these temperatures, where above 150 °C",
    "depth, Fourier numbers, volumes, partition once more",
    "temperatures of the layers, rational thickness",
    "maximum temperature of the friction surface",
    "heat balance",
    "thermal stress of the rim",
    "operating characteristics",
)


class Number(NamedTuple):
    """A number put into a formula: its symbol, value and unit."""

    symbol: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.symbol} = {self.value:.5g}" + (f" {unit_shown(self.unit)}" if unit_shown(self.unit) else "")


@dataclasses.dataclass(frozen=True)
class SynthesisRow(EstimateRow):
    """A figure of one step: an `EstimateRow` with its `step` (1…12) and the `numbers` put into the formula.

    `verdict`, of a permissible limit: `within limit` or `exceeded` by the estimate, and by the run where that differs.
    """

    step: int = 0
    numbers: tuple[Number, ...] = ()
    verdict: str = ""

    @classmethod
    def of(cls, step: int, row: EstimateRow, *numbers: tuple[str, float, str], **changes: Any) -> "SynthesisRow":
        """An estimate as a figure of a step, with the numbers put in; `changes` of its other fields."""
        fields = {field.name: getattr(row, field.name) for field in dataclasses.fields(EstimateRow)}
        return cls(**{**fields, **changes}, step=step, numbers=tuple(Number(*number) for number in numbers))

    def as_dict(self) -> dict[str, Any]:
        """`{step, name, formula, value, unit, simulated, difference, source, why, numbers, verdict}`."""
        told = super().as_dict()
        keys = ("name", "formula", "value", "unit", "simulated", "difference", "source", "why")
        numbers = [{**n._asdict(), "value": float(n.value) if math.isfinite(n.value) else None} for n in self.numbers]
        return {"step": self.step, **{key: told[key] for key in keys}, "numbers": numbers, "verdict": self.verdict}


@dataclasses.dataclass(frozen=True)
class Synthesis:
    """The parametric synthesis of a brake for one braking: figures of S's twelve steps beside the simulated ones.

    - `rows` in order of the steps; `inputs`: what they stand on; `about`: the braking
    - `rounds`: how often steps 1 to 5 were repeated with properties at temperature; `replaced`: parts that have them
    - `rim_thickness`, `lining_thickness`: rational (m), `inf` where none will do
    - `synthesis["friction work"]` is one figure, `synthesis.step(8)` those of a step; `str` gives the report,
      `as_dict` the same as numbers and words
    """

    about: str
    inputs: tuple[Input, ...]
    rows: tuple[SynthesisRow, ...]
    rounds: int
    replaced: tuple[str, ...]

    def __getitem__(self, name: str) -> SynthesisRow:
        """The figure of that name. Raises `KeyError` with the names there are."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"no figure {name!r}; there are: {', '.join(row.name for row in self.rows)}")

    def __iter__(self) -> Iterator[SynthesisRow]:
        return iter(self.rows)

    def step(self, number: int) -> tuple[SynthesisRow, ...]:
        """The figures of one step, 1…12; the first is its main one."""
        return tuple(row for row in self.rows if row.step == number)

    @property
    def rim_thickness(self) -> float:
        """Rational thickness of the rim (m)."""
        return self["rational thickness, rim"].value

    @property
    def lining_thickness(self) -> float:
        """Rational thickness of the linings without what they may wear (m)."""
        return self["rational thickness, lining"].value

    @property
    def limits(self) -> dict[str, str]:
        """Name of every permissible limit that was looked at → its verdict."""
        return {row.name: row.verdict for row in self.rows if row.verdict}

    @property
    def exceeded(self) -> list[str]:
        """Names of the limits that the estimate or the run exceeds: their margin is below 0."""
        margins = [row for row in self.rows if row.verdict]
        return [row.name for row in margins if row.value < 0 or (row.simulated is not None and row.simulated < 0)]

    def as_list(self) -> list[dict[str, Any]]:
        """Every figure as numbers and words; numbers that are not finite are `None`."""
        return [row.as_dict() for row in self.rows]

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words; numbers that are not finite are `None`."""
        about = {"about": self.about, "rounds": self.rounds, "replaced": list(self.replaced)}
        return {**about, "inputs": input_dicts(self.inputs), "steps": self.as_list()}

    def __str__(self) -> str:
        lines = [self.about, "", *input_lines(self.inputs)]
        width = max(len(row.name) for row in self.rows)
        lines += ["", f"{'':{width + 6}}{'estimate':>11} {'simulated':>11} {'difference':>11}  unit"]
        for number, title in enumerate(STEPS, 1):
            rows = self.step(number)
            lines.append(f"{f'{number}.':4}{title}: {_figure(rows[0])}")
            for row, after in itertools.zip_longest(rows, rows[1:]):
                lines += _row_lines(row, width)
                if row.why and row.difference and not (after is not None and after.why == row.why):
                    lines.append(f"{'':8}parts: {row.why}")
        return "\n".join(lines)


def _number(x: float | None) -> str:
    return "" if x is None else "none" if not math.isfinite(x) else f"{x:.5g}"


def _figure(row: SynthesisRow) -> str:
    return f"{row.name} {_number(row.value)} {unit_shown(row.unit)}".rstrip()


def _row_lines(row: SynthesisRow, width: int) -> list[str]:
    """A figure with its formula; below it the numbers put in."""
    columns = "".join(f" {_number(x):>11}" for x in (row.value, row.simulated, row.difference))
    source = f" ({row.source})" if row.source else ""
    verdict = f"  {row.verdict}" if row.verdict else ""
    lines = [f"    {row.name:{width}} {columns}  {unit_shown(row.unit):8} {row.formula}{source}{verdict}"]
    if row.numbers:
        lines.append(f"{'':8}with {', '.join(str(number) for number in row.numbers)}")
    return lines
