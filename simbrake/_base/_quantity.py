"""Numbers with units: unit, range and meaning of a number, and the forms in which it
may be written."""

import dataclasses
import enum
import functools
import json
import math
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Int

from ..hybrid.arrays import Array, Floats
from ._compiling import warn_of_untested_jax
from ._faults import Fault, Faults, Issues
from ._faults import shown as shown
from ._numbers import pretty
from ._units import to_si, unit

if TYPE_CHECKING:
    Scalar = Values = Any  # accepted inputs: a number, a list, an array
else:
    #: what a field holds: one number, or an array of them
    Scalar = Floats
    #: accepted by a formula: one number, or an array or list of them
    Values = Floats | Int[Array, "..."] | float | int | list | tuple


# set here, as every scene and every computing command imports this module
warn_of_untested_jax(jax.__version_info__)

#: magnitude beyond which squares and products of a scene's parameters overflow 64 bits;
#: what must be positive is as far from 0
LARGEST = 1e40
#: the same of quantities whose larger values are no brakes: lengths, and times of
#: 30,000 years
_LARGEST_OF = {"m": 1e6, "s": 1e12}


class IndexedBy(enum.Enum):
    """Index of a list of numbers that has no entry for each lining."""

    GAPS = "one between each two linings"
    ROWS = "points of a table, times, nodes: any number"


class Characteristic(NamedTuple):
    """Characteristic sizes of a machine (SI), from which typical sizes of its numbers
    follow by their units."""

    force: Any
    length: Any
    speed: Any  # rad/s
    temperature: Any


#: powers of the characteristic sizes in a unit
_POWERS = {
    "N": (1, 0, 0, 0),
    "m": (0, 1, 0, 0),
    "s": (0, 0, -1, 0),
    "K": (0, 0, 0, 1),
    "kg": (1, -1, -2, 0),
    "Pa": (1, -2, 0, 0),
    "J": (1, 1, 0, 0),
    "W": (1, 1, 1, 0),
}


@functools.cache
def _powers(unit: str) -> tuple[int, ...]:
    """The same of a product of units: `W/(m^2*K)`."""
    total = np.zeros(4, int)
    above, _, below = unit.partition("/")
    for sign, product in ((1, above), (-1, below.strip("()"))):
        for factor in product.split("*"):
            name, _, exponent = factor.partition("^")
            total += (
                sign * int(exponent or 1) * np.asarray(_POWERS.get(name, (0, 0, 0, 0)))
            )
    return tuple(total.tolist())


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Unit (SI), meaning and range of a number; bounds are inclusive unless
    `open_low`."""

    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    difference: bool = False  # of temperatures: no offset of degC
    # one number, or one for each (lining, unless it says of what)
    many: bool | IndexedBy = False
    may_be_empty: bool = False  # an empty array has a meaning
    typical: float | None = None  # size, where the unit does not tell it
    instead: str = ""  # what to write in place of a value out of its range

    def size(self, machine: Characteristic) -> Any:
        """Typical size of the number in a machine (SI): what an effect that is absent,
        0, would be if it were there."""
        if self.typical is not None:
            return self.typical
        size = 1.0
        for base, power in zip(machine, _powers(self.unit), strict=True):
            size = size * base**power if power else size
        return size

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest value, where none is given those with which one can
        compute."""
        most = _LARGEST_OF.get(self.unit, LARGEST)
        low = (
            -most
            if self.low is None
            else 1 / LARGEST
            if self.open_low and self.low == 0
            else self.low
        )
        return low, most if self.high is None else self.high

    def admits(self, value: np.ndarray) -> np.ndarray:
        low, high = self.ends
        # a NaN is not
        return np.asarray(
            ((value > low) if self.open_low else (value >= low)) & (value <= high)
        )

    def admits_one(self, value: float) -> bool:
        """The same for a single number, faster."""
        low, high = self.ends
        return bool((low < value if self.open_low else low <= value) and value <= high)

    def hint(self, value: float, unit: str, *, bare: bool = True) -> str:
        """What is allowed in place of a number out of range, and what may have been
        meant; `unit`: that of `SI`; `bare`: it was written without a unit."""
        turned = (
            bare
            and self.unit == "rad"
            and self.high is not None
            and self.admits_one(math.radians(value))
        )
        meant = (
            f'did you mean "{value:g} deg"?'
            if turned and value > np.pi
            else self.instead
        )
        return f"{self.meaning} must be {self.range_text(value)}{unit_suffix(unit)}" + (
            f"; {meant}" if meant else ""
        )

    def range_text(self, value: float) -> str:
        """Allowed range of a number, in words."""
        low, high = self.ends
        if 0 < value <= low and self.low == 0:
            return f"> {low:g}"
        return (
            f"at most {high:g} in magnitude"
            if self.high is None and high < abs(value) < np.inf
            else self.range
        )

    @property
    def range(self) -> str:
        parts = []
        if self.low is not None:
            parts.append(f"{'>' if self.open_low else '≥'} {self.low:g}")
        if self.high is not None:
            parts.append(f"≤ {self.high:g}")
        return "finite" if not parts else " and ".join(parts)


