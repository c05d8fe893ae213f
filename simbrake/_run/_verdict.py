"""The verdict on a run: limits exceeded, limits nearly reached, and its colour."""

import html
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from .._base._arguments import explained
from .._base._faults import InputError
from .._base._table import coloured, number, plain, rows_table
from .._outputs._duty import DutyKind, speed_is_led, stops_words
from .._outputs._log import Status
from .._outputs._metrics import HOT, about_output
from .._outputs._probe import Entry
from ._measure import Colour, Judged, LimitCheck, LimitVerdict, judged, limit_checks, read_limits, title_of
from ._report import body_of, hottest_first
from ._result import Result

#: a margin below this share of the limit is small
SMALL_MARGIN = 0.10
#: torques that differ by less than this share of the load balance each other
_ROUNDING = 1e-9
#: a held load needs a static capacity of this multiple of it, else the holding reserve is small
SMALL_RESERVE = 1.25


class VerdictRow(NamedTuple):
    """One limit in words: `name`, `value` in the run, `limit`, `margin` with its percentage, and the `state`.

    Example:
        >>> row = result.verdict({"stopping_time": "1 s"}).rows[0]
        >>> row.name, row.value, row.limit
        ('Stopping time', '1.25772 s', '≤ 1 s')
    """

    name: str
    value: str
    limit: str
    margin: str
    state: LimitVerdict


class Verdict(NamedTuple):
    """The verdict on a run: `colour`, one line, the limits, the smallest margin first, and what they cover.

    - red: a limit is exceeded, a held load broke away although the lever was not let go, the run failed, or the load
      runs away
    - amber: a margin is below 10 % of its limit, the holding reserve below 1.25, a part of the brake that was under
      load has no limit (`judged.missing`), or the pulley still turns at the end although the duty does not prescribe
      its speed
    - green: everything else

    Example:
        >>> result.verdict({"stopping_time": "1 s"}).colour
        <Colour.RED: 'red'>
    """

    colour: Colour
    headline: str
    rows: tuple[VerdictRow, ...]
    judged: Judged

    def as_dict(self) -> Entry:
        """`{colour, headline, rows, judged}` of JSON."""
        return plain(self)

    def __str__(self) -> str:
        return f"{self.colour}: {self.headline}"


