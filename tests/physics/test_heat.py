"""Brakes with heat: against scipy on the same equations, closed forms with fade,
gradients with it."""

import functools
import math

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import BETA, T0, W0, C, J, N, R, fading, layered_stop, lump, rigid_stop
from helpers import all_near, jacobians, names_of, near
from oracles.hard_heat import layers
from scenes import lining_ratio
from scipy.integrate import quad, solve_ivp

import simbrake as sb


def scipy_stop(growth, method, rtol):
    """The same equations written for scipy: full slip and stop of `layered_stop`, and
    the layers at the stop."""
    rates_of, first = layers(growth)
    z = math.tan(BETA / 2)

    def ratio(T):
        f = 0.35 * (1 - 3e-4 * T)
        Pi = lining_ratio(f, BETA) ** N
        return Pi, Pi * N * 2 * z / (1 - (f * z) ** 2) * (-0.35 * 3e-4)

    def elastic(t, y):
        return np.concatenate(
            [[-R * (C * y[1] - T0) / J, R * y[0]], rates_of(y[2:], 0.0)]
        )

    def slipping(t, y):
        Pi, slope = ratio(y[2])
        rates = rates_of(y[2:], 0.0)
        extra = 0.95 * T0 * (Pi - 1) / first
        x_0 = T0 * slope * rates[0] / C
        gamma = T0 * slope * extra / C
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
        event.terminal = True
        event.direction = -1
    atol = rtol * np.concatenate([[1.0, 0.01], np.full(20, 10.0)])
    solve = functools.partial(solve_ivp, method=method, rtol=rtol, atol=atol)
    one = solve(
        elastic, (0, 5), np.concatenate([[W0, T0 / C], np.zeros(20)]), events=limit
    )
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
    near(events["full_slip"], slip, 1e-9)
    near(events["restick"], stick, 1e-9)
    near(events["stop"], stop, 1e-9)
    near(stop, 0.65866, abs=1e-5)
    series = result.series([stop], left=True)
    all_near(series.temperature[0] - sb.thermal.ROOM, T, 1e-7, 1e-9)
    near(T[0] + 20.0, 29.29, abs=0.005)


@pytest.mark.parametrize(
    "growth",
    [
        1.0,
        pytest.param(sb.thermal.layer_growth(1e-6, 0.028, 20), marks=pytest.mark.slow),
    ],
)
def test_every_watt_is_accounted_for(growth):
    energy = layered_result(growth).energy
    assert float(energy["closure"]) < 1e-9
    assert float(energy["heat_closure"]) < 1e-12
    given = float(
        energy["heat_to_metal"] + energy["heat_to_linings"] + energy["heat_to_band"]
    )
    near(given, energy["friction_heat"], 1e-13)
    near(energy["heat_to_metal"], 0.95 * given, 1e-12)
    kept = float(energy["heat_stored"] + energy["heat_lost"])
    near(kept, given, 1e-12)


# --- closed forms -------------------------------------------------------------------


def fade_stop(f=0.35, slope=2e-3, capacity=2e4, solver=None):
    return sb.simulate(
        rigid_stop(fading(f, slope), lump(capacity)), solver=solver, rtol=1e-11
    )


def stopping_time(f, slope, capacity):
    """Adiabatic lump: `T − T_0 = J (ω_0² − ω²)/2C` whatever the friction does, so that
    `t = ∫ J dω/M(T(ω))`."""

    def torque(w):
        now = f * max(1 - slope * J * (W0**2 - w**2) / (2 * capacity), 0.0)
        return R * T0 * (lining_ratio(now, BETA) ** N - 1)

    return quad(lambda w: J / torque(w), 0.0, W0, epsabs=1e-13, epsrel=1e-13)[0]


@pytest.mark.smoke
def test_shares_of_heat_of_single_linings():
    """The heat of a lining is in proportion to `T_i − T_{i−1}`, a geometric series
    along the band."""
    shares = np.linspace(0.4, 0.9, N)
    f = 0.35
    energy = sb.simulate(
        rigid_stop(sb.ConstantFriction(f), lump(share=shares, linings=1e4))
    ).energy
    mu = lining_ratio(f, BETA)
    along = np.diff(mu ** np.arange(N + 1.0))
    work = 0.5 * J * W0**2
    to_metal = work * float(shares @ along) / along.sum()
    near(energy["heat_to_metal"], to_metal, 1e-9)
    near(energy["heat_to_linings"], work - to_metal, 1e-9)
    assert float(energy["heat_closure"]) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("solver", [diffrax.Dopri8(), sb.hybrid.Rodas5P()])
def test_adiabatic_lump_against_quadrature(solver):
    for slope in (2e-3, 0.0):
        result = fade_stop(slope=slope, solver=solver)
        near(result.metrics["stopping_time"], stopping_time(0.35, slope, 2e4), 1e-10)
        hot = sb.thermal.ROOM + 0.5 * J * W0**2 / 2e4
        near(result.metrics["peak_rim_temperature"], hot, 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "solver",
    [diffrax.Dopri8(), pytest.param(sb.hybrid.Rodas5P(), marks=pytest.mark.slow)],
)
def test_gradients_with_fade_by_quadrature(solver):
    def metrics(x):
        result = fade_stop(*x, solver)
        return jnp.stack([result.stopping_time, result.end_temperatures[0]])

    at = (0.35, 2e-3, 2e4)
    _, forward, backward = map(np.asarray, jacobians(metrics)(np.asarray(at)))
    all_near(backward, forward, 1e-9, 1e-12)
    for i, size in enumerate((1e-3, 1e-5, 1e2)):

        def shifted(h, i=i):
            return stopping_time(*(x + h * (j == i) for j, x in enumerate(at)))

        # fourth-order differences of the quadrature
        exact = (
            8 * (shifted(size) - shifted(-size))
            - (shifted(2 * size) - shifted(-2 * size))
        ) / (12 * size)
        near(backward[0, i], exact, 1e-8)
    near(backward[1, 2], -0.5 * J * W0**2 / 2e4**2, 1e-9)


