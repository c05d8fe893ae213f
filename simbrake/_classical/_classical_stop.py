"""The classical estimate of a stop: all linings slide from the first moment, under a constant lever tension."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._parts._scene import Scene, band_brake, sensed_at_start
from ..brakes._design import unloaded
from ..loads import AbstractSpeedLever


class ClassicalStop(NamedTuple):
    """A stop of a rigid band that slides throughout, with constant torques (SI units)."""

    ratio: float  # Π, tight over slack tension
    torque: float  # M_b, N·m
    time: float  # s
    angle: float  # rad
    work: float  # friction work, J
    power: float  # friction power at first, W


def friction_at_start(scene: Scene) -> np.ndarray:
    """Sliding coefficient (n,) at the initial speed and temperatures, without pressure."""
    n, linings = scene.brake.linings.count, scene.brake.linings
    v = abs(float(band_brake(scene).band.radius) * float(scene.initial.omega))
    contact = unloaded(linings, jnp.full(n, v), sensed_at_start(scene))
    return np.broadcast_to(np.asarray(linings.friction.kinetic(contact)), (n,))


def load_and_inertia(scene: Scene) -> tuple[float, float]:
    """Load torque (N·m) at the start at half the speed, and inertia (kg·m²) of the pulley with all that it moves."""
    load = scene.duty.load
    start = jnp.asarray(float(scene.initial.time))
    piece: Any = jnp.asarray(load.profile.first_piece(start), jnp.int32)
    more = load.added_inertia(piece)
    inertia = float(scene.brake.inertia) + float(load.inertia()) + (0.0 if more is None else float(more))
    return float(load.torque(start, jnp.asarray(float(scene.initial.omega) / 2), piece)), inertia


def classical_stop(scene: Scene) -> ClassicalStop | None:
    """The stop of a standard brake by statics alone; `None` where there is none.

        Π = ∏ (1 + f_i z_i)/(1 − f_i z_i),   M_b = R_b T_0 (Π − 1)                                  (Z-12…14)
        ω̇ = −(M_b − M_load)/J,   t = ω_0/|ω̇|,   φ = ω_0 t/2,   W = M_b φ                           (Z-17, 18)

    `T_0` is the greatest tension that the lever gives, load torque and inertia are those of the start (the torque at
    half the speed). There is none without speed at the start, with a lever that holds the speed, where a lining locks
    itself, or where the load outweighs the brake.
    """
    brake, lever, omega = band_brake(scene), scene.duty.lever, float(scene.initial.omega)
    f = friction_at_start(scene)
    if omega <= 0 or isinstance(lever, AbstractSpeedLever):
        return None
    angle = np.asarray(brake.linings.angle)
    if np.any(f * np.tan(angle / 2) >= 1):  # a lining locks itself
        return None
    load, inertia = load_and_inertia(scene)
    fz = f * np.tan(angle / 2)
    ratio = float(np.prod((1 + fz) / (1 - fz)))
    torque = float(brake.band.radius) * float(lever.scale()) * (ratio - 1)
    if torque <= load:
        return None
    time = inertia * omega / (torque - load)
    return ClassicalStop(ratio, torque, time, omega * time / 2, torque * omega * time / 2, torque * omega)
