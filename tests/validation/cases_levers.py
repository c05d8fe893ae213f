"""Validation of levers and what hangs on the hook: levers of one and two band ends, by speed, free fall, tackle."""

import cmath
import dataclasses
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import FORM, Case, Slope, cases_of, cases_with_slopes, differentiated, frozen_cases
from stop_scenes import Number, closed_form, points, scene_of, stop_scene, time_of

from simbrake import (
    Constant,
    ConstantFriction,
    Driller,
    Duty,
    HookLoad,
    Lever,
    LinearFade,
    PiecewiseLinear,
    Result,
    Scene,
    SpeedHold,
    TorqueLoad,
    lumped_heat,
    simulate,
)
from simbrake.brakes import grip, tension_ratio
from simbrake.friction import ProductFriction
from simbrake.loads import GRAVITY, Actuator, AtTemperature, Phase, Phases, TackleLoss, differential_lever_tension
from simbrake.thermal import ROOM, ConstantPartition

_KHURMI = "Khurmi & Gupta, Theory of Machines"
#: linings of every band here with a lever: one compiled program for all of them
_N = 14


def _belt(friction: float, wrap: float) -> dict[str, Any]:
    """Linings that together are a belt, `Π = e^{μ φ}`: `f tan(β/2) = tanh(μ β/2)`; `wrap` in degrees."""
    beta = math.radians(wrap) / _N
    return {"n": _N, "beta": wrap / _N, "f": math.tanh(friction * beta / 2) / math.tan(beta / 2)}


# --- levers with one and two ends of the band -------------------------------------------------------------------------


def winch_cases() -> list[Case]:
    """A winch with a differential band: 750 N at 3 m, ends at 25 and 100 mm, 250°, drum 0.8 m, barrel 0.45 m.

    At rest under a load that grows by 1e5 N·m/s until the drum slides.
    """
    F, l, a, b, mu, wrap, radius, barrel, rate = 750.0, 3.0, 0.1, 0.025, 0.25, 250.0, 0.4, 0.225, 1e5
    belt, phi = _belt(mu, wrap), math.radians(wrap)
    Pi = math.exp(mu * phi)
    T_0 = F * l / (a - b * Pi)
    M = radius * T_0 * (Pi - 1)

    def slack(friction: Number) -> jax.Array:
        # by the friction of a belt, through that of linings which are one
        beta = phi / _N
        f = jnp.tanh(friction * beta / 2) / math.tan(beta / 2)
        return differential_lever_tension(F, l, a, b, jnp.prod(tension_ratio(grip(f, jnp.full(_N, beta)))[0]))

    def run() -> tuple[Any, Result, Any]:
        tension, slope = jax.value_and_grad(slack)(mu)
        load = points([0.0, 2 * rate], [0.0, 2.0])
        scene = scene_of(float(tension), load, R=radius, J=500.0, C=None, w0=0.0, end=1.0, **belt)
        result = simulate(scene, rtol=1e-12)
        return (tension, slope), result, result.series([0.9])

    rows = [
        ("tension ratio", f"{_KHURMI}, differential band: e^(μ φ)", Pi, lambda x: x[2].tight_tension[0] / x[0][0]),
        ("slack tension", f"{_KHURMI}: F l/(a − b e^(μ φ))", T_0, "0.0"),
        ("torque", f"{_KHURMI}: R (T_n − T_0)", M, "2.brake_torque.0"),
        ("load that it holds", f"{_KHURMI}: M/r", M / barrel, lambda x: time_of("restart")(x[1]) * rate / barrel),
        (
            "∂(slack tension)/∂μ",
            f"{FORM}b φ e^(μ φ) T_0/(a − b e^(μ φ))",
            b * phi * Pi * T_0 / (a - b * Pi),
            "0.1",
            1e-9,
        ),
        ("slack tension, 30 digits", f"{_KHURMI}, evaluated outside", 87954.7077442486, "0.0"),
    ]
    return cases_of("winch with a differential band", run, 1e-11, rows)


def _on_lever(lever: Lever, load: float, **parts: Any) -> Scene:
    """A rigid band pulled by a lever, under a constant load."""
    return stop_scene(C=None, lever=lever, load=TorqueLoad(points(load)), **parts)


