"""The heat of a scene: a thermal network, places of the friction heat, and shares of
the friction power."""

import abc
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._arguments import explained
from .._base._faults import Fault, Faults, Issues, require_share
from .._base._numbers import number
from .._base._part import Part, part, positive_quantity, quantity, short_for, structural
from .._base._quantity import IndexedBy, Scalar, Values
from ..hybrid.arrays import Array, Floats
from ..hybrid.struct import struct_field
from ..profiles import AbstractProfile
from ._coolant import WaterJacket
from .materials import Material, effusivity_share
from .network import (
    FACES,
    AbstractLink,
    Body,
    Junction,
    Lump,
    Reservoir,
    Source,
    Surface,
    ThermalContact,
    Wall,
    body_at,
    dependence,
    faults_of_network,
    nodes_at,
    place_of,
    place_size,
    size_of,
    surfaces_of,
)


class PowerSplit(NamedTuple):
    """Parts of a friction power (W) or of a friction work (J).

    Example:
        >>> split = sb.PowerShares(electrical=0.02).split(50e3)
        >>> round(float(split.heat)), round(float(split.electrical))
        (49000, 1000)
    """

    heat: Any
    electrical: Any
    mechanical: Any


@explained
class PowerShares(Part):
    """Shares of the friction power, `P = P_heat + P_electrical + P_mechanical`
    (S-8…11), each 0…1, 1 together.

    - `electrical`: currents that the contact drives (tribo-electricity); `mechanical`:
      deformation and fracture of asperities and wear; `heat`, the rest, warms rim,
      linings and band
    - `source`: source of the numbers

    In a scene (`Scene.power_shares`) they hold for every pair: only the share of heat
    enters the thermal part (and the flash temperature), and the ledger counts the other
    two. Whether these become heat later is left open (not stated by S). By default all
    is heat, at no cost.

    Raises `ValueError` for shares outside 0…1, alone or together.

    Example:
        >>> sb.PowerShares(electrical=0.02)
        PowerShares(electrical=0.02, mechanical=0)
    """

    electrical: Scalar = quantity(
        "1", "electrical share of the friction power", 0.0, 1.0, default=0.0
    )
    mechanical: Scalar = quantity(
        "1", "mechanical share of the friction power", 0.0, 1.0, default=0.0
    )
    source: str = structural(default="given")

    def __check_init__(self) -> None:
        numbers = {"electrical": self.electrical, "mechanical": self.mechanical}
        require_share(
            **{
                name: x
                for name, x in numbers.items()
                if isinstance(x, np.ndarray) and x.ndim == 0
            }
        )
        if faults := self.faults(""):
            raise ValueError(faults[0].problem)

    @property
    def heat(self) -> Scalar:
        """Share of heat, `1 − electrical − mechanical`."""
        return 1.0 - self.electrical - self.mechanical

    def split(self, power: Values) -> PowerSplit:
        """Parts of a friction power (W), or of a friction work (J); arrays pass
        through."""
        return PowerSplit(
            self.heat * power, self.electrical * power, self.mechanical * power
        )

    def faults(self, path: str) -> Faults:
        """Error of shares whose sum exceeds 1. Traced ones are not checked."""
        if not all(
            isinstance(share, np.ndarray | np.generic)
            for share in (self.electrical, self.mechanical)
        ):
            return []
        total = float(np.max(self.electrical + self.mechanical, initial=0.0))
        what = f"electrical + mechanical = {total:.12g} is more than 1"
        return [Fault(path, what, "heat is the rest")] if total > 1 + 1e-12 else []


def shares_of_S(electrical: float = 0.0) -> PowerShares:
    """S's figures: 0.68 of the friction power as heat (one reading of S-10), the rest
    mechanical.

    - `electrical`: a separate share out of that rest, `k_v I U/P` by
      `triboelectric_power`; S-9 and S-11, from which electrical and mechanical power
      would follow, are lost in the source

    S-10 prints `0.68·10⁻³`: the power in kW is one reading of the factor, and the share
    its only legible figure. Raises `ValueError` for an electrical share outside 0…0.32.

    Example:
        >>> sb.thermal.shares_of_S()
        PowerShares(
          electrical=0,
          mechanical=0.32,
          source='0.68 as heat: one reading of S-10; the rest an assumption',
        )
    """
    rest = 1.0 - 0.68 - electrical
    if not (electrical >= 0 and rest >= -1e-12):
        raise ValueError(f"electrical = {electrical} must be between 0 and 0.32")
    return PowerShares(
        electrical,
        max(rest, 0.0),
        "0.68 as heat: one reading of S-10; the rest an assumption",
    )


