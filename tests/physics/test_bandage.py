"""The resolved bandage: linings that let go, lock and stop one by one, against balances, other codes and limits."""

import functools
import itertools
import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from bandage_scenes import HALF, R_B, R, changes, check_conditions, random_duty, run, sampled, scene
from helpers import jacobians
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake import plot


@functools.cache
def long_run():
    lever = ((0.0, 0.4), (1e3, 2e4))
    made = scene(26, preload=2e3, J=800.0, J_b=20.0, spring=1e4, lever=lever, wrap=270.0)
    sb.check(made)
    return run(made)


@pytest.mark.slow
def test_26_linings_let_go_lock_and_stop():
    result = long_run()
    record = result.record
    assert int(record.code) == 0
    assert float(result.energy["closure"]) < 1e-12
    rows = changes(record)
    slides = np.array([np.sum(inner != 0) for _, _, _, inner in rows])
    held = np.array([np.sum(outer == 0) for _, _, outer, _ in rows])
    # each lets go of the rim once and locks on the band once, one after another; at the end all stick at once
    assert list(slides[:-1]) == sorted(slides[:-1])
    assert set(np.diff(slides[:-1])) | set(np.diff(held)) <= {0, 1}
    assert len(rows) == 1 + 26 + 26 + 1
    # the tight end is the first: there λ_i grows fastest
    first = [next(t for t, _, _, inner in rows if inner[i]) for i in range(26)]
    locks = [next(t for t, _, outer, _ in rows if outer[i] == 0) for i in range(26)]
    assert np.all(np.diff(first) < 0)
    assert np.all(np.diff(locks) < 0)
    assert np.all(np.array(first) < locks)
    _, band, outer, inner = rows[-1]
    assert band == sb.results.BandMode.HELD
    assert not np.any(outer)
    assert not np.any(inner)
    assert [b for _, b, _, _ in rows[-3:-1]] == [sb.results.BandMode.SLIP, sb.results.BandMode.HELD]
    check_conditions(record)
    # onset of the first: the balance of lining n while all stick
    system = record.system
    _, _, q = sampled(0, record, jnp.asarray([first[-1] - 1e-12]))
    mu = (1 + 0.4 * math.tan(math.radians(270 / 26) / 2)) / (1 - 0.4 * math.tan(math.radians(270 / 26) / 2))
    T_0, s = float(q.slack_tension[0]), math.sin(math.radians(270 / 26) / 2)
    before = T_0 * mu**25
    alpha = -R_B * T_0 * (mu**26 - 1) / 820.0
    needed = R_B * before * (mu - 1) + 20 / 26 * alpha
    assert needed == pytest.approx(R * 0.2 * (before * (mu + 1) * s + 2e3), rel=1e-9)
    assert float(system.stored(jnp.zeros(()), record.y_end, record.mode_end)[0]) == 0.0


@pytest.mark.slow
def test_preload_releases_linings_together():
    """`N_pre,i` such that every lining comes to its limit at the lever tension `T*`: one instant, one event."""
    n, f, f_int, J, J_b, at = 3, 0.4, 0.2, 200.0, 4.0, 3e3
    z, s = math.tan(HALF), math.sin(HALF)
    mu = (1 + f * z) / (1 - f * z)
    before = at * mu ** np.arange(n)
    alpha = -R_B * at * (mu**n - 1) / (J + J_b)
    preload = (R_B * before * (mu - 1) + J_b / n * alpha) / (R * f_int) - before * (mu + 1) * s
    record = run(scene(f=f, f_int=f_int, J=J, J_b=J_b, preload=preload)).record
    rows = changes(record)
    t, _, _, inner = rows[1]
    assert t == pytest.approx(0.3 * (at - 100) / 5900, rel=1e-9)
    assert np.all(inner == 1)
    check_conditions(record)


