"""Profiles, the given functions of time: constant, piecewise linear, repeated cycles, custom functions."""

import abc
import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from ._base._compiling import per_structure
from ._base._faults import Fault, Faults
from ._base._part import Part, parts_below, quantity, short_for, takes_values, whole
from ._base._quantity import Over, Quantity, Scalar
from .hybrid.arrays import Array, Floats, Mark, ScalarArray, Vector, numpy_of
from .hybrid.struct import AbstractVar, struct_field

__all__ = ["AbstractProfile", "Constant", "ExponentialRise", "FunctionProfile", "PiecewiseLinear", "Repeated", "ramp"]

#: knots of different profiles closer than this share of their time coincide
_ROUNDING = 8 * float(np.finfo(np.float64).eps)


class _Time:
    """Symbolic time in a calculation: its operations keep straight lines straight, all others raise."""

    __array_ufunc__ = None  # NumPy defers arithmetic to these methods

    def __add__(self, other: object) -> "_Time":
        return self

    def __mul__(self, other: object) -> "_Time":
        if isinstance(other, _Time):
            raise TypeError("a product of two straight lines is not a straight line")
        return self

    def __neg__(self) -> "_Time":
        return self

    def __bool__(self) -> bool:
        raise TypeError("a comparison with the time makes corners and jumps")

    __radd__ = __sub__ = __rsub__ = __add__
    __rmul__ = __truediv__ = __mul__
    __eq__ = __ne__ = __hash__ = None  # pyright: ignore


if TYPE_CHECKING:
    Real: TypeAlias = Array | float
else:
    #: a time, or a value at it; or their symbols while a profile is examined (`hides_nothing`)
    Real = Floats | float | int | _Time
#: how many time breakpoints have passed
Piece: TypeAlias = Int[Array, "..."] | int
Name = TypeVar("Name")


#: samples among which the greatest value of a function without known points is looked for
_SAMPLES = 257


class AbstractProfile(Part):
    """A given function of time. Corners and jumps are time breakpoints: between two of them it is smooth.

    `piece` counts the time breakpoints passed; `value(t, piece)` extends its piece smoothly beyond both ends. A
    straight line between two time breakpoints, or an `ExponentialRise`, has no short features; with any other profile a
    run takes shorter steps and evaluates its guards inside them as well.
    """

    @abc.abstractmethod
    def value(self, t: Real, piece: Piece) -> Real:
        """Value at `t` on the given piece."""

    def next_knot(self, piece: Piece) -> Floats | float:
        """The time breakpoint that ends the piece, `inf` after the last (also where there is none, as by default)."""
        return jnp.inf

    def first_piece(self, t: Real) -> Piece:
        """The piece that begins at or before `t`."""
        return 0

    @property
    def knot_count(self) -> int:
        """Number of time breakpoints, where it may be large; 0 otherwise."""
        return 0

    @property
    def rises(self) -> bool:
        """Whether on every piece it is a straight line, a parabola or one exponential of time, whatever its program."""
        return False

    @property
    def controls_speed(self) -> bool:
        """Whether its value depends on the speed (of a lever)."""
        return False

    @property
    def corrects_position(self) -> bool:
        """Whether its value depends on the angle that the pulley has turned (of a lever)."""
        return False

    def no_more_turns(self, t: Real) -> Mark:
        """Whether no time breakpoint after `t` changes the course of the profile."""
        return jnp.isinf(self.next_knot(jnp.asarray(self.first_piece(t), jnp.int32)))

    def greatest_from(self, begin: Array, end: Array) -> Array:
        """Greatest value from the time `begin` (s) on, whenever that is; of a function that is known by its values
        alone that of samples up to `end` (s)."""
        times = jnp.linspace(begin, jnp.maximum(begin, end), _SAMPLES)
        return jnp.max(jax.vmap(lambda t: jnp.asarray(self.value(t, self.first_piece(t)), jnp.float64))(times))

    @abc.abstractmethod
    def scale(self) -> ScalarArray:
        """Largest magnitude, at least roughly: the reference of dimensionless guards."""


