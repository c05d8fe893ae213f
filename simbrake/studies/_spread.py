"""The spread of a scene's inputs as the library knows it: friction of linings, thermal properties, wear."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._arguments import explained
from .._base._faults import Fault, InputError
from .._base._part import parts_below
from .._base._table import Column, Table, Tabular, number
from .._parts._scene import Scene
from .._run._measure import Metric
from ..friction import ConstantFriction
from ..thermal._material import LIBRARY, Entry, Material, library
from ..wear import ThresholdWear
from ._evaluator import Faults
from ._uncertainty import Uncertainty, uncertainty

#: friction material → number → value with its range and source
FRICTION = library("friction")
_THERMAL = ("conductivity", "density", "specific_heat")
_WEAR = {"coefficient": "wear_coefficient", "threshold": "wear_threshold", "energy": "wear_activation"}
#: half the width of a friction class of SAE J866: linings of one class may differ by as much as the class is wide
_HALF_CLASS = 0.05
#: values of a scene are those of a material of the library if they differ by less than this share
_SAME = 1e-9


class Range(NamedTuple):
    """What is known of one number: limits in SI, unit, and where they are from."""

    low: float
    high: float
    unit: str
    source: str


@dataclasses.dataclass(frozen=True)
class KnownSpread(Tabular):
    """The ranges of a scene's inputs by path, as `known_spread` finds them.

    - `ranges`: path → `(low, high)`, which `simbrake.uncertainty` takes as uniform distributions
    - `known`: path → the same with unit and source

    Example:
        >>> friction = sb.studies.known_spread(scene, "moulded").known["brake.linings.friction.coefficient"]
        >>> friction.low, friction.high, friction.source.partition(",")[0]
        (0.25, 0.45, 'Juvinall & Marshek')
    """

    known: dict[str, Range]

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Limits by path in SI."""
        return {path: (one.low, one.high) for path, one in self.known.items()}

    def as_dict(self) -> dict[str, Any]:
        """`{path: {low, high, unit, source}}`."""
        return {path: one._asdict() for path, one in self.known.items()}

    def table(self) -> Table:
        """One row for each input."""
        rows = [
            (path, *(number(end, one.unit, count=4) for end in (one.low, one.high)), one.source)
            for path, one in self.known.items()
        ]
        return Table([Column("path", heading="input", left=True), "from", "to", "source"], rows)

    def parts(self) -> Iterator[str | Table]:
        yield self.table()


@explained
def known_spread(scene: Scene, lining: str | None = None) -> KnownSpread:
    """What the library knows of the spread of a scene's inputs.

    - friction coefficients of linings that are one number: the range of the friction material `lining`
      (`simbrake.studies.FRICTION`: moulded, woven, class_F, …), or without it 0.05 to either side, as linings of one
      class of SAE J866 differ by 0.1
    - thermal properties of bodies whose material is one of `simbrake.thermal.LIBRARY`, and constants of `ThresholdWear`
      with the values of the library: the ranges that it gives for them

    Every number varies by itself. Raises `InputError` for an unknown friction material, and for a coefficient outside
    its range.

    Example:
        >>> sb.studies.known_spread(scene, "moulded").ranges
        {'brake.linings.friction.coefficient': (0.25, 0.45)}
    """
    if lining is not None and lining not in FRICTION:
        raise InputError([Fault("lining", f"{lining!r} is no friction material", f"there are {', '.join(FRICTION)}")])
    ranges: dict[str, Range] = {}
    issues = Faults()
    for path, part, _ in parts_below(scene):
        if isinstance(part, ConstantFriction) and np.ndim(part.coefficient) == 0:
            f, where = float(part.coefficient), f"{path}.coefficient"
            if lining is None:
                source = "SAE J866: linings of one class differ by up to 0.1"
                ranges[where] = Range(max(f - _HALF_CLASS, 0.0), f + _HALF_CLASS, "1", source)
                continue
            entry = FRICTION[lining]["coefficient"]
            if not entry.low <= f <= entry.high:
                hint = f"{entry.low:g}…{entry.high:g} ({entry.source})"
                issues.append(Fault(where, f"{f:g} is outside the range of {lining} linings", hint))
            ranges[where] = Range(entry.low, entry.high, "1", entry.source)
        elif isinstance(part, Material):
            ranges |= _of_library(part, path, {name: name for name in _THERMAL}, LIBRARY)
        elif isinstance(part, ThresholdWear):
            ranges |= _of_library(part, path, _WEAR, library("lining"))
    issues.report()
    return KnownSpread({path: one for path, one in ranges.items() if one.low < one.high})


def _of_library(
    part: Any, path: str, names: Mapping[str, str], entries: Mapping[str, Mapping[str, Entry]]
) -> dict[str, Range]:
    """Ranges of a part whose numbers are those of one entry of the library, by path."""
    for known in entries.values():
        there = {field: known[name] for field, name in names.items() if name in known}
        values = {field: np.asarray(getattr(part, field)) for field in there}
        if there and all(x.ndim == 0 and abs(x - there[field].value) <= _SAME * abs(x) for field, x in values.items()):
            units = {one.name: one.metadata["quantity"].unit for one in dataclasses.fields(part) if one.name in there}
            return {
                f"{path}.{field}": Range(entry.low, entry.high, units[field], entry.source)
                for field, entry in there.items()
            }
    return {}


def uncertainty_of_library(
    scene: Scene, metrics: Sequence[Metric], lining: str | None = None, n: int = 256, **options: Any
) -> tuple[KnownSpread, Uncertainty]:
    """`uncertainty` of metrics under the spread that the library knows of the scene's inputs; `options` go there.

    Raises `InputError` as `known_spread` does, and where the library knows nothing of the scene's inputs.
    """
    known = known_spread(scene, lining)
    if not known.known:
        hint = "materials and constant friction of the library have one (simbrake.thermal.LIBRARY)"
        raise InputError([Fault("scene", "the library knows the spread of none of its inputs", hint)])
    return known, uncertainty(scene, known.ranges, metrics, n, replicates=8, **options)
