"""One run: a brake, what acts on it, how it starts and when it ends."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from ._band import grip
from ._design import Brake, Lining
from ._duty import AbstractProfile, SpeedHold
from ._friction import Contact
from ._heat import Heat
from ._loads import AbstractLoad
from ._network import nodes_at, place_of
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
    - `heat`: the thermal network, `None` where temperatures do not matter
    """

    brake: Brake
    duty: Duty
    initial: Initial
    end_time: Scalar = quantity("s", "end of the run")
    heat: Heat | None = None


def faults(scene: Scene) -> list[Fault]:
    """Everything wrong with a scene, at once. Traced numbers cannot be looked at and pass."""
    found = faults_of_values(scene)
    if found or any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return found
    found += scene.brake.faults("brake")
    found += _faults_of_heat(scene)
    if isinstance(scene.duty.slack_tension, SpeedHold):
        law, heat = scene.brake.linings.friction, scene.heat
        if scene.brake.band.stiffness is not None:
            found.append(
                Fault("brake.band.stiffness", "a lever that holds the speed needs a rigid band", "leave it out")
            )
        if law.pressure_dependent or (heat is not None and heat.flash is not None):
            found.append(Fault("duty.slack_tension", "cannot hold the speed with an implicit coefficient of friction"))
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


def _faults_of_heat(scene: Scene) -> list[Fault]:
    law, heat = scene.brake.linings.friction, scene.heat
    n = int(np.size(scene.brake.linings.angle))
    found = [] if heat is None else heat.faults("heat", n)
    if found:
        return found
    if heat is None or heat.friction is None:
        if law.temperature_dependent:
            hint = "give the scene a heat part whose `friction` names the places that the heat enters"
            found.append(Fault("heat", "is missing, but the friction law looks at the temperature", hint))
        return found
    if heat.flash is not None:
        if scene.brake.band.segments is not None:
            found.append(Fault("heat.flash", "is not modelled for a band in segments", "leave out one of the two"))
        if not law.temperature_dependent:
            found.append(Fault("heat.flash", "has no effect", "the friction law does not look at the temperature"))
        if heat.flash.hardness is None and scene.brake.linings.area is None:
            found.append(Fault("brake.linings.area", "is missing", "the flash temperature looks at the pressure"))
    bounds, T = law.temperature_range(), sensed_at_start(scene)
    if bounds is not None and T is not None and not (float(bounds[0]) <= T.min() and T.max() <= float(bounds[1])):
        table = f"{float(bounds[0]):g}…{float(bounds[1]):g} K"
        what = f"the table of {table} does not cover the start at {T.min():g}…{T.max():g} K"
        found.append(Fault("brake.linings.friction", what, "extend the table; it is not extrapolated"))
    return found


def sensed_at_start(scene: Scene) -> np.ndarray | None:
    """Temperatures that the linings' friction law sees at the start (K), concrete values."""
    heat, n = scene.heat, int(np.size(scene.brake.linings.angle))
    if heat is None or heat.friction is None or heat.friction.sensor is None:
        return None
    name, face = place_of(heat.friction.sensor)
    body = next(body for body in heat.bodies if body.name == name)
    T = np.broadcast_to(np.asarray(getattr(body, "temperature", np.nan), float), (body.count,))
    return np.broadcast_to(T[nodes_at(body, face)], (n,))


@jax.jit
def _static_grip(linings: Lining, T: Any) -> Array:
    n = linings.count
    still = Contact(v=jnp.zeros(n), T=T, p=jnp.zeros(n))
    return jnp.broadcast_to(grip(linings.friction.static(still), jnp.asarray(linings.angle)), (linings.count,))


def locked(scene: Scene) -> list[int]:
    """Numbers (from 1) of the linings that lock themselves with their static friction, `f tan(β/2) ≥ 1`."""
    return [
        int(i) + 1 for i in np.flatnonzero(np.asarray(_static_grip(scene.brake.linings, sensed_at_start(scene))) >= 1.0)
    ]


def locking_message(scene: Scene, i: int) -> str:
    """Why lining `i` (from 1) locks itself, in words."""
    fz = np.asarray(_static_grip(scene.brake.linings, sensed_at_start(scene)))[i - 1]
    return f"lining {i}: f·tan(β/2) = {fz:.4g} ≥ 1, the band locks itself"
