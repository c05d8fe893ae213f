"""Public entry of the integrator, and long runs in parts."""

import dataclasses
import enum
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Float, Int, PyTree

from . import _loop
from ._bordered import Couplings
from ._derivative import (
    Call,
    RowMap,
    advance,
    before_jump,
    no_tangent,
    pull_back,
    sweep,
)
from ._loop import Problem, advanced, empty_rows, started, with_last_row
from ._method import AbstractMethod
from ._search import Stats, pack, unpack
from .arrays import Array, Count, IntScalar, Scalar, templates
from .struct import Struct, with_fields
from .system import (
    INSTANT,
    LANDED,
    SKIPPED,
    STOPPED,
    AbstractHybridSystem,
    Code,
    Flat,
    Rows,
    Settings,
    flatten,
    pack_mode,
    ravel,
    unpack_rows,
    unravel,
)


class EventKind(enum.IntEnum):
    """Causes of a change of mode: `GUARD`, a guard reached 0; `AT_ONCE`, a guard was
    negative just after an event, or at the start, and no time passed; `KNOWN_TIME`,
    `next_stop` was reached.

    Example:
        >>> [event.kind.name for event in result.record.events]
        ['AT_ONCE', 'GUARD']
    """

    GUARD = LANDED
    AT_ONCE = INSTANT
    KNOWN_TIME = STOPPED


class HybridEvent(NamedTuple):
    """An event of a run: its time, its kind, the number of the guard that fired (`None`
    at a time breakpoint), the modes before and after it (they may be equal), and the
    name of the guard, `""` at a time breakpoint.

    Example:
        >>> round(result.record.events[-1].time, 4), result.record.events[-1].name
        (1.2577, 'contact.motion')
    """

    time: float
    kind: EventKind
    guard: int | None
    before: PyTree
    after: PyTree
    name: str = ""


