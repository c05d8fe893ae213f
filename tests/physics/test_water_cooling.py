"""Water-cooled rims: streams over an isothermal wall (ε-NTU), properties of water,
boiling; closed forms and SciPy."""

import dataclasses
import math

import heat_scenes as hs
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, input_error, names_of, near
from oracles.stops import at_rest
from scenes import lining_ratio
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake.thermal import (
    Conductance,
    FrictionHeat,
    Junction,
    Lump,
    Reservoir,
    Wall,
    WaterJacket,
    water,
)

#: wetted area (m²), flow (m³/s), inlet (K), coefficient (W/(m²·K)), heat capacity of a
#: rim (J/K)
AREA = 0.8
FLOW = 200.0 / 60_000
INLET = 303.15
H = 4000.0
RIM = 5e4
LIQUID = water("35 degC", "1.5 bar")
CHANNEL = {"section": "45 cm^2", "diameter": "36 mm", "length": "3.5 m"}
#: torque of the load (N·m) and speed (rad/s) of a drag: the friction power is constant
LOAD = 2e4
SPEED = 5.0


def rate_of(flow=FLOW, liquid=LIQUID):
    """Heat capacity rate (W/K) of the stream."""
    return liquid.density * liquid.specific_heat * flow


def conductance_of(flow=FLOW, h=H, area=AREA):
    """Heat to the stream per kelvin between wall and inlet, `C (1 − e^{−hA/C})`."""
    C = rate_of(flow)
    return C * (1 - jnp.exp(-h * area / C))


def jacket(place="rim", flow=FLOW, coefficient: object = H, **more):
    return WaterJacket(place, AREA, flow, LIQUID, coefficient, **more)


def wet_lump(flow=FLOW, inlet=INLET, start=INLET, **more):
    """A rim as one lump with water behind it, and nothing else; the friction heat is
    all its own."""
    bodies = (Lump("rim", RIM, start), Reservoir("water", inlet))
    return sb.Heat(
        bodies, (jacket(flow=flow, **more),), FrictionHeat("rim", None, 1.0), rim="rim"
    )


def drag(heat, end=60.0):
    """A load that a lever lowers at constant speed: the friction power is
    `LOAD · SPEED`."""
    return hs.rigid_stop(
        sb.ConstantFriction(0.35),
        heat,
        end,
        sb.SpeedHold(limit=50e3),
        load=LOAD,
        w0=SPEED,
    )


# --- water --------------------------------------------------------------------------


def test_properties_of_water():
    """Check values of IAPWS R7-97(2012), table 36, and SR6-08(2011), tables 3 and 5;
    those of other texts at 60 °C."""
    for pressure, T in ((0.1e6, 372.755919), (1e6, 453.035632), (10e6, 584.149488)):
        near(sb.thermal.saturation_temperature(pressure), T, abs=5e-7)
    liquid = water(298.15)
    near(liquid.density, 997.047013, 1e-8)
    near(liquid.specific_heat, 4181.44618, 1e-8)
    near(liquid.viscosity, 889.996774e-6, 1e-8)
    near(liquid.conductivity, 0.606502308, 1e-8)
    # VDI Heat Atlas, 60 °C and 1 bar
    warm = water("60 degC")
    all_near([warm.density, warm.specific_heat], [983.2, 4185.0], 2e-4)
    near(warm.prandtl, 2.99, 5e-3)
    with input_error(
        match=r"temperature of the water must be ≥ 273\.15 and ≤ 383\.15 K"
    ):
        water(30.0)
    with input_error(match=r"absolute pressure of the water must be ≥ 611\.213"):
        water(pressure=3.0)


