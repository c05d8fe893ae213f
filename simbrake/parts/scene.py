"""Scene of one run: brake, duty, start and end; and warnings of unusual values."""

import abc
import dataclasses
import functools
import math
from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import Compiled
from .._base._faults import Fault, InputError, input_error
from .._base._numbers import ZERO, number, pretty
from .._base._part import (
    Numbers,
    Part,
    as_arrays,
    is_traced,
    leaves,
    part,
    parts_below,
    presence_below,
    quantity,
    structural,
)
from .._base._quantity import Scalar, meant_within, shown
from .._base._store import cached_by_values
from ..brakes.band import ParallelBands
from ..brakes.design import (
    USUAL_CIRCLE,
    AbstractBandBrake,
    AbstractBrake,
    AbstractLinings,
    Bandage,
    Brake,
    tension_shares,
    under_a_band,
    unloaded,
)
from ..friction import AbstractFriction, FrictionChange, Reads, needs, reads, remembers
from ..hybrid.arrays import Array
from ..hybrid.struct import AbstractClassVar, AbstractVar, with_fields
from ..loads import (
    AbstractLoad,
    Cylinder,
    Driller,
    Lever,
    Motor,
    RecordedMotion,
    TorqueLoad,
)
from ..phases import AfterTravel, AtHeight, AtTemperature, Phases, faults_of_want
from ..profiles import (
    AbstractProfile,
    FunctionProfile,
    Piece,
    faults_of_sign,
    starting_piece,
)
from ..shaft import (
    NO_TACKLE,
    AbstractAuxiliaryBrake,
    AbstractDryTorque,
    AbstractShaftTorque,
    TackleLoss,
)
from ..thermal.heat import FrictionHeat, Heat, PowerShares
from ..thermal.network import Wall, nodes_at, place_of
from ..wear import AbstractWearRate, Wear, faults_of_wear


class AbstractDuty(Part):
    """Duty of a brake: its load, and the profile of its lever.

    - `load`: `M_load(t, ω)`
    - `lever_field`: name of the field that holds the profile of the lever
    """

    lever_field: AbstractClassVar[str]
    wants: AbstractVar[str]
    if TYPE_CHECKING:  # (as in `AbstractBrake`)

        @property
        def load(self) -> AbstractLoad: ...
    else:
        load: AbstractVar[AbstractLoad]

    @property
    def lever(self) -> AbstractProfile | Phases:
        """Slack tension or actuator force over time (N), or in phases."""
        return getattr(self, self.lever_field)

    def load_piece(self, t: Array) -> Piece | None:
        """The piece of the load at the start of a run, `None` if there is only one."""
        if self.load.by_phases and isinstance(self.lever, Phases):
            return self.load.piece_in_phase(
                *self.lever.string_at(jnp.asarray(0, jnp.int32))
            )
        return starting_piece(self.load.profile, t)


class Duty(AbstractDuty):
    """Duty of a band brake.

    - `slack_tension`: `T_0(t) ≥ 0` in N, set by the lever at the slack end: on several
      alike rims (`Brake.rims`) that of each band, of a `MultiBandBrake` the sum of all;
      `load`: `M_load(t, ω)`

    - `wants`: what the verdict is to judge the run by, one of `rest`, `hold`, `lower`,
      `hoist`, `free`; empty: what follows from the lever and its course; in phases each
      says it

    The tension may come in `Phases`, which end by the state of the brake; so may the
    force of a `ForceDuty`.

    Example:
        >>> sb.Duty("6 kN", sb.HookLoad("60 t", "400 mm", 8))
        Duty(
          slack_tension=Constant(level=6 kN), load=HookLoad(mass=60 t, drum_radius=0.4
          m, line_count=8, gravity=9.80665 m/s², drag=0 N·m·s),
        )
    """

    slack_tension: AbstractProfile | Phases = part(AbstractProfile, "N")
    load: AbstractLoad = part(AbstractLoad)
    wants: str = structural(default="")
    lever_field: ClassVar[str] = "slack_tension"


class ForceDuty(AbstractDuty):
    """Duty of a disc brake or a double-shoe brake.

    - `force`: `F(t) ≥ 0` in N, with which the actuator presses each pad, or each shoe
      at its arm
    - `load`: `M_load(t, ω)`;  `wants`: as of a `Duty`

    Example:
        >>> sb.ForceDuty(sb.ramp(0.0, 45e3, 0.0, 0.25), 1500.0).lever.values
        array([    0., 45000.])
    """

    force: AbstractProfile | Phases = part(AbstractProfile, "N")
    load: AbstractLoad = part(AbstractLoad)
    wants: str = structural(default="")
    lever_field: ClassVar[str] = "force"


class Initial(Part):
    """Start of a run.

    - `omega` `ω_0` (rad/s), positive in the braking direction; or `hook_speed` (m/s),
      downwards, of a load on a hook
    - `elongation` `x_0` (m) of an elastic band;  `time` `t_0` (s)
    - `block_height` (m) of the travelling block above the floor, for phases that end at
      a height

    Example:
        >>> sb.Initial("230 rpm")
        Initial(omega=24.0855 rad/s, elongation=0 m, time=0 s)
    """

    omega: Scalar | None = quantity("rad/s", "initial speed", default=None)
    elongation: Scalar = quantity(
        "m", "initial elongation of the band", low=0.0, default=0.0
    )
    time: Scalar = quantity("s", "time at the start", default=0.0)
    hook_speed: Scalar | None = quantity(
        "m/s", "initial speed of the hook", default=None
    )
    block_height: Scalar | None = quantity(
        "m", "height of the block at the start", default=None
    )

    def faults_of_presence(self, path: str) -> list[Fault]:
        if self.omega is not None or self.hook_speed is not None:
            return []
        hint = "give a number, or of a load on a hook `hook_speed`"
        return [Fault(f"{path}.omega", "is missing and cannot be absent", hint)]


class AbstractLimits(Part):
    """Permissible values of what a run has as one number: they change nothing in it. A
    field for each, by its name."""

    @property
    def given(self) -> dict[str, Any]:
        """Those that are given, by name."""
        return {leaf.path: leaf.value for leaf in leaves(self)}

    @abc.abstractmethod
    def faults_with(self, path: str, scene: "Scene") -> list[Fault]:
        """Errors of values that no run of the scene has."""


