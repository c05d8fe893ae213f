"""The table of everything with rows, and what is read as lines and tables."""

import dataclasses
import enum
import json
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np
import pytest

from simbrake._base._table import (
    Column,
    Table,
    Tabular,
    Unit,
    coloured,
    digits,
    joined,
    number,
    numbers,
    plain,
    rows_table,
    shown_in,
    spelled,
    to_si,
    unit,
    value_text,
)

MASSES = Table(
    [
        "part",
        Column("mass", "kg", show=".1f"),
        Column("T", "K", "at the end", shown_in="°C", show=lambda T: f"{T - 273.15:.0f}"),
    ],
    [("rim", 412.0, 373.15), {"part": "lining <1>", "mass": float("nan")}],
    "masses",
)


def test_text_has_headings_units_and_empty_cells():
    assert str(MASSES).splitlines() == [
        "masses",
        "part          mass, kg    T, °C",
        "rim              412.0      100",
        "lining <1>         nan",
    ]
    assert "lining &lt;1&gt;" in MASSES._repr_html_()
    assert str(Table(["a"], [])) == "a"


def test_rows_columns_frames_and_json():
    assert MASSES[0] == {"part": "rim", "mass": 412.0, "T": 373.15}
    assert MASSES["T"] == [373.15, None]
    assert json.loads(json.dumps(MASSES.as_list(), allow_nan=False))[1] == {
        "part": "lining <1>",
        "mass": None,
        "T": None,
    }
    frame = MASSES.frame()
    assert frame["mass"][0] == 412.0
    assert frame.attrs["T"] == {"unit": "K", "meaning": "at the end"}
    assert len(MASSES[1:]) == 1


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="a row of 1 values for 2 columns: a, b"):
        Table(["a", "b"], [(1,)])
    with pytest.raises(ValueError, match=r"no column \['c'\]; there are: a, b"):
        Table(["a", "b"], [{"c": 1}])
    with pytest.raises(KeyError, match="there are: part, mass, T"):
        MASSES["weight"]


def test_lines_and_tables_in_order():
    @dataclasses.dataclass(frozen=True)
    class Found(Tabular):
        values: np.ndarray
        greatest: float

        def parts(self):
            return ["two & two", Table(["n"], [(int(n),) for n in self.values])]

    found = Found(np.asarray([4, 5]), np.inf)
    assert str(found) == "two & two\nn\n4\n5"
    assert found.as_dict() == {"values": [4, 5], "greatest": None}
    assert "two &amp; two" in found._repr_html_()
    assert plain({1: (np.float64(2.0), np.bool_(True))}) == {"1": [2.0, True]}


