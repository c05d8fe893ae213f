"""One run: a brake, what acts on it, how it starts and when it ends."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from ._band import grip
from ._design import Brake, Lining
from ._duty import AbstractLoad, AbstractProfile
from ._friction import Contact
from ._quantity import Fault, InputError, Scalar, faults_of_values, leaves, quantity


class Duty(eqx.Module):
    """What acts on the brake.

    - `slack_tension`: `T_0(t) ≥ 0` in N, set by the lever at the slack end;  `load`: `M_load(t, ω)`
    """

    slack_tension: AbstractProfile
    load: AbstractLoad


class Initial(eqx.Module):
    """How the run starts.

    - `omega` `ω_0` (rad/s), positive in the braking direction;  `elongation` `x_0` (m) of an elastic band
    - `time` `t_0` (s)
    """

    omega: Scalar = quantity("rad/s", "initial speed")
    elongation: Scalar = quantity("m", "initial elongation of the band", low=0.0, default=0.0)
    time: Scalar = quantity("s", "time at the start", default=0.0)


class Scene(eqx.Module):
    """One run of a brake. Every number is an array leaf in SI units; `None` means that a piece of physics is absent.

    - `end_time` (s): the run goes on to here, also after the stop
    """

    brake: Brake
    duty: Duty
    initial: Initial
    end_time: Scalar = quantity("s", "end of the run")


def faults(scene: Scene) -> list[Fault]:
    """Everything wrong with a scene, at once. Traced numbers cannot be looked at and pass."""
    found = faults_of_values(scene)
    if found or any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return found
    found += scene.brake.faults("brake")
    found += scene.duty.slack_tension.faults("duty.slack_tension", 0.0)
    found += scene.duty.load.profile.faults("duty.load.profile", None)
    if not np.asarray(scene.end_time) > np.asarray(scene.initial.time):
        found.append(Fault("end_time", f"{float(scene.end_time):g} s is not after the start", "it must be later"))
    if found:
        return found
    if scene.brake.band.stiffness is None:
        found += [Fault(f"brake.linings.angle[{i - 1}]", locking_message(scene, i), _LOCK_HINT) for i in locked(scene)]
        if float(scene.initial.elongation) != 0.0:
            found.append(Fault("initial.elongation", "a rigid band has no elongation", "give brake.band.stiffness"))
    return found


_LOCK_HINT = "a rigid band cannot hold such a lining: make it shorter, lower its friction, or give the band a stiffness"


def check(scene: Scene) -> None:
    """Raises `InputError` with all faults of a scene; returns silently if there are none."""
    found = faults(scene)
    if found:
        raise InputError(found)


def warnings(scene: Scene) -> list[str]:
    """What a user should know of a scene that is no fault."""
    if any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return []
    return [f"self_locking: {locking_message(scene, i)}; it never slips as long as that lasts" for i in locked(scene)]


@jax.jit
def _static_grip(linings: Lining) -> Array:
    still = Contact(v=jnp.zeros(linings.count))
    return jnp.broadcast_to(grip(linings.friction.static(still), jnp.asarray(linings.angle)), (linings.count,))


def locked(scene: Scene) -> list[int]:
    """Numbers (from 1) of the linings that lock themselves with their static friction, `f tan(β/2) ≥ 1`."""
    return [int(i) + 1 for i in np.flatnonzero(np.asarray(_static_grip(scene.brake.linings)) >= 1.0)]


def locking_message(scene: Scene, i: int) -> str:
    """Why lining `i` (from 1) locks itself, in words."""
    fz = np.asarray(_static_grip(scene.brake.linings))[i - 1]
    return f"lining {i}: f·tan(β/2) = {fz:.4g} ≥ 1, the band locks itself"
