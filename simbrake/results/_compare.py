"""Stored results run again, and two results side by side."""

import dataclasses
import json
import math
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Num

from .._base._arguments import explained
from .._base._faults import Fault, InputError
from .._base._part import leaves
from .._base._table import Column, Table, Tabular, digits, number, plain, pretty, scale
from .._parts._scene import Scene
from .._run._edit import with_values
from .._run._result import Result
from .._run._simulate import simulate
from ..files._scene_file import scene_from_text
from ..hybrid import Rodas5P
from ._dataset import FORMAT, POINTS, DataArray, Dataset, dataset, parts, provenance, read_result

Source = Result | Dataset | str | Path
Settings = dict[str, Any]  # plain values of JSON by name


# --- a stored result, run again ---------------------------------------------------------------------------------------


def origin(source: Source) -> Settings:
    """Provenance of a stored result, from a file or a data set, or of a result."""
    if isinstance(source, Result):
        return provenance(source)
    data, name = (
        (read_result(source, earlier=True), str(source)) if isinstance(source, str | Path) else (source, "data set")
    )
    try:
        return json.loads(data.attrs["provenance"])
    except (AttributeError, KeyError, ValueError) as error:
        what = "has no provenance"
        raise InputError([Fault(name, what, "give a result file, or a data set of simbrake.dataset")]) from error


@explained
def rerun(source: Source, *, scene: Scene | None = None, solver: Any = None) -> Result:
    """Run a stored result again: its scene, with its solver and settings.

    - `source`: a result file, a data set or a `Result`
    - `scene`: needed where the file holds no text of it (a custom law): a scene of the same parts, whose parameters
      are replaced by those stored
    - `solver`: needed where the stored one is no solver of diffrax without options, and not `Rodas5P`

    With the same versions on the same machine the result is the same to the last bit. A run that fails is returned, as
    `simulate(..., throw=False)` does. Raises `InputError`.

    Example:
        >>> sb.results.rerun(result).status
        'stopped'
    """
    stored = origin(source)
    settings = stored["settings"]
    if scene is not None:
        scene = _filled(scene, stored["scene"])
    elif (text := stored["scene"]["toml"]) is not None:
        scene = scene_from_text(text)
    else:
        hint = "give a scene of the same parts: rerun(…, scene=…)"
        raise InputError([Fault("scene", f"is not in the file as text ({stored['scene']['why']})", hint)])
    longest = settings["max_step"]
    return simulate(
        scene,
        solver=solver or _solver_of(settings["method"]),
        rtol=settings["rtol"],
        max_step=np.inf if longest is None else longest,
        max_steps=settings["max_steps"],
        max_events=settings["max_events"],
        throw=False,
    )


def _filled(scene: Scene, stored: Settings) -> Scene:
    """The scene with the stored numbers, if it is of the stored parts."""
    own, theirs = parts(scene), stored["parts"]
    faults = [
        Fault(path or "scene", f"is {own.get(path)}, in the stored run {theirs.get(path)}", "give a scene of its parts")
        for path in sorted(own.keys() | theirs.keys())
        if own.get(path) != theirs.get(path)
    ]
    values = {row["path"]: np.asarray(row["value"], float) for row in stored["numbers"]}
    shapes = {leaf.path: np.shape(leaf.value) for leaf in leaves(scene)}
    for path in sorted(shapes.keys() | values.keys()):
        if path not in shapes or path not in values:
            where = "the stored run" if path in shapes else "the scene given"
            faults.append(Fault(path, f"is absent in {where}", "give a scene of its parts"))
        elif shapes[path] != values[path].shape:
            what = f"is of shape {shapes[path]}, in the stored run {values[path].shape}"
            faults.append(Fault(path, what, "give a scene of its parts"))
    if faults:
        raise InputError(faults)
    return with_values(scene, values)


def _solver_of(name: str) -> Any:
    if name == "Rodas5P":
        return Rodas5P()
    import diffrax  # here, as only this asks for a solver by the name in a file

    solver = getattr(diffrax, name, None)
    if isinstance(solver, type) and issubclass(solver, diffrax.AbstractERK):
        return solver()
    raise InputError([Fault("settings.method", f"{name} cannot be made by its name", "give it: rerun(…, solver=…)")])


