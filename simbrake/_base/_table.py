"""Units, number formatting with readable units, and the table type of all results with
rows.

A table is text, dictionaries for JSON, a data frame, and HTML in a notebook. A study,
an estimate or a comparison returns a `Tabular`: lines of text and tables, in the order
in which they are read.
"""

import abc
import dataclasses
import enum
import functools
import html
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from typing import Any, NamedTuple, TypeVar, dataclass_transform

import jax
import numpy as np
from jax.core import Tracer

from ..hybrid.struct import Struct
from ._arguments import explained

# --- units ---------------------------------------------------------------------------


class Unit(NamedTuple):
    """A unit as `SI = factor · number + offset`; differences such as standard
    deviations take the factor alone."""

    factor: float | Fraction
    offset: float | Fraction = 0


_TURN = 2 * math.pi
#: pound (kg), standard gravity (m/s²), foot-pound (J), pound per square inch (Pa):
#: exact by definition
_POUND = Fraction("0.45359237")
_GRAVITY = Fraction("9.80665")
_FOOT_POUND = _POUND * _GRAVITY * Fraction("0.3048")
_PSI = _POUND * _GRAVITY / Fraction("0.0254") ** 2
_FOOT_POUNDS = {"ft*lbf": _FOOT_POUND, "ft*klbf": 1000 * _FOOT_POUND}
#: forces (N) in which a hook load is read on a rig; a mass in one of them is that of
#: this weight
_WEIGHTS = {
    **{"daN": Fraction(10), "kN": Fraction(1000), "MN": Fraction(1000000)},
    **{"lbf": _POUND * _GRAVITY, "klbf": 1000 * _POUND * _GRAVITY},
    **{"kgf": _GRAVITY, "kp": _GRAVITY, "tf": 1000 * _GRAVITY},
}
_FACTORS: dict[str, dict[str, float | str | Fraction]] = {
    "s": {"ms": "1e-3", "us": "1e-6", "min": 60, "h": 3600},
    "rad": {"deg": _TURN / 360, "°": _TURN / 360, "rev": _TURN},
    "rad/s": {
        "rpm": _TURN / 60,
        "1/min": _TURN / 60,
        "r/min": _TURN / 60,
        "deg/s": _TURN / 360,
        "rev/s": _TURN,
    },
    "m": {"cm": "1e-2", "mm": "1e-3", "um": "1e-6", "ft": "0.3048", "in": "0.0254"},
    "m/s": {
        "mm/s": "1e-3",
        "km/h": Fraction(10, 36),
        "m/min": Fraction(1, 60),
        "ft/s": "0.3048",
        "ft/min": "0.00508",
    },
    "m^2": {"cm^2": "1e-4", "mm^2": "1e-6", "ft^2": "0.09290304", "in^2": "0.00064516"},
    "m^3/s": {
        **{
            "l/min": Fraction(1, 60_000),
            "l/s": "1e-3",
            "m^3/h": Fraction(1, 3600),
            "m^3/min": Fraction(1, 60),
        },
        **dict.fromkeys(("gpm", "gal/min"), Fraction("3.785411784e-3") / 60),
    },
    "kg": {
        "g": "1e-3",
        "t": 1e3,
        "lb": _POUND,
        "N": 1 / _GRAVITY,
        **{name: x / _GRAVITY for name, x in _WEIGHTS.items()},
    },
    "N": {**_WEIGHTS, "t": _WEIGHTS["tf"]},
    "N/m": {"kN/m": 1e3, "MN/m": 1e6, "N/mm": 1e3, "kN/mm": 1e6},
    "N*s/m": {"kN*s/m": 1e3},
    "N*m": {"Nm": 1, "kN*m": 1e3, "kNm": 1e3, **_FOOT_POUNDS, "lbf*ft": _FOOT_POUND},
    "Pa": {
        "kPa": 1e3,
        "MPa": 1e6,
        "GPa": 1e9,
        "bar": 1e5,
        "N/mm^2": 1e6,
        "psi": _PSI,
        "ksi": 1000 * _PSI,
    },
    "Pa*s": {"mPa*s": "1e-3", "cP": "1e-3"},
    "J": {"kJ": 1e3, "MJ": 1e6, **_FOOT_POUNDS},
    "W": {"kW": 1e3, "MW": 1e6, "hp": 550 * _FOOT_POUND},
    "1": {"": 1, "1": 1, "-": 1, "%": "1e-2"},
}
#: SI unit → spellings of units of the same kind. These need no library, and have the
#: engineering meaning where a general units library differs (C, 1/min); fractions, so
#: that 95 % is exactly 0.95
_TABLE = {
    si: {name: Unit(Fraction(x)) for name, x in factors.items()}
    for si, factors in _FACTORS.items()
}
_TABLE["K"] = {name: Unit(1, Fraction("273.15")) for name in ("degC", "°C", "C")}
_TABLE["K"] |= {
    name: Unit(Fraction(5, 9), Fraction("459.67") * 5 / 9) for name in ("degF", "°F")
}
#: SI unit → spellings that a message names beside those of the table
_EXAMPLES = {"kg*m^2": ("lb*ft^2", "kgf*m^2 GD2", "N*m^2 GD2", "lb*ft^2 WK2")}
#: an inertia: mass or weight times length², GD² of a diameter, WK² (WR²) of a radius of
#: gyration
_INERTIA = re.compile(
    r"(?:(?P<weight>[A-Za-z]+)\*(?P<length>[A-Za-z]+)\^2)?(?:(?P<of>GD|WK|WR)\^?2)?",
    re.IGNORECASE,
)


