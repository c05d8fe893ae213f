"""Systems that share their algebra: closed forms of a run, derivatives, events."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import DOPRI8, all_equal, all_near, near, settings

import simbrake as sb
from simbrake.hybrid import largest, smallest

#: mass, static and kinetic friction (N), rate of the pull (N/s), and when it ends
M = 2.0
F_S = 3.0
F_K = 2.0
RATE = 1.5
UNTIL = 4.0
END = 8.0


class Block(NamedTuple):
    x: Any
    v: Any


class Forces(NamedTuple):
    pull: Any
    spare: Any  # of the static friction
    a: Any


def forces(m, t, y, mode):
    pull = jnp.where(mode[1] == 0, RATE * t, 0.0)
    slides = mode[0] == 1
    return Forces(pull, F_S - pull, jnp.where(slides, (pull - F_K) / m, 0.0))


class Shared(sb.hybrid.AbstractSemiExplicitSystem):
    """A block on a plane under a pull that grows up to a known time and then is gone;
    mode (slides, pull is over)."""

    m: Any

    def reset(self, t, y, before, after):
        return Block(y.x, jnp.where(after[0] == 0, 0.0, y.v))

    def next_stop(self, mode):
        return jnp.where(mode[1] == 0, UNTIL, jnp.inf)

    def scales(self):
        return Block(1.0, 1.0)

    def variables(self, t, y, mode):
        return forces(self.m, t, y, mode)

    def rates(self, t, y, mode, z):
        return Block(y.v, z.a)

    def margins(self, t, y, mode, z):
        return jnp.where(mode[0] == 0, z.spare, y.v)[None]

    def change(self, now, fired, at_stop):
        # the rate of a variable along the motion decides: the pull must grow where the
        # block lets go
        lets_go = fired[0] & ((now.mode[0] == 1) | (now.z_rate.spare < 0))
        return jnp.stack(
            [
                now.mode[0] ^ lets_go.astype(jnp.int32),
                now.mode[1] | at_stop.astype(jnp.int32),
            ]
        ), 0


def run(m):
    start = Block(jnp.zeros(()), jnp.zeros(()))
    mode = jnp.zeros(2, jnp.int32)
    return sb.hybrid.hybridsolve(
        Shared(jnp.asarray(m)),
        start,
        mode,
        0.0,
        END,
        DOPRI8,
        settings(1e-11, max_steps=128),
    )


def closed_form(m):
    """Time of letting go, of the stop, and the distance: m v̇ = r t − F_k, then
    −F_k."""
    t0 = F_S / RATE
    dv = (RATE * (UNTIL**2 - t0**2) / 2 - F_K * (UNTIL - t0)) / m
    dx = (
        RATE * ((UNTIL**3 - t0**3) / 6 - t0**2 * (UNTIL - t0) / 2)
        - F_K * (UNTIL - t0) ** 2 / 2
    ) / m
    return t0, UNTIL + m * dv / F_K, dx + m * dv**2 / (2 * F_K)


@pytest.fixture(scope="module")
def record():
    return jax.jit(run)(M)


def test_events_have_kinds_times_and_modes(record):
    let_go, stop, _ = closed_form(M)
    events = [event for event in record.events if event.time > 0]
    assert [event.kind for event in events] == [
        sb.hybrid.EventKind.GUARD,
        sb.hybrid.EventKind.KNOWN_TIME,
        sb.hybrid.EventKind.GUARD,
    ]
    all_near([event.time for event in events], [let_go, UNTIL, stop], 1e-11)
    assert [event.guard for event in events] == [0, None, 0]
    assert [tuple(event.before) for event in events] == [(0, 0), (1, 0), (1, 1)]
    assert [tuple(event.after) for event in events] == [(1, 0), (1, 1), (0, 1)]


def test_derivatives_of_the_closed_form(record):
    distance = float(record.y_end.x)
    near(distance, closed_form(M)[2], 1e-10)

    def end(m):
        return run(m).y_end.x

    forwards, backwards = jax.jit(
        lambda m: (jax.jvp(end, (m,), (jnp.ones(()),))[1], jax.grad(end)(m))
    )(jnp.asarray(M))
    # dx ∝ 1/m, and so is v² m
    near(forwards, -distance / M, 1e-9)
    near(backwards, forwards, 1e-12)


@pytest.mark.parametrize(
    "x", [[1.0, 3.0, 2.0], [2.0, 2.0, 1.0], [-4.0, -1.0], [0.0, 0.0], [5.0]]
)
def test_derivative_of_the_largest_entry(x):
    x = np.asarray(x)
    one_hot = np.eye(len(x))[np.argmax(x)]
    assert float(largest(x)) == max(x)
    all_equal(jax.grad(largest)(x), one_hot)
    all_equal(jax.jacfwd(largest)(x), one_hot)
    assert float(smallest(-x)) == -max(x)
    all_equal(jax.grad(smallest)(-x), one_hot)
