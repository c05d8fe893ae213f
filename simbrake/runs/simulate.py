"""Running a scene: from a scene to a result, long runs in stretches, programs prepared
once for many runs."""

import dataclasses
import functools
import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Float

from .._base._arguments import explained
from .._base._compiling import (
    LONGEST,
    Program,
    TieredProgram,
    as_one_function,
    megabytes,
    program_of,
    require_own_process,
    run_device,
)
from .._base._faults import Fault, InputError, input_error
from .._base._jacobian import with_precompiled_jacobian
from .._base._packing import Packing, pack
from .._base._part import Whole, faults_of_whole, is_traced, leaves
from .._base._progress import Progress, Report, reporting
from .._base._quantity import faults_of_tolerance, shown
from .._base._store import MEMORY, kept
from ..hybrid import (
    AbstractMethod,
    Code,
    ExplicitRungeKutta,
    Given,
    Record,
    Rodas5P,
    Settings,
    beginning,
    concatenate,
    hybridsolve,
    solve_segment,
)
from ..hybrid._lanes import hybridsolve_lane
from ..hybrid.arrays import Array, VectorK
from ..hybrid.struct import with_value_at
from ..hybrid.system import flatten
from ..outputs.extremes import watched_metrics
from ..outputs.log import FAILURES, SimulationError
from ..outputs.metrics import METRICS, ByName, Peak, identity_of
from ..outputs.probe import Number
from ..parts.scene import Scene, check_scene, checked, read_by_linings
from ..physics.assemble import assemble
from ..thermal.heat import node_names
from ..thermal.mesh import finer_values
from .choice import stiffness
from .edit import entry_of, fault_of_path, numbers_in_si, with_inputs
from .measure import Metric, check_metrics, measure_all, name_of, unit_of
from .mesh import cuts_of, with_finer_layers
from .result import Result, RunLimits

# --- errors of answers ---------------------------------------------------------------


#: factor between the tolerances of the two runs; the loosest one of the second, and the
#: tightest, below which rounding governs the steps
RATIO = 100.0
TIGHT = 1e-12
TIGHTEST = 1e-13
#: relative rounding of one operation
EPS = 2.0**-52


def second_rtol(rtol: float) -> float:
    """Tolerance of a second run beside which the error of the first one counts alone.

    100 times tighter, and at least as tight as 1e-12: at a loose tolerance many steps
    are as short as events and time breakpoints make them, and would be the same steps
    again. Not below 1e-13, where rounding governs.
    """
    return float(np.clip(rtol / RATIO, TIGHTEST, TIGHT))


#: factor from what finer layers change to the error of the layers: 2 where that is
#: proportional to their thickness, as of friction that sees the mean of a layer, and a
#: little more; where it falls with the square, 4/3 would be enough
_OF_LAYERS = 2.2


def error_of_layers(apart: Any, error: Any) -> Any:
    """Error of the layers of walls: from the difference to a run with finer ones, and
    the error in time.

    The difference counts where the errors in time of both runs do not explain it.
    """
    return _OF_LAYERS * np.maximum(apart - 2 * error, 0.0)


def rounding(steps: Any, size: Any) -> Any:
    """What rounding leaves of a number of this size that is summed over so many
    steps."""
    return EPS * np.sqrt(np.maximum(steps, 1)) * np.abs(size)


class PreparedAccuracy(NamedTuple):
    """Estimated errors of a prepared run: of its metrics by name, as they are in the
    answer (`None`, in arrays NaN, where one has no value); steps of both runs; and
    `problem`, empty, or why there is no estimate.

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> prepared.accuracy({"initial.omega": 18.0}).errors["stopping_time"] < 1e-9
        True
    """

    errors: dict[str, Any]
    steps: int
    second_steps: int
    problem: str = ""


def of_answers(first: Any, second: Any) -> PreparedAccuracy:
    """Errors of the first of two answers of a prepared run from their difference."""
    counts = first.accepted, second.accepted
    for which, answer in (("the run", first), ("the second run", second)):
        if answer.code:
            return PreparedAccuracy(
                {}, *counts, f"{which} failed ({FAILURES[answer.code][0]})"
            )
    if (first.events, first.segments) != (second.events, second.segments):
        words = f"the runs have {first.events} and {second.events} events"
        return PreparedAccuracy(
            {}, *counts, f"{words} in {first.segments} and {second.segments} segments"
        )
    errors: dict[str, Any] = {}
    for name, value in first.metrics.items():
        errors[name] = _told(
            errors_between(value, second.metrics[name], first.accepted)
        )
    return PreparedAccuracy(errors, *counts)


