"""Brakes with answers in closed form: a stop on an elastic or rigid band, and a staged pair of two inertias."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._parts._scene import Duty, Initial, Scene
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley
from ..friction import AbstractFriction, ConstantFriction, Contact
from ..loads import AbstractLoad, TorqueLoad
from ..profiles import Constant, PiecewiseLinear


def stop_scene(
    n: int = 20,
    f: Any = 0.35,
    beta: Any = 13.5,
    R: Any = 0.725,
    J: Any = 800.0,
    C: Any = 2e5,
    T0: Any = 8e3,
    w0: Any = 20.0,
    load: Any = 0.0,
    end: Any = 5.0,
    law: Any = None,
    lever: Any = None,
    **initial: Any,
) -> Scene:
    """A stop with constant slack tension on `n` linings of `beta` degrees: closed forms in `closed_form`.

    `C`: stiffness, `None` for a rigid band; `law`: friction in place of `f`; `lever`: profile in place of `T0`; `load`:
    a torque, or a load.
    """
    return Scene(
        brake=Brake(
            pulley=Pulley(radius=R, inertia=J),
            band=Band(radius=R, stiffness=C),
            linings=Lining(
                angle=np.full(n, math.radians(beta)), friction=law if law is not None else ConstantFriction(f)
            ),
        ),
        duty=Duty(
            slack_tension=lever if lever is not None else Constant(T0),
            load=load if isinstance(load, AbstractLoad) else TorqueLoad(Constant(load)),
        ),
        initial=Initial(omega=w0, **initial),
        end_time=end,
    )


def closed_form(n=20, f=0.35, beta=13.5, R=0.725, J=800.0, C=2e5, T0=8e3, w0=20.0, xp: Any = math) -> dict[str, Any]:
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping time.

        t0 = T_0/(C R ω_0),   lining i: t0 + asin(χ T_0 (Π_i − 1)/(C R ω_0))/χ,   χ² = C R²/J,   t1 = that of lining n
        stop: t1 + J ω_0 cos χ(t1 − t0)/(R T_0 (Π − 1))

    `xp`: `math`, or a module with the same functions for derivatives (`jax.numpy`) or complex numbers (`numpy`).
    """
    z = xp.tan(beta * math.pi / 180 / 2)
    mu = (1 + f * z) / (1 - f * z)
    Pi = mu**n
    t0 = T0 / (C * R * w0)
    chi = xp.sqrt(C * R**2 / J)

    def limit(ratio):
        return t0 + xp.asin(chi * T0 * (ratio - 1) / (C * R * w0)) / chi

    t1 = limit(Pi)
    w1 = w0 * xp.cos(chi * (t1 - t0))
    return {
        "t0": t0,
        "limits": [limit(mu ** (i + 1)) for i in range(n)],
        "t1": t1,
        "stop": t1 + w1 * J / (R * T0 * (Pi - 1)),
        "Pi": Pi,
    }


class FallingFriction(AbstractFriction):
    """Friction with which the torque of one lining of 0.5 rad falls as `M_0/(1 + κ ω)`, for `R_b` = 1 m.

    A stop then takes `(J/M_0)(ω_0 + κ ω_0²/2)` and the angle `(J/M_0)(ω_0²/2 + κ ω_0³/3)`.
    """

    M0: jax.Array
    kappa: jax.Array
    T_0: jax.Array

    def kinetic(self, contact):
        torque = self.M0 / (1 + self.kappa * contact.v)
        r = 1 + torque / self.T_0  # Π for R_b = 1
        return (r - 1) / (r + 1) / jnp.tan(0.25)

    def static(self, contact):
        return self.kinetic(Contact(v=0.0 * contact.v))

    def faults(self, path):
        return []


def tension_for(torque: Any, n: int, f: Any, beta: Any, R: Any = 1.0) -> Any:
    """Slack tension (N) at which the torque of `n` sliding linings is `torque`: `T_0 = M/(R (Π − 1))`."""
    return torque / (R * (closed_form(n=n, f=f, beta=beta)["Pi"] - 1))


def staged_pair(
    M_i: Any = 600.0, J_1: Any = 40.0, J_2: Any = 4.0, w0: Any = 20.0, lever: Any = None, end: Any = 3.0, c: Any = 500.0
) -> Scene:
    """Pulley `J_1` and bandage `J_2` joined by an internal pair of capacity `M_i`; the band's torque is `c t`.

    The capacity comes from preload alone: a coefficient so small that the tensions add nothing to it. `lever` `(times,
    torques)`: points of the band's torque in place of `c t`. Radii are 1 m.
    """
    n, f, beta, small = 4, 0.5, 60.0, 1e-14
    brake = Brake(
        Pulley(1.0, J_1),
        Band(1.0),
        Lining(ConstantFriction(f), np.full(n, math.radians(beta))),
        Bandage(J_2, ConstantFriction(small), M_i / (n * small)),
    )
    times, torques = ([0.0, 10.0], [jnp.zeros(()), jnp.asarray(10.0 * c)]) if lever is None else lever
    tensions = jnp.stack([jnp.asarray(tension_for(torque, n, f, beta), jnp.float64) for torque in torques])
    return Scene(brake, Duty(PiecewiseLinear(times, tensions), TorqueLoad()), Initial(w0), end)
