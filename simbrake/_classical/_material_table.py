"""The table of a comparison of materials: rows, verdicts, ranking, labelled data."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ._material_data import LiningMaterial, RimMaterial
from ._material_estimate import QUANTITIES, Compared

_ZERO = 273.15  # K


@dataclasses.dataclass(frozen=True)
class EnergyLevel:
    """One duty of a comparison: what sets it apart, and the friction work (J) of its hardest braking, least and most

    among the pairs: with fade, or with an inertia that follows the rim's mass, runs differ.
    """

    label: str
    least: float
    most: float

    @property
    def words(self) -> str:
        """The work in kJ."""
        low, high = f"{self.least / 1e3:.4g}", f"{self.most / 1e3:.4g}"
        return f"{low} kJ" if low == high else f"{low}…{high} kJ"


@dataclasses.dataclass(frozen=True)
class MaterialRow:
    """One rim and lining material at one energy level.

    - `level`: index of the level; `rim`, `lining`: names; `row["surface"]` is one quantity, its estimate (`value`)
      and the `simulated` number; names as in `quantities`
    - `fails`: limits that the pair exceeds, by the simulated number where there is one; empty if it is within all
    - `greatest_work` (J): of one braking that the pair bears by the estimates; `ends`: what ends it
    """

    level: int
    rim: str
    lining: str
    quantities: dict[str, Compared]
    fails: tuple[str, ...]
    greatest_work: float
    ends: str

    @property
    def admissible(self) -> bool:
        return not self.fails

    def __getitem__(self, name: str) -> Compared:
        """A quantity by its name. Raises `KeyError` with the names there are."""
        if name not in self.quantities:
            raise KeyError(f"no quantity {name!r}; there are: {', '.join(self.quantities)}")
        return self.quantities[name]

    def as_dict(self) -> dict[str, Any]:
        numbers = {
            name: {"estimate": _finite(one.value), "simulated": _finite(one.simulated), "unit": QUANTITIES[name][0]}
            for name, one in self.quantities.items()
        }
        words = {"level": self.level, "rim": self.rim, "lining": self.lining}
        verdict = {"admissible": self.admissible, "fails": list(self.fails)}
        return words | verdict | {"greatest_work": _finite(self.greatest_work), "ends": self.ends} | numbers


@dataclasses.dataclass(frozen=True, eq=False)
class MaterialComparison:
    """Rim materials and linings for one duty at one or several energy levels, side by side.

    - `levels`, `rims`, `linings`: what is compared; `rows`: one for each combination, level by level; `notes`: what was
      assumed or could not be simulated
    - `comparison.row("brass", "FK-24A")` is one row; `str` gives the table; `as_dict` the same as numbers and words;
      `dataset` as labelled data; `ranking` the pairs by the work that they can take
    """

    about: str
    levels: tuple[EnergyLevel, ...]
    rims: tuple[RimMaterial, ...]
    linings: tuple[LiningMaterial, ...]
    rows: tuple[MaterialRow, ...]
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[MaterialRow]:
        return iter(self.rows)

    def row(self, rim: str, lining: str | None = None, level: int = 0) -> MaterialRow:
        """The row of a rim and a lining (the first, if none is named) at a level. Raises `KeyError` for other names."""
        lining = self.linings[0].name if lining is None else lining
        level = range(len(self.levels))[level]
        for row in self.rows:
            if (row.rim, row.lining, row.level) == (rim, lining, level):
                return row
        names = f"rims {', '.join(r.name for r in self.rims)}; linings {', '.join(x.name for x in self.linings)}"
        raise KeyError(f"no row {rim!r} with {lining!r}; there are: {names}")

    def ranking(self, level: int = -1) -> list[MaterialRow]:
        """Rows of a level, those that can take the greatest friction work first, admissible ones before all others."""
        level = range(len(self.levels))[level]
        rows = [row for row in self.rows if row.level == level]
        return sorted(rows, key=lambda row: (not row.admissible, -row.greatest_work))

    @property
    def simulated(self) -> bool:
        """Whether any row has simulated temperatures."""
        return any(row["surface"].simulated is not None for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words (SI); numbers that are not finite are `None`."""
        return {
            "about": self.about,
            "levels": [dataclasses.asdict(level) for level in self.levels],
            "materials": {
                kind: [{"name": x.name, "numbers": x.numbers, "sources": x.sources} for x in found]
                for kind, found in (("rims", self.rims), ("linings", self.linings))
            },
            "rows": [row.as_dict() for row in self.rows],
            "ranking": [{"rim": row.rim, "lining": row.lining} for row in self.ranking()],
            "notes": list(self.notes),
        }

    def dataset(self) -> Any:
        """The same as an `xarray.Dataset` over `level`, `rim`, `lining`; simulated numbers in `<name>_simulated`."""
        import xarray as xr

        names = [r.name for r in self.rims], [x.name for x in self.linings]
        shape = len(self.levels), len(names[0]), len(names[1])
        dims = ("level", "rim", "lining")

        def cube(values: list[Any], dtype: Any = float) -> Any:
            return np.asarray([np.nan if x is None else x for x in values], dtype).reshape(shape)

        found: dict[str, Any] = {}
        for name, (unit, meaning, formula) in QUANTITIES.items():
            about = {"units": unit, "meaning": meaning, "formula": formula}
            found[name] = (dims, cube([row[name].value for row in self.rows]), about)
            simulated = cube([row[name].simulated for row in self.rows])
            if not np.all(np.isnan(simulated)):
                found[f"{name}_simulated"] = (dims, simulated, {"units": unit, "meaning": f"{meaning}, simulated"})
        about = {"units": "J", "meaning": "greatest friction work of one braking, by the estimates"}
        found["greatest_work"] = (dims, cube([row.greatest_work for row in self.rows]), about)
        found["admissible"] = (dims, cube([row.admissible for row in self.rows], bool))
        coords = {"level": [level.label for level in self.levels], "rim": names[0], "lining": names[1]}
        return xr.Dataset(found, coords, {"about": self.about})

    def __str__(self) -> str:
        lines = [self.about]
        for i, level in enumerate(self.levels):
            lines += ["", f"{level.label}: friction work {level.words}", *self._table(i)]
        lines += ["", "greatest friction work of one braking by the estimates, and what ends it"]
        for place, row in enumerate(self.ranking(), 1):
            lines.append(f"  {place:2}. {row.rim} with {row.lining}: {row.greatest_work / 1e3:.0f} kJ, {row.ends}")
        return "\n".join([*lines, "", *(f"note: {note}" for note in self.notes)])

    def _table(self, level: int) -> list[str]:
        rows = [row for row in self.rows if row.level == level]
        shown = [c for c in _COLUMNS if not c.simulated or any(row[c.name].simulated is not None for row in rows)]
        width = max(len(row.rim) for row in rows), max(len(row.lining) for row in rows)
        head = [f"{'rim':{width[0]}}  {'lining':{width[1]}} ", f"{'':{width[0]}}  {'':{width[1]}} "]
        for c in shown:
            head[0] += f" {c.heading:>8}"
            head[1] += f" {('sim. ' if c.simulated else '') + c.unit:>8}"
        lines = [head[0] + "  verdict", head[1]]
        for row in rows:
            line = f"{row.rim:{width[0]}}  {row.lining:{width[1]}} "
            for c in shown:
                one = row[c.name]
                value = one.best if c.simulated is None else one.simulated if c.simulated else one.value
                line += f" {'' if value is None else c.shape(value):>8}"
            verdict = f"exceeded: {'; '.join(row.fails)}" if row.fails else "within limits"
            lines.append(f"{line}  {verdict}")
        return lines


