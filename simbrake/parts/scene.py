"""Scene of one run: brake, duty, start and end."""

import abc
import dataclasses
from typing import TYPE_CHECKING, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, input_error
from .._base._part import Part, leaves, part, quantity, structural
from .._base._quantity import Scalar, shown
from ..brakes.design import AbstractBandBrake, AbstractBrake, Brake, under_a_band
from ..friction import AbstractFriction
from ..hybrid.arrays import Array
from ..hybrid.struct import AbstractClassVar, AbstractVar, with_fields
from ..loads import AbstractLoad, Lever, Motor, TorqueLoad
from ..phases import Phases
from ..profiles import AbstractProfile, Piece, starting_piece
from ..shaft import AbstractShaftTorque
from ..thermal.heat import FrictionHeat, Heat, PowerShares
from ..wear import Wear


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
