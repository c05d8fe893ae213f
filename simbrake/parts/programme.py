"""Programmes in words: "lower 27 m at 1.2 m/s", "brake to rest", "hold 40 s", "repeat
30 times"."""

import dataclasses
import difflib
import math
import re
from typing import Annotated, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, Faults, input_error
from .._base._numbers import number
from .._base._part import takes_values
from .._base._quantity import BAD, NumberReader, Quantity, positive
from ..brakes._bands import MultiBandBrake
from ..brakes.design import Brake, unloaded
from ..hoists import AbstractLoad, CounterweightLoad, RopesNow, WindlassLoad
from ..loads import Driller, HookLoad, Motor, StringLoad
from ..phases import (
    AbstractEnd,
    AfterTime,
    AfterTravel,
    AtHeight,
    AtRest,
    Phase,
    Phases,
)
from ..profiles import AbstractProfile, Constant, PiecewiseLinear
from ..shaft import AbstractAuxiliaryBrake, AbstractShaftTorque
from ..thermal.heat import Heat
from ..wear import Wear
from .at_start import sensed_at_start
from .scene import AbstractLimits, Duty, Initial, Scene, banded_brake
from .scene_checks import faults

#: loads that a programme can move
Hoist = HookLoad | CounterweightLoad | WindlassLoad

#: steps by name: an example, and the form of their line
_GRAMMAR = {
    "lower": (
        "lower 27 m at 1.2 m/s",
        re.compile(
            r"lower (?P<distance>.+?) at (?P<speed>.+?)(?: (?P<by>(?:on|with) the auxiliary brake|on the motor))?"
        ),
    ),
    "hoist_back": ("hoist back at 1.2 m/s", re.compile(r"hoist back at (?P<speed>.+)")),
    "hoist": (
        "hoist 27 m at 1.2 m/s",
        re.compile(r"hoist (?P<distance>.+) at (?P<speed>.+)"),
    ),
    "brake": ("brake to rest", re.compile(r"brake to rest")),
    "brake_in": ("brake to rest in 3 s", re.compile(r"brake to rest in (?P<time>.+)")),
    "hold": ("hold 40 s", re.compile(r"(?:hold|wait) (?:for )?(?P<time>.+)")),
    "take": ("take the string", re.compile(r"take the string")),
    "set": (
        "set the string in the slips",
        re.compile(r"set (?:it |the string )?(?:in|into|in the|into the) slips"),
    ),
    "make_up": (
        "make up a stand in 60 s",
        re.compile(r"make up(?: (?:a|the) stand)?(?: in (?P<time>.+))?"),
    ),
    "lay_down": (
        "lay down a stand in 60 s",
        re.compile(r"lay down(?: (?:a|the) stand)?(?: in (?P<time>.+))?"),
    ),
    "turn": (
        "turn the band after 15 cycles",
        re.compile(
            r"turn the band(?: end for end)?(?: after (?P<cycles>\d{1,6}) cycles?)?"
        ),
    ),
    "repeat": ("repeat 30 times", re.compile(r"repeat (?P<count>\d{1,6}) times")),
}
FORMS = tuple(example for example, _ in _GRAMMAR.values())
_QUANTITIES = {
    "distance": positive("m", "distance"),
    "speed": positive("m/s", "speed of the hook"),
    "time": positive("s", "time"),
    "cycles": positive("1", "number of cycles"),
}


class Step(NamedTuple):
    """One line of a programme: its number (from 0), what, its numbers in SI, and by
    what a load is lowered."""

    line: int
    what: str
    numbers: dict[str, float]
    by: str = ""


class Cycle(NamedTuple):
    """The lines up to a `repeat`, and how often they are done."""

    steps: list[Step]
    count: int


