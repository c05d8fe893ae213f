"""Several rigid bands under one lever: each as it would be alone, under its share of the tension."""

import dataclasses
import functools
from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Bool, Float

from ..brakes._band import LiningForces
from ..brakes._bands import JoinedFriction
from ..friction import SurfaceState
from ..hybrid._arrays import Array
from ._mechanism import BrakeCode, Mode, Pair, Rub, Shown, Sizes, Surfaces
from ._rigid import AbstractRigidContact, RigidBand, RigidNow, Torques, sense_of
from ._sliding import Grip


def _total(parts: Iterable[Array]) -> Array:
    return functools.reduce(jnp.add, parts)


class RigidBands(AbstractRigidContact):
    """Rigid bands on one shaft, which slide and stick together: `M = Σ_j R_b s_j T_0 (Π_j − 1)`.

    - `bands`, each with its own linings;  `shares` `s_j` of the lever's tension
    - `grip`: friction of the linings of all bands, one band after the other
    """

    bands: tuple[RigidBand, ...]
    shares: Float[Array, " k"]
    grip: Grip
    pairs: tuple[Pair, ...]
    sizes: Sizes
    distribution: ClassVar[str] = (
        "bands that stick share the torque as the maximum torque of each; in each the mobilisation rule: one lining "
        "after the other at its limit, from the slack end (reversed: from the anchor)"
    )

    @property
    def law(self) -> JoinedFriction:
        """The friction law of all linings."""
        return self.grip.linings.friction  # pyright: ignore

    @property
    def radius(self) -> Float[Array, ""]:
        return self.bands[0].radius

    @property
    def locked(self) -> Bool[Array, ""]:
        return functools.reduce(jnp.logical_or, [band.locked for band in self.bands])

    @property
    def locking_varies(self) -> bool:
        return any(band.locking_varies for band in self.bands)

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        return next((band.codes for band in self.bands if band.codes), ())

    def _each(
        self, force: Array, surface: SurfaceState | None
    ) -> list[tuple[RigidBand, Float[Array, ""], SurfaceState | None]]:
        """The bands with their slack tensions, and the surfaces of their linings."""
        tensions, law = jnp.unstack(self.shares * force), self.law
        return [(band, tensions[j], law.surface(surface, j)) for j, band in enumerate(self.bands)]

    def torques(self, force: Array, v: Array, surface: SurfaceState | None, back: Array, static: Array) -> Torques:
        found = tuple(band.torques(T_0, v, own, back, static) for band, T_0, own in self._each(force, surface))
        margins = [one.margin for one in found if one.margin is not None]
        return Torques(
            ahead=_total(one.ahead for one in found),
            back=_total(one.back for one in found),
            slope=functools.reduce(jnp.minimum, [one.slope for one in found]),
            margin=functools.reduce(jnp.minimum, margins) if margins else None,
            law=found,
        )

    def _alone(self, z: RigidNow) -> list[tuple[RigidBand, RigidNow]]:
        """The bands with the variables that each has; where they stick they share the torque as its maximum."""
        most, backwards = z.torques, z.brake_torque < 0
        whole = jnp.where(backwards, most.back, most.ahead)
        share = z.brake_torque / jnp.where(whole > 0, whole, 1.0)
        found = []
        for (band, T_0, _), own in zip(self._each(z.slack_tension, None), most.law, strict=True):
            torque = share * jnp.where(backwards, own.back, own.ahead)
            tight = T_0 + torque / self.radius
            alone = dataclasses.replace(z, slack_tension=T_0, tight_tension=tight, brake_torque=torque, torques=own)
            found.append((band, alone))
        return found

    def linings(self, mode: Mode, z: RigidNow) -> LiningForces:
        each = [band.linings(mode, own) for band, own in self._alone(z)]
        return LiningForces(*(jnp.concatenate(parts) for parts in zip(*each, strict=True)))

    def lining_margins(self, mode: Mode, z: RigidNow) -> Float[Array, " twice_n"]:
        return jnp.full(2 * self.pairs[0].count, -1.0)

    def kinetic(self, force: Array, omega: Array, surface: SurfaceState | None, mode: Mode) -> Float[Array, " n"]:
        return jnp.concatenate([band.kinetic(T_0, omega, own, mode) for band, T_0, own in self._each(force, surface)])

    def rubs(self, mode: Mode, z: RigidNow) -> tuple[Rub, ...]:
        each = [band.rubs(mode, own)[0] for band, own in self._alone(z)]
        apart = self.pairs[0].apart
        force = jnp.concatenate([rub.force for rub in each]) if apart else z.brake_torque / self.radius
        return (Rub(force, z.slip_speed, sense_of(mode), jnp.concatenate([rub.normal for rub in each])),)

    def capacity(
        self, tension: Array, omega: Array, own: None, surfaces: Surfaces, *, static: bool = False
    ) -> Float[Array, " pairs"]:
        each = self._each(tension, surfaces[0])
        return _total(band.capacity(T_0, omega, own, (here,), static=static) for band, T_0, here in each)

    def shown(self, tension: Array, omega: Array, own: None, mode: Mode, surfaces: Surfaces, z: RigidNow) -> Shown:
        shown, spans = super().shown(tension, omega, own, mode, surfaces, z), self.law.spans
        slack = jnp.unstack(self.shares * z.slack_tension)
        parts = [(T_0[None], shown.tension[first : last - 1]) for T_0, (first, last) in zip(slack, spans, strict=True)]
        return shown._replace(before=jnp.concatenate([one for part in parts for one in part]))
