"""Numbers with units: how a field says its unit, range and meaning, and how people write its value."""

import dataclasses
import functools
import json
import math
import re
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer
from jaxtyping import Float

from ..hybrid._arrays import Array
from ._compiling import warn_of_untested_jax
from ._faults import Fault

if TYPE_CHECKING:
    Scalar = Any  # what a caller may write: a number, a list, an array
else:
    #: what a field holds: one number, or an array of them
    Scalar = Float[Array, "..."] | Float[np.ndarray, "..."]


warn_of_untested_jax(jax.__version_info__)  # here, as every scene and every command that computes imports this module

#: magnitude beyond which squares and products of a scene's numbers would leave the range of 64 bits
LARGEST = 1e40


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Unit (SI), meaning and admissible range of a number; bounds are inclusive unless `open_low`."""

    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    difference: bool = False  # of temperatures: 20 degC would be another number
    many: bool = False  # one number, or one for each lining, node or row of a table
    may_be_empty: bool = False  # of many: none at all is a meaning, too

    def admits(self, value: np.ndarray) -> np.ndarray:
        ok = np.asarray(np.abs(value) <= LARGEST)  # a NaN is not
        if self.low is not None:
            ok = ok & ((value > self.low) if self.open_low else (value >= self.low))
        if self.high is not None:
            ok = ok & (value <= self.high)
        return np.asarray(ok)

    def wanted(self, value: float) -> str:
        """What a number that is not admitted should have been."""
        return f"at most {LARGEST:g} in magnitude" if LARGEST < abs(value) < np.inf else self.range

    @property
    def range(self) -> str:
        parts = []
        if self.low is not None:
            parts.append(f"{'>' if self.open_low else '≥'} {self.low:g}")
        if self.high is not None:
            parts.append(f"≤ {self.high:g}")
        return "finite" if not parts else " and ".join(parts)


def as_number(x: Any) -> Any:
    """Python and NumPy numbers as float64 arrays, so that a new value never re-traces; JAX arrays stay as they are."""
    if x is None or isinstance(x, jax.Array) or not isinstance(x, int | float | list | tuple | np.ndarray | np.generic):
        return x
    return np.asarray(x, dtype=np.float64)


def positive(unit: str, meaning: str, high: float | None = None) -> Quantity:
    """What is known of a number that must be > 0, for the annotation of a parameter."""
    return Quantity(unit, meaning, 0.0, high, open_low=True)


def quantity(
    unit: str,
    meaning: str,
    *,
    low: float | None = None,
    high: float | None = None,
    positive: bool = False,
    difference: bool = False,
    many: bool = False,
    default: Any = dataclasses.MISSING,
) -> Any:
    """A numeric field: an array leaf in SI units, with what a reader and a checker must know of it.

    The unit `SI` is that of the field in which the object stands (`holding`, or the quantity it stands for).
    """
    about = Quantity(unit, meaning, 0.0 if positive else low, high, positive, difference, many, default == ())
    keywords = {} if default is dataclasses.MISSING else {"default": default}
    return eqx.field(converter=as_number, metadata={"quantity": about}, **keywords)


@dataclasses.dataclass(frozen=True)
class Whole:
    """Meaning and admissible range of a whole number that belongs to the structure."""

    meaning: str
    low: int
    high: int


def whole(meaning: str, *, low: int = 1, high: int = 100_000, default: Any = dataclasses.MISSING) -> Any:
    """A field with a whole number of the structure (static: another number is another program)."""
    keywords = {} if default is dataclasses.MISSING else {"default": default}
    return eqx.field(static=True, metadata={"whole": Whole(meaning, low, high)}, **keywords)


def holding(unit: str, **keywords: Any) -> Any:
    """A field with an object whose numbers of the unit `SI` are in `unit`, as the profile of a tension in N."""
    return eqx.field(metadata={"unit": unit}, **keywords)


def unit_below(field: dataclasses.Field, unit: str) -> str:
    """What the unit `SI` means below a field that stands where it means `unit`."""
    about = field.metadata.get("quantity")
    given = field.metadata.get("unit") if about is None else about.unit
    return unit if given in (None, "SI") else given


def about_of(field: dataclasses.Field, unit: str) -> Quantity | None:
    """What is known of a numeric field that stands where the unit `SI` means `unit`; `None` for other fields."""
    about = field.metadata.get("quantity")
    return dataclasses.replace(about, unit=unit) if about is not None and about.unit == "SI" else about


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number (or array of numbers) of a scene: its path, its value and what is known of it."""

    path: str
    value: Any
    about: Quantity


def leaves(node: Any, path: str = "", unit: str = "SI") -> list[Leaf]:
    """Every quantity below `node`, in the order of the fields; `unit`: what `SI` means here."""
    found: list[Leaf] = []
    if isinstance(node, tuple | list):
        for i, child in enumerate(node):
            found += leaves(child, f"{path}[{i}]", unit)
        return found
    if not dataclasses.is_dataclass(node) or isinstance(node, type):
        return found
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        here = f"{path}.{field.name}" if path else field.name
        about = about_of(field, unit)
        if about is not None and not dataclasses.is_dataclass(value):  # where a law may stand for a number, its numbers
            if value is not None:
                found.append(Leaf(here, value, about))
        else:
            found += leaves(value, here, unit_below(field, unit))
    return found


