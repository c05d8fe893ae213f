"""The mesh of walls: their layers cut in two, and whether the first of them are thin
enough for a heating."""

import dataclasses
import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .heat import Heat
from .materials import ROOM, layer_growth
from .network import Lump, Wall, place_of

#: error of the rise of a surface, as a share of it, from which layers are too thick,
#: and that of those proposed instead
TOO_MUCH = 0.025
GOOD = 0.015
#: depth to which heat comes, and first layer of a mesh without error, as multiples of
#: √(a t); growth of that mesh
_REACH = 8.0
_FINEST = 0.02
_GROWTH = 1.05
#: so many layers within the reach of the heat are thin enough
_MANY = 120
#: first layer, as a multiple of √(a t), down to which layers are cut to estimate their
#: error; the most nodes then
_CUT = 0.35
_MOST_NODES = 20_000
#: first layers that are proposed, as multiples of √(a t), and the most layers
_FIRST = (0.5, 0.35, 0.25, 0.18, 0.12)
_MOST = 200


def finer(heat: Heat, cuts: Mapping[str, int]) -> Heat:
    """The same network with every layer of its walls cut in two, or as often as `cuts`
    says by the name of a wall.

    Layers that grow by the ratio `r` become layers that grow by `√r`: two of them fill
    one of the old ones exactly.
    """

    def cut(wall: Wall) -> Wall:
        parts = 2 ** cuts.get(wall.name, 1)
        T = np.asarray(wall.temperature)
        T = np.repeat(T, parts) if T.ndim else T
        growth = np.asarray(wall.growth) ** (1 / parts)
        return dataclasses.replace(
            wall, layers=parts * wall.layers, growth=growth, temperature=T
        )

    return dataclasses.replace(
        heat, bodies=tuple(cut(b) if isinstance(b, Wall) else b for b in heat.bodies)
    )


