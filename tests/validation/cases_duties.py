"""Validation of duties: a programme in words, phases, masses taken and set down, profiles, several bands, reserves.

Truths are closed forms; roots and derivatives of them stand beside.
"""

import cmath
import functools
import math
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from case_tools import FORM, Case, Row, Slope, cases_of_run, cases_with_slopes, differentiated
from cases_shaft import disc, stop_of
from scipy.integrate import quad
from scipy.optimize import brentq
from stop_scenes import closed_form, scene_of, staged_pair, stop_scene, time_of

from simbrake import (
    Band,
    Bandage,
    Brake,
    Constant,
    ConstantFriction,
    Duty,
    Heat,
    HookLoad,
    Initial,
    Lining,
    PiecewiseLinear,
    Pulley,
    Repeated,
    Result,
    Scene,
    TorqueLoad,
    TrippingLoad,
    Wear,
    programme_scene,
    uniform_linings,
    with_values,
)
from simbrake.brakes import LinedBand, MultiBandBrake, UniformWear
from simbrake.friction import FrictionWithMemory, MemoryProcess
from simbrake.loads import GRAVITY, Actuator, Phase, Phases
from simbrake.profiles import FunctionProfile
from simbrake.results import lining_peak
from simbrake.thermal import ROOM, Conductance, ConstantPartition, FrictionHeat, Lump, Reservoir
from simbrake.wear import ConstantWear

#: tension ratio of the linings of most brakes here: of 20 over 270°, and of 4 of 50°
_PI_20, _PI_4 = closed_form()["Pi"], closed_form(n=4, beta=50.0)["Pi"]

# --- programmes, phases, masses ---------------------------------------------------------------------------------------


def programme_cases() -> list[Case]:
    """Two cycles in words: take the string, lower 12 m at 1.2 m/s, brake, set it down, wait; a stand more each time."""
    J, per_rad, speed, a, pull, ramp, lowered = 1200.0, 0.4 / 8, 1.2, 0.5, 25e3, 0.35, 12.0
    gain = 0.623 * (_PI_20 - 1)
    masses = (45e3, 47e3)
    # the lever begins where it holds the first string
    first = masses[0] * GRAVITY * per_rad / gain

    def braked(m: float) -> tuple[float, float]:
        """Time and travel of a stop under a pull that rises in a straight line, and then stays."""
        whole, M, omega = J + m * per_rad**2, m * GRAVITY * per_rad, speed / per_rad
        low, rise = (M - gain * first) / whole, -gain * (pull - first) / ramp / whole
        later = omega + low * ramp + rise * ramp**2 / 2
        angle = omega * ramp + low * ramp**2 / 2 + rise * ramp**3 / 6
        slowing = (gain * pull - M) / whole
        return ramp + later / slowing, per_rad * (angle + later**2 / (2 * slowing))

    run_up = speed**2 / (2 * a)
    lowering = speed / a + (lowered - run_up) / speed
    stops = [braked(m) for m in masses]
    end = sum(lowering + time + 3.0 for time, _ in stops)
    travels = [lowered + travel for _, travel in stops]
    work = sum(m * GRAVITY * travel for m, travel in zip(masses, travels, strict=True))
    brake = Brake(Pulley(0.59, J), Band(0.623), uniform_linings(20, math.radians(270.0), ConstantFriction(0.35)))
    words = ("take the string", "lower 12 m at 1.2 m/s", "brake to rest", "set the string in the slips")
    scene = programme_scene(
        brake,
        (*words, "wait 3 s", "repeat 2 times"),
        HookLoad(masses[0], 0.4, 8.0),
        pull,
        lever_time=ramp,
        acceleration=a,
        empty=5e3,
        stand=masses[1] - masses[0],
    )

    def ended(k: int) -> Callable[[Result], float]:
        return lambda result: [e.time for e in result.events if e.name == "phase_end"][k]

    def tension(t: float) -> Callable[[Result], Any]:
        return lambda result: result.series([t]).slack_tension[0]

    again = lowering + stops[0][0] + 3.0
    balance = f"{FORM}m g r/(n R_b (Π − 1))"
    rows: list[Row] = [
        ("lowering ends", f"{FORM}v/a + (s − v²/2a)/v", lowering, ended(0)),
        ("first stop", f"{FORM}J ω̇ = m g r/n − R_b (Π − 1) T_0(t)", lowering + stops[0][0], ended(1)),
        ("end", f"{FORM}both cycles, the second with a stand more", end, "record.t_end"),
        ("travel", f"{FORM}Σ (s + travel of the stop)", sum(travels), lambda r: r.series([end]).hook_position[0]),
        ("tension while lowering", balance, masses[0] * GRAVITY * per_rad / gain, tension(6.0)),
        ("tension with a stand more", balance, masses[1] * GRAVITY * per_rad / gain, tension(again + 6.0)),
        (
            "tension while it speeds up",
            f"{FORM}(m g r/n − J a n/r)/(R_b (Π − 1))",
            (masses[0] * GRAVITY * per_rad - (J + masses[0] * per_rad**2) * a / per_rad) / gain,
            tension(1.0),
        ),
        ("friction heat", f"{FORM}Σ m_k g s_k: from rest to rest", work, "energy.friction_heat"),
    ]
    return cases_of_run("programme in words", scene, rows, 1e-10)


