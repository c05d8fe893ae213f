"""The shaft beside the brake: its torques against the load, rest on dry friction, change of the rope's layer."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ..hybrid._arrays import Array
from ..profiles import AbstractProfile, Piece
from ..shaft import AbstractDryTorque, AbstractShaftTorque
from ._contact import contact_margin
from ._mechanism import HELD, OPEN, AbstractMechanism, Mode, Sliding


class ShaftNow(NamedTuple):
    """Torques at one instant (N·m, signed like the rotation) of each law, the part `left` of the load, and the `limit`
    of all dry ones together (`None` without any)."""

    each: tuple[Array, ...]
    left: Array
    limit: Any = None

    @property
    def total(self) -> Array:
        return sum(self.each[1:], start=self.each[0])


def rests(mode: Mode) -> Any:
    """Whether the pulley is at rest: held by the brake, or, with the band open, by dry friction of the shaft."""
    inner = getattr(mode.own, "inner", None)
    if isinstance(mode.band, Sliding):
        return np.False_
    still = (mode.band == HELD) if mode.turn is None else (mode.band == HELD) | ((mode.band == OPEN) & (mode.turn == 0))
    return still if inner is None else still & (inner == 0)


def borne_at_rest(load: Array, limit: Array) -> Array:
    """`clip(load, ±limit)`, with derivatives of one side also where `limit` is 0: without a load it stays 0."""
    return jnp.where(jnp.abs(load) < limit, load, jnp.sign(load) * limit)


class Shaft(eqx.Module):
    """Torques beside the brake.

    In motion dry friction `M_c` takes its part of the load, `M_load − M_c sign ω`; at rest the bearings come first and
    the brake bears the rest, `M_load − clip(M_load, ±M_c)`.
    """

    laws: tuple[AbstractShaftTorque, ...]

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        return tuple(law.profile for law in self.laws)

    @property
    def places(self) -> tuple[str, ...]:
        """Places of the thermal network that their heat enters."""
        return tuple(law.place for law in self.laws if law.place is not None)

    @property
    def dry(self) -> bool:
        """Whether the shaft can stick."""
        return any(isinstance(law, AbstractDryTorque) for law in self.laws)

    def _torques(self, t: Array, omega: Array, load: Array, pieces: tuple[Piece, ...]) -> list[tuple[bool, Array]]:
        given = zip(self.laws, pieces, strict=True)
        return [
            (isinstance(law, AbstractDryTorque), jnp.asarray(law.torque(t, omega, piece, load))) for law, piece in given
        ]

    def now(
        self, t: Array, omega: Array, loads: tuple[Array, Array], mode: Mode, pieces: tuple[Piece, ...]
    ) -> ShaftNow:
        """The torques in a mode; `loads` (N·m): torques of the load at the speed `omega`, and on a shaft at rest."""
        load, found = loads[1], self._torques(t, omega, loads[1], pieces)
        if not self.dry:
            each = tuple(torque for _, torque in found)
            return ShaftNow(each, loads[0] - sum(each[1:], start=each[0]))
        limit = jnp.asarray(sum(torque for dry, torque in found if dry))
        sense, inner = mode.sense, getattr(mode.own, "inner", None)
        if not isinstance(mode.band, Sliding):
            sense = jnp.where(mode.band == OPEN, mode.turn, sense)
        if inner is not None:  # the sense of a staged brake is that of its bandage
            sense = jnp.where(inner == 0, sense, jnp.where(mode.turn == 0, inner, mode.turn))
        # with the band open the load is within the limit as long as the mode lasts
        borne, still = jnp.where(mode.band == HELD, borne_at_rest(load, limit), load), rests(mode)
        share = borne / jnp.where(limit > 0, limit, 1.0)
        share = jnp.where(still, share, sense.astype(share.dtype))
        each = tuple(share * torque if dry else torque for dry, torque in found)
        left = loads[0] - sum(each[1:], start=each[0])
        return ShaftNow(each, jnp.where(still, load - borne, left), limit)

    def turning(self, t: Array, omega: Array, load: Array, sense: Array, pieces: tuple[Piece, ...]) -> Array:
        """Sum of the torques (N·m) of a shaft that turns in the `sense` ±1."""
        found = self._torques(t, omega, load, pieces)
        return sum((sense * torque if dry else torque for dry, torque in found), start=jnp.zeros(()))

    def powers(self, now: ShaftNow | None, omega: Array) -> list[tuple[str | None, Array]]:
        """Place and power (W) of the heat of each law."""
        assert now is not None
        return [(law.place, torque * omega) for law, torque in zip(self.laws, now.each, strict=True)]

    def heating(self, now: ShaftNow | None, omega: Array) -> tuple[tuple[str, Array], ...]:
        """The same of those whose heat enters a body."""
        return tuple((place, power) for place, power in self.powers(now, omega) if place is not None)

    def margin(self, mode: Mode, omega: Array, load: Array, now: ShaftNow, torque: Array, speed: Array) -> Array:
        """Guard of dry friction: of a turning shaft until it comes to rest, of a resting one until the load exceeds it.

        Where the mechanism itself watches the speed of the pulley, or holds it, the margin is 1.
        """
        inner, is_open = getattr(mode.own, "inner", None), mode.band == OPEN
        watched = is_open if inner is None else is_open | (inner != 0)
        watched = (watched & (mode.turn != 0)) | (rests(mode) & is_open)
        left = (now.limit - jnp.abs(load)) / torque
        return jnp.where(watched, contact_margin(mode.turn, left, omega / speed), 1.0)

    def turn_after(
        self, before: Mode, after: Mode, load: Array, now: ShaftNow, fired: Array, slack: Array
    ) -> Int[Array, ""]:
        """Sense in which the pulley turns after an event, 0 at rest; `fired`: whether the guard of dry friction did."""
        inner, resting, way = getattr(after.own, "inner", None), before.turn == 0, jnp.sign(load).astype(jnp.int32)
        settled = jnp.where(jnp.abs(load) <= now.limit + slack, 0, way)
        free = jnp.where(resting & fired, way, jnp.where(resting | fired, settled, before.turn))
        turn = jnp.where(after.band == OPEN, free, jnp.where(after.band == HELD, 0, after.sense))
        if inner is not None:
            loose = jnp.where(resting, inner, jnp.where(fired, -before.turn, before.turn))
            turn = jnp.where(inner == 0, turn, loose)
        return turn.astype(jnp.int32)


def speed_on_layer(
    mechanism: AbstractMechanism, y: Any, before: Mode, after: Mode, inertias: tuple[Array, Array]
) -> Array:
    """Speed of the pulley (rad/s) on another layer of the rope, with the kinetic energy that was there before.

    Bodies that stick to the pulley follow it.

    - `y`: state, `inertias` (kg·m²) of the shaft before and after
    """

    def kinetic(omega: Array) -> Array:
        speed, own = mechanism.with_stuck_speeds(omega, y.own, before, after)
        return mechanism.stored(inertias[1], speed, own, after)[0]

    there, others = mechanism.stored(inertias[0], y.omega, y.own, before)[0], kinetic(0.0 * y.omega)
    whole = kinetic(y.omega) - others
    return y.omega * jnp.sqrt(jnp.where(whole > 0, (there - others) / jnp.where(whole > 0, whole, 1.0), 1.0))
