"""Rigid contact: the brake torque follows at once from the lever's force and from friction."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Bool, Float

from ..brakes._band import LiningForces
from ..brakes._pressed import AbstractPressedBrake
from ..hybrid import largest
from ..hybrid._arrays import Array
from ._mechanism import (
    HELD,
    OPEN,
    AbstractMechanism,
    BandMode,
    BrakeCode,
    Locking,
    Mode,
    Pair,
    Rub,
    Shown,
    Sizes,
    arrested,
    failed,
    moving_as_one,
    onset,
    pick,
    rigid_mode,
    sense_of,
    settled_mode,
    slips,
)
from ._sliding import AbstractGrip, FaceGrip
from ._wrap import MOBILISATION, Wrap, band_torque


class Torques(NamedTuple):
    """Greatest torques (N·m, ≥ 0) of linings that slide, or are about to, and what belongs to them.

    - `ahead`, `back`: against a motion forwards and backwards;  `slope`: of implicit coefficients (1 where explicit)
    - `margin`: by how much the linings are away from locking themselves, `None` where that cannot change
    - `law`: what else the torque law has found
    """

    ahead: Float[Array, ""]
    back: Float[Array, ""]
    slope: Array
    margin: Any
    law: Any


class AbstractTorqueLaw(eqx.Module):
    """The greatest torque of a rigid contact as a function of the lever's force and of friction."""

    @property
    @abc.abstractmethod
    def grip(self) -> AbstractGrip:
        """Friction of the linings."""

    @property
    @abc.abstractmethod
    def locked(self) -> Bool[Array, ""]:
        """Whether the linings lock themselves at the start."""

    @property
    @abc.abstractmethod
    def distribution(self) -> str:
        """How the linings share the torque, in words."""

    @abc.abstractmethod
    def linings(self, slack: Array, tight: Array, mode: Mode, found: Torques) -> LiningForces:
        """Forces at every lining."""

    @abc.abstractmethod
    def kinetic(self, force: Array, omega: Array, surface: Any, mode: Mode) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""

    @property
    @abc.abstractmethod
    def radius(self) -> Float[Array, ""]:
        """At which the linings slide (m)."""

    @property
    @abc.abstractmethod
    def varies(self) -> bool:
        """Whether the friction of sticking linings can change in a run."""

    @property
    @abc.abstractmethod
    def locking_varies(self) -> bool:
        """Whether linings can come to lock themselves in a run, or cease to."""

    @property
    def banded(self) -> bool:
        """Whether the linings are under a band."""
        return False

    @property
    def couples_loads(self) -> bool:
        """Whether the load of a lining depends on the friction of others."""
        return True

    @property
    @abc.abstractmethod
    def implicit(self) -> bool:
        """Whether coefficients of friction depend on the forces and heat that they give."""

    @abc.abstractmethod
    def torques(self, force: Array, v: Array, surface: Any, back: Array, static: Array) -> Torques:
        """Torques for the `force` (N) of the lever.

        - `v` (m/s): slip speed, signed by the sense;  `surface`: state of the surfaces
        - `back`: the pulley turns backwards;  `static`: the static coefficients count
        """

    @abc.abstractmethod
    def rub(self, force: Array, torque: Array, slip: Array, mode: Mode, found: Torques, apart: bool) -> Rub:
        """The pair at one instant, for the `force` of the lever and the brake `torque`."""

    @abc.abstractmethod
    def capacity(self, force: Array, omega: Array, surface: Any) -> Float[Array, ""]:
        """Greatest torque (N·m, ≥ 0) against the motion at the speed `omega` of the pulley."""


class BandTorque(AbstractTorqueLaw):
    """A rigid band: `M = R_b T_0 (Π − 1)`, backwards `R_b T_0 (1 − 1/Π)` (Z-15…Z-18)."""

    wrap: Wrap

    @property
    def grip(self):
        return self.wrap.grip

    @property
    def distribution(self):
        return MOBILISATION

    def linings(self, slack, tight, mode, found):
        return self.wrap.linings(slack, tight, found.law)

    def kinetic(self, force, omega, surface, mode):
        return self.wrap.kinetic(force, omega, surface, mode)

    @property
    def radius(self):
        return self.wrap.radius

    @property
    def locked(self):
        return self.wrap.locked

    @property
    def varies(self):
        return self.wrap.grip.varies

    @property
    def locking_varies(self):
        return self.wrap.grip.varies

    @property
    def banded(self):
        return True

    @property
    def implicit(self):
        return self.wrap.grip.implicit

    def torques(self, force, v, surface, back, static):
        found, R_b = self.wrap.limit(force, v, surface, back, static), self.wrap.radius
        # the limit the other way is asked for at rest, where the one found is that ahead
        moving = R_b * (force * found.ratio - force)
        return Torques(
            moving, jnp.where(back, -moving, R_b * (force - force / found.other)), found.slope, found.margin, found.fz
        )

    def rub(self, force, torque, slip, mode, found, apart):
        each, normal = self.wrap.sliding(force, found.law, mode.band == BandMode.SLIP_BACK)
        return Rub(each if apart else torque / self.wrap.radius, slip, sense_of(mode), normal)

    def capacity(self, force, omega, surface):
        return band_torque(self.grip, self.wrap.radius, force, omega, surface)


