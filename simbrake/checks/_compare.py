"""Two results side by side."""

import collections
import dataclasses
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import input_error
from .._base._numbers import pretty
from .._base._table import Column, Table, plain
from ..results.stored import (
    FORMAT,
    POINTS,
    Dataset,
    Settings,
    Source,
    dataset,
    origin,
    read_result,
)
from ..runs.result import Result

Numbers = Mapping[str, tuple[float, str]]  # value and unit by name

_MOST = 12  # rows of each kind in the text
_UNIT = Column("unit", left=True, show=pretty)
_RELATIVE = Column("relative", show=".2g")
_DIFFERS = Column("differs", hidden=True)
_WORDS = ["name", Column("a", left=True, show=str), Column("b", left=True, show=str)]
_CHANGE = [
    *("name", Column("a", show=".9g"), Column("b", show=".9g"), _UNIT),
    *(Column("absolute", heading="difference", show="+.3g"), _RELATIVE, _DIFFERS),
]
_SERIES = [
    *(
        "name",
        _UNIT,
        Column("absolute", heading="largest difference", show=".3g"),
        _RELATIVE,
    ),
    *(Column("time", "s"), "place", _DIFFERS),
]
#: counts of the solver: names in the provenance, and in a comparison
_COUNTS = {
    "accepted": "steps accepted",
    "rejected": "steps rejected",
    "retaken": "steps retaken",
    "segments": "segments",
}
_NO_NUMBERS = {
    "status",
    "method",
    "rtol",
    "code",
    "steps",
    "rejected",
    "retaken",
    "segments",
}
_LAYERS = "_layer_temperature"
_NEEDED = (
    "time",
    "side",
    "status",
    "event_time",
    "event_name",
    "event_lining",
    "energy.friction_heat",
)


