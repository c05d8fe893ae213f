"""Parts of a thermal network: bodies that hold heat, and links through which it
flows."""

import abc
import collections
from typing import Any, ClassVar, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._compiling import read_by
from .._base._faults import Fault, Faults, Issues
from .._base._part import Part, part, positive_quantity, quantity, structural, whole
from .._base._quantity import IndexedBy, Scalar
from .._base._store import cached_by_structure
from ..hybrid.arrays import Array, Floats, ScalarArray
from ..hybrid.struct import AbstractVar
from ..profiles import AbstractProfile, faults_of_sign
from .materials import ROOM, Material, SurfaceLayer

#: of the nodes of a place (K), or values at each
Temperatures: TypeAlias = Floats
STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m²·K⁴), CODATA 2018


class Surroundings(NamedTuple):
    """Inputs of a link besides temperatures.

    - `speed` (m/s) of the surface: of the rim and all that turns with it `ω R`, of the
      linings of a bandage `ω_b R_b`, 0 of linings and band that stand still
    - `closed`: 1 while linings cover the surface, or the contact is closed, else 0; or
      of each lining, (n,)
    - `pressure` (Pa) of each lining, (n,), or one for all
    - `flow` (m³/s) of the coolant in a jacket, where it is a profile over time

    Example:
        >>> around = sb.thermal.Surroundings(speed=10.0, closed=1.0)
        >>> link = sb.thermal.Convection("rim", 1.6, 25.0, covered=0.6)
        >>> round(float(link.conductance(400.0, 293.0, around)), 4)
        16.0
    """

    speed: Any = 0.0
    closed: Any = 0.0
    pressure: Any = 0.0
    flow: Any = 0.0


class AbstractLink(Part):
    """A heat path between the places `a` and `b`: `flow = g(T_a, T_b) (T_a − T_b)`.

    Of a link with a static field `opens` that is true, nothing flows while its contact
    is open.
    """

    a: AbstractVar[str]
    b: AbstractVar[str]

    @abc.abstractmethod
    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        """`g` in W/K; `None` for perfect contact."""


class Reads(NamedTuple):
    """Dependence of the conductance of a link on variables of the run."""

    temperatures: bool
    surroundings: bool
    perfect: bool  # contact without resistance


@cached_by_structure
def reads(link: AbstractLink, n_a: int, n_b: int) -> Reads:
    """Dependence of `g` of a link between places of `n_a` and `n_b` nodes.

    Found from the lowered program, once for each structure of a link; in doubt it
    depends on them (`read_by`).
    """
    scalar = jax.ShapeDtypeStruct((), np.float64)
    ends = [jax.ShapeDtypeStruct((n,), np.float64) for n in (n_a, n_b)]

    def conductance(
        link: AbstractLink, T_a: Array, T_b: Array, around: Surroundings
    ) -> Temperatures | None:
        return link.conductance(T_a, T_b, around)

    arguments = link, *ends, Surroundings(scalar, scalar, scalar, scalar)
    if jax.eval_shape(conductance, *arguments) is None:
        return Reads(temperatures=False, surroundings=False, perfect=True)
    _, *temperatures, around = read_by(conductance, *arguments)
    return Reads(any(temperatures), any(around), perfect=False)


class Conductance(AbstractLink):
    """A given conductance (W/K): a bolt, a spoke, a flange, or the reciprocal of one of
    V's resistances.

    - `opens`: as in `ThermalContact`

    Example:
        >>> sb.thermal.Conductance("rim", "air", 20.0)
        Conductance(a='rim', b='air', value=20 W/K)
    """

    a: str = structural()
    b: str = structural()
    value: Scalar = quantity("W/K", "thermal conductance", low=0.0)
    opens: bool = structural(default=False)

    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        return jnp.asarray(self.value)


class AbstractCoefficient(Part):
    """A heat transfer coefficient `h(v, T, T_a)` in W/(m²·K)."""

    @abc.abstractmethod
    def value(self, v: ScalarArray, T: Temperatures, T_a: Temperatures) -> Temperatures:
        """At the speed `v` of the surface (m/s), surface and air temperature (K)."""


