"""Time of a warm run over the number of layers and linings, beside a bare loop of as many evaluations."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import simbrake as sb
from benchmarks.parts import bare
from benchmarks.parts.engine import STAGES, nothing, solver_named
from benchmarks.parts.table import Column, Part, Target
from benchmarks.parts.timing import interleaved, ratio
from benchmarks.scenes import INSIDE, OPEN, OUTSIDE, RIM, SHARE, TRACK, Stop

NAME = "growth"
TITLE = "time of a warm run over the number of layers and linings"

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("steps", "attempts", ".0f"),
    Column("seconds", "ms", ".3f", 1e3),
    Column("least", "least", ".3f", 1e3),
    Column("cpu", "CPU", ".3f", 1e3),
    Column("step", "µs a step", ".2f", 1e6),
    Column("bare", "bare loop", ".3f", 1e3),
    Column("ratio", "ratio", ".2f"),
    Column("compile", "trace and compile s", ".1f"),
)


def layered(n: int) -> sb.Scene:
    """The stop of scene (b) with so many equal layers."""
    p = Stop(fade=3e-4, x_0=8e3 / 2e5)
    law = sb.friction.ProductFriction(sb.ConstantFriction(p.f), (sb.LinearFade(p.fade, sb.thermal.ROOM),))
    material = sb.Material(RIM["conductivity"], RIM["density"], RIM["specific_heat"])
    heat = sb.Heat(
        bodies=(sb.thermal.Wall("rim", material, RIM["thickness"], TRACK, n, 1.0), sb.thermal.Reservoir("air")),
        links=(
            sb.thermal.Convection("rim.back", TRACK, INSIDE),
            sb.thermal.Convection("rim.front", OPEN * TRACK, OUTSIDE),
        ),
        friction=sb.thermal.FrictionHeat("rim.front", None, sb.thermal.ConstantPartition(SHARE), sensed="rim.front"),
        rim="rim.front",
    )
    brake = sb.Brake(sb.Pulley(p.R, p.J), sb.Band(p.R, p.C), sb.Lining(law, np.full(p.n, 2 * math.atan(p.z))))
    return sb.Scene(brake, sb.Duty(sb.Constant(p.T_0), sb.TorqueLoad()), sb.Initial(p.w_0, p.x_0), p.end, heat)


def lined(n: int) -> sb.Scene:
    """The stop of scene (a) with 270° of so many linings."""
    p = Stop()
    linings = sb.uniform_linings(n, math.radians(270), sb.ConstantFriction(p.f))
    brake = sb.Brake(sb.Pulley(p.R, p.J), sb.Band(p.R, p.C), linings)
    return sb.Scene(brake, sb.Duty(sb.Constant(p.T_0), sb.TorqueLoad()), sb.Initial(p.w_0), p.end)


def chained(n: int) -> sb.Scene:
    """Onset of slip and stop of a chain: linings of one mass on segments of one stiffness, each lets go for itself."""
    linings = sb.uniform_linings(n, math.radians(270), sb.ConstantFriction(0.35), mass=3.5)
    brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, 1e5, sb.Segments(1e7)), linings)
    duty = sb.Duty(sb.PiecewiseLinear([0.0, 0.35], [2e3, 24e3]), sb.HookLoad(60e3, 0.4, 8))
    return sb.Scene(brake, duty, sb.Initial(24.0, 2e3 / 1e5), 0.2)


#: scene of a size, method, tolerances, room for steps, limit of the exponent, sizes, sizes of a quick run
_CURVES: dict[
    str, tuple[Callable[[int], sb.Scene], str, float, float, int, float, tuple[int, ...], tuple[int, ...]]
] = {
    "layers": (layered, "Rodas5P", 1e-6, 1e-9, 128, 1.2, (10, 30, 100, 300, 1000), ()),
    "linings": (lined, "Dopri8", 1e-8, 1e-12, 64, 1.1, (8, 16, 32, 64, 128, 256, 512), (8, 64)),
    "linings of a chain": (chained, "Dopri8", 1e-6, 1e-10, 4096, 1.1, (8, 16, 32, 64), ()),
}
_METRICS = {
    "layers": ("stopping_time", "energy.friction_heat"),
    "linings": ("slip_onset_time", "stopping_time"),
    "linings of a chain": ("first_lining_slip_time", "full_slip_time"),
}


def point(curve: str, n: int, budget: float) -> dict[str, Any]:
    """One size."""
    make, method, rtol, tight, room, *_ = _CURVES[curve]
    scene, solver, metrics = make(n), solver_named(method), _METRICS[curve]
    run = sb.prepare(scene, metrics, solver=solver, rtol=rtol, max_steps=room)
    answer = run()
    if answer.code:
        raise RuntimeError(f"{n} {curve}: {sb.results.FAILURES[answer.code][0]}")
    program = run.program  # a tight run may need room for more steps, which compiles another
    attempts = answer.accepted + answer.rejected + answer.retaken
    steps = round(attempts + 2 * answer.segments / STAGES[method])
    numbers = run.inputs(run.numbers, rtol)
    loops = bare.programs(scene, solver, steps, bare.longest(scene, solver, rtol))
    calls = {"run": lambda: np.asarray(program.call(numbers)), "nothing": nothing(numbers)}
    times = interleaved(calls | loops, budget)
    best = min(loops, key=lambda way: times[way].cpu_median)
    truth = run(rtol=tight).metrics
    found, error = times["run"], max(abs(answer.metrics[name] / truth[name] - 1) for name in metrics)
    if not math.isfinite(error):
        raise RuntimeError(f"{n} {curve}: a metric was not reached")
    return {
        "what": f"{n} {curve}",
        "curve": curve,
        "size": n,
        "value": found.cpu_median,
        "error": error,
        "steps": attempts,
        "seconds": found.median,
        "least": found.least,
        "cpu": found.cpu_median,
        "step": found.cpu_median / attempts,
        "bare": times[best].cpu_median,
        "ratio": ratio(found, times[best], times["nothing"]),
        "compile": program.trace_seconds + program.compile_seconds,
    }


def exponent(rows: list[dict[str, Any]], key: str) -> float:
    """Slope of log `key` over log size in the upper half of the sizes, by least squares."""
    upper = rows[-math.ceil(len(rows) / 2 + 0.5) :]
    return float(np.polyfit(np.log([row["size"] for row in upper]), np.log([row[key] for row in upper]), 1)[0])


def measure(quick: bool) -> Part:
    """All curves; `quick`: two sizes of the shortest."""
    rows, targets, notes = [], [], []
    for curve, (*_, limit, sizes, few) in _CURVES.items():
        found = [point(curve, n, 0.1 if quick else 1.0) for n in (few if quick else sizes)]
        rows += found
        if len(found) > 1:
            targets.append(Target(f"exponent of the time in {curve}", limit, exponent(found, "cpu")))
            notes.append(f"{curve}: exponent of the time of one step {exponent(found, 'step'):.2f}")
    notes.append("error: largest relative one of two metrics, against a run a thousandfold or more tighter")
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)
