"""Units and numbers as they are read and printed everywhere, and the table that every
result with rows is."""

import json
import math
import re
from fractions import Fraction

import numpy as np
import pint
import pytest
from helpers import input_error

import simbrake as sb
from simbrake._base._numbers import digits, number
from simbrake._base._table import Column, Table
from simbrake._base._units import Unit, to_si, unit

POUND = 0.45359237
G = 9.80665


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


@pytest.mark.parametrize(
    ("value", "si", "text", "in_rig"),
    [
        (0.0139, "s", "13.9 ms", "13.9 ms"),
        (3.5e-18, "s", "3.5·10⁻¹⁸ s", "3.5·10⁻¹⁸ s"),
        (0.0, "N", "0 N", "0 lbf"),
        (999.0, "N", "999 N", "225 lbf"),
        (44482.216, "N", "44.5 kN", "10 klbf"),
        (2e7, "J", "20 MJ", "14800 ft·klbf"),
        (74569.987, "W", "74.6 kW", "100 hp"),
        (6894757.3, "Pa", "6.89 MPa", "1000 psi"),
        (0.0254, "m", "25.4 mm", "1 in"),
        (3.048, "m", "3.05 m", "10 ft"),
        (453.59237, "kg", "454 kg", "1000 lb"),
        (45e3, "kg", "45 t", "99200 lb"),
        (293.15, "K", "20 °C", "68 °F"),
        (math.pi / 4, "rad", "45°", "45°"),
        (math.pi, "rad/s", "3.14 rad/s", "30 rpm"),
        (None, "N", "—", "—"),
    ],
)
def test_numbers_for_reading(value, si, text, in_rig):
    assert str(number(value, si, count=3)) == text
    with sb.results.display_units("rig"):
        assert str(number(value, si, count=3)) == in_rig


def test_unknown_units_for_reading():
    with input_error(match="there are: si, rig"), sb.results.display_units("imperial"):
        pass


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
    assert json.loads(json.dumps(table.as_list(), allow_nan=False))[1]["n"] is None
    with pytest.raises(ValueError, match="a row of 1 values"):
        Table(["a", "b"], [(1,)])
    with pytest.raises(KeyError, match="there are: name, n"):
        table["weight"]
