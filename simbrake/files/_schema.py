"""What may stand in a scene: one description of every part, as tables to read and as JSON Schema."""

import dataclasses
import difflib
import functools
import importlib
import inspect
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity, Whole, about_of, alternatives, leaves, short_of, unit_below
from .._parts._programme import programme_scene
from .._parts._scene import AbstractDuty, Scene
from ..brakes._design import AbstractBrake, Lining, uniform_linings
from ..profiles import AbstractProfile, ramp
from ..thermal._builders import layered_heat, lumped_heat, with_external_pair, with_pulley_structure
from ..thermal._heat import Heat
from ..thermal._material import LIBRARY
from ._history import history

#: functions that make an object of a class, by name in a file as the classes themselves are
BUILDERS: dict[type, tuple[Callable[..., Any], ...]] = {
    Lining: (uniform_linings,),
    AbstractProfile: (ramp, history),
    Scene: (programme_scene,),
    Heat: (layered_heat, lumped_heat, with_pulley_structure, with_external_pair),
}
#: families whose classes have no keys that would do for another one of them
TOLD_BY_KEYS: set[type] = {AbstractBrake, AbstractDuty}
#: modules that define parts
_PARTS = (
    "friction",
    "loads",
    "profiles",
    "wear",
    "thermal._builders",
    "thermal._heat",
    "brakes._design",
    "brakes._pressed",
)


class Part(NamedTuple):
    """One field of a class, or parameter of a builder.

    - `kind`: number, whole, text, flag, file, or object;  `many`: a list of them
    - `about`: of a number or whole number;  `wanted`: classes of an object, which may also replace a number
    - `unit`: what the unit `SI` means below it, `SI` where that depends on what is above
    """

    name: str
    kind: str
    about: Quantity | Whole | None
    wanted: tuple[type, ...]
    many: bool
    nullable: bool
    default: Any
    unit: str

    @property
    def needed(self) -> bool:
        return self.default is dataclasses.MISSING


_KINDS = {str: "text", bool: "flag", int: "whole", Path: "file"}


@functools.cache
def parts_of(maker: Callable[..., Any]) -> tuple[Part, ...]:
    """The fields of a class, or the parameters of a builder, in their order."""
    if isinstance(maker, type):
        hints = typing.get_type_hints(maker)
        fields = [field for field in dataclasses.fields(maker) if field.init]
        return tuple(_of_field(field, hints[field.name]) for field in fields)
    annotated = inspect.unwrap(maker)
    hints = typing.get_type_hints(annotated, include_extras=True)
    return tuple(_of_parameter(one, hints[one.name]) for one in inspect.signature(annotated).parameters.values())


def _of_field(field: dataclasses.Field, hint: Any) -> Part:
    default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
    about = about_of(field, "SI") or field.metadata.get("whole")
    return _part(field.name, hint, about, default, unit_below(field, "SI"))


def _of_parameter(parameter: inspect.Parameter, hint: Any) -> Part:
    about = None
    if typing.get_origin(hint) is typing.Annotated:
        hint, about = typing.get_args(hint)
    default = dataclasses.MISSING if parameter.default is inspect.Parameter.empty else parameter.default
    return _part(parameter.name, hint, about, default, about.unit if isinstance(about, Quantity) else "SI")


def _part(name: str, hint: Any, about: Any, default: Any, unit: str) -> Part:
    many = typing.get_origin(hint) is tuple
    kinds = alternatives(typing.get_args(hint)[0] if many else hint)
    wanted = tuple(t for t in kinds if isinstance(t, type) and issubclass(t, eqx.Module))
    nullable = type(None) in kinds or default is None
    if isinstance(about, Quantity):
        kind = "number"
    elif wanted:
        kind = "object"
    else:
        kind = next((_KINDS[t] for t in kinds if t in _KINDS), "")
    return Part(name, kind, about, wanted, many, nullable, default, unit)


@functools.cache
def _import_all_parts() -> None:
    """Classes are found among the subclasses of their family, so all of them must be there."""
    for name in _PARTS:
        importlib.import_module(f"{__name__.partition('.')[0]}.{name}")


@functools.cache
def makers_of(wanted: tuple[type, ...]) -> dict[str, Callable[..., Any]]:
    """Classes and builders that give one of the `wanted` classes and can be written in a file: name → maker."""
    _import_all_parts()
    found: dict[str, Callable[..., Any]] = {}
    for base in wanted:
        family, seen = [base], set()
        while family:
            one = family.pop(0)
            family += one.__subclasses__()
            own = one.__module__.partition(".")[0] == __name__.partition(".")[0]
            if one in seen or not own or inspect.isabstract(one):
                continue
            seen.add(one)
            if all(part.kind for part in parts_of(one)):  # functions of one's own cannot be written
                found[one.__name__] = one
        for builder in BUILDERS.get(base, ()):
            found[builder.__name__] = builder
    return found


def several(wanted: tuple[type, ...]) -> bool:
    """Whether a table of one of the `wanted` classes must name its own; builders are told by their keys."""
    if set(wanted) <= TOLD_BY_KEYS:
        return False
    return sum(isinstance(maker, type) for maker in makers_of(wanted).values()) > 1


@functools.cache
def all_makers() -> dict[str, Callable[..., Any]]:
    """Everything that a scene file may name or imply, from the scene down: name → maker."""
    found: dict[str, Callable[..., Any]] = dict(makers_of((Scene,)))
    open_ends: list[Callable[..., Any]] = list(found.values())
    while open_ends:
        for part in parts_of(open_ends.pop(0)):
            for name, maker in makers_of(part.wanted).items():
                if name not in found:
                    found[name] = maker
                    open_ends.append(maker)
    return found


