"""Validation of layouts by their defining property, of wear laws, and of linings worn before a run.

A layout is checked by the statics of every lining, written here once more; wear by quadrature over the stop.
"""

import functools
import itertools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import (
    FORM,
    Case,
    Reader,
    Row,
    Slope,
    cases_of,
    cases_of_run,
    cases_with_slopes,
    differentiated,
)
from scipy.integrate import quad
from scipy.linalg import expm
from stop_scenes import closed_form, stop_scene

from simbrake import (
    Band,
    Brake,
    Constant,
    ConstantFriction,
    Duty,
    Heat,
    Initial,
    Lining,
    PiecewiseLinear,
    Pulley,
    Scene,
    TorqueLoad,
    Wear,
    equal_layout,
    least_tension,
    lumped_heat,
    with_values,
)
from simbrake.brakes import LiningsOnPlates, sliding_tensions
from simbrake.layouts import InfeasibleLayout, chord_equal_load_angles, equal_increment_angles, equal_load_angles
from simbrake.loads import Phase, Phases
from simbrake.thermal import ROOM, Conductance, ConstantPartition, FrictionHeat, Lump, TransmissionPartition
from simbrake.wear import (
    AbstractWearRate,
    ArrheniusWear,
    ConstantWear,
    ExponentialWear,
    LinearWear,
    Temperature,
    ThresholdWear,
    turned_scene,
)

# --- layouts ----------------------------------------------------------------------------------------------------------


def _followed(f: Any, beta: Any, T_0: float = 1.0) -> tuple[Any, Any]:
    """Tensions `T_0…T_n` and loads along sliding linings, one after the other."""
    T, N = [T_0], []
    for f_i, b in zip(np.broadcast_to(f, np.shape(beta)), np.asarray(beta), strict=True):
        c, s = math.cos(b / 2), math.sin(b / 2)
        # (T − T_before) c = f N, N = (T + T_before) s
        T.append(T[-1] * (c + f_i * s) / (c - f_i * s))
        N.append((T[-1] + T[-2]) * s)
    return np.asarray(T), np.asarray(N)


def _uneven(x: Any) -> float:
    """By how much the entries differ, over their mean."""
    return float(np.ptp(x) / np.mean(x))


def layout_cases() -> list[Case]:
    """Equal increments with unequal friction, equal loads, equal pressures, chords of equal load; infeasible ones."""
    f, area, wrap = np.array([0.30, 0.42, 0.35, 0.28, 0.33, 0.40]), np.linspace(0.02, 0.035, 6), math.radians(260.0)

    def infeasible(of: Callable[[], Any]) -> float:
        try:
            of()
        except InfeasibleLayout:
            return 1.0
        return 0.0

    def run() -> dict[str, Any]:
        chords = chord_equal_load_angles(0.3, 7, math.radians(14.0), math.radians(17.0))
        return {
            "increments": equal_increment_angles(f, 6, 4, wrap),
            "loads": equal_load_angles(f, 6, wrap),
            "pressures": equal_load_angles(f, 6, wrap, area=area),
            "chords": chords,
        }

    def increments(found: dict[str, Any]) -> float:
        return _uneven(np.diff(_followed(f, found["increments"].angle)[0])[:4])

    def chord_loads(found: dict[str, Any]) -> float:
        # T_i c_i − T_(i−1) c_(i−1) = f N_i, N_i = T_i s_i + T_(i−1) s_(i−1); the chord before the first has β_0 = 0
        half = np.append(0.0, found["chords"]) / 2
        c, s, T, N = np.cos(half), np.sin(half), 1.0, []
        for i in range(1, 8):
            after = T * (c[i - 1] + 0.3 * s[i - 1]) / (c[i] - 0.3 * s[i])
            N.append(after * s[i] + T * s[i - 1])
            T = after
        return _uneven(N[1:])

    at_limit = functools.partial(_followed, f)
    statics = "T_i along the band, lining by lining: equal"
    rows: list[Row] = [
        ("increments of the first 4", f"{statics} T_i − T_(i−1)", 0.0, increments),
        ("wrap of the increments", f"{FORM}Σ β", wrap, lambda x: np.sum(x["increments"].angle)),
        ("others like lining 4", f"{FORM}β_5 = β_6 = β_4", 0.0, lambda x: _uneven(x["increments"].angle[3:])),
        (
            "tension ratio",
            "T_i along the band: T_4/T_0 over that stated",
            1.0,
            lambda x: at_limit(x["increments"].angle)[0][4] / x["increments"].ratio,
        ),
        ("loads", f"{statics} N_i", 0.0, lambda x: _uneven(at_limit(x["loads"].angle)[1])),
        ("wrap of the loads", f"{FORM}Σ β", wrap, lambda x: np.sum(x["loads"].angle)),
        (
            "tension ratio of the loads",
            "T_i along the band: T_n/T_0 over that stated",
            1.0,
            lambda x: at_limit(x["loads"].angle)[0][-1] / x["loads"].ratio,
        ),
        ("pressures", f"{statics} N_i/A_i", 0.0, lambda x: _uneven(at_limit(x["pressures"].angle)[1] / area)),
        ("loads of chords", f"{statics} N_2 = … = N_k [Z-11]", 0.0, chord_loads),
        (
            "f = 0.5, β_7 = 20° [Z]",
            "1 − f z_1 < 0: infeasible",
            1.0,
            lambda _: infeasible(lambda: chord_equal_load_angles(0.5, 7, math.radians(20.0), math.radians(20.0))),
        ),
        (
            "increments of 3 at f = 0.6",
            "f z_1 ≥ 1: infeasible",
            1.0,
            lambda _: infeasible(lambda: equal_increment_angles(0.6, 3, 3, wrap)),
        ),
    ]
    return cases_of("layouts", run, 1e-10, rows)


