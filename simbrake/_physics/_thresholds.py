"""Results of a brake beside its states: the hook, and thresholds that heat or fade can exceed."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from ..hybrid._arrays import Array
from ..thermal._heat import place_count
from ._brake import LOAD, BrakeSystem, piece_of
from ._hook import BrakeUnderRope
from ._mechanism import SLIP, Mode
from ._state import BrakeNow, State


class HookNow(NamedTuple):
    """The hook: travel downwards since the start (m), its speed (m/s), and the force on it, `m (g − a)` (N).

    On an elastic rope also its stretch (m; below 0 it is slack), and the weight on the hook (N).
    """

    travel: Array
    speed: Array
    force: Array
    stretch: Any = None
    weight: Any = None


def hook_of(system: BrakeSystem, y: State, mode: Mode, z: BrakeNow) -> HookNow | None:
    """The hook, where the load hangs on one."""
    load, travelled = system.load.on_layer(mode.layer), system.load.travelled(y.phi)
    hanging, travel = load.hanging(piece_of(mode, LOAD)), load.travel()
    if hanging is None or travel is None or travelled is None:
        return None
    if isinstance(system, BrakeUnderRope):
        speed, stretch = y.hook
        return HookNow(travelled + stretch - system.stretch, speed, z.rope.force, stretch, z.rope.weight)
    mass, weight = hanging
    return HookNow(jnp.asarray(travelled), y.omega * travel, weight - mass * travel * z.contact.alpha)


def _can_lose_grip(system: BrakeSystem) -> bool:
    """Whether fade can leave a sliding brake of one pair, whose linings act as one, weaker than its load."""
    reads = system.grip.reads.T or system.grip.remembers or bool(system.mechanism.profiles)
    return reads and len(system.mechanism.pairs) == 1 and not system.mechanism.resolved


def mark_names(system: BrakeSystem) -> list[tuple[str, int | None]]:
    """Thresholds that heat or fade can exceed, as names of events with their lining (from 1)."""
    names: list[tuple[str, int | None]] = [("grip_lost", None)] if _can_lose_grip(system) else []
    if system.thermal is None:
        return names
    heat, n = system.thermal.heat, system.grip.linings.count
    if heat.permissible is not None and heat.linings is not None:
        per_lining = place_count(heat, heat.linings) == n and n > 1
        names += [("permissible_temperature", i + 1 if per_lining else None) for i in range(n if per_lining else 1)]
    return names


def passing(system: BrakeSystem, mode: Mode, q: BrakeNow, hot: dict[str, Array]) -> Array:
    """Excess over each threshold of `mark_names`, relative to a typical size."""
    found: list[Any] = []
    if _can_lose_grip(system):
        # sliding ahead, the brake no longer outweighs the load (a lever that holds the speed balances it to rounding)
        short = (q.net_load - q.contact.brake_torque) / system.sizes.torque - 1e-9
        # a release by the lever is intended: it is no loss of grip
        pulls = q.lever_rate >= 0
        found.append(jnp.where((mode.band == SLIP) & (mode.sense > 0) & pulls, short, -1.0)[None])
    heat = None if system.thermal is None else system.thermal.heat
    if heat is not None and heat.permissible is not None and heat.linings is not None:
        found.append((hot["linings"] - heat.permissible) / 100.0)
    return jnp.concatenate(found) if found else jnp.zeros(0)
