"""Engineering estimates as a table: formula, number, unit and source, beside the simulated number and why they part."""

import dataclasses
from collections.abc import Iterator
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
        """Estimate less simulated value, `None` without one."""
        if self.simulated is None:
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
        return {
            "about": self.about,
            "inputs": [
                {"name": i.name, "value": _plain(i.value), "unit": i.unit, "source": i.source} for i in self.inputs
            ],
            "estimates": [row.as_dict() for row in self.rows],
        }

    def __str__(self) -> str:
        lines = [self.about, "", "stands on"]
        for i in self.inputs:
            if isinstance(i.value, float | int):
                lines.append(f"  {i.name:18}{i.value:>12.5g} {_unit(i.unit):12} {i.source}")
            else:
                lines.append(f"  {i.name:18}{'':12} {'':12} {i.source}")
        width = max(len(row.name) for row in self.rows)
        lines += ["", f"{'':{width}}  {'estimate':>11} {'simulated':>11} {'difference':>11}  unit"]
        for row, after in zip(self.rows, (*self.rows[1:], None), strict=True):
            told = "".join(f" {'' if x is None else format(x, '.5g'):>11}" for x in (row.simulated, row.difference))
            end = f"{row.formula} ({row.source})" if row.source else row.formula
            lines.append(f"{row.name:{width}}  {row.value:>11.5g}{told}  {_unit(row.unit):8} {end}")
            again = after is not None and after.simulated is not None and after.why == row.why  # said below
            if row.why and row.simulated is not None and not again:
                lines.append(f"{'':{width}}  parts: {row.why}")
        return "\n".join(lines)


def _unit(unit: str) -> str:
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
