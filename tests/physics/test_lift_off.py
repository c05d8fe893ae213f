"""Centrifugal force on floating linings: lift-off in closed form, stops with falling grip against SciPy."""

import dataclasses
import itertools
import math

import bandage_scenes
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from helpers import jacobians
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import simbrake as sb

RADIUS = 0.61  # of the centres of mass
Z, S = math.tan(staged.BETA / 2), math.sin(staged.BETA / 2)
MU = (1 + staged.F_EXT * Z) / (1 - staged.F_EXT * Z)
PI = MU ** np.arange(staged.N + 1)


def with_masses(scene, mass, **changes):
    """The same scene with linings of the `mass` (kg)."""
    bandage = dataclasses.replace(scene.brake.bandage, mass=mass, mass_radius=RADIUS, **changes)
    return dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, bandage=bandage))


def lifts(result):
    return [(e.name, e.lining, e.time) for e in result.events if e.name in ("lining_lift_off", "lining_touchdown")]


# --- lift-off and touchdown at √((N + N_pre)/(m r_m)) -----------------------------------------------------------------

PRELOAD, MASS = np.array([9e3, 300.0, 800.0, 2e4, 1500.0, 1e4, 9e3, 9e3]), np.array([2, 2, 3, 2, 5, 2, 2, 2.0])
TORQUE = sb.PiecewiseLinear([4.0, 4.0], [3e3, -3e3])


def speed_up(T_0, mass=MASS):
    """A load speeds the pulley up for 4 s and slows it down again; the bandage rides with it."""
    lever = sb.Constant(T_0)
    scene = with_masses(staged.stop(lever=lever, w0=10.0, end=9.0, preload=PRELOAD), mass)
    return dataclasses.replace(scene, duty=sb.Duty(lever, sb.TorqueLoad(TORQUE)))


@pytest.mark.slow
@pytest.mark.parametrize("T_0", [0.0, 150.0])
def test_linings_lift_off_at_own_speeds(T_0):
    result, J = sb.simulate(speed_up(T_0)), staged.J + staged.J_B
    drag = staged.R_B * T_0 * (PI[-1] - 1)
    limit = np.sqrt((T_0 * (PI[1:] + PI[:-1]) * S + PRELOAD) / (MASS * RADIUS))
    top = 10 + 4 * (3e3 - drag) / J
    leaving = sorted((J * (limit[i] - 10) / (3e3 - drag), i) for i in range(staged.N) if limit[i] < top)
    back = sorted((4 + J * (top - limit[i]) / (3e3 + drag), i) for i in range(staged.N) if limit[i] < top)
    assert len(leaving) == (3 if T_0 == 0 else 1)
    truth = [("lining_lift_off", i + 1, t) for t, i in leaving] + [("lining_touchdown", i + 1, t) for t, i in back]
    found = lifts(result)
    assert [event[:2] for event in found] == [event[:2] for event in truth]
    np.testing.assert_allclose([event[2] for event in found], [event[2] for event in truth], rtol=1e-12)
    # loads and capacity in between
    t = 0.5 * (leaving[-1][0] + 4)
    s, omega = result.series([t]), 10 + t * (3e3 - drag) / J
    load = np.maximum(0, T_0 * (PI[1:] + PI[:-1]) * S + PRELOAD - MASS * RADIUS * omega**2)
    np.testing.assert_allclose(s.pairs["internal"].normal_load[0], load, rtol=1e-12)
    assert float(s.pairs["internal"].capacity[0]) == pytest.approx(staged.R * staged.F_INT * load.sum(), rel=1e-12)
    assert float(result.energy["closure"]) <= 1e-9
    if T_0 == 0:
        share = sb.results.overlap(result, [t])
        assert float(share.internal_static[0]) == pytest.approx(5 / 8 * staged.N * staged.BETA / (2 * math.pi))


