"""The verdict on a run, its colour and margins, and the summary that fits the duty;
numbers by hand."""

import json
import math
import re

import jax.numpy as jnp
import numpy as np
import pytest
from commands import call
from helpers import input_error, near
from scenes import replaced, stop_run, stop_scene
from verdict_scenes import (
    ANGLE,
    LOAD,
    PI,
    STOP,
    T0,
    TORQUE,
    W0,
    R,
    helped_hold,
    rigid,
    rigid_run,
)

import simbrake as sb
from simbrake.results import limit_checks

#: limits of all parts of a band brake without heat that nothing comes near
AMPLE = {"max_tension": 1e9, "max_normal_load": 1e9}


def check_of(name, result, limits):
    (found,) = [check for check in limit_checks(result, limits) if check.name == name]
    return found


@pytest.fixture(scope="module")
def stop():
    return rigid_run()


# --- margins and colours ------------------------------------------------------------


@pytest.mark.parametrize(
    ("factor", "colour", "state"),
    [
        (0.99, "red", "exceeded"),
        (1.05, "amber", "small margin"),
        (1.2, "green", "within limit"),
    ],
)
def test_margin_sets_the_colour(stop, factor, colour, state):
    said = stop.verdict({"stopping_time": factor * STOP, **AMPLE})
    assert said.colour == colour
    row = said.rows[0]
    assert (row.name, row.state) == ("Stopping time", state)
    assert row.margin.endswith(f"({100 * (1 - 1 / factor):.3g} %)".replace("-", "−"))
    check = check_of("stopping_time", stop, {"stopping_time": factor * STOP})
    near(check.margin_percent, 100 * (1 - 1 / factor), 1e-9)


@pytest.mark.parametrize(
    ("factor", "colour", "state"),
    [
        (1.01, "red", "exceeded"),
        (0.95, "amber", "small margin"),
        (0.8, "green", "within limit"),
    ],
)
def test_limit_of_a_least_value(stop, factor, colour, state):
    """A holding reserve is to be at least its limit."""
    least = factor * TORQUE / LOAD
    said = stop.verdict({"min_holding_reserve": least, **AMPLE})
    (row,) = [row for row in said.rows if row.name == "Minimum holding reserve"]
    assert (said.colour, row.state) == (colour, state)
    assert (row.limit, row.note) == (f"≥ {least:.6g}", f"minimum at {STOP:.6g} s")
    check = check_of("min_holding_reserve", stop, {"min_holding_reserve": least})
    near(check.margin_percent, 100 * (1 / factor - 1), 1e-9)


def test_least_reserve_where_no_load_is_held():
    """It is infinite: that exceeds no limit."""
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 0.1, 0.2], [LOAD, LOAD, 0.0]))
    stop = sb.simulate(replaced(rigid(), {"duty.load": load}))
    said = stop.verdict({"min_holding_reserve": 1.25, **AMPLE})
    assert (said.colour, said.reason) == ("green", "H4")


def test_limit_of_a_motion_in_either_sense():
    """A load thrown up travels as far as one that comes down."""
    up = rigid_run(w0=-W0)
    angle = up["stopping_angle"]
    said = up.verdict({"stopping_angle": -0.99 * angle, **AMPLE})
    row = said.rows[0]
    assert (said.colour, row.state) == ("red", "exceeded")
    assert row.limit == f"± {-0.99 * angle:.6g} rad"
    data = sb.ensemble(up.scene, {"initial.omega": [-W0, W0]}, ["stopping_angle"])
    bounds = {"stopping_angle": 0.99 * abs(angle)}
    found = sb.studies.overview(up.scene, data, ["stopping_angle"], bounds)
    assert found.limits["checked"][0]["exceeded"] == 2


@pytest.mark.parametrize(
    ("load", "colour", "state"),
    [(1 - 1e-12, "amber", "small margin"), (1 + 1e-6, "red", "exceeded")],
)
def test_hold_at_the_limit(load, colour, state):
    """No row is exceeded in a verdict that is not red."""
    said = rigid_run(load * TORQUE, w0=0.0, end=0.1).verdict(AMPLE)
    rows = [row.state for row in said.rows if row.name.startswith("Holding")]
    assert (said.colour, rows) == (colour, [state])


def test_notebook_shows_a_run_with_heat():
    assert "peak_rim_temperature" in sb.simulate(hot_stop())._repr_html_()


