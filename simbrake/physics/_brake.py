"""A brake as a hybrid system: mechanism, lever and load, and features, each of which
adds its own physics."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from .._base._part import leaves, parts_below
from .._base._quantity import Characteristic
from ..friction import SurfaceState
from ..hoists import AbstractLoad, RopesNow
from ..hybrid import CORE, QUADRATURE, AbstractSemiExplicitSystem
from ..hybrid.arrays import Array, ScalarArray, TwoArrays
from ..hybrid.struct import Struct, structural
from ..hybrid.system import Instant, variables_of
from ..loads import RecordedMotion
from ..phases import Phases, levers_of
from ..profiles import (
    AbstractProfile,
    FunctionProfile,
    Piece,
    Real,
    is_piecewise_simple,
    next_known_time,
    with_near_points,
)
from .mechanism import (
    OPEN,
    AbstractMechanism,
    AppliedLoads,
    BrakeCode,
    ContactState,
    EventState,
    Ledger,
    MechanismNow,
    MechanismOutputs,
    Mode,
    Sizes,
    Surfaces,
)
from .sliding import AbstractLiningFriction

#: relative rounding of a torque that balances another one
_ROUNDING = 1e-9


class State(NamedTuple):
    """Angle `φ` (rad) and speed `ω` (rad/s) of the pulley, the states of the
    mechanism's own, the ledger, the heat content of the thermal nodes over their
    capacity (K; `None` without heat), the thickness worn off the linings of each pair
    (m; `None` without wear, and of a pair without), the states of the friction law of
    each pair (`None` without any), of the phase of the duty (`None` without phases), of
    a hook on an elastic rope (`None` on a rigid one), and the times (s) at which
    changes of friction began, of those that begin when something happens."""

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


class BrakeNow(NamedTuple):
    """Variables of a brake: applied loads, its mechanism (`contact`), its pairs, and
    what features add."""

    load_torque: Any  # M_load (N·m)
    # what the other torques on the shaft leave of it, which acts on the mechanism
    net_load: Any
    lever_tension: Any = None  # T_0 (N), as the lever would give it
    lever_rate: Any = None  # its rate (N/s)
    contact: Any = None  # a `MechanismNow`
    contact_states: tuple[ContactState, ...] = ()
    thermal: Any = None  # a `ThermalNow`
    shaft: Any = None  # a `ShaftNow`: torques on the shaft beside load and brake
    rope: Any = None  # a `RopeNow`, of an elastic rope
    motor: Any = None  # torque of a motor (N·m), against the braking direction


class BrakeGuards(NamedTuple):
    """Guards of a brake, or which of them fired; `None`: absent physics has none.

    - `contact`: those of the mechanism
    - `dry_shaft`: motion of the shaft, or what its dry friction can hold
    - `layer_paid_out`, `layer_full`: rope left on its layer
    - `friction_table`: to the ends of a table of friction
    - `phase_end` of the duty
    - `rope`: pull of an elastic rope, of a slack one its slack
    - `onset`: to what begins changes of friction
    - `rope_end`: rope left on either side; `slack_rope`: until a side falls freely;
      `ground`: until the load stands on the ground, or leaves it
    """

    contact: PyTree
    dry_shaft: Any = None
    layer_paid_out: Any = None
    layer_full: Any = None
    friction_table: Any = None
    phase_end: Any = None
    rope: Any = None
    onset: Any = None
    rope_end: Any = None
    slack_rope: Any = None
    ground: Any = None


class BrakeAtInstant(NamedTuple):
    """A brake at one instant: time (s), state, mode, and variables where they are
    known."""

    brake: "BrakeSystem"
    t: Array
    y: State
    mode: Mode
    z: Any = None  # a `BrakeNow`


#: an entry for each friction pair
PerPair = tuple[Any, ...]
_T = TypeVar("_T")
AnyTree = TypeVar("AnyTree")


class Feature(Struct):
    """Physics of a brake beside its mechanism. The brake goes through its features in
    the order of `assemble.py`; each gets what those before it have made, and gives it
    back with its own. What a feature does not define stays as it is.

    At an instant the brake asks `load_torque`, `torques`, `surfaces`, (the lever,)
    `conditions`, (the mechanism, which may ask `heating_rates`,) `variables`; then
    `rates` or `margins`. At an event it asks `at_once`, `settled`, `before`, (the
    mechanism,) `after`; then `speed_after`, `reset`, and at a jump of the tension
    `heat_of_jump`.
    """

    #: whether it sets its own times (`AbstractHybridSystem.self_timed`)
    self_timed: ClassVar[bool] = False
    #: whether its states are so many that the sparsity of the Jacobian pays
    sparse: ClassVar[bool] = False
    #: whether the hook moves by itself, so that the shaft does not feel its inertia
    frees_hook: ClassVar[bool] = False

    def jumps(self, brake: "BrakeSystem") -> bool:
        """Whether its states jump at events, beyond rounding and the speed at a change
        of the rope's layer."""
        return False

    def rests_open(self, brake: "BrakeSystem") -> bool:
        """Whether it may bring the pulley to rest with the band open; the mode says of
        dry friction whether it holds it there."""
        return False

    # --- given functions of time -----------------------------------------------------

    @property
    def profiles(self) -> dict[str, AbstractProfile | Phases]:
        """Given functions of time that it brings, by name."""
        return {}

    def courses(self, now: BrakeAtInstant, courses: dict[str, Any]) -> dict[str, Any]:
        """All given functions of time as they are at an instant."""
        return courses

    # --- states ----------------------------------------------------------------------

    def book(self, brake: "BrakeSystem", ledger: Ledger, of_each: Any) -> Ledger:
        """The ledger with its entries, each of them `of_each`. It is asked three times:
        for values at the start, for sizes, for places in the Jacobian."""
        return ledger

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        """State and mode at the start."""
        return now.y, now.mode

    def sizes(self, brake: "BrakeSystem", sizes: State) -> State:
        """Typical sizes of the states (see `AbstractHybridSystem.scales`)."""
        return sizes

    def places(self, brake: "BrakeSystem", places: State) -> State:
        """Places of the states in the Jacobian (see
        `AbstractHybridSystem.couplings`)."""
        return places

    # --- at one instant --------------------------------------------------------------

    def load_torque(self, now: BrakeAtInstant, torque: Array) -> Array:
        """Torque of the load (N·m)."""
        return torque

    def torques(self, now: BrakeAtInstant) -> BrakeNow:
        """Torques on the shaft beside load and brake."""
        return now.z

    def surfaces(
        self, now: BrakeAtInstant, surfaces: list[SurfaceState]
    ) -> list[SurfaceState]:
        """Surface states that the law of each pair sees."""
        return surfaces

    def conditions(self, now: BrakeAtInstant) -> BrakeNow:
        """What is known before the mechanism answers to its loads."""
        return now.z

    def heating_rates(
        self,
        now: BrakeAtInstant,
        forces: tuple[Array | None, ...] | None,
        rates: PerPair,
    ) -> PerPair:
        """Rates (K/s) of the temperatures that the laws see
        (`AppliedLoads.heating_rate`)."""
        return rates

    def variables(self, now: BrakeAtInstant) -> BrakeNow:
        """The variables with what follows from the answer of the mechanism."""
        return now.z

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        """The rates of its states."""
        return rates

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        """Its guards: positive while the mode holds."""
        return guards

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        """Which guards are limits up to and including which the mode holds."""
        return limits

    def stored(self, now: BrakeAtInstant, stored: TwoArrays) -> TwoArrays:
        """Kinetic and elastic energy (J)."""
        return stored

    # --- changes of mode -------------------------------------------------------------

    def at_once(self, mode: Mode, fired: BrakeGuards) -> Mode:
        """The mode at the event, to which all others answer."""
        return mode

    def settled(self, now: BrakeAtInstant, fired: BrakeGuards, omega: Array) -> Array:
        """Speed of the pulley at an event: exactly 0 where it has come to rest but for
        rounding.

        Else rounding would decide whether a band that closes then holds, or is drawn on
        by its pulley first.
        """
        return omega

    def before(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards
    ) -> tuple[State, Mode]:
        """State and mode to which the mechanism answers."""
        return now.y, new

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        """The mode after the answer of the mechanism, and the code of the run."""
        return new, code

    def speed_after(self, now: BrakeAtInstant, after: Mode, omega: Array) -> Array:
        """Speed of the pulley just after a change of mode; `now` is just before it."""
        return omega

    def reset(self, now: BrakeAtInstant, after: Mode, new: State) -> State:
        """The state just after a change of mode; `now` is just before it."""
        return new

    def heat_of_jump(
        self, now: BrakeAtInstant
    ) -> Callable[[State, tuple[Array, ...]], State] | None:
        """A function that adds the heat (J) of each pair in a jump of the tension to a
        state; `now` is after it."""
        return None