def _inertia(name: str) -> Unit | None:
    """The unit of an inertia `J` (kg·m²) as data sheets give it; `None` of a text that
    is no mass times length².

        J = GD²/(4 g),   J = WK²/g      of a weight;  of a mass without `g`, so that kgf·m² and kg·m² have one number

    Raises `ValueError` with both readings where it may be either. Sources: GD² Yaskawa,
    SGM servomotors, *Conversions between engineering units and SI units* (GD² in kgf·m²
    is 4 J in kg·m²); WK² in lb·ft² NEMA MG 1.
    """
    match = _INERTIA.fullmatch(name)
    if match is None or not name:
        return None
    weight = match["weight"]
    length = match["length"]
    of = (match["of"] or "").upper()

    def factor(weight: str, length: str, of: str) -> Fraction:
        whole = (
            Fraction(unit(weight, "kg").factor)
            * Fraction(unit(length, "m").factor) ** 2
        )
        return whole / 4 if of == "GD" else whole

    def readings(*of_each: tuple[str, str, str]) -> str:
        return ", ".join(
            f"1 {w}*{l}^2 {of}2 is {digits(float(factor(w, l, of)), 4)} kg·m²"
            for w, l, of in of_each
        )

    if weight is None:
        raise ValueError(
            f"of which unit? {readings(('kgf', 'm', of), ('N', 'm', of), ('lb', 'ft', of))}"
        )
    try:
        whole = factor(weight, length, of)
    except ValueError:
        return None
    if not of and (weight == "N" or weight in _WEIGHTS):
        both = readings((weight, length, "GD"), (weight, length, "WK"))
        raise ValueError(f"say of which length, diameter or radius of gyration: {both}")
    return Unit(whole)


