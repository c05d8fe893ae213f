"""Running a scene: from a scene to a result, long runs in stretches."""

import functools
import logging
import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._base._arguments import explained
from .._base._compiling import (
    LONGEST,
    Program,
    TieredProgram,
    as_one_function,
    megabytes,
    program_of,
    run_device,
)
from .._base._faults import Fault, InputError, Issues, input_error
from .._base._jacobian import with_precompiled_jacobian
from .._base._packing import Packing, pack
from .._base._part import Whole, faults_of_whole, is_traced
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
from ..hybrid.arrays import Array, NumberOrArray, VectorK
from ..hybrid.struct import with_value_at
from ..hybrid.system import flatten
from ..outputs.extremes import watched_metrics
from ..outputs.log import SimulationError
from ..outputs.metrics import METRICS, Peak
from ..parts.at_start import read_by_linings
from ..parts.scene import Scene
from ..parts.scene_checks import checked
from ..physics.assemble import assemble
from ..thermal.heat import node_names
from .choice import stiffness
from .result import Result, RunLimits

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
    rtol: NumberOrArray,
    max_step: NumberOrArray = np.inf,
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
DIFFERENTIATED = 2


def room_for(result: Result, *, differentiated: bool = False) -> int:
    """Step attempts to allow in runs like this one, a power of two: programs round
    differently, and need a few more."""
    count = int(result.record.count) * (DIFFERENTIATED if differentiated else 1)
    return 1 << math.ceil(math.log2(1.25 * count + 48))


@explained
def simulate(
    scene: Scene,
    *,
    solver: Solver | None = None,
    rtol: NumberOrArray = 1e-10,
    max_step: NumberOrArray = np.inf,
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
    limits_given = rtol, max_step, max_steps, max_events
    scene, solver = checked_run(scene, solver, *limits_given)
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


def checked_run(
    scene: Scene,
    solver: Solver | None,
    *limits: Any,
    also: Callable[[Scene], object] | None = None,
) -> tuple[Scene, Solver]:
    """The checked scene, and its solver. Raises `InputError` with all errors of both
    and of the limits.

    - `also`: another check of the scene, if it has no errors of its own
    """
    issues = Issues()
    issues.attempt(check_limits, *limits)
    if solver is not None:
        issues.attempt(solver_of, scene, solver)
    whole = issues.attempt(checked, scene)
    if whole is not None and also is not None:
        issues.attempt(also, whole)
    issues.report()
    assert whole is not None
    return whole, solver_of(whole, solver)


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