def simple_band_cases() -> list[Case]:
    """A simple band of 270°, an end at 100 mm of a lever of 500 mm, for 225 N·m; and with the drum in reverse."""
    M, F, l, a, mu, radius, J, w0 = 225.0, 100.0, 0.5, 0.1, 0.25, 0.225, 30.0, 20.0
    phi = math.radians(270.0)

    def pull(sense: int) -> float:
        return M / radius * a / l / (sense * math.expm1(sense * mu * phi))

    def time(sense: int, arm: complex = a, friction: complex = mu) -> complex:
        return J * w0 / (radius * F * l / arm * sense * (cmath.exp(sense * friction * phi) - 1))

    # the slope by the coefficient of a lining, of which each bears an equal share of the belt
    beta = phi / _N
    share = 2 * math.tan(beta / 2) * math.cosh(mu * beta / 2) ** 2 / beta
    found = []
    for name, sense, digits in (("forward", 1, 88.9605391354699), ("reversed", -1, 288.960539135470)):
        ends = "T_n" if sense < 0 else "T_0"

        def needed(result: Result, sense: int = sense) -> float:
            return F * M / float(sense * result.series([0.1]).brake_torque[0])

        rows = [
            ("pull for 225 N·m", f"{_KHURMI}, simple band: {ends} a/l", pull(sense), needed),
            ("pull for 225 N·m, 30 digits", f"{_KHURMI}, evaluated outside", digits, needed),
            ("stopping time", f"{FORM}J ω_0/M", time(sense).real, "stopping_time"),
            (
                "∂(stopping time)/∂a",
                f"{FORM}J ω_0/M, differentiated",
                differentiated(lambda x: time(sense, arm=x), a),
                Slope("duty.slack_tension.slack_arm"),
                1e-9,
            ),
            (
                "∂(stopping time)/∂f",
                f"{FORM}J ω_0/M, differentiated",
                differentiated(lambda x: time(sense, friction=x), mu) * share,
                Slope("brake.linings.friction.coefficient"),
                1e-9,
            ),
        ]
        scene = _on_lever(
            Lever(points(F), l, a),
            0.0,
            R=radius,
            J=J,
            w0=sense * w0,
            end=20.0,
            **_belt(mu, 270.0),
        )
        found += cases_with_slopes(f"simple band, {name}", scene, rows, program="band on a lever")
    return found


def fall_cases() -> list[Case]:
    """Free fall of a hook, its inertia that of the pulley, and a brake applied after 0.8 s."""
    gain = 0.725 * (closed_form(n=_N, f=0.25, beta=15.0)["Pi"] - 1)
    lever = Lever(points([0.0, 0.0, 6e4 / gain], [0.0, 0.8, 0.8]), 0.1, 0.1)
    load = 60e3 * 0.4 / 8 * 9.80665
    scene = _on_lever(lever, load, n=_N, beta=15.0, f=0.25, J=1350.0, w0=0.0, end=3.0)
    return frozen_cases(
        "free fall, then brake",
        scene,
        {
            "greatest speed": lambda result: result.series([0.8]).omega[0],
            "stopping time": "stopping_time",
            "friction heat": "energy.friction_heat",
        },
        {"∂(stopping time)/∂t_1": "duty.slack_tension.force.times", "∂(stopping time)/∂l": "duty.slack_tension.arm"},
        program="band on a lever",
    )


# --- levers by speed --------------------------------------------------------------------------------------------------


def hold_cases() -> list[Case]:
    """A load lowered at a steady speed by a brake that fades until the lever can hold it no more."""
    M, f, s, C, limit = 5e3, 0.35, 1e-3, 1e3, 3000.0
    law = ProductFriction(ConstantFriction(f), (LinearFade(s, ROOM, 0.0, 0.0),))
    heat = lumped_heat(rim=C, partition=ConstantPartition(1.0), rim_cooling=0.0)
    cold = stop_scene(n=4, beta=50.0, law=law, lever=SpeedHold(limit), load=M, w0=5.0, C=None, end=6.0)
    scene = Scene(cold.brake, cold.duty, cold.initial, 6.0, heat)

    def at(name: str) -> Callable[[Result], float]:
        return lambda result: np.asarray(getattr(result.series([3.0]), name))[0]

    return frozen_cases(
        "lever that holds the speed",
        scene,
        {
            "speed": at("omega"),
            "slack tension": at("slack_tension"),
            "friction heat": at("friction_heat"),
            "grip lost": time_of("grip_lost"),
            "speed at the end": "record.y_end.omega",
        },
        {"∂(speed at the end)/∂s": "brake.linings.friction.factors.0.slope"},
        of=lambda result: result.record.y_end.omega,
    )


