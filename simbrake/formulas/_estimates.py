"""Engineering estimates of a braking: every formula is one row of data, with its simulated counterpart."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np

from .._base._table import Table, plain
from .._parts._material import effusivity_share
from .._parts._scene import Scene
from .._run._result import Result
from ._braking import Braking, HeatedPart, braking_of
from ._inputs import EstimateData
from ._rows import EstimateRow, Row, RowTable, fill, table_of
from ._simulated import Layered, RunValues
from .contact import current_density, real_contact_area, series_conductivity, series_resistance
from .heating import fourier_parameter, maximum_temperatures, plate_stress, schmidt, slab_rise, transmission_table

_row, _part_row = Row[Braking], Row[HeatedPart]


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


# --- the rows ---------------------------------------------------------------------------------------------------------


def of_run(f: Callable[[RunValues], float | None]) -> Callable[[Braking], float | None]:
    """A function of the run, `None` without one."""
    return lambda b: None if b.run is None else f(b.run)


def of_rim(f: Callable[[Layered], float | None]) -> Callable[[Braking], float | None]:
    """A function of the run where it has a rim in layers."""
    return lambda b: None if b.layered is None else f(b.layered)


def _metric(name: str) -> Callable[[Braking], float | None]:
    return lambda b: None if b.result is None else b.result.metrics.get(name)


_LEVER = "the lever takes time, the band stretches before it slides, hot linings rub less"

#: a stop by statics
STOP = (
    _row("tension ratio", "Π = ∏ (1 + f z)/(1 − f z)", "1", "Z-12…14", lambda b: b.by_statics.ratio).given(
        lambda b: [("f", b.friction, "1"), ("n", float(b.scene.brake.linings.count), "1")]
    ),
    _row("brake torque", "M_b = R_b T_0 (Π − 1)", "N*m", "Z-17", lambda b: b.by_statics.torque)
    .beside(of_run(lambda run: np.max(run.torque)), _LEVER)
    .given(lambda b: [("R_b", b.R_b, "m"), ("T_0", b.T_0, "N"), ("Π", b.by_statics.ratio, "1")]),
    _row("stopping time", "t = J ω_0/(M_b − M)", "s", "Z-18", lambda b: b.by_statics.time)
    .beside(_metric("stopping_time"), _LEVER)
    .given(lambda b: [("ω_0", b.omega, "rad/s"), ("M_b", b.by_statics.torque, "N*m")]),
    _row("stopping angle", "φ = ω_0 t/2", "rad", "", lambda b: b.by_statics.angle)
    .beside(_metric("stopping_angle"), _LEVER)
    .given(lambda b: [("ω_0", b.omega, "rad/s"), ("t", b.by_statics.time, "s")]),
    _row("friction work", "W = M_b φ", "J", "", lambda b: b.by_statics.work)
    .beside(
        of_run(lambda run: run.total_work),
        "a longer way adds work of the load, and what stretches the band does not rub",
    )
    .given(lambda b: [("M_b", b.by_statics.torque, "N*m"), ("φ", b.by_statics.angle, "rad")]),
    _row("friction power at first", "P = M_b ω_0", "W", "S-7", lambda b: b.by_statics.power)
    .beside(of_run(lambda run: np.max(np.diff(run.work) / np.diff(run.t))), _LEVER)
    .given(lambda b: [("M_b", b.by_statics.torque, "N*m"), ("ω_0", b.omega, "rad/s")]),
)


def _booked(i: int) -> Callable[[Braking], float | None]:
    return lambda b: None if b.run is None else b.booked.split(b.work)[i]


def _why_shares(b: Braking) -> str:
    return (
        "the run has shares of its own (`Scene.power_shares`)" if b.booked.heat < 1 else "in the run all of it is heat"
    )


#: the friction work in its shares
POWER = tuple(
    _row(name, formula, "J", "S-8…11", lambda b, i=i: b.power.split(b.work)[i]).beside(_booked(i), _why_shares)
    for i, (name, formula) in enumerate(
        (
            ("work into heat", "share of heat × W"),
            ("electrical work", "share of electricity × W"),
            ("mechanical work", "share of mechanical work × W"),
        )
    )
)

DEPTH = _part_row("depth of heat, {part}", "b = 1.73 √(a τ)", "m", "S, step 1", lambda p: p.depth).given(
    lambda p: [("a", p.diffusivity, "m^2/s"), ("τ", p.time, "s")]
)
FOURIER = _part_row("Fourier number, {part}", "a τ/δ², or 1/3 while b ≤ δ", "1", "S-15, step 2", lambda p: p.Fo).given(
    lambda p: [("a", p.diffusivity, "m^2/s"), ("τ", p.time, "s"), ("δ", p.thickness, "m"), ("b", p.depth, "m")]
)
PARAMETER = _part_row(
    "parameter B, {part}", "a/δ²", "1/s", "S, table 1", lambda p: fourier_parameter(p.diffusivity, p.thickness)
)
VOLUME = _part_row("effective volume, {part}", "A min(b, δ)", "m^3", "S, step 3", lambda p: p.volume).given(
    lambda p: [("A", p.area, "m^2"), ("b", p.depth, "m"), ("δ", p.thickness, "m")]
)
#: of each part that the pair heats
PARTS = (DEPTH, FOURIER, PARAMETER, VOLUME)


def simulated_share(b: Braking) -> float | None:
    """Share of the heat that enters the metal in the run."""
    if b.run is None or b.result is None or not b.scene.heated or not b.run.total_work > 0:
        return None
    entered = b.result.energy.get("heat_to_band" if b.part == "band" else "heat_to_metal")
    if b.pair == "internal" and entered is not None:  # without what the external pair sends beyond the linings
        entered = entered - b.beyond_share * b.result.energy["heat_external"]
    return None if entered is None else float(entered) / float(b.booked.split(b.run.total_work).heat)


def _transmission(b: Braking) -> float:
    K_1, K_2 = (float(np.asarray(K)) for K in transmission_table().transmissions(jnp.asarray(b.start_now)))
    return K_1 / (K_1 + K_2)


def _stack(b: Braking) -> tuple[list[float], list[float]]:
    """Thicknesses and conductivities of lining and band."""
    return [b.lining_thickness, b.band_thickness], [float(b.lining.conductivity), float(b.band.conductivity)]


def on_rim(f: Callable[[Braking], float | None]) -> Callable[[Braking], float | None]:
    """A function of a braking that only a rim has."""
    return lambda b: None if b.part == "band" else f(b)


SHARE_WHY = "the simulated share is of where the heat enters by the scene's own law, before bodies exchange any"
EFFUSIVITIES = (
    _row(
        "share into the {part}, effusivities",
        "e_1/(e_1 + e_2)",
        "1",
        "Charron",
        lambda b: effusivity_share(b.metal, b.lining),
    )
    .beside(simulated_share, SHARE_WHY)
    .given(
        lambda b: [
            ("e_1", float(b.metal.effusivity), "W*s^0.5/(m^2*K)"),
            ("e_2", float(b.lining.effusivity), "W*s^0.5/(m^2*K)"),
        ]
    )
)
TRANSMISSION = (
    _row("share into the rim, transmission", "K_1/(K_1 + K_2)", "1", "S-41; V2", on_rim(_transmission))
    .beside(simulated_share, SHARE_WHY)
    .given(lambda b: [("T", b.start_now, "K")])
)
#: heat partition coefficient, and the way of the heat through lining and band
PARTITION = (
    EFFUSIVITIES,
    TRANSMISSION,
    _row(
        "conductivity, lining and band",
        "Σδ/Σ(δ/λ)",
        "W/(m*K)",
        "S-30",
        on_rim(lambda b: series_conductivity(*_stack(b))),
    ),
    _row(
        "resistance, lining and band",
        "Σ δ/(λ A)",
        "K/W",
        "S-30",
        on_rim(lambda b: series_resistance(*(d / (k * b.lining_area) for d, k in zip(*_stack(b), strict=True)))),
    ),
)


def _schmidt(b: Braking) -> float:
    """Maximum face temperature with the run's own heat, else that at the end of a constant flux."""
    if b.run_schmidt is not None:
        return float(np.max(b.run_schmidt.temperature[:, 0]))
    course = schmidt(b.metal, b.metal_thickness, 40, b.time, b.flux, start=b.start_now)
    return float(np.interp(b.time, course.t, course.temperature[:, 0]))