def as_number(x: Any) -> Any:
    """Numbers, lists, NumPy arrays and columns of tables as float64 arrays, so that a
    new value never re-traces.

    JAX arrays are kept, whole numbers in them become float64; values that are not
    numbers are kept.
    """
    if type(x) is np.ndarray and x.dtype == np.float64:
        return x
    if isinstance(x, jax.Array):
        return x.astype(np.float64) if jnp.issubdtype(x.dtype, jnp.integer) else x
    column = getattr(x, "to_numpy", None)  # of pandas, xarray, polars
    if column is not None and not isinstance(x, type):
        x = column()
    if isinstance(x, bool) or not isinstance(
        x, int | float | list | tuple | np.ndarray | np.generic
    ):
        return x
    try:
        if any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(x)):
            return jnp.asarray(x, np.float64)
        array = np.asarray(x)
    except (ValueError, TypeError):  # lists of unequal length
        return x
    return array.astype(np.float64, copy=False) if array.dtype.kind in "iuf" else x


def in_si(x: Any, about: Quantity) -> Any:
    """Convert a value, also a text with its unit, to a number in SI; return it
    unchanged if it cannot be read."""
    if not has_units(x) or about.unit == "SI":
        return as_number(x)
    reader = NumberReader()
    number = reader.number(
        list(x) if isinstance(x, tuple) else x, about, "", about.unit
    )
    return x if reader.faults else np.asarray(number, np.float64)


def has_units(x: object) -> bool:
    return isinstance(x, str) or (
        isinstance(x, list | tuple) and any(isinstance(entry, str) for entry in x)
    )


