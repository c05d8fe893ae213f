"""The verdict on a run, its colour and margins, and the summary that fits the duty; numbers by hand."""

import html
import json
import math

import pytest
import staged_scenes as staged
from helpers import main, stop_scene
from test_disc import disc_scene
from test_double_shoe import shoe_scene

import simbrake as sb
from simbrake._pages._rows import key_figures
from simbrake._run._measure import LimitVerdict, summary_with_limits
from simbrake.results import LimitCheck, limit_checks

J, W0, R, T0, LOAD = 800.0, 20.0, 0.725, 8e3, 1.2e4
Z = math.tan(math.radians(13.5) / 2)
PI = ((1 + 0.35 * Z) / (1 - 0.35 * Z)) ** 20
TORQUE = R * T0 * (PI - 1)
STOP = J * W0 / (TORQUE - LOAD)
ANGLE = STOP * W0 / 2


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
    said = stop.verdict({"stopping_time": factor * STOP})
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
        "Small margin: Stopping time 3.8 s, allowed ≤ 4 s, margin 0.2 s (5 %)"
    )
    assert str(said) == f"red: {said.headline}"
    assert said.as_dict()["rows"][1]["state"] == "small margin"
    small = stop.verdict(checks[4:5])
    assert (small.colour, small.headline.count(". ")) == ("amber", 1)


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
    said = sb.simulate(stop_scene(C=None, lever=sb.SpeedHold(most), load=LOAD, end=3.0)).verdict()
    (row,) = said.rows
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
    said = sb.simulate(rigid(TORQUE / reserve, w0=1.0)).verdict()
    assert said.colour == colour
    (row,) = said.rows
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
        f"The pulley still turns at the end time. No limit exceeded; smallest margin: {row.name}, {row.margin}"
    )
    driven = sb.simulate(rigid(-LOAD, end=0.2))  # the load brakes as well
    assert (driven.verdict().rows, driven.verdict().colour) == ((), "amber")
    assert "end      until 0.2 s: " in str(short)
    failed = sb.simulate(rigid(), max_steps=2, throw=False)
    assert (failed.verdict().colour, failed.summary()["duty"]) == ("red", "failed")
    assert failed.verdict().headline.startswith("Failed with the code step_limit")
    capped = failed.verdict([LimitCheck("max_tension", 2.0, 1.0, "N", LimitVerdict.WITHIN_SO_FAR)])
    assert capped.headline.endswith(
        "No limit exceeded so far; smallest margin: Maximum tension of the band, 1 N (50 %)"
    )


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
    assert not {"Stopping time", "Angle to the stop"} & set(figures)


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
    assert result.verdict().colour == "green"


def test_summaries_of_disc_shoe_and_staged_brakes():
    disc, shoe = sb.simulate(disc_scene()), sb.simulate(shoe_scene())
    for result, lining in ((disc, "pad"), (shoe, "shoe")):
        assert "tension" not in lines(result)
        assert f"the {lining}s act from" in lines(result)["onset"]
    both = sb.simulate(staged.stop())
    assert lines(both)["staged"].startswith("staged   internal slip")
    assert both.summary()["duty"] == "stop"
