"""Profiles, the given functions of time: constant, piecewise linear, repeated cycles,
custom functions."""

import abc
import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ._base._faults import Fault, Faults, Issues
from ._base._part import (
    Part,
    parts_below,
    positive_quantity,
    quantity,
    short_for,
    structural,
    takes_values,
    whole,
)
from ._base._quantity import IndexedBy, Quantity, Scalar
from ._base._store import cached_by_structure
from .hybrid.arrays import Array, Floats, Mark, ScalarArray, Vector, entry
from .hybrid.struct import AbstractVar, Struct, with_fields

__all__ = [
    "AbstractProfile",
    "Constant",
    "ExponentialRise",
    "FunctionProfile",
    "PiecewiseLinear",
    "Repeated",
    "held",
    "ramp",
]

#: knots of different profiles closer than this share of their time coincide
_ROUNDING = 8 * float(np.finfo(np.float64).eps)


class _Time:
    """Symbolic time in a calculation: its operations keep straight lines straight, all
    others raise."""

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
    #: a time, or a value at it; or their symbols while a profile is examined
    #: (`is_piecewise_simple`)
    Real = Floats | float | int | _Time
#: how many time breakpoints have passed
Piece: TypeAlias = Int[Array, "..."] | int
Name = TypeVar("Name")
Tree = TypeVar("Tree")


#: samples among which the greatest value of a function without known points is looked
#: for
_SAMPLES = 257


class AbstractProfile(Part):
    """A given function of time. Corners and jumps are time breakpoints: between two of
    them it is smooth.

    `piece` counts the time breakpoints passed; `value(t, piece)` extends its piece
    smoothly beyond both ends. A straight line between two time breakpoints, or an
    `ExponentialRise`, has no short features; with any other profile a run takes shorter
    steps and evaluates its guards inside them as well.
    """

    @abc.abstractmethod
    def value(self, t: Real, piece: Piece) -> Real:
        """Value at `t` on the given piece."""

    def next_knot(self, piece: Piece) -> Floats | float:
        """The time breakpoint that ends the piece, `inf` after the last (also where
        there is none, as by default)."""
        return jnp.inf

    def first_piece(self, t: Real) -> Piece:
        """The piece that begins at or before `t`."""
        return 0

    @property
    def knot_count(self) -> int:
        """Number of time breakpoints, where it may be large; 0 otherwise."""
        return 0

    @property
    def has_simple_pieces(self) -> bool:
        """Whether on every piece it is known to be a straight line, a parabola or one
        exponential of time (`is_piecewise_simple`)."""
        return False

    @property
    def controls_speed(self) -> bool:
        """Whether its value depends on the speed (of a lever)."""
        return False

    def follows(self, piece: Piece) -> Mark | bool:
        """Whether its value depends on the speed on the piece (of a lever)."""
        return False

    @property
    def corrects_position(self) -> bool:
        """Whether its value depends on the angle that the pulley has turned (of a
        lever)."""
        return False

    def with_sums(self) -> "AbstractProfile":
        """The same profile for a run: with sums over long lists of points, up to each
        point, that are formed once."""
        summed = {
            name: x.with_sums()
            for name, x in vars(self).items()
            if isinstance(x, AbstractProfile)
        }
        return with_fields(self, **summed) if summed else self

    def is_settled(self, t: Real) -> Mark:
        """Whether no time breakpoint after `t` changes the course of the profile."""
        return jnp.isinf(self.next_knot(jnp.asarray(self.first_piece(t), jnp.int32)))

    def greatest_from(self, begin: Array, end: Array) -> Array:
        """Greatest value from the time `begin` (s) on; of a function that is known by
        its values alone the greatest of samples up to `end` (s)."""
        times = jnp.linspace(begin, jnp.maximum(begin, end), _SAMPLES)
        return jnp.max(
            jax.vmap(
                lambda t: jnp.asarray(self.value(t, self.first_piece(t)), jnp.float64)
            )(times)
        )

    @abc.abstractmethod
    def scale(self) -> ScalarArray:
        """Largest magnitude, at least roughly: the reference of dimensionless
        guards."""


