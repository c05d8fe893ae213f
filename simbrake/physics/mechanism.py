"""Interface of a mechanism: rotating bodies, the friction pairs between them, and how
these stick and slide."""

import abc
import enum
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from ..friction import AbstractFriction, FrictionChange, RatesRead, SurfaceState, reads
from ..hybrid import SYSTEM_CODES
from ..hybrid.arrays import Array, ScalarArray, Vector
from ..hybrid.struct import AbstractClassVar, AbstractVar, Struct, structural
from ..profiles import AbstractProfile
from ..thermal.heat import FrictionHeat
from ..wear import AbstractWearRate
from .sliding import AbstractLiningFriction


class BrakeCode(enum.IntEnum):
    """Status codes of a run that are specific to brakes."""

    SINGULAR_GEOMETRY = SYSTEM_CODES
    BAND_SNAP = SYSTEM_CODES + 1
    FLASH_FOLD = SYSTEM_CODES + 2
    OUTSIDE_TABLE = SYSTEM_CODES + 3
    PHASE_NEVER_ENDS = SYSTEM_CODES + 4
    ROPE_END = SYSTEM_CODES + 5
    SLACK_ROPE = SYSTEM_CODES + 6


class HeatLedger(NamedTuple):
    """Heat in J since the start: friction heat given to metal, linings and band, heat
    that was lost, supplied, or carried away by coolants."""

    to_metal: Any
    to_linings: Any
    lost: Any
    supplied: Any
    to_band: Any = None  # where linings rub on the band
    coolant: Any = None  # where there are jackets


class Ledger(NamedTuple):
    """Energies in J since the start: work of load and lever, friction work of every
    pair, and the distribution of its heat (`None`: no heat)."""

    load_work: Any
    lever_work: Any
    friction: tuple[Any, ...]  # of each pair, in the order of the mechanism
    heat: Any = None
    damper_heat: Any = None  # of dampers in the band or the bandage
    shaft: Any = None  # work of each torque on the shaft beside the brake
    motor: Any = None  # work that a motor gives
    ropes: Any = None  # work of the weight of ropes
    pick_up: Any = None  # lost as chain and anchor begin or end their motion


# --- modes --------------------------------------------------------------------------


class BandMode(enum.IntEnum):
    """Label of the band's mode (model §3).

    Example:
        >>> mode = sb.results.BandMode(result.series([0.5]).band_mode[0])
        >>> mode.name
        'SLIP'
    """

    OPEN = 0
    TAKE_UP = 1
    ELASTIC = 2
    SLIP = 3
    SLIP_BACK = 4
    HELD = 5


#: its labels as values of a mode: known while tracing, of the type of a mode
OPEN, TAKE_UP, ELASTIC, SLIP, SLIP_BACK, HELD = (np.int32(label) for label in BandMode)

#: meaning of each mode, and its condition (`Π_s` static limits, `v_s` slip speed)
BAND_MODES = {
    BandMode.OPEN: ("the lever does not pull, the band is free", "`T_0 = 0`"),
    BandMode.TAKE_UP: (
        "the pulley draws the band tight, no torque yet",
        "`C x < T_0` and `ω > 0`",
    ),
    BandMode.ELASTIC: (
        "band and pulley move together, linings reach their limits one by one",
        "`T_0/Π_s ≤ C x ≤ T_0 Π_s`",
    ),
    BandMode.SLIP: (
        "every lining slides, the anchor end is the tight one",
        "`v_s > 0`",
    ),
    BandMode.SLIP_BACK: (
        "every lining slides the other way, the lever end is the tight one",
        "`v_s < 0`",
    ),
    BandMode.HELD: (
        "the pulley is at rest (staged brake: the bandage is at rest)",
        "the load is within the static limits; of a staged brake: the internal torque is",
    ),
}


def slips(band: Any) -> Any:
    return (band == SLIP) | (band == SLIP_BACK)


