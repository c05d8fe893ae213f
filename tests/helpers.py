"""What several tests need: quick solves, event lists, standard scenes and their closed forms."""

import functools
import math
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import simbrake as sb
from simbrake._hybrid import LANDED, STOPPED

DOPRI8 = sb.ExplicitRungeKutta(diffrax.Dopri8())
TSIT5 = sb.ExplicitRungeKutta(diffrax.Tsit5())


def settings(rtol: float = 1e-12, max_events: int = 100_000, **kwargs: Any) -> sb.Settings:
    return sb.Settings(rtol=jnp.asarray(rtol), max_events=jnp.asarray(max_events), **kwargs)


@functools.partial(eqx.filter_jit)
def solve(system, y0, mode0, t0, t1, settings, method=DOPRI8):
    return sb.hybridsolve(system, y0, mode0, t0, t1, method, settings)


def arrays(system):
    """The same system with every number as an array."""
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float64) if isinstance(x, float) else x, system)


def event_times(record) -> np.ndarray:
    """Times of events that a guard made."""
    n = int(record.count)
    kind = np.asarray(record.rows.kind)[:n]
    i = np.flatnonzero((kind >= LANDED) & (kind != STOPPED))
    return np.asarray(record.rows.t)[i + 1]


def event_guards(record) -> list[int]:
    n = int(record.count)
    kind = np.asarray(record.rows.kind)[:n]
    i = np.flatnonzero((kind >= LANDED) & (kind != STOPPED))
    return [int(g) for g in np.asarray(record.rows.guard)[i]]


def traced_times(record, count: int):
    """The first `count` event times, traced."""
    kind = record.rows.kind
    i = jnp.flatnonzero((kind == LANDED), size=count, fill_value=0)
    return record.rows.t[i + 1]


def stop_scene(
    n=20,
    f=0.35,
    beta=13.5,
    R=0.725,
    J=800.0,
    C=2e5,
    T0=8e3,
    w0=20.0,
    load=0.0,
    end=5.0,
    law=None,
    lever=None,
    **initial,
) -> sb.Scene:
    """A stop with constant slack tension: closed forms in `closed_form`."""
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=R, inertia=J),
            band=sb.Band(radius=R, stiffness=C),
            linings=sb.Lining(
                angle=np.full(n, math.radians(beta)), friction=law if law is not None else sb.ConstantFriction(f)
            ),
        ),
        duty=sb.Duty(
            slack_tension=lever if lever is not None else sb.Constant(T0), load=sb.TorqueLoad(sb.Constant(load))
        ),
        initial=sb.Initial(omega=w0, **initial),
        end_time=end,
    )


def closed_form(n=20, f=0.35, beta=13.5, R=0.725, J=800.0, C=2e5, T0=8e3, w0=20.0, xp: Any = math) -> dict[str, Any]:
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping time."""
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
