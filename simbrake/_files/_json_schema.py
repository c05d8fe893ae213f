"""The schema of scene files as JSON Schema, for editors and for tools of others."""

from collections.abc import Callable
from typing import Any

from .._base._quantity import Quantity, Whole
from .._parts._material import LIBRARY
from .._parts._scene import Scene
from ._schema import Part, all_makers, makers_of, parts_of, short_of

_UNITS = "SI, or a text with its unit"


def json_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a scene file, from the same description that reads it.

    Ranges are those of numbers in SI; texts with a unit are only checked by simbrake itself.
    """
    makers = all_makers()
    tables = {name: _table(name, maker) for name, maker in makers.items()}
    roots = makers_of((Scene,))
    for name in roots:
        tables[name]["properties"]["format"] = {"const": "simbrake scene 1"}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "simbrake scene",
        "anyOf": [{"$ref": f"#/$defs/{name}"} for name in roots],
        "$defs": tables,
    }


def _table(name: str, maker: Callable[..., Any]) -> dict[str, Any]:
    parts = [part for part in parts_of(maker) if not (name == "history" and part.name == "unit")]
    properties = {part.name: _part(part) for part in parts} | {"type": {"const": name}}
    needed = [part.name for part in parts if part.needed and not part.nullable]
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def _part(part: Part) -> dict[str, Any]:
    one = _one(part)
    return {"type": "array", "items": one} if part.many else one


def _one(part: Part) -> dict[str, Any]:
    alternatives: list[dict[str, Any]] = [{"$ref": f"#/$defs/{name}"} for name in makers_of(part.wanted)]
    if isinstance(part.about, Quantity) and part.kind == "number":
        return {"anyOf": [*_numbers(part.about), *alternatives], "description": _meaning(part.about)}
    if isinstance(part.about, Whole):
        low, high = part.about.low, part.about.high
        return {"type": "integer", "minimum": low, "maximum": high, "description": part.about.meaning}
    if part.kind == "object":
        if short_of(part.wanted):
            alternatives += [{"type": "number"}, {"type": "string"}]
        if "Material" in makers_of(part.wanted):
            alternatives.append({"enum": sorted(LIBRARY)})
        return {"anyOf": alternatives}
    return {"type": "boolean" if part.kind == "flag" else "string"}


def _numbers(about: Quantity) -> list[dict[str, Any]]:
    number: dict[str, Any] = {"type": "number"}
    if about.low is not None:
        number["exclusiveMinimum" if about.open_low else "minimum"] = about.low
    if about.high is not None:
        number["maximum"] = about.high
    text = {"type": "string"}
    return [number, text, {"type": "array", "items": {"anyOf": [number, text]}}] if about.many else [number, text]


def _meaning(about: Quantity) -> str:
    return about.meaning if about.unit in ("1", "SI") else f"{about.meaning}, {about.unit} ({_UNITS})"