#: a lining that is so near to locking itself does: its friction would be without bounds, and no step cross the end
_NEARLY = 1e-6


class Pressing(NamedTuple):
    """Linings that slide, or are about to: coefficients (n,), and the greatest friction forces (N) either way."""

    f: Float[Array, " n"]
    ahead: Float[Array, " n"]
    back: Float[Array, " n"]


class PressedTorque(AbstractTorqueLaw):
    """Linings that a force presses on a turning face, as pads and shoes: `M = r Σ f_i N_i`.

    - `brake`: says how the normal forces `N_i` follow from the force of the lever and from friction
    - `friction`: its coefficients;  `locks`: whether a lining locks itself at the start
    """

    brake: AbstractPressedBrake
    friction: FaceGrip
    locks: Bool[Array, ""]

    @property
    def grip(self):
        return self.friction

    @property
    def locked(self):
        return self.locks

    @property
    def distribution(self):
        return "linings that stick share the torque as the greatest friction that each can give"

    @property
    def radius(self):
        return jnp.asarray(self.brake.radius)

    @property
    def varies(self):
        return self.friction.varies

    @property
    def couples_loads(self):
        return False  # that of a shoe depends on its own friction alone

    @property
    def locking_varies(self):
        return self.brake.can_lock and self.friction.varies

    @property
    def implicit(self):
        return False

    def _coefficients(self, force: Array, v: Array, surface: Any, static: Any) -> Float[Array, " n"]:
        n = self.brake.linings.count
        # only where no friction presses a lining on may its law look at the pressure
        N = None if self.brake.can_lock else self.brake.normal(force, jnp.zeros(n), False)
        return self.friction.coefficients(jnp.broadcast_to(v, (n,)), surface, N, static)

    def torques(self, force, v, surface, back, static):
        f = self._coefficients(force, v, surface, static)
        found = Pressing(f, f * self.brake.normal(force, f, False), f * self.brake.normal(force, f, True))
        margin = None
        if self.locking_varies:
            still = self._coefficients(force, jnp.zeros_like(v), surface, True)
            margin = 1 - _NEARLY - largest(self.brake.self_locking(still))
        ahead, behind = self.radius * jnp.sum(found.ahead), self.radius * jnp.sum(found.back)
        return Torques(ahead, behind, jnp.ones(()), margin, found)

    def linings(self, slack, tight, mode, found):
        most = jnp.where(mode.band == BandMode.SLIP_BACK, found.law.back, found.law.ahead)
        whole = jnp.sum(most)
        share = (tight - slack) / jnp.where(whole > 0, whole, 1.0)
        friction = share * most
        at_limit = jnp.broadcast_to((jnp.abs(share) >= 1 - 1e-12) & (slack > 0), friction.shape)
        return LiningForces(None, friction, self.brake.normal_under(slack, friction), at_limit)

    def kinetic(self, force, omega, surface, mode):
        return self._coefficients(force, jnp.where(mode.sense > 0, omega, -omega) * self.radius, surface, False)

    def rub(self, force, torque, slip, mode, found, apart):
        back, sense = mode.band == BandMode.SLIP_BACK, sense_of(mode)
        normal = jnp.where(mode.band == BandMode.OPEN, 0.0, self.brake.normal(force, found.law.f, back))
        friction = sense * jnp.where(back, found.law.back, found.law.ahead)
        return Rub(friction if apart else torque / self.radius, slip, sense, normal)

    def capacity(self, force, omega, surface):
        no = jnp.asarray(False)
        found = self.torques(force, jnp.abs(omega) * self.radius, surface, no, no)
        torque = jnp.where(omega < 0, found.back, found.ahead)
        locks = jnp.max(self.brake.self_locking(found.law.f)) >= 1
        return jnp.where(force > 0, jnp.where(locks, jnp.inf, torque), 0.0)


class RigidNow(NamedTuple):
    """Variables of a rigid contact."""

    slack_tension: Float[Array, ""]  # T_0 (N): the lever's force, 0 while it does not pull
    tight_tension: Float[Array, ""]  # T_n (N)
    brake_torque: Float[Array, ""]  # N·m
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    slip_speed: Float[Array, ""]  # m/s
    lever_power: Float[Array, ""]  # W
    torques: Torques


