"""Centrifugal force on floating linings: lift-off in closed form, onset of slip; stops:
test_random_scenes."""

import dataclasses
import math

import bandage_scenes
import numpy as np
import pytest
import staged_scenes as staged
from helpers import all_near, closes, near
from scenes import lining_ratio, replaced
from scipy.optimize import brentq

import simbrake as sb

RADIUS = 0.61  # of the centres of mass
S = math.sin(staged.BETA / 2)
MU = lining_ratio(staged.F_EXT, staged.BETA)
PI = MU ** np.arange(staged.N + 1)


def with_masses(scene, mass, **changes):
    """The same scene with linings of the `mass` (kg)."""
    bandage = dataclasses.replace(
        scene.brake.bandage, mass=mass, mass_radius=RADIUS, **changes
    )
    return replaced(scene, {"brake.bandage": bandage})


def lifts(result):
    return [
        (e.name, e.lining, e.time)
        for e in result.events
        if e.name in ("lining_lift_off", "lining_touchdown")
    ]


# --- lift-off and touchdown at √((N + N_pre)/(m r_m)) -------------------------------

PRELOAD = np.array([9e3, 300.0, 800.0, 2e4, 1500.0, 1e4, 9e3, 9e3])
MASS = np.array([2, 2, 3, 2, 5, 2, 2, 2.0])
TORQUE = sb.PiecewiseLinear([4.0, 4.0], [3e3, -3e3])


def speed_up(T_0, mass=MASS):
    """A load speeds the pulley up for 4 s and slows it down again; the bandage rides
    with it."""
    lever = sb.Constant(T_0)
    scene = with_masses(
        staged.stop(lever=lever, w0=10.0, end=9.0, preload=PRELOAD), mass
    )
    return dataclasses.replace(scene, duty=sb.Duty(lever, sb.TorqueLoad(TORQUE)))


@pytest.mark.slow
@pytest.mark.parametrize("T_0", [0.0, 150.0])
def test_linings_lift_off_at_own_speeds(T_0):
    result = sb.simulate(speed_up(T_0))
    J = staged.J + staged.J_B
    drag = staged.R_B * T_0 * (PI[-1] - 1)
    limit = np.sqrt((T_0 * (PI[1:] + PI[:-1]) * S + PRELOAD) / (MASS * RADIUS))
    top = 10 + 4 * (3e3 - drag) / J
    leaving = sorted(
        (J * (limit[i] - 10) / (3e3 - drag), i)
        for i in range(staged.N)
        if limit[i] < top
    )
    back = sorted(
        (4 + J * (top - limit[i]) / (3e3 + drag), i)
        for i in range(staged.N)
        if limit[i] < top
    )
    assert len(leaving) == (3 if T_0 == 0 else 1)
    truth = [("lining_lift_off", i + 1, t) for t, i in leaving] + [
        ("lining_touchdown", i + 1, t) for t, i in back
    ]
    found = lifts(result)
    assert [event[:2] for event in found] == [event[:2] for event in truth]
    all_near([event[2] for event in found], [event[2] for event in truth], 1e-12)
    # loads and capacity in between
    t = 0.5 * (leaving[-1][0] + 4)
    s = result.series([t])
    omega = 10 + t * (3e3 - drag) / J
    load = np.maximum(
        0, T_0 * (PI[1:] + PI[:-1]) * S + PRELOAD - MASS * RADIUS * omega**2
    )
    all_near(s.pairs["internal"].normal_load[0], load, 1e-12)
    near(s.pairs["internal"].capacity[0], staged.R * staged.F_INT * load.sum(), 1e-12)
    closes(result, 1e-9)


# --- onset of internal slip ---------------------------------------------------------


def test_onset_with_lifted_linings():
    """The root over a fine grid of tensions, with some of the linings off the rim
    there; and where there is none."""
    scene = with_masses(staged.stop(preload=np.linspace(200.0, 3000.0, staged.N)), 4.0)
    J = staged.J
    J_b = staged.J_B
    arm = staged.R_B * (PI[-1] - 1)
    for omega in (5.0, 20.0, 30.0):
        for load in (300.0, -2e3):

            def unbalance(T_0, omega=omega, load=load):
                on_rim = (
                    T_0 * (PI[1:] + PI[:-1]) * S
                    + np.linspace(200.0, 3000.0, staged.N)
                    - 4 * RADIUS * omega**2
                )
                grip = staged.R * staged.F_INT * np.maximum(on_rim, 0).sum()
                return grip - arm * T_0 * J / (J + J_b) - J_b / (J + J_b) * load

            truth = (
                brentq(unbalance, 0.0, 1e4, xtol=1e-10) if unbalance(0.0) > 0 else 0.0
            )
            onset = float(
                sb.results.internal_slip_tension(scene.brake, J, load, omega=omega)
            )
            near(onset, truth, 1e-12)


# --- the bandage on springs ---------------------------------------------------------


@pytest.mark.slow
def test_sprung_linings_lift_off_one_by_one():
    """An open brake that a load speeds up: all turn together, each with its own
    preload."""
    preload = np.array([500.0, 2e4, 900.0])
    mass = np.array([2.0, 2.0, 2.4])
    load = ((0.0, 3.0, 3.0, 4.0), (1500.0, 1500.0, -1500.0, -1500.0))
    scene = bandage_scenes.scene(
        preload=preload, lever=((0.0,), (0.0,)), load=load, omega=5.0, end=6.0
    )
    result = sb.simulate(with_masses(scene, mass))
    found = lifts(result)
    assert [event[:2] for event in found[:2]] == [
        ("lining_lift_off", 1),
        ("lining_lift_off", 3),
    ]
    assert {event[:2] for event in found[2:]} == {
        ("lining_touchdown", 1),
        ("lining_touchdown", 3),
    }
    speeds = np.asarray(result.series([t for *_, t in found]).lining_speed)
    own = [speeds[k, lining - 1] for k, (_, lining, _) in enumerate(found)]
    limit = np.sqrt(preload / (mass * RADIUS))
    all_near(own, [limit[lining - 1] for _, lining, _ in found], 1e-10)
    closes(result, 1e-9)


@pytest.mark.slow
def test_one_sprung_lining_is_rigid_bandage():
    one = with_masses(
        bandage_scenes.scene(1, wrap=60.0, f_int=0.15, preload=1e3, J=50.0), 3.0
    )
    bandage = dataclasses.replace(
        one.brake.bandage, spring=None, spring_damping=0.05, inertia=4.0
    )
    rigid = replaced(one, {"brake.bandage": bandage})
    both = [sb.simulate(scene, rtol=1e-12) for scene in (one, rigid)]
    names = (
        "internal_slip",
        "external_lock",
        "stop",
        "lining_lift_off",
        "lining_touchdown",
    )
    logs = [
        [(e.name, e.time) for e in result.events if e.name in names] for result in both
    ]
    assert [name for name, _ in logs[0]] == [name for name, _ in logs[1]]
    assert len(logs[0]) >= 3
    all_near([t for _, t in logs[0]], [t for _, t in logs[1]], 1e-10, 1e-12)
