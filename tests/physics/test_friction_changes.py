"""Friction that is changed while a brake runs: oil, lost linings; closed forms, SciPy,
files, input."""

import dataclasses
import math

import bandage_scenes
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import TSIT5, all_near, closes, jacobians, near
from scenes import drawworks_brake, lining_ratio, replaced
from scipy.integrate import quad
from shoe_scenes import normals, shoe_scene

import simbrake as sb
from simbrake.friction import ChangingFriction, FrictionChange

R_B = 0.623
INERTIA = 1200.0
T0 = 6e3
OMEGA = 24.0
COUNT = 8
MU = 0.35
BETA = math.radians(270 / COUNT)


def jump(time, to, begin=1.0):
    return sb.PiecewiseLinear([time, time], [begin, to])


def changed(base, factor, linings=None):
    return ChangingFriction(base, (FrictionChange(factor, linings),))


def scene(law, stiffness=None, load=0.0, omega=OMEGA, end=8.0, T_0=T0):
    brake = drawworks_brake(COUNT, law, stiffness)
    # (at rest the band has the elongation with which it bears the load)
    elongation = 0.0 if stiffness is None or omega else (T0 + load / R_B) / stiffness
    return sb.Scene(brake, sb.Duty(T_0, load), sb.Initial(omega, elongation), end)


def torque(factor, f=MU, chosen=slice(None), T_0=T0):
    """`R_b T_0 (Π − 1)`, `Π` the product of the ratios `T_i/T_{i−1}`."""
    each = jnp.full(COUNT, f).at[chosen].multiply(factor)
    return R_B * T_0 * (jnp.prod(lining_ratio(each, BETA)) - 1)


@pytest.mark.slow
def test_a_lost_lining_compiles_nothing():
    """Which lining is a number: all of them lower the torque alike on a rigid band."""
    law = ChangingFriction(
        MU,
        (FrictionChange(jump(0.2, 0.0), 1.0), FrictionChange(jump(1.0, 0.5), [2, 5])),
    )
    run = sb.prepare(scene(law), ["stopping_time"])
    lost = torque(0.0, MU, slice(0, 1))
    each = np.full(COUNT, MU)
    each[[0, 1, 4]] *= [0.0, 0.5, 0.5]
    both = R_B * T0 * (np.prod(lining_ratio(each, BETA)) - 1)
    left = OMEGA - (0.2 * torque(1.0) + 0.8 * lost) / INERTIA
    for number in (1.0, 7.0):
        found = run({"brake.linings.friction.changes[0].linings": number}).metrics[
            "stopping_time"
        ]
        near(found, 1.0 + left * INERTIA / both, 1e-12)


@pytest.mark.slow
def test_held_load_goes_when_friction_jumps():
    """It holds until the instant of the jump, then `J ω̇ = M − M_k`; exactly, in either
    direction."""
    end = 2.0
    ratio = 1.2

    def held(x):
        law = changed(sb.ConstantFriction(MU, ratio), jump(x[0], x[1]))
        return scene(law, 3e5, x[2], 0.0, end)

    def grip(f, load):
        Pi = lining_ratio(f, BETA) ** COUNT
        return R_B * T0 * jnp.where(load > 0, Pi - 1, 1 / Pi - 1)

    def by_hand(x):
        return ((x[2] - grip(MU * x[1], x[2])) / INERTIA * (end - x[0]))[None]

    run = jacobians(
        lambda x: sb.simulate(held(x), max_steps=128).record.y_end.omega[None]
    )
    for x in (np.array([1.7, 0.45, 14e3]), np.array([1.2, 0.45, -2.5e3])):
        assert (
            abs(grip(MU * ratio, x[2])) > abs(x[2]) > abs(grip(MU * ratio * x[1], x[2]))
        )
        value, forward, backward = run(x)
        all_near(value, by_hand(x), 1e-11)
        all_near(forward, jax.jacobian(by_hand)(x), 1e-8)
        all_near(backward, forward, 1e-9)
        result = sb.simulate(held(x))
        assert result.events["restart"].times[0] == x[0]
        assert np.all(
            np.asarray(result.series([0.3, 1.0, x[0]], left=True).omega) == 0.0
        )
        closes(result, 1e-12)


