"""Twelve closed forms that `validate` compares with runs: every kind of brake, loads,
heat, events, a derivative.

The docstring of a function is its formula. It returns the truth, and what computes the
number of simbrake.
"""

import inspect
import math
from collections.abc import Callable
from fnmatch import fnmatchcase
from typing import Any, TypeAlias

import jax
import numpy as np

import simbrake as sb

from .._base._faults import input_error
from ._validation import Case

#: the truth, and the function that computes it by simbrake
Compared: TypeAlias = tuple[float, Callable[[], Any]]

# the band brake of most cases: linings, friction, angle of each (rad), radius (m),
# inertia (kg·m²), slack tension (N), stiffness of the elastic band (N/m), speed at the
# start (rad/s)
COUNT = 20
FRICTION = 0.35
ANGLE = math.radians(13.5)
RADIUS = 0.725
INERTIA = 800.0
SLACK = 8e3
STIFFNESS = 2e5
SPEED = 20.0
NO_LOAD = sb.TorqueLoad(0.0)


def ratio(f: Any, angle: float) -> Any:
    """Ratio of the tensions at a sliding lining,
    `μ = (1 + f tan β/2)/(1 − f tan β/2)`."""
    fz = f * math.tan(angle / 2)
    return (1 + fz) / (1 - fz)


#: torque of the band brake in full slip, N·m
TORQUE = RADIUS * SLACK * (ratio(FRICTION, ANGLE) ** COUNT - 1)


def run(
    brake: Any, duty: Any, omega: float = SPEED, end: float = 9.0, heat: Any = None
) -> sb.Result:
    return sb.simulate(sb.Scene(brake, duty, sb.Initial(omega), end, heat), rtol=1e-12)


def band_brake(stiffness: float | None = None) -> sb.Brake:
    linings = sb.uniform_linings(COUNT, COUNT * ANGLE, FRICTION)
    return sb.Brake(sb.Pulley(RADIUS, INERTIA), sb.Band(RADIUS, stiffness), linings)


def band_stop(load: Any = NO_LOAD, **more: Any) -> sb.Result:
    return run(band_brake(), sb.Duty(SLACK, load), **more)


def elastic_scene() -> sb.Scene:
    """A stop of a brake with an elastic band, every lining of which has its own time of
    slip."""
    return sb.Scene(
        band_brake(STIFFNESS), sb.Duty(SLACK, NO_LOAD), sb.Initial(SPEED), 5.0
    )


def elastic_stop(f: Any = FRICTION) -> tuple[Any, Any]:
    """Times of full slip and of the stop in that scene; `f` may be complex."""
    onset = SLACK / (STIFFNESS * RADIUS * SPEED)
    chi = RADIUS * math.sqrt(STIFFNESS / INERTIA)
    gain = ratio(f, ANGLE) ** COUNT - 1
    turned = np.arcsin(chi * onset * gain)
    slip = onset + turned / chi
    return slip, slip + INERTIA * SPEED * np.cos(turned) / (RADIUS * SLACK * gain)


def simple_band() -> Compared:
    """t = J ω_0/(R T_0 (μⁿ − 1)), μ = (1 + f tan β/2)/(1 − f tan β/2)"""
    return INERTIA * SPEED / TORQUE, lambda: band_stop().stopping_time


def elastic_band() -> Compared:
    """t = t_0 + asin(χ t_0 (μⁿ − 1))/χ, t_0 = T_0/(C R ω_0), χ² = C R²/J"""
    return elastic_stop()[
        0
    ], lambda: sb.simulate(elastic_scene(), rtol=1e-12).full_slip_time


def derivative() -> Compared:
    """∂t/∂f of t = t_1 + J ω_0 cos χ(t_1 − t_0)/(R T_0 (μⁿ − 1)), t_0 onset and t_1
    full slip of the elastic band"""
    slopes = jax.jit(
        jax.grad(lambda scene: sb.simulate(scene, rtol=1e-12).stopping_time)
    )
    truth = elastic_stop(FRICTION + 1e-200j)[1].imag / 1e-200
    return truth, lambda: slopes(elastic_scene()).brake.linings.friction.coefficient


#: a lever that rises by 1000 N/s from 0, and the ratio of tensions at a lining of the
#: staged brakes
RAMP = sb.Duty(sb.PiecewiseLinear([0.0, 9.0], [0.0, 9e3]), NO_LOAD)
MU = ratio(0.5, 1.0)


def staged_band(count: int, bandage: sb.Bandage) -> sb.Brake:
    # (friction of the bandages is so small that the preload alone makes the capacity of
    # 600 N·m)
    return sb.Brake(
        sb.Pulley(1.0, 40.0),
        sb.Band(1.0),
        sb.uniform_linings(count, count, 0.5),
        bandage,
    )


def staged_brake() -> Compared:
    """t = M_i (1 + J_b/J)/(2 c) + J ω_0/M_i, the inner pair slips at twice the first
    term, the band's torque is c t"""
    brake = staged_band(4, sb.Bandage(4.0, 1e-14, 1.5e16))
    truth = 600.0 * 1.1 / 2e3 / (MU**4 - 1) + 40.0 * SPEED / 600.0
    return truth, lambda: run(brake, RAMP).stopping_time


def linings_on_springs() -> Compared:
    """t = M_2/(R c (μ (μ − 1) − J_2 (μ² − 1)/(J + J_1 + J_2))), T_0 = c t, lining 2
    lets go of the rim at M_2"""
    brake = staged_band(
        2, sb.Bandage([1.2, 1.5], 1e-14, 6e16, spring=[2e3], spring_damping=0.05)
    )
    truth = 600.0 / 1e3 / (MU * (MU - 1) - 1.5 * (MU**2 - 1) / 42.7)
    return truth, lambda: run(brake, RAMP, end=1.0).internal_slip_time


