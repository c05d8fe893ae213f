"""The modes of the standard brake: which one holds, in a table and in one decision."""

import enum
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Float, Int

from .._hybrid._arrays import Array


class BandMode(enum.IntEnum):
    """What the band does (model §3)."""

    OPEN = 0
    TAKE_UP = 1
    ELASTIC = 2
    SLIP = 3
    SLIP_BACK = 4
    HELD = 5


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


class Mode(NamedTuple):
    """Band mode, direction of motion (±1), and the pieces on which the given profiles are.

    `locks`: whether a lining locks itself, where that can change (else `None`); `heat_pieces`: of profiles in the heat.

    A staged brake has `inner`: 0 while the internal pair sticks, ±1 the sign of `ω − ω_b` while it slides, and `piece`:
    the number of linings at their limit, as `_band.piece_of` counts them. Its `band` is what the band does to the
    bandage (`HELD`: the bandage is at rest).
    """

    band: Any
    sense: Any
    lever_piece: Any
    load_piece: Any
    locks: Any = None
    heat_pieces: tuple[Any, ...] = ()
    inner: Any = None
    piece: Any = None

    @property
    def slides(self) -> Any:
        """The internal pair of a staged brake: 0 while it sticks (or there is none), else ±1."""
        return 0 * self.band if self.inner is None else self.inner

    @property
    def contacts(self) -> dict[str, Any]:
        """What every lining does for itself, (n,) each: nothing where they act as one."""
        return {}


class Situation(NamedTuple):
    """What decides on a mode at one instant; tensions in N, speeds of the band circle in m/s."""

    tension: Float[Array, ""]  # of the tight end, as the elongation has it
    high: Float[Array, ""]  # limits of that tension
    low: Float[Array, ""]
    slip_ahead: Float[Array, ""]  # slip speed if the band slid with the anchor end tight
    slip_back: Float[Array, ""]  # the same with the lever end tight
    tolerance: Float[Array, ""]  # tension differences below it are rounding


def moving_mode(s: Situation, direction: Int[Array, ""]) -> Int[Array, ""]:
    """Mode of an elastic band that is taut while the pulley moves, or starts to, in `direction`.

    At a limit of the tension it slides if the slip speed it would have has the right sign; with no slip speed yet, the
    direction in which the pulley starts decides. With `T_0 = 0` both limits are 0 and the speeds alone decide: this
    is the answer for a ramp from exactly 0.
    """
    at_high = s.tension >= s.high - s.tolerance
    at_low = s.tension <= s.low + s.tolerance
    ahead = at_high & ((s.slip_ahead > 0) | ((s.slip_ahead == 0) & (direction > 0)))
    back = at_low & ((s.slip_back < 0) | ((s.slip_back == 0) & (direction < 0)))
    return jnp.where(ahead, BandMode.SLIP, jnp.where(back, BandMode.SLIP_BACK, BandMode.ELASTIC))


def rigid_mode(direction: Int[Array, ""]) -> Int[Array, ""]:
    return jnp.where(direction > 0, BandMode.SLIP, BandMode.SLIP_BACK)


def slips(band: Any) -> Any:
    return (band == BandMode.SLIP) | (band == BandMode.SLIP_BACK)


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