def numbered(name: str, each: Iterable[_T]) -> dict[str, _T]:
    """Entries by name and number."""
    return {f"{name} {i}": x for i, x in enumerate(each)}


def piece_of(mode: Mode, name: str) -> Piece:
    """The piece on which a given function of time is; one without time breakpoints has
    only one."""
    piece = mode.pieces[name]
    return jnp.asarray(0, jnp.int32) if piece is None else piece


def load_piece(mode: Mode) -> Piece:
    """The piece of the load; of one that may stand on the ground, whether it does."""
    return piece_of(mode, "load") if mode.grounded is None else mode.grounded


def at_phase(profile: Any, y: State | None, mode: Mode) -> Any:
    """A given function of time, or that of the phase that runs; without phases the
    state may be left out."""
    if not isinstance(profile, Phases):
        return profile
    assert y is not None
    return profile.at(mode.phase, y.phase.begun)


class Capacity(NamedTuple):
    """Load and sliding brake at one instant, or at many: torques (N·m) in the direction
    in which the pulley turns.

    - `load`: load torque, less the other torques on the shaft
    - `pairs` (…, k): maximum torque of each friction pair with its kinetic friction at
      the speed of the pulley and the temperatures of that instant: of a standard brake
      one, of a staged brake external, internal
    - `settled`: whether the lever is at its last value
    - `hanging`: torque of what hangs, without drag and the other torques on the shaft:
      what the brake alone would hold
    """

    load: Float[Array, "*many"]
    pairs: Float[Array, "*many pairs"]
    settled: Bool[Array, "*many"]
    hanging: Float[Array, "*many"]

    @property
    def torque(self) -> Float[Array, "*many"]:
        """Capacity of the brake: the torque of its weaker pair (N·m)."""
        return self.pairs.min(axis=-1)

    @property
    def outweighed(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds the torque of the sliding brake; a load that equals
        it keeps the speed constant."""
        return self.load > self.torque * (1 + _ROUNDING)

    @property
    def exceeded(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds what the brake gives, now and with the final lever
        force."""
        return self.settled & self.outweighed


#: passes in which tension and temperature after a jump are settled; each leaves about
#: 1e-3 of the one before it
_PASSES = 4


def course_of_profile(profile: Any, t: Array, piece: Piece) -> tuple[Real, Real | None]:
    """A profile as a function of time; of a lever that controls the speed with its
    torque."""
    unit = jnp.ones(())
    return profile.value(t, piece), profile.wanted_torque(
        t, unit, piece, unit, unit
    ) if profile.controls_speed else None


def _course_of_load(load: AbstractLoad, t: Array, piece: Piece) -> Real:
    unit = jnp.ones(())
    return load.torque_by_angle(t, unit, piece, unit)


class BrakeSystem(AbstractSemiExplicitSystem):
    """A brake: its mechanism under a lever and a load, and its features.

        φ̇ = ω,   J ω̇ = M_load(t, ω) − Σ M_shaft − M_b

    The only place where physics couples: temperatures go into the friction of the
    pairs, their power `F v` into the network, the ledger and the wear.

    - `inertia` `J` (kg·m²) of all that turns with the shaft at the start
    - `track_radius` (m) of the rim
    - `features`: heat, shaft, rope, phases, wear, states of friction laws, of those
      that the scene has
    - `rims` `n`, which are alike: the mechanism is that of one, under `M_load/n` and
      `J/n`; its torque and its powers are `n` times as large on the shaft
    - `wants`: what the duty says that the brake is to do (`WANTS`), for the verdict
      alone
    """

    mechanism: AbstractMechanism
    inertia: Array
    track_radius: Array
    lever: Any  # a profile, or `Phases`
    load: AbstractLoad
    features: tuple[Feature, ...]
    rims: int = structural(default=1)
    wants: str = structural(default="")

    def feature(self, kind: type[_T]) -> _T | None:
        """The feature of a kind, `None`: the brake has none."""
        return next(
            (feature for feature in self.features if isinstance(feature, kind)), None
        )

    def of_one(self, whole: AnyTree) -> AnyTree:
        """The part of one rim of what the shaft has: load, inertia."""
        return whole if self.rims == 1 else jax.tree.map(lambda x: x / self.rims, whole)

    def of_all(self, each: AnyTree) -> AnyTree:
        """The sum over the rims of what one of them has: torque, power, energy."""
        return each if self.rims == 1 else jax.tree.map(lambda x: self.rims * x, each)

    @property
    def sizes(self) -> Sizes:
        """Typical slack tension, torque and speed."""
        return self.mechanism.sizes

    @property
    def grip(self) -> AbstractLiningFriction:
        """Friction of the linings under the band."""
        return self.mechanism.grip

    @property
    def pair_names(self) -> tuple[str, ...]:
        """Names of the friction pairs, first the one on which the lever acts."""
        return tuple(pair.name for pair in self.mechanism.pairs)

    # --- load and lever --------------------------------------------------------------

    @property
    def profiles(self) -> dict[str, AbstractProfile | Phases]:
        """Given functions of time beside lever and load, by name."""
        profiles: dict[str, Any] = numbered("friction", self.mechanism.profiles)
        for feature in self.features:
            profiles |= feature.profiles
        return profiles

    def courses(self, y: Any, mode: Mode) -> dict[str, Any]:
        """All given functions of time by name, of those in phases that of the phase
        that runs."""
        courses = {"lever": self.lever_at(y, mode), "load": self.load.profile}
        courses |= {
            name: at_phase(profile, y, mode) for name, profile in self.profiles.items()
        }
        for feature in self.features:
            courses = feature.courses(
                BrakeAtInstant(self, jnp.zeros(()), y, mode), courses
            )
        return courses

    @property
    def sampled(self) -> tuple[str, ...]:
        """Given functions of time that may have features between two breakpoints which
        only samples see, by name."""

        def simple(profile: AbstractProfile | Phases) -> bool:
            return all(
                is_piecewise_simple(lever, course_of_profile)
                for lever in levers_of(profile)
            )

        plain = {
            "lever": simple(self.lever),
            "load": is_piecewise_simple(self.load, _course_of_load),
        }
        plain |= {name: simple(profile) for name, profile in self.profiles.items()}
        return tuple(name for name, known in plain.items() if not known)

    @property
    def guard_samples(self) -> int:
        """Points inside a step at which guards are evaluated: none if given functions
        have no short features."""
        return 15 if self.sampled else 0

    @property
    def machine(self) -> Characteristic:
        """Force, length, speed and temperature from which typical sizes of the brake's
        numbers follow."""
        return Characteristic(
            self.sizes.torque / self.track_radius,
            self.track_radius,
            self.sizes.speed,
            100.0,
        )

    def typical_numbers(self) -> PyTree:
        sizes = {id(leaf.value): leaf.about.size(self.machine) for leaf in leaves(self)}
        for _, part, _ in parts_below(self):
            if isinstance(part, FunctionProfile):
                sizes |= {id(x): part.typical for x in jax.tree.leaves(part.parameters)}
        import equinox as eqx

        return jax.tree.map(
            lambda x: sizes.get(id(x), 0.0), eqx.filter(self, eqx.is_inexact_array)
        )

    @property
    def jumps(self) -> bool:
        """Whether states jump at events, beyond rounding and the speed at a change of
        the rope's layer."""
        return self.mechanism.stretches or any(
            feature.jumps(self) for feature in self.features
        )

    @property
    def rests_open(self) -> bool:
        """Whether the pulley may come to rest with the band open, and no dry friction
        that holds it."""
        return any(feature.rests_open(self) for feature in self.features)

    @property
    def self_timed(self) -> bool:
        return any(feature.self_timed for feature in self.features)

    def lever_at(self, y: Any, mode: Mode) -> Any:
        """The lever, a profile, or that of the phase that runs, a `PhaseNow`."""
        return at_phase(self.lever, y, mode)

    def inertia_at(self, mode: Mode, y: State) -> Array:
        """Inertia of all that turns and moves with the shaft (kg·m²)."""
        inertia = self.inertia
        if any(feature.frees_hook for feature in self.features):
            return inertia
        load = self.load.on_layer(mode.layer)
        if self.load.layers is not None:
            inertia = inertia + (
                load.inertia()
                - self.load.on_layer(self.load.layers.first_layer()).inertia()
            )
        ropes = self.ropes_at(mode, y)
        inertia = inertia if ropes is None else inertia + ropes.inertia
        more = load.added_inertia(load_piece(mode))
        return inertia if more is None else inertia + more

    def ropes_at(self, mode: Mode, y: State) -> RopesNow | None:
        """The ropes of the load, where they have a weight."""
        load = self.load.on_layer(mode.layer)
        return load.ropes(self.load.travelled(y.phi), load_piece(mode))

    def hanging_torque(self, t: Array, omega: Array, mode: Mode, y: State) -> Array:
        """Torque of the load (N·m), its rope in the layer of the mode; on an elastic
        rope that of a weight at rest."""
        load = self.load.on_layer(mode.layer)
        travelled = self.load.travelled(y.phi)
        return load.whole_torque(t, omega, load_piece(mode), y.phi, travelled)

    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State) -> Array:
        """Torque of the load (N·m), of one on an elastic rope that of its pull."""
        torque = self.hanging_torque(t, omega, mode, y)
        for feature in self.features:
            torque = feature.load_torque(BrakeAtInstant(self, t, y, mode), torque)
        return torque

    def surfaces(self, t: Array, y: State, mode: Mode) -> Surfaces:
        """Surface states that the law of each pair depends on; `None`: none."""
        surfaces = [
            SurfaceState(None, None, factor) for factor in self._factors(t, y, mode)
        ]
        for feature in self.features:
            surfaces = feature.surfaces(BrakeAtInstant(self, t, y, mode), surfaces)
        return tuple(
            None if all(x is None for x in surface) else surface for surface in surfaces
        )

    def changes(self, y: State, mode: Mode) -> dict[str, Any]:
        """The courses of the changes of friction by name, also of those that begin when
        something happens."""
        courses = self.courses(y, mode)
        return {
            name: courses[name]
            for name in numbered("friction", self.mechanism.profiles)
        }

    def _factors(self, t: Array, y: State, mode: Mode) -> tuple[Array | None, ...]:
        """Factors of the friction of each pair by changes over time, (n,); `None` of a
        law without."""
        changes = self.changes(y, mode).items()
        return self.mechanism.factors(
            [
                jnp.asarray(course.value(t, piece_of(mode, name)))
                for name, course in changes
            ]
        )

    def lever_tension(
        self, t: Array, y: State, mode: Mode, load: Array, surfaces: Surfaces
    ) -> TwoArrays:
        """`T_0` (N) and its rate as the lever has them."""
        piece = piece_of(mode, "lever")
        lever = self.lever_at(y, mode)
        omega = y.omega
        given, rate = jax.jvp(
            lambda t: lever.value(t, piece), (t,), (jnp.ones_like(t),)
        )
        if not lever.controls_speed:
            return given, rate
        turned = y.phi if y.phase is None else y.phase.turned
        torque = jnp.asarray(
            lever.wanted_torque(
                t, omega, piece, load, jnp.asarray(self.inertia_at(mode, y)), turned
            )
        )
        follows = lever.follows(piece)
        gain = self.of_all(
            self.mechanism.gain(jnp.where(mode.sense > 0, omega, -omega), surfaces)
        )
        return jnp.where(follows, lever.holding(torque, gain), given), jnp.where(
            follows, 0.0, rate
        )

    def shaft_and_lever(
        self, t: Array, y: State, mode: Mode
    ) -> tuple[BrakeNow, Surfaces]:
        """Torques on the shaft, tension of the lever and its rate; and the surfaces of
        the pairs."""
        load = self.load_torque(t, y.omega, mode, y)
        z = BrakeNow(load, load)
        for feature in self.features:
            z = feature.torques(BrakeAtInstant(self, t, y, mode, z))
        surfaces = self.surfaces(t, y, mode)
        tension, rate = self.lever_tension(t, y, mode, z.net_load, surfaces)
        return z._replace(lever_tension=tension, lever_rate=rate), surfaces

    # --- all of it at one instant ----------------------------------------------------

    def variables(self, t: Array, y: State, mode: Mode) -> BrakeNow:
        z, surfaces = self.shaft_and_lever(t, y, mode)
        for feature in self.features:
            z = feature.conditions(BrakeAtInstant(self, t, y, mode, z))
        now = BrakeAtInstant(self, t, y, mode, z)

        def heating_rate(forces: PerPair | None) -> PerPair:
            rates: PerPair = tuple(None for _ in self.mechanism.pairs)
            for feature in self.features:
                rates = feature.heating_rates(now, forces, rates)
            return rates

        factor_rates = None
        if self.mechanism.stretches and self.mechanism.profiles:
            factor_rates = jax.jvp(
                lambda t: self._factors(t, y, mode), (t,), (jnp.ones_like(t),)
            )[1]
        acting = self.applied_loads(t, y, mode, z, surfaces)._replace(
            heating_rate=heating_rate, factor_rates=factor_rates
        )
        contact = self.mechanism.variables(acting, y.omega, y.own, mode)
        z = z._replace(
            contact=contact, contact_states=self.mechanism.contact_states(mode, contact)
        )
        for feature in self.features:
            z = feature.variables(BrakeAtInstant(self, t, y, mode, z))
        return z

    def rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> State:
        ledger = Ledger(
            load_work=z.load_torque * y.omega,
            lever_work=self.of_all(z.contact.lever_power),
            friction=tuple(
                self.of_all(_total(pair.force * pair.slip)) for pair in z.contact_states
            ),
            damper_heat=self.of_all(z.contact.damping)
            if self.mechanism.damps
            else None,
        )
        rates = State(
            y.omega, z.contact.alpha, self.mechanism.own_rates(z.contact), ledger
        )
        now = BrakeAtInstant(self, t, y, mode, z)
        for feature in self.features:
            rates = feature.rates(now, rates)
        return rates

    # --- guards and changes of mode --------------------------------------------------

    def applied_loads(
        self,
        t: Array,
        y: State,
        mode: Mode,
        z: BrakeNow,
        surfaces: Surfaces | None = None,
    ) -> AppliedLoads:
        """Applied loads as guards and changes of mode see them, which do not need the
        rates of temperatures."""
        surfaces = self.surfaces(t, y, mode) if surfaces is None else surfaces
        shares = self.of_one((z.net_load, self.inertia_at(mode, y)))
        return AppliedLoads(
            t, z.lever_tension, z.lever_rate, *shares, surfaces, lambda forces: ()
        )

    def margins(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> BrakeGuards:
        guards = BrakeGuards(
            self.mechanism.guards(
                self.applied_loads(t, y, mode, z), y.omega, y.own, mode, z.contact
            )
        )
        now = BrakeAtInstant(self, t, y, mode, z)
        for feature in self.features:
            guards = feature.margins(now, guards)
        return guards

    def limits(self, mode: Mode, guards: BrakeGuards) -> BrakeGuards:
        none = jax.tree.map(lambda guard: jnp.zeros(jnp.shape(guard), bool), guards)
        limits = none._replace(contact=self.mechanism.limits(mode, none.contact))
        for feature in self.features:
            limits = feature.limits(mode, limits)
        return limits

    def change(
        self, now: Instant, fired: BrakeGuards, at_stop: Bool[Array, ""]
    ) -> tuple[Mode, Array]:
        for feature in self.features:
            now = now._replace(mode=feature.at_once(now.mode, fired))
        t = now.t
        y = now.y
        new = self._next_pieces(now.y, now.mode, at_stop)
        acting = self.applied_loads(t, y, now.mode, now.z)
        omega = y.omega
        for feature in self.features:
            omega = feature.settled(BrakeAtInstant(self, t, y, now.mode), fired, omega)
        # what the mechanism compares with is the instant before the features' changes
        at_event = EventState(
            t, omega, y.own, now.mode, acting, now.z.contact, now.z_rate.contact
        )
        for feature in self.features:
            y, new = feature.before(
                BrakeAtInstant(self, t, y, now.mode, now.z), new, fired
            )

        def evaluate(
            mode: Mode, omega: Array, own: PyTree
        ) -> tuple[AppliedLoads, MechanismNow]:
            z = self.variables(t, y._replace(omega=omega, own=own), mode)
            return self.applied_loads(t, y, mode, z), z.contact

        new, code = self.mechanism.change(at_event, new, fired.contact, evaluate)
        for feature in self.features:
            new, code = feature.after(
                BrakeAtInstant(self, t, y, now.mode, now.z), new, fired, code
            )
        return new, code

    def code_at_end(self, mode: Mode) -> int:
        return int(BrakeCode.PHASE_NEVER_ENDS) if isinstance(self.lever, Phases) else 0

    def reset(self, t: Array, y: State, before: Mode, after: Mode) -> State:
        omega = y.omega
        now = BrakeAtInstant(self, t, y, before)
        for feature in self.features:
            omega = feature.speed_after(now, after, omega)
        omega, own = self.mechanism.with_stuck_speeds(omega, y.own, before, after)
        new = y._replace(omega=omega, own=own)
        # mass added in motion brings its energy; a change of layer adds none, but
        # changes the speed (`speed_after`)
        if self.load.added_inertia(load_piece(after)) is not None:
            added = self.inertia_at(after, y) - self.inertia_at(
                before._replace(layer=after.layer), y
            )
            new = new._replace(
                ledger=y.ledger._replace(
                    load_work=y.ledger.load_work + 0.5 * added * omega**2
                )
            )
        for feature in self.features:
            new = feature.reset(now, after, new)
        return (
            self._after_jump(t, y, before, after, new)
            if self.mechanism.stretches
            else new
        )

    def _after_jump(
        self, t: Array, y: State, before: Mode, after: Mode, new: State
    ) -> State:
        """The state after the jump of tension in a change of mode, with its work and
        its heat."""
        omega = new.omega
        own = new.own
        z = variables_of(self, t, y, before).contact
        surfaces = self.surfaces(t, y._replace(onset=new.onset), after)
        # (a lever that answers to the load needs a rigid band, whose tension cannot jump)
        load = self.hanging_torque(t, omega, after, new)
        tension = self.lever_tension(t, new, after, load, surfaces)[0]
        of_rim = self.mechanism.tension_jump(omega, own, (before, z), (after, tension))
        found = (
            feature.heat_of_jump(BrakeAtInstant(self, t, new, after))
            for feature in self.features
        )
        heaters = [heater for heater in found if heater is not None]

        def tension_jump(surfaces: Surfaces) -> tuple[PyTree, Array, tuple[Array, ...]]:
            own, work, heats = of_rim(surfaces)
            return own, *self.of_all((work, heats))

        def heated(state: State, heats: tuple[Array, ...]) -> State:
            for heater in heaters:
                state = heater(state, heats)
            return state

        # the heat of the jump warms the linings, on which the tension after it depends:
        # settled in a few passes
        def settle(jump: PyTree, _: None) -> tuple[PyTree, None]:
            return tension_jump(self.surfaces(t, heated(new, jump[2]), after)), None

        if heaters and self.grip.varies:
            zero = jnp.zeros_like(omega)
            jump: Any = (own, zero, tuple(zero for _ in self.mechanism.pairs))
            jump = jax.lax.scan(settle, jump, None, length=_PASSES)[0]
        else:
            jump = tension_jump(surfaces)
        own, work, heats = jump
        friction = tuple(
            worked + heat
            for worked, heat in zip(new.ledger.friction, heats, strict=True)
        )
        ledger = new.ledger._replace(
            lever_work=new.ledger.lever_work + work, friction=friction
        )
        return heated(new._replace(own=own, ledger=ledger), heats)

    def _next_known(
        self, y: Any, mode: Mode
    ) -> tuple[ScalarArray | float, dict[str, Any]]:
        """The next time breakpoint, and whether it belongs to each given function of
        time.

        A pulley at rest, and a lever that begins to pull, must see no input that has
        ended, nor one that has yet to begin: where its tension falls without going to
        0, and where it follows the load, the lever is processed after all others.
        """
        courses = self.courses(y, mode)
        lever = courses["lever"]
        piece = jnp.asarray(piece_of(mode, "lever"), jnp.int32)

        def waits(t: Array) -> Array:
            before = lever.value(t, piece)
            after = lever.value(t, piece + 1)
            answers = lever.follows(piece + 1)
            return (mode.band == OPEN) | answers | ((after < before) & (after > 0))

        return next_known_time(
            courses, {name: piece_of(mode, name) for name in courses}, waits
        )

    def _next_pieces(self, y: State, mode: Mode, at_stop: Array) -> Mode:
        """The mode on the piece that begins at a time breakpoint, or in the phase after
        the one that ends at it."""
        _, turns = self._next_known(y, mode)
        pieces = {
            name: None
            if piece is None
            else jnp.asarray(piece, jnp.int32)
            + (at_stop & turns[name]).astype(jnp.int32)
            for name, piece in mode.pieces.items()
        }
        return mode._replace(pieces=pieces)

    def next_stop(self, mode: Mode, y: Any = None) -> ScalarArray | float:
        return self._next_known(y, mode)[0]

    def near(self, mode: Mode, after: Mode) -> "BrakeSystem":
        courses = {"lever": self.lever, "load": self.load, **self.profiles}
        # (a recorded motion is on the pieces of its lever, also as the course of a
        # motor)
        names = {
            name: "lever" if isinstance(course, RecordedMotion) else name
            for name, course in courses.items()
        }
        return with_near_points(
            self,
            (
                (courses[name], piece_of(mode, own), piece_of(after, own))
                for name, own in names.items()
            ),
        )

    # --- as results ------------------------------------------------------------------

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: PyTree,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        """Maximum torque (N·m) of each friction pair, of all rims, as
        `AbstractMechanism.capacity`."""
        return self.of_all(
            self.mechanism.capacity(tension, omega, own, surfaces, static=static)
        )

    def shown(
        self, t: Array, y: State, mode: Mode, z: BrakeNow
    ) -> tuple[BrakeNow, MechanismOutputs]:
        """Variables and results of the mechanism with torques of all rims; forces are
        those of one."""
        surfaces = self.surfaces(t, y, mode)
        shown = self.mechanism.shown(
            z.lever_tension, y.omega, y.own, mode, surfaces, z.contact
        )
        if self.rims == 1:
            return z, shown
        contact = dataclasses.replace(
            z.contact, brake_torque=self.of_all(z.contact.brake_torque)
        )
        torques = (self.of_all((pair.torque, pair.capacity)) for pair in shown.pairs)
        each = zip(shown.pairs, torques, strict=True)
        pairs = tuple(
            pair._replace(torque=torque, capacity=capacity)
            for pair, (torque, capacity) in each
        )
        return z._replace(contact=contact), shown._replace(pairs=pairs)

    # --- states ----------------------------------------------------------------------

    def start(
        self, t: Array, omega: Array, own: PyTree, heat: Array | None, mode: Mode
    ) -> tuple[State, Mode]:
        """State and mode at the start; energies and wear are 0."""
        zero = jnp.zeros_like(omega)
        y = State(zero, omega, own, self._ledger(zero), heat)
        for feature in self.features:
            y, mode = feature.start(BrakeAtInstant(self, t, y, mode))
        return y, mode

    def _ledger(self, of_each: Any) -> Ledger:
        friction = tuple(of_each for _ in self.mechanism.pairs)
        ledger = Ledger(
            of_each,
            of_each,
            friction,
            damper_heat=of_each if self.mechanism.damps else None,
        )
        for feature in self.features:
            ledger = feature.book(self, ledger, of_each)
        return ledger

    def scales(self) -> State:
        sizes = State(
            1.0, self.sizes.speed, self.mechanism.own_sizes(), self._ledger(jnp.inf)
        )
        for feature in self.features:
            sizes = feature.sizes(self, sizes)
        return sizes

    def couplings(self) -> State | None:
        own = jax.tree.map(
            lambda size: np.full(jnp.shape(size), CORE), self.mechanism.own_sizes()
        )
        core = np.asarray(CORE)
        quadrature = np.asarray(QUADRATURE)
        # (the angle moves a load that depends on it, or a correction of the position)
        corrects = self.load.by_angle or any(
            profile.corrects_position
            for profile in (self.lever, *self.profiles.values())
        )
        places = State(
            core if corrects else quadrature, core, own, self._ledger(quadrature)
        )
        for feature in self.features:
            places = feature.places(self, places)
        return places if any(feature.sparse for feature in self.features) else None

    def stored_at(
        self, inertia: Array, omega: Array, own: PyTree, mode: Mode
    ) -> TwoArrays:
        """Kinetic and elastic energy (J) of shaft and mechanism, with an `inertia`
        (kg·m²) of the shaft."""
        return self.of_all(
            self.mechanism.stored(self.of_one(inertia), omega, own, mode)
        )

    def stored(self, t: Array, y: State, mode: Mode) -> TwoArrays:
        """Kinetic and elastic energy (J)."""
        stored = self.stored_at(self.inertia_at(mode, y), y.omega, y.own, mode)
        now = BrakeAtInstant(self, t, y, mode)
        for feature in self.features:
            stored = feature.stored(now, stored)
        return stored


def _total(power: Array) -> Array:
    """Power of a pair: the sum over its linings, where each is known."""
    return jnp.sum(power) if jnp.ndim(power) else power
