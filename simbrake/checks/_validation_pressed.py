"""Validation of disc and double-shoe brakes: stops, torques, holds and heat with an answer in closed form."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import quad

from .._parts._scene import ForceDuty, Initial, Scene
from .._run._result import Result
from .._run._simulate import simulate
from ..brakes._design import AbstractBrake
from ..brakes._pressed import AbstractPadPressure, DiscBrake, Pads, ShoeBrake, Shoes, UniformPressure, UniformWear
from ..friction import ConstantFriction
from ..loads import TorqueLoad
from ..profiles import Constant, PiecewiseLinear, Repeated
from ..thermal._heat import ConstantPartition, FrictionHeat, Heat
from ..thermal._network import Conductance, Lump, Reservoir
from ._validation import Case

_FORM = "closed form: "
_SHIGLEY = "Budynas & Nisbett, Shigley's Mechanical Engineering Design"

# pads of the cases: friction, radii (m), angle (rad), number
_F, _R_I, _R_O, _ANGLE, _N = 0.4, 0.30, 0.50, 0.7, 4


def disc(pressure: AbstractPadPressure, inertia: float = 400.0, f: Any = _F, ratio: float = 1.25) -> DiscBrake:
    """The disc brake of the cases."""
    return DiscBrake(inertia, Pads(ConstantFriction(f, ratio), _R_I, _R_O, _ANGLE, _N, pressure))


def drum(f: Any = 0.32, inertia: float = 12.0, ratio: float = 1.0) -> ShoeBrake:
    """The double-shoe brake of the cases: drum 300 mm, linings 32 mm wide from 0 to 126°, pins at 122.7 mm."""
    shoes = Shoes(ConstantFriction(f, ratio), 0.150, 0.032, 0.0, math.radians(126.0))
    return ShoeBrake(inertia, shoes, 0.1227, 0.212)


def stop_of(
    brake: AbstractBrake, force: float, omega: float, load: float = 0.0, end: float = 10.0, heat: Any = None
) -> Scene:
    """A stop under a constant force and load."""
    duty = ForceDuty(Constant(force), TorqueLoad(Constant(load)))
    return Scene(brake, duty, Initial(omega), end, heat)


def _ran(scene: Callable[[], Scene]) -> Callable[[], Result]:
    return functools.cache(lambda: simulate(scene(), rtol=1e-12))


def disc_cases() -> list[Case]:
    """A stop against a load with either distribution of pressure, and how long a held disc holds."""
    F, load, J, w0 = 20e3, 1500.0, 400.0, 30.0
    mean, cubes = 0.5 * (_R_I + _R_O), 2 / 3 * (_R_O**3 - _R_I**3) / (_R_O**2 - _R_I**2)
    worn = _ran(lambda: stop_of(disc(UniformWear()), F, w0, load))
    new = _ran(lambda: stop_of(disc(UniformPressure()), F, w0, load))
    torque = _N * _F * F * mean
    time = J * w0 / (torque - load)

    def ramped() -> Scene:
        duty = ForceDuty(Constant(F), TorqueLoad(PiecewiseLinear([0.0, 10.0], [0.0, 3 * torque])))
        return Scene(disc(UniformWear()), duty, Initial(0.0), 9.0)

    held = _ran(ramped)
    return [
        Case(
            "disc brake/stopping time, uniform wear",
            f"{_FORM}J ω_0/(n f F r_e − M), r_e = (r_o + r_i)/2",
            time,
            1e-11,
            lambda: worn().stopping_time,
        ),
        Case(
            "disc brake/stopping time, uniform pressure",
            f"{_FORM}the same, r_e = ⅔ (r_o³ − r_i³)/(r_o² − r_i²)",
            J * w0 / (_N * _F * F * cubes - load),
            1e-11,
            lambda: new().stopping_time,
        ),
        Case(
            "disc brake/friction heat",
            f"{_FORM}n f F r_e ω_0 t/2",
            torque * w0 * time / 2,
            1e-11,
            lambda: worn().energy["friction_heat"],
        ),
        Case(
            "disc brake/restart",
            f"{_FORM}where M(t) = n f_s F r_e",
            10.0 * 1.25 / 3,
            1e-11,
            lambda: next(event.time for event in held().events if event.name == "restart"),
        ),
    ]


def calliper_case() -> list[Case]:
    """32.5 kg·m² from 250 rpm, all heat into a solid disc of 150 × 6 mm, 7800 kg/m³, 450 J/(kg·K)."""
    J, w0 = 32.5, 250 * math.pi / 30
    capacity = 7800 * 450 * math.pi / 4 * 0.150**2 * 0.006
    heat = Heat(
        (Lump("disc", capacity, 293.15), Reservoir("air", 293.15)),
        (Conductance("disc", "air", 0.0),),
        FrictionHeat("disc", None, ConstantPartition(1.0)),
        rim="disc",
    )
    run = _ran(lambda: stop_of(disc(UniformWear(), J), 1e3, w0, end=4.0, heat=heat))
    energy, source = 0.5 * J * w0**2, f"{_SHIGLEY}, calliper brake"
    return [
        Case(
            "calliper/friction heat",
            f"{source}: J ω_0²/2",
            energy,
            1e-11,
            lambda: run().energy["friction_heat"],
        ),
        Case(
            "calliper/rise of the disc",
            f"{source}: E/(m c)",
            energy / capacity,
            1e-9,
            lambda: run().end_temperatures[0] - 293.15,
        ),
    ]


#: 15 snubs after UN R13, Type-I: speeds (m/s), deceleration (m/s²), period (s), mass (kg), capacity (J/K), share, 1/s
_FAST, _SLOW, _BRAKED, _PERIOD, _MASS, _CAPACITY, _SHARE, _COOLING = (
    120 / 3.6,
    60 / 3.6,
    3.0,
    45.0,
    400.0,
    3500.0,
    0.95,
    1 / 900,
)


def snub_rise(count: int) -> float:
    """Rise (K) at the end of snub `count`: heat falls in linearly with time, all of it decays with `exp(−b t)`.

    One snub of the length `τ` from `v_1`, `P(t) = s m a (v_1 − a t)`: `∫ P(t) e^{−b (τ − t)} dt/C`; the snubs add up.
    """
    b, tau = _COOLING, (_FAST - _SLOW) / _BRAKED
    given = _SHARE * _MASS * _BRAKED / _CAPACITY
    fall = math.exp(-b * tau)
    one = given * (_FAST * (1 - fall) / b - _BRAKED * (tau / b - (1 - fall) / b**2))
    return one * sum(math.exp(-b * _PERIOD * k) for k in range(count))


def snub_cases() -> list[Case]:
    """Fade test of a car's disc brake: 15 snubs from 120 to 60 km/h every 45 s."""
    tau, wheel = (_FAST - _SLOW) / _BRAKED, 0.3
    J, torque = _MASS * wheel**2, _MASS * _BRAKED * wheel

    def scene() -> Scene:
        brake = disc(UniformWear(), J)
        force = torque / (_N * _F * 0.5 * (_R_I + _R_O))
        times = [0.0, tau, tau, _PERIOD]
        again = J * (_FAST - _SLOW) / wheel / (_PERIOD - tau)  # torque that brings the speed back
        duty = ForceDuty(
            Repeated(times, [force, force, 0.0, 0.0], _PERIOD, 15),
            TorqueLoad(Repeated(times, [0.0, 0.0, again, again], _PERIOD, 15)),
        )
        heat = Heat(
            (Lump("disc", _CAPACITY, 293.15), Reservoir("air", 293.15)),
            (Conductance("disc", "air", _CAPACITY * _COOLING),),
            FrictionHeat("disc", None, ConstantPartition(_SHARE)),
            rim="disc",
        )
        return Scene(brake, duty, Initial(_FAST / wheel), 15 * _PERIOD, heat)

    run = _ran(scene)

    def rise(count: int) -> float:
        return float(run().series([(count - 1) * _PERIOD + tau]).temperature[0, 0]) - 293.15  # pyright: ignore

    how = "UN R13 Type-I; closed form: Σ ∫ s P e^(−b (t_e − t)) dt/C"
    return [Case(f"snubs/rise after {k}", how, snub_rise(k), 1e-9, functools.partial(rise, k)) for k in (1, 5, 15)]


