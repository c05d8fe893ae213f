"""The parametric synthesis: S's twelve steps over a scene or a run, rows of data in one chain."""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Table, plain
from .._parts._heat import AbstractPartition
from .._parts._material import ROOM, Material, effusivity_share
from .._parts._scene import Scene, band_brake, faults
from .._run._limits import LimitVerdict
from .._run._result import Result
from ._braking import Braking, HeatedPart, braking_of
from ._estimates import (
    BALANCE,
    BULK_WHY,
    DEPTH,
    EFFUSIVITIES,
    FALLING,
    FLASH,
    FOURIER,
    MAXIMUM,
    PRESSURE,
    SCHEME_WHY,
    SHARE_WHY,
    STOP,
    STRESS,
    TRANSMISSION,
    VOLUME,
    of_rim,
    of_run,
    simulated_share,
)
from ._inputs import EstimateData, Permissible, faults_of_data, rim_wall
from ._rows import EstimateRow, Row, RowTable, SynthesisRow, table_of
from ._simulated import Layered, WallCourse, schmidt_layers
from .heating import (
    LiningThickness,
    RimThickness,
    SchmidtCourse,
    back_temperature,
    penetration_depth,
    rational_lining_thickness,
    rational_rim_thickness,
    schmidt,
)
from .stop import classical_stop

#: above this mean bulk temperature (K) properties are taken at it (S, step 6), below at room temperature
REPLACED_ABOVE = 273.15 + 150.0
_HEATED = ("rim", "lining")  # the band takes up no friction heat in a brake with one pair
_C = TypeVar("_C")


# --- properties at the temperature that they lead to ------------------------------------------------------------------


class SynthesisError(RuntimeError):
    """A synthesis that did not converge; `code` says why.

    - `no_convergence`: the temperatures still changed after the last round
    - `material_range`: a property, linear in the temperature, would no longer be positive
    """

    def __init__(self, code: str, message: str):
        super().__init__(f"{code}: {message}")
        self.code = code


class Pass(NamedTuple):
    """Steps 1 to 5 with the properties of one set of temperatures `at` (K): the heated parts and the rim's share."""

    parts: dict[str, HeatedPart]  # with constant properties
    at: dict[str, float]
    share: float


class Refinement(NamedTuple):
    """The first pass, with properties at room temperature, and the last, whose properties are at its own temperatures.

    `replaced`: parts whose properties depend on their temperature now; `rounds` of repeating; `change` (K) of the last.
    """

    first: Pass
    last: Pass
    replaced: tuple[str, ...]
    rounds: int
    change: float


def property_factor(material: Material, name: str, T: float) -> float:
    """`1 + b (T − T_r)` of `conductivity` or `specific_heat` at `T` (K); 1 without a temperature dependence."""
    slope = getattr(material, f"{name}_slope")
    return 1.0 if slope is None else 1.0 + float(slope) * (T - float(material.reference))


def properties_at(material: Material, T: float, part: str) -> Material:
    """The material with its properties at `T` (K), constant. Raises `SynthesisError` where one is not positive."""
    found = {}
    for name in ("conductivity", "specific_heat"):
        factor = property_factor(material, name, T)
        if not factor > 0:
            end = float(material.reference) - 1 / float(getattr(material, f"{name}_slope"))
            words = f"{name.replace('_', ' ')} of the {part}, linear in the temperature, falls to 0 at {end:.5g} K"
            raise SynthesisError("material_range", f"{words}; the bulk temperature comes to {T:.5g} K")
        found[name] = float(getattr(material, name)) * factor
    return Material(density=float(material.density), **found)


_Law = Callable[[dict[str, float], dict[str, Material]], float]