class SpeedCoefficient(AbstractCoefficient):
    """Convection that grows with the speed: `h = h_0 [1 + (v/v_0)²]^{m/2}`, `h_0` at
    rest, `∝ v^m` when fast.

    - `at_rest` `h_0`; `speed` `v_0` (m/s) where forced convection takes over;
      `exponent` `m` (0.8 for turbulent flow)

    Blends the two regimes as S. W. Churchill & R. Usagi, *AIChE J.* 18 (1972) 1121 do,
    and is smooth at rest.

    Example:
        >>> sb.thermal.SpeedCoefficient(8.0, "2 m/s")
        SpeedCoefficient(at_rest=8 W/(m²·K), speed=2 m/s, exponent=0.8)
    """

    at_rest: Scalar = positive_quantity(
        "W/(m^2*K)", "heat transfer coefficient at rest"
    )
    speed: Scalar = positive_quantity(
        "m/s", "speed at which forced convection takes over"
    )
    exponent: Scalar = quantity("1", "exponent of the speed", 0.0, 2.0, default=0.8)

    def value(self, v: ScalarArray, T: Temperatures, T_a: Temperatures) -> Temperatures:
        return self.at_rest * (1 + (v / self.speed) ** 2) ** (0.5 * self.exponent)


class LinearCoefficient(AbstractCoefficient):
    """Convection linear in the speed: `h = h_0 + b |v|`, as it is fitted to records.

    - `at_rest` `h_0`; `slope` `b` (W/(m²·K) per m/s)

    Example:
        >>> law = sb.thermal.LinearCoefficient(10.0, 2.0)
        >>> float(law.value(30.0, 373.0, 293.0))
        70.0
    """

    at_rest: Scalar = quantity(
        "W/(m^2*K)", "heat transfer coefficient at rest", low=0.0
    )
    slope: Scalar = quantity(
        "J/(m^3*K)", "rise of the coefficient with the speed", low=0.0
    )

    def value(self, v: ScalarArray, T: Temperatures, T_a: Temperatures) -> Temperatures:
        return self.at_rest + self.slope * jnp.abs(v)


class TemperatureCoefficient(AbstractCoefficient):
    """Free convection: `h = h_1 |T − T_a|^n`, `n` = 1/4 laminar, 1/3 turbulent, smooth
    below a difference of 1 K.

    - `at_one_kelvin` `h_1`

    Reference: W. H. McAdams, *Heat Transmission* (1954), ch. 7.

    Example:
        >>> law = sb.thermal.TemperatureCoefficient(1.5)
        >>> round(float(law.value(0.0, 373.0, 293.0)), 4)
        4.4861
    """

    at_one_kelvin: Scalar = positive_quantity(
        "W/(m^2*K)", "coefficient at a difference of 1 K"
    )
    exponent: Scalar = quantity(
        "1", "exponent of the difference", 0.0, 1.0, default=0.25
    )

    def value(self, v: ScalarArray, T: Temperatures, T_a: Temperatures) -> Temperatures:
        return self.at_one_kelvin * ((T - T_a) ** 2 + 1.0) ** (0.5 * self.exponent)


def _uncovered(
    g: Temperatures, covered: Scalar | None, around: Surroundings
) -> Temperatures:
    """Factor of a conductance while linings cover a share of the area (`None`: 1)."""
    return g if covered is None else g * (1 - covered * around.closed)


