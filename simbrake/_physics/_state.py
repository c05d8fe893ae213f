"""What a brake books while it runs, and the ends of a run that only a brake can come to."""

import enum
from typing import Any, NamedTuple

from .._hybrid import SYSTEM_CODES


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
    to_band: Any = None  # where linings rub on the band


class Ledger(NamedTuple):
    """Energies in J since the start: work of load and lever, friction work of every pair, and what became of its heat
    (`None`: no heat)."""

    load_work: Any
    lever_work: Any
    friction: tuple[Any, ...]  # of each pair, in the order of the mechanism
    heat: Any = None
    damper_heat: Any = None  # of dampers in the band or the bandage
