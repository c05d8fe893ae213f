"""Means of the deceleration of a run, from its greatest speed or from the command to
the first stop; they join the registry of metrics."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..hybrid import Record
from ..hybrid.arrays import Array, TwoArrays, numpy_of
from ..parts.scene import Scene
from ._wants import dead_time_of, holding_rows
from .extremes import maxima
from .metrics import METRICS, NOTHING, RIGID_HOOK, Metric, Requirement, at_first_stop
from .probe import states_at

#: speeds that differ by less than this share are the same
_SAME = 1e-12


def mean_deceleration(
    record: Record, scene: Scene, span: str, *, of_hook: bool
) -> Array:
    """A mean of the deceleration (rad/s², of the hook m/s²) to the first stop at `t_s`;
    `inf` without a stop.

        by time v_1/(t_s − t_1),   by travel v_1²/(2 s),   from the command
        v_0/(t_s − t_c)

    - `t_c`, and `v_0` then: when the lever is first told to pull more, or the start
    - `v_1`: greatest speed from then on; `t_1`: when it is that for the last time; `s`:
      travel from `t_1` to the stop
    - `span`: `time`, `travel` or `command`
    """
    rows = record.rows
    xp = numpy_of(rows.t)
    number_of = xp.arange(rows.t.shape[0], dtype=np.int32)
    stopped = at_first_stop(record, number_of.astype(np.float64))
    stops = xp.isfinite(stopped)
    count = xp.where(stops, stopped, 0.0).astype(np.int32)
    count = xp.where(stops, count, record.count)
    load: Any = scene.duty.load
    travel: Any = load.on_layer(record.modes.layer).travel() if of_hook else 1.0
    rises = holding_rows(record).rises & (number_of < count)
    row = xp.where(xp.any(rises), xp.argmax(rises), 0).astype(np.int32)
    passed = row if record.modes.phase is None else record.modes.phase[row]
    waited = xp.where(xp.any(rises), dead_time_of(scene.duty.lever, passed), 0.0)
    begin = xp.maximum(rows.t[row] - waited, rows.t[0])
    phi, speed = _at(record, begin, travel)
    if span != "command":
        # the record from the row in which the pull rises to the stop
        braked = dataclasses.replace(
            record,
            rows=jax.tree.map(lambda column: xp.roll(column, -row, axis=0), rows),
            count=count - row,
        )
        name = "max_hook_speed" if of_hook else "max_drum_speed"
        peak = maxima(braked, scene, (name,)).whole[name]
        speeds = xp.abs(record.states.omega) * travel
        same = (number_of < count) & (speeds >= peak.value * (1 - _SAME))
        last = xp.max(xp.where(same, rows.t, -xp.inf))
        at_row = last > peak.time
        of_command = speed > peak.value * (1 + _SAME)
        begin = xp.where(of_command, begin, xp.where(at_row, last, peak.time))
        phi, speed = _at(record, begin, travel)
        speed = xp.where(of_command | at_row, speed, peak.value)
    end = xp.where(stops, rows.t[count], begin)
    if span == "travel":
        turned = xp.stack([phi, xp.asarray(record.states.phi)[count]])
        places = load.travelled(turned) if of_hook else turned
        speed = 0.5 * speed**2
        end, begin = xp.abs(places[1] - places[0]), 0.0
    lasts = stops & (end > begin)
    return xp.where(lasts, speed / xp.where(lasts, end - begin, 1.0), xp.inf)


def _at(record: Record, t: Array, travel: Any) -> TwoArrays:
    """Angle (rad), and the absolute speed times the `travel` of each row, at a time."""
    row = record.find(t[None])
    h = t[None] - record.rows.t[row]
    state = states_at(record, row, h)
    per_radian = jnp.broadcast_to(travel, record.rows.t.shape)[row]
    return state.phi[0], numpy_of(state.omega).abs(state.omega * per_radian)[0]


def _metrics(
    of: str, needs: Requirement, unit: str, *, of_hook: bool
) -> dict[str, Metric]:
    """Metrics of the pulley, or of the load."""

    def metric(span: str, meaning: str, title: str) -> Metric:
        return Metric(
            unit,
            f"mean deceleration of the {of} {meaning}",
            f"Mean deceleration of the {of} {title}",
            lambda record, scene: mean_deceleration(
                record, scene, span, of_hook=of_hook
            ),
            needs,
            if_asked=True,
        )

    to_stop = "from its greatest speed to the first stop"
    over_travel = "square of the speed over twice the travel"
    of_command = "from the command to brake to the first stop: speed then over time"
    name = "mean_hook_deceleration" if of_hook else "mean_deceleration"
    return {
        f"{name}_by_time": metric("time", f"{to_stop}: speed over time", "by time"),
        f"{name}_by_travel": metric("travel", f"{to_stop}: {over_travel}", "by travel"),
        f"{name}_from_command": metric("command", of_command, "from the command"),
    }


METRICS.update(
    _metrics("pulley", NOTHING, "rad/s^2", of_hook=False)
    | _metrics("load", RIGID_HOOK, "m/s^2", of_hook=True)
)