# --- the heat of a scene ------------------------------------------------------------


class AbstractPartition(Part):
    """Partition of the friction heat of a lining between metal and lining."""

    @abc.abstractmethod
    def share(self, T_metal: Floats, T_lining: Floats) -> Floats:
        """Share `a` (0…1) that goes into the metal; `1 − a` goes into the lining."""


@short_for(AbstractPartition)
class ConstantPartition(AbstractPartition):
    """A given share `a` into the metal (V: 0.531…0.865).

    Example:
        >>> sb.thermal.ConstantPartition(0.93)
        ConstantPartition(metal=0.93)
    """

    metal: Scalar = quantity(
        "1", "share of the friction heat into the metal", 0.0, 1.0, many=True
    )

    def share(self, T_metal: Floats, T_lining: Floats) -> Floats:
        return jnp.asarray(self.metal)


class EffusivityPartition(AbstractPartition):
    """`a = e_1/(e_1 + e_2)`, `e = √(λ ρ c)`: two half-spaces in sliding contact
    (Charron).

    Example:
        >>> sb.thermal.EffusivityPartition(sb.material("steel_20L"), sb.material("FK-24A")).metal.density
        array(7850.)
    """

    metal: Material
    lining: Material

    def share(self, T_metal: Floats, T_lining: Floats) -> Floats:
        return jnp.asarray(effusivity_share(self.metal, self.lining))


class TransmissionPartition(AbstractPartition):
    """`a = K_1/(K_1 + K_2)` by the heat transmission to both sides (S-39…42; V, table
    2), over the temperature.

        1/K_1 = 1/α_1 + δ_rim/λ_rim + 1/α_2,   1/K_2 = 1/α_2 + δ_s/λ_s + δ_l/λ_l +
        δ_b/λ_b + 1/α_3

    - `temperature` (k,) of the polished rim surface (K); `alpha_1`, `alpha_2`,
      `alpha_3` (k,) of its polished and matte surface and of the band (W/(m²·K));
      `surface_layer` `δ_s` (k,) of the lining (m)
    - thickness (m) and conductivity (W/(m·K)) of rim, surface layer, lining, band

    Linear between the temperatures of the table, constant beyond its ends (not
    extrapolated).

    Example:
        >>> law = sb.formulas.transmission_table()  # of V, a TransmissionPartition
        >>> round(float(law.share(500.0, 400.0)), 4)
        0.5572
    """

    temperature: Scalar = quantity(
        "K", "temperatures of the table", low=0.0, many=IndexedBy.ROWS
    )
    alpha_1: Scalar = positive_quantity(
        "W/(m^2*K)", "coefficients of the polished rim surface", many=IndexedBy.ROWS
    )
    alpha_2: Scalar = positive_quantity(
        "W/(m^2*K)", "coefficients of the matte rim surface", many=IndexedBy.ROWS
    )
    alpha_3: Scalar = positive_quantity(
        "W/(m^2*K)", "coefficients of the band", many=IndexedBy.ROWS
    )
    surface_layer: Scalar = positive_quantity(
        "m", "thickness of the lining's surface layer", many=IndexedBy.ROWS
    )
    rim_thickness: Scalar = positive_quantity(
        "m", "thickness of the rim", default=0.028
    )
    rim_conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the rim", default=48.85
    )
    surface_conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the surface layer", default=1.02
    )
    lining_thickness: Scalar = positive_quantity(
        "m", "thickness of the lining", default=0.030
    )
    lining_conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the lining", default=0.736
    )
    band_thickness: Scalar = positive_quantity(
        "m", "thickness of the band", default=0.006
    )
    band_conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the band", default=53.94
    )

    def transmissions(self, T: Floats) -> tuple[Floats, Floats]:
        """`K_1`, `K_2` (W/(m²·K)) at the rim temperature `T` (K)."""

        def at(values: Scalar) -> Array:
            return jnp.interp(T, jnp.asarray(self.temperature), jnp.asarray(values))

        through = (
            at(self.surface_layer) / self.surface_conductivity
            + self.lining_thickness / self.lining_conductivity
        )
        through = through + self.band_thickness / self.band_conductivity
        K_1 = 1 / (
            1 / at(self.alpha_1)
            + self.rim_thickness / self.rim_conductivity
            + 1 / at(self.alpha_2)
        )
        K_2 = 1 / (1 / at(self.alpha_2) + through + 1 / at(self.alpha_3))
        return K_1, K_2

    def share(self, T_metal: Floats, T_lining: Floats) -> Floats:
        K_1, K_2 = self.transmissions(T_metal)
        return K_1 / (K_1 + K_2)


