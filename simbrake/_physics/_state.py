"""State, ledger and flows of a brake: what is integrated, and what is found from it at one instant."""

import enum
from typing import Any, NamedTuple

from jaxtyping import Float

from .._hybrid import SYSTEM_CODES
from .._hybrid._arrays import Array


class BrakeCode(enum.IntEnum):
    """Ends of a run that only a brake can come to."""

    SINGULAR_GEOMETRY = SYSTEM_CODES
    BAND_SNAP = SYSTEM_CODES + 1
    FLASH_FOLD = SYSTEM_CODES + 2
    OUTSIDE_TABLE = SYSTEM_CODES + 3


class HeatLedger(NamedTuple):
    """Heat in J since the start: friction heat given to metal, linings and band, heat that was lost or supplied."""

    to_metal: Any
    to_linings: Any
    lost: Any
    supplied: Any
    to_band: Any = None  # staged brakes only


class Ledger(NamedTuple):
    """Energies in J since the start: work of load and lever, friction heat, and what became of it (`None`: no heat)."""

    load_work: Any
    lever_work: Any
    friction_heat: Any  # of the pair on which the band acts
    heat: Any = None
    internal_heat: Any = None  # of the internal pair of a staged brake
    damper_heat: Any = None  # of dampers in the band or the bandage


class State(NamedTuple):
    """Angle `φ` (rad), speed `ω` (rad/s), elongation `x` (m; `None` for a rigid band), the ledger, the heat content of
    the thermal nodes over their capacity (K; `None` without heat), the speed `ω_b` (rad/s) of a bandage, and the
    thickness worn off the linings (`Worn`; `None` without wear)."""

    phi: Any
    omega: Any
    x: Any
    ledger: Ledger
    heat: Any = None
    omega_b: Any = None
    worn: Any = None


class Inner(NamedTuple):
    """The internal pair of a staged brake at one instant."""

    torque: Float[Array, ""]  # Λ that the pulley gives to the bandage (N·m)
    capacity: Float[Array, ""]  # M_int up to which it sticks, or with which it slides (N·m)
    slip_speed: Float[Array, ""]  # R (ω − ω_b) (m/s)
    alpha: Float[Array, ""]  # ω̇_b (rad/s²)
    friction: Float[Array, " n"]  # greatest forces of the linings on the rim (N)
    normal: Float[Array, " n"]  # loads on the rim, preload included (N)


class Flows(NamedTuple):
    """Forces, rates and powers at one instant: everything that right-hand side, guards, ledger and outputs read."""

    slack_tension: Float[Array, ""]  # T_0 (N), as the band has it at its slack end
    lever_tension: Float[Array, ""]  # T_0 (N), as the lever would give it
    tight_tension: Float[Array, ""]  # T_n (N)
    load_torque: Float[Array, ""]  # M_load (N·m)
    brake_torque: Float[Array, ""]  # M_b = R_b (T_n − T_0) (N·m)
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    band_speed: Float[Array, ""]  # ẋ (m/s)
    slip_speed: Float[Array, ""]  # v_s (m/s)
    snap: Any = None  # 1 + γ: by how much the band still follows the fade
    thermal: Any = None  # ThermalNow, with heat only
    inner: Any = None  # Inner, of a staged brake only


class ThermalNow(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: Any  # HeatFlows, friction apart
    deposit: Any  # Deposit, per unit of slip speed
    inner_deposit: Any = None  # of the internal pair, per unit of its own slip speed