def faults_of_sign(course: Part, path: str, unit: str, hint: str = "a band cannot push") -> Faults:
    """Errors of negative values in a profile, and in those that it is made of: of numbers in its own `unit`."""
    faults = []
    for where, profile, own_unit in parts_below(course, path, unit):
        for field in dataclasses.fields(profile) if isinstance(profile, AbstractProfile) and own_unit == unit else ():
            about, values = field.metadata.get("quantity"), getattr(profile, field.name)
            if about is not None and about.unit == "SI" and np.any(np.asarray(values) < 0):
                faults.append(Fault(f"{where}.{field.name}", f"{np.min(values):g} is below 0", hint))
    return faults


def first_piece(profile: Any, t: Real) -> Piece | None:
    """The piece of a profile at the start of a run; `None` if it has no time breakpoints (not part of the mode)."""
    return None if isinstance(profile.next_knot(jnp.asarray(0, jnp.int32)), float) else profile.first_piece(t)


def next_known_time(
    profiles: Mapping[Name, Any], pieces: Any, waits: Callable[[Array], Array] | None = None
) -> tuple[ScalarArray | float, dict[Name, Any]]:
    """The next time breakpoint of several profiles (`inf`: none), and for each profile whether it belongs to it.

    It belongs to one profile only, also where knots of several coincide (within rounding): they are passed one after
    the other, with steps of length 0 in between, and each keeps its own derivative. The order is that of `profiles`,
    but the first one comes last where `waits(time)`.
    """
    knots = {name: profile.next_knot(pieces[name]) for name, profile in profiles.items()}
    # a plain number is that of a profile without knots: it takes no part
    varying = {name: jnp.asarray(knot) for name, knot in knots.items() if not isinstance(knot, float)}
    turns: dict[Name, Any] = dict.fromkeys(profiles, False)
    if not varying:
        return jnp.inf, turns
    if len(varying) == 1:
        ((only, knot),) = varying.items()
        return knot, turns | {only: True}
    first = jax.lax.stop_gradient(functools.reduce(jnp.minimum, varying.values()))
    due = {i: jax.lax.stop_gradient(knot) <= first + _ROUNDING * jnp.abs(first) for i, knot in varying.items()}
    order = list(varying)
    assigned = jnp.asarray(False)
    if order[0] == next(iter(profiles)) and waits is not None:
        assigned = due[order[0]] & ~(waits(first) & functools.reduce(jnp.logical_or, [due[i] for i in order[1:]]))
        turns[order[0]] = assigned
        order = order[1:]
    for i in order:
        turns[i] = due[i] & ~assigned
        assigned = assigned | due[i]
    time = sum(jnp.where(turns[i], knot, 0.0) for i, knot in varying.items())
    # of knots that differ by rounding all are passed at the first
    late = jnp.where(time > first, time - first, 0.0)
    return time - jax.lax.stop_gradient(late), turns


def jump_times(times: Vector) -> Vector:
    """The times of a profile's points, where the second of two equal ones has the derivative of their mean.

    The values between the two points of a jump are those of a line, however steep: moving one of the points moves the
    mean by half.
    """
    before = jnp.concatenate([times[:1], times[:-1]])
    return jnp.where(times > before, times, 0.5 * (before + times))


def _next_of(times: Scalar, piece: Piece) -> Floats | float:
    """The time that ends the piece, `inf` after the last."""
    if not np.shape(times)[0]:
        return jnp.inf
    times = jnp.append(jump_times(jnp.asarray(times)), jnp.inf)
    # (at equal times a minimum of those not yet passed would share the derivative)
    return jnp.sum(jnp.where(jnp.arange(times.shape[0], dtype=jnp.int32) == piece, times, 0.0))


