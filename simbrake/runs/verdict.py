"""The verdict on a run: limits exceeded, limits nearly reached, and its colour."""

import html
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from .._base._arguments import explained
from .._base._faults import InputError
from .._base._table import coloured, digits, number, plain, rows_table
from ..outputs._wants import Want
from ..outputs.duty import DutyKind, stops_words
from ..outputs.judgement import COLOURS, REASONS, SMALL_RESERVE, Colour, Judgement
from ..outputs.log import Status
from ..outputs.metrics import HOT, about_output
from ..outputs.probe import Entry
from ..shaft import AbstractDryTorque
from .measure import (
    Judged,
    LimitCheck,
    LimitVerdict,
    judged,
    limit_checks,
    read_limits,
    title_of,
)
from .report import body_of, hottest_first
from .result import Result

#: a margin below this share of the limit is small
SMALL_MARGIN = 0.10


class VerdictRow(NamedTuple):
    """One limit in words: `name`, `value` in the run, `limit`, `margin` with its
    percentage, and the `state`.

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
        >>> said = result.verdict({"stopping_time": "1 s"})
        >>> said.colour, said.reason, said.wants
        (<Colour.RED: 'red'>, 'H4', 'rest')
    """

    colour: Colour
    headline: str
    rows: tuple[VerdictRow, ...]
    judged: Judged
    reason: str
    wants: str
    sentence: str
    numbers: dict[str, float | None]
    shown: bool

    @property
    def fails(self) -> bool:
        """Whether it is no pass: red, or not shown by the run."""
        return self.colour == Colour.RED or not self.shown

    def as_dict(self) -> Entry:
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

    - `limits`: maximum permissible values by metric (or `max_pressure`), in SI or as
      texts with a unit, beside those of the scene itself; or the `limit_checks` that
      were made of them

    A margin is `limit − value`, its percentage that of the limit; of a temperature that
    of the rise above 20 °C. The holding reserve is the static capacity of the friction
    brake alone over the torque of the hanging load: at rest its minimum while the brake
    is to hold, of a load that moves that under the greatest pull of the duty.

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
    judgement = result.report().judgement
    limited = [_row(check) for check in checks if check.limit is not None] + _pull_row(
        result
    )
    # the smallest margin first; what has none last
    rows = [
        row
        for _, row in sorted(limited + _reserve_rows(result), key=lambda pair: pair[0])
    ]
    cover = judged(result, checks)
    reason = REASONS[judgement.reason]
    sentence = _sentence(result)
    colour = _worse(
        COLOURS[judgement.colour], _colour_of_limits([row for _, row in limited], cover)
    )
    numbers = {
        "load_torque": judgement.load,
        "greatest_pull": judgement.pull,
        "reserve": judgement.reserve,
        "sliding_over_load": judgement.sliding,
        "speed": float(result.record.y_end.omega),
        "set_speed": judgement.set_speed,
    }
    return Verdict(
        colour,
        _headline(sentence, result, rows, checks, cover),
        tuple(rows),
        cover,
        reason.id,
        str(Want(judgement.want)),
        sentence,
        plain(numbers),
        reason.shown,
    )


def page_of(result: Result) -> str:
    """A concrete result in a notebook: the verdict as a banner, its metrics with units,
    and the warnings."""
    summary = result.report().summary
    said = result.verdict()
    metrics = {
        name: value for name, value in summary["metrics"].items() if value is not None
    }
    rows = [
        (
            name,
            str(number(value, about_output(name)["units"])),
            about_output(name)["meaning"],
        )
        for name, value in metrics.items()
    ]
    notes = "".join(f"<p>note: {html.escape(text)}</p>" for text in summary["notes"])
    notes += "".join(
        f"<p>warning: {html.escape(text)}</p>" for text in summary["warnings"]
    )
    return (
        coloured(str(said.headline), said.colour)
        + rows_table(rows, "")._repr_html_()
        + notes
    )


