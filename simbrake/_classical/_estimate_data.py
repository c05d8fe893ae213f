"""What the engineering estimates of a brake are made from: numbers of its scene, of its user, or of the papers."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._parts._scene import Scene, band_brake
from ..thermal._heat import FrictionHeat, Heat, PowerShares
from ..thermal._material import ROOM, Material, effusivity_share, material
from ..thermal._network import AbstractCoefficient, Convection, Lump, Radiation, Reservoir, Wall, place_of
from ._contact_estimates import polished_surface
from ._thermal_stress import ElasticMaterial


@dataclasses.dataclass(frozen=True)
class EstimateData:
    """Numbers for `estimates` that a scene need not have; `None`: from the scene, else from the papers or assumed.

    - `rim`, `lining`, `band`: materials; `rim_thickness`, `lining_thickness`, `band_thickness` (m); `track_area`,
      `lining_area` (m²), all bands together
    - `share` of the friction heat that goes into the rim; `coefficient` (W/(m²·K)) and `emissivity` of the open track;
      `ambient` (K)
    - `hardness` (Pa) of the softer surface, `spot_length` (m) for flash temperature and real contact; `matte_area` (m²)
    - `elastic`: for the thermal stress; `power`: shares of the friction power
    - of a staged brake: `outer_area` (m²) of the linings' outer faces (`lining_area`: of the inner ones),
      `external_share` of the heat of band and linings that goes into the band, `beyond_share` of it that goes into the
      rim at once (`share`: of linings and rim)
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


class Input(NamedTuple):
    """One number (or material) that the estimates stand on, and where it is from."""

    name: str
    value: Any
    unit: str
    source: str


#: taken where neither the user nor the scene says anything
_ASSUMED: dict[str, tuple[Any, str, str]] = {
    "rim": (material("steel_20L"), "", "steel 20L (V, table 1)"),
    "lining": (material("FK-24A"), "", "FK-24A (V, table 2)"),
    "band": (material("band_steel"), "", "brake band (V, table 2)"),
    "rim_thickness": (0.025, "m", "V, table 1"),
    "lining_thickness": (0.030, "m", "V"),
    "band_thickness": (0.006, "m", "V"),
    "coefficient": (20.0, "W/(m^2*K)", "assumption: convection at a turning rim"),
    "emissivity": (0.8, "1", "assumption: oxidised steel"),
    "ambient": (ROOM, "K", "assumption: 20 °C"),
    "hardness": (300e6, "Pa", "assumption: friction composite"),
    "spot_length": (50e-6, "m", "assumption: spots of 50 µm"),
    "matte_area": (None, "m^2", "assumption: the rim's bore alone"),
    "elastic": (ElasticMaterial(), "", "assumption: cast carbon steel"),
    "power": (PowerShares(), "", "all heat"),
}

_UNITS = {"track_area": "m^2", "lining_area": "m^2", "share": "1"}
_STAGED_UNITS = {"outer_area": "m^2", "external_share": "1", "beyond_share": "1"}


def _number(value: Any) -> float:
    """Mean of a number that may differ among linings."""
    return float(np.mean(np.asarray(value)))


def _body(heat: Heat, place: str) -> Any:
    return next(body for body in heat.bodies if body.name == place_of(place)[0])


def _wall_at(heat: Heat, place: str | None) -> Wall | None:
    if place is None:
        return None
    body = _body(heat, place)
    return body if isinstance(body, Wall) else None


def rim_wall(scene: Scene) -> Wall | None:
    """The rim as a wall in layers, `None` where the scene has none."""
    return _wall_at(scene.network, scene.network.rim)


def _share(pair: FrictionHeat | None, T: float) -> float | None:
    if pair is None or pair.metal is None or pair.metal == pair.lining:
        return None
    return _number(pair.partition.share(jnp.asarray(T), jnp.asarray(T)))


def start_temperature(scene: Scene, part: str = "rim") -> float:
    """Mean temperature of the rim (or `"band"`) at the start (K); 20 °C where the scene has no heat."""
    place = getattr(scene.network, part)
    return ROOM if place is None else _number(getattr(_body(scene.network, place), "temperature", ROOM))


def _of_walls(scene: Scene, found: dict[str, Any]) -> None:
    heat = scene.network
    for name, area, wall in (
        ("rim", "track_area", rim_wall(scene)),
        ("lining", "lining_area", _wall_at(heat, heat.linings)),
    ):
        if wall is not None:
            found[name], found[f"{name}_thickness"] = wall.material, float(wall.thickness)
            found[area] = float(wall.area) * wall.copies


def _faces(scene: Scene) -> dict[str, Any]:
    """Areas of the linings' faces, of one lining or of each: on a staged brake those on the rim and on the band."""
    areas = {pair: scene.brake.rubbing_part(pair).area for pair in scene.brake.pairs}
    outer = areas["external"]
    return {"lining_area": areas.get("internal", outer)} | ({"outer_area": outer} if scene.brake.in_series else {})


