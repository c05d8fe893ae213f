"""Scenes of the work–precision benchmark: plain numbers for other tools, and the same
as a scene of simbrake.

Every scene names its events and the state that is compared at its end; both lie in
`Answer` in the scene's order.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks.walls import (
    INSIDE,
    LINING,
    OPEN,
    OUTSIDE,
    OVERLAP,
    RIM,
    SHARE,
    TRACK,
    layers,
    lining_wall,
    rim_wall,
)

ROOM = 293.15  # K


class Answer(NamedTuple):
    """What a run gives: times of the scene's events (s), its final state, and the work
    it took."""

    times: np.ndarray
    state: np.ndarray
    evaluations: int  # of right-hand sides
    steps: int  # accepted steps


@dataclasses.dataclass(frozen=True)
class Stop:
    """A stop of one band under a constant lever, from `x_0` on; with heat where `rates`
    is given.

    - `rates` (k, k) in 1/s: how temperatures above room change by conduction and
      cooling; `into` (k,) in K/J: what friction heat does to them. Friction sees node
      0: `f = f_0 (1 − s T_0)`
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
    """A stop of a staged brake on a rigid band as its actuator fills,
    `T_0 = p (1 − exp(−(t + t_a)/τ))` (model §4)."""

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
class Chain:
    """The onset of slip lining by lining: a chain on segments of the band (model §3.1),
    from the onset `T_i = T_0` on.

    - `K`, `C` (N/m) of the segments between linings and to the anchor; `m` (kg) of a
      lining; `zeta`: damping ratio of the segments between linings, that to the anchor
      has no damper
    """

    R: float = 0.623
    J: float = 1200.0
    C: float = 1e5
    K: float = 1e7
    m: float = 3.5
    zeta: float = 0.05
    T_0: float = 2e3
    w_0: float = 6.0
    f: float = 0.35
    n: int = 20
    z: float = math.tan(math.radians(13.5) / 2)
    end: float = 0.03

    @property
    def stiffness(self) -> np.ndarray:
        """Of the segments (n,), the last one to the anchor."""
        return np.array([self.K] * (self.n - 1) + [self.C])

    @property
    def stretch(self) -> np.ndarray:
        """Elongations (n,) that the tension of full slip gives."""
        fz = self.f * self.z
        return self.T_0 * ((1 + fz) / (1 - fz)) ** self.n / self.stiffness


