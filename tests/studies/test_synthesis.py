"""The parametric synthesis: by hand, by independent root finding and integration."""

import dataclasses
import math
import runpy

import numpy as np
import pytest
from helpers import all_near, input_error, near
from scipy.integrate import quad
from scipy.optimize import brentq, root
from scipy.special import erfc
from synthesis_by_hand import by_hand

import simbrake as sb

STEEL = sb.material("steel_20L")
LINING = sb.material("FK-24A")
WARMER = sb.material("steel_20L", conductivity_slope=-6e-4, specific_heat_slope=1.0e-3)


@pytest.fixture(scope="module")
def u2_5_5(scenarios):
    return runpy.run_path(str(scenarios / "u2_5_5_stop.py"))["scene"]()


@pytest.fixture(scope="module")
def classical(u2_5_5):
    return sb.synthesize(
        u2_5_5,
        sb.formulas.EstimateData(
            track_area=2 * sb.formulas.polished_surface(0.590, 0.220)
        ),
    )


def hard(scene):
    """From 60 rad/s: the rim passes 150 °C in one braking."""
    return dataclasses.replace(scene, initial=sb.Initial(60.0))


# --- the chain by hand --------------------------------------------------------------


def test_the_chain_of_the_u2_5_5_by_hand(classical):
    for name, value in by_hand().items():
        assert classical[name].value == pytest.approx(value, rel=1e-12), name


def test_layers_of_a_stop(classical):
    """Heat does not reach the back: Schmidt's scheme against the closed form and its
    energy."""
    face = classical["surface temperature, falling flux"].value
    near(classical["maximum face temperature"].value, face, abs=5e-3 * (face - 293.15))
    near(classical["rim at the end, back"].value, 293.15, abs=1e-2)
    end = sb.formulas.stopping_rise(
        2 * 430460.0, 0.95001, 0.95001, float(STEEL.effusivity)
    )
    near(classical["rim at the end, face"].value - 293.15, end, 1e-2)


def test_transmission_replaces_a_scenes_law(u2_5_5):
    found = sb.synthesize(u2_5_5, partition=sb.formulas.transmission_table())
    near(
        found["heat partition coefficient, rim"].value,
        found["heat partition coefficient, rim, transmission"].value,
    )
    with input_error(match="beside a law"):
        sb.synthesize(
            u2_5_5,
            sb.formulas.EstimateData(share=0.9),
            partition=sb.formulas.transmission_table(),
        )


def test_only_heat_of_friction_work_warms(u2_5_5, classical):
    data = sb.formulas.EstimateData(
        track_area=2 * sb.formulas.polished_surface(0.590, 0.220),
        power=sb.thermal.shares_of_S(),
    )
    found = sb.synthesize(u2_5_5, data)
    for name in (
        "mean bulk temperature, rim",
        "mean bulk temperature, lining",
        "rim at the end, face",
    ):
        assert found[name].value - 293.15 == pytest.approx(
            0.68 * (classical[name].value - 293.15)
        ), name
    for name in (
        "heat into the rim",
        "thermal stress, surface",
        "thickness that holds the heat, braking",
    ):
        assert found[name].value == pytest.approx(0.68 * classical[name].value), name
    assert found["friction work"].value == classical["friction work"].value


# --- properties at temperature ------------------------------------------------------


def bulk_rise(T, share, W, A, tau, material, thickness=0.025):
    """Mean bulk rise with properties at T, in terms of the half-space and of the
    slab."""
    factor_k = 1 + float(material.conductivity_slope or 0.0) * (T - 293.15)
    factor_c = 1 + float(material.specific_heat_slope or 0.0) * (T - 293.15)
    conductivity = float(material.conductivity) * factor_k
    capacity = float(material.specific_heat) * factor_c
    density = float(material.density)
    depth = min(1.73 * math.sqrt(conductivity * tau / (density * capacity)), thickness)
    return 2 / 3 * share * W / (capacity * density * A * depth)


@pytest.mark.parametrize("thickness", [0.025, 0.004])
def test_property_temperature_is_a_root(u2_5_5, thickness):
    """Heat that stays in the rim, and heat that passes through it; the root by
    bracketing."""
    data = sb.formulas.EstimateData(
        rim=WARMER, share=0.9, track_area=0.35, rim_thickness=thickness
    )
    found = sb.synthesize(hard(u2_5_5), data)
    stop = sb.formulas.classical_stop(hard(u2_5_5))
    truth = brentq(
        lambda T: (
            293.15
            + bulk_rise(T, 0.9, stop.work, 0.35, stop.time, WARMER, thickness)
            - T
        ),
        300.0,
        1500.0,
        xtol=1e-12,
    )
    assert found.replaced == ("rim", "lining")
    assert found.rounds > 2
    near(found["mean bulk temperature, rim, refined"].value, truth, 1e-11)
    cold = sb.synthesize(u2_5_5, data)["mean bulk temperature, rim, refined"].value
    assert (
        cold == sb.synthesize(u2_5_5, data)["mean bulk temperature, rim"].value < 423.15
    )  # of room temperature
    first = 293.15 + bulk_rise(
        293.15, 0.9, stop.work, 0.35, stop.time, WARMER, thickness
    )
    near(found["mean bulk temperature, rim"].value, first, 1e-12)
    near(found["conductivity, rim"].value, 47.8 * (1 - 6e-4 * (first - 293.15)))
    near(found["temperature of the properties, rim"].value, first)
    assert abs(truth - first) > 5.0


