"""Faces of walls at which several heat flows meet, and those that have one temperature by perfect contact."""

from typing import NamedTuple

from .._base._faults import Fault
from ._network import AbstractLink, Body, Source, depends_on_temperatures, is_perfect, opens, place_of, size_of


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
