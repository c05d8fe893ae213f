"""The format of scene files as text tables and as JSON Schema, from the description by
which they are read."""

import dataclasses
import functools
import inspect
import textwrap
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from .._base._faults import input_error, nearest
from .._base._numbers import numbers
from .._base._part import Leaf, Whole, leaves, parts_below, short_of
from .._base._quantity import Quantity
from .._base._table import Column, Table
from ..files.schema import FORMAT, PLAIN, VERSION, Maker, Part, makers_of, parts_of
from ..parts.scene import Scene
from ..thermal.materials import LIBRARY, Material


@functools.cache
def all_makers() -> dict[str, Maker]:
    """All classes and builders of scene files, from the scene down: name → maker."""
    makers: dict[str, Maker] = dict(makers_of((Scene,)))
    open_ends: list[Maker] = list(makers.values())
    while open_ends:
        for part in parts_of(open_ends.pop(0)):
            new = {
                name: maker for name, maker in part.makers.items() if name not in makers
            }
            makers |= new
            open_ends += new.values()
    return makers


# --- JSON Schema --------------------------------------------------------------------

Json: TypeAlias = Mapping[str, object]
_UNITS = "SI, or a text with its unit"


def json_schema() -> dict[str, object]:
    """JSON Schema (draft 2020-12) of a scene file, from the description that the reader
    uses.

    Ranges are those of numbers in SI; texts with a unit are only checked by simbrake
    itself.
    """
    roots = makers_of((Scene,))
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "simbrake scene",
        "anyOf": [{"$ref": f"#/$defs/{name}"} for name in roots],
        "$defs": {
            name: _table(name, maker, name in roots)
            for name, maker in all_makers().items()
        },
    }


def _table(name: str, maker: Maker, root: bool) -> dict[str, object]:
    parts = parts_of(maker)
    properties = {part.name: _schema_of(part) for part in parts} | {
        "type": {"const": name}
    }
    if root:
        properties[FORMAT] = {"const": VERSION}
    needed = [part.name for part in parts if part.needed]
    return {
        "type": "object",
        "properties": properties,
        "required": needed,
        "additionalProperties": False,
    }


def _schema_of(part: Part) -> Json:
    about = part.about
    objects: list[Json] = [{"$ref": f"#/$defs/{name}"} for name in part.makers]
    if isinstance(about, Quantity):
        meaning = (
            about.meaning
            if about.unit in ("1", "SI")
            else f"{about.meaning}, {about.unit} ({_UNITS})"
        )
        schema = {"anyOf": [*_numbers(about), *objects], "description": meaning}
    elif isinstance(about, Whole):
        schema = {
            "type": "integer",
            "minimum": about.low,
            "maximum": about.high,
            "description": about.meaning,
        }
    elif part.kind in PLAIN:
        schema = {"type": PLAIN[part.kind][1]}
    else:
        objects += (
            [{"type": "number"}, {"type": "string"}] if short_of(part.classes) else []
        )
        objects += [{"enum": sorted(LIBRARY)}] if Material in part.classes else []
        schema = {"anyOf": objects}
    return {"type": "array", "items": schema} if part.many else schema


def _numbers(about: Quantity) -> list[Json]:
    number: dict[str, object] = {"type": "number"}
    if about.low is not None:
        number["exclusiveMinimum" if about.open_low else "minimum"] = about.low
    if about.high is not None:
        number["maximum"] = about.high
    text = {"type": "string"}
    return (
        [number, text, {"type": "array", "items": {"anyOf": [number, text]}}]
        if about.many
        else [number, text]
    )


# --- text tables --------------------------------------------------------------------


def parameter_table(scene: Scene) -> Table:
    """Every parameter of a scene: path, value (SI), unit, meaning with the name of its
    body or phase, or the ends of its link."""
    names = {}
    for path, part, _ in parts_below(scene):
        own = [getattr(part, field, None) for field in ("name", "a", "b")]
        if words := " to ".join(word for word in own if word and isinstance(word, str)):
            names[path] = words

    def meaning(leaf: Leaf) -> str:
        around = [names[path] for path in names if leaf.path.startswith(f"{path}.")]
        return leaf.about.meaning + (f" ({', '.join(around)})" if around else "")

    columns = [
        "path",
        Column("value", show=lambda value: numbers(value, count=10).text),
        Column(
            "unit", show=lambda unit: "" if unit in ("1", "SI") else unit, left=True
        ),
        "meaning",
    ]
    return Table(
        columns,
        [
            (leaf.path, leaf.value, leaf.about.unit, meaning(leaf))
            for leaf in leaves(scene)
        ],
    )


