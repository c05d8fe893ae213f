"""Two results side by side: what of the scenes differs, and what moved."""

import dataclasses
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._run._result import Result
from ._dataset import FORMAT, POINTS, dataset, load
from ._rerun import origin

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
    """Greatest difference of one column: `relative` to the greatest value of its unit; when (s) and at which label."""

    name: str
    unit: str
    absolute: float | None
    relative: float | None
    time: float | None
    place: str
    differs: bool


class Word(NamedTuple):
    """Something that is not a number in both results."""

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
        """Whether scenes and results are the same within the tolerance."""
        rows = [*self.scene, *self.events, *self.metrics, *self.energies, *self.series]
        alone = self.parts or self.only_a or self.only_b
        return not alone and self.status.a == self.status.b and not any(row.differs for row in rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain values of JSON: `null` for what is absent or infinite."""
        found: dict[str, Any] = {"equal": self.equal}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, list):
                value = [
                    row if isinstance(row, str) else {k: _plain(v) for k, v in row._asdict().items()} for row in value
                ]
            elif isinstance(value, Word):
                value = {"a": value.a, "b": value.b}
            found[field.name] = value
        return found

    def __str__(self) -> str:
        lines = [f"{'equal' if self.equal else 'different'}: relative tolerance {self.rtol:g}"]
        if self.status.a != self.status.b:
            lines.append(f"status   {self.status.a} → {self.status.b}")
        lines += _block("parts", (f"{w.name}  {_word(w.a)} → {_word(w.b)}" for w in self.parts))
        lines += _block("scene", map(_row, self.scene))
        lines += _block("only a", self.only_a) + _block("only b", self.only_b)
        moved = [row for row in self.events if row.differs]
        lines += _block("events", map(_row, sorted(moved, key=lambda row: " of lining " in row.name)))
        for name in ("metrics", "energies"):
            lines += _block(name, (_row(row) for row in getattr(self, name) if row.differs))
        rows = [row for row in self.series if row.differs or (not self.judged and row.absolute)]
        rows.sort(key=lambda row: -(math.inf if row.relative is None else row.relative))
        lines += _block("series", map(_series_row, rows))
        lines.append(f"compared {_count(self.events, 'event')}, {_count(self.metrics, 'metric')}, series {self.how}")
        for name in ("solver", "versions"):
            lines += _block(name, (f"{w.name}  {_word(w.a)} → {_word(w.b)}" for w in getattr(self, name)))
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def _plain(x: Any) -> Any:
    return None if isinstance(x, float) and not math.isfinite(x) else x


def _count(rows: list[Any], name: str) -> str:
    return f"{len(rows)} {name}{'' if len(rows) == 1 else 's'}"


def _block(name: str, rows: Iterable[str]) -> list[str]:
    """Lines of one kind, the first with its name."""
    texts = list(rows)
    if len(texts) > _SHOWN:
        texts[_SHOWN:] = [f"… and {len(texts) - _SHOWN} more"]
    return [f"{name if i == 0 else '':9}{text}" for i, text in enumerate(texts)]


def _word(x: Any) -> str:
    return "—" if x is None else str(x)


def _number(x: Any) -> str:
    if x is None:
        return "—"
    return f"{len(x)} entries" if isinstance(x, list) else f"{x:.9g}"


def _row(row: Change) -> str:
    unit = f" {row.unit}" if row.unit not in ("", "1") else ""
    text = f"{row.name}  {_number(row.a)} → {_number(row.b)}{unit}"
    if row.absolute is None or not math.isfinite(row.absolute):
        return text
    share = "" if row.relative is None else f", relative {row.relative:.2g}"
    return f"{text}  ({row.absolute:+.3g}{unit}{share})"


def _series_row(row: SeriesChange) -> str:
    if row.absolute is None:
        return f"{row.name}  {row.place}"
    unit = f" {row.unit}" if row.unit not in ("", "1") else ""
    place = f", {row.place}" if row.place else ""
    return f"{row.name}  by at most {row.absolute:.3g}{unit}, relative {row.relative:.2g}, at {row.time:.6g} s{place}"


# --- the comparison ---------------------------------------------------------------------------------------------------

_NEEDED = ("time", "side", "status", "event_time", "event_name", "event_lining", "energy.friction_heat")


def compare(a: Any, b: Any, rtol: float = 1e-9) -> Comparison:
    """Compares two results: each a `Result`, a data set of `simbrake.dataset`, or the path of a result file.

    Judged against `rtol`: every number of the scenes, event time and metric relative to its own size; energies relative
    to the largest one exchanged; series relative to the greatest value of their unit, at the times that both have.
    Where they hardly have times in common, series are interpolated and shown, but not judged. When and where a
    greatest value occurs is not judged either (on a plateau it means nothing). Raises `InputError`.
    """
    if not (np.ndim(rtol) == 0 and 0 <= rtol < 1):  # written so that a NaN is a fault
        raise InputError([Fault("rtol", f"{rtol} is out of range", "0 ≤ rtol < 1")])
    left, right = _data(a, b)
    from_a, from_b = origin(left), origin(right)
    events, only_a, only_b = _events(left, right, rtol)
    series, how, judged = _series(left, right, rtol)
    return Comparison(
        rtol=float(rtol),
        status=Word("status", str(left["status"].item()), str(right["status"].item())),
        scene=_numbers(from_a["scene"], from_b["scene"], rtol),
        parts=_words(from_a["scene"]["parts"], from_b["scene"]["parts"]),
        events=events,
        only_a=only_a,
        only_b=only_b,
        metrics=_metrics(left, right, rtol),
        energies=_energies(left, right, rtol),
        series=series,
        how=how,
        judged=judged,
        solver=_words(*(one["settings"] | _counts(one["outcome"]) for one in (from_a, from_b))),
        versions=_words(*({"simbrake": s["simbrake"], **s["versions"], **s["machine"]} for s in (from_a, from_b))),
    )


def _data(a: Any, b: Any) -> list[Any]:
    """The data sets of both; two results are looked at at the same times."""
    times = None
    if isinstance(a, Result) and isinstance(b, Result) and a.concrete and b.concrete:
        start, end = (
            pick(float(x) for x in ends)
            for pick, ends in ((max, [r.record.rows.t[0] for r in (a, b)]), (min, [r.record.t_end for r in (a, b)]))
        )
        times = np.linspace(start, end, POINTS) if start < end else None
    found = []
    for source in (a, b):
        if isinstance(source, Result):
            found.append(dataset(source, times))
            continue
        data = load(source) if isinstance(source, str | Path) else source
        if getattr(data, "attrs", {}).get("format") != FORMAT:
            what = f"{type(source).__name__} is no result"
            raise InputError([Fault("compare", what, "give a Result, its dataset, or the path of a result file")])
        if missing := [name for name in _NEEDED if name not in data.variables]:
            raise InputError([Fault("compare", f"a result is without {', '.join(missing)}", "give all of a data set")])
        found.append(data)
    return found


def _counts(outcome: dict[str, Any]) -> dict[str, int]:
    names = ("accepted", "rejected", "retaken", "segments")
    return {f"steps {name}" if name != "segments" else name: outcome[name] for name in names}


def _words(a: dict[str, Any], b: dict[str, Any]) -> list[Word]:
    """Entries that are not the same."""
    names = dict.fromkeys([*a, *b])
    return [Word(name or "scene", a.get(name), b.get(name)) for name in names if a.get(name) != b.get(name)]


def _change(
    name: str, a: Any, b: Any, unit: str, rtol: float, scale: float | None = None, judged: bool = True
) -> Change:
    """Two numbers side by side; equal infinities are equal, and an infinite one differs from a finite one."""
    if a == b:
        return Change(name, a, b, unit, 0.0, 0.0, False)
    size = max(abs(a), abs(b)) if scale is None else scale
    finite = np.isfinite(a) and np.isfinite(b)
    relative = abs(b - a) / size if finite and size > 0 else float("inf")
    return Change(name, a, b, unit, b - a, relative, judged and not relative <= rtol)


def _numbers(a: dict[str, Any], b: dict[str, Any], rtol: float) -> list[Change]:
    """Numbers of the scenes that are not the same; of arrays the entries."""
    rows_a, rows_b = ({row["path"]: row for row in one["numbers"]} for one in (a, b))
    found = []
    for path in dict.fromkeys([*rows_a, *rows_b]):
        one, two = rows_a.get(path), rows_b.get(path)
        unit = (one or two)["unit"]  # pyright: ignore
        if one is None or two is None or np.shape(one["value"]) != np.shape(two["value"]):
            found.append(Change(path, one and one["value"], two and two["value"], unit, None, None, True))
            continue
        x, y = np.asarray(one["value"], float), np.asarray(two["value"], float)
        for place in np.argwhere(x != y):
            index = f"[{','.join(map(str, place))}]" if place.size else ""
            found.append(_change(path + index, float(x[tuple(place)]), float(y[tuple(place)]), unit, rtol))
    return found


def _events(a: Any, b: Any, rtol: float) -> tuple[list[Change], list[str], list[str]]:
    """Events of the same name, lining and count in both, and those that one alone has."""
    times: list[dict[str, float]] = []
    for data in (a, b):
        seen: dict[str, int] = {}
        own: dict[str, float] = {}
        rows = zip(data["event_name"].values, data["event_lining"].values, data["event_time"].values, strict=True)
        for name, lining, time in rows:
            key = f"{name} of lining {lining}" if lining else str(name)
            seen[key] = seen.get(key, 0) + 1
            own[key if seen[key] == 1 else f"{key} ({seen[key]})"] = float(time)
        times.append(own)
    both = [name for name in times[0] if name in times[1]]

    def alone(own: dict[str, float], other: dict[str, float]) -> list[str]:
        return [f"{name} at {time:.6g} s" for name, time in own.items() if name not in other]

    rows = [_change(name, times[0][name], times[1][name], "s", rtol) for name in both]
    return rows, alone(*times), alone(*times[::-1])


def _scalars(data: Any) -> dict[str, Any]:
    skipped = {"status", "method", "rtol", "code", "steps", "rejected", "retaken", "segments"}
    return {str(name): v for name, v in data.data_vars.items() if v.ndim == 0 and name not in skipped}


def _lonely(name: str, own: dict[str, Any], other: dict[str, Any], unit: str) -> Change:
    """A number that only one of the two has."""
    one, two = (float(group[name]) if name in group else None for group in (own, other))
    return Change(name, one, two, unit, None, None, True)


def _metrics(a: Any, b: Any, rtol: float) -> list[Change]:
    found = []
    own, other = _scalars(a), _scalars(b)
    for name in (name for name in dict.fromkeys([*own, *other]) if not name.startswith("energy.")):
        unit = (own if name in own else other)[name].attrs["units"]
        if name not in own or name not in other:
            found.append(_lonely(name, own, other, unit))
            continue
        at_peak = name.startswith(("max_", "peak_")) and name.endswith(("_time", "_lining"))
        found.append(_change(name, own[name].item(), other[name].item(), unit, rtol, judged=not at_peak))
    return found


def _energies(a: Any, b: Any, rtol: float) -> list[Change]:
    own, other = ({k: v for k, v in _scalars(d).items() if k.startswith("energy.")} for d in (a, b))
    largest = max(abs(float(v)) for one in (own, other) for v in one.values() if v.attrs["units"] == "J")
    found = []
    for name in dict.fromkeys([*own, *other]):
        unit = (own if name in own else other)[name].attrs["units"]
        if name not in own or name not in other:
            found.append(_lonely(name, own, other, unit))
        else:  # closures are shares already
            scale = largest if unit == "J" else 1.0
            found.append(_change(name, float(own[name]), float(other[name]), unit, rtol, scale))
    return found


def _series(a: Any, b: Any, rtol: float) -> tuple[list[SeriesChange], str, bool]:
    """Greatest difference of every column, in words at which times, and whether it is judged."""
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
    found = []
    for name in dict.fromkeys([*own, *other]):
        one, two = own.get(name), other.get(name)
        if one is None or two is None or one.dims != two.dims or one.shape[1:] != two.shape[1:]:
            words = "only in a" if two is None else "only in b" if one is None else "of another shape"
            unit = (two if one is None else one).attrs["units"]  # pyright: ignore
            found.append(SeriesChange(name, unit, None, None, None, words, True))
            continue
        x, y = (one.values[i], two.values[j]) if exact else (_between(one, times), _between(two, times))
        found.append(_greatest(one, np.abs(x - y), times, sizes[one.attrs["units"]], rtol if exact else np.inf))
    return found, how, exact


def _over_time(data: Any) -> dict[str, Any]:
    """Columns over time; layers of walls are nodes as well and stand there."""
    return {
        str(name): v
        for name, v in data.data_vars.items()
        if "time" in v.dims and not name.endswith("_layer_temperature")
    }


def _sizes(*groups: dict[str, Any]) -> dict[str, float]:
    """Greatest magnitude of all columns of one unit; pure numbers count as they are."""
    found: dict[str, float] = {"1": 1.0}
    for variable in (v for group in groups for v in group.values()):
        unit = variable.attrs["units"]
        if unit != "1" and variable.size:
            found[unit] = max(found.get(unit, 0.0), float(np.max(np.abs(variable.values))))
    return found


def _between(variable: Any, times: np.ndarray) -> np.ndarray:
    """Values at other times: at an instant with two, the one after it; straight lines between neighbours."""
    t, values = variable["time"].values, variable.values.astype(float)
    before = np.searchsorted(t, times, side="right") - 1
    after = np.minimum(before + 1, t.size - 1)
    gap = np.where(t[after] > t[before], t[after] - t[before], 1.0)
    share = ((times - t[before]) / gap).reshape(-1, *(1,) * (values.ndim - 1))
    return values[before] + share * (values[after] - values[before])


def _greatest(variable: Any, gap: np.ndarray, times: np.ndarray, size: float, rtol: float) -> SeriesChange:
    at = np.unravel_index(int(np.argmax(gap)), gap.shape)
    absolute = float(gap[at])
    relative = absolute / size if size > 0 else 0.0
    labels = [f"{dim} {variable[dim].values[k]}" for dim, k in zip(variable.dims[1:], at[1:], strict=True)]
    name, unit = str(variable.name), variable.attrs["units"]
    return SeriesChange(name, unit, absolute, relative, float(times[at[0]]), ", ".join(labels), not relative <= rtol)


def dumps(comparison: Comparison) -> str:
    """A comparison as text of JSON."""
    return json.dumps(comparison.as_dict(), indent=1, allow_nan=False)