def turned_cases() -> list[Case]:
    """Two cycles in words, the driller at the lever throughout; the band is turned end for end between them."""
    m, per_rad, speed, a, lowered, slowed = 40e3, 0.4 / 8, 1.2, 0.5, 12.0, 3.0
    n, f, area, k = 6, 0.35, 0.04, 5e-14
    angle = math.radians(270.0 / n)
    travel = lowered + speed * slowed / 2
    time = speed / a + (lowered - speed**2 / (2 * a)) / speed + slowed
    mu = (1 + f * math.tan(angle / 2)) / (1 - f * math.tan(angle / 2))
    shares = mu ** np.arange(n) * (mu - 1) / (mu**n - 1)
    worn = k * m * GRAVITY * travel * shares * math.cos(angle / 2) / (f * area)
    work = f"{FORM}m g s: from rest to rest"
    depth = f"{FORM}k cos(β/2)/(f A) m g s (s_i + s_(n+1−i)), s_i = Π^(i−1)"
    turned: Any = worn + worn[::-1]
    rows: list[Row] = [
        ("end", f"{FORM}2 (v/a + (s − v²/2a)/v + t_b)", 2 * time, "record.t_end"),
        ("friction heat", work, 2 * m * GRAVITY * travel, "energy.friction_heat"),
        ("wear of the first lining", depth, turned[0], "worn_thickness.0"),
        ("wear of the third lining", depth, turned[2], "worn_thickness.2"),
    ]
    scene = programme_scene(
        Brake(Pulley(0.59, 1200.0), Band(0.623), uniform_linings(n, n * angle, ConstantFriction(f), area=area)),
        ("lower 12 m at 1.2 m/s", "brake to rest in 3 s", "turn the band after 1 cycle", "repeat 2 times"),
        HookLoad(m, per_rad * 8.0, 8.0),
        25e3,
        acceleration=a,
        wear=Wear(ConstantWear(k)),
    )
    return cases_of_run("programme with a turned band", scene, rows, 1e-10)


def cooling_cases() -> list[Case]:
    """A stop whose rim loses heat meanwhile, and a phase that ends as it has cooled down to a level."""
    C, G, level, J, w0 = 3e3, 60.0, ROOM + 25.0, 800.0, 20.0
    M = 0.725 * 8e3 * (_PI_4 - 1)
    stop, b, alpha = J * w0 / M, G / C, M / J
    # C ΔT' = M (ω_0 − α t) − G ΔT
    rise = M / G * ((w0 + alpha / b) * -math.expm1(-b * stop) - alpha * stop)
    cooled = stop + math.log(rise / (level - ROOM)) / b
    lost = J * w0**2 / 2 - C * (level - ROOM)
    heat = Heat(
        (Lump("rim", C), Reservoir("air", ROOM)),
        (Conductance("rim", "air", G),),
        FrictionHeat("rim", None, ConstantPartition(1.0)),
        rim="rim",
    )
    ends = f"temperature of the rim below {level} K"
    lever = Phases((Phase(Constant(8e3), "rest"), Phase(Constant(8e3), ends)))
    scene = stop_scene(n=4, beta=50.0, C=None)
    scene = Scene(scene.brake, Duty(lever, scene.duty.load), scene.initial, 400.0, heat)
    rows: list[Row] = [
        (
            "rise at rest",
            f"{FORM}C ΔT' = M (ω_0 − M t/J) − G ΔT",
            rise,
            lambda r: r.series([stop]).temperature[0, 0] - ROOM,
        ),
        ("end", f"{FORM}t_s + (C/G) ln(ΔT_s/ΔT)", cooled, "record.t_end"),
        ("heat lost", f"{FORM}J ω_0²/2 − C ΔT", lost, "energy.heat_lost"),
    ]
    return cases_of_run("phase that ends cool", scene, rows, 1e-10)