def faults_of_sign(
    course: Part, path: str, unit: str, hint: str = "a band cannot push"
) -> Faults:
    """Errors of negative values in a profile and in the profiles inside it, where these
    have the same `unit`."""
    faults = Issues()
    for where, profile, own_unit in parts_below(course, path, unit):
        if not isinstance(profile, AbstractProfile) or own_unit != unit:
            continue
        for field in dataclasses.fields(profile):
            about = field.metadata.get("quantity")
            values = getattr(profile, field.name)
            if (
                about is None
                or about.unit != "SI"
                or not np.any(np.asarray(values) < 0)
            ):
                continue
            low = f"{np.min(values):g} is below 0"
            faults.add(f"{where}.{field.name}", low, hint)
    return faults


def starting_piece(profile: Any, t: Real) -> Piece | None:
    """The piece of a profile at the start of a run; `None` if it has no time
    breakpoints (not part of the mode)."""
    if isinstance(profile.next_knot(jnp.asarray(0, jnp.int32)), float):
        return None
    return profile.first_piece(t)


def next_known_time(
    profiles: Mapping[Name, Any],
    pieces: Any,
    waits: Callable[[Array], Array] | None = None,
) -> tuple[ScalarArray | float, dict[Name, Any]]:
    """The next time breakpoint of several profiles (`inf`: none), and for each profile
    whether the time breakpoint is its own.

    It is that of one profile only. Where knots of several coincide (within rounding)
    they are passed one after the other, with steps of length 0 in between, so that each
    keeps its own derivative: in the order of `profiles`, but the first profile comes
    last where `waits(time)`.
    """
    knots = {
        name: profile.next_knot(pieces[name]) for name, profile in profiles.items()
    }
    # (a profile without knots gives a plain number)
    varying = {
        name: jnp.asarray(knot)
        for name, knot in knots.items()
        if not isinstance(knot, float)
    }
    turns: dict[Name, Any] = dict.fromkeys(profiles, False)
    if not varying:
        return jnp.inf, turns
    if len(varying) == 1:
        ((only, knot),) = varying.items()
        return knot, turns | {only: True}
    first = jax.lax.stop_gradient(functools.reduce(jnp.minimum, varying.values()))
    due = {
        i: jax.lax.stop_gradient(knot) <= first + _ROUNDING * jnp.abs(first)
        for i, knot in varying.items()
    }
    order = list(varying)
    assigned = jnp.asarray(False)
    if order[0] == next(iter(profiles)) and waits is not None:
        assigned = due[order[0]] & ~(
            waits(first) & functools.reduce(jnp.logical_or, [due[i] for i in order[1:]])
        )
        turns[order[0]] = assigned
        order = order[1:]
    for i in order:
        turns[i] = due[i] & ~assigned
        assigned = assigned | due[i]
    time = sum(jnp.where(turns[i], knot, 0.0) for i, knot in varying.items())
    # knots that differ by rounding are all passed at the time of the first
    late = jnp.where(time > first, time - first, 0.0)
    return time - jax.lax.stop_gradient(late), turns


#: a list of up to so many points is short: its entries are searched and summed anew at
#: each use
FEW = 16


class Entries(Struct):
    """Some entries of a long list, with their numbers in it."""

    numbers: Int[Array, " k"]
    values: Float[Array, " k"]
    size: int = structural()

    @property
    def shape(self) -> tuple[int]:
        return (self.size,)


def point(x: Any, i: Piece) -> Array:
    """The entry `i` of a list, or the first or last beyond its ends; its cost does not
    depend on the length of the list."""
    i = jnp.clip(jnp.asarray(i, jnp.int32), 0, np.shape(x)[0] - 1)
    if isinstance(x, Entries):
        x, i = x.values, jnp.argmax(x.numbers == i).astype(jnp.int32)
    return entry(jnp.asarray(x), i)


