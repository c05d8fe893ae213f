"""The evaluator under all studies: a scene's run as a function of numbers, with
derivatives and result codes.

    x → place(scene, x, given) → run → find(result, given)

`PointEvaluator` takes one point at a time, with the Jacobian; `run_chunk` many,
without. A program is compiled once for scenes of one structure and kept; new numbers
never re-trace. A run whose record was too short is repeated with a longer one.
"""

import copy
import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._compiling import LONGEST, Compiled, Program, megabytes, program_of
from .._base._faults import Fault, InputError, Issues
from .._base._packing import Packing, pack
from .._base._part import Leaf
from .._base._quantity import Quantity, unit_suffix
from .._base._store import MEMORY, UnknownStructureError, canonical, trace_anew
from ..hybrid import LANDED, Code, Record, Rodas5P
from ..hybrid.arrays import Array, numpy_of
from ..outputs.judgement import coded, judge_of_many
from ..outputs.log import FAILURES
from ..outputs.metrics import HOLDING, METRICS, identity_of, metric_names
from ..outputs.probe import ends_driven
from ..parts.scene import Scene, faults, require_scene
from ..runs.edit import Inputs, entry_of, numbers_in_si, with_inputs, with_values
from ..runs.measure import Metric, measure, measure_all, name_of
from ..runs.result import Result
from ..runs.simulate import (
    Solver,
    room_for,
    simulate,
    simulate_lane,
    solver_name,
    solver_of,
    step_limits,
)

#: how a scene is integrated, as `simulate` takes it
#: arrays over runs, by name
Columns: TypeAlias = dict[str, np.ndarray]

#: the longest record that a run is repeated with, unless the caller allows more
_LONGEST = 16384
#: step attempts that suffice for most stops without heat: less to write and to measure
#: than the first limit of one run
_SHORT = 128
#: rows of all records of a chunk together, of runs as a whole (with some hundred
#: columns half a gigabyte) and of events
_ROWS = 2**19
_MANY_ROWS = 2**22
#: runs side by side on a CPU
LANES = 64
#: points whose results are cached
_REMEMBERED = 4
#: tolerance at which rounding begins to govern
_FINEST = 1e-12
#: above this tolerance a tenth of it does not show the error: of 1,500 derivatives at
#: 1e-5 to 1e-8 of a hot stop 2 to 14 % had more than three times the error stated so,
#: 0.8 % at most beside `_FINEST`
_LOOSE = 1e-9
#: runs named in one error
_NAMED = 5


def _moved(record: Record) -> Array:
    """Whether the pulley turned at the start of a row or in between."""
    xp = numpy_of(record.rows.t)
    used = xp.arange(record.rows.t.shape[0], dtype=np.int32) <= record.count
    states = record.states
    return xp.any(used & ((states.omega != 0.0) | (states.phi != states.phi[0])))


def _sequence(record: Record) -> Array:
    """A number that runs with the same modes after the same kinds of events in the same
    order share."""
    xp = numpy_of(record.rows.t)
    rows = record.rows
    n = rows.t.shape[0]
    events = (xp.arange(n, dtype=np.int32) < record.count) & (rows.kind >= LANDED)
    after = xp.concatenate([rows.mode[1:], rows.mode[-1:]]).astype(np.uint32)
    odd = (2 * np.arange(after.shape[1]) + 1).astype(np.uint32) * np.uint32(2654435761)
    what = xp.sum(after * odd, axis=1, dtype=np.uint32) + (rows.kind + 11).astype(
        np.uint32
    )
    what = what * np.uint32(2654435761)
    order = xp.cumsum(events).astype(np.uint32) * np.uint32(2246822519) | np.uint32(1)
    mixed = xp.sum(xp.where(events, (what ^ (what >> 15)) * order, 0), dtype=np.uint32)
    return (mixed >> 1).astype(np.int32)