def _maximum(i: int) -> Callable[[Braking], float | None]:
    """The maximum temperature in one of S's combinations, `None` at rest."""
    return lambda b: (
        None if b.flash is None else b.start_now + maximum_temperatures(b.heated.rise, b.falling_rise, b.flash)[i]
    )


BULK_WHY = "2/3 is for power that falls linearly from the first moment, and G is all of the heated depth"
SCHEME_WHY = "the scheme has no exchange with linings and air; constant properties; layers of another thickness"
_MAXIMUM = "the run's surface has no flash; S does not derive its factors; t_s holds the bulk, which t_v adds again"
#: the maximum temperature in S's combinations, side by side
MAXIMUM = tuple(
    _row(f"maximum temperature, {name}", formula, "K", source, _maximum(i))
    .beside(lambda b: b.peak, _MAXIMUM)
    .given(
        lambda b: [
            ("T", b.start_now, "K"),
            ("t_s", b.falling_rise, "K"),
            ("t_v", b.heated.rise, "K"),
            ("t_f", b.flash or 0.0, "K"),
        ]
    )
    for i, (name, formula, source) in enumerate(
        (
            ("S-26", "T + t_s + t_f/3", "S-26"),
            ("S-27", "T + t_v + t_s/3 + t_f/3", "S-27, doubtful scan"),
            ("sum", "T + t_v + t_s + t_f", ""),
        )
    )
)
FLASH = _row("flash temperature, rise", "(2 q/λ) √(a l/(π v))", "K", "Blok, Jaeger", lambda b: b.flash).given(
    lambda b: [("v", b.speed, "m/s"), ("f", b.friction, "1"), ("HB", b.hardness, "Pa"), ("l", b.spot_length, "m")]
)
FALLING = (
    _row(
        "surface temperature, falling flux",
        "half-space, q_0 (1 − t/τ), t = τ/2",
        "K",
        "Carslaw & Jaeger §2.9",
        lambda b: b.start_now + b.falling_rise,
    )
    .beside(lambda b: b.peak, "the power does not fall linearly; a half-space has no back")
    .given(
        lambda b: [
            ("T", b.start_now, "K"),
            ("q_0", 2 * b.flux, "W/m^2"),
            ("τ", b.time, "s"),
            ("e", float(b.metal.effusivity), "W*s^0.5/(m^2*K)"),
        ]
    )
)
#: temperatures of the metal
TEMPERATURES = (
    _row("bulk temperature, mean", "T + (2/3) a W/(c G)", "K", "S-25", lambda b: b.start_now + b.heated.rise).beside(
        lambda b: None if b.bodied is None else np.mean(b.body_mean(b.heated.depth)), BULK_WHY
    ),
    _row("bulk temperature, end", "T + a W/(c G_rim)", "K", "", lambda b: b.start_now + b.whole_rise).beside(
        lambda b: None if b.bodied is None else b.body_mean(math.inf)[-1],
        "heat exchanged with linings and air during the braking, properties that change with temperature",
    ),
    _row(
        "surface temperature, constant flux",
        "slab, adiabatic back, t = τ",
        "K",
        "Carslaw & Jaeger §3.8",
        lambda b: b.start_now + b.plate_rise,
    ).beside(of_rim(lambda run: run.surface[-1]), "the power falls towards the end, when the formula is hottest"),
    FALLING,
    FLASH,
    *MAXIMUM,
    _row(
        "surface temperature, Schmidt",
        lambda b: "½ (t_{j−1} + t_{j+1}), " + ("constant flux" if b.run_schmidt is None else "the run's own heat"),
        "K",
        "S-28",
        _schmidt,
    ).beside(
        lambda b: None if b.run_schmidt is None else b.peak, lambda b: "" if b.run_schmidt is None else SCHEME_WHY
    ),
)

