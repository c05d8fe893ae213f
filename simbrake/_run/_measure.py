"""Metrics of a run by name, energies, functions of a result; and limits on them."""

import difflib
import enum
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from .._base._faults import Fault, InputError
from .._base._quantity import BAD, NumberReader, Quantity
from .._base._table import ZERO, digits, number, plain
from .._parts._scene import Scene, require_scene
from ..hybrid._arrays import Array
from ._linings import lining_peak
from ._metrics import METRICS, about_output, metric_names
from ._probe import Entry, Number
from ._report import text as text_of
from ._result import Result
from ._strength import allowable_values

#: a metric's name, the name of an energy (`energy.friction_heat`), or a function of a `Result` to a number
Metric = str | Callable[[Result], Any]


def name_of(metric: Metric) -> str:
    """Name of a metric in tables."""
    return metric if isinstance(metric, str) else getattr(metric, "__name__", type(metric).__name__)


def unit_of(metric: Metric) -> str:
    """SI unit of a metric; empty for a function, whose unit is unknown, and for an unknown name."""
    if isinstance(metric, str) and (metric in METRICS or metric.startswith("energy.")):
        return about_output(metric)["units"]
    return ""


def title_of(metric: str) -> str:
    """A metric, an energy or `max_pressure` in words, as a title."""
    if metric.startswith("energy."):
        return f"Energy: {metric.removeprefix('energy.').replace('_', ' ')}"
    if metric == PRESSURE:
        return "Maximum mean pressure on a lining"
    base = metric.removesuffix("_time")
    if metric not in METRICS and base in METRICS:
        return f"{METRICS[base].title}, when"
    return METRICS[metric].title if metric in METRICS else metric.replace("_", " ").capitalize()


def check_metrics(scene: Scene, metrics: Sequence[Any]) -> None:
    """Raises `InputError` with every name that a run of the scene does not have."""
    require_scene(scene)
    names, faults = metric_names(scene), []
    for one in metrics:
        if isinstance(one, str) and one not in names:
            near = difflib.get_close_matches(one, names, n=3, cutoff=0.4)
            hint = (
                f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(names)}, or a function of the result"
            )
            faults.append(Fault(one, "is not a metric of this scene", hint))
        elif not isinstance(one, str) and not callable(one):
            faults.append(Fault(repr(one), "is not a metric", "a name, or a function of the result to a number"))
    if faults:
        raise InputError(faults)


def measure(result: Result, metric: Metric) -> Array:
    """One number of a result, concrete or traced; `inf` for times of what did not happen."""
    if not isinstance(metric, str):
        return jnp.asarray(metric(result), jnp.float64)
    if metric.startswith("energy."):
        return jnp.asarray(result.energy[metric.removeprefix("energy.")])
    found = getattr(result, metric)
    return jnp.asarray(getattr(found, "value", found))


def named(result: Result, name: str) -> Any:
    """A metric or an energy of a result by its name, a float of a concrete one. Raises `KeyError` with near names."""
    try:
        check_metrics(result.scene, [name] if isinstance(name, str) else [repr(name)])
    except InputError as error:
        fault = error.faults[0]
        raise KeyError(f"{name!r} {fault.problem}; {fault.hint}") from None
    found = measure(result, name)
    return float(found) if result.concrete else found


def happened(value: Number) -> Bool[np.ndarray, "*shape"] | np.bool_:
    """Whether a metric has a value: times of what did not happen are infinite."""
    return np.isfinite(np.asarray(value))


# --- limits -----------------------------------------------------------------------------------------------------------

#: a limit on what is not a metric: it needs the areas of the linings
PRESSURE = "max_pressure"
_HOT = "peak_lining_temperature"
#: shown without a limit too, where the scene has them
_USUAL = ("peak_rim_temperature", "max_tension", "max_normal_load")
#: kelvins of 20 °C, from which the rise of a temperature is counted
_ROOM = ZERO + 20.0


class Colour(enum.StrEnum):
    """Colour of a verdict.

    Example:
        >>> result.verdict().colour == sb.results.Colour.GREEN
        True
    """

    RED = "red"
    AMBER = "amber"
    GREEN = "green"


class LimitVerdict(enum.StrEnum):
    """Verdict on one limit."""

    WITHIN = "within limit"
    WITHIN_SO_FAR = "within limit so far"  # the run failed: how it would have gone on is not known
    SMALL = "small margin"
    EXCEEDED = "exceeded"
    NO_LIMIT = "no limit"
    NOT_EVALUATED = "not evaluated"

    @property
    def colour(self) -> Colour | None:
        """Its colour, `None` if it has none."""
        if self in (LimitVerdict.NO_LIMIT, LimitVerdict.NOT_EVALUATED):
            return None
        return {LimitVerdict.EXCEEDED: Colour.RED, LimitVerdict.SMALL: Colour.AMBER}.get(self, Colour.GREEN)


