"""What one looks at in a run beyond its states: forces and temperatures of every lining, and marks that are passed.

One function each, with a version for every kind of brake.
"""

import functools
from typing import Any

import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._band import LiningForces, mobilised
from .._parts._heat import place_count
from . import _brake as brake
from . import _mechanism as mechanism
from ._acting import AbstractBrakeSystem
from ._bandage import BandageSystem
from ._bandage_state import BandageFlows, BandageMode, BandageState
from ._chain import ChainFlows, ChainMode, ChainState, chain_lining_forces
from ._chain_system import ChainSystem
from ._modes import BandMode, Mode
from ._state import Flows, State
from ._system import BrakeSystem


def look_at(system: Any, t: Array, y: Any, mode: Any) -> Any:
    """Forces, rates and heat flows at one instant."""
    return system.variables(t, y, mode) if isinstance(system, brake.BrakeSystem) else system.forces.flows(t, y, mode)


def can_lock(system: Any) -> bool:
    """Whether linings can come to lock themselves in a run."""
    if isinstance(system, brake.BrakeSystem):
        return system.mechanism.varies
    return isinstance(system, BrakeSystem) and system.forces.grip.varies


def locks_of(mode: Any) -> Any:
    """Whether a lining locks itself."""
    return mode.own.locks if isinstance(mode, mechanism.Mode) else mode.locks


@functools.singledispatch
def lining_forces(system: Any, y: Any, mode: Any, q: Any) -> LiningForces:
    """Tension, friction and normal force at every lining (of a band as a whole: mobilisation rule of model §3)."""
    raise TypeError(f"{type(system).__name__} is no kind of brake")


@lining_forces.register(BrakeSystem)
def _(system: BrakeSystem, y: State, mode: Mode, q: Flows) -> LiningForces:
    mu = system.forces.mobilised_mu(q.lever_tension, y, mode)
    return mobilised(q.slack_tension, q.tight_tension, mu, jnp.asarray(system.forces.grip.linings.angle))


@lining_forces.register(ChainSystem)
def _(system: ChainSystem, y: ChainState, mode: ChainMode, q: ChainFlows) -> LiningForces:
    return chain_lining_forces(system.forces, mode, q)


@lining_forces.register(BandageSystem)
def _(system: BandageSystem, y: BandageState, mode: BandageMode, q: BandageFlows) -> LiningForces:
    forces = q.outer_force * jnp.cos(jnp.asarray(system.forces.linings.angle) / 2)
    return LiningForces(q.tension, forces, q.normal, mode.outer != 0)


@lining_forces.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem, y: brake.State, mode: mechanism.Mode, q: brake.BrakeNow) -> LiningForces:
    return system.mechanism.linings(mode, q.contact)


@functools.singledispatch
def distribution(system: Any) -> str:
    """How what rigid bodies leave undetermined among the linings is closed, in words."""
    return "every lining from its own balance"


@distribution.register(BrakeSystem)
def _(system: BrakeSystem) -> str:
    return "mobilisation rule: one lining after the other at its limit, from the slack end (reversed: from the anchor)"


@distribution.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem) -> str:
    return system.mechanism.distribution


@distribution.register(BandageSystem)
def _(system: BandageSystem) -> str:
    return "every lining from its own balance; at rest all mobilise one share of their grip on the rim"


@functools.singledispatch
def lining_margins(system: Any, y: Any, mode: Any, q: Any) -> Float[Array, " twice_n"]:
    """By how much each lining is past its static limit while the band is elastic, over the reference tension.

    The first `n` count from the slack end (`C x − T_0 Π_i`), the last `n` from the anchor for a band pulled the
    other way (`T_0 − C x ∏_{j≥i} μ_j`); −1 in every other mode. Linings that slide by themselves have none.
    """
    return jnp.zeros(0)


@lining_margins.register(BrakeSystem)
def _(system: BrakeSystem, y: State, mode: Mode, q: Flows) -> Float[Array, " twice_n"]:
    limits = system.forces.limits(q.lever_tension, y.heat, mode)
    ahead = q.tight_tension - q.slack_tension * jnp.cumprod(limits.mu)
    back = q.slack_tension - q.tight_tension * jnp.cumprod(limits.mu[::-1])[::-1]
    margins = jnp.concatenate([ahead, back]) / system.tension_scale
    return jnp.where((mode.band == BandMode.ELASTIC) & ~limits.locked, margins, -1.0)


