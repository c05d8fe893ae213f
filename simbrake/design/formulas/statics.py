"""Classical stops by statics alone: a standard brake under full slip, a staged brake
stage after stage."""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ...brakes.band import grip, running_product, tension_ratio
from ...brakes.design import Bandage, unloaded
from ...friction import SurfaceState, memory_at_start
from ...hybrid.arrays import Array
from ...outputs.stages import internal_slip_tension
from ...parts.at_start import sensed_at_start
from ...parts.scene import Scene, band_brake, banded_brake
from ...physics.shaft import Shaft
from ...physics.staged import InternalPair, RimInputs

#: points of a quadrature over a speed between two lift-offs
_NODES = 24


class ClassicalStop(NamedTuple):
    """A stop of a rigid band that slides throughout, with constant torques (SI
    units)."""

    ratio: float  # Π, tight over slack tension
    torque: float  # M_b, N·m
    time: float  # s
    angle: float  # rad
    work: float  # friction work, J
    power: float  # initial friction power, W


def friction_at_start(scene: Scene, pair: str = "external") -> Float[np.ndarray, " n"]:
    """Sliding coefficient of a pair at the initial speed and temperatures, without
    pressure."""
    brake = banded_brake(scene)
    n = scene.brake.linings.count
    inside = pair == "internal"
    part = brake.rubbing_part(pair)
    radius = brake.pulley.radius if inside else brake.radius
    sensed = sensed_at_start(scene, -1) if inside else sensed_at_start(scene)
    contact = unloaded(
        part, jnp.full(n, abs(float(radius) * float(scene.start_speed))), sensed
    )
    return np.broadcast_to(np.asarray(part.friction.kinetic(contact)), (n,))


def load_and_inertia(scene: Scene) -> tuple[float, float]:
    """Load torque (N·m) at the start at half the speed, less the other torques on the
    shaft, and inertia (kg·m²) of all that the pulley moves."""
    load = scene.duty.load
    load = load if load.layers is None else load.on_layer(load.layers.first_layer())
    start = jnp.asarray(float(scene.initial.time))
    piece: Any = jnp.asarray(
        0 if (first := scene.duty.load_piece(start)) is None else first, jnp.int32
    )
    zero = jnp.zeros(())
    ropes = load.ropes(zero, piece)
    more = load.added_inertia(piece)
    inertia = (
        float(scene.brake.inertia)
        + float(load.inertia())
        + (0.0 if more is None else float(more))
        + (0.0 if ropes is None else float(ropes.inertia))
    )
    half = jnp.asarray(float(scene.start_speed) / 2)
    torque = load.whole_torque(start, half, piece, zero, zero)
    if scene.shaft:
        pieces: Any = tuple(
            jnp.asarray(law.profile.first_piece(start), jnp.int32)
            for law in scene.shaft
        )
        at_rest = load.whole_torque(start, zero, piece, zero, zero)
        torque = torque - Shaft(scene.torques).turning(
            start, half, at_rest, jnp.sign(half), pieces
        )
    return float(torque), inertia


def classical_stop(scene: Scene) -> ClassicalStop | None:
    """The stop of a standard brake by statics alone; `None` where there is none.

        Π = ∏ (1 + f_i z_i)/(1 − f_i z_i),   M_b = n R_b T_0 (Π − 1) on n alike rims                (Z-12…14)
        ω̇ = −(M_b − M_load)/J,   t = ω_0/|ω̇|,   φ = ω_0 t/2,   W = M_b φ                           (Z-17, 18)

    `T_0` is the maximum lever tension, load torque and inertia are those of the start
    (the torque at half the speed). Unlike bands with the shares `s_j` of `T_0` have
    `Π = Σ s_j Π_j`. There is none without speed at the start, with a lever that holds
    the speed, where a lining is self-locking, or where the load outweighs the brake.

    Example:
        >>> stop = sb.formulas.classical_stop(scene)
        >>> round(float(stop.time), 4), round(float(stop.work), 1)
        (1.2577, 508008.7)
    """
    brake = banded_brake(scene)
    lever = scene.lever
    omega = float(scene.start_speed)
    f = jnp.asarray(friction_at_start(scene))
    if omega <= 0 or lever.controls_speed:
        return None
    if np.any(np.asarray(brake.self_locking(f)) >= 1):
        return None
    load, inertia = load_and_inertia(scene)
    torque = float(brake.torque(jnp.asarray(lever.scale()), f))
    arm = float(brake.radius) * float(lever.scale())
    ratio = 1 + torque / (brake.rims * arm) if arm > 0 else 1.0
    if torque <= load:
        return None
    time = inertia * omega / (torque - load)
    return ClassicalStop(
        float(ratio),
        torque,
        time,
        omega * time / 2,
        torque * omega * time / 2,
        torque * omega,
    )