def two_bands() -> Compared:
    """t = J ω_0/(Σ R T_j (Π_j − 1)), T_j = T_0 (C_j/Π_j)/Σ (C_k/Π_k), Π_j = μⁿ of band
    j"""
    Pi = ratio(FRICTION, 0.6) ** np.array([4, 6])
    share = np.array([2e5, 3e5]) / Pi
    bands = tuple(
        sb.brakes.LinedBand(sb.uniform_linings(n, 0.6 * n, FRICTION), C)
        for n, C in ((4, 2e5), (6, 3e5))
    )
    brake = sb.brakes.MultiBandBrake(sb.Pulley(RADIUS, INERTIA), RADIUS, bands)
    torque = RADIUS * SLACK * (share @ (Pi - 1)) / share.sum()
    return (
        INERTIA * SPEED / torque,
        lambda: run(brake, sb.Duty(SLACK, NO_LOAD)).stopping_time,
    )


def disc() -> Compared:
    """t = J ω_0/(n f F (r_i + r_o)/2), uniform wear"""
    brake = sb.DiscBrake(INERTIA, sb.Pads(0.4, 0.3, 0.5, 0.7, 4))
    return INERTIA * SPEED / (
        4 * 0.4 * 20e3 * 0.4
    ), lambda: run(brake, sb.ForceDuty(20e3, NO_LOAD)).stopping_time


def shoes() -> Compared:
    """t = J ω_0/(M_1 + M_2), M = 2 f r F c/(a π/2 ∓ 2 f r), linings over 180° from pins
    at the distance a"""
    normal = 0.12 * math.pi / 2
    friction = 2 * 0.3 * 0.15
    torque = friction * 2e3 * 0.2 * (1 / (normal - friction) + 1 / (normal + friction))
    brake = sb.ShoeBrake(12.0, sb.Shoes(0.3, 0.15, 0.032, 0.0, math.pi), 0.12, 0.2)
    return (
        12.0 * SPEED / torque,
        lambda: run(brake, sb.ForceDuty(2e3, NO_LOAD)).stopping_time,
    )


def hook() -> Compared:
    """Q = M_b (J + m (r/i)²) ω_0²/2/(M_b − m g r/i), M_b = R T_0 (μⁿ − 1)"""
    load = sb.HookLoad(40e3, 0.4, 8, gravity=9.81)
    work = (INERTIA + 40e3 * 0.05**2) * SPEED**2 / 2
    return TORQUE * work / (TORQUE - 40e3 * 9.81 * 0.05), lambda: band_stop(
        load
    ).energy["friction_heat"]


def held() -> Compared:
    """the angle after 3600 s is exactly 0 under a load just below R T_0 (μⁿ − 1)"""
    load = sb.TorqueLoad((1 - 1e-12) * TORQUE)
    return 0.0, lambda: band_stop(load, omega=0.0, end=3600.0).record.y_end.phi


def rim() -> Compared:
    """T = T_0 + J ω_0²/2/C, all heat into the rim"""
    heat = sb.lumped_heat(rim=2e4, partition=1.0, rim_cooling=0.0)
    truth = sb.thermal.ROOM + INERTIA * SPEED**2 / 2 / 2e4
    return truth, lambda: band_stop(heat=heat).end_temperatures[0]


def wall() -> Compared:
    """ΔT = (2 q/k) √(a t/π) at the face, Carslaw & Jaeger 2.9: half-space under
    constant flux; 100 layers"""
    steel = sb.Material(50.0, 4e3, 1e3)
    body = sb.thermal.Wall("wall", steel, 0.05, 1.0, 100)
    heat = sb.Heat((body,), sources=(sb.thermal.Source("wall.front", 1e6),))
    # of the first half layer by Fourier's law
    warm = 1e6 / 50.0 * 0.05 / 200 - sb.thermal.ROOM
    truth = 2 * 1e6 / 50.0 * math.sqrt(1.25e-5 * 2.0 / math.pi)
    return truth, lambda: sb.simulate_heat(heat, [0.0, 2.0]).temperature[-1, 0] + warm


#: the function of each case, by what is compared
CASES = {
    "simple band/stopping time": simple_band,
    "elastic band/full slip": elastic_band,
    "elastic band/∂(stopping time)/∂f": derivative,
    "staged brake/stopping time": staged_brake,
    "linings on springs/slip": linings_on_springs,
    "two bands/stopping time": two_bands,
    "disc brake/stopping time": disc,
    "double shoe/stopping time": shoes,
    "hook load/friction heat": hook,
    "held brake/angle": held,
    "heated rim/temperature at rest": rim,
    "layered wall/temperature rise": wall,
}
#: of the error, where it is not 1e-11
TOLERANCES = {derivative: 1e-9, held: 0.0, wall: 1e-3}


def closed_forms() -> list[Case]:
    cases = []
    for name, function in CASES.items():
        truth, value = function()
        source = f"closed form: {inspect.getdoc(function)}"
        cases.append(Case(name, source, truth, TOLERANCES.get(function, 1e-11), value))
    return cases


def chosen(only: str | None = None) -> list[Case]:
    """The cases whose name holds the words `only`, or fits it as a pattern with `*`;
    all without it.

    Raises `InputError` where there is none.
    """
    cases = closed_forms()
    word = (only or "*").lower()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    picked = [case for case in cases if fnmatchcase(case.name.lower(), pattern)]
    if not picked:
        names = ", ".join(case.name for case in cases)
        raise input_error("--only", f"no case matches {only!r}", f"cases are {names}")
    return picked
