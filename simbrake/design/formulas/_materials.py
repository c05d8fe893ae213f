"""Materials of rims and linings, with the sources of their numbers."""

import dataclasses
from collections.abc import Callable
from typing import Any

from ..._base._arguments import explained
from ..._base._faults import require_positive
from ...thermal.materials import LIBRARY, Entry, Material, library, material
from ...wear import ThresholdWear
from .stress import ElasticMaterial


@explained
@dataclasses.dataclass(frozen=True, eq=False)
class RimMaterial:
    """A material for rims: `thermal` properties, constants for thermal stress
    (`elastic`), and its limits.

    - `permissible` (K): of the surface in service; `solidus` (K): where it begins to
      melt; `hardness` (Pa)
    - `sources`: number → source; assumptions are marked

    Example:
        >>> sb.formulas.rim_material("brass").elastic.young
        105000000000.0
    """

    name: str
    thermal: Material
    elastic: ElasticMaterial
    permissible: float
    solidus: float
    hardness: float
    sources: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(
            permissible=self.permissible, solidus=self.solidus, hardness=self.hardness
        )

    @property
    def numbers(self) -> dict[str, float]:
        """Return all numbers by name (SI)."""
        young, expansion, poisson, stress = self.elastic
        thermal = _thermal(self.thermal) | {
            "young": young,
            "expansion": expansion,
            "poisson": poisson,
        }
        limits = {
            "permissible_temperature": self.permissible,
            "solidus": self.solidus,
            "hardness": self.hardness,
        }
        return thermal | {"permissible_stress": stress} | limits


@explained
@dataclasses.dataclass(frozen=True, eq=False)
class LiningMaterial:
    """A material for linings: `thermal` properties, law of `wear`, and its limits.

    - `wear`: rate `I(p, v, T)` (m³/(N·m)) as `sb.results.lining_wear` takes it
    - `permissible` (K): of its surface; `hardness` (Pa); `sources`: number → source

    Its friction is that of the scene: the effect of another coefficient needs a run
    with another law.

    Example:
        >>> sb.formulas.lining_material("retinax").permissible
        773.15
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
        """Return all numbers by name (SI); of the wear law those of `ThresholdWear`."""
        known = _thermal(self.thermal)
        law = self.wear
        if isinstance(law, ThresholdWear):
            numbers = {
                "coefficient": law.coefficient,
                "threshold": law.threshold,
                "activation": law.energy,
            }
            known |= {f"wear_{name}": float(value) for name, value in numbers.items()}
        return known | {
            "permissible_temperature": self.permissible,
            "hardness": self.hardness,
        }


_THERMAL = ("conductivity", "density", "specific_heat")


def _thermal(material: Material) -> dict[str, float]:
    return {name: float(getattr(material, name)) for name in _THERMAL}


#: rim material → number → value with its source; the alloys are those whose
#: conductivity is next to V's
RIMS = library("rim")
#: lining material → number → value with its source
LININGS = library("lining")


def _settled(
    name: str, table: dict[str, dict[str, Entry]], kind: str, changes: dict[str, float]
) -> tuple[dict[str, float], Material, dict[str, str]]:
    """Numbers by name with `changes`, the thermal ones as a material, and where each is
    from."""
    if name not in table:
        raise KeyError(f"no {kind} {name!r}; there are: {', '.join(sorted(table))}")
    entries = LIBRARY[name] | table[name]
    sources = {}
    if unknown := sorted(set(changes) - set(entries)):
        raise KeyError(
            f"a {kind} has no {', '.join(unknown)}; there are: {', '.join(entries)}"
        )
    numbers = {
        key: float(changes.get(key, entry.value)) for key, entry in entries.items()
    }
    for key, entry in entries.items():
        unsaid = entry.assumed and not entry.source.startswith("assumption")
        sources[key] = (
            "given"
            if key in changes
            else entry.source + (" (assumed)" if unsaid else "")
        )
    return numbers, material(name, **{key: numbers[key] for key in _THERMAL}), sources


def rim_material(name: str, **changes: float) -> RimMaterial:
    """A rim's material: steel_20L, steel_35KhNL, cast_iron, magnesium_alloy, brass,
    aluminium_alloy.

    `changes` by name (SI): those of `Material`, `young`, `expansion`, `poisson`,
    `permissible_stress`, `permissible_temperature`, `solidus`, `hardness`. The source
    of each number is in `sources`: conductivities of V, handbook values, and
    assumptions. Raises `KeyError` with the known names.

    Example:
        >>> sb.formulas.rim_material("steel_20L").name
        'steel_20L'
    """
    n, thermal, sources = _settled(name, RIMS, "rim material", changes)
    elastic = ElasticMaterial(
        n["young"], n["expansion"], n["poisson"], n["permissible_stress"]
    )
    limits = n["permissible_temperature"], n["solidus"], n["hardness"]
    return RimMaterial(name, thermal, elastic, *limits, sources)


def lining_material(name: str, **changes: float) -> LiningMaterial:
    """A lining's material: FK-24A, retinax.

    `changes` by name (SI): those of `Material`, `wear_coefficient`, `wear_threshold`,
    `wear_activation` (of `ThresholdWear`), `permissible_temperature`, `hardness`.
    Raises `KeyError` with the known names.

    Example:
        >>> sb.formulas.lining_material("FK-24A").name
        'FK-24A'
    """
    n, thermal, sources = _settled(name, LININGS, "lining material", changes)
    wear = ThresholdWear(
        n["wear_coefficient"], n["wear_threshold"], n["wear_activation"]
    )
    return LiningMaterial(
        name, thermal, wear, n["permissible_temperature"], n["hardness"], sources
    )