def test_open_brake_at_the_end_is_no_pass():
    """Let go after its stop, the load speeds up again; or a brake that never was
    closed."""
    said = rigid_run(lever=(T0, T0, 0.0, 0.0), end=2.5).verdict()
    assert (said.colour, said.reason, said.wants) == ("amber", "H5", "released")
    free = rigid_run(lever=(0.0,) * 4, end=0.5).verdict()
    assert (free.colour, free.reason, free.wants) == ("red", "X1", "free")


@pytest.mark.parametrize(
    ("part", "colour", "state"),
    [
        (0.79, "green", "within limit"),
        (0.81, "amber", "within limit"),
        (0.91, "amber", "small margin"),
    ],
)
def test_lever_near_its_maximum_is_amber(part, colour, state):
    """Below a margin of 10 %, and below a reserve of 1.25 of its greatest pull."""
    pull = LOAD / (R * (PI - 1))
    most = pull / part
    said = stop_run(C=None, lever=sb.SpeedHold(most), load=LOAD, end=3.0).verdict(AMPLE)
    (row,) = [row for row in said.rows if row.name.startswith("Slack tension")]
    assert (said.colour, row.state, said.reason) == (colour, state, "L1")
    near(said.numbers["reserve"], 1 / part, 1e-9)
    assert row.limit == f"< {most / 1e3:.6g} kN"
    assert row.margin.endswith(f" ({100 * (1 - part):.3g} %)")


def test_temperature_margin_is_of_the_rise():
    """Percent of the rise above 20 °C; a limit below that has none."""
    result = sb.simulate(hot_stop())
    value = result.metrics["peak_rim_temperature"]
    for limit, percent in (
        (value + 19.0, 100 * 19 / (value + 19.0 - 293.15)),
        (280.0, None),
    ):
        (check,) = [
            c
            for c in limit_checks(result, {"peak_rim_temperature": limit})
            if c.limit == limit
        ]
        assert check.margin_percent == (
            None if percent is None else pytest.approx(percent, rel=1e-9)
        )


@pytest.mark.parametrize(("reserve", "colour"), [(1.2, "amber"), (1.3, "green")])
def test_small_holding_reserve_is_amber(reserve, colour):
    said = rigid_run(TORQUE / reserve, w0=1.0).verdict(AMPLE)
    assert said.colour == colour
    row = said.rows[0]
    assert row.value.startswith(f"{reserve:g} (at ")
    assert row.margin == f"+{100 * (reserve - 1):.3g} %"


def test_a_brake_just_too_weak_is_not_told_as_strong_enough():
    said = rigid_run(TORQUE / 0.9999, w0=1.0).verdict()
    assert "gives 0.9999 of the load's torque" in said.sentence


def test_breaking_away_is_red_and_letting_go_amber():
    let_go = rigid_run(lever=(T0, T0, T0, 0.0), w0=1.0, end=9.5)
    near(let_go.metrics["min_holding_reserve"], TORQUE / LOAD)
    said = let_go.verdict()
    assert (said.colour, said.reason) == ("amber", "H5")
    near(said.numbers["reserve"], TORQUE / LOAD)
    eased = rigid_run(lever=(T0, T0, T0, 0.0), w0=1.0, end=8.9).verdict()
    assert (eased.colour, eased.reason) == ("red", "H1")
    near(eased.numbers["reserve"], 1.0, abs=1e-9)
    torn = rigid_run((LOAD, LOAD, 1.01 * TORQUE, 1.01 * TORQUE), w0=1.0, end=2.5)
    said = torn.verdict()
    assert said.colour == "red"
    assert [row.state for row in said.rows if row.name.startswith("Holding")] == [
        "exceeded"
    ]
    # it breaks away at 1, and at the end the load is heavier
    heavier = rigid_run((LOAD, LOAD, LOAD, 2 * TORQUE), w0=0.0, end=9.0)
    (row,) = [row for row in heavier.verdict().rows if row.name.startswith("Holding")]
    assert row.value == "0.5 (at the end, if the lever pulls with 8 kN)"


@pytest.mark.parametrize(
    ("share", "colour", "state"),
    [(0.95, "amber", "small margin"), (1.1, "red", "exceeded")],
)
def test_a_hold_counts_after_its_load_is_taken_off(share, colour, state):
    """Bearings helped to hold the load; at the end none hangs on the open brake."""
    scene = helped_hold(share, 0.0)
    said = sb.simulate(scene).verdict(AMPLE)
    assert (said.colour, said.reason) == (colour, "X0")
    (row,) = [row for row in said.rows if row.name.startswith("Holding")]
    assert (row.value, row.state) == (f"{1 / share:.4g} (at 0 s)", state)
    many = sb.ensemble(scene, {"initial.omega": [0.0]}, ["max_drum_speed"])
    assert many["colour"].item() == colour


