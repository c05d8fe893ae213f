"""`simbrake explain`: what it says of each kind of run, with the numbers in closed
form."""

import dataclasses
import json
import math
import re

import pytest
from commands import call
from disc_scenes import FRICTION, RATIO, F, N, disc_scene
from disc_scenes import LOAD as DISC_LOAD
from disc_scenes import TORQUE as DISC_TORQUE
from heat_scenes import lump
from helpers import near
from scenes import stop_scene
from shoe_scenes import shoe_scene
from verdict_scenes import ANGLE, LOAD, PI, STOP, T0, TORQUE, W0, Z, rigid, two_stops

import simbrake as sb

explain = sb.results.explain
MU = PI ** (1 / 20)
#: load of the last of 20 sliding linings over the mean: they are in proportion to `μ^i`
OVER = 20 * MU**19 * (MU - 1) / (PI - 1)


@pytest.fixture(scope="module")
def stop():
    return sb.simulate(rigid())


@pytest.fixture(scope="module")
def told(stop):
    return explain(stop, limits={"stopping_time": 1.02 * STOP})


def test_torque_budget_of_a_stop(told):
    """`M_b = M_load + J α` with constant torques."""
    found = told["balance"].numbers
    near(found["angle"], ANGLE, 1e-9)
    for name, torque in (("brake", TORQUE), ("load", LOAD), ("inertia", TORQUE - LOAD)):
        near(found[f"{name}_torque"], torque, 1e-9)
    near(found["others_torque"], 0.0, abs=1e-6)
    assert found["governs"] == ("load" if LOAD > TORQUE - LOAD else "inertia")


def test_loads_and_stability_of_a_stop(told):
    judged = {"reason": "H4", "wants": "rest", "shown": True, "fails": False}
    assert told["outcome"].numbers == {
        "colour": "amber",
        "status": "stopped",
        "exceeded": 0,
        **judged,
    }
    near(told["course"].numbers["stopping_time"], STOP, 1e-9)
    most = told["linings"].numbers["max_normal_load"]
    assert (most["lining"], most["over_mean"]) == (20, pytest.approx(OVER, rel=1e-9))
    stability = told["stability"].numbers
    near(stability["self_locking"]["margin"], 1 - 0.35 * Z, 1e-12)
    near(stability["runaway"]["margin"], TORQUE / LOAD - 1, 1e-9)
    near(stability["holding_reserve"], TORQUE / LOAD, 1e-9)


def test_maximum_load_just_before_the_stop():
    """A rising lever has it there; the linings of the held pulley share otherwise."""
    found = explain(rigid(lever=(T0, 2 * T0, 2 * T0, 2 * T0)), influence=False)
    near(found["linings"].numbers["max_normal_load"]["over_mean"], OVER, 1e-9)


def test_hottest_lining_over_the_mean():
    """Insulated linings that keep their own heat, which is in proportion to `μ^i`."""
    pair = sb.thermal.FrictionHeat(None, "linings", sb.thermal.ConstantPartition(0.0))
    heat = sb.Heat(
        (sb.thermal.Lump("linings", 5e3, count=20),), (), pair, linings="linings"
    )
    found = explain(rigid(heat=heat), influence=False)["linings"]
    hottest = found.numbers["peak_lining_temperature"]
    assert hottest["lining"] == 20
    near(hottest["over_mean"], OVER, 1e-8)


def test_elasticities_of_a_stop(told):
    """`t = J ω_0/(M_b − M_load)` with `M_b = T_0 R_b (Π − 1)`; the friction changes `Π`
    by `2 n f z Π/(1 − f² z²)`."""
    g = TORQUE / (TORQUE - LOAD)
    by_friction = -g * (2 * 20 * 0.35 * Z / (1 - (0.35 * Z) ** 2)) * PI / (PI - 1)
    found = told["influence"].numbers
    assert found["metric"] == "stopping_time"
    names = list(found["parameters"])
    assert len(names) == 3
    elasticity = {name: row["elasticity"] for name, row in found["parameters"].items()}
    near(elasticity["brake.linings.friction.coefficient"], by_friction, 1e-7)
    half = math.radians(13.5) / 2
    h = 0.35 * Z
    by_angle = (
        -g * (2 * 20 * h / (1 - h**2)) * PI / (PI - 1) * 2 * half / math.sin(2 * half)
    )
    near(elasticity["brake.linings.angle[:]"], by_angle, 1e-7)
    third = {"brake.band.radius": -g, "duty.slack_tension.values[:]": -g}
    near(elasticity[names[2]], third[names[2]], 1e-7)


