"""Double-shoe brakes: moments by quadrature, both directions, self-locking, holds,
input."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, closes, names_of, near
from scipy.integrate import solve_ivp
from shoe_scenes import (
    END,
    FRICTION,
    LOCKS,
    M_F,
    M_N,
    N_1,
    START,
    W0,
    A,
    B,
    C,
    F,
    J,
    R,
    moments,
    normals,
    shoe_heat,
    shoe_scene,
)

import simbrake as sb


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(shoe_scene(load=60.0))


@pytest.mark.smoke
def test_stop_has_the_torques_of_both_shoes(stopped):
    N = normals(FRICTION)
    torque = FRICTION * R * N.sum()
    assert N[0] > 2 * N[1]
    near(stopped.stopping_time, J * W0 / (torque - 60.0), 1e-12)
    s = stopped.series([0.1])
    all_near(s.normal_load[0], N, 1e-12)
    all_near(s.friction_force[0], FRICTION * N, 1e-12)
    closes(stopped, 1e-12)
    assert names_of(stopped) == [
        "slip_onset",
        "full_slip",
        "stop",
    ]
    peak = stopped.max_normal_load
    assert (int(peak.lining), float(peak.value)) == (1, pytest.approx(N[0], rel=1e-12))


def test_worked_example_of_the_book():
    """Shigley's internal expanding shoes (θ_1 = 0): 1 MPa on the leading shoe; the book
    rounds to three digits."""
    brake = sb.ShoeBrake(
        J, sb.Shoes(sb.ConstantFriction(FRICTION), R, B, 0.0, END), A, C
    )
    f = np.full(2, FRICTION)
    per_newton = np.asarray(brake.normal(1.0, f, False))
    force = 1e6 / float(brake.greatest_pressure(per_newton[0]))
    near(force, 2.28e3, 5e-3)
    torques = FRICTION * R * force * per_newton
    all_near(torques, [366.0, 162.0], 5e-3)
    trailing = float(brake.greatest_pressure(force * per_newton[1]))
    near(trailing, 443e3, 5e-3)


def test_greatest_pressure_of_a_short_lining():
    """Beyond 90° the greatest pressure is at 90°; of a lining that ends before, at its
    end."""
    for end, highest in ((END, 1.0), (1.0, math.sin(1.0))):
        shoes = sb.Shoes(sb.ConstantFriction(0.3), R, B, START, end)
        mean = N_1 if end == END else moments(end)[2]
        near(shoes.peak, highest * float(shoes.area) / mean, 1e-12)


def test_directions_swap_the_shoes():
    # with coefficients of their own the directions differ
    own = np.array([0.4, 0.2])
    for sign in (1, -1):
        result = sb.simulate(
            shoe_scene(omega=sign * W0, friction=sb.ConstantFriction(own, 1.1))
        )
        torque = R * float(own @ normals(own, back=sign < 0))
        near(result.stopping_time, J * W0 / torque, 1e-12)


def test_held_shoes_balance_about_their_pins(stopped):
    s = stopped.series([3.5])
    friction = np.asarray(s.friction_force)[0]
    normal = np.asarray(s.normal_load)[0]
    assert float(s.omega[0]) == 0.0
    near(R * friction.sum(), 60.0, 1e-12)
    all_near(
        normal * M_N / N_1 - np.array([1, -1]) * friction * M_F / N_1, F * C, 1e-12
    )
    assert np.all(np.abs(friction) < 1.1 * FRICTION * normal)


def test_restart_where_load_exceeds_capacity():
    static = 1.1 * FRICTION
    hold = static * R * normals(static).sum()
    result = sb.simulate(
        shoe_scene(omega=0.0, load=sb.PiecewiseLinear([0.0, 9.0], [0.0, 3 * hold]))
    )
    restart = result.events["restart"].times[0]
    near(restart, 3.0, 1e-12)
    kinetic = FRICTION * R * normals(FRICTION).sum()
    near(result.end_capacity.torque, kinetic, 1e-12)


def test_self_locking_is_named():
    f = 1.02 * LOCKS
    scene = shoe_scene(friction=sb.ConstantFriction([f, 0.3], 1.0))
    near(scene.brake.self_locking(np.array([LOCKS, 0.0]))[0], 1.0, 1e-12)
    sb.check_scene(scene)
    with pytest.raises(
        sb.SimulationError, match=r"singular_geometry: M_F ≥ M_N.*shorten its lining"
    ):
        sb.simulate(scene)
    # just below, the torque is finite and large
    nearly = np.array([0.98 * LOCKS, 0.3])
    result = sb.simulate(shoe_scene(friction=sb.ConstantFriction(nearly, 1.0)))
    near(result.stopping_time, J * W0 / (R * float(nearly @ normals(nearly))), 1e-11)


def test_shoe_that_locks_itself_ends_the_run():
    """Friction that rises with the temperature; the time is that at which
    `f(T) M_F = M_N`, by SciPy."""
    slope = 2e-2
    base = 0.6 * LOCKS

    class Rising(sb.friction.AbstractFriction):
        base: jax.Array
        slope: jax.Array

        def kinetic(self, contact):
            return self.base * (1 + self.slope * (contact.T - 293.15))

        def static(self, contact):
            return self.kinetic(contact)

    law = Rising(jnp.asarray(base), jnp.asarray(slope))
    scene = shoe_scene(friction=law, heat=shoe_heat(), omega=60.0)
    result = sb.simulate(scene, throw=False, rtol=1e-11)
    assert result.status == "singular_geometry"

    def rates(t, y):
        f = base * (1 + slope * (y[1:] - 293.15))
        friction = f * normals(f)
        return [
            -R * friction.sum() / J,
            *((0.2 * friction * R * y[0] - (y[1:] - 293.15)) / 60.0),
        ]

    def locks(t, y):
        return LOCKS - base * (1 + slope * (y[1] - 293.15)) - 1e-6

    locks.terminal = True
    truth = solve_ivp(
        rates,
        (0, 4),
        [60.0, 293.15, 293.15],
        "Radau",
        events=locks,
        rtol=1e-10,
        atol=1e-10,
    )
    near(result.record.t_end, truth.t[-1], 1e-5)
