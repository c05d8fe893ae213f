"""Validation of mechanisms: staged brake, chain, bands, rope, phases, retarders, linings that travel.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

import math

import numpy as np

from .._parts._scene import Duty, Initial, Scene
from .._run._result import Result
from .._run._travel import ring_wear
from ..brakes._bands import LinedBand, MultiBandBrake
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley, Segments, tension_shares, uniform_linings
from ..friction import ConstantFriction
from ..loads import HookLoad, Phase, Phases, RopeElasticity, StringLoad, TorqueLoad
from ..profiles import Constant, PiecewiseLinear, ramp
from ..shaft import HydrodynamicBrake, ViscousDrag
from ._cases_band import points, scene_of, stop_scene, time_of
from ._validation import Case, frozen_cases


def _staged(lever: PiecewiseLinear, load: float, stiffness: float | None, preload: float, end: float) -> Scene:
    """Eight linings of 33°, with a grip that depends on the tensions of the band."""
    linings = Lining(ConstantFriction(0.40), np.full(8, math.radians(33.0)), 0.03)
    bandage = Bandage(45.0, ConstantFriction(0.22), preload)
    brake = Brake(Pulley(0.59, 900.0), Band(0.64, stiffness), linings, bandage)
    return Scene(brake, Duty(lever, TorqueLoad(Constant(load))), Initial(20.0), end)


def staged_cases() -> list[Case]:
    """T_on, the lock and the stop in stage 3 of an elastic staged brake under a rising lever."""
    scene = _staged(PiecewiseLinear([0.0, 7.5], [200.0, 30200.0]), 300.0, 3e5, 900.0, 4.0)

    def tension(result: Result) -> float:
        return result.series([float(result.internal_slip_time)]).slack_tension[0]

    return frozen_cases(
        "staged stop",
        scene,
        {
            "internal slip": "internal_slip_time",
            "tension at internal slip": tension,
            "external lock": "external_lock_time",
            "stopping time": "stopping_time",
        },
        {
            "∂(stopping time)/∂f_i": "brake.bandage.friction.coefficient",
            "∂(stopping time)/∂N_p": "brake.bandage.preload",
        },
    )


def chain_cases() -> list[Case]:
    """One lining with a mass between the pulley and a band with a spring and a damper."""
    band = Band(0.9, 5.0, Segments(1e3, 0.05, 0.03))
    brake = Brake(Pulley(0.9, 0.5), band, Lining(ConstantFriction(0.3), np.full(1, math.radians(27.0)), mass=0.05))
    scene = Scene(brake, Duty(Constant(1.0), TorqueLoad()), Initial(0.6, 0.2), 2.0)
    return frozen_cases(
        "chain of one lining",
        scene,
        {
            "first slip": time_of("lining_slip", 1),
            "first stick": time_of("lining_stick", 1),
            "speed at the end": "record.y_end.omega",
        },
        {"∂(speed)/∂C": "brake.band.stiffness"},
        of=lambda result: result.record.y_end.omega,
    )


def band_cases() -> list[Case]:
    """Two bands of unequal linings under one lever."""
    angles = np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6])
    friction = np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28)
    bands = tuple(
        LinedBand(Lining(ConstantFriction(f), angle), C)
        for f, angle, C in zip(friction, angles, (2e5, 3.5e5), strict=True)
    )
    brake = MultiBandBrake(Pulley(0.59, 1200.0), 0.623, bands)
    scene = Scene(brake, Duty(Constant(6e3), TorqueLoad(Constant(3e3))), Initial(20.0), 6.0)
    return frozen_cases(
        "several bands",
        scene,
        {"stopping time": "stopping_time", "share of the first band": lambda _: tension_shares(brake)[0]},
        {"∂(stopping time)/∂C_1": "brake.bands.0.stiffness"},
    )


def rope_cases() -> list[Case]:
    """A stop of a hook on an elastic rope, and the swing after it."""
    load = HookLoad(40e3, 0.4, 8.0, elasticity=RopeElasticity(4e6, 0.0))  # pyright: ignore
    return frozen_cases(
        "elastic rope",
        stop_scene(C=None, J=1200.0, T0=25e3, w0=8.0, load=load, end=2.0),
        {"stopping time": "stopping_time", "greatest hook load": "max_hook_load.value"},
        {"∂(stopping time)/∂k": "duty.load.elasticity.stiffness"},
    )


def phase_cases() -> list[Case]:
    """Two cycles of lowering by 12 m, a stop, 4 s of holding and 2 s out of the slips."""
    linings = uniform_linings(20, math.radians(270.0), ConstantFriction(0.35))
    brake = Brake(Pulley(0.59, 1200.0), Band(0.623), linings)
    course = (
        Phase(Constant(0.0), "travel 12 m", "lower"),
        Phase(ramp(0.0, 25e3, 0.0, 0.5), "rest", "brake"),
        Phase(Constant(25e3), "4 s", "hold"),
        Phase(Constant(25e3), "2 s", "slips", hangs=False),
    )
    load = StringLoad(5e3, 40e3, 0.4, 8, 2e3)  # pyright: ignore
    scene = Scene(brake, Duty(Phases(course, count=2), load), Initial(0.0), 60.0)

    def ended(k: int):
        return lambda result: [e.time for e in result.events if e.name == "phase_end"][k]

    return frozen_cases(
        "phases by state",
        scene,
        {"first fall ends": ended(0), "first stop": ended(1), "second fall ends": ended(4), "end": "record.t_end"},
        {"∂(end)/∂s": "duty.slack_tension.phases.0.until.distance"},
        of=lambda result: result.record.t_end,
    )


def retarder_cases() -> list[Case]:
    """A hydrodynamic brake and viscous drag slow a pulley down; the band is open."""
    k, c, low = 14.0, 60.0, 4.0
    time = 800.0 / c * math.log(20.0 * (k * low + c) / (low * (k * 20.0 + c)))
    scene = stop_scene(C=None, T0=0.0, end=time)
    scene = Scene(
        scene.brake,
        scene.duty,
        scene.initial,
        time,
        shaft=(HydrodynamicBrake(k), ViscousDrag(c)),  # pyright: ignore
    )
    return frozen_cases(
        "retarders on the shaft",
        scene,
        {"speed": "record.y_end.omega"},
        {"∂(speed)/∂k": "shaft.0.coefficient"},
        of=lambda result: result.record.y_end.omega,
    )


def fall_cases() -> list[Case]:
    """Free fall of a hook, its inertia that of the pulley, and a brake applied after 0.8 s."""
    gain = 0.725 * (_ratio(0.25, 15.0) ** 14 - 1)
    lever = points([0.0, 0.0, 6e4 / gain], [0.0, 0.8, 0.8])
    scene = scene_of(lever, 60e3 * 0.4 / 8 * 9.80665, n=14, beta=15.0, f=0.25, C=None, J=1350.0, w0=0.0, end=3.0)
    reads = {
        "greatest speed": lambda result: result.series([0.8]).omega[0],
        "stopping time": "stopping_time",
        "friction heat": "energy.friction_heat",
    }
    return frozen_cases("free fall, then brake", scene, reads)


def _ratio(f: float, degrees: float) -> float:
    z = math.tan(math.radians(degrees) / 2)
    return (1 + f * z) / (1 - f * z)


def travel_cases() -> list[Case]:
    """Linings carried round by the rim while they are braked: two thirds of a turn after a whole one."""
    lever = PiecewiseLinear([0.0, 7.5], [2e3, 2e3])
    scene = _staged(lever, 300.0, None, 1e5, 3.0)

    def depth(lining: int):
        return lambda result: ring_wear(result, 11, 2e-14).depth[lining]

    return frozen_cases(
        "linings that travel", scene, {"lining 1": depth(0), "lining 6": depth(5), "travel": "stopping_angle"}
    )


CASES = (*(staged_cases, chain_cases, band_cases, rope_cases, phase_cases, retarder_cases, fall_cases, travel_cases),)