def with_layers(found: PreparedAccuracy, first: Any, finer: Any) -> PreparedAccuracy:
    """The errors with those of the layers of walls, from the answer of the same run
    with finer layers."""
    if finer.code:
        why = f"the run with finer layers failed ({FAILURES[finer.code][0]})"
        return found._replace(errors={}, problem=why)
    errors = {}
    for name, error in found.errors.items():
        apart = np.abs(
            np.asarray(first.metrics[name], float)
            - np.asarray(finer.metrics[name], float)
        )
        error = np.asarray(np.nan if error is None else error)
        errors[name] = _told(
            np.where(np.isfinite(apart), error + error_of_layers(apart, error), np.nan)
        )
    return found._replace(errors=errors)


def _told(error: np.ndarray) -> Any:
    """Errors as they are in an answer: of one number itself, `None` without a value."""
    return error if error.ndim else None if np.isnan(error) else float(error)


def errors_between(a: Any, b: Any, steps: Any) -> np.ndarray:
    """Errors of values `a` from those of a second run, NaN where one of them is not
    finite."""
    a = np.asarray(a, float)
    b = np.asarray(b, float)
    both = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):
        error = np.abs(a - b) + rounding(steps, a)
    return np.where(both, error, np.nan)


# --- runs ---------------------------------------------------------------------------


#: step attempts or events that may be asked for
_MOST_ALLOWED = 100_000_000
#: step attempts in a stretch at most
STRETCH = 1024
#: least number of steps in a run under profiles that are not piecewise simple
_SLICES = 64
#: attempts in the first stretch where progress is shown: enough to measure one
_FIRST = 64
#: seconds that a stretch should take where progress is shown
_TARGET = 0.25
#: runs of one structure after which `simulate` says once that there is `prepare`
_MANY_RUNS = 1000
_log = logging.getLogger("simbrake")

if TYPE_CHECKING:
    import diffrax

    Solver: TypeAlias = AbstractMethod | diffrax.AbstractERK
else:
    # an explicit solver of diffrax, whose import nobody waits for, or a method of
    # `simbrake.hybrid`
    Solver = Any


def given_of(
    packing: Packing, numbers: VectorK, method: AbstractMethod, max_steps: int
) -> Given:
    """What is to be integrated."""
    scene, rtol, max_step, max_events = packing.unpack(numbers)
    system, state, mode = assemble(scene)
    if system.guard_samples:
        # a user-defined profile may hide a pulse: with the samples inside a step,
        # 1/1000 of the run is looked at
        span = jnp.asarray(scene.end_time) - jnp.asarray(scene.initial.time)
        max_step = jnp.minimum(max_step, span / _SLICES)
    settings = Settings(
        rtol=rtol,
        max_step=max_step,
        max_events=max_events,
        max_steps=max_steps,
        guard_samples=system.guard_samples,
    )
    return Given(
        system, state, mode, scene.initial.time, scene.end_time, method, settings
    )


def _stretch_program(
    packing: Packing, method: AbstractMethod, tiered: bool
) -> tuple[TieredProgram | Program, np.ndarray]:
    """One stretch of all runs of one structure, compiled: a function of the numbers,
    the state left by the stretch before and its length, in one vector; and the state at
    the start of the first.

    - `tiered`: compiled quickly at first: linings that move by themselves may take few
      steps or many, and LLVM's optimiser up to 40 s
    """
    n = packing.size

    def begun(x: Array) -> np.ndarray:
        return beginning(given_of(packing, x, method, STRETCH))

    def run(x: Array) -> tuple[Record, Array]:
        given = given_of(packing, x[:n], method, STRETCH)
        return solve_segment(given, x[n:-1], x[-1].astype(jnp.int32))

    def length() -> int:
        return jax.eval_shape(begun, np.ones(n)).shape[0]

    size = kept(("beginning", packing, method), length)
    subject = ("stretch", packing, method)

    def make() -> TieredProgram | Program:
        numbers = np.ones(n + size + 1)
        if tiered:
            return TieredProgram(run, numbers, subject)
        return program_of(run, numbers, subject=subject, longest=LONGEST)

    program = MEMORY.get((*subject, run_device()), make, megabytes)
    return program, np.full(size, np.nan)


