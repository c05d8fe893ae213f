"""Engineering estimates as a table: formula, number, unit and source, beside the simulated number and why they part."""

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ._estimate_data import Input


@dataclasses.dataclass(frozen=True)
class EstimateRow:
    """One estimate: its `name`, `formula`, `value` and `unit`, the `source` of the formula, the `simulated` value

    (`None` without a run, or where the run has no such number) and `why` the two part. Temperatures are in K.
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

    def as_dict(self) -> dict[str, Any]:
        numbers = {key: _json(getattr(self, key)) for key in ("value", "simulated", "difference")}
        words = {key: getattr(self, key) for key in ("name", "formula", "unit", "source", "why")}
        return words | numbers


def _json(value: Any) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None


@dataclasses.dataclass(frozen=True)
class EngineeringEstimates:
    """Classical estimates of a brake from its scene, beside its simulation where there is one.

    - `rows`: the estimates in order; `inputs`: what they stand on and where each number is from; `about`: the braking
      that they are of
    - `estimates["stopping time"]` is one row; `str` gives the table, `as_dict` the same as numbers and words
    """

    about: str
    inputs: tuple[Input, ...]
    rows: tuple[EstimateRow, ...]

    def __getitem__(self, name: str) -> EstimateRow:
        """The row of that name. Raises `KeyError` with the names there are."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"no estimate {name!r}; there are: {', '.join(row.name for row in self.rows)}")

    def __iter__(self) -> Iterator[EstimateRow]:
        return iter(self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words; numbers that are not finite are `None`."""
        rows = [row.as_dict() for row in self.rows]
        return {"about": self.about, "inputs": input_dicts(self.inputs), "estimates": rows}

    def __str__(self) -> str:
        lines = [self.about, "", *input_lines(self.inputs)]
        width = max(len(row.name) for row in self.rows)
        lines += ["", f"{'':{width}}  {'estimate':>11} {'simulated':>11} {'difference':>11}  unit"]
        for row, after in zip(self.rows, (*self.rows[1:], None), strict=True):
            told = "".join(f" {'' if x is None else format(x, '.5g'):>11}" for x in (row.simulated, row.difference))
            end = f"{row.formula} ({row.source})" if row.source else row.formula
            lines.append(f"{row.name:{width}}  {row.value:>11.5g}{told}  {unit_shown(row.unit):8} {end}")
            again = after is not None and after.simulated is not None and after.why == row.why  # said below
            if row.why and row.simulated is not None and not again:
                lines.append(f"{'':{width}}  parts: {row.why}")
        return "\n".join(lines)


def input_lines(inputs: Iterable[Input]) -> list[str]:
    """What estimates stand on, line by line."""
    lines = ["stands on"]
    for i in inputs:
        number = f"{i.value:>12.5g} {unit_shown(i.unit):12}" if isinstance(i.value, float | int) else f"{'':25}"
        lines.append(f"  {i.name:18}{number} {i.source}")
    return lines


def input_dicts(inputs: Iterable[Input]) -> list[dict[str, Any]]:
    """The same as numbers and words."""
    return [{"name": i.name, "value": _plain(i.value), "unit": i.unit, "source": i.source} for i in inputs]


def unit_shown(unit: str) -> str:
    """A unit as it stands behind a number: nothing for a pure one."""
    return "" if unit == "1" else unit


def _plain(value: Any) -> Any:
    """A number as it is, a material or a set of constants as its numbers by name."""
    if isinstance(value, float | int | np.floating | np.ndarray):
        return _json(value)
    fields = (
        value._asdict()
        if hasattr(value, "_asdict")
        else {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    )
    return {key: part if isinstance(part, str) or part is None else _json(part) for key, part in fields.items()}
