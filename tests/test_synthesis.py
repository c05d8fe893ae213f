"""The parametric synthesis: by hand, by independent root finding and integration, beside runs, and as a command."""

import dataclasses
import json
import math
import pathlib
import re
import runpy

import numpy as np
import pytest
from heat_scenes import layered_stop
from helpers import stop_scene
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, root
from scipy.special import erfc

import simbrake as sb
from simbrake._classical._given_numbers import read_given
from simbrake._classical._property_iteration import SynthesisError
from simbrake._classical._wall_course import heat_content
from simbrake._commands._cli import main

STEEL = sb.material("steel_20L")
LINING = sb.material("FK-24A")
WARMER = sb.material("steel_20L", conductivity_slope=-6e-4, specific_heat_slope=1.0e-3)


@pytest.fixture(scope="module")
def u2_5_5(scenarios):
    return runpy.run_path(str(scenarios / "u2_5_5_stop.py"))["scene"]()


@pytest.fixture(scope="module")
def classical(u2_5_5):
    return sb.synthesize(u2_5_5, sb.EstimateData(track_area=2 * sb.polished_surface(0.590, 0.220)))


def hard(scene):
    """From 60 rad/s: the rim passes 150 °C in one braking."""
    return dataclasses.replace(scene, initial=sb.Initial(60.0))


# --- the chain by hand ------------------------------------------------------------------------------------------------


def by_hand():
    """Steps 1 to 5 and 12 of the U2-5-5 stop from its printed numbers alone."""
    z = math.tan(math.radians(270.0 / 20) / 2)
    ratio = ((1 + 0.35 * z) / (1 - 0.35 * z)) ** 20
    torque = 0.623 * 24e3 * (ratio - 1)
    load = 60e3 * 9.80665 * 0.4 / 8
    inertia = 1200.0 + 60e3 * (0.4 / 8) ** 2
    time = inertia * 24.0 / (torque - load)
    work = torque * 24.0 * time / 2
    a, a_l = 47.8 / (7850.0 * 534.1), 0.736 / (2000.0 * 1000.0)
    e, e_l = math.sqrt(47.8 * 7850.0 * 534.1), math.sqrt(0.736 * 2000.0 * 1000.0)
    b, b_l, share = 1.73 * math.sqrt(a * time), 1.73 * math.sqrt(a_l * time), e / (e + e_l)
    track = 2 * 2 * math.pi * 0.590 * 0.220
    rim = 293.15 + 2 / 3 * share * work / (534.1 * 7850.0 * track * b)
    lining = 293.15 + 2 / 3 * (1 - share) * work / (1000.0 * 2000.0 * 0.75 * track * b_l)
    return {
        "depth of heat, rim": b,
        "depth of heat, lining": b_l,
        "depth of heat, band": 1.73 * math.sqrt(53.94 / (7850.0 * 480.0) * time),
        "Fourier number, rim": 1 / 3,
        "Fourier number, band": 53.94 / (7850.0 * 480.0) * time / 0.006**2,
        "effective volume, rim": track * b,
        "effective volume, band": 0.75 * track * 0.006,  # heat reaches through it
        "share into the rim": share,
        "share into the linings": 1 - share,
        "mean bulk temperature, rim": rim,
        "mean bulk temperature, lining": lining,
        "mean bulk temperature, rim, refined": rim,  # below 150 °C nothing is replaced
        "heat into the rim": share * work,
        "tension ratio": ratio,
        "brake torque": torque,
        "stopping time": time,
        "stopping angle": 24.0 * time / 2,
        "friction work": work,
        "tight tension, greatest": ratio * 24e3,
        "friction travel": 0.623 * 24.0 * time / 2,
        "hook travel": 0.4 / 8 * 24.0 * time / 2,
        "energy load of the linings": work / (0.75 * track),
        "power load of the linings, mean": work / (0.75 * track * time),
        "greatest gradient at the face": 2 * share * work / (track * time) / 47.8,
        "thickness that heat reaches, rim": b,
        "thickness that holds the heat, braking": share * work / track / (7850.0 * 534.1 * 380.0),
    }


def test_the_chain_of_the_u2_5_5_by_hand(classical):
    for name, value in by_hand().items():
        assert classical[name].value == pytest.approx(value, rel=1e-12), name