def long_run(
    numbers: Array,
    packing: Packing,
    method: AbstractMethod,
    rooms: Sequence[int],
    report: Report | None = None,
) -> Record:
    """A run of up to `rooms[-1]` step attempts; its record has space for the least of
    `rooms` that is enough.

    The record of one program is the same to the last bit whether progress is shown or
    not: it only makes stretches shorter.
    """
    scene: Scene = packing.unpack(numbers)[0]
    program, carried = _stretch_program(packing, method, scene.brake.resolved)
    t = float(scene.initial.time)
    end = float(scene.end_time)
    if report is not None:
        report(t, end)
    rows: list[Any] = []  # of the stretches before
    left = rooms[-1]
    length = STRETCH if report is None else _FIRST
    while True:
        begun = time.monotonic()
        part, carried = program.call(
            np.concatenate([numbers, carried, [float(min(length, left))]])
        )
        count = int(part.count)
        rows.append(
            jax.tree.map(lambda leaf, n=count: np.asarray(leaf)[:n].copy(), part.rows)
        )
        left -= count
        if int(part.code) != Code.STEP_LIMIT or left <= 0:
            break
        if report is not None:
            report(float(part.t_end), end)
            spent = max(time.monotonic() - begun, 1e-6)
            length = int(
                np.clip(length * np.clip(_TARGET / spent, 0.25, 4.0), 1, STRETCH)
            )
    if report is not None:
        report(float(part.t_end), end)
    used = rooms[-1] - left
    return concatenate(rows, part, next(size for size in rooms if used <= size))


# --- one run ------------------------------------------------------------------------

#: thermal nodes from which a run is compiled with LLVM's optimiser at once: without it
#: loops over them take 8 times as long
_MANY_NODES = 200
#: step attempts up to which the parts of a derivative are left in pieces: as one
#: function they run five times as fast, but compile for up to 13 s longer
_SHORT = 8192
#: MB that JAX may keep of a run as part of a larger program, whose length is not known
_PART_MEGABYTES = 40.0
#: rows of the record when the caller sets no limit: the next is tried if one was too
#: short
_STEPS = (STRETCH, 16384, 131072)


def _marked(scene: Scene) -> Scene:
    """The scene with a start that is not a number if any number in it is not finite:
    such a run ends before it begins.

    Else an infinite inertia or capacity would leave only its energies without a value,
    and the code would not say so.
    """
    total = sum(
        jnp.sum(0.0 * jnp.asarray(number, jnp.float64))
        for number in jax.tree.leaves(scene)
    )
    start = jnp.asarray(scene.initial.time, jnp.float64)
    start = jnp.where(jnp.isfinite(jax.lax.stop_gradient(total)), start, jnp.nan)
    return with_value_at(scene, "initial.time", start)


def run_of_numbers(
    packing: Packing, method: AbstractMethod, max_steps: int
) -> Callable[[Array], Record]:
    """The run of all scenes of one structure, a function of their numbers and of the
    limits."""
    call = (
        {"call": functools.partial(as_one_function, in_turn=True)}
        if max_steps > _SHORT
        else {}
    )

    def run(numbers: Array) -> Record:
        return hybridsolve(*given_of(packing, numbers, method, max_steps), **call)

    return run


def _run_program(
    packing: Packing, method: AbstractMethod, max_steps: int
) -> TieredProgram:
    """The compiled run of all scenes of one structure."""
    subject = ("run", packing, method, max_steps)

    def make() -> TieredProgram:
        quick = len(node_names(packing.stand_in()[0].network)) < _MANY_NODES
        run = run_of_numbers(packing, method, max_steps)
        return TieredProgram(run, np.ones(packing.size), subject, quick)

    return MEMORY.get((*subject, run_device()), make, megabytes)


def _run_as_part(
    packing: Packing, method: AbstractMethod, max_steps: int
) -> Callable[..., Record]:
    """The run as part of a larger program, a function of scene, relative tolerance,
    longest step and events: as one function where it is not differentiated."""

    def make() -> Callable[..., Record]:
        # (JAX compiles it by itself where the larger program is not compiled as a whole)
        run = jax.jit(run_of_numbers(packing, method, max_steps))

        def of_problem(run: Callable[[Array], Record]) -> Callable[..., Record]:
            return lambda scene, *limits: run(pack((_marked(scene), *limits), jnp)[0])

        subject = ("run", packing, method, max_steps)
        inside = of_problem(functools.partial(as_one_function, run))
        return with_precompiled_jacobian(of_problem(run), subject, inside)

    key = ("part", packing, method, max_steps)
    return MEMORY.get(key, make, lambda _: _PART_MEGABYTES)


def require_64_bits() -> None:
    """Raises `RuntimeError` if JAX is not in 64-bit mode."""
    if not jax.config.jax_enable_x64:  # pyright: ignore
        raise RuntimeError(
            "simbrake computes in 64 bits: events cannot be located in 32. Importing "
            "it turns them on; here they were "
            'turned off by JAX_ENABLE_X64=0 or jax.config.update("jax_enable_x64", '
            "False): remove that"
        )