def share_law(b: Braking, partition: AbstractPartition | None) -> _Law:
    """The share into the rim from temperatures and materials: a given number or law, the scene's law, else Charron's.

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

    def by_law(T: dict[str, float], materials: dict[str, Material]) -> float:
        return float(np.mean(np.asarray(law.share(jnp.asarray(T["rim"]), jnp.asarray(T["lining"])))))

    return by_law


def one_pass(b: Braking, start: dict[str, float], at: dict[str, float], law: _Law) -> Pass:
    """Depth, Fourier number, effective volume, partition and mean bulk temperature with properties at `at` (K)."""
    materials = {name: properties_at(part.material, at[name], name) for name, part in b.parts.items()}
    share = law({name: max(at[name], start[name]) for name in materials}, materials)
    shares = {"rim": share, "lining": 1 - share, "band": 0.0}
    parts = {
        name: dataclasses.replace(part, material=materials[name], start=start[name], share=shares[name])
        for name, part in b.parts.items()
    }
    return Pass(parts, at, share)


def refine(
    b: Braking, start: dict[str, float], partition: AbstractPartition | None, tolerance: float, rounds: int
) -> Refinement:
    """Repeat steps 1 to 5 with properties at the bulk temperatures they gave, until these change no more (K).

    A part whose first bulk temperature stays at or below 150 °C keeps the properties of room temperature throughout, as
    S words it: the choice is made once, since a switch inside the repeat would leave equations without a solution. The
    rest is a plain fixed-point iteration: for a capacity that rises with the temperature it always contracts; for one
    that falls it climbs to the lowest solution, or out of the material's range where there is none. Raises
    `SynthesisError` with the code `no_convergence` or `material_range`.
    """
    law = share_law(b, partition)
    first = last = one_pass(b, start, dict.fromkeys(start, ROOM), law)
    replaced = tuple(part for part in _HEATED if first.parts[part].bulk > REPLACED_ABOVE)
    if not replaced:
        return Refinement(first, first, (), 0, 0.0)
    change = math.inf
    for n in range(1, rounds + 1):
        at = {part: last.parts[part].bulk if part in replaced else ROOM for part in start}
        before, last = last, one_pass(b, start, at, law)
        change = max(abs(last.parts[part].bulk - before.parts[part].bulk) for part in _HEATED)
        if change <= tolerance:
            return Refinement(first, last, replaced, n, change)
    told = ", ".join(f"{part} {last.parts[part].bulk:.6g} K" for part in replaced)
    words = f"after {rounds} rounds the bulk temperatures still change by {change:.3g} K ({told})"
    raise SynthesisError("no_convergence", f"{words}; allow more rounds, or the braking is close to a thermal runaway")


# --- the chain --------------------------------------------------------------------------------------------------------


class Case(NamedTuple, Generic[_C]):
    """A thickness for this `braking`, or for the `whole duty` where that has several brakings."""

    name: str
    thickness: _C
    numbers: Sequence[tuple[str, float, str]]


class Property(NamedTuple):
    """What step 6 takes of a part: its material at room temperature, and the temperature (K) `T` of its properties."""

    part: HeatedPart  # of the first pass
    material: Material
    replaced: bool
    T: float

    def numbers(self, field: str, symbol: str, unit: str) -> list[tuple[str, float, str]]:
        """A property at room temperature, and its temperature dependence."""
        slope, value = getattr(self.material, f"{field}_slope"), (symbol, float(getattr(self.material, field)), unit)
        if slope is None:
            return [value]
        return [value, ("b", float(slope), "1/K"), ("T", self.T, "K"), ("T_r", float(self.material.reference), "K")]

    def simulated(self, field: str) -> float | None:
        """A property by the scene's own law at the simulated mean temperature of the heated depth."""
        course, T = self.part.course, self.part.simulated_bulk
        if course is None or T is None:
            return None
        return float(getattr(course.wall.material, field)) * property_factor(course.wall.material, field, T)


@dataclasses.dataclass(frozen=True)
class Chain:
    """The braking of a synthesis: `before` with properties at room temperature, `after` with those of step 7.

    `found`: the iteration between the two; `start`: temperatures (K) of the parts as the braking begins; `limits` (SI).
    """

    before: Braking
    after: Braking
    found: Refinement
    start: dict[str, float]
    limits: dict[str, float]

    @property
    def rim(self) -> WallCourse | None:
        """The simulated rim."""
        return None if self.before.run is None else self.before.run.rim

    @property
    def lining(self) -> WallCourse | None:
        """The simulated linings."""
        return None if self.before.run is None else self.before.run.lining

    @property
    def several(self) -> bool:
        """Whether the run has several brakings."""
        return self.before.run is not None and self.before.run.brakings > 1

    @functools.cached_property
    def schmidt(self) -> SchmidtCourse:
        """Schmidt's scheme over the braking: with the run's own heat, else with the falling power of a stop."""
        b = self.after
        share, wall, run = b.share * float(b.power.heat), rim_wall(b.scene), b.run
        if b.layered is not None and wall is not None:
            return b.layered.schmidt(dataclasses.replace(wall, material=b.rim), share, b.track_area)

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
    def face_peak(self) -> float:
        """Maximum temperature of the rim's face by Schmidt's scheme (K)."""
        return float(np.max(self.schmidt.temperature[:, 0]))

    def at_end(self, share: float) -> float:
        """Temperature (K) at a share of the rim's thickness at the end, by Schmidt's scheme."""
        course = self.schmidt
        end = [float(np.interp(self.after.time, course.t, column)) for column in course.temperature.T]
        return float(np.interp(share * self.after.rim_thickness, course.depth, end))

    @property
    def lining_body(self) -> float:
        """Mean temperature of the whole lining as the braking begins (K)."""
        return self.start["lining"] if self.lining is None else float(self.lining.mean()[0])

    @property
    def capacity(self) -> float:
        """Heat capacity of the rim per volume (J/(m³·K))."""
        return float(self.after.rim.density * self.after.rim.specific_heat)

    def properties(self) -> Iterator[tuple[Property, str]]:
        """What step 6 takes."""
        for name in _HEATED:
            part, replaced = self.found.first.parts[name], name in self.found.replaced
            T = part.bulk if replaced else self.found.first.at[name]
            yield Property(part, self.before.parts[name].material, replaced, T), name

    @functools.cached_property
    def rim_cases(self) -> list[Case[RimThickness]]:
        """Thickness for this braking; for a duty of several, for the heat of all of them without cooling as well."""
        b, limit = self.after, self.limits["lining_permissible"]
        cases = [("braking", b.metal_heat / b.track_area, limit - self.start["rim"])]
        if self.several and b.run is not None:
            heat = b.share * float(b.power.heat) * b.run.total_work / b.track_area
            cases.append(("whole duty", heat, limit - float(b.start)))
        return [
            Case(
                name,
                rational_rim_thickness(b.rim, b.time, heat=heat, rise=rise),
                [("Q", heat, "J/m^2"), ("ρ c", self.capacity, "J/(m^3*K)"), ("ΔT_p", rise, "K")],
            )
            for name, heat, rise in cases
        ]

    @functools.cached_property
    def lining_cases(self) -> list[Case[LiningThickness]]:
        """Thickness for this braking; for a duty of several, that which keeps the back cool over it as well."""
        b, back = self.after, self.limits["back_permissible"]
        cases = [("braking", b.time, self.face_peak, self.lining_body)]
        if self.several and b.run is not None:  # as if the rim had been as warm all the time
            warm = self.start["rim"] + b.metal_heat / (b.track_area * b.rim_thickness * self.capacity)
            cases.append(("whole duty", float(b.run.t[-1]) - float(b.scene.initial.time), warm, float(b.start)))
        a = ("a", float(b.lining.diffusivity), "m^2/s")
        return [
            Case(
                name,
                rational_lining_thickness(b.lining, time, face=face, back=back, start=start),
                [a, ("τ", time, "s"), ("T_f", face, "K"), ("T_p", back, "K"), ("T_0", start, "K")],
            )
            for name, time, face, start in cases
        ]

    @property
    def lining_thicknesses(self) -> list[tuple[str, float, str]]:
        """All that the rational thickness of a lining is the maximum of."""
        reached = ("δ, heat reaches", self.lining_cases[0].thickness.depth, "m")
        return [reached, *((f"δ, {case.name}", case.thickness.insulation, "m") for case in self.lining_cases)]


