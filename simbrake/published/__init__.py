"""The papers' tables, recomputed cell by cell, and their figures that a formula gives, as numbers.

Z1…Z6 are tables 1–6 of Zhuravlov et al., *Dynamics of friction couples of a band-shoe brake*; V1, V2 tables 1, 2 of
Volchenko et al., *Thermal transmission through metal friction elements*; S1 table 1 of Skrypnyk, *Assessment of energy
loading of friction units*. The printed values and the known misprints with their reasons lie beside this file.

The figures themselves are not in the sources that simbrake was made from, so no point could be read off them. Their
formulas are checked against the printed tables instead, which hold the same formulas at single points.
"""

import csv
import functools
import math
from importlib import resources
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._table import Column, Table
from .._parts._scene import Duty, Initial, Scene
from ..brakes._band import sliding_tensions
from ..brakes._design import Band, Bandage, Brake, Pulley, uniform_linings
from ..formulas.heating import (
    fourier_parameter,
    maximum_temperatures,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
    transmission_table,
)
from ..friction import ConstantFriction
from ..layouts._equal_layout import InfeasibleLayout, chord_equal_load_angles, equal_increment_angles
from ..loads import TorqueLoad
from ..profiles import Constant, PiecewiseLinear
from ..thermal._builders import axial_resistance, radial_resistance
from ..thermal._heat import FlashTemperature
from ..thermal._material import effusivity_share, material

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


class Cell(NamedTuple):
    """One printed number beside the computed one; `row` counts the data rows of the table from 0."""

    table: str
    row: int
    column: str
    printed: float
    computed: float
    verdict: str
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        """`{table, row, column, printed, computed, verdict}`."""
        return {name: getattr(self, name) for name in self._fields[:-1]}


def _rows(name: str) -> list[dict[str, str]]:
    file = resources.files(__name__) / name
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


def _transmissions() -> list[Cell]:
    """V2: heat transmission to both sides of the friction surface, and the shares of the heat."""
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
    columns = [
        *("table", Column("row"), "column", Column("printed", show="g"), Column("computed", show=".5g")),
        *(Column("difference", show=".2g"), "verdict"),
    ]
    lines = [(*c[:5], c.computed - c.printed, f"{c.verdict} ({c.reason})" if c.reason else c.verdict) for c in rows]
    counts = []
    for table in dict.fromkeys(c.table for c in rows):
        of = [c.verdict for c in rows if c.table == table]
        told = ", ".join(f"{of.count(v)} {v}" for v in (AGREES, MISPRINT, DISAGREES) if v in of)
        counts.append(f"{table}: {len(of)} cells, {told}")
    return "\n".join([str(Table(columns, lines)), "", *counts])


# --- figures ----------------------------------------------------------------------------------------------------------


class ChordCurves(NamedTuple):
    """Z, Fig. 4: chord angles (m, k) of equal loads over the last angle (m,), both in rad, and where they end."""

    f: float
    last: Float[np.ndarray, " m"]
    angle: Float[np.ndarray, "m k"]
    why_it_ends: str


def chord_curves(f: float, k: int = 7, step: float = math.radians(0.1)) -> ChordCurves:
    """Z-11 with `β_{k−1} = β_k`, from one `step` (rad) up to 90° or to where no such layout exists."""
    found, last, why = [], np.arange(step, 0.5 * math.pi, step), ""
    for beta in last:
        try:
            found.append(chord_equal_load_angles(f, k, float(beta), float(beta)))
        except InfeasibleLayout as error:
            why = str(error)
            break
    return ChordCurves(f, last[: len(found)], np.asarray(found), why)


class BandDiagram(NamedTuple):
    """Z, Fig. 5: central angles (n,) in rad, tension (n + 1,) and normal load (n,) of one layout over `T_0`."""

    name: str
    angle: Float[np.ndarray, " n"]
    tension: Float[np.ndarray, " n_1"]
    normal: Float[np.ndarray, " n"]
    w_0: float  # λ/(Π − 1): at this and smaller ones all linings come to slide


#: numbers of Z, Fig. 5
Z5_LININGS, Z5_WRAP, Z5_FRICTION, Z5_LAMBDA, Z5_W_0 = 10, math.radians(270.0), 0.3, 5.08, 1.5


