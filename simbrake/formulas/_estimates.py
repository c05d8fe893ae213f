"""Engineering estimates of a braking: every formula is one row of data, with its simulated counterpart."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, SupportsFloat

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Table, plain
from .._parts._scene import Scene, band_brake, check
from .._run._result import Result
from ..thermal._material import effusivity_share
from ._braking import Braking, HeatedPart, RunValues, run_values
from ._inputs import EstimateData, Input, settle
from ._rows import Absent, EstimateRow, Of, RowTable, Symbols, fill, rows, table_of, there
from .contact import current_density, real_contact_area, series_conductivity, series_resistance
from .heating import fourier_parameter, maximum_temperatures, plate_stress, schmidt, slab_rise, transmission_table
from .stop import ClassicalStop, StagedStop, classical_staged_stop, classical_stop

# --- rows of one pair -------------------------------------------------------------------------------------------------

#: numbers put into formulas of a braking
SYMBOLS: Symbols[Braking] = {
    "f": ("1", lambda b: b.friction),
    "n": ("1", lambda b: b.scene.brake.linings.count),
    "n|turns": ("1", lambda b: 4),
    "R_b": ("m", lambda b: b.R_b),
    "T_0": ("N", lambda b: b.T_0),
    "Π": ("1", lambda b: there(b.stop).ratio),
    "M_b": ("N*m", lambda b: there(b.stop).torque),
    "t": ("s", lambda b: there(b.stop).time),
    "φ": ("rad", lambda b: there(b.stop).angle),
    "ω_0": ("rad/s", lambda b: b.omega),
    "ω": ("rad/s", lambda b: b.mean_omega),
    "v": ("m/s", lambda b: b.speed),
    "s": ("m", lambda b: b.travel),
    "τ": ("s", lambda b: b.time),
    "τ_T": ("s", lambda b: b.time),
    "W": ("J", lambda b: b.work),
    "W|heat": ("J", lambda b: b.heat),
    "α": ("1", lambda b: b.share),
    "q": ("W/m^2", lambda b: b.flux),
    "q_0": ("W/m^2", lambda b: 2 * b.flux),
    "q_1": ("W/m^2", lambda b: b.flux / b.overlap),
    "T": ("K", lambda b: b.start_now),
    "T_a": ("K", lambda b: b.ambient),
    "t_s": ("K", lambda b: b.falling_rise),
    "t_v": ("K", lambda b: b.heated.rise),
    "t_f": ("K", lambda b: b.flash or 0.0),
    "e": ("W*s^0.5/(m^2*K)", lambda b: b.metal.effusivity),
    "e_1": ("W*s^0.5/(m^2*K)", lambda b: b.metal.effusivity),
    "e_2": ("W*s^0.5/(m^2*K)", lambda b: b.lining.effusivity),
    "λ": ("W/(m*K)", lambda b: b.rim.conductivity),
    "h": ("W/(m^2*K)", lambda b: b.coefficient),
    "ε": ("1", lambda b: b.emissivity),
    "κ": ("1", lambda b: b.overlap),
    "δ": ("m", lambda b: b.rim_thickness),
    "A_a": ("m^2", lambda b: b.track_area),
    "A_l": ("m^2", lambda b: b.face_area),
    "HB": ("Pa", lambda b: b.hardness),
    "l": ("m", lambda b: b.spot_length),
    "E": ("Pa", lambda b: b.elastic.young),
    "α_T": ("1/K", lambda b: b.elastic.expansion),
    "ν": ("1", lambda b: b.elastic.poisson),
    "σ_p": ("Pa", lambda b: b.elastic.permissible),
}
#: and of a part that it heats
PART_SYMBOLS: Symbols[HeatedPart] = {
    "a": ("m^2/s", lambda p: p.diffusivity),
    "τ": ("s", lambda p: p.time),
    "δ": ("m", lambda p: p.thickness),
    "b": ("m", lambda p: p.depth),
    "A": ("m^2", lambda p: p.area),
    "T": ("K", lambda p: p.start),
    "α": ("1", lambda p: p.share),
    "W": ("J", lambda p: p.work),
    "c": ("J/(kg*K)", lambda p: p.material.specific_heat),
    "G": ("kg", lambda p: p.mass),
}

Value = Callable[[Braking], SupportsFloat]


def on_rim(f: Value) -> Value:
    """A function of a braking that only a rim has."""
    return lambda b: f(there(b if b.part == "rim" else None))


def _metric(name: str) -> Value:
    return lambda b: there(there(b.result).metrics.get(name))


def _shares(i: int) -> Of[Braking]:
    """A part of the friction work, as given and as the run books it."""
    own, none = "the run has shares of its own (`Scene.power_shares`)", "in the run all of it is heat"
    return Of(
        lambda b: b.power.split(b.work)[i],
        lambda b: there(b.run) and b.booked.split(b.work)[i],
        why=lambda b: own if b.booked.heat < 1 else none,
    )


def simulated_share(b: Braking) -> float:
    """Share of the heat that enters the metal in the run."""
    run, energy = there(b.run), there(b.result).energy
    if not b.scene.heated or not run.total_work > 0:
        raise Absent
    entered = there(energy.get("heat_to_band" if b.part == "band" else "heat_to_metal"))
    if b.pair == "internal":  # without what the external pair sends beyond the linings
        entered = entered - b.beyond_share * energy["heat_external"]
    return float(entered) / float(b.booked.split(run.total_work).heat)


def _transmission(b: Braking) -> float:
    K_1, K_2 = (float(np.asarray(K)) for K in transmission_table().transmissions(jnp.asarray(b.start_now)))
    return K_1 / (K_1 + K_2)


def _stack(b: Braking) -> tuple[list[float], list[float]]:
    """Thicknesses and conductivities of lining and band."""
    return [b.lining_thickness, b.band_thickness], [float(b.lining.conductivity), float(b.band.conductivity)]


def _resistance(b: Braking) -> float:
    return series_resistance(*(d / (k * b.lining_area) for d, k in zip(*_stack(b), strict=True)))


def _maximum(i: int) -> Of[Braking]:
    """The maximum temperature in one of S's combinations, none at rest."""
    return Of(
        lambda b: b.start_now + maximum_temperatures(b.heated.rise, b.falling_rise, there(b.flash))[i],
        lambda b: b.peak,
    )


