"""What one looks at in a run beyond its states: forces and temperatures of every lining, and marks that are passed."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ._band import LiningForces, mobilised
from ._heat import place_count
from ._modes import BandMode, Mode
from ._state import Flows, State
from ._system import BrakeSystem


def lining_forces(system: BrakeSystem, y: State, mode: Mode, q: Flows) -> LiningForces:
    """Tension, friction and normal force at every lining (mobilisation rule of model §3)."""
    forces = system.forces
    mu = forces.mobilised_mu(q.lever_tension, y, mode)
    return mobilised(q.slack_tension, q.tight_tension, mu, jnp.asarray(forces.grip.linings.angle))


def lining_margins(system: BrakeSystem, y: State, mode: Mode, q: Flows) -> Float[Array, " twice_n"]:
    """By how much each lining is past its static limit while the band is elastic, over the reference tension.

    The first `n` count from the slack end (`C x − T_0 Π_i`), the last `n` from the anchor for a band pulled the
    other way (`T_0 − C x ∏_{j≥i} μ_j`); −1 in every other mode.
    """
    limits = system.forces.limits(q.lever_tension, y.heat, mode)
    ahead = q.tight_tension - q.slack_tension * jnp.cumprod(limits.mu)
    back = q.slack_tension - q.tight_tension * jnp.cumprod(limits.mu[::-1])[::-1]
    margins = jnp.concatenate([ahead, back]) / system.tension_scale
    return jnp.where((mode.band == BandMode.ELASTIC) & ~limits.locked, margins, -1.0)


def surfaces(system: BrakeSystem, q: Flows) -> dict[str, Array]:
    """Surface temperatures (K) of rim, linings and band where the scene names them; on walls reconstructed."""
    found: dict[str, Array] = {}
    thermal = system.forces.thermal
    if thermal is None or q.thermal is None:
        return found
    net, deposit = q.thermal.flows, q.thermal.deposit
    faces = dict(net.faces)
    for place, per_speed in deposit.faces.items():
        faces[place] = faces.get(place, 0.0) + per_speed * q.slip_speed
    if q.inner is not None:
        for place, per_speed in q.thermal.inner_deposit.faces.items():
            faces[place] = faces.get(place, 0.0) + per_speed * q.inner.slip_speed
    for kind in ("rim", "linings", "band"):
        place = getattr(thermal.heat, kind)
        if place is not None:
            found[kind] = thermal.surface(place, q.thermal.T, q.thermal.T_junctions, faces)
    return found


def mark_names(system: BrakeSystem) -> list[tuple[str, int | None]]:
    """Marks that heat can pass, as names of events with the lining (from 1) that they concern."""
    thermal, linings = system.forces.thermal, system.forces.grip.linings
    if thermal is None:
        return []
    heat, n = thermal.heat, linings.count
    names: list[tuple[str, int | None]] = []
    if linings.friction.temperature_dependent and system.forces.internal is None:
        names.append(("grip_lost", None))
    if heat.permissible is not None and heat.linings is not None:
        per_lining = place_count(heat, heat.linings) == n and n > 1
        names += [("permissible_temperature", i + 1 if per_lining else None) for i in range(n if per_lining else 1)]
    return names


def passing(system: BrakeSystem, t: Array, y: State, mode: Mode, q: Flows, hot: dict[str, Array]) -> Array:
    """By how much each of `mark_names` is passed, relative to a typical size."""
    found, thermal = [], system.forces.thermal
    if thermal is None:
        return jnp.zeros(0)
    if system.forces.grip.linings.friction.temperature_dependent and system.forces.internal is None:
        # sliding ahead, the brake no longer outweighs the load (a lever that holds the speed balances it to rounding)
        short = (q.load_torque - q.brake_torque) / system.torque_scale - 1e-9
        # a lever that is being released lets go on purpose: that is no loss of grip
        pulls = system.forces.lever_tension(t, y, mode)[1] >= 0
        found.append(jnp.where((mode.band == BandMode.SLIP) & (mode.sense > 0) & pulls, short, -1.0)[None])
    if thermal.heat.permissible is not None and thermal.heat.linings is not None:
        found.append((hot["linings"] - thermal.heat.permissible) / 100.0)
    return jnp.concatenate(found) if found else jnp.zeros(0)
