"""Engineering formulas: closed forms, quadrature, printed tables, and Schmidt's scheme
against all of them."""

import math

import numpy as np
import pytest
from helpers import all_near, near
from scipy.integrate import quad

import simbrake as sb

STEEL = sb.material("steel_20L")
A = float(STEEL.diffusivity)
E = float(STEEL.effusivity)


def test_depth_has_fourier_number_one_third():
    depth = sb.formulas.penetration_depth(A, 2.0)
    # 1.73² = 2.9929
    near(sb.formulas.fourier_number(A, 2.0, depth), 1 / 3, 3e-3)
    assert sb.formulas.effective_fourier_number(A, 2.0, 1.01 * depth) == 1 / 3
    near(sb.formulas.effective_fourier_number(A, 2.0, 0.5 * depth), 4 / 1.73**2)
    all_near(
        sb.formulas.effective_volume(2.0, 0.025, np.array([0.01, 0.03])), [0.02, 0.05]
    )


def test_bulk_rise_is_mean_for_falling_power():
    mean = quad(lambda s: 2 * s - s**2, 0.0, 1.0)[0]
    near(
        sb.formulas.mean_bulk_rise(0.9, 8e5, 534.0, 80.0),
        mean * 0.9 * 8e5 / (534.0 * 80.0),
        1e-14,
    )


def test_surface_of_a_stop_by_duhamel():
    q = 4e5
    tau = 1.3
    for t in (0.2, tau / 2, tau):
        # dT = q(s) ds/(e √(π (t − s))), with t − s = u²
        truth = quad(
            lambda u, t=t: 2 * q * (1 - (t - u**2) / tau) / (E * math.sqrt(math.pi)),
            0.0,
            math.sqrt(t),
        )[0]
        near(sb.formulas.stopping_rise(q, t, tau, E), truth, 1e-12)
    times = np.linspace(0.0, tau, 1001)
    top = np.max(sb.formulas.stopping_rise(q, times, tau, E))
    near(top, 2 / 3 * sb.formulas.half_space_rise(q, tau / 2, E), 1e-14)


def test_slab_at_first_and_in_the_end():
    q = 3e5
    thickness = 0.025
    early = 0.02 * thickness**2 / A
    near(
        sb.formulas.slab_rise(q, early, thickness, STEEL),
        sb.formulas.half_space_rise(q, early, E),
        1e-9,
    )
    late = 3.0 * thickness**2 / A
    conductivity = float(STEEL.conductivity)
    x = np.linspace(0.0, thickness, 6)
    shape = 3.0 + 0.5 * (1 - x / thickness) ** 2 - 1 / 6
    found = sb.formulas.slab_rise(q, late, thickness, STEEL, x)
    all_near(found, q * thickness / conductivity * shape, 1e-12)
    assert sb.formulas.slab_rise(q, 0.0, thickness, STEEL) == 0.0
    times = np.array([0.02 * (1 - 1e-9), 0.02 * (1 + 1e-9)]) * thickness**2 / A
    for depth in (0.0, 0.1 * thickness, thickness):  # images and series meet
        before, after = sb.formulas.slab_rise(q, times, thickness, STEEL, depth)
        near(before, after, 1e-7, 1e-9 * q * thickness / conductivity)


def test_slab_surface_of_a_stop_by_duhamel():
    """Over the rise under a constant flux; also where images take over."""
    q = 4e5
    tau = 2.2
    for Fo, t in ((1e-3, 0.7), (0.05, 0.6), (3.0, 0.9)):
        D = math.sqrt(A * tau / Fo)
        past = quad(
            lambda s, D=D: float(sb.formulas.slab_rise(q / tau, s, D, STEEL)),
            0.0,
            t * tau,
            epsabs=0,
            limit=200,
        )
        truth = sb.formulas.slab_rise(q, t * tau, D, STEEL) - past[0]
        near(sb.formulas.stopping_slab_rise(q, t * tau, tau, D, STEEL), truth, 1e-9)


RISES = sb.formulas.stopping_slab_rise, sb.formulas.reconstructed_surface_rise