def tripping_cases() -> list[Case]:
    """A string that the moving hook takes and sets down twice, a stand more the second time: speed, and work."""
    J, per_rad, empty, string, pull, w0 = 1200.0, 0.05, 5e3, 40e3, 4e3, 12.0
    gain = 0.725 * (_PI_20 - 1)
    marks, end = (0.5, 1.5, 2.5, 3.5), 3.8  # of two cycles of 2 s

    def course(stand: complex = 4e3) -> tuple[complex, complex, complex]:
        """Speed and angle at the end, and the work of the load with what the masses bring."""
        omega, phi, work, m, t = w0, 0.0, 0.0, empty, 0.0
        hung = (string, 0.0, string + stand, 0.0)
        for mark, more in zip((*marks, end), (*hung, 0.0), strict=True):
            dt, M = mark - t, m * GRAVITY * per_rad
            alpha = (M - gain * pull) / (J + m * per_rad**2)
            angle = omega * dt + alpha * dt**2 / 2
            omega, phi, work, t = omega + alpha * dt, phi + angle, work + M * angle, mark
            if mark != end:
                work += (empty + more - m) * (per_rad * omega) ** 2 / 2
                m = empty + more
        return omega, phi, work

    omega, phi, work = (complex(x).real for x in course())
    load = TrippingLoad(empty, string, 4e3, marks[0], marks[1], 2.0, 0.4, 8.0, 2)
    rows: list[Row] = [
        ("speed", f"{FORM}ω̇ = (m_k g r/n − M_b)/J_k", omega, "record.y_end.omega"),
        ("travel", f"{FORM}Σ (ω t + α t²/2) r/n", per_rad * phi, lambda r: r.series([end]).hook_position[0]),
        ("load work", f"{FORM}Σ m_k g s_k + Σ Δm v²/2", work, "energy.load_work"),
        ("friction heat", f"{FORM}M_b φ", gain * pull * phi, "energy.friction_heat"),
        ("energy-balance residual", "first law", 0.0, "energy.closure", 1e-12),
        (
            "∂(speed)/∂Δm",
            f"{FORM}the speed, differentiated",
            differentiated(lambda x: course(x)[0], 4e3),
            Slope("duty.load.stand"),
            1e-9,
        ),
    ]
    scene = stop_scene(C=None, J=J, T0=pull, w0=w0, load=load, end=end)
    return cases_with_slopes("masses in motion", scene, rows, lambda result: result.record.y_end.omega)


# --- profiles ---------------------------------------------------------------------------------------------------------