class Record(Struct):
    """Record of an integration: every step attempt, from which states at any time
    follow.

    `rows` has `max_steps + 1` entries, of which `count` attempts and then the end of
    the run are filled. `t` and `y` of the rows are differentiable (first derivatives,
    forward and reverse) with respect to every number of the system, the initial state
    and the times.

    Example:
        >>> record = result.record
        >>> int(record.code), round(float(record.t_end), 3), float(record.y_end.omega)
        (0, 4.0, 0.0)
    """

    system: AbstractHybridSystem
    method: AbstractMethod
    y_like: PyTree
    mode_like: PyTree
    t1: Any
    rows: Rows
    count: IntScalar
    code: IntScalar
    stats: Stats

    @property
    def flat(self) -> Flat:
        return flatten(self.system, self.y_like, self.mode_like)

    def _end(self, values: Array) -> Array:
        concrete = not isinstance(values, Tracer) and not isinstance(self.count, Tracer)
        return (
            np.asarray(values)[np.asarray(self.count)]
            if concrete
            else jnp.asarray(values)[self.count]
        )

    @property
    def t_end(self) -> Scalar:
        return self._end(self.rows.t)

    @property
    def y_end(self) -> PyTree:
        return unravel(self._end(self.rows.y), self.y_like)

    @property
    def mode_end(self) -> PyTree:
        return unravel(self._end(self.rows.mode), self.mode_like)

    @property
    def events(self) -> list[HybridEvent]:
        """All events of a concrete record in order of time; those of one instant in the
        order in which they happened.

        record = sb.hybrid.hybridsolve(system, y0, mode0, 0.0, 1.0, method, settings)
        [event.time for event in record.events if event.kind ==
        sb.hybrid.EventKind.GUARD]
        """
        kinds = np.asarray(self.rows.kind)[: int(self.count)]
        t = np.asarray(self.rows.t)
        modes = np.asarray(self.rows.mode)
        guards = np.asarray(self.rows.guard)
        events = []
        names = self.guard_names if np.any(kinds >= LANDED) else []
        for i in np.flatnonzero(kinds >= LANDED):
            kind = EventKind(int(kinds[i]))
            guard = None if kind == EventKind.KNOWN_TIME else int(guards[i])
            before, after = (unravel(modes[j], self.mode_like) for j in (i, i + 1))
            name = "" if guard is None else names[guard]
            events.append(
                HybridEvent(float(t[i + 1]), kind, guard, before, after, name)
            )
        return events

    @property
    def guard_names(self) -> list[str]:
        """Names of the guards in the order of their numbers: the path in their
        structure, and of a vector the entry, from 1."""
        like = self.flat.guards_like(
            *jax.tree.map(jnp.asarray, (0.0, self.y_like, self.mode_like))
        )
        names = []
        for path, leaf in jax.tree_util.tree_leaves_with_path(like):
            name = jax.tree_util.keystr(path, simple=True, separator=".")
            size = math.prod(leaf.shape)
            names += (
                [f"{name} {i + 1}".strip() for i in range(size)]
                if leaf.shape
                else [name]
            )
        return names

    def last_guards(self, count: int) -> list[str]:
        """Names of the last guards that fired in a concrete record, in order of
        time."""
        kinds = np.asarray(self.rows.kind)[: int(self.count)]
        fired = np.asarray(self.rows.guard)[: int(self.count)][
            (kinds >= LANDED) & (kinds != STOPPED)
        ][-count:]
        names = self.guard_names if fired.size else []
        return [names[i] for i in fired]

    @property
    def modes(self) -> PyTree:
        """Modes of all rows, as columns: every leaf has the rows as its first axis."""
        return unravel(_column(self.rows.mode), self.mode_like)

    @property
    def states(self) -> PyTree:
        """States at the starts of all rows, as columns."""
        return unravel(_column(self.rows.y), self.y_like)

    def row(self, i: Array) -> Rows:
        return jax.tree.map(lambda leaf: leaf[i], self.rows)

    def ends(self, index: Int[Array, " k"]) -> tuple[Array, PyTree]:
        """Times and states at the end of the given rows, before any jump."""
        flat = self.flat

        def end_of_row(i: Count) -> tuple[Scalar, PyTree]:
            t, y = before_jump(flat, self.method, self.t1, self.row(i))
            return t, flat.unpack_state(y)

        return jax.vmap(end_of_row)(index)

    def inside(
        self, index: Int[Array, " k"], h: Array, *, still: bool = False
    ) -> tuple[Array, PyTree]:
        """Times and states at `h` after the start of the rows named: a step of the
        method, not an interpolant.

        `still`: as a smaller program, which is not to be differentiated.
        """
        flat = self.flat
        method = self.method.rolled()

        def state_inside(i: Count, h: Scalar) -> tuple[Scalar, PyTree]:
            row = self.row(i)

            def rhs(t: Scalar, y: Array) -> Array:
                return flat.rhs(t, y, row.mode)

            y = (
                method.state_after(rhs, row.t, row.y, h)
                if still
                else method.step_with_rate(rhs, row.t, row.y, h)[0]
            )
            return row.t + h, flat.unpack_state(y)

        return jax.vmap(state_inside)(index, h)

    def find(self, ts: Float[Array, " k"], *, left: bool = False) -> Int[Array, " k"]:
        """Rows that hold the given times: at an instant with events, the last row there
        (`left`: the first)."""
        # a compact record is read outside of jit, where every operation of JAX would
        # compile separately
        xp: Any = np if isinstance(self.rows.t, np.ndarray) else jnp
        n = self.rows.t.shape[0]
        starts = xp.where(
            xp.arange(n, dtype=np.int32) <= self.count, self.rows.t, np.inf
        )
        i = xp.searchsorted(starts, ts, side="left" if left else "right") - 1
        return xp.clip(i, 0, self.count).astype(np.int32)

    def at(self, ts: Array, *, left: bool = False) -> tuple[PyTree, PyTree]:
        """States and modes at the times `ts` (k,), each from one step of the method out
        of the row before it.

        At an event the value after it, or with `left` the value before. Times outside
        the run take its ends.
        """
        i = self.find(ts, left=left)
        h = jnp.clip(ts, self.rows.t[0], self.t_end) - self.rows.t[i]
        _, y = self.inside(i, h)
        return y, jax.vmap(self.flat.unpack_mode)(self.rows.mode[i])

    def compact(self) -> "Record":
        """The same record without skipped rows and unused space (outside of jit only),
        its length a power of two."""
        count = int(self.count)
        kept = np.flatnonzero(
            np.append(np.asarray(self.rows.kind)[:count] != SKIPPED, True)
        )
        size = max(64, 1 << int(np.ceil(np.log2(len(kept)))))
        if isinstance(self.rows.t, np.ndarray) and (len(self.rows.t), len(kept)) == (
            size,
            count + 1,
        ):
            return self
        index = np.append(kept, np.full(size - len(kept), kept[-1]))
        columns = (
            np.asarray(getattr(self.rows, field.name))[index]
            for field in dataclasses.fields(Rows)
        )
        count = np.asarray(len(kept) - 1, np.int32)
        fixed = (self.system, self.method, self.y_like, self.mode_like, self.t1)
        # (`eqx.tree_at` takes longer than a run)
        return Record(*fixed, Rows(*columns), count, self.code, self.stats)