POUND, G, FOOT = 0.45359237, 9.80665, 0.3048
#: number, its SI unit, and as it is read: both sides of every step to the next larger unit, and none of zero
SHOWN = [
    (999.0, "N", "999 N"), (1050.0, "N", "1.05 kN"), (1000.0, "N", "1 kN"), (-2e6, "N", "−2 MN"), (0.5, "N", "0.5 N"),
    (1e6, "N", "1 MN"), (999e3, "N", "999 kN"), (0.0, "N", "0 N"),
    (999.0, "N*m", "999 N·m"), (1050.0, "N*m", "1.05 kN·m"), (999e3, "N*m", "999 kN·m"), (1.05e6, "N*m", "1.05 MN·m"),
    (999.0, "N/m", "999 N/m"), (1050.0, "N/m", "1.05 kN/m"), (999e3, "N/m", "999 kN/m"), (1.05e6, "N/m", "1.05 MN/m"),
    (999.0, "J", "999 J"), (1050.0, "J", "1.05 kJ"), (9.99e6, "J", "9990 kJ"), (1.05e7, "J", "10.5 MJ"),
    (999.0, "W", "999 W"), (1050.0, "W", "1.05 kW"), (999e3, "W", "999 kW"), (1.05e6, "W", "1.05 MW"),
    (999.0, "Pa", "999 Pa"), (1050.0, "Pa", "1.05 kPa"), (99e3, "Pa", "99 kPa"), (1.05e5, "Pa", "0.105 MPa"),
    (999e6, "Pa", "999 MPa"), (1.05e9, "Pa", "1.05 GPa"), (9999.0, "kg", "9999 kg"), (10500.0, "kg", "10.5 t"),
    (0.105, "m", "0.105 m"), (0.099, "m", "99 mm"), (1.05e-4, "m", "0.105 mm"), (9.9e-5, "m", "99 µm"),
    (1.05e-7, "m", "0.105 µm"), (9.9e-8, "m", "9.9·10⁻⁸ m"), (0.0, "m", "0 m"),
    (0.0105, "m^2", "0.0105 m²"), (0.0099, "m^2", "99 cm²"), (1e-9, "m^2", "10⁻⁵ cm²"), (0.0, "m^2", "0 m²"),
    (0.105, "s", "0.105 s"), (0.099, "s", "99 ms"), (1.05e-4, "s", "0.105 ms"), (9.9e-5, "s", "99 µs"),
    (1.05e-7, "s", "0.105 µs"), (9.9e-8, "s", "9.9·10⁻⁸ s"),
    (2.05 * np.pi, "rad", "369°"), (6.6, "rad", "6.6 rad"), (0.0, "rad", "0 rad"), (293.15, "K", "20 °C"),
    (3.0, "kg*m^2", "3 kg·m²"), (3.0, "W/(m^2*K)", "3 W/(m²·K)"), (0.35, "1", "0.35"), (5.0, "SI", "5"),
    (None, "N", "—"), (np.inf, "N", "—"),
]  # fmt: skip
ON_A_RIG = [
    (1e3 * POUND * G * (1 + 1e-12), "N", "1 klbf"), (999 * POUND * G, "N", "999 lbf"), (0.0, "N", "0 lbf"),
    (0.99e6, "N*m", f"{0.99e6 / POUND / G / FOOT:.6g} ft·lbf"), (1e6, "N*m", f"{1e3 / POUND / G / FOOT:.6g} ft·klbf"),
    (999.0, "J", f"{999 / POUND / G / FOOT:.6g} ft·lbf"), (1e3, "J", f"{1 / POUND / G / FOOT:.6g} ft·klbf"),
    (55 * POUND * G * FOOT, "W", "0.1 hp"), (POUND / 4, "kg", "0.25 lb"), (0.0, "kg", "0 lb"),
    (0.99e6, "Pa", f"{0.99e6 * (FOOT / 12) ** 2 / POUND / G:.6g} psi"), (0.0, "Pa", "0 psi"),
    (1e6, "Pa", f"{1e3 * (FOOT / 12) ** 2 / POUND / G:.6g} ksi"),
    (0.3, "m", f"{0.3 / FOOT:.6g} ft"), (0.0254 / 4, "m", "0.25 in"), (0.0, "m", "0 in"),
    (0.1, "m^2", f"{0.1 / FOOT**2:.6g} ft²"), (FOOT**2 / 2, "m^2", f"{0.046451 * 12**2 / 0.092903:.3g} in²"),
    (FOOT / 120, "m/s", "0.5 ft/min"), (np.pi / 60, "rad/s", "0.5 rpm"), (0.0, "W", "0 hp"), (0.02, "s", "20 ms"),
]  # fmt: skip


def test_numbers_are_read_in_the_unit_of_their_magnitude():
    assert [str(number(*given)) for *given, _ in SHOWN] == [text for *_, text in SHOWN]
    with shown_in("rig"):
        assert [str(number(*given)) for *given, _ in ON_A_RIG] == [text for *_, text in ON_A_RIG]
    assert number(5.0, "N", beside=5e3) == ("0.005", "kN", "5.0", "N")
    assert number(1 / 3, "kg*m^2", count=3) == ("0.333", "kg·m²", "0.3333333333333333", "kg·m²")
    assert str(number(10.0, "K", absolute=False)) == "10 K"


@pytest.mark.parametrize(
    ("x", "count", "text"),
    [
        (0.0001, 6, "0.0001"), (1e-5, 6, "10⁻⁵"), (-1e-5, 6, "−10⁻⁵"), (-2.5e-7, 6, "−2.5·10⁻⁷"), (-3.5, 6, "−3.5"),
        (1234567.0, 6, "1234570"), (1e5, 2, "100000"), (12.0, 1, "10"), (9.99e6, 2, "10000000"), (1e7, 6, "10⁷"),
        (1.05e7, 6, "1.05·10⁷"), (123456789.0, 6, "1.23457·10⁸"), (1e10, 6, "10¹⁰"), (1 / 3, 3, "0.333"),
        (np.nan, 6, "—"), (np.inf, 6, "∞"), (-np.inf, 6, "−∞"),
    ],
)  # fmt: skip
def test_digits_and_powers_of_ten(x, count, text):
    assert digits(x, count) == text


