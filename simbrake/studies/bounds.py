"""Numbers of a scene as one vector: their paths, bounds, and scaled unknowns in their
place."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError, Issues
from .._base._part import Leaf, leaves
from .._base._quantity import Quantity, unit_suffix
from ..hybrid.arrays import Array
from ..parts.scene import Scene, require_scene
from ..parts.scene_checks import faults
from ..runs.edit import entry_of, numbers_in_si, with_inputs, with_values

#: runs named in one error
_NAMED = 5


class Inputs(dict[str, Leaf]):
    """The numbers of a scene on which a run depends, by path: all but its limits."""

    def __init__(self, scene: Scene) -> None:
        super().__init__((leaf.path, leaf) for leaf in leaves(scene.as_run))

    def about(self, path: str) -> Quantity:
        """Metadata of a number, or of an entry of a list."""
        return self[entry_of(path)[0]].about

    def twice(self, paths: Iterable[str]) -> list[Fault]:
        """An error for each path that means a number which an earlier one means as
        well."""
        first_paths: dict[tuple[str, int | None], str] = {}
        repeats = {}
        for path in paths:
            field, index = entry_of(path)
            if index is not None and field in self:
                index %= max(np.size(self[field].value), 1)
            for (other, i), earlier in first_paths.items():
                if other == field and (index is None or i in (None, index)):
                    repeats.setdefault(path, earlier)
            first_paths[field, index] = path
        return [
            Fault(path, f"overlaps with {earlier}", "give each number once")
            for path, earlier in repeats.items()
        ]


class Paths(NamedTuple):
    """Numbers of a scene as one vector: their paths, and the shape of each."""

    names: tuple[str, ...]
    shapes: tuple[tuple[int, ...], ...]

    @classmethod
    def each(cls, names: Iterable[str]) -> "Paths":
        """One number for each path; for a path of a list it counts for all entries."""
        return cls(tuple(names), tuple(() for _ in names))

    @classmethod
    def of(cls, chosen: Iterable[Leaf]) -> "Paths":
        """All entries of these parameters of a scene."""
        shapes = {leaf.path: np.shape(leaf.value) for leaf in chosen}
        return cls(tuple(shapes), tuple(shapes.values()))

    @property
    def entries(self) -> list[tuple[str, tuple[int, ...]]]:
        """Path and index of every number, `()` of one that is no list."""
        return [
            (name, i)
            for name, shape in zip(self.names, self.shapes, strict=True)
            for i in np.ndindex(shape)
        ]

    @property
    def spans(self) -> list[slice]:
        """Where each path lies in the vector."""
        ends = np.cumsum([0, *(math.prod(shape) for shape in self.shapes)]).tolist()
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    def values(self, x: Array) -> dict[str, Array]:
        """The numbers by path."""
        parts = zip(self.names, self.shapes, self.spans, strict=True)
        return {name: x[span].reshape(shape) for name, shape, span in parts}

    def __call__(self, scene: Scene, x: Array, given: object = None) -> Scene:
        return with_values(scene, self.values(x))


def named_runs(runs: Sequence[int] | np.ndarray) -> str:
    """`(run 3)`, `(runs 3, 4, 5, 6, 7 and 12 more)`."""
    more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
    each = ", ".join(map(str, runs[:_NAMED]))
    return f"(run {each})" if len(runs) == 1 else f"(runs {each}{more})"


def faults_of_runs(scenes: Iterable[tuple[int, Scene]]) -> list[Fault]:
    """Errors of the scenes of runs, each reported once, with the runs that have it."""
    seen: dict[tuple[str, str], tuple[Fault, list[int]]] = {}
    for i, scene in scenes:
        for fault in faults(scene):
            seen.setdefault((fault.path, fault.hint), (fault, []))[1].append(i)
    return [
        Fault(fault.path, f"{fault.problem} {named_runs(runs)}", fault.hint)
        for fault, runs in seen.values()
    ]


def numbers_of(chosen: Iterable[Leaf]) -> np.ndarray:
    """The numbers of parameters as one vector, in the order of `Paths.of`."""
    return np.concatenate(
        [np.ravel(np.asarray(leaf.value, np.float64)) for leaf in chosen]
    )


def name_of_entry(path: str, index: tuple[int, ...]) -> str:
    """Path of an entry of a list, `path` itself for the index `()`."""
    return f"{path}[{', '.join(map(str, index))}]" if index else path


class Box(NamedTuple):
    """Numbers that are free within bounds (k,), and unknowns `z` in 0…1 in their place,
    linear or logarithmic."""

    paths: Paths
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    logarithmic: np.ndarray

    @property
    def _scale(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower bounds and ratios of the bounds where unknowns are logarithmic."""
        low = np.where(self.logarithmic, self.low, 1.0)
        return low, np.where(self.logarithmic, self.high / low, np.e)

    def up(self, z: Any, xp: ModuleType = np) -> Any:
        """The numbers for unknowns; `xp`: `jax.numpy` for traced ones."""
        low, ratio = self._scale
        return xp.where(
            self.logarithmic, low * ratio**z, self.low + (self.high - self.low) * z
        )

    def down(self, x: np.ndarray) -> np.ndarray:
        """The unknowns for numbers."""
        low, ratio = self._scale
        log = np.log(np.where(self.logarithmic, x / low, 1.0)) / np.log(ratio)
        return np.where(self.logarithmic, log, (x - self.low) / (self.high - self.low))

    def slope(self, x: Any, xp: ModuleType = np) -> Any:
        """`dx/dz`."""
        return xp.where(
            self.logarithmic, x * np.log(self._scale[1]), self.high - self.low
        )