PRESSURE = _row("pressure, mean", "W/(f s A_l)", "Pa", "S-7", lambda b: b.pressure).given(
    lambda b: [("W", b.work, "J"), ("s", b.travel, "m"), ("A_l", b.face_area, "m^2")]
)
#: real contact, surfaces, and the heat through the rim
CONTACT = (
    PRESSURE,
    _row(
        "real contact area",
        "A_a p/HB",
        "m^2",
        "S-34",
        lambda b: None if b.pressure is None else real_contact_area(b.face_area, b.pressure, b.hardness),
    ),
    _row("polished surface", "2 π R b", "m^2", "S-35", on_rim(lambda b: b.track_area)),
    _row("matte surfaces", "Σ A", "m^2", "S-36", on_rim(lambda b: b.matte_area)),
    _row("radiation coefficient", "ε σ (T² + T_a²)(T + T_a)", "W/(m^2*K)", "S-37, 38", on_rim(lambda b: b.radiation)),
    _row(
        "drop over the rim, stationary flux",
        "q δ/λ",
        "K",
        "S-23",
        on_rim(lambda b: b.flux * b.rim_thickness / float(b.rim.conductivity)),
    ).beside(
        of_rim(lambda run: run.drop), "while the rim soaks, its back takes nothing and the flux varies over the depth"
    ),
    _row(
        "flux by the greatest drop",
        "λ ΔT/δ",
        "W/m^2",
        "S-23",
        lambda b: (
            None if b.layered is None else current_density(float(b.rim.conductivity), b.layered.drop, b.rim_thickness)
        ),
    ),
)