def test_s_24_with_the_term_for_a_zero_start():
    q = 4e5
    tau = 2.2
    thickness = 0.012
    Fo = A * tau / thickness**2
    unit = q * thickness / (2 * float(STEEL.conductivity))
    n = np.arange(1, 200_001)
    for s in (0.0, 0.1, 0.5, 1.0):
        third = (
            2
            / math.pi**2
            * 2
            * (1 - s)
            * np.sum(np.exp(-(n**2) * math.pi**2 * Fo * s) / n**2)
        )
        truth = unit * (2 * (1 - s) / 3 + Fo * (2 * s - s**2) - third)
        found = sb.formulas.reconstructed_surface_rise(
            q, s * tau, tau, thickness, STEEL
        )
        # the tail of the sum at s = 0
        near(found, truth, abs=3e-6 * unit)
    ends = [rise(q, 10 * tau, 10 * tau, thickness, STEEL) for rise in RISES]
    near(ends[0] - ends[1], unit * 2 / (450 * Fo), 1e-5)
    for rise in RISES:
        with pytest.raises(ValueError, match="after the end"):
            rise(q, 1.1 * tau, tau, thickness, STEEL)


# --- Schmidt's scheme ---------------------------------------------------------------


def test_schmidt_is_a_random_walk_in_depth():
    """Each step puts q Δx/(2 λ) into the first layer, from where it walks and is
    reflected at the face."""
    q = 2e5
    m = 40
    step = 0.5e-3
    course = sb.formulas.schmidt(STEEL, 400 * step, 400, m * step**2 / (2 * A), q)
    once = q * step / (2 * float(STEEL.conductivity))
    walks = sum(math.comb(s, (s + 1) // 2) / 2**s for s in range(m))
    near(course.temperature[m, 1], once * walks, 1e-12)
    near(course.temperature[m, 0], once * (walks + 1), 1e-12)
    near(course.temperature[m, 0], sb.formulas.half_space_rise(q, course.t[m], E), 1e-2)


def test_schmidt_is_of_second_order_on_slab():
    q = 2e5
    thickness = 0.025
    end = 0.5 * thickness**2 / A  # a whole number of steps for every N below
    errors = []
    for layers in (8, 16, 32, 64):
        course = sb.formulas.schmidt(STEEL, thickness, layers, end, q)
        near(course.t[-1], end, 1e-12)
        truth = sb.formulas.slab_rise(q, end, thickness, STEEL, course.depth)
        errors.append(float(np.max(np.abs(course.temperature[-1] - truth))))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    all_near(orders, 2.0, atol=0.1)
    assert errors[-1] < 1e-3 * sb.formulas.slab_rise(q, end, thickness, STEEL)


def test_schmidt_keeps_every_joule():
    course = sb.formulas.schmidt(
        STEEL, 0.025, 20, 3.0, lambda t0, t1: 1e5 * (t0 + t1) / 2
    )
    gained = 0.5 * 1e5 * course.t**2
    stored = course.mean * float(STEEL.density * STEEL.specific_heat) * 0.025
    all_near(stored, gained, 1e-12, 1e-6)


@pytest.mark.slow
def test_schmidt_beside_the_layered_rim():
    """Adaptive steps of a network and halving by hand come to the same layers, with
    second order in their thickness."""
    q = 3e5
    thickness = 0.025
    ts = np.array([0.0, 0.5 * 0.025**2 / A])
    apart = []
    for layers in (10, 20):
        wall = sb.thermal.Wall("rim", STEEL, thickness, 1.0, layers, temperature=300.0)
        heat = sb.Heat(
            (wall, sb.thermal.Reservoir("air", 300.0)),
            (sb.thermal.Convection("rim.back", 1.0, 40.0),),
            None,
            (sb.thermal.Source("rim.front", q),),
        )
        network = np.asarray(sb.simulate_heat(heat, ts).temperature[-1])
        course = sb.formulas.schmidt(
            STEEL,
            thickness,
            layers,
            ts[-1],
            q,
            start=300.0,
            back_coefficient=40.0,
            ambient=300.0,
        )
        apart.append(np.max(np.abs(network - course.temperature[-1, 1:-1])))
    assert apart[1] < 1e-3 * np.ptp(network)
    near(apart[0] / apart[1], 4.0, 0.15)


# --- thermal stress -----------------------------------------------------------------

ELASTIC = sb.formulas.ElasticMaterial(2.0e11, 12e-6, 0.3, 150e6)
MODULUS = 2.0e11 * 12e-6 / 0.7


def test_stress_of_a_linear_profile():
    z = np.linspace(0.0, 0.025, 11)
    T = 400.0 - 100.0 * z / 0.025
    all_near(
        sb.formulas.plate_stress(T, z, ELASTIC, restraint="none"),
        0.0,
        atol=1e-12 * MODULUS * 100,
    )
    held = sb.formulas.plate_stress(T, z, ELASTIC)
    near(held[0], -MODULUS * 50.0)
    near(held[-1], MODULUS * 50.0)
    near(sb.formulas.surface_stress(400.0, 350.0, ELASTIC), held[0])
    near(
        sb.formulas.plate_stress(T - 300.0, z, ELASTIC, restraint="all")[0],
        -MODULUS * 100.0,
    )


def test_stress_of_a_parabolic_profile():
    """T = T_0 (1 − y²/c²): σ = E' T_0 (2/3 − 1 + y²/c²) (Timoshenko & Goodier §132),
    with second order."""
    c = 0.0125
    T_0 = 80.0
    errors = []
    for n in (50, 100):
        y = np.linspace(-c, c, n + 1)
        truth = MODULUS * T_0 * (2 / 3 - 1 + y**2 / c**2)
        for restraint in ("none", "bending"):  # symmetric: it does not bend
            found = sb.formulas.plate_stress(
                T_0 * (1 - y**2 / c**2), y, ELASTIC, restraint=restraint
            )
            all_near(found, truth, atol=1e-3 * MODULUS * T_0)
        errors.append(np.max(np.abs(found - truth)))
    near(errors[0] / errors[1], 4.0, 0.01)


# --- equivalents, surfaces, balance, shares of the power ----------------------------


def test_parts_in_a_row_give_the_total_of_v1():
    shell = sb.thermal.axial_resistance(0.220, 47.8, 0.565, 0.590)
    parts = [
        (0.035, 0.420, 0.565),
        (0.025, 0.565, 0.615),
        (0.025, 0.575, 0.615),
        (0.025, 0.575, 0.590),
    ]
    rings = [sb.thermal.radial_resistance(width, 47.8, r, R) for width, r, R in parts]
    near(sb.formulas.series_resistance(shell, *rings), 0.102, abs=1e-3)
    near(sb.formulas.parallel_resistance(2.0, 2.0, 1.0), 0.5)
    d = np.array([30e-3, 6e-3])
    k = np.array([0.736, 53.94])
    near(d.sum() / sb.formulas.series_conductivity(d, k), np.sum(d / k))
    near(sb.formulas.parallel_conductivity([1.0, 3.0], [10.0, 50.0]), 40.0)
    near(sb.formulas.equivalent_specific_heat([1.0, 3.0], [400.0, 800.0]), 700.0)
    near(sb.formulas.equivalent_density([2.0, 3.0], [1e-3, 4e-3]), 1000.0)


def test_heat_balance_over_four_revolutions():
    given = {
        "overlap": 0.75,
        "coefficient": 60.0,
        "ambient": 293.15,
        "omega": 12.0,
        "area": 0.8,
    }
    found = sb.formulas.heat_balance(4e4, surface=450.0, **given)
    near(found.time, 8 * math.pi / 12.0)
    near(found.mean_flux, 0.75 * 4e4 - 0.25 * 60.0 * (450.0 - 293.15))
    near(found.net, found.mean_flux * 0.8 * found.time)
    still = sb.formulas.heat_balance(4e4, surface=found.stationary, **given)
    near(still.net, 0.0, abs=1e-9 * found.gained)
    assert (
        sb.formulas.heat_balance(
            4e4, surface=450.0, **{**given, "overlap": 1.0}
        ).stationary
        == math.inf
    )