def test_reserve_of_an_eased_lever():
    """A load that breaks away has a reserve of 1 but for rounding; one that is meant to
    move has none."""
    lever = (T0, T0, T0, 0.4 * T0)
    eased = rigid(0.5 * TORQUE, lever=lever, w0=0.0, end=9.0)
    metrics = ["min_holding_reserve"]
    data = sb.ensemble(eased, {"initial.omega": [0.0]}, metrics)
    found = sb.studies.overview(eased, data, metrics)
    assert found.limits["checked"][0]["exceeded"] == 1
    assert {row.margin for row in sb.simulate(eased).verdict().rows} == {"+0 %"}
    meant = sb.simulate(replaced(eased, {"duty.wants": "lower"}))
    assert meant.metrics["min_holding_reserve"] is None


def test_runs_that_end_turning():
    away = rigid_run(1.25 * TORQUE, end=0.5)
    assert (away.verdict().colour, away.verdict().reason) == ("red", "S3")
    rows = {row.name.split()[0]: row for row in away.verdict().rows}
    assert rows["Holding"].state == "exceeded"
    assert away.summary()["duty"] == "runaway"
    short = rigid_run(end=0.2)
    said = short.verdict()
    assert (said.colour, said.reason, said.fails, short.summary()["duty"]) == (
        "amber",
        "S2",
        True,
        "turning",
    )
    # the load brakes as well, and pulls back later: backwards the band gives
    # `T_0 (1 − 1/Π)`
    helped = rigid_run(-LOAD, end=0.2).verdict()
    assert (helped.colour, helped.reason) == ("red", "S1")
    near(helped.numbers["load_torque"], -LOAD)
    near(helped.numbers["sliding_over_load"], R * T0 * (1 - 1 / PI) / LOAD, 1e-9)
    failed = sb.simulate(rigid(), max_steps=2, throw=False)
    assert (failed.verdict().colour, failed.summary()["duty"]) == ("red", "failed")
    assert "step_limit" in failed.verdict().headline


def test_limits_of_the_scene_are_evaluated(tmp_path, capsys):
    scene = rigid_run().scene
    band = sb.Band(R, strength=sb.brakes.Strength(band_area=2e-4, band_stress=150e6))
    scene = sb.Scene(
        sb.Brake(scene.brake.pulley, band, scene.brake.linings),
        scene.duty,
        scene.initial,
        scene.end_time,
    )
    result = sb.simulate(scene)
    stress = T0 * PI / 2e-4
    check = check_of("max_band_stress", result, {})
    near(check.value, stress, 1e-9)
    assert check.verdict == "exceeded"
    assert result.verdict().colour == "red"
    sb.write_scene(scene, tmp_path / "scene.toml")
    found = json.loads(call(capsys, "run", str(tmp_path / "scene.toml"), "--json")[1])
    assert found["verdict"]["colour"] == "red"
    texts = [one["text"] for one in found["findings"] if one["topic"] == "warning"]
    assert texts == found["warnings"] != []
    near(found["limits"][0]["margin_percent"], 100 * (1 - stress / 150e6), 1e-9)


def hot_stop(**permissible):
    """A rim without cooling takes all the heat of a stop, linings none: its temperature
    is its share of the work."""
    heat = sb.lumped_heat(
        rim=500.0, linings=2e4, partition=1.0, rim_cooling=0.0, **permissible
    )
    return rigid(heat=heat)


def test_hottest_body_and_missing_limits():
    """Linings stay cold below their limit; the rim glows, and has none."""
    hot = 293.15 + TORQUE * ANGLE / 500.0
    result = sb.simulate(hot_stop(permissible=400.0))
    near(result.metrics["peak_rim_temperature"], hot, 1e-9)
    said = result.verdict()
    assert said.colour == "amber"
    assert json.loads(json.dumps(said.as_dict()))["judged"] == {
        "given": 1,
        "of": 4,
        "missing": {
            "band tension": ["max_tension"],
            "load on a lining": ["max_normal_load"],
            "rim temperature": ["peak_rim_temperature"],
        },
        "not_modelled": ["lever force"],
    }
    for word in said.judged.missing:
        assert word in sb.results.explain(result, influence=False)["limits"].text
    named = {names[0]: 1e9 for names in said.judged.missing.values()}
    assert result.verdict(named).colour == "green"
    for name in named:
        assert (
            result.verdict({other: 1e9 for other in named if other != name}).colour
            == "amber"
        )
    assert [check.name for check in limit_checks(result, {})][:2] == [
        "peak_rim_temperature",
        "peak_lining_temperature",
    ]


