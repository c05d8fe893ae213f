"""The verdict on a run, its colour and margins, and the summary that fits the duty; numbers by hand."""

import dataclasses
import functools
import html
import json
import math
import re

import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from disc_scenes import disc_scene
from helpers import main
from shoe_scenes import shoe_scene
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._pages._rows import key_figures
from simbrake._run import _report
from simbrake._run._measure import (
    LimitVerdict,
    has_limit,
    name_of,
    named,
    parse_limits,
    read_limits,
    summary_with_limits,
    title_of,
    unit_of,
)
from simbrake._run._metrics import RESIDUAL_SEES
from simbrake.results import LimitCheck, limit_checks

J, W0, R, T0, LOAD = 800.0, 20.0, 0.725, 8e3, 1.2e4
Z = math.tan(math.radians(13.5) / 2)
PI = ((1 + 0.35 * Z) / (1 - 0.35 * Z)) ** 20
TORQUE = R * T0 * (PI - 1)
STOP = J * W0 / (TORQUE - LOAD)
ANGLE = STOP * W0 / 2
#: limits of all parts of a band brake without heat that nothing comes near
AMPLE = {"max_tension": 1e9, "max_normal_load": 1e9}


def lines(result):
    return {line.split()[0]: line for line in str(result).splitlines()}


def flat(*values):
    """A profile of four points, so that all levers and loads share one program."""
    return sb.PiecewiseLinear([0.0, 2.0, 2.0, 9.0], list(values))


def rigid(load=LOAD, *, lever=(T0,) * 4, w0=W0, end=4.0):
    load = (load,) * 4 if isinstance(load, float) else load
    return stop_scene(C=None, w0=w0, lever=flat(*lever), load=sb.TorqueLoad(flat(*load)), end=end)


@pytest.fixture(scope="module")
def stop():
    return sb.simulate(rigid())


# --- margins and colours ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("factor", "colour", "state"),
    [(0.99, "red", "exceeded"), (1.05, "amber", "small margin"), (1.2, "green", "within limit")],
)
def test_margin_of_a_limit_sets_the_colour(stop, factor, colour, state):
    said = stop.verdict({"stopping_time": factor * STOP, **AMPLE})
    assert said.colour == colour
    row = said.rows[0]
    assert (row.name, row.state) == ("Stopping time", state)
    assert row.margin.endswith(f"({100 * (1 - 1 / factor):.3g} %)".replace("-", "−"))
    (check,) = [c for c in limit_checks(stop, {"stopping_time": factor * STOP}) if c.name == "stopping_time"]
    assert check.margin_percent == pytest.approx(100 * (1 - 1 / factor), rel=1e-9)
    assert said.headline.startswith(f"Stopped after {STOP:.6g} s. ")
    assert ("Exceeded: Stopping time" in said.headline) == (colour == "red")


def test_rows_are_those_of_the_limits_the_smallest_margin_first(stop):
    within, exceeded = LimitVerdict.WITHIN, LimitVerdict.EXCEEDED
    checks = [
        LimitCheck("max_tension", 100.0, 30.0, "N", within),
        LimitCheck("full_slip_time", 4.0, None, "s", exceeded, "did not happen in this run"),
        LimitCheck("stopping_angle", None, 3.0, "rad", LimitVerdict.NO_LIMIT),
        LimitCheck("peak_rim_temperature", 280.0, 270.0, "K", within),  # a limit below 20 °C has no percentage
        LimitCheck("stopping_time", 4.0, 3.8, "s", within),
        LimitCheck("max_normal_load", 10.0, 11.0, "N", exceeded),
    ]
    said = stop.verdict(checks)
    assert said.rows[:3] == (
        ("Maximum load on a lining", "11 N", "≤ 10 N", "−1 N (−10 %)", "exceeded"),
        ("Stopping time", "3.8 s", "≤ 4 s", "0.2 s (5 %)", "small margin"),
        ("Maximum tension of the band", "30 N", "≤ 100 N", "70 N (70 %)", "within limit"),
    )
    assert [(row.value, row.margin) for row in said.rows[-2:]] == [
        ("did not happen in this run", "—"),
        ("−3.15 °C", "10 K"),
    ]
    assert said.headline == (
        f"Stopped after {STOP:.6g} s. Exceeded: Maximum load on a lining 11 N, allowed ≤ 10 N, margin −1 N "
        "(−10 %); Full slip t₁ did not happen in this run, allowed ≤ 4 s, margin —. "
        "Small margin: Stopping time 3.8 s, allowed ≤ 4 s, margin 0.2 s (5 %). "
        "2 of 2 limits given; not modelled: temperatures, lever force"
    )
    assert str(said) == f"red: {said.headline}"
    assert said.as_dict()["rows"][1]["state"] == "small margin"
    small = stop.verdict(checks[4:5])
    assert (small.colour, small.headline.count(". ")) == ("amber", 2)