@dataclasses.dataclass(frozen=True, repr=False)
class Comparison:
    """Two results side by side, `a` and `b`, in tables.

    - `scene`: numbers of the scenes that are not the same
    - `parts`: classes, counts and words that are not the same
    - `events` in both, `only_a`, `only_b`
    - `metrics`, `energies` of both: each with the `absolute` difference `b − a`, the
      `relative` one, and whether it `differs`;  `series`: the largest difference of
      each column;  `status`
    - `solver`, `versions`: settings, counts, versions and machine that are not the
      same; they are not judged
    - `how` the series were compared, and whether they are `judged`
    - `equal`: nothing judged differs by more than `rtol`

    Example:
        >>> change = sb.compare(result, sb.simulate(sb.with_values(scene, {"initial.omega": 18.0}))).scene[0]
        >>> change["name"], change["a"], change["b"]
        ('initial.omega', 24.0, 18.0)
    """

    rtol: float
    status: dict[str, str]
    scene: Table
    parts: Table
    events: Table
    only_a: list[str]
    only_b: list[str]
    metrics: Table
    energies: Table
    series: Table
    how: str
    judged: bool
    solver: Table
    versions: Table

    @property
    def equal(self) -> bool:
        """Whether scenes and results are equal within the tolerance."""
        tables = (self.scene, self.events, self.metrics, self.energies, self.series)
        alone = len(self.parts) or self.only_a or self.only_b
        return (
            not alone
            and self.status["a"] == self.status["b"]
            and not any(any(table["differs"]) for table in tables)
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain values of JSON: `null` for what is absent or infinite."""
        return {"equal": self.equal} | plain(self)

    def _lines(self) -> Iterator[str]:
        yield f"{'equal' if self.equal else 'different'}: relative tolerance {self.rtol:g}"
        if self.status["a"] != self.status["b"]:
            yield f"status   {self.status['a']} → {self.status['b']}"
        for title in (
            "parts",
            "scene",
            "only_a",
            "only_b",
            "events",
            "metrics",
            "energies",
            "series",
        ):
            yield from _shown(title.replace("_", " "), getattr(self, title))
        count = f"{len(self.events)} events, {len(self.metrics)} metrics"
        yield f"compared {count}, series {self.how}"
        yield from _shown("solver", self.solver)
        yield from _shown("versions", self.versions)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__


def _shown(title: str, found: Table | list[str]) -> Iterator[str]:
    """The text of the rows that differ, of many the first, single linings last."""
    table = (
        found
        if isinstance(found, Table)
        else Table(["event"], [(name,) for name in found])
    )
    if rows := [row for row in table if row.get("differs", True)]:
        rows.sort(key=lambda row: " of lining " in str(row.get("name")))
        title = title if len(rows) <= _MOST else f"{title}: {_MOST} of {len(rows)}"
        yield str(Table(table.columns, rows[:_MOST], title))


def compare(a: Source, b: Source, /, *, rtol: float = 1e-9) -> Comparison:
    """Compare two results: each a `Result`, a data set of `simbrake.dataset`, or the
    path of a result file.

    Judged against `rtol`: every number of the scenes, event time and metric relative to
    its own size; energies relative to the largest one exchanged; series relative to the
    maximum of their unit, at the times that both have. Two results are evaluated at
    equal times; of data sets that have few in common the series are not compared. Time
    and place of a maximum are not judged (arbitrary on a plateau). Raises `InputError`.

    Example:
        >>> sb.compare(result, result).equal
        True
    """
    if not (np.ndim(rtol) == 0 and 0 <= rtol < 1):  # a NaN is not
        raise input_error("rtol", f"{rtol} is out of range", "0 ≤ rtol < 1")
    left, right = _data(a, b)
    from_a = origin(left)
    from_b = origin(right)
    events = _events(left)
    others = _events(right)
    metrics, energies = _scalars(left, right, rtol)
    series, how, judged = _series(left, right, rtol)
    changes = _changes(_numbers(from_a["scene"]), _numbers(from_b["scene"]), rtol)
    return Comparison(
        rtol=float(rtol),
        status={"a": str(left["status"].item()), "b": str(right["status"].item())},
        scene=Table(_CHANGE, [row for row in changes if row["a"] != row["b"]]),
        parts=_words(from_a["scene"]["parts"], from_b["scene"]["parts"]),
        events=_changes(_shared(events, others), _shared(others, events), rtol),
        only_a=[
            f"{name} at {time:.6g} s"
            for name, (time, _) in events.items()
            if name not in others
        ],
        only_b=[
            f"{name} at {time:.6g} s"
            for name, (time, _) in others.items()
            if name not in events
        ],
        metrics=metrics,
        energies=energies,
        series=series,
        how=how,
        judged=judged,
        solver=_words(_of_solver(from_a), _of_solver(from_b)),
        versions=_words(_of_machine(from_a), _of_machine(from_b)),
    )


def _data(a: Source, b: Source) -> list[Dataset]:
    """The data sets of both; two results are evaluated at the same times."""
    times = None
    if isinstance(a, Result) and isinstance(b, Result) and a.concrete and b.concrete:
        start = max(float(each.record.rows.t[0]) for each in (a, b))
        end = min(float(each.record.t_end) for each in (a, b))
        times = np.linspace(start, end, POINTS) if start < end else None
    datasets = []
    for source in (a, b):
        if isinstance(source, Result):
            datasets.append(dataset(source, times))
            continue
        data = read_result(source) if isinstance(source, str | Path) else source
        if getattr(data, "attrs", {}).get("format") != FORMAT:
            what = f"{type(source).__name__} is not a result"
            raise input_error(
                "compare",
                what,
                "give a Result, its dataset, or the path of a result file",
            )
        if missing := [name for name in _NEEDED if name not in data.variables]:
            raise input_error(
                "compare",
                f"a result is without {', '.join(missing)}",
                "give all of a data set",
            )
        datasets.append(data)
    return datasets


def _shared(own: Numbers, other: Numbers) -> Numbers:
    return {name: number for name, number in own.items() if name in other}


def _of_solver(stored: Settings) -> Settings:
    return stored["settings"] | {
        key: stored["outcome"][name] for name, key in _COUNTS.items()
    }


def _of_machine(stored: Settings) -> Settings:
    return {"simbrake": stored["simbrake"], **stored["versions"], **stored["machine"]}


def _words(a: Settings, b: Settings) -> Table:
    """Entries that are not the same."""
    rows = [
        (name or "scene", a.get(name), b.get(name)) for name in dict.fromkeys([*a, *b])
    ]
    return Table(_WORDS, [row for row in rows if row[1] != row[2]])


def _changes(
    left: Numbers, right: Numbers, rtol: float, sizes: Mapping[str, float] | None = None
) -> Table:
    """Numbers side by side. Equal infinities are equal, and an infinite or absent
    number differs from a finite one.

    `sizes`: what a difference is relative to, by default the larger of the two numbers.
    """
    rows = []
    for name in dict.fromkeys([*left, *right]):
        a, b = (side[name][0] if name in side else None for side in (left, right))
        unit = (left.get(name) or right[name])[1]
        if a is None or b is None:
            rows.append((name, a, b, unit, None, None, True))
        elif a == b:
            rows.append((name, a, b, unit, 0.0, 0.0, False))
        else:
            size = (sizes or {}).get(name) or max(abs(a), abs(b))
            relative = (
                abs(b - a) / size if math.isfinite(a) and math.isfinite(b) else math.inf
            )
            at_peak = name.startswith(("max_", "peak_")) and name.endswith(
                ("_time", "_lining")
            )
            rows.append(
                (name, a, b, unit, b - a, relative, not (at_peak or relative <= rtol))
            )
    return Table(_CHANGE, rows)


def _numbers(scene: Settings) -> Numbers:
    """Numbers of a scene, of arrays each entry."""
    numbers = {}
    for row in scene["numbers"]:
        for place, value in np.ndenumerate(np.asarray(row["value"], float)):
            index = f"[{','.join(map(str, place))}]" if place else ""
            numbers[row["path"] + index] = float(value), row["unit"]
    return numbers


def _events(data: Dataset) -> Numbers:
    """Times of events by name, lining, and which of these it is, from 2 on."""
    times = {}
    count = collections.Counter[str]()
    columns = (
        data[name].values.tolist()
        for name in ("event_name", "event_lining", "event_time")
    )
    for name, lining, time in zip(*columns, strict=True):
        event = name + (f" of lining {lining}" if lining else "")
        count[event] += 1
        times[event + (f" ({count[event]})" if count[event] > 1 else "")] = time, "s"
    return times


def _scalars(left: Dataset, right: Dataset, rtol: float) -> tuple[Table, Table]:
    """Metrics, and energies relative to the largest one exchanged."""

    def single(data: Dataset, energies: bool) -> Numbers:
        return {
            str(name): (array.item(), array.attrs["units"])
            for name, array in data.data_vars.items()
            if array.ndim == 0
            and name not in _NO_NUMBERS
            and str(name).startswith("energy.") == energies
        }

    own = single(left, True)
    other = single(right, True)
    largest = max(
        abs(value) for value, unit in [*own.values(), *other.values()] if unit == "J"
    )
    # (residuals are relative already)
    sizes = {
        name: largest if unit == "J" else 1.0
        for name, (_, unit) in {**own, **other}.items()
    }
    return _changes(single(left, False), single(right, False), rtol), _changes(
        own, other, rtol, sizes
    )


def _series(left: Dataset, right: Dataset, rtol: float) -> tuple[Table, str, bool]:
    """Largest difference of every column over the times and sides that both have; how
    many these are, in words; and whether they are enough to compare."""
    import pandas as pd  # comes with xarray, when a data set is needed

    both = (left, right)
    instants = [
        pd.MultiIndex.from_arrays([data["time"].values, data["side"].values])
        for data in both
    ]
    common = instants[0].intersection(instants[1])
    if not common.size or 2 * common.size < min(map(len, instants)):
        return (
            Table(_SERIES, []),
            f"not compared: {common.size} times that both have",
            False,
        )
    sizes = {"1": 1.0}  # pure numbers count as they are
    columns = []
    for data, own in zip(both, instants, strict=True):
        # (layers of walls are among the nodes)
        names = [
            name
            for name, array in data.data_vars.items()
            if "time" in array.dims and _LAYERS not in str(name)
        ]
        for array in data[names].data_vars.values():
            if (unit := array.attrs["units"]) != "1":
                sizes[unit] = max(
                    sizes.get(unit, 0.0), float(np.max(np.abs(array.values)))
                )
        columns.append(data[names].isel(time=own.get_indexer(common)))
    left, right = columns
    rows = []
    for name in dict.fromkeys(map(str, [*left.data_vars, *right.data_vars])):
        unit = (left if name in left else right)[name].attrs["units"]
        lost = (
            "only in a"
            if name not in right
            else "only in b"
            if name not in left
            else ""
        )
        if lost or left[name].sizes != right[name].sizes:
            rows.append(
                (name, unit, None, None, None, lost or "of another shape", True)
            )
            continue
        gap = np.abs(left[name].values - right[name].values)
        first, *others = np.unravel_index(int(np.argmax(gap)), gap.shape)
        labels = [
            f"{dim} {left[dim].values[k]}"
            for dim, k in zip(left[name].dims[1:], others, strict=True)
        ]
        largest = float(np.max(gap))
        size = sizes[unit]
        relative = largest / size if size > 0 else 0.0
        time = float(left["time"].values[first])
        rows.append(
            (
                name,
                unit,
                largest,
                relative,
                time,
                ", ".join(labels),
                not relative <= rtol,
            )
        )
    return Table(_SERIES, rows), f"at {common.size} times that both have", True
