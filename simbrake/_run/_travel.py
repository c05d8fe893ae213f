"""Linings that travel under the band: wear of the ring of a staged brake, lining by lining."""

import itertools
import math
from typing import Annotated, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre

from .._base._faults import Fault, InputError
from .._base._part import Whole, takes_values
from ..hybrid import SKIPPED
from ..hybrid._arrays import Array
from ._linings import WearRate, rubbing, wearing
from ._probe import Probe, probe_many, record_of
from ._result import Result

#: Gauss–Legendre points in every step, through which speed and wear rates are polynomials
_POINTS = 12
_HALVINGS = 55
_NODES, _WEIGHTS = (np.asarray(x) for x in legendre.leggauss(_POINTS))
_TO_SERIES = np.linalg.inv(legendre.legvander(_NODES, _POINTS - 1))


class RingWear(NamedTuple):
    """Depth worn off the linings of a ring that travels under the band.

    - `travel` `ψ` (rad) in the run;  `depth` (m,) of each lining of the ring (m), mean over its face
    - `stations` (n,): depth worn off at each station of the band (m): of linings that do not travel

    Example:
        >>> sb.results.RingWear(0.3, np.array([2e-6, 3e-6]), np.array([1e-6, 4e-6])).over_least
        (1.5, 4.0)
    """

    travel: float
    depth: Float[np.ndarray, " m"]
    stations: Float[np.ndarray, " n"]

    @property
    def over_least(self) -> tuple[float, float]:
        """Maximum over minimum wear, with and without travel; infinite where a lining has none."""
        ends = ((np.max(h), np.min(h)) for h in (self.depth, self.stations))
        with_travel, without = (float(most / least) if least > 0 else math.inf for most, least in ends)
        return with_travel, without


