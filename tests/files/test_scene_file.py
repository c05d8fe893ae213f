"""Scene files: what is written comes back to the last bit, faults are told with their
places."""

import json
import math
import re

import pytest
from helpers import all_equal, input_error
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shipped import NAMES, load
from text_scenes import TEXT, assert_same

import simbrake as sb
from simbrake.files import leaves

HEATED = (
    TEXT.replace(
        "friction = 0.35",
        "friction = { base = 0.35, factors = [{ slope = 3e-4, above = '120 degC' }] }",
    )
    + """
[heat]
type = "with_pulley_structure"
material = "steel_20L"

[heat.heat]
type = "layered_heat"
rim = "steel_20L"
rim_thickness = "25 mm"
rim_layers = 5
track_area = 0.8
partition = 0.9
lining = { conductivity = 0.8, density = "2 g/cm^3", specific_heat = "1.1 kJ/(kg*K)" }
lining_area = 0.6
lining_layers = 4
inside = { at_rest = 8, speed = "20 km/h" }
outside = "25 W/m^2/K"
temperature = "20 degC"
permissible = "450 degC"
"""
)


@pytest.mark.smoke
@pytest.mark.parametrize("name", NAMES)
def test_shipped_scenes_are_read_as_written(name, tmp_path):
    there = load(name).scene()
    sb.write_scene(there, tmp_path / "scene.toml")
    assert_same(sb.read_scene(tmp_path / "scene.toml"), there)
    assert [file.name for file in tmp_path.iterdir()] == ["scene.toml"]


def test_units_and_short_forms():
    wanted = sb.Scene(
        brake=sb.Brake(
            sb.Pulley(radius=0.59, inertia=1200.0),
            sb.Band(radius=0.623, stiffness=1e5),
            sb.uniform_linings(20, math.radians(270), sb.ConstantFriction(0.35)),
        ),
        duty=sb.Duty(
            sb.ramp(2e3, 24e3, 0.0, 0.35),
            sb.HookLoad(mass=60e3, drum_radius=0.4, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=5.0,
    )
    assert_same(sb.files.scene_from_text(TEXT), wanted)


def test_builders_of_heat_in_a_file():
    scene = sb.files.scene_from_text(HEATED)
    steel = sb.material("steel_20L")
    lining = sb.Material(0.8, 2000.0, 1100.0)
    layered = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,
        rim_layers=5,
        track_area=0.8,
        partition=sb.thermal.ConstantPartition(0.9),
        lining=lining,
        lining_area=0.6,
        lining_layers=4,
        inside=sb.thermal.SpeedCoefficient(8.0, 20 / 3.6),
        outside=25.0,
        temperature=293.15,
        permissible=723.15,
    )
    assert_same(scene.heat, sb.thermal.with_pulley_structure(layered, steel))
    assert_same(sb.files.scene_from_text(sb.files.scene_text(scene)), scene)


def test_history_has_its_rows_as_knots(tmp_path):
    (tmp_path / "lever.csv").write_text(
        "t [ms];slack_tension [kN]\n0;2\n350;24\n350;20\n# end\n900;\n1000;20,5\n"
    )
    text = TEXT.replace(
        '{ start = "2 kN", end = "24 kN", begin = 0, duration = "350 ms" }',
        '{ file = "lever.csv", column = "slack_tension", begin = "1 s" }',
    )
    (tmp_path / "scene.toml").write_text(text)
    profile = sb.read_scene(tmp_path / "scene.toml").duty.slack_tension
    all_equal(profile.times, [1.0, 1.35, 1.35, 2.0])
    all_equal(profile.values, [2e3, 24e3, 20e3, 20.5e3])


LEVER = '{ start = "2 kN", end = "24 kN", begin = 0, duration = "350 ms" }'


@pytest.mark.parametrize(
    ("rows", "hint"),
    [
        ("0,1\n2,1\n2.5,\n1,3\n", "line 5, column t"),
        ("0,\n1,\n", "column slack_tension: has no value"),
        ("0,x\n1,\n", "line 2, column slack_tension"),
    ],
)
def test_bad_rows_of_a_history(rows, hint, tmp_path):
    """Empty rows are left out."""
    (tmp_path / "lever.csv").write_text("t,slack_tension\n" + rows, "utf-8")
    lever = '{ file = "lever.csv", column = "slack_tension" }'
    with input_error(match=hint):
        sb.files.scene_from_text(TEXT.replace(LEVER, lever), tmp_path)


def test_materials_are_written_by_name():
    text = sb.files.scene_text(sb.files.scene_from_text(HEATED))
    assert (
        len(re.findall("^conductivity = ", text, re.MULTILINE))
        == text.count('conductivity = "0.8 W/(m*K)"')
        > 0
    )


def test_files_of_either_kind(tmp_path):
    (tmp_path / "scene.toml").write_text(TEXT, "utf-8")
    read = "import simbrake as sb\n\ndef scene():\n    return "
    text = f"{read}sb.files.scene_from_text({TEXT!r})\n"
    (tmp_path / "scene.py").write_text(text, "utf-8")
    for name in ("scene.toml", "scene.py"):
        scene = sb.read_scene(tmp_path / name)
        assert_same(scene, sb.files.scene_from_text(TEXT))
        slower = sb.read_scene(tmp_path / name, {"initial.omega": "12 rad/s"})
        assert float(slower.initial.omega) == 12.0
    (tmp_path / "scene.txt").write_text(TEXT, "utf-8")
    for name, text in (
        ("scene.txt", TEXT),
        ("a.py", "def main(): pass"),
        ("b.py", "x = 1"),
        ("c.py", "def scene(): return 3"),
        ("d.py", "def scene(): return 1 / 0"),
    ):
        (tmp_path / name).write_text(text, "utf-8")
        with input_error():
            sb.read_scene(tmp_path / name)


FIELDS = [leaf.path for leaf in leaves(sb.files.scene_from_text(TEXT))]


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.dictionaries(
        st.sampled_from(FIELDS),
        st.one_of(
            st.sampled_from([0.0, 1e-300, 1e-12, 1.0, 1e3, 1e12, 1e39, 1e41, -1.0]),
            st.floats(1e-40, 1e40),
        ),
        min_size=1,
        max_size=3,
    )
)
def test_any_numbers_end_or_are_refused(changes):
    try:
        scene = sb.with_values(sb.files.scene_from_text(TEXT), changes)
        result = sb.simulate(scene, throw=False, max_steps=500)
    except sb.InputError:
        return
    summary = json.dumps(result.summary(), allow_nan=False)
    assert f'"status": "{result.status}"' in summary
    assert str(result).startswith(f"{result.status}: ")