# --- the rows ---------------------------------------------------------------------------------------------------------

_row, _of_part, _of_braking, _of_property = Row[Chain], Row[HeatedPart], Row[Braking], Row[Property]


def _within(c: Chain) -> float | None:
    """Of the simulated heat of the rim at the end of the braking, the share that lies within the depth of step 1."""
    if c.rim is None:
        return None
    rise = c.rim.layers[-1] - c.rim.layers[0]
    whole = float(rise @ c.rim.steps)
    return float(rise @ c.rim.inside(c.found.first.parts["rim"].depth)) / whole if whole > 0 else None


WITHIN = (
    _row("rim's heat within the depth", "1: all of it", "1", "S, steps 1, 3", lambda c: 1.0)
    .beside(_within, "heat tails off without an edge; a thin rim, or one heated before, moves it as well")
    .given(lambda c: [("b", c.found.first.parts["rim"].depth, "m")])
)
_FOURIER = dataclasses.replace(
    FOURIER, formula=lambda p: "a τ/δ², for b > δ" if p.depth > p.thickness else "1/3, for b ≤ δ"
)


def _law(c: Chain) -> str:
    """In words, what the share into the rim is taken from."""
    source = c.before.inputs["share"].source
    if source.startswith("effusivities"):
        return "α_TP = e_1/(e_1 + e_2)"
    return "α_TP: law of the scene" if source == "scene" else "α_TP, as given"


def _lining_share(c: Chain) -> float | None:
    share = simulated_share(c.before)
    return None if share is None else 1 - share


SHARE = (
    _row("share into the rim", _law, "1", "S, step 4", lambda c: c.found.first.share)
    .beside(lambda c: simulated_share(c.before), SHARE_WHY)
    .given(lambda c: [("T_rim", c.start["rim"], "K"), ("T_lining", c.start["lining"], "K")])
)
REST = (
    _row("share into the linings", "1 − α_TP", "1", "S-42", lambda c: 1 - c.found.first.share)
    .beside(_lining_share, SHARE_WHY)
    .given(lambda c: [("α_TP", c.found.first.share, "1")])
)
REFINED_SHARE = dataclasses.replace(
    SHARE, name="share into the rim, refined", source="S, step 7", value=lambda c: c.found.last.share
).given(lambda c: [(f"T_{name}", c.found.last.parts[name].bulk, "K") for name in _HEATED])
BULK = (
    _of_part("mean bulk temperature, {part}", "T + (2/3) α W/(c G)", "K", "S-25, step 5", lambda p: p.bulk)
    .beside(
        lambda p: p.simulated_bulk,
        lambda p: (
            BULK_WHY if p.name == "rim" else "as for the rim; linings and rim also exchange heat through the contact"
        ),
    )
    .given(
        lambda p: [
            ("T", p.start, "K"),
            ("α", p.share, "1"),
            ("W", p.work, "J"),
            ("c", float(p.material.specific_heat), "J/(kg*K)"),
            ("G", p.mass, "kg"),
        ]
    )
)
PROPERTIES = (
    _of_property(
        "temperature of the properties, {part}",
        lambda p: "T_v of step 5" if p.replaced else "room: T_v of step 5 is not above 150 °C",
        "K",
        "S, step 6",
        lambda p: p.T,
    ).given(lambda p: [("T_v", p.part.bulk, "K"), ("limit", REPLACED_ABOVE, "K")]),
    *(
        _of_property(
            f"{field.replace('_', ' ')}, {{part}}",
            lambda p, field=field, symbol=symbol: (
                f"{symbol} (no temperature dependence known)"
                if getattr(p.material, f"{field}_slope") is None
                else f"{symbol} [1 + b (T − T_r)]"
            ),
            unit,
            "S, step 6",
            lambda p, field=field: getattr(properties_at(p.material, p.T, p.part.name), field),
        )
        .beside(lambda p, field=field: p.simulated(field), "the run takes it everywhere at its own temperature")
        .given(lambda p, field=field, symbol=symbol, unit=unit: p.numbers(field, symbol, unit))
        for field, symbol, unit in (("conductivity", "λ", "W/(m*K)"), ("specific_heat", "c", "J/(kg*K)"))
    ),
)
ROUNDS = _row(
    "rounds of steps 1 to 5",
    lambda c: "until T_v changes no more" if c.found.replaced else "none: properties stay those of room temperature",
    "1",
    "S, step 7",
    lambda c: c.found.rounds,
).given(lambda c: [("last change", c.found.change, "K")])


