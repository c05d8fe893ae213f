"""A thermal network made ready for integration: temperatures, heat flows, and where
friction heat enters."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ..hybrid.arrays import Array, Vector, VectorK, numpy_of
from ..hybrid.struct import Struct, structural
from ..profiles import AbstractProfile
from ..thermal.heat import FrictionHeat, Heat, PowerShares, place_count
from ..thermal.network import (
    AbstractLink,
    Junction,
    Lump,
    Reservoir,
    Surface,
    Surroundings,
    Wall,
    dependence,
    nodes_at,
    opens,
    place_of,
)
from ._surfaces import Balances, End, Path, flows_of, gathered

#: pieces of the given functions of time
Pieces = tuple[PyTree, ...]


class Spans(NamedTuple):
    """Place of each body among the nodes with capacity, and among the junctions."""

    stores: dict[str, slice]
    junctions: dict[str, slice]


def spans(heat: Heat) -> Spans:
    ends = {True: 0, False: 0}
    where = Spans({}, {})
    for body in heat.bodies:
        if isinstance(body, Reservoir):
            continue
        store = not isinstance(body, Junction)
        here = slice(ends[store], ends[store] + body.count)
        ends[store] = here.stop
        (where.stores if store else where.junctions)[body.name] = here
    return where


def nodes_of(heat: Heat, where: Spans, place: str) -> slice:
    """Nodes of a place, among those with capacity or among the junctions."""
    name, face = place_of(place)
    here = where.stores[name] if name in where.stores else where.junctions[name]
    nodes = range(here.start, here.stop)[nodes_at(heat.by_name[name], face)]
    return slice(nodes.start, nodes.stop, nodes.step)


class Stream(NamedTuple):
    """Coolant at one instant, an entry for each node that a jacket wets.

    - `heat` (W) that it takes up, temperature of its `inlet` (K), heat capacity `rate`
      (W/K)
    """

    heat: Float[Array, " wetted"]
    inlet: Float[Array, " wetted"]
    rate: Float[Array, " wetted"]


class HeatFlows(NamedTuple):
    """Heat flows of the network at one instant (W): into each node, and over its
    border."""

    into: VectorK
    into_junctions: Float[Array, " j"]
    lost: Array  # to reservoirs
    supplied: Array  # by sources
    faces: dict[str, Array]  # into each wall's face that a link touches
    coolant: Stream | None = None  # of jackets, not among what is lost


class Deposit(NamedTuple):
    """Distribution of the friction heat for given heats of the linings, linear in
    them."""

    into: VectorK
    into_junctions: Float[Array, " j"]  # rise of the junctions' temperatures it causes
    to_metal: Array
    to_linings: Array
    lost: Array
    faces: dict[str, Array]
    beyond: Any = None  # part of the heat to metal that went behind the linings
    # to each wetted node's coolant at once, over junctions; `None` without jackets
    coolant: Any = None


class Conditions(NamedTuple):
    """Conditions of a network besides temperatures and time.

    - `speed` (m/s) of the track, `lining_speed` of the outer faces of the linings, 0
      where these stand still
    - `closed`: 1 while the band is closed, else 0
    - `pressures` (Pa) of the linings in each friction pair
    - `seated` (n,), of a staged brake: 1 of a lining that sits on the rim, 0 of one
      that has lifted off; `None`: all do
    """

    speed: Any = 0.0
    lining_speed: Any = 0.0
    closed: Any = 0.0
    pressures: tuple[Any, ...] = (0.0,)
    seated: Any = None


# --- the network ready for integration ----------------------------------------------

_NEWTON = 8  # iterations for junctions with radiation or free convection


class Thermal(Struct):
    """The network of a scene. Its state is the heat content of each node over its
    reference capacity,

        u = ∫ C(T) dT / C_r = (T − T_r) + ½ b_c (T − T_r)²,   C_r du/dt = Σ heat flows

    so that sums of heat are linear in the state, and their balance closes to rounding
    with any method.
    """

    heat: Heat
    capacity: VectorK
    per_capacity: VectorK  # 1/C_r (K/J)
    slope: VectorK | None
    reference: VectorK
    # of walls: thermal resistance of half a layer at the reference temperature (K/W),
    # relative change of conductivity per kelvin, and, where no wall has such a change,
    # conductance from one node to the next (W/K)
    half: VectorK | None
    bend: VectorK | None
    between: Float[Array, " interfaces"] | None
    # conductance of each link from node to node (W/K) where it cannot change
    through: tuple[Array | None, ...]
    # of each surface: constant part of the heat that it rejects per kelvin
    per_kelvin: tuple[Array | None, ...]
    shares: PowerShares | None = None  # of the friction power
    # linings on each, where several bands have one each
    rims: tuple[int, ...] = structural(default=())
    # whether linings of a staged brake can lift off the rim
    lifts: bool = structural(default=False)

    @property
    def spans(self) -> Spans:
        return spans(self.heat)

    def rise(self, heat: VectorK) -> VectorK:
        """Convert heat into each node (W, or J) to the change of its state (K/s, or
        K)."""
        return heat * self.per_capacity

    def temperatures(self, u: VectorK) -> VectorK:
        """Temperatures (K) of the nodes with capacity."""
        if self.slope is None:
            return self.reference + u
        root = numpy_of(u).sqrt(1 + 2 * self.slope * u)
        return self.reference + 2 * u / (1 + root)

    def contents(self, T: VectorK) -> VectorK:
        """The state at given temperatures."""
        d = T - self.reference
        return d if self.slope is None else d + 0.5 * self.slope * d**2

    def _given(
        self, t: Array, pieces: Pieces
    ) -> tuple[dict[str, Array], list[Array], dict[int, Array]]:
        """Temperatures of the reservoirs, powers of the sources and flows of the
        jackets at one instant."""
        piece_of_each = iter(pieces)

        def value(given: AbstractProfile | Array | float) -> Array:
            if isinstance(given, AbstractProfile):
                given = given.value(t, next(piece_of_each))
            return jnp.reshape(jnp.asarray(given), (1,))

        temperatures = {
            b.name: value(b.temperature)
            for b in self.heat.bodies
            if isinstance(b, Reservoir)
        }
        powers = [value(source.power) for source in self.heat.sources]
        streams = {i: value(each.flow)[0] for i, each in self.heat.jackets.items()}
        return temperatures, powers, streams

    def _reader(
        self, T: Array, T_J: Array, reservoirs: dict[str, Array]
    ) -> Callable[[str], Array]:
        """Function from a place to its temperatures (of a wall: in its outermost
        layer)."""
        where = self.spans

        def at(place: str) -> Array:
            name, _ = place_of(place)
            if name in reservoirs:
                return reservoirs[name]
            temperatures = T if name in where.stores else T_J
            return temperatures[nodes_of(self.heat, where, place)]

        return at

    def _halves(self, T: Array) -> Array | None:
        """Thermal resistance of half a layer at given temperatures (K/W)."""
        if self.half is None or self.bend is None:
            return self.half
        return self.half / (1 + self.bend * (T - self.reference))

    @property
    def _keeps_halves(self) -> bool:
        """Whether the resistances from layers to faces cannot change."""
        return self.bend is None and all(
            wall.surface_layer is None for wall in self.heat.walls
        )

    def _to_faces(self, T: Array, half: Any) -> Any:
        """Thermal resistance from the outermost layers of walls to their faces (K/W),
        surface layers included."""
        for body in self.heat.walls:
            if body.surface_layer is not None:
                for face in ("front", "back") if body.both else ("front",):
                    nodes = nodes_of(self.heat, self.spans, f"{body.name}.{face}")
                    half = half.at[nodes].add(
                        body.surface_layer.resistance(T[nodes]) / body.area
                    )
        return half

    def flows(
        self,
        T: Array,
        T_J: Array,
        t: Array,
        around: Conditions,
        pieces: Pieces = (),
        more: tuple[tuple[str, Array], ...] = (),
    ) -> HeatFlows:
        """Heat flows at given temperatures, friction apart; `more`: powers (W) that
        enter places with capacity."""
        reservoirs, powers, streams = self._given(t, pieces)
        given: dict[str, Array] = {}
        for source, power in zip(self.heat.sources, powers, strict=True):
            self._enter(given, source.a, power / place_count(self.heat, source.a))
        for place, power in more:
            self._enter(
                given, place, jnp.reshape(power / place_count(self.heat, place), (1,))
            )
        half = self._halves(T)
        at = self._reader(T, T_J, reservoirs)
        into, through = self._through(
            at, self._to_faces(T, half), around, given, streams
        )
        nodes = self._spread(into)
        if half is not None and any(
            isinstance(body, Wall) and body.layers > 1 for body in self.heat.bodies
        ):
            between = self.between
            if between is None:
                between = _between(self.heat, half)
            q = between * (T[:-1] - T[1:])
            nodes = nodes + (
                jax.lax.pad(q, 0.0, [(1, 0, 0)]) - jax.lax.pad(q, 0.0, [(0, 1, 0)])
            )
        lost = [jnp.sum(into[name]) for name in reservoirs if name in into]
        return HeatFlows(
            into=nodes,
            into_junctions=self._into_junctions(into),
            lost=total(lost),
            supplied=total([power[0] for power in powers]),
            faces={place: flow for place, flow in into.items() if place_of(place)[1]},
            coolant=self._stream(through, at, streams) if streams else None,
        )

    def _stream(
        self,
        through: dict[int, Array],
        at: Callable[[str], Array],
        streams: dict[int, Array],
    ) -> Stream:
        """The coolant of all jackets; `through`: flow from each link's `b` to its `a`
        (W)."""
        parts = []
        for i, jacket in self.heat.jackets.items():
            heat = -through[i]
            rate = jacket.rate(Surroundings(flow=streams[i]))
            parts.append(
                Stream(
                    heat,
                    *(jnp.broadcast_to(x, heat.shape) for x in (at(jacket.b), rate)),
                )
            )
        return jax.tree.map(lambda *each: jnp.concatenate(each), *parts)

    def _enter(
        self, into: dict[str, Array], place: str, flow: Array, leaves: bool = False
    ) -> None:
        """Adds a flow to those into a place, or takes it away: node by node, or all of
        it at the only node."""
        n = place_count(self.heat, place)
        if flow.shape != (n,):
            flow = self._gathered(flow, n)
        if place not in into:
            into[place] = -flow if leaves else flow
        else:
            into[place] = into[place] - flow if leaves else into[place] + flow

    def _gathered(self, flow: Array, n: int) -> Vector:
        """Flows from the linings into the `n` nodes of a place: into each rim those of
        its own linings."""
        if n == 1:
            return jnp.sum(flow, keepdims=True)
        if n == len(self.rims) and flow.shape == (sum(self.rims),):
            return jnp.stack(
                [jnp.sum(own) for own in jnp.split(flow, np.cumsum(self.rims)[:-1])]
            )
        return jnp.broadcast_to(flow, (n,))

    def _at_linings(self, T: Array, n: int) -> Vector:
        """Temperatures of a place at each of `n` linings: of rims, of its own one."""
        if T.shape == (len(self.rims),) and sum(self.rims) == n:
            return T[np.repeat(np.arange(len(self.rims)), self.rims)]
        return jnp.broadcast_to(T, (n,))

    def _spread(self, into: dict[str, Array]) -> VectorK:
        """Flows into places, at all nodes with capacity."""
        parts: list[Array] = []
        for name in self.spans.stores:
            body = self.heat.by_name[name]
            if not isinstance(body, Wall):
                parts.append(into.get(name, _nothing(body.count)))
                continue
            front = into.get(f"{name}.front")
            back = into.get(f"{name}.back")
            between = body.layers - 1
            if body.copies == 1 and between:
                edges = [
                    _nothing(1) if flow is None else flow for flow in (front, back)
                ]
                parts += [edges[0], _nothing(between - 1), edges[1]]
                continue
            faces = (
                []
                if front is None
                else [jax.lax.pad(front, 0.0, [(0, between, between)])]
            )
            faces += (
                []
                if back is None
                else [jax.lax.pad(back, 0.0, [(between, 0, between)])]
            )
            parts.append(total(faces) if faces else _nothing(body.count))
        return jnp.concatenate(parts)

    def _into_junctions(self, into: dict[str, Array]) -> Float[Array, " j"]:
        where = self.spans.junctions
        parts = [
            into.get(name, _nothing(here.stop - here.start))
            for name, here in where.items()
        ]
        return jnp.concatenate(parts) if parts else jnp.zeros(0)

    def _through(
        self,
        at: Callable[[str], Array],
        half: Array | None,
        around: Conditions,
        given: dict[str, Array],
        streams: dict[int, Array],
    ) -> tuple[dict[str, Array], dict[int, Array]]:
        """Flows into all places: those that are `given`, and those of the links; and
        from `b` to `a` of each link.

        A link that alone ends at a wall's face lies in series with half the first
        layer. Other faces are eliminated. Heat is conserved in any case: a flow that
        leaves one end enters the other.
        """
        surfaces = self.heat.surfaces
        rows = Balances()
        S: dict[int, Array] = {}
        for i, surface in enumerate(surfaces):
            if surface.nodes:
                S[i] = at(surface.nodes[0])
                continue
            rows.begin(i, surface.size, self.per_kelvin[i])
            for face in surface.faces:
                R: Any = _half_at(self.heat, face, half)
                n = place_count(self.heat, face)
                rows.enter(
                    i, 1 / R if self.per_kelvin[i] is None else None, at(face) / R, n
                )
                if face in given:
                    rows.enter(i, None, given[face], n)
        paths = self._paths(at, half, around, S, streams)
        flows, by_surface = flows_of(list(paths.values()), rows)
        into = dict(given)
        for i, flow in zip(paths, flows, strict=True):
            self._enter(into, self.heat.links[i].a, flow)
            if i not in streams:  # (what a coolant carries away is not lost)
                self._enter(into, self.heat.links[i].b, flow, leaves=True)
        for i, surface in enumerate(surfaces):
            self._divide(surface, (S | by_surface)[i], at, half, into)
        return into, dict(zip(paths, flows, strict=True))

    def _paths(
        self,
        at: Callable[[str], Array],
        half: Array | None,
        around: Conditions,
        S: dict[int, Array],
        streams: dict[int, Array],
    ) -> dict[int, Path]:
        """The links, except perfect contacts inside a surface; `S`: temperatures of
        surfaces that lumps set."""
        surfaces = self.heat.surfaces
        paths = {}
        surface_of = {face: i for i, each in enumerate(surfaces) for face in each.faces}

        def end(place: str) -> End:
            i = surface_of.get(place)
            return End(S[i], None) if i in S else End(at(place), i)

        for i, (link, g) in enumerate(zip(self.heat.links, self.through, strict=True)):
            places = {link.a, link.b}
            if dependence(link, self.heat.bodies).perfect and any(
                places <= {*each.faces, *each.nodes} for each in surfaces
            ):
                continue
            halves = [
                _half_at(self.heat, place, half)
                for place in (link.a, link.b)
                if place not in surface_of
            ]
            conditions = self._around(link, around, streams.get(i, 0.0))
            paths[i] = self._path(link, g, end(link.a), end(link.b), halves, conditions)
        return paths

    def _path(
        self,
        link: AbstractLink,
        g: Array | None,
        a: End,
        b: End,
        halves: list[Array | None],
        around: Surroundings,
    ) -> Path:
        """The path of a link; `g`: its conductance where that cannot change (W/K), but
        for a contact that opens."""
        can_open = _can_open(self.heat, link, self.lifts)

        def law(T_a: Array, T_b: Array) -> Array:
            closed = _in_series(link.conductance(T_a, T_b, around), halves)
            return closed * around.closed if can_open else closed

        constant = g is not None and self._keeps_halves and not can_open
        if g is None and not dependence(link, self.heat.bodies).temperatures:
            g = law(a.T, b.T)
        elif g is not None and can_open:
            g = g * around.closed
        flows = max(place_count(self.heat, place) for place in (link.a, link.b))
        return Path(a, b, flows, g, law, constant)

    def _around(
        self, link: AbstractLink, around: Conditions, flow: Array | float
    ) -> Surroundings:
        """Conditions at the surfaces of one link; `flow` of its coolant."""
        single = place_count(self.heat, link.a) == 1
        kind = self.heat.kinds.get(place_of(link.a)[0])
        speed = around.speed
        if kind == "band":
            speed = 0.0
        elif kind == "linings":
            speed = around.lining_speed
            if single and jnp.ndim(speed):
                speed = jnp.mean(speed)
        if not self.heat.stays_covered(link):
            return Surroundings(speed, around.closed, around.pressures[0], flow)
        closed = 1.0
        if around.seated is not None:
            each = not single or place_count(self.heat, link.b) > 1
            closed = around.seated if each else jnp.mean(around.seated)
        return Surroundings(speed, closed, around.pressures[-1], flow)

    def _divide(
        self,
        surface: Surface,
        S: Array,
        at: Callable[[str], Array],
        half: Array | None,
        into: dict[str, Array],
    ) -> None:
        """Distributes the flows into faces in perfect contact: the rest goes to the lump
        that sets their temperature, or to the last face."""
        counts = {face: place_count(self.heat, face) for face in surface.faces}
        rest = (
            surface.nodes[0]
            if surface.nodes
            else max(face for face, n in counts.items() if n == surface.size)
        )
        if len(surface.faces) == 1 and rest in counts:
            return
        left = [
            gathered(into.pop(face), surface.size, n)
            for face, n in counts.items()
            if face in into
        ]
        for face, n in counts.items():
            if face != rest:
                R: Any = _half_at(self.heat, face, half)
                into[face] = (S - at(face)) / R
                left.append(-gathered(into[face], surface.size, n))
        self._enter(into, rest, total(left))

    def junctions(
        self, T: Array, t: Array, around: Conditions, pieces: Pieces = ()
    ) -> Float[Array, " j"]:
        """Temperatures of the nodes without capacity, friction apart: no heat stays in
        them."""
        where = self.spans.junctions
        n = max((here.stop for here in where.values()), default=0)
        if n == 0:
            return jnp.zeros(0)
        start = jnp.full(n, jnp.mean(T))

        def excess(T_J: Array) -> Array:
            return self.flows(T, T_J, t, around, pieces).into_junctions

        def improve(T_J: Array, _: None) -> tuple[Array, None]:
            return T_J - self._response(excess, T_J)(excess(T_J)), None

        touching = [
            k
            for k in self.heat.links
            if {place_of(k.a)[0], place_of(k.b)[0]} & set(where)
        ]
        if not any(
            dependence(link, self.heat.bodies).temperatures for link in touching
        ):
            return improve(start, None)[0]
        return jax.lax.scan(improve, start, None, length=_NEWTON)[0]

    def _response(
        self, excess: Callable[[Array], Array], T_J: Array
    ) -> Callable[[Array], Array]:
        """The inverse of the derivative of the junctions' excess heat with respect to
        their temperatures."""
        where = self.spans.junctions
        together = any(
            {place_of(k.a)[0], place_of(k.b)[0]} <= set(where) for k in self.heat.links
        )
        if not together:  # each junction separately
            slope = jax.jvp(excess, (T_J,), (jnp.ones_like(T_J),))[1]
            return lambda q: q / slope
        K = jax.jacfwd(excess)(T_J)
        return lambda q: jnp.linalg.solve(K, q)

    def at(self, T: Array, place: str, n: int) -> Vector:
        """Temperature of a place with capacity (of a wall: its outermost layer) at each
        of `n` linings."""
        return self._at_linings(T[nodes_of(self.heat, self.spans, place)], n)

    def needs_each_lining(self, pair: FrictionHeat | None) -> bool:
        """Whether the heat of each lining of a pair matters, or only their sum."""
        if pair is None:
            return False
        flow = jax.ShapeDtypeStruct((1,), np.float64)
        share = jax.eval_shape(pair.partition.share, flow, flow)
        places = (pair.metal, pair.lining, pair.beyond, pair.sensor)
        return share.size > 1 or any(
            place_count(self.heat, place) > 1 for place in places if place is not None
        )

    def deposit(
        self,
        pair: FrictionHeat | None,
        P: Vector,
        T: Array,
        T_J: Array,
        t: Array,
        around: Conditions,
        pieces: Pieces = (),
    ) -> Deposit:
        """Distribution of the friction powers `P` of the linings in a pair, as far as
        they are heat (W, or J); linear in `P`.

        Where `needs_each_lining` is false their sum is sufficient, (1,).
        """
        n = P.shape[0]
        P = P if self.shares is None else self.shares.heat * P
        zero = jnp.zeros(())
        if pair is None:
            return Deposit(
                into=jnp.zeros_like(T),
                into_junctions=jnp.zeros_like(T_J),
                to_metal=zero,
                to_linings=zero,
                lost=jnp.sum(P),
                faces={},
                coolant=self._none_to_coolant,
            )
        at = self._reader(T, T_J, {})  # heat enters no reservoir

        def temperature(place: str | None, other: str | None) -> Array:
            return self._at_linings(at(place or other or pair.sensor or ""), n)

        T_metal = temperature(pair.metal, pair.lining)
        T_lining = temperature(pair.lining, pair.metal)
        to_metal = jnp.broadcast_to(pair.partition.share(T_metal, T_lining) * P, (n,))
        behind = None if pair.beyond_share is None else pair.beyond_share * P
        to_lining = P - to_metal if behind is None else P - to_metal - behind
        into: dict[str, Array] = {}
        lost: list[Array] = []
        for place, part in (
            (pair.metal, to_metal),
            (pair.lining, to_lining),
            (pair.beyond, behind),
        ):
            if part is not None and place is not None:
                self._enter(into, place, part)
            elif part is not None:
                lost.append(jnp.sum(part))
        nodes = self._spread(into)
        rise = jnp.zeros_like(T_J)
        away = total(lost)
        coolant = self._none_to_coolant
        faces = {place: flow for place, flow in into.items() if place_of(place)[1]}
        if set(into) & set(self.spans.junctions):

            def flowing(T_J: Array) -> HeatFlows:
                return self.flows(T, T_J, t, around, pieces)

            heated = self._into_junctions(into)
            rise = -self._response(lambda T_J: flowing(T_J).into_junctions, T_J)(heated)
            change = jax.jvp(flowing, (T_J,), (rise,))[1]
            nodes = nodes + change.into
            away = away + change.lost
            faces |= {
                place: faces.get(place, 0.0) + change.faces[place]
                for place in change.faces
            }
            coolant = None if change.coolant is None else change.coolant.heat
        return Deposit(
            into=nodes,
            into_junctions=rise,
            to_metal=jnp.sum(to_metal),
            to_linings=jnp.sum(to_lining),
            lost=away,
            faces=faces,
            beyond=None if behind is None else jnp.sum(behind),
            coolant=coolant,
        )

    @property
    def _none_to_coolant(self) -> Float[Array, " wetted"] | None:
        """No heat into the coolant at each wetted node."""
        wetted = [place_count(self.heat, each.a) for each in self.heat.jackets.values()]
        return jnp.zeros(sum(wetted)) if wetted else None

    def rise_at_once(self, into: VectorK) -> VectorK:
        """Temperature rise (K) by heat (J) released instantaneously: in walls it goes
        through their depth."""
        parts = []
        for name, here in self.spans.stores.items():
            part = into[here]
            body = self.heat.by_name[name]
            if isinstance(body, Wall):
                depth = (
                    (body.layers,) if body.copies == 1 else (body.copies, body.layers)
                )
                C = jnp.sum(self.capacity[here].reshape(depth), axis=-1, keepdims=True)
                part = jnp.broadcast_to(
                    jnp.sum(part.reshape(depth), axis=-1, keepdims=True) / C, depth
                )
            else:
                part = part * self.per_capacity[here]
            parts.append(part.reshape(-1))
        return jnp.concatenate(parts)

    def surface(
        self, place: str, T: Array, T_J: Array, faces: dict[str, Array]
    ) -> Array:
        """Temperature of a place: of a wall's face, from its outermost layer and the
        heat that enters there."""
        here = self._reader(T, T_J, {})(place)
        half = _half_at(self.heat, place, self._to_faces(T, self._halves(T)))
        return here if half is None else here + half * faces.get(place, 0.0)


def _can_open(heat: Heat, link: AbstractLink, lifts: bool) -> bool:
    """Whether the contact of a link can open in a run; `lifts`: linings of a staged
    brake can lift off the rim."""
    return opens(link) and (lifts or not heat.stays_covered(link))


@functools.cache
def _nothing(n: int) -> Float[np.ndarray, " n"]:
    """No flow into `n` nodes: one constant of the program for all of them."""
    return np.zeros(n)


def _half_at(heat: Heat, place: str, half: Array | None) -> Array | None:
    """Resistance between a wall's face and the middle of its first layer."""
    if half is None or place_of(place)[1] is None:
        return None
    return half[nodes_of(heat, spans(heat), place)]


