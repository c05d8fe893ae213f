"""Properties at the bulk temperature that they themselves lead to: the fixed point of steps 1 to 7 of the synthesis."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from ..thermal._heat import AbstractPartition
from ..thermal._material import ROOM, Material, effusivity_share
from ._estimate_basis import Basis
from ._thermal_estimates import effective_fourier_number, effective_volume, mean_bulk_rise, penetration_depth

#: above this mean bulk temperature (K) properties are taken at it (S, step 6), below at room temperature
REPLACED_ABOVE = 273.15 + 150.0
PARTS: tuple[str, ...] = ("rim", "lining", "band")  # the band takes up no friction heat in a brake with one pair
_SHARES_HEAT: tuple[str, ...] = ("rim", "lining")


class SynthesisError(RuntimeError):
    """A synthesis that came to no end; `code` says why.

    - `no_convergence`: the temperatures still changed after the last round
    - `material_range`: a property, linear in the temperature, would no longer be positive
    """

    def __init__(self, code: str, message: str):
        super().__init__(f"{code}: {message}")
        self.code = code


@dataclasses.dataclass(frozen=True)
class Pass:
    """Steps 1 to 5 with the properties of one set of temperatures; numbers by the name of the part (SI units)."""

    materials: dict[str, Material]  # with constant properties
    at: dict[str, float]  # temperatures of the properties, K
    depth: dict[str, float]  # m
    Fo: dict[str, float]
    volume: dict[str, float]  # m³
    mass: dict[str, float]  # kg, of that volume
    share: float  # of the friction heat, into the rim
    bulk: dict[str, float]  # mean bulk temperature, K


@dataclasses.dataclass(frozen=True)
class Refinement:
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


def properties_at(material: Material, T: float, part: str = "material") -> Material:
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


def share_law(
    b: Basis, partition: AbstractPartition | None
) -> Callable[[dict[str, float], dict[str, Material]], float]:
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


def one_pass(b: Basis, start: dict[str, float], at: dict[str, float], law: Callable[..., float]) -> Pass:
    """Depth, Fourier number, effective volume, partition and mean bulk temperature with properties at `at` (K)."""
    materials = {part: properties_at(getattr(b, part), at[part], part) for part in PARTS}
    share = law({part: max(at[part], start[part]) for part in PARTS}, materials)
    heat = {"rim": share * b.heat, "lining": (1 - share) * b.heat, "band": 0.0}
    depth, Fo, volume, mass, bulk = {}, {}, {}, {}, {}
    for part, material in materials.items():
        area = b.track_area if part == "rim" else b.lining_area
        thickness, a = getattr(b, f"{part}_thickness"), float(material.diffusivity)
        depth[part] = float(penetration_depth(a, b.time))
        Fo[part] = float(effective_fourier_number(a, b.time, thickness))
        volume[part] = float(effective_volume(area, thickness, depth[part]))
        mass[part] = volume[part] * float(material.density)
        rise = float(mean_bulk_rise(1.0, heat[part], float(material.specific_heat), mass[part]))
        bulk[part] = start[part] + rise
    return Pass(materials, at, depth, Fo, volume, mass, share, bulk)


def refine(
    b: Basis, start: dict[str, float], partition: AbstractPartition | None, tolerance: float, rounds: int
) -> Refinement:
    """Repeats steps 1 to 5 with properties at the bulk temperatures they gave, until these change no more (K).

    A part whose first bulk temperature stays at or below 150 °C keeps the properties of room temperature throughout, as
    S words it: the choice is made once, since a switch inside the repeat would leave equations without a solution. The
    rest is a plain fixed-point iteration: for a capacity that rises with the temperature it always contracts; for one
    that falls it climbs to the lowest solution, or out of the material's range where there is none. Raises
    `SynthesisError` with the code `no_convergence` or `material_range`.
    """
    law = share_law(b, partition)
    room = dict.fromkeys(PARTS, ROOM)
    first = last = one_pass(b, start, room, law)
    replaced = tuple(part for part in _SHARES_HEAT if first.bulk[part] > REPLACED_ABOVE)
    if not replaced:
        return Refinement(first, first, (), 0, 0.0)
    change: Any = np.inf
    for n in range(1, rounds + 1):
        at = {part: last.bulk[part] if part in replaced else ROOM for part in PARTS}
        before, last = last, one_pass(b, start, at, law)
        change = max(abs(last.bulk[part] - before.bulk[part]) for part in _SHARES_HEAT)
        if change <= tolerance:
            return Refinement(first, last, replaced, n, change)
    told = ", ".join(f"{part} {last.bulk[part]:.6g} K" for part in replaced)
    words = f"after {rounds} rounds the bulk temperatures still change by {change:.3g} K ({told})"
    raise SynthesisError("no_convergence", f"{words}; allow more rounds, or the braking is close to a thermal runaway")
