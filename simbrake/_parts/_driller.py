"""Levers that a driller moves by the speed: held, or led along a given one."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._base._faults import Fault
from .._base._quantity import Scalar, holding, quantity
from .._hybrid._arrays import Array
from ._duty import AbstractProfile, Repeated


class AbstractSpeedLever(AbstractProfile):
    """A lever whose tension answers the speed on some of its pieces. For rigid bands, and laws without pressure and
    flash temperature: the torque is then known from the tension."""

    @abc.abstractmethod
    def follows(self, piece: Int[Array, ""]) -> Bool[Array, ""] | bool:
        """Whether the tension answers the speed on the piece."""

    @abc.abstractmethod
    def wanted_torque(
        self, t: Array, omega: Array, piece: Int[Array, ""], load: Array, inertia: Array
    ) -> Float[Array, ""]:
        """Brake torque (N·m) that the driller wants at a load torque and an inertia of the shaft."""

    @abc.abstractmethod
    def greatest(self) -> Float[Array, ""]:
        """Greatest slack tension (N)."""

    def holding(self, torque: Array, gain: Array) -> Float[Array, ""]:
        """`T_0` (N) for a brake torque, and the torque per newton of it (m)."""
        grips = gain > 0
        wanted = torque / jnp.where(grips, gain, 1.0)
        return jnp.where(grips, jnp.clip(wanted, 0.0, self.greatest()), self.greatest())


class SpeedHold(AbstractSpeedLever):
    """A lever that holds the speed: it pulls just so much that the brake torque equals the load torque (drag).

        T_0 = min(M_load/(R_b (Π − 1)), limit)

    - `limit` (N): greatest slack tension; where fade asks for more the load runs away (event `grip_lost`)

    The tension follows the friction of the hot linings, so that the power `M_load ω` goes into heat however it fades.
    For rigid bands, and laws without pressure and flash temperature.
    """

    limit: Scalar = quantity("N", "greatest slack tension", positive=True)

    def value(self, t, piece):
        return jnp.broadcast_to(jnp.asarray(self.limit, jnp.float64), np.shape(t))

    def follows(self, piece):
        return True

    def wanted_torque(self, t, omega, piece, load, inertia):
        return load

    def greatest(self):
        return jnp.asarray(self.limit)

    def next_knot(self, piece):
        return jnp.inf

    def first_piece(self, t):
        return 0

    def scale(self):
        return jnp.asarray(self.limit)

    def faults(self, path, low):
        return []


class Driller(AbstractSpeedLever):
    """A lever that is thrown on some pieces of time and leads the speed on others, cycle by cycle.

    On a piece that follows the speed the brake torque is that which keeps the pulley on the reference `ω_r(t)`, with a
    correction of what deviates:

        M_b = M_load − J [ω̇_r − g (ω − ω_r)],   T_0 = min(M_b/(R_b (Π − 1)), limit)

    - `tension`: `T_0(t)` of the other pieces, cycles of straight lines;  `speed`: `ω_r(t)` (rad/s), at the same points
    - `following`: for each point of a cycle, whether the piece that begins there follows the speed
    - `limit` (N): greatest slack tension; where fade asks for more the load runs away (event `grip_lost`)
    - `gain` `g` (1/s) of the correction

    `simbrake.programme_scene` makes one from a programme in words.
    """

    tension: Repeated = holding("N")
    speed: Repeated = holding("rad/s")  # pyright: ignore
    following: tuple[bool, ...] = eqx.field(static=True)  # pyright: ignore
    limit: Scalar = quantity("N", "greatest slack tension", positive=True)
    gain: Scalar = quantity("1/s", "correction of the speed", low=0.0, default=2.0)

    @property
    def knot_count(self) -> int:
        return self.tension.knot_count

    def follows(self, piece):
        k = len(self.following)
        inside = (piece > 0) & (piece < self.knot_count)
        # constants of the program are searched by a mask, as the points of a profile are
        here = jnp.arange(k, dtype=jnp.int32) == (jnp.asarray(piece, jnp.int32) - 1) % k
        return inside & jnp.any(here & np.asarray(self.following))

    def wanted_torque(self, t, omega, piece, load, inertia):
        reference = self.speed.value(t, piece)
        slope = self.speed.slope(piece)
        return load - inertia * (slope - self.gain * (omega - reference))

    def greatest(self):
        return jnp.asarray(self.limit)

    def value(self, t, piece):
        return self.tension.value(t, piece)

    def next_knot(self, piece):
        return self.tension.next_knot(piece)

    def first_piece(self, t):
        return self.tension.first_piece(t)

    def scale(self):
        return jnp.asarray(self.limit)

    def faults(self, path, low):
        found = self.tension.faults(f"{path}.tension", low) + self.speed.faults(f"{path}.speed", 0.0)
        points = np.size(self.tension.times)
        if len(self.following) != points:
            found.append(Fault(f"{path}.following", f"has {len(self.following)} entries", f"{points}, one per point"))
        same = [np.array_equal(getattr(self.tension, name), getattr(self.speed, name)) for name in _SHARED]
        if not all(same):
            found.append(Fault(f"{path}.speed", "has other points than the tension", f"equal: {', '.join(_SHARED)}"))
        return found


_SHARED = ("times", "period", "count", "begin")
