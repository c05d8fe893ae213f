"""Validation of the heat of a jump: a rim that fades the friction as it heats, walls and worn linings that conduct."""

import dataclasses
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from case_tools import AIR, EXPLICIT, FORM, Case, Reader, Row, Slope, cases_with_slopes, differentiated
from cases_thermal import _F, _J, _N, _R, _W0, _mu
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.optimize import brentq
from stop_scenes import stop_scene

from simbrake import ConstantFriction, Heat, LinearFade, Material, Result, Wear, with_values
from simbrake.friction import ProductFriction, TabulatedFade
from simbrake.thermal import ConstantPartition, EffusivityPartition, FrictionHeat, Lump, Wall
from simbrake.wear import ConstantWear

# rim (J/K), stiffness of the band, lever and static ratio; share of the heat that the rim takes, √(λρc) on either side
_RIM, _C, _TENSION, _RATIO = 3e3, 2e4, 4e3, 1.2
_METAL, _LINING = (48.0, 7800.0, 480.0), (0.8, 2000.0, 1100.0)
_SLOPE, _ABOVE, _FLOOR, _BLEND = 4e-3, 310.0, 0.9, 8.0
_TABLE = [280.0, 320.0, 400.0], [1.0, 0.97, 0.8]
#: temperatures at which a derivative of the friction jumps, of whatever order
_CORNERS = 302.0, 318.0, 320.0, 327.0, 343.0
_LAW = "brake.linings.friction"


def _rounded(x: Any, w: float) -> Any:
    """`max(x, 0)`, its corner rounded over `±w` by the polynomial of the manual."""
    u = (x + w) / (2 * w)
    return np.where(x <= -w, 0.0, np.where(x >= w, x, w * u**5 * (14 - 28 * u + 20 * u**2 - 5 * u**3)))


def _fading(T: Any) -> Any:
    """Coefficient of friction at a temperature: fade above a limit down to a floor, times a table."""
    lost = _SLOPE * _rounded(T - _ABOVE, _BLEND)
    linear = _FLOOR + _rounded(1 - lost - _FLOOR, _SLOPE * _BLEND)
    return _F * linear * PchipInterpolator(*_TABLE)(T)


def _outcome(result: Result) -> Any:
    return jnp.stack([result.stopping_time, result.end_temperatures[0]])


def jump_cases() -> list[Case]:
    """An elastic band that breaks away from static friction and then fades as it heats the rim.

    All mechanical energy becomes heat, that of the jump of the tension too:
    `C_r ΔT/a = J (ω_0² − ω²)/2 − (T_n(T) − T_0)²/2C` from the moment on at which the band slides.
    """
    share = 1 / (1 + math.sqrt(math.prod(_LINING) / math.prod(_METAL)))

    def excess(T: Any) -> Any:
        return _TENSION * (_mu(_fading(T)) ** _N - 1)

    def at(w: float) -> float:
        """Temperature of the rim at a speed."""

        def left(T: float) -> float:
            return _RIM * (T - AIR) / share + excess(T) ** 2 / (2 * _C) - _J * (_W0**2 - w**2) / 2

        found: Any = brentq(left, AIR, 399.0, xtol=1e-13)
        return found

    chi, v, cold = math.sqrt(_C * _R**2 / _J), _C * _R * _W0, float(_fading(AIR))

    def onset(ratio: complex) -> tuple[Any, Any]:
        """Time at which the band slides, and the speed then: the rim is cold until then."""
        sine = chi * _TENSION * (_mu(ratio * cold) ** _N - 1) / v
        return _TENSION / v + np.arcsin(sine) / chi, _W0 * np.sqrt(1 - sine**2)

    (t_1, w_1), end = onset(_RATIO), at(0.0)

    def speed(T: float) -> float:
        lost = 2 / _J * (_RIM * (T - AIR) / share + excess(T) ** 2 / (2 * _C))
        return math.sqrt(max(_W0**2 - lost, 0.0))

    corners = [w for w in map(speed, _CORNERS) if 0 < w < w_1]
    time = t_1 + quad(lambda w: _J / (_R * excess(at(w))), 0.0, w_1, points=corners, epsabs=1e-13, epsrel=1e-12)[0]
    by_ratio = differentiated(lambda x: onset(x)[0], _RATIO)
    by_ratio += differentiated(lambda x: onset(x)[1], _RATIO) * _J / (_R * excess(at(w_1)))
    metal, lining = Material(*_METAL), Material(*_LINING)
    pair = FrictionHeat("rim", None, EffusivityPartition(metal, lining))
    factors = LinearFade(_SLOPE, _ABOVE, _FLOOR, _BLEND), TabulatedFade(*_TABLE)
    law = ProductFriction(ConstantFriction(_F, _RATIO), factors)
    scene = stop_scene(n=_N, beta=50.0, C=_C, T0=_TENSION, law=law, end=5.0)
    scene = dataclasses.replace(scene, heat=Heat((Lump("rim", _RIM, AIR),), (), pair, rim="rim"))
    balance = "root: C_r ΔT/a = J ω_0²/2 − (T_n(T) − T_0)²/2C, a = e_1/(e_1 + e_2) (Charron)"
    course = "quadrature ∫ J dω/R(T_n(T(ω)) − T_0), T(ω) by energy, f(T) by SciPy's monotone cubic and by hand"
    rows: list[Row] = [
        ("temperature at rest", balance, end, "end_temperatures.0"),
        ("full slip", f"{FORM}t_0 + asin(χ T_0 (Π_s − 1)/(C R ω_0))/χ", t_1, "full_slip_time"),
        ("stopping time", course, time, "stopping_time"),
        (
            "elastic energy at rest",
            f"{balance}; T_n²/2C",
            (excess(end) + _TENSION) ** 2 / (2 * _C),
            "energy.elastic_change",
        ),
        # the second derivative of the table jumps at 320 K, which derivatives of a run feel
        (
            "∂(stopping time)/∂(f_s/f)",
            f"{course}, differentiated",
            by_ratio,
            Slope(f"{_LAW}.base.static_ratio", 0),
            5e-7,
        ),
    ]
    return cases_with_slopes("heat of a jump", scene, rows, _outcome, 1e-11, solver=EXPLICIT)