def search_cases() -> list[Case]:
    """Angles and areas searched for equal increments and pressures."""
    f, area = np.array([0.30, 0.38, 0.35, 0.33]), np.full(4, 0.03)
    stop = stop_scene(n=4, beta=50.0, C=None, law=ConstantFriction(f))

    def run() -> Any:
        scene = with_values(stop, {"brake.linings.area": area})
        return equal_layout(scene, ("tension_increment", "pressure"), free="both", start="given")

    along = functools.partial(_followed, f)
    rows: list[Row] = [
        ("increments", "T_i along the band: equal T_i − T_(i−1)", 0.0, lambda x: _uneven(np.diff(along(x.angle)[0]))),
        ("pressures", "T_i along the band: equal N_i/A_i", 0.0, lambda x: _uneven(along(x.angle)[1] / x.area)),
        ("wrap", f"{FORM}Σ β", math.radians(200.0), lambda x: np.sum(x.angle), 1e-12),
        ("area", f"{FORM}Σ A", 0.12, lambda x: np.sum(x.area), 1e-12),
    ]
    return cases_of("layout by search", run, 1e-8, rows)


def least_tension_cases() -> list[Case]:
    """The smallest maximum tension `T_0 Π` that stops in time: most friction, and most of the wrap on few linings.

    `T_0 (Π − 1) = J ω_0/(R t)`, so that `T_max = J ω_0/(R t) Π/(Π − 1)` falls with `Π`, which is convex in the angles.
    """
    R, J, w0, longest, low, high = 0.725, 800.0, 20.0, 4.0, math.radians(20.0), math.radians(60.0)
    angle, most = np.radians([50.0, 36.0, 44.0, 30.0, 40.0]), 0.3
    # three angles at their bounds, one between: it takes what is left of the wrap
    best = [high, high, angle.sum() - 2 * (high + low), low, low]

    def least(t: complex, f: complex = most) -> complex:
        ratio = math.prod((1 + f * math.tan(b / 2)) / (1 - f * math.tan(b / 2)) for b in best)
        return J * w0 / (R * t) * ratio / (ratio - 1)

    def run() -> Any:
        scene = with_values(stop_scene(n=5, f=0.2, C=None, end=6.0), {"brake.linings.angle": angle})
        bounds = {
            "duty.slack_tension.level": (1e3, 4e4),
            "brake.linings.friction.coefficient": (0.1, most),
            "brake.linings.angle": (low, high),
        }
        return least_tension(scene, longest, bounds, limits={"max_normal_load": 1e6})

    source = f"{FORM}J ω_0/(R t) Π/(Π − 1)"
    by_friction = differentiated(lambda f: least(longest, f), most)
    rows: list[Row] = [
        ("maximum tension", source, least(longest).real, "value"),
        ("angles", f"{FORM}at their bounds, one takes the rest", 0.0, lambda x: np.max(np.abs(_angles(x) - best))),
        ("∂/∂t", f"{source}, differentiated", differentiated(least, longest), "limits.0.sensitivity", 1e-6),
        ("∂/∂f", f"{source}, differentiated", by_friction, lambda x: _bound(x, "friction.coefficient"), 1e-6),
        ("∂/∂N of a limit that is not reached", f"{FORM}0", 0.0, "limits.1.sensitivity", 0.0),
        ("stationarity", f"{FORM}∇T = Σ λ ∇(limits)", 0.0, "stationarity", 1e-6),
    ]
    return cases_of("least tension", run, 1e-8, rows)