def _colour_of_limits(rows: Sequence[VerdictRow], cover: Judged) -> Colour:
    states = {row.state for row in rows}
    if LimitVerdict.EXCEEDED in states:
        return Colour.RED
    return (
        Colour.AMBER if LimitVerdict.SMALL in states or cover.missing else Colour.GREEN
    )


def _worse(*colours: str) -> Colour:
    return max((Colour(colour) for colour in colours), key=COLOURS.index)


def _headline(
    sentence: str,
    result: Result,
    rows: Sequence[VerdictRow],
    checks: Sequence[LimitCheck],
    cover: Judged,
) -> str:
    """The reason, the hottest body, limits exceeded, or nearly reached, or the smallest
    margin; what was evaluated."""
    said = [sentence]
    for state, words in (
        (LimitVerdict.EXCEEDED, "Exceeded"),
        (LimitVerdict.SMALL, "Small margin"),
    ):
        these = [
            f"{row.name} {row.value}, allowed {row.limit}, margin {row.margin}"
            for row in rows
            if row.state == state
        ]
        said += [f"{words}: {'; '.join(these)}"] if these else []
    evaluated = [
        row
        for row in rows
        if row.state in (LimitVerdict.WITHIN, LimitVerdict.WITHIN_SO_FAR)
    ]
    # where the brake did not do its work, the margin of something else says nothing
    silent = result.ok and COLOURS[result.report().judgement.colour] == Colour.RED
    if len(said) == 1 and evaluated and not silent:
        first = evaluated[0]
        so_far = "" if result.ok else " so far"
        said.append(
            f"No limit exceeded{so_far}; smallest margin: {first.name}, {first.margin}"
        )
    said[1:1] = _hottest(result, checks)
    return ". ".join([*said, *([str(cover)] if cover.of else [])])


def _hottest(result: Result, checks: Sequence[LimitCheck]) -> list[str]:
    """The hottest body of a run with heat, whichever it is."""
    summary = result.report().summary
    names = [name for name in hottest_first(summary["metrics"]) if name in HOT]
    if not names or not summary["energy"]["friction_heat"]:
        return []
    name = names[0]
    bound = next(
        (
            check.limit
            for check in checks
            if check.name == name and check.limit is not None
        ),
        None,
    )
    allowed = "no limit given" if bound is None else f"allowed ≤ {number(bound, 'K')}"
    return [
        f"Hottest: {body_of(HOT[name], summary)} {number(summary['metrics'][name], 'K')}, {allowed}"
    ]