def test_a_notebook_shows_the_verdict_metrics_and_warnings():
    fast = sb.simulate(sb.with_values(rigid(end=0.5), {"initial.omega": 200.0}))
    raw = fast._repr_html_()
    page = html.unescape(raw)
    (warning,) = fast.summary()["warnings"]
    told = ("#8a5a00", fast.verdict().headline, "max_tension", f"<p>warning: {warning}</p>")
    places = [page.index(text) for text in told]
    assert places == sorted(places)
    assert '"200 rpm"' in warning
    assert warning not in raw
    assert f">{T0 * PI / 1e3:.6g} kN<" in page.replace("> ", ">").replace(" <", "<")


def test_a_brake_that_is_open_at_the_end_is_amber():
    """Eased after its stop: the load speeds it up again; or a brake that never was closed."""
    said = sb.simulate(rigid(lever=(T0, T0, 0.0, 0.0), end=2.5)).verdict()
    assert said.colour == "amber"
    assert said.headline.startswith(f"Stopped after {STOP:.6g} s, then released. ")
    assert "released" not in sb.simulate(rigid()).verdict().headline
    free = sb.simulate(rigid(lever=(0.0,) * 4, end=0.5)).verdict()
    assert (free.colour, free.headline) == ("amber", "The brake is open at the end time")


@pytest.mark.parametrize(
    ("part", "colour", "state"), [(0.89, "green", "within limit"), (0.91, "amber", "small margin")]
)
def test_a_lever_near_its_maximum_is_amber(part, colour, state):
    pull = LOAD / (R * (PI - 1))
    most = pull / part
    said = sb.simulate(stop_scene(C=None, lever=sb.SpeedHold(most), load=LOAD, end=3.0)).verdict(AMPLE)
    row = said.rows[0]
    assert (said.colour, row.state) == (colour, state)
    assert row.limit == f"< {most / 1e3:.6g} kN"
    assert row.value.startswith(f"{pull / 1e3:.6g} kN (at ")
    assert row.margin == f"{most - pull:.4g} N ({100 * (1 - part):.3g} %)"
    assert said.headline.startswith("Lowered under the brake for 3 s. ")


def test_margin_of_a_temperature_is_that_of_its_rise_above_20_degrees():
    check = LimitCheck("peak_rim_temperature", 673.15, 654.15, "K", LimitVerdict.WITHIN)
    assert check.margin_percent == pytest.approx(100 * 19 / 380, rel=1e-12)
    assert check.margin_words == "19 K (5 %)"
    assert LimitCheck("peak_rim_temperature", 280.0, 290.0, "K", LimitVerdict.EXCEEDED).margin_percent is None


@pytest.mark.parametrize(("reserve", "colour"), [(1.2, "amber"), (1.3, "green")])
def test_small_holding_reserve_is_amber(reserve, colour):
    said = sb.simulate(rigid(TORQUE / reserve, w0=1.0)).verdict(AMPLE)
    assert said.colour == colour
    row = said.rows[0]
    assert row.value.startswith(f"{reserve:g} (at ")
    assert row.margin == f"+{100 * (reserve - 1):.3g} %"


def test_letting_a_load_go_is_not_a_small_reserve_but_breaking_away_is_red():
    eased = sb.simulate(rigid(lever=(T0, T0, T0, 0.0), w0=1.0, end=8.9))
    assert eased.metrics["min_holding_reserve"] == pytest.approx(TORQUE / LOAD)
    (row,) = eased.verdict().rows
    assert row.value.startswith(f"{TORQUE / LOAD:.4g} (at ")
    assert row.state == LimitVerdict.WITHIN
    torn = sb.simulate(rigid((LOAD, LOAD, 1.01 * TORQUE, 1.01 * TORQUE), w0=1.0, end=2.5))
    said = torn.verdict()
    assert said.colour == "red"
    assert [row.state for row in said.rows if row.name.startswith("Holding")] == [LimitVerdict.EXCEEDED]


