"""Derivatives of the stopping time: reverse mode by all numbers, forward mode by one, in warm runs.

What the reverse program takes to trace and compile is measured in fresh processes: cold, and again with what they kept.
"""

import json
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

import simbrake as sb
from benchmarks.parts.engine import solver_named
from benchmarks.parts.processes import Rounds, cache_folder, fresh
from benchmarks.parts.table import Column, Part, Target
from benchmarks.parts.timing import interleaved, ratio
from benchmarks.scenes import CASES, Stop

NAME = "gradient"
TITLE = "derivatives of the stopping time by all numbers (reverse) and by one (forward), in warm runs"
_TOLERANCE = 1e-8
_CASES = (("a", "Dopri8"), ("b", "Dopri8"), ("c", "Rodas5P"))
#: tight enough for differences of runs (a central one of step h has an error of some h⁴ and rounding/h)
_TIGHT = 1e-12
_COLD = ("initial.omega", "brake.pulley.inertia", "brake.linings.friction.coefficient", "duty.slack_tension.level")
# with heat the run starts at the onset of slip: another slack tension alone would move it to one side of a corner
_HOT = (*_COLD[:2], "brake.linings.friction.base.coefficient", "brake.linings.friction.factors[0].slope")
#: limits of a warm reverse pass and of a forward one, in runs
_REVERSE, _FORWARD = {"a": 5.0, "b": 5.0, "c": 8.0}, 1.6
#: limits to make the reverse program, in imports of JAX, where seconds are not the measure; again from disk
_MADE, _AGAIN = {"b": 10.0, "c": 18.0}, 2.5
#: seconds to trace and compile the others
_SECONDS = 3.0

#: the first gradient beyond a warm one
_PROCESS = """
import json, sys, time
from benchmarks import ours
ours.configure()
import simbrake as sb
from benchmarks.parts.engine import solver_named
from benchmarks.scenes import CASES
name, method, rtol = sys.argv[1], sys.argv[2], float(sys.argv[3])
run = sb.prepare(CASES[name].simbrake(), ["stopping_time"], solver=solver_named(method), rtol=rtol)
run()
def timed():
    start = time.process_time()
    run.gradient()
    return time.process_time() - start
first = timed()
print(json.dumps(first - min(timed() for _ in range(3))))
"""

COLUMNS = (
    Column("what", ""),
    Column("numbers", "numbers", ".0f"),
    Column("error", "error", ".1e"),
    Column("truth", "against"),
    Column("run", "run µs", ".1f", 1e6),
    Column("seconds", "µs", ".1f", 1e6),
    Column("cpu", "CPU", ".1f", 1e6),
    Column("ratio", "in runs", ".2f"),
    Column("differences", "differences in runs", ".0f"),
    Column("compile", "compile s", ".1f"),
    Column("trace", "trace s", ".1f"),
    Column("made", "made, CPU s", ".1f"),
    Column("units", "in imports of jax", ".1f"),
)


def exact(p: Stop) -> dict[str, float]:
    """Derivatives of the stopping time of a stop without heat, from the closed form (Z-15…Z-18) by JAX."""
    import jax.numpy as jnp

    def stop(w_0: Any, J: Any, f: Any, T_0: Any) -> Any:
        fz = f * p.z
        Pi = ((1 + fz) / (1 - fz)) ** p.n
        chi = jnp.sqrt(p.C * p.R**2 / J)
        reach = jnp.arcsin(chi * T_0 * (Pi - 1) / (p.C * p.R * w_0))
        return T_0 / (p.C * p.R * w_0) + reach / chi + w_0 * jnp.cos(reach) * J / (p.R * T_0 * (Pi - 1))

    found = jax.grad(stop, argnums=(0, 1, 2, 3))(p.w_0, p.J, p.f, p.T_0)
    return dict(zip(_COLD, (float(x) for x in found), strict=True))


def differences(run: sb.results.Prepared, paths: tuple[str, ...]) -> dict[str, float]:
    """Central differences of order 4 of tight runs."""
    found = {}
    for path in paths:
        (x,) = run.numbers[run.places[path]]
        h = 1e-3 * x
        values = [run({path: x + k * h}, rtol=_TIGHT).metrics["stopping_time"] for k in (-2, -1, 1, 2)]
        found[path] = float(np.dot([1, -8, 8, -1], values) / (12 * h))
    return found


