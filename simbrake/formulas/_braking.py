"""The braking that estimates are of: its inputs, its classical stop, what it heats, and its run if there is one."""

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault, InputError
from .._parts._heat import FlashTemperature
from .._parts._material import Material
from .._parts._power_shares import PowerShares
from .._parts._scene import Scene, band_brake, check
from .._run._result import Result
from ._inputs import EstimateData, Input, rim_wall, settle
from ._simulated import Layered, RunValues, WallCourse, run_values
from .contact import radiation_coefficient
from .heating import (
    HeatBalance,
    SchmidtCourse,
    effective_fourier_number,
    effective_volume,
    heat_balance,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
    surface_stress,
)
from .stop import (
    ClassicalStop,
    StagedStop,
    classical_staged_stop,
    classical_stop,
    friction_at_start,
    internal_friction_at_start,
)


@dataclasses.dataclass(frozen=True)
class HeatedPart:
    """One part that a braking heats: steps 1, 2, 3 and 5 of the synthesis (SI units).

    `share` of the heat `work` (J) goes into it, and `more` (J) of another pair; `start` (K): its temperature before;
    `course`: its simulation.
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
        """`a` (m²/s)."""
        return float(self.material.diffusivity)

    @property
    def depth(self) -> float:
        """Thermal penetration depth (m)."""
        return float(penetration_depth(self.diffusivity, self.time))

    @property
    def Fo(self) -> float:
        """Fourier number, 1/3 while the depth lies inside the part."""
        return float(effective_fourier_number(self.diffusivity, self.time, self.thickness))

    @property
    def volume(self) -> float:
        """Volume that takes up heat (m³)."""
        return float(effective_volume(self.area, self.thickness, self.depth))

    @property
    def mass(self) -> float:
        """Mass of that volume (kg)."""
        return self.volume * float(self.material.density)

    @property
    def heat(self) -> float:
        """Heat into the part (J)."""
        return self.share * self.work + self.more

    @functools.cached_property
    def rise(self) -> float:
        """Mean rise of the bulk temperature (K)."""
        return float(mean_bulk_rise(1.0, self.heat, float(self.material.specific_heat), self.mass))

    @property
    def bulk(self) -> float:
        """Mean bulk temperature (K)."""
        return self.start + self.rise

    @property
    def simulated_bulk(self) -> float | None:
        """The same of the run, over the depth and the braking."""
        return None if self.course is None else float(np.mean(self.course.mean(self.depth)))


@dataclasses.dataclass(frozen=True)
class Braking:
    """What every row of estimates is made from: scene, inputs by name, classical stop and run where there are any.

    `time` (s), `work` (J), `omega` (rad/s, initial) of the braking: the run's, else the classical stop's. On a staged
    brake (`stages`) each `pair`, `"external"` or `"internal"`, has a braking as well: `run`, `time`, `work` are that
    pair's, `omega` its maximum sliding speed, `slid` (rad) how far it slides, and `more` (J) the heat that its metal
    gets from the other pair. Inputs are attributes: `braking.rim_thickness`.
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
        try:
            return self.__dict__["inputs"][name].value
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
    def metal(self) -> Material:
        """Material of that part."""
        return self.band if self.part == "band" else self.rim

    @property
    def metal_thickness(self) -> float:
        """Its thickness (m)."""
        return self.band_thickness if self.part == "band" else self.rim_thickness

    @property
    def metal_area(self) -> float:
        """Area (m²) of the metal's face over which the heat of the pair spreads."""
        return self.outer_area if self.part == "band" else self.track_area

    @property
    def face_area(self) -> float:
        """Area (m²) of the linings' faces that rub."""
        return self.outer_area if self.part == "band" else self.lining_area

    @property
    def metal_share(self) -> float:
        """Share of the pair's heat that goes into its metal."""
        return self.external_share if self.part == "band" else self.share

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
    def pressure(self) -> float | None:
        """Mean pressure of the linings (Pa), `None` where they would yield or do not slide."""
        way = self.friction * self.travel
        pressure = self.work / (way * self.face_area) if way > 0 else 0.0
        return pressure if 0 < pressure <= self.hardness else None

    @property
    def by_statics(self) -> ClassicalStop:
        """The classical stop where there is one."""
        assert self.stop is not None
        return self.stop

    @property
    def by_stages(self) -> StagedStop:
        """The classical stop of a staged brake where there is one."""
        assert self.stages is not None
        return self.stages

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
        if self.bodied is not None:
            return float(self.body_mean(math.inf)[0])
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
    def mean_rise(self) -> float:
        """Mean rise (K) of the rim under the mean flux, at the end."""
        return self.flux * self.time / (self.rim_thickness * float(self.rim.density * self.rim.specific_heat))

    @property
    def stress(self) -> float:
        """Thermal stress (Pa) of the rim's surface, a slab under the mean flux, at the end."""
        face = float(slab_rise(self.flux, self.time, self.rim_thickness, self.rim))
        return float(surface_stress(face, self.mean_rise, self.elastic))

    @property
    def radiation(self) -> float:
        """Coefficient of radiation (W/(m²·K)) of the rim as the braking begins."""
        return float(radiation_coefficient(self.emissivity, self.start_now, self.ambient))

    @functools.cached_property
    def balance(self) -> HeatBalance | None:
        """Heat balance of the rim over four revolutions at the mean speed, `None` at rest."""
        if not (self.omega > 0 and self.mean_omega > 0 and self.overlap > 0):
            return None
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
        run, wall = self.layered, None if self.part == "band" else rim_wall(self.scene)
        if run is None or wall is None:
            return None
        hot, beyond = float(self.power.heat), self.beyond_share if self.pair else 0.0
        return run.schmidt(wall, hot * self.share, self.track_area, hot * beyond)

    # the run

    @property
    def layered(self) -> Layered | None:
        """The run where it has a rim in layers."""
        return self.run if isinstance(self.run, Layered) else None

    @property
    def bodied(self) -> RunValues | None:
        """The run where it has a temperature of the metal, in layers or as a whole."""
        if self.run is not None and self.pair == "external":
            return None if self.run.band is None else self.run
        return self.layered

    def body_mean(self, depth: float) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) of the metal of the run down to a depth (m); of a band all of it."""
        assert self.run is not None
        band = self.run.band if self.pair == "external" else None
        if band is not None:
            return band
        assert self.run.rim is not None
        return self.run.rim.mean(depth)

    @property
    def peak(self) -> float | None:
        """Maximum temperature of the rim's face in the run (K)."""
        return None if self.layered is None else float(np.max(self.layered.surface))

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
                own = self.by_stages.external if pair == "external" else self.by_stages.internal
                if own.work <= 0:
                    continue
                more = self.by_stages.external.work  # it is done before or while the internal pair slides
                one = dataclasses.replace(self, time=own.time, work=own.work, omega=own.omega, slid=own.angle)
            beyond = self.beyond_share if pair == "internal" else 0.0  # the rim's, S-12…14
            found.append(dataclasses.replace(one, pair=pair, more=beyond * float(self.power.heat) * more))
        return found


