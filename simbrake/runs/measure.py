"""Metrics of a run by name, energies, functions of a result; and limits on them."""

import dataclasses
import difflib
import enum
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from .._base._arguments import explained, faults_of_tracing
from .._base._faults import Fault, Faults, InputError, Issues, input_error
from .._base._numbers import ZERO, digits, number
from .._base._part import Part, quantity
from .._base._quantity import BAD, NumberReader, Quantity, Scalar
from .._base._table import JsonObject, plain
from ..hybrid.arrays import Array, NumberOrArray
from ..hybrid.extremes import first_largest
from ..hybrid.struct import struct_field
from ..outputs.judgement import Colour
from ..outputs.metrics import (
    HOLDING,
    HOT,
    METRICS,
    allowable_values,
    is_least,
    is_of_size,
    keeps,
    lever_of,
    margin_to,
    metric_names,
    metric_of,
    values_of_marks,
)
from ..parts.scene import AbstractLimits, Scene, require_scene
from .differentiable import greatest_values
from .findings import PRESSURE, body_of, hottest_first, in_words_of, title_of
from .linings import lining_peak
from .result import Result

#: name of a metric or of an energy (`energy.friction_heat`), or a function of a `Result`
#: to a number
MetricLike = str | Callable[[Result], Any]


def as_metrics(metrics: MetricLike | Sequence[MetricLike]) -> list[MetricLike]:
    """One metric, or several, as a list."""
    return [metrics] if isinstance(metrics, str) or callable(metrics) else list(metrics)


def name_of(metric: MetricLike) -> str:
    """Name of a metric in tables."""
    if isinstance(metric, str):
        return metric
    return getattr(metric, "__name__", type(metric).__name__)


def unit_of(metric: MetricLike) -> str:
    """SI unit of a metric; empty for a function, whose unit is unknown, and for an
    unknown name."""
    entry = metric_of(metric) if isinstance(metric, str) else None
    return "" if entry is None else entry.unit


def check_metrics(scene: Scene, metrics: Sequence[Any]) -> None:
    """Raises `InputError` with every name that a run of the scene does not have, or
    that two metrics have."""
    require_scene(scene)
    names = metric_names(scene)
    faults = Issues()
    counts: Counter[str] = Counter()
    for asked in metrics:
        if not isinstance(asked, str) and not callable(asked):
            hint = "a name, or a function of the result to a number"
            faults.add(repr(asked), "is not a metric", hint)
            continue
        counts[name_of(asked)] += 1
        if isinstance(asked, str) and asked not in names:
            near = difflib.get_close_matches(asked, names, n=3, cutoff=0.4)
            hint = f"there are: {', '.join(names)}, or a function of the result"
            hint = f"nearest: {', '.join(near)}" if near else hint
            faults.add(asked, "is not a metric of this scene", hint)
    hint = "functions are distinguished by their names"
    for name, count in counts.items():
        if count > 1:
            faults.add(name, "is asked for twice", hint)
    faults.report()


def measure(result: Result, metric: MetricLike, *, arrays: bool = False) -> Array:
    """One number of a result, concrete or traced; `inf` for times of what did not
    happen.

    - `arrays`: whether a user's function may give an array

    Raises `InputError` with the name of a user's function that fails, or gives no
    number.
    """
    if not isinstance(metric, str):
        name = name_of(metric)
        hint = "give a function of the result to one number"
        try:
            value = jnp.asarray(metric(result), jnp.float64)
        except Exception as error:
            what = f"raises {type(error).__name__}: {error}"
            raise InputError(
                faults_of_tracing(error) or [Fault(name, what, hint)]
            ) from error
        if value.ndim and not arrays:
            raise input_error(name, "is an array", hint)
        return value
    # the heat of a pair, or the work of a torque on the shaft
    if metric not in METRICS and metric.startswith("energy."):
        return jnp.asarray(result.energy[metric.removeprefix("energy.")])
    value = getattr(result, metric)
    return jnp.asarray(getattr(value, "value", value))


def measure_all(
    result: Result, metrics: Sequence[MetricLike], *, arrays: bool = False
) -> list[Array]:
    """Several numbers of a result (see `measure`); maxima of a traced one from one pass
    over it."""
    names = [
        metric for metric in metrics if isinstance(metric, str) and metric in METRICS
    ]
    greatest = () if result.concrete else names
    greatest = tuple(name for name in greatest if METRICS[name].greatest)
    maxima = greatest_values(result, greatest)
    return [
        jnp.asarray(maxima[metric].value)
        if isinstance(metric, str) and metric in maxima
        else measure(result, metric, arrays=arrays)
        for metric in metrics
    ]


