"""Programmes in words: "lower 27 m at 1.2 m/s", "brake to rest", "hold 40 s", "repeat 30 times"."""

import dataclasses
import difflib
import math
import re
from typing import Annotated, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._part import takes_values
from .._base._quantity import BAD, NumberReader, Quantity, positive
from .._phases import AfterTime, AfterTravel, AtRest, Phase, Phases
from ..brakes._bands import MultiBandBrake
from ..brakes._design import Brake, unloaded
from ..loads import AbstractLoad, Driller, HookLoad, StringLoad
from ..profiles import AbstractProfile, Constant, PiecewiseLinear
from ..thermal._heat import Heat
from ..wear import Wear
from ._scene import Duty, Initial, Scene, banded_brake, faults, sensed_at_start

#: steps by name: an example, and the form of their line
_GRAMMAR = {
    "lower": ("lower 27 m at 1.2 m/s", re.compile(r"lower (?P<distance>.+) at (?P<speed>.+)")),
    "brake": ("brake to rest", re.compile(r"brake to rest")),
    "brake_in": ("brake to rest in 3 s", re.compile(r"brake to rest in (?P<time>.+)")),
    "hold": ("hold 40 s", re.compile(r"(?:hold|wait) (?:for )?(?P<time>.+)")),
    "take": ("take the string", re.compile(r"take the string")),
    "set": ("set the string in the slips", re.compile(r"set (?:it |the string )?(?:in|into|in the|into the) slips")),
    "turn": (
        "turn the band after 15 cycles",
        re.compile(r"turn the band(?: end for end)?(?: after (?P<cycles>\d{1,6}) cycles?)?"),
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
    """One line of a programme: what, and its numbers in SI."""

    what: str
    numbers: dict[str, float]


def parse_programme(lines: tuple[str, ...] | list[str], path: str = "programme") -> tuple[list[Step], int]:
    """Steps of one cycle, and how often it is repeated. Raises `InputError` with every line that cannot be read."""
    reader, steps, count = NumberReader(), list[Step](), 1
    for i, line in enumerate(lines):
        line_path = f"{path}[{i}]"
        text = " ".join(line.lower().replace("set it", "set").split())
        command = next(((what, m) for what, (_, form) in _GRAMMAR.items() if (m := form.fullmatch(text))), None)
        if command is None:
            near = difflib.get_close_matches(text, FORMS, n=1, cutoff=0.3)
            hint = f"nearest: {near[0]}" if near else f"there are: {'; '.join(FORMS)}"
            reader.fault(line_path, f"{line!r} is not understood", hint)
            continue
        what, match = command
        if what == "repeat":
            count = int(match["count"])
            if i != len(lines) - 1:
                reader.fault(line_path, f"{line!r} is not the last line", "it repeats all the lines before it")
            if count < 1:
                reader.fault(line_path, f"{line!r} is not a number of cycles", "at least 1")
            continue
        numbers = {
            name: reader.number(words, about, line_path, about.unit)
            for name, words in match.groupdict().items()
            if words is not None and (about := _QUANTITIES[name])
        }
        if not any(value is BAD for value in numbers.values()):
            steps.append(Step(what, {name: float(value) for name, value in numbers.items()}))
    if not steps and not reader.faults:
        reader.fault(path, "has no step", f"as in {FORMS[0]!r}")
    if reader.faults:
        raise InputError(reader.faults)
    return steps, count


@takes_values
def programme_scene(
    brake: Brake | MultiBandBrake,
    programme: tuple[str, ...],
    load: AbstractLoad,
    pull: Annotated[float, positive("N", "slack tension with the lever applied")],
    lever_time: Annotated[float, positive("s", "time to apply the lever")] = 0.35,
    acceleration: Annotated[float, positive("m/s^2", "acceleration of the hook when it is released")] = 0.5,
    empty: Annotated[float, Quantity("kg", "mass of hook and block without the string", 0.0)] = 0.0,
    stand: Annotated[float, Quantity("kg", "mass of the stand that each cycle adds", 0.0)] = 0.0,
    limit: Annotated[float | None, positive("N", "maximum slack tension while lowering")] = None,
    heat: Heat | None = None,
    wear: Wear | None = None,
) -> Scene:
    """A scene from a programme in words: a list of lines, one cycle of work, perhaps repeated.

    - `lower D at V`: the hook starts from rest with the `acceleration` and continues at the speed `V`, over the
      distance `D`, run-up included; the braking after it adds its own travel. The driller controls the speed
      (`Driller`), so that fade changes the lever force and not the speed. With layers of rope (`HookLoad.rope`) the
      distance is that of the hook, and `V` its speed in the layer of the start: the pulley keeps its speed, so that in
      the layers below the hook is slower by their radius
    - `brake to rest`: the slack tension rises to the `pull` in the `lever_time`, and stays there until the pulley rests
    - `brake to rest in X`: the driller controls the speed linearly to 0 until the pulley rests, over `V X/2`: "lower
      25 m at 1.2 m/s" and "brake to rest in 3 s" travel 26.8 m together
    - `hold X` or `wait X`;  `take the string`, `set the string in the slips`: between them the string hangs on the hook
    - `turn the band after N cycles`: end for end, so that the worn lining of the tight end comes to the slack end; for
      `wear` with equal linings. Without a number it is turned at that point of every cycle, at rest
    - `repeat N times`: all lines before it; each cycle adds a `stand` to the string
    - `load`: a `HookLoad` with all that hangs on the hook in the first cycle, `empty` of it without the string
    - `limit` (N): maximum slack tension of the driller, twice the `pull` by default; of several alike rims
      (`Brake.rims`) both are the tension of each band, of a `MultiBandBrake` the sum of all

    Every line that takes time is a phase (`Phases`): lowering ends with the travel, braking with the rest, however long
    that takes. The run begins at rest under the `pull` and ends with the last line; its `end_time`, by which it has to,
    is twice the time that the friction of the start would take. Raises `InputError` with every line that
    is not understood or cannot be done, and with every error of the brake, the load or the heat of
    the scene, such as friction that depends on the temperature without heat; and for a brake without a band.
    """
    if not isinstance(brake, Brake | MultiBandBrake):
        raise InputError([Fault("brake", f"is a {brake.words.brake}: programmes need a band brake")])
    steps, count = parse_programme(programme)
    reader = NumberReader()
    if not isinstance(load, HookLoad):
        reader.fault("load", f"{type(load).__name__} has no hook to lower", "give a HookLoad")
    if isinstance(brake, Brake) and brake.band.stiffness is not None:
        reader.fault("brake.band.stiffness", "a driller who controls the speed needs a rigid band", "leave it out")
    if brake.in_series or brake.resolved:
        reader.fault("brake", "a driller cannot control a staged brake or a chain", "give a standard brake")
    # errors of brake, load and heat in any scene: the plan uses the friction at the start
    still = Scene(brake, Duty(Constant(0.0), load), Initial(0.0), 1.0, heat)
    reader.faults += [dataclasses.replace(fault, path=fault.path.removeprefix("duty.")) for fault in faults(still)]
    if reader.faults:
        raise InputError(reader.faults)
    assert isinstance(load, HookLoad)
    plan = _Plan(still, load, pull, lever_time, acceleration, 2 * pull if limit is None else limit)
    for i, step in enumerate(steps):
        problem = plan.add(step)
        if problem:
            reader.fault(f"programme[{i}]", f"{programme[i]!r} {problem[0]}", problem[1])
    reader.faults += plan.faults(empty, stand, wear, count)
    if not plan.phases and not reader.faults:
        reader.fault("programme", "takes no time", "add: hold 40 s")
    if plan.moving and not reader.faults:
        reader.fault("programme", "ends in motion", "add: brake to rest")
    if reader.faults:
        raise InputError(reader.faults)
    hook = load
    if "take" in plan.marks:
        hook = StringLoad(  # pyright: ignore
            empty=empty or 1e-9 * float(load.mass),  # the hook load must be above 0
            string=float(load.mass) - empty,
            stand=stand,
            **{
                name: getattr(load, name)
                for name in ("drum_radius", "line_count", "gravity", "drag", "rope", "elasticity")
            },
        )
    if wear is not None and plan.turns:
        wear = Wear(**{**vars(wear), "turned_after": plan.turned_after(count)})
    duty = Duty(Phases(plan.lever(), count), hook)
    return Scene(brake, duty, Initial(omega=0.0), end_time=2 * plan.time * count, heat=heat, wear=wear)


#: error of a step, and how to fix it
Problem = tuple[str, str] | None


class _Plan:
    """Phases of one cycle, and the time that they would take with the friction of the start."""

    def __init__(
        self, still: Scene, load: HookLoad, pull: float, lever_time: float, acceleration: float, limit: float
    ) -> None:
        self.brake, self.sensed = banded_brake(still), sensed_at_start(still)
        self.pull, self.lever_time, self.acceleration, self.limit = pull, lever_time, acceleration, limit
        # rad of the pulley per m of the hook, with the rope as it is at the start; length of rope for the hook (m)
        self.per_metre = 1 / float(load.on_layer(load.rope and load.rope.first_layer()).travel())  # pyright: ignore
        self.rope = math.inf
        if load.rope is not None:
            self.rope = float(load.travelled(2 * math.pi * np.asarray(load.rope.turns)))
        self.lowered = 0.0
        self.mass = float(load.mass)
        self.weight = self.mass * float(load.gravity) / self.per_metre  # N·m
        self.drag, self.elastic = float(load.drag), load.elasticity is not None
        self.inertia = float(self.brake.pulley.inertia) + self.mass / self.per_metre**2
        self.time, self.omega, self.phases, self.marks = 0.0, 0.0, list[Phase](), dict[str, int]()
        # number of phases before it in a cycle, number of cycles before it (`None`: in every cycle)
        self.turns = list[tuple[int, int | None]]()

    @property
    def moving(self) -> bool:
        return self.omega > 0

    def _phase(self, name: str, lever: AbstractProfile, until: AtRest | AfterTravel | AfterTime, time: float) -> None:
        self.phases.append(Phase(lever, until, name))
        self.time += time

    def _driller(self, times: list[float], speeds: list[float]) -> Driller:
        return Driller(PiecewiseLinear(times, speeds), self.limit)

    def _gain(self) -> float:
        """Torque per slack tension, `R_b (Π − 1)` (m) on each rim, of the sliding linings with the friction of the
        start."""
        linings, n = self.brake.linings, self.brake.linings.count
        v = jnp.full(n, self.omega * float(self.brake.pulley.radius))
        f = linings.friction.kinetic(unloaded(linings, v, self.sensed))
        return float(self.brake.torque(jnp.ones(()), jnp.broadcast_to(f, (n,))))

    def add(self, step: Step) -> Problem:
        """Add the points of a step, or return its error and how to fix it."""
        if step.what in ("take", "set"):
            return self._mark(step.what)
        brakes = step.what in ("brake", "brake_in")
        if brakes and not self.moving:
            return "begins at rest", "lower before it"
        if self.moving and not brakes:
            return "begins in motion", "brake to rest before it"
        return getattr(self, f"_{step.what}")(**step.numbers)

    def _lower(self, distance: float, speed: float) -> Problem:
        run_up = speed**2 / (2 * self.acceleration)
        if run_up > distance:
            return f"is too short to reach the speed, which takes {run_up:.4g} m", "increase acceleration or distance"
        if self.weight <= self.inertia * self.acceleration * self.per_metre + self.drag * speed * self.per_metre:
            return "cannot be reached: the load is too light for the acceleration", "reduce it, or the drag"
        self.lowered += distance
        self.omega, faster = speed * self.per_metre, speed / self.acceleration
        driller = self._driller([0.0, faster], [0.0, self.omega])
        self._phase("lower", driller, AfterTravel(distance), faster + (distance - run_up) / speed)
        return None

    def _brake(self) -> Problem:
        gain = self._gain()
        if gain <= 0:
            return "cannot be done: without friction the band holds no load", "increase the coefficient of friction"
        first = max(self.weight - self.drag * self.omega, 0.0) / gain
        if not self.pull * gain > self.weight:
            least = self.weight / gain
            return f"never comes to rest: the load needs {least:.0f} N at the slack end", "raise `pull`"
        # J ω̇ = −R_b (Π − 1) (T_0 − T_w), T_0 from `first` to the pull in the lever's time, then constant (without
        # drag)
        excess, over = gain * (self.pull - self.weight / gain), gain * (self.pull - first) / self.lever_time
        early = self.inertia * self.omega
        ramp = excess * self.lever_time - 0.5 * over * self.lever_time**2
        start = excess - over * self.lever_time
        if early > ramp:
            time = self.lever_time + (early - ramp) / excess
        else:
            time = float(max(np.roots([0.5 * over, start, -early]).real))
        rising = min(time, self.lever_time)
        turned = self.omega * rising - (0.5 * start + over * rising / 6) * rising**2 / self.inertia
        turned += 0.5 * max(early - ramp, 0.0) ** 2 / (excess * self.inertia)
        self.lowered += turned / self.per_metre
        self.omega = 0.0
        self._phase("brake", PiecewiseLinear([0.0, self.lever_time], [first, self.pull]), AtRest(), time)
        return None

    def _brake_in(self, time: float) -> None:
        # (beyond 0, as a pulley that is late would never come to rest at a speed that only approaches 0)
        driller = self._driller([0.0, 2 * time], [self.omega, -self.omega])
        self.lowered += 0.5 * self.omega * time / self.per_metre
        self.omega = 0.0
        self._phase("brake", driller, AtRest(), time)

    def _hold(self, time: float) -> None:
        self._phase("hold", Constant(self.pull), AfterTime(time), time)

    def _turn(self, cycles: float | None = None) -> None:
        self.turns.append((len(self.phases), None if cycles is None else int(cycles)))

    def faults(self, empty: float, stand: float, wear: Wear | None, count: int) -> list[Fault]:
        """Errors of the cycle as a whole, repeated `count` times."""
        takes, down, far = "take" in self.marks, "set" in self.marks, count * self.lowered
        short = f"lowers {far:.5g} m in all, braking included, the rope on the drum is enough for {self.rope:.5g} m"
        why = "stands are added in the slips: take the string, set the string in the slips"
        bare = takes and not empty and self.elastic
        checks = (
            (takes != down, "programme", "takes the string or sets it down, but not both", "give both, or neither"),
            (stand and not takes, "stand", "has no effect", why),
            (empty > self.mass, "empty", f"{empty:g} kg is more than the load of {self.mass:g} kg", ""),
            (bare, "empty", "is missing", "on an elastic rope hook and block move by themselves: give their mass"),
            (self.turns and wear is None, "wear", "is missing", "turning the band needs linings that wear"),
            (far > self.rope, "programme", short, "give load.rope more turns: the drum does not turn back in between"),
        )
        return [Fault(path, what, hint) for wrong, path, what, hint in checks if wrong]

    def turned_after(self, count: int) -> np.ndarray:
        """Numbers of phases after which the band is turned, in order."""
        n = len(self.phases)
        each = [k + n * cycle for k, after in self.turns if after is None for cycle in range(count)]
        return np.sort(np.asarray(each + [n * after for _, after in self.turns if after is not None], float))

    def _mark(self, what: str) -> Problem:
        if self.moving or what in self.marks or (what == "set" and "take" not in self.marks):
            return "is out of order", "at rest, once in a cycle, the string taken before it is set down"
        self.marks[what] = len(self.phases)
        return None

    def lever(self) -> tuple[Phase, ...]:
        """The phases of one cycle, and whether the string hangs on the hook in each."""
        take_phase, down = self.marks.get("take", 0), self.marks.get("set", len(self.phases))
        return tuple(
            dataclasses.replace(phase, string_on_hook=take_phase <= i < down) for i, phase in enumerate(self.phases)
        )