class Scene(Part):
    """One run of a brake: a band brake under a `Duty`, a disc or double-shoe brake
    under a `ForceDuty`.

    Every number is an array leaf in SI units; `None` means that this physics is absent.

    - `end_time` (s): end time of the run, also after the stop; of a duty in phases, at
      which the last has to be over
    - `heat`: the thermal network, `None` without temperatures
    - `wear`: wear of the linings, `None` without wear
    - `power_shares`: how the friction power splits into heat, electrical and mechanical
      power; `None`: all is heat
    - `shaft`: torques on the shaft beside load and brake: auxiliary brakes, bearings,
      loss of the tackle
    - `motor` on the shaft that hoists, and holds back what is lowered
    - `limits`: permissible values of metrics for the verdict, as
      `Limits(max_drum_speed="260 rpm")`

    Example:
        >>> brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35))
        >>> scene = sb.Scene(brake, sb.Duty("6 kN", 0), sb.Initial(24), end_time="12 s")
        >>> scene.initial
        Initial(omega=24 rad/s, elongation=0 m, time=0 s)
    """

    brake: AbstractBrake
    duty: AbstractDuty
    initial: Initial
    end_time: Scalar = quantity("s", "end of the run")
    heat: Heat | None = None
    wear: Wear | None = None
    power_shares: PowerShares | None = None
    shaft: tuple[AbstractShaftTorque, ...] = ()
    limits: AbstractLimits | None = None
    motor: Motor | None = None

    @property
    def as_run(self) -> "Scene":
        """The scene without what no run depends on: limits compile nothing anew."""
        return self if self.limits is None else dataclasses.replace(self, limits=None)

    @property
    def start_speed(self) -> Any:
        """Speed of the pulley at the start (rad/s), also where that of the hook is
        given."""
        load = self.duty.load
        hook_speed = self.initial.hook_speed
        if hook_speed is None:
            assert self.initial.omega is not None
            return self.initial.omega
        return (
            hook_speed
            / load.on_layer(load.layers and load.layers.first_layer()).travel()
        )

    @property
    def network(self) -> Heat:
        """The thermal network, one without bodies where the scene has none."""
        return _NO_HEAT if self.heat is None else self.heat

    @property
    def lever(self) -> AbstractProfile | Phases:
        """The lever as each band has it: those of a driller (`Lever`) pull on the bands
        of all rims."""
        lever = self.duty.lever
        rims = self.brake.rims
        if rims == 1:
            return lever

        def of_one(part: Any) -> Any:
            if not isinstance(part, Lever):
                return part
            return with_fields(part, slack_arm=rims * jnp.asarray(part.slack_arm))

        return jax.tree.map(of_one, lever, is_leaf=lambda part: isinstance(part, Lever))

    @property
    def torques(self) -> tuple[AbstractShaftTorque, ...]:
        """The torques on the shaft, a loss of the tackle as the lines strung have
        it."""
        return tuple(law.strung(self.duty.load.lines) for law in self.shaft)

    @property
    def heated(self) -> bool:
        """Whether temperatures are simulated."""
        return self.heat is not None


_NO_HEAT = Heat(())


def paths_without_meaning(scene: Scene) -> tuple[str, ...]:
    """Paths of parameters that the scene's kind of brake does not have; they are
    neither shown nor written."""
    return () if isinstance(scene.brake, Brake) else ("initial.elongation",)


def band_brake(scene: Scene) -> Brake:
    """Return the band brake of a scene. Raises `InputError` for another kind of
    brake."""
    return under_a_band(scene.brake)


def banded_brake(scene: Scene) -> AbstractBandBrake:
    """Return the brake of a scene, with one band or several. Raises `InputError` for a
    brake without a band."""
    return (
        scene.brake
        if isinstance(scene.brake, AbstractBandBrake)
        else under_a_band(scene.brake)
    )


def has_load(scene: Scene) -> bool:
    """Whether there is a load on a pulley at rest at any time; in doubt there is
    (traced numbers, custom courses)."""
    load = scene.duty.load
    if not isinstance(load, TorqueLoad):
        return True
    values = getattr(load.profile, "level", getattr(load.profile, "values", None))
    return not isinstance(values, np.ndarray) or bool(np.any(values))


def require_scene(scene: object) -> None:
    """Raise `InputError` for anything else than a scene."""
    if not isinstance(scene, Scene):
        hint = "give a simbrake.Scene; simbrake.read_scene(file) reads one"
        raise input_error("scene", f"{shown(scene)} is not a scene", hint)


def faults(scene: Scene) -> list[Fault]:
    """All errors of a scene. Traced numbers are not checked."""
    require_scene(scene)
    return _faults(scene)[0]


def _faults(scene: Scene) -> tuple[list[Fault], Numbers]:
    numbers = Numbers(scene)
    errors = numbers.faults() + (presence_below(scene) or _faults_of_kinds(scene))
    if not errors and not numbers.traced:
        errors = list(_faults_together(scene.as_run))
        if scene.limits is not None:
            errors += scene.limits.faults_with("limits", scene)
    return errors, numbers


@cached_by_values(lambda scene: scene)
def _faults_together(scene: Scene) -> tuple[Fault, ...]:
    """Errors of a scene whose numbers are in range, its limits apart: of each of its
    parts, and between them."""
    parts = [(path, value) for path, value, _ in parts_below(scene)]
    # (a law that is not finite would make every lining lock itself)
    errors = (
        [*_faults_of_parts(scene, parts)]
        or _faults_of_own(scene, parts)
        or [*_faults_of_band(scene)]
    )
    return tuple(dict.fromkeys([*errors, *_faults_of_start(scene)]))