@pytest.mark.slow
def test_derivative_of_lift_off_by_the_mass():
    """`t_i = J (√(N_pre,i/(m_i r_m)) − ω_0)/M`: the time moves by `−J ω_i/(2 m_i M)`."""

    def times(mass):
        record = sb.simulate(speed_up(0.0, mass), max_steps=64).record
        lifted, t = record.modes.lifted, record.rows.t
        inside = jnp.arange(t.shape[0], dtype=jnp.int32)[:, None] <= record.count
        first = jnp.argmax(inside & (lifted != 0), axis=0)
        return t[first[np.array([1, 2, 4])]]

    _, forward, backward = jacobians(times)(MASS)
    truth, J = np.zeros((3, staged.N)), staged.J + staged.J_B
    for row, i in enumerate((1, 2, 4)):
        truth[row, i] = -J * math.sqrt(PRELOAD[i] / (MASS[i] * RADIUS)) / (2 * MASS[i] * 3e3)
    np.testing.assert_allclose(forward, truth, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(backward, truth, rtol=1e-10, atol=1e-14)


# --- stops with falling grip against SciPy ----------------------------------------------------------------------------


def alone(mass, w0, T_0=200.0, rate=4e3, preload=staged.PRELOAD, load=300.0):
    """Times of the events of a stop with a rigid band, from SciPy, mode by mode; knows motion ahead only."""
    J, J_b, n = staged.J, staged.J_B, staged.N
    share = S * (PI[1:] + PI[:-1])

    def lever(t):
        return T_0 + rate * t

    def balance(t, w):
        return lever(t) * share + preload - mass * RADIUS * w**2

    def grip(t, w):
        return staged.R * staged.F_INT * float(np.sum(np.where(off, 0.0, balance(t, w))))

    def band(t):
        return staged.R_B * lever(t) * (PI[-1] - 1)

    def rides(t, y):
        a = (load - band(t)) / (J + J_b)
        return [a, a, 0.0]

    def slides(t, y):
        M = grip(t, y[1])
        return [(load - M) / J, (M - band(t)) / J_b, M * (y[0] - y[1])]

    def held(t, y):
        def out(T_n):
            along = staged.tensions(lever(t), T_n, np.full(n, MU))
            return staged.R * staged.F_INT * float(np.sum((along[1:] + along[:-1]) * S + preload))

        low, high = lever(t), lever(t) * PI[-1]
        T_n = brentq(lambda T_n: staged.R_B * (T_n - low) - out(T_n), low, high, xtol=1e-9, rtol=1e-14)
        return [(load - out(T_n)) / J, 0.0, out(T_n) * y[0]]

    t, y, off, found = 0.0, np.array([w0, w0, 0.0]), np.zeros(n, bool), []
    off = balance(t, w0) < 0
    found = [("lining_lift_off", i + 1, 0.0) for i in np.flatnonzero(off)]

    def excess(t, y):
        return grip(t, y[1]) - (load - J * rides(t, y)[0])

    rhs = rides if excess(t, y) > 0 else slides
    found += [] if rhs is rides else [("internal_slip", None, 0.0)]
    while True:
        events = {}
        if rhs is not held:
            for i in range(n):
                sign = -1 if off[i] else 1
                events["touchdown" if off[i] else "lift_off", i] = lambda t, y, i=i, k=sign: k * balance(t, y[1])[i]
        events[{rides: "internal_slip", slides: "external_lock", held: "stop"}[rhs], -1] = {
            rides: excess, slides: lambda t, y: y[1], held: lambda t, y: y[0]
        }[rhs]  # fmt: skip
        for each in events.values():
            each.terminal, each.direction = True, -1
        got = solve_ivp(rhs, (t, 60.0), y, "DOP853", events=list(events.values()), rtol=1e-12, atol=1e-12)
        t, y = got.t[-1], got.y[:, -1]
        (name, i), *_ = (key for key, times in zip(events, got.t_events, strict=True) if len(times))
        found.append((f"lining_{name}", i + 1, t) if i >= 0 else (name, None, t))
        if name == "stop":
            return found, y[2]
        if i >= 0:
            off[i] = ~off[i]
        elif name == "internal_slip":
            rhs = slides
        else:
            rhs, y[1] = held, 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("mass", "w0"), [(3.0, 20.0), (5.4, 40.0)])
def test_stop_with_falling_grip_by_scipy(mass, w0):
    """The second has no grip at all without the band: its linings slide from the start."""
    scene = with_masses(staged.stop(w0=w0), mass)
    truth, heat = alone(mass, w0)
    result = sb.simulate(scene, rtol=1e-12)
    names = {name for name, *_ in truth}
    found = [(e.name, e.lining, e.time) for e in result.events if e.name in names]
    at_once = sum(t == 0 for *_, t in truth)
    found = sorted(found[:at_once], key=lambda event: event[0] == "internal_slip") + found[at_once:]
    assert [event[:2] for event in found] == [event[:2] for event in truth]
    np.testing.assert_allclose([event[2] for event in found], [event[2] for event in truth], rtol=1e-9, atol=1e-12)
    assert float(result.energy["heat_internal"]) == pytest.approx(heat, rel=1e-9)
    assert float(result.energy["closure"]) <= 1e-9
    assert ("lining_touchdown" in names) == (w0 == 40.0)