def band_diagrams() -> tuple[BandDiagram, BandDiagram]:
    """Tension and load along the band in full slip, equal tension increments beside uniform pitch.

    With the figure's `λ` and `w_0` the tension would grow to `1 + λ/w_0 = 4.39 T_0` before the pulley rests; both
    layouts hold less, so that all ten linings slide and the maximum tension is `Π T_0` (Z-14).
    """
    layouts = {
        "equal tension increments": equal_increment_angles(Z5_FRICTION, Z5_LININGS, Z5_LININGS, Z5_WRAP).angle,
        "uniform pitch": np.full(Z5_LININGS, Z5_WRAP / Z5_LININGS),
    }
    found = []
    for name, beta in layouts.items():
        forces = sliding_tensions(jnp.asarray(1.0), jnp.full(Z5_LININGS, Z5_FRICTION), jnp.asarray(beta))
        tension = np.append(1.0, np.asarray(forces.tension))
        found.append(BandDiagram(name, beta, tension, np.asarray(forces.normal), Z5_LAMBDA / float(tension[-1] - 1)))
    return found[0], found[1]


class EnergyLevels(NamedTuple):
    """S, Fig. 1: levels over the time (m,), relative (a stop) or in s (a drag); temperatures are rises (K)."""

    time: Float[np.ndarray, " m"]
    power: Float[np.ndarray, " m"]  # over the mean power
    work: Float[np.ndarray, " m"]  # over the whole work
    bulk: Float[np.ndarray, " m"]
    surface: Float[np.ndarray, " m"]
    maximum: Float[np.ndarray, " m"]  # by S-26


#: what the two panels of S, Fig. 1 are drawn for; the rim is V's, the rest assumed: f_0, V_0 (m/s), p_c (Pa), A_c (m²)
S1_PAIR = {"f_0": 0.35, "V_0": 14.2, "p_c": 0.25e6, "A_c": 1.22}
S1_STOP, S1_DRAG, S1_RIM, S1_TRACK = 1.0, 60.0, 0.025, 1.63  # s, s, m, m²
_DRAG_POWER = 0.1  # of the power of the stop at first
_SPOT, _HARDNESS = 50e-6, 300e6  # m, Pa


def energy_levels(points: int = 201) -> tuple[EnergyLevels, EnergyLevels]:
    """A stop over the relative time, and a drag over time (S, Fig. 1, in our reading).

        P_0 = f_0 p_c A_c V_0;   stop: N/N_m = 2 (1 − s), W/W_T = 2 s − s², s = τ/τ_T;   drag: both even

    Bulk by energy over the depth of step 1, surface by the falling flux (stop) or the slab (drag), the maximum by S-26.
    """
    steel, s = material("steel_20L"), np.linspace(0.0, 1.0, points)
    share = float(effusivity_share(steel, material("FK-24A")))
    first = S1_PAIR["f_0"] * S1_PAIR["p_c"] * S1_PAIR["A_c"] * S1_PAIR["V_0"]
    q, a, heat = share * first / S1_TRACK, float(steel.diffusivity), float(steel.density * steel.specific_heat)
    law = FlashTemperature(_SPOT, float(steel.conductivity), a, share, _HARDNESS)

    def flash(speed: np.ndarray) -> np.ndarray:
        spots = S1_PAIR["f_0"] * _HARDNESS * speed
        return np.asarray(law.rise(jnp.asarray(spots), jnp.asarray(speed)))

    relative = 2 * s - s**2
    depth = min(float(penetration_depth(a, S1_STOP)), S1_RIM)
    mass, work = S1_TRACK * depth * float(steel.density), first * S1_STOP / 2
    # S-25 is the mean over the braking, 2/3 of the rise at its end
    rise = 1.5 * float(mean_bulk_rise(share, work, float(steel.specific_heat), mass))
    surface = np.asarray(stopping_rise(q, s * S1_STOP, S1_STOP, float(steel.effusivity)))
    top = maximum_temperatures(0.0, surface, flash(S1_PAIR["V_0"] * (1 - s))).surface_and_third_flash
    stop = EnergyLevels(s, 2 * (1 - s), relative, rise * relative, surface, np.asarray(top))
    t, drag_q = s * S1_DRAG, _DRAG_POWER * q
    surface = np.asarray(slab_rise(drag_q, t, S1_RIM, steel))
    top = maximum_temperatures(0.0, surface, flash(np.full(points, _DRAG_POWER * S1_PAIR["V_0"])))
    bulk = drag_q * t / (S1_RIM * heat)
    return stop, EnergyLevels(t, np.ones(points), s, bulk, surface, np.asarray(top.surface_and_third_flash))


def overlap_stop(external: float, internal: float) -> Scene:
    """A stop of a staged brake with these coefficients of friction, for K, Fig. 5; the numbers are assumed."""
    brake = Brake(
        Pulley(0.590, 1200.0, width=0.220),
        Band(0.638),
        uniform_linings(20, math.radians(270.0), ConstantFriction(external)),
        Bandage(22.0, ConstantFriction(internal), 4e3),
    )
    duty = Duty(PiecewiseLinear([0.0, 2.0], [0.5e3, 20e3]), TorqueLoad(Constant(8e3)))
    return Scene(brake, duty, Initial(24.0), 8.0)
