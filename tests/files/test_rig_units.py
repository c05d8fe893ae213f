"""Units of a rig at the boundary: numbers read and shown in them, and values that are
most likely in another unit."""

import json
import re

import equinox as eqx
import pytest
from commands import call
from shipped import FOLDER, NAMES, load
from stop_scenes import stop_scene

import simbrake as sb
from simbrake.results import display_units

POUND = 0.45359237
G = 9.80665
FOOT = 0.3048


def test_fahrenheit_is_no_difference():
    fade = sb.LinearFade(slope=1e-3, above="250 degF")
    assert float(fade.above) == pytest.approx(394.2611111111111, rel=1e-14)
    with pytest.raises(sb.InputError, match="a temperature, not a difference"):
        sb.LinearFade(slope=1e-3, above="250 degF", blend="10 degF")


def test_a_scene_in_units_of_a_rig():
    hook = sb.HookLoad("220 klbf", "15.75 in", 8)
    assert float(hook.mass) == pytest.approx(220e3 * POUND, rel=1e-15)
    assert float(hook.drum_radius) == pytest.approx(0.40005, rel=1e-15)
    assert float(sb.Lever("100 lbf", "4 ft", "3 in").gain) == pytest.approx(
        16.0, rel=1e-15
    )


def test_other_spellings_of_a_rig():
    for text in ("264 kips", "264 klbf", "264 klbm", "264e3 lbs"):
        assert float(sb.HookLoad(text, 0.4, 8).mass) == pytest.approx(
            264e3 * POUND, rel=1e-15
        ), text
    assert float(
        sb.friction.StribeckFriction(0.4, 0.3, "60 fpm").stribeck_speed
    ) == pytest.approx(FOOT, rel=1e-15)


@pytest.mark.parametrize("text", ["ton", "tons", "tonf", "mt", "Mt", "ton_force"])
def test_a_ton_may_be_metric_short_or_long(text):
    with pytest.raises(
        sb.InputError,
        match=r"HookLoad.mass.*which ton. t is 1000 kg, short_ton 907.185 kg, long_ton",
    ):
        sb.HookLoad(f"120 {text}", 0.4, 8)
    with pytest.raises(
        sb.InputError, match=r"which ton. tf .metric. is 9.80665 kN, 2 klbf"
    ):
        sb.Lever(f"12 {text}", "1 m", "0.1 m")
    told = [
        float(sb.HookLoad(f"120 {name}", 0.4, 8).mass)
        for name in ("t", "tonne", "short_ton", "long_ton")
    ]
    assert told == pytest.approx(
        [120e3, 120e3, 240e3 * POUND, 268.8e3 * POUND], rel=1e-15
    )


@pytest.mark.parametrize(
    ("text", "nearest"),
    [("100 lb", "lbf"), ("2 klbs", "klbf"), ("50 kg", "kgf"), ("5 kn", "kN")],
)
def test_a_mass_in_place_of_a_force(text, nearest):
    with pytest.raises(sb.InputError, match=f"— nearest: {nearest}; known here"):
        sb.Lever(text, "1 m", "0.1 m")


def test_inertia_of_data_sheets():
    """A flywheel of 1200 kg and 1.4 m in every form: GD² of its diameter of gyration,
    1.4 m/√2, WK² of its radius."""
    mass = 1200.0
    diameter = 1.4 / 2**0.5
    truth = mass * diameter**2 / 4
    weight = mass * G
    forms = {
        "kgf*m^2 GD2": mass * diameter**2,
        "kg·m² GD²": mass * diameter**2,
        "kN*m^2 GD2": 1e-3 * weight * diameter**2,
        "N*m^2 WR2": weight * (diameter / 2) ** 2,
        "lb*ft^2 WK2": mass / POUND * (diameter / 2 / FOOT) ** 2,
        "lbf*ft^2 Wk^2": mass / POUND * (diameter / 2 / FOOT) ** 2,
        "lb*ft^2": mass / POUND * (diameter / 2 / FOOT) ** 2,
        "t*m^2": 1e-3 * truth,
    }
    for unit, number in forms.items():
        assert float(sb.Pulley(0.59, f"{number!r} {unit}").inertia) == pytest.approx(
            truth, rel=1e-14
        ), unit
    refused = {
        "48 kgf*m^2": "diameter or radius of gyration: 1 kgf.m.2 GD2 is 0.25 kg·m², 1 "
        "kgf.m.2 WK2 is 1 kg·m²",
        "48 GD2": "of which unit. 1 kgf.m.2 GD2 is 0.25 kg·m², 1 N.m.2 GD2 is 0.02549 kg·m²",
        "48 kgf*m GD2": "known here: kg.m.2, lb.ft.2, kgf.m.2 GD2",
    }
    for text, words in refused.items():
        with pytest.raises(sb.InputError, match=words):
            sb.Pulley(0.59, text)


