"""What a simulated run says where an engineering estimate says something: the hardest braking, temperatures, stress."""

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from .._parts._heat import node_names
from .._parts._network import place_of
from .._run._result import Result
from ._estimate_data import rim_wall
from ._schmidt import SchmidtCourse, schmidt
from ._thermal_stress import ElasticMaterial, StressHistory, stress_over_time

_LOOKS = 2048  # times at which a run, and its hardest braking, are looked at


@dataclasses.dataclass(frozen=True)
class RunValues:
    """Columns over the hardest braking of a run, that with the greatest friction work.

    - `t` (m,) in s; `work` (m,) friction work since its start (J); `omega` (rad/s) and `torque` (N·m) over it
    - `surface` (m,), `layers` (m, k): temperatures (K) of the rim's face and of its layers, `depth` (k,) of their
      centres (m), `steps` (k,) their thickness; `None` where the scene has no rim in layers
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
        """Mean temperature (K) of the rim down to a depth (m), by the shares of the layers inside it."""
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


def run_values(result: Result, *, looks: int = _LOOKS) -> RunValues | None:
    """The hardest braking of a concrete result at so many `looks`; `None` where nothing ever slid."""
    start, end = float(result.scene.initial.time), float(result.record.t_end)
    known = [event.time for event in result.events]
    s = result.series(np.unique(np.concatenate([np.linspace(start, end, looks), known])))
    t, work = np.asarray(s.t), np.asarray(s.friction_work)
    found = _brakings(t, work)
    if not found:
        return None
    first, last = max(found, key=lambda ends: float(work[ends[1]] - work[ends[0]]))
    s = result.series(np.linspace(t[first], t[last], looks))
    inside, wall = np.asarray(s.friction_work), rim_wall(result.scene)
    layers = depth = steps = surface = None
    if wall is not None and wall.copies == 1 and s.temperature is not None and s.rim_temperature is not None:
        heat = result.scene.heat
        assert heat is not None
        assert heat.rim is not None
        name, face = place_of(heat.rim)
        names = node_names(heat)
        at = names.index(f"{name}[1]" if wall.layers > 1 else name)
        layers, steps = np.asarray(s.temperature)[:, at : at + wall.layers], np.asarray(wall.steps)
        if face == "back":
            layers, steps = layers[:, ::-1], steps[::-1]
        depth, surface = np.cumsum(steps) - 0.5 * steps, np.asarray(s.rim_temperature)[:, 0]
    omega, torque = np.asarray(s.omega), np.asarray(s.brake_torque)
    total = float(work[-1] - work[0])
    return RunValues(
        np.asarray(s.t), inside - inside[0], omega, torque, surface, layers, depth, steps, len(found), total
    )


def schmidt_of_run(run: RunValues, wall: Any, share: float, area: float) -> SchmidtCourse:
    """Schmidt's scheme with the friction work of a run and its rim at the start of the braking; adiabatic otherwise.

    - `wall`: the rim; `share` of the friction heat into it; `area` (m²) of the track
    """
    thickness, a = float(wall.thickness), float(wall.material.diffusivity)
    Fo = a * run.duration / thickness**2
    layers = int(np.clip(math.sqrt(1e4 / Fo), 8, 100))  # at most some 20,000 steps
    depth = thickness * (np.arange(layers) + 0.5) / layers

    def flux(t0: float, t1: float) -> float:
        gained = np.interp(run.t[0] + t1, run.t, run.work) - np.interp(run.t[0] + t0, run.t, run.work)
        return float(share * gained / (area * (t1 - t0)))

    start = np.interp(depth, run.profile_depth, run.profile[0])
    return schmidt(wall.material, thickness, layers, run.duration, flux, start=start)
