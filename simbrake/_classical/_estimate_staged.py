"""Estimates of a staged brake: its stop, the friction work of each pair, and the rows of each pair."""

import dataclasses

import numpy as np

from .._run._result import Result
from ._classical_staged import PairStop, StagedStop
from ._estimate_basis import Basis
from ._estimate_report import EstimateRow
from ._estimate_rows import balance_rows, contact_rows, depth_rows, partition_rows, power_rows
from ._estimate_run import RunValues, run_values
from ._estimate_temperatures import stress_rows, temperature_rows

_PAIRS = {
    "external": (depth_rows, partition_rows, temperature_rows, contact_rows),
    "internal": (depth_rows, partition_rows, temperature_rows, contact_rows, balance_rows, stress_rows),
}
_LEVER = "the lever takes time: until it reaches T_on the bandage rides along; the band stretches, hot linings rub less"


def pair_bases(b: Basis, stop: StagedStop | None) -> list[Basis]:
    """A basis for each pair that slides: from the run, else from the classical stop."""
    found = []
    for pair in _PAIRS:
        if b.result is not None:
            run = run_values(b.result, pair)
            if run is None:
                continue
            assert run.other_work is not None
            more, omega = float(run.other_work[-1]), float(np.max(np.abs(run.omega)))
            one = dataclasses.replace(b, run=run, time=run.duration, work=float(run.work[-1]), omega=omega)
        else:
            assert stop is not None
            own: PairStop = getattr(stop, pair)
            if own.work <= 0:
                continue
            more = stop.external.work  # it is done before or while the internal pair slides
            one = dataclasses.replace(b, time=own.time, work=own.work, omega=own.omega, slid=own.angle)
        beyond = b.beyond_share if pair == "internal" else 0.0  # the rim's, S-12…14
        found.append(dataclasses.replace(one, pair=pair, more=beyond * float(b.power.heat) * more))
    return found


def staged_rows(b: Basis, stop: StagedStop | None) -> list[EstimateRow]:
    """All rows of a staged brake: its stop, then both pairs, whose rows end with the name of the pair."""
    rows = [*stop_rows(b, stop), *power_rows(b)]
    for one in pair_bases(b, stop):
        for group in _PAIRS[one.pair]:
            rows += [dataclasses.replace(row, name=f"{row.name}, {one.pair} pair") for row in group(one)]
    return rows


def _durations(result: Result, run: RunValues) -> dict[str, float]:
    """How long each stage lasted that has a part in the braking of a run (s)."""
    found: dict[str, float] = dict.fromkeys(("stage_1", "stage_2", "stage_3"), 0.0)
    for stage in result.stages:
        if stage.name in found and stage.end > run.t[0] and stage.start < run.t[-1]:
            found[stage.name] += stage.duration
    return found


def _onset(result: Result, run: RunValues) -> float | None:
    """Slack tension (N) at which the internal pair lets go in the braking of a run."""
    for event in result.events:
        if event.name == "internal_slip" and run.t[0] <= event.time <= run.t[-1]:
            return float(np.asarray(result.series(np.asarray([event.time])).slack_tension)[0])
    return None


def stop_rows(b: Basis, stop: StagedStop | None) -> list[EstimateRow]:
    """Tension ratio, torques, durations of the stages, friction work of both pairs, beside the run's."""
    if stop is None:
        return []
    onset = torques = works = None
    lasted: dict[str, float | None] = dict.fromkeys(("stage_1", "stage_2", "stage_3"))
    metrics = {} if b.result is None else b.result.metrics
    if b.result is not None and b.run is not None:
        inner = run_values(b.result, "internal")
        outer = run_values(b.result, "external")
        torques = [None if pair is None else float(np.max(pair.torque)) for pair in (outer, inner)]
        works = [0.0 if pair is None else float(pair.work[-1]) for pair in (outer, inner)]
        onset = _onset(b.result, b.run)
        lasted |= _durations(b.result, b.run)
    model, (external, internal) = "model §4, after K", torques or (None, None)
    rows = [
        EstimateRow("tension ratio", "Π = ∏ (1 + f z)/(1 − f z), band on linings", stop.ratio, "1", "Z-12…14"),
        EstimateRow(
            "slack tension of internal slip",
            "T_on = [R Σ f N_pre − J_b M/(J + J_b)]/[R_b (Π − 1) J/(J + J_b) − R Σ f (Π_i + Π_{i−1}) s_i]",
            stop.onset,
            "N",
            model,
            onset,
            "coefficients and load as at the start; a lever that begins above it lets the pair go at once",
        ),
        EstimateRow(
            "torque, external pair", "M_ext = R_b T_0 (Π − 1)", stop.external_torque, "N*m", "Z-17", external, _LEVER
        ),
        EstimateRow(
            "torque, both pairs slide",
            "M_int = R Σ f (N_i + N_pre)",
            stop.internal_torque,
            "N*m",
            model,
            internal,
            _LEVER,
        ),
    ]
    formulas = (
        "(J + J_b) ω_0/(M_ext − M) with T_0 ≤ T_on, else 0",
        "J_b ω_0/(M_ext − M_int)",
        "J ω_2/(M_3 − M), R_b (T_n − T_0) = M_3 = M_int(T_n)",
    )
    for (name, simulated), time, formula in zip(lasted.items(), stop.times, formulas, strict=True):
        rows.append(EstimateRow(name.replace("_", " "), formula, time, "s", model, simulated, _LEVER))
    rows += [
        EstimateRow("stopping time", "t_1 + t_2 + t_3", stop.time, "s", model, metrics.get("stopping_time"), _LEVER),
        EstimateRow(
            "stopping angle", "∫ ω dt, stage by stage", stop.angle, "rad", model, metrics.get("stopping_angle"), _LEVER
        ),
    ]
    return rows + _work_rows(stop, works)


def _work_rows(stop: StagedStop, works: list[float] | None) -> list[EstimateRow]:
    """Friction work of both pairs and its shares."""
    outer, inner = works or (None, None)
    total = None if works is None else sum(works)
    model, share = "model §4, after K", None
    if works is not None and total:
        share = works[0] / total
    rows = []
    for name, formula, value, simulated in (
        ("friction work", "W_ext + W_int", stop.work, total),
        ("friction work, external pair", "W_ext = M_ext φ_b", stop.external.work, outer),
        ("friction work, internal pair", "W_int = M_int (φ_2 − φ_b) + M_3 φ_3", stop.internal.work, inner),
    ):
        rows.append(EstimateRow(name, formula, value, "J", model, simulated, _LEVER))
    for name, value, simulated in (
        ("share of the external pair", stop.external.work / stop.work, share),
        ("share of the internal pair", stop.internal.work / stop.work, None if share is None else 1 - share),
    ):
        rows.append(EstimateRow(name, "W of the pair/W", value, "1", model, simulated, _LEVER))
    return rows