def test_dittus_boelter_of_a_jacket():
    """The channel gives `h` by the speed `V̇/section`, as the equation of the textbook
    does."""
    v = FLOW / 45e-4
    mu, k, cp, rho = (
        float(x)
        for x in (
            LIQUID.viscosity,
            LIQUID.conductivity,
            LIQUID.specific_heat,
            LIQUID.density,
        )
    )
    Re = rho * v * 36e-3 / mu
    Pr = mu * cp / k
    h = 0.023 * Re**0.8 * Pr**0.4 * k / 36e-3
    near(sb.thermal.dittus_boelter(v, 36e-3, LIQUID), h, 1e-14)
    by_channel = jacket(coefficient=None, **CHANNEL)
    got = by_channel.conductance(400.0, INLET, sb.thermal.Surroundings())
    near(got, conductance_of(h=h), 1e-13)
    by_law = jacket(
        coefficient=sb.thermal.SpeedCoefficient(500.0, "0.1 m/s"), section="45 cm^2"
    )
    h = 500.0 * (1 + (v / 0.1) ** 2) ** 0.4
    got = by_law.conductance(400.0, INLET, sb.thermal.Surroundings())
    near(got, conductance_of(h=h), 1e-13)


# --- the stream ---------------------------------------------------------------------


@pytest.mark.parametrize("layers", [0, pytest.param(6, marks=pytest.mark.slow)])
def test_steady_state_of_a_rim(layers):
    """`T_w = T_in + P/(C (1 − e^{−NTU}))`, of a rim in layers at its back, and with
    derivatives by flow and inlet."""
    P = 150e3

    def front(x):
        flow, inlet = x
        heat = wet_lump(flow, inlet)
        if layers:
            rim = Wall("rim", sb.Material(48.0, 7800.0, 500.0), 0.03, 1.1, layers)
            heat = dataclasses.replace(
                heat,
                bodies=(rim, heat.bodies[1]),
                links=(jacket("rim.back", flow),),
                friction=FrictionHeat("rim.front", None, 1.0),
                rim="rim.front",
            )
        T = sb.steady_state(heat, power=P)
        return T["rim"] if not layers else T["rim[1]"]

    def closed(x):
        # the heat enters the middle of the first layer
        through = 0.03 * (1 - 0.5 / layers) / (48.0 * 1.1) if layers else 0.0
        return x[1] + P * (1 / conductance_of(x[0]) + through)

    at = jnp.asarray([FLOW, INLET])
    near(front(at), closed(at), 1e-9)
    all_near(jax.jit(jax.grad(front))(at), jax.grad(closed)(at), 1e-7)


@pytest.mark.slow
def test_cooling_while_the_pump_stops():
    """`T − T_in` decays exponentially with the flow, not at all without; what it loses
    the water carries away."""
    stop = 20.0
    start = 50.0
    end = 90.0
    flow = sb.PiecewiseLinear([stop, stop, start, start], [FLOW, 0.0, 0.0, 0.5 * FLOW])
    heat = wet_lump(flow, start=363.15)
    times = np.array([0.0, 10.0, stop, 35.0, start, end])
    run = sb.simulate_heat(heat, times, rtol=1e-12)
    slow = float(conductance_of(0.5 * FLOW))
    fast = float(conductance_of())
    flowed = np.minimum(times, stop) * fast + np.maximum(times - start, 0.0) * slow
    T = INLET + 60.0 * np.exp(-flowed / RIM)
    all_near(run.temperature[:, 0], T, 1e-10)
    all_near(run.coolant, RIM * (363.15 - T), 1e-9, 1e-6)
    assert float(run.lost[-1]) == 0.0
    assert float(run.closure) < 1e-12


def test_no_flow_has_no_heat_and_a_derivative():
    """At no flow `∂Q/∂V̇ = ρ c_p (T_w − T_in)` from above: the water leaves as hot as
    the wall."""
    around = sb.thermal.Surroundings()

    def heat(flow, **more):
        return jacket(flow=flow, **more).conductance(
            jnp.asarray(400.0), jnp.asarray(300.0), around
        )

    for more in ({}, {"coefficient": None, **CHANNEL}):
        value, slope = jax.value_and_grad(lambda flow, more=more: heat(flow, **more))(
            0.0
        )
        assert float(value) == 0.0
        near(slope, rate_of(1.0), 1e-14)