@lining_margins.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem, y: brake.State, mode: mechanism.Mode, q: brake.BrakeNow) -> Float[Array, " twice_n"]:
    return system.mechanism.lining_margins(mode, q.contact)


@functools.singledispatch
def stored(system: Any, t: Array, y: Any, mode: Any) -> tuple[Array, Array]:
    """Kinetic and elastic energy (J)."""
    return system.forces.stored(t, y, mode)


@stored.register(BrakeSystem)
def _(system: BrakeSystem, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
    forces = system.forces
    kinetic = 0.5 * forces.inertia_at(mode) * y.omega**2
    if forces.internal is not None:
        kinetic = kinetic + 0.5 * forces.internal.bandage.inertia * y.omega_b**2
    return kinetic, jnp.zeros_like(kinetic) if forces.stiffness is None else 0.5 * forces.stiffness * y.x**2


@stored.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem, t: Array, y: brake.State, mode: mechanism.Mode) -> tuple[Array, Array]:
    return system.mechanism.stored(system.inertia_at(mode), y.omega, y.own, mode)


@functools.singledispatch
def columns(system: Any, y: Any, mode: Any, q: Any) -> dict[str, Array]:
    """What only this kind of brake has to show over time, by the names of `Series`."""
    raise TypeError(f"{type(system).__name__} is no kind of brake")


@columns.register(BrakeSystem)
def _(system: BrakeSystem, y: State, mode: Mode, q: Flows) -> dict[str, Array]:
    found = {} if y.x is None else {"elongation": y.x}
    if system.forces.thermal is not None:
        found["friction_coefficient"] = system.forces.coefficients(y, mode, q)
    pair = system.forces.internal
    if q.inner is None or pair is None:
        return found
    if system.forces.thermal is not None:
        sliding = system.forces.holding(y, mode)
        f, n = pair.coefficients(q.inner.normal, sliding), system.forces.grip.linings.count
        found["internal_friction_coefficient"] = jnp.broadcast_to(f, (n,))
    return found | {
        "bandage_speed": y.omega_b,
        "internal_torque": q.inner.torque,
        "internal_capacity": q.inner.capacity,
        "internal_slip_speed": q.inner.slip_speed,
        "internal_mode": mode.slides,
        "internal_sliding": jnp.abs(mode.slides) * system.forces.grip.linings.count,
        "internal_load": q.inner.normal,
    }


@columns.register(ChainSystem)
def _(system: ChainSystem, y: ChainState, mode: ChainMode, q: ChainFlows) -> dict[str, Array]:
    found = {"elongation": q.displacement[0], "displacement": q.displacement, "lining_slip_speed": q.lining_slip}
    if system.forces.thermal is not None:
        found["friction_coefficient"] = system.forces.kinetic(y, mode, q)
    return found


@columns.register(BandageSystem)
def _(system: BandageSystem, y: BandageState, mode: BandageMode, q: BandageFlows) -> dict[str, Array]:
    found = {
        "bandage_speed": jnp.mean(y.speeds),
        "internal_torque": jnp.sum(q.inner_torque),
        "internal_capacity": jnp.sum(q.capacity),
        "internal_slip_speed": jnp.mean(q.inner_slip),
        "internal_mode": mode.slides,
        "internal_sliding": jnp.sum(mode.inner != 0).astype(jnp.int32),
        "internal_load": q.load,
        "lining_speed": y.speeds,
        "lining_slip_speed": q.outer_slip,
        "lining_internal_slip_speed": q.inner_slip,
        "lining_internal_torque": q.inner_torque,
    }
    if system.forces.thermal is not None:
        mu = system.forces.coefficients(y, mode).mu_kinetic
        found["friction_coefficient"] = (mu - 1) / (mu + 1) / system.forces.grip.tangent
        found["internal_friction_coefficient"] = system.forces.coefficients(y, mode).inner_kinetic
    return found