def _sentence(result: Result) -> str:
    """The reason of a verdict in words, with its numbers."""
    report = result.report()
    judgement = report.judgement
    end = report.summary["end"]
    reason = REASONS[judgement.reason]
    speed = number(abs(end["omega"]), "rad/s")
    moves = f"{speed}" + (" upwards" if end["omega"] < 0 else "")
    sliding = (
        f"the sliding friction brake gives {digits(judgement.sliding, 3)} of the "
        "load's torque"
    )
    reserve = f"{digits(judgement.reserve, 4)} of the load"
    pulled = (
        f"reserve if the lever is pulled: {digits(judgement.reserve, 4)}"
        if judgement.pull > 0
        else ""
    )
    at_limit = (
        f"; its lever is at the limit of {number(judgement.pull, 'N')}"
        if judgement.pull > 0
        else ""
    )
    ends = f"the end time of {number(end['time'], 's')}"
    match reason.id:
        case "F1":
            return f"Failed with the code {result.status}{_load_words(judgement)}"
        case "T1":
            phase = _upper(str(report.phase_at_end))
            return f"{phase} did not end before {ends}" + (
                f": {sliding}" if judgement.sliding <= 1 else ""
            )
        case "H1":
            when, capacity = report.broke_away
            return (
                f"The held load broke away at {number(when, 's')}: static capacity "
                f"{digits(capacity, 4)} of the load"
            )
        case "H2":
            return (
                "At rest, but the friction brake alone holds "
                f"{reserve}{_beside_the_brake(result)}"
            )
        case "H3":
            return f"To hold the load, and moves at {moves}: {sliding}"
        case "H4":
            many = (
                f"; at the end {result.status.replace('_', ' ')}"
                if "stops" in report.summary
                else ""
            )
            return _stopped(result) + many + _static_alone(judgement)
        case "H5":
            ask = 'if that is meant, say wants = "lower" or "free"'
            return (
                f"{_stopped(result)}, then the lever was let go; the load moves on "
                f"at {moves}: {ask}"
            )
        case "H7":
            return "Held by the motor alone: at a power failure the load falls"
        case "X0":
            return f"{_led(result)}; no load hangs"
        case "X1":
            falls = end["omega"] * judgement.load > 0
            if judgement.sliding_now > 0:
                return (
                    f"The load {'runs on' if falls else 'moves'} at {moves}: {sliding}"
                )
            return f"The brake is open, and the load {'falls' if falls else 'moves'} at {moves}"
        case "S1":
            return f"To be stopped, and runs on at {moves}: {sliding}"
        case "S3":
            return f"Runs away, at {moves} at the end: {sliding}"
        case "S2":
            return f"Not shown: still at {moves} at {ends}; give a later end_time"
        case "M0" | "L0":
            return (
                f"Not shown: at {moves} of "
                f"{number(abs(judgement.set_speed), 'rad/s')} at {ends}; give a later one"
            )
        case "M1":
            return f"Hoisted at {speed}" + (f"; {pulled}" if pulled else "")
        case "M3" | "S4":
            return f"The motor works against the applied brake, at {moves}: {sliding}"
        case "L1":
            return f"Lowered at {speed} as prescribed" + (
                f"; {pulled}" if pulled else f"; {_NO_PULL}"
            )
        case "L2":
            return (
                f"The speed is lost: {moves} instead of "
                f"{number(judgement.set_speed, 'rad/s')}{at_limit}"
            )
        case "L3":
            return f"Never comes to its speed: at {moves} at the end"
        case "L4":
            return f"Lowered at a steady {speed}; {pulled}"
        case "L5":
            return f"Lowered at a steady {speed}; {_NO_PULL}"
        case "L6":
            falls = COLOURS[judgement.colour] == Colour.RED
            return (
                f"Falls freely, at {moves} at the end"
                if falls
                else f"Lowered, not yet steadily: at {moves} at the end"
            )
        case "L7":
            return (
                f"Lowered at {speed}, past the critical speed of the eddy-current brake"
            )
        case "U1":
            return (
                f"Moves at {moves}, and the duty does not say that it is to: "
                f"{sliding}. If it is meant, give `wants`"
            )
    return reason.words


def _beside_the_brake(result: Result) -> str:
    """What bears the part of a resting load that the friction brake does not."""
    scene = result.scene
    dry = any(isinstance(law, AbstractDryTorque) for law in scene.shaft)
    others = ["the motor"] * (scene.motor is not None) + [
        "dry friction of the shaft"
    ] * dry
    return f"; {' or '.join(others)} holds the rest" if others else ""


_NO_PULL = "no pull of the friction brake is given: nothing is said of holding"


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _load_words(judgement: Judgement) -> str:
    if not math.isfinite(judgement.sliding):
        return ""
    return f"; the load hangs with {number(abs(judgement.load), 'N*m')}"


def _static_alone(judgement: Judgement) -> str:
    """What a brake that holds by static friction alone could not do."""
    if not judgement.sliding_now <= 1 < judgement.reserve < math.inf:
        return ""
    share = digits(judgement.sliding_now, 4)
    return f"; held by static friction alone: sliding, the brake gives {share} of the load's torque"


def _led(result: Result) -> str:
    """What a run without a hanging load did."""
    summary = result.report().summary
    if summary["duty"] == DutyKind.DRIVEN:
        return f"Driven by the motor for {number(summary['end']['duration'], 's')}"
    return _upper(result.message)