@pytest.mark.slow
def test_constant_friction_power():
    """Columns, ledger and derivatives of a drag: `T = T_∞ − (T_∞ − T_in) e^{−g t/RIM}`,
    `T_out = T_in + Q/C`."""
    P = LOAD * SPEED
    g = float(conductance_of())
    end = 60.0
    result = sb.simulate(drag(wet_lump(), end))
    t = np.array([0.0, 7.0, 30.0, end])
    rise = P / g * (1 - np.exp(-g * t / RIM))
    series = result.series(t)
    all_near(series.wetted_temperature[:, 0], INLET + rise, 1e-10)
    all_near(series.coolant_heat_flow[:, 0], g * rise, 1e-9, 1e-6)
    all_near(series.coolant_temperature[:, 0], INLET + g * rise / rate_of(), 1e-10)
    carried = P * end - RIM * rise[-1]
    all_near(series.heat_to_coolant[-1], carried, 1e-9)
    energy = result.energy
    assert float(energy["heat_closure"]) < 1e-12
    near(result["peak_wetted_temperature"], INLET + rise[-1], 1e-10)
    near(result["peak_coolant_temperature"], INLET + g * rise[-1] / rate_of(), 1e-10)

    def ends(x):
        run = sb.simulate(drag(wet_lump(*x), end), max_steps=128)
        return jnp.stack([run.end_temperatures[0], run.energy["heat_to_coolant"]])

    def closed(x):
        g = conductance_of(x[0])
        rise = (P / g + x[1] - INLET) * (1 - jnp.exp(-g * end / RIM))
        return jnp.stack([INLET + rise, P * end - RIM * rise])

    at = jnp.asarray([FLOW, INLET])
    all_near(jax.jit(jax.jacfwd(ends))(at), jax.jacfwd(closed)(at), 1e-7)


@pytest.mark.slow
def test_stop_with_a_layered_rim():
    """A stop with fading friction and water by Dittus–Boelter behind eight layers,
    against SciPy."""
    layers = 8
    depth = 0.028
    k = 48.0
    rho_c = 7800.0 * 500.0
    slope = 4e-4
    law = hs.fading(slope=slope)
    rim = Wall(
        "rim", sb.Material(k, 7800.0, 500.0), depth, hs.TRACK, layers, 1.0, 340.0
    )
    wet = jacket("rim.back", coefficient=None, **CHANNEL)
    heat = sb.Heat(
        (rim, Reservoir("water", INLET), Reservoir("air")),
        (wet, sb.thermal.Convection("rim.back", 0.2, 20.0)),
        FrictionHeat("rim.front", None, 0.95),
        rim="rim.front",
    )
    result = sb.simulate(hs.rigid_stop(law, heat), rtol=1e-12)
    stop = float(result.stopping_time)
    h = float(sb.thermal.dittus_boelter(FLOW / 45e-4, 36e-3, LIQUID))
    g = float(conductance_of(h=h))
    dx = depth / layers
    A = hs.TRACK
    half = dx / (2 * k * A)

    def face(T_last):
        return (T_last / half + g * INLET + 0.2 * 20.0 * sb.thermal.ROOM) / (
            1 / half + g + 0.2 * 20.0
        )

    def rates(t, y):
        omega = y[0]
        T = y[1 : 1 + layers]
        f = 0.35 * max(1 - slope * (T[0] - 293.15), 0.0)
        torque = hs.R * hs.T0 * (lining_ratio(f, hs.BETA) ** hs.N - 1)
        q = np.concatenate(
            [
                [0.95 * torque * omega],
                k * A / dx * -np.diff(T),
                [(T[-1] - face(T[-1])) / half],
            ]
        )
        return np.concatenate(
            [
                [-torque / hs.J],
                -np.diff(q) / (rho_c * A * dx),
                [g * (face(T[-1]) - INLET)],
            ]
        )

    y0 = np.concatenate([[hs.W0], np.full(layers, 340.0), [0.0]])
    truth = solve_ivp(
        rates,
        (0.0, 10.0),
        y0,
        "DOP853",
        events=at_rest,
        rtol=1e-12,
        atol=1e-10,
        dense_output=True,
    )
    near(stop, truth.t_events[0][0], 1e-9)
    t = np.linspace(0.0, stop, 5)
    course = truth.sol(t)
    series = result.series(t)
    all_near(series.temperature, course[1 : 1 + layers].T, 1e-9)
    wall = face(course[layers])
    all_near(series.wetted_temperature[:, 0], wall, 1e-9)
    all_near(series.coolant_heat_flow[:, 0], g * (wall - INLET), 1e-8)
    all_near(series.heat_to_coolant, course[-1], 1e-8, 1e-3)
    assert float(result.energy["heat_closure"]) < 1e-12