class Label(NamedTuple):
    """Mode in the log: band mode, the internal pair of a staged brake (0: it sticks or
    is none), the direction in which the pulley turns where the shaft has dry friction
    (0: it is at rest), the layer of the rope (0: has none), whether it is taut, and
    whether the load stands on the ground."""

    band: int
    inner: int = 0
    turn: int = 1
    layer: int = 0
    taut: int = 1
    grounded: int = 0

    @property
    def rests(self) -> bool:
        """Whether the pulley is at rest."""
        return (self.band == BandMode.HELD and self.inner == 0) or self.stands

    @property
    def stands(self) -> bool:
        """Whether dry friction of the shaft alone holds the pulley, the band being
        open."""
        return self.band == BandMode.OPEN and self.turn == 0

    def __str__(self) -> str:
        words = BandMode(self.band).name.lower().replace("_", " ") + (
            " at rest" if self.stands else ""
        )
        words += f" on layer {self.layer}" if self.layer else ""
        words += "" if self.taut else " under a slack rope"
        words += " with the anchor on the ground" if self.grounded else ""
        return words if self.inner == 0 else f"{words} with internal slip"


def turned_since_rest(labels: Sequence[Label], angles: Sequence[float]) -> list[bool]:
    """Whether the pulley has turned since it last was at rest, or since the start, for
    each mode with its angle."""
    rest = angles[0] if len(angles) else 0.0
    turned = []
    for label, angle in zip(labels, angles, strict=True):
        turned.append(bool(angle != rest))
        rest = angle if label.rests else rest
    return turned


def events_of_change(
    before: Label, after: Label, first: bool, turned: bool = False
) -> list[str]:
    """Names of the events in one change of mode; `first` marks the settling at the
    start of a run.

    `turned`: whether the pulley may have come to rest before the open band closes on it
    """
    if (
        turned
        and before.band == BandMode.OPEN
        and not before.stands
        and after.band == BandMode.HELD
        and after.rests
    ):
        return [*(["layer_change"] if before.layer != after.layer else []), "stop"]
    names = _events_of_band(before, after, first) if before.band != after.band else []
    names = ["layer_change", *names] if before.layer != after.layer else names
    names = ["reversal", *names] if before.turn * after.turn < 0 else names
    names = (
        names
        if before.taut == after.taut
        else ["rope_taut" if after.taut else "rope_slack", *names]
    )
    if before.grounded != after.grounded:
        event = "anchor_grounded" if after.grounded else "anchor_lifted"
        names = [event, *names]
    if before.stands and not after.rests and not first:
        names = ["restart", *names]
    elif after.stands and not before.rests:
        names = [*names, "stop"]
    if before.inner == 0 and after.inner != 0:
        return (
            (["restart"] if before.rests and after.band == BandMode.HELD else [])
            + ["internal_slip"]
            + names
        )
    if before.inner != 0 and after.inner == 0:
        return names + (
            ["stop"]
            if after.rests and "stop" not in names
            else []
            if after.rests
            else ["internal_restick"]
        )
    return names


def _events_of_band(before: Label, after: Label, first: bool) -> list[str]:
    slack = before.band in (BandMode.OPEN, BandMode.TAKE_UP)
    names = []
    if after.band == BandMode.OPEN:
        names.append("release")
    elif after.band == BandMode.HELD:
        if after.inner != 0:
            names.append("external_lock")
        elif not (first or before.band == BandMode.OPEN):
            names.append("stop")
    elif after.band in (BandMode.ELASTIC, BandMode.SLIP, BandMode.SLIP_BACK):
        if before.band == BandMode.HELD:
            names.append("external_release" if before.inner != 0 else "restart")
        elif slack:
            names.append("slip_onset")
        elif after.band == BandMode.ELASTIC:
            names.append("restick")
        if after.band != BandMode.ELASTIC:
            names.append("full_slip")
    return names


# --- mechanisms ---------------------------------------------------------------------

#: states of the surfaces that the law of each pair sees: temperatures (K) and the law's
#: own states, (n,); `None` where the scene has neither
Surfaces = tuple[SurfaceState | None, ...]


class ContactState(NamedTuple):
    """A friction pair at one instant; its power is `force · slip`.

    - `force` (N): friction at the radius of `slip`, signed like it: (n,), or the sum
      unless the pair is `apart`; while they stick it makes no power, and may be any
    - `slip` (m/s): (n,), or one for all linings; 0 while they stick
    - `sense`: the way it slides (±1), 0 while it sticks, shaped like `slip`
    - `normal` (n,): loads (N)
    """

    force: Float[Array, "*n"]
    slip: Array
    sense: Array
    normal: Vector


