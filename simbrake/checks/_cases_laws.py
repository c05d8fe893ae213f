"""Validation of laws along a stop: friction over speed, memory, changes, wear.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

from typing import Any

from diffrax import Tsit5

from .._parts._scene import ForceDuty, Initial, Scene
from .._run._edit import with_values
from .._run._result import Result
from ..brakes._pressed import DiscBrake, Pads
from ..friction import (
    AbstractFriction,
    ChangingFriction,
    ConstantFriction,
    FrictionChange,
    FrictionWithMemory,
    MemoryProcess,
    StribeckFriction,
)
from ..hybrid import Rodas5P
from ..loads import TorqueLoad
from ..profiles import Constant, PiecewiseLinear
from ..thermal._builders import lumped_heat
from ..thermal._heat import ConstantPartition, Heat
from ..thermal._material import ROOM
from ..wear import LinearWear, Wear
from ._cases_band import stop_scene
from ._validation import Case, frozen_cases

_N = 4
_LAW = "brake.linings.friction"


def _stop(law: AbstractFriction, heat: Heat | None = None, end: float = 3.0, **parts: Any) -> Scene:
    """A stop of four linings of 50° under a constant lever, the band rigid where no stiffness `C` is given."""
    scene = stop_scene(n=_N, beta=50.0, law=law, end=end, **{"C": None, **parts})
    return Scene(scene.brake, scene.duty, scene.initial, end, heat)


def _rim(capacity: float) -> Heat:
    """All heat into one insulated lump, of which the friction takes its temperature."""
    return lumped_heat(rim=capacity, partition=ConstantPartition(1.0), rim_cooling=0.0)


def _oiled(law: AbstractFriction, factor: float) -> ChangingFriction:
    """A law of which oil lowers the coefficient of linings 2 and 3 from 0.5 s on."""
    return ChangingFriction(law, (FrictionChange(PiecewiseLinear([0.5, 0.5], [1.0, factor]), [2, 3]),))


def speed_cases() -> list[Case]:
    """Friction over the slip speed: Stribeck's curve."""
    return frozen_cases(
        "Stribeck friction",
        _stop(_oiled(StribeckFriction(0.45, 0.30, 3.0, 1.5), 1.0)),
        {"stopping time": "stopping_time", "angle": "stopping_angle"},
        {"∂(stopping time)/∂v_s": f"{_LAW}.base.stribeck_speed", "∂(stopping time)/∂δ": f"{_LAW}.base.exponent"},
        program="oiled linings",
        solver=Tsit5(),
    )


def changing_cases() -> list[Case]:
    """Friction with a history, and friction that oil changes."""
    law = FrictionWithMemory(ConstantFriction(0.4), (MemoryProcess(0.5, rate=0.4), MemoryProcess(1.2, work=2e6)), 0.9)
    pads = DiscBrake(900.0, Pads(law, 0.5, 0.6, 1.0, 3))
    pressed = Scene(pads, ForceDuty(Constant(3e4), TorqueLoad(Constant(0.0))), Initial(20.0), 1.5)

    def factor(result: Result):
        return result.series([float(result.stopping_time)]).friction_memory[0, 0]

    return [
        *frozen_cases(
            "friction with memory",
            pressed,
            {"stopping time": "stopping_time", "factor at rest": factor},
            {
                "∂(stopping time)/∂k": "brake.linings.friction.processes.0.rate",
                "∂(stopping time)/∂w_0": "brake.linings.friction.processes.1.work",
            },
            solver=Tsit5(),
        ),
        *frozen_cases(
            "oiled linings",
            _stop(_oiled(StribeckFriction(0.35, 0.35, 3.0, 1.5), 0.4)),
            {"stopping time": "stopping_time"},
            {
                "∂(stopping time)/∂t_1": f"{_LAW}.changes.0.factor.times",
                "∂(stopping time)/∂φ": f"{_LAW}.changes.0.factor.values.1",
            },
            solver=Tsit5(),
        ),
    ]


def wear_cases() -> list[Case]:
    """Wear of the linings of a stop, its rate rising with the temperature of the rim."""
    scene = with_values(_stop(ConstantFriction(0.35)), {"brake.linings.area": 0.03})
    wear = Wear(LinearWear(2e-14, 5e-3, ROOM))
    scene = Scene(scene.brake, scene.duty, scene.initial, scene.end_time, _rim(2e4), wear=wear)
    return frozen_cases(
        "wear of linings",
        scene,
        {"lining 1": "worn_thickness.0", "lining 4": "worn_thickness.3"},
        {"∂(lining 4)/∂s": "wear.rate.slope"},
        of=lambda result: result.worn_thickness[3],
        solver=Rodas5P(),  # (the only derivative through it here)
    )


CASES = (speed_cases, changing_cases, wear_cases)
