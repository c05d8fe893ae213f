"""Phases of a duty as modes of a brake: their state, and the margins to their ends."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Float

from .._phases import AfterTravel, AtRest, AtTemperature, PhaseNow, Phases
from ..hybrid._arrays import Array, largest
from ._mechanism import Mode


class PhaseState(NamedTuple):
    """Begin of the phase that runs (s), and angle by which the pulley has turned in it (rad)."""

    begun: Any
    turned: Any


def begun_anew(state: PhaseState, t: Array, before: Mode, after: Mode, phases: Phases) -> PhaseState:
    """The state after a change of mode: another phase begins now, unless all are over."""
    new = (after.phase != before.phase) & (after.phase < phases.total)
    return PhaseState(jnp.where(new, t, state.begun), jnp.where(new, 0.0, state.turned))


def margin_of_phase(
    now: PhaseNow, state: PhaseState, mode: Mode, lowered: Any, hot: dict[str, Array]
) -> Float[Array, ""]:
    """Margin to the end of the phase that runs; 1 where a time ends it, which is a time breakpoint.

    - `lowered`: travel of the hook in the phase (m);  `hot`: surface temperatures (K)
    """
    found = []
    for phase in now.whole.phases:
        end = phase.until
        if isinstance(end, AtRest):
            # (the pulley has moved in the phase, if only by rounding: an event at its begin takes no time)
            found.append(jnp.where(mode.rests & (state.turned != 0), -1.0, 1.0))
        elif isinstance(end, AfterTravel):
            found.append(1.0 - lowered / end.distance)
        elif isinstance(end, AtTemperature):
            above = (largest(jnp.atleast_1d(hot[end.of])) - end.level) / 100.0
            found.append(above if end.falling else -above)
        else:
            found.append(1.0)
    return now.of_each(found)
