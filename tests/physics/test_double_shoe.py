"""Double-shoe brakes: moments by quadrature, both directions, self-locking, holds, derivatives, fade, figures."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import jacobians
from scipy.integrate import solve_ivp
from shoe_scenes import (
    END,
    FADE,
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
from simbrake import plot


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(shoe_scene(load=60.0))


@pytest.fixture(scope="module")
def faded():
    return sb.simulate(shoe_scene(friction=FADE, heat=shoe_heat(), wear=sb.Wear(2e-13)), rtol=1e-11)


@pytest.mark.smoke
def test_stop_has_the_torques_of_both_shoes(stopped):
    N = normals(FRICTION)
    torque = FRICTION * R * N.sum()
    assert N[0] > 2 * N[1]
    assert float(stopped.stopping_time) == pytest.approx(J * W0 / (torque - 60.0), rel=1e-12)
    s = stopped.series([0.1])
    np.testing.assert_allclose(s.normal_load[0], N, rtol=1e-12)
    np.testing.assert_allclose(s.friction_force[0], FRICTION * N, rtol=1e-12)
    assert float(stopped.energy["closure"]) <= 1e-12
    assert [event.name for event in stopped.events] == ["slip_onset", "full_slip", "stop"]
    assert "drum to rest" in str(stopped)
    peak = stopped.max_normal_load
    assert (int(peak.lining), float(peak.value)) == (1, pytest.approx(N[0], rel=1e-12))


def test_worked_example_of_the_book():
    """Shigley's internal expanding shoes (θ_1 = 0): 1 MPa on the leading shoe; the book rounds to three digits."""
    brake = sb.ShoeBrake(J, sb.Shoes(sb.ConstantFriction(FRICTION), R, B, 0.0, END), A, C)
    f = np.full(2, FRICTION)
    per_newton = np.asarray(brake.normal(1.0, f, False))
    force = 1e6 / float(brake.greatest_pressure(per_newton[0]))
    assert force == pytest.approx(2.28e3, rel=5e-3)
    torques = FRICTION * R * force * per_newton
    np.testing.assert_allclose(torques, [366.0, 162.0], rtol=5e-3)
    trailing = float(brake.greatest_pressure(force * per_newton[1]))
    assert trailing == pytest.approx(443e3, rel=5e-3)


def test_greatest_pressure_of_a_short_lining():
    """Beyond 90° the greatest pressure is at 90°; of a lining that ends before, at its end."""
    for end, highest in ((END, 1.0), (1.0, math.sin(1.0))):
        shoes = sb.Shoes(sb.ConstantFriction(0.3), R, B, START, end)
        mean = N_1 if end == END else moments(end)[2]
        assert float(shoes.peak) == pytest.approx(highest * float(shoes.area) / mean, rel=1e-12)


def test_directions_swap_the_shoes():
    ahead, back = (sb.simulate(shoe_scene(omega=sign * W0, load=sign * 60.0)) for sign in (1, -1))
    assert float(back.stopping_time) == pytest.approx(float(ahead.stopping_time), rel=1e-13)
    np.testing.assert_allclose(back.series([0.1]).normal_load[0], normals(FRICTION)[::-1], rtol=1e-12)
    np.testing.assert_allclose(back.series([0.1]).friction_force[0], -FRICTION * normals(FRICTION)[::-1], rtol=1e-12)
    # with coefficients of their own the directions differ
    own = np.array([0.4, 0.2])
    for sign in (1, -1):
        result = sb.simulate(shoe_scene(omega=sign * W0, friction=sb.ConstantFriction(own, 1.1)))
        torque = R * float(own @ normals(own, back=sign < 0))
        assert float(result.stopping_time) == pytest.approx(J * W0 / torque, rel=1e-12)


def test_held_shoes_balance_about_their_pins(stopped):
    s = stopped.series([3.5])
    friction, normal = np.asarray(s.friction_force)[0], np.asarray(s.normal_load)[0]
    assert float(s.omega[0]) == 0.0
    assert R * friction.sum() == pytest.approx(60.0, rel=1e-12)
    np.testing.assert_allclose(normal * M_N / N_1 - np.array([1, -1]) * friction * M_F / N_1, F * C, rtol=1e-12)
    assert np.all(np.abs(friction) < 1.1 * FRICTION * normal)


def test_restart_where_load_exceeds_capacity():
    static = 1.1 * FRICTION
    hold = static * R * normals(static).sum()
    result = sb.simulate(shoe_scene(omega=0.0, load=sb.PiecewiseLinear([0.0, 9.0], [0.0, 3 * hold])))
    restart = next(event.time for event in result.events if event.name == "restart")
    assert restart == pytest.approx(3.0, rel=1e-12)
    kinetic = FRICTION * R * normals(FRICTION).sum()
    assert float(result.end_capacity.torque) == pytest.approx(kinetic, rel=1e-12)


def test_self_locking_is_named():
    f = 1.02 * LOCKS
    scene = shoe_scene(friction=sb.ConstantFriction([f, 0.3], 1.0))
    assert float(scene.brake.self_locking(np.array([LOCKS, 0.0]))[0]) == pytest.approx(1.0, rel=1e-12)
    sb.check(scene)
    with pytest.raises(sb.SimulationError, match=r"singular_geometry: M_F ≥ M_N.*shorten its lining"):
        sb.simulate(scene)
    result = sb.simulate(scene, throw=False)
    warning = result.summary()["warnings"][0]
    assert warning.startswith("self_locking: shoe 1: M_F/M_N = 1.02 ≥ 1")
    # just below, the torque is finite and large
    nearly = np.array([0.98 * LOCKS, 0.3])
    result = sb.simulate(shoe_scene(friction=sb.ConstantFriction(nearly, 1.0)))
    assert float(result.stopping_time) == pytest.approx(J * W0 / (R * float(nearly @ normals(nearly))), rel=1e-11)


