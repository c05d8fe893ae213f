"""How near a run came to an instability: a load that outweighs the sliding brake,
linings that lock themselves."""

from typing import NamedTuple

import numpy as np

from ..hybrid.arrays import Array
from ..phases import Phases
from ..physics._brake import BrakeSystem
from ..physics.mechanism import BandMode, Mode, slips
from .log import Status
from .probe import capacities_at
from .scan import Scan

#: the lever pulls hardest from this far below the maximum that it had
_NEARLY = 1e-3
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9


def least_outweighed(scan: Scan) -> dict[str, float] | None:
    """Load and torque (N·m) and time (s) at the minimum of torque over load while the
    brake slides under its maximum lever force, at the ends and in the middle of all
    steps; `margin`: `torque/load − 1`. `None` without a load."""
    columns = scan.seen
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


class Shortage(NamedTuple):
    """Stretches of a run in which the load exceeded what the brake gives under its
    maximum slack tension.

    - `start`, `end` (s) of the first, and the largest `load` (N·m) in it
    - `times`: how many there were
    """

    start: float
    end: float
    load: float
    times: int


def shortage(scan: Scan, status: str) -> Shortage | None:
    """Times before the end in which the load exceeded what the brake gives under its
    maximum slack tension; `None` without any."""
    columns = scan.seen
    t = scan.seen.t
    system: BrakeSystem = scan.record.system  # pyright: ignore
    hardest = _hardest(scan)
    rate = np.sign(columns.omega) * columns.alpha
    # a pulley that stops is there at last
    moving = np.abs(columns.omega) > _ROUNDING * np.max(np.abs(columns.omega))
    candidates = hardest & _slides(scan) & moving & (rate > 0)
    if not np.any(
        rate[candidates] * float(system.inertia)
        > _ROUNDING * float(system.sizes.torque)
    ):
        # nothing ever sped up a pulley whose brake slides: no need to look closer
        return None

    def short_at(some: np.ndarray) -> np.ndarray:
        if not some.size:
            return some
        capacities = capacities_at(scan.record, some, scan.instants)
        return some[capacities.outweighed]

    # first coarsely, then at all samples of the steps in which it is short
    rows_short = np.unique(scan.row[short_at(np.flatnonzero(hardest & _coarse(scan)))])
    short = np.zeros(len(t), bool)
    if rows_short.size:
        short[short_at(np.flatnonzero(hardest & np.isin(scan.row, rows_short)))] = True
    edges = np.flatnonzero(
        np.diff(np.concatenate([[False], short, [False]]).astype(int))
    )
    spans = [(a, b - 1) for a, b in edges.reshape(-1, 2) if t[b - 1] > t[a]]
    if spans and spans[-1][1] == len(t) - 1 and status == Status.RUNAWAY:
        spans.pop()  # that is how the run ended
    if not spans:
        return None
    first, last = spans[0]
    load = float(np.max(np.abs(columns.load_torque[first : last + 1])))
    return Shortage(float(t[first]), float(t[last]), load, len(spans))


def _slides(scan: Scan) -> Array:
    """Samples at which a friction pair of the brake slides."""
    modes = scan.record.modes
    assert isinstance(modes, Mode)
    band = np.asarray(modes.band)[scan.row]
    inner = np.asarray(modes.slides)[scan.row]
    return slips(band) | ((band == BandMode.HELD) & (inner != 0))


def _hardest(scan: Scan) -> Array:
    """Samples at which the lever pulls as hard as it can, or as it ever does."""
    # pyright: ignore
    lever = scan.record.system.lever
    pull = scan.seen.lever_tension
    held = lever.controls_speed and not isinstance(lever, Phases)
    greatest = float(lever.greatest()) if held else np.max(pull)  # pyright: ignore
    return (pull > 0) & (pull >= (1 - _NEARLY) * greatest)


def _coarse(scan: Scan) -> Array:
    """The samples at the ends and in the middle of all steps."""
    return np.arange(len(scan.row)) % scan.samples % (scan.samples // 2) == 0
