"""A scene with other parameters: values by their paths, as in `--set`."""

import dataclasses
import difflib
import math
import re
from collections.abc import Collection, Iterable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._faults import Fault, Faults, InputError, Issues
from .._base._part import (
    Part,
    about_of,
    below,
    faults_of_values,
    parts_below,
    presence_below,
    unit_below,
)
from .._base._quantity import (
    IndexedBy,
    NumberReader,
    Quantity,
    as_number,
    has_units,
    shown,
)
from ..brakes.design import Lining
from ..hybrid.struct import with_value_at
from ..parts.scene import Scene, require_scene

_INDEXED = re.compile(r"^(?P<path>.*?)(?:\[(?P<index>-?[0-9]{1,9})\])?$", re.DOTALL)


def entry_of(path: str) -> tuple[str, int | None]:
    """Field and index that a path means: `("brake.linings.angle", 3)`; no index for a
    field as a whole."""
    match = _INDEXED.match(path)
    assert match is not None
    return match["path"], None if match["index"] is None else int(match["index"])


class _Slot(NamedTuple):
    """A place for a number: its value, its metadata, and whether the physics behind it
    may be absent."""

    value: Any
    about: Quantity
    optional: bool


def _slot(part: Any, path: str, unit: str = "SI") -> _Slot | None:
    """The place at a path below a part, also where a number is absent now or a law is
    in its place; `None` where no number may be set."""
    step, dot, rest = path.partition(".")
    name, index = entry_of(step)
    field = next((f for f in dataclasses.fields(part) if f.name == name), None)
    if field is None:
        return None
    value = getattr(part, name)
    if not dot:
        about = about_of(field, unit)
        return about and _Slot(value, about, field.default is None)
    if index is not None:
        entries = value if isinstance(value, tuple | list) else ()
        value = entries[index] if 0 <= index < len(entries) else None
    return (
        _slot(value, rest, unit_below(field, unit))
        if dataclasses.is_dataclass(value)
        else None
    )


@explained
def with_values(scene: Scene, values: dict[str, Any]) -> Scene:
    """The scene with other numbers: `{"brake.band.stiffness": 3e5,
    "brake.linings.angle[0]": 0.2}`.

    Numbers are in SI, or texts with a unit (`"120 kN"`). One number given for an array
    field counts for every entry, a list has one for each. `brake.linings.count` changes
    the number of equal linings over the same wrap angle. Raises `InputError` with all
    unknown paths and the nearest names, and with values that do not fit.

    Example:
        >>> sb.with_values(scene, {"initial.omega": 18.0}).initial
        Initial(omega=18 rad/s, elongation=0 m, time=0 s)
    """
    require_scene(scene)
    faults = Issues()
    if _COUNT in values and isinstance(scene.brake.linings, Lining):
        values = dict(values)
        scene = _with_count(scene, values.pop(_COUNT), faults)
    for full, value in values.items():
        path, i = entry_of(full)
        slot = _slot(scene, path)
        if slot is None:
            faults.append(unknown_number(scene, full))
            continue
        if has_units(value):
            reader = NumberReader()
            value = reader.number(
                list(value) if isinstance(value, tuple) else value,
                slot.about,
                full,
                slot.about.unit,
            )
            faults += reader.faults
            if reader.faults:
                continue
        old = slot.value
        new = as_number(value)
        if isinstance(new, list | tuple):
            faults.add(full, f"{shown(new)} is not a list of numbers")
            continue
        if i is not None:
            size = np.size(old) if np.ndim(old) == 1 else 0
            if not -size <= i < size:
                faults.add(
                    full, f"there is no entry {i}", f"{path} has {size} entries, from 0"
                )
                continue
            if np.ndim(new) != 0 or new is None:
                faults.add(full, "one number is needed for one entry")
                continue
            new = _with_entry(old, i, value)
        elif new is None:
            if old is not None and not slot.optional:
                faults.add(full, "cannot be absent", "give a number")
                continue
        elif np.ndim(old) == 1 and np.ndim(new) == 0:
            new = (
                jnp.broadcast_to(new, np.shape(old))
                if isinstance(new, jax.Array)
                else np.full(np.shape(old), new)
            )
        elif (
            np.ndim(old) == 1
            and np.shape(new) != np.shape(old)
            and slot.about.many is not IndexedBy.ROWS
        ):
            # how many there are is structure, also where the list itself says it
            hint = f"give one number, or a list of {np.size(old)}"
            faults.add(full, f"has the shape {np.shape(new)}", hint)
            continue
        scene = with_value_at(scene, path, new)
    faults += presence_below(scene)
    if faults:
        # with those of the values that could be read
        raise InputError([*faults, *faults_of_values(scene)])
    return scene


_COUNT = "brake.linings.count"


