"""Linings that act as one, and rigid contact: the brake torque is a function of lever
force and friction."""

import abc
import dataclasses
import functools
from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ..brakes._bands import JoinedFriction
from ..brakes._pressed import AbstractPressedBrake
from ..brakes.band import LiningForces, band_torque
from ..friction import SurfaceState
from ..hybrid import largest
from ..hybrid.arrays import Array, IntScalar, Mark, ScalarArray, TwoArrays, Vector
from ..hybrid.struct import AbstractVar
from ._contact import acceleration, exceeded, limit_margins, speed_after
from .mechanism import (
    ELASTIC,
    HELD,
    OPEN,
    SLIP,
    SLIP_BACK,
    AbstractMechanism,
    AppliedLoads,
    BrakeCode,
    ContactState,
    EvaluateInMode,
    EventState,
    MechanismNow,
    MechanismOutputs,
    Mode,
    Pair,
    PairNow,
    Sizes,
    Surfaces,
    slips,
)
from .sliding import BandFriction, LiningFriction, PadFriction, where_static


class LumpedMode(NamedTuple):
    """Mode of linings that act as one.

    - `locks`: whether a lining is self-locking (0, 1), where that can change in a run
      (else `None`)
    - `inner`, of a staged brake: 0 while the internal pair sticks, ±1 the sign of
      `ω − ω_b` while it slides
    - `piece`, of a staged brake: number of linings at their limit on the band, as
      `_band.piece_of` counts them
    - `lifted` (n,), of a staged brake: linings that have lifted off the rim (1), `None`
      without centrifugal force
    """

    locks: Any = None
    inner: Any = None
    piece: Any = None
    lifted: Any = None

    def slides(self, mode: Mode) -> Array:
        """The internal pair: 0 while it sticks, or where there is none, else ±1."""
        return 0 * mode.band if self.inner is None else self.inner

    @property
    def internal(self) -> Any:
        return self.inner

    @property
    def contacts(self) -> dict[str, Array]:
        return {}


class MotionAfterEvent(NamedTuple):
    """Motion after an event.

    - `pulls`: whether the lever pulls, `rising`: whether it only begins to
    - `stands`: whether the pulley is at rest at this instant
    - `direction`: where it goes (±1), 0: it is held
    - `omega`: its speed, exactly 0 at rest
    """

    pulls: Mark
    rising: Mark
    stands: Mark
    direction: IntScalar
    omega: ScalarArray

    def settled(self, now: EventState, new: Mode, moving: IntScalar) -> Mode:
        """The mode after the event: held, open, or `moving`."""
        band = jnp.where(self.stands & (self.direction == 0), HELD, moving)
        band = jnp.where(self.pulls, band, OPEN)
        sense = jnp.where(self.direction == 0, now.mode.sense, self.direction)
        return new._replace(band=band.astype(jnp.int32), sense=sense.astype(jnp.int32))


class ContactGuards(NamedTuple):
    """Guards of linings that act as one, or which of them fired.

    - `motion` of the pulley in its sense
    - `high`, `low`: to the limits of the torque ahead and back
    - `lever`: its
      force
    - with heat: `locking` of the linings (`None` where that cannot change), and `sound`
      by each code that it can bring
    """

    motion: Array
    high: Array
    low: Array
    lever: Array
    locking: Array | None
    sound: Any