#: other spellings of units of a rig, on their own
_ALIASES = {
    "fpm": "ft/min",
    "kip": "klbf",
    "kips": "klbf",
    "lbs": "lb",
    "lbm": "lb",
    "klbm": "klb",
    "klbs": "klb",
}
#: tons that may be metric, short or long; a general units parser reads `ton` as short,
#: and `mt` as a kilogram
_TONS = re.compile(
    r"(?<![A-Za-z_])(?:k?(?:short|long)?tons?f?|ton_force|force_ton|[mM]t)(?![A-Za-z_])"
)
#: names, products, quotients and one-digit powers: input that a general units parser
#: reads in bounded time
_SPELLING = re.compile(
    r"(?:[A-Za-z°_]|%|1|[*/]|\((?:[A-Za-z°_*/]|\^-?[1-9](?![\d^]))+\)|\^-?[1-9](?![\d^]))+"
)
#: a plane angle has a unit: 20 is not 20 rad, and 3 Hz is ambiguous (3 rad/s or 3
#: rev/s)
_ANGLES = {
    "radian",
    "degree",
    "revolution",
    "turn",
    "revolutions_per_minute",
    "arcminute",
    "arcsecond",
    "gradian",
}


def _plain(text: str) -> str:
    """One spelling of a unit: `kN·m`, `m²` and `µm` as `kN*m`, `m^2` and `um`."""
    name = (
        text.strip()
        .replace("·", "*")
        .replace("⋅", "*")
        .replace("**", "^")
        .replace("²", "^2")
        .replace("³", "^3")
    )
    return name.replace("μ", "u").replace("µ", "u").replace(" ", "")


def unit(text: str, si: str) -> Unit:
    """The unit written as `text` for a quantity of the SI unit `si`; empty text means
    SI.

    Raises `ValueError` with the known spellings, or with the kind of quantity that the
    unit has.
    """
    name = _plain(text)
    si = si or "1"
    name = _ALIASES.get(name, name)
    units = _TABLE.get(si, {})
    if not name or name == si or name in units:
        return units.get(name, Unit(1.0))
    if _TONS.search(name):
        masses = "t is 1000 kg, short_ton 907.185 kg, long_ton 1016.05 kg"
        weights = "tf (metric) is 9.80665 kN, 2 klbf (short) 8.89644 kN"
        raise ValueError(f"which ton? {weights if si == 'N' else masses}")
    if si == "kg*m^2" and (inertia := _inertia(name)) is not None:
        return inertia
    try:
        return _of_library(name, si)
    except ValueError as error:
        names = [
            *(() if si == "1" else (si,)),
            *filter(None, units),
            *_EXAMPLES.get(si, ()),
        ]
        # in another case, a weight where its mass was written, degrees of temperature
        meant = {name.lower(), f"{name.lower()}f", f"deg{name.lower()}"}
        similar = [known for known in names if known.lower() in meant]
        nearest = f"nearest: {' or '.join(similar)}; " if similar else ""
        raise ValueError(f"{nearest}known here: {', '.join(names)}{error}") from None


@functools.cache
def _library() -> Any:
    import pint  # takes a second, only for unusual units

    return pint.UnitRegistry(non_int_type=Fraction, cache_folder=None)  # pyright: ignore


@functools.lru_cache(maxsize=1024)
def _of_library(name: str, si: str) -> Unit:
    """A unit that the table lacks, by the general units library; the `ValueError` adds
    the reason."""
    if len(name) > 40 or not _SPELLING.fullmatch(name):
        raise ValueError("")
    registry = _library()
    try:
        parsed = registry.parse_units(name)
        wanted = registry.parse_units("" if si == "1" else si)
        if bool(_ANGLES & set(parsed._units)) != bool(_ANGLES & set(wanted._units)):
            raise ValueError("; angles have their own unit")
        if not parsed.is_compatible_with(wanted):
            raise ValueError(f"; {name} is of another kind")
        zero = registry.Quantity(Fraction(0), parsed).to(wanted)
        unit = registry.Quantity(Fraction(1), parsed).to(wanted)
        offset = Fraction(zero.magnitude)
        return Unit(Fraction(unit.magnitude) - offset, offset)
    except Exception as error:  # any exception of the parser: the text is not a unit
        raise ValueError(str(error) if str(error).startswith(";") else "") from None


def spelled(text: str) -> bool:
    """Whether a text is a unit of any kind in the table (bare numbers are not)."""
    name = text.strip()
    return not name.isdigit() and (
        name in _TABLE or any(name in units for units in _TABLE.values())
    )


