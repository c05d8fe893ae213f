"""Every estimate once, by subject: its name, formula, value, source, simulated value,
and why the two differ."""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..._base._table import plain
from ...loads import AbstractHookLoad
from ...thermal.heat import shares_of_S
from . import heating
from ._braking import Braking
from ._heated import HeatedPart, RunValues
from .contact import (
    current_density,
    real_contact_area,
    series_conductivity,
    series_resistance,
)
from .statics import onset_at
from .stress import plate_stress


class Number(NamedTuple):
    """A number put into a formula: its symbol, value and unit.

    Example:
        >>> str(sb.formulas.Number("R", 0.59, "m"))
        'R = 0.59 m'
    """

    symbol: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.symbol} = {self.value:.5g} {unit_text(self.unit)}".rstrip()


def unit_text(unit: str) -> str:
    """A unit as written after a number: nothing for a pure number."""
    return "" if unit == "1" else unit


_SYMBOLS = {
    "1": "f n n_r N Π α α_TP ε κ ν",
    "m": "b l r_d s R_b δ",
    "m^2": "A A_a A_l",
    "m/s": "v",
    "m^2/s": "a",
    "s": "t τ τ_T",
    "rad": "φ",
    "rad/s": "ω ω_0",
    "kg": "G",
    "N": "T_0",
    "N*m": "M_b",
    "Pa": "E HB σ_p",
    "J": "W",
    "J/(kg*K)": "c",
    "W/m^2": "q q_0 q_1",
    "W/(m*K)": "λ",
    "W/(m^2*K)": "h",
    "W*s^0.5/(m^2*K)": "e e_1 e_2",
    "K": "T T_a T_f T_lining T_rim T_v limit t_f t_s t_v",
    "1/K": "α_T",
}
_UNITS = {
    symbol: unit for unit, symbols in _SYMBOLS.items() for symbol in symbols.split()
}


def numbers(*others: Number, **values: float | np.ndarray) -> tuple[Number, ...]:
    """Numbers put into a formula, by their symbols in the unit of these."""
    return (
        *others,
        *(
            Number(symbol, float(value), _UNITS[symbol])
            for symbol, value in values.items()
        ),
    )


class EstimateRow(NamedTuple):
    """One estimate: its `name`, `formula`, `value` and `unit`, the `source` of the
    formula, the `simulated` value (`None` without a run, or where the run has no such
    number), `why` the two differ, and the `numbers` put into the formula. Temperatures
    are in K.

    Of a synthesis also its `step` (1…12), and of a permissible limit the `verdict`:
    `within limit` or `exceeded` by the estimate, and by the run where that differs.

    Example:
        >>> row = sb.estimates(scene)["friction work"]
        >>> row.formula, round(row.value / 1e3, 2)
        ('W = M_b φ', 508.01)
    """

    name: str
    formula: str
    value: Any
    unit: str
    source: str = ""
    simulated: Any = None
    why: str = ""
    numbers: tuple[Number, ...] = ()
    step: int = 0
    verdict: str = ""

    @property
    def difference(self) -> float | None:
        """Estimate less simulated value, `None` without one or where the estimate is
        not finite."""
        if self.simulated is None or not np.isfinite(self.value):
            return None
        apart = self.value - self.simulated
        return 0.0 if abs(apart) <= 1e-14 * abs(self.value) else apart  # rounding

    @property
    def words(self) -> str:
        """Name, value and unit."""
        return f"{self.name} {shown(self.value)} {unit_text(self.unit)}".rstrip()

    def as_dict(self) -> dict[str, Any]:
        """`{name, formula, value, unit, simulated, difference, source,
        why}`, of a synthesis with `step`, `numbers` and `verdict`."""
        keys = [
            "name",
            "formula",
            "value",
            "unit",
            "simulated",
            "difference",
            "source",
            "why",
        ]
        if self.step:
            keys = ["step", *keys, "numbers", "verdict"]
        return {key: plain(getattr(self, key)) for key in keys}


def shown(value: float) -> str:
    return f"{value:.5g}" if math.isfinite(value) else "none"


def present(rows: Iterable[EstimateRow]) -> Iterator[EstimateRow]:
    """The rows that have a value, as plain numbers."""
    for row in rows:
        if row.value is not None:
            simulated = None if row.simulated is None else float(row.simulated)
            yield row._replace(value=float(row.value), simulated=simulated)


