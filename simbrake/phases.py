"""Phases of a duty: each has its own lever, and ends with rest, travel, a temperature
or a time."""

import abc
import dataclasses
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeGuard

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from ._base._corners import clipped
from ._base._faults import Fault, Faults, Issues, input_error
from ._base._numbers import number
from ._base._part import (
    Part,
    as_part,
    part,
    positive_quantity,
    quantity,
    short_for,
    structural,
    whole,
)
from ._base._quantity import Quantity, Scalar, in_si
from .hybrid.arrays import Array, IntScalar, Mark, ScalarArray
from .hybrid.struct import struct_field
from .profiles import FEW, AbstractProfile, Constant, Piece, PiecewiseLinear, Real

# --- what ends a phase ---------------------------------------------------------------

#: places of which a temperature can end a phase
PLACES = ("rim", "linings", "band")


class AbstractEnd(Part):
    """What ends a phase, or begins a change of friction; where one is expected, a text
    does: `rest`, `travel 27 m`, `temperature 350 degC`, `12 s`; `stop 3`."""

    @property
    @abc.abstractmethod
    def words(self) -> str:
        """As in a text."""


class AtRest(AbstractEnd):
    """A phase ends as the pulley comes to rest, whatever stops it: a brake, a motor,
    dry friction, or a load that turns it round where nothing holds it. One that rests
    at its begin has to move first.

    Example:
        >>> sb.loads.AtRest()
        AtRest()
    """

    @property
    def words(self) -> str:
        return "rest"


class AfterTravel(AbstractEnd):
    """A phase ends after a travel of the hook from its begin.

    - `distance` (m): downwards, negative upwards

    Example:
        >>> sb.loads.AfterTravel("27 m")
        AfterTravel(distance=27 m)
    """

    distance: Scalar = quantity("m", "travel of the hook, negative upwards")

    def faults(self, path: str) -> Faults:
        hint = "give the metres downwards, negative ones upwards"
        return (
            [Fault(f"{path}.distance", "0 m is no travel", hint)]
            if float(self.distance) == 0.0
            else []
        )

    @property
    def words(self) -> str:
        return f"travel {number(self.distance, 'm')}"


class AtHeight(AbstractEnd):
    """A phase ends as the travelling block comes down (`rising`: up) to a height; at
    once where it already is there.

    - `height` (m) above the floor, as `Initial.block_height`

    Example:
        >>> sb.loads.AtHeight("5 m")
        AtHeight(height=5 m)
    """

    height: Scalar = quantity("m", "height of the block")
    rising: bool = structural(default=False)

    @property
    def words(self) -> str:
        return f"block {'up' if self.rising else 'down'} to {number(self.height, 'm')}"


class AtTemperature(AbstractEnd):
    """A phase ends as the surface of a place is as hot (`falling`: as cool) as that; at
    once where it already is.

    - `level` (K)
    - `of`: `rim`, `linings` (the hottest) or `band`, as the heat part names them

    Example:
        >>> sb.loads.AtTemperature("200 degC", of="rim")
        AtTemperature(level=200 °C)
    """

    level: Scalar = positive_quantity("K", "surface temperature")
    of: str = structural(default="rim")
    falling: bool = structural(default=False)

    @property
    def words(self) -> str:
        return (
            f"temperature of the {self.of} {'below' if self.falling else 'above'} "
            f"{self.level_words}"
        )

    @property
    def level_words(self) -> str:
        return str(number(self.level, "K", absolute=True))


@short_for(AbstractEnd)
class AfterTime(AbstractEnd):
    """A phase ends after a time.

    - `duration` (s)

    Example:
        >>> sb.loads.AfterTime("40 s")
        AfterTime(duration=40 s)
    """

    duration: Scalar = positive_quantity("s", "duration of the phase")

    @property
    def words(self) -> str:
        return str(number(self.duration, "s"))


class AtStop(AbstractEnd):
    """A change of friction begins as the pulley comes to rest for the n-th time
    (`FrictionChange.when`).

    - `number` of the stop, from 1

    Example:
        >>> sb.loads.AtStop(3).words
        'stop 3'
    """

    number: Scalar = quantity("1", "number of the stop", 1.0, 1e6)

    def faults(self, path: str) -> Faults:
        whole = float(self.number) % 1 == 0
        return (
            []
            if whole
            else [
                Fault(
                    f"{path}.number",
                    f"{float(self.number):g} is no whole number",
                    "as in 3",
                )
            ]
        )

    @property
    def words(self) -> str:
        return f"stop {number(self.number)}"


