"""First derivatives at corners: where a slide ends, breakpoints at one instant, the
blend of a fade."""

import math
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from chain_scenes import chain, first_and_stop
from heat_scenes import BETA, T0, J, N, R
from helpers import all_near, jacobians, near
from scenes import lining_ratio, stop_run, stop_scene
from scipy.integrate import quad
from staged_scenes import stop as staged_stop

import simbrake as sb
from simbrake.friction import continued

Z = math.tan(BETA / 2)


def ratio_and_slope(f):
    """`Π` of the linings of the standard stop and its derivative by the coefficient of
    friction."""
    Pi = lining_ratio(f, BETA) ** N
    return Pi, 2 * N * Z * Pi / (1 - (f * Z) ** 2)


# --- the end of a slide -------------------------------------------------------------


class Magnitude(sb.friction.AbstractFriction):
    """`f = f_k + (f_s − f_k) exp(−|v|/v_s)`, as a user may write it."""

    static_coefficient: float
    kinetic_coefficient: float
    stribeck_speed: float
    speed_dependent: ClassVar[bool] = True

    def kinetic(self, contact):
        fall = jnp.exp(-jnp.abs(contact.v) / self.stribeck_speed)
        return (
            self.kinetic_coefficient
            + (self.static_coefficient - self.kinetic_coefficient) * fall
        )

    def static(self, contact):
        return jnp.asarray(self.static_coefficient)


def straight(f_s, f_k, v_s):
    """A table of two points: a straight line from `f_s` at rest to `f_k` at `v_s`."""
    return sb.friction.TabulatedFriction(
        jnp.stack([0.0 * v_s, v_s]), jnp.stack([f_s, f_k])
    )


@pytest.mark.slow
def test_a_law_with_a_slope_at_rest():
    """Rigid band, no load: `t = ∫ J dω/(R T_0 (Π(f(R ω)) − 1))`, so that
    `T_0 ∂t/∂T_0 = −t`."""
    v_s = 4.0

    def stopping_time(x):
        scene = stop_scene(C=None, T0=x[0], law=Magnitude(x[1], x[2], jnp.asarray(v_s)))
        return sb.simulate(scene, max_steps=256).stopping_time

    value, forward, reverse = jacobians(stopping_time)(jnp.asarray([T0, 0.35, 0.25]))

    def of_speed(w, part):
        s = math.exp(-R * w / v_s)
        Pi, slope = ratio_and_slope(0.25 + 0.1 * s)
        time = J / (R * T0 * (Pi - 1))
        return (
            time,
            -time / T0,
            -time / (Pi - 1) * slope * s,
            -time / (Pi - 1) * slope * (1 - s),
        )[part]

    exact = [
        quad(of_speed, 0.0, 20.0, args=(part,), epsabs=0.0, epsrel=1e-13)[0]
        for part in range(4)
    ]
    near(value, exact[0], 1e-9)
    all_near(reverse, exact[1:], 1e-8)
    all_near(forward, exact[1:], 1e-8)


def test_laws_keep_their_slope_past_rest():
    for law in (
        sb.StribeckFriction(0.4, 0.3, 0.5, 1.0),
        straight(0.4, 0.3, 0.5),
        Magnitude(0.4, 0.3, 0.5),
    ):

        def f(v, law=law):
            return continued(lambda v: law.kinetic(sb.friction.Contact(v)), v)

        v = np.array([-1e-7, 1e-7])
        value, slope = jax.jvp(f, (jnp.asarray(v),), (jnp.ones(2),))
        all_near(value, 0.4 - 0.2 * v, atol=1e-12)
        all_near(slope, -0.2, 1e-6)
        assert float(f(jnp.asarray(0.0))) == 0.4


def derivative_by_scale(scene, powers, stop):
    """A stopping time, and its derivative by `λ` where numbers of a scene grow as the
    powers of `λ` given."""

    def at(scale):
        values = {leaf.path: leaf.value for leaf in sb.files.leaves(scene)}
        return stop(
            sb.with_values(
                scene,
                {path: values[path] * scale**power for path, power in powers.items()},
            )
        )

    return jax.jit(lambda: jax.jvp(at, (jnp.ones(()),), (jnp.ones(()),)))()


