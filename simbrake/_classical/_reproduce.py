"""The published tables, recomputed cell by cell.

Z1…Z6 are tables 1–6 of Zhuravlov et al., *Dynamics of friction couples of a band-shoe brake*; V1, V2 tables 1, 2 of
Volchenko et al., *Thermal transmission through metal friction elements*; S1 table 1 of Skrypnyk, *Assessment of energy
loading of friction units*. The printed values and the known misprints with their reasons lie in `published/`.
"""

import csv
import dataclasses
import functools
import math
from importlib import resources
from typing import Any

import numpy as np

from .._parts._layout import chord_equal_load_angles, equal_increment_angles
from ..thermal._builders import axial_resistance, radial_resistance
from ..thermal._heat import TransmissionPartition
from ._thermal_estimates import fourier_parameter

AGREES, MISPRINT, DISAGREES = "agrees", "known misprint", "disagrees"
_LAMBDA = 5.0  # λ = C R/T_0 of Z5 and Z6
_FRICTION = {"Z5": 0.5, "Z6": 0.3}
_LININGS, _WRAP = 10, math.radians(270.0)
#: table → its file in `published/`
FILES = {f"Z{i}": f"table{i}.csv" for i in range(1, 7)} | {
    "V1": "thermal_resistance.csv",
    "V2": "heat_transmission.csv",
    "S1": "fourier_b.csv",
}


@dataclasses.dataclass(frozen=True)
class Cell:
    """One printed number beside the computed one; `row` counts the data rows of the table from 0."""

    table: str
    row: int
    column: str
    printed: float
    computed: float
    verdict: str
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        names = ("table", "row", "column", "printed", "computed", "verdict")
        return {name: getattr(self, name) for name in names}


def _rows(name: str) -> list[dict[str, str]]:
    file = resources.files("simbrake") / "published" / name
    return list(csv.DictReader(file.read_text("utf-8").splitlines()))


def published_rows(table: str) -> list[dict[str, str]]:
    """Rows of a table (`"Z1"` … `"S1"`) as printed, words as they are: every column, those that are given included."""
    return _rows(FILES[table])


@functools.cache
def _misprints() -> dict[tuple[str, int, str], str]:
    return {(m["table"], int(m["row"]), m["column"]): m["reason"] for m in _rows("misprints.csv")}


def agrees(printed: str, computed: float) -> bool:
    """Within 1.5 units of the last printed place (integers: 1 unit) or 0.5 %."""
    value = float(printed)
    places = len(printed.partition(".")[2])
    unit = 10.0**-places * (1.5 if places else 1.0)
    difference = abs(value - computed)
    return bool(difference <= unit * (1 + 1e-9) or difference <= 0.005 * abs(value))


def _cell(table: str, row: int, column: str, printed: str, computed: float) -> Cell:
    reason = ""
    exact = column == "k"  # a count is not rounded
    if float(printed) == computed if exact else agrees(printed, computed):
        verdict = AGREES
    else:
        reason = _misprints().get((table, row, column), "")
        verdict = MISPRINT if reason else DISAGREES
    return Cell(table, row, column, float(printed), float(computed), verdict, reason)


