"""The resolved bandage: linings that let go, lock and stop one by one, against balances
and limits."""

import functools
import math

import jax.numpy as jnp
import numpy as np
import pytest
from bandage_scenes import (
    HALF,
    R_B,
    R,
    changes,
    check_conditions,
    random_duty,
    run,
    sampled,
    scene,
)
from helpers import all_near, closes, near
from scenes import lining_ratio

import simbrake as sb


@functools.cache
def long_run():
    lever = ((0.0, 0.4), (1e3, 2e4))
    made = scene(
        26, preload=2e3, J=800.0, J_b=20.0, spring=1e4, lever=lever, wrap=270.0
    )
    sb.check_scene(made)
    return run(made)


@pytest.mark.slow
def test_26_linings_let_go_lock_and_stop():
    result = long_run()
    record = result.record
    assert int(record.code) == 0
    closes(result, 1e-12)
    rows = changes(record)
    slides = np.array([np.sum(inner != 0) for _, _, _, inner in rows])
    held = np.array([np.sum(outer == 0) for _, _, outer, _ in rows])
    # each lets go of the rim once and locks on the band once, one after another; at the
    # end all stick at once
    assert list(slides[:-1]) == sorted(slides[:-1])
    assert set(np.diff(slides[:-1])) | set(np.diff(held)) <= {0, 1}
    assert len(rows) == 1 + 26 + 26 + 1
    # the tight end is the first: there λ_i grows fastest
    first = [next(t for t, _, _, inner in rows if inner[i]) for i in range(26)]
    locks = [next(t for t, _, outer, _ in rows if outer[i] == 0) for i in range(26)]
    assert np.all(np.diff(first) < 0)
    assert np.all(np.diff(locks) < 0)
    assert np.all(np.array(first) < locks)
    check_conditions(record)
    # onset of the first: the balance of lining n while all stick
    system = record.system
    _, _, q = sampled(0, record, jnp.asarray([first[-1] - 1e-12]))
    mu = lining_ratio(0.4, math.radians(270 / 26))
    T_0 = float(q.slack_tension[0])
    s = math.sin(math.radians(270 / 26) / 2)
    before = T_0 * mu**25
    alpha = -R_B * T_0 * (mu**26 - 1) / 820.0
    needed = R_B * before * (mu - 1) + 20 / 26 * alpha
    near(needed, R * 0.2 * (before * (mu + 1) * s + 2e3), 1e-9)
    assert float(system.stored(jnp.zeros(()), record.y_end, record.mode_end)[0]) == 0.0


@pytest.mark.slow
def test_preload_releases_linings_together():
    """`N_pre,i` such that every lining comes to its limit at the lever tension `T*`:
    one instant, one event."""
    n = 3
    f = 0.4
    f_int = 0.2
    J = 200.0
    J_b = 4.0
    at = 3e3
    s = math.sin(HALF)
    mu = lining_ratio(f, 2 * HALF)
    before = at * mu ** np.arange(n)
    alpha = -R_B * at * (mu**n - 1) / (J + J_b)
    preload = (R_B * before * (mu - 1) + J_b / n * alpha) / (R * f_int) - before * (
        mu + 1
    ) * s
    record = run(scene(f=f, f_int=f_int, J=J, J_b=J_b, preload=preload)).record
    rows = changes(record)
    t, _, _, inner = rows[1]
    near(t, 0.3 * (at - 100) / 5900, 1e-9)
    assert np.all(inner == 1)
    check_conditions(record)


def _limit(T_0, weaker):
    """Load torque up to which three linings at rest hold, each with its weaker pair."""
    z = math.tan(HALF)
    s = math.sin(HALF)
    T = T_0
    for _ in range(3):
        inner = ((R_B + R * 0.2 * s) * T + R * 0.2 * 1500.0) / (R_B - R * 0.2 * s)
        outer = T * (1 + 0.4 * z) / (1 - 0.4 * z)
        T = {"rim": inner, "band": outer}.get(weaker, min(inner, outer))
    return R_B * (T - T_0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("T_0", "first"), [(1e3, (0, 1, 1)), (200.0, (0, 0, 0)), (6e3, (1, 1, 1))]
)
def test_held_brake_is_still_up_to_its_limit(T_0, first):
    limit = _limit(T_0, "weaker")
    loads = (0.9 * limit, 0.9 * limit, 1.1 * limit)
    load = ((0.0, 3600.0, 3601.0), loads)
    record = run(scene(lever=((0.0,), (T_0,)), load=load, omega=0.0, end=3601.0)).record
    rows = changes(record)
    assert int(record.code) == 0
    y, _, q = sampled(0, record, jnp.linspace(0.0, 3600.0, 50))
    assert np.all(np.asarray(y.phi) == 0.0)
    assert np.all(np.asarray(y.own.speeds) == 0.0)
    all_near(np.sum(q.inner_torque, axis=1), 0.9 * limit, 1e-12)
    all_near(q.brake_torque, 0.9 * limit, 1e-12)
    # one share for all, unless the band bounds a lining
    free = np.abs(q.outer_force) < np.asarray(q.outer_limit) * (1 - 1e-9)
    share = np.asarray(q.inner_torque) / np.asarray(q.capacity)
    shares = np.ma.masked_array(share, ~free)
    assert free.any()
    assert np.ma.max(np.ma.ptp(shares, axis=1)) < 1e-12
    check_conditions(record)
    t, _, outer, inner = rows[1]
    near(t, 3600.5, 1e-12)
    assert tuple(int(x) for x in inner) == first
    assert np.all((outer == 0) != (inner == 0))


@pytest.mark.parametrize("T_0", [1e3, 200.0, 6e3])
def test_torque_at_the_end_of_a_run(T_0):
    result = run(scene(lever=((0.0,), (T_0,)), spring=1e-6, end=0.01))
    assert float(result.record.y_end.omega) > 0
    # springs add 3e-8
    near(result.end_capacity.torque, _limit(T_0, "weaker"), 1e-6)


@pytest.mark.slow
def test_random_duties_end_well():
    for seed in range(30):
        made = random_duty(seed)
        sb.check_scene(made)
        result = run(made)
        record = result.record
        assert int(record.code) == 0, seed
        closes(result, 1e-8)
        check_conditions(record)