def total(parts: Sequence[PyTree]) -> PyTree:
    return sum(parts[1:], start=parts[0]) if parts else jnp.zeros(())


def _between(heat: Heat, half: Array) -> Float[Array, " interfaces"]:
    """Conductances from node to node (W/K) for the resistances of half a layer; 0 where
    no wall's layers touch."""
    touching = np.zeros(half.shape[0] - 1)
    for name, here in spans(heat).stores.items():
        body = heat.by_name[name]
        if isinstance(body, Wall):
            touching[here.start : here.stop - 1] = (
                np.arange(1, body.count) % body.layers != 0
            )
    return touching / (half[:-1] + half[1:])


def _in_series(g: Array | None, halves: list[Array | None]) -> Array:
    """Conductance of a link (`None`: perfect contact) with the resistances of half a
    layer at its ends."""
    behind = [half for half in halves if half is not None]
    if not behind:
        assert g is not None
        return g
    R = total(behind)
    return 1 / R if g is None else g / (1 + g * R)


def _each(per_metre: Array, wall: Wall) -> Array:
    """A property per metre of depth at every node of a wall and its copies."""
    return (
        jnp.broadcast_to(per_metre, (wall.copies,))[:, None] * wall.steps[None, :]
    ).reshape(-1)


def _numbers(body: Lump | Wall, left: Array | float) -> tuple[Any, ...]:
    """Capacity, its slope, reference and start temperature, resistance of half a layer,
    slope of conductivity."""
    if isinstance(body, Lump):
        slope = body.capacity_slope
        return body.capacity, slope, body.reference, body.temperature, None, None
    m = body.material
    area = jnp.asarray(body.area)
    capacity = _each(m.volumetric_heat_capacity * area * left, body)
    half = _each(left / (2 * area * m.conductivity), body)
    slope = m.specific_heat_slope
    return capacity, slope, m.reference, body.temperature, half, m.conductivity_slope


