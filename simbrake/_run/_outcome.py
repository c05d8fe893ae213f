"""Result codes in words: what a run ended with, what it means and what to do."""

import enum
from collections.abc import Callable

from .._physics._mechanism import BandMode, BrakeCode, Label
from ..brakes._design import Brake, BrakeWords
from ..hybrid import Code

FAILURES = {
    Code.STEP_LIMIT: (
        "step_limit",
        "the step limit was reached before the end time",
        "raise max_steps, loosen rtol, take solver=Rodas5P() where the motion is stiff (as under strong drag), "
        "or look for a mode that changes all the time",
    ),
    Code.EVENT_LIMIT: ("event_limit", "the event limit was reached before the end time", "raise max_events"),
    Code.CHATTER: (
        "chatter",
        "the modes changed again and again at one instant",
        "look at the last modes: two of them exclude each other at this load",
    ),
    Code.ZENO: (
        "zeno",
        "events follow each other ever faster",
        "look at the last events: the motion between two of them dies out",
    ),
    Code.NOT_FINITE: ("not_finite", "a state or a rate became infinite or not a number", "check the laws and profiles"),
    Code.STEP_TOO_SMALL: (
        "step_too_small",
        "the step size fell to rounding level",
        "the equations change faster than this method can follow: loosen rtol or check the laws and profiles",
    ),
    BrakeCode.SINGULAR_GEOMETRY: (
        "singular_geometry",
        Brake.words.locking,
        Brake.words.unlocking,
    ),
    BrakeCode.BAND_SNAP: (
        "band_snap",
        "1 + γ fell to 0: friction fades faster than the elastic band can follow, and its tension would jump",
        "give the surface that the friction law senses a larger capacity, states of the law slower rates, "
        "or the band a higher stiffness",
    ),
    BrakeCode.FLASH_FOLD: (
        "flash_fold",
        "friction and its flash temperature have no common solution: a fold, or a lining that would lock as it slides",
        "look at the friction law above this surface temperature, or at the size and hardness of the spots",
    ),
    BrakeCode.OUTSIDE_TABLE: (
        "outside_table",
        "a lining's temperature left the table of its friction law",
        "extend the table; it is not extrapolated",
    ),
}


def failure_of(code: int, words: BrakeWords) -> tuple[str, str]:
    """What a failure code means for a kind of brake, and what to do."""
    _, what, hint = FAILURES[code]  # pyright: ignore
    return (words.locking, words.unlocking) if code == BrakeCode.SINGULAR_GEOMETRY else (what, hint)


class SimulationError(RuntimeError):
    """A run that ended in a failure code; `result` holds what was computed until then."""

    def __init__(self, message: str, result: object):
        super().__init__(message)
        self.result = result


class Status(enum.StrEnum):
    """How a run that reached its end time ended."""

    STOPPED = "stopped"
    HELD = "held"
    NOT_STOPPED = "not_stopped"
    RUNAWAY = "runaway"
    RELEASED = "released"


STATUS_MESSAGES = {
    Status.STOPPED: "the brake brought the pulley to rest and holds it",
    Status.HELD: "the pulley was at rest from the start and is held",
    Status.NOT_STOPPED: "the pulley still turns at the end time",
    Status.RUNAWAY: "the brake cannot hold this load",
    Status.RELEASED: "the brake is open at the end time",
}


def status_of(end: Label, moved: bool, exceeded: Callable[[], bool]) -> Status:
    """Status of a run that ended in the mode `end`.

    `moved`: whether the pulley turned at any time;  `exceeded`: whether the load exceeds what the brake can hold, asked
    only where the pulley still turns
    """
    if end.band == BandMode.OPEN:
        return Status.RELEASED
    if end.rests:
        return Status.STOPPED if moved else Status.HELD
    return Status.RUNAWAY if exceeded() else Status.NOT_STOPPED