def repeated_cases() -> list[Case]:
    """Two pulls by an actuator with dead time, lag and spring, and the stop under the force that stays after them."""
    times, values, count, begin = (0.0, 0.25, 0.25, 0.6), (1.5e3, 5e3, 7e3, 2.5e3), 2, 0.1
    tau, dead, spring, period, J, w0 = 0.15, 0.08, 200.0, 0.8, 800.0, 20.0
    gain = 0.725 * (_PI_4 - 1)

    def pieces(tau: complex, period: complex) -> list[tuple[complex, ...]]:
        """Begin and end, force and command at the begin, slope of the command."""
        at = [begin + k * period + t for k in range(count) for t in times]
        level = [v for _ in range(count) for v in values]
        F, found = complex(values[0]), []
        for i, (t, low) in enumerate(zip(at, level, strict=True)):
            last = i == len(at) - 1
            t_end, high = (99.0, low) if last else (at[i + 1], level[i + 1])
            if t_end == t:
                continue
            m = (high - low) / (t_end - t)
            found.append((t + dead, t_end + dead, F, low, m))
            F = high - tau * m + (F - low + tau * m) * cmath.exp(-(t_end - t) / tau)
        return [(0.0, begin + dead, complex(values[0]), values[0], 0.0), *found]

    def force(t: float, tau: complex = tau, period: complex = period) -> complex:
        start, _, F, u, m = next(p for p in reversed(pieces(tau, period)) if complex(p[0]).real <= t)
        return u + m * (t - start) - tau * m + (F - u + tau * m) * cmath.exp(-(t - start) / tau) - spring

    def impulse(t: float, tau: complex = tau, period: complex = period) -> complex:
        whole = 0.0
        for start, stop, F, u, m in pieces(tau, period):
            s = (t if t < complex(stop).real else stop) - start
            if complex(s).real > 0:
                steady = (u - tau * m - spring) * s + m * s * s / 2
                whole += steady + (F - u + tau * m) * tau * (1 - cmath.exp(-s / tau))
        return whole

    time: Any = brentq(lambda t: gain * impulse(t).real - J * w0, 0.1, 20.0, xtol=1e-15)
    pull = force(time).real
    source = f"{FORM}∫ (F − F_s) dt = J ω_0/R(Π − 1), F by τ F' + F = u(t − t_d) from point to point"
    rows: list[Row] = [("stopping time", source, time, "stopping_time")]
    for t, words in ((0.15, "before the pulls"), (0.5, "in the first"), (1.2, "in the second"), (1.9, "after them")):
        read = functools.partial(lambda result, t: result.series([t]).slack_tension[0], t=t)
        rows.append((f"force {words}", f"{FORM}τ F' + F = u(t − t_d)", force(t).real, read))
    lever = "duty.slack_tension"
    for name, path, of, x in (
        ("τ", f"{lever}.lag", lambda x: impulse(time, tau=x), tau),
        ("(period)", f"{lever}.command.period", lambda x: impulse(time, period=x), period),
    ):
        rows.append(
            (f"∂(stopping time)/∂{name}", f"{source}, differentiated", -differentiated(of, x) / pull, Slope(path), 1e-8)
        )
    command = Repeated(times, values, period, count, begin)
    scene = stop_scene(n=4, beta=50.0, C=None, lever=Actuator(command, tau, dead, spring), end=8.0)
    return cases_with_slopes("repeated pulls", scene, rows)


def function_cases() -> list[Case]:
    """A lever as a function of time with a jump, and a load that jumps at a given instant."""
    rise, early, later, jump, at, J, w0 = 9e3, 2e3, 11e3, 0.5, 0.9, 800.0, 20.0
    gain, loads = 0.725 * (_PI_4 - 1), (2e3, 6e3)

    def lever(t: Any, force: Any) -> Any:
        return jnp.where(t < jump, force[0] + force[1] * t**2, force[2])

    def time(at: complex = at, rise: complex = rise) -> complex:
        pulled = gain * (early * jump + rise * jump**3 / 3 + later * (at - jump))
        left = J * w0 + loads[0] * at - pulled
        return at + left / (gain * later - loads[1])

    profile = FunctionProfile(lever, np.array([early, rise, later]), typical=later, knots=[jump])
    source = f"{FORM}J ω_0 = ∫ (R_b (Π − 1) T_0(t) − M(t)) dt"
    rows: list[Row] = [
        ("stopping time", source, time().real, "stopping_time"),
        (
            "lever just before the jump",
            f"{FORM}T_0(t) of its piece",
            early + rise * jump**2,
            lambda _: profile.value(jump, 0),
            1e-9,
        ),
        ("lever after the jump", f"{FORM}T_0(t) of its piece", later, lambda _: profile.value(jump, 1), 1e-15),
        (
            "∂(stopping time)/∂t_1",
            f"{source}, differentiated",
            differentiated(time, at),
            Slope("duty.load.profile.times"),
            1e-9,
        ),
        (
            "∂(stopping time)/∂a",
            f"{source}, differentiated",
            differentiated(lambda x: time(rise=x), rise),
            Slope("duty.slack_tension.parameters.1"),
            1e-9,
        ),
    ]
    load = TorqueLoad(PiecewiseLinear([at, at], loads))
    return cases_with_slopes(
        "lever as a function", stop_scene(n=4, beta=50.0, C=None, lever=profile, load=load, end=8.0), rows
    )


# --- several bands, and what brakes hold ------------------------------------------------------------------------------