def test_every_step_has_figures_with_numbers_and_source(classical):
    assert sorted({row.step for row in classical}) == list(range(1, 13))
    steps = [row.step for row in classical]
    assert steps == sorted(steps)
    assert {row.simulated for row in classical} == {None}
    names = [row.name for row in classical]
    assert len(names) == len(set(names))
    assert all(row.formula and row.unit for row in classical)
    depth = classical.step(1)[0]
    assert [str(number) for number in depth.numbers] == ["a = 1.1401e-05 m^2/s", "τ = 0.95001 s"]
    assert classical.rounds == 0
    assert classical.replaced == ()
    with pytest.raises(KeyError, match="no figure 'colour'"):
        classical["colour"]


def test_what_a_formula_shows_gives_its_value(classical):
    """Values recomputed from the numbers that the report prints beside them."""
    n = {row.name: {number.symbol: number.value for number in row.numbers} for row in classical}
    x = n["mean bulk temperature, rim"]
    assert x["T"] + 2 / 3 * x["α"] * x["W"] / (x["c"] * x["G"]) == classical["mean bulk temperature, rim"].value
    x = n["maximum temperature, S-26"]
    assert x["T"] + x["t_s"] + x["t_f"] / 3 == pytest.approx(classical["maximum temperature, S-26"].value)
    x = n["maximum temperature, S-27"]
    found = classical["maximum temperature, S-27"].value
    assert x["T"] + x["t_v"] + x["t_s"] / 3 + x["t_f"] / 3 == pytest.approx(found)
    x, h = n["mean flux kept"], sb.radiation_coefficient(0.8, 293.15, 293.15)
    loss = (1 - x["κ"]) * (x["h"] + h) * (x["T"] - x["T_a"])
    assert x["κ"] * x["q_1"] - loss == pytest.approx(classical["mean flux kept"].value)
    x = n["heat gained in it"]
    time = classical["time of four revolutions"].value
    assert x["q_1"] * x["A_a"] * x["κ"] * time == pytest.approx(classical["heat gained in it"].value)
    x = n["thickness that holds the heat, braking"]
    assert x["Q"] / (x["ρ c"] * x["ΔT_p"]) == classical["thickness that holds the heat, braking"].value


def test_layers_of_a_stop_are_those_of_a_half_space_under_falling_power(classical):
    """Heat does not reach the back: Schmidt's scheme against the closed form and its energy."""
    face = classical["surface temperature, falling flux"].value
    assert classical["greatest face temperature"].value == pytest.approx(face, abs=5e-3 * (face - 293.15))
    assert classical["rim at the end, back"].value == pytest.approx(293.15, abs=1e-2)
    end = sb.stopping_rise(2 * 430460.0, 0.95001, 0.95001, float(STEEL.effusivity))
    assert classical["rim at the end, face"].value - 293.15 == pytest.approx(end, rel=1e-2)


def test_transmission_may_stand_for_the_scenes_law(u2_5_5):
    from simbrake._classical._reproduce import transmission_table

    found = sb.synthesize(u2_5_5, partition=transmission_table())
    assert found["share into the rim"].value == pytest.approx(found["share into the rim, transmission"].value)
    with pytest.raises(sb.InputError, match="beside a law"):
        sb.synthesize(u2_5_5, sb.EstimateData(share=0.9), partition=transmission_table())


def test_only_the_heat_of_the_friction_work_warms(u2_5_5, classical):
    data = sb.EstimateData(track_area=2 * sb.polished_surface(0.590, 0.220), power=sb.shares_of_S())
    found = sb.synthesize(u2_5_5, data)
    for name in ("mean bulk temperature, rim", "mean bulk temperature, lining", "rim at the end, face"):
        assert found[name].value - 293.15 == pytest.approx(0.68 * (classical[name].value - 293.15)), name
    for name in ("heat into the rim", "thermal stress, surface", "thickness that holds the heat, braking"):
        assert found[name].value == pytest.approx(0.68 * classical[name].value), name
    assert found["friction work"].value == classical["friction work"].value


# --- properties at temperature ----------------------------------------------------------------------------------------