# reasons why an estimate and a run differ that several rows have
LEVER = (
    "the lever takes time, the band stretches before it slides, hot linings rub less"
)
OWN_LAW = (
    "the simulated share is of where the heat enters by the scene's own law, "
    "before bodies exchange any"
)
BULK = (
    "2/3 is for power that falls linearly from the first moment, and G is all of "
    "the heated depth"
)
SCHEME = (
    "the scheme has no exchange with linings and air; constant properties; layers "
    "of another thickness"
)
_SLAB = (
    "the power does not fall linearly; rim and linings exchange heat with each "
    "other and the air"
)
_FLASH = (
    "the run's surface has no flash; S does not derive its factors; t_s holds the "
    "bulk, which t_v adds again"
)
_STRESS = "the maximum difference comes before the end, while the power is high"
_STAGED = (
    "the lever takes time: until it reaches T_on the bandage rides along; the "
    "band stretches, hot linings rub less"
)
_K = "model §4, after K"


def n_r(b: Braking) -> str:
    """Factor in formulas of torques of several alike rims."""
    return "" if b.rims == 1 else "n_r "


def of_rims(b: Braking) -> tuple[Number, ...]:
    """The number of several alike rims."""
    return () if b.rims == 1 else numbers(n_r=b.rims)


# --- the stop -----------------------------------------------------------------------


def stop_rows(
    b: Braking, time: float | None, angle: float | None, work: float | None
) -> Iterator[EstimateRow]:
    """The classical stop, beside time (s), angle (rad) and friction work (J) of a
    run."""
    stop = b.stop
    run = b.run
    if stop is None:
        return
    M_b = stop.torque
    omega_0 = b.omega
    symbols = numbers(f=b.friction, n=b.scene.brake.linings.count)
    formula = "Π = ∏ (1 + f z)/(1 − f z)"
    bands = b.scene.brake.bands_of_linings
    if all(getattr(linings, "continuous", False) for linings in bands):
        formula = "Π = exp(Σ f β)"
    if len(bands) > 1:
        formula = f"Π = Σ s_j Π_j, {formula.replace('Π', 'Π_j')}"
    yield EstimateRow(
        "tension ratio", formula, stop.ratio, "1", "Z-12…14", numbers=symbols
    )
    yield EstimateRow(
        "brake torque",
        f"M_b = {n_r(b)}R_b T_0 (Π − 1)",
        M_b,
        "N*m",
        "Z-17",
        run and run.torque.max(),
        LEVER,
        (*of_rims(b), *numbers(R_b=b.R_b, T_0=b.T_0, Π=stop.ratio)),
    )
    yield EstimateRow(
        "stopping time",
        "t = J ω_0/(M_b − M)",
        stop.time,
        "s",
        "Z-18",
        time,
        LEVER,
        numbers(ω_0=omega_0, M_b=M_b),
    )
    yield EstimateRow(
        "stopping angle",
        "φ = ω_0 t/2",
        stop.angle,
        "rad",
        "",
        angle,
        LEVER,
        numbers(ω_0=omega_0, t=stop.time),
    )
    yield EstimateRow(
        "friction work",
        "W = M_b φ",
        stop.work,
        "J",
        "",
        work,
        "a longer travel adds work of the load, and the energy that stretches the band "
        "is not friction work",
        numbers(M_b=M_b, φ=stop.angle),
    )
    power = run and np.max(
        np.diff(run.work) / np.diff(run.t)
    )  # means over neighbouring times
    yield EstimateRow(
        "initial friction power",
        "P = M_b ω_0",
        stop.power,
        "W",
        "S-7",
        power,
        LEVER,
        numbers(M_b=M_b, ω_0=omega_0),
    )


