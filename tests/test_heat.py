"""Brakes with heat: against scipy on the same equations, closed forms with fade, events that heat brings about."""

import functools
import math

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import stop_scene
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import simbrake as sb

R, J, C, T0, W0, N, BETA = 0.725, 800.0, 2e5, 8e3, 20.0, 20, math.radians(13.5)
TRACK = 2 * math.pi * R * 0.23


def fading(f=0.35, slope=3e-4, above=293.15, floor=0.0, blend=0.0):
    return sb.ProductFriction(sb.ConstantFriction(f), (sb.LinearFade(slope, above, floor, blend),))


def brake(law, stiffness=C, n=N, beta=BETA, area=None):
    return sb.Brake(sb.Pulley(R, J), sb.Band(R, stiffness), sb.Lining(law, np.full(n, beta), area))


def layered_stop(growth=1.0, stiffness=C, end=2.0, law=None):
    """A stop from the onset of slip with a rim of 20 layers; nothing but the rim is heated (95 %)."""
    rim = sb.Wall("rim", sb.Material(48.0, 7800.0, 500.0), 0.028, TRACK, 20, growth)
    heat = sb.Heat(
        bodies=(rim, sb.Reservoir("air")),
        links=(sb.Convection("rim.back", TRACK, 60.0), sb.Convection("rim.front", 0.25 * TRACK, 60.0)),
        friction=sb.FrictionHeat("rim.front", None, sb.ConstantPartition(0.95)),
        rim="rim.front",
    )
    duty = sb.Duty(sb.Constant(T0), sb.TorqueLoad())
    return sb.Scene(brake(law or fading(), stiffness), duty, sb.Initial(W0, T0 / stiffness), end, heat)


def scipy_stop(growth, method, rtol):
    """The same equations written for scipy: full slip and stop of `layered_stop`, and the layers at the stop."""
    n = 20
    weights = growth ** np.arange(n)
    dx = 0.028 * weights / weights.sum()
    cap = 7800.0 * 500.0 * TRACK * dx
    g = 48.0 * TRACK / (0.5 * (dx[1:] + dx[:-1]))
    front = 1 / (1 / (60.0 * 0.25 * TRACK) + dx[0] / (2 * 48.0 * TRACK))
    back = 1 / (1 / (60.0 * TRACK) + dx[-1] / (2 * 48.0 * TRACK))

    def conduction(T):
        q = g * (T[:-1] - T[1:])
        into = np.append(0.0, q) - np.append(q, 0.0)
        into[0] -= front * T[0]
        into[-1] -= back * T[-1]
        return into / cap

    z = math.tan(BETA / 2)

    def ratio(T):
        f = 0.35 * (1 - 3e-4 * T)
        Pi = ((1 + f * z) / (1 - f * z)) ** N
        return Pi, Pi * N * 2 * z / (1 - (f * z) ** 2) * (-0.35 * 3e-4)

    def elastic(t, y):
        return np.concatenate([[-R * (C * y[1] - T0) / J, R * y[0]], conduction(y[2:])])

    def slipping(t, y):
        Pi, slope = ratio(y[2])
        rates = conduction(y[2:])
        extra = 0.95 * T0 * (Pi - 1) / cap[0]
        x_0, gamma = T0 * slope * rates[0] / C, T0 * slope * extra / C
        v = (R * y[0] - x_0) / (1 + gamma)
        rates[0] += extra * v
        return np.concatenate([[-R * T0 * (Pi - 1) / J, R * y[0] - v], rates])

    def limit(t, y):
        return T0 * ratio(y[2])[0] - C * y[1]

    def sticks(t, y):
        return R * y[0] - slipping(t, y)[1]

    def rests(t, y):
        return y[0]

    for event in (limit, sticks, rests):
        event.terminal, event.direction = True, -1
    atol = rtol * np.concatenate([[1.0, 0.01], np.full(n, 10.0)])
    solve = functools.partial(solve_ivp, method=method, rtol=rtol, atol=atol)
    one = solve(elastic, (0, 5), np.concatenate([[W0, T0 / C], np.zeros(n)]), events=limit)
    # a slip that begins at v_s > 0 ends where v_s has fallen to 0
    two = solve(slipping, (one.t[-1], 5), one.y[:, -1], events=(sticks, rests))
    three = solve(elastic, (two.t[-1], 5), two.y[:, -1], events=rests)
    return one.t[-1], two.t[-1], three.t[-1], three.y[2:, -1]


