"""Greatest values of quantities over a recorded run.

Where a quantity is greatest inside a step, its rate changes from + to −: a turning
point. It is estimated as the maximum of the cubic through values and rates at both ends
of the step, on both sides of each event. From there a few looks at the quantity, on
partial steps of the method itself, find the zero of the rate. No step of the run
changes, and a maximum is as exact as the run.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from ._method import AbstractMethod
from ._search import interior_minimum
from ._solve import Record
from .arrays import Array, Count, Mark, Scalar, State, TwoArrays, numpy_of
from .system import ADVANCED, SKIPPED, Flat

#: values (k,) of quantities and their rates at a time, a flat state and a flat mode,
#: with the rates of the state
Watch = Callable[[Scalar, State, Int[Array, " mode"], State], TwoArrays]

#: a value is a new maximum if it exceeds the last by more than this share: less is
#: rounding
SAME = 1e-13
#: turning points of quantities are the same if their shares of the step differ by less
_ONE_TURN = 1e-9
#: a look is the last that moves the place by less than this share of the step: the next
#: would move it by about the square
_FOUND = 1e-6
#: most looks at one turning point; two or three are usual
_LOOKS = 40
#: looks after which every second one bisects, as a corner inside the step needs
_BISECTS = 6
#: the cubic tells the place only where values differ by more than this share: 10⁴
#: roundings
_CLEAR = 4e-12
#: entries that differ by less than this share of the largest are equal
_EQUAL = 1e-12
#: below every value
_NOTHING = -1e300


class Watched(NamedTuple):
    """Quantities (k,) whose greatest values are wanted, one for each group.

    - `groups`: how many quantities each group has, in their order
    """

    watch: Watch
    groups: tuple[int, ...]


class Extremes(NamedTuple):
    """Greatest values, (groups,) each.

    - `value`: −10³⁰⁰ where nothing counts
    - `row` of the record, `share` of the time to the next row, and `entry` of the group
      that have it
    """

    value: Float[Array, "*spans group"]
    row: Int[Array, "*spans group"]
    share: Float[Array, "*spans group"]
    entry: Int[Array, "*spans group"]


def first_largest(values: Float[Array, "*rows n"]) -> Int[Array, "*rows"]:
    """The first entry of each row that is the largest within rounding."""
    xp = numpy_of(values)
    top = xp.max(values, axis=-1, keepdims=True)
    return xp.argmax(values >= top - _EQUAL * xp.abs(top), axis=-1).astype(np.int32)


class _Bracket(NamedTuple):
    """The search for a turning point inside a row, or in each of many rows.

    - `share` of the step: the next place to look at;  `looks` so far
    - `low`, `high`: place, value and rate at both ends of the bracket;  `before`: at
      the last look
    """

    share: Float[Array, "*rows"]
    looks: Int[Array, "*rows"]
    low: Float[Array, "*rows 3"]
    high: Float[Array, "*rows 3"]
    before: Float[Array, "*rows 3"]


class _Turns(NamedTuple):
    """Turning points of the quantities (k,) inside a row, or inside each of many rows.

    - `place`: estimated share of the step
    - `bound`: estimated upper bound of the value there
    - `left`: whether it is still to be searched for
    - `entry`: quantity whose turning point is searched for, −1 if none is
    - `bracket` of this search
    """

    place: Float[Array, "*rows k"]
    bound: Float[Array, "*rows k"]
    left: Bool[Array, "*rows k"]
    entry: Int[Array, "*rows"]
    bracket: _Bracket


class _Visit(NamedTuple):
    """The looks at a row: at its start, at its end, then at one turning point after the
    other."""

    looks: Count
    best: Extremes  # (group,)
    start: TwoArrays  # values and rates (k,)
    end: TwoArrays
    turns: _Turns


def greatest(
    record: Record, watched: Watched, counts: Int[Array, "row group"] | None
) -> Extremes:
    """Greatest values of quantities over a traced run, in one walk over its rows.

    - `counts`: for each row and group how much counts: 0 nothing, 1 the start of the
      row, 2 all of it (also by `None`)

    Of equal values the first counts. Where a quantity turns twice inside a step, rates
    at both ends do not show it, and only the ends count; so it is with guards. The
    places are not differentiable, values at `row` and `share` are.
    """
    rows = record.rows
    groups = len(watched.groups)
    visit = _visitor(record, watched, counts)

    def next_row(loop: tuple) -> tuple:
        i, *found = loop

        def visited() -> tuple:
            return *visit(i, *found), rows.kind[i] == ADVANCED

        return i + 1, *jax.lax.cond(
            rows.kind[i] == SKIPPED, lambda: tuple(found), visited
        )

    nothing = jnp.full(sum(watched.groups), _NOTHING)
    zero = jnp.zeros(groups, jnp.int32)
    best = Extremes(jnp.full(groups, _NOTHING), zero, jnp.zeros(groups), zero)
    begin = jnp.asarray(0, jnp.int32), best, (nothing, nothing), jnp.asarray(False)
    return jax.lax.while_loop(lambda loop: loop[0] < record.count, next_row, begin)[1]


def _visitor(
    record: Record, watched: Watched, counts: Int[Array, "row group"] | None
) -> Callable[[Count, Extremes, TwoArrays, Mark], tuple[Extremes, TwoArrays]]:
    """`visit(row, best, start, known)`: the maxima with those of a row, and values and
    rates at its end.

    - `start`: values and rates at the start of the row, where these are `known`
    """
    rows = record.rows
    flat = record.flat
    method = record.method.rolled()
    watch, groups = watched
    group_of = np.repeat(np.arange(len(groups)), groups)
    ends = np.cumsum([0, *groups]).tolist()

    def visit(
        i: Count, best: Extremes, start: TwoArrays, known: Mark
    ) -> tuple[Extremes, TwoArrays]:
        t0 = rows.t[i]
        mode = rows.mode[i]
        h = rows.t[i + 1] - t0

        def rhs(t: Scalar, y: State) -> State:
            return flat.rhs(t, y, mode)

        def look(share: Scalar) -> TwoArrays:
            # (the row after an event begins behind the jump)
            at_next = (share == 1.0) & (rows.kind[i] == ADVANCED)
            which = jnp.where(share == 0.0, 0, jnp.where(at_next, 1, 2))
            t = t0 + share * h

            def inside() -> State:
                return method.state_after(rhs, t0, rows.y[i], share * h)

            y = jax.lax.switch(
                which, [lambda: rows.y[i], lambda: rows.y[i + 1], inside]
            )
            return watch(t, y, mode, rhs(t, y))

        def with_values(
            best: Extremes, q: Array, share: Scalar, whole: Count
        ) -> Extremes:
            top = _tops(q, ends)
            entry = jnp.stack(
                [first_largest(q[a:b]) for a, b in itertools.pairwise(ends)]
            )
            if counts is not None:
                top = jnp.where(counts[i] >= whole, top, -jnp.inf)
            new = top > best.value + SAME * jnp.abs(best.value)
            return _chosen(
                new,
                Extremes(
                    top, jnp.full_like(best.row, i), jnp.full_like(top, share), entry
                ),
                best,
            )

        def next_look(v: _Visit) -> _Visit:
            share = jnp.where(
                v.looks == 0, 0.0, jnp.where(v.looks == 1, 1.0, v.turns.bracket.share)
            )
            q, r = look(share)
            best = with_values(v.best, q, share, jnp.where(v.looks == 0, 1, 2))
            new = v._replace(looks=v.looks + 1, best=best)

            def at_an_end() -> _Visit:
                begun = new._replace(start=(q, r))
                ended = new._replace(end=(q, r))
                turns = _next_turn(
                    _turns(v.start, (q, r), h), best.value[group_of], v.start, (q, r)
                )
                return _chosen(v.looks == 0, begun, ended._replace(turns=turns))

            def inside() -> _Visit:
                entry = v.turns.entry
                bracket = _narrowed(v.turns.bracket, q[entry], r[entry], h)
                turns = v.turns._replace(bracket=bracket)
                done = bracket.looks >= _LOOKS
                here = done & _is_of(best, i, _tops(q, ends))
                found = best._replace(share=jnp.where(here, bracket.share, best.share))
                following = _next_turn(turns, best.value[group_of], v.start, v.end)
                return new._replace(best=found, turns=_chosen(done, following, turns))

            return jax.lax.cond(v.looks < 2, at_an_end, inside)

        def goes_on(v: _Visit) -> Mark:
            return (v.looks < 1) | ((h > 0) & ((v.looks < 2) | (v.turns.entry >= 0)))

        # (as the end of the row before, the start may not have counted)
        if counts is not None:
            best = _chosen(
                known, with_values(best, start[0], jnp.zeros(()), jnp.asarray(1)), best
            )
        first = jnp.where(known, 1, 0).astype(jnp.int32)
        visited = jax.lax.while_loop(
            goes_on,
            next_look,
            _Visit(first, best, start, start, _turns(start, start, h)),
        )
        return visited.best, visited.end

    return visit


def _is_of(best: Extremes, row: Count, tops: Array) -> Array:
    """Whether maxima are those at the turning point inside this row that has `tops`.

    An earlier look at the turning point may have been as high within rounding.
    """
    inside = (best.row == row) & (best.share > 0) & (best.share < 1)
    return inside & (tops >= best.value - 2 * SAME * abs(best.value))


def _tops(q: Array, ends: Sequence[int]) -> Array:
    """The largest entry of each group between these ends."""
    return jnp.stack([jnp.max(q[a:b]) for a, b in itertools.pairwise(ends)])


def _chosen(mark: Array, new: PyTree, old: PyTree) -> PyTree:
    """The `new` tree in the rows that are marked, `(*rows)`, else the `old` one."""
    xp = numpy_of(mark)

    def choose(x: Array, y: Array) -> Array:
        marks = xp.reshape(mark, (*mark.shape, *(1,) * (x.ndim - mark.ndim)))
        return xp.where(marks, x, y)

    return jax.tree.map(choose, new, old)


# --- turning points, of one row or of many: (*rows, k) ------------------------------


def _turns(start: TwoArrays, end: TwoArrays, h: Array) -> _Turns:
    """Turning points of quantities with these values and rates at the ends of rows,
    before any search."""
    (q0, r0) = start
    (q1, r1) = end
    xp = numpy_of(q0)
    h = h[..., None]
    place, least, exists = interior_minimum(-q0, -h * r0, -q1, -h * r1, 0.0)
    edge = xp.maximum(q0, q1)
    rise = xp.where(exists, xp.maximum(-least - edge, 0.0), 0.0)
    turns = (r0 > 0) & (r1 < 0)
    # the cubic is an estimate: the value may rise by as much again, but between a rise
    # and a fall not above the tangents at both ends
    tangents = q0 + r0 * (q1 - q0 - h * r1) / xp.where(turns, r0 - r1, 1.0)
    bound = xp.maximum(edge + 2 * rise, xp.where(turns, tangents, edge))
    left = (rise > 0) | turns
    rows = q0.shape[:-1]
    none = xp.zeros((*rows, 3))
    zero = xp.zeros(rows, np.int32)
    bracket = _Bracket(xp.zeros(rows), zero, none, none, none)
    return _Turns(place, bound, left, zero - 1, bracket)


def _of_entry(x: Array, place: Array) -> Array:
    """In each row the entry at its place."""
    return numpy_of(x).take_along_axis(x, place[..., None], axis=-1)[..., 0]


def _next_turn(
    turns: _Turns, best: Float[Array, "*rows k"], start: TwoArrays, end: TwoArrays
) -> _Turns:
    """The next search: for the turning point with the highest bound, if that exceeds
    the `best` of its group."""
    xp = numpy_of(best)
    left = turns.left & (turns.bound > best + SAME * xp.abs(best))
    entry = xp.argmax(xp.where(left, turns.bound, -xp.inf), axis=-1).astype(np.int32)
    place = _of_entry(turns.place, entry)
    # (a look sees all quantities that turn at the same place)
    near = xp.abs(turns.place - place[..., None]) <= _ONE_TURN
    of_entry = xp.arange(left.shape[-1], dtype=np.int32) == entry[..., None]
    zero = xp.zeros_like(place)
    bracket = turns.bracket._replace(
        share=place,
        looks=xp.zeros_like(turns.bracket.looks),
        low=xp.stack([zero, *(_of_entry(x, entry) for x in start)], axis=-1),
        high=xp.stack([zero + 1, *(_of_entry(x, entry) for x in end)], axis=-1),
    )
    return turns._replace(
        left=left & ~near & ~of_entry,
        entry=xp.where(xp.any(left, axis=-1), entry, np.int32(-1)),
        bracket=bracket,
    )


def _narrowed(bracket: _Bracket, q: Array, r: Array, h: Array) -> _Bracket:
    """The bracket after a look at `share` found the value `q` and the rate `r`: one end
    moves there, by the sign of the rate, and the next place is chosen.

    `looks` is at its limit where the search ends.
    """
    xp = numpy_of(q)
    here = xp.stack([bracket.share, q, r], axis=-1)
    rises = here[..., 2:] > 0
    low = xp.where(rises, here, bracket.low)
    high = xp.where(rises, bracket.high, here)
    (a, q0, r0), (b, q1, r1) = (xp.moveaxis(end, -1, 0) for end in (low, high))
    width = b - a
    looks = bracket.looks + 1
    d0 = h * width * r0
    d1 = h * width * r1
    s, _, exists = interior_minimum(-q0, -d0, -q1, -d1, 0.0)
    clear = xp.minimum(xp.abs(d0), xp.abs(d1)) > _CLEAR * xp.maximum(
        xp.abs(q0), xp.abs(q1)
    )
    line = r0 / xp.where(r0 == r1, 1.0, r0 - r1)
    s = xp.where(exists & clear, s, xp.where((line > 0) & (line < 1), line, 0.5))
    share = a + s * width
    # after two looks the zero of the line through their rates is nearer
    change = here[..., 2] - bracket.before[..., 2]
    step = (
        here[..., 2]
        * (bracket.share - bracket.before[..., 0])
        / xp.where(change == 0, 1.0, change)
    )
    nearer = bracket.share - step
    share = xp.where(
        (bracket.looks > 0) & (change != 0) & (nearer > a) & (nearer < b), nearer, share
    )
    share = xp.where((looks >= _BISECTS) & (looks % 2 == 1), a + 0.5 * width, share)
    # a bracket without a turning point: the estimate was wrong, and the search ends
    turns_there = exists | ((r0 > 0) & (r1 < 0))
    share = xp.where(turns_there, share, bracket.share)
    last = xp.abs(share - bracket.share) <= _FOUND
    looks = xp.where(last, np.int32(_LOOKS), looks).astype(np.int32)
    return bracket._replace(share=share, looks=looks, low=low, high=high, before=here)


# --- of a concrete run: looks at all rows together ----------------------------------


def _at_ends(
    record: Record, h: Array, start: TwoArrays, look: Callable[..., TwoArrays]
) -> TwoArrays:
    """Values and rates at the ends of rows that last `h`: those at the start of the
    next row, except before an event."""
    values, rates = (np.concatenate([x[1:], x[-1:]]) for x in start)
    ended = np.flatnonzero((record.rows.kind[: len(h)] != ADVANCED) & (h > 0))
    if ended.size:
        values[ended], rates[ended] = look(ended, np.ones(len(ended)))
    return values, rates


def greatest_of_rows(
    record: Record,
    look: Callable[[Array, Array], tuple[list[Array], list[Array]]],
    counts: Int[Array, "row group"] | None,
    span: Int[Array, " row"],
    spans: int,
    *,
    each: bool,
) -> Extremes:
    """As `greatest`, of a compact record outside of jit: (spans, group) each.

    - `look(rows, shares)`: values and rates of all quantities at these places (m,), by
      group (m, n) each
    - `span`: to which of so many `spans` each row belongs; each span has its maxima
    - `each`: whether each quantity is a group of its own
    """

    def joined(parts: tuple[list[Array], list[Array]]) -> TwoArrays:
        values, rates = (np.concatenate(part, axis=1) for part in parts)
        return values, rates

    def look_at(rows: Array, shares: Array) -> TwoArrays:
        return joined(look(rows, shares))

    count = max(int(record.count), 1)
    index = np.arange(count, dtype=np.int32)
    h = np.diff(record.rows.t[: count + 1])
    by_group = look(index, np.zeros(count))
    start = joined(by_group)
    sizes = [values.shape[1] for values in by_group[0]]
    sizes = [1] * sum(sizes) if each else sizes
    groups = range(len(sizes))
    ends = np.cumsum([0, *sizes])
    group_of = np.repeat(groups, sizes)
    shape = (spans, len(sizes))
    best = Extremes(
        value=np.full(shape, _NOTHING),
        row=np.zeros(shape, np.int32),
        share=np.zeros(shape),
        entry=np.zeros(shape, np.int32),
    )

    def take(which: Array, share: Array, q: Array, whole: int) -> None:
        """Takes values `q` in rows into the maxima; among equal ones the first row
        counts."""
        top = np.maximum.reduceat(q, ends[:-1], axis=1)
        if counts is not None:
            top = np.where(counts[which] >= whole, top, -np.inf)
        for s in np.unique(span[which]):
            some = np.flatnonzero(span[which] == s)
            for g in groups:
                value = best.value[s, g]
                most = np.max(top[some, g])
                if most > value + SAME * abs(value):
                    first = some[np.argmax(top[some, g] >= most - SAME * abs(most))]
                    entry = first_largest(q[first, ends[g] : ends[g + 1]])
                    new = top[first, g], which[first], share[first], entry
                    for column, number in zip(best, new, strict=True):
                        column[s, g] = number

    end = _at_ends(record, h, start, look_at)
    lasts = np.flatnonzero(h > 0)
    take(index, np.zeros(count), start[0], 1)
    take(lasts, np.ones(len(lasts)), end[0][lasts], 2)
    start = (start[0][lasts], start[1][lasts])
    end = (end[0][lasts], end[1][lasts])
    index = index[lasts]
    h = h[lasts]

    def following(turns: _Turns) -> _Turns:
        return _next_turn(turns, best.value[span[index]][:, group_of], start, end)

    turns = following(_turns(start, end, h))
    while (some := np.flatnonzero(turns.entry >= 0)).size:
        bracket = jax.tree.map(lambda column: column[some], turns.bracket)
        q, r = look_at(index[some], bracket.share)
        take(index[some], bracket.share, q, 2)
        value, rate = (_of_entry(x, turns.entry[some]) for x in (q, r))
        narrowed = _narrowed(bracket, value, rate, h[some])
        for column, new in zip(turns.bracket, narrowed, strict=True):
            column[some] = new
        done = np.zeros(len(index), bool)
        done[some] = narrowed.looks >= _LOOKS
        tops = np.maximum.reduceat(q, ends[:-1], axis=1)
        for j in np.flatnonzero(done[some]):
            here = _is_of(best, index[some[j]], tops[j])
            best.share[here] = narrowed.share[j]
        turns = _chosen(done, following(turns), turns)
    return best


# --- of a run that is not recorded: its steps are followed as they are made ---------

#: steps that are kept for each maximum: the cubic alone does not tell which of nearly
#: equal swings is the highest
_KEPT = 4


class Followed(NamedTuple):
    """Greatest values of quantities (k,) so far, and steps that may have higher ones
    inside.

    - `start`: values and rates (k,) where the next step begins
    - `best` (k,): greatest values at ends of steps
    - of the steps that are kept, (4, k) each: `bound` of the value inside;  `ends`:
      value and rate at the start, then at the end;  `step`: time, length, state, mode
    """

    start: TwoArrays
    best: Float[Array, " k"]
    bound: Float[Array, "kept k"]
    ends: Float[Array, "kept k 4"]
    step: Float[Array, "kept k column"]


def nothing_followed(count: int, step: Array) -> Followed:
    """The beginning, for `count` quantities; `step`: any time, length, state and mode in
    one vector."""
    kept = (_KEPT, count)
    nothing = jnp.full(count, _NOTHING)
    return Followed(
        start=(nothing, nothing),
        best=nothing,
        bound=jnp.full(kept, _NOTHING),
        ends=jnp.zeros((*kept, 4)),
        step=jnp.tile(step, (*kept, 1)),
    )


def follow(
    f: Followed, end: TwoArrays, step: Array, begins: Mark, stepped: Mark
) -> Followed:
    """After an attempt that led to the values and rates `end`: where it was accepted as
    a step (`stepped`), or a segment `begins`."""
    counts = begins | stepped
    best = jnp.where(counts, jnp.maximum(f.best, end[0]), f.best)
    turns = _turns(f.start, end, step[1])
    bound = jnp.where(turns.left, turns.bound, _NOTHING)
    # the new step replaces the kept one with the lowest bound
    numbers = jnp.arange(_KEPT, dtype=jnp.int32)[:, None]
    lowest = numbers == jnp.argmin(f.bound, axis=0).astype(jnp.int32)
    new = lowest & stepped & (bound > best + SAME * jnp.abs(best)) & (bound > f.bound)
    ends = jnp.stack([*f.start, *end], axis=-1)
    each = zip((bound, ends, step), (f.bound, f.ends, f.step), strict=True)
    kept = [_chosen(new, jnp.broadcast_to(x, y.shape), y) for x, y in each]
    return Followed(_chosen(counts, end, f.start), best, *kept)


def greatest_of_steps(
    f: Followed, watch: Watch, flat: Flat, method: AbstractMethod, ny: int
) -> Float[Array, " k"]:
    """Greatest values (k,) at the ends of steps, and inside those that were kept, which
    are looked at one after the other."""
    kept, count = f.bound.shape
    of = np.tile(np.arange(count, dtype=np.int32), kept)
    ends = f.ends.reshape(kept * count, 4)
    step = f.step.reshape(kept * count, -1)
    start, end = (ends[:, :1], ends[:, 1:2]), (ends[:, 2:3], ends[:, 3:])
    turns = _turns(start, end, step[:, 1])
    brackets = _next_turn(turns, f.best[of, None], start, end).bracket

    def look(share: Scalar, step: Array) -> TwoArrays:
        t = step[0]
        h = step[1]
        mode = step[2 + ny :].astype(jnp.int32)

        def rhs(t: Scalar, y: State) -> State:
            return flat.rhs(t, y, mode)

        y = method.state_after(rhs, t, step[2 : 2 + ny], share * h)
        return watch(t + share * h, y, mode, rhs(t + share * h, y))

    def left(best: Array, bounds: Array) -> Array:
        return bounds > best[of] + SAME * jnp.abs(best[of])

    def next_step(carry: tuple[Array, Array]) -> tuple[Array, Array]:
        """Searches the step with the highest bound, of the first quantity that has
        steps left."""
        best, bounds = carry
        waits = left(best, bounds)
        g = jnp.asarray(of)[jnp.argmax(waits)]
        i = jnp.argmax(jnp.where(waits & (of == g), bounds, -jnp.inf))
        chosen, its_step = jax.tree.map(lambda column: column[i], (brackets, step))
        # (of runs side by side some have nothing left)
        looks = jnp.where(waits[i], 0, _LOOKS).astype(jnp.int32)

        def turn(carry: tuple[Array, _Bracket]) -> tuple[Array, _Bracket]:
            best, bracket = carry
            q, r = look(bracket.share, its_step)
            return jnp.maximum(best, q), _narrowed(bracket, q[g], r[g], its_step[1])

        best, _ = jax.lax.while_loop(
            lambda carry: carry[1].looks < _LOOKS,
            turn,
            (best, chosen._replace(looks=looks)),
        )
        # (a look sees all quantities that turn at the same place)
        near = jnp.abs(brackets.share - chosen.share) <= _ONE_TURN
        seen = near & (step[:, 0] == its_step[0])
        return best, jnp.where(seen, _NOTHING, bounds)

    return jax.lax.while_loop(
        lambda carry: jnp.any(left(*carry)), next_step, (f.best, f.bound.ravel())
    )[0]
