"""Contacts that open with the band and conduct by pressure."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, names_of, near
from scipy.linalg import expm

import simbrake as sb
from simbrake.thermal import (
    Conductance,
    Convection,
    Lump,
    MetalContact,
    Reservoir,
    ThermalContact,
)

R = 0.59
R_B = 0.64
J = 300.0
N = 4
BETA = math.radians(45.0)
AREA = 0.03
RIM = 4e3
LININGS = 600.0
BAND = 900.0
CONTACT = 40.0
BEHIND = 25.0
GAP = 3.0
OPENS_AT = 20.0
END = 50.0
START = np.array([420.0, 350.0, 300.0])


def brake(staged, angles=BETA, area=AREA):
    bandage = (
        sb.Bandage(20.0, sb.ConstantFriction(0.3), 500.0, area) if staged else None
    )
    linings = sb.Lining(0.35, np.broadcast_to(angles, N), area)
    return sb.Brake(sb.Pulley(R, J), sb.Band(R_B), linings, bandage)


def network(staged, links, count=1):
    """Three lumps; links as they are, but for those that `with_external_pair`
    changes."""
    bodies = (
        Lump("rim", RIM, START[0]),
        Lump("linings", LININGS, START[1], count=count),
        Lump("band", BAND, START[2]),
        Reservoir("air", 290.0),
    )
    pair = sb.thermal.FrictionHeat("rim", "linings", 0.5)
    heat = sb.Heat(bodies, links, pair, rim="rim", linings="linings", band="band")
    return (
        sb.thermal.with_external_pair(heat, sb.thermal.ConstantPartition(0.5))
        if staged
        else heat
    )


def at_rest(staged, heat, lever, end=END, **parts):
    load = sb.TorqueLoad(0.0)
    return sb.Scene(
        brake(staged, **parts), sb.Duty(lever, load), sb.Initial(0.0), end, heat
    )


def exchange(*pairs):
    """Rates of rim, linings and band per kelvin under links `(a, b, g)`."""
    A = np.zeros((3, 3))
    for a, b, g in pairs:
        A[a, a], A[a, b], A[b, b], A[b, a] = (
            A[a, a] - g,
            A[a, b] + g,
            A[b, b] - g,
            A[b, a] + g,
        )
    return A / np.array([RIM, LININGS, BAND])[:, None]


@pytest.mark.slow
@pytest.mark.parametrize("staged", [False, True])
def test_a_contact_is_opened_by_the_lever(staged):
    """Standard brake: rim and linings part; staged brake: linings and band, and the
    linings stay on the rim."""
    gap = "linings", "band" if staged else "rim"
    links = (
        ThermalContact("rim", "linings", 0.1, 0.1 / CONTACT, opens=True),
        Conductance("linings", "band", BEHIND),
        Convection(gap[0], 0.1, GAP / 0.1, gap[1], covered=1.0),
    )
    lever = sb.PiecewiseLinear([0.0, OPENS_AT, OPENS_AT, END], [2e3, 2e3, 0.0, 0.0])
    result = sb.simulate(at_rest(staged, network(staged, links), lever), rtol=1e-12)
    assert names_of(result) == ["release"]
    both = [(0, 1, CONTACT), (1, 2, BEHIND)]
    left = [both[0], (1, 2, GAP)] if staged else [(0, 1, GAP), both[1]]
    t = np.array([5.0, OPENS_AT, 30.0, END])
    closed = [expm(exchange(*both) * min(x, OPENS_AT)) @ START for x in t]
    exact = [
        expm(exchange(*left) * max(x - OPENS_AT, 0.0)) @ T
        for x, T in zip(t, closed, strict=True)
    ]
    all_near(result.series(t).temperature, exact, 1e-10)
    capacities = np.array([RIM, LININGS, BAND])
    near(result.end_temperatures @ capacities, START @ capacities, 1e-13)


@pytest.mark.slow
def test_derivatives_of_a_contact_that_opens():
    def end(x):
        resistance, opens_at = x
        contact = ThermalContact("rim", "linings", 0.1, resistance, opens=True)
        lever = sb.PiecewiseLinear([0.0, opens_at, opens_at, END], [2e3, 2e3, 0.0, 0.0])
        scene = at_rest(
            False,
            network(False, (contact, Conductance("linings", "band", BEHIND))),
            lever,
        )
        return sb.simulate(
            scene, rtol=1e-12, solver=sb.hybrid.Rodas5P()
        ).end_temperatures

    closed = exchange((0, 1, CONTACT), (1, 2, BEHIND))
    left = exchange((1, 2, BEHIND))
    value, forward = jax.jit(lambda x: (end(x), jax.jacfwd(end)(x)))(
        jnp.array([0.1 / CONTACT, OPENS_AT])
    )
    before = expm(closed * OPENS_AT) @ START
    after = expm(left * (END - OPENS_AT))
    all_near(value, after @ before, 1e-10)
    all_near(forward[:, 1], after @ (closed - left) @ before, 1e-7)
    # of exp(A t) in the direction B = ∂A/∂R_c: the upper right block of exp([[A, B],
    # [0, A]] t)
    slope = exchange((0, 1, -(CONTACT**2) / 0.1))
    block = expm(np.block([[closed, slope], [np.zeros((3, 3)), closed]]) * OPENS_AT)[
        :3, 3:
    ]
    all_near(forward[:, 0], after @ block @ START, 1e-7)


def yovanovich(p):
    """Steel (two roughnesses) on bronze."""
    k = 2 * 45.0 * 60.0 / (45.0 + 60.0)
    m = math.hypot(0.12, 0.2)
    sigma = math.hypot(1.1e-6, 2.3e-6)
    return 1.25 * k * m / sigma * (p / 1.4e9) ** 0.95


METALS = MetalContact([45.0, 60.0], [0.12, 0.2], [1.1e-6, 2.3e-6], 1.4e9)


def test_conductance_of_metals_by_pressure():
    for p in (1e5, 1e6, 2e7):
        # the law that is smooth at 0 is below the power by (1 + (ε H/p)²)^(-0.025)
        smooth = (1 + (1.4e3 / p) ** 2) ** -0.025
        heat = sb.Heat(
            (
                sb.thermal.Wall("w", sb.material("steel_20L"), 0.01, 2.0, 2),
                Reservoir("hot", 500.0),
                Reservoir("air"),
            ),
            (
                ThermalContact("hot", "w.front", 2.0, law=METALS, opens=True),
                Convection("w.back", 2.0, 300.0),
            ),
        )
        T = sb.steady_state(heat, closed=1.0, pressure=p)
        flow = 600.0 * (500.0 - sb.thermal.ROOM)
        flow /= 1 + 300.0 * (
            1 / (yovanovich(p) * smooth) + 0.01 / sb.material("steel_20L").conductivity
        )
        half = 0.0025 / (sb.material("steel_20L").conductivity * 2.0)
        near(T["w[1]"], 500.0 - flow * (1 / (2 * yovanovich(p) * smooth) + half), 1e-10)
    slope = jax.grad(METALS.conductance)(jnp.asarray(0.0))
    k = 2 * 45.0 * 60.0 / 105.0
    m = math.hypot(0.12, 0.2)
    sigma = math.hypot(1.1e-6, 2.3e-6)
    near(slope, 1.25 * k * m / sigma / 1.4e9 * 1e-6**-0.05, 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("staged", [False, True])
def test_linings_conduct_by_their_pressure(staged):
    """A pulley at rest without a load: every tension is `T_0`,
    `N_i = 2 T_0 sin(β_i/2)`, on the rim `+ N_pre`."""
    angles = np.radians([30.0, 40.0, 50.0, 60.0])
    area = np.array([0.02, 0.03, 0.035, 0.045])
    law = MetalContact(50.0, 0.15, 40e-6, 3e9)
    contact = ThermalContact("rim", "linings", 0.2, law=law, opens=True)
    heat = network(staged, (contact, Conductance("linings", "band", 0.0)), count=N)
    for force in (1e3, 4e3, 16e3):
        scene = at_rest(staged, heat, sb.Constant(force), angles=angles, area=area)
        result = sb.simulate(scene, rtol=1e-12)
        p = (2 * force * np.sin(angles / 2) + (500.0 if staged else 0.0)) / area
        x = p / 3e9
        g = 0.2 * 1.25 * 50.0 * 0.15 / 40e-6 * x * (x**2 + 1e-12) ** -0.025
        A = np.zeros((N + 1, N + 1))
        A[0, 0] = -g.sum() / RIM
        A[0, 1:] = g / RIM
        A[1:, 0] = g / LININGS
        A[1:, 1:] = -np.diag(g) / LININGS
        exact = expm(A * END) @ np.array([START[0], *np.full(N, START[1])])
        all_near(result.series([END]).temperature[0, : N + 1], exact, 1e-10)
        assert abs(exact[1] - START[1]) > 1.0
