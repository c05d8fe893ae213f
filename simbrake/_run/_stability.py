"""How near a run came to an instability: linings that lock themselves, and a load that outweighs the sliding brake."""

from typing import NamedTuple

import numpy as np

from .._parts._scene import Scene, self_locking_ratios
from .._physics._mechanism import BandMode, Mode, slips
from ._probe import capacities_at
from ._scan import Scan

#: the lever pulls hardest from this far below the maximum that it had
_NEARLY = 1e-3


class Locking(NamedTuple):
    """The lining (from 1) that is nearest self-locking: the ratio `f tan(β/2)` of a band, which locks at 1."""

    lining: int
    ratio: float

    @property
    def margin(self) -> float:
        """`1 − ratio`: 0 or less where it locks itself."""
        return 1.0 - self.ratio


class Outweighed(NamedTuple):
    """When a sliding brake under its maximum lever force outweighed the load the least: torques (N·m), time (s)."""

    load: float
    torque: float
    time: float

    @property
    def margin(self) -> float:
        """`torque/load − 1`: below 0 where the load speeds the pulley up."""
        return self.torque / self.load - 1.0


def nearest_locking(scene: Scene) -> Locking:
    """The lining nearest self-locking, with its static friction at the start."""
    ratios = self_locking_ratios(scene)
    i = int(np.argmax(ratios))
    return Locking(i + 1, float(ratios[i]))


def least_outweighed(scan: Scan) -> Outweighed | None:
    """The minimum of torque over load while the brake slides under its maximum lever force; `None` without a load.

    At the ends and in the middle of all steps.
    """
    seen, modes = scan.seen, scan.record.modes
    assert isinstance(modes, Mode)
    band, inner = np.asarray(modes.band)[scan.row], np.asarray(modes.slides)[scan.row]
    slides = slips(band) | ((band == BandMode.HELD) & (inner != 0))
    hardest = (seen.lever_tension > 0) & (seen.lever_tension >= (1 - _NEARLY) * np.max(seen.lever_tension))
    coarse = np.arange(len(seen.t)) % scan.samples % (scan.samples // 2) == 0
    some = np.flatnonzero(slides & hardest & coarse & (np.asarray(seen.omega) != 0))
    if not some.size:
        return None
    found = capacities_at(scan.record, some, scan.instants)
    load, torque = np.asarray(found.load), np.asarray(found.torque)
    driven = np.flatnonzero(load > 0)
    if not driven.size:
        return None
    k = int(driven[np.argmin(torque[driven] / load[driven])])
    return Outweighed(float(load[k]), float(torque[k]), float(seen.t[some[k]]))