class AbstractContact(AbstractMechanism):
    """Linings that act as one: open, held, sliding ahead or back, and the modes between
    on an elastic band.

    - `locked`: whether a lining is self-locking at the start; `locking_varies`: whether
      that can change in a run
    - `codes`: ends of the run that heat can bring about
    """

    locked: AbstractVar[Mark]
    locking_varies: AbstractVar[bool]
    codes: AbstractVar[tuple[BrakeCode, ...]]

    def locked_in(self, mode: Mode) -> Mark:
        return self.locked if mode.own.locks is None else mode.own.locks > 0

    @property
    def starts_locked(self) -> IntScalar | None:
        """Whether a lining is self-locking in the first mode, where that can change."""
        return self.locked.astype(jnp.int32) if self.locking_varies else None

    def margins(
        self,
        acting: AppliedLoads,
        omega: Array,
        mode: Mode,
        limits: TwoArrays,
        locking: Array | None,
        sound: dict[BrakeCode, PyTree],
    ) -> ContactGuards:
        """The guards; `locking`: margin of the linings to self-locking, `sound`: those
        of codes while the linings slide."""
        is_open = mode.band == OPEN
        size = self.sizes
        motion = jnp.where(mode.sense > 0, omega, -omega) / size.speed
        motion = jnp.where(is_open | (mode.band == HELD), 1.0, motion)
        lever = jnp.where(is_open, -acting.tension, acting.tension) / size.tension
        locking = (
            None
            if locking is None
            else jnp.where(mode.own.locks > 0, -locking, locking)
        )
        while_sliding = {
            code.name.lower(): jnp.where(slips(mode.band), sound[code], 1.0)
            for code in self.codes
        }
        return ContactGuards(motion, *limits, lever, locking, while_sliding)

    def limits(self, mode: Mode, none: ContactGuards) -> ContactGuards:
        sticks = (mode.band == HELD) | (mode.band == ELASTIC)
        return none._replace(high=sticks, low=sticks)

    def relocked(self, new: Mode, fired: ContactGuards) -> Mode:
        """The mode with or without self-locking linings, if its guard fired."""
        if new.own.locks is None:
            return new
        assert fired.locking is not None
        return new._replace(
            own=new.own._replace(locks=new.own.locks ^ fired.locking.astype(jnp.int32))
        )

    def code_of(self, fired: ContactGuards, code: Array) -> Array:
        """The code of the end of the run whose guard fired, else `code`."""
        for failure in self.codes:
            code = jnp.where(fired.sound[failure.name.lower()], int(failure), code)
        return code

    def onset(
        self, now: EventState, fired: ContactGuards, acting: AppliedLoads, beyond: Array
    ) -> MotionAfterEvent:
        """The motion after an event.

        `beyond`: which limit of holding the load exceeds, 1 the upper, −1 the lower,
        else 0. A guard that fired overrides this comparison at rounding level. A pulley
        without speed in a mode of motion starts at this very instant, in the direction
        found.
        """
        T_0 = acting.tension
        rounding = self.sizes.slight_tension
        rising = (jnp.abs(T_0) <= rounding) & (acting.pull > 0)
        was_open = now.mode.band == OPEN
        was_held = now.mode.band == HELD
        direction = jnp.where(
            was_held & fired.high, 1, jnp.where(was_held & fired.low, -1, beyond)
        )
        stands = was_held | fired.motion | ((now.omega == 0) & was_open)
        moving = jnp.where(
            now.omega == 0, now.mode.sense, jnp.sign(now.omega).astype(jnp.int32)
        )
        direction = jnp.where(stands, direction, moving)
        # (where dry friction of the shaft turns round, a lever that follows the speed
        # may pull only in the other mode)
        pulls = (rounding < T_0) | rising | (was_open & fired.lever)
        return MotionAfterEvent(
            pulls, rising, stands, direction, jnp.where(stands, 0.0, now.omega)
        )

    def with_stuck_speeds(
        self, omega: Array, own: Any, before: Mode, after: Mode
    ) -> tuple[Array, Any]:
        return speed_after(omega, before, after, after.band == HELD), own

    @abc.abstractmethod
    def linings(self, mode: Mode, z: Any) -> LiningForces:
        """Forces at every lining."""

    @abc.abstractmethod
    def kinetic(
        self, force: Array, omega: Array, surface: SurfaceState | None, mode: Mode
    ) -> Vector:
        """Coefficients of friction that the linings have when they slide."""

    def first_shown(
        self,
        tension: Array,
        omega: Array,
        mode: Mode,
        surfaces: Surfaces,
        z: MechanismNow,
    ) -> tuple[PairNow, Array | None]:
        """The pair on which the lever acts, and the tension of the band behind every
        lining."""
        forces = self.linings(mode, z)
        n = (self.pairs[0].count,)
        pair = PairNow(
            force=forces.friction / self.grip.cosine,
            friction=forces.friction,
            normal=forces.normal,
            slip=jnp.broadcast_to(z.slip_speed, n),
            sense=jnp.broadcast_to(sense_of(mode).astype(jnp.int32), n),
            at_limit=forces.at_limit,
            torque=z.brake_torque,
            coefficient=self.kinetic(tension, omega, surfaces[0], mode)
            if self.shows_friction
            else None,
        )
        return pair, forces.tension


