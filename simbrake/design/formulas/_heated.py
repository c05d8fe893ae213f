"""Parts that a brake application heats: by the formulas, and in the hardest brake
application of a run."""

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from ...outputs.quantities import Series
from ...parts.scene import Scene
from ...runs.networks import with_temperatures
from ...runs.result import Result
from ...thermal.heat import Heat, initial_temperatures, node_names
from ...thermal.materials import Material
from ...thermal.network import Wall, place_of
from .contact import Depths, Profiles, SeriesOfTimes
from .heating import (
    SchmidtCourse,
    effective_volume,
    heat_content,
    mean_bulk_rise,
    penetration_depth,
    schmidt,
)
from .inputs import wall_at

_TIMES = 2048  # times at which a run, and its hardest brake application, are evaluated


class WallCourse(NamedTuple):
    """Layers (m, k) of a wall in K from the named face on, mean of its copies; depth
    and thickness (k,) of each (m)."""

    wall: Wall
    layers: Profiles
    depth: Depths
    steps: Depths

    def mean(self, depth: float = math.inf) -> SeriesOfTimes:
        """Mean temperature (K) down to a depth (m), weighted with the thickness of the
        layers inside it."""
        inside = self.inside(depth)
        return self.layers @ inside / np.sum(inside)

    def inside(self, depth: float) -> Depths:
        """Part of each layer's thickness (m) within a depth."""
        ends = np.cumsum(self.steps)
        return np.clip(depth - (ends - self.steps), 0.0, self.steps)

    @property
    def content(self) -> SeriesOfTimes:
        """Heat per area (J/m²) above that of the first row, with the material's
        temperature dependence."""
        return (
            np.asarray(heat_content(self.wall.material, self.layers[:1], self.layers))
            @ self.steps
        )


def wall_course(heat: Heat, s: Series, place: str | None) -> WallCourse | None:
    """The wall at whose face a place is, over a concrete series; `None` where that is
    no wall."""
    wall = wall_at(heat, place)
    if place is None or wall is None or s.temperature is None:
        return None
    first = [wall.name, f"{wall.name}[1]", f"{wall.name}[1,1]"]
    at = next(i for i, node in enumerate(node_names(heat)) if node in first)
    layers = (
        np.asarray(s.temperature)[:, at : at + wall.count]
        .reshape(-1, wall.copies, wall.layers)
        .mean(axis=1)
    )
    steps = np.asarray(wall.steps)
    if place_of(place)[1] == "back":
        layers = layers[:, ::-1]
        steps = steps[::-1]
    return WallCourse(wall, layers, np.cumsum(steps) - 0.5 * steps, steps)


@dataclasses.dataclass(frozen=True)
class HeatedPart:
    """One part that a brake application heats: steps 1, 2, 3 and 5 of the synthesis (SI
    units).

    `share` of the heat `work` (J) goes into it, and `more` (J) of another pair; `start`
    (K): its temperature before; `course`: its simulation. From these: thermal
    penetration `depth`, `volume` and `mass` that take up heat, mean `rise` of the bulk
    temperature and that itself, `bulk`.
    """

    name: str
    material: Material
    thickness: float
    area: float
    time: float
    start: float
    share: float
    work: float
    more: float = 0.0
    course: WallCourse | None = None

    @property
    def diffusivity(self) -> float:
        return float(self.material.diffusivity)

    @property
    def depth(self) -> float:
        return float(penetration_depth(self.diffusivity, self.time))

    @property
    def volume(self) -> float:
        return float(effective_volume(self.area, self.thickness, self.depth))

    @property
    def mass(self) -> float:
        return self.volume * self.material.density

    @functools.cached_property
    def rise(self) -> float:
        heat = self.share * self.work + self.more
        return float(mean_bulk_rise(1.0, heat, self.material.specific_heat, self.mass))

    @property
    def bulk(self) -> float:
        return self.start + self.rise

    @property
    def simulated_bulk(self) -> float | None:
        """Bulk temperature (K) in the run, mean over the depth and the brake
        application."""
        course = self.course
        return course and np.mean(course.mean(self.depth)).item()


