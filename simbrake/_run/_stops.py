"""The stops of a run, one row each: time, travel, energy, and how hot rim and linings became."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._table import Column, Table, scale
from .._parts._scene import Scene
from .._physics._mechanism import BandMode, Label
from ..hybrid import Record
from ._scan import Scan, peaks_between

#: columns that a scene has if its heat part names the place: heading, by the metric
_HOT = {
    "peak_rim_temperature": "hottest rim",
    "peak_lining_temperature": "hottest linings",
    "peak_band_temperature": "hottest band",
}


def _scaled(name: str, unit: str, meaning: str, heading: str, like: float, count: int) -> Column:
    """A column that is read in the system of units in force; `like`: a typical value (SI)."""
    factor, offset, shown = scale(unit, like, absolute=True)
    return Column(name, unit, meaning, heading, shown, lambda x: f"{x * factor + offset:.{count}g}")


def columns_of(names: Sequence[str], words: Mapping[str, str] | None = None) -> list[Column]:
    """Columns of the table of stops, those of them that are named, in the system of units in force."""
    body = "rim" if words is None else words.get("body", "rim")
    known = [
        Column("stop", "", "number of the stop"),
        Column("time", "s", "time of the stop"),
        Column("motion_time", "s", "time from the restart to the stop", "in motion", show=".5g"),
        Column("braking_time", "s", "time from the last onset of slip or the restart", "braked", show=".5g"),
        Column("angle", "rad", "angle from the restart to the stop", show=".6g"),
        _scaled("travel", "m", "travel of the hook from the restart to the stop", "travel", 1.0, 5),
        _scaled("energy", "J", "friction heat since the stop before", "energy", 1e3, 6),
    ]
    for name, place in _HOT.items():
        heading = place.replace("rim", body)
        known.append(_scaled(name, "K", f"{heading} until the next restart", heading, 300.0, 5))
    return [column for column in known if column.name in names]


class Stop(NamedTuple):
    """Rows of the record: restart, last onset of slip, stop, and where the rest after it ends."""

    start: int
    onset: int
    stop: int
    end: int


def rows_of(labels: Sequence[Label]) -> list[Stop]:
    """The stops in a run with these modes of its rows."""
    found, start, onset = list[Stop](), 0, 0
    for i, (before, now) in enumerate(itertools.pairwise(labels), 1):
        if before.rests and not now.rests:
            found = [*found[:-1], found[-1]._replace(end=i)] if found else found
            start = onset = i
        slack = before.band in (BandMode.OPEN, BandMode.TAKE_UP)
        if slack and now.band not in (BandMode.OPEN, BandMode.TAKE_UP):
            onset = i
        if now.rests and not before.rests and before.band != BandMode.OPEN:
            found.append(Stop(start, onset, i, len(labels) - 1))
    return found


def stops_of(record: Record, scene: Scene, labels: Sequence[Label], scan: Scan) -> Table:
    """The stops of a concrete run."""
    found, states, t = rows_of(labels), record.states, np.asarray(record.rows.t)
    shares = record.system.grip.shares  # pyright: ignore
    hot = 1.0 if shares is None else float(shares.heat)
    work = hot * np.sum([np.asarray(column) for column in states.ledger.friction], axis=0)
    phi = np.asarray(states.phi)
    travelled = scene.duty.load.travelled(phi)
    if states.hook is not None:
        travelled = travelled + np.asarray(states.hook.stretch)
    names = [name for name in _HOT if name in scan.names]
    tops = peaks_between(scan, names, [(stop.start, stop.end) for stop in found])
    rows, before = list[dict[str, Any]](), 0
    for i, stop in enumerate(found):
        angle = float(phi[stop.stop] - phi[stop.start])
        rows.append(
            {
                "stop": i + 1,
                "time": float(t[stop.stop]),
                "motion_time": float(t[stop.stop] - t[stop.start]),
                "braking_time": float(t[stop.stop] - t[stop.onset]),
                "angle": angle,
                **({} if travelled is None else {"travel": float(travelled[stop.stop] - travelled[stop.start])}),  # pyright: ignore
                "energy": float(work[stop.stop] - work[before]),
                **{name: float(tops[name][i]) for name in names},
            }
        )
        before = stop.stop
    always = ["stop", "time", "motion_time", "braking_time", "angle", "energy", *names]
    return Table(columns_of(always if travelled is None else [*always, "travel"], words_of(scene)), rows)


def words_of(scene: Scene) -> dict[str, str]:
    return {} if scene.brake.banded else {"body": scene.brake.words.body}


def stop_variables(table: Table) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """The stops as variables of a data set: dimensions, values, unit and meaning."""
    columns = [column for column in table.columns if column.name != "stop"] if len(table) else []
    return {
        f"stop_{one.name}": (("stop",), np.asarray(table[one.name]), {"units": one.unit, "meaning": one.meaning})
        for one in columns
    }


def stop_table(summary: Mapping[str, Any]) -> Table | None:
    """The stops in a summary, `None` where there are not several."""
    rows = summary.get("stops", [])
    return Table(columns_of(list(rows[0]), summary), rows) if rows else None
