"""From a scene with a band on the pulley to its system of equations, initial state and first mode."""

import jax.numpy as jnp

from .._parts._design import stiffness_of
from .._parts._scene import Scene
from ._brake import BrakeSystem, State
from ._elastic import ElasticBand
from ._frame import frame_of
from ._mechanism import Mode, Pair, Sizes
from ._modes import BandMode
from ._rigid import BandTorque, RigidContact
from ._state import Ledger
from ._wrap import Wrap


def assemble_band(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and mode of a scene whose band, rigid or elastic as a whole, acts on the pulley."""
    s, duty, brake = frame_of(scene), scene.duty, scene.brake
    linings, heat = brake.linings, None if scene.heat is None else scene.heat.friction
    pair = Pair(
        name="external",
        law=linings.friction,
        area=None if linings.area is None else jnp.asarray(linings.area),
        heat=heat,
        wear=None if scene.wear is None else scene.wear.rate,
        count=linings.count,
        apart=s.thermal is not None and s.thermal.tells_apart(heat),
    )
    law, n = linings.friction, (linings.count,)
    wrap = Wrap.of(
        s.band_radius, s.grip, jnp.broadcast_to(law.static(s.still), n), jnp.broadcast_to(law.kinetic(s.still), n)
    )
    sizes = Sizes(s.tension_scale, s.torque_scale, s.speed_scale)
    stiffness = stiffness_of(brake, s.still.T)
    mechanism = (
        RigidContact(law=BandTorque(wrap), pairs=(pair,), sizes=sizes)
        if stiffness is None
        else ElasticBand(wrap=wrap, stiffness=stiffness, pairs=(pair,), sizes=sizes)
    )
    system = BrakeSystem(
        mechanism=mechanism,
        inertia=s.inertia,
        track_radius=jnp.asarray(brake.pulley.radius),
        lever=duty.slack_tension,
        load=duty.load,
        thermal=s.thermal,
        wearing=s.wearing,
        angle=jnp.asarray(linings.angle),
    )
    zero = jnp.zeros_like(s.omega_0)
    own, own_mode = mechanism.start(s.omega_0, jnp.asarray(scene.initial.elongation) + zero)
    state = State(zero, s.omega_0, own, Ledger(zero, zero, zero, s.booked), s.u, s.worn)
    pieces = tuple(profile.first_piece(s.t_0) for profile in system.profiles)
    band = jnp.asarray(int(BandMode.OPEN), jnp.int32)
    sense = jnp.where(s.omega_0 < 0, -1, 1).astype(jnp.int32)
    return system, state, Mode(band, sense, own_mode, s.lever_piece, s.load_piece, pieces)