@pytest.mark.slow
def test_time_scales_with_staged_brake_force():
    """Rigid band, no load: `t ~ 1/λ` where tensions and preload grow as `λ`, whatever
    the friction laws are."""
    law = sb.StribeckFriction(0.40, 0.3, 3.0, 1.0)
    inner = sb.StribeckFriction(0.22, 0.15, 3.0, 1.0)
    scene = staged_stop(lever=sb.Constant(8e3), load=0.0, law=law, inner=inner)
    powers = {"duty.slack_tension.level": 1, "brake.bandage.preload": 1}
    t, slope = derivative_by_scale(
        scene, powers, lambda s: sb.simulate(s, max_steps=256).stopping_time
    )
    near(slope, -float(t), 1e-8)


@pytest.mark.slow
def test_time_scales_with_forces_of_a_chain():
    """`t ~ 1/λ` where tensions and damping grow as `λ` and stiffnesses as `λ²`: lengths
    shrink, speeds stay."""
    law = sb.StribeckFriction(0.3, 0.2, 0.3, 1.0)
    scene = chain(
        n=2, law=law, T0=3.0, C=5.0, K=20.0, m=0.05, damping=0.1, x0=0.0, end=30.0
    )
    powers = {"duty.slack_tension.values": 1, "brake.band.segments.anchor_damping": 1}
    powers |= {"brake.band.stiffness": 2, "brake.band.segments.stiffness": 2}
    t, slope = derivative_by_scale(
        scene, powers, lambda s: first_and_stop(s, rtol=1e-11)[1]
    )
    # at rest, after each lining has slid
    near(t, 6.52416, 1e-5)
    near(slope, -float(t), 1e-8)


# --- breakpoints at one instant -----------------------------------------------------


def jump(at, before, after):
    return sb.PiecewiseLinear(jnp.stack([at, at]), jnp.asarray([before, after]))


@pytest.mark.slow
def test_tied_breakpoints_keep_derivatives():
    """Lever doubled at 1 s, `t = k/2 + ω_0/(2 a)`; an idle corner of the load there,
    and (second point) the end."""

    def run(x):
        load = sb.TorqueLoad(jump(x[1], 0.0, 0.0))
        scene = stop_scene(C=None, lever=jump(x[0], 4e3, 8e3), load=load, end=x[2])
        result = sb.simulate(scene, max_steps=256)
        return jnp.stack([result.stopping_time, result.record.y_end.omega])

    a = 4e3 * R * (ratio_and_slope(0.35)[0] - 1) / J
    cases = [
        ([1.0, 1.0, 5.0], 0, [0.5, 0.0, 0.0]),
        ([1.0, 1.0, 1.0], 1, [0.0, 0.0, -a]),
    ]
    cases.append(([1.0, 1.0 + 2e-16, 5.0], 0, [0.5, 0.0, 0.0]))
    both = jacobians(run)
    for at, row, exact in cases:
        for jacobian in map(np.asarray, both(np.asarray(at))[1:]):
            all_near(jacobian[row], exact, 1e-10, 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("C", [None, 2e5])
def test_two_tied_breakpoints_at_rest(C):
    """Lever and load change together, up, down, and with the lever let go: held before
    and after is held all along."""
    times = np.array([1.0, 1.0, 2.0, 2.0, 3.0, 3.0])
    lever = sb.PiecewiseLinear(times, np.array([4e3, 8e3, 8e3, 4e3, 4e3, 0.0]))
    load = sb.TorqueLoad(
        sb.PiecewiseLinear(times, np.array([10e3, 20e3, 20e3, 10e3, 10e3, 20e3]))
    )
    # neither change by itself would leave it at rest
    assert ratio_and_slope(0.35)[0] * 4e3 * R < 20e3
    result = stop_run(C=C, w0=0.0, lever=lever, load=load, end=3.1)
    assert [(e.name, e.time) for e in result.events] == [("release", 3.0)]
    near(result.record.y_end.omega, 20e3 * 0.1 / J, 1e-12)


# --- the blend of a fade ------------------------------------------------------------


def test_derivative_of_the_rate_of_a_maximum():
    """The rate of `max x_i` is that of one entry, and so is the derivative of its value
    along another direction."""
    x = jnp.asarray([0.1, 0.3, 0.3])
    rate = jnp.asarray([1.0, 2.0, 5.0])

    def value_and_rate(x):
        return jax.jvp(sb.hybrid.largest, (x,), (rate,))

    (value, of_value), (moved, _) = jax.jvp(value_and_rate, (x,), (rate,))
    assert [float(y) for y in (value, of_value, moved)] == [0.3, 2.0, 2.0]
