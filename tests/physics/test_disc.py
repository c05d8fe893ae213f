"""Disc brakes: stops and holds in closed form, both directions, pads of their own
friction, input."""

import dataclasses

import jax
import numpy as np
import pytest
from disc_scenes import (
    FRICTION,
    LOAD,
    R_I,
    R_O,
    RATIO,
    TORQUE,
    W0,
    F,
    J,
    N,
    disc_heat,
    disc_scene,
)
from helpers import all_near, closes, names_of, near
from shipped import load

import simbrake as sb


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(disc_scene())


@pytest.mark.smoke
def test_a_stop_has_the_closed_form(stopped):
    time = J * W0 / (TORQUE - LOAD)
    near(stopped.stopping_time, time, 1e-12)
    near(stopped.stopping_angle, W0 * time / 2, 1e-12)
    near(stopped.energy["friction_heat"], TORQUE * W0 * time / 2, 1e-12)
    closes(stopped, 1e-12)
    assert names_of(stopped) == [
        "slip_onset",
        "full_slip",
        "stop",
    ]
    assert stopped.status == "stopped"


def test_held_pads_share_the_load_at_rest(stopped):
    s = stopped.series([0.5, 3.5])
    assert float(s.omega[1]) == 0.0
    assert float(s.brake_torque[1]) == LOAD
    all_near(
        s.friction_force, [np.full(N, FRICTION * F), np.full(N, LOAD / 0.4 / N)], 1e-12
    )
    all_near(s.normal_load, np.full((2, N), F))
    assert s.at_limit.tolist() == [N, 0]
    all_near(s.lever_force, F)
    assert s.tension is None
    assert s.slack_tension is None


def test_uniform_pressure_has_greater_radius():
    brake = disc_scene(pressure=sb.brakes.UniformPressure()).brake
    near(brake.radius, 2 / 3 * (R_O**3 - R_I**3) / (R_O**2 - R_I**2), 1e-13)
    # the radius and the greatest pressure follow from the distribution itself
    for pressure, profile in (
        (sb.brakes.UniformWear(), lambda r: R_I / r),
        (sb.brakes.UniformPressure(), lambda r: np.ones_like(r)),
    ):
        r, weights = np.polynomial.legendre.leggauss(20)
        r = 0.5 * (R_O + R_I) + 0.5 * (R_O - R_I) * r
        weights = 0.5 * (R_O - R_I) * weights
        pads = dataclasses.replace(brake.linings, pressure=pressure)
        force, moment = (np.sum(weights * profile(r) * r**k) for k in (1, 2))
        near(pads.radius, moment / force, 1e-13)
        greatest = F / (0.7 * force) * profile(R_I * np.ones(1))[0]
        near(pads.greatest_pressure(F), greatest, 1e-13)
        all_near(pressure.share(r, R_I), profile(r) / profile(R_I * np.ones(1)), 1e-13)


def test_restart_and_release():
    load = sb.PiecewiseLinear([0.0, 9.0], [0.0, 3 * TORQUE])
    result = sb.simulate(disc_scene(omega=0.0, load=load, end=5.0))
    restart = 9.0 * RATIO / 3
    names = {event.name: event.time for event in result.events}
    near(names["restart"], restart, 1e-12)
    assert float(result.series([3.7]).omega[0]) == 0.0
    assert result.status == "runaway"
    near(result.end_capacity.torque, TORQUE, 1e-12)
    held = sb.simulate(
        disc_scene(force=sb.PiecewiseLinear([0.0, 1.0], [F, 0.0]), end=3.0, load=0.0)
    )
    assert names_of(held) == [
        "slip_onset",
        "full_slip",
        "release",
    ]
    assert held.status == "released"
    # ω = ω_0 − (M/J)(t − t²/2) up to 1 s
    near(held.record.y_end.omega, W0 - TORQUE / J / 2, 1e-11)


@pytest.mark.slow
def test_pads_of_different_friction():
    law = sb.friction.ProductFriction(
        np.array([0.3, 0.4, 0.4, 0.5]),
        (sb.LinearFade(slope=2e-3, above=273.15),),
    )
    result = sb.simulate(
        disc_scene(friction=law, heat=disc_heat(), wear=sb.Wear(1e-13))
    )
    T = np.asarray(result.series([1.0]).lining_temperature)[0]
    assert T[0] < T[1] < T[3]
    near(T[1], T[2], 1e-14)
    # wear by a constant rate is k p times the way, whatever the friction
    p = F / float(result.scene.brake.linings.area)
    all_near(
        result.worn_thickness, 1e-13 * p * 0.4 * float(result.stopping_angle), 1e-9
    )
    closes(result, 1e-12)


def test_pressure_counts():
    law = sb.friction.ProductFriction(
        FRICTION,
        (sb.friction.PressureFactor(reference=1e6, exponent=0.3),),
    )
    result = sb.simulate(disc_scene(friction=law))
    p = F / (0.5 * 0.7 * (R_O**2 - R_I**2))
    torque = TORQUE * (1 + p / 1e6) ** -0.3
    near(result.stopping_time, J * W0 / (torque - LOAD), 1e-12)


@pytest.mark.slow
@pytest.mark.smoke
def test_layered_disc_inside_a_users_program():
    """The linear systems of the implicit method are long sums of products, which not
    every compiler takes."""
    scene = dataclasses.replace(load("disc_stop").scene(), end_time=0.05)

    def angle(omega):
        return sb.simulate(
            sb.with_values(scene, {"initial.omega": omega}), max_steps=256
        ).record.y_end.phi

    omega = float(scene.initial.omega)
    all_near(jax.jit(angle)(omega), angle(omega), 1e-12)
