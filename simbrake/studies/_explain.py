"""Explanation of a run, in sentences with the numbers behind them."""

import dataclasses
import os
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import InputError
from .._base._progress import Progress, shown_progress
from .._base._table import Table, Tabular, digits, frozen, number, plain
from ..outputs.duty import DutyKind, rows_of
from ..outputs.judgement import REASONS
from ..outputs.log import failure_of, labels_of
from ..outputs.metrics import (
    HOLDING,
    allowable_values,
    energies_between,
)
from ..outputs.stability import least_outweighed
from ..parts.scene import Scene, self_locking_ratios
from ..results import rerun
from ..runs.findings import (
    Finding,
    capacity_words,
    course,
    held,
    holding,
    lower,
    mean_powers,
    powers,
    sentences,
    upper,
    wear,
    worded,
)
from ..runs.measure import (
    LimitVerdict,
    Metric,
    name_of,
    read_limits,
    title_of,
    unit_of,
    with_limits,
)
from ..runs.result import Result
from ..runs.simulate import simulate
from ..runs.verdict import Verdict, verdict
from ..shaft import AbstractAuxiliaryBrake
from ._sensitivity import FIXED, Sensitivity
from ._sensitivity import sensitivity as sensitivities

#: parameters that are named among the most influential ones, at most
_MOST = 3
#: linings whose maximum over their mean is below this are alike
_ALIKE = 1 + 1e-6
#: torques that differ by less than this share of the load balance each other
_BALANCED = 1e-9
#: percent of a balance that shows in none of its printed digits
_SHOWN = 5e-4
#: width of the text, and of the topics before it
_WIDTH = 110
_TOPIC = 13


@frozen
class Explanation(Tabular):
    """What happened in a run and why: `findings` in the order in which they are read.

    `str` gives the text, `as_dict()` topics, sentences and numbers for JSON,
    `explanation["balance"]` one of the topics: outcome, course, balance, linings,
    limits, stability, influence, accuracy, remedy, where the run has them.

    Example:
        >>> sb.studies.explain(result, influence=False)["outcome"].numbers["status"]
        'stopped'
    """

    findings: tuple[Finding, ...]

    def __getitem__(self, topic: str) -> Finding:
        for finding in self.findings:
            if finding.topic == topic:
                return finding
        raise KeyError(
            f"no topic {topic!r}; there are: "
            f"{', '.join(finding.topic for finding in self.findings)}"
        )

    def __contains__(self, topic: object) -> bool:
        return any(finding.topic == topic for finding in self.findings)

    __iter__ = None

    def parts(self) -> Iterable[str | Table]:
        for finding in self.findings:
            head = f"{finding.topic:{_TOPIC - 1}} "
            yield textwrap.fill(
                finding.text,
                _WIDTH,
                initial_indent=head,
                subsequent_indent=" " * _TOPIC,
            )


