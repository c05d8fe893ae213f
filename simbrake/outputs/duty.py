"""What kind of duty a run was, and its stops, one row each: time, travel, energy, how
hot rim and linings became."""

import enum
import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._table import Column, Table, number
from ..hybrid import Record
from ..parts.scene import Scene
from ..phases import Phases
from ..physics.mechanism import BandMode, Label
from .log import Status
from .metrics import HOT, hook_travel_at_end, stretched
from .probe import Entry

#: angles that differ by less than this share of them are the same
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


def speed_is_led(scene: Scene) -> bool:
    """Whether one lever holds the speed through the whole run."""
    lever = scene.duty.lever
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
    return DutyKind.DRAG if speed_is_led(scene) else DutyKind.TURNING


def end_of(record: Record, scene: Scene) -> Entry:
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


def counted(events: list[Entry]) -> str:
    """Number of events of each name, in the order of the first ones."""
    counts = Counter(event["name"] for event in events)
    return ", ".join(
        f"{count} × {name.replace('_', ' ')}" for name, count in counts.items()
    )


def totals(rows: Sequence[Entry]) -> Entry:
    """Sums over the stops of a summary in SI, of angles and travel in either sense, and
    what of the travel is `upwards`; the worst: `slowest` by its braking, `hottest` by
    its heat."""
    names = ("motion_time", "braking_time", "angle", "travel", "energy")
    sums: Entry = {
        name: sum(abs(row[name]) for row in rows) for name in names if name in rows[0]
    }
    sums["upwards"] = sum(max(-row.get("travel", 0.0), 0.0) for row in rows)
    sums["slowest"] = max(rows, key=lambda row: row["braking_time"])
    return sums | {"hottest": max(rows, key=lambda row: row["energy"])}


def stops_words(rows: Sequence[Entry]) -> str:
    """How many stops there are, and how many of them end a hoist."""
    hoists = sum(row.get("travel", 0.0) < 0 for row in rows)
    return f"{len(rows)} stops" + (
        f", {hoists} of them after hoisting" if hoists else ""
    )


def travel_words(sums: Entry) -> str:
    """Travel of the hook in all stops, down and up where there is both."""
    whole = sums["travel"]
    upwards = sums["upwards"]
    up = number(upwards, "m", count=5)
    down = number(whole - upwards, "m", count=5)
    if upwards == whole > 0:
        return f"{up} up"
    return f"{down} down and {up} up" if upwards > 0 else str(number(whole, "m"))


def duty_lines(summary: Entry) -> Iterator[str]:
    """Lines of a summary for its kind of duty, beside onset and stop of a single
    one."""
    end = summary["end"]
    kind = summary["duty"]
    metrics = summary["metrics"]
    duration = number(end["duration"], "s")
    speed = number(end["omega"], "rad/s")
    where = f"{number(end['angle'], 'rad')}"
    where += (
        ""
        if end["hook_travel"] is None
        else f", hook travel {number(end['hook_travel'], 'm')}"
    )
    match kind:
        case DutyKind.STOP | DutyKind.STOPS:
            angle = metrics["stopping_angle"]
            if kind == DutyKind.STOPS:
                rows = summary["stops"]
                sums = totals(rows)
                angle = sums["angle"]
                slowest = sums["slowest"]
                hottest = sums["hottest"]
                travel = (
                    f", hook travel {travel_words(sums)}" if "travel" in sums else ""
                )
                yield (
                    f"total    {stops_words(rows)} in {duration}: in motion "
                    f"{number(sums['motion_time'], 's')}, "
                    f"braked {number(sums['braking_time'], 's')}, {number(angle, 'rad')}{travel}"
                )
                if slowest["braking_time"]:
                    yield (
                        "worst    longest braking "
                        f"{number(slowest['braking_time'], 's')} in stop {slowest['stop']}, "
                        f"maximum friction heat {number(hottest['energy'], 'J')} in "
                        f"stop {hottest['stop']}"
                    )
            if abs(abs(end["angle"]) - abs(angle)) > _SAME * abs(
                angle
            ):  # energies are those of the whole run
                back = abs(end["angle"]) <= _SAME * abs(angle)
                yield (
                    "run      "
                    f"{'back where it began' if back else f'{where} in all'}, at the end "
                    f"turning at {speed}"
                )
        case DutyKind.HOLD if (held := summary.get("holding")) is None:
            yield f"held     without load for {duration}"
        case DutyKind.HOLD:
            load, capacity = (
                number(held[name], "N*m") for name in ("load_torque", "capacity")
            )
            yield (
                f"held     load torque {load} under a static capacity of at least "
                f"{capacity}, for {duration}"
            )
        case DutyKind.DRAG | DutyKind.STEADY:
            yield f"lowered  {where} in {duration}"
            pull = summary.get("pull")
            terminal = metrics.get("terminal_speed")
            tends = (
                ""
                if terminal is None
                else f", terminal speed {number(terminal, 'rad/s')}"
            )
            power = number(summary["energy"]["load_work"] / end["duration"], "W")
            yield f"speed    {speed} at the end{tends}; mean power of the load {power}"
            if pull is not None:
                value = number(pull["value"], "N")
                most = number(pull["limit"], "N")
                each = (
                    f" on each of {summary['rims']} rims" if "rims" in summary else ""
                )
                yield f"lever    at most {value} of {most}{each} at {number(pull['time'], 's')}"
        case DutyKind.DRIVEN:
            power = number(summary["energy"]["motor_work"] / end["duration"], "W")
            yield (
                f"driven   {where} in {duration}; at the end turning at {speed}, "
                f"mean power of the motor {power}"
            )
        case _:
            yield f"end      until {number(end['time'], 's')}: {where}, turning at {speed}"