def named(result: Result, name: str) -> Any:
    """A metric or an energy of a result by its name, a float where the result is
    concrete. Raises `KeyError` with near names."""
    try:
        check_metrics(result.scene, [name] if isinstance(name, str) else [repr(name)])
    except InputError as error:
        fault = error.faults[0]
        raise KeyError(f"{name!r} {fault.problem}; {fault.hint}") from None
    value = measure(result, name)
    return float(value) if result.concrete else value


def happened(value: NumberOrArray) -> Bool[np.ndarray, "*shape"] | np.bool_:
    """Whether a metric has a value: times of what did not happen are infinite."""
    return np.isfinite(np.asarray(value))


# --- limits -------------------------------------------------------------------------


def _limits_part(
    name: str, base: type, about: str, fields: Mapping[str, Any], **others: Any
) -> Any:
    """A class of parts of a scene with a number for each metric in `fields`, and
    `others`: for each name the type and the field."""
    types = {
        name: (Scalar | None, _limit(x.unit, x.meaning)) for name, x in fields.items()
    }
    types |= others
    body = {
        "__module__": __name__,
        "__doc__": about,
        "__annotations__": {field: kind for field, (kind, _) in types.items()},
        "faults_with": _faults_of_limits,
        **{field: value for field, (_, value) in types.items()},
    }
    metaclass: Any = type(base)  # (makes a dataclass of the fields)
    return metaclass(name, (base,), body)


def _limit(unit: str, meaning: str) -> Any:
    return quantity(unit, f"limit: {meaning}", default=None)


def _faults_of_limits(self: Any, path: str, scene: Scene) -> Faults:
    faults = Issues()
    for name in self.given:
        lacks = METRICS[name].needs.lacks(scene) if name in METRICS else ""
        if name == PRESSURE and not _has_area(scene):
            lacks = "it has no areas of its linings"
        if lacks:
            problem = f"no run of this scene has it: {lacks}"
            faults.add(f"{path}.{name}", problem, "leave it out")
    return faults


#: metrics that a scene can limit: all except the holding reserve, which is to be large
_LIMITED = {name: metric for name, metric in METRICS.items() if name != HOLDING}
EnergyLimits = _limits_part(
    "EnergyLimits",
    Part,
    "Permissible values of energies over a run: a field for each.",
    {
        name.removeprefix("energy."): metric
        for name, metric in _LIMITED.items()
        if metric.energy
    },
)
Limits = _limits_part(
    "Limits",
    AbstractLimits,
    """Permissible values of what a run has as one number, for its verdict; a run does not depend on them.

    A field for each metric, its maximum permissible value (`max_pressure`: maximum mean pressure on a lining), and
    `energy` with those of energies by name. They come before those of the scene's parts, as `Heat.permissible_rim`.
    Where a metric has a mark the log has an event for it: `overspeed` of `max_drum_speed`, `permissible_temperature` of
    `peak_lining_temperature`. Raises `InputError` for what a scene does not have.

    Example:
        >>> limits = sb.Limits(max_drum_speed="260 rpm", max_tension="90 kN", energy={"friction_heat": "2 MJ"})
        >>> limits.max_tension, limits.energy.friction_heat
        (array(90000.), array(2000000.))
    """,
    {name: metric for name, metric in _LIMITED.items() if not metric.energy},
    max_pressure=(Scalar | None, _limit("Pa", "maximum mean pressure on a lining")),
    energy=(
        EnergyLimits | None,
        struct_field(
            converter=lambda value: (
                EnergyLimits(**value) if isinstance(value, Mapping) else value
            ),
            default=None,
        ),
    ),
)


def with_limits(scene: Scene, limits: Mapping[str, float]) -> Scene:
    """The scene with these limits (SI) among its own, except limits of energies that
    only some scenes have (`heat_internal`)."""
    applicable = {
        name: most
        for name, most in limits.items()
        if name in _LIMITED or name == PRESSURE
    }
    if not applicable:
        return scene
    whole = ({} if scene.limits is None else scene.limits.given) | applicable
    energy = {
        name.removeprefix("energy."): whole.pop(name)
        for name in [*whole]
        if name.startswith("energy.")
    }
    return dataclasses.replace(scene, limits=Limits(**whole, energy=energy or None))