def _of_rim(f: Callable[[Layered], float | None]) -> Callable[[Chain], float | None]:
    """A function of the run where it has a rim in layers."""
    return lambda c: of_rim(f)(c.after)


def _drop(c: Chain) -> float:
    return float(np.max(c.schmidt.temperature[:, 0] - c.schmidt.temperature[:, -1]))


#: depths, as shares of the rim's thickness, at which temperatures are shown
_DEPTHS = ((0.0, "face"), (0.25, "1/4"), (0.5, "1/2"), (0.75, "3/4"), (1.0, "back"))
LAYERS = (
    _row(
        "greatest face temperature",
        lambda c: "½ (t_{j−1} + t_{j+1}), " + ("falling power" if c.after.run is None else "the run's own heat"),
        "K",
        "S-28",
        lambda c: c.face_peak,
    )
    .beside(lambda c: c.after.peak, SCHEME_WHY)
    .given(
        lambda c: [
            ("a", float(c.after.rim.diffusivity), "m^2/s"),
            ("q", c.after.flux, "W/m^2"),
            ("N", float(c.schmidt.depth.size - 2), "1"),
        ]
    ),
    *(
        _row(f"rim at the end, {name}", "½ (t_{j−1} + t_{j+1})", "K", "S-28", lambda c, share=share: c.at_end(share))
        .beside(
            lambda c, share=share: (
                None
                if c.after.layered is None
                else np.interp(
                    share * c.after.rim_thickness, c.after.layered.profile_depth, c.after.layered.profile[-1]
                )
            ),
            SCHEME_WHY,
        )
        .given(lambda c, share=share: [("x", share * c.after.rim_thickness, "m")])
        for share, name in _DEPTHS
    ),
    _row("greatest drop over the rim", "t_1 − t_N over time", "K", "S-29", _drop)
    .beside(_of_rim(lambda run: run.drop), SCHEME_WHY)
    .given(lambda c: [("δ", c.after.rim_thickness, "m")]),
)


def _reached(part: str, formula: str, depth: Callable[[Chain], float]) -> Row[Chain]:
    return _row(f"thickness that heat reaches, {part}", formula, "m", "S, steps 1, 2", depth).given(
        lambda c: [("a", float(getattr(c.after, part).diffusivity), "m^2/s"), ("τ", c.after.time, "s")]
    )


RIM_DEPTH = _reached("rim", "1.73 √(a τ), Fo = 1/3", lambda c: c.rim_cases[0].thickness.depth)
STORAGE = Row[Case[RimThickness]](
    "thickness that holds the heat, {part}", "Q/(ρ c ΔT_p)", "m", "energy", lambda case: case.thickness.storage
).given(lambda case: case.numbers)
RIM_THICKNESS = (
    _row(
        "rational thickness, rim",
        "greatest of these",
        "m",
        "S, step 8",
        lambda c: max(case.thickness.rational for case in c.rim_cases),
    )
    .beside(
        lambda c: None if c.rim is None else c.rim.wall.thickness,
        "the run has the scene's thickness, which also carries load and wears; air and flange take heat in a long duty",
    )
    .given(lambda c: [(f"δ, {case.name}", case.thickness.rational, "m") for case in c.rim_cases])
)
LINING_DEPTH = _reached("lining", "1.73 √(a τ)", lambda c: c.lining_cases[0].thickness.depth)
INSULATION = Row[Case[LiningThickness]](
    "thickness that keeps the back cool, {part}",
    "√(a τ/Fo_p), θ(Fo_p) = (T_p − T_0)/(T_f − T_0)",
    "m",
    "Carslaw & Jaeger §3.4",
    lambda case: case.thickness.insulation,
).given(lambda case: case.numbers)
LINING_THICKNESS = (
    _row(
        "rational thickness, lining",
        "greatest of these",
        "m",
        "S, step 8",
        lambda c: max(value for _, value, _ in c.lining_thicknesses),
    )
    .beside(
        lambda c: None if c.lining is None else c.lining.wall.thickness,
        "the run has the scene's thickness, of which a part is there to wear",
    )
    .given(lambda c: c.lining_thicknesses)
)
LINING_BACK = (
    _row(
        "lining's back after the braking",
        "T_0 + (T_f − T_0) θ(a τ/δ²)",
        "K",
        "Carslaw & Jaeger §3.4",
        lambda c: back_temperature(
            c.after.lining, c.after.lining_thickness, c.after.time, face=c.face_peak, start=c.lining_body
        ),
    )
    .beside(
        lambda c: None if c.lining is None else np.max(c.lining.layers[:, -1]),
        "the formula starts from a lining of one temperature; the run's has what earlier brakings left",
    )
    .given(
        lambda c: [
            ("T_0", c.lining_body, "K"),
            ("T_f", c.face_peak, "K"),
            ("τ", c.after.time, "s"),
            ("δ", c.after.lining_thickness, "m"),
        ]
    )
)


