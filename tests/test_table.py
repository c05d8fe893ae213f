"""The table of everything with rows, and what is read as lines and tables."""

import dataclasses
import json

import numpy as np
import pytest

from simbrake._base._table import Column, Table, Tabular, plain

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
