"""The parametric synthesis: S's twelve steps over a scene or a run."""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np

from ..._base._faults import Issues, input_error
from ..._base._table import Table, frozen, plain
from ...parts.scene import Scene, banded_brake
from ...parts.scene_checks import faults
from ...runs.measure import LimitVerdict
from ...runs.result import Result
from ...thermal.heat import AbstractPartition
from ...thermal.materials import ROOM, Material, effusivity_share
from . import _rows as rows
from . import heating
from ._braking import Braking
from ._estimates import RowTable, braking_of, table_of
from ._heated import HeatedPart, schmidt_layers
from ._rows import BULK, OWN_LAW, SCHEME, EstimateRow, Number, numbers
from .inputs import EstimateData, Permissible, faults_of_data
from .statics import classical_stop

#: above this mean bulk temperature (K) properties are taken at it (S, step 6), below at
#: room temperature
REPLACED_ABOVE = 273.15 + 150.0
# the band takes up no friction heat in a brake with one pair
HEATED = ("rim", "lining")


# --- properties at the resulting temperature ----------------------------------------


class SynthesisError(RuntimeError):
    """A synthesis that did not converge, with the reason as `code`.

    - `no_convergence`: the temperatures still changed after the last round
    - `material_range`: a property, linear in the temperature, would no longer be
      positive

    Example:
        >>> str(sb.formulas.SynthesisError("no_convergence", "after 50 rounds"))
        'no_convergence: after 50 rounds'
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{code}: {message}")
        self.code = code


def property_at(material: Material, name: str, T: float) -> float:
    """`conductivity` or `specific_heat` at `T` (K)."""
    value = float(getattr(material, name))
    slope = getattr(material, f"{name}_slope")
    return (
        value
        if slope is None
        else value * (1 + float(slope) * (T - float(material.reference)))
    )


def properties_at(material: Material, T: float, part: str) -> Material:
    """The material with its properties at `T` (K), constant. Raises `SynthesisError`
    where one is not positive."""
    properties = {
        name: property_at(material, name, T)
        for name in ("conductivity", "specific_heat")
    }
    for name, value in properties.items():
        if not value > 0:
            end = float(material.reference) - 1 / float(
                getattr(material, f"{name}_slope")
            )
            words = (
                f"{name.replace('_', ' ')} of the {part}, linear in the "
                f"temperature, falls to 0 at {end:.5g} K"
            )
            raise SynthesisError(
                "material_range", f"{words}; the bulk temperature is {T:.5g} K"
            )
    return Material(density=material.density, **properties)


_Law = Callable[[dict[str, float], dict[str, Material]], float]
Parts = dict[str, HeatedPart]  # by name, with constant properties


def share_law(b: Braking, partition: AbstractPartition | None) -> _Law:
    """Heat partition coefficient of the rim from temperatures and materials: a given
    number or law, the scene's law, else Charron's.

    Raises `InputError` where both a number and a law are given.
    """
    source = b.inputs["share"].source
    pair = b.scene.network.friction
    if partition is not None and source == "given":
        raise input_error(
            "share", "is given beside a law of the partition", "give one of the two"
        )
    if source == "given":
        return lambda T, materials: b.share
    law = partition
    if law is None and source == "scene" and pair is not None:
        law = pair.partition
    if law is None:
        return lambda T, materials: float(
            effusivity_share(materials["rim"], materials["lining"])
        )
    return lambda T, materials: float(
        np.mean(np.asarray(law.share(jnp.asarray(T["rim"]), jnp.asarray(T["lining"]))))
    )


def one_pass(
    b: Braking, start: dict[str, float], at: dict[str, float], law: _Law
) -> Parts:
    """Steps 1 to 5, depth, Fourier number, volume, share and bulk temperature, with
    properties at `at` (K)."""
    materials = {
        name: properties_at(part.material, at[name], name)
        for name, part in b.parts.items()
    }
    share = law({name: max(at[name], start[name]) for name in materials}, materials)
    shares = {"rim": share, "lining": 1 - share, "band": 0.0}
    return {
        name: dataclasses.replace(
            part, material=materials[name], start=start[name], share=shares[name]
        )
        for name, part in b.parts.items()
    }


def refine(
    b: Braking,
    start: dict[str, float],
    partition: AbstractPartition | None,
    tolerance: float,
    rounds: int,
) -> tuple[Parts, Parts, int, float]:
    """Repeat steps 1 to 5 with properties at the bulk temperatures they gave, until
    these converge (K).

    The first pass, with properties at room temperature; the last; how many rounds, and
    the change (K) in the last.

    A part whose first bulk temperature stays at or below 150 °C keeps the properties of
    room temperature throughout, as S words it: the choice is made once, since switching
    during the iteration could leave the equations without a solution. The rest is a
    plain fixed-point iteration: for a capacity that rises with the temperature it
    always contracts; for one that falls it climbs to the lowest solution, or out of the
    material's range where there is none. Raises `SynthesisError` with the code
    `no_convergence` or `material_range`.
    """
    law = share_law(b, partition)
    first = last = one_pass(b, start, dict.fromkeys(start, ROOM), law)
    replaced = replaced_in(first)
    change = math.inf
    if not replaced:
        return first, first, 0, 0.0
    for n in range(1, rounds + 1):
        at = {part: last[part].bulk if part in replaced else ROOM for part in start}
        before = last
        last = one_pass(b, start, at, law)
        change = max(abs(last[part].bulk - before[part].bulk) for part in HEATED)
        if change <= tolerance:
            return first, last, n, change
    temperatures = ", ".join(f"{part} {last[part].bulk:.6g} K" for part in replaced)
    words = (
        f"after {rounds} rounds the bulk temperatures still change by {change:.3g} "
        f"K ({temperatures})"
    )
    raise SynthesisError(
        "no_convergence",
        f"{words}; allow more rounds, or the brake application is close to a thermal runaway",
    )


def replaced_in(first: Parts) -> tuple[str, ...]:
    """Parts whose properties are replaced by those at their temperature."""
    return tuple(part for part in HEATED if first[part].bulk > REPLACED_ABOVE)


# --- the steps ----------------------------------------------------------------------


@frozen
class Chain:
    """The brake application of a synthesis: `before` with properties at room
    temperature, `after` with those of step 7.

    `first`, `last`: passes of the `rounds` between the two, the last of which changed
    temperatures by `change` (K); `start`: temperatures (K) of the parts at the
    beginning; `limits` (SI).
    """

    before: Braking
    after: Braking
    first: Parts
    last: Parts
    rounds: int
    change: float
    start: dict[str, float]
    limits: dict[str, float]

    @functools.cached_property
    def schmidt(self) -> heating.SchmidtCourse:
        """Schmidt's scheme with the heat of the run, else with the falling power of a
        stop."""
        b = self.after
        share = b.share * b.power.heat
        run = b.run
        if b.layered is not None:
            return b.layered.schmidt(b.rim, share, b.track_area)

        def work(t: float) -> float:
            if run is not None:
                return np.interp(run.t[0] + t, run.t, run.work)
            s = min(t / b.time, 1.0)
            return b.work * (2 * s - s**2)

        def flux(t0: float, t1: float) -> float:
            return share * (work(t1) - work(t0)) / (b.track_area * (t1 - t0))

        layers = schmidt_layers(b.rim, b.rim_thickness, b.time)
        return heating.schmidt(
            b.rim, b.rim_thickness, layers, b.time, flux, start=self.start["rim"]
        )

    @property
    def face_peak(self) -> float:
        """Maximum temperature of the rim's face by Schmidt's scheme (K)."""
        return np.max(self.schmidt.temperature[:, 0])

    @property
    def lining_body(self) -> float:
        """Mean temperature of the whole lining at the beginning (K)."""
        run = self.before.run
        return (
            self.start["lining"]
            if run is None or run.lining is None
            else run.lining.mean()[0]
        )

    @property
    def lining_back(self) -> tuple[float, float | None]:
        """Temperature (K) of its back after the brake application, and in the run."""
        b = self.after
        course = self.before.run and self.before.run.lining
        back = heating.back_temperature(
            b.lining,
            b.lining_thickness,
            b.time,
            face=self.face_peak,
            start=self.lining_body,
        )
        return back, course and course.layers[:, -1].max()


def _depths(c: Chain) -> Iterator[EstimateRow]:
    yield from (rows.part_rows(part)[0] for part in c.first.values())
    depth = c.first["rim"].depth
    rim = c.before.run and c.before.run.rim
    within = None
    if rim is not None:  # share of its simulated heat within the depth at the end
        rise = rim.layers[-1] - rim.layers[0]
        whole = rise @ rim.steps
        within = rise @ rim.inside(depth) / whole if whole > 0 else None
    yield EstimateRow(
        "rim's heat within the depth",
        "1: all of it",
        1,
        "1",
        "S, steps 1, 3",
        within,
        "the temperature profile has no sharp edge; it also depends on the thickness "
        "and on earlier heating",
        numbers(b=depth),
    )


def _fourier_number(part: HeatedPart) -> EstimateRow:
    return rows.part_rows(part)[1]._replace(
        formula="a τ/δ², for b > δ" if part.depth > part.thickness else "1/3, for b ≤ δ"
    )


def _partition(c: Chain) -> Iterator[EstimateRow]:
    simulated = c.before.simulated_share
    share = c.first["rim"].share
    name = "heat partition coefficient"
    yield EstimateRow(
        f"{name}, rim",
        _law_words(c),
        share,
        "1",
        "S, step 4",
        simulated,
        OWN_LAW,
        numbers(T_rim=c.start["rim"], T_lining=c.start["lining"]),
    )
    rest = c.first["lining"].share
    left = None if simulated is None else 1 - simulated
    yield EstimateRow(
        f"{name}, linings",
        "1 − α_TP",
        rest,
        "1",
        "S-42",
        left,
        OWN_LAW,
        numbers(α_TP=share),
    )
    yield from rows.partition_rows(c.before)


def _law_words(c: Chain) -> str:
    """Source of the heat partition coefficient."""
    source = c.before.inputs["share"].source
    if source.startswith("effusivities"):
        return "α_TP = e_1/(e_1 + e_2)"
    return "α_TP: law of the scene" if source == "scene" else "α_TP, as given"


def _bulk(parts: Parts) -> Iterator[EstimateRow]:
    for name in HEATED:
        part = parts[name]
        also = "as for the rim; linings and rim also exchange heat through the contact"
        yield EstimateRow(
            f"mean bulk temperature, {name}",
            "T + (2/3) α W/(c G)",
            part.bulk,
            "K",
            "S-25, step 5",
            part.simulated_bulk,
            also if name == "lining" else BULK,
            numbers(
                T=part.start,
                α=part.share,
                W=part.work,
                c=part.material.specific_heat,
                G=part.mass,
            ),
        )


def _properties(c: Chain) -> Iterator[EstimateRow]:
    replaced = replaced_in(c.first)
    source = "S, step 6"
    for name in HEATED:
        part = c.first[name]
        material = c.before.parts[name].material
        T = part.bulk if name in replaced else ROOM
        words = (
            "T_v of step 5"
            if T > REPLACED_ABOVE
            else "room: T_v of step 5 is not above 150 °C"
        )
        symbols = numbers(T_v=part.bulk, limit=REPLACED_ABOVE)
        yield EstimateRow(
            f"temperature of the properties, {name}",
            words,
            T,
            "K",
            source,
            numbers=symbols,
        )
        for field, symbol, unit in (
            ("conductivity", "λ", "W/(m*K)"),
            ("specific_heat", "c", "J/(kg*K)"),
        ):
            slope = getattr(material, f"{field}_slope")
            at_room = Number(symbol, float(getattr(material, field)), unit)
            words = f"{symbol} (no temperature dependence known)"
            symbols = (at_room,)
            if slope is not None:
                law = Number("b", float(slope), "1/K"), Number("T", T, "K")
                words = f"{symbol} [1 + b (T − T_r)]"
                symbols = (at_room, *law, Number("T_r", float(material.reference), "K"))
            value = float(getattr(properties_at(material, T, name), field))
            simulated = None
            # the law of the scene there
            if part.course is not None and part.simulated_bulk is not None:
                simulated = property_at(
                    part.course.wall.material, field, part.simulated_bulk
                )
            yield EstimateRow(
                f"{field.replace('_', ' ')}, {name}",
                words,
                value,
                unit,
                source,
                simulated,
                "the run evaluates it at the local temperature",
                symbols,
            )


def _repeated(c: Chain) -> Iterator[EstimateRow]:
    change = Number("last change", c.change, "K")
    yield EstimateRow(
        "rounds of steps 1 to 5",
        "until T_v converges"
        if c.rounds
        else "none: properties stay those of room temperature",
        c.rounds,
        "1",
        "S, step 7",
        numbers=(change,),
    )
    parts = [c.last[name] for name in HEATED]
    name = "heat partition coefficient, rim, refined"
    reached = [rows.part_rows(part)[0] for part in parts] + [
        _fourier_number(part) for part in parts
    ]
    yield from _refined([*reached, *(rows.part_rows(part)[3] for part in parts)])
    yield EstimateRow(
        name,
        _law_words(c),
        c.last["rim"].share,
        "1",
        "S, step 7",
        c.before.simulated_share,
        OWN_LAW,
        numbers(T_rim=c.last["rim"].bulk, T_lining=c.last["lining"].bulk),
    )
    yield from _refined(_bulk(c.last))


def _refined(figures: Iterable[EstimateRow]) -> Iterator[EstimateRow]:
    return (row._replace(name=f"{row.name}, refined") for row in figures)


def _layers(c: Chain) -> Iterator[EstimateRow]:
    b = c.after
    course = c.schmidt
    run = c.after.layered
    simulated = None
    words = "½ (t_{j−1} + t_{j+1})"
    yield EstimateRow(
        "maximum face temperature",
        f"{words}, " + ("falling power" if b.run is None else "the run's own heat"),
        c.face_peak,
        "K",
        "S-28",
        b.peak,
        SCHEME,
        numbers(a=b.rim.diffusivity, q=b.flux, N=course.depth.size - 2),
    )
    end = [np.interp(b.time, course.t, column) for column in course.temperature.T]
    for i, place in enumerate(("face", "1/4", "1/2", "3/4", "back")):
        x = b.rim_thickness * i / 4
        if run is not None:
            simulated = np.interp(x, run.profile_depth, run.profile[-1])
        at = (Number("x", float(x), "m"),)
        yield EstimateRow(
            f"rim at the end, {place}",
            words,
            np.interp(x, course.depth, end),
            "K",
            "S-28",
            simulated,
            SCHEME,
            at,
        )
    drop = np.max(course.temperature[:, 0] - course.temperature[:, -1])
    simulated = run and run.drop
    yield EstimateRow(
        "maximum drop over the rim",
        "t_1 − t_N over time",
        drop,
        "K",
        "S-29",
        simulated,
        SCHEME,
        numbers(δ=b.rim_thickness),
    )
    yield from (*_rim_thickness(c), *_lining_thickness(c))
    name = "lining's back after the braking"
    formula = "T_0 + (T_f − T_0) θ(a τ/δ²)"
    (back, simulated) = c.lining_back
    yield EstimateRow(
        name,
        formula,
        back,
        "K",
        "Carslaw & Jaeger §3.4",
        simulated,
        "the formula starts from a lining of one temperature; the run's has the heat "
        "of earlier brake applications",
        numbers(
            Number("T_0", c.lining_body, "K"),
            T_f=c.face_peak,
            τ=b.time,
            δ=b.lining_thickness,
        ),
    )


def _rim_thickness(c: Chain) -> Iterator[EstimateRow]:
    """For this brake application; in a duty of several also for the heat of all,
    without cooling."""
    b = c.after
    limit = c.limits["lining_permissible"]
    rational = []
    cases = {"braking": (b.metal_heat / b.track_area, limit - c.start["rim"])}
    if b.run is not None and b.several:
        heat = b.share * b.power.heat * b.run.total_work / b.track_area
        cases["whole duty"] = heat, limit - b.start
    depth = float(heating.penetration_depth(b.rim.diffusivity, b.time))
    symbols = numbers(a=b.rim.diffusivity, τ=b.time)
    name = "thickness that heat reaches, rim"
    yield EstimateRow(
        name, "1.73 √(a τ), Fo = 1/3", depth, "m", "S, steps 1, 2", numbers=symbols
    )
    capacity = Number("ρ c", b.rim.volumetric_heat_capacity, "J/(m^3*K)")
    for name, (heat, rise) in cases.items():
        case = heating.rational_rim_thickness(b.rim, b.time, heat=heat, rise=rise)
        rational.append(Number(f"δ, {name}", case.rational, "m"))
        symbols = Number("Q", heat, "J/m^2"), capacity, Number("ΔT_p", rise, "K")
        name = f"thickness that holds the heat, {name}"
        yield EstimateRow(
            name, "Q/(ρ c ΔT_p)", case.storage, "m", "energy", numbers=symbols
        )
    course = c.before.run and c.before.run.rim
    thickness = max(number.value for number in rational)
    yield _rational(
        "rim",
        thickness,
        course and course.wall.thickness,
        "the run has the scene's thickness, which also carries load and wears; air and "
        "flange take heat in a long duty",
        rational,
    )


def _lining_thickness(c: Chain) -> Iterator[EstimateRow]:
    """For this brake application; in a duty of several also that which keeps the back
    cool over all."""
    b = c.after
    back = c.limits["back_permissible"]
    cases = {"braking": (b.time, c.face_peak, c.lining_body)}
    if b.run is not None and b.several:  # as if the rim had been as warm all the time
        warm = c.start["rim"] + b.whole_rise
        cases["whole duty"] = b.run.t[-1] - b.scene.initial.time, warm, b.start
    a = b.lining.diffusivity
    depth = float(heating.penetration_depth(a, b.time))
    symbols = numbers(a=a, τ=b.time)
    yield EstimateRow(
        "thickness that heat reaches, lining",
        "1.73 √(a τ)",
        depth,
        "m",
        "S, steps 1, 2",
        numbers=symbols,
    )
    rational = [Number("δ, heat reaches", depth, "m")]
    formula = "√(a τ/Fo_p), θ(Fo_p) = (T_p − T_0)/(T_f − T_0)"
    for name, (time, face, start) in cases.items():
        case = heating.rational_lining_thickness(
            b.lining, time, face=face, back=back, start=start
        )
        rational.append(Number(f"δ, {name}", case.insulation, "m"))
        cool = Number("T_p", back, "K"), Number("T_0", start, "K")
        name = f"thickness that keeps the back cool, {name}"
        symbols = (*numbers(a=a, τ=time, T_f=face), *cool)
        yield EstimateRow(
            name,
            formula,
            case.insulation,
            "m",
            "Carslaw & Jaeger §3.4",
            numbers=symbols,
        )
    course = c.before.run and c.before.run.lining
    thickness = max(number.value for number in rational)
    yield _rational(
        "lining",
        thickness,
        course and course.wall.thickness,
        "the run has the scene's thickness, of which a part is there to wear",
        rational,
    )


def _rational(
    part: str, thickness: float, simulated: Any, why: str, of: list[Number]
) -> EstimateRow:
    return EstimateRow(
        f"rational thickness, {part}",
        "maximum of these",
        thickness,
        "m",
        "S, step 8",
        simulated,
        why,
        tuple(of),
    )


def _surface(c: Chain) -> Iterator[EstimateRow]:
    b = c.after
    maximum = list(rows.maximum_rows(c.after))
    yield from (*maximum[1:], *maximum[:1], rows.falling_row(b))
    time, power, work = (
        b.layered.at_peak if b.layered is not None else (None, None, None)
    )
    why = "the power does not fall linearly from the first moment"
    symbols = numbers(τ_T=b.time)
    source = "S, step 9"
    half = "τ/τ_T = 1/2, half-space under falling power"
    for name, formula, value, simulated in (
        ("relative time of the maximum", half, 0.5, time),
        ("relative power then", "τ_N = 2 (1 − τ/τ_T)", 1, power),
        ("relative work then", "τ_W = 2 τ/τ_T − (τ/τ_T)²", 0.75, work),
    ):
        yield EstimateRow(name, formula, value, "1", source, simulated, why, symbols)


def _balance(c: Chain) -> Iterator[EstimateRow]:
    b = c.after
    run = c.after.run
    time = None
    gained = None
    why = "linings, flange and air take from the rim, or give to it, while it is braked"
    rim = run and run.rim
    kept = rim and rim.content[-1] * rim.wall.area * rim.wall.copies
    yield EstimateRow(
        "heat into the rim",
        "α W",
        b.metal_heat,
        "J",
        "S-18",
        kept,
        why,
        numbers(α=b.share, W=b.heat),
    )
    if run is not None:
        steps = 0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t)
        angle = np.append(0.0, np.cumsum(steps))
        if angle[-1] >= 8 * math.pi:
            end = np.interp(8 * math.pi, angle, run.t)
            time = end - run.t[0]
            work = np.interp(end, run.t, run.work)
            gained = b.share * b.power.heat * work
    faster = (
        "the first four revolutions are faster than the mean, and their power differs"
    )
    net = None if kept is None else kept / (b.track_area * b.time)
    beside = {
        "time of four revolutions": (time, faster),
        "heat gained in it": (gained, faster),
        "mean net flux": (net, why),
    }
    for row in rows.balance_rows(b):
        simulated, reason = beside.get(row.name, (None, ""))
        yield row._replace(simulated=simulated, why=reason)


def _stress(c: Chain) -> Iterator[EstimateRow]:
    b = c.after
    why = "the power is not that of a linear fall, and the covered track takes more than the mean"
    yield from rows.stress_rows(b)
    conductivity = b.rim.conductivity
    yield EstimateRow(
        "maximum gradient at the face",
        "2 q/λ: initially falling power",
        b.initial_flux / conductivity,
        "K/m",
        "S-23",
        b.layered and b.layered.gradient,
        why,
        numbers(q=b.flux, λ=conductivity),
    )


def _operation(c: Chain) -> Iterator[EstimateRow]:
    b = c.before
    work = None
    if b.run is not None:
        work = b.run.work[-1] if b.several else b.run.total_work
    stop = list(rows.stop_rows(b, b.hardest_time, b.hardest_angle, work))
    yield from (
        *stop[2::-1],
        *stop[3:],
        *rows.operation_rows(b),
    )  # the stopping time first
    yield rows.pressure_row(b)._replace(
        simulated=b.run_pressure,
        why="the formula leaves out the angle at which the band leaves a lining, and "
        "takes the initial friction",
    )


def _margins(c: Chain) -> Iterator[EstimateRow]:
    """What is left to the permissible values: the end of step 12."""
    b = c.before
    run = c.before.run
    limits = c.limits
    (work, time) = c.before.stopping_load
    of_run = run and b.work / (b.lining_area * b.time)
    stress = c.after.run_stress and abs(c.after.run_stress[1])
    compared = "as the value compared with the limit"
    hottest = (
        "the run's is the hottest lining's face, hotter than the rim by contact "
        "resistance and unequal work"
    )

    def margin(
        name: str,
        formula: str,
        unit: str,
        limit: Any,
        value: Any,
        in_run: Any,
        why: str = compared,
    ) -> EstimateRow:
        if limit is None or value is None:
            return EstimateRow(f"margin, {name}", formula, None, unit)
        simulated = None
        if in_run is not None:
            simulated = limit - in_run
        return EstimateRow(
            f"margin, {name}",
            formula,
            limit - value,
            unit,
            "S, step 12",
            simulated,
            why,
            (Number("permissible", limit, unit), Number("found", value, unit)),
        )

    face = limits["lining_permissible"]
    back = limits["back_permissible"]
    yield margin(
        "face of the linings",
        "T_p − T_max",
        "K",
        face,
        c.face_peak,
        run and run.face,
        hottest,
    )
    yield margin("back of the linings", "T_p − T_back", "K", back, *c.lining_back)
    yield margin(
        "stress of the rim",
        "σ_p − |σ|",
        "Pa",
        c.after.elastic.permissible,
        abs(c.after.stress),
        stress,
    )
    limit = limits.get("pressure_permissible")
    words = "permissible − mean"
    yield margin("pressure", words, "Pa", limit, b.pressure, b.run_pressure)
    limit = limits.get("power_permissible")
    mean = work / (b.lining_area * time)
    yield margin("power load", words, "W/m^2", limit, mean, of_run)


#: steps in the order of S
STEPS: dict[str, Callable[[Chain], Iterable[EstimateRow]]] = {
    "effective thermal penetration depth": _depths,
    "Fourier numbers": lambda c: map(_fourier_number, c.first.values()),
    "effective volumes": lambda c: (
        rows.part_rows(part)[3] for part in c.first.values()
    ),
    "partition of the heat": _partition,
    "mean bulk temperatures": lambda c: _bulk(c.first),
    "properties at these temperatures, where above 150 °C": _properties,
    "depth, Fourier numbers, volumes, partition repeated": _repeated,
    "temperatures of the layers, rational thickness": _layers,
    "maximum temperature of the friction surface": _surface,
    "heat balance": _balance,
    "thermal stress of the rim": _stress,
    "operating characteristics": _operation,
}


def _rows_of(c: Chain) -> Iterator[EstimateRow]:
    """The rows of all steps, with the verdicts of the limits."""
    for number, step in enumerate(STEPS.values(), 1):
        for row in rows.present(step(c)):
            yield row._replace(step=number)
    for row in rows.present(_margins(c)):
        estimated, simulated = (
            None
            if margin is None
            else LimitVerdict.WITHIN
            if margin >= 0
            else LimitVerdict.EXCEEDED
            for margin in (row.value, row.simulated)
        )
        verdict = (
            f"{estimated}"
            if simulated in (None, estimated)
            else f"{estimated}, in the run {simulated}"
        )
        yield row._replace(step=len(STEPS), verdict=verdict)


@frozen
class Synthesis(RowTable):
    """The parametric synthesis of a brake for one brake application: figures of S's
    twelve steps beside the simulated ones.

    - `rows` in order of the steps; `inputs`: their inputs; `about`: the brake
      application
    - `rounds`: how often steps 1 to 5 were repeated with properties at temperature;
      `replaced`: parts that have them
    - `rim_thickness`, `lining_thickness` (without the wear allowance): rational (m),
      `inf` where none is sufficient
    - `synthesis["friction work"]` is one figure, `synthesis.step(8)` those of a step;
      `str` gives the report, `as_dict` the same as numbers and words

    Example:
        >>> found = sb.synthesize(scene)
        >>> found.rounds, round(1e3 * found.rim_thickness, 2)
        (0, 6.55)
    """

    rounds: int
    replaced: tuple[str, ...]
    kind: ClassVar[str] = "figure"

    def step(self, number: int) -> tuple[EstimateRow, ...]:
        """The figures of one step, 1…12; the first is its main one."""
        return tuple(row for row in self.rows if row.step == number)

    @property
    def rim_thickness(self) -> float:
        return self["rational thickness, rim"].value

    @property
    def lining_thickness(self) -> float:
        return self["rational thickness, lining"].value

    @property
    def limits(self) -> dict[str, str]:
        """Name of every permissible limit that was evaluated → its verdict."""
        return {row.name: row.verdict for row in self.rows if row.verdict}

    @property
    def exceeded(self) -> list[str]:
        """Names of the limits that the estimate or the run exceeds: their margin is
        below 0."""
        return [
            name
            for name, verdict in self.limits.items()
            if LimitVerdict.EXCEEDED in verdict
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are
        `None`."""
        return {
            "about": self.about,
            "rounds": self.rounds,
            "replaced": list(self.replaced),
            "inputs": plain(self.inputs),
            "steps": self.as_list(),
        }

    def parts(self) -> Iterator[str | Table]:
        yield from self.head()
        for i, title in enumerate(STEPS, 1):
            figures = self.step(i)
            yield from ("", f"{i}. {title}: {figures[0].words}")
            yield from table_of(figures)


