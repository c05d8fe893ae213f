"""Tables of sensitivities: derivatives, elasticities and values at bounds of one metric."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import nearest
from .._base._quantity import unit_suffix
from .._base._table import Column, Table, Tabular, frozen

ENDS = ("lower", "upper")
#: ends of paths of what nobody changes by a share: constants of nature, counts
FIXED = ("gravity", "line_count", "initial.time", "end_time")
#: an elasticity below this is rounding error
_ROUNDING = 1e-13
#: rows that are printed
_SHOWN = 30


class Sensitivity(NamedTuple):
    """Sensitivity of a metric `M` to one parameter `p` of a scene.

    - `path`, `unit`, `value` of the parameter (SI), and its `meaning`
    - `derivative` `dM/dp`
    - `elasticity` `(p/M) dM/dp`: percent of the metric for one percent of the parameter
    - `half`: half of the range of `p`
    - `low`, `high`: the metric at its bounds; `None` where it has
      no value or was not evaluated
    - `tangent`: change of the metric over `half` along the derivative. What `high − M`
      and `M − low` differ from it by is the curvature:
      `½ (low + high) − M = ½ half² d²M/dp² + O(half⁴)`
    - `error`: estimated error of the derivative by integration in time, from the same
      derivative at a tenth of the tolerance (above 1e-9 at 1e-12, below 1e-12 at ten
      times); NaN where that run has none
    - `note`: whether the derivative is one-sided, or why there is none (`derivative` is
      then NaN); changes within the range that limit its validity; empty if none

    A path that ends in `[:]` means all entries of a list: `value` is their mean,
    `derivative` that of one shift of all of them, `elasticity` and range those of one
    factor for all of them.

    Example:
        >>> table = sb.sensitivity(scene, "stopping_time", "initial.omega", span=None)
        >>> round(table.at("initial.omega").derivative, 5)
        0.05241
    """

    path: str
    unit: str
    meaning: str
    value: float
    derivative: float
    elasticity: float
    half: float | None = None
    low: float | None = None
    high: float | None = None
    note: str = ""
    tangent: float | None = None
    error: float = math.nan


@frozen
class SensitivityTable(Tabular):
    """Sensitivities of one metric, the largest elasticity first; `notes` concern the
    whole run.

    Example:
        >>> table = sb.sensitivity(scene, "stopping_time", "initial.omega", span=None)
        >>> [row.path for row in table.rows]
        ['initial.omega']
    """

    metric: str
    unit: str
    value: float
    rows: tuple[Sensitivity, ...]
    notes: tuple[str, ...] = ()

    def at(self, path: str) -> Sensitivity:
        """The row of a path; raises `KeyError` with the nearest paths."""
        for row in self.rows:
            if row.path == path:
                return row
        raise KeyError(
            f"{path}: not in the table; "
            f"{nearest(path, (row.path for row in self.rows), cutoff=0.3)}"
        )

    @property
    def matters(self) -> tuple[Sensitivity, ...]:
        """The rows of `wholes` that influence the metric or have a note."""
        return tuple(row for row in self.wholes if row.note or _moves(row))

    @property
    def wholes(self) -> tuple[Sensitivity, ...]:
        """The rows without the single entries of lists."""
        return tuple(
            row
            for row in self.rows
            if row.path.endswith("[:]") or not row.path.endswith("]")
        )

    def bars(self, most: int) -> tuple[float, list[tuple[Sensitivity, dict[str, Any]]]]:
        """Of a tornado chart the value of the metric, and parameters with the ends of
        their bars at the `low` and the `high` bound.

        Without ranges in the table the bars are elasticities, which count from 0.
        """
        free = [row for row in self.matters if not row.path.endswith(FIXED)]
        ranged = [row for row in free if row.low is not None and row.high is not None]
        if ranged:
            return self.value, [
                (row, {"low": row.low, "high": row.high}) for row in ranged[:most]
            ]
        rows = [row for row in free if np.isfinite(row.elasticity)]
        return 0.0, [
            (row, {"high" if row.elasticity > 0 else "low": row.elasticity})
            for row in rows[:most]
        ]

    def parts(self) -> Iterator[str | Table]:
        """The single entries of lists are left out, parameters without influence only
        counted."""
        yield f"{self.metric} = {self.value:.8g}{unit_suffix(self.unit)}"
        shown = self.matters[:_SHOWN]
        ends = any(row.low is not None or row.high is not None for row in shown)
        columns = [("path", "parameter p"), Column("value", show=".6g"), "unit"]
        columns += [
            Column("derivative", show=".5g"),
            Column("error", heading="± error", show=".1g"),
        ]
        columns += [Column("elasticity", show=".4g")]
        columns += [Column("half", heading="± half", show=".3g", hidden=not ends)]
        columns += [
            Column(f"at the {name} bound", show=".7g", hidden=not ends) for name in ENDS
        ]
        fields = (
            "path",
            "value",
            "unit",
            "derivative",
            "error",
            "elasticity",
            "half",
            "low",
            "high",
            "note",
        )
        rows = [tuple(getattr(row, field) for field in fields) for row in shown]
        yield Table([*columns, ("note", "")], rows)
        left = len(self.wholes) - len(shown)
        without = len(self.wholes) - len(self.matters)
        rest = [f"{left - without} more"] * (left > without) + [
            f"{without} without influence"
        ] * bool(without)
        if rest:
            yield f"and {' and '.join(rest)}"
        yield from (f"note: {note}" for note in self.notes)


def _moves(row: Sensitivity) -> bool:
    """A number that is 0 has no elasticity, but may have an influence."""
    return row.derivative != 0 and (row.value == 0 or abs(row.elasticity) > _ROUNDING)