@pytest.mark.slow
def test_one_lining_is_the_rigid_bandage():
    one = scene(1, wrap=60.0, f_int=0.15, preload=1e3, J=50.0)
    record = run(one).record
    rows, brake = changes(record), one.brake
    bandage = sb.Bandage(4.0, sb.ConstantFriction(0.15), 1e3)
    rigid = sb.Scene(sb.Brake(brake.pulley, brake.band, brake.linings, bandage), one.duty, one.initial, one.end_time)
    truth = sb.simulate(rigid, rtol=1e-11)
    slip = next(t for t, _, _, inner in rows if inner[0])
    lock = next(t for t, _, outer, _ in rows if outer[0] == 0)
    stop = next(t for t, _, outer, inner in rows if outer[0] == 0 and inner[0] == 0)
    times = [truth.internal_slip_time, truth.external_lock_time, truth.stopping_time]
    np.testing.assert_allclose([slip, lock, stop], [float(x) for x in times], rtol=1e-10)
    ledger, energy = record.y_end.ledger, truth.energy
    works = [float(energy["heat_external"]), float(energy["heat_internal"])]
    assert [float(work) for work in ledger.friction] == pytest.approx(works, rel=1e-9)


class Alone:
    """The same brake again, lining by lining in loops, for SciPy; knows motion ahead only."""

    def __init__(self, f, f_int, preload, J, J_i, K, T_0):
        self.f, self.f_int, self.preload, self.J, self.J_i, self.K, self.T_0 = f, f_int, preload, J, J_i, K, T_0
        self.n = len(J_i)
        self.inner, self.held = [0] * self.n, [False] * self.n

    def forces(self, t, y):
        e, v = y[1 : self.n], y[self.n :]
        z, s = math.tan(HALF), math.sin(HALF)
        mu = (1 + self.f * z) / (1 - self.f * z)
        m = [1 / (1 / self.J_i[j] + 1 / self.J_i[j + 1]) / R_B**2 for j in range(self.n - 1)]
        S = [self.K * e[j] + 0.1 * math.sqrt(self.K * m[j]) * R_B * (v[j] - v[j + 1]) for j in range(self.n - 1)]
        Q = [R_B * ((S[i - 1] if i else 0) - (S[i] if i < self.n - 1 else 0)) for i in range(self.n)]
        T, M, G = [self.T_0(t)], [], []
        for i in range(self.n):
            k, p = R * self.f_int * s, R * self.f_int * self.preload[i]
            if self.held[i]:
                T.append((T[-1] * (R_B + k) + p + Q[i]) / (R_B - k))
            else:
                T.append(T[-1] * mu)
            M.append(k * (T[-1] + T[-2]) + p)
            G.append(R_B * (T[-1] - T[-2]))
        stuck = [i for i in range(self.n) if not self.inner[i]]
        drag = sum(G[i] - Q[i] if i in stuck else M[i] for i in range(self.n))
        a = -drag / (self.J + sum(self.J_i[i] for i in stuck))
        own = [a if i in stuck else 0.0 if self.held[i] else (M[i] + Q[i] - G[i]) / self.J_i[i] for i in range(self.n)]
        lam = [G[i] - Q[i] + self.J_i[i] * a for i in range(self.n)]
        de = [R_B * (v[j] - v[j + 1]) for j in range(self.n - 1)]
        return np.array([a, *de, *own]), lam, M

    def go(self, y, end):
        t, log = 0.0, []
        while len(log) < 20:
            events, names = [], []
            for i in range(self.n):
                if not self.inner[i]:
                    events.append(lambda t, y, i=i: self.forces(t, y)[2][i] - self.forces(t, y)[1][i])
                    names.append(("slip", i))
                elif not self.held[i]:
                    events.append(lambda t, y, i=i: y[self.n + i])
                    names.append(("lock", i))
            events.append(lambda t, y: y[0])
            names.append(("stop", -1))
            for each in events:
                each.terminal, each.direction = True, -1
            ends = (0.3, end) if t < 0.3 else (end,)
            got = solve_ivp(
                lambda t, y: self.forces(t, y)[0], (t, ends[0]), y, "DOP853", events=events, rtol=1e-12, atol=1e-12
            )
            t, y = got.t[-1], got.y[:, -1]
            if got.status == 0:
                if t >= end:
                    return log
                continue
            name, i = names[next(k for k, times in enumerate(got.t_events) if len(times))]
            log.append((name, i, t))
            if name == "stop":
                return log
            if name == "slip":
                self.inner[i] = 1
            else:
                self.held[i] = True
                y[self.n + i] = 0.0
        return log