def _faults_of_start(scene: Scene) -> Iterator[Fault]:
    initial = scene.initial
    brake = scene.brake
    if not scene.end_time > initial.time:
        yield Fault(
            "end_time",
            f"{float(scene.end_time):g} s is not after the start",
            "it must be later",
        )
    if initial.hook_speed is not None:
        if scene.duty.load.travel() is None:
            yield Fault(
                "initial.hook_speed",
                "has no meaning: the load hangs on no hook",
                "give `omega`",
            )
        if initial.omega is not None:
            yield Fault(
                "initial.omega", "is given beside `hook_speed`", "give one of them"
            )
    if initial.elongation == 0.0:
        return
    if not isinstance(brake, Brake):
        why = "has rigid bands" if brake.banded else "has no band"
        yield Fault(
            "initial.elongation", f"a {brake.words.brake} {why}", "leave it out"
        )
    elif brake.band.stiffness is None:
        yield Fault(
            "initial.elongation",
            "a rigid band has no elongation",
            "give brake.band.stiffness",
        )


#: the parts of a scene, with their paths
_Parts = list[tuple[str, Any]]


def _faults_of_parts(scene: Scene, parts: _Parts) -> Iterator[Fault]:
    lever = f"duty.{scene.duty.lever_field}"
    for path, value in parts:
        if isinstance(value, Part):
            yield from value.faults(path)
        if (
            isinstance(value, AbstractProfile)
            and value.controls_speed
            and not path.startswith(lever)
        ):
            what = "is a lever that depends on the speed"
            yield Fault(path, what, "give a profile, a function of the time")
        if isinstance(value, FrictionChange) and isinstance(value.when, AtTemperature):
            yield from faults_of_place(
                value.when, scene.network.hot_places, f"{path}.when"
            )
    yield from _faults_of_heat(scene)
    if scene.wear is not None:
        yield from faults_of_wear(
            scene.wear, scene.brake, scene.duty.lever, scene.network
        )
    yield from _faults_of_duty(scene, lever)
    yield from _faults_of_shaft(scene)


def _faults_of_shaft(scene: Scene) -> Iterator[Fault]:
    storing = scene.network.storing_places
    tackles = [i for i, law in enumerate(scene.shaft) if isinstance(law, TackleLoss)]
    if scene.duty.load.lines is None:
        yield from [Fault(f"shaft[{i}]", *NO_TACKLE) for i in tackles]
    hint = "leave it out: there is one tackle"
    yield from [
        Fault(
            f"shaft[{i}]",
            f"is the loss of the tackle again, as shaft[{tackles[0]}] is",
            hint,
        )
        for i in tackles[1:]
    ]
    for i, law in enumerate(scene.shaft):
        path = f"shaft[{i}]"
        if isinstance(law, AbstractDryTorque) and scene.brake.resolved:
            what = "dry friction of the shaft is not modelled for linings that move individually"
            yield Fault(
                path, what, "leave it out, or use a brake whose linings act as one"
            )
        if law.place is not None and law.place not in storing:
            what = f"there is no place {law.place!r} with a heat capacity"
            yield Fault(
                f"{path}.place", what, "a body of the heat part, or the face of a wall"
            )


class _Course(NamedTuple):
    """What lever and motor do in a phase or in a whole duty, and what the duty wants,
    with their paths."""

    lever: AbstractProfile
    lever_path: str
    wants: str
    wants_path: str
    speed: Any
    speed_path: str


def _faults_of_duty(scene: Scene, path: str) -> Iterator[Fault]:
    brake = scene.brake
    lever = scene.duty.lever
    motor = scene.motor
    if lever.controls_speed:
        if isinstance(brake, Brake) and brake.band.stiffness is not None:
            what = "a lever that holds the speed needs a rigid band"
            yield Fault("brake.band.stiffness", what, "leave it out")
        if read_by_linings(scene).p or scene.network.flash is not None:
            yield Fault(
                path, "cannot hold the speed with an implicit coefficient of friction"
            )
    yield from faults_of_sign(lever, path, "N")
    if isinstance(lever, Phases):
        courses = [
            _Course(
                phase.lever,
                f"{at}.lever",
                phase.wants,
                f"{at}.wants",
                phase.motor,
                f"{at}.motor",
            )
            for at, phase in lever.located(path)
        ]
        yield from _faults_of_phases(scene, lever, path)
    else:
        speed = None if motor is None else motor.speed
        speed_path = "motor.speed"
        if isinstance(lever, RecordedMotion):
            speed = lever.speed
            speed_path = f"{path}.speed"
        courses = [
            _Course(lever, path, scene.duty.wants, "duty.wants", speed, speed_path)
        ]
        yield from _faults_of_whole(scene, lever, path)
    if motor is not None and all(course.speed is None for course in courses):
        hint = (
            "give `motor = …` in a phase"
            if isinstance(lever, Phases)
            else "give motor.speed"
        )
        yield Fault("motor", "never runs: no speed is given for it to follow", hint)
    for course in courses:
        yield from _faults_of_course(scene, course)


def _faults_of_course(scene: Scene, course: _Course) -> Iterator[Fault]:
    lever = course.lever
    motor = scene.motor
    load = scene.duty.load
    if motor is not None and course.speed is not None:
        speeds = np.asarray(course.speed.values)
        most = float(motor.max_speed)
        if (
            isinstance(scene.brake, Brake)
            and scene.brake.band.segments is not None
            and np.min(speeds) < 0
        ):
            what = (
                "hoists, and a band in segments is never open: its linings would "
                "ride with the pulley without end"
            )
            yield Fault(course.speed_path, what, "leave out brake.band.segments")
        if (fastest := float(np.max(np.abs(speeds)))) > most:
            what = f"{fastest:g} rad/s is above the motor's {most:g} rad/s"
            yield Fault(
                course.speed_path, what, "a lower speed, or another motor.max_speed"
            )
    if isinstance(lever, Driller):
        speeds = np.asarray(lever.speed.values)
        if np.max(speeds) <= 0 and np.any(speeds < 0):
            hint = "give a speed of lowering, or the scene a `motor` that follows it"
            yield Fault(
                f"{course.lever_path}.speed",
                "is never followed: a brake cannot hoist",
                hint,
            )
    keeps_speed = lever.controls_speed and not (
        isinstance(lever, Driller) and lever.speed.values[-1] <= 0.0
    )
    if course.wants in ("rest", "hold") and keeps_speed:
        what = f"is {course.wants}, and the lever is to keep a speed"
        yield Fault(
            course.wants_path, what, 'give wants = "lower", or a speed that ends at 0'
        )
    if (
        course.wants == "lower"
        and isinstance(load, TorqueLoad)
        and float(load.profile.scale()) == 0.0
    ):
        what = "is lower, and there is no load to lower"
        yield Fault(course.wants_path, what, "give `duty.load` a torque")


