"""From a scene whose band is in segments to the chain's system, initial state and first mode."""

import jax.numpy as jnp

from .._parts._design import stiffness_of
from .._parts._scene import Scene
from ._chain import STRETCHED, TAUT, ChainForces, ChainMode, ChainState
from ._chain_system import ChainSystem
from ._frame import frame_of
from ._modes import BandMode
from ._state import Ledger


def assemble_chain(scene: Scene) -> tuple[ChainSystem, ChainState, ChainMode]:
    """System, initial state and initial mode of a scene with `brake.band.segments` (model §3.1).

    All linings start on the pulley, `u̇_i = R_b ω_0`, `e_i = 0`, and all segments with the tension `C x_0`. The label
    of the band is `ELASTIC` while any lining sticks; a chain knows no `OPEN` and no `TAKE_UP`, as the lever pulls on
    the first lining from the start.
    """
    brake, s = scene.brake, frame_of(scene)
    segments, n = brake.band.segments, brake.linings.count
    assert segments is not None
    assert brake.linings.mass is not None
    mass = jnp.broadcast_to(jnp.asarray(brake.linings.mass), (n,))
    between = jnp.broadcast_to(jnp.asarray(segments.stiffness), (n - 1,))
    anchor = stiffness_of(brake, s.still.T)
    assert anchor is not None
    damping = 2 * jnp.asarray(segments.damping_ratio) * jnp.sqrt(between * 0.5 * (mass[1:] + mass[:-1]))
    forces = ChainForces(
        inertia=s.inertia,
        band_radius=s.band_radius,
        track_radius=jnp.asarray(brake.pulley.radius),
        mass=mass,
        stiffness=jnp.append(between, anchor),
        damping=jnp.append(damping, jnp.asarray(segments.anchor_damping)),
        preload=anchor * jnp.asarray(scene.initial.elongation),
        cosine=jnp.cos(jnp.asarray(brake.linings.angle) / 2),
        grip=s.grip,
        lever=scene.duty.slack_tension,
        load=scene.duty.load,
        thermal=s.thermal,
    )
    system = ChainSystem(forces, s.tension_scale, s.torque_scale, s.speed_scale, s.wearing)
    zero, still = jnp.zeros_like(s.omega_0), jnp.zeros(n)
    ledger = Ledger(zero, zero, zero, s.booked, damper_heat=zero)
    state = ChainState(zero, s.omega_0, still, still + s.band_radius * s.omega_0, ledger, s.u, s.worn)
    mode = ChainMode(
        band=jnp.where(s.omega_0 == 0, int(BandMode.HELD), int(BandMode.ELASTIC)).astype(jnp.int32),
        sense=jnp.where(s.omega_0 < 0, -1, 1).astype(jnp.int32),
        lever_piece=s.lever_piece,
        load_piece=s.load_piece,
        linings=jnp.zeros(n, jnp.int32),
        segments=jnp.full(n, TAUT | STRETCHED, jnp.int32),
        heat_pieces=tuple(profile.first_piece(s.t_0) for profile in system.profiles),
    )
    return system, state, mode
