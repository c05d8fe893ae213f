"""Picture of what acts on the brake: lever and load over time."""

import numpy as np
from matplotlib.figure import Figure

from .._parts._loads import TrippingLoad
from .._run._result import Result
from ._plot_shared import dense_grid, finish


def duty(result: Result, *, figure: Figure | None = None) -> Figure:
    """Slack tension or force that the lever gives and torque of the load over the whole run, with the mass on the hook
    below where it changes."""
    record = result.record
    times = np.asarray(record.rows.t)[: int(record.count) + 1]
    knots = [e for e in result.events if e.name in ("slip_onset", "full_slip", "stop", "restart", "release")]
    t, s = dense_grid(result, float(times[0]), float(times[-1]), knots)
    # the steps end at every corner of the profiles: none of them is cut off by the even grid
    at = np.unique(times[:: 1 + len(times) // 3000])
    steps = result.series(at)
    order = np.argsort(np.concatenate([t, at]), kind="stable")
    t = np.concatenate([t, at])[order]

    def merged(name: str) -> np.ndarray:
        return np.concatenate([np.asarray(getattr(s, name)), np.asarray(getattr(steps, name))])[order]

    load = result.scene.duty.load
    rows = 3 if isinstance(load, TrippingLoad) else 2
    figure = Figure(figsize=(9.0, 1.9 * rows + 0.6), layout="constrained") if figure is None else figure
    panels = figure.subplots(rows, 1, sharex=True)
    banded = result.scene.brake.banded
    lever = merged("slack_tension" if banded else "lever_force") / 1e3
    panels[0].plot(t, lever, color="tab:blue", label="slack tension T₀" if banded else "force of the actuator F")
    panels[0].set_ylabel("tension, kN" if banded else "force, kN")
    panels[1].plot(t, merged("load_torque") / 1e3, color="tab:red", label="load torque on the shaft")
    panels[1].set_ylabel("torque, kN·m")
    if isinstance(load, TrippingLoad):
        cycles = np.arange(load.count) * float(load.period)
        edges = np.stack([cycles + float(load.taken), cycles + float(load.set)], axis=1).ravel()
        hung = float(load.string) + np.arange(load.count) * float(load.stand)
        mass = float(load.empty) + np.stack([hung, np.zeros(load.count)], axis=1).ravel()
        corners = np.concatenate([[times[0]], edges, [times[-1]]])
        heights = np.concatenate([[float(load.empty)], mass, mass[-1:]])
        panels[2].step(corners, heights / 1e3, where="post", color="tab:brown", label="mass on the hook")
        panels[2].set_ylabel("mass, t")
    finish(panels, "best")
    for panel in panels:
        panel.set_xlim(times[0], times[-1])
        panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]))
    panels[-1].set_xlabel("time, s")
    return figure
