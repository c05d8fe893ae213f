"""The shaft beside the brake: its torques against the load, rest on dry friction, and a
motor."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from .._base._corners import clipped
from ..hybrid.arrays import Array
from ..loads import AbstractFollower, Motor, RecordedMotion
from ..phases import PhaseNow, Phases
from ..profiles import AbstractProfile, Piece
from ..shaft import (
    AbstractAuxiliaryBrake,
    AbstractDryTorque,
    AbstractShaftTorque,
    TackleLoss,
)
from ._brake import (
    BrakeAtInstant,
    BrakeGuards,
    BrakeNow,
    BrakeSystem,
    Feature,
    State,
    at_phase,
    numbered,
    piece_of,
)
from ._contact import contact_margin
from .mechanism import HELD, OPEN, Ledger, Mode


class ShaftNow(NamedTuple):
    """Torques at one instant (N·m, signed like the rotation) of each law, the part
    `left` of the load, and the `limit` of all dry ones together (`None` without
    any)."""

    each: tuple[Array, ...]
    left: Array
    limit: Any = None

    @property
    def total(self) -> Array:
        return sum(self.each[1:], start=self.each[0])


def rests(mode: Mode) -> Any:
    """Whether the pulley is at rest: held by the brake, or, with the band open, by dry
    friction of the shaft."""
    inner = mode.inner
    still = (
        (mode.band == HELD)
        if mode.turn is None
        else (mode.band == HELD) | ((mode.band == OPEN) & (mode.turn == 0))
    )
    return still if inner is None else still & (inner == 0)


def way_of(mode: Mode) -> Array:
    """Sense in which the pulley turns in a mode, 0 at rest, on a shaft with dry
    friction."""
    turn = mode.turn
    inner = mode.inner
    if inner is not None:
        # at an event the pair on the rim may break loose before the shaft knows its way
        turn = jnp.where((inner != 0) & (turn == 0), inner, turn)
    return jnp.where(rests(mode), 0, turn).astype(jnp.float64)


def _begun_by(torque: Array) -> Array:
    """Sense, ±1, of the rotation that a torque begins."""
    return jnp.where(torque < 0, -1.0, 1.0)


def _limit(torques: list[tuple[bool, Array]], way: Array) -> Array:
    """Limit (N·m, ≥ 0) of all dry friction together against a rotation in the sense
    `way`, ±1."""
    return jnp.asarray(sum(way * torque for dry, torque in torques if dry))


def borne_at_rest(load: Array, limit: Array) -> Array:
    """`clip(load, ±limit)`, with derivatives of one side also where `limit` is 0:
    without a load it stays 0."""
    return jnp.where(jnp.abs(load) < limit, load, jnp.sign(load) * limit)


class Shaft(Feature):
    """Torques beside the brake.

    In motion dry friction `M_c` takes its part of the load, `M_load − M_c sign ω`; at
    rest the bearings come first and the brake bears the rest,
    `M_load − clip(M_load, ±M_c)`. The limit `M_c` is that of the sense of the motion,
    at rest of the one that the load, less the motor, would begin.
    """

    laws: tuple[AbstractShaftTorque, ...]
    phases: Phases | None = None  # of a duty that engages auxiliary brakes

    def engaged(self, mode: Mode) -> "Shaft":
        """The shaft in the phase that runs."""
        if self.phases is None:
            return self
        share = self.phases.engagement(mode.phase)
        return Shaft(
            tuple(
                law.engaged(share) if isinstance(law, AbstractAuxiliaryBrake) else law
                for law in self.laws
            )
        )

    @property
    def profiles(self) -> dict[str, AbstractProfile | Phases]:
        return numbered("shaft", (law.profile for law in self.laws))

    @property
    def dry(self) -> bool:
        """Whether the shaft can stick."""
        return any(isinstance(law, AbstractDryTorque) for law in self.laws)

    @property
    def tackle(self) -> TackleLoss | None:
        """The loss of the tackle."""
        return next((law for law in self.laws if isinstance(law, TackleLoss)), None)

    def pieces(self, mode: Mode) -> tuple[Piece, ...]:
        """Those on which the laws' profiles are."""
        return tuple(piece_of(mode, name) for name in self.profiles)

    def _torques(
        self, t: Array, omega: Array, load: Array, way: Array, pieces: tuple[Piece, ...]
    ) -> list[tuple[bool, Array]]:
        """Torque (N·m) of each law on a shaft that turns in the sense `way`, and
        whether it is dry friction."""
        given = zip(self.laws, pieces, strict=True)
        return [
            (
                isinstance(law, AbstractDryTorque),
                jnp.asarray(law.turning(t, omega, piece, load, way)),
            )
            for law, piece in given
        ]

    def now(
        self,
        t: Array,
        omega: Array,
        loads: tuple[Array, Array],
        mode: Mode,
        pieces: tuple[Piece, ...],
        motor: Array | None = None,
    ) -> ShaftNow:
        """The torques in a mode.

        - `loads` (N·m): of the load at the speed `omega`, and on a shaft at rest
        - `motor`: torque of a motor, which
          takes its part of them
        """
        shaft = self.engaged(mode)
        load = loads[1]
        if motor is not None:
            loads = (loads[0] - motor, loads[1] - motor)
        if not self.dry:
            each = tuple(
                torque
                for _, torque in shaft._torques(t, omega, load, jnp.sign(omega), pieces)
            )
            return ShaftNow(each, loads[0] - sum(each[1:], start=each[0]))
        rest = loads[1]
        still = rests(mode)
        way = jnp.where(still, _begun_by(rest), way_of(mode))
        torques = shaft._torques(t, omega, load, way, pieces)
        limit = _limit(torques, way)
        # with the band open the load is within the limit as long as the mode lasts
        borne = jnp.where(mode.band == HELD, borne_at_rest(rest, limit), rest)
        share = jnp.where(still, way * borne / jnp.where(limit > 0, limit, 1.0), 1.0)
        each = tuple(share * torque if dry else torque for dry, torque in torques)
        left = loads[0] - sum(each[1:], start=each[0])
        return ShaftNow(each, jnp.where(still, rest - borne, left), limit)

    def turning(
        self,
        t: Array,
        omega: Array,
        load: Array,
        sense: Array,
        pieces: tuple[Piece, ...],
    ) -> Array:
        """Sum of the torques (N·m) of a shaft that turns in the `sense` ±1."""
        return sum(
            (torque for _, torque in self._torques(t, omega, load, sense, pieces)),
            start=jnp.zeros(()),
        )

    def powers(
        self, now: ShaftNow | None, omega: Array
    ) -> list[tuple[str | None, Array]]:
        """Place and power (W) of the heat of each law."""
        assert now is not None
        return [
            (law.place, torque * omega)
            for law, torque in zip(self.laws, now.each, strict=True)
        ]

    def heating(
        self, now: ShaftNow | None, omega: Array
    ) -> tuple[tuple[str, Array], ...]:
        """The same of those whose heat enters a body."""
        return tuple(
            (place, power)
            for place, power in self.powers(now, omega)
            if place is not None
        )

    # --- as a feature of the brake ---------------------------------------------------

    def book(self, brake: BrakeSystem, ledger: Ledger, of_each: Any) -> Ledger:
        return ledger._replace(shaft=tuple(of_each for _ in self.laws))

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        y = now.y
        mode = now.mode
        return y, mode._replace(
            turn=jnp.sign(y.omega).astype(jnp.int32)
        ) if self.dry else mode

    def torques(self, now: BrakeAtInstant) -> BrakeNow:
        brake, t, y, mode, z = now
        drive = brake.feature(Drive)
        if drive is not None:  # which takes its part of the load first
            z = drive.torques(now)
        at_rest = brake.load_torque(t, 0.0 * y.omega, mode, y)
        shaft = self.now(
            t, y.omega, (z.load_torque, at_rest), mode, self.pieces(mode), z.motor
        )
        return z._replace(shaft=shaft, net_load=shaft.left)

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        powers = tuple(power for _, power in self.powers(now.z.shaft, now.y.omega))
        return rates._replace(ledger=rates.ledger._replace(shaft=powers))

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        """Guard of dry friction: of a turning shaft until it comes to rest, of a
        resting one until the load exceeds it.

        Where the mechanism itself watches the speed of the pulley, or holds it, the
        margin is 1.
        """
        if not self.dry:
            return guards
        brake, t, y, mode, z = now
        load = brake.load_torque(t, 0.0 * y.omega, mode, y)
        size = brake.sizes
        is_open = mode.band == OPEN
        load = load if z.motor is None else load - z.motor
        watched = is_open if mode.inner is None else is_open | (mode.inner != 0)
        watched = (watched & (mode.turn != 0)) | (rests(mode) & is_open)
        left = (z.shaft.limit - jnp.abs(load)) / size.torque
        return guards._replace(
            dry_shaft=jnp.where(
                watched, contact_margin(mode.turn, left, y.omega / size.speed), 1.0
            )
        )

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        return limits._replace(dry_shaft=mode.turn == 0) if self.dry else limits

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        """The mode with the sense in which the pulley turns after an event, 0 at
        rest."""
        if not self.dry:
            return new, code
        brake, t, y, mode, _ = now
        load = brake.load_torque(t, 0.0 * y.omega, new, y)
        before = mode.turn
        drive = brake.feature(Drive)
        left = load if drive is None else load - drive.torque(brake, t, y.omega, y, new)
        begun = _begun_by(left)
        limit = _limit(
            self.engaged(new)._torques(t, y.omega, load, begun, self.pieces(new)), begun
        )
        load = left
        resting = before == 0
        way = jnp.sign(load).astype(jnp.int32)
        settled = jnp.where(jnp.abs(load) <= limit + brake.sizes.slight_torque, 0, way)
        free = jnp.where(
            resting & fired.dry_shaft,
            way,
            jnp.where(resting | fired.dry_shaft, settled, before),
        )
        turn = jnp.where(
            new.band == OPEN, free, jnp.where(new.band == HELD, 0, new.sense)
        )
        if new.inner is not None:
            loose = jnp.where(
                resting, new.inner, jnp.where(fired.dry_shaft, -before, before)
            )
            turn = jnp.where(new.inner == 0, turn, loose)
        return new._replace(turn=turn.astype(jnp.int32)), code

    def speed_after(self, now: BrakeAtInstant, after: Mode, omega: Array) -> Array:
        return jnp.where(after.turn == now.mode.turn, omega, 0.0) if self.dry else omega


