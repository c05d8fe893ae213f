"""Parts of a thermal network: bodies that hold heat, and links through which it flows.

A **place** is named in a string: `"band"` is a body, `"rim.front"` and `"rim.back"` are the faces of a wall. Bodies
with `count` nodes (one per lining) link node by node with one another, and all of them with a body of one node.
"""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault
from .._base._quantity import Scalar, quantity, whole
from .._hybrid._arrays import Array
from ._duty import AbstractProfile
from ._links import AbstractCoefficient, AbstractLink, Source, ThermalContact, is_nonlinear, reads
from ._material import ROOM, Material


class Lump(eqx.Module):
    """A body of one temperature, or `count` of them (one per lining): `C(T) dT/dt = Σ heat flows`.

    - `capacity` `C` (J/K), a number or (count,), 0 makes a `Junction` of it; `capacity_slope` (1/K) as in `Material`
    - `temperature`: at the start (K)
    """

    name: str = eqx.field(static=True)
    capacity: Scalar = quantity("J/K", "heat capacity", positive=True, many=True)
    temperature: Scalar = quantity("K", "temperature at the start", low=0.0, many=True, default=ROOM)
    capacity_slope: Scalar | None = quantity("1/K", "relative change of capacity per kelvin", default=None)
    reference: Scalar = quantity("K", "temperature at which the capacity holds", positive=True, default=ROOM)
    count: int = whole("number of nodes", default=1)


class Junction(eqx.Module):
    """A node without capacity: its temperature follows from those of its neighbours at every instant."""

    name: str = eqx.field(static=True)
    count: int = whole("number of nodes", default=1)


class Reservoir(eqx.Module):
    """A prescribed temperature, as of the ambient air: a number (K) or a profile over time."""

    name: str = eqx.field(static=True)
    temperature: AbstractProfile | Any = quantity("K", "prescribed temperature", low=0.0, default=ROOM)
    count: ClassVar[int] = 1


class Wall(eqx.Module):
    """A wall in layers from its `front` to its `back`: finite volumes of second order.

        ρ c A Δx_i dT_i/dt = q_{i−1} − q_i,   q_i = A (T_i − T_{i+1}) / (Δx_i/2λ_i + Δx_{i+1}/2λ_{i+1})

    - `thickness` (m), `area` (m²), `layers` (their number);  `growth`: ratio of a layer to the one before it
      (`layer_growth` gives it for a wanted first layer);  `temperature`: at the start (K), a number or one per node
    - `copies`: so many equal walls side by side (one per lining), each of the `area`; nodes wall by wall
    - `both`: layers grow from both faces to the middle, for walls that are heated on either side

    Reference: S. V. Patankar, *Numerical Heat Transfer and Fluid Flow* (1980), eq. (4.9).
    """

    name: str = eqx.field(static=True)
    material: Material
    thickness: Scalar = quantity("m", "thickness of the wall", positive=True)
    area: Scalar = quantity("m^2", "area of the wall", positive=True)
    layers: int = whole("number of layers")
    growth: Scalar = quantity("1", "ratio of neighbouring layers", positive=True, default=1.0)
    temperature: Scalar = quantity("K", "temperature at the start", low=0.0, many=True, default=ROOM)
    copies: int = whole("number of equal walls", high=10_000, default=1)
    both: bool = eqx.field(static=True, default=False)

    @property
    def grades(self) -> Float[np.ndarray, " layers"]:
        """How often each layer has grown since the face it counts from."""
        i = np.arange(self.layers, dtype=np.float64)
        return np.minimum(i, i[::-1]) if self.both else i

    @property
    def count(self) -> int:
        return self.layers * self.copies

    @property
    def steps(self) -> Float[Array, " layers"]:
        """Thickness `Δx_i` of each layer (m)."""
        weights = jnp.asarray(self.growth) ** self.grades
        return self.thickness * weights / jnp.sum(weights)

    @property
    def centres(self) -> Float[Array, " layers"]:
        """Depth of the layers' centres below the front (m)."""
        ends = jnp.cumsum(self.steps)
        return ends - 0.5 * self.steps


Body = Lump | Junction | Reservoir | Wall


def nodes_at(body: Body, face: str | None) -> slice:
    """Which nodes of a body a place names: all of it, or the outermost layers of a wall."""
    if face is None or not isinstance(body, Wall):
        return slice(None)
    return slice(0 if face == "front" else body.layers - 1, None, body.layers)


def size_of(body: Body, face: str | None) -> int:
    """Number of nodes of a place."""
    return body.copies if face is not None and isinstance(body, Wall) else body.count


def depends_on_temperatures(link: AbstractLink, bodies: tuple[Body, ...]) -> bool:
    """Whether the conductance of a link between two of the `bodies` depends on their temperatures."""
    return is_nonlinear(link, *_sizes(link, bodies))