def occurrences(events: Iterable[tuple[str, int | None, float]]) -> dict[tuple[str, int | None, int], float]:
    """Times (s) of events by name, lining, and which of these it is, from 1."""
    times: dict[tuple[str, int | None, int], float] = {}
    count: dict[tuple[str, int | None], int] = {}
    for name, lining, time in events:
        count[name, lining] = count.get((name, lining), 0) + 1
        times[name, lining, count[name, lining]] = time
    return times


# --- two results side by side -----------------------------------------------------------------------------------------

_SHOWN = 12  # rows of each kind in the text


class Change(NamedTuple):
    """One number in both results (`None` where one does not have it): `absolute` is `b − a`, `relative` to its size."""

    name: str
    a: Any
    b: Any
    unit: str
    absolute: float | None
    relative: float | None
    differs: bool


class SeriesChange(NamedTuple):
    """Largest difference of one column: `relative` to the maximum of its unit; when (s) and at which label."""

    name: str
    unit: str
    absolute: float | None
    relative: float | None
    time: float | None
    place: str
    differs: bool


class Word(NamedTuple):
    """A difference in something other than numbers."""

    name: str
    a: Any
    b: Any


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Two results side by side, `a` and `b`.

    - `scene`: numbers of the scenes that are not the same;  `parts`: classes, counts and words that are not the same
    - `events` in both, `only_a`, `only_b`;  `metrics`, `energies`, `series` of both;  `status`
    - `solver`, `versions`: settings, counts, versions and machine that are not the same; they are not judged
    - `how` the series were compared, and whether they are `judged`
    - `equal`: nothing judged differs by more than `rtol`

    Example:
        >>> change = sb.compare(result, sb.simulate(sb.with_values(scene, {"initial.omega": 18.0}))).scene[0]
        >>> change.name, change.a, change.b
        ('initial.omega', 24.0, 18.0)
    """

    rtol: float
    status: Word
    scene: list[Change]
    parts: list[Word]
    events: list[Change]
    only_a: list[str]
    only_b: list[str]
    metrics: list[Change]
    energies: list[Change]
    series: list[SeriesChange]
    how: str
    judged: bool
    solver: list[Word]
    versions: list[Word]

    @property
    def equal(self) -> bool:
        """Whether scenes and results are equal within the tolerance."""
        rows = [*self.scene, *self.events, *self.metrics, *self.energies, *self.series]
        alone = self.parts or self.only_a or self.only_b
        return not alone and self.status.a == self.status.b and not any(row.differs for row in rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain values of JSON: `null` for what is absent or infinite."""
        return {"equal": self.equal} | plain(self) | {"status": {"a": self.status.a, "b": self.status.b}}

    def _tables(self) -> Iterator[str | Table]:
        """Lines and tables in the order in which they are read."""
        yield f"{'equal' if self.equal else 'different'}: relative tolerance {self.rtol:g}"
        if self.status.a != self.status.b:
            yield f"status   {self.status.a} → {self.status.b}"
        yield from _table("parts", _WORD, self.parts)
        yield from _table("scene", _CHANGE, self.scene)
        yield from _table("only a", ["event"], [(name,) for name in self.only_a])
        yield from _table("only b", ["event"], [(name,) for name in self.only_b])
        for name, rows in (("events", self.events), ("metrics", self.metrics), ("energies", self.energies)):
            moved = sorted((row for row in rows if row.differs), key=lambda row: " of lining " in row.name)
            yield from _table(name, _CHANGE, moved)
        columns = [row for row in self.series if row.differs or (not self.judged and row.absolute)]
        columns.sort(key=lambda row: -(math.inf if row.relative is None else row.relative))
        yield from _table("series", _SERIES, columns)
        yield f"compared {_count(self.events, 'event')}, {_count(self.metrics, 'metric')}, series {self.how}"
        yield from _table("solver", _WORD, self.solver)
        yield from _table("versions", _WORD, self.versions)

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self._tables())

    __repr__ = __str__


def _count(rows: Sequence[Change], name: str) -> str:
    return f"{len(rows)} {name}{'' if len(rows) == 1 else 's'}"


def _table(title: str, columns: Sequence[Column | str], rows: Sequence[tuple[Any, ...]]) -> Iterator[Table]:
    """A table of one kind, none without rows; of many rows the first."""
    if rows:
        title = title if len(rows) <= _SHOWN else f"{title}: {_SHOWN} of {len(rows)}"
        yield Table(columns, rows[:_SHOWN], title)


