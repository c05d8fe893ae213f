"""The evaluator under all studies: a scene's run as a function of numbers, with
derivatives and result codes.

    x → place(scene, x, given) → run → find(result, given)

`PointEvaluator` takes one point at a time, with the Jacobian; `many_points.run_chunk`
takes many, without. A program is compiled once for scenes of one structure and kept;
new numbers never re-trace. A run whose record is too short is repeated with a longer
record.
"""

import copy
import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._compiling import Compiled
from .._base._store import UnknownStructureError, canonical, trace_anew
from ..hybrid import Code
from ..hybrid.arrays import Array
from ..outputs.log import FAILURES
from ..outputs.metrics import identity_of
from ..parts.scene import Scene
from ..runs.measure import MetricLike, measure_all
from ..runs.result import Result
from ..runs.simulate import Solver, room_for, simulate, solver_of, step_limits

#: the longest record that a run is repeated with, unless the caller allows more
_LONGEST = 16384
#: points whose results are cached
_REMEMBERED = 4
#: tolerance at which rounding begins to govern
_FINEST = 1e-12
#: above this tolerance a second run at a tenth of it does not show the error: of 1,500
#: derivatives of a hot stop at 1e-5 to 1e-8, 2 to 14 % had more than three times the
#: error so stated, and 0.8 % at most where the second run was at `_FINEST`
_LOOSE = 1e-9
#: scene, numbers x (k,), and other numbers `given` → the scene with these numbers
Place: TypeAlias = Callable[[Scene, Any, Any], Scene]
#: result (the scene, where nothing is run) and numbers `given` → values (m,), and
#: anything else that is wanted from the result
Find: TypeAlias = Callable[[Any, Any], tuple[Any, Any]]


def failure_name(code: int) -> str:
    """Name of a result code."""
    return FAILURES[code][0] if code in FAILURES else f"code {code}"


def own_part(scene: Scene, solver: Solver | None, metrics: Sequence[MetricLike]) -> str:
    """Name of a class or function of the user, or of a library that simbrake does not
    know; empty without any."""
    try:
        canonical((scene, solver, [*map(identity_of, metrics)]))
    except UnknownStructureError as error:
        return str(error)
    return ""


class Metrics(NamedTuple):
    """Metrics of a result as one vector (m,)."""

    asked: tuple[MetricLike, ...]

    def __call__(self, result: Result, given: object = None) -> tuple[Array, None]:
        return jnp.stack(measure_all(result, self.asked)), None


class ProgramKey(NamedTuple):
    """What the program of a point depends on, besides the structure of its numbers.

    - `solver`: `None` where nothing is run
    - `reverse`: derivatives by one pass for each value, else by one for each number
    - `singly`: one pass at a time, which takes less memory and compiles faster
    """

    place: Place
    find: Find
    solver: Solver | None
    max_steps: int
    reverse: bool
    singly: bool


class Evaluation(NamedTuple):
    """Values (m,) at a point and their derivatives (m, k), the code of the run, and
    what `find` gave besides the values."""

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
        jacobian_of = jax.jacrev if asked.reverse else jax.jacfwd
        jacobian, values = jacobian_of(answer, has_aux=True)(x, *rest)
        return jacobian, *values

    def along(x: Array, direction: Array, *rest: Any) -> tuple[Any, ...]:
        """`direction` (m,) of the values if `reverse`, else (k,) of the numbers."""
        if asked.reverse:
            _, back, values = jax.vjp(lambda x: answer(x, *rest), x, has_aux=True)
            return back(direction)[0], *values
        _, slope, values = jax.jvp(
            lambda x: answer(x, *rest), (x,), (direction,), has_aux=True
        )
        return slope, *values

    metrics = asked.find.asked if isinstance(asked.find, Metrics) else ()
    subject = ("evaluate", asked, tuple(map(identity_of, metrics)))
    return Compiled(along if asked.singly else at_once, subject=subject)


@functools.partial(Compiled, static_argnames=("find",))
def _measured(result: Result, *, find: Find) -> Array:
    return find(result, None)[0]


def values_of(result: Result, find: Find) -> np.ndarray:
    """Values of a concrete result, by one program for every power of two of its
    length."""
    compact = dataclasses.replace(result, record=result.record.compact())
    return np.asarray(_measured(compact, find=find))


@explained
class PointEvaluator:
    """A scene's run as a function of a vector of numbers.

    - `place`: puts the parameters into the scene, as `Paths`
    - `find`: takes metrics from the result, as `Metrics`
    - `given`: other numbers for both, not differentiated
    - `run`: whether `find` takes a result, not the scene
    - `size`: how many values `find` gives; needed where derivatives are taken `singly`
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
        """Makes records as long as this run needs them where it is differentiated, and
        longer ones for later attempts."""
        first = room_for(result, differentiated=True)
        longer = (first * 4**i for i in range(1, 16) if first * 4 ** (i - 1) < _LONGEST)
        self.limits = (first, *longer)
        self._level = 0

    def __call__(
        self, x: np.ndarray, given: Any = None, scene: Scene | None = None
    ) -> Evaluation:
        """Values and Jacobian at a point, also of another scene of this structure. The
        last few points are cached, except those with other numbers `given`."""
        key = x.tobytes() if given is None else None
        if key in self._known:
            return self._known[key]
        self.runs += 1
        given = self.given if given is None else given
        while (
            evaluation := self._at(x, given, scene)
        ).code == Code.STEP_LIMIT and self._level < len(self.limits) - 1:
            self._level += 1  # (also for later points)
        if key is not None:
            self._known[key] = evaluation
            if len(self._known) > _REMEMBERED:
                del self._known[next(iter(self._known))]
        return evaluation

    def finer(self) -> "PointEvaluator":
        """An evaluator at another tolerance: the difference of its values is an estimate
        of the error by integration in time.

        Its tolerance is a tenth. For a loose tolerance it is the finest: many steps are
        then as short as events make them, and would be the same at a tenth. Where
        rounding would govern it is ten times the tolerance, for a cautious estimate.
        """
        other = copy.copy(self)
        other._known = {}
        if self.rtol > _LOOSE:
            other.rtol = _FINEST
        else:
            other.rtol = self.rtol * (0.1 if self.rtol > _FINEST else 10.0)
        return other

    def _at(self, x: np.ndarray, given: Any, scene: Scene | None) -> Evaluation:
        program = _program(self._asked._replace(max_steps=self.limits[self._level]))
        scene = self.scene if scene is None else scene
        rest = scene, given, np.asarray(self.rtol, np.float64)
        if not self._asked.singly:
            jacobian, values, code, more = program(x, *rest)
            return Evaluation(np.asarray(values), np.asarray(jacobian), int(code), more)
        directions = np.eye(self._size if self._asked.reverse else x.size)
        slopes = []
        for direction in directions:
            slope, values, code, more = program(x, direction, *rest)
            slopes.append(np.asarray(slope))
            # a run that ended early has no derivatives, only numbers that look like them
            if int(code) != 0:
                slopes = [np.full_like(slope, np.nan)] * len(directions)
                break
        jacobian = np.stack(slopes, axis=0 if self._asked.reverse else 1)
        return Evaluation(np.asarray(values), jacobian, int(code), more)