def test_shoe_that_locks_itself_ends_the_run():
    """Friction that rises with the temperature; the time is that at which `f(T) M_F = M_N`, by SciPy."""
    slope, base = 2e-2, 0.6 * LOCKS

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
        return [-R * friction.sum() / J, *((0.2 * friction * R * y[0] - (y[1:] - 293.15)) / 60.0)]

    def locks(t, y):
        return LOCKS - base * (1 + slope * (y[1] - 293.15)) - 1e-6

    locks.terminal = True
    truth = solve_ivp(rates, (0, 4), [60.0, 293.15, 293.15], "Radau", events=locks, rtol=1e-10, atol=1e-10)
    assert float(result.record.t_end) == pytest.approx(truth.t[-1], rel=1e-5)


@pytest.mark.slow
def test_fade_of_each_shoe_against_scipy(faded):
    def rates(t, y):
        f = FRICTION * (1 - 3e-3 * (y[1:3] - 273.15))
        friction = f * normals(f)
        power = friction * R * y[0]
        wear = 2e-13 * normals(f) / (B * R * (END - START)) * R * y[0]
        return [-R * friction.sum() / J, *((0.2 * power - (y[1:3] - 293.15)) / 60.0), *wear]

    def stops(t, y):
        return y[0]

    stops.terminal = True
    start = [W0, 293.15, 293.15, 0.0, 0.0]
    truth = solve_ivp(rates, (0, 4), start, "DOP853", events=stops, rtol=1e-12, atol=1e-14)
    assert float(faded.stopping_time) == pytest.approx(truth.t[-1], rel=1e-10)
    T = np.asarray(faded.series([truth.t[-1]]).lining_temperature)[0]
    np.testing.assert_allclose(T, truth.y[1:3, -1], rtol=1e-10)
    assert T[0] > T[1] + 1.0
    np.testing.assert_allclose(faded.worn_thickness, truth.y[3:, -1], rtol=1e-8)
    assert float(faded.energy["closure"]) <= 1e-11
    assert float(faded.energy["heat_closure"]) <= 1e-12
    np.testing.assert_allclose(np.sum(sb.results.friction_work(faded)), float(faded.energy["friction_heat"]), rtol=1e-9)


@pytest.mark.slow
def test_stopping_time_derivatives_are_exact():
    def time(x):
        shoes = sb.Shoes(sb.ConstantFriction(x[:2], 1.1), x[2], B, x[3], x[4])
        force = sb.PiecewiseLinear(np.array([0.0, 9.0]), jnp.stack([x[7], x[7]]))
        load = sb.TorqueLoad(sb.PiecewiseLinear(np.array([0.0, 9.0]), np.array([60.0, 60.0])))
        scene = sb.Scene(sb.ShoeBrake(J, shoes, x[5], x[6]), sb.ForceDuty(force, load), sb.Initial(W0), 4.0)
        return sb.simulate(scene, max_steps=64).stopping_time[None]

    def closed(x):
        f, r, start, end, a, c, F = x[:2], *x[2:]
        squares = (end - start) / 2 - (jnp.sin(2 * end) - jnp.sin(2 * start)) / 4
        span = jnp.cos(start) - jnp.cos(end)
        friction = r * span - a / 2 * (jnp.sin(end) ** 2 - jnp.sin(start) ** 2)
        N = F * c * span / (a * squares - jnp.asarray([1.0, -1.0]) * f * friction)
        return J * W0 / (r * jnp.sum(f * N) - 60.0)

    x = jnp.asarray([0.33, 0.30, R, START, END, A, C, F])
    value, ahead, back = jacobians(time)(x)
    truth = np.asarray(jax.grad(closed)(x))
    assert float(value[0]) == pytest.approx(float(closed(x)), rel=1e-12)
    np.testing.assert_allclose(ahead[0], truth, rtol=1e-10)
    np.testing.assert_allclose(back[0], truth, rtol=1e-10)


def test_all_faults_at_once():
    law = sb.friction.ProductFriction(
        sb.ConstantFriction(0.3), (sb.friction.PressureFactor(reference=1e6, exponent=0.2),)
    )
    bad = sb.with_values(shoe_scene(friction=law), {"brake.linings.end": 0.1, "brake.pin": 0.2})
    with pytest.raises(sb.InputError) as caught:
        sb.check(bad)
    for part in (
        "brake.linings.end: 0.1 rad is not beyond the start 0.15 rad",
        "brake.pin: 0.2 m is not inside the drum of 0.15 m",
        "brake.linings.friction: cannot depend on the pressure of a double-shoe brake",
    ):
        assert part in str(caught.value)


@pytest.mark.slow
def test_file_and_figures_have_both_shoes(faded, tmp_path):
    text = sb.files.scene_text(faded.scene)
    again = sb.files.scene_from_text(text)
    assert sb.files.scene_text(again) == text
    assert float(sb.simulate(again, rtol=1e-11).stopping_time) == float(faded.stopping_time)
    sb.save(faded, tmp_path / "stop.nc")
    np.testing.assert_allclose(sb.load(tmp_path / "stop.nc")["lever_force"], F)
    figure = plot.pressed(faded, 0.1)
    assert len([patch for patch in figure.axes[0].patches if patch.get_gid() == "shoe"]) == 2
    N = np.asarray(faded.series([0.1]).normal_load)[0]
    curves = [line.get_ydata() for line in figure.axes[1].lines]
    np.testing.assert_allclose([1e6 * c.max() for c in curves], faded.scene.brake.greatest_pressure(N), rtol=1e-3)
    assert "normal force $N$ on shoe 2" in [line.get_label() for line in plot.stop(faded).axes[2].lines]
