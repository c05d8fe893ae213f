"""Validation of disc and double-shoe brakes, of other torques on the shaft, and of layers of rope, in closed form."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from case_tools import FORM, Case, Row, Slope, cases_of_run, cases_with_slopes, differentiated
from scipy.integrate import quad
from stop_scenes import stop_scene

from simbrake import (
    Constant,
    ConstantFriction,
    DiscBrake,
    ForceDuty,
    Heat,
    Initial,
    Pads,
    Repeated,
    Result,
    Scene,
    TorqueLoad,
)
from simbrake.brakes import AbstractPadPressure, UniformWear
from simbrake.loads import AbstractShaftTorque, BearingFriction, EddyCurrentBrake, HydrodynamicBrake
from simbrake.profiles import AbstractProfile
from simbrake.thermal import ROOM, Conductance, ConstantPartition, FrictionHeat, Lump, Reservoir

_SHIGLEY = "Budynas & Nisbett, Shigley's Mechanical Engineering Design"

# --- disc brakes ------------------------------------------------------------------------------------------------------

# pads of the cases: friction, radii (m), angle (rad), number
_F, _R_I, _R_O, _ANGLE, _N = 0.4, 0.30, 0.50, 0.7, 4
_MEAN = 0.5 * (_R_I + _R_O)


def disc(pressure: AbstractPadPressure, inertia: float = 400.0) -> DiscBrake:
    """The disc brake of the cases."""
    return DiscBrake(inertia, Pads(ConstantFriction(_F, 1.25), _R_I, _R_O, _ANGLE, _N, pressure))


def disc_heat(capacity: float, share: float, cooling: float) -> Heat:
    """The disc as one lump (J/K) with a `share` of the heat, cooled through `cooling` (W/K)."""
    return Heat(
        (Lump("disc", capacity, 293.15), Reservoir("air", 293.15)),
        (Conductance("disc", "air", cooling),),
        FrictionHeat("disc", None, ConstantPartition(share)),
        rim="disc",
    )


def stop_of(
    brake: Any,
    force: float | AbstractProfile,
    omega: float,
    load: float | AbstractProfile = 0.0,
    end: float = 10.0,
    heat: Heat | None = None,
) -> Scene:
    """A stop under a force and a load, constant or given over time."""
    force, load = (x if isinstance(x, AbstractProfile) else Constant(x) for x in (force, load))
    return Scene(brake, ForceDuty(force, TorqueLoad(load)), Initial(omega), end, heat)


def calliper_cases() -> list[Case]:
    """32.5 kg·m² from 250 rpm, all heat into a solid disc of 150 × 6 mm, 7800 kg/m³, 450 J/(kg·K)."""
    J, w0 = 32.5, 250 * math.pi / 30
    capacity = 7800 * 450 * math.pi / 4 * 0.150**2 * 0.006
    energy, source = 0.5 * J * w0**2, f"{_SHIGLEY}, calliper brake"
    rows = [
        ("friction heat", f"{source}: J ω_0²/2", energy, "energy.friction_heat"),
        ("rise of the disc", f"{source}: E/(m c)", energy / capacity, lambda r: r.end_temperatures[0] - 293.15, 1e-9),
    ]
    scene = stop_of(disc(UniformWear(), J), 1e3, w0, end=4.0, heat=disc_heat(capacity, 1.0, 0.0))
    return cases_of_run("calliper", scene, rows)


def snub_cases() -> list[Case]:
    """Fade test of a car's disc brake after UN R13, Type-I: 15 snubs from 120 to 60 km/h every 45 s.

    Heat input is linear in time and decays with `exp(−b t)`. The rise at the end of one snub of the length
    `τ` from `v_1`, `P(t) = s m a (v_1 − a t)`, is `∫ P(t) e^{−b (τ − t)} dt/C`; the snubs add up.
    """
    fast, slow, a, period, mass = 120 / 3.6, 60 / 3.6, 3.0, 45.0, 400.0  # m/s, m/s, m/s², s, kg
    C, share, b = 3500.0, 0.95, 1 / 900  # J/K, share of the heat, rate of cooling (1/s)
    tau, wheel = (fast - slow) / a, 0.3
    J, force = mass * wheel**2, mass * a * wheel / (_N * _F * _MEAN)
    again = J * (fast - slow) / wheel / (period - tau)  # torque that restores the speed
    lever, load = (
        Repeated([0.0, tau, tau, period], values, period, 15)
        for values in ([force, force, 0.0, 0.0], [0.0, 0.0, again, again])
    )
    heat = disc_heat(C, share, C * b)
    fall = math.exp(-b * tau)
    one = share * mass * a / C * (fast * (1 - fall) / b - a * (tau / b - (1 - fall) / b**2))

    def rise(k: int) -> Callable[[Result], float]:
        return lambda r: float(r.series([(k - 1) * period + tau]).temperature[0, 0]) - 293.15

    rows = [
        (
            f"rise after {k}",
            "UN R13 Type-I; closed form: Σ ∫ s P e^(−b (t_e − t)) dt/C",
            one * sum(math.exp(-b * period * i) for i in range(k)),
            rise(k),
        )
        for k in (1, 5, 15)
    ]
    scene = stop_of(disc(UniformWear(), J), lever, fast / wheel, load, 15 * period, heat)
    return cases_of_run("snubs", scene, rows, tolerance=1e-9)


# --- torques on the shaft and layers of rope --------------------------------------------------------------------------


_J, _W0 = 800.0, 20.0


def _turning(*shaft: AbstractShaftTorque, load: TorqueLoad, end: float, w0: float = _W0) -> Scene:
    """A pulley with an open band under torques on its shaft."""
    return dataclasses.replace(stop_scene(C=None, T0=0.0, w0=w0, load=load, end=end), shaft=shaft)


def eddy_current_cases() -> list[Case]:
    """Slowing down between two speeds, and lowering of a load at a steady speed."""
    M_m, w_m, low, load = 9e3, 11.0, 3.0, 4e3
    time = quad(lambda w: _J * (w**2 + w_m**2) / (2 * M_m * w * w_m), low, _W0, epsabs=0.0, epsrel=1e-13)[0]
    brake = EddyCurrentBrake(M_m, w_m)
    slowed = _turning(brake, load=TorqueLoad(Constant(0.0)), end=time)
    lowered = _turning(brake, load=TorqueLoad(Constant(load)), end=20.0, w0=0.0)
    kloss = "quadrature: ω at t = ∫ J (ω² + ω_m²)/(2 M_m ω ω_m) dω (Kloss)"
    steady = w_m * (M_m / load - math.sqrt((M_m / load) ** 2 - 1))
    return [
        *cases_of_run("eddy-current brake", slowed, [("speed", kloss, low, lambda r: r.record.y_end.omega)]),
        *cases_of_run(
            "eddy-current brake",
            lowered,
            [("terminal speed", f"{FORM}ω_m [M_m/M − √((M_m/M)² − 1)]", steady, "terminal_speed")],
        ),
    ]


def shaft_heat_cases() -> list[Case]:
    """Bearings and a half-filled hydrodynamic brake bring a pulley to rest; each heats a body, one of which cools."""
    M_c, k, fill, C, b = 300.0, 50.0, 0.5, (2e3, 4e2), 0.4
    K, share = k * fill, math.sqrt(k * fill / M_c)

    def stopped(k: complex) -> complex:
        return _J * np.arctan(_W0 * np.sqrt(k * fill / M_c)) / np.sqrt(k * fill * M_c)

    time = stopped(k).real
    turned = _J / (2 * K) * math.log1p(K * _W0**2 / M_c)

    def speed(t: float) -> float:
        return math.tan((time - t) * math.sqrt(K * M_c) / _J) / share

    source = f"{FORM}J ω̇ = −(k κ ω² + M_c)"
    cooled = quad(lambda t: K * speed(t) ** 3 * math.exp(-b * (time - t)), 0.0, time, epsabs=0.0, epsrel=1e-13)[0]
    rows: list[Row] = [
        ("stopping time", f"{source}: J atan(ω_0 √(k κ/M_c))/√(k κ M_c)", time, "stopping_time"),
        ("∂(stopping time)/∂k", f"{source}, differentiated", differentiated(stopped, k), Slope("shaft.1.coefficient")),
        ("rise of the housing", f"{source}: M_c φ/C", M_c * turned / C[0], lambda r: r.end_temperatures[0] - ROOM),
        (
            "rise of the water",
            f"{source}: ∫ k κ ω³ e^(−b (t_e − t)) dt/C",
            cooled * math.exp(-b) / C[1],
            lambda r: r.end_temperatures[1] - ROOM,
            1e-9,
        ),
    ]
    bodies = Lump("housing", C[0], ROOM), Lump("water", C[1], ROOM), Reservoir("air", ROOM)
    heat = Heat(bodies, (Conductance("water", "air", b * C[1]),), None)
    laws = BearingFriction(M_c, place="housing"), HydrodynamicBrake(k, fill, place="water")
    scene = dataclasses.replace(_turning(*laws, load=TorqueLoad(Constant(0.0)), end=time + 1.0), heat=heat)
    return cases_with_slopes("heat of torques on the shaft", scene, rows, tolerance=1e-10)


CASES = (
    calliper_cases,
    snub_cases,
    eddy_current_cases,
    shaft_heat_cases,
)
