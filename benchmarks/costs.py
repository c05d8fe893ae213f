"""What a user of simbrake waits for, each cost beside its limit and its error, and
beside a peer of the same run.

`python benchmarks/costs.py [--quick] [--parts process,looking,…] [--json out.json]`

- `process`: `import simbrake`, `simbrake run` cold and a second time, mistakes; in
  processes that import JAX alone
- `waits`: what users do next in a later process: README's gradient, other metrics, a
  sweep, a report; 1000 layers
- `looking`: a result printed, its metrics and its events, in the time of its run
- `loops`: run after run from Python, beside heyoka; `simulate` and `jax.jit` beside
  prepared runs
- `gradient`: derivatives of the stopping time in warm runs
- `ensemble`: many stops, beside SciPy one after the other and beside one worker
- `maxima`: runs with one maximum and with five, beside the same runs without
- `growth`: exponents of the time of a run, and of compiling it, with linings, layers,
  points, stops, maxima

Quote ratios: calls alternate round after round, so that other load on the machine
affects all of them alike; times are processor time. `--write-docs` puts the numbers
into docs/measured/costs.json, from which the pages are made.
"""

import argparse
import dataclasses
import importlib.util
import itertools
import json
import math
import os
import pathlib
import statistics
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

# matrices are small: more threads would only wait for each other
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ["SIMBRAKE_CACHE_DIR"] = ""  # what is compiled here is compiled anew
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from tabulate import tabulate  # noqa: E402

from benchmarks import ours  # noqa: E402
from benchmarks.machine import machine, measured_on  # noqa: E402
from benchmarks.processes import Rounds, cache_folder, fresh  # noqa: E402
from benchmarks.scenes import CASES, closed_form, cycles_case  # noqa: E402
from benchmarks.timing import Times, interleaved, ratio  # noqa: E402

NUMBERS = ROOT / "docs" / "measured" / "costs.json"
TIGHT = 1e-12


class Cost(NamedTuple):
    """One cost: processor time (s), what it is compared with, and the ratio of both
    beside its limit."""

    what: str
    cpu: float
    peer: str
    peer_cpu: float
    ratio: float
    limit: float | None = None
    #: largest relative error of what was computed, and of what the peer computed
    error: float | None = None
    peer_error: float | None = None

    @property
    def missed(self) -> bool:
        return self.limit is not None and not self.ratio <= self.limit


class Part(NamedTuple):
    """Costs of one kind, and what has to be known to read them."""

    title: str
    costs: list[Cost]
    notes: tuple[str, ...]


HEAD = ("", "CPU", "error", "against", "its CPU", "its error", "ratio", "limit", "")


def _seconds(x: float) -> str:
    unit, factor = ("s", 1.0) if x >= 1.0 else ("ms", 1e3) if x >= 1e-3 else ("µs", 1e6)
    return f"{x * factor:.3g} {unit}"


def _error(x: float | None) -> str:
    return "" if x is None else f"{x:.0e}"


def table(part: Part, form: str) -> str:
    """The costs as a table of text (`form="plain"`) or of Markdown
    (`form="github"`)."""
    rows = []
    for c in part.costs:
        limit = "" if c.limit is None else f"≤ {c.limit:.3g}"
        missed = "missed" if c.missed else ""
        mine = (_seconds(c.cpu), _error(c.error))
        theirs = (_seconds(c.peer_cpu), _error(c.peer_error))
        rows.append((c.what, *mine, c.peer, *theirs, f"{c.ratio:.3g}", limit, missed))
    return tabulate(rows, HEAD, form, disable_numparse=True)


def markdown(found: dict[str, Any], name: str) -> str:
    """A part for the pages, from what was written as JSON."""
    known = found[name]
    part = Part(
        known["title"], [Cost(**cost) for cost in known["costs"]], tuple(known["notes"])
    )
    about = measured_on(
        known["machine"], ("python", "jax", "diffrax", "scipy", "heyoka")
    )
    return "\n\n".join(
        [
            f"**{name}**: {part.title}",
            table(part, "github"),
            " ".join(part.notes),
            about,
        ]
    )


def largest_difference(
    found: list[tuple[str, float]], truth: list[tuple[str, float]]
) -> float:
    """Largest relative difference of an event's time; NaN if the events differ."""
    if [name for name, _ in found] != [name for name, _ in truth]:
        return math.nan
    pairs = [(a, b) for (_, a), (_, b) in zip(found, truth, strict=True) if a != b]
    return max((abs(a - b) / max(abs(b), 1e-300) for a, b in pairs), default=0.0)


# --- fresh processes ----------------------------------------------------------------

