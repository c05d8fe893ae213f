"""The papers' tables, recomputed cell by cell, and their figures that a formula gives,
as numbers.

Z1…Z6 are tables 1–6 of Zhuravlov et al., *Dynamics of friction couples of a band-shoe
brake*; V1, V2 tables 1, 2 of Volchenko et al., *Thermal transmission through metal
friction elements*; S1 table 1 of Skrypnyk, *Assessment of energy loading of friction
units*. The printed values and the known misprints with their reasons are beside this
file.

The figures themselves are not in the available sources, so no point could be read off
them. Their formulas are checked against the printed tables instead, which give the same
formulas at single points.
"""

import csv
import functools
import math
import pathlib
from collections.abc import Iterable
from importlib import resources
from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from tabulate import tabulate

import simbrake as sb
from simbrake.design.formulas import (
    fourier_parameter,
    maximum_temperatures,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
    transmission_table,
)
from simbrake.design.layouts import (
    InfeasibleLayout,
    chord_equal_load_angles,
    equal_increment_angles,
)
from simbrake.thermal import (
    FlashTemperature,
    axial_resistance,
    effusivity_share,
    radial_resistance,
)

AGREES = "agrees"
MISPRINT = "known misprint"
DISAGREES = "disagrees"
#: what a cell says of the formulas: it is compared with them, went into them, or cannot
#: differ
COMPARED = "compared"
GIVEN = "given"
TRIVIAL = "trivial"
#: columns of inputs, printed with the results, and of numbers that follow from a
#: printed one beside them
_KINDS = {
    "f": GIVEN,
    "k": GIVEN,
    "T0": TRIVIAL,
    "K": TRIVIAL,
    "tau_m_consistent": TRIVIAL,
}
_CONSISTENT = "printed as λ + π/(2 w_0); the equations of motion give 1/λ + π/(2 w_0)"
#: table → its file, beside this one or among the data of `simbrake.design.formulas`
FILES = {f"Z{i}": f"table{i}.csv" for i in range(1, 7)} | {
    "V1": "thermal_resistance.csv",
    "V2": "heat_transmission.csv",
    "S1": "fourier_b.csv",
}


class Cell(NamedTuple):
    """One printed number beside the computed one; `row` counts the data rows of the
    table from 0.

    `kind`: `compared`, or one that must agree: `given` (the friction and the number of
    sliding linings of a row go into its formulas), `trivial` (`T_0` in parts of itself,
    a reciprocal of the number beside it, a second look at one).
    """

    table: str
    row: int
    column: str
    printed: float
    computed: float
    verdict: str
    reason: str = ""

    @property
    def kind(self) -> str:
        wrong = self.verdict != AGREES and self.column != "tau_m_consistent"
        return COMPARED if wrong else _KINDS.get(self.column, COMPARED)

    def as_dict(self) -> dict[str, str | int | float]:
        """`{table, row, column, printed, computed, verdict, kind}`."""
        return {name: getattr(self, name) for name in (*self._fields[:-1], "kind")}


#: a row as printed, and the numbers computed for one
Printed: TypeAlias = dict[str, str]
Computed: TypeAlias = dict[str, float]


def _rows(name: str) -> list[Printed]:
    file = pathlib.Path(__file__).with_name(name)
    file = file if file.exists() else resources.files("simbrake.design.formulas") / name
    return list(csv.DictReader(file.read_text("utf-8").splitlines()))


def published_rows(table: str) -> list[Printed]:
    """Rows of a table (`"Z1"` … `"S1"`) as printed, words unchanged: every column,
    inputs included."""
    return _rows(FILES[table])


@functools.cache
def _misprints() -> dict[tuple[str, int, str], str]:
    return {
        (m["table"], int(m["row"]), m["column"]): m["reason"]
        for m in _rows("misprints.csv")
    }


def allowed(printed: str) -> float:
    """The difference within which a number agrees: 1.5 units of its last place or 0.5
    %; whole numbers: half a unit."""
    places = len(printed.partition(".")[2])
    return max(1.5 * 10.0**-places, 0.005 * abs(float(printed))) if places else 0.5


