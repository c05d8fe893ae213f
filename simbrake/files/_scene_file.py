"""Scenes as files: TOML read with every error in one report and written without loss,
or Python."""

import dataclasses
import difflib
import os
import re
import runpy
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from jax.core import Tracer

from .._base._faults import (
    Fault,
    InputError,
    Issues,
    input_error,
    nearest,
    of_radius,
    text_of_file,
    whole_file,
)
from .._base._part import Whole, faults_of_whole, leaves, meant_by, short_of, tried_for
from .._base._quantity import BAD, NumberReader, Quantity, example, shown
from ..hybrid.struct import Struct
from ..parts.programme import parse_programme, programme_scene, undriven_scene
from ..parts.scene import Scene, paths_without_meaning, require_scene
from ..parts.scene_checks import check_scene
from ..phases import AbstractEnd, AfterTime, read_end
from ..runs.edit import unknown_paths, with_values
from ..thermal.materials import LIBRARY, Material, material
from .schema import FORMAT, VERSION, Maker, Part, history, makers_of, parts_of, several
from .shipped_scenes import scene_file

#: value of a TOML file: a text, number, flag, date, list or table
Toml: TypeAlias = object
#: number of kinds that a hint distinguishes by their keys
_FEW = 3
#: a key of 64 parts and more
_DEEP = re.compile(r"""(?<![\w"' \t-])(?:[\w"' \t-]++\.){64}""")
#: where data files named in a scene may lie anywhere, not only in the folder of the
#: scene and below
_ANYWHERE = "SIMBRAKE_DATA_ANYWHERE"