def _in_scene(value: float | list[float]) -> str:
    return f"{len(value)} entries" if isinstance(value, list) else f"{value:.9g}"


_NAME, _UNIT = Column("name", left=True), Column("unit", left=True, show=pretty)
_RELATIVE, _DIFFERS = Column("relative", show=".2g"), Column("differs", hidden=True)
_WORD = [_NAME, Column("a", left=True, show=str), Column("b", left=True, show=str)]
_AB = [Column("a", show=_in_scene), Column("b", show=_in_scene)]
_CHANGE = [_NAME, *_AB, _UNIT, Column("difference", show="+.3g"), _RELATIVE, _DIFFERS]
_SERIES = [
    *(_NAME, _UNIT, Column("difference", heading="largest difference", show=".3g"), _RELATIVE),
    *(Column("time", "s"), Column("place", left=True), _DIFFERS),
]
#: counts of the solver: names in the provenance, and in a comparison
_COUNTS = {
    "accepted": "steps accepted",
    "rejected": "steps rejected",
    "retaken": "steps retaken",
    "segments": "segments",
}
_NO_NUMBERS = {"status", "method", "rtol", "code", "steps", "rejected", "retaken", "segments"}
_NEEDED = ("time", "side", "status", "event_time", "event_name", "event_lining", "energy.friction_heat")


class Beside(NamedTuple):
    """One number of several results: `values` of each, `None` where one has none; estimated `errors`, if asked for."""

    name: str
    unit: str
    values: tuple[float | None, ...]
    errors: tuple[float | None, ...] = ()


@dataclasses.dataclass(frozen=True)
class SideBySide(Tabular):
    """Several results beside each other, by letters: `a`, `b`, `c`, …

    - `status` of each;  `scene`: numbers in which the scenes are not the same;  `metrics` and energies that one has
    - `comparisons`: of each but the first with the first

    Example:
        >>> runs = [sb.simulate(sb.with_values(scene, {"initial.omega": speed})) for speed in (18.0, 21.0, 24.0)]
        >>> found = sb.compare(*runs)
        >>> found.scene[0].name, found.scene[0].values
        ('initial.omega', (18.0, 21.0, 24.0))
    """

    status: tuple[str, ...]
    scene: list[Beside]
    metrics: list[Beside]
    comparisons: list[Comparison]

    @property
    def equal(self) -> bool:
        """Whether all are equal to the first within the tolerance."""
        return all(one.equal for one in self.comparisons)

    def parts(self) -> Iterator[str | Table]:
        """Lines and tables in the order in which they are read."""
        letters = _letters(len(self.status))
        yield Table(["", *letters], [("status", *self.status)])
        yield from self._table("scene", self.scene, letters)
        yield from self._table("metrics", self.metrics, letters)

    @staticmethod
    def _table(title: str, rows: Sequence[Beside], letters: Sequence[str]) -> Iterator[Table]:
        if rows:
            columns = [Column(title, left=True), *(Column(letter, show=str) for letter in letters)]
            yield Table([*columns, _UNIT], [_beside(row) for row in rows])


def _letters(count: int) -> list[str]:
    return [chr(ord("a") + i) if i < 26 else f"#{i + 1}" for i in range(count)]


def _beside(row: Beside) -> tuple[str, ...]:
    """A row with one unit for reading; the error behind a value as ± with two digits."""
    there = [abs(value) for value in row.values if value is not None and math.isfinite(value)]
    shown = [number(value, row.unit, beside=max(there, default=1.0)) for value in row.values]
    texts = [one.text for one in shown]
    if row.errors:
        factor = scale(row.unit, max(there, default=1.0))[0]
        errors = ("" if error is None else f" ± {digits(abs(factor) * error, 2)}" for error in row.errors)
        texts = [text + error for text, error in zip(texts, errors, strict=True)]
    return row.name, *texts, next((one.unit for one in shown if one.unit), "")


