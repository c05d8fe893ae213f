"""What kind of duty a run was, and its stops, one row each: time, travel, energy, how
hot rim and linings became."""

import enum
import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._base._table import Column, JsonObject, Table
from ..hybrid import Record
from ..parts.scene import Scene
from ..phases import Phases
from ..physics.mechanism import BandMode, Label
from ..profiles import AbstractProfile
from .log import Status
from .metrics import HOT, hook_travel_at_end, stretched

#: values that differ by less than this share of them are the same
_SAME = 1e-9


class DutyKind(enum.StrEnum):
    """Kind of a run.

    Example:
        >>> result.summary()["duty"]
        'stop'
    """

    STOP = "stop"
    STOPS = "stops"
    HOLD = "hold"
    DRAG = "drag_lowering"  # the lever follows a speed
    STEADY = "steady_lowering"  # torques on the shaft balance the load
    DRIVEN = "driven"  # by the motor, the brake open
    RUNAWAY = "runaway"
    TURNING = "turning"  # neither stopped nor controlled
    FAILED = "failed"


def speed_is_led(lever: AbstractProfile | Phases) -> bool:
    """Whether one lever holds the speed through the whole run."""
    return lever.controls_speed and not isinstance(lever, Phases)


def duty_of(scene: Scene, status: str, stops: int) -> DutyKind:
    """Kind of a run with this status and number of stops."""
    if status not in list(Status):
        return DutyKind.FAILED
    if status == Status.RUNAWAY:
        return DutyKind.RUNAWAY
    if status == Status.NOT_FOLLOWED:
        return DutyKind.TURNING
    if stops:
        return DutyKind.STOPS if stops > 1 else DutyKind.STOP
    # (dry friction of the shaft may have stopped it)
    if status in (Status.HELD, Status.STOPPED):
        return DutyKind.HOLD
    if status == Status.DRIVEN:
        return DutyKind.DRIVEN
    if status == Status.LOWERING:
        return DutyKind.STEADY
    return DutyKind.DRAG if speed_is_led(scene.duty.lever) else DutyKind.TURNING


def end_of(record: Record, scene: Scene) -> JsonObject:
    """State of a concrete run at its end, in SI: time, angle, speed, travel of a hook
    where there is one."""
    states = record.states
    t = np.asarray(record.rows.t)
    n = int(record.count)
    angle = float(states.phi[n] - states.phi[0])
    travel = hook_travel_at_end(record, scene)
    return {
        "time": float(t[n]),
        "duration": float(t[n] - t[0]),
        "angle": angle,
        "omega": float(states.omega[n]),
        "hook_travel": None if travel is None else float(travel),
    }


def totals(rows: Sequence[JsonObject]) -> JsonObject:
    """Sums over the stops of a summary in SI, of angles and travel in either sense, and
    what of the travel is `upwards`; the worst: `slowest` by its braking, `hottest` by
    its heat."""
    names = ("motion_time", "braking_time", "angle", "travel", "energy")
    sums: JsonObject = {
        name: sum(abs(row[name]) for row in rows) for name in names if name in rows[0]
    }
    sums["upwards"] = sum(max(-row.get("travel", 0.0), 0.0) for row in rows)
    for word, name in (("slowest", "braking_time"), ("hottest", "energy")):
        sums[word] = rows[first_greatest([row[name] for row in rows])]
    return sums


def first_greatest(values: ArrayLike) -> int:
    """Index of the maximum; of values that only the errors of a run keep apart, as
    those of equal cycles, the first."""
    array = np.asarray(values)
    return int(np.argmax(array >= (1 - _SAME) * array.max()))


# --- the stops of a run -------------------------------------------------------------


#: columns that a scene has if its heat part names the place: heading, by the metric
_HOT = {name: f"hottest {place}" for name, place in HOT.items() if place != "outer"}


