"""A continuous lining under a band, by Euler–Eytelwein: closed forms, SciPy, and the
limit of many blocks."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, closes, input_error, jacobians, near
from scenes import lining_ratio
from scipy.integrate import solve_ivp

import simbrake as sb

R = 0.62
J = 1100.0
WIDTH = 0.23
F = 0.35
WRAP = math.radians(270.0)
T0 = 6e3
W0 = 24.0


def lining(n=6, f=F, wrap=WRAP, **options):
    return sb.Lining(
        f, jnp.full(n, wrap / n), R * WIDTH * wrap / n, continuous=True, **options
    )


def scene(linings, tension=T0, stiffness=None, load=0.0, omega=W0, end=8.0, **options):
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R, stiffness), linings)
    return sb.Scene(brake, sb.Duty(tension, load), sb.Initial(omega), end, **options)


@pytest.mark.parametrize(
    "n",
    [
        pytest.param(2, marks=pytest.mark.slow),
        7,
        pytest.param(40, marks=pytest.mark.slow),
    ],
)
def test_stop_is_that_of_euler_and_eytelwein(n):
    """`M = R T_0 (e^{fα} − 1)` with any number of pieces; tension, load and pressure
    along the band."""
    result = sb.simulate(scene(lining(n)))
    torque = R * T0 * math.expm1(F * WRAP)
    near(result.stopping_time, J * W0 / torque, 1e-13)
    pair = result.series([0.1]).pairs["external"]
    tension = T0 * np.exp(F * WRAP * np.arange(n + 1) / n)
    all_near(result.series([0.1]).tension[0], tension[1:], 1e-13)
    # ∫ T dθ
    all_near(pair.normal_load[0], np.diff(tension) / F, 1e-12)
    all_near(pair.friction_force[0], np.diff(tension), 1e-12)
    # p = T/(R b)
    all_near(pair.tight_edge_pressure[0], tension[1:] / (R * WIDTH), 1e-12)
    all_near(pair.slack_edge_pressure[0], tension[:-1] / (R * WIDTH), 1e-12)
    # at rest without a load, under the same tension everywhere
    held = result.series([7.9]).pairs["external"]
    all_near(held.normal_load[0], T0 * WRAP / n, 1e-13)
    backwards = sb.simulate(scene(lining(n), omega=-W0, end=20.0))
    near(backwards.stopping_time, J * W0 / (R * T0 * -math.expm1(-F * WRAP)), 1e-13)
    closes(result, 1e-12)


@pytest.mark.slow
def test_derivatives_of_the_stop():
    def found(x):
        linings = lining(f=sb.ConstantFriction(x[0]), wrap=x[1])
        return sb.simulate(scene(linings, tension=x[2]), max_steps=128).stopping_time[
            None
        ]

    x = np.array([F, WRAP, T0])
    value, forwards, backwards = jacobians(found)(jnp.asarray(x))
    grows = math.exp(F * WRAP) / math.expm1(F * WRAP)
    truth = value[0] * np.array([-WRAP * grows, -F * grows, -1 / T0])
    for jacobian in (forwards, backwards):
        all_near(jacobian[0], truth, 1e-9)


def test_blocks_converge_to_it_by_second_order():
    """`ln Π = 2 n artanh(f tan(α/2n)) = f α + f (1 + f²) α³/(12 n²) + …`"""
    counts = np.array([50, 100, 200])
    torque = R * T0 * math.expm1(F * WRAP)
    blocks = [
        sb.Brake(sb.Pulley(R, J), sb.Band(R), sb.uniform_linings(n, WRAP, F))
        for n in counts
    ]
    found = np.array(
        [float(brake.torque(T0, jnp.full(brake.linings.count, F))) for brake in blocks]
    )
    error = np.log((1 + found / (R * T0)) / (1 + torque / (R * T0)))
    all_near(error * counts**2, F * (1 + F**2) * WRAP**3 / 12, 2e-3)


@pytest.mark.slow
def test_arc_that_slips_on_an_elastic_band():
    """`C x = T_0 e^{fφ}`: slip begins at the slack end, and has passed piece after
    piece up to full slip."""
    n = 4
    C = 3e5
    result = sb.simulate(scene(lining(n), stiffness=C))
    swing = R * math.sqrt(C / J)
    # taut at C x = T_0, after that J ω̇ = −R (C x − T_0)
    taut = T0 / C / (R * W0)

    def reached(k):
        return (
            taut
            + math.asin(T0 * math.expm1(F * WRAP * k / n) / C * swing / (R * W0))
            / swing
        )

    near(result.slip_onset_time, taut, 1e-12)
    near(result.full_slip_time, reached(n), 1e-10)
    at_limit = {
        event.lining: event.time
        for event in result.events
        if event.name == "lining_limit"
    }
    for k in range(1, n):
        near(at_limit[k], reached(k), 1e-9)
    between = 0.5 * (reached(2) + reached(3))
    now = result.series([between])
    arc = math.log(float(now.tight_tension[0]) / T0) / F
    assert int(now.at_limit[0]) == 2 == math.floor(arc / (WRAP / n))


@pytest.mark.slow
def test_friction_that_falls_with_the_pressure():
    """`dT/dθ = f(T/(R b)) T` by SciPy; pieces have the coefficient of their mean
    pressure, an error of 1/n²."""
    p_r = 2e5
    m = 0.3

    def slope(angle, T):
        return F * (1 + T / (R * WIDTH) / p_r) ** -m * T

    truth = solve_ivp(slope, (0.0, WRAP), [T0], "DOP853", rtol=1e-12, atol=1e-6).y[
        0, -1
    ]
    law = sb.friction.ProductFriction(F, (sb.friction.PressureFactor(p_r, m),))
    errors = []
    for n in (5, 10, 20):
        tight = (
            sb.simulate(scene(lining(n, law), end=0.01))
            .series([0.005])
            .tight_tension[0]
        )
        errors.append(float(tight) / truth - 1)
    ratios = np.divide(errors[:-1], errors[1:])
    all_near(ratios, 4.0, 0.02)
    assert abs(errors[-1]) < 1e-4


@pytest.mark.slow
def test_one_of_two_bands():
    """A continuous lining beside blocks, each with half of the lever."""
    blocks = sb.uniform_linings(8, WRAP, F)
    bands = (
        sb.brakes.LinedBand(lining(), share=1.0),
        sb.brakes.LinedBand(blocks, share=1.0),
    )
    brake = sb.brakes.MultiBandBrake(sb.Pulley(R, J), R, bands)
    # (areas of both, or of none)
    with input_error(match=r"bands\[1\].linings.area"):
        sb.check_scene(sb.Scene(brake, sb.Duty(T0, 0.0), sb.Initial(W0), 8.0))
    bare = sb.brakes.LinedBand(
        sb.uniform_linings(6, WRAP, F, continuous=True), share=1.0
    )
    brake = sb.brakes.MultiBandBrake(sb.Pulley(R, J), R, (bare, bands[1]))
    result = sb.simulate(sb.Scene(brake, sb.Duty(T0, 0.0), sb.Initial(W0), 8.0))
    of_blocks = lining_ratio(F, WRAP / 8) ** 8 - 1
    near(
        result.stopping_time,
        J * W0 / (R * 0.5 * T0 * (math.expm1(F * WRAP) + of_blocks)),
        1e-13,
    )
    rise = math.exp(F * WRAP / 6) - 1
    pair = result.series([0.1]).pairs["external"]
    near(pair.tension_increment[0, 0], 0.5 * T0 * rise, 1e-12)
    near(pair.friction_force[0, 6], F * float(pair.normal_load[0, 6]), 1e-12)