_ANGLES = np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6])
_FRICTION = np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28)


def _two_bands(load: float, w0: float) -> Scene:
    """The scene of "several bands" under another load, so that it shares the program."""
    bands = tuple(
        LinedBand(Lining(ConstantFriction(f), angle), C)
        for f, angle, C in zip(_FRICTION, _ANGLES, (2e5, 3.5e5), strict=True)
    )
    brake = MultiBandBrake(Pulley(0.59, 1200.0), 0.623, bands)
    return Scene(brake, Duty(Constant(6e3), TorqueLoad(Constant(load))), Initial(w0), 6.0)


def _edges(k: int) -> Callable[[Result], Any]:
    """Greatest ratio over a run of the pressures at both edges of a lining."""
    return lambda result: lining_peak(result, "edge_pressure_ratio")[k]


def bands_cases() -> list[Case]:
    """Tension behind every lining of two bands, and its load: while they slide, and while they hold part of it."""
    R_b = 0.623
    ratio = [(1 + f * np.tan(a / 2)) / (1 - f * np.tan(a / 2)) for f, a in zip(_FRICTION, _ANGLES, strict=True)]
    # equal elongation at the tight end: T_0,j Π_j/C_j is the same
    yields = np.array([C / np.prod(mu) for C, mu in zip((2e5, 3.5e5), ratio, strict=True)])
    slack = 6e3 * yields / yields.sum()
    full = [T_0 * np.append(1.0, np.cumprod(mu)) for T_0, mu in zip(slack, ratio, strict=True)]
    torques = np.array([R_b * (T[-1] - T[0]) for T in full])
    load = 0.6 * torques.sum()
    # of what they hold each has that part which it has of the maximum, from the slack end on
    held = [np.minimum(T, T[0] + 0.6 * (T[-1] - T[0])) for T in full]

    def loads(T: Any, angle: Any) -> Any:
        return (T[1:] + T[:-1]) * np.sin(angle / 2)

    def at(field: str, k: int) -> Callable[[Result], Any]:
        return lambda result: getattr(result.series([0.5]), field)[0, k]

    found: list[Case] = []
    for name, scene, along, source in (
        ("while they slide", _two_bands(3e3, 20.0), full, "T_0,j Π_i"),
        ("while they hold", _two_bands(load, 0.0), held, "min(T_0,j Π_i, T_0,j + s M_j/R_b)"),
    ):
        rows: list[Row] = []
        for j, k in ((0, 0), (0, 3), (1, 1), (1, 5)):
            words, place = f"lining {k + 1} of band {j + 1} {name}", 4 * j + k
            rows.append((f"tension, {words}", f"{FORM}{source}", along[j][k + 1], at("tension", place)))
            normal = loads(along[j], _ANGLES[j])[k]
            rows.append((f"load, {words}", f"{FORM}(T_i + T_(i−1)) sin β/2", normal, at("normal_load", place)))
        friction = np.diff(along[1]) * np.cos(_ANGLES[1] / 2)
        rows.append(
            (
                f"friction, lining 1 of band 2 {name}",
                f"{FORM}(T_1 − T_0,j) cos β/2",
                friction[0],
                at("friction_force", 4),
            )
        )
        if name == "while they slide":
            rows.append((f"edges, lining 2 of band 2 {name}", f"{FORM}μ_2", ratio[1][1], _edges(5)))
        else:
            rows.append(("holding reserve", f"{FORM}Σ R_b T_0,j (Π_j − 1)/M", 1 / 0.6, "metrics.min_holding_reserve"))
        found += cases_with_slopes("linings of several bands", scene, rows, program="several bands")
    return found