def agrees(printed: str, computed: float) -> bool:
    """Whether a number agrees with a printed one (see `allowed`)."""
    return bool(abs(float(printed) - computed) <= allowed(printed) * (1 + 1e-9))


def _cell(table: str, row: int, column: str, printed: str, computed: float) -> Cell:
    # a count is not rounded
    if float(printed) == computed if column == "k" else agrees(printed, computed):
        return Cell(table, row, column, float(printed), float(computed), AGREES)
    reason = (
        _CONSISTENT
        if column == "tau_m_consistent"
        else _misprints().get((table, row, column), "")
    )
    return Cell(
        table,
        row,
        column,
        float(printed),
        float(computed),
        MISPRINT if reason else DISAGREES,
        reason,
    )


def _numbered(name: str, values: Iterable[float], first: int = 1) -> Computed:
    return {name.format(i): float(value) for i, value in enumerate(values, start=first)}


@functools.cache
def _chords(f: float) -> dict[str, Computed]:
    """Z1, Z2: k = 7 point linings under equal load, β_6 = β_7 = 20°. Z3, Z4: equal
    chords of the same ratio γ."""
    from scipy.optimize import brentq

    def forces(
        beta: Float[np.ndarray, "7"],
    ) -> tuple[Float[np.ndarray, "8"], Float[np.ndarray, "7"]]:
        """Tensions `T_0…T_7` and loads of the chord model for `T_0 = 1`, `β_0 = 0`
        (Z-1…Z-4)."""
        half = np.append(0.0, beta) / 2
        c = np.cos(half)
        s = np.sin(half)
        tension = np.append(
            1.0, np.cumprod((c[:-1] + f * s[:-1]) / (c[1:] - f * s[1:]))
        )
        return tension, tension[1:] * s[1:] + tension[:-1] * s[:-1]

    beta = chord_equal_load_angles(f, 7, math.radians(20.0), math.radians(20.0))
    tension, normal = forces(beta)
    high = 2 * math.atan(0.9 / f)
    equal = float(
        brentq(lambda b: forces(np.full(7, b))[0][-1] - tension[-1], 1e-3, high)
    )  # pyright: ignore
    tension_equal, normal_equal = forces(np.full(7, equal))
    degrees = np.degrees(beta)
    of_z1 = {"alpha_deg": float(np.sum(degrees[:6])), "gamma": float(tension[-1])}
    of_z3 = {"beta_deg": math.degrees(equal), "alpha_deg": 6 * math.degrees(equal)}
    found = {
        "Z1": _numbered("beta{}_deg", degrees[:5]) | of_z1,
        "Z2": _numbered("T{}", tension, 0)
        | {"N1": float(normal[0]), "N": float(normal[1])},
        "Z3": _numbered("T{}", tension_equal, 0) | of_z3,
        "Z4": _numbered("N{}", normal_equal),
    }
    return {table: {"f": f, **values} for table, values in found.items()}


class BandDiagram(NamedTuple):
    """Central angles (n,) in rad, tension (n + 1,) and normal load (n,) over `T_0`."""

    name: str
    angle: Float[np.ndarray, " n"]
    tension: Float[np.ndarray, " n_1"]
    normal: Float[np.ndarray, " n"]
    w_0: float  # λ/(Π − 1): at this and smaller ones all linings slide in the end


def _diagram(
    name: str, f: float, beta: Float[np.ndarray, " n"], k: int, lam: float
) -> BandDiagram:
    """The band with the first `k` linings sliding and the others without load; `lam`:
    `λ = C R/T_0`."""
    fz = f * np.tan(beta / 2)
    Pi = np.cumprod((1 + fz) / (1 - fz))
    tension = np.append(1.0, np.minimum(Pi, Pi[k - 1]))
    normal = (tension[1:] + tension[:-1]) * np.sin(beta / 2)
    return BandDiagram(name, beta, tension, normal, float(lam / (tension[-1] - 1)))