@dataclasses.dataclass(frozen=True)
class RunValues:
    """The brake application of a run with the maximum friction work, or one pair's part
    of it, at m times.

    - `series`: columns at these times; `result`: the run
    - `work`, `other_work` (m,): friction work since its start (J) of all pairs or of
      the `pair`, and of the other pair; `omega` (rad/s) and `torque` (N·m) over it
    - `brakings`: how many stretches of sliding the run has; `total_work` of all of them
      (J)
    """

    result: Result
    series: Series
    pair: str
    work: SeriesOfTimes
    other_work: SeriesOfTimes
    omega: SeriesOfTimes
    torque: SeriesOfTimes
    brakings: int
    total_work: float

    @property
    def t(self) -> SeriesOfTimes:
        """Times (s)."""
        return np.asarray(self.series.t)

    @property
    def duration(self) -> float:
        """Time over which friction works (s)."""
        return self.t[-1] - self.t[0]

    @property
    def slid(self) -> float:
        """Sliding distance of the linings on the track (m)."""
        return float(np.trapezoid(np.abs(self.series.slip_speed), self.t))

    @functools.cached_property
    def rim(self) -> WallCourse | None:
        """The rim, where it is a wall in layers."""
        heat = self.result.scene.network
        return wall_course(heat, self.series, heat.rim)

    @functools.cached_property
    def lining(self) -> WallCourse | None:
        """The linings, where they are walls in layers."""
        heat = self.result.scene.network
        return wall_course(heat, self.series, heat.linings)

    @functools.cached_property
    def then(self) -> Scene:
        """The scene with the speed, time and temperatures at the beginning of this
        brake application."""
        scene = self.result.scene
        s = self.series
        initial = dataclasses.replace(
            scene.initial,
            omega=np.asarray(self.omega[0]),
            time=np.asarray(self.t[0]),
            elongation=np.asarray(0.0),
        )
        scene = dataclasses.replace(scene, initial=initial)
        if s.temperature is None:
            return scene
        stores = s.temperature[0, : initial_temperatures(scene.network).size]
        return dataclasses.replace(scene, heat=with_temperatures(scene.network, stores))

    @property
    def face(self) -> float | None:
        """Maximum temperature of the linings' face (K), of the rim's where only that is
        known."""
        s = self.series
        face = (
            s.rim_temperature if s.lining_temperature is None else s.lining_temperature
        )
        return None if face is None else np.max(face)

    @property
    def band(self) -> SeriesOfTimes | None:
        """Mean temperature of the band (K)."""
        band = self.series.band_temperature
        return None if band is None else np.asarray(band).mean(axis=1)

    @property
    def layered(self) -> bool:
        """Whether the rim is the metal face, and one wall in layers: all below needs
        that."""
        single = (
            self.rim is not None
            and self.rim.wall.copies == 1
            and self.series.rim_temperature is not None
        )
        return single and self.pair != "external"

    @property
    def course(self) -> WallCourse:
        """Temperatures of the rim's layers."""
        assert self.rim is not None
        return self.rim

    @property
    def surface(self) -> SeriesOfTimes:
        """Temperature of its face (K)."""
        return np.asarray(self.series.rim_temperature)[:, 0]

    @property
    def gradient(self) -> float:
        """Maximum gradient (K/m) at the face."""
        return np.max((self.surface - self.course.layers[:, 0]) / self.course.depth[0])

    @property
    def at_peak(self) -> tuple[float, float, float]:
        """Relative time, power and work at the maximum temperature of the face."""
        i = int(np.argmax(self.surface))
        power = np.gradient(self.work, self.t)
        last = self.work[-1]
        return (
            (self.t[i] - self.t[0]) / self.duration,
            power[i] * self.duration / last,
            self.work[i] / last,
        )

    @property
    def profile_depth(self) -> Depths:
        """Depths (p,) of `profile`: the face, the layers' centres, and the back (m)."""
        return np.concatenate([[0.0], self.course.depth, [np.sum(self.course.steps)]])

    @property
    def profile(self) -> Profiles:
        """Temperature (K) over the depth from face to back, the back face as its
        layer."""
        layers = self.course.layers
        return np.concatenate([self.surface[:, None], layers, layers[:, -1:]], axis=1)

    @property
    def drop(self) -> float:
        """Maximum difference between face and back (K)."""
        return np.max(self.profile[:, 0] - self.profile[:, -1])

    def schmidt(
        self, material: Material, share: float, area: float, beyond: float = 0.0
    ) -> SchmidtCourse:
        """Schmidt's scheme with the friction work of the run, from its temperatures at
        the start; adiabatic otherwise.

        - `material` of the rim; `share` of the friction heat into it; `area` (m²) of
          the track; `beyond`: share of the other pair's heat
        """
        heat = share * self.work + beyond * self.other_work
        thickness = self.course.wall.thickness
        layers = schmidt_layers(material, thickness, self.duration)
        depth = thickness * (np.arange(layers) + 0.5) / layers

        def flux(t0: float, t1: float) -> float:
            ends = self.t[0] + np.array([t0, t1])
            (gained,) = np.diff(np.interp(ends, self.t, heat))
            return gained / (area * (t1 - t0))

        start = np.interp(depth, self.profile_depth, self.profile[0])
        return schmidt(material, thickness, layers, self.duration, flux, start=start)