class Convection(AbstractLink):
    """Convection from a surface: `g = h A (1 − κ)`, `κ` only while linings cover it.

    - `area` (m²); `coefficient` `h` (W/(m²·K)): a number or a law
    - `covered` `κ`: share of the area that the linings cover (the overlap coefficient
      of a track, averaged over one revolution: `q_net = κ a q − (1 − κ) h (T_s − T_a)`,
      S-16…S-21) while the band is closed, on the rim of a staged brake always; `None`:
      0, and no cost

    Example:
        >>> sb.thermal.Convection("rim", 1.6, 25.0)
        Convection(a='rim', area=1.6 m², coefficient=25 W/(m²·K))
    """

    a: str = structural()
    area: Scalar = positive_quantity("m^2", "area of the surface")
    coefficient: AbstractCoefficient | Any = quantity(
        "W/(m^2*K)", "heat transfer coefficient", low=0.0, typical=10.0
    )
    b: str = structural(default="air")
    covered: Scalar | None = quantity(
        "1",
        "share covered by linings while they touch the surface",
        0.0,
        1.0,
        default=None,
    )

    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        h = self.coefficient
        if isinstance(h, AbstractCoefficient):
            h = h.value(jnp.asarray(around.speed), T_a, T_b)
        return _uncovered(h * jnp.asarray(self.area), self.covered, around)


class Radiation(AbstractLink):
    """Radiation from a grey surface: flow `ε σ A (T⁴ − T_a⁴)` (S-37, S-38).

    - `area` (m²), `emissivity` `ε`; `covered` as in `Convection`

    Example:
        >>> sb.thermal.Radiation("rim", 1.6, emissivity=0.8)
        Radiation(a='rim', area=1.6 m², emissivity=0.8)
    """

    a: str = structural()
    area: Scalar = positive_quantity("m^2", "area of the surface")
    emissivity: Scalar = quantity("1", "emissivity", 0.0, 1.0)
    b: str = structural(default="air")
    covered: Scalar | None = quantity(
        "1",
        "share covered by linings while they touch the surface",
        0.0,
        1.0,
        default=None,
    )

    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        h = self.emissivity * STEFAN_BOLTZMANN * (T_a**2 + T_b**2) * (T_a + T_b)
        return _uncovered(h * self.area, self.covered, around)


class AbstractContactLaw(Part):
    """A contact conductance `h_c(p)` in W/(m²·K)."""

    @abc.abstractmethod
    def conductance(self, p: Floats) -> Floats:
        """At the pressure `p` (Pa)."""


class MetalContact(AbstractContactLaw):
    """Metal on metal, rough surfaces that yield: `h_c = 1.25 k_s (m/σ) (p/H)^0.95`.

    With `k_s = 2 k_1 k_2/(k_1 + k_2)`, `m = √(m_1² + m_2²)`, `σ = √(σ_1² + σ_2²)`; each
    of the three as two numbers, of the two surfaces, or one for both. Below
    `p/H = 1e-6` linear in the pressure. Linings of polymers contact elastically: give
    these a number.

    - `conductivity` `k` (W/(m·K)), `slope` `m` of the asperities, `roughness` `σ` (m)
    - `hardness` `H` (Pa) of the softer

    Reference: M. M. Yovanovich, *IEEE Trans. Compon. Packag. Technol.* 28 (2005) 182.

    Example:
        >>> law = sb.thermal.MetalContact(50.0, slope=0.15, roughness=2e-6, hardness=3e9)
        >>> law.conductance(np.array([0.5e6, 1e6])).round().tolist()
        [1207.0, 2332.0]
    """

    conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivities of both metals", many=IndexedBy.ROWS
    )
    slope: Scalar = positive_quantity(
        "1", "mean slopes of the asperities", many=IndexedBy.ROWS
    )
    roughness: Scalar = positive_quantity(
        "m", "roughnesses of both surfaces", many=IndexedBy.ROWS
    )
    hardness: Scalar = positive_quantity("Pa", "hardness of the softer metal")

    def conductance(self, p: Floats) -> Floats:
        k, m, sigma = (
            jnp.broadcast_to(x, (2,))
            for x in (self.conductivity, self.slope, self.roughness)
        )
        x = p / self.hardness
        slopes = jnp.sqrt(jnp.sum(m**2) / jnp.sum(sigma**2))
        return 1.25 * 2 / jnp.sum(1 / k) * slopes * x * (x**2 + 1e-6**2) ** -0.025


