"""The stages of a staged brake in a run: when each lasted, what it cost, and why one did not occur."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._hybrid import Record
from .._hybrid._arrays import Array
from .._parts._band import grip, product, running_product, tension_ratio
from .._parts._design import Brake, under_a_band, unloaded
from .._physics._modes import BandMode, Label


class Stage(NamedTuple):
    """A time in which the friction pairs of a staged brake kept their parts (model §4): times in s, energies in J."""

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

    def as_dict(self) -> dict[str, Any]:
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


def onset_bracket(brake: Brake, inertia: Any, T_external: Any = None, T_internal: Any = None) -> tuple[Array, Array]:
    """Growth of the two torques between which the internal pair decides, per unit of slack tension (m).

        Λ = T_0 R_b (Π − 1) J/(J + J_b) + …,   M_int = T_0 R Σ f_i (Π_i + Π_{i−1}) s_i + …                (model §4)

    The internal pair can slide only if the first is greater: K's condition that external friction exceeds internal.
    """
    bandage, linings = brake.rubbing_part("internal"), brake.linings
    angle, still = jnp.asarray(linings.angle), jnp.zeros(linings.count)
    mu = tension_ratio(grip(linings.friction.kinetic(unloaded(linings, still, T_external)), angle))[0]
    Pi = running_product(mu)
    loads = (Pi + jnp.concatenate([jnp.ones(1), Pi[:-1]])) * jnp.sin(angle / 2)
    f = bandage.friction.static(unloaded(bandage, still, T_internal))
    J, J_b = jnp.asarray(inertia), jnp.sum(jnp.asarray(bandage.inertia))
    drive = brake.band.radius * (product(mu) - 1) * J / (J + J_b)
    return drive, jnp.asarray(brake.pulley.radius) * jnp.sum(f * loads)


def internal_slip_tension(
    brake: Brake, inertia: Any, load_torque: Any = 0.0, T_external: Any = None, T_internal: Any = None
) -> Float[Array, ""]:
    """Slack tension `T_on` (N) at which the internal pair of a staged brake begins to slide, at any rate of the lever.

        T_on = [R Σ f_i N_pre,i − J_b M_load/(J + J_b)] / [R_b (Π − 1) J/(J + J_b) − R Σ f_i (Π_i + Π_{i−1}) s_i]

    - `inertia` `J` (kg·m²) of the pulley and all that turns with it, `load_torque` `M_load` (N·m)
    - `T_external`, `T_internal`: temperatures (K) for laws that look at them; laws are taken at slip speed 0

    `inf` where the bracket is not positive: the bandage then turns with the pulley to the end. From model §4 (after K).
    Raises `InputError` for a brake without a band, `ValueError` for one without a bandage.
    """
    if not under_a_band(brake).in_series:
        raise ValueError("only a staged brake (with a bandage) has an internal pair")
    bandage = brake.rubbing_part("internal")
    still = jnp.zeros(brake.linings.count)
    f = bandage.friction.static(unloaded(bandage, still, T_internal))
    J, J_b = jnp.asarray(inertia), jnp.sum(jnp.asarray(bandage.inertia))
    preload = brake.pulley.radius * jnp.sum(f * bandage.preload * jnp.ones(brake.linings.count))
    drive, grip_growth = onset_bracket(brake, J, T_external, T_internal)
    slips = drive > grip_growth
    tension = (preload - J_b * load_torque / (J + J_b)) / jnp.where(slips, drive - grip_growth, 1.0)
    return jnp.where(slips, jnp.maximum(tension, 0.0), jnp.inf)


def stages_of(record: Record, labels: list[Label]) -> list[Stage]:
    """Stages of a concrete run in order; what lasted no time is left out.

    Nothing slides and nothing moves in a held brake: what a band lets go at once on the restart counts as the next
    stage's.
    """
    n = int(record.count)
    t, states = np.asarray(record.rows.t)[: n + 1], record.states
    ledger = jax.tree.map(lambda column: np.asarray(column)[: n + 1], states.ledger)
    system: Any = record.system
    shares = system.shares
    hot = 1.0 if shares is None else float(shares.heat)
    names = [stage_of(label) for label in labels]
    heats = [hot * friction for friction in ledger.friction]
    found: list[Stage] = []
    start, at_once = 0, np.zeros(4)  # heat and work of jumps
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
            if found and found[-1].name == names[start] and found[-1].end == began:
                last = found.pop()
                began, spent = last.start, spent + np.array(last[3:])
            found.append(Stage(names[start], began, float(t[i]), *spent.tolist()))
        start = i
    return found


def absent_stages(
    brake: Brake, inertia: float, load_torque: float, seen: set[str], greatest: float, hot: tuple[Any, Any]
) -> list[dict[str, str]]:
    """The stages of a staged stop that a run did not have, each with the reason.

    `seen`: names of those it had; `greatest` slack tension (N); `hot`: temperatures of both pairs at the start.
    """
    found = []
    if not seen & {"stage_2", "stage_3"}:
        drive, growth = (float(x) for x in onset_bracket(brake, inertia, *hot))
        tension = float(internal_slip_tension(brake, inertia, load_torque, *hot))
        if drive <= growth:
            reason = (
                "the external friction does not exceed the internal: per newton of slack tension the band holds the "
                f"bandage with {drive:.4g} N·m, the rim drives it with up to {growth:.4g} N·m; it turns with the pulley"
            )
        elif greatest < tension:
            reason = (
                f"the internal pair slides from a slack tension of {tension / 1e3:.5g} kN on, "
                f"the lever gave at most {greatest / 1e3:.5g} kN"
            )
        else:
            reason = "the pulley came to rest before the internal pair had to slide"
        found.append({"name": "stage_2", "reason": reason})
    if "stage_3" not in seen:
        reason = "the internal pair never slid"
        if "stage_2" in seen:
            reason = "the bandage did not come to rest while the pulley turned in it"
        found.append({"name": "stage_3", "reason": reason})
    if "stage_1" not in seen:
        found.append({"name": "stage_1", "reason": "the internal pair slid from the start"})
    return found