def _stopped(result: Result) -> str:
    """That and when the pulley came to rest."""
    summary = result.report().summary
    stop = result.metrics["stopping_time"]
    if "stops" in summary:
        return stops_words(summary["stops"])
    if stop is None:
        if summary["status"] in (Status.HELD, Status.STOPPED):
            return _upper(result.message)
        return (
            "Not brought to rest"
            if result.report().holding is None
            else "Held from the start"
        )
    return f"Stopped after {number(stop, 's')}"


# --- limits of metrics --------------------------------------------------------------


def _row(check: LimitCheck) -> tuple[float, VerdictRow]:
    """Margin as a share of the limit, infinite where there is none, and the row."""
    state = check.verdict
    percent = check.margin_percent
    share = math.inf if percent is None else percent / 100
    if state == LimitVerdict.WITHIN and share < SMALL_MARGIN:
        state = LimitVerdict.SMALL
    value = check.note if check.value is None else str(number(check.value, check.unit))
    limit = f"≤ {number(check.limit, check.unit)}"
    return share, VerdictRow(
        title_of(check.name), value, limit, check.margin_words or "—", state
    )


# --- capacity of a brake ------------------------------------------------------------


#: what a friction brake has over the load, at rest and sliding
RESERVE = "Holding reserve (static capacity over load)"
SLIDING = "Torque of the sliding brake over load"
#: reasons of a load that is to stop or to hold, and moves at the end
STILL_MOVING = ("T1", "H3", "S1", "S2", "S3", "S4", "U1")


def _state(exceeded: bool, small: bool) -> LimitVerdict:
    return (
        LimitVerdict.EXCEEDED
        if exceeded
        else LimitVerdict.SMALL
        if small
        else LimitVerdict.WITHIN
    )


def _reserve_rows(result: Result) -> list[tuple[float, VerdictRow]]:
    """Margins as shares, and rows: the holding reserve wherever a load hangs, and of
    one that is to be stopped and still moves the torque of the sliding brake."""
    judgement = result.report().judgement
    if not math.isfinite(judgement.reserve):
        return []
    holding = result.report().holding
    at_rest = REASONS[judgement.reason].id in ("H1", "H2", "H4")
    if judgement.pull <= 0:
        when = "no pull of the friction brake is given"
    elif holding is not None and at_rest:
        when = f"at {number(holding.time, 's')}"
    else:
        when = f"at the end, if the lever is pulled with {number(judgement.pull, 'N')}"
    given = judgement.pull > 0 or COLOURS[judgement.colour] == Colour.RED
    ratios = [(RESERVE, judgement.reserve, when, given)]
    if REASONS[judgement.reason].id in STILL_MOVING:
        ratios.append((SLIDING, judgement.sliding, "at the end", True))
    rows = []
    for name, value, note, is_known in ratios:
        # where a load breaks away without a jump the ratio is 1 but for rounding
        state = (
            _state(value <= 1 + 1e-9, value < SMALL_RESERVE)
            if is_known
            else LimitVerdict.NOT_EVALUATED
        )
        margin = f"{100 * (value - 1):+.3g} %".replace("-", "−") if is_known else "—"
        rows.append(
            (value - 1, VerdictRow(name, f"{value:.4g} ({note})", "> 1", margin, state))
        )
    return rows


def _pull_row(result: Result) -> list[tuple[float, VerdictRow]]:
    """The same for the tension of a lever that holds the speed."""
    pull = result.report().pull
    if pull is None:
        return []
    most, value, time = pull
    share = 1 - value / most
    # at its maximum it follows no more: the speed is lost
    state = _state(value >= most * (1 - 1e-9), share < SMALL_MARGIN)
    margin = f"{number(most - value, 'N', count=4)} ({100 * share:.3g} %)"
    shown = f"{number(value, 'N')} (at {number(time, 's')})"
    of = result.scene.brake.force_words
    words = "Slack tension that holds the speed" + (f" ({of})" if of else "")
    return [(share, VerdictRow(words, shown, f"< {number(most, 'N')}", margin, state))]