def driller_cases() -> list[Case]:
    """A driller who slows the pulley down to a given course of the speed, from 2 rad/s above it."""
    M, J, R, w0, g, n, f, end = 5e3, 800.0, 0.725, 8.0, 1.5, 4, 0.35, 3.0
    times, course = [0.0, 2.0, 9.0], [6.0, 3.0, 3.0]

    def wanted(t: float) -> float:
        return float(np.interp(t, times, course))

    def speed(t: float, g: complex = g) -> complex:
        return wanted(t) + (w0 - 6.0) * cmath.exp(-g * t)

    def heat(g: complex) -> complex:
        # the load's work less the change of kinetic energy
        angle = 9.0 + 3.0 * (end - 2.0) + (w0 - 6.0) * (1 - cmath.exp(-g * end)) / g
        return M * angle - J / 2 * (speed(end, g) ** 2 - w0**2)

    z = f * math.tan(math.radians(25.0))
    gain = R * (((1 + z) / (1 - z)) ** n - 1)
    pull = (M - J * (-1.5 - g * (speed(1.0).real - wanted(1.0)))) / gain
    follows = "ω = ω_r + (ω_0 − ω_r(0)) e^(−g t)"
    rows = [
        ("speed", f"{FORM}{follows}", speed(1.0).real, lambda r: r.series([1.0]).omega[0]),
        ("speed at the end", f"{FORM}{follows}", speed(end).real, "record.y_end.omega"),
        (
            "slack tension",
            f"{FORM}(M − J ω̇)/(R_b (Π − 1))",
            pull,
            lambda r: r.series([1.0]).slack_tension[0],
        ),
        ("friction heat", f"{FORM}M φ − J (ω² − ω_0²)/2", heat(g).real, "energy.friction_heat"),
        (
            "∂(friction heat)/∂g",
            f"{FORM}M φ − J (ω² − ω_0²)/2, differentiated",
            differentiated(heat, g),
            Slope("duty.slack_tension.gain"),
            1e-9,
        ),
    ]
    lever = Driller(PiecewiseLinear(times, course), 1e5, g)
    scene = stop_scene(n=n, f=f, beta=50.0, lever=lever, load=M, J=J, w0=w0, C=None, end=end)
    return cases_with_slopes("driller", scene, rows, lambda result: result.energy["friction_heat"])


# --- levers that lag, and that wait for a temperature -----------------------------------------------------------------


def actuator_cases() -> list[Case]:
    """The command rises, jumps and falls; the force follows with a dead time and a lag, less that of a spring."""
    command = PiecewiseLinear([0.0, 0.3, 0.3, 1.1], [1.5e3, 6e3, 9e3, 4e3])
    lever = Actuator(command, 0.15, 0.08, 800.0)
    scene = stop_scene(n=4, beta=50.0, C=None, lever=lever)
    field = "duty.slack_tension"
    slopes = {"∂(stopping time)/∂τ": f"{field}.lag", "∂(stopping time)/∂t_d": f"{field}.dead_time"}
    return frozen_cases("actuator", scene, {"stopping time": "stopping_time"}, slopes)


def hot_phase_cases() -> list[Case]:
    """A load that the brake slows too little heats the rim to a level, and then a stronger pull stops it."""
    heat = lumped_heat(rim=4e4, partition=ConstantPartition(1.0), rim_cooling=0.0)
    level = AtTemperature(ROOM + 60.0, of="rim")
    lever = Phases((Phase(Constant(4e3), level), Phase(Constant(12e3), "rest")))
    scene = stop_scene(n=4, beta=50.0, C=None, load=9e3, end=30.0)
    scene = dataclasses.replace(scene, duty=Duty(lever, scene.duty.load), heat=heat)
    return frozen_cases(
        "phase that ends hot",
        scene,
        {
            "first phase": time_of("phase_end"),
            "stopping time": "stopping_time",
            "rise at rest": lambda result: result.end_temperatures[0] - ROOM,
        },
        {"∂(stopping time)/∂(level)": "duty.slack_tension.phases.0.until.level"},
    )


# --- the tackle -------------------------------------------------------------------------------------------------------


def tackle_cases() -> list[Case]:
    """A hook on a tackle with losses, stopped, held, and lost again as the lever is released."""
    J, m, r, lines, w0, F, eta, off = 1200.0, 60e3, 0.4, 8.0, 12.0, 12e3, 0.9, 2.0
    per_rad, gain = r / lines, 0.725 * (closed_form()["Pi"] - 1)
    M, whole = m * GRAVITY * per_rad, J + m * per_rad**2

    def time(eta: complex) -> complex:
        return whole * w0 / (gain * F - eta * M)

    stopped = time(eta).real
    lost = (1 - eta) * M * w0 * stopped / 2
    rows = [
        ("stopping time", f"{FORM}J_eq ω_0/(M_b − η m g r/n)", stopped, "stopping_time"),
        ("heat of the tackle", f"{FORM}(1 − η) M ω_0 t/2", lost, lambda r: r.series([2.5]).shaft_work[0]),
        ("restart", f"{FORM}where M_b(t) = η m g r/n", 3.0 + off * (1 - eta * M / (gain * F)), time_of("restart")),
        (
            "∂(stopping time)/∂η",
            f"{FORM}J_eq ω_0/(M_b − η m g r/n), differentiated",
            differentiated(time, eta),
            Slope("shaft.0.efficiency"),
            1e-9,
        ),
    ]
    lever = PiecewiseLinear([0.0, 3.0, 3.0 + off], [F, F, 0.0])
    scene = stop_scene(C=None, lever=lever, load=HookLoad(m, r, lines), J=J, w0=w0, end=4.0)
    return cases_with_slopes("tackle with losses", dataclasses.replace(scene, shaft=(TackleLoss(eta),)), rows)


CASES = (
    winch_cases,
    simple_band_cases,
    fall_cases,
    hold_cases,
    driller_cases,
    actuator_cases,
    hot_phase_cases,
    tackle_cases,
)
