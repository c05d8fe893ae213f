"""The parametric synthesis: S's twelve steps over a scene or a run, lines of `steps.csv` in one chain."""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Scalar
from .._base._table import Table, plain
from .._parts._scene import Scene, band_brake, faults
from .._run._measure import LimitVerdict
from .._run._result import Result
from ..thermal._heat import AbstractPartition
from ..thermal._material import ROOM, Material, effusivity_share
from ._braking import Braking
from ._estimates import ROWS, RowTable, SynthesisRow, braking_of, look, number, read, table_of
from ._heated import HeatedPart, schmidt_layers, there
from ._inputs import EstimateData, Permissible, faults_of_data
from .heating import (
    SchmidtCourse,
    back_temperature,
    penetration_depth,
    rational_lining_thickness,
    rational_rim_thickness,
    schmidt,
)
from .statics import classical_stop

#: above this mean bulk temperature (K) properties are taken at it (S, step 6), below at room temperature
REPLACED_ABOVE = 273.15 + 150.0
HEATED = ("rim", "lining")  # the band takes up no friction heat in a brake with one pair
Given = list[tuple[str, float, str]]  # numbers put into a formula: symbol, value, unit


# --- properties at the resulting temperature ---- ------------------------------------------------------------------


class SynthesisError(RuntimeError):
    """A synthesis that did not converge, with the reason as `code`.

    - `no_convergence`: the temperatures still changed after the last round
    - `material_range`: a property, linear in the temperature, would no longer be positive

    Example:
        >>> str(sb.formulas.SynthesisError("no_convergence", "after 50 rounds"))
        'no_convergence: after 50 rounds'
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{code}: {message}")
        self.code = code


def property_at(material: Material, name: str, T: float) -> float:
    """`conductivity` or `specific_heat` at `T` (K)."""
    value, slope = float(getattr(material, name)), getattr(material, f"{name}_slope")
    return value if slope is None else value * (1 + float(slope) * (T - float(material.reference)))


def properties_at(material: Material, T: float, part: str) -> Material:
    """The material with its properties at `T` (K), constant. Raises `SynthesisError` where one is not positive."""
    found = {name: property_at(material, name, T) for name in ("conductivity", "specific_heat")}
    for name, value in found.items():
        if not value > 0:
            end = float(material.reference) - 1 / float(getattr(material, f"{name}_slope"))
            words = f"{name.replace('_', ' ')} of the {part}, linear in the temperature, falls to 0 at {end:.5g} K"
            raise SynthesisError("material_range", f"{words}; the bulk temperature is {T:.5g} K")
    return Material(density=float(material.density), **found)


_Law = Callable[[dict[str, float], dict[str, Material]], float]
Parts = dict[str, HeatedPart]  # by name, with constant properties


def share_law(b: Braking, partition: AbstractPartition | None) -> _Law:
    """Heat partition coefficient of the rim from temperatures and materials: a given number or law, the scene's law,
    else Charron's.

    Raises `InputError` where both a number and a law are given.
    """
    source, pair = b.inputs["share"].source, b.scene.network.friction
    if partition is not None and source == "given":
        raise InputError([Fault("share", "is given beside a law of the partition", "give one of the two")])
    if source == "given":
        return lambda T, materials: b.share
    law = partition if partition is not None else pair.partition if source == "scene" and pair is not None else None
    if law is None:
        return lambda T, materials: float(effusivity_share(materials["rim"], materials["lining"]))
    return lambda T, materials: float(np.mean(np.asarray(law.share(jnp.asarray(T["rim"]), jnp.asarray(T["lining"])))))


def one_pass(b: Braking, start: dict[str, float], at: dict[str, float], law: _Law) -> Parts:
    """Steps 1 to 5, depth, Fourier number, volume, share and bulk temperature, with properties at `at` (K)."""
    materials = {name: properties_at(part.material, at[name], name) for name, part in b.parts.items()}
    share = law({name: max(at[name], start[name]) for name in materials}, materials)
    shares = {"rim": share, "lining": 1 - share, "band": 0.0}
    return {
        name: dataclasses.replace(part, material=materials[name], start=start[name], share=shares[name])
        for name, part in b.parts.items()
    }


def refine(
    b: Braking, start: dict[str, float], partition: AbstractPartition | None, tolerance: float, rounds: int
) -> tuple[Parts, Parts, int, float]:
    """Repeat steps 1 to 5 with properties at the bulk temperatures they gave, until these converge (K).

    The first pass, with properties at room temperature; the last; how many rounds, and the change (K) in the last.

    A part whose first bulk temperature stays at or below 150 °C keeps the properties of room temperature throughout, as
    S words it: the choice is made once, since switching during the iteration could leave the equations without a
    solution. The rest is a plain fixed-point iteration: for a capacity that rises with the temperature it always
    contracts; for one that falls it climbs to the lowest solution, or out of the material's range where there is none.
    Raises `SynthesisError` with the code `no_convergence` or `material_range`.
    """
    law = share_law(b, partition)
    first = last = one_pass(b, start, dict.fromkeys(start, ROOM), law)
    replaced, change = replaced_in(first), math.inf
    if not replaced:
        return first, first, 0, 0.0
    for n in range(1, rounds + 1):
        at = {part: last[part].bulk if part in replaced else ROOM for part in start}
        before, last = last, one_pass(b, start, at, law)
        change = max(abs(last[part].bulk - before[part].bulk) for part in HEATED)
        if change <= tolerance:
            return first, last, n, change
    told = ", ".join(f"{part} {last[part].bulk:.6g} K" for part in replaced)
    words = f"after {rounds} rounds the bulk temperatures still change by {change:.3g} K ({told})"
    raise SynthesisError(
        "no_convergence", f"{words}; allow more rounds, or the brake application is close to a thermal runaway"
    )


def replaced_in(first: Parts) -> tuple[str, ...]:
    """Parts whose properties are replaced by those at their temperature."""
    return tuple(part for part in HEATED if first[part].bulk > REPLACED_ABOVE)


# --- data of the rows: see `rows.csv` ----- --------------------------------------------------------------------------


class Case(NamedTuple):
    """A thickness (m) for this `braking`, or for the `whole duty` where that has several brake applications.

    `depth`, `other`: the two that the `rational` one is the larger of; `numbers` put into the formula of the other.
    """

    name: str
    depth: float
    other: float
    rational: float
    numbers: Given


class Property(NamedTuple):
    """Property of a part in step 6: a property at `T` (K), `1 + b (T − T_r)` times that of `material`."""

    part: HeatedPart  # of the first pass
    material: Material
    T: float
    field: str
    symbol: str
    unit: str
    limit: float = REPLACED_ABOVE

    @property
    def slope(self) -> Scalar | None:
        return getattr(self.material, f"{self.field}_slope")

    def value(self) -> float:
        return float(getattr(properties_at(self.material, self.T, self.part.name), self.field))

    def simulated(self) -> float:
        """Simulated property: the law of the scene at the mean temperature of the heated depth."""
        return property_at(there(self.part.course).wall.material, self.field, self.part.simulated_bulk)

    def words(self) -> str:
        return f"{self.symbol} " + ("(no temperature dependence known)" if self.slope is None else "[1 + b (T − T_r)]")

    def T_words(self) -> str:
        return "T_v of step 5" if self.limit < self.T else "room: T_v of step 5 is not above 150 °C"

    def numbers(self) -> Given:
        found: Given = [(self.symbol, float(getattr(self.material, self.field)), self.unit)]
        if self.slope is not None:
            reference = float(self.material.reference)
            found += [("b", float(self.slope), "1/K"), ("T", self.T, "K"), ("T_r", reference, "K")]
        return found


class Margin(NamedTuple):
    """A permissible value and the values compared with it, estimated and simulated; `None`: there is none."""

    unit: str
    permissible: float | None
    value: float | None
    simulated: float | None

    def left(self) -> float:
        return there(self.permissible) - there(self.value)

    def left_in_run(self) -> float:
        return there(self.permissible) - there(self.simulated)

    def numbers(self) -> Given:
        return [("permissible", there(self.permissible), self.unit), ("found", there(self.value), self.unit)]


@dataclasses.dataclass(frozen=True)
class Chain:
    """The brake application of a synthesis: `before` with properties at room temperature, `after` with those of step 7.

    `first`, `last`: passes of the `rounds` between the two, the last of which changed temperatures by `change` (K);
    `start`: temperatures (K) of the parts at the beginning; `limits` (SI).
    """

    before: Braking
    after: Braking
    first: Parts
    last: Parts
    rounds: int
    change: float
    start: dict[str, float]
    limits: dict[str, float]

    # steps 1 to 7

    def within(self) -> float:
        """Share of the simulated heat of the rim within the depth of step 1 at the end."""
        rim = there(there(self.before.run).rim)
        rise = rim.layers[-1] - rim.layers[0]
        whole = float(rise @ rim.steps)
        return float(rise @ rim.inside(self.first["rim"].depth)) / there(whole if whole > 0 else None)

    def law(self) -> str:
        """Source of the heat partition coefficient, in words."""
        source = self.before.inputs["share"].source
        if source.startswith("effusivities"):
            return "α_TP = e_1/(e_1 + e_2)"
        return "α_TP: law of the scene" if source == "scene" else "α_TP, as given"

    def simulated_rest(self) -> float:
        return 1 - self.before.simulated_share

    def rounds_words(self) -> str:
        return "until T_v converges" if self.rounds else "none: properties stay those of room temperature"

    @functools.cached_property
    def properties(self) -> dict[str, dict[str, Property]]:
        """Properties of each part in step 6."""
        replaced, found = replaced_in(self.first), {}
        for name, part in self.first.items():
            one = (part, self.before.parts[name].material, part.bulk if name in replaced else ROOM)
            found[name] = {
                "conductivity": Property(*one, "conductivity", "λ", "W/(m*K)"),
                "specific_heat": Property(*one, "specific_heat", "c", "J/(kg*K)"),
            }
        return found

    # layers

    @functools.cached_property
    def schmidt(self) -> SchmidtCourse:
        """Schmidt's scheme with the heat of the run, else with the falling power of a stop."""
        b = self.after
        share, run = b.share * float(b.power.heat), b.run
        if run is not None and run.layered:
            return run.schmidt(b.rim, share, b.track_area)

        def work(t: float) -> float:
            if run is not None:
                return float(np.interp(run.t[0] + t, run.t, run.work))
            s = min(t / b.time, 1.0)
            return b.work * (2 * s - s**2)

        def flux(t0: float, t1: float) -> float:
            return share * (work(t1) - work(t0)) / (b.track_area * (t1 - t0))

        layers = schmidt_layers(b.rim, b.rim_thickness, b.time)
        return schmidt(b.rim, b.rim_thickness, layers, b.time, flux, start=self.start["rim"])

    @property
    def layers(self) -> int:
        return self.schmidt.depth.size - 2

    def heat_words(self) -> str:
        return "½ (t_{j−1} + t_{j+1}), " + ("falling power" if self.after.run is None else "the run's own heat")

    @property
    def face_peak(self) -> float:
        """Maximum temperature of the rim's face by Schmidt's scheme (K)."""
        return float(np.max(self.schmidt.temperature[:, 0]))

    @functools.cached_property
    def at_end(self) -> list[dict[str, float | Given | None]]:
        """Temperatures (K) of the rim's face, of three depths, and of its back."""
        course, run, found = self.schmidt, self.after.run, []
        end = [float(np.interp(self.after.time, course.t, column)) for column in course.temperature.T]
        for x in self.after.rim_thickness * np.array([0.0, 0.25, 0.5, 0.75, 1.0]):
            simulated = None
            if run is not None and run.layered:
                simulated = float(np.interp(x, run.profile_depth, run.profile[-1]))
            value = float(np.interp(x, course.depth, end))
            found.append({"value": value, "simulated": simulated, "numbers": [("x", float(x), "m")]})
        return found

    @property
    def drop(self) -> float:
        """Maximum difference (K) between face and back."""
        return float(np.max(self.schmidt.temperature[:, 0] - self.schmidt.temperature[:, -1]))

    @property
    def lining_body(self) -> float:
        """Mean temperature of the whole lining at the beginning (K)."""
        run = self.before.run
        return self.start["lining"] if run is None or run.lining is None else float(run.lining.mean()[0])

    def lining_back(self) -> float:
        """Temperature (K) of its back after the brake application."""
        b = self.after
        return back_temperature(b.lining, b.lining_thickness, b.time, face=self.face_peak, start=self.lining_body)

    # rational thickness

    @property
    def capacity(self) -> float:
        """Heat capacity of the rim per volume (J/(m³·K))."""
        return float(self.after.rim.density * self.after.rim.specific_heat)

    @functools.cached_property
    def rim_cases(self) -> list[Case]:
        """Thickness for this brake application; in a duty of several also for the heat of all, without cooling."""
        b, limit = self.after, self.limits["lining_permissible"]
        cases = [("braking", b.metal_heat / b.track_area, limit - self.start["rim"])]
        if b.several:
            heat = b.share * float(b.power.heat) * there(b.run).total_work / b.track_area
            cases.append(("whole duty", heat, limit - float(b.start)))
        return [
            Case(
                name,
                *rational_rim_thickness(b.rim, b.time, heat=heat, rise=rise),
                [("Q", heat, "J/m^2"), ("ρ c", self.capacity, "J/(m^3*K)"), ("ΔT_p", rise, "K")],
            )
            for name, heat, rise in cases
        ]

    @property
    def rim_thicknesses(self) -> Given:
        """Thicknesses of which the rational thickness of the rim is the maximum."""
        return [(f"δ, {case.name}", case.rational, "m") for case in self.rim_cases]

    @property
    def rim_thickness(self) -> float:
        return max(value for _, value, _ in self.rim_thicknesses)

    @functools.cached_property
    def lining_cases(self) -> list[Case]:
        """Thickness for this brake application; in a duty of several also that which keeps the back cool over all."""
        b, back = self.after, self.limits["back_permissible"]
        cases = [("braking", b.time, self.face_peak, self.lining_body)]
        if b.several:  # as if the rim had been as warm all the time
            warm = self.start["rim"] + b.metal_heat / (b.track_area * b.rim_thickness * self.capacity)
            cases.append(("whole duty", float(there(b.run).t[-1]) - float(b.scene.initial.time), warm, float(b.start)))
        a = ("a", float(b.lining.diffusivity), "m^2/s")
        return [
            Case(
                name,
                *rational_lining_thickness(b.lining, time, face=face, back=back, start=start),
                [a, ("τ", time, "s"), ("T_f", face, "K"), ("T_p", back, "K"), ("T_0", start, "K")],
            )
            for name, time, face, start in cases
        ]

    @property
    def lining_thicknesses(self) -> Given:
        """Thicknesses of which the rational thickness of a lining is the maximum."""
        reached = ("δ, heat reaches", self.lining_cases[0].depth, "m")
        return [reached, *((f"δ, {case.name}", case.other, "m") for case in self.lining_cases)]

    @property
    def lining_thickness(self) -> float:
        return max(value for _, value, _ in self.lining_thicknesses)

    # limits

    def margins(self) -> dict[str, Margin]:
        """Permissible values and the values compared with them."""
        return {
            name: Margin(unit, *(number(self, path) for path in paths)) for name, (unit, *paths) in _MARGINS.items()
        }


