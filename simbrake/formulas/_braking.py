"""The braking that estimates are of: what its run shows, its inputs, its classical stop, and what it heats."""

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._parts._scene import Scene, band_brake
from .._run._networks import with_temperatures
from .._run._result import Result
from .._run._series import Series
from ..thermal._heat import FlashTemperature, Heat, PowerShares, initial_temperatures, node_names
from ..thermal._material import Material
from ..thermal._network import Wall, place_of
from ._inputs import Input, rim_wall
from ._rows import Absent, there
from .contact import radiation_coefficient
from .heating import (
    ElasticMaterial,
    HeatBalance,
    SchmidtCourse,
    StressHistory,
    effective_fourier_number,
    effective_volume,
    heat_balance,
    heat_content,
    mean_bulk_rise,
    penetration_depth,
    schmidt,
    slab_rise,
    stopping_rise,
    stress_over_time,
    surface_stress,
)
from .stop import ClassicalStop, StagedStop, friction_at_start, internal_friction_at_start

_TIMES = 2048  # times at which a run, and its hardest braking, are evaluated


# --- simulated --------------------------------------------------------------------------------------------------------


class WallCourse(NamedTuple):
    """Layers (m, k) of a wall in K from the named face on, mean of its copies; depth and thickness (k,) of each (m)."""

    wall: Wall
    layers: Float[np.ndarray, "m k"]
    depth: Float[np.ndarray, " k"]
    steps: Float[np.ndarray, " k"]

    def mean(self, depth: float = math.inf) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) down to a depth (m), weighted with the thickness of the layers inside it."""
        inside = self.inside(depth)
        return self.layers @ inside / np.sum(inside)

    def inside(self, depth: float) -> Float[np.ndarray, " k"]:
        """How much of each layer's thickness (m) lies within a depth."""
        ends = np.cumsum(self.steps)
        return np.clip(depth - (ends - self.steps), 0.0, self.steps)

    @property
    def content(self) -> Float[np.ndarray, " m"]:
        """Heat per area (J/m²) above that of the first row, with the material's temperature dependence."""
        return heat_content(self.wall.material, self.layers[:1], self.layers) @ self.steps


def wall_course(heat: Heat, s: Series, place: str | None) -> WallCourse | None:
    """The wall at whose face a place is, over a concrete series; `None` where that is no wall."""
    if place is None or s.temperature is None:
        return None
    name, face = place_of(place)
    wall = next(body for body in heat.bodies if body.name == name)
    if not isinstance(wall, Wall):
        return None
    first = [wall.name, f"{wall.name}[1]", f"{wall.name}[1,1]"]
    at = next(i for i, node in enumerate(node_names(heat)) if node in first)
    layers = np.asarray(s.temperature)[:, at : at + wall.count].reshape(-1, wall.copies, wall.layers).mean(axis=1)
    steps = np.asarray(wall.steps)
    if face == "back":
        layers, steps = layers[:, ::-1], steps[::-1]
    return WallCourse(wall, layers, np.cumsum(steps) - 0.5 * steps, steps)