def explain(
    run: Result | Scene | str | os.PathLike[str],
    *,
    limits: Mapping[str, float | str] | None = None,
    influence: bool = True,
    accuracy: bool = False,
    rtol: float = 1e-10,
    progress: bool | Progress | None = False,
) -> Explanation:
    """Explain a run: how it went, what governs it, which lining and limit come first,
    and what would change it most.

    - `run`: a concrete result; a scene, which is run; or a file or folder of results,
      whose scene is run again
    - `limits`: maximum permissible values as in `simbrake.report`, beside those of the
      scene
    - `influence`: differentiate the run, to name the parameters with the largest
      elasticities
    - `accuracy`: run a second time, to estimate the errors of the run
      (`Result.accuracy`)
    - `rtol`: of the run;  `progress`: as in `simbrake.sensitivity`

    The **balance** of a stop is work per angle: the mean torque of the brake
    `M_b = W_b/φ` is the sum of that of the load `W_load/φ`, that which takes the
    kinetic energy `ΔE_kin/φ`, and what lever, band, shaft and motor give. The
    **stability** is `1 − f tan(β/2)` of the lining nearest self-locking, and the
    minimum torque of the sliding brake over the load under the maximum force of the
    lever.

    Raises `InputError` for errors of the scene or the limits.

    Example:
        >>> told = sb.studies.explain(result, influence=False)
        >>> told["balance"].numbers["governs"]
        'inertia'
    """
    with shown_progress(progress, "explain", "compiling the run…") as progress:
        if isinstance(run, Scene):
            run = simulate(run, rtol=rtol, throw=False, progress=progress)
        result = run if isinstance(run, Result) else rerun(Path(run))
        bounds, faults = read_limits(result.scene, limits or {})
        if faults:
            raise InputError(faults)
        result = dataclasses.replace(
            result, scene=with_limits(result.scene, bounds)
        )  # with their events
        judgement = verdict(result, bounds)
        progress.now("post-processing")
        exceeded = sum(row.state == LimitVerdict.EXCEEDED for row in judgement.rows)
        outcome = {
            "colour": str(judgement.colour),
            "status": result.status,
            "exceeded": exceeded,
        }
        outcome |= {
            "reason": judgement.reason,
            "wants": judgement.wants,
            "shown": judgement.shown,
            "fails": judgement.fails,
        }
        findings = [
            Finding("outcome", f"{judgement}.", outcome, judgement.colour),
            *_topic("course", [course(result.report())]),
            *_balance(result),
            *_linings(result),
            *_limits(result, judgement),
            *_stability(result),
        ]
        if influence and result.ok:
            findings += _influence(result, progress)
        if accuracy and result.ok:
            progress.now("second run")
            accurate = result.accuracy()
            findings.append(
                Finding("accuracy", f"{upper(accurate.line)}.", accurate.as_dict())
            )
        findings += _remedy(result)
    return Explanation(tuple(worded(result.scene, findings)))


# --- course and balance -------------------------------------------------------------


def _topic(topic: str, found: Sequence[Finding]) -> list[Finding]:
    """Findings as the sentences of one topic, with the numbers of all."""
    numbers = dict[str, Any]()
    for finding in found:
        numbers |= finding.numbers
    text = sentences(finding.text for finding in found)
    return [Finding(topic, text, numbers)] if found else []


def _balance(result: Result) -> list[Finding]:
    """What governs the run: torques of a stop, torques at rest, or powers of a
    lowering."""
    report = result.report()
    kind = report.summary["duty"]
    if found := [*held(report), *powers(report)]:
        return _topic("balance", found)
    if kind in (DutyKind.STOP, DutyKind.STOPS):
        if float(result.energy["friction_heat"]) > 0:
            return [_torque_budget(result, kind)]
        return _topic("balance", [mean_powers(report)])
    capacity = report.summary["capacity"]
    if capacity is None or not capacity["brake_torque"]:
        return []
    load = capacity["load_torque"]
    torque = capacity["brake_torque"]
    left = torque - load
    if abs(left) <= _BALANCED * load:
        rest = "they balance, and the speed stays as it is"
    elif left > 0:
        rest = f"{number(left, 'N*m')} are left to slow it down"
    else:
        rest = f"{number(-left, 'N*m')} too little"
    words = capacity_words(result.end_capacity, result.scene)
    numbers = {"brake_torque": torque, "load_torque": load}
    return [Finding("balance", f"At the end {words}: {rest}.", numbers)]


#: works that are not those of brake, load and inertia, as they add to what the brake
#: takes
_OTHERS = (
    ("lever_work", 1),
    ("motor_work", 1),
    ("elastic_change", -1),
    ("shaft_work", -1),
    ("pick_up_heat", -1),
)


