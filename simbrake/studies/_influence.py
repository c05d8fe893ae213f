"""What changes a run most, and what to do where it failed."""

from typing import Any

import numpy as np

from .._base._faults import InputError
from .._base._numbers import digits, number, scale
from .._base._progress import Progress
from ..outputs.duty import DutyKind
from ..outputs.judgement import REASONS
from ..outputs.log import failure_of
from ..outputs.metrics import HOLDING, allowable_values
from ..runs.findings import Finding, lower, upper
from ..runs.measure import MetricLike, name_of, title_of, unit_of
from ..runs.result import Result
from ._sensitivity import sensitivity as sensitivities
from ._sensitivity_table import FIXED, Sensitivity

#: parameters that are named among the most influential ones, at most
_MOST = 3


def torque_over_load(result: Result) -> Any:
    """Torque of the sliding brake over the load torque at the end."""
    capacity = result.end_capacity
    return capacity.torque / capacity.hanging


def _subject(result: Result) -> MetricLike:
    """The number that matters most in the duty of a run."""
    kind = result.report().summary["duty"]
    m = result.metrics
    hot = next(
        (
            name
            for name in ("peak_lining_temperature", "peak_rim_temperature")
            if m.get(name) is not None
        ),
        None,
    )
    capacity = result.report().summary["capacity"]
    choice: dict[str, MetricLike | None] = {
        DutyKind.STOP: "stopping_time",
        DutyKind.STOPS: hot or "stopping_time",
        DutyKind.HOLD: HOLDING if m.get(HOLDING) is not None else None,
        DutyKind.DRAG: hot
        or ("max_tension" if "max_tension" in m else "max_normal_load"),
        DutyKind.STEADY: "terminal_speed",
        DutyKind.DRIVEN: "energy.motor_work",
    }
    outweighed = (
        torque_over_load
        if capacity and capacity["load_torque"] and capacity["brake_torque"]
        else None
    )
    return choice.get(kind, outweighed) or "energy.friction_heat"


def most_influential(result: Result, progress: Progress) -> list[Finding]:
    """The parameters with the largest elasticities."""
    metric = _subject(result)
    try:
        table: Any = sensitivities(
            result.scene, metric, span=None, rtol=float(result.rtol), progress=progress
        )
    except InputError as error:
        return [Finding("influence", f"No derivative: {error.faults[0].problem}.", {})]

    degrees, _, degree = scale("K", 1.0)  # of the units shown in a kelvin

    def change(row: Sensitivity) -> float:
        """By 1 % of a parameter, but by 1 K or °F (a percentage of them says
        nothing)."""
        hot = row.unit == "K"
        return row.derivative / degrees if hot else table.value * row.elasticity / 100

    rows = [
        row
        for row in table.matters
        if not row.path.endswith(FIXED) and np.isfinite(row.elasticity) and row.value
    ]
    rows = sorted(rows, key=lambda row: -abs(change(row)))[:_MOST]
    words = (
        lower(title_of(metric))
        if isinstance(metric, str)
        else "torque of the sliding brake over the load"
    )
    hot = isinstance(metric, str) and unit_of(metric) == "K"

    def effect(row: Sensitivity) -> str:
        by = change(row)
        shown = (
            number(by, "K", absolute=False, count=3)
            if hot
            else f"{digits(100 * by / table.value, 3)} %"
        )
        side = " (one-sided derivative)" if row.note.startswith("one-sided") else ""
        return (
            f"1 {degree if row.unit == 'K' else '%'} more of {row.path} "
            f"({number(row.value, row.unit)}) {shown}{side}"
        )

    text = f"No parameter changes the {words}."
    numbers: dict[str, Any] = {"metric": name_of(metric)}
    if rows:
        effects = "; ".join(map(effect, rows))
        text = f"What changes the {words} most: {effects}."
        names = ("elasticity", "derivative", "value")
        numbers["parameters"] = {
            row.path: {name: getattr(row, name) for name in names} for row in rows
        }
    return [Finding("influence", text, numbers)]


def remedy_of(result: Result) -> list[Finding]:
    """What to do about a run that failed, or whose load is not stopped or held by the
    friction brake."""
    judgement = result.report().judgement
    reason = REASONS[judgement.reason]
    to_rest = reason.id == "T1" and result.verdict().wants == "rest"
    weak = (reason.goes_on or to_rest) and 0 < judgement.sliding < 1
    if not (result.ok or weak):
        text = ". ".join(
            map(upper, failure_of(int(result.code), result.scene.brake.words))
        )
        return [
            Finding(
                "remedy",
                f"{text}.",
                {"code": int(result.code), "status": result.status},
            )
        ]
    if not weak:
        return []
    factor = 1 / judgement.sliding
    times = digits(factor, 4)
    hot = "At the temperatures of the end the" if result.scene.heated else "The"
    text = f"{hot} brake would balance the load with {times} times its torque: "
    text += (
        f"with the force of the lever multiplied by {times}, or the load divided by it."
    )
    m = result.metrics
    most = allowable_values(result.scene)
    for name in ("max_lever_force", "max_actuator_pressure"):
        if name in most and m.get(name) is not None and factor * m[name] > most[name]:
            unit = unit_of(name)
            bound = number(most[name], unit, count=4)
            text += (
                f" That is {number(factor * m[name], unit, count=4)}, more than "
                f"the {bound} allowed: "
            )
            text += "reduce the load, or give the brake more friction or wrap."
    return [Finding("remedy", text, {"factor": factor})]