SCENES = (
    "u2_5_5_stop.toml",
    "staged_vs_standard.py",
    "disc_stop.py",
    "tripping_30_stands.py",
    "everything_coupled.py",
)

#: modules are loaded with the names that are used
_IMPORT = """
import simbrake as sb
sb.Scene, sb.Brake, sb.Pulley, sb.Band, sb.Lining, sb.ConstantFriction, sb.Duty, sb.Initial, sb.simulate
"""
#: a prepared run is compiled with all optimisation, whatever the first tier does
_WARM = """
import sys, time
import simbrake as sb
run = sb.prepare(sb.read_scene(sys.argv[1]), ["energy.friction_heat"])
run()
found = []
while len(found) < 3 or (sum(found) < 0.2 and len(found) < 50):
    start = time.process_time()
    run()
    found.append(time.process_time() - start)
print(sorted(found)[len(found) // 2])
"""


def _told(arguments: list[str], cache: str) -> list[tuple[str, float]]:
    """Events that `run --json` prints."""
    return [
        (event["name"], event["time"])
        for event in json.loads(fresh(arguments, cache).out)["events"]
    ]


def _mistakes(folder: str) -> dict[str, tuple[str, ...]]:
    """Command lines with one mistake each."""
    scene = ROOT / "scenarios" / "u2_5_5_stop.toml"
    misspelt = pathlib.Path(folder) / "stop.toml"
    misspelt.write_text(
        scene.read_text("utf-8").replace("inertia =", "inertai ="), "utf-8"
    )
    return {
        "unknown command": ("runn", str(scene)),
        "unknown option": ("run", str(scene), "--rtoll", "1e-8"),
        "no such file": ("run", str(misspelt.with_name("step.toml"))),
        "unknown name in a scene file": ("run", str(misspelt)),
        "unknown name in --set": ("run", str(scene), "--set", "brake.puley.inertia=3"),
    }


def in_imports(
    found: Rounds, names: Sequence[str], less: float = 0.0, error: float | None = None
) -> list[Cost]:
    """Processes in imports of JAX, `less` seconds taken off."""
    unit = statistics.median(found.units)
    return [
        Cost(
            name,
            found.seconds(name),
            "import jax",
            unit,
            found.in_units(name, less),
            error=error,
        )
        for name in names
    ]


def process(quick: bool) -> Part:
    """Fresh processes, round after round."""
    names, rounds = (SCENES[:1], 1) if quick else (SCENES, 3)
    with tempfile.TemporaryDirectory() as folder, cache_folder() as kept:
        wrong = _mistakes(folder)

        def turn() -> dict[str, float]:
            found = {"import simbrake": fresh(["-c", _IMPORT]).cpu}
            for name in names:
                with cache_folder() as cache:
                    line = [
                        "-m",
                        "simbrake",
                        "run",
                        str(ROOT / "scenarios" / name),
                        "--json",
                    ]
                    found |= {
                        f"run {name}, {what}": fresh(line, cache).cpu
                        for what in ("cold", "again")
                    }
            return found | {
                what: fresh(["-m", "simbrake", *line], kept, code=2).cpu
                for what, line in wrong.items()
            }

        found = Rounds.of(rounds, turn)
        costs = in_imports(found, ["import simbrake"])
        for name in names:
            file = str(ROOT / "scenarios" / name)
            itself = float(fresh(["-c", _WARM, file], kept).out.split()[-1])
            line = ["-m", "simbrake", "run", file, "--json"]
            error = largest_difference(
                _told(line, kept), _told([*line, "--rtol", f"{TIGHT}"], kept)
            )
            runs = [f"run {name}, cold", f"run {name}, again"]
            costs += in_imports(found, runs, itself, error)
        costs += in_imports(found, list(wrong))
    notes = (
        "The ratio is taken in every round and less the warm, optimised integration of the scene.",
        "Cold: with an empty cache folder; again: the next process with the same folder.",
        f"Error: largest relative one of an event's time, against a run at rtol {TIGHT:.0e}.",
    )
    return Part("fresh processes, in processes that import JAX", costs, notes)


# --- what users do next -------------------------------------------------------------