def test_several_numbers_are_one_a_list_or_a_range():
    for values, unit_, words in (
        (3e3, "N", "3 kN"),
        ([], "N", "none"),
        ([3e3], "N", "3 kN"),
        ([0.2] * 2, "m", "2 × 0.2 m"),
        ([0.2] * 8, "m", "8 × 0.2 m"),
        ([-1.0, 2e3, 3.0, 4.0, 5.0, 6.0], "N", "−0.001, 2, 0.003, 0.004, 0.005, 0.006 kN"),
        ([[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, -8e3]], "N", "8 values from −8 to 0.007 kN"),
        ([293.15, 303.15], "K", "20, 30 °C"),
        (range(1, 8), "1", "7 values from 1 to 7"),
        (range(300, 310), "K", "10 values from 26.85 to 35.85 °C"),
        ([1e6, 1e6 + 1e-7], "N", "2 × 1 MN"),
        ([1.0, np.inf], "m", "1, ∞ m"),
    ):
        assert str(numbers(values, unit_)) == words
    assert str(numbers([10.0, 20.0], "K", absolute=False)) == "10, 20 K"
    assert str(numbers(10.0, "K", absolute=False)) == "10 K"
    assert numbers([1 / 3, 2.0], "kg*m^2", count=2) == ("0.33, 2", "kg·m²", "0.3333333333333333, 2.0", "kg·m²")
    assert numbers([1.0, 2.0, 3.0], most=2).text == "3 values from 1 to 3"
    assert numbers(range(100)).si == ", ".join(f"{i}.0" for i in range(100))
    assert numbers(range(101)).si == ""


def test_units_of_the_library_and_what_is_none():
    assert unit("", "m") == unit(" m ", "m") == unit("", "") == unit("1", "1") == Unit(1)
    assert unit("%", "") == unit("%", "1") == Unit(Fraction("0.01"))
    for text in ("kN·m", "kN⋅m", " kN * m"):
        assert unit(text, "N*m") == Unit(1000)
    assert unit("mm³", "m^3") == unit("mm**3", "m^3") == Unit(Fraction("1e-9"))
    assert unit("μm", "m") == unit("µm", "m") == Unit(Fraction("1e-6"))
    assert unit("km", "m") == Unit(1000)
    assert unit("celsius", "K") == Unit(1, Fraction("273.15"))
    assert unit("fahrenheit", "K") == Unit(Fraction(5, 9), Fraction("459.67") * 5 / 9)
    assert unit("cm**2", "m^2") == unit("cm²", "m^2") == Unit(Fraction("1e-4"))
    for text, si, words in (
        ("kg", "m", "known here: m, cm, mm, um, ft, in; kg is of another kind"),
        ("Hz", "rad/s", "known here: rad/s, rpm, 1/min, deg/s, rev/s; angles have their own unit"),
        ("rad", "1", "known here: 1, -, %; angles have their own unit"),
        ("x" * 5, "N*s/m", "known here: N*s/m, kN*s/m"),
        ("m" + "*m/m" * 10, "m", "known here: m, cm, mm, um, ft, in"),
        ("m^12", "m", "known here: m, cm, mm, um, ft, in"),
    ):
        with pytest.raises(ValueError, match="known") as told:
            unit(text, si)
        assert str(told.value) == words
    assert unit("mm" + "*m/m" * 9 + "*1", "m") == Unit(Fraction("1e-3"))  # 40 characters: one more is too many
    known = {text: spelled(text) for text in ("kN", " mm ", "K", "kg*m^2", "12", "1", "", "°C", "Kelvin")}
    assert [text for text, there in known.items() if there] == ["kN", " mm ", "K", "", "°C"]


def test_numbers_come_to_si_as_they_are_written():
    assert to_si(95.0, unit("%", "1")) == 0.95
    assert to_si(0.1, unit("min", "s")) == 6.0
    assert to_si(-40.0, unit("degC", "K")) == 233.15
    assert [to_si(x, Unit(1000)) for x in (1e308, -1e308, np.inf)] == [np.inf, -np.inf, np.inf]
    assert np.isnan(to_si(np.nan, Unit(1000)))