# --- other brakes -------------------------------------------------------------------


@pytest.mark.slow
def test_an_oiled_shoe():
    """The leading shoe loses friction: its load falls as well; one of them rising until
    it locks ends the run."""
    f = np.array([0.32, 0.32])
    law = changed(sb.ConstantFriction(f, 1.1), jump(0.3, 0.25), 1.0)
    result = sb.simulate(shoe_scene(friction=law))
    before = 0.150 * np.sum(f * normals(f))
    after = 0.150 * np.sum(f * [0.25, 1.0] * normals(f * [0.25, 1.0]))
    near(result.stopping_time, 0.3 + (25.0 - before * 0.3 / 12.0) * 12.0 / after, 1e-11)
    wet = changed(sb.ConstantFriction(f, 1.1), jump(0.3, 4.0), 1.0)
    locked = sb.simulate(shoe_scene(friction=wet), throw=False)
    assert locked.status == "singular_geometry"
    assert float(locked.record.t_end) == 0.3


@pytest.mark.slow
def test_a_lining_on_springs_locks():
    """Where `R f sin(β/2)/R_b` of a lining on the rim comes to 1, whether its friction
    rises to that or jumps past."""
    base = bandage_scenes.scene(n=2, lever=((0.0, 9.0), (2e3, 2e3)), end=0.9)
    f = 0.2
    s = math.sin(float(base.brake.linings.angle[0]) / 2)
    limit = bandage_scenes.R_B / (bandage_scenes.R * f * s)
    for times, end, locks in (
        ([0.3, 0.8], 2 * limit - 1, 0.55),
        ([0.6, 0.6], 1.01 * limit, 0.6),
        ([0.6, 0.6], 0.99 * limit, None),
    ):
        law = changed(
            sb.ConstantFriction(f), sb.PiecewiseLinear(times, [1.0, end]), [2]
        )
        given = replaced(base, {"brake.bandage.friction": law})
        result = sb.simulate(given, solver=TSIT5, throw=False)
        assert (result.status == "singular_geometry") == (locks is not None)
        near(result.record.t_end, locks or 0.9, 1e-9)


@pytest.mark.slow
def test_runaway_waits_for_changes_to_come():
    """A load beyond the oiled brake runs away, unless the brake dries later."""
    load = 8e3
    oily = sb.simulate(scene(changed(MU, jump(0.5, 0.3)), None, load, 10.0, 4.0))
    assert oily.status == "runaway"
    drying = sb.PiecewiseLinear([0.5, 0.5, 6.0, 7.0], [1.0, 0.3, 0.3, 1.0])
    assert (
        sb.simulate(scene(changed(MU, drying), None, load, 10.0, 4.0)).status
        == "not_stopped"
    )


# --- changes that begin when something happens --------------------------------------


def waiting(base, factor, when, linings=None):
    return ChangingFriction(base, (FrictionChange(factor, linings, when),))