_FORMS = (
    'as in "rest", "travel 27 m" (negative upwards), "block down to 5 m", "temperature 350 degC", '
    '"temperature of the linings below 80 degC", "12 s"; of a change of friction "stop 3"'
)
_STOP = re.compile(r"stop (?P<number>\d{1,6})")
_HEIGHT = re.compile(r"block (?P<way>up|down) to (?P<height>.+)")
_TRAVEL = re.compile(r"travel (?P<distance>.+)")
_TEMPERATURE = re.compile(
    r"temperature (?:of (?:the )?(?P<of>[a-z]+) )?(?:(?P<way>above|below) )?(?P<level>[+-]?[\d.].*)"
)


def read_end(text: str, path: str = "until") -> AbstractEnd:
    """The end of a phase that a text means. Raises `InputError` for a text that is
    none."""

    def amount(words: str, unit: str, meaning: str, *, signed: bool = False) -> Any:
        value = in_si(
            words,
            Quantity(unit, meaning)
            if signed
            else Quantity(unit, meaning, 0.0, open_low=True),
        )
        if not isinstance(value, np.ndarray):
            raise input_error(
                path, f"{words!r} is no {meaning} in a unit of {unit}", _FORMS
            )
        return value

    plain = " ".join(text.split())
    if plain == "rest":
        return AtRest()
    if match := _TRAVEL.fullmatch(plain):
        distance = amount(
            match["distance"].replace("\N{MINUS SIGN}", "-"), "m", "travel", signed=True
        )
        if distance == 0.0:
            raise input_error(path, f"{text!r} is no travel", _FORMS)
        return AfterTravel(distance)
    if match := _HEIGHT.fullmatch(plain):
        return AtHeight(
            amount(match["height"], "m", "height", signed=True), match["way"] == "up"
        )
    if match := _TEMPERATURE.fullmatch(plain):
        of = match["of"] or "rim"
        if of not in PLACES:
            raise input_error(
                path,
                f"{of!r} is no place of a temperature",
                f"there are: {', '.join(PLACES)}",
            )
        return AtTemperature(
            amount(match["level"], "K", "temperature"), of, match["way"] == "below"
        )
    if match := _STOP.fullmatch(plain):
        return AtStop(amount(match["number"], "1", "number of a stop"))
    if plain[:1].isdigit() or plain[:1] == ".":
        return AfterTime(amount(plain, "s", "time"))
    raise input_error(path, f"{text!r} is not understood", _FORMS)


def as_end(x: Any) -> Any:
    """The end of a phase, from a text or a time (s) where one is given."""
    return read_end(x) if isinstance(x, str) else as_part(x, AbstractEnd, "s")


# --- what a duty wants --------------------------------------------------------------

#: what a duty, or one of its phases, can say that the brake is to do
WANTS = {
    "rest": "bring the load to rest",
    "hold": "hold it at rest",
    "lower": "let it down",
    "hoist": "let the motor pull it up",
    "free": "nothing: it may fall, or break away",
}


def faults_of_want(wants: str, path: str) -> Faults:
    """The error of a word that names nothing that a duty can want."""
    if wants == "" or wants in WANTS:
        return []
    meant = "; ".join(f'"{word}": {meaning}' for word, meaning in WANTS.items())
    return [
        Fault(
            f"{path}.wants",
            f"{wants!r} is nothing that a duty can want",
            f"one of {meant}",
        )
    ]


# --- phases -------------------------------------------------------------------------