class FrictionHeat(Part):
    """Places that the friction heat enters.

    - `metal`, `lining`: the places it enters; `None` for a side that the scene does not
      model (its share leaves the network and is counted as lost). The same place for
      both (an interface): the network itself finds the split. Of several bands with a
      rim each `metal` may have one node per band: each takes the heat of its own
    - `partition`: the law of the share
    - `sensed`: the place whose temperature the friction law sees; by default the
      lining's, else the metal's
    - `beyond`: of an external pair, a place behind the linings (the rim) that takes the
      share `beyond_share` at once: rim `k_1`, band `k_2 = share`, linings
      `1 − k_1 − k_2` (S-12…14)

    Example:
        >>> sb.thermal.FrictionHeat("rim", "lining", 0.93)
        FrictionHeat(metal='rim', lining='lining',
        partition=ConstantPartition(metal=0.93))
    """

    metal: str | None = structural()
    lining: str | None = structural()
    partition: AbstractPartition = part(AbstractPartition)
    sensed: str | None = structural(default=None)
    beyond: str | None = structural(default=None)
    beyond_share: Scalar | None = quantity(
        "1", "share of the heat beyond the linings", 0.0, 1.0, default=None
    )

    @property
    def sensor(self) -> str | None:
        return self.sensed or self.lining or self.metal


class FlashTemperature(Part):
    """Flash temperature at the contact spots, above the surface temperature (Blok,
    Jaeger; moving band source).

        ΔT = (2 q/λ) √(a l/(π v)),   q = s f p_r v;   `slow`: v + 16 a/(π l) in place of
        v under the root

    - `length` `l` of a spot (m), `conductivity` `λ`, `diffusivity` `a` of the body it
      moves over, `share` `s` of heat
    - `hardness` (Pa): pressure `p_r` on the spots; `None`: the nominal pressure of the
      lining
    - `slow`: round spots of diameter `l` at every speed down to rest, where
      `ΔT = q l/(2 λ)`: without it the slope of the friction over the speed is infinite
      at rest, and derivatives of a stop are off by about 1 %

    It makes the coefficient of friction implicit, `f = f(T_s + ΔT(f p v))`; the branch
    that starts at `ΔT = 0` is the one meant, and where it ends in a fold the run ends
    with the code `flash_fold`.

    Reference: J. C. Jaeger, *J. Proc. Roy. Soc. NSW* 76 (1942) 203; valid for
    `v l/(4 a) ≫ 1`. `slow`: X. Tian, F. E. Kennedy, *J. Tribol.* 116 (1994) 167.

    Example:
        >>> flash = sb.thermal.FlashTemperature("1 mm", conductivity=48.0, diffusivity=1.2e-5)
        >>> round(float(flash.rise(2e6, np.float64(10.0))), 4)
        1.6287
    """

    length: Scalar = positive_quantity("m", "length of a spot")
    conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the body it moves over"
    )
    diffusivity: Scalar = positive_quantity(
        "m^2/s", "diffusivity of the body it moves over"
    )
    share: Scalar = quantity(
        "1", "share of the heat that goes into this body", 0.0, 1.0, default=1.0
    )
    hardness: Scalar | None = positive_quantity(
        "Pa", "pressure on the spots", default=None
    )
    slow: bool = structural(default=False)

    def rise(self, q: Array, v: Array) -> Array:
        """`ΔT` (K) for the heat flux `q` (W/m²) at the speed `v` (m/s)."""
        if self.slow:
            v = v + 16 * self.diffusivity / (jnp.pi * self.length)
        moving = v > 0
        time = self.length / (jnp.pi * jnp.where(moving, v, 1.0))
        return jnp.where(
            moving,
            2 * self.share * q / self.conductivity * jnp.sqrt(self.diffusivity * time),
            0.0,
        )