def parse_programme(lines: tuple[str, ...] | list[str]) -> list[Cycle]:
    """Cycles of work. Raises `InputError` with every line that cannot be read."""
    reader = NumberReader()
    steps = list[Step]()
    cycles = list[Cycle]()
    for i, line in enumerate(lines):
        line_path = f"programme[{i}]"
        text = " ".join(line.lower().replace("set it", "set").split())
        command = next(
            (
                (what, m)
                for what, (_, form) in _GRAMMAR.items()
                if (m := form.fullmatch(text))
            ),
            None,
        )
        if command is None:
            near = difflib.get_close_matches(text, FORMS, n=1, cutoff=0.3)
            hint = f"nearest: {near[0]}" if near else f"there are: {'; '.join(FORMS)}"
            reader.fault(line_path, f"{line!r} is not understood", hint)
            continue
        what, match = command
        if what == "repeat":
            count = int(match["count"])
            if count < 1:
                reader.fault(
                    line_path, f"{line!r} is not a number of cycles", "at least 1"
                )
            if not steps:
                reader.fault(
                    line_path,
                    f"{line!r} has no line to repeat",
                    "it repeats the lines since the last one",
                )
            cycles = [*cycles, Cycle(steps, count)]
            steps = []
            continue
        numbers = {
            name: reader.number(words, about, line_path, about.unit)
            for name, words in match.groupdict().items()
            if words is not None and (about := _QUANTITIES.get(name))
        }
        if not any(value is BAD for value in numbers.values()):
            values = {name: float(value) for name, value in numbers.items()}
            steps.append(Step(i, what, values, match.groupdict().get("by") or ""))
    cycles = [*cycles, Cycle(steps, 1)] if steps else cycles
    if not any(cycle.steps for cycle in cycles) and not reader.faults:
        reader.fault("programme", "has no step", f"as in {FORMS[0]!r}")
    reader.faults.report()
    return cycles


@takes_values
def programme_scene(
    brake: Brake | MultiBandBrake,
    programme: tuple[str, ...],
    load: AbstractLoad,
    pull: Annotated[float, positive("N", "slack tension with the lever applied")],
    lever_time: Annotated[float, positive("s", "time to apply the lever")] = 0.35,
    acceleration: Annotated[
        float, positive("m/s^2", "acceleration of the hook when it is released")
    ] = 0.5,
    empty: Annotated[
        float, Quantity("kg", "mass of hook and block without the string", 0.0)
    ] = 0.0,
    stand: Annotated[
        float, Quantity("kg", "mass of the stand that each cycle adds", 0.0)
    ] = 0.0,
    limit: Annotated[
        float | None, positive("N", "maximum slack tension while lowering")
    ] = None,
    heat: Heat | None = None,
    wear: Wear | None = None,
    motor: Motor | None = None,
    shaft: tuple[AbstractShaftTorque, ...] = (),
    limits: AbstractLimits | None = None,
) -> Scene:
    """A scene from a programme in words: a list of lines, one cycle of work, perhaps
    repeated, and others after it.

    - `lower D at V`: the hook starts from rest with the `acceleration` and continues at
      the speed `V`, over the distance `D`, run-up included; the braking after it adds
      its own travel. The driller controls the speed (`Driller`), so that fade changes
      the lever force and not the speed. With layers of rope (`HookLoad.rope`) the
      distance is that of the hook, and `V` its speed in the layer of the start: the
      pulley keeps its speed, so that in the layers below the hook is slower by their
      radius
    - `brake to rest`: the slack tension rises to the `pull` in the `lever_time`, and
      stays there until the pulley rests
    - `brake to rest in X`: the driller controls the speed linearly to 0 until the
      pulley rests, over `V X/2`: "lower 25 m at 1.2 m/s" and "brake to rest in 3 s"
      travel 26.8 m together
    - `lower D at V on the auxiliary brake`: with the lever open, by the auxiliary
      brakes of the `shaft`, engaged so far that `V` is the steady speed of the first
      cycle; `… with the auxiliary brake`: they are fully engaged, and the driller takes
      the rest. In all other lines they are disengaged
    - `lower D at V on the motor`: it holds the load back, or drives down a block that
      is too light
    - `hoist D at V`: the `motor` hoists from rest to rest over `D`, with the
      `acceleration` at both ends
    - `hoist back at V`: the same up to where the hook was at the start of the run,
      whatever it travelled
    - `make up a stand in X`, `lay down a stand in X`: at rest; each cycle then has a
      stand more, or fewer
    - `hold X` or `wait X`
    - `take the string`, `set the string in the slips`: between them the string hangs on
      the hook
    - `turn the band after N cycles`: end for end, so that the worn lining of the tight
      end comes to the slack end; for `wear` with equal linings. Without a number it is
      turned at that point of every cycle, at rest
    - `repeat N times`: all lines since the last one; each cycle adds a `stand` to the
      string, where no line says otherwise
    - `load`: a `HookLoad` with all that hangs on the hook in the first cycle, `empty`
      of it without the string; or a `CounterweightLoad` or a `WindlassLoad`, whose car
      or anchor is the hook
    - `limit` (N): maximum slack tension of the driller, twice the `pull` by default; of
      several alike rims (`Brake.rims`) both are the tension of each band, of a
      `MultiBandBrake` the sum of all

    Every line that takes time is a phase (`Phases`): lowering ends with the travel,
    braking with the rest, however long that takes. The run begins at rest under the
    `pull` and ends with the last line; its `end_time`, by which it has to, is twice the
    time that the friction of the start would take. Raises `InputError` with every line
    that is not understood or cannot be done, and with every error of the brake, the
    load or the heat of the scene, such as friction that depends on the temperature
    without heat; and for a brake without a band.
    """
    if not isinstance(brake, Brake | MultiBandBrake):
        raise input_error(
            "brake", f"is a {brake.words.brake}: programmes need a band brake"
        )
    cycles = parse_programme(programme)
    still = _still_scene(brake, load, heat, shaft)
    assert isinstance(load, Hoist)
    steps = {step.what for cycle in cycles for step in cycle.steps}
    takes = "take" in steps
    hook = load
    if takes:
        if not isinstance(load, HookLoad):
            what = f"{type(load).__name__} has no string to set down"
            raise input_error("load", what, "give a HookLoad")
        hook = _on_string(load, empty, stand)
    limit = 2 * pull if limit is None else limit
    plan = _Plan(
        still,
        load,
        motor,
        pull,
        lever_time,
        acceleration,
        limit,
        empty if takes else None,
    )
    reader = NumberReader()
    for cycle in cycles:
        plan.begin()
        problems = [
            (step.line, problem) for step in cycle.steps if (problem := plan.add(step))
        ]
        for line, (what, hint) in problems:
            reader.fault(f"programme[{line}]", f"{programme[line]!r} {what}", hint)
        whole = plan.end(cycle.count, 0 if steps & {"make_up", "lay_down"} else 1)
        reader.faults += [] if problems else whole
    reader.faults += plan.faults(empty, stand, wear)
    reader.faults.report()
    if wear is not None and plan.turns:
        wear = Wear(
            **{**vars(wear), "turned_after": np.sort(np.asarray(plan.turns, float))}
        )
    phases = None
    for group in reversed(plan.groups):
        phases = dataclasses.replace(group, then=phases)
    assert phases is not None
    return Scene(
        brake,
        Duty(phases, hook),
        Initial(omega=0.0, block_height=0.0 if "hoist_back" in steps else None),
        end_time=2 * plan.whole_time,
        heat=heat,
        wear=wear,
        shaft=shaft,
        limits=limits,
        motor=motor if any(phase.motor is not None for phase in phases.each) else None,
    )


