"""A rig's log replayed on a scene: temperatures, wear and margins of its brake over the
recorded trip."""

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError, input_error
from .._base._numbers import digits, number
from .._base._retired import answers
from .._base._table import Column, Table, Tabular, frozen, plain
from ..loads import AbstractHookLoad, Motor, RecordedLoad, RecordedMotion
from ..outputs.metrics import HOT
from ..parts.scene import Initial, Scene, require_scene
from ..phases import levers_of
from ..physics.mechanism import holds
from ..profiles import PiecewiseLinear
from ..runs.result import Result
from ..runs.simulate import Progress, Report, simulate
from ..runs.verdict import Verdict
from ..shaft import AbstractAuxiliaryBrake, TackleLoss
from ._found import LOADS, Lowering, Lowerings, column_of, in_seconds
from ._ledger import Ledger, faults_of_settings, ledger, refusal, shares_of
from ._log import Channel, Log
from ._lowerings import lowerings, spans_of
from ._works import Course, course_of

#: acceleration of the hook (m/s²) below which its load is that of the weight; share by
#: which readings are off, and time (s) for which they are, where the weight has changed
_QUIET = 0.5
_CHANGED = 0.02
_LASTS = 3.0
#: update intervals within which a height that stays the same in a motion may have been
#: read late
_LATE = 2.05
#: points of motion and load have places for a power of this, and at least so many: logs
#: share a program
_PLACES = 4
_FEWEST = 64
#: least time (s) that a change of speed takes, at most this share of the time between
#: two updates
_SOON = 0.5
_SHARE = 0.25
#: share of its last line that the brake alone stops a lowering in, without the motor,
#: and the share of that by which it aims below 0: a pulley that still slid when the
#: lever is pulled would show the tension of that pull
_LEFT = 0.02
_BEYOND = 0.5
#: times at which a run is looked at in one series, which has many columns
_AT_ONCE = 1 << 14


# --- the reconstruction -------------------------------------------------------------


class Motion(NamedTuple):
    """One motion between two rests: heights (m) at its updates `t` (k,) (s), and the
    lowering that it is, if any."""

    t: np.ndarray
    height: np.ndarray
    lowering: Lowering | None = None


@frozen
class Reconstruction:
    """The motion of the drum and the load on the hook that a replay takes from a log.

    - `t` (n,): updates of the height in motions, a point between two of them, and where
      a lowering comes to rest
    - `angle`, `speed` (n,): of the drum since the first row (rad, rad/s), positive
      downwards; straight lines of the speed, so that the angle is a parabola between
      two points, monotone in each motion, and meets each update
    - `skipped` (n,): by what the block of the log is lower (m) than that of the replay,
      after noise at rest and jumps of the encoder
    - `hook`: masses by the quiet readings of the load, and when each begins
    - `load`: its readings
    """

    t: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    skipped: np.ndarray
    hook: RecordedLoad
    load: Course
    motions: tuple[Motion, ...]

    def row(self, t: np.ndarray) -> np.ndarray:
        """The last point up to a time."""
        return np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.t.size - 1)

    def angle_at(self, t: np.ndarray) -> np.ndarray:
        """Angle of the drum (rad)."""
        i = np.minimum(self.row(t), self.t.size - 2)
        since = np.clip(t - self.t[i], 0.0, self.t[i + 1] - self.t[i])
        slope = self.slope[i]
        return self.angle[i] + (self.speed[i] + 0.5 * slope * since) * since

    @property
    def slope(self) -> np.ndarray:
        """Acceleration of the drum (rad/s²) after each point."""
        span = np.diff(self.t, append=self.t[-1])
        rise = np.diff(self.speed, append=0.0)
        return np.divide(rise, span, out=np.zeros(span.size), where=span > 0)

    def hook_work(self, begin: float, end: float) -> float:
        """`∫F dx` (J) between two times, the load in straight lines between its
        readings."""
        knots = np.concatenate(
            [[begin, end], *(t[(t > begin) & (t < end)] for t in (self.t, self.load.t))]
        )
        knots = np.unique(knots)
        t = np.stack([knots[:-1], 0.5 * (knots[1:] + knots[:-1]), knots[1:]])
        x = np.asarray(self.hook.travelled(self.angle_at(t)))
        force = self.load.at(t)
        first, last = np.diff(x, axis=0)
        # (the product of two straight lines, by Simpson's rule)
        rates = np.stack([3 * first - last, 4 * (first + last), 3 * last - first])
        return float(np.sum(force * rates) / 6)


def _from(at: float, h: np.ndarray, room: float) -> np.ndarray:
    """Monotone heights (k,) of a motion from the height `at` of the replay's block on,
    up to that of the log.

    The motion is longer or shorter by what the replay has skipped: by the `room` (m) at
    most, so that a jump of the encoder moves nothing; a hoisting by any way shorter, as
    after a lowering that is left out.
    """
    up = h[-1] > h[0]
    lift = at - h[0]
    if lift < -room or (lift > room and not up):
        return h
    return np.append(at, (np.maximum if up else np.minimum)(h[1:], at))