def braking_of(run: Scene | Result, data: EstimateData | None) -> tuple[Braking, str]:
    """The braking of a scene or of a run, and in words which one it is. Raises `InputError` as `estimates`."""
    scene = run.scene if isinstance(run, Result) else run
    if isinstance(run, Result) and not run.concrete:
        raise InputError([Fault("run", "is traced or a batch", "give one result with values")])
    check(scene)
    band_brake(scene)
    inputs, staged = settle(scene, data), scene.brake.in_series
    stop = None if staged else classical_stop(scene)
    stages = classical_staged_stop(scene) if staged else None
    if not isinstance(run, Result):
        of = stages if staged else stop
        if of is None:
            hint = "it must begin in motion and the brake outweigh its load; or simulate it and give the result"
            raise InputError([Fault("scene", "has no classical stop", hint)])
        braking = Braking(scene, inputs, stop, stages, None, None, of.time, of.work, float(scene.initial.omega))
        return braking, "; time and friction work are those of a classical stop"
    values = run_values(run)
    if values is None:
        raise InputError([Fault("run", "has no friction work", "nothing ever slides in it")])
    which = "the braking" if values.brakings == 1 else f"the hardest of {values.brakings} stretches of sliding"
    about = (
        f" beside the simulation; time and friction work are those of {which} "
        f"from {values.t[0]:.6g} s to {values.t[-1]:.6g} s"
    )
    return of_run(run, inputs, stop, stages, values), about


def of_run(
    result: Result,
    inputs: Mapping[str, Input],
    stop: ClassicalStop | None,
    stages: StagedStop | None,
    values: RunValues,
) -> Braking:
    """The hardest braking of a run."""
    work, first = float(values.work[-1]), float(abs(values.omega[0]))
    return Braking(result.scene, inputs, stop, stages, result, values, values.duration, work, first)