@functools.cache
def layered_result(growth=1.0):
    return sb.simulate(layered_stop(growth))


def test_layered_rim_with_fade_against_scipy():
    result = layered_result()
    slip, stick, stop, T = scipy_stop(1.0, "DOP853", 1e-12)
    events = {event.name: event.time for event in result.events}
    assert result.method_name == "Dopri8"
    assert events["full_slip"] == pytest.approx(slip, rel=1e-9)
    assert events["restick"] == pytest.approx(stick, rel=1e-9)
    assert events["stop"] == pytest.approx(stop, rel=1e-9)
    assert stop == pytest.approx(0.65866, abs=1e-5)
    series = result.series([stop], left=True)
    np.testing.assert_allclose(series.temperature[0] - sb.ROOM, T, rtol=1e-7, atol=1e-9)
    assert T[0] + 20.0 == pytest.approx(29.29, abs=0.005)


def test_a_surface_layer_of_a_micrometre_gets_the_implicit_method_and_the_same_answer():
    growth = sb.layer_growth(1e-6, 0.028, 20)
    result = layered_result(growth)
    assert result.method_name == "Rodas5P"
    slip, _, stop, T = scipy_stop(growth, "Radau", 1e-9)
    events = {event.name: event.time for event in result.events}
    assert events["full_slip"] == pytest.approx(slip, rel=1e-7)
    assert events["stop"] == pytest.approx(stop, rel=1e-7)
    series = result.series([stop], left=True)
    np.testing.assert_allclose(series.temperature[0] - sb.ROOM, T, rtol=1e-5)
    assert "explicit method" in str(result)


@pytest.mark.parametrize("growth", [1.0, sb.layer_growth(1e-6, 0.028, 20)])
def test_every_watt_is_accounted_for(growth):
    energy = layered_result(growth).energy
    assert float(energy["closure"]) < 1e-9
    assert float(energy["heat_closure"]) < 1e-12
    given = float(energy["heat_to_metal"] + energy["heat_to_linings"] + energy["heat_to_band"])
    assert given == pytest.approx(float(energy["friction_heat"]), rel=1e-13)
    assert float(energy["heat_to_metal"]) == pytest.approx(0.95 * given, rel=1e-12)
    stored, lost = float(energy["heat_stored"]), float(energy["heat_lost"])
    assert stored + lost == pytest.approx(given, rel=1e-12)


def test_heat_without_fade_changes_nothing():
    plain = sb.simulate(stop_scene())
    scene = stop_scene()
    heat = layered_stop().heat
    warm = sb.simulate(eqx.tree_at(lambda s: s.heat, scene, heat, is_leaf=lambda x: x is None))
    for name in ("slip_onset_time", "full_slip_time", "stopping_time", "stopping_angle"):
        assert warm.metrics[name] == pytest.approx(plain.metrics[name], rel=1e-12)
    assert plain.metrics["stopping_time"] is not None
    assert "heat_lost" not in plain.metrics


# --- closed forms ------------------------------------------------------------------------------------------------


def lump(capacity=2e4, share=1.0, linings=None, cooling=0.0, **more):
    return sb.lumped_heat(
        rim=capacity, partition=sb.ConstantPartition(share), rim_cooling=cooling, linings=linings, **more
    )


def rigid_stop(law, heat, end=10.0, lever=None, load=0.0, w0=W0):
    duty = sb.Duty(lever or sb.Constant(T0), sb.TorqueLoad(sb.Constant(load)))
    return sb.Scene(brake(law, None), duty, sb.Initial(w0), end, heat)


def fade_stop(f=0.35, slope=2e-3, capacity=2e4, solver=None):
    return sb.simulate(rigid_stop(fading(f, slope), lump(capacity)), solver=solver, rtol=1e-11)


