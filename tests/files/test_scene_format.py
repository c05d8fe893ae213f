"""The format of scene files in words and as JSON Schema."""

import dataclasses

import pytest
from test_scene_file import FRICTIONS, TEXT, assert_same, scenario

import simbrake as sb
from simbrake.files._schema import all_makers, json_schema, nearest, parameter_table, parts_of, schema_text


def rows_of(name):
    """Name, default and kind of every key in the text about a type."""
    heading, *rows = schema_text(name).splitlines()
    return heading, [tuple(row.split("  — ")[0].split(maxsplit=2)) for row in rows]


def test_the_format_in_words():
    assert schema_text("Pulley").splitlines() == [
        "Pulley: The brake pulley and all that turns with its shaft.",
        "  radius   needed  number, m  — radius of the friction track, > 0",
        "  inertia  needed  number, kg*m^2  — inertia about the shaft, > 0",
        "  width    absent  number, m  — width of the friction track, > 0",
    ]
    laws = " | ".join(FRICTIONS)
    assert rows_of("uniform_linings")[1] == [
        ("count", "needed", "whole number"),
        ("wrap", "needed", "number, rad"),
        ("friction", "needed", f"{laws} | a number"),
        ("area", "absent", "number, m^2"),
        ("mass", "absent", "number, kg"),
        ("permissible_pressure", "absent", "number, Pa"),
    ]
    heading, rows = rows_of("Wall")
    assert heading.startswith("Wall: A wall in layers from its `front` to its `back`")
    assert rows[0:2] == [("name", "needed", "text"), ("material", "needed", "Material | name in the library")]
    assert rows[5:] == [
        ("growth", "1", "number"),
        ("temperature", "293.15", "number, K"),
        ("copies", "1", "whole number"),
        ("both", "false", "true or false"),
        ("surface_layer", "absent", "SurfaceLayer"),
    ]
    assert rows_of("history")[1][:3] == [
        ("file", "needed", "CSV file"),
        ("column", "needed", "text"),
        ("time", "t", "text"),
    ]
    assert ("start", "needed", "number, of its place") in rows_of("ramp")[1]
    assert ("profile", "zero") in [row[:2] for row in rows_of("TorqueLoad")[1]]
    assert ("shaft", "empty") in [row[:2] for row in rows_of("Scene")[1]]
    assert ("factors", "needed", "list of LinearFade | TabulatedFade | PressureFactor") in rows_of("ProductFriction")[1]
    whole, bounded = schema_text("Initial"), schema_text("ConstantFriction")
    assert "  omega       needed  number, rad/s  — initial speed\n" in whole
    assert "— coefficient of friction, ≥ 0 and ≤ 10, one or a list\n" in bounded
    assert "— number of linings, 1…10000\n" in schema_text("uniform_linings")
    (key,) = [text for text in schema_text("band").split("\n\n") if text.startswith("Band:")]
    assert key == schema_text("Band")
    everything = schema_text()
    assert everything.startswith("A scene file is TOML.")
    assert all(schema_text(name) in everything for name in all_makers())
    with pytest.raises(sb.InputError, match="Puley: unknown type, or key without a type — nearest: Pulley"):
        schema_text("Puley")
    with pytest.raises(sb.InputError, match="radius: unknown type, or key without a type"):
        schema_text("radius")
    assert nearest("abcd", ["abce", "abcf", "abcg", "x"]) in ("nearest: abcg, abcf", "nearest: abce, abcf")
    assert nearest("q", ["ab", "cd"]) == "there are: ab, cd"
    assert nearest("q", ["ab", "cd"], instead=["e"]) == "there are: e"


