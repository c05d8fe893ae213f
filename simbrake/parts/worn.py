"""A scene with the wear before its run."""

from typing import cast

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from .._base._arguments import explained
from .._base._quantity import Scalar
from ..brakes.design import Brake
from ..hybrid.arrays import Array, Vector
from ..hybrid.struct import with_fields, with_value_at
from ..thermal.heat import Heat, TransmissionPartition
from ..thermal.network import Conductance, Lump
from ..wear import Delayed, Wear, lining_bodies
from .scene import Duty, Scene


def feeds_back(scene: Scene) -> bool:
    """Whether wear before a run changes the scene."""
    wear = scene.wear
    return wear is not None and (
        wear.geometry or wear.heat or wear.take_up_speed is not None
    )


def _worn(scene: Scene, wear: Wear) -> tuple[Vector, Vector]:
    """Thickness worn off before the run, and the sizes of the linings: under a band
    their angles."""
    weights = scene.brake.linings.weights
    return jnp.broadcast_to(jnp.asarray(wear.worn), weights.shape), weights


@explained
def worn_scene(scene: Scene) -> Scene:
    """The scene with the effects of the wear `h_i` before it (`Wear.worn`); unchanged
    without feedback.

        geometry        R_b' = R_b − h̄,  h̄ = Σ β_i h_i/Σ β_i        the band follows the linings inwards
        take_up_speed   T_0'(t) = T_0(t − Δ/u),  Δ = Σ β_i h_i = h̄ Σ β_i    the lever first takes up the slack Δ of the
                        band's length, with its end at the speed u
        heat            lumps of linings: C' = C s_i, conductances from them G' = G/s_i, s_i = 1 − h_i/δ;
                        `TransmissionPartition`: δ_l' = δ_l − h̄.  Walls of linings: all
                        layers by s_i (`walls_left`)

    The band circle is one, so that its radius falls by the mean; the linkage is not
    readjusted in between. Faces do not grow or shrink: the inner one stays on the rim.

    Example:
        >>> wear = sb.Wear(5e-14, worn="5 mm", geometry=True)
        >>> worn = sb.studies.worn_scene(sb.Scene(scene.brake, scene.duty, scene.initial, 4.0, wear=wear))
        >>> round(float(worn.brake.band.radius), 4)
        0.618
    """
    wear = scene.wear
    if wear is None or not feeds_back(scene):
        return scene
    h, angle = _worn(scene, wear)
    slack = jnp.sum(angle * h)
    # no other feeds wear back
    band_brake = cast(Brake, scene.brake)
    duty = cast(Duty, scene.duty)
    if wear.geometry:
        radius = jnp.asarray(band_brake.band.radius) - slack / jnp.sum(angle)
        scene = with_value_at(scene, "brake.band.radius", radius)
    if wear.take_up_speed is not None:
        lever = Delayed(duty.slack_tension, slack / wear.take_up_speed)
        scene = with_value_at(scene, "duty.slack_tension", lever)
    if wear.heat and scene.heat is not None:
        scene = with_fields(scene, heat=_thinner(scene.heat, h, angle, wear.thickness))
    return scene


def _left(h: Array, angle: Array, thickness: Scalar | None, count: int) -> Array:
    """Remaining share of the thickness of each of `count` bodies (all linings in one:
    their mean)."""
    share = 1 - h / jnp.asarray(thickness)
    return (
        share if count > 1 else jnp.sum(share * angle, keepdims=True) / jnp.sum(angle)
    )


def walls_left(scene: Scene) -> dict[str, Array]:
    """Remaining share `s_i = 1 − h_i/δ` of the thickness of every wall of linings, for
    each of its copies.

    Layers are thinner by it: `C' = C s_i`, resistance `s_i δ/λ`.
    """
    if scene.wear is None or not scene.wear.heat or scene.heat is None:
        return {}
    h, angle = _worn(scene, scene.wear)
    walls = [
        wall for wall in scene.heat.walls if wall.name in lining_bodies(scene.heat)
    ]
    return {wall.name: _left(h, angle, wall.thickness, wall.copies) for wall in walls}


def _thinner(heat: Heat, h: Array, angle: Array, thickness: Scalar | None) -> Heat:
    bodies = list(heat.bodies)
    links = list(heat.links)
    for i, body in enumerate(bodies):
        if not isinstance(body, Lump) or body.name not in lining_bodies(heat):
            continue
        share = _left(h, angle, thickness, body.count)
        share = share if body.count > 1 else share[0]
        bodies[i] = with_fields(body, capacity=jnp.asarray(body.capacity) * share)
        for k, link in enumerate(links):
            if isinstance(link, Conductance) and body.name in (link.a, link.b):
                links[k] = with_fields(link, value=jnp.asarray(link.value) / share)
    heat = with_fields(heat, bodies=tuple(bodies), links=tuple(links))

    def thin(part: PyTree) -> PyTree:
        if not isinstance(part, TransmissionPartition):
            return part
        mean = jnp.sum(h * angle) / jnp.sum(angle)
        return with_fields(
            part, lining_thickness=jnp.asarray(part.lining_thickness) - mean
        )

    return jax.tree.map(
        thin, heat, is_leaf=lambda x: isinstance(x, TransmissionPartition)
    )
