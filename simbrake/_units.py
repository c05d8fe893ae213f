"""Units of measured data: a small table from what loggers write to SI."""

import math
from typing import NamedTuple


class Unit(NamedTuple):
    """A unit as `SI = factor · number + offset`; differences such as standard deviations take the factor alone."""

    factor: float
    offset: float = 0.0


_TURN = 2 * math.pi
#: SI unit → spellings of units of the same kind
_TABLE: dict[str, dict[str, Unit]] = {
    "s": {"s": Unit(1.0), "ms": Unit(1e-3), "us": Unit(1e-6), "min": Unit(60.0), "h": Unit(3600.0)},
    "rad": {"rad": Unit(1.0), "deg": Unit(math.pi / 180), "°": Unit(math.pi / 180), "rev": Unit(_TURN)},
    "rad/s": {
        "rad/s": Unit(1.0),
        "rpm": Unit(_TURN / 60),
        "1/min": Unit(_TURN / 60),
        "deg/s": Unit(math.pi / 180),
        "rev/s": Unit(_TURN),
    },
    "m": {"m": Unit(1.0), "cm": Unit(1e-2), "mm": Unit(1e-3), "um": Unit(1e-6)},
    "m/s": {"m/s": Unit(1.0), "mm/s": Unit(1e-3), "km/h": Unit(1 / 3.6)},
    "N": {"N": Unit(1.0), "kN": Unit(1e3), "MN": Unit(1e6)},
    "N*m": {"N*m": Unit(1.0), "Nm": Unit(1.0), "kN*m": Unit(1e3), "kNm": Unit(1e3)},
    "J": {"J": Unit(1.0), "kJ": Unit(1e3), "MJ": Unit(1e6)},
    "K": {"K": Unit(1.0), "degC": Unit(1.0, 273.15), "°C": Unit(1.0, 273.15), "C": Unit(1.0, 273.15)},
    "": {"": Unit(1.0), "1": Unit(1.0), "-": Unit(1.0), "%": Unit(1e-2)},
}


def unit(text: str, si: str) -> Unit:
    """The unit written as `text` for a quantity of the SI unit `si`; empty text is SI itself.

    Raises `ValueError` with the spellings that there are.
    """
    known = _TABLE.get(si, {si: Unit(1.0)})
    name = text.strip().replace("·", "*").replace(" ", "").replace("μ", "u").replace("µ", "u")
    if not name:
        return Unit(1.0)
    if name not in known:
        raise ValueError(f"known here: {', '.join(name for name in known if name) or 'no unit'}")
    return known[name]


def spelled(text: str) -> bool:
    """Whether a text is a unit of any kind (bare numbers are not)."""
    name = text.strip()
    return not name.isdigit() and any(name in known for known in _TABLE.values())


def to_si(number: float, of: Unit) -> float:
    """A number in a unit as a number in SI."""
    return number * of.factor + of.offset
