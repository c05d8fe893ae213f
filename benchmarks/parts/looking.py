"""What a look at a result takes, beside the run that made it: printed, its metrics, its events; many events."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import simbrake as sb
from benchmarks.parts.again import largest_difference
from benchmarks.parts.processes import ROOT
from benchmarks.parts.table import Column, Part, Target
from benchmarks.scenes import cycles_case

NAME = "looking"
TITLE = "looking at a result, in the time of its run"
_SCENARIOS = ("u2_5_5_stop.toml", "drag_lowering.py", "tripping_30_stands.py", "everything_coupled.py")
_LOOKS: dict[str, Callable[[sb.Result], Any]] = {
    "print(result)": str,
    ".metrics": lambda result: result.metrics,
    ".events": lambda result: result.events,
}
#: processor seconds that any look may take, and the share of the run's own beyond them
_FIXED, _SHARE = 0.05, 0.2
#: cycles of scene (f): about 10,000 and 30,000 events; limit of the growth of the time with their number, as a power
_CYCLES, _FEW, _POWER = (220, 660), (22, 66), 1.1
_TIGHT = 1e-12

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("events", "events", ",.0f"),
    Column("run", "run, CPU ms", ".2f", 1e3),
    Column("first", "first look, CPU ms", ".1f", 1e3),
    Column("cpu", "look, CPU ms", ".1f", 1e3),
    Column("share", "beyond 50 ms, in runs", ".2f"),
)


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of a call, and what it gives."""
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def events_of(result: sb.Result) -> tuple[list[str], list[float]]:
    """Names and times of all events."""
    return [event.name for event in result.events], [float(event.time) for event in result.events]


def looks(name: str, rounds: int) -> list[dict[str, Any]]:
    """Rows of one scene: every look at a result that was not looked at before."""
    scene = sb.files.open_scene(ROOT / "scenarios" / name)

    def run(rtol: float = 1e-10) -> sb.Result:
        return sb.simulate(scene, rtol=rtol)

    first = {what: timed(lambda look=look: look(run()))[0] for what, look in _LOOKS.items()}
    runs, cpu = [], {what: [] for what in _LOOKS}
    for _ in range(rounds):
        for what, look in _LOOKS.items():
            seconds, result = timed(run)
            runs.append(seconds)
            cpu[what].append(timed(lambda look=look, result=result: look(result))[0])
    own, result = float(np.median(runs)), run()
    wrong = largest_difference(events_of(result), events_of(run(_TIGHT)))
    rows = []
    for what, times in cpu.items():
        seconds = float(np.median(times))
        row = {"what": f"{name}, {what}", "error": wrong, "events": len(result.events), "run": own, "cpu": seconds}
        rows.append(row | {"first": first[what], "share": max(0.0, seconds - _FIXED) / own})
    return rows


def growth(cycles: tuple[int, ...], rounds: int) -> list[dict[str, Any]]:
    """Rows of scene (f) with so many cycles: its events."""
    rows = []
    for count in cycles:
        scene = cycles_case(count).simbrake()

        def run(rtol: float = 1e-10, scene: sb.Scene = scene) -> sb.Result:
            return sb.simulate(scene, rtol=rtol, max_events=1_000_000)

        first = timed(lambda run=run: run().events)[0]
        pairs = []
        for _ in range(rounds):
            seconds, result = timed(run)
            pairs.append((seconds, timed(lambda result=result: result.events)[0]))
        own, cpu = np.median(pairs, axis=0)
        wrong = largest_difference(events_of(result), events_of(run(_TIGHT)))
        row = {
            "error": wrong,
            "what": f"(f), {count} cycles, .events",
            "events": len(result.events),
            "run": own,
            "cpu": cpu,
        }
        rows.append(row | {"first": first, "share": max(0.0, cpu - _FIXED) / own})
    return rows


def measure(quick: bool) -> Part:
    """All scenes; `quick`: the short one, and few events."""
    names, rounds = (_SCENARIOS[:1], 1) if quick else (_SCENARIOS, 3)
    rows = [row for name in names for row in looks(name, rounds)]
    targets = [Target(f"{row['what']}, beyond 50 ms in runs", _SHARE, row["share"], error=row["error"]) for row in rows]
    few, many = grown = growth(_FEW if quick else _CYCLES, rounds)
    power = float(np.log(many["cpu"] / few["cpu"]) / np.log(many["events"] / few["events"]))
    what = f".events of {few['events']:,} and {many['events']:,}, power of their number"
    targets.append(Target(what, _POWER, power, error=many["error"]))
    notes = [
        "look: warm, at a result that nothing was asked of before; run: warm `simulate`; medians; first look: with what"
        " it compiles",
        f"error: largest relative one of an event's time, against a run at rtol {_TIGHT:.0e}",
    ]
    return Part(NAME, TITLE, COLUMNS, [*rows, *grown], targets, notes)