@dataclasses.dataclass(frozen=True)
class RunValues:
    """The hardest braking of a run, that with the maximum friction work, or one pair's part of it, at m times.

    - `series`: columns at these times; `scene`: of the run
    - `work`, `other_work` (m,): friction work since its start (J) of all pairs or of the `pair`, and of the other pair;
      `omega` (rad/s) and `torque` (N·m) over it
    - `brakings`: how many stretches of sliding the run has; `total_work` of all of them (J)
    """

    scene: Scene
    series: Series
    pair: str
    work: Float[np.ndarray, " m"]
    other_work: Float[np.ndarray, " m"]
    omega: Float[np.ndarray, " m"]
    torque: Float[np.ndarray, " m"]
    brakings: int
    total_work: float

    @property
    def t(self) -> Float[np.ndarray, " m"]:
        """Times (s)."""
        return np.asarray(self.series.t)

    @property
    def duration(self) -> float:
        """Time over which friction works (s)."""
        return float(self.t[-1] - self.t[0])

    @functools.cached_property
    def rim(self) -> WallCourse | None:
        """The rim, where it is a wall in layers."""
        return wall_course(self.scene.network, self.series, self.scene.network.rim)

    @functools.cached_property
    def lining(self) -> WallCourse | None:
        """The linings, where they are walls in layers."""
        return wall_course(self.scene.network, self.series, self.scene.network.linings)

    @functools.cached_property
    def then(self) -> Scene:
        """The scene as this braking finds it: speed, time and temperatures at its beginning."""
        scene, s = self.scene, self.series
        initial = dataclasses.replace(
            scene.initial, omega=np.asarray(self.omega[0]), time=np.asarray(self.t[0]), elongation=np.asarray(0.0)
        )
        scene = dataclasses.replace(scene, initial=initial)
        if s.temperature is None:
            return scene
        stores = np.asarray(s.temperature)[0, : initial_temperatures(scene.network).size]
        return dataclasses.replace(scene, heat=with_temperatures(scene.network, stores))

    @property
    def face(self) -> float | None:
        """Maximum temperature of the linings' face (K), of the rim's where only that is known."""
        known = [c for c in (self.series.lining_temperature, self.series.rim_temperature) if c is not None]
        return float(np.max(np.asarray(known[0]))) if known else None

    @property
    def band(self) -> Float[np.ndarray, " m"] | None:
        """Mean temperature of the band (K)."""
        band = self.series.band_temperature
        return None if band is None else np.asarray(band).mean(axis=1)

    # the rim, where it is what rubs and one wall in layers; absent else

    @property
    def course(self) -> WallCourse:
        """Its layers."""
        return there(self.rim if self.layered else None)

    @property
    def layered(self) -> bool:
        """Whether there is one."""
        one = self.rim is not None and self.rim.wall.copies == 1 and self.series.rim_temperature is not None
        return one and self.pair != "external"

    @property
    def surface(self) -> Float[np.ndarray, " m"]:
        """Temperature of its face (K)."""
        return np.asarray(there(self.series.rim_temperature if self.layered else None))[:, 0]

    @property
    def profile_depth(self) -> Float[np.ndarray, " p"]:
        """Depths (p,) of `profile`: the face, the layers' centres, and the back (m)."""
        return np.concatenate([[0.0], self.course.depth, [np.sum(self.course.steps)]])

    @property
    def profile(self) -> Float[np.ndarray, "m p"]:
        """Temperature (K) over the depth from face to back, the back face as its layer."""
        layers = self.course.layers
        return np.concatenate([self.surface[:, None], layers, layers[:, -1:]], axis=1)

    @property
    def drop(self) -> float:
        """Maximum difference between face and back (K)."""
        return float(np.max(self.profile[:, 0] - self.profile[:, -1]))

    def stress(self, elastic: ElasticMaterial) -> StressHistory:
        """Thermal stress of the rim over the braking."""
        return stress_over_time(self.t, self.profile, self.profile_depth, elastic)

    def schmidt(self, wall: Wall, share: float, area: float, beyond: float = 0.0) -> SchmidtCourse:
        """Schmidt's scheme with the friction work of the run, from its temperatures at the start; adiabatic otherwise.

        - `wall`: the rim; `share` of the friction heat into it; `area` (m²) of the track; `beyond`: share of the other
          pair's heat
        """
        heat, thickness = share * self.work + beyond * self.other_work, float(wall.thickness)
        layers = schmidt_layers(wall.material, thickness, self.duration)
        depth = thickness * (np.arange(layers) + 0.5) / layers

        def flux(t0: float, t1: float) -> float:
            gained = np.interp(self.t[0] + t1, self.t, heat) - np.interp(self.t[0] + t0, self.t, heat)
            return float(gained / (area * (t1 - t0)))

        start = np.interp(depth, self.profile_depth, self.profile[0])
        return schmidt(wall.material, thickness, layers, self.duration, flux, start=start)


def schmidt_layers(material: Material, thickness: float, time: float) -> int:
    """Layers for Schmidt's scheme over a `time` (s): at most some 20,000 steps."""
    return int(np.clip(math.sqrt(1e4 / (float(material.diffusivity) * time / thickness**2)), 8, 100))


def _hardest(t: np.ndarray, work: np.ndarray) -> tuple[int, int, int] | None:
    """First and last index of the stretch over which friction works most, and how many such stretches there are."""
    works = np.diff(work) > 1e-9 * max(float(work[-1] - work[0]), 1e-300)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], works, [False]]).astype(int)))
    found = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    return (*max(found, key=lambda ends: float(work[ends[1]] - work[ends[0]])), len(found)) if found else None