def _column(values: Array) -> Array:
    """Values of the rows; concrete ones as NumPy has them, as every operation of JAX
    would compile separately."""
    return values if isinstance(values, Tracer) else np.asarray(values)


class Given(NamedTuple):
    """What is to be integrated, as `hybridsolve` takes it."""

    system: AbstractHybridSystem
    y0: PyTree
    mode0: PyTree
    t0: Scalar | float
    t1: Scalar | float
    method: AbstractMethod
    settings: Settings


def fitted(system: AbstractHybridSystem, method: AbstractMethod) -> AbstractMethod:
    """The method for the couplings of this system."""
    kinds = system.couplings()
    if kinds is None:
        return method
    return method.fitted(
        Couplings.of(
            np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(kinds)])
        )
    )


def generic_direction(flat: Flat) -> PyTree:
    """A direction of all numbers of a system: each by its magnitude; one that is 0 by
    the largest of its array, else by its typical size, or 1 where that is not known."""
    import equinox as eqx

    numbers, structure = jax.tree.flatten(eqx.filter(flat, eqx.is_inexact_array))
    typical = jax.tree.leaves(flat.system.typical_numbers()) or [0.0] * len(numbers)
    directions = []
    for i, (x, typical_size) in enumerate(zip(numbers, typical, strict=True)):
        size = jnp.abs(jax.lax.stop_gradient(jnp.asarray(x)))
        size = jnp.where(jnp.isfinite(size), size, 0.0)
        for instead in (
            jnp.max(size, initial=0.0),
            jax.lax.stop_gradient(typical_size),
            1.0,
        ):
            size = jnp.where(size > 0, size, instead)
        directions.append(
            size * _loop.generic(int(np.size(x)), seed=i + 1).reshape(np.shape(x))
        )
    return jax.tree.unflatten(structure, directions)


def weights_of(system: AbstractHybridSystem, y_like: PyTree) -> tuple[Array, Array]:
    """Weights of the states in the error norm, and how many are in it."""
    sizes = ravel(jax.tree.map(jnp.add, y_like, system.scales()), jnp.float64)
    weights = jax.lax.stop_gradient(1.0 / sizes)
    return weights, jnp.maximum(jnp.sum(jnp.where(weights > 0, 1.0, 0.0)), 1.0)


def _numbers(tree: PyTree) -> list[Array]:
    import equinox as eqx

    return jax.tree.leaves(eqx.filter(tree, eqx.is_inexact_array))


def _places(
    problem: Callable[[PyTree, PyTree], tuple[Problem, Array]],
    params: PyTree,
    others: PyTree,
    mode: Array,
) -> list[int | None]:
    """For each number of a system `near` a mode its place among those of the whole one,
    `None` of entries of a list."""
    places = []

    def look(params: PyTree, others: PyTree, mode: Array) -> None:
        whole = {id(x): i for i, x in enumerate(jax.tree.leaves(params[0]))}
        places.extend(
            whole.get(id(x))
            for x in _numbers(problem(params, others)[0].flat.near(mode, mode))
        )

    jax.eval_shape(look, params, others, mode)
    return places