def test_runs_that_end_turning():
    away = sb.simulate(rigid(1.25 * TORQUE, end=0.5))
    assert away.verdict().colour == "red"
    (row,) = away.verdict().rows
    assert (row.value, row.margin, row.state) == ("0.8 (at the end)", "−20 %", "exceeded")
    assert away.summary()["duty"] == "runaway"
    short = sb.simulate(rigid(end=0.2))
    assert (short.verdict().colour, short.summary()["duty"]) == ("amber", "turning")
    (row,) = short.verdict().rows
    assert row == (
        "Torque of the sliding brake over load",
        f"{TORQUE / LOAD:.4g} (at the end)",
        "> 1",
        f"+{100 * (TORQUE / LOAD - 1):.3g} %",
        "within limit",
    )
    assert short.verdict().headline == (
        f"The pulley still turns at the end time. No limit exceeded; smallest margin: {row.name}, {row.margin}. "
        "0 of 2 limits given, none for band tension, load on a lining; not modelled: temperatures, lever force"
    )
    driven = sb.simulate(rigid(-LOAD, end=0.2))  # the load brakes as well
    assert (driven.verdict().rows, driven.verdict().colour) == ((), "amber")
    assert "end      until 0.2 s: " in str(short)
    failed = sb.simulate(rigid(), max_steps=2, throw=False)
    assert (failed.verdict().colour, failed.summary()["duty"]) == ("red", "failed")
    assert failed.verdict().headline.startswith("Failed with the code step_limit")
    capped = failed.verdict([LimitCheck("max_tension", 2.0, 1.0, "N", LimitVerdict.WITHIN_SO_FAR)])
    margin = "No limit exceeded so far; smallest margin: Maximum tension of the band, 1 N (50 %). "
    assert margin in capped.headline


def test_limits_of_the_scene_are_evaluated():
    scene = sb.simulate(rigid()).scene
    band = sb.Band(R, strength=sb.brakes.Strength(band_area=2e-4, band_stress=150e6))
    scene = sb.Scene(sb.Brake(scene.brake.pulley, band, scene.brake.linings), scene.duty, scene.initial, scene.end_time)
    result = sb.simulate(scene)
    stress = T0 * PI / 2e-4
    (check,) = [check for check in limit_checks(result, {}) if check.name == "max_band_stress"]
    assert check.value == pytest.approx(stress, rel=1e-9)
    assert check.verdict == "exceeded"
    assert result.verdict().colour == "red"
    found = summary_with_limits(result, limit_checks(result, {}))
    assert found["verdict"]["colour"] == "red"
    assert found["limits"][0]["margin_percent"] == pytest.approx(100 * (1 - stress / 150e6), rel=1e-9)
    json.dumps(found, allow_nan=False)


def hot_stop(**permissible):
    """A rim without cooling takes all the heat of a stop, linings none: its temperature is its share of the work."""
    heat = sb.lumped_heat(rim=500.0, linings=2e4, partition=1.0, rim_cooling=0.0, **permissible)
    return dataclasses.replace(rigid(), heat=heat)


def test_hottest_body_comes_first_and_what_has_no_limit_is_named():
    """Linings stay cold below their limit; the rim glows, and has none."""
    hot = 293.15 + TORQUE * ANGLE / 500.0
    result = sb.simulate(hot_stop(permissible=400.0))
    assert result.metrics["peak_rim_temperature"] == pytest.approx(hot, rel=1e-9)
    said = result.verdict()
    assert said.colour == "amber"
    assert f". Hottest: rim {hot - 273.15:.6g} °C, no limit given. " in said.headline
    assert said.headline.endswith(
        "1 of 4 limits given, none for band tension, load on a lining, rim temperature; not modelled: lever force"
    )
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
        assert result.verdict({other: 1e9 for other in named if other != name}).colour == "amber"
    assert lines(result)["hottest"].startswith(f"hottest  rim {hot - 273.15:.5g} °C")
    assert [check.name for check in limit_checks(result, {})][:2] == [
        "peak_rim_temperature",
        "peak_lining_temperature",
    ]


def test_permissible_temperature_of_the_rim_is_an_event_and_a_limit():
    """Half of the work of the stop is done where `ω t − a t²/2` is half of the angle."""
    limit = 293.15 + 0.5 * TORQUE * ANGLE / 500.0
    result = sb.simulate(hot_stop(permissible_rim=limit))
    (event,) = result.events["permissible_rim_temperature"]
    assert event.time == pytest.approx(STOP * (1 - math.sqrt(0.5)), rel=1e-9)
    said = result.verdict(AMPLE)
    assert said.colour == "red"
    row = next(row for row in said.rows if row.name == "Hottest rim surface")
    assert (row.state, row.limit) == ("exceeded", f"≤ {limit - 273.15:.6g} °C")
    assert "rim temperature" not in said.judged.missing
    assert result.verdict({**AMPLE, "peak_rim_temperature": 1e9, "peak_lining_temperature": 1e9}).colour == "green"
    with pytest.raises(sb.InputError, match="permissible_band: the network names no place as the band"):
        sb.check(hot_stop(permissible_band=400.0))


