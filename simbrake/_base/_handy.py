"""Numbers for reading: an SI value in the unit that keeps it short, as text, with the exact value behind it."""

import math
from typing import Any, NamedTuple

import numpy as np

#: SI unit → from which magnitude on, factor and name of a unit for reading; the last one holds for all that is smaller
_SCALES: dict[str, tuple[tuple[float, float, str], ...]] = {
    "N": ((1e6, 1e-6, "MN"), (1e3, 1e-3, "kN"), (0.0, 1.0, "N")),
    "N*m": ((1e6, 1e-6, "MN·m"), (1e3, 1e-3, "kN·m"), (0.0, 1.0, "N·m")),
    "N/m": ((1e6, 1e-6, "MN/m"), (1e3, 1e-3, "kN/m"), (0.0, 1.0, "N/m")),
    "J": ((1e7, 1e-6, "MJ"), (1e3, 1e-3, "kJ"), (0.0, 1.0, "J")),
    "W": ((1e6, 1e-6, "MW"), (1e3, 1e-3, "kW"), (0.0, 1.0, "W")),
    "Pa": ((1e9, 1e-9, "GPa"), (1e5, 1e-6, "MPa"), (1e3, 1e-3, "kPa"), (0.0, 1.0, "Pa")),
    "kg": ((1e4, 1e-3, "t"), (0.0, 1.0, "kg")),
    "m": ((0.1, 1.0, "m"), (1e-4, 1e3, "mm"), (1e-7, 1e6, "µm"), (0.0, 1.0, "m")),
    "m^2": ((0.01, 1.0, "m²"), (0.0, 1e4, "cm²")),
    "s": ((0.1, 1.0, "s"), (1e-4, 1e3, "ms"), (1e-7, 1e6, "µs"), (0.0, 1.0, "s")),
    "rad": ((2.1 * math.pi, 1.0, "rad"), (0.0, 180 / math.pi, "°")),
}
ZERO = 273.15  # K, of the Celsius scale
_UPPER = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


class Number(NamedTuple):
    """A number as a reader meets it: `text` and `unit`, and exactly, as JSON has it, `si` in the unit `si_unit`."""

    text: str
    unit: str = ""
    si: str = ""
    si_unit: str = ""

    def __str__(self) -> str:
        return f"{self.text}{'' if self.unit == '°' else ' '}{self.unit}".strip()


def pretty(unit: str) -> str:
    """A unit with dots and raised powers: `kg*m^2` becomes `kg·m²`; a pure number has none."""
    if unit in ("1", "SI", ""):
        return ""
    head, *powers = unit.replace("*", "·").split("^")
    return head + "".join(part[0].translate(_UPPER) + part[1:] for part in powers)


def digits(x: float, count: int = 6) -> str:
    """A number with `count` significant digits; far from 1 as a power of ten, never as `1e+05`."""
    x = float(x)
    if not math.isfinite(x):
        return "—" if math.isnan(x) else "∞" if x > 0 else "−∞"
    mantissa, _, power = f"{x:.{count}g}".partition("e")
    if power and 0 < int(power) < 9 and abs(x) < 1e7:
        mantissa, power = f"{float(f'{x:.{count}g}'):.0f}", ""
    if not power:
        return mantissa.replace("-", "−")
    raised = f"10{str(int(power)).translate(_UPPER)}"
    ones = {"1": raised, "-1": f"−{raised}"}
    return ones.get(mantissa, f"{mantissa.replace('-', '−')}·{raised}")


def scale(unit: str, magnitude: float, *, absolute: bool = False) -> tuple[float, float, str]:
    """Factor, offset and name of the unit for reading values up to `magnitude` (SI).

    `absolute`: kelvins are temperatures, read in °C, not differences of them.
    """
    if unit == "K":
        return (1.0, -ZERO, "°C") if absolute else (1.0, 0.0, "K")
    for low, factor, name in _SCALES.get(unit, ()):
        if magnitude >= low and (magnitude > 0 or factor == 1.0):
            return factor, 0.0, name
    return 1.0, 0.0, pretty(unit)


def number(
    value: Any, unit: str = "", *, absolute: bool | None = None, count: int = 6, beside: float | None = None
) -> Number:
    """One number (SI) for reading; `None` and what is not finite become a dash.

    - `absolute`: as for `scale`; by default every K is a temperature
    - `beside`: the magnitude whose unit is taken, that of the greatest of numbers to be compared
    """
    if value is None or not np.isfinite(value):
        return Number("—")
    x = float(value)
    factor, offset, name = scale(
        unit, abs(x) if beside is None else beside, absolute=unit == "K" if absolute is None else absolute
    )
    return Number(digits(x * factor + offset, count), name, repr(x), pretty(unit))


def numbers(values: Any, unit: str = "", *, absolute: bool | None = None, count: int = 6, most: int = 6) -> Number:
    """A number or an array of them: all alike as one, a few listed, many as their range."""
    array = np.asarray(values, float)
    if array.ndim == 0:
        return number(array, unit, absolute=absolute, count=count)
    if array.size == 0:
        return Number("none")
    flat = array.ravel()
    factor, offset, name = scale(
        unit, float(np.abs(flat).max()), absolute=unit == "K" if absolute is None else absolute
    )
    shown = [digits(x * factor + offset, count) for x in flat]
    exact = ", ".join(repr(x) for x in flat.tolist()) if flat.size <= 100 else ""
    if array.size > 1 and np.ptp(flat) <= 1e-12 * np.abs(flat).max():
        words = f"{array.size} × {shown[0]}"
    elif array.size <= most:
        words = ", ".join(shown)
    else:
        low, high = (digits(x * factor + offset, count) for x in (flat.min(), flat.max()))
        words = f"{array.size} values from {low} to {high}"
    return Number(words, name, exact, pretty(unit))
