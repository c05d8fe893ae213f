"""Ensembles of stops without heat, where the closed form tells the error of every run; and what their order gives."""

import dataclasses
import time
from typing import Any

import numpy as np

import simbrake as sb
from benchmarks.parts.timing import interleaved
from benchmarks.peers import scipy_ivp
from benchmarks.scenes import CASES, closed_form
from simbrake.studies import _ensemble

_PATHS = ("initial.omega", "brake.linings.friction.coefficient", "duty.slack_tension.level")
_NAMES = ("slip_onset_time", "full_slip_time", "stopping_time")
_END = 10.0


def drawn(count: int) -> np.ndarray:
    """Speeds, coefficients of friction and slack tensions of different stops, one row each."""
    ends = np.array([(10.0, 25.0), (0.25, 0.4), (6e3, 1e4)])
    return np.random.default_rng(1).uniform(ends[:, 0], ends[:, 1], (count, 3))


def _plain(row: np.ndarray) -> Any:
    w_0, f, T_0 = (float(x) for x in row)
    return dataclasses.replace(CASES["a"].plain, w_0=w_0, f=f, T_0=T_0, end=_END)


def _scene(load: Any = None) -> sb.Scene:
    scene = CASES["a"].simbrake()
    return sb.Scene(scene.brake, sb.Duty(scene.duty.slack_tension, load or scene.duty.load), scene.initial, _END)


def rows(count: int, rtol: float, times: int = 5) -> list[dict[str, Any]]:
    """SciPy on some of the stops, one after the other, and simbrake's ensemble on all of them."""
    table = drawn(count)
    truth = np.stack([closed_form(_plain(row)).times for row in table])
    few = max(10, count // 100)
    singles = [
        scipy_ivp.prepare(dataclasses.replace(CASES["a"], plain=_plain(row)), "SciPy DOP853", rtol)
        for row in table[:few]
    ]
    values = dict(zip(_PATHS, table.T, strict=True))

    def ours() -> Any:
        return sb.ensemble(_scene(), values, _NAMES, rtol=rtol, progress=False)

    start = time.perf_counter()
    data = ours()
    first = time.perf_counter() - start
    found = interleaved({"SciPy": lambda: [call() for call in singles], "simbrake": ours}, 0.0, times)
    theirs = np.stack([call().times for call in singles])
    mine = np.stack([data[name].values for name in _NAMES], axis=1)
    out = []
    for name, events, runs in (("SciPy", theirs, few), ("simbrake", mine, count)):
        what = f"(a) at {rtol:.0e}, " + (f"SciPy DOP853, {few} runs" if runs == few else f"{count:,} runs, all workers")
        row = {"what": what, "error": float(np.max(np.abs(events / truth[:runs] - 1)))}
        out.append(row | {"rate": runs / found[name].least, "core": runs / found[name].cpu_least})
    return [out[0], out[1] | {"first": first, "scipy": out[1]["rate"] / out[0]["rate"]}]


def wavy(t: Any, parameters: Any) -> Any:
    """A load that swings: runs take steps in proportion to their length."""
    import jax.numpy as jnp

    return 2e3 * jnp.sin(30.0 * t)


def order(count: int) -> tuple[float, float]:
    """Processor time of unsorted runs over that of sorted ones: stops that are alike, runs of very different length."""
    values = dict(zip(_PATHS, drawn(count).T, strict=True))
    lengths = 10 ** np.random.default_rng(2).uniform(-0.5, 1.5, count)
    unequal = {"end_time": lengths, "initial.omega": values["initial.omega"]}
    swinging = _scene(sb.TorqueLoad(sb.profiles.FunctionProfile(wavy)))
    sorts, found = _ensemble.expected_cost, []
    calls = {
        "stops": lambda: sb.ensemble(_scene(), values, _NAMES, progress=False),
        "lengthy": lambda: sb.ensemble(swinging, unequal, _NAMES, progress=False),
    }
    try:
        for way in (lambda columns, known, steps: np.zeros(len(columns)), sorts):
            _ensemble.expected_cost = way
            times = interleaved(calls, 0.0, 3)
            found.append([times[name].cpu_least for name in calls])
    finally:
        _ensemble.expected_cost = sorts
    (stops, lengthy), (stops_sorted, lengthy_sorted) = found
    return stops / stops_sorted, lengthy / lengthy_sorted