def _faults_of_whole(
    scene: Scene, lever: AbstractProfile, path: str
) -> Iterator[Fault]:
    """Errors of a duty that is not in phases."""
    duty = scene.duty
    motor = scene.motor
    start = float(scene.initial.time)
    yield from faults_of_want(duty.wants, "duty")
    if duty.wants == "hoist" and motor is None:
        yield Fault(
            "duty.wants", "is hoist, and the scene has no motor", "give it a `motor`"
        )
    if duty.load.by_phases:
        hint = f"give {path} in phases (`Phases`), or another load"
        yield Fault("duty.load", "needs a duty with phases", hint)
    if isinstance(lever, RecordedMotion):
        if motor is not None and motor.speed is not None:
            yield Fault(
                "motor.speed", "has no effect beside a recorded motion", "leave it out"
            )
        if motor is None and np.min(np.asarray(lever.speed.values)) < 0:
            yield Fault(
                "motor",
                "is missing, and the recorded motion hoists",
                "give the scene a `Motor`",
            )
    correcting = {
        path: lever.corrects_position,
        "motor": motor is not None and motor.position_gain is not None,
    }
    for where, corrects in correcting.items():
        if corrects and start != 0.0:
            what = f"counts from the time 0, and the run begins at {start:g} s"
            hint = "begin the run at 0 s, or give the duty in phases"
            yield Fault(f"{where}.position_gain", what, hint)


def _faults_of_phases(scene: Scene, lever: Phases, path: str) -> Iterator[Fault]:
    """Errors between the phases of a duty and what ends them."""
    load = scene.duty.load
    motor = scene.motor
    if motor is not None and motor.speed is not None:
        yield Fault(
            "motor.speed",
            "has no effect on a duty in phases",
            "give `motor` in its phases",
        )
    if scene.duty.wants:
        yield Fault(
            "duty.wants",
            "has no effect on a duty in phases",
            "give `wants` in its phases",
        )
    if load.by_phases:
        yield from load.faults_in_phases(
            "duty.load", len(lever.each), lever.stands_range
        )
    for phase_path, phase in lever.located(path):
        end = phase.until
        if isinstance(phase.lever, RecordedMotion):
            what = "is the motion of a whole run, not of a phase"
            yield Fault(f"{phase_path}.lever", what, "give it as the lever")
        if isinstance(end, AfterTravel | AtHeight) and load.travel() is None:
            what = "never comes: the load hangs on no hook"
            hint = "give a load with a hook"
            yield Fault(f"{phase_path}.until", what, hint)
        elif isinstance(end, AtHeight) and scene.initial.block_height is None:
            hint = "give `initial.block_height`, the height of the block at the start"
            yield Fault(
                f"{phase_path}.until",
                "has no meaning without the height at the start",
                hint,
            )
        if phase.auxiliary is not None and not any(
            isinstance(law, AbstractAuxiliaryBrake) for law in scene.shaft
        ):
            hint = "give `shaft` an EddyCurrentBrake or a HydrodynamicBrake"
            yield Fault(
                f"{phase_path}.auxiliary",
                "has no effect: there is no auxiliary brake",
                hint,
            )
        if phase.motor is not None and motor is None:
            yield Fault(
                f"{phase_path}.motor",
                "has no effect: the scene has no motor",
                "give it a `motor`",
            )
        if isinstance(end, AtTemperature):
            yield from faults_of_place(
                end, scene.network.hot_places, f"{phase_path}.until"
            )
        if not phase.string_on_hook and not load.by_phases:
            yield Fault(
                f"{phase_path}.string_on_hook",
                "has no effect on this load",
                "give a `StringLoad`",
            )


def faults_of_place(
    end: AtTemperature, places: Collection[str], path: str
) -> list[Fault]:
    """Error of the temperature of a place that no run of a scene with these `places`
    has."""
    if end.of in places:
        return []
    why = f"never comes: no temperature of the {end.of} is simulated"
    hint = (
        f"there are: {', '.join(places)}"
        if places
        else "give the scene a heat part that names it"
    )
    return [Fault(path, why, hint)]


def _faults_of_kinds(scene: Scene) -> list[Fault]:
    """Error where brake and duty do not match."""
    name = scene.brake.words.brake
    pressed = not scene.brake.banded
    if pressed and isinstance(scene.duty, Duty):
        what = f"a {name} has no band"
        return [
            Fault(
                "duty.slack_tension",
                what,
                "give the force of its actuator: `ForceDuty`, key `force`",
            )
        ]
    if not pressed and isinstance(scene.duty, ForceDuty):
        what = f"a {name} is pressed by its band"
        return [
            Fault(
                "duty.force",
                what,
                "give the tension of its slack end: `Duty`, key `slack_tension`",
            )
        ]
    return []


def _is_own(part: Any) -> bool:
    """Whether a user wrote the law, or a function in it."""
    return type(part).__module__.partition(".")[0] != __name__.partition(".")[
        0
    ] or isinstance(part, FunctionProfile)