class Phase(Part):
    """A phase of a duty: a lever until something happens.

    - `lever`: tension or force (N) over the time from the begin of the phase, or a
      lever that controls the speed
    - `until`: `"rest"`, `"travel 27 m"`, `"temperature 350 degC"`, `"12 s"`, or an
      object of these kinds
    - `name` in the event log
    - `string_on_hook`: whether a `StringLoad` hangs on the hook, else in the slips
    - `motor`: speed of the pulley that the scene's `Motor` follows from the begin of
      the phase on (rad/s), negative to hoist; `None`: the motor is off
    - `auxiliary`: share 0…1 of the excitation or filling of auxiliary brakes on the
      shaft, 0: disengaged; `None`: all
    - `wants`: what the verdict is to judge the phase by, one of `rest`, `hold`,
      `lower`, `hoist`, `free`; empty: what follows from its lever, its motor and its
      end

    Example:
        >>> sb.loads.Phase(30e3, "40 s", "hold")
        Phase(lever=Constant(level=30000), until=AfterTime(duration=40 s), name='hold')
    """

    lever: AbstractProfile = part(AbstractProfile)
    until: AbstractEnd = struct_field(converter=as_end, metadata={"part": AbstractEnd})
    name: str = structural(default="")
    string_on_hook: bool = structural(default=True)
    motor: PiecewiseLinear | None = part(PiecewiseLinear, "rad/s", default=None)
    auxiliary: Scalar | None = quantity(
        "1", "engagement of auxiliary brakes", 0.0, 1.0, default=None
    )
    wants: str = structural(default="")

    def faults(self, path: str) -> Faults:
        faults = Issues(faults_of_want(self.wants, path))
        if self.wants == "hoist" and self.motor is None:
            hint = "give the phase the speed of a motor, or another want"
            faults.add(
                f"{path}.wants", "is hoist, and no motor works in this phase", hint
            )
        if self.wants == "rest" and isinstance(self.until, AfterTravel | AtHeight):
            hint = 'give until = "rest", or wants = "lower"'
            faults.add(f"{path}.wants", "is rest, and the phase ends in motion", hint)
        return faults


class Ended(NamedTuple):
    """The end of a phase in the log: its name, its number and that of the cycle (from
    1), and what ended it."""

    name: str
    phase: int
    cycle: int
    until: str

    def __str__(self) -> str:
        named = f"{self.name!r} " if self.name else ""
        return f"phase {self.phase} {named}of cycle {self.cycle} ({self.until})"


class _Group(NamedTuple):
    """A cycle of phases that is repeated, among all of a duty (whole numbers, from 0).

    - `begin`, `end`: numbers of phases that have ended before its first cycle, and
      after its last
    - `first`: place of its first phase among all, and `length` of the cycle
    - `stands` on the string in its first cycle, more than in the first of all, and
      `step` of it from cycle to cycle
    - `cycle`: number of its first cycle among all
    """

    begin: int
    end: int
    first: int
    length: int
    stands: int
    step: int
    cycle: int


def _as_phases(x: Any) -> Any:
    """A tuple of phases, also of one alone."""
    return (x,) if isinstance(x, Phase) else x