class ThermalContact(AbstractLink):
    """Two surfaces in contact: `g = h_c A`, `h_c = 1/R_c`.

    - `area` (m²); `resistance` `R_c` (m²·K/W), `None` for perfect contact (one of the
      two must then be a wall's face)
    - `opens`: nothing flows while the surfaces are apart: rim and linings of a standard
      brake, linings and band of a staged one, while the band is open; rim and a lining
      of a staged one while it has lifted off. What crosses the gap is a separate link:
      `Convection` or `Radiation` from one to the other, with `covered=1.0`
    - `law` of `h_c` by the pressure of the linings, in place of `resistance`; of one
      node for all linings their mean

    Example:
        >>> sb.thermal.ThermalContact("rim", "lining", 1.2, resistance=2e-3)
        ThermalContact(a='rim', b='lining', area=1.2 m², resistance=0.002 m²·K/W)
    """

    a: str = structural()
    b: str = structural()
    area: Scalar = positive_quantity("m^2", "area in contact")
    resistance: Scalar | None = positive_quantity(
        "m^2*K/W", "contact resistance", default=None
    )
    opens: bool = structural(default=False)
    law: AbstractContactLaw | None = part(AbstractContactLaw, default=None)

    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        if self.law is None:
            return (
                None
                if self.resistance is None
                else self.area / jnp.asarray(self.resistance)
            )
        h = self.law.conductance(jnp.asarray(around.pressure))
        alone = max(T_a.size, T_b.size) == 1
        return self.area * (jnp.mean(h) if alone else h)


def radiation_governs_above(
    coefficient: float, emissivity: float, ambient: float = ROOM
) -> float:
    """Surface temperature (K) above which radiation carries more than convection:
    `ε σ (T² + T_a²)(T + T_a) = h`.

    Both act at all temperatures; convection governs below and radiation above (S, of
    the permissible lining temperature). Raises `ValueError` where radiation carries
    more even without a difference of temperature.

    Example:
        >>> round(float(sb.thermal.radiation_governs_above(10.0, 0.8)), 2)
        456.3
    """
    from scipy.optimize import brentq

    def surplus(T: float) -> float:
        return (
            emissivity * STEFAN_BOLTZMANN * (T**2 + ambient**2) * (T + ambient)
            - coefficient
        )

    if surplus(ambient) > 0:
        raise ValueError(
            "radiation governs at every temperature: the convection is too low"
        )
    return float(brentq(surplus, ambient, 1e5))  # pyright: ignore


class Source(Part):
    """A given heat flow into a place (W): a number or a profile over time.

    Example:
        >>> sb.thermal.Source("rim", "2 kW")
        Source(a='rim', power=2 kW)
    """

    a: str = structural()
    power: AbstractProfile | Any = quantity("W", "heat flow into the place")


# --- bodies and places --------------------------------------------------------------


class Lump(Part):
    """A body of one temperature, or `count` of them (one per lining):
    `C(T) dT/dt = Σ heat flows`.

    - `capacity` `C` (J/K), a number or (count,), 0 makes a `Junction` of it;
      `capacity_slope` (1/K) as in `Material`
    - `temperature`: at the start (K)

    Example:
        >>> sb.thermal.Lump("rim", 2e5, "40 degC").temperature
        array(313.15)
    """

    name: str = structural()
    capacity: Scalar = quantity("J/K", "heat capacity", low=0.0, many=IndexedBy.ROWS)
    temperature: Scalar = quantity(
        "K", "temperature at the start", low=0.0, many=IndexedBy.ROWS, default=ROOM
    )
    capacity_slope: Scalar | None = quantity(
        "1/K", "relative change of capacity per kelvin", default=None
    )
    reference: Scalar = positive_quantity(
        "K", "temperature at which the capacity holds", default=ROOM
    )
    count: int = whole("number of nodes", default=1)


class Junction(Part):
    """A node without capacity: its temperature follows from those of its neighbours at
    every instant.

    Example:
        >>> sb.thermal.Junction("contact")
        Junction(name='contact')
    """

    name: str = structural()
    count: int = whole("number of nodes", default=1)