def _has_area(scene: Scene) -> bool:
    return scene.brake.linings.area is not None


#: listed without a limit too, where the scene has them
_USUAL = ("max_tension", "max_normal_load")
_LININGS = "peak_lining_temperature"
#: 20 °C (K), from which the rise of a temperature is counted
ROOM = ZERO + 20.0
#: a margin below this share of the limit is small
SMALL_MARGIN = 0.10


class LimitVerdict(enum.StrEnum):
    """Verdict on one limit."""

    WITHIN = "within limit"
    WITHIN_SO_FAR = "within limit so far"  # (the run failed later)
    SMALL = "small margin"
    EXCEEDED = "exceeded"
    NO_LIMIT = "no limit"
    NOT_EVALUATED = "not evaluated"

    @property
    def colour(self) -> Colour | None:
        """Its colour, `None` if it has none."""
        return {
            LimitVerdict.NO_LIMIT: None,
            LimitVerdict.NOT_EVALUATED: None,
            LimitVerdict.EXCEEDED: Colour.RED,
            LimitVerdict.SMALL: Colour.AMBER,
        }.get(self, Colour.GREEN)


class VerdictRow(NamedTuple):
    """One limit in words: `name`, `value` in the run, `limit`, `margin` with its
    percentage, the `state`, and a `note`: when, or why not.

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
    note: str = ""

    @property
    def heading(self) -> str:
        """Name and note."""
        return f"{self.name}, {self.note}" if self.note else self.name

    @property
    def terms(self) -> str:
        """Value, limit and margin."""
        return f"{self.value}, allowed {self.limit}, margin {self.margin}"

    def __str__(self) -> str:
        verb = "has a" if self.state == LimitVerdict.SMALL else "is"
        note = f", {self.note}" if self.note else ""
        return f"{self.name} {verb} {self.state}{note}: {self.terms}"


class LimitCheck(NamedTuple):
    """One limit and the value in a run, in SI: `name` of the metric (or
    `max_pressure`), `note`: when, or why not.

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
        """`limit − value`, or `value − limit` where the limit is a least value, of a
        motion in either sense `limit − |value|`: below 0 where it is exceeded; `None`
        without a limit or a value."""
        if self.limit is None or self.value is None:
            return None
        return margin_to(self.limit, self.name, self.value)

    @property
    def margin_percent(self) -> float | None:
        """The margin in percent of the limit, of a temperature in percent of the
        permissible rise above 20 °C."""
        if self.margin is None or self.limit is None:
            return None
        whole = self.limit - ROOM if self.unit == "K" else self.limit
        return 100 * self.margin / whole if whole > 0 else None

    def row(self, scene: Scene | None = None) -> VerdictRow:
        """The same in words, those of the kind of brake where the scene is given."""
        state = self.verdict
        percent = self.margin_percent
        margin = "—"
        if self.margin is not None:
            margin = str(number(self.margin, self.unit, count=4, absolute=False))
        if percent is not None:
            margin += f" ({digits(percent, 3)} %)"
            if state == LimitVerdict.WITHIN and percent < 100 * SMALL_MARGIN:
                state = LimitVerdict.SMALL
        sign = "≥" if is_least(self.name) else "≤"
        limit = f"{sign} {number(self.limit, self.unit)}"
        title = title_of(self.name, scene)
        if self.value is None:
            return VerdictRow(title, self.note, limit, margin, state)
        if self.value < 0 and is_of_size(self.name):
            limit = limit.replace("≤", "±")
        value = str(number(self.value, self.unit))
        return VerdictRow(title, value, limit, margin, state, self.note)

    def as_dict(self) -> JsonObject:
        """`{name, verdict, value, limit, margin, margin_percent, unit, note}`, numbers
        in SI."""
        names = "name verdict value limit margin margin_percent unit note"
        return {name: plain(getattr(self, name)) for name in names.split()}

    def __str__(self) -> str:
        return str(self.row())