def array_in_si(
    scene: Scene, path: str, value: Any, issues: Issues
) -> np.ndarray | None:
    """Values of a number in SI; `None` where they are none. Adds what is wrong with
    them."""
    try:
        return np.array(numbers_in_si(scene, path, value), np.float64)
    except InputError as error:
        issues += error.faults
    except (TypeError, ValueError):
        hint = "numbers in SI, or texts with units"
        issues.add(path, "its values are not numbers", hint)
    return None


def bounds_of(
    scene: Scene,
    path: str,
    pair: Any,
    issues: Issues,
    about: Quantity | None,
    shape: tuple[int, ...] = (),
) -> np.ndarray | None:
    """Bounds (2, …) of a number in SI from (low, high); `None` where they are none.
    Adds what is wrong with them."""
    try:
        pair = numbers_in_si(scene, path, pair)
        low, high = (np.broadcast_to(np.asarray(end, float), shape) for end in pair)
    except InputError as error:
        issues += error.faults
        return None
    except (TypeError, ValueError):
        hint = f"(low, high), numbers or lists of {math.prod(shape)}"
        issues.add(path, f"{pair!r} are not bounds", hint)
        return None
    ends = np.stack([low, high])
    if not np.all(np.isfinite(ends) & (low < high)):
        what = f"the bounds {pair!r} are out of range"
        issues.add(path, what, "finite, low < high")
        return None
    if about is not None and not np.all(about.admits(ends)):
        worst = ends[~about.admits(ends)][0]
        what = f"the bound {worst:g}{unit_suffix(about.unit)} is out of range"
        issues.add(path, what, f"must be {about.range}")
    return ends


def box_of(
    scene: Scene,
    bounds: Mapping[str, Any],
    issues: Issues,
    *,
    each: bool = False,
    starts: Mapping[str, float | str] | None = None,
    decades: float = np.inf,
) -> Box:
    """The numbers at paths with bounds (low, high), by default from the scene's values;
    adds what is wrong with them.

    - `each`: a field with many entries is free in every one of them; else one number
      counts for all of them
    - `decades`: ratio of the bounds above which unknowns are logarithmic
    """
    require_scene(scene)
    known = Inputs(scene)
    shapes = dict[str, tuple[int, ...]]()
    rows = []
    for path, pair in bounds.items():
        field, index = entry_of(path)
        leaf = known.get(field)
        if issues.attempt(with_inputs, scene, {path: 0.0}) is None:
            continue
        start = (starts or {}).get(path)
        value: Any = issues.attempt(numbers_in_si, scene, path, start)
        if value is None and leaf is not None:
            value = np.asarray(leaf.value, float)[... if index is None else index]
            if not each and np.size(value):
                value = value.flat[0] if np.ptp(value) == 0 else None
        shapes[path] = () if value is None else np.shape(value)
        about = None if leaf is None else leaf.about
        ends = bounds_of(scene, path, pair, issues, about, shapes[path])
        if ends is None:
            continue
        if value is None:
            hint = "give its start value"
            issues.add(path, "has no one value in the scene", hint)
            value = np.nan
        elif not np.all((value >= ends[0]) & (value <= ends[1])):
            what = f"the start {value} is outside the bounds {pair!r}"
            issues.add(path, what, "give a start inside them")
        rows.append([np.ravel(values) for values in (*ends, value)])
    issues += known.twice(shapes)
    low, high, start = [
        np.concatenate(column) for column in zip(*rows, strict=True)
    ] or [np.zeros(0)] * 3
    paths = Paths(tuple(shapes), tuple(shapes.values()))
    return Box(
        paths,
        low,
        high,
        start,
        (low > 0) & (high / np.where(low > 0, low, 1.0) > decades),
    )