def _sliding(s: Series, pair: str) -> tuple[np.ndarray, np.ndarray]:
    """Speed (rad/s) of one body of a pair in the other, and the torque between them (N·m)."""
    omega, torque = np.asarray(s.omega), np.asarray(s.brake_torque)
    if not pair:
        return omega, torque
    carried, torque = np.asarray(s.bandage_speed), np.asarray(s.pairs[pair].torque)
    return (carried, torque) if pair == "external" else (omega - carried, np.abs(torque))


def run_values(result: Result, pair: str = "", *, times: int = _TIMES) -> RunValues | None:
    """The hardest braking of a concrete result, or the part of it in which one `pair` of a staged brake slides most.

    `pair`: `"external"` or `"internal"`; `times`: evaluated at so many. `None` where nothing ever slid.
    """

    def worked(s: Series) -> np.ndarray:
        return np.asarray(s.pairs[pair].friction_work if pair else s.friction_work)

    start, end = float(result.scene.initial.time), float(result.record.t_end)
    known = [event.time for event in result.events]
    s = result.series(np.unique(np.concatenate([np.linspace(start, end, times), known])))
    t, work = np.asarray(s.t), worked(s)
    found = _hardest(t, np.asarray(s.friction_work))
    if found is None:
        return None
    first, last, count = found
    if pair:
        own = _hardest(t[first : last + 1], work[first : last + 1])
        if own is None:
            return None
        first, last = first + own[0], first + own[1]
    s = result.series(np.linspace(t[first], t[last], times))
    inside, whole = worked(s), np.asarray(s.friction_work)
    inside = inside - inside[0]
    total = float(work[-1] - work[0])
    return RunValues(result.scene, s, pair, inside, whole - whole[0] - inside, *_sliding(s, pair), count, total)


