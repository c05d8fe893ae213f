"""Rims and linings to choose from: what a comparison needs of a material besides its thermal properties."""

import csv
import dataclasses
from collections.abc import Callable
from importlib import resources
from typing import Any

from .._base._admissible import require_positive
from .._parts._material import LIBRARY, Entry, Material, material
from .._parts._wear import ThresholdWear
from .heating import ElasticMaterial


@dataclasses.dataclass(frozen=True, eq=False)
class RimMaterial:
    """A material for rims: `thermal` properties, constants for thermal stress (`elastic`), and what it withstands.

    - `permissible` (K): of the surface in service; `solidus` (K): where it begins to melt; `hardness` (Pa)
    - `sources`: number → where it is from; assumptions say so
    """

    name: str
    thermal: Material
    elastic: ElasticMaterial
    permissible: float
    solidus: float
    hardness: float
    sources: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(permissible=self.permissible, solidus=self.solidus, hardness=self.hardness)

    @property
    def numbers(self) -> dict[str, float]:
        """All numbers by name (SI)."""
        return _of_thermal(self.thermal) | {
            "young": self.elastic.young,
            "expansion": self.elastic.expansion,
            "poisson": self.elastic.poisson,
            "permissible_stress": self.elastic.permissible,
            "permissible_temperature": self.permissible,
            "solidus": self.solidus,
            "hardness": self.hardness,
        }


@dataclasses.dataclass(frozen=True, eq=False)
class LiningMaterial:
    """A material for linings: `thermal` properties, law of `wear`, and what it withstands.

    - `wear`: rate `I(p, v, T)` (m³/(N·m)) as `sb.wear` takes it
    - `permissible` (K): of its surface; `hardness` (Pa); `sources`: number → where it is from

    Its friction is that of the scene: only a run with another law tells what another coefficient does.
    """

    name: str
    thermal: Material
    wear: Callable[..., Any]
    permissible: float
    hardness: float
    sources: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(permissible=self.permissible, hardness=self.hardness)

    @property
    def numbers(self) -> dict[str, float]:
        """All numbers by name (SI); of the wear law those of `ThresholdWear`."""
        found = _of_thermal(self.thermal)
        if isinstance(self.wear, ThresholdWear):
            law = self.wear
            found |= {"wear_coefficient": law.coefficient, "wear_threshold": law.threshold}  # pyright: ignore
            found |= {"wear_activation": law.energy}  # pyright: ignore
        found |= {"permissible_temperature": self.permissible, "hardness": self.hardness}
        return {name: float(value) for name, value in found.items()}


def _of_thermal(thermal: Material) -> dict[str, float]:
    return {name: float(getattr(thermal, name)) for name in ("conductivity", "density", "specific_heat")}


def _library(part: str) -> dict[str, dict[str, Entry]]:
    """Material of a part → number → value with its source, from `materials.csv`."""
    text = (resources.files("simbrake") / "formulas" / "materials.csv").read_text("utf-8")
    found: dict[str, dict[str, Entry]] = {}
    for row in csv.DictReader(text.splitlines()):
        if row["part"] == part:
            numbers = (float(row[key]) for key in ("value", "low", "high"))
            entry = Entry(*numbers, row["source"], bool(row["assumed"]))
            found.setdefault(row["material"], {})[row["number"]] = entry
    return found


#: rim material → number → value with its source; the alloys are those whose conductivity is next to V's
RIMS = _library("rim")
#: lining material → number → value with its source
LININGS = _library("lining")


def _settled(name: str, table: dict[str, dict[str, Entry]], kind: str, changes: dict[str, float]):
    """Numbers by name and their sources, with `changes`."""
    if name not in table:
        raise KeyError(f"no {kind} {name!r}; there are: {', '.join(sorted(table))}")
    entries = LIBRARY[name] | table[name]
    unknown = sorted(set(changes) - set(entries))
    if unknown:
        raise KeyError(f"a {kind} has no {', '.join(unknown)}; there are: {', '.join(entries)}")
    numbers = {key: float(changes.get(key, entry.value)) for key, entry in entries.items()}
    sources = {
        key: "given" if key in changes else entry.source + (" (assumed)" if _unsaid(entry) else "")
        for key, entry in entries.items()
    }
    return numbers, sources


def _unsaid(entry: Entry) -> bool:
    return entry.assumed and not entry.source.startswith("assumption")


def _thermal(name: str, numbers: dict[str, float]) -> Material:
    return material(name, **{key: numbers[key] for key in ("conductivity", "density", "specific_heat")})


def rim_material(name: str, **changes: float) -> RimMaterial:
    """A rim's material: steel_20L, steel_35KhNL, cast_iron, magnesium_alloy, brass, aluminium_alloy.

    `changes` by name (SI): those of `Material`, `young`, `expansion`, `poisson`, `permissible_stress`,
    `permissible_temperature`, `solidus`, `hardness`. Where each number is from stands in `sources`: conductivities of
    V, handbook values, and assumptions. Raises `KeyError` with the names there are.
    """
    n, sources = _settled(name, RIMS, "rim material", changes)
    elastic = ElasticMaterial(n["young"], n["expansion"], n["poisson"], n["permissible_stress"])
    limits = n["permissible_temperature"], n["solidus"], n["hardness"]
    return RimMaterial(name, _thermal(name, n), elastic, *limits, sources)


def lining_material(name: str, **changes: float) -> LiningMaterial:
    """A lining's material: FK-24A, retinax.

    `changes` by name (SI): those of `Material`, `wear_coefficient`, `wear_threshold`, `wear_activation` (of
    `ThresholdWear`), `permissible_temperature`, `hardness`. Raises `KeyError` with the names there are.
    """
    n, sources = _settled(name, LININGS, "lining material", changes)
    wear = ThresholdWear(n["wear_coefficient"], n["wear_threshold"], n["wear_activation"])
    return LiningMaterial(name, _thermal(name, n), wear, n["permissible_temperature"], n["hardness"], sources)