def _still_scene(
    brake: Brake | MultiBandBrake,
    load: AbstractLoad,
    heat: Heat | None,
    shaft: tuple[AbstractShaftTorque, ...],
) -> Scene:
    """The scene at rest, whose friction plans the programme. Raises `InputError` with
    what no driller can do with it, and with its own errors."""
    reader = NumberReader()
    if not isinstance(load, Hoist):
        reader.fault(
            "load", f"{type(load).__name__} has no hook to lower", "give a HookLoad"
        )
    if isinstance(brake, Brake) and brake.band.stiffness is not None:
        reader.fault(
            "brake.band.stiffness",
            "a driller who controls the speed needs a rigid band",
            "leave it out",
        )
    if brake.in_series or brake.resolved:
        reader.fault(
            "brake",
            "a driller cannot control a staged brake or a chain",
            "give a standard brake",
        )
    still = Scene(
        brake, Duty(Constant(0.0), load), Initial(0.0), 1.0, heat, shaft=shaft
    )
    reader.faults += [
        dataclasses.replace(fault, path=fault.path.removeprefix("duty."))
        for fault in faults(still)
    ]
    reader.faults.report()
    return still


def _on_string(load: HookLoad, empty: float, stand: float) -> StringLoad:
    """The load as hook and string."""
    return StringLoad(
        empty=empty or 1e-9 * float(load.mass),  # the hook load must be above 0
        string=float(load.mass) - empty,
        stand=stand,
        drum_radius=load.drum_radius,
        line_count=load.line_count,
        gravity=load.gravity,
        drag=load.drag,
        rope=load.rope,
        elasticity=load.elasticity,
        weight=load.weight,
    )