def test_headings_and_cells():
    titles = {
        Column("peak_force", "N"): "peak force, N",
        Column("x", "1"): "x",
        Column("x", "kg*m^2", heading=""): "kg·m²",
        Column("x", heading="only"): "only",
        Column("x", "K", heading="T", shown_in="°C"): "T, °C",
        Column("x", "K", shown_in=""): "x",
    }
    assert {column: column.title for column in titles} == titles
    plain_column, shown = Column("x", show=".2f"), (None, True, np.False_, 3, np.int64(4), 2.0, np.float32(0.5), "rim")
    assert [plain_column.text(x) for x in shown] == ["", "yes", "no", "3", "4", "2.00", "0.50", "rim"]
    assert Column("x", show=lambda x: f"<{x}>").text(None) == ""


def test_a_table_in_text_html_markdown_and_frames_without_hidden_columns():
    table = Table(["name", Column("n", "kg"), Column("id", hidden=True)], [("007", 1e3, 5), ("b", 2.5, 6)], "all & any")
    assert str(table) == repr(table) == "all & any\nname      n, kg\n007        1000\nb           2.5"
    assert table.markdown().splitlines() == [
        "| name   |   n, kg |",
        "|--------|---------|",
        "| 007    |    1000 |",
        "| b      |     2.5 |",
    ]
    page = table._repr_html_()
    assert page.startswith("<p>all &amp; any</p><table>")
    assert "id" not in page
    assert Table(["a"], [])._repr_html_().startswith("<table>")
    assert list(table) == table.as_list() == [{"name": "007", "n": 1e3, "id": 5}, {"name": "b", "n": 2.5, "id": 6}]
    assert (table[-1], table[1:].title) == ({"name": "b", "n": 2.5, "id": 6}, "all & any")
    assert list(table[:1]) == [table[0]]
    assert table.frame().attrs["n"] == {"unit": "kg", "meaning": ""}
    assert list(table.frame()["id"]) == [5, 6]
    assert str(rows_table([("mass", "3 kg", "of the rim")], "Rim")).splitlines()[1:] == [
        "name    value    meaning",
        "mass    3 kg     of the rim",
    ]


def test_everything_becomes_json():
    class Kind(enum.Enum):
        BAND = ("band", 1.5)

    class Row(NamedTuple):
        x: float
        y: np.ndarray

    @dataclasses.dataclass
    class Both:
        kind: Kind
        row: Row

    assert plain(Both(Kind.BAND, Row(np.nan, np.eye(2)))) == {
        "kind": ["band", 1.5],
        "row": {"x": None, "y": [[1.0, 0.0], [0.0, 1.0]]},
    }
    assert plain((1, (2, "a"), [3.5, -np.inf], {4}, frozenset())) == [1, [2, "a"], [3.5, None], [4], []]
    assert plain(MASSES[:1]) == [{"part": "rim", "mass": 412.0, "T": 373.15}]
    assert (plain(True), plain(np.int32(3)), plain({})) == (True, 3, {})


def test_values_of_parts_in_words():
    for value, unit_, words in (
        ([1.0, 2.0], "N", "[1, 2] N"),
        ([0.2] * 3, "m", "3 × 0.2 m"),
        ([[0.2]], "m", "0.2 m"),
        (np.inf, "m", "inf"),
        ([np.nan], "m", "nan"),
        (300.0, "K", "26.85 °C"),
        ("a name", "", "'a name'"),
        (jax.ShapeDtypeStruct((2, 3), np.int32), "m", "i32[2,3]"),
        (Column.text, "", "Column.text"),
        (int, "", "<class 'int'>"),
        ("x" * 58, "", f"'{'x' * 58}'"),
        ("x" * 59, "", f"'{'x' * 56}…"),
    ):
        assert value_text(value, unit_) == words
    assert value_text(300.0, "K", absolute=False) == "300 K"
    assert value_text([300.0, 400.0], "K", absolute=False) == "[300, 400] K"
    assert joined("F", ["a" * 47, "b" * 48]) == f"F({'a' * 47}, {'b' * 48})"
    assert joined("F", ["a" * 47, "b" * 49]) == f"F(\n  {'a' * 47},\n  {'b' * 49},\n)"
    assert joined("", ["x(\n  1,\n)", "2"], "[]") == "[\n  x(\n    1,\n  ),\n  2,\n]"


def test_banners_and_empty_lines_of_notebooks():
    class Found(Tabular):
        def parts(self):
            return ["", Table(["n"], [(1,)])]

    assert Found()._repr_html_().startswith("<div>&nbsp;</div><table>")
    for colour, ink in {"red": "#b3261e", "amber": "#8a5a00", "green": "#1a7440"}.items():
        assert f"solid {ink};" in coloured("a < b", colour)
        assert coloured("a < b", colour).endswith(">a &lt; b</div>")
