"""Inputs of the estimates: from the user, the scene, the papers, or assumed."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..._base._faults import Fault, input_error, nearest
from ..._base._part import faults_of_values
from ..._base._quantity import NumberReader, Quantity, positive, unit_suffix
from ...parts.scene import Scene, banded_brake
from ...thermal.heat import FrictionHeat, Heat, PowerShares
from ...thermal.materials import LIBRARY, ROOM, Material, effusivity_share, material
from ...thermal.network import (
    AbstractCoefficient,
    Convection,
    Lump,
    Radiation,
    Reservoir,
    Wall,
    place_of,
)
from .contact import polished_surface
from .stress import ElasticMaterial


@dataclasses.dataclass(frozen=True)
class EstimateData:
    """Numbers for `estimates` that a scene may lack; `None`: from the scene, else from
    the papers or assumed.

    - `rim`, `lining`, `band`: materials; `rim_thickness`, `lining_thickness`,
      `band_thickness` (m); `track_area`, `lining_area` (m²), all bands together
    - `share`: heat partition coefficient of the rim; `coefficient` (W/(m²·K)) and
      `emissivity` of the open track; `ambient` (K)
    - `hardness` (Pa) of the softer surface, `spot_length` (m) for flash temperature and
      real contact; `matte_area` (m²)
    - `elastic`: for the thermal stress; `power`: shares of the friction power
    - of a staged brake: `outer_area` (m²) of the linings' outer faces (`lining_area`:
      of the inner ones), `external_share` of the heat of band and linings that goes
      into the band, `beyond_share` of it that goes into the rim at once (`share`: of
      linings and rim)

    Example:
        >>> data = sb.formulas.EstimateData(rim_thickness=0.028)
        >>> [i.source for i in sb.estimates(scene, data).inputs if i.name == "rim_thickness"]
        ['given']
    """

    rim: Material | None = None
    lining: Material | None = None
    band: Material | None = None
    rim_thickness: float | None = None
    lining_thickness: float | None = None
    band_thickness: float | None = None
    track_area: float | None = None
    lining_area: float | None = None
    share: float | None = None
    coefficient: float | None = None
    emissivity: float | None = None
    ambient: float | None = None
    hardness: float | None = None
    spot_length: float | None = None
    matte_area: float | None = None
    elastic: ElasticMaterial | None = None
    power: PowerShares | None = None
    outer_area: float | None = None
    external_share: float | None = None
    beyond_share: float | None = None


_MATERIALS = ("rim", "lining", "band")
_STAGED = ("outer_area", "external_share", "beyond_share")
#: numbers of `EstimateData`: unit, meaning, range
_NUMBERS: dict[str, Quantity] = {
    "rim_thickness": positive("m", "thickness of the rim"),
    "lining_thickness": positive("m", "thickness of the linings"),
    "band_thickness": positive("m", "thickness of the band"),
    "track_area": positive("m^2", "area of the track, all bands together"),
    "lining_area": positive("m^2", "area of the linings, all bands together"),
    "share": Quantity("1", "share of the friction heat into the rim", 0.0, 1.0),
    "coefficient": Quantity("W/(m^2*K)", "coefficient of the open track", 0.0),
    "emissivity": Quantity("1", "emissivity of the open track", 0.0, 1.0),
    "ambient": positive("K", "temperature of the air"),
    "hardness": positive("Pa", "hardness of the softer surface"),
    "spot_length": positive("m", "length of a spot"),
    "matte_area": positive("m^2", "area of the matte surfaces"),
    "outer_area": positive("m^2", "area of a staged brake's outer faces"),
    "external_share": Quantity(
        "1", "share of the external pair's heat into the band", 0.0, 1.0
    ),
    "beyond_share": Quantity(
        "1", "share of the external pair's heat into the rim", 0.0, 1.0
    ),
}
#: what is taken where neither the user nor the scene has it, and its source; the others
#: follow from other inputs
_ASSUMED: dict[str, tuple[Any, str]] = {
    "rim": (material("steel_20L"), "steel 20L (V, table 1)"),
    "lining": (material("FK-24A"), "FK-24A (V, table 2)"),
    "band": (material("band_steel"), "brake band (V, table 2)"),
    "rim_thickness": (0.025, "V, table 1"),
    "lining_thickness": (0.030, "V"),
    "band_thickness": (0.006, "V"),
    "coefficient": (20.0, "assumption: convection at a turning rim"),
    "emissivity": (0.8, "assumption: oxidised steel"),
    "ambient": (ROOM, "assumption: 20 °C"),
    "hardness": (300e6, "assumption: friction composite"),
    "spot_length": (50e-6, "assumption: spots of 50 µm"),
    "matte_area": (None, "assumption: the rim's bore alone"),
    "elastic": (ElasticMaterial(), "assumption: cast carbon steel"),
    "power": (PowerShares(), "all heat"),
}


class Input(NamedTuple):
    """One input (number or material) of the estimates, and its source.

    Example:
        >>> [i.source for i in sb.estimates(scene).inputs if i.name == "hardness"]
        ['assumption: friction composite']
    """

    name: str
    value: Any
    unit: str
    source: str


class Permissible(NamedTuple):
    """Permissible values for the synthesis; `None`: no such limit.

    - `lining` (K): of the friction surface; `None`: the scene's `heat.permissible`,
      else 400 °C (assumption)
    - `back` (K): at the lining's back, where rivets or a bond hold it; 120 °C by
      default (assumption)
    - `pressure` (Pa), nominal; `power` (W/m²) of friction per area of the linings

    The permissible stress of the rim is in `EstimateData.elastic`.

    Example:
        >>> limits = sb.formulas.Permissible(pressure=0.1e6)
        >>> sb.synthesize(scene, permissible=limits).exceeded
        ['margin, pressure']
    """

    lining: float | None = None
    back: float = 273.15 + 120.0
    pressure: float | None = None
    power: float | None = None

    def settled(self, scene: Scene) -> tuple[Input, ...]:
        """Every limit, and its source."""
        known = scene.network.permissible
        lining = Input(
            "lining_permissible", 673.15, "K", "assumption: friction composite, 400 °C"
        )
        if self.lining is not None:
            lining = lining._replace(value=self.lining, source="given")
        elif known is not None:
            lining = lining._replace(value=float(known), source="scene")
        back = (
            "given"
            if self.back != Permissible().back
            else "assumption: rivets or bond, 120 °C"
        )
        rest = [
            Input(f"{name}_permissible", value, _LIMITS[name].unit, "given")
            for name, value in (("pressure", self.pressure), ("power", self.power))
            if value is not None
        ]
        return (lining, Input("back_permissible", self.back, "K", back), *rest)


#: numbers of `Permissible`, and the permissible stress
_LIMITS: dict[str, Quantity] = {
    "lining": positive("K", "permissible temperature of the friction surface"),
    "back": positive("K", "permissible temperature at the lining's back"),
    "pressure": positive("Pa", "permissible pressure of the linings"),
    "power": positive("W/m^2", "permissible friction power per area of the linings"),
    "stress": positive("Pa", "permissible stress of the rim"),
}


# --- given by the user --------------------------------------------------------------


def faults_of_data(data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """Errors of numbers that are out of range."""
    given: dict[str, Any] = {} if data is None else vars(data)
    faults = [_fault(name, given.get(name), about) for name, about in _NUMBERS.items()]
    faults += [
        _fault(f"permissible.{name}", value, _LIMITS[name])
        for name, value in limits._asdict().items()
    ]
    for name in _MATERIALS:
        if given.get(name) is not None:
            faults += faults_of_values(given[name], name)
    elastic = given.get("elastic")
    if elastic is not None:
        constants = {
            "young": positive("Pa", "Young's modulus"),
            "permissible": _LIMITS["stress"],
            "expansion": Quantity("1/K", "thermal expansion"),
        }
        faults += [
            _fault(f"elastic.{name}", getattr(elastic, name), about)
            for name, about in constants.items()
        ]
        if not -1 < elastic.poisson < 0.5:
            what = f"{elastic.poisson} is out of range"
            faults.append(Fault("elastic.poisson", what, "must be > −1 and < 0.5"))
    return [fault for fault in faults if fault is not None]


def _fault(path: str, value: Any, about: Quantity) -> Fault | None:
    if value is None or bool(about.admits(np.asarray(value, float))):  # not a NaN
        return None
    return Fault(
        path,
        f"{value}{unit_suffix(about.unit)} is out of range",
        about.hint(value, about.unit),
    )


def read_given(texts: list[str]) -> tuple[EstimateData, Permissible]:
    """Numbers and materials from texts: `rim_thickness=28 mm`, `rim=cast_iron`,
    `permissible.back=130 degC`.

    Raises `InputError` with all errors: unknown names, values that are no numbers or
    out of range.
    """
    reader = NumberReader()
    data = {}
    numbers = {}
    ranges = _NUMBERS | {
        f"permissible.{name}": about for name, about in _LIMITS.items()
    }
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not value:
            reader.fault(
                text, "is not of the form name=value", "as in rim_thickness=28 mm"
            )
        elif name in ranges:
            numbers[name] = reader.number(value, ranges[name], name, ranges[name].unit)
        elif name not in _MATERIALS:
            known = dict.fromkeys([*_NUMBERS, *_MATERIALS, *ranges])
            reader.fault(name, "unknown name", nearest(name, known, cutoff=0.4))
        elif value in LIBRARY:
            data[name] = material(value)
        else:
            hint = f"there are: {', '.join(sorted(LIBRARY))}"
            reader.fault(name, f"unknown material {value!r}", hint)
    reader.faults.report()
    limits = {
        name.removeprefix("permissible."): numbers.pop(name)
        for name in [*numbers]
        if name not in _NUMBERS
    }
    stress = limits.pop("stress", None)
    elastic = None if stress is None else ElasticMaterial(permissible=stress)
    return EstimateData(**data, **numbers, elastic=elastic), Permissible(**limits)


# --- of the scene -------------------------------------------------------------------


def start_temperature(scene: Scene, part: str = "rim") -> float:
    """Mean temperature of the rim (or `"band"`) at the start (K); 20 °C where the scene
    has no heat."""
    place = getattr(scene.network, part)
    body = None if place is None else _body(scene.network, place)
    return _mean(getattr(body, "temperature", ROOM))


def _mean(value: Any) -> float:
    """Mean of a number that may differ among linings."""
    return float(np.mean(np.asarray(value)))


def _body(heat: Heat, place: str) -> Any:
    return heat.by_name[place_of(place)[0]]


def wall_at(heat: Heat, place: str | None) -> Wall | None:
    body = None if place is None else _body(heat, place)
    return body if isinstance(body, Wall) else None


def _share_of(pair: FrictionHeat | None, T: float) -> float | None:
    if pair is None or pair.metal is None or pair.metal == pair.lining:
        return None
    return _mean(pair.partition.share(jnp.asarray(T), jnp.asarray(T)))


def _of_walls(scene: Scene) -> dict[str, Any]:
    """Materials, thicknesses and areas of rim and linings in layers."""
    heat = scene.network
    inputs = {}
    for name, area, place in (
        ("rim", "track_area", heat.rim),
        ("lining", "lining_area", heat.linings),
    ):
        wall = wall_at(heat, place)
        if wall is not None:
            inputs[name] = wall.material
            inputs[f"{name}_thickness"] = float(wall.thickness)
            inputs[area] = float(wall.area) * wall.copies
    return inputs


def _of_surroundings(scene: Scene, T: float) -> dict[str, Any]:
    """Air temperature, emissivity and coefficient of the rim's links to the air, at
    half the speed at the start."""
    brake = banded_brake(scene)
    heat = scene.network
    inputs = {}
    for link in heat.links:
        if link.a != heat.rim or not isinstance(link, Convection | Radiation):
            continue
        air = heat.by_name[link.b]
        if isinstance(air, Reservoir) and isinstance(air.temperature, np.ndarray):
            inputs["ambient"] = float(air.temperature)
        if isinstance(link, Radiation):
            inputs["emissivity"] = float(link.emissivity)
        elif isinstance(link.coefficient, AbstractCoefficient):
            v = 0.5 * abs(float(brake.pulley.radius) * float(scene.start_speed))
            ambient = jnp.asarray(inputs.get("ambient", ROOM))
            inputs["coefficient"] = float(
                link.coefficient.value(jnp.asarray(v), jnp.asarray(T), ambient)
            )
        else:
            inputs["coefficient"] = float(link.coefficient)
    return inputs


def _from_scene(scene: Scene) -> dict[str, Any]:
    inputs: dict[str, Any] = {"power": scene.power_shares}
    brake = banded_brake(scene)
    heat = scene.network
    if brake.pulley.width is not None:
        track = polished_surface(float(brake.pulley.radius), float(brake.pulley.width))
        inputs["track_area"] = brake.rims * float(track)
    for pair in brake.pairs:
        areas = brake.rubbing_part(pair).area  # of one lining, or of each
        if areas is not None:
            outer = brake.in_series and pair == "external"
            all_linings = np.sum(np.broadcast_to(areas, (brake.linings.count,)))
            name = "outer_area" if outer else "lining_area"
            inputs[name] = brake.rims * float(all_linings)
    T = start_temperature(scene)
    inputs |= _of_walls(scene) | {"share": _share_of(heat.friction, T)}
    if heat.external is not None:
        inputs["external_share"] = _share_of(
            heat.external, start_temperature(scene, "band")
        )
        if heat.external.beyond_share is not None:
            inputs["beyond_share"] = float(heat.external.beyond_share)
    return inputs | _of_surroundings(scene, T)


# --- resolved -----------------------------------------------------------------------


def settle(scene: Scene, data: EstimateData | None) -> dict[str, Input]:
    """Every input by its name: the user's value, else the scene's, else the papers' or
    an assumption.

    Raises `InputError` where linings cover more than the track, or for numbers of a
    staged brake on another.
    """
    given = dict(vars(data or EstimateData()))
    own = _from_scene(scene)
    if not scene.brake.in_series:
        for name in _STAGED:
            if given.pop(name) is not None:
                raise input_error(
                    name, "has no effect", "only a staged brake has an external pair"
                )
    inputs: dict[str, Input] = {}
    for name, value in given.items():
        source = "given"
        if value is None:
            value = own.get(name)
            source = "scene"
        if value is None and name in _ASSUMED:
            value, source = _ASSUMED[name]
        elif value is None:
            continue
        unit = _NUMBERS[name].unit if name in _NUMBERS else ""
        inputs[name] = Input(name, value, unit, source)
    brake = banded_brake(scene)
    wraps = [float(np.sum(linings.weights)) for linings in brake.bands_of_linings]
    tracks = brake.rims * len(wraps)

    def derive(name: str, value: float, source: str) -> None:
        if name not in inputs or inputs[name].value is None:
            inputs[name] = Input(name, value, _NUMBERS[name].unit, source)

    words = "one rim, 0.220 m wide (V)"
    if tracks > 1:
        words = f"{tracks} rims, 0.220 m wide each (V)"
    radius = float(brake.pulley.radius)
    derive("track_area", tracks * float(polished_surface(radius, 0.220)), words)
    track = inputs["track_area"].value
    share = min(1.0, float(np.mean(wraps)) / (2 * np.pi))
    derive("lining_area", share * track, "linings as wide as the track")
    rim, lining, band = (inputs[name].value for name in _MATERIALS)
    derive("share", float(effusivity_share(rim, lining)), "effusivities (Charron)")
    if scene.brake.in_series:
        outer = inputs["lining_area"].value * float(brake.radius) / radius
        derive("outer_area", outer, "inner faces, larger by the radius")
        share = float(effusivity_share(band, lining))
        derive("external_share", share, "effusivities (Charron)")
        derive("beyond_share", 0.0, "none (default)")
        inputs |= _band(scene, inputs)
    derive("matte_area", track, _ASSUMED["matte_area"][1])
    overlap = inputs["lining_area"].value / track
    if overlap > 1 + 1e-9:
        what = f"covers {overlap:.4g} of the track"
        hint = "the linings cannot cover more than the track"
        raise input_error("lining_area", what, hint)
    overlap = min(overlap, 1.0)
    inputs["overlap"] = Input("overlap", overlap, "1", "lining_area/track_area")
    source = "scene" if scene.heated else "20 °C"
    inputs["start"] = Input("start", start_temperature(scene), "K", source)
    return inputs


def _band(scene: Scene, inputs: dict[str, Input]) -> dict[str, Input]:
    """Thickness of a staged brake's band, from its heat capacity where that is known,
    and its temperature."""
    heat = scene.network
    thickness = inputs["band_thickness"]
    body = None if heat.band is None else _body(heat, heat.band)
    if isinstance(body, Lump) and thickness.source != "given":
        capacity = float(inputs["band"].value.volumetric_heat_capacity)
        value = _mean(body.capacity) / (capacity * inputs["outer_area"].value)
        thickness = thickness._replace(value=value, source="scene: its capacity")
    source = "20 °C" if body is None else "scene"
    start = Input("band_start", start_temperature(scene, "band"), "K", source)
    return {"band_thickness": thickness, "band_start": start}