def bulk_rise(T, share, W, A, tau, material, thickness=0.025):
    """Mean bulk rise with properties at T, in terms of the half-space and of the slab."""
    factor_k = 1 + float(material.conductivity_slope or 0.0) * (T - 293.15)
    factor_c = 1 + float(material.specific_heat_slope or 0.0) * (T - 293.15)
    conductivity, capacity = float(material.conductivity) * factor_k, float(material.specific_heat) * factor_c
    density = float(material.density)
    depth = min(1.73 * math.sqrt(conductivity * tau / (density * capacity)), thickness)
    return 2 / 3 * share * W / (capacity * density * A * depth)


@pytest.mark.parametrize("thickness", [0.025, 0.004])
def test_the_temperature_of_the_properties_is_a_root(u2_5_5, thickness):
    """Heat that stays in the rim, and heat that passes through it; the root by bracketing."""
    data = sb.EstimateData(rim=WARMER, share=0.9, track_area=0.35, rim_thickness=thickness)
    found = sb.synthesize(hard(u2_5_5), data)
    stop = sb.classical_stop(hard(u2_5_5))
    truth = brentq(
        lambda T: 293.15 + bulk_rise(T, 0.9, stop.work, 0.35, stop.time, WARMER, thickness) - T,
        300.0,
        1500.0,
        xtol=1e-12,
    )
    assert found.replaced == ("rim", "lining")
    assert found.rounds > 2
    assert found["mean bulk temperature, rim, refined"].value == pytest.approx(truth, rel=1e-11)
    first = 293.15 + bulk_rise(293.15, 0.9, stop.work, 0.35, stop.time, WARMER, thickness)
    assert found["mean bulk temperature, rim"].value == pytest.approx(first, rel=1e-12)
    assert found["conductivity, rim"].value == pytest.approx(47.8 * (1 - 6e-4 * (first - 293.15)))
    assert found["temperature of the properties, rim"].value == pytest.approx(first)
    assert abs(truth - first) > 5.0


def test_rim_and_lining_settle_together_when_effusivities_share_the_heat(u2_5_5):
    """Two equations with two unknowns, by scipy's `root`."""
    lining = sb.material("FK-24A", specific_heat_slope=1e-3, conductivity_slope=5e-4)
    data = sb.EstimateData(rim=WARMER, lining=lining, track_area=0.35)
    found = sb.synthesize(hard(u2_5_5), data)
    stop = sb.classical_stop(hard(u2_5_5))

    def effusivity(material, T):
        product = float(material.conductivity * material.density * material.specific_heat)
        for slope in (material.conductivity_slope, material.specific_heat_slope):
            product *= 1 + float(slope) * (T - 293.15)
        return math.sqrt(product)

    def rest(T):
        share = effusivity(WARMER, T[0]) / (effusivity(WARMER, T[0]) + effusivity(lining, T[1]))
        rim = bulk_rise(T[0], share, stop.work, 0.35, stop.time, WARMER)
        other = bulk_rise(T[1], 1 - share, stop.work, 0.75 * 0.35, stop.time, lining)
        return [293.15 + rim - T[0], 293.15 + other - T[1]]

    truth = root(rest, [500.0, 560.0], tol=1e-13)
    assert truth.success
    names = ("mean bulk temperature, rim, refined", "mean bulk temperature, lining, refined")
    np.testing.assert_allclose([found[name].value for name in names], truth.x, rtol=1e-10)


def test_properties_stay_those_of_room_temperature_below_150_degrees(u2_5_5, classical):
    data = sb.EstimateData(rim=WARMER, track_area=2 * sb.polished_surface(0.590, 0.220))
    found = sb.synthesize(u2_5_5, data)
    assert found.rounds == 0
    name = "mean bulk temperature, rim, refined"
    assert found[name].value == classical[name].value < 423.15