def _row_map(
    problem: Callable[[PyTree, PyTree], tuple[Problem, Array]],
    places: list[int | None],
) -> RowMap:
    """How one row of a record moves with its start and with numbers of the system.

    - `places` of these numbers among those that all rows share, as of `_places`
    """

    def row(rows: Rows, start: Array, i: Count) -> Rows:
        bare = jax.tree.map(lambda leaf: leaf[i], rows)
        return with_fields(bare, t=start[0], y=start[1:])

    def flat_of(fixed: PyTree, i: Count, shared: list[Array], own: list[Array]) -> Flat:
        """The system of one row with these numbers."""
        import equinox as eqx

        whole, others, rows, _ = fixed
        flat = problem(whole, others)[0].flat.near(rows.mode[i], rows.mode[i + 1])
        bare, rest = eqx.partition(flat, eqx.is_inexact_array)
        alike = dict(
            zip(sorted(i for i in {*places} if i is not None), shared, strict=True)
        )
        apart = iter(own)
        new = [next(apart) if place is None else alike[place] for place in places]
        return eqx.combine(jax.tree.unflatten(jax.tree.structure(bare), new), rest)

    def forwards(
        fixed: PyTree, params: PyTree, own: list[Array], start: Array, i: Count
    ) -> Array:
        _, _, rows, method = fixed
        flat = flat_of(fixed, i, params[0], own)
        t, y = advance(flat, method, params[1], row(rows, start, i), rows.mode[i + 1])
        return jnp.concatenate([t[None], y])

    def backwards(
        fixed: PyTree,
        params: PyTree,
        own: list[Array],
        start: Array,
        i: Count,
        c: Array,
    ) -> tuple[PyTree, PyTree, Array]:
        _, _, rows, method = fixed

        def flat(numbers: PyTree) -> Flat:
            return flat_of(fixed, i, numbers[0][0], numbers[1])

        given = (params, own)
        after = rows.mode[i + 1]
        cotangents = pull_back(
            flat,
            method,
            given,
            lambda p: p[0][1],
            row(rows, start, i),
            after,
            (c[0], c[1:]),
        )
        return *cotangents[0], jnp.concatenate([cotangents[1][None], cotangents[2]])

    return RowMap(forwards, backwards)


def _differentiable(
    problem: Callable[[PyTree, PyTree], tuple[Problem, Array]], call: Call
) -> Callable[..., PyTree]:
    """The run `(params, y0, others)` of a problem, and its first derivatives by a sweep
    over its rows.

    - `problem`: what a run needs and its initial mode, from
      `params = (numbers of the system, t1, t0)` and all others
    - `call`: as of `hybridsolve`
    """

    def solved(
        params: PyTree, flat_y0: Array, others: PyTree, direction: PyTree | None = None
    ) -> PyTree:
        p, mode0 = problem(params, others)
        if direction is not None:
            p = p._replace(direction=direction, method=p.method.with_tangents())
        packed, count, code, stats = _loop.run(p, flat_y0, mode0)
        rows = unpack_rows(packed, flat_y0.shape[0])
        return rows.t, rows.y, with_fields(rows, t=None, y=None), (count, code, stats)

    @jax.custom_jvp
    def run(params: PyTree, flat_y0: Array, others: PyTree) -> PyTree:
        return solved(params, flat_y0, others)

    @run.defjvp
    def _(primals: PyTree, tangents: PyTree) -> tuple[PyTree, PyTree]:
        params, flat_y0, others = primals
        d_params, d_y0, _ = tangents
        p, mode0 = problem(params, others)
        # (out here, as XLA hands maxima of long lists to a library, which the parts of
        # a derivative must not call)
        direction = generic_direction(p.flat)
        t, y, rows, (count, code, stats) = call(
            lambda arrays: solved(*arrays), (*primals, direction)
        )
        starts = jnp.concatenate([t[:, None], y], axis=1)

        rolled = p.method.rolled().with_fixed_jacobian(
            lambda t, y: p.flat.rhs(t, y, mode0), p.t0, flat_y0
        )
        numbers, t1, t0 = params
        places = _places(problem, params, others, mode0)

        def of_row(numbers: PyTree, mode: Array, after: Array) -> Flat:
            return problem((numbers, t1, t0), others)[0].flat.near(mode, after)

        def entries(numbers: PyTree) -> list[Array]:
            """What each row keeps of long lists, (rows, …)."""

            def kept(mode: Array, after: Array) -> list[Array]:
                return [
                    x
                    for x, i in zip(
                        _numbers(of_row(numbers, mode, after)), places, strict=True
                    )
                    if i is None
                ]

            return jax.vmap(kept)(rows.mode[:-1], rows.mode[1:])

        def shared(numbers: PyTree) -> list[Array]:
            return [x for i, x in enumerate(jax.tree.leaves(numbers)) if i in places]

        own, d_own = jax.jvp(entries, (numbers,), (d_params[0],))
        moves = (
            (shared(d_params[0]), *d_params[1:]),
            d_own,
            jnp.concatenate([d_params[2][None], d_y0]),
        )
        fixed = params, others, rows, rolled
        few = shared(numbers), t1, t0
        d = sweep(
            _row_map(problem, places), fixed, few, own, starts, count, moves, call
        )
        # a record that was too short does not reach the end: its derivatives must not
        # look like those of the run
        d = d * jnp.where(code == Code.STEP_LIMIT, jnp.nan, 1.0)
        return (t, y, rows, (count, code, stats)), (
            d[:, 0],
            d[:, 1:],
            *jax.tree.map(no_tangent, (rows, (count, code, stats))),
        )

    return run


