"""Units of a rig at the boundary: numbers read and shown in them, and values that are most likely in another unit."""

import json
import math
import pathlib
import re

import pint
import pytest
from helpers import main
from shipped import NAMES, load
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._base._table import number, to_si, unit
from simbrake._parts._scene import warnings
from simbrake.results import shown_in

POUND, G, FOOT = 0.45359237, 9.80665, 0.3048


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("klbf", "N", 1e3 * POUND * G),
        ("lbf", "N", POUND * G),
        ("tf", "N", 1e3 * G),
        ("klbf", "kg", 1e3 * POUND),
        ("kN", "kg", 1e3 / G),
        ("lb", "kg", POUND),
        ("ft", "m", FOOT),
        ("in", "m", FOOT / 12),
        ("ft/min", "m/s", FOOT / 60),
        ("ft·lbf", "N*m", POUND * G * FOOT),
        ("ft*klbf", "J", 1e3 * POUND * G * FOOT),
        ("hp", "W", 550 * POUND * G * FOOT),
        ("psi", "Pa", POUND * G / (FOOT / 12) ** 2),
    ],
)
def test_units_of_a_rig_are_read(text, si, value):
    assert to_si(1.0, unit(text, si)) == pytest.approx(value, rel=1e-15)


#: spellings with the engineering meaning, or with one that pint has not
OWN = {
    ("1/min", "rad/s"): math.pi / 30, ("rev/s", "rad/s"): 2 * math.pi, ("rev", "rad"): 2 * math.pi, ("C", "K"): 274.15,
    ("lbf", "kg"): POUND, ("klbf", "kg"): 1e3 * POUND, ("kN", "kg"): 1e3 / G, ("tf", "kg"): 1e3, ("t", "N"): 1e3 * G,
    ("Nm", "N*m"): 1.0, ("kNm", "N*m"): 1e3, ("-", "1"): 1.0,
}  # fmt: skip


def test_every_known_unit_is_that_of_a_library_of_units():
    """All spellings that a message offers, one of each in SI, against pint."""
    seen, registry = set(), pint.UnitRegistry()
    for si in ["s", "rad", "rad/s", "m", "m/s", "m^2", "kg", "N", "N/m", "N*s/m", "N*m", "Pa", "J", "W", "1", "K"]:
        with pytest.raises(ValueError, match="known here: ") as told:
            unit("unknown", si)
        for name in re.search(r"known here: ([^;]*)", str(told.value))[1].split(", "):
            truth = OWN.get((name, si)) or registry.Quantity(1.0, name).to("" if si == "1" else si).magnitude
            assert to_si(1.0, unit(name, si)) == pytest.approx(truth, rel=1e-14), (name, si)
            seen.add((name, si))
    assert seen >= {*OWN, ("bar", "Pa"), ("kJ", "J"), ("degF", "K"), ("%", "1")}


def test_degrees_fahrenheit_are_read_and_a_difference_is_not():
    assert to_si(212.0, unit("degF", "K")) == pytest.approx(373.15, rel=1e-15)
    assert to_si(-40.0, unit("°F", "K")) == pytest.approx(233.15, rel=1e-15)
    fade = sb.LinearFade(slope=1e-3, above="250 degF")
    assert float(fade.above) == pytest.approx(394.2611111111111, rel=1e-14)
    with pytest.raises(sb.InputError, match="a temperature, not a difference"):
        sb.LinearFade(slope=1e-3, above="250 degF", blend="10 degF")


def test_a_scene_in_units_of_a_rig():
    hook = sb.HookLoad("220 klbf", "15.75 in", 8)
    assert float(hook.mass) == pytest.approx(220e3 * POUND, rel=1e-15)
    assert float(hook.drum_radius) == pytest.approx(0.40005, rel=1e-15)
    assert float(sb.Lever("100 lbf", "4 ft", "3 in").gain) == pytest.approx(16.0, rel=1e-15)


