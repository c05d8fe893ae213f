"""Scene files: what is written comes back to the last bit, faults are told with their
places."""

import json
import math
import re

import numpy as np
import pytest
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
    np.testing.assert_array_equal(profile.times, [1.0, 1.35, 1.35, 2.0])
    np.testing.assert_array_equal(profile.values, [2e3, 24e3, 20e3, 20.5e3])


def test_bad_history_names_line_and_column(tmp_path):
    (tmp_path / "lever.csv").write_text("t,slack_tension [m]\n1,2\n0,x\n")
    text = TEXT.replace(
        '{ start = "2 kN", end = "24 kN", begin = 0, duration = "350 ms" }',
        '{ file = "%s", column = "%s" }',
    )
    with pytest.raises(sb.InputError) as caught:
        sb.files.scene_from_text(text % ("lever.csv", "slack_tension"), tmp_path)
    assert "duty.slack_tension: " in str(caught.value)
    with pytest.raises(
        sb.InputError, match="has no column tension — there are: t, slack_tension"
    ):
        sb.files.scene_from_text(text % ("lever.csv", "tension"), tmp_path)
    with pytest.raises(sb.InputError, match="there is no such file"):
        sb.files.scene_from_text(text % ("other.csv", "tension"), tmp_path)


def test_all_faults_of_a_file_in_one_report():
    text = """
end_time = "5 m"
solver = 3
[brake]
pulley = { radius = "-590 mm", inertia = "12 kg*m^3", widht = 2 }
band = { radius = true, stiffness = "stiff" }
linings = { count = 2.5, wrap = "270 degC", friction = 11 }
[duty]
slack_tension = { type = "Ramp", start = 1 }
load = { mass = "60 t", drum_radius = 0, line_count = 8 }
[initial]
[heat]
type = "layered_heat"
rim = "steel_20"
partition = 1.5
rim_thickness = nan
track_area = 2021-01-01
temperature = "-300 degC"
"""
    with pytest.raises(sb.InputError) as caught:
        sb.files.scene_from_text(text)
    said = {fault.path: str(fault) for fault in caught.value.faults}
    words = {
        "end_time": "'m' is not a unit",
        "solver": "unknown key",
        "brake.pulley.radius": "> 0 m",
        "brake.pulley.inertia": "'kg*m^3'",
        "brake.pulley.widht": "nearest: width",
        "brake.band.radius": "True",
        "brake.band.stiffness": "'stiff'",
        "brake.linings.count": "2.5",
        "brake.linings.wrap": "known here: rad, deg",
        "brake.linings.friction": "≤ 10",
        "duty.slack_tension.type": "nearest: ramp",
        "duty.load.drum_radius": "0 is out of range",
        "initial.omega": "is missing",
        "heat.rim": "nearest: steel_20L",
        "heat.rim_thickness": "nan",
        "heat.track_area": "2021",
        "heat.partition": "1.5",
        "heat.temperature": "-26.85 K",
    }
    assert said.keys() == words.keys()
    assert [path for path, word in words.items() if word not in said[path]] == []


def test_numbers_as_data_sheets_write_them():
    def radius(text):
        return float(sb.Pulley(text, 1.0).radius)

    assert radius("590 mm") == 0.59
    assert float(sb.Initial("\N{MINUS SIGN}30 r/min").omega) == pytest.approx(
        -math.pi, rel=1e-15
    )
    for text, hint in (
        ("0,59 m", "a decimal point"),
        ("1,200 m", "no separators"),
        ("590 MM", "nearest: mm; known"),
    ):
        with pytest.raises(sb.InputError, match=hint):
            radius(text)


def test_temperature_difference_in_celsius():
    with pytest.raises(sb.InputError, match="not a difference of two"):
        sb.files.scene_from_text(
            HEATED.replace("above = '120 degC'", "above = '120 degC', blend = '5 degC'")
        )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"simbrake scene 1"', '"simbrake scene 9"', "this program reads"),
        ("count = 20, wrap", "count = 20, count = 20, wrap", "TOML: .*line"),
        ('radius = "623 mm"', 'radius = "0.2 m"', "is inside the track"),
        (
            "friction = 0.35",
            "friction = " + "{ base = " * 3000 + "1" + "}" * 3000,
            "nested too deeply|cannot be read",
        ),
        ("friction = 0.35", "friction = " + "9" * 5000, "cannot be read"),
    ],
)
def test_other_faults(old, new, words):
    with pytest.raises(sb.InputError, match=words):
        sb.files.scene_from_text(TEXT.replace(old, new, 1))


LEVER = '{ start = "2 kN", end = "24 kN", begin = 0, duration = "350 ms" }'


