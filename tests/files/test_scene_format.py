"""The format of scene files in words and as JSON Schema, as `simbrake scene schema` and
`scene show` give it."""

import json
import tomllib

import jsonschema
import pint
import pytest
from commands import output
from helpers import paths_of
from scenes import replaced
from shipped import load
from text_scenes import TEXT

import simbrake as sb

SCHEMA = json.loads(output("scene", "schema", "--json"))


def descriptions(schema):
    """Descriptions of everything in a schema."""
    for value in schema.values() if isinstance(schema, dict) else schema:
        if isinstance(value, dict | list):
            yield from descriptions(value)
    if isinstance(schema, dict) and isinstance(schema.get("description"), str):
        yield schema["description"]


def test_every_unit_is_a_unit():
    words = [text for text in descriptions(SCHEMA) if "its unit" in text]
    end = " (SI, or a text with its unit)"
    units = {text.removesuffix(end).rpartition(", ")[2] for text in words}
    assert len(words) > 200
    assert {"K", "N", "W/(m*K)"} <= units
    registry = pint.UnitRegistry()
    for unit in units:
        assert registry(unit).u is not None, unit


def test_the_format_in_words():
    def rows_of(name):
        rows = output("scene", "schema", name).splitlines()[1:]
        return [tuple(row.split("  — ")[0].split(maxsplit=2)) for row in rows if row]

    assert rows_of("Pulley") == [
        ("radius", "needed", "number, m"),
        ("inertia", "needed", "number, kg*m^2"),
        ("width", "absent", "number, m"),
    ]
    wall = rows_of("Wall")
    assert wall[:2] == [
        ("name", "needed", "text"),
        ("material", "needed", "Material | name in the library"),
    ]
    assert ("temperature", "293.15", "number, K") in wall
    assert ("both", "false", "true or false") in wall
    assert rows_of("ramp")[0] == ("start", "needed", "number, of its place")


def test_the_format_as_json_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(tomllib.loads(TEXT), SCHEMA)
    for old, new in (("mass", "masss"), ("0.35", "true"), ('"590 mm"', "-1")):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tomllib.loads(TEXT.replace(old, new, 1)), SCHEMA)
    count = SCHEMA["$defs"]["uniform_linings"]["properties"]["count"]
    assert (count["type"], count["minimum"], count["maximum"]) == ("integer", 1, 10000)
    wall = SCHEMA["$defs"]["Wall"]["properties"]
    assert "steel_20L" in wall["material"]["anyOf"][1]["enum"]


def test_what_a_file_cannot_hold_is_named():
    class Law(sb.friction.AbstractFriction):
        def kinetic(self, contact):
            return 0.3

        def static(self, contact):
            return 0.3

        def faults(self, path):
            return []

    lever = sb.profiles.FunctionProfile(lambda t, _: 1e3 * t)
    changes = {"brake.linings.friction": Law(), "duty.slack_tension": lever}
    given = replaced(load("u2_5_5_stop").scene(), changes)
    assert paths_of(sb.files.scene_text, given) == [*changes]