def test_permissible_pressure_is_a_limit():
    linings = sb.uniform_linings(20, "270 deg", 0.35, area=0.02, permissible_pressure="1 MPa")
    scene = rigid()
    brake = dataclasses.replace(scene.brake, linings=linings)
    result = sb.simulate(dataclasses.replace(scene, brake=brake))
    (check,) = [check for check in limit_checks(result, {}) if check.name == "max_pressure"]
    assert check.value == pytest.approx(result.metrics["max_normal_load"] / 0.02, rel=1e-9)
    assert (check.limit, check.note) == (1e6, "lining 20")
    assert result.verdict({"max_tension": 1e9}).judged.missing == {}
    without = dataclasses.replace(brake, linings=dataclasses.replace(linings, area=None))
    with pytest.raises(sb.InputError, match="a permissible pressure needs the area"):
        sb.check(dataclasses.replace(scene, brake=without))


def test_run_prints_the_verdict_first(tmp_path, capsys, stop):
    file = tmp_path / "stop.toml"
    sb.write_scene(stop.scene, file)
    with pytest.raises(SystemExit) as ended:
        main(["run", str(file), "--limit", f"stopping_time={1.05 * STOP}", "--fail-on-limit"])
    assert ended.value.code == 0
    second, third = capsys.readouterr().out.splitlines()[1:3]
    assert second.startswith("verdict  amber: Stopped after")
    assert third.startswith("limit    stopping_time within limit: ")
    assert "(4.76 %)" in third


# --- the duty of a run ------------------------------------------------------------------------------------------------


def test_summary_of_one_stop(stop):
    assert stop.summary()["duty"] == "stop"
    assert lines(stop)["stop"].startswith(f"stop     after {STOP:.6g} s, {ANGLE:.6g} rad")


def test_summary_of_many_stops_has_totals_and_the_worst():
    """Two stops: the second after the load has sped the open brake up for half a second."""
    lever = sb.PiecewiseLinear([0.0, 2.0, 2.0, 2.5, 2.5, 9.0], [T0, T0, 0.0, 0.0, T0, T0])
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 1.0, 2.0, 3.0, 4.0, 9.0], [LOAD] * 6))
    result = sb.simulate(stop_scene(C=None, lever=lever, load=load, end=4.0))
    second = 0.5 * LOAD / (TORQUE - LOAD)
    text = lines(result)
    assert result.summary()["duty"] == "stops"
    assert f"braked {STOP + second:.6g} s" in text["total"]
    assert f"in motion {STOP + 0.5 + second:.6g} s" in text["total"]
    assert f"longest braking {max(STOP, second):.6g} s in stop 1" in text["worst"]
    assert "onset" not in text
    assert "2 × stop" in text["events"]
    assert result.verdict().headline.startswith("2 stops; at the end stopped")
    # a page shows the same, and nothing of the first stop alone
    figures = {words: (value.text, note) for words, value, note in key_figures(result.summary())}
    assert figures["Stops"] == ("2", "")
    assert figures["Time of braking"][0] == f"{STOP + second:.5g}"
    assert figures["Longest braking"] == (f"{max(STOP, second):.5g}", "in stop 1")
    assert not {"Stopping time", "Angle to the first stop"} & set(figures)


def test_summary_of_a_held_load():
    result = sb.simulate(rigid(w0=0.0))
    held = lines(result)["held"]
    assert result.summary()["duty"] == "hold"
    assert f"load torque {LOAD / 1e3:.6g} kN·m under a static capacity of at least {TORQUE / 1e3:.6g} kN·m" in held
    assert result.summary()["holding"]["capacity"] == pytest.approx(TORQUE, rel=1e-9)


def test_summary_of_a_lowering_under_the_brake():
    """The lever needs `M_load/(R (Π − 1))` of its 8 kN."""
    result = sb.simulate(stop_scene(C=None, lever=sb.SpeedHold(T0), load=LOAD, end=3.0))
    pull = LOAD / (R * (PI - 1))
    assert result.summary()["duty"] == "drag_lowering"
    assert f"at most {pull / 1e3:.6g} kN of 8 kN" in lines(result)["lever"]
    assert f"mean power of the load {LOAD * W0 / 1e3:.6g} kW" in lines(result)["speed"]
    (row,) = result.verdict().rows
    assert f"({100 * (1 - pull / T0):.3g} %)" in row.margin
    assert result.verdict(AMPLE).colour == "green"


def test_summaries_of_disc_shoe_and_staged_brakes():
    disc, shoe = sb.simulate(disc_scene()), sb.simulate(shoe_scene())
    for result, lining in ((disc, "pad"), (shoe, "shoe")):
        assert "tension" not in lines(result)
        assert f"the {lining}s act from" in lines(result)["onset"]
    both = sb.simulate(staged.stop())
    assert lines(both)["staged"].startswith("staged   internal slip")
    assert both.summary()["duty"] == "stop"