# --- JSON Schema ------------------------------------------------------------------------------------------------------

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
    properties = {part.name: _part_schema(part) for part in parts} | {"type": {"const": name}}
    needed = [part.name for part in parts if part.needed and not part.nullable]
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def _part_schema(part: Part) -> dict[str, Any]:
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


# --- tables to read ---------------------------------------------------------------------------------------------------


def numbers_of(scene: Scene) -> list[dict[str, Any]]:
    """Every number of a scene: path, value (SI), unit, meaning."""
    return [
        {
            "path": leaf.path,
            "value": np.asarray(leaf.value).tolist(),
            "unit": leaf.about.unit,
            "meaning": leaf.about.meaning,
        }
        for leaf in leaves(scene)
    ]


def _value_text(value: Any) -> str:
    array = np.asarray(value)
    if array.ndim == 0:
        return f"{float(array):.10g}"
    if array.size and np.ptp(array) <= 1e-14 * np.abs(array).max():
        return f"{array.size} × {array.flat[0]:.10g}"
    shown = [f"{x:.6g}" for x in array]
    return f"[{', '.join(shown if len(shown) <= 6 else [*shown[:3], '…', *shown[-2:]])}]"


def numbers_text(scene: Scene) -> str:
    """The table of `simbrake scene show`."""
    rows = [(row["path"], _value_text(row["value"]), row["unit"], row["meaning"]) for row in numbers_of(scene)]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    lines = [
        f"{path:<{widths[0]}}  {value:>{widths[1]}} {'' if unit in ('1', 'SI') else unit:<{widths[2]}}  {meaning}"
        for path, value, unit, meaning in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


def count_text(scene: Scene) -> str:
    """What a scene has, in a few words."""
    n, found = scene.brake.linings.count, leaves(scene)
    words = [
        f"{sum(np.size(leaf.value) for leaf in found)} numbers in {len(found)} fields",
        f"{n} {scene.brake.words.lining}s",
        *scene.brake.features,
    ]
    if scene.heated:
        words.append(f"{sum(body.count for body in scene.network.bodies)} thermal nodes")
    return ", ".join(words)


def range_text(about: Quantity | Whole | None, unit: str) -> str:
    """The range of a number in words, as `> 0 m`."""
    if isinstance(about, Whole):
        return f"{about.low}…{about.high}"
    if about is None:
        return ""
    range_ = "" if about.range == "finite" else about.range
    return range_ + (", one or a list" if about.many else "")


def _kind_text(part: Part) -> str:
    if part.kind == "object":
        names = " | ".join(makers_of(part.wanted))
        short = " | a number" if short_of(part.wanted) else ""
        short += " | name in the library" if "Material" in makers_of(part.wanted) else ""
        return f"list of {names}{short}" if part.many else names + short
    if part.kind == "number":
        laws = "".join(f" | {name}" for name in makers_of(part.wanted))
        unit = "of its place" if part.unit == "SI" else part.unit
        return ("number" if unit == "1" else f"number, {unit}") + laws
    return {"whole": "whole number", "text": "text", "flag": "true or false", "file": "CSV file"}[part.kind]


def _default_text(part: Part) -> str:
    if part.needed and not part.nullable:
        return "needed"
    if part.needed or part.default is None:
        return "absent"
    if isinstance(part.default, bool):
        return str(part.default).lower()
    if isinstance(part.default, int | float | np.ndarray) and np.size(part.default) == 1:
        return f"{float(part.default):g}"
    return part.default if isinstance(part.default, str) else "empty" if isinstance(part.default, tuple) else "zero"


def _block(name: str, maker: Callable[..., Any]) -> str:
    doc = (inspect.getdoc(maker) or "").split("\n\n")[0].replace("\n", " ").partition("  - ")[0]
    parts = [part for part in parts_of(maker) if not (name == "history" and part.name == "unit")]
    rows = [
        (
            part.name,
            _default_text(part),
            _kind_text(part),
            ""
            if part.about is None
            else ", ".join(x for x in (part.about.meaning, range_text(part.about, part.unit)) if x),
        )
        for part in parts
    ]
    widths = [max((len(row[i]) for row in rows), default=0) for i in range(2)]
    lines = [
        f"  {key:<{widths[0]}}  {default:<{widths[1]}}  {kind}{'  — ' + about if about else ''}"
        for key, default, kind, about in rows
    ]
    return "\n".join([f"{name}: {doc}", *lines])


_HEAD = """A scene file is TOML. Keys are those below, from `Scene` down. Numbers are in SI, or texts with their unit
("120 kN", "270 deg", "450 degC"); a list also as "[0.2, 0.3] rad". Where several types are possible, `type = "…"`
names the one meant, if the keys do not tell. A bare number stands for the constant law. What is left out is absent, or
has the value given here."""


def schema_text(name: str | None = None) -> str:
    """What may stand in a scene file: of one type or key, or everything. Raises `InputError` for unknown names."""
    makers = all_makers()
    if name is None:
        return "\n\n".join([_HEAD, *(_block(key, maker) for key, maker in makers.items())])
    if name in makers:
        return _block(name, makers[name])
    of_key: dict[str, Callable[..., Any]] = {}
    keys = {part.name for maker in makers.values() for part in parts_of(maker)}
    for maker in makers.values():
        for part in parts_of(maker):
            if part.name == name:
                of_key |= makers_of(part.wanted)
    if of_key:
        return "\n\n".join(_block(key, maker) for key, maker in of_key.items())
    near = difflib.get_close_matches(name, [*makers, *keys], n=3)
    hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(makers)}"
    raise InputError([Fault(name, "is no type and no key with a type of a scene", hint)])