@columns.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem, y: brake.State, mode: mechanism.Mode, q: brake.BrakeNow) -> dict[str, Array]:
    return system.mechanism.columns(q.lever_tension, y.omega, y.own, mode, system.hot(y.heat), q.contact)


@functools.singledispatch
def _heated_faces(system: Any, q: Any) -> list[dict[str, Array]]:
    """Friction heat (W) that enters faces of walls, of each pair."""
    return [q.thermal.deposit.faces]


@_heated_faces.register(BrakeSystem)
def _(system: BrakeSystem, q: Flows) -> list[dict[str, Array]]:
    parts = [(q.thermal.deposit, q.slip_speed)]
    if q.inner is not None:
        parts.append((q.thermal.inner_deposit, q.inner.slip_speed))
    return [{place: flow * v for place, flow in deposit.faces.items()} for deposit, v in parts]


@_heated_faces.register(BandageSystem)
def _(system: BandageSystem, q: BandageFlows) -> list[dict[str, Array]]:
    return [q.thermal.outer.faces, q.thermal.inner.faces]


@_heated_faces.register(brake.BrakeSystem)
def _(system: brake.BrakeSystem, q: brake.BrakeNow) -> list[dict[str, Array]]:
    return [] if q.thermal is None else [deposit.faces for deposit in q.thermal.deposits]


def surfaces(system: AbstractBrakeSystem, q: Any) -> dict[str, Array]:
    """Surface temperatures (K) of rim, linings and band where the scene names them; on walls reconstructed."""
    found: dict[str, Array] = {}
    thermal = system.thermal
    if thermal is None or q.thermal is None:
        return found
    faces = dict(q.thermal.flows.faces)
    for part in _heated_faces(system, q):
        for place, flow in part.items():
            faces[place] = faces.get(place, 0.0) + flow
    for kind, place in thermal.heat.hot_places.items():
        found[kind] = thermal.surface(place, q.thermal.T, q.thermal.T_junctions, faces)
    return found


def _can_lose_grip(system: AbstractBrakeSystem) -> bool:
    """Whether fade can leave a sliding standard brake weaker than its load."""
    if isinstance(system, brake.BrakeSystem):
        return system.mechanism.grip.reads.T
    fades = system.forces.grip.reads.T
    return isinstance(system, BrakeSystem) and fades and not system.staged


def mark_names(system: AbstractBrakeSystem) -> list[tuple[str, int | None]]:
    """Marks that heat can pass, as names of events with the lining (from 1) that they concern."""
    thermal, linings = system.thermal, system.linings
    if thermal is None:
        return []
    heat, n = thermal.heat, linings.count
    names: list[tuple[str, int | None]] = []
    if _can_lose_grip(system):
        names.append(("grip_lost", None))
    if heat.permissible is not None and heat.linings is not None:
        per_lining = place_count(heat, heat.linings) == n and n > 1
        names += [("permissible_temperature", i + 1 if per_lining else None) for i in range(n if per_lining else 1)]
    return names


def passing(system: AbstractBrakeSystem, t: Array, y: Any, mode: Any, q: Any, hot: dict[str, Array]) -> Array:
    """By how much each of `mark_names` is passed, relative to a typical size."""
    found, thermal = [], system.thermal
    if thermal is None:
        return jnp.zeros(0)
    if _can_lose_grip(system):
        # sliding ahead, the brake no longer outweighs the load (a lever that holds the speed balances it to rounding)
        short = (q.load_torque - q.brake_torque) / system.sizes.torque - 1e-9
        # a lever that is being released lets go on purpose: that is no loss of grip
        pulls = q.lever_rate >= 0 if isinstance(q, brake.BrakeNow) else system.forces.lever_tension(t, y, mode)[1] >= 0
        found.append(jnp.where((mode.band == BandMode.SLIP) & (mode.sense > 0) & pulls, short, -1.0)[None])
    if thermal.heat.permissible is not None and thermal.heat.linings is not None:
        found.append((hot["linings"] - thermal.heat.permissible) / 100.0)
    return jnp.concatenate(found) if found else jnp.zeros(0)