def _schmidt(b: Braking) -> float:
    """Maximum face temperature with the run's own heat, else that at the end of a constant flux."""
    if b.run_schmidt is not None:
        return float(np.max(b.run_schmidt.temperature[:, 0]))
    course = schmidt(b.metal, b.metal_thickness, 40, b.time, b.flux, start=b.start_now)
    return float(np.interp(b.time, course.t, course.temperature[:, 0]))


def _free(b: Braking) -> float:
    """Thermal stress of the surface where the rim may bend."""
    z = b.rim_thickness * np.linspace(0.0, 1.0, 401) ** 2
    rise = np.asarray(slab_rise(b.flux, b.time, b.rim_thickness, b.rim, z))
    return float(plate_stress(rise, z, b.elastic, restraint="none")[0])


def _layered(b: Braking) -> RunValues:
    """The run where it has a rim in layers."""
    return there(b.run if b.run is not None and b.run.layered else None)


def _worst(b: Braking) -> tuple[float, float, float]:
    """Time (s), stress (Pa) and ratio where the stress of the run is largest."""
    return there(b.run).stress(b.elastic).worst


#: rows of a braking with one pair
ROWS = rows(
    SYMBOLS,
    {
        # a stop by statics
        "tension ratio": Of(lambda b: there(b.stop).ratio),
        "brake torque": Of(lambda b: there(b.stop).torque, lambda b: np.max(there(b.run).torque)),
        "stopping time": Of(lambda b: there(b.stop).time, _metric("stopping_time")),
        "stopping angle": Of(lambda b: there(b.stop).angle, _metric("stopping_angle")),
        "friction work": Of(lambda b: there(b.stop).work, lambda b: there(b.run).total_work),
        "friction power at first": Of(
            lambda b: there(b.stop).power, lambda b: np.max(np.diff(there(b.run).work) / np.diff(there(b.run).t))
        ),
        # the friction work in its shares
        "work into heat": _shares(0),
        "electrical work": _shares(1),
        "mechanical work": _shares(2),
        # heat partition coefficient, and the way of the heat through lining and band
        "share into the {part}, effusivities": Of(lambda b: effusivity_share(b.metal, b.lining), simulated_share),
        "share into the rim, transmission": Of(on_rim(_transmission), simulated_share),
        "conductivity, lining and band": Of(on_rim(lambda b: series_conductivity(*_stack(b)))),
        "resistance, lining and band": Of(on_rim(_resistance)),
        # temperatures of the metal
        "bulk temperature, mean": Of(
            lambda b: b.start_now + b.heated.rise,
            lambda b: np.mean(b.body_mean(b.heated.depth)),
        ),
        "bulk temperature, end": Of(lambda b: b.start_now + b.whole_rise, lambda b: b.body_mean(math.inf)[-1]),
        "surface temperature, constant flux": Of(
            lambda b: b.start_now + b.plate_rise, lambda b: there(b.run).surface[-1]
        ),
        "surface temperature, falling flux": Of(lambda b: b.start_now + b.falling_rise, lambda b: b.peak),
        "flash temperature, rise": Of(lambda b: there(b.flash)),
        "maximum temperature, S-26": _maximum(0),
        "maximum temperature, S-27": _maximum(1),
        "maximum temperature, sum": _maximum(2),
        "surface temperature, Schmidt": Of(
            _schmidt,
            lambda b: there(b.run_schmidt) and b.peak,
            lambda b: "½ (t_{j−1} + t_{j+1}), " + ("constant flux" if b.run_schmidt is None else "the run's own heat"),
            lambda b: "" if b.run_schmidt is None else None,
        ),
        # real contact, surfaces, and the heat through the rim
        "pressure, mean": Of(lambda b: b.pressure),
        "real contact area": Of(lambda b: real_contact_area(b.face_area, b.pressure, b.hardness)),
        "polished surface": Of(on_rim(lambda b: b.track_area)),
        "matte surfaces": Of(on_rim(lambda b: b.matte_area)),
        "radiation coefficient": Of(on_rim(lambda b: b.radiation)),
        "drop over the rim, stationary flux": Of(
            on_rim(lambda b: b.flux * b.rim_thickness / float(b.rim.conductivity)), lambda b: there(b.run).drop
        ),
        "flux by the greatest drop": Of(
            lambda b: current_density(float(b.rim.conductivity), there(b.run).drop, b.rim_thickness)
        ),
        # heat balance of the rim over four revolutions at the mean speed of the braking
        "overlap coefficient": Of(lambda b: there(b.balance) and b.overlap),
        "time of four revolutions": Of(lambda b: b.balance.time),
        "heat gained in it": Of(lambda b: b.balance.gained),
        "heat given away in it": Of(lambda b: b.balance.lost),
        "mean flux kept": Of(lambda b: b.balance.mean_flux),
        # thermal stress of the rim's surface: of the slab under constant flux, beside that of the simulated profiles
        "thermal stress, surface": Of(lambda b: b.stress, lambda b: _worst(b)[1]),
        "thermal stress, free to bend": Of(_free),
        "stress over permissible": Of(lambda b: abs(b.stress) / b.elastic.permissible, lambda b: _worst(b)[2]),
        "time of greatest stress": Of(lambda b: _layered(b).duration, lambda b: _worst(b)[0] - there(b.run).t[0]),
    },
    *("stop", "power", "partition", "temperature", "contact", "balance", "stress"),
)
#: of each part that the pair heats
PARTS = rows(
    PART_SYMBOLS,
    {
        "depth of heat, {part}": Of(lambda p: p.depth),
        "Fourier number, {part}": Of(lambda p: p.Fo),
        "parameter B, {part}": Of(lambda p: fourier_parameter(p.diffusivity, p.thickness)),
        "effective volume, {part}": Of(lambda p: p.volume),
    },
    "part",
)