def _at_peak(run: Layered) -> tuple[float, float, float]:
    """Relative time, power and work at the maximum of the simulated face temperature."""
    i, power = int(np.argmax(run.surface)), np.gradient(run.work, run.t)
    time, last = float(run.t[i] - run.t[0]) / run.duration, float(run.work[-1])
    return time, float(power[i]) * run.duration / last, float(run.work[i] / run.work[-1])


RELATIVE = tuple(
    _of_braking(name, formula, "1", "S, step 9", lambda b, value=value: value)
    .beside(of_rim(lambda run, i=i: _at_peak(run)[i]), "the power does not fall linearly from the first moment")
    .given(lambda b: [("τ_T", b.time, "s")])
    for i, (name, formula, value) in enumerate(
        (
            ("relative time of the maximum", "τ/τ_T = 1/2, half-space under falling power", 0.5),
            ("relative power then", "τ_N = 2 (1 − τ/τ_T)", 1.0),
            ("relative work then", "τ_W = 2 τ/τ_T − (τ/τ_T)²", 0.75),
        )
    )
)


def _kept(b: Braking) -> float | None:
    """Heat (J) that the rim of the run keeps of the braking."""
    rim = None if b.run is None else b.run.rim
    return None if rim is None else float(rim.content[-1] * float(rim.wall.area) * rim.wall.copies)


def _kept_flux(b: Braking) -> float | None:
    kept = _kept(b)
    return None if kept is None else kept / (b.track_area * b.time)


def _four_turns(b: Braking) -> float | None:
    """Time (s) at which the simulated braking has made its first four revolutions, `None` where it makes fewer."""
    run = b.run
    if run is None:
        return None
    angle = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t))])
    return float(np.interp(8 * math.pi, angle, run.t)) if angle[-1] >= 8 * math.pi else None


def _turning(b: Braking) -> float | None:
    time = _four_turns(b)
    return None if time is None or b.run is None else time - float(b.run.t[0])


def _gained(b: Braking) -> float | None:
    """Heat (J) into the rim in that time."""
    time, run = _four_turns(b), b.run
    if time is None or run is None:
        return None
    return b.share * float(b.power.heat) * float(np.interp(time, run.t, run.work))


_KEPT = "linings, flange and air take from the rim, or give to it, while it is braked"
_FIRST = "the first four revolutions are faster than the mean, and their power is another"
_BESIDE = {
    "time of four revolutions": (_turning, _FIRST),
    "heat gained in it": (_gained, _FIRST),
    "mean flux kept": (_kept_flux, _KEPT),
}
HEAT = (
    _of_braking("heat into the rim", "α W", "J", "S-18", lambda b: b.metal_heat)
    .beside(_kept, _KEPT)
    .given(lambda b: [("α", b.share, "1"), ("W", b.heat, "J")])
)
_BALANCE = tuple(row.beside(*_BESIDE[row.name]) if row.name in _BESIDE else row for row in BALANCE)
GRADIENT = (
    _of_braking(
        "greatest gradient at the face",
        "2 q/λ: falling power at first",
        "K/m",
        "S-23",
        lambda b: 2 * b.flux / float(b.rim.conductivity),
    )
    .beside(
        of_rim(lambda run: np.max((run.surface - run.course.layers[:, 0]) / run.course.depth[0])),
        "the power is not that of a linear fall, and the covered track takes more than the mean",
    )
    .given(lambda b: [("q", b.flux, "W/m^2"), ("λ", float(b.rim.conductivity), "W/(m*K)")])
)


def _rest(b: Braking) -> float | None:
    """Time (s) from the beginning of the hardest of several brakings to its rest, not the rest after another one."""
    assert b.run is not None
    assert b.result is not None
    end = float(b.run.t[-1])
    rests = [e.time for e in b.result.events if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)]
    return rests[0] - float(b.run.t[0]) if rests and rests[0] - end < b.run.duration else None


def _angle(b: Braking) -> float | None:
    """Angle (rad) of the hardest of several brakings."""
    time = _rest(b)
    if time is None or b.result is None or b.run is None:
        return None
    begin = float(b.run.t[0])
    phi = np.asarray(b.result.series(np.array([begin, begin + time])).phi)
    return float(phi[1] - phi[0])


_HARDEST: dict[str, Callable[[Braking], float | None]] = {
    "stopping time": _rest,
    "stopping angle": _angle,
    "friction work": of_run(lambda run: run.work[-1]),
}


def _of_hardest(row: Row[Braking]) -> Row[Braking]:
    """A row of the stop beside what the run shows over its hardest braking alone."""
    special = _HARDEST.get(row.name)
    if special is None:
        return row

    def simulated(b: Braking) -> float | None:
        return special(b) if b.run is not None and b.run.brakings > 1 else row.simulated(b)

    return row.beside(simulated, row.why)