@short_for(AbstractProfile)
class Constant(AbstractProfile):
    """The same value at all times.

    Example:
        >>> sb.Constant(8e3).level
        array(8000.)
    """

    level: Scalar = quantity("SI", "level of the profile")

    def value(self, t: Real, piece: Piece) -> Real:
        return jnp.broadcast_to(jnp.asarray(self.level, jnp.float64), np.shape(t))

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return jnp.asarray(self.level, jnp.float64)

    def scale(self) -> ScalarArray:
        return abs(self.level)


def _picked(x: Vector, mask: Bool[Array, " n"]) -> ScalarArray:
    """The entry at which the `mask` is set: cheaper in the loop than an indexed load, and transposes well."""
    return jnp.sum(jnp.where(mask, x, 0.0))


def _slopes(rise: Vector, span: Vector) -> Vector:
    return jnp.where(span > 0, rise / jnp.where(span > 0, span, 1.0), 0.0)


class AbstractPoints(AbstractProfile):
    """Straight lines between points `(times, values)`."""

    times: AbstractVar[Scalar]
    values: AbstractVar[Scalar]

    def slope(self, piece: Piece) -> ScalarArray:
        """Rate of the value on the given piece."""
        return jax.jvp(lambda t: self.value(t, piece), (jnp.zeros(()),), (jnp.ones(()),))[1]

    @abc.abstractmethod
    def decayed(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        """Remaining effect of past corners and jumps on a first-order lag of the time constant `τ`:

            Σ_j (τ Δm_j − Δv_j) e^{−(t − t_j)/τ}

        `Δm_j`, `Δv_j`: change of slope and jump at the time breakpoint `t_j`.
        """

    def scale(self) -> ScalarArray:
        return numpy_of(self.values).max(abs(self.values))

    def faults(self, path: str) -> Faults:
        times = np.asarray(self.times)
        if times.ndim != 1 or times.shape != np.shape(self.values):
            return [Fault(path, "times and values must be lists of one length, at least 1")]
        falls = np.any(np.diff(times) < 0)
        return [Fault(f"{path}.times", "the times must not decrease", "two equal times make a jump")] if falls else []


class PiecewiseLinear(AbstractPoints):
    """Straight lines between points `(times, values)`, constant before the first and after the last.

    Two points at one time are a jump. Every point is a time breakpoint at which a step of the integrator ends.

    Example:
        >>> sb.PiecewiseLinear([0.0, 0.35], [2e3, 24e3])
        PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])
    """

    times: Scalar = quantity("s", "times of the profile's points", many=Over.ROWS)
    values: Scalar = quantity("SI", "values at the profile's points", many=Over.ROWS)

    def lines(self) -> tuple[Vector, Vector, Vector]:
        """The straight line of each piece: value at its start, start, slope."""
        times, values = jnp.asarray(self.times), jnp.asarray(self.values)
        slope = _slopes(jnp.diff(values), jnp.diff(times))
        zero = jnp.zeros(1)
        base = jnp.concatenate([values[:1], values])
        start = jnp.concatenate([times[:1], times])
        return base, start, jnp.concatenate([zero, slope, zero])

    def value(self, t: Real, piece: Piece) -> Real:
        base, start, slopes = self.lines()
        in_piece = jnp.arange(base.shape[0], dtype=jnp.int32) == piece
        return _picked(base, in_piece) + _picked(slopes, in_piece) * (t - _picked(start, in_piece))

    def area(self, t: Real, piece: Piece) -> Real:
        """`∫ p dt` from the time 0, on the given piece: the angle turned at a speed."""
        base, start, slopes = self.lines()
        rise = 0.5 * (base[1:] + base[:-1]) * jnp.diff(start)
        before = base[0] * start[0] + jnp.concatenate([jnp.zeros(1), jnp.cumsum(rise)])
        in_piece = jnp.arange(base.shape[0], dtype=jnp.int32) == piece
        since = t - _picked(start, in_piece)
        return _picked(before, in_piece) + (_picked(base, in_piece) + 0.5 * _picked(slopes, in_piece) * since) * since

    def decayed(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        times, values, zero = jnp.asarray(self.times), jnp.asarray(self.values), jnp.zeros(1)
        span, rise = jnp.diff(times), jnp.diff(values)
        turn = jnp.diff(jnp.concatenate([zero, _slopes(rise, span), zero]))
        jump = jnp.concatenate([zero, jnp.where(span > 0, 0.0, rise)])
        passed = jnp.arange(times.shape[0], dtype=jnp.int32) < piece

        def left(of: Array) -> Array:
            return jnp.exp(jnp.where(passed, of - t, 0.0) / lag)

        return jnp.sum(jnp.where(passed, lag * turn * left(times) - jump * left(jump_times(times)), 0.0))

    def next_knot(self, piece: Piece) -> Floats | float:
        return _next_of(self.times, piece)

    def first_piece(self, t: Real) -> Piece:
        return jnp.sum(jnp.asarray(self.times) <= t).astype(jnp.int32)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        later = jnp.asarray(self.times) >= begin
        now = self.value(begin, self.first_piece(begin))
        return jnp.maximum(now, jnp.max(jnp.where(later, jnp.asarray(self.values), -jnp.inf)))

    def no_more_turns(self, t: Real) -> Mark:
        values = jnp.asarray(self.values)  # points may follow that all have the last value
        passed = jnp.arange(values.shape[0], dtype=jnp.int32) < self.first_piece(t) - 1
        return jnp.all(passed | (values == values[-1]))


@takes_values
def ramp(
    start: Annotated[float, Quantity("SI", "value before")],
    end: Annotated[float, Quantity("SI", "value after")],
    begin: Annotated[float, Quantity("s", "time at which it begins")],
    duration: Annotated[float, Quantity("s", "duration", 0.0)],
) -> PiecewiseLinear:
    """From `start` to `end` in a straight line over `duration` (s) from the time `begin` (s).

    Example:
        >>> sb.ramp(2e3, 24e3, 0.0, 0.35)
        PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])
    """
    return PiecewiseLinear(times=np.asarray([begin, begin + duration]), values=np.asarray([start, end]))


class Repeated(AbstractPoints):
    """A cycle of straight lines, repeated: `count` times the points `(times, values)`, every `period`, from `begin` on.

    - `times` (k,) in s from the start of a cycle, not decreasing, at most `period`;  `values` (k,)

    Between the last point of a cycle and the first of the next it is a straight line too; before the first point and
    after the last it is constant. The cost of a value does not depend on the number of cycles.

    Example:
        >>> sb.Repeated([0.0, 2.0], [30e3, 0.0], period="50 s", count=30).count
        30
    """

    times: Scalar = quantity("s", "times of the points in one cycle", low=0.0, many=Over.ROWS)
    values: Scalar = quantity("SI", "values at the points", many=Over.ROWS)
    period: Scalar = quantity("s", "length of a cycle", positive=True)
    count: int = whole("number of cycles", high=1_000_000)
    begin: Scalar = quantity("s", "start of the first cycle", default=0.0)

    @property
    def knot_count(self) -> int:
        return self.count * int(np.shape(self.times)[0])

    def _jump_times(self) -> Float[Array, " k"]:
        """`jump_times` of a cycle, the jump from one cycle to the next included."""
        times = jnp.asarray(self.times)
        since = jnp.roll(jnp.diff(times, append=self.period + times[:1]), 1)
        return jnp.where(since > 0, times, times - 0.5 * since)

    def value(self, t: Real, piece: Piece) -> Real:
        times, values = jnp.asarray(self.times), jnp.asarray(self.values)
        k = times.shape[0]
        passed = jnp.clip(piece - 1, 0, self.knot_count - 1)
        cycle, point = passed // k, passed % k
        at_point = jnp.arange(k, dtype=jnp.int32) == point
        slope = _slopes(jnp.diff(values, append=values[:1]), jnp.diff(times, append=self.period + times[:1]))
        since = t - (self.begin + cycle.astype(jnp.float64) * self.period + _picked(times, at_point))
        inside = (piece > 0) & (piece < self.knot_count)
        return _picked(values, at_point) + jnp.where(inside, _picked(slope, at_point), 0.0) * since

    def decayed(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        # each point of a cycle, over all cycles that have passed it: a geometric series
        times, values = jnp.asarray(self.times), jnp.asarray(self.values)
        k = times.shape[0]
        span, rise = jnp.diff(times, append=self.period + times[:1]), jnp.diff(values, append=values[:1])
        slope, jump = _slopes(rise, span), jnp.roll(jnp.where(span > 0, 0.0, rise), 1)
        piece = jnp.clip(jnp.asarray(piece, jnp.int32), 0, self.knot_count)
        often = (piece + k - 1 - jnp.arange(k, dtype=jnp.int32)) // k
        count = often.astype(jnp.float64)

        def left(of: Array) -> Array:
            age = jnp.where(often > 0, t - (self.begin + (count - 1) * self.period + of), 0.0)
            return jnp.exp(-age / lag)

        ratio = -self.period / lag
        series = jnp.expm1(count * ratio) / jnp.expm1(ratio)  # (0 of a point not passed)
        jumps = self._jump_times()
        total = jnp.sum((lag * (slope - jnp.roll(slope, 1)) * left(times) - jump * left(jumps)) * series)
        # before the first cycle and after the last one it is constant
        last = t - (self.begin + (self.count - 1.0) * self.period + times[-1])
        begun, over = piece > 0, piece == self.knot_count
        for part, of in ((lag * slope[-1], times), (jump[0], jumps)):
            total += jnp.where(begun, part * jnp.exp(-jnp.where(begun, t - (self.begin + of[0]), 0.0) / lag), 0.0)
        return total - jnp.where(over, lag * slope[-1] * jnp.exp(-jnp.where(over, last, 0.0) / lag), 0.0)

    def next_knot(self, piece: Piece) -> Floats | float:
        times, piece = jnp.asarray(self.times), jnp.asarray(piece, jnp.int32)
        k = times.shape[0]
        at_point = jnp.arange(k, dtype=jnp.int32) == piece % k
        times = jnp.where(piece > 0, self._jump_times(), times)  # (no jump leads to the first point of all)
        t = self.begin + (piece // k).astype(jnp.float64) * self.period + _picked(times, at_point)
        return jnp.where(piece < self.knot_count, t, jnp.inf)

    def first_piece(self, t: Real) -> Piece:
        cycles = np.arange(self.count, dtype=np.float64)[:, None]
        ends = self.begin + cycles * self.period + jnp.asarray(self.times)[None, :]
        return jnp.sum(ends <= t).astype(jnp.int32)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        values = jnp.asarray(self.values)
        last = self.begin + (self.count - 1) * self.period + jnp.asarray(self.times)[-1]
        return jnp.where(begin <= last, jnp.max(values), values[-1])

    def faults(self, path: str) -> Faults:
        faults = super().faults(path)
        if np.max(self.times, initial=0.0) > np.asarray(self.period):
            faults.append(Fault(f"{path}.times", "a time lies beyond the period", "make the period longer"))
        return faults


class ExponentialRise(AbstractProfile):
    """`p(t) = p_1 (1 − exp(−(t − t_0)/t_i))` from `t_0` on, 0 before: the filling of brake actuators.

    - `level` `p_1`; `time_constant` `t_i` (s); `begin` `t_0` (s)

    Example:
        >>> sb.profiles.ExponentialRise(24e3, "0.1 s")
        ExponentialRise(level=24000, time_constant=0.1 s, begin=0 s)
    """

    level: Scalar = quantity("SI", "final level")
    time_constant: Scalar = quantity("s", "time constant of the rise", positive=True)
    begin: Scalar = quantity("s", "time at which the rise begins", default=0.0)

    @property
    def rises(self) -> bool:
        return type(self) is ExponentialRise  # a subclass may have another value

    def value(self, t: Real, piece: Piece) -> Real:
        return jnp.where(piece > 0, -self.level * jnp.expm1(-(t - self.begin) / self.time_constant), 0.0 * t)

    def next_knot(self, piece: Piece) -> Floats | float:
        return jnp.where(piece > 0, jnp.inf, self.begin)

    def first_piece(self, t: Real) -> Piece:
        return (jnp.asarray(self.begin) <= t).astype(jnp.int32)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return jnp.maximum(self.level, self.value(begin, self.first_piece(begin)))

    def scale(self) -> ScalarArray:
        return abs(self.level)


class FunctionProfile(AbstractProfile):
    """A custom function of time, smooth between the `knots` given (corners and jumps).

    `function(t, parameters)` must accept traced values; `parameters` is a PyTree of arrays whose numbers can be
    differentiated. `typical` is its typical magnitude. At a jump the piece before the knot is continued by its value.

    Example:
        >>> lever = sb.profiles.FunctionProfile(lambda t, force: force * t**2, 500.0, typical=2000.0)
        >>> float(lever.value(2.0, 0))
        2000.0
    """

    function: Callable[[Any, Any], Any] = struct_field(static=True)
    parameters: Any = None
    typical: Scalar = quantity("SI", "typical magnitude of the profile", positive=True, default=1.0)
    knots: Scalar = quantity("s", "times of corners and jumps", many=Over.ROWS, default=())

    def value(self, t: Real, piece: Piece) -> Real:
        knots = jnp.asarray(self.knots)
        if knots.shape[0]:
            # stay on this side of a jump: the piece ends just before its knot
            end = jnp.min(jnp.where(jnp.arange(knots.shape[0], dtype=jnp.int32) >= piece, knots, jnp.inf))
            start = jnp.max(jnp.where(jnp.arange(knots.shape[0], dtype=jnp.int32) < piece, knots, -jnp.inf))
            inside = jnp.clip(t, start, jnp.where(jnp.isfinite(end), end - 1e-12 * jnp.maximum(jnp.abs(end), 1.0), end))
            t = jax.lax.stop_gradient(inside - t) + t
        return jnp.asarray(self.function(t, self.parameters), jnp.float64)

    def next_knot(self, piece: Piece) -> Floats | float:
        return _next_of(self.knots, piece)

    def first_piece(self, t: Real) -> Piece:
        return jnp.sum(jnp.asarray(self.knots) <= t).astype(jnp.int32)

    def scale(self) -> ScalarArray:
        return jnp.asarray(self.typical)

    def faults(self, path: str) -> Faults:
        knots = np.asarray(self.knots)
        return [Fault(f"{path}.knots", "the knots must increase")] if np.any(np.diff(knots) < 0) else []


def hides_nothing(part: PyTree, course: Callable) -> bool:
    """Whether the function of time `course(part, t, piece)` has no short features between two time breakpoints.

    That holds where the function is a straight line on every piece, or a sum of straight lines and exponential rises.
    The straight line is proved by a calculation with `_Time` as the time, with addition and scaling only;
    any other operation on the time (a comparison, any function of JAX) counts as a short feature. Derivatives cannot
    prove it: they are zero on both sides of a jump. Found once for each structure of a part.
    """

    def rises(x: object) -> bool:
        return isinstance(x, AbstractProfile) and x.rises

    straight = jax.tree.map(lambda x: Constant(0.0) if rises(x) else x, part, is_leaf=rises)
    return _is_straight(straight, course)


@per_structure
def _is_straight(part: PyTree, course: Callable) -> bool:
    def calculate(part: PyTree, piece: Piece) -> None:
        course(part, _Time(), piece)

    try:
        jax.eval_shape(calculate, part, jax.ShapeDtypeStruct((), np.int32))
    except Exception:  # every operation that does not keep straight lines
        return False
    return True