class RigidContact(AbstractMechanism):
    """A pulley and a contact without elasticity: `J ω̇ = M_load − M`, `|M|` up to the static limit while it is held.

    Guards: motion, load below the upper limit, above the lower one, lever; then what can change with heat: locking and
    the fold of implicit coefficients.
    """

    law: AbstractTorqueLaw
    pairs: tuple[Pair, ...]
    sizes: Sizes

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """Ends of the run that heat can bring about; each has a guard, the last ones."""
        return (BrakeCode.FLASH_FOLD,) if self.law.implicit else ()

    def start(self, omega, elongation):
        return None, OPEN, Locking(self.law.locked.astype(jnp.int32) if self.law.locking_varies else None)

    def rests(self, mode):
        return mode.band == BandMode.HELD

    def _locked(self, mode: Mode) -> Bool[Array, ""]:
        return self.law.locked if mode.own.locks is None else mode.own.locks > 0

    def variables(self, acting, omega, own, mode):
        sliding, back, held = slips(mode.band), mode.band == BandMode.SLIP_BACK, mode.band == BandMode.HELD
        force, speed = acting.tension, self.law.radius * omega
        v = jnp.where(mode.sense > 0, speed, -speed)
        found = self.law.torques(force, v, acting.surfaces[0], back, ~sliding)
        pulling = pick(sliding, pick(back, -found.back, found.ahead), 0.0)
        torque = pick(held, acting.load, pulling)
        force = pick(mode.band == BandMode.OPEN, 0.0, force)
        return RigidNow(
            slack_tension=force,
            tight_tension=force + torque / self.law.radius,
            brake_torque=torque,
            alpha=pick(held, 0.0, (acting.load - pulling) / acting.inertia),
            slip_speed=pick(sliding, speed, 0.0),
            lever_power=jnp.zeros_like(force),
            torques=found,
        )

    def own_rates(self, z):
        return None

    def rubs(self, acting, mode, z):
        apart = self.pairs[0].apart
        return (self.law.rub(z.slack_tension, z.brake_torque, z.slip_speed, mode, z.torques, apart),)

    def guards(self, acting, omega, own, mode, z):
        band, size = mode.band, self.sizes
        held, is_open = band == BandMode.HELD, band == BandMode.OPEN
        motion = jnp.where(is_open | held, 1.0, jnp.where(mode.sense > 0, omega, -omega) / size.speed)
        bounded = held & ~self._locked(mode)
        high = jnp.where(bounded, (z.torques.ahead - acting.load) / size.torque, 1.0)
        low = jnp.where(bounded, (acting.load + z.torques.back) / size.torque, 1.0)
        lever = jnp.where(is_open, -acting.tension, acting.tension) / size.tension
        margin = z.torques.margin
        more = [] if margin is None else [jnp.where(mode.own.locks > 0, -margin, margin)]
        more += [jnp.where(slips(band), z.torques.slope, 1.0) for _ in self.codes]
        return jnp.stack([motion, high, low, lever, *more])

    def change(self, now, new, fired, ask):
        fired = jnp.unstack(fired)
        if new.own.locks is not None:
            new = new._replace(own=Locking((new.own.locks ^ fired[4].astype(jnp.int32)).astype(jnp.int32)))
        acting, rest = ask(new._replace(band=HELD), now.omega, now.own)
        locked, spare = self._locked(new), self.sizes.slight_torque
        beyond = jnp.where(acting.load < -rest.torques.back - spare, -1, 0)
        beyond = jnp.where(acting.load > rest.torques.ahead + spare, 1, beyond)
        found = onset(now, fired, acting, jnp.where(locked, 0, beyond), self.sizes)
        code = jnp.where(locked & found.pulls, int(BrakeCode.SINGULAR_GEOMETRY), 0)
        code = failed(self.codes, fired, 4 + (new.own.locks is not None), code)
        return settled_mode(now, new, found, rigid_mode(found.direction)), code

    def arrested(self, omega, own, before, after):
        return arrested(omega, before, after), own

    def stored(self, inertia, omega, own, mode):
        kinetic = 0.5 * inertia * omega**2
        return kinetic, jnp.zeros_like(kinetic)

    def own_sizes(self):
        return None

    @property
    def grip(self):
        return self.law.grip

    @property
    def banded(self):
        return self.law.banded

    @property
    def distribution(self):
        return self.law.distribution

    @property
    def couples_loads(self):
        return self.law.couples_loads

    def lining_margins(self, mode, z):
        return jnp.full(2 * self.pairs[0].count, -1.0) if self.law.banded else jnp.zeros(0)

    def shown(self, tension, omega, own, mode, surfaces, z):
        forces = self.law.linings(z.slack_tension, z.tight_tension, mode, z.torques)
        f = self.law.kinetic(tension, omega, surfaces[0], mode) if self.shows_friction else None
        return Shown((moving_as_one(forces, self.grip.cosine, mode, z, f),), forces.tension)

    @property
    def varies(self):
        return self.law.varies

    def gain(self, omega, surfaces):
        one = jnp.ones(())
        no = jnp.asarray(False)
        return self.law.torques(one, self.law.radius * omega, surfaces[0], no, no).ahead

    def capacity(self, tension, omega, own, surfaces):
        return self.law.capacity(tension, omega, surfaces[0])[None]