@pytest.mark.slow
def test_three_linings_by_another_integrator():
    preload, J_i = [1500.0, 1200.0, 900.0], [1.2, 1.5, 1.0]
    record = run(scene(preload=preload, J_b=np.array(J_i), spring=500.0)).record
    alone = Alone(0.4, 0.2, preload, 200.0, J_i, 500.0, lambda t: 100 + 5900 * min(t / 0.3, 1.0))
    log = alone.go(np.array([20.0, 0, 0, 20, 20, 20]), 4.0)
    rows, mine = changes(record), []
    for (_, _, o_0, a_0), (t, _, o_1, a_1) in itertools.pairwise(rows):
        if not np.any(o_1) and not np.any(a_1):
            mine.append(("stop", -1, t))
            break
        mine += [("slip", i, t) for i in np.flatnonzero(a_0 != a_1)] + [
            ("lock", i, t) for i in np.flatnonzero(o_0 != o_1)
        ]
    assert [x[:2] for x in mine] == [x[:2] for x in log]
    assert len(log) == 7
    np.testing.assert_allclose([x[2] for x in mine], [x[2] for x in log], rtol=1e-9)
    check_conditions(record)


@pytest.mark.slow
def test_stiff_springs_tend_to_rigid_bandage():
    """Until the lock every lining slides on the band in both systems, with the same tensions: those times agree.

    Afterwards they differ for good: the rigid bandage mobilises linings from the slack end, which loads the rim most;
    single ones keep the shares with which they came to rest, and the springs bear the rest (`docs/chain.md`).
    """
    kwargs = {"preload": [1500.0, 1200.0, 900.0], "damping": 1.0}
    made = scene(**kwargs)
    bandage = sb.Bandage(4.0, sb.ConstantFriction(0.2), kwargs["preload"])
    brake = sb.Brake(made.brake.pulley, made.brake.band, made.brake.linings, bandage)
    truth = sb.simulate(sb.Scene(brake, made.duty, made.initial, made.end_time))
    misses, locks, stops = [], [], []
    for spring in (1e5, 1e6, 1e7):
        result = run(scene(**kwargs, spring=spring), rtol=1e-9)
        rows = changes(result.record)
        assert int(result.code) == 0
        assert float(result.energy["closure"]) < 1e-8
        slip = next(t for t, _, _, inner in rows if np.all(inner == 1))
        misses.append(abs(slip / float(truth.internal_slip_time) - 1))
        lock = next(t for t, band, _, inner in rows if band == sb.results.BandMode.HELD and np.all(inner == 1))
        locks.append(abs(lock / float(truth.external_lock_time) - 1))
        stops.append(next(t for t, band, _, inner in rows if band == sb.results.BandMode.HELD and not np.any(inner)))
    for each in (misses, locks):
        assert each[2] < 0.2 * each[1] < 0.2**2 * 3 * each[0]
        assert each[2] < 1e-3
    assert stops[2] == pytest.approx(stops[1], rel=1e-3)
    assert stops[2] > 1.1 * float(truth.stopping_time)


def _times(made):
    """First release on the rim and stop, traced."""
    record = run(made).record
    m, start = record.modes, record.rows.t
    inside = jnp.arange(start.shape[0], dtype=jnp.int32) <= record.count
    slip = jnp.argmax(inside & jnp.any(m.own.inner != 0, axis=1)).astype(jnp.int32)
    stop = jnp.argmax(inside & m.own.rests & (record.states.omega == 0.0)).astype(jnp.int32)
    return jnp.stack([start[slip], start[stop]])