class AbstractHistory(Part):
    """A part with lists of points: each piece reads only the entries of a few points."""

    #: names of these lists, all of one length
    by_piece: ClassVar[tuple[str, ...]]

    def number(self, i: Array, size: int) -> Array:
        """Place of the point `i` in a list of `size` entries."""
        return jnp.clip(i, 0, size - 1)

    def near(self, before: Piece, after: Piece) -> Self:
        """The part with long lists cut down to what it reads on the pieces `before` and
        `after`."""
        lists = {
            name: x
            for name in self.by_piece
            if (x := getattr(self, name)) is not None and np.size(x) > FEW
        }
        if not lists:
            return self
        size = np.size(next(iter(lists.values())))
        places = [before - 1, before, before + 1, after - 1, after, 0, size - 1]
        numbers = self.number(
            jnp.stack([jnp.asarray(i, jnp.int32) for i in places]), size
        )
        return with_fields(
            self,
            **{
                name: Entries(numbers, jnp.asarray(x)[numbers], size)
                for name, x in lists.items()
            },
        )


def with_near_points(tree: Tree, courses: Iterable[tuple[Any, Piece, Piece]]) -> Tree:
    """A tree of parts in which the histories of some courses are cut down to what they
    read on two pieces (`AbstractHistory.near`).

    - `courses`: parts of the tree, each with its piece before and after
    """
    pieces = {id(course): both for course, *both in courses}

    def is_history(x: object) -> bool:
        return isinstance(x, AbstractHistory)

    def cut(part: Any) -> Any:
        both = pieces.get(id(part))
        if both is None:
            return part
        return jax.tree.map(
            lambda x: x.near(*both) if is_history(x) else x, part, is_leaf=is_history
        )

    return jax.tree.map(cut, tree, is_leaf=lambda x: id(x) in pieces)


def jump_time(before: Array, time: Array) -> Array:
    """The time of a point, for a jump with the derivative of the mean of its two points.

    A jump is the limit of a steep line: moving one of its points moves the mean by
    half.
    """
    return jnp.where(time > before, time, 0.5 * (before + time))


def _next_of(times: Scalar, piece: Piece) -> Floats | float:
    """The time that ends the piece, `inf` after the last."""
    n = np.shape(times)[0]
    if not n:
        return jnp.inf
    return jnp.where(
        piece < n, jump_time(point(times, piece - 1), point(times, piece)), jnp.inf
    )


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


def _slopes(rise: Array, span: Array) -> Array:
    return jnp.where(span > 0, rise / jnp.where(span > 0, span, 1.0), 0.0)


def _transients(
    lag: Scalar, since: Vector, turn: Vector, jump: Vector, late: Vector
) -> Vector:
    """`D_j = D_{j−1} e^{−s_j/τ} + τ Δm_j − Δv_j e^{−l_j/τ}` at all points.

    - `late` `l_j`: from the `jump_time` of a jump to its point, 0 with a derivative
    """

    def joined(
        a: tuple[Vector, Vector], b: tuple[Vector, Vector]
    ) -> tuple[Vector, Vector]:
        return a[0] * b[0], a[1] * b[0] + b[1]

    return jax.lax.associative_scan(
        joined, (jnp.exp(-since / lag), lag * turn - jump * jnp.exp(-late / lag))
    )[1]