_BY_NAME = {row.name: _of_hardest(row) for row in STOP}
_MAIN = ("stopping time", "brake torque")
_STOP = tuple(_BY_NAME[name] for name in _MAIN) + tuple(row for name, row in _BY_NAME.items() if name not in _MAIN)
#: a lever that holds the speed, a load that outweighs the brake: no stop by statics
NO_STOP = (
    _of_braking(
        "mean brake torque", "W/φ", "N*m", "energy", lambda b: b.work * b.R_b / b.travel if b.travel > 0 else None
    ).given(lambda b: [("W", b.work, "J")]),
    _of_braking("friction work", "of the braking", "J", "run", lambda b: b.work).given(lambda b: [("τ", b.time, "s")]),
)


def _slid(b: Braking) -> float | None:
    """Way of the linings on the track in the run (m)."""
    if b.run is None:
        return None
    s = b.run.series
    return float(np.trapezoid(np.abs(np.asarray(s.slip_speed)), np.asarray(s.t)))


def _drum(b: Braking) -> tuple[float, float] | None:
    """Effective drum radius (m) and lines strung of a load on a hook."""
    load = b.scene.duty.load
    radius, lines = getattr(load, "drum_radius", None), getattr(load, "line_count", None)
    return None if radius is None or lines is None else (float(radius), float(lines))


def _hook(angle: Callable[[Braking], float | None]) -> Callable[[Braking], float | None]:
    """Travel of the hook for an angle of the drum."""

    def travel(b: Braking) -> float | None:
        drum, phi = _drum(b), angle(b)
        return None if drum is None or phi is None else drum[0] / drum[1] * float(phi)

    return travel


_HOLDS = "the band holds against the load, is stretched before it slides, and hot linings rub less"
ENDS = (
    _of_braking("slack tension, greatest", "T_0 of the lever", "N", "", lambda b: b.T_0).beside(
        of_run(lambda run: np.max(np.asarray(run.series.slack_tension))), _HOLDS
    ),
    _of_braking("tight tension, greatest", "Π T_0", "N", "Z-14", lambda b: b.by_statics.ratio * b.T_0)
    .beside(of_run(lambda run: np.max(np.asarray(run.series.tight_tension))), _HOLDS)
    .given(lambda b: [("Π", b.by_statics.ratio, "1"), ("T_0", b.T_0, "N")]),
    _of_braking("friction travel", "R_b φ", "m", "", lambda b: b.R_b * b.by_statics.angle)
    .beside(_slid, "as the stopping angle; a band that is stretched meanwhile slides less")
    .given(lambda b: [("R_b", b.R_b, "m"), ("φ", b.by_statics.angle, "rad")]),
    _of_braking("hook travel", "r_d φ/n", "m", "", _hook(lambda b: b.by_statics.angle))
    .beside(_hook(_BY_NAME["stopping angle"].simulated), "as the stopping angle")
    .given(lambda b: [("r_d", (_drum(b) or (0.0, 0.0))[0], "m"), ("n", (_drum(b) or (0.0, 0.0))[1], "1")]),
)


def _load(b: Braking) -> tuple[float, float]:
    """Work (J) and time (s) of the classical stop, else of the braking."""
    return (b.work, b.time) if b.stop is None else (b.stop.work, b.stop.time)


def _run_pressure(b: Braking) -> float | None:
    """Mean pressure (Pa) over the way that the linings of the run slide."""
    if b.run is None:
        return None
    s = b.run.series
    loads, way = np.asarray(s.normal_load).sum(axis=1), np.abs(np.asarray(s.slip_speed))
    return float(np.trapezoid(loads * way, np.asarray(s.t)) / np.trapezoid(way, np.asarray(s.t))) / b.lining_area


_STOPPING = "as friction work and stopping time"
POWER_LOAD = (
    _of_braking(
        "power load of the linings, mean",
        "W/(A_l τ)",
        "W/m^2",
        "S-7",
        lambda b: _load(b)[0] / (b.lining_area * _load(b)[1]),
    )
    .beside(lambda b: None if b.run is None else b.work / (b.lining_area * b.time), _STOPPING)
    .given(lambda b: [("W", _load(b)[0], "J"), ("A_l", b.lining_area, "m^2"), ("τ", _load(b)[1], "s")])
)
_PRESSURE = PRESSURE.beside(
    _run_pressure, "the formula leaves out the angle at which the band leaves a lining, and takes friction as at first"
)
LOAD = (
    _of_braking("energy load of the linings", "W/A_l", "J/m^2", "S-7", lambda b: _load(b)[0] / b.lining_area)
    .beside(lambda b: None if b.run is None else b.work / b.lining_area, _STOPPING)
    .given(lambda b: [("W", _load(b)[0], "J"), ("A_l", b.lining_area, "m^2")]),
    POWER_LOAD,
    _PRESSURE,
)


# --- limits -----------------------------------------------------------------------------------------------------------


class Loaded(NamedTuple):
    """What a permissible value is compared with."""

    permissible: float | None
    value: float | None
    simulated: float | None


def _margin(name: str, formula: str, unit: str, loaded: Callable[[Chain], Loaded], why: str) -> Row[Chain]:
    """What is left up to a permissible value, by the estimate and by the run; no row without a limit."""

    def left(c: Chain) -> float | None:
        found = loaded(c)
        return None if found.permissible is None or found.value is None else found.permissible - found.value

    def simulated(c: Chain) -> float | None:
        found = loaded(c)
        return None if found.permissible is None or found.simulated is None else found.permissible - found.simulated

    return (
        _row(f"margin, {name}", formula, unit, "S, step 12", left)
        .beside(simulated, why)
        .given(lambda c: [("permissible", loaded(c)[0] or 0.0, unit), ("found", loaded(c)[1] or 0.0, unit)])
    )