# --- of a staged brake ------------------------------------------------------------------------------------------------


def _pair_torque(pair: str) -> Value:
    return lambda b: np.max(there(b.pair_runs.get(pair)).torque)


def _pair_work(b: Braking, *pairs: str) -> float:
    """Friction work of pairs in the run, 0 where a pair never slides."""
    runs = [there(b.pair_runs or None)[pair] for pair in pairs]
    return sum(0.0 if run is None else float(run.work[-1]) for run in runs)


def _external_share(b: Braking) -> float:
    return _pair_work(b, "external") / there(_pair_work(b, "external", "internal") or None)


def _onset(b: Braking) -> float:
    """Slack tension (N) at which the internal pair breaks away in the braking of a run."""
    begin, end = there(b.run).t[0], there(b.run).t[-1]
    slips = [e.time for e in there(b.result).events if e.name == "internal_slip" and begin <= e.time <= end]
    return float(np.asarray(there(b.result).series(np.asarray(there(slips or None)[:1])).slack_tension)[0])


def _stage(i: int) -> Of[Braking]:
    """How long a stage lasts (s), and lasted if it has a part in the braking of a run."""

    def simulated(b: Braking) -> float:
        begin, end = there(b.run).t[0], there(b.run).t[-1]
        stages = [stage for stage in there(b.result).stages if stage.end > begin and stage.start < end]
        return sum((stage.duration for stage in stages if stage.name == f"stage_{i + 1}"), 0.0)

    return Of(lambda b: there(b.stages).times[i], simulated)