def _balance(name: str) -> Callable[[Braking], float | None]:
    return lambda b: None if b.balance is None else b.balance._asdict()[name]


def _air(b: Braking) -> list[tuple[str, float, str]]:
    """What the open track rejects heat by."""
    by = [("h", b.coefficient, "W/(m^2*K)"), ("ε", b.emissivity, "1")]
    return [*by, ("T", b.start_now, "K"), ("T_a", b.ambient, "K")]


def _under(b: Braking) -> tuple[str, float, str]:
    """The flux under the linings."""
    return ("q_1", b.flux / b.overlap, "W/m^2")


#: heat balance of the rim over four revolutions at the mean speed of the braking
BALANCE = (
    _row("overlap coefficient", "κ = ΣA_l/A_a", "1", "S-21", lambda b: b.overlap if b.balance else None).given(
        lambda b: [("A_l", b.lining_area, "m^2"), ("A_a", b.track_area, "m^2")]
    ),
    _row("time of four revolutions", "τ = 2 π n/ω", "s", "S-17", _balance("time")).given(
        lambda b: [("n", 4.0, "1"), ("ω", b.mean_omega, "rad/s")]
    ),
    _row("heat gained in it", "q_1 A_a κ τ", "J", "S-18", _balance("gained")).given(
        lambda b: [_under(b), ("A_a", b.track_area, "m^2"), ("κ", b.overlap, "1")]
    ),
    _row("heat given away in it", "h (T − T_a) A_a (1 − κ) τ", "J", "S-19", _balance("lost")).given(
        lambda b: [*_air(b), ("κ", b.overlap, "1")]
    ),
    _row("mean flux kept", "κ q_1 − (1 − κ) h (T − T_a)", "W/m^2", "S-21", _balance("mean_flux")).given(
        lambda b: [_under(b), ("κ", b.overlap, "1"), *_air(b)]
    ),
)


def _free(b: Braking) -> float:
    """Thermal stress of the surface where the rim may bend."""
    z = b.rim_thickness * np.linspace(0.0, 1.0, 401) ** 2
    rise = np.asarray(slab_rise(b.flux, b.time, b.rim_thickness, b.rim, z))
    return float(plate_stress(rise, z, b.elastic, restraint="none")[0])