def _against(limit: str, row: Row[Chain] | Row[Braking]) -> Callable[[Chain], Loaded]:
    """A row beside the permissible value of it."""

    def loaded(c: Chain) -> Loaded:
        filled: EstimateRow | None = row.at(c if row is LINING_BACK else c.before)  # pyright: ignore
        found = (None, None) if filled is None else (filled.value, filled.simulated)
        return Loaded(c.limits.get(limit), *found)

    return loaded


def _stressed(c: Chain) -> Loaded:
    stress = STRESS[0].simulated(c.after)
    return Loaded(c.after.elastic.permissible, abs(c.after.stress), None if stress is None else abs(stress))


_FACE = "the run's is the hottest lining's face, which contact resistance and unequal work leave hotter than the rim's"
_OF_FIGURE = "as the figure that it is the margin of"
MARGINS = (
    _margin(
        "face of the linings",
        "T_p − T_max",
        "K",
        lambda c: Loaded(
            c.limits["lining_permissible"], c.face_peak, None if c.before.run is None else c.before.run.face
        ),
        _FACE,
    ),
    _margin("back of the linings", "T_p − T_back", "K", _against("back_permissible", LINING_BACK), _OF_FIGURE),
    _margin("stress of the rim", "σ_p − |σ|", "Pa", _stressed, _OF_FIGURE),
    _margin("pressure", "permissible − mean", "Pa", _against("pressure_permissible", _PRESSURE), _OF_FIGURE),
    _margin("power load", "permissible − mean", "W/m^2", _against("power_permissible", POWER_LOAD), _OF_FIGURE),
)


def _verdict(row: SynthesisRow) -> str:
    """Within limit or exceeded by the estimate, and what the run says where that is something else."""
    by_estimate, by_run = (
        None if margin is None else LimitVerdict.WITHIN if margin >= 0 else LimitVerdict.EXCEEDED
        for margin in (row.value, row.simulated)
    )
    return f"{by_estimate}" if by_run in (None, by_estimate) else f"{by_estimate}, in the run {by_run}"


# --- the steps --------------------------------------------------------------------------------------------------------


class Group(NamedTuple, Generic[_C]):
    """Rows of a step and the contexts, each with a name, in which they are filled."""

    rows: Sequence[Row[_C]]
    contexts: Callable[[Chain], Iterable[tuple[_C, str]]]
    ending: str = ""  # of the names


def _chain(*rows: Row[Chain]) -> Group[Chain]:
    return Group(rows, lambda c: [(c, "")])


def _before(*rows: Row[Braking], when: Callable[[Chain], bool] = lambda c: True) -> Group[Braking]:
    return Group(rows, lambda c: [(c.before, "rim")] if when(c) else [])


def _after(*rows: Row[Braking]) -> Group[Braking]:
    return Group(rows, lambda c: [(c.after, "rim")])


def _first(row: Row[HeatedPart]) -> Group[HeatedPart]:
    return Group([row], lambda c: [(part, name) for name, part in c.found.first.parts.items()])


def _heated(row: Row[HeatedPart], *, last: bool = False) -> Group[HeatedPart]:
    """Of the parts that take up heat, in the first pass or (refined) in the last."""
    return Group(
        [row],
        lambda c: [((c.found.last if last else c.found.first).parts[name], name) for name in _HEATED],
        ", refined" if last else "",
    )


#: S's steps in its own order: title, rows
STEPS: tuple[tuple[str, tuple[Group[Any], ...]], ...] = (
    ("effective depth of heat", (_first(DEPTH), _chain(WITHIN))),
    ("Fourier numbers", (_first(_FOURIER),)),
    ("effective volumes", (_first(VOLUME),)),
    ("partition of the heat", (_chain(SHARE, REST), _before(EFFUSIVITIES, TRANSMISSION))),
    ("mean bulk temperatures", (_heated(BULK),)),
    ("properties at these temperatures, where above 150 °C", (Group(PROPERTIES, Chain.properties),)),
    (
        "depth, Fourier numbers, volumes, partition once more",
        (
            _chain(ROUNDS),
            *(_heated(row, last=True) for row in (DEPTH, _FOURIER, VOLUME)),
            _chain(REFINED_SHARE),
            _heated(BULK, last=True),
        ),
    ),
    (
        "temperatures of the layers, rational thickness",
        (
            _chain(*LAYERS, RIM_DEPTH),
            Group([STORAGE], lambda c: [(case, case.name) for case in c.rim_cases]),
            _chain(RIM_THICKNESS, LINING_DEPTH),
            Group([INSULATION], lambda c: [(case, case.name) for case in c.lining_cases]),
            _chain(LINING_THICKNESS, LINING_BACK),
        ),
    ),
    ("maximum temperature of the friction surface", (_after(*MAXIMUM, FLASH, FALLING, *RELATIVE),)),
    ("heat balance", (_after(HEAT, *_BALANCE),)),
    ("thermal stress of the rim", (_after(*STRESS, GRADIENT),)),
    (
        "operating characteristics",
        (
            _before(*_STOP, *ENDS, when=lambda c: c.before.stop is not None),
            _before(*NO_STOP, when=lambda c: c.before.stop is None),
            _before(*LOAD),
            _chain(*MARGINS),
        ),
    ),
)


