"""Units of numbers: `SI = factor · number + offset`."""

import functools
import math
import re
from fractions import Fraction
from typing import Any, NamedTuple


class Unit(NamedTuple):
    """A unit as `SI = factor · number + offset`; differences such as standard
    deviations take the factor alone."""

    factor: float | Fraction
    offset: float | Fraction = 0


_TURN = 2 * math.pi
#: pound (kg), standard gravity (m/s²), foot-pound (J), pound per square inch (Pa):
#: exact by definition
POUND = Fraction("0.45359237")
GRAVITY = Fraction("9.80665")
FOOT_POUND = POUND * GRAVITY * Fraction("0.3048")
PSI = POUND * GRAVITY / Fraction("0.0254") ** 2
_FOOT_POUNDS = {"ft*lbf": FOOT_POUND, "ft*klbf": 1000 * FOOT_POUND}
#: forces (N) in which a hook load is read on a rig; a mass in one of them is that of
#: this weight
WEIGHTS = {
    **{"daN": Fraction(10), "kN": Fraction(1000), "MN": Fraction(1000000)},
    **{"lbf": POUND * GRAVITY, "klbf": 1000 * POUND * GRAVITY},
    **{"kgf": GRAVITY, "kp": GRAVITY, "tf": 1000 * GRAVITY},
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
        "lb": POUND,
        "N": 1 / GRAVITY,
        **{name: x / GRAVITY for name, x in WEIGHTS.items()},
    },
    "N": {**WEIGHTS, "t": WEIGHTS["tf"]},
    "N/m": {"kN/m": 1e3, "MN/m": 1e6, "N/mm": 1e3, "kN/mm": 1e6},
    "N*s/m": {"kN*s/m": 1e3},
    "N*m": {"Nm": 1, "kN*m": 1e3, "kNm": 1e3, **_FOOT_POUNDS, "lbf*ft": FOOT_POUND},
    "Pa": {
        "kPa": 1e3,
        "MPa": 1e6,
        "GPa": 1e9,
        "bar": 1e5,
        "N/mm^2": 1e6,
        "psi": PSI,
        "ksi": 1000 * PSI,
    },
    "Pa*s": {"mPa*s": "1e-3", "cP": "1e-3"},
    "J": {"kJ": 1e3, "MJ": 1e6, **_FOOT_POUNDS},
    "W": {"kW": 1e3, "MW": 1e6, "hp": 550 * FOOT_POUND},
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
            f"1 {w}*{l}^2 {of}2 is {float(factor(w, l, of)):.4g} kg·m²"
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
    if not of and (weight == "N" or weight in WEIGHTS):
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