def stopping_time(f, slope, capacity):
    """Adiabatic lump: `T − T_0 = J (ω_0² − ω²)/2C` whatever the friction does, so that `t = ∫ J dω/M(T(ω))`."""
    z = math.tan(BETA / 2)

    def torque(w):
        now = f * max(1 - slope * J * (W0**2 - w**2) / (2 * capacity), 0.0)
        return R * T0 * (((1 + now * z) / (1 - now * z)) ** N - 1)

    return quad(lambda w: J / torque(w), 0.0, W0, epsabs=1e-13, epsrel=1e-13)[0]


@pytest.mark.parametrize("solver", [diffrax.Dopri8(), sb.Rodas5P()])
def test_stop_with_an_adiabatic_lump_against_quadrature(solver):
    result = fade_stop(solver=solver)
    assert result.metrics["stopping_time"] == pytest.approx(stopping_time(0.35, 2e-3, 2e4), rel=1e-10)
    assert result.metrics["peak_rim_temperature"] == pytest.approx(sb.ROOM + 0.5 * J * W0**2 / 2e4, rel=1e-12)


@pytest.mark.parametrize("solver", [diffrax.Dopri8(), sb.Rodas5P()])
def test_gradients_with_fade_against_quadrature(solver):
    def metrics(f, slope, capacity):
        result = fade_stop(f, slope, capacity, solver)
        return jnp.stack([result.stopping_time, result.end_temperatures[0]])

    at = (0.35, 2e-3, 2e4)
    backward = jax.jit(jax.jacrev(metrics, (0, 1, 2)))(*at)
    forward = jax.jit(jax.jacfwd(metrics, (0, 1, 2)))(*at)
    np.testing.assert_allclose(np.asarray(backward), np.asarray(forward), rtol=1e-9, atol=1e-12)
    for i, size in enumerate((1e-3, 1e-5, 1e2)):

        def shifted(h, i=i):
            return stopping_time(*(x + h * (j == i) for j, x in enumerate(at)))

        # fourth-order differences of the quadrature
        exact = (8 * (shifted(size) - shifted(-size)) - (shifted(2 * size) - shifted(-2 * size))) / (12 * size)
        assert float(backward[i][0]) == pytest.approx(exact, rel=1e-8)
    assert float(backward[2][1]) == pytest.approx(-0.5 * J * W0**2 / 2e4**2, rel=1e-9)


def test_drag_holds_the_speed_and_the_lever_follows_the_fade():
    heat = lump(5e4, linings=1e4, share=0.9, cooling=300.0)
    scene = rigid_stop(fading(slope=1e-3), heat, 60.0, sb.SpeedHold(limit=50e3), load=2e4, w0=5.0)
    result = sb.simulate(scene)
    assert float(result.record.y_end.omega) == pytest.approx(5.0, rel=1e-13)
    power = 2e4 * 5.0
    assert float(result.energy["friction_heat"]) == pytest.approx(power * 60.0, rel=1e-12)
    t = np.asarray([0.0, 20.0, 60.0])
    series = result.series(t)
    rim = sb.ROOM + 0.9 * power / 300.0 * (1 - np.exp(-300.0 / 5e4 * t))
    linings = sb.ROOM + 0.1 * power / 1e4 * t
    np.testing.assert_allclose(series.temperature, np.stack([rim, linings], axis=1), rtol=1e-10)
    fz = 0.35 * (1 - 1e-3 * (linings - sb.ROOM)) * math.tan(BETA / 2)
    Pi = ((1 + fz) / (1 - fz)) ** N
    np.testing.assert_allclose(series.slack_tension, 2e4 / (R * (Pi - 1)), rtol=1e-9)
    assert "grip_lost" not in [event.name for event in result.events]
    runaway = sb.simulate(eqx.tree_at(lambda s: s.duty.slack_tension.limit, scene, np.asarray(7e3)))
    needed = 2e4 / (7e3 * R) + 1
    f_end = (needed ** (1 / N) - 1) / (needed ** (1 / N) + 1) / math.tan(BETA / 2)
    t_end = (1 - f_end / 0.35) / 1e-3 / (0.1 * power / 1e4)
    lost = [event.time for event in runaway.events if event.name == "grip_lost"]
    assert lost[0] == pytest.approx(t_end, rel=1e-6)


# --- events that heat brings about -------------------------------------------------------------------------------