class Pair(Struct):
    """Constant properties of a friction pair.

    - `name`; `field` of the brake that describes its linings; `law` of friction; `area`
      (m²) of the linings
    - `heat`: where its heat goes, `None`: it enters only the energy balance
    - `wear`: its rate, `None`: none is followed
    - `on_band`: whether the linings rub on the band, not on the rim
    - `apart`: whether the heat, or states of the law, depend on the distribution over
      the linings
    - `memory`: what the rates of the law's states depend on, `None`: it has none
    - `cosine` (n,): friction at the face of a lining over its force along the slip,
      where rates need it (`None`: 1)
    """

    name: str = structural()
    field: str = structural()
    law: AbstractFriction
    area: Array | None
    heat: FrictionHeat | None
    wear: AbstractWearRate | None
    count: int = structural()
    on_band: bool = structural(default=False)
    apart: bool = structural(default=False)
    memory: RatesRead | None = structural(default=None)
    cosine: Vector | None = None

    def memory_rates(
        self, surface: SurfaceState, v: Array, normal: Vector, power: Array
    ) -> PyTree:
        """Rates of the states of its law, (n,) each.

        - `v` (m/s): slip speed signed by the sense, `power` (W) of the friction of each
          lining: (n,) or one for all

        The law sees `q = f p v` at the face: under a band the force along the slip is
        `1/cos(β_i/2)` times that, as it acts on the band circle, and so is the power.

        Past the end of a slide, where both are below 0, a rate `g` continues with its
        slope, `2 g(0) − g(|v|)`.
        """
        still = jnp.zeros(self.count)
        area = self.area
        power = power if self.cosine is None else power * self.cosine
        p, q = (None, None) if area is None else (normal / area, power / area + still)
        v = v + still

        def at(v: Array, q: Array | None) -> PyTree:
            return jax.tree.map(
                lambda rate: rate + still, self.law.rates(surface.contact(v, p, q))
            )

        if self.memory is None or not self.memory.bends:
            return at(v, q)  # a linear rate needs no continuation
        past = v < 0
        at_rest = at(still, None if q is None else still)
        rates = at(
            jnp.where(past, -v, v), None if q is None else jnp.where(past, -q, q)
        )
        return jax.tree.map(
            lambda rate, still: jnp.where(past, 2 * still - rate, rate), rates, at_rest
        )

    @property
    def wears(self) -> bool:
        """Whether the wear of its linings is simulated."""
        return self.wear is not None and self.area is not None

    def wear_rate(self, rub: ContactState, T: Array | None) -> Vector | None:
        """Rate of wear (m/s) of its linings, `ḣ_i = I(T_i) p_i v_i` (model §7), where
        it is simulated."""
        if self.wear is None or self.area is None:
            return None
        p = rub.normal / self.area
        v = rub.sense * rub.slip
        return jnp.broadcast_to(self.wear(p, v, T) * p * v, (self.count,))


class PairNow(NamedTuple):
    """A friction pair at one instant, for results; its power is `force · slip`.

    - of every lining (n,): `force` (N) along the slip, at its radius
    - `friction` (N) at the face of the lining, at the limit `f N`;  `normal` load (N);
      `slip` speed (m/s);  `sense`: the way it slides (±1), 0 while it sticks;
      `at_limit`: whether its friction is at the limit
    - `torque` (N·m) that the pair passes on
    - `capacity` (N·m): up to which it sticks, or with which it slides, `None`
      where the mechanism has none
    - `coefficient` (n,) of friction when it slides, `None` where it cannot change,
      without heat
    """

    force: Vector
    friction: Vector
    normal: Vector
    slip: Vector
    sense: Int[Array, " n"]
    at_limit: Bool[Array, " n"]
    torque: ScalarArray
    coefficient: Any
    capacity: Any = None

    @classmethod
    def of(
        cls,
        force: Array,
        normal: Array,
        slip: Array,
        sense: Array,
        torque: Array,
        f: Array | None,
        more: Any = None,
    ) -> "PairNow":
        """Linings that slide at their friction limit, with friction at the radius of
        the slip; `more`: capacity."""
        return cls(force, force, normal, slip, sense, sense != 0, torque, f, more)


