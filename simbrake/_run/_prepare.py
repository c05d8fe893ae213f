"""A scene's program, prepared once: numbers in, metrics and their derivatives out, without any tracing or checking."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import Program, compiled, pack
from .._base._faults import Fault, InputError
from .._base._quantity import leaves
from .._parts._scene import Scene, check, checked
from ..hybrid import Code
from ._edit import with_values
from ._measure import Metric, check_metrics, measure, name_of
from ._result import Result
from ._simulate import room_for, simulate, solver_of

#: numbers by path, a whole vector of them, or those of the prepared scene
Values = Mapping[str, Any] | np.ndarray | None

_MOST_STEPS = 1 << 20
#: lines up to which derivatives are compiled as one function: with Rodas5P it would take minutes
_LONGEST_SLOPES = 19_000
_COUNTS = 6  # code and counts of steps, behind the metrics
_ENTRY = re.compile(r"^(?P<path>.*)\[(?P<index>-?\d+)\]$")


class Answer(NamedTuple):
    """What a prepared run gives: metrics by name (`inf`: a time that never came), result code, counts of steps."""

    metrics: dict[str, Any]
    code: int  # 0: the run reached its end time; else one of `simbrake.results.FAILURES`
    accepted: int
    rejected: int
    retaken: int
    events: int
    segments: int


class Prepared:
    """A scene compiled for fast runs with other numbers; made by `prepare`.

    - `numbers` (k,): all numbers of the scene as one vector; `places`: path → where they lie in it
    - `metrics`: names in the order of `gradient`'s rows
    - `program`: the compiled run, with the seconds that tracing and compiling took
    """

    def __init__(self, scene: Scene, metrics: Sequence[Metric], solver: Any, rtol: float, max_steps: int):
        self.scene, self.solver, self.rtol, self.max_steps = scene, solver, rtol, max_steps
        self.metrics = tuple(name_of(metric) for metric in metrics)
        self._asked = tuple(metrics)
        self.numbers, self._like = pack(scene)
        self.places = self._places()
        self.program = self._compile()
        self._slope: Program | None = None

    def _places(self) -> dict[str, slice]:
        # a scene whose numbers are replaced by their places tells where each path lies
        counted = self._like.unpack(np.arange(self.numbers.size, dtype=np.float64))
        found = {}
        for leaf in leaves(counted):
            first = int(np.ravel(leaf.value)[0])
            found[leaf.path] = slice(first, first + int(np.size(leaf.value)))
        return found

    def _run(self, numbers: Any) -> Any:
        scene, rtol = self._like.unpack(numbers[:-1]), numbers[-1]
        result = simulate(scene, solver=self.solver, rtol=rtol, max_steps=self.max_steps)
        found = [measure(result, metric) for metric in self._asked]
        ends = np.cumsum([0, *(value.size for value in found)]).tolist()
        wheres = [a if value.ndim == 0 else slice(a, b) for a, b, value in zip(ends, ends[1:], found, strict=False)]
        self._spans = list(zip(self.metrics, wheres, strict=True))  # of the metrics, known once it is traced
        counts = jnp.stack([jnp.asarray(n, jnp.float64) for n in (result.code, *result.record.stats)])
        return jnp.concatenate([*(jnp.ravel(value) for value in found), counts])

    def _compile(self) -> Program:
        return compiled(self._run, self._input(self.numbers, self.rtol))

    def vector(self, values: Values = None) -> np.ndarray:
        """The numbers with some of them changed, by path (`{"initial.omega": 18.0}`), or such a vector as it is."""
        if values is None:
            return self.numbers
        if isinstance(values, np.ndarray):
            return values
        numbers = self.numbers.copy()
        for path, value in values.items():
            numbers[self._place(path)] = value
        return numbers

    def _place(self, path: str) -> slice | int:
        if path in self.places:
            return self.places[path]
        entry = _ENTRY.match(path)
        whole = self.places.get(entry["path"]) if entry else None
        if entry is None or whole is None:
            with_values(self.scene, {path: 0.0})  # raises what is wrong with an unknown path
            raise InputError([Fault(path, "is absent in the prepared scene", "prepare a scene that has it")])
        return range(whole.start, whole.stop)[int(entry["index"])]

    def __call__(self, values: Values = None, *, rtol: float | None = None) -> Answer:
        """Runs with these numbers (and another tolerance); what a run of `simulate` would raise is in `code`.

        Values are taken as they are: `check` looks at them first.
        """
        numbers = self._input(self.vector(values), self.rtol if rtol is None else rtol)
        out = np.asarray(self.program.call(numbers))
        *_, code, accepted, rejected, retaken, events, segments = out.tolist()
        if code == Code.STEP_LIMIT and self.max_steps < _MOST_STEPS:
            # the record was too short for these numbers: a longer one, from now on
            self.max_steps, self._slope = 4 * self.max_steps, None
            self.program = self._compile()
            return self(values, rtol=rtol)
        metrics = {name: out[where].item() if type(where) is int else out[where] for name, where in self._spans}
        counts = int(accepted), int(rejected), int(retaken), int(events), int(segments)
        return Answer(metrics, int(code), *counts)

    @staticmethod
    def _input(numbers: np.ndarray, rtol: float) -> np.ndarray:
        whole = np.empty(numbers.size + 1)
        whole[:-1] = numbers
        whole[-1] = rtol
        return whole

    def gradient(self, values: Values = None) -> np.ndarray:
        """Derivatives of all metrics with respect to all numbers, (metrics, k), by one reverse pass for each metric.

        Zero for a metric that is infinite. Compiles at the first call.
        """
        numbers = self._input(self.vector(values), self.rtol)
        if self._slope is None:
            self._slope = compiled(self._slopes, numbers, longest=_LONGEST_SLOPES)
        return np.asarray(self._slope.call(numbers))

    def _slopes(self, numbers: Any) -> Any:
        found, back = jax.vjp(lambda x: self._run(x)[:-_COUNTS], numbers)
        eye = jnp.where(jnp.isfinite(found), 1.0, 0.0) * jnp.eye(found.size)
        if found.size < 3:
            return jnp.stack([back(row)[0][:-1] for row in eye])
        return jax.lax.map(lambda row: back(row)[0][:-1], eye)

    def check(self, values: Values = None) -> Scene:
        """The scene with these numbers. Raises `InputError` with all faults of it."""
        scene = self._like.unpack(self.vector(values))
        check(scene)
        return scene

    def result(self, values: Values = None) -> Result:
        """The whole `Result` of a run with these numbers, by `simulate`."""
        scene = self.check(values)
        return simulate(scene, solver=self.solver, rtol=self.rtol, max_steps=self.max_steps, throw=False)


def prepare(
    scene: Scene,
    metrics: Sequence[Metric] = ("slip_onset_time", "full_slip_time", "stopping_time"),
    *,
    solver: Any = None,
    rtol: float = 1e-10,
    max_steps: int | None = None,
) -> Prepared:
    """Compiles a scene's run for many calls with other numbers, each some tens of microseconds: loops, live displays.

        run = simbrake.prepare(scene, ["stopping_time"])
        run({"initial.omega": 18.0}).metrics["stopping_time"]
        run.gradient({"initial.omega": 18.0})[0, run.places["brake.pulley.inertia"]]

    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number or an array
    - `solver`, `rtol`: as for `simulate`, chosen once for the scene given
    - `max_steps`: step attempts to make room for; by default what the scene's own run needs and a quarter more. A run
      that needs more is compiled anew with more room

    Raises `InputError` for a faulty scene or metric, and `SimulationError` where the scene's own run fails.
    """
    scene = checked(scene)
    check_metrics(scene, metrics)
    solver = solver_of(scene, solver)
    limit = max_steps or room_for(simulate(scene, solver=solver, rtol=rtol))
    return Prepared(scene, metrics, solver, rtol, limit)