def warmed(law, power, load=0.0, stiffness=C, end=200.0, capacity=1e4, n=N, beta=BETA, flash=None, area=None, w0=0.0):
    """A brake whose linings are warmed from outside: `T = T_0 + P t/C`."""
    heat = sb.Heat(
        (sb.Lump("linings", capacity),),
        sources=(sb.Source("linings", power),),
        friction=sb.FrictionHeat(None, "linings", sb.ConstantPartition(1.0)),
        flash=flash,
        linings="linings",
        permissible=293.15 + 50.0,
    )
    duty = sb.Duty(sb.Constant(T0), sb.TorqueLoad(sb.Constant(load)))
    return sb.Scene(brake(law, stiffness, n, beta, area), duty, sb.Initial(w0), end, heat)


@pytest.mark.parametrize("stiffness", [C, None])
def test_a_held_brake_lets_go_when_it_is_heated(stiffness):
    z, load = math.tan(BETA / 2), 2.0e4
    result = sb.simulate(warmed(fading(slope=1e-3), 2e4, load, stiffness, end=150.0), throw=False)
    mu = (load / (R * T0) + 1) ** (1 / N)
    f = (mu - 1) / (mu + 1) / z
    t = (1 - f / 0.35) / 1e-3 / 2.0
    events = {event.name: event.time for event in result.events}
    assert events["restart"] == pytest.approx(t, rel=1e-10)
    assert events["permissible_temperature"] == pytest.approx(25.0, rel=1e-10)
    held = result.series(np.linspace(0.0, 0.999 * t, 50))
    assert np.all(np.asarray(held.omega) == 0.0)
    assert np.all(np.asarray(held.phi) == 0.0)


def test_self_locking_reached_by_heat_is_an_event_or_a_code():
    rising = sb.ProductFriction(
        sb.ConstantFriction(0.9), (sb.TabulatedFade(np.asarray([250.0, 350.0, 900.0]), np.asarray([0.9, 1.0, 2.5])),)
    )
    elastic = sb.simulate(warmed(rising, 4e4, n=4, beta=math.radians(60.0), end=140.0))
    (locked,) = [event.time for event in elastic.events if event.name == "self_locking"]
    T = sb.ROOM + 4.0 * locked
    factor = float(rising.factors[0].factor(sb.Contact(v=None, T=jnp.asarray([T])))[0])
    assert 0.9 * factor * math.tan(math.radians(30.0)) == pytest.approx(1.0, rel=1e-9)
    rigid = sb.simulate(warmed(rising, 4e4, n=4, beta=math.radians(60.0), end=140.0, stiffness=None), throw=False)
    assert rigid.status == "singular_geometry"
    assert float(rigid.record.t_end) == pytest.approx(locked, rel=1e-9)


def test_a_table_that_is_left_ends_the_run_or_is_refused_before_it():
    def law(*T):
        return sb.ProductFriction(sb.ConstantFriction(0.3), (sb.TabulatedFade(np.asarray(T), np.asarray([1.0, 0.8])),))

    result = sb.simulate(warmed(law(280.0, 400.0), 2e4), throw=False)
    assert result.status == "outside_table"
    assert float(result.record.t_end) == pytest.approx((400.0 - 293.15) / 2.0, rel=1e-10)
    with pytest.raises(sb.InputError, match="does not cover the start"):
        sb.simulate(warmed(law(300.0, 400.0), 2e4))


def test_band_snap_is_named():
    """A surface node so small that fade outruns the band: 1 + γ reaches 0."""
    heat = lump(30.0)
    duty = sb.Duty(sb.Constant(T0), sb.TorqueLoad())
    scene = sb.Scene(brake(fading(slope=3e-3, floor=0.1), C), duty, sb.Initial(W0), 2.0, heat)
    result = sb.simulate(scene, throw=False)
    assert result.status == "band_snap"
    assert "capacity" in result.message


FLASH = sb.FlashTemperature(length=1e-3, conductivity=50.0, diffusivity=1.44e-5)


def test_flash_temperature_of_a_moving_source():
    assert float(FLASH.rise(jnp.asarray(1e8), jnp.asarray(20.0))) == pytest.approx(60.5551805284838, rel=1e-12)