class SceneReader(NumberReader):
    """Read objects by the description of `_schema`.

    - `folder`: where files named in the tables are searched
    - `undriven`: whether a scene gets its motion elsewhere
    """

    def __init__(self, folder: Path, *, undriven: bool = False) -> None:
        super().__init__()
        self.folder = folder
        self.undriven = undriven

    # --- objects ---------------------------------------------------------------------

    def read(
        self, value: Toml, classes: tuple[type, ...], path: str, unit: str
    ) -> object:
        """An object of one of the `classes` from a table or its short form."""
        makers = makers_of(classes)
        if isinstance(value, str) and Material in classes:
            if value in LIBRARY:
                return material(value)
            return self.fault(
                path,
                f"{shown(value)} is not a material of the library",
                nearest(value, sorted(LIBRARY)),
            )
        if AbstractEnd in classes and self.undriven and path.endswith("until"):
            return AfterTime(1.0)
        if isinstance(value, str) and AbstractEnd in classes:
            try:
                return read_end(value, path)
            except InputError as error:
                self.faults += error.faults
                return BAD
        short = short_of(classes)
        if not isinstance(value, dict):
            if (
                short is None
                or isinstance(value, bool)
                or not isinstance(value, int | float | str | list)
            ):
                hint = (
                    f"give a table with {_keys_of(makers)}{_named(value, path, makers)}"
                )
                return self.fault(path, f"{shown(value)} is not a table", hint)
            first = parts_of(short)[0]
            inner = self.part(value, first, path, first.unit_at(unit))
            return BAD if inner is BAD else self._made(short, {first.name: inner}, path)
        table = dict(value)
        maker = self._maker(table, makers, path)
        return BAD if maker is None else self._fields(table, maker, path, unit, makers)

    def _maker(
        self, table: dict[str, Toml], makers: dict[str, Maker], path: str
    ) -> Maker | None:
        """Class or builder of a table: by its `type`, or the only one that its keys
        fit."""
        kind = table.pop("type", None)
        type_path = _join(path, "type")
        if kind is not None:
            if isinstance(kind, str) and kind in makers:
                return makers[kind]
            self.fault(
                type_path,
                f"{shown(kind)} does not fit here",
                nearest(str(kind), makers),
            )
            return None
        if len(makers) == 1:
            return next(iter(makers.values()))
        names = {
            name: {*tried_for(maker), *(part.name for part in parts_of(maker))}
            for name, maker in makers.items()
        }
        needed = {
            name: {part.name for part in parts_of(maker) if part.needed}
            for name, maker in makers.items()
        }
        keys = set(table)
        # the better reason comes first: nothing is missing or unknown, nothing is
        # unknown, the most keys are known, of these nothing is missing
        reasons = {
            name: (
                needed[name] <= keys <= allowed,
                bool(keys) and keys <= allowed,
                len(keys & allowed),
                bool(needed[name]) and needed[name] <= keys,
            )
            for name, allowed in names.items()
        }
        fits = [
            name for name, reason in reasons.items() if reason == max(reasons.values())
        ]
        if len(fits) == 1:
            return makers[fits[0]]
        hint = f"one of: {', '.join(_told_by(name, fits, needed) for name in fits)}"
        self.fault(
            type_path, "is missing: the keys do not tell which kind is meant", hint
        )
        return None

    def _fields(
        self,
        table: dict[str, Toml],
        maker: Maker,
        path: str,
        unit: str,
        makers: Mapping[str, Maker],
    ) -> object:
        parts = {part.name: part for part in parts_of(maker)}
        # a history's column has the unit of the field that holds it
        values: dict[str, object] = {"unit": unit} if maker is history else {}
        for key in [key for key in table if key not in parts]:
            what = f"unknown key of {maker.__name__}"
            hints = (meant_by(kind, key, table) for kind in (maker, *makers.values()))
            hint = next(filter(None, hints), "") or _nearest_key(key, parts, makers)
            values[key] = self.fault(_join(path, key), what, hint)
        for name, part in parts.items():
            part_path = _join(path, name)
            if name in table:
                values[name] = self.part(
                    table[name], part, part_path, part.unit_at(unit)
                )
            elif part.needed:
                values[name] = self.fault(
                    part_path, "is missing", _expected(part, part.unit_at(unit))
                )
            elif part.default is dataclasses.MISSING:
                values[name] = None
        if not any(value is BAD for value in values.values()):
            return self._made(maker, values, path)
        if maker is programme_scene and not self.undriven:
            lines = values["programme"]
            # its words can be read, whatever else is wrong
            if lines is not BAD:
                self._made(parse_programme, {"lines": lines}, path)
        return BAD

    def _made(self, maker: Maker, values: dict[str, object], path: str) -> object:
        if maker is programme_scene and self.undriven:
            maker = undriven_scene
        try:
            return maker(**values)  # pyright: ignore
        except InputError as error:  # of fields together, or of a file that it read
            fields = {part.name for part in parts_of(maker)}
            where = f"{path}: " if path else ""
            for fault in error.faults:
                name = fault.path.removeprefix(f"{maker.__name__}.")
                place = _join(path, name) if name in fields else where + fault.path
                self.faults.append(dataclasses.replace(fault, path=place))
            return BAD
        except (ValueError, OverflowError) as error:
            return self.fault(path, str(error))

    # --- parts -----------------------------------------------------------------------

    def part(self, value: Toml, part: Part, path: str, unit: str) -> object:
        """The value of one key."""
        if part.many:
            if not isinstance(value, list):
                return self.fault(
                    path,
                    f"{shown(value)} is not a list",
                    "give a list, one entry for each",
                )
            entries = [
                self._one(entry, part, f"{path}[{i}]", unit)
                for i, entry in enumerate(value)
            ]
            return BAD if any(entry is BAD for entry in entries) else tuple(entries)
        return self._one(value, part, path, unit)

    def _one(self, value: Toml, part: Part, path: str, unit: str) -> object:
        if part.kind is Struct or (part.classes and isinstance(value, dict)):
            return self.read(value, part.classes, path, unit)
        if isinstance(part.about, Quantity):
            return self.number(value, part.about, path, unit)
        if isinstance(part.about, Whole):
            faults = faults_of_whole(path, value, part.about)
            self.faults += faults
            return BAD if faults else value
        if part.kind is bool:
            return (
                value
                if isinstance(value, bool)
                else self.fault(path, f"{shown(value)} is not true or false")
            )
        if not isinstance(value, str):
            return self.fault(
                path, f"{shown(value)} is not a text", "give it in quotes"
            )
        return self._file(value, path) if part.kind is Path else value

    def _file(self, name: str, path: str) -> object:
        """The path of a data file; a scene that comes from somebody else must not read
        whatever it names."""
        file = self.folder / name
        home = Path(os.path.realpath(self.folder))
        if "\0" not in name and (
            os.environ.get(_ANYWHERE) == "1"
            or Path(os.path.realpath(file)).is_relative_to(home)
        ):
            return file
        hint = f"put it beside the scene, or allow all files by {_ANYWHERE}=1"
        return self.fault(
            path, f"{shown(name)} is not in the folder of the scene", hint
        )


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _keys_of(makers: dict[str, Maker]) -> str:
    if len(makers) > 1:
        return f"the keys of one of: {', '.join(makers)}"
    return "the keys " + ", ".join(
        part.name for maker in makers.values() for part in parts_of(maker)
    )