class AbstractPoints(AbstractProfile, AbstractHistory):
    """Straight lines between points `(times, values)`."""

    times: AbstractVar[Scalar]
    values: AbstractVar[Scalar]
    by_piece: ClassVar[tuple[str, ...]] = ("times", "values")

    def slope(self, piece: Piece) -> ScalarArray:
        """Rate of the value on the given piece."""
        return jax.jvp(
            lambda t: self.value(t, piece), (jnp.zeros(()),), (jnp.ones(()),)
        )[1]

    @abc.abstractmethod
    def transient(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        """What is left of past corners and jumps in a first-order lag of the time
        constant `τ`:

            Σ_j (τ Δm_j − Δv_j) e^{−(t − t_j)/τ}

        `Δm_j`, `Δv_j`: change of slope and jump at the time breakpoint `t_j`.
        """

    @abc.abstractmethod
    def transient_at_points(self, lag: Scalar) -> Vector:
        """`transient` just after each point, of the corners and jumps up to it."""

    def with_sums(self, lag: Scalar | None = None) -> "AbstractPoints":
        """Also with the sums of `transient` for a `lag`."""
        return self

    def scale(self) -> ScalarArray:
        if isinstance(self.values, np.ndarray | np.generic):
            return np.max(np.abs(self.values))
        # (XLA hands a maximum of many numbers as such to a library, which slows a run)
        values = jax.lax.stop_gradient(jnp.asarray(self.values))
        return jax.lax.reduce(
            values, jnp.zeros(()), lambda a, b: jnp.maximum(a, abs(b)), (0,)
        )

    def faults(self, path: str) -> Faults:
        times = np.asarray(self.times)
        if times.ndim != 1 or times.shape != np.shape(self.values):
            words = "times and values must be lists of one length, at least 1"
            return [Fault(path, words)]
        faults: Faults = []
        if np.any(np.diff(times) < 0):
            words = "the times must not decrease"
            faults.append(Fault(f"{path}.times", words, "two equal times make a jump"))
        return faults


class PiecewiseLinear(AbstractPoints):
    """Straight lines between points `(times, values)`, constant before the first and
    after the last.

    Two points at one time are a jump. Every point is a time breakpoint at which a step
    of the integrator ends.

    Example:
        >>> sb.PiecewiseLinear([0.0, 0.35], [2e3, 24e3])
        PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])
    """

    times: Scalar = quantity("s", "times of the profile's points", many=IndexedBy.ROWS)
    values: Scalar = quantity(
        "SI", "values at the profile's points", many=IndexedBy.ROWS
    )

    def line(self, piece: Piece) -> tuple[Array, Array, Array]:
        """The straight line of a piece: value at its start, start, slope."""
        # (before the first point and after the last both ends are one point)
        start = point(self.times, piece - 1)
        end = point(self.times, piece)
        base = point(self.values, piece - 1)
        top = point(self.values, piece)
        return base, start, _slopes(top - base, end - start)

    def value(self, t: Real, piece: Piece) -> Real:
        base, start, slope = self.line(piece)
        return base + slope * (t - start)

    def areas(self) -> Vector:
        """`∫ p dt` from the time 0 up to each point."""
        times = jnp.asarray(self.times)
        values = jnp.asarray(self.values)
        rise = 0.5 * (values[1:] + values[:-1]) * jnp.diff(times)
        return values[0] * times[0] + jnp.concatenate([jnp.zeros(1), jnp.cumsum(rise)])

    def area(self, t: Real, piece: Piece) -> Real:
        """`∫ p dt` from the time 0, on the given piece: the angle turned at a speed."""
        base, start, slope = self.line(piece)
        since = t - start
        return point(self.areas(), piece - 1) + (base + 0.5 * slope * since) * since

    def transient_at_points(self, lag: Scalar) -> Vector:
        times = jnp.asarray(self.times)
        values = jnp.asarray(self.values)
        zero = jnp.zeros(1)
        span = jnp.diff(times)
        rise = jnp.diff(values)
        turn = jnp.diff(jnp.concatenate([zero, _slopes(rise, span), zero]))
        jump = jnp.concatenate([zero, jnp.where(span > 0, 0.0, rise)])
        before = jnp.concatenate([times[:1], times[:-1]])
        return _transients(
            lag, times - before, turn, jump, times - jump_time(before, times)
        )

    def transient(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        since = jnp.where(piece > 0, t - point(self.times, piece - 1), 0.0)
        return jnp.where(
            piece > 0,
            point(self.transient_at_points(lag), piece - 1) * jnp.exp(-since / lag),
            0.0,
        )

    def next_knot(self, piece: Piece) -> Floats | float:
        return _next_of(self.times, piece)

    def with_sums(self, lag: Scalar | None = None) -> AbstractPoints:
        if type(self) is not PiecewiseLinear or np.size(self.times) <= FEW:
            return self
        return _Summed(
            self.times,
            self.values,
            self.areas(),
            None if lag is None else self.transient_at_points(lag),
        )

    def first_piece(self, t: Real) -> Piece:
        times = jnp.asarray(self.times)
        if times.shape[0] > FEW:
            return jnp.searchsorted(times, t, side="right").astype(jnp.int32)
        return jnp.sum(times <= t).astype(jnp.int32)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        later = jnp.asarray(self.times) >= begin
        now = self.value(begin, self.first_piece(begin))
        return jnp.maximum(
            now, jnp.max(jnp.where(later, jnp.asarray(self.values), -jnp.inf))
        )

    def is_settled(self, t: Real) -> Mark:
        # points may follow that all have the last value
        values = jnp.asarray(self.values)
        passed = jnp.arange(values.shape[0], dtype=jnp.int32) < self.first_piece(t) - 1
        return jnp.all(passed | (values == values[-1]))


class _Summed(PiecewiseLinear):
    """Straight lines between many points with the sums over them, up to each point."""

    area_at: Any = None
    transient_at: Any = None
    by_piece: ClassVar[tuple[str, ...]] = ("times", "values", "area_at", "transient_at")

    def areas(self) -> Vector:
        return self.area_at

    def transient_at_points(self, lag: Scalar) -> Vector:
        return self.transient_at


@takes_values
def ramp(
    start: Annotated[float, Quantity("SI", "value before")],
    end: Annotated[float, Quantity("SI", "value after")],
    begin: Annotated[float, Quantity("s", "time at which it begins")],
    duration: Annotated[float, Quantity("s", "duration", 0.0)],
) -> PiecewiseLinear:
    """From `start` to `end` in a straight line over `duration` (s) from the time
    `begin` (s).

    Example:
        >>> sb.ramp(2e3, 24e3, 0.0, 0.35)
        PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])
    """
    return PiecewiseLinear(
        times=np.asarray([begin, begin + duration]), values=np.asarray([start, end])
    )


@takes_values
def held(
    times: Annotated[
        Sequence[float] | np.ndarray,
        Quantity("s", "times from which the values hold", many=IndexedBy.ROWS),
    ],
    values: Annotated[
        Sequence[float] | np.ndarray, Quantity("SI", "values", many=IndexedBy.ROWS)
    ],
) -> PiecewiseLinear:
    """Samples each of which holds up to the next (zero order): straight lines with a
    jump at each time.

    Example:
        >>> sb.profiles.held([0.0, 1.0, 3.0], [2.0, 5.0, 4.0]).values
        array([2., 2., 5., 5., 4.])
    """
    return PiecewiseLinear(
        times=np.repeat(times, 2)[1:], values=np.repeat(values, 2)[:-1]
    )


class Repeated(AbstractPoints):
    """A cycle of straight lines, repeated: `count` times the points `(times, values)`,
    every `period`, from `begin` on.

    - `times` (k,) in s from the start of a cycle, not decreasing, at most `period`
    - `values` (k,)

    Between the last point of a cycle and the first of the next it is a straight line
    too; before the first point and after the last it is constant. The cost of a value
    does not depend on the number of cycles.

    Example:
        >>> sb.Repeated([0.0, 2.0], [30e3, 0.0], period="50 s", count=30).count
        30
    """

    times: Scalar = quantity(
        "s", "times of the points in one cycle", low=0.0, many=IndexedBy.ROWS
    )
    values: Scalar = quantity("SI", "values at the points", many=IndexedBy.ROWS)
    period: Scalar = positive_quantity("s", "length of a cycle")
    count: int = whole("number of cycles", high=1_000_000)
    begin: Scalar = quantity("s", "start of the first cycle", default=0.0)

    @property
    def knot_count(self) -> int:
        return self.count * int(np.shape(self.times)[0])

    def number(self, i: Array, size: int) -> Array:
        return i % size

    def _span(self, i: Array) -> Array:
        """Time from the point `i` of a cycle to the next, which may be the first of the
        next cycle."""
        k = np.shape(self.times)[0]
        following = jnp.where(
            i < k - 1, point(self.times, i + 1), self.period + point(self.times, 0)
        )
        return following - point(self.times, i)

    def _rise(self, i: Array) -> Array:
        return point(self.values, (i + 1) % np.shape(self.times)[0]) - point(
            self.values, i
        )

    def _jump_time(self, i: Array) -> Array:
        """`jump_time` of the point `i` in its cycle, the jump from one cycle to the
        next included."""
        k = np.shape(self.times)[0]
        time = point(self.times, i)
        since = self._span((i + k - 1) % k)
        return jnp.where(since > 0, time, time - 0.5 * since)

    def _place(self, piece: Piece) -> tuple[Array, Array]:
        """The cycle, and the point in it, with which a piece begins; the first piece,
        before all points, has the first point."""
        passed = jnp.clip(jnp.asarray(piece, jnp.int32) - 1, 0, self.knot_count - 1)
        k = np.shape(self.times)[0]
        return passed // k, passed % k

    def _begun(self, cycle: Array) -> Array:
        return self.begin + cycle.astype(jnp.float64) * self.period

    def value(self, t: Real, piece: Piece) -> Real:
        cycle, i = self._place(piece)
        inside = (piece > 0) & (piece < self.knot_count)
        slope = jnp.where(inside, _slopes(self._rise(i), self._span(i)), 0.0)
        return point(self.values, i) + slope * (
            t - (self._begun(cycle) + point(self.times, i))
        )

    def transient_at_points(self, lag: Scalar) -> Vector:
        """`transient` just after each point, of the corners and jumps of its own cycle
        alone; the cycle lies between others."""
        times = jnp.asarray(self.times)
        values = jnp.asarray(self.values)
        span = jnp.diff(times, append=self.period + times[:1])
        rise = jnp.diff(values, append=values[:1])
        slope = _slopes(rise, span)
        jump = jnp.roll(jnp.where(span > 0, 0.0, rise), 1)
        since = jnp.roll(span, 1)
        late = jnp.where(since > 0, 0.0, 0.5 * since)
        return _transients(lag, since, slope - jnp.roll(slope, 1), jump, late)

    def transient(self, t: Real, piece: Piece, lag: Scalar) -> Real:
        # the transients of all cycles before are a geometric series at the last point of
        # the latest one
        last = np.shape(self.times)[0] - 1
        piece, (cycle, i) = jnp.asarray(piece, jnp.int32), self._place(piece)
        each = self.transient_at_points(lag)
        ratio = -self.period / lag
        series = jnp.expm1(cycle.astype(jnp.float64) * ratio) / jnp.expm1(ratio)
        way = self.period + point(self.times, i) - point(self.times, last)
        left = point(each, i) + point(each, last) * series * jnp.exp(-way / lag)
        # before the first cycle and after the last one it is constant
        begun = piece > 0
        over = piece == self.knot_count

        def since(when: Array | bool, time: Array) -> Array:
            return jnp.exp(-jnp.where(when, t - time, 0.0) / lag)

        slope = _slopes(self._rise(last), self._span(last))
        sudden = self._span(last) <= 0
        jump = jnp.where(sudden, self._rise(last), 0.0)
        left = left * since(begun, self._begun(cycle) + point(self.times, i))
        left += lag * slope * since(begun, self.begin + point(self.times, 0))
        left += jump * since(
            begun, self.begin + self._jump_time(jnp.asarray(0, jnp.int32))
        )
        end = self.begin + (self.count - 1.0) * self.period + point(self.times, last)
        return jnp.where(
            begun, left - jnp.where(over, lag * slope * since(over, end), 0.0), 0.0
        )

    def with_sums(self, lag: Scalar | None = None) -> AbstractPoints:
        if type(self) is not Repeated or np.size(self.times) <= FEW or lag is None:
            return self
        return _SummedCycle(**vars(self), transient_at=self.transient_at_points(lag))

    def next_knot(self, piece: Piece) -> Floats | float:
        piece = jnp.asarray(piece, jnp.int32)
        k = np.shape(self.times)[0]
        i = piece % k
        # (no jump leads to the first point of all)
        time = jnp.where(piece > 0, self._jump_time(i), point(self.times, i))
        return jnp.where(
            piece < self.knot_count, self._begun(piece // k) + time, jnp.inf
        )

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
            faults.append(
                Fault(
                    f"{path}.times",
                    "a time lies beyond the period",
                    "make the period longer",
                )
            )
        return faults


class _SummedCycle(Repeated):
    """A cycle of many points with the sums over them, up to each point."""

    transient_at: Any = None
    by_piece: ClassVar[tuple[str, ...]] = ("times", "values", "transient_at")

    def transient_at_points(self, lag: Scalar) -> Vector:
        return self.transient_at


class ExponentialRise(AbstractProfile):
    """`p(t) = p_1 (1 − exp(−(t − t_0)/t_i))` from `t_0` on, 0 before: the filling of
    brake actuators.

    - `level` `p_1`; `time_constant` `t_i` (s); `begin` `t_0` (s)

    Example:
        >>> sb.profiles.ExponentialRise(24e3, "0.1 s")
        ExponentialRise(level=24000, time_constant=0.1 s, begin=0 s)
    """

    level: Scalar = quantity("SI", "final level")
    time_constant: Scalar = positive_quantity("s", "time constant of the rise")
    begin: Scalar = quantity("s", "time at which the rise begins", default=0.0)

    @property
    def has_simple_pieces(self) -> bool:
        return type(self) is ExponentialRise  # a subclass may have another value

    def value(self, t: Real, piece: Piece) -> Real:
        return jnp.where(
            piece > 0,
            -self.level * jnp.expm1(-(t - self.begin) / self.time_constant),
            0.0 * t,
        )

    def next_knot(self, piece: Piece) -> Floats | float:
        return jnp.where(piece > 0, jnp.inf, self.begin)

    def first_piece(self, t: Real) -> Piece:
        return (jnp.asarray(self.begin) <= t).astype(jnp.int32)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return jnp.maximum(self.level, self.value(begin, self.first_piece(begin)))

    def scale(self) -> ScalarArray:
        return abs(self.level)


class FunctionProfile(AbstractProfile, AbstractHistory):
    """A custom function of time, smooth between the `knots` given (corners and jumps).

    `function(t, parameters)` must accept traced values; `parameters` is a PyTree of
    arrays whose numbers can be differentiated. `typical` is its typical magnitude. At a
    jump the piece before the knot is continued by its value.

    Example:
        >>> lever = sb.profiles.FunctionProfile(lambda t, force: force * t**2, 500.0, typical=2000.0)
        >>> float(lever.value(2.0, 0))
        2000.0
    """

    function: Callable[[Any, Any], Any] = structural()
    parameters: Any = None
    typical: Scalar = positive_quantity(
        "SI", "typical magnitude of the profile", default=1.0
    )
    knots: Scalar = quantity(
        "s", "times of corners and jumps", many=IndexedBy.ROWS, default=()
    )
    by_piece: ClassVar[tuple[str, ...]] = ("knots",)

    def value(self, t: Real, piece: Piece) -> Real:
        if n := np.shape(self.knots)[0]:
            # stay on this side of a jump: the piece ends just before its knot
            end = jnp.where(piece < n, point(self.knots, piece), jnp.inf)
            start = jnp.where(piece > 0, point(self.knots, piece - 1), -jnp.inf)
            before = end - 1e-12 * jnp.maximum(jnp.abs(end), 1.0)
            inside = jnp.clip(t, start, jnp.where(jnp.isfinite(end), before, end))
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
        if np.any(np.diff(knots) < 0):
            return [Fault(f"{path}.knots", "the knots must increase")]
        return []


def is_piecewise_simple(part: PyTree, course: Callable) -> bool:
    """Whether the function of time `course(part, t, piece)` has no short features
    between two time breakpoints.

    That holds where it is a sum of straight lines and of profiles that have simple
    pieces. Straight lines are proved by a calculation with `_Time` as the time, with
    addition and scaling only; any other operation on the time (a comparison, any
    function of JAX) counts as a short feature. Derivatives cannot prove it: they are
    zero on both sides of a jump. Each structure of a part is examined once.
    """

    def is_simple(x: object) -> bool:
        return isinstance(x, AbstractProfile) and x.has_simple_pieces

    rest = jax.tree.map(
        lambda x: Constant(0.0) if is_simple(x) else x, part, is_leaf=is_simple
    )
    return _is_straight(rest, course)


@cached_by_structure
def _is_straight(part: PyTree, course: Callable) -> bool:
    def calculate(part: PyTree, piece: Piece) -> None:
        course(part, _Time(), piece)

    try:
        jax.eval_shape(calculate, part, jax.ShapeDtypeStruct((), np.int32))
    except Exception:  # every operation that does not keep straight lines
        return False
    return True