def test_implicit_friction_of_flash_and_pressure_against_scalar_roots():
    area, v = 0.02, 10.0
    base = sb.ProductFriction(
        sb.ConstantFriction(0.4), (sb.LinearFade(2e-3, 300.0), sb.PressureFactor(reference=1e6, exponent=0.3))
    )
    grip = sb_grip(base, area)
    T = np.full(5, 320.0)
    found = grip.coefficients(jnp.asarray(2e4), jnp.full(5, v), jnp.asarray(T), jnp.asarray(False), static=False)
    before = 2e4
    for i in range(5):

        def law(f, before=before):
            mu = (1 + f * math.tan(0.25)) / (1 - f * math.tan(0.25))
            p = before * (1 + mu) * math.sin(0.25) / area
            rise = 2 * f * p * v / 50.0 * math.sqrt(1.44e-5 * 1e-3 / (math.pi * v))
            return 0.4 * (1 - 2e-3 * (320.0 + rise - 300.0)) * (1 + p / 1e6) ** -0.3 - f

        f = brentq(law, 0.0, 1.0, xtol=1e-15)
        assert float(found.f[i]) == pytest.approx(f, rel=1e-12)
        before *= (1 + f * math.tan(0.25)) / (1 - f * math.tan(0.25))

    def least(T):
        return grip.coefficients(jnp.asarray(2e4), jnp.full(5, v), T, jnp.asarray(False), static=False).f[-1]

    slope = jax.grad(least)(jnp.asarray(T))
    h = 1e-3
    for j in (0, 4):
        e = np.eye(5)[j] * h
        central = (float(least(jnp.asarray(T + e))) - float(least(jnp.asarray(T - e)))) / (2 * h)
        assert float(slope[j]) == pytest.approx(central, rel=1e-7)


def sb_grip(law, area):
    from simbrake._sliding import Grip

    return Grip(sb.Lining(law, np.full(5, 0.5), area), FLASH)


def test_flash_fold_is_named():
    """Friction that rises with temperature feeds its own flash: warmed far enough, the branch without flash ends."""
    table = np.asarray([250.0, 400.0, 450.0, 2000.0]), np.asarray([0.9, 1.0, 2.2, 2.3])
    rising = sb.ProductFriction(sb.ConstantFriction(0.3), (sb.TabulatedFade(*table),))
    flash = sb.FlashTemperature(length=1e-3, conductivity=50.0, diffusivity=1.44e-5, hardness=3.0e7)
    scene = warmed(rising, 1e5, stiffness=None, end=80.0, flash=flash, capacity=1e5, w0=20.0)
    scene = eqx.tree_at(lambda s: s.brake.pulley.inertia, scene, np.asarray(1e6))
    result = sb.simulate(scene, throw=False)
    assert result.status == "flash_fold", result.message
    T, v = float(result.end_temperatures[0]), R * float(result.record.y_end.omega)
    per_f = 2 * 3.0e7 * v / 50.0 * math.sqrt(1.44e-5 * 1e-3 / (math.pi * v))
    f = np.linspace(0.28, 0.5, 2001)
    excess = f - 0.3 * np.asarray(rising.factors[0].factor(sb.Contact(v=None, T=jnp.asarray(T + per_f * f))))
    # here the hill of the residual, behind the first root, has just sunk to 0
    hill = excess[np.argmax(np.diff(excess) < 0)]
    assert abs(hill) < 1e-4


# --- duties ------------------------------------------------------------------------------------------------------


def test_repeated_duty_is_the_duty_written_out():
    points = {"times": np.asarray([0.5, 1.0, 3.0, 3.2]), "values": np.asarray([T0, 0.0, 0.0, T0])}
    times = np.concatenate([points["times"] + 6.0 * c for c in range(3)])
    law, load = sb.ConstantFriction(0.35), sb.TorqueLoad(sb.Constant(5e3), 300.0)
    runs = []
    for lever in (sb.Repeated(**points, period=6.0, count=3), sb.PiecewiseLinear(times, np.tile(points["values"], 3))):
        runs.append(sb.simulate(sb.Scene(brake(law), sb.Duty(lever, load), sb.Initial(0.0), 18.0)))
    one, two = ([(event.name, event.lining) for event in run.events] for run in runs)
    assert one == two
    np.testing.assert_allclose([e.time for e in runs[0].events], [e.time for e in runs[1].events], rtol=1e-11)
    assert sum(event.name == "stop" for event in runs[0].events) == 3


