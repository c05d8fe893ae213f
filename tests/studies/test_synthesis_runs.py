"""The parametric synthesis beside runs, what it refuses, and its command."""

import dataclasses
import json
import math
import runpy

import numpy as np
import pytest
from commands import (
    call,
    no_cache,  # noqa: F401
)
from goldens import assert_refused
from heat_scenes import TRACK
from helpers import input_error, near
from material_scenes import heated
from scenes import replaced, stop_scene
from scipy.integrate import dblquad, quad
from synthesis_by_hand import by_hand

import simbrake as sb


@pytest.fixture(scope="module")
def u2_5_5(scenarios):
    return runpy.run_path(str(scenarios / "u2_5_5_stop.py"))["scene"]()


# --- beside a run -------------------------------------------------------------------


@pytest.fixture(scope="module")
def run():
    return sb.simulate(heated())


@pytest.mark.slow
def test_formulas_match_a_stop_they_assume(run):
    found = sb.synthesize(run)
    exact = (
        "stopping time",
        "brake torque",
        "stopping angle",
        "friction work",
        "tight tension, maximum",
    )
    for name in (*exact, "friction travel", "energy load of the linings"):
        assert found[name].value == pytest.approx(found[name].simulated, rel=1e-9), name
    peak = found["maximum face temperature"].simulated - 293.15
    for name in (
        "maximum face temperature",
        *(f"rim at the end, {at}" for at in ("face", "1/4", "1/2", "3/4", "back")),
    ):
        row = found[
            name
        ]  # apart by layers of another thickness, and by what the air takes
        assert row.value == pytest.approx(row.simulated, abs=0.02 * peak), name
    # the estimate leaves all heat within the depth b, in the run some of it goes on: ∫
    # q erfc(b/√(4 a u)) du
    bulk = found["mean bulk temperature, rim"]
    tau = run.metrics["stopping_time"]
    a = 48.0 / (7800.0 * 500.0)
    b = 1.73 * math.sqrt(a * tau)
    beyond = dblquad(
        lambda u, t: (
            2 * (1 - (t - u) / tau) * math.erfc(b / math.sqrt(4 * a * u)) / tau**2
        ),
        0,
        tau,
        0,
        lambda t: t,
    )[0]
    rise = 0.95 * 0.5 * 800.0 * 20.0**2 / (7800.0 * 500.0 * TRACK * b)
    near(bulk.value - 293.15, 2 / 3 * rise, 1e-9)
    near(bulk.simulated - 293.15, (2 / 3 - beyond) * rise, 1e-2)
    near(found["heat partition coefficient, rim"].simulated, 0.95)
    kept = quad(lambda u: 2 * u / tau**2 * math.erf(b / math.sqrt(4 * a * u)), 0, tau)[
        0
    ]
    near(found["rim's heat within the depth"].simulated, kept, abs=5e-3)
    # the scene has no lining wall: nothing simulated is made up for it
    assert found["rational thickness, lining"].simulated is None


@pytest.mark.slow
def test_what_the_run_keeps(run):
    """Step 10: stored heat from the layers, against the ledger of the run."""
    row = sb.synthesize(run)["heat into the rim"]
    stop = run.metrics["stopping_time"]
    s = run.series(np.array([0.0, float(stop)]))
    near(row.value, 0.95 * float(s.friction_heat[-1]), 1e-9)
    lost = float(s.heat_lost[-1]) - 0.05 * float(
        s.friction_heat[-1]
    )  # what enters no body counts as lost
    near(row.simulated, row.value - lost, 1e-6)
    assert lost > 0


@pytest.mark.slow
def test_user_numbers_precede_those_of_scene(run):
    found = sb.synthesize(
        run,
        sb.formulas.EstimateData(rim_thickness=0.05),
        permissible=sb.formulas.Permissible(lining=300.0, power=1.0),
    )
    assert found.limits["margin, face of the linings"] == "exceeded"
    assert found.limits["margin, power load"] == "exceeded"
    assert found.limits["margin, back of the linings"] == "within limit"
    inputs = {i.name: (i.value, i.source) for i in found.inputs}
    assert inputs["rim_thickness"] == (0.05, "given")
    assert inputs["lining_permissible"] == (300.0, "given")
    name = "margin, face of the linings"
    far = sb.synthesize(run, permissible=sb.formulas.Permissible(lining=1e3))
    assert far.limits[name] == "within limit"
    hottest = 1e3 - min(far[name].value, far[name].simulated or np.inf)
    for beyond, verdict in ((0.5, "within limit"), (-0.5, "exceeded")):
        close = sb.synthesize(
            run, permissible=sb.formulas.Permissible(lining=hottest + beyond)
        )
        assert verdict in close.limits[name]


