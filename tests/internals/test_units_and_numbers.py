"""Units and numbers as they are read and printed everywhere, and the table that every
result with rows is."""

import json
import math
import re
from fractions import Fraction

import numpy as np
import pint
import pytest

import simbrake as sb
from simbrake._base._table import (
    Column,
    Table,
    Unit,
    digits,
    number,
    numbers,
    plain,
    to_si,
    unit,
)

POUND = 0.45359237
G = 9.80665
FOOT = 0.3048


# --- units that are read ------------------------------------------------------------

#: spellings with the engineering meaning, or with one that pint has not
OWN = {
    ("1/min", "rad/s"): math.pi / 30, ("r/min", "rad/s"): math.pi / 30, ("rev/s", "rad/s"): 2 * math.pi,
    ("rev", "rad"): 2 * math.pi, ("C", "K"): 274.15,
    ("lbf", "kg"): POUND, ("klbf", "kg"): 1e3 * POUND, ("kN", "kg"): 1e3 / G, ("tf", "kg"): 1e3, ("t", "N"): 1e3 * G,
    ("N", "kg"): 1 / G, ("daN", "kg"): 10 / G, ("kgf", "kg"): 1.0, ("kp", "kg"): 1.0, ("kp", "N"): G,
    ("MN", "kg"): 1e6 / G, ("Nm", "N*m"): 1.0, ("kNm", "N*m"): 1e3, ("-", "1"): 1.0,
}  # fmt: skip


def test_every_unit_is_that_of_pint():
    """All spellings that a message offers, one of each in SI."""
    seen = set()
    registry = pint.UnitRegistry()
    for si in [
        "s",
        "rad",
        "rad/s",
        "m",
        "m/s",
        "m^2",
        "kg",
        "N",
        "N/m",
        "N*s/m",
        "N*m",
        "Pa",
        "J",
        "W",
        "1",
        "K",
    ]:
        with pytest.raises(ValueError, match="known here: ") as told:
            unit("unknown", si)
        for name in re.search(r"known here: ([^;]*)", str(told.value))[1].split(", "):
            truth = (
                OWN.get((name, si))
                or registry.Quantity(1.0, name).to("" if si == "1" else si).magnitude
            )
            assert to_si(1.0, unit(name, si)) == pytest.approx(truth, rel=1e-14), (
                name,
                si,
            )
            seen.add((name, si))
    assert seen >= {*OWN, ("bar", "Pa"), ("kJ", "J"), ("degF", "K"), ("%", "1")}


def test_spellings_of_units():
    assert (
        unit("", "m") == unit(" m ", "m") == unit("", "") == unit("1", "1") == Unit(1)
    )
    for text in ("kN·m", "kN⋅m", " kN * m"):
        assert unit(text, "N*m") == Unit(1000)
    assert unit("mm³", "m^3") == unit("mm**3", "m^3") == Unit(Fraction("1e-9"))
    assert unit("μm", "m") == unit("µm", "m") == Unit(Fraction("1e-6"))
    assert unit("fahrenheit", "K") == Unit(Fraction(5, 9), Fraction("459.67") * 5 / 9)
    for text, si in (
        ("kg", "m"),
        ("Hz", "rad/s"),
        ("rad", "1"),
        ("m" + "*m/m" * 10, "m"),
        ("m^12", "m"),
    ):
        with pytest.raises(ValueError, match="known here"):
            unit(text, si)


def test_numbers_come_to_si_as_written():
    assert [to_si(95.0, unit("%", "1")), to_si(0.1, unit("min", "s"))] == [0.95, 6.0]
    assert [to_si(-40.0, unit("degC", "K")), to_si(212.0, unit("degF", "K"))] == [
        233.15,
        pytest.approx(373.15),
    ]
    assert [to_si(x, Unit(1000)) for x in (1e308, -1e308, np.inf)] == [
        np.inf,
        -np.inf,
        np.inf,
    ]


# --- numbers that are printed -------------------------------------------------------

#: unit → magnitudes at which its name for reading changes, these names from the
#: smallest on, and what they are in SI
NAMES = {
    "N": ([1e3, 1e6], {"N": 1, "kN": 1e3, "MN": 1e6}),
    "N*m": ([1e3, 1e6], {"N·m": 1, "kN·m": 1e3, "MN·m": 1e6}),
    "N/m": ([1e3, 1e6], {"N/m": 1, "kN/m": 1e3, "MN/m": 1e6}),
    "J": ([1e3, 1e7], {"J": 1, "kJ": 1e3, "MJ": 1e6}),
    "W": ([1e3, 1e6], {"W": 1, "kW": 1e3, "MW": 1e6}),
    "Pa": ([1e3, 1e5, 1e9], {"Pa": 1, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}),
    "kg": ([1e4], {"kg": 1, "t": 1e3}),
    "m": ([1e-4, 0.1], {"µm": 1e-6, "mm": 1e-3, "m": 1}),
    "m^2": ([0.01], {"cm²": 1e-4, "m²": 1}),
    "s": ([1e-4, 0.1], {"µs": 1e-6, "ms": 1e-3, "s": 1}),
}
RIG_NAMES = {
    "N": ([4448.2216152605], {"lbf": 4.4482216152605, "klbf": 4448.2216152605}),
    "N*m": ([1e6], {"ft·lbf": 1.3558179483314, "ft·klbf": 1355.8179483314}),
    "J": ([1e3], {"ft·lbf": 1.3558179483314, "ft·klbf": 1355.8179483314}),
    "W": ([], {"hp": 745.69987158227}),
    "Pa": ([1e7], {"psi": 6894.7572931684, "ksi": 6894757.2931684}),
    "kg": ([], {"lb": 0.45359237}),
    "m": ([0.3], {"in": 0.0254, "ft": 0.3048}),
    "m^2": ([0.1], {"in²": 6.4516e-4, "ft²": 0.09290304}),
    "m/s": ([], {"ft/min": 0.00508}),
    "rad/s": ([], {"rpm": math.pi / 30}),
}