def test_tripping_load_books_the_energy_it_brings():
    load = sb.TrippingLoad(
        empty=8e3,
        string=60e3,
        stand=5e3,
        taken=0.2,
        set=8.0,
        period=10.0,
        drum_radius=0.4,
        line_count=8,
        count=2,
        drag=1.6e3,
    )
    lever = sb.Repeated([0.5, 1.0, 4.0, 4.3], [24e3, 0.0, 0.0, 24e3], 10.0, 2)
    b = sb.Brake(
        sb.Pulley(0.59, 1200.0),
        sb.Band(0.623, 1e5),
        sb.uniform_linings(20, math.radians(270), sb.ConstantFriction(0.35)),
    )
    result = sb.simulate(sb.Scene(b, sb.Duty(lever, load), sb.Initial(0.0), 20.0))
    assert float(result.energy["closure"]) < 1e-9
    stops = [event.time for event in result.events if event.name == "stop"]
    assert len(stops) == 2
    # the second string is heavier: it runs faster and takes longer to stop
    assert stops[1] - 10.0 > stops[0]
    series = result.series([5.0 + 2.0, 9.0, 15.0 + 2.0])
    np.testing.assert_allclose(series.load_torque, np.asarray([68e3, 8e3, 73e3]) * 9.80665 * 0.05, rtol=1e-12)


def test_cyclic_steady_state_is_where_long_cycling_ends():
    heat = sb.lumped_heat(
        rim=1e4,
        linings=5e3,
        band=4e3,
        partition=sb.ConstantPartition(0.8),
        rim_cooling=60.0,
        lining_to_band=40.0,
        band_cooling=30.0,
    )
    scene = rigid_stop(fading(slope=1e-3, floor=0.4), heat, 60.0)
    found = sb.cyclic_steady_state(scene)
    assert found.change < 1e-7
    T = np.full(3, sb.ROOM)
    for _ in range(100):
        run = sb.simulate(eqx.tree_at(lambda s: s.heat, scene, sb.with_temperatures(heat, T)))
        T = np.asarray(run.end_temperatures)
    np.testing.assert_allclose(T, np.asarray(found.result.end_temperatures), atol=1e-6)
    assert found.cycles < 40
    # over a cycle all friction heat leaves: half the kinetic energy's worth at 60 s
    assert float(found.result.energy["heat_lost"]) == pytest.approx(0.5 * J * W0**2, rel=1e-7)


# --- faults ------------------------------------------------------------------------------------------------------


def test_faults_of_a_scene_with_heat():
    with pytest.raises(sb.InputError, match="looks at the temperature"):
        sb.simulate(stop_scene(law=fading()))
    with pytest.raises(sb.InputError, match=r"brake\.linings\.area"):
        sb.simulate(stop_scene(law=sb.ProductFriction(sb.ConstantFriction(0.3), (sb.PressureFactor(1e6, 0.2),))))
    scene = layered_stop()
    bad = eqx.tree_at(lambda s: s.heat.friction, scene, sb.FrictionHeat("rim", "nowhere", sb.ConstantPartition(1.5)))
    with pytest.raises(sb.InputError, match=r"partition\.metal"):
        sb.simulate(bad)
    bad = eqx.tree_at(lambda s: s.heat.friction, scene, sb.FrictionHeat("rim", "nowhere", sb.ConstantPartition(0.5)))
    with pytest.raises(sb.InputError) as caught:
        sb.simulate(bad)
    assert "'rim'" in str(caught.value)
    assert "'nowhere'" in str(caught.value)


def test_numbers_of_a_heat_part_are_set_by_path():
    scene = sb.with_values(
        layered_stop(), {"heat.bodies[0].material.conductivity": 60.0, "heat.links[0].coefficient": 10.0}
    )
    assert float(scene.heat.bodies[0].material.conductivity) == 60.0
    assert float(scene.heat.links[0].coefficient) == 10.0


# --- ready networks ----------------------------------------------------------------------------------------------