class MechanismOutputs(NamedTuple):
    """Results of a mechanism beside its variables.

    A run needs only the loads of sticking linings, and only where a friction law has
    states that depend on the pressure.

    - `pairs`
    - `tension` (n,) of the band behind every lining (N), `None` without a band
    - `before` (n,): ahead of it,
      `None`: that behind the lining before it, of the first one that of the slack end
    - `None` where there is no such thing: `elongation` of the band (m), `displacement`
      (n,) of linings along the band circle (m), `bandage_speed` (rad/s), `lining_speed`
      (n,) (rad/s)
    """

    pairs: tuple[PairNow, ...]
    tension: Any
    elongation: Any = None
    displacement: Any = None
    bandage_speed: Any = None
    lining_speed: Any = None
    before: Any = None


class AppliedLoads(NamedTuple):
    """Applied loads on a mechanism at one instant.

    - `tension` (N): slack tension or force of the lever, and `pull` its rate
    - `load` (N·m) on the shaft
    - `inertia` (kg·m²) of the shaft and all that moves with it
    - `surfaces` of the pairs
    - `heating_rate(forces)`: rates (K/s) of their temperatures by the friction forces
      of each pair (as in `ContactState`; `None`: not this pair's) per unit of its slip
      speed, linear in them; without forces, by all else
    - `factor_rates`: rates (1/s) of the factors by which the friction of each pair is
      changed; `None` without any
    """

    t: ScalarArray
    tension: ScalarArray
    pull: ScalarArray
    load: ScalarArray
    inertia: ScalarArray
    surfaces: Surfaces
    heating_rate: Callable[[tuple[Array | None, ...] | None], tuple[PyTree, ...]]
    factor_rates: Any = None


class Mode(NamedTuple):
    """Mode of a brake between two events.

    - `band`: label of the whole (`BandMode`)
    - `sense`: direction in which the pulley moves or last moved, ±1
    - `own`: the mode of its mechanism
    - `pieces` on which the given functions of time are, by name: `lever`, `load`, …;
      `None` of those without time breakpoints;  `phase`: how many phases of the duty
      have ended
    - `layer` of the rope on the drum that pays out, where it changes (else `None`)
    - `turn`, on a shaft with dry friction (else `None`): direction in which the pulley
      turns, 0 at rest
    - `taut`: whether an elastic rope pulls (1), or is slack (0); `None`: the rope is
      rigid
    - `onset`: which changes of friction have begun, of those that begin when something
      happens (an `OnsetMode`)
    - `grounded`: whether the load stands on the ground (1), of one that can; else
      `None`
    """

    band: Any
    sense: Any
    own: Any
    pieces: dict[str, Any]
    turn: Any = None
    layer: Any = None
    taut: Any = None
    onset: Any = None
    grounded: Any = None

    @property
    def phase(self) -> Any:
        """How many phases of the duty have ended, `None` without phases."""
        return self.pieces.get("phase")

    @property
    def label(self) -> Label:
        """Label in the log; arrays for many modes."""
        none = 0 * self.slides
        turn = none + 1 if self.turn is None else self.turn
        layer = none if self.layer is None else self.layer
        return Label(
            self.band,
            self.slides,
            turn,
            layer,
            none + 1 if self.taut is None else self.taut,
            none if self.grounded is None else self.grounded,
        )

    @property
    def rests(self) -> Any:
        """Whether the pulley is at rest."""
        return (
            (self.band == HELD) & (self.slides == 0)
            if self.turn is None
            else self.turn == 0
        )

    @property
    def slides(self) -> Any:
        """The internal pair of a staged brake: 0 while it sticks (or there is none),
        else ±1."""
        return self.own.slides(self)

    @property
    def inner(self) -> Any:
        """The internal pair of a staged brake whose linings act as one (0 sticks, ±1
        slides); `None` of others."""
        return self.own.internal

    @property
    def contacts(self) -> dict[str, Any]:
        """Modes of individual linings, (n,) each: none where they act as one."""
        return self.own.contacts

    @property
    def locks(self) -> Any:
        """Whether a lining is self-locking, where that can change in a run (else
        `None`)."""
        return self.own.locks

    @property
    def lifted(self) -> Any:
        """Linings that have lifted off the rim, (n,), where their centrifugal force is
        modelled (else `None`)."""
        return self.own.lifted


def holds(mode: Mode) -> Any:
    """Whether the brake holds the pulley at rest."""
    return (mode.band == HELD) & (mode.slides == 0)