def _worst(i: int) -> Callable[[Braking], float | None]:
    """Time (s), stress (Pa) and ratio where the stress of the run is largest."""
    return lambda b: None if b.layered is None else b.layered.stress(b.elastic).worst[i]


def _slab_numbers(b: Braking) -> list[tuple[str, float, str]]:
    elastic = b.elastic
    constants = [("E", elastic.young, "Pa"), ("α_T", elastic.expansion, "1/K"), ("ν", elastic.poisson, "1")]
    return [*constants, ("q", b.flux, "W/m^2"), ("τ", b.time, "s"), ("δ", b.rim_thickness, "m")]


_WORST = "the greatest difference comes before the end, while the power is high"
#: thermal stress of the rim's surface: of the slab under constant flux, beside that of the simulated profiles
STRESS = (
    _row("thermal stress, surface", "−E α (T_s − T_m)/(1 − ν)", "Pa", "model §6.3", lambda b: b.stress)
    .beside(_worst(1), _WORST)
    .given(_slab_numbers),
    _row("thermal stress, free to bend", "plate without restraint", "Pa", "Timoshenko & Goodier §132", _free).given(
        _slab_numbers
    ),
    _row("stress over permissible", "|σ|/σ_p", "1", "S, step 11", lambda b: abs(b.stress) / b.elastic.permissible)
    .beside(_worst(2), _WORST)
    .given(lambda b: [("σ_p", b.elastic.permissible, "Pa")]),
    _row("time of greatest stress", "at the end: τ", "s", "", of_rim(lambda run: run.duration)).beside(
        lambda b: None if b.layered is None else b.layered.stress(b.elastic).worst[0] - b.layered.t[0], _WORST
    ),
)


# --- of a staged brake ------------------------------------------------------------------------------------------------

_MODEL = "model §4, after K"
_STAGED = (
    "the lever takes time: until it reaches T_on the bandage rides along; the band stretches, hot linings rub less"
)


def _pair_torque(pair: str) -> Callable[[Braking], float | None]:
    def value(b: Braking) -> float | None:
        run = b.pair_runs.get(pair)
        return None if run is None else np.max(run.torque)

    return value


def _pair_work(*pairs: str) -> Callable[[Braking], float | None]:
    """Friction work of pairs in the run, 0 where a pair never slides."""

    def value(b: Braking) -> float | None:
        runs = [b.pair_runs[pair] for pair in pairs] if b.pair_runs else None
        return None if runs is None else sum(0.0 if run is None else float(run.work[-1]) for run in runs)

    return value


def _external_share(b: Braking) -> float | None:
    external, total = _pair_work("external")(b), _pair_work("external", "internal")(b)
    return external / total if external is not None and total else None


def _internal_share(b: Braking) -> float | None:
    share = _external_share(b)
    return None if share is None else 1 - share


def _onset(b: Braking) -> float | None:
    """Slack tension (N) at which the internal pair breaks away in the braking of a run."""
    if b.result is None or b.run is None:
        return None
    for event in b.result.events:
        if event.name == "internal_slip" and b.run.t[0] <= event.time <= b.run.t[-1]:
            return float(np.asarray(b.result.series(np.asarray([event.time])).slack_tension)[0])
    return None


def _lasted(i: int) -> Callable[[Braking], float | None]:
    """How long a stage lasted that has a part in the braking of a run (s)."""

    def value(b: Braking) -> float | None:
        if b.result is None or b.run is None:
            return None
        begin, end = b.run.t[0], b.run.t[-1]
        stages = [stage for stage in b.result.stages if stage.end > begin and stage.start < end]
        return sum((stage.duration for stage in stages if stage.name == f"stage_{i + 1}"), 0.0)

    return value