class AbstractBand(AbstractContact):
    """Linings that act as one under a band."""

    wrap: AbstractVar[BandFriction]
    distribution: ClassVar[str] = (
        "mobilisation rule: one lining after the other at its limit, from the slack "
        "end (reversed: from the anchor)"
    )

    @property
    def grip(self) -> LiningFriction:
        return self.wrap.grip

    @property
    def locked(self) -> Mark:
        return self.wrap.locked

    @property
    def locking_varies(self) -> bool:
        return self.wrap.grip.varies

    def kinetic(
        self, force: Array, omega: Array, surface: SurfaceState | None, mode: Mode
    ) -> Vector:
        v = jnp.broadcast_to(
            jnp.where(mode.sense > 0, omega, -omega) * self.wrap.radius,
            (self.wrap.count,),
        )
        return self.grip.coefficients(
            force, v, surface, mode.band == SLIP_BACK, static=False
        ).f

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: PyTree,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        return self.grip.torque(
            self.wrap.radius, tension, omega, surfaces[0], static=static
        )[None]


def rigid_mode(direction: IntScalar) -> IntScalar:
    return jnp.where(direction > 0, SLIP, SLIP_BACK)


def sense_of(mode: Mode) -> ScalarArray:
    """Slip direction of linings that act as one: ±1, 0 while they stick."""
    return jnp.where(
        mode.band == SLIP, 1.0, jnp.where(mode.band == SLIP_BACK, -1.0, 0.0)
    )


# --- rigid contact ------------------------------------------------------------------


class Torques(NamedTuple):
    """Maximum torques (N·m, ≥ 0) of linings that slide, or are about to, and what
    belongs to them.

    - `ahead`, `back`: against a motion forwards and backwards
    - `slope`: of implicit coefficients (1 where explicit)
    - `margin`: margin of the linings to self-locking, `None` where that cannot change
    - `law`: further results of the torque law
    """

    ahead: ScalarArray
    back: ScalarArray
    slope: Array
    margin: Any
    law: Any


class RigidNow(MechanismNow):
    """Variables of a rigid contact."""

    torques: Torques