def require_compiling() -> None:
    """Raises `InputError` where JAX compiles nothing: its jit is off, it has no device,
    or this process was forked."""
    if jax.config.jax_disable_jit:  # pyright: ignore
        raise input_error(
            "JAX_DISABLE_JIT",
            "is set, and runs are compiled",
            "unset it, or jax_disable_jit",
        )
    run_device()


def check_limits(
    rtol: Number,
    max_step: Number = np.inf,
    max_steps: int | None = None,
    max_events: int = 0,
) -> None:
    """Raises `InputError` where a tolerance or a limit is out of range; traced ones are
    not checked."""
    faults = faults_of_tolerance(rtol)
    if not isinstance(max_step, Tracer) and not (
        np.asarray(max_step).dtype.kind in "fiu" and np.all(max_step > 0)
    ):
        faults.append(
            Fault(
                "max_step",
                f"{shown(max_step)} s is out of range",
                "the longest step must be > 0 s",
            )
        )
    for name, limit in (("max_steps", max_steps), ("max_events", max_events)):
        if limit is not None:
            faults += faults_of_whole(
                name, limit, Whole("attempts or events", 0, _MOST_ALLOWED)
            )
    if faults:
        raise InputError(faults)


def solver_for(stiff: bool) -> Solver:
    """The solver where the caller names none."""
    return Rodas5P() if stiff else _explicit()


_explicit = functools.cache(lambda: ExplicitRungeKutta.shipped("Dopri8"))


def step_limits(scene: Scene, max_steps: int | None) -> tuple[int, ...]:
    """Limits of the step attempts, tried one after the other; a scene of many events
    begins with the second, and none is below the number of points of a history."""
    if max_steps:
        return (max_steps,)
    many = scene.brake.resolved or getattr(scene.duty.lever, "knot_count", 0) > 40
    points = max(map(np.size, jax.tree.leaves(scene)))
    return tuple(n for n in _STEPS[many:] if n > points) or _STEPS[-1:]


#: how many times the step attempts of a run a differentiated one may take, as it
#: resolves tangents too
_DIFFERENTIATED = 2


def room_for(result: Result, *, differentiated: bool = False) -> int:
    """Step attempts to allow in runs like this one, a power of two: programs round
    differently, and need a few more."""
    count = int(result.record.count) * (_DIFFERENTIATED if differentiated else 1)
    return 1 << math.ceil(math.log2(1.25 * count + 48))


@explained
def simulate(
    scene: Scene,
    *,
    solver: Solver | None = None,
    rtol: Number = 1e-10,
    max_step: Number = np.inf,
    max_steps: int | None = None,
    max_events: int = 10_000,
    throw: bool = True,
    progress: Progress | Report | bool | None = False,
) -> Result:
    """Runs a scene to its end time through all its events.

    - `solver`: an explicit diffrax solver with error estimate (`Tsit5()` is faster
      above a tolerance of 1e-6), or `hybrid.Rodas5P()` for stiff scenes. By default
      `diffrax.Dopri8()`, and Rodas5P where a thermal node, drag or a state of a
      friction law is so fast that stability would govern an explicit method (the
      summary says why). Under jit, vmap or grad values are unknown: there a scene with
      heat gets Rodas5P unless a solver is given
    - `rtol`: relative tolerance; absolute tolerances are `rtol` times the typical size
      of each state
    - `max_step`: longest step (s), for user-defined profiles with short features
    - `max_steps`: step attempts allowed (1024, then 16 and 128 times as many, if not
      given; under a JAX transformation 1024)
    - `max_events`: events allowed
    - `throw`: raise `SimulationError` if the run fails; otherwise the code is in the
      result
    - `progress`: `True` reports on stderr the share of the time simulated and the
      longest time left, `None` does so on a terminal only; a function is called with
      `(t, end_time)`, first when all is compiled. Runs of up to 1024 step attempts
      report nothing

    A new number in the scene never re-traces; a new structure (more linings, another
    law) compiles anew. Under jit, vmap or grad nothing is raised and the caller looks
    at `result.code`.

    Raises `InputError` with all errors of the scene (or of these options) at once,
    `SimulationError`, and `RuntimeError` if JAX is not in 64-bit mode.

    Example:
        >>> sb.simulate(scene).status
        'stopped'
    """
    require_64_bits()
    require_compiling()
    check_limits(rtol, max_step, max_steps, max_events)
    scene = checked(scene)
    solver = solver_of(scene, solver)
    method = method_of(scene, solver)
    name = solver_name(solver)
    rtol_, longest = (
        np.asarray(x, np.float64) if np.isscalar(x) else x for x in (rtol, max_step)
    )
    events = np.asarray(max_events, np.int32)
    limits = RunLimits(longest, events, max_steps)
    problem = scene.as_run, rtol_, longest, events
    if is_traced((scene, rtol, max_step)):
        # (of an array of NumPy under `vmap` JAX makes no constant for a function with
        # derivatives of its own)
        scene, *more = jax.tree.map(
            lambda x: jnp.array(x) if isinstance(x, Tracer) else x,
            (scene, *problem[1:]),
        )
        problem = scene.as_run, *more
        run = _run_as_part(Packing.of(problem), method, max_steps or _STEPS[0])
        record = run(*problem)
        return Result(scene, record, rtol_, name, limits)
    numbers, packing = pack(problem)
    rooms = step_limits(scene, max_steps)
    with reporting(progress) as report:
        short = rooms[0] <= STRETCH  # over in a moment
        program = _run_program(packing, method, rooms[0]) if short else None
        if program is not None and program.calls == _MANY_RUNS:
            hint = "sb.prepare(scene) makes each of them several times faster"
            _log.warning(f"simbrake: many runs of one structure: {hint}")
        record = None if program is None else program.call(numbers)
        if record is None or (int(record.code) == Code.STEP_LIMIT and len(rooms) > 1):
            record = long_run(numbers, packing, method, rooms, report)
    result = Result(scene, record, rtol_, name, limits)
    if throw and not result.ok:
        raise SimulationError(f"{result.status}: {result.message}", result)
    return result