def _faults_of_own(scene: Scene, parts: _Parts) -> list[Fault]:
    """Laws and profiles of a user that are not finite where the run begins."""
    own = [(path, part) for path, part in parts if _is_own(part)]
    if not own:
        return []
    t = jnp.asarray(scene.initial.time)
    omega = jnp.asarray(scene.start_speed)
    speed = abs(float(omega)) * float(scene.brake.track_radius)
    errors = dict[str, Fault]()
    each = ((), (1,), (scene.brake.linings.count,))

    def look(
        path: str,
        law: Any,
        where: str,
        function: Callable[..., Any],
        *arguments: Any,
        shapes: Any = ((),),
    ) -> None:
        try:
            given = function(*arguments)
            value = np.asarray(given, np.float64)
        except Exception:  # which the run raises, with the line of the user's code
            return
        if path in errors:
            return
        if given is None:
            errors[path] = Fault(
                path, f"{type(law).__name__} gives nothing", "return its number"
            )
        elif value.shape not in shapes:
            what = f"{type(law).__name__} gives an array of the shape {value.shape}"
            errors[path] = Fault(path, what, "return one number")
        elif not np.all(np.isfinite(value)):
            worst = value[~np.isfinite(value)].flat[0]
            what = f"{type(law).__name__} is {worst:g} at {where}"
            errors[path] = Fault(path, what, "make it finite where a run begins")

    for i, (pair, (law, _, path, _)) in enumerate(
        zip(scene.brake.pairs, pairs_of(scene), strict=True)
    ):
        if any(below.startswith(path) for below, _ in own):
            rubbing = scene.brake.rubbing_part(pair)
            T = sensed_at_start(scene, i)
            for v in (0.0, speed):
                try:
                    contact = unloaded(
                        rubbing, jnp.full(scene.brake.linings.count, v), T, t
                    )
                except Exception:  # of its states, which are checked by themselves
                    continue
                where = f"v = {v:g} m/s" + ("" if contact.p is None else ", p = 0 Pa")
                where += "" if T is None else f", T = {np.min(T):g} K"
                for coefficient in (law.static, law.kinetic):
                    look(path, law, where, coefficient, contact, shapes=each)
    instant = f"t = {float(t):g} s"
    for path, course in own:
        if isinstance(course, AbstractProfile) and not course.controls_speed:
            look(path, course, instant, lambda x: x.value(t, x.first_piece(t)), course)
    for path, rate in own:
        if isinstance(rate, AbstractWearRate):
            T = sensed_at_start(scene, 0)
            where = f"p = 0 Pa, v = {speed:g} m/s"
            where += "" if T is None else f", T = {np.min(T):g} K"
            look(path, rate, where, rate, jnp.zeros(()), jnp.asarray(speed), T)
    load = scene.duty.load
    turning = f"{instant}, ω = {float(omega):g} rad/s"
    if _is_own(load):
        at = t, omega, scene.duty.load_piece(t), jnp.zeros(())
        look("duty.load", load, turning, load.torque_by_angle, *at)
    for i, law in enumerate(scene.shaft):
        if _is_own(law):
            at = t, omega, starting_piece(law.profile, t), 0.0
            look(f"shaft[{i}]", law, turning, law.torque, *at)
    return list(errors.values())


def _faults_of_band(scene: Scene) -> Iterator[Fault]:
    brake = scene.brake
    if not brake.banded:
        return
    if brake.in_series or not isinstance(brake, Brake) or brake.band.stiffness is None:
        hint = (
            "a rigid band cannot hold such a lining: make it shorter, lower its "
            "friction, or give the band a stiffness"
        )
        if brake.in_series:
            hint = "a staged brake cannot have it: make the lining shorter, or lower its friction"
        yield from [
            Fault(f"brake.{brake.angle_path(i - 1)}", why, hint)
            for i, why in locked(scene).items()
        ]
    if brake.in_series and scene.duty.lever.controls_speed:
        yield Fault(
            "duty.slack_tension",
            "cannot hold the speed of a staged brake",
            "give the slack tension",
        )
    if brake.in_series and scene.network.flash is not None:
        yield Fault("heat.flash", "is not available for a staged brake", "leave it out")


def check_scene(scene: Scene) -> None:
    """Check a scene. Raises `InputError` with all errors.

    Example:
        >>> sb.check_scene(scene)  # nothing is wrong
    """
    errors = faults(scene)
    if errors:
        raise InputError(errors)


def checked(scene: Scene) -> Scene:
    """Return the checked scene, its numbers as arrays. Raises `InputError` with all
    errors."""
    require_scene(scene)
    errors, numbers = _faults(scene)
    if errors:
        raise InputError(errors)
    return scene if numbers.plain else as_arrays(scene)


def warnings(scene: Scene) -> list[str]:
    """Warnings of a scene that is valid but unusual."""
    if is_traced(scene):
        return []
    then = (
        "it never slips as long as that lasts"
        if scene.brake.banded
        else "a run ends as soon as its force acts"
    )
    messages = [f"self_locking: {why}; {then}" for why in locked(scene).values()]
    for i, jacket in scene.network.jackets.items():
        messages += [
            f"outside_range: heat.links[{i}]: Dittus–Boelter: {words}"
            for words in jacket.outside_range()
        ]
    brake = scene.brake
    messages += did_you_mean(
        brake, scene.duty.load, float(scene.start_speed), scene.network
    )
    messages += [*_of_other_sizes(scene)] or _of_other_ratios(brake, scene.duty.load)
    messages += _in_bar(scene)
    if not (
        isinstance(brake, Brake) and isinstance(brake.band.stiffness, ParallelBands)
    ):
        return messages
    linings_read = read_by_linings(scene)
    if not (linings_read.T or linings_read.p or remembers(brake.linings.friction)):
        return messages
    shares = np.asarray(
        tension_shares(brake, sensed_at_start(scene), scene.initial.time)
    )
    if np.ptp(shares) > 1e-9:
        text = ", ".join(f"{share:.4g}" for share in shares)
        messages.append(
            f"unequal_bands: the bands carry {text} of the tension; their heat and "
            "pressure are taken as the mean "
            "(a `MultiBandBrake` has those of each)"
        )
    return messages


#: of a staged brake with heat: error of a pair without a place for its heat, and how to
#: build one
_MISSING_PAIR = {
    "friction": (
        "is missing: the friction heat of linings and rim (internal pair) would enter no body",
        "name its places: `FrictionHeat(metal, lining, partition)`, or build the "
        "network with `lumped_heat` or "
        "`layered_heat`, linings included",
    ),
    "external": (
        "is missing: the friction heat of band and linings (external pair) would enter no body",
        "build the network, linings and band included, and give it to "
        "`with_external_pair(heat, partition)`",
    ),
}