@dataclasses.dataclass(frozen=True)
class Cycles:
    """Load lowered and stopped again and again: rigid band, lever in straight lines,
    rim, linings and band as lumps.

    - `times`, `tensions`: of the lever in one cycle; at the third point it has let go,
      at the fourth it takes hold
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
    # J/K: rim, linings, band
    capacities: tuple[float, float, float] = (1.5e5, 4e4, 2e4)
    cooling: tuple[float, float] = (150.0, 40.0)  # W/K: rim, band
    between: float = 60.0  # W/K: linings to band


@dataclasses.dataclass(frozen=True)
class Case:
    """One scene: `plain` its numbers, `simbrake()` the same for simbrake, `events` and
    `scales` of the final state."""

    name: str
    title: str
    plain: Any
    events: tuple[str, ...]
    state: tuple[str, ...]
    scales: np.ndarray
    simbrake: Callable[[], Any]
    stiff: bool = False


def _dry() -> Stop:
    return Stop()


def _layered() -> Stop:
    rates, into = rim_wall(None)
    return Stop(fade=3e-4, x_0=8e3 / 2e5, rates=rates, into=into)


def _stiff() -> Stop:
    (track, track_into) = rim_wall(1e-6)
    (faces, faces_into) = lining_wall(10e-6)
    rates = np.zeros((32, 32))
    rates[:20, :20] = track
    rates[20:, 20:] = faces
    return Stop(
        fade=3e-4,
        x_0=8e3 / 2e5,
        rates=rates,
        into=np.concatenate([track_into, faces_into]),
    )


def _simbrake_stop(p: Stop, kind: str) -> Any:
    import simbrake as sb

    law = sb.ConstantFriction(p.f)
    heat = None
    if kind != "dry":
        law = sb.friction.ProductFriction(law, (sb.LinearFade(p.fade, ROOM),))
        heat = _simbrake_heat(kind)
    linings = sb.Lining(law, np.full(p.n, 2 * math.atan(p.z)))
    brake = sb.Brake(sb.Pulley(p.R, p.J), sb.Band(p.R, p.C), linings)
    duty = sb.Duty(sb.Constant(p.T_0), sb.TorqueLoad())
    return sb.Scene(brake, duty, sb.Initial(p.w_0, p.x_0), p.end, heat)


def _simbrake_heat(kind: str) -> Any:
    import simbrake as sb

    def wall(
        name: str, numbers: dict[str, float], area: float, steps: np.ndarray
    ) -> Any:
        material = sb.Material(
            numbers["conductivity"], numbers["density"], numbers["specific_heat"]
        )
        growth = float(steps[1] / steps[0])
        return sb.thermal.Wall(
            name, material, numbers["thickness"], area, len(steps), growth
        )

    rim = wall(
        "rim",
        RIM,
        TRACK,
        layers(1e-6 if kind == "stiff" else None, RIM["thickness"], 20),
    )
    bodies: tuple[Any, ...] = (rim, sb.thermal.Reservoir("air"))
    if kind == "stiff":
        bodies = (
            rim,
            wall(
                "lining",
                LINING,
                OVERLAP * TRACK,
                layers(10e-6, LINING["thickness"], 12),
            ),
            bodies[1],
        )
    lining = "lining.front" if kind == "stiff" else None
    return sb.Heat(
        bodies=bodies,
        links=(
            sb.thermal.Convection("rim.back", TRACK, INSIDE),
            sb.thermal.Convection("rim.front", OPEN * TRACK, OUTSIDE),
        ),
        friction=sb.thermal.FrictionHeat(
            "rim.front", lining, sb.thermal.ConstantPartition(SHARE), sensed="rim.front"
        ),
        rim="rim.front",
    )


def _stop_case(
    name: str, kind: str, title: str, plain: Stop, stiff: bool = False
) -> Case:
    nodes = 0 if plain.rates is None else len(plain.rates)
    events = ("full slip", "stop") if plain.x_0 else ("slip onset", "full slip", "stop")
    state = ("angle, rad", "elongation, m", *(f"node {i}, K" for i in range(nodes)))
    scales = np.array([10.0, 0.3] + [10.0] * nodes)
    return Case(
        name,
        title,
        plain,
        events,
        state,
        scales,
        lambda: _simbrake_stop(plain, kind),
        stiff,
    )


def _simbrake_staged(p: Staged) -> Any:
    import simbrake as sb

    brake = sb.Brake(
        sb.Pulley(p.R, p.J),
        sb.Band(p.R_b),
        sb.Lining(sb.ConstantFriction(p.f_ext), np.full(p.n, 2 * math.atan(p.z))),
        sb.Bandage(p.J_b, sb.ConstantFriction(p.f_int), p.preload),
    )
    lever = sb.profiles.ExponentialRise(p.level, p.tau, -p.ahead)
    return sb.Scene(
        brake,
        sb.Duty(lever, sb.TorqueLoad(sb.Constant(p.load))),
        sb.Initial(p.w_0),
        p.end,
    )


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
        partition=sb.thermal.ConstantPartition(p.share),
        rim_cooling=p.cooling[0],
        band_cooling=p.cooling[1],
        lining_to_band=p.between,
        temperature=ROOM,
        ambient=ROOM,
    )
    law = sb.friction.ProductFriction(
        sb.ConstantFriction(p.f), (sb.LinearFade(p.fade, ROOM),)
    )
    brake = sb.Brake(
        sb.Pulley(p.R, p.J),
        sb.Band(p.R),
        sb.Lining(law, np.full(p.n, 2 * math.atan(p.z))),
    )
    lever = sb.Repeated(list(p.times), list(p.tensions), p.period, p.count)
    duty = sb.Duty(lever, sb.TorqueLoad(sb.Constant(p.load), p.drag))
    return sb.Scene(brake, duty, sb.Initial(0.0), p.period * p.count, heat)


def cycles_case(count: int = Cycles.count) -> Case:
    """Scene (f) with so many cycles."""
    p = Cycles(count=count)
    state = ("angle, rad", "rim, K", "linings, K", "band, K")
    title = (
        f"{p.count} stops with cooling in between, fade: 5 states, {2 * p.count} "
        f"events, {4 * p.count} corners"
    )
    scales = np.array([1e3, 50.0, 50.0, 50.0])
    return Case(
        "f",
        title,
        p,
        ("restart", "stop") * p.count,
        state,
        scales,
        lambda: _simbrake_cycles(p),
    )


def _simbrake_chain(p: Chain) -> Any:
    import simbrake as sb

    band = sb.Band(p.R, p.C, sb.Segments(p.K, p.zeta))
    linings = sb.Lining(
        sb.ConstantFriction(p.f), np.full(p.n, 2 * math.atan(p.z)), mass=p.m
    )
    duty = sb.Duty(sb.Constant(p.T_0), sb.TorqueLoad())
    return sb.Scene(
        sb.Brake(sb.Pulley(p.R, p.J), band, linings),
        duty,
        sb.Initial(p.w_0, p.T_0 / p.C),
        p.end,
    )


def _chain_case() -> Case:
    p = Chain()
    order = range(p.n, 0, -1)
    state = ("angle, rad", "speed, rad/s")
    state += tuple(
        f"{what} {i + 1}"
        for what in ("elongation, m,", "speed, m/s, of lining")
        for i in range(p.n)
    )
    scales = np.concatenate([[0.1, 6.0], p.stretch, np.full(p.n, p.R * p.w_0)])
    title = f"{p.n} linings on segments of the band let go: {2 * p.n + 2} states, {p.n} events"
    events = tuple(f"lining {i} slips" for i in order)
    return Case("e", title, p, events, state, scales, lambda: _simbrake_chain(p))


CASES: dict[str, Case] = {
    case.name: case
    for case in (
        _stop_case("a", "dry", "stop without heat: 3 states, 3 events", _dry()),
        _stop_case(
            "b",
            "layered",
            "stop with a rim of 20 layers and fade: 23 states, 2 events",
            _layered(),
        ),
        _stop_case(
            "c",
            "stiff",
            "stop with a rim in layers from 1 µm on, and linings: 35 states, stiff",
            _stiff(),
            stiff=True,
        ),
        _staged_case(),
        _chain_case(),
        cycles_case(),
    )
}


def closed_form(p: Stop) -> Answer:
    """Events and end of a stop without heat (Z-15…Z-18, and the angle by integration of
    the same)."""
    chi = math.sqrt(p.C * p.R**2 / p.J)
    t_0 = p.T_0 / (p.C * p.R * p.w_0)
    t_1 = t_0 + math.asin(chi * p.T_0 * (p.Pi - 1) / (p.C * p.R * p.w_0)) / chi
    w_1 = p.w_0 * math.cos(chi * (t_1 - t_0))
    slowing = p.R * p.T_0 * (p.Pi - 1) / p.J
    stop = t_1 + w_1 / slowing
    angle = p.T_0 * p.Pi / (p.C * p.R) + w_1**2 / (2 * slowing)
    return Answer(
        np.array([t_0, t_1, stop]), np.array([angle, p.T_0 * p.Pi / p.C]), 0, 0
    )
