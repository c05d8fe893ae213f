"""State and variables of a brake: what it integrates, what is algebraic at one instant, and its capacity."""

from typing import Any, NamedTuple

from jaxtyping import Bool, Float, PyTree

from ..hybrid._arrays import Array
from ._mechanism import Ledger, Rub
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
    def exceeded(self) -> Bool[Array, "*many"]:
        """Whether the brake cannot hold the load, now or with the final lever force."""
        return self.settled & (self.load > 0) & (self.load >= self.torque * (1 - _ROUNDING))
