"""How near a run came to an instability: a load that outweighs the sliding brake,
linings that lock themselves."""

import numpy as np

from ..hybrid.arrays import Array
from ..physics._brake import BrakeSystem
from ..physics.mechanism import BandMode, Mode, slips
from .duty import speed_is_led
from .scan import Scan
from .torques import capacities_at

#: the lever pulls hardest from this far below the maximum that it had
_NEARLY = 1e-3
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9


def least_outweighed(scan: Scan) -> dict[str, float] | None:
    """Load and torque (N·m) and time (s) at the minimum of torque over load while the
    brake slides under its maximum lever force, at the ends and in the middle of all
    steps; `margin`: `torque/load − 1`. `None` without a load."""
    columns = scan.columns
    some = np.flatnonzero(
        _slides(scan)
        & _hardest(scan)
        & _coarse(scan)
        & (np.asarray(columns.omega) != 0)
    )
    if not some.size:
        return None
    capacities = capacities_at(scan.record, some, scan.instants)
    load = np.asarray(capacities.hanging)
    torque = np.asarray(capacities.torque)
    driven = np.flatnonzero(load > 0)
    if not driven.size:
        return None
    k = int(driven[np.argmin(torque[driven] / load[driven])])
    margin = float(torque[k]) / float(load[k]) - 1.0
    return {
        "load": float(load[k]),
        "torque": float(torque[k]),
        "time": float(columns.t[some[k]]),
        "margin": margin,
    }


def shortage(scan: Scan) -> dict[str, float] | None:
    """The same where the load exceeded the torque; `None` where it never did."""
    columns = scan.columns
    system: BrakeSystem = scan.record.system  # pyright: ignore
    rate = np.sign(columns.omega) * columns.alpha
    # a pulley that stops is there at last
    moving = np.abs(columns.omega) > _ROUNDING * np.max(np.abs(columns.omega))
    faster = rate[_hardest(scan) & _slides(scan) & moving] * float(system.inertia)
    if not np.any(faster > _ROUNDING * float(system.sizes.torque)):
        # nothing ever sped up a pulley whose brake slides: no need to look closer
        return None
    least = least_outweighed(scan)
    return least if least is not None and least["margin"] < -_ROUNDING else None


def _slides(scan: Scan) -> Array:
    """Samples at which a friction pair of the brake slides."""
    modes = scan.record.modes
    assert isinstance(modes, Mode)
    band = np.asarray(modes.band)[scan.row]
    inner = np.asarray(modes.slides)[scan.row]
    return slips(band) | ((band == BandMode.HELD) & (inner != 0))


def _hardest(scan: Scan) -> Array:
    """Samples at which the lever pulls as hard as it can, or as it ever does."""

    lever = scan.record.system.lever  # pyright: ignore
    pull = scan.columns.lever_tension
    greatest = float(lever.greatest()) if speed_is_led(lever) else np.max(pull)  # pyright: ignore
    return (pull > 0) & (pull >= (1 - _NEARLY) * greatest)


def _coarse(scan: Scan) -> Array:
    """The samples at the ends and in the middle of all steps."""
    return np.arange(len(scan.row)) % scan.samples % (scan.samples // 2) == 0