_STOPS = """
import sys, numpy as np
sb.ensemble(scene, {"initial.omega": np.linspace(20.0, 24.0, 1000)}, [sys.argv[1]], progress=False)
"""
_SWEEP = """
sb.sweep(scene, {"initial.omega": range(20, 25), "brake.pulley.inertia": range(1200, 1205)}, ["stopping_time"])
"""
#: warm seconds of `simulate` and of a prepared run of a rim in 1000 layers
_LAYERS = """
import dataclasses, time
import simbrake as sb
from benchmarks.scenes import CASES
scene = CASES["b"].simbrake()
rim, *rest = scene.heat.bodies
bodies = (dataclasses.replace(rim, layers=1000, growth=1.0), *rest)
scene = dataclasses.replace(scene, heat=dataclasses.replace(scene.heat, bodies=bodies))
for call in (lambda: sb.simulate(scene), sb.prepare(scene, ["stopping_time"])):
    call()
    start = time.process_time()
    [call() for _ in range(5)]
    print((time.process_time() - start) / 5)
"""


def waits(quick: bool) -> Part:
    """Fresh processes that do what others before them did not quite do."""
    block = (
        (ROOT / "README.md").read_text("utf-8").split("```python\n")[1].split("```")[0]
    )
    scene, gradient = block.split("print(sb.simulate(scene))")

    def script(text: str) -> Callable[[str], list[str]]:
        return lambda metric: ["-c", text, metric]

    stops = script(scene + _STOPS)
    slopes = script(scene + gradient)
    run = script(f"{scene}print(sb.simulate(scene))")
    lines = {  # what was done before, what is measured
        "jax.grad of README, again": (slopes, slopes),
        "ensemble of 1000, other metrics": (stops, stops),
        "sweep of 25 after a run": (run, script(scene + _SWEEP)),
    }
    metrics = iter(("stopping_angle", "energy.friction_heat", "slip_onset_time"))
    with cache_folder() as kept, tempfile.TemporaryDirectory() as folder:

        def report(_: str) -> list[str]:
            stands = str(ROOT / "scenarios" / "tripping_30_stands.py")
            line = ["-m", "simbrake", "report", stands, "--out", folder]
            return [*line, "--sensitivity", "energy.friction_heat"]

        if not quick:
            lines["report of 30 stands with a sensitivity, again"] = report, report
        for before, _ in lines.values():
            fresh(before("stopping_time"), kept)

        def turn() -> dict[str, float]:
            metric = next(metrics)
            return {
                what: fresh(line(metric), kept).cpu for what, (_, line) in lines.items()
            }

        found = Rounds.of(1 if quick else 3, turn)
        costs = in_imports(found, list(lines))
        if not quick:
            mine, theirs = map(float, fresh(["-c", _LAYERS], kept).out.split())
            what = "simulate, 1000 layers, warm"
            costs.append(Cost(what, mine, "prepared run", theirs, mine / theirs, 3.0))
    return Part("what users do next, in processes that import JAX", costs, ())


# --- looking at a result ------------------------------------------------------------

#: processor seconds that any look may take, and the share of the run's own beyond them
FREE = 0.05
SHARE = 0.2
LOOKS: dict[str, Callable[[Any], Any]] = {
    "print": str,
    "metrics": lambda result: result.metrics,
    "events": lambda result: result.events,
}


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def looks(
    name: str, scene: Any, kinds: dict[str, Callable[[Any], Any]], rounds: int
) -> list[Cost]:
    """Every look at a result that was not looked at before."""
    import simbrake as sb

    def run(rtol: float = 1e-10) -> Any:
        return sb.simulate(scene, rtol=rtol, max_events=1_000_000)

    def times(result: Any) -> list[tuple[str, float]]:
        return [(event.name, float(event.time)) for event in result.events]

    cpu = {what: [] for what in kinds}
    runs = []
    for look in kinds.values():
        look(run())
    for _ in range(rounds):
        for what, look in kinds.items():
            seconds, result = _timed(run)
            runs.append(seconds)
            cpu[what].append(_timed(lambda look=look, result=result: look(result))[0])
    own = float(np.median(runs))
    error = largest_difference(times(run()), times(run(TIGHT)))
    found = {what: float(np.median(seconds)) for what, seconds in cpu.items()}
    return [
        Cost(
            f"{name}, {what}",
            seconds,
            "its run",
            own,
            max(0.0, seconds - FREE) / own,
            SHARE,
            error,
        )
        for what, seconds in found.items()
    ]


def looking(quick: bool) -> Part:
    """Looks at shipped scenes, and at many events."""
    import simbrake as sb

    names, rounds = (SCENES[:1], 1) if quick else (SCENES, 3)
    costs = []
    for name in names:
        costs += looks(name, sb.read_scene(ROOT / "scenarios" / name), LOOKS, rounds)
    for cycles in (22,) if quick else (220, 660):
        costs += looks(
            f"(f), {cycles} cycles",
            cycles_case(cycles).simbrake(),
            {"events": LOOKS["events"]},
            rounds,
        )
    notes = (
        "Looks are warm; the ratio is what they take beyond 50 ms.",
        "220 cycles have some 10,000 events.",
    )
    return Part("looking at a result, in the time of its run", costs, notes)


