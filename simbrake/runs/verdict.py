"""The verdict on a run: what it was to do, its limits, and its colour; and all that is
said of a run with its limits."""

import html
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from .._base._arguments import explained
from .._base._faults import InputError
from .._base._numbers import number
from .._base._table import JsonObject, Table, coloured, plain, rows_table
from ..outputs._wants import Want
from ..outputs.judgement import COLOURS, REASONS, SMALL_RESERVE, Colour
from ..outputs.metrics import HOT, METRICS
from .findings import (
    Finding,
    body_of,
    findings,
    in_words_of,
    remarks,
    sentence,
    stage_table,
)
from .measure import (
    SMALL_MARGIN,
    LimitCheck,
    LimitCoverage,
    LimitVerdict,
    VerdictRow,
    coverage_of,
    limit_checks,
    read_limits,
)
from .result import Result


class Verdict(NamedTuple):
    """The verdict on a run: whether the brake did what it was to do, and stayed within
    its limits.

    The colour is the worse one of two: that of the `reason`, and that of the limits.

    - `reason`: an id that does not change, as `H4` (held) or `S1` (to be stopped, and
      runs on); docs/verdict.md has all
    - `wants`: what the brake was to do at the end of the run, said or derived
    - `sentence`: the reason in words
    - `numbers`: hanging load (N·m), greatest pull (N), reserve, sliding torque over the
      load, speeds, in SI
    - `shown`: whether the run went far enough to show it; one that did not is no pass
    - `rows`: limits and reserve, the smallest margin first
    - `judged`: what the limits cover

    Limits make it red where one is exceeded, amber where a margin is below 10 % or a
    part of the brake that was under load has no limit (`judged.missing`).

    Example:
        >>> verdict = result.verdict({"stopping_time": "1 s"})
        >>> verdict.colour, verdict.reason, verdict.wants
        (<Colour.RED: 'red'>, 'H4', 'rest')
    """

    colour: Colour
    headline: str
    rows: tuple[VerdictRow, ...]
    judged: LimitCoverage
    reason: str
    wants: str
    sentence: str
    numbers: dict[str, float | None]
    shown: bool

    @property
    def fails(self) -> bool:
        """Whether it is no pass: red, or not shown by the run."""
        return self.colour == Colour.RED or not self.shown

    def as_dict(self) -> JsonObject:
        """`{colour, headline, rows, judged, reason, wants, sentence, numbers, shown}`
        of JSON."""
        return plain(self)

    def __str__(self) -> str:
        return f"{self.colour} {self.reason}: {self.headline}"


@explained
def verdict(
    result: Result,
    limits: Mapping[str, float | str] | Sequence[LimitCheck] | None = None,
) -> Verdict:
    """The verdict on a concrete result.

    - `limits`: permissible values by metric (or `max_pressure`), the greatest, or the
      least of a metric that begins with `min_`, in SI or as texts with a unit, beside
      those of the scene itself; or the `limit_checks` that were made of them

    A margin is `limit − value` (`value − limit` of a least value, `limit − |value|` of
    a motion in either sense), its percentage that of the limit; of a temperature that
    of the rise above 20 °C. The holding reserve is
    the static capacity of the friction brake alone over the torque of the hanging load:
    at rest its minimum while the brake is to hold, of a load that moves that under the
    greatest pull of the duty.

    Raises `InputError` for unknown metrics and what is not a number.

    Example:
        >>> print(sb.results.verdict(result, {"stopping_time": "1 s"}).rows[0].state)
        exceeded
    """
    if limits is None or isinstance(limits, Mapping):
        bounds, faults = read_limits(result.scene, limits or {})
        if faults:
            raise InputError(faults)
        checks: Sequence[LimitCheck] = limit_checks(result, bounds)
    else:
        checks = limits
    report = result.report()
    judgement = report.judgement
    reason = REASONS[judgement.reason]
    limited = _pull_rows(result)
    for check in checks:
        if check.limit is not None:
            percent = check.margin_percent
            share = math.inf if percent is None else percent / 100
            limited.append((share, check.row(result.scene)))
    # the smallest margin first; what has none last
    pairs = sorted(limited + _reserve_rows(result), key=lambda pair: pair[0])
    rows = tuple(row for _, row in pairs)
    covered = coverage_of(result, checks)
    words = in_words_of(result.scene, sentence(report))
    numbers = {
        "load_torque": judgement.load,
        "greatest_pull": judgement.pull,
        "reserve": judgement.reserve,
        "sliding_over_load": judgement.sliding,
        "speed": float(result.record.y_end.omega),
        "set_speed": judgement.set_speed,
    }
    colours = [COLOURS[judgement.colour]]
    colours += [row.state.colour or Colour.GREEN for _, row in limited]
    colours += [Colour.AMBER] if covered.missing else []
    return Verdict(
        max(colours, key=COLOURS.index),
        _headline(words, result, rows, checks, covered),
        rows,
        covered,
        reason.id,
        str(Want(judgement.want)),
        words,
        plain(numbers),
        reason.shown,
    )