def test_a_capacity_that_falls_runs_away_and_says_so(u2_5_5):
    """T − T_0 = K/(1 − b (T − T_0)) has a solution while K b ≤ 1/4 (heat through a thin rim)."""
    stop = sb.classical_stop(hard(u2_5_5))
    K = bulk_rise(293.15, 0.9, stop.work, 0.35, stop.time, STEEL, 0.004)

    def found(slope, **options):
        steel = sb.material("steel_20L", specific_heat_slope=-slope)
        data = sb.EstimateData(rim=steel, share=0.9, track_area=0.35, rim_thickness=0.004)
        return sb.synthesize(hard(u2_5_5), data, **options)

    b = 0.9 / (4 * K)
    lower = (1 - math.sqrt(1 - 4 * b * K)) / (2 * b)
    rise = found(b)["mean bulk temperature, rim, refined"].value - 293.15
    assert rise == pytest.approx(lower, rel=1e-9)
    with pytest.raises(SynthesisError, match="specific heat of the rim") as error:
        found(1.1 / (4 * K))
    assert error.value.code == "material_range"
    with pytest.raises(SynthesisError, match="after 5 rounds") as error:
        found(b, rounds=5)
    assert error.value.code == "no_convergence"


# --- rational thickness -----------------------------------------------------------------------------------------------


def test_heat_just_reaches_the_back_of_a_rational_rim():
    found = sb.rational_rim_thickness(STEEL, 1.25, heat=8e5, rise=300.0)
    assert sb.fourier_number(float(STEEL.diffusivity), 1.25, found.depth) == pytest.approx(1 / 1.73**2)
    assert found.storage * float(STEEL.density * STEEL.specific_heat) * 300.0 == pytest.approx(8e5)
    assert found.rational == found.depth
    # S's criterion beside the slab: by then the back has risen by 26 % of the face, and half as deep by 52 % of it
    face, back = (sb.slab_rise(1e5, 1.25, found.depth, STEEL, x) for x in (0.0, found.depth))
    assert back / face == pytest.approx(0.264, abs=2e-3)
    stored = sb.rational_rim_thickness(STEEL, 1.25, heat=8e7, rise=300.0)
    assert stored.rational == stored.storage == pytest.approx(100 * found.storage)
    assert sb.rational_rim_thickness(STEEL, 1.25, heat=8e5, rise=0.0).rational == math.inf


def test_the_back_of_a_held_slab():
    """Series and images meet; both against the half-space, and against volumes integrated by SciPy."""
    early = 0.05
    near = 2 * (erfc(1 / (2 * math.sqrt(early))) - erfc(3 / (2 * math.sqrt(early))))
    assert sb.held_face_rise(early) == pytest.approx(near, rel=1e-12)
    below, above = sb.held_face_rise(0.2 * (1 - 1e-12)), sb.held_face_rise(0.2 * (1 + 1e-12))
    assert below == pytest.approx(above, rel=1e-10)
    assert sb.held_face_rise(0.0) == 0.0
    assert sb.held_face_rise(20.0) == pytest.approx(1.0, abs=1e-15)
    errors = []
    for cells in (20, 40):
        h = 1 / cells

        def rates(_, T, h=h):
            left = np.concatenate([[2 * (1.0 - T[0])], -np.diff(T)])  # the face is half a cell away
            return (left - np.concatenate([-np.diff(T), [0.0]])) / h**2

        end = solve_ivp(rates, (0.0, 0.5), np.zeros(cells), method="BDF", rtol=1e-9, atol=1e-11).y[:, -1]
        errors.append(1.125 * end[-1] - 0.125 * end[-2] - sb.held_face_rise(0.5))  # even about the back
    assert abs(errors[1]) < 2e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_a_rational_lining_keeps_its_back_at_the_permissible_temperature():
    given = {"face": 600.0, "back": 393.15, "start": 293.15}
    found = sb.rational_lining_thickness(LINING, 1500.0, **given)
    back = sb.back_temperature(LINING, found.insulation, 1500.0, face=600.0, start=293.15)
    assert back == pytest.approx(393.15, abs=1e-9)
    Fo = brentq(lambda Fo: sb.held_face_rise(Fo) - 100.0 / 306.85, 0.05, 2.0, xtol=1e-14)
    assert found.insulation == pytest.approx(math.sqrt(3.68e-7 * 1500.0 / Fo), rel=1e-10)
    assert found.rational == max(found.insulation, found.depth)
    cool = sb.rational_lining_thickness(LINING, 1500.0, **{**given, "face": 390.0})
    assert cool.insulation == 0.0
    assert cool.rational == cool.depth
    warm = sb.rational_lining_thickness(LINING, 1500.0, **{**given, "start": 393.15, "face": 500.0})
    assert warm.rational == math.inf
    thin = sb.back_temperature(LINING, 0.5 * found.insulation, 1500.0, face=600.0, start=293.15)
    assert thin > 393.15 + 50.0


