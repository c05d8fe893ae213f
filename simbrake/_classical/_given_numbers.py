"""Numbers that a user gives for estimates: what is admissible, and how they are read from `name=value` texts."""

import dataclasses
import difflib
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import BAD, NumberReader, Quantity, faults_of_values, positive
from ..thermal._material import LIBRARY, material
from ._estimate_data import EstimateData
from ._synthesis_chain import Permissible
from ._thermal_stress import ElasticMaterial

_SHARE = Quantity("1", "share of the friction heat into the rim", 0.0, 1.0)
#: numbers of `EstimateData`
NUMBERS: dict[str, Quantity] = {
    "rim_thickness": positive("m", "thickness of the rim"),
    "lining_thickness": positive("m", "thickness of the linings"),
    "band_thickness": positive("m", "thickness of the band"),
    "track_area": positive("m^2", "area of the track, all bands together"),
    "lining_area": positive("m^2", "area of the linings, all bands together"),
    "share": _SHARE,
    "coefficient": Quantity("W/(m^2*K)", "coefficient of the open track", 0.0),
    "emissivity": Quantity("1", "emissivity of the open track", 0.0, 1.0),
    "ambient": positive("K", "temperature of the air"),
    "hardness": positive("Pa", "hardness of the softer surface"),
    "spot_length": positive("m", "length of a spot"),
    "outer_area": positive("m^2", "area of a staged brake's outer faces"),
    "external_share": Quantity("1", "share of the external pair's heat into the band", 0.0, 1.0),
    "beyond_share": Quantity("1", "share of the external pair's heat into the rim", 0.0, 1.0),
    "matte_area": positive("m^2", "area of the matte surfaces"),
}
#: numbers of `Permissible`, and the permissible stress
LIMITS: dict[str, Quantity] = {
    "lining": positive("K", "permissible temperature of the friction surface"),
    "back": positive("K", "permissible temperature at the lining's back"),
    "pressure": positive("Pa", "permissible pressure of the linings"),
    "power": positive("W/m^2", "permissible friction power per area of the linings"),
    "stress": positive("Pa", "permissible stress of the rim"),
}
_MATERIALS = ("rim", "lining", "band")


def faults_of_data(data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """Everything that is not admissible among the numbers given."""
    given: dict[str, Any] = {} if data is None else vars(data)
    found = [_fault(name, given.get(name), about) for name, about in NUMBERS.items()]
    found += [_fault(f"permissible.{name}", value, LIMITS[name]) for name, value in limits._asdict().items()]
    for name in _MATERIALS:
        if given.get(name) is not None:
            found += faults_of_values(given[name], name)
    elastic = given.get("elastic")
    if elastic is not None:
        found.append(_fault("elastic.young", elastic.young, positive("Pa", "Young's modulus")))
        found.append(_fault("elastic.permissible", elastic.permissible, LIMITS["stress"]))
        found.append(_fault("elastic.expansion", elastic.expansion, Quantity("1/K", "thermal expansion")))
        if not -1 < elastic.poisson < 0.5:
            found.append(Fault("elastic.poisson", f"{elastic.poisson} is not admissible", "must be > −1 and < 0.5"))
    return [fault for fault in found if fault is not None]


def _fault(path: str, value: Any, about: Quantity) -> Fault | None:
    if value is None or bool(about.admits(np.asarray(value, float))):  # not a NaN
        return None
    return Fault(path, f"{value} {about.unit} is not admissible", f"{about.meaning} must be {about.wanted(value)}")


def read_given(texts: list[str]) -> tuple[EstimateData, Permissible]:
    """Numbers and materials from texts: `rim_thickness=28 mm`, `rim=cast_iron`, `permissible.back=130 degC`.

    Raises `InputError` with all that is wrong: unknown names, values that are no numbers or out of range.
    """
    reader, data, limits, stress = NumberReader(), {}, {}, None
    known = [*NUMBERS, *_MATERIALS, *(f"permissible.{name}" for name in LIMITS)]
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        limit = name.removeprefix("permissible.")
        if not equals or not value:
            reader.fault(text, "is not of the form name=value", "as in rim_thickness=28 mm")
        elif name not in known:
            near = difflib.get_close_matches(name, known, n=3, cutoff=0.4) or known
            reader.fault(name, "there is no such number to give", f"nearest: {', '.join(near)}")
        elif name in _MATERIALS:
            if value in LIBRARY:
                data[name] = material(value)
            else:
                reader.fault(name, f"there is no material {value!r}", f"there are: {', '.join(sorted(LIBRARY))}")
        else:
            about = NUMBERS[name] if name in NUMBERS else LIMITS[limit]
            number = reader.number(value, about, name, about.unit)
            if number is BAD:
                continue
            if name in NUMBERS:
                data[name] = number
            elif limit == "stress":
                stress = number
            else:
                limits[limit] = number
    if reader.faults:
        raise InputError(reader.faults)
    elastic = None if stress is None else ElasticMaterial(permissible=stress)
    return dataclasses.replace(EstimateData(**data), elastic=elastic), Permissible(**limits)