_CLOSURE = "energy.closure"
#: of every run besides its metrics
ABOUT: dict[str, Callable[[Result], Any]] = {
    "code": lambda r: r.record.code,
    "band": lambda r: r.record.mode_end.band,
    "inner": lambda r: r.record.mode_end.slides,
    "turn": lambda r: 1 if r.record.mode_end.turn is None else r.record.mode_end.turn,
    "moved": lambda r: _moved(r.record),
    "driven": lambda r: ends_driven(r.record),
    "judged": lambda r: coded(judge_of_many(r.record)),
    "steps": lambda r: r.record.stats.accepted,
    "rejected": lambda r: r.record.stats.rejected,
    "retaken": lambda r: r.record.stats.retaken,
    "segments": lambda r: r.record.stats.segments,
    "sequence": lambda r: _sequence(r.record),
    _CLOSURE: lambda r: r.energy["closure"],
}

#: numbers x (k,) and numbers that are given besides → the scene with them
Place: TypeAlias = Callable[[Scene, Any, Any], Scene]
#: a result (the scene, where nothing is run) and numbers given → values (m,) and
#: whatever else is wanted of it
Find: TypeAlias = Callable[[Any, Any], tuple[Any, Any]]


def failure_name(code: int) -> str:
    """A result code in a word."""
    return FAILURES[code][0] if code in FAILURES else f"code {code}"


class Paths(NamedTuple):
    """Numbers of a scene as one vector: their paths, and the shape of each."""

    names: tuple[str, ...]
    shapes: tuple[tuple[int, ...], ...]

    @classmethod
    def each(cls, names: Iterable[str]) -> "Paths":
        """One number for each path; for a path of a list it counts for all entries."""
        return cls(tuple(names), tuple(() for _ in names))

    @classmethod
    def of(cls, chosen: Iterable[Leaf]) -> "Paths":
        """All entries of these parameters of a scene."""
        shapes = {leaf.path: np.shape(leaf.value) for leaf in chosen}
        return cls(tuple(shapes), tuple(shapes.values()))

    @property
    def entries(self) -> list[tuple[str, tuple[int, ...]]]:
        """Path and index of every number, `()` of one that is no list."""
        return [
            (name, i)
            for name, shape in zip(self.names, self.shapes, strict=True)
            for i in np.ndindex(shape)
        ]

    @property
    def spans(self) -> list[slice]:
        """Where each path lies in the vector."""
        ends = np.cumsum([0, *(math.prod(shape) for shape in self.shapes)]).tolist()
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    def values(self, x: Array) -> dict[str, Array]:
        """The numbers by path."""
        parts = zip(self.names, self.shapes, self.spans, strict=True)
        return {name: x[span].reshape(shape) for name, shape, span in parts}

    def __call__(self, scene: Scene, x: Array, given: object = None) -> Scene:
        return with_values(scene, self.values(x))


def named_runs(runs: Sequence[int] | np.ndarray) -> str:
    """`(run 3)`, `(runs 3, 4, 5, 6, 7 and 12 more)`."""
    more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
    return (
        f"({'run' if len(runs) == 1 else 'runs'} "
        f"{', '.join(str(i) for i in runs[:_NAMED])}{more})"
    )


def faults_of_runs(scenes: Iterable[tuple[int, Scene]]) -> list[Fault]:
    """Errors of the scenes of runs, each reported once, with the runs that have it."""
    seen: dict[tuple[str, str], tuple[Fault, list[int]]] = {}
    for i, scene in scenes:
        for fault in faults(scene):
            seen.setdefault((fault.path, fault.hint), (fault, []))[1].append(i)
    return [
        Fault(fault.path, f"{fault.problem} {named_runs(runs)}", fault.hint)
        for fault, runs in seen.values()
    ]


def numbers_of(chosen: Iterable[Leaf]) -> np.ndarray:
    """The numbers of parameters as one vector, in the order of `Paths.of`."""
    return np.concatenate(
        [np.ravel(np.asarray(leaf.value, np.float64)) for leaf in chosen]
    )


def name_of_entry(path: str, index: tuple[int, ...]) -> str:
    """Path of an entry of a list, `path` itself for the index `()`."""
    return f"{path}[{', '.join(map(str, index))}]" if index else path


def as_metrics(metrics: Metric | Sequence[Metric]) -> list[Metric]:
    """One metric, or several, as a list."""
    return [metrics] if isinstance(metrics, str) or callable(metrics) else list(metrics)