def _faults_of_heat(scene: Scene) -> Iterator[Fault]:
    heat = scene.network
    n = scene.brake.linings.count
    errors = (
        heat.faults_with("heat", n, len(scene.brake.linings_of_rims))
        if scene.heated
        else []
    )
    if errors:
        yield from errors
        return
    if heat.external is not None and not scene.brake.in_series:
        yield Fault(
            "heat.external",
            "has no effect",
            "only a staged brake (`brake.bandage`) has an external pair",
        )
    for i, (law, pair, where, field) in enumerate(pairs_of(scene)):
        if pair is None:
            if scene.heated and scene.brake.in_series:
                # its heat would leave the network as lost and heat no body
                yield Fault(f"heat.{field}", *_MISSING_PAIR[field])
            elif needs(law, n).T:
                hint = (
                    f"give the scene a heat part whose `{field}` names the places "
                    "that the heat enters"
                )
                yield Fault(
                    "heat",
                    f"is missing, but friction law {where} depends on the temperature",
                    hint,
                )
            continue
        bounds = law.temperature_range()
        T = sensed_at_start(scene, i)
        if bounds is None or T is None:
            continue
        low, high = (np.broadcast_to(np.asarray(bound), T.shape) for bound in bounds)
        outside = ~((low <= T) & (high >= T))
        if outside.any():
            first = int(np.argmax(outside))
            table = f"{low[first]:g}…{high[first]:g} K"
            what = f"the table of {table} does not cover the start at {T.min():g}…{T.max():g} K"
            yield Fault(where, what, "extend the table; it is not extrapolated")
    for i in heat.pressed:
        pair = "internal" if heat.stays_covered(heat.links[i]) else "external"
        if scene.brake.rubbing_part(pair).area is None:
            hint = f"the contact law of heat.links[{i}] depends on the pressure"
            yield Fault(
                f"brake.{scene.brake.pairs[pair].field}.area", "is missing", hint
            )
    if heat.flash is not None:
        if not scene.brake.banded:
            what = f"is not available for a {scene.brake.words.brake}"
            yield Fault("heat.flash", what, "leave it out")
            return
        if isinstance(scene.brake, Brake) and scene.brake.band.segments is not None:
            yield Fault(
                "heat.flash",
                "is not modelled for a band in segments",
                "leave out one of the two",
            )
        if not read_by_linings(scene).T:
            yield Fault(
                "heat.flash",
                "has no effect",
                "the friction law does not depend on the temperature",
            )
        if heat.flash.hardness is None and scene.brake.linings.area is None:
            where = f"brake.{scene.brake.pairs['external'].field}.area"
            yield Fault(
                where, "is missing", "the flash temperature depends on the pressure"
            )


def pairs_of(
    scene: Scene,
) -> list[tuple[AbstractFriction, FrictionHeat | None, str, str]]:
    """Friction laws with the places of their heat, their paths, and the field of the
    heat part that names these."""
    brake = scene.brake
    law = scene.brake.linings.friction
    friction = scene.network.friction
    external = scene.network.external
    if not (isinstance(brake, Brake) and brake.bandage is not None):
        return [
            (
                law,
                friction,
                f"brake.{brake.pairs['external'].field}.friction",
                "friction",
            )
        ]
    return [
        (law, external, "brake.linings.friction", "external"),
        (brake.bandage.friction, friction, "brake.bandage.friction", "friction"),
    ]


def read_by_linings(scene: Scene) -> Reads:
    """Inputs of the linings' friction law on the band (staged), else on the rim, as far
    as the scene has them."""
    (law, pair, *_), *_ = pairs_of(scene)
    linings = scene.brake.linings
    return reads(law, linings.count, T=pair is not None, p=linings.area is not None)


def sensed_at_start(scene: Scene, number: int = 0) -> np.ndarray | None:
    """Temperatures (K) that the friction law of a pair sees at the start, `None` where
    the scene has none.

    - `number` of the pair: the first is that on which the lever acts, the last (−1)
      that on the rim
    """
    _, pair, *_ = pairs_of(scene)[number]
    if pair is None or pair.sensor is None:
        return None
    name, face = place_of(pair.sensor)
    body = scene.network.by_name[name]
    T = np.broadcast_to(
        np.asarray(getattr(body, "temperature", np.nan), float), (body.count,)
    )
    T = T[nodes_at(body, face)]
    rims = scene.brake.linings_of_rims
    T = np.repeat(T, rims) if rims and T.size == len(rims) else T
    return np.broadcast_to(T, (scene.brake.linings.count,))


@functools.partial(Compiled, quick=True)
def _static_friction(linings: AbstractLinings, T: Array | None, t: Array) -> Array:
    f = linings.friction.static(unloaded(linings, jnp.zeros(linings.count), T, t))
    return jnp.broadcast_to(f, (linings.count,))


def remembering_at_start(
    scene: Scene,
) -> list[tuple[AbstractLinings | Bandage, np.ndarray | None]]:
    """Linings whose law of friction has internal states, with the temperatures (K) that
    it sees at the start."""
    rubbing = [scene.brake.rubbing_part(pair) for pair in scene.brake.pairs]
    return [
        (part, sensed_at_start(scene, i))
        for i, part in enumerate(rubbing)
        if remembers(part.friction)
    ]


def static_friction(scene: Scene) -> np.ndarray:
    """Coefficient up to which each lining sticks at the start, on the rim, or on the
    band of a staged brake."""
    T = sensed_at_start(scene)
    return np.asarray(_static_friction(scene.brake.linings, T, scene.initial.time))


@functools.partial(Compiled, quick=True)
def _self_locking(brake: AbstractBrake, f: Array) -> Array:
    return brake.self_locking(f)


def self_locking_ratios(scene: Scene) -> np.ndarray:
    """Self-locking ratio of each lining with its static friction at the start, of a
    band `f tan(β/2)`: locking at 1."""
    return np.asarray(_self_locking(scene.brake, static_friction(scene)))


