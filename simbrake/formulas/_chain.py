"""What the steps of the synthesis hand on: properties at the temperature they lead to, layers, rational thickness."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, SupportsFloat

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from ..thermal._heat import AbstractPartition
from ..thermal._material import ROOM, Material, effusivity_share
from ._braking import Braking, HeatedPart, WallCourse, schmidt_layers
from ._estimates import PART_SYMBOLS, simulated_share
from ._inputs import rim_wall
from ._rows import Of, Symbols, rows, there
from .heating import (
    SchmidtCourse,
    back_temperature,
    rational_lining_thickness,
    rational_rim_thickness,
    schmidt,
)

#: above this mean bulk temperature (K) properties are taken at it (S, step 6), below at room temperature
REPLACED_ABOVE = 273.15 + 150.0
HEATED = ("rim", "lining")  # the band takes up no friction heat in a brake with one pair


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
    replaced = tuple(part for part in HEATED if first.parts[part].bulk > REPLACED_ABOVE)
    if not replaced:
        return Refinement(first, first, (), 0, 0.0)
    change = math.inf
    for n in range(1, rounds + 1):
        at = {part: last.parts[part].bulk if part in replaced else ROOM for part in start}
        before, last = last, one_pass(b, start, at, law)
        change = max(abs(last.parts[part].bulk - before.parts[part].bulk) for part in HEATED)
        if change <= tolerance:
            return Refinement(first, last, replaced, n, change)
    told = ", ".join(f"{part} {last.parts[part].bulk:.6g} K" for part in replaced)
    words = f"after {rounds} rounds the bulk temperatures still change by {change:.3g} K ({told})"
    raise SynthesisError("no_convergence", f"{words}; allow more rounds, or the braking is close to a thermal runaway")


# --- the chain --------------------------------------------------------------------------------------------------------


class Case(NamedTuple):
    """A thickness (m) for this `braking`, or for the `whole duty` where that has several brakings.

    `depth`, `other`: the two that the `rational` one is the larger of; `numbers` put into the formula of the other.
    """

    name: str
    depth: float
    other: float
    rational: float
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

    def simulated(self, field: str) -> float:
        """A property by the scene's own law at the simulated mean temperature of the heated depth."""
        material = there(self.part.course).wall.material
        return float(getattr(material, field)) * property_factor(material, field, self.part.simulated_bulk)


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
        if run is not None and run.layered and wall is not None:
            return run.schmidt(dataclasses.replace(wall, material=b.rim), share, b.track_area)

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

    def property_of(self, name: str) -> Property:
        """What step 6 takes of a part."""
        part, replaced = self.found.first.parts[name], name in self.found.replaced
        T = part.bulk if replaced else self.found.first.at[name]
        return Property(part, self.before.parts[name].material, replaced, T)

    @functools.cached_property
    def rim_cases(self) -> list[Case]:
        """Thickness for this braking; for a duty of several, for the heat of all of them without cooling as well."""
        b, limit = self.after, self.limits["lining_permissible"]
        cases = [("braking", b.metal_heat / b.track_area, limit - self.start["rim"])]
        if self.several and b.run is not None:
            heat = b.share * float(b.power.heat) * b.run.total_work / b.track_area
            cases.append(("whole duty", heat, limit - float(b.start)))
        return [
            Case(
                name,
                *rational_rim_thickness(b.rim, b.time, heat=heat, rise=rise),
                [("Q", heat, "J/m^2"), ("ρ c", self.capacity, "J/(m^3*K)"), ("ΔT_p", rise, "K")],
            )
            for name, heat, rise in cases
        ]

    @functools.cached_property
    def lining_cases(self) -> list[Case]:
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
                *rational_lining_thickness(b.lining, time, face=face, back=back, start=start),
                [a, ("τ", time, "s"), ("T_f", face, "K"), ("T_p", back, "K"), ("T_0", start, "K")],
            )
            for name, time, face, start in cases
        ]

    @property
    def lining_thicknesses(self) -> list[tuple[str, float, str]]:
        """All that the rational thickness of a lining is the maximum of."""
        reached = ("δ, heat reaches", self.lining_cases[0].depth, "m")
        return [reached, *((f"δ, {case.name}", case.other, "m") for case in self.lining_cases)]


# --- rows of the chain ------------------------------------------------------------------------------------------------

#: numbers put into formulas of the chain
_CHAIN_SYMBOLS: Symbols[Chain] = {
    "b": ("m", lambda c: c.found.first.parts["rim"].depth),
    "T_rim": ("K", lambda c: c.start["rim"]),
    "T_lining": ("K", lambda c: c.start["lining"]),
    "T_rim|last": ("K", lambda c: c.found.last.parts["rim"].bulk),
    "T_lining|last": ("K", lambda c: c.found.last.parts["lining"].bulk),
    "α_TP": ("1", lambda c: c.found.first.share),
    "last change": ("K", lambda c: c.found.change),
    "τ": ("s", lambda c: c.after.time),
    "q": ("W/m^2", lambda c: c.after.flux),
    "N": ("1", lambda c: c.schmidt.depth.size - 2),
    "a|rim": ("m^2/s", lambda c: c.after.rim.diffusivity),
    "a|lining": ("m^2/s", lambda c: c.after.lining.diffusivity),
    "δ|rim": ("m", lambda c: c.after.rim_thickness),
    "δ|lining": ("m", lambda c: c.after.lining_thickness),
    "T_0": ("K", lambda c: c.lining_body),
    "T_f": ("K", lambda c: c.face_peak),
}


