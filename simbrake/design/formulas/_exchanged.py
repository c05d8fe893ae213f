"""A scene with its rim, its linings, or both of another material."""

import dataclasses
from typing import Any

import numpy as np
from jax.core import Tracer

from ..._base._arguments import explained
from ..._base._faults import Fault, InputError
from ...parts.scene import Scene
from ...thermal.heat import (
    EffusivityPartition,
    FlashTemperature,
    FrictionHeat,
    Heat,
    TransmissionPartition,
)
from ...thermal.materials import Material
from ...thermal.network import AbstractLink, Body, Conductance, Lump, place_of
from .inputs import wall_at


@explained
def with_materials(
    scene: Scene, rim: Material | None = None, lining: Material | None = None
) -> Scene:
    """The scene with its rim, its linings, or both of another material; the sizes stay.

    What changes with the `rim`: the wall at the place `heat.rim`; lumps that hang on it
    by a given `Conductance`, which are cast in one piece with it (flange, rebords,
    disc): capacities by the ratio of `ρ c`, conductances by that of `λ`; the flash
    temperature of spots that run over it. With the `lining`: the wall at
    `heat.linings`. With either: shares of the friction heat that follow from materials
    (`EffusivityPartition`, and the conductivities of a `TransmissionPartition`; its
    heat transfer coefficients and the lining's surface layer stay, and so do given
    shares).

    Raises `InputError` where the scene does not say what they are made of: a lump has
    no material.

    Example:
        >>> heated = sb.read_scene(sb.files.shipped("heated"))
        >>> other = sb.with_materials(heated, rim=sb.thermal.material("cast_iron"))
        >>> float(heated.heat.bodies[0].material.density), float(other.heat.bodies[0].material.density)
        (7850.0, 7200.0)
    """
    heat = scene.network
    named = named_materials(heat)
    faults = [
        Fault(f"heat.{part}", "has no material in this scene", "make it a Wall")
        for part, new, has_material in zip(
            ("rim", "linings"), (rim, lining), named, strict=True
        )
        if new is not None and not has_material
    ]
    if faults:
        raise InputError(faults)
    if not scene.heated:
        return scene
    if rim is not None:
        heat = _of_rim(heat, rim)
    wall = wall_at(heat, heat.linings)
    if lining is not None and wall is not None:
        heat = _with_bodies(
            heat, {wall.name: dataclasses.replace(wall, material=lining)}
        )
    pairs: dict[str, Any] = {
        name: _shared(heat, getattr(heat, name), rim, lining)
        for name in ("friction", "external")
        if getattr(heat, name) is not None
    }
    return dataclasses.replace(scene, heat=dataclasses.replace(heat, **pairs))


def named_materials(heat: Heat) -> tuple[bool, bool]:
    """Whether a network says what the rim, and what the linings are made of: as a wall,
    or in a share of the heat."""
    shared = any(
        isinstance(pair.partition, EffusivityPartition | TransmissionPartition)
        for pair in heat.pairs
    )
    return wall_at(heat, heat.rim) is not None, shared or wall_at(
        heat, heat.linings
    ) is not None


def _with_bodies(heat: Heat, others: dict[str, Body]) -> Heat:
    return dataclasses.replace(
        heat, bodies=tuple(others.get(body.name, body) for body in heat.bodies)
    )


def _of_rim(heat: Heat, new: Material) -> Heat:
    wall = wall_at(heat, heat.rim)
    assert wall is not None
    old = wall.material
    others: dict[str, Body] = {wall.name: dataclasses.replace(wall, material=new)}
    links: list[AbstractLink] = []
    own = {
        place_of(place)[0] for place in (heat.linings, heat.band) if place is not None
    }
    by_name = heat.by_name
    stored = new.volumetric_heat_capacity / old.volumetric_heat_capacity
    led = new.conductivity / old.conductivity
    for link in heat.links:
        ends = [place_of(link.a)[0], place_of(link.b)[0]]
        there = by_name[ends[1 - ends.index(wall.name)]] if wall.name in ends else None
        if (
            isinstance(link, Conductance)
            and isinstance(there, Lump)
            and there.name not in own
        ):
            others[there.name] = dataclasses.replace(
                there, capacity=there.capacity * stored
            )
            link = dataclasses.replace(link, value=link.value * led)
        links.append(link)
    flash = heat.flash
    if flash is not None and _runs_over(flash, old):
        flash = dataclasses.replace(
            flash, conductivity=new.conductivity, diffusivity=new.diffusivity
        )
    return dataclasses.replace(
        _with_bodies(heat, others), links=tuple(links), flash=flash
    )


def _runs_over(flash: FlashTemperature, rim: Material) -> bool:
    """Whether the spots of the flash temperature run over the rim: they have its
    numbers."""
    numbers = (flash.conductivity, flash.diffusivity, rim.conductivity, rim.diffusivity)
    if any(isinstance(number, Tracer) for number in numbers):
        # a law of spots that run over the lining has the lining's numbers, which one
        # rarely writes
        return True
    own, of_rim = np.reshape(np.asarray(numbers, float), (2, 2))
    return np.allclose(own, of_rim, rtol=1e-9)


def _shared(
    heat: Heat, pair: FrictionHeat, rim: Material | None, lining: Material | None
) -> FrictionHeat:
    """A friction pair with the share of the heat that follows from the new
    materials."""
    law = pair.partition
    changes = {}
    wall = wall_at(heat, heat.rim)
    on_rim = (
        pair.metal is not None
        and wall is not None
        and place_of(pair.metal)[0] == wall.name
    )
    if isinstance(law, EffusivityPartition):
        changes = ({"metal": rim} if rim is not None and on_rim else {}) | (
            {"lining": lining} if lining else {}
        )
    elif isinstance(law, TransmissionPartition):
        if rim is not None:
            changes["rim_conductivity"] = rim.conductivity
        if lining is not None:
            changes["lining_conductivity"] = lining.conductivity
    if not changes:
        return pair
    return dataclasses.replace(pair, partition=dataclasses.replace(law, **changes))
