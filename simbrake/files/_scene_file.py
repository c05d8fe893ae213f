"""Scenes as files: TOML read with every fault in one report and written without loss, or Python."""

import dataclasses
import difflib
import importlib.util
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from jax.core import Tracer

from .._base._faults import Fault, InputError, whole_file
from .._base._quantity import BAD, NumberReader, Quantity, Whole, example, shown
from .._parts._scene import Scene, check, paths_without_meaning
from ..thermal._material import LIBRARY, Material, material
from ._schema import Part, makers_of, parts_of, several, short_of

#: so many kinds are told apart by their keys in a hint
_FEW = 3


class SceneReader(NumberReader):
    """Reads objects by the description of `_schema`. `folder`: where files are sought that the tables name."""

    def __init__(self, folder: Path):
        super().__init__()
        self.folder = folder

    # --- objects --------------------------------------------------------------------------------------------------

    def object(self, value: Any, wanted: tuple[type, ...], path: str, unit: str) -> Any:
        """An object of one of the `wanted` classes from a table, or from what stands for one in short."""
        makers = makers_of(wanted)
        if isinstance(value, str) and "Material" in makers:
            return self._material(value, path)
        short = short_of(wanted)
        if not isinstance(value, dict):
            if short is None or isinstance(value, bool) or not isinstance(value, int | float | str | list):
                return self.fault(path, f"{shown(value)} is not a table", f"give a table with {_of(makers)}")
            first = parts_of(short)[0]
            inner = self.part(value, first, path, unit if first.unit == "SI" else first.unit)
            return BAD if inner is BAD else self._made(short, {first.name: inner}, path)
        table = dict(value)
        maker = self._maker(table, makers, path)
        return BAD if maker is None else self._fields(table, maker, path, unit)

    def _maker(self, table: dict[str, Any], makers: dict[str, Callable[..., Any]], path: str) -> Any:
        """Which class or builder a table means: by its `type`, or the only one that its keys fit."""
        kind = table.pop("type", None)
        if kind is not None:
            if isinstance(kind, str) and kind in makers:
                return makers[kind]
            near = difflib.get_close_matches(str(kind), makers, n=1)
            hint = f"nearest: {near[0]}" if near else f"there are: {', '.join(makers)}"
            return self.fault(f"{path}.type".lstrip("."), f"{shown(kind)} is none that fits here", hint) and None
        if len(makers) == 1:
            return next(iter(makers.values()))
        names = {name: {part.name for part in parts_of(maker)} for name, maker in makers.items()}
        needed = {
            name: {part.name for part in parts_of(m) if part.needed and not part.nullable} for name, m in makers.items()
        }
        keys = set(table)
        whole = [name for name in makers if needed[name] <= keys <= names[name]]
        partly = [name for name in makers if keys and keys <= names[name]]
        most = max((len(keys & names[name]) for name in makers), default=0)
        closest = [name for name in makers if most and len(keys & names[name]) == most]
        for fits in (whole, partly, closest):
            if len(fits) == 1:
                return makers[fits[0]]
        fits = whole or partly or closest or list(makers)
        hint = f"one of: {', '.join(_told_by(name, fits, needed) for name in fits)}"
        self.fault(f"{path}.type".lstrip("."), "is missing: the keys do not tell which kind is meant", hint)
        return None

    def _fields(self, table: dict[str, Any], maker: Callable[..., Any], path: str, unit: str) -> Any:
        parts = {part.name: part for part in parts_of(maker)}
        if "file" in parts:
            parts.pop("unit")  # a history's column has the unit of the place where it stands
        found: dict[str, Any] = {"unit": unit} if "file" in parts else {}
        for key in [key for key in table if key not in parts]:
            near = difflib.get_close_matches(key, parts, n=2, cutoff=0.5)
            hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(parts)}"
            found[key] = self.fault(_join(path, key), f"unknown key of {maker.__name__}", hint)
        for name, part in parts.items():
            here = _join(path, name)
            if name in table:
                found[name] = self.part(table[name], part, here, unit if part.unit == "SI" else part.unit)
            elif part.needed and not part.nullable:
                found[name] = self.fault(here, "is missing", _wish(part, unit))
            elif part.needed:
                found[name] = None
        return BAD if any(value is BAD for value in found.values()) else self._made(maker, found, path)

    def _made(self, maker: Callable[..., Any], found: dict[str, Any], path: str) -> Any:
        try:
            return maker(**found)
        except InputError as error:  # of a file that it read
            where = f"{path}: " if path else ""
            self.faults += [Fault(where + fault.path, fault.problem, fault.hint) for fault in error.faults]
            return BAD
        except (ValueError, OverflowError) as error:
            return self.fault(path, str(error))

    def _material(self, name: str, path: str) -> Any:
        if name in LIBRARY:
            return material(name)
        near = difflib.get_close_matches(name, LIBRARY, n=2)
        hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(sorted(LIBRARY))}"
        return self.fault(path, f"{shown(name)} is not a material of the library", hint)

    # --- parts ----------------------------------------------------------------------------------------------------

    def part(self, value: Any, part: Part, path: str, unit: str) -> Any:
        """The value of one key."""
        if part.many:
            if not isinstance(value, list):
                return self.fault(path, f"{shown(value)} is not a list", "give a list, one entry for each")
            entries = [self._one(one, part, f"{path}[{i}]", unit) for i, one in enumerate(value)]
            return BAD if any(one is BAD for one in entries) else tuple(entries)
        return self._one(value, part, path, unit)

    def _one(self, value: Any, part: Part, path: str, unit: str) -> Any:
        if part.kind == "object" or (part.wanted and isinstance(value, dict)):
            return self.object(value, part.wanted, path, unit)
        if part.kind == "number":
            assert isinstance(part.about, Quantity)
            return self.number(value, part.about, path, unit)
        if part.kind == "whole":
            return self._whole(value, part.about, path)
        if part.kind == "flag":
            return value if isinstance(value, bool) else self.fault(path, f"{shown(value)} is not true or false")
        if not isinstance(value, str):
            return self.fault(path, f"{shown(value)} is not a text", "give it in quotes")
        return self.folder / value if part.kind == "file" else value

    def _whole(self, value: Any, about: Any, path: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int):
            return self.fault(path, f"{shown(value)} is not a whole number", "as in 20")
        if isinstance(about, Whole) and not about.low <= value <= about.high:
            return self.fault(path, f"{value} is out of range", f"{about.meaning} must be {about.low}…{about.high}")
        return value


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _of(makers: dict[str, Callable[..., Any]]) -> str:
    if len(makers) > 1:
        return f"the keys of one of: {', '.join(makers)}"
    return "the keys " + ", ".join(part.name for maker in makers.values() for part in parts_of(maker))