# --- run after run ------------------------------------------------------------------


def _prepared(name: str, method: str, rtol: float) -> tuple[Any, float]:
    """A prepared run of a scene, and the error of its event times."""
    import jax.numpy as jnp

    import simbrake as sb
    from benchmarks.reference import reference

    def times(result: Any) -> Any:
        return jnp.stack(ours.event_times(result, CASES[name]))

    run = sb.prepare(
        CASES[name].simbrake(), [times], solver=ours.solver_named(method), rtol=rtol
    )
    found = run().metrics["times"]
    return run, float(np.max(np.abs(found / reference(name).answer.times - 1)))


def _cost(what: str, mine: Times, peer: str, theirs: Times, *rest: Any) -> Cost:
    return Cost(
        what, mine.cpu_median, peer, theirs.cpu_median, ratio(mine, theirs), *rest
    )


def beside_heyoka(name: str, budget: float, rtol: float = 1e-8) -> list[Cost]:
    """A prepared run and heyoka's, from Python: by a loop written for the scene, and by
    the layer that all share."""
    from benchmarks.peers import heyoka_taylor
    from benchmarks.reference import error, reference

    runs = {method: _prepared(name, method, rtol) for method in ("Tsit5", "Dopri8")}
    theirs = {
        how: heyoka_taylor.prepare(CASES[name], how, rtol)
        for how in heyoka_taylor.methods(CASES[name])
    }
    wrong = {
        how: error(CASES[name], call(), reference(name).answer)[0]
        for how, call in theirs.items()
    }
    times = interleaved(
        {method: run for method, (run, _) in runs.items()} | theirs, budget
    )
    best = min(runs, key=lambda method: times[method].cpu_median)
    limit = {"a": 3.0, "b": 4.0}[name]
    return [
        _cost(
            f"({name}) prepared, {best}",
            times[best],
            how,
            times[how],
            limit,
            runs[best][1],
            wrong[how],
        )
        for how in theirs
    ]


def ways(name: str, budget: float, rtol: float = 1e-8) -> list[Cost]:
    """Runs with another speed each time: by `simulate`, in a jitted function of the
    user's, beside a prepared run."""
    import jax

    import simbrake as sb

    scene = CASES[name].simbrake()
    solver = ours.solver_named("Dopri8")
    (ready, error) = _prepared(name, "Dopri8", rtol)
    speeds = itertools.cycle(scene.initial.omega * np.linspace(0.99, 1.0, 16))

    def at(omega: Any) -> Any:
        return dataclasses.replace(
            scene, initial=sb.Initial(omega, scene.initial.elongation)
        )

    def stop(omega: Any) -> Any:
        return sb.simulate(
            at(omega), solver=solver, rtol=rtol, max_steps=ready.max_steps
        ).stopping_time

    inside = jax.jit(stop)
    calls: dict[str, Callable[[], Any]] = {
        "prepared": lambda: ready({"initial.omega": next(speeds)}),
        "simulate": lambda: sb.simulate(at(next(speeds)), solver=solver, rtol=rtol),
        "jax.jit": lambda: jax.block_until_ready(inside(next(speeds))),
    }
    truth = closed_form(CASES[name].plain).times[-1]
    found = {
        "simulate": sb.simulate(scene, solver=solver, rtol=rtol).stopping_time,
        "jax.jit": inside(scene.initial.omega),
    }
    # a loop of each, as its callers write it
    times = interleaved(calls, budget, batch=0.02)
    limits = {"simulate": 8.0, "jax.jit": 4.0}
    return [
        _cost(
            f"({name}) {way}", times[way], "prepared run", times["prepared"], limit
        )._replace(error=abs(float(found[way]) / truth - 1), peer_error=error)
        for way, limit in limits.items()
    ]


def loops(quick: bool) -> Part:
    """Run after run; heyoka where it is installed."""
    budget, costs = (0.3, []) if quick else (2.0, [])
    notes = [
        "heyoka has modes written out by hand, no energy balance and no record of steps."
    ]
    if importlib.util.find_spec("heyoka") is None:
        notes = ["heyoka is not installed: `pip install -e '.[bench]'`."]
    else:
        for name in "a" if quick else "ab":
            costs += beside_heyoka(name, budget)
    return Part(
        "one stop after the other from Python, rtol 1e-8",
        [*costs, *ways("a", budget)],
        tuple(notes),
    )


# --- derivatives --------------------------------------------------------------------