def _from_scene(scene: Scene) -> dict[str, Any]:
    found: dict[str, Any] = {"power": scene.power_shares}
    brake, heat = band_brake(scene), scene.network
    if brake.pulley.width is not None:
        found["track_area"] = float(polished_surface(float(brake.pulley.radius), float(brake.pulley.width)))
    for name, areas in _faces(scene).items():
        if areas is not None:
            found[name] = float(np.sum(np.broadcast_to(np.asarray(areas), (brake.linings.count,))))
    _of_walls(scene, found)
    T = start_temperature(scene)
    found["share"] = _share(heat.friction, T)
    if heat.external is not None:
        found["external_share"] = _share(heat.external, start_temperature(scene, "band"))
        if heat.external.beyond_share is not None:
            found["beyond_share"] = float(heat.external.beyond_share)
    for link in heat.links:
        if link.a != heat.rim or not isinstance(link, Convection | Radiation):
            continue
        air = next(body for body in heat.bodies if body.name == link.b)
        if isinstance(air, Reservoir) and isinstance(air.temperature, np.ndarray):
            found["ambient"] = float(air.temperature)
        if isinstance(link, Radiation):
            found["emissivity"] = float(link.emissivity)
        elif isinstance(link.coefficient, AbstractCoefficient):
            v = 0.5 * abs(float(brake.pulley.radius) * float(scene.initial.omega))
            ambient = jnp.asarray(found.get("ambient", ROOM))
            found["coefficient"] = float(link.coefficient.value(jnp.asarray(v), jnp.asarray(T), ambient))
        else:
            found["coefficient"] = float(link.coefficient)
    return found


def settle(scene: Scene, data: EstimateData | None) -> dict[str, Input]:
    """Every input by its name: what the user gave, else the scene's, else the papers' or an assumption.

    Raises `InputError` where linings would cover more than the track, or for numbers of a staged brake on another.
    """
    given, own = dict(vars(data or EstimateData())), _from_scene(scene)
    if not scene.brake.in_series:
        for name in _STAGED_UNITS:
            if given.pop(name) is not None:
                raise InputError([Fault(name, "has no effect", "only a staged brake has an external pair")])
    found: dict[str, Input] = {}
    for name, value in given.items():
        unit = _ASSUMED[name][1] if name in _ASSUMED else (_UNITS | _STAGED_UNITS)[name]
        if value is not None:
            found[name] = Input(name, value, unit, "given")
        elif own.get(name) is not None:
            found[name] = Input(name, own[name], unit, "scene")
        elif name in _ASSUMED:
            found[name] = Input(name, *_ASSUMED[name])
    if "track_area" not in found:
        area = polished_surface(float(band_brake(scene).pulley.radius), 0.220)
        found["track_area"] = Input("track_area", area, "m^2", "one rim, 0.220 m wide (V)")
    if "lining_area" not in found:
        wrap = float(np.sum(np.asarray(band_brake(scene).linings.angle)))
        area = min(1.0, wrap / (2 * np.pi)) * found["track_area"].value
        found["lining_area"] = Input("lining_area", area, "m^2", "linings as wide as the track")
    if "share" not in found:
        share = float(effusivity_share(found["rim"].value, found["lining"].value))
        found["share"] = Input("share", share, "1", "effusivities (Charron)")
    if scene.brake.in_series:
        _settle_external(scene, found)
    if found["matte_area"].value is None:
        found["matte_area"] = Input("matte_area", found["track_area"].value, "m^2", "assumption: the rim's bore alone")
    overlap = found["lining_area"].value / found["track_area"].value
    if overlap > 1 + 1e-9:
        raise InputError(
            [Fault("lining_area", f"covers {overlap:.4g} of the track", "it cannot be more than all of it")]
        )
    found["overlap"] = Input("overlap", min(overlap, 1.0), "1", "lining_area/track_area")
    found["start"] = Input("start", start_temperature(scene), "K", "scene" if scene.heated else "20 °C")
    return found


def _settle_external(scene: Scene, found: dict[str, Input]) -> None:
    """What the pair of band and linings needs beside the rest."""
    if "outer_area" not in found:
        area = (
            found["lining_area"].value * float(band_brake(scene).band.radius) / float(band_brake(scene).pulley.radius)
        )
        found["outer_area"] = Input("outer_area", area, "m^2", "inner faces, larger by the radius")
    if "external_share" not in found:
        share = float(effusivity_share(found["band"].value, found["lining"].value))
        found["external_share"] = Input("external_share", share, "1", "effusivities (Charron)")
    if "beyond_share" not in found:
        found["beyond_share"] = Input("beyond_share", 0.0, "1", "none (default)")
    heat = scene.network
    body = None if heat.band is None else _body(heat, heat.band)
    if isinstance(body, Lump) and found["band_thickness"].source != "given":
        material = found["band"].value
        per_metre = float(material.density * material.specific_heat) * found["outer_area"].value
        found["band_thickness"] = Input(
            "band_thickness", _number(body.capacity) / per_metre, "m", "scene: its capacity"
        )
    source = "20 °C" if body is None else "scene"
    found["band_start"] = Input("band_start", start_temperature(scene, "band"), "K", source)
