"""Sparsity of the Jacobian of a brake with heat: chains of nodes joined by a small
core."""

import itertools
from collections.abc import Callable

import jax
import numpy as np
from jaxtyping import Bool, Int, PyTree

from ..friction import memory_at_start
from ..hybrid import CORE, LINEAR
from ..thermal.heat import Heat
from ..thermal.network import place_of
from ._thermal import nodes_of, spans
from .mechanism import AbstractMechanism, Pair

#: a node of the network: whether it has capacity, and its number among those that have,
#: or have not
Node = tuple[bool, int]


def couplings(heat: Heat, heated: tuple[str, ...] = ()) -> Int[np.ndarray, " k"]:
    """Sparsity of the Jacobian of the network: core, and places in chains, per node
    with capacity.

    - `heated`: places that heat enters beside that of the network's own friction and
      sources

    Bodies that friction heats or senses are in the core, as every lining's friction
    depends on those before it, and so are those around a face that several links share.
    Of the rest, nodes where three or more paths meet join the core until only
    unbranched chains are left. Layers inside a wall of constant properties are marked
    as linear.
    """
    joined = _joined(heat)
    near = {i: _reached(joined, (store, i)) for store, i in joined if store}
    kinds = np.full(len(near), CORE)
    core = _core(heat, joined)
    open_ = {i: near[i] - core for i in near if i not in core}
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
    return np.where(
        (kinds >= 0) & _inside_plain_walls(heat, len(near), heated),
        kinds + LINEAR,
        kinds,
    )


def _inside_plain_walls(
    heat: Heat, size: int, heated: tuple[str, ...]
) -> Bool[np.ndarray, " k"]:
    """Nodes with capacity that are layers within a wall of constant properties, reached
    by conduction alone."""
    inside = np.zeros(size, bool)
    for body in heat.walls:
        m = body.material
        inside[spans(heat).stores[body.name]] = (
            m.conductivity_slope is None and m.specific_heat_slope is None
        )
    reached = [end for link in heat.links for end in (link.a, link.b)]
    reached += [*heated, *(source.a for source in heat.sources)]
    reached += [
        p for pair in heat.pairs for p in (pair.metal, pair.lining, pair.beyond) if p
    ]
    for store, i in (node for place in reached for node in _nodes(heat, place)):
        if store:
            inside[i] = False
    return inside


def _nodes(heat: Heat, place: str) -> list[Node]:
    """Nodes of a place; a reservoir has none."""
    where = spans(heat)
    (name, _) = place_of(place)
    if name not in where.stores and name not in where.junctions:
        return []
    nodes = nodes_of(heat, where, place)
    return [
        (name in where.stores, i) for i in range(nodes.start, nodes.stop, nodes.step)
    ]


def _joined(heat: Heat) -> dict[Node, set[Node]]:
    """The nodes to which each is joined, by links and inside of walls."""
    where = spans(heat)
    ends = []
    near: dict[Node, set[Node]] = {
        (store, i): set()
        for store, bodies in ((True, where.stores), (False, where.junctions))
        for here in bodies.values()
        for i in range(here.start, here.stop)
    }
    for body in heat.walls:
        first = where.stores[body.name].start
        ends += [
            ((True, first + i - 1), (True, first + i))
            for i in range(1, body.count)
            if i % body.layers
        ]
    for link in heat.links:
        a = _nodes(heat, link.a)
        b = _nodes(heat, link.b)
        ends += zip(a, b, strict=True) if len(a) == len(b) else itertools.product(a, b)
    for a, b in ends:
        if a != b:
            near[a].add(b)
            near[b].add(a)
    return near


def _reached(joined: dict[Node, set[Node]], node: Node) -> set[int]:
    """Other nodes with capacity that a node is joined to, directly or through
    junctions."""
    reached = set()
    seen = {node}
    front = [node]
    while front:
        for other in joined[front.pop()] - seen:
            seen.add(other)
            if other[0]:
                reached.add(other[1])
            else:
                front.append(other)
    return reached


def _core(heat: Heat, joined: dict[Node, set[Node]]) -> set[int]:
    """Nodes that friction heats or senses, and those on links to a face where several
    links end; of junctions, those beside them."""
    shared = {face for surface in heat.surfaces for face in surface.faces}
    places = [
        p
        for pair in heat.pairs
        for p in (pair.metal, pair.lining, pair.sensor, pair.beyond)
        if p
    ]
    places += [
        p for link in heat.links if {link.a, link.b} & shared for p in (link.a, link.b)
    ]
    nodes = [node for place in places for node in _nodes(heat, place)]
    return {
        i for node in nodes for i in ({node[1]} if node[0] else _reached(joined, node))
    }


# --- states of friction laws --------------------------------------------------------


def couplings_of_memory(
    mechanism: AbstractMechanism, others: Int[np.ndarray, " n"]
) -> Callable[[Pair], PyTree]:
    """Places of the states of a pair's law in the Jacobian, beside those of all
    `others`; called pair by pair.

    A state of a lining is in the chain, without neighbours, where its rate depends on
    the core alone (speeds, temperatures) and on itself; else it is one of the core, as
    all linings are coupled there. A chain of them alone is worthwhile only while its
    border is the smaller part.
    """
    places = itertools.count(
        1 + max((kind % LINEAR for kind in others if kind >= 0), default=-1)
    )
    core = others == CORE
    chained = bool(np.any(others >= 0))

    def of(pair: Pair) -> PyTree:
        states, tree = jax.tree.flatten(memory_at_start(pair.law, pair.count))
        if (
            len(states) > 1
            or _couples(mechanism, pair)
            or not (chained or np.sum(core) < pair.count)
        ):
            return tree.unflatten([np.full(state.shape, CORE) for state in states])
        return tree.unflatten([np.fromiter(itertools.islice(places, pair.count), int)])

    return of


def _couples(mechanism: AbstractMechanism, pair: Pair) -> bool:
    """Whether the rate of one lining's state depends on the states of others at the
    same instant."""
    rates = pair.memory
    assert rates is not None
    return (mechanism.couples_loads and (rates.p or rates.q)) or (
        mechanism.stretches and rates.slip
    )