def hybridsolve(
    system: AbstractHybridSystem,
    y0: PyTree,
    mode0: PyTree,
    t0: Scalar | float,
    t1: Scalar | float,
    method: AbstractMethod,
    settings: Settings,
    *,
    call: Call = lambda function, arrays: function(arrays),
) -> Record:
    """Integrate a hybrid system `ẏ = f(t, y, mode)` from `(t0, y0, mode0)` to `t1`
    through all its events.

    - `system`: rates, guards, transitions and jumps
    - `y0`, `mode0`: initial state and mode, any PyTrees of arrays
    - `method`: a Runge–Kutta or Rosenbrock method
    - `settings`: tolerance and limits of steps and events
    - `call(function, arrays)`: calls the parts of a derivative, each a function of a
      tree of arrays: who calls decides how they are compiled

    A guard is positive while its mode holds. The step on which it becomes negative is
    truncated at its root, the system gives the new mode and the state after the event,
    and the integration continues from there. The record has every step; its `code` is a
    `Code` or one of the system, and no exception is raised. First derivatives, forward
    and reverse, pass through the events.

    Example:
        >>> import jax.numpy as jnp
        >>> class Ball(sb.hybrid.AbstractHybridSystem):  # falls from 1 m, stays where it lands
        ...     def rhs(self, t, y, mode):
        ...         return y[1], jnp.where(mode > 0, 0.0, -9.81)
        ...     def guards(self, t, y, mode):
        ...         return {"ground": jnp.where(mode > 0, 1.0, y[0])}
        ...     def transition(self, t, y, mode, fired, at_stop):
        ...         return mode + 1, 0
        ...     def reset(self, t, y, before, after):
        ...         return 0.0 * y[0], 0.0 * y[1]
        ...     def next_stop(self, mode):
        ...         return math.inf
        ...     def scales(self):
        ...         return 1.0, 1.0
        >>> settings, method = sb.hybrid.Settings(1e-10, 100), sb.hybrid.Rodas5P()
        >>> record = sb.hybrid.hybridsolve(Ball(), (1.0, 0.0), np.array(0), 0.0, 2.0, method, settings)
        >>> record.events[0].name, round(record.events[0].time, 9) == round(math.sqrt(2 / 9.81), 9)
        ('ground', True)
    """
    import equinox as eqx

    y0 = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), y0)
    t0 = jnp.asarray(t0, jnp.float64)
    t1 = jnp.asarray(t1, jnp.float64)
    flat_y0 = ravel(y0, jnp.float64)
    flat_mode0 = pack_mode(mode0)
    y_like, mode_like = templates(y0, mode0)
    method = fitted(system, method)
    numbers, rest = eqx.partition(system, eqx.is_inexact_array)
    others, structure = eqx.partition((rest, settings, flat_mode0), eqx.is_array)

    def problem(params: PyTree, others: PyTree) -> tuple[Problem, Array]:
        numbers, t1, t0 = params
        rest, settings, mode0 = eqx.combine(others, structure)
        whole: AbstractHybridSystem = eqx.combine(numbers, rest)
        weights = weights_of(whole, y_like)
        return Problem(
            flatten(whole, y_like, mode_like), method, *weights, t0, t1, settings
        ), mode0

    run = _differentiable(problem, call)
    # JAX looks traced functions up together with the mesh; its absence is written
    # differently here and inside of derivatives
    with jax.sharding.use_abstract_mesh(jax.sharding.get_abstract_mesh()):
        t, y, rows, (count, code, stats) = run((numbers, t1, t0), flat_y0, others)
    rows = with_fields(rows, t=t, y=y)
    return Record(system, method, y_like, mode_like, t1, rows, count, code, stats)