# --- the stops of a run -------------------------------------------------------------


#: columns that a scene has if its heat part names the place: heading, by the metric
_HOT = {name: f"hottest {place}" for name, place in HOT.items() if place != "outer"}


def columns_of(
    names: Sequence[str], words: Mapping[str, str] | None = None
) -> list[Column]:
    """The named columns of the table of stops, in the system of units in force."""
    body = "rim" if words is None else words.get("body", "rim")
    columns = [
        Column("stop", "", "number of the stop"),
        Column("time", "s", "time of the stop"),
        Column(
            "motion_time",
            "s",
            "time from the restart to the stop",
            "in motion",
            show=".5g",
        ),
        Column(
            "braking_time",
            "s",
            "time from the last onset of slip or the restart",
            "braked",
            show=".5g",
        ),
        Column("angle", "rad", "angle from the restart to the stop", show=".6g"),
        Column("travel", "m", "travel of the hook from the restart to the stop").scaled(
            1.0, 5
        ),
        Column("energy", "J", "friction heat since the stop before").scaled(1e3, 6),
    ]
    for name, place in _HOT.items():
        heading = place.replace("rim", body)
        columns.append(
            Column(name, "K", f"{heading} until the next restart", heading).scaled(
                300.0, 5
            )
        )
    return [column for column in columns if column.name in names]


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
) -> Table:
    """The stops of a concrete run; `maxima`: by metric, its maximum until the restart
    after each stop."""
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
    rows = list[dict[str, Any]]()
    before = 0
    for i, stop in enumerate(stops):
        angle = float(phi[stop.stop] - phi[stop.start])
        rows.append(
            {
                "stop": i + 1,
                "time": float(t[stop.stop]),
                "motion_time": float(t[stop.stop] - t[stop.start]),
                "braking_time": float(t[stop.stop] - t[stop.onset]),
                "angle": angle,
                **(
                    {}
                    if travelled is None
                    else {"travel": float(travelled[stop.stop] - travelled[stop.start])}
                ),  # pyright: ignore
                "energy": float(work[stop.stop] - work[before]),
                **{name: float(maxima[name][i]) for name in names},
            }
        )
        before = stop.stop
    always = ["stop", "time", "motion_time", "braking_time", "angle", "energy", *names]
    return Table(
        columns_of(
            always if travelled is None else [*always, "travel"], words_of(scene)
        ),
        rows,
    )


def words_of(scene: Scene) -> dict[str, str]:
    return {} if scene.brake.banded else {"body": scene.brake.words.body}


def stop_variables(
    table: Table,
) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """The stops as variables of a data set: dimensions, values, unit and meaning."""
    columns = (
        [column for column in table.columns if column.name != "stop"]
        if len(table)
        else []
    )
    return {
        f"stop_{column.name}": (
            ("stop",),
            np.asarray(table[column.name]),
            {"units": column.unit, "meaning": column.meaning},
        )
        for column in columns
    }


def stop_table(summary: Mapping[str, Any]) -> Table | None:
    """The stops in a summary, `None` where there are not several."""
    rows = summary.get("stops", [])
    return Table(columns_of(list(rows[0]), summary), rows) if rows else None
