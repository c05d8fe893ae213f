"""Validation of the standard brake: stops, events, tensions and holds with an answer in closed form."""

import functools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import lambertw

from .._parts._scene import Scene
from .._run._result import Result
from .._run._simulate import simulate
from ..brakes._band import grip, tension_ratio
from ..loads import HookLoad, TorqueLoad, differential_lever_tension
from ..profiles import ExponentialRise, PiecewiseLinear
from ._reference_scenes import FallingFriction, closed_form, stop_scene, tension_for
from ._validation import Case

_FORM = "closed form: "
_BOOK = "Khurmi & Gupta, Theory of Machines, band and block brake"
_KNOTS = 6


def points(values: Any, times: Any = None) -> PiecewiseLinear:
    """A profile of six points, a constant by itself: scenes of one structure share their compiled program."""
    values = np.atleast_1d(np.asarray(values, float))
    times = np.zeros(1) if times is None else np.asarray(times, float)
    more = _KNOTS - len(values)
    later = np.linspace(1e6, 2e6, more)  # after the end of every run
    return PiecewiseLinear(np.append(times, later), np.append(values, np.full(more, values[-1])))


def scene_of(lever: Any, load: Any = 0.0, drag: float = 0.0, **parts: Any) -> Scene:
    """`stop_scene` under a lever and a load of six points each."""
    lever = lever if isinstance(lever, PiecewiseLinear) else points(lever)
    load = load if isinstance(load, PiecewiseLinear) else points(load)
    return stop_scene(lever=lever, load=TorqueLoad(load, drag=drag), **parts)


def ran(scene: Scene, rtol: float = 1e-12) -> Callable[[], Result]:
    """The result of a scene, run when it is first asked for."""
    return functools.cache(lambda: simulate(scene, rtol=rtol))


#: the elastic stop on which several cases rest, and its closed forms
ELASTIC: dict[str, Any] = {"n": 10, "beta": 27.0, "f": 0.35, "R": 0.725, "J": 800.0, "C": 2e5, "w0": 20.0}


def elastic_stop(T0: Any = 8e3, **changes: Any) -> Scene:
    return scene_of(T0, **{**ELASTIC, "end": 5.0, **changes})


def elastic_cases(scene: Scene | None = None) -> list[Case]:
    """Every event of a stop with an elastic band; `scene`: another one in place of the one that the truth is for."""
    run = ran(scene or elastic_stop())
    truth = closed_form(T0=8e3, **ELASTIC)

    def limit(i: int) -> float:
        return next(e.time for e in run().events if e.name == "lining_limit" and e.lining == i)

    chi = "χ² = C R²/J"
    return [
        Case(
            "elastic stop/slip onset", f"{_FORM}T_0/(C R ω_0) [Z-15]", truth["t0"], 1e-11, lambda: run().slip_onset_time
        ),
        Case(
            "elastic stop/limit of lining 5",
            f"{_FORM}t0 + asin(χ T_0 (Π_5 − 1)/(C R ω_0))/χ, {chi}",
            truth["limits"][4],
            1e-11,
            lambda: limit(5),
        ),
        Case(
            "elastic stop/full slip", f"{_FORM}the same with Π [Z-16]", truth["t1"], 1e-11, lambda: run().full_slip_time
        ),
        Case(
            "elastic stop/stopping time",
            f"{_FORM}t1 + J ω_1/(R T_0 (Π − 1)) [Z-17, 18]",
            truth["stop"],
            1e-11,
            lambda: run().stopping_time,
        ),
        Case(
            "elastic stop/greatest tension",
            f"{_FORM}T_0 Π",
            8e3 * truth["Pi"],
            1e-11,
            lambda: run().metrics["max_tension"],
        ),
    ]


def soft_cases() -> list[Case]:
    """A band so soft that the stop comes before full slip: nothing slides, nothing is heated [Z-16]."""
    run = ran(elastic_stop(f=0.5, C=5e3, w0=2.0, end=10.0))
    stop = 8e3 / (5e3 * 0.725 * 2.0) + math.pi / 2 / math.sqrt(5e3 * 0.725**2 / 800.0)
    return [
        Case("stop without slip/stopping time", f"{_FORM}t0 + π/(2χ) [Z-16]", stop, 1e-11, lambda: run().stopping_time),
        Case("stop without slip/friction heat", "nothing slides", 0.0, 1e-9, lambda: run().energy["friction_heat"]),
    ]