def _told_by(name: str, fits: list[str], needed: dict[str, set[str]]) -> str:
    """A kind with the keys that it needs and no other that may be meant does."""
    own = needed[name] - set().union(*(needed[other] for other in fits if other != name))
    return f"{name} (key {', '.join(sorted(own))})" if own and len(fits) <= _FEW else name


def _wish(part: Part, unit: str) -> str:
    if part.kind == "number":
        assert part.about is not None
        return f"{part.about.meaning}{example(unit if part.unit == 'SI' else part.unit)}"
    if part.kind == "whole":
        assert part.about is not None
        return f"{part.about.meaning}, a whole number"
    if part.kind == "object":
        makers = makers_of(part.wanted)
        return f"a table: {', '.join(makers)}" if len(makers) > 1 else f"a table with {_of(makers)}"
    return f"a {part.kind}"


# --- TOML -------------------------------------------------------------------------------------------------------------

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


# --- files of either kind ---------------------------------------------------------------------------------------------


def open_scene(file: str | Path) -> Scene:
    """The scene of a TOML file, or that which the function `scene()` of a Python file returns.

    Raises `InputError` with every fault of a TOML file, and with the error of a Python file in one line.
    """
    file = Path(file)
    if not file.is_file():
        folder = file.parent if file.parent.is_dir() else Path(".")
        there = sorted(str(f) for kind in ("*.toml", "*.py") for f in folder.glob(kind))
        if file.is_dir():
            there = sorted(str(f) for kind in ("*.toml", "*.py") for f in file.glob(kind))
        hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a scene file"
        raise InputError([Fault(str(file), "is a folder" if file.is_dir() else "there is no such file", hint)])
    if file.suffix == ".toml":
        return read_scene(file)
    if file.suffix != ".py":
        hint = "a scene is a .toml file, or a .py file with a function scene()"
        raise InputError([Fault(str(file), "is neither TOML nor Python", hint)])
    return _from_python(file)


def _from_python(file: Path) -> Scene:
    spec = importlib.util.spec_from_file_location(f"scenario_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        if not callable(getattr(module, "scene", None)):
            raise InputError([Fault(str(file), "defines no function scene()", "return a simbrake.Scene from it")])
        scene = module.scene()
    except InputError:
        raise
    except Exception as error:  # whatever goes wrong in somebody's file is a fault of the input, told in one line
        raise InputError([Fault(str(file), f"{type(error).__name__}: {error}", "mend the scenario file")]) from error
    if not isinstance(scene, Scene):
        raise InputError([Fault(str(file), f"scene() returned {type(scene).__name__}", "return a simbrake.Scene")])
    return scene
