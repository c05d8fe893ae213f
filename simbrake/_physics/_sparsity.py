"""Where the Jacobian of a thermal network is sparse: chains of nodes that meet in a small core."""

import numpy as np

from ..hybrid import CORE, LINEAR
from ..thermal._heat import Heat, shared_faces
from ..thermal._network import Wall, place_of
from ._thermal import Spans, nodes_of, spans


def couplings(heat: Heat) -> np.ndarray:
    """Where the Jacobian of the network is sparse: the core, and places in chains, per node with capacity.

    Bodies that friction heats or senses are in the core, as every lining's friction depends on those before it, and so
    are those around a face that several links share. Of the rest, nodes where three or more paths meet join the core
    until only unbranched chains are left. Layers inside a wall of constant properties are marked as linear.
    """
    near = _neighbours(heat)
    kinds = np.full(len(near), CORE)
    core = _touched_by_friction(heat, near) | _around_shared_faces(heat)
    open_ = {i: near[i] - core for i in range(len(near)) if i not in core}
    branching = [i for i in open_ if len(open_[i]) > 2]
    while branching:
        hub = max(branching, key=lambda i: len(open_[i]))
        for j in open_.pop(hub):
            open_[j].discard(hub)
        branching = [i for i in branching if i in open_ and len(open_[i]) > 2]
    place = 0
    left = set(open_)
    while left:
        ends = [i for i in left if len(open_[i] & left) <= 1]
        if not ends:  # only rings are left: open one
            left.discard(min(left))
            continue
        here: int | None = min(ends)
        while here is not None:
            kinds[here] = place
            place += 1
            left.discard(here)
            here = next(iter(open_[here] & left), None)
    return np.where((kinds >= 0) & _inside_plain_walls(heat), kinds + LINEAR, kinds)


def _inside_plain_walls(heat: Heat) -> np.ndarray:
    """Which nodes with capacity are layers within a wall of constant properties, reached by conduction alone."""
    where = spans(heat)
    found = np.zeros(max((here.stop for here in where.stores.values()), default=0), bool)
    for body in heat.bodies:
        if isinstance(body, Wall):
            m = body.material
            found[where.stores[body.name]] = m.conductivity_slope is None and m.specific_heat_slope is None
    reached = [link_end for link in heat.links for link_end in (link.a, link.b)]
    reached += [source.a for source in heat.sources]
    reached += [p for pair in heat.pairs for p in (pair.metal, pair.lining, pair.beyond) if p]
    for place in reached:
        for store, i in _nodes(heat, where, place):
            if store:
                found[i] = False
    return found


def _nodes(heat: Heat, where: Spans, place: str) -> list[tuple[bool, int]]:
    """Nodes of a place: (has capacity, number)."""
    name, _ = place_of(place)
    if name not in where.stores and name not in where.junctions:
        return []
    nodes = nodes_of(heat, where, place)
    return [(name in where.stores, i) for i in range(nodes.start, nodes.stop, nodes.step)]


def _linked(heat: Heat, where: Spans) -> list[tuple[tuple[bool, int], tuple[bool, int]]]:
    """Pairs of nodes between which links run."""
    found = []
    for link in heat.links:
        a, b = _nodes(heat, where, link.a), _nodes(heat, where, link.b)
        found += zip(a, b, strict=True) if len(a) == len(b) else [(x, y) for x in a for y in b]
    return found


def _neighbours(heat: Heat) -> list[set[int]]:
    """Which nodes with capacity exchange heat, directly or through junctions."""
    where = spans(heat)
    size = max((here.stop for here in where.stores.values()), default=0)
    near: dict[tuple[bool, int], set[tuple[bool, int]]] = {(True, i): set() for i in range(size)}
    for here in where.junctions.values():
        near |= {(False, i): set() for i in range(here.start, here.stop)}

    def join(a: tuple[bool, int], b: tuple[bool, int]) -> None:
        near[a].add(b)
        near[b].add(a)

    for body in heat.bodies:
        if isinstance(body, Wall):
            here = where.stores[body.name]
            for i in range(here.start, here.stop - 1):
                if (i + 1 - here.start) % body.layers:
                    join((True, i), (True, i + 1))
    for x, y in _linked(heat, where):
        if x != y:
            join(x, y)
    for junction in [node for node in near if not node[0]]:  # eliminated: its neighbours see one another
        around = near.pop(junction)
        for x in around:
            near[x] |= around - {x}
            near[x].discard(junction)
    return [{j for _, j in near[(True, i)]} for i in range(size)]


def _touched_by_friction(heat: Heat, near: list[set[int]]) -> set[int]:
    where, found = spans(heat), set()
    bare = Heat(heat.bodies, heat.links)
    for place in (p for pair in heat.pairs for p in (pair.metal, pair.lining, pair.sensor, pair.beyond)):
        for store, i in _nodes(heat, where, place) if place else []:
            if store:
                found.add(i)
            else:  # heat into a junction goes on to its neighbours
                found |= _beside(bare, where, i)
    return found


def _around_shared_faces(heat: Heat) -> set[int]:
    """Nodes at a face where several links end, and at their other ends: the flows there depend on all of them."""
    where, found = spans(heat), set()
    shared = shared_faces(heat)
    for link in heat.links:
        if {link.a, link.b} & shared:
            for place in (link.a, link.b):
                for store, i in _nodes(heat, where, place):
                    found |= {i} if store else _beside(heat, where, i)
    return found


def _beside(heat: Heat, where: Spans, junction: int) -> set[int]:
    """Nodes with capacity that a junction reaches directly or through other junctions."""
    joined = _linked(heat, where)
    joined += [(y, x) for x, y in joined]
    reached, front = {junction}, [junction]
    found: set[int] = set()
    while front:
        here = (False, front.pop())
        for store, i in (y for x, y in joined if x == here):
            if store:
                found.add(i)
            elif i not in reached:
                reached.add(i)
                front.append(i)
    return found
