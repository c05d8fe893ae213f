"""The installation and the duty of a scene for reading: every number with its meaning, profiles and loads in words."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._handy import Number, digits, number, numbers, scale
from .._base._quantity import Quantity, about_of, unit_below
from .._parts._driller import Driller, SpeedHold
from .._parts._duty import AbstractProfile, Constant, ExponentialRise, FunctionProfile, PiecewiseLinear, Repeated
from .._parts._lever import Lever
from .._parts._loads import AbstractLoad, HookLoad, TorqueLoad, TrippingLoad
from .._parts._scene import Scene

#: where the docstring of a part speaks to programmers
_WORDS = {"Scene": "One run of a brake.", "Lining": "The linings, counted from the slack to the tight end."}


#: what the lever gives, by the field of the duty
_LEVER = {"slack_tension": "Lever, slack tension", "force": "Actuator, force on each pad or shoe"}


class Row(NamedTuple):
    """One field of a part: its path in the scene, what it means, and its value."""

    path: str
    meaning: str
    value: Number


class Part(NamedTuple):
    """One part of a scene: its path, its kind, what that is in words, and its own fields."""

    path: str
    kind: str
    words: str
    rows: tuple[Row, ...]


def parts_of(node: Any, path: str = "", unit: str = "SI") -> list[Part]:
    """A part of a scene and all parts below it, in the order of the fields; `unit`: what `SI` means here."""
    if isinstance(node, tuple | list):
        return [part for i, child in enumerate(node) for part in parts_of(child, f"{path}[{i}]", unit)]
    if not _is_part(node):
        return []
    rows: list[Row] = []
    below: list[Part] = []
    for field in dataclasses.fields(node):
        value, here = getattr(node, field.name), f"{path}.{field.name}" if path else field.name
        if _is_part(value) or (isinstance(value, tuple | list) and any(_is_part(one) for one in value)):
            below += parts_of(value, here, unit_below(field, unit))
        elif (about := about_of(field, unit)) is not None:
            rows.append(Row(here, about.meaning, _value(value, about)))
        elif value is not None and not (isinstance(value, tuple | list) and not value):
            known = field.metadata.get("whole")
            meaning = field.name.replace("_", " ") if known is None else known.meaning
            rows.append(Row(here, meaning, Number(_plain(value))))
    kind = type(node).__name__
    return [Part(path, kind, _WORDS.get(kind, _said_of(node)), tuple(rows)), *below]


def _said_of(node: Any) -> str:
    """The first line of a part's docstring."""
    return (type(node).__doc__ or "").strip().partition("\n")[0].replace("`", "")


def _is_part(node: Any) -> bool:
    return dataclasses.is_dataclass(node) and not isinstance(node, type)


def _value(value: Any, about: Quantity) -> Number:
    if value is None:
        return Number("not given")
    return numbers(value, about.unit, absolute=about.unit == "K" and not about.difference)


def _plain(value: Any) -> str:
    """What is neither number nor part: names, counts, functions."""
    if callable(value):
        return getattr(value, "__qualname__", type(value).__name__)
    if isinstance(value, tuple | list):
        return ", ".join(str(one) for one in value)
    return str(value)


def _points(times: Sequence[float], values: Sequence[float], unit: str) -> str:
    """`2 kN at 0 s, 24 kN at 0.35 s`, in one unit for all values."""
    factor, offset, name = scale(unit, float(np.max(np.abs(values), initial=0.0)), absolute=unit == "K")
    shown = [f"{digits(v * factor + offset, 5)} {name} at {digits(t, 5)} s" for t, v in zip(times, values, strict=True)]
    if len(shown) > 8:
        shown = [*shown[:4], f"… {len(shown) - 6} more …", *shown[-2:]]
    return ", ".join(shown)


@functools.singledispatch
def profile_words(profile: AbstractProfile, unit: str) -> str:
    """A given function of time in words; `unit` is that of its values."""
    return f"{type(profile).__name__}: {_said_of(profile)}"


@profile_words.register
def _(profile: Constant, unit: str) -> str:
    return f"{number(profile.level, unit, count=5)} at all times"


@profile_words.register
def _(profile: PiecewiseLinear, unit: str) -> str:
    points = _points(np.asarray(profile.times).tolist(), np.asarray(profile.values).tolist(), unit)
    return f"straight lines through {points}; constant before and after"