def _angles(found: Any) -> Any:
    return np.sort(np.asarray(found.scene.brake.linings.angle))[::-1]


def _bound(found: Any, name: str) -> float:
    (row,) = (row for row in found.variables if row.path.endswith(name))
    return row.sensitivity


# --- wear -------------------------------------------------------------------------------------------------------------

_N, _BETA, _R, _J, _T0, _W0, _F, _AREA = 4, 50.0, 0.725, 800.0, 8e3, 20.0, 0.35, 0.03
#: gas constant (J/(mol·K)), CODATA 2018
_GAS = 8.31446261815324


class Separately(AbstractWearRate):
    """A wear law for each lining."""

    laws: tuple[AbstractWearRate, ...]

    def at(self, T: Temperature) -> jax.Array:
        if T is None:
            return jnp.stack([law.at(None) for law in self.laws])
        each = jnp.broadcast_to(T, (len(self.laws),))
        return jnp.stack([law.at(each[i]) for i, law in enumerate(self.laws)])


def _pressures(T_0: float = _T0) -> Any:
    return _followed(_F, np.full(_N, math.radians(_BETA)), T_0)[1] / _AREA


def _worn_stop(rate: AbstractWearRate, heat: Heat | None, lever: PiecewiseLinear | None = None, **wear: Any) -> Scene:
    """A stop of four linings of 50° that wear."""
    scene = with_values(stop_scene(n=_N, beta=_BETA, C=None, lever=lever), {"brake.linings.area": _AREA})
    return Scene(scene.brake, scene.duty, scene.initial, 8.0, heat, wear=Wear(rate, **wear))


def wear_law_cases() -> list[Case]:
    """Four laws of the wear rate over the temperature, one per lining, in a stop that heats an insulated rim."""
    k, E, above, capacity = 3e-14, 2.5e4, ROOM + 60.0, 800.0
    M = _R * _T0 * (closed_form(n=_N, beta=_BETA)["Pi"] - 1)
    way, p = _J * _W0**2 / (2 * M), _pressures()
    laws: tuple[tuple[str, Callable[..., float], float, str], ...] = (
        ("Arrhenius", lambda T, E=E: math.exp(E / _GAS * (1 / ROOM - 1 / T)), E, "energy"),
        ("threshold", lambda T, E=E: math.exp(E / _GAS * max(0.0, 1 / above - 1 / T)), E, "energy"),
        ("exponential", lambda T, rise=70.0: math.exp((T - ROOM) / rise), 70.0, "rise"),
        ("linear", lambda T, s=-0.02: max(0.0, 1 + s * (T - ROOM)), -0.02, "slope"),
    )
    corner = {"threshold": 60.0 * capacity / M, "linear": 50.0 * capacity / M}

    def worn(i: int, *number: float) -> float:
        """`k p_i ∫ I(T) R dφ`, `T = T_0 + M φ/C`."""
        name, law, *_ = laws[i]
        cuts = [0.0, *([corner[name]] if name in corner and not number else []), way]
        parts = itertools.pairwise(cuts)
        values = [
            quad(lambda x: law(ROOM + M * x / capacity, *number), *ends, epsrel=1e-13, epsabs=0.0, limit=400)
            for ends in parts
        ]
        return k * p[i] * _R * sum(value[0] for value in values)

    def slope(i: int) -> float:
        """Derivative by the number of a law, by sixth-order differences."""
        x, h = laws[i][2], 1e-3 * laws[i][2]
        pairs = ((1, 45), (2, -9), (3, 1))
        return sum(c * (worn(i, x + m * h) - worn(i, x - m * h)) for m, c in pairs) / (60 * h)

    source = "quadrature: k p_i ∫ I(T) R dφ, T = T_0 + M φ/C"
    # (no step ends at a corner of a law)
    tolerance = {"threshold": 1e-9, "linear": 1e-7}
    rows: list[Row] = [
        (name, source, worn(i), f"worn_thickness.{i}", tolerance.get(name, 1e-10)) for i, (name, *_) in enumerate(laws)
    ]
    rows += [
        (
            f"∂({laws[i][0]})/∂{symbol}",
            f"{source}, differentiated",
            slope(i),
            Slope(f"wear.rate.laws.{i}.{laws[i][3]}", i),
            1e-8,
        )
        for i, symbol in ((0, "E"), (2, "ΔT"))
    ]
    each = Separately(
        (
            ArrheniusWear(k, E),
            ThresholdWear(k, above, E),
            ExponentialWear(k, 70.0),
            LinearWear(k, -0.02),
        )
    )
    heat = lumped_heat(rim=capacity, partition=ConstantPartition(1.0), rim_cooling=0.0)
    return cases_with_slopes("wear laws", _worn_stop(each, heat), rows, lambda result: result.worn_thickness)