class AbstractRigidContact(AbstractContact):
    """A pulley and a contact without elasticity: `J ω̇ = M_load − M`, `|M|` up to the
    static limit while it is held.

    How the maximum torque follows from the lever's force and from friction is the
    torque law of the contact, the only difference between a band, pads and shoes.

    - `radius` (m) at which the linings slide
    """

    radius: AbstractVar[ScalarArray]

    @abc.abstractmethod
    def torques(
        self,
        force: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array,
    ) -> Torques:
        """Torques for the `force` (N) of the lever.

        - `v` (m/s): slip speed, signed by the sense;  `surface`: state of the surfaces
        - `back`: the pulley turns backwards;  `static`: the static coefficients count
        """

    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[None, np.int32, LumpedMode]:
        return None, OPEN, LumpedMode(self.starts_locked)

    def variables(
        self, acting: AppliedLoads, omega: Array, own: None, mode: Mode
    ) -> RigidNow:
        sliding = slips(mode.band)
        back = mode.band == SLIP_BACK
        held = mode.band == HELD
        force = acting.tension
        speed = self.radius * omega
        v = jnp.where(mode.sense > 0, speed, -speed)
        torques = self.torques(force, v, acting.surfaces[0], back, ~sliding)
        pulling = where_static(
            sliding, where_static(back, -torques.back, torques.ahead), 0.0
        )
        torque = where_static(held, acting.load, pulling)
        force = where_static(mode.band == OPEN, 0.0, force)
        return RigidNow(
            slack_tension=force,
            tight_tension=force + torque / self.radius,
            brake_torque=torque,
            alpha=acceleration(acting.load, pulling, acting.inertia, held),
            slip_speed=where_static(sliding, speed, 0.0),
            lever_power=jnp.zeros_like(force),
            torques=torques,
        )

    def lining_margins(self, mode: Mode, z: RigidNow) -> Float[Array, " twice_n"]:
        return jnp.full(2 * self.pairs[0].count if self.banded else 0, -1.0)

    def own_rates(self, z: RigidNow) -> None:
        return None

    def guards(
        self, acting: AppliedLoads, omega: Array, own: None, mode: Mode, z: RigidNow
    ) -> ContactGuards:
        most = z.torques
        torque = self.sizes.torque
        bounded = (mode.band == HELD) & ~self.locked_in(mode)
        high, low = (
            jnp.where(bounded, left / torque, 1.0)
            for left in limit_margins(acting.load, -most.back, most.ahead)
        )
        sound = {BrakeCode.FLASH_FOLD: most.slope}
        return self.margins(acting, omega, mode, (high, low), most.margin, sound)

    def change(
        self, now: EventState, new: Mode, fired: ContactGuards, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        new = self.relocked(new, fired)
        acting, rest = evaluate(new._replace(band=HELD), now.omega, now.own)
        locked = self.locked_in(new)
        most = rest.torques
        beyond = exceeded(acting.load, -most.back, most.ahead, self.sizes.slight_torque)
        motion = self.onset(now, fired, acting, jnp.where(locked, 0, beyond))
        code = self.code_of(
            fired, jnp.where(locked & motion.pulls, int(BrakeCode.SINGULAR_GEOMETRY), 0)
        )
        return motion.settled(now, new, rigid_mode(motion.direction)), code

    def stored(self, inertia: Array, omega: Array, own: None, mode: Mode) -> TwoArrays:
        kinetic = 0.5 * inertia * omega**2
        return kinetic, jnp.zeros_like(kinetic)

    def own_sizes(self) -> None:
        return None

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: None,
        mode: Mode,
        surfaces: Surfaces,
        z: RigidNow,
    ) -> MechanismOutputs:
        pair, along = self.first_shown(tension, omega, mode, surfaces, z)
        return MechanismOutputs((pair,), along)

    def gain(self, omega: Array, surfaces: Surfaces) -> ScalarArray:
        no = jnp.asarray(False)
        return self.torques(
            jnp.ones(()), self.radius * omega, surfaces[0], no, no
        ).ahead


class RigidBand(AbstractBand, AbstractRigidContact):
    """A rigid band: `M = R_b T_0 (Π − 1)`, backwards `R_b T_0 (1 − 1/Π)`
    (Z-15…Z-18)."""

    wrap: BandFriction
    pairs: tuple[Pair, ...]
    sizes: Sizes

    @property
    def radius(self) -> ScalarArray:
        return self.wrap.radius

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        return (BrakeCode.FLASH_FOLD,) if self.grip.implicit else ()

    def torques(
        self,
        force: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array,
    ) -> Torques:
        limit = self.wrap.limit(force, v, surface, back, static)
        R_b = self.radius
        # at rest the limit in the other direction is needed as well
        moving = band_torque(R_b, force, force * limit.ratio)
        falling = jnp.where(back, -moving, band_torque(R_b, force / limit.other, force))
        return Torques(moving, falling, limit.slope, limit.margin, limit.fz)

    def linings(self, mode: Mode, z: RigidNow) -> LiningForces:
        return self.wrap.linings(z.slack_tension, z.tight_tension, z.torques.law)

    def contact_states(self, mode: Mode, z: RigidNow) -> tuple[ContactState, ...]:
        each, normal = self.wrap.sliding(
            z.slack_tension, z.torques.law, mode.band == SLIP_BACK
        )
        force = each if self.pairs[0].apart else z.brake_torque / self.radius
        return (ContactState(force, z.slip_speed, sense_of(mode), normal),)


#: a lining this near to self-locking counts as self-locking: friction would be
#: unbounded, and no step would cross
_NEARLY = 1e-6


class Pressing(NamedTuple):
    """Linings that slide, or are about to: coefficients (n,), and the maximum friction
    forces (N) either way."""

    f: Vector
    ahead: Vector
    back: Vector