def test_run_prints_rig_units_and_json_si(tmp_path, capsys):
    file = tmp_path / "stop.toml"
    sb.write_scene(stop_scene(), file)
    printed = {}
    for options in ((), ("--units", "rig"), ("--json",), ("--json", "--units", "rig")):
        code, printed[options], _ = call(capsys, "run", str(file), *options)
        assert code == 0
    tension = json.loads(printed["--json",])["metrics"]["max_tension"]
    assert f"at most {tension / 1e3:.6g} kN" in printed[()]
    assert f"at most {tension / POUND / G / 1e3:.6g} klbf" in printed["--units", "rig"]
    assert "kN" not in printed["--units", "rig"]
    assert printed["--json",] == printed["--json", "--units", "rig"]


def test_table_of_stops_in_rig_units():
    """Two stops by hand: their travel in feet, their heat in ft·klbf, the hottest
    lining in °F."""
    lever = sb.PiecewiseLinear([0.0, 2.0, 2.0, 3.0, 3.0], [9e3, 9e3, 0.0, 0.0, 9e3])
    brake = sb.Brake(
        sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35)
    )
    heat = sb.lumped_heat(rim=2e5, linings=4e4, rim_cooling=5.0, partition=0.8)
    scene = sb.Scene(
        brake, sb.Duty(lever, sb.HookLoad(20e3, 0.4, 8)), sb.Initial(10.0), 5.0, heat
    )
    result = sb.simulate(scene)
    rows = list(result.stops)
    assert len(rows) == 2
    with display_units("rig"):
        head, first, _ = str(result.stops).splitlines()
        assert list(result.stops) == rows
        whole = str(result)
    for words in ("travel, ft", "energy, ft·klbf", "hottest linings, °F"):
        assert words in head
        assert words in whole
    shown = [rows[0]["travel"] / FOOT, rows[0]["energy"] / (1e3 * POUND * G * FOOT)]
    shown = [
        f"{shown[0]:.5g}",
        f"{shown[1]:.6g}",
        f"{rows[0]['peak_lining_temperature'] * 1.8 - 459.67:.5g}",
    ]
    assert all(text in first.split() for text in shown)


def _sized(track=0.59, circle=0.623, drum=0.4, area=None):
    linings = sb.uniform_linings(20, "270 deg", 0.35, area=area)
    brake = sb.Brake(sb.Pulley(track, 1200.0), sb.Band(circle), linings)
    return sb.Scene(
        brake, sb.Duty(6e3, sb.HookLoad(60e3, drum, 8)), sb.Initial(10.0), 5.0
    )


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        (
            {"circle": 623.0},
            r'brake\.band\.radius: 623 m is 1056 times the track .*did you mean "623 mm"\?',
        ),
        ({"circle": 62.3}, 'did you mean "62.3 cm"'),
        ({"circle": 24.5}, 'did you mean "24.5 in"'),
        ({"circle": 1.246}, "did you mean 0.623 m, half of a diameter"),
        (
            {"track": 590.0},
            r'brake\.band\.radius: 0.623 m is inside .*did you mean brake\.pulley\.radius = "590 mm"',
        ),
        (
            {"track": 1.18},
            r"did you mean brake\.pulley\.radius = 0.59 m, half of a diameter",
        ),
    ],
)
def test_a_band_that_does_not_fit_its_rim_is_refused(sizes, words):
    with pytest.raises(sb.InputError, match=words):
        sb.check_scene(_sized(**sizes))