def _torque_budget(result: Result, kind: str) -> Finding:
    """Mean torques over the angle of a single stop, or of the longest of several from
    the onset of slip on."""
    record = result.record.compact()
    words = result.scene.brake.words
    t = np.asarray(record.rows.t)
    phi = np.asarray(record.states.phi)
    stops = rows_of(labels_of(record), result.report().turned)
    number_of = int(np.argmax([t[stop.stop] - t[stop.onset] for stop in stops]))
    stop = stops[number_of]
    first = stop.start if kind == DutyKind.STOP else stop.onset
    last = stop.stop
    e = {
        name: float(value)
        for name, value in energies_between(record, first, last).items()
    }
    angle = abs(float(phi[last] - phi[first]))
    brake = sum(
        e.get(name, 0.0)
        for name in (
            "friction_heat",
            "electrical_work",
            "mechanical_work",
            "damper_heat",
        )
    )
    others = sum(sign * e.get(name, 0.0) for name, sign in _OTHERS)
    works = {
        "brake": brake,
        "load": e["load_work"] + e.get("rope_work", 0.0),
        "inertia": -e["kinetic_change"],
        "others": others,
    }
    torque = {name: work / angle for name, work in works.items()} if angle else works
    share = {name: 100 * work / brake if brake else 0.0 for name, work in works.items()}

    def term(name: str) -> str:
        return (
            f"{number(torque[name], 'N*m', count=5)} "
            f"({digits(round(share[name], 9) + 0.0, 3)} %)"
        )

    which = (
        "the stop"
        if kind == DutyKind.STOP
        else f"stop {number_of + 1}, the longest, from the onset of slip on"
    )
    over = f"the {number(angle, 'rad', count=5)} of {which},"
    whole = number(torque["brake"], "N*m", count=5)
    text = f"Averaged over {over} the brake gives {whole}: "
    text += f"{term('load')} against the load, {term('inertia')} against the inertia"
    minor = abs(share["others"]) < _SHOWN
    others = _others_words(result.scene)
    text += ". " if minor else f", {term('others')} from {others}. "
    governs = "load" if works["load"] > works["inertia"] else "inertia"
    why = {
        "load": "The load governs: the brake works mainly to hold it while the "
        f"{words.body} turns.",
        "inertia": "The inertia governs: the brake mainly takes kinetic energy.",
    }[governs]
    numbers = {f"{name}_torque": value for name, value in torque.items()} | {
        f"{name}_work": w for name, w in works.items()
    }
    return Finding(
        "balance",
        text + why,
        {**numbers, "stop": number_of + 1, "angle": angle, "governs": governs},
    )


def _others_words(scene: Scene) -> str:
    """What of a scene takes or gives work beside brake, load and inertia, in words."""
    auxiliary = [law for law in scene.shaft if isinstance(law, AbstractAuxiliaryBrake)]
    parts = ["lever"]
    parts += ["band"] if scene.brake.banded else []
    parts += ["auxiliary brake"] if auxiliary else []
    parts += ["friction of the shaft"] if len(scene.shaft) > len(auxiliary) else []
    parts += ["motor"] if scene.motor is not None else []
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))


# --- linings, limits, stability -----------------------------------------------------


def _linings(result: Result) -> list[Finding]:
    """Which lining is most loaded, hottest, most worn, and by how much more than the
    mean."""
    summary = result.report().summary
    words = result.scene.brake.words
    at = summary["at"]
    phrases = []
    numbers = {}
    loaded = ("max_normal_load", "most loaded")
    hottest = ("peak_lining_temperature", "hottest")
    for (name, what), column in (
        (loaded, "normal_load"),
        (hottest, "lining_temperature"),
    ):
        if f"{name}_lining" not in at or summary["metrics"].get(name) is None:
            continue
        lining = at[f"{name}_lining"]
        time = at[f"{name}_time"]
        value = summary["metrics"][name]
        each = np.asarray(getattr(result.series([time]), column))[0]
        zero = 293.15 if column.endswith("temperature") else 0.0
        mean = float(np.mean(each)) - zero
        over = (float(np.max(each)) - zero) / mean if mean > 0 else 1.0
        shown = f"{number(value, unit_of(name))} at {number(time, 's')}"
        numbers[name] = {
            "lining": lining,
            "value": value,
            "time": time,
            "over_mean": over,
        }
        if over < _ALIKE:
            phrases.append(f"All {words.lining}s are alike, {what} with {shown}.")
            continue
        rise = ", counted from 20 °C" if zero else ""
        phrases.append(
            f"{words.lining.capitalize()} {lining} is the {what}: {shown}, "
            f"{digits(over, 3)} times the mean{rise}."
        )
    for finding in wear(result.report()):
        if finding.numbers["over_mean"] is not None:
            numbers["greatest_wear"] = finding.numbers
            phrases.append(f"{upper(finding.text)}.")
    if phrases and result.scene.brake.banded and len(numbers):
        count = result.scene.brake.linings.count
        phrases.append(f"Linings count from the slack end, 1 to {count}.")
    return [Finding("linings", " ".join(phrases), numbers)] if phrases else []