#: friction of Z's dynamic tables, and their `λ = C R/T_0`
FRICTION = {"Z5": 0.5, "Z6": 0.3}
LAMBDA = 5.0


def stopped_band(table: str, printed: Printed) -> BandDiagram:
    """A row of Z5 or Z6 at rest: n = 10 linings over 270°, k of them slide."""
    f = FRICTION[table]
    n = 10
    wrap = math.radians(270.0)
    k = int(printed["k"])
    if printed["scheme"] == "variable":
        k = min(k, 9)  # the rows headed k = 10 hold the numbers of k = 9
        return _diagram(
            "variable", f, equal_increment_angles(f, n, k, wrap).angle, k, LAMBDA
        )
    return _diagram("uniform", f, np.full(n, wrap / n), k, LAMBDA)


def _stop(table: str, printed: Printed) -> Computed:
    band = stopped_band(table, printed)
    return {
        "k": float(np.count_nonzero(np.diff(band.tension))),
        "w0": band.w_0,
        **_numbered("beta{}_deg", np.degrees(band.angle)),
        "tau_m": LAMBDA + math.pi / (2 * band.w_0),
        "T_max": float(band.tension[-1]),
        "N_max": float(np.max(band.normal)),
        "tau_m_consistent": 1 / LAMBDA + math.pi / (2 * band.w_0),
    }


def _resistances(rows: list[Printed]) -> list[Computed]:
    """V1: resistances of the pulley's parts, and their reciprocals (of the rounded
    resistance, as printed)."""
    found: list[Computed] = []
    total: dict[float, float] = {}
    for printed in rows:
        conductivity = float(printed["lambda_W_mK"])
        if printed["element"] == "total":
            resistance = total[conductivity]
        else:
            r, R, L = (float(printed[column]) for column in ("r_m", "R_m", "L_m"))
            ring = (
                axial_resistance
                if printed["direction"] == "axial"
                else radial_resistance
            )
            resistance = float(ring(L, conductivity, r, R))
            total[conductivity] = total.get(conductivity, 0.0) + resistance
        found.append({"resistance": resistance, "K": 1 / float(printed["resistance"])})
    return found


def _transmissions(rows: list[Printed]) -> list[Computed]:
    """V2: heat transmission to both sides of the friction surface, and the shares of
    the heat."""
    law = transmission_table()
    K_1, K_2 = (np.asarray(K) for K in law.transmissions(jnp.asarray(law.temperature)))
    share = K_1 / (K_1 + K_2)
    columns = {
        "K1": K_1,
        "K2": K_2,
        "R1": 1 / K_1,
        "R2": 1 / K_2,
        "share_metal": share,
        "share_lining": 1 - share,
    }
    return [
        {name: float(column[row]) for name, column in columns.items()}
        for row in range(len(rows))
    ]


def _fourier(rows: list[Printed]) -> list[Computed]:
    """S1: `B = a/δ²` in 1/s, of the rim times 1000 (`Fo = 10⁻³ B τ` there)."""
    diffusivity = {"steel": 1.14e-5, "cast_iron": 1.04e-5}
    scale = {"rim": 1000.0}

    def found(row: Printed) -> Computed:
        B = float(
            fourier_parameter(
                diffusivity[row["material"]], 1e-3 * float(row["delta_mm"])
            )
        )
        return {"B": scale.get(row["part"], 1.0) * B}

    return [found(row) for row in rows]


def _computed(table: str, rows: list[Printed]) -> list[Computed]:
    """The numbers of every row of a table."""
    whole = {"V1": _resistances, "V2": _transmissions, "S1": _fourier}
    if table in whole:
        return whole[table](rows)
    return [
        _stop(table, row) if table in FRICTION else _chords(float(row["f"]))[table]
        for row in rows
    ]


def cells() -> list[Cell]:
    """Every numeric cell of every table, in order."""
    tables = {table: published_rows(table) for table in FILES}
    return [
        _cell(table, row, column, printed[column.removesuffix("_consistent")], value)
        for table, rows in tables.items()
        for row, (printed, values) in enumerate(
            zip(rows, _computed(table, rows), strict=True)
        )
        for column, value in values.items()
    ]