# --- the text of a summary, line by line ------------------------------------------------------------------------------


def summary_by_hand(duty="stop", *, energy=(), metrics=(), at=(), events=(), **other):
    """A summary with numbers of one digit."""
    return {
        "status": "stopped",
        "message": "it stands",
        "duty": duty,
        "events": [{"name": name, "time": t} | ({} if i is None else {"lining": i}) for name, t, i in events],
        "end": {"time": 5.0, "duration": 4.0, "angle": 9.0, "omega": 2.0, "hook_travel": None},
        "metrics": {
            **{"slip_onset_time": 0.5, "full_slip_time": 0.75, "stopping_time": 2.0, "stopping_angle": 9.0},
            **{"hook_travel": None, "max_tension": 3e3, "max_normal_load": 4e3, **dict(metrics)},
        },
        "at": {
            **{"max_tension_lining": 7, "max_tension_time": 0.125, "max_normal_load_lining": 6},
            **{"max_normal_load_time": 0.25, **dict(at)},
        },
        "distribution": "mobilisation",
        "warnings": [],
        "energy": {
            **{"load_work": 5e3, "lever_work": 1e3, "kinetic_change": -6e3, "friction_heat": 12e3, "closure": 2e-16},
            **dict(energy),
        },
        "solver": {
            **{"method": "Dopri8", "reason": "it is fast", "rtol": 1e-9},
            **{"steps": 9, "rejected": 8, "retaken": 7, "segments": 6},
        },
        **other,
    }


def lines_by_hand(*arguments, **named):
    return _report.text(summary_by_hand(*arguments, **named)).splitlines()


def test_text_of_a_summary():
    events = [
        ("slip_onset", 0.5, None),
        ("lining_limit", 0.5, 1),
        ("lining_limit", 0.625, 2),
        ("lining_limit", 0.75, 3),
    ]
    summary = summary_by_hand(events=[*events, ("stop", 2.0, None)], warnings=["look", "here"])
    assert _report.text(summary, ["first", "second"]).splitlines() == [
        "stopped: it stands",
        "first",
        "second",
        "events   slip onset 0.5 s, lining limits 1…3 0.5…0.75 s, stop 2 s",
        "onset    slip onset t0 0.5 s, full slip 0.75 s",
        "stop     after 2 s, 9 rad",
        "tension  at most 3 kN behind lining 7 at 0.125 s",
        "load     at most 4 kN on lining 6 at 0.25 s",
        "energy   load 5 kJ + lever 1 kJ + kinetic 6 kJ = friction heat 12 kJ",
        f"closure  relative energy-balance residual 2.0e-16 ({RESIDUAL_SEES})",
        "solver   Dopri8, rtol 1e-09: 9 steps, 8 rejected, 7 truncated at events, 6 segments",
        "warning  look",
        "warning  here",
    ]


def test_lines_that_only_some_summaries_have():
    plain = lines_by_hand()
    assert plain[1] == "events   none"

    def added(*arguments, **named):
        return [line for line in lines_by_hand(*arguments, **named) if line not in plain]

    assert added(lining="pad")[:2] == [
        "onset    the pads act from 0.5 s, full slip 0.75 s",
        "load     at most 4 kN on pad 6 at 0.25 s",
    ]
    assert added(metrics={"hook_travel": 3.0}) == ["stop     after 2 s, 9 rad, hook travel 3 m"]
    on = {"time": 5.0, "duration": 4.0, "angle": 30.0, "omega": 2.0, "hook_travel": 8.0}
    assert added(end=on) == ["run      30 rad, hook travel 8 m in all, at the end turning at 2 rad/s"]
    assert added(distribution="by stiffness") == ["split    by stiffness"]
    assert added(metrics={"min_holding_reserve": 1.5}, at={"min_holding_reserve_time": 3.0}) == [
        "holding  static capacity at least 1.5 times the load, at 3 s"
    ]
    hook = {"max_hook_load": 7e3, "max_hook_load_over_weight": 1.25}
    assert added(metrics=hook, at={"max_hook_load_time": 3.0}) == [
        "hook     at most 7 kN at 3 s; at most 1.25 times its weight"
    ]
    assert not [line for line in lines_by_hand("hold", holding=None) if line.startswith(("onset", "stop "))]
    never = {"stopping_time": None}
    assert [line.split()[0] for line in lines_by_hand("turning", metrics=never)][2:4] == ["onset", "end"]
    never["slip_onset_time"] = None
    assert lines_by_hand("turning", metrics=never)[2].startswith("end")
    many = [("stop", 1.0, None), ("restart", 2.0, None), ("stop", 3.0, None)]
    stops = [
        {"stop": i, "time": 1.0, "motion_time": 1.0, "braking_time": 1.0, "angle": 1.0, "energy": 1.0} for i in (1, 2)
    ]
    listed = lines_by_hand("stops", events=many, stops=stops)
    assert listed[1] == "events   2 × stop, 1 × restart"
    assert listed[listed.index("stops") + 1].split()[:2] == ["stop", "time,"]
    assert len(listed) - listed.index("stops") == 4
    same = [(f"event_{i}", float(i), None) for i in range(13)]
    assert lines_by_hand(events=same[:12])[1].count(",") == 11
    assert lines_by_hand(events=same)[1] == (
        "events   event 0 0 s, event 1 1 s, event 2 2 s, event 3 3 s, event 4 4 s, event 5 5 s, … 3 more …, "
        "event 9 9 s, event 10 10 s, event 11 11 s, event 12 12 s"
    )
    mixed = [("lining_limit", 1.0, 2), ("grip_lost", 1.5, None), ("lining_limit", 2.0, 3), ("lining_slip", 2.0, 3)]
    assert lines_by_hand(events=mixed)[1] == (
        "events   lining limit 2 1 s, grip lost 1.5 s, lining limit 3 2 s, lining slip 3 2 s"
    )