def finer_values(
    heat: Heat, finer: Heat, values: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Numbers of a network by path, (runs,) or (runs, entries), as the one with finer
    layers has them."""
    found: dict[str, np.ndarray] = {}
    for path, array in values.items():
        match = re.fullmatch(
            r"heat\.bodies\[(\d+)\]\.(growth|temperature)(?:\[(\d+)\])?", path
        )
        wall = None if match is None else heat.bodies[int(match[1])]
        if match is None or not isinstance(wall, Wall):
            found[path] = array
            continue
        parts = finer.bodies[int(match[1])].count // wall.count
        if match[2] == "growth":
            found[path] = array ** (1 / parts)
        elif match[3] is not None:
            whole = path[: match.end(2)]
            node = parts * int(match[3])
            found |= {f"{whole}[{node + part}]": array for part in range(parts)}
        else:
            found[path] = np.repeat(array, parts, axis=1) if array.ndim > 1 else array
    return found


def merged(
    heat: Heat, finer: Heat, T: Float[np.ndarray, "m k"]
) -> Float[np.ndarray, "m l"]:
    """Temperatures `T` of the nodes with capacity of a network with finer layers, as
    means over those of `heat`."""
    means = []
    first = 0
    for body, fine in zip(heat.bodies, finer.bodies, strict=True):
        if not isinstance(fine, Lump | Wall):
            continue
        part = T[:, first : first + fine.count]
        first += fine.count
        if isinstance(fine, Wall):
            steps = _steps(fine).reshape(-1, fine.count // body.count)
            weights = steps / steps.sum(axis=1, keepdims=True)
            part = (
                (part.reshape(len(T), fine.copies, *steps.shape) * weights)
                .sum(axis=3)
                .reshape(len(T), -1)
            )
        means.append(part)
    return np.concatenate(means, axis=1)


def face_rise(
    steps: Float[np.ndarray, " layers"],
    diffusivity: float,
    t: Float[np.ndarray, " m+1"],
    flux: Float[np.ndarray, " m"],
    skin: float = 0.0,
) -> Float[np.ndarray, " m"]:
    """Rise of the heated face of a wall in layers at the ends of the intervals between
    the times `t`, times `λ` (W/m).

    The exact solution of the equations of `Wall` with constant properties and an
    adiabatic back.

    - `steps` (m) of the layers from the heated face on;  `flux` (W/m²) in each interval
    - `skin`: resistance of a surface layer times `λ` (m)
    """
    scale = np.sqrt(diffusivity / steps)
    between = 2 / (steps[1:] + steps[:-1])
    matrix = np.diag(between, 1) + np.diag(between, -1)
    matrix -= np.diag(matrix.sum(axis=1))
    rates, shapes = np.linalg.eigh(matrix * scale[:, None] * scale)
    front = shapes[0] * scale[0]
    spans = np.diff(t)
    x = np.minimum(rates * spans[:, None], -1e-30)
    decay = np.exp(x)
    entered = spans[:, None] * np.expm1(x) / x * front * flux[:, None]
    content = np.zeros_like(rates)
    rise = []
    for kept, new in zip(decay, entered, strict=True):
        content = kept * content + new
        rise.append(front @ content)
    return np.asarray(rise) + flux * (0.5 * steps[0] + skin)


def _steps(wall: Wall) -> Float[np.ndarray, " layers"]:
    """`Wall.steps` of a concrete wall, without JAX."""
    weights = float(wall.growth) ** wall.grades
    return float(wall.thickness) * weights / np.sum(weights)


class Coarse(NamedTuple):
    """A wall whose first layer is too thick.

    - `share`: part of the rise of its face that is an error
    - `first` layer and the `time` of heating (s)
    - `layers` that would do, the first of them `better` thick (m); 0 where none of a
      reasonable number would
    """

    share: float
    first: float
    time: float
    layers: int
    better: float


def coarse(
    wall: Wall,
    face: str | None,
    t: Float[np.ndarray, " m+1"],
    heat: Float[np.ndarray, " m+1"],
) -> Coarse | None:
    """What the layers of a wall do to the highest temperature of a face while heat
    enters it; `None`: too little.

    - `heat` that has entered until the times `t` (s), in any unit
    """
    material = wall.material
    thickness = float(wall.thickness)
    a = float(material.diffusivity)
    time = float(t[-1] - t[0])
    flux = np.diff(heat) / np.diff(t)
    depth = np.sqrt(a * time)
    skin = 0.0
    if wall.surface_layer is not None:
        T = float(np.mean(np.asarray(wall.temperature)))
        skin = float(
            wall.surface_layer.resistance(np.asarray(T)) * material.conductivity
        )

    def highest(steps: np.ndarray) -> float:
        begins = np.cumsum(steps) - steps
        return float(
            np.max(face_rise(steps[begins < _REACH * depth], a, t, flux, skin))
        )

    finest = _FINEST * depth * _GROWTH ** np.arange(_MANY)
    ends = np.cumsum(finest)
    finest = np.append(
        finest[ends < thickness],
        thickness - np.max(ends[ends < thickness], initial=0.0),
    )
    exact = highest(finest)

    def error(steps: np.ndarray) -> float:
        return 1 - exact / highest(steps)

    own = _steps(wall)[:: -1 if face == "back" else 1]
    if (
        np.sum(np.cumsum(own) < _REACH * depth) > _MANY
        or abs(share := error(own)) <= TOO_MUCH
    ):
        return None
    halves = 2 if wall.both else 1
    count = wall.layers
    while count <= _MOST:
        count += count % halves
        for first in (multiple * depth for multiple in _FIRST):
            equal = thickness / count
            growth = (
                1.0
                if first >= equal
                else layer_growth(first, thickness / halves, count // halves)
            )
            steps = _steps(
                dataclasses.replace(wall, layers=count, growth=growth, temperature=ROOM)
            )
            if abs(error(steps)) <= GOOD:
                return Coarse(share, float(own[0]), time, count, float(steps[0]))
        count += max(1, count // 8)
    return Coarse(share, float(own[0]), time, 0, 0.0)


def cuts_for(wall: Wall, face: str | None, time: float) -> int:
    """How often layers are to be cut in two, so that their error of a heating over a
    `time` (s) falls to half."""
    first = _steps(wall)[-1 if face == "back" else 0]
    limit = _CUT * np.sqrt(float(wall.material.diffusivity) * time)
    cuts = int(np.ceil(np.log2(max(first / limit, 2.0))))
    return max(1, min(cuts, int(np.log2(max(_MOST_NODES / wall.count, 2.0)))))


def heated_faces(heat: Heat) -> set[str]:
    """Faces of walls that friction heats, or that a heated place without capacity
    touches."""
    heated = {
        place
        for pair in heat.pairs
        for place in (pair.metal, pair.lining)
        if place is not None
    }
    walls = {wall.name for wall in heat.walls}
    stores = heat.storing_places
    for link in heat.links:
        ends = {link.a, link.b}
        if any(place in heated and place not in stores for place in ends):
            heated |= ends
    return {place for place in heated if place_of(place)[0] in walls}