@profile_words.register
def _(profile: Repeated, unit: str) -> str:
    points = _points(np.asarray(profile.times).tolist(), np.asarray(profile.values).tolist(), unit)
    begin = "" if float(profile.begin) == 0.0 else f" from {number(profile.begin, 's')} on"
    return (
        f"{profile.count} cycles of {number(profile.period, 's')} each{begin}, in each straight lines through {points}"
    )


@profile_words.register
def _(profile: SpeedHold, unit: str) -> str:
    return f"just so much that the brake holds the speed, at most {number(profile.limit, unit, count=5)}"


@profile_words.register
def _(profile: Driller, unit: str) -> str:
    times, speeds = np.asarray(profile.speed.times).tolist(), np.asarray(profile.speed.values).tolist()
    pieces = zip(profile.following, times, times[1:], speeds, speeds[1:], strict=False)
    led = [
        f"{number(t, 's')}…{number(end, 's')}: {digits(a, 4)}…{digits(b, 4)} rad/s"
        for follows, t, end, a, b in pieces
        if follows
    ]
    cycles = f"{profile.speed.count} cycles of {number(profile.speed.period, 's')}; in each "
    led_words = f"the speed is led at {', '.join(led)} with at most {number(profile.limit, unit, count=5)}; otherwise "
    return cycles + (led_words if led else "") + profile_words(profile.tension, unit)


@profile_words.register
def _(profile: ExponentialRise, unit: str) -> str:
    return (
        f"rises from 0 at {number(profile.begin, 's')} towards {number(profile.level, unit, count=5)} "
        f"with the time constant {number(profile.time_constant, 's')}"
    )


@profile_words.register
def _(profile: FunctionProfile, unit: str) -> str:
    knots = np.asarray(profile.knots).size
    return f"a function of its own, {_plain(profile.function)}" + (f", with {knots} corners or jumps" if knots else "")


@profile_words.register
def _(profile: Lever, unit: str) -> str:
    force = profile_words(profile.force, "N")
    return f"a force on the lever, times {digits(float(profile.gain), 5)} (efficiency · arm/slack arm): {force}"


@functools.singledispatch
def load_words(load: AbstractLoad) -> str:
    """What drives the pulley, in words."""
    return f"{type(load).__name__}: {_said_of(load)}"


def _drag(drag: Any) -> str:
    return "" if float(drag) == 0.0 else f"; drag {number(drag, 'N*m*s', count=5)} against the motion"


def _tackle(load: Any) -> str:
    return f"{digits(float(load.line_count), 5)} lines, rope at {number(load.drum_radius, 'm', count=5)} from the shaft"


@load_words.register
def _(load: TorqueLoad) -> str:
    return f"a torque on the shaft, {profile_words(load.profile, 'N*m')}{_drag(load.drag)}"


@load_words.register
def _(load: HookLoad) -> str:
    torque = float(load.mass) * float(load.gravity) * float(load.drum_radius) / float(load.line_count)
    return (
        f"{number(load.mass, 'kg', count=5)} on the hook, {_tackle(load)}: "
        f"{number(torque, 'N*m', count=5)} on the shaft{_drag(load.drag)}"
    )


@load_words.register
def _(load: TrippingLoad) -> str:
    return (
        f"{load.count} stands of {number(load.stand, 'kg', count=5)} run in, one every {number(load.period, 's')}: "
        f"{number(load.empty, 'kg', count=5)} of hook and block, and from {number(load.taken, 's')} to "
        f"{number(load.set, 's')} of each cycle the string, at first {number(load.string, 'kg', count=5)}; "
        f"{_tackle(load)}{_drag(load.drag)}"
    )


def duty_words(scene: Scene) -> list[tuple[str, str]]:
    """Lever, load, start and end of a run: what, and in words."""
    start, wraps = scene.initial, "" if float(scene.initial.omega) else ", at rest"
    return [
        (_LEVER[scene.duty.lever_field], profile_words(scene.duty.lever, "N")),
        ("Load", load_words(scene.duty.load)),
        ("Start", f"{number(start.omega, 'rad/s')} at {digits(float(start.time))} s{wraps}"),
        ("End", f"at {digits(float(scene.end_time))} s"),
    ]