def _settled(bodies: tuple[Body, ...]) -> tuple[Body, ...]:
    """A lump given without capacity is a junction."""

    def empty(body: Body) -> bool:
        return (
            isinstance(body, Lump)
            and isinstance(body.capacity, np.ndarray)
            and bool(np.all(body.capacity == 0))
        )

    if not isinstance(bodies, tuple | list):
        return bodies  # which the part refuses
    return tuple(
        Junction(body.name, body.count) if empty(body) else body for body in bodies
    )


class Heat(Part):
    """Thermal part of a scene; a scene without it has no thermal states, equations or
    cost.

    - `bodies`, `links`, `sources`: the network
    - `friction`: where the friction heat of linings and rim goes (`None`: it enters
      only the energy balance);  `external`: the same for band and linings of a staged
      brake
    - `flash`: flash temperature for the friction law
    - `rim`, `linings`, `band`: places whose temperatures are reported as those of rim,
      linings and band; `rim` is the body on which the linings rub, a disc or drum as
      well
    - `permissible` (K): permissible temperature of the linings; `permissible_rim`,
      `permissible_band` (K): of the rim and the band. Exceeding one is an event, and
      each is a limit of the verdict on a run

    Example:
        >>> bodies = (sb.thermal.Lump("rim", 2e5), sb.thermal.Reservoir("air"))
        >>> sb.Heat(bodies, (sb.thermal.Conductance("rim", "air", 20.0),)).links
        (Conductance(a='rim', b='air', value=20 W/K),)
    """

    bodies: tuple[Body, ...] = struct_field(converter=_settled)
    links: tuple[AbstractLink, ...] = ()
    friction: FrictionHeat | None = None
    sources: tuple[Source, ...] = ()
    flash: FlashTemperature | None = None
    rim: str | None = structural(default=None)
    linings: str | None = structural(default=None)
    band: str | None = structural(default=None)
    permissible: Scalar | None = positive_quantity(
        "K", "permissible temperature of the linings", default=None
    )
    external: FrictionHeat | None = None
    permissible_rim: Scalar | None = positive_quantity(
        "K", "permissible temperature of the rim", default=None
    )
    permissible_band: Scalar | None = positive_quantity(
        "K", "permissible temperature of the band", default=None
    )

    @property
    def by_name(self) -> dict[str, Body]:
        """The bodies by their names."""
        return {body.name: body for body in self.bodies}

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The bodies in layers."""
        return tuple(body for body in self.bodies if isinstance(body, Wall))

    @property
    def pairs(self) -> tuple[FrictionHeat, ...]:
        """Friction pairs whose heat enters the network."""
        return tuple(
            pair for pair in (self.friction, self.external) if pair is not None
        )

    @property
    def kinds(self) -> dict[str, str]:
        """Bodies that are the rim, the linings or the band, by their names."""
        band = [self.band]
        linings = [self.linings]
        rim = [self.rim]
        if self.external is not None:
            band = [*band, self.external.metal]
            linings = [*linings, self.external.lining]
        if self.friction is not None:
            linings = [*linings, self.friction.lining]
            rim = [*rim, self.friction.metal]
        named = (("band", band), ("linings", linings), ("rim", rim))
        return {
            place_of(place)[0]: kind
            for kind, places in named
            for place in places
            if place is not None
        }

    def stays_covered(self, link: AbstractLink) -> bool:
        """Whether a link ends on the rim of a staged brake: the linings sit on it while
        the band is open, too."""
        return self.external is not None and "rim" in (
            self.kinds.get(place_of(place)[0]) for place in (link.a, link.b)
        )

    @property
    def pressed(self) -> list[int]:
        """Links whose conductance depends on the pressure of the linings."""
        return [
            i
            for i, link in enumerate(self.links)
            if isinstance(link, ThermalContact) and link.law is not None
        ]

    @property
    def jackets(self) -> dict[int, WaterJacket]:
        """Water jackets, by their places among the links."""
        return {
            i: link
            for i, link in enumerate(self.links)
            if isinstance(link, WaterJacket)
        }

    @property
    def boiling(self) -> Scalar | None:
        """Temperature (K) at which the coolant of all jackets boils, `None` without
        any."""
        return next((jacket.liquid.boiling for jacket in self.jackets.values()), None)

    @property
    def surfaces(self) -> list[Surface]:
        """Faces of walls whose temperatures follow from a balance of heat flows."""
        return surfaces_of(self.bodies, self.links, self.sources)

    @property
    def storing_places(self) -> set[str]:
        """Places with a heat capacity: bodies, and the faces of walls."""
        stores = [body for body in self.bodies if isinstance(body, Lump | Wall)]
        faces = (
            f"{body.name}.{face}"
            for body in stores
            if isinstance(body, Wall)
            for face in FACES
        )
        return {*faces, *(body.name for body in stores if isinstance(body, Lump))}

    @property
    def hot_places(self) -> dict[str, str]:
        """Places whose temperatures are reported; `outer`: the outer faces of a staged
        brake's linings."""
        outer = None if self.external is None else self.external.lining
        named = {
            "rim": self.rim,
            "linings": self.linings,
            "band": self.band,
            "outer": outer,
        }
        if outer == self.linings:
            del named["outer"]
        return {kind: place for kind, place in named.items() if place is not None}

    @property
    def permissible_at(self) -> dict[str, Scalar]:
        """Permissible temperatures (K) of the `hot_places` that have one; both faces of
        a lining have the same."""
        limits = {
            "linings": self.permissible,
            "rim": self.permissible_rim,
            "band": self.permissible_band,
        }
        limits["outer"] = self.permissible
        return {kind: T for kind in self.hot_places if (T := limits[kind]) is not None}

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """Given functions of time inside: prescribed temperatures, powers, and flows of
        coolant."""
        inside = [b.temperature for b in self.bodies if isinstance(b, Reservoir)] + [
            s.power for s in self.sources
        ]
        inside += [jacket.flow for jacket in self.jackets.values()]
        return tuple(p for p in inside if isinstance(p, AbstractProfile))

    def faults_with(self, path: str, linings: int, rims: int = 0) -> Faults:
        """Errors of the network beside the linings of a brake (concrete values only).

        - `linings`: their number
        - `rims`: number of separate rims that bands may have, 0: they share one
        """
        heated = [
            place
            for pair in self.pairs
            for place in (pair.metal, pair.lining, pair.beyond)
        ]
        faults = Issues(
            faults_of_network(
                self.bodies,
                self.links,
                self.sources,
                path,
                tuple(p for p in heated if p),
            )
        )
        for kind in ("rim", "band"):
            if (
                getattr(self, f"permissible_{kind}") is not None
                and getattr(self, kind) is None
            ):
                hint = f"name it in `{kind}`, or leave the limit out"
                faults.add(
                    f"{path}.permissible_{kind}",
                    f"the network names no place as the {kind}",
                    hint,
                )
        for i in self.pressed:
            if getattr(self.links[i], "resistance", None) is not None:
                faults.add(
                    f"{path}.links[{i}].law",
                    "stands beside a resistance",
                    "give one of the two",
                )
        if faults or (faults := self._faults_of_jackets(path)):
            return faults
        by_name = self.by_name
        pairs = {
            name: getattr(self, name)
            for name in ("friction", "external")
            if getattr(self, name) is not None
        }
        named = {field: getattr(self, field) for field in ("rim", "linings", "band")}
        for name, pair in pairs.items():
            named |= {
                f"{name}.{field}": getattr(pair, field)
                for field in ("metal", "lining", "sensed", "beyond")
            }
        for field, place in named.items():
            if place is None:
                continue
            body = body_at(place, by_name)
            if body is None:
                faults.add(
                    f"{path}.{field}",
                    f"there is no place {place!r}",
                    "a body, or the face of a wall",
                )
                continue
            sizes = (
                [1, linings]
                if rims == 0 or field.endswith(("lining", "linings"))
                else [1, rims, linings]
            )
            if (nodes := size_of(body, place_of(place)[1])) not in sizes:
                hint = " or ".join(str(size) for size in sizes)
                faults.add(f"{path}.{field}", f"{place!r} has {nodes} nodes", hint)
        if not faults:
            for name, pair in pairs.items():
                faults += self._faults_of_pair(pair, f"{path}.{name}")
        return faults

    def _faults_of_jackets(self, path: str) -> Issues:
        """Errors of coolants: without an inlet temperature, or boiling at the inlet or
        at the start."""
        faults = Issues()
        by_name = self.by_name
        for i, jacket in self.jackets.items():
            where = f"{path}.links[{i}]"
            boiling = float(jacket.liquid.boiling)
            if not isinstance(inlet := by_name[place_of(jacket.b)[0]], Reservoir):
                hint = "name a `Reservoir` with the temperature of the inlet"
                faults.add(f"{where}.b", f"{jacket.b!r} is no reservoir", hint)
                continue
            if boiling != float(self.boiling):  # pyright: ignore
                hint = "give the jackets of a network one pressure"
                faults.add(
                    f"{where}.liquid.boiling",
                    "differs from that of the jacket before",
                    hint,
                )
            name, face = place_of(jacket.a)
            if isinstance(by_name[name], Reservoir):
                faults.add(
                    f"{where}.a",
                    f"{jacket.a!r} is a reservoir",
                    "name the wall that the coolant wets",
                )
                continue
            wall = by_name[name]
            at_start = getattr(by_name[name], "temperature", 0.0)
            T_in = inlet.temperature
            if isinstance(T_in, AbstractProfile):
                T_in = getattr(T_in, "values", T_in.scale())
            T_wall = np.broadcast_to(np.asarray(at_start), (wall.count,))[
                nodes_at(wall, face)
            ]
            for words, body, T in (
                ("inlet", inlet, T_in),
                ("wetted wall", wall, T_wall),
            ):
                if (hottest := float(np.max(T))) >= boiling:
                    there = f"{path}.bodies[{[*by_name].index(body.name)}].temperature"
                    what = (
                        f"{number(hottest, 'K')} of the {words}: the coolant boils "
                        f"at {number(boiling, 'K')}"
                    )
                    faults.add(
                        there,
                        what,
                        "from the start: begin cooler, or give a higher pressure",
                    )
        return faults

    def _faults_of_pair(self, pair: FrictionHeat, path: str) -> Faults:
        faults = Issues()
        by_name = self.by_name
        sensor = pair.sensor
        if sensor is None or isinstance(by_name[place_of(sensor)[0]], Junction):
            hint = "name a body with capacity in `sensed`"
            faults.add(
                f"{path}.sensed",
                "the friction law needs a temperature that is a state",
                hint,
            )
        if (pair.beyond is None) != (pair.beyond_share is None):
            faults.add(
                f"{path}.beyond",
                "a place and its share of the heat belong together",
                "give both",
            )
        for field in ("metal", "lining", "beyond"):
            place = getattr(pair, field)
            if place is None:
                continue
            body = by_name[place_of(place)[0]]
            if isinstance(body, Reservoir) or (
                isinstance(body, Junction) and self._open(place)
            ):
                what = (
                    "a reservoir"
                    if isinstance(body, Reservoir)
                    else "a junction that radiates or convects freely"
                )
                faults.add(
                    f"{path}.{field}",
                    f"{place!r} is {what}",
                    "let the heat enter a body",
                )
        return faults

    def _open(self, place: str) -> bool:
        """Whether a link whose conductance depends on temperatures ends at a place."""
        return any(
            dependence(link, self.bodies).temperatures
            for link in self.links
            if place in (link.a, link.b)
        )


def node_names(heat: Heat) -> list[str]:
    """Names of all nodes with capacity, in the order of the state, then those of the
    junctions."""

    def of(body: Body) -> list[str]:
        if isinstance(body, Wall) and body.copies > 1:
            return [
                f"{body.name}[{i + 1},{j + 1}]"
                for i in range(body.copies)
                for j in range(body.layers)
            ]
        return (
            [body.name]
            if body.count == 1
            else [f"{body.name}[{i + 1}]" for i in range(body.count)]
        )

    stores = [
        name
        for body in heat.bodies
        if isinstance(body, Wall | Lump)
        for name in of(body)
    ]
    return stores + [
        name for body in heat.bodies if isinstance(body, Junction) for name in of(body)
    ]


def initial_temperatures(heat: Heat) -> Float[np.ndarray, " k"]:
    """Temperatures at the start (K) of the nodes with capacity (concrete values)."""
    stores = [body for body in heat.bodies if isinstance(body, Wall | Lump)]
    return np.concatenate(
        [
            np.broadcast_to(np.asarray(body.temperature, float), (body.count,))
            for body in stores
        ]
    )


def place_count(heat: Heat, place: str) -> int:
    """Number of nodes of a place."""
    return place_size(place, {body.name: body for body in heat.bodies})