@pytest.mark.parametrize(
    ("old", "new", "path", "word"),
    [
        ("friction = 0.35", "friction = true", "brake.linings.friction", "True"),
        ("friction = 0.35", "friction = 2021-01-01", "brake.linings.friction", "2021"),
        (
            "friction = 0.35",
            "friction = { static_ratio = 1 }",
            "brake.linings.friction.type",
            "(key speed)",
        ),
        (
            "friction = 0.35",
            "friction = {}",
            "brake.linings.friction.type",
            "StribeckFriction",
        ),
        (
            "friction = 0.35",
            "friction = { type = 3 }",
            "brake.linings.friction.type",
            "3",
        ),
        (
            "friction = 0.35",
            "friction = { type = 'ConstantFriktion' }",
            "brake.linings.friction.type",
            "ConstantFric",
        ),
        ("count = 20, ", "", "brake.linings.count", "is missing"),
        ("count = 20", "count = [20]", "brake.linings.count", "[20]"),
        ("count = 20", "count = 0", "brake.linings.count", "1…10000"),
        ('[initial]\nomega = "24 rad/s"', "", "initial", "omega"),
        (
            '{ radius = "623 mm", stiffness = "100 kN/m" }',
            "3",
            "brake.band",
            "radius, stiffness",
        ),
        (
            LEVER,
            "{ force = 9, arm = 1, slack_arm = 2, tight_arm = 3 }",
            "duty.slack_tension.tight_arm",
            "differential_le",
        ),
        ("start =", "strt =", "duty.slack_tension.strt", "nearest: start"),
        (
            '{ radius = "590 mm"',
            '{ diameter = "1 m"',
            "brake.pulley.diameter",
            "give half of it as radius",
        ),
        (
            'wrap = "270 deg"',
            "wrap = 270, frction = 1",
            "brake.linings.wrap",
            'did you mean "270 deg"',
        ),
        (LEVER, "{ phases = {} }", "duty.slack_tension.phases", "list"),
        (LEVER, "{ file = 3, column = 'b' }", "duty.slack_tension.file", "3"),
        (LEVER, "{ file = 'a' }", "duty.slack_tension.column", "is missing"),
        (
            LEVER,
            "{ file = 'a', column = 'b', unit = 'N' }",
            "duty.slack_tension.unit",
            "begin",
        ),
        (
            LEVER,
            "{ phases = [{ lever = 2, until = 'x' }] }",
            "duty.slack_tension.phases[0].until",
            "travel 27 m",
        ),
        (
            LEVER,
            "{ phases = [{ lever = 3, string_on_hook = 1 }] }",
            "duty.slack_tension.phases[0].string_on_hook",
            "1",
        ),
        (
            LEVER,
            "{ phases = [{ until = 'rest' }] }",
            "duty.slack_tension.phases[0].lever",
            "SpeedHold",
        ),
        ('format = "simbrake scene 1"', "format = 2", "format", "2"),
    ],
)
def test_faults_have_paths_and_hints(old, new, path, word):
    with pytest.raises(sb.InputError) as caught:
        sb.files.scene_from_text(TEXT.replace(old, new, 1))
    assert word in next(
        str(fault) for fault in caught.value.faults if fault.path == path
    )


def test_times_of_a_history_go_on(tmp_path):
    """The first row that is earlier than the one before it is named by its line; empty
    rows are left out."""
    text = TEXT.replace(LEVER, '{ file = "lever.csv", column = "slack_tension" }')
    for rows, said in (
        (
            "0,1\n2,1\n2.5,\n1,3\n4,4\n3,4\n",
            " line 5, column t: is earlier than the line before — sort the rows by time",
        ),
        ("0,\n1,\n", " column slack_tension: has no value"),
        ("0,x\n1,\n", " line 2, column slack_tension: 'x' is not a number"),
    ):
        (tmp_path / "lever.csv").write_text("t,slack_tension\n" + rows, "utf-8")
        with pytest.raises(sb.InputError) as caught:
            sb.files.scene_from_text(text, tmp_path)
        (fault,) = caught.value.faults
        assert str(fault).startswith(
            f"duty.slack_tension: {tmp_path / 'lever.csv'}{said}"
        )


def test_materials_are_written_by_name():
    text = sb.files.scene_text(sb.files.scene_from_text(HEATED))
    assert (
        len(re.findall("^conductivity = ", text, re.MULTILINE))
        == text.count('conductivity = "0.8 W/(m*K)"')
        > 0
    )


def test_wrong_paths_of_a_file():
    for path in ("brake.²", "brake.linings[99].count", "", "brake.linings.count.more"):
        with pytest.raises(
            sb.InputError, match=r"there is no such number in the scene|no entry|is not"
        ):
            sb.files.scene_from_text(TEXT, values={path: 1})
    changed = sb.files.scene_from_text(
        TEXT, values={"brake.linings.count": 12.0, "duty.slack_tension.end": "30 kN"}
    )
    assert changed.brake.linings.count == 12
    assert changed.duty.slack_tension.values.tolist() == [2e3, 30e3]


def test_files_of_either_kind(tmp_path):
    (tmp_path / "scene.txt").write_text(TEXT, "utf-8")
    with pytest.raises(
        sb.InputError, match=r"is neither TOML nor Python — a scene is a \.toml file"
    ):
        sb.read_scene(tmp_path / "scene.txt")
    for text, words in (
        ("def main(): pass", "is a study without a scene — run it: python "),
        ("x = 1", r"defines no function scene\(\) — return a simbrake.Scene from it"),
        ("def scene(): return 3", r"scene\(\) returned int — return a simbrake.Scene"),
        (
            "def scene(): return 1 / 0",
            "ZeroDivisionError: division by zero — fix the scene file",
        ),
    ):
        (tmp_path / "scene.py").write_text(text, "utf-8")
        with pytest.raises(sb.InputError, match=words):
            sb.read_scene(tmp_path / "scene.py")
    (tmp_path / "scene.toml").write_text(TEXT, "utf-8")
    read = "import simbrake as sb\n\ndef scene():\n    return sb.files.scene_from_text("
    (tmp_path / "scene.py").write_text(f"{read}{TEXT!r})\n", "utf-8")
    for name in ("scene.toml", "scene.py"):
        assert_same(sb.read_scene(tmp_path / name), sb.files.scene_from_text(TEXT))
        assert (
            float(
                sb.read_scene(
                    tmp_path / name, {"initial.omega": "12 rad/s"}
                ).initial.omega
            )
            == 12.0
        )


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