def _named(value: Toml, path: str, makers: dict[str, Maker]) -> str:
    """The kind that a text in place of a table means most likely, as it is written."""
    if not isinstance(value, str) or len(makers) < 2:
        return ""
    names = {name.lower(): name for name in makers}
    word, key = (
        re.sub(r"\W", "", text[:40]).lower()
        for text in (value, path.rpartition(".")[2])
    )
    having = [name for name in names if word in name]
    near = (
        having
        if len(having) == 1
        else difflib.get_close_matches(word + key, names, n=1, cutoff=0.3)
    )
    return f', as in {{ type = "{names[near[0]]}" }}' if near else ""


def _told_by(name: str, fits: list[str], needed: dict[str, set[str]]) -> str:
    """A kind with the keys that it needs and no other that may be meant does."""
    own = needed[name] - set().union(
        *(needed[other] for other in fits if other != name)
    )
    return (
        f"{name} (key {', '.join(sorted(own))})" if own and len(fits) <= _FEW else name
    )


def _nearest_key(
    key: str, parts: Mapping[str, Part], makers: Mapping[str, Maker]
) -> str:
    """Hint for a key that is none of the `parts` of the kind that the other keys tell,
    one of `makers`."""
    tried = [
        name
        for name, part in parts.items()
        if isinstance(part.about, Whole) and key in part.about.guesses
    ]
    if tried:
        return f"did you mean {tried[0]}?"
    hint = of_radius(key, parts) or nearest(key, parts)
    others = [
        name
        for name, maker in makers.items()
        if any(part.name == key for part in parts_of(maker))
    ]
    return f"a key of {', '.join(others)}; {hint}" if others else hint


def _expected(part: Part, unit: str) -> str:
    """Hint for a part that is missing."""
    if part.about is not None:
        return part.about.meaning + (
            example(unit) if isinstance(part.about, Quantity) else ", a whole number"
        )
    if len(part.makers) > 1:
        number = "a number, or " if short_of(part.classes) else ""
        return f"{number}a table: {', '.join(part.makers)}"
    return f"a table with {_keys_of(part.makers)}" if part.makers else "a text"


# --- TOML ---------------------------------------------------------------------------