def to_si(number: float, of: Unit) -> float:
    """A number in a unit as a number in SI."""
    if not math.isfinite(number):
        return number
    try:
        # as written
        return float(
            Fraction(repr(float(number))) * Fraction(of.factor) + Fraction(of.offset)
        )
    except OverflowError:
        return math.copysign(math.inf, number)


# --- number formatting --------------------------------------------------------------

#: SI unit → from which magnitude on, factor and name of a unit for reading; smaller
#: ones are shown in the SI unit
_SCALES: dict[str, tuple[tuple[float, float, str], ...]] = {
    "N": ((1e6, 1e-6, "MN"), (1e3, 1e-3, "kN")),
    "N*m": ((1e6, 1e-6, "MN·m"), (1e3, 1e-3, "kN·m")),
    "N/m": ((1e6, 1e-6, "MN/m"), (1e3, 1e-3, "kN/m")),
    "J": ((1e7, 1e-6, "MJ"), (1e3, 1e-3, "kJ")),
    "W": ((1e6, 1e-6, "MW"), (1e3, 1e-3, "kW")),
    "Pa": ((1e9, 1e-9, "GPa"), (1e5, 1e-6, "MPa"), (1e3, 1e-3, "kPa")),
    "kg": ((1e4, 1e-3, "t"),),
    "m": ((0.1, 1.0, "m"), (1e-4, 1e3, "mm"), (1e-9, 1e6, "µm")),
    "m^2": ((0.01, 1.0, "m²"), (0.0, 1e4, "cm²")),
    "m^3/s": ((0.0, 6e4, "l/min"),),
    "s": ((0.1, 1.0, "s"), (1e-4, 1e3, "ms"), (1e-7, 1e6, "µs")),
    "rad": ((2.1 * math.pi, 1.0, "rad"), (0.0, 180 / math.pi, "°")),
}
#: the same on a rig
_RIG_SCALES: dict[str, tuple[tuple[float, float, str], ...]] = {
    "N": (
        (float(_WEIGHTS["klbf"]), float(1 / _WEIGHTS["klbf"]), "klbf"),
        (0.0, float(1 / _WEIGHTS["lbf"]), "lbf"),
    ),
    "N*m": (
        (1e6, float(0.001 / _FOOT_POUND), "ft·klbf"),
        (0.0, float(1 / _FOOT_POUND), "ft·lbf"),
    ),
    "J": (
        (1e3, float(0.001 / _FOOT_POUND), "ft·klbf"),
        (0.0, float(1 / _FOOT_POUND), "ft·lbf"),
    ),
    "W": ((0.0, float(1 / (550 * _FOOT_POUND)), "hp"),),
    "Pa": ((1e7, float(0.001 / _PSI), "ksi"), (0.0, float(1 / _PSI), "psi")),
    "kg": ((0.0, float(1 / _POUND), "lb"),),
    "m": ((0.3, 1 / 0.3048, "ft"), (0.0, 1 / 0.0254, "in")),
    "m^2": ((0.1, 1 / 0.3048**2, "ft²"), (0.0, 1 / 0.0254**2, "in²")),
    "m/s": ((0.0, 60 / 0.3048, "ft/min"),),
    "m/s^2": ((0.0, 1 / 0.3048, "ft/s²"),),
    "m^3/s": ((0.0, float(60 / Fraction("3.785411784e-3")), "gpm"),),
    "rad/s": ((0.0, 30 / math.pi, "rpm"),),
}
#: system of units in which numbers are shown: `si` or `rig`
_SYSTEM: ContextVar[str] = ContextVar("system of units", default="si")
ZERO = 273.15  # K, of the Celsius scale
_UPPER = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


@explained
@contextmanager
def display_units(system: str) -> Iterator[None]:
    """Within it numbers for reading are shown in `si` or in `rig` units; data and JSON
    stay in SI.

    Example:
        >>> with sb.results.display_units("rig"):
        ...     print(sb.Pulley("600 mm", 1200))
        Pulley(radius=1.9685 ft, inertia=1200 kg·m²)
    """
    token = _SYSTEM.set(system)
    try:
        yield
    finally:
        _SYSTEM.reset(token)


