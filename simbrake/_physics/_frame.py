"""What every kind of brake takes from a scene: inertia, start, heat, friction at rest, and typical sizes."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from .._hybrid._arrays import Array
from .._parts._band import grip, product, tension_ratio
from .._parts._design import unloaded
from .._parts._friction import Contact
from .._parts._scene import Scene
from .._parts._worn import walls_left
from ._sliding import Grip
from ._state import HeatLedger
from ._thermal import Thermal, assemble_thermal
from ._wearing import Wearing, Worn, assemble_wear


class Frame(NamedTuple):
    """What a scene says of any kind of brake: inertia, start, heat, friction at rest, and typical sizes."""

    inertia: Array
    band_radius: Array
    t_0: Array
    omega_0: Array
    lever_piece: Any
    load_piece: Any
    grip: Grip
    still: Contact  # of the linings at the start
    thermal: Thermal | None
    u: Any  # heat content of the nodes
    booked: HeatLedger | None
    mu_static: Float[Array, " n"]
    locks: Bool[Array, " n"]
    tension_scale: Array
    torque_scale: Array
    speed_scale: Array
    wearing: Wearing | None
    worn: Worn | None  # at the start


def frame_of(scene: Scene) -> Frame:
    """What all kinds of brake take from a scene."""
    brake, duty, initial, heat = scene.brake, scene.duty, scene.initial, scene.heat
    angle = jnp.asarray(brake.linings.angle)
    thermal = u = None
    if heat is not None:
        thermal, u = assemble_thermal(heat, walls_left(scene), scene.power_shares)
    pair = None if heat is None else heat.friction if brake.bandage is None else heat.external
    hot = None
    if thermal is not None and u is not None and pair is not None and pair.sensor is not None:
        hot = thermal.at(thermal.temperatures(u), pair.sensor, brake.linings.count)
    still = unloaded(brake.linings, jnp.zeros(angle.shape), hot)
    mu_static, locks = tension_ratio(grip(brake.linings.friction.static(still), angle))
    R_b = jnp.asarray(brake.band.radius)
    J = jnp.asarray(brake.pulley.inertia) + duty.load.inertia()
    t_0, omega_0 = jnp.asarray(initial.time), jnp.asarray(initial.omega)
    lever_piece, load_piece = duty.slack_tension.first_piece(t_0), duty.load.profile.first_piece(t_0)

    def positive(x: Array) -> Array:
        return jax.lax.stop_gradient(jnp.where(x > 0, x, 1.0))

    tension_scale = positive(duty.slack_tension.scale())
    capacity = R_b * tension_scale * (product(mu_static) - 1)
    load_0 = jnp.abs(duty.load.torque(t_0, omega_0, jnp.asarray(load_piece, jnp.int32)))
    torque_scale = positive(jnp.maximum(capacity, jnp.maximum(load_0, duty.load.profile.scale())))
    # from rest: the speed that the largest torque could give in the run, 1 rad/s at most
    reach = jnp.minimum(torque_scale / J * (jnp.asarray(scene.end_time) - t_0), 1.0)
    speed_scale = positive(jnp.where(omega_0 == 0, reach, jnp.abs(omega_0)))
    zero = jnp.zeros_like(omega_0)
    wearing = assemble_wear(scene.wear, brake, 0.5 * J * speed_scale**2 + torque_scale)
    return Frame(
        inertia=J,
        band_radius=R_b,
        t_0=t_0,
        omega_0=omega_0,
        lever_piece=lever_piece,
        load_piece=load_piece,
        grip=Grip.of(brake.linings, None if heat is None else heat.flash, scene.power_shares, heated=hot is not None),
        still=still,
        thermal=thermal,
        u=u,
        booked=None if heat is None else HeatLedger(zero, zero, zero, zero, None if brake.bandage is None else zero),
        mu_static=mu_static,
        locks=locks,
        tension_scale=tension_scale,
        torque_scale=torque_scale,
        speed_scale=speed_scale,
        wearing=wearing,
        worn=None if wearing is None else wearing.start,
    )