def scene_from_text(
    text: str,
    folder: str | Path = ".",
    values: Mapping[str, Any] | None = None,
    *,
    undriven: bool = False,
) -> Scene:
    """The scene that a TOML text describes.

    Keys are the names of the fields of `Scene` and of what is in it;
    `simbrake scene schema` lists them. A number is written in SI, or as text with its
    unit (`"120 kN"`, `"270 deg"`, `"450 degC"`); a list of numbers also as
    `"[0.2, 0.3] rad"`. Where several kinds of an object are possible, `type` names the
    class or builder, if the keys do not tell; a bare number makes the constant law, a
    text names a material of the library. Omitted keys are absent or have their default.
    `folder`: where the files that it names are searched. `values`: by path, as of
    `with_values`, and of keys of the text that are no numbers of the scene, as
    `brake.linings.count`. `undriven`: the scene gets its motion from elsewhere
    (`sb.rig.replay`); its programme, start and end may be wrong.

    Raises `InputError` with every error: path, value, unit, reason, and the nearest
    name or the range.

    Example:
        >>> sb.files.scene_from_text(sb.files.scene_text(scene)).initial
        Initial(omega=24 rad/s, elongation=0 m, time=0 s)
    """
    # the time to read such a key grows with the square of its parts
    if _DEEP.search(text):
        raise input_error("TOML", "is nested too deeply")
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise input_error(
            "TOML",
            str(error),
            "fix this line: quotes around texts, a decimal point, each key once",
        ) from None
    # a number of more digits than Python converts
    except (RecursionError, ValueError) as error:
        raise input_error("TOML", f"cannot be read: {error}"[:200]) from None
    scene = _scene_of(tables, Path(folder), undriven=undriven)
    rest = dict(values or {})
    keys = {
        path: rest[path]
        for path in unknown_paths(scene, rest)
        if _set_key(tables, path, rest[path])
    }
    if keys:
        scene = _scene_of(tables, Path(folder), undriven=undriven)
    return (
        with_values(
            scene, {path: value for path, value in rest.items() if path not in keys}
        )
        if rest
        else scene
    )


def _scene_of(tables: dict[str, Toml], folder: Path, *, undriven: bool) -> Scene:
    """The scene of the tables of a file."""
    reader = SceneReader(folder, undriven=undriven)
    if undriven and "programme" not in tables:
        tables = {**tables, "initial": {"omega": 0.0}, "end_time": 1.0}
    version = tables.get(FORMAT, VERSION)
    if version != VERSION:
        reader.fault(
            FORMAT, f"{version!r} is not known", f'this program reads "{VERSION}"'
        )
    try:
        tables = {key: value for key, value in tables.items() if key != FORMAT}
        scene = reader.read(tables, (Scene,), "", "SI")
    except RecursionError:
        raise input_error("TOML", "is nested too deeply") from None
    reader.faults.report()
    assert isinstance(scene, Scene)
    if not undriven:  # (else what moves it is checked with it)
        check_scene(scene)
    return scene


def _set_key(tables: dict[str, Toml], path: str, value: Any) -> bool:
    """Set a key of the tables, as `brake.linings.count` or
    `duty.slack_tension.phases[1].until`; `False`: no such key.

    A whole number counts as one, and `None` removes the key.
    """
    steps = [
        int(step) if step.isascii() and step.isdigit() else step
        for step in re.findall(r"[^.\[\]]+", path[:999])
    ]
    if not steps:
        return False
    *above, last = steps
    node: Any = tables
    try:
        for step in above:
            node = node[step]
        node[last]
    except (KeyError, IndexError, TypeError):
        return False
    if not isinstance(node, dict | list):  # letters of a text
        return False
    if value is None:
        del node[last]
        return True
    plain = (
        value.tolist()
        if isinstance(value, np.ndarray)
        else {"true": True, "false": False}.get(value, value)
    )
    node[last] = (
        int(plain) if isinstance(plain, float) and plain.is_integer() else plain
    )
    return True


def scene_text(scene: Scene) -> str:
    """A scene as TOML, every number with its unit; `scene_from_text` gives the same
    scene back, to the last bit.

    Raises `InputError` naming all parts that a file cannot hold: custom functions and
    classes, traced numbers.

    Example:
        >>> sb.files.scene_text(scene).splitlines()[0]
        'format = "simbrake scene 1"'
    """
    import tomli_w

    require_scene(scene)
    hint = "write the scene outside of jit and grad"
    faults = Issues(
        Fault(leaf.path, "is traced", hint)
        for leaf in leaves(scene)
        if isinstance(leaf.value, Tracer)
    )
    writer = _Writer(paths_without_meaning(scene), faults)
    tables = {} if faults else writer.table(scene, (Scene,), "", "SI")
    faults.report()
    return tomli_w.dumps({FORMAT: VERSION, **tables})