def in_rig_units() -> bool:
    """Whether numbers are shown in units of rigs."""
    return _SYSTEM.get() == "rig"


class Number(NamedTuple):
    """A formatted number: `text` and `unit`, and the exact value `si` in the unit
    `si_unit`, as in JSON."""

    text: str
    unit: str = ""
    si: str = ""
    si_unit: str = ""

    def __str__(self) -> str:
        return f"{self.text}{'' if self.unit == '°' else ' '}{self.unit}".strip()


def pretty(unit: str) -> str:
    """A unit with dots and raised powers: `kg*m^2` becomes `kg·m²`; a pure number has
    none."""
    if unit in ("1", "SI", ""):
        return ""
    head, *powers = unit.replace("*", "·").split("^")
    return head + "".join(part[0].translate(_UPPER) + part[1:] for part in powers)


def digits(x: float, count: int = 6) -> str:
    """A number with `count` significant digits; far from 1 as a power of ten, never as
    `1e+05`."""
    x = float(x)
    if not math.isfinite(x):
        return "—" if math.isnan(x) else "∞" if x > 0 else "−∞"
    mantissa, _, power = f"{x:.{count}g}".partition("e")
    if power.startswith("+") and abs(x) < 1e7:
        mantissa = f"{float(f'{x:.{count}g}'):.0f}"
        power = ""
    if not power:
        return mantissa.replace("-", "−")
    raised = f"10{str(int(power)).translate(_UPPER)}"
    ones = {"1": raised, "-1": f"−{raised}"}
    return ones.get(mantissa, f"{mantissa.replace('-', '−')}·{raised}")


def scales(unit: str) -> tuple[tuple[float, float, str], ...]:
    """Of a unit the magnitudes (SI) from which on another unit is read, with its factor
    and name."""
    rig = in_rig_units() and unit in _RIG_SCALES
    return (_RIG_SCALES if rig else _SCALES).get(unit, ())


def scale(
    unit: str, magnitude: float, *, absolute: bool = False
) -> tuple[float, float, str]:
    """Factor, offset and name of the unit for reading values up to `magnitude` (SI).

    `absolute`: kelvins are temperatures, read in °C, not differences of them.
    """
    rig = in_rig_units()
    if unit == "K" and rig:
        return (1.8, -459.67 if absolute else 0.0, "°F")
    if unit == "K":
        return (1.0, -ZERO, "°C") if absolute else (1.0, 0.0, "K")
    for low, factor, name in scales(unit):
        if magnitude >= low and (magnitude > 0 or rig):
            return factor, 0.0, name
    return 1.0, 0.0, pretty(unit)


def number(
    value: Any,
    unit: str = "",
    *,
    absolute: bool | None = None,
    count: int = 6,
    beside: float | None = None,
) -> Number:
    """One number (SI) for reading; `None` and what is not finite become a dash.

    - `absolute`: as for `scale`; by default every K is a temperature
    - `beside`: magnitude that sets the unit, such as the largest of several numbers to
      be compared
    """
    if value is None or not np.isfinite(value):
        return Number("—")
    x = float(value)
    factor, offset, name = scale(
        unit, abs(x) if beside is None else beside, absolute=absolute is not False
    )
    return Number(digits(x * factor + offset, count), name, repr(x), pretty(unit))


