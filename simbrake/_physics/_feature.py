"""Features of a brake beside its mechanism: what each may add to its states, rates, guards and changes of mode."""

import abc
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Float, PyTree

from ..hybrid import AbstractSemiExplicitSystem
from ..hybrid._arrays import Array
from ..hybrid._struct import AbstractVar, Struct
from ..loads import AbstractLoad
from ..profiles import Piece
from ._mechanism import AbstractMechanism, ContactState, Ledger, Mode, Sizes, Surfaces
from ._thermal import Deposit, HeatFlows, Stream, total


class State(NamedTuple):
    """Angle `φ` (rad) and speed `ω` (rad/s) of the pulley, the states of the mechanism's own, the ledger, the heat
    content of the thermal nodes over their capacity (K; `None` without heat), the thickness worn off the linings of
    each pair (m; `None` without wear, and of a pair without), the states of the friction law of each pair (`None`
    without any), of the phase of the duty (`None` without phases), of a hook on an elastic rope (`None` on a rigid
    one), and the times (s) at which changes of friction began, of those that begin when something happens."""

    phi: Any
    omega: Any
    own: Any
    ledger: Ledger
    heat: Any = None
    worn: Any = None
    memory: Any = None
    phase: Any = None
    hook: Any = None
    onset: Any = None


class ThermalNow(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: HeatFlows  # friction apart
    deposits: tuple[Deposit, ...]  # of the friction heat of each pair (W)

    @property
    def coolant(self) -> Stream | None:
        """Coolant of the jackets, with the friction heat that reaches it at once."""
        stream = self.flows.coolant
        if stream is None:
            return None
        return stream._replace(heat=total([stream.heat, *(deposit.coolant for deposit in self.deposits)]))


class BrakeNow(NamedTuple):
    """Variables of a brake: applied loads, its mechanism (`contact`), its pairs, and the thermal network if any."""

    lever_tension: Float[Array, ""]  # T_0 (N), as the lever would give it
    lever_rate: Float[Array, ""]  # its rate (N/s)
    load_torque: Float[Array, ""]  # M_load (N·m)
    contact: PyTree  # a `ContactNow`
    rubs: tuple[ContactState, ...]
    thermal: ThermalNow | None
    shaft: Any = None  # a `ShaftNow`: torques on the shaft beside load and brake
    rope: Any = None  # a `RopeNow`, of an elastic rope
    motor: Any = None  # torque of a motor (N·m), against the braking direction

    @property
    def net_load(self) -> Array:
        """Torque (N·m) that shaft and motor leave of the load: that on the mechanism."""
        if self.shaft is not None:
            return self.shaft.left
        return self.load_torque if self.motor is None else self.load_torque - self.motor


class BrakeGuards(NamedTuple):
    """Guards of a brake, or which of them fired; `None`: absent physics has none.

    - `contact`: those of the mechanism;  `dry_shaft`: motion of the shaft, or what its dry friction can hold
    - `layer_paid_out`, `layer_full`: rope left on its layer;  `friction_table`: to the ends of a table of friction
    - `phase_end` of the duty;  `rope`: pull of an elastic rope, of a slack one its slack
    - `onset`: to what begins changes of friction
    """

    contact: PyTree
    dry_shaft: Any = None
    layer_paid_out: Any = None
    layer_full: Any = None
    friction_table: Any = None
    phase_end: Any = None
    rope: Any = None
    onset: Any = None


AnyFeature = TypeVar("AnyFeature", bound="Feature")
AnyTree = TypeVar("AnyTree")


class AbstractBrake(AbstractSemiExplicitSystem):
    """A brake, as its features see it.

    Its mechanism is that of one of `rims` alike rims under its part of load and inertia: all of them move alike.
    """

    mechanism: AbstractVar[AbstractMechanism]
    track_radius: AbstractVar[Array]  # of the rim (m), whose speed cools
    lever: AbstractVar[Any]
    load: AbstractVar[AbstractLoad]
    features: AbstractVar[tuple["Feature", ...]]
    rims: AbstractVar[int]

    def of_one(self, whole: AnyTree) -> AnyTree:
        """The part of one rim of what the shaft has: load, inertia."""
        return whole if self.rims == 1 else jax.tree.map(lambda x: x / self.rims, whole)

    def of_all(self, each: AnyTree) -> AnyTree:
        """The sum over the rims of what one of them has: torque, power, energy."""
        return each if self.rims == 1 else jax.tree.map(lambda x: self.rims * x, each)

    @property
    @abc.abstractmethod
    def first_change(self) -> int:
        """Place among `Mode.pieces` of the first change of friction."""

    def feature(self, kind: type[AnyFeature]) -> AnyFeature | None:
        """The feature of a kind, `None`: the brake has none."""
        return next((one for one in self.features if isinstance(one, kind)), None)

    @property
    def sizes(self) -> Sizes:
        """Typical slack tension, torque and speed."""
        return self.mechanism.sizes

    @abc.abstractmethod
    def inertia_at(self, mode: Mode) -> Array:
        """Inertia of all that turns and moves with the shaft (kg·m²)."""

    @abc.abstractmethod
    def stored_at(self, inertia: Array, omega: Array, own: PyTree, mode: Mode) -> tuple[Array, Array]:
        """Kinetic and elastic energy (J) of shaft and mechanism, with an `inertia` (kg·m²) of the shaft."""

    @abc.abstractmethod
    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State | None = None) -> Array:
        """Torque of the load (N·m), its rope in the layer of the mode; that of a weight at rest without a state `y`."""

    @abc.abstractmethod
    def motor_torque(self, t: Array, y: State, mode: Mode) -> Array | None:
        """Torque of a motor (N·m) against the braking direction; `None`: there is none."""

    @abc.abstractmethod
    def sensed(self, u: Array | None) -> tuple[Array | None, ...]:
        """Temperatures (K) that the law of each pair sees, (n,), for the heat contents `u`; `None`: there are none."""

    @abc.abstractmethod
    def surfaces(self, t: Array, y: State, mode: Mode) -> Surfaces:
        """Surface states that the law of each pair depends on; `None`: none."""

    @abc.abstractmethod
    def surface_temperatures(self, z: BrakeNow) -> dict[str, Array]:
        """Surface temperatures (K) of rim, linings and band where the scene names them."""