def test_heat_content_is_the_integral_of_the_capacity():
    truth = quad(lambda T: 7850.0 * 534.1 * (1 + 1e-3 * (T - 293.15)), 310.0, 480.0)[0]
    found = heat_content(WARMER, np.array([310.0]), np.array([480.0]))
    assert found[0] == pytest.approx(truth, rel=1e-13)


# --- beside a run -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run():
    """A rigid band under constant tension slides from the first moment: the classical stop is then exact."""
    scene = layered_stop(growth=1.15, law=sb.ConstantFriction(0.35))
    rigid = dataclasses.replace(scene.brake, band=dataclasses.replace(scene.brake.band, stiffness=None))
    return sb.simulate(dataclasses.replace(scene, brake=rigid, initial=sb.Initial(20.0)))


def test_beside_a_stop_that_is_as_the_formulas_assume(run):
    found = sb.synthesize(run)
    exact = ("stopping time", "brake torque", "stopping angle", "friction work", "tight tension, greatest")
    for name in (*exact, "friction travel", "energy load of the linings"):
        assert found[name].value == pytest.approx(found[name].simulated, rel=1e-9), name
    peak = found["greatest face temperature"].simulated - 293.15
    for name in (
        "greatest face temperature",
        *(f"rim at the end, {at}" for at in ("face", "1/4", "1/2", "3/4", "back")),
    ):
        row = found[name]  # apart by layers of another thickness, and by what the air takes
        assert row.value == pytest.approx(row.simulated, abs=0.02 * peak), name
    bulk = found["mean bulk temperature, rim"]  # 2/3 counts for the whole depth from the first moment
    assert bulk.value - 293.15 == pytest.approx(bulk.simulated - 293.15, rel=0.25)
    assert found["share into the rim"].simulated == pytest.approx(0.95)
    assert found["relative time of the maximum"].simulated == pytest.approx(0.5, abs=0.02)
    assert found["relative power then"].simulated == pytest.approx(1.0, abs=0.05)
    assert found["pressure, mean"].value == pytest.approx(found["pressure, mean"].simulated, rel=0.02)
    assert 0.75 < found["rim's heat within the depth"].simulated < 1.0
    assert found["rational thickness, rim"].simulated == pytest.approx(0.028)
    assert found["conductivity, rim"].simulated == pytest.approx(48.0)
    # the scene has no lining wall: nothing simulated is made up for it
    for name in ("mean bulk temperature, lining", "rational thickness, lining", "lining's back after the braking"):
        assert found[name].simulated is None


def test_what_the_run_keeps_is_its_friction_heat_less_what_the_air_takes(run):
    """Step 10: stored heat from the layers, against the ledger of the run."""
    row = sb.synthesize(run)["heat into the rim"]
    stop = run.metrics["stopping_time"]
    s = run.series(np.array([0.0, float(stop)]))
    assert row.value == pytest.approx(0.95 * float(s.friction_heat[-1]), rel=1e-9)
    lost = float(s.heat_lost[-1]) - 0.05 * float(s.friction_heat[-1])  # what enters no body counts as lost
    assert row.simulated == pytest.approx(row.value - lost, rel=1e-6)
    assert lost > 0


def test_numbers_of_the_user_come_before_those_of_the_scene(run):
    found = sb.synthesize(run, sb.EstimateData(rim_thickness=0.05), permissible=sb.Permissible(lining=300.0, power=1.0))
    assert found.limits["margin, face of the linings"] == "passed"
    assert found.limits["margin, power load"] == "passed"
    assert found.limits["margin, back of the linings"] == "kept"
    inputs = {i.name: (i.value, i.source) for i in found.inputs}
    assert inputs["rim_thickness"] == (0.05, "given")
    assert inputs["lining_permissible"] == (300.0, "given")
    assert sb.synthesize(run, permissible=sb.Permissible(lining=1e3)).limits["margin, face of the linings"] == "kept"


