"""A run seen in all of its steps at little cost, and its maximum values.

States at the ends of steps are those of the run; between them lies the cubic through states and rates of both ends, on
which everything algebraic is evaluated. Where that calls for a closer look, states come from a partial step of the
method itself.
"""

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ..hybrid import ADVANCED, LANDED, SKIPPED, STOPPED, Record
from ..hybrid.arrays import Array, TwoArrays, Vector, VectorM
from ..hybrid.system import flatten, ravel
from ..physics._brake import BrakeSystem
from ._wants import holding_rows
from .metrics import METRICS, Peak, held_share, passing
from .probe import (
    LONG,
    Probe,
    is_traced_run,
    look_at,
    probe_at,
    record_of,
    seen_at,
    states_inside,
)

#: places in every step at which a run is sampled, both ends included; in a long run every part has many steps
_SAMPLES, _SAMPLES_OF_LONG = 9, 5
#: up to as many samples are partial steps, of a method whose steps are too long for anything else
_SHORT, _LONG_STEPS = 1024, 6
_POINTS, _ROUNDS, _FINER = 9, 2, 0.03  # of finer and finer grids around a maximum value
_FEW_POINTS = 5  # of one grid alone
#: tensions of the lever that differ by less than this share of the largest are the same
_SAME = 1e-9

#: of a probe, (m, n): that of which the maximum over the run is wanted
Pick = Callable[[Probe], Array]


class Steps(NamedTuple):
    """Steps of a run: times and states at both ends, before any jump, and the mode in between."""

    t0: Vector
    t1: Vector
    y0: Float[Array, "n state"]
    y1: Float[Array, "n state"]
    mode: Int[Array, "n mode"]


class Wanted(NamedTuple):
    """What is looked at beside forces and margins: metrics that are maxima over the run, and marks (`marks_of`)."""

    names: tuple[str, ...] = ()
    marks: tuple[str, ...] = ()


class ScanColumns(NamedTuple):
    """Forces, margins and maxima over the linings of a run at many times, for a report.

    - `passing`: by mark, the quantity that passes its limit
    - `friction_heat`: friction work of each pair since the start (J)
    - `holding`: load on a pulley at rest, and static capacity of the brake in its direction (N·m)
    - `tops`: by the name of a metric, the value of which its maximum over the run is wanted;  `places`: at which lining
      (from 0) it is that large, of `widths` ones
    """

    t: VectorM
    omega: VectorM
    alpha: VectorM
    lever_tension: VectorM
    load_torque: VectorM
    friction_heat: Float[Array, "m pairs"]
    margins: Float[Array, "m marks"]
    passing: dict[str, Float[Array, "m k"]]
    holding: TwoArrays
    tops: dict[str, VectorM]
    places: dict[str, Int[Array, " m"]]
    widths: dict[str, Int[Array, " m"]]


def _sight(p: Probe, wanted: Wanted) -> ScanColumns:
    values = {name: METRICS[name].find(p) for name in wanted.names}
    return ScanColumns(
        p.t,
        p.y.omega,
        p.flows.contact.alpha,
        p.flows.lever_tension,
        p.flows.load_torque,
        np.stack(p.y.ledger.friction, axis=1),
        p.margins,
        {name: passing(name, p) for name in wanted.marks},
        p.holding,
        {name: np.max(value, axis=1) for name, value in values.items()},
        {name: first_largest(value) for name, value in values.items()},
        {name: np.full(len(value), value.shape[1], np.int32) for name, value in values.items()},
    )


def first_largest(value: Float[Array, "m n"], xp: Any = np) -> Int[Array, " m"]:
    """The first entry of each row that is the largest but for rounding, as equal linings tie."""
    top = xp.max(value, axis=1, keepdims=True)
    return xp.argmax(value >= top - 1e-12 * xp.abs(top), axis=1).astype(np.int32)


# --- samples between the ends of steps --------------------------------------------------------------------------------


def _between(steps: Steps, f0: Array, f1: Array, share: Array) -> Array:
    """States at a share of each step, on the cubic through states and rates of its ends."""
    s, h = share[:, None], (steps.t1 - steps.t0)[:, None]
    blend = s * s * (3 - 2 * s)
    return (1 - blend) * steps.y0 + blend * steps.y1 + h * s * (1 - s) * ((1 - s) * f0 - s * f1)