def _rows_of(c: Chain) -> Iterator[SynthesisRow]:
    for number, (_, groups) in enumerate(STEPS, 1):
        for group in groups:
            for context, name in group.contexts(c):
                for row in group.rows:
                    for found in row.of_step(number, context, name, ending=group.ending):
                        yield dataclasses.replace(found, verdict=_verdict(found)) if row in MARGINS else found


@dataclasses.dataclass(frozen=True)
class Synthesis(RowTable[SynthesisRow]):
    """The parametric synthesis of a brake for one braking: figures of S's twelve steps beside the simulated ones.

    - `rows` in order of the steps; `inputs`: what they are made from; `about`: the braking
    - `rounds`: how often steps 1 to 5 were repeated with properties at temperature; `replaced`: parts that have them
    - `rim_thickness`, `lining_thickness`: rational (m), `inf` where none will do
    - `synthesis["friction work"]` is one figure, `synthesis.step(8)` those of a step; `str` gives the report,
      `as_dict` the same as numbers and words
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
        return self[RIM_THICKNESS.name].value

    @property
    def lining_thickness(self) -> float:
        """Rational thickness of the linings without what they may wear (m)."""
        return self[LINING_THICKNESS.name].value

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
        """Every figure as numbers and words; numbers that are not finite are `None`."""
        return [row.as_dict() for row in self.rows]

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words; numbers that are not finite are `None`."""
        about = {"about": self.about, "rounds": self.rounds, "replaced": list(self.replaced)}
        return {**about, "inputs": plain(self.inputs), "steps": self.as_list()}

    def parts(self) -> Iterator[str | Table]:
        yield from self.head()
        for number, (title, _) in enumerate(STEPS, 1):
            rows = self.step(number)
            yield from ("", f"{number}. {title}: {rows[0].words}")
            yield from table_of(rows, numbers=True)


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
    """Parametric synthesis of a brake for one braking, after S: twelve steps from the depth of heat to operation.

    1. effective depth of heat `b = 1.73 √(a τ)`;  2. Fourier numbers;  3. effective volumes;  4. partition of the heat;
    5. mean bulk temperatures;  6. properties at these, where they exceed 150 °C;  7. depth, Fourier numbers, volumes
    and partition once more, until the temperatures change no more;  8. temperatures of the rim's layers, rational
    thickness of rim and lining;  9. maximum temperature;  10. heat balance;  11. thermal stress;  12. operating
    characteristics with the permissible limits.

    - `run`: a `Scene`, of which a classical stop gives time and work, or a `Result`: its hardest braking, and every
      figure stands beside the simulated one where the run has it
    - `data`: numbers that the scene does not have, or others in their place (as for `estimates`)
    - `permissible`: limits of temperature, pressure and power
    - `partition`: law of step 4, as `TransmissionPartition` for S-41; by default `data.share`, else the scene's law,
      else effusivities at the properties of the round
    - `tolerance` (K) of the repeat of step 7 and maximum number of its `rounds`

    Raises `InputError` as `estimates` does, for a staged brake, and for wrong options, `SynthesisError` with the
    code `no_convergence` or `material_range` where step 7 finds no temperature.
    """
    limits = permissible or Permissible()
    scene = run.scene if isinstance(run, Result) else run
    wrong = faults_of_synthesis(scene, data, limits)
    if not 0 < tolerance < math.inf:
        wrong.append(Fault("tolerance", f"{tolerance} is out of range", "must be > 0 K"))
    if rounds < 1:
        wrong.append(Fault("rounds", f"{rounds} is out of range", "at least 1"))
    if wrong:
        raise InputError(wrong)
    before, about = braking_of(run, data)
    if before.run is not None and before.run.brakings > 1:
        before = dataclasses.replace(before, stop=classical_stop(before.run.then))
    start = _start_temperatures(before)
    refined = refine(before, start, partition, tolerance, rounds)
    settled = limits.settled(before.scene)
    materials = {name: part.material for name, part in refined.last.parts.items()}
    after = before.with_inputs(**materials, share=refined.last.share)
    chain = Chain(before, after, refined, start, {limit.name: float(limit.value) for limit in settled})
    inputs = (*before.inputs.values(), *settled)
    return Synthesis(f"parametric synthesis{about}", inputs, tuple(_rows_of(chain)), refined.rounds, refined.replaced)


def _start_temperatures(b: Braking) -> dict[str, float]:
    """Mean temperatures (K) of rim, lining and band as the braking begins; without a run all as the rim.

    The lining's is that of the depth which the braking heats: a lining that has braked before is hot at its face.
    """
    start = dict.fromkeys(b.parts, b.start_now)
    if b.run is not None and b.run.lining is not None:
        depth = float(penetration_depth(float(b.lining.diffusivity), b.time))
        start["lining"] = float(b.run.lining.mean(depth)[0])
    if b.run is not None and b.run.band is not None:
        start["band"] = float(b.run.band[0])
    return start


def faults_of_synthesis(scene: Scene, data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """All input errors of a synthesis, found before anything is simulated."""
    found = [*faults(scene), *faults_of_data(data, limits)]
    if band_brake(scene).in_series:
        hint = "it is of a brake with one friction pair; `estimates` takes both pairs of a staged one"
        found.append(Fault("brake.bandage", "is not for this synthesis", hint))
    return found