def _within(c: Chain) -> float:
    """Of the simulated heat of the rim at the end of the braking, the share that lies within the depth of step 1."""
    rim = there(c.rim)
    rise = rim.layers[-1] - rim.layers[0]
    whole = float(rise @ rim.steps)
    return float(rise @ rim.inside(c.found.first.parts["rim"].depth)) / there(whole if whole > 0 else None)


def _law(c: Chain) -> str:
    """In words, what the share into the rim is taken from."""
    source = c.before.inputs["share"].source
    if source.startswith("effusivities"):
        return "α_TP = e_1/(e_1 + e_2)"
    return "α_TP: law of the scene" if source == "scene" else "α_TP, as given"


def _share(c: Chain) -> float:
    return simulated_share(c.before)


def _at_end(share: float) -> Of[Chain]:
    """Temperature (K) at a share of the rim's thickness, at the end of the braking."""

    def simulated(c: Chain) -> SupportsFloat:
        run = there(c.after.run)
        return np.interp(share * c.after.rim_thickness, run.profile_depth, run.profile[-1])

    return Of(lambda c: c.at_end(share), simulated, numbers=lambda c: [("x", share * c.after.rim_thickness, "m")])


def _drop(c: Chain) -> float:
    return float(np.max(c.schmidt.temperature[:, 0] - c.schmidt.temperature[:, -1]))


def _rounds(c: Chain) -> str:
    return "until T_v changes no more" if c.found.replaced else "none: properties stay those of room temperature"


def _lining_back(c: Chain) -> float:
    b = c.after
    return back_temperature(b.lining, b.lining_thickness, b.time, face=c.face_peak, start=c.lining_body)


CHAIN = rows(
    _CHAIN_SYMBOLS,
    {
        "rim's heat within the depth": Of(lambda c: 1.0, _within),
        "share into the rim": Of(lambda c: c.found.first.share, _share, _law),
        "share into the linings": Of(lambda c: 1 - c.found.first.share, lambda c: 1 - _share(c)),
        "share into the rim, refined": Of(lambda c: c.found.last.share, _share, _law),
        "rounds of steps 1 to 5": Of(lambda c: c.found.rounds, formula=_rounds),
        "greatest face temperature": Of(
            lambda c: c.face_peak,
            lambda c: c.after.peak,
            lambda c: "½ (t_{j−1} + t_{j+1}), " + ("falling power" if c.after.run is None else "the run's own heat"),
        ),
        "rim at the end, face": _at_end(0.0),
        "rim at the end, 1/4": _at_end(0.25),
        "rim at the end, 1/2": _at_end(0.5),
        "rim at the end, 3/4": _at_end(0.75),
        "rim at the end, back": _at_end(1.0),
        "greatest drop over the rim": Of(_drop, lambda c: there(c.after.run).drop),
        "thickness that heat reaches, rim": Of(lambda c: c.rim_cases[0].depth),
        "rational thickness, rim": Of(
            lambda c: max(case.rational for case in c.rim_cases),
            lambda c: there(c.rim).wall.thickness,
            numbers=lambda c: [(f"δ, {case.name}", case.rational, "m") for case in c.rim_cases],
        ),
        "thickness that heat reaches, lining": Of(lambda c: c.lining_cases[0].depth),
        "rational thickness, lining": Of(
            lambda c: max(value for _, value, _ in c.lining_thicknesses),
            lambda c: there(c.lining).wall.thickness,
            numbers=lambda c: c.lining_thicknesses,
        ),
        "lining's back after the braking": Of(_lining_back, lambda c: np.max(there(c.lining).layers[:, -1])),
    },
    "chain",
)
_OF_CASE = Of[Case](lambda case: case.other, numbers=lambda case: case.numbers)
CASES = rows(
    {},
    {"thickness that holds the heat, {part}": _OF_CASE, "thickness that keeps the back cool, {part}": _OF_CASE},
    "case",
)
_LINING = "as for the rim; linings and rim also exchange heat through the contact"
BULK = rows(
    PART_SYMBOLS,
    {
        "mean bulk temperature, {part}": Of[HeatedPart](
            lambda p: p.bulk, lambda p: p.simulated_bulk, why=lambda p: None if p.name == "rim" else _LINING
        )
    },
    "bulk",
)


def _property(field: str, symbol: str, unit: str) -> Of[Property]:
    """A property at the temperature of step 6."""

    def formula(p: Property) -> str:
        known = getattr(p.material, f"{field}_slope") is not None
        return f"{symbol} [1 + b (T − T_r)]" if known else f"{symbol} (no temperature dependence known)"

    return Of(
        lambda p: getattr(properties_at(p.material, p.T, p.part.name), field),
        lambda p: p.simulated(field),
        formula,
        numbers=lambda p: p.numbers(field, symbol, unit),
    )


PROPERTIES = rows(
    {"T_v": ("K", lambda p: p.part.bulk), "limit": ("K", lambda p: REPLACED_ABOVE)},
    {
        "temperature of the properties, {part}": Of[Property](
            lambda p: p.T,
            formula=lambda p: "T_v of step 5" if p.replaced else "room: T_v of step 5 is not above 150 °C",
        ),
        "conductivity, {part}": _property("conductivity", "λ", "W/(m*K)"),
        "specific heat, {part}": _property("specific_heat", "c", "J/(kg*K)"),
    },
    "property",
)