def count_text(scene: Scene) -> str:
    """Short summary of a scene."""
    n = scene.brake.linings.count
    fields = leaves(scene)
    words = [
        f"{sum(np.size(leaf.value) for leaf in fields)} numbers in {len(fields)} fields",
        f"{n} {scene.brake.words.lining}s",
        *scene.brake.features,
    ]
    if scene.heated:
        words.append(
            f"{sum(body.count for body in scene.network.bodies)} thermal nodes"
        )
    return ", ".join(words)


def _about_text(about: Quantity | Whole | None) -> str:
    """Meaning and range of a number, as `width, > 0`."""
    if about is None:
        return ""
    if isinstance(about, Whole):
        return f"{about.meaning}, {about.low}…{about.high}"
    within = "" if about.range == "finite" else about.range
    return ", ".join(
        x for x in (about.meaning, within, "one or a list" if about.many else "") if x
    )


def _kind_text(part: Part) -> str:
    if part.kind in PLAIN:
        return PLAIN[part.kind][0]
    names = [*part.makers]
    if part.kind is float:
        unit = "of its place" if part.unit == "SI" else part.unit
        names = ["number" if unit == "1" else f"number, {unit}", *names]
    else:
        names += ["a number"] if short_of(part.classes) else []
        names += ["name in the library"] if Material in part.classes else []
    return ("list of " if part.many else "") + " | ".join(names)


def _default_text(part: Part) -> str:
    default = part.default
    if part.needed:
        return "needed"
    if default is None or default is dataclasses.MISSING:
        return "absent"
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, int | float | np.ndarray):
        return f"{float(default):g}"
    return (
        default
        if isinstance(default, str)
        else "empty"
        if isinstance(default, tuple)
        else type(default).__name__
    )


def _block(name: str, maker: Maker) -> str:
    doc = (
        (inspect.getdoc(maker) or "")
        .split("\n\n")[0]
        .replace("\n", " ")
        .partition("  - ")[0]
    )
    rows = [
        (
            part.name,
            _default_text(part),
            "  — ".join(x for x in (_kind_text(part), _about_text(part.about)) if x),
        )
        for part in parts_of(maker)
    ]
    from tabulate import tabulate  # (the reader of files needs it for nothing else)

    table = tabulate(rows, tablefmt="plain", disable_numparse=True)
    return f"{name}: {doc}\n{textwrap.indent(table, '  ')}".rstrip()


_HEAD = """A scene file is TOML. Keys are those below, from `Scene` down. Numbers are in SI, or texts with their unit
("120 kN", "270 deg", "450 degC"); a list also as "[0.2, 0.3] rad". Where several types are possible, `type = "…"`
names the one meant, if the keys are ambiguous. A bare number makes the constant law. Omitted keys are absent, or
have the value given here."""


def schema_text(name: str | None = None) -> str:
    """Format of scene files: of one type or key, or everything. Raises `InputError` for
    unknown names."""
    makers = all_makers()
    parts = [part for maker in makers.values() for part in parts_of(maker)]
    if name is None:
        chosen = makers
    elif name in makers:
        chosen = {name: makers[name]}
    else:
        chosen = {
            key: maker
            for part in parts
            if part.name == name
            for key, maker in part.makers.items()
        }
    if not chosen:
        keys = sorted({part.name for part in parts})
        hint = nearest(str(name), [*makers, *keys], f"there are: {', '.join(makers)}")
        raise input_error(str(name), "unknown type, or key without a type", hint)
    blocks = [_block(key, maker) for key, maker in chosen.items()]
    return "\n\n".join([_HEAD, *blocks] if name is None else blocks)