def turned_cases() -> list[Case]:
    """A stop, then a pull too weak to hold, the band turned end for end in between; an uneven band that is turned."""
    k, load, slides, weak = 4e-14, 2e3, 3.0, 500.0
    gain = _R * (closed_form(n=_N, beta=_BETA)["Pi"] - 1)
    way = _R * _J * _W0**2 / 2 / (gain * _T0 - load)

    def worn(lining: int, slides: complex = slides) -> complex:
        again = _R * (load - gain * weak) / _J * slides**2 / 2
        return k * (_pressures()[lining] * way + _pressures(weak)[_N - 1 - lining] * again)

    phases = Phases((Phase(Constant(_T0), "rest"), Phase(Constant(weak), f"{slides} s")))
    scene = _worn_stop(ConstantWear(k), None, turned_after=[1.0])
    duty = Duty(phases, TorqueLoad(Constant(load)))
    scene = Scene(scene.brake, duty, scene.initial, 30.0, wear=scene.wear)
    source = f"{FORM}k (p_i s_1 + p_(n+1−i) s_2)"
    rows: list[Row] = [(f"lining {i + 1}", source, worn(i).real, f"worn_thickness.{i}") for i in (0, 1, 3)]
    until = "duty.slack_tension.phases.1.until.duration"
    truth = differentiated(functools.partial(worn, 0), slides)
    rows.append(("∂(lining 1)/∂t_2", f"{source}, differentiated", truth, Slope(until), 1e-9))
    return cases_with_slopes("turned band", scene, rows, lambda result: result.worn_thickness[0]) + _reversed_cases()


def _reversed_cases() -> list[Case]:
    f, angle, gap = np.array([0.30, 0.42, 0.35]), np.radians([28.0, 51.0, 36.0]), np.radians([3.0, 9.0])
    worn = np.array([1e-3, 2e-3, 4e-3])
    band = Band(0.623, LiningsOnPlates(2.1e11, 13e-4, 0.3, 0.5, gap))
    brake = Brake(Pulley(0.59, 1200.0), band, Lining(ConstantFriction(f), angle, 0.03))
    wear = Wear(ConstantWear(k := 3e-14 * np.array([1.0, 2.0, 3.0])), worn=worn)
    scene = Scene(brake, stop_scene().duty, Initial(20.0), 1.0, wear=wear)

    # Δl/S_C of the band that begins with the lining that was the last
    S, stretch = 1.0, 0.3
    for i in (2, 1, 0):
        stretch += 0.623 * S * math.expm1(f[i] * angle[i]) / f[i]
        S *= math.exp(f[i] * angle[i])
        stretch += 0.623 * S * gap[i - 1] if i else 0.5 * S
    rows: list[Row] = [
        (
            "tension 1",
            "T_i along the band from its other end",
            float(_followed(f[::-1], angle[::-1], _T0)[0][1]),
            lambda x: sliding_tensions(
                jnp.asarray(_T0), x.brake.linings.friction.coefficient, x.brake.linings.angle
            ).tension[0],
        ),
        (
            "stiffness",
            f"{FORM}S_H/Δl, arcs, gaps and ends from the other end",
            S * 2.1e11 * 13e-4 / stretch,
            lambda x: x.brake.band.stiffness.stiffness(
                x.brake.linings.friction.coefficient, x.brake.linings.angle, x.brake.band.radius
            ),
        ),
        ("worn before", "of lining 3 at the place of lining 1", worn[2], "wear.worn.0"),
        ("wear rate", "of lining 3 at the place of lining 1", k[2], "wear.rate.coefficient.0"),
    ]
    return cases_of("turned band", lambda: turned_scene(scene), 1e-12, rows)


