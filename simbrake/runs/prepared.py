"""A scene compiled once for many runs: numbers in, metrics and their derivatives out,
without any tracing or checking."""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._arguments import explained
from .._base._compiling import LONGEST, Program, program_of, require_own_process
from .._base._faults import InputError, input_error
from .._base._packing import pack
from .._base._part import leaves
from .._base._quantity import shown
from .._base._store import kept
from ..hybrid import Code
from ..hybrid.arrays import Array, VectorK
from ..outputs.log import FAILURES
from ..outputs.metrics import ByName, identity_of
from ..parts.scene import Scene
from ..parts.scene_checks import check_scene
from ..thermal.mesh import finer_values
from .edit import entry_of, fault_of_path, numbers_in_si, with_inputs
from .errors import error_of_layers, errors_between, second_rtol
from .measure import (
    MetricLike,
    as_metrics,
    check_metrics,
    measure_all,
    name_of,
    unit_of,
)
from .mesh import cuts_of, with_finer_layers
from .result import Result
from .simulate import (
    DIFFERENTIATED,
    Solver,
    checked_run,
    room_for,
    simulate,
    solver_name,
)

#: numbers by path, a vector of all numbers, or `None`: those of the prepared scene
Inputs = Mapping[str, Any] | np.ndarray | None