@pytest.fixture(scope="module")
def twice():
    """Two brakings from different speeds under a constant load: the drum runs away
    between them."""
    scene = stop_scene(C=None, w0=0.0)
    lever = sb.PiecewiseLinear(
        [0.0, 0.01, 1.5, 1.501, 9.0, 9.01, 12.0, 12.001],
        [8e3, 0.0, 0.0, 8e3, 8e3, 0.0, 0.0, 8e3],
    )
    duty = sb.Duty(lever, 5e3)
    return sb.simulate(dataclasses.replace(scene, duty=duty, end_time=30.0))


@pytest.mark.slow
def test_the_hardest_of_several_brakings(twice):
    found = sb.synthesize(twice)
    assert "the hardest of" in found.about
    omega = 5e3 / 800.0 * (12.001 - 9.01)
    near(found["stopping time"].value, found["stopping time"].simulated, 5e-3)
    for name in ("stopping angle", "friction work"):
        assert found[name].value == pytest.approx(found[name].simulated, rel=1e-2), name
    numbers = {number.symbol: number.value for number in found["stopping time"].numbers}
    near(numbers["ω_0"], omega, 1e-2)
    duty = {
        number.symbol: number.value
        for number in found["thickness that holds the heat, whole duty"].numbers
    }
    one = {
        number.symbol: number.value
        for number in found["thickness that holds the heat, braking"].numbers
    }
    total = float(twice.energy["friction_heat"])
    near(duty["Q"] / one["Q"], total / found["friction work"].simulated, 1e-3)


@pytest.mark.slow
def test_no_thickness_for_a_lining_too_hot(run):
    """No number stands for it, in words nor in JSON, nor a difference from the
    thickness of the run."""
    found = sb.synthesize(
        run, permissible=sb.formulas.Permissible(lining=293.0, back=293.15)
    )
    assert found.lining_thickness == found.rim_thickness == math.inf
    row = found["rational thickness, rim"]
    near(row.simulated, 0.028)
    assert row.difference is None
    assert row.as_dict()["value"] is row.as_dict()["difference"] is None


# --- bad input ----------------------------------------------------------------------


def test_all_faults_come_in_one_report(u2_5_5, request):
    data = sb.formulas.EstimateData(
        rim_thickness=-1.0, share=1.5, elastic=sb.formulas.ElasticMaterial(poisson=0.7)
    )
    options = {"tolerance": 0.0, "rounds": 0}
    options["permissible"] = sb.formulas.Permissible(back=math.nan)
    cases = [lambda: sb.synthesize(u2_5_5, data, **options)]
    assert_refused(request, "synthesis", cases)


def test_staged_brake_or_no_stop_is_refused():
    bandage = sb.Bandage(20.0, sb.ConstantFriction(0.1))
    with input_error(match="one friction pair"):
        sb.synthesize(replaced(stop_scene(C=None), {"brake.bandage": bandage}))
    with input_error(match="no classical stop"):
        sb.synthesize(stop_scene(C=None, w0=0.0))


# --- the command --------------------------------------------------------------------


def test_command(capsys, tmp_path):
    place = tmp_path / "synthesis.json"
    asked = ("synthesize", "u2_5_5_stop", "--no-run", "--json")
    given = ("--given", "rim=cast_iron", "--set", "initial.omega=30")
    code, out, _ = call(capsys, *asked, *given, "-o", str(place))
    assert code == 0
    rows = json.loads(out, parse_constant=pytest.fail)
    assert json.loads(place.read_text("utf-8")) == rows
    assert {row["step"] for row in rows} == set(range(1, 13))
    values = {row["name"]: row["value"] for row in rows}
    assert values["conductivity, rim"] == 50.0
    angle = by_hand()["stopping angle"] * (30 / 24) ** 2
    near(values["stopping angle"], angle)
    # (the scene's own steel exceeds its allowable stress)
    stronger = ("--given", "permissible.stress=1 GPa")
    assert call(capsys, *asked, "--fail-on-limit")[0] == 3
    assert call(capsys, *asked, *stronger, "--fail-on-limit")[0] == 0
