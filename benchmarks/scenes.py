"""Scenes of the work–precision benchmark: plain numbers for other tools, and the same as a scene of simbrake.

Every scene names its events and the state that is compared at its end; both lie in `Answer` in the scene's order.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

ROOM = 293.15  # K


class Answer(NamedTuple):
    """What a run gives: times of the scene's events (s), its final state, and the work it took."""

    times: np.ndarray
    state: np.ndarray
    evaluations: int  # of right-hand sides
    steps: int  # accepted steps


@dataclasses.dataclass(frozen=True)
class Stop:
    """A stop of one band under a constant lever, from `x_0` on; with heat where `rates` is given.

    - `rates` (k, k) in 1/s: how temperatures above room change by conduction and cooling; `into` (k,) in K/J: what
      friction heat does to them. Friction sees node 0: `f = f_0 (1 − s T_0)`
    """

    R: float = 0.725
    J: float = 800.0
    C: float = 2e5
    T_0: float = 8e3
    w_0: float = 20.0
    x_0: float = 0.0
    f: float = 0.35
    n: int = 20
    z: float = math.tan(math.radians(13.5) / 2)
    fade: float = 0.0
    end: float = 1.0
    rates: np.ndarray | None = None
    into: np.ndarray | None = None

    @property
    def Pi(self) -> float:
        """Ratio of the tensions in full slip, cold."""
        return ((1 + self.f * self.z) / (1 - self.f * self.z)) ** self.n


@dataclasses.dataclass(frozen=True)
class Staged:
    """A stop of a staged brake on a rigid band as its actuator fills, `T_0 = p (1 − exp(−(t + t_a)/τ))` (model §4)."""

    R: float = 0.59
    R_b: float = 0.638
    J: float = 1200.0
    J_b: float = 60.0
    w_0: float = 24.0
    load: float = 3e3
    f_ext: float = 0.42
    f_int: float = 0.30
    preload: float = 4e3
    n: int = 20
    z: float = math.tan(math.radians(13.5) / 2)
    level: float = 24e3
    tau: float = 0.25
    ahead: float = 0.02
    end: float = 4.0


@dataclasses.dataclass(frozen=True)
class Cycles:
    """Load lowered and stopped again and again: rigid band, lever in straight lines, rim, linings and band as lumps.

    - `times`, `tensions`: of the lever in one cycle; at the third point it has let go, at the fourth it takes hold
    """

    R: float = 0.725
    J: float = 3000.0
    load: float = 9e3
    drag: float = 450.0
    f: float = 0.35
    fade: float = 8e-4
    n: int = 20
    z: float = math.tan(math.radians(13.5) / 2)
    times: tuple[float, ...] = (1.0, 2.0, 20.0, 20.35)
    tensions: tuple[float, ...] = (8e3, 0.0, 0.0, 8e3)
    period: float = 60.0
    count: int = 20
    share: float = 0.8
    capacities: tuple[float, float, float] = (1.5e5, 4e4, 2e4)  # J/K: rim, linings, band
    cooling: tuple[float, float] = (150.0, 40.0)  # W/K: rim, band
    between: float = 60.0  # W/K: linings to band


@dataclasses.dataclass(frozen=True)
class Case:
    """One scene: `plain` its numbers, `simbrake()` the same for simbrake, `events` and `scales` of the final state."""

    name: str
    title: str
    plain: Any
    events: tuple[str, ...]
    state: tuple[str, ...]
    scales: np.ndarray
    simbrake: Callable[[], Any]
    stiff: bool = False


def layers(first: float | None, thickness: float, count: int) -> np.ndarray:
    """Thicknesses of the layers of a wall: equal, or growing by one ratio from the first."""
    if first is None:
        return np.full(count, thickness / count)
    from scipy.optimize import brentq

    total = thickness / first
    q = brentq(lambda q: math.fsum(q**i for i in range(count)) - total, 1.0, 100.0, xtol=1e-15, rtol=1e-15)
    steps = q ** np.arange(count)
    return thickness * steps / steps.sum()


def wall_rates(steps: np.ndarray, conductivity: float, heat: float, front: float, back: float) -> np.ndarray:
    """`dT/dt = rates @ T` of a wall of unit area: volumetric `heat` (J/(m³·K)), `front` and `back` W/(m²·K)."""
    k = len(steps)
    rates = np.zeros((k, k))
    half = steps / (2 * conductivity)
    g = 1 / (half[:-1] + half[1:])
    for i in range(k - 1):
        rates[i, i] -= g[i]
        rates[i, i + 1] += g[i]
        rates[i + 1, i + 1] -= g[i]
        rates[i + 1, i] += g[i]
    for i, h in ((0, front), (k - 1, back)):
        rates[i, i] -= h / (1 + h * half[i])
    return rates / (heat * steps)[:, None]