class Reservoir(Part):
    """A prescribed temperature, as of the ambient air: a number (K) or a profile over
    time.

    Example:
        >>> sb.thermal.Reservoir("air", "20 degC")
        Reservoir(name='air', temperature=20 °C)
    """

    name: str = structural()
    temperature: AbstractProfile | Any = quantity(
        "K", "prescribed temperature", low=0.0, default=ROOM
    )
    count: ClassVar[int] = 1

    def faults(self, path: str) -> Faults:
        """Errors of a profile below absolute zero."""
        return faults_of_sign(
            self, path, "K", "temperatures are absolute: 20 degC is 293.15 K"
        )


class Wall(Part):
    """A wall in layers from its `front` to its `back`: finite volumes of second order.

        ρ c A Δx_i dT_i/dt = q_{i−1} − q_i,   q_i = A (T_i − T_{i+1}) / (Δx_i/2λ_i +
        Δx_{i+1}/2λ_{i+1})

    - `thickness` (m), `area` (m²), `layers` (their number)
    - `growth`: ratio of a layer to the one before it (`layer_growth` gives it for a
      wanted first layer);  `temperature`: at the start (K), a number or one per node
    - `copies`: so many equal walls side by side (one per lining), each of the `area`;
      nodes wall by wall
    - `both`: layers grow from both faces to the middle, for walls that are heated on
      either side
    - `surface_layer`: massless layer on the front, and with `both` on the back; what
      enters at the face passes it

    Reference: S. V. Patankar, *Numerical Heat Transfer and Fluid Flow* (1980), eq.
    (4.9).

    Example:
        >>> sb.thermal.Wall("rim", sb.material("steel_20L"), "25 mm", 1.6, layers=16).layers
        16
    """

    name: str = structural()
    material: Material
    thickness: Scalar = positive_quantity("m", "thickness of the wall")
    area: Scalar = positive_quantity("m^2", "area of the wall")
    layers: int = whole("number of layers")
    growth: Scalar = positive_quantity("1", "ratio of neighbouring layers", default=1.0)
    temperature: Scalar = quantity(
        "K", "temperature at the start", low=0.0, many=IndexedBy.ROWS, default=ROOM
    )
    copies: int = whole("number of equal walls", high=10_000, default=1)
    both: bool = structural(default=False)
    surface_layer: SurfaceLayer | None = None

    @property
    def grades(self) -> Float[np.ndarray, " layers"]:
        """Number of growth steps of each layer from its face."""
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
#: of a wall
FACES = ("front", "back")


def nodes_at(body: Body, face: str | None) -> slice:
    """Nodes of a body named by a place (see `body_at`): all, or the outermost layers of
    a wall."""
    if not isinstance(body, Wall):
        return slice(None)
    return slice(0 if face == "front" else body.layers - 1, None, body.layers)


def size_of(body: Body, face: str | None) -> int:
    """Number of nodes of a place."""
    return body.copies if face is not None and isinstance(body, Wall) else body.count


def dependence(link: AbstractLink, bodies: tuple[Body, ...]) -> Reads:
    """What the conductance of a link between two of the `bodies` depends on."""
    by_name = {body.name: body for body in bodies}
    n_a, n_b = (
        size_of(by_name[name], face) for name, face in map(place_of, (link.a, link.b))
    )
    return reads(link, n_a, n_b)


def opens(link: AbstractLink) -> bool:
    """Whether a link conducts only while its contact is closed."""
    return bool(getattr(link, "opens", False))


def place_of(name: str) -> tuple[str, str | None]:
    """Body and face that a place names."""
    body, dot, face = name.partition(".")
    return body, face if dot else None


def body_at(place: str, by_name: dict[str, Body]) -> Body | None:
    """The body that a place names; `None` where there is none, or a wall without its
    face, or a face of no wall."""
    name, face = place_of(place)
    body = by_name.get(name)
    return None if isinstance(body, Wall) != (face in FACES) else body


