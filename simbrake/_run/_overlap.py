"""Overlap coefficients of the friction pairs over time: which share of the track slides, which sticks."""

import math
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Float

from .._base._quantity import Scalar, quantity
from .._parts._design import Brake, under_a_band
from .._parts._scene import band_brake
from ._result import Result


class RunningIn(eqx.Module):
    """Contact that grows with the friction work `W` of a pair, as surfaces wear into one another (after K).

        c(W) = 1 − (1 − c_0) exp(−W/W_0)

    - `start` `c_0`: share of the nominal area in contact at first; `work` `W_0` (J) after which 63 % of the rest is won
    """

    start: Scalar = quantity("1", "share in contact at first", low=0.0, high=1.0)
    work: Scalar = quantity("J", "friction work of running-in", positive=True)

    def share(self, W: Any) -> Any:
        return 1 - (1 - np.asarray(self.start)) * np.exp(-np.asarray(W) / np.asarray(self.work))


class Overlap(NamedTuple):
    """Overlap coefficients at the times `t` (s); a standard brake has only those of linings on rim, the internal ones.

    Dynamic: share of the track area whose pair slides; static: share whose pair sticks (K, Fig. 5, in our reading).
    """

    t: Float[np.ndarray, " m"]
    external_dynamic: Float[np.ndarray, " m"] | None
    external_static: Float[np.ndarray, " m"] | None
    internal_dynamic: Float[np.ndarray, " m"]
    internal_static: Float[np.ndarray, " m"]


def geometric_overlap(brake: Brake) -> tuple[float | None, float]:
    """`Σ A_i/A_track` of the external pair (`None` on a standard brake) and of linings and rim; about 0.75 (S).

    Without areas or the rim's width the linings are taken to be as wide as the track: `Σ β_i/2π`. Raises `InputError`
    for a brake without a band.
    """
    brake = under_a_band(brake)
    n, width, wrap = brake.linings.count, brake.pulley.width, float(brake.linings.wrap) / (2 * math.pi)

    def share(area: Any, radius: Any) -> float:
        if area is None or width is None:
            return wrap
        return float(np.sum(np.broadcast_to(np.asarray(area), (n,))) / (2 * math.pi * radius * np.asarray(width)))

    # the last pair rubs on the rim, one before it on the band
    *outer, inner = (brake.rubbing_part(pair).area for pair in brake.pairs)
    return share(outer[0], brake.band.radius) if outer else None, share(inner, brake.pulley.radius)


def overlap(result: Result, ts: Any, running_in: RunningIn | None = None) -> Overlap:
    """Overlap coefficients of a concrete result at the times `ts` (m,), optionally with contact that grows by wear.

    Raises `InputError` for times outside the run, and for a brake without a band.
    """
    s, nominal = result.series(ts), geometric_overlap(band_brake(result.scene))
    found = []
    for pair, share in zip(s.pairs.values(), (one for one in nominal if one is not None), strict=True):
        grown = 1.0 if running_in is None else running_in.share(pair.friction_work)
        # a bandage without interference rests on the rim only while the band presses it
        share = share * grown * np.any(np.asarray(pair.normal_load) > 0, axis=1)
        slides = np.mean(np.asarray(pair.sense) != 0, axis=1)
        found.append((share * slides, share * (1 - slides)))
    *outer, inner = found
    external = outer[0] if outer else (None, None)
    return Overlap(np.asarray(s.t), external[0], external[1], inner[0], inner[1])
