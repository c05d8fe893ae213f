"""Changing numbers of a scene by their paths, as `--set` does."""

import dataclasses
import difflib
import json
import re
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._numbers import NumberReader
from .._base._quantity import Quantity, about_of, as_number, leaves, unit_below
from .._parts._scene import Scene

_INDEXED = re.compile(r"^(?P<path>.*?)(?:\[(?P<index>-?\d+)\])?$")


def _slots(node: Any, path: str = "") -> dict[str, Any]:
    """Every number of a scene that may be set, also those that are absent now: path → value."""
    found = {leaf.path: leaf.value for leaf in leaves(node, path)}
    if isinstance(node, tuple):
        for i, child in enumerate(node):
            found |= _slots(child, f"{path}[{i}]")
    elif dataclasses.is_dataclass(node) and not isinstance(node, type):
        for field in dataclasses.fields(node):
            here, value = f"{path}.{field.name}" if path else field.name, getattr(node, field.name)
            if "quantity" in field.metadata:
                found.setdefault(here, value)  # also a law that stands for a number: a number may replace it
            if "quantity" not in field.metadata or dataclasses.is_dataclass(value):
                found |= _slots(value, here)
    return found


def _abouts(node: Any, path: str = "", unit: str = "SI") -> dict[str, Quantity]:
    """What is known of every number that may be set: path → quantity, with the unit that it has there."""
    found: dict[str, Quantity] = {}
    if isinstance(node, tuple):
        for i, child in enumerate(node):
            found |= _abouts(child, f"{path}[{i}]", unit)
    elif dataclasses.is_dataclass(node) and not isinstance(node, type):
        for field in dataclasses.fields(node):
            here, about = f"{path}.{field.name}" if path else field.name, about_of(field, unit)
            found |= {} if about is None else {here: about}
            found |= _abouts(getattr(node, field.name), here, unit_below(field, unit))
    return found


def parse_assignments(assignments: list[str]) -> dict[str, Any]:
    """`path=value` pairs: numbers, with a unit if need be, lists in brackets, or `none` for physics to be absent."""
    values, faults = {}, []
    for text in assignments:
        path, equals, value = text.partition("=")
        path, value = path.strip(), value.strip()
        if not equals or not path or not value:
            faults.append(Fault(text, "is not of the form path=value", "as in brake.band.stiffness=2e5"))
            continue
        if value.lower() == "none":
            values[path] = None
            continue
        try:
            number = float(value) if not value.startswith("[") else json.loads(value)
            values[path] = np.asarray(number, dtype=np.float64)
        except (ValueError, TypeError):
            values[path] = value  # a number with its unit, which is read where the path is known
    if faults:
        raise InputError(faults)
    return values


def with_values(scene: Scene, values: dict[str, Any]) -> Scene:
    """The scene with other numbers: `{"brake.band.stiffness": 3e5, "brake.linings.angle[0]": 0.2}`.

    Numbers are in SI, or texts with a unit (`"120 kN"`). One number given for an array field counts for every entry.
    Raises `InputError` with all unknown paths and the nearest names, and with values that do not fit.
    """
    slots, abouts, faults = _slots(scene), _abouts(scene), []
    for full, value in values.items():
        match = _INDEXED.match(full)
        assert match is not None
        path, index = (full, None) if full in slots else (match["path"], match["index"])
        if path not in slots:
            near = difflib.get_close_matches(path, slots, n=3, cutoff=0.4)
            tail = [name for name in slots if name.rsplit(".", 1)[-1] == path.rsplit(".", 1)[-1]]
            names = list(dict.fromkeys([*tail, *near]))[:4]
            hint = f"nearest: {', '.join(names)}" if names else f"there are: {', '.join(slots)}"
            faults.append(Fault(full, "there is no such number in the scene", hint))
            continue
        if isinstance(value, str):
            reader = NumberReader()
            value = reader.number(value, abouts[path], full, abouts[path].unit)
            faults += reader.faults
            if reader.faults:
                continue
        old, new = slots[path], as_number(value)
        if index is not None:
            i, size = int(index), np.size(old) if np.ndim(old) == 1 else 0
            if not -size <= i < size:
                faults.append(Fault(full, f"there is no entry {i}", f"{path} has {size} entries, from 0"))
                continue
            if np.ndim(new) != 0 or new is None:
                faults.append(Fault(full, "one number is needed for one entry"))
                continue
            new = _with_entry(old, i, value)
        elif new is None:
            if old is not None and path not in _optional(scene):
                faults.append(Fault(full, "cannot be absent", "give a number"))
                continue
        elif np.ndim(old) == 1 and np.ndim(new) == 0:
            new = jnp.broadcast_to(new, np.shape(old)) if isinstance(new, jax.Array) else np.full(np.shape(old), new)
        scene = _replace(scene, path, new)
        slots[path] = new
        if dataclasses.is_dataclass(old):  # its numbers went with it
            slots = {name: value for name, value in slots.items() if not name.startswith(f"{path}.")}
    if faults:
        raise InputError(faults)
    return scene


def _with_entry(old: Any, i: int, value: Any) -> Any:
    if isinstance(old, jax.Array) or isinstance(value, jax.Array):  # traced ones among them
        return jnp.asarray(old).at[i].set(value)
    new = np.array(old, dtype=np.float64)
    new[i] = value
    return new


def _optional(node: Any, path: str = "") -> set[str]:
    """Paths whose field has the default `None`: physics that may be absent."""
    found: set[str] = set()
    if dataclasses.is_dataclass(node) and not isinstance(node, type):
        for field in dataclasses.fields(node):
            here = f"{path}.{field.name}" if path else field.name
            if "quantity" in field.metadata and field.default is None:
                found.add(here)
            else:
                found |= _optional(getattr(node, field.name), here)
    return found


def _replace(scene: Scene, path: str, value: Any) -> Scene:
    steps = re.findall(r"[^.\[\]]+", path)

    def reach(node: Any) -> Any:
        for step in steps:
            node = node[int(step)] if step.isdigit() else getattr(node, step)
        return node

    return eqx.tree_at(reach, scene, value, is_leaf=lambda x: x is None)