@pytest.mark.slow
def test_lever_follows_fade_to_hold_speed():
    heat = lump(5e4, linings=1e4, share=0.9, cooling=300.0)
    scene = rigid_stop(
        fading(slope=1e-3), heat, 60.0, sb.SpeedHold(limit=50e3), load=2e4, w0=5.0
    )
    result = sb.simulate(scene)
    near(result.record.y_end.omega, 5.0, 1e-13)
    power = 2e4 * 5.0
    near(result.energy["friction_heat"], power * 60.0, 1e-12)
    t = np.asarray([0.0, 20.0, 60.0])
    series = result.series(t)
    rim = sb.thermal.ROOM + 0.9 * power / 300.0 * (1 - np.exp(-300.0 / 5e4 * t))
    linings = sb.thermal.ROOM + 0.1 * power / 1e4 * t
    all_near(series.temperature, np.stack([rim, linings], axis=1), 1e-10)
    Pi = lining_ratio(0.35 * (1 - 0.001 * (linings - sb.thermal.ROOM)), BETA) ** N
    all_near(series.slack_tension, 2e4 / (R * (Pi - 1)), 1e-9)
    assert "grip_lost" not in names_of(result)
    runaway = sb.simulate(
        eqx.tree_at(lambda s: s.duty.slack_tension.limit, scene, np.asarray(7e3))
    )
    needed = 2e4 / (7e3 * R) + 1
    f_end = (needed ** (1 / N) - 1) / (needed ** (1 / N) + 1) / math.tan(BETA / 2)
    t_end = (1 - f_end / 0.35) / 1e-3 / (0.1 * power / 1e4)
    lost = runaway.events["grip_lost"].times
    near(lost[0], t_end, 1e-6)


# --- faults -------------------------------------------------------------------------


def test_two_pulleys_are_twice_a_structure():
    """Steady flow through V's radial resistance and the convection behind it, per
    pulley."""
    steel = sb.material("steel_20L")
    air = sb.thermal.Reservoir("air", 300.0)
    base = sb.Heat((sb.thermal.Reservoir("rim", 500.0), air))
    lam = float(steel.conductivity)
    for pulleys in (1, 2):
        heat = sb.thermal.with_pulley_structure(
            base, steel, rim_place="rim", inside=20.0, pulleys=pulleys
        )
        T = sb.steady_state(heat)
        for name, (r, outer, L) in {
            "flange": (0.420, 0.565, 0.035),
            "rebord_2": (0.575, 0.615, 0.025),
        }.items():
            through = 2 * np.pi * lam * L / np.log(outer / r)
            away = 20.0 * 2 * np.pi * (outer**2 - r**2)
            near(T[name], 300 + 200 * through / (through + away), 1e-12)
            flow = pulleys * through * (500 - float(T[name]))
            link = next(
                link for link in heat.links if link.a == "rim" and link.b == name
            )
            near(float(link.value) * (500 - float(T[name])), flow, 1e-12)
        volumes = {
            b.name: float(b.capacity) / float(steel.density * steel.specific_heat)
            for b in heat.bodies[2:]
        }
        near(volumes["disc"], pulleys * np.pi * (0.590**2 - 0.575**2) * 0.025, 1e-12)


@pytest.mark.slow
def test_surface_layer_in_series_with_wall():
    """Steady flow through `δ_s(T)/λ_s` and a wall: with `δ_s` linear in the temperature
    a quadratic equation."""
    L = 0.03
    lam = 0.736
    A = 0.2
    n = 6
    layer = sb.thermal.SurfaceLayer([373.15, 923.15], ["5.6 um", "35.4 um"])
    wall = sb.thermal.Wall(
        "wall", sb.Material(lam, 2000.0, 1000.0), L, A, n, surface_layer=layer
    )
    bodies = (
        wall,
        sb.thermal.Reservoir("hot", 900.0),
        sb.thermal.Reservoir("cold", 300.0),
    )
    behind = sb.thermal.ThermalContact("wall.back", "cold", A)
    per_kelvin = 29.8e-6 / 550 / 1.02
    at_0 = 5.6e-6 / 1.02 - per_kelvin * 373.15
    half = L / (2 * n * lam)
    rest = L / lam * (1 - 0.5 / n)
    T = sb.steady_state(
        sb.Heat(bodies, (sb.thermal.ThermalContact("hot", "wall.front", A), behind))
    )
    # (T_1 − 300)(at_0 + per_kelvin T_1 + half) = (900 − T_1) rest
    T_1 = np.roots(
        [
            per_kelvin,
            at_0 + half - 300 * per_kelvin + rest,
            -300 * (at_0 + half) - 900 * rest,
        ]
    ).max()
    near(next(iter(T.values())), T_1, 1e-11)

    # friction heat enters at its face: the surface is warmer by all of it through the
    # layer
    heat = sb.Heat(
        bodies[::2],
        (behind,),
        sb.thermal.FrictionHeat("wall.front", None, 1.0),
        rim="wall.front",
    )
    result = sb.simulate(rigid_stop(sb.ConstantFriction(0.35), heat))
    start = result.series(np.zeros(1))
    q = float(start.brake_torque[0]) * W0 / A
    surface = 293.15 + q * (half + 5.6e-6 / 1.02)
    near(start.rim_temperature[0, 0], surface, 1e-12)
