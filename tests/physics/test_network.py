"""Thermal networks by themselves against closed forms: lumps, radiation, slabs,
contact, junctions, steady states."""

import math
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, near
from scipy.special import erfc
from user_parts import Quartic

import simbrake as sb

STEEL = sb.Material(
    conductivity=50.0, density=7800.0, specific_heat=50.0 / (7800.0 * 1.4e-5)
)


def wall(
    name,
    layers,
    thickness=0.08,
    material=STEEL,
    growth=1.0,
    temperature=sb.thermal.ROOM,
):
    return sb.thermal.Wall(name, material, thickness, 1.0, layers, growth, temperature)


def heated_wall(layers, q=1e6, growth=1.0, power=None):
    return sb.Heat(
        bodies=(wall("w", layers, growth=growth),),
        sources=(sb.thermal.Source("w.front", power or q),),
    )


@pytest.mark.slow
def test_junctions_in_a_row():
    """Two lumps over three resistances in series: `ΔT = ΔT_0 exp(−2 t/(C ΣR))`."""
    lumps = (sb.thermal.Lump("a", 15.0, 373.15), sb.thermal.Lump("b", 15.0, 273.15))
    row = [*zip("apqb", "pqb", strict=False)]
    links = tuple(
        sb.thermal.Conductance(*ends, g)
        for ends, g in zip(row, (10.0, 20.0, 5.0), strict=True)
    )
    heat = sb.Heat((*lumps, sb.thermal.Junction("p"), sb.thermal.Junction("q")), links)
    ts = np.array([0.0, 0.1, 0.5, 2.0])
    run = sb.simulate_heat(heat, ts, rtol=1e-12)
    apart = np.outer(50.0 * np.exp(-2 * ts / (15.0 * 0.35)), [1, -1])
    all_near(run.temperature, 323.15 + apart, 1e-11)


@pytest.mark.parametrize(
    ("ambient", "truth"),
    [
        (0.0, [770.251641185237, 471.550459172973, 270.786641370929]),
        (300.0, [771.931270254850, 482.334096654852, 322.710682443192]),
    ],
)
@pytest.mark.parametrize("method", [None, sb.hybrid.Rodas5P()])
def test_radiation(ambient, truth, method):
    heat = sb.Heat(
        bodies=(sb.thermal.Lump("a", 1e4, 900.0), sb.thermal.Reservoir("air", ambient)),
        links=(sb.thermal.Radiation("a", 1.0, 0.8),),
    )
    run = sb.simulate_heat(heat, [0.0, 60.0, 600.0, 3600.0], rtol=1e-12, solver=method)
    all_near(run.temperature[1:, 0], truth, 1e-10)
    assert float(run.closure) < 1e-12


def test_source_changes_before_first_result():
    """A lump with nothing around: `T = T_0 + ∫P dt/C`, of a power that jumps and bends
    before the first result."""
    power = sb.PiecewiseLinear([2.0, 2.0, 5.0], [300.0, 900.0, 0.0])
    heat = sb.Heat(
        bodies=(sb.thermal.Lump("a", 15.0, 300.0),),
        sources=(sb.thermal.Source("a", power),),
    )
    run = sb.simulate_heat(heat, [0.0, 6.0, 9.0], rtol=1e-12)
    warm = 300.0 + (2 * 300.0 + 0.5 * 3 * 900.0) / 15.0
    all_near(run.temperature[:, 0], [300.0, warm, warm], 1e-12)
    assert "0 … 9 s" in str(run)
    assert re.search(r"temperature\[:, 0\] +26.85 … 156.85 °C +a", str(run))


@pytest.mark.parametrize(("begin", "after"), [(0.0, 30.0), (40.0, 61.0), (40.0, 80.0)])
def test_custom_pulse_is_not_stepped_over(begin, after):
    """`C ΔT = P √π` over the whole bell, wherever it lies between the steps, also where
    the run begins late."""
    bell = sb.profiles.FunctionProfile(
        lambda t, at: 900.0 * jnp.exp(-((t - at) ** 2)), begin + after
    )
    heat = sb.Heat(
        bodies=(sb.thermal.Lump("a", 15.0, 300.0),),
        sources=(sb.thermal.Source("a", bell),),
    )
    run = sb.simulate_heat(heat, [begin, begin + 100.0], rtol=1e-10)
    near(run.temperature[-1, 0] - 300.0, 900.0 * math.sqrt(math.pi) / 15.0, 1e-8)


