"""The motor of a drawworks: its torque on the shaft, and the work that it gives."""

import jax.numpy as jnp
import numpy as np

from .._base._corners import clipped
from .._phases import PhaseNow, Phases
from ..hybrid import QUADRATURE
from ..hybrid._arrays import Array
from ..hybrid._struct import struct_field
from ..loads import AbstractFollower, Motor, RecordedMotion
from ._feature import HEAT, LEVER, AbstractBrake, BrakeGuards, Feature, Moment, State, piece_of
from ._mechanism import OPEN, Mode
from ._shaft import Shaft

#: share of its maximum speed below which a motor has brought the pulley to rest
_STILL = 1e-6


class Drive(Feature):
    """A motor that follows a speed (`Motor`); the brake asks it for its torque, as a torque on the shaft.

    - `course`: the speed that it follows, as a lever that controls the speed
    - `heat_profiles`: how many given functions of time the heat has
    """

    motor: Motor
    course: AbstractFollower | Phases
    heat_profiles: int = struct_field(static=True)

    @property
    def piece(self) -> int:
        """Place among `Mode.pieces`: behind the profiles of the heat; of a recorded motion that of the lever."""
        return LEVER if isinstance(self.course, RecordedMotion) else HEAT + self.heat_profiles

    def now(self, y: State | None, mode: Mode) -> AbstractFollower | PhaseNow:
        """The course, or that of the phase that runs; without phases the state may be left out."""
        if not isinstance(self.course, Phases):
            return self.course
        assert y is not None
        return self.course.at(mode.phase, y.phase.begun)

    def torque(self, brake: AbstractBrake, t: Array, omega: Array, y: State, mode: Mode) -> Array:
        """Torque (N·m) against the braking direction, 0 while it is off.

        It overcomes the dry friction of the shaft, too: against the rotation, or the motion that it begins.
        """
        course, piece, zero = self.now(y, mode), piece_of(mode, self.piece), jnp.zeros_like(omega)
        turned = y.phi if y.phase is None else y.phase.turned
        load, shaft = brake.load_torque(t, omega, mode, y), brake.feature(Shaft)
        if shaft is not None:
            begins = -course.wanted_torque(t, omega, piece, zero, jnp.ones_like(omega), turned)
            way = jnp.sign(jnp.where(omega == 0, begins, omega))
            load = load - shaft.engaged(mode).turning(
                t, omega, brake.load_torque(t, zero, mode, y), way, shaft.pieces(mode)
            )
        inertia, most = jnp.asarray(brake.inertia_at(mode)), self.motor.available(omega)
        wanted = jnp.asarray(course.wanted_torque(t, omega, piece, load, inertia, turned))
        return jnp.where(course.follows(piece), clipped(wanted, -most, most), 0.0)

    # --- as a feature of the brake ------------------------------------------------------------------------------------

    def start(self, now: Moment) -> tuple[State, Mode]:
        return now.y._replace(ledger=now.y.ledger._replace(motor=now.y.ledger.load_work)), now.mode

    def sizes(self, brake: AbstractBrake, sizes: State) -> State:
        # (where the lever takes what its limits leave, the speed shows nothing of them: its work has to)
        size = brake.sizes.torque if brake.lever.controls_speed else jnp.inf
        return sizes._replace(ledger=sizes.ledger._replace(motor=size))

    def places(self, brake: AbstractBrake, places: State) -> State:
        return places._replace(ledger=places.ledger._replace(motor=np.asarray(QUADRATURE)))

    def rates(self, now: Moment, rates: State) -> State:
        return rates._replace(ledger=rates.ledger._replace(motor=-now.z.motor * now.y.omega))

    def settled(self, now: Moment, fired: BrakeGuards, omega: Array) -> Array:
        stands = (now.mode.band == OPEN) & (jnp.abs(omega) <= _STILL * self.motor.max_speed)
        return jnp.where(stands, 0.0, omega)

    def before(self, now: Moment, new: Mode, fired: object) -> tuple[State, Mode]:
        """Its course begins anew with a phase (after the phases themselves: `DutyInPhases`)."""
        if not isinstance(self.course, Phases):
            return now.y, new
        begins = (new.phase > now.mode.phase) & (new.phase < self.course.total)
        if new.pieces[self.piece] is None:
            return now.y, new
        first = self.course.at(new.phase, now.t).first_piece(now.t)
        pieces = list(new.pieces)
        pieces[self.piece] = jnp.where(begins, first, pieces[self.piece])
        return now.y, new._replace(pieces=tuple(pieces))
