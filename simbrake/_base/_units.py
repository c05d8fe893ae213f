"""Units at the door: what files and commands write, as numbers in SI."""

import functools
import math
import re
from fractions import Fraction
from typing import Any, NamedTuple


class Unit(NamedTuple):
    """A unit as `SI = factor · number + offset`; differences such as standard deviations take the factor alone."""

    factor: float | Fraction
    offset: float | Fraction = 0


_TURN = 2 * math.pi


def _decimal(text: str) -> Unit:
    return Unit(Fraction(text))


#: SI unit → spellings of units of the same kind. These need no library, and are what engineers mean where a library
#: of all units reads something else (C, 1/min); fractions, so that 95 % is 0.95 and not one rounding beside it
_TABLE: dict[str, dict[str, Unit]] = {
    "s": {"ms": _decimal("1e-3"), "us": _decimal("1e-6"), "min": Unit(60.0), "h": Unit(3600.0)},
    "rad": {"deg": Unit(math.pi / 180), "°": Unit(math.pi / 180), "rev": Unit(_TURN)},
    "rad/s": {
        "rpm": Unit(_TURN / 60),
        "1/min": Unit(_TURN / 60),
        "deg/s": Unit(math.pi / 180),
        "rev/s": Unit(_TURN),
    },
    "m": {"cm": _decimal("1e-2"), "mm": _decimal("1e-3"), "um": _decimal("1e-6")},
    "m/s": {"mm/s": _decimal("1e-3"), "km/h": Unit(Fraction(10, 36))},
    "m^2": {"cm^2": _decimal("1e-4"), "mm^2": _decimal("1e-6")},
    "kg": {"g": _decimal("1e-3"), "t": Unit(1000.0)},
    "N": {"kN": Unit(1e3), "MN": Unit(1e6)},
    "N/m": {"kN/m": Unit(1e3), "MN/m": Unit(1e6), "N/mm": Unit(1e3), "kN/mm": Unit(1e6)},
    "N*m": {"Nm": Unit(1.0), "kN*m": Unit(1e3), "kNm": Unit(1e3)},
    "Pa": {"kPa": Unit(1e3), "MPa": Unit(1e6), "GPa": Unit(1e9), "bar": Unit(1e5), "N/mm^2": Unit(1e6)},
    "J": {"kJ": Unit(1e3), "MJ": Unit(1e6)},
    "W": {"kW": Unit(1e3), "MW": Unit(1e6)},
    "K": {name: Unit(1, _decimal("273.15").factor) for name in ("degC", "°C", "C")},
    "1": {"": Unit(1.0), "1": Unit(1.0), "-": Unit(1.0), "%": _decimal("1e-2")},
}
#: names, products, quotients and one-digit powers: what a parser of all units cannot spend an hour on
_SPELLING = re.compile(r"(?:[A-Za-z°_]|%|1|[*/]|\((?:[A-Za-z°_*/]|\^-?[1-9](?!\d))+\)|\^-?[1-9](?!\d))+")
#: a plane angle is no number here: 20 is not 20 rad, and 3 Hz are neither 3 rad/s nor 3 rev/s without asking
_ANGLES = {"radian", "degree", "revolution", "turn", "revolutions_per_minute", "arcminute", "arcsecond", "gradian"}


def _plain(text: str) -> str:
    """One spelling of a unit: `kN·m`, `m²` and `µm` as `kN*m`, `m^2` and `um`."""
    name = text.strip().replace("·", "*").replace("⋅", "*").replace("**", "^").replace("²", "^2").replace("³", "^3")
    return name.replace("μ", "u").replace("µ", "u").replace(" ", "")


def _si(si: str) -> str:
    return si if si else "1"


def unit(text: str, si: str) -> Unit:
    """The unit written as `text` for a quantity of the SI unit `si`; empty text is SI itself.

    Raises `ValueError` with the spellings that there are, or with what kind of quantity the unit is.
    """
    name, si = _plain(text), _si(si)
    known = _TABLE.get(si, {})
    if not name or name == si or name in known:
        return known.get(name, Unit(1.0))
    try:
        return _of_library(name, si)
    except ValueError as error:
        names = [si, *(name for name in known if name)] if si != "1" else [name for name in known if name]
        raise ValueError(f"known here: {', '.join(names)}{error}") from None


@functools.cache
def _library() -> Any:
    import pint  # a second, which only unusual units pay

    return pint.UnitRegistry(non_int_type=Fraction, cache_folder=None)  # pyright: ignore


@functools.lru_cache(maxsize=1024)
def _of_library(name: str, si: str) -> Unit:
    """A unit that the table has not, by the library of all units; `ValueError` says what is wrong beyond the names."""
    if len(name) > 40 or not _SPELLING.fullmatch(name):
        raise ValueError("")
    registry = _library()
    try:
        found, wanted = registry.parse_units(name), registry.parse_units("" if si == "1" else si)
        if bool(_ANGLES & set(found._units)) != bool(_ANGLES & set(wanted._units)):
            raise ValueError("; an angle counts as a unit of its own")
        if not found.is_compatible_with(wanted):
            raise ValueError(f"; {name} is of another kind")
        zero, one = registry.Quantity(Fraction(0), found).to(wanted), registry.Quantity(Fraction(1), found).to(wanted)
        offset = Fraction(zero.magnitude)
        return Unit(Fraction(one.magnitude) - offset, offset)
    except ValueError as error:
        if str(error).startswith(";"):
            raise
        raise ValueError("") from None
    except Exception:  # whatever a parser of free text raises: it is no unit
        raise ValueError("") from None


def spelled(text: str) -> bool:
    """Whether a text is a unit of any kind in the table (bare numbers are not)."""
    name = text.strip()
    return not name.isdigit() and (name in _TABLE or any(name in known for known in _TABLE.values()))


def to_si(number: float, of: Unit) -> float:
    """A number in a unit as a number in SI."""
    if isinstance(of.factor, Fraction) and math.isfinite(number):
        return _rounded(Fraction(repr(float(number))), of)  # as written: 95 % is 0.95
    return float(number * float(of.factor) + float(of.offset))


def _rounded(number: Fraction, of: Unit) -> float:
    try:
        return float(number * Fraction(of.factor) + Fraction(of.offset))
    except OverflowError:
        return math.copysign(math.inf, number)