@pytest.mark.slow
def test_second_stop_begins_a_change():
    """Two stops by hand; at the second the held load breaks away."""
    load = 9e3
    let_go = 2.0
    pulled = 2.6
    end = 7.0
    ratio = 1.2
    lever = sb.PiecewiseLinear([let_go, let_go, pulled, pulled], [T0, 0.0, 0.0, T0])
    base = sb.ConstantFriction(MU, ratio)

    def stops(x):
        """The second stop, for the load `x[1]`, from the speed `x[0]`."""
        return pulled + x[1] * (pulled - let_go) / (torque(1.0) - x[1])

    def by_hand(x):
        return ((x[1] - torque(x[2])) / INERTIA * (end - stops(x)))[None]

    def found(x):
        law = waiting(base, x[2], "stop 2")
        return sb.simulate(
            scene(law, None, x[1], x[0], end, lever), max_steps=256
        ).record.y_end.omega[None]

    x = jnp.asarray([OMEGA / 3, load, 0.3])
    value, forward, backward = jacobians(found)(x)
    all_near(value, by_hand(x), 1e-11)
    for jacobian in (forward, backward):
        all_near(jacobian, jax.jacobian(by_hand)(x), 1e-9, 1e-12)
    result = sb.simulate(
        scene(waiting(base, 0.3, "stop 2"), None, load, OMEGA / 3, end, lever)
    )
    names = [
        event.name
        for event in result.events
        if event.time == result.events["friction_change"].times[0]
    ]
    assert names[:3] == ["stop", "friction_change", "restart"]
    assert len(result.events["stop"].times) == 2
    closes(result, 1e-12)


def heated_from_outside(
    level,
    power,
    capacity,
    factor,
    *,
    when=None,
    load=9e3,
    stiffness=None,
    end=4.0,
    rises=True,
):
    """A load held at rest while a source warms the rim, `T = T_0 + P t/C`."""
    heat = sb.Heat(
        (sb.thermal.Lump("rim", capacity),),
        sources=(sb.thermal.Source("rim", power),),
        friction=sb.thermal.FrictionHeat("rim", None, 1.0),
        rim="rim",
    )
    when = sb.loads.AtTemperature(level, falling=not rises) if when is None else when
    law = waiting(sb.ConstantFriction(MU, 1.2), factor, when)
    return dataclasses.replace(scene(law, stiffness, load, 0.0, end), heat=heat)


@pytest.mark.slow
def test_hot_rim_begins_a_change():
    """The held load goes as the rim is as hot: `t = (T − T_0) C/P`, exactly, and with
    all derivatives."""
    end = 4.0
    load = 9e3

    def begins(x):
        return (x[0] - 293.15) * x[2] / x[1]

    def by_hand(x):
        return ((load - torque(x[3])) / INERTIA * (end - begins(x)))[None]

    def found(x):
        return sb.simulate(heated_from_outside(*x), max_steps=128).record.y_end.omega[
            None
        ]

    x = jnp.asarray([393.15, 5e4, 1e3, 0.3])
    value, forward, backward = jacobians(found)(x)
    all_near(value, by_hand(x), 1e-10)
    for jacobian in (forward, backward):
        all_near(jacobian, jax.jacobian(by_hand)(x), 1e-8)
    result = sb.simulate(
        heated_from_outside(*x, when="temperature of the rim above 120 degC")
    )
    near(result.events["friction_change"].times, [float(begins(x))], 1e-12)
    assert result.events["restart"].times == result.events["friction_change"].times
    never = sb.simulate(heated_from_outside(393.15 + 300.0, *x[1:]))
    assert not never.events["friction_change"].times
    assert never.status == "held"
    at_once = sb.simulate(heated_from_outside(393.15, *x[1:], rises=False))
    assert at_once.events["friction_change"].times == [0.0]


# --- what goes with it --------------------------------------------------------------


def test_change_is_linear_between_points():
    """A ramp of the factor on a rigid band: the stop by quadrature."""
    result = sb.simulate(
        scene(changed(MU, sb.PiecewiseLinear([0.2, 1.0], [1.0, 0.6]), [1, 8]))
    )
    lost = quad(
        lambda t: float(torque(1 - 0.5 * (t - 0.2), MU, jnp.asarray([0, 7]))),
        0.2,
        1.0,
        epsrel=1e-12,
    )[0]
    left = OMEGA - (0.2 * torque(1.0) + lost) / INERTIA
    truth = 1.0 + left * INERTIA / torque(0.6, MU, jnp.asarray([0, 7]))
    near(result.stopping_time, truth, 1e-10)