def faults_of_network(
    bodies: tuple[Body, ...],
    links: tuple[AbstractLink, ...],
    sources: tuple[Source, ...],
    path: str,
    heated: tuple[str, ...] = (),
) -> Faults:
    """All errors of a network: names, sizes, nodes without connection, loops without a
    solution."""
    faults = Issues()
    by_name = {body.name: body for body in bodies}
    for i, body in enumerate(bodies):
        where = f"{path}.bodies[{i}]"
        if (
            body.name in [other.name for other in bodies[:i]]
            or not body.name
            or "." in body.name
        ):
            what = f"the name {body.name!r} is in use or invalid"
            faults.add(where, what, "names are unique, without dots")
        if isinstance(body, Lump) and np.any(np.asarray(body.capacity) == 0):
            hint = "give each a capacity, or none of them: then it is a `Junction`"
            faults.add(f"{where}.capacity", "0 J/K at some of its nodes", hint)
        if (
            isinstance(body, Wall)
            and body.surface_layer is not None
            and body.layers == 1
        ):
            faults.add(
                f"{where}.layers",
                "one layer has no face of its own",
                "give at least 2 layers",
            )
        for field in ("capacity", "temperature"):
            shape = np.shape(getattr(body, field, 0.0))
            if shape not in ((), (body.count,)):
                faults.add(
                    f"{where}.{field}", f"shape {shape} does not fit {body.count} nodes"
                )
    touched: set[str] = {
        place_of(place)[0] for place in (*heated, *(source.a for source in sources))
    }
    ends = [
        (f"{path}.links[{i}]", link, (link.a, link.b)) for i, link in enumerate(links)
    ]
    ends += [
        (f"{path}.sources[{i}]", source, (source.a,))
        for i, source in enumerate(sources)
    ]
    for edge_path, edge, places in ends:
        named = [place_of(place) for place in places]
        unknown = [name for name, _ in named if name not in by_name]
        there = ", ".join(by_name)
        faults += [
            Fault(edge_path, f"there is no body {name!r}", f"there are: {there}")
            for name in unknown
        ]
        misnamed = [
            (n, face)
            for n, face in named
            if n in by_name and isinstance(by_name[n], Wall) != (face in FACES)
        ]
        hint = "walls: name.front, name.back; others: name"
        faults += [
            Fault(edge_path, f"{name!r} has no face {face!r}", hint)
            for name, face in misnamed
        ]
        if unknown or misnamed:
            continue
        touched |= {name for name, _ in named}
        counts = {size_of(by_name[name], face) for name, face in named} - {1}
        if len(counts) > 1:
            faults.add(
                edge_path,
                f"{sorted(counts)} nodes do not pair",
                "equal numbers of nodes, or one",
            )
            continue
        if isinstance(edge, Source) or not dependence(edge, bodies).perfect:
            continue
        if not any(isinstance(by_name[name], Wall) for name, _ in named):
            hint = "make them one lump, or give a resistance"
            faults.add(f"{edge_path}.resistance", "perfect contact of two lumps", hint)
    alone = [
        body.name
        for body in bodies
        if body.name not in touched and not isinstance(body, Reservoir)
    ]
    if len(bodies) > 1:
        what = "is connected to nothing"
        faults += [
            Fault(f"{path}.bodies", f"{name!r} {what}", "link it, or leave it out")
            for name in alone
        ]
    faults += _floating_junctions(bodies, links, path)
    return faults or _faults_of_surfaces(bodies, links, sources, path)


