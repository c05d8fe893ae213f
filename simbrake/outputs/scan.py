"""A run seen in all of its steps at little cost.

States at the ends of steps are those of the run; between them lies the cubic through
states and rates of both ends, on which everything algebraic is evaluated. Where that
calls for a closer look, states come from a partial step of the method itself.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from ..hybrid import LANDED, STOPPED
from ..hybrid.arrays import Array, TwoArrays, Vector, VectorM
from .metrics import HOT, marked_quantity
from .probe import LONG, Probe, evaluate_at, states_inside
from .programs import record_of

#: places in every step at which a run is sampled, both ends included; in a long run
#: every part has many steps
_SAMPLES = 9
_SAMPLES_OF_LONG = 5
#: up to as many samples are partial steps, of a method whose steps are too long for
#: anything else
_SHORT = 1024
_LONG_STEPS = 6


class Steps(NamedTuple):
    """Steps of a run: times and states at both ends, before any jump, and the mode in
    between."""

    t0: Vector
    t1: Vector
    y0: Float[Array, "n state"]
    y1: Float[Array, "n state"]
    mode: Int[Array, "n mode"]


class ScanColumns(NamedTuple):
    """Forces, margins and temperatures of a run at many times, for a report.

    - `passing`: by mark, the quantity that passes its limit
    - `friction_heat`: friction work of each pair since the start (J)
    - `holding`: load on a pulley at rest, and static capacity of the brake in its
      direction (N·m)
    - `hot`: by metric, the highest temperature of its place (K)
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
    hot: dict[str, VectorM]


def _columns(p: Probe, marks: tuple[str, ...]) -> ScanColumns:
    return ScanColumns(
        p.t,
        p.y.omega,
        p.flows.contact.alpha,
        p.flows.lever_tension,
        p.flows.load_torque,
        np.stack(p.y.ledger.friction, axis=1),
        p.margins,
        {name: marked_quantity(name, p) for name in marks},
        p.holding,
        {
            name: np.max(p.surfaces[place], axis=1)
            for name, place in HOT.items()
            if place in p.surfaces
        },
    )


def _between(steps: Steps, f0: Array, f1: Array, share: Array) -> Array:
    """States at a share of each step, on the cubic through states and rates of its
    ends."""
    s = share[:, None]
    h = (steps.t1 - steps.t0)[:, None]
    blend = s * s * (3 - 2 * s)
    return (
        (1 - blend) * steps.y0
        + blend * steps.y1
        + h * s * (1 - s) * ((1 - s) * f0 - s * f1)
    )


class Scan:
    """A concrete run sampled in all its steps.

    - `row` (m,) and `share` (m,): the row of each sample, and where in its step it is,
      0…1
    - `seen`: what is seen there
    - `samples` in every step
    - `rtol`: to which the run was integrated
    - `marks` (`marks_of`) that are looked at
    """

    def __init__(
        self, run: Any, rtol: float = 1e-10, marks: Sequence[str] = ()
    ) -> None:
        self.record = record_of(run)
        self.rtol = rtol
        self._marks = tuple(marks)
        rows = self.record.rows
        count = max(int(self.record.count), 1)
        row_numbers = np.arange(count, dtype=np.int32)
        following = np.minimum(row_numbers + 1, self.record.count)
        self.steps = Steps(
            rows.t[:count],
            rows.t[following],
            rows.y[:count],
            rows.y[following],
            rows.mode[:count],
        )
        self._states: Array | None = None  # at all samples, of a short run
        self.steps = self.steps._replace(y1=self._before_jumps(rows.kind[:count]))
        self.samples = _SAMPLES_OF_LONG if count > LONG else _SAMPLES
        self.row, self.share = (
            np.repeat(row_numbers, self.samples),
            np.tile(np.linspace(0.0, 1.0, self.samples), count),
        )
        self.seen = self._seen()

    def _seen(self) -> ScanColumns:
        """What is seen at all samples of a concrete run."""
        count = len(self.steps.t0)
        n = self.samples
        if self.record.method.order >= _LONG_STEPS and count * n <= _SHORT:
            _, self._states = self._inside(self.row, self.share)
            return evaluate_at(
                self.record, np.arange(count * n), self.instants, self._columns_of
            )
        t0, t1, y0, y1, mode = self.steps
        numbers = np.arange(count)

        def with_rates(p: Probe, rates: Array) -> tuple[ScanColumns, Array]:
            return self._columns_of(p, rates), rates

        # the cubic between takes the rates of both ends; where nothing happens one step
        # ends as the next one begins
        first, self._f0 = evaluate_at(
            self.record, numbers, lambda i: (t0[i], y0[i], mode[i]), with_rates
        )
        goes_on = np.append(
            (y1[:-1] == y0[1:]).all(1) & (mode[:-1] == mode[1:]).all(1), False
        )
        apart = evaluate_at(
            self.record,
            np.flatnonzero(~goes_on),
            lambda i: (t1[i], y1[i], mode[i]),
            with_rates,
        )
        source = np.where(goes_on, numbers + 1, count + np.cumsum(~goes_on) - 1)
        last, self._f1 = jax.tree.map(
            lambda a, b: np.concatenate([a, b])[source], (first, self._f0), apart
        )
        between = np.flatnonzero((self.share > 0) & (self.share < 1))
        inner = evaluate_at(self.record, between, self.instants, self._columns_of)

        def in_order(a: Array, x: Array, b: Array) -> Array:
            parts = a[:, None], x.reshape(count, n - 2, *x.shape[1:]), b[:, None]
            return np.concatenate(parts, axis=1).reshape(count * n, *x.shape[1:])

        return jax.tree.map(in_order, first, inner, last)

    def _columns_of(self, p: Probe, _: Array) -> ScanColumns:
        return _columns(p, self._marks)

    def _inside(self, row: Array, share: Array) -> TwoArrays:
        """Times and states at a share of the steps named, by partial steps of the
        method."""
        return states_inside(
            self.record, row, share * (self.steps.t1[row] - self.steps.t0[row])
        )

    def _before_jumps(self, kind: Array) -> Array:
        """States at the ends of all steps. Where nothing jumps, events change speeds by
        rounding alone."""
        steps = self.steps
        system = self.record.system
        none = steps.t1 == steps.t0
        ends = np.where(none[:, None], steps.y0, steps.y1)
        jumps = ~none & ((kind == LANDED) | (kind == STOPPED))
        some = np.flatnonzero(jumps)
        if system.jumps and some.size:  # pyright: ignore
            ends[some] = self._inside(some, np.ones(len(some)))[1]
        return ends

    def instants(self, sample: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes of a concrete run at the samples numbered."""
        row = self.row[sample]
        share = self.share[sample]
        steps = Steps(*(column[row] for column in self.steps))
        t = steps.t0 + share * (steps.t1 - steps.t0)
        if self._states is not None:
            return t, self._states[sample], steps.mode
        return t, _between(steps, self._f0[row], self._f1[row], share), steps.mode

    def states(self, row: Array, share: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes at a share of the steps named, of a concrete run and
        as exact as the run itself."""
        return *self._inside(row, share), self.steps.mode[row]

    def look(self, row: Array, share: Array) -> ScanColumns:
        """Everything at a share of the steps named, of a concrete run and as exact as
        the run itself."""
        t, y, mode = self.states(row, share)
        return evaluate_at(
            self.record,
            np.arange(len(t)),
            lambda i: (t[i], y[i], mode[i]),
            self._columns_of,
        )