def test_energy_is_on_the_side_where_it_is_positive():
    def energy_line(**energy):
        (line,) = [line for line in lines_by_hand(energy=energy) if line.startswith("energy")]
        return line

    gained = energy_line(kinetic_change=2e3, shaft_work=1e3, elastic_change=-1e3)
    assert gained == (
        "energy   load 5 kJ + lever 1 kJ = friction heat 12 kJ + other torques on the shaft 1 kJ + elastic -1 kJ"
        " + kinetic energy gained 2 kJ"
    )
    others = {"damper_heat": 1e3, "electrical_work": 2e3, "mechanical_work": 3e3}
    assert energy_line(**others).endswith("= friction heat 12 kJ + dampers 1 kJ + electrical 2 kJ + mechanical 3 kJ")
    # what rounding leaves of a balance is no gain
    assert "kinetic 0 kJ" in energy_line(kinetic_change=0.0)
    assert "kinetic -4e-09 kJ" in energy_line(kinetic_change=4e-6)
    assert "gained 6e-09 kJ" in energy_line(kinetic_change=6e-6)
    assert "gained 1e-09 kJ" in energy_line(kinetic_change=1e-6, load_work=0.0)
    assert energy_line(kinetic_change=None, load_work=None) == (
        "energy   load — kJ + lever 1 kJ + kinetic — kJ = friction heat 12 kJ"
    )
    assert lines_by_hand(energy={"closure": None})[-2].endswith("residual —")


def test_lines_of_heat():
    heat = {"heat_stored": 7e3, "heat_lost": 5e3, "heat_to_metal": 9e3, "heat_to_linings": 3e3, "heat_closure": 1e-9}
    heat |= {"heat_to_band": 0.0, "heat_supplied": 0.0}
    found = lines_by_hand(energy=heat)
    assert found[-1] == "method   Dopri8: it is fast"
    assert found[-5] == "hottest  the scene names no rim, linings or band"
    assert found[-4] == "heat     to metal 9 kJ + to linings 3 kJ = stored 7 kJ + lost 5 kJ (residual 1.0e-09)"
    heat |= {"heat_to_metal": 7e3, "heat_to_band": 1e3, "heat_elsewhere": 1e3, "shaft_work": 3e3, "heat_supplied": -2e3}
    hot = {"peak_rim_temperature": 373.15, "peak_lining_temperature": 473.15, "peak_band_temperature": None}
    when = {"peak_rim_temperature_time": 1.0, "peak_lining_temperature_time": 2.0}
    marks = [("grip_lost", 3.0, None), ("grip_lost", 1.0, None), ("self_locking", 2.0, None)]
    marks += [("permissible_temperature", 4.0, 2)]
    found = lines_by_hand(energy=heat, metrics=hot, at=when, events=marks, lining="pad", body="disc")
    assert found[-6:-3] == [
        "marks    permissible temperature exceeded once, at 4 s, grip lost 2 times, first at 1 s, "
        "self-locking once, at 2 s",
        "hottest  pads 200 °C at 2 s, disc 100 °C at 1 s",
        "heat     to metal 7 kJ + to linings 3 kJ + to band 1 kJ + to no body 1 kJ + other torques on the shaft 3 kJ"
        " + supplied -2 kJ = stored 7 kJ + lost 5 kJ (residual 1.0e-09)",
    ]
    assert "hottest  linings 200 °C at 2 s, rim 100 °C at 1 s" in lines_by_hand(energy=heat, metrics=hot, at=when)


