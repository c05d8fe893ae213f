"""Scenes with a resolved bandage, their runs, and what every mode promises."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from scenes import random_points

import simbrake as sb

R = 0.59
R_B = 0.64
HALF = math.radians(25)  # of each of three linings


def profile(times, values, size):
    """Straight lines with a fixed number of points, so that all scenes share one
    program."""
    more = size - len(times)
    return sb.PiecewiseLinear(
        [*times, *[times[-1] + 1e3] * more], [*values, *[values[-1]] * more]
    )


def scene(
    n=3,
    f=0.4,
    f_int=0.2,
    preload=1500.0,
    J=200.0,
    J_b=4.0,
    spring=2e3,
    damping=0.05,
    lever=((0.0, 0.3), (100.0, 6e3)),
    load=((0.0,), (0.0,)),
    omega=20.0,
    end=4.0,
    ratio=(1.0, 1.0),
    wrap=150.0,
):
    def each(x, k):
        return np.broadcast_to(np.asarray(x, float), (k,)).copy()

    J_i = each(np.asarray(J_b) / n, n) if np.ndim(J_b) == 0 else each(J_b, n)
    bandage = sb.Bandage(
        J_i,
        sb.ConstantFriction(each(f_int, n), ratio[1]),
        each(preload, n),
        spring=each(spring, n - 1),
        spring_damping=each(damping, n - 1),
    )
    linings = sb.Lining(
        sb.ConstantFriction(each(f, n), ratio[0]), np.full(n, math.radians(wrap / n))
    )
    duty = sb.Duty(profile(*lever, 7), sb.TorqueLoad(profile(*load, 6)))
    return sb.Scene(
        sb.Brake(sb.Pulley(R, J), sb.Band(R_B), linings, bandage),
        duty,
        sb.Initial(omega),
        end,
    )


def run(scene, rtol=1e-11, solver=None):
    return sb.simulate(scene, rtol=rtol, solver=solver, max_steps=4096, throw=False)


def changes(record):
    """Modes in order, each with the time from which it holds; those that last no time
    are left out."""
    n = int(record.count)
    m = record.modes
    t = np.asarray(record.rows.t)[: n + 1]
    keys = np.column_stack(
        [np.asarray(x)[: n + 1] for x in (m.band, m.own.outer, m.own.inner)]
    )
    found = []
    for i in range(n):
        if t[i + 1] > t[i] and not (found and np.array_equal(found[-1][1], keys[i])):
            found.append((t[i], keys[i]))
    k = m.own.outer.shape[1]
    return [(float(t), int(key[0]), key[1 : 1 + k], key[1 + k :]) for t, key in found]


@functools.partial(jax.jit, static_argnums=0)
def sampled(static, record, ts):
    y, modes = record.at(ts)
    return y, modes, jax.vmap(record.system.variables)(ts, y, modes).contact


def check_conditions(record, count=300):
    """What every mode promises, at many times: capacities, directions, no push, no heat
    taken out."""
    ts = jnp.linspace(record.rows.t[0], record.t_end, count)
    y, m, q = sampled(0, record, ts)
    outer = np.asarray(m.own.outer)
    inner = np.asarray(m.own.inner)
    pulls = (np.asarray(m.band) != sb.results.BandMode.OPEN)[:, None]
    M = np.asarray(q.capacity)
    lam = np.asarray(q.inner_torque)
    slip = np.asarray(y.omega)[:, None] - np.asarray(y.own.speeds)
    T_scale = float(record.system.sizes.tension)
    w_scale = float(record.system.sizes.speed)
    torque_scale = float(record.system.sizes.torque)
    assert np.all(
        np.where(
            inner == 0,
            np.abs(lam) <= M + 1e-9 * torque_scale,
            np.isclose(lam, inner * M),
        )
    )
    assert np.all(np.where(inner == 0, np.abs(slip), -inner * slip) <= 1e-9 * w_scale)
    G = np.asarray(q.outer_force)
    limit = np.asarray(q.outer_limit)
    assert np.all(np.abs(G) <= limit * (1 + 1e-9) + 1e-9 * T_scale)
    travel = np.where(
        outer == 0, np.abs(y.own.speeds), -outer * np.asarray(y.own.speeds)
    )
    assert np.all(np.where(pulls, travel, 0.0) <= 1e-9 * w_scale)
    assert np.min(q.tension) >= 0
    for heat in (*y.ledger.friction, y.ledger.damper_heat):
        assert np.min(np.diff(np.asarray(heat))) >= -1e-12 * max(
            1.0, float(np.max(heat))
        )


def random_duty(seed):
    rng = np.random.default_rng(seed)
    n = 3
    lever, load = random_points(rng, seed, 0, 3e3, 0.35)
    ratio = (
        rng.choice([1.0, rng.uniform(1, 1.4)]),
        rng.choice([1.0, rng.uniform(1, 1.4)]),
    )
    return scene(
        f=rng.uniform(0.2, 0.4, n),
        f_int=rng.uniform(0.1, 0.4, n),
        preload=rng.uniform(0, 1500, n),
        J=rng.uniform(50, 300),
        J_b=rng.uniform(0.5, 3, n),
        spring=10 ** rng.uniform(3, 6, n - 1),
        damping=rng.choice([0.0, 0.05, 0.5], n - 1),
        lever=lever,
        load=load,
        omega=float(rng.choice([0.0, 20.0, -15.0, 3.0])),
        ratio=ratio,
    )