def power_rows(b: Braking) -> Iterator[EstimateRow]:
    """Shares of the friction work."""
    split = b.power.split(b.work)
    booked = b.run and b.booked.split(b.work)
    own = "the run has the shares of `Scene.power_shares`"
    why = own if b.booked.heat < 1 else "in the run all of it is heat"

    def share(name: str, words: str, part: str) -> EstimateRow:
        return EstimateRow(
            name,
            f"share of {words} × W",
            getattr(split, part),
            "J",
            "S-8…11",
            getattr(booked, part, None),
            why,
        )

    yield share("work into heat", "heat", "heat")
    yield share("electrical work", "electricity", "electrical")
    if b.stop is not None:
        yield EstimateRow(
            "heat power at the start, S-10",
            "0.68 M_b ω_0",
            shares_of_S().split(b.stop.power).heat,
            "W",
            "S-10, one reading",
            numbers=numbers(M_b=b.stop.torque, ω_0=b.omega),
        )
    yield share("mechanical work", "mechanical work", "mechanical")


def stage_rows(b: Braking) -> Iterator[EstimateRow]:
    """The stages of a staged brake, and the work of its pairs."""
    stages = b.stages
    run = b.run
    external = b.pair_runs.get("external")
    internal = b.pair_runs.get("internal")
    metrics = {} if run is None else run.result.metrics
    works = [0.0 if pair is None else pair.work[-1] for pair in b.pair_runs.values()]
    both = sum(works) if works else None
    share = works[0] / both if both else None
    slip = None if run is None else _internal_slip(run)
    onset = EstimateRow(
        "slack tension of internal slip",
        (
            "T_on = [R Σ f (N_pre − m r_m ω²) − J_b M/(J + J_b)]/[R_b (Π − 1) J/(J + J_b) "
            "− R Σ f (Π_i + Π_{i−1}) s_i]"
        )
        + ("" if b.rims == 1 else ", J and M over n_r"),
        onset_at(b.scene, slip[1]) if slip else stages and stages.onset,
        "N",
        _K,
        slip and slip[0],
        "coefficients and load as at the start; a lever that begins above it releases "
        "the pair at once",
        of_rims(b),
    )
    if stages is None:
        yield onset
        return

    def row(
        name: str,
        formula: str,
        value: float,
        unit: str,
        simulated: Any,
        source: str = _K,
    ) -> EstimateRow:
        return EstimateRow(name, formula, value, unit, source, simulated, _STAGED)

    yield EstimateRow(
        "tension ratio",
        "Π = ∏ (1 + f z)/(1 − f z), band on linings",
        stages.ratio,
        "1",
        "Z-12…14",
    )
    yield onset
    torque = external and external.torque.max()
    yield row(
        "torque, external pair",
        f"M_ext = {n_r(b)}R_b T_0 (Π − 1)",
        stages.external_torque,
        "N*m",
        torque,
        "Z-17",
    )
    formula = (
        f"M_int = {n_r(b)}R Σ f (N_i + N_pre − m r_m ω_b²) ≥ 0; its mean over stage 2"
    )
    torque = internal and internal.torque.max()
    yield row(
        "torque, both pairs slide", formula, stages.internal_torque, "N*m", torque
    )
    formulas = (
        f"(J + {n_r(b)}J_b) ω_0/(M_ext − M) with T_0 ≤ T_on, else 0",
        f"{n_r(b)}J_b ∫ dω_b/(M_ext − M_int)",
        f"J ω_2/(M_3 − M), {n_r(b)}R_b (T_n − T_0) = M_3 = M_int(T_n)",
    )
    for i, (formula, time) in enumerate(zip(formulas, stages.times, strict=True), 1):
        took = run and _stage_time(run, f"stage_{i}")
        yield row(f"stage {i}", formula, time, "s", took)
    yield row(
        "stopping time",
        "t_1 + t_2 + t_3",
        stages.time,
        "s",
        metrics.get("stopping_time"),
    )
    yield row(
        "stopping angle",
        "∫ ω dt, stage by stage",
        stages.angle,
        "rad",
        metrics.get("stopping_angle"),
    )
    yield row("friction work", "W_ext + W_int", stages.work, "J", both)
    by_external, by_internal = works or (None, None)
    yield row(
        "friction work, external pair",
        "W_ext = M_ext φ_b",
        stages.external.work,
        "J",
        by_external,
    )
    yield row(
        "friction work, internal pair",
        "W_int = ∫ M_int (ω − ω_b) dt + M_3 φ_3",
        stages.internal.work,
        "J",
        by_internal,
    )
    shares = (share, None if share is None else 1 - share)
    for pair, value, simulated in zip(
        ("external", "internal"), stages.shares, shares, strict=True
    ):
        yield row(f"share of the {pair} pair", "W of the pair/W", value, "1", simulated)


