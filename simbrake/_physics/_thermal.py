"""A thermal network made ready for integration: temperatures, heat flows, and where friction heat lands."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._duty import AbstractProfile
from .._parts._heat import FrictionHeat, Heat, shared_faces
from .._parts._links import Surroundings
from .._parts._network import Body, Lump, Reservoir, Wall, depends_on_temperatures, nodes_at, place_of, size_of
from .._parts._power_shares import PowerShares
from ._heat_flows import Deposit, HeatFlows, Landed, Spans, spans

_FACES = 4  # passes over links that share a wall's face
_NEWTON = 8  # iterations for junctions with radiation or free convection


class Thermal(eqx.Module):
    """The network of a scene. Its state is the heat content of each node over its reference capacity,

        u = ∫ C(T) dT / C_r = (T − T_r) + ½ b_c (T − T_r)²,   C_r du/dt = Σ heat flows

    so that sums of heat are linear in the state, and their balance closes to rounding with any method.
    """

    heat: Heat
    capacity: Float[Array, " k"]
    per_capacity: Float[Array, " k"]  # 1/C_r (K/J)
    slope: Float[Array, " k"] | None
    reference: Float[Array, " k"]
    halves: dict[str, Array]  # thermal resistance of half a layer at the reference temperature (K/W)
    between: dict[str, Array]  # conductance from layer to layer (W/K) of walls whose conductivity is constant
    shares: PowerShares | None = None  # of the friction power

    @property
    def spans(self) -> Spans:
        return spans(self.heat)

    def rise(self, heat: Float[Array, " k"]) -> Float[Array, " k"]:
        """What heat into each node (W, or J) adds to its state (K/s, or K)."""
        return heat * self.per_capacity

    def temperatures(self, u: Float[Array, " k"]) -> Float[Array, " k"]:
        """Temperatures (K) of the nodes with capacity."""
        if self.slope is None:
            return self.reference + u
        return self.reference + 2 * u / (1 + jnp.sqrt(1 + 2 * self.slope * u))

    def contents(self, T: Float[Array, " k"]) -> Float[Array, " k"]:
        """The state at given temperatures."""
        d = T - self.reference
        return d if self.slope is None else d + 0.5 * self.slope * d**2

    def _all(self, T: Array, T_J: Array, t: Array, pieces: tuple[Any, ...]) -> dict[str, Array]:
        where, left = self.spans, list(pieces)
        found = {name: T[here] for name, here in where.stores.items()}
        found |= {name: T_J[here] for name, here in where.junctions.items()}
        for body in self.heat.bodies:
            if isinstance(body, Reservoir):
                found[body.name] = jnp.reshape(_value(body.temperature, t, left), (1,))
        return found

    def _half(self, place: str, T: Array) -> Array | None:
        """Resistance between a wall's face and the middle of its first layer."""
        name, face = place_of(place)
        if face is None:
            return None
        return self._layer_halves(name, T)[nodes_at(self._body(name), face)]

    def _body(self, name: str) -> Body:
        return next(body for body in self.heat.bodies if body.name == name)

    def _layer_halves(self, name: str, T: Array) -> Array:
        wall = self._body(name)
        assert isinstance(wall, Wall)
        if wall.material.conductivity_slope is None:
            return self.halves[name]
        return self.halves[name] * (wall.material.conductivity / wall.material.conductivity_at(T))

    def flows(self, T: Array, T_J: Array, t: Array, around: Surroundings, pieces: tuple[Any, ...] = ()) -> HeatFlows:
        """Heat flows at given temperatures, friction apart."""
        temperature = self._all(T, T_J, t, pieces)
        into: dict[str, Array] = {name: jnp.zeros_like(value) for name, value in temperature.items()}
        faces: dict[str, Array] = {}
        for body in self.heat.bodies:
            if isinstance(body, Wall) and body.layers > 1:
                into[body.name] = self._within(body, temperature[body.name])
        supplied, left = jnp.zeros(()), list(pieces)[self._reservoir_profiles :]
        for source in self.heat.sources:
            power = jnp.reshape(_value(source.power, t, left), (1,))
            name, face = place_of(source.a)
            n = size_of(self._body(name), face)
            landed = self._landing(jnp.broadcast_to(power / n, (n,)), name, face)
            into[name] = into[name] + landed.nodes
            if face:
                faces[source.a] = faces.get(source.a, 0.0) + landed.place
            supplied = supplied + power[0]
        for link, flow in zip(self.heat.links, self._through(temperature, around, dict(faces)), strict=True):
            for place, signed in ((link.a, -flow), (link.b, flow)):
                name, face = place_of(place)
                landed = self._landing(signed, name, face)
                into[name] = into[name] + landed.nodes
                if face:
                    faces[place] = faces.get(place, 0.0) + landed.place
        lost = sum((jnp.sum(into[b.name]) for b in self.heat.bodies if isinstance(b, Reservoir)), start=jnp.zeros(()))
        where = self.spans
        return HeatFlows(
            into=_joined(into, where.stores),
            into_junctions=_joined(into, where.junctions),
            lost=lost,
            supplied=supplied,
            faces=faces,
        )

    def _within(self, wall: Wall, T: Array) -> Array:
        """Flows into the layers of a wall from their neighbours."""
        g = self.between.get(wall.name)
        q = (_between(self._layer_halves(wall.name, T), wall) if g is None else g) * (T[:-1] - T[1:])
        return jnp.pad(q, (1, 0)) - jnp.pad(q, (0, 1))

    @property
    def _reservoir_profiles(self) -> int:
        bodies = self.heat.bodies
        return sum(isinstance(b, Reservoir) and isinstance(b.temperature, AbstractProfile) for b in bodies)

    def _landing(self, flow: Array, name: str, face: str | None) -> "Landed":
        """Flows into a place, node by node, or all of them into its only node."""
        body = self._body(name)
        n = size_of(body, face)
        place = jnp.sum(flow)[None] if n == 1 else jnp.broadcast_to(flow, (n,))
        if face is None or not isinstance(body, Wall):
            return Landed(place, place)
        before = 0 if face == "front" else body.layers - 1
        spread = jnp.pad(place[:, None], ((0, 0), (before, body.layers - 1 - before)))
        return Landed(place, spread.reshape(-1))

    def _through(self, temperature: dict[str, Array], around: Surroundings, given: dict[str, Array]) -> list[Array]:
        """Flow of every link from `a` to `b`; `given`: flows of sources into faces of walls.

        A link that ends at a wall's face lies in series with half the first layer. What sources bring and other links
        take there, and the surface temperature that a law looks at, come from the pass before: each pass brings the
        error down by `g · half`, and heat is conserved in any case, as a flow that leaves one end enters the other.
        """
        ends = [[self._end(place, temperature) for place in (link.a, link.b)] for link in self.heat.links]
        shared = shared_faces(self.heat)
        refine = bool(shared) or any(
            any(half is not None for _, half in pair) and depends_on_temperatures(link, self.heat.bodies)
            for link, pair in zip(self.heat.links, ends, strict=True)
        )
        flows: list[Array] = [jnp.zeros(1)] * len(ends)
        leaving = {place: -flow for place, flow in given.items()}
        for _ in range(_FACES if refine else 1):
            new = []
            for link, pair, flow in zip(self.heat.links, ends, flows, strict=True):
                seen, surface = [], []
                for (T, half), place, sign in zip(pair, (link.a, link.b), (1.0, -1.0), strict=True):
                    total = leaving.get(place, jnp.zeros(1))
                    own = sign * flow
                    seen.append(T if half is None or place not in shared else T - half * (total - own))
                    surface.append(T if half is None else T - half * total)
                halves = [half for _, half in pair if half is not None]
                g = link.conductance(surface[0], surface[1], around)
                behind = sum(halves[1:], start=halves[0]) if halves else None
                if g is None:
                    assert behind is not None
                    g = 1 / behind
                elif behind is not None:
                    g = g / (1 + g * behind)
                new.append(g * (seen[0] - seen[1]))
            flows, leaving = new, {place: -flow for place, flow in given.items()}
            for link, flow in zip(self.heat.links, flows, strict=True):
                for place, sign in ((link.a, 1.0), (link.b, -1.0)):
                    name, face = place_of(place)
                    if face:
                        leaving[place] = leaving.get(place, 0.0) + self._landing(sign * flow, name, face).place
        return flows

    def _end(self, place: str, temperature: dict[str, Array]) -> tuple[Array, Array | None]:
        """Temperature where a link ends (of a wall: in its outermost layer), and the resistance from there."""
        name, face = place_of(place)
        return temperature[name][nodes_at(self._body(name), face)], self._half(place, temperature[name])

    def junctions(self, T: Array, t: Array, around: Surroundings, pieces: tuple[Any, ...] = ()) -> Float[Array, " j"]:
        """Temperatures of the nodes without capacity, friction apart: no heat stays in them."""
        where = self.spans.junctions
        n = max((here.stop for here in where.values()), default=0)
        if n == 0:
            return jnp.zeros(0)
        start = jnp.full(n, jnp.mean(T))

        def excess(T_J: Array) -> Array:
            return self.flows(T, T_J, t, around, pieces).into_junctions

        def improve(T_J: Array, _: Any) -> tuple[Array, None]:
            return T_J - self._response(excess, T_J)(excess(T_J)), None

        touching = [k for k in self.heat.links if {place_of(k.a)[0], place_of(k.b)[0]} & set(where)]
        if not any(depends_on_temperatures(link, self.heat.bodies) for link in touching):
            return improve(start, None)[0]
        return jax.lax.scan(improve, start, None, length=_NEWTON)[0]

    def _response(self, excess: Any, T_J: Array) -> Any:
        """The inverse of the derivative of the junctions' excess heat with respect to their temperatures."""
        where = self.spans.junctions
        together = any({place_of(k.a)[0], place_of(k.b)[0]} <= set(where) for k in self.heat.links)
        if not together:  # each junction by itself
            slope = jax.jvp(excess, (T_J,), (jnp.ones_like(T_J),))[1]
            return lambda q: q / slope
        K = jax.jacfwd(excess)(T_J)
        return lambda q: jnp.linalg.solve(K, q)

    def at(self, T: Array, place: str, n: int) -> Float[Array, " n"]:
        """Temperature of a place with capacity (of a wall: its outermost layer) at each of `n` linings."""
        name, face = place_of(place)
        here = T[self.spans.stores[name]]
        return jnp.broadcast_to(here[nodes_at(self._body(name), face)], (n,))

    def tells_apart(self, pair: FrictionHeat | None) -> bool:
        """Whether it matters which lining of a pair the friction heat comes from, or only how much it is."""
        places = () if pair is None else (pair.metal, pair.lining, pair.beyond, pair.sensor)
        return any(size_of(self._body(place_of(p)[0]), place_of(p)[1]) > 1 for p in places if p is not None)

    def deposit(
        self,
        pair: FrictionHeat | None,
        T: Array,
        T_J: Array,
        t: Array,
        around: Surroundings,
        P: Float[Array, " n"],
        pieces: tuple[Any, ...] = (),
    ) -> Deposit:
        """Where the friction powers `P` of the linings in a pair go, as far as they are heat (W, or J); linear in `P`.

        Where `tells_apart` is false their sum alone will do, (1,).
        """
        n, P = P.shape[0], P if self.shares is None else self.shares.heat * P
        zero, where = jnp.zeros(()), self.spans
        into, rise, faces = jnp.zeros_like(T), jnp.zeros_like(T_J), {}
        if pair is None:
            return Deposit(into, rise, zero, zero, jnp.sum(P), faces)
        known = self._all(T, T_J, t, pieces)

        def temperature(place: str | None, other: str | None) -> Array:
            name, face = place_of(place or other or pair.sensor or "")
            here = known[name]
            return jnp.broadcast_to(here[nodes_at(self._body(name), face)], (n,))

        share = jnp.broadcast_to(
            pair.partition.share(temperature(pair.metal, pair.lining), temperature(pair.lining, pair.metal)),
            (n,),
        )
        lost, heated = zero, jnp.zeros_like(T_J)
        parts: list[tuple[str | None, Array]] = [(pair.metal, share * P), (pair.lining, (1 - share) * P)]
        behind = None
        if pair.beyond is not None and pair.beyond_share is not None:
            behind = pair.beyond_share * P
            parts = [parts[0], (pair.lining, (1 - share) * P - behind), (pair.beyond, behind)]
        for place, part in parts:
            if place is None:
                lost = lost + jnp.sum(part)
                continue
            name, face = place_of(place)
            here = (where.stores if name in where.stores else where.junctions)[name]
            landed = self._landing(part, name, face)
            landing = landed.nodes
            if face:
                faces[place] = faces.get(place, 0.0) + landed.place
            if name in where.stores:
                into = into + jnp.pad(landing, (here.start, T.shape[0] - here.stop))
            else:
                heated = heated + jnp.pad(landing, (here.start, T_J.shape[0] - here.stop))
        if {place for place, _ in parts} & set(where.junctions):

            def flowing(T_J: Array) -> HeatFlows:
                return self.flows(T, T_J, t, around, pieces)

            rise = -self._response(lambda T_J: flowing(T_J).into_junctions, T_J)(heated)
            change = jax.jvp(flowing, (T_J,), (rise,))[1]
            into, lost = into + change.into, lost + change.lost
            faces |= {place: faces.get(place, 0.0) + change.faces[place] for place in change.faces}
        to_linings = jnp.sum(parts[1][1])
        beyond = None if behind is None else jnp.sum(behind)
        return Deposit(into, rise, jnp.sum(share * P), to_linings, lost, faces, beyond)

    def soaked(self, into: Float[Array, " k"]) -> Float[Array, " k"]:
        """The same heat, but through the whole depth of each wall: for heat that is set free in no time at all."""
        parts = []
        for name, here in self.spans.stores.items():
            part, body, C = into[here], self._body(name), self.capacity[here]
            if isinstance(body, Wall):
                part, C = part.reshape(body.copies, body.layers), C.reshape(body.copies, body.layers)
                part = jnp.sum(part, axis=1, keepdims=True) * C / jnp.sum(C, axis=1, keepdims=True)
            parts.append(part.reshape(-1))
        return jnp.concatenate(parts)

    def surface(self, place: str, T: Array, T_J: Array, faces: dict[str, Array]) -> Array:
        """Temperature of a place: of a wall's face, from its outermost layer and the heat that enters there."""
        name, face = place_of(place)
        where = self.spans
        if name in where.junctions:
            return T_J[where.junctions[name]]
        here = T[where.stores[name]]
        if face is None:
            return here
        half = self._half(place, here)
        edge = here[nodes_at(self._body(name), face)]
        assert half is not None
        return edge + half * faces.get(place, 0.0)


