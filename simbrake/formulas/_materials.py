"""Rims and linings to choose from: what a comparison needs of a material besides its thermal properties."""

import dataclasses
from collections.abc import Callable
from typing import Any

from .._base._admissible import require_positive
from .._parts._material import LIBRARY, Entry, Material, material
from .._parts._wear import ThresholdWear
from .heating import ElasticMaterial

_ZERO = 273.15  # K
_PROOF = "assumption: two thirds of the 0.2 % proof stress"


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


def _rim(
    young: Entry, expansion: Entry, poisson: Entry, stress: Entry, T: Entry, solidus: Entry, HB: Entry
) -> dict[str, Entry]:
    return dict(
        zip(
            ("young", "expansion", "poisson", "permissible_stress", "permissible_temperature", "solidus", "hardness"),
            (young, expansion, poisson, stress, T, solidus, HB),
            strict=True,
        )
    )


def _at(celsius: float, low: float, high: float, source: str, assumed: bool = False) -> Entry:
    return Entry(_ZERO + celsius, _ZERO + low, _ZERO + high, source, assumed)


_CARBON = "cast carbon steel, textbook"
_GJL = "grey iron EN-GJL-200, EN 1561, annex"
_AZ91 = "cast Mg–Al–Zn (AZ91), ASM Handbook 2"
_CUZN = "cast Cu–Zn (CuZn37…39), ASM Handbook 2"
_ALSI = "cast Al–Si–Mg (AlSi10Mg), EN 1706 and ASM Handbook 2"

#: rim material → number → value with its source; the alloys are those whose conductivity is next to V's
RIMS: dict[str, dict[str, Entry]] = {
    "steel_20L": _rim(
        Entry(2.05e11, 2.0e11, 2.1e11, _CARBON),
        Entry(12.0e-6, 11.5e-6, 13.0e-6, _CARBON),
        Entry(0.30, 0.28, 0.31, _CARBON),
        Entry(150e6, 120e6, 180e6, _PROOF + " of 216 MPa (20L, GOST 977), rounded", True),
        _at(
            450.0,
            400.0,
            500.0,
            "assumption: creep and scaling of carbon steel begin",
            True,
        ),
        _at(1450.0, 1420.0, 1490.0, _CARBON),
        Entry(1300e6, 1100e6, 1600e6, _CARBON + ", 130 HB", True),
    ),
    "steel_35KhNL": _rim(
        Entry(2.1e11, 2.0e11, 2.15e11, _CARBON),
        Entry(12.0e-6, 11.5e-6, 13.0e-6, _CARBON),
        Entry(0.30, 0.28, 0.31, _CARBON),
        Entry(260e6, 200e6, 330e6, _PROOF + " of a normalised low-alloy cast steel, 390 MPa", True),
        _at(450.0, 400.0, 500.0, "assumption: as carbon steel", True),
        _at(1440.0, 1400.0, 1480.0, _CARBON, True),
        Entry(2000e6, 1700e6, 2400e6, "assumption: 200 HB", True),
    ),
    "cast_iron": _rim(
        Entry(1.0e11, 0.88e11, 1.13e11, _GJL),
        Entry(11.7e-6, 10.0e-6, 13.0e-6, _GJL + ", 20…200 °C"),
        Entry(0.26, 0.25, 0.27, _GJL),
        Entry(100e6, 80e6, 130e6, "assumption: half of the tensile strength (200 MPa), as it is brittle", True),
        _at(400.0, 350.0, 450.0, "assumption: growth of grey iron begins", True),
        _at(1150.0, 1130.0, 1180.0, "eutectic of iron and carbon"),
        Entry(1800e6, 1500e6, 2200e6, _GJL + ", 180 HB", True),
    ),
    "magnesium_alloy": _rim(
        Entry(45e9, 44e9, 46e9, _AZ91),
        Entry(26.0e-6, 25.0e-6, 27.0e-6, _AZ91),
        Entry(0.35, 0.29, 0.35, _AZ91),
        Entry(65e6, 50e6, 90e6, _PROOF + " of 97 MPa, rounded", True),
        _at(150.0, 120.0, 200.0, "assumption: creep of Mg–Al–Zn alloys begins", True),
        _at(437.0, 430.0, 490.0, "eutectic of magnesium and aluminium"),
        Entry(630e6, 550e6, 800e6, _AZ91 + ", 63 HB", True),
    ),
    "brass": _rim(
        Entry(105e9, 97e9, 110e9, _CUZN),
        Entry(20.0e-6, 19.0e-6, 21.0e-6, _CUZN),
        Entry(0.34, 0.33, 0.35, _CUZN),
        Entry(80e6, 60e6, 120e6, _PROOF + " of 120 MPa", True),
        _at(250.0, 200.0, 300.0, "assumption: it softens above", True),
        _at(885.0, 880.0, 905.0, _CUZN),
        Entry(800e6, 700e6, 1100e6, _CUZN + ", 80 HB", True),
    ),
    "aluminium_alloy": _rim(
        Entry(71e9, 69e9, 76e9, _ALSI),
        Entry(21.0e-6, 20.0e-6, 22.0e-6, _ALSI),
        Entry(0.33, 0.32, 0.34, _ALSI),
        Entry(120e6, 80e6, 150e6, _PROOF + " of 180 MPa, aged", True),
        _at(200.0, 150.0, 250.0, "assumption: an aged casting loses its strength above", True),
        _at(557.0, 550.0, 577.0, _ALSI),
        Entry(750e6, 600e6, 950e6, _ALSI + ", 75 HB", True),
    ),
}

_RHEE = "Liu & Rhee, Wear 37 (1976) 291"
_ORDER = "assumption: order of magnitude of resin-bonded linings"

#: lining material → number → value with its source
LININGS: dict[str, dict[str, Entry]] = {
    "FK-24A": {
        "wear_coefficient": Entry(3e-14, 1e-14, 1e-13, _ORDER, True),
        "wear_threshold": _at(230.0, 200.0, 250.0, _RHEE),
        "wear_activation": Entry(40e3, 20e3, 80e3, _ORDER + ": tenfold from 230 to 390 °C", True),
        "permissible_temperature": _at(400.0, 300.0, 500.0, "assumption: the binder burns out above", True),
        "hardness": Entry(300e6, 200e6, 400e6, "assumption: friction composite", True),
    },
    "retinax": {
        "wear_coefficient": Entry(5e-14, 2e-14, 2e-13, _ORDER, True),
        "wear_threshold": _at(230.0, 200.0, 250.0, _RHEE),
        "wear_activation": Entry(30e3, 15e3, 60e3, _ORDER + ", made for hotter service than FK-24A", True),
        "permissible_temperature": _at(500.0, 400.0, 600.0, "assumption: made for hotter service than FK-24A", True),
        "hardness": Entry(300e6, 200e6, 400e6, "assumption: friction composite", True),
    },
}


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