class Moment(NamedTuple):
    """A brake at one instant: time (s), state, mode, and variables where they are known."""

    brake: AbstractBrake
    t: Array
    y: State
    mode: Mode
    z: Any = None  # a `BrakeNow`


class Feature(Struct):
    """Physics of a brake beside its mechanism. The brake goes through its features in order; each gets what those
    before it have made, and gives it back with its own. What a feature does not define stays as it is."""

    def jumps(self, brake: AbstractBrake) -> bool:
        """Whether its states jump at events, beyond rounding and the speed at a change of the rope's layer."""
        return False

    # --- states -------------------------------------------------------------------------------------------------------

    def start(self, now: Moment) -> tuple[State, Mode]:
        """State and mode at the start."""
        return now.y, now.mode

    def sizes(self, brake: AbstractBrake, sizes: State) -> State:
        """Typical sizes of the states (see `AbstractHybridSystem.scales`)."""
        return sizes

    def places(self, brake: AbstractBrake, places: State) -> State:
        """Places of the states in the Jacobian (see `AbstractHybridSystem.couplings`)."""
        return places

    # --- at one instant -----------------------------------------------------------------------------------------------

    def variables(self, now: Moment) -> BrakeNow:
        return now.z

    def rates(self, now: Moment, rates: State) -> State:
        return rates

    def margins(self, now: Moment, guards: BrakeGuards) -> BrakeGuards:
        return guards

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        """Which guards are limits up to and including which the mode holds."""
        return limits

    def stored(self, now: Moment, stored: tuple[Array, Array]) -> tuple[Array, Array]:
        """Kinetic and elastic energy (J)."""
        return stored

    # --- changes of mode ----------------------------------------------------------------------------------------------

    def at_once(self, mode: Mode, fired: BrakeGuards) -> Mode:
        """The mode at the event, to which all others answer."""
        return mode

    def settled(self, now: Moment, fired: BrakeGuards, omega: Array) -> Array:
        """Speed of the pulley at an event: exactly 0 where it has come to rest but for rounding.

        Else rounding would decide whether a band that closes then holds, or is drawn on by its pulley first.
        """
        return omega

    def before(self, now: Moment, new: Mode, fired: BrakeGuards) -> tuple[State, Mode]:
        """State and mode to which the mechanism answers."""
        return now.y, new

    def after(self, now: Moment, new: Mode, fired: BrakeGuards, code: Array) -> tuple[Mode, Array]:
        """The mode after the answer of the mechanism, and the code of the run."""
        return new, code

    def speed_after(self, now: Moment, after: Mode, omega: Array) -> Array:
        """Speed of the pulley just after a change of mode; `now` is just before it."""
        return omega

    def reset(self, now: Moment, after: Mode, new: State) -> State:
        """The state just after a change of mode; `now` is just before it."""
        return new


#: places among `Mode.pieces`: of the lever, the load, then of the profiles of heat, motor, friction, then of the shaft
LEVER, LOAD, HEAT = 0, 1, 2


def piece_of(mode: Mode, which: int) -> Piece:
    """The piece on which a given function of time is; one without time breakpoints has only one."""
    return jnp.asarray(0, jnp.int32) if mode.pieces[which] is None else mode.pieces[which]