def stop_table(rows: Sequence[JsonObject], scene: Scene) -> Table:
    """The stops of a run, in the system of units in force."""
    body = "rim" if scene.brake.banded else scene.brake.words.body
    motion = "time from the restart to the stop"
    braked = "time from the last onset of slip or the restart"
    travel = "travel of the hook from the restart to the stop"
    columns = [
        Column("stop", "", "number of the stop"),
        Column("time", "s", "time of the stop"),
        Column("motion_time", "s", motion, "in motion", show=".5g"),
        Column("braking_time", "s", braked, "braked", show=".5g"),
        Column("angle", "rad", "angle from the restart to the stop").scaled(100.0, 6),
        Column("travel", "m", travel).scaled(1.0, 5),
        Column("energy", "J", "friction heat since the stop before").scaled(1e3, 6),
    ]
    for name, place in _HOT.items():
        heading = place.replace("rim", body)
        column = Column(name, "K", f"{heading} until the next restart", heading)
        columns.append(column.scaled(300.0, 5))
    return Table([x for x in columns if not rows or x.name in rows[0]], rows)


class Stop(NamedTuple):
    """Rows of the record: restart, last onset of slip, stop, and where the rest after
    it ends."""

    start: int
    onset: int
    stop: int
    end: int


def rows_of(labels: Sequence[Label], turned: Sequence[bool] | np.ndarray) -> list[Stop]:
    """The stops in a run with these modes of its rows; `turned`: whether a motor has
    moved the pulley since the last one, which the open band then only holds."""
    stops = list[Stop]()
    start = 0
    onset = 0
    for i, (before, now) in enumerate(itertools.pairwise(labels), 1):
        if before.rests and not now.rests:
            stops = [*stops[:-1], stops[-1]._replace(end=i)] if stops else stops
            start = onset = i
        slack = before.band in (BandMode.OPEN, BandMode.TAKE_UP)
        if slack and (now.rests or now.band not in (BandMode.OPEN, BandMode.TAKE_UP)):
            onset = i
        if (
            now.rests
            and not before.rests
            and (before.band != BandMode.OPEN or turned[i])
        ):
            stops.append(Stop(start, onset, i, len(labels) - 1))
    return stops


def stops_of(
    record: Record,
    scene: Scene,
    stops: Sequence[Stop],
    maxima: Mapping[str, np.ndarray],
) -> list[JsonObject]:
    """The stops of a concrete run in SI; `maxima`: by metric, its maximum until the
    restart after each stop."""
    states = record.states
    t = np.asarray(record.rows.t)
    shares = record.system.grip.shares  # pyright: ignore
    hot = 1.0 if shares is None else float(shares.heat)
    work = hot * np.sum(
        [np.asarray(column) for column in states.ledger.friction], axis=0
    )
    phi = np.asarray(states.phi)
    travelled = scene.duty.load.travelled(phi)
    if states.hook is not None:
        travelled = travelled + stretched(record.system, states, record.modes)
    names = [name for name in _HOT if name in maxima]
    rows = list[JsonObject]()
    before = 0
    for i, stop in enumerate(stops):
        row = {
            "stop": i + 1,
            "time": float(t[stop.stop]),
            "motion_time": float(t[stop.stop] - t[stop.start]),
            "braking_time": float(t[stop.stop] - t[stop.onset]),
            "angle": float(phi[stop.stop] - phi[stop.start]),
        }
        if travelled is not None:
            row["travel"] = float(travelled[stop.stop] - travelled[stop.start])  # pyright: ignore
        row["energy"] = float(work[stop.stop] - work[before])
        rows.append(row | {name: float(maxima[name][i]) for name in names})
        before = stop.stop
    return rows


def stop_variables(
    table: Table,
) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """The stops as variables of a data set: dimensions, values, unit and meaning."""
    columns = table.columns[1:] if len(table) else ()
    return {
        f"stop_{column.name}": (
            ("stop",),
            np.asarray(table[column.name]),
            {"units": column.unit, "meaning": column.meaning},
        )
        for column in columns
    }
