"""Scenes that many tests share, made by one function, and their closed forms."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np

import simbrake as sb
from simbrake.loads import AbstractLoad

# --- scenes with closed-form solutions -----------------------------------------------


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
    area=None,
    elongation=0.0,
    time=0.0,
    **parts,
):
    """A stop with constant slack tension on `n` linings of `beta` degrees: closed forms
    in `closed_form`.

    - `C`: stiffness, `None` for a rigid band; `law`: friction in place of `f`; `area`
      of each lining
    - `lever`: profile in place of `T0`; `load`: a torque, or a load
    - `elongation`, `time`: at the start; `parts`: others of the scene, as `heat`,
      `wear`, `shaft`
    """
    friction = sb.ConstantFriction(f) if law is None else law
    linings = sb.Lining(friction, np.full(n, math.radians(beta)), area)
    if not isinstance(load, AbstractLoad):
        load = sb.TorqueLoad(load)
    return sb.Scene(
        sb.Brake(sb.Pulley(R, J), sb.Band(R, C), linings),
        sb.Duty(sb.Constant(T0) if lever is None else lever, load),
        sb.Initial(w0, elongation, time),
        end,
        **parts,
    )


def stop_run(*numbers, **parts):
    """The run of such a stop."""
    return sb.simulate(stop_scene(*numbers, **parts))


def lining_ratio(f, angle):
    """Ratio of the tensions on both sides of a lining that slides (model §3),
    `(1 + f z)/(1 − f z)` with `z = tan(β/2)`."""
    fz = f * np.tan(angle / 2)
    return (1 + fz) / (1 - fz)


def closed_form(
    n=20, f=0.35, beta=13.5, R=0.725, J=800.0, C=2e5, T0=8e3, w0=20.0, xp=math
):
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping
    time.

        t0 = T_0/(C R ω_0),   lining i: t0 + asin(χ T_0 (Π_i − 1)/(C R ω_0))/χ,   χ² = C
        R²/J,   t1 = that of lining n stop: t1 + J ω_0 cos χ(t1 − t0)/(R T_0 (Π − 1))

    `xp`: `math`, or a module with the same functions for derivatives (`jax.numpy`) or
    complex numbers (`numpy`).
    """
    z = xp.tan(beta * math.pi / 180 / 2)
    mu = (1 + f * z) / (1 - f * z)
    Pi = mu**n
    t0 = T0 / (C * R * w0)
    chi = xp.sqrt(C * R**2 / J)
    limits = [
        t0 + xp.asin(chi * T0 * (mu ** (i + 1) - 1) / (C * R * w0)) / chi
        for i in range(n)
    ]
    w1 = w0 * xp.cos(chi * (limits[-1] - t0))
    return {
        "t0": t0,
        "limits": limits,
        "t1": limits[-1],
        "stop": limits[-1] + w1 * J / (R * T0 * (Pi - 1)),
        "Pi": Pi,
    }


#: tension ratio of the brake of `stop_scene`
PI = closed_form()["Pi"]
#: torque of that brake (N·m) per newton of slack tension
GAIN = 0.725 * (PI - 1)


def tension_for(torque, n, f, beta, R=1.0):
    """Slack tension (N) at which the torque of `n` sliding linings is `torque`:
    `T_0 = M/(R (Π − 1))`."""
    return torque / (R * (closed_form(n=n, f=f, beta=beta)["Pi"] - 1))


