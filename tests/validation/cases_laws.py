"""Validation of laws along a stop: friction over speed, memory, oil, wear."""

import dataclasses

from case_tools import EXPLICIT, STIFF, Slope, cases_with_slopes, rows_of
from oracles import laws
from scenes import stop_scene

from simbrake import (
    ConstantFriction,
    DiscBrake,
    ForceDuty,
    Initial,
    Pads,
    PiecewiseLinear,
    Scene,
    StribeckFriction,
    Wear,
    lumped_heat,
    with_values,
)
from simbrake.friction import (
    ChangingFriction,
    FrictionChange,
    FrictionWithMemory,
    MemoryProcess,
)
from simbrake.thermal import ROOM
from simbrake.wear import LinearWear

_LAW = "brake.linings.friction"


def _stop(law):
    """A stop of four linings of 50° on a rigid band under a constant lever."""
    return stop_scene(n=4, beta=50.0, law=law, C=None, end=3.0)


def _oiled(law, factor):
    """A law of which oil lowers the coefficient of linings 2 and 3 from 0.5 s on."""
    return ChangingFriction(
        law, (FrictionChange(PiecewiseLinear([0.5, 0.5], [1.0, factor]), [2, 3]),)
    )


def stribeck_cases():
    """Friction over the slip speed: Stribeck's curve."""
    reads = {
        "stopping time": "stopping_time",
        "angle": "stopping_angle",
        "∂(stopping time)/∂v_s": Slope(f"{_LAW}.base.stribeck_speed"),
        "∂(stopping time)/∂δ": Slope(f"{_LAW}.base.exponent"),
    }
    scene = _stop(_oiled(StribeckFriction(0.45, 0.30, 3.0, 1.5), 1.0))
    rows = rows_of(laws.stribeck_friction, reads)
    return cases_with_slopes(
        "Stribeck friction", scene, rows, program="oiled linings", solver=EXPLICIT
    )


def oil_cases():
    """Friction that oil changes on two linings."""
    reads = {
        "stopping time": "stopping_time",
        "∂(stopping time)/∂t_1": Slope(f"{_LAW}.changes.0.factor.times"),
        "∂(stopping time)/∂φ": Slope(f"{_LAW}.changes.0.factor.values.1"),
    }
    scene = _stop(_oiled(StribeckFriction(0.35, 0.35, 3.0, 1.5), 0.4))
    return cases_with_slopes(
        "oiled linings", scene, rows_of(laws.changing_friction, reads), solver=EXPLICIT
    )


def memory_cases():
    """Friction with a history."""
    law = FrictionWithMemory(
        ConstantFriction(0.4),
        (MemoryProcess(0.5, rate=0.4), MemoryProcess(1.2, work=2e6)),
        0.9,
    )
    brake = DiscBrake(900.0, Pads(law, 0.5, 0.6, 1.0, 3))
    reads = {
        "stopping time": "stopping_time",
        "factor at rest": lambda run: run.series(
            [float(run.stopping_time)]
        ).friction_memory[0, 0],
        "∂(stopping time)/∂k": Slope(f"{_LAW}.processes.0.rate"),
        "∂(stopping time)/∂w_0": Slope(f"{_LAW}.processes.1.work"),
    }
    scene = Scene(brake, ForceDuty(3e4, 0.0), Initial(20.0), 1.5)
    rows = rows_of(laws.friction_with_memory, reads)
    return cases_with_slopes("friction with memory", scene, rows, solver=EXPLICIT)


def wear_cases():
    """Wear of the linings, its rate rising with the temperature of the rim."""
    scene = with_values(_stop(ConstantFriction(0.35)), {"brake.linings.area": 0.03})
    heat = lumped_heat(rim=2e4, partition=1.0, rim_cooling=0.0)
    scene = dataclasses.replace(
        scene, heat=heat, wear=Wear(LinearWear(2e-14, 5e-3, ROOM))
    )
    reads = {
        "lining 1": "worn_thickness.0",
        "lining 4": "worn_thickness.3",
        "∂(lining 4)/∂s": Slope("wear.rate.slope"),
    }
    rows = rows_of(laws.wear_of_linings, reads)
    return cases_with_slopes(
        "wear of linings", scene, rows, lambda run: run.worn_thickness[3], solver=STIFF
    )


CASES = (
    stribeck_cases,
    oil_cases,
    memory_cases,
    wear_cases,
)