_NUMBERS = (
    "initial.omega",
    "brake.pulley.inertia",
    "brake.linings.friction.coefficient",
    "duty.slack_tension.level",
)
#: with heat the run starts at the onset of slip: another slack tension alone would move
#: it to one side of a corner
_HOT = (
    *_NUMBERS[:2],
    "brake.linings.friction.base.coefficient",
    "brake.linings.friction.factors[0].slope",
)
#: limits of a warm reverse pass and of a forward one, in runs
_REVERSE = {"a": 5.0, "b": 5.0, "c": 8.0}
_FORWARD = 1.6


def exact(p: Any) -> dict[str, float]:
    """Derivatives of the stopping time of a stop without heat, from the closed form
    (Z-15…Z-18) by JAX."""
    import jax
    import jax.numpy as jnp

    def stop(w_0: Any, J: Any, f: Any, T_0: Any) -> Any:
        fz = f * p.z
        Pi = ((1 + fz) / (1 - fz)) ** p.n
        chi = jnp.sqrt(p.C * p.R**2 / J)
        reach = jnp.arcsin(chi * T_0 * (Pi - 1) / (p.C * p.R * w_0))
        return (
            T_0 / (p.C * p.R * w_0)
            + reach / chi
            + w_0 * jnp.cos(reach) * J / (p.R * T_0 * (Pi - 1))
        )

    found = jax.grad(stop, argnums=(0, 1, 2, 3))(p.w_0, p.J, p.f, p.T_0)
    return dict(zip(_NUMBERS, (float(x) for x in found), strict=True))


def differences(run: Any, paths: tuple[str, ...]) -> dict[str, float]:
    """Central differences of order 4 of tight runs."""
    found = {}
    for path in paths:
        (x,) = run.numbers[run.places[path]]
        h = 1e-3 * x
        values = [
            run({path: x + k * h}, rtol=TIGHT).metrics["stopping_time"]
            for k in (-2, -1, 1, 2)
        ]
        found[path] = float(np.dot([1, -8, 8, -1], values) / (12 * h))
    return found


def derivatives(name: str, method: str, budget: float) -> list[Cost]:
    """All derivatives by reverse mode and one by forward mode in warm runs."""
    import jax

    import simbrake as sb

    scene = CASES[name].simbrake()
    solver = ours.solver_named(method)
    run = sb.prepare(scene, ["stopping_time"], solver=solver, rtol=1e-8)
    slopes = run.gradient()[0]
    paths = _NUMBERS if scene.heat is None else _HOT

    def stop(omega: Any) -> Any:
        changed = sb.with_values(scene, {"initial.omega": omega})
        return sb.simulate(changed, solver=solver, rtol=1e-8).stopping_time

    plain = jax.jit(stop)
    along = jax.jit(lambda omega: jax.jvp(stop, (omega,), (1.0,)))
    at = float(scene.initial.omega)
    if not math.isfinite(along(at)[0]):
        raise RuntimeError(f"({name}) {method} does not stop under a derivative")
    calls = {
        "run": run,
        "reverse": run.gradient,
        "plain": lambda: jax.block_until_ready(plain(at)),
        "forward": lambda: jax.block_until_ready(along(at)),
    }
    times = interleaved(calls, budget)
    # runs for the differences may need room for more steps, and then compile anew: they
    # come last
    truth = exact(CASES[name].plain) if scene.heat is None else differences(run, paths)
    error = max(
        abs(float(slopes[run.places[path]][0]) / truth[path] - 1) for path in paths
    )
    one = abs(float(along(at)[1]) / truth[paths[0]] - 1)

    words = f"({name}) {method}, all {run.numbers.size} numbers"
    return [
        _cost(
            f"{words}, reverse",
            times["reverse"],
            "prepared run",
            times["run"],
            _REVERSE[name],
            error,
        ),
        _cost(
            f"({name}) {method}, one, jvp",
            times["forward"],
            "jitted run",
            times["plain"],
            _FORWARD,
            one,
        ),
    ]


def gradient(quick: bool) -> Part:
    """Scenes without heat, with layers, and stiff."""
    cases = (("a", "Dopri8"), ("b", "Dopri8"), ("c", "Rodas5P"))
    chosen = cases[:1] if quick else cases
    costs = [
        cost for case in chosen for cost in derivatives(*case, 0.3 if quick else 2.0)
    ]
    notes = (
        "rtol 1e-8; error: of the derivatives by initial speed (jvp: that alone), "
        "inertia, friction, and slack tension (a) or slope of the fade (b, c), against "
        "the closed form (a) or central differences of tight runs.",
    )
    return Part("derivatives of the stopping time", costs, notes)


# --- ensembles ----------------------------------------------------------------------