#: margin → its unit, and the paths to the permissible value and to the estimated and simulated values
_MARGINS = {
    "face": ("K", "limits.lining_permissible", "face_peak", "before.run.face"),
    "back": ("K", "limits.back_permissible", "lining_back", "before.run.lining.back.max"),
    "stress": ("Pa", "after.elastic.permissible", "after.stress.__abs__", "after.run_stress.1.__abs__"),
    "pressure": ("Pa", "limits.pressure_permissible", "before.pressure", "before.run_pressure"),
    "power": ("W/m^2", "limits.power_permissible", "before.power_load.0", "before.power_load.1"),
}


# --- the steps --------------------------------------------------------------------------------------------------------

_LINES = read("steps.csv")
#: steps in the order of S
STEPS = [line["title"] for line in _LINES if line["title"]]


def _verdict(row: SynthesisRow) -> str:
    """Within limit or exceeded by the estimate, and by the run where its verdict differs."""
    by_estimate, by_run = (
        None if margin is None else LimitVerdict.WITHIN if margin >= 0 else LimitVerdict.EXCEEDED
        for margin in (row.value, row.simulated)
    )
    return f"{by_estimate}" if by_run in (None, by_estimate) else f"{by_estimate}, in the run {by_run}"


def _rows_of(c: Chain) -> Iterator[SynthesisRow]:
    """All rows in the order of `steps.csv`: a line is a row for the object at a place of the chain.

    - `place`: a path; several objects have a row each;  `ending` of the name
    - `formula`, `simulated`, `why`: in place of those of `rows.csv`
    """
    known = {(row.table, row.name): row for row in ROWS}
    for line in _LINES:
        other = {key: line[key] for key in ("formula", "simulated", "why") if line[key]}
        row = dataclasses.replace(known[line["table"], line["row"]], **other)
        place = look(c, line["place"]) if line["place"] else c
        for context in place.values() if isinstance(place, Mapping) else place if isinstance(place, list) else [place]:
            for one in row.at(context):
                told: dict[str, Any] = vars(one) | {"name": one.name + line["ending"]}
                found = SynthesisRow(**told, step=int(line["step"]), numbers=tuple(row.put_in(context)))
                yield dataclasses.replace(found, verdict=_verdict(found)) if row.table == "margin" else found