def is_constant(link: AbstractLink, bodies: tuple[Body, ...]) -> bool:
    """Whether the conductance of a link between two of the `bodies` depends on nothing that changes during a run."""
    return not any(reads(link, *_sizes(link, bodies)))


def _sizes(link: AbstractLink, bodies: tuple[Body, ...]) -> tuple[int, int]:
    by_name = {body.name: body for body in bodies}
    n_a, n_b = (size_of(by_name[name], face) for name, face in map(place_of, (link.a, link.b)))
    return n_a, n_b


def place_of(name: str) -> tuple[str, str | None]:
    """Body and face that a place names."""
    body, dot, face = name.partition(".")
    return body, face if dot else None


def faults_of_network(
    bodies: tuple[Body, ...],
    links: tuple[AbstractLink, ...],
    sources: tuple[Source, ...],
    path: str,
    heated: tuple[str, ...] = (),
) -> list[Fault]:
    """Everything wrong with a network: names, sizes, nodes without connection, loops without a solution."""
    found: list[Fault] = []
    by_name = {body.name: body for body in bodies}
    seen: set[str] = set()
    for i, body in enumerate(bodies):
        where = f"{path}.bodies[{i}]"
        if body.name in seen or not body.name or "." in body.name:
            found.append(
                Fault(where, f"the name {body.name!r} is taken or not usable", "names are unique, without dots")
            )
        seen.add(body.name)
        if body.count < 1:
            found.append(Fault(where, f"{body.count} nodes", "at least one is needed"))
        for field in ("capacity", "temperature"):
            value = getattr(body, field, None)
            if (
                value is not None
                and not isinstance(value, AbstractProfile)
                and np.shape(value) not in ((), (body.count,))
            ):
                found.append(Fault(f"{where}.{field}", f"shape {np.shape(value)} does not fit {body.count} nodes"))
    touched: set[str] = {place_of(place)[0] for place in heated}
    for kind, parts in (("links", links), ("sources", sources)):
        for i, part in enumerate(parts):
            ends = [place_of(getattr(part, side)) for side in ("a", "b") if hasattr(part, side)]
            here = f"{path}.{kind}[{i}]"
            known = True
            for name, face in ends:
                if name not in by_name:
                    known = False
                    found.append(Fault(here, f"there is no body {name!r}", f"there are: {', '.join(by_name)}"))
                elif isinstance(by_name[name], Wall) != (face in ("front", "back")):
                    known = False
                    found.append(
                        Fault(here, f"{name!r} has no face {face!r}", "walls: name.front, name.back; others: name")
                    )
            if kind == "sources":
                touched |= {name for name, _ in ends}
            if not known or kind == "sources":
                continue
            touched |= {name for name, _ in ends}
            counts = {size_of(by_name[n], f) for n, f in ends} - {1}
            if len(counts) > 1:
                found.append(Fault(here, f"{sorted(counts)} nodes do not pair", "equal numbers of nodes, or one"))
            perfect = isinstance(part, ThermalContact) and part.resistance is None
            if perfect and not any(isinstance(by_name[name], Wall) for name, _ in ends):
                found.append(
                    Fault(
                        f"{here}.resistance", "perfect contact of two lumps", "make them one lump, or give a resistance"
                    )
                )
    alone = [body.name for body in bodies if body.name not in touched and not isinstance(body, Reservoir)]
    if len(bodies) > 1:
        found += [
            Fault(f"{path}.bodies", f"{name!r} is connected to nothing", "link it, or leave it out") for name in alone
        ]
    return found + _floating_junctions(bodies, links, path)


def _floating_junctions(bodies: tuple[Body, ...], links: tuple[AbstractLink, ...], path: str) -> list[Fault]:
    """Junctions that no chain of conducting links joins to a body with a temperature of its own."""

    def conducts(link: AbstractLink) -> bool:
        for field in ("value", "emissivity", "coefficient"):
            value = getattr(link, field, None)
            if value is not None and not isinstance(value, AbstractCoefficient) and not np.any(np.asarray(value) > 0):
                return False
        return True

    grounded = {body.name for body in bodies if not isinstance(body, Junction)}
    while True:
        new = set(grounded)
        for link in links:
            (a, _), (b, _) = place_of(link.a), place_of(link.b)
            if conducts(link) and (a in grounded or b in grounded):
                new |= {a, b}
        if new == grounded:
            break
        grounded = new
    return [
        Fault(
            f"{path}.bodies",
            f"the junction {body.name!r} has no defined temperature",
            "link it to a body with capacity",
        )
        for body in bodies
        if body.name not in grounded
    ]