def undriven_scene(
    brake: Brake | MultiBandBrake,
    load: HookLoad,
    pull: float,
    limit: float | None = None,
    heat: Heat | None = None,
    wear: Wear | None = None,
    motor: Motor | None = None,
    shaft: tuple[AbstractShaftTorque, ...] = (),
    limits: AbstractLimits | None = None,
    **programme: Any,
) -> Scene:
    """The scene of a programme for a motion from elsewhere: its parts and the tensions
    of its lever, not its lines."""
    still = PiecewiseLinear([0.0, 1.0], [0.0, 0.0])
    moves = Phase(Driller(still, 2 * pull if limit is None else limit), AfterTime(1.0))
    phases = Phases((moves, Phase(Constant(pull), AfterTime(1.0))))
    return Scene(
        brake,
        Duty(phases, load),
        Initial(0.0),
        2.0,
        heat,
        wear,
        shaft=shaft,
        limits=limits,
        motor=motor,
    )


#: what the phases of a programme want by their names; all others hold the load
_WANTS = {"lower": "lower", "brake": "rest", "hoist": "hoist", "slow": "rest"}
#: error of a step, and how to fix it
Problem = tuple[str, str] | None


class _Plan:
    """Phases of the cycles, and the time that they would take with the friction of the
    start.

    - `empty` (kg) of the load hangs while the string does not; `None`: all of it hangs
      all the time
    """

    def __init__(
        self,
        still: Scene,
        load: Hoist,
        motor: Motor | None,
        pull: float,
        lever_time: float,
        acceleration: float,
        limit: float,
        empty: float | None,
    ) -> None:
        self.brake = banded_brake(still)
        self.sensed = sensed_at_start(still)
        self.motor = motor
        self.shaft = still.torques
        self.pull = pull
        self.lever_time = lever_time
        self.acceleration = acceleration
        self.limit = limit
        # rad of the pulley per m of the hook, with the rope as it is at the start;
        # length of rope for the hook (m)
        layers = load.layers
        self.per_metre = 1 / float(
            load.on_layer(layers and layers.first_layer()).travel()  # pyright: ignore
        )
        span = load.rope_span()
        self.rope = math.inf if span is None else float(span[1])
        if layers is not None:
            turns = float(load.travelled(2 * math.pi * np.asarray(layers.turns)))  # pyright: ignore
            self.rope = min(self.rope, turns)
        self.load = load
        self.empty = empty
        self.elastic = load.elastic is not None
        self.auxiliary = [
            law for law in self.shaft if isinstance(law, AbstractAuxiliaryBrake)
        ]
        self.groups = list[Phases]()
        self.whole_time = 0.0
        # numbers of phases over all cycles after which the band is turned
        self.turns = list[int]()
        # of the hook below the start (m): where a cycle begins, and the deepest of all
        self.depth = 0.0
        self.deepest = 0.0
        self.begin()

    def begin(self) -> None:
        """Begin a cycle."""
        self.time = 0.0
        self.omega = 0.0
        self.phases = list[Phase]()
        self.marks = dict[str, int]()
        self.lowered = 0.0
        self.lowest = 0.0
        self.stands = set[int]()
        # number of phases before it in a cycle, number of cycles before it (`None`: in
        # every cycle)
        self.turned = list[tuple[int, int | None]]()

    def end(self, count: int, stands: int) -> Faults:
        """End a cycle that is done `count` times and adds so many stands, where no line
        says it; its errors."""
        takes = "take" in self.marks
        down = "set" in self.marks
        checks = (
            (
                takes != down,
                "takes the string or sets it down, but not both",
                "give both, or neither",
            ),
            (
                len(self.stands) > 1,
                "makes up a stand and lays one down in a cycle",
                "give one of them",
            ),
            (not self.phases, "takes no time", "add: hold 40 s"),
            (self.moving, "ends in motion", "add: brake to rest"),
        )
        before = sum(group.count * len(group.phases) for group in self.groups)
        n = len(self.phases)
        for k, after in self.turned:
            self.turns += (
                [before + k + n * cycle for cycle in range(count)]
                if after is None
                else [before + n * after]
            )
        self.deepest = max(
            self.deepest,
            self.depth + self.lowest + max(count - 1, 0) * max(self.lowered, 0.0),
        )
        self.depth += count * self.lowered
        self.whole_time += count * self.time
        if self.phases:
            self.groups.append(
                Phases(
                    self.lever(), count, self.stands.pop() if self.stands else stands
                )
            )
        return [Fault("programme", what, hint) for wrong, what, hint in checks if wrong]

    @property
    def moving(self) -> bool:
        return self.omega > 0

    @property
    def mass(self) -> float:
        """What hangs on the hook now (kg)."""
        hangs = self.empty is None or ("take" in self.marks and "set" not in self.marks)
        return float(self.load.mass) if hangs else float(self.empty)  # pyright: ignore

    def _ropes(self) -> RopesNow:
        """Ropes with a weight, where the hook is now."""
        none = RopesNow(0.0, 0.0)
        return self.load.ropes(self.depth + self.lowered, 0) or none

    @property
    def weight(self) -> float:
        """Torque of the load on the drum (N·m)."""
        if not isinstance(self.load, HookLoad):
            torque = float(self.load.torque(0.0, 0.0, 0))
        else:
            torque = self.mass * float(self.load.gravity) / self.per_metre
        return torque + float(self._ropes().torque)

    @property
    def inertia(self) -> float:
        on_hook = isinstance(self.load, HookLoad)
        load = self.mass / self.per_metre**2 if on_hook else self.load.inertia()
        return (
            float(self.brake.pulley.inertia)
            + float(load)
            + float(self._ropes().inertia)
        )

    def _resistance(self, omega: float, share: float = 0.0) -> float:
        """Sum of all torques (N·m) that oppose the rotation, but for the friction
        brake: of the load and on the shaft.

        - `omega` (rad/s), negative upwards
        - `share` to which auxiliary brakes are engaged
        """
        part = np.float64(share)
        laws = [
            law.engaged(part) if isinstance(law, AbstractAuxiliaryBrake) else law
            for law in self.shaft
        ]
        sense = -1.0 if omega < 0 else 1.0
        each = [
            abs(
                float(
                    law.turning(
                        0.0, omega, law.profile.first_piece(0.0), self.weight, sense
                    )
                )
            )
            for law in laws
        ]
        return sum(each) + abs(float(self.load.drag) * omega)

    def _phase(
        self,
        name: str,
        lever: AbstractProfile,
        until: AbstractEnd,
        time: float,
        motor: PiecewiseLinear | None = None,
        auxiliary: float = 0.0,
    ) -> None:
        engaged = auxiliary if self.auxiliary else None
        wants = _WANTS.get(name, "hold")
        self.phases.append(
            Phase(lever, until, name, motor=motor, auxiliary=engaged, wants=wants)
        )
        self.time += time

    def _travels(self, distance: float) -> None:
        """Note a way of the hook downwards (m)."""
        self.lowered += distance
        self.lowest = max(self.lowest, self.lowered)

    def _driller(self, times: list[float], speeds: list[float]) -> Driller:
        return Driller(PiecewiseLinear(times, speeds), self.limit)

    def _gain(self) -> float:
        """Torque per slack tension, `R_b (Π − 1)` (m) on each rim, of the sliding
        linings with the friction of the start."""
        linings = self.brake.linings
        n = self.brake.linings.count
        v = jnp.full(n, self.omega * float(self.brake.pulley.radius))
        f = linings.friction.kinetic(unloaded(linings, v, self.sensed))
        return float(self.brake.torque(jnp.ones(()), jnp.broadcast_to(f, (n,))))

    def add(self, step: Step) -> Problem:
        """Add the phases of a step, or return its error and how to fix it."""
        if step.what in ("take", "set"):
            return self._mark(step.what)
        brakes = step.what in ("brake", "brake_in")
        if brakes and not self.moving:
            return "begins at rest", "lower before it"
        if self.moving and not brakes:
            return "begins in motion", "brake to rest before it"
        by = {"by": step.by} if step.what == "lower" else {}
        return getattr(self, f"_{step.what}")(**step.numbers, **by)

    def _lower(self, distance: float, speed: float, by: str) -> Problem:
        run_up = speed**2 / (2 * self.acceleration)
        faster = speed / self.acceleration
        omega = speed * self.per_metre
        time = faster + (distance - run_up) / speed
        # (also where it cannot be: the lines after it are not to blame)
        self.omega = omega
        if run_up > distance:
            return (
                f"is too short to reach the speed, which takes {run_up:.4g} m",
                "increase acceleration or distance",
            )
        if "auxiliary" in by and not self.auxiliary:
            return (
                "needs an auxiliary brake",
                "give `shaft` an EddyCurrentBrake or a HydrodynamicBrake",
            )
        course = PiecewiseLinear([0.0, faster], [0.0, omega])
        lever = Constant(0.0)
        motor = None
        auxiliary = 0.0
        if by == "on the motor":
            motor = course
            left = self.weight - self._resistance(omega)
            early = left - self.inertia * self.acceleration * self.per_metre
            if problem := self._of_motor(omega, max(left, early, key=abs)):
                return problem
        elif by == "on the auxiliary brake":
            auxiliary = self._share(omega)
            if isinstance(auxiliary, tuple):
                return auxiliary
            time *= 1.5  # as it comes to its speed by itself
        else:
            lever = self._driller([0.0, faster], [0.0, omega])
            auxiliary = 1.0 if by else 0.0
            resistance = self._resistance(omega, auxiliary)
            accelerates = self.inertia * self.acceleration * self.per_metre
            if self.weight <= max(resistance, accelerates + self._resistance(omega)):
                against = (
                    f", {number(resistance, 'N*m')} are against it at that speed"
                    if resistance
                    else ""
                )
                hint = "reduce it, or what is against it; a motor may drive it down: `on the motor`"
                return (
                    f"cannot be reached: the load is too light for the acceleration{against}",
                    hint,
                )
        self._travels(distance)
        self._phase("lower", lever, AfterTravel(distance), time, motor, auxiliary)
        return None

    def _share(self, omega: float) -> float | tuple[str, str]:
        """Engagement of the auxiliary brakes with which they lower the load at a steady
        speed; or why they do not."""
        from scipy.optimize import brentq  # imported where used: few programmes need it

        torque = self._resistance
        full = number(torque(omega, 1.0), "N*m")
        if torque(omega, 1.0) < self.weight:
            why = (
                f"cannot be held: the auxiliary brake gives {full} at that speed, "
                f"the load {number(self.weight, 'N*m')}"
            )
            return why, "lower it `with the auxiliary brake`, or take a stronger one"
        share = float(
            brentq(lambda x: torque(omega, x) - self.weight, 0.0, 1.0, xtol=1e-12)  # pyright: ignore
        )
        if torque(1.001 * omega, share) <= torque(omega, share):
            return (
                "is not steady: the torque of the auxiliary brake falls with the speed",
                "lower it more slowly",
            )
        return share

    def _of_motor(self, omega: float, torque: float) -> Problem:
        """Why the motor cannot give a torque (N·m) up to a speed (rad/s)."""
        if self.motor is None:
            return "needs a motor", "give the programme `motor`, with its limits"
        motor = self.motor
        if omega > float(motor.max_speed):
            return (
                f"is too fast: the motor turns at most at {number(motor.max_speed, 'rad/s')}",
                "or another motor",
            )
        least = abs(torque)
        most = float(motor.available(omega))
        if least > most:
            words = (
                f"needs {number(least, 'N*m')} of a motor that gives "
                f"{number(most, 'N*m')} at that speed"
            )
            return words, "hoist less, more slowly, or with less acceleration"
        return None

    def _hoist_back(self, speed: float) -> Problem:
        if self.depth + self.lowered <= 0:
            return (
                "has nothing to hoist back: the hook is not below where it began",
                "lower before it, or hoist 27 m",
            )
        return self._hoist(
            self.depth + self.lowered,
            speed,
            AtHeight(-(speed**2) / (2 * self.acceleration), rising=True),
        )

    def _hoist(
        self, distance: float, speed: float, until: AtHeight | None = None
    ) -> Problem:
        slowing = speed**2 / (2 * self.acceleration)
        time = speed / self.acceleration
        if 2 * slowing > distance:
            return (
                f"is too short to reach the speed, which takes {2 * slowing:.4g} m",
                "increase acceleration or distance",
            )
        omega = speed * self.per_metre
        needed = (
            self.weight
            + self._resistance(-omega)
            + self.inertia * self.acceleration * self.per_metre
        )
        self._travels(-distance)
        if problem := self._of_motor(omega, needed):
            return problem
        # (beyond 0, as in `_brake_in`)
        up = PiecewiseLinear([0.0, time], [0.0, -omega])
        stop = PiecewiseLinear([0.0, 2 * time], [-omega, omega])
        steady = (distance - 2 * slowing) / speed
        self._phase(
            "hoist",
            Constant(0.0),
            until or AfterTravel(slowing - distance),
            time + steady,
            up,
        )
        self._phase("slow", Constant(0.0), AtRest(), time, stop)
        return None

    def _brake(self) -> Problem:
        # imported where used: few scenes are programmes
        from scipy.integrate import solve_ivp

        gain = self._gain()
        omega = self.omega
        self.omega = 0.0
        if gain <= 0:
            return (
                "cannot be done: without friction the band holds no load",
                "increase the coefficient of friction",
            )
        first = max(self.weight - self._resistance(omega), 0.0) / gain
        least = (self.weight - self._resistance(0.0)) / gain
        if not self.pull > least:
            return (
                f"never comes to rest: the load needs {least:.0f} N at the slack end",
                "raise `pull`",
            )

        def rates(t: float, y: np.ndarray) -> tuple[float, float]:
            force = first + (self.pull - first) * min(t / self.lever_time, 1.0)
            left = self.weight - self._resistance(max(y[1], 0.0)) - gain * force
            return y[1], left / self.inertia

        def rests(t: float, y: np.ndarray) -> float:
            return y[1]

        rests.terminal = True
        # (twice what it takes without what resists at speed)
        latest = self.lever_time + 2 * self.inertia * omega / (
            gain * (self.pull - least)
        )
        course = solve_ivp(
            rates,
            (0.0, latest),
            [0.0, omega],
            "DOP853",
            events=rests,
            rtol=1e-12,
            atol=1e-12,
        )
        self._travels(float(course.y[0, -1]) / self.per_metre)
        time = float(course.t[-1])
        self._phase(
            "brake",
            PiecewiseLinear([0.0, self.lever_time], [first, self.pull]),
            AtRest(),
            time,
        )
        return None

    def _brake_in(self, time: float) -> None:
        # (beyond 0, as a pulley that is late would never come to rest at a speed that
        # only approaches 0)
        driller = self._driller([0.0, 2 * time], [self.omega, -self.omega])
        self._travels(0.5 * self.omega * time / self.per_metre)
        self.omega = 0.0
        self._phase("brake", driller, AtRest(), time)

    def _hold(self, time: float, name: str = "hold") -> None:
        self._phase(name, Constant(self.pull), AfterTime(time), time)

    def _make_up(self, time: float | None = None) -> None:
        self.stands.add(1)
        if time is not None:
            self._hold(time, "make up")

    def _lay_down(self, time: float | None = None) -> None:
        self.stands.add(-1)
        if time is not None:
            self._hold(time, "lay down")

    def _turn(self, cycles: float | None = None) -> None:
        self.turned.append((len(self.phases), None if cycles is None else int(cycles)))

    def faults(self, empty: float, stand: float, wear: Wear | None) -> Faults:
        """Errors of the whole."""
        mass = float(self.load.mass) if isinstance(self.load, HookLoad) else math.inf
        far = self.deepest
        short = (
            f"lowers {far:.5g} m in all, braking included, the rope on the drum is "
            f"enough for {self.rope:.5g} m"
        )
        why = "stands are added in the slips: take the string, set the string in the slips"
        takes = self.empty is not None
        more = "give load.rope more turns" if self.load.layers else "give more rope"
        bare = takes and not empty and self.elastic
        checks = (
            (stand and not takes, "stand", "has no effect", why),
            (
                empty > mass,
                "empty",
                f"{empty:g} kg is more than the load of {mass:g} kg",
                "",
            ),
            (
                bare,
                "empty",
                "is missing",
                "on an elastic rope hook and block move by themselves: give their mass",
            ),
            (
                self.turns and wear is None,
                "wear",
                "is missing",
                "turning the band needs linings that wear",
            ),
            (
                far > self.rope,
                "programme",
                short,
                more + ", or hoist in between",
            ),
        )
        return [Fault(path, what, hint) for wrong, path, what, hint in checks if wrong]

    def _mark(self, what: str) -> Problem:
        if (
            self.moving
            or what in self.marks
            or (what == "set" and "take" not in self.marks)
        ):
            return (
                "is out of order",
                "at rest, once in a cycle, the string taken before it is set down",
            )
        self.marks[what] = len(self.phases)
        return None

    def lever(self) -> tuple[Phase, ...]:
        """The phases of one cycle, and whether the string hangs on the hook in each."""
        take_phase = self.marks.get("take", 0)
        down = self.marks.get("set", len(self.phases))
        return tuple(
            dataclasses.replace(phase, string_on_hook=take_phase <= i < down)
            for i, phase in enumerate(self.phases)
        )
