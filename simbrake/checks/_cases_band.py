"""Band brakes with reference solutions: stops, tensions and holds in closed form, energy balances, printed tables."""

import functools
import math
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from diffrax import Tsit5
from scipy.special import lambertw

from .._base._compiling import DeviceJit
from .._parts._scene import Duty, Initial, Scene
from .._run._result import Result
from .._run._simulate import simulate
from ..brakes._band import AbstractStiffness
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley
from ..friction import AbstractFriction, ConstantFriction
from ..hybrid._arrays import Array
from ..loads import AbstractLoad, HookLoad, TorqueLoad
from ..profiles import AbstractProfile, Constant, ExponentialRise, PiecewiseLinear
from ._validation import FORM, Case, Row, cases_of, cases_of_run

_SLIDER = "Modelica Standard Library, brake on a slider"
_COULOMB = "Coulomb friction below its capacity"

#: a number of a scene or of a closed form: also traced, or complex
Number: TypeAlias = complex | float | int | Array
Values: TypeAlias = Number | Sequence[Number]

# --- scenes with closed-form solutions --------------------------------------------------------------------------------


def stop_scene(
    n: int = 20,
    f: Number = 0.35,
    beta: float = 13.5,
    R: Number = 0.725,
    J: Number = 800.0,
    C: Number | AbstractStiffness | None = 2e5,
    T0: Number = 8e3,
    w0: Number = 20.0,
    load: Number | AbstractLoad = 0.0,
    end: Number = 5.0,
    law: AbstractFriction | None = None,
    lever: AbstractProfile | None = None,
    **initial: Number,
) -> Scene:
    """A stop with constant slack tension on `n` linings of `beta` degrees: closed forms in `closed_form`.

    `C`: stiffness, `None` for a rigid band; `law`: friction in place of `f`; `lever`: profile in place of `T0`; `load`:
    a torque, or a load.
    """
    lining = Lining(law if law is not None else ConstantFriction(f), np.full(n, math.radians(beta)))
    force = lever if lever is not None else Constant(T0)
    duty = Duty(force, load if isinstance(load, AbstractLoad) else TorqueLoad(Constant(load)))
    return Scene(Brake(Pulley(R, J), Band(R, C), lining), duty, Initial(omega=w0, **initial), end)