def staged_pair(M_i=600.0, J_1=40.0, J_2=4.0, w0=20.0, lever=None, end=3.0, c=500.0):
    """Pulley `J_1` and bandage `J_2` joined by an internal pair of capacity `M_i`; the
    band's torque is `c t`.

    The capacity comes from preload alone: a coefficient so small that the tensions add
    nothing to it. `lever` `(times, torques)`: points of the band's torque in place of
    `c t`. Radii are 1 m.
    """
    n = 4
    f = 0.5
    beta = 60.0
    small = 1e-14
    brake = sb.Brake(
        sb.Pulley(1.0, J_1),
        sb.Band(1.0),
        sb.Lining(f, np.full(n, math.radians(beta))),
        sb.Bandage(J_2, sb.ConstantFriction(small), M_i / (n * small)),
    )
    times, torques = (
        ([0.0, 10.0], [jnp.zeros(()), jnp.asarray(10.0 * c)])
        if lever is None
        else lever
    )
    tensions = jnp.stack(
        [
            jnp.asarray(tension_for(torque, n, f, beta), jnp.float64)
            for torque in torques
        ]
    )
    return sb.Scene(
        brake,
        sb.Duty(sb.PiecewiseLinear(times, tensions), 0.0),
        sb.Initial(w0),
        end,
    )


def replaced(part, changes):
    """A part with others in it, by their names: `"brake.linings.area"` is that of the
    linings of the brake of a scene."""
    for name, new in changes.items():
        first, _, rest = name.partition(".")
        new = replaced(getattr(part, first), {rest: new}) if rest else new
        part = dataclasses.replace(part, **{first: new})
    return part


def points(values, times=0.0, count=6):
    """A profile of `count` points, a constant by itself: scenes of one structure share
    their compiled program."""
    values = np.atleast_1d(np.asarray(values, float))
    times = np.atleast_1d(np.asarray(times, float))
    more = count - len(values)
    later = np.linspace(1e6, 2e6, more)  # after the end of every run
    return sb.PiecewiseLinear(
        np.append(times, later), np.append(values, np.full(more, values[-1]))
    )


def with_points(x, count=2):
    """A number as a profile of that many points; a profile as it is."""
    return x if isinstance(x, sb.PiecewiseLinear) else points(x, count=count)


def scene_of(lever, load=0.0, drag=0.0, **parts):
    """`stop_scene` under a lever and a load of six points each."""
    load = sb.TorqueLoad(with_points(load, 6), drag=drag)
    return stop_scene(lever=with_points(lever, 6), load=load, **parts)


def time_of(name, lining=None):
    """The time of the first such event in a run."""
    return lambda r: next(
        e.time for e in r.events if e.name == name and e.lining == lining
    )


# --- the standard brake -------------------------------------------------------------

#: the elastic stop of several cases, and its closed forms
ELASTIC = {
    "n": 10,
    "beta": 27.0,
    "f": 0.35,
    "R": 0.725,
    "J": 800.0,
    "C": 2e5,
    "w0": 20.0,
}


def elastic_stop(T0=8e3, **changes):
    return scene_of(T0, **{**ELASTIC, "end": 5.0, **changes})


def drawworks_brake(n=8, law=0.35, C=None):
    """The brake of a small drawworks, `n` linings over 270°."""
    linings = sb.uniform_linings(n, "270 deg", law)
    return sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, C), linings)


# --- many stops ---------------------------------------------------------------------

SPEED = "initial.omega"
FRICTION = "brake.linings.friction.coefficient"
LEVER = "duty.slack_tension.level"
TIMES = ("slip_onset_time", "full_slip_time", "stopping_time")


def random_points(rng, seed, least, most, opened):
    """Times and values of a lever, which is 0 for the share `opened` of its points, and
    of a load; of every third seed with jumps."""
    t = np.sort(rng.uniform(0, 3, 7))
    pull = rng.uniform(least, most, 7) * (rng.random(7) > opened)
    at = np.sort(rng.uniform(0, 3, 6))
    load = rng.uniform(-2.5e3, 2.5e3, 6) * (rng.random(6) > 0.3)
    if seed % 3 == 0:
        t[3] = t[2]
        at[2] = at[1]
    return (t, pull), (at, load)


def drawn(count, seed=1):
    """Values for that many stops."""
    rng = np.random.default_rng(seed)
    return {
        SPEED: rng.uniform(5, 30, count),
        FRICTION: rng.uniform(0.2, 0.4, count),
        LEVER: rng.uniform(5e3, 1e4, count),
    }