@pytest.mark.slow
def test_derivative_of_the_stop_by_the_mass():
    def times(x):
        result = sb.simulate(with_masses(staged.stop(w0=40.0), x[0]), rtol=1e-12, max_steps=256)
        return jnp.stack([result.external_lock_time, result.stopping_time])

    def reference(mass):
        events = {name: t for name, _, t in alone(mass, 40.0)[0]}
        return np.array([events["external_lock"], events["stop"]])

    _, forward, backward = jacobians(times)(np.asarray([5.4]))
    np.testing.assert_allclose(backward, forward, rtol=1e-9)
    h = 2e-2
    near, far = (reference(5.4 + k * h) - reference(5.4 - k * h) for k in (1, 2))
    np.testing.assert_allclose(np.ravel(forward), (8 * near - far) / (12 * h), rtol=1e-7)


# --- onset of internal slip -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("rate", [4e2, 4e3, 4e4])
def test_onset_depends_on_the_speed_then(rate):
    """Stage 1 has a closed form, `(J + J_b) ω̇ = M_load − R_b (Π − 1) T_0(t)`; grip is lost and found on the way."""
    mass, scene = 1.5, with_masses(staged.stop(rate=rate, load=600.0), 1.5)
    result, J = sb.simulate(scene), staged.J + staged.J_B
    t = float(result.internal_slip_time)
    T_0, arm = 200.0 + rate * t, staged.R_B * (PI[-1] - 1)
    omega = 20 + (600.0 * t - arm * (200.0 * t + rate * t**2 / 2)) / J
    on_rim = np.maximum(0, T_0 * (PI[1:] + PI[:-1]) * S + staged.PRELOAD - mass * RADIUS * omega**2).sum()
    drive = 600.0 - staged.J * (600.0 - arm * T_0) / J
    assert drive == pytest.approx(staged.R * staged.F_INT * on_rim, rel=1e-9)
    onset = sb.results.internal_slip_tension(scene.brake, staged.J, 600.0, omega=omega)
    assert float(onset) == pytest.approx(T_0, rel=1e-9)


def test_onset_with_lifted_linings():
    """The root over a fine grid of tensions, with some of the linings off the rim there; and where there is none."""
    scene = with_masses(staged.stop(preload=np.linspace(200.0, 3000.0, staged.N)), 4.0)
    J, J_b, arm = staged.J, staged.J_B, staged.R_B * (PI[-1] - 1)
    for omega in (5.0, 20.0, 30.0):
        for load in (300.0, -2e3):

            def unbalance(T_0, omega=omega, load=load):
                on_rim = T_0 * (PI[1:] + PI[:-1]) * S + np.linspace(200.0, 3000.0, staged.N) - 4 * RADIUS * omega**2
                grip = staged.R * staged.F_INT * np.maximum(on_rim, 0).sum()
                return grip - arm * T_0 * J / (J + J_b) - J_b / (J + J_b) * load

            truth = brentq(unbalance, 0.0, 1e4, xtol=1e-10) if unbalance(0.0) > 0 else 0.0
            onset = float(sb.results.internal_slip_tension(scene.brake, J, load, omega=omega))
            assert onset == pytest.approx(truth, rel=1e-12)
    with pytest.raises(ValueError, match="give omega"):
        sb.results.internal_slip_tension(scene.brake, J, 300.0)
    bare = dataclasses.replace(scene.brake.bandage, mass_radius=None)
    with pytest.raises(sb.InputError, match=r"bandage\.mass_radius: is missing"):
        sb.check(dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, bandage=bare)))


# --- heat: a lining off the rim has no contact with it ----------------------------------------------------------------

C_RIM, C_LINING, CONTACT, HALF_LAYER = 4e4, 2e3, 240.0, 1 / 800.0