def installation(each=1, **more):
    area = 2 * math.pi * 0.59 * 0.22
    return sb.layered_heat(
        rim=sb.material("steel_20L"), rim_thickness=0.025, rim_layers=6, rim_first=1e-3, track_area=area,
        lining=sb.material("FK-24A"), lining_area=0.75 * area, lining_layers=5, lining_first=1e-4, each=each,
        partition=sb.ConstantPartition(0.9), **more,
    )  # fmt: skip


def test_every_lining_gets_the_heat_of_its_own_friction():
    """Insulated walls, one per lining: stored heat in proportion to the tension increments, whatever the depth."""
    scene = rigid_stop(sb.ConstantFriction(0.35), installation(each=N))
    result = sb.simulate(scene)
    stored = np.asarray(result.record.system.forces.thermal.capacity) * (np.asarray(result.end_temperatures) - sb.ROOM)
    linings = stored[6:].reshape(N, 5).sum(axis=1)
    tensions = np.append(1.0, np.cumprod(np.asarray(result.record.system.forces.mu_static)))
    np.testing.assert_allclose(linings / linings.sum(), np.diff(tensions) / (tensions[-1] - 1), rtol=1e-9)
    assert linings.sum() == pytest.approx(0.1 * 0.5 * J * W0**2, rel=1e-9)
    assert int(result.peak_lining_temperature.lining) == N
    assert result.nodes[6] == "lining[1,1]"


def test_one_wall_for_all_linings_is_the_mean_of_walls_for_each():
    cooled = {"outside": 30.0, "inside": sb.SpeedCoefficient(8.0, 2.0), "emissivity": 0.8, "contact_resistance": 2e-3}
    runs = [sb.simulate(rigid_stop(sb.ConstantFriction(0.35), installation(each, **cooled))) for each in (1, N)]
    one, each = (np.asarray(run.end_temperatures) for run in runs)
    np.testing.assert_allclose(each[:6], one[:6], rtol=1e-9)
    np.testing.assert_allclose(each[6:].reshape(N, 5).mean(axis=0), one[6:], rtol=1e-9)
    assert all(float(run.energy["heat_closure"]) < 1e-12 for run in runs)


def test_interface_without_capacity_shares_friction_heat_by_effusivity():
    """Friction heat given to a junction between two walls: the share that they find by themselves is Charron's."""
    steel, lining = sb.Material(45.0, 7850.0, 480.0), sb.Material(0.8, 2000.0, 1100.0)
    growth = sb.layer_growth(5e-6, 0.03, 60)
    heat = sb.Heat(
        (
            sb.Wall("rim", steel, 0.03, 1.0, 60, growth),
            sb.Wall("lining", lining, 0.03, 1.0, 60, growth),
            sb.Junction("face"),
        ),
        (sb.ThermalContact("face", "rim.front", 1.0), sb.ThermalContact("face", "lining.front", 1.0)),
        sb.FrictionHeat("face", "face", sb.ConstantPartition(0.5), sensed="rim.front"),
        rim="rim.front",
    )
    result = sb.simulate(rigid_stop(sb.ConstantFriction(0.35), heat))
    stored = {name: float(value) for name, value in result.stored_heat.items()}
    assert stored["rim"] / sum(stored.values()) == pytest.approx(0.907538740903391, abs=2e-3)
    assert float(result.energy["heat_closure"]) < 1e-10  # perfect contact of layers of 5 µm: large conductances cancel


def test_thermal_stabilisation_sends_nothing_to_the_flange():
    steel = sb.material("steel_20L")
    with_flange = sb.with_pulley_structure(installation(), steel)
    without = sb.with_pulley_structure(installation(), steel, flange=False)
    hot = [np.where(np.arange(11 + len(h.bodies) - 3) < 6, 450.0, 300.0) for h in (with_flange, without)]
    ends = []
    for heat, T in zip((with_flange, without), hot, strict=True):
        run = sb.simulate_heat(sb.with_temperatures(heat, T), [0.0, 300.0])
        ends.append(float(run.temperature[-1, 0]))
    assert ends[0] < ends[1]
    assert "flange" not in [body.name for body in without.bodies]
    # V, table 1: the flange's resistance
    assert float(sb.radial_resistance(0.035, 47.8, 0.420, 0.565)) == pytest.approx(0.028, abs=5e-4)