def solver_of(scene: Scene, solver: Solver | None = None) -> Solver:
    """The solver given, or the one that `simulate` chooses for a scene. Raises
    `InputError` for what is no solver."""
    if solver is not None:
        try:
            as_method(solver)
        except TypeError as error:
            hint = (
                "give an explicit solver of diffrax, as diffrax.Tsit5(), or a "
                "method of simbrake.hybrid"
            )
            raise input_error(
                "solver", f"{shown(solver)} does not fit here", hint
            ) from error
        return solver
    return solver_for(stiffness(scene)[0] if not is_traced(scene) else scene.heated)


def method_of(scene: Scene, solver: Solver) -> AbstractMethod:
    """The method of a scene's run with a solver."""
    # with heat, or friction under pressure, the equations are long: a program in which
    # they stand once compiles and runs faster
    long = scene.heated or read_by_linings(scene).p
    return as_method(solver).rolled() if long else as_method(solver)


def solver_name(solver: Solver) -> str:
    """Name of a solver in results."""
    return solver.name if isinstance(solver, AbstractMethod) else type(solver).__name__


@functools.lru_cache
def as_method(solver: Solver) -> AbstractMethod:
    return solver if isinstance(solver, AbstractMethod) else ExplicitRungeKutta(solver)


#: as many events as `simulate` allows
_EVENTS = np.asarray(10_000, np.int32)


def simulate_lane(
    scene: Scene,
    solver: Solver,
    rtol: Array,
    max_steps: int,
    room: int,
    names: Sequence[str] = (),
) -> tuple[Result, dict[str, Array]]:
    """As `simulate` under `vmap`, with a record of the events alone (see
    `hybridsolve_lane`), for `room` of them; and the maxima of that name (not of the
    holding reserve, which only the end of a run decides)."""
    scene = checked(scene)
    longest = np.asarray(np.inf)
    numbers, packing = pack((_marked(scene), rtol, longest, _EVENTS), jnp)
    given = given_of(packing, numbers, method_of(scene, solver), max_steps)
    watched = watched_metrics(flatten(*given[:3]), names) if names else None
    record, tops = hybridsolve_lane(given, room, watched)
    result = Result(
        scene, record, rtol, solver_name(solver), RunLimits(longest, _EVENTS, max_steps)
    )
    if tops is None:
        return result, {}
    peaks = zip(names, tops, strict=True)
    return result, {
        name: METRICS[name].of_peak(Peak(top, top, top), scene).value
        for name, top in peaks
    }


# --- prepared once: numbers in, metrics and their derivatives out, without any tracing or checking

#: numbers by path, a whole vector of them, or those of the prepared scene
Values = Mapping[str, Any] | np.ndarray | None

_MOST_STEPS = 1 << 20
#: lines up to which derivatives are compiled as one function: with Rodas5P it would
#: take minutes
_LONGEST_SLOPES = 26_000
_COUNTS = 6  # code and counts of steps, behind the metrics