@pytest.mark.slow
def test_gradients_are_those_of_differences():
    names = ("f_int", "preload", "J_b", "spring", "T_0")
    at = np.asarray([0.2, 1400.0, 4.0, 800.0, 6e3])

    def numbers(p):
        made = scene()

        def where(s):
            b = s.brake.bandage
            return b.friction.coefficient, b.preload, b.inertia, b.spring, s.duty.slack_tension.values

        shape = jnp.ones(3)
        values = jnp.where(np.arange(7) == 0, 100.0, p[4])
        parts = (p[0] * shape, p[1] * jnp.asarray([1.1, 1.0, 0.9]), p[2] / 3 * shape, p[3] * jnp.ones(2), values)
        return _times(eqx.tree_at(where, made, parts))

    solve = jacobians(numbers)
    _, forward, backward = map(np.asarray, solve(at))
    np.testing.assert_allclose(np.sum(backward, axis=0), np.sum(forward, axis=0), rtol=1e-9)
    for i, name in enumerate(names):
        h = 2e-3 * at[i]
        step = np.where(np.arange(5) == i, h, 0.0)
        near, far = (np.asarray(solve(at + k * step)[0]) - np.asarray(solve(at - k * step)[0]) for k in (1.0, 2.0))
        truth = (8 * near - far) / (12 * h)
        np.testing.assert_allclose(forward[:, i], truth, rtol=1e-7, atol=1e-9 / float(at[i]), err_msg=name)


def _limit(T_0, weaker):
    """Load torque up to which three linings at rest hold, each with its weaker pair."""
    z, s, T = math.tan(HALF), math.sin(HALF), T_0
    for _ in range(3):
        inner = ((R_B + R * 0.2 * s) * T + R * 0.2 * 1500.0) / (R_B - R * 0.2 * s)
        outer = T * (1 + 0.4 * z) / (1 - 0.4 * z)
        T = {"rim": inner, "band": outer}.get(weaker, min(inner, outer))
    return R_B * (T - T_0)


@pytest.mark.slow
@pytest.mark.parametrize(("T_0", "first"), [(1e3, (0, 1, 1)), (200.0, (0, 0, 0)), (6e3, (1, 1, 1))])
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
    np.testing.assert_allclose(np.sum(q.inner_torque, axis=1), 0.9 * limit, rtol=1e-12)
    np.testing.assert_allclose(q.brake_torque, 0.9 * limit, rtol=1e-12)
    # one share for all, unless the band bounds a lining
    free = np.abs(q.outer_force) < np.asarray(q.outer_limit) * (1 - 1e-9)
    share = np.asarray(q.inner_torque) / np.asarray(q.capacity)
    assert np.all(np.where(free, np.abs(share - np.asarray(q.share)[:, None]), 0.0) < 1e-12)
    check_conditions(record)
    t, _, outer, inner = rows[1]
    assert t == pytest.approx(3600.5, rel=1e-12)
    assert tuple(int(x) for x in inner) == first
    assert np.all((outer == 0) != (inner == 0))


@pytest.mark.parametrize("T_0", [1e3, 200.0, 6e3])
def test_torque_at_the_end_of_a_run(T_0):
    result = run(scene(lever=((0.0,), (T_0,)), spring=1e-6, end=0.01))
    assert float(result.record.y_end.omega) > 0
    assert float(result.end_capacity.torque) == pytest.approx(_limit(T_0, "weaker"), rel=1e-6)  # springs add 3e-8


def test_random_duties_end_well():
    for seed in range(30):
        made = random_duty(seed)
        sb.check(made)
        result = run(made)
        record, energy = result.record, result.energy
        assert int(record.code) == 0, seed
        assert float(energy["closure"]) < 1e-8, seed
        ledger, n = record.states.ledger, int(record.count) + 1
        for heat in (*ledger.friction, ledger.damper_heat):
            assert np.min(np.diff(np.asarray(heat)[:n])) >= -1e-12 * max(1.0, float(energy["friction_heat"])), seed
        if seed % 6 == 0:
            check_conditions(record)