def _several(sources: Sequence[Source], comparisons: list[Comparison], errors: bool) -> SideBySide:
    # (the series are not looked at)
    start = [[float(one.record.rows.t[0])] if isinstance(one, Result) else [] for one in sources]
    data = [
        dataset(one, t) if isinstance(one, Result) else _data(one, one)[0]
        for one, t in zip(sources, start, strict=True)
    ]
    numbers = [{row["path"]: row for row in origin(one)["scene"]["numbers"]} for one in data]
    scene = []
    for path in dict.fromkeys(path for own in numbers for path in own):
        values = [own[path]["value"] if path in own else None for own in numbers]
        unit = next(own[path]["unit"] for own in numbers if path in own)
        if any(value != values[0] for value in values):
            plain_numbers = (value if isinstance(value, int | float) else None for value in values)
            scene.append(Beside(path, unit, tuple(plain_numbers)))
    estimates = [one.accuracy() if errors and isinstance(one, Result) else None for one in sources]
    known = [{} if one is None else {each.name: each.error for each in one.metrics} for one in estimates]
    metrics = []
    scalars = [_single_numbers(one) for one in data]
    for name in dict.fromkeys(name for own in scalars for name in own):
        values = tuple(own[name].item() if name in own else None for own in scalars)
        unit = next(own[name].attrs["units"] for own in scalars if name in own)
        if any(value is not None and math.isfinite(value) for value in values):
            metrics.append(Beside(name, unit, values, tuple(own.get(name) for own in known) if errors else ()))
    return SideBySide(tuple(str(one["status"].item()) for one in data), scene, metrics, comparisons)


@explained
def compare(
    a: Source, b: Source, /, *more: Source, rtol: float = 1e-9, errors: bool = False
) -> Comparison | SideBySide:
    """Compare two results, or show several beside each other: each a `Result`, a data set of `simbrake.dataset`, or the
    path of a result file.

    Judged against `rtol`: every number of the scenes, event time and metric relative to its own size; energies relative
    to the largest one exchanged; series relative to the maximum of their unit, at the times that both have.
    Where they have few common times, series are interpolated and shown, but not judged. Time and place of a
    maximum are not judged either (arbitrary on a plateau). Raises `InputError`.

    Of more than two the answer is a `SideBySide`: what differs in the scenes, and all metrics. With `errors` each
    `Result` is run a second time for its estimated errors, which then stand behind the metrics, also of two.

    Example:
        >>> sb.compare(result, result).equal
        True
    """
    if more and isinstance(more[0], int | float):  # (the tolerance stood there before)
        warnings.warn("compare(a, b, rtol) is compare(a, b, rtol=rtol) now", FutureWarning, stacklevel=3)
        rtol, more = more[0], more[1:]
    comparisons = [_compared(a, other, rtol) for other in (b, *more)]
    return _several([a, b, *more], comparisons, errors) if more or errors else comparisons[0]


def _compared(a: Source, b: Source, rtol: float) -> Comparison:
    if not (np.ndim(rtol) == 0 and 0 <= rtol < 1):  # a NaN is not
        raise InputError([Fault("rtol", f"{rtol} is out of range", "0 ≤ rtol < 1")])
    left, right = _data(a, b)
    from_a, from_b = origin(left), origin(right)
    events, only_a, only_b = _events(left, right, rtol)
    metrics, energies = _scalars(left, right, rtol)
    series, how, judged = _series(left, right, rtol)
    return Comparison(
        rtol=float(rtol),
        status=Word("status", str(left["status"].item()), str(right["status"].item())),
        scene=_numbers(from_a["scene"], from_b["scene"], rtol),
        parts=_words(from_a["scene"]["parts"], from_b["scene"]["parts"]),
        events=events,
        only_a=only_a,
        only_b=only_b,
        metrics=metrics,
        energies=energies,
        series=series,
        how=how,
        judged=judged,
        solver=_words(
            *(
                source["settings"] | {key: source["outcome"][n] for n, key in _COUNTS.items()}
                for source in (from_a, from_b)
            )
        ),
        versions=_words(*({"simbrake": s["simbrake"], **s["versions"], **s["machine"]} for s in (from_a, from_b))),
    )


def _data(a: Source, b: Source) -> list[Dataset]:
    """The data sets of both; two results are evaluated at the same times."""
    times = None
    if isinstance(a, Result) and isinstance(b, Result) and a.concrete and b.concrete:
        start, end = (
            pick(float(x) for x in ends)
            for pick, ends in ((max, [r.record.rows.t[0] for r in (a, b)]), (min, [r.record.t_end for r in (a, b)]))
        )
        times = np.linspace(start, end, POINTS) if start < end else None
    datasets = []
    for source in (a, b):
        if isinstance(source, Result):
            datasets.append(dataset(source, times))
            continue
        data = read_result(source) if isinstance(source, str | Path) else source
        if getattr(data, "attrs", {}).get("format") != FORMAT:
            what = f"{type(source).__name__} is not a result"
            raise InputError([Fault("compare", what, "give a Result, its dataset, or the path of a result file")])
        if missing := [name for name in _NEEDED if name not in data.variables]:
            raise InputError([Fault("compare", f"a result is without {', '.join(missing)}", "give all of a data set")])
        datasets.append(data)
    return datasets