@pytest.mark.slow
def test_constant_flux_has_second_order():
    k = 50.0
    a = 1.4e-5
    q = 1e6
    t = 2.0
    errors = []
    for layers in (40, 80, 160):
        heat = heated_wall(layers)
        run = sb.simulate_heat(heat, [0.0, t], rtol=1e-9)
        x = np.asarray(heat.bodies[0].centres)
        exact = (
            q
            / k
            * (
                2 * np.sqrt(a * t / math.pi) * np.exp(-(x**2) / (4 * a * t))
                - x * erfc(x / (2 * np.sqrt(a * t)))
            )
        )
        rise = np.asarray(run.temperature[-1]) - sb.thermal.ROOM
        surface = rise[0] + q * x[0] / k
        errors.append([np.abs(rise - exact).max(), abs(surface - 119.416426428837)])
    orders = np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])
    assert np.all((orders > 1.9) & (orders < 2.1)), orders
    # of 12.6 K at a depth of 10 mm, of 119 K at the face
    assert np.all(errors[-1] < np.array([0.025, 0.1]))


@pytest.mark.slow
def test_graded_wall_is_two_half_spaces():
    """Layers are symmetric, and either face has the closed form of its own flux as long
    as the middle stays cold."""
    k = 0.5
    rho_c = 2e6
    t = 20.0
    lining = sb.Material(k, 2000.0, 1000.0)
    growth = sb.thermal.layer_growth(1e-4, 0.0225, 20)
    body = sb.thermal.Wall("w", lining, 0.045, 1.0, 40, growth, both=True)
    all_near(body.steps, body.steps[::-1], 1e-14)
    near(body.steps[0], 1e-4, 1e-9)
    heat = sb.Heat(
        (body,),
        sources=(sb.thermal.Source("w.front", 2e4), sb.thermal.Source("w.back", 1e4)),
    )
    run = sb.simulate_heat(heat, [0.0, t], rtol=1e-9)
    half = np.cumsum(body.steps) - body.steps / 2
    for flux, node in ((2e4, 0), (1e4, -1)):
        x = float(half[0])
        a = k / rho_c
        root = np.sqrt(a * t)
        exact = (
            flux
            / k
            * (
                2 * root / math.sqrt(math.pi) * np.exp(-(x**2) / (4 * a * t))
                - x * erfc(x / (2 * root))
            )
        )
        near(float(run.temperature[-1, node]) - sb.thermal.ROOM, exact, 5e-3)


@pytest.mark.slow
def test_contact_finds_the_effusivity_split():
    """Heat into an interface without capacity between two bodies: Charron's share,
    without being told."""
    steel = sb.Material(45.0, 7850.0, 480.0)
    lining = sb.Material(0.8, 2000.0, 1100.0)
    n = 200
    growth = sb.thermal.layer_growth(2e-6, 0.03, 200)
    heat = sb.Heat(
        bodies=(
            wall("rim", n, 0.03, steel, growth),
            wall("lining", n, 0.03, lining, growth),
            sb.thermal.Junction("face"),
        ),
        links=(
            sb.thermal.ThermalContact("face", "rim.front", 1.0),
            sb.thermal.ThermalContact("face", "lining.front", 1.0),
        ),
        sources=(sb.thermal.Source("face", 1e6),),
    )
    run = sb.simulate_heat(heat, [0.0, 0.05, 0.2], rtol=1e-9)
    stored = np.asarray(run.record.system.thermal.capacity) * (
        np.asarray(run.temperature)[-1] - sb.thermal.ROOM
    )
    share = stored[:n].sum() / stored.sum()
    near(share, 0.907538740903391, abs=2e-4)
    near(sb.thermal.effusivity_share(steel, lining), 0.907538740903391, 1e-12)
    assert float(run.closure) < 1e-12


