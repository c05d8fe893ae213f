"""Friction of a scene at its start: what linings sense, and whether the brake locks itself."""

import functools

import jax.numpy as jnp
import numpy as np

from .._base._compiling import Compiled
from ..brakes.design import AbstractBrake, AbstractLinings, Bandage, unloaded
from ..friction import Reads, reads, remembers
from ..hybrid.arrays import Array
from ..thermal.network import nodes_at, place_of
from .scene import Scene, pairs_of


def read_by_linings(scene: Scene) -> Reads:
    """Inputs of the linings' friction law on the band (staged), else on the rim, as far
    as the scene has them."""
    (law, pair, *_), *_ = pairs_of(scene)
    linings = scene.brake.linings
    return reads(law, linings.count, T=pair is not None, p=linings.area is not None)


def sensed_at_start(scene: Scene, number: int = 0) -> np.ndarray | None:
    """Temperatures (K) that the friction law of a pair sees at the start, `None` where
    the scene has none.

    - `number` of the pair: the first is that on which the lever acts, the last (−1)
      that on the rim
    """
    _, pair, *_ = pairs_of(scene)[number]
    if pair is None or pair.sensor is None:
        return None
    name, face = place_of(pair.sensor)
    body = scene.network.by_name[name]
    T = np.broadcast_to(
        np.asarray(getattr(body, "temperature", np.nan), float), (body.count,)
    )
    T = T[nodes_at(body, face)]
    rims = scene.brake.linings_of_rims
    T = np.repeat(T, rims) if rims and T.size == len(rims) else T
    return np.broadcast_to(T, (scene.brake.linings.count,))


@functools.partial(Compiled, quick=True)
def _static_friction(linings: AbstractLinings, T: Array | None, t: Array) -> Array:
    f = linings.friction.static(unloaded(linings, jnp.zeros(linings.count), T, t))
    return jnp.broadcast_to(f, (linings.count,))


def remembering_at_start(
    scene: Scene,
) -> list[tuple[AbstractLinings | Bandage, np.ndarray | None]]:
    """Linings whose law of friction has internal states, with the temperatures (K) that
    it sees at the start."""
    rubbing = [scene.brake.rubbing_part(pair) for pair in scene.brake.pairs]
    return [
        (part, sensed_at_start(scene, i))
        for i, part in enumerate(rubbing)
        if remembers(part.friction)
    ]


def static_friction(scene: Scene) -> np.ndarray:
    """Coefficient up to which each lining sticks at the start, on the rim, or on the
    band of a staged brake."""
    T = sensed_at_start(scene)
    return np.asarray(_static_friction(scene.brake.linings, T, scene.initial.time))


@functools.partial(Compiled, quick=True)
def _self_locking(brake: AbstractBrake, f: Array) -> Array:
    return brake.self_locking(f)


def self_locking_ratios(scene: Scene) -> np.ndarray:
    """Self-locking ratio of each lining with its static friction at the start, of a
    band `f tan(β/2)`: locking at 1."""
    return np.asarray(_self_locking(scene.brake, static_friction(scene)))


def locked(scene: Scene) -> dict[int, str]:
    """Self-locking linings (from 1) with their static friction, of a band
    `f tan(β/2) ≥ 1`; the reason in words."""
    near = self_locking_ratios(scene)
    return {
        int(i) + 1: scene.brake.locking_words(int(i) + 1, float(near[i]))
        for i in np.flatnonzero(near >= 1.0)
    }
