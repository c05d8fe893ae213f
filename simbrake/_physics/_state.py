"""State and variables of a brake: what it integrates, what is algebraic at one instant, its capacity and its phases."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Bool, Float, PyTree

from .._phases import AfterTravel, AtRest, AtTemperature, PhaseNow, Phases
from ..hybrid._arrays import Array, largest
from ._mechanism import Ledger, Mode, Rub
from ._shaft import ShaftNow
from ._thermal import Deposit, HeatFlows

#: relative rounding of a torque that balances another one
_ROUNDING = 1e-9


class State(NamedTuple):
    """Angle `φ` (rad) and speed `ω` (rad/s) of the pulley, the states of the mechanism's own, the ledger, the heat
    content of the thermal nodes over their capacity (K; `None` without heat), the thickness worn off the linings of
    each pair (m; `None` without wear, and of a pair without), the states of the friction law of each pair (`None`
    without any), of the phase of the duty (`None` without phases), and of a hook on an elastic rope (`None` on a rigid
    one)."""

    phi: Any
    omega: Any
    own: Any
    ledger: Ledger
    heat: Any = None
    worn: Any = None
    memory: Any = None
    phase: Any = None
    hook: Any = None


class ThermalNow(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: HeatFlows  # friction apart
    deposits: tuple[Deposit, ...]  # of the friction heat of each pair (W)


class BrakeNow(NamedTuple):
    """Variables of a brake: applied loads, its mechanism (`contact`), its pairs, and the thermal network if any."""

    lever_tension: Float[Array, ""]  # T_0 (N), as the lever would give it
    lever_rate: Float[Array, ""]  # its rate (N/s)
    load_torque: Float[Array, ""]  # M_load (N·m)
    contact: PyTree  # a `ContactNow`
    rubs: tuple[Rub, ...]
    thermal: ThermalNow | None
    shaft: ShaftNow | None = None  # torques on the shaft beside load and brake
    rope: Any = None  # a `RopeNow`, of an elastic rope

    @property
    def net_load(self) -> Array:
        """Torque (N·m) that the shaft leaves of the load: that on the mechanism."""
        return self.load_torque if self.shaft is None else self.shaft.left


class Wearing(NamedTuple):
    """Integration of the wear depth of the linings: no rate depends on it, it is a quadrature.

    - `scale` (m): typical thickness that the run wears off
    - `turned_at`: times at which the band is turned end for end (of a duty in phases: numbers of phases that have
      ended). `h_i` of the first pair stays that of the lining which was the `i`-th at the start; after an odd number of
      turns it rubs where the `(n + 1 − i)`-th did
    """

    scale: Float[Array, ""]
    turned_at: Array | None


class Capacity(NamedTuple):
    """Load and sliding brake at one instant, or at many: torques (N·m) in the direction in which the pulley turns.

    - `load`: load torque, less the other torques on the shaft
    - `pairs` (…, k): maximum torque of each friction pair with its kinetic friction at the speed of the pulley and the
      temperatures of that instant: of a standard brake one, of a staged brake external, internal
    - `settled`: whether the lever is at its last value
    """

    load: Float[Array, "*many"]
    pairs: Float[Array, "*many pairs"]
    settled: Bool[Array, "*many"]

    @property
    def torque(self) -> Float[Array, "*many"]:
        """Capacity of the brake: the torque of its weaker pair (N·m)."""
        return self.pairs.min(axis=-1)

    @property
    def outweighed(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds the torque of the sliding brake; a load that equals it keeps the speed constant."""
        return self.load > self.torque * (1 + _ROUNDING)

    @property
    def exceeded(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds what the brake gives, now and with the final lever force."""
        return self.settled & self.outweighed


# --- phases of a duty -------------------------------------------------------------------------------------------------


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
