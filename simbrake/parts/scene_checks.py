"""The checks of a whole scene, all errors in one report."""

from collections.abc import Callable, Collection, Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._part import Numbers, Part, as_arrays, parts_below, presence_below
from .._base._store import cached_by_values
from ..brakes.design import Brake, unloaded
from ..friction import FrictionChange, needs
from ..loads import Driller, RecordedMotion, TorqueLoad
from ..phases import AfterTravel, AtHeight, AtTemperature, Phases, faults_of_want
from ..profiles import AbstractProfile, FunctionProfile, faults_of_sign, starting_piece
from ..shaft import NO_TACKLE, AbstractAuxiliaryBrake, AbstractDryTorque, TackleLoss
from ..wear import AbstractWearRate, faults_of_wear
from .at_start import locked, read_by_linings, sensed_at_start
from .scene import Duty, ForceDuty, Scene, pairs_of, require_scene


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
    """Laws and profiles of a user that are not finite where the run begins, and
    coefficients of friction that are negative, or larger for sliding than at rest."""
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
    ) -> np.ndarray | None:
        try:
            given = function(*arguments)
            value = np.asarray(given, np.float64)
        except Exception:  # which the run raises, with the line of the user's code
            return None
        if path in errors:
            return None
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
        return None if path in errors else value

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
                rest, sliding = (
                    look(path, law, where, coefficient, contact, shapes=each)
                    for coefficient in (law.static, law.kinetic)
                )
                if rest is None or sliding is None:
                    continue
                name = type(law).__name__
                least = min(rest.min(), sliding.min())
                if least < 0:
                    what = f"{name} is {least:g} at {where}"
                    errors[path] = Fault(path, what, "a coefficient is 0 or more")
                elif v == 0 and np.any(sliding > rest * (1 + 1e-9)):
                    what = f"{name} sticks up to {rest.min():g}, and slides with {sliding.max():g} at {where}"
                    hint = "static friction is at least the kinetic one at rest"
                    errors[path] = Fault(path, what, hint)
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


#: of a staged brake with heat: error of a pair without a place for its heat, and how to
#: build one
_MISSING_PAIR = {
    "friction": (
        "is missing: the friction heat of linings and rim (internal pair) would enter no body",
        "name its places: `FrictionHeat(metal, lining, partition)`, or build the "
        "network with `lumped_heat` or `layered_heat`, linings included",
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