def closed_form(
    n: int = 20,
    f: Number = 0.35,
    beta: Number = 13.5,
    R: Number = 0.725,
    J: Number = 800.0,
    C: Number = 2e5,
    T0: Number = 8e3,
    w0: Number = 20.0,
    xp: ModuleType = math,
) -> dict[str, Any]:
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping time.

        t0 = T_0/(C R ω_0),   lining i: t0 + asin(χ T_0 (Π_i − 1)/(C R ω_0))/χ,   χ² = C R²/J,   t1 = that of lining n
        stop: t1 + J ω_0 cos χ(t1 − t0)/(R T_0 (Π − 1))

    `xp`: `math`, or a module with the same functions for derivatives (`jax.numpy`) or complex numbers (`numpy`).
    """
    z = xp.tan(beta * math.pi / 180 / 2)
    mu = (1 + f * z) / (1 - f * z)
    Pi = mu**n
    t0 = T0 / (C * R * w0)
    chi = xp.sqrt(C * R**2 / J)

    def limit(ratio: Number) -> Number:
        return t0 + xp.asin(chi * T0 * (ratio - 1) / (C * R * w0)) / chi

    t1 = limit(Pi)
    w1 = w0 * xp.cos(chi * (t1 - t0))
    limits = [limit(mu ** (i + 1)) for i in range(n)]
    return {"t0": t0, "limits": limits, "t1": t1, "stop": t1 + w1 * J / (R * T0 * (Pi - 1)), "Pi": Pi}


def tension_for(torque: Number, n: int, f: Number, beta: float, R: Number = 1.0) -> Number:
    """Slack tension (N) at which the torque of `n` sliding linings is `torque`: `T_0 = M/(R (Π − 1))`."""
    return torque / (R * (closed_form(n=n, f=f, beta=beta)["Pi"] - 1))


def staged_pair(
    M_i: Number = 600.0,
    J_1: Number = 40.0,
    J_2: Number = 4.0,
    w0: Number = 20.0,
    lever: tuple[Values, Sequence[Number] | Array] | None = None,
    end: Number = 3.0,
    c: Number = 500.0,
) -> Scene:
    """Pulley `J_1` and bandage `J_2` joined by an internal pair of capacity `M_i`; the band's torque is `c t`.

    The capacity comes from preload alone: a coefficient so small that the tensions add nothing to it. `lever` `(times,
    torques)`: points of the band's torque in place of `c t`. Radii are 1 m.
    """
    n, f, beta, small = 4, 0.5, 60.0, 1e-14
    brake = Brake(
        Pulley(1.0, J_1),
        Band(1.0),
        Lining(ConstantFriction(f), np.full(n, math.radians(beta))),
        Bandage(J_2, ConstantFriction(small), M_i / (n * small)),
    )
    times, torques = ([0.0, 10.0], [jnp.zeros(()), jnp.asarray(10.0 * c)]) if lever is None else lever
    tensions = jnp.stack([jnp.asarray(tension_for(torque, n, f, beta), jnp.float64) for torque in torques])
    return Scene(brake, Duty(PiecewiseLinear(times, tensions), TorqueLoad()), Initial(w0), end)


def points(values: Values, times: Values = 0.0, count: int = 6) -> PiecewiseLinear:
    """A profile of `count` points, a constant by itself: scenes of one structure share their compiled program."""
    values, times = np.atleast_1d(np.asarray(values, float)), np.atleast_1d(np.asarray(times, float))
    more = count - len(values)
    later = np.linspace(1e6, 2e6, more)  # after the end of every run
    return PiecewiseLinear(np.append(times, later), np.append(values, np.full(more, values[-1])))


def scene_of(
    lever: Values | PiecewiseLinear, load: Values | PiecewiseLinear = 0.0, drag: float = 0.0, **parts: Any
) -> Scene:
    """`stop_scene` under a lever and a load of six points each."""
    lever, load = (x if isinstance(x, PiecewiseLinear) else points(x) for x in (lever, load))
    return stop_scene(lever=lever, load=TorqueLoad(load, drag=drag), **parts)


def time_of(name: str, lining: int | None = None) -> Callable[[Result], float]:
    """The time of the first such event in a run."""
    return lambda r: next(e.time for e in r.events if e.name == name and e.lining == lining)


# --- the standard brake -----------------------------------------------------------------------------------------------

#: the elastic stop of several cases, and its closed forms
ELASTIC: dict[str, Any] = {"n": 10, "beta": 27.0, "f": 0.35, "R": 0.725, "J": 800.0, "C": 2e5, "w0": 20.0}
_TRUTH = closed_form(T0=8e3, **ELASTIC)
_PI = _TRUTH["Pi"]
_HOLD = 0.725 * 8e3 * (_PI - 1)  # what the brake holds (N·m)


def elastic_stop(T0: Number = 8e3, **changes: Any) -> Scene:
    return scene_of(T0, **{**ELASTIC, "end": 5.0, **changes})


def elastic_cases(scene: Scene | None = None) -> list[Case]:
    """Every event of a stop with an elastic band; `scene`: another scene than that of the truth."""
    by_asin = f"{FORM}t0 + asin(χ T_0 (Π_5 − 1)/(C R ω_0))/χ, χ² = C R²/J"
    rows = [
        ("slip onset", f"{FORM}T_0/(C R ω_0) [Z-15]", _TRUTH["t0"], "slip_onset_time"),
        ("limit of lining 5", by_asin, _TRUTH["limits"][4], time_of("lining_limit", 5)),
        ("full slip", f"{FORM}the same with Π [Z-16]", _TRUTH["t1"], "full_slip_time"),
        ("stopping time", f"{FORM}t1 + J ω_1/(R T_0 (Π − 1)) [Z-17, 18]", _TRUTH["stop"], "stopping_time"),
        ("maximum tension", f"{FORM}T_0 Π", 8e3 * _PI, "metrics.max_tension"),
    ]
    return cases_of_run("elastic stop", scene or elastic_stop(), rows, solver=Tsit5())


def hook_cases() -> list[Case]:
    """A hook of 60 t on eight lines, braked by 60 kN·m through one lining."""
    J, m, r, n, w0, M, g = 1200.0, 60e3, 0.4, 8, 24.0, 60e3, 9.81
    f, beta, R = 0.3, 30.0, 0.6
    load = HookLoad(mass=m, drum_radius=r, line_count=n, gravity=g)  # pyright: ignore
    T_0 = tension_for(M, 1, f, beta, R)
    scene = stop_scene(n=1, f=f, beta=beta, R=R, J=J, C=None, T0=T_0, w0=w0, load=load, end=3.0)
    run = functools.cache(lambda: simulate(scene, rtol=1e-12))
    inertia, torque = J + m * (r / n) ** 2, m * g * r / n
    time = inertia * w0 / (M - torque)
    fz = f * math.tan(math.radians(beta) / 2)

    def ratio(result: Result) -> Array:
        s = result.series([0.5])
        return s.tight_tension[0] / s.slack_tension[0]

    rows = [
        ("stopping time", f"{FORM}J_eq ω_0/(M_b − m g r/n), J_eq = J + m(r/n)²", time, "stopping_time"),
        ("travel", f"{FORM}v_0 t/2", w0 * r / n * time / 2, "hook_travel"),
        ("friction heat", f"{FORM}M_b ω_0 t/2", M * w0 * time / 2, "energy.friction_heat"),
    ]
    shoe = f"{FORM}single shoe: (1 + f tan β/2)/(1 − f tan β/2)"
    one = ("tension ratio", shoe, (1 + fz) / (1 - fz), ratio)
    return cases_of("hook load", run, 1e-11, rows) + cases_of("one lining", run, 1e-11, [one])


def rigid_cases() -> list[Case]:
    """Rigid bands: a brake applied at a given time, rotation the other way, a load that grows past the capacity."""
    n, beta, f = 14, 15.0, 0.25
    parts: dict[str, Any] = {"n": n, "beta": beta, "f": f, "C": None}
    late = points([0.0, 0.0, tension_for(1.0, n, f, beta)], [0.0, 0.1, 0.1])
    Pi = closed_form(n=n, f=f, beta=beta)["Pi"]
    x = (4.0 + 0.5) / 0.5
    rise = ExponentialRise(800 * 20 / 4.0 / (0.725 * (Pi - 1)), 0.5)
    slider = [
        ("stop", f"{_SLIDER}: 0.1 + m v/F", 1.1, "stopping_time"),
        ("way", f"{_SLIDER}: v t_0 + m v²/2F", 0.6, "stopping_angle"),
    ]
    back = (f"{FORM}J|ω_0|/(R T_0 (1 − 1/Π))", 16e3 / (0.725 * 8e3 * (1 - 1 / Pi)))
    grows = (f"{FORM}where M_load = R T_0 (Π − 1)", 0.725 * 8e3 * (Pi - 1) / 1e3)
    pressed = (f"{FORM}a + τ + τ W_0(−e^(−(a+τ)/τ)), a = Jω_0/M_0", 0.5 * (x + lambertw(-math.exp(-x)).real))
    load = points([0.0, 12e3], [0.0, 12.0])
    return [
        *cases_of_run("brake on a slider", scene_of(late, R=1.0, J=1.0, w0=1.0, end=2.0, **parts), slider),
        *cases_of_run(
            "turning back", scene_of(8e3, w0=-20.0, end=15.0, **parts), [("stopping time", *back, "stopping_time")]
        ),
        *cases_of_run(
            "growing load", scene_of(8e3, load, w0=0.0, end=12.0, **parts), [("restart", *grows, time_of("restart"))]
        ),
        *cases_of_run(
            "exponential rise", stop_scene(lever=rise, end=8.0, **parts), [("stopping time", *pressed, "stopping_time")]
        ),
    ]


# --- the staged brake -------------------------------------------------------------------------------------------------


def pair_cases(**changes: Any) -> list[Case]:
    """Internal slip, external lock and stop under a torque `c t`; `changes`: of the scene, not of the truth."""
    J1, J2, w0, M, c = 40.0, 4.0, 20.0, 600.0, 500.0
    t0 = M * (J1 + J2) / (c * J1)
    w_t0 = w0 - c * t0**2 / (2 * (J1 + J2))
    # J2 ω̇2 = M − c t from t0 on, down to 0
    slope = M - c * t0
    d = (slope + math.sqrt(slope**2 + 2 * c * J2 * w_t0)) / c
    lock, w1 = t0 + d, w_t0 - M * d / J1
    # internal slip: ω1 − ω2 = −M τ/J1 − (slope τ − c τ²/2)/J2 until the lock, then ω1 alone
    inner = M * (-(M / J1 + slope / J2) * d**2 / 2 + c * d**3 / (6 * J2)) + J1 * w1**2 / 2
    total = (J1 + J2) * w0**2 / 2

    def speed(result: Result) -> Array:
        return result.series([float(result.external_lock_time)]).omega[0]

    rows = [
        ("internal slip", f"{FORM}M_i(J1 + J2)/(c J1)", t0, "internal_slip_time"),
        ("external lock", f"{FORM}J2 ω̇2 = M_i − c t to 0", lock, "external_lock_time"),
        ("speed at the lock", f"{FORM}ω1 = ω(t0) − M_i(t − t0)/J1", w1, speed),
        ("stopping time", f"{FORM}t0/2 + ω_0 J1/M_i", t0 / 2 + w0 * J1 / M, "stopping_time"),
        ("internal heat", f"{FORM}∫ M_i(ω1 − ω2) dt", inner, "energy.heat_internal"),
        ("external heat", f"{FORM}(J1 + J2)ω_0²/2 − internal heat", total - inner, "energy.heat_external"),
    ]
    parts = {"M_i": M, "J_1": J1, "J_2": J2, "w0": w0, "lever": _lever((0.0, 0.0), (10.0, 10.0 * c))}
    return cases_of_run("staged pair", staged_pair(**parts | changes), rows, solver=Tsit5())


def _lever(*torques: tuple[float, float]) -> tuple[Array, Array]:
    """Times and torques of the band at four points: all staged scenes here share one program."""
    profile = points([torque for _, torque in torques], [time for time, _ in torques], 4)
    return profile.times, profile.values


# --- conditions of every run --- --------------------------------------------------------------------------------------


def hold_cases() -> list[Case]:
    """An hour of holding: half of the capacity, just below it, and by a staged brake; nothing moves at all."""

    def moved(result: Result) -> float:
        s = result.series(np.linspace(0.0, 3600.0, 25))
        other = s.omega if s.bandage_speed is None else np.asarray(s.bandage_speed)
        return float(np.max(np.abs(s.phi)) + np.max(np.abs(other)))

    def held(share: float) -> Scene:
        return elastic_stop(load=share * _HOLD, w0=0.0, end=3600.0)

    staged = staged_pair(w0=0.0, lever=_lever((0.0, 500.0)), end=3600.0)
    exactly = f"{_COULOMB}: moves exactly 0"
    return [
        *cases_of_run("held 3600 s", held(0.5), [("half of the capacity", exactly, 0.0, moved, 0.0)], solver=Tsit5()),
        *cases_of_run(
            "held 3600 s", held(1 - 1e-12), [("capacity less 1e-12", exactly, 0.0, moved, 0.0)], solver=Tsit5()
        ),
        *cases_of_run(
            "staged brake held 3600 s", staged, [("movement", f"{_COULOMB}: none", 0.0, moved, 0.0)], solver=Tsit5()
        ),
    ]


def gradient_cases() -> list[Case]:
    """Derivatives of the stopping time by reverse mode."""

    def stopping_time(scene: Scene) -> Array:
        return simulate(scene, rtol=1e-12, max_steps=256, solver=Tsit5()).stopping_time

    def run() -> Scene:
        program = DeviceJit(jax.grad(stopping_time), subject=("validation", "elastic stop, slopes"), quick=True)
        return program(jax.tree.map(np.asarray, elastic_stop()))

    def truth(name: str) -> float:
        # complex step: no difference of near numbers
        values: dict[str, Any] = {"T0": 8e3, **ELASTIC}
        values[name] = values[name] + 1e-200j
        return closed_form(xp=np, **values)["stop"].imag / 1e-200

    places = {
        "f": "brake.linings.friction.coefficient",
        "beta": lambda found: np.sum(found.brake.linings.angle) * math.pi / 180,
        "R": "brake.band.radius",
        "J": "brake.pulley.inertia",
        "C": "brake.band.stiffness",
        "T0": lambda found: np.sum(found.duty.slack_tension.values),
        "w0": "initial.omega",
    }
    source = "closed form of the stop, differentiated"
    rows: list[Row] = [(f"∂(stopping time)/∂{name}", source, truth(name), place) for name, place in places.items()]
    return cases_of("elastic stop", run, 1e-9, rows)


CASES = (
    elastic_cases,
    hook_cases,
    rigid_cases,
    pair_cases,
    hold_cases,
    gradient_cases,
)