def locked(scene: Scene) -> dict[int, str]:
    """Self-locking linings (from 1) with their static friction, of a band
    `f tan(β/2) ≥ 1`; the reason in words."""
    near = self_locking_ratios(scene)
    return {
        int(i) + 1: scene.brake.locking_words(int(i) + 1, float(near[i]))
        for i in np.flatnonzero(near >= 1.0)
    }


# --- unusual for drilling drawworks: warnings, not errors ---------------------------

_DRUMEANU = "Drumeanu & Antonescu 2003, band brakes of drawworks"
#: coefficient of friction, wrap angle (deg), rim temperature (°C): low, high
FRICTION = (0.35, 0.65)
WRAP = (270.0, 325.0)
RIM = (300.0, 800.0)
#: linings of a band; conductivities (W/(m·K)) of rims and linings
LININGS = (8.0, 26.0)
RIM_CONDUCTIVITY = (38.0, 163.0)
LINING_CONDUCTIVITY = (0.4, 1.5)


def _unusual(
    what: str, low: float, high: float, usual: tuple[float, float], words: str
) -> list[str]:
    """Warning of values from `low` to `high` outside the usual range; `words` describe
    that range."""
    # the angles of equal linings add up to a wrap with rounding
    slack = 1e-9 * usual[1]
    within = usual[0] - slack <= low and high <= usual[1] + slack
    return (
        []
        if within
        else [f"unusual: {what}, {words.format(f'{usual[0]:g}…{usual[1]:g}')}"]
    )


def plausibility(scene: Scene, peak_rim: float | None = None) -> list[str]:
    """Warnings of parameters that are unusual for drawworks brakes: usual range,
    source, reason.

    - static coefficient of friction 0.35…0.65, wrap 270…325°, rim at most 800 °C:
      Drumeanu & Antonescu (2003); Z has cases down to 0.1, and a single stop stays far
      below 300 °C, so that there is no warning for a cool rim
    - 8…26 linings: Z;  conductivity of rim 38…163 and linings 0.4…1.5 W/(m·K): V,
      tables 1 and 2, and textbooks
    - `peak_rim`: highest rim temperature (K) of a run of it, if there was one
    """
    if is_traced(scene):
        return []
    messages = list[str]()
    brake = scene.brake
    heat = scene.network
    if brake.banded:  # the sources are about band brakes
        f = static_friction(scene)
        values = (
            f"{f.min():.4g}" if np.ptp(f) < 1e-12 else f"{f.min():.4g}…{f.max():.4g}"
        )
        why = "tensions depend on it exponentially (Z computes cases down to 0.1)"
        what = f"static coefficient of friction {values}"
        messages += _unusual(
            what, f.min(), f.max(), FRICTION, f"usual are {{}} ({_DRUMEANU}); {why}"
        )
        for linings in brake.bands_of_linings:
            wrap = math.degrees(float(np.sum(np.asarray(linings.weights))))
            n = linings.count
            why = "the grip of the band depends on it exponentially"
            messages += _unusual(
                f"wrap {wrap:.5g}°",
                wrap,
                wrap,
                WRAP,
                f"usual are {{}}° ({_DRUMEANU}); {why}",
            )
            if not getattr(linings, "continuous", False):
                messages += _unusual(f"{n} linings", n, n, LININGS, "usual are {} (Z)")
    if peak_rim is not None:
        T = peak_rim - ZERO
        why = "properties of steel and linings are not known that hot"
        words = f"usual in heavy service are {{}} °C ({_DRUMEANU}); {why}"
        # a single stop leaves it cooler
        messages += _unusual(f"rim at {T:.0f} °C", max(T, RIM[0]), T, RIM, words)
    walls = {wall.name: wall for wall in heat.walls}
    for name, place, usual in (
        ("rim", heat.rim, RIM_CONDUCTIVITY),
        ("linings", heat.linings, LINING_CONDUCTIVITY),
    ):
        wall = walls.get(place_of(place)[0]) if place else None
        if wall is not None:
            value = float(wall.material.conductivity)
            words = "usual are {} (V, tables 1 and 2); is the unit right?"
            messages += _unusual(
                f"{name} with {value:.4g} W/(m·K)", value, value, usual, words
            )
    return messages


# --- values in another unit than was meant ------------------------------------------


#: inertia (kg·m²) of a drawworks' drum, whose hook never carries less than the mass
#: (kg): the block alone is heavier
_DRUM = 100.0
_BLOCK = 1000.0
#: track speeds (m/s) of brakes stay below; temperatures (K) of brakes and air lie above
_FAST = 60.0
_COLD = 200.0
#: gauge pressure (Pa) that moves no brake
_BREATH = 1000.0
#: flow of a coolant (m³/s) above those of drawworks
_RIVER = 0.5
#: least and most lengths (m) and areas (m²) of drawworks by the last names of their
#: paths, wide
_OF_DRAWWORKS = {
    **dict.fromkeys(
        ("radius", "band_radius", "drum_radius", "inner_radius", "outer_radius", "pin"),
        (0.1, 3.0),
    ),
    **dict.fromkeys(
        ("lining_radius", "mass_radius", "slack_end", "tight_end"), (0.1, 3.0)
    ),
    **dict.fromkeys(("width", "arm"), (0.03, 6.0)),
    **dict.fromkeys(("thickness", "clearance", "permissible", "worn"), (1e-4, 0.3)),
    **dict.fromkeys(("slack_arm", "diameter"), (0.005, 1.5)),
    **dict.fromkeys(
        ("band_area", "anchor_area", "lining_area", "slack_area", "tight_area"),
        (1e-5, 0.05),
    ),
    **dict.fromkeys(("linings.area", "bandage.area"), (1e-3, 0.5)),
    "area": (1e-4, 50.0),
}
#: radius (m) above those of drawworks' rims, whose diameters are 0.9…1.6 m
_LARGEST_RIM = 0.85
#: a drum has so many track radii at most, and the same part of one at least; that of a
#: drawworks is inside its rims
_DRUM_OVER_TRACK = 5.0