def test_numbers_are_shown_in_units_of_a_rig():
    with shown_in("rig"):
        shown = [str(number(x, of)) for x, of in ((1e5, "N"), (1e3, "J"), (2.0, "m"), (0.01, "m"), (300.0, "K"))]
        assert str(number(10.0, "K", absolute=False)) == "18 °F"
        assert str(number(0.0, "J")) == "0 ft·lbf"
    assert shown == ["22.4809 klbf", "0.737562 ft·klbf", "6.56168 ft", "0.393701 in", "80.33 °F"]
    assert str(number(1e5, "N")) == "100 kN"


def test_run_prints_units_of_a_rig_and_json_stays_in_si(tmp_path, capsys):
    file = tmp_path / "stop.toml"
    sb.write_scene(stop_scene(), file)
    printed = {}
    for options in ((), ("--units", "rig"), ("--json",), ("--json", "--units", "rig")):
        with pytest.raises(SystemExit) as end:
            main(["run", str(file), *options])
        assert end.value.code == 0
        printed[options] = capsys.readouterr().out
    tension = json.loads(printed["--json",])["metrics"]["max_tension"]
    assert f"at most {tension / 1e3:.6g} kN" in printed[()]
    assert f"at most {tension / POUND / G / 1e3:.6g} klbf" in printed["--units", "rig"]
    assert "kN" not in printed["--units", "rig"]
    assert printed["--json",] == printed["--json", "--units", "rig"]


def test_the_table_of_stops_is_in_units_of_a_rig_and_its_rows_in_si():
    """Two stops by hand: their travel in feet, their heat in ft·klbf, the hottest lining in °F."""
    lever = sb.PiecewiseLinear([0.0, 2.0, 2.0, 3.0, 3.0], [9e3, 9e3, 0.0, 0.0, 9e3])
    brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35))
    heat = sb.lumped_heat(rim=2e5, linings=4e4, rim_cooling=5.0, partition=0.8)
    scene = sb.Scene(brake, sb.Duty(lever, sb.HookLoad(20e3, 0.4, 8)), sb.Initial(10.0), 5.0, heat)
    result = sb.simulate(scene)
    rows = list(result.stops)
    assert len(rows) == 2
    with shown_in("rig"):
        head, first, _ = str(result.stops).splitlines()
        assert list(result.stops) == rows
        whole = str(result)
    for words in ("travel, ft", "energy, ft·klbf", "hottest linings, °F"):
        assert words in head
        assert words in whole
    shown = [rows[0]["travel"] / FOOT, rows[0]["energy"] / (1e3 * POUND * G * FOOT)]
    shown = [f"{shown[0]:.5g}", f"{shown[1]:.6g}", f"{rows[0]['peak_lining_temperature'] * 1.8 - 459.67:.5g}"]
    assert all(text in first.split() for text in shown)
    assert "travel, m" in str(result.stops)
    assert "energy, kJ" in str(result)


def test_mistaken_units_are_asked_about():
    scene = load("thermal_stabilisation").scene()
    for path, value, meant in (
        ("duty.load.mass", "45", 'did you mean "45 t"?'),
        ("initial.omega", 190.0, 'did you mean "190 rpm" (19.9 rad/s)?'),
        ("heat.bodies[0].temperature", 20.0, 'did you mean "20 degC"?'),
    ):
        (said,) = warnings(sb.with_values(scene, {path: value}))
        assert said.startswith(f"unit: {path} = ")
        assert said.endswith(meant)
    friction = sb.ConstantFriction(0.35)
    with pytest.raises(sb.InputError, match=r'14 rad is out of range.*did you mean "14 deg"'):
        sb.uniform_linings(20, 280.0, friction)
    many = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(200, 280.0, friction))
    with pytest.raises(sb.InputError, match='did you mean "280 deg"'):
        sb.check(sb.Scene(many, sb.Duty(1e3, 0.0), sb.Initial(1.0), 1.0))


@pytest.mark.parametrize("name", NAMES)
def test_shipped_scenarios_are_not_asked_about(name):
    assert not [text for text in warnings(load(name).scene()) if text.startswith("unit")]


def test_shipped_scene_files_are_not_asked_about():
    files = list((pathlib.Path(__file__).parents[2] / "scenarios").glob("*.toml"))
    assert files
    for file in files:
        assert not [text for text in warnings(sb.read_scene(file)) if text.startswith("unit")]
