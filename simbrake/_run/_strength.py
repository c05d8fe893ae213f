"""Stresses of band and anchor, force and travel of the lever, temperatures: their allowable values in a scene."""

from collections.abc import Mapping
from typing import Any

from .._base._table import number
from .._parts._scene import Scene
from ..brakes._design import Brake, Strength
from ..hybrid import Record
from ..hybrid._arrays import Array
from ..loads import Lever
from ._series import thickness


def strength_of(scene: Scene) -> Strength | None:
    """Cross-sections of the band and its anchor, where the scene has them."""
    return scene.brake.band.strength if isinstance(scene.brake, Brake) else None


def lever_of(scene: Scene) -> Lever | None:
    """The lever of the driller, where the scene has its arms."""
    return scene.duty.lever if isinstance(scene.duty.lever, Lever) else None


def stress(tension: Array, scene: Scene, *, anchor: bool = False) -> Array:
    """Stress (Pa) of the band, or of its anchor, under a tension (N)."""
    parts: Any = strength_of(scene)
    return tension / (parts.anchor_area if anchor else parts.band_area)


def lever_travel(record: Record, scene: Scene) -> Array:
    """Travel of the lever's end (m) at the end of a run, from that of the released band of new linings:

        s = (l/a) (x + Σ β_i (h_i + δ))

    `x` (m): elongation of the band, `h_i`: all that the linings have lost, `δ`: clearance of the released band
    """
    lever: Any = lever_of(scene)
    brake, end = scene.brake, record.y_end
    x, gap = getattr(end.own, "x", None), lever.clearance
    if scene.wear is not None:
        gap = gap + scene.wear.worn + (0.0 if end.worn is None else thickness(end.worn))
    slack = (brake.linings.angle * gap).sum()  # pyright: ignore
    return lever.arm / lever.slack_arm * (slack if x is None else slack + x)


#: metric → unit, and its allowable value in a scene (`None`: not given)
_ALLOWABLE = {
    "max_band_stress": ("Pa", lambda scene: getattr(strength_of(scene), "band_stress", None)),
    "max_anchor_stress": ("Pa", lambda scene: getattr(strength_of(scene), "anchor_stress", None)),
    "max_lever_force": ("N", lambda scene: getattr(lever_of(scene), "greatest_force", None)),
    "lever_travel": ("m", lambda scene: getattr(lever_of(scene), "greatest_travel", None)),
}
#: metric → place whose permissible temperature limits it
HOT = {
    "peak_rim_temperature": "rim",
    "peak_lining_temperature": "linings",
    "peak_band_temperature": "band",
    "peak_lining_outer_temperature": "outer",
}


def allowable_values(scene: Scene) -> dict[str, float]:
    """Allowable values of metrics, in SI, of the parts of a scene that have them, temperatures among them."""
    found = {name: allowable(scene) for name, (_, allowable) in _ALLOWABLE.items()}
    hot = scene.network.permissible_at
    found |= {name: hot[place] for name, place in HOT.items() if place in hot}
    return {name: float(most) for name, most in found.items() if most is not None}


def limits_exceeded(scene: Scene, metrics: Mapping[str, float | None]) -> list[str]:
    """Warnings of forces, stresses and travels above their allowable values; temperatures have events instead."""
    found = []
    for name, most in allowable_values(scene).items():
        value = metrics.get(name)
        if name in _ALLOWABLE and value is not None and value > most:
            unit = _ALLOWABLE[name][0]
            words = name.removeprefix("max_").replace("_", " ")
            share = f"{value / most:.4g} × the allowable {number(most, unit)}"
            found.append(f"over_limit: {words} {number(value, unit)} is {share}")
    return found
