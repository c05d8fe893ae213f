"""Loads that depend on the angle: weight of ropes and chains, counterweights, loads of
one's own; against closed forms."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import lump
from helpers import all_near, changes_of, closes, jacobians, near
from scenes import PI, stop_scene, tension_for
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake.loads import (
    AbstractLoad,
    CounterweightLoad,
    RopeLayers,
    RopeWeight,
    WindlassLoad,
)

G = 9.80665
R = 0.5


def scene(load, torque, w0, end, J=200.0, **more):
    """A rigid band with the braking `torque` (N·m) in the braking direction."""
    T_0 = tension_for(torque, 20, 0.35, 13.5, R)
    return stop_scene(C=None, R=R, J=J, T0=T_0, w0=w0, load=load, end=end, **more)


def run(*given, **more):
    return sb.simulate(scene(*given, **more), rtol=1e-12, throw=False)


# --- a rope on a drum ----------------------------------------------------------------

M = 1000.0
Q = 10.0
L = 500.0
L_0 = 50.0


def hook(q=Q, length=L, hanging=L_0, mass=M, lines=1.0, **more):
    rope = RopeWeight(q, hanging, length, more.pop("below", 0.0))
    return sb.HookLoad(mass, R, lines, weight=rope, **more)


def test_free_fall_with_a_rope():
    """φ and ω grow as cosh and sinh of k t, k² = q g r²/J."""
    result = run(hook(), 0.0, 0.0, 5.0)
    end = result.record.y_end
    near(end.phi, 55.725295104107, 1e-12)
    near(end.omega, 22.955832043896, 1e-12)
    energy = result.energy
    near(energy["kinetic_change"], 447924.6911, 1e-10)
    near(energy["load_work"], M * G * R * float(end.phi))
    deepest = L_0 + R * end.phi
    near(energy["rope_work"], G * Q * (deepest**2 - L_0**2) / 2, 1e-12)
    assert float(energy["closure"]) < 1e-13
    pull = float(result.series([5.0]).rope_tension[0])
    alpha = G * R * (M + Q * deepest) / (200.0 + R**2 * (M + Q * L))
    near(pull, (M + Q * deepest) * (G - R * alpha), 1e-11)


def stop_by_hand(x):
    """Time and angle of a stop under the torque M_b against a rope of q kg/m."""
    M_b, w0, q, length, hanging = x
    k = jnp.sqrt(q * G * R**2 / (200.0 + R**2 * (M + q * length)))
    far = (M_b / (G * R * q) - M / q - hanging) / R
    return jnp.stack(
        [jnp.arctanh(w0 / (k * far)) / k, far - jnp.sqrt(far**2 - (w0 / k) ** 2)]
    )


STOP = jnp.asarray([12e3, 6.0, Q, L, L_0])


def test_stop_with_a_rope_and_its_derivatives():
    def stop(x):
        result = sb.simulate(scene(hook(x[2], x[3], x[4]), x[0], x[1], 5.0), rtol=1e-12)
        return jnp.stack([result.stopping_time, result.stopping_angle])

    value, forwards, backwards = jacobians(stop)(STOP)
    truth, slopes, _ = jacobians(stop_by_hand)(STOP)
    all_near(value, [2.2490405217143, 6.70640348014], 1e-12)
    all_near(value, truth, 1e-12)
    all_near(forwards, slopes, 1e-9)
    all_near(backwards, slopes, 1e-9)


@pytest.mark.slow
def test_stop_with_heat_is_the_same():
    """An implicit method sees that the torque depends on the angle."""
    made = scene(hook(), *map(float, STOP[:2]), 5.0, heat=lump(1e15))
    result = sb.simulate(made, solver=sb.hybrid.Rodas5P())
    found = [float(result.stopping_time), float(result.stopping_angle)]
    all_near(found, stop_by_hand(STOP), 1e-9)


def test_on_either_side_of_the_balance():
    """Above ω_0 = k φ* the rope wins, and runs out."""
    assert run(hook(), 12e3, 22.7526551, 400.0).status == "stopped"
    result = run(hook(), 12e3, 22.7526552, 400.0)
    assert result.status == "rope_end"
    near(result.record.y_end.phi, (L - L_0) / R, 1e-12)
    closes(result, 1e-12)


@pytest.mark.slow
def test_holding_is_judged_at_every_depth():
    """Hoisted from where the brake would not hold to where it does; and the same of a
    load that pulls up."""
    up = sb.PiecewiseLinear([0.0, 2.0, 20.0, 22.0], [0.0, -4.0, -4.0, 0.0])
    motor = sb.loads.Motor("40 kN*m", "400 kW", "8 rad/s")
    hoist = sb.loads.Phase(0.0, "rest", "hoist", motor=up)
    T_0 = tension_for(9e3, 20, 0.35, 13.5, R)
    hold = sb.loads.Phase(T_0, "5 s", "hold")
    load = hook(hanging=90.0)
    made = scene(load, 9e3, 0.0, 40.0, motor=motor)
    duty = sb.Duty(sb.loads.Phases((hoist, hold)), load)
    result = sb.simulate(dataclasses.replace(made, duty=duty))
    travel = float(result.total_hook_travel)
    near(travel, -40.0, 1e-6)
    here = 9e3 / (G * R * (M + Q * (90.0 + travel)))
    deepest = 9e3 / (G * R * (M + Q * 90.0))
    assert deepest < 1 < here
    near(result.metrics["min_holding_reserve"], here, 1e-6)
    verdict = result.verdict()
    near(verdict.numbers["reserve"], deepest, 1e-9)
    assert verdict.colour == "red"
    assert "worst angle" in str(verdict)


MOTOR = sb.loads.Motor("60 kN*m", "400 kW", "12 rad/s")


def programme(lines, load, pull="8 kN"):
    brake = stop_scene(C=None, R=R, J=400.0).brake
    return sb.programme_scene(brake, lines, load, pull, motor=MOTOR)


@pytest.mark.slow
@pytest.mark.parametrize(
    "load",
    [
        hook(below=20.0),
        CounterweightLoad(
            1700.0, 1200.0, R, rope_mass=3.0, length=300.0, hanging_length=40.0
        ),
    ],
)
def test_programme_comes_back(load):
    lines = (
        "lower 20 m at 0.8 m/s on the motor",
        "brake to rest",
        "hold 2 s",
        "hoist back at 0.8 m/s",
        "hold 3 s",
    )
    result = sb.simulate(programme(lines, load))
    assert result.status == "stopped"
    assert abs(float(result.total_hook_travel)) < 1e-9
    # all that ropes and masses gave came back
    assert abs(float(result.energy["rope_work"])) < 1e-6
    closes(result, 1e-12)


# --- a tackle ------------------------------------------------------------------------


def test_lines_of_a_tackle():
    """The torque of the empty block, and energy with lines of all speeds."""
    load = hook(6.0, 600.0, 30.0, 12e3, 10.0, below=45.0)
    load = dataclasses.replace(load, drum_radius=np.asarray(0.4))
    ropes = load.ropes(0.0, 0)
    near(ropes.torque, G * 6.0 * 0.4 * (30.0 - 45.0))
    speeds = np.array([10, 8, 8, 6, 6, 4, 4, 2, 2, 0]) / 10
    lines = 30.0 * np.sum(speeds**2)
    moving = 6.0 * 0.4**2 * (600.0 - 10 * 30.0 + lines)
    near(ropes.inertia, moving, 1e-12)
    result = run(load, 0.0, 5.0, 4.0)
    end = result.record.y_end
    change = float(result.energy["kinetic_change"])
    there = load.ropes(load.travelled(end.phi), 0)
    bare = 200.0 + 12e3 * 0.04**2
    kinetic = 0.5 * (bare + there.inertia) * end.omega**2
    kinetic -= 0.5 * (bare + ropes.inertia) * 25.0
    near(change, kinetic, 1e-11)
    closes(result, 1e-12)


@pytest.mark.slow
def test_layers_of_a_heavy_rope():
    layers = RopeLayers(0.03, 10.0, 25.0)
    rope = RopeWeight(5.0, 10.0, drum_below=2.0)
    load = sb.HookLoad(4000.0, 0.4, 2.0, rope=layers, weight=rope)
    result = run(load, 12e3, 20.0, 6.0)
    assert changes_of(result)[-2:] == ["layer_change", "stop"]
    travel = float(result.hook_travel)
    turned = float(result.stopping_angle) / (2 * math.pi)
    rise = math.sqrt(3) / 2 * 0.03
    paid_out = 2 * math.pi * (5.0 * (0.4 + 2 * rise) + (turned - 5.0) * (0.4 + rise))
    near(travel, paid_out / 2, 1e-11)
    work = G * 5.0 * 2 * (travel * (10.0 - 2.0) + travel**2 / 2)
    near(result.energy["rope_work"], work, 1e-10)
    closes(result, 1e-11)


# --- two sides -----------------------------------------------------------------------


def by_cosh(q, tail, roping, t):
    """Angle and speed at `t` of a winder: q_t < i q cosh, q_t > i q sines, from rest.

    Of roping 2:1 one of two falls moves, with the speed of the rope.
    """
    car, other, hanging, length = 3000.0, 2500.0, 40.0, 300.0
    arm = R / roping
    J = 500.0 + arm**2 * (car + other + tail * length) + R**2 * q * length
    net = G * arm * (roping * q - tail)
    torque = G * arm * (car - other) + net * (2 * hanging - length)
    k = np.sqrt(complex(2 * net * arm / J))
    phi = torque / J / k**2 * (np.cosh(k * t) - 1)
    return phi.real, (torque / J / k * np.sinh(k * t)).real


@pytest.mark.parametrize(
    ("tail", "roping"), [(0.0, 1.0), (2.0, 1.0), (6.0, 1.0), (5.0, 2.0)]
)
def test_winder_with_tail_rope(tail, roping):
    load = CounterweightLoad(
        3000.0, 2500.0, R, roping, 3.0, tail, length=300.0, hanging_length=40.0
    )
    result = run(load, 0.0, 0.0, 6.0, J=500.0)
    phi, omega = by_cosh(3.0, tail, roping, 6.0)
    end = result.record.y_end
    near(end.phi, phi, 1e-11)
    near(end.omega, omega, 1e-11)
    closes(result, 1e-12)


@pytest.mark.parametrize(
    ("car", "other"), [(1700.0, 1200.0), (1200.0, 1700.0), (1500.0, 1500.0)]
)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_lift_stops_in_both_senses(car, other, way):
    """t = J ω_0/(M_b − M): the load drives it down or up."""
    load = CounterweightLoad(car, other, R, 2.0)
    made = scene(load, 9e3 if way > 0 else 60e3, way * 4.0, 5.0)
    result = sb.simulate(made, rtol=1e-12)
    J = 200.0 + (car + other) * (R / 2) ** 2
    driving = way * G * (car - other) * R / 2
    ratio = PI
    brake = 9e3 if way > 0 else 60e3 / ratio
    assert result.status == "stopped"
    near(result.stopping_time, J * 4.0 / (brake - driving), 1e-11)
    reserve = float(result.metrics["min_holding_reserve"] or np.inf)
    capacity = 60e3 / ratio if way < 0 else 9e3 / ratio
    capacity = capacity if car < other else capacity * ratio
    expected = capacity / (G * abs(car - other) * R / 2) if car != other else np.inf
    near(reserve, expected, 1e-9)


def test_counterweight_pulls_the_car_up():
    load = CounterweightLoad(1200.0, 1700.0, R)
    result = run(load, 200.0, 0.0, 20.0)
    assert result.status == "runaway"
    assert result.verdict().colour == "red"
    assert "upwards" in str(result.verdict())
    assert float(result.record.y_end.phi) < 0


def test_slack_side_ends_the_run():
    """The side that rises decelerates with more than g from some torque on."""
    load = CounterweightLoad(1700.0, 1200.0, R)
    J = 200.0 + 2900.0 * R**2
    limit = J * G / R + 500.0 * G * R
    assert run(load, 0.999 * limit, 4.0, 2.0).status == "stopped"
    assert run(load, 1.001 * limit, 4.0, 2.0).status == "slack_rope"


def test_rope_slips_on_its_sheave():
    load = CounterweightLoad(1700.0, 1200.0, R, traction=2.0)
    J = 200.0 + 2900.0 * R**2
    # 1700 (g + a) = 2 · 1200 (g − a)
    a = G * (2 * 1200.0 - 1700.0) / (2 * 1200.0 + 1700.0)
    limit = J * a / R + 500.0 * G * R
    assert run(load, 0.999 * limit, 4.0, 5.0).status == "stopped"
    assert run(load, 1.001 * limit, 4.0, 5.0).status == "slack_rope"


# --- a windlass ----------------------------------------------------------------------


def windlass(hanging, depth=50.0, **more):
    given = {"submerged": 1.0, "lift": 5.0, "wrapped": 2.0, **more}
    return WindlassLoad(5000.0, 100.0, R, hanging, depth, 1000.0, **given)


@pytest.mark.slow
def test_chain_that_runs_out_has_a_terminal_speed():
    result = run(windlass(50.0), 0.0, 0.0, 10.0, J=2000.0)
    end = result.record.y_end
    M_e = 2000.0 / R**2 + 100.0 * 57.0
    fast = math.sqrt(G * 45.0)
    x = 100.0 * fast * 10.0 / M_e
    near(float(end.omega) * R, fast * math.tanh(x), 1e-11)
    near(fast * math.tanh(x), 19.1374680256, 1e-11)
    run_out = M_e / 100.0 * math.log(math.cosh(x))
    near(float(end.phi) * R, run_out, 1e-11)
    near(run_out, 121.346458997, 1e-11)
    closes(result, 1e-12)
    near(result.terminal_speed, fast / R, 1e-9)


def test_anchor_comes_to_the_ground():
    """Its weight, its inertia and its energy leave the chain there."""
    result = run(windlass(30.0), 0.0, 0.0, 10.0, J=2000.0)
    assert changes_of(result) == ["anchor_grounded"]
    (t,) = result.events["anchor_grounded"].times
    before = result.series([t], left=True)
    after = result.series([t])
    assert float(after.omega[0]) == float(before.omega[0])
    v = float(after.omega[0]) * R
    closes(result, 1e-12)

    def hanging(t, y):
        x, v = y
        moving = 2000.0 / R**2 + 5000.0 + 100.0 * (30.0 + x + 7.0)
        force = G * (5000.0 + 100.0 * (30.0 + x) - 500.0)
        return [v, (force - 100.0 * v**2) / moving]

    ground = solve_ivp(
        hanging,
        (0, 10),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        events=lambda t, y: y[0] - 20.0,
    )
    near(t, ground.t_events[0][0], 1e-10)
    near(v, ground.y_events[0][0][1], 1e-10)


def test_anchor_is_lifted_with_the_momentum():
    """Thrown upwards without a brake, the gypsy lifts its anchor."""
    result = run(windlass(51.0), 0.0, -9.0, 2.0, J=2000.0)
    assert changes_of(result)[0] == "anchor_lifted"
    t = result.events["anchor_lifted"].times[0]
    before = float(result.series([t], left=True).omega[0])
    after = float(result.series([t]).omega[0])
    J = 2000.0 + R**2 * 100.0 * 57.0
    near(after / before, J / (J + R**2 * 5000.0), 1e-12)
    closes(result, 1e-12)


@pytest.mark.slow
def test_derivatives_through_the_ground():
    def stop(x):
        load = dataclasses.replace(
            windlass(x[0], x[1]), chain_mass=x[2], submerged=x[3]
        )
        made = scene(load, 30e3, x[4], 20.0, J=2000.0)
        return sb.simulate(made, rtol=1e-12).stopping_time

    x = jnp.asarray([47.0, 50.0, 100.0, 0.9, 4.0])
    slopes = jax.grad(stop)(x)
    for i, value in enumerate(x):
        h = 1e-4 * float(value)
        one = [float(stop(x.at[i].add(k * h))) for k in (-2, -1, 1, 2)]
        slope = (one[0] - 8 * one[1] + 8 * one[2] - one[3]) / (12 * h)
        near(slopes[i], slope, 1e-7)


# --- a load of one's own -------------------------------------------------------------


class Spring(AbstractLoad):
    """A torsion spring on the shaft."""

    stiffness: sb.profiles.Real = sb.quantity("N*m", "stiffness", default=500.0)
    profile = sb.Constant(0.0)

    def torque_by_angle(self, t, omega, piece, phi):
        return -self.stiffness * phi


class Neither(AbstractLoad):
    profile = sb.Constant(0.0)


def test_own_load_by_the_angle():
    result = run(Spring(), 0.0, 3.0, 4.0, J=800.0)
    k = math.sqrt(500.0 / 800.0)
    end = result.record.y_end
    near(end.phi, 3.0 / k * math.sin(4 * k), 1e-11)
    near(end.omega, 3.0 * math.cos(4 * k), 1e-11)
    closes(result, 1e-9)
    with pytest.raises(NotImplementedError, match="neither `torque` nor"):
        run(Neither(), 0.0, 3.0, 4.0)