def _internal_slip(run: RunValues) -> tuple[float, float] | None:
    """Slack tension (N) and speed (rad/s) at which the internal pair breaks away."""
    slips = [
        e.time
        for e in run.result.events
        if e.name == "internal_slip" and run.t[0] <= e.time <= run.t[-1]
    ]
    if not slips:
        return None
    s = run.result.series(slips[:1])
    return float(s.slack_tension[0]), float(s.omega[0])


def _stage_time(run: RunValues, name: str) -> float:
    """Duration (s) of a stage in the brake application of a run."""
    return sum(
        stage.duration
        for stage in run.result.stages
        if stage.name == name and stage.end > run.t[0] and stage.start < run.t[-1]
    )


def operation_rows(b: Braking) -> Iterator[EstimateRow]:
    """Tensions, travel and loads of the linings beside the hardest brake application of
    a run."""
    stop = b.stop
    run = b.run
    (work, time) = b.stopping_load
    if stop is not None:
        why = (
            "the band holds against the load, is stretched before it slides, and hot "
            "linings rub less"
        )
        T_0 = b.T_0
        tension = run and run.series.slack_tension.max()
        yield EstimateRow(
            "slack tension, maximum", "T_0 of the lever", T_0, "N", "", tension, why
        )
        tension = run and run.series.tight_tension.max()
        yield EstimateRow(
            "tight tension, maximum",
            "Π T_0",
            stop.ratio * T_0,
            "N",
            "Z-14",
            tension,
            why,
            numbers(Π=stop.ratio, T_0=T_0),
        )
        why = "as the stopping angle; a band that is stretched meanwhile slides less"
        yield EstimateRow(
            "friction travel",
            "R_b φ",
            b.R_b * stop.angle,
            "m",
            "",
            run and run.slid,
            why,
            numbers(R_b=b.R_b, φ=stop.angle),
        )
        load = b.scene.duty.load
        if isinstance(load, AbstractHookLoad):
            angle = b.hardest_angle
            travel = load.travelled(stop.angle)
            why = "as the stopping angle"
            yield EstimateRow(
                "hook travel",
                "r_d φ/n",
                travel,
                "m",
                "",
                None if angle is None else load.travelled(angle),
                why,
                numbers(r_d=load.drum_radius, n=load.line_count),
            )
    else:
        torque = b.work * b.R_b / b.travel if b.travel else None
        yield EstimateRow(
            "mean brake torque",
            "W/φ",
            torque,
            "N*m",
            "energy",
            numbers=numbers(W=b.work),
        )
        yield EstimateRow(
            "friction work",
            "of the braking",
            b.work,
            "J",
            "run",
            numbers=numbers(τ=b.time),
        )
    area = b.lining_area
    why = "as friction work and stopping time"
    yield EstimateRow(
        "energy load of the linings",
        "W/A_l",
        work / area,
        "J/m^2",
        "S-7",
        run and b.work / area,
        why,
        numbers(W=work, A_l=area),
    )
    yield EstimateRow(
        "power load of the linings, mean",
        "W/(A_l τ)",
        work / (area * time),
        "W/m^2",
        "S-7",
        run and b.work / (area * b.time),
        why,
        numbers(W=work, A_l=area, τ=time),
    )


# --- heat ---------------------------------------------------------------------------


def part_rows(
    part: HeatedPart,
) -> tuple[EstimateRow, EstimateRow, EstimateRow, EstimateRow]:
    """Thermal penetration depth, Fourier number, parameter B and effective volume of a
    heated part."""
    name = part.name
    a = part.diffusivity
    time = part.time
    depth = part.depth
    thickness = part.thickness
    Fo = heating.effective_fourier_number(a, time, thickness)
    B = heating.fourier_parameter(a, thickness)
    b = EstimateRow(
        f"thermal penetration depth, {name}",
        "b = 1.73 √(a τ)",
        depth,
        "m",
        "S, step 1",
        numbers=numbers(a=a, τ=time),
    )
    fourier = EstimateRow(
        f"Fourier number, {name}",
        "a τ/δ², or 1/3 while b ≤ δ",
        Fo,
        "1",
        "S-15, step 2",
        numbers=numbers(a=a, τ=time, δ=thickness, b=depth),
    )
    parameter = EstimateRow(f"parameter B, {name}", "a/δ²", B, "1/s", "S, table 1")
    volume = EstimateRow(
        f"effective volume, {name}",
        "A min(b, δ)",
        part.volume,
        "m^3",
        "S, step 3",
        numbers=numbers(A=part.area, b=depth, δ=thickness),
    )
    return b, fourier, parameter, volume