#: tension ratio, torques, durations of the stages, friction work of both pairs
STAGES = (
    _row("tension ratio", "Π = ∏ (1 + f z)/(1 − f z), band on linings", "1", "Z-12…14", lambda b: b.by_stages.ratio),
    _row(
        "slack tension of internal slip",
        "T_on = [R Σ f N_pre − J_b M/(J + J_b)]/[R_b (Π − 1) J/(J + J_b) − R Σ f (Π_i + Π_{i−1}) s_i]",
        "N",
        _MODEL,
        lambda b: b.by_stages.onset,
    ).beside(_onset, "coefficients and load as at the start; a lever that begins above it lets the pair go at once"),
    _row(
        "torque, external pair", "M_ext = R_b T_0 (Π − 1)", "N*m", "Z-17", lambda b: b.by_stages.external_torque
    ).beside(_pair_torque("external"), _STAGED),
    _row(
        "torque, both pairs slide",
        "M_int = R Σ f (N_i + N_pre)",
        "N*m",
        _MODEL,
        lambda b: b.by_stages.internal_torque,
    ).beside(_pair_torque("internal"), _STAGED),
    *(
        _row(f"stage {i + 1}", formula, "s", _MODEL, lambda b, i=i: b.by_stages.times[i]).beside(_lasted(i), _STAGED)
        for i, formula in enumerate(
            (
                "(J + J_b) ω_0/(M_ext − M) with T_0 ≤ T_on, else 0",
                "J_b ω_0/(M_ext − M_int)",
                "J ω_2/(M_3 − M), R_b (T_n − T_0) = M_3 = M_int(T_n)",
            )
        )
    ),
    _row("stopping time", "t_1 + t_2 + t_3", "s", _MODEL, lambda b: b.by_stages.time).beside(
        _metric("stopping_time"), _STAGED
    ),
    _row("stopping angle", "∫ ω dt, stage by stage", "rad", _MODEL, lambda b: b.by_stages.angle).beside(
        _metric("stopping_angle"), _STAGED
    ),
    _row("friction work", "W_ext + W_int", "J", _MODEL, lambda b: b.by_stages.work).beside(
        _pair_work("external", "internal"), _STAGED
    ),
    _row("friction work, external pair", "W_ext = M_ext φ_b", "J", _MODEL, lambda b: b.by_stages.external.work).beside(
        _pair_work("external"), _STAGED
    ),
    _row(
        "friction work, internal pair",
        "W_int = M_int (φ_2 − φ_b) + M_3 φ_3",
        "J",
        _MODEL,
        lambda b: b.by_stages.internal.work,
    ).beside(_pair_work("internal"), _STAGED),
    _row(
        "share of the external pair",
        "W of the pair/W",
        "1",
        _MODEL,
        lambda b: b.by_stages.external.work / b.by_stages.work,
    ).beside(_external_share, _STAGED),
    _row(
        "share of the internal pair",
        "W of the pair/W",
        "1",
        _MODEL,
        lambda b: b.by_stages.internal.work / b.by_stages.work,
    ).beside(_internal_share, _STAGED),
)


# --- the function -----------------------------------------------------------------------------------------------------


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
    rows = _staged(braking) if braking.scene.brake.in_series else _single(braking)
    return EngineeringEstimates(f"engineering estimates{about}", tuple(braking.inputs.values()), tuple(rows))


def _single(b: Braking) -> list[EstimateRow]:
    """All rows of a brake with one pair."""
    stop = [] if b.stop is None else fill(STOP, b)
    return [*stop, *fill(POWER, b), *_of_pair(b)]


def _staged(b: Braking) -> list[EstimateRow]:
    """All rows of a staged brake: its stop, then both pairs, whose rows end with the name of the pair."""
    stop = [] if b.stages is None else fill(STAGES, b)
    pairs = [
        dataclasses.replace(row, name=f"{row.name}, {one.pair} pair") for one in b.of_pairs() for row in _of_pair(one)
    ]
    return [*stop, *fill(POWER, b), *pairs]


def _of_pair(b: Braking) -> list[EstimateRow]:
    """What one pair heats, shares, temperatures, contact; of a rim also balance and stress."""
    rows = [row for part in b.parts.values() for row in fill(PARTS, part, part.name)]
    groups = (
        (PARTITION, TEMPERATURES, CONTACT) if b.part == "band" else (PARTITION, TEMPERATURES, CONTACT, BALANCE, STRESS)
    )
    return [*rows, *(row for group in groups for row in fill(group, b, b.part))]