class PreparedResult(NamedTuple):
    """Answer of a prepared run: metrics by name (`inf`: a time that never came), result
    code, counts of steps.

    Example:
        >>> answer = sb.prepare(scene, ["stopping_time"])({"initial.omega": 18.0})
        >>> round(answer.metrics["stopping_time"], 4), answer.code
        (0.9433, 0)
    """

    metrics: dict[str, Any]
    # 0: the run reached its end time; else one of `simbrake.results.FAILURES`
    code: int
    accepted: int
    rejected: int
    retaken: int
    events: int
    segments: int


class Places(dict[str, slice]):
    """Path of a number → where it lies in the vector of all of them; also of an entry
    of a list.

    Raises `KeyError` with the nearest paths where there is none.
    """

    def __missing__(self, path: str) -> slice:
        field, index = entry_of(str(path))
        if field not in self:
            raise KeyError(str(fault_of_path(str(path), self)))
        whole = self[field]
        if index is None:
            return whole
        entries = range(whole.start, whole.stop)
        if not -len(entries) <= index < len(entries):
            raise KeyError(
                f"{path}: there is no entry {index}; {field} has {len(entries)} entries, from 0"
            )
        return slice(entries[index], entries[index] + 1)


@explained
class Prepared:
    """A scene compiled for fast runs with other numbers; made by `prepare`.

    - `numbers` (k,): all numbers of the scene but its limits, as one vector; `places`:
      path → where they lie in it
    - `metrics`: names in the order of `gradient`'s rows
    - `program`: the compiled run, with the seconds that tracing and compiling took

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> [round(prepared({"initial.omega": omega}).metrics["stopping_time"], 4) for omega in (18.0, 24.0)]
        [0.9433, 1.2577]
    """

    def __init__(
        self,
        scene: Scene,
        metrics: Sequence[Metric],
        solver: Solver,
        rtol: float,
        max_steps: int,
        max_step: float = np.inf,
        max_events: int = 10_000,
    ) -> None:
        self.scene = scene
        self.solver = solver
        self.rtol = rtol
        self.max_steps = max_steps
        self.max_step = max_step
        self.max_events = max_events
        self._slope_steps = _DIFFERENTIATED * max_steps
        self.metrics = tuple(name_of(metric) for metric in metrics)
        self._asked = tuple(metrics)
        self.numbers, self._like = pack(scene.as_run)
        self.places = self._places()
        #: of the metrics in the program's result, in their order; known once it is
        #: traced
        self._spans: list[tuple[str, int | slice]] = []
        self.program = self._compile()
        self._slope: Program | None = None
        # the same scene with finer layers, once it is needed
        self._finer: Prepared | None = None

    def __repr__(self) -> str:
        units = {
            name: unit_of(metric)
            for name, metric in zip(self.metrics, self._asked, strict=True)
        }
        asked = ", ".join(
            f"{name} [{unit}]" if unit else name for name, unit in units.items()
        )
        counts = f"{len(self.places)} parameters ({self.numbers.size} numbers)"
        how = f"{solver_name(self.solver)}, rtol {self.rtol:g}, at most {self.max_steps} steps"
        return f"Prepared({self.scene.brake.kind}: {counts} → {asked}; {how})"

    def _places(self) -> "Places":
        # a scene whose numbers are replaced by their places tells where each path lies
        counted = self._like.unpack(np.arange(self.numbers.size, dtype=np.float64))
        slices = Places()
        for leaf in leaves(counted):
            # (a list may be empty)
            first = int(np.min(leaf.value, initial=self.numbers.size))
            slices[leaf.path] = slice(first, first + int(np.size(leaf.value)))
        return slices

    def _run(self, numbers: VectorK, max_steps: int) -> Float[Array, " out"]:
        scene = self._like.unpack(numbers[:-2])
        (rtol, max_step) = numbers[-2:]
        limits = {
            "max_step": max_step,
            "max_steps": max_steps,
            "max_events": self.max_events,
        }
        result = simulate(scene, solver=self.solver, rtol=rtol, **limits)
        values = measure_all(result, self._asked, arrays=True)
        ends = np.cumsum([0, *(value.size for value in values)]).tolist()
        wheres = [
            a if value.ndim == 0 else slice(a, b)
            for a, b, value in zip(ends, ends[1:], values, strict=False)
        ]
        self._spans = list(zip(self.metrics, wheres, strict=True))
        counts = jnp.stack(
            [jnp.asarray(n, jnp.float64) for n in (result.code, *result.record.stats)]
        )
        return jnp.concatenate([*(jnp.ravel(value) for value in values), counts])

    def _subject(self, what: str, max_steps: int) -> tuple:
        """Key of the compiled programs."""
        asked = tuple(map(identity_of, self._asked))
        return what, self._like, asked, self.solver, max_steps, self.max_events

    def _compile(self) -> Program:
        numbers = self.inputs(self.numbers, self.rtol)
        run = functools.partial(self._run, max_steps=self.max_steps)
        subject = self._subject("prepared", self.max_steps)
        program = program_of(run, numbers, subject=subject, longest=LONGEST)

        def spans() -> list[tuple[str, int | slice]]:
            if not self._spans:
                jax.eval_shape(run, numbers)
            return self._spans

        self._spans = kept(self._subject("spans", self.max_steps), spans)
        return program

    def vector(self, values: Values = None) -> Array:
        """The numbers with some of them changed, by path (`{"initial.omega": 18.0}`),
        or such a vector as it is.

        Raises `InputError` for a path that is not there, and for values of another
        shape.
        """
        if values is None:
            return self.numbers
        if isinstance(values, Mapping):
            numbers = np.array(self.numbers)
            for path, value in values.items():
                place = self._place(path)
                try:
                    numbers[place] = value
                except (ValueError, TypeError):
                    numbers[place] = self._read(path, value, place)
            return numbers
        if np.shape(values) != self.numbers.shape:
            what = f"{shown(values)} does not fit here"
            raise input_error(
                "values",
                what,
                f"give values by path, or a vector of {self.numbers.size} numbers",
            )
        return values

    def _place(self, path: str) -> slice:
        try:
            return self.places[path]
        except KeyError:
            # raises what is wrong with an unknown path
            with_inputs(self.scene, {str(path): 0.0})
            raise input_error(
                path, "is absent in the prepared scene", "prepare a scene that has it"
            ) from None

    def _read(self, path: str, value: Any, place: slice) -> np.ndarray:
        """A value that is no number or list of numbers: texts with a unit."""
        size = place.stop - place.start
        try:
            return np.broadcast_to(
                np.asarray(numbers_in_si(self.scene, path, value), np.float64), size
            )
        except (ValueError, TypeError) as error:
            if isinstance(error, InputError):
                raise
            numbers = "one number" if size == 1 else f"one number or a list of {size}"
            raise input_error(
                path, f"{shown(value)} does not fit here", f"give {numbers}"
            ) from None

    @explained
    def __call__(
        self, values: Values = None, *, rtol: float | None = None
    ) -> PreparedResult:
        """Runs with these numbers (and another tolerance); what a run of `simulate`
        would raise is in `code`.

        Values are taken as they are: `check` looks at them first.
        """
        require_own_process()
        numbers = self.inputs(self.vector(values), self.rtol if rtol is None else rtol)
        out = np.asarray(self.program.call(numbers))
        *_, code, accepted, rejected, retaken, events, segments = out.tolist()
        if code == Code.STEP_LIMIT and self.max_steps < _MOST_STEPS:
            # the record was too short for these numbers: a longer one, from now on
            self.max_steps = 4 * self.max_steps
            self.program = self._compile()
            return self(values, rtol=rtol)
        values = {
            name: out[where].item() if type(where) is int else out[where]
            for name, where in self._spans
        }
        counts = int(accepted), int(rejected), int(retaken), int(events), int(segments)
        return PreparedResult(ByName(values), int(code), *counts)

    def inputs(self, numbers: Array, rtol: float) -> np.ndarray:
        """What its programs are called with: all numbers of the scene, the tolerance
        and the longest step."""
        whole = np.empty(numbers.size + 2)
        whole[:-2] = numbers
        whole[-2] = rtol
        whole[-1] = self.max_step
        return whole

    def gradient(self, values: Values = None) -> np.ndarray:
        """Derivatives of all metrics with respect to all numbers, (metrics, k), by one
        reverse pass for each metric.

        NaN for a metric that is infinite, and where the run fails (`code` of a call
        says how). Compiles at the first call. Its steps resolve the derivatives as
        well: a run takes up to twice as many as without.
        """
        numbers = self.inputs(self.vector(values), self.rtol)
        while True:
            if self._slope is None:
                slopes = functools.partial(self._slopes, max_steps=self._slope_steps)
                subject = self._subject("gradient", self._slope_steps)
                self._slope = program_of(
                    slopes, numbers, subject=subject, longest=_LONGEST_SLOPES
                )
            *slope, code = np.asarray(self._slope.call(numbers))
            if code != Code.STEP_LIMIT or self._slope_steps >= _MOST_STEPS:
                return np.reshape(slope, (-1, self.numbers.size))
            # a longer record, from now on
            self._slope_steps = 4 * self._slope_steps
            self._slope = None

    def _slopes(self, numbers: VectorK, max_steps: int) -> Float[Array, " out"]:
        """All derivatives in one vector, and the code of the run."""

        def run(x: Array) -> tuple[Array, Array]:
            out = self._run(x, max_steps)
            return out[:-_COUNTS], out[-_COUNTS]

        values, back, code = jax.vjp(run, numbers, has_aux=True)
        there = jnp.isfinite(values)[:, None]
        eye = jnp.where(there, jnp.eye(values.size), 0.0)
        if values.size < 3:
            rows = jnp.stack([back(row)[0][:-2] for row in eye])
        else:
            rows = jax.lax.map(lambda row: back(row)[0][:-2], eye)
        return jnp.append(jnp.where(there & (code == 0), rows, jnp.nan), code)

    def check(self, values: Values = None) -> Scene:
        """The scene with these numbers. Raises `InputError` with all its errors."""
        scene = self.scene_with(values)
        check_scene(scene)
        return scene

    def scene_with(self, values: Values = None) -> Scene:
        """The scene with these numbers, not checked."""
        return dataclasses.replace(
            self._like.unpack(self.vector(values)), limits=self.scene.limits
        )

    def accuracy(self, values: Values = None) -> PreparedAccuracy:
        """Estimated errors of the metrics of a run with these numbers, by a second run
        of the same program at the tolerance of `Result.accuracy`:
        `simbrake.results.PreparedAccuracy`.

        Events are counted in both runs, not compared; nothing is compiled. Of walls the
        errors of the layers are added, from a third run with finer layers; its program
        is compiled at the first call.
        """
        first = self(values)
        found = of_answers(first, self(values, rtol=second_rtol(self.rtol)))
        if found.problem or not self.scene.network.walls:
            return found
        if self._finer is None:
            limits = {"max_step": self.max_step, "max_events": self.max_events}
            cuts = cuts_of(simulate(self.scene, rtol=self.rtol, **limits, throw=False))
            self._finer = prepare(
                with_finer_layers(self.scene, cuts),
                self._asked,
                rtol=self.rtol,
                **limits,
            )
        heat = self.scene.network
        finer = self._finer.scene.network
        numbers = np.asarray(self.vector(values))
        given = {
            path: np.squeeze(numbers[place])[None]
            for path, place in self.places.items()
        }
        finer_numbers = finer_values(heat, finer, given)
        answer = self._finer({path: array[0] for path, array in finer_numbers.items()})
        return with_layers(found, first, answer)

    def result(self, values: Values = None) -> Result:
        """The whole `Result` of a run with these numbers, by `simulate`."""
        scene = self.check(values)
        limits = {
            "max_step": self.max_step,
            "max_steps": self.max_steps,
            "max_events": self.max_events,
        }
        return simulate(
            scene, solver=self.solver, rtol=self.rtol, throw=False, **limits
        )


