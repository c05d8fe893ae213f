"""Many runs side by side: lanes that reach an event wait for the others, and only
events are recorded.

Under `vmap` an event of one lane costs all lanes the work of an event. So an attempt
that may be more than a plain step is left alone until no lane can take a plain step;
then all of them are evaluated at once. A lane that waits repeats its attempt and
decides what it would have decided by itself: a run takes the same steps as a single
one.

Greatest values (`extremes`) are followed while a run is integrated: of its steps only
those are kept that may have the highest turning points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int, PyTree

from . import _thresholds as at
from ._loop import (
    _RUNNING,
    Attempt,
    AttemptOutcome,
    Problem,
    _after_restart,
    _attempt,
    _judge,
    _jumped,
    _stepped,
    any_lane,
    code_of,
    is_event,
    kind_of,
    started,
)
from ._search import Carry
from ._solve import Given, Record, problem_of
from .arrays import Array, Count, Mark, State, templates
from .extremes import Followed, Watched, follow, greatest_of_steps, nothing_followed
from .system import SKIPPED, STOPPED, Rows


class Lane(NamedTuple):
    """Present state of a run, and its states at the instants at which all lanes were
    evaluated.

    - `judged`: how many such instants there were, the same for all lanes
    - `used`: attempts of this lane
    - `starts`: time, state and mode after each, the first from the start of the run
    - `kinds`: what happened there
    """

    carry: Carry
    used: Count
    judged: Count
    starts: Float[Array, "row column"]
    kinds: Int[Array, " row"]
    followed: Followed | None


def _plain(attempt: Attempt) -> AttemptOutcome:
    """The decision on an attempt without an event."""
    no = jnp.zeros_like(attempt.accept)
    infinity = jnp.full_like(attempt.h, jnp.inf)
    return AttemptOutcome(
        instant=no,
        land=no,
        retake=no,
        stop=attempt.accept & attempt.reaches,
        late=no,
        step_fraction=infinity,
        crossed_though_rejected=no,
        guard=jnp.zeros_like(attempt.accept, jnp.int32),
        delta=jnp.zeros_like(attempt.h),
    )


def _may_be_more(problem: Problem, attempt: Attempt) -> Mark:
    """Whether an attempt may be more than a plain step: every one with an event or a
    retake, and some others."""
    if problem.settings.guard_samples:
        return jnp.ones_like(attempt.accept)
    # (no attempt that lands is missed by rounding)
    near = at.REACH * problem.near(attempt.h, attempt.resolution)
    arrives = jnp.any(
        (attempt.g_rate1 < 0) & (jnp.abs(attempt.g1) <= -near * attempt.g_rate1)
    ) | (attempt.h <= at.HIDING * attempt.resolution)
    return jnp.where(
        attempt.accept,
        attempt.needs_search
        | arrives
        | (attempt.reaches & (attempt.target < problem.t1)),
        attempt.finite & attempt.any_crosses,
    )


def _pick(mark: Mark, new: PyTree, old: PyTree) -> PyTree:
    return jax.tree.map(lambda x, y: jnp.where(mark, x, y), new, old)


def _row(carry: Carry) -> Float[Array, " column"]:
    return jnp.concatenate([carry.t[None], carry.y, carry.mode.astype(carry.y.dtype)])


def _runs(problem: Problem, carry: Carry, used: Count) -> Mark:
    return (carry.status == _RUNNING) & (used < problem.settings.max_steps)


def _advanced(problem: Problem, lane: Lane, watched: Watched | None) -> Lane:
    """One attempt of every lane that can continue, or of all that wait."""
    running = _runs(problem, lane.carry, lane.used)
    # lanes at their end join those that only evaluate, so that these are sometimes
    # alone
    carry = lane.carry._replace(
        restart_stage=jnp.where(running, lane.carry.restart_stage, 2)
    )
    restarts = running & (carry.restart_stage > 0)
    attempt = _attempt(problem, carry)
    waits = running & ~restarts & _may_be_more(problem, attempt)
    plain = _pick(
        running & ~waits, _stepped(carry, attempt, _plain(attempt), problem), lane.carry
    )
    nothing = jnp.full_like(carry.status, SKIPPED)

    plainly = running & ~waits & ~restarts & attempt.accept

    def together() -> tuple[Carry, Count, Mark, Array]:
        outcome = _judge(problem, carry, attempt)
        event = waits & is_event(problem, attempt, outcome)
        new = _pick(
            event,
            _jumped(problem, carry, attempt, outcome),
            _stepped(carry, attempt, outcome, problem),
        )
        kind = kind_of(outcome, STOPPED).astype(jnp.int32)
        stepped = waits & attempt.accept & ~outcome.retake & ~outcome.instant
        return (
            _pick(waits, new, plain),
            jnp.where(event, kind, nothing),
            stepped,
            jnp.where(event, outcome.delta, 0.0),
        )

    def settled() -> Carry:
        return _pick(restarts, _after_restart(problem, carry, attempt), new)

    nobody = any_lane(waits) & ~any_lane(running & ~waits)
    new, kind, stepped, delta = jax.lax.cond(
        nobody, together, lambda: (plain, nothing, plainly, jnp.zeros_like(attempt.h))
    )
    new = jax.lax.cond(any_lane(restarts), settled, lambda: new)
    followed = lane.followed
    if watched is not None and followed is not None:
        # (what an attempt evaluates just after a restart is the start of the next step)
        begins = restarts & (carry.restart_stage == 2)
        end = watched.watch(
            attempt.t1 + delta, attempt.y1 + delta * attempt.f1, carry.mode, attempt.f1
        )
        row = jnp.concatenate(
            [
                jnp.stack([carry.t, attempt.h + delta]),
                carry.y,
                carry.mode.astype(carry.y.dtype),
            ]
        )
        followed = follow(followed, end, row, begins, stepped)
    counts = running & ~restarts & (nobody | ~waits)
    # (at the counter that all lanes share, so that there is no scatter; it moves on
    # when they were judged)
    k = lane.judged
    return Lane(
        carry=new,
        used=lane.used + counts.astype(jnp.int32),
        judged=k + nobody.astype(jnp.int32),
        starts=jax.lax.dynamic_update_slice(
            lane.starts, _row(new)[None], (k + 1, jnp.zeros_like(k))
        ),
        kinds=jax.lax.dynamic_update_slice(lane.kinds, kind[None], (k,)),
        followed=followed,
    )


def _run(
    problem: Problem,
    y0: State,
    mode0: Int[Array, " mode"],
    room: int,
    watched: Watched | None,
) -> Lane:
    start = started(problem, y0, mode0)
    zero = jnp.asarray(0, jnp.int32)
    problem = problem.at_start(start)
    row = _row(start)
    # (one row more for the end, one for what is written where no room is left)
    starts = jnp.zeros((room + 2, row.shape[0]), row.dtype).at[0].set(row)
    row_of_step = jnp.concatenate([jnp.zeros(2), y0, mode0.astype(y0.dtype)])
    followed = (
        None if watched is None else nothing_followed(len(watched.groups), row_of_step)
    )
    begin = Lane(
        start, zero, zero, starts, jnp.full(room + 2, SKIPPED, jnp.int32), followed
    )

    def going(lane: Lane) -> Mark:
        return any_lane(_runs(problem, lane.carry, lane.used)) & (lane.judged < room)

    end = jax.lax.while_loop(
        going, lambda lane: _advanced(problem, lane, watched), begin
    )
    place = (end.judged + 1, jnp.zeros_like(end.judged))
    return end._replace(
        starts=jax.lax.dynamic_update_slice(end.starts, _row(end.carry)[None], place)
    )


def hybridsolve_lane(
    given: Given, room: int, watched: Watched | None = None
) -> tuple[Record, Float[Array, " group"] | None]:
    """As `hybridsolve`, to be mapped over many runs by `vmap`; the record has the
    events alone.

    A row begins at the start of the run or where the lanes were judged, and lasts as
    long as nothing but plain steps follow; its `kind` is the event at its end (SKIPPED:
    nothing in this lane). States inside the rows cannot be looked at. `room`: how often
    lanes may be judged; a run for which it does not suffice ends with the code
    STEP_LIMIT. `watched`: quantities whose greatest values are wanted as well, each by
    itself. Not differentiable.
    """
    problem, flat_y0, flat_mode0 = problem_of(given)
    end = _run(problem, flat_y0, flat_mode0, room, watched)
    tops = None
    if watched is not None and end.followed is not None:
        tops = greatest_of_steps(
            end.followed,
            watched.watch,
            problem.flat,
            problem.method.rolled(),
            flat_y0.shape[0],
        )
    ny = flat_y0.shape[0]
    nothing = jnp.zeros_like(end.starts[:, 0])
    rows = Rows(
        t=end.starts[:, 0],
        y=end.starts[:, 1 : 1 + ny],
        h=nothing,
        delta=nothing,
        kind=end.kinds,
        guard=jnp.zeros_like(end.kinds),
        mode=end.starts[:, 1 + ny :].astype(jnp.int32),
    )
    carry = end.carry
    record = Record(
        given.system,
        problem.method,
        *templates(given.y0, given.mode0),
        problem.t1,
        rows,
        end.judged + 1,
        code_of(carry),
        carry.stats,
    )
    return record, tops