@pytest.mark.slow
def test_heat_of_both_pairs_enters_network():
    plain = scene()
    bodies = (
        sb.thermal.Lump("rim", 2e4),
        sb.thermal.Lump("linings", 1e3, count=3),
        sb.thermal.Lump("band", 5e3),
        sb.thermal.Reservoir("air"),
    )
    heat = sb.Heat(
        bodies=bodies,
        links=(sb.thermal.Convection("rim", 2.0, 30.0),),
        friction=sb.thermal.FrictionHeat("rim", "linings", sb.thermal.ConstantPartition(0.8)),
        external=sb.thermal.FrictionHeat(
            "band", "linings", sb.thermal.ConstantPartition(0.6), beyond="rim", beyond_share=0.1
        ),
    )
    linings = sb.Lining(
        sb.friction.ProductFriction(plain.brake.linings.friction, (sb.LinearFade(2e-4, 293.15),)),
        plain.brake.linings.angle,
    )
    brake = sb.Brake(plain.brake.pulley, plain.brake.band, linings, plain.brake.bandage)
    hot = sb.Scene(brake, plain.duty, plain.initial, plain.end_time, heat)
    sb.check(hot)
    result = run(hot)
    record, energy = result.record, result.energy
    assert int(record.code) == 0
    end = record.y_end
    assert float(energy["closure"]) < 1e-10
    booked, rubbed = end.ledger.heat, float(energy["friction_heat"])
    assert float(booked.to_metal + booked.to_linings + booked.to_band) == pytest.approx(rubbed, rel=1e-10)
    assert float(booked.to_band) == pytest.approx(0.6 * float(energy["heat_external"]), rel=1e-10)
    thermal = record.system.thermal
    stored = float(jnp.sum(thermal.capacity * end.heat)) - float(jnp.sum(thermal.capacity * record.states.heat[0]))
    assert stored + float(booked.lost) == pytest.approx(rubbed, rel=1e-10)
    assert changes(record)[-1][0] != changes(run(plain).record)[-1][0]


def test_faults_of_a_bandage_with_springs():
    made = scene()
    bandage = sb.Bandage(4.0, sb.ConstantFriction(0.2), spring=[1e3, 1e3, 1e3])
    brake = sb.Brake(made.brake.pulley, sb.Band(R_B, 1e5), made.brake.linings, bandage)
    with pytest.raises(sb.InputError, match=r"brake.bandage.spring: does not fit 3 linings"):
        sb.check(sb.Scene(brake, made.duty, made.initial, 4.0))
    brake = sb.Brake(made.brake.pulley, sb.Band(R_B, 1e5), made.brake.linings, made.brake.bandage)
    with pytest.raises(sb.InputError, match=r"brake.band.stiffness: a bandage with springs needs a rigid band — leave"):
        sb.check(sb.Scene(brake, made.duty, made.initial, 4.0))


@pytest.mark.slow
def test_simulate_runs_a_bandage():
    """Events, stages, energies and overlap by `simulate`; each lining in the log and in the series."""
    result = sb.simulate(scene())
    assert result.status == "stopped"
    assert float(result.energy["closure"]) <= 1e-9
    names = [e.name for e in result.events]
    assert [s.name for s in result.stages] == ["stage_1", "stage_2", "stage_3", "held"]
    slips = [e for e in result.events if e.name == "lining_internal_slip"]
    assert slips[0].time == pytest.approx(float(result.internal_slip_time), abs=1e-15)
    assert {e.lining for e in slips} == {1, 2, 3}
    assert names.index("internal_slip") < names.index("external_lock") < names.index("stop")
    t = 0.5 * (slips[0].time + slips[-1].time)
    s, o = result.series([t]), sb.results.overlap(result, [t])
    sliding = np.count_nonzero(s.pairs["internal"].sense[0])
    assert 0 < sliding < 3
    assert float(o.internal_dynamic[0]) == pytest.approx(150 / 360 * sliding / 3)
    assert s.lining_speed.shape == (1, 3)
    # both contacts, each over the whole run and, enlarged, up to the lock
    titles = [panel.get_title() for panel in plot.contacts(result).axes]
    whole = ["band on linings (external)", "linings on the rim (internal)"]
    assert titles == [text for name in whole for text in (name, f"{name}, enlarged")]


@pytest.mark.slow
def test_turning_round_releases_no_lining():
    """An open brake that a load turned back: linings slide on the band from the start, and none was held there."""
    made = scene(lever=((0.0, 0.5, 0.5), (0.0, 0.0, 3e3)), load=((0.0,), (-500.0,)), omega=0.0)
    result = sb.simulate(made)
    names = [e.name for e in result.events]
    assert names.index("slip_onset") < names.index("lining_external_stick")
    assert "lining_external_slip" not in names[: names.index("lining_external_stick")]
    # each contact lets go and catches by turns
    for contact in ("internal", "external"):
        for i in (1, 2, 3):
            own = [e.name for e in result.events if e.lining == i and contact in e.name]
            assert all(a != b for a, b in itertools.pairwise(own))