@explained
def verdict(result: Result, limits: Mapping[str, float | str] | Sequence[LimitCheck] | None = None) -> Verdict:
    """The verdict on a concrete result.

    - `limits`: maximum permissible values by metric (or `max_pressure`), in SI or as texts with a unit, beside those of
      the scene itself; or the `limit_checks` that were made of them

    A margin is `limit − value`, its percentage that of the limit; of a temperature that of the rise above 20 °C. The
    holding reserve is the static capacity over the load while the brake holds the pulley and the lever is not let go.

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
    judged_rows = [*(_row(check) for check in checks if check.limit is not None), *_of_capacity(result)]
    # the smallest margin first; what has none last
    rows = [row for _, row in sorted(judged_rows, key=lambda pair: math.inf if pair[0] is None else pair[0])]
    cover = judged(result, checks)
    return Verdict(_colour(result, rows, cover), _headline(result, rows, checks, cover), tuple(rows), cover)


def page_of(result: Result) -> str:
    """A concrete result in a notebook: the verdict as a banner, its metrics with units, and the warnings."""
    summary, said = result.report().summary, result.verdict()
    metrics = {name: value for name, value in summary["metrics"].items() if value is not None}
    rows = [
        (name, str(number(value, about_output(name)["units"])), about_output(name)["meaning"])
        for name, value in metrics.items()
    ]
    notes = "".join(f"<p>note: {html.escape(text)}</p>" for text in summary["notes"])
    notes += "".join(f"<p>warning: {html.escape(text)}</p>" for text in summary["warnings"])
    return coloured(str(said.headline), said.colour) + rows_table(rows, "")._repr_html_() + notes


def _colour(result: Result, rows: Sequence[VerdictRow], cover: Judged) -> Colour:
    states = {row.state for row in rows}
    if not result.ok or result.status in (Status.RUNAWAY, Status.NOT_FOLLOWED) or LimitVerdict.EXCEEDED in states:
        return Colour.RED
    # it may still turn at the end, at a speed that nothing prescribes or balances
    loose = result.report().summary["duty"] == DutyKind.TURNING or result.status == Status.RELEASED
    return Colour.AMBER if LimitVerdict.SMALL in states or cover.missing or loose else Colour.GREEN


def _headline(result: Result, rows: Sequence[VerdictRow], checks: Sequence[LimitCheck], cover: Judged) -> str:
    """The outcome, limits exceeded, or nearly reached, or the smallest margin; the hottest body; what was evaluated."""
    said = [_outcome(result)]
    for state, words in ((LimitVerdict.EXCEEDED, "Exceeded"), (LimitVerdict.SMALL, "Small margin")):
        these = [
            f"{row.name} {row.value}, allowed {row.limit}, margin {row.margin}" for row in rows if row.state == state
        ]
        said += [f"{words}: {'; '.join(these)}"] if these else []
    evaluated = [row for row in rows if row.state in (LimitVerdict.WITHIN, LimitVerdict.WITHIN_SO_FAR)]
    if len(said) == 1 and evaluated:
        first = evaluated[0]
        so_far = "" if result.ok else " so far"
        said.append(f"No limit exceeded{so_far}; smallest margin: {first.name}, {first.margin}")
    said[1:1] = _hottest(result, checks)
    return ". ".join([*said, *([str(cover)] if cover.of else [])])


def _hottest(result: Result, checks: Sequence[LimitCheck]) -> list[str]:
    """The hottest body of a run with heat, whichever it is."""
    summary = result.report().summary
    names = [name for name in hottest_first(summary["metrics"]) if name in HOT]
    if not names or not summary["energy"]["friction_heat"]:
        return []
    name = names[0]
    bound = next((check.limit for check in checks if check.name == name and check.limit is not None), None)
    allowed = "no limit given" if bound is None else f"allowed ≤ {number(bound, 'K')}"
    return [f"Hottest: {body_of(HOT[name], summary)} {number(summary['metrics'][name], 'K')}, {allowed}"]


def _outcome(result: Result) -> str:
    """Outcome of the run, in few words."""
    summary, m = result.report().summary, result.metrics
    match summary["duty"]:
        case DutyKind.FAILED:
            return f"Failed with the code {result.status}"
        case DutyKind.STOP:
            after = f"Stopped after {number(m['stopping_time'], 's')}"
            return after + (", then released" if result.status == Status.RELEASED else "")
        case DutyKind.STOPS:
            return f"{stops_words(summary['stops'])}; at the end {result.status.replace('_', ' ')}"
        case DutyKind.DRAG:
            return f"Lowered under the brake for {number(summary['end']['duration'], 's')}"
        case DutyKind.DRIVEN:
            return f"Driven by the motor for {number(summary['end']['duration'], 's')}"
        case DutyKind.STEADY:
            return f"Lowered at a steady {number(m['terminal_speed'], 'rad/s')}"
    message = result.message
    return message[0].upper() + message[1:]


# --- limits of metrics ------------------------------------------------------------------------------------------------


def _row(check: LimitCheck) -> tuple[float | None, VerdictRow]:
    """Margin as a share of the limit, and the row."""
    state, percent = check.verdict, check.margin_percent
    share = None if percent is None else percent / 100
    if state == LimitVerdict.WITHIN and share is not None and share < SMALL_MARGIN:
        state = LimitVerdict.SMALL
    value = check.note if check.value is None else str(number(check.value, check.unit))
    limit = f"≤ {number(check.limit, check.unit)}"
    return share, VerdictRow(title_of(check.name), value, limit, check.margin_words or "—", state)


# --- capacity of a brake ----------------------------------------------------------------------------------------------


def _state(exceeded: bool, small: bool) -> LimitVerdict:
    return LimitVerdict.EXCEEDED if exceeded else LimitVerdict.SMALL if small else LimitVerdict.WITHIN


def _of_capacity(result: Result) -> Iterator[tuple[float, VerdictRow]]:
    """Margins as shares of a limit, and rows: the holding reserve of a run that holds a load; torque over load of one
    that runs away or still turns; the tension of a lever that holds the speed."""
    report, ratios = result.report(), []
    if report.holding is not None:
        when = f"at {number(report.holding.time, 's')}"
        ratios.append(("Holding reserve (static capacity over load)", float(report.holding.value), when))
    capacity = report.summary["capacity"] or {"load_torque": None, "brake_torque": None}
    load, torque = capacity["load_torque"] or 0.0, capacity["brake_torque"]
    # (one that is not settled yet, as in a ramp of the lever, may still be short)
    short = torque is not None and torque < load * (1 - _ROUNDING) and result.status != Status.RUNAWAY
    led = speed_is_led(result.scene)  # (then the tension of the lever says the same)
    if load > 0 and torque and not led and not short:
        ratios.append(("Torque of the sliding brake over load", torque / load, "at the end"))
    for name, value, note in ratios:
        # where a load breaks away without a jump the ratio is 1 but for rounding
        state = _state(value <= 1 + 1e-9, value < SMALL_RESERVE)
        margin = f"{100 * (value - 1):+.3g} %".replace("-", "−")
        yield value - 1, VerdictRow(name, f"{value:.4g} ({note})", "> 1", margin, state)
    if report.pull is not None:
        most, value, time = report.pull
        share = 1 - value / most
        # at its maximum it follows no more: the speed is lost
        state = _state(value >= most * (1 - 1e-9), share < SMALL_MARGIN)
        margin = f"{number(most - value, 'N', count=4)} ({100 * share:.3g} %)"
        shown = f"{number(value, 'N')} (at {number(time, 's')})"
        of = result.scene.brake.force_words
        words = "Slack tension that holds the speed" + (f" ({of})" if of else "")
        yield share, VerdictRow(words, shown, f"< {number(most, 'N')}", margin, state)