def memory_of_bands_cases() -> list[Case]:
    """A stop by two bands on a balance beam: one with constant friction, one whose friction falls with time."""
    J, R_b, T_0, w0, f, paces, ends = 1200.0, 0.623, 9e3, 20.0, 0.4, (0.5, 0.2), (0.5, 0.85)
    shares, pace = (0.25, 0.75), sum(paces)
    limit = sum(k * e for k, e in zip(paces, ends, strict=True)) / pace

    def factor(t: Any) -> Any:
        return limit + (1 - limit) * np.exp(-pace * t)

    def torque(t: Any) -> Any:
        found = 0.0
        for share, mu, angle in zip(shares, (_FRICTION[0], f * factor(t)), _ANGLES, strict=True):
            each = np.tan(angle / 2)
            found += share * (np.prod((1 + mu * each) / (1 - mu * each)) - 1)
        return R_b * T_0 * found

    def lost(t: float, moment: int = 0) -> float:
        """`∫ M t^m dt`."""
        return quad(lambda t: torque(t) * t**moment, 0.0, t, epsabs=0.0, epsrel=1e-13)[0]

    time: Any = brentq(lambda t: lost(t) - J * w0, 0.1, 5.0, xtol=1e-15)
    # J ω(t) = ∫_t^{t_s} M dt, so that the angle is ∫ M t dt/J
    turned, source = lost(time, 1) / J, f"{FORM}J ω_0 = ∫ R_b Σ_j T_0,j (Π_j(f c(t)) − 1) dt; quadrature"
    c = f"{FORM}c = c_e + (1 − c_e) e^(−Σ k t), c_e = Σ k c_e,j/Σ k"
    at = 0.5

    def friction(k: int) -> Callable[[Result], Any]:
        return lambda result: result.series([at]).pairs["external"].friction_coefficient[0, k]

    rows: list[Row] = [
        ("stopping time", source, time, "stopping_time"),
        ("angle of the stop", f"{source}: ∫ M t dt/J", turned, "record.y_end.phi"),
        ("torque", source, torque(at), lambda r: r.series([at]).brake_torque[0]),
        ("friction of band 1", "given", _FRICTION[0][1], friction(1)),
        ("friction of band 2", c, f * factor(at), friction(5)),
        ("factor at rest", c, factor(time), lambda r: r.series([time]).friction_memory[0, 6]),
        ("∂(stopping time)/∂ω_0", f"{source}: J/M(t_s)", J / torque(time), Slope("initial.omega")),
    ]
    falling = tuple(MemoryProcess(e, rate=k) for k, e in zip(paces, ends, strict=True))
    laws = ConstantFriction(_FRICTION[0]), FrictionWithMemory(ConstantFriction(f), falling)
    bands = tuple(
        LinedBand(Lining(law, angle), share=share) for law, angle, share in zip(laws, _ANGLES, shares, strict=True)
    )
    brake = MultiBandBrake(Pulley(0.59, J), R_b, bands)
    scene = Scene(brake, Duty(Constant(T_0), TorqueLoad()), Initial(w0), 6.0)
    return cases_with_slopes("memory of several bands", scene, rows)


def reserve_cases() -> list[Case]:
    """Static capacity over load of brakes that hold: one band both ways, a disc, a staged brake, linings on springs."""
    Pi, load = closed_form(n=14, f=0.25, beta=15.0)["Pi"], 2e3
    band: dict[str, Any] = {"n": 14, "beta": 15.0, "f": 0.25, "C": None, "w0": 0.0, "end": 4.0}
    M, reserve = 0.725 * 8e3, "metrics.min_holding_reserve"
    pads = 4 * 0.4 * 1.25 * 20e3 * 0.4
    growing = PiecewiseLinear([0.0, 10.0], [0.0, pads / 2])
    staged = with_values(
        staged_pair(w0=0.0, lever=((0.0, 1e6, 2e6, 3e6), jnp.full(4, 500.0)), end=4.0),
        {"duty.load.profile.level": 300.0},
    )
    outer = with_values(staged, {"brake.bandage.preload": 400.0 / (4 * 1e-14)})
    of_band, least = f"{FORM}R_b T_0 (Π − 1)/M", f"{FORM}that of the weaker pair over M"
    return [
        *cases_of_run(
            "holding reserve", scene_of(8e3, load, **band), [("one band", of_band, M * (Pi - 1) / load, reserve)]
        ),
        *cases_of_run(
            "holding reserve",
            scene_of(8e3, -load, **band),
            [("one band, load backwards", f"{FORM}R_b T_0 (1 − 1/Π)/M", M * (1 - 1 / Pi) / load, reserve)],
        ),
        *cases_of_run(
            "holding reserve",
            stop_of(disc(UniformWear()), 20e3, 0.0, growing, 9.0),
            [("disc, at its heaviest", f"{FORM}n f_s F r_e/M(t)", 2 / 0.9, reserve)],
        ),
        *cases_of_run("holding reserve", staged, [("staged, band weaker", least, 500 / 300, reserve)]),
        *cases_of_run("holding reserve", outer, [("staged, rim weaker", least, 400 / 300, reserve)]),
        *_staged_restarts(),
        *_sprung_reserves(),
    ]


