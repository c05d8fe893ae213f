"""The flat loop: one iteration is one step attempt, which ends as accepted, rejected,
truncated or an event.

Each goes through `_attempt` → `_judge` → `_stepped`, `_jumped` or `_after_restart` → a
row of the record. `accept` says that the step is good enough; `retake` that it is cut
short, `land` and `instant` that a guard fires at its end or at its start, `stop` that it
ends at a time breakpoint or at the end of the run.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Bool, Float, Int, PyTree

from . import _thresholds as at
from ._method import AbstractMethod
from ._search import (
    Carry,
    Found,
    Packed,
    Stats,
    crossed,
    exceeded,
    leaving,
    pack,
    sampled,
    search,
    suspicious,
    unpack,
)
from .arrays import (
    Array,
    Count,
    GuardMarks,
    Guards,
    Mark,
    Scalar,
    State,
    any_of_each,
    entry,
    first_least,
)
from .struct import traced_once
from .system import (
    ADVANCED,
    FINISHED,
    HEAD,
    INSTANT,
    LANDED,
    SKIPPED,
    STOPPED,
    Code,
    Flat,
    Settings,
    pack_row,
)

_RUNNING = np.int32(-1)


def any_lane(marks: Bool[Array, " *n"]) -> Mark:
    """Whether any is set, of any run where several are mapped side by side."""
    from equinox.internal import unvmap_any

    return unvmap_any(marks)


def _jvp(function: Callable, primals: tuple, tangents: tuple) -> tuple:
    """Values of a function and their derivatives along a change of its numbers
    (`equinox.filter_jvp`)."""
    from equinox import filter_jvp

    return filter_jvp(function, primals, tangents)


PackedRows = Float[Array, "row column"]
Ended = tuple[PackedRows, Count, Count, Stats]


class Problem(NamedTuple):
    """Everything one run needs besides its starting point."""

    flat: Flat
    method: AbstractMethod
    weights: State  # 1 / typical size, 0 keeps a state out of the error norm
    counted: Scalar  # how many states are in it
    t0: Scalar
    t1: Scalar
    settings: Settings
    # of all numbers of `flat`: the tangent of the state along it steers steps as well
    direction: PyTree | None = None

    @property
    def tangents(self) -> int:
        """How many tangents steer the steps beside the values."""
        return int(self.direction is not None)

    def at_start(self, start: Carry) -> "Problem":
        """The same with what the method can compute once, of a run that begins so."""

        def rhs(t: Scalar, y: State) -> State:
            return self.flat.rhs(t, y, start.mode)

        method = self.method.with_fixed_jacobian(rhs, start.t, start.y)
        return self._replace(method=method)

    @property
    def guard_tolerance(self) -> Array:
        """A guard this close to 0 counts as reached after a landing."""
        return at.REACHED * self.settings.rtol + at.REACHED_AT_LEAST

    def near(self, h: Scalar, resolution: Scalar) -> Array:
        """Time over which a move along the rates is as exact as a step of length
        `h`."""
        share = at.NEAR * jnp.sqrt(self.settings.rtol)
        return jnp.maximum(share * h, at.NEAR_AT_LEAST * resolution)

    def norms(self, size: State, *several: State) -> list[Scalar]:
        """Root mean square of each vector in units of the tolerance at states of the
        given size; a number only if all its entries are, those without weight as
        well."""
        unit = self.weights / (1.0 + size * self.weights)
        squares = [(x * unit) ** 2 for x in several]
        sums = (
            [jnp.sum(squares[0])]
            if len(several) == 1
            else jnp.unstack(jnp.sum(jnp.stack(squares), axis=1))
        )
        return [jnp.sqrt(total / self.counted) / self.settings.rtol for total in sums]


class Attempt(NamedTuple):
    """One step attempt before anything is decided about it."""

    h: Scalar
    t1: Scalar
    target: Scalar  # the next time breakpoint
    reaches: Mark  # the attempt ends there
    y1: State
    f1: State
    g1: Guards
    g_rate1: Guards
    touches: GuardMarks  # limits that may be reached, but will not be exceeded
    crosses: GuardMarks
    any_crosses: Mark
    needs_search: Mark  # needs a search
    unsound: Mark  # a guard is infinite or not a number
    accept: Mark
    finite: Mark
    h_next: Scalar
    resolution: Scalar  # time differences below it are rounding
    tangents1: tuple[State, ...]


class AttemptOutcome(NamedTuple):
    """Decision on an attempt."""

    instant: Mark
    land: Mark
    retake: Mark
    stop: Mark
    late: Mark  # `instant`, by a limit that the time breakpoint had to come before
    step_fraction: Scalar
    crossed_though_rejected: Mark  # rejected, and a guard crosses
    guard: Count
    delta: Scalar


def _attempt(problem: Problem, carry: Carry) -> Attempt:
    target = jnp.minimum(problem.flat.next_stop(carry.mode, carry.y), problem.t1)
    room = jnp.maximum(target - carry.t, 0.0)
    wish = jnp.minimum(jnp.minimum(carry.h, carry.h_limit), problem.settings.max_step)
    restarting = carry.restart_stage > 0
    reaches = (wish * at.REACH >= room) & ~restarting
    h = jnp.where(restarting, carry.h_limit, jnp.where(reaches, room, wish))
    t1 = jnp.where(reaches, target, carry.t + h)
    y1, error, tangents1, tangent_errors = _moved(problem, carry, h)
    f1, g1, g_rate1, limits = problem.flat.rates_and_guards(t1, y1, carry.mode)
    error = error + h * problem.method.error_of_rate * f1
    reach = jnp.maximum(jnp.abs(carry.y), jnp.abs(y1))
    # (so that a rate that is no number rejects the step)
    [size] = problem.norms(reach, error + 0.0 * f1)
    looser = (
        jnp.maximum(jnp.sqrt(at.OF_TANGENTS / problem.settings.rtol), 1.0)
        if tangents1
        else 1.0
    )
    for v1, error_of_tangent in zip(tangents1, tangent_errors, strict=True):
        # a tangent that is not finite (an infinite slope) cannot steer; the derivative
        # itself shows it
        [of_tangent] = problem.norms(jnp.maximum(reach, jnp.abs(v1)), error_of_tangent)
        size = jnp.where(
            jnp.isfinite(of_tangent), jnp.maximum(size, of_tangent / looser), size
        )
    touches = limits & ~exceeded(carry, h, g1, g_rate1, target - t1)
    crosses = crossed(carry, h, g1, g_rate1, problem.guard_tolerance) & ~touches
    needs_search = suspicious(carry, h, g1, g_rate1, problem.guard_tolerance, crosses)
    any_crosses, needs_search, unsound = any_of_each(
        crosses, needs_search, ~jnp.isfinite(g1)
    )
    # an overflow in an overlong step is a step too long, not an answer
    finite = jnp.isfinite(size) & ~unsound
    factor = at.SAFETY * jnp.maximum(size, at.LEAST_ERROR) ** (
        -1.0 / problem.method.order
    )
    factor = jnp.clip(factor, at.SHRINK, at.GROW)
    factor = jnp.where(finite, factor, at.SHRINK)
    accept = finite & (size <= 1.0) & (carry.status == _RUNNING) & ~restarting
    # a step cut short does not shrink the length that the controller proposes
    h_next = jnp.where(
        accept & (h < carry.h), jnp.maximum(carry.h, h * factor), h * factor
    )
    resolution = (
        at.ROUNDINGS
        * at.EPS
        * jnp.maximum(jnp.abs(carry.t), at.SHARE_OF_TIME * (problem.t1 - problem.t0))
    )
    guards = (g1, g_rate1, touches, crosses, any_crosses, needs_search, unsound)
    return Attempt(
        h,
        t1,
        target,
        reaches,
        y1,
        f1,
        *guards,
        accept,
        finite,
        h_next,
        resolution,
        tangents1,
    )


Moved = tuple[State, State, tuple[State, ...], tuple[State, ...]]


def _moved(problem: Problem, carry: Carry, h: Array) -> Moved:
    """State at the end of an attempt and the error estimate of the method, and both for
    the tangents; just after a restart one move along `f`."""
    restarting = carry.restart_stage > 0
    along = carry.y + h * carry.f
    nothing = jnp.zeros_like(along)

    def attempt(flat: Flat, y: State, f: State) -> tuple[State, State]:
        return problem.method.attempt(
            lambda t, y: flat.rhs(t, y, carry.mode), carry.t, y, f, h
        )

    def step() -> Moved:
        if problem.direction is None:
            y, error = attempt(problem.flat, carry.y, carry.f)
            return jnp.where(restarting, along, y), error, (), ()
        [tangent] = carry.tangents
        moving = (
            problem.direction,
            tangent,
            _rate_along(problem, carry.t, carry.y, tangent, carry.mode),
        )
        (y, error), (v1, error_of_tangent) = _jvp(
            attempt, (problem.flat, carry.y, carry.f), moving
        )
        if problem.method.error_of_rate:
            rate = _rate_along(problem, carry.t + h, y, v1, carry.mode)
            error_of_tangent = (
                error_of_tangent + h * problem.method.error_of_rate * rate
            )
        v1 = jnp.where(jnp.isfinite(v1), v1, tangent)
        return (
            jnp.where(restarting, along, y),
            error,
            (v1,),
            (jnp.where(restarting, 0.0, error_of_tangent),),
        )

    resting = along, nothing, carry.tangents, (nothing,) * problem.tangents
    return jax.lax.cond(any_lane(~restarting), step, lambda: resting)


def _rate_along(
    problem: Problem, t: Scalar, y: State, tangent: State, mode: Int[Array, " mode"]
) -> State:
    """Derivative of the rates along the direction of the numbers and the tangent `v` of
    the state."""
    return _jvp(
        lambda flat, y: flat.rhs(t, y, mode),
        (problem.flat, y),
        (problem.direction, tangent),
    )[1]


def _after_restart(problem: Problem, carry: Carry, attempt: Attempt) -> Carry:
    """The carry after one of the two looks that follow a restart, at the rates there
    and a little further on.

    The first attempt's length after Hairer, Nørsett & Wanner, *Solving ODEs I*, II.4.
    Rates and guards are found by the code of the attempts, as another copy of the
    equations would have to be compiled.
    """
    first = carry.restart_stage == 2

    def pick(new: ArrayLike, old: ArrayLike) -> Array:
        return jnp.where(first, new, old)

    f = pick(attempt.f1, carry.f)
    g = pick(attempt.g1, carry.g)
    size = jnp.abs(carry.y)
    span = problem.t1 - problem.t0
    d0, d1, d2 = problem.norms(size, carry.y, f, attempt.f1 - f)
    # a state or rate of zero gives no time scale: take a small share of the run
    look = at.FIRST_LOOK * d0 / jnp.where(d1 > 0, d1, 1.0)
    h0 = jnp.where(
        (d0 < at.NO_SCALE) | (d1 < at.NO_SCALE), at.SHARE_OF_RUN * span, look
    )
    h0 = jnp.minimum(h0, span)
    d2 = d2 / jnp.where(h0 > 0, h0, 1.0)
    d = jnp.where(jnp.isfinite(d2), jnp.maximum(d1, d2), d1)
    limits = d > at.NO_RATE
    h1 = jnp.where(
        limits,
        (at.FIRST_LOOK / jnp.where(limits, d, 1.0)) ** (1.0 / problem.method.order),
        span,
    )
    h = jnp.where((d1 == 0) & (d2 == 0), span, jnp.minimum(at.LONGEST_FIRST * h0, h1))
    sound = jnp.isfinite(d0) & jnp.isfinite(d1) & ~(first & attempt.unsound)
    return carry._replace(
        h=pick(carry.h, jnp.minimum(carry.h, h)),
        h_limit=pick(h0, jnp.inf),
        f=f,
        g=g,
        g_rate=pick(attempt.g_rate1, carry.g_rate),
        armed=pick(g > problem.guard_tolerance, carry.armed),
        status=jnp.where(sound, carry.status, np.int32(Code.NOT_FINITE)).astype(
            jnp.int32
        ),
        restart_stage=carry.restart_stage - 1,
    )


def _lost_to_rounding(
    carry: Carry, attempt: Attempt, time_to_zero: Guards
) -> GuardMarks:
    """Guards at zero that steps towards it no longer move, as rounding of the state
    swallows what such a step adds."""
    short = (attempt.h > 0) & (attempt.h <= at.HIDING * attempt.resolution)
    still = (jnp.abs(time_to_zero) <= at.STILL_STEPS * attempt.h) & (
        carry.g - attempt.g1 < -at.STILL_SHARE * attempt.g_rate1 * attempt.h
    )
    return (
        short
        & carry.armed
        & (attempt.g_rate1 < 0)
        & ((jnp.abs(attempt.g1) <= at.TINY) | still)
    )


def _judge(problem: Problem, carry: Carry, attempt: Attempt) -> AttemptOutcome:
    tol = problem.guard_tolerance
    crosses = attempt.crosses
    look = (
        attempt.accept
        if problem.settings.guard_samples
        else attempt.accept & attempt.needs_search
    )
    # what was rejected may have been so for what lies beyond an event: the next attempt
    # goes no further than there
    crossed_though_rejected = (
        ~attempt.accept
        & attempt.finite
        & (carry.restart_stage == 0)
        & attempt.any_crosses
    )

    def looked() -> Found:
        negative_from: Array | float = jnp.inf
        if problem.settings.guard_samples:
            negative_from = sampled(
                problem.flat.guards,
                carry,
                attempt.h,
                attempt.y1,
                attempt.f1,
                tol,
                problem.settings.guard_samples,
            )
        return search(
            carry, attempt.h, attempt.g1, attempt.g_rate1, tol, crosses, negative_from
        )

    nothing = Found(jnp.asarray(jnp.inf), jnp.asarray(0, jnp.int32), jnp.asarray(False))
    earliest = jax.lax.cond(
        any_lane(look | crossed_though_rejected), looked, lambda: nothing
    )

    # landing: every guard that crossed lies so near that a move along f is as exact as
    # the step itself
    time_to_zero = -attempt.g1 / jnp.where(attempt.g_rate1 == 0, 1.0, attempt.g_rate1)
    # (what lies beyond the next time breakpoint comes after it, as the rates may be
    # others there; a guard within its tolerance has arrived)
    before = (
        time_to_zero
        <= attempt.target - attempt.t1 + at.NEAR_AT_LEAST * attempt.resolution
    ) | (attempt.g1 <= tol)
    arrives = (
        jnp.abs(time_to_zero) <= problem.near(attempt.h, attempt.resolution)
    ) & before
    lands = (
        (attempt.g_rate1 < 0)
        & arrives
        & (carry.armed | leaving(carry, attempt.h) | crosses)
        & ~attempt.touches
    )
    # the bracket has shrunk to rounding: fire here
    lost = crosses & (attempt.h <= attempt.resolution)
    lost = (
        lost | (_lost_to_rounding(carry, attempt, time_to_zero) & ~attempt.touches)
    ) & ~lands
    # (+inf: no guard arrives; −inf: one that crossed does not arrive, so no landing)
    none = jnp.where(crosses, -jnp.inf, jnp.inf)
    landing_time = jnp.where(lost, 0.0, jnp.where(lands, time_to_zero, none))
    delta, landing = first_least(landing_time)
    instant = look & earliest.instant
    land = attempt.accept & ~instant & jnp.isfinite(delta)
    neither = ~(instant | land)
    retake = look & neither & (earliest.step_fraction < jnp.inf)
    return AttemptOutcome(
        instant=instant,
        land=land,
        retake=retake,
        stop=attempt.accept & neither & ~retake & attempt.reaches,
        late=instant & entry(carry.touched_at_breakpoint, earliest.guard),
        step_fraction=earliest.step_fraction,
        crossed_though_rejected=crossed_though_rejected
        & (earliest.step_fraction < jnp.inf),
        guard=jnp.where(instant, earliest.guard, landing),
        delta=jnp.where(land, jnp.minimum(delta, attempt.target - attempt.t1), 0.0),
    )


def _count(n: Array, happened: Array) -> Array:
    return n + happened.astype(jnp.int32)


def _stepped(
    carry: Carry, attempt: Attempt, outcome: AttemptOutcome, problem: Problem
) -> Carry:
    """The carry after an attempt that was no event."""
    step = attempt.accept & ~outcome.retake

    def pick(new: ArrayLike, old: ArrayLike) -> Array:
        return jnp.where(step, new, old)

    # known anew at a retake, shorter after a step
    crosses_within = jnp.where(
        outcome.retake,
        jnp.where(attempt.any_crosses, attempt.h, jnp.inf),
        pick(carry.crosses_within - attempt.h, carry.crosses_within),
    )
    crosses_within = jnp.where(crosses_within <= 0, jnp.inf, crosses_within)
    risen = (
        carry.armed
        | (attempt.g1 > problem.guard_tolerance)
        | (leaving(carry, attempt.h) & (attempt.g1 > at.TINY))
    )
    # (after a restart nothing is accepted either, but then this carry is not taken)
    too_small = ~attempt.accept & (attempt.h_next <= at.TOO_SHORT * attempt.resolution)
    status = jnp.where(
        too_small,
        jnp.where(
            attempt.finite, np.int32(Code.STEP_TOO_SMALL), np.int32(Code.NOT_FINITE)
        ),
        _RUNNING,
    )
    status = jnp.where(
        outcome.stop & (attempt.target >= problem.t1),
        problem.flat.code_at_end(carry.mode),
        status,
    )
    stats = carry.stats._replace(
        accepted=_count(carry.stats.accepted, step),
        rejected=_count(carry.stats.rejected, ~attempt.accept),
        retaken=_count(carry.stats.retaken, outcome.retake),
    )
    return carry._replace(
        t=pick(attempt.t1, carry.t),
        h=jnp.where(outcome.retake, carry.h, attempt.h_next),
        h_limit=jnp.where(
            outcome.retake | outcome.crossed_though_rejected,
            outcome.step_fraction * attempt.h,
            pick(crosses_within, carry.h_limit),
        ),
        crosses_within=crosses_within,
        y=pick(attempt.y1, carry.y),
        f=pick(attempt.f1, carry.f),
        g=pick(attempt.g1, carry.g),
        g_rate=pick(attempt.g_rate1, carry.g_rate),
        armed=pick(risen, carry.armed),
        status=status.astype(jnp.int32),
        retakes=jnp.where(outcome.retake, carry.retakes + 1, pick(0, carry.retakes)),
        events_at_instant=jnp.where(step & (attempt.h > 0), 0, carry.events_at_instant),
        stats=stats,
        tangents=tuple(map(pick, attempt.tangents1, carry.tangents)),
    )


def _jumped(
    problem: Problem, carry: Carry, attempt: Attempt, outcome: AttemptOutcome
) -> Carry:
    """The carry after an event: a guard fired, or a time breakpoint was reached."""
    t = jnp.where(outcome.instant, carry.t, attempt.t1 + outcome.delta)
    y = jnp.where(outcome.instant, carry.y, attempt.y1 + outcome.delta * attempt.f1)
    tol = problem.guard_tolerance
    at_guard = jnp.arange(carry.g.shape[0], dtype=jnp.int32) == outcome.guard
    # the guards at the landing, one move along their rates from the end of the step
    reached = carry.armed & (attempt.g1 + outcome.delta * attempt.g_rate1 <= tol)
    fired = jnp.where(
        outcome.instant,
        at_guard,
        (reached & ~attempt.touches) | (at_guard & outcome.land),
    )
    before = y
    y, mode, code = problem.flat.jump(t, before, carry.mode, fired, outcome.stop)
    moved = ~outcome.instant & (attempt.h > 0)

    by_guard = ~outcome.stop
    dt = t - carry.t_event
    apart = by_guard & (dt > at.ZENO_INTERVAL * (problem.t1 - problem.t0))
    zeno_guards = jnp.where(apart, at_guard, carry.zeno_guards | (at_guard & by_guard))
    again = by_guard & ~apart & (dt > 0) & entry(carry.zeno_guards, outcome.guard)
    zeno_count = jnp.where(apart, 0, _count(carry.zeno_count, again))
    events_at_instant = jnp.where(
        by_guard & (dt == 0),
        carry.events_at_instant + 1,
        jnp.where(moved, 0, carry.events_at_instant),
    )
    stats = carry.stats._replace(
        accepted=_count(carry.stats.accepted, ~outcome.instant),
        events=_count(carry.stats.events, by_guard),
        segments=carry.stats.segments + 1,
    )
    status = jnp.where(
        stats.events > jnp.asarray(problem.settings.max_events, jnp.int32),
        np.int32(Code.EVENT_LIMIT),
        _RUNNING,
    )
    status = jnp.where(zeno_count >= at.ZENO_COUNT, np.int32(Code.ZENO), status)
    status = jnp.where(
        events_at_instant >= problem.settings.max_chain, np.int32(Code.CHATTER), status
    )
    status = problem.flat.ended(code, status)
    return carry._replace(
        t=t,
        h=jnp.where(moved, attempt.h_next, carry.h),
        h_limit=jnp.zeros_like(t),
        crosses_within=jnp.full_like(t, jnp.inf),
        t_event=jnp.where(by_guard, t, carry.t_event),
        y=y,
        f=jnp.zeros_like(carry.f),
        touched_at_breakpoint=(reached | carry.touched_at_breakpoint)
        & attempt.touches
        & outcome.stop,
        zeno_guards=zeno_guards,
        status=status.astype(jnp.int32),
        retakes=jnp.zeros_like(carry.retakes),
        events_at_instant=events_at_instant,
        zeno_count=zeno_count,
        restart_stage=jnp.full_like(carry.restart_stage, 2),
        stats=stats,
        mode=mode,
        tangents=_tangents_after(problem, carry, attempt, outcome, t, before, mode),
    )


def _tangents_after(
    problem: Problem,
    carry: Carry,
    attempt: Attempt,
    outcome: AttemptOutcome,
    t: Scalar,
    y: State,
    mode: Int[Array, " mode"],
) -> tuple[State, ...]:
    """Tangents just after an event.

    The move of the event's time is left out, as it would take the derivatives of the
    guards: what steers the steps is how large and how smooth a tangent is, and every
    state keeps a part in it.
    """

    def after(flat: Flat, y: State) -> State:
        return flat.reset(t, y, carry.mode, mode)

    tangents = []
    for old, new in zip(carry.tangents, attempt.tangents1, strict=True):
        moved = _jvp(
            after,
            (problem.flat, y),
            (problem.direction, jnp.where(outcome.instant, old, new)),
        )[1]
        tangents.append(jnp.where(jnp.isfinite(moved), moved, old))
    return tuple(tangents)


def is_event(problem: Problem, attempt: Attempt, outcome: AttemptOutcome) -> Mark:
    """Whether an attempt is more than a step, an end of the run apart."""
    return (
        outcome.instant | outcome.land | (outcome.stop & (attempt.target < problem.t1))
    )


def kind_of(outcome: AttemptOutcome, otherwise: ArrayLike) -> Array:
    """What a row records where a guard fired, else what it records `otherwise`."""
    instant = jnp.where(outcome.instant, INSTANT, otherwise)
    return jnp.where(outcome.land | outcome.late, LANDED, instant)


def _iterate(
    problem: Problem, packed: Packed, like: Carry
) -> tuple[Packed, Float[Array, " column"], Mark]:
    """One attempt: the packed carry after it, the row that records it, and whether it
    was more than an evaluation."""
    carry = unpack(packed, like)
    restarting = carry.restart_stage > 0
    attempt = _attempt(problem, carry)
    outcome = _judge(problem, carry, attempt)
    event = is_event(problem, attempt, outcome)
    plain = pack(_stepped(carry, attempt, outcome, problem))

    def with_events() -> Packed:
        # lanes of a batch without an event take the plain step
        return jax.tree.map(
            lambda x, y: jnp.where(event, x, y),
            pack(_jumped(problem, carry, attempt, outcome)),
            plain,
        )

    after_event = jax.lax.cond(any_lane(event), with_events, lambda: plain)

    def with_restarts() -> Packed:
        return jax.tree.map(
            lambda x, y: jnp.where(restarting, x, y),
            pack(_after_restart(problem, carry, attempt)),
            after_event,
        )

    new = jax.lax.cond(any_lane(restarting), with_restarts, lambda: after_event)
    running = carry.status == _RUNNING
    new = jax.tree.map(lambda x, y: jnp.where(running, x, y), new, packed)
    stepped = attempt.accept & ~outcome.retake
    kind = jnp.where(
        outcome.stop,
        jnp.where(attempt.target < problem.t1, STOPPED, FINISHED),
        jnp.where(stepped, ADVANCED, SKIPPED),
    )
    kind = kind_of(outcome, kind)
    h = jnp.where(outcome.instant, 0.0, attempt.h)
    return (
        new,
        pack_row(carry.t, h, outcome.delta, kind, outcome.guard, carry.y, carry.mode),
        running & ~restarting,
    )


def started(problem: Problem, y0: State, mode0: Int[Array, " mode"]) -> Carry:
    """The carry before the first iteration; rates, guards and the first step's length
    are found as after an event."""
    nothing = jnp.zeros(
        jax.eval_shape(problem.flat.guards, problem.t0, y0, mode0).shape, y0.dtype
    )
    zero = jnp.asarray(0, jnp.int32)
    sound = jnp.isfinite(problem.t0) & jnp.isfinite(problem.t1)
    status = jnp.where(
        sound,
        jnp.where(problem.t1 > problem.t0, _RUNNING, np.int32(Code.COMPLETED)),
        np.int32(Code.NOT_FINITE),
    )
    infinity = jnp.full_like(problem.t0, jnp.inf)
    return Carry(
        t=problem.t0,
        h=infinity,
        h_limit=jnp.zeros_like(problem.t0),
        crosses_within=infinity,
        t_event=-infinity,
        y=y0,
        f=jnp.zeros_like(y0),
        g=nothing,
        g_rate=nothing,
        armed=nothing > 0,
        touched_at_breakpoint=nothing > 0,
        zeno_guards=nothing > 0,
        status=status.astype(jnp.int32),
        retakes=zero,
        events_at_instant=zero,
        zeno_count=zero,
        restart_stage=zero + 2,
        stats=Stats(zero, zero, zero, zero, zero + 1),
        mode=mode0,
        tangents=(_first_tangent(problem, y0),) * problem.tangents,
    )


def _first_tangent(problem: Problem, y0: State) -> State:
    """A change of every state by about its own size and its typical one; ledgers are
    driven by the others."""
    typical = jnp.where(
        problem.weights > 0,
        1.0 / jnp.where(problem.weights > 0, problem.weights, 1.0) + jnp.abs(y0),
        0.0,
    )
    return generic(y0.shape[0], seed=0) * typical


def generic(n: int, seed: int) -> np.ndarray:
    """`n` numbers of magnitude 0.5…1.5 and any sign: a direction in which nothing
    cancels by symmetry."""
    random = np.random.default_rng(seed)
    return random.uniform(0.5, 1.5, n) * random.choice([-1.0, 1.0], n)


def empty_rows(problem: Problem, y0: State, mode0: Int[Array, " mode"]) -> Array:
    return jnp.zeros(
        (problem.settings.max_steps + 1, HEAD + y0.shape[0] + mode0.shape[0]), y0.dtype
    )


def advanced(
    problem: Problem, packed: Packed, like: Carry, rows: PackedRows, limit: Count | int
) -> tuple[Packed, PackedRows, Count]:
    """The carry after `limit` more attempts or at the end of the run, the rows of
    these, and how many they were."""
    problem = problem.at_start(unpack(packed, like))

    def running(loop: tuple[Count, Packed, PackedRows]) -> Mark:
        i, (_, integers), _ = loop
        return (i < limit) & any_lane(integers[0] == _RUNNING)

    def body(
        loop: tuple[Count, Packed, PackedRows],
    ) -> tuple[Count, Packed, PackedRows]:
        i, packed, rows = loop
        packed, row, counts = _iterate(problem, packed, like)
        # (an evaluation alone leaves its row to the next attempt)
        following = i + any_lane(counts).astype(jnp.int32)
        return (
            following,
            packed,
            jax.lax.dynamic_update_slice(rows, row[None], (i, jnp.zeros_like(i))),
        )

    begin = (jnp.asarray(0, jnp.int32), packed, rows)
    count, packed, rows = jax.lax.while_loop(running, body, begin)
    return packed, rows, count


def with_last_row(carry: Carry, rows: PackedRows, count: Count) -> Ended:
    """Rows with the end of the run after the last attempt, their number, code and
    counts."""
    none = jnp.asarray(SKIPPED, jnp.int32)
    last = pack_row(
        carry.t,
        jnp.zeros_like(carry.t),
        jnp.zeros_like(carry.t),
        none,
        none,
        carry.y,
        carry.mode,
    )
    rows = jax.lax.dynamic_update_slice(
        rows, last[None], (count, jnp.zeros_like(count))
    )
    return rows, count, code_of(carry), carry.stats


def code_of(carry: Carry) -> Count:
    """The code of a run that has come so far and no further."""
    return jnp.where(carry.status == _RUNNING, np.int32(Code.STEP_LIMIT), carry.status)


@traced_once
def run(problem: Problem, y0: State, mode0: Int[Array, " mode"]) -> Ended:
    """Packed rows `(max_steps + 1, columns)`, number of attempts, code and counts.

    Traced once for a run and its derivative.
    """
    start = started(problem, y0, mode0)
    packed, rows, count = advanced(
        problem,
        pack(start),
        start,
        empty_rows(problem, y0, mode0),
        problem.settings.max_steps,
    )
    return with_last_row(unpack(packed, start), rows, count)
