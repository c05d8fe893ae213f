"""Validation of disc and double-shoe brakes, of other torques on the shaft, and of layers of rope, in closed form."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import quad

from .._parts._scene import ForceDuty, Initial, Scene
from .._run._result import Result
from ..brakes._design import AbstractBrake
from ..brakes._pressed import AbstractPadPressure, DiscBrake, Pads, ShoeBrake, Shoes, UniformPressure, UniformWear
from ..friction import ConstantFriction
from ..loads import HookLoad, TorqueLoad
from ..profiles import AbstractProfile, Constant, PiecewiseLinear, Repeated
from ..rope import RopeLayers
from ..shaft import AbstractShaftTorque, BearingFriction, EddyCurrentBrake, HydrodynamicBrake
from ..thermal._heat import ConstantPartition, FrictionHeat, Heat
from ..thermal._material import ROOM
from ..thermal._network import Conductance, Lump, Reservoir
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


def disc_heat(capacity: float, share: float, cooling: float) -> Heat:
    """The disc as one lump (J/K) with a `share` of the heat, cooled through `cooling` (W/K)."""
    return Heat(
        (Lump("disc", capacity, 293.15), Reservoir("air", 293.15)),
        (Conductance("disc", "air", cooling),),
        FrictionHeat("disc", None, ConstantPartition(share)),
        rim="disc",
    )


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
    worn, new = (stop_of(disc(pressure), F, w0, load) for pressure in (UniformWear(), UniformPressure()))
    held = stop_of(disc(UniformWear()), F, 0.0, PiecewiseLinear([0.0, 10.0], [0.0, 3 * torque]), 9.0)
    of_worn = f"{FORM}J ω_0/(n f F r_e − M), r_e = (r_o + r_i)/2"
    of_new = f"{FORM}the same, r_e = ⅔ (r_o³ − r_i³)/(r_o² − r_i²)"
    pads = "brake.linings"
    of_slope = f"{FORM}the stopping time, differentiated"

    def new_time(f: complex = _F, r_i: complex = _R_I) -> complex:
        arm = 2 / 3 * (_R_O**3 - r_i**3) / (_R_O**2 - r_i**2)
        return J * w0 / (_N * f * F * arm - load)

    wear = [
        ("stopping time, uniform wear", of_worn, time, "stopping_time"),
        ("friction heat", f"{FORM}n f F r_e ω_0 t/2", torque * w0 * time / 2, "energy.friction_heat"),
    ]
    pressed = [
        ("stopping time, uniform pressure", of_new, new_time().real, "stopping_time"),
        ("∂(stopping time)/∂f", of_slope, differentiated(new_time, _F), Slope(f"{pads}.friction.coefficient"), 1e-9),
        (
            "∂(stopping time)/∂r_i",
            of_slope,
            differentiated(lambda r: new_time(r_i=r), _R_I),
            Slope(f"{pads}.inner_radius"),
            1e-9,
        ),
    ]
    return [
        *cases_of_run("disc brake", worn, wear),
        *cases_with_slopes("disc brake", new, pressed),
        *cases_of_run(
            "disc brake", held, [("restart", f"{FORM}where M(t) = n f_s F r_e", 10.0 * 1.25 / 3, time_of("restart"))]
        ),
    ]


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
        return lambda r: float(r.series([(k - 1) * period + tau]).temperature[0, 0]) - 293.15  # pyright: ignore

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
        return float(drum.greatest_pressure(result.metrics["max_normal_load"]))

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
    return cases_with_slopes("double shoe", stop_of(drum, force, w0), rows) + cases_with_slopes(
        "double shoe", stop_of(drum, force, -w0), back
    )


# --- torques on the shaft and layers of rope --------------------------------------------------------------------------


_J, _W0 = 800.0, 20.0


def _turning(*shaft: AbstractShaftTorque, load: TorqueLoad, end: float, w0: float = _W0) -> Scene:
    """A pulley with an open band under torques on its shaft."""
    return dataclasses.replace(stop_scene(C=None, T0=0.0, w0=w0, load=load, end=end), shaft=shaft)


def eddy_current_cases() -> list[Case]:
    """Slowing down between two speeds, and lowering of a load at a steady speed."""
    M_m, w_m, low, load = 9e3, 11.0, 3.0, 4e3
    time = quad(lambda w: _J * (w**2 + w_m**2) / (2 * M_m * w * w_m), low, _W0, epsabs=0.0, epsrel=1e-13)[0]
    brake = EddyCurrentBrake(M_m, w_m)  # pyright: ignore
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


def bearing_cases() -> list[Case]:
    """A pulley that dry friction of the bearings brings to rest, until a growing load exceeds it."""
    M_c, M, s = 5e3, 1e3, 800.0
    load = TorqueLoad(PiecewiseLinear([0.0, 5.0, 25.0], [M, M, M + 20.0 * s]))
    rows = [
        ("stopping time", f"{FORM}J ω_0/(M_c − M)", _J * _W0 / (M_c - M), "stopping_time"),
        ("restart", f"{FORM}where M(t) = M_c", 5.0 + (M_c - M) / s, time_of("restart")),
    ]
    return cases_of_run("bearing friction", _turning(BearingFriction(M_c), load=load, end=11.0), rows)  # pyright: ignore


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
    laws = BearingFriction(M_c, place="housing"), HydrodynamicBrake(k, fill, place="water")  # pyright: ignore
    scene = dataclasses.replace(_turning(*laws, load=TorqueLoad(Constant(0.0)), end=time + 1.0), heat=heat)
    return cases_with_slopes("heat of torques on the shaft", scene, rows, tolerance=1e-10)


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
        found += cases_with_slopes("rope in layers", scene, [(words, source, travel, "hook_travel")])
    return found


CASES = (
    *(disc_cases, calliper_cases, snub_cases, shoe_cases),
    *(eddy_current_cases, bearing_cases, shaft_heat_cases, rope_cases),
)