class PairStop(NamedTuple):
    """Sliding of one friction pair in a stop (SI units): 0 throughout where it never
    slides."""

    time: float  # s, sliding
    angle: float  # rad, of one body in the other
    work: float  # friction work, J
    omega: float  # rad/s, maximum speed of one body in the other


class StagedStop(NamedTuple):
    """A stop of a staged brake with a rigid band under a constant lever tension (SI
    units).

    `times`: durations of the stages 1, 2, 3 (s); `torques`: brake torque on the pulley
    in each (N·m), of stage 2, in which the centrifugal force falls, the mean
    """

    ratio: float  # Π of the external pair, tight over slack tension
    # T_on, N: slack tension from which the internal pair slides at the start; inf where
    # it never does
    onset: float
    external_torque: float  # M_ext, N·m, while the band slides on the bandage
    internal_torque: float  # M_int, N·m, while both pairs slide
    times: tuple[float, float, float]
    torques: tuple[float, float, float]
    angle: float  # rad, of the pulley
    external: PairStop
    internal: PairStop

    @property
    def time(self) -> float:
        return sum(self.times)

    @property
    def work(self) -> float:
        return self.external.work + self.internal.work

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of the friction work of the external and the internal pair."""
        return self.external.work / self.work, self.internal.work / self.work


def onset_at(scene: Scene, omega: float) -> float:
    """`T_on` (N) of a staged brake at the speed `omega` (rad/s), with load, inertia and
    temperatures of the start."""
    load, J = load_and_inertia(scene)
    hot = sensed_at_start(scene), sensed_at_start(scene, -1)
    return float(internal_slip_tension(band_brake(scene), J, load, *hot, omega=omega))


class _Grip(NamedTuple):
    """The internal pair under a band that slides: inputs of its friction, slack tension
    and tensions along the band."""

    pair: InternalPair
    held: RimInputs
    tensions: tuple[Array, Array]

    def at(self, omega_b: Array) -> Array:
        """`M_int` (N·m) at the speed of the bandage."""
        turning = self.pair.turning(
            self.held, omega_b, jnp.zeros(self.pair.count, jnp.int32)
        )
        lifted = (self.pair.balance(*self.tensions, turning) < 0).astype(jnp.int32)
        return self.pair.capacity(
            *self.tensions, self.pair.turning(self.held, omega_b, lifted)
        )

    def deceleration(self, torque: float, omega: float) -> tuple[float, float]:
        """Time (s) and angle (rad) in which the bandage comes to rest from `omega`
        under the `torque` of the band, over its inertia; infinite where it does not.

            t/J_b = ∫ dω_b/(M_ext − M_int(ω_b)),   φ_b/J_b = ∫ ω_b dω_b/(M_ext −
            M_int(ω_b))

        By Gauss–Legendre quadrature between the speeds at which linings lift off.
        """
        thrust = self.pair.bandage.centrifugal_force(jnp.asarray(1.0))
        speeds = np.zeros(0)
        if thrust is not None:
            pressed = np.asarray(self.pair.balance(*self.tensions, self.held))
            speeds = np.sqrt(pressed / np.maximum(np.asarray(thrust), 1e-300))
        edges = np.concatenate([[0.0], np.sort(speeds[speeds < omega]), [omega]])
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        half = 0.5 * np.diff(edges)[:, None]
        middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
        at = np.ravel(middle + half * nodes)
        weight = np.ravel(half * weights)
        left = torque - np.asarray(jax.vmap(self.at)(jnp.asarray(at)))
        if np.min(left) <= 0:
            return math.inf, math.inf
        return float(np.sum(weight / left)), float(np.sum(weight * at / left))


def classical_staged_stop(scene: Scene) -> StagedStop | None:
    """The stop of a staged brake by statics and constant torques; `None` where there is
    none (model §4, after K).

        M_ext = R_b T_0 (Π − 1) M_int(T_n, ω_b) = R Σ f_i max(0, (T_i + T_{i−1})
        sin(β_i/2) + N_pre,i − m_i r_m ω_b²)

    With `T_0 ≤ T_on(ω_0)` the bandage rides with the pulley to the end (stage 1 alone);
    else it does so for no time:

        stage 1:  ω̇ = −(M_ext − M_load)/(J + J_b)
        stage 2:  ω̇_b = −(M_ext − M_int)/J_b,   ω̇ = −(M_int − M_load)/J,   until ω_b = 0
                  t_2 = J_b ω_0/(M_ext − M_int),  φ_b = ω_0 t_2/2  without masses, else by quadrature over ω_b
        stage 3:  R_b (T_n − T_0) = M_int(T_n, 0) = M_3,   ω̇ = −(M_3 − M_load)/J

    Friction works `W_ext = M_ext φ_b` and `W_int = ∫ M_int (ω − ω_b) dt + M_3 φ_3`.
    `T_0` is the maximum lever tension, load torque, inertia and coefficients those of
    the start; a bandage on springs counts as one body. Of `n` alike rims each stops its
    part `M_load/n`, `J/n`; torques and works of the result are those of all. There is
    none without speed at the start, with a lever that holds the speed, where a lining
    is self-locking, or where the load outweighs what brakes the pulley.

    Example:
        >>> linings = sb.uniform_linings(8, "270 deg", 0.35)
        >>> brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), linings, sb.Bandage(40.0, 0.2, preload=200.0))
        >>> staged = sb.Scene(brake, scene.duty, sb.Initial(24.0), 4.0)
        >>> [round(float(t), 3) for t in sb.formulas.classical_staged_stop(staged).times]
        [0.0, 0.06, 5.797]
    """
    rims = band_brake(scene).rims
    stop = _staged_stop_of_one_rim(scene)
    if stop is None or rims == 1:
        return stop
    external, internal = (
        pair._replace(work=rims * pair.work) for pair in (stop.external, stop.internal)
    )
    torques = (rims * stop.external_torque, rims * stop.internal_torque)
    (M_1, M_2, M_3) = stop.torques
    all_rims = rims * M_1, rims * M_2, rims * M_3
    return stop._replace(
        external=external,
        internal=internal,
        external_torque=torques[0],
        internal_torque=torques[1],
        torques=all_rims,
    )


def _staged_stop_of_one_rim(scene: Scene) -> StagedStop | None:
    brake = band_brake(scene)
    lever = scene.lever
    omega = float(scene.start_speed)
    bandage = brake.rubbing_part("internal")
    assert isinstance(bandage, Bandage)
    if omega <= 0 or lever.controls_speed:
        return None
    angle = jnp.asarray(brake.linings.angle)
    mu, locked = tension_ratio(grip(jnp.asarray(friction_at_start(scene)), angle))
    if np.any(np.asarray(locked)):
        return None
    load, J = (whole / brake.rims for whole in load_and_inertia(scene))
    T_0 = jnp.asarray(float(lever.scale()))
    J_b = float(np.sum(bandage.inertia))
    pair = InternalPair(bandage, jnp.asarray(brake.pulley.radius), jnp.sin(angle / 2))
    T_inner = sensed_at_start(scene, -1)
    sliding = jnp.asarray(float(brake.pulley.radius) * omega)
    T_inner = None if T_inner is None else jnp.asarray(T_inner)
    surface = SurfaceState(T_inner, memory_at_start(bandage.friction, pair.count))
    held = RimInputs(sliding, surface, jnp.asarray(False))
    arm = jnp.asarray(brake.band.radius)
    Pi = running_product(mu)
    M_ext = float(arm * T_0 * (Pi[-1] - 1))
    onset = onset_at(scene, omega)
    on_rim = _Grip(pair, held, (T_0, T_0 * Pi))
    t_2, phi_b = (J_b * each for each in on_rim.deceleration(M_ext, omega))
    # the mean by the impulse of the bandage
    M_int = (
        M_ext - J_b * omega / t_2
        if math.isfinite(t_2)
        else float(on_rim.at(jnp.asarray(omega)))
    )
    known = (float(Pi[-1]), onset, M_ext, M_int)
    if float(T_0) <= onset:
        if M_ext <= load:
            return None
        time = (J + J_b) * omega / (M_ext - load)
        angle = 0.5 * omega * time
        at_rest = PairStop(0.0, 0.0, 0.0, 0.0)
        external = PairStop(time, angle, M_ext * angle, omega)
        return StagedStop(
            *known, (time, 0.0, 0.0), (M_ext, 0.0, 0.0), angle, external, at_rest
        )
    ahead = jnp.asarray(1, jnp.int32)
    piece = pair.holding_piece(T_0, mu, ahead, arm, held)
    M_3 = float(arm * (pair.holding_tension(T_0, mu, piece, ahead, arm, held) - T_0))
    if not math.isfinite(t_2) or load >= M_3:
        return None
    left = omega - (M_int - load) / J * t_2
    if left <= 0:  # impossible while the internal pair slips, within rounding
        return None
    t_3 = J * left / (M_3 - load)
    # J (ω − ω_0) + J_b (ω_b − ω_0) = (M_load − M_ext) t in stage 2
    phi_2 = (
        omega * t_2 + ((load - M_ext) * t_2**2 / 2 + J_b * (omega * t_2 - phi_b)) / J
    )
    phi_3 = 0.5 * left * t_3
    external = PairStop(t_2, phi_b, M_ext * phi_b, omega)
    inside = phi_2 - phi_b + phi_3
    # what stage 2 takes from the motion, less the work on the band
    taken = 0.5 * J * (omega**2 - left**2) + 0.5 * J_b * omega**2 + load * phi_2
    internal = PairStop(t_2 + t_3, inside, taken - external.work + M_3 * phi_3, left)
    times = (0.0, t_2, t_3)
    torques = (M_ext, M_int, M_3)
    return StagedStop(*known, times, torques, phi_2 + phi_3, external, internal)
