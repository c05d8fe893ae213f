"""The modes of the standard brake: which one holds, in a table and in one decision."""

import enum
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from .._hybrid._arrays import Array


class BandMode(enum.IntEnum):
    """What the band does (model §3)."""

    OPEN = 0
    TAKE_UP = 1
    ELASTIC = 2
    SLIP = 3
    SLIP_BACK = 4
    HELD = 5


#: its labels as they stand in a mode: known while tracing, of the type that a mode has
OPEN, TAKE_UP, ELASTIC, SLIP, SLIP_BACK, HELD = (np.int32(label) for label in BandMode)

#: what the band does in each mode, and what the mode holds while (`Π_s` static limits, `v_s` slip speed)
BAND_MODES = {
    BandMode.OPEN: ("the lever does not pull, the band is free", "`T_0 = 0`"),
    BandMode.TAKE_UP: ("the pulley draws the band tight, no torque yet", "`C x < T_0` and `ω > 0`"),
    BandMode.ELASTIC: (
        "band and pulley move together, linings reach their limits one by one",
        "`T_0/Π_s ≤ C x ≤ T_0 Π_s`",
    ),
    BandMode.SLIP: ("every lining slides, the anchor end is the tight one", "`v_s > 0`"),
    BandMode.SLIP_BACK: ("every lining slides the other way, the lever end is the tight one", "`v_s < 0`"),
    BandMode.HELD: (
        "the pulley is at rest (staged brake: the bandage is at rest)",
        "the load is within the static limits; of a staged brake: the internal torque is",
    ),
}


def rigid_mode(direction: Int[Array, ""]) -> Int[Array, ""]:
    return jnp.where(direction > 0, SLIP, SLIP_BACK)


def pick(condition: Any, yes: Any, no: Any) -> Any:
    """`jnp.where`, decided while tracing where the condition is known: a label of a band that is asked about."""
    if isinstance(condition, bool | np.bool_):
        found = yes if condition else no
        return np.float64(found) if isinstance(found, float) else found  # an array like all others
    return jnp.where(condition, yes, no)


class Sliding:
    """The label of a band that is asked about: it slides, ahead or `back`, and is known to do nothing else."""

    def __init__(self, back: Array):
        self.back = back

    def __eq__(self, label: object) -> Any:
        if label == BandMode.SLIP_BACK:
            return self.back
        return ~self.back if label == BandMode.SLIP else np.False_


def slips(band: Any) -> Any:
    return np.True_ if isinstance(band, Sliding) else (band == BandMode.SLIP) | (band == BandMode.SLIP_BACK)


class Label(NamedTuple):
    """What the log knows of a mode: band mode, and the internal pair of a staged brake (0: it sticks or is none)."""

    band: int
    inner: int = 0

    @property
    def rests(self) -> bool:
        """Whether the pulley is at rest."""
        return self.band == BandMode.HELD and self.inner == 0

    def __str__(self) -> str:
        words = BandMode(self.band).name.lower().replace("_", " ")
        return words if self.inner == 0 else f"{words} with internal slip"


def events_of_change(before: Label, after: Label, first: bool) -> list[str]:
    """Names of the events in one change of mode; `first` marks the settling at the start of a run."""
    names = _events_of_band(before, after, first) if before.band != after.band else []
    if before.inner == 0 and after.inner != 0:
        return (["restart"] if before.rests and after.band == BandMode.HELD else []) + ["internal_slip"] + names
    if before.inner != 0 and after.inner == 0:
        return names + (
            ["stop"] if after.rests and "stop" not in names else [] if after.rests else ["internal_restick"]
        )
    return names


def _events_of_band(before: Label, after: Label, first: bool) -> list[str]:
    slack = before.band in (BandMode.OPEN, BandMode.TAKE_UP)
    names = []
    if after.band == BandMode.OPEN:
        names.append("release")
    elif after.band == BandMode.HELD:
        if after.inner != 0:
            names.append("external_lock")
        elif not (first or before.band == BandMode.OPEN):
            names.append("stop")
    elif after.band in (BandMode.ELASTIC, BandMode.SLIP, BandMode.SLIP_BACK):
        if before.band == BandMode.HELD:
            names.append("external_release" if before.inner != 0 else "restart")
        elif slack:
            names.append("slip_onset")
        elif after.band == BandMode.ELASTIC:
            names.append("restick")
        if after.band != BandMode.ELASTIC:
            names.append("full_slip")
    return names
