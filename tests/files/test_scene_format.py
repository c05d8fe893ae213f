"""The format of scene files in words and as JSON Schema, as `simbrake scene schema` and
`scene show` give it."""

import dataclasses
import json

import pint
import pytest
from commands import call, output
from shipped import load
from text_scenes import TEXT, assert_same

import simbrake as sb

SCHEMA = json.loads(output("scene", "schema", "--json"))
KINDS = SCHEMA["$defs"]


def rows_of(name):
    """Name, default and kind of every key in the text about a type."""
    heading, *rows = output("scene", "schema", name).splitlines()
    return heading, [
        tuple(row.split("  — ")[0].split(maxsplit=2)) for row in rows if row
    ]


def test_every_unit_is_one():
    words = [
        description
        for description in of_properties(SCHEMA)
        if "its unit" in description
    ]
    units = {
        text.removesuffix(" (SI, or a text with its unit)").rpartition(", ")[2]
        for text in words
    }
    assert len(words) > 200
    assert {"K", "N", "W/(m*K)"} <= units
    registry = pint.UnitRegistry()
    for unit in units:
        assert registry(unit).u is not None, unit


def of_properties(schema):
    """Descriptions of everything in a schema."""
    for value in schema.values() if isinstance(schema, dict) else schema:
        if isinstance(value, dict | list):
            yield from of_properties(value)
    if isinstance(schema, dict) and isinstance(schema.get("description"), str):
        yield schema["description"]


def test_the_format_in_words(capsys):
    _, rows = rows_of("Pulley")
    assert rows == [
        ("radius", "needed", "number, m"),
        ("inertia", "needed", "number, kg*m^2"),
        ("width", "absent", "number, m"),
    ]
    _, rows = rows_of("uniform_linings")
    assert rows[0] == ("count", "needed", "whole number")
    assert rows[2][2].startswith("ConstantFriction | ")
    assert rows[2][2].endswith(" | a number")
    heading, rows = rows_of("Wall")
    assert heading.startswith("Wall: ")
    assert rows[:2] == [
        ("name", "needed", "text"),
        ("material", "needed", "Material | name in the library"),
    ]
    assert ("temperature", "293.15", "number, K") in rows
    assert ("both", "false", "true or false") in rows
    assert ("start", "needed", "number, of its place") in rows_of("ramp")[1]
    everything = output("scene", "schema")
    assert all(
        output("scene", "schema", name).strip() in everything
        for name in ("Pulley", "Wall", "ramp")
    )
    assert output("scene", "schema", "Band").strip() in output(
        "scene", "schema", "band"
    )
    for wrong, word in (("Puley", "nearest: Pulley"), ("radius", "unknown type")):
        code, _, err = call(capsys, "scene", "schema", wrong)
        assert (code, word in err) == (2, True)


def test_the_format_as_json_schema():
    assert SCHEMA["anyOf"] == [
        {"$ref": "#/$defs/Scene"},
        {"$ref": "#/$defs/programme_scene"},
    ]
    text = {"type": "string"}
    pulley = KINDS["Pulley"]
    assert pulley["properties"]["radius"]["anyOf"] == [
        {"type": "number", "exclusiveMinimum": 0.0},
        text,
    ]
    assert (pulley["required"], pulley["type"]) == (["radius", "inertia"], "object")
    assert pulley["additionalProperties"] is False
    assert pulley["properties"]["type"] == {"const": "Pulley"}
    assert KINDS["Scene"]["properties"]["format"] == {"const": "simbrake scene 1"}
    share = {"type": "number", "minimum": 0.0, "maximum": 10.0}
    many = {"type": "array", "items": {"anyOf": [share, text]}}
    assert KINDS["ConstantFriction"]["properties"]["coefficient"]["anyOf"] == [
        share,
        text,
        many,
    ]
    count = KINDS["uniform_linings"]["properties"]["count"]
    assert (count["type"], count["minimum"], count["maximum"]) == ("integer", 1, 10000)
    wall = KINDS["Wall"]["properties"]
    assert wall["material"]["anyOf"][0] == {"$ref": "#/$defs/Material"}
    assert "steel_20L" in wall["material"]["anyOf"][1]["enum"]
    assert (wall["both"], wall["name"]) == ({"type": "boolean"}, text)
    assert KINDS["programme_scene"]["properties"]["programme"] == {
        "type": "array",
        "items": text,
    }
    factors = [
        {"$ref": f"#/$defs/{name}"}
        for name in ("LinearFade", "TabulatedFade", "PressureFactor")
    ]
    assert KINDS["ProductFriction"]["properties"]["factors"] == {
        "type": "array",
        "items": {"anyOf": factors},
    }


def test_parameters_as_a_table(tmp_path):
    (tmp_path / "scene.toml").write_text(TEXT, "utf-8")
    shown = output(
        "scene",
        "show",
        str(tmp_path / "scene.toml"),
        "--set",
        "initial.omega=0.33333333333",
    )
    rows = {
        row.split()[0]: row.split()[1:4] for row in shown.splitlines() if row.strip()
    }
    assert rows["brake.pulley.radius"] == ["0.59", "m", "radius"]
    assert rows["duty.load.line_count"][0] == "8"
    assert rows["duty.slack_tension.values"] == ["2000,", "24000", "N"]
    assert rows["initial.omega"][:2] == ["0.3333333333", "rad/s"]


def test_bare_number_is_a_constant_torque():
    load = sb.files.scene_from_text(
        TEXT.replace("load = {", "load = '3 kN*m' #")
    ).duty.load
    assert_same(load, sb.TorqueLoad(sb.Constant(3e3)))


def test_what_a_file_cannot_hold_is_named():
    class Law(sb.friction.AbstractFriction):
        def kinetic(self, contact):
            return 0.3

        def static(self, contact):
            return 0.3

        def faults(self, path):
            return []

    scene = load("u2_5_5_stop").scene()
    brake = dataclasses.replace(
        scene.brake, linings=dataclasses.replace(scene.brake.linings, friction=Law())
    )
    lever = sb.profiles.FunctionProfile(lambda t, _: 1e3 * t)
    duty = dataclasses.replace(scene.duty, slack_tension=lever)
    with pytest.raises(sb.InputError) as caught:
        sb.files.scene_text(dataclasses.replace(scene, brake=brake, duty=duty))
    assert [fault.path for fault in caught.value.faults] == [
        "brake.linings.friction",
        "duty.slack_tension",
    ]
