"""From a scene to its system of equations, initial state and first mode."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ._band import grip, product, tension_ratio
from ._design import stiffness_of
from ._forces import Forces
from ._friction import Contact
from ._internal import InternalPair
from ._modes import BandMode, Mode
from ._quantity import Fault, InputError
from ._scene import Scene
from ._sliding import Grip
from ._state import HeatLedger, Ledger, State
from ._system import BrakeSystem
from ._thermal import Thermal, assemble_thermal


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


def frame_of(scene: Scene) -> Frame:
    """What all kinds of brake take from a scene."""
    brake, duty, initial, heat = scene.brake, scene.duty, scene.initial, scene.heat
    angle = jnp.asarray(brake.linings.angle)
    thermal, u = (None, None) if heat is None else assemble_thermal(heat)
    pair = None if heat is None else heat.friction if brake.bandage is None else heat.external
    hot = None
    if thermal is not None and u is not None and pair is not None and pair.sensor is not None:
        hot = thermal.at(thermal.temperatures(u), pair.sensor, brake.linings.count)
    still = Contact(v=jnp.zeros(angle.shape), T=hot, p=jnp.zeros(angle.shape))
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
    return Frame(
        inertia=J,
        band_radius=R_b,
        t_0=t_0,
        omega_0=omega_0,
        lever_piece=lever_piece,
        load_piece=load_piece,
        grip=Grip(brake.linings, None if heat is None else heat.flash),
        still=still,
        thermal=thermal,
        u=u,
        booked=None if heat is None else HeatLedger(zero, zero, zero, zero, None if brake.bandage is None else zero),
        mu_static=mu_static,
        locks=locks,
        tension_scale=tension_scale,
        torque_scale=torque_scale,
        speed_scale=speed_scale,
    )


def assemble(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and initial mode of a scene. The run settles the true first mode itself, as an event."""
    if scene.brake.band.segments is not None:
        hint = "it is the resolved chain, another system (`assemble_chain`); `simulate` takes the band as a whole"
        raise InputError([Fault("brake.band.segments", "is not for this system", hint)])
    s, duty = frame_of(scene), scene.duty
    law, friction, angle = scene.brake.linings.friction, s.grip, jnp.asarray(scene.brake.linings.angle)
    fixed = not (law.speed_dependent or friction.varies or friction.implicit)
    mu_kinetic = tension_ratio(grip(law.kinetic(s.still), angle))[0] if fixed else None
    stiffness, internal, bandage = stiffness_of(scene.brake, s.still.T), None, scene.brake.bandage
    if bandage is not None:
        internal = InternalPair(bandage, jnp.asarray(scene.brake.pulley.radius), angle)
    forces = Forces(
        inertia=s.inertia,
        band_radius=s.band_radius,
        track_radius=jnp.asarray(scene.brake.pulley.radius),
        stiffness=stiffness,
        grip=friction,
        lever=duty.slack_tension,
        load=duty.load,
        mu_static=None if friction.varies else s.mu_static,
        locked=jnp.any(s.locks),
        mu_kinetic=mu_kinetic,
        ratio_static=None if friction.varies else product(s.mu_static),
        ratio_kinetic=None if mu_kinetic is None else product(mu_kinetic),
        thermal=s.thermal,
        internal=internal,
    )
    system = BrakeSystem(forces, s.tension_scale, s.torque_scale, s.speed_scale)
    zero = jnp.zeros_like(s.omega_0)
    x = None if stiffness is None else jnp.asarray(scene.initial.elongation) + zero
    ledger = Ledger(zero, zero, zero, s.booked, None if internal is None else zero)
    state = State(zero, s.omega_0, x, ledger, s.u, None if internal is None else s.omega_0)
    mode = Mode(
        jnp.asarray(int(BandMode.OPEN), jnp.int32),
        jnp.where(s.omega_0 < 0, -1, 1),
        s.lever_piece,
        s.load_piece,
        jnp.any(s.locks).astype(jnp.int32) if friction.varies else None,
        tuple(profile.first_piece(s.t_0) for profile in system.profiles),
        *((None, None) if internal is None else (jnp.asarray(0, jnp.int32), jnp.asarray(0, jnp.int32))),
    )
    return system, state, mode