class Phases(Part):
    """A lever in phases that follow each other, all of them `count` times; with the
    last one the run ends.

        brake, hold = sb.loads.Phase(sb.ramp(0, 30e3, 0, 0.35), "rest", "brake"),
        sb.loads.Phase(30e3, "40 s", "hold") duty =
        sb.Duty(sb.loads.Phases((sb.loads.Phase(0.0, "travel 26 m", "lower"), brake,
        hold), count=30), load)

    - `stands` by which the string of a `StringLoad` is longer in each cycle than in the
      one before: 1 running in, −1 pulling out, 0 for a string that stays as it is
    - `then`: other phases with their own `count` that follow, as pulling out after
      running in; its first cycle has the string as it is then

    A phase begins as the one before it ends, and its lever's time with it. The phase is
    a mode of the brake and its end an event, whose time has derivatives. A run that is
    at its `end_time` before ends with the code `phase_never_ends`.

    Example:
        >>> brake = sb.loads.Phase(sb.ramp(0, 30e3, 0, 0.35), "rest", "brake")
        >>> sb.loads.Phases((brake, sb.loads.Phase(30e3, "40 s", "hold")), count=3).total
        6
    """

    phases: tuple[Phase, ...] = struct_field(converter=_as_phases)
    count: int = whole("number of cycles", high=1_000_000, default=1)
    stands: int = whole(
        "stands that each cycle adds to the string", low=-1, high=1, default=1
    )
    then: "Phases | None" = None

    @property
    def engages(self) -> bool:
        """Whether auxiliary brakes are engaged differently in some phase."""
        return any(phase.auxiliary is not None for phase in self.each)

    def engagement(self, passed: IntScalar) -> ScalarArray:
        """Share of auxiliary brakes in the phase after `passed` others."""
        now = self.at(passed, jnp.zeros(()))
        return now.of_each(
            [1.0 if phase.auxiliary is None else phase.auxiliary for phase in self.each]
        )

    def located(self, path: str) -> list[tuple[str, Phase]]:
        """The phases of `each` with their paths."""
        own = [(f"{path}.phases[{i}]", phase) for i, phase in enumerate(self.phases)]
        return own if self.then is None else own + self.then.located(f"{path}.then")

    def with_levers(self, lever: Callable[[Phase], AbstractProfile]) -> "Phases":
        """The same phases with other levers."""
        phases = tuple(
            dataclasses.replace(phase, lever=lever(phase)) for phase in self.phases
        )
        return dataclasses.replace(
            self, phases=phases, then=self.then and self.then.with_levers(lever)
        )

    @property
    def each(self) -> tuple[Phase, ...]:
        """Every phase once, those that follow included."""
        return self.phases if self.then is None else (*self.phases, *self.then.each)

    @property
    def _groups(self) -> list[_Group]:
        groups = list[_Group]()
        phases = self
        begin = 0
        first = 0
        cycle = 0
        stands = -max(self.stands, 0)
        while phases is not None:
            length = len(phases.phases)
            count = phases.count
            step = phases.stands
            # a stand is made up before the string goes in, and laid down after it has
            # come out
            stands += max(step, 0)
            groups.append(
                _Group(
                    begin, begin + count * length, first, length, stands, step, cycle
                )
            )
            begin = groups[-1].end
            first = first + length
            cycle = cycle + count
            stands += step * (count - 1) + min(step, 0)
            phases = phases.then
        return groups

    @property
    def total(self) -> int:
        """Number of phases in all cycles."""
        return self._groups[-1].end

    @property
    def stands_range(self) -> tuple[int, int]:
        """Least and greatest number of stands that a cycle has more than the first
        one."""
        ends = [
            (x.stands, x.stands + x.step * ((x.end - x.begin) // x.length - 1))
            for x in self._groups
        ]
        return min(map(min, ends)), max(map(max, ends))

    def _group_of(self, passed: IntScalar) -> _Group:
        """The group of the phase that runs after `passed` others."""
        rows = np.asarray(self._groups, np.int32)
        runs = (rows[:, 0] <= passed) & (passed < rows[:, 1])
        row: Any = jnp.sum(jnp.where(runs[:, None], rows, 0), axis=0, dtype=jnp.int32)
        return _Group(*row)

    def place(self, passed: IntScalar) -> IntScalar:
        """Place among `each` of the phase that runs after `passed` others."""
        if self.then is None:
            return passed % len(self.phases)
        group = self._group_of(passed)
        return group.first + (passed - group.begin) % group.length

    def stands_at(self, passed: IntScalar) -> IntScalar:
        """How many stands the string has more than in the first cycle, in the phase
        after `passed` others."""
        if self.then is None:
            cycle = passed // len(self.phases)
            return cycle if self.stands == 1 else self.stands * cycle
        group = self._group_of(passed)
        return group.stands + group.step * ((passed - group.begin) // group.length)

    @property
    def knot_count(self) -> int:
        """Number of time breakpoints, about."""
        return 2 * self.total

    @property
    def controls_speed(self) -> bool:
        """Whether the lever controls the speed in some phase."""
        return any(phase.lever.controls_speed for phase in self.each)

    @property
    def corrects_position(self) -> bool:
        """Whether the lever corrects the angle that the pulley has turned in some
        phase."""
        return any(phase.lever.corrects_position for phase in self.each)

    def scale(self) -> ScalarArray:
        """Largest magnitude (N)."""
        return jnp.max(
            jnp.stack([jnp.asarray(phase.lever.scale()) for phase in self.each])
        )

    def at(self, passed: IntScalar, begun: ScalarArray) -> "PhaseNow":
        """The lever of the phase that began at `begun` (s) after `passed` others;
        behind the last that of the last."""
        return PhaseNow(self, jnp.minimum(passed, self.total - 1), begun)

    def string_at(self, passed: IntScalar) -> tuple[IntScalar, IntScalar, IntScalar]:
        """In the phase after `passed` others: its place among `each`, how many stands
        the string has more than in the first cycle, and 1 while it hangs on the hook,
        else 0."""
        passed = jnp.minimum(passed, self.total - 1)
        place = self.place(passed)
        hanging = np.asarray([phase.string_on_hook for phase in self.each]).astype(
            np.int32
        )
        is_current = jnp.arange(len(self.each), dtype=jnp.int32) == place
        return (
            place,
            self.stands_at(passed),
            jnp.sum(jnp.where(is_current, hanging, 0)).astype(jnp.int32),
        )

    def ended(self, number: int) -> Ended:
        """The phase with a number from 0 over all cycles, for people."""
        group = next(group for group in self._groups if number < group.end)
        cycle, i = divmod(number - group.begin, group.length)
        phase = self.each[group.first + i]
        return Ended(
            phase.name, group.first + i + 1, group.cycle + cycle + 1, phase.until.words
        )

    def faults_of_presence(self, path: str) -> Faults:
        return (
            []
            if self.phases
            else [
                Fault(f"{path}.phases", "has no phase", f"{_FORMS}, each with a lever")
            ]
        )

    def faults(self, path: str) -> Faults:
        faults = Issues()
        for i, phase in enumerate(self.phases):
            if isinstance(phase.until, AtStop):
                hint = '"rest", with as many phases as there are stops'
                faults.add(
                    f"{path}.phases[{i}].until", "a number of stops ends no phase", hint
                )
        return faults


class _Table(NamedTuple):
    """Straight lines of all phases behind each other, one entry for each piece:
    `base + slope (τ − start)`, `τ < end`; which phase it belongs to, and which of its
    pieces it is."""

    lines: Float[Array, "3 n"]  # base, start, slope
    end: Float[Array, " n"]
    owner: Int[np.ndarray, " n"]
    piece: Int[np.ndarray, " n"]


def _is_line(lever: AbstractProfile) -> TypeGuard[PiecewiseLinear]:
    """Whether it stands in the table: straight lines between a few points."""
    return type(lever) is PiecewiseLinear and np.size(lever.times) <= FEW


def _table(phases: Sequence[Phase]) -> _Table:
    columns: list[tuple[Array, ...]] = []
    for phase in phases:
        lever = phase.lever
        zero = jnp.zeros(1)
        inf = jnp.full(1, jnp.inf)
        if _is_line(lever):
            times = jnp.asarray(lever.times, jnp.float64)
            values = jnp.asarray(lever.values, jnp.float64)
            start = jnp.append(times[:1], times)
            base = jnp.append(values[:1], values)
            span = jnp.diff(start, append=times[-1:])
            rise = jnp.diff(base, append=values[-1:])
            slope = jnp.where(span > 0, rise / jnp.where(span > 0, span, 1.0), 0.0)
            columns.append((base, start, slope, jnp.append(times, jnp.inf)))
        else:
            level = (
                jnp.reshape(jnp.asarray(lever.level, jnp.float64), 1)
                if type(lever) is Constant
                else zero
            )
            columns.append((level, zero, zero, inf))
    sizes = [column[0].shape[0] for column in columns]
    *lines, end = (jnp.concatenate(each) for each in zip(*columns, strict=True))
    owner = np.repeat(np.arange(len(phases), dtype=np.int32), sizes)
    piece = np.concatenate([np.arange(size, dtype=np.int32) for size in sizes])
    return _Table(jnp.stack(lines), end, owner, piece)


class PhaseNow(NamedTuple):
    """The lever of the phase that runs: what a profile is, in the time of the run, on
    the pieces of the phase."""

    whole: Phases
    passed: IntScalar
    begun: ScalarArray

    @property
    def number(self) -> IntScalar:
        """Place of the phase among `Phases.each`."""
        return self.whole.place(self.passed)

    @property
    def here(self) -> Bool[Array, " phases"]:
        """Which phase it is."""
        return jnp.arange(len(self.whole.each), dtype=jnp.int32) == self.number

    @property
    def _table(self) -> _Table:
        return _table(self.whole.each)

    @property
    def _others(self) -> list[tuple[Array, AbstractProfile]]:
        """Levers that are not in the table, and whether each is the one now."""
        levers = [phase.lever for phase in self.whole.each]
        others = [
            (i, lever)
            for i, lever in enumerate(levers)
            if not (_is_line(lever) or type(lever) is Constant)
        ]
        return [(self.number == i, lever) for i, lever in others]

    def of_each(self, values: Sequence[Any]) -> Array:
        """The value of the phase that runs."""
        return jnp.sum(
            jnp.where(
                self.here, jnp.stack([jnp.asarray(value) for value in values]), 0.0
            )
        )

    def _piece(self, table: _Table, piece: Piece) -> Bool[Array, " n"]:
        return (table.owner == self.number) & (table.piece == piece)

    def _along(
        self, value: Array, of: Callable[[AbstractProfile, Array], Any], t: Array
    ) -> Array:
        """`value`, or where another lever runs what is `of` it, at its own time."""
        for now, lever in self._others:
            value = jnp.where(
                now, of(lever, jnp.where(now, t - self.begun, 0.0)), value
            )
        return value

    def value(self, t: Array, piece: Piece) -> Array:
        table = self._table
        # (by one sum of all three: each reduction costs time)
        base, start, slope = jnp.unstack(
            jnp.sum(jnp.where(self._piece(table, piece), table.lines, 0.0), axis=1)
        )
        line = base + slope * (t - self.begun - start)
        return self._along(line, lambda lever, local: lever.value(local, piece), t)

    def next_knot(self, piece: Piece) -> Array:
        table = self._table
        end = jnp.sum(jnp.where(self._piece(table, piece), table.end, 0.0))
        return self.begun + self._along(
            end, lambda lever, _: lever.next_knot(piece), self.begun
        )

    def first_piece(self, t: Array) -> IntScalar:
        table = self._table
        passed = jnp.sum(
            (table.owner == self.number) & (table.end <= t - self.begun)
        ).astype(jnp.int32)
        return self._along(
            passed,
            lambda lever, local: jnp.asarray(lever.first_piece(local), jnp.int32),
            t,
        )

    def is_settled(self, t: Array) -> Mark:
        local = t - self.begun
        last = self.passed == self.whole.total - 1
        turned = jnp.stack(
            [jnp.asarray(phase.lever.is_settled(local)) for phase in self.whole.each]
        )
        return last & jnp.any(self.here & turned)

    # --- levers that control the speed -----------------------------------------------

    @property
    def controls_speed(self) -> bool:
        return self.whole.controls_speed

    def _of_speed(self, of: Callable[[Any], Any]) -> Array:
        levers = [phase.lever for phase in self.whole.each]
        return self.of_each(
            [of(lever) if lever.controls_speed else 0.0 for lever in levers]
        )

    def follows(self, piece: Piece) -> Mark | bool:
        return self.controls_speed and (
            self._of_speed(lambda lever: jnp.where(lever.follows(piece), 1.0, 0.0)) > 0
        )

    @property
    def corrects_position(self) -> bool:
        return self.whole.corrects_position

    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Array:
        local = jnp.asarray(t) - self.begun
        return self._of_speed(
            lambda lever: lever.wanted_torque(
                local, omega, piece, load, inertia, turned
            )
        )

    def greatest(self) -> Array:
        return self._of_speed(lambda lever: lever.greatest())

    def holding(self, torque: Array, gain: Array) -> Array:
        return held_within(torque, gain, self.greatest())


def levers_of(lever: AbstractProfile | Phases) -> list[AbstractProfile]:
    """The levers of all phases of a duty, or its only one."""
    return (
        [phase.lever for phase in lever.each] if isinstance(lever, Phases) else [lever]
    )


def of_running(
    now: Any, t: Array, find: Callable[[AbstractProfile, Array], Any]
) -> Array:
    """`find(lever, t)` of the only lever of a duty, or of that of the phase that runs,
    at its own time."""
    if not isinstance(now, PhaseNow):
        return jnp.asarray(find(now, t))
    local = t - now.begun
    return now.of_each([find(phase.lever, local) for phase in now.whole.each])


class PhaseEnd(NamedTuple):
    """The time at which the phase that runs ends, as the time breakpoint of a profile;
    `inf` of one that ends with something else."""

    now: PhaseNow

    def next_knot(self, piece: Piece) -> Array:
        ends = [phase.until for phase in self.now.whole.each]
        lasts = [
            end.duration if isinstance(end, AfterTime) else jnp.inf for end in ends
        ]
        return self.now.begun + jnp.sum(
            jnp.where(self.now.here, jnp.stack([jnp.asarray(x) for x in lasts]), 0.0)
        )


def held_within(torque: Array, gain: Array, greatest: Array) -> Array:
    """Slack tension (N) for a brake torque (N·m) and the torque per newton of it (m), 0
    … `greatest`."""
    grips = gain > 0
    return jnp.where(
        grips, clipped(torque / jnp.where(grips, gain, 1.0), 0.0, greatest), greatest
    )