@pytest.fixture(scope="module")
def twice():
    """Two brakings from different speeds under a constant load: the drum runs away between them."""
    scene = stop_scene(C=None, w0=0.0)
    lever = sb.PiecewiseLinear(
        [0.0, 0.01, 1.5, 1.501, 9.0, 9.01, 12.0, 12.001], [8e3, 0.0, 0.0, 8e3, 8e3, 0.0, 0.0, 8e3]
    )
    duty = sb.Duty(lever, sb.TorqueLoad(sb.Constant(5e3)))
    return sb.simulate(dataclasses.replace(scene, duty=duty, end_time=30.0))


def test_the_hardest_of_several_brakings_has_its_own_classical_stop(twice):
    found = sb.synthesize(twice)
    assert "the hardest of" in found.about
    omega = 5e3 / 800.0 * (12.001 - 9.01)
    assert found["stopping time"].value == pytest.approx(found["stopping time"].simulated, rel=5e-3)
    for name in ("stopping angle", "friction work"):
        assert found[name].value == pytest.approx(found[name].simulated, rel=1e-2), name
    numbers = {number.symbol: number.value for number in found["stopping time"].numbers}
    assert numbers["ω_0"] == pytest.approx(omega, rel=1e-2)
    duty = {number.symbol: number.value for number in found["thickness that holds the heat, whole duty"].numbers}
    one = {number.symbol: number.value for number in found["thickness that holds the heat, braking"].numbers}
    total = float(twice.energy["friction_heat"])
    assert duty["Q"] / one["Q"] == pytest.approx(total / found["friction work"].simulated, rel=1e-3)


def test_no_thickness_will_do_for_a_lining_that_starts_too_hot(run):
    """No number stands for it, in words nor in JSON, nor a difference from the thickness of the run."""
    found = sb.synthesize(run, permissible=sb.Permissible(lining=293.0, back=293.15))
    assert found.lining_thickness == found.rim_thickness == math.inf
    row = found["rational thickness, rim"]
    assert row.simulated == pytest.approx(0.028)
    assert row.difference is None
    told = row.as_dict()
    assert told["value"] is told["difference"] is None
    assert json.loads(json.dumps(found.as_dict(), allow_nan=False))["steps"] == found.as_list()
    assert re.search(r"rational thickness, lining +none", str(found))


# --- bad input --------------------------------------------------------------------------------------------------------


def test_all_faults_come_in_one_report(u2_5_5):
    data = sb.EstimateData(rim_thickness=-1.0, share=1.5, elastic=sb.ElasticMaterial(poisson=0.7))
    with pytest.raises(sb.InputError) as error:
        sb.synthesize(u2_5_5, data, permissible=sb.Permissible(back=math.nan), tolerance=0.0, rounds=0)
    paths = [fault.path for fault in error.value.faults]
    assert paths == ["rim_thickness", "share", "permissible.back", "elastic.poisson", "tolerance", "rounds"]


def test_a_staged_brake_and_a_scene_without_a_stop_are_refused():
    scene = stop_scene(C=None)
    brake = dataclasses.replace(scene.brake, bandage=sb.Bandage(20.0, sb.ConstantFriction(0.1)))
    with pytest.raises(sb.InputError, match="one friction pair"):
        sb.synthesize(dataclasses.replace(scene, brake=brake))
    with pytest.raises(sb.InputError, match="no classical stop"):
        sb.synthesize(stop_scene(C=None, w0=0.0))


def test_numbers_are_read_with_units_and_all_faults():
    data, limits = read_given(["rim_thickness=28 mm", "rim=cast_iron", "permissible.back=130 degC", "ambient=30 degC"])
    assert data.rim_thickness == pytest.approx(0.028)
    assert float(data.rim.conductivity) == 50.0
    assert limits.back == pytest.approx(403.15)
    assert data.ambient == pytest.approx(303.15)
    assert data.elastic is None
    assert read_given(["permissible.stress=200 MPa"])[0].elastic.permissible == 200e6
    with pytest.raises(sb.InputError) as error:
        read_given(["nonsense", "rims=1", "rim=gold", "share=2", "rim_thickness=3 kg"])
    assert len(error.value.faults) == 5


