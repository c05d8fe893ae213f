"""The brake application under estimate: values of the formulas and of its run, as attributes."""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._parts._scene import Scene, band_brake
from ..thermal._heat import FlashTemperature, PowerShares, PowerSplit, shares_of_S
from ..thermal._material import effusivity_share
from ._heated import Absent, HeatedPart, RunValues, run_values, there
from ._inputs import Input
from .contact import current_density, radiation_coefficient, real_contact_area, series_conductivity, series_resistance
from .heating import (
    HeatBalance,
    MaximumTemperatures,
    SchmidtCourse,
    heat_balance,
    maximum_temperatures,
    reconstructed_surface_rise,
    schmidt,
    slab_rise,
    stopping_rise,
    stopping_slab_rise,
    transmission_table,
)
from .statics import ClassicalStop, StagedStop, friction_at_start, onset_at
from .stress import plate_stress, surface_stress

#: names for the metal face → input of the rim, or of the band of an external pair
_METAL = {
    "metal": ("rim", "band"),
    "metal_thickness": ("rim_thickness", "band_thickness"),
    "metal_area": ("track_area", "outer_area"),  # over which the heat of the pair spreads
    "face_area": ("lining_area", "outer_area"),  # of the linings' friction faces
    "metal_share": ("share", "external_share"),  # of the pair's heat
}


