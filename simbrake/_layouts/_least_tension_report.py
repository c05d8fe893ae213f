"""What a search for the least tension found: values, active limits, and what a limit costs."""

import dataclasses
from typing import Any

from .._parts._scene import Scene


@dataclasses.dataclass(frozen=True)
class LimitRow:
    """One limit: the metric at the `start` and at the optimum, and `sensitivity` = d(objective)/d(limit), ≤ 0."""

    name: str
    unit: str
    start: float
    value: float
    limit: float
    active: bool
    sensitivity: float


@dataclasses.dataclass(frozen=True)
class BoundRow:
    """One free number: at the `start`, at the optimum, the bound it stands at (`low`, `high` or none), and
    `sensitivity` = d(objective)/d(bound)."""

    path: str
    start: float
    value: float
    bound: str
    sensitivity: float


@dataclasses.dataclass(frozen=True)
class LeastTension:
    """The scene of least tension, what it costs and what holds it.

    - `objective`, its `unit`, its values at the `start` and at the optimum (`value`)
    - `limits`, `variables`: with their multipliers, as derivatives of the objective by limit or bound
    - `success`: the search ended at a point that keeps all limits;  `stationarity`: what the active limits and bounds
      leave of the gradient, relative to it (0 at an optimum)
    - `runs` of the simulation, each with its derivatives
    """

    scene: Scene
    objective: str
    unit: str
    start: float
    value: float
    limits: tuple[LimitRow, ...]
    variables: tuple[BoundRow, ...]
    success: bool
    message: str
    iterations: int
    runs: int
    stationarity: float

    @property
    def values(self) -> dict[str, float]:
        """The free numbers at the optimum, by path."""
        return {row.path: row.value for row in self.variables}

    def as_dict(self) -> dict[str, Any]:
        """Everything but the scene, as numbers, lists and words."""
        found = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "scene"}
        for name in ("limits", "variables"):
            found[name] = [dataclasses.asdict(row) for row in found[name]]
        return found

    def __str__(self) -> str:
        how = "found" if self.success else f"NOT found ({self.message})"
        lines = [
            f"least {self.objective} {how}: {self.value:.8g} {self.unit} (start {self.start:.8g}) "
            f"in {self.iterations} iterations, {self.runs} runs; stationary to {self.stationarity:.1e}"
        ]
        wide = max(len(row.path) for row in self.variables)
        wide = max([wide, *(len(row.name) for row in self.limits)])
        for row in self.limits:
            cost = f"d{self.objective}/dlimit = {row.sensitivity:.6g} {self.unit}/{row.unit}" if row.active else "slack"
            lines.append(
                f"  {row.name:{wide}}  {row.start:12.6g} → {row.value:12.6g} ≤ {row.limit:.6g} {row.unit}  {cost}"
            )
        for row in self.variables:
            bound = f"at its {row.bound} bound, d/dbound = {row.sensitivity:.6g}" if row.bound else ""
            lines.append(f"  {row.path:{wide}}  {row.start:12.6g} → {row.value:12.6g}  {bound}".rstrip())
        return "\n".join(lines)