def worn_cases() -> list[Case]:
    """A stop of linings worn unequally before it: radius, slack to be taken up, share and flow of heat.

    Linings that are one lump have lost their mean, those of one lump each what each has lost.
    """
    worn, angle = np.array([1e-3, 2e-3, 4e-3, 7e-3]), np.radians([40.0, 52.0, 45.0, 61.0])
    whole, speed, C, G, end = 0.030, 0.1, (2e4, 900.0, 3e3), 60.0, 4.0
    mean, late = float(angle @ worn) / angle.sum(), float(angle @ worn) / speed
    along = _followed(_F, angle, _T0)[0]
    torque = (_R - mean) * (along[-1] - _T0)
    time = _J * _W0 / torque
    # of the metal: α_1 and the rim, α_2; of the lining: α_2, layer, lining, band, α_3
    into = 1 / (1 / 40.0 + 0.028 / 48.85 + 1 / 25.0)
    out = 1 / (1 / 25.0 + 2e-5 / 1.02 + (whole - mean) / 0.736 + 0.006 / 53.94 + 1 / 15.0)
    share = into / (into + out)

    def rises(left: Any, torques: Any) -> list[float]:
        """Of lumps that have these shares of their thickness, at the end: `y' = A y + (p − q t) b` in the stop."""
        n = len(left)
        g, c_l = G / left, C[1] * left
        A = np.zeros((n + 3, n + 3))
        A[:n, :n], A[:n, n], A[n, :n], A[n, n] = np.diag(-g / c_l), g / c_l, g / C[2], -g.sum() / C[2]
        A[:n, n + 1] = _W0 * (1 - share) * torques / c_l
        A[n + 1, n + 2] = -1 / time  # power over that at the start
        heated = expm(A * time) @ np.append(np.zeros(n + 1), [1.0, 1.0])
        heated[n + 1 :] = 0.0
        return (expm(A * (end - late - time)) @ heated)[:n].tolist()

    def scene(count: int) -> Scene:
        table = ([300.0, 900.0], [40.0, 40.0], [25.0, 25.0], [15.0, 15.0], [2e-5, 2e-5])
        heat = Heat(
            (Lump("rim", C[0]), Lump("linings", C[1], count=count), Lump("band", C[2])),
            (Conductance("linings", "band", G),),
            FrictionHeat("rim", "linings", TransmissionPartition(*table)),
            (),
            None,
            "rim",
            "linings",
            "band",
        )
        effects: dict[str, Any] = {"thickness": whole, "geometry": True, "heat": True, "take_up_speed": speed}
        # (before its first point a lever stays as it is)
        scene = _worn_stop(ConstantWear(1e-14), None, lever=PiecewiseLinear([0.0, 0.0], [0.0, _T0]))
        wear = Wear(ConstantWear(1e-14), worn=worn, **effects)
        scene = Scene(scene.brake, scene.duty, scene.initial, end, heat, wear=wear)
        return with_values(scene, {"brake.linings.angle": angle})

    def rise(node: int) -> Reader:
        return lambda result: result.end_temperatures[node] - ROOM

    source = f"{FORM}R' = R − h̄, delay h̄ Σβ/u, h̄ = Σ β_i h_i/Σ β"
    in_rim = share * _J * _W0**2 / 2 / C[0]
    (lump,) = rises(np.array([1 - mean / whole]), np.array([torque]))
    each = rises(1 - worn / whole, (_R - mean) * np.diff(along))
    rows: list[Row] = [
        ("stopping time", f"{source}, + J ω_0/M", late + time, "stopping_time"),
        ("rise of the rim", f"{FORM}a J ω_0²/2C, δ' = δ − h̄ in a", in_rim, rise(0), 1e-9),
        ("rise of the linings", f"{FORM}exp(A t), C' = C s, G' = G/s, s = 1 − h̄/δ", lump, rise(1), 1e-9),
    ]
    own = f"{FORM}exp(A t), C' = C s_i, G' = G/s_i, s_i = 1 − h_i/δ"
    apart: list[Row] = [(f"rise of lining {i + 1}", own, each[i], rise(1 + i), 1e-9) for i in (0, 3)]
    return [*cases_of_run("worn linings", scene(1), rows), *cases_of_run("worn linings", scene(4), apart)]


CASES = (
    layout_cases,
    search_cases,
    least_tension_cases,
    wear_law_cases,
    turned_cases,
    worn_cases,
)
