"""From a scene with a band as a whole to its system of equations, initial state and first mode."""

import jax.numpy as jnp

from .._parts._band import product
from .._parts._design import stiffness_of
from .._parts._internal import InternalPair
from .._parts._scene import Scene
from ._forces import Forces
from ._frame import frame_of
from ._modes import BandMode, Mode
from ._state import Ledger, State
from ._system import BrakeSystem


def assemble_brake(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and mode of a standard or staged brake, its band one element (model §3, §4)."""
    s, duty = frame_of(scene), scene.duty
    law, friction = scene.brake.linings.friction, s.grip
    fixed = not (friction.reads.v or friction.varies or friction.implicit)
    mu_kinetic = friction.ratios(law.kinetic(s.still))[0] if fixed else None
    stiffness, internal, bandage = stiffness_of(scene.brake, s.still.T), None, scene.brake.bandage
    if bandage is not None:
        internal = InternalPair(bandage, jnp.asarray(scene.brake.pulley.radius), friction.sine)
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
    system = BrakeSystem(forces, s.tension_scale, s.torque_scale, s.speed_scale, s.wearing)
    zero = jnp.zeros_like(s.omega_0)
    x = None if stiffness is None else jnp.asarray(scene.initial.elongation) + zero
    ledger = Ledger(zero, zero, zero, s.booked, None if internal is None else zero)
    state = State(zero, s.omega_0, x, ledger, s.u, None if internal is None else s.omega_0, s.worn)
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