class LimitCheck(NamedTuple):
    """One limit and the value in a run, in SI: `name` of the metric (or `max_pressure`), `note`: when, or why not.

    Example:
        >>> check = sb.results.limit_checks(result, {"stopping_time": 9.0})[-1]
        >>> check.name, check.unit, str(check.verdict)
        ('stopping_time', 's', 'within limit')
    """

    name: str
    limit: float | None
    value: float | None
    unit: str
    verdict: LimitVerdict
    note: str = ""

    @property
    def margin(self) -> float | None:
        """`limit − value`, below 0 where the limit is exceeded; `None` without one of the two."""
        return None if self.limit is None or self.value is None else self.limit - self.value

    @property
    def margin_percent(self) -> float | None:
        """The margin in percent of the limit; of a temperature in percent of its rise above 20 °C."""
        if self.margin is None or self.limit is None:
            return None
        whole = self.limit - _ROOM if self.unit == "K" else self.limit
        return 100 * self.margin / whole if whole > 0 else None

    @property
    def margin_words(self) -> str:
        """The margin with its unit and in percent, empty without one."""
        if self.margin is None:
            return ""
        percent = "" if self.margin_percent is None else f" ({digits(self.margin_percent, 3)} %)"
        return f"{number(self.margin, self.unit, count=4, absolute=False)}{percent}"

    def as_dict(self) -> Entry:
        """`{name, verdict, value, limit, margin, margin_percent, unit, note}`, numbers in SI."""
        names = ("name", "verdict", "value", "limit", "margin", "margin_percent", "unit", "note")
        return {name: plain(getattr(self, name)) for name in names}

    def __str__(self) -> str:
        """Verdict with value, limit and margin, as a line of a summary."""
        margin = f", margin {self.margin_words}" if self.margin_words else ""
        note = f" ({self.note})" if self.note else ""
        value, limit = number(self.value, self.unit), number(self.limit, self.unit)
        return f"{self.name} {self.verdict}: {value}, limit {limit}{margin}{note}"


def read_limits(
    scene: Scene, limits: Mapping[str, int | float | str], path: str = "limits[{!r}]"
) -> tuple[dict[str, float], list[Fault]]:
    """Limits in SI, given as numbers or as texts with a unit; and the faults: unknown metrics, what is not a number.

    `path`: where a limit stands, for the faults, with a place for its name
    """
    reader, read = NumberReader(), {}
    if PRESSURE in limits and scene.brake.linings.area is None:
        reader.fault(path.format(PRESSURE), "needs the areas of the linings", "give brake.linings.area")
    known = (*metric_names(scene), PRESSURE)
    try:
        check_metrics(scene, [name for name in limits if name != PRESSURE])
    except InputError as error:
        reader.faults += error.faults
    for name, value in ((name, value) for name, value in limits.items() if name in known):
        unit = "Pa" if name == PRESSURE else unit_of(name)
        found = reader.number(_plain(value), Quantity(unit, "limit"), path.format(name), unit)
        read |= {} if found is BAD else {name: found}
    return read, reader.faults


def parse_limits(scene: Scene, texts: Sequence[str]) -> tuple[dict[str, float], list[Fault]]:
    """Limits in SI from texts `METRIC=VALUE` with or without a unit, as `--limit` has them; and the faults."""
    faults: list[Fault] = []
    given: dict[str, str] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if not name or not value:
            faults.append(Fault(f"--limit {text}", "is not of the form METRIC=VALUE", 'as in "max_tension=120 kN"'))
        elif name in given:
            faults.append(Fault(f"--limit {name}", "is given twice", "one limit each"))
        given |= {name: value} if name and value else {}
    limits, wrong = read_limits(scene, given, "--limit {}")
    return limits, faults + wrong


def has_limit(scene: Scene, limits: Mapping[str, float]) -> bool:
    """Whether there is anything that a run could exceed: a limit given, or one of the scene."""
    worn = scene.wear is not None and scene.wear.permissible is not None
    return bool(limits) or scene.network.permissible is not None or worn or bool(allowable_values(scene))


def _plain(value: Any) -> Any:
    """A number of NumPy as one of Python, which a reader knows."""
    return value.item() if isinstance(value, np.generic) else value