def _value(value: Any, t: Array, pieces: list[Any]) -> Array:
    if isinstance(value, AbstractProfile):
        return value.value(t, pieces.pop(0))
    return jnp.asarray(value)


def _between(half: Array, wall: Wall) -> Array:
    """Conductances from layer to layer (W/K) for the resistances of half a layer; 0 from one copy into the next."""
    g = 1 / (half[:-1] + half[1:])
    return g if wall.copies == 1 else jnp.where(np.arange(1, wall.count) % wall.layers == 0, 0.0, g)


def _each(per_metre: Array, wall: Wall) -> Array:
    """A property per metre of depth at every node of a wall and its copies."""
    return (jnp.broadcast_to(per_metre, (wall.copies,))[:, None] * wall.steps[None, :]).reshape(-1)


def _joined(into: Mapping[str, Array], where: dict[str, slice]) -> Array:
    return jnp.concatenate([into[name] for name in where]) if where else jnp.zeros(0)


def assemble_thermal(
    heat: Heat, left: dict[str, Array] | None = None, shares: PowerShares | None = None
) -> tuple[Thermal, Float[Array, " k"]]:
    """The network and its initial state; `left`: share of its thickness that each copy of a worn wall still has."""
    left = left or {}
    capacity, reference, slope, start, halves = [], [], [], [], {}
    for body in heat.bodies:
        if isinstance(body, Lump):
            capacity.append(jnp.broadcast_to(jnp.asarray(body.capacity), (body.count,)))
            slope.append(body.capacity_slope)
            reference.append(jnp.broadcast_to(jnp.asarray(body.reference), (body.count,)))
        elif isinstance(body, Wall):
            m = body.material
            area = jnp.asarray(body.area) if body.name not in left else jnp.asarray(body.area) * left[body.name]
            capacity.append(_each(m.density * m.specific_heat * area, body))
            slope.append(m.specific_heat_slope)
            reference.append(jnp.broadcast_to(jnp.asarray(m.reference), (body.count,)))
            across = 1 / (2 * jnp.asarray(body.area) * m.conductivity_at(jnp.asarray(m.reference)))
            halves[body.name] = _each(across if body.name not in left else across * left[body.name], body)
        else:
            continue
        start.append(jnp.broadcast_to(jnp.asarray(body.temperature), (body.count,)))
    slopes = None
    if any(value is not None for value in slope):
        parts = zip(slope, capacity, strict=True)
        slopes = jnp.concatenate([jnp.full(c.shape, 0.0 if b is None else b) for b, c in parts])
    between = {
        body.name: _between(halves[body.name], body)
        for body in heat.bodies
        if isinstance(body, Wall) and body.layers > 1 and body.material.conductivity_slope is None
    }
    C = jnp.concatenate(capacity)
    thermal = Thermal(heat, C, 1 / C, slopes, jnp.concatenate(reference), halves, between, shares)
    return thermal, thermal.contents(jnp.concatenate(start))