def with_heat(scene, each, wall):
    """Linings (of each a node, or one of all) on a rim in one body or in two layers, and a band."""
    rim = sb.thermal.Lump("rim", 8 * C_RIM, 400.0)
    if wall:  # of 1 m², each layer with half its thickness of resistance to its faces
        steel = sb.thermal.Material(10.0, 4e3, 2e3)
        rim = sb.thermal.Wall("rim", steel, 2 * 2 * 10.0 * HALF_LAYER, 1.0, 2, temperature=400.0)
    place = "rim.front" if wall else "rim"
    linings = sb.thermal.Lump("linings", 8 * C_LINING / each, 300.0, count=each)
    links = (
        sb.thermal.Conductance(place, "linings", 8 * CONTACT / each),
        sb.thermal.Conductance("linings", "band", 10.0),
    )
    heat = sb.Heat((rim, linings, sb.thermal.Lump("band", 5e3, 350.0)), links, band="band")
    heat = dataclasses.replace(heat, friction=sb.thermal.FrictionHeat(place, "linings", 0.5))
    return dataclasses.replace(scene, heat=sb.thermal.with_external_pair(heat, 0.5))


def lifting_times():
    J = staged.J + staged.J_B
    return J * (np.sqrt(PRELOAD / (MASS * RADIUS)) - 10) / 3e3


@pytest.mark.slow
@pytest.mark.parametrize(("each", "wall"), [(1, False), (8, False), (8, True)])
def test_lining_off_the_rim_takes_no_heat(each, wall):
    """Piecewise linear equations, by matrix exponentials from one lift-off or touchdown to the next."""
    result = sb.simulate(with_heat(speed_up(0.0), each, wall))
    up = lifting_times()
    knots = np.sort([0.0, *up[up < 4], *(8 - up[up < 4]), 9.0])  # (touchdowns mirror the lift-offs)
    layers = 2 if wall else 1
    T = np.array([400.0] * layers + [300.0] * each)
    C = np.array([8 * C_RIM] * layers + [8 * C_LINING / each] * each)
    if wall:
        C[:2] = 4e3 * 2e3 * 2 * 10.0 * HALF_LAYER
    for a, b in itertools.pairwise(knots):
        middle = 0.5 * (a + b)
        on = ~((up < middle) & (middle < 8 - up))
        g = CONTACT * (on if each == 8 else np.full(1, 8 * on.mean()))
        A = np.zeros((T.size, T.size))
        first = np.zeros(T.size)  # temperature of the face as a mean of nodes
        if wall:
            first[0], first[layers:] = 1 / HALF_LAYER, g
            first /= first.sum()
            A[0, :2] += np.array([-1.0, 1.0]) / (2 * HALF_LAYER)
            A[1, :2] += np.array([1.0, -1.0]) / (2 * HALF_LAYER)
        else:
            first[0] = 1.0
        for i in range(each):
            flow = g[i] * first
            flow[layers + i] -= g[i]
            A[layers + i] += flow
            A[0] -= flow
        T = expm(A / C[:, None] * (b - a)) @ T
    np.testing.assert_allclose(result.end_temperatures[:-1], T, rtol=1e-9)
    assert float(result.end_temperatures[-1]) == 350.0
    stored = {name: float(heat) for name, heat in result.stored_heat.items()}
    assert abs(sum(stored.values())) <= 1e-12 * stored["linings"]
    assert float(result.energy["closure"]) <= 1e-9