def schmidt_layers(material: Material, thickness: float, time: float) -> int:
    """Layers for Schmidt's scheme over a `time` (s): at most some 20,000 steps."""
    return int(
        np.clip(math.sqrt(1e4 / (material.diffusivity * time / thickness**2)), 8, 100)
    )


def _hardest(t: np.ndarray, work: np.ndarray) -> tuple[int, int, int] | None:
    """First and last index of the stretch over which friction works most, and how many
    such stretches there are."""
    works = np.diff(work) > 1e-9 * max(work[-1] - work[0], 1e-300)
    edges = np.flatnonzero(np.diff(works.astype(int), prepend=0, append=0))
    stretches = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    if not stretches:
        return None
    first, last = max(stretches, key=lambda ends: work[ends[1]] - work[ends[0]])
    return first, last, len(stretches)


def _sliding(s: Series, pair: str) -> tuple[np.ndarray, np.ndarray]:
    """Speed (rad/s) of one body of a pair in the other, and the torque between them
    (N·m)."""
    omega = np.asarray(s.omega)
    torque = np.asarray(s.brake_torque)
    if not pair:
        return omega, torque
    carried = np.asarray(s.bandage_speed)
    torque = np.asarray(s.pairs[pair].torque)
    if pair == "external":
        return carried, torque
    return omega - carried, np.abs(torque)


def run_values(
    result: Result, pair: str = "", *, times: int = _TIMES
) -> RunValues | None:
    """The hardest brake application of a result, or the part of it in which one `pair`
    of a staged brake slides most.

    `pair`: `"external"` or `"internal"`; `times`: evaluated at so many. `None` where no
    lining slid.
    """

    def worked(s: Series) -> np.ndarray:
        return np.asarray(s.pairs[pair].friction_work if pair else s.friction_work)

    start = float(result.scene.initial.time)
    end = float(result.record.t_end)
    known = [event.time for event in result.events]
    s = result.series(np.union1d(np.linspace(start, end, times), known))
    t = np.asarray(s.t)
    work = worked(s)
    hardest = _hardest(t, np.asarray(s.friction_work))
    if hardest is None:
        return None
    first, last, count = hardest
    if pair:
        own = _hardest(t[first : last + 1], work[first : last + 1])
        if own is None:
            return None
        first, last = first + own[0], first + own[1]
    s = result.series(np.linspace(t[first], t[last], times))
    inside = worked(s)
    whole = s.friction_work
    inside = inside - inside[0]
    return RunValues(
        result,
        s,
        pair,
        inside,
        whole - whole[0] - inside,
        *_sliding(s, pair),
        count,
        work[-1] - work[0],
    )