@dataclasses.dataclass(frozen=True)
class Synthesis(RowTable[SynthesisRow]):
    """The parametric synthesis of a brake for one brake application: figures of S's twelve steps beside the simulated
    ones.

    - `rows` in order of the steps; `inputs`: their inputs; `about`: the brake application
    - `rounds`: how often steps 1 to 5 were repeated with properties at temperature; `replaced`: parts that have them
    - `rim_thickness`, `lining_thickness`: rational (m), `inf` where none is sufficient
    - `synthesis["friction work"]` is one figure, `synthesis.step(8)` those of a step; `str` gives the report,
      `as_dict` the same as numbers and words

    Example:
        >>> found = sb.synthesize(scene)
        >>> found.rounds, round(1e3 * found.rim_thickness, 2)
        (0, 6.55)
    """

    rounds: int
    replaced: tuple[str, ...]
    kind: ClassVar[str] = "figure"

    def step(self, number: int) -> tuple[SynthesisRow, ...]:
        """The figures of one step, 1…12; the first is its main one."""
        return tuple(row for row in self.rows if row.step == number)

    @property
    def rim_thickness(self) -> float:
        """Rational thickness of the rim (m)."""
        return self["rational thickness, rim"].value

    @property
    def lining_thickness(self) -> float:
        """Rational thickness of the linings without the wear allowance (m)."""
        return self["rational thickness, lining"].value

    @property
    def limits(self) -> dict[str, str]:
        """Name of every permissible limit that was evaluated → its verdict."""
        return {row.name: row.verdict for row in self.rows if row.verdict}

    @property
    def exceeded(self) -> list[str]:
        """Names of the limits that the estimate or the run exceeds: their margin is below 0."""
        margins = [row for row in self.rows if row.verdict]
        return [row.name for row in margins if row.value < 0 or (row.simulated is not None and row.simulated < 0)]

    def as_list(self) -> list[dict[str, Any]]:
        """Return every figure as numbers and text; numbers that are not finite are `None`."""
        return [row.as_dict() for row in self.rows]

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are `None`."""
        about = {"about": self.about, "rounds": self.rounds, "replaced": list(self.replaced)}
        return {**about, "inputs": plain(self.inputs), "steps": self.as_list()}

    def parts(self) -> Iterator[str | Table]:
        yield from self.head()
        for i, title in enumerate(STEPS, 1):
            rows = self.step(i)
            yield from ("", f"{i}. {title}: {rows[0].words}")
            yield from table_of(rows)


# --- the function -----------------------------------------------------------------------------------------------------


def synthesize(
    run: Scene | Result,
    data: EstimateData | None = None,
    *,
    permissible: Permissible | None = None,
    partition: AbstractPartition | None = None,
    tolerance: float = 1e-9,
    rounds: int = 100,
) -> Synthesis:
    """Parametric synthesis of a brake for one brake application, after S: twelve steps from the thermal
    penetration depth to operation.

    1. effective thermal penetration depth `b = 1.73 √(a τ)`;  2. Fourier numbers;  3. effective volumes;  4. partition
    of the heat; 5. mean bulk temperatures;  6. properties at these, where they exceed 150 °C;  7. depth, Fourier
    numbers, volumes and partition repeated until the temperatures converge;  8. temperatures of the rim's layers,
    rational thickness of rim and lining;  9. maximum temperature;  10. heat balance;  11. thermal stress;  12.
    operating characteristics with the permissible limits.

    - `run`: a `Scene`, of which a classical stop gives time and work, or a `Result`: its hardest brake application, and
      every figure is shown beside the simulated one where the run has it
    - `data`: numbers that the scene does not have, or that replace them (as for `estimates`)
    - `permissible`: limits of temperature, pressure and power
    - `partition`: law of step 4, as `TransmissionPartition` for S-41; by default `data.share`, else the scene's law,
      else effusivities at the properties of the round
    - `tolerance` (K) of the repeat of step 7 and maximum number of its `rounds`

    Raises `InputError` as `estimates` does, for a staged brake, and for wrong options, `SynthesisError` with the
    code `no_convergence` or `material_range` where step 7 finds no temperature.
    """
    permissible = permissible or Permissible()
    scene = run.scene if isinstance(run, Result) else run
    wrong = faults_of_synthesis(scene, data, permissible)
    if not 0 < tolerance < math.inf:
        wrong.append(Fault("tolerance", f"{tolerance} is out of range", "must be > 0 K"))
    if rounds < 1:
        wrong.append(Fault("rounds", f"{rounds} is out of range", "at least 1"))
    if wrong:
        raise InputError(wrong)
    before, about = braking_of(run, data)
    if before.several:
        before = dataclasses.replace(before, stop=classical_stop(there(before.run).then))
    start = _start_temperatures(before)
    first, last, count, change = refine(before, start, partition, tolerance, rounds)
    settled = permissible.settled(before.scene)
    after = before.with_inputs(**{name: part.material for name, part in last.items()}, share=last["rim"].share)
    limits = {limit.name: float(limit.value) for limit in settled}
    rows = tuple(_rows_of(Chain(before, after, first, last, count, change, start, limits)))
    inputs = (*before.inputs.values(), *settled)
    return Synthesis(f"parametric synthesis{about}", inputs, rows, count, replaced_in(first))


def _start_temperatures(b: Braking) -> dict[str, float]:
    """Mean temperatures (K) of rim, lining and band at the beginning; without a run all as the rim.

    The lining's is that of the heated depth: a lining that has braked before is hot at its face.
    """
    start = dict.fromkeys(b.parts, b.start_now)
    if b.run is not None and b.run.lining is not None:
        depth = float(penetration_depth(float(b.lining.diffusivity), b.time))
        start["lining"] = float(b.run.lining.mean(depth)[0])
    if b.run is not None and b.run.band is not None:
        start["band"] = float(b.run.band[0])
    return start


def faults_of_synthesis(scene: Scene, data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """All input errors of a synthesis, before any simulation."""
    found = [*faults(scene), *faults_of_data(data, limits)]
    if band_brake(scene).in_series:
        hint = "give a brake with one friction pair; `estimates` handles both pairs of a staged one"
        found.append(Fault("brake.bandage", "cannot be synthesised", hint))
    return found