def test_lines_of_wear_and_stages():
    def worn(**metrics):
        return [line for line in lines_by_hand(metrics=metrics, worn_thickness=[1e-6, 3e-6, 2e-6]) if "wear" in line]

    wear = {"greatest_wear": 3e-6, "wear_over_mean": 1.5, "wear_over_least": 3.0}
    assert worn(**wear) == ["wear     at most 3 µm on lining 2, 1.5 times the mean, 3 times the least"]
    assert worn(**wear | {"wear_over_least": None}) == ["wear     at most 3 µm on lining 2, 1.5 times the mean"]
    assert worn(**wear | {"wear_over_mean": None}) == ["wear     none: no lining slid"]
    assert worn(greatest_wear=None) == []
    stage = {"name": "stage_2", "start": 0.5, "end": 2.0, "heat_external": 8e3, "heat_internal": 4e3}
    found = lines_by_hand(
        energy={"heat_external": 9e3, "heat_internal": 3e3},
        metrics={"internal_slip_time": 0.5, "external_lock_time": None},
        stages=[stage],
        absent_stages=[{"name": "stage_3", "reason": "it never slid"}],
    )
    assert found[4:7] == [
        "staged   internal slip 0.5 s, external lock —; heat external 9 kJ + internal 3 kJ",
        "         0.5…2 s stage_2: external 8 kJ, internal 4 kJ",
        "         no stage_3: it never slid",
    ]


def test_text_of_a_summary_in_units_of_rigs():
    """1 klbf is 4448.22 N, 1 ft·lbf 1.355818 J, 1 in 25.4 mm."""
    heat = {"heat_stored": 1.0, "heat_lost": 5e3, "heat_to_metal": 9e3, "heat_to_linings": 3e3, "heat_closure": 1e-9}
    heat |= {"heat_to_band": 0.0, "heat_supplied": 0.0}
    wear = {"greatest_wear": 25.4e-6, "wear_over_mean": 1.5, "wear_over_least": None}
    metrics = wear | {"max_tension": 4448.2216152605, "peak_rim_temperature": 373.15, "hook_travel": 3.048}
    with sb.results.shown_in("rig"):
        found = lines_by_hand(
            energy=heat | {"friction_heat": 2711.6358966628},
            metrics=metrics,
            at={"peak_rim_temperature_time": 1.0},
            worn_thickness=[25.4e-6],
        )
    text = "\n".join(found)
    assert "stop     after 2 s, 9 rad, hook travel 10 ft" in text
    assert "tension  at most 1 klbf behind lining 7" in text
    assert "friction heat 2 ft·klbf" in text
    assert "hottest  rim 212 °F at 1 s" in text
    assert "wear     at most 0.001 in on lining 1" in text


# --- limits and their words -------------------------------------------------------------------------------------------


def test_a_check_of_a_limit_in_words():
    def said(value, limit, verdict=LimitVerdict.WITHIN, unit="N", note=""):
        return str(LimitCheck("max_tension", limit, value, unit, verdict, note))

    assert said(90.0, 120.0) == "max_tension within limit: 90 N, limit 120 N, margin 30 N (25 %)"
    assert said(120.0, 90.0, LimitVerdict.EXCEEDED, note="maximum at 2 s").endswith("N (−33.3 %) (maximum at 2 s)")
    assert said(1.0, -2.0) == "max_tension within limit: 1 N, limit −2 N, margin −3 N"
    assert "margin" not in said(90.0, None)
    assert "margin" not in said(None, 90.0)
    assert LimitCheck("x", 0.0, 1.0, "N", LimitVerdict.EXCEEDED).margin_percent is None
    colours = {one.value: one.colour for one in LimitVerdict}
    assert colours == {
        "within limit": "green",
        "within limit so far": "green",
        "small margin": "amber",
        "exceeded": "red",
        "no limit": None,
        "not evaluated": None,
    }