def test_the_format_as_json_schema():
    schema = json_schema()
    assert schema["anyOf"] == [{"$ref": "#/$defs/Scene"}, {"$ref": "#/$defs/programme_scene"}]
    defined = schema["$defs"]
    number, text = {"type": "number"}, {"type": "string"}
    above = {"type": "number", "exclusiveMinimum": 0.0}
    radius = "radius of the friction track, m (SI, or a text with its unit)"
    assert defined["Pulley"]["properties"]["radius"] == {"anyOf": [above, text], "description": radius}
    assert (defined["Pulley"]["required"], defined["Pulley"]["type"]) == (["radius", "inertia"], "object")
    assert defined["Pulley"]["additionalProperties"] is False
    assert list(defined["Pulley"]["properties"]) == ["radius", "inertia", "width", "type"]
    assert defined["Pulley"]["properties"]["type"] == {"const": "Pulley"}
    assert defined["Scene"]["properties"]["format"] == {"const": "simbrake scene 1"}
    share = {"type": "number", "minimum": 0.0, "maximum": 10.0}
    assert defined["ConstantFriction"]["properties"]["coefficient"] == {
        "anyOf": [share, text, {"type": "array", "items": {"anyOf": [share, text]}}],
        "description": "coefficient of friction",
    }
    linings = defined["uniform_linings"]["properties"]
    assert linings["count"] == {"type": "integer", "minimum": 1, "maximum": 10000, "description": "number of linings"}
    assert linings["friction"] == {"anyOf": [*({"$ref": f"#/$defs/{name}"} for name in FRICTIONS), number, text]}
    wall = defined["Wall"]["properties"]
    assert wall["material"]["anyOf"][0] == {"$ref": "#/$defs/Material"}
    assert "steel_20L" in wall["material"]["anyOf"][1]["enum"]
    assert len(wall["material"]["anyOf"]) == 2
    assert (wall["both"], wall["name"]) == ({"type": "boolean"}, text)
    assert wall["surface_layer"] == {"anyOf": [{"$ref": "#/$defs/SurfaceLayer"}]}
    assert defined["programme_scene"]["properties"]["programme"] == {"type": "array", "items": text}
    assert defined["ProductFriction"]["properties"]["factors"] == {
        "type": "array",
        "items": {"anyOf": [{"$ref": f"#/$defs/{name}"} for name in ("LinearFade", "TabulatedFade", "PressureFactor")]},
    }


def test_parameters_as_a_table():
    rows = {
        row.split()[0]: " ".join(row.split())
        for row in str(parameter_table(sb.files.scene_from_text(TEXT))).splitlines()
    }
    for line in (
        "path value unit meaning",
        "brake.pulley.radius 0.59 m radius of the friction track",
        "duty.load.line_count 8 lines strung",
        "brake.linings.friction.coefficient 0.35 coefficient of friction",
        "duty.slack_tension.values 2000, 24000 N values at them",
    ):
        assert rows[line.split()[0]].startswith(line[:40])
    third = sb.files.scene_from_text(TEXT, values={"initial.omega": 1 / 3})
    assert "initial.omega 0.3333333333 rad/s initial speed" in " ".join(str(parameter_table(third)).split())


def test_a_bare_number_stands_for_a_constant_torque():
    load = sb.files.scene_from_text(TEXT.replace("load = {", "load = '3 kN*m' #")).duty.load
    assert_same(load, sb.TorqueLoad(sb.Constant(3e3)))


def test_what_a_file_cannot_hold_is_named():
    class Law(sb.friction.AbstractFriction):
        def kinetic(self, contact):
            return 0.3

        def static(self, contact):
            return 0.3

        def faults(self, path):
            return []

    scene = scenario("u2_5_5_stop")
    brake = dataclasses.replace(scene.brake, linings=dataclasses.replace(scene.brake.linings, friction=Law()))
    lever = sb.profiles.FunctionProfile(lambda t, _: 1e3 * t)
    with pytest.raises(sb.InputError) as caught:
        sb.files.scene_text(
            dataclasses.replace(scene, brake=brake, duty=dataclasses.replace(scene.duty, slack_tension=lever))
        )
    assert [fault.path for fault in caught.value.faults] == ["brake.linings.friction", "duty.slack_tension"]


def test_every_part_of_a_scene_can_be_described():
    for name, maker in all_makers().items():
        for part in parts_of(maker):
            assert part.kind, f"{name}.{part.name}"
            assert part.kind not in (float, int) or part.about is not None, f"{name}.{part.name}"