def _words(a: Settings, b: Settings) -> list[Word]:
    """Differing entries."""
    names = dict.fromkeys([*a, *b])
    return [Word(name or "scene", a.get(name), b.get(name)) for name in names if a.get(name) != b.get(name)]


def _change(
    name: str,
    a: float | int | None,
    b: float | int | None,
    unit: str,
    rtol: float,
    *,
    scale: float | None = None,
    judged: bool = True,
) -> Change:
    """Two numbers side by side; equal infinities are equal, and an infinite or absent one differs from a finite one."""
    if a is None or b is None:
        return Change(name, a, b, unit, None, None, True)
    if a == b:
        return Change(name, a, b, unit, 0.0, 0.0, False)
    size = max(abs(a), abs(b)) if scale is None else scale
    relative = abs(b - a) / size if np.isfinite(a) and np.isfinite(b) else float("inf")
    return Change(name, a, b, unit, b - a, relative, judged and not relative <= rtol)


def _numbers(a: Settings, b: Settings, rtol: float) -> list[Change]:
    """Numbers of the scenes that are not the same; of arrays the entries."""
    rows_a, rows_b = ({row["path"]: row for row in scene["numbers"]} for scene in (a, b))
    changes = []
    for path in dict.fromkeys([*rows_a, *rows_b]):
        unit = (rows_a.get(path) or rows_b[path])["unit"]
        value_a, value_b = (rows[path]["value"] if path in rows else None for rows in (rows_a, rows_b))
        if value_a is None or value_b is None or np.shape(value_a) != np.shape(value_b):
            changes.append(Change(path, value_a, value_b, unit, None, None, True))
            continue
        x, y = np.asarray(value_a, float), np.asarray(value_b, float)
        for place in np.argwhere(x != y):
            index = f"[{','.join(map(str, place))}]" if place.size else ""
            changes.append(_change(path + index, float(x[tuple(place)]), float(y[tuple(place)]), unit, rtol))
    return changes


def _events(a: Dataset, b: Dataset, rtol: float) -> tuple[list[Change], list[str], list[str]]:
    """Events of the same name, lining and count in both, and those that one alone has."""
    times: list[dict[str, float]] = []
    for data in (a, b):
        columns = (data[name].values.tolist() for name in ("event_name", "event_lining", "event_time"))
        times.append(
            {
                name + (f" of lining {lining}" if lining else "") + (f" ({i})" if i > 1 else ""): time
                for (name, lining, i), time in occurrences(zip(*columns, strict=True)).items()
            }
        )

    def alone(own: dict[str, float], other: dict[str, float]) -> list[str]:
        return [f"{name} at {time:.6g} s" for name, time in own.items() if name not in other]

    both = [name for name in times[0] if name in times[1]]
    rows = [_change(name, times[0][name], times[1][name], "s", rtol) for name in both]
    return rows, alone(*times), alone(*times[::-1])


def _single_numbers(data: Dataset) -> dict[str, DataArray]:
    return {str(name): v for name, v in data.data_vars.items() if v.ndim == 0 and name not in _NO_NUMBERS}


def _scalars(a: Dataset, b: Dataset, rtol: float) -> tuple[list[Change], list[Change]]:
    """Metrics, and energies relative to the largest one exchanged."""
    own, other = map(_single_numbers, (a, b))
    units = {name: variable.attrs["units"] for name, variable in (own | other).items()}
    energies = {name for name in units if name.startswith("energy.")}
    in_joules = [name for name in energies if units[name] == "J"]
    largest = max(abs(group[name].item()) for group in (own, other) for name in in_joules if name in group)
    changes: tuple[list[Change], list[Change]] = [], []
    for name in dict.fromkeys([*own, *other]):
        value_a, value_b = (group[name].item() if name in group else None for group in (own, other))
        scale = largest if name in in_joules else 1.0 if name in energies else None  # residuals are relative already
        at_peak = name.startswith(("max_", "peak_")) and name.endswith(("_time", "_lining"))
        change = _change(name, value_a, value_b, units[name], rtol, scale=scale, judged=not at_peak)
        changes[name in energies].append(change)
    return changes