def _limits(result: Result, judgement: Verdict) -> list[Finding]:
    """The limit that comes first, and when it was first exceeded; how many are
    exceeded, and what has none."""
    rows = [row for row in judgement.rows if row.state != LimitVerdict.NOT_EVALUATED]
    none = (
        f"{part} (--limit {' or '.join(names)})"
        for part, names in judgement.judged.missing.items()
    )
    missing = f" No limit for: {', '.join(none)}." if judgement.judged.missing else ""
    if not rows:
        text = (
            "No limit was given, and the scene has none: give limits, as in --limit "
            '"max_tension=120 kN".'
        )
        return [Finding("limits", text + missing, {})]
    first, *others = rows
    exceeded = [row.name for row in others if row.state == LimitVerdict.EXCEEDED]
    text = f"{first}."
    if exceeded:
        text += f" Exceeded as well: {', '.join(exceeded)}."
    elif others:
        text += f" Next: {others[0]}."
    return [Finding("limits", text + missing, {"rows": plain(rows)})]


def _stability(result: Result) -> list[Finding]:
    """The nearest instability: linings that lock themselves, a load that outweighs the
    brake, one that breaks away."""
    scene = result.scene
    report = result.report()
    values = {}
    phrases = []
    ratios = self_locking_ratios(
        scene
    )  # of a band that locks at 1, with static friction at the start
    lining = int(np.argmax(ratios)) + 1
    ratio = float(np.max(ratios))
    if ratio > 0:
        margin = 1.0 - ratio
        values["self_locking"] = {"lining": lining, "ratio": ratio, "margin": margin}
        words = "f·tan(β/2)" if scene.brake.banded else "the self-locking ratio"
        where = (
            f"{scene.brake.words.lining} {lining}: {words} = {digits(ratio, 4)}, "
            f"margin {digits(margin, 4)}"
        )
        phrases.append(
            (
                "Locks itself: "
                if margin <= 0
                else "Nearest self-locking at the start is "
            )
            + where
            + "."
        )
    least = least_outweighed(report.scan)
    if least is not None:
        values["runaway"] = least
        torque = number(least["torque"], "N*m")
        load = number(least["load"], "N*m")
        verb = "gives too little," if least["margin"] < -_BALANCED else "gives at least"
        phrases.append(
            f"Under the maximum force of the lever the sliding brake {verb} {torque} "
            f"against {load} of the load "
            f"(at {number(least['time'], 's')}): runaway margin "
            f"{digits(100 * least['margin'], 4)} %."
        )
    for finding in holding(report):
        values["holding_reserve"] = finding.numbers["value"]
        phrases.append(f"{upper(finding.text)}.")
    return [Finding("stability", " ".join(phrases), values)] if phrases else []


# --- what would change it -----------------------------------------------------------


def torque_over_load(result: Result) -> Any:
    """Torque of the sliding brake over the load torque at the end."""
    capacity = result.end_capacity
    return capacity.torque / capacity.hanging


def _subject(result: Result) -> Metric:
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
    choice: dict[str, Metric | None] = {
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


def _influence(result: Result, progress: Progress) -> list[Finding]:
    """The parameters with the largest elasticities."""
    metric = _subject(result)
    try:
        table: Any = sensitivities(
            result.scene, metric, span=None, rtol=float(result.rtol), progress=progress
        )
    except InputError as error:
        return [Finding("influence", f"No derivative: {error.faults[0].problem}.", {})]

    def change(
        row: Sensitivity,
    ) -> (
        float
    ):  # by 1 % of a parameter, but by 1 K (a percentage of kelvins says nothing)
        return row.derivative if row.unit == "K" else table.value * row.elasticity / 100

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
            f"{'1 K' if row.unit == 'K' else '1 %'} more of {row.path} "
            f"({number(row.value, row.unit)}) {shown}{side}"
        )

    numbers = {
        row.path: {
            "elasticity": row.elasticity,
            "derivative": row.derivative,
            "value": row.value,
        }
        for row in rows
    }
    if not rows:
        return [
            Finding(
                "influence",
                f"No parameter changes the {words}.",
                {"metric": name_of(metric)},
            )
        ]
    text = f"What changes the {words} most: {'; '.join(effect(row) for row in rows)}."
    return [
        Finding("influence", text, {"metric": name_of(metric), "parameters": numbers})
    ]


def _remedy(result: Result) -> list[Finding]:
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