def overlaps(angle: Float[np.ndarray, " n"], count: int, psi: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k n m"]:
    """Angles (rad) by which `count` linings of a ring overlap stations of the central angles `angle` at the travel `ψ`.

    Stations begin at the slack end; lining `j = 0…m − 1` of the ring covers `[j, j + 1] 2π/m − ψ`.
    """
    width, begin = 2 * math.pi / count, np.cumsum(angle) - angle
    ahead = np.mod(width * np.arange(count) - psi[:, None, None] - begin[:, None], 2 * math.pi)
    return np.clip(angle[:, None] - ahead, 0, width) + np.clip(ahead + width - 2 * math.pi, 0, angle[:, None])


def _rates(result: Result, pair: str, rate: WearRate, index: np.ndarray, h: np.ndarray) -> tuple[Array, Array]:
    """Speed of the bandage and wear rates of the stations."""
    p: Probe = probe_many(record_of(result), index, h)
    worn = np.asarray(wearing(rate, rubbing(result.record, p, pair=pair)))  # pyright: ignore
    return np.asarray(p.shown.bandage_speed), worn


@takes_values
def ring_wear(
    result: Result,
    count: Annotated[int, Whole("number of linings of the ring", 1, 10_000)],
    rate: WearRate | None = None,
    *,
    pair: str = "external",
    start: float = 0.0,
) -> RingWear:
    """Wear of a staged brake whose linings are a full ring that travels under the band (K: change of position).

        ψ = ∫ ω_b dt,   h_j = (m/2π) ∫ Σ_i ḣ_i o_ij(ψ) dt,   ḣ_i = I p_i v_i

    Loads, speeds, temperatures and wear rates `ḣ_i` are those of the `n` fixed stations under the band, the scene's
    linings; lining `j` of the ring, at `θ_j − ψ` (the pulley runs on at the tight end, linings are counted from the
    slack end), takes from each as much as their arcs overlap (`o_ij`, rad). Overlaps of a station sum to `β_i`.

    - `count` `m`: linings of the ring; inertia and preload of the scene's bandage are then those of the whole ring, its
      masses those of the arcs `β_i`
    - `rate` `I`: as in `lining_wear`, `None`: that of the scene's wear;  `pair`: whose faces, `external` or `internal`
    - `start` (rad): travel before the run, as of earlier stops

    Integrals are exact between the corners of `o_ij`: `ψ` and `ḣ_i` are polynomials through 12 points of each step.
    Raises `InputError` for a brake without a bandage that is one body, a traced result, and missing areas or rate.
    """
    scene, brake = result.scene, result.scene.brake
    if not result.concrete:
        raise InputError([Fault("result", "is traced or a batch", "give one result with values")])
    if not brake.in_series or brake.resolved:
        raise InputError([Fault("brake", "has no ring of linings", "take a staged brake whose bandage is one body")])
    if brake.rubbing_part(pair).area is None:
        raise InputError([Fault(f"brake.{brake.pairs[pair].field}.area", "is missing", "wear depends on the pressure")])
    if rate is None:
        rate = None if scene.wear is None else scene.wear.rate if pair == "external" else scene.wear.internal
    if rate is None:
        raise InputError([Fault("rate", "is missing", "give a wear rate, or the scene a `Wear`")])
    record, angle = record_of(result), np.asarray(brake.linings.weights)
    steps = np.flatnonzero(np.asarray(record.rows.kind)[: int(record.count)] != SKIPPED)
    t = np.asarray(record.rows.t)
    span = t[steps + 1] - t[steps]
    h = (0.5 * (_NODES + 1) * span[:, None]).ravel()
    speed, worn = _rates(result, pair, rate, np.repeat(steps, _POINTS).astype(np.int32), h)
    # of every step Legendre series over −1…1 of the travel and of the wear rates
    speeds = np.tensordot(speed.reshape(-1, _POINTS), _TO_SERIES, axes=(1, 1)) * 0.5 * span[:, None]
    turning = legendre.legint(speeds, lbnd=-1, axis=1)
    rates = np.einsum("kp,spn->skn", _TO_SERIES, worn.reshape(len(steps), _POINTS, -1)) * 0.5 * span[:, None, None]
    gained = legendre.legval(1.0, turning.T)
    begins = start + np.cumsum(gained) - gained
    depth = np.zeros(count)
    for psi, series, own in zip(begins, turning, rates, strict=True):
        if np.any(own):
            depth += _worn_in(angle, count, psi, series, own)
    return RingWear(float(np.sum(gained)), depth * count / (2 * math.pi), 2 * np.sum(rates[:, 0], axis=0))


def _worn_in(angle: np.ndarray, count: int, psi: float, turning: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """`∫ Σ_i ḣ_i o_ij dt` (m·rad) over a step, from the series of its travel and of its wear rates."""
    width, edges = 2 * math.pi / count, np.append(0.0, np.cumsum(angle))
    low, high = sorted((psi, psi + legendre.legval(1.0, turning)))
    # an edge of the ring passes one of a station
    turns = np.arange(math.floor(low / width), math.ceil(high / width) + 2)
    corners = np.sort(np.ravel(np.mod(-edges, width) + width * turns[:, None]))
    corners = corners[(corners > low) & (corners < high)]
    way = 1.0 if turning[0] >= 0 or legendre.legval(1.0, turning) >= 0 else -1.0
    below, above = np.full(corners.shape, -1.0), np.ones(corners.shape)
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        before = way * (psi + legendre.legval(middle, turning) - corners) < 0
        below, above = np.where(before, middle, below), np.where(before, above, middle)
    ends = np.concatenate([[-1.0], np.sort(below), [1.0]])
    found = np.zeros(count)
    for a, b in itertools.pairwise(ends):
        x = 0.5 * (a + b) + 0.5 * (b - a) * _NODES
        share = overlaps(angle, count, psi + legendre.legval(x, turning))
        found += np.einsum("k,kn,knm->m", 0.5 * (b - a) * _WEIGHTS, legendre.legval(x, rates).T, share)
    return found