# --- the command ------------------------------------------------------------------------------------------------------


@pytest.fixture
def call(capsys, monkeypatch):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")

    def called(*arguments):
        with pytest.raises(SystemExit) as stop:
            main(["synthesize", *(str(argument) for argument in arguments)])
        out, err = capsys.readouterr()
        return stop.value.code, out, err

    return called


def test_the_report_has_twelve_numbered_lines(call, scenarios):
    code, out, err = call(scenarios / "u2_5_5_stop.toml")
    assert code == 0
    assert err == ""
    numbers = [line.split(".")[0] for line in out.splitlines() if re.match(r"\d+\.", line)]
    assert numbers == [str(i) for i in range(1, 13)]
    row = next(line for line in out.splitlines() if line.startswith("    stopping time"))
    assert re.search(r"0\.95001 +1\.2496 +-0\.29963  s", row)
    assert "parts: the lever takes time" in out


def test_json_is_a_list_of_steps_and_a_file_is_whole(call, scenarios, tmp_path):
    place = tmp_path / "synthesis.json"
    code, out, _ = call(scenarios / "u2_5_5_stop.toml", "--no-run", "--json", "-o", place)
    assert code == 0
    rows = json.loads(out, parse_constant=pytest.fail)
    assert {row["step"] for row in rows} == set(range(1, 13))
    keys = ("step", "name", "formula", "value", "unit", "simulated", "difference")
    for row in rows:
        assert list(row)[: len(keys)] == list(keys)
        assert isinstance(row["step"], int)
        assert row["value"] is None or isinstance(row["value"], float)
        assert row["simulated"] is row["difference"] is None
    assert json.loads(place.read_text("utf-8")) == rows
    assert [p.name for p in tmp_path.iterdir()] == ["synthesis.json"]


def test_options_change_the_inputs(call, scenarios):
    given = ["--given", "rim=cast_iron", "--given", "permissible.lining=30 degC", "--transmission"]
    code, out, _ = call(scenarios / "u2_5_5_stop.toml", "--no-run", "--json", *given, "--set", "initial.omega=30")
    assert code == 0
    rows = {row["name"]: row for row in json.loads(out)}
    assert rows["conductivity, rim"]["value"] == 50.0
    assert rows["share into the rim"]["value"] == rows["share into the rim, transmission"]["value"]
    assert rows["margin, face of the linings"]["verdict"] == "passed"
    assert rows["stopping angle"]["value"] == pytest.approx(by_hand()["stopping angle"] * (30 / 24) ** 2)


def test_bad_input_is_one_report_and_writes_nothing(call, scenarios, tmp_path):
    bad = ["--given", "rims=1", "--given", "share=2", "--set", "duty.load.mass=-1", "-o", tmp_path]
    code, out, err = call(scenarios / "u2_5_5_stop.toml", *bad)
    assert code == 2
    assert out == ""
    assert "4 faults" in err
    for word in ("--out", "rims", "share", "duty.load.mass"):
        assert word in err
    assert list(tmp_path.iterdir()) == []


def test_a_synthesis_without_end_has_a_code(call, tmp_path):
    """Exit code 1 and a named failure where the capacity falls to nothing."""
    place, report = tmp_path / "runaway.py", tmp_path / "report.txt"
    place.write_text(
        "import sys\n"
        f"sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r})\n"
        "import dataclasses\nimport simbrake as sb\nfrom heat_scenes import layered_stop\n"
        "def scene():\n"
        "    made = layered_stop(law=sb.ConstantFriction(0.35))\n"
        "    wall = made.heat.bodies[0]\n"
        "    steel = dataclasses.replace(wall.material, specific_heat_slope=-6e-3)\n"
        "    bodies = (dataclasses.replace(wall, material=steel), *made.heat.bodies[1:])\n"
        "    heat = dataclasses.replace(made.heat, bodies=bodies)\n"
        "    return dataclasses.replace(made, heat=heat, initial=sb.Initial(800.0))\n",
        "utf-8",
    )
    code, out, err = call(place, "--no-run", "-o", report)
    assert code == 1
    assert out == ""
    assert "material_range" in err
    assert not report.exists()