def counted(rows: list[Cell]) -> str:
    """Counts in words: cells by kind, of those compared by verdict."""
    kinds = [c.kind for c in rows]
    of = [c.verdict for c in rows if c.kind == COMPARED]
    words = {AGREES: "agree", MISPRINT: "are known misprints", DISAGREES: "disagree"}
    told = ", ".join(
        f"{of.count(verdict)} {word}"
        for verdict, word in words.items()
        if verdict in of
    )
    rest = [f"{kinds.count(kind)} {kind}" for kind in (GIVEN, TRIVIAL) if kind in kinds]
    return "; ".join([f"{len(rows)} cells, {len(of)} compared: {told}", *rest])


def report(rows: list[Cell]) -> str:
    """The comparison as text: every cell, then the counts per table and of all."""

    def shown(c: Cell) -> str:
        said = c.verdict if c.kind == COMPARED else c.kind
        return f"{said} ({c.reason})" if c.reason else said

    heads = ("table", "row", "column", "printed", "computed", "difference", "verdict")
    lines = [
        (
            *c[:3],
            f"{c.printed:g}",
            f"{c.computed:.5g}",
            f"{c.computed - c.printed:.2g}",
            shown(c),
        )
        for c in rows
    ]
    aligned = ("left", "right", "left", "right", "right", "right", "left")
    text = tabulate(lines, heads, "plain", disable_numparse=True, colalign=aligned)
    counts = [
        f"{table}: {counted([c for c in rows if c.table == table])}"
        for table in dict.fromkeys(c.table for c in rows)
    ]
    counts.append(f"all: {counted(rows)}")
    return "\n".join([text, "", *counts])


# --- figures ------------------------------------------------------------------------


class ChordCurves(NamedTuple):
    """Z, Fig. 4: chord angles (m, k) of equal loads over the last angle (m,), both in
    rad, and where they end."""

    f: float
    last: Float[np.ndarray, " m"]
    angle: Float[np.ndarray, "m k"]
    why_it_ends: str


def chord_curves(f: float, k: int = 7, step: float = math.radians(0.1)) -> ChordCurves:
    """Z-11 with `β_{k−1} = β_k`, from one `step` (rad) up to 90° or to where no such
    layout exists."""
    found = []
    last = np.arange(step, 0.5 * math.pi, step)
    why = ""
    for beta in last:
        try:
            found.append(chord_equal_load_angles(f, k, float(beta), float(beta)))
        except InfeasibleLayout as error:
            why = str(error)
            break
    return ChordCurves(f, last[: len(found)], np.asarray(found), why)


#: numbers of Z, Fig. 5
Z5_LININGS = 10
Z5_WRAP = math.radians(270.0)
Z5_FRICTION = 0.3
Z5_LAMBDA = 5.08
Z5_W_0 = 1.5


def band_diagrams() -> tuple[BandDiagram, BandDiagram]:
    """Tension and load along the band in full slip, equal tension increments beside
    uniform pitch.

    With the figure's `λ` and `w_0` the tension would grow to `1 + λ/w_0 = 4.39 T_0`
    before the pulley rests; both layouts hold less, so that all ten linings slide and
    the maximum tension is `Π T_0` (Z-14).
    """
    n = Z5_LININGS
    increments = equal_increment_angles(
        Z5_FRICTION, Z5_LININGS, Z5_LININGS, Z5_WRAP
    ).angle
    return (
        _diagram("equal tension increments", Z5_FRICTION, increments, n, Z5_LAMBDA),
        _diagram("uniform pitch", Z5_FRICTION, np.full(n, Z5_WRAP / n), n, Z5_LAMBDA),
    )


class EnergyLevels(NamedTuple):
    """S, Fig. 1: levels over the time (m,), relative (a stop) or in s (a drag);
    temperatures are rises (K)."""

    time: Float[np.ndarray, " m"]
    power: Float[np.ndarray, " m"]  # over the mean power
    work: Float[np.ndarray, " m"]  # over the whole work
    bulk: Float[np.ndarray, " m"]
    surface: Float[np.ndarray, " m"]
    maximum: Float[np.ndarray, " m"]  # by S-26