#: other units in which lengths (m) and areas (m²) are given, with their size
_UNITS = {
    "m": (("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)),
    "m^2": (("cm^2", 1e-4), ("mm^2", 1e-6), ("in^2", 0.0254**2)),
}


def meant_within(value: float, low: float, high: float, unit: str = "m") -> str:
    """What a length or an area may mean that lies within `low…high`: half a diameter,
    or a number in another unit."""
    if unit == "m" and low <= value / 2 <= high:
        return f"{value / 2:g} m, half of a diameter"
    return next(
        (
            f'"{value:g} {other}"'
            for other, size in _UNITS[unit]
            if low <= value * size <= high
        ),
        "",
    )


def positive(unit: str, meaning: str, high: float | None = None) -> Quantity:
    """Metadata of a number that must be > 0, for the annotation of a parameter."""
    return Quantity(unit, meaning, 0.0, high, open_low=True)


def faults_of_tolerance(rtol: Values) -> Faults:
    """Error of a relative tolerance outside 1e-15…0.1. A traced one is not checked."""
    if (isinstance(rtol, float) and 1e-15 < rtol < 0.1) or isinstance(rtol, Tracer):
        return []
    value = np.asarray(rtol)
    # a NaN is not
    admissible = value.dtype.kind in "fiu" and np.all((value > 1e-15) & (value < 0.1))
    return (
        []
        if admissible
        else [
            Fault("rtol", f"{shown(rtol)} is out of range", "must be > 1e-15 and < 0.1")
        ]
    )


# --- numbers with units as text -----------------------------------------------------

#: placeholder for a value that could not be read
BAD = object()
_DIGITS = r"\d+(?:_\d+)*"  # as Python and TOML have them
_NUMBER = re.compile(
    rf"\s*(?P<number>[+-]?(?:{_DIGITS}(?:\.(?:{_DIGITS})?)?|\.{_DIGITS})(?:[eE][+-]?\d{{1,4}})?)"
    r"\s*(?P<unit>[^\d\s.].*|1/.*|)"
)
_LIST = re.compile(r"\s*(?P<list>\[[^\[\]]*\])\s*(?P<unit>.*)")


class NumberReader:
    """Read numbers and collect every error: path, value, unit, reason, and allowed
    range."""

    def __init__(self) -> None:
        self.faults: Issues = Issues()

    def fault(self, path: str, problem: str, hint: str = "") -> object:
        self.faults.add(path or "scene", problem, hint)
        return BAD

    def number(self, value: object, about: Quantity, path: str, unit: str) -> Any:
        """A number or a list of numbers in SI, inside its range."""
        if isinstance(value, str) and (match := _LIST.fullmatch(value)):
            try:
                listed = json.loads(re.sub(r"(?<=\d)_(?=\d)", "", match["list"]))
            except ValueError:
                return self.fault(
                    path,
                    f"{shown(value)} is not a list of numbers",
                    'as in "[0.2, 0.3] rad"',
                )
            value = [
                f"{x!r} {match['unit']}" if isinstance(x, int | float) else x
                for x in listed
            ]
        if isinstance(value, list) and not about.many:
            return self.fault(
                path, "is a list", f"give one number: {about.meaning}{example(unit)}"
            )
        if isinstance(value, list):
            entries = [
                self._scalar(entry, about, f"{path}[{i}]", unit)
                for i, entry in enumerate(value)
            ]
            return (
                BAD
                if any(entry is BAD for entry in entries)
                else np.asarray(entries, np.float64)
            )
        return self._scalar(value, about, path, unit)

    def _scalar(self, value: object, about: Quantity, path: str, si: str) -> Any:
        number = self._in_si(value, about, path, si)
        if number is BAD or about.admits(np.asarray(number)).all():
            return number
        converted = f"{number:g}{unit_suffix(si)}"
        same = isinstance(value, str) and converted != value and np.isfinite(number)
        return self.fault(
            path,
            f"{shown(value)}{f' = {converted}' if same else ''} is out of range",
            about.hint(number, si, bare=not isinstance(value, str)),
        )

    def _in_si(self, value: object, about: Quantity, path: str, si: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            return self.fault(
                path, f"{shown(value)} is not a number", f"{about.meaning}{example(si)}"
            )
        if not isinstance(value, str):
            try:
                return float(value)
            except OverflowError:
                return self.fault(path, f"{shown(value)} is too large")
        if re.search(r"\d/\d", value):
            return self.fault(
                path,
                f"{shown(value)} has a fraction",
                'write a decimal number, as in "1.125 in"',
            )
        match = _NUMBER.fullmatch(value.replace("\N{MINUS SIGN}", "-"))
        if match is None:
            return self.fault(
                path,
                f"{shown(value)} is not a number with a unit",
                f"{about.meaning}{example(si)}",
            )
        if match["unit"].startswith(","):
            return self.fault(
                path,
                f"{shown(value)} has a comma",
                'write a decimal point and no separators, as in "1200.5"',
            )
        try:
            of = unit(match["unit"], si)
        except ValueError as error:
            kind = "a pure number" if si == "1" else f"which is in {si}"
            what = f"{match['unit'].strip()!r} is not a unit of {about.meaning}, {kind}"
            return self.fault(path, f"{shown(value)}: {what}", str(error))
        if about.difference and of.offset:
            return self.fault(
                path,
                f"{shown(value)} is a temperature, not a difference of two",
                "give it in K",
            )
        number = float(match["number"])
        return to_si(number, of)


def unit_suffix(unit: str) -> str:
    """A unit as it follows a number in a message: a pure number has none."""
    return f" {unit}" if pretty(unit) else ""


def example(si: str) -> str:
    """Hint: accepted forms of a number in the unit `si`."""
    examples = {
        "N": "120 kN",
        "rad": "270 deg",
        "K": "450 degC",
        "m": "590 mm",
        "rad/s": "24 rad/s",
        "s": "0.35 s",
    }
    examples["m^3/s"] = "200 l/min"
    return (
        f', in SI units or with its unit, as in "{examples.get(si, f"1.5 {si}")}"'
        if unit_suffix(si)
        else ""
    )
