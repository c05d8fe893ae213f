"""From a scene whose bandage has springs to its system of equations, initial state and first mode."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from ._assemble import reference_sizes
from ._band import product
from ._bandage import BandageSystem
from ._bandage_forces import BandageForces
from ._bandage_state import BandageLedger, BandageMode, BandageState
from ._hybrid import Record
from ._modes import BandMode
from ._scene import Scene
from ._state import HeatLedger
from ._thermal import assemble_thermal


def assemble_bandage(scene: Scene) -> tuple[BandageSystem, BandageState, BandageMode]:
    """System, initial state and mode of a scene whose bandage has springs (`simbrake.check` it first).

    The linings start on the pulley, `ω_i(0) = ω_0`, with springs that are not stretched. The run settles the true
    first mode itself, as an event.
    """
    brake, duty, heat = scene.brake, scene.duty, scene.heat
    bandage, linings = brake.bandage, brake.linings
    if bandage is None or bandage.spring is None:
        raise ValueError("only a bandage with springs is resolved")
    n, angle, R_b = linings.count, jnp.asarray(linings.angle), jnp.asarray(brake.band.radius)
    inertias = jnp.asarray(bandage.inertia)
    inertias = jnp.broadcast_to(inertias / n, (n,)) if inertias.ndim == 0 else inertias
    stiffness = jnp.broadcast_to(jnp.asarray(bandage.spring), (n - 1,))
    reduced = inertias[:-1] * inertias[1:] / ((inertias[:-1] + inertias[1:]) * R_b**2)
    thermal, u = (None, None) if heat is None else assemble_thermal(heat)
    forces = BandageForces(
        inertia=jnp.asarray(brake.pulley.inertia) + duty.load.inertia(),
        inertias=inertias,
        band_radius=R_b,
        track_radius=jnp.asarray(brake.pulley.radius),
        tangent=jnp.tan(angle / 2),
        sine=jnp.sin(angle / 2),
        linings=linings,
        internal=bandage,
        stiffness=stiffness,
        damping=2 * jnp.asarray(bandage.spring_damping) * jnp.sqrt(stiffness * reduced),
        lever=duty.slack_tension,
        load=duty.load,
        thermal=thermal,
    )
    t_0, omega_0 = jnp.asarray(scene.initial.time), jnp.asarray(scene.initial.omega)
    zero = jnp.zeros_like(omega_0)
    booked = None if heat is None else HeatLedger(zero, zero, zero, zero, zero)
    ledger = BandageLedger(zero, zero, zero, zero, zero, booked)
    speeds = jnp.broadcast_to(omega_0, (n,))
    state = BandageState(zero, omega_0, jnp.zeros(n - 1), speeds, ledger, u)
    sense = jnp.where(omega_0 < 0, -1, 1).astype(jnp.int32)
    mode = BandageMode(
        band=jnp.asarray(int(BandMode.OPEN), jnp.int32),
        sense=sense,
        lever_piece=duty.slack_tension.first_piece(t_0),
        load_piece=duty.load.profile.first_piece(t_0),
        outer=jnp.broadcast_to(sense, (n,)),
        inner=jnp.zeros(n, jnp.int32),
    )
    still = forces.coefficients(state, mode)
    system = BandageSystem(forces, *reference_sizes(scene, forces.inertia, product(still.mu_static)))
    pieces = tuple(profile.first_piece(t_0) for profile in system.profiles)
    return system, state, mode._replace(heat_pieces=pieces)


def bandage_energies(record: Record) -> dict[str, Array]:
    """Energies of a run with a resolved bandage in J, and the closure of their balance (model §8).

    `kinetic_change + elastic_change = load_work − friction heat of both pairs − damper heat`
    """
    system: BandageSystem = record.system  # pyright: ignore
    modes: list[Any] = [record.flat.unpack_mode(record.rows.mode[i]) for i in (0, record.count)]
    start, end = record.flat.unpack_state(record.rows.y[0]), record.y_end
    before, after = system.stored(start, modes[0]), system.stored(end, modes[1])
    ledger = end.ledger
    kinetic, elastic = after[0] - before[0], after[1] - before[1]
    heat = ledger.friction_heat + ledger.internal_heat + ledger.damper_heat
    residual = kinetic + elastic - ledger.load_work - ledger.lever_work + heat
    exchanged = jnp.max(jnp.stack([jnp.abs(x) for x in (kinetic, elastic, ledger.load_work, heat)]))
    return {
        "load_work": ledger.load_work,
        "lever_work": ledger.lever_work,
        "heat_external": ledger.friction_heat,
        "heat_internal": ledger.internal_heat,
        "heat_dampers": ledger.damper_heat,
        "friction_heat": ledger.friction_heat + ledger.internal_heat,
        "kinetic_change": kinetic,
        "elastic_change": elastic,
        "closure": jnp.where(exchanged > 0, jnp.abs(residual) / jnp.where(exchanged > 0, exchanged, 1.0), 0.0),
    }