#: tension ratio, torques, durations of the stages, friction work of both pairs
STAGES = rows(
    SYMBOLS,
    {
        "tension ratio": Of(lambda b: there(b.stages).ratio),
        "slack tension of internal slip": Of(lambda b: there(b.stages).onset, _onset),
        "torque, external pair": Of(lambda b: there(b.stages).external_torque, _pair_torque("external")),
        "torque, both pairs slide": Of(lambda b: there(b.stages).internal_torque, _pair_torque("internal")),
        **{f"stage {i + 1}": _stage(i) for i in range(3)},
        "stopping time": Of(lambda b: there(b.stages).time, _metric("stopping_time")),
        "stopping angle": Of(lambda b: there(b.stages).angle, _metric("stopping_angle")),
        "friction work": Of(lambda b: there(b.stages).work, lambda b: _pair_work(b, "external", "internal")),
        "friction work, external pair": Of(
            lambda b: there(b.stages).external.work, lambda b: _pair_work(b, "external")
        ),
        "friction work, internal pair": Of(
            lambda b: there(b.stages).internal.work, lambda b: _pair_work(b, "internal")
        ),
        "share of the external pair": Of(
            lambda b: there(b.stages).external.work / there(b.stages).work, _external_share
        ),
        "share of the internal pair": Of(
            lambda b: there(b.stages).internal.work / there(b.stages).work, lambda b: 1 - _external_share(b)
        ),
    },
    "stages",
)


# --- the estimates ---------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class EngineeringEstimates(RowTable[EstimateRow]):
    """Classical estimates of a brake from its scene, beside its simulation where there is one.

    - `rows`: the estimates in order; `inputs`: what they are made from and where each number is from; `about`: the
      braking that they are of
    - `estimates["stopping time"]` is one row; `str` gives the table, `as_dict` the same as numbers and words
    """

    kind: ClassVar[str] = "estimate"

    def parts(self) -> list[str | Table]:
        return [*self.head(), "", *table_of(self.rows)]

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words; numbers that are not finite are `None`."""
        return {"about": self.about, "inputs": plain(self.inputs), "estimates": [row.as_dict() for row in self.rows]}


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
    return of_result(run, inputs, stop, stages, values), about


def of_result(
    result: Result,
    inputs: Mapping[str, Input],
    stop: ClassicalStop | None,
    stages: StagedStop | None,
    values: RunValues,
) -> Braking:
    """The hardest braking of a run."""
    work, first = float(values.work[-1]), float(abs(values.omega[0]))
    return Braking(result.scene, inputs, stop, stages, result, values, values.duration, work, first)


def estimates(run: Scene | Result, data: EstimateData | None = None) -> EngineeringEstimates:
    """Classical estimates of a braking from its scene, and where they differ from its simulation (model §6.3).

    - `run`: a `Scene`, from which a classical stop gives time and friction work (all linings slide from the first
      moment under the maximum lever tension); or a `Result`: time and work are then those of its hardest braking, and
      every estimate stands beside the simulated number where the run has one
    - `data`: numbers that the scene does not have, or others in their place; what neither says is taken from the papers
      or assumed, and the report says so beside each

    Rows: stop and friction power with its shares (S-7…11), thermal penetration depth, Fourier numbers and effective
    volumes (S-15, steps 1–3), partition (S-41, Charron), bulk, surface, flash and maximum temperatures (S-25…28), real
    contact and surfaces (S-34…38), heat balance over four revolutions (S-17…21), thermal stress of the rim.

    Of a staged brake: its stages and the friction work of both pairs (after K), then the rows above for each pair, band
    and linings (`…, external pair`) and linings and rim (`…, internal pair`); balance and thermal stress are of the rim
    alone.

    Raises `InputError` for a scene with input errors, for a scene alone that has no classical stop (at rest at the
    start, a lever that holds the speed, a load that outweighs the brake, a self-locking lining), for a run in which
    nothing slides, and a traced or batched one.
    """
    braking, about = braking_of(run, data)
    found = _staged(braking) if braking.scene.brake.in_series else _single(braking)
    return EngineeringEstimates(f"engineering estimates{about}", tuple(braking.inputs.values()), tuple(found))


def _single(b: Braking) -> list[EstimateRow]:
    """All rows of a brake with one pair."""
    return [*fill(ROWS, b, "stop", "power"), *_of_pair(b)]


def _staged(b: Braking) -> list[EstimateRow]:
    """All rows of a staged brake: its stop, then both pairs, whose rows end with the name of the pair."""
    pairs = [
        dataclasses.replace(row, name=f"{row.name}, {one.pair} pair") for one in b.of_pairs() for row in _of_pair(one)
    ]
    return [*fill(STAGES, b), *fill(ROWS, b, "power"), *pairs]


def _of_pair(b: Braking) -> list[EstimateRow]:
    """What one pair heats, shares, temperatures, contact; of a rim also balance and stress."""
    parts = [row for part in b.parts.values() for row in fill(PARTS, part, part=part.name)]
    tables = ["partition", "temperature", "contact", *(["balance", "stress"] if b.part == "rim" else [])]
    return [*parts, *fill(ROWS, b, *tables, part=b.part)]
