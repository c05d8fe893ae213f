"""From a scene to its system of equations, initial state and first mode."""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ._band import grip, product, tension_ratio
from ._design import stiffness_of
from ._forces import Forces
from ._friction import Contact
from ._internal import InternalPair
from ._modes import BandMode, Mode
from ._scene import Scene
from ._sliding import Grip
from ._state import HeatLedger, Ledger, State
from ._system import BrakeSystem
from ._thermal import Thermal, assemble_thermal


def _hot_at_start(scene: Scene, thermal: Thermal | None, u: Array | None) -> Array | None:
    """Temperatures that the linings' friction law sees at the start."""
    heat = scene.heat
    pair = None if heat is None else heat.friction if scene.brake.bandage is None else heat.external
    if thermal is None or u is None or pair is None or pair.sensor is None:
        return None
    return thermal.at(thermal.temperatures(u), pair.sensor, scene.brake.linings.count)


def reference_sizes(scene: Scene, J: Array, ratio: Array) -> tuple[Array, Array, Array]:
    """References of tensions (N), torques (N·m) and speeds (rad/s) of a scene with inertia `J` and the ratio `Π`."""
    duty, t_0, omega_0 = scene.duty, jnp.asarray(scene.initial.time), jnp.asarray(scene.initial.omega)

    def positive(x: Array) -> Array:
        return jax.lax.stop_gradient(jnp.where(x > 0, x, 1.0))

    tension_scale = positive(duty.slack_tension.scale())
    capacity = jnp.asarray(scene.brake.band.radius) * tension_scale * (ratio - 1)
    first = jnp.asarray(duty.load.profile.first_piece(t_0), jnp.int32)
    load_0 = jnp.abs(duty.load.torque(t_0, omega_0, first))
    torque_scale = positive(jnp.maximum(capacity, jnp.maximum(load_0, duty.load.profile.scale())))
    # from rest: the speed that the largest torque could give in the run, 1 rad/s at most
    reach = jnp.minimum(torque_scale / J * (jnp.asarray(scene.end_time) - t_0), 1.0)
    return tension_scale, torque_scale, positive(jnp.where(omega_0 == 0, reach, jnp.abs(omega_0)))


def assemble(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and initial mode of a scene. The run settles the true first mode itself, as an event."""
    brake, duty, initial, heat = scene.brake, scene.duty, scene.initial, scene.heat
    linings = brake.linings
    if brake.bandage is not None and brake.bandage.spring is not None:
        raise ValueError("a bandage with springs is another system: assemble_bandage")
    angle = jnp.asarray(linings.angle)
    law, friction = linings.friction, Grip(linings, None if heat is None else heat.flash)
    thermal, u = (None, None) if heat is None else assemble_thermal(heat)
    hot = _hot_at_start(scene, thermal, u)
    still = Contact(v=jnp.zeros(angle.shape), T=hot, p=jnp.zeros(angle.shape))
    mu_static, locks = tension_ratio(grip(law.static(still), angle))
    fixed = not (law.speed_dependent or friction.varies or friction.implicit)
    mu_kinetic = tension_ratio(grip(law.kinetic(still), angle))[0] if fixed else None
    ratio_static = product(mu_static)
    R_b = jnp.asarray(brake.band.radius)
    J = jnp.asarray(brake.pulley.inertia) + duty.load.inertia()
    t_0, omega_0 = jnp.asarray(initial.time), jnp.asarray(initial.omega)
    lever_piece, load_piece = duty.slack_tension.first_piece(t_0), duty.load.profile.first_piece(t_0)

    tension_scale, torque_scale, speed_scale = reference_sizes(scene, J, ratio_static)
    stiffness = stiffness_of(brake, hot)
    internal = None
    if brake.bandage is not None:
        internal = InternalPair(brake.bandage, jnp.asarray(brake.pulley.radius), angle)
    forces = Forces(
        inertia=J,
        band_radius=R_b,
        track_radius=jnp.asarray(brake.pulley.radius),
        stiffness=stiffness,
        grip=friction,
        lever=duty.slack_tension,
        load=duty.load,
        mu_static=None if friction.varies else mu_static,
        locked=jnp.any(locks),
        mu_kinetic=mu_kinetic,
        ratio_static=None if friction.varies else ratio_static,
        ratio_kinetic=None if mu_kinetic is None else product(mu_kinetic),
        thermal=thermal,
        internal=internal,
    )
    system = BrakeSystem(forces, tension_scale, torque_scale, speed_scale)
    zero = jnp.zeros_like(omega_0)
    x = None if stiffness is None else jnp.asarray(initial.elongation) + zero
    staged = None if internal is None else zero
    booked = None if heat is None else HeatLedger(zero, zero, zero, zero, staged)
    ledger = Ledger(zero, zero, zero, booked, staged)
    state = State(zero, omega_0, x, ledger, u, None if internal is None else omega_0)
    mode = Mode(
        jnp.asarray(int(BandMode.OPEN), jnp.int32),
        jnp.where(omega_0 < 0, -1, 1),
        lever_piece,
        load_piece,
        jnp.any(locks).astype(jnp.int32) if friction.varies else None,
        tuple(profile.first_piece(t_0) for profile in system.profiles),
        *((None, None) if internal is None else (jnp.asarray(0, jnp.int32), jnp.asarray(0, jnp.int32))),
    )
    return system, state, mode
