"""The subjects of the self-test: a scene or system each, and what is read from its run. Truths are in `truths.csv`."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax
import numpy as np
from diffrax import Tsit5
from jaxtyping import Float

from .._base._compiling import DeviceJit
from .._parts._scene import Duty, ForceDuty, Initial, Scene
from .._run._edit import with_values
from .._run._networks import simulate_heat
from .._run._result import Result
from .._run._simulate import prepare, simulate
from .._run._stepper import Stepper
from ..brakes._bands import LinedBand, MultiBandBrake
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley, Segments, tension_shares, uniform_linings
from ..brakes._pressed import DiscBrake, Pads, ShoeBrake, Shoes, UniformPressure, UniformWear
from ..friction import (
    AbstractFriction,
    ChangingFriction,
    ConstantFriction,
    FrictionChange,
    FrictionWithMemory,
    LinearFade,
    MemoryProcess,
    ProductFriction,
    StribeckFriction,
)
from ..hybrid import Rodas5P
from ..hybrid._arrays import Array
from ..loads import AbstractLoad, HookLoad, Phase, Phases, RopeElasticity, StringLoad, TorqueLoad
from ..profiles import AbstractProfile, Constant, ExponentialRise, PiecewiseLinear, ramp
from ..rope import RopeLayers
from ..shaft import BearingFriction
from ..thermal._builders import lumped_heat
from ..thermal._heat import ConstantPartition, Heat
from ..thermal._material import ROOM, Material
from ..thermal._network import Conductance, Lump, Source, Wall
from ..wear import LinearWear, Wear
from ._systems import belt_cases, stiff_cases
from ._validation import Case, cases_of, cases_of_run

Values: TypeAlias = float | Sequence[float] | np.ndarray

# --- stops of a band brake --------------------------------------------------------------------------------------------


def ratio(n: int = 20, f: float = 0.35, beta: float = 13.5) -> float:
    """Tension of the tight end over that of the slack end of `n` sliding linings of `beta` degrees."""
    fz = f * math.tan(beta * math.pi / 180 / 2)
    return ((1 + fz) / (1 - fz)) ** n


def stop_scene(
    n: int = 20,
    f: float = 0.35,
    beta: float = 13.5,
    R: float = 0.725,
    J: float = 800.0,
    C: float | None = 2e5,
    T0: float = 8e3,
    w0: float = 20.0,
    load: float | AbstractLoad = 0.0,
    end: float = 5.0,
    law: AbstractFriction | None = None,
    lever: AbstractProfile | None = None,
) -> Scene:
    """A stop with constant slack tension on `n` linings of `beta` degrees.

    `C`: stiffness, `None` for a rigid band; `law`: friction in place of `f`; `lever`: profile in place of `T0`; `load`:
    a torque, or a load.
    """
    lining = Lining(law if law is not None else ConstantFriction(f), np.full(n, math.radians(beta)))
    force = lever if lever is not None else Constant(T0)
    duty = Duty(force, load if isinstance(load, AbstractLoad) else TorqueLoad(Constant(load)))
    return Scene(Brake(Pulley(R, J), Band(R, C), lining), duty, Initial(omega=w0), end)


def points(values: Values, times: Values = 0.0, count: int = 6) -> PiecewiseLinear:
    """A profile of `count` points, a constant by itself: scenes of one structure share their compiled program."""
    values, times = np.atleast_1d(np.asarray(values, float)), np.atleast_1d(np.asarray(times, float))
    more = count - len(values)
    later = np.linspace(1e6, 2e6, more)  # after the end of every run
    return PiecewiseLinear(np.append(times, later), np.append(values, np.full(more, values[-1])))


def scene_of(lever: Values | PiecewiseLinear, load: Values | PiecewiseLinear = 0.0, **parts: Any) -> Scene:
    """`stop_scene` under a lever and a load of six points each."""
    lever, load = (x if isinstance(x, PiecewiseLinear) else points(x) for x in (lever, load))
    return stop_scene(lever=lever, load=TorqueLoad(load), **parts)


def time_of(name: str, lining: int | None = None) -> Callable[[Result], float]:
    """The time of the first such event in a run."""
    return lambda r: next(e.time for e in r.events if e.name == name and e.lining == lining)


def elastic_stop(load: float = 0.0, w0: float = 20.0, end: float = 5.0) -> Scene:
    return scene_of(8e3, load, n=10, beta=27.0, w0=w0, end=end)


def elastic_cases() -> list[Case]:
    """Every event of a stop with an elastic band."""
    reads = {
        "slip onset": "slip_onset_time",
        "limit of lining 5": time_of("lining_limit", 5),
        "full slip": "full_slip_time",
        "stopping time": "stopping_time",
        "maximum tension": "metrics.max_tension",
    }
    return cases_of_run("elastic stop", elastic_stop(), reads, solver=Tsit5())


def gradient_cases() -> list[Case]:
    """Derivatives of the stopping time by reverse mode."""

    def stopping_time(scene: Scene) -> Array:
        return simulate(scene, rtol=1e-12, max_steps=256, solver=Tsit5()).stopping_time

    def run() -> Scene:
        program = DeviceJit(jax.grad(stopping_time), subject=("validation", "elastic stop, slopes"), quick=True)
        return program(jax.tree.map(np.asarray, elastic_stop()))

    places = {
        "f": "brake.linings.friction.coefficient",
        "beta": lambda slopes: np.sum(slopes.brake.linings.angle) * math.pi / 180,
        "R": "brake.band.radius",
        "J": "brake.pulley.inertia",
        "C": "brake.band.stiffness",
        "T0": lambda slopes: np.sum(slopes.duty.slack_tension.values),
        "w0": "initial.omega",
    }
    return cases_of("elastic stop", run, {f"∂(stopping time)/∂{name}": place for name, place in places.items()})


def hook_cases() -> list[Case]:
    """A hook of 60 t on eight lines, braked by 60 kN·m through one lining."""
    load = HookLoad(mass=60e3, drum_radius=0.4, line_count=8, gravity=9.81)  # pyright: ignore
    T_0 = 60e3 / (0.6 * (ratio(1, 0.3, 30.0) - 1))
    scene = stop_scene(n=1, f=0.3, beta=30.0, R=0.6, J=1200.0, C=None, T0=T_0, w0=24.0, load=load, end=3.0)
    run = functools.cache(lambda: simulate(scene, rtol=1e-12))

    def of_tensions(result: Result) -> Array:
        s = result.series([0.5])
        return s.tight_tension[0] / s.slack_tension[0]

    reads = {"stopping time": "stopping_time", "travel": "hook_travel", "friction heat": "energy.friction_heat"}
    return cases_of("hook load", run, reads) + cases_of("one lining", run, {"tension ratio": of_tensions})


def rigid_cases() -> list[Case]:
    """Rigid bands: a brake applied at a given time, rotation the other way, a load that grows past the capacity."""
    n, f, beta = 14, 0.25, 15.0
    parts: dict[str, Any] = {"n": n, "beta": beta, "f": f, "C": None}
    late = points([0.0, 0.0, 1.0 / (ratio(n, f, beta) - 1)], [0.0, 0.1, 0.1])
    slider = scene_of(late, R=1.0, J=1.0, w0=1.0, end=2.0, **parts)
    load = points([0.0, 12e3], [0.0, 12.0])
    rise = ExponentialRise(800 * 20 / 4.0 / (0.725 * (ratio(n, f, beta) - 1)), 0.5)
    stops = {"stopping time": "stopping_time"}
    return [
        *cases_of_run("brake on a slider", slider, {"stop": "stopping_time", "way": "stopping_angle"}),
        *cases_of_run("turning back", scene_of(8e3, w0=-20.0, end=15.0, **parts), stops),
        *cases_of_run("growing load", scene_of(8e3, load, w0=0.0, end=12.0, **parts), {"restart": time_of("restart")}),
        *cases_of_run("exponential rise", stop_scene(lever=rise, end=8.0, **parts), stops),
    ]


# --- the staged brake, and holding ------------------------------------------------------------------------------------


def staged_pair(torques: Values, times: Values = 0.0, w0: float = 20.0, end: float = 3.0) -> Scene:
    """A pulley of 40 and a bandage of 4 kg·m² joined by an internal pair of 600 N·m under a torque of the band.

    The capacity comes from preload alone: a coefficient so small that the tensions add nothing to it. The lever has
    four points, so that these scenes share one program.
    """
    n, f, beta, small = 4, 0.5, 60.0, 1e-14
    bandage = Bandage(4.0, ConstantFriction(small), 600.0 / (n * small))
    lining = Lining(ConstantFriction(f), np.full(n, math.radians(beta)))
    torque = points(torques, times, 4)
    lever = PiecewiseLinear(torque.times, np.asarray(torque.values) / (ratio(n, f, beta) - 1))
    return Scene(Brake(Pulley(1.0, 40.0), Band(1.0), lining, bandage), Duty(lever, TorqueLoad()), Initial(w0), end)


def pair_cases() -> list[Case]:
    """Internal slip, external lock and stop under a torque that grows by 500 N·m a second."""
    reads = {
        "internal slip": "internal_slip_time",
        "external lock": "external_lock_time",
        "speed at the lock": lambda result: result.series([float(result.external_lock_time)]).omega[0],
        "stopping time": "stopping_time",
        "internal heat": "energy.heat_internal",
        "external heat": "energy.heat_external",
    }
    return cases_of_run("staged pair", staged_pair([0.0, 5e3], [0.0, 10.0]), reads, solver=Tsit5())


def hold_cases() -> list[Case]:
    """An hour of holding: half of the capacity, just below it, and by a staged brake; nothing moves at all."""

    def moved(result: Result) -> float:
        s = result.series(np.linspace(0.0, 3600.0, 25))
        other = s.omega if s.bandage_speed is None else np.asarray(s.bandage_speed)
        return float(np.max(np.abs(s.phi)) + np.max(np.abs(other)))

    capacity = 0.725 * 8e3 * (ratio(10, beta=27.0) - 1)
    cases = []
    for subject, what, scene in (
        ("held 3600 s", "half of the capacity", elastic_stop(0.5 * capacity, 0.0, 3600.0)),
        ("held 3600 s", "capacity less 1e-12", elastic_stop((1 - 1e-12) * capacity, 0.0, 3600.0)),
        ("staged brake held 3600 s", "movement", staged_pair(500.0, w0=0.0, end=3600.0)),
    ):
        cases += cases_of_run(subject, scene, {what: moved}, solver=Tsit5())
    return cases


# --- discs, drums, torques on the shaft, layers of rope ---------------------------------------------------------------


def disc_cases() -> list[Case]:
    """A stop against a load with either distribution of pressure, and holding time of a held disc."""

    def scene(pressure: Any, w0: float, load: Sequence[float], end: float) -> Scene:
        brake = DiscBrake(400.0, Pads(ConstantFriction(0.4, 1.25), 0.30, 0.50, 0.7, 4, pressure))
        return Scene(brake, ForceDuty(Constant(20e3), TorqueLoad(PiecewiseLinear([0.0, 10.0], load))), Initial(w0), end)

    worn, new = (scene(pressure, 30.0, [1500.0, 1500.0], 10.0) for pressure in (UniformWear(), UniformPressure()))
    held = scene(UniformWear(), 0.0, [0.0, 3 * (4 * 0.4 * 20e3 * 0.4)], 9.0)
    return [
        *cases_of_run(
            "disc brake",
            worn,
            {"stopping time, uniform wear": "stopping_time", "friction heat": "energy.friction_heat"},
        ),
        *cases_of_run("disc brake", new, {"stopping time, uniform pressure": "stopping_time"}),
        *cases_of_run("disc brake", held, {"restart": time_of("restart")}),
    ]


def shoe_cases() -> list[Case]:
    """Shigley's internal expanding shoes under the force that gives the leading one 1 MPa, in both directions."""
    r, force = 0.150, 2280.565445717275
    drum = ShoeBrake(12.0, Shoes(ConstantFriction(0.32), r, 0.032, 0.0, math.radians(126.0)), 0.1227, 0.212)

    def stop(omega: float) -> Scene:
        return Scene(drum, ForceDuty(Constant(force), TorqueLoad(Constant(0.0))), Initial(omega), 10.0)

    def torque(shoe: int) -> Callable[[Result], float]:
        return lambda result: r * float(np.asarray(result.series([0.1]).friction_force)[0, shoe])

    reads = {
        "torque of the leading shoe": torque(0),
        "torque of the trailing shoe": torque(1),
        "stopping time": "stopping_time",
        "maximum pressure": lambda run: float(drum.greatest_pressure(np.max(run.series([0.1]).normal_load))),
        "friction that locks": lambda run: 1 / drum.self_locking(np.ones(2))[0],
    }
    slopes = {
        "∂(stopping time)/∂f": "brake.linings.friction.coefficient",
        "∂(stopping time)/∂θ_2": "brake.linings.end",
    }
    back = {"stopping time backwards": "stopping_time"}
    return cases_of_run("double shoe", stop(25.0), reads, slopes, solver=Tsit5()) + cases_of_run(
        "double shoe", stop(-25.0), back, program="double shoe", solver=Tsit5()
    )