def _joined(
    values: Sequence[Array | float | None], counts: list[int], absent: float = 0.0
) -> PyTree:
    """Numbers of all bodies, node by node; `None` where no body has any."""
    if all(value is None for value in values):
        return None
    parts = zip(values, counts, strict=True)
    return jnp.concatenate(
        [
            jnp.broadcast_to(absent if x is None else jnp.asarray(x), (n,))
            for x, n in parts
        ]
    )


def _fixed(heat: Heat, link: AbstractLink, half: Array | None) -> Array | None:
    """Conductance of a link between two nodes, if it cannot change during a run."""
    joined = {face for surface in heat.surfaces for face in surface.faces}
    apart = [place for place in (link.a, link.b) if place not in joined]
    walls = [
        body
        for place in apart
        if isinstance(body := heat.by_name[place_of(place)[0]], Wall)
    ]
    bends = any(
        w.material.conductivity_slope is not None or w.surface_layer is not None
        for w in walls
    )
    depends = dependence(link, heat.bodies)
    if bends or depends.temperatures or depends.surroundings:
        return None
    alone = [_half_at(heat, place, half) for place in apart]
    T_a, T_b = (jnp.zeros(place_count(heat, place)) for place in (link.a, link.b))
    g = link.conductance(T_a, T_b, Surroundings())
    if g is None and not any(R is not None for R in alone):
        return None
    return _in_series(g, alone)