def test_rim_and_lining_settle_together(u2_5_5):
    """Two equations with two unknowns, by scipy's `root`."""
    lining = sb.material("FK-24A", specific_heat_slope=1e-3, conductivity_slope=5e-4)
    data = sb.formulas.EstimateData(rim=WARMER, lining=lining, track_area=0.35)
    found = sb.synthesize(hard(u2_5_5), data)
    stop = sb.formulas.classical_stop(hard(u2_5_5))

    def effusivity(material, T):
        product = float(
            material.conductivity * material.density * material.specific_heat
        )
        for slope in (material.conductivity_slope, material.specific_heat_slope):
            product *= 1 + float(slope) * (T - 293.15)
        return math.sqrt(product)

    def rest(T):
        share = effusivity(WARMER, T[0]) / (
            effusivity(WARMER, T[0]) + effusivity(lining, T[1])
        )
        rim = bulk_rise(T[0], share, stop.work, 0.35, stop.time, WARMER)
        other = bulk_rise(T[1], 1 - share, stop.work, 0.75 * 0.35, stop.time, lining)
        return [293.15 + rim - T[0], 293.15 + other - T[1]]

    truth = root(rest, [500.0, 560.0], tol=1e-13)
    assert truth.success
    names = (
        "mean bulk temperature, rim, refined",
        "mean bulk temperature, lining, refined",
    )
    all_near([found[name].value for name in names], truth.x, 1e-10)


def test_falling_capacity_runs_away(u2_5_5):
    """T − T_0 = K/(1 − b (T − T_0)) has a solution while K b ≤ 1/4 (heat through a thin
    rim)."""
    stop = sb.formulas.classical_stop(hard(u2_5_5))
    K = bulk_rise(293.15, 0.9, stop.work, 0.35, stop.time, STEEL, 0.004)

    def found(slope, **options):
        steel = sb.material("steel_20L", specific_heat_slope=-slope)
        data = sb.formulas.EstimateData(
            rim=steel, share=0.9, track_area=0.35, rim_thickness=0.004
        )
        return sb.synthesize(hard(u2_5_5), data, **options)

    b = 0.9 / (4 * K)
    lower = (1 - math.sqrt(1 - 4 * b * K)) / (2 * b)
    rise = found(b)["mean bulk temperature, rim, refined"].value - 293.15
    near(rise, lower, 1e-9)
    with pytest.raises(
        sb.formulas.SynthesisError, match="specific heat of the rim"
    ) as error:
        found(1.1 / (4 * K))
    assert error.value.code == "material_range"
    with pytest.raises(sb.formulas.SynthesisError, match="after 5 rounds") as error:
        found(b, rounds=5)
    assert error.value.code == "no_convergence"


# --- rational thickness -------------------------------------------------------------


def test_heat_reaches_back_of_rational_rim():
    found = sb.formulas.rational_rim_thickness(STEEL, 1.25, heat=8e5, rise=300.0)
    near(
        sb.formulas.fourier_number(float(STEEL.diffusivity), 1.25, found.depth),
        1 / 1.73**2,
    )
    near(found.storage * float(STEEL.density * STEEL.specific_heat) * 300.0, 8e5)
    assert found.rational == found.depth
    # S's criterion beside the slab: by then the back has risen by 26 % of the face, and
    # half as deep by 52 % of it
    face, back = (
        sb.formulas.slab_rise(1e5, 1.25, found.depth, STEEL, x)
        for x in (0.0, found.depth)
    )
    near(back / face, 0.264, abs=2e-3)
    stored = sb.formulas.rational_rim_thickness(STEEL, 1.25, heat=8e7, rise=300.0)
    assert stored.rational == stored.storage == pytest.approx(100 * found.storage)
    assert (
        sb.formulas.rational_rim_thickness(STEEL, 1.25, heat=8e5, rise=0.0).rational
        == math.inf
    )


def test_the_back_of_a_held_slab():
    """Series and images meet; against two images of the half-space."""
    rise = sb.formulas.held_face_rise
    early = 2 * math.sqrt(0.05)
    close = 2 * (erfc(1 / early) - erfc(3 / early))
    near(rise(0.05), close, 1e-12)
    near(rise(0.2 * (1 - 1e-12)), rise(0.2 * (1 + 1e-12)), 1e-10)
    assert (rise(0.0), rise(20.0)) == (0.0, pytest.approx(1.0, abs=1e-15))


def test_a_rational_lining():
    given = {"face": 600.0, "back": 393.15, "start": 293.15}
    found = sb.formulas.rational_lining_thickness(LINING, 1500.0, **given)
    back = sb.formulas.back_temperature(
        LINING, found.insulation, 1500.0, face=600.0, start=293.15
    )
    near(back, 393.15, abs=1e-9)
    Fo = brentq(
        lambda Fo: sb.formulas.held_face_rise(Fo) - 100.0 / 306.85,
        0.05,
        2.0,
        xtol=1e-14,
    )
    near(found.insulation, math.sqrt(3.68e-7 * 1500.0 / Fo), 1e-10)
    assert found.rational == max(found.insulation, found.depth)
    cool = sb.formulas.rational_lining_thickness(
        LINING, 1500.0, **{**given, "face": 390.0}
    )
    assert cool.insulation == 0.0
    assert cool.rational == cool.depth
    warm = sb.formulas.rational_lining_thickness(
        LINING, 1500.0, **{**given, "start": 393.15, "face": 500.0}
    )
    assert warm.rational == math.inf
    thin = sb.formulas.back_temperature(
        LINING, 0.5 * found.insulation, 1500.0, face=600.0, start=293.15
    )
    assert thin > 393.15 + 50.0


def test_heat_content_integrates_capacity():
    truth = quad(lambda T: 7850.0 * 534.1 * (1 + 1e-3 * (T - 293.15)), 310.0, 480.0)[0]
    found = sb.formulas.heat_content(WARMER, np.array([310.0]), np.array([480.0]))
    near(found[0], truth, 1e-13)