@explained
def prepare(
    scene: Scene,
    metrics: Sequence[Metric] = ("slip_onset_time", "full_slip_time", "stopping_time"),
    *,
    solver: Solver | None = None,
    rtol: float = 1e-10,
    max_step: float = np.inf,
    max_steps: int | None = None,
    max_events: int = 10_000,
) -> Prepared:
    """Compiles a scene's run for many calls with other numbers, each some tens of
    microseconds: loops, live displays.

        run = simbrake.prepare(scene, ["stopping_time"])
        run({"initial.omega": 18.0}).metrics["stopping_time"]
        run.gradient({"initial.omega": 18.0})[0, run.places["brake.pulley.inertia"]]

    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number
      or an array
    - `solver`, `rtol`, `max_step` (s), `max_events`: as for `simulate`, chosen once for
      the scene given
    - `max_steps`: step attempts to allocate; by default what the scene's own run needs
      and a quarter more. A run that needs more is compiled again with more

    Raises `InputError` for errors of the scene or metrics, and `SimulationError` where
    the scene's own run fails.

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> prepared.places["initial.omega"]
        slice(19, 20, None)
    """
    scene = checked(scene)
    check_metrics(scene, metrics)
    solver = solver_of(scene, solver)
    limits = {"max_step": max_step, "max_events": max_events}
    run = functools.partial(simulate, scene, solver=solver, rtol=rtol, **limits)
    return Prepared(
        scene, metrics, solver, rtol, max_steps or room_for(run()), **limits
    )
