"""Explanation of a run, in sentences with the numbers behind them."""

import dataclasses
import os
import textwrap
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from .._base._faults import InputError
from .._base._numbers import digits, number
from .._base._progress import Progress, shown_progress
from .._base._table import Table, Tabular, frozen, plain
from ..outputs.stability import least_outweighed
from ..parts.at_start import self_locking_ratios
from ..parts.scene import Scene
from ..results import rerun
from ..runs.findings import Finding, course, holding, upper, wear, worded
from ..runs.measure import LimitVerdict, read_limits, unit_of, with_limits
from ..runs.result import Result
from ..runs.simulate import simulate
from ..runs.verdict import Verdict, verdict
from ._balance import BALANCED, as_topic, what_governs
from ._influence import most_influential, remedy_of

#: linings whose maximum over their mean is below this are alike
_ALIKE = 1 + 1e-6
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
    - `limits`: permissible values as in `simbrake.report`, beside those of the
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
            *as_topic("course", [course(result.report())]),
            *what_governs(result),
            *_linings(result),
            *_limits(result, judgement),
            *_stability(result),
        ]
        if influence and result.ok:
            findings += most_influential(result, progress)
        if accuracy and result.ok:
            progress.now("second run")
            accurate = result.accuracy()
            findings.append(
                Finding("accuracy", f"{upper(accurate.line)}.", accurate.as_dict())
            )
        findings += remedy_of(result)
    return Explanation(tuple(worded(result.scene, findings)))


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
        # (a maximum at an event is on one side of it)
        sides = (result.series([time], left=left) for left in (True, False))
        each = max((getattr(side, column)[0] for side in sides), key=np.max)
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
        verb = "gives too little," if least["margin"] < -BALANCED else "gives at least"
        phrases.append(
            f"Under the maximum force of the lever the sliding brake {verb} {torque} "
            f"against {load} of the load (at {number(least['time'], 's')}): runaway "
            f"margin {digits(100 * least['margin'], 4)} %."
        )
    for finding in holding(report):
        values["holding_reserve"] = finding.numbers["value"]
        phrases.append(f"{upper(finding.text)}.")
    return [Finding("stability", " ".join(phrases), values)] if phrases else []