def numbers(
    values: Any,
    unit: str = "",
    *,
    absolute: bool | None = None,
    count: int = 6,
    most: int = 6,
) -> Number:
    """Format a number or an array: equal values as one, a few as a list, many as their
    range."""
    array = np.asarray(values, float)
    if array.ndim == 0:
        return number(array, unit, absolute=absolute, count=count)
    if array.size == 0:
        return Number("none")
    flat = array.ravel()
    factor, offset, name = scale(
        unit, float(np.abs(flat).max()), absolute=absolute is not False
    )
    shown = [digits(x * factor + offset, count) for x in flat]
    exact = ", ".join(repr(x) for x in flat.tolist()) if flat.size <= 100 else ""
    if (
        array.size > 1
        and np.isfinite(flat).all()
        and np.ptp(flat) <= 1e-12 * np.abs(flat).max()
    ):
        words = f"{array.size} × {shown[0]}"
    elif array.size <= most:
        words = ", ".join(shown)
    else:
        low, high = (
            digits(x * factor + offset, count) for x in (flat.min(), flat.max())
        )
        words = f"{array.size} values from {low} to {high}"
    return Number(words, name, exact, pretty(unit))


# --- tables -------------------------------------------------------------------------

#: default number format of a table
_SHOWN = ".6g"


class Column(NamedTuple):
    """A column of a table.

    - `name`: of the values in dictionaries and data frames
    - `unit` (SI, `1` or empty: none) and `meaning`
    - `heading`: above the values, by default the name
    - `display_units`: unit beside it, of values that `show` converts
    - `show`: how a value is written, a format as `.4g` or a function of it; what is
      absent stays empty
    - `left`: text that begins at the left edge of the column
    - `hidden`: not in the text, only in dictionaries
    """

    name: str
    unit: str = ""
    meaning: str = ""
    heading: str | None = None
    display_units: str | None = None
    show: str | Callable[[Any], str] = _SHOWN
    left: bool = False
    hidden: bool = False

    @property
    def title(self) -> str:
        """Heading and unit."""
        unit = pretty(self.unit) if self.display_units is None else self.display_units
        heading = self.name.replace("_", " ") if self.heading is None else self.heading
        return f"{heading}, {unit}" if unit and heading else heading or unit

    def scaled(self, like: float, count: int = 4) -> "Column":
        """The same with `count` digits, in the unit for reading values such as `like`
        (SI)."""
        factor, offset, name = scale(self.unit, like, absolute=True)
        return self._replace(
            display_units=name,
            show=lambda x: "" if x != x else digits(x * factor + offset, count),
        )

    def text(self, value: object) -> str:
        """A value as shown in the table."""
        if value is None:
            return ""
        if not isinstance(self.show, str):
            return self.show(value)
        if isinstance(value, bool | np.bool_):
            return "yes" if value else "no"
        if isinstance(value, float | int | np.number):
            return format(
                value, "d" if isinstance(value, int | np.integer) else self.show
            )
        return str(value)