@pytest.mark.parametrize(("system", "table"), [("si", NAMES), ("rig", RIG_NAMES)])
def test_unit_changes_with_the_magnitude(system, table):
    for si, (limits, names) in table.items():
        ends = [0.01 * (limits or [1e4])[0], *limits, 50 * (limits or [1e4])[-1]]
        for (name, factor), low, high in zip(
            names.items(), ends, ends[1:], strict=False
        ):
            for value in (1.001 * low, 0.999 * high):
                with sb.results.display_units(system):
                    read, _, shown = str(number(value, si, count=12)).partition(" ")
                assert shown == name
                assert float(read.replace("−", "-")) * factor == pytest.approx(
                    value, rel=1e-10
                )


@pytest.mark.parametrize(
    ("value", "si", "text"),
    [
        (0.0139, "s", "13.9 ms"), (3.5e-18, "s", "3.5·10⁻¹⁸ s"), (0.0, "N", "0 N"), (293.15, "K", "20 °C"),
        (math.pi / 4, "rad", "45°"), (1200.0, "kg*m^2", "1200 kg·m²"), (123456.7, "1", "123457"), (None, "N", "—"),
    ],
)  # fmt: skip
def test_numbers_for_reading(value, si, text):
    assert str(number(value, si)) == text


@pytest.mark.parametrize(
    ("x", "count", "text"),
    [
        (0.0001, 6, "0.0001"), (1e-5, 6, "10⁻⁵"), (-2.5e-7, 6, "−2.5·10⁻⁷"), (1e5, 2, "100000"), (12.0, 1, "10"),
        (9.99e6, 2, "10000000"), (1e7, 6, "10⁷"), (123456789.0, 6, "1.23457·10⁸"), (1 / 3, 3, "0.333"),
        (np.nan, 6, "—"), (-np.inf, 6, "−∞"),
    ],
)  # fmt: skip
def test_digits_and_powers_of_ten(x, count, text):
    assert digits(x, count) == text


def test_several_numbers_for_reading():
    for values, si, words in (
        ([], "N", "none"),
        ([0.2] * 8, "m", "8 × 0.2 m"),
        (
            [-1.0, 2e3, 3.0, 4.0, 5.0, 6.0],
            "N",
            "−0.001, 2, 0.003, 0.004, 0.005, 0.006 kN",
        ),
        (
            [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, -8e3]],
            "N",
            "8 values from −8 to 0.007 kN",
        ),
        ([293.15, 303.15], "K", "20, 30 °C"),
        ([1.0, np.inf], "m", "1, ∞ m"),
    ):
        assert str(numbers(values, si)) == words
    assert str(numbers([10.0, 20.0], "K", absolute=False)) == "10, 20 K"


# --- tables -------------------------------------------------------------------------


def test_table_in_all_its_forms():
    rows = [("007", 1e3, 5), {"name": "<b>", "n": np.nan}]
    table = Table(
        ["name", Column("n", "kg"), Column("id", hidden=True)], rows, "all & any"
    )
    assert (
        str(table)
        == repr(table)
        == "all & any\nname      n, kg\n007        1000\n<b>         nan"
    )
    assert table.markdown().splitlines()[2] == "| 007    |    1000 |"
    page = table._repr_html_()
    assert page.startswith("<p>all &amp; any</p><table>")
    assert "&lt;b&gt;" in page
    assert "id" not in page
    assert (table[0], table[1:].title, table["id"]) == (
        {"name": "007", "n": 1e3, "id": 5},
        "all & any",
        [5, None],
    )
    assert table.frame().attrs["n"] == {"unit": "kg", "meaning": ""}
    assert json.loads(json.dumps(table.as_list(), allow_nan=False))[1] == {
        "name": "<b>",
        "n": None,
        "id": None,
    }
    with pytest.raises(ValueError, match="a row of 1 values"):
        Table(["a", "b"], [(1,)])
    with pytest.raises(KeyError, match="there are: name, n"):
        table["weight"]


def test_everything_becomes_json():
    given = {
        1: (np.float64(2.0), np.bool_(True)),
        "x": [3.5, -np.inf],
        "y": np.eye(2),
        "z": {4},
    }
    assert plain(given) == {
        "1": [2.0, True],
        "x": [3.5, None],
        "y": [[1.0, 0.0], [0.0, 1.0]],
        "z": [4],
    }