def limit_checks(result: Result, limits: Mapping[str, float]) -> list[LimitCheck]:
    """All limits of a concrete result with their verdicts: the linings' temperature, the usual metrics, then `limits`.

    `limits`: metric (or `max_pressure`) → maximum permissible value in SI, as `read_limits` gives them; beside them
    the allowable values of the scene's own parts (`Strength`, `Lever`, `Wear`) are evaluated. A value equal
    to its limit is within it. What did not happen (a stop that never came) exceeds its limit in a run that reached its
    end time; in a run that failed it is not evaluated.

    Example:
        >>> checks = sb.results.limit_checks(result, {"stopping_time": 1.0})
        >>> checks[-1].limit, str(checks[-1].verdict)
        (1.0, 'exceeded')
    """
    summary, known = result.report().summary, metric_names(result.scene)
    limits = {**allowable_values(result.scene), **limits}
    checks = [_linings(result, summary, limits)]
    for name in _USUAL:
        if name in known and name not in limits:
            checks.append(LimitCheck(name, None, summary["metrics"][name], unit_of(name), LimitVerdict.NO_LIMIT))
    for name, bound in limits.items():
        if name == _HOT:
            continue
        if name == PRESSURE:
            value, unit, time = float(np.max(np.asarray(lining_peak(result, "pressure")))), "Pa", None
        else:
            value, unit, time = float(measure(result, name)), unit_of(name), summary["at"].get(f"{name}_time")
        note = "" if time is None else f"maximum at {number(time, 's')}"
        checks.append(_judged(result, name, bound, value, unit, note))
    return checks + _worn(result)


def _worn(result: Result) -> list[LimitCheck]:
    """The wear of the lining that is nearest its permissible wear, with what was worn off before the run."""
    wear = result.scene.wear
    if wear is None or wear.permissible is None:
        return []
    worn = np.asarray(wear.worn) + np.asarray(result.worn_thickness)
    most = np.broadcast_to(np.asarray(wear.permissible), worn.shape)
    i = int(np.argmax(worn / most))
    words = result.scene.brake.words
    note = f"{words.lining} {i + 1}, with what was worn off before the run"
    return [_judged(result, "worn_thickness", float(most[i]), float(worn[i]), "m", note)]


def _judged(result: Result, name: str, bound: float, value: float, unit: str, note: str) -> LimitCheck:
    if not np.isfinite(value):
        verdict = LimitVerdict.EXCEEDED if result.ok else LimitVerdict.NOT_EVALUATED
        note = "did not happen in this run" if result.ok else "the run failed before it happened"
        return LimitCheck(name, bound, None, unit, verdict, note)
    within = LimitVerdict.WITHIN if result.ok else LimitVerdict.WITHIN_SO_FAR
    return LimitCheck(name, bound, value, unit, within if value <= bound else LimitVerdict.EXCEEDED, note)


def _linings(result: Result, summary: Entry, limits: Mapping[str, float]) -> LimitCheck:
    """The temperature of the linings, which a scene itself may limit."""
    own, value = result.scene.network.permissible, summary["metrics"].get(_HOT)
    own = None if own is None else float(np.asarray(own))
    bound = float(limits[_HOT]) if _HOT in limits else own
    if value is None:
        note = "the scene has no thermal part"
        if result.scene.heated:
            note = "the thermal part names no place as that of the linings"
        return LimitCheck(_HOT, bound, None, "K", LimitVerdict.NOT_EVALUATED, note)
    if bound is None:
        return LimitCheck(_HOT, None, value, "K", LimitVerdict.NO_LIMIT)
    hottest = f"maximum at {number(summary['at'][f'{_HOT}_time'], 's')}"
    if value > bound and bound == own:
        times = [event["time"] for event in summary["events"] if event["name"] == "permissible_temperature"]
        often = "" if len(times) < 2 else f", {len(times)} times in all"
        first = f"first exceeded at {number(min(times), 's')}{often}" if times else "above it from the start"
        hottest = f"{first}; {hottest}"
    return _judged(result, _HOT, bound, value, "K", hottest)


def limit_lines(checks: Sequence[LimitCheck]) -> list[str]:
    """Lines of a summary on the limits, one each."""
    return [f"limit    {check}" for check in checks if check.limit is not None]


def limit_dicts(checks: Sequence[LimitCheck]) -> list[Entry]:
    """The same as numbers and words."""
    return [check.as_dict() for check in checks if check.limit is not None]


def text_with_limits(result: Result, checks: Sequence[LimitCheck]) -> str:
    """The summary of a result with the verdict and the limits."""
    return text_of(result.report().summary, [f"verdict  {result.verdict(checks)}", *limit_lines(checks)])


def summary_with_limits(result: Result, checks: Sequence[LimitCheck]) -> Entry:
    """The same as `run --json` prints it: `Result.summary`, `limits` and `verdict`."""
    return {**result.summary(), "limits": limit_dicts(checks), "verdict": result.verdict(checks).as_dict()}
