"""Validation of disc and double-shoe brakes, of other torques on the shaft, and of layers of rope, in closed form."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from diffrax import Tsit5

from .._parts._scene import ForceDuty, Initial, Scene
from .._run._result import Result
from ..brakes._design import AbstractBrake
from ..brakes._pressed import AbstractPadPressure, DiscBrake, Pads, ShoeBrake, Shoes, UniformPressure, UniformWear
from ..friction import ConstantFriction
from ..loads import HookLoad, TorqueLoad
from ..profiles import AbstractProfile, Constant, PiecewiseLinear
from ..rope import RopeLayers
from ..shaft import AbstractShaftTorque, BearingFriction
from ..thermal._heat import Heat
from ._cases_band import closed_form, stop_scene, time_of
from ._validation import FORM, Case, Row, Slope, cases_of_run, cases_with_slopes, differentiated

_SHIGLEY = "Budynas & Nisbett, Shigley's Mechanical Engineering Design"

# --- disc brakes ------------------------------------------------------------------------------------------------------

# pads of the cases: friction, radii (m), angle (rad), number
_F, _R_I, _R_O, _ANGLE, _N = 0.4, 0.30, 0.50, 0.7, 4
_MEAN = 0.5 * (_R_I + _R_O)


def disc(pressure: AbstractPadPressure, inertia: float = 400.0) -> DiscBrake:
    """The disc brake of the cases."""
    return DiscBrake(inertia, Pads(ConstantFriction(_F, 1.25), _R_I, _R_O, _ANGLE, _N, pressure))


def stop_of(
    brake: AbstractBrake,
    force: float | AbstractProfile,
    omega: float,
    load: float | AbstractProfile = 0.0,
    end: float = 10.0,
    heat: Heat | None = None,
) -> Scene:
    """A stop under a force and a load, constant or given over time."""
    force, load = (x if isinstance(x, AbstractProfile) else Constant(x) for x in (force, load))
    return Scene(brake, ForceDuty(force, TorqueLoad(load)), Initial(omega), end, heat)


def disc_cases() -> list[Case]:
    """A stop against a load with either distribution of pressure, and holding time of a held disc."""
    F, load, J, w0 = 20e3, 1500.0, 400.0, 30.0
    torque = _N * _F * F * _MEAN
    time = J * w0 / (torque - load)
    straight = PiecewiseLinear([0.0, 10.0], [load, load])  # as the load of the held one, by whose program it runs
    worn, new = (stop_of(disc(pressure), F, w0, straight) for pressure in (UniformWear(), UniformPressure()))
    held = stop_of(disc(UniformWear()), F, 0.0, PiecewiseLinear([0.0, 10.0], [0.0, 3 * torque]), 9.0)
    of_worn = f"{FORM}J ω_0/(n f F r_e − M), r_e = (r_o + r_i)/2"
    of_new = f"{FORM}the same, r_e = ⅔ (r_o³ − r_i³)/(r_o² − r_i²)"
    new_arm = 2 / 3 * (_R_O**3 - _R_I**3) / (_R_O**2 - _R_I**2)
    new_time = J * w0 / (_N * _F * F * new_arm - load)
    wear = [
        ("stopping time, uniform wear", of_worn, time, "stopping_time"),
        ("friction heat", f"{FORM}n f F r_e ω_0 t/2", torque * w0 * time / 2, "energy.friction_heat"),
    ]
    pressed = [("stopping time, uniform pressure", of_new, new_time, "stopping_time")]
    return [
        *cases_of_run("disc brake", worn, wear),
        *cases_of_run("disc brake", new, pressed),
        *cases_of_run(
            "disc brake", held, [("restart", f"{FORM}where M(t) = n f_s F r_e", 10.0 * 1.25 / 3, time_of("restart"))]
        ),
    ]


# --- double-shoe brakes -----------------------------------------------------------------------------------------------


def shoe_cases() -> list[Case]:
    """Shigley's internal expanding shoes under the force that gives the leading one 1 MPa, in both directions.

    Drum 300 mm, linings 32 mm wide from 0 to 126°, pins at 122.7 mm; moments of a shoe by quadrature.
    """
    f, J, w0 = 0.32, 12.0, 25.0
    p, b, r, a, end = 1e6, 0.032, 0.150, 0.1227, math.radians(126.0)
    drum = ShoeBrake(J, Shoes(ConstantFriction(f), r, b, 0.0, end), a, 0.212)

    nodes, weights = np.polynomial.legendre.leggauss(40)

    def over(function: Callable[[Any], Any], end: complex) -> complex:
        # exact for these integrands, also along complex angles
        return complex(np.sum(weights * function(0.5 * end * (nodes + 1)))) * end / 2

    def moments(f: complex = f, end: complex = end) -> tuple[complex, complex, complex]:
        """Of the normal forces and of friction about the pin, and of friction about the shaft."""
        M_N = p * b * r * a * over(lambda x: np.sin(x) ** 2, end)
        M_F = f * p * b * r * over(lambda x: np.sin(x) * (r - a * np.cos(x)), end)
        return M_N, M_F, f * p * b * r**2 * over(np.sin, end)

    M_N, M_F, leading = (x.real for x in moments())
    force = (M_N - M_F) / 0.212
    trailing = leading * (M_N - M_F) / (M_N + M_F)
    time = J * w0 / (leading + trailing)

    def slowed(f: complex = f, end: complex = end) -> complex:
        """Stopping time under the same force, whose pressure is that of each shoe."""
        N, M, T = moments(f, end)
        return J * w0 / (force * 0.212 * T * (1 / (N - M) + 1 / (N + M)))

    def torque(shoe: int) -> Callable[[Result], float]:
        return lambda result: r * float(np.asarray(result.series([0.1]).friction_force)[0, shoe])

    def pressure(result: Result) -> float:
        return float(drum.greatest_pressure(np.max(result.series([0.1]).normal_load)))

    source = f"{_SHIGLEY}, internal expanding shoes; moments by quadrature"
    rows: list[Row] = [
        ("torque of the leading shoe", f"{source}: f p b r² ∫ sin θ dθ", leading, torque(0)),
        ("torque of the trailing shoe", f"{source}: M (M_N − M_F)/(M_N + M_F)", trailing, torque(1)),
        ("stopping time", f"{source}: J ω_0/(M_1 + M_2)", time, "stopping_time"),
        ("maximum pressure", f"{source}: 1 MPa was given", 1e6, pressure),
        ("friction that locks", f"{source}: M_N = M_F", f * M_N / M_F, lambda _: 1 / drum.self_locking(np.ones(2))[0]),
    ]
    for name, slope, place in (
        ("f", differentiated(slowed, f), "friction.coefficient"),
        ("θ_2", differentiated(lambda x: slowed(end=x), end), "end"),
    ):
        of_slope = "the same: J ω_0/(M_1 + M_2), differentiated"
        rows.append((f"∂(stopping time)/∂{name}", of_slope, slope, Slope(f"brake.linings.{place}"), 1e-9))
    back = [("stopping time backwards", "the same", time, "stopping_time")]
    return cases_with_slopes("double shoe", stop_of(drum, force, w0), rows, solver=Tsit5()) + cases_with_slopes(
        "double shoe", stop_of(drum, force, -w0), back, solver=Tsit5()
    )


# --- torques on the shaft and layers of rope --------------------------------------------------------------------------


_J, _W0 = 800.0, 20.0


def _turning(*shaft: AbstractShaftTorque, load: TorqueLoad, end: float, w0: float = _W0) -> Scene:
    """A pulley with an open band under torques on its shaft."""
    return dataclasses.replace(stop_scene(C=None, T0=0.0, w0=w0, load=load, end=end), shaft=shaft)


def bearing_cases() -> list[Case]:
    """A pulley that dry friction of the bearings brings to rest, until a growing load exceeds it."""
    M_c, M, s = 5e3, 1e3, 800.0
    load = TorqueLoad(PiecewiseLinear([0.0, 5.0, 25.0], [M, M, M + 20.0 * s]))
    rows = [
        ("stopping time", f"{FORM}J ω_0/(M_c − M)", _J * _W0 / (M_c - M), "stopping_time"),
        ("restart", f"{FORM}where M(t) = M_c", 5.0 + (M_c - M) / s, time_of("restart")),
    ]
    return cases_of_run("bearing friction", _turning(BearingFriction(M_c), load=load, end=11.0), rows)  # pyright: ignore


def rope_cases() -> list[Case]:
    """Stops over two and over four layers of rope, by energy."""
    m, r, d, n, g, T_0 = 40e3, 0.4, 0.04, 8.0, 9.80665, 12e3
    M_b, found = 0.725 * T_0 * (closed_form()["Pi"] - 1), []
    for words, each, turns, w0 in (("hook travel", 4.0, 5.0, _W0), ("hook travel, four layers", 1.5, 5.0, 31.0)):
        load = HookLoad(m, r, n, rope=RopeLayers(d, each, turns))  # pyright: ignore
        scene = stop_scene(C=None, T0=T_0, w0=w0, load=load, end=20.0)
        top = math.ceil(turns / each)
        energy, travel = 0.5 * (_J + m * ((r + (top - 1) * math.sqrt(3) / 2 * d) / n) ** 2) * w0**2, 0.0
        for layer in range(top, 0, -1):
            radius = r + (layer - 1) * math.sqrt(3) / 2 * d
            net = M_b - m * g * radius / n
            turned = min(2 * math.pi * min(turns - (layer - 1) * each, each), energy / net)
            energy, travel = energy - net * turned, travel + radius * turned / n
        source = f"{FORM}Σ r_k φ_k/n, J ω_0²/2 = Σ (M_b − m g r_k/n) φ_k"
        found += cases_of_run("rope in layers", scene, [(words, source, travel, "hook_travel")])
    return found


CASES = (
    disc_cases,
    shoe_cases,
    bearing_cases,
    rope_cases,
)
