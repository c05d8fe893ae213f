"""State, ledger and flows of a brake: what is integrated, and what is found from it at one instant."""

import enum
from typing import Any, NamedTuple

from jaxtyping import Array, Float

from ._hybrid import SYSTEM_CODES


class BrakeCode(enum.IntEnum):
    """Ends of a run that only a brake can come to."""

    SINGULAR_GEOMETRY = SYSTEM_CODES


class Ledger(NamedTuple):
    """Energies in J since the start: work of load and lever, friction heat."""

    load_work: Any
    lever_work: Any
    friction_heat: Any


class State(NamedTuple):
    """Angle `φ` (rad), speed `ω` (rad/s), elongation `x` (m; `None` for a rigid band) and the ledger."""

    phi: Any
    omega: Any
    x: Any
    ledger: Ledger


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
