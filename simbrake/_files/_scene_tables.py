"""Scenes and their schema as tables to read."""

import difflib
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity, Whole, leaves
from .._parts._scene import Scene
from ._schema import Part, all_makers, makers_of, parts_of, short_of


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