TRACK = 2 * math.pi * 0.725 * 0.23
RIM = {"thickness": 0.028, "conductivity": 48.0, "density": 7800.0, "specific_heat": 500.0}
LINING = {"thickness": 0.030, "conductivity": 0.8, "density": 2000.0, "specific_heat": 1100.0}
SHARE, INSIDE, OUTSIDE, OPEN, OVERLAP = 0.95, 60.0, 60.0, 0.25, 0.75


def _rim(first: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Rates and heat of a rim of 20 layers that is cooled on the inside and on the open quarter of its track."""
    steps, heat = layers(first, RIM["thickness"], 20), RIM["density"] * RIM["specific_heat"]
    half = steps[0] / (2 * RIM["conductivity"])
    # only a quarter of the face cools, through half a layer under the whole of it
    outside = 1 / (1 / (OPEN * OUTSIDE) + half)
    rates = wall_rates(steps, RIM["conductivity"], heat, 0.0, INSIDE)
    rates[0, 0] -= outside / (heat * steps[0])
    into = np.zeros(20)
    into[0] = SHARE / (heat * steps[0] * TRACK)
    return rates, into


def _lining(first: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates and heat of a lining of 12 layers whose back is insulated."""
    steps, heat = layers(first, LINING["thickness"], 12), LINING["density"] * LINING["specific_heat"]
    into = np.zeros(12)
    into[0] = (1 - SHARE) / (heat * steps[0] * OVERLAP * TRACK)
    return wall_rates(steps, LINING["conductivity"], heat, 0.0, 0.0), into


def _dry() -> Stop:
    return Stop()


def _layered() -> Stop:
    rates, into = _rim(None)
    return Stop(fade=3e-4, x_0=8e3 / 2e5, rates=rates, into=into)


def _stiff() -> Stop:
    (rim, rim_into), (lining, lining_into) = _rim(1e-6), _lining(10e-6)
    rates = np.zeros((32, 32))
    rates[:20, :20], rates[20:, 20:] = rim, lining
    return Stop(fade=3e-4, x_0=8e3 / 2e5, rates=rates, into=np.concatenate([rim_into, lining_into]))


def _simbrake_stop(p: Stop, kind: str) -> Any:
    import simbrake as sb

    law, heat = sb.ConstantFriction(p.f), None
    if kind != "dry":
        law = sb.ProductFriction(law, (sb.LinearFade(p.fade, ROOM),))
        heat = _simbrake_heat(kind)
    linings = sb.Lining(law, np.full(p.n, 2 * math.atan(p.z)))
    brake = sb.Brake(sb.Pulley(p.R, p.J), sb.Band(p.R, p.C), linings)
    duty = sb.Duty(sb.Constant(p.T_0), sb.TorqueLoad())
    return sb.Scene(brake, duty, sb.Initial(p.w_0, p.x_0), p.end, heat)


def _simbrake_heat(kind: str) -> Any:
    import simbrake as sb

    def wall(name: str, numbers: dict[str, float], area: float, steps: np.ndarray) -> Any:
        material = sb.Material(numbers["conductivity"], numbers["density"], numbers["specific_heat"])
        growth = float(steps[1] / steps[0])
        return sb.Wall(name, material, numbers["thickness"], area, len(steps), growth)

    rim = wall("rim", RIM, TRACK, layers(1e-6 if kind == "stiff" else None, RIM["thickness"], 20))
    bodies: tuple[Any, ...] = (rim, sb.Reservoir("air"))
    if kind == "stiff":
        bodies = (rim, wall("lining", LINING, OVERLAP * TRACK, layers(10e-6, LINING["thickness"], 12)), bodies[1])
    lining = "lining.front" if kind == "stiff" else None
    return sb.Heat(
        bodies=bodies,
        links=(sb.Convection("rim.back", TRACK, INSIDE), sb.Convection("rim.front", OPEN * TRACK, OUTSIDE)),
        friction=sb.FrictionHeat("rim.front", lining, sb.ConstantPartition(SHARE), sensed="rim.front"),
        rim="rim.front",
    )


def _stop_case(name: str, kind: str, title: str, plain: Stop, stiff: bool = False) -> Case:
    nodes = 0 if plain.rates is None else len(plain.rates)
    events = ("full slip", "stop") if plain.x_0 else ("slip onset", "full slip", "stop")
    state = ("angle, rad", "elongation, m", *(f"node {i}, K" for i in range(nodes)))
    scales = np.array([10.0, 0.3] + [10.0] * nodes)
    return Case(name, title, plain, events, state, scales, lambda: _simbrake_stop(plain, kind), stiff)


def _simbrake_staged(p: Staged) -> Any:
    import simbrake as sb

    brake = sb.Brake(
        sb.Pulley(p.R, p.J),
        sb.Band(p.R_b),
        sb.Lining(sb.ConstantFriction(p.f_ext), np.full(p.n, 2 * math.atan(p.z))),
        sb.Bandage(p.J_b, sb.ConstantFriction(p.f_int), p.preload),
    )
    lever = sb.ExponentialRise(p.level, p.tau, -p.ahead)
    return sb.Scene(brake, sb.Duty(lever, sb.TorqueLoad(sb.Constant(p.load))), sb.Initial(p.w_0), p.end)


def _staged_case() -> Case:
    p = Staged()
    return Case(
        "d",
        "staged brake on a rigid band: 5 states, 3 events",
        p,
        ("internal slip", "external lock", "stop"),
        ("angle, rad", "heat of the band's pair, J", "heat of the rim's pair, J"),
        np.array([10.0, 1e5, 1e5]),
        lambda: _simbrake_staged(p),
    )


def _simbrake_cycles(p: Cycles) -> Any:
    import simbrake as sb

    rim, linings, band = p.capacities
    heat = sb.lumped_heat(
        rim=rim,
        linings=linings,
        band=band,
        partition=sb.ConstantPartition(p.share),
        rim_cooling=p.cooling[0],
        band_cooling=p.cooling[1],
        lining_to_band=p.between,
        temperature=ROOM,
        ambient=ROOM,
    )
    law = sb.ProductFriction(sb.ConstantFriction(p.f), (sb.LinearFade(p.fade, ROOM),))
    brake = sb.Brake(sb.Pulley(p.R, p.J), sb.Band(p.R), sb.Lining(law, np.full(p.n, 2 * math.atan(p.z))))
    lever = sb.Repeated(list(p.times), list(p.tensions), p.period, p.count)
    duty = sb.Duty(lever, sb.TorqueLoad(sb.Constant(p.load), p.drag))
    return sb.Scene(brake, duty, sb.Initial(0.0), p.period * p.count, heat)


def _cycles_case() -> Case:
    p = Cycles()
    state = ("angle, rad", "rim, K", "linings, K", "band, K")
    title = f"{p.count} stops with cooling in between, fade: 5 states, {2 * p.count} events, {4 * p.count} corners"
    scales = np.array([1e3, 50.0, 50.0, 50.0])
    return Case("f", title, p, ("restart", "stop") * p.count, state, scales, lambda: _simbrake_cycles(p))


CASES: dict[str, Case] = {
    case.name: case
    for case in (
        _stop_case("a", "dry", "stop without heat: 3 states, 3 events", _dry()),
        _stop_case("b", "layered", "stop with a rim of 20 layers and fade: 23 states, 2 events", _layered()),
        _stop_case(
            "c", "stiff", "the same with layers from 1 µm on, and linings: 35 states, stiff", _stiff(), stiff=True
        ),
        _staged_case(),
        _cycles_case(),
    )
}


def closed_form(p: Stop) -> Answer:
    """Events and end of a stop without heat (Z-15…Z-18, and the angle by integration of the same)."""
    chi = math.sqrt(p.C * p.R**2 / p.J)
    t_0 = p.T_0 / (p.C * p.R * p.w_0)
    t_1 = t_0 + math.asin(chi * p.T_0 * (p.Pi - 1) / (p.C * p.R * p.w_0)) / chi
    w_1, slowing = p.w_0 * math.cos(chi * (t_1 - t_0)), p.R * p.T_0 * (p.Pi - 1) / p.J
    stop = t_1 + w_1 / slowing
    angle = p.T_0 * p.Pi / (p.C * p.R) + w_1**2 / (2 * slowing)
    return Answer(np.array([t_0, t_1, stop]), np.array([angle, p.T_0 * p.Pi / p.C]), 0, 0)