def _per_kelvin(
    heat: Heat, half: Array, through: tuple[Array | None, ...], lifts: bool
) -> tuple[Array | None, ...]:
    """Heat that each surface gives to its half layers and through links of a constant
    conductance, per kelvin."""
    conductances: list[Array | None] = []
    free = {
        face for surface in heat.surfaces for face in surface.faces if not surface.nodes
    }
    for surface in heat.surfaces:
        if surface.nodes:
            conductances.append(None)
            continue
        parts = [
            (1 / half[nodes_of(heat, spans(heat), face)], face)
            for face in surface.faces
        ]
        for link, g in zip(heat.links, through, strict=True):
            here, there = (
                (link.a, link.b) if link.a in surface.faces else (link.b, link.a)
            )
            if (
                g is not None
                and here in surface.faces
                and there not in free
                and not _can_open(heat, link, lifts)
            ):
                parts.append(
                    (g, max((here, there), key=lambda place: place_count(heat, place)))
                )
        conductances.append(
            total(
                [
                    gathered(g, surface.size, place_count(heat, place))
                    for g, place in parts
                ]
            )
        )
    return tuple(conductances)


def assemble_thermal(
    heat: Heat,
    left: dict[str, Array] | None = None,
    shares: PowerShares | None = None,
    rims: tuple[int, ...] = (),
    lifts: bool = False,
) -> tuple[Thermal, VectorK]:
    """The network and its initial state.

    - `left`: share of its thickness that each copy of a worn wall still has
    - `rims`: number of linings on each
    - `lifts`: whether linings can lift off the rim
    """
    stores = [body for body in heat.bodies if isinstance(body, Lump | Wall)]
    counts = [body.count for body in stores]
    each = [_numbers(body, (left or {}).get(body.name, 1.0)) for body in stores]
    *columns, halves, bends = zip(*each, strict=True)
    C, slope, reference, start = (_joined(column, counts) for column in columns)
    half = _joined(halves, counts, absent=1.0)
    bend = _joined(bends, counts)
    between = None if half is None or bend is not None else _between(heat, half)
    through = tuple(_fixed(heat, link, half) for link in heat.links)
    layered = any(wall.surface_layer is not None for wall in heat.walls)
    per_kelvin: tuple[Array | None, ...] = (None,) * len(heat.surfaces)
    if half is not None and bend is None and not layered:
        per_kelvin = _per_kelvin(heat, half, through, lifts)
    thermal = Thermal(
        heat,
        C,
        1 / C,
        slope,
        reference,
        half,
        bend,
        between,
        through,
        per_kelvin,
        shares,
        rims,
        lifts,
    )
    return thermal, thermal.contents(start)
