"""Thresholds that heat or fade of a brake can exceed."""

from typing import Any

import jax.numpy as jnp

from ..hybrid._arrays import Array
from ..thermal._heat import place_count
from ._brake import BrakeNow, BrakeSystem
from ._mechanism import SLIP, Mode


def _can_lose_grip(system: BrakeSystem) -> bool:
    """Whether fade can leave a sliding brake of one pair, whose linings act as one, weaker than its load."""
    reads = system.grip.reads.T or system.grip.remembers
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