def partition_rows(b: Braking) -> list[EstimateRow]:
    """Heat partition coefficient of the metal by two laws."""
    name = "heat partition coefficient"
    simulated = b.simulated_share
    charron = EstimateRow(
        f"{name}, {b.part}, effusivities",
        "e_1/(e_1 + e_2)",
        b.effusivity_share,
        "1",
        "Charron",
        simulated,
        OWN_LAW,
        numbers(e_1=b.metal.effusivity, e_2=b.lining.effusivity),
    )
    if b.part == "band":
        return [charron]
    K_1, K_2 = heating.transmission_table().transmissions(jnp.asarray(b.start_now))
    name = f"{name}, rim, transmission"
    return [
        charron,
        EstimateRow(
            name,
            "K_1/(K_1 + K_2)",
            K_1 / (K_1 + K_2),
            "1",
            "S-41; V2",
            simulated,
            OWN_LAW,
            numbers(T=b.start_now),
        ),
    ]


def stack_rows(b: Braking) -> Iterator[EstimateRow]:
    """Lining and band one after the other."""
    if b.part == "rim":
        thickness = np.array([b.lining_thickness, b.band_thickness])
        conductivity = np.array([b.lining.conductivity, b.band.conductivity])
        mean = series_conductivity(thickness, conductivity)
        resistance = series_resistance(*thickness / (conductivity * b.lining_area))
        yield EstimateRow(
            "conductivity, lining and band", "Σδ/Σ(δ/λ)", mean, "W/(m*K)", "S-30"
        )
        yield EstimateRow(
            "resistance, lining and band", "Σ δ/(λ A)", resistance, "K/W", "S-30"
        )


def temperature_rows(b: Braking) -> Iterator[EstimateRow]:
    """Temperatures of the metal: bulk, surface, and their maximum."""
    T = b.start_now
    q_0 = b.initial_flux
    time = b.time
    bulk = b.heated.bulk
    carslaw = "Carslaw & Jaeger §3.8"
    name = "surface temperature"

    def slab_peak(rise: Callable[..., Any]) -> float:
        """Maximum temperature (K) of the surface of a slab under a flux that falls
        linearly."""
        times = time * np.linspace(0.0, 1.0, 1025)
        return T + np.max(rise(q_0, times, time, b.metal_thickness, b.metal))

    yield EstimateRow(
        "bulk temperature, mean",
        "T + (2/3) a W/(c G)",
        bulk,
        "K",
        "S-25",
        b.simulated_bulk,
        BULK,
    )
    yield EstimateRow(
        "bulk temperature, end",
        "T + a W/(c G_rim)",
        b.end,
        "K",
        "",
        b.simulated_end,
        "heat exchanged with linings and air during the brake application, properties "
        "that change with temperature",
    )
    plate = T + heating.slab_rise(b.flux, time, b.metal_thickness, b.metal)
    yield EstimateRow(
        f"{name}, constant flux",
        "slab, adiabatic back, t = τ",
        plate,
        "K",
        carslaw,
        b.layered and b.layered.surface[-1],
        "the power falls towards the end, when the formula is hottest",
    )
    yield falling_row(b)
    symbols = numbers(T=T, q_0=q_0, τ=time)
    slab = slab_peak(heating.stopping_slab_rise)
    of_S = slab_peak(heating.reconstructed_surface_rise)
    yield EstimateRow(
        f"{name}, falling flux, slab",
        "slab, adiabatic back, q_0 (1 − t/τ), its maximum",
        slab,
        "K",
        carslaw,
        b.peak,
        _SLAB,
        symbols,
    )
    yield EstimateRow(
        f"{name}, S-24",
        "T + (α W/(λ A τ)) δ [τ_N/3 + Fo τ_W − third term]",
        of_S,
        "K",
        "S-24, third term lost: reconstructed",
        b.peak,
        _SLAB,
        symbols,
    )
    yield from maximum_rows(b)
    if b.run_schmidt is None:
        course = heating.schmidt(b.metal, b.metal_thickness, 40, time, b.flux, start=T)
        yield EstimateRow(
            f"{name}, Schmidt",
            "½ (t_{j−1} + t_{j+1}), constant flux",
            np.interp(time, course.t, course.temperature[:, 0]),
            "K",
            "S-28",
        )
    else:
        yield EstimateRow(
            f"{name}, Schmidt",
            "½ (t_{j−1} + t_{j+1}), the run's own heat",
            np.max(b.run_schmidt.temperature[:, 0]),
            "K",
            "S-28",
            b.peak,
            SCHEME,
        )