_FRICTION = {
    "a": "brake.linings.friction.coefficient",
    "b": "brake.linings.friction.base.coefficient",
}


def many(name: str, count: int, few: int, rounds: int) -> list[Cost]:
    """An ensemble of different stops beside SciPy on some of them, and all workers
    beside one; for each run."""
    import simbrake as sb
    from benchmarks.peers import scipy_ivp

    rng = np.random.default_rng(1)
    table = rng.uniform((12.0, 600.0, 0.33), (20.0, 800.0, 0.40), (count, 3))
    paths = ("initial.omega", "brake.pulley.inertia", _FRICTION[name])
    values = dict(zip(paths, table.T, strict=True))
    metrics = ("full_slip_time", "stopping_time")
    scene = CASES[name].simbrake()
    solver = ours.solver_named("Tsit5")

    def ours_on(workers: int | None) -> Any:
        return sb.ensemble(
            scene,
            values,
            metrics,
            rtol=1e-6,
            solver=solver,
            workers=workers,
            progress=False,
        )

    def single(row: Any, method: str, tolerance: float) -> Callable[[], Any]:
        plain = dataclasses.replace(
            CASES[name].plain,
            **dict(zip(("w_0", "J", "f"), map(float, row), strict=True)),
        )
        return scipy_ivp.prepare(
            dataclasses.replace(CASES[name], plain=plain), method, tolerance
        )

    peers = {
        m: [single(row, m, 1e-6) for row in table[:few]]
        for m in ("SciPy RK45", "SciPy DOP853")
    }
    truth = np.stack(
        [single(row, "SciPy DOP853", 1e-12)().times[-2:] for row in table[:few]]
    )
    calls = {
        m: lambda runs=runs: [call() for call in runs] for m, runs in peers.items()
    }
    times = interleaved(
        calls | {"one": lambda: ours_on(1), "all": lambda: ours_on(None)}, 0.0, rounds
    )
    best = min(peers, key=lambda m: times[m].cpu_median)
    theirs = np.max(
        np.abs(np.stack([call().times[-2:] for call in peers[best]]) / truth - 1)
    )
    data = ours_on(1)
    if np.any(data.code.values):
        raise RuntimeError("a run of the ensemble failed")
    mine = np.max(
        np.abs(np.stack([data[m].values[:few] for m in metrics], axis=1) / truth - 1)
    )
    one = times["one"].cpu_median / count
    peer = times[best].cpu_median / few
    what = f"({name}) {count:,} runs"
    workers = os.cpu_count() or 1
    elapsed = times["all"].median / times["one"].median
    limit = {"a": 1 / 100, "b": 1 / 80}[name]
    both = (times["all"].median, "1 worker", times["one"].median)
    whole = 1 / (0.75 * workers)
    return [
        Cost(
            f"{what}, one worker, each",
            one,
            best,
            peer,
            one / peer,
            limit,
            float(mine),
            float(theirs),
        ),
        Cost(f"{what}, {workers} workers, elapsed", *both, elapsed, whole, float(mine)),
    ]


def ensemble(quick: bool) -> Part:
    """Stops without heat and with a layered rim."""
    sizes = (
        (("a", 1_000, 10, 1),)
        if quick
        else (("a", 100_000, 40, 3), ("b", 10_000, 40, 3))
    )
    notes = (
        "Tsit5, rtol 1e-6; SciPy runs one stop after the other with its faster method.",
    )
    costs = [cost for size in sizes for cost in many(*size)]
    return Part(
        "many stops",
        costs,
        (*notes, "Error: of event times against tight single runs by SciPy."),
    )


# --- maxima -------------------------------------------------------------------------

#: shipped scenes, with the maximum that is asked for alone
_ASKED = {
    "u2_5_5_stop": "max_tension",
    "heated": "peak_rim_temperature",
    "staged_vs_standard": "peak_rim_temperature",
    "disc_stop": "peak_rim_temperature",
}
_FIVE = (
    "max_tension",
    "max_normal_load",
    "max_drum_speed",
    "max_hook_speed",
    "peak_rim_temperature",
)
#: limits in runs without maxima: with one, and with up to five
_MOST = {"prepared": (1.7, 2.0), "ensemble": (1.7, 2.2)}


