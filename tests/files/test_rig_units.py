"""Units of a rig at the boundary: numbers read and shown in them, and values that are
most likely in another unit."""

import json

import pytest
from commands import call
from goldens import assert_kept
from helpers import near
from scenes import stop_scene
from shipped import FOLDER, NAMES, load

import simbrake as sb

POUND = 0.45359237
G = 9.80665
FOOT = 0.3048


def test_a_scene_in_units_of_a_rig():
    hook = sb.HookLoad("220 klbf", "15.75 in", 8)
    near(hook.mass, 220e3 * POUND, 1e-15)
    near(hook.drum_radius, 0.40005, 1e-15)
    near(sb.Lever("100 lbf", "4 ft", "3 in").gain, 16.0, 1e-15)


def test_other_spellings_of_a_rig():
    for text in ("264 kips", "264 klbf", "264 klbm", "264e3 lbs"):
        assert float(sb.HookLoad(text, 0.4, 8).mass) == pytest.approx(
            264e3 * POUND, rel=1e-15
        ), text
    near(sb.friction.StribeckFriction(0.4, 0.3, "60 fpm").stribeck_speed, FOOT, 1e-15)


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


def _sized(track=0.59, circle=0.623, drum=0.4, area=None):
    linings = sb.uniform_linings(20, "270 deg", 0.35, area=area)
    brake = sb.Brake(sb.Pulley(track, 1200.0), sb.Band(circle), linings)
    return sb.Scene(
        brake, sb.Duty(6e3, sb.HookLoad(60e3, drum, 8)), sb.Initial(10.0), 5.0
    )


#: sizes and numbers that most likely are in another unit
SIZES = (
    {},
    {"track": 590.0, "circle": 623.0},
    {"drum": 400.0},
    {"drum": 40.0},
    {"drum": 0.8},
    {"track": 1.18, "circle": 1.246},
    {"area": 330.0},
    {"area": 33000.0},
)
NUMBERS = {
    "duty.load.mass": "45",
    "duty.load.gravity": 32.2,
    "initial.omega": 190.0,
    "heat.bodies[0].temperature": 20.0,
}


def test_values_in_another_unit_are_asked_about(tmp_path, capsys, request):
    heated = load("thermal_stabilisation").scene()
    scenes = [_sized(**sizes) for sizes in SIZES]
    scenes += [sb.with_values(heated, {path: x}) for path, x in NUMBERS.items()]
    file = tmp_path / "scene.toml"
    said = []
    for scene in scenes:
        sb.write_scene(scene, file)
        found = json.loads(call(capsys, "scene", "check", str(file), "--json")[1])
        said.append("\n".join(found["warnings"]))
    assert_kept(request, "units", "\n\n".join(said) + "\n")


@pytest.mark.parametrize(
    "file",
    [*(f"{name}.py" for name in NAMES), *(x.name for x in FOLDER.glob("*.toml"))],
)
def test_shipped_scenes_are_not_asked_about(file, capsys):
    found = json.loads(call(capsys, "scene", "check", str(FOLDER / file), "--json")[1])
    assert not [text for text in found["warnings"] if text.startswith("unit")]