def test_varying_properties_conserve_heat():
    """λ and c linear in T: an insulated wall, unevenly warm at the start, keeps its
    heat content to rounding."""
    m = sb.Material(
        40.0, 7800.0, 450.0, conductivity_slope=-5e-4, specific_heat_slope=8e-4
    )
    T0 = np.linspace(900.0, 300.0, 12)
    heat = sb.Heat((sb.thermal.Wall("w", m, 0.03, 1.0, 12, 1.0, T0),))
    run = sb.simulate_heat(heat, [0.0, 5.0, 2000.0], rtol=1e-9)
    T = np.asarray(run.temperature)
    content = (T - sb.thermal.ROOM) + 0.5 * 8e-4 * (T - sb.thermal.ROOM) ** 2
    all_near(content.sum(axis=1), content[0].sum(), 1e-12)
    assert np.ptp(T[-1]) < 1e-6


@pytest.mark.slow
def test_steady_state_ends_long_cooling():
    heat = sb.Heat(
        (
            sb.thermal.Lump("rim", 5e3, 700.0),
            sb.thermal.Lump("flange", 8e3),
            sb.thermal.Junction("bolt"),
            sb.thermal.Reservoir("air", 300.0),
        ),
        (
            sb.thermal.Conductance("rim", "bolt", 30.0),
            sb.thermal.Conductance("bolt", "flange", 20.0),
            sb.thermal.Radiation("rim", 0.8, 0.7),
            sb.thermal.Convection(
                "flange", 1.2, sb.thermal.TemperatureCoefficient(2.0)
            ),
        ),
        sources=(sb.thermal.Source("rim", 2000.0),),
    )
    end = sb.simulate_heat(heat, [0.0, 2e5], rtol=1e-10).temperature[-1]
    steady = sb.steady_state(heat)
    all_near(list(steady.values())[:2], end[:2], 1e-9)

    def rim(power):
        return sb.steady_state(eqx_source(heat, power))["rim"]

    flow = jax.jit(jax.grad(rim))(2000.0)
    rim = jax.jit(rim)
    h = 1.0
    central = (rim(2000.0 + h) - rim(2000.0 - h)) / (2 * h)
    near(flow, central, 1e-6)


def eqx_source(heat, power):
    import equinox as eqx

    return eqx.tree_at(
        lambda h: h.sources[0].power, heat, jnp.asarray(power, jnp.float64)
    )


def test_custom_link_matches_its_closed_form():
    # C dθ/dt = −s θ³, θ = θ_0/√(1 + 2 s θ_0² t/C)
    heat = sb.Heat(
        (sb.thermal.Lump("a", 2.0, 400.0), sb.thermal.Reservoir("air", 300.0)),
        (Quartic("a", "air", 1e-3),),
    )
    t = np.linspace(0.0, 10.0, 6)
    run = sb.simulate_heat(heat, t, rtol=1e-12)
    all_near(run.temperature[:, 0] - 300.0, 100.0 / np.sqrt(1 + 10.0 * t), 1e-10)
    assert float(run.closure) < 1e-13
    assert [
        leaf.path for leaf in sb.files.leaves(heat, "heat") if "links" in leaf.path
    ] == ["heat.links[0].growth"]


@pytest.mark.parametrize(
    "kind",
    [sb.thermal.Convection, pytest.param(sb.thermal.Radiation, marks=pytest.mark.slow)],
)
def test_closed_band_covers_the_surface(kind):
    """A lump against 0 K: `T_0 e^(−h A t/C)`, or `(T_0⁻³ + 3 ε σ A t/C)^(−1/3)`, `A`
    the open area."""
    h = 20.0
    emissivity = 0.8
    area = 0.7
    C = 1e4
    T_0 = 900.0
    t = 600.0

    def end(closed, **covered):
        heat = sb.Heat(
            (sb.thermal.Lump("a", C, T_0), sb.thermal.Reservoir("air", 0.0)),
            (
                kind(
                    "a",
                    area,
                    h if kind is sb.thermal.Convection else emissivity,
                    **covered,
                ),
            ),
        )
        return float(
            sb.simulate_heat(heat, [0.0, t], closed=closed, rtol=1e-11).temperature[
                -1, 0
            ]
        )

    def truth(open_area):
        if kind is sb.thermal.Convection:
            return T_0 * math.exp(-h * open_area * t / C)
        return (T_0**-3 + 3 * emissivity * 5.670374419e-8 * open_area * t / C) ** (
            -1 / 3
        )

    near(end(1.0, covered=0.6), truth(0.4 * area), 1e-9)
    near(end(0.0, covered=0.6), truth(area), 1e-9)
    near(end(1.0), truth(area), 1e-9)
