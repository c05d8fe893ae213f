"""The brake application under estimate: values of the formulas and of its run."""

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from ...parts.scene import Scene, banded_brake
from ...thermal.heat import FlashTemperature, PowerShares
from ...thermal.materials import effusivity_share
from ._heated import HeatedPart, RunValues, run_values
from .contact import SeriesOfTimes, radiation_coefficient
from .heating import SchmidtCourse, slab_rise, stopping_rise
from .inputs import Input
from .statics import ClassicalStop, PairStop, StagedStop, friction_at_start
from .stress import stress_over_time, surface_stress

PAIRS = ("external", "internal")  # of a staged brake
#: names for the metal face → input of the rim, or of the band of an external pair
_METAL = {
    "metal": ("rim", "band"),
    "metal_thickness": ("rim_thickness", "band_thickness"),
    # over which the heat of the pair spreads
    "metal_area": ("track_area", "outer_area"),
    "face_area": ("lining_area", "outer_area"),  # of the linings' friction faces
    "metal_share": ("share", "external_share"),  # of the pair's heat
}


@dataclasses.dataclass(frozen=True)
class Braking:
    """Data of every row of estimates: scene, inputs by name, classical stop and run
    where available.

    `time` (s), `work` (J), `omega` (rad/s, initial) are those of the run, else of the
    classical stop. On a staged brake (`stages`) each `pair`, `"external"` or
    `"internal"`, has a brake application as well: `run`, `time`, `work` are that
    pair's, `omega` its maximum sliding speed, `slid` (rad) how far it slides, and
    `more` (J) the heat that its metal gets from the other pair. Inputs are attributes,
    as `braking.rim_thickness`, and so are those of the metal face (`metal_thickness`).

    A value is `None` where a brake application has no such number.
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
        """The hardest brake application of a run, else a classical stop, if there is
        one."""
        omega = float(scene.start_speed)
        time = work = 0.0
        if run is not None:
            time = run.duration
            work = run.work[-1]
            omega = abs(run.omega[0])
        elif (classical := stop or stages) is not None:
            time = classical.time
            work = classical.work
        return cls(scene, inputs, stop, stages, run, time, work, omega)

    def __getattr__(self, name: str) -> Any:
        of_rim, of_band = _METAL.get(name, (name, name))
        try:
            return self.__dict__["inputs"][
                of_band if self.part == "band" else of_rim
            ].value
        except KeyError:
            raise AttributeError(name) from None

    # the pair, and the brake application of a row

    @property
    def part(self) -> str:
        """The metal face: the rim, or the band of an external pair."""
        return "band" if self.pair == "external" else "rim"

    @property
    def several(self) -> bool:
        """Whether the run has several brake applications."""
        return self.run is not None and self.run.brakings > 1

    @property
    def layered(self) -> RunValues | None:
        """The run, if its rim is the metal face and a wall in layers."""
        return self.run if self.run is not None and self.run.layered else None

    @property
    def parts(self) -> dict[str, HeatedPart]:
        """The parts that the pair heats, metal and lining; the band of a brake with one
        pair takes up no heat."""
        share = self.metal_share
        start = self.start_now
        heat = self.heat
        run = self.run
        parts = {
            self.part: HeatedPart(
                self.part,
                self.metal,
                self.metal_thickness,
                self.metal_area,
                self.time,
                start,
                share,
                heat,
                self.more,
                run and run.rim,
            )
        }
        size = (self.lining_thickness, self.face_area, self.time)
        course = run and run.lining
        parts["lining"] = HeatedPart(
            "lining", self.lining, *size, start, 1 - share, heat, course=course
        )
        if not self.pair:
            size = (self.band_thickness, self.lining_area, self.time)
            parts["band"] = HeatedPart("band", self.band, *size, start, 0.0, heat)
        return parts

    # motion

    @property
    def R(self) -> float:
        """Radius of the pulley (m)."""
        return float(banded_brake(self.scene).pulley.radius)

    @property
    def R_b(self) -> float:
        """Radius of the band (m)."""
        return float(banded_brake(self.scene).radius)

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
        """Sliding distance of the linings (m), on the band circle; of an internal pair
        on the rim."""
        if self.slid is not None:
            return self.arm * abs(self.slid)
        angle = (
            self.omega * self.time / 2
            if self.run is None
            else np.trapezoid(self.run.omega, self.run.t)
        )
        return self.arm * abs(float(angle))

    @property
    def mean_omega(self) -> float:
        """Mean speed (rad/s)."""
        return self.travel / (self.arm * self.time)

    @property
    def hardest_time(self) -> float | None:
        """Time of the run to rest (s); of several brake applications that of the
        hardest."""
        if self.run is None or not self.several:
            return self.run and self.run.result.metrics.get("stopping_time")
        begin, end = self.run.t[[0, -1]]
        rests = [
            e.time
            for e in self.run.result.events
            if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)
        ]
        return (
            rests[0] - begin if rests and rests[0] - end < self.run.duration else None
        )

    @property
    def hardest_angle(self) -> float | None:
        """Angle (rad) in that time."""
        if self.run is None or not self.several:
            return self.run and self.run.result.metrics.get("stopping_angle")
        if (time := self.hardest_time) is None:
            return None
        begin = self.run.t[0]
        first, last = np.asarray(
            self.run.result.series(np.array([begin, begin + time])).phi
        )
        return last - first

    # forces and work

    @property
    def rims(self) -> int:
        """Number of alike rims, on each of which a band acts with the slack tension
        `T_0`."""
        return self.scene.brake.rims

    @property
    def T_0(self) -> float:
        """Maximum lever tension (N), of several alike rims that on each band."""
        return float(self.scene.lever.scale())

    @functools.cached_property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
        return np.mean(friction_at_start(self.scene, self.pair or "external")).item()

    @property
    def pressure(self) -> float | None:
        """Mean pressure of the linings (Pa), `None` where they would yield or do not
        slide."""
        way = self.friction * self.travel
        pressure = self.work / (way * self.face_area) if way > 0 else 0.0
        return pressure if 0 < pressure <= self.hardness else None

    @property
    def run_pressure(self) -> float | None:
        """Mean pressure (Pa) over the sliding distance of the run."""
        if self.run is None:
            return None
        s = self.run.series
        power = s.normal_load.sum(axis=1) * np.abs(s.slip_speed)
        load = self.rims * np.trapezoid(power, self.run.t) / self.run.slid
        return load / self.lining_area

    @property
    def stopping_load(self) -> tuple[float, float]:
        """Work (J) and time (s) of the classical stop, else of the brake
        application."""
        load = self.stop or self
        return load.work, load.time

    # heat, and its shares

    @property
    def heat(self) -> float:
        """Friction work that becomes heat (J)."""
        return float(self.power.split(self.work).heat)

    @property
    def booked(self) -> PowerShares:
        """Shares of the friction power in a run of the scene."""
        return self.scene.power_shares or PowerShares()

    @property
    def effusivity_share(self) -> float:
        return float(effusivity_share(self.metal, self.lining))

    @property
    def simulated_share(self) -> float | None:
        """Heat partition coefficient of the metal in the run."""
        run = self.run
        if run is None or not self.scene.heated or not run.total_work > 0:
            return None
        entered = run.result.energy.get(
            "heat_to_band" if self.part == "band" else "heat_to_metal"
        )
        if entered is None:
            return None
        # without the heat of the external pair that passes the linings
        if self.pair == "internal":
            entered = entered - self.beyond_share * run.result.energy["heat_external"]
        return float(entered) / float(self.booked.split(run.total_work).heat)

    @property
    def metal_heat(self) -> float:
        """Heat into the metal (J)."""
        return self.metal_share * self.heat + self.more

    @property
    def flux(self) -> float:
        """Mean heat flux into the whole track, or into the band (W/m²)."""
        return self.metal_heat / (self.metal_area * self.time)

    @property
    def initial_flux(self) -> float:
        """Initial flux (W/m²) of a power that falls linearly."""
        return 2 * self.flux

    # temperatures of the metal

    @property
    def start_now(self) -> float:
        """Mean temperature of the metal at the beginning of the brake application
        (K)."""
        mean = self.body_mean()
        if mean is not None:
            return mean[0]
        return self.band_start if self.part == "band" else self.start

    @functools.cached_property
    def heated(self) -> HeatedPart:
        """The metal as a heated part."""
        return self.parts[self.part]

    @property
    def simulated_bulk(self) -> float | None:
        """Mean temperature (K) of its heated depth in the run."""
        mean = self.body_mean(self.heated.depth)
        return None if mean is None else np.mean(mean).item()

    @property
    def whole_rise(self) -> float:
        """Rise (K) of all of the metal."""
        volume = self.metal_area * self.metal_thickness
        return self.metal_heat / (volume * self.metal.volumetric_heat_capacity)

    @property
    def end(self) -> float:
        return self.start_now + self.whole_rise

    @property
    def simulated_end(self) -> float | None:
        mean = self.body_mean()
        return None if mean is None else mean[-1]

    @functools.cached_property
    def falling_rise(self) -> float:
        """Maximum rise (K) of the surface of a half-space under a flux that falls
        linearly."""
        e = self.metal.effusivity
        return float(stopping_rise(self.initial_flux, self.time / 2, self.time, e))

    @functools.cached_property
    def flash(self) -> float | None:
        """Flash temperature (K) at the initial speed, on spots that carry the hardness;
        `None` at rest."""
        if self.speed <= 0:
            return None
        law = FlashTemperature(
            self.spot_length,
            self.metal.conductivity,
            self.metal.diffusivity,
            self.metal_share * self.power.heat,
            self.hardness,
        )
        spots = jnp.asarray(self.friction * self.hardness * self.speed)
        return float(law.rise(spots, jnp.asarray(self.speed)))

    @functools.cached_property
    def run_schmidt(self) -> SchmidtCourse | None:
        """Schmidt's scheme with the heat of the run, `None` without a run that has a
        rim in layers."""
        run = self.layered
        hot = self.power.heat
        if run is None:
            return None
        beyond = hot * (self.beyond_share if self.pair else 0.0)
        return run.schmidt(
            run.course.wall.material, hot * self.share, self.track_area, beyond
        )

    # the rim: flow through it, balance, thermal stress

    @property
    def radiation(self) -> float:
        """Coefficient of radiation (W/(m²·K)) of the rim at the beginning of the brake
        application."""
        return float(
            radiation_coefficient(self.emissivity, self.start_now, self.ambient)
        )

    @property
    def stress(self) -> float:
        """Thermal stress (Pa) of the rim's surface, a slab under the mean flux, at the
        end."""
        face = slab_rise(self.flux, self.time, self.rim_thickness, self.rim)
        mean = (
            self.flux
            * self.time
            / (self.rim_thickness * self.rim.volumetric_heat_capacity)
        )
        return float(surface_stress(face, mean, self.elastic))

    @property
    def stress_ratio(self) -> float:
        return abs(self.stress) / self.elastic.permissible

    @functools.cached_property
    def run_stress(self) -> tuple[float, float, float] | None:
        """Time (s) from the beginning, stress (Pa) and ratio where the stress of the
        run is largest."""
        run = self.layered
        if run is None:
            return None
        time, stress, ratio = stress_over_time(
            run.t, run.profile, run.profile_depth, self.elastic
        ).worst
        return time - run.t[0], stress, ratio

    # the run

    def body_mean(self, depth: float = math.inf) -> SeriesOfTimes | None:
        """Mean temperature (K) of the metal of the run down to a depth (m); of a band
        all of it."""
        if self.pair == "external":
            return self.run and self.run.band
        return self.layered and self.layered.course.mean(depth)

    @property
    def peak(self) -> float | None:
        """Maximum temperature of the rim's face in the run (K)."""
        return self.layered and np.max(self.layered.surface)

    # the pairs of a staged brake

    @functools.cached_property
    def pair_runs(self) -> dict[str, RunValues | None]:
        """Results of each pair of a staged brake; empty without a run."""
        if self.run is None:
            return {}
        return {pair: run_values(self.run.result, pair) for pair in PAIRS}

    def of_pairs(self) -> list["Braking"]:
        """The brake application of each pair of a staged brake that slides: of the run,
        else of the classical stop."""
        brakings = []
        for pair in PAIRS:
            if self.run is not None:
                run = self.pair_runs[pair]
                if run is None:
                    continue
                more = run.other_work[-1]
                omega = np.max(np.abs(run.omega))
                braking = dataclasses.replace(
                    self, run=run, time=run.duration, work=run.work[-1], omega=omega
                )
            else:
                assert self.stages is not None
                own: PairStop = getattr(self.stages, pair)
                if own.work <= 0:
                    continue
                # work before or while the internal pair slides
                more = self.stages.external.work
                braking = dataclasses.replace(
                    self, time=own.time, work=own.work, omega=own.omega, slid=own.angle
                )
            # the rim's, S-12…14
            beyond = self.beyond_share if pair == "internal" else 0.0
            brakings.append(
                dataclasses.replace(
                    braking, pair=pair, more=beyond * self.power.heat * more
                )
            )
        return brakings