def falling_row(b: Braking) -> EstimateRow:
    """Surface of a half-space under a flux that falls linearly."""
    return EstimateRow(
        "surface temperature, falling flux",
        "half-space, q_0 (1 − t/τ), t = τ/2",
        b.start_now + b.falling_rise,
        "K",
        "Carslaw & Jaeger §2.9",
        b.peak,
        "the power does not fall linearly; a half-space has no back",
        numbers(T=b.start_now, q_0=b.initial_flux, τ=b.time, e=b.metal.effusivity),
    )


def maximum_rows(b: Braking) -> Iterator[EstimateRow]:
    """Flash temperature, and the maximum temperature in S's combinations; none at
    rest."""
    if b.flash is None:
        return
    T = b.start_now
    t_v = b.heated.rise
    t_s = b.falling_rise
    t_f = b.flash
    name = "maximum temperature"
    yield EstimateRow(
        "flash temperature, rise",
        "(2 q/λ) √(a l/(π v))",
        t_f,
        "K",
        "Blok, Jaeger",
        numbers=numbers(v=b.speed, f=b.friction, HB=b.hardness, l=b.spot_length),
    )
    of_S26, of_S27, plain = (
        T + rise for rise in heating.maximum_temperatures(t_v, t_s, t_f)
    )
    symbols = numbers(T=T, t_s=t_s, t_v=t_v, t_f=t_f)
    yield EstimateRow(
        f"{name}, S-26", "T + t_s + t_f/3", of_S26, "K", "S-26", b.peak, _FLASH, symbols
    )
    yield EstimateRow(
        f"{name}, S-27",
        "T + t_v + t_s/3 + t_f/3",
        of_S27,
        "K",
        "S-27, doubtful scan",
        b.peak,
        _FLASH,
        symbols,
    )
    yield EstimateRow(
        f"{name}, sum", "T + t_v + t_s + t_f", plain, "K", "", b.peak, _FLASH, symbols
    )


# --- contact, and the rim alone -----------------------------------------------------


def pressure_row(b: Braking) -> EstimateRow:
    """Mean pressure of the linings."""
    return EstimateRow(
        "pressure, mean",
        "W/(f s A_l)",
        b.pressure,
        "Pa",
        "S-7",
        numbers=numbers(W=b.work, s=b.travel, A_l=b.face_area),
    )


def contact_rows(b: Braking) -> Iterator[EstimateRow]:
    """Real contact, surfaces, and flow through the rim."""
    yield pressure_row(b)
    if b.pressure is not None:
        yield EstimateRow(
            "real contact area",
            "A_a p/HB",
            real_contact_area(b.face_area, b.pressure, b.hardness),
            "m^2",
            "S-34",
        )
    drop = b.layered and b.layered.drop
    thickness = b.rim_thickness
    conductivity = b.rim.conductivity
    if b.part == "rim":
        yield EstimateRow("polished surface", "2 π R b", b.track_area, "m^2", "S-35")
        yield EstimateRow("matte surfaces", "Σ A", b.matte_area, "m^2", "S-36")
        yield EstimateRow(
            "radiation coefficient",
            "ε σ (T² + T_a²)(T + T_a)",
            b.radiation,
            "W/(m^2*K)",
            "S-37, 38",
        )
        yield EstimateRow(
            "drop over the rim, stationary flux",
            "q δ/λ",
            b.flux * thickness / conductivity,
            "K",
            "S-23",
            drop,
            "until the heat reaches the back of the rim, no heat leaves there and the "
            "flux varies over the depth",
        )
    if drop is not None:
        yield EstimateRow(
            "flux by the maximum drop",
            "λ ΔT/δ",
            current_density(conductivity, drop, thickness),
            "W/m^2",
            "S-23",
        )


