"""Scenes of resolved chains that several tests share, their runs, and what one looks at
in them."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from bandage_scenes import profile

import simbrake as sb
from simbrake.hybrid import LANDED

ARM = math.cos(math.radians(13.5))


def chain(
    n=4,
    f=0.3,
    beta=27.0,
    R_b=ARM,
    J=4.0,
    C=5.0 / ARM,
    T0=1.0,
    w0=1.0,
    m=1e-3,
    K=1e3,
    damping=0.0,
    end=5.6,
    law=None,
    lever=None,
    load=None,
    x0=None,
    heat=None,
    ratio=0.05,
):
    """Four equal linings as in the checked figures of model §3.1 ("arms as Z": R_b := R
    c, C := C_Z/c).

    Lever and load are points `(times, values)`, so that all runs share one program, or
    parts of their own.
    """
    lever = profile(*lever, 7) if isinstance(lever, tuple) else lever
    load = sb.TorqueLoad(profile(*load, 6)) if isinstance(load, tuple) else load
    return sb.Scene(
        sb.Brake(
            sb.Pulley(R_b, J),
            sb.Band(R_b, C, sb.Segments(K, ratio, damping)),
            sb.Lining(
                law or sb.ConstantFriction(f), np.full(n, math.radians(beta)), mass=m
            ),
        ),
        sb.Duty(
            lever or profile((0.0,), (T0,), 7),
            load or sb.TorqueLoad(profile((0.0,), (0.0,), 6)),
        ),
        sb.Initial(w0, T0 / C if x0 is None else x0),
        end,
        heat,
    )


def drawworks(n, K=1e7, m=3.5, end=1.5, law=None):
    """A stop like that of the main scenario, with softer segments."""
    linings = sb.uniform_linings(
        n, math.radians(270.0), law or sb.ConstantFriction(0.35), mass=m
    )
    return sb.Scene(
        sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, 1e5, sb.Segments(K)), linings),
        sb.Duty(
            sb.PiecewiseLinear([0.0, 0.35], [2e3, 24e3]), sb.HookLoad(60e3, 0.4, 8)
        ),
        sb.Initial(24.0, 2e3 / 1e5),
        end,
    )


def run(scene, rtol=1e-10, max_steps=None):
    return sb.simulate(scene, rtol=rtol, max_steps=max_steps, throw=False).record


def changes(record):
    """Every change of mode: time, the mode before and the mode after, as NumPy
    arrays."""
    rows = record.rows
    t = np.asarray(record.rows.t)
    modes = jax.tree.map(np.asarray, jax.vmap(record.flat.unpack_mode)(rows.mode))
    found = np.flatnonzero(np.asarray(rows.kind)[: int(record.count)] >= LANDED)
    return [
        (t[i + 1], *(jax.tree.map(lambda x, j=j: x[j], modes) for j in (i, i + 1)))
        for i in found
    ]


def stop_of(record):
    """The first time at which the pulley came to rest."""
    return next(
        t
        for t, before, after in changes(record)
        if after.band == sb.results.BandMode.HELD != before.band
    )


def full_slip_of(record):
    return next(t for t, _, after in changes(record) if np.all(after.own.linings > 0))


def first_slips(record):
    """When each lining first let go."""
    found = changes(record)
    n = found[0][1].own.linings.shape[0]
    return np.asarray(
        [
            next((t for t, _, after in found if after.own.linings[i] != 0), np.nan)
            for i in range(n)
        ]
    )


@functools.partial(eqx.filter_jit)
def looked(record):
    """Flows, states and modes at the start of every row."""
    flat = record.flat

    def at(t, y, mode):
        y = flat.unpack_state(y)
        mode = flat.unpack_mode(mode)
        return record.system.variables(t, y, mode).contact, y, mode

    return jax.vmap(at)(record.rows.t, record.rows.y, record.rows.mode)


def first_and_stop(scene, rtol=1e-13, max_steps=8192):
    """First slip of any lining and the stopping time, traced."""
    rows = run(scene, rtol, max_steps).rows
    n = scene.brake.linings.count
    landed = rows.kind == LANDED
    first = jnp.argmax(landed & (rows.guard < n))
    return jnp.stack(
        [rows.t[first + 1], rows.t[jnp.argmax(landed & (rows.guard == 3 * n)) + 1]]
    )
