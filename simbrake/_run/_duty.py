"""What kind of duty a run was: it decides which numbers of it are worth reading."""

import enum
from collections import Counter

import numpy as np

from .._base._table import number
from .._parts._scene import Scene
from .._phases import Phases
from ..hybrid import Record
from ._log import Status
from ._probe import Entry


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
    RUNAWAY = "runaway"
    TURNING = "turning"  # neither stopped nor led
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
    if stops:
        return DutyKind.STOPS if stops > 1 else DutyKind.STOP
    if status in (Status.HELD, Status.STOPPED):  # (dry friction of the shaft may have stopped it)
        return DutyKind.HOLD
    if status == Status.LOWERING:
        return DutyKind.STEADY
    return DutyKind.DRAG if speed_is_led(scene) else DutyKind.TURNING


def end_of(record: Record, scene: Scene) -> Entry:
    """What a concrete run has come to at its end, in SI: time, angle, speed, travel of a hook where there is one."""
    states, t, n = record.states, np.asarray(record.rows.t), int(record.count)
    angle = float(states.phi[n] - states.phi[0])
    return {
        "time": float(t[n]),
        "duration": float(t[n] - t[0]),
        "angle": angle,
        "omega": float(states.omega[n]),
        "hook_travel": scene.duty.load.travelled(angle),
    }


def counted(events: list[Entry]) -> str:
    """How many events there are of each name, in the order of the first ones."""
    counts = Counter(event["name"] for event in events)
    return ", ".join(f"{count} × {name.replace('_', ' ')}" for name, count in counts.items())


def duty_lines(summary: Entry) -> list[str]:
    """The lines of a summary that its kind of duty needs, beside onset and stop of a single one."""
    end, kind = summary["end"], summary["duty"]
    where = f"{number(end['angle'], 'rad')}"
    where += "" if end["hook_travel"] is None else f", hook travel {number(end['hook_travel'], 'm')}"
    match kind:
        case DutyKind.STOPS:
            return _stops_lines(summary)
        case DutyKind.HOLD:
            return _held_lines(summary)
        case DutyKind.DRAG | DutyKind.STEADY:
            return [f"lowered  {where} in {number(end['duration'], 's')}", *_speed_lines(summary)]
        case DutyKind.RUNAWAY | DutyKind.TURNING | DutyKind.FAILED:
            until = f"until {number(end['time'], 's')}"
            return [f"end      {until}: {where}, turning at {number(end['omega'], 'rad/s')}"]
    return []


def _stops_lines(summary: Entry) -> list[str]:
    """Totals of all stops, and the worst of them."""
    rows, end = summary["stops"], summary["end"]

    def total(name: str) -> float:
        return sum(row[name] for row in rows)

    travel = f", hook travel {number(total('travel'), 'm')}" if "travel" in rows[0] else ""
    slowest, hottest = (max(rows, key=lambda row, name=name: row[name]) for name in ("braking_time", "energy"))
    lines = [
        f"total    {len(rows)} stops in {number(end['duration'], 's')}: in motion {number(total('motion_time'), 's')}, "
        f"braked {number(total('braking_time'), 's')}, {number(total('angle'), 'rad')}{travel}",
        f"worst    longest braking {number(slowest['braking_time'], 's')} in stop {slowest['stop']}, "
        f"maximum friction heat {number(hottest['energy'], 'J')} in stop {hottest['stop']}",
    ]
    return lines


def _held_lines(summary: Entry) -> list[str]:
    held, duration = summary.get("holding"), number(summary["end"]["duration"], "s")
    if held is None:
        return [f"held     without load for {duration}"]
    load, capacity = (number(held[name], "N*m") for name in ("load_torque", "capacity"))
    return [f"held     load torque {load} under a static capacity of at least {capacity}, for {duration}"]


def _speed_lines(summary: Entry) -> list[str]:
    """Power and speed of a lowering, and how much of the lever's tension holds the speed."""
    end, pull, terminal = summary["end"], summary.get("pull"), summary["metrics"].get("terminal_speed")
    power, speed = (
        summary["energy"]["load_work"] / end["duration"],
        f"speed    {number(end['omega'], 'rad/s')} at the end",
    )
    speed += "" if terminal is None else f", terminal speed {number(terminal, 'rad/s')}"
    speed += f"; mean power of the load {number(power, 'W')}"
    if pull is None:
        return [speed]
    most = number(pull["limit"], "N")
    return [speed, f"lever    at most {number(pull['value'], 'N')} of {most} at {number(pull['time'], 's')}"]
