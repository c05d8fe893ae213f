"""From the tables of a file to the objects of a scene: every key looked at, every fault kept."""

import difflib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ._material import LIBRARY, material
from ._quantity import Fault, InputError, Quantity, Whole
from ._schema import Part, makers_of, parts_of, short_of
from ._units import to_si, unit

#: what stands for a part that could not be read; the objects around it are not made then
BAD = object()
_NUMBER = re.compile(r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(?P<unit>[^\d\s.].*|1/.*|)")
_LIST = re.compile(r"\s*(?P<list>\[[^\[\]]*\])\s*(?P<unit>.*)")


class SceneReader:
    """Reads objects by the description of `_schema`. `folder`: where files are sought that the tables name."""

    def __init__(self, folder: Path):
        self.folder, self.faults = folder, list[Fault]()

    def fault(self, path: str, problem: str, hint: str = "") -> Any:
        self.faults.append(Fault(path or "scene", problem, hint))
        return BAD

    # --- objects --------------------------------------------------------------------------------------------------

    def object(self, value: Any, wanted: tuple[type, ...], path: str, unit: str) -> Any:
        """An object of one of the `wanted` classes from a table, or from what stands for one in short."""
        makers = makers_of(wanted)
        if isinstance(value, str) and "Material" in makers:
            return self._material(value, path)
        short = short_of(wanted)
        if not isinstance(value, dict):
            if short is None or isinstance(value, bool) or not isinstance(value, int | float | str | list):
                return self.fault(path, f"{_shown(value)} is no table", f"give a table with {_of(makers)}")
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
            return self.fault(f"{path}.type", f"{_shown(kind)} is none that fits here", hint) and None
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
        self.fault(f"{path}.type", "is missing: the keys do not tell which kind is meant", f"one of: {', '.join(fits)}")
        return None

    def _fields(self, table: dict[str, Any], maker: Callable[..., Any], path: str, unit: str) -> Any:
        parts = {part.name: part for part in parts_of(maker)}
        if "file" in parts:
            parts.pop("unit")  # a history's column has the unit of the place where it stands
        found: dict[str, Any] = {"unit": unit} if "file" in parts else {}
        for key in [key for key in table if key not in parts]:
            near = difflib.get_close_matches(key, parts, n=2, cutoff=0.5)
            hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(parts)}"
            found[key] = self.fault(_join(path, key), f"is no key of {maker.__name__}", hint)
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
            self.faults += [Fault(f"{path}: {fault.path}", fault.problem, fault.hint) for fault in error.faults]
            return BAD
        except (ValueError, OverflowError) as error:
            return self.fault(path, str(error))

    def _material(self, name: str, path: str) -> Any:
        if name in LIBRARY:
            return material(name)
        near = difflib.get_close_matches(name, LIBRARY, n=2)
        hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(sorted(LIBRARY))}"
        return self.fault(path, f"{_shown(name)} is no material of the library", hint)

    # --- parts ----------------------------------------------------------------------------------------------------

    def part(self, value: Any, part: Part, path: str, unit: str) -> Any:
        """The value of one key."""
        if part.many:
            if not isinstance(value, list):
                return self.fault(path, f"{_shown(value)} is no list", "give a list, one entry for each")
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
            return value if isinstance(value, bool) else self.fault(path, f"{_shown(value)} is not true or false")
        if not isinstance(value, str):
            return self.fault(path, f"{_shown(value)} is no text", "give it in quotes")
        return self.folder / value if part.kind == "file" else value

    def _whole(self, value: Any, about: Any, path: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int):
            return self.fault(path, f"{_shown(value)} is no whole number", "as in 20")
        if isinstance(about, Whole) and not about.low <= value <= about.high:
            return self.fault(path, f"{value} is not admissible", f"{about.meaning} must be {about.low}…{about.high}")
        return value

    def number(self, value: Any, about: Quantity, path: str, unit: str) -> Any:
        """A number or a list of numbers in SI, inside its range."""
        if isinstance(value, str) and (match := _LIST.fullmatch(value)):
            try:
                listed = json.loads(match["list"])
            except ValueError:
                return self.fault(path, f"{_shown(value)} is no list of numbers", 'as in "[0.2, 0.3] rad"')
            value = [f"{x!r} {match['unit']}" if isinstance(x, int | float) else x for x in listed]
        if isinstance(value, list) and not about.many:
            return self.fault(path, "is a list", f"one number is wanted: {about.meaning}{_example(unit)}")
        if isinstance(value, list):
            entries = [self._scalar(one, about, f"{path}[{i}]", unit) for i, one in enumerate(value)]
            return BAD if any(one is BAD for one in entries) else np.asarray(entries, np.float64)
        return self._scalar(value, about, path, unit)

    def _scalar(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        number = self._in_si(value, about, path, si)
        if number is BAD or about.admits(np.asarray(number)).all():
            return number
        words = f"{about.meaning} must be {about.range}" + ("" if si in ("1", "SI") else f" {si}")
        same = isinstance(value, str) and f"{number:g} {si}" != value and np.isfinite(number)
        return self.fault(path, f"{_shown(value)}{f' = {number:g} {si}' if same else ''} is not admissible", words)

    def _in_si(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            return self.fault(path, f"{_shown(value)} is no number", f"{about.meaning}{_example(si)}")
        if not isinstance(value, str):
            try:
                return float(value)
            except OverflowError:
                return self.fault(path, f"{_shown(value)} is too large")
        match = _NUMBER.fullmatch(value)
        if match is None:
            return self.fault(path, f"{_shown(value)} is no number with a unit", f"{about.meaning}{_example(si)}")
        try:
            of = unit(match["unit"], si)
        except ValueError as error:
            what = f"{match['unit'].strip()!r} is no unit of {about.meaning}, which is in {si}"
            return self.fault(path, f"{_shown(value)}: {what}", str(error))
        if about.difference and of.offset:
            return self.fault(path, f"{_shown(value)} is a temperature, not a difference of two", "give it in K")
        number = float(match["number"])
        return to_si(number, of)


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _shown(value: Any) -> str:
    text = repr(value) if not isinstance(value, dict) else "a table"
    return text if len(text) <= 60 else text[:57] + "…"


def _of(makers: dict[str, Callable[..., Any]]) -> str:
    if len(makers) > 1:
        return f"the keys of one of: {', '.join(makers)}"
    return "the keys " + ", ".join(part.name for maker in makers.values() for part in parts_of(maker))


def _example(si: str) -> str:
    examples = {"N": "120 kN", "rad": "270 deg", "K": "450 degC", "m": "590 mm", "rad/s": "24 rad/s", "s": "0.35 s"}
    return f', in SI units or with its unit, as in "{examples.get(si, f"1.5 {si}")}"' if si not in ("1", "SI") else ""


def _wish(part: Part, unit: str) -> str:
    if part.kind == "number":
        assert part.about is not None
        return f"{part.about.meaning}{_example(unit if part.unit == 'SI' else part.unit)}"
    if part.kind == "whole":
        assert part.about is not None
        return f"{part.about.meaning}, a whole number"
    if part.kind == "object":
        makers = makers_of(part.wanted)
        return f"a table: {', '.join(makers)}" if len(makers) > 1 else f"a table with {_of(makers)}"
    return f"a {part.kind}"