# --- the function -------------------------------------------------------------------


def synthesize(
    run: Scene | Result,
    data: EstimateData | None = None,
    *,
    permissible: Permissible | None = None,
    partition: AbstractPartition | None = None,
    tolerance: float = 1e-9,
    rounds: int = 100,
) -> Synthesis:
    """Parametric synthesis of a brake for one brake application, after S: twelve steps
    from the thermal penetration depth to operation.

    1. effective thermal penetration depth `b = 1.73 √(a τ)`;  2. Fourier numbers;  3.
    effective volumes;  4. partition of the heat; 5. mean bulk temperatures;  6.
    properties at these, where they exceed 150 °C;  7. depth, Fourier numbers, volumes
    and partition repeated until the temperatures converge;  8. temperatures of the
    rim's layers, rational thickness of rim and lining;  9. maximum temperature;  10.
    heat balance;  11. thermal stress;  12. operating characteristics with the
    permissible limits.

    - `run`: a `Scene`, of which a classical stop gives time and work, or a `Result`:
      its hardest brake application, and every figure is shown beside the simulated one
      where the run has it
    - `data`: numbers that the scene does not have, or that replace them (as for
      `estimates`)
    - `permissible`: limits of temperature, pressure and power
    - `partition`: law of step 4, as `TransmissionPartition` for S-41; by default
      `data.share`, else the scene's law, else effusivities at the properties of the
      round
    - `tolerance` (K) of the repeat of step 7 and maximum number of its `rounds`

    Raises `InputError` as `estimates` does, for a staged brake, and for wrong options,
    `SynthesisError` with the code `no_convergence` or `material_range` where step 7
    finds no temperature.
    """
    permissible = permissible or Permissible()
    scene = run.scene if isinstance(run, Result) else run
    wrong = faults_of_synthesis(scene, data, permissible)
    wrong.unless(0 < tolerance < math.inf, "tolerance", tolerance, "must be > 0 K")
    wrong.unless(rounds >= 1, "rounds", rounds, "at least 1")
    wrong.report()
    before, about = braking_of(run, data)
    if before.run is not None and before.several:
        before = dataclasses.replace(before, stop=classical_stop(before.run.then))
    start = _start_temperatures(before)
    first, last, count, change = refine(before, start, partition, tolerance, rounds)
    settled = permissible.settled(before.scene)
    changed = {name: part.material for name, part in last.items()} | {
        "share": last["rim"].share
    }
    changed_inputs = {
        name: i._replace(value=changed.get(name, i.value))
        for name, i in before.inputs.items()
    }
    after = dataclasses.replace(before, inputs=changed_inputs)
    limits = {limit.name: float(limit.value) for limit in settled}
    figures = tuple(
        _rows_of(Chain(before, after, first, last, count, change, start, limits))
    )
    inputs = (*before.inputs.values(), *settled)
    return Synthesis(
        f"parametric synthesis{about}", inputs, figures, count, replaced_in(first)
    )


def _start_temperatures(b: Braking) -> dict[str, float]:
    """Mean temperatures (K) of rim, lining and band at the beginning; without a run all
    as the rim.

    The lining's is that of the heated depth: a lining that has braked before is hot at
    its face.
    """
    start = dict.fromkeys(b.parts, b.start_now)
    if b.run is not None and b.run.lining is not None:
        depth = float(heating.penetration_depth(b.lining.diffusivity, b.time))
        start["lining"] = b.run.lining.mean(depth)[0]
    if b.run is not None and b.run.band is not None:
        start["band"] = b.run.band[0]
    return start


def faults_of_synthesis(
    scene: Scene, data: EstimateData | None, limits: Permissible
) -> Issues:
    """All input errors of a synthesis, before any simulation."""
    wrong = Issues([*faults(scene), *faults_of_data(data, limits)])
    if banded_brake(scene).in_series:
        wrong.add(
            "brake.bandage",
            "cannot be synthesised",
            "give a brake with one friction pair; `estimates` handles both pairs of a staged one",
        )
    return wrong
