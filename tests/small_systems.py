"""Small hybrid systems that test the integrator without any brake: exact solutions,
guards given over time."""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from simbrake.hybrid import LANDED, AbstractHybridSystem

# --- systems -------------------------------------------------------------------------


class Oscillator(NamedTuple):
    x: Any
    v: Any


STICK = 0
SLIP = 1


class Smooth(AbstractHybridSystem):
    """An initial value problem without events, base of the others."""

    def guards(self, t, y, mode):
        return jnp.ones(1)

    def transition(self, t, y, mode, fired, at_stop):
        return mode, 0

    def reset(self, t, y, before, after):
        return y

    def next_stop(self, mode, y=None):
        return math.inf

    def scales(self):
        return Oscillator(1.0, 1.0)


class BeltOscillator(Smooth):
    """Mass on a spring dragged by a belt: `m ẍ + k x = F`, sticks while `|k x| ≤ F_s`,
    slips with `F_k`.

    From `x = F_s/k`, `v = v_b` with `Δ = (F_s − F_k)/k`, `ω = √(k/m)`: slip lasts
    `(2/ω)(π − atan(Δω/v_b))`, stick `2Δ/v_b`. With `decay` > 0 the slip law is
    `F_s/(1 + decay |v_rel|)` (Leine et al. 1998).
    """

    m: Any = 1.0
    k: Any = 1.0
    F_s: Any = 1.0
    F_k: Any = 0.6
    v_b: Any = 0.2
    decay: Any = None

    def force(self, v):
        if self.decay is None:
            return self.F_k
        return self.F_s / (1 + self.decay * (self.v_b - v))

    def rhs(self, t, y, mode):
        slip = (self.force(y.v) - self.k * y.x) / self.m
        return Oscillator(y.v, jnp.where(mode == STICK, 0.0, slip))

    def guards(self, t, y, mode):
        stick = 1 - self.k * y.x / self.F_s
        slip = (self.v_b - y.v) / self.v_b
        return jnp.where(mode == STICK, stick, slip)[None]

    def transition(self, t, y, mode, fired, at_stop):
        return 1 - mode, 0

    def reset(self, t, y, before, after):
        x = jnp.where(after == SLIP, self.F_s / self.k, y.x)
        return Oscillator(x, jnp.where(after == STICK, self.v_b, y.v))


class Robertson(Smooth):
    """Chemical kinetics, stiff over eleven decades of time:
    `ẏ_1 = −k_1 y_1 + k_3 y_2 y_3`, `ẏ_3 = k_2 y_2²`.

    Reference: Mazzia & Magherini, *Test Set for Initial Value Problem Solvers*, ROBER.
    """

    def rhs(self, t, y, mode):
        slow = 0.04 * y[0] - 1e4 * y[1] * y[2]
        fast = 3e7 * y[1] ** 2
        return jnp.stack([-slow, slow - fast, fast])

    def scales(self):
        return jnp.asarray([1e-6, 1e-12, 1.0])


class VanDerPol(Smooth):
    """Relaxation oscillator in its scaled form, `ẏ_2 = ((1 − y_1²) y_2 − y_1)/ε`; the
    same test set, VDPOL."""

    def rhs(self, t, y, mode):
        return jnp.stack([y[1], ((1 - y[0] ** 2) * y[1] - y[0]) / 1e-6])

    def scales(self):
        return 1.0


class CoulombOscillator(Smooth):
    """Free oscillator with Coulomb friction, `ẍ + x = −F sgn ẋ`; `mode` is the sign of
    `ẋ`, 0 at rest."""

    F: Any = 0.15

    def rhs(self, t, y, mode):
        moving = mode != 0
        return Oscillator(
            jnp.where(moving, y.v, 0.0),
            jnp.where(moving, -y.x - self.F * mode.astype(float), 0.0),
        )

    def guards(self, t, y, mode):
        return jnp.where(mode == 0, 1.0, mode.astype(float) * y.v)[None]

    def transition(self, t, y, mode, fired, at_stop):
        return jnp.where(jnp.abs(y.x) <= self.F, 0, -jnp.sign(y.x).astype(int)), 0

    def reset(self, t, y, before, after):
        return Oscillator(y.x, 0.0 * y.v)


class Filippov(Smooth):
    """`ẋ = −2` if `x > y` else 2; `ẏ = −3` if `y > x` else 1.5: from (1.5, 1) slides
    along `x = y` at −6/17 from 1/7.

    Modes +1 above, −1 below, 0 sliding; on the line `ẋ = ẏ` fixes the convex weight.
    """

    def rhs(self, t, y, mode):
        above = jnp.asarray([-2.0, 1.5])
        below = jnp.asarray([2.0, -3.0])
        n_above = above[0] - above[1]
        n_below = below[0] - below[1]
        weight = n_below / (n_below - n_above)
        slide = weight * above + (1 - weight) * below
        return jnp.where(mode == 0, slide, jnp.where(mode > 0, above, below))

    def guards(self, t, y, mode):
        return jnp.where(mode == 0, 1.0, mode.astype(float) * (y[0] - y[1]))[None]

    def transition(self, t, y, mode, fired, at_stop):
        return 0 * mode, 0

    def scales(self):
        return 1.0


class BouncingBall(Smooth):
    """FMI reference model: falls with `g`, leaves each impact with `e` of its speed,
    rests below `v_min`."""

    g: Any = 9.81
    e: Any = 0.7
    v_min: Any = 0.1

    def rhs(self, t, y, mode):
        return Oscillator(
            jnp.where(mode == 0, y.v, 0.0), jnp.where(mode == 0, -self.g, 0.0)
        )

    def guards(self, t, y, mode):
        return jnp.where(mode == 0, y.x, 1.0)[None]

    def transition(self, t, y, mode, fired, at_stop):
        return jnp.where(-self.e * y.v < self.v_min, 1, 0), 0

    def reset(self, t, y, before, after):
        return Oscillator(0.0 * y.x, jnp.where(after == 1, 0.0, -self.e * y.v))


def arrays(system):
    """The same system with every number as an array, so that a new value never
    re-traces."""
    return jax.tree.map(
        lambda x: jnp.asarray(x, jnp.float64) if isinstance(x, float) else x, system
    )


def first_event_times(record, count):
    """Times of the first `count` events that guards made after the start, traced."""
    i = jnp.flatnonzero(record.rows.kind == LANDED, size=count, fill_value=0)
    return record.rows.t[i + 1]
