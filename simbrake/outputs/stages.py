"""Stages of a staged brake: from when the internal pair slides, and what each pair did."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._corners import greater
from .._base._table import JsonObject
from ..brakes.band import band_torque, grip, product, running_product, tension_ratio
from ..brakes.design import Bandage, Brake, under_a_band, unloaded
from ..hybrid import Record, largest
from ..hybrid.arrays import Array, NumberOrArray, ScalarArray, Vector
from ..physics.mechanism import BandMode, Label


class Stage(NamedTuple):
    """A time in which the friction pairs of a staged brake kept their parts (model §4):
    times in s, energies in J.

    Example:
        >>> round(sb.results.Stage("stage_2", 0.2, 0.26, 24e3, 12e3, 0.0, 14e3).duration, 4)
        0.06
    """

    name: str
    start: float
    end: float
    heat_external: float
    heat_internal: float
    lever_work: float
    load_work: float

    @property
    def duration(self) -> float:
        return self.end - self.start

    def as_dict(self) -> JsonObject:
        return {**self._asdict(), "duration": self.duration}


#: in words, what the pairs do in each stage
STAGES = {
    "open": "the band does not touch",
    "stage_1": "the band slides on the bandage, which rides with the pulley",
    "stage_2": "both pairs slide",
    "stage_3": "the bandage is at rest, the pulley slides in it",
    "held": "both pairs stick, the pulley is at rest",
}


def stage_of(label: Label) -> str:
    """Name of the stage for a mode of the brake."""
    if label.band == BandMode.OPEN:
        return "open"
    if label.rests:
        return "held"
    if label.inner == 0:
        return "stage_1"
    return "stage_3" if label.band == BandMode.HELD else "stage_2"


def onset_bracket(
    brake: Brake,
    inertia: NumberOrArray,
    T_external: NumberOrArray | None = None,
    T_internal: NumberOrArray | None = None,
    omega: NumberOrArray = 0.0,
) -> tuple[ScalarArray, Vector, Vector, ScalarArray]:
    """Growth of the two torques between which the internal pair decides, per unit of
    slack tension (m); the torque of preload and centrifugal force (N·m); and the share
    of the load torque that goes into the bandage.

        Λ = T_0 R_b (Π − 1) J/(J + J_b) + …                                                                (model §4)
        M_int = Σ max(0, T_0 R f_i (Π_i + Π_{i−1}) s_i + R f_i (N_pre,i − m_i r_m ω²))

    The terms of the second are of each lining. The internal pair can slide only if the
    first grows more: K's condition that external friction exceeds internal.
    """
    bandage = brake.rubbing_part("internal")
    linings = brake.linings
    assert isinstance(bandage, Bandage)
    angle = jnp.asarray(linings.angle)
    still = jnp.zeros(linings.count)
    mu = tension_ratio(
        grip(linings.friction.kinetic(unloaded(linings, still, T_external)), angle)
    )[0]
    Pi = running_product(mu)
    loads = (Pi + jnp.concatenate([jnp.ones(1), Pi[:-1]])) * jnp.sin(angle / 2)
    f = bandage.friction.static(unloaded(bandage, still, T_internal))
    J = jnp.asarray(inertia) / brake.rims
    J_b = jnp.sum(jnp.asarray(bandage.inertia))
    R = jnp.asarray(brake.pulley.radius)
    drive = (
        band_torque(jnp.asarray(brake.band.radius), jnp.ones(()), product(mu))
        * J
        / (J + J_b)
    )
    thrust = bandage.centrifugal_force(jnp.asarray(omega))
    pressed = (
        jnp.asarray(bandage.preload)
        if thrust is None
        else jnp.asarray(bandage.preload) - thrust
    )
    return drive, R * f * loads, R * f * pressed, J_b / (J + J_b)


@explained
def internal_slip_tension(
    brake: Brake,
    inertia: NumberOrArray,
    load_torque: NumberOrArray = 0.0,
    T_external: NumberOrArray | None = None,
    T_internal: NumberOrArray | None = None,
    omega: NumberOrArray | None = None,
) -> ScalarArray:
    """Slack tension `T_on` (N) at which the internal pair of a staged brake begins to
    slide, at any rate of the lever.

        T_on = [R Σ f_i (N_pre,i − m_i r_m ω²) − J_b M_load/(J + J_b)]
               / [R_b (Π − 1) J/(J + J_b) − R Σ f_i (Π_i + Π_{i−1}) s_i]

    Both sums are over the linings that touch the rim at this tension.

    - `inertia` `J` (kg·m²) of the pulley and all that turns with it, `load_torque`
      `M_load` (N·m): both over `n` on `n` alike rims
    - `T_external`, `T_internal`: temperatures (K) for laws that look at them; laws are
      taken at slip speed 0
    - `omega` `ω` (rad/s): speed at that instant, which depends on the rate of the
      lever; needed where the linings have masses

    `inf` where the bracket of all linings is not positive: the bandage then turns with
    the pulley to the end, but for what its centrifugal force lifts off. From model §4
    (after K). Raises `InputError` for a brake without a band, `ValueError` for one
    without a bandage, or without `omega` where it is needed.

    Example:
        >>> bandage = sb.Bandage(40.0, 0.2, preload=200.0)
        >>> brake = sb.Brake(scene.brake.pulley, scene.brake.band, scene.brake.linings, bandage)
        >>> round(float(sb.results.internal_slip_tension(brake, 1240.0)), 2)
        149.28
    """
    if not under_a_band(brake).in_series:
        raise ValueError("only a staged brake (with a bandage) has an internal pair")
    bandage = brake.rubbing_part("internal")
    assert isinstance(bandage, Bandage)
    if omega is None and bandage.mass is not None:
        raise ValueError(
            "the grip of linings with a mass depends on the speed: give omega"
        )
    speed = 0.0 if omega is None else omega
    drive, grips, pressed, share = onset_bracket(
        brake, inertia, T_external, T_internal, speed
    )
    slips = drive > jnp.sum(grips)
    # tensions from which on each lining touches the rim; Λ − M_int is concave in T_0,
    # so that its root is the largest of those with the linings that touch at any of
    # these tensions
    touch = jnp.where(pressed < 0, -pressed / jnp.where(grips > 0, grips, 1.0), 0.0)
    touches = touch <= jnp.append(touch, 0.0)[:, None]
    left = (
        jnp.sum(jnp.where(touches, pressed, 0.0), axis=1)
        - share * load_torque / brake.rims
    )
    tension = left / jnp.where(
        slips, drive - jnp.sum(jnp.where(touches, grips, 0.0), axis=1), 1.0
    )
    return jnp.where(slips, greater(largest(tension), 0.0), jnp.inf)


def stages_of(record: Record, labels: list[Label]) -> list[Stage]:
    """Stages of a concrete run in order; what lasted no time is left out.

    Nothing slides and nothing moves in a held brake: what a band lets go at once on the
    restart counts as the next stage's.
    """
    n = int(record.count)
    t = np.asarray(record.rows.t)[: n + 1]
    states = record.states
    ledger = jax.tree.map(lambda column: np.asarray(column)[: n + 1], states.ledger)
    shares = record.system.grip.shares  # pyright: ignore
    hot = 1.0 if shares is None else float(shares.heat)
    names = [stage_of(label) for label in labels]
    heats = [hot * friction for friction in ledger.friction]
    stages: list[Stage] = []
    # heat and work of jumps
    start = 0
    at_once = np.zeros(4)
    for i in range(1, n + 1):
        if names[i] == names[start] and i < n:
            continue
        work = [*heats, ledger.lever_work, ledger.load_work]
        spent = at_once + np.array([each[i] - each[start] for each in work])
        at_once = np.zeros(4)
        if i < n and (t[i] == t[start] or names[start] == "held"):
            spent, at_once = at_once, spent
        if t[i] > t[start]:
            began = float(t[start])
            if stages and stages[-1].name == names[start]:
                last = stages.pop()
                began = last.start
                spent = spent + np.array(last[3:])
            stages.append(Stage(names[start], began, float(t[i]), *spent.tolist()))
        start = i
    return stages


def absent_stages(
    brake: Brake,
    inertia: float,
    load_torque: float,
    stages: set[str],
    greatest: float,
    hot: tuple[Array | None, ...],
) -> list[dict[str, str]]:
    """The stages of a staged stop that a run did not have, each with the reason, for
    linings without centrifugal force.

    `stages`: names of those it had; `greatest` slack tension (N); `hot`: temperatures
    of both pairs at the start.
    """
    absent = []
    (T_external, T_internal) = hot
    if not stages & {"stage_2", "stage_3"}:
        drive, growth, *_ = (
            float(jnp.sum(x))
            for x in onset_bracket(brake, inertia, T_external, T_internal)
        )
        tension = float(
            internal_slip_tension(
                brake, inertia, load_torque, T_external, T_internal, omega=0.0
            )
        )
        if drive <= growth:
            reason = (
                "the external friction does not exceed the internal: per newton of "
                f"slack tension the band holds the bandage with {drive:.4g} N·m, the "
                f"rim drives it with up to {growth:.4g} N·m; it turns with the pulley"
            )
        elif greatest < tension:
            reason = (
                f"the internal pair slides from a slack tension of {tension / 1e3:.5g} kN on, "
                f"the lever gave at most {greatest / 1e3:.5g} kN"
            )
        else:
            reason = "the pulley came to rest before the internal pair had to slide"
        absent.append({"name": "stage_2", "reason": reason})
    if "stage_3" not in stages:
        reason = "the internal pair never slid"
        if "stage_2" in stages:
            reason = "the bandage did not come to rest while the pulley turned in it"
        absent.append({"name": "stage_3", "reason": reason})
    if "stage_1" not in stages:
        slid = bool(stages & {"stage_2", "stage_3"})
        reason = (
            "the internal pair slid from the start"
            if slid
            else "the pulley never turned with its bandage"
        )
        absent.append({"name": "stage_1", "reason": reason})
    return absent
