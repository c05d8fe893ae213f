"""Torques on the shaft at one instant: load, capacity of the brake, and the speed at
which they balance."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import Compiled
from ..hybrid import Record, smallest
from ..hybrid.arrays import Array, Mark, ScalarArray, TwoArrays
from ..physics._brake import BrakeSystem, Capacity, State, piece_of
from ..physics.mechanism import OPEN, Mode
from ..physics.shaft import Drive, Shaft
from .programs import Instants, RunJit, at_samples, ends_of

#: a lever is settled if it moves by no more than this share of its pull in as much time
#: as the run has lasted
_AT_REST = 1e-3
#: speeds, so many on either side of the present one and up to this multiple of it, among
#: which a balance of torques is searched for
_SPEEDS = 256
_FAR = 1e4
#: halvings of the interval around the balance, and Newton steps after them, which carry
#: derivatives
_HALVINGS = 50
_DERIVATIVE_STEPS = 2


def capacity(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start: Array
) -> Capacity:
    """Load and capacity of a turning brake at the time `t` of a run that began at
    `start`."""
    lever = system.lever_at(y, mode)
    T_0, rate = jax.jvp(
        lambda t: lever.value(t, piece_of(mode, "lever")), (t,), (jnp.ones_like(t),)
    )
    if lever.controls_speed:
        follows = lever.follows(piece_of(mode, "lever"))
        T_0 = jnp.where(follows, lever.greatest(), T_0)
        rate = jnp.where(follows, 0.0, rate)
    settled = lever.is_settled(t) & (jnp.abs(rate) * (t - start) <= _AT_REST * T_0)
    for course in system.changes(y, mode).values():
        settled = settled & course.is_settled(t)
    load = driving(system, t, y.omega, y, mode)
    hanging = jnp.sign(y.omega) * system.hanging_torque(t, 0.0 * y.omega, mode, y)
    return Capacity(
        load,
        system.capacity(T_0, y.omega, y.own, system.surfaces(t, y, mode)),
        settled,
        hanging,
    )


def holding(system: BrakeSystem, t: Array, y: State, mode: Mode) -> TwoArrays:
    """Load on a pulley at rest, and the static capacity of the brake in its direction
    (N·m, both ≥ 0).

    The load is that of the instant, of an elastic rope its pull. A lever that follows
    the speed can pull to its limit.
    """
    z, surfaces = system.shaft_and_lever(t, y, mode)
    tension = z.lever_tension
    lever = system.lever_at(y, mode)
    piece = piece_of(mode, "lever")
    if lever.controls_speed:
        tension = jnp.where(lever.follows(piece), lever.greatest(), tension)
    load = system.load_torque(t, jnp.zeros_like(y.omega), mode, y)
    way = jnp.where(load < 0, -1.0, 1.0)
    pairs = system.capacity(tension, way, y.own, surfaces, static=True)
    return jnp.abs(load), smallest(pairs)


def driving(system: BrakeSystem, t: Array, omega: Array, y: State, mode: Mode) -> Array:
    """Torque (N·m) of the load in the direction of a rotation, less that of a motor and
    the other ones on the shaft.

    For a load on an elastic rope the weight counts, about which the pull of the rope
    swings.
    """
    sense = jnp.sign(omega)
    load = system.hanging_torque(t, omega, mode, y)
    shaft = system.feature(Shaft)
    motor = system.feature(Drive)
    if shaft is not None:
        rest = system.hanging_torque(t, 0.0 * omega, mode, y)
        load = load - shaft.engaged(mode).turning(
            t, omega, rest, sense, shaft.pieces(mode)
        )
    if motor is not None:
        load = load - motor.torque(system, t, omega, y, mode)
    return sense * load


def stable_speed(net: Callable[[Array], Array], speed: Array) -> ScalarArray:
    """The steady speed (rad/s) that a shaft at `speed` > 0 tends to: the next stable
    zero of `net`, `inf` without one.

    - `net(ω)`: accelerating torque (N·m) at the speed `ω`

    The sign of `net` at the present speed tells which way the shaft goes; the first zero
    that it meets is stable.
    """
    start = jax.lax.stop_gradient(speed)
    ratios = np.geomspace(1.0, _FAR, _SPEEDS + 1)
    up, down = jax.lax.stop_gradient(
        jax.vmap(jax.vmap(net))(start * jnp.asarray([ratios, 1 / ratios]))
    )
    still = up[0]
    speeds = start * jnp.where(still > 0, ratios, 1 / ratios)
    # (signed so that it is positive until the zero is met)
    values = jnp.where(still > 0, up, -down)
    met = values[1:] <= 0
    i = jnp.argmax(met)
    bracket = jnp.stack(
        [jnp.minimum(speeds[i], speeds[i + 1]), jnp.maximum(speeds[i], speeds[i + 1])]
    )

    def halve(ends: Array, _: None) -> tuple[Array, None]:
        middle = 0.5 * (ends[0] + ends[1])
        above = net(middle) > 0
        return jnp.stack(
            [jnp.where(above, middle, ends[0]), jnp.where(above, ends[1], middle)]
        ), None

    def newton(carry: TwoArrays, _: None) -> tuple[TwoArrays, None]:
        steady = carry[0]
        value, slope = jax.jvp(net, (steady,), (jnp.ones_like(steady),))
        return (steady - value / jnp.where(slope < 0, slope, -jnp.inf), slope < 0), None

    middle = jax.lax.stop_gradient(
        jnp.mean(jax.lax.scan(halve, bracket, None, length=_HALVINGS)[0])
    )
    (steady, stable), _ = jax.lax.scan(
        newton, (middle, still == 0), None, length=_DERIVATIVE_STEPS
    )
    return jnp.where(jnp.any(met) & stable & (start > 0), steady, jnp.inf)


def net_torque(
    system: BrakeSystem, t: Array, y: State, mode: Mode
) -> Callable[[Array], Array]:
    """Accelerating torque (N·m) as a function of the speed (rad/s, ≥ 0) in the sense of
    rotation: load and shaft less the sliding brake, under the tension, temperatures and
    given functions of the instant `t`."""
    z, surfaces = system.shaft_and_lever(t, y, mode)
    tension = z.lever_tension
    sense = jnp.where(y.omega < 0, -1.0, 1.0)

    def net(speed: Array) -> Array:
        omega = sense * speed
        held = smallest(system.capacity(tension, omega, y.own, surfaces))
        return driving(system, t, omega, y, mode) - jnp.where(
            mode.band == OPEN, 0.0, held
        )

    return net


def is_led(system: BrakeSystem, y: State, mode: Mode) -> Array:
    """Whether the lever follows a speed."""
    return jnp.asarray(system.lever_at(y, mode).follows(piece_of(mode, "lever")))


def steady_speed(system: BrakeSystem, t: Array, y: State, mode: Mode) -> ScalarArray:
    """Speed (rad/s, ≥ 0) at which the torques of the instant `t` balance, `inf` where
    they do not.

    With the tension, the temperatures and the given functions of that instant; `inf`
    under a lever that holds the speed.
    """
    terminal = stable_speed(net_torque(system, t, y, mode), jnp.abs(y.omega))
    return jnp.where(is_led(system, y, mode), jnp.inf, terminal)


#: a balance within this share of the speed counts as steady
_STEADY = 1e-2


class TorqueBalance(NamedTuple):
    """Torques on a turning shaft at one instant.

    - `rises` (N·m): the accelerating torque
    - `steady`: whether the torques balance within 1 % of the speed, and would do so
      again after a change of it;  `tends`: whether they balance at some higher speed

    Under a lever that follows a speed `steady` and `tends` are false: its pull would
    change with the speed.
    """

    rises: ScalarArray
    steady: Mark
    tends: Mark


def balance_of(system: BrakeSystem, t: Array, y: State, mode: Mode) -> TorqueBalance:
    net = net_torque(system, t, y, mode)
    speed = jnp.abs(y.omega)
    speeds = jnp.stack([speed, _FAR * jnp.maximum(speed, system.sizes.speed)])
    torques, slopes = jax.vmap(
        lambda speed: jax.jvp(net, (speed,), (jnp.ones_like(speed),))
    )(speeds)
    balances = (slopes[0] < 0) & (jnp.abs(torques[0]) <= _STEADY * speed * -slopes[0])
    tends = (
        torques[1] <= 0
        if system.feature(Shaft) is None
        else stable_speed(net, speed) < jnp.inf
    )
    free = ~is_led(system, y, mode)
    return TorqueBalance(torques[0], free & balances & (speed > 0), free & tends)


def can_lose_grip(system: BrakeSystem) -> bool:
    """Whether friction of a brake with one pair, whose linings act as one, can fade until
    the sliding brake is weaker than its load."""
    mechanism = system.mechanism
    fades = system.grip.reads.T or system.grip.remembers or bool(mechanism.profiles)
    return fades and len(mechanism.pairs) == 1 and not mechanism.resolved


def _capacity_at_each(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start: Array
) -> Capacity:
    return jax.vmap(capacity, in_axes=(None, 0, 0, 0, None))(system, t, y, mode, start)


_end_capacity = RunJit(capacity, quick=True)
_capacities = Compiled(_capacity_at_each, quick=True)


def end_capacity(record: Record) -> Capacity:
    """Load torque and capacity of the brake at the end of a run; meaningful where the
    pulley still turns."""
    (start, *_), end = ends_of(record)
    return _end_capacity(record.system, *end, start)


_terminal_speed = RunJit(steady_speed, quick=True)


def terminal_speed(record: Record) -> ScalarArray:
    """Steady speed (rad/s) at which the torques of the end of a run balance, `inf`
    where there is none."""
    return _terminal_speed(record.system, *ends_of(record)[1])


_balance = RunJit(balance_of, quick=True)


def runs_away(record: Record) -> Array:
    """Whether the load at the end of a run exceeds what brake and shaft give, also at
    any higher speed."""
    return (
        end_capacity(record).exceeded
        & ~_balance(record.system, *ends_of(record)[1]).tends
    )


def lowers_steadily(record: Record) -> Array:
    """Whether the torques on the shaft have brought the load to a steady speed at the
    end of a run."""
    return _balance(record.system, *ends_of(record)[1]).steady


def ends_driven(record: Record) -> Any:
    """Whether the motor runs at the end of a run."""
    motor = record.system.feature(Drive)  # pyright: ignore
    return np.False_ if motor is None else motor.follows(record.y_end, record.mode_end)


def capacities_at(record: Record, index: np.ndarray, instants: Instants) -> Capacity:
    """Load torque and capacity of the brake of a concrete record at the samples
    numbered `index`."""
    start = np.asarray(record.rows.t)[0]
    return at_samples(
        record, lambda system, *now: _capacities(system, *now, start), index, instants
    )