def bearing_cases() -> list[Case]:
    """A pulley that dry friction of the bearings brings to rest, until a growing load exceeds it."""
    load = TorqueLoad(PiecewiseLinear([0.0, 5.0, 25.0], [1e3, 1e3, 17e3]))
    scene = stop_scene(C=None, T0=0.0, load=load, end=11.0)
    scene = dataclasses.replace(scene, shaft=(BearingFriction(5e3),))  # pyright: ignore
    return cases_of_run("bearing friction", scene, {"stopping time": "stopping_time", "restart": time_of("restart")})


def layer_cases() -> list[Case]:
    """Stops over two and over four layers of rope."""
    cases = []
    for what, turns, w0 in (("hook travel", 4.0, 20.0), ("hook travel, four layers", 1.5, 31.0)):
        load = HookLoad(40e3, 0.4, 8.0, rope=RopeLayers(0.04, turns, 5.0))  # pyright: ignore
        scene = stop_scene(C=None, T0=12e3, w0=w0, load=load, end=20.0)
        cases += cases_of_run("rope in layers", scene, {what: "hook_travel"})
    return cases


# --- laws along a stop: friction over speed, memory, changes, wear ----------------------------------------------------

_LAW = "brake.linings.friction"


def _stop(law: AbstractFriction, heat: Heat | None = None) -> Scene:
    """A stop of four linings of 50° on a rigid band under a constant lever."""
    return dataclasses.replace(stop_scene(n=4, beta=50.0, law=law, C=None, end=3.0), heat=heat)