def _floating_junctions(
    bodies: tuple[Body, ...], links: tuple[AbstractLink, ...], path: str
) -> Faults:
    """Junctions that no chain of conducting links joins to a body with a defined
    temperature."""

    def conducts(link: AbstractLink) -> bool:
        for field in ("value", "emissivity", "coefficient"):
            value = getattr(link, field, None)
            if (
                value is not None
                and not isinstance(value, AbstractCoefficient)
                and not np.any(np.asarray(value) > 0)
            ):
                return False
        return True

    grounded = {body.name for body in bodies if not isinstance(body, Junction)}
    while True:
        new = set(grounded)
        for link in links:
            (a, _) = place_of(link.a)
            (b, _) = place_of(link.b)
            if conducts(link) and (a in grounded or b in grounded):
                new |= {a, b}
        if new == grounded:
            break
        grounded = new
    hint = "link it to a body with capacity"
    loose = [body.name for body in bodies if body.name not in grounded]
    return [
        Fault(
            f"{path}.bodies", f"the junction {name!r} has no defined temperature", hint
        )
        for name in loose
    ]


# --- faces at which several heat flows meet -----------------------------------------


class Surface(NamedTuple):
    """Faces of walls that have one temperature: one face, or several in perfect
    contact.

    - `faces`: their places;  `size`: number of its temperatures, 1 or one per lining
    - `nodes`: lumps, junctions or reservoirs in perfect contact with them, whose
      temperature it has (at most one)
    """

    faces: tuple[str, ...]
    size: int
    nodes: tuple[str, ...]


def place_size(place: str, by_name: dict[str, Body]) -> int:
    """Number of nodes of a place."""
    name, face = place_of(place)
    return size_of(by_name[name], face)


def surfaces_of(
    bodies: tuple[Body, ...],
    links: tuple[AbstractLink, ...],
    sources: tuple[Source, ...],
) -> list[Surface]:
    """Surfaces whose temperatures follow from a balance of several flows, or of one
    that depends on temperatures.

    A face with one link of a given conductance is none of them: it lies in series with
    that link.
    """
    by_name = {body.name: body for body in bodies}
    flows = collections.Counter[str]()  # at faces of walls
    for link in links:
        for place, other in ((link.a, link.b), (link.b, link.a)):
            if place_of(place)[1]:
                flows[place] += (
                    place_size(other, by_name) if place_size(place, by_name) == 1 else 1
                )
    flows.update(source.a for source in sources if source.a in flows)
    joined = {place for place, count in flows.items() if count > 1}
    for link in links:
        if dependence(link, bodies).temperatures:
            joined |= {place for place in (link.a, link.b) if place_of(place)[1]}
    groups = [{place} for place in sorted(joined)]
    for link in links:
        ends = {link.a, link.b}
        if (
            dependence(link, bodies).perfect
            and not opens(link)
            and ends & joined
            and not any(place_of(p)[1] for p in ends - joined)
        ):
            touching = [group for group in groups if group & (ends & joined)]
            groups = [group for group in groups if group not in touching] + [
                set().union(ends, *touching)
            ]
    surfaces = []
    for group in groups:
        faces = tuple(sorted(place for place in group if place_of(place)[1]))
        nodes = tuple(sorted(group - set(faces)))
        surfaces.append(
            Surface(faces, min(place_size(place, by_name) for place in group), nodes)
        )
    return surfaces


def _faults_of_surfaces(
    bodies: tuple[Body, ...],
    links: tuple[AbstractLink, ...],
    sources: tuple[Source, ...],
    path: str,
) -> Faults:
    """Errors of perfect contacts at faces with other links: they open, or hold several
    lumps at one temperature."""
    by_name = {body.name: body for body in bodies}
    faults = Issues()
    surfaces = surfaces_of(bodies, links, sources)
    for i, link in enumerate(links):
        faces = [
            face
            for surface in surfaces
            for face in surface.faces
            if face in (link.a, link.b)
        ]
        if faces and opens(link) and dependence(link, bodies).perfect:
            what = f"perfect contact that opens, at {faces[0]} with other links"
            faults.add(f"{path}.links[{i}].resistance", what, "give it a resistance")
    for surface in surfaces:
        if len(surface.nodes) > 1 or any(
            place_size(node, by_name) > surface.size for node in surface.nodes
        ):
            what = (
                f"perfect contacts at {' and '.join(surface.faces)} hold "
                f"{' and '.join(surface.nodes)} together"
            )
            faults.add(f"{path}.links", what, "give all but one a resistance")
    return faults