def forward(run: sb.results.Prepared) -> tuple[Any, Callable[[np.ndarray], Any]]:
    """A program of numbers and a direction: stopping time and its derivative along it."""
    from simbrake._base._compiling import compiled, pack

    k, (_, like) = run.numbers.size, pack(run.scene)

    def time(numbers: Any) -> Any:
        scene = like.unpack(numbers)
        return sb.simulate(scene, solver=run.solver, rtol=run.rtol, max_steps=run.max_steps).stopping_time

    def both(numbers: Any) -> Any:
        return jax.numpy.stack(jax.jvp(time, (numbers[:k],), (numbers[k:],)))

    program = compiled(both, np.concatenate([run.numbers, np.eye(k)[0]]))
    return program, lambda direction: np.asarray(program.call(np.concatenate([run.numbers, direction])))


def one(name: str, method: str, budget: float, known: bool) -> list[dict[str, Any]]:
    """Rows of one scene: reverse and forward. `known`: compare with the closed form, else with differences."""
    case = CASES[name]
    run = sb.prepare(case.simbrake(), ["stopping_time"], solver=solver_named(method), rtol=_TOLERANCE)
    numbers = run.inputs(run.numbers, run.rtol)
    slopes, paths = run.gradient()[0], _COLD if case.simbrake().heat is None else _HOT
    program, along = forward(run)
    unit = np.zeros(run.numbers.size)
    unit[run.places[paths[0]]] = 1.0
    whole = np.concatenate([run.numbers, unit])
    reverse = run._slope
    assert reverse is not None
    calls = {
        "run": lambda: np.asarray(run.program.call(numbers)),
        "reverse": lambda: np.asarray(reverse.call(numbers)),
        "forward": lambda: np.asarray(program.call(whole)),
    }
    times = interleaved(calls, budget)
    # runs for the differences may need room for more steps, and then compile anew: they come last
    truth = exact(case.plain) if known else differences(run, paths)
    against = "closed form" if known else "central differences"
    error = max(abs(float(slopes[run.places[path]][0]) / truth[path] - 1) for path in paths)
    error_one = abs(float(along(unit)[1]) / truth[paths[0]] - 1)
    common = {"truth": against, "run": times["run"].median}
    rows = []
    for way, count, wrong, made in (("reverse", run.numbers.size, error, reverse), ("forward", 1, error_one, program)):
        row = {"what": f"({name}) {method}, {way}", "numbers": count, "error": wrong, "seconds": times[way].median}
        row |= {"cpu": times[way].cpu_median, "ratio": ratio(times[way], times["run"]), "differences": 2 * count}
        rows.append(common | row | {"compile": made.compile_seconds, "trace": made.trace_seconds})
    return rows


def made(name: str, method: str, rounds: int) -> list[dict[str, Any]]:
    """Rows of the reverse program in fresh processes: cold, and again."""

    def turn() -> dict[str, float]:
        program = ["-c", _PROCESS, name, method, str(_TOLERANCE)]
        with cache_folder() as cache:
            return {what: float(json.loads(fresh(program, cache).out)) for what in ("cold", "again")}

    found = Rounds.of(rounds, turn)
    return [
        {"what": f"({name}) {method}, reverse, {what}", "made": found.seconds(what), "units": found.in_units(what)}
        for what in found.cpu
    ]


def measure(quick: bool) -> Part:
    """All scenes; `quick`: the one without heat."""
    budget = 0.3 if quick else 2.0
    rows, targets = [], []
    for name, method in _CASES[:1] if quick else _CASES:
        reverse, forward = found = one(name, method, budget, name == "a")
        wrong = reverse["error"]
        targets.append(Target(f"warm runs, {reverse['what']}", _REVERSE[name], reverse["ratio"], error=wrong))
        targets.append(Target(f"warm runs, {forward['what']}", _FORWARD, forward["ratio"], error=forward["error"]))
        for row in found:
            if name not in _MADE or row is forward:
                both = row["trace"] + row["compile"]
                targets.append(
                    Target(f"seconds to trace and compile, {row['what']}", _SECONDS, both, error=row["error"])
                )
        fresh_ones = [
            row | {"error": wrong, "numbers": reverse["numbers"]} for row in made(name, method, 1 if quick else 3)
        ]
        if name in _MADE:
            for row, limit in zip(fresh_ones, (_MADE[name], _AGAIN), strict=True):
                targets.append(
                    Target(f"trace and compile in imports of jax, {row['what']}", limit, row["units"], error=wrong)
                )
        rows += [*found, *fresh_ones]
    notes = [
        f"rtol {_TOLERANCE:.0e}; error: largest relative one of the derivatives by initial speed (forward: that alone),"
        " inertia, friction, and slack tension (a) or slope of the fade (b, c)",
        "differences in runs: what central differences would take for as many numbers",
        "cold, again: processor time of the first gradient beyond a warm one, in fresh processes, the second with what"
        " the first one kept; in imports of jax measured in every round",
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)
