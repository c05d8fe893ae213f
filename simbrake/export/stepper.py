"""A brake in steps that the caller sets: for co-simulation, control loops and models of
the rig around it."""

import dataclasses
import functools
import hashlib
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._compiling import LONGEST, Program, megabytes, program_of, run_device
from .._base._faults import Fault, InputError, input_error
from .._base._numbers import number
from .._base._packing import Packing, pack
from .._base._quantity import NumberReader, Quantity
from .._base._store import MEMORY, kept
from ..hybrid import AbstractMethod, Code, Given, Record, hybridsolve
from ..hybrid.arrays import Array
from ..hybrid.struct import with_fields, with_value_at
from ..hybrid.system import pack_mode, ravel, unravel
from ..loads import AbstractActuator, Cylinder, Driller, Lever, SpeedHold, TorqueLoad
from ..outputs.log import Event, SimulationError, labels_of
from ..outputs.probe import Probe, probe_of
from ..outputs.programs import RunJit
from ..outputs.quantities import Series, columns_by_name, series_of
from ..parts.scene import Scene
from ..phases import Phases
from ..physics.mechanism import Label, Mode, events_of_change
from ..profiles import PiecewiseLinear
from ..runs.result import Result, RunLimits
from ..runs.simulate import (
    Solver,
    checked_run,
    given_of,
    method_of,
    require_64_bits,
    solver_name,
)

#: inputs that a caller can set
_INPUTS = ("lever", "load")
#: step attempts in one call of the program; an advance that needs more takes several
_ATTEMPTS = 256


class Advanced(NamedTuple):
    """Outcome of `Stepper.advance`: the time reached (s), and the events on the way, in
    order.

    Example:
        >>> stepper = sb.Stepper(scene, inputs=["lever"])
        >>> [event.name for event in stepper.advance(0.1, lever="24 kN").events]
        ['slip_onset', 'full_slip']
    """

    time: float
    events: list[Event]


# --- inputs that are held between two calls -----------------------------------------


@dataclasses.dataclass(frozen=True)
class HeldInput:
    """An input of the caller: a function of time with a jump wherever it was changed.

    - `where`: the profile in the scene that it takes the place of
    - `unit` of that profile
    - `times`, `values` (2 k,): the last jumps, each as two points at one time; `piece`:
      how many points the run has passed. What a lag still feels of older jumps is in
      the height of the first
    - `delay`, `lag` (s) of an actuator
    - `commands`: all that was commanded, by time: the first `count` of a list that
      later inputs go on with
    """

    unit: str
    where: tuple[str, ...]
    times: np.ndarray
    values: np.ndarray
    piece: int
    delay: float
    lag: float | None
    commands: list[tuple[float, float]]
    count: int = 1

    @property
    def level(self) -> float:
        return float(self.values[-1])

    def with_command(self, t: float, value: float) -> "HeldInput":
        """The input with another value from `t` on."""
        if value == self.level:
            return self
        # it is what the run begins with
        if t == self.commands[0][0] and not (self.delay or self.lag):
            return dataclasses.replace(
                self,
                values=np.full_like(self.values, value),
                commands=[(t, value)],
                count=1,
            )
        times = self.times
        values = self.values
        piece = self.piece
        # of a lag one jump that is over stays, to hold what is left of all before
        if piece >= (2 if self.lag is None else 4):
            if self.lag is not None:
                left = (values[1] - values[0]) * math.exp(
                    -(times[2] - times[0]) / self.lag
                )
                values = values.copy()
                values[2] -= left
            times = times[2:]
            values = values[2:]
            piece = piece - 2
        times = np.append(times, [t, t])
        values = np.append(values, [self.level, value])
        # commands that wait in the dead time: space for as many again
        if len(times) > len(self.times):
            more = len(self.times)
            times = np.concatenate([np.full(more - 2, times[0]), times])
            values = np.concatenate([np.full(more - 2, values[0]), values])
            piece += more - 2
        # another went on with it
        commands = (
            self.commands
            if len(self.commands) == self.count
            else self.commands[: self.count]
        )
        commands.append((t, value))
        return dataclasses.replace(
            self,
            times=times,
            values=values,
            piece=piece,
            commands=commands,
            count=self.count + 1,
        )

    def history(self) -> PiecewiseLinear:
        """All that was commanded, as a profile of a scene."""
        times, values = np.asarray(self.commands[: self.count]).T
        # jumps
        return PiecewiseLinear(np.repeat(times, 2)[1:], np.repeat(values, 2)[:-1])