def wall_cases() -> list[Case]:
    """Walls of rim and linings, these worn before, take the heat of a jump through their depth, and then conduct.

    `y' = A y + P(t) b` of the layers, by `exp(A t)`: `P` falls in a straight line from the jump on to the stop.
    """
    static, share, end, area, whole = 1.25, 0.7, 3.0, 0.05, 0.03
    worn = np.array([1e-3, 2e-3, 4e-3, 7e-3])
    steel, friction = (20.0, 7000.0, 500.0), (4.0, 2000.0, 900.0)
    along = _TENSION * _mu() ** np.arange(_N + 1)
    torque, chi = _R * (along[-1] - along[0]), math.sqrt(_C * _R**2 / _J)

    def wall(material: tuple[float, float, float], thickness: float, growth: float, count: int) -> tuple[Any, Any]:
        """`A`, and the capacities of the layers, from the face inwards."""
        steps = growth ** np.arange(count)
        steps *= thickness / steps.sum()
        C, G = material[1] * material[2] * area * steps, material[0] * area / (0.5 * (steps[1:] + steps[:-1]))
        A = np.diag(-np.append(G, 0.0) - np.append(0.0, G)) + np.diag(G, 1) + np.diag(G, -1)
        return A / C[:, None], C

    def rises(A: Any, C: Any, of_power: float, of_jump: float, static: complex = static) -> Any:
        """Rises of the layers at the end, by their shares of the heat of sliding and of the jump."""
        before = _TENSION * _mu(static * _F) ** _N
        sine = chi * (before - _TENSION) / (_C * _R * _W0)
        begin, w = _TENSION / (_C * _R * _W0) + np.arcsin(sine) / chi, _W0 * np.sqrt(1 - sine**2)
        jump, time, n = (before - along[-1]) / _C * ((before + along[-1]) / 2 - _TENSION), _J * w / torque, len(C)
        # of the layers, of the power over that at the beginning, of 1
        M = np.zeros((n + 2, n + 2), complex)
        M[:n, :n], M[0, n], M[n, n + 1] = A, of_power * torque * w / C[0], -1 / time
        y = expm(M * time) @ np.append(np.full(n, of_jump * jump / C.sum()), [1.0, 1.0])
        return expm(A * (end - begin - time)) @ y[:n]

    def lining(i: int, static: complex = static) -> Any:
        power = _R * (along[i + 1] - along[i]) / torque
        return rises(*wall(friction, whole - worn[i], 1.3, 2), (1 - share) * power, (1 - share) / _N, static)

    rim, first, last = rises(*wall(steel, 0.02, 1.6, 3), share, share).real, lining(0).real, lining(_N - 1).real
    source = f"{FORM}exp(A t) from ΔE/C in every layer, ΔE = (T_s − T_k)/C ((T_s + T_k)/2 − T_0)"

    def rise(node: int) -> Reader:
        return lambda result: result.end_temperatures[node] - AIR

    rows: list[Row] = [
        *((f"layer {i + 1} of the rim", source, rim[i], rise(i)) for i in range(3)),
        *((f"layer {i + 1} of lining 1", source, first[i], rise(3 + i)) for i in range(2)),
        *((f"layer {i + 1} of lining {_N}", source, last[i], rise(1 + 2 * _N + i)) for i in range(2)),
        (
            f"∂(layer 2 of lining {_N})/∂(f_s/f)",
            f"{source}, differentiated",
            differentiated(lambda x: lining(_N - 1, x)[1], static),
            Slope(f"{_LAW}.static_ratio"),
        ),
    ]
    heat = Heat(
        (
            Wall("rim", Material(*steel), 0.02, area, 3, 1.6, AIR),
            Wall("linings", Material(*friction), whole, area, 2, 1.3, AIR, _N),
        ),
        (),
        FrictionHeat("rim.front", "linings.front", ConstantPartition(share)),
        rim="rim.front",
        linings="linings.front",
    )
    scene = stop_scene(n=_N, beta=50.0, C=_C, T0=_TENSION, law=ConstantFriction(_F, static), end=end)
    wear = Wear(ConstantWear(0.0), worn=worn, thickness=whole, heat=True)
    scene = with_values(dataclasses.replace(scene, heat=heat, wear=wear), {"brake.linings.area": area})
    return cases_with_slopes("worn walls", scene, rows, lambda r: r.end_temperatures[2 + 2 * _N], 1e-10)


CASES = (
    jump_cases,
    wall_cases,
)