class PressedContact(AbstractRigidContact):
    """Linings that a force presses on a turning face, as pads and shoes:
    `M = r Σ f_i N_i`.

    - `brake`: gives the normal forces `N_i` from the force of the lever and friction
    """

    brake: AbstractPressedBrake
    grip: PadFriction
    locked: Mark
    pairs: tuple[Pair, ...]
    sizes: Sizes
    distribution: ClassVar[str] = (
        "linings that stick share the torque as the maximum friction that each can give"
    )
    banded: ClassVar[bool] = False
    codes: ClassVar[tuple[BrakeCode, ...]] = ()

    @property
    def radius(self) -> ScalarArray:
        return jnp.asarray(self.brake.radius)

    @property
    def couples_loads(self) -> bool:
        return self.brake.couples_loads

    @property
    def locking_varies(self) -> bool:
        return self.brake.can_lock and self.grip.varies

    def _coefficients(
        self, force: Array, v: Array, surface: SurfaceState | None, static: Array | bool
    ) -> Vector:
        n = self.brake.linings.count
        # only where no friction presses a lining on may its law depend on the pressure
        N = (
            None
            if self.brake.can_lock
            else self.brake.normal(force, jnp.zeros(n), False)
        )
        return self.grip.coefficients(jnp.broadcast_to(v, (n,)), surface, N, static)

    def torques(
        self,
        force: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array,
    ) -> Torques:
        f = self._coefficients(force, v, surface, static)
        pressing = Pressing(
            f,
            f * self.brake.normal(force, f, False),
            f * self.brake.normal(force, f, True),
        )
        margin = None
        if self.locking_varies:
            still = self._coefficients(force, jnp.zeros_like(v), surface, True)
            margin = 1 - _NEARLY - largest(self.brake.self_locking(still))
        ahead = self.radius * jnp.sum(pressing.ahead)
        behind = self.radius * jnp.sum(pressing.back)
        return Torques(ahead, behind, jnp.ones(()), margin, pressing)

    def linings(self, mode: Mode, z: RigidNow) -> LiningForces:
        slack = z.slack_tension
        pressing = z.torques.law
        most = jnp.where(mode.band == SLIP_BACK, pressing.back, pressing.ahead)
        whole = jnp.sum(most)
        share = (z.tight_tension - slack) / jnp.where(whole > 0, whole, 1.0)
        friction = share * most
        at_limit = jnp.broadcast_to(
            (jnp.abs(share) >= 1 - 1e-12) & (slack > 0), friction.shape
        )
        return LiningForces(
            None, friction, self.brake.normal_under(slack, friction), at_limit
        )

    def kinetic(
        self, force: Array, omega: Array, surface: SurfaceState | None, mode: Mode
    ) -> Vector:
        return self._coefficients(
            force,
            jnp.where(mode.sense > 0, omega, -omega) * self.radius,
            surface,
            False,
        )

    def contact_states(self, mode: Mode, z: RigidNow) -> tuple[ContactState, ...]:
        back = mode.band == SLIP_BACK
        sense = sense_of(mode)
        pressing = z.torques.law
        normal = jnp.where(
            mode.band == OPEN, 0.0, self.brake.normal(z.slack_tension, pressing.f, back)
        )
        friction = sense * jnp.where(back, pressing.back, pressing.ahead)
        force = friction if self.pairs[0].apart else z.brake_torque / self.radius
        return (ContactState(force, z.slip_speed, sense, normal),)

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: None,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        v = jnp.zeros_like(omega) if static else jnp.abs(omega) * self.radius
        torques = self.torques(
            tension, v, surfaces[0], jnp.asarray(False), jnp.asarray(static)
        )
        torque = jnp.where(omega < 0, torques.back, torques.ahead)
        locks = jnp.max(self.brake.self_locking(torques.law.f)) >= 1
        return jnp.where(tension > 0, jnp.where(locks, jnp.inf, torque), 0.0)[None]


# --- several bands under one lever --------------------------------------------------


def _total(parts: Iterable[Array]) -> Array:
    return functools.reduce(jnp.add, parts)