def balance_rows(b: Braking) -> list[EstimateRow]:
    """Heat balance of the rim over four revolutions at the mean speed; none at rest."""
    if not (b.omega > 0 and b.mean_omega > 0 and b.overlap > 0):
        return []
    q_1 = b.flux / b.overlap
    h = b.coefficient
    area = b.track_area
    kappa = b.overlap
    T = b.start_now
    T_a = b.ambient
    omega = b.mean_omega
    balance = heating.heat_balance(
        q_1,
        overlap=kappa,
        coefficient=h + b.radiation,
        surface=T,
        ambient=T_a,
        omega=omega,
        area=area,
    )
    formula = "κ q_1 − (1 − κ) h (T − T_a)"
    air = numbers(h=h, ε=b.emissivity, T=T, T_a=T_a, κ=kappa)
    mean = numbers(q_1=q_1, κ=kappa, h=h, ε=b.emissivity, T=T, T_a=T_a)
    covered = numbers(A_l=b.face_area, A_a=area)
    gained = numbers(q_1=q_1, A_a=area, κ=kappa)
    turns = numbers(n=4, ω=omega)
    return [
        EstimateRow(
            "overlap coefficient", "κ = ΣA_l/A_a", kappa, "1", "S-21", numbers=covered
        ),
        EstimateRow(
            "time of four revolutions",
            "τ = 2 π n/ω",
            balance.time,
            "s",
            "S-17",
            numbers=turns,
        ),
        EstimateRow(
            "heat gained in it",
            "q_1 A_a κ τ",
            balance.gained,
            "J",
            "S-18",
            numbers=gained,
        ),
        EstimateRow(
            "heat rejected in it",
            "h (T − T_a) A_a (1 − κ) τ",
            balance.lost,
            "J",
            "S-19",
            numbers=air,
        ),
        EstimateRow(
            "mean net flux", formula, balance.mean_flux, "W/m^2", "S-21", numbers=mean
        ),
    ]


def stress_rows(b: Braking) -> Iterator[EstimateRow]:
    """Thermal stress of the rim: a slab under the mean flux, at the end."""
    time, stress, ratio = b.run_stress or (None, None, None)
    E, alpha, nu, permissible = b.elastic
    symbols = numbers(E=E, α_T=alpha, ν=nu, q=b.flux, τ=b.time, δ=b.rim_thickness)
    name = "thermal stress"
    yield EstimateRow(
        f"{name}, surface",
        "−E α (T_s − T_m)/(1 − ν)",
        b.stress,
        "Pa",
        "model §6.3",
        stress,
        _STRESS,
        symbols,
    )
    depth = b.rim_thickness * np.linspace(0.0, 1.0, 401) ** 2
    rise = np.asarray(heating.slab_rise(b.flux, b.time, b.rim_thickness, b.rim, depth))
    yield EstimateRow(
        f"{name}, free to bend",
        "plate without restraint",
        plate_stress(rise, depth, b.elastic, restraint="none")[0],
        "Pa",
        "Timoshenko & Goodier §132",
        numbers=symbols,
    )
    yield EstimateRow(
        "stress over allowable",
        "|σ|/σ_p",
        b.stress_ratio,
        "1",
        "S, step 11",
        ratio,
        _STRESS,
        numbers(σ_p=permissible),
    )
    yield EstimateRow(
        "time of maximum stress",
        "at the end: τ",
        b.layered and b.layered.duration,
        "s",
        "",
        time,
        _STRESS,
    )


def rows_of_pair(b: Braking) -> Iterator[EstimateRow]:
    """Rows of one pair: heated parts, shares, temperatures, contact; of a rim also
    balance and stress."""
    for part in b.parts.values():
        yield from part_rows(part)
    yield from (
        *partition_rows(b),
        *stack_rows(b),
        *temperature_rows(b),
        *contact_rows(b),
    )
    if b.part == "rim":
        yield from (*balance_rows(b), *stress_rows(b))
