"""Friction with memory: recovery against a closed form, all processes against SciPy,
files."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, closes, jacobians, near
from scenes import lining_ratio
from scipy.optimize import brentq
from test_memory import (
    AREA,
    BETA,
    OMEGA,
    PADS,
    R_B,
    T_0,
    TORQUE,
    F,
    J,
    band,
    disc,
    final,
    stop_and_rest,
)

import simbrake as sb
from simbrake.friction import FrictionWithMemory, LinearFade, MemoryProcess

GAS = 8.314462618
KELVIN = 520.0


def furnace(mass=1e15):
    """Heat of pads whose temperature stays as it is."""
    return sb.Heat(
        (
            sb.thermal.Lump("disc", mass),
            sb.thermal.Lump("pads", mass, count=PADS, temperature=KELVIN),
        ),
        friction=sb.thermal.FrictionHeat("disc", "pads", 0.6),
        linings="pads",
    )


@pytest.mark.slow
def test_isothermal_memory_is_exponential():
    """`c = c_e φ + (c_0 − c_e φ) e^{−kt}`, `k = A e^{−E/(R_g T)}`; stopping time, and
    how it follows A, E and c_0."""
    A = 3e3
    E = 4e4
    end = 1.0
    start = 0.6
    fade = LinearFade(5e-4, 420.0)
    k = A * math.exp(-E / (GAS * KELVIN))
    goal = end * (1 - 5e-4 * (KELVIN - 420.0))

    def stop(x):
        process = MemoryProcess(end, fade, x[0], x[1])
        run = sb.simulate(
            disc(FrictionWithMemory(F, (process,), x[2]), heat=furnace()),
            rtol=1e-12,
            max_steps=512,
        )
        return jnp.stack([run.stopping_time, run.record.y_end.memory[0][0]])

    def left(t, k=k, start=start):
        return OMEGA - TORQUE / J * (
            goal * t + (start - goal) * (1 - math.exp(-k * t)) / k
        )

    t = brentq(left, 0.0, 20.0, xtol=1e-14, rtol=1e-14)
    value, forwards, backwards = jacobians(stop)(jnp.asarray([A, E, start]))
    near(value[0], t, 1e-9)
    near(value[1], goal + (start - goal) * math.exp(-k * 10.0), 1e-9)
    gone = math.exp(-k * t)
    c = goal + (start - goal) * gone
    by_k = (start - goal) * ((1 - gone) / k - t * gone) / k / c
    by_start = -(1 - gone) / k / c
    all_near(forwards[0], [by_k * k / A, -by_k * k / (GAS * KELVIN), by_start], 1e-7)
    all_near(backwards, forwards, 1e-9, 1e-12)


def test_stop_with_all_processes_by_scipy():
    """Fade with recovery, burn-off and running-in at once, each lining for itself."""
    n = 4
    capacity = 900.0
    share = 0.7
    room = sb.thermal.ROOM
    heat = sb.Heat(
        (sb.thermal.Lump("rim", 2e5), sb.thermal.Lump("pads", capacity, count=n)),
        friction=sb.thermal.FrictionHeat("rim", "pads", share),
        linings="pads",
    )
    A = 2e5
    E = 6e4
    k = 0.4
    w_0 = 5e6
    processes = (
        MemoryProcess(1.0, LinearFade(8e-4, 250.0), k),
        MemoryProcess(0.0, rate=A, activation=E),
        MemoryProcess(1.1, work=w_0),
    )
    scene = sb.with_values(
        band(FrictionWithMemory(F, processes, 0.9)), {"end_time": 4.0}
    )
    result = sb.simulate(
        sb.Scene(scene.brake, scene.duty, scene.initial, 4.0, heat), rtol=1e-12
    )

    def rhs(t, y):
        omega = max(y[0], 0.0)
        T = np.asarray(y[1 : 1 + n])
        c = np.asarray(y[1 + n :])
        f = F * c
        tension = T_0 * np.cumprod(np.append(1.0, lining_ratio(f, BETA)))
        power = np.diff(tension) * R_B * omega
        change = (
            k * (1 - 8e-4 * (T - 250.0) - c)
            - A * np.exp(-E / (GAS * T)) * c
            + power * math.cos(BETA / 2) / AREA / w_0 * (1.1 - c)
        )
        return [
            -R_B * (tension[-1] - T_0) / J,
            *((1 - share) * power / capacity),
            *change,
        ]

    start = [OMEGA, *(n * [room]), *(n * [0.9])]
    stop, rested = stop_and_rest(rhs, start, 4.0)
    near(result.stopping_time, stop, 1e-9)
    all_near(final(result), rested[1 + n :], 1e-9)
    assert np.ptp(final(result)) > 1e-3
    closes(result, 1e-9)