def faults_of_values(node: Any, path: str = "") -> list[Fault]:
    """Values that are not numbers, not finite, outside their range or of too few bits. Traced values pass the rest."""
    faults = []
    for leaf in leaves(node, path):
        dtype = getattr(leaf.value, "dtype", np.dtype(np.float64))
        if np.issubdtype(dtype, np.floating) and dtype != np.float64:
            what = f"is {dtype}, in which events cannot be located"
            faults.append(Fault(leaf.path, what, f"give {leaf.about.meaning} as float64"))
            continue
        if isinstance(leaf.value, Tracer):
            continue
        if not isinstance(leaf.value, np.ndarray | jax.Array):
            faults.append(Fault(leaf.path, f"{leaf.value!r} is not a number", f"give a number in {leaf.about.unit}"))
            continue
        value = np.asarray(leaf.value)
        if value.ndim > leaf.about.many:
            hint = "give one number" + (", or a list of numbers" if leaf.about.many else "")
            faults.append(Fault(leaf.path, f"has the shape {value.shape}", hint))
            continue
        if value.size == 0 and not leaf.about.may_be_empty:
            faults.append(Fault(leaf.path, "is an empty list", f"give {leaf.about.meaning}"))
            continue
        bad = ~leaf.about.admits(value)
        if bad.any():
            which = "" if value.ndim == 0 else "[" + ", ".join(str(i) for i in np.argwhere(bad)[0]) + "]"
            worst = value[bad].flat[0]
            faults.append(
                Fault(
                    leaf.path + which,
                    f"{worst:g} {leaf.about.unit} is not admissible",
                    f"{leaf.about.meaning} must be {leaf.about.wanted(worst)} {leaf.about.unit}",
                )
            )
    return faults


def faults_of_tolerance(rtol: Any) -> list[Fault]:
    """A relative tolerance outside 1e-15…0.1. A traced one cannot be looked at and passes."""
    if isinstance(rtol, Tracer):
        return []
    value = np.asarray(rtol)
    # written so that a NaN is a fault
    admissible = np.all((value > 1e-15) & (value < 0.1))
    return [] if admissible else [Fault("rtol", f"{rtol} is not admissible", "must be > 1e-15 and < 0.1")]


# --- units ------------------------------------------------------------------------------------------------------------


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


# --- numbers as people write them -------------------------------------------------------------------------------------

#: what stands for a value that could not be read
BAD = object()
_NUMBER = re.compile(r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(?P<unit>[^\d\s.].*|1/.*|)")
_LIST = re.compile(r"\s*(?P<list>\[[^\[\]]*\])\s*(?P<unit>.*)")


class NumberReader:
    """Reads numbers and keeps every fault: path, value, unit, why, and what is admissible."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def fault(self, path: str, problem: str, hint: str = "") -> Any:
        self.faults.append(Fault(path or "scene", problem, hint))
        return BAD

    def number(self, value: Any, about: Quantity, path: str, unit: str) -> Any:
        """A number or a list of numbers in SI, inside its range."""
        if isinstance(value, str) and (match := _LIST.fullmatch(value)):
            try:
                listed = json.loads(match["list"])
            except ValueError:
                return self.fault(path, f"{shown(value)} is no list of numbers", 'as in "[0.2, 0.3] rad"')
            value = [f"{x!r} {match['unit']}" if isinstance(x, int | float) else x for x in listed]
        if isinstance(value, list) and not about.many:
            return self.fault(path, "is a list", f"one number is wanted: {about.meaning}{example(unit)}")
        if isinstance(value, list):
            entries = [self._scalar(one, about, f"{path}[{i}]", unit) for i, one in enumerate(value)]
            return BAD if any(one is BAD for one in entries) else np.asarray(entries, np.float64)
        return self._scalar(value, about, path, unit)

    def _scalar(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        number = self._in_si(value, about, path, si)
        if number is BAD or about.admits(np.asarray(number)).all():
            return number
        words = f"{about.meaning} must be {about.wanted(number)}" + ("" if si in ("1", "SI") else f" {si}")
        same = isinstance(value, str) and f"{number:g} {si}" != value and np.isfinite(number)
        return self.fault(path, f"{shown(value)}{f' = {number:g} {si}' if same else ''} is not admissible", words)

    def _in_si(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            return self.fault(path, f"{shown(value)} is no number", f"{about.meaning}{example(si)}")
        if not isinstance(value, str):
            try:
                return float(value)
            except OverflowError:
                return self.fault(path, f"{shown(value)} is too large")
        match = _NUMBER.fullmatch(value)
        if match is None:
            return self.fault(path, f"{shown(value)} is no number with a unit", f"{about.meaning}{example(si)}")
        try:
            of = unit(match["unit"], si)
        except ValueError as error:
            what = f"{match['unit'].strip()!r} is no unit of {about.meaning}, which is in {si}"
            return self.fault(path, f"{shown(value)}: {what}", str(error))
        if about.difference and of.offset:
            return self.fault(path, f"{shown(value)} is a temperature, not a difference of two", "give it in K")
        number = float(match["number"])
        return to_si(number, of)


def shown(value: Any) -> str:
    """A value of a file, short enough for a message."""
    text = repr(value) if not isinstance(value, dict) else "a table"
    return text if len(text) <= 60 else text[:57] + "…"


def example(si: str) -> str:
    """How a number in the unit `si` may be written."""
    examples = {"N": "120 kN", "rad": "270 deg", "K": "450 degC", "m": "590 mm", "rad/s": "24 rad/s", "s": "0.35 s"}
    return f', in SI units or with its unit, as in "{examples.get(si, f"1.5 {si}")}"' if si not in ("1", "SI") else ""
