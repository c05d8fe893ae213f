"""What the engineering estimates of a brake are made from: numbers of its scene, of its user, or of the papers."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._quantity import Fault, InputError
from .._parts._heat import Heat
from .._parts._links import AbstractCoefficient, Convection, Radiation
from .._parts._material import ROOM, Material, effusivity_share, material
from .._parts._network import Reservoir, Wall, place_of
from .._parts._power_shares import PowerShares
from .._parts._scene import Scene
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


def _number(value: Any) -> float:
    """Mean of a number that may differ among linings."""
    return float(np.mean(np.asarray(value)))


def _wall_at(heat: Heat, place: str | None) -> Wall | None:
    if place is None:
        return None
    body = next(body for body in heat.bodies if body.name == place_of(place)[0])
    return body if isinstance(body, Wall) else None


def rim_wall(scene: Scene) -> Wall | None:
    """The rim as a wall in layers, `None` where the scene has none."""
    return None if scene.heat is None else _wall_at(scene.heat, scene.heat.rim)


def _share(heat: Heat, T: float) -> float | None:
    pair = heat.friction
    if pair is None or pair.metal is None or pair.metal == pair.lining:
        return None
    return _number(pair.partition.share(jnp.asarray(T), jnp.asarray(T)))


def start_temperature(scene: Scene) -> float:
    """Mean temperature of the rim at the start (K); 20 °C where the scene has no heat."""
    heat = scene.heat
    if heat is None or heat.rim is None:
        return ROOM
    body = next(body for body in heat.bodies if body.name == place_of(heat.rim)[0])
    return _number(getattr(body, "temperature", ROOM))


def _of_walls(scene: Scene, found: dict[str, Any]) -> None:
    heat = scene.heat
    assert heat is not None
    for name, area, wall in (
        ("rim", "track_area", rim_wall(scene)),
        ("lining", "lining_area", _wall_at(heat, heat.linings)),
    ):
        if wall is not None:
            found[name], found[f"{name}_thickness"] = wall.material, float(wall.thickness)
            found[area] = float(wall.area) * wall.copies


def _from_scene(scene: Scene) -> dict[str, Any]:
    found: dict[str, Any] = {"power": scene.power_shares}
    brake, heat = scene.brake, scene.heat
    if brake.pulley.width is not None:
        found["track_area"] = float(polished_surface(float(brake.pulley.radius), float(brake.pulley.width)))
    if brake.linings.area is not None:
        found["lining_area"] = float(np.sum(np.broadcast_to(np.asarray(brake.linings.area), (brake.linings.count,))))
    if heat is None:
        return found
    _of_walls(scene, found)
    T = start_temperature(scene)
    found["share"] = _share(heat, T)
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

    Raises `InputError` where linings would cover more than the track.
    """
    given, own = vars(data or EstimateData()), _from_scene(scene)
    found: dict[str, Input] = {}
    for name, value in given.items():
        unit = _ASSUMED[name][1] if name in _ASSUMED else _UNITS[name]
        if value is not None:
            found[name] = Input(name, value, unit, "given")
        elif own.get(name) is not None:
            found[name] = Input(name, own[name], unit, "scene")
        elif name in _ASSUMED:
            found[name] = Input(name, *_ASSUMED[name])
    if "track_area" not in found:
        area = polished_surface(float(scene.brake.pulley.radius), 0.220)
        found["track_area"] = Input("track_area", area, "m^2", "one rim, 0.220 m wide (V)")
    if "lining_area" not in found:
        wrap = float(np.sum(np.asarray(scene.brake.linings.angle)))
        area = min(1.0, wrap / (2 * np.pi)) * found["track_area"].value
        found["lining_area"] = Input("lining_area", area, "m^2", "linings as wide as the track")
    if "share" not in found:
        share = float(effusivity_share(found["rim"].value, found["lining"].value))
        found["share"] = Input("share", share, "1", "effusivities (Charron)")
    if found["matte_area"].value is None:
        found["matte_area"] = Input("matte_area", found["track_area"].value, "m^2", "assumption: the rim's bore alone")
    overlap = found["lining_area"].value / found["track_area"].value
    if overlap > 1 + 1e-9:
        raise InputError(
            [Fault("lining_area", f"covers {overlap:.4g} of the track", "it cannot be more than all of it")]
        )
    found["overlap"] = Input("overlap", min(overlap, 1.0), "1", "lining_area/track_area")
    found["start"] = Input("start", start_temperature(scene), "K", "20 °C" if scene.heat is None else "scene")
    return found