def read_limits(
    scene: Scene, limits: Mapping[str, int | float | str], path: str = "limits[{!r}]"
) -> tuple[dict[str, float], Faults]:
    """Limits in SI, given as numbers or as texts with a unit; and the faults of unknown
    metrics and of values that are no numbers.

    `path`: where a limit stands, for the faults, with `{!r}` for its name
    """
    reader = NumberReader()
    numbers = {}
    if PRESSURE in limits and not _has_area(scene):
        reader.fault(
            path.format(PRESSURE),
            "needs the areas of the linings",
            "give brake.linings.area",
        )
    names = (*metric_names(scene), PRESSURE)
    try:
        check_metrics(scene, [name for name in limits if name != PRESSURE])
    except InputError as error:
        reader.faults += error.faults
    for name, value in limits.items():
        if name not in names:
            continue
        unit = "Pa" if name == PRESSURE else unit_of(name)
        if isinstance(value, np.generic | np.ndarray) and np.ndim(value) == 0:
            value = value.item()  # (the reader takes numbers of Python only)
        limit = reader.number(value, Quantity(unit, "limit"), path.format(name), unit)
        if limit is not BAD:
            numbers[name] = limit
    return numbers, reader.faults


@explained
def limit_checks(result: Result, limits: Mapping[str, float]) -> list[LimitCheck]:
    """All limits of a concrete result with their verdicts: temperatures, the hottest
    place first, then the others.

    `limits`: metric (or `max_pressure`) → permissible value in SI, as `read_limits`
    gives them: the greatest value, or the least where the metric begins with `min_`.
    The allowable values of the scene's parts (`Heat`, `Lining`, `Strength`, `Lever`,
    `Wear`) are evaluated as well. Temperatures, tension and load on a lining are listed
    also without a limit, and have no verdict then. A value equal to its limit is within
    it. What did not happen (a stop that never came) exceeds its limit in a run that
    reached its end time; in a run that failed it is not evaluated.

    Example:
        >>> checks = sb.results.limit_checks(result, {"stopping_time": 1.0})
        >>> checks[-1].limit, str(checks[-1].verdict)
        (1.0, 'exceeded')
    """
    summary = result.report().summary
    scene = result.scene
    marked = values_of_marks(scene)
    limits = allowable_values(scene) | {**limits}

    def check(name: str) -> LimitCheck:
        value = summary["metrics"].get(name)
        if name not in limits:
            return LimitCheck(name, None, value, unit_of(name), LimitVerdict.NO_LIMIT)
        value = float(measure(result, name)) if value is None else value
        note = _when(summary, name, limits[name], marked.get(name))
        return _judged(result, name, limits[name], value, unit_of(name), note)

    hot = hottest_first(summary["metrics"])
    checks = [check(name) for name in hot]
    if _LININGS not in hot:
        note = "the scene has no thermal part"
        if scene.heated:
            note = "the thermal part names no place as that of the linings"
        limit = limits.get(_LININGS)
        verdict = LimitVerdict.NOT_EVALUATED
        checks.append(LimitCheck(_LININGS, limit, None, "K", verdict, note))
    available = metric_names(scene)
    checks += [
        check(name) for name in _USUAL if name in available and name not in limits
    ]
    pressure = limits.get(PRESSURE, scene.brake.linings.permissible_pressure)
    if pressure is not None:
        peaks = np.asarray(lining_peak(result, "pressure"))
        checks.append(_nearest(result, PRESSURE, peaks, pressure, "Pa"))
    checks += [check(name) for name in limits if name not in HOT and name != PRESSURE]
    wear = scene.wear
    if wear is not None and wear.permissible is not None:
        worn = np.asarray(wear.worn) + np.asarray(result.worn_thickness)
        more = ", with what was worn off before the run"
        checks.append(
            _nearest(result, "worn_thickness", worn, wear.permissible, "m", more)
        )
    return checks


def _nearest(
    result: Result, name: str, value: np.ndarray, limit: Any, unit: str, more: str = ""
) -> LimitCheck:
    """The check of the lining that is nearest its limit."""
    most = np.broadcast_to(np.asarray(limit), value.shape)
    i = int(first_largest(value / most))
    note = f"{result.scene.brake.words.lining} {i + 1}{more}"
    return _judged(result, name, float(most[i]), float(value[i]), unit, note)


