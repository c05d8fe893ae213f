"""A run sampled in all of its steps at little cost.

At the ends of steps the states are those of the run. Between them they lie on the cubic
through states and rates of both ends; forces and other algebraic quantities are
evaluated on it. Where that is not exact enough, `look` and `states` make a partial step
of the method itself.
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

#: samples in every step, both ends included; fewer in a long run, whose motion is
#: spread over many steps
_SAMPLES = 9
_SAMPLES_OF_LONG = 5
#: the steps of methods from this order on are too long for the cubic: up to so many
#: samples are partial steps
_LONG_STEPS = 6
_SHORT = 1024


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

    - `friction_work`: of each pair since the start (J)
    - `marked`: by mark, the quantity that passes its limit
    - `holding`: load on a pulley at rest, and static capacity of the brake in its
      direction (N·m)
    - `hot`: by metric, the highest temperature of its place (K)
    """

    t: VectorM
    omega: VectorM
    alpha: VectorM
    lever_tension: VectorM
    load_torque: VectorM
    friction_work: Float[Array, "m pairs"]
    margins: Float[Array, "m marks"]
    marked: dict[str, Float[Array, "m k"]]
    holding: TwoArrays
    hot: dict[str, VectorM]


class Scan:
    """A concrete run sampled in all its steps.

    - `row` (m,) and `share` (m,): the row of each sample, and where in its step it is,
      0…1
    - `columns`: quantities at all samples
    - `samples`: their number in every step
    - `rtol`: tolerance of the run
    - `marks`: names of `marks_of` whose quantities are sampled
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
        self.steps = self.steps._replace(y1=self._before_jumps(rows.kind[:count]))
        self.samples = _SAMPLES_OF_LONG if count > LONG else _SAMPLES
        self.row = np.repeat(row_numbers, self.samples)
        self.share = np.tile(np.linspace(0.0, 1.0, self.samples), count)
        self._states: Array | None = None  # at all samples, of a short run
        self.columns = self._sampled()

    def _sampled(self) -> ScanColumns:
        """Quantities at all samples."""
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

        # the cubic needs the rates at both ends; where nothing happens the end of a step
        # is the begin of the next
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
        return ScanColumns(
            p.t,
            p.y.omega,
            p.flows.contact.alpha,
            p.flows.lever_tension,
            p.flows.load_torque,
            np.stack(p.y.ledger.friction, axis=1),
            p.margins,
            {name: marked_quantity(name, p) for name in self._marks},
            p.holding,
            {
                name: np.max(p.surfaces[place], axis=1)
                for name, place in HOT.items()
                if place in p.surfaces
            },
        )

    def _inside(self, row: Array, share: Array) -> TwoArrays:
        """Times and states at a share of the steps in these rows, by partial steps of
        the method."""
        return states_inside(
            self.record, row, share * (self.steps.t1[row] - self.steps.t0[row])
        )

    def _before_jumps(self, kind: Array) -> Array:
        """States at the ends of all steps, before events change them. (Of a system
        without jumps events change speeds by rounding alone.)"""
        steps = self.steps
        empty = steps.t1 == steps.t0
        ends = np.where(empty[:, None], steps.y0, steps.y1)
        at_event = np.flatnonzero(~empty & ((kind == LANDED) | (kind == STOPPED)))
        if self.record.system.jumps and at_event.size:  # pyright: ignore
            ends[at_event] = self._inside(at_event, np.ones(len(at_event)))[1]
        return ends

    def instants(self, sample: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes at these samples."""
        row = self.row[sample]
        share = self.share[sample]
        t0, t1, y0, y1, mode = (column[row] for column in self.steps)
        t = t0 + share * (t1 - t0)
        if self._states is not None:
            return t, self._states[sample], mode
        # the cubic through states and rates of both ends
        s = share[:, None]
        h = (t1 - t0)[:, None]
        blend = s * s * (3 - 2 * s)
        bend = (1 - s) * self._f0[row] - s * self._f1[row]
        return t, (1 - blend) * y0 + blend * y1 + h * s * (1 - s) * bend, mode

    def states(self, row: Array, share: Array) -> tuple[Array, Array, Array]:
        """Times, states and modes at a share of the steps in these rows, as exact as
        the run itself."""
        return *self._inside(row, share), self.steps.mode[row]

    def look(self, row: Array, share: Array) -> ScanColumns:
        """Quantities at a share of the steps in these rows, as exact as the run
        itself."""
        t, y, mode = self.states(row, share)
        return evaluate_at(
            self.record,
            np.arange(len(t)),
            lambda i: (t[i], y[i], mode[i]),
            self._columns_of,
        )
