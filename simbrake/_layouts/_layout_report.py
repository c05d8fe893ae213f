"""What a designed layout looks like: angles, areas and targets of every lining, beside where it started from."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from .._parts._scene import Scene


@dataclasses.dataclass(frozen=True)
class LayoutRow:
    """One layout: `angle` (n,) in rad, `area` (n,) in m² or `None`, and every target (n,) by name, with its unit."""

    name: str
    angle: Float[np.ndarray, " n"]
    area: Float[np.ndarray, " n"] | None
    values: dict[str, Any]
    units: dict[str, str]

    @property
    def non_uniformity(self) -> float:
        """Greatest over least of a target along the band, of the worst target; `nan` where it could not be found."""
        if not self.values:
            return float("nan")
        return float(max(np.max(value) / np.min(value) for value in self.values.values()))

    def as_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "angle": self.angle.tolist(),
            "area": None if self.area is None else self.area.tolist(),
            "values": {name: np.asarray(value).tolist() for name, value in self.values.items()},
            "units": dict(self.units),
            "non_uniformity": self.non_uniformity,
        }


@dataclasses.dataclass(frozen=True)
class LayoutDesign:
    """A layout that levels a target: the scene with it, and the layouts it is compared with.

    - `rows`: the layout `given`, that of the `closed form` (where there is one, else `note` says why not), `optimum`
    - `iterations` of the search, `runs` of the simulation with its derivatives (static: evaluations)
    """

    scene: Scene
    target: tuple[str, ...]
    over: str
    free: str
    rows: tuple[LayoutRow, ...]
    iterations: int
    runs: int
    note: str = ""

    def row(self, name: str) -> LayoutRow:
        """One of `rows` by its name. Raises `KeyError` where there is none."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    @property
    def angle(self) -> Float[np.ndarray, " n"]:
        """Lining angles (rad)."""
        return self.row("optimum").angle

    @property
    def area(self) -> Float[np.ndarray, " n"] | None:
        """Lining areas (m²)."""
        return self.row("optimum").area

    @property
    def non_uniformity(self) -> float:
        """Greatest over least of the target along the band."""
        return self.row("optimum").non_uniformity

    def as_dict(self) -> dict[str, Any]:
        """Everything but the scene, as numbers, lists and words."""
        return {
            "target": list(self.target),
            "over": self.over,
            "free": self.free,
            "layouts": [row.as_dict() for row in self.rows],
            "iterations": self.iterations,
            "runs": self.runs,
            "note": self.note,
        }

    def __str__(self) -> str:
        over = "at full slip" if self.over == "static" else "over the braking"
        freed = {"angle": "angles", "area": "areas", "both": "angles and areas"}[self.free]
        lines = [f"equal {' and '.join(self.target)} {over}: {freed} found in {self.iterations} iterations"]
        if self.note:
            lines.append(f"no closed form to compare with: {self.note}")
        columns = [column for row in self.rows for column in self._columns(row)]
        spans = [(row.name, sum(len(c[0]) + 2 for c in self._columns(row))) for row in self.rows]
        lines.append(" " * 8 + "".join(f"{name:>{width}}" for name, width in spans))
        lines.append("lining  " + "".join(f"  {head}" for head, _ in columns))
        for i in range(len(self.angle)):
            cells = "".join(f"  {values[i]:{len(head)}.5g}" for head, values in columns)
            lines.append(f"{i + 1:6}  {cells}")
        ends = "".join(f"{row.non_uniformity:>{width}.7g}" for row, (_, width) in zip(self.rows, spans, strict=True))
        lines.append(f"max/min {ends}")
        return "\n".join(lines)

    def _columns(self, row: LayoutRow) -> list[tuple[str, np.ndarray]]:
        found = [("     β, °", np.degrees(row.angle))]
        if self.free != "angle" and row.area is not None:
            found.append(("  A, cm²", 1e4 * row.area))
        for name, value in row.values.items():
            unit = f", {row.units[name]}" if row.units[name] else ""
            found.append((f"{name + unit:>12}", value))
        return found