class RigidBands(AbstractRigidContact):
    """Rigid bands on one shaft, which slide and stick together:
    `M = Σ_j R_b s_j T_0 (Π_j − 1)`.

    - `bands`, each with its own linings;  `shares` `s_j` of the lever's tension
    - `grip`: friction of the linings of all bands, one band after the other
    """

    bands: tuple[RigidBand, ...]
    shares: Float[Array, " k"]
    grip: LiningFriction
    pairs: tuple[Pair, ...]
    sizes: Sizes
    distribution: ClassVar[str] = (
        "bands that stick share the torque as the maximum torque of each; in each the "
        "mobilisation rule: one lining "
        "after the other at its limit, from the slack end (reversed: from the anchor)"
    )

    @property
    def law(self) -> JoinedFriction:
        """The friction law of all linings."""
        return self.grip.linings.friction  # pyright: ignore

    @property
    def radius(self) -> ScalarArray:
        return self.bands[0].radius

    @property
    def locked(self) -> Mark:
        return functools.reduce(jnp.logical_or, [band.locked for band in self.bands])

    @property
    def locking_varies(self) -> bool:
        return any(band.locking_varies for band in self.bands)

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        return next((band.codes for band in self.bands if band.codes), ())

    def _each(
        self, force: Array, surface: SurfaceState | None
    ) -> list[tuple[RigidBand, ScalarArray, SurfaceState | None]]:
        """The bands with their slack tensions, and the surfaces of their linings."""
        tensions = jnp.unstack(self.shares * force)
        law = self.law
        return [
            (band, tensions[j], law.own(surface, j))
            for j, band in enumerate(self.bands)
        ]

    def torques(
        self,
        force: Array,
        v: Array,
        surface: SurfaceState | None,
        back: Array,
        static: Array,
    ) -> Torques:
        each = tuple(
            band.torques(T_0, v, own, back, static)
            for band, T_0, own in self._each(force, surface)
        )
        margins = [band.margin for band in each if band.margin is not None]
        return Torques(
            ahead=_total(band.ahead for band in each),
            back=_total(band.back for band in each),
            slope=functools.reduce(jnp.minimum, [band.slope for band in each]),
            margin=functools.reduce(jnp.minimum, margins) if margins else None,
            law=each,
        )

    def _alone(self, z: RigidNow) -> list[tuple[RigidBand, RigidNow]]:
        """The bands with the variables that each has; where they stick they share the
        torque as its maximum."""
        most = z.torques
        backwards = z.brake_torque < 0
        whole = jnp.where(backwards, most.back, most.ahead)
        share = z.brake_torque / jnp.where(whole > 0, whole, 1.0)
        bands = []
        for (band, T_0, _), own in zip(
            self._each(z.slack_tension, None), most.law, strict=True
        ):
            torque = share * jnp.where(backwards, own.back, own.ahead)
            tight = T_0 + torque / self.radius
            alone = dataclasses.replace(
                z,
                slack_tension=T_0,
                tight_tension=tight,
                brake_torque=torque,
                torques=own,
            )
            bands.append((band, alone))
        return bands

    def linings(self, mode: Mode, z: RigidNow) -> LiningForces:
        each = [band.linings(mode, own) for band, own in self._alone(z)]
        return LiningForces(
            *(jnp.concatenate(parts) for parts in zip(*each, strict=True))
        )

    def kinetic(
        self, force: Array, omega: Array, surface: SurfaceState | None, mode: Mode
    ) -> Vector:
        return jnp.concatenate(
            [
                band.kinetic(T_0, omega, own, mode)
                for band, T_0, own in self._each(force, surface)
            ]
        )

    def contact_states(self, mode: Mode, z: RigidNow) -> tuple[ContactState, ...]:
        each = [band.contact_states(mode, own)[0] for band, own in self._alone(z)]
        apart = self.pairs[0].apart
        force = (
            jnp.concatenate([rub.force for rub in each])
            if apart
            else z.brake_torque / self.radius
        )
        return (
            ContactState(
                force,
                z.slip_speed,
                sense_of(mode),
                jnp.concatenate([rub.normal for rub in each]),
            ),
        )

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: None,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        each = self._each(tension, surfaces[0])
        return _total(
            band.capacity(T_0, omega, own, (here,), static=static)
            for band, T_0, here in each
        )

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: None,
        mode: Mode,
        surfaces: Surfaces,
        z: RigidNow,
    ) -> MechanismOutputs:
        shown = super().shown(tension, omega, own, mode, surfaces, z)
        spans = self.law.spans
        slack = jnp.unstack(self.shares * z.slack_tension)
        parts = [
            (T_0[None], shown.tension[first : last - 1])
            for T_0, (first, last) in zip(slack, spans, strict=True)
        ]
        return shown._replace(
            before=jnp.concatenate([tensions for part in parts for tensions in part])
        )