def did_you_mean(
    brake: AbstractBrake, load: AbstractLoad, omega: float, heat: Heat
) -> Iterator[str]:
    """Warnings of values that are most likely in another unit (concrete values
    only)."""
    for name in ("mass", "empty", "string"):
        mass = float(np.max(getattr(load, name, 0.0)))
        if 0 < mass < _BLOCK and float(brake.inertia) >= _DRUM:
            about = f"on the hook of a drum with {float(brake.inertia):g} kg·m²"
            yield _said(f"duty.load.{name}", f"{mass:g} kg", about, f'"{mass:g} t"')
    lines = float(np.max(getattr(load, "line_count", 1.0)))
    if lines != round(lines):
        yield _said(
            "duty.load.line_count",
            f"{lines:g}",
            "not a whole number of lines",
            f"{lines:.0f}",
        )
    speed = abs(omega) * float(brake.track_radius)
    if speed > _FAST and float(brake.track_radius) <= _OF_DRAWWORKS["radius"][1]:
        turned = f'"{omega:g} rpm" ({omega * math.pi / 30:.4g} rad/s)'
        yield _said(
            "initial.omega",
            f"{omega:g} rad/s",
            f"{number(speed, 'm/s', count=3)} at the track",
            turned,
        )
    if brake.rims > 1 and isinstance(brake, Brake):
        yield from _one_rim(brake, heat)
    for i, jacket in heat.jackets.items():
        flow = float(jacket.largest_flow)
        if flow > _RIVER:
            about = "more than any pump of a rig gives"
            yield _said(
                f"heat.links[{i}].flow", f"{flow:g} m³/s", about, f'"{flow:g} l/min"'
            )
    for i, body in enumerate(heat.bodies):
        T = getattr(body, "temperature", None)
        if isinstance(T, np.ndarray) and np.any(T < _COLD):
            least = float(np.min(T))
            cold = f"{least - ZERO:g} °C"
            yield _said(
                f"heat.bodies[{i}].temperature",
                f"{least:g} K",
                cold,
                f'"{least:g} degC"',
            )


def _of_other_sizes(scene: Scene) -> Iterator[str]:
    """Warnings of lengths and areas beyond those of any drawworks, most likely in
    another unit."""
    for leaf in leaves(scene):
        if leaf.about.unit not in ("m", "m^2") or not np.size(leaf.value):
            continue
        *_, part, name = ["", *leaf.path.split(".")]
        least, most = _OF_DRAWWORKS.get(f"{part}.{name}") or _OF_DRAWWORKS.get(
            name, (0.0, math.inf)
        )
        value = float(np.max(np.asarray(leaf.value)))
        if value > most:
            meant = meant_within(value, least, most, leaf.about.unit)
            yield _said(
                leaf.path,
                f"{value:g} {pretty(leaf.about.unit)}",
                "beyond any drawworks",
                meant,
            )


def _of_other_ratios(brake: AbstractBrake, load: AbstractLoad) -> Iterator[str]:
    """Warnings of a track under a tackle that no drawworks has, and of a band circle
    and a drum that do not fit the track."""
    track = float(brake.track_radius)
    if brake.banded and track > _LARGEST_RIM and (load.lines or 1) > 1:
        yield _said(
            "brake.pulley.radius",
            f"{track:g} m",
            "beyond the rims of any drawworks",
            f"{track / 2:g} m, half of a diameter",
        )
    about = f"beside a track of {track:g} m"
    circle = float(brake.radius)
    drum = float(getattr(load, "drum_radius", track))
    if brake.banded and circle > USUAL_CIRCLE * track:
        name = "band.radius" if isinstance(brake, Brake) else "band_radius"
        yield _said(f"brake.{name}", f"{circle:g} m", about, "")
    most = 1.0 if brake.banded else _DRUM_OVER_TRACK
    if not 1 / _DRUM_OVER_TRACK <= drum / track <= most:
        halved = 1 < drum / track <= 2
        meant = (
            f"{drum / 2:g} m, half of a diameter"
            if halved
            else meant_within(drum, track / _DRUM_OVER_TRACK, track)
        )
        yield _said("duty.load.drum_radius", f"{drum:g} m", about, meant)


def _in_bar(scene: Scene) -> Iterator[str]:
    """Warnings of gauge pressures of cylinders that were most likely meant in bar or
    psi."""
    lever = f"duty.{scene.duty.lever_field}"
    for path, cylinder, _ in parts_below(scene.duty.lever, lever):
        if isinstance(cylinder, Cylinder):
            given = cylinder.pressure.scale()
            permissible = cylinder.permissible_pressure
            pressures = {
                "pressure": given,
                "permissible_pressure": 0.0 if permissible is None else permissible,
            }
            for name, most in ((name, float(most)) for name, most in pressures.items()):
                if 0 < most < _BREATH:
                    about = "less than a breath gives"
                    yield _said(
                        f"{path}.{name}",
                        f"{most:g} Pa",
                        about,
                        f'"{most:g} bar" or "{most:g} psi"',
                    )


def _one_rim(brake: Brake, heat: Heat) -> Iterator[str]:
    """Warnings of walls of the heat part that have the area of one of several rims."""
    area = (brake.bandage or brake.linings).area
    width = brake.pulley.width
    of_rim = {
        heat.rim: None
        if width is None
        else 2 * math.pi * float(brake.pulley.radius) * float(width),
        heat.linings: None
        if area is None
        else float(np.sum(np.broadcast_to(area, (brake.linings.count,)))),
    }
    areas = {
        place_of(place)[0]: area
        for place, area in of_rim.items()
        if place and area is not None
    }
    for i, body in enumerate(heat.bodies):
        own = areas.get(body.name)
        if (
            isinstance(body, Wall)
            and own
            and abs(float(body.area) * body.copies - own) <= 1e-2 * own
        ):
            about = f"that of one of the {brake.rims} rims, which the heat part has together"
            meant = f'"{brake.rims * float(body.area):.5g} m^2"'
            yield (
                f"rims: heat.bodies[{i}].area = {float(body.area):.5g} m², {about}: "
                f"did you mean {meant}?"
            )


def _said(path: str, value: str, about: str, meant: str) -> str:
    question = f"did you mean {meant}" if meant else "is the unit right"
    return f"unit: {path} = {value}, {about}: {question}?"