#: parameters of the two panels of S, Fig. 1; the rim is V's, the rest assumed: f_0, V_0
#: (m/s), p_c (Pa), A_c (m²)
S1_PAIR = {"f_0": 0.35, "V_0": 14.2, "p_c": 0.25e6, "A_c": 1.22}
# s, s, m, m²
S1_STOP = 1.0
S1_DRAG = 60.0
S1_RIM = 0.025
S1_TRACK = 1.63
_DRAG_POWER = 0.1  # of the initial power of the stop
# m, Pa
_SPOT = 50e-6
_HARDNESS = 300e6


def energy_levels(points: int = 201) -> tuple[EnergyLevels, EnergyLevels]:
    """A stop over the relative time, and a drag over time (S, Fig. 1, in our reading).

        P_0 = f_0 p_c A_c V_0;   stop: N/N_m = 2 (1 − s), W/W_T = 2 s − s², s = τ/τ_T;
        drag: both even

    Bulk by energy over the depth of step 1, surface by the falling flux (stop) or the
    slab (drag), the maximum by S-26.
    """
    steel = sb.material("steel_20L")
    s = np.linspace(0.0, 1.0, points)
    share = float(effusivity_share(steel, sb.material("FK-24A")))
    first = S1_PAIR["f_0"] * S1_PAIR["p_c"] * S1_PAIR["A_c"] * S1_PAIR["V_0"]
    q = share * first / S1_TRACK
    a = float(steel.diffusivity)
    heat = float(steel.density * steel.specific_heat)
    law = FlashTemperature(_SPOT, float(steel.conductivity), a, share, _HARDNESS)

    def flash(speed: np.ndarray) -> np.ndarray:
        spots = S1_PAIR["f_0"] * _HARDNESS * speed
        return np.asarray(law.rise(jnp.asarray(spots), jnp.asarray(speed)))

    relative = 2 * s - s**2
    depth = min(float(penetration_depth(a, S1_STOP)), S1_RIM)
    mass = S1_TRACK * depth * float(steel.density)
    work = first * S1_STOP / 2
    # S-25 is the mean over the brake application, 2/3 of the rise at its end
    rise = 1.5 * float(mean_bulk_rise(share, work, float(steel.specific_heat), mass))
    surface = np.asarray(
        stopping_rise(q, s * S1_STOP, S1_STOP, float(steel.effusivity))
    )
    top = maximum_temperatures(
        0.0, surface, flash(S1_PAIR["V_0"] * (1 - s))
    ).surface_and_third_flash
    stop = EnergyLevels(
        s, 2 * (1 - s), relative, rise * relative, surface, np.asarray(top)
    )
    t = s * S1_DRAG
    drag_q = _DRAG_POWER * q
    surface = np.asarray(slab_rise(drag_q, t, S1_RIM, steel))
    top = maximum_temperatures(
        0.0, surface, flash(np.full(points, _DRAG_POWER * S1_PAIR["V_0"]))
    )
    bulk = drag_q * t / (S1_RIM * heat)
    return stop, EnergyLevels(
        t, np.ones(points), s, bulk, surface, np.asarray(top.surface_and_third_flash)
    )


def overlap_stop(external: float, internal: float) -> sb.Scene:
    """A stop of a staged brake with these coefficients of friction, for K, Fig. 5; the
    numbers are assumed."""
    brake = sb.Brake(
        sb.Pulley(0.590, 1200.0, width=0.220),
        sb.Band(0.638),
        sb.uniform_linings(20, math.radians(270.0), sb.ConstantFriction(external)),
        sb.Bandage(22.0, sb.ConstantFriction(internal), 4e3),
    )
    duty = sb.Duty(
        sb.PiecewiseLinear([0.0, 2.0], [0.5e3, 20e3]), sb.TorqueLoad(sb.Constant(8e3))
    )
    return sb.Scene(brake, duty, sb.Initial(24.0), 8.0)