def own_part(scene: Scene, solver: Solver | None, metrics: Sequence[Metric]) -> str:
    """Name of a class or function that is the user's own, or of a library that simbrake
    does not know; else empty."""
    try:
        canonical((scene, solver, [*map(identity_of, metrics)]))
    except UnknownStructureError as error:
        return str(error)
    return ""


class Box(NamedTuple):
    """Numbers that are free within bounds (k,), and unknowns `z` in 0…1 in their place,
    linear or logarithmic."""

    paths: Paths
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    logarithmic: np.ndarray

    @property
    def _scale(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower bounds and ratios of the bounds where unknowns are logarithmic."""
        low = np.where(self.logarithmic, self.low, 1.0)
        return low, np.where(self.logarithmic, self.high / low, np.e)

    def up(self, z: Any, xp: ModuleType = np) -> Any:
        """The numbers for unknowns; `xp`: `jax.numpy` for traced ones."""
        low, ratio = self._scale
        return xp.where(
            self.logarithmic, low * ratio**z, self.low + (self.high - self.low) * z
        )

    def down(self, x: np.ndarray) -> np.ndarray:
        """The unknowns for numbers."""
        low, ratio = self._scale
        log = np.log(np.where(self.logarithmic, x / low, 1.0)) / np.log(ratio)
        return np.where(self.logarithmic, log, (x - self.low) / (self.high - self.low))

    def slope(self, x: Any, xp: ModuleType = np) -> Any:
        """`dx/dz`."""
        return xp.where(
            self.logarithmic, x * np.log(self._scale[1]), self.high - self.low
        )


def array_in_si(
    scene: Scene, path: str, value: Any, issues: Issues
) -> np.ndarray | None:
    """Values of a number in SI; `None` where they are none. Adds what is wrong with
    them."""
    try:
        return np.array(numbers_in_si(scene, path, value), np.float64)
    except InputError as error:
        issues += error.faults
    except (TypeError, ValueError):
        hint = "numbers in SI, or texts with units"
        issues.add(path, "its values are not numbers", hint)
    return None


def bounds_of(
    scene: Scene,
    path: str,
    pair: Any,
    issues: Issues,
    about: Quantity | None,
    shape: tuple[int, ...] = (),
) -> np.ndarray | None:
    """Bounds (2, …) of a number in SI from (low, high); `None` where they are none.
    Adds what is wrong with them."""
    try:
        pair = numbers_in_si(scene, path, pair)
        low, high = (np.broadcast_to(np.asarray(end, float), shape) for end in pair)
    except InputError as error:
        issues += error.faults
        return None
    except (TypeError, ValueError):
        hint = f"(low, high), numbers or lists of {math.prod(shape)}"
        issues.add(path, f"{pair!r} are not bounds", hint)
        return None
    ends = np.stack([low, high])
    if not np.all(np.isfinite(ends) & (low < high)):
        what = f"the bounds {pair!r} are out of range"
        issues.add(path, what, "finite, low < high")
        return None
    if about is not None and not np.all(about.admits(ends)):
        worst = ends[~about.admits(ends)][0]
        what = f"the bound {worst:g}{unit_suffix(about.unit)} is out of range"
        issues.add(path, what, f"must be {about.range}")
    return ends


def box_of(
    scene: Scene,
    bounds: Mapping[str, Any],
    issues: Issues,
    *,
    each: bool = False,
    starts: Mapping[str, float | str] | None = None,
    decades: float = np.inf,
) -> Box:
    """The numbers at paths with bounds (low, high), by default from the scene's values;
    adds what is wrong with them.

    - `each`: a field with many entries is free in every one of them; else one number
      counts for all of them
    - `decades`: ratio of the bounds above which unknowns are logarithmic
    """
    require_scene(scene)
    known = Inputs(scene)
    shapes = dict[str, tuple[int, ...]]()
    rows = []
    for path, pair in bounds.items():
        field, index = entry_of(path, known)
        leaf = known.get(field)
        if issues.attempt(with_inputs, scene, {path: 0.0}) is None:
            continue
        start = (starts or {}).get(path)
        value: Any = issues.attempt(numbers_in_si, scene, path, start)
        if value is None and leaf is not None:
            value = np.asarray(leaf.value, float)[... if index is None else index]
            if not each and np.size(value):
                value = value.flat[0] if np.ptp(value) == 0 else None
        shapes[path] = () if value is None else np.shape(value)
        about = None if leaf is None else leaf.about
        ends = bounds_of(scene, path, pair, issues, about, shapes[path])
        if ends is None:
            continue
        if value is None:
            hint = "give its start value"
            issues.add(path, "has no one value in the scene", hint)
            value = np.nan
        elif not np.all((value >= ends[0]) & (value <= ends[1])):
            what = f"the start {value} is outside the bounds {pair!r}"
            issues.add(path, what, "give a start inside them")
        rows.append([np.ravel(values) for values in (*ends, value)])
    issues += [
        Fault(path, "is free twice", f"as {old} is")
        for path, old in known.twice(shapes).items()
    ]
    low, high, start = [
        np.concatenate(column) for column in zip(*rows, strict=True)
    ] or [np.zeros(0)] * 3
    paths = Paths(tuple(shapes), tuple(shapes.values()))
    return Box(
        paths,
        low,
        high,
        start,
        (low > 0) & (high / np.where(low > 0, low, 1.0) > decades),
    )


class Metrics(NamedTuple):
    """Metrics of a result as one vector (m,)."""

    asked: tuple[Metric, ...]

    def __call__(self, result: Result, given: object = None) -> tuple[Array, None]:
        return jnp.stack(measure_all(result, self.asked)), None


class ProgramKey(NamedTuple):
    """What a program of one point depends on, besides the structure of its numbers.

    - `solver`: `None` where nothing is run
    - `reverse`: derivatives by as many passes as there are values, else by as many as
      there are numbers;  `singly`: one pass at a time, which takes less memory and
      compiles faster
    """

    place: Place
    find: Find
    solver: Solver | None
    max_steps: int
    reverse: bool
    singly: bool


class Evaluation(NamedTuple):
    """Values (m,) at a point and their derivatives (m, k), the code of the run, and
    what else `find` gave."""

    values: np.ndarray
    jacobian: np.ndarray
    code: int
    more: Any


@functools.lru_cache(maxsize=64)
def _program(asked: ProgramKey) -> Compiled:
    def answer(x: Array, scene: Scene, given: Any, rtol: Array) -> tuple[Array, Any]:
        outcome = asked.place(scene, x, given)
        code = jnp.zeros((), jnp.int32)
        if asked.solver is not None:
            outcome = simulate(
                outcome, solver=asked.solver, rtol=rtol, max_steps=asked.max_steps
            )
            code = outcome.code
        values, more = asked.find(outcome, given)
        return values, (values, code, more)

    def at_once(x: Array, *rest: Any) -> tuple[Any, ...]:
        jacobian, values = (jax.jacrev if asked.reverse else jax.jacfwd)(
            answer, has_aux=True
        )(x, *rest)
        return jacobian, *values

    def along(x: Array, direction: Array, *rest: Any) -> tuple[Any, ...]:
        """`direction` is of the values (reverse) or of the numbers (forward)."""
        if asked.reverse:
            _, back, values = jax.vjp(lambda x: answer(x, *rest), x, has_aux=True)
            return back(direction)[0], *values
        _, slope, values = jax.jvp(
            lambda x: answer(x, *rest), (x,), (direction,), has_aux=True
        )
        return slope, *values

    metrics = (
        tuple(map(identity_of, asked.find.asked))
        if isinstance(asked.find, Metrics)
        else ()
    )
    return Compiled(
        along if asked.singly else at_once, subject=("evaluate", asked, metrics)
    )


@functools.partial(Compiled, static_argnames=("find",))
def _measured(result: Result, *, find: Find) -> Array:
    return find(result, None)[0]


def values_of(result: Result, find: Find) -> np.ndarray:
    """Values of a concrete result, by one program for every power of two of its
    length."""
    return np.asarray(
        _measured(
            dataclasses.replace(result, record=result.record.compact()), find=find
        )
    )


@explained
class PointEvaluator:
    """A scene's run as a function of a vector of numbers.

    - `place`: puts the parameters into the scene, as `Paths`
    - `find`: takes metrics from the result, as `Metrics`
    - `given`: numbers that both take besides, not differentiated
    - `run`: whether `find` is of a run, not of the scene
    - `size`: how many values `find` gives, where derivatives are taken `singly`
    - `reverse`, `singly`: see `ProgramKey`
    - `solver`, `rtol`, `max_steps`: as for `simulate`, the solver chosen once for the
      scene given

    `runs` counts the points evaluated.
    """

    def __init__(
        self,
        scene: Scene,
        place: Place,
        find: Find,
        *,
        given: Any = None,
        run: bool = True,
        size: int = 0,
        reverse: bool = False,
        singly: bool = False,
        solver: Solver | None = None,
        rtol: float = 1e-10,
        max_steps: int | None = None,
    ) -> None:
        if own_part(scene, solver, find.asked if isinstance(find, Metrics) else ()):
            trace_anew()
        self.scene = scene
        self.place = place
        self.find = find
        self.given = given
        self.rtol = rtol
        self.solver = solver_of(scene, solver) if run else None
        self.limits = step_limits(scene, max_steps) if run else (0,)
        self._asked = ProgramKey(
            place, find, self.solver, self.limits[0], reverse, singly
        )
        self._size = size
        self._level = 0
        self.runs = 0
        self._known: dict[bytes, Evaluation] = {}

    def result(self, scene: Scene | None = None, **options: Any) -> Result:
        """The whole result of a run of the scene, or of another one like it, by
        `simulate`, which repeats it itself."""
        return simulate(
            self.scene if scene is None else scene,
            solver=self.solver,
            rtol=self.rtol,
            **options,
        )

    def like(self, result: Result) -> None:
        """Takes the length of this run for that of the others, which are
        differentiated."""
        first = room_for(result, differentiated=True)
        longer = (first * 4**i for i in range(1, 16) if first * 4 ** (i - 1) < _LONGEST)
        self.limits = (first, *longer)
        self._level = 0

    def __call__(
        self, x: np.ndarray, given: Any = None, scene: Scene | None = None
    ) -> Evaluation:
        """Values and Jacobian at a point, also of another scene of this structure; the
        last few points are cached, except those with something `given`."""
        key = x.tobytes() if given is None else None
        if key in self._known:
            return self._known[key]
        self.runs += 1
        given = self.given if given is None else given
        while (
            evaluation := self._at(x, given, scene)
        ).code == Code.STEP_LIMIT and self._level < len(self.limits) - 1:
            self._level += 1  # for the points to come as well
        if key is not None:
            self._known[key] = evaluation
            if len(self._known) > _REMEMBERED:
                del self._known[next(iter(self._known))]
        return evaluation

    def finer(self) -> "PointEvaluator":
        """The same at another tolerance: what that changes is an estimate of the error
        by integration in time.

        At a tenth of the tolerance; of a loose one at the tightest, as many steps are
        then as short as events make them, and a tenth would take the same again. Where
        rounding would govern, at ten times the tolerance, which is the more cautious
        estimate.
        """
        other = copy.copy(self)
        other._known = {}
        other.rtol = (
            _FINEST
            if self.rtol > _LOOSE
            else self.rtol * (0.1 if self.rtol > _FINEST else 10.0)
        )
        return other

    def _at(self, x: np.ndarray, given: Any, scene: Scene | None) -> Evaluation:
        program = _program(self._asked._replace(max_steps=self.limits[self._level]))
        where = self.scene if scene is None else scene
        rest = where, given, np.asarray(self.rtol, np.float64)
        if not self._asked.singly:
            jacobian, values, code, more = program(x, *rest)
            return Evaluation(np.asarray(values), np.asarray(jacobian), int(code), more)
        directions = np.eye(self._size if self._asked.reverse else x.size)
        slopes = []
        for direction in directions:
            slope, values, code, more = program(x, direction, *rest)
            slopes.append(np.asarray(slope))
            # a run that ended early has no derivatives: never a number that looks like
            # one
            if int(code) != 0:
                slopes = [np.full_like(slope, np.nan)] * len(directions)
                break
        jacobian = np.stack(slopes, axis=0 if self._asked.reverse else 1)
        return Evaluation(np.asarray(values), jacobian, int(code), more)


# --- many points --------------------------------------------------------------------


class Job(NamedTuple):
    """Properties that all runs of a chunk share. Structure and metrics are compiled in,
    numbers are not.

    - `size`: how many runs a chunk has at most, 0: each is made by itself
    - `room`: how many instants of events a run may have, where only these are recorded
    """

    scene: Scene
    paths: Paths
    metrics: tuple[Metric, ...]
    solver: Solver
    rtol: float
    max_steps: int
    size: int
    room: int

    @property
    def recorded(self) -> bool:
        """Whether a metric looks back at the steps of a run: a user's function, the
        holding reserve, or a mean."""
        return any(
            not isinstance(metric, str) or metric == HOLDING or _is_if_asked(metric)
            for metric in self.metrics
        )

    @property
    def measured(self) -> tuple[Metric, ...]:
        """Metrics that its program finds: whichever are wanted, all that cost next to
        nothing, so that there is one program for any of them; of maxima, and of a
        user's own, those wanted alone."""
        own = (
            name
            for name in default_metrics(self.scene)
            if isinstance(identity_of(name), str)
        )
        return tuple(dict.fromkeys([*own, *self.metrics]))

    @property
    def lanes(self) -> int:
        """Runs side by side on a CPU: of those that are short, explicit, and of one
        rigid or elastic mechanism.

        Others become slower: long runs reach their events at too different times,
        implicit steps of many lanes leave the fast memory, and the changes of mode of
        staged brakes and of single linings are more work side by side.
        """
        brake = self.scene.brake
        alone = (
            self.recorded
            or isinstance(self.solver, Rodas5P)
            or brake.in_series
            or brake.resolved
        )
        return 1 if alone or self.max_steps > _SHORT else min(LANES, self.size)

    def fitting(self) -> "Job":
        """The same with chunks whose records fit."""
        most = _ROWS // self.max_steps if self.recorded else _MANY_ROWS // self.room
        return self._replace(size=max(1, min(self.size, most)))


def limits_of_many(
    scene: Scene, solver: Solver, max_steps: int | None
) -> tuple[int, ...]:
    """Limits of the step attempts of many runs, tried in turn; long records cost time
    and memory, used or not."""
    limits = step_limits(scene, max_steps)
    # with heat a long duty or an implicit method needs more as a rule, and a limit too
    # low compiles in vain
    long = scene.heated and (isinstance(solver, Rodas5P) or limits[0] > 8 * _SHORT)
    return limits if max_steps or long else (_SHORT, *limits)


def is_maximum(metric: Metric) -> bool:
    """Whether a metric is a maximum over the run."""
    return isinstance(metric, str) and metric in METRICS and METRICS[metric].greatest


def _is_if_asked(metric: str) -> bool:
    return metric in METRICS and METRICS[metric].if_asked


def default_metrics(scene: Scene) -> tuple[str, ...]:
    """Everything that a scene has but maxima, which cost half a run more, and what a
    run has only if it is asked for."""
    return tuple(
        name
        for name in metric_names(scene)
        if not (is_maximum(name) or _is_if_asked(name))
    )


def _integrate(
    numbers: Array, *, like: Packing, job: Job, metrics: Sequence[Metric], lanes: int
) -> Array:
    """Columns of a chunk (names, runs), its first runs by groups of lanes."""
    scene, rows, rtol, count = like.unpack(numbers)
    maxima = tuple(
        metric for metric in metrics if isinstance(metric, str) and is_maximum(metric)
    )
    others = [metric for metric in metrics if metric not in maxima]

    def one(x: Array) -> Array:
        varied = job.paths(scene, x)
        if lanes == 1 or job.recorded:
            result = simulate(
                varied, solver=job.solver, rtol=rtol, max_steps=job.max_steps
            )
            values = measure_all(result, metrics)
        else:
            result, tops = simulate_lane(
                varied, job.solver, rtol, job.max_steps, job.room, maxima
            )
            found = dict(zip(others, measure_all(result, others), strict=True)) | tops
            values = [found[metric] for metric in metrics]
        about = [find(result) for find in ABOUT.values()]
        return jnp.stack(
            [jnp.asarray(value, jnp.float64) for value in (*about, *values)]
        )

    def group(i: Array | int) -> Array:
        if lanes == 1:
            return one(jax.lax.dynamic_index_in_dim(rows, i, keepdims=False))[:, None]
        return jax.vmap(one, out_axes=1)(
            jax.lax.dynamic_slice_in_dim(rows, i * lanes, lanes)
        )

    if lanes == job.size:
        return group(0)

    def body(carry: tuple[Array, Array]) -> tuple[Array, Array]:
        i, table = carry
        return i + 1, jax.lax.dynamic_update_slice_in_dim(table, group(i), i * lanes, 1)

    begin = jnp.asarray(0, jnp.int32), jnp.zeros((len(ABOUT) + len(metrics), job.size))
    return jax.lax.while_loop(lambda carry: carry[0] * lanes < count, body, begin)[1]


def _integrator(job: Job, numbers: Array, like: Packing, device: Any) -> Program:
    """The compiled integration of a chunk with this layout of parameters; one thread
    compiles, the others wait.

    On a CPU groups of lanes follow one another: more than a few dozen lanes gain
    nothing there, and wait for the slowest of more runs.
    """

    metrics = job.measured
    lanes = job.lanes if device.platform == "cpu" else job.size
    # the parameters of the scene are in the vector: a cached program holds none of them
    without = job._replace(scene=None)
    run = functools.partial(
        _integrate, like=like, job=without, metrics=metrics, lanes=lanes
    )
    asked = tuple(map(identity_of, metrics))
    subject = ("chunk", like, job.paths, asked, job.solver, *job[5:], lanes)

    def make() -> Program:
        return program_of(run, numbers, subject=subject, longest=LONGEST)

    return MEMORY.get((*subject, device), make, megabytes)


def run_chunk(job: Job, rows: np.ndarray, device: Any = None) -> Columns:
    """Runs the points `rows` (points, numbers), `job.size` at most, or each by itself.

    Gives an array over the points for every name in `ABOUT`, every metric, and
    `method`. What a single run would raise is not raised: failures are in `code`.
    """
    make = _one_by_one if job.size == 0 else _side_by_side
    found = make(job, rows, device)
    whole = ABOUT.keys() - {_CLOSURE}
    columns = {
        name: found[name].astype(np.int32 if name in whole else np.float64)
        for name in [*ABOUT, *map(name_of, job.metrics)]
    }
    return columns | {
        "method": np.full(len(rows), solver_name(job.solver), dtype="<U32")
    }


def _side_by_side(job: Job, rows: np.ndarray, device: Any) -> Columns:
    count = len(rows)
    device = device or jax.devices()[0]
    filled = rows[np.minimum(np.arange(job.size), count - 1)]
    numbers, like = pack((job.scene, filled, job.rtol, np.asarray(count, np.int32)))
    with jax.default_device(device):
        table = jax.block_until_ready(
            _integrator(job, numbers, like, device).call(numbers)
        )
    names = [*ABOUT, *map(name_of, job.measured)]
    return dict(zip(names, np.asarray(table)[:, :count], strict=True))


def _one_by_one(job: Job, rows: np.ndarray, device: Any) -> Columns:
    """The same by the programs of single runs, which a scene that ran before has on
    disk."""
    names = [*ABOUT, *job.metrics]

    def values(row: np.ndarray) -> list[float]:
        result = simulate(
            job.paths(job.scene, row),
            solver=job.solver,
            rtol=job.rtol,
            max_steps=job.max_steps or None,
            throw=False,
        )
        energy = result.energy
        result = dataclasses.replace(result, record=result.record.compact())

        def value(name: str) -> Any:
            if name.startswith("energy."):
                return energy[name.removeprefix("energy.")]
            return ABOUT[name](result) if name in ABOUT else measure(result, name)

        return [float(value(name)) for name in names]

    return dict(zip(names, np.array([*map(values, rows)]).T, strict=True))