def write_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene to a TOML file, whole or not at all; see `scene_text`.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     sb.write_scene(scene, f"{folder}/stop.toml")
        ...     sb.read_scene(f"{folder}/stop.toml").initial
        Initial(omega=24 rad/s, elongation=0 m, time=0 s)
    """
    text = scene_text(scene)
    with whole_file(Path(path)) as file:
        file.write_text(text, "utf-8")


class _Writer:
    """Write a scene by the description that the reader uses."""

    def __init__(self, left_out: tuple[str, ...], faults: Issues) -> None:
        self.left_out = left_out
        self.faults = faults

    def table(
        self, node: Struct, classes: tuple[type, ...], path: str, unit: str
    ) -> dict[str, Toml]:
        maker = type(node)
        if makers_of(classes).get(maker.__name__) is not maker:
            what = f"{maker.__name__} is a custom class or function"
            self.faults.add(
                path, what, "a file cannot hold it; keep the scene in Python"
            )
            return {}
        table: dict[str, Toml] = {"type": maker.__name__} if several(classes) else {}
        for part in parts_of(maker):
            value = getattr(node, part.name)
            part_path = _join(path, part.name)
            if value is not None and part_path not in self.left_out:
                table[part.name] = self._value(
                    value, part, part_path, part.unit_at(unit)
                )
        return table

    def _value(self, value: object, part: Part, path: str, unit: str) -> Toml:
        if isinstance(value, tuple) and part.many:
            return [
                self._one(entry, part, f"{path}[{i}]", unit)
                for i, entry in enumerate(value)
            ]
        return self._one(value, part, path, unit)

    def _one(self, value: object, part: Part, path: str, unit: str) -> Toml:
        if isinstance(value, Material):
            library_name = next(
                (name for name in LIBRARY if material(name) == value), None
            )
            return library_name or self.table(value, part.classes, path, unit)
        if isinstance(value, Struct):
            return self.table(value, part.classes, path, unit)
        if not isinstance(part.about, Quantity):
            return value
        number = np.asarray(value, np.float64).tolist()
        return number if unit in ("1", "SI") else f"{number!r} {unit}"


# --- files of either kind -----------------------------------------------------------


def read_scene(
    path: str | Path, values: Mapping[str, Any] | None = None, *, undriven: bool = False
) -> Scene:
    """The scene of a file, or the template or shipped scene of that name; with `values`
    by path.

    A TOML file is read as `simbrake.files.scene_from_text` says, also `undriven`. A
    Python file is run, and its function `scene()` returns the scene: read a file of
    somebody else first.

    Raises `InputError` with every error of a TOML file, with the error of a Python file
    in one line, and with the nearest names where there is no such file.

    Example:
        >>> sb.read_scene("standard", {"initial.omega": "12 rad/s"}).initial
        Initial(omega=12 rad/s, elongation=0 m, time=0 s)
    """
    file = scene_file(path)
    if file.suffix.lower() == ".toml":
        return scene_from_text(
            text_of_file(file), file.parent, values, undriven=undriven
        )
    if file.suffix.lower() != ".py":
        hint = "a scene is a .toml file, or a .py file with a function scene()"
        raise input_error(str(file), "is neither TOML nor Python", hint)
    try:
        names = runpy.run_path(str(file), run_name=f"scene_{file.stem}")
        if not callable(names.get("scene")):
            if callable(names.get("main")):
                raise input_error(
                    str(file), "is a study without a scene", f"run it: python {file}"
                )
            raise input_error(
                str(file),
                "defines no function scene()",
                "return a simbrake.Scene from it",
            )
        scene = names["scene"]()
    except InputError:
        raise
    except SystemExit as error:
        raise input_error(
            str(file), f"ends by sys.exit({error.code!r})", "return a scene instead"
        ) from error
    # any exception in a user's file is an input error, reported in one line
    except Exception as error:
        raise input_error(
            str(file), f"{type(error).__name__}: {error}", "fix the scene file"
        ) from error
    if not isinstance(scene, Scene):
        raise input_error(
            str(file),
            f"scene() returned {type(scene).__name__}",
            "return a simbrake.Scene",
        )
    return with_values(scene, dict(values)) if values else scene