@pytest.mark.slow
def test_two_jackets_and_heat_through_a_junction():
    """Friction heat of a contact without capacity reaches its water at once:
    `P (g_c)/(g_c + g)` of it, and the ledger closes; of two rims each jacket has its
    own columns."""
    bodies = (Lump("rim", RIM, INLET), Junction("contact"), Reservoir("water", INLET))
    links = (
        Conductance("rim", "contact", 800.0),
        jacket("contact"),
        jacket("rim", 2 * FLOW),
    )
    heat = sb.Heat(
        bodies, links, FrictionHeat("contact", "contact", 1.0, "rim"), rim="rim"
    )
    result = sb.simulate(drag(heat, 20.0))
    series = result.series([0.0, 20.0])
    g = float(conductance_of())
    more = float(conductance_of(2 * FLOW))
    P = LOAD * SPEED
    T = np.asarray(series.temperature[:, 0])
    contact = (P + 800.0 * T + g * INLET) / (800.0 + g)
    all_near(series.wetted_temperature, np.stack([contact, T], axis=1), 1e-12)
    flows = np.stack([g * (contact - INLET), more * (T - INLET)], axis=1)
    all_near(series.coolant_heat_flow, flows, 1e-11, 1e-6)
    assert float(result.energy["heat_closure"]) < 1e-12
    assert sb.dataset(result, [20.0]).coolant_heat_flow.dims == ("time", "jacket")


# --- boiling ------------------------------------------------------------------------


def test_boiling_is_an_event_and_a_limit():
    """`t = (RIM/g) ln[ΔT_∞/(ΔT_∞ − ΔT_boil)]`; a limit of the user changes the verdict,
    not the event."""
    weak = 0.08 * FLOW
    g = float(conductance_of(weak))
    rise = float(LIQUID.boiling) - INLET
    final = LOAD * SPEED / g
    assert final > rise
    time = RIM / g * math.log(final / (final - rise))
    scene = drag(wet_lump(weak), 3 * time)
    result = sb.simulate(scene)
    (event,) = result.events["coolant_boils"]
    near(event.time, time, 1e-9)
    said = result.verdict()
    (row,) = [row for row in said.rows if row.name == "Hottest wetted wall"]
    assert (said.colour, row.state, row.limit) == (
        "red",
        "exceeded",
        f"≤ {float(LIQUID.boiling) - 273.15:.6g} °C",
    )
    for limit in (330.0, 400.0):
        own = sb.simulate(
            dataclasses.replace(scene, limits=sb.Limits(peak_wetted_temperature=limit))
        )
        assert own.events["coolant_boils"].times == [event.time]
        (row,) = [
            row for row in own.verdict().rows if row.name == "Hottest wetted wall"
        ]
        assert row.limit == f"≤ {limit - 273.15:.6g} °C"
    assert "coolant_boils" not in names_of(sb.simulate(drag(wet_lump(), 3 * time)))


# --- scene files and errors ---------------------------------------------------------


@pytest.mark.slow
def test_warnings_of_the_range():
    """Below the flow at which Re is 10,000 the law is outside its range, and the
    warning names that flow."""
    Re_of_a_litre = (
        float(LIQUID.density) / 60_000 / 45e-4 * 36e-3 / float(LIQUID.viscosity)
    )
    few = sb.simulate(drag(wet_lump("40 l/min", coefficient=None, **CHANNEL), 0.1))
    (said,) = [
        text for text in few.summary()["warnings"] if text.startswith("outside_range")
    ]
    assert (
        f"Re = {40 * Re_of_a_litre:.4g} is below 10,000, reached at {1e4 / Re_of_a_litre:.4g} l/min"
        in said
    )