def test_permissible_rim_temperature():
    """Half of the work of the stop is done where `ω t − a t²/2` is half of the
    angle."""
    limit = 293.15 + 0.5 * TORQUE * ANGLE / 500.0
    result = sb.simulate(hot_stop(permissible_rim=limit))
    (event,) = result.events["permissible_rim_temperature"]
    near(event.time, STOP * (1 - math.sqrt(0.5)), 1e-9)
    said = result.verdict(AMPLE)
    assert said.colour == "red"
    row = next(row for row in said.rows if row.name == "Hottest rim surface")
    assert (row.state, row.limit) == ("exceeded", f"≤ {limit - 273.15:.6g} °C")
    assert (
        result.verdict(
            {**AMPLE, "peak_rim_temperature": 1e9, "peak_lining_temperature": 1e9}
        ).colour
        == "green"
    )
    with input_error(match="permissible_band: the network names no place as the band"):
        sb.check_scene(hot_stop(permissible_band=400.0))


def test_permissible_pressure_is_a_limit():
    linings = sb.uniform_linings(
        20, "270 deg", 0.35, area=0.02, permissible_pressure="1 MPa"
    )
    scene = replaced(rigid(), {"brake.linings": linings})
    result = sb.simulate(scene)
    check = check_of("max_pressure", result, {})
    near(check.value, result.metrics["max_normal_load"] / 0.02, 1e-9)
    assert (check.limit, check.note) == (1e6, "lining 20")
    assert result.verdict({"max_tension": 1e9}).judged.missing == {}
    with input_error(match="a permissible pressure needs the area"):
        sb.check_scene(replaced(scene, {"brake.linings.area": None}))


def test_limit_on_what_did_not_happen(stop):
    turning = rigid_run(end=0.2)
    failed = sb.simulate(rigid(), max_steps=2, throw=False)
    for result, verdict, note in (
        (turning, "exceeded", "did not happen in this run"),
        (failed, "not evaluated", "the run failed before it happened"),
    ):
        check = check_of("stopping_time", result, {"stopping_time": 3.0})
        assert (check.value, check.verdict, check.note) == (None, verdict, note)
    check = check_of("max_tension", failed, {"max_tension": 1e9})
    assert check.verdict == "within limit so far"
    value = float(stop.max_tension.value)
    for bound, verdict in ((value, "within limit"), (value * (1 - 1e-12), "exceeded")):
        check = check_of("max_tension", stop, {"max_tension": bound})
        assert (check.verdict, check.value) == (verdict, value)
    first, *others = limit_checks(stop, {})
    assert (first.name, first.verdict, first.note) == (
        "peak_lining_temperature",
        "not evaluated",
        "the scene has no thermal part",
    )
    assert {c.name: (c.verdict, c.limit) for c in others} == {
        "max_tension": ("no limit", None),
        "max_normal_load": ("no limit", None),
    }
    assert [c.name for c in limit_checks(stop, {"max_tension": 1.0})[1:]] == [
        "max_normal_load",
        "max_tension",
    ]


# --- what a run could not see -------------------------------------------------------


def test_the_interval_of_the_note_is_true():
    """A free pulley is sped up by pulses at random places: longer ones than the note
    says are never missed."""

    def pulse(t, about):
        return about[2] * jnp.where(
            (t > about[0]) & (t < about[0] + about[1]), 1.0, 0.0
        )

    def speed(begin, width):
        load = sb.profiles.FunctionProfile(pulse, (begin, width, TORQUE), typical=LOAD)
        result = sb.simulate(
            stop_scene(C=None, load=sb.TorqueLoad(load), T0=0.0, end=100.0), throw=False
        )
        notes.append(result.summary()["notes"][0])
        return float(result.record.y_end.omega)

    notes = []
    at = np.random.default_rng(3).uniform(0.0, 99.0, 12)
    still = speed(200.0, 0.02)
    interval = float(re.search(r"every ([\d.]+) s", notes[0])[1])
    assert any(speed(begin, 0.02) == still for begin in at)
    assert not any(speed(begin, 1.01 * interval) == still for begin in at)