#: longest record that a run is repeated with
_MOST_STEPS = 1 << 20
#: lines of a program up to which derivatives are compiled as one function: those of
#: Rodas5P would take minutes
_LONGEST_SLOPES = 26_000
_COUNTS = 6  # code and counts of steps, after the metrics


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
    """Path of a number, or of an entry of a list → its place in the vector of all
    numbers.

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


class PreparedAccuracy(NamedTuple):
    """Estimated errors of a prepared run: of its metrics by name (`None`, in arrays NaN,
    where a metric has no value); steps of both runs; and `problem`: why there is no
    estimate, or empty.

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> prepared.accuracy({"initial.omega": 18.0}).errors["stopping_time"] < 1e-9
        True
    """

    errors: dict[str, Any]
    steps: int
    second_steps: int
    problem: str = ""


def accuracy_from(first: Any, second: Any) -> PreparedAccuracy:
    """Errors of the first of two answers of a prepared run from their difference."""
    counts = first.accepted, second.accepted
    for which, answer in (("the run", first), ("the second run", second)):
        if answer.code:
            problem = f"{which} failed ({FAILURES[answer.code][0]})"
            return PreparedAccuracy({}, *counts, problem)
    if (first.events, first.segments) != (second.events, second.segments):
        problem = (
            f"the runs have {first.events} and {second.events} events in "
            f"{first.segments} and {second.segments} segments"
        )
        return PreparedAccuracy({}, *counts, problem)
    errors = {
        name: _error_or_none(
            errors_between(value, second.metrics[name], first.accepted)
        )
        for name, value in first.metrics.items()
    }
    return PreparedAccuracy(errors, *counts)


def with_layers(found: PreparedAccuracy, first: Any, finer: Any) -> PreparedAccuracy:
    """The errors with those of the layers of walls, from the answer of the same run
    with finer layers."""
    if finer.code:
        problem = f"the run with finer layers failed ({FAILURES[finer.code][0]})"
        return found._replace(errors={}, problem=problem)
    errors = {}
    for name, error in found.errors.items():
        value = np.asarray(first.metrics[name], float)
        difference = np.abs(value - np.asarray(finer.metrics[name], float))
        error = np.asarray(np.nan if error is None else error)
        both = error + error_of_layers(difference, error)
        errors[name] = _error_or_none(np.where(np.isfinite(difference), both, np.nan))
    return found._replace(errors=errors)


def _error_or_none(error: np.ndarray) -> Any:
    """The error of an array; of one number as a float, `None` where it is NaN."""
    if error.ndim:
        return error
    return None if np.isnan(error) else float(error)


@explained
class Prepared:
    """A scene compiled for fast runs with other numbers; made by `prepare`.

    - `numbers` (k,): all numbers of the scene except its limits, as one vector
    - `places`: path of a number → its place in this vector
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
        metrics: Sequence[MetricLike],
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
        self._slope_steps = DIFFERENTIATED * max_steps
        self.metrics = tuple(name_of(metric) for metric in metrics)
        self._asked = tuple(metrics)
        self.numbers, self._like = pack(scene.as_run)
        self.places = self._places()
        #: name of each metric and its place in the result of the program; known once
        #: that is traced
        self._spans: list[tuple[str, int | slice]] = []
        self.program = self._compile()
        self._slope: Program | None = None
        #: the same scene with finer layers, made by the first call of `accuracy`
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
        # in a scene whose numbers are their own places each path shows its place
        counted = self._like.unpack(np.arange(self.numbers.size, dtype=np.float64))
        slices = Places()
        for leaf in leaves(counted):
            # (the initial value is for empty lists)
            first = int(np.min(leaf.value, initial=self.numbers.size))
            slices[leaf.path] = slice(first, first + int(np.size(leaf.value)))
        return slices

    def _run(self, numbers: VectorK, max_steps: int) -> Float[Array, " out"]:
        rtol, max_step = numbers[-2:]
        result = simulate(
            self._like.unpack(numbers[:-2]),
            solver=self.solver,
            rtol=rtol,
            max_step=max_step,
            max_steps=max_steps,
            max_events=self.max_events,
        )
        values = measure_all(result, self._asked, arrays=True)
        ends = np.cumsum([0, *(value.size for value in values)]).tolist()
        self._spans = [
            (name, slice(a, b) if value.ndim else a)
            for name, value, a, b in zip(
                self.metrics, values, ends, ends[1:], strict=False
            )
        ]
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

    def vector(self, values: Inputs = None) -> Array:
        """All numbers, those in `values` changed (`{"initial.omega": 18.0}`); a vector
        of all numbers as it is.

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
            hint = f"give values by path, or a vector of {self.numbers.size} numbers"
            raise input_error("values", f"{shown(values)} does not fit here", hint)
        return values

    def _place(self, path: str) -> slice:
        try:
            return self.places[path]
        except KeyError:
            # raises the error of an unknown path
            with_inputs(self.scene, {str(path): 0.0})
            raise input_error(
                path, "is absent in the prepared scene", "prepare a scene that has it"
            ) from None

    def _read(self, path: str, value: Any, place: slice) -> np.ndarray:
        """Numbers of a value that is or has a text with a unit."""
        size = place.stop - place.start
        try:
            return np.broadcast_to(
                np.asarray(numbers_in_si(self.scene, path, value), np.float64), size
            )
        except (ValueError, TypeError) as error:
            if isinstance(error, InputError):  # (a `ValueError`)
                raise
            numbers = "one number" if size == 1 else f"one number or a list of {size}"
            raise input_error(
                path, f"{shown(value)} does not fit here", f"give {numbers}"
            ) from None

    @explained
    def __call__(
        self, values: Inputs = None, *, rtol: float | None = None
    ) -> PreparedResult:
        """Runs with these numbers (and another tolerance); failures, which `simulate`
        raises, are in `code`.

        Values are taken as they are: `check` looks at them first.
        """
        require_own_process()
        numbers = self.inputs(self.vector(values), self.rtol if rtol is None else rtol)
        out = np.asarray(self.program.call(numbers))
        *_, code, accepted, rejected, retaken, events, segments = out.tolist()
        if code == Code.STEP_LIMIT and self.max_steps < _MOST_STEPS:
            # the record is too short for these numbers: from now on a longer one
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
        """The vector that its programs take: all numbers of the scene, the tolerance and
        the longest step."""
        # (`np.append` takes 2 µs more, of the tens of a call)
        whole = np.empty(numbers.size + 2)
        whole[:-2] = numbers
        whole[-2] = rtol
        whole[-1] = self.max_step
        return whole

    def gradient(self, values: Inputs = None) -> np.ndarray:
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
            # from now on a longer record
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

    def check(self, values: Inputs = None) -> Scene:
        """The scene with these numbers. Raises `InputError` with all its errors."""
        scene = self.scene_with(values)
        check_scene(scene)
        return scene

    def scene_with(self, values: Inputs = None) -> Scene:
        """The scene with these numbers, not checked."""
        return dataclasses.replace(
            self._like.unpack(self.vector(values)), limits=self.scene.limits
        )

    def accuracy(self, values: Inputs = None) -> PreparedAccuracy:
        """Estimated errors of the metrics of a run with these numbers, by a second run
        of the same program at the tolerance of `Result.accuracy`:
        `simbrake.results.PreparedAccuracy`.

        Events are counted in both runs, not compared; nothing is compiled. Of walls the
        errors of the layers are added, from a third run with finer layers; its program
        is compiled at the first call.
        """
        first = self(values)
        found = accuracy_from(first, self(values, rtol=second_rtol(self.rtol)))
        if found.problem or not self.scene.network.walls:
            return found
        if self._finer is None:
            limits = {"max_step": self.max_step, "max_events": self.max_events}
            cuts = cuts_of(simulate(self.scene, rtol=self.rtol, **limits, throw=False))
            finer = with_finer_layers(self.scene, cuts)
            self._finer = prepare(finer, self._asked, rtol=self.rtol, **limits)
        numbers = np.asarray(self.vector(values))
        given = {
            path: np.squeeze(numbers[place])[None]
            for path, place in self.places.items()
        }
        finer_numbers = finer_values(
            self.scene.network, self._finer.scene.network, given
        )
        answer = self._finer({path: array[0] for path, array in finer_numbers.items()})
        return with_layers(found, first, answer)

    def result(self, values: Inputs = None) -> Result:
        """The whole `Result` of a run with these numbers, by `simulate`."""
        return simulate(
            self.check(values),
            solver=self.solver,
            rtol=self.rtol,
            max_step=self.max_step,
            max_steps=self.max_steps,
            max_events=self.max_events,
            throw=False,
        )


@explained
def prepare(
    scene: Scene,
    metrics: MetricLike | Sequence[MetricLike] = (
        "slip_onset_time",
        "full_slip_time",
        "stopping_time",
    ),
    *,
    solver: Solver | None = None,
    rtol: float = 1e-10,
    max_step: float = np.inf,
    max_steps: int | None = None,
    max_events: int = 10_000,
) -> Prepared:
    """Compiles a scene's run for many calls with other numbers, as in loops and live
    displays; a call takes some tens of microseconds.

        run = simbrake.prepare(scene, ["stopping_time"])
        run({"initial.omega": 18.0}).metrics["stopping_time"]
        run.gradient({"initial.omega": 18.0})[0, run.places["brake.pulley.inertia"]]

    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number
      or an array
    - `solver`, `rtol`, `max_step` (s), `max_events`: as for `simulate`, chosen once for
      the scene given
    - `max_steps`: step attempts to allocate; by default what the scene's own run needs
      and a quarter more. A run that needs more is compiled again with more

    Raises `InputError` with all errors of scene, metrics and options, and
    `SimulationError` where the scene's own run fails.

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> prepared.places["initial.omega"]
        slice(19, 20, None)
    """
    metrics = as_metrics(metrics)
    scene, solver = checked_run(
        scene,
        solver,
        *(rtol, max_step, max_steps, max_events),
        also=functools.partial(check_metrics, metrics=metrics),
    )
    limits = {"max_step": max_step, "max_events": max_events}
    run = functools.partial(simulate, scene, solver=solver, rtol=rtol, **limits)
    return Prepared(
        scene, metrics, solver, rtol, max_steps or room_for(run()), **limits
    )