@pytest.mark.parametrize(
    ("sizes", "said"),
    [
        ({}, []),
        (
            {"track": 590.0, "circle": 623.0},
            [
                'brake.pulley.radius = 590 m, "590 mm"',
                'brake.band.radius = 623 m, "623 mm"',
            ],
        ),
        ({"drum": 400.0}, ['duty.load.drum_radius = 400 m, "400 mm"']),
        ({"drum": 40.0}, ['duty.load.drum_radius = 40 m, "40 cm"']),
        ({"drum": 0.8}, ["duty.load.drum_radius = 0.8 m, 0.4 m, half of a diameter"]),
        ({"area": 330.0}, ['brake.linings.area = 330 m², "330 cm^2"']),
        ({"area": 33000.0}, ['brake.linings.area = 33000 m², "33000 mm^2"']),
    ],
)
def test_sizes_in_another_unit_are_asked_about(tmp_path, capsys, sizes, said):
    sb.write_scene(_sized(**sizes), tmp_path / "scene.toml")
    warnings = json.loads(
        call(capsys, "scene", "check", str(tmp_path / "scene.toml"), "--json")[1]
    )["warnings"]
    found = [
        re.sub("^unit: (.*), .*: did you mean (.*)[?]$", r"\1, \2", warning)
        for warning in warnings
    ]
    assert [words for words in found if not words.startswith("unusual")] == said


def test_mistaken_units_are_asked_about(tmp_path, capsys):
    scene = load("thermal_stabilisation").scene()
    for path, value, meant in (
        ("duty.load.mass", "45", 'did you mean "45 t"?'),
        ("initial.omega", 190.0, 'did you mean "190 rpm" (19.9 rad/s)?'),
        ("heat.bodies[0].temperature", 20.0, 'did you mean "20 degC"?'),
    ):
        sb.write_scene(sb.with_values(scene, {path: value}), tmp_path / "scene.toml")
        (said,) = json.loads(
            call(capsys, "scene", "check", str(tmp_path / "scene.toml"), "--json")[1]
        )["warnings"]
        assert said.startswith(f"unit: {path} = ")
        assert said.endswith(meant)
    cylinder = sb.loads.Cylinder(
        sb.ramp(0.0, 120.0, 0.0, 1.0), diameter="8 in", permissible_pressure=10
    )
    lever = sb.Lever(cylinder, "1 m", "0.2 m")
    sb.write_scene(
        eqx.tree_at(lambda scene: scene.duty.slack_tension, scene, lever),
        tmp_path / "scene.toml",
    )
    said = json.loads(
        call(capsys, "scene", "check", str(tmp_path / "scene.toml"), "--json")[1]
    )["warnings"]
    path = "unit: duty.slack_tension.force"
    assert said == [
        f'{path}.pressure = 120 Pa, less than a breath gives: did you mean "120 bar" or "120 psi"?',
        f"{path}.permissible_pressure = 10 Pa, less than a breath gives: did you mean "
        '"10 bar" or "10 psi"?',
    ]
    friction = sb.ConstantFriction(0.35)
    with pytest.raises(
        sb.InputError, match=r'wrap: 280 rad is out of range.*did you mean "280 deg"'
    ):
        sb.uniform_linings(20, 280.0, friction)
    with pytest.raises(
        sb.InputError, match=r'14 rad is out of range.*did you mean "14 deg"'
    ):
        sb.Lining(friction, [14.0] * 20)
    many = sb.Brake(
        sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.Lining(friction, [1.4] * 200)
    )
    with pytest.raises(sb.InputError, match='did you mean "280 deg"'):
        sb.check_scene(sb.Scene(many, sb.Duty(1e3, 0.0), sb.Initial(1.0), 1.0))


@pytest.mark.parametrize(
    "file",
    [*(f"{name}.py" for name in NAMES), *(x.name for x in FOLDER.glob("*.toml"))],
)
def test_shipped_scenes_are_not_asked_about(file, capsys):
    found = json.loads(call(capsys, "scene", "check", str(FOLDER / file), "--json")[1])
    assert not [text for text in found["warnings"] if text.startswith("unit")]