def _sampled(
    system: BrakeSystem, y_like: PyTree, mode_like: PyTree, steps: Steps, samples: int, see: Callable[[Probe], PyTree]
) -> tuple[PyTree, Array, Array]:
    """What `see` makes of a probe at the samples of all steps, (steps, samples, …), and the rates at both ends.

    One loop over the samples, so that the equations stand in the program once.
    """
    flat = flatten(system, y_like, mode_like)
    modes = jax.vmap(flat.unpack_mode)(steps.mode)

    def sample(rates: TwoArrays, entry: TwoArrays) -> tuple[TwoArrays, PyTree]:
        k, share = entry
        shares = jnp.full(steps.t0.shape, share)
        y = jnp.where(k == 0, steps.y0, jnp.where(k == 1, steps.y1, _between(steps, *rates, shares)))
        t = steps.t0 + share * (steps.t1 - steps.t0)
        state = jax.vmap(flat.unpack_state)(y)
        probe = seen_at(system, t, state, modes)
        slopes = jax.vmap(system.rates)(t, state, modes, probe.flows)
        rate = jax.vmap(lambda tree: ravel(tree, jnp.float64))(slopes)
        return (jnp.where(k == 0, rate, rates[0]), jnp.where(k == 1, rate, rates[1])), see(probe)

    nothing = jnp.zeros_like(steps.y0)
    order = np.asarray([0, samples - 1, *range(1, samples - 1)])  # rates at both ends come first
    entries = (jnp.arange(samples, dtype=jnp.int32), jnp.asarray(order / (samples - 1)))
    (f0, f1), columns = jax.lax.scan(sample, (nothing, nothing), entries)
    back = np.argsort(order)
    return jax.tree.map(lambda leaf: jnp.moveaxis(leaf[back], 0, 1), columns), f0, f1


# --- a run as it was scanned ------------------------------------------------------------------------------------------