def _with_count(scene: Scene, value: Any, faults: Faults) -> Scene:
    """The scene with another number of equal linings, their parameters unchanged;
    errors go to `faults`."""
    brake: Any = scene.brake
    linings = brake.linings
    n = brake.linings.count
    size = (
        float(value)
        if np.ndim(value) == 0 and not isinstance(value, str | None)
        else math.nan
    )
    bodies = scene.network.bodies if scene.heated else ()
    own = [leaf for leaf in jax.tree.leaves(linings) if np.ndim(leaf)]
    others = [
        leaf for leaf in jax.tree.leaves((brake.band, brake.bandage)) if np.ndim(leaf)
    ]
    if not (size.is_integer() and 1 <= size <= 10_000):
        faults.append(
            Fault(
                _COUNT, f"{value} is not a number of linings", "a whole number from 1"
            )
        )
    elif (
        others
        or any(np.ptp(leaf) > 0 for leaf in own)
        or any(getattr(body, "copies", body.count) == n > 1 for body in bodies)
    ):
        faults.append(
            Fault(
                _COUNT,
                "linings differ, or other parts have a number for each",
                "change the scene's file",
            )
        )
    else:
        resized = jax.tree.map(
            lambda x: np.full(int(size), x[0]) if np.ndim(x) else x, linings
        )
        angle = np.full(int(size), float(linings.wrap) / size)
        linings = dataclasses.replace(resized, angle=angle)
        scene = dataclasses.replace(
            scene, brake=dataclasses.replace(brake, linings=linings)
        )
    return scene


def unknown_number(scene: Scene, full: str) -> Fault:
    """Error of a path that is no number of a scene, with what to write instead where
    that is known, also of a key of a file: `load.mass` for `duty.load.mass`."""
    path, _ = entry_of(full)
    there = [
        below(where, field)
        for where, part, unit in parts_below(scene)
        for field in dataclasses.fields(part)
        if about_of(field, unit)
    ]
    fault = fault_of_path(full, there)
    where, _, name = path.rpartition(".")
    part = next(
        (part for at, part, _ in parts_below(scene) if f".{at}".endswith(f".{where}")),
        None,
    )
    hint = part.meant_by(name, vars(part)) if isinstance(part, Part) else ""
    return dataclasses.replace(fault, hint=hint) if hint else fault


def fault_of_path(full: str, there: Collection[str]) -> Fault:
    """Error of a path that means none of the numbers there are, with the nearest
    ones."""
    path, _ = entry_of(full)
    near = difflib.get_close_matches(path, there, n=3, cutoff=0.4)
    tail = [
        name for name in there if name.rsplit(".", 1)[-1] == path.rsplit(".", 1)[-1]
    ]
    names = list(dict.fromkeys([*tail, *near]))[:4]
    hint = f"nearest: {', '.join(names)}" if names else f"as {', '.join([*there][:4])}"
    return Fault(full, "there is no such number in the scene", hint)


def fault_of_limit(path: str) -> Fault | None:
    """Error of a limit, or of all of them, among the parameters of a run; `None` for
    any other path."""
    if path.partition(".")[0] != "limits":
        return None
    return Fault(
        path,
        "is no parameter of a run",
        "what a run gives is compared with a limit: set it in the scene",
    )


def with_inputs(scene: Scene, values: dict[str, Any]) -> Scene:
    """The scene with other numbers on which its run depends. Raises `InputError` as
    `with_values`, and for limits."""
    if limits := [fault for fault in map(fault_of_limit, values) if fault is not None]:
        raise InputError(limits)
    return with_values(scene, values)


def unknown_paths(scene: Scene, paths: Iterable[str]) -> list[str]:
    """Those of the paths that are not numbers of the scene."""
    return [path for path in paths if _slot(scene, entry_of(path)[0]) is None]


def read_numbers(scene: Scene, path: str, texts: Sequence[str | float]) -> list[float]:
    """Values for a number of the scene, each in SI or with its unit, as
    `["40 t", "80 t"]`.

    Raises `InputError` for an unknown path, for what is not a number in its range, and
    where only some have a unit.
    """
    slot = _slot(scene, entry_of(path)[0])
    if slot is None:
        raise InputError([unknown_number(scene, path)])
    reader = NumberReader()
    values = [reader.number(text, slot.about, path, slot.about.unit) for text in texts]
    bare = [text for text in map(str, texts) if _is_float(text)]
    if not reader.faults and 0 < len(bare) < len(texts):
        reader.fault(
            path,
            f"{bare[0].strip()} has no unit, others have one",
            "give all of them their unit",
        )
    if reader.faults:
        raise InputError(reader.faults)
    return [float(value) for value in values]


def numbers_in_si(scene: Scene, path: str, values: Any) -> Any:
    """Values for a number of the scene, of which some have a unit, as numbers in SI:
    `["40 t", "80 t"]` as by `read_numbers`, `"40 t"` as one. Without any text they are
    what they are."""
    if isinstance(values, np.ndarray) and values.dtype.kind in "OU":
        values = values.tolist()
    if not has_units(values):
        return values
    texts = [values] if isinstance(values, str) else [*values]
    numbers = read_numbers(scene, path, texts)
    return numbers[0] if isinstance(values, str) else numbers


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _with_entry(old: Any, i: int, value: Any) -> Any:
    # traced ones among them
    if isinstance(old, jax.Array) or isinstance(value, jax.Array):
        return jnp.asarray(old).at[i].set(value)
    new = np.array(old, dtype=np.float64)
    new[i] = value
    return new
