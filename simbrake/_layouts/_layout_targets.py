"""What a layout of linings is to level: per lining, at one instant of full slip or over a whole braking."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._compiling import DeviceJit
from .._parts._layout import InfeasibleLayout, equal_increment_angles, equal_load_angles
from .._parts._scene import Scene, band_brake
from .._physics._assemble import assemble
from .._physics._sliding import Grip
from .._run._linings import Rubbing, friction_work, lining_mean, lining_wear, quantity_of, wearing
from .._run._result import Result
from ..brakes._band import running_product
from ..hybrid._arrays import Array

#: what can be equal for all linings, with units at full slip and over a braking
TARGETS = {
    "tension_increment": ("N", "N"),
    "normal_load": ("N", "N"),
    "pressure": ("Pa", "Pa"),
    "wear": ("m/s", "m"),
    "friction_work": ("W", "J"),
}

#: a target's name, or a function of a `Result` to one number per lining
Target = str | Callable[[Result], Any]


def full_slip(scene: Scene) -> tuple[Rubbing, Array]:
    """Linings that all slide ahead as the run starts, and their coefficients of friction (model §2.2).

        T_i = T_0 Π_i,   N_i = (T_i + T_{i−1}) sin(β_i/2)

    at the speed and the temperatures of the start and the greatest slack tension of the lever; traceable.
    """
    system, y, _ = assemble(scene)
    grip, linings = system.grip, scene.brake.linings
    assert isinstance(grip, Grip)
    T_0 = jnp.asarray(scene.duty.lever.scale())
    v = jnp.full(linings.count, jnp.abs(jnp.asarray(scene.brake.radius) * jnp.asarray(scene.initial.omega)))
    hot = system.surfaces(y)[0]
    f = grip.coefficients(T_0, v, hot, jnp.asarray(False), static=False).f
    along = T_0 * running_product(grip.ratios(f)[0])
    before = jnp.concatenate([T_0[None], along[:-1]])
    normal = (along + before) * grip.sine
    pressure = None if linings.area is None else normal / jnp.asarray(linings.area)
    return Rubbing(along - before, normal, v, pressure, None if hot is None else hot.T), f


_full_slip_compiled = DeviceJit(full_slip)


def friction_at_start(scene: Scene) -> Float[np.ndarray, " n"]:
    """Coefficients of friction of sliding linings as the run starts."""
    return np.asarray(_full_slip_compiled(scene)[1], float)


def at_full_slip(scene: Scene, target: str, rate: Any) -> Float[Array, " n"]:
    """A target at the instant of `full_slip`: wear in m/s, friction work as power in W."""
    r, _ = full_slip(scene)
    if target == "wear":
        return wearing(rate, r)
    return quantity_of("friction_power" if target == "friction_work" else target, r)


def over_braking(result: Result, target: Target, rate: Any, pair: str) -> Float[Array, " n"]:
    """A target over a run: sums of wear and friction work, else means over the distance that a lining rubs."""
    if not isinstance(target, str):
        return jnp.asarray(target(result))
    if target == "wear":
        return lining_wear(result, rate, pair=pair)
    if target == "friction_work":
        return friction_work(result, pair=pair)
    return lining_mean(result, target, over="slip", pair=pair)


def closed_form(scene: Scene, target: Target, *, areas: bool = True) -> tuple[Float[np.ndarray, " n"] | None, str]:
    """Angles of model §2.2 that level a target at full slip, with the friction of the start; else why there are none.

    Equal friction work is equal tension increments, equal wear is equal pressure (exact for a constant wear rate);
    without `areas` the areas are free, and angles need not level what they can.
    """
    n = scene.brake.linings.count
    f, wrap = friction_at_start(scene), float(np.sum(np.asarray(band_brake(scene).linings.angle)))
    area = scene.brake.linings.area
    try:
        if target in ("tension_increment", "friction_work"):
            return equal_increment_angles(f, n, n, wrap).angle, ""
        if target == "normal_load":
            return equal_load_angles(f, n, wrap).angle, ""
        if target in ("pressure", "wear") and areas and area is not None:
            return equal_load_angles(f, n, wrap, area=np.broadcast_to(np.asarray(area, float), (n,))).angle, ""
    except InfeasibleLayout as error:
        return None, str(error)
    return None, "there is no closed form for it"
