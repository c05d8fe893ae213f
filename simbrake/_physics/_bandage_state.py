"""State, mode and flows of a resolved bandage: every lining a body of its own."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from ._modes import BandMode, Label
from ._state import Ledger


class BandageState(NamedTuple):
    """Angle `φ` (rad) and speed `ω` (rad/s) of the pulley, elongations `e_j` (n − 1,) of the springs (m, at the band
    circle), speeds `ω_i` (n,) of the linings (rad/s), the ledger, the heat content of the thermal nodes over their
    capacity (K; `None` without heat), and the thickness worn off the linings (`Worn`; `None` without wear)."""

    phi: Any
    omega: Any
    stretch: Any
    speeds: Any
    ledger: Ledger
    heat: Any = None
    worn: Any = None


class BandageMode(NamedTuple):
    """What every lining does, and the pieces on which the given profiles are.

    - `band`: what the band does to all of them (`BandMode`): `OPEN` while the lever does not pull, `HELD` while every
      lining rests on it, else `SLIP`, or `SLIP_BACK` with the pulley in reverse
    - `sense`: direction in which the pulley moves or last moved, ±1
    - `outer` (n,): 0 while lining `i` is held on the band, else the sign of `ω_i` (of no meaning while open)
    - `inner` (n,): 0 while it sticks on the rim, else the sign of `ω − ω_i`

    Both 0 means that the lining is at rest on a pulley at rest. All leaves may have leading axes (rows of a record).
    """

    band: Any
    sense: Any
    lever_piece: Any
    load_piece: Any
    outer: Any
    inner: Any
    heat_pieces: tuple[Any, ...] = ()

    @property
    def fixed(self) -> Any:
        """Linings that neither move on the band nor on the rim."""
        return (self.outer == 0) & (self.inner == 0)

    @property
    def rests(self) -> Any:
        """Whether the pulley is at rest: a lining that is fixed holds it."""
        return jnp.any(self.fixed, axis=-1)

    @property
    def slides(self) -> Any:
        """The internal pair as a whole: 0 while every lining sticks on the rim, else the sense of the pulley (±1)."""
        return jnp.where(jnp.all(self.inner == 0, axis=-1), 0, self.sense)

    @property
    def contacts(self) -> dict[str, Any]:
        """What every lining does for itself on the band and on the rim."""
        return {"lining_external": self.outer, "lining_internal": self.inner}

    @property
    def label(self) -> Label:
        """What the log of a rigid bandage would call it (one concrete mode)."""
        return Label(int(self.band), int(self.slides))


def band_label(outer: Any, sense: Any, pulls: Any) -> Any:
    """`BandMode` of the whole bandage."""
    moving = jnp.where(sense > 0, BandMode.SLIP, BandMode.SLIP_BACK)
    return jnp.where(pulls, jnp.where(jnp.all(outer == 0), BandMode.HELD, moving), BandMode.OPEN).astype(jnp.int32)


class BandageThermal(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: Any  # HeatFlows, friction apart
    outer: Any  # Deposit of the heat between linings and band (W)
    inner: Any  # Deposit of the heat between linings and rim (W)


class BandageFlows(NamedTuple):
    """Forces, rates and powers at one instant: everything that right-hand side, guards, ledger and outputs read."""

    slack_tension: Float[Array, ""]  # T_0 (N), 0 while open
    lever_tension: Float[Array, ""]  # T_0 (N), as the lever would give it
    tight_tension: Float[Array, ""]  # T_n (N)
    load_torque: Float[Array, ""]  # M_load (N·m)
    brake_torque: Float[Array, ""]  # R_b (T_n − T_0) (N·m)
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    slip_speed: Float[Array, ""]  # mean of R_b ω_i (m/s)
    tension: Float[Array, " n"]  # T_i (N)
    outer_force: Float[Array, " n"]  # G_i = T_i − T_{i−1}, by which the band holds lining i (N)
    normal: Float[Array, " n"]  # N_i (N)
    load: Float[Array, " n"]  # N_i + N_pre,i on the rim (N)
    inner_torque: Float[Array, " n"]  # λ_i that the pulley gives to lining i (N·m)
    capacity: Float[Array, " n"]  # M_i up to which it sticks, or with which it slides (N·m)
    inner_slip: Float[Array, " n"]  # R (ω − ω_i) (m/s)
    outer_slip: Float[Array, " n"]  # R_b ω_i (m/s)
    accelerations: Float[Array, " n"]  # ω̇_i (rad/s²)
    spring_torque: Float[Array, " n"]  # Q_i (N·m)
    spring_force: Float[Array, " springs"]  # S_j (N), damper included
    outer_limit: Float[Array, " n"]  # greatest |G_i| up to which it is held (N), of the tensions there are
    share: Float[Array, ""]  # θ of a pulley at rest, else 0
    least_hold: Float[Array, ""]  # load torques between which a pulley at rest stays there (N·m), else 0
    most_hold: Float[Array, ""]
    thermal: Any = None  # BandageThermal, with heat only