def _staged_restarts() -> list[Case]:
    """A load that grows until the weaker pair of a staged brake at rest gives way, downwards and upwards."""
    found, M_0, rate, M_b = [], 10.0, 200.0, 500.0
    source = f"{FORM}when M_0 + s t is the capacity of the weaker pair, R_b T_0 (Π − 1), upwards R_b T_0 (1 − 1/Π)"
    upwards = M_b / closed_form(n=4, f=0.5, beta=60.0)["Pi"]
    for words, preload, sense, most in (
        *(("band weaker", 600.0, 1.0, M_b), ("rim weaker", 400.0, 1.0, 400.0)),
        *(("band weaker, upwards", 600.0, -1.0, upwards), ("rim weaker, upwards", 30.0, -1.0, 30.0)),
    ):
        scene = staged_pair(M_i=preload, w0=0.0, lever=((0.0, 1e6, 2e6, 3e6), jnp.full(4, M_b)), end=4.0)
        load = TorqueLoad(PiecewiseLinear([0.0, 10.0], [sense * M_0, sense * (M_0 + 10.0 * rate)]))
        scene = Scene(scene.brake, Duty(scene.duty.slack_tension, load), scene.initial, 4.0)
        rows: list[Row] = [(words, source, (most - M_0) / rate, time_of("restart"))]
        found += cases_with_slopes("staged brake breaks away", scene, rows)
    return found


def _sprung_reserves() -> list[Case]:
    """The scene of "linings on springs" at rest, each lining in its weaker pair; and how they share a smaller load.

    Each takes the same share `θ` of what the rim grips, `R_b (T − T_before) = θ r f ((T + T_before) sin β/2 + N)`, but
    no more than the band, `T ≤ μ T_before`.
    """
    half, load, T_0, r, R_b = math.radians(25.0), 1500.0, 6e3, 0.59, 0.64
    mu = (1 + 0.4 * math.tan(half)) / (1 - 0.4 * math.tan(half))
    found = []
    for words, preload in (("band weaker", (6e5, 9e5)), ("rim weaker", (1500.0, 900.0)), ("one each", (1500.0, 9e5))):

        def along(share: float, preload: tuple[float, float] = preload) -> list[float]:
            T = [T_0]
            for N in preload:
                k = share * r * 0.2
                free = ((R_b + k * math.sin(half)) * T[-1] + k * N) / (R_b - k * math.sin(half))
                T.append(min(mu * T[-1], free))
            return T

        bandage = Bandage(
            [1.2, 1.5],
            ConstantFriction(0.2),
            list(preload),
            spring=np.array([2e3]),
            spring_damping=0.05,
        )
        linings = Lining(ConstantFriction(0.4), np.full(2, math.radians(50.0)))
        lever = PiecewiseLinear([0.0, 0.3], [T_0, T_0])
        brake = Brake(Pulley(0.59, 200.0), Band(R_b), linings, bandage)
        scene = Scene(brake, Duty(lever, TorqueLoad(Constant(load))), Initial(0.0), 2.0)
        most = along(1.0)[-1] - T_0
        share: Any = brentq(lambda x, T=along: R_b * (T(x)[-1] - T_0) - load, 0.0, 1.0, xtol=1e-16)
        rows: list[Row] = [
            (
                f"on springs, {words}",
                f"{FORM}R_b (T_n − T_0)/M, each lining in its weaker pair",
                R_b * most / load,
                "metrics.min_holding_reserve",
            ),
            (
                f"on springs, {words}, tension between the linings",
                f"{FORM}R_b (T_i − T_(i−1)) = θ r f (N_i + N_pre) up to T_i = μ T_(i−1), Σ = M",
                along(share)[1],
                lambda result: result.series([1.0]).tension[0, 0],
            ),
        ]
        found += cases_with_slopes("holding reserve", scene, rows, program="linings on springs")
    return found


CASES = (
    programme_cases,
    turned_cases,
    cooling_cases,
    tripping_cases,
    repeated_cases,
    function_cases,
    bands_cases,
    memory_of_bands_cases,
    reserve_cases,
)