def _series(a: Dataset, b: Dataset, rtol: float) -> tuple[list[SeriesChange], str, bool]:
    """Largest difference of every column, in words at which times, and whether it is judged."""
    keys = [list(zip(d["time"].values.tolist(), d["side"].values.tolist(), strict=True)) for d in (a, b)]
    place = {key: j for j, key in enumerate(keys[1])}
    common = [(i, place[key]) for i, key in enumerate(keys[0]) if key in place]
    exact = 2 * len(common) >= min(len(keys[0]), len(keys[1]))
    if exact:
        i, j = np.asarray(common, int).reshape(-1, 2).T
        times, how = a["time"].values[i], f"at {len(common)} times that both have"
    else:
        t_a, t_b = a["time"].values, b["time"].values
        times = np.union1d(t_a, t_b)
        times = times[(times >= max(t_a[0], t_b[0])) & (times <= min(t_a[-1], t_b[-1]))]
        i = j = np.zeros(0, int)
        how = f"interpolated at {times.size} times (straight lines between the stored ones), not judged"
    if not times.size:
        return [], "not at all: they have no time in common", False
    own, other = _over_time(a), _over_time(b)
    sizes = _sizes(own, other)
    changes = []
    for name in dict.fromkeys([*own, *other]):
        column_a, column_b = own.get(name), other.get(name)
        if (
            column_a is None
            or column_b is None
            or column_a.dims != column_b.dims
            or column_a.shape[1:] != column_b.shape[1:]
        ):
            words = "only in a" if column_b is None else "only in b" if column_a is None else "of another shape"
            unit = (column_b if column_a is None else column_a).attrs["units"]  # pyright: ignore
            changes.append(SeriesChange(name, unit, None, None, None, words, True))
            continue
        x, y = (
            (column_a.values[i], column_b.values[j])
            if exact
            else (_between(column_a, times), _between(column_b, times))
        )
        changes.append(
            _greatest(column_a, np.abs(x - y), times, sizes[column_a.attrs["units"]], rtol if exact else np.inf)
        )
    return changes, how, exact


def _over_time(data: Dataset) -> dict[str, DataArray]:
    """Columns over time; layers of walls are among the nodes."""
    return {
        str(name): v
        for name, v in data.data_vars.items()
        if "time" in v.dims and not str(name).endswith("_layer_temperature")
    }


def _sizes(*groups: dict[str, DataArray]) -> dict[str, float]:
    """Largest magnitude of all columns of one unit; pure numbers count as they are."""
    sizes: dict[str, float] = {"1": 1.0}
    for variable in (v for group in groups for v in group.values()):
        unit = variable.attrs["units"]
        if unit != "1" and variable.size:
            sizes[unit] = max(sizes.get(unit, 0.0), float(np.max(np.abs(variable.values))))
    return sizes


def _between(variable: DataArray, times: Float[np.ndarray, " m"]) -> Float[np.ndarray, "m ..."]:
    """Values at other times: at an instant with two, the one after it; straight lines between neighbours."""
    t, values = variable["time"].values, variable.values.astype(float)
    before = np.searchsorted(t, times, side="right") - 1
    after = np.minimum(before + 1, t.size - 1)
    gap = np.where(t[after] > t[before], t[after] - t[before], 1.0)
    share = ((times - t[before]) / gap).reshape(-1, *(1,) * (values.ndim - 1))
    return values[before] + share * (values[after] - values[before])


def _greatest(
    variable: DataArray, gap: Num[np.ndarray, "m ..."], times: Float[np.ndarray, " m"], size: float, rtol: float
) -> SeriesChange:
    at = np.unravel_index(int(np.argmax(gap)), gap.shape)
    absolute = float(gap[at])
    relative = absolute / size if size > 0 else 0.0
    labels = [f"{dim} {variable[dim].values[k]}" for dim, k in zip(variable.dims[1:], at[1:], strict=True)]
    name, unit = str(variable.name), variable.attrs["units"]
    return SeriesChange(name, unit, absolute, relative, float(times[at[0]]), ", ".join(labels), not relative <= rtol)


def dumps(comparison: Comparison) -> str:
    """A comparison as text of JSON."""
    return json.dumps(comparison.as_dict(), indent=1, allow_nan=False)