def _headline(
    sentence: str,
    result: Result,
    rows: Sequence[VerdictRow],
    checks: Sequence[LimitCheck],
    covered: LimitCoverage,
) -> str:
    """The reason, the hottest body, limits that are exceeded or nearly reached, else
    the smallest margin, and what was evaluated."""
    phrases = [sentence]
    heading = {LimitVerdict.EXCEEDED: "Exceeded", LimitVerdict.SMALL: "Small margin"}
    for state, words in heading.items():
        if these := [f"{row.name} {row.terms}" for row in rows if row.state == state]:
            phrases.append(f"{words}: {'; '.join(these)}")
    within = (LimitVerdict.WITHIN, LimitVerdict.WITHIN_SO_FAR)
    evaluated = [row for row in rows if row.state in within]
    # where the brake did not do its work, the margin of something else says nothing
    silent = result.ok and COLOURS[result.report().judgement.colour] == Colour.RED
    if len(phrases) == 1 and evaluated and not silent:
        first = evaluated[0]
        so_far = "" if result.ok else " so far"
        margin = f"smallest margin: {first.name}, {first.margin}"
        phrases.append(f"No limit exceeded{so_far}; {margin}")
    phrases[1:1] = _hottest(result, checks)
    return ". ".join([*phrases, *([str(covered)] if covered.of else [])])


def _hottest(result: Result, checks: Sequence[LimitCheck]) -> list[str]:
    """The hottest body of a run with heat, whichever it is."""
    if not result.report().summary["energy"]["friction_heat"]:
        return []
    # (checks begin with the temperatures of a run, the highest one first)
    hot = [check for check in checks if check.name in HOT and check.value is not None]
    phrases = []
    for check in hot[:1]:
        row = check.row(result.scene)
        limit = "no limit given" if check.limit is None else f"allowed {row.limit}"
        place = body_of(HOT[check.name], result.scene)
        phrases.append(f"Hottest: {place} {row.value}, {limit}")
    return phrases


# --- a run with its limits, as text, JSON and in a notebook --------------------------


def head_lines(result: Result, checks: Sequence[LimitCheck]) -> list[str]:
    """Lines with which a text of a run begins: how it ended, verdict, limits."""
    return [
        f"{result.status}: {result.message}",
        f"verdict  {result.verdict(checks)}",
        *(
            f"limit    {check.row(result.scene)}"
            for check in checks
            if check.limit is not None
        ),
    ]


def text_with_limits(result: Result, checks: Sequence[LimitCheck]) -> str:
    """The summary of a result: about ten lines that can be read without the source."""
    report = result.report()

    def lines(found: Sequence[Finding]) -> list[str]:
        return [f"{finding.topic:8} {finding.text}" for finding in found]

    tables = []
    if "stages" in report.summary:
        tables += ["stages", *_indented(stage_table(report.summary))]
    if "stops" in report.summary:
        tables += ["stops", *_indented(report.stops)]
    blocks = [*head_lines(result, checks), *lines(findings(report)), *tables]
    return "\n".join([*blocks, *lines(remarks(report))])


def _indented(table: Table) -> list[str]:
    return [f"         {line}" for line in str(table).splitlines()]


def limit_dicts(checks: Sequence[LimitCheck]) -> list[JsonObject]:
    """Limits as numbers and words of JSON."""
    return [check.as_dict() for check in checks if check.limit is not None]


def summary_with_limits(result: Result, checks: Sequence[LimitCheck]) -> JsonObject:
    """The same as `run --json` prints it: `Result.summary`, `limits`, `verdict`, and
    the findings with their words."""
    report = result.report()
    return {
        **result.summary(),
        "limits": limit_dicts(checks),
        "verdict": result.verdict(checks).as_dict(),
        "findings": plain([*findings(report), *remarks(report)]),
    }


