"""Scenes as TOML files: read with every fault in one report, written back without loss."""

import dataclasses
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from jax.core import Tracer

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity
from .._base._whole import whole_file
from .._parts._material import LIBRARY, Material, material
from .._parts._scene import Scene, check, paths_without_meaning
from ._scene_reader import SceneReader
from ._schema import Part, makers_of, parts_of, several

#: key of a file that says in which form it is written
FORMAT = "format"
_VERSION = "simbrake scene 1"


def scene_from_text(text: str, folder: str | Path = ".") -> Scene:
    """The scene that a TOML text describes.

    Keys are the names of the fields of `Scene` and of what is in it; `simbrake scene schema` lists them. A number is
    written in SI, or as text with its unit (`"120 kN"`, `"270 deg"`, `"450 degC"`); a list of numbers also as
    `"[0.2, 0.3] rad"`. Where several kinds of an object are possible, `type` names the class or builder, if the keys do
    not tell; a bare number stands for the constant law, a text for a material of the library. What is left out is
    absent or has its default. `folder`: where files that it names are sought.

    Raises `InputError` with every fault: path, value, unit, why, and the nearest name or the range.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError([Fault("TOML", str(error), "mend the line named; texts stand in quotes")]) from None
    except (RecursionError, ValueError) as error:  # a number of more digits than Python converts
        raise InputError([Fault("TOML", f"cannot be read: {error}"[:200])]) from None
    reader = SceneReader(Path(folder))
    version = tables.pop(FORMAT, _VERSION)
    if version != _VERSION:
        reader.fault(FORMAT, f"{version!r} is not known", f'this program reads "{_VERSION}"')
    try:
        scene = reader.object(tables, (Scene,), "", "SI")
    except RecursionError:
        raise InputError([Fault("TOML", "is nested too deeply")]) from None
    if reader.faults:
        raise InputError(reader.faults)
    assert isinstance(scene, Scene)
    check(scene)
    return scene


def read_scene(path: str | Path) -> Scene:
    """The scene of a TOML file; see `scene_from_text`. Raises `InputError` with every fault."""
    path = Path(path)
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        there = sorted(str(file) for file in path.parent.glob("*.toml")) if path.parent.is_dir() else []
        hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a scene file"
        raise InputError([Fault(str(path), "there is no such file", hint)]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError([Fault(str(path), f"cannot be read: {error}", "give a TOML file in UTF-8")]) from None
    return scene_from_text(text, path.parent)


def scene_text(scene: Scene) -> str:
    """A scene as TOML, every number with its unit; `scene_from_text` gives the same scene back, to the last bit.

    Raises `InputError` naming all parts that a file cannot hold: functions and classes of one's own, traced numbers.
    """
    import tomli_w

    writer = _Writer(paths_without_meaning(scene))
    tables = writer.table(scene, (Scene,), "", "SI")
    if writer.faults:
        raise InputError(writer.faults)
    return tomli_w.dumps({FORMAT: _VERSION, **tables})


def write_scene(scene: Scene, path: str | Path) -> None:
    """Writes a scene to a TOML file, whole or not at all; see `scene_text`."""
    text = scene_text(scene)
    with whole_file(Path(path)) as file:
        file.write_text(text, "utf-8")


class _Writer:
    """Goes through a scene by the same description that the reader has."""

    def __init__(self, left_out: tuple[str, ...]) -> None:
        self.faults: list[Fault] = []
        self.left_out = left_out

    def table(self, node: Any, wanted: tuple[type, ...], path: str, unit: str) -> dict[str, Any]:
        makers = makers_of(wanted)
        name = type(node).__name__
        if makers.get(name) is not type(node):
            what = f"{name} is a class or a function of one's own"
            self.faults.append(Fault(path, what, "a file cannot hold it; keep the scene in Python"))
            return {}
        table: dict[str, Any] = {"type": name} if several(wanted) else {}
        return table | self._entries(type(node), node, path, unit)

    def _entries(self, maker: Callable[..., Any], node: Any, path: str, unit: str) -> dict[str, Any]:
        entries = {}
        for part in parts_of(maker):
            value = getattr(node, part.name)
            here = f"{path}.{part.name}" if path else part.name
            if value is not None and here not in self.left_out:
                entries[part.name] = self._value(value, part, here, unit if part.unit == "SI" else part.unit)
        return entries

    def _value(self, value: Any, part: Part, path: str, unit: str) -> Any:
        if part.many:
            return [self._one(v, part, f"{path}[{i}]", unit) for i, v in enumerate(value)]
        return self._one(value, part, path, unit)

    def _one(self, value: Any, part: Part, path: str, unit: str) -> Any:
        if isinstance(value, Material):
            known = next((name for name in LIBRARY if _same(material(name), value)), None)
            return known or self.table(value, part.wanted, path, unit)
        if isinstance(value, eqx.Module):
            return self.table(value, part.wanted, path, unit)
        if not isinstance(part.about, Quantity):
            return value
        if isinstance(value, Tracer):
            self.faults.append(Fault(path, "is traced", "write the scene outside of jit and grad"))
            return 0.0
        return _number(np.asarray(value, np.float64).tolist(), unit)


def _number(value: float | list[float], unit: str) -> Any:
    return value if unit in ("1", "SI") else f"{value!r} {unit}"


def _same(a: Any, b: Any) -> bool:
    """Whether two objects without parts of their own have the same numbers."""
    pairs = [(getattr(a, field.name), getattr(b, field.name)) for field in dataclasses.fields(a)]
    return all((x is None) == (y is None) and (x is None or np.array_equal(x, y)) for x, y in pairs)
