"""Validation of mechanisms: staged brake, chain, bands, rope, phases, retarders, linings by themselves and floating.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

import math

import numpy as np
from diffrax import Tsit5

from .._base._compiling import DeviceJit
from .._parts._scene import Duty, Initial, Scene
from ..brakes._bands import LinedBand, MultiBandBrake
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley, Segments, tension_shares, uniform_linings
from ..friction import ConstantFriction
from ..loads import HookLoad, Phase, Phases, RopeElasticity, StringLoad, TorqueLoad
from ..profiles import Constant, PiecewiseLinear, ramp
from ._cases_band import stop_scene, time_of
from ._validation import Case, frozen_cases

_shares = DeviceJit(tension_shares, quick=True)


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
        solver=Tsit5(),
    )


def spring_cases() -> list[Case]:
    """Two linings of a staged brake that move by themselves, with a spring between them (resolved bandage)."""
    bandage = Bandage(
        [1.2, 1.5],
        ConstantFriction(0.2),
        [1500.0, 900.0],
        spring=np.array([2e3]),
        spring_damping=0.05,  # pyright: ignore
    )
    linings = Lining(ConstantFriction(0.4), np.full(2, math.radians(50.0)))
    lever = PiecewiseLinear([0.0, 0.3], [100.0, 6e3])
    brake = Brake(Pulley(0.59, 200.0), Band(0.64), linings, bandage)
    scene = Scene(brake, Duty(lever, TorqueLoad()), Initial(20.0), 8.0)
    return frozen_cases(
        "linings on springs",
        scene,
        {
            "lining 1 slips": time_of("lining_internal_slip", 1),
            "lining 2 slips": time_of("lining_internal_slip", 2),
            "lining 1 rests on the band": time_of("lining_external_stick", 1),
            "lining 2 rests on the band": time_of("lining_external_stick", 2),
            "stopping time": "stopping_time",
            "elongation at rest": "record.y_end.own.stretch.0",
        },
        solver=Tsit5(),
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
        {"stopping time": "stopping_time", "share of the first band": lambda _: _shares(brake)[0]},
        solver=Tsit5(),
    )


def rope_cases() -> list[Case]:
    """A stop of a hook on an elastic rope, and the swing after it."""
    load = HookLoad(40e3, 0.4, 8.0, elasticity=RopeElasticity(4e6, 0.0))  # pyright: ignore
    return frozen_cases(
        "elastic rope",
        stop_scene(C=None, J=1200.0, T0=25e3, w0=8.0, load=load, end=2.0),
        {"stopping time": "stopping_time", "greatest hook load": "max_hook_load.value"},
        solver=Tsit5(),
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
        solver=Tsit5(),
    )


CASES = (
    chain_cases,
    spring_cases,
    band_cases,
    rope_cases,
    phase_cases,
)