def _held(scene: Scene, name: str) -> HeldInput | Fault:
    """The input `name` of a scene, before anything was commanded: what the scene itself
    gives at its start."""
    duty = scene.duty
    start = float(np.asarray(scene.initial.time))
    field = duty.lever_field if name == "lever" else "load"
    part = getattr(duty, field)
    where = ("duty", field)
    unit = "N"
    delay = 0.0
    lag = None
    if name == "load":
        if not isinstance(part, TorqueLoad):
            hint = (
                'a load given by its torque: load = {torque = "12 kN*m"}, and the '
                "mass of the hook in the inertia"
            )
            return Fault(
                "duty.load", f"a {type(part).__name__} gives its torque by itself", hint
            )
        part = part.profile
        where = (*where, "profile")
        unit = "N*m"
    if isinstance(part, Lever):
        part = part.force
        where = (*where, "force")
    if isinstance(part, AbstractActuator):
        delay = float(part.dead_time)
        lag = None if part.lag is None else float(part.lag)
        where = (*where, part.command_field)
        unit = "Pa" if isinstance(part, Cylinder) else unit
        part = part.input
    path = ".".join(where)
    if isinstance(part, Driller):
        part = part.speed
        where = (*where, "speed")
        unit = "rad/s"
    if isinstance(part, Phases | SpeedHold):
        hint = "give the lever as a tension, a force, or a Driller, whose speed is then the input"
        return Fault(path, f"{type(part).__name__} sets the lever by itself", hint)
    if unit in ("N", "Pa") and not float(np.asarray(part.scale())) > 0:
        return Fault(
            path, "is 0 at all times", "give the largest that will be commanded"
        )
    first = float(
        np.asarray(part.value(start - delay, part.first_piece(start - delay)))
    )
    size = 2 if lag is None else 4
    # jumps before the first command have no height, and are over
    past = np.full(size, start - delay - 1.0)
    return HeldInput(
        unit, where, past, np.full(size, first), size, delay, lag, [(start, first)]
    )


def held_inputs(scene: Scene, inputs: Sequence[str] | str) -> dict[str, HeldInput]:
    """The inputs of a stepper before the first command. Raises `InputError` for those
    that the scene cannot have."""
    inputs = [inputs] if isinstance(inputs, str) else inputs
    hint = f"inputs are {' and '.join(_INPUTS)}"
    faults = [
        Fault(name, "is no input", hint) for name in inputs if name not in _INPUTS
    ]
    held = {
        name: _held(scene, name) for name in dict.fromkeys(inputs) if name in _INPUTS
    }
    faults += [fault for fault in held.values() if isinstance(fault, Fault)]
    if isinstance(scene.duty.lever, Phases) and "lever" not in inputs:
        path = f"duty.{scene.duty.lever_field}"
        faults.append(
            Fault(
                path,
                "a duty in phases ends by itself",
                "run it by simulate, or give it a tension",
            )
        )
    if faults:
        raise InputError(faults)
    return {
        name: held_input
        for name, held_input in held.items()
        if isinstance(held_input, HeldInput)
    }


def _commanded(
    scene: Scene, held: Iterable[tuple[tuple[str, ...], PiecewiseLinear]]
) -> Scene:
    """The scene with other profiles at the places `where`."""
    for where, profile in held:
        scene = with_value_at(scene, ".".join(where), profile)
    return scene