# --- long runs in parts -------------------------------------------------------------


def solve_segment(
    given: Given, carried: Array, limit: Count | int
) -> tuple[Record, Array]:
    """One part of `hybridsolve`, at most `limit` attempts (up to `max_steps`), and the
    start of the next part.

    `carried` comes from the part before, or from `beginning(…)`. Joined, the parts are
    one run to the last bit for any lengths: nothing is decided again at a joint. Not
    differentiable.
    """
    p, flat_y0, flat_mode0 = problem_of(given)
    # all of a carry is one vector, in which whole numbers are exact; one that begins
    # with NaN begins the run
    start = started(p, flat_y0, flat_mode0)
    x, n = pack(start)
    fresh = jnp.isnan(carried[0])
    x = jnp.where(fresh, x, carried[: x.size])
    n = jnp.where(fresh, n, carried[x.size :].astype(n.dtype))
    (x, n), rows, count = advanced(
        p, (x, n), start, empty_rows(p, flat_y0, flat_mode0), limit
    )
    packed, count, code, stats = with_last_row(unpack((x, n), start), rows, count)
    rows = unpack_rows(packed, flat_y0.shape[0])
    likes = templates(given.y0, given.mode0)
    record = Record(given.system, p.method, *likes, p.t1, rows, count, code, stats)
    return record, jnp.concatenate([x, n.astype(x.dtype)])


def problem_of(given: Given) -> tuple[Problem, Array, Array]:
    """A run that is not differentiated, on flat vectors, with its initial state and
    mode."""
    system, y0, mode0, t0, t1, method, settings = given
    flat = flatten(system, y0, mode0)
    weights = weights_of(system, templates(y0, mode0)[0])
    times = jnp.asarray(t0, jnp.float64), jnp.asarray(t1, jnp.float64)
    p = Problem(flat, fitted(system, method), *weights, *times, settings)
    return p, ravel(y0, jnp.float64), pack_mode(mode0)


def beginning(given: Given) -> np.ndarray:
    """Start of a run for `solve_segment`."""
    carry = jax.eval_shape(lambda: started(*problem_of(given)))
    return np.full(sum(leaf.size for leaf in jax.tree.leaves(carry)), np.nan)


def concatenate(parts: Sequence[Rows], last: Record, room: int) -> Record:
    """The rows of all parts as one record with space for `room` attempts; `last` is the
    part that ended the run."""
    count = sum(len(part.t) for part in parts)

    def column(end: Array, *leaves: Array) -> np.ndarray:
        whole = np.zeros((room + 1, *end.shape[1:]), end.dtype)
        np.concatenate(leaves, out=whole[:count])
        whole[count] = np.asarray(end)[int(last.count)]
        return whole

    rows = jax.tree.map(column, last.rows, *parts)
    rows, count = jax.device_put((rows, np.asarray(count, np.int32)))
    return with_fields(last, rows=rows, count=count)