class Scan:
    """A run, concrete or traced, sampled in all its steps.

    - `row` (m,) and `share` (m,): the row of each sample, and where in its step it is, 0…1;  `seen`: what is seen there
      of a concrete run
    - `samples` in every step;  `xp`: NumPy of a concrete run, JAX's of a traced one;  `rtol`: to which the run was
      integrated
    """

    def __init__(self, run: Any, rtol: float = 1e-10, wanted: Wanted | None = None) -> None:
        self.record, self.rtol, self.wanted = record_of(run), rtol, wanted or Wanted()
        self.traced = is_traced_run(self.record)
        self.xp: ModuleType = jnp if self.traced else np
        self._frozen = jax.lax.stop_gradient(self.record) if self.traced else self.record
        rows, xp = self._frozen.rows, self.xp
        count = rows.t.shape[0] if self.traced else max(int(self.record.count), 1)
        row_numbers = xp.arange(count, dtype=np.int32)
        following = xp.minimum(row_numbers + 1, self.record.count)
        self.used = (row_numbers < self.record.count) & (rows.kind[:count] != SKIPPED)
        self.steps = Steps(rows.t[:count], rows.t[following], rows.y[:count], rows.y[following], rows.mode[:count])
        self._states: Array | None = None  # at all samples, of a short run
        self.steps = self.steps._replace(y1=self._before_jumps(row_numbers, rows.kind[:count]))
        self.samples = _SAMPLES_OF_LONG if not self.traced and count > LONG else _SAMPLES
        self.row, self.share = xp.repeat(row_numbers, self.samples), xp.tile(xp.linspace(0.0, 1.0, self.samples), count)
        if not self.traced:
            self.seen = self._seen()

    def _seen(self) -> ScanColumns:
        """What is seen at all samples of a concrete run."""
        count, n = len(self.steps.t0), self.samples
        if self.record.method.order >= _LONG_STEPS and count * n <= _SHORT:
            _, self._states = self._inside(self.row, self.share)
            return look_at(self.record, np.arange(count * n), self.instants, self._sight)
        t0, t1, y0, y1, mode = self.steps
        numbers = np.arange(count)

        def see(p: Probe, rates: Array) -> tuple[ScanColumns, Array]:
            return self._sight(p, rates), rates

        # the cubic between takes the rates of both ends; where nothing happens one step ends as the next one begins
        first, self._f0 = look_at(self.record, numbers, lambda i: (t0[i], y0[i], mode[i]), see)
        goes_on = np.append((y1[:-1] == y0[1:]).all(1) & (mode[:-1] == mode[1:]).all(1), False)
        apart = look_at(self.record, np.flatnonzero(~goes_on), lambda i: (t1[i], y1[i], mode[i]), see)
        source = np.where(goes_on, numbers + 1, count + np.cumsum(~goes_on) - 1)
        last, self._f1 = jax.tree.map(lambda a, b: np.concatenate([a, b])[source], (first, self._f0), apart)
        between = np.flatnonzero((self.share > 0) & (self.share < 1))
        inner = look_at(self.record, between, self.instants, self._sight)

        def in_order(a: Array, x: Array, b: Array) -> Array:
            parts = a[:, None], x.reshape(count, n - 2, *x.shape[1:]), b[:, None]
            return np.concatenate(parts, axis=1).reshape(count * n, *x.shape[1:])

        return jax.tree.map(in_order, first, inner, last)

    def _sight(self, p: Probe, _: Array) -> ScanColumns:
        return _sight(p, self.wanted)

    def _inside(self, row: Array, share: Array) -> TwoArrays:
        """Times and states at a share of the steps named, by partial steps of the method."""
        return states_inside(self.record, row, share * (self.steps.t1[row] - self.steps.t0[row]))

    def _before_jumps(self, row: Array, kind: Array) -> Array:
        """States at the ends of all steps. Where nothing jumps, events change speeds by rounding alone."""
        xp, steps = self.xp, self.steps
        system: BrakeSystem = self.record.system  # pyright: ignore
        none = steps.t1 == steps.t0
        if not system.jumps:
            return xp.where(none[:, None], steps.y0, steps.y1)
        jumps = ~none & self.used & ((kind == LANDED) | (kind == STOPPED))
        if self.traced:
            _, state = self._frozen.inside(row, xp.where(jumps, steps.t1 - steps.t0, 0.0), still=True)
            ends = jax.vmap(lambda y: ravel(y, jnp.float64))(state)
        else:
            some, ends = np.flatnonzero(jumps), steps.y0.copy()
            if some.size:
                ends[some] = self._inside(some, np.ones(len(some)))[1]
        return xp.where(none[:, None], steps.y0, xp.where(jumps[:, None], ends, steps.y1))

    # --- concrete runs ------------------------------------------------------------------------------------------------

    def instants(self, sample: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes of a concrete run at the samples numbered."""
        row, share = self.row[sample], self.share[sample]
        steps = Steps(*(column[row] for column in self.steps))
        t = steps.t0 + share * (steps.t1 - steps.t0)
        if self._states is not None:
            return t, self._states[sample], steps.mode
        return t, _between(steps, self._f0[row], self._f1[row], share), steps.mode

    def states(self, row: Array, share: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes at a share of the steps named, of a concrete run and as exact as the run itself."""
        return *self._inside(row, share), self.steps.mode[row]

    def look(self, row: Array, share: Array) -> ScanColumns:
        """Everything at a share of the steps named, of a concrete run and as exact as the run itself."""
        t, y, mode = self.states(row, share)
        return look_at(self.record, np.arange(len(t)), lambda i: (t[i], y[i], mode[i]), self._sight)


# --- maximum values ---------------------------------------------------------------------------------------------------


class PeakBracket(NamedTuple):
    """Samples (k,) near which maximum values are looked for, and the steps after theirs.

    - `row` and `share` of each;  `after`: the row of the step after it, `row` where there is none, `times` as long
    - `smooth`: whether the run passes into that step without an event
    """

    row: Array
    share: Array
    after: Array
    times: Array
    smooth: Array


def _polish(
    look: Callable[[Array, Array], Array],
    xp: ModuleType,
    near: PeakBracket,
    width: float,
    rounds: int = _ROUNDS,
    count: int = _POINTS,
) -> TwoArrays:
    """Rows and shares (k,) of maximum values near samples of them: finer grids, each with a parabola through its best.

    `look(rows, shares)` gives values (k, points). Places are counted in lengths of the sample's step, also in the step
    after it. Where no parabola fits, at a corner or an end, the next grid reaches from one neighbour to the other.
    At an interior maximum the rate is 0, so that its derivative does not depend on where exactly it was found.
    """
    grid = xp.linspace(-1.0, 1.0, count)
    last = xp.where(near.after != near.row, 1.0 + near.times, 1.0)

    def placed(x: Array) -> TwoArrays:
        row, after, times = (v if x.ndim == 1 else v[:, None] for v in (near.row, near.after, near.times))
        over = x > 1
        return xp.where(over, after, row), xp.where(over, xp.clip((x - 1) / times, 0.0, 1.0), x)

    def finer(_: Any, entry: TwoArrays) -> TwoArrays:
        x, width = entry
        points = xp.clip(x[:, None] + width[:, None] * grid, 0.0, last[:, None])
        rows, shares = placed(points)
        top = look(rows, shares)
        best = xp.argmax(top, axis=1)
        mid = xp.clip(best, 1, count - 2)

        def at(values: Array, place: Array) -> Array:
            return xp.take_along_axis(values, place[:, None], axis=1)[:, 0]

        left, right = at(points, mid) - at(points, mid - 1), at(points, mid + 1) - at(points, mid)
        low, high = at(top, mid - 1), at(top, mid + 1)
        curve = low - 2 * at(top, mid) + high
        same = near.smooth | (at(rows, mid - 1) == at(rows, mid + 1))
        fits = (best == mid) & same & (curve < 0) & (abs(left - right) < 1e-9)
        bend = 0.5 * left * (low - high) / xp.where(fits, curve, 1.0)
        x = xp.clip(at(points, best) + xp.where(fits, bend, 0.0), 0.0, last)
        return x, width * xp.where(fits, _FINER, 2.0 / (count - 1))

    entry = (near.share, xp.full(near.share.shape, width))
    if xp is jnp:
        return placed(jax.lax.fori_loop(0, rounds, finer, entry)[0])
    for i in range(rounds):
        entry = finer(i, entry)
    return placed(entry[0])


def _highest(scan: Scan, tops: Array, first: int = 0) -> PeakBracket:
    """The largest of the samples `tops` (m,), in arrays of one.

    `first`: the row that the samples begin with, where they are not those of the whole run.
    """
    xp, rows, steps = scan.xp, scan.record.rows, scan.steps
    begin = first * scan.samples
    used = scan.used[scan.row[begin : begin + tops.shape[0]]]
    best = begin + xp.argmax(xp.where(used, tops, -np.inf))
    row_numbers, h = xp.arange(scan.used.shape[0], dtype=np.int32), steps.t1 - steps.t0
    lasts = scan.used & (h > 0)
    # the begin of a step is the end of the one before it, from which both are looked at
    before = xp.max(xp.where(lasts & (row_numbers < scan.row[best]), row_numbers, -1))
    at_begin = (scan.share[best] == 0.0) & (before >= first) & (rows.kind[before] == ADVANCED)
    row = xp.where(at_begin, before, scan.row[best]).astype(np.int32)
    share = xp.where(at_begin, 1.0, scan.share[best])
    following = lasts & (row_numbers > row) & (row_numbers < first + tops.shape[0] // scan.samples)
    after = xp.where(xp.any(following) & (h[row] > 0), xp.argmax(following).astype(np.int32), row)
    times = xp.where(after != row, h[after] / xp.where(h[row] > 0, h[row], 1.0), 1.0)
    return PeakBracket(*(x[None] for x in (row, share, after, times, rows.kind[row] == ADVANCED)))


def peaks(scan: Scan) -> dict[str, Peak]:
    """Maximum values over a concrete run, by name: those that the scan looks at, all of them at once."""
    names = scan.wanted.names
    if not names:
        return {}
    columns = _polished(scan, names, [_highest(scan, scan.seen.tops[name]) for name in names])
    return {
        name: Peak(columns.tops[name][k], columns.t[k], columns.places[name][k] + 1) for k, name in enumerate(names)
    }


def peaks_between(scan: Scan, names: Sequence[str], spans: Sequence[tuple[int, int]]) -> dict[str, Float[Array, " k"]]:
    """Maximum values of a concrete run from row to row, by name, one for each of `spans`."""
    if not names or not spans:
        return {name: np.zeros(0) for name in names}
    n = scan.samples
    brackets = [_highest(scan, scan.seen.tops[name][a * n : b * n], a) for name in names for a, b in spans]
    # (one round of few points: of many spans only a long run has, whose steps are short)
    columns = _polished(scan, [name for name in names for _ in spans], brackets, 1, _FEW_POINTS)
    each = len(spans)
    return {name: columns.tops[name][k * each : (k + 1) * each] for k, name in enumerate(names)}


def _polished(
    scan: Scan, names: Sequence[str], brackets: Sequence[PeakBracket], rounds: int = _ROUNDS, count: int = _POINTS
) -> ScanColumns:
    """What is seen at maximum values in the `brackets`, each of the metric in its place among `names`."""
    near = PeakBracket(*(np.concatenate(column) for column in zip(*brackets, strict=True)))

    def look(rows: Array, shares: Array) -> Any:
        tops = scan.look(rows.ravel(), shares.ravel()).tops
        return np.stack([tops[name].reshape(rows.shape)[k] for k, name in enumerate(names)])

    return scan.look(*_polish(look, np, near, 1.0 / (scan.samples - 1), rounds, count))


def largest_share_of_capacity(scan: Scan) -> Peak:
    """Maximum over a concrete run of the load over the static capacity of the brake that is to hold it, 0 where none
    is."""
    record = scan.record
    held, broken, _ = (column[: len(scan.used)] for column in holding_rows(record))
    is_to_hold = held[scan.row] | (broken[scan.row] & (scan.share == 0.0))
    if not np.any(is_to_hold):
        return Peak(np.float64(0.0), np.asarray(record.rows.t)[0], np.int32(1))

    def seen(rows: Array, shares: Array) -> TwoArrays:
        sight, standing = scan.look(rows.ravel(), shares.ravel()), (held[rows] | (shares == 0.0)).ravel()
        return held_share(*sight.holding, standing).reshape(rows.shape), sight.t

    load, capacity = scan.seen.holding
    near = _highest(scan, held_share(load, capacity, is_to_hold))
    near = near._replace(after=np.where(held[near.after], near.after, near.row))
    row, share = _polish(lambda rows, shares: seen(rows, shares)[0], np, near, 1.0 / (scan.samples - 1))
    value, t = seen(row, share)
    return Peak(value[0], t[0], np.int32(1))


def peak(run: Any, pick: Pick, *, holding: bool = False) -> Peak:
    """Maximum of `pick(probe)` (m, n) over a traced run; `holding`: while the brake is to hold the pulley, else 0."""
    scan = Scan(run)
    record, frozen = scan.record, scan._frozen

    def probe(record: Record, row: Array, share: Array) -> Probe:
        t = record.rows.t
        return probe_at(record, row, share * (t[jnp.minimum(row + 1, record.count)] - t[row]))

    def tops(rows: Array, shares: Array) -> Array:
        return jnp.max(pick(probe(frozen, rows.ravel(), shares.ravel())), axis=1).reshape(rows.shape)

    parts = frozen.system, frozen.y_like, frozen.mode_like
    sampled, *_ = _sampled(*parts, scan.steps, scan.samples, lambda p: jnp.max(pick(p), axis=1))  # pyright: ignore
    if holding:
        held, broken, _ = holding_rows(frozen)
        scan.used = held | broken
    row, share = _polish(tops, jnp, _highest(scan, sampled.ravel()), 1.0 / (scan.samples - 1))
    p = probe(record, row, jax.lax.stop_gradient(share))
    value = jnp.where(jnp.any(scan.used), pick(p)[0], 0.0) if holding else pick(p)[0]
    lining = first_largest(jax.lax.stop_gradient(value)[None], jnp)[0]
    return Peak(value[lining], p.t[0], lining + 1)
