"""Validation of the staged brake: a pair of inertias through all its stages, lock-up, and holding."""

import math
from typing import Any

import numpy as np

from .._run._result import Result
from ._reference_scenes import staged_pair
from ._validation import Case
from ._validation_brakes import ran

_FORM = "closed form: "


def _points(*torques: tuple[float, float]) -> tuple[list[float], list[float]]:
    """Times and torques of the band at four points: all scenes here share one program."""
    times, values = zip(*torques, strict=True)
    more = 4 - len(times)
    return [*times, *(1e6 + i for i in range(more))], [*values, *([values[-1]] * more)]


def pair_cases(**changes: Any) -> list[Case]:
    """Internal slip, external lock and stop under a torque `c t`; `changes`: of the scene, not of the truth."""
    J1, J2, w0, M, c = 40.0, 4.0, 20.0, 600.0, 500.0
    lever = _points((0.0, 0.0), (10.0, 10.0 * c))
    run = ran(staged_pair(**{"M_i": M, "J_1": J1, "J_2": J2, "w0": w0, "lever": lever, **changes}))
    t0 = M * (J1 + J2) / (c * J1)
    w_t0 = w0 - c * t0**2 / (2 * (J1 + J2))
    # J2 ω̇2 = M − c t from t0 on, down to 0
    slope = M - c * t0
    d = (slope + math.sqrt(slope**2 + 2 * c * J2 * w_t0)) / c
    lock, w1 = t0 + d, w_t0 - M * d / J1
    stop = t0 / 2 + w0 * J1 / M
    # internal slip: ω1 − ω2 = −M τ/J1 − (slope τ − c τ²/2)/J2 until the lock, then ω1 alone
    inner = M * (-(M / J1 + slope / J2) * d**2 / 2 + c * d**3 / (6 * J2)) + J1 * w1**2 / 2
    total = (J1 + J2) * w0**2 / 2

    def speed(result: Result) -> Any:
        return result.series([float(result.external_lock_time)]).omega[0]

    return [
        Case("staged pair/internal slip", f"{_FORM}M_i(J1 + J2)/(c J1)", t0, 1e-11, lambda: run().internal_slip_time),
        Case(
            "staged pair/external lock", f"{_FORM}J2 ω̇2 = M_i − c t to 0", lock, 1e-11, lambda: run().external_lock_time
        ),
        Case("staged pair/speed at the lock", f"{_FORM}ω1 = ω(t0) − M_i(t − t0)/J1", w1, 1e-11, lambda: speed(run())),
        Case("staged pair/stopping time", f"{_FORM}t0/2 + ω_0 J1/M_i", stop, 1e-11, lambda: run().stopping_time),
        Case(
            "staged pair/internal heat",
            f"{_FORM}∫ M_i(ω1 − ω2) dt",
            inner,
            1e-11,
            lambda: run().energy["heat_internal"],
        ),
        Case(
            "staged pair/external heat",
            f"{_FORM}(J1 + J2)ω_0²/2 − internal heat",
            total - inner,
            1e-11,
            lambda: run().energy["heat_external"],
        ),
    ]


def lock_up_cases() -> list[Case]:
    """Two inertias at 100 and 10 rad/s come to one speed through a pair of 50 N·m, free of everything else.

    They are brought to these speeds by 0.1 s of braking from 110 rad/s, which heats the internal pair by 225 J.
    """
    I1, I2, w1, w2, T, begin = 0.5, 2.0, 100.0, 10.0, 50.0, 0.1
    torque = T + I2 * (w1 + T / I1 * begin - w2) / begin
    lever = _points((0.0, torque), (begin, torque), (begin, 0.0))
    run = ran(staged_pair(M_i=T, J_1=I1, J_2=I2, w0=w1 + T / I1 * begin, lever=lever))
    reduced = I1 * I2 / (I1 + I2)
    before = T * (w1 - w2) * begin / 2

    def stuck() -> float:
        return next(e.time for e in run().events if e.name == "internal_restick") - begin

    def heat() -> float:
        return float(run().energy["heat_internal"]) - before

    speed = (I1 * w1 + I2 * w2) / (I1 + I2)
    return [
        Case("lock-up/time", f"{_FORM}I1 I2(ω1 − ω2)/(T(I1 + I2))", reduced * (w1 - w2) / T, 1e-11, stuck),
        Case("lock-up/heat", f"{_FORM}I1 I2(ω1 − ω2)²/2(I1 + I2)", reduced * (w1 - w2) ** 2 / 2, 1e-11, heat),
        Case(
            "lock-up/common speed", f"{_FORM}(I1 ω1 + I2 ω2)/(I1 + I2)", speed, 1e-11, lambda: run().record.y_end.omega
        ),
    ]


def hold_cases() -> list[Case]:
    """A staged brake at rest that the lever holds for an hour."""
    run = ran(staged_pair(w0=0.0, lever=_points((0.0, 500.0)), end=3600.0))

    def moved() -> float:
        s = run().series(np.linspace(0.0, 3600.0, 25))
        return float(np.max(np.abs(s.phi)) + np.max(np.abs(np.asarray(s.bandage_speed))))

    return [Case("staged brake held 3600 s/movement", "Coulomb friction below its capacity: none", 0.0, 0.0, moved)]


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return pair_cases() + lock_up_cases() + hold_cases()
