"""From a scene whose bandage has springs to its system of equations, initial state and first mode."""

import jax.numpy as jnp

from .._parts._scene import Scene
from ._bandage import BandageSystem
from ._bandage_forces import BandageForces
from ._bandage_state import BandageMode, BandageState
from ._frame import frame_of
from ._modes import BandMode
from ._state import Ledger


def assemble_bandage(scene: Scene) -> tuple[BandageSystem, BandageState, BandageMode]:
    """System, initial state and mode of a scene whose bandage has springs (`simbrake.check` it first).

    The linings start on the pulley, `ω_i(0) = ω_0`, with springs that are not stretched. The run settles the true
    first mode itself, as an event.
    """
    brake, duty, s = scene.brake, scene.duty, frame_of(scene)
    bandage, linings = brake.bandage, brake.linings
    if bandage is None or bandage.spring is None:
        raise ValueError("only a bandage with springs is resolved")
    n, R_b = linings.count, jnp.asarray(brake.band.radius)
    inertias = jnp.asarray(bandage.inertia)
    inertias = jnp.broadcast_to(inertias / n, (n,)) if inertias.ndim == 0 else inertias
    stiffness = jnp.broadcast_to(jnp.asarray(bandage.spring), (n - 1,))
    reduced = inertias[:-1] * inertias[1:] / ((inertias[:-1] + inertias[1:]) * R_b**2)
    forces = BandageForces(
        inertia=s.inertia,
        inertias=inertias,
        band_radius=R_b,
        track_radius=jnp.asarray(brake.pulley.radius),
        grip=s.grip,
        internal=bandage,
        stiffness=stiffness,
        damping=2 * jnp.asarray(bandage.spring_damping) * jnp.sqrt(stiffness * reduced),
        lever=duty.slack_tension,
        load=duty.load,
        thermal=s.thermal,
    )
    zero = jnp.zeros_like(s.omega_0)
    ledger = Ledger(zero, zero, zero, s.booked, zero, zero)
    speeds = jnp.broadcast_to(s.omega_0, (n,))
    state = BandageState(zero, s.omega_0, jnp.zeros(n - 1), speeds, ledger, s.u, s.worn)
    sense = jnp.where(s.omega_0 < 0, -1, 1).astype(jnp.int32)
    mode = BandageMode(
        band=jnp.asarray(int(BandMode.OPEN), jnp.int32),
        sense=sense,
        lever_piece=s.lever_piece,
        load_piece=s.load_piece,
        outer=jnp.broadcast_to(sense, (n,)),
        inner=jnp.zeros(n, jnp.int32),
    )
    system = BandageSystem(forces, s.tension_scale, s.torque_scale, s.speed_scale, s.wearing)
    pieces = tuple(profile.first_piece(s.t_0) for profile in system.profiles)
    return system, state, mode._replace(heat_pieces=pieces)