def textbook_cases() -> list[Case]:
    """14 blocks of 15°, effective diameter 1 m, 2000 kg with k_g 0.5 m, ends at 30/120 mm, 200 N at 750 mm, 360 rpm."""
    n, beta, f, J, R, w0 = 14, 15.0, 0.25, 2000 * 0.5**2, 0.5, 12 * math.pi
    fz = f * math.tan(math.radians(beta) / 2)
    Pi = ((1 + fz) / (1 - fz)) ** n
    T_0 = 200 * 0.75 / (0.12 - 0.03 * Pi)
    M = R * T_0 * (Pi - 1)

    @functools.cache
    def slack() -> float:
        mu, _ = tension_ratio(grip(jnp.asarray(f), jnp.full(n, math.radians(beta))))
        return float(differential_lever_tension(200.0, 0.75, 0.12, 0.03, jnp.prod(mu)))

    run = functools.cache(lambda: simulate(scene_of(slack(), n=n, beta=beta, f=f, R=R, J=J, C=None, w0=w0, end=9.0)))

    def at(name: str) -> Callable[[], Any]:
        return lambda: getattr(run().series([3.0]), name)[0]

    def slowing() -> Any:
        w = run().series([1.0, 6.0]).omega
        return (w[0] - w[1]) / 5.0

    ratio = "T_n/T_0 = ((1 + μ tan β/2)/(1 − μ tan β/2))^n"
    return [
        Case("band and block/tension ratio", f"{_BOOK}: {ratio}", Pi, 1e-11, lambda: at("tight_tension")() / slack()),
        Case("band and block/slack tension", f"{_BOOK}: F l/(a − b T_n/T_0)", T_0, 1e-11, slack),
        Case("band and block/tight tension", f"{_BOOK}: T_0 T_n/T_0", Pi * T_0, 1e-11, at("tight_tension")),
        Case("band and block/torque", f"{_BOOK}: R (T_n − T_0)", M, 1e-11, at("brake_torque")),
        Case("band and block/retardation", f"{_BOOK}: M/(m k²)", M / J, 1e-11, slowing),
        Case("band and block/time to stop", f"{_BOOK}: ω_0/α", w0 * J / M, 1e-11, lambda: run().stopping_time),
        Case("band and block/torque, as printed", f"{_BOOK}: 2540 N·m, rounded", 2540.0, 5e-3, at("brake_torque")),
    ]


def capstan_cases() -> list[Case]:
    """Many short linings become a belt: the ratio tends to e^{μφ} with order 2."""
    mu, phi = 0.4, math.radians(270)

    def error(n: int) -> Any:
        steps, _ = tension_ratio(grip(jnp.asarray(mu), jnp.full(n, phi / n)))
        return jnp.prod(steps) * math.exp(-mu * phi) - 1

    errors = functools.cache(jax.jit(lambda: (error(64), error(128))))
    first = mu * (1 + mu**2) * phi**3 / (12 * 128**2)
    return [
        Case(
            "capstan limit/order",
            "Euler: T_n/T_0 → e^{μφ} as n⁻²",
            2.0,
            0.025,
            lambda: math.log2(errors()[0] / errors()[1]),
        ),
        Case(
            "capstan limit/error, 128 linings",
            f"{_FORM}μ(1 + μ²)φ³/(12 n²), first term",
            first,
            1e-3,
            lambda: errors()[1],
        ),
    ]


def hook_cases() -> list[Case]:
    """A hook of 60 t on eight lines, braked by 60 kN·m through one lining."""
    J, m, r, n, w0, M, g = 1200.0, 60e3, 0.4, 8, 24.0, 60e3, 9.81
    f, beta, R = 0.3, 30.0, 0.6
    load = HookLoad(mass=m, drum_radius=r, line_count=n, gravity=g)  # pyright: ignore
    T_0 = tension_for(M, 1, f, beta, R)
    run = ran(stop_scene(n=1, f=f, beta=beta, R=R, J=J, C=None, T0=T_0, w0=w0, load=load, end=3.0))
    inertia, torque = J + m * (r / n) ** 2, m * g * r / n
    time = inertia * w0 / (M - torque)
    fz = f * math.tan(math.radians(beta) / 2)
    shoe = "single shoe: (1 + f tan β/2)/(1 − f tan β/2)"

    def ratio() -> Any:
        s = run().series([0.5])
        return s.tight_tension[0] / s.slack_tension[0]

    J_eq = "J_eq = J + m(r/n)²"
    return [
        Case(
            "hook load/stopping time",
            f"{_FORM}J_eq ω_0/(M_b − m g r/n), {J_eq}",
            time,
            1e-11,
            lambda: run().stopping_time,
        ),
        Case("hook load/travel", f"{_FORM}v_0 t/2", w0 * r / n * time / 2, 1e-11, lambda: run().hook_travel),
        Case(
            "hook load/friction heat",
            f"{_FORM}M_b ω_0 t/2",
            M * w0 * time / 2,
            1e-11,
            lambda: run().energy["friction_heat"],
        ),
        Case("one lining/tension ratio", f"{_FORM}{shoe}", (1 + fz) / (1 - fz), 1e-11, ratio),
    ]