def with_maxima(name: str, budget: float, count: int) -> list[Cost]:
    """A scene's runs with one maximum and with up to five, beside those with the
    stopping time alone; and those of an ensemble of `count`, where it is not 0."""
    import simbrake as sb

    scene = sb.read_scene(name)
    asked = "stopping_time"
    several = [metric for metric in _FIVE if metric in sb.results.metric_names(scene)]
    wanted = {
        "none": [asked],
        "one": [asked, _ASKED[name]],
        f"{len(several)}": [asked, *several],
    }
    prepared = {
        which: sb.prepare(scene, metrics, rtol=1e-6)
        for which, metrics in wanted.items()
    }
    speeds = float(scene.initial.omega) * np.linspace(0.95, 1.0, count)
    tight = sb.simulate(scene, rtol=TIGHT)

    def many(metrics: list[str]) -> Any:
        return sb.ensemble(
            scene,
            {"initial.omega": speeds},
            metrics,
            rtol=1e-6,
            workers=1,
            progress=False,
        )

    ways: dict[str, dict[str, Callable[[], Any]]] = {
        "prepared": {which: lambda run=run: run() for which, run in prepared.items()},
    }
    if count:
        ways["ensemble"] = {
            which: lambda metrics=metrics: many(metrics)
            for which, metrics in wanted.items()
        }
    costs = []
    for way, calls in ways.items():
        runs = count if way == "ensemble" else 1
        times = {
            which: found.cpu_least / runs
            for which, found in interleaved(calls, budget).items()
        }
        for (which, metrics), limit in zip(
            list(wanted.items())[1:], _MOST[way], strict=True
        ):
            values = prepared[which]().metrics
            wrong = max(
                abs(values[metric] / float(tight[metric]) - 1) for metric in metrics[1:]
            )
            own = abs(values[asked] / float(tight[asked]) - 1)
            label = f"{name}, {way}, {which}"
            ratio_ = times[which] / times["none"]
            costs.append(
                Cost(
                    label,
                    times[which],
                    "no maximum",
                    times["none"],
                    ratio_,
                    limit,
                    wrong,
                    own,
                )
            )
    return costs


def maxima(quick: bool) -> Part:
    """Runs that are asked for maxima."""
    names, budget = (list(_ASKED)[:1], 0.3) if quick else (list(_ASKED), 2.0)
    # (runs of the others take milliseconds, and follow each other)
    costs = [
        cost
        for k, name in enumerate(names)
        for cost in with_maxima(name, budget, 0 if k else 4096)
    ]
    notes = (
        "rtol 1e-6, one run of many; error: of the maxima, and of the stopping time, "
        "against a run at 1e-12.",
    )
    return Part("maxima over a run, beside the same run without", costs, notes)


# --- growth -------------------------------------------------------------------------


def _stop(n: int = 20, lever: Any = None, heat: Any = None, end: float = 1.5) -> Any:
    """A stop on an elastic band with `n` linings around the same angle."""
    import simbrake as sb

    linings = sb.Lining(sb.ConstantFriction(0.35), np.full(n, 4.5 / n))
    start = 0.0 if heat is None else 8e3 / 2e5
    duty = sb.Duty(lever or sb.Constant(8e3), sb.TorqueLoad())
    brake = sb.Brake(sb.Pulley(0.725, 800.0), sb.Band(0.725, 2e5), linings)
    return sb.Scene(brake, duty, sb.Initial(20.0, start), end, heat)


def _with_layers(n: int) -> Any:
    import simbrake as sb

    track = 2 * math.pi * 0.725 * 0.23
    rim = sb.thermal.Wall("rim", sb.Material(48.0, 7800.0, 500.0), 0.028, track, n)
    links = (sb.thermal.Convection("rim.back", track, 60.0),)
    friction = sb.thermal.FrictionHeat(
        "rim.front", None, sb.thermal.ConstantPartition(0.95)
    )
    return _stop(
        heat=sb.Heat(
            (rim, sb.thermal.Reservoir("air")),
            links,
            friction=friction,
            rim="rim.front",
        )
    )


def _with_points(n: int) -> Any:
    """A lever recorded at `n` points, a step or more for each."""
    import simbrake as sb

    t = np.linspace(0.0, 1.5, n)
    return _stop(lever=sb.PiecewiseLinear(t, 8e3 + 50.0 * np.sin(40.0 * t)))


def _with_stops(n: int) -> Any:
    return cycles_case(n).simbrake()


def _shipped_stop(n: int = 1) -> Any:
    import simbrake as sb

    return sb.read_scene("u2_5_5_stop")


class Growth(NamedTuple):
    """A number that scenes or requests can have more of, in two sizes; `limit` of the
    exponent."""

    what: str
    sizes: tuple[int, int]
    scene: Callable[[int], Any]
    metrics: Callable[[int], Sequence[str]] = lambda n: ["stopping_time"]
    limit: float = 1.1


