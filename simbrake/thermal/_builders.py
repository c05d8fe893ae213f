"""Ready thermal networks of brakes, from a few lumps to a layered rim with a wall for
every lining."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from .._base._part import Whole, takes_values
from .._base._quantity import Quantity, Values, positive
from ..profiles import AbstractProfile
from ._coolant import ATMOSPHERE, Liquid, WaterJacket, water
from .heat import AbstractPartition, FrictionHeat, Heat
from .materials import ROOM, Material, SurfaceLayer, layer_growth
from .network import (
    AbstractCoefficient,
    AbstractLink,
    Body,
    Conductance,
    Convection,
    Lump,
    Radiation,
    Reservoir,
    ThermalContact,
    Wall,
    dependence,
    place_of,
)

_Start = Annotated[
    float | Sequence[float], Quantity("K", "temperature at the start", 0.0, many=True)
]
_Ambient = Annotated[
    AbstractProfile | float, Quantity("K", "temperature of the air", 0.0)
]
_Permissible = Annotated[
    float | None, positive("K", "permissible temperature of the linings")
]
_PermissibleRim = Annotated[
    float | None, positive("K", "permissible temperature of the rim")
]
_PermissibleBand = Annotated[
    float | None, positive("K", "permissible temperature of the band")
]


def _coefficient(where: str) -> Quantity:
    return Quantity("W/(m^2*K)", f"heat transfer coefficient of {where}", 0.0)


def axial_resistance(
    length: Values, conductivity: Values, inner: Values, outer: Values
) -> Values:
    """Resistance (K/W) of a ring along its axis: `L/(λ π (R² − r²))` (V, table 1,
    shell).

    Example:
        >>> round(float(sb.thermal.axial_resistance(0.1, 48.0, 0.55, 0.59)), 6)
        0.014543
    """
    return length / (conductivity * math.pi * (outer**2 - inner**2))


def radial_resistance(
    width: Values, conductivity: Values, inner: Values, outer: Values
) -> Values:
    """Resistance (K/W) of a ring along its radius: `ln(R/r)/(2 π λ L)` (V, table 1,
    flange, rim lips, disc).

    Example:
        >>> round(float(sb.thermal.radial_resistance(0.22, 48.0, 0.55, 0.59)), 6)
        0.001058
    """
    return np.log(outer / inner) / (2 * math.pi * conductivity * width)


@takes_values
def lumped_heat(
    *,
    rim: Annotated[float, positive("J/K", "heat capacity of the rim")],
    partition: AbstractPartition | float,
    rim_cooling: Annotated[
        float, Quantity("W/K", "conductance from the rim to the air", 0.0)
    ],
    linings: Annotated[
        float | None, positive("J/K", "heat capacity of the linings")
    ] = None,
    band: Annotated[float | None, positive("J/K", "heat capacity of the band")] = None,
    lining_to_band: Annotated[
        float | None, Quantity("W/K", "conductance from linings to band", 0.0)
    ] = None,
    band_cooling: Annotated[
        float | None, Quantity("W/K", "conductance from the band to the air", 0.0)
    ] = None,
    temperature: _Start = ROOM,
    ambient: _Ambient = ROOM,
    permissible: _Permissible = None,
    permissible_rim: _PermissibleRim = None,
    permissible_band: _PermissibleBand = None,
) -> Heat:
    """Rim, linings and band as one lump each; of several alike rims (`Brake.rims`) all
    together.

    - `rim`, `linings`, `band`: capacities (J/K); without `linings` their share of the
      heat leaves the network
    - `rim_cooling`, `band_cooling`: `h A` to the air; `lining_to_band`: conductance
      (W/K)
    - `temperature` at the start, of the `ambient` air, `permissible` one of the linings
      (K), `permissible_rim`, `permissible_band` of rim and band

    Raises `ValueError` where a band is given without linings, or a conductance without
    its bodies.

    Example:
        >>> sb.lumped_heat(rim=2e5, partition=1.0, rim_cooling=20.0).rim
        'rim'
    """
    if (band is not None) != (lining_to_band is not None) or (
        band is not None and linings is None
    ):
        raise ValueError("a band needs linings and the conductance lining_to_band")
    bodies: list[Body] = [Lump("rim", rim, temperature), Reservoir("air", ambient)]
    links: list[AbstractLink] = [Conductance("rim", "air", rim_cooling)]
    if linings is not None:
        bodies.append(Lump("linings", linings, temperature))
    if band is not None:
        bodies.append(Lump("band", band, temperature))
        links.append(Conductance("linings", "band", lining_to_band))
        if band_cooling is not None:
            links.append(Conductance("band", "air", band_cooling))
    elif linings is not None:
        links.append(
            Conductance("linings", "air", 0.0 if band_cooling is None else band_cooling)
        )
    limits = permissible, permissible_rim, permissible_band
    return _rubbing(
        "rim", None if linings is None else "linings", partition, bodies, links, limits
    )


def _rubbing(
    rim: str,
    linings: str | None,
    partition: AbstractPartition | float,
    bodies: list[Body],
    links: list[AbstractLink],
    limits: tuple[float | None, float | None, float | None],
) -> Heat:
    """A network with linings (`None`: none) on the rim, with a band where there is a
    body of this name.

    `limits`: permissible temperatures of linings, rim and band (K)
    """
    band = "band" if any(body.name == "band" for body in bodies) else None
    pair = FrictionHeat(rim, linings, partition)
    fields = ("permissible", "permissible_rim", "permissible_band")
    permissible: Any = dict(zip(fields, limits, strict=True))
    return Heat(
        tuple(bodies),
        tuple(links),
        pair,
        rim=rim,
        linings=linings,
        band=band,
        **permissible,
    )


def _growth(
    thickness: float, first: float | None, layers: int, both: bool = False
) -> float:
    """Ratio of neighbouring layers of a wall whose first layer is `first` thick;
    uniform without it."""
    if both and layers % 2:
        raise ValueError("layers that are graded to both faces are even in number")
    halves = 2 if both else 1
    return (
        1.0
        if first is None
        else layer_growth(first, thickness / halves, layers // halves)
    )


def _cooled(
    place: str,
    area: float,
    coefficient: AbstractCoefficient | float | None,
    emissivity: float | None = None,
    covered: float | None = None,
) -> list[AbstractLink]:
    """Convection and radiation to the air from `area` of a place, each where it is
    given."""
    links: list[AbstractLink] = []
    if coefficient is not None:
        links.append(Convection(place, area, coefficient, covered=covered))
    if emissivity is not None:
        links.append(Radiation(place, area, emissivity, covered=covered))
    return links


@takes_values
def layered_heat(
    *,
    rim: Material,
    rim_thickness: Annotated[float, positive("m", "thickness of the rim")],
    track_area: Annotated[float, positive("m^2", "area of the friction track")],
    partition: AbstractPartition | float,
    rim_layers: Annotated[int, Whole("layers of the rim", 1, 100_000)] = 20,
    rim_first: Annotated[
        float | None, positive("m", "thickness of the rim's first layer")
    ] = None,
    lining: Material | None = None,
    lining_thickness: Annotated[float, positive("m", "thickness of a lining")] = 0.030,
    lining_area: Annotated[float | None, positive("m^2", "area of all linings")] = None,
    lining_layers: Annotated[int, Whole("layers of a lining", 1, 100_000)] = 10,
    lining_first: Annotated[
        float | None, positive("m", "thickness of a lining's first layer")
    ] = None,
    lining_both: bool = False,
    lining_surface: SurfaceLayer | None = None,
    each: Annotated[int, Whole("linings with separate walls", 1, 10_000)] = 1,
    band: Material | None = None,
    band_thickness: Annotated[float, positive("m", "thickness of the band")] = 0.006,
    inside: Annotated[
        AbstractCoefficient | float | None, _coefficient("the rim's bore")
    ] = None,
    outside: Annotated[
        AbstractCoefficient | float | None, _coefficient("the track")
    ] = None,
    band_coefficient: Annotated[
        AbstractCoefficient | float | None, _coefficient("the band")
    ] = None,
    emissivity: Annotated[
        float | None, Quantity("1", "emissivity of the track", 0.0, 1.0)
    ] = None,
    band_emissivity: Annotated[
        float | None, Quantity("1", "emissivity of the band", 0.0, 1.0)
    ] = None,
    covered: Annotated[
        float | None, Quantity("1", "share of the track under linings", 0.0, 1.0)
    ] = None,
    temperature: _Start = ROOM,
    ambient: _Ambient = ROOM,
    permissible: _Permissible = None,
    contact_resistance: Annotated[
        float | None, positive("m^2*K/W", "resistance between rim and linings")
    ] = None,
    band_resistance: Annotated[
        float | None, positive("m^2*K/W", "resistance between linings and band")
    ] = None,
    permissible_rim: _PermissibleRim = None,
    permissible_band: _PermissibleBand = None,
) -> Heat:
    """Layered rim, linings with a thin surface layer over their body, and the band
    behind them.

    On several alike rims (`Brake.rims`) areas are those of all rims together.

    - `rim`, `lining`, `band`: materials; without `lining` its share of the heat leaves
      the network
    - thicknesses (m); `rim_layers`, `lining_layers`; `rim_first`, `lining_first`:
      thickness of the first layer (m), by default that of all; a quarter of `√(a t)` is
      thin enough for the surface in a heating over the time `t`, and a run warns where
      it is too thick; V's surface layer is 5.6–35.4 µm thick
    - `lining_both`: the layers of the linings are thin at both faces, for a staged
      brake; their number is then even
    - `lining_surface`: massless layer on the friction faces of the linings (V); `None`:
      no resistance there
    - `track_area` (m²) of the rim; `lining_area` (m²) of all linings; `each`: number of
      linings with separate walls, so that friction and temperature differ along the
      band; 1: all of them as one
    - `inside`, `outside`, `band_coefficient`: heat transfer coefficients (W/(m²·K)) or
      laws, of the rim's bore, of its track and of the band;  `emissivity`,
      `band_emissivity`;  `covered`: overlap coefficient of the track (default
      `lining_area/track_area`)
    - `contact_resistance` (m²·K/W): of the heat exchange between rim and linings while
      the band is closed; `None`: no exchange;  `band_resistance`: between linings and
      band, `None`: perfect contact
    - `permissible`, `permissible_rim`, `permissible_band` (K): permissible temperatures
      of linings, rim and band

    Raises `ValueError` where sizes contradict each other.
    """
    if lining is not None and lining_area is None:
        raise ValueError("linings need their area")
    if band is not None and lining is None:
        raise ValueError("a band needs linings")
    if covered is None and lining_area is not None:
        covered = lining_area / track_area
    growth = _growth(rim_thickness, rim_first, rim_layers)
    bodies: list[Body] = [
        Wall("rim", rim, rim_thickness, track_area, rim_layers, growth, temperature),
        Reservoir("air", ambient),
    ]
    links: list[AbstractLink] = _cooled(
        "rim.front", track_area, outside, emissivity, covered=covered
    )
    links += _cooled("rim.back", track_area, inside)
    if lining is not None and lining_area is not None:
        wall_area = lining_area / each
        growth = _growth(lining_thickness, lining_first, lining_layers, lining_both)
        bodies.append(
            Wall(
                "lining",
                lining,
                lining_thickness,
                wall_area,
                lining_layers,
                growth,
                temperature,
                each,
                lining_both,
                surface_layer=lining_surface,
            )
        )
        if contact_resistance is not None:
            links.append(
                ThermalContact(
                    "rim.front",
                    "lining.front",
                    wall_area,
                    contact_resistance,
                    opens=True,
                )
            )
    if band is not None and lining_area is not None:
        bodies.append(
            Lump(
                "band",
                band.volumetric_heat_capacity * band_thickness * lining_area,
                temperature,
            )
        )
        links.append(
            ThermalContact("lining.back", "band", lining_area / each, band_resistance)
        )
        links += _cooled("band", lining_area, band_coefficient, band_emissivity)
    limits = permissible, permissible_rim, permissible_band
    return _rubbing(
        "rim.front",
        None if lining is None else "lining.front",
        partition,
        bodies,
        links,
        limits,
    )


@takes_values
def with_pulley_structure(
    heat: Heat,
    material: Material,
    *,
    inside: Annotated[
        AbstractCoefficient | float | None, _coefficient("flange and rim lips")
    ] = 10.0,
    temperature: _Start = ROOM,
    rim_place: str = "rim.back",
    flange: bool = True,
    pulleys: Annotated[
        int, Whole("pulleys whose rims are the one of the network", 1, 100)
    ] = 1,
) -> Heat:
    """The same network with the structure behind the rim of a U2-5-5 pulley: flange,
    two rim lips, disc (V, table 1).

    Each is a lump that the rim reaches through V's radial resistance of that part;
    flange and rim lips give heat to the air. `flange=False` is S's thermal
    stabilisation: no heat flows between the rim and its flange.

    - `pulleys` `n`: where one rim of the network stands for `n` rims (`Brake.rims`),
      that many structures are behind it; in parallel, as one lump of `n` times the
      capacity, conductance and area

    Example:
        >>> heat = sb.lumped_heat(rim=2e5, partition=1.0, rim_cooling=20.0)
        >>> heat = sb.thermal.with_pulley_structure(heat, sb.material("steel_20L"), rim_place="rim")
        >>> [body.name for body in heat.bodies]
        ['rim', 'air', 'flange', 'rebord_1', 'rebord_2', 'disc']
    """
    parts = {  # inner and outer radius, width (m)
        "flange": (0.420, 0.565, 0.035),
        "rebord_1": (0.565, 0.615, 0.025),
        "rebord_2": (0.575, 0.615, 0.025),
        "disc": (0.575, 0.590, 0.025),
    }
    bodies = list(heat.bodies)
    links = list(heat.links)
    for name, (inner, outer, width) in parts.items():
        if name == "flange" and not flange:
            continue
        face = pulleys * math.pi * (outer**2 - inner**2)
        resistance = (
            radial_resistance(width, material.conductivity, inner, outer) / pulleys
        )
        bodies.append(
            Lump(
                name,
                material.volumetric_heat_capacity * face * width,
                temperature,
            )
        )
        links.append(Conductance(rim_place, name, 1 / resistance))
        links.append(Convection(name, 2 * face, inside))
    return dataclasses.replace(heat, bodies=tuple(bodies), links=tuple(links))


@takes_values
def with_water_jacket(
    heat: Heat,
    flow: Annotated[
        AbstractProfile | float, positive("m^3/s", "volume flow of the coolant")
    ],
    *,
    inlet: Annotated[
        AbstractProfile | float,
        Quantity("K", "temperature of the coolant at the inlet", 0.0),
    ] = ROOM,
    area: Annotated[float | None, positive("m^2", "wetted area")] = None,
    coefficient: Annotated[
        AbstractCoefficient | float | None, _coefficient("the coolant")
    ] = None,
    section: Annotated[float | None, positive("m^2", "section of the channel")] = None,
    diameter: Annotated[
        float | None, positive("m", "hydraulic diameter of the channel")
    ] = None,
    length: Annotated[float | None, positive("m", "length of the channel")] = None,
    pressure: Annotated[
        float, Quantity("Pa", "absolute pressure of the water", 611.213, 22.064e6)
    ] = ATMOSPHERE,
    liquid: Liquid | None = None,
    rim_place: str | None = None,
    name: str = "water",
) -> Heat:
    """The same network with water that flows behind the rim: a `WaterJacket`, and a
    reservoir with its inlet.

    - `flow` (m³/s, as "200 l/min"), `inlet` temperature (K): numbers or profiles over
      time
    - `area` (m²) that the water wets, by default that of the rim's wall
    - `coefficient` (W/(m²·K)), or the channel: `section` (m²), hydraulic `diameter`
      (m), of a gap twice its width, and `length` (m), from which Dittus–Boelter gives
      it
    - `pressure` (Pa, absolute), by which it boils
    - `liquid`: another one than water with the properties of the inlet
    - `rim_place`: by default the back of the rim's wall, else its lump
    - `name` of the reservoir

    Raises `ValueError` where the network names no rim, a lump is given no area, or an
    inlet that varies no liquid.

    Example:
        >>> heat = sb.lumped_heat(rim=2e5, partition=1.0, rim_cooling=20.0)
        >>> wet = sb.thermal.with_water_jacket(heat, "200 l/min", inlet="25 degC", area=0.8, coefficient=4000.0)
        >>> rim = sb.steady_state(wet, power=100e3)["rim"]
        >>> round(float(rim) - 273.15, 3)
        59.708
    """
    place = rim_place or (heat.rim or "").replace(".front", ".back")
    body = heat.by_name.get(place_of(place)[0])
    if body is None:
        raise ValueError(
            "a water jacket needs a rim: name it in `heat.rim`, or give `rim_place`"
        )
    if area is None:
        if not isinstance(body, Wall):
            raise ValueError("a water jacket on a lump needs its wetted area")
        area = body.area
    if liquid is None:
        if isinstance(inlet, AbstractProfile):
            raise ValueError(
                "an inlet that varies needs the liquid: `water` at the mean temperature"
            )
        liquid = water(inlet, pressure)
    jacket = WaterJacket(
        place, area, flow, liquid, coefficient, section, diameter, length, name
    )
    return dataclasses.replace(
        heat,
        bodies=(*heat.bodies, Reservoir(name, inlet)),
        links=(*heat.links, jacket),
    )


@takes_values
def with_external_pair(
    heat: Heat,
    partition: AbstractPartition | float,
    *,
    lining: str | None = None,
    rim_share: Annotated[
        float | None, Quantity("1", "share of the external heat in the rim", 0.0, 1.0)
    ] = None,
) -> Heat:
    """The same network for a staged brake: the band rubs on the outer face of the
    linings (S-12…14).

    - `partition`: share `k_2` of that heat into the band
    - `rim_share` `k_1`: part that goes to the rim at once
    - `lining`: place of the linings' outer faces, by default the back of their wall,
      else their lump

    The linings' inner faces and the rim keep the pair of `heat.friction`, now the
    internal one. Links between linings and band conduct only while the band is closed,
    those between rim and linings as long as a lining sits on the rim: always, unless
    its centrifugal force can lift it off (`Bandage.mass`). A perfect contact there
    stays closed. Raises `ValueError` for a network without linings and band.

    Example:
        >>> heat = sb.lumped_heat(rim=2e5, linings=2e4, band=3e4, partition=0.9, rim_cooling=20.0, lining_to_band=40.0)
        >>> external = sb.thermal.with_external_pair(heat, 0.8, rim_share=0.05).external
        >>> external.metal, external.lining, external.beyond
        ('band', 'linings', 'rim')
    """
    inner = heat.friction
    if inner is None or inner.lining is None or heat.band is None:
        raise ValueError("an external pair needs linings and a band in the network")
    lining = lining or inner.lining.replace(".front", ".back")
    beyond = None if rim_share is None else inner.metal
    linings = place_of(lining)[0]
    band = place_of(heat.band)[0]

    def between(link: AbstractLink) -> AbstractLink:
        ends = {place_of(link.a)[0], place_of(link.b)[0]}
        touches = isinstance(link, Conductance | ThermalContact) and linings in ends
        parts = band in ends or not dependence(link, heat.bodies).perfect
        return dataclasses.replace(link, opens=parts) if touches else link

    return dataclasses.replace(
        heat,
        links=tuple(between(link) for link in heat.links),
        external=FrictionHeat(
            heat.band, lining, partition, beyond=beyond, beyond_share=rim_share
        ),
    )