# --- a motor ------------------------------------------------------------------------

#: share of its maximum speed below which a motor has brought the pulley to rest
_STILL = 1e-6


class Drive(Feature):
    """A motor that follows a speed (`Motor`); the brake asks it for its torque, as a
    torque on the shaft.

    - `course`: the speed that it follows, as a lever that controls the speed
    """

    motor: Motor
    course: AbstractFollower | Phases

    @property
    def profiles(self) -> dict[str, AbstractProfile | Phases]:
        return {"motor": self.course}

    def piece(self, mode: Mode) -> Piece:
        """The piece on which its course is, of a recorded motion that of the lever."""
        return piece_of(
            mode, "lever" if isinstance(self.course, RecordedMotion) else "motor"
        )

    def now(self, y: State | None, mode: Mode) -> AbstractFollower | PhaseNow:
        """The course, or that of the phase that runs."""
        return at_phase(self.course, y, mode)

    def follows(self, y: State | None, mode: Mode) -> Array:
        """Whether it is on."""
        return jnp.asarray(self.now(y, mode).follows(self.piece(mode)))

    def torque(
        self, brake: BrakeSystem, t: Array, omega: Array, y: State, mode: Mode
    ) -> Array:
        """Torque (N·m) against the braking direction, 0 while it is off.

        It overcomes the dry friction of the shaft, too: against the rotation, or the
        motion that it begins.
        """
        course = self.now(y, mode)
        piece = self.piece(mode)
        zero = jnp.zeros_like(omega)
        turned = y.phi if y.phase is None else y.phase.turned
        load = brake.load_torque(t, omega, mode, y)
        shaft = brake.feature(Shaft)
        if shaft is not None:
            begins = -course.wanted_torque(
                t, omega, piece, zero, jnp.ones_like(omega), turned
            )
            way = jnp.sign(jnp.where(omega == 0, begins, omega))
            load = load - shaft.engaged(mode).turning(
                t, omega, brake.load_torque(t, zero, mode, y), way, shaft.pieces(mode)
            )
        inertia = jnp.asarray(brake.inertia_at(mode, y))
        most = self.motor.available(omega)
        wanted = jnp.asarray(
            course.wanted_torque(t, omega, piece, load, inertia, turned)
        )
        return jnp.where(course.follows(piece), clipped(wanted, -most, most), 0.0)

    # --- as a feature of the brake ---------------------------------------------------

    def rests_open(self, brake: BrakeSystem) -> bool:
        return True

    def torques(self, now: BrakeAtInstant) -> BrakeNow:
        brake, t, y, mode, z = now
        if z.motor is not None:  # the shaft has asked for it
            return z
        motor = self.torque(brake, t, y.omega, y, mode)
        return z._replace(motor=motor, net_load=z.net_load - motor)

    def book(self, brake: BrakeSystem, ledger: Ledger, of_each: Any) -> Ledger:
        return ledger._replace(motor=of_each)

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        # (where the lever takes what its limits leave, the speed shows nothing of them:
        # its work has to)
        size = brake.sizes.torque if brake.lever.controls_speed else jnp.inf
        return sizes._replace(ledger=sizes.ledger._replace(motor=size))

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        return rates._replace(
            ledger=rates.ledger._replace(motor=-now.z.motor * now.y.omega)
        )

    def settled(self, now: BrakeAtInstant, fired: BrakeGuards, omega: Array) -> Array:
        stands = (now.mode.band == OPEN) & (
            jnp.abs(omega) <= _STILL * self.motor.max_speed
        )
        return jnp.where(stands, 0.0, omega)

    def before(
        self, now: BrakeAtInstant, new: Mode, fired: object
    ) -> tuple[State, Mode]:
        """Its course begins anew with a phase (after the phases themselves:
        `DutyInPhases`)."""
        if not isinstance(self.course, Phases):
            return now.y, new
        if new.pieces["motor"] is None:
            return now.y, new
        begins = (new.phase > now.mode.phase) & (new.phase < self.course.total)
        first = self.course.at(new.phase, now.t).first_piece(now.t)
        piece = jnp.where(begins, first, new.pieces["motor"])
        return now.y, new._replace(pieces={**new.pieces, "motor": piece})