_SEVERAL = (*_FIVE[:4], "min_holding_reserve", "max_rope_tension")
_GROWS = (
    Growth("linings on one band", (20, 320), _stop),
    Growth("layers of a rim", (20, 320), _with_layers, limit=1.5),
    Growth("points of a lever", (100, 6_400), _with_points),
    Growth("stops in a run", (5, 80), _with_stops),
    Growth(
        "maxima asked for",
        (1, 6),
        _shipped_stop,
        lambda n: ["stopping_time", *_SEVERAL[:n]],
    ),
)


def grows(growth: Growth, budget: float) -> list[Cost]:
    """Time of a warm run and of compiling it in both sizes, and the exponents of
    both."""
    import simbrake as sb

    few, many = (
        sb.prepare(
            growth.scene(n),
            growth.metrics(n),
            rtol=1e-8,
            max_steps=None if n < 1e3 else 4 * n,
        )
        for n in growth.sizes
    )
    times = interleaved({"few": few, "many": many}, budget)
    span = math.log(growth.sizes[1] / growth.sizes[0])
    small, large = growth.sizes
    rows = {
        "a run": (times["few"].cpu_least, times["many"].cpu_least),
        "compiling": tuple(sum(one.program[1:3]) for one in (few, many)),
    }
    costs = []
    for what, (a, b) in rows.items():
        label = f"{growth.what}, {small} to {large}: {what}"
        costs.append(
            Cost(label, b, f"{small}", a, math.log(b / a) / span, growth.limit)
        )
    return costs


def more_runs(few: int, many: int) -> Cost:
    """An ensemble of more runs."""
    import simbrake as sb

    scene = _shipped_stop()

    def ensemble_of(count: int) -> Callable[[], Any]:
        values = {"initial.omega": np.linspace(15.0, 25.0, count)}
        return lambda: sb.ensemble(
            scene, values, ["stopping_time"], rtol=1e-6, workers=1, progress=False
        )

    times = interleaved({"few": ensemble_of(few), "many": ensemble_of(many)}, 0.0)
    a = times["few"].cpu_least
    b = times["many"].cpu_least
    label = f"runs of an ensemble, {few:,} to {many:,}"
    return Cost(label, b, f"{few:,}", a, math.log(b / a) / math.log(many / few), 1.1)


def growth(quick: bool) -> Part:
    """How time grows with the size of a scene or request."""
    some = _GROWS[2:3] if quick else _GROWS
    notes = (
        "The ratio is the exponent: 1 where twice as many take twice as long. rtol "
        "1e-8, prepared runs.",
        "Rims of many layers are followed by the implicit method, whose steps also "
        "resolve the heat that enters thinner ones: limit 1.5.",
        "Compiling is the elapsed time of tracing and compiling.",
    )
    costs = [cost for one in some for cost in grows(one, 0.5)]
    return Part(
        "exponents of growth",
        costs if quick else [*costs, more_runs(2_000, 64_000)],
        notes,
    )


_ALL = (process, waits, looking, loops, gradient, ensemble, maxima, growth)
PARTS = {part.__name__: part for part in _ALL}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--quick", action="store_true", help="few sizes, one scene, one round"
    )
    parser.add_argument("--parts", default=",".join(PARTS), help="default: all")
    parser.add_argument("--json", help="file for the numbers")
    parser.add_argument(
        "--write-docs",
        action="store_true",
        help="put the parts into docs/measured/costs.json",
    )
    options = parser.parse_args()
    names = options.parts.split(",")
    if unknown := set(names) - set(PARTS):
        parser.error(
            f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}"
        )
    warnings.filterwarnings("ignore", message=".*divide.*|.*overflow.*")
    ours.configure()
    found: dict[str, Any] = {}
    here = machine()
    print(measured_on(here, tuple(here["versions"])))
    missed = 0
    for name in names:
        start = time.perf_counter()
        part = PARTS[name](options.quick)
        took = f"({time.perf_counter() - start:.0f} s)"
        print(
            "\n".join(
                ["", f"{name}: {part.title}", table(part, "plain"), *part.notes, took]
            ),
            flush=True,
        )
        found[name] = {
            "machine": here,
            "quick": options.quick,
            "title": part.title,
            "costs": [c._asdict() for c in part.costs],
            "notes": part.notes,
        }
        missed += sum(cost.missed for cost in part.costs)
    print(f"\n{missed} limits missed")
    files = [pathlib.Path(options.json)] if options.json else []
    for file in files + ([NUMBERS] if options.write_docs else []):
        # parts of the pages that are not measured now stay, with their machine
        old = json.loads(file.read_text("utf-8")) if file == NUMBERS else {}
        file.write_text(json.dumps(old | found, indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
