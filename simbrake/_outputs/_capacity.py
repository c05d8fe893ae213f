"""Results of a brake beside its states: its capacity, the speed of a load that nothing holds, the hook."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._physics._brake import LEVER, LOAD, BrakeNow, BrakeSystem, BrakeUnderRope, Capacity, State, piece_of
from .._physics._mechanism import OPEN, Mode
from ..hybrid import smallest
from ..hybrid._arrays import Array

#: up to this share of the tension the lever may still move, at its present rate over the time of the run so far
_AT_REST = 1e-3
#: speeds at which a balance of torques is looked for: so many on either side, up to that many times the present one
_SPEEDS, _FAR = 256, 1e4
#: halvings of an interval around it, and Newton steps after them, which carry derivatives
_HALVINGS, _CARRY = 50, 2


def capacity(system: BrakeSystem, t: Array, y: State, mode: Mode, start: Array) -> Capacity:
    """Load and capacity of a turning brake at the time `t` of a run that began at `start`."""
    lever = system.lever_at(y, mode)
    T_0, rate = jax.jvp(lambda t: lever.value(t, piece_of(mode, LEVER)), (t,), (jnp.ones_like(t),))
    if lever.controls_speed:
        follows = lever.follows(piece_of(mode, LEVER))
        T_0, rate = jnp.where(follows, lever.greatest(), T_0), jnp.where(follows, 0.0, rate)
    settled = lever.no_more_turns(t) & (jnp.abs(rate) * (t - start) <= _AT_REST * T_0)
    for profile in system.mechanism.profiles:
        settled = settled & profile.no_more_turns(t)
    load = driving(system, t, y.omega, mode)
    return Capacity(load, system.mechanism.capacity(T_0, y.omega, y.own, system.surfaces(t, y, mode)), settled)


def holding(system: BrakeSystem, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
    """Load on a pulley at rest, and the static capacity of the brake in its direction (N·m, both ≥ 0).

    The load is that of the instant, of an elastic rope its pull.
    """
    *_, surfaces, (tension, _) = system.given(t, y, mode)
    load = system.load_torque(t, jnp.zeros_like(y.omega), mode, y)
    way = jnp.where(load < 0, -1.0, 1.0)
    pairs = system.mechanism.capacity(tension, way, y.own, surfaces, static=True)
    return jnp.abs(load), smallest(pairs)


def driving(system: BrakeSystem, t: Array, omega: Array, mode: Mode) -> Array:
    """Torque (N·m) of the load in the direction of a rotation, less the other torques on the shaft.

    Of a load on an elastic rope that of its weight, about which the pull of the rope swings.
    """
    sense, load = jnp.sign(omega), system.load_torque(t, omega, mode)
    if system.shaft is not None:
        rest = system.load_torque(t, 0.0 * omega, mode)
        load = load - system.shaft.turning(t, omega, rest, sense, system.shaft_pieces(mode))
    return sense * load


def stable_speed(net: Callable[[Array], Array], speed: Array) -> Float[Array, ""]:
    """The steady speed (rad/s) that a shaft at `speed` > 0 tends to: the next stable zero of `net`, `inf` without one.

    - `net(ω)`: accelerating torque (N·m) at the speed `ω`

    From the present speed the shaft moves the way of `net`; the first zero that it meets is stable.
    """
    start, still = jax.lax.stop_gradient(speed), jax.lax.stop_gradient(net(speed))
    ratios = jnp.asarray(np.geomspace(1.0, _FAR, _SPEEDS + 1))
    speeds = start * jnp.where(still > 0, ratios, 1 / ratios)
    # (signed so that it is positive until the zero is met)
    values = jax.lax.stop_gradient(jax.vmap(net)(speeds)) * jnp.where(still > 0, 1.0, -1.0)
    met = values[1:] <= 0
    i = jnp.argmax(met)
    here = jnp.stack([jnp.minimum(speeds[i], speeds[i + 1]), jnp.maximum(speeds[i], speeds[i + 1])])

    def halve(ends: Array, _: None) -> tuple[Array, None]:
        middle = 0.5 * (ends[0] + ends[1])
        above = net(middle) > 0
        return jnp.stack([jnp.where(above, middle, ends[0]), jnp.where(above, ends[1], middle)]), None

    found, stable = jax.lax.stop_gradient(jnp.mean(jax.lax.scan(halve, here, None, length=_HALVINGS)[0])), still == 0
    for _ in range(_CARRY):
        value, slope = jax.jvp(net, (found,), (jnp.ones_like(found),))
        found, stable = found - value / jnp.where(slope < 0, slope, -jnp.inf), slope < 0
    return jnp.where(jnp.any(met) & stable & (start > 0), found, jnp.inf)


def terminal_speed(system: BrakeSystem, t: Array, y: State, mode: Mode) -> Float[Array, ""]:
    """Speed (rad/s, ≥ 0) at which the torques of the instant `t` balance, `inf` where they do not.

    With the tension, the temperatures and the given functions of that instant; `inf` under a lever that holds the
    speed.
    """
    lever, piece = system.lever_at(y, mode), piece_of(mode, LEVER)
    led = lever.follows(piece) if lever.controls_speed else False
    T_0, surfaces, sense = jnp.asarray(lever.value(t, piece)), system.surfaces(t, y, mode), jnp.sign(y.omega)

    def net(speed: Array) -> Array:
        omega = sense * speed
        held = smallest(system.mechanism.capacity(T_0, omega, y.own, surfaces))
        return driving(system, t, omega, mode) - jnp.where(mode.band == OPEN, 0.0, held)

    return jnp.where(led, jnp.inf, stable_speed(net, jnp.abs(y.omega)))


# --- the hook, and loss of grip ---------------------------------------------------------------------------------------


class HookNow(NamedTuple):
    """The hook: travel downwards since the start (m), its speed (m/s), and the force on it, `m (g − a)` (N).

    On an elastic rope also its stretch (m; below 0 it is slack), and the weight on the hook (N).
    """

    travel: Array
    speed: Array
    force: Array
    stretch: Any = None
    weight: Any = None


def hook_of(system: BrakeSystem, y: State, mode: Mode, z: BrakeNow) -> HookNow | None:
    """The hook, where the load hangs on one."""
    load, travelled = system.load.on_layer(mode.layer), system.load.travelled(y.phi)
    hanging, travel = load.hanging(piece_of(mode, LOAD)), load.travel()
    if hanging is None or travel is None or travelled is None:
        return None
    if isinstance(system, BrakeUnderRope):
        position = travelled + system.stretched(y, mode)
        return HookNow(position, y.hook.speed, z.rope.force, z.rope.stretch, z.rope.weight)
    mass, weight = hanging
    return HookNow(jnp.asarray(travelled), y.omega * travel, weight - mass * travel * z.contact.alpha)


def can_lose_grip(system: BrakeSystem) -> bool:
    """Whether fade can leave a sliding brake of one pair, whose linings act as one, weaker than its load."""
    reads = system.grip.reads.T or system.grip.remembers or bool(system.mechanism.profiles)
    return reads and len(system.mechanism.pairs) == 1 and not system.mechanism.resolved