@pytest.mark.slow
def test_derivative_of_heat_by_the_masses():
    """`T_r − T_l = ΔT e^{−k ∫ G dt}`, `∫ G dt = G_1 Σ min(t_i, t)`."""

    def difference(mass):
        scene = dataclasses.replace(with_heat(speed_up(0.0, mass), 1, wall=False), end_time=4.0)
        T = sb.simulate(scene, max_steps=256).end_temperatures
        return jnp.stack([T[0] - T[1]])

    value, forward, backward = jacobians(difference)(MASS)
    k, up, J = CONTACT * (1 / (8 * C_RIM) + 1 / (8 * C_LINING)), lifting_times(), staged.J + staged.J_B
    truth = 100.0 * math.exp(-k * np.minimum(up, 4.0).sum())
    assert float(value[0]) == pytest.approx(truth, rel=1e-9)
    slope = np.where(up < 4, J * np.sqrt(PRELOAD / (MASS * RADIUS)) / (2 * MASS * 3e3), 0.0) * k * truth
    np.testing.assert_allclose(forward[0], slope, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(backward[0], slope, rtol=1e-7, atol=1e-10)


# --- the bandage on springs -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_sprung_linings_lift_off_one_by_one():
    """An open brake that a load speeds up: all turn together, each with its own preload."""
    preload, mass = np.array([500.0, 2e4, 900.0]), np.array([2.0, 2.0, 2.4])
    load = ((0.0, 3.0, 3.0, 4.0), (1500.0, 1500.0, -1500.0, -1500.0))
    scene = bandage_scenes.scene(preload=preload, lever=((0.0,), (0.0,)), load=load, omega=5.0, end=6.0)
    result = sb.simulate(with_masses(scene, mass))
    found = lifts(result)
    assert [event[:2] for event in found[:2]] == [("lining_lift_off", 1), ("lining_lift_off", 3)]
    assert {event[:2] for event in found[2:]} == {("lining_touchdown", 1), ("lining_touchdown", 3)}
    speeds = np.asarray(result.series([t for *_, t in found]).lining_speed)
    own = [speeds[k, lining - 1] for k, (_, lining, _) in enumerate(found)]
    limit = np.sqrt(preload / (mass * RADIUS))
    np.testing.assert_allclose(own, [limit[lining - 1] for _, lining, _ in found], rtol=1e-10)
    assert float(result.energy["closure"]) <= 1e-9


@pytest.mark.slow
def test_one_sprung_lining_is_rigid_bandage():
    one = with_masses(bandage_scenes.scene(1, wrap=60.0, f_int=0.15, preload=1e3, J=50.0), 3.0)
    bandage = dataclasses.replace(one.brake.bandage, spring=None, spring_damping=0.05, inertia=4.0)
    rigid = dataclasses.replace(one, brake=dataclasses.replace(one.brake, bandage=bandage))
    both = [sb.simulate(scene, rtol=1e-12) for scene in (one, rigid)]
    names = ("internal_slip", "external_lock", "stop", "lining_lift_off", "lining_touchdown")
    logs = [[(e.name, e.time) for e in result.events if e.name in names] for result in both]
    assert [name for name, _ in logs[0]] == [name for name, _ in logs[1]]
    assert len(logs[0]) >= 3
    np.testing.assert_allclose([t for _, t in logs[0]], [t for _, t in logs[1]], rtol=1e-10, atol=1e-12)


# --- random duties ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [None, 2e5])
def test_random_duties_keep_energy_and_press(stiffness):
    """Linings press on the rim or are off it; none ever pulls."""
    seen = set()
    for seed in range(15):
        rng = np.random.default_rng(seed)
        tension = rng.uniform(0, 2e4, 5) * (rng.random(5) > 0.3)
        lever = sb.PiecewiseLinear(np.sort(rng.uniform(0, 8, 5)), tension)
        load = sb.TorqueLoad(sb.PiecewiseLinear(np.sort(rng.uniform(0, 8, 4)), rng.uniform(-6e3, 9e3, 4)))
        law = sb.ConstantFriction(rng.uniform(0.25, 0.5), rng.choice([1.0, 1.2]))
        inner = sb.ConstantFriction(rng.uniform(0.1, 0.5), rng.choice([1.0, 1.3]))
        brake = staged.brake(stiffness, law=law, inner=inner, n=6, preload=rng.choice([0.0, rng.uniform(0, 2e3)]))
        scene = sb.Scene(brake, sb.Duty(lever, load), sb.Initial(rng.choice([20.0, 5.0, 0.0, -8.0])), 9.0)
        result = sb.simulate(with_masses(scene, rng.uniform(0.5, 6.0, 6)))
        assert float(result.energy["closure"]) <= 1e-9, seed
        s = result.series(np.linspace(0.0, 9.0, 300))
        pair, turned = s.pairs["internal"], np.asarray(s.bandage_speed)[:, None] ** 2
        assert np.min(pair.normal_load) >= -1e-9 * 2e4
        bandage, on_band = result.scene.brake.bandage, s.pairs["external"].normal_load
        balance = on_band + bandage.preload - np.asarray(bandage.mass) * RADIUS * turned
        np.testing.assert_allclose(pair.normal_load, np.maximum(balance, 0), atol=1e-6)
        assert np.all(np.diff(pair.heat) >= -1e-9 * max(1.0, float(result.energy["friction_heat"])))
        seen |= {e.name for e in result.events}
    assert {"lining_lift_off", "lining_touchdown", "internal_slip", "external_lock", "restart"} <= seen