@dataclasses.dataclass(frozen=True)
class Braking:
    """Data of every row of estimates: scene, inputs by name, classical stop and run where available.

    `time` (s), `work` (J), `omega` (rad/s, initial) are those of the run, else of the classical stop. On a staged
    brake (`stages`) each `pair`, `"external"` or `"internal"`, has a brake application as well: `run`, `time`, `work`
    are that pair's, `omega` its maximum sliding speed, `slid` (rad) how far it slides, and `more` (J) the heat that its
    metal gets from the other pair. Inputs are attributes, as `braking.rim_thickness`, and so are those of the metal
    face (`metal_thickness`).

    Methods are the functions of `rows.csv`, properties their shared parts; they raise `Absent` where a brake
    application has no such number.
    """

    scene: Scene
    inputs: Mapping[str, Input]
    stop: ClassicalStop | None
    stages: StagedStop | None
    run: RunValues | None
    time: float
    work: float
    omega: float
    pair: str = ""
    slid: float | None = None
    more: float = 0.0

    @classmethod
    def of(
        cls,
        scene: Scene,
        inputs: Mapping[str, Input],
        stop: ClassicalStop | None,
        stages: StagedStop | None = None,
        run: RunValues | None = None,
    ) -> "Braking":
        """The hardest brake application of a run, else a classical stop, if there is one."""
        if run is not None:
            time, work, omega = run.duration, float(run.work[-1]), float(abs(run.omega[0]))
        else:
            classical, omega = stop or stages, float(scene.initial.omega)
            time, work = (0.0, 0.0) if classical is None else (classical.time, classical.work)
        return cls(scene, inputs, stop, stages, run, time, work, omega)

    def __getattr__(self, name: str) -> Any:
        of_rim, of_band = _METAL.get(name, (name, name))
        try:
            return self.__dict__["inputs"][of_band if self.part == "band" else of_rim].value
        except KeyError:
            raise AttributeError(name) from None

    def with_inputs(self, **values: Any) -> "Braking":
        """The same brake application with other values of inputs."""
        inputs = {name: i._replace(value=values.get(name, i.value)) for name, i in self.inputs.items()}
        return dataclasses.replace(self, inputs=inputs)

    # the pair, and the brake application of a row

    @property
    def part(self) -> str:
        """The metal face: the rim, or the band of an external pair."""
        return "band" if self.pair == "external" else "rim"

    def on_rim(self) -> "Braking | None":
        return self if self.part == "rim" else None

    def stopped(self) -> "Braking | None":
        """The brake application with a classical stop."""
        return None if self.stop is None else self

    def unstopped(self) -> "Braking | None":
        """The brake application without a classical stop."""
        return self if self.stop is None else None

    @property
    def several(self) -> bool:
        """Whether the run has several brake applications."""
        return self.run is not None and self.run.brakings > 1

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
    def R(self) -> float:
        """Radius of the pulley (m)."""
        return float(band_brake(self.scene).pulley.radius)

    @property
    def R_b(self) -> float:
        """Radius of the band (m)."""
        return float(band_brake(self.scene).band.radius)

    @property
    def arm(self) -> float:
        """Radius (m) of the sliding distance."""
        return self.R if self.pair == "internal" else self.R_b

    @property
    def speed(self) -> float:
        """Initial sliding speed (m/s)."""
        return self.omega * (self.R_b if self.part == "band" else self.R)

    @property
    def travel(self) -> float:
        """Sliding distance of the linings (m), on the band circle; of an internal pair on the rim."""
        if self.slid is not None:
            return self.arm * abs(self.slid)
        if self.run is None:
            angle = self.omega * self.time / 2
        else:
            angle = np.sum(0.5 * (self.run.omega[1:] + self.run.omega[:-1]) * np.diff(self.run.t))
        return self.arm * abs(float(angle))

    def friction_travel(self) -> float:
        """The same in the classical stop."""
        return self.R_b * there(self.stop).angle

    @property
    def mean_omega(self) -> float:
        """Mean speed (rad/s)."""
        return self.travel / (self.arm * self.time)

    @property
    def hardest_time(self) -> float:
        """Time of the run to rest (s); of several brake applications that of the hardest."""
        if not self.several:
            return there(there(self.run).result.metrics.get("stopping_time"))
        run = there(self.run)
        end = float(run.t[-1])
        rests = [e.time for e in run.result.events if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)]
        return there(rests[0] - float(run.t[0]) if rests and rests[0] - end < run.duration else None)

    @property
    def hardest_angle(self) -> float:
        """Angle (rad) in that time."""
        result = there(self.run).result
        if not self.several:
            return there(result.metrics.get("stopping_angle"))
        begin = float(there(self.run).t[0])
        phi = np.asarray(result.series(np.array([begin, begin + self.hardest_time])).phi)
        return float(phi[1] - phi[0])

    def hardest_work(self) -> float:
        """Friction work (J) of the hardest of several brake applications, else of the run."""
        run = there(self.run)
        return run.work[-1] if self.several else run.total_work

    @property
    def drum(self) -> tuple[float, float]:
        """Effective drum radius (m) and lines strung, absent without a hook."""
        load = self.scene.duty.load
        radius, lines = getattr(load, "drum_radius", None), getattr(load, "line_count", None)
        return float(there(radius)), float(there(lines))

    def hook_travel(self) -> float:
        """Travel of the hook (m) in the classical stop."""
        there(self.drum[0])
        return float(self.scene.duty.load.travelled(there(self.stop).angle))  # pyright: ignore

    def hardest_hook_travel(self) -> float:
        """Travel of the hook (m) in the run."""
        there(self.drum[0])
        return float(self.scene.duty.load.travelled(self.hardest_angle))  # pyright: ignore

    # forces and work

    @property
    def T_0(self) -> float:
        """Maximum lever tension (N)."""
        return float(self.scene.duty.lever.scale())

    def T_n(self) -> float:
        """Maximum tight tension (N)."""
        return there(self.stop).ratio * self.T_0

    def mean_torque(self) -> float:
        """Torque (N·m) from work and sliding distance."""
        return self.work * self.R_b / there(self.travel or None)

    @functools.cached_property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
        return float(np.mean(friction_at_start(self.scene, self.pair or "external")))

    @property
    def pressure(self) -> float:
        """Mean pressure of the linings (Pa), absent where they would yield or do not slide."""
        way = self.friction * self.travel
        pressure = self.work / (way * self.face_area) if way > 0 else 0.0
        return there(pressure if 0 < pressure <= self.hardness else None)

    @property
    def run_pressure(self) -> float:
        """Mean pressure (Pa) over the sliding distance of the run."""
        return there(self.run).mean_load / self.lining_area

    def contact_area(self) -> float:
        return float(real_contact_area(self.face_area, self.pressure, self.hardness))

    @property
    def stopping_load(self) -> tuple[float, float]:
        """Work (J) and time (s) of the classical stop, else of the brake application."""
        return (self.work, self.time) if self.stop is None else (self.stop.work, self.stop.time)

    def energy_load(self) -> tuple[float, float | None]:
        """Work per area of the linings (J/m²), and in the run."""
        return self.stopping_load[0] / self.lining_area, None if self.run is None else self.work / self.lining_area

    @property
    def power_load(self) -> tuple[float, float | None]:
        """Mean power per area of the linings (W/m²), and in the run."""
        work, time = self.stopping_load
        simulated = None if self.run is None else self.work / (self.lining_area * self.time)
        return work / (self.lining_area * time), simulated

    # heat, and its shares

    @property
    def split(self) -> PowerSplit:
        """Friction work (J) in its shares."""
        return self.power.split(self.work)

    @property
    def heat(self) -> float:
        """Friction work that becomes heat (J)."""
        return float(self.split.heat)

    @property
    def booked(self) -> PowerShares:
        """Shares of the friction power in a run of the scene."""
        return self.scene.power_shares or PowerShares()

    def booked_split(self) -> PowerSplit:
        """Friction work (J) in the shares of the run."""
        return there(self.run) and self.booked.split(self.work)

    def power_of_S(self) -> float:
        """Heat power (W) at the start by S-10 as read here."""
        return float(shares_of_S().split(there(self.stop).power).heat)

    def booked_words(self) -> str:
        own = "the run has the shares of `Scene.power_shares`"
        return own if self.booked.heat < 1 else "in the run all of it is heat"

    def effusivity_share(self) -> float:
        return float(effusivity_share(self.metal, self.lining))

    @property
    def transmission(self) -> float:
        """Heat partition coefficient of the rim by V's table."""
        K_1, K_2 = (float(np.asarray(K)) for K in transmission_table().transmissions(jnp.asarray(self.start_now)))
        return K_1 / (K_1 + K_2)

    @property
    def simulated_share(self) -> float:
        """Heat partition coefficient of the metal in the run."""
        run, energy = there(self.run), there(self.run).result.energy
        if not self.scene.heated or not run.total_work > 0:
            raise Absent
        entered = there(energy.get("heat_to_band" if self.part == "band" else "heat_to_metal"))
        if self.pair == "internal":  # without the heat of the external pair that passes the linings
            entered = entered - self.beyond_share * energy["heat_external"]
        return float(entered) / float(self.booked.split(run.total_work).heat)

    def stack(self) -> dict[str, float]:
        """Lining and band one after the other: conductivity (W/(m·K)) and resistance (K/W)."""
        thickness = [self.lining_thickness, self.band_thickness]
        conductivity = [float(self.lining.conductivity), float(self.band.conductivity)]
        each = [d / (k * self.lining_area) for d, k in zip(thickness, conductivity, strict=True)]
        mean = float(series_conductivity(thickness, conductivity))
        return {"conductivity": mean, "resistance": float(series_resistance(*each))}

    @property
    def metal_heat(self) -> float:
        """Heat into the metal (J)."""
        return self.metal_share * self.heat + self.more

    @property
    def kept(self) -> float:
        """Heat (J) that remains in the rim of the run."""
        rim = there(there(self.run).rim)
        return float(rim.content[-1] * float(rim.wall.area) * rim.wall.copies)

    def kept_flux(self) -> float:
        return self.kept / (self.track_area * self.time)

    @property
    def flux(self) -> float:
        """Mean heat flux into the whole track, or into the band (W/m²)."""
        return self.metal_heat / (self.metal_area * self.time)

    @property
    def initial_flux(self) -> float:
        """Initial flux (W/m²) of a power that falls linearly."""
        return 2 * self.flux

    @property
    def lining_flux(self) -> float:
        """Flux (W/m²) under the linings; the track receives its mean."""
        return self.flux / self.overlap

    # temperatures of the metal

    @property
    def start_now(self) -> float:
        """Mean temperature of the metal at the beginning of the brake application (K)."""
        try:
            return float(self.body_mean(math.inf)[0])
        except Absent:
            return self.band_start if self.part == "band" else self.start

    @functools.cached_property
    def heated(self) -> HeatedPart:
        """The metal as a heated part."""
        return self.parts[self.part]

    @property
    def simulated_bulk(self) -> float:
        """Mean temperature (K) of its heated depth in the run."""
        return float(np.mean(self.body_mean(self.heated.depth)))

    @property
    def whole_rise(self) -> float:
        """Rise (K) of all of the metal."""
        capacity = float(self.metal.density * self.metal.specific_heat)
        return self.metal_heat / (self.metal_area * self.metal_thickness * capacity)

    @property
    def end(self) -> float:
        return self.start_now + self.whole_rise

    def simulated_end(self) -> float:
        return self.body_mean(math.inf)[-1]

    def plate(self) -> float:
        """Temperature (K) of the surface of a slab under the mean flux, at the end."""
        return self.start_now + float(slab_rise(self.flux, self.time, self.metal_thickness, self.metal))

    @functools.cached_property
    def falling_rise(self) -> float:
        """Maximum rise (K) of the surface of a half-space under a flux that falls linearly."""
        return float(stopping_rise(self.initial_flux, self.time / 2, self.time, float(self.metal.effusivity)))

    def falling(self) -> float:
        return self.start_now + self.falling_rise

    def falling_slab(self) -> float:
        return self._slab_peak(stopping_slab_rise)

    def falling_of_S(self) -> float:
        return self._slab_peak(reconstructed_surface_rise)

    def _slab_peak(self, rise: Callable[..., Any]) -> float:
        """Maximum temperature (K) of the surface of a slab under a flux that falls linearly."""
        times = self.time * np.linspace(0.0, 1.0, 1025)
        return self.start_now + float(
            np.max(rise(self.initial_flux, times, self.time, self.metal_thickness, self.metal))
        )

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
    def maximum(self) -> MaximumTemperatures:
        """Maximum temperature (K) in S's combinations, absent at rest."""
        rises = maximum_temperatures(self.heated.rise, self.falling_rise, there(self.flash))
        return MaximumTemperatures(*(self.start_now + rise for rise in rises))

    @functools.cached_property
    def run_schmidt(self) -> SchmidtCourse | None:
        """Schmidt's scheme with the heat of the run, `None` without a run that has a rim in layers."""
        run, hot = self.run, float(self.power.heat)
        if run is None or not run.layered:
            return None
        beyond = hot * (self.beyond_share if self.pair else 0.0)
        return run.schmidt(run.course.wall.material, hot * self.share, self.track_area, beyond)

    def run_schmidt_peak(self) -> float:
        """Maximum temperature (K) of the face by Schmidt's scheme."""
        return float(np.max(there(self.run_schmidt).temperature[:, 0]))

    def flux_schmidt_end(self) -> float:
        """Temperature (K) of the face at the end of a constant flux, by Schmidt's scheme; only without a run."""
        if self.run_schmidt is not None:
            raise Absent
        course = schmidt(self.metal, self.metal_thickness, 40, self.time, self.flux, start=self.start_now)
        return float(np.interp(self.time, course.t, course.temperature[:, 0]))

    # the rim: flow through it, balance, thermal stress

    @property
    def rim_conductivity(self) -> float:
        return float(self.rim.conductivity)

    def stationary_drop(self) -> float:
        """Drop (K) over the rim under the mean flux."""
        return self.flux * self.rim_thickness / self.rim_conductivity

    def drop_flux(self) -> float:
        """Flux (W/m²) by the maximum drop over the rim of the run."""
        return float(current_density(self.rim_conductivity, there(self.run).drop, self.rim_thickness))

    def gradient(self) -> float:
        """Maximum gradient (K/m) at the face, as the power begins to fall."""
        return self.initial_flux / self.rim_conductivity

    @property
    def radiation(self) -> float:
        """Coefficient of radiation (W/(m²·K)) of the rim at the beginning of the brake application."""
        return float(radiation_coefficient(self.emissivity, self.start_now, self.ambient))

    @functools.cached_property
    def balance(self) -> HeatBalance:
        """Heat balance of the rim over four revolutions at the mean speed, absent at rest."""
        if not (self.omega > 0 and self.mean_omega > 0 and self.overlap > 0):
            raise Absent
        return heat_balance(
            self.lining_flux,
            overlap=self.overlap,
            coefficient=self.coefficient + self.radiation,
            surface=self.start_now,
            ambient=self.ambient,
            omega=self.mean_omega,
            area=self.track_area,
        )

    def balanced_overlap(self) -> float:
        return self.balance and self.overlap

    def four_turns(self) -> tuple[float, float]:
        """Time (s) of the first four revolutions of the run and heat (J) into its rim, absent where it makes fewer."""
        run = there(self.run)
        angle = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t))])
        if angle[-1] < 8 * math.pi:
            raise Absent
        time = float(np.interp(8 * math.pi, angle, run.t))
        return time - float(run.t[0]), self.share * float(self.power.heat) * float(np.interp(time, run.t, run.work))

    @property
    def stress(self) -> float:
        """Thermal stress (Pa) of the rim's surface, a slab under the mean flux, at the end."""
        face = float(slab_rise(self.flux, self.time, self.rim_thickness, self.rim))
        mean = self.flux * self.time / (self.rim_thickness * float(self.rim.density * self.rim.specific_heat))
        return float(surface_stress(face, mean, self.elastic))

    def free_stress(self) -> float:
        """Thermal stress (Pa) of a rim that may bend."""
        z = self.rim_thickness * np.linspace(0.0, 1.0, 401) ** 2
        rise = np.asarray(slab_rise(self.flux, self.time, self.rim_thickness, self.rim, z))
        return float(plate_stress(rise, z, self.elastic, restraint="none")[0])

    def stress_ratio(self) -> float:
        return abs(self.stress) / self.elastic.permissible

    @property
    def run_stress(self) -> tuple[float, float, float]:
        """Time (s) from the beginning, stress (Pa) and ratio where the stress of the run is largest."""
        run = there(self.run)
        time, stress, ratio = run.stress(self.elastic).worst
        return time - float(run.t[0]), stress, ratio

    # the run

    def body_mean(self, depth: float) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) of the metal of the run down to a depth (m); of a band all of it."""
        run = there(self.run)
        return there(run.band) if self.pair == "external" else run.course.mean(depth)

    @property
    def peak(self) -> float:
        """Maximum temperature of the rim's face in the run (K)."""
        return float(np.max(there(self.run).surface))

    # the pairs of a staged brake

    @functools.cached_property
    def pair_runs(self) -> dict[str, RunValues | None]:
        """Results of each pair of a staged brake; empty without a run."""
        return (
            {} if self.run is None else {pair: run_values(self.run.result, pair) for pair in ("external", "internal")}
        )

    @property
    def pair_works(self) -> dict[str, float]:
        """Friction work (J) of each pair in the run, 0 where it never slides, and of both."""
        runs = there(self.pair_runs or None)
        works = {pair: 0.0 if run is None else float(run.work[-1]) for pair, run in runs.items()}
        return works | {"both": sum(works.values())}

    def pair_shares(self) -> dict[str, float]:
        external = self.pair_works["external"] / there(self.pair_works["both"] or None)
        return {"external": external, "internal": 1 - external}

    @functools.cached_property
    def internal_slip(self) -> dict[str, float]:
        """Slack tension (N) and speed (rad/s) at which the internal pair breaks away in a run."""
        run = there(self.run)
        result, begin, end = run.result, run.t[0], run.t[-1]
        slips = [e.time for e in result.events if e.name == "internal_slip" and begin <= e.time <= end]
        s = result.series(np.asarray(there(slips or None)[:1]))
        return {"tension": float(np.asarray(s.slack_tension)[0]), "omega": float(np.asarray(s.omega)[0])}

    def onset(self) -> float:
        """Slack tension (N) at which it breaks away by statics, at the speed then: of a run, else the initial one."""
        try:
            return onset_at(self.scene, self.internal_slip["omega"])
        except Absent:
            return there(self.stages).onset

    def stage_times(self) -> tuple[float, ...]:
        """Durations (s) of the stages in the brake application of a run."""
        run = there(self.run)
        stages = [stage for stage in run.result.stages if stage.end > run.t[0] and stage.start < run.t[-1]]
        names = [f"stage_{i}" for i in (1, 2, 3)]
        return tuple(sum((stage.duration for stage in stages if stage.name == name), 0.0) for name in names)

    def of_pairs(self) -> list["Braking"]:
        """The brake application of each pair of a staged brake that slides: of the run, else of the classical stop."""
        found = []
        for pair in ("external", "internal"):
            if self.run is not None:
                run = self.pair_runs[pair]
                if run is None:
                    continue
                more, omega = float(run.other_work[-1]), float(np.max(np.abs(run.omega)))
                one = dataclasses.replace(self, run=run, time=run.duration, work=float(run.work[-1]), omega=omega)
            else:
                own = there(self.stages).external if pair == "external" else there(self.stages).internal
                if own.work <= 0:
                    continue
                more = there(self.stages).external.work  # work before or while the internal pair slides
                one = dataclasses.replace(self, time=own.time, work=own.work, omega=own.omega, slid=own.angle)
            beyond = self.beyond_share if pair == "internal" else 0.0  # the rim's, S-12…14
            found.append(dataclasses.replace(one, pair=pair, more=beyond * float(self.power.heat) * more))
        return found