def comes_to_rest(before: Mode, after: Mode, turned: Any = False) -> Any:
    """Whether the pulley comes to rest in a change of mode, by the brake or by dry
    friction of the shaft.

    `turned`: it may have come to rest before the open band closes, by a motor or its
    load
    """
    if after.turn is None:
        return holds(after) & ~holds(before) & ((before.band != OPEN) | turned)
    # dry friction of the shaft may hold the pulley while the band is open
    return (before.turn != 0) & (after.turn == 0)


class Sizes(NamedTuple):
    """Typical sizes: slack tension (N), torque (N·m), speed (rad/s); tensions and
    torques that differ by less than `slight_…` are equal."""

    tension: ScalarArray
    torque: ScalarArray
    speed: ScalarArray
    slight_tension: ScalarArray
    slight_torque: ScalarArray


class MechanismNow(Struct):
    """Variables that every mechanism has; each adds its own."""

    # T_0 (N), as the contact has it: 0 while the lever does not pull
    slack_tension: ScalarArray
    tight_tension: ScalarArray  # T_n (N)
    brake_torque: ScalarArray  # M_b (N·m)
    alpha: ScalarArray  # ω̇ (rad/s²)
    slip_speed: ScalarArray  # v_s (m/s), of linings that move by themselves the mean
    lever_power: ScalarArray  # W


class EventState(NamedTuple):
    """State of a mechanism at one instant, for its changes of mode.

    - `omega` (rad/s), `own` states, `mode`, variables `z` and their rates along the
      motion `z_rate`
    """

    t: ScalarArray
    omega: ScalarArray
    own: Any
    mode: Mode
    acting: AppliedLoads
    z: Any
    z_rate: Any


#: `evaluate(mode, omega, own)`: applied loads and variables in another mode, at other
#: speeds, at the same instant
EvaluateInMode = Callable[[Mode, Array, PyTree], tuple[AppliedLoads, Any]]


