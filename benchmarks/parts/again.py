"""`simbrake run` in fresh processes: cold, again, and when it is given something wrong; in imports of JAX."""

import json
import math
import pathlib
import tempfile
from typing import Any

from benchmarks.parts.processes import ROOT, Rounds, cache_folder, fresh
from benchmarks.parts.table import Column, Part, Target

NAME = "again"
TITLE = "`simbrake run` in a fresh process, beyond its integration, in imports of JAX"
#: limits of a cold process; of one that finds what it kept
_COLD = {
    "u2_5_5_stop.toml": 4.0,
    "drag_lowering.py": 10.0,
    "tripping_30_stands.py": 15.0,
    "everything_coupled.py": 16.0,
}
_AGAIN, _COMMAND, _SCENE = 2.5, 0.5, 1.5
_TIGHT = "1e-12"

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("cpu", "CPU s", ".2f"),
    Column("whole", "in units", ".2f"),
    Column("integration", "integration, CPU s", ".4f"),
    Column("ratio", "beyond it, in units", ".2f"),
)

#: a prepared run is compiled with all optimisation, whatever the first tier does
_WARM = """
import sys, time
import simbrake as sb
run = sb.prepare(sb.files.open_scene(sys.argv[1]), ["energy.friction_heat"])
run()
found = []
while len(found) < 3 or (sum(found) < 0.2 and len(found) < 50):
    start = time.process_time()
    run()
    found.append(time.process_time() - start)
print(sorted(found)[len(found) // 2])
"""


def command(*arguments: str) -> list[str]:
    """Arguments for Python of a command line of simbrake."""
    return ["-m", "simbrake", *arguments]


def integration(scenario: str, cache: str) -> float:
    """Processor time of the warm, optimised integration, measured in a separate process."""
    return float(fresh(["-c", _WARM, scenario], cache).out.split()[-1])


Events = tuple[list[str], list[float]]


def largest_difference(found: Events, truth: Events) -> float:
    """Largest relative difference of an event's time, of names and times each; NaN if the events differ."""
    (names, times), (truths, tight) = found, truth
    if names != truths:
        return math.nan
    return max((abs(a - b) / max(abs(b), 1e-300) for a, b in zip(times, tight, strict=True) if a != b), default=0.0)


def _events(out: str) -> Events:
    """Of what `run --json` printed."""
    events = json.loads(out)["events"]
    return [event["name"] for event in events], [event["time"] for event in events]


def scenario(name: str, rounds: int) -> list[dict[str, Any]]:
    """Rows of one scene, cold and again."""
    file = str(ROOT / "scenarios" / name)
    told = command("run", file, "--json")

    def turn() -> dict[str, float]:
        with cache_folder() as cache:
            return {what: fresh(told, cache).cpu for what in ("cold", "again")}

    found = Rounds.of(rounds, turn)
    with cache_folder() as cache:
        itself = integration(file, cache)
        outs = [fresh(line, cache).out for line in (told, [*told, "--rtol", _TIGHT])]
    wrong = largest_difference(_events(outs[0]), _events(outs[1]))
    rows = []
    for what in found.cpu:
        row = {"what": f"{name}, {what}", "error": wrong, "cpu": found.seconds(what), "whole": found.in_units(what)}
        rows.append(row | {"integration": itself, "ratio": found.in_units(what, itself)})
    return rows


def mistakes(rounds: int) -> list[dict[str, Any]]:
    """Rows of command lines with one thing wrong each; all of them say what it is."""
    scene = str(ROOT / "scenarios" / "u2_5_5_stop.toml")
    with tempfile.TemporaryDirectory() as folder, cache_folder() as cache:
        misspelt = pathlib.Path(folder) / "stop.toml"
        misspelt.write_text(pathlib.Path(scene).read_text("utf-8").replace("inertia =", "inertai ="), "utf-8")
        lines = {
            "unknown command": ("runn", scene),
            "unknown option": ("run", scene, "--rtoll", "1e-8"),
            "no such file": ("run", str(misspelt.with_name("step.toml"))),
            "unknown name in a scene file": ("run", str(misspelt)),
            "unknown name in --set": ("run", scene, "--set", "brake.puley.inertia=3"),
        }

        def turn() -> dict[str, float]:
            return {what: fresh(command(*line), cache, code=2).cpu for what, line in lines.items()}

        found = Rounds.of(rounds, turn)
    return [{"what": what, "cpu": found.seconds(what), "ratio": found.in_units(what)} for what in lines]


def measure(quick: bool) -> Part:
    """All scenes; `quick`: one round of the short one."""
    names, rounds = (list(_COLD)[:1], 1) if quick else (list(_COLD), 3)
    rows, targets = [], []
    for name in names:
        cold, again = scenario(name, rounds)
        rows += [cold, again]
        targets.append(
            Target(f"{cold['what']}, beyond its integration", _COLD[name], cold["ratio"], error=cold["error"])
        )
        targets.append(Target(f"{again['what']}, beyond its integration", _AGAIN, again["ratio"], error=again["error"]))
    wrong = mistakes(rounds)
    for row in wrong:
        limit = _SCENE if "name in" in row["what"] else _COMMAND
        targets.append(Target(f"mistake: {row['what']}", limit, row["ratio"]))
    notes = [
        "unit: processor time of a process that imports jax, measured in every round; medians over the rounds",
        "cold: with an empty cache folder; again: the next process with the same folder",
        "integration: warm and optimised, by a prepared run in a separate process",
        f"error: largest relative one of an event's time, against a run at rtol {_TIGHT}",
    ]
    return Part(NAME, TITLE, COLUMNS, [*rows, *wrong], targets, notes)