def _chord(f: float, beta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tensions `T_1…T_k` and loads `N_1…N_k` of the chord model for `T_0 = 1`, `β_0 = 0` (Z-1…Z-4)."""
    half = np.append(0.0, beta) / 2
    c, s = np.cos(half), np.sin(half)
    tension = np.append(1.0, np.cumprod((c[:-1] + f * s[:-1]) / (c[1:] - f * s[1:])))
    return tension, tension[1:] * s[1:] + tension[:-1] * s[:-1]


def _chord_tables() -> list[Cell]:
    """Z1, Z2: k = 7 point linings under equal load, β_6 = β_7 = 20°. Z3, Z4: equal chords of the same ratio γ."""
    from scipy.optimize import brentq

    cells: list[Cell] = []
    twenty = math.radians(20.0)
    tables = {name: published_rows(name) for name in ("Z1", "Z2", "Z3", "Z4")}
    for row, printed in enumerate(tables["Z1"]):
        f = float(printed["f"])
        beta = chord_equal_load_angles(f, 7, twenty, twenty)
        tension, normal = _chord(f, beta)
        gamma = float(tension[-1])
        equal: Any = brentq(lambda b, f=f, g=gamma: _chord(f, np.full(7, b))[0][-1] - g, 1e-3, 2 * math.atan(0.9 / f))
        tension_equal, normal_equal = _chord(f, np.full(7, equal))
        degrees = np.degrees(beta)
        computed = {
            "Z1": {f"beta{i + 1}_deg": degrees[i] for i in range(5)}
            | {"alpha_deg": float(np.sum(degrees[:6])), "gamma": gamma},
            "Z2": {f"T{i}": tension[i] for i in range(8)} | {"N1": normal[0], "N": normal[1]},
            "Z3": {f"T{i}": tension_equal[i] for i in range(8)}
            | {"beta_deg": math.degrees(equal), "alpha_deg": 6 * math.degrees(equal)},
            "Z4": {f"N{i + 1}": normal_equal[i] for i in range(7)},
        }
        for table, values in computed.items():
            line = tables[table][row]
            cells += [_cell(table, row, column, line[column], value) for column, value in {"f": f, **values}.items()]
    return cells


def _dynamic_tables() -> list[Cell]:
    """Z5, Z6: n = 10 linings over 270°, λ = 5; k of them slide."""
    cells: list[Cell] = []
    for table, f in _FRICTION.items():
        for row, printed in enumerate(published_rows(table)):
            k = int(printed["k"])
            if printed["scheme"] == "variable":
                k = min(k, 9)  # the rows headed k = 10 hold the numbers of k = 9
                beta = equal_increment_angles(f, _LININGS, k, _WRAP).angle
            else:
                beta = np.full(_LININGS, _WRAP / _LININGS)
            fz = f * np.tan(beta / 2)
            Pi = np.cumprod((1 + fz) / (1 - fz))
            ratio = float(Pi[k - 1])
            tension = np.append(1.0, np.minimum(Pi, ratio))
            w_0 = _LAMBDA / (ratio - 1)
            values = {
                "k": float(k),
                "w0": w_0,
                **{f"beta{i + 1}_deg": math.degrees(beta[i]) for i in range(_LININGS)},
                "tau_m": _LAMBDA + math.pi / (2 * w_0),
                "T_max": ratio,
                "N_max": float(np.max((tension[1:] + tension[:-1]) * np.sin(beta / 2))),
            }
            cells += [_cell(table, row, column, printed[column], value) for column, value in values.items()]
            consistent = 1 / _LAMBDA + math.pi / (2 * w_0)
            why = "printed as λ + π/(2 w_0); the equations of motion give 1/λ + π/(2 w_0)"
            cells.append(Cell(table, row, "tau_m_consistent", float(printed["tau_m"]), consistent, MISPRINT, why))
    return cells


def _resistances() -> list[Cell]:
    """V1: resistances of the pulley's parts, and their reciprocals (of the rounded resistance, as printed)."""
    cells: list[Cell] = []
    total: dict[str, float] = {}
    for row, printed in enumerate(published_rows("V1")):
        conductivity = float(printed["lambda_W_mK"])
        if printed["element"] == "total":
            resistance = total[printed["lambda_W_mK"]]
        else:
            r, R, L = (float(printed[column]) for column in ("r_m", "R_m", "L_m"))
            along = printed["direction"] == "axial"
            resistance = float((axial_resistance if along else radial_resistance)(L, conductivity, r, R))
            total[printed["lambda_W_mK"]] = total.get(printed["lambda_W_mK"], 0.0) + resistance
        cells.append(_cell("V1", row, "resistance", printed["resistance"], resistance))
        cells.append(_cell("V1", row, "K", printed["K"], 1 / float(printed["resistance"])))
    return cells


def transmission_table() -> TransmissionPartition:
    """V2's coefficients and surface layers over the temperature of the polished rim surface."""
    rows = published_rows("V2")
    columns = {name: np.asarray([float(row[name]) for row in rows]) for name in ("alpha1", "alpha2", "alpha3")}
    T = np.asarray([float(row["T_polished_C"]) + 273.15 for row in rows])
    layer = np.asarray([1e-6 * float(row["delta_s_um"]) for row in rows])
    return TransmissionPartition(T, columns["alpha1"], columns["alpha2"], columns["alpha3"], layer)


def _transmissions() -> list[Cell]:
    """V2: heat transmission to both sides of the friction surface, and the shares of the heat."""
    import jax.numpy as jnp

    cells: list[Cell] = []
    rows, law = published_rows("V2"), transmission_table()
    K_1, K_2 = (np.asarray(K) for K in law.transmissions(jnp.asarray(law.temperature)))
    for row, printed in enumerate(rows):
        share = K_1[row] / (K_1[row] + K_2[row])
        values = {
            "K1": K_1[row],
            "K2": K_2[row],
            "R1": 1 / K_1[row],
            "R2": 1 / K_2[row],
            "share_metal": share,
            "share_lining": 1 - share,
        }
        cells += [_cell("V2", row, column, printed[column], float(value)) for column, value in values.items()]
    return cells


def _fourier() -> list[Cell]:
    """S1: `B = a/δ²` in 1/s, of the rim times 1000 (`Fo = 10⁻³ B τ` there)."""
    diffusivity = {"steel": 1.14e-5, "cast_iron": 1.04e-5}
    cells: list[Cell] = []
    for row, printed in enumerate(published_rows("S1")):
        B = fourier_parameter(diffusivity[printed["material"]], 1e-3 * float(printed["delta_mm"]))
        cells.append(_cell("S1", row, "B", printed["B"], 1000 * B if printed["part"] == "rim" else B))
    return cells


def cells() -> list[Cell]:
    """Every numeric cell of every table, in order."""
    return _chord_tables() + _dynamic_tables() + _resistances() + _transmissions() + _fourier()


def report(rows: list[Cell]) -> str:
    """The comparison as text: every cell, then the count of verdicts per table."""
    lines = [f"{'table':6}{'row':>4}  {'column':18}{'printed':>10}{'computed':>12}{'difference':>12}  verdict"]
    for c in rows:
        reason = f" ({c.reason})" if c.reason else ""
        lines.append(
            f"{c.table:6}{c.row:>4}  {c.column:18}{c.printed:>10g}{c.computed:>12.5g}{c.computed - c.printed:>12.2g}"
            f"  {c.verdict}{reason}"
        )
    lines.append("")
    for table in dict.fromkeys(c.table for c in rows):
        of = [c.verdict for c in rows if c.table == table]
        counts = ", ".join(f"{of.count(v)} {v}" for v in (AGREES, MISPRINT, DISAGREES) if v in of)
        lines.append(f"{table}: {len(of)} cells, {counts}")
    return "\n".join(lines)