def _rim(capacity: float) -> Heat:
    """All heat into one insulated lump, of which the friction takes its temperature."""
    return lumped_heat(rim=capacity, partition=ConstantPartition(1.0), rim_cooling=0.0)


def _oiled(law: AbstractFriction, factor: float) -> ChangingFriction:
    """A law of which oil lowers the coefficient of linings 2 and 3 from 0.5 s on."""
    return ChangingFriction(law, (FrictionChange(PiecewiseLinear([0.5, 0.5], [1.0, factor]), [2, 3]),))


def speed_cases() -> list[Case]:
    """Friction over the slip speed: Stribeck's curve."""
    return cases_of_run(
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

    def factor(result: Result) -> Array:
        return result.series([float(result.stopping_time)]).friction_memory[0, 0]

    return [
        *cases_of_run(
            "friction with memory",
            pressed,
            {"stopping time": "stopping_time", "factor at rest": factor},
            {
                "∂(stopping time)/∂k": f"{_LAW}.processes.0.rate",
                "∂(stopping time)/∂w_0": f"{_LAW}.processes.1.work",
            },
            solver=Tsit5(),
        ),
        *cases_of_run(
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
    scene = with_values(_stop(ConstantFriction(0.35), _rim(2e4)), {"brake.linings.area": 0.03})
    return cases_of_run(
        "wear of linings",
        dataclasses.replace(scene, wear=Wear(LinearWear(2e-14, 5e-3, ROOM))),
        {"lining 1": "worn_thickness.0", "lining 4": "worn_thickness.3"},
        {"∂(lining 4)/∂s": "wear.rate.slope"},
        of=lambda result: result.worn_thickness[3],
        solver=Rodas5P(),  # (the only derivative through it here)
    )


# --- heat -------------------------------------------------------------------------------------------------------------

_K, _A = 50.0, 1.4e-5  # conductivity and diffusivity of the half-spaces
_LAYERS, _DEPTH, _FLUX = (36, 108), 0.048, 1e6
#: depths of the layers (m) and their rises (K) at the end
Rises: TypeAlias = tuple[Float[np.ndarray, " layer"], Float[np.ndarray, " layer"]]


def lump_cases() -> list[Case]:
    """Two lumps that come to one temperature."""
    times = [0.1, 0.5, 1.0]
    heat = Heat((Lump("a", 15.0, 373.15), Lump("b", 15.0, 273.15)), (Conductance("a", "b", 10.0),))
    reads = {f"T1 at {t} s": lambda T, i=i: T[i, 0] for i, t in enumerate(times, 1)}
    return cases_of("two lumps", lambda: simulate_heat(heat, [0.0, *times], rtol=1e-12).temperature, reads)


def half_space_cases() -> list[Case]:
    """Constant flux into a half-space: order of the layers, surface and depth on the finest."""
    steel = Material(_K, 7800.0, _K / (7800.0 * _A))

    def run() -> list[Rises]:
        """Two half-spaces of so many layers under one constant flux, in one network."""
        walls = [Wall(f"w{layers}", steel, _DEPTH, 1.0, layers) for layers in _LAYERS]
        heat = Heat(tuple(walls), sources=tuple(Source(f"{wall.name}.front", Constant(_FLUX)) for wall in walls))
        end = np.asarray(simulate_heat(heat, [0.0, 2.0], rtol=1e-9, solver=Tsit5()).temperature)[-1]
        rises = np.split(end - ROOM, [_LAYERS[0]])
        return [((np.arange(n) + 0.5) * _DEPTH / n, rise) for n, rise in zip(_LAYERS, rises, strict=True)]

    def order(rises: list[Rises]) -> float:
        from scipy.special import erfc

        errors = []
        for x, rise in rises:
            spread = np.exp(-(x**2) / (4 * _A * 2.0))
            exact = 2 * np.sqrt(_A * 2.0 / math.pi) * spread - x * erfc(x / np.sqrt(4 * _A * 2.0))
            errors.append(np.abs(rise - _FLUX / _K * exact).max())
        return math.log(errors[0] / errors[1], 3)

    def inside(depth: float) -> Callable[[list[Rises]], float]:
        return lambda rises: float(rises[1][1][int(np.argmin(np.abs(rises[1][0] - depth)))])

    reads = {
        "order of the layers": order,
        "surface": lambda rises: rises[1][1][0] + _FLUX * rises[1][0][0] / _K,
        # of 108 layers some have their centres just 2 and 10 mm deep
        "2 mm deep": inside(0.002),
        "10 mm deep": inside(0.010),
    }
    return cases_of("half-space", run, reads)


def fade_cases() -> list[Case]:
    """A stop on a rigid band that heats one insulated lump, on whose temperature the friction depends."""

    def fading(slope: float) -> Scene:
        law = ProductFriction(ConstantFriction(0.35), (LinearFade(slope, ROOM, 0.0, 0.0),))  # pyright: ignore
        return dataclasses.replace(stop_scene(C=None, law=law, end=10.0), heat=_rim(2e4))

    reads = {
        "stopping time": "stopping_time",
        "temperature at rest": "end_temperatures.0",
        "heat-balance residual": "energy.heat_closure",
    }
    return cases_of_run("stop with fade", fading(2e-3), reads, rtol=1e-11) + cases_of_run(
        "stop with no fade", fading(0.0), reads, rtol=1e-11
    )


# --- further mechanisms -----------------------------------------------------------------------------------------------


def chain_cases() -> list[Case]:
    """One lining with a mass between the pulley and a band with a spring and a damper."""
    band = Band(0.9, 5.0, Segments(1e3, 0.05, 0.03))
    brake = Brake(Pulley(0.9, 0.5), band, Lining(ConstantFriction(0.3), np.full(1, math.radians(27.0)), mass=0.05))
    scene = Scene(brake, Duty(Constant(1.0), TorqueLoad()), Initial(0.6, 0.2), 2.0)
    return cases_of_run(
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
    return cases_of_run(
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
    shares = DeviceJit(tension_shares, quick=True)
    brake = MultiBandBrake(Pulley(0.59, 1200.0), 0.623, bands)
    scene = Scene(brake, Duty(Constant(6e3), TorqueLoad(Constant(3e3))), Initial(20.0), 6.0)
    return cases_of_run(
        "several bands",
        scene,
        {"stopping time": "stopping_time", "share of the first band": lambda _: shares(brake)[0]},
        solver=Tsit5(),
    )


def swing_cases() -> list[Case]:
    """A stop of a hook on an elastic rope, and the swing after it."""
    load = HookLoad(40e3, 0.4, 8.0, elasticity=RopeElasticity(4e6, 0.0))  # pyright: ignore
    return cases_of_run(
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
        Phase(Constant(25e3), "2 s", "slips", string_on_hook=False),
    )
    load = StringLoad(5e3, 40e3, 0.4, 8, 2e3)  # pyright: ignore
    scene = Scene(brake, Duty(Phases(course, count=2), load), Initial(0.0), 60.0)

    def ended(k: int):
        return lambda result: [e.time for e in result.events if e.name == "phase_end"][k]

    return cases_of_run(
        "phases by state",
        scene,
        {"first fall ends": ended(0), "first stop": ended(1), "second fall ends": ended(4), "end": "record.t_end"},
        solver=Tsit5(),
    )


# --- other ways to run a scene: prepared, side by side in an ensemble, and in steps from outside ----------------------

_OMEGA, _J = "initial.omega", "brake.pulley.inertia"


def prepared_cases() -> list[Case]:
    """A prepared stop at another speed than the one it was prepared with: time, angle, and a derivative of each."""
    asked, at = ("stopping_time", "stopping_angle"), {_OMEGA: 26.0}
    run = functools.cache(lambda: prepare(stop_scene(C=None), asked, rtol=1e-12, max_steps=128, solver=Tsit5()))
    reads = {
        "stopping_time": lambda run: run(at).metrics["stopping_time"],
        "stopping_angle": lambda run: run(at).metrics["stopping_angle"],
        "∂(stopping time)/∂ω_0": lambda run: run.gradient(at)[0, run.places[_OMEGA]].item(),
        "∂(stopping angle)/∂J": lambda run: run.gradient(at)[1, run.places[_J]].item(),
    }
    return cases_of("prepared run", run, reads)


def ensemble_cases() -> list[Case]:
    """Stops side by side, of which the slow ones end before all linings slide, and the last does not stop in time."""
    from ..studies._ensemble import ensemble  # loaded on demand: it imports xarray

    def run() -> Any:
        asked, speeds = ["slip_onset_time", "full_slip_time", "stopping_time"], np.array([20.0, 0.5, 26.0, 60.0, 22.0])
        scene = stop_scene(n=5, beta=54.0, end=1.5)
        return ensemble(scene, {_OMEGA: speeds}, asked, rtol=1e-12, solver=Tsit5(), workers=1, progress=False)

    def of(name: str, i: int) -> Callable[[Any], float]:
        return lambda data: float(data[name].values[i])

    reads = {
        "stopping time, run 1": of("stopping_time", 0),
        "stopping time, run 2": of("stopping_time", 1),
        "full slip, run 2": lambda data: float(np.isfinite(data.full_slip_time.values[1])),
        "full slip, run 3": of("full_slip_time", 2),
        "slip onset, run 4": of("slip_onset_time", 3),
        "stop, run 4": lambda data: float(np.isfinite(data.stopping_time.values[3])),
        "stopping time, run 5": of("stopping_time", 4),
        "energy-balance residual": lambda data: float(np.max(data["energy.closure"].values)),
    }
    return cases_of("ensemble", run, reads)


def stepper_cases() -> list[Case]:
    """A stop in steps under a lever that is pulled harder on the way, put back once, and pulled again."""

    def run() -> dict[str, float]:
        stepper = Stepper(stop_scene(C=None, T0=4e3), inputs=["lever"], rtol=1e-12)
        stepper.advance(0.1)
        stepper.advance(0.2)
        state, middle = stepper.state(), float(stepper["omega"])
        stepper.advance(0.05, lever=9e3)
        pulled = float(stepper["omega"])
        stepper.restore(state)
        back = float(stepper["omega"])
        (stop,) = (event.time for event in stepper.advance(1.0, lever=9e3).events if event.name == "stop")
        return {"middle": middle, "pulled": pulled, "back": back, "stop": stop}

    reads = {
        "speed after two steps": "middle",
        "speed under a harder pull": "pulled",
        "speed put back": "back",
        "stop": "stop",
    }
    return cases_of("steps from outside", run, reads)


#: the subjects in two lanes, which run side by side; those of one lane share compiled programs
LANES = (
    (
        *(belt_cases, stiff_cases, lump_cases, half_space_cases, fade_cases),
        *(chain_cases, spring_cases, band_cases, swing_cases, phase_cases),
        *(prepared_cases, ensemble_cases, stepper_cases),
    ),
    (
        *(elastic_cases, hook_cases, rigid_cases, pair_cases, hold_cases, gradient_cases),
        *(disc_cases, shoe_cases, bearing_cases, layer_cases, speed_cases, changing_cases, wear_cases),
    ),
)