def _judged(
    result: Result, name: str, bound: float, value: float, unit: str, note: str
) -> LimitCheck:
    if not np.isfinite(value):
        verdict = LimitVerdict.NOT_EVALUATED
        note = "the run failed before it happened"
        if name == HOLDING and result.report().held_nothing:
            note = "no load hung while the brake was to hold"
        elif result.ok:
            verdict = LimitVerdict.EXCEEDED
            note = "did not happen in this run"
        return LimitCheck(name, bound, None, unit, verdict, note)
    verdict = LimitVerdict.WITHIN if result.ok else LimitVerdict.WITHIN_SO_FAR
    if not keeps(bound, name, value):
        verdict = LimitVerdict.EXCEEDED
    return LimitCheck(name, bound, value, unit, verdict, note)


def _when(summary: JsonObject, name: str, bound: float, marked: float | None) -> str:
    """When a maximum value was reached; where it has passed its limit, and that is an
    event (at the value `marked`), when it passed first."""
    time = summary["at"].get(f"{name}_time")
    value = summary["metrics"].get(name)
    if time is None:
        return ""
    mark = METRICS[name].mark
    note = f"{'minimum' if is_least(name) else 'maximum'} at {number(time, 's')}"
    if mark is None or value is None or value <= bound or bound != marked:
        return note
    times = [
        event["time"] for event in summary["events"] if event["name"] == mark.event
    ]
    often = "" if len(times) < 2 else f", {len(times)} times in all"
    return f"first at {number(min(times), 's')}{often}" if times else "from the start"


# --- what the limits cover ----------------------------------------------------------


class LimitCoverage(NamedTuple):
    """What the limits of a run cover.

    - `given` of `of` limits: one for each part that was under load in the run
    - `missing`: parts without a limit, in words, each with the metrics that can have a
      limit in `limits` (one suffices)
    - `not_modelled`: parts of the brake that the scene does not model

    Example:
        >>> judged = result.verdict({"max_tension": "120 kN"}).judged
        >>> judged.given, judged.of, list(judged.missing)
        (1, 2, ['load on a lining'])
    """

    given: int
    of: int
    missing: dict[str, tuple[str, ...]]
    not_modelled: tuple[str, ...]

    def __str__(self) -> str:
        """In words, empty where nothing was under load."""
        if not self.of:
            return ""
        text = f"{self.given} of {self.of} material limits given"
        if self.missing:
            text += f", none for {', '.join(self.missing)}"
        if self.not_modelled:
            text += f"; not modelled: {', '.join(self.not_modelled)}"
        return text


#: part of a brake → metrics that can limit it; where the first one is above 0 the part
#: is under load
_PARTS = {
    "band tension": ("max_tension", "max_band_stress"),
    "anchor stress": ("max_anchor_stress",),
    "load on a lining": ("max_normal_load", PRESSURE),
    "lever force": ("max_lever_force",),
    "actuator pressure": ("max_actuator_pressure",),
    "wear": ("greatest_wear", "worn_thickness"),
}


def coverage_of(result: Result, checks: Sequence[LimitCheck]) -> LimitCoverage:
    """What the limits among `checks` cover of the parts of a brake that were under
    load."""
    summary = result.report().summary
    scene = result.scene
    metrics = summary["metrics"]
    words = scene.brake.words
    limited = {check.name for check in checks if check.limit is not None}
    parts = {
        in_words_of(scene, name.replace("lining", words.lining)): names
        for name, names in _PARTS.items()
        if metrics.get(names[0])
    }
    if scene.duty.lever.controls_speed:  # (such a lever has its own greatest force)
        parts.pop(in_words_of(scene, "lever force"), None)
    rubs = bool(summary["energy"]["friction_heat"])
    hot = hottest_first(metrics) if rubs else []
    for name in hot:
        parts[f"{body_of(HOT[name], scene)} temperature"] = (name,)
    available = [*metric_names(scene), *([PRESSURE] if _has_area(scene) else [])]
    missing = {
        part: tuple(name for name in names if name in available)
        for part, names in parts.items()
        if limited.isdisjoint(names)
    }
    not_modelled = ["temperatures"] if rubs and not hot else []
    has_force = (
        lever_of(scene) is not None
        or "max_actuator_pressure" in metrics
        or scene.duty.lever.controls_speed
    )
    if scene.brake.banded and not has_force and metrics.get("max_tension"):
        not_modelled.append("lever force")
    given = len(parts) - len(missing)
    return LimitCoverage(given, len(parts), missing, tuple(not_modelled))