def rigid_cases() -> list[Case]:
    """Rigid bands: a brake put on at a given time, rotation the other way, a load that grows past the capacity."""
    n, beta, f = 14, 15.0, 0.25
    T_1 = tension_for(1.0, n, f, beta)
    late = points([0.0, 0.0, T_1], [0.0, 0.1, 0.1])
    parts: dict[str, Any] = {"n": n, "beta": beta, "f": f, "C": None}
    slider = ran(scene_of(late, R=1.0, J=1.0, w0=1.0, end=2.0, **parts))
    Pi = closed_form(n=n, f=f, beta=beta)["Pi"]
    back = ran(scene_of(8e3, w0=-20.0, end=15.0, **parts))
    hold = 0.725 * 8e3 * (Pi - 1)
    grows = ran(scene_of(8e3, points([0.0, 12e3], [0.0, 12.0]), w0=0.0, end=12.0, **parts))
    rise = stop_scene(lever=ExponentialRise(800 * 20 / 4.0 / (0.725 * (Pi - 1)), 0.5), end=8.0, **parts)
    x = (4.0 + 0.5) / 0.5
    pressed = ran(rise)

    def restart() -> float:
        return next(e.time for e in grows().events if e.name == "restart")

    modelica = "Modelica Standard Library, brake on a slider"
    return [
        Case("brake on a slider/stop", f"{modelica}: 0.1 + m v/F", 1.1, 1e-11, lambda: slider().stopping_time),
        Case("brake on a slider/way", f"{modelica}: v t_0 + m v²/2F", 0.6, 1e-11, lambda: slider().stopping_angle),
        Case(
            "turning back/stopping time",
            f"{_FORM}J|ω_0|/(R T_0 (1 − 1/Π))",
            16e3 / (0.725 * 8e3 * (1 - 1 / Pi)),
            1e-11,
            lambda: back().stopping_time,
        ),
        Case("growing load/restart", f"{_FORM}where M_load = R T_0 (Π − 1)", hold / 1e3, 1e-11, restart),
        Case(
            "exponential rise/stopping time",
            f"{_FORM}a + τ + τ W_0(−e^(−(a+τ)/τ)), a = Jω_0/M_0",
            0.5 * (x + lambertw(-math.exp(-x)).real),
            1e-11,
            lambda: pressed().stopping_time,
        ),
    ]


def falling_cases() -> list[Case]:
    """A friction law of one's own, μ_0/(1 + κω)."""
    J, M, k, w = 10.0, 50.0, 0.3, 8.0
    law = FallingFriction(*(jnp.asarray(x) for x in (M, k, 20.0)))  # pyright: ignore
    run = ran(stop_scene(n=1, beta=math.degrees(0.5), R=1.0, J=J, C=None, T0=20.0, w0=w, law=law, end=10.0))
    time, angle = J / M * (w + k * w**2 / 2), J / M * (w**2 / 2 + k * w**3 / 3)
    return [
        Case(
            "falling friction/stopping time", f"{_FORM}(J/M_0)(ω_0 + κω_0²/2)", time, 1e-11, lambda: run().stopping_time
        ),
        Case("falling friction/angle", f"{_FORM}(J/M_0)(ω_0²/2 + κω_0³/3)", angle, 1e-11, lambda: run().stopping_angle),
    ]


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return (
        elastic_cases()
        + soft_cases()
        + textbook_cases()
        + capstan_cases()
        + hook_cases()
        + rigid_cases()
        + falling_cases()
    )
