"""Contacts between surfaces by resistance, pressure and gap, and faces at which several heat flows meet."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from .._base._faults import Fault
from .._base._part import Part, part, quantity
from .._base._quantity import Over, Scalar
from ..hybrid._arrays import Array
from ._network import (
    AbstractLink,
    Body,
    Source,
    Surroundings,
    Temperatures,
    depends_on_temperatures,
    is_perfect,
    opens,
    place_of,
    size_of,
)

#: relative pressure below which the conductance of metals is linear in it
_SLIGHT = 1e-6


class AbstractContactLaw(Part):
    """A contact conductance `h_c(p)` in W/(m²·K)."""

    @abc.abstractmethod
    def conductance(self, p: Float[Array, "..."]) -> Float[Array, "..."]:
        """At the pressure `p` (Pa)."""


class MetalContact(AbstractContactLaw):
    """Metal on metal, rough surfaces that yield: `h_c = 1.25 k_s (m/σ) (p/H)^0.95`.

    With `k_s = 2 k_1 k_2/(k_1 + k_2)`, `m = √(m_1² + m_2²)`, `σ = √(σ_1² + σ_2²)`; each of the three as two numbers, of
    the two surfaces, or one for both. Below `p/H = 1e-6` linear in the pressure. Linings of polymers contact
    elastically: give these a number.

    - `conductivity` `k` (W/(m·K)), `slope` `m` of the asperities, `roughness` `σ` (m)
    - `hardness` `H` (Pa) of the softer

    Reference: M. M. Yovanovich, *IEEE Trans. Compon. Packag. Technol.* 28 (2005) 182.

    Example:
        >>> law = sb.thermal.MetalContact(50.0, slope=0.15, roughness=2e-6, hardness=3e9)
        >>> law.conductance(np.array([0.5e6, 1e6])).round().tolist()
        [1207.0, 2332.0]
    """

    conductivity: Scalar = quantity("W/(m*K)", "conductivities of both metals", positive=True, many=Over.ROWS)
    slope: Scalar = quantity("1", "mean slopes of the asperities", positive=True, many=Over.ROWS)
    roughness: Scalar = quantity("m", "roughnesses of both surfaces", positive=True, many=Over.ROWS)
    hardness: Scalar = quantity("Pa", "hardness of the softer metal", positive=True)

    def conductance(self, p: Float[Array, "..."]) -> Float[Array, "..."]:
        k, m, sigma = (jnp.broadcast_to(x, (2,)) for x in (self.conductivity, self.slope, self.roughness))
        x = p / self.hardness
        slopes = jnp.sqrt(jnp.sum(m**2) / jnp.sum(sigma**2))
        return 1.25 * 2 / jnp.sum(1 / k) * slopes * x * (x**2 + _SLIGHT**2) ** -0.025


class ThermalContact(AbstractLink):
    """Two surfaces in contact: `g = h_c A`, `h_c = 1/R_c`.

    - `area` (m²); `resistance` `R_c` (m²·K/W), `None` for perfect contact (one of the two must then be a wall's face)
    - `opens`: nothing flows while the surfaces are apart: rim and linings of a standard brake, linings and band of a
      staged one, while the band is open; rim and a lining of a staged one while it has lifted off. What crosses the
      gap is a separate link: `Convection` or `Radiation` from one to the other, with `covered=1.0`
    - `law` of `h_c` by the pressure of the linings, in place of `resistance`; of one node for all linings their mean

    Example:
        >>> sb.thermal.ThermalContact("rim", "lining", 1.2, resistance=2e-3)
        ThermalContact(a='rim', b='lining', area=1.2 m², resistance=0.002 m²·K/W)
    """

    a: str = eqx.field(static=True)
    b: str = eqx.field(static=True)
    area: Scalar = quantity("m^2", "area in contact", positive=True)
    resistance: Scalar | None = quantity("m^2*K/W", "contact resistance", positive=True, default=None)
    opens: bool = eqx.field(static=True, default=False)
    law: AbstractContactLaw | None = part(AbstractContactLaw, default=None)

    def conductance(self, T_a: Temperatures, T_b: Temperatures, around: Surroundings) -> Temperatures | None:
        if self.law is None:
            return None if self.resistance is None else self.area / jnp.asarray(self.resistance)
        h = self.law.conductance(jnp.asarray(around.pressure))
        alone = max(T_a.size, T_b.size) == 1
        return self.area * (jnp.mean(h) if alone else h)


# --- faces at which several heat flows meet ---------------------------------------------------------------------------


class Surface(NamedTuple):
    """Faces of walls that have one temperature: one face, or several in perfect contact.

    - `faces`: their places;  `size`: number of its temperatures, 1 or one per lining
    - `nodes`: lumps, junctions or reservoirs in perfect contact with them, whose temperature it has (at most one)
    """

    faces: tuple[str, ...]
    size: int
    nodes: tuple[str, ...]


def joined_faces(bodies: tuple[Body, ...], links: tuple[AbstractLink, ...], sources: tuple[Source, ...]) -> set[str]:
    """Faces of walls at which a link ends beside another link or a source."""
    by_name = {body.name: body for body in bodies}
    ends: dict[str, int] = {}
    for link in links:
        for place, other in ((link.a, link.b), (link.b, link.a)):
            if place_of(place)[1]:
                flows = place_size(other, by_name) if place_size(place, by_name) == 1 else 1
                ends[place] = ends.get(place, 0) + flows
    for source in sources:
        if source.a in ends:
            ends[source.a] += 1
    return {place for place, count in ends.items() if count > 1}


def place_size(place: str, by_name: dict[str, Body]) -> int:
    """Number of nodes of a place."""
    name, face = place_of(place)
    return size_of(by_name[name], face)


def surfaces_of(
    bodies: tuple[Body, ...], links: tuple[AbstractLink, ...], sources: tuple[Source, ...]
) -> list[Surface]:
    """Surfaces whose temperatures follow from a balance of several flows, or of one that depends on temperatures.

    A face with one link of a given conductance is none of them: it lies in series with that link.
    """
    by_name = {body.name: body for body in bodies}
    joined = joined_faces(bodies, links, sources)
    for link in links:
        if depends_on_temperatures(link, bodies):
            joined |= {place for place in (link.a, link.b) if place_of(place)[1]}
    groups = [{place} for place in sorted(joined)]
    for link in links:
        ends = {link.a, link.b}
        if (
            is_perfect(link, bodies)
            and not opens(link)
            and ends & joined
            and not any(place_of(p)[1] for p in ends - joined)
        ):
            touching = [group for group in groups if group & (ends & joined)]
            groups = [group for group in groups if group not in touching] + [set().union(ends, *touching)]
    found = []
    for group in groups:
        faces = tuple(sorted(place for place in group if place_of(place)[1]))
        nodes = tuple(sorted(group - set(faces)))
        found.append(Surface(faces, min(place_size(place, by_name) for place in group), nodes))
    return found


def faults_of_surfaces(
    bodies: tuple[Body, ...], links: tuple[AbstractLink, ...], sources: tuple[Source, ...], path: str
) -> list[Fault]:
    """Errors of perfect contacts at faces with other links: they open, or hold several lumps at one temperature."""
    by_name, found = {body.name: body for body in bodies}, []
    surfaces = surfaces_of(bodies, links, sources)
    for i, link in enumerate(links):
        faces = [face for surface in surfaces for face in surface.faces if face in (link.a, link.b)]
        if faces and opens(link) and is_perfect(link, bodies):
            what = f"perfect contact that opens, at {faces[0]} with other links"
            found.append(Fault(f"{path}.links[{i}].resistance", what, "give it a resistance"))
    for surface in surfaces:
        if len(surface.nodes) > 1 or any(place_size(node, by_name) > surface.size for node in surface.nodes):
            what = f"perfect contacts at {' and '.join(surface.faces)} hold {' and '.join(surface.nodes)} together"
            found.append(Fault(f"{path}.links", what, "give all but one a resistance"))
    return found
