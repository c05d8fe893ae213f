"""Statics of the band and the layouts, against closed forms, the textbook and the
published tables."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, near
from hypothesis import given, settings
from hypothesis import strategies as st

import simbrake as sb


def ratio(f, angles):
    mu, locked = sb.brakes.tension_ratio(
        sb.brakes.grip(jnp.asarray(f), jnp.asarray(angles))
    )
    assert not np.any(locked)
    return float(np.prod(mu))


def test_band_and_block_of_the_textbook():
    """Khurmi & Gupta, brakes chapter: 14 blocks of 15°, μ 0.25, ends at 30/120 mm, 200
    N at 750 mm."""
    Pi = ratio(0.25, np.full(14, math.radians(15)))
    near(Pi, 2.51406375423075, 1e-13)
    # moments about the fulcrum: 200·750 = T_n·30 − T_0·… with the tight end on the
    # short arm
    T_0 = 200 * 0.750 / (0.120 - 0.030 * Pi)
    near(T_0, 3364.88191484, 1e-11)
    forces = sb.brakes.sliding_tensions(
        jnp.asarray(T_0), jnp.full(14, 0.25), jnp.full(14, math.radians(15))
    )
    near(forces.tension[-1], 8459.52765938, 1e-11)
    near(0.5 * float(forces.tension[-1] - T_0), 2547.32287226585, 1e-11)


def test_capstan_limit_is_of_second_order():
    wrap = math.radians(270)
    mu = 0.4
    truth = float(sb.brakes.capstan_ratio(jnp.asarray(mu), jnp.asarray(wrap)))
    near(truth, 6.58606196269473, 1e-14)
    errors = [ratio(mu, np.full(n, wrap / n)) / truth - 1 for n in (16, 64, 128)]
    all_near(errors, [1.6106e-2, 9.8902e-4, 2.47040e-4], 1e-4)
    near(math.log2(errors[1] / errors[2]), 2.0, abs=0.01)


def test_self_locking_lining_is_marked():
    mu, locked = sb.brakes.tension_ratio(jnp.asarray([0.5, 0.999999, 1.0, 3.0]))
    assert list(np.asarray(locked)) == [False, False, True, True]
    assert np.all(np.isfinite(mu))


@settings(max_examples=25, deadline=None)
@given(
    f=st.floats(0.05, 0.5),
    T_0=st.floats(1.0, 1e5),
    share=st.floats(0.0, 1.0),
    angles=st.lists(st.floats(0.1, 0.6), min_size=5, max_size=5),
)
def test_mobilised_forces_balance_in_limits(f, T_0, share, angles):
    beta = np.asarray(angles)
    mu, _ = sb.brakes.tension_ratio(sb.brakes.grip(jnp.asarray(f), jnp.asarray(beta)))
    Pi = float(np.prod(mu))
    for T_n in (T_0 * Pi**share, T_0 * Pi**-share):
        forces = sb.brakes.mobilised(
            jnp.asarray(T_0), jnp.asarray(T_n), mu, jnp.asarray(beta)
        )
        total = float(np.sum(forces.friction / np.cos(beta / 2)))
        near(total, T_n - T_0, abs=1e-9 * T_0)
        assert np.all(
            np.abs(forces.friction) <= f * np.asarray(forces.normal) * (1 + 1e-9) + 1e-9
        )
        near(forces.tension[-1], T_n, 1e-12)


def test_mass_terms_of_a_carried_lining():
    """One lining in closed form, and lift-off where the centrifugal force exceeds the
    band's push."""
    beta = 0.4
    f = 0.3
    T_0 = 100.0
    c = math.cos(beta / 2)
    s = math.sin(beta / 2)
    one = jnp.asarray([beta])
    forces = sb.brakes.sliding_tensions(
        jnp.asarray(T_0),
        jnp.asarray([f]),
        one,
        inertia_force=2.0,
        centrifugal_force=5.0,
    )
    T_1 = float(forces.tension[0])
    N = float(forces.normal[0])
    F = float(forces.friction[0])
    near(F, (T_1 - T_0) * c + 2.0, 1e-13)
    near(N, (T_1 + T_0) * s - 5.0, 1e-13)
    near(F, f * N, 1e-13)
    lifted = sb.brakes.sliding_tensions(
        jnp.asarray(T_0), jnp.asarray([f]), one, centrifugal_force=1e3
    )
    assert float(lifted.normal[0]) == float(lifted.friction[0]) == 0.0
    near(lifted.tension[0], T_0)


@pytest.mark.parametrize(("f", "k"), [(0.5, 9), (0.3, 6), (0.1, 10), (0.3, 1)])
def test_equal_increment_layout(f, k):
    layout = sb.layouts.equal_increment_angles(f, 10, k, math.radians(270))
    near(np.sum(layout.angle), math.radians(270), 1e-12)
    forces = sb.brakes.sliding_tensions(
        jnp.asarray(1.0), jnp.full(k, f), jnp.asarray(layout.angle[:k])
    )
    increments = np.diff(np.append(1.0, forces.tension))
    all_near(increments, increments[0], 1e-10)
    near(forces.tension[-1], layout.ratio, 1e-11)
    z = np.tan(layout.angle / 2)
    # telescoped, equal f
    near((1 / z[k - 1] + f) / (1 / z[0] - f), layout.ratio, 1e-11)


def test_chord_layout_that_is_infeasible():
    twenty = math.radians(20)
    with pytest.raises(
        sb.layouts.InfeasibleLayout, match=r"chord 1: 1 − f·tan\(β_1/2\)"
    ):
        sb.layouts.chord_equal_load_angles(0.5, 7, twenty, twenty)


@pytest.mark.parametrize(
    "call",
    [
        lambda: sb.layouts.equal_increment_angles(2.0, 3, 3, 6.2),
        lambda: sb.layouts.equal_increment_angles(0.3, 10, 11, 4.0),
        lambda: sb.layouts.equal_increment_angles(-0.3, 10, 5, 4.0),
        lambda: sb.layouts.equal_load_angles(3.0, 4, 6.2),
    ],
)
def test_infeasible_layouts_say_so(call):
    with pytest.raises(sb.layouts.InfeasibleLayout, match=r"\w+"):
        call()


def test_reach_of_equal_increments():
    """At `f z_1 = 1` the linings have `1/(f z_i) = 2i − 1`: their angles are the widest
    wrap."""
    f = 0.4
    n = 4
    most = sum(2 * math.atan(1 / (f * (2 * i - 1))) for i in range(1, n + 1))
    layout = sb.layouts.equal_increment_angles(f, n, n, 0.999 * most)
    near(np.sum(layout.angle), 0.999 * most, 1e-12)
    assert f * math.tan(np.max(layout.angle) / 2) < 1
    with pytest.raises(
        sb.layouts.InfeasibleLayout,
        match=f"at a wrap of {math.degrees(most):.1f}°, below the requested",
    ):
        sb.layouts.equal_increment_angles(f, n, n, 1.001 * most)
