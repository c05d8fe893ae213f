"""From the tables of a file to the objects of a scene: every key looked at, every fault kept."""

import difflib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .._base._faults import Fault, InputError
from .._base._numbers import BAD, NumberReader, example, shown
from .._base._quantity import Quantity, Whole
from .._parts._material import LIBRARY, material
from ._schema import Part, makers_of, parts_of, short_of

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
                return self.fault(path, f"{shown(value)} is no table", f"give a table with {_of(makers)}")
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
        return self.fault(path, f"{shown(name)} is no material of the library", hint)

    # --- parts ----------------------------------------------------------------------------------------------------

    def part(self, value: Any, part: Part, path: str, unit: str) -> Any:
        """The value of one key."""
        if part.many:
            if not isinstance(value, list):
                return self.fault(path, f"{shown(value)} is no list", "give a list, one entry for each")
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
            return self.fault(path, f"{shown(value)} is no text", "give it in quotes")
        return self.folder / value if part.kind == "file" else value

    def _whole(self, value: Any, about: Any, path: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int):
            return self.fault(path, f"{shown(value)} is no whole number", "as in 20")
        if isinstance(about, Whole) and not about.low <= value <= about.high:
            return self.fault(path, f"{value} is not admissible", f"{about.meaning} must be {about.low}…{about.high}")
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
