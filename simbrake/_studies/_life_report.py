"""What a computation of the linings' life gives back: brakings, which lining is first, and the history."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np


class LifeHistory(NamedTuple):
    """The life in steps of many brakings, `m` instants; at a turn of the band one before and one after it.

    Linings are counted from the slack end at the start of the life, and keep their number when the band is turned.
    """

    brakings: np.ndarray  # (m,) done so far
    worn: np.ndarray  # (m, n) thickness worn off so far, m
    per_braking: np.ndarray  # (m, n) thickness that the next braking takes, m
    stopping_time: np.ndarray  # (m,) of the next braking, s; inf where it does not stop


@dataclasses.dataclass(frozen=True)
class LiningLife:
    """Brakings until the linings are worn.

    - `brakings`: until the first lining has reached its permissible wear;  `first`: which one (from 1)
    - `each` (n,): until lining `i` would have, with the others left in place: those that last longer go on at the rate
      of the last braking
    - `permissible` (n,) in m;  `turned_at`: after how many brakings the band was turned end for end
    - `unturned`: the life without turning, where the best moment was sought
    - `history`;  `runs`: brakings that were simulated
    """

    brakings: float
    first: int
    each: np.ndarray
    permissible: np.ndarray
    turned_at: tuple[float, ...]
    unturned: float | None
    history: LifeHistory
    runs: int

    @property
    def gain(self) -> float | None:
        """Life over that without turning."""
        return None if self.unturned is None else self.brakings / self.unturned

    @property
    def worn(self) -> np.ndarray:
        """Thickness (n,) worn off at the end of the life (m)."""
        return self.history.worn[-1]

    @property
    def over_mean(self) -> np.ndarray:
        """Greatest over mean wear per braking (m,), over the life."""
        w = self.history.per_braking
        return w.max(axis=1) / w.mean(axis=1)

    @property
    def over_least(self) -> np.ndarray:
        """Greatest over least wear per braking (m,), over the life."""
        w = self.history.per_braking
        with np.errstate(divide="ignore"):
            return w.max(axis=1) / w.min(axis=1)

    @property
    def used(self) -> float:
        """Share of what may be worn off the linings that is worn off at the end: 1 where all end together."""
        return float((self.worn / self.permissible).mean())

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain values of JSON."""
        h = self.history
        return {
            "brakings": self.brakings,
            "first": self.first,
            "each": [_plain(x) for x in self.each],
            "permissible": self.permissible.tolist(),
            "turned_at": list(self.turned_at),
            "unturned": self.unturned,
            "gain": self.gain,
            "used": self.used,
            "runs": self.runs,
            "history": {
                "brakings": h.brakings.tolist(),
                "worn": h.worn.tolist(),
                "per_braking": h.per_braking.tolist(),
                "stopping_time": [_plain(x) for x in h.stopping_time],
                "over_mean": [_plain(x) for x in self.over_mean],
                "over_least": [_plain(x) for x in self.over_least],
            },
        }

    def __str__(self) -> str:
        h, n = self.history, len(self.each)
        lines = [
            f"life     {self.brakings:.0f} brakings, until lining {self.first} of {n} has lost "
            f"{1e3 * self.permissible[self.first - 1]:.4g} mm",
        ]
        for at in self.turned_at:
            lines.append(f"turned   end for end after {at:.0f} brakings")
        if self.gain is not None:
            lines.append(f"gain     {self.gain:.4g} times the life without turning ({self.unturned:.0f} brakings)")
        lines += [
            f"uneven   greatest wear of a braking {self.over_mean[0]:.4g} times the mean and {self.over_least[0]:.4g} "
            f"times the least at first, {self.over_mean[-1]:.4g} and {self.over_least[-1]:.4g} times at the end",
            f"used     {100 * self.used:.1f} % of what may be worn off all linings",
            f"{'lining':>8}{'worn, mm':>12}{'a braking, µm':>16}{'brakings left':>16}",
        ]
        left = np.maximum(self.each - self.brakings, 0.0)
        for i in range(n):
            last = f"{left[i]:.0f}" if np.isfinite(left[i]) else "—"
            lines.append(f"{i + 1:>8}{1e3 * self.worn[i]:>12.4f}{1e6 * h.per_braking[-1, i]:>16.4f}{last:>16}")
        if np.ptp(h.stopping_time[np.isfinite(h.stopping_time)]) > 0:
            lines.append(f"stop     after {h.stopping_time[0]:.5g} s at first, {h.stopping_time[-1]:.5g} s at the end")
        lines.append(f"solver   {self.runs} brakings simulated")
        return "\n".join(lines)


def _plain(x: Any) -> float | None:
    return float(x) if np.isfinite(x) else None