class Table(Sequence[dict[str, Any]]):
    """Rows and columns with units and meanings.

    - `columns`: `Column`s, or names of texts, also `(name, heading)`
    - `rows`: of each a sequence in their order or a
      mapping by their names (missing: absent values);  `title`: above the text
    - `table[0]` is a row as a dictionary, `table["path"]` a column as a list,
      `len(table)` the number of rows
    - `str(table)` is the text, `as_list()` rows for JSON, `frame()` a data frame

    Raises `ValueError` for rows that do not fit the columns, `KeyError` with the known
    names.

    Example:
        >>> print(Table(["part", Column("mass", "kg", show=".1f")], [("rim", 412.0), ("lining", 3.25)]))
        part      mass, kg
        rim          412.0
        lining         3.2
    """

    def __init__(
        self,
        columns: Iterable[Column | str | tuple[str, str]],
        rows: Iterable[Sequence | Mapping],
        title: str = "",
    ) -> None:
        self.columns = tuple(
            column if isinstance(column, Column) else _of_words(column)
            for column in columns
        )
        self.title = title
        self._rows = [self._ordered(row) for row in rows]

    def _ordered(self, row: Any) -> tuple[Any, ...]:
        names = [column.name for column in self.columns]
        if isinstance(row, Mapping):
            if unknown := set(row) - set(names):
                raise ValueError(
                    f"no column {sorted(unknown)}; there are: {', '.join(names)}"
                )
            return tuple(row.get(name) for name in names)
        if len(row) != len(names):
            raise ValueError(
                f"a row of {len(row)} values for {len(names)} columns: {', '.join(names)}"
            )
        return tuple(row)

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, key: Any) -> Any:
        names = [column.name for column in self.columns]
        if isinstance(key, str):
            if key not in names:
                raise KeyError(f"no column {key!r}; there are: {', '.join(names)}")
            return [row[names.index(key)] for row in self._rows]
        if isinstance(key, slice):
            return Table(self.columns, self._rows[key], self.title)
        return dict(zip(names, self._rows[key], strict=True))

    def readable(self, *names: str, title: str = "") -> "Table":
        """The named columns for reading, all numbers of one in the unit that suits the
        largest; empty ones left out."""
        columns = []
        for column in self.columns:
            there = [x for x in self[column.name] if x not in (None, "", ()) and x == x]
            numbers = [abs(x) for x in there if isinstance(x, float)]
            shown = (
                column.scaled(max(numbers))
                if numbers and column.unit not in ("", "s")
                else column
            )
            columns.append(shown._replace(hidden=column.name not in names or not there))
        return Table(columns, self._rows, title or self.title)

    def as_list(self) -> list[dict[str, Any]]:
        """Rows as dictionaries of JSON: `None` for what is absent or not finite."""
        return [plain(row) for row in self]

    def frame(self) -> Any:
        """The same as a `pandas.DataFrame`, units and meanings in `attrs`."""
        import pandas as pd

        frame = pd.DataFrame(
            list(self._rows), columns=[column.name for column in self.columns]
        )
        frame.attrs = {
            column.name: {"unit": column.unit, "meaning": column.meaning}
            for column in self.columns
        }
        return frame

    def _written(self, how: str) -> str:
        from tabulate import tabulate

        shown = [
            (i, column) for i, column in enumerate(self.columns) if not column.hidden
        ]
        cells = [[column.text(row[i]) for i, column in shown] for row in self._rows]
        align = ["left" if column.left else "right" for _, column in shown]
        return tabulate(
            cells,
            [column.title for _, column in shown],
            tablefmt=how,
            disable_numparse=True,
            colalign=align if cells else None,
        )

    def __str__(self) -> str:
        lines = [line.rstrip() for line in self._written("plain").splitlines()]
        return "\n".join([self.title, *lines] if self.title else lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        title = f"<p>{html.escape(self.title)}</p>" if self.title else ""
        return title + self._written("html")

    def markdown(self) -> str:
        """The same as a table of Markdown."""
        return self._written("github")


def _of_words(column: str | tuple[str, str]) -> Column:
    name, heading = (column, None) if isinstance(column, str) else column
    return Column(name, heading=heading, left=True)


_Kind = TypeVar("_Kind")


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def frozen(kind: type[_Kind]) -> type[_Kind]:
    """Decorate a class of results: a dataclass whose fields stay as they are."""
    return dataclasses.dataclass(frozen=True)(kind)


class Tabular(abc.ABC):
    """A result shown as lines of text and tables: `str` returns all of it, a notebook
    shows HTML tables."""

    @abc.abstractmethod
    def parts(self) -> Iterable[str | Table]:
        """Lines and tables in order; an empty line sets parts off."""

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self.parts())

    def _repr_html_(self) -> str:
        return "".join(
            part._repr_html_()
            if isinstance(part, Table)
            else f"<div>{html.escape(part) or '&nbsp;'}</div>"
            for part in self.parts()
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are
        `None`."""
        return plain(self)


def plain(value: Any) -> Any:
    """Convert a value for JSON: arrays and tuples as lists, records as dictionaries,
    `None` for what is not finite."""
    if isinstance(value, Table):
        return value.as_list()
    if isinstance(value, enum.Enum):
        return plain(value.value)
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if dataclasses.is_dataclass(value):
        return {
            field.name: plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
        }
    if names := getattr(value, "_fields", None):
        return {name: plain(entry) for name, entry in zip(names, value, strict=True)}
    if isinstance(value, tuple | list | set | frozenset):
        return [plain(entry) for entry in value]
    return plain(np.asarray(value).tolist())


# --- parts as people read them ------------------------------------------------------


#: characters that fit on a line
_WIDTH = 100


def value_text(value: Any, unit: str = "", *, absolute: bool = True) -> str:
    """A number or an array with its unit; traced values and shapes as `f64[20]`,
    anything else as it is.

    Example:
        >>> value_text(0.59, "m"), value_text([0.2, 0.2, 0.2], "m"), value_text(0.35)
        ('0.59 m', '3 × 0.2 m', '0.35')
    """
    if isinstance(value, Tracer | jax.ShapeDtypeStruct):
        kind = np.dtype(value.dtype)
        return (
            f"{kind.kind}{8 * kind.itemsize}[{','.join(str(n) for n in value.shape)}]"
        )
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        return plain_text(value)
    if array.size == 1 and not np.isfinite(array).all():
        return str(float(array.ravel()[0]))
    if array.ndim == 0:
        return str(number(array, unit, absolute=absolute))
    shown = numbers(array, unit, absolute=absolute)
    return str(shown._replace(text=f"[{shown.text}]") if ", " in shown.text else shown)


def plain_text(value: Any) -> str:
    """What is neither a number nor a part: a name, a count, a function."""
    if callable(value) and not isinstance(value, type):
        return getattr(value, "__qualname__", type(value).__name__)
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def joined(name: str, entries: list[str], brackets: str = "()") -> str:
    """`Name(a, b)` on one line where it fits, else with one entry a line."""
    first, last = brackets
    line = f"{name}{first}{', '.join(entries)}{last}"
    if len(line) <= _WIDTH and "\n" not in line:
        return line
    body = "".join(
        f"  {entry},\n".replace("\n", "\n  ").rstrip(" ") for entry in entries
    )
    return f"{name}{first}\n{body}{last}"


def part_text(
    node: Any,
    about_of: Callable[..., Any],
    unit_below: Callable[..., str],
    unit: str = "SI",
) -> str:
    """A part and all below it with values in readable units; what is absent, or as
    usual and no number, is left out.

    - `about_of`, `unit_below`: metadata of a field, and of those below it, where the
      unit `SI` means `unit`
    """
    entries = []
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        about = about_of(field, unit)
        below = functools.partial(
            part_text,
            about_of=about_of,
            unit_below=unit_below,
            unit=unit_below(field, unit),
        )
        if isinstance(value, Struct):
            text = (
                below(value) if dataclasses.is_dataclass(value) else plain_text(value)
            )
        elif isinstance(value, tuple) and any(
            isinstance(entry, Struct) for entry in value
        ):
            text = joined(
                "",
                [
                    below(entry) if isinstance(entry, Struct) else plain_text(entry)
                    for entry in value
                ],
            )
        elif about is not None and value is not None and np.size(value):
            text = value_text(value, about.unit, absolute=not about.difference)
        elif about is None and value not in (None, (), field.default):
            text = plain_text(value)
        else:
            continue
        entries.append(f"{field.name}={text}")
    return joined(type(node).__name__, entries)


def rows_table(rows: list[tuple[str, str, str]], title: str) -> Table:
    """Name, value with unit and meaning, for a notebook."""
    return Table(["name", Column("value", left=True, show=str), "meaning"], rows, title)


def coloured(text: str, colour: str) -> str:
    """A banner of HTML for a notebook."""
    ink, paper = {
        "red": ("#b3261e", "#fcebea"),
        "amber": ("#8a5a00", "#fdf3e0"),
        "green": ("#1a7440", "#e7f4ec"),
    }[colour]
    style = (
        f"border-left:5px solid {ink};background:{paper};color:{ink};padding:.5em "
        ".8em;margin:.3em 0"
    )
    return f'<div style="{style}">{html.escape(text)}</div>'