class InputShape(NamedTuple):
    """What of an input shapes the program: its name, its place, and how many points it
    has."""

    name: str
    where: tuple[str, ...]
    points: int


def step_of_numbers(
    packing: Packing, method: AbstractMethod, shapes: tuple[InputShape, ...]
) -> tuple[Callable[[Array], Record], int, tuple[int, int]]:
    """One integration between two times, a function of one vector: the numbers of the
    scene, points of the inputs, both times, state and mode. And the size of what comes
    before the times, and those of state and mode.

    A state that is not a number is the start.
    """
    n = packing.size
    ends = np.cumsum([n, *(2 * shape.points for shape in shapes)])

    def start(x: Array) -> Given:
        given = given_of(packing, x[:n], method, _ATTEMPTS)
        held = {shape.name: jnp.asarray(0, jnp.int32) for shape in shapes}
        mode = given.mode0
        return given._replace(mode0=mode._replace(pieces=mode.pieces | held))

    def sizes() -> tuple[int, int]:
        given = jax.eval_shape(start, np.ones(n))
        return _size(given.y0), _size(given.mode0)

    ny, nm = kept(("sizes of a step", packing, shapes), sizes)

    def run(x: Array) -> Record:
        given = start(x)
        y = given.y0
        mode = given.mode0
        points = (x[a:b].reshape(2, -1) for a, b in itertools.pairwise(ends.tolist()))
        profiles = [
            (shape.where, PiecewiseLinear(*pair))
            for shape, pair in zip(shapes, points, strict=True)
        ]
        scene = _commanded(packing.unpack(x[:n])[0], profiles)
        system = with_fields(given.system, lever=scene.lever, load=scene.duty.load)
        t = x[ends[-1]]
        end = x[ends[-1] + 1]
        now = x[ends[-1] + 2 :]
        begins = jnp.isnan(now[0])
        flat_y = jnp.where(begins, ravel(y, jnp.float64), now[:ny])
        flat_mode = jnp.where(
            begins, pack_mode(mode), jnp.where(begins, 0.0, now[ny:]).astype(jnp.int32)
        )
        problem = system, unravel(flat_y, y), unravel(flat_mode, mode), t, end
        return hybridsolve(*problem, method, given.settings)

    return run, int(ends[-1]), (ny, nm)


def _program(
    packing: Packing, method: AbstractMethod, shapes: tuple[InputShape, ...]
) -> tuple[Program, int]:
    """The step compiled, and the size of state and mode."""
    subject = ("step", packing, method, shapes)

    def make() -> tuple[Program, int]:
        run, before, sizes = step_of_numbers(packing, method, shapes)
        numbers = np.ones(before + 2 + sum(sizes))
        how = {"quick": True, "longest": LONGEST, "packed": True}
        return program_of(run, numbers, subject=subject, **how), sum(sizes)

    key = (*subject, run_device())
    return MEMORY.get(key, make, lambda made: megabytes(made[0]))


def _size(tree: Any) -> int:
    return sum(math.prod(leaf.shape) for leaf in jax.tree.leaves(tree))


# --- the stepper --------------------------------------------------------------------


def _at_end(record: Record) -> tuple[np.ndarray, np.ndarray]:
    n = int(record.count)
    return np.array(record.rows.y[n]), np.array(record.rows.mode[n])


def _events(record: Record, first: bool) -> list[Event]:
    """Changes of mode in a record, by the names of the log; `first`: it begins the
    run."""
    labels = labels_of(record)
    t = np.asarray(record.rows.t)

    events = []
    settles = first
    driven = record.system.rests_open  # pyright: ignore
    for i, (before, after) in enumerate(itertools.pairwise(labels)):
        if before == after:
            continue
        names = events_of_change(
            before, after, settles and bool(t[i + 1] == t[0]), driven
        )
        events += [Event(float(t[i + 1]), name) for name in names]
        settles = False
    return events


