"""A scene with its band turned end for end."""

import jax
import numpy as np
from jaxtyping import PyTree

from .._base._arguments import explained
from .._base._faults import InputError, input_error
from ..brakes.design import Brake
from ..friction import FrictionChange, TabulatedFade, TabulatedFriction
from ..hybrid.struct import with_fields, with_value_at
from ..parts.scene import Scene
from ..thermal.network import Lump
from ..wear import faults_of_turning, lining_bodies


@explained
def turned_scene(scene: Scene) -> Scene:
    """The scene with its band turned end for end: its quantities are counted from the
    other end.

    That is every number of `brake.linings`, of segments and gaps of the band, of the
    wear, and the heat capacity of the linings, where it has one entry per lining.
    Numbers of the places stay: temperatures at the start, free ends of the band. Raises
    `InputError` for a staged brake, whose linings ride on the pulley.

    Example:
        >>> linings = sb.Lining(0.35, [1.5, 1.5, 1.6])
        >>> brake = sb.Brake(scene.brake.pulley, scene.brake.band, linings)
        >>> turned = sb.studies.turned_scene(sb.Scene(brake, scene.duty, scene.initial, 4.0))
        >>> turned.brake.linings.angle.tolist()
        [1.6, 1.5, 1.5]
    """
    brake = scene.brake
    n = scene.brake.linings.count
    if not isinstance(brake, Brake):
        raise input_error(
            "brake", f"is a {brake.words.brake}: only one band is turned end for end"
        )
    if brake.in_series:
        raise InputError(faults_of_turning(brake))

    def reverse(part: PyTree) -> PyTree:
        # their entries are not linings
        tables = TabulatedFade | TabulatedFriction | FrictionChange

        def reversed_entries(x: PyTree) -> PyTree:
            if isinstance(x, FrictionChange):
                return x.turned(n)
            return (
                x[::-1]
                if not isinstance(x, tables)
                and np.ndim(x) == 1
                and np.shape(x)[0] in (n, n - 1)
                else x
            )

        return jax.tree.map(
            reversed_entries, part, is_leaf=lambda x: isinstance(x, tables)
        )

    turned = with_fields(
        brake, linings=reverse(brake.linings), band=reverse(brake.band)
    )
    scene = with_fields(scene, brake=turned)
    if scene.wear is not None:
        numbers = {
            name: reverse(getattr(scene.wear, name))
            for name in ("rate", "worn", "permissible")
        }
        scene = with_fields(scene, wear=with_fields(scene.wear, **numbers))
    if scene.heat is not None:
        linings = lining_bodies(scene.heat)
        bodies = tuple(
            with_fields(body, capacity=reverse(body.capacity))
            if isinstance(body, Lump) and body.name in linings
            else body
            for body in scene.heat.bodies
        )
        scene = with_value_at(scene, "heat.bodies", bodies)
    return scene