def page_of(result: Result) -> str:
    """A concrete result in a notebook: the verdict as a banner, its metrics with units,
    notes and warnings."""
    verdict = result.verdict()
    values = result.report().metrics
    rows = [
        (name, str(number(values[name], metric.unit)), metric.meaning)
        for name, metric in METRICS.items()
        if values.get(name) is not None
    ]
    notes = "".join(
        f"<p>{finding.topic}: {html.escape(finding.text)}</p>"
        for finding in remarks(result.report())
    )
    banner = coloured(verdict.headline, verdict.colour)
    return banner + rows_table(rows, "")._repr_html_() + notes


# --- capacity of a brake ------------------------------------------------------------


#: a ratio that is 1 but for rounding: where a load breaks away without a jump
_ROUNDING = 1e-9
#: what a friction brake has over the load, at rest and sliding
RESERVE = "Holding reserve (static capacity over load)"
SLIDING = "Torque of the sliding brake over load"
#: reasons of a load that is to stop or to hold, and moves at the end
STILL_MOVING = ("T1", "H3", "S1", "S2", "S3", "S4", "U1")


def _row(
    name: str,
    value: str,
    limit: str,
    margin: str,
    share: float,
    small: float,
    least: float = _ROUNDING,
) -> tuple[float, VerdictRow]:
    """A margin as a share of its limit, and the row of it: small below `small`,
    exceeded up to `least`."""
    state = LimitVerdict.SMALL if share < small else LimitVerdict.WITHIN
    state = LimitVerdict.EXCEEDED if share <= least else state
    return share, VerdictRow(name, value, limit, margin, state)


def _reserve_rows(result: Result) -> list[tuple[float, VerdictRow]]:
    """Rows of the holding reserve wherever a load hangs or was held with less, and of
    the torque of the sliding brake for a load that is to be stopped and still moves."""
    report = result.report()
    judgement = report.judgement
    reason = REASONS[judgement.reason].id
    least = report.holding
    red = COLOURS[judgement.colour] == Colour.RED
    known = judgement.pull > 0 or red
    if judgement.pull <= 0:
        when = "no pull of the friction brake is given"
    elif report.by_worst_angle:
        pull = number(judgement.pull, "N")
        when = f"at the worst angle of the run, if the lever pulls with {pull}"
    else:
        when = f"at the end, if the lever pulls with {number(judgement.pull, 'N')}"
    ratios: list[tuple[str, float, str]] = [(RESERVE, judgement.reserve, when)]
    if least is not None and least.value <= judgement.reserve:
        if least.value == judgement.reserve:  # (of a load at rest)
            ratios.clear()
        ratios.append((RESERVE, float(least.value), f"at {number(least.time, 's')}"))
    if reason in STILL_MOVING:
        ratios.append((SLIDING, judgement.sliding, "at the end"))
    rows = []
    for name, ratio, note in ratios:
        if math.isinf(ratio):
            continue
        value = f"{ratio:.4g} ({note})"
        share = ratio - 1 if abs(ratio - 1) > _ROUNDING else 0.0
        margin = f"{100 * share:+.3g} %".replace("-", "−")
        value = in_words_of(result.scene, value)
        small = SMALL_RESERVE - 1
        row = _row(name, value, "> 1", margin, ratio - 1, small, _ROUNDING * red)
        rows.append(row)
    if rows and not known:
        share, row = rows[0]
        rows[0] = (share, row._replace(margin="—", state=LimitVerdict.NOT_EVALUATED))
    return rows


def _pull_rows(result: Result) -> list[tuple[float, VerdictRow]]:
    """The same for the tension of a lever that holds the speed."""
    pull = result.report().pull
    if pull is None:
        return []
    # at its maximum it follows no more: the speed is lost
    most = pull["limit"]
    value = pull["value"]
    share = 1 - value / most
    of = result.scene.brake.force_words
    name = "Slack tension that holds the speed" + (f" ({of})" if of else "")
    shown = f"{number(value, 'N')} (at {number(pull['time'], 's')})"
    margin = f"{number(most - value, 'N', count=4)} ({100 * share:.3g} %)"
    return [_row(name, shown, f"< {number(most, 'N')}", margin, share, SMALL_MARGIN)]