def test_limits_are_read_from_texts_with_all_their_faults(stop):
    scene = stop.scene
    limits, wrong = parse_limits(scene, ["max_tension = 120 kN", "stopping_time=2", "energy.friction_heat=1 MJ"])
    assert (limits, wrong) == ({"max_tension": 120e3, "stopping_time": 2.0, "energy.friction_heat": 1e6}, [])
    texts = ["max_tension", "=3", "stopping_time=", "stopping_angle=1", "stopping_angle=2", "max_pressure=1 MPa"]
    limits, wrong = parse_limits(scene, [*texts, "stoping_time=1", "peak_rim_temperature=300", "max_normal_load=1 s"])
    assert limits == {"stopping_angle": 2.0, "max_pressure": 1e6}
    told = [f"{fault.path}: {fault.problem}" for fault in wrong]
    for words in (
        "--limit max_tension: is not of the form METRIC=VALUE",
        "--limit =3: is not of the form",
        "--limit stopping_time=: is not of the form",
        "--limit stopping_angle: is given twice",
        "--limit max_pressure: needs the areas of the linings",
        "stoping_time: is not a metric of this scene",
        "peak_rim_temperature: is not a metric of this scene",
        "--limit max_normal_load: '1 s'",
    ):
        assert any(text.startswith(words) for text in told), (words, told)
    assert len(wrong) == 8
    wide = sb.with_values(scene, {"brake.linings.area": 0.02})
    assert read_limits(wide, {"max_pressure": "1 MPa", "stopping_time": np.float64(3.0)}) == (
        {"max_pressure": 1e6, "stopping_time": 3.0},
        [],
    )
    assert not has_limit(scene, {})
    assert has_limit(scene, {"stopping_time": 3.0})
    worn = dataclasses.replace(wide, wear=sb.Wear(1e-14))
    assert not has_limit(worn, {})
    assert has_limit(dataclasses.replace(worn, wear=sb.Wear(1e-14, permissible=8e-3)), {})


def test_what_did_not_happen_exceeds_a_limit_only_in_a_whole_run(stop):
    turning, failed = sb.simulate(rigid(end=0.2)), sb.simulate(rigid(), max_steps=2, throw=False)
    for result, verdict, note in (
        (turning, "exceeded", "did not happen in this run"),
        (failed, "not evaluated", "the run failed before it happened"),
    ):
        (check,) = [c for c in limit_checks(result, {"stopping_time": 3.0}) if c.name == "stopping_time"]
        assert (check.value, check.verdict, check.note) == (None, verdict, note)
    (check,) = [c for c in limit_checks(failed, {"max_tension": 1e9}) if c.name == "max_tension"]
    assert check.verdict == "within limit so far"
    value = float(stop.max_tension.value)
    for bound, verdict in ((value, "within limit"), (value * (1 - 1e-12), "exceeded")):
        (check,) = [c for c in limit_checks(stop, {"max_tension": bound}) if c.name == "max_tension"]
        assert (check.verdict, check.value) == (verdict, value)
        assert check.note.startswith("maximum at ")
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
    assert [c.name for c in limit_checks(stop, {"max_tension": 1.0})[1:]] == ["max_normal_load", "max_tension"]


def test_metrics_have_titles_units_and_near_names(stop):
    assert title_of("energy.friction_heat") == "Energy: friction heat"
    assert title_of("max_pressure") == "Maximum mean pressure on a lining"
    assert title_of("max_tension_time") == f"{title_of('max_tension')}, when"
    assert title_of("stopping_time") == "Stopping time"
    assert title_of("own_number") == "Own number"
    assert [unit_of(name) for name in ("max_tension", "energy.load_work", "nothing", len)] == ["N", "J", "", ""]
    assert name_of(len) == "len"
    assert name_of(functools.partial(len)) == "partial"
    assert named(stop, "stopping_time") == float(stop.stopping_time)
    with pytest.raises(KeyError, match="'stoping_time' is not a metric of this scene; nearest: stopping_time"):
        named(stop, "stoping_time")
    with pytest.raises(KeyError, match=r"there are: .*, or a function of the result"):
        named(stop, "§")


# --- what a run could not see -----------------------------------------------------------------------------------------


def _with_a_pulse(t, begin):
    return LOAD + jnp.where((t > begin) & (t < begin + 0.02), 20 * TORQUE, 0.0)


def test_note_says_how_often_a_user_defined_function_was_looked_at():
    """20 ms in 100 s are missed, and the note says that such a pulse may be; a shorter step finds it."""
    profile = sb.profiles.FunctionProfile(_with_a_pulse, 50.33, typical=LOAD)
    scene = stop_scene(C=None, load=sb.TorqueLoad(profile), end=100.0)
    (note,) = sb.simulate(scene).summary()["notes"]
    assert note.startswith("sampled: the load is a user-defined function of time; this run looked at least every ")
    interval = float(re.search(r"every ([\d.]+) ms", note)[1]) / 1e3
    assert 0.02 < interval <= 100.0 / 1024 * 1.01
    fine = sb.simulate(scene, max_step=0.1)
    assert any(line.startswith("note     sampled: the load") for line in str(fine).splitlines())
    assert "at least every 6.25 ms" in fine.summary()["notes"][0]  # 0.1 s/16
    assert [event.time for event in fine.events["restart"]] == [pytest.approx(50.33, abs=1e-9)]
    assert sb.simulate(rigid()).summary()["notes"] == []
