"""From a scene with a band on the pulley to its system of equations, initial state and first mode."""

import jax.numpy as jnp

from .._parts._design import Bandage, Lining, stiffness_of
from .._parts._heat import FrictionHeat
from .._parts._internal import InternalPair
from .._parts._scene import Scene
from .._parts._wear import AbstractWearRate
from ._brake import BrakeSystem, State
from ._elastic import ElasticBand
from ._frame import frame_of
from ._mechanism import Mode, Pair, Sizes
from ._modes import BandMode
from ._rigid import BandTorque, RigidContact
from ._staged import StagedBrake
from ._state import Ledger
from ._wrap import Wrap


def assemble_band(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and mode of a scene whose band as a whole acts on the pulley, or on a rigid bandage."""
    s, duty, brake = frame_of(scene), scene.duty, scene.brake
    linings, bandage, heat, wear = brake.linings, brake.bandage, scene.heat, scene.wear
    n = linings.count

    def pair(name: str, part: Lining | Bandage, place: FrictionHeat | None, rate: AbstractWearRate | None) -> Pair:
        return Pair(
            name=name,
            law=part.friction,
            area=None if part.area is None else jnp.asarray(part.area),
            heat=place,
            wear=rate,
            count=n,
            on_band=bandage is not None and part is linings,
            apart=s.thermal is not None and s.thermal.tells_apart(place),
        )

    sizes = Sizes(s.tension_scale, s.torque_scale, s.speed_scale)
    stiffness = stiffness_of(brake, s.still.T)
    static, kinetic = (jnp.broadcast_to(f(s.still), (n,)) for f in (linings.friction.static, linings.friction.kinetic))
    wrap = Wrap.of(s.band_radius, s.grip, static, kinetic)
    rate = None if wear is None else wear.rate
    if bandage is not None:
        outer = pair("external", linings, None if heat is None else heat.external, rate)
        inner = pair(
            "internal", bandage, None if heat is None else heat.friction, None if wear is None else wear.internal
        )
        rim = InternalPair(bandage, jnp.asarray(brake.pulley.radius), s.grip.sine)
        mechanism = StagedBrake(wrap=wrap, stiffness=stiffness, internal=rim, pairs=(outer, inner), sizes=sizes)
    else:
        only = pair("external", linings, None if heat is None else heat.friction, rate)
        mechanism = (
            RigidContact(law=BandTorque(wrap), pairs=(only,), sizes=sizes)
            if stiffness is None
            else ElasticBand(wrap=wrap, stiffness=stiffness, pairs=(only,), sizes=sizes)
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
    state = State(
        zero, s.omega_0, own, Ledger(zero, zero, zero, s.booked, None if bandage is None else zero), s.u, s.worn
    )
    pieces = tuple(profile.first_piece(s.t_0) for profile in system.profiles)
    band = jnp.asarray(int(BandMode.OPEN), jnp.int32)
    sense = jnp.where(s.omega_0 < 0, -1, 1).astype(jnp.int32)
    return system, state, Mode(band, sense, own_mode, s.lever_piece, s.load_piece, pieces)