@pytest.mark.parametrize(("released", "longest"), [(0.5, 1), (3.0, 2)])
def test_many_stops(released, longest):
    """A release after the first stop: totals, and the balance of the longer of the two
    applications alone."""
    again = 2.0 + released
    found = explain(two_stops(again, 20.0), influence=False)
    second = released * LOAD / (TORQUE - LOAD)
    assert (second > STOP) == (longest == 2)
    near(found["course"].numbers["braking_time"], STOP + second, 1e-9)
    assert found["course"].numbers["longest"]["stop"] == longest
    assert "influence" not in found
    balance = found["balance"].numbers
    assert balance["stop"] == longest
    near(balance["brake_torque"], TORQUE, 1e-9)
    near(balance["load_torque"], LOAD, 1e-9)
    near(balance["inertia_torque"], TORQUE - LOAD, 1e-9)


def test_held_load():
    found = explain(rigid(w0=0.0), influence=False)
    near(found["balance"].numbers["capacity"], TORQUE, 1e-9)
    assert "runaway" not in found["stability"].numbers
    free = explain(rigid(0.0, w0=0.0), influence=False)["balance"]
    assert free.numbers == {}


def test_lowering_and_terminal_speed():
    drag = explain(
        stop_scene(C=None, lever=sb.SpeedHold(T0), load=LOAD, end=3.0), influence=False
    )
    near(drag["balance"].numbers["load_power"], LOAD * W0, 1e-9)
    near(drag["balance"].numbers["friction"], LOAD * W0, 1e-9)
    c = 600.0
    shaft = (sb.loads.ViscousDrag(c),)
    parts = {"load": LOAD, "w0": LOAD / c, "end": 30.0, "shaft": shaft}
    steady = explain(stop_scene(C=None, T0=0.0, **parts), influence=False)
    near(steady["balance"].numbers["other"], LOAD**2 / c, 1e-9)


def test_runaway_and_failure_have_a_remedy():
    away = explain(rigid(1.25 * TORQUE, end=0.5), influence=False)
    assert away["outcome"].numbers["colour"] == "red"
    near(away["remedy"].numbers["factor"], 1.25, 1e-9)
    near(away["stability"].numbers["runaway"]["margin"], -0.2, 1e-9)
    turning = explain(rigid(end=0.2), influence=False)
    assert "remedy" not in turning
    failed = explain(sb.simulate(rigid(), max_steps=2, throw=False))
    assert failed["remedy"].numbers["status"] == "step_limit"


def test_remedy_of_a_phase_that_never_comes_to_rest():
    """Half of the torque of the load: no later end time would help."""
    pull = 0.5 * T0 * LOAD / TORQUE
    duty = sb.Duty(sb.loads.Phases((sb.loads.Phase(pull, "rest"),)), rigid().duty.load)
    failed = sb.simulate(dataclasses.replace(rigid(), duty=duty), throw=False)
    assert failed.message.endswith(": pull harder, or take a lighter load")
    near(explain(failed, influence=False)["remedy"].numbers["factor"], 2.0, 1e-9)


def test_disc_shoe_and_staged_brakes():
    disc = explain(disc_scene(), influence=False)
    near(disc["balance"].numbers["brake_torque"], DISC_TORQUE, 1e-9)
    near(
        disc["stability"].numbers["holding_reserve"],
        RATIO * DISC_TORQUE / DISC_LOAD,
        1e-9,
    )
    assert "self_locking" not in disc["stability"].numbers
    near(DISC_TORQUE, N * FRICTION * F * 0.4)
    shoe = explain(shoe_scene(), influence=False)
    assert 0 < shoe["stability"].numbers["self_locking"]["margin"] < 1


def test_command_explains_scenes_and_results(tmp_path, capsys, stop):
    scene = str(tmp_path / "stop.toml")
    sb.write_scene(stop.scene, scene)
    sb.save(stop, tmp_path / "out" / "result.nc")
    limit = ("--limit", f"stopping_time={0.9 * STOP}", "--fail-on-limit")
    first, second = (
        call(capsys, "explain", str(file), "--no-influence", "--json", *limit)
        for file in (scene, tmp_path / "out")
    )
    assert first == second
    topics = [one["topic"] for one in json.loads(first[1])["findings"]]
    parts = ["outcome", "course", "balance", "linings", "limits", "stability"]
    assert (first[0], topics) == (3, parts)
    rig = ("--no-influence", "--units", "rig")
    assert " klbf" in call(capsys, "explain", scene, *rig)[1]


@pytest.mark.parametrize(("system", "degree"), [("si", "K"), ("rig", "°F")])
def test_a_step_of_a_temperature_is_in_the_unit_shown(system, degree):
    """A rim without cooling that starts by a degree hotter ends by a degree hotter."""
    parts = {"lever": sb.SpeedHold(T0), "load": LOAD, "heat": lump()}
    with sb.results.display_units(system):
        text = explain(stop_scene(C=None, end=3.0, **parts))["influence"].text
    step = rf"1 {degree} more of heat.bodies\[0\].temperature \([^)]*\) 1 {degree};"
    assert re.search(step, text)