def shoe_moments(f: float) -> tuple[float, float, float]:
    """`M_N`, `M_F` and `M` (N·m) of a shoe of the cases under a greatest pressure of 1 MPa, by quadrature."""
    p, b, r, a, end = 1e6, 0.032, 0.150, 0.1227, math.radians(126.0)

    def over(function: Callable[[float], float]) -> float:
        return quad(function, 0.0, end, epsabs=0.0, epsrel=1e-13)[0]

    normal = p * b * r * a * over(lambda x: math.sin(x) ** 2)
    friction = f * p * b * r * over(lambda x: math.sin(x) * (r - a * math.cos(x)))
    return normal, friction, f * p * b * r**2 * over(math.sin)


def shoe_cases() -> list[Case]:
    """Shigley's internal expanding shoes under the force that gives the leading one 1 MPa, in both directions."""
    f, J, w0 = 0.32, 12.0, 25.0
    M_N, M_F, leading = shoe_moments(f)
    force = (M_N - M_F) / 0.212
    trailing = leading * (M_N - M_F) / (M_N + M_F)
    time = J * w0 / (leading + trailing)
    ahead = _ran(lambda: stop_of(drum(), force, w0))
    back = _ran(lambda: stop_of(drum(), force, -w0))

    def friction(which: int) -> float:
        return 0.150 * float(np.asarray(ahead().series([0.1]).friction_force)[0, which])

    source = f"{_SHIGLEY}, internal expanding shoes; moments by quadrature"
    return [
        Case(
            "double shoe/torque of the leading shoe",
            f"{source}: f p b r² ∫ sin θ dθ",
            leading,
            1e-11,
            lambda: friction(0),
        ),
        Case(
            "double shoe/torque of the trailing shoe",
            f"{source}: M (M_N − M_F)/(M_N + M_F)",
            trailing,
            1e-11,
            lambda: friction(1),
        ),
        Case("double shoe/stopping time", f"{source}: J ω_0/(M_1 + M_2)", time, 1e-11, lambda: ahead().stopping_time),
        Case("double shoe/stopping time backwards", "the same", time, 1e-11, lambda: back().stopping_time),
        Case(
            "double shoe/greatest pressure",
            f"{source}: 1 MPa was given",
            1e6,
            1e-11,
            lambda: drum().greatest_pressure(ahead().metrics["max_normal_load"]),
        ),
        Case(
            "double shoe/friction that locks",
            f"{source}: M_N = M_F",
            f * M_N / M_F,
            1e-11,
            lambda: 1 / drum().self_locking(np.ones(2))[0],
        ),
    ]


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return disc_cases() + calliper_case() + snub_cases() + shoe_cases()