class AbstractMechanism(Struct):
    """Bodies that turn, stick and slide: start, rates, guards, changes of mode, stored
    energy, typical sizes.

    A mechanism knows the shaft's speed `ω`, states and modes of its `own`, and its
    applied loads. Other modules see only names, forces and slip speeds of its friction
    pairs: heat, wear and ledger are elsewhere. Its variables `z` are a `MechanismNow`,
    with `damping` (W) where it has dampers.

    - `grip`: friction of the linings on which the lever acts
    - `distribution`: rule for the load sharing that rigid bodies leave undetermined, in
      words
    - `banded`: whether the linings are under a band, which has tensions
    - `resolved`: whether linings move individually
    - `stretches`: whether it has a band whose stretch follows its friction at once:
      slip speeds depend on how fast the friction changes, and the tension jumps with
      changes of mode (`tension_jump`)
    - `damps`: whether it has dampers
    """

    pairs: AbstractVar[tuple[Pair, ...]]
    sizes: AbstractVar[Sizes]
    grip: AbstractVar[AbstractLiningFriction]
    distribution: AbstractClassVar[str]
    banded: ClassVar[bool] = True
    resolved: ClassVar[bool] = False
    damps: ClassVar[bool] = False

    @abc.abstractmethod
    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[PyTree, Array | np.int32, PyTree]:
        """Own states, label of the band and own modes at the start; the run settles the
        true first mode itself, as an event."""

    @abc.abstractmethod
    def variables(
        self, acting: AppliedLoads, omega: Array, own: PyTree, mode: Mode
    ) -> MechanismNow:
        """Algebraic variables at one instant."""

    @abc.abstractmethod
    def own_rates(self, z: MechanismNow) -> PyTree:
        """Rates of the own states."""

    @abc.abstractmethod
    def guards(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: PyTree,
        mode: Mode,
        z: MechanismNow,
    ) -> PyTree:
        """Dimensionless margins by name, positive while the mode holds."""

    @abc.abstractmethod
    def limits(self, mode: Mode, none: Any) -> PyTree:
        """Which guards are limits, up to and including which contacts hold; `none`: all
        guards, none marked."""

    @abc.abstractmethod
    def change(
        self, now: EventState, new: Mode, fired: PyTree, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        """The mode after an event, and a code; `new` is the old one on the pieces that
        begin at this instant, `fired` has the structure of the guards."""

    @abc.abstractmethod
    def with_stuck_speeds(
        self, omega: Array, own: PyTree, before: Mode, after: Mode
    ) -> tuple[Array, PyTree]:
        """Speed and own states just after a change of mode: bodies that stick or rest
        have exactly the speed of the body that they stick to."""

    @property
    def couples_loads(self) -> bool:
        """Whether the load of a lining depends on the friction of others at the same
        instant."""
        return True

    @property
    def stretches(self) -> bool:
        return False

    def tension_jump(
        self,
        omega: Array,
        own: PyTree,
        before: tuple[Mode, PyTree],
        after: tuple[Mode, Array],
    ) -> Callable[[Surfaces], tuple[PyTree, Array, tuple[Array, ...]]]:
        """The jumps of tension in a change of mode, as a function of the surfaces that
        the laws of the pairs see.

        It gives the own states after them, the work of the lever and the heat of each
        pair (J). `before`: the mode with its variables, `after` with the tension of the
        lever;  `omega`, `own` as they are after `with_stuck_speeds`.
        """
        raise TypeError(f"no jumps are defined for {type(self).__name__}")

    def lining_margins(self, mode: Mode, z: PyTree) -> Float[Array, " twice_n"]:
        """Excess of each lining over its static limit while the band is elastic, over
        the reference tension.

        The first `n` count from the slack end (`C x − T_0 Π_i`), the last `n` from the
        anchor for a band pulled the other way (`T_0 − C x ∏_{j≥i} μ_j`); −1 in every
        other mode. Linings that slide individually have none.
        """
        return jnp.zeros(0)

    @abc.abstractmethod
    def shown(
        self,
        tension: Array,
        omega: Array,
        own: PyTree,
        mode: Mode,
        surfaces: Surfaces,
        z: PyTree,
    ) -> MechanismOutputs:
        """Its results at one instant; `tension` is the lever's."""

    def lining_speed(self, own: PyTree) -> Array | float:
        """Speed (m/s) of the linings' outer faces, of each or of all: 0 of linings that
        do not turn."""
        return 0.0

    @property
    def shows_friction(self) -> bool:
        """Whether coefficients of friction are shown: where they can change, or
        friction heats bodies of the scene."""
        return any(
            pair.heat is not None
            or pair.memory is not None
            or bool(pair.law.over_time)
            or any(reads(pair.law, pair.count, T=False, p=pair.area is not None))
            for pair in self.pairs
        )

    @property
    def changes(self) -> tuple[FrictionChange, ...]:
        """Given changes of the friction, pair by pair."""
        return tuple(change for pair in self.pairs for change in pair.law.over_time)

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """The given functions of time of these changes."""
        return tuple(change.factor for change in self.changes)

    def factors(self, values: Sequence[Array]) -> tuple[Vector | None, ...]:
        """Factors of the friction of each pair where the changes have these values;
        `None`: of a law without."""
        left = iter(values)
        return tuple(
            pair.law.factor_of(pair.count, [next(left) for _ in pair.law.over_time])
            for pair in self.pairs
        )

    @property
    def tells_pairs_apart(self) -> bool:
        """Whether pairs have more results than the whole brake: several pairs, or
        linings that move individually."""
        return len(self.pairs) > 1 or self.resolved

    def gain(self, omega: Array, surfaces: Surfaces) -> ScalarArray:
        """Torque (N·m) per newton of the lever while the pulley slides at the speed
        `omega` ≥ 0 (rad/s)."""
        raise TypeError(
            f"the torque of {type(self).__name__} does not follow from the lever alone"
        )

    @abc.abstractmethod
    def contact_states(self, mode: Mode, z: PyTree) -> tuple[ContactState, ...]:
        """The friction pairs at one instant."""

    @abc.abstractmethod
    def stored(
        self, inertia: Array, omega: Array, own: PyTree, mode: Mode
    ) -> tuple[Array, Array]:
        """Kinetic and elastic energy (J)."""

    @abc.abstractmethod
    def own_sizes(self) -> PyTree:
        """Typical sizes of the own states."""

    @abc.abstractmethod
    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: PyTree,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        """Maximum torque (N·m, ≥ 0) of each friction pair against the motion, sliding
        at the speed of the pulley.

        `static`: of pairs that stick, against a load in the direction of `omega`.
        """