# --- estimated --------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class HeatedPart:
    """One part that a braking heats: steps 1, 2, 3 and 5 of the synthesis (SI units).

    `share` of the heat `work` (J) goes into it, and `more` (J) of another pair; `start` (K): its temperature before;
    `course`: its simulation. From these: thermal penetration `depth`, Fourier number `Fo`, `volume` and `mass` that
    take up heat, mean `rise` of the bulk temperature and that itself, `bulk`.
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
    def Fo(self) -> float:
        return float(effective_fourier_number(self.diffusivity, self.time, self.thickness))

    @property
    def volume(self) -> float:
        return float(effective_volume(self.area, self.thickness, self.depth))

    @property
    def mass(self) -> float:
        return self.volume * float(self.material.density)

    @functools.cached_property
    def rise(self) -> float:
        heat = self.share * self.work + self.more
        return float(mean_bulk_rise(1.0, heat, float(self.material.specific_heat), self.mass))

    @property
    def bulk(self) -> float:
        return self.start + self.rise

    @property
    def simulated_bulk(self) -> float:
        """Bulk temperature (K) in the run, mean over the depth and the braking."""
        return float(np.mean(there(self.course).mean(self.depth)))


#: names for the metal that rubs → input of the rim, or of the band of an external pair
_METAL = {
    "metal": ("rim", "band"),
    "metal_thickness": ("rim_thickness", "band_thickness"),
    "metal_area": ("track_area", "outer_area"),  # over which the heat of the pair spreads
    "face_area": ("lining_area", "outer_area"),  # of the linings' faces that rub
    "metal_share": ("share", "external_share"),  # of the pair's heat
}


@dataclasses.dataclass(frozen=True)
class Braking:
    """What every row of estimates is made from: scene, inputs by name, classical stop and run where there are any.

    `time` (s), `work` (J), `omega` (rad/s, initial) of the braking: the run's, else the classical stop's. On a staged
    brake (`stages`) each `pair`, `"external"` or `"internal"`, has a braking as well: `run`, `time`, `work` are that
    pair's, `omega` its maximum sliding speed, `slid` (rad) how far it slides, and `more` (J) the heat that its metal
    gets from the other pair. Inputs are attributes, as `braking.rim_thickness`, and so are those of the metal that rubs
    (`metal_thickness`).
    """

    scene: Scene
    inputs: Mapping[str, Input]
    stop: ClassicalStop | None
    stages: StagedStop | None
    result: Result | None
    run: RunValues | None
    time: float
    work: float
    omega: float
    pair: str = ""
    slid: float | None = None
    more: float = 0.0

    def __getattr__(self, name: str) -> Any:
        of_rim, of_band = _METAL.get(name, (name, name))
        try:
            return self.__dict__["inputs"][of_band if self.part == "band" else of_rim].value
        except KeyError:
            raise AttributeError(name) from None

    def with_inputs(self, **values: Any) -> "Braking":
        """The same braking with other values of inputs."""
        inputs = {name: i._replace(value=values.get(name, i.value)) for name, i in self.inputs.items()}
        return dataclasses.replace(self, inputs=inputs)

    # the pair

    @property
    def part(self) -> str:
        """The metal that rubs: the rim, or the band of an external pair."""
        return "band" if self.pair == "external" else "rim"

    @property
    def parts(self) -> dict[str, HeatedPart]:
        """The parts that the pair heats, metal and lining; the band of a brake with one pair takes up no heat."""
        share, start, heat, run = self.metal_share, self.start_now, self.heat, self.run
        metal = (self.metal, self.metal_thickness, self.metal_area, self.time, start, share, heat, self.more)
        lining = (self.lining, self.lining_thickness, self.face_area, self.time, start, 1 - share, heat, 0.0)
        found = [
            HeatedPart(self.part, *metal, None if run is None else run.rim),
            HeatedPart("lining", *lining, None if run is None else run.lining),
        ]
        if not self.pair:
            band = (self.band, self.band_thickness, self.lining_area, self.time, start, 0.0, heat)
            found.append(HeatedPart("band", *band))
        return {part.name: part for part in found}

    # motion

    @property
    def R_b(self) -> float:
        """Radius of the band (m)."""
        return float(band_brake(self.scene).band.radius)

    @property
    def arm(self) -> float:
        """Radius (m) at which the way is counted."""
        return float(band_brake(self.scene).pulley.radius) if self.pair == "internal" else self.R_b

    @property
    def speed(self) -> float:
        """Initial sliding speed (m/s)."""
        return self.omega * (self.R_b if self.part == "band" else float(band_brake(self.scene).pulley.radius))

    @property
    def travel(self) -> float:
        """Way that the linings rub (m), on the band circle; of an internal pair on the rim."""
        if self.slid is not None:
            return self.arm * abs(self.slid)
        if self.run is None:
            angle = self.omega * self.time / 2
        else:
            angle = np.sum(0.5 * (self.run.omega[1:] + self.run.omega[:-1]) * np.diff(self.run.t))
        return self.arm * abs(float(angle))

    @property
    def mean_omega(self) -> float:
        """Mean speed (rad/s)."""
        return self.travel / (self.arm * self.time)

    @property
    def T_0(self) -> float:
        """Maximum lever tension (N)."""
        return float(self.scene.duty.lever.scale())

    @functools.cached_property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
        at_start = internal_friction_at_start if self.pair == "internal" else friction_at_start
        return float(np.mean(at_start(self.scene)))

    @property
    def pressure(self) -> float:
        """Mean pressure of the linings (Pa), absent where they would yield or do not slide."""
        way = self.friction * self.travel
        pressure = self.work / (way * self.face_area) if way > 0 else 0.0
        return there(pressure if 0 < pressure <= self.hardness else None)

    # heat

    @property
    def heat(self) -> float:
        """Friction work that becomes heat (J)."""
        return float(self.power.split(self.work).heat)

    @property
    def booked(self) -> PowerShares:
        """Shares of the friction power that a run of the scene books."""
        return self.scene.power_shares or PowerShares()

    @property
    def metal_heat(self) -> float:
        """Heat into the metal (J)."""
        return self.metal_share * self.heat + self.more

    @property
    def flux(self) -> float:
        """Mean heat flux into the whole track, or into the band (W/m²)."""
        return self.metal_heat / (self.metal_area * self.time)

    @property
    def start_now(self) -> float:
        """Mean temperature of the metal as the braking begins (K)."""
        try:
            return float(self.body_mean(math.inf)[0])
        except Absent:
            return self.band_start if self.part == "band" else self.start

    @functools.cached_property
    def heated(self) -> HeatedPart:
        """The metal as a heated part."""
        return self.parts[self.part]

    @property
    def whole_rise(self) -> float:
        """Rise (K) of all of the metal."""
        capacity = float(self.metal.density * self.metal.specific_heat)
        return self.metal_heat / (self.metal_area * self.metal_thickness * capacity)

    @functools.cached_property
    def plate_rise(self) -> float:
        """Rise (K) of the surface of a slab under the mean flux, at the end."""
        return float(slab_rise(self.flux, self.time, self.metal_thickness, self.metal))

    @functools.cached_property
    def falling_rise(self) -> float:
        """Maximum rise (K) of the surface of a half-space under a flux that falls linearly."""
        return float(stopping_rise(2 * self.flux, self.time / 2, self.time, float(self.metal.effusivity)))

    @functools.cached_property
    def flash(self) -> float | None:
        """Flash temperature (K) at the initial speed, on spots that carry the hardness; `None` at rest."""
        if self.speed <= 0:
            return None
        conductivity, diffusivity = float(self.metal.conductivity), float(self.metal.diffusivity)
        share = self.metal_share * float(self.power.heat)
        law = FlashTemperature(self.spot_length, conductivity, diffusivity, share, self.hardness)
        spots = jnp.asarray(self.friction * self.hardness * self.speed)
        return float(law.rise(spots, jnp.asarray(self.speed)))

    @property
    def stress(self) -> float:
        """Thermal stress (Pa) of the rim's surface, a slab under the mean flux, at the end."""
        face = float(slab_rise(self.flux, self.time, self.rim_thickness, self.rim))
        mean = self.flux * self.time / (self.rim_thickness * float(self.rim.density * self.rim.specific_heat))
        return float(surface_stress(face, mean, self.elastic))

    @property
    def radiation(self) -> float:
        """Coefficient of radiation (W/(m²·K)) of the rim as the braking begins."""
        return float(radiation_coefficient(self.emissivity, self.start_now, self.ambient))

    @functools.cached_property
    def balance(self) -> HeatBalance:
        """Heat balance of the rim over four revolutions at the mean speed, absent at rest."""
        if not (self.omega > 0 and self.mean_omega > 0 and self.overlap > 0):
            raise Absent
        return heat_balance(
            self.flux / self.overlap,  # the flux under the linings, of which the track gets the mean
            overlap=self.overlap,
            coefficient=self.coefficient + self.radiation,
            surface=self.start_now,
            ambient=self.ambient,
            omega=self.mean_omega,
            area=self.track_area,
        )

    @functools.cached_property
    def run_schmidt(self) -> SchmidtCourse | None:
        """Schmidt's scheme with the heat of the run, `None` without a run that has a rim in layers."""
        wall, hot = rim_wall(self.scene), float(self.power.heat)
        if self.run is None or wall is None or not self.run.layered:
            return None
        return self.run.schmidt(
            wall, hot * self.share, self.track_area, hot * (self.beyond_share if self.pair else 0.0)
        )

    # the run

    def body_mean(self, depth: float) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) of the metal of the run down to a depth (m); of a band all of it."""
        run = there(self.run)
        return there(run.band) if self.pair == "external" else run.course.mean(depth)

    @property
    def peak(self) -> float:
        """Maximum temperature of the rim's face in the run (K)."""
        return float(np.max(there(self.run).surface))

    @functools.cached_property
    def pair_runs(self) -> dict[str, RunValues | None]:
        """What the run of a staged brake shows of each pair; empty without a run."""
        result = self.result
        return {} if result is None else {pair: run_values(result, pair) for pair in ("external", "internal")}

    def of_pairs(self) -> list["Braking"]:
        """The braking of each pair of a staged brake that slides: from the run, else from the classical stop."""
        found = []
        for pair in ("external", "internal"):
            if self.result is not None:
                run = self.pair_runs[pair]
                if run is None:
                    continue
                more, omega = float(run.other_work[-1]), float(np.max(np.abs(run.omega)))
                one = dataclasses.replace(self, run=run, time=run.duration, work=float(run.work[-1]), omega=omega)
            else:
                own = there(self.stages).external if pair == "external" else there(self.stages).internal
                if own.work <= 0:
                    continue
                more = there(self.stages).external.work  # it is done before or while the internal pair slides
                one = dataclasses.replace(self, time=own.time, work=own.work, omega=own.omega, slid=own.angle)
            beyond = self.beyond_share if pair == "internal" else 0.0  # the rim's, S-12…14
            found.append(dataclasses.replace(one, pair=pair, more=beyond * float(self.power.heat) * more))
        return found