class _Column(NamedTuple):
    """A column of the table; `simulated`: estimate, simulated number, or (`None`) the latter where there is one."""

    name: str
    heading: str
    simulated: bool | None
    unit: str
    shape: Callable[[float], str]


def _celsius(T: float) -> str:
    return f"{T - _ZERO:.0f}"


def _scaled(factor: float, digits: str) -> Callable[[float], str]:
    return lambda value: format(factor * value, digits)


_COLUMNS = (
    _Column("share", "share", False, "%", _scaled(100.0, ".1f")),
    _Column("bulk", "bulk", False, "°C", _celsius),
    _Column("bulk", "bulk", True, "°C", _celsius),
    _Column("surface", "surface", False, "°C", _celsius),
    _Column("surface", "surface", True, "°C", _celsius),
    _Column("lining_surface", "lining", True, "°C", _celsius),
    _Column("maximum", "maximum", False, "°C", _celsius),
    _Column("stress", "stress", False, "MPa", _scaled(1e-6, ".0f")),
    _Column("stress", "stress", True, "MPa", _scaled(1e-6, ".0f")),
    _Column("stress_ratio", "of perm.", None, "1", _scaled(1.0, ".2f")),
    _Column("wear", "wear", False, "µm", _scaled(1e6, ".3g")),
    _Column("wear", "wear", True, "µm", _scaled(1e6, ".3g")),
    _Column("mass", "mass", False, "kg", _scaled(1.0, ".0f")),
)


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None