def _slow(
    t: np.ndarray, h: np.ndarray, limits: Mapping[str, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Points of what lies between two motions: from where it leaves its first height to
    where it reaches its last one, one each `heave`."""
    heave = limits["heave"]
    ends = h[[0, -1]]
    down = h[-1] < h[0]
    first = int(np.flatnonzero(np.abs(h - ends[0]) < 0.1 * heave)[-1])
    until = first + int(np.flatnonzero(np.abs(h[first:] - ends[1]) < 0.1 * heave)[0])
    between = np.clip(h[first + 1 : until], *np.sort(ends))
    t = t[first : until + 1]
    h = np.concatenate([ends[:1], between, ends[1:]])
    h = (np.minimum if down else np.maximum).accumulate(h)
    each = np.unique((np.abs(h - h[0]) / heave).astype(int), return_index=True)[1]
    points = np.union1d(each, h.size - 1)
    if np.max(np.abs(np.diff(h[points]))) > limits["jump"]:  # (a reading far off)
        points = np.array([0, h.size - 1])
    return t[points], h[points]


def _motions(found: Lowerings, height: Course, load: Course) -> Iterator[Motion]:
    """Monotone motions in the order of time: lowerings, hoistings, and what lies
    between them beyond the noise."""
    limits = found.thresholds
    heave = found.thresholds["heave"]
    down, up = spans_of(found, height, load)
    known = dict(zip(down, found.lowerings, strict=True))
    end = height.t.size - 1
    last = 0
    at = height.value[0]
    for a, b in [*sorted([*down, *up]), (end, end)]:
        begin = max(a, last)
        h = height.value[last : begin + 1]
        ends = _from(at, h[[0, -1]], heave)
        if abs(ends[1] - ends[0]) > heave:
            t, h = _slow(height.t[last : begin + 1], np.append(ends[0], h[1:]), limits)
            if np.all(np.abs(np.diff(h)) < limits["fastest"] * np.diff(t)):
                yield Motion(t, h)
                at += h[-1] - h[0]
        last = max(last, b)
        t = height.t[begin : last + 1]
        h = height.value[begin : last + 1]
        if t.size < 2:
            continue
        step = np.abs(np.diff(h))
        jumps = step.max() > max(limits["jump"], 0.9 * abs(h[-1] - h[0]))
        if not jumps and np.max(step / np.diff(t)) <= limits["fastest"]:
            h = (np.minimum if h[-1] < h[0] else np.maximum).accumulate(h)
            h = h if (a, b) in known else _from(at, h, heave)
            # no rest where a height was only read late
            still = np.append(False, np.diff(h) == 0)
            late = still[1:-1] & ~still[2:] & ~still[:-2]
            late &= t[2:] - t[:-2] <= _LATE * height.interval
            read = np.concatenate([[True], ~late, [True]])
            yield Motion(t[read], h[read], known.get((a, b)))
            at += h[-1] - h[0]


def _points(t: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and speeds of straight lines that lead from rest to rest through rising
    angles (k,).

    The speed at an update is the mean of the chords beside it, weighted as in a
    parabola, within limits that keep changes of speed from being too short: it is that
    of a chord which is the fastest around, and at most so many times its difference
    from the slower neighbour above any (as of Colella and Woodward, *J. Comput. Phys.*
    54, 1984). Of the two lines along a chord one is level, at the speed of its update,
    as far as it goes, so that neither is above both ends (Schumaker, *SIAM J. Numer.
    Anal.* 20, 1983).
    """
    span = np.diff(t)
    chord = np.diff(angle) / span
    soon = np.minimum(_SOON / span, _SHARE)
    steep = 1 / soon - 0.5
    beside = np.stack([np.append(0.0, chord[:-1]), np.append(chord[1:], 0.0)])
    least = chord - steep * np.maximum(np.max(beside, axis=0) - chord, 0.0)
    most = chord + np.maximum(steep * (chord - np.min(beside, axis=0)), chord)
    mean = (chord[1:] * span[:-1] + chord[:-1] * span[1:]) / (span[1:] + span[:-1])
    mean = np.maximum(mean, np.maximum(least[1:], least[:-1]))
    mean = np.minimum(mean, np.minimum(most[1:], most[:-1]))
    first = np.append(0.0, mean)
    last = np.append(mean, 0.0)
    rise = last - first
    level = np.full(span.size, 0.5)
    np.divide(2 * chord - first - last, rise, out=level, where=rise != 0)
    share = np.clip(np.where(level > 0, 1 - level, -level), soon, 1 - soon)
    between = 2 * chord - share * first - (1 - share) * last
    between = np.maximum(np.round(between, 9), 0.0)  # (0 at rest, not 1e-17)
    times = np.append(np.stack([t[:-1], t[:-1] + share * span], axis=1), t[-1])
    return times, np.append(np.stack([first, between], axis=1), 0.0)


def _levels(t: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Levels of readings, and when each begins: a new one where they are off on the
    same side for some time.

    What is off for less, as while a load gets faster, is in no level.
    """
    least = 0.02 * np.max(np.abs(x))
    total = x[0]
    count = 1
    members = [[0]]
    off = list[int]()
    side = False
    for i, value in enumerate(x.tolist()[1:], 1):
        mean = total / count
        if abs(value - mean) <= _CHANGED * max(mean, least):
            members[-1].append(i)
            total += value
            count += 1
            off = []
            continue
        off = [*(off if (value > mean) == side else ()), i]
        side = value > mean
        if len(off) > 1 and t[i] - t[off[0]] >= _LASTS:
            members.append(off)
            total = np.sum(x[off])
            count = len(off)
            off = []
    levels = [np.median(x[of]) for of in members]
    return np.asarray(
        [0.0, *(0.5 * (t[of[0]] + t[of[0] - 1]) for of in members[1:])]
    ), np.maximum(levels, 0.0)


def _filled(x: np.ndarray, end: float | None = None) -> np.ndarray:
    """Values up to a common size: the last one repeated, or times after the `end` of
    the run."""
    size = _FEWEST
    while size < x.size:
        size *= _PLACES
    more = size - x.size
    return np.append(
        x, np.full(more, x[-1]) if end is None else end + np.arange(1.0, more + 1)
    )


def reconstruct(found: Lowerings, hook: AbstractHookLoad) -> Reconstruction:
    """The motion and the load of a log, on the drum and the rope of a `hook`.

    The rope is on the drum with all its turns (`RopeLayers.turns`) where the block is
    at its highest.
    """
    log = found.log
    height = course_of(log.position, found.thresholds["spacing"])
    load = course_of(log["hook_load"])
    motions = tuple(_motions(found, height, load))
    travels = list[np.ndarray]()
    depth = 0.0
    for motion in motions:
        travels.append(depth + motion.height[0] - motion.height)
        depth = travels[-1][-1]
    highest, lowest = (f([0.0, *(f(x) for x in travels)]) for f in (min, max))
    per_radian = float(hook.travel())
    rope = hook.rope
    if rope is None:
        angles = [x / per_radian for x in travels]
    else:
        turns = rope.turns
        grid = np.unique(np.append(np.arange(0.0, turns, rope.turns_per_layer), turns))[
            ::-1
        ]
        paid = np.asarray(hook.travelled(2 * np.pi * (turns - grid)))
        if lowest - highest > paid[-1]:
            far, most = (number(x, "m", count=4) for x in (lowest - highest, paid[-1]))
            # turns on top of these pay out as much as the uppermost, or more
            missing = (lowest - highest - paid[-1]) / float(hook.travelled(2 * np.pi))
            enough = np.ceil(turns + missing)
            hint = f"give those on the drum with the block at its highest; {enough:.0f} would do"
            raise input_error(
                "duty.load.rope.turns",
                f"pay out {most} of the hook, the log has {far}",
                hint,
            )
        rope = dataclasses.replace(rope, turns=np.interp(-highest, paid, grid))
        left = [np.interp(x - highest, paid, grid) for x in travels]
        angles = [2 * np.pi * (rope.turns - x) for x in left]
    points = [np.zeros((4, 1))]  # t, angle, speed, skipped
    for motion, travel, turned in zip(motions, travels, angles, strict=True):
        off = height.value[0] - motion.height[0] - travel[0]
        # (from rest to rest, also between pauses in a motion)
        for a, b in np.flatnonzero(
            np.diff(np.diff(turned) != 0, prepend=False, append=False)
        ).reshape(-1, 2):
            until = motion.t[a : b + 1].copy()
            way = np.sign(turned[b] - turned[a])
            if way > 0:  # (the lever is pulled before a hoisting begins)
                until[-1] -= _LEFT * (until[-1] - until[-2])
            times, speeds = _points(until, way * turned[a : b + 1])
            speeds = way * speeds
            if way > 0:  # (the rest of a lowering is left to the brake)
                i = np.flatnonzero(speeds)[-1]
                left = _LEFT * np.array([1, -_BEYOND])
                ends = times[i + 1] - left * (times[i + 1] - times[i])
                times = np.concatenate([times[: i + 1], ends, ends[1:], motion.t[[b]]])
                speeds = np.concatenate([speeds[: i + 1], left * speeds[i], [0.0, 0.0]])
            along = turned[a] + np.append(
                0.0, np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))
            )
            first = int(times[0] <= points[-1][0, -1])
            points.append(
                np.stack([times, along, speeds, np.full(times.size, off)])[:, first:]
            )
    last, turned, _, off = points[-1][:, -1]
    if last < log.t[-1]:
        points.append(np.array([[log.t[-1], turned, 0.0, off]]).T)
    t, angle, speed, skipped = np.concatenate(points, axis=1)
    shared = {
        name: getattr(hook, name)
        for name in ("drum_radius", "line_count", "gravity", "drag")
    }
    still = RecordedLoad([0.0], [0.0], **shared, rope=rope)
    path = Reconstruction(t, angle, speed, skipped, still, load, motions)
    rate = per_radian * path.slope[path.row(load.t)]
    quiet = np.abs(rate) < _QUIET
    for motion in motions:  # all readings of one that is never quiet
        inside = (load.t >= motion.t[0]) & (load.t <= motion.t[-1])
        quiet |= inside & (np.count_nonzero(quiet & inside) < 2)
    gravity = shared["gravity"]
    begins, masses = _levels(
        load.t[quiet],
        load.value[quiet] / (gravity - np.minimum(rate, 0.5 * gravity)[quiet]),
    )
    hook = RecordedLoad(_filled(begins, t[-1]), _filled(masses), **shared, rope=rope)
    return dataclasses.replace(path, hook=hook)


# --- the scene of a replay ----------------------------------------------------------


def _tensions(scene: Scene) -> tuple[float, float]:
    """Largest slack tensions (N) of the levers of a scene that hold the speed, and of
    those that are pulled."""
    levers = levers_of(scene.lever)
    held, pulled = (
        max(
            (float(x.scale()) for x in levers if x.controls_speed == which), default=0.0
        )
        for which in (True, False)
    )
    # (one for the other as in a programme in words)
    return held or 2 * pulled, pulled or 0.5 * held


def settings_of(scene: Scene, log: Log) -> dict[str, Any]:
    """What a scene says of tackle and drum, as arguments of `ledger`; lines strung only
    where the log has none."""
    hook = scene.duty.load
    if not isinstance(hook, AbstractHookLoad):
        return {}
    tackles: list[Any] = [law for law in scene.torques if isinstance(law, TackleLoss)]
    efficiency = float(tackles[0].lowering_efficiency) if tackles else 1.0
    known: dict[str, Any] = {"efficiency": max(efficiency, 1e-3)}
    if not hook.rope:
        known["drum_radius"] = float(hook.drum_radius)
    if "lines_strung" not in log.channels:
        known["lines"] = float(hook.line_count)
    return known


def _motor(scene: Scene, path: Reconstruction, notes: list[str]) -> Motor:
    """The motor of the scene, or one that gives what the motion asks for."""
    fastest = max(np.max(np.abs(path.speed)), 1.0)
    if scene.motor is not None:
        most = float(scene.motor.max_speed)
        if fastest > most:
            high, limit = (number(x, "rad/s", count=3) for x in (fastest, most))
            notes.append(
                f"the drum turns at up to {high}, the motor of the scene at {limit}: "
                "this limit is left out"
            )
        return dataclasses.replace(
            scene.motor, speed=None, max_speed=max(fastest, most)
        )
    notes.append(
        "the scene has no motor: one without limits hoists; for the brake that is time to cool"
    )
    mass = np.max(path.hook.masses)
    per_radian = float(path.hook.travel())
    inertia = scene.brake.inertia + mass * per_radian**2
    torque = 4 * (
        mass * path.hook.gravity * per_radian + inertia * np.max(np.abs(path.slope))
    )
    return Motor(torque, torque * fastest, fastest)


def _scene_of(
    scene: Scene,
    found: Lowerings,
    path: Reconstruction,
    shares: Mapping[str, float | None],
    notes: list[str],
) -> Scene:
    """The scene with lever, load and motor of the reconstruction."""
    share = np.zeros(path.t.size)
    alone = np.append(path.speed[1:], 0.0) < 0  # (the brake, before a rest)
    for t, _, lowering in path.motions:
        kind = (
            LOADS[found.load[np.searchsorted(found.log.t, 0.5 * (t[0] + t[-1]))]]
            if lowering is None
            else lowering.kind
        )
        inside = (path.t >= t[0]) & (path.t < t[-1]) & ~alone
        share[inside] = shares.get(kind) or 0.0
    speed = PiecewiseLinear(_filled(path.t, path.t[-1]), _filled(path.speed))
    lever = RecordedMotion(
        speed, _filled(path.angle), *_tensions(scene), _filled(share)
    )
    shaft = tuple(
        law for law in scene.shaft if not isinstance(law, AbstractAuxiliaryBrake)
    )
    if len(shaft) < len(scene.shaft):
        notes.append(
            "auxiliary brakes on the shaft are left out: auxiliary= is their share of "
            "what is lowered"
        )
    if scene.duty.load.elastic is not None:
        notes.append("the rope is taken as rigid")
    if scene.duty.load.ropes(0.0, 0) is not None:
        notes.append("the rope is taken as without weight")
    duty = dataclasses.replace(
        scene.duty, **{scene.duty.lever_field: lever, "load": path.hook, "wants": ""}
    )
    motor = _motor(scene, path, notes)
    return dataclasses.replace(
        scene,
        duty=duty,
        initial=Initial(0.0),
        end_time=path.t[-1],
        shaft=shaft,
        motor=motor,
    )


# --- what it says -------------------------------------------------------------------


@frozen
class ReplayedLowering:
    """One lowering in a replay, SI units; `None` after the end of a run that failed.

    - `recorded_travel`, `recorded_work`: of the reconstruction
    - `travel`, `hook_work`: of the simulation, with their
      deviations as shares of it
    - `friction_heat` of the brake, and the hottest that its parts are (K, by metric),
      up to the next lowering
    """

    lowering: Lowering
    recorded_travel: float
    recorded_work: float
    travel: float | None = None
    travel_deviation: float | None = None
    hook_work: float | None = None
    work_deviation: float | None = None
    friction_heat: float | None = None
    hottest: Mapping[str, float] = dataclasses.field(default_factory=dict)


@frozen
class Replay(Tabular):
    """A log replayed on a scene: `result` is that of a run as any other, `lowerings`
    what is in each of them.

    - `book`: the ledger of the log;  `path`: the reconstruction that the run follows
    - `bound`: the same run with the auxiliary brake or motor out, `None` where no share
      of them is assumed
    - `settings`: share of the motor, tensions of the lever;  `notes`: to be read
    """

    book: Ledger
    path: Reconstruction
    result: Result
    lowerings: tuple[ReplayedLowering, ...]
    bound: Result | None
    settings: dict[str, Any]
    notes: tuple[str, ...]

    @functools.cached_property
    def verdict(self) -> Verdict:
        """The verdict on the run, that of `result.verdict()`."""
        return self.result.verdict()

    @functools.cached_property
    def bound_verdict(self) -> Verdict | None:
        """The verdict on the upper bound, `None` where no share is assumed."""
        return None if self.bound is None else self.bound.verdict()

    @property
    def hottest(self) -> ReplayedLowering | None:
        """The lowering with the highest temperature of the rim (else of another part,
        else with the most heat)."""
        done = [
            lowering
            for lowering in self.lowerings
            if lowering.friction_heat is not None
        ]
        place = next(iter(done[0].hottest), None) if done else None
        return max(
            done,
            key=lambda lowering: (
                lowering.hottest[place] if place else lowering.friction_heat
            ),  # pyright: ignore
            default=None,
        )  # pyright: ignore

    @property
    def answer(self) -> tuple[str, ...]:
        """What a crew asks: the hottest lowering, the verdict with the smallest margin,
        how well it follows the log."""
        most = self.hottest
        if most is None:
            return (f"the run failed before the first lowering: {self.result.message}",)
        temperatures = [
            f"{HOT[name]} {number(x, 'K', count=3)}" for name, x in most.hottest.items()
        ]
        when = (
            in_seconds(most.lowering.start)
            if most.lowering.start
            else f"{digits(most.lowering.begin, 6)} s"
        )
        heat = f"{number(most.friction_heat, 'J', count=3)} in the brake"
        words = ", ".join([heat, *temperatures, *most.lowering.flags])
        verdict = self.verdict
        margin = "no margin"
        if verdict.rows:
            least = verdict.rows[0]
            margin = f"smallest margin: {least.name}, {least.margin}"

        def largest(name: str) -> str:
            each = [getattr(lowering, name) or 0.0 for lowering in self.lowerings]
            return f"{100 * np.max(np.abs(each)):.2g} %"

        return (
            f"hottest lowering: {when}, {words}",
            f"{verdict.colour} {verdict.reason}: {verdict.sentence}; {margin}",
            *self.upper_bound,
            f"simulated against recorded: travel {largest('travel_deviation')}, "
            f"hook work {largest('work_deviation')} at most in a lowering",
        )

    @property
    def upper_bound(self) -> tuple[str, ...]:
        """Heat and temperatures without the assumed share of auxiliary brake or motor,
        in words; empty without one."""
        if self.bound is None or self.bound_verdict is None:
            return ()
        taken, most = (
            number(run.energy["friction_heat"], "J", count=3)
            for run in (self.result, self.bound)
        )
        hot = [
            f"{HOT[name]} up to {number(self.bound[name], 'K', count=3)}"
            for name in self.lowerings[0].hottest
        ]
        words = ", ".join(
            [f"{most} in the friction brakes", *hot, self.bound_verdict.colour]
        )
        return (
            "upper bound, by a second run with the auxiliary brake or motor out: "
            f"{words}: {self.bound.status}; with the assumed share {taken}",
        )

    @property
    def table(self) -> Table:
        """A row for each lowering."""
        heats = list(self.lowerings[0].hottest) if self.lowerings else []
        columns = [
            *map(column_of, ("start", "begin", "kind", "recorded_travel", "travel")),
            Column("travel_deviation", show=".2e"),
            *map(column_of, ("recorded_work", "hook_work")),
            Column("work_deviation", show=".2e"),
            column_of("friction_heat"),
            *(Column(name, "K", show=".4g") for name in heats),
            column_of("flags"),
        ]
        rows = []
        for lowering in self.lowerings:
            known = {**vars(lowering.lowering), **vars(lowering), **lowering.hottest}
            rows.append({column.name: known.get(column.name) for column in columns})
        return Table(columns, rows)

    @property
    def readable(self) -> Table:
        """The same for reading."""
        first = "start" if self.book.lowerings.log.start else "begin"
        names = (column.name for column in self.table.columns)
        return self.table.readable(
            first,
            *(x for x in names if x not in ("start", "begin")),
            title="replayed on the scene",
        )

    def parts(self) -> Iterator[str | Table]:
        yield from self.answer
        yield from self.book.answer
        yield self.readable
        limit, pull = (
            number(self.settings[x], "N", count=4) for x in ("limit", "pull")
        )
        given = self.settings["auxiliary"]
        shares = given.items() if isinstance(given, Mapping) else [("", given or 0.0)]
        share = ", ".join(
            f"{digits(x or 0.0, 4)} {kind}".rstrip() for kind, x in shares
        )
        yield (
            f"replay: share of the auxiliary brake {share}; tension that the lever gives: "
            f"{pull} at rest, at most {limit} in lowering"
        )
        yield from (f"- {note}" for note in self.notes)
        yield from list(self.book.parts())[len(self.book.answer) :]

    def as_dict(self) -> dict[str, Any]:
        """The ledger, and below `replay` the run: the place of the `hottest` lowering,
        `metrics`, all in SI units."""
        most = self.hottest
        replay = {
            **_of_run(self.result, self.verdict),
            "hottest": None if most is None else self.lowerings.index(most),
            "lowerings": self.table,
            "bound": None
            if not (self.bound and self.bound_verdict)
            else _of_run(self.bound, self.bound_verdict),
            "settings": self.settings,
            "notes": self.notes,
        }
        return {**self.book.as_dict(), "replay": plain(replay)}

    __getattr__ = staticmethod(
        answers(
            "Replay",
            gone={"write": "simbrake.pages.write_ledger(replay, folder) writes it"},
        )
    )


def _of_run(result: Result, verdict: Verdict) -> dict[str, Any]:
    """What a replay says of a run in JSON."""
    known = {
        "code": int(result.code),
        "status": result.status,
        "metrics": result.metrics,
        "energy": result.energy,
    }
    return {**known, "verdict": verdict.as_dict()}


def _largest_distance(path: Reconstruction, result: Result) -> tuple[float, float]:
    """Largest distance (m) of the hook from the reconstruction, and when (s)."""
    t = path.t[path.t <= float(result.record.t_end)]
    away = np.abs(
        result.series(t).hook_position
        - np.asarray(path.hook.travelled(path.angle_at(t)))
    )
    return away.max(), t[away.argmax()]


def _replayed(path: Reconstruction, result: Result) -> Iterator[ReplayedLowering]:
    done = [motion.lowering for motion in path.motions if motion.lowering is not None]
    end = float(result.record.t_end)
    spans = [(lowering.begin, lowering.end) for lowering in done]
    inside = [span for span in spans if span[1] <= end]
    from_ = path.hook.times
    knots = [
        np.concatenate([[a], from_[(from_ > a) & (from_ < b)], [b]]) for a, b in inside
    ]
    until = [min(a, end) for a, _ in spans[1:]] + [end]
    heat = np.zeros(0)
    rows = np.zeros((0, 2), int)
    if inside:
        series = result.series(np.concatenate(knots))
        x = np.split(
            np.asarray(series.hook_position), np.cumsum([t.size for t in knots])[:-1]
        )
        ends = np.array([[a, b] for (a, _), b in zip(inside, until, strict=False)])
        heat = np.diff(result.series(ends.ravel()).friction_heat.reshape(ends.shape))[
            :, 0
        ]
        record = result.report()._record
        t = record.rows.t[: record.count + 1]
        rows = np.searchsorted(t, ends - 1e-9 * end)
    maxima = result.report().maxima_between([(int(a), int(b)) for a, b in rows]).between
    hottest = {name: maxima[name] for name in HOT if name in maxima}
    for i, (lowering, (a, b)) in enumerate(zip(done, spans, strict=True)):
        far = float(
            np.diff(np.asarray(path.hook.travelled(path.angle_at(np.array([a, b])))))[0]
        )
        work = path.hook_work(a, b)
        if i >= len(inside):
            yield ReplayedLowering(lowering, far, work)
            continue
        hanging = path.hook.masses[
            np.searchsorted(from_, knots[i][:-1], side="right") - 1
        ]
        own = float(np.sum(hanging * path.hook.gravity * np.diff(x[i])))
        travel = float(x[i][-1] - x[i][0])
        tops = {name: float(tops[i]) for name, tops in hottest.items()}
        yield ReplayedLowering(
            lowering,
            far,
            work,
            travel,
            travel / far - 1,
            own,
            own / work - 1,
            float(heat[i]),
            tops,
        )


def _faults_of_replay(
    scene: Scene, hook: AbstractHookLoad, book: Ledger
) -> Iterator[Fault]:
    """Why a log cannot be replayed on a scene."""
    found = book.lowerings
    log = found.log
    lines = float(hook.line_count)
    strung = book.settings["lines"]
    if strung is not None and strung != lines:
        what = f"{digits(lines)} lines are strung, the log has {digits(strung)}"
        yield Fault("duty.load.line_count", what, "give the scene those of the log")
    refused = [words for lowering in found.valid if (words := refusal(log, lowering))]
    if refused:
        hint = "give a height between block and crown: names={'block_position': …}"
        what = f"{len(refused)} of {len(found.valid)} lowerings: {refused[0]}"
        yield Fault(f"{log.source} column {log.position.mnemonic}", what, hint)
    if not found.valid:
        hint = "print sb.rig.lowerings(log)"
        yield Fault(log.source, "has no lowering without flags", hint)
    if not max(_tensions(scene)) > 0:
        hint = "give the tension that holds the load"
        yield Fault(f"duty.{scene.duty.lever_field}", "is never pulled", hint)


def replay(
    of: Log | Lowerings | Ledger,
    scene: Scene,
    *,
    auxiliary: float | Mapping[str, float] | None = None,
    rtol: float = 1e-8,
    progress: Progress | Report | bool | None = False,
) -> Replay:
    """Replay a log on a scene: temperatures, wear, margins over the whole trip,
    hoisting and rests included.

    Recorded are the motion of the drum and the weight on the hook; brake, rope, tackle,
    heat and wear are the scene's:

    - **motion**: the speed of the drum in straight lines through all updates of the
      height in a motion; lever and motor follow it (`RecordedMotion`). Between motions the drum rests; slow
      ways of more than `heave` in between, as in drilling, are one motion. Smaller ones
      are made up for in the next of these or in the next hoisting
    - **weight**: levels of the load in quiet intervals, in which the hook is
      accelerated by less than 0.5 m/s², which is taken off; a new one where readings
      are off by 2 % for 3 s. It gives the masses, and the model the inertia, which is
      in the recorded load already
    - **brake**: the largest tensions of the levers in the scene hold the drum at rest
      (`pull`), and are the `limit` in lowering (one is twice the other where it lacks
      one). In hoisting it is open
    - **motor** of the scene with its limits, else one without limits: it hoists, drives
      a block down that is too light to reach the recorded speed, and takes the share
      `auxiliary` of what is lowered (of a `Ledger` its share), one number or one by
      kind of load. An auxiliary brake counts as such a share, too. Without a share all
      of it is heat of the friction brakes, an upper bound; beside a share, which is an
      assumption, a second run gives this bound (`Replay.bound`)
    - **gaps** of the log: the block moves evenly to where it is after one
    - **rope**: its turns are those on the drum with the block at its highest

    The duty, the start and the end of the scene do not matter but for lines, drum, rope
    and tensions. Runs of logs of about one length share one compiled program.

    - `of`: a log, its lowerings, or its ledger;  `rtol`, `progress`: as of `simulate`

    A run that fails is returned with its code (`Replay.result`). Raises `InputError`
    where the lines strung of log and scene differ, where the height is
    heave-compensated and the heave unknown or above 1 % of a lowering, where nothing is
    lowered, and with all errors of the scene.

    Example:
        >>> import pathlib, tempfile
        >>> t = np.arange(0.0, 120.0, 2.0)
        >>> rows = [f"{a},{b},200\\n" for a, b in zip(t, 30.0 - np.clip(0.5 * t - 20.0, 0.0, 20.0))]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder, "rig.csv")
        ...     _ = file.write_text("Time,BPOS,HKLD\\ns,m,kN\\n" + "".join(rows))
        ...     replay = sb.rig.replay(sb.rig.read(file), scene)
        >>> round(replay.lowerings[0].hook_work / 1e6, 3)
        4.0
    """
    require_scene(scene)
    if isinstance(of, Ledger):
        found = of.lowerings
        if auxiliary is None:
            settings = of.settings
            auxiliary = (
                0.0 if settings["brake"] == "friction" else settings["auxiliary"]
            )
    else:
        found = of if isinstance(of, Lowerings) else lowerings(of)
    faults = faults_of_settings(efficiency=None, brake=None, auxiliary=auxiliary)
    hook = scene.duty.load
    if not isinstance(hook, AbstractHookLoad):
        faults.add(
            "duty.load",
            f"a {type(hook).__name__} has no hook",
            "give lines and drum: `HookLoad`",
        )
        raise InputError(faults)
    of_scene = settings_of(scene, found.log)
    book = of
    if not isinstance(book, Ledger):
        # (a wrong share is reported below, with all other errors)
        book = ledger(found, **of_scene, auxiliary=None if faults else auxiliary)
    faults += _faults_of_replay(scene, hook, book)
    faults.report()
    notes = list[str]()
    efficiency = of_scene["efficiency"]
    of_book = book.settings["efficiency"]
    if of_book and abs(efficiency - of_book) > 1e-3:
        notes.append(
            f"the ledger takes {digits(of_book, 3)} as the efficiency of the tackle, the "
            f"scene {digits(efficiency, 3)}: the work of the friction brakes differs by it"
        )
    if auxiliary is None:
        whole = "the friction brakes take all that is lowered, an upper bound"
        notes.append(
            f"{whole}: auxiliary= is the share of a motor or an auxiliary brake"
        )
    lost = sum(not gap.rest for gap in found.gaps)
    if lost:
        notes.append(
            f"in {lost} gaps of the log the block moves evenly to where it is at their ends: "
            "nothing else is known"
        )
    path = reconstruct(found, hook)
    shares = shares_of(auxiliary)
    own = _scene_of(scene, found, path, shares, notes)
    steps = 1 << int(np.ceil(np.log2(10 * path.t.size + 4096)))

    def run(scene: Scene) -> Result:
        return simulate(
            scene,
            rtol=rtol,
            max_steps=steps,
            max_events=steps,
            throw=False,
            progress=progress,
        )

    result = run(own)
    bound = run(_scene_of(scene, found, path, {}, [])) if any(shares.values()) else None
    for each, words in ((result, ""), (bound, "without the assumed share ")):
        distance, when = (0.0, 0.0) if each is None else _largest_distance(path, each)
        if distance > found.thresholds["heave"]:
            far = f"{words}the hook is up to {number(distance, 'm', count=3)} off the recorded motion"
            notes.append(f"{far}, at {digits(when, 6)} s: lever or motor are too weak")
    settings = {
        "auxiliary": auxiliary,
        "limit": float(own.duty.lever.limit),  # pyright: ignore
        "pull": float(own.duty.lever.pull),  # pyright: ignore
    }
    return Replay(
        book,
        path,
        result,
        tuple(_replayed(path, result)),
        bound,
        settings,
        tuple(notes),
    )


# --- beside the recording -----------------------------------------------------------


class Match(NamedTuple):
    """How well a simulated channel meets the recorded one, in the unit of the log.

    - `count` of recorded updates
    - `coverage`: share of them at which the simulation has a value
    - `rmse`, `bias`: root of the mean square, and mean, of simulated less recorded
      values, `None` without any
    - `within`: share of all updates met within the resolution: of the height 1 % of the
      travel, or a step of the reading; of the load its recorded lowest and highest
      values, else 3 %
    """

    count: int
    coverage: float
    rmse: float | None
    bias: float | None
    within: float


class Compared(NamedTuple):
    """A channel of a log beside its simulation: values (n,) in SI units at its updates
    `t` (n,), NaN after the end.

    - `unit` of the log, which has `factor` SI units
    - `matches` of each lowering, and of all of them together
    """

    unit: str
    factor: float
    t: np.ndarray
    recorded: np.ndarray
    simulated: np.ndarray
    matches: tuple[Match, ...]
    total: Match


@frozen
class Comparison(Tabular):
    """Simulated beside recorded height of the block and load of the hook, in the units
    of the log."""

    replay: Replay
    position: Compared
    load: Compared

    @property
    def table(self) -> Table:
        """A row for each lowering."""
        names = [
            f"{channel}_{name}"
            for channel in ("position", "load")
            for name in Match._fields
        ]
        columns = [column_of("begin"), *(Column(name, show=".4g") for name in names)]
        each = zip(
            self.replay.lowerings, self.position.matches, self.load.matches, strict=True
        )
        return Table(
            columns,
            [
                [replayed.lowering.begin, *position, *load]
                for replayed, position, load in each
            ],
        )

    def parts(self) -> Iterator[str | Table]:
        for name, of in (("position", self.position), ("load", self.load)):
            total = of.total
            off = (
                ()
                if total.rmse is None
                else (
                    f"RMSE {total.rmse:.4g} {of.unit}",
                    f"bias {total.bias:+.3g} {of.unit}",
                )
            )
            shares = (
                f"{100 * total.coverage:.3g} % of {total.count} updates covered, "
                f"{100 * total.within:.3g} % within"
            )
            yield f"{name}: {', '.join([*off, shares])} the resolution"
        yield self.table

    def as_dict(self) -> dict[str, Any]:
        """Matches of each lowering and in total, with their units."""
        channels = {"position": self.position, "load": self.load}
        totals = {
            name: {"unit": of.unit, **of.total._asdict()}
            for name, of in channels.items()
        }
        return plain({**totals, "lowerings": self.table})


def _compared(
    channel: Channel,
    course: Course,
    simulated: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    spans: np.ndarray,
) -> Compared:
    """A channel in the spans (k, n) of the lowerings; `bounds` (n,) of what meets
    it."""

    def match(at: np.ndarray) -> Match:
        own = simulated[at]
        off = (simulated - course.value)[at] / channel.factor
        known = ~np.isnan(own)
        if not known.any():
            return Match(own.size, 0.0, None, None, 0.0)
        rmse = float(np.sqrt(np.mean(off[known] ** 2)))
        bias = float(np.mean(off[known]))
        inside = (own >= bounds[0][at]) & (own <= bounds[1][at])
        return Match(own.size, float(known.mean()), rmse, bias, float(inside.mean()))

    total = match(np.any(spans, axis=0))
    unit = channel.unit or channel.si
    return Compared(
        unit,
        channel.factor,
        course.t,
        course.value,
        simulated,
        tuple(map(match, spans)),
        total,
    )


def _simulated(result: Result, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Travel (m) of the hook and load (N) on it at the times `t` (n,), NaN after the
    end of the run.

    Of a drum at rest the start of a step stands for all times in it, as neither
    changes.
    """
    record = result.record.compact()
    row = record.find(t)
    rests = holds(record.modes)[row] & (t <= float(record.t_end))
    at, back = np.unique(np.where(rests, record.rows.t[row], t), return_inverse=True)
    parts = (
        result.series(x, fill=True)
        for x in np.split(at, range(_AT_ONCE, at.size, _AT_ONCE))
    )
    travel, force = zip(
        *((part.hook_position, part.hook_load) for part in parts), strict=True
    )
    return np.concatenate(travel)[back], np.concatenate(force)[back]


def compare(replay: Replay) -> Comparison:
    """Compare a replay with its log: block position and hook load at their updates in
    lowerings, in the rig's units.

    The simulated height begins with the first of the log, and is lower by what the
    replay skips (noise at rest, jumps of the encoder). The simulated load is that of
    the hook: weight less inertia.
    """
    path = replay.path
    log = replay.book.lowerings.log
    result = replay.result
    height = course_of(log.position, replay.book.lowerings.thresholds["spacing"])
    load = path.load

    def spans(course: Course) -> np.ndarray:
        return np.array(
            [
                (course.t >= x.lowering.begin) & (course.t <= x.lowering.end)
                for x in replay.lowerings
            ]
        )

    travel, force = _simulated(result, np.concatenate([height.t, load.t]))
    block = height.value[0] - path.skipped[path.row(height.t)] - travel[: height.t.size]
    inside = spans(height)
    steps = np.abs(np.diff(height.value))
    travels = np.array([x.recorded_travel for x in replay.lowerings])
    room = np.maximum(0.01 * travels @ inside, np.min(steps[steps > 0]))
    position = _compared(
        log.position, height, block, (height.value - room, height.value + room), inside
    )
    bounds = (
        load.value - 0.03 * np.abs(load.value),
        load.value + 0.03 * np.abs(load.value),
    )
    ends = [log.channels.get(f"hook_load_{end}") for end in ("min", "max")]
    if all(end is not None and end.nulls < end.value.size for end in ends):
        bounds = tuple(
            np.interp(load.t, x.t[~np.isnan(x.value)], x.value[~np.isnan(x.value)])  # pyright: ignore
            for x in ends
        )
    return Comparison(
        replay,
        position,
        _compared(log["hook_load"], load, force[height.t.size :], bounds, spans(load)),  # pyright: ignore
    )
