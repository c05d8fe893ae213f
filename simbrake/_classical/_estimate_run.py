"""What a simulated run says where an engineering estimate says something: the hardest braking, temperatures, stress."""

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from .._run._result import Result
from .._run._series import Series
from ._schmidt import SchmidtCourse, schmidt
from ._thermal_stress import ElasticMaterial, StressHistory, stress_over_time
from ._wall_course import wall_course

_LOOKS = 2048  # times at which a run, and its hardest braking, are looked at


@dataclasses.dataclass(frozen=True)
class RunValues:
    """Columns over the hardest braking of a run, that with the greatest friction work, or over one pair's part of it.

    - `t` (m,) in s; `work` (m,) friction work since its start (J); `omega` (rad/s) and `torque` (N·m) over it
    - `surface` (m,), `layers` (m, k): temperatures (K) of the rim's face and of its layers, `depth` (k,) of their
      centres (m), `steps` (k,) their thickness; `None` where the scene has no rim in layers (external pair: the band)
    - `body` (m,): mean temperature (K) of a band that is one lump; `other_work` (m,): what the other pair works (J)
    - `brakings`: how many stretches of sliding there were; `total_work` of all of them (J)
    """

    t: Float[np.ndarray, " m"]
    work: Float[np.ndarray, " m"]
    omega: Float[np.ndarray, " m"]
    torque: Float[np.ndarray, " m"]
    surface: Float[np.ndarray, " m"] | None
    layers: Float[np.ndarray, "m k"] | None
    depth: Float[np.ndarray, " k"] | None
    steps: Float[np.ndarray, " k"] | None
    brakings: int
    total_work: float
    body: Float[np.ndarray, " m"] | None = None
    other_work: Float[np.ndarray, " m"] | None = None

    @property
    def duration(self) -> float:
        """Time over which friction works (s)."""
        return float(self.t[-1] - self.t[0])

    @property
    def profile_depth(self) -> Float[np.ndarray, " p"]:
        """Depths (p,) of `profile`: the face, the layers' centres, and the back."""
        assert self.depth is not None
        assert self.steps is not None
        return np.concatenate([[0.0], self.depth, [np.sum(self.steps)]])

    @property
    def profile(self) -> Float[np.ndarray, "m p"]:
        """Temperature (K) over the depth from face to back, the back face as its layer."""
        assert self.surface is not None
        assert self.layers is not None
        return np.concatenate([self.surface[:, None], self.layers, self.layers[:, -1:]], axis=1)

    def mean(self, depth: float = math.inf) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) down to a depth (m), by the shares of the layers inside it; of a lump its own."""
        if self.body is not None:
            return self.body
        assert self.layers is not None
        assert self.steps is not None
        ends = np.cumsum(self.steps)
        inside = np.clip(depth - (ends - self.steps), 0.0, self.steps)
        return self.layers @ inside / np.sum(inside)

    def stress(self, elastic: ElasticMaterial) -> StressHistory:
        """Thermal stress of the rim over the braking."""
        return stress_over_time(self.t, self.profile, self.profile_depth, elastic)


def _brakings(t: Any, work: Any) -> list[tuple[int, int]]:
    """First and last index of every stretch over which friction works."""
    works = np.diff(work) > 1e-9 * max(float(work[-1] - work[0]), 1e-300)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], works, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _work(s: Series, pair: str) -> np.ndarray:
    """Friction work (J) of a pair, `""`: of all."""
    return np.asarray(s.pairs[pair].friction_work if pair else s.friction_work)


def _sliding(s: Series, pair: str) -> tuple[np.ndarray, np.ndarray]:
    """Speed (rad/s) of one body of a pair in the other, and the torque between them (N·m)."""
    omega, torque = np.asarray(s.omega), np.asarray(s.brake_torque)
    if not pair:
        return omega, torque
    carried, torque = np.asarray(s.bandage_speed), np.asarray(s.pairs[pair].torque)
    return (carried, torque) if pair == "external" else (omega - carried, np.abs(torque))


def _hardest(t: np.ndarray, work: np.ndarray) -> tuple[int, int, int] | None:
    """First and last index of the stretch with the greatest work, and how many there are."""
    found = _brakings(t, work)
    if not found:
        return None
    return *max(found, key=lambda ends: float(work[ends[1]] - work[ends[0]])), len(found)


def run_values(result: Result, pair: str = "", *, looks: int = _LOOKS) -> RunValues | None:
    """The hardest braking of a concrete result, or the part of it in which one `pair` of a staged brake slides most.

    `pair`: `"external"` or `"internal"`; `looks`: at so many times. `None` where nothing ever slid.
    """
    start, end = float(result.scene.initial.time), float(result.record.t_end)
    known = [event.time for event in result.events]
    s = result.series(np.unique(np.concatenate([np.linspace(start, end, looks), known])))
    t, work = np.asarray(s.t), _work(s, pair)
    found = _hardest(t, np.asarray(s.friction_work))
    if found is None:
        return None
    first, last, count = found
    if pair:
        own = _hardest(t[first : last + 1], work[first : last + 1])
        if own is None:
            return None
        first, last = first + own[0], first + own[1]
    s = result.series(np.linspace(t[first], t[last], looks))
    inside, (omega, torque) = _work(s, pair), _sliding(s, pair)
    inside = inside - inside[0]
    other = None
    if pair:
        whole = np.asarray(s.friction_work)
        other = whole - whole[0] - inside
    columns = _band_columns(result, s) if pair == "external" else _rim_columns(result, s)
    total = float(work[-1] - work[0])
    return RunValues(np.asarray(s.t), inside, omega, torque, *columns[:4], count, total, columns[4], other)


def _rim_columns(result: Result, s: Any) -> tuple[Any, Any, Any, Any, None]:
    """Face, layers, their depths and thicknesses of a rim in layers."""
    heat = result.scene.network
    course = wall_course(heat, s, heat.rim)
    if course is None or course.wall.copies != 1 or s.rim_temperature is None:
        return None, None, None, None, None
    return np.asarray(s.rim_temperature)[:, 0], course.layers, course.depth, course.steps, None


def _band_columns(result: Result, s: Any) -> tuple[None, None, None, None, Any]:
    """The mean temperature of the band."""
    band = s.band_temperature
    return None, None, None, None, None if band is None else np.asarray(band).mean(axis=1)


def schmidt_of_run(run: RunValues, wall: Any, share: float, area: float, beyond: float = 0.0) -> SchmidtCourse:
    """Schmidt's scheme with the friction work of a run and its rim at the start of the braking; adiabatic otherwise.

    - `wall`: the rim; `share` of the friction heat into it; `area` (m²) of the track; `beyond`: share of the other
      pair's heat
    """
    heat = share * run.work
    if run.other_work is not None:
        heat = heat + beyond * run.other_work
    thickness, a = float(wall.thickness), float(wall.material.diffusivity)
    Fo = a * run.duration / thickness**2
    layers = int(np.clip(math.sqrt(1e4 / Fo), 8, 100))  # at most some 20,000 steps
    depth = thickness * (np.arange(layers) + 0.5) / layers

    def flux(t0: float, t1: float) -> float:
        gained = np.interp(run.t[0] + t1, run.t, heat) - np.interp(run.t[0] + t0, run.t, heat)
        return float(gained / (area * (t1 - t0)))

    start = np.interp(depth, run.profile_depth, run.profile[0])
    return schmidt(wall.material, thickness, layers, run.duration, flux, start=start)