@functools.partial(RunJit, quick=True)
def _seen(system: Any, t: Array, y: Any, mode: Mode) -> Probe:
    return probe_of(
        system, *jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (t, y, mode))
    )


@explained
class Stepper:
    """A scene advanced in steps of any length, with all its events inside them, under
    inputs that the caller holds.

        stepper = sb.Stepper(scene, inputs=["lever"])
        while stepper.omega > 0:
            stepper.advance("10 ms", lever=controller(stepper.omega))

    - `inputs`: `"lever"`, `"load"`, or both, instead of the scene's own, which apply
      before the first command and whose maximum sets the scale of tolerances. The lever
      is the slack tension or the force of a `ForceDuty` (N), the hand force of a
      `Lever`, the command of an `Actuator` or the pressure of a `Cylinder` (Pa), which
      follow with their dead time and lag, or the speed of a `Driller` (rad/s); the load
      is the torque of a `TorqueLoad` (N·m)
    - `solver`, `rtol`: as for `simulate`
    - `state`: of an earlier stepper, to go on from

    Between two calls an input stays what it was; a change is a jump, at which an
    elastic band gives or takes work at once. What is read is the state at the end of
    the last step, under the inputs of that step; before the first one the lever has not
    yet acted. `end_time` of the scene has no effect. A stop does not end it: the brake
    holds, and may be released.

    Each step is a separate integration, so that results depend on the lengths of the
    steps within the tolerance. Equal commands lead from equal states to equal states,
    to the last bit.

    Raises `InputError` for errors of the scene, unknown inputs and a state of another
    scene.

    Example:
        >>> stepper = sb.Stepper(scene, inputs=["lever"])
        >>> stepper.advance("0.2 s", lever="20 kN").time
        0.2
        >>> before = stepper.state()
        >>> stepper.advance("2 s").events[-1].name, stepper.omega
        ('stop', 0.0)
        >>> stepper.restore(before).time
        0.2
    """

    def __init__(
        self,
        scene: Scene,
        inputs: Sequence[str] | str = (),
        *,
        solver: Solver | None = None,
        rtol: float = 1e-10,
        state: Mapping[str, Any] | None = None,
    ) -> None:
        require_64_bits()
        held = functools.partial(held_inputs, inputs=inputs)
        scene, self.solver = checked_run(scene, solver, rtol, also=held)
        self.scene = scene
        self._held = held(scene)
        self.rtol = rtol
        limits = np.asarray(rtol), np.asarray(np.inf), np.asarray(10_000, np.int32)
        self._limits = RunLimits(limits[1], limits[2], _ATTEMPTS)
        self._numbers, self._packing = pack((scene, *limits))
        self._method = method_of(scene, self.solver)
        shapes = self._packing.shapes, solver_name(self.solver), sorted(self._held)
        self._digest = hashlib.sha256(
            self._numbers.tobytes() + repr(shapes).encode()
        ).hexdigest()
        self.time = float(np.asarray(scene.initial.time))
        self._begun = False
        self._record = record = self._integrate(
            self.time, self.time, None, None, self._held
        )
        self._y, self._mode = _at_end(record)
        if state is not None:
            self.restore(state)

    def _integrate(
        self,
        t: float,
        end: float,
        y: np.ndarray | None,
        mode: np.ndarray | None,
        held: Mapping[str, "HeldInput"],
    ) -> Record:
        """From one time to another, or as far as one call of the program comes."""
        shapes = tuple(
            InputShape(name, held_input.where, len(held_input.times))
            for name, held_input in held.items()
        )
        program, size = _program(self._packing, self._method, shapes)
        now = (
            np.full(size, np.nan)
            if y is None or mode is None
            else np.concatenate([y, mode])
        )
        points = [
            x
            for held_input in held.values()
            for x in (held_input.times, held_input.values)
        ]
        record: Record = program.call(
            np.concatenate([self._numbers, *points, [t, end], now])
        )
        if int(record.code) not in (Code.COMPLETED, Code.STEP_LIMIT):
            result = Result(
                self.scene,
                record,
                np.asarray(self.rtol),
                solver_name(self.solver),
                self._limits,
            )
            raise SimulationError(f"{result.status}: {result.message}", result)
        return record

    @property
    def _state_now(self) -> tuple[Any, Mode]:
        return unravel(self._y, self._record.y_like), unravel(
            self._mode, self._record.mode_like
        )

    @property
    def _label(self) -> Label:
        return Label(*(int(part) for part in self._state_now[1].label))

    @property
    def inputs(self) -> dict[str, float]:
        """The inputs as they are held now, in SI."""
        return {name: held.level for name, held in self._held.items()}

    @property
    def units(self) -> dict[str, str]:
        """Units of the inputs."""
        return {name: held.unit for name, held in self._held.items()}

    @property
    def holding(self) -> bool:
        """Whether the pulley is at rest."""
        return self._label.rests

    @property
    def omega(self) -> float:
        """Speed of the pulley (rad/s), exactly 0 while the brake holds it."""
        return float(self._state_now[0].omega)

    def advance(self, dt: float | str, **inputs: float | str) -> Advanced:
        """Advances by `dt` (s, or a text with a unit) with inputs that are held from
        now on, in SI or with a unit.

        Raises `InputError` for values that do not fit, and `SimulationError` where the
        step fails with a code; the stepper is then unchanged.
        """
        span, held = self._read(dt, inputs)
        t = self.time
        y = self._y
        mode = self._mode
        end = self.time + span
        record = self._record
        events = list[Event]()
        while t < end:
            record = self._integrate(t, end, y, self._on_pieces(mode, held), held)
            events += _events(record, first=not self._begun and t == self.time)
            t = float(record.t_end)
            (y, mode) = _at_end(record)
            pieces = unravel(mode, record.mode_like).pieces
            held = {
                name: dataclasses.replace(held_input, piece=int(pieces[name]))
                for name, held_input in held.items()
            }
        self.time = t
        self._y = y
        self._mode = mode
        self._held = held
        self._record = record
        self._begun = self._begun or span > 0
        return Advanced(t, events)

    def _read(
        self, dt: float | str, inputs: Mapping[str, float | str]
    ) -> tuple[float, dict[str, HeldInput]]:
        reader = NumberReader()
        held = dict(self._held)
        # a number may come from an array, as those of a controller do
        dt, *values = (
            x.item() if getattr(x, "ndim", None) == 0 else x  # pyright: ignore
            for x in (dt, *inputs.values())
        )
        span = reader.number(
            dt, Quantity("s", "length of the step", low=0.0), "dt", "s"
        )
        for name, entry in zip(inputs, values, strict=True):
            if name not in held:
                names = (
                    ", ".join(held) or "none: name them in Stepper(scene, inputs=[…])"
                )
                reader.fault(name, "is no input of this stepper", f"inputs are {names}")
                continue
            unit = held[name].unit
            value = reader.number(
                entry,
                Quantity(unit, name, low=0.0 if unit == "N" else None),
                name,
                unit,
            )
            held[name] = (
                held[name].with_command(self.time, value)
                if isinstance(value, float)
                else held[name]
            )
        if reader.faults:
            raise InputError(reader.faults)
        return span, held

    def _on_pieces(self, mode: np.ndarray, held: Mapping[str, HeldInput]) -> np.ndarray:
        unpacked: Mode = unravel(mode, self._record.mode_like)
        pieces = unpacked.pieces | {
            name: np.asarray(held_input.piece) for name, held_input in held.items()
        }
        flat = [
            np.ravel(leaf) for leaf in jax.tree.leaves(unpacked._replace(pieces=pieces))
        ]
        return np.concatenate(flat).astype(np.int32)

    # --- reading, saving and restoring the state -------------------------------------

    def series(self) -> Series:
        """All columns of a `Series` at the present time, each of one row.

        Example:
            >>> sb.Stepper(scene).series().omega
            array([24.])
        """
        y, mode = self._state_now
        probe = _seen(self._record.system, np.asarray(self.time), y, mode)
        return series_of(probe, self._record.system)  # pyright: ignore

    def __getitem__(self, name: str) -> Any:
        """A column of `series` at the present time by its name: a number, or one for
        each lining or node."""
        # (a series has no reserve where no load is held; here the next step may hold
        # one)
        columns = columns_by_name(self.series(), pairs=True)
        columns.setdefault("holding_reserve", np.full(1, np.nan))
        if name not in columns:
            raise KeyError(
                f"{name!r} is no column of this scene; there are {', '.join(columns)}"
            )
        value = np.asarray(columns[name])[0]
        return value.item() if np.ndim(value) == 0 else value

    __iter__ = None  # (columns are looked up, not counted)

    @property
    def mode(self) -> str:
        """The mode of the brake in words."""
        return str(self._label)

    def state(self) -> dict[str, np.ndarray]:
        """State to continue from, with the commands that wait in a dead time: arrays by
        name.

        `np.savez(file, **stepper.state())` saves it, and
        `stepper.restore(np.load(file))` continues from there.
        """
        arrays = {
            "scene": np.asarray(self._digest),
            "time": np.asarray(self.time),
            "begun": np.asarray(self._begun),
        }
        arrays |= {"y": self._y.copy(), "mode": self._mode.copy()}
        for name, held in self._held.items():
            points = np.stack([held.times, held.values])
            arrays |= {
                f"{name}_points": points,
                f"{name}_piece": np.asarray(held.piece),
            }
            arrays |= {f"{name}_history": np.asarray(held.commands[: held.count])}
        return arrays

    def restore(self, state: Mapping[str, Any]) -> "Stepper":
        """The stepper as it was when `state` was taken. Raises `InputError` for a state
        of another scene."""
        kept = {name: np.asarray(state[name]) for name in state}
        missing = set(self.state()) ^ set(kept)
        if missing or str(kept["scene"]) != self._digest:
            what = (
                f"has other entries ({', '.join(sorted(missing))})"
                if missing
                else "is of another scene"
            )
            raise input_error(
                "state",
                what,
                "of a stepper of the same scene, inputs, solver and tolerance",
            )
        self.time = float(kept["time"])
        self._begun = bool(kept["begun"])
        self._y = np.array(kept["y"])
        self._mode = np.array(kept["mode"], np.int32)
        for name, held in self._held.items():
            times, values = np.array(kept[f"{name}_points"])
            commands = [(t, value) for t, value in kept[f"{name}_history"].tolist()]
            piece = int(kept[f"{name}_piece"])
            self._held[name] = dataclasses.replace(
                held,
                times=times,
                values=values,
                piece=piece,
                commands=commands,
                count=len(commands),
            )
        # (columns are read under the inputs of the record)
        self._record = self._integrate(
            self.time, self.time, self._y, self._mode, self._held
        )
        return self

    def history(self) -> Scene:
        """The scene of what has happened so far: all commands as profiles, and the
        present time as its end.

        `simbrake.simulate(stepper.history())` is the same run in one piece, with its
        whole report.
        """
        commanded = _commanded(
            self.scene, [(held.where, held.history()) for held in self._held.values()]
        )
        return with_fields(commanded, end_time=np.asarray(self.time))

    def __repr__(self) -> str:
        inputs = ", ".join(
            f"{name} {number(held.level, held.unit)}"
            for name, held in self._held.items()
        )
        now = (
            f"t = {number(self.time, 's')}, {number(self.omega, 'rad/s')}, {self.mode}"
        )
        return f"Stepper({self.scene.brake.kind}: {now}; inputs: {inputs or 'none'})"
