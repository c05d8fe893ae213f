"""Holding reserve: static capacity in the direction of the load over the load; hot, and
of every kind of brake."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from disc_scenes import LOAD, RATIO, TORQUE, disc_scene
from helpers import all_near, near
from scenes import lining_ratio
from scipy.optimize import brentq
from shoe_scenes import FRICTION, normals, shoe_scene

import simbrake as sb

R = 0.7
N = 12
BETA = math.radians(20.0)
F = 0.32
STATIC = 1.15
T0 = 6e3
M = 6e3
TIMES = np.array([0.0, 1.0, 2.5, 4.0])


def capstan(f):
    return lining_ratio(f, BETA) ** N


def held(load=M, lever=None, law=None, **parts):
    law = law or sb.ConstantFriction(F, STATIC)
    brake = sb.Brake(sb.Pulley(R, 900.0), sb.Band(R), sb.Lining(law, np.full(N, BETA)))
    lever = lever or sb.PiecewiseLinear([0.0, 1.0, 4.0], [T0, T0, 0.5 * T0])
    return sb.Scene(
        brake,
        sb.Duty(lever, load),
        sb.Initial(0.0),
        4.0,
        **parts,
    )


@pytest.mark.slow
def test_reserve_of_a_band_brake_either_way():
    tension = T0 * np.array([1.0, 1.0, 0.75, 0.5])
    for load, grip in (
        (M, capstan(STATIC * F) - 1),
        (-0.2 * M, 1 - 1 / capstan(STATIC * F)),
    ):
        result = sb.simulate(held(load))
        reserve = R * tension * grip / abs(load)
        all_near(result.series(TIMES).holding_reserve, reserve, 1e-12)
        near(result.metrics["min_holding_reserve"], reserve[-1], 1e-9)
        near(result.min_holding_reserve.time, 4.0, 1e-9)


@pytest.mark.slow
def test_a_lever_that_follows_the_speed_has_its_limit():
    """At rest it pulls what balances the load, and could pull more."""
    stop = sb.Driller(sb.PiecewiseLinear([0.0, 2.0], [10.0, 0.0]), T0)
    result = sb.simulate(sb.with_values(held(0.5 * M, stop), {"initial.omega": 10.0}))
    reserve = R * T0 * (capstan(STATIC * F) - 1) / (0.5 * M)
    assert result.series([3.0]).omega[0] == 0.0
    near(result.metrics["min_holding_reserve"], reserve, 1e-12)


@pytest.mark.slow
def test_reserve_falls_with_fade():
    """Linings heated by a source: `T = T_a + P t/C`, `f = f_0 (1 − s (T − T_a))`; its
    derivatives."""
    C = 2e4
    slope = 1e-3

    def scene(x):
        load, f, power = x
        heat = sb.Heat(
            (sb.thermal.Lump("linings", C, 300.0),),
            friction=sb.thermal.FrictionHeat(None, "linings", 1.0),
            sources=(sb.thermal.Source("linings", power),),
            linings="linings",
        )
        law = sb.friction.ProductFriction(
            sb.ConstantFriction(f, STATIC), (sb.LinearFade(slope, 300.0),)
        )
        return held(load, sb.Constant(T0), law, heat=heat)

    def reserve(x, t):
        load, f, power = x
        return R * T0 * (capstan(STATIC * f * (1 - slope * power * t / C)) - 1) / load

    x = jnp.asarray([M, F, 1e5 / 4])
    result = sb.simulate(scene(np.asarray(x)))
    all_near(result.series(TIMES).holding_reserve, reserve(np.asarray(x), TIMES), 1e-9)
    value, slopes = jax.value_and_grad(
        lambda x: sb.simulate(scene(x), max_steps=256).min_holding_reserve.value
    )(x)
    expected, truth = jax.value_and_grad(lambda x: reserve(x, 4.0))(x)
    all_near(value, expected, 1e-9)
    all_near(slopes, truth, 1e-7)


@pytest.mark.slow
def test_reserve_of_disc_and_shoes():
    disc = sb.simulate(disc_scene())
    near(disc.metrics["min_holding_reserve"], RATIO * TORQUE / LOAD, 1e-12)
    for load in (60.0, -60.0):
        shoes = sb.simulate(shoe_scene(omega=0.0, load=load, end=1.0))
        f = 1.1 * FRICTION
        capacity = 0.150 * f * np.sum(normals(f, back=load < 0))
        near(shoes.metrics["min_holding_reserve"], capacity / 60.0, 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("f_int", "wet", "oiled"), [(0.6, 0.8, 1.1), (0.04, 0.9, 1.2)])
def test_staged_reserve_is_of_weaker_pair(f_int, wet, oiled):
    """`wet`, `oiled`: factors of the friction in the outer and in the inner pair."""
    T_0 = 5e3
    load = 300.0
    ratio = 1.2

    def changed(f, factor):
        change = sb.friction.FrictionChange(
            sb.PiecewiseLinear([0.0, 1.0], [factor, factor])
        )
        return sb.friction.ChangingFriction(sb.ConstantFriction(f, ratio), (change,))

    laws = {
        "law": changed(staged.F_EXT / wet, wet),
        "inner": changed(f_int / oiled, oiled),
    }
    scene = staged.stop(lever=sb.Constant(T_0), load=load, w0=0.0, end=1.0, **laws)
    s = math.sin(staged.BETA / 2)
    mu = np.full(staged.N, lining_ratio(ratio * staged.F_EXT, staged.BETA))

    def grip(T_n):
        T = staged.tensions(T_0, T_n, mu)
        return (
            staged.R
            * ratio
            * f_int
            * float(np.sum((T[1:] + T[:-1]) * s + staged.PRELOAD))
        )

    most = T_0 * np.prod(mu)
    outer = staged.R_B * (most - T_0)
    inner = grip(most)
    # the band holds what slides in the bandage with less than its limit
    if inner < outer:
        inner = grip(
            brentq(
                lambda T_n: staged.R_B * (T_n - T_0) - grip(T_n), T_0, most, xtol=1e-10
            )
        )
    found = sb.simulate(scene).metrics["min_holding_reserve"]
    near(found, min(outer, inner) / load, 1e-9)


# --- the lever that is let go, and the load that breaks away ------------------------

# lever (s, times T0), factor of friction and load (times M) from 2 s on: minimum, when;
# at T0 it is `FULL`
CASES = {
    "let go at once": (
        ([0.0, 1.0, 3.0, 3.0], [1.0, 1.2, 1.2, 0.0]),
        1.0,
        1.0,
        1.0,
        0.0,
    ),
    "dropped, but not open": (
        ([0.0, 1.0, 3.0, 3.0], [1.0, 1.2, 1.2, 0.1]),
        1.0,
        1.0,
        0.1,
        3.0,
    ),
    "eased, and held": (
        ([0.0, 1.0, 3.0, 3.5], [1.0, 1.0, 1.0, 0.8]),
        1.0,
        1.0,
        0.8,
        3.5,
    ),
    "let go in two steps": (
        ([0.0, 1.0, 1.5, 3.5], [1.0, 1.0, 0.7, 0.0]),
        1.0,
        1.0,
        1.0,
        0.0,
    ),
    "oil that lets it go": (
        ([0.0, 1.0, 3.0, 3.8], [1.0, 1.0, 1.0, 0.0]),
        0.2,
        1.0,
        None,
        2.0,
    ),
    "a load too heavy": (
        ([0.0, 1.0, 3.0, 3.8], [1.0, 1.0, 1.0, 0.0]),
        1.0,
        3.0,
        1 / 3,
        2.0,
    ),
}


def one_case(lever, factor, load):
    times, values = lever
    law = sb.friction.ChangingFriction(
        sb.ConstantFriction(F, STATIC),
        (sb.friction.FrictionChange(sb.PiecewiseLinear([2.0, 2.0], [1.0, factor])),),
    )
    scene = held(M, sb.PiecewiseLinear(times, T0 * jnp.asarray(values)), law)
    steps = sb.TorqueLoad(sb.PiecewiseLinear([2.0, 2.0], [M, load * M]))
    return dataclasses.replace(scene, duty=dataclasses.replace(scene.duty, load=steps))


@pytest.mark.parametrize("case", CASES)
def test_reserve_of_a_brake_that_is_to_hold(case):
    lever, factor, load, share, when = CASES[case]
    full = R * T0 * (capstan(STATIC * F) - 1) / M
    truth = full * share if share else R * T0 * (capstan(STATIC * F * factor) - 1) / M
    least = sb.simulate(one_case(lever, factor, load)).min_holding_reserve
    assert full > 1.5
    near(least.value, truth, 1e-9)
    near(least.time, when, abs=1e-9)
