"""What a thermal network says of itself: where its nodes stand, what flows, and where friction heat goes."""

from typing import Any, NamedTuple

from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._heat import Heat
from .._parts._network import Body, Junction, Reservoir, nodes_at, place_of


class Spans(NamedTuple):
    """Where each body stands among the nodes with capacity, and among the junctions."""

    stores: dict[str, slice]
    junctions: dict[str, slice]


def spans(heat: Heat) -> Spans:
    ends, found = {True: 0, False: 0}, Spans({}, {})
    for body in heat.bodies:
        if isinstance(body, Reservoir):
            continue
        store = not isinstance(body, Junction)
        here = slice(ends[store], ends[store] + body.count)
        ends[store] = here.stop
        (found.stores if store else found.junctions)[body.name] = here
    return found


def body_of(heat: Heat, name: str) -> Body:
    return next(body for body in heat.bodies if body.name == name)


def nodes_of(heat: Heat, where: Spans, place: str) -> slice:
    """Which nodes a place has: of those with capacity, or of the junctions."""
    name, face = place_of(place)
    here = where.stores[name] if name in where.stores else where.junctions[name]
    nodes = range(here.start, here.stop)[nodes_at(body_of(heat, name), face)]
    return slice(nodes.start, nodes.stop, nodes.step)


class HeatFlows(NamedTuple):
    """Heat flows of the network at one instant (W): into each node, and over its border."""

    into: Float[Array, " k"]
    into_junctions: Float[Array, " j"]
    lost: Array  # to reservoirs
    supplied: Array  # by sources
    faces: dict[str, Array]  # into each wall's face that a link touches


class Deposit(NamedTuple):
    """Where friction heat goes, for given heats of the linings: linear in them."""

    into: Float[Array, " k"]
    into_junctions: Float[Array, " j"]  # rise of the junctions' temperatures it causes
    to_metal: Array
    to_linings: Array
    lost: Array
    faces: dict[str, Array]
    beyond: Any = None  # part of the heat to metal that went behind the linings


class End(NamedTuple):
    """Where a link ends: temperature (of a wall: of its outermost layer), resistance from there to the face."""

    place: str
    T: Array
    half: Array | None
    shared: bool  # with other links or a source
