"""Numbers as people read them: a few digits, in a unit that suits their size, of SI or
of rigs."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.core import Tracer

from ._arguments import explained
from ._faults import input_error
from ._units import FOOT_POUND, POUND, PSI, WEIGHTS

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
        (float(WEIGHTS["klbf"]), float(1 / WEIGHTS["klbf"]), "klbf"),
        (0.0, float(1 / WEIGHTS["lbf"]), "lbf"),
    ),
    "N*m": (
        (1e6, float(0.001 / FOOT_POUND), "ft·klbf"),
        (0.0, float(1 / FOOT_POUND), "ft·lbf"),
    ),
    "J": (
        (1e3, float(0.001 / FOOT_POUND), "ft·klbf"),
        (0.0, float(1 / FOOT_POUND), "ft·lbf"),
    ),
    "W": ((0.0, float(1 / (550 * FOOT_POUND)), "hp"),),
    "Pa": ((1e7, float(0.001 / PSI), "ksi"), (0.0, float(1 / PSI), "psi")),
    "kg": ((0.0, float(1 / POUND), "lb"),),
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
    stay in SI. Raises `InputError` for another name.

    Example:
        >>> with sb.results.display_units("rig"):
        ...     print(sb.Pulley("600 mm", 1200))
        Pulley(radius=1.9685 ft, inertia=1200 kg·m²)
    """
    if system not in ("si", "rig"):
        raise input_error("system", f"{system!r} is unknown", "there are: si, rig")
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


class Reading(NamedTuple):
    """Turns numbers in SI into those for reading, in the unit `name`."""

    factor: float
    offset: float
    name: str

    def __call__(self, values: Any) -> Any:
        return self.factor * np.asarray(values) + self.offset

    def axis(self, words: str, pure: str = "") -> str:
        """Words of an axis with its unit, `pure` where it has none."""
        return f"{words}, {self.name}" if self.name else words + pure


#: SI unit → a size of brakes, by which axes of figures have their units
_OF_BRAKES = {"N": 1e4, "N*m": 1e4, "J": 1e4, "W": 1e4, "Pa": 1e6, "kg": 1e4}


def reading(unit: str, like: float | None = None) -> Reading:
    """How an axis shows a quantity: in the unit for values such as `like` (SI), by
    default in that of brakes: kN, kN·m, kJ, kW, MPa, t, °C.

    Example:
        >>> reading("N").name, reading("J", 3e7)(3e7).item()
        ('kN', 30.0)
    """
    size = _OF_BRAKES.get(unit, 1.0) if like is None else like
    return Reading(*scale(unit, size, absolute=True))


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