def test_radiation_governs_above_a_temperature():
    T = sb.radiation_governs_above(25.0, 0.8)
    assert pytest.approx(25.0 * (T - sb.ROOM), rel=1e-10) == 0.8 * sb.STEFAN_BOLTZMANN * (T**4 - sb.ROOM**4)


@pytest.mark.slow
def test_cost_grows_no_faster_than_the_layers():
    import time

    def cost(layers):
        growth = sb.layer_growth(1e-6, 0.03, layers)
        steel = sb.material("steel_20L")
        heat = sb.Heat(
            (sb.Wall("w", steel, 0.03, 1.0, layers, growth), sb.Reservoir("air")),
            (sb.Convection("w.back", 1.0, 100.0),),
            sources=(sb.Source("w.front", sb.ramp(1e6, 0.0, 0.0, 5.0)),),
        )
        times = []
        for _ in range(6):
            start = time.perf_counter()
            jax.block_until_ready(sb.simulate_heat(heat, [0.0, 5.0], rtol=1e-8, solver=sb.Rodas5P()).temperature)
            times.append(time.perf_counter() - start)
        return sorted(times[1:])[2]

    assert cost(1000) / cost(10) < 100**1.2
    assert cost(1000) / cost(100) < 10**1.2 * 1.5  # the timing itself is uncertain


def test_heat_with_no_power_is_no_heat():
    """A friction law that fades, on a network that no heat reaches: the brake without heat, to rounding."""
    heat = layered_stop().heat
    cold = eqx.tree_at(lambda h: h.friction, heat, sb.FrictionHeat(None, None, sb.ConstantPartition(0.5), "rim.front"))
    scene = layered_stop()
    warm = sb.simulate(eqx.tree_at(lambda s: s.heat, scene, cold))
    plain = sb.simulate(sb.Scene(brake(sb.ConstantFriction(0.35)), scene.duty, scene.initial, 2.0))
    for name in ("full_slip_time", "stopping_time", "stopping_angle", "max_tension"):
        assert warm.metrics[name] == pytest.approx(plain.metrics[name], rel=1e-12)
    np.testing.assert_allclose(np.asarray(warm.end_temperatures), sb.ROOM, rtol=1e-14)
    assert warm.metrics["heat_lost"] == pytest.approx(float(plain.energy["friction_heat"]), rel=1e-12)


def test_a_batch_of_stiff_scenes_is_its_single_runs():
    base = layered_stop(sb.layer_growth(1e-5, 0.028, 20))

    def stop(f):
        scene = eqx.tree_at(lambda s: s.brake.linings.friction.base.coefficient, base, f)
        return sb.simulate(scene, rtol=1e-8, max_steps=256).stopping_time

    values = jnp.asarray([0.3, 0.35])
    batch = jax.jit(jax.vmap(stop))(values)
    single = jax.jit(stop)
    np.testing.assert_allclose(np.asarray(batch), [float(single(f)) for f in values], rtol=1e-12)


def test_gradient_of_a_peak_temperature_against_differences():
    """The rim of a dragging, then stopping pulley is hottest at some time in between: an interior maximum."""

    def peak(f, capacity):
        heat = lump(capacity, cooling=4e3)
        result = sb.simulate(
            rigid_stop(fading(f), heat, 2.0), rtol=1e-12, solver=diffrax.Dopri8(), max_steps=256
        )  # fmt: skip
        return result.peak_rim_temperature.value

    at, value = (0.35, 5e3), jax.jit(peak)
    slopes = jax.jit(jax.grad(peak, (0, 1)))(*at)
    for i, h in enumerate((2e-4, 5.0)):
        up, down = (value(*(x + s * h * (j == i) for j, x in enumerate(at))) for s in (1, -1))
        up2, down2 = (value(*(x + 2 * s * h * (j == i) for j, x in enumerate(at))) for s in (1, -1))
        central = (8 * (float(up) - float(down)) - (float(up2) - float(down2))) / (12 * h)
        assert float(slopes[i]) == pytest.approx(central, rel=1e-7)
